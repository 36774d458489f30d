"""A model given by tables is the body that the functions for one kind of elements return."""

import numpy as np
import pytest
from numpy.testing import assert_array_equal

import fe_models as fm
from fe_models.assembly.model import FEModel
from fe_models.errors import BodyError
from tests.bodies import box_mesh

STEEL = {"young": 210e9, "poisson": 0.3, "density": 7850.0}
MATERIAL = fm.Material("steel", E=210e9, nu=0.3, rho=7850.0)
UNITS = fm.unit_system("m-kg-s")


def require_equal(body, expected):
    for A, B in ((body.M, expected.M), (body.K, expected.K)):
        assert_array_equal(A.toarray(), B.toarray())
    assert_array_equal(body.dofs, expected.dofs)


def test_a_model_of_shells_is_their_body():
    mesh = fm.shells.flat_plate(1.0, 0.5, 4, 2)
    model = FEModel.of(
        "plate", mesh, units="m-kg-s", materials={"steel": STEEL}, shells={"skin": {"thickness": 0.01}},
        interfaces={"edge": {"kind": "rigid", "nodes": "u0"}},
    )  # fmt: skip
    body = fm.assemble(model)
    require_equal(body, fm.shell_body(mesh, fm.shells.ShellProperty(0.01, MATERIAL), name="plate", units=UNITS))
    (edge,) = body.interfaces
    assert_array_equal(edge.nodes, mesh.node_sets["u0"])


def test_a_model_of_lines_is_the_body_of_its_beams():
    mesh = fm.beams.straight_line((0, 0, 0), (1, 0, 0), 4)
    model = FEModel.of(
        "rod", mesh, units="m-kg-s", materials={"steel": STEEL}, sections={"s": {"shape": "circle", "radius": 0.01}}
    )
    expected = fm.beam_body(mesh, fm.beams.BeamProperty(fm.beams.Circle(0.01), MATERIAL), name="rod", units=UNITS)
    require_equal(fm.assemble(model), expected)


LINES = fm.beams.straight_line((0, 0, 0), (1, 0, 0), 4)
ROUND = {"shape": "circle", "radius": 0.01}
RULES = {"left": "full", "right": "incompatible"}


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (
            {"rods": {"r": {"lines": "all", "area": 1e-4}}},
            r"rods: a LineMesh takes sections, masses, springs",
        ),
        (
            {"couplings": {"c": {"node": "end", "members": {"start": 1.0}}}},
            r"couplings: a LineMesh takes",
        ),
        ({"plane": "xy"}, r"plane: belongs to a RawMesh"),
        ({"mass": "lumped"}, r"mass: a LineMesh has consistent mass, got 'lumped'"),
        (
            {"links": {"l": {"node": "start", "followers": "end", "components": ["ux"]}}},
            r"links\.l\.components: belong to a whole deck",
        ),
        ({"sections": {"s": ROUND, "t": ROUND}}, r'sections\.s: lines = "all", but there are 2 tables'),
        ({"mass": "as the deck", "lumped": {"lines", "shell"}}, "lumped: unknown 'shell'; did you mean 'shells'"),
        ({"mesh": None}, r"mesh: expected one of RawMesh, Mesh, ShellMesh, LineMesh, or matrices, got NoneType"),
    ],
)
def test_what_a_mesh_of_lines_cannot_take_is_refused(change, message):
    given = {"mesh": LINES, "units": "m-kg-s", "materials": {"steel": STEEL}, "sections": {"s": ROUND}} | change
    with pytest.raises(BodyError, match=message):
        fm.assemble(FEModel.of("rod", **given))


def test_two_formulations_on_one_mesh_of_solids_are_refused():
    halves = {name: {"cells": f"{name} half", "integration": rule} for name, rule in RULES.items()}
    model = FEModel.of("box", box_mesh(2, 1, 1), units="m-kg-s", materials={"steel": STEEL}, solids=halves)
    with pytest.raises(BodyError, match="solids: a Mesh takes one integration and mass, got 2"):
        fm.assemble(model)


@pytest.fixture
def read():
    """Matrices of a bar, as files of another program give them."""
    body = fm.solid_body(box_mesh(), MATERIAL, name="bar", units=UNITS)
    numbers = np.arange(1, len(body.nodes) + 1)
    dofs = np.column_stack([numbers[body.dofs[:, 0]], body.dofs[:, 1]])
    return fm.files.ForeignMatrices(K=body.K, M=body.M, dofs=dofs, nodes=body.nodes, node_numbers=numbers)


def test_matrices_in_place_of_a_mesh_make_the_body_that_they_make_alone(read):
    places = {"left": {"nodes": [1, 2, 3], "kind": "rigid"}}
    body = fm.assemble(FEModel.of("bar", fm.files.GivenMatrices(read), units="m-kg-s", interfaces=places))
    require_equal(body, fm.files.body_from_foreign(read, name="bar", units=UNITS))
    assert [(each.name, list(each.nodes)) for each in body.interfaces] == [("left", [0, 1, 2])]


def test_tables_of_elements_beside_matrices_are_refused(read):
    model = FEModel.of("bar", fm.files.GivenMatrices(read), units="m-kg-s", materials={"steel": STEEL})
    with pytest.raises(BodyError, match="materials: a GivenMatrices takes interfaces, load_cases only"):
        fm.assemble(model)


def test_a_kind_of_mass_beside_matrices_is_refused(read):
    model = FEModel.of("bar", fm.files.GivenMatrices(read), units="m-kg-s", mass="lumped")
    with pytest.raises(BodyError, match="mass: a GivenMatrices has its own mass, got 'lumped'; remove it"):
        fm.assemble(model)


def test_interfaces_beside_an_archive_that_brings_them_are_refused(tmp_path):
    arrays = fm.files.GivenArrays(str(tmp_path / "bar.npz"))
    model = FEModel.of("bar", arrays, units="m-kg-s", interfaces={"a": {"nodes": [1], "kind": "rigid"}})
    with pytest.raises(BodyError, match=r"interfaces: .*bar.npz brings its own"):
        fm.assemble(model)
