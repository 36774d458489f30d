"""Left-out shapes of a reduced body: the energy of static responses that the modes lack, in every frame and unit."""

from dataclasses import fields, replace

import numpy as np
import pytest
import scipy.linalg as la
from numpy.testing import assert_allclose, assert_array_equal

import cms
import fe_models as fm
from cms.errors import BodyError
from cms.modes.families.families import Families
from cms.modes.mode_sets import MODE_SETS
from cms.reduction.basis.finishing import finish
from cms.reduction.basis.frames import frame_condition
from cms.reduction.basis.free_basis import basis_of_finished
from cms.reduction.frame_conversion import convert_frame
from cms.reduction.recovery.load_columns import loads_of_model
from cms.reduction.reduction import reduce
from fe_models.body.fe_body import Interface
from fe_models.body.load_cases import LoadCase
from fe_models.body.rigid_motion import rigid_motion_of_dofs
from floatframe.design.laboratory.full_model import all_dofs
from tests.bodies import box_mesh, distorted

SETS = {"craig-bampton": {"n_modes": 4}, "guyan": {}, "normal": {"n_modes": 5}, "krylov": {"n_blocks": 1}}


@pytest.fixture(scope="module")
def body():
    """A bent bar in general position, in mm and ms, with two rigid interfaces and a pressure."""
    mesh = distorted(box_mesh(6, 2, 1, 300.0, 60.0, 25.0), 0.1, seed=2)
    turn = la.qr(np.random.default_rng(5).normal(size=(3, 3)))[0]
    mesh = replace(mesh, nodes=mesh.nodes @ (turn * la.det(turn)).T + [40.0, -900.0, 300.0])
    ports = [
        Interface(name, "rigid", nodes := mesh.node_sets[name], mesh.nodes[nodes].mean(axis=0) + np.array([3, 1, -2]))
        for name in ("left", "right")
    ]
    steel = fm.Material("steel", 210.0, 0.3, 7.85e-6)  # GPa = kg / (mm ms²)
    part = fm.solid_body(mesh, steel, name="bar", units=fm.unit_system("mm-kg-ms"), interfaces=ports)
    force = LoadCase("push", "force", np.random.default_rng(3).normal(size=part.n_dof))
    return fm.couple(part.with_load_cases(force))


@pytest.fixture(scope="module")
def sets(body):
    """The mode set and the reduced body by name."""
    with Families(body) as families:
        modes = {name: MODE_SETS[name](families, **options) for name, options in SETS.items()}
        return {name: (each, reduce(families, each, frame=cms.NodalFrame("left"))) for name, each in modes.items()}


def lacking(body, modes, F):
    """Return the energy products of the static responses of the free body to loads, without the modes: dense."""
    K, M = body.K.toarray(), body.M.toarray()
    R = rigid_motion_of_dofs(body.nodes, body.dofs)
    balanced = F - M @ R @ np.linalg.solve(R.T @ M @ R, R.T @ F)
    A = np.block([[K, M @ R], [(M @ R).T, np.zeros((6, 6))]])
    u = np.linalg.solve(A, np.vstack([balanced, np.zeros((6, F.shape[1]))]))[: len(K)]
    Phi = finish(body, modes, frame_condition(body, cms.TisserandFrame())).Phi
    e = u - Phi @ np.linalg.solve(Phi.T @ K @ Phi, Phi.T @ K @ u)
    return e.T @ K @ e


def forces_on(left_out):
    """Return y for the loads of `loads_of_model` without gravity: spin, interfaces, load cases; (n_loads, n_left)."""
    interfaces = left_out.interfaces.transpose(1, 0, 2).reshape(-1, left_out.n_left)
    return np.concatenate([left_out.spin, interfaces, left_out.load_cases])


def assert_same_energies(y, expected):
    """Compare products of energies, each divided by the energies of its two loads."""
    size = np.sqrt(np.maximum(np.diag(expected), 1e-12 * np.diag(expected).max()))
    assert_allclose(y @ y.T / np.outer(size, size), expected / np.outer(size, size), rtol=0, atol=1e-6)


@pytest.mark.parametrize("name", SETS)
def test_loads_leave_out_the_energy_that_the_modes_lack(body, sets, name):
    modes, reduced = sets[name]
    loads, F = loads_of_model(body, reduced.frame)
    assert loads.names[:3] == ("gravity x", "gravity y", "gravity z")
    assert_same_energies(forces_on(reduced.errors.left_out), lacking(body, modes, F[:, 3:]))


