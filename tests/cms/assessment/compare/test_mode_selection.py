from dataclasses import replace

import numpy as np
import pytest
import scipy.linalg as la
from numpy.testing import assert_allclose

import cms.assessment.compare.mode_selection
from cms.assessment.compare.mode_selection import select_modes
from cms.assessment.quality.of_reduction.frf import frequency_grid
from cms.errors import ModeSetError
from cms.modes.families.families import Families
from cms.modes.mode_set import ModeSet
from cms.modes.mode_sets import MODE_SETS, craig_bampton
from cms.modes.mode_sets.extra_columns import with_load_cases
from cms.reduction.reduction import reduce
from fe_models.body.couplings.couplings import couple
from fe_models.body.load_cases import LoadCase
from fe_models.foundation.units import unit_system
from tests.bodies import bar

BAND = (0.0, 2500.0)


@pytest.fixture(scope="module")
def body():
    return couple(bar(nx=12, kind="hexahedron"))


@pytest.fixture(scope="module")
def families(body):
    with Families(body) as shared:
        yield shared


@pytest.fixture(scope="module")
def full(body):
    return la.eigh(body.K.toarray(), body.M.toarray())


def frequency_error(body, full, modes, band=BAND):
    exact = np.sqrt(full[0][6:]) / (2 * np.pi)
    exact_in_band = np.flatnonzero((exact >= band[0]) & (exact <= band[1]))
    found = reduce(body, modes).free_frequencies
    if len(found) <= exact_in_band[-1]:
        return np.inf
    return np.abs(found[exact_in_band] / exact[exact_in_band] - 1).max()


def response(body, omega2, Phi, grid):
    """Receptance of the two reference nodes, 1 % in every elastic mode, rotations at the length of the body."""
    rows = np.concatenate([interface.dofs for interface in body.interfaces])
    scale = np.tile(np.repeat([1.0, body.length], 3), 2)[:, None]
    p, w = scale * Phi[rows], 2 * np.pi * grid[:, None]
    omega = np.sqrt(np.maximum(omega2, 0.0))
    omega[:6] = 0.0
    gain = 1 / (omega**2 - w**2 + 2j * 0.01 * omega * w)
    return np.einsum("ak,fk,bk->fab", p, gain, p, optimize=True)


def response_error(body, full, modes, grid):
    V = modes.columns / np.linalg.norm(modes.columns, axis=0)
    omega2, Y = la.eigh(V.T @ (body.K @ V), V.T @ (body.M @ V))
    H, exact = response(body, omega2, V @ Y, grid), response(body, *full, grid)
    error = np.linalg.norm(H - exact, axis=(1, 2)) / np.linalg.norm(exact, axis=(1, 2))
    f = np.log(grid)
    return np.sqrt(np.trapezoid(error**2, f) / (f[-1] - f[0]))


@pytest.mark.parametrize("name", ["craig-bampton", "craig-bampton-ir", "rubin", "herting", "craig-chang"])
def test_one_mode_less_misses_the_frequency_error(body, full, families, name):
    found = select_modes(families, set=name, error=2e-3, band=BAND)
    error, before = (
        frequency_error(body, full, MODE_SETS[name](families, n_modes=n)) for n in (found.n_modes, found.n_modes - 1)
    )
    assert error <= 2e-3 < before
    assert_allclose(found.error, error, rtol=1e-4, atol=1e-9)


@pytest.mark.parametrize("name", ["craig-bampton", "rubin"])
def test_one_mode_less_misses_the_response_error(body, full, families, name):
    band, tolerance = (30.0, 2000.0), 0.02
    found = select_modes(families, set=name, error=tolerance, band=band, measure="frf")
    grid = frequency_grid(*band)
    error, before = (
        response_error(body, full, MODE_SETS[name](families, n_modes=n), grid)
        for n in (found.n_modes, found.n_modes - 1)
    )
    assert error <= tolerance < before
    assert_allclose(found.error, error, rtol=1e-3)


