"""Damping of modes: what a ratio means, by frequency, by mode, and in which units."""

import numpy as np
import pytest
from numpy.testing import assert_allclose

from cms.assessment.quality.body_check import check_body
from cms.body.modal_file.file import convert_units
from cms.errors import ModeSetError
from cms.modes.mode_sets import craig_bampton
from cms.reduction.basis.damping import (
    ModalDamping,
    PerModeDamping,
    RampDamping,
    RayleighDamping,
    damping_of_words,
    for_readers,
    modal_damping,
    stated_damping,
)
from cms.reduction.basis.frames import NodalFrame
from cms.reduction.frame_conversion import convert_frame
from cms.reduction.reduction import reduce
from fe_models.body.couplings.couplings import couple
from tests.bodies import bar

HERTZ = np.array([50.0, 99.9, 100.1, 999.0, 1001.0, 1e5])
K = np.diag((2 * np.pi * HERTZ) ** 2)


def ratios_of(D, K):
    return np.diag(D) / (2 * np.sqrt(np.diag(K)))


@pytest.mark.parametrize(
    ("damping", "sentence"),
    [
        (ModalDamping(0.015), "1.5 % of critical in every mode"),
        (PerModeDamping((0.5,), heavy=True), "50 % of critical in every mode"),
        (PerModeDamping((0.01, 0.02)), "1 %, 2 % of critical by mode, the last for all further modes"),
        (RampDamping(((60.0, 0.02),), above=0.5), "2 % below 60 Hz, 50 % above, of critical"),
        (RayleighDamping(3.0, 1e-6), "alpha M + beta K with alpha = 3, beta = 1e-06"),
        ("strain patterns 0123 (4, beta = 1e-06)", "strain patterns 0123 (4, beta = 1e-06)"),
        ("none", "none"),
    ],
)
def test_readers_get_a_sentence(damping, sentence):
    assert for_readers(str(damping)) == sentence


def test_the_ramp_steps_at_its_frequencies():
    """1 % below 100 Hz, 10 % below 1 kHz, critical from there on."""
    assert_allclose(ratios_of(modal_damping(RampDamping(), np.eye(6), K), K), [0.01, 0.01, 0.1, 0.1, 1, 1], rtol=1e-14)
    own = RampDamping(((60.0, 0.02),), above=0.5)
    assert_allclose(ratios_of(modal_damping(own, np.eye(6), K), K), [0.02, *[0.5] * 5], rtol=1e-14)


def test_the_ramp_is_in_hertz_whatever_the_time_unit():
    """The same modes in a millisecond system: K and D are numbers per ms² and per ms."""
    D = modal_damping(RampDamping(), np.eye(6), K)
    in_ms = modal_damping(RampDamping(), np.eye(6), K * 1e-6, second=1e-3)
    assert_allclose(in_ms, D * 1e-3, rtol=1e-14)


def test_stated_rayleigh_damping_is_in_the_units_of_the_body():
    """Its text keeps the units of the reduction; a second conversion does not lose them."""
    body = couple(bar(nx=2))
    made = reduce(body, craig_bampton(body, n_modes=3), damping=RayleighDamping(3.0, 2e-4))
    in_ms = convert_units(made, "mm-kg-ms")
    for each in (made, in_ms, convert_units(made, "mm-t-s"), convert_units(in_ms, "mm-t-s")):
        assert_allclose(modal_damping(stated_damping(each), each.M, each.K), each.D, rtol=1e-12)
        assert {record.name: record.verdict for record in check_body(each)}["damping-told"] == "pass"
    converted = convert_frame(in_ms, NodalFrame("left"), damping=RayleighDamping(2e-3, 0.3))
    for each in (converted, convert_units(converted, "mm-t-s")):
        assert_allclose(modal_damping(stated_damping(each), each.M, each.K), each.D, rtol=1e-12)


def test_the_last_ratio_of_a_list_holds_for_all_further_modes():
    D = modal_damping(PerModeDamping((0.01, 0.03, 0.02)), np.eye(6), K)
    assert_allclose(ratios_of(D, K), [0.01, 0.03, 0.02, 0.02, 0.02, 0.02], rtol=1e-14)


