"""Signed errors of shells: fields that elements represent, layers at free edges, and free plates by the Ritz method."""

from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose

import fe_models as fm
from cms.modes.families.families import Families
from fe_models.elements.recovery.mesh_error import energy_errors
from fe_models.meshes.shell_mesh import ShellMesh
from tests.mindlin_plate import free_plate_eigenvalues

MM = fm.unit_system("mm-kg-ms")
STEEL = fm.Material("steel", 210.0, 0.3, 7.85e-6)
TURN = np.linalg.qr(np.random.default_rng(5).normal(size=(3, 3)))[0]
TURN = TURN * np.linalg.det(TURN)
NOWHERE = np.zeros(0, int)


def plate(n, kind="quad", t=2.0, offset=0.0, lengths=(100.0, 70.0)):
    """A plate in general position whose cells are distorted, and its nodes in its own axes."""
    mesh = fm.shells.mapped_shell(lambda u, v: np.stack([u, v, 0 * u], axis=1), *n, kind=kind)
    x, y, z = mesh.nodes.T
    bubble = 0.8 * x * (1 - x) * y * (1 - y)
    local = np.stack([lengths[0] * (x + bubble / 2), lengths[1] * (y - bubble), z], axis=1)
    mesh = replace(mesh, nodes=local @ TURN.T + [30.0, -400.0, 80.0])
    return fm.shell_body(mesh, fm.shells.ShellProperty(t, STEEL, offset=offset), name="plate", units=MM), local


def columns(body, motion):
    """One column over the dofs of the mesh, from motions in the axes of the plate, (n_nodes, 6)."""
    turned = np.hstack([motion[:, :3] @ TURN.T, motion[:, 3:] @ TURN.T])
    return body.mesh_displacement(turned.reshape(-1, 1))


def twisted(local, rate):
    """w = rate x y with the rotations of the normal."""
    x, y = local[:, 0], local[:, 1]
    zero = np.zeros(len(x))
    return np.stack([zero, zero, rate * x * y, rate * x, -rate * y, zero], axis=1)


@pytest.mark.parametrize("kind", ["quad", "triangle"])
@pytest.mark.parametrize("offset", [0.0, 0.7])
def test_constant_strain_and_curvature_have_no_error(kind, offset):
    body, local = plate((6, 5), kind, offset=offset)
    x, y = local[:, :2].T
    motion = twisted(local, 0.02)
    motion[:, 2] += 0.01 * x**2
    motion[:, 4] -= 0.02 * x
    motion[:, 0] += 0.003 * x + 0.001 * y
    motion[:, 1] -= 0.002 * y - 0.004 * x
    motion[:, 5] += (0.004 - 0.001) / 2
    u = columns(body, motion)
    found = static_errors(body, u, np.arange(len(local)))
    assert np.abs(found.error).sum() < 1e-6 * found.energy.sum()


def static_errors(body, u, loaded):
    """Errors of a static field: lambda is so small that mass does not count."""
    own = u[: body.K.shape[0], 0]
    energy = own @ (body.K @ own)
    found = energy_errors(body.element_model, u, np.array([1e-7 * energy / (own @ (body.M @ own))]), loaded)
    assert_allclose(found.energy.sum(), energy, rtol=1e-9)
    return found


def test_an_edge_layer_takes_the_energy_by_which_torsion_of_a_strip_is_softer():
    """Constant twist of a long strip: both edges take the part 2 / (k b), k = sqrt(10) / t, of Kirchhoff's energy."""
    t, length, b = 2.0, 400.0, 50.0
    body, local = plate((32, 4), t=t, lengths=(length, b))
    u = columns(body, twisted(local, 0.01))
    loaded = np.flatnonzero((local[:, 0] < 1e-9) | (local[:, 0] > length - 1e-9))
    found = static_errors(body, u, loaded)
    assert_allclose(found.total / found.energy.sum(), 2 * t / (np.sqrt(10) * b), rtol=1e-4)