def test_sets_of_one_span_need_the_same_number_by_either_search(body, families):
    """Rubin is searched by subspaces, Craig-Chang by bisection."""
    numbers = {
        name: select_modes(families, set=name, error=1e-3, band=BAND, measure="frf").n_modes
        for name in ("rubin", "craig-chang")
    }
    assert numbers["rubin"] == numbers["craig-chang"]


def test_every_number_up_to_the_choice_was_tried_and_the_choice_is_the_first_that_meets(body, families):
    found = select_modes(families, error=1e-2, band=BAND)
    assert [trial.n_modes for trial in found.history] == list(range(found.n_modes + 1))
    assert all(trial.error > 1e-2 for trial in found.history[:-1])
    assert found.history[-1].n_columns == 12 + found.n_modes == found.modes.columns.shape[1]


def test_the_choice_does_not_depend_on_the_size_of_the_first_set(body, families, monkeypatch):
    once = select_modes(families, error=2e-3, band=BAND)
    monkeypatch.setattr(cms.assessment.compare.mode_selection, "FEWEST", 1)
    monkeypatch.setattr(
        "cms.assessment.quality.reference.full_reference.FullReference.n_band", property(lambda self: 1)
    )  # the set grows from two modes on
    grown = select_modes(families, error=2e-3, band=BAND)
    assert grown.n_modes == once.n_modes
    assert [t.n_modes for t in grown.history] == [t.n_modes for t in once.history]
    assert_allclose([t.error for t in grown.history], [t.error for t in once.history], rtol=1e-5)


def test_the_sentence_says_what_was_chosen_and_why(body, families):
    found = select_modes(families, error=2e-3, band=BAND)
    n, columns = found.n_modes, 12 + found.n_modes
    assert found.sentence.startswith(
        f"craig-bampton: {n} modes are the fewest for a frequency error of at most 0.002 from 0 to 2500 Hz: "
        f"{found.error:.3g} with these {columns} columns, largest at free mode "
    )
    assert found.sentence.endswith(f"; {found.history[-2].error:.3g} with one mode less")
    assert found.modes.options["selected"] == found.sentence


def test_no_modes_are_needed_where_the_static_set_does(body, families):
    found = select_modes(families, error=0.3, band=(0.0, 400.0))
    assert found.n_modes == 0
    assert "no vibration modes are needed" in found.sentence


def test_sets_without_vibration_modes_are_chosen_too(body, full, families):
    found = select_modes(families, set="krylov", error=1e-3, band=BAND)
    assert frequency_error(body, full, MODE_SETS["krylov"](families, n_modes=found.n_modes)) <= 1e-3
    assert found.n_modes > 0


def test_columns_that_are_added_count(body, families):
    f = np.zeros(body.n_dof)
    f[60] = 1.0
    loaded = replace(body, load_cases=(LoadCase("push", "force", f),))
    with Families(loaded) as own:
        found = select_modes(own, error=5e-3, band=BAND, added=lambda modes: with_load_cases(modes, loaded))
        plain = select_modes(own, error=5e-3, band=BAND)
    assert any(label.startswith("load case push") for label in found.modes.labels)
    assert found.n_modes <= plain.n_modes


def test_the_band_is_in_hertz_whatever_the_unit_of_time(body, families):
    slow = select_modes(families, error=2e-3, band=BAND)
    fast = replace(body, units=unit_system("mm-kg-ms"))
    found = select_modes(fast, error=2e-3, band=(0.0, BAND[1] * 1e3))
    assert found.n_modes == slow.n_modes


