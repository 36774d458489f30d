"""Numbers in other units than a file names show in its size, density or first frequency."""

from dataclasses import replace

import numpy as np
import pytest

import cms
import fe_models as fm
from cms.assessment.quality.of_body.unit_hints import check_units
from fe_models.checks.unit_check import hull_volume, implausible_motion, implausible_units
from fe_models.foundation.units import unit_system
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


def test_a_mesh_in_mm_with_a_material_in_si_is_told():
    """The shipped rod is 328 mm long; its numbers read as metres make it swing at 0.1 Hz, with the density of steel."""
    steel = fm.Material("steel", E=2.1e11, nu=0.3, rho=7850.0)
    line = fm.straight_line((0, 0, 0), (0, 0, 328.0), 8)
    ends = [fm.line_interface(line, name, fm.NodeSet(name)) for name in ("start", "end")]
    section = fm.BeamProperty(fm.Rectangle(20.0, 30.0), steel)
    body = cms.couple(fm.beam_body(line, section, name="rod", units=SI, interfaces=ends))
    reduced = cms.reduce(body, cms.craig_bampton(body, 4))
    found = check_units(reduced)
    assert found.verdict == "warn"
    assert "m large; expected 0.0001 to 50 m: is the mesh in m? (in mm the same numbers make 0.3" in found.reason
    assert f"its first elastic frequency is {reduced.free_frequencies[0]:.4g} Hz" in found.reason
    size = float(np.linalg.norm(np.ptp(line.nodes, axis=0)))
    texts = implausible_units(SI, size, [steel])
    assert [is_error for is_error, _ in texts] == [False]
    assert implausible_units(unit_system("mm-t-s"), size, [replace(steel, E=2.1e5, rho=7.85e-9)]) == []
