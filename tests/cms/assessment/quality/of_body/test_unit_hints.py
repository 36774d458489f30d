"""Numbers in other units than a file names show in its size, density or first frequency."""

from dataclasses import replace

import numpy as np
import pytest

import cms
import fe_models as fm
from cms.assessment.quality.of_body.descriptions import check_units
from cms.body.reduced_body import unit_findings
from fe_models.body.unit_check import BodyNumbers, hull_volume, implausible_numbers
from fe_models.foundation.units import UNIT_SYSTEMS, unit_system
from tests.bodies import bar, box_mesh

SI = unit_system("m-kg-s")


@pytest.fixture(scope="module")
def reduced():
    body = cms.couple(bar(nx=4, kind="hexahedron"))
    return cms.reduce(body, cms.modes.craig_bampton_ir(body, n_modes=2))


def test_a_steel_bar_is_plausible_and_in_other_units_it_is_not(reduced):
    assert check_units(reduced).verdict == "pass"
    other = check_units(replace(reduced, units=unit_system("mm-t-s")))
    assert other.verdict == "warn"
    assert "kg/m³" in other.reason


def test_a_frequency_beyond_the_speed_of_waves_is_told(reduced):
    """Stiffness in MPa beside densities in kg/m³: a thousand times too low; the reverse, too high."""
    assert unit_findings(reduced) == []
    fast = check_units(replace(reduced, free_frequencies=1e3 * reduced.free_frequencies))
    assert fast.verdict == "warn"
    assert "as if waves ran at" in fast.reason
    assert len(unit_findings(replace(reduced, free_frequencies=1e-8 * reduced.free_frequencies))) == 1


def test_the_hull_of_a_box_is_the_box_and_that_of_a_plate_nothing():
    nodes = box_mesh(3, 2, 2, 1.0, 0.5, 0.2).nodes
    assert hull_volume(nodes) == pytest.approx(0.1, rel=1e-12)
    nodes = nodes.copy()
    nodes[:, 2] = 0.0
    assert hull_volume(nodes) == 0.0


OBLIQUE = np.array([0.48, -0.6, 0.64])  #: a unit vector


def rod(length, steel, units, section):
    """A rod along an oblique line, reduced."""
    line = fm.beams.straight_line((0.3, 0.1, -0.2), np.array([0.3, 0.1, -0.2]) + length * OBLIQUE, 8)
    ends = [fm.beams.line_interface(line, name, fm.selections.NodeSet(name)) for name in ("start", "end")]
    body = cms.couple(
        fm.beam_body(line, fm.beams.BeamProperty(section, steel), name="rod", units=units, interfaces=ends)
    )
    return cms.reduce(body, cms.craig_bampton(body, 4))


def test_a_mesh_in_mm_with_a_material_in_si_is_warned_of(caplog):
    """The shipped rod is 328 mm long; its numbers read as metres make it swing at 1 Hz, with the density of steel."""
    steel = fm.Material("steel", E=2.1e11, nu=0.3, rho=7850.0)
    reduced = rod(328.0, steel, "m-kg-s", fm.beams.Rectangle(20.0, 30.0))
    (warning,) = [record.getMessage() for record in caplog.records]
    size = float(np.linalg.norm(np.ptp(reduced.nodes, axis=0)))
    slow = f"{size:.4g} m large and vibrates from {reduced.free_frequencies[0]:.4g} Hz on"
    assert f"body 'rod': units m-kg-s: the body is {slow}" in warning
    assert f"expected 0.0001 to 50 m: is the mesh in m? (in mm the same numbers make {size / 1e3:.4g} m" in warning
    assert check_units(reduced).verdict == "warn"
    caplog.clear()
    rod(328.0, fm.Material("steel", E=2.1e5, nu=0.3, rho=7.85e-9), "mm-t-s", fm.beams.Rectangle(20.0, 30.0))
    assert not caplog.records


