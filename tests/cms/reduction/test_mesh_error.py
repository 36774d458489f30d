"""Estimated errors of frequencies by the mesh, against finer meshes of the same geometry."""

from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_array_equal

import cms
import fe_models as fm
from cms.body.error_estimates import MESH_SIGNS
from cms.cli.info import error_percent
from cms.modes.families.families import Families
from cms.modes.mode_sets import MODE_SETS
from cms.reduction.basis.free_basis import free_basis
from cms.reduction.mesh_error import LARGEST, frequency_errors, loaded_nodes, mesh_errors
from cms.reduction.reduction import reduce
from fe_models.body.fe_body import Interface
from fe_models.elements.recovery.mesh_error import EnergyErrors
from tests.bodies import beam, box_mesh
from tests.mindlin_plate import free_plate_eigenvalues

MM = fm.unit_system("mm-kg-ms")
STEEL = fm.Material("steel", 210.0, 0.3, 7.85e-6)  # GPa = kg / (mm ms²)
TURN = np.linalg.qr(np.random.default_rng(7).normal(size=(3, 3)))[0]
TURN = TURN * np.linalg.det(TURN)


def sheared(n, kind, *, ports=(), **options):
    """A sheared block in general position, with rigid interfaces at some of its faces."""
    mesh = box_mesh(*n, 90.0, 60.0, 40.0, kind)
    x, y, z = mesh.nodes.T
    mesh = replace(mesh, nodes=np.stack([x + 0.3 * y, y, z + 0.2 * x], axis=1) @ TURN.T + [500.0, 80.0, -60.0])
    faces = [Interface(name, "rigid", nodes := mesh.node_sets[name], mesh.nodes[nodes].mean(axis=0)) for name in ports]
    return fm.solid_body(mesh, STEEL, name="block", units=MM, interfaces=faces, **options)


def modes_of(body, n=6):
    """The reduced body of free modes, with its errors."""
    with Families(fm.couple(body)) as families:
        families.fixed  # noqa: B018
        return reduce(families, MODE_SETS["normal"](families, n_modes=n), geometric=False)


@pytest.fixture(scope="module")
def exact():
    """Frequencies with a fine mesh."""
    found = {}
    for ports in ((), ("left",)):
        with Families(fm.couple(sheared((6, 4, 4), "hexahedron20", ports=ports))) as families:
            found[ports] = families.free_modes(4).frequencies
    return found


@pytest.mark.parametrize("ports", [(), ("left",)], ids=["free", "rigid face"])
@pytest.mark.parametrize(
    ("kind", "n", "most"),
    [
        ("hexahedron", (6, 4, 4), 2),
        ("tetra10", (3, 2, 2), 2),
        ("hexahedron20", (3, 2, 2), 3.2),
        ("wedge", (6, 4, 4), 2),
    ],
)
def test_the_estimate_is_near_the_true_error(exact, kind, n, most, ports):
    """Coarse meshes of bricks of second order are judged too severely."""
    made = modes_of(sheared(n, kind, ports=ports))
    true = made.free_frequencies[:4] / exact[ports][:4] - 1
    ratio = made.errors.mesh[:4] / true
    assert made.errors.mesh_sign == "+"
    assert (true > 1e-3).all()
    assert ((ratio > 0.5) & (ratio < most)).all(), (true, ratio)


def test_torsion_of_one_layer_of_elements_is_seen_to_be_too_stiff():
    """A square bar of one brick across: warping is not represented, and GJ is 1/6 of a⁴ in place of 0.1406 of it."""
    mesh = box_mesh(12, 1, 1, 300.0, 20.0, 20.0, "hexahedron20")
    made = modes_of(fm.solid_body(replace(mesh, nodes=mesh.nodes @ TURN.T), STEEL, name="bar", units=MM), 8)
    torsion = np.sqrt(STEEL.mu * 0.1406 * 6 / STEEL.rho) / (2 * 300.0)
    k = int(np.abs(made.free_frequencies / (torsion * np.sqrt(1 / 6 / 0.1406)) - 1).argmin())
    true = made.free_frequencies[k] / torsion - 1
    assert 0.08 < true < 0.1
    assert 0.5 < made.errors.mesh[k] / true < 2


@pytest.mark.parametrize("options", [{"incompatible_modes": True}, {"integration": "reduced"}], ids=str)
def test_elements_that_may_lower_frequencies_have_errors_of_unknown_sign(options):
    kind = "hexahedron" if "incompatible_modes" in options else "hexahedron20"
    errors = modes_of(sheared((3, 2, 2), kind, **options)).errors
    assert errors.mesh_sign == "+-"
    assert errors.mesh_method.startswith("recovered stress of elements; sign not known: ")
    assert (errors.mesh > 0).all()


