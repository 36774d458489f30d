"""Critical amplitudes of the unit loads: columns, whirling shafts, what a file without the matrices says."""

from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose

import cms
from cms.assessment.quality.of_body.buckling import check_buckling, critical_loads
from cms.reduction.basis.frames import NodalFrame
from fe_models.elements.beams.sections import Rectangle
from tests.bodies import STEEL
from tests.cms.command import run_cms
from tests.cms.reduction.geometric_stiffness.examples import bar_of_beams

SECTION = Rectangle(0.02, 0.01)
EI = STEEL.E * 0.02 * 0.01**3 / 12


@pytest.fixture(scope="module")
def bars():
    """A slender bar on its left end, and the free one."""
    body = cms.couple(bar_of_beams(16, section=SECTION))
    with cms.modes.Families(body) as families:
        modes = cms.craig_bampton(families, n_modes=12)
        return [cms.reduce(families, modes, frame=frame, geometric=True) for frame in (NodalFrame("left"), None)]


def by_name(reduced):
    return {load.load: load for load in critical_loads(reduced)}


def test_a_cantilever_buckles_under_the_load_of_euler(bars):
    load = by_name(bars[0])["force x at right"]
    assert_allclose(load.against, np.pi**2 * EI / 4, rtol=2e-3)
    assert load.along == np.inf
    assert load.unit == "N"
    assert "force x at left" not in by_name(bars[0])  # the held interface


def test_a_cantilever_buckles_under_its_own_weight(bars):
    """g rho A L³ / EI = 7.8373 (Greenhill); the frame accelerates against gravity, away from its tip."""
    load = by_name(bars[0])["acceleration x"]
    assert_allclose(load.along, 7.8373 * EI / (STEEL.rho * 0.02 * 0.01), rtol=2e-3)


def test_a_shaft_has_its_first_bending_frequency_as_critical_speed(bars):
    """A cantilevered shaft about its axis: rotary inertia is negligible here."""
    speed = by_name(bars[0])["angular velocity x"]
    assert_allclose(speed.along, 2 * np.pi * bars[0].frequencies[0], rtol=2e-3)
    assert speed.against == np.inf


def test_a_free_bar_pushed_at_one_end_buckles_as_it_accelerates(bars):
    """N = -P x/L along a free beam: the least of the Ritz values of an independent basis."""
    x, weight = np.polynomial.legendre.leggauss(40)
    x, weight = (x + 1) / 2, weight / 2
    shapes = [np.polynomial.Legendre.basis(k, domain=[0, 1]) for k in range(2, 14)]
    slope, curvature = (np.array([s.deriv(d)(x) for s in shapes]) for d in (1, 2))
    # the frame does not turn with the rigid rotation: it is that of mean axes, ∫ x w = 0 = ∫ w, as Legendre's k >= 2
    import scipy.linalg as la

    K, K_geo = (curvature * weight) @ curvature.T, (slope * weight * x) @ slope.T
    expected = EI / la.eigh(K_geo, K, eigvals_only=True)[-1]
    assert_allclose(by_name(bars[1])["force x at right"].against, expected, rtol=3e-3)


def test_the_record_names_the_loads_and_is_a_number(bars):
    record = check_buckling(bars[0])
    assert record.verdict == "pass"
    assert "force x at right: -" in record.reason
    assert "angular velocity x" in record.reason
    soft = replace(bars[0], K=bars[0].K * 1e-9)
    assert check_buckling(soft).verdict == "warn"


def test_other_units_are_the_same_loads(bars):
    mm = by_name(cms.body.convert_units(bars[0], "mm-t-s"))
    for name, load in by_name(bars[0]).items():
        scale = {"m/s²": 1e3, "N m": 1e3}.get(load.unit, 1.0)
        assert_allclose([mm[name].along, mm[name].against], [load.along * scale, load.against * scale], rtol=1e-9)


def test_a_file_without_the_matrices_says_so(bars):
    record = check_buckling(replace(bars[0], geometric=None))
    assert record.verdict == "info"
    assert "no geometric stiffness" in record.reason


def test_the_command_lists_the_loads(bars, tmp_path):

    cms.write(bars[0], tmp_path / "bar.h5")
    result = run_cms("check", tmp_path / "bar.h5")
    assert "Loads that buckle the body" in result.output
    assert "force x at right" in result.output
