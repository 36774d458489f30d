"""Numbers in other units than a file names show in its size, density or first frequency."""

from dataclasses import replace

import pytest

import cms
from cms.quality.of_body.unit_hints import check_units
from fe_models.foundation.units import unit_system
from fe_models.reports.unit_check import hull_volume, implausible_motion
from tests.bodies import bar, box_mesh

SI = unit_system("m-kg-s")


@pytest.fixture(scope="module")
def reduced():
    body = cms.couple(bar(nx=4, kind="hexahedron"))
    return cms.reduce(body, cms.craig_bampton_ir(body, n_modes=2))


def test_a_steel_bar_is_plausible_and_in_other_units_it_is_not(reduced):
    assert check_units(reduced).verdict == "pass"
    other = check_units(replace(reduced, units=unit_system("mm-t-s")))
    assert other.verdict == "warn"
    assert "kg/m³" in other.reason


def test_a_frequency_beyond_the_speed_of_waves_is_told(reduced):
    """Stiffness in MPa beside densities in kg/m³: a thousand times too low; the reverse, too high."""
    first = float(reduced.free_frequencies[0])
    assert implausible_motion(SI, reduced.nodes, reduced.moments.m, first) == []
    fast = check_units(replace(reduced, free_frequencies=1e3 * reduced.free_frequencies))
    assert fast.verdict == "warn"
    assert "as if waves ran at" in fast.reason
    slow = implausible_motion(SI, reduced.nodes, reduced.moments.m, 1e-8 * first)
    assert len(slow) == 1


def test_the_hull_of_a_box_is_the_box_and_that_of_a_plate_nothing():
    nodes = box_mesh(3, 2, 2, 1.0, 0.5, 0.2).nodes
    assert hull_volume(nodes) == pytest.approx(0.1, rel=1e-12)
    nodes = nodes.copy()
    nodes[:, 2] = 0.0
    assert hull_volume(nodes) == 0.0
