"""Geometric stiffness of shells: rigid rotations, bricks in the same state, buckling, blades that spin."""

from dataclasses import replace

import numpy as np
import pytest
import scipy.sparse.linalg as spla
from numpy.testing import assert_allclose, assert_array_equal

import cms
import fe_models as fm
from fe_models.body.rigid_motion import MassLoads, rigid_motion_of_dofs
from fe_models.elements.shells.elements import DRILLING_SHARE
from tests.fe_models.elements.shells.examples import balanced_state, n_shell_nodes, on_dofs, shell_fields, turned_loads
from tests.fe_models.small_shells import KINDS, SI, STEEL, of_nodes, solved

ROUNDOFF = 1e-12


def bent_strip(kind, *, offset=0.04, stiffened=False):
    """A curved strip of warped cells with an offset, maybe a beam along its middle."""

    def surface(u, v):
        return np.stack([np.sin(1.5 * u), 0.4 * v + 0.1 * u * v, np.cos(1.5 * u) + 0.1 * v**2], axis=1)

    mesh = fm.shells.mapped_shell(surface, 6, 2, kind=kind)
    options = {}
    if stiffened:
        middle = np.setdiff1d(np.arange(len(mesh.nodes)), np.union1d(mesh.node_sets["v0"], mesh.node_sets["v1"]))
        mesh = replace(mesh, lines=np.stack([middle[:-1], middle[1:]], axis=1), line_sets={"bar": np.arange(6)})
        options["stiffeners"] = {
            "bar": fm.beams.BeamProperty(fm.beams.Rectangle(0.02, 0.04), STEEL, offset=(0.02, -0.05))
        }
    return fm.shell_body(mesh, fm.shells.ShellProperty(0.05, STEEL, offset=offset), name="strip", units=SI, **options)


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("stiffened", [False, True])
def test_a_rigid_rotation_turns_the_forces_of_a_body_in_equilibrium(kind, stiffened):
    """Against all rigid motions: (theta × f, ½ theta × m) of the nodal forces and the turned load of the mass."""
    body = bent_strip(kind, stiffened=stiffened)
    model = body.element_model
    loads, nodal, u = balanced_state(body)
    n = n_shell_nodes(body)
    Psi = rigid_motion_of_dofs(body.nodes, body.dofs)
    K = model.geometric_stiffness(body.mesh_displacement(u[:, None]), loads, body.mesh_displacement(Psi))[0]
    f = nodal[: 6 * n].reshape(n, 6)
    expected = np.zeros((6, 6))
    for a in range(3):
        theta = np.eye(3)[a]
        turned = np.zeros(body.n_dof)
        turned[: 6 * n] = np.hstack([np.cross(theta, f[:, :3]), np.cross(theta, f[:, 3:]) / 2]).ravel()
        turned += on_dofs(body, model.mass_forces(turned_loads(loads, theta)))[:, 0]
        expected[:, 3 + a] = Psi.T @ turned
    scale = np.abs(f).max()
    assert_allclose(K[:3], 0, rtol=0, atol=1e-9 * scale)
    assert_allclose(K[3:, 3:], (expected[3:, 3:] + expected[3:, 3:].T) / 2, rtol=0, atol=1e-8 * scale)
    assert np.abs(expected[3:, 3:]).max() > 1e-3 * scale


@pytest.mark.parametrize("kind", KINDS)
def test_a_rigid_rotation_turns_sections_that_turn_by_themselves_without_a_force_on_them(kind):
    """On their own rotations act the turned loads of the mass alone: nothing else holds them."""
    body = bent_strip(kind, stiffened=True)
    model = body.element_model
    loads, _, u = balanced_state(body)
    own = np.arange(6 * n_shell_nodes(body), body.n_dof)
    assert len(own) == 7 + 5  # about the normal, and about the lever where the bar goes on
    columns = np.hstack([rigid_motion_of_dofs(body.nodes, body.dofs), np.eye(body.n_dof)[:, own]])
    K = model.geometric_stiffness(body.mesh_displacement(u[:, None]), loads, body.mesh_displacement(columns))[0]
    size = np.abs(model.frame.internal_forces(body.mesh_displacement(u[:, None])[model.shell.n_mesh_dof :])).max()
    for a in range(3):
        expected = on_dofs(body, model.mass_forces(turned_loads(loads, np.eye(3)[a])))[own, 0]
        assert_allclose(K[6:, 3 + a], expected, rtol=0, atol=1e-9 * size)