def test_a_body_in_m_read_in_mm_with_a_material_in_mm_is_warned_of(caplog):
    """A rod of 70 mm whose numbers are read as 0.07 mm."""
    rod(0.07, fm.Material("steel", E=2.1e5, nu=0.3, rho=7.85e-9), "mm-t-s", fm.beams.Rectangle(0.002, 0.003))
    assert "units mm-t-s: the body is 0.07" in caplog.text
    assert "expected 0.0001 to 1000 m: is the mesh in mm? (in m the same numbers make 0.07" in caplog.text


def test_the_frequency_of_a_warning_is_in_hertz_in_all_units():
    numbers = BodyNumbers(size=9e4, frequency=1e-4)
    ((_, text),) = implausible_numbers(unit_system("mm-kg-ms"), numbers)
    assert "9e+04 mm = 90 m large and vibrates from 0.1 Hz on" in text


def in_units(name, *, size=2.0, hull=0.5, mass=3000.0, frequency=300.0, meshed_speed=5000.0):
    """Return the unit system and the numbers in it of a body given in SI."""
    units = unit_system(name)
    return units, BodyNumbers(
        size=size / units.length, hull=hull / units.length**3, mass=mass / units.mass,
        frequency=frequency * units.time, meshed_speed=meshed_speed * units.time / units.length,
    )  # fmt: skip


@pytest.mark.parametrize("name", UNIT_SYSTEMS)
def test_speeds_and_densities_are_judged_alike_in_all_units(name):
    assert implausible_numbers(*in_units(name)) == []
    ((_, fast),) = implausible_numbers(*in_units(name, meshed_speed=4e5))
    assert "from node to node waves would run at about 4e+05 m/s" in fast
    ((_, heavy),) = implausible_numbers(*in_units(name, hull=0.0, mass=1e6))
    assert "in a cube around all nodes of" in heavy
    assert "1.25e+05 kg/m³" in heavy


def test_nodes_in_mm_beside_matrices_in_si_are_named_by_all_their_numbers():
    """A light frame of 0.2 kg/m³: its hull must become smaller by the cube of 1000."""
    units, numbers = in_units("m-kg-s", size=2e3, hull=0.5e9, meshed_speed=5e6, mass=0.1)
    assert "the nodes seem to be in mm" in implausible_numbers(units, numbers)[0][1]


@pytest.mark.parametrize("kind", ["solid", "beam", "shell"])
def test_a_body_made_in_python_of_no_solid_is_warned_of(kind, caplog):
    """Steel in t and mm, declared as SI; no other material, and nothing else of the body, is named."""
    foam = fm.Material("foam", E=2e7, nu=0.3, rho=40.0)
    steel = fm.Material("steel", E=2.1e5, nu=0.3, rho=7.85e-9)
    if kind == "solid":
        fm.solid_body(box_mesh(2, 1, 1, 2.0, 1.0, 0.5), steel, name="box", units=SI)
    elif kind == "beam":
        line = fm.beams.straight_line((0, 0, 0), OBLIQUE, 3)
        fm.beam_body(line, fm.beams.BeamProperty(fm.beams.Rectangle(0.02, 0.03), steel), name="box", units=SI)
    else:
        layers = fm.shells.LaminateProperty(
            (fm.shells.Layer(foam, 0.02), fm.shells.Layer(steel, 0.001)), direction=(1, 0, 0)
        )
        plate = fm.shells.ShellMesh(np.eye(4)[:, :3] + OBLIQUE, {"triangle": np.array([[0, 1, 2], [0, 3, 1]])})
        fm.shell_body(plate, layers, name="box", units=SI)
    (warning,) = [record.getMessage() for record in caplog.records]
    assert warning.startswith("body 'box': units m-kg-s: density of 'steel' 7.85e-09 kg/m³ = 7.85e-09 kg/m³; expected")
    assert "all numbers would fit mm-t-s" in warning or kind == "shell"  # the foam would be lighter than any solid
