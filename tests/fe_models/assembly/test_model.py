"""A model given by tables is the body that the functions for one kind of elements return."""

from numpy.testing import assert_array_equal

import fe_models as fm
from fe_models.assembly.model import FEModel

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