def thin_plate(interfaces=()):
    """A plate of coarse quads in general position, whose highest frequencies are too low."""
    mesh = fm.shells.mapped_shell(lambda u, v: np.stack([100 * u, 70 * v, 0 * u], axis=1), 10, 7, kind="quad")
    mesh = replace(mesh, nodes=mesh.nodes @ TURN.T + [500.0, 80.0, -60.0])
    faces = [fm.shells.shell_interface(mesh, name, fm.selections.NearestNode(mesh.nodes[k])) for name, k in interfaces]
    return fm.shell_body(mesh, fm.shells.ShellProperty(0.4, STEEL), name="sheet", units=MM, interfaces=faces)


def test_errors_of_shells_have_a_sign_which_survives_a_file(tmp_path):
    made = modes_of(thin_plate(), 8)
    true = made.free_frequencies[:8] * 2 * np.pi / np.sqrt(free_plate_eigenvalues((100.0, 70.0), 0.4, STEEL, 8)) - 1
    is_large = np.abs(true) > 2e-3
    assert set(np.sign(true[is_large])) == {-1.0, 1.0}
    ratio = made.errors.mesh[:8][is_large] / true[is_large]
    assert ((ratio > 0.5) & (ratio < 2)).all(), (true, made.errors.mesh)
    assert made.errors.mesh_sign == "signed"
    cms.write(made, tmp_path / "sheet.h5")
    back = cms.read(tmp_path / "sheet.h5").errors
    assert_array_equal(back.mesh, made.errors.mesh)
    assert back.mesh_sign == "signed"
    assert error_percent(-0.0123, MESH_SIGNS["signed"]) == "-1.2 %"
    assert error_percent(0.0123, MESH_SIGNS["signed"]) == "+1.2 %"


def test_the_skin_of_a_shell_loads_no_node():
    body = fm.couple(thin_plate([("corner", 0), ("edge", 5)]))
    assert_array_equal(loaded_nodes(body), [0, 5])


def test_what_has_no_stress_has_no_estimate_but_a_reason(tmp_path):
    made = modes_of(beam(), 4)
    assert len(made.errors.mesh) == 0
    assert made.errors.mesh_method == "none: the body consists of matrices"
    cms.write(made, tmp_path / "beam.h5")
    back = cms.read(tmp_path / "beam.h5").errors
    assert (len(back.mesh), back.mesh_sign, back.mesh_method) == (0, "", made.errors.mesh_method)


def test_modes_whose_energy_is_elsewhere_have_no_estimate():
    """The first mode has 3 % of its energy in springs; the mesh does not resolve the last."""
    found = EnergyErrors(np.array([[0.01, 0.01, 2.0]]), np.array([[0.97, 0.99, 1.0]]), "")
    assert_array_equal(np.isnan(errors := frequency_errors(found, np.ones(3))), [True, False, False])
    assert errors[1] == 1 / np.sqrt(0.99) - 1
    assert errors[2] == pytest.approx(LARGEST)


def test_members_of_interfaces_and_of_rigid_parts_may_be_loaded():
    body = fm.couple(sheared((3, 2, 2), "hexahedron", ports=("left",)))
    assert_array_equal(loaded_nodes(body), np.sort(body.interfaces[0].nodes))


def test_the_errors_survive_a_file_and_a_file_without_them_is_read(tmp_path):
    made = modes_of(sheared((3, 2, 2), "hexahedron"))
    cms.write(made, tmp_path / "new.h5")
    back = cms.read(tmp_path / "new.h5", units="m-kg-s").errors
    assert_array_equal(back.mesh, made.errors.mesh)
    assert (back.mesh_sign, back.mesh_method) == ("+", made.errors.mesh_method)
    old = replace(made, errors=replace(made.errors, mesh=np.zeros(0), mesh_sign="", mesh_method=""))
    cms.write(old, tmp_path / "old.h5")
    assert len(cms.read(tmp_path / "old.h5").errors.mesh) == 0


def test_a_set_without_judged_frequencies_has_no_estimate():
    body = fm.couple(sheared((2, 1, 1), "hexahedron", ports=("left",)))
    with Families(body) as families:
        found = mesh_errors(body, free_basis(body, MODE_SETS["craig-bampton"](families, n_modes=1), families), 0)
    assert found.method == "none: no free frequency is below the cutoff of the set"
    assert len(found.frequency) == 0