def test_a_ratio_is_the_logarithmic_decrement_of_its_mode():
    """Free vibration x'' + d x' + k x = 0 falls by exp(-2 pi zeta / sqrt(1 - zeta²)) a period, by its eigenvalues."""
    D = modal_damping(ModalDamping(0.05), np.eye(6), K)
    for d, k in zip(np.diag(D), np.diag(K), strict=True):
        s = np.linalg.eigvals(np.array([[0, 1], [-k, -d]]))[0]
        decrement = -2 * np.pi * s.real / abs(s.imag)
        assert_allclose(decrement, 2 * np.pi * 0.05 / np.sqrt(1 - 0.05**2), rtol=1e-10)


def test_rayleigh_mixes_mass_and_stiffness_and_massless_shapes_have_no_ratio():
    assert_allclose(modal_damping(RayleighDamping(3.0, 1e-5), np.eye(6), K), 3 * np.eye(6) + 1e-5 * K, rtol=1e-14)
    M = np.diag([1.0, 1, 1, 1, 1, 0])
    assert modal_damping(RampDamping(), M, K)[5, 5] == 0
    assert modal_damping(ModalDamping(0.1), M, K)[5, 5] == 0


def test_the_ratios_are_those_of_the_modes_of_the_frame():
    body = couple(bar(nx=4, kind="hexahedron"))
    modes = craig_bampton(body, n_modes=2)
    hertz = reduce(body, modes).frequencies
    low, high = hertz[1] + 1.0, hertz[3] + 1.0
    for frame in (None, NodalFrame("left")):
        reduced = reduce(body, modes, frame=frame, damping=RampDamping(((low, 0.02), (high, 0.05))))
        expected = np.where(reduced.frequencies < low, 0.02, np.where(reduced.frequencies < high, 0.05, 1.0))
        assert set(expected) == {0.02, 0.05, 1.0}
        assert_allclose(ratios_of(reduced.D, reduced.K), expected, rtol=1e-12)


def test_impossible_dampings_are_refused():
    for make, words in [
        (lambda: ModalDamping(-0.1), "ratio = -0.1; expected 0 to 1"),
        (lambda: PerModeDamping(()), "expected at least one"),
        (lambda: PerModeDamping((0.1, np.nan)), "ratios = nan"),
        (lambda: ModalDamping(2.0), "ratio = 2.0; expected 0 to 1"),
        (lambda: PerModeDamping((0.02, 1.01)), "ratios = 1.01; expected 0 to 1"),
        (lambda: RampDamping(((50.0, 3.0),)), "steps = 3.0; expected 0 to 1"),
        (lambda: RampDamping(((100.0, 0.1), (50.0, 0.2))), "ascending"),
        (lambda: RampDamping(((0.0, 0.1),)), "ascending"),
        (lambda: RampDamping(()), "ascending"),
        (lambda: RampDamping(above=-1.0), "above = -1"),
        (lambda: RayleighDamping(-1.0), "alpha = -1"),
        (lambda: modal_damping(PerModeDamping((0.1,) * 7), np.eye(6), K), "7 ratios, but only 6 modes"),
    ]:
        with pytest.raises(ModeSetError, match=words):
            make()


def test_a_ratio_above_a_fifth_must_be_confirmed():
    """0.5 may be meant as 0.5 %; the ratio above the last step of a ramp damps modes above the band of interest."""
    for kind, value in ((ModalDamping, 0.35), (PerModeDamping, (0.02, 0.35)), (RampDamping, ((70.0, 0.35),))):
        with pytest.raises(ModeSetError, match=r"= 0.35: this is 35 % of critical .* heavy = true .* write 0.0035"):
            kind(value)
        meant = kind(value, heavy=True)
        assert damping_of_words(str(meant)) == meant
    assert ModalDamping(0.2).ratio == 0.2
    assert RampDamping(((70.0, 0.05),), above=0.9).above == 0.9