def test_flat_cells_of_a_cylinder_lack_area_and_change_of_curvature():
    """A cylinder grows: chords stretch like the arc, their area is smaller, and only the arc changes its curvature."""
    n, R = 12, 80.0
    mesh = fm.shells.mapped_shell(
        lambda u, v: np.stack([R * np.cos(u), R * np.sin(u), 60 * v], axis=1), n, 4, kind="quad"
    )
    body = fm.shell_body(
        replace(mesh, nodes=mesh.nodes @ TURN.T), fm.shells.ShellProperty(1.0, STEEL), name="arc", units=MM
    )
    radial = mesh.nodes * [1, 1, 0] / R
    u = columns(body, np.hstack([radial, 0 * radial]))
    found = static_errors(body, u, np.arange(len(mesh.nodes)))
    facet = np.sinc(1 / (2 * n) / np.pi)  # length of a chord over that of its arc
    bending = 1 / (12 * R**2)  # energy of the change of curvature 1/R² over that of the strain 1/R, t = 1
    assert_allclose(found.total / found.energy.sum(), 1 - (1 + bending) / facet, rtol=0.02)


@pytest.mark.parametrize("kind", ["quad", "triangle"])
@pytest.mark.parametrize("t", [2.0, 0.4])
def test_the_estimate_of_free_plates_has_the_size_and_the_sign_of_the_error(kind, t):
    mesh = fm.shells.mapped_shell(lambda u, v: np.stack([100 * u, 70 * v, 0 * u], axis=1), 20, 14, kind=kind)
    body = fm.shell_body(
        replace(mesh, nodes=mesh.nodes @ TURN.T), fm.shells.ShellProperty(t, STEEL), name="plate", units=MM
    )
    with Families(body, announce=False) as families:
        modes = families.free_modes(8)
    lam = modes.omega2[:8]
    true = 1 - free_plate_eigenvalues((100.0, 70.0), t, STEEL, 8) / lam
    found = energy_errors(body.element_model, body.mesh_displacement(modes.Phi[:, :8]), lam, NOWHERE)
    assert found.is_signed
    assert not found.nonconforming
    estimate = found.total / lam
    assert_allclose(found.energy.sum(axis=0), lam, rtol=1e-8)
    is_large = np.abs(true) > 1e-3
    assert is_large.sum() >= 4
    ratio = estimate[is_large] / true[is_large]
    assert ((ratio > 0.5) & (ratio < 2)).all(), (true, estimate)
    assert (np.abs(estimate - true)[~is_large] < 1.5e-3).all()


def test_walls_of_few_cells_have_finite_estimates():
    """A fold of one cell on each side, and a strip of triangles."""
    nodes = np.array([[0, 0, 0], [30, 0, 0], [30, 20, 0], [0, 20, 0], [30, 0, 25], [30, 20, 25.0]])
    cells = {"quad": np.array([[0, 1, 2, 3]]), "triangle": np.array([[1, 4, 5], [1, 5, 2]])}
    body = fm.shell_body(ShellMesh(nodes, cells), fm.shells.ShellProperty(1.0, STEEL), name="fold", units=MM)
    with Families(body, announce=False) as families:
        modes = families.free_modes(3)
    found = energy_errors(body.element_model, body.mesh_displacement(modes.Phi[:, :3]), modes.omega2[:3], NOWHERE)
    assert np.isfinite(found.error).all()
    assert found.error.shape == (3, 3)


def test_bending_of_a_curved_panel_has_the_error_of_its_flat_cells():
    """Modes 2 and 4 hardly twist; a mesh of a quarter of the size is the reference."""

    def modes_of(n):
        mesh = fm.shells.mapped_shell(
            lambda u, v: np.stack([100 * u, 70 * v, 60 * u * (1 - u)], axis=1), n, 7 * n // 10, kind="quad"
        )
        body = fm.shell_body(
            replace(mesh, nodes=mesh.nodes @ TURN.T), fm.shells.ShellProperty(2.0, STEEL), name="panel", units=MM
        )
        with Families(body, announce=False) as families:
            modes = families.free_modes(4)
        return body, modes.omega2[:4], modes.Phi[:, :4]

    (body, lam, Phi), (_, exact, _) = modes_of(10), modes_of(40)
    found = energy_errors(body.element_model, body.mesh_displacement(Phi), lam, NOWHERE)
    ratio = (found.total / lam)[[1, 3]] / (1 - exact / lam)[[1, 3]]
    assert ((ratio > 0.6) & (ratio < 1.6)).all(), ratio