def test_mass_forces_and_internal_forces_are_those_of_the_matrices():
    for kind in KINDS:
        body = bent_strip(kind, stiffened=True)
        model, n = body.element_model, body.n_dof
        loads = MassLoads.none(6).plus_rigid(np.eye(6), np.array([0.1, -0.2, 0.3]))
        expected = body.M @ rigid_motion_of_dofs(body.nodes, body.dofs, np.array([0.1, -0.2, 0.3]))
        forces = on_dofs(body, model.mass_forces(loads))
        assert_allclose(forces, expected, rtol=0, atol=ROUNDOFF * np.abs(expected).max())
        u = np.random.default_rng(0).normal(size=(n, 2))
        expected = body.K @ u
        forces = on_dofs(body, model.internal_forces(body.mesh_displacement(u)))
        assert_allclose(forces, expected, rtol=0, atol=ROUNDOFF * np.abs(body.K).max() * np.abs(u).max())


def test_internal_forces_at_some_nodes_of_a_stiffened_shell_are_those_of_all_and_take_the_cells_near_them(monkeypatch):
    monkeypatch.setattr("fe_models.elements.shells.elements.CHUNK", 2)
    body = bent_strip(KINDS[0], stiffened=True)
    model = body.element_model
    u = body.mesh_displacement(np.random.default_rng(0).normal(size=(body.n_dof, 2)))
    n, all_forces = 6 * n_shell_nodes(body), model.internal_forces(u)
    corner = model.internal_forces(u, nodes=np.array([0]))
    size = np.abs(all_forces).max()
    assert_allclose(corner[:6], all_forces[:6], rtol=0, atol=ROUNDOFF * size)
    assert (corner[:n].reshape(-1, 12) == 0).all(axis=1).sum() > n / 24  # far cells are left out
    assert_array_equal(corner[model.shell.n_mesh_dof :], all_forces[model.shell.n_mesh_dof :])  # of the beam


def brick_columns(mesh, t, columns):
    """Nodes of bricks of 27 nodes in the place of the cells of a flat grid, and columns that move them as these."""
    corner, side, middle = [0, 1, 2, 3], [4, 5, 6, 7], [8]
    order = [(-1, corner), (1, corner), (-1, side), (1, side), (0, corner)]
    order += [(0, [7, 5, 4, 6]), (-1, middle), (1, middle), (0, middle)]
    moved = []
    for column in columns:
        places, values, across = shell_fields(mesh, column, DRILLING_SHARE["quad"])
        parts = [values[:, chosen] + z * t / 2 * across[:, chosen] for z, chosen in order]
        moved.append(np.concatenate(parts, axis=1).ravel())
    nodes = np.concatenate([places[:, chosen] + [0, 0, z * t / 2] for z, chosen in order], axis=1).reshape(-1, 3)
    return nodes, np.stack(moved, axis=1)


@pytest.mark.parametrize("state", ["membrane", "bending", "both"])
def test_stress_stiffens_as_in_bricks_of_the_same_shape_in_the_same_motion(state):
    """nu = 0, so that the solid has no stress across; without drilling, since vectors have no second order of rotation.

    The motions are any translations of the corners and rotations that leave the sides straight, theta = (p x, q y, 0).
    The curvature has no twist: its moment is held by forces at the corners of a cell, where bricks spread it along the
    sides; the two meet in smooth motions (below).
    """
    t = 0.3
    material = replace(STEEL, nu=0.0)
    mesh = fm.shells.flat_plate(2.0, 1.5, 2, 2)
    shell = fm.shell_body(mesh, fm.shells.ShellProperty(t, material), name="shell", units=SI)
    x, y = mesh.nodes[:, 0], mesh.nodes[:, 1]
    zero = np.zeros(len(x))
    a, b, c = 0.3e-3, -0.7e-3, 0.5e-3
    u = np.zeros((len(x), 6))
    if state != "bending":
        u += np.stack([a * x + c * y, c * x + b * y, zero, zero, zero, zero], axis=1)
    if state != "membrane":
        w = a * x**2 / 2 + b * y**2 / 2
        u += np.stack([zero, zero, w, b * y, -a * x, zero], axis=1)
    rng = np.random.default_rng(0)
    columns = []
    for p, q in rng.normal(size=(3, 2)):
        motion = np.hstack([rng.normal(size=(len(x), 3)), np.stack([p * x, q * y, zero], axis=1)])
        columns.append(motion.ravel())
    nodes, moved = brick_columns(mesh, t, [u.ravel(), *columns])
    solid_mesh = fm.Mesh(nodes, {"hexahedron27": np.arange(len(nodes)).reshape(-1, 27)})
    solid = fm.solid_body(solid_mesh, material, name="solid", units=SI)
    expected = solid.element_model.geometric_stiffness(moved[:, :1], MassLoads.none(1), moved[:, 1:])
    K = shell.element_model.geometric_stiffness(
        shell.mesh_displacement(u.reshape(-1, 1)), MassLoads.none(1), shell.mesh_displacement(np.stack(columns, axis=1))
    )
    assert_allclose(K, expected, rtol=0, atol=1e-10 * np.abs(expected).max())