@pytest.mark.parametrize(
    ("options", "text"),
    [
        ({"set": "craig-bamton"}, "did you mean 'craig-bampton'"),
        ({"set": "guyan"}, "has no number of modes to choose"),
        ({"measure": "fft"}, "unknown measure 'fft'"),
        ({"error": 0.0}, "between 0 and 1"),
        ({"band": (5.0, 2.0)}, "0 <= from < to"),
        ({"band": (10.0, 20.0)}, "no elastic free mode .* the first is at"),
    ],
)
def test_bad_options_are_refused(families, options, text):
    with pytest.raises(ModeSetError, match=text):
        select_modes(families, **{"error": 1e-3, "band": BAND} | options)


def test_an_error_that_cannot_be_met_tells_the_best():
    body = couple(bar(nx=2, kind="hexahedron"))
    with pytest.raises(
        ModeSetError, match=r"does not meet a frequency error of 1e-09 .* with up to 11 modes; the best was 1"
    ):
        select_modes(body, error=1e-9, band=(0.0, 20_000.0))


@pytest.mark.parametrize("name", ["craig-bampton", "craig-chang"])
def test_the_search_gives_up_where_it_is_told_to(body, families, name):
    with pytest.raises(ModeSetError, match=r"with up to 5 modes; the best was .* with 5"):
        select_modes(families, set=name, error=1e-6, band=BAND, measure="frf", most=5)


def test_the_chosen_set_is_the_set_itself(body, families):
    found = select_modes(families, error=2e-3, band=BAND)
    direct = craig_bampton(families, n_modes=found.n_modes)
    assert found.modes.labels == direct.labels
    assert_allclose(found.modes.columns, direct.columns, rtol=0, atol=0)


@pytest.mark.parametrize("name", ["craig-bampton", "craig-bampton-ir", "rubin", "normal"])
@pytest.mark.parametrize("error", [1e-2, 1e-4])
def test_the_estimate_chooses_modes_whose_true_error_is_small_enough(body, full, families, name, error):
    """As many as the full model would choose for this error, or more: at most as many as for half of it."""
    chosen = select_modes(families, set=name, error=error, band=BAND, measure="estimate")
    assert frequency_error(body, full, chosen.modes) <= error
    least, most = (select_modes(families, set=name, error=each, band=BAND).n_modes for each in (error, error / 2))
    assert least <= chosen.n_modes <= most
    assert "as counted" in chosen.sentence
    assert chosen.modes.options["error"] == f"{error:g}"


def test_a_mode_that_the_set_lacks_is_missed_by_the_count(body, families):
    """Normal modes without the second one: its place is taken by the third, which has no error of its own."""

    def without_the_second(modes):
        kept = np.arange(len(modes.labels)) != np.flatnonzero(~modes.is_static)[1]
        labels = tuple(label for label, keep in zip(modes.labels, kept, strict=True) if keep)
        return ModeSet("normal", modes.columns[:, kept], labels, modes.frequencies[kept])

    asked = {"set": "normal", "error": 1e-3, "band": BAND, "measure": "estimate", "most": 20}
    assert select_modes(families, **asked).n_modes < 20
    with pytest.raises(
        ModeSetError, match=r"does not meet an estimated error of the free frequencies of 0.001 .* with up to 20 modes"
    ):
        select_modes(families, **asked, added=without_the_second)


def test_the_estimate_solves_no_full_model(families, monkeypatch):
    monkeypatch.setattr(Families, "free_modes", lambda *_: pytest.fail("the full model was solved"))
    select_modes(families, set="craig-bampton", error=1e-3, band=BAND, measure="estimate")


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"set": "guyan"}, "has no number of modes to choose"),
        ({"band": (0.0, 5.0)}, "no elastic free mode of body 'bar' lies below 5 Hz"),
        ({"measure": "estimates"}, "unknown measure 'estimates'; did you mean 'estimate'"),
    ],
)
def test_what_the_estimate_cannot_choose_is_refused(families, options, message):
    asked = {"set": "craig-bampton", "error": 1e-3, "band": BAND, "measure": "estimate", **options}
    with pytest.raises(ModeSetError, match=message):
        select_modes(families, **asked)