def test_modal_accelerations_and_loads_together_leave_out_the_energy_that_the_modes_lack(body, sets):
    """Accelerations of the free vibration modes below the cutoff, whose corrections are among the left-out shapes."""
    modes, reduced = sets["craig-bampton"]
    with Families(body) as families:
        finished = finish(body, modes, frame_condition(body, cms.NodalFrame("left")))
        free = basis_of_finished(families, finished).Phi[:, : len(reduced.errors.frequency)]
    R = rigid_motion_of_dofs(body.nodes, body.dofs)
    q_ddot = np.linalg.lstsq(np.hstack([finished.Phi, R]), free)[0][: reduced.n_q]
    left_out = reduced.errors.left_out
    _, F = loads_of_model(body, reduced.frame)
    y = np.concatenate([forces_on(left_out), q_ddot.T @ left_out.inertia])
    assert_same_energies(y, lacking(body, modes, np.hstack([F[:, 3:], -body.M @ free])))


def test_vibration_shapes_have_the_frequencies_of_the_free_body_below_the_cutoff(body, sets):
    """The frequencies of modes and left-out shapes together are nearer to the exact ones, and above them."""
    _, reduced = sets["craig-bampton"]
    exact = la.eigh(body.K.toarray(), body.M.toarray(), eigvals_only=True)[6:]
    n = len(reduced.errors.frequency)
    found, alone = 1 / reduced.errors.left_out.mass[:n], (2 * np.pi * reduced.free_frequencies[:n]) ** 2
    assert (found >= exact[:n] * (1 - 1e-9)).all()
    assert (found / exact[:n] - 1 <= 0.5 * (alone / exact[:n] - 1) + 1e-9).all()
    left_out = reduced.errors.left_out
    assert_allclose(left_out.shares @ left_out.shares.T, np.eye(left_out.n_left), rtol=0, atol=1e-10)


def test_a_set_that_lacks_nothing_has_no_left_out_shapes(body):
    with Families(body) as families:
        assert reduce(families, all_dofs(body)).errors.left_out is None


def test_left_out_shapes_are_read_as_they_were_written(sets, tmp_path):
    reduced = sets["craig-bampton"][1]
    cms.write(reduced, tmp_path / "bar.h5")
    found, own = cms.read(tmp_path / "bar.h5").errors.left_out, reduced.errors.left_out
    for each in fields(own):
        assert_array_equal(getattr(found, each.name), getattr(own, each.name))


@pytest.mark.parametrize("units", ["m-kg-s", "in-slinch-s"])
def test_energies_left_out_are_those_of_other_units(sets, units):
    """y² of a load has the unit of an energy, and 1 / omega² that of time²."""
    reduced = sets["craig-bampton"][1]
    other = cms.body.convert_units(reduced, units)
    a, b, old, new = reduced.errors.left_out, other.errors.left_out, reduced.units, other.units
    force, length, time = (
        (new.mass * new.length / new.time**2) / (old.mass * old.length / old.time**2), new.length / old.length,
        new.time / old.time,
    )  # fmt: skip
    energy = np.sqrt(force * length)
    assert_allclose(b.mass * time**2, a.mass, rtol=1e-12)
    assert_allclose(b.interfaces[:3] * energy / force, a.interfaces[:3], rtol=1e-12)
    assert_allclose(b.interfaces[3:] * energy / (force * length), a.interfaces[3:], rtol=1e-12)
    assert_allclose(b.spin * energy * time**2, a.spin, rtol=1e-12)
    assert_allclose(b.load_cases * energy, a.load_cases, rtol=1e-12)
    assert_allclose(b.inertia * energy * time**2 / np.sqrt(new.mass / old.mass) / length, a.inertia, rtol=1e-12)
    assert_array_equal(b.shares, a.shares)


def test_energies_left_out_are_those_of_a_converted_frame(body, sets):
    """Against the left-out shapes of a reduction in that frame, whose axes are turned and whose origin is elsewhere."""
    modes, reduced = sets["craig-bampton"]
    axes = la.qr(np.random.default_rng(8).normal(size=(3, 3)))[0]
    frame = cms.TisserandFrame(axes=tuple(map(tuple, (axes * la.det(axes)).T)))
    with Families(body) as families:
        expected = reduce(families, modes, frame=frame, errors=True)
    converted = convert_frame(reduced, frame)
    sign = np.sign(np.einsum("nak,nak->k", converted.Phi, expected.Phi))
    found, own = converted.errors.left_out, expected.errors.left_out
    assert_same_energies(forces_on(found), forces_on(own) @ forces_on(own).T)
    assert_same_energies(sign[:, None] * found.inertia, own.inertia @ own.inertia.T)


def test_left_out_shapes_of_another_body_are_refused(sets):
    reduced, other = sets["craig-bampton"][1], sets["guyan"][1]
    with pytest.raises(BodyError, match="modes, but left-out shapes of"):
        replace(reduced, errors=replace(reduced.errors, left_out=other.errors.left_out))