N_RITZ = 120  #: modes in which the buckling shape is sought


def buckling_factor(body, f, fixed):
    """Smallest positive factor of the load at which K + factor K_geo is singular, by Ritz in its lowest modes."""
    u = solved(body, f, fixed)
    free = np.setdiff1d(np.arange(body.n_dof), fixed)
    K, M = (A.tocsr()[free][:, free].tocsc() for A in (body.K, body.M))
    squares, modes = spla.eigsh(K, N_RITZ, M, sigma=0.0, v0=np.ones(len(free)))  # modes.T K modes = diag(squares)
    basis = np.zeros((body.n_dof, N_RITZ))
    basis[free] = modes
    K_geo = body.element_model.geometric_stiffness(
        body.mesh_displacement(u[:, None]), MassLoads.none(1), body.mesh_displacement(basis)
    )[0]
    root = np.sqrt(squares)
    return -1 / np.linalg.eigvalsh(K_geo / np.outer(root, root)).min()


@pytest.mark.parametrize("kind", KINDS)
def test_a_hinged_square_buckles_under_four_pi_squared_D(kind):
    a, t, n = 1.0, 0.01, 10
    mesh = fm.shells.flat_plate(a, a, n, n, kind=kind)
    body = fm.shell_body(mesh, fm.shells.ShellProperty(t, STEEL), name="plate", units=SI)
    sets = mesh.node_sets
    f = np.zeros(body.n_dof)
    width = np.full(n + 1, a / n)
    width[[0, -1]] /= 2
    f[of_nodes(sets["u0"], 0)], f[of_nodes(sets["u1"], 0)] = width, -width
    rim = np.unique(np.concatenate(list(sets.values())))
    middle = np.flatnonzero(np.abs(mesh.nodes[:, 1] - a / 2) < 1e-9)  # a dead load would turn the plate in its plane
    fixed = np.unique(np.concatenate([of_nodes(rim, 2), of_nodes(middle, 1), of_nodes(middle[n // 2 :][:1], 0)]))
    D = STEEL.E * t**3 / (12 * (1 - STEEL.nu**2))
    assert_allclose(buckling_factor(body, f, fixed), 4 * np.pi**2 * D / a**2, rtol=0.02)


@pytest.mark.parametrize(("kind", "limit"), [("quad", 0.01), ("triangle", 0.04)])
def test_a_strip_tips_over_under_an_end_moment_in_its_plane(kind, limit):
    """Lateral-torsional buckling of a cantilever: M = pi/(2 L) sqrt(E I_z G J)."""
    L, h, t = 1.0, 0.05, 0.001
    material = replace(STEEL, nu=0.0)
    mesh = fm.shells.flat_plate(L, h, 18, 4, kind=kind)
    body = fm.shell_body(mesh, fm.shells.ShellProperty(t, material), name="strip", units=SI)
    end = mesh.node_sets["u1"]
    y = mesh.nodes[end, 1] - h / 2
    f = np.zeros(body.n_dof)
    spread = np.array([1.0, 2, 2, 2, 1]) * y
    f[of_nodes(end, 0)] = spread / (spread @ y)
    factor = buckling_factor(body, f, of_nodes(mesh.node_sets["u0"], *range(6)))
    EI, GJ = material.E * h * t**3 / 12, material.mu * h * t**3 / 3 * (1 - 0.63 * t / h)
    assert_allclose(factor, np.pi / (2 * L) * np.sqrt(EI * GJ), rtol=limit)


@pytest.mark.parametrize("kind", KINDS)
def test_a_spinning_blade_stiffens_as_the_beam_of_its_section(kind):
    """The reduced stiffness of all spins, over the first flap and lag shapes of a strip held at its root."""
    L, b, t = 1.0, 0.06, 0.01
    material = replace(STEEL, nu=0.0)
    mesh = fm.shells.flat_plate(L, b, 20, 2, kind=kind)
    root = fm.shells.shell_interface(mesh, "root", fm.selections.NodeSet("u0"), reference=(0.0, b / 2, 0.0))
    blade = fm.shell_body(mesh, fm.shells.ShellProperty(t, material), name="blade", units=SI, interfaces=[root])
    line = fm.beams.straight_line((0, b / 2, 0), (L, b / 2, 0), 20)
    held = fm.beams.line_interface(line, "root", fm.selections.NodeSet("start"))
    beam = fm.beam_body(
        line, fm.beams.BeamProperty(fm.beams.Rectangle(b, t), material), name="beam", units=SI, interfaces=[held]
    )
    spins = []
    for body in (cms.couple(blade), cms.couple(beam)):
        reduced = cms.reduce(body, cms.craig_bampton(body, n_modes=4), frame=cms.NodalFrame("root"), geometric=True)
        omega = np.sqrt(np.diag(reduced.K))
        order = np.argsort(omega)
        flap = [k for k in order if np.abs(reduced.Phi[:, 2, k]).max() > 5 * np.abs(reduced.Phi[:, 1, k]).max()]
        lag = [k for k in order if np.abs(reduced.Phi[:, 1, k]).max() > 5 * np.abs(reduced.Phi[:, 2, k]).max()]
        k = np.array([flap[0], flap[1], lag[0]])
        spins.append(reduced.geometric.spin[:, k, k] / reduced.K[k, k])
    # spins about y and z pull the blade straight; about x they press on its section only
    assert_allclose(spins[0][1:3], spins[1][1:3], rtol=0.02)
    assert_allclose(spins[0][[0, 3, 4, 5]], spins[1][[0, 3, 4, 5]], rtol=0, atol=0.02 * np.abs(spins[1]).max())


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("state", ["membrane", "bending"])
def test_a_rotation_and_a_smooth_motion_meet_in_the_turned_forces_as_cells_get_smaller(kind, state):
    """Cells meet (theta × f, ½ theta × m) of the nodal forces to second order of their size."""
    errors = []
    for n in (8, 16, 32):
        mesh = fm.shells.flat_plate(1.0, 1.0, n, n, kind=kind)
        body = fm.shell_body(mesh, fm.shells.ShellProperty(0.05, STEEL), name="p", units=SI)
        x, y = mesh.nodes[:, 0], mesh.nodes[:, 1]
        zero = np.zeros(len(x))
        if state == "membrane":
            u = np.stack([np.sin(x) * y, np.cos(y) * x, zero, zero, zero, (np.cos(y) - np.sin(x)) / 2], axis=1)
        else:
            u = np.stack([zero, zero, np.sin(x) * np.cos(2 * y), zero, zero, zero], axis=1)
            u[:, 3], u[:, 4] = -2 * np.sin(x) * np.sin(2 * y), -np.cos(x) * np.cos(2 * y)
        u = 1e-3 * u.ravel()
        theta = np.array([0.3, -0.2, 0.5])
        turned = np.hstack([np.cross(theta, mesh.nodes), np.tile(theta, (len(x), 1))]).ravel()
        phases = np.random.default_rng(0).normal(size=6)
        smooth = np.stack([np.sin(phase + x + 2 * y) for phase in phases], axis=1)
        columns = np.stack([turned, smooth.ravel()], axis=1)
        K = body.element_model.geometric_stiffness(
            body.mesh_displacement(u[:, None]), MassLoads.none(1), body.mesh_displacement(columns)
        )[0]
        f = (body.K @ u).reshape(-1, 6)
        expected = np.hstack([np.cross(theta, f[:, :3]), np.cross(theta, f[:, 3:]) / 2])
        work = (smooth * expected).sum()
        errors.append(abs(K[0, 1] - work) / abs(work))
    assert errors[2] < 2e-3
    assert errors[2] < errors[1] / 3


@pytest.mark.parametrize("offset", [0.0, 0.04])
def test_the_stiffness_of_many_states_repeats_bit_for_bit_whatever_the_threads_and_is_theirs_alone(monkeypatch, offset):
    """Chunks are summed in their order; a state by itself has the stiffness it has among others."""
    monkeypatch.setattr("fe_models.elements.shells.elements.CHUNK", 5)
    body = bent_strip("quad", offset=offset)
    model, rng = body.element_model, np.random.default_rng(0)
    u, Phi = (rng.standard_normal((model.n_mesh_dof, k)) for k in (3, 4))
    loads = MassLoads(rng.standard_normal((3, 3, 3)), rng.standard_normal((3, 3)))
    found = []
    for n in (1, 3):
        monkeypatch.setattr("fe_models.elements.shells.model.n_threads", lambda n=n: n)
        found.append(model.geometric_stiffness(u, loads, Phi))
    assert_array_equal(found[0], found[1])
    alone = model.geometric_stiffness(u[:, 1:2], MassLoads(loads.A[1:2], loads.b[1:2]), Phi[:, 2:])
    assert_allclose(alone[0], found[0][1, 2:, 2:], rtol=0, atol=1e-12 * np.abs(found[0]).max())
