"""Flat shells of three and four nodes: rigid motion, patch tests, locking, mass."""

from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose

import cms
import fe_models as fm
from fe_models.body.rigid_motion import rigid_motion_of_dofs
from fe_models.elements.shells.elements import DRILLING_SHARE
from tests.fe_models.elements.shells.examples import shell_fields
from tests.fe_models.small_shells import KINDS, SI, STEEL, distorted, of_nodes, plate, solved

ROUNDOFF = 1e-12
QUARTER_TURNED = np.linalg.qr(np.random.default_rng(5).normal(size=(3, 3)))[0]


def cell(kind, *, warp=0.0, offset=0.0, t=0.1):
    """One distorted element, anywhere in space."""
    nodes = np.array([(0.0, 0, warp), (1.0, 0.1, -warp), (1.2, 0.9, warp), (-0.1, 0.8, -warp)])
    n = 3 if kind == "triangle" else 4
    turn = QUARTER_TURNED * np.linalg.det(QUARTER_TURNED)
    mesh = fm.shells.ShellMesh(nodes[:n] @ turn.T + np.array([1.0, 2.0, 3.0]), {kind: np.arange(n)[None]})
    return fm.shell_body(mesh, fm.shells.ShellProperty(t, STEEL, offset=offset), name="cell", units=SI)


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("offset", [0.0, 0.3])
@pytest.mark.parametrize("warp", [0.0, 0.04])
def test_one_element_has_six_rigid_modes_and_no_others_without_energy(kind, offset, warp):
    body = cell(kind, warp=warp, offset=offset)
    K = body.K.toarray()
    lam = np.linalg.eigvalsh(K)
    assert (np.abs(lam) < 1e-9 * lam[-1]).sum() == 6
    Psi = rigid_motion_of_dofs(body.nodes, body.dofs)
    assert_allclose(K @ Psi, 0, rtol=0, atol=100 * ROUNDOFF * np.abs(K).max())


@pytest.mark.parametrize("kind", KINDS)
def test_a_distorted_patch_has_six_rigid_modes(kind):
    mesh = distorted(fm.shells.flat_plate(1.0, 1.0, 4, 4, kind=kind), warp=0.05)
    body = fm.shell_body(mesh, fm.shells.ShellProperty(0.05, STEEL), name="patch", units=SI)
    lam = np.linalg.eigvalsh(body.K.toarray())
    assert lam[5] < 1e-10 * lam[-1]
    assert lam[6] > 1e-8 * lam[-1]


def patch(kind, field, t=0.05):
    """Displacements and stress of a distorted patch whose rim follows a field; (body, u, field, stress)."""
    mesh = distorted(fm.shells.flat_plate(1.0, 1.3, 4, 4, kind=kind), 0.3)
    body = fm.shell_body(mesh, fm.shells.ShellProperty(t, STEEL), name="patch", units=SI)
    exact = field(mesh.nodes[:, 0], mesh.nodes[:, 1]).ravel()
    rim = of_nodes(np.unique(np.concatenate(list(mesh.node_sets.values()))), *range(6))
    u = solved(body, np.zeros(body.n_dof), rim, exact[rim])
    return mesh, u, exact, body.element_model.nodal_stress(body.mesh_displacement(u[:, None]))[:, :, 0]


@pytest.mark.parametrize("kind", KINDS)
def test_constant_membrane_strain_is_exact_on_distorted_elements(kind):
    a, b, c, d = 0.3e-3, -0.7e-3, 0.5e-3, 0.2e-3

    def field(x, y):
        z = 0 * x
        return np.stack([a * x + b * y, c * x + d * y, z, z, z, z + (c - b) / 2], axis=1)

    _, u, exact, stress = patch(kind, field)
    assert_allclose(u, exact, rtol=0, atol=1e-12 * np.abs(exact).max())
    E, nu = STEEL.E, STEEL.nu
    plane = E / (1 - nu**2)
    expected = np.array([plane * (a + nu * d), plane * (d + nu * a), 0, 0, 0, E / (2 * (1 + nu)) * (b + c)])
    assert_allclose(stress, np.tile(expected, (len(stress), 1)), rtol=0, atol=1e-9 * np.abs(expected).max())


@pytest.mark.parametrize("kind", KINDS)
def test_constant_curvature_is_exact_on_distorted_elements_and_its_stress_at_top_and_bottom(kind):
    a, b, c, t = 0.3, -0.7, 0.5, 0.05

    def field(x, y):
        z = 0 * x
        return np.stack([z, z, a * x**2 / 2 + b * y**2 / 2 + c * x * y, b * y + c * x, -(a * x + c * y), z], axis=1)

    mesh, u, exact, stress = patch(kind, field, t)
    assert_allclose(u, exact, rtol=0, atol=1e-11 * np.abs(exact).max())
    plane = STEEL.E / (1 - STEEL.nu**2)
    at_top = -t / 2 * plane * np.array([a + STEEL.nu * b, b + STEEL.nu * a, 0, 0, 0, (1 - STEEL.nu) * c])
    n = len(mesh.nodes)
    skin = (len(stress) - n) // 2
    scale = np.abs(at_top).max()
    assert_allclose(stress[:n], 0, rtol=0, atol=1e-9 * scale)
    assert_allclose(stress[n : n + skin], np.tile(at_top, (skin, 1)), rtol=0, atol=1e-9 * scale)
    assert_allclose(stress[n + skin :], -np.tile(at_top, (skin, 1)), rtol=0, atol=1e-9 * scale)


@pytest.mark.parametrize("kind", KINDS)
def test_constant_shear_strain_is_exact_where_bending_is_rigid(kind):
    t = 1e4  # of elements of size 0.3: theta = 0 costs no bending energy, any other theta a great deal

    def field(x, y):
        z = 0 * x
        return np.stack([z, z, 0.3 * x + 0.7 * y, z, z, z], axis=1)

    _, u, exact, stress = patch(kind, field, t)
    assert_allclose(u, exact, rtol=0, atol=1e-6)
    G = STEEL.mu
    middle = 1.5 * 5 / 6 * G * np.array([0.7, 0.3])  # yz, xz of the parabola
    n = 25
    assert_allclose(stress[:n, 3:5], np.tile(middle, (n, 1)), rtol=1e-6)


@pytest.mark.parametrize(("kind", "limit"), [("quad", 1e-10), ("triangle", 0.03)])
def test_in_plane_bending_of_rectangles_of_any_aspect_ratio(kind, limit):
    for n in (2, 8):
        length, height, t = 8.0, 1.0, 0.1
        material = replace(STEEL, nu=0.0)
        mesh = fm.shells.flat_plate(length, height, n, 1, kind=kind)
        body = fm.shell_body(mesh, fm.shells.ShellProperty(t, material), name="beam", units=SI)
        f = np.zeros(body.n_dof)
        end = mesh.node_sets["u1"]
        f[of_nodes(end, 0)] = np.where(mesh.nodes[end, 1] > 0.5, -1.0, 1.0)
        start = mesh.node_sets["u0"]
        fixed = np.concatenate(
            [of_nodes(start, 0), of_nodes(start[:1], 1), of_nodes(np.arange(len(mesh.nodes)), 2, 3, 4)]
        )
        u = solved(body, f, np.unique(fixed))
        exact = 1.0 * height * length**2 / (2 * material.E * t * height**3 / 12)
        assert_allclose(u[of_nodes(end, 1)].mean(), exact, rtol=limit)


def test_shear_strain_of_a_quad_is_that_of_its_sides_in_their_middles():
    """phi/(1 + phi) of (w_j - w_i)/L plus the mean rotation along the side, phi = 12 D/(kappa G t L²); thin: none."""
    a, b, t = 1.3, 0.7, 0.1
    mesh = fm.shells.flat_plate(a, b, 1, 1)
    body = fm.shell_body(mesh, fm.shells.ShellProperty(t, STEEL), name="cell", units=SI)
    D_over_shear = STEEL.E * t**3 / (12 * (1 - STEEL.nu**2)) / (5 / 6 * STEEL.mu * t)
    (group,) = body.element_model.groups
    u = np.random.default_rng(0).normal(size=(4, 6))  # nodes 0 (0, 0), 1 (0, b), 2 (a, 0), 3 (a, b)
    strains = group.strains(slice(0, 1)).B[0] @ u[group.cells[0]].ravel()
    g = 1 / np.sqrt(3)
    xi, eta = np.array([-g, g, -g, g]), np.array([-g, -g, g, g])
    monomials = np.stack([xi * 0 + 1, xi, eta, xi * eta], axis=1)
    gamma = np.linalg.solve(monomials, strains[:, 6:8])
    beta_x, beta_y, w = u[:, 4], -u[:, 3], u[:, 2]
    turn = group.planes.R[0][:2, :2]  # local to mesh axes
    for (xi_0, eta_0), (i, j), along, length in (
        ((0, -1), (0, 2), 0, a),
        ((0, 1), (1, 3), 0, a),
        ((-1, 0), (0, 1), 1, b),
        ((1, 0), (2, 3), 1, b),
    ):
        beta = beta_x if along == 0 else beta_y
        phi = 12 * D_over_shear / length**2
        expected = phi / (1 + phi) * ((w[j] - w[i]) / length + (beta[i] + beta[j]) / 2)
        there = turn @ (np.array([1, xi_0, eta_0, xi_0 * eta_0]) @ gamma)
        assert_allclose(there[along], expected, rtol=1e-12)


@pytest.mark.parametrize("kind", KINDS)
def test_thin_plates_do_not_lock(kind):
    """The centre of a clamped square under pressure, thin to the limit: w = 0.00126532 q a⁴/D (Taylor & Govindjee)."""
    for t in (1e-1, 1e-3, 1e-5):
        n = 16
        mesh = fm.shells.flat_plate(10.0, 10.0, n, n, kind=kind)
        body = fm.shell_body(mesh, fm.shells.ShellProperty(t, STEEL), name="plate", units=SI)
        D = STEEL.E * t**3 / (12 * (1 - STEEL.nu**2))
        load = fm.loads.pressure_load(body, mesh, "p", fm.selections.FaceGroup("shell"), -D)
        rim = np.unique(np.concatenate(list(mesh.node_sets.values())))
        u = solved(body, load.f, np.union1d(of_nodes(rim, *range(6)), of_nodes(np.arange(len(mesh.nodes)), 0, 1, 5)))
        center = np.flatnonzero(np.abs(mesh.nodes - [5.0, 5.0, 0.0]).max(axis=1) < 1e-9)
        assert_allclose(u[of_nodes(center, 2)], 0.00126532 * 1e4, rtol=0.02)


def test_invariants_through_the_thickness_are_those_of_a_solid_of_the_same_shape_in_the_same_motion():
    t = 0.3
    mesh = fm.shells.flat_plate(2.0, 1.5, 2, 2)
    shell = fm.shell_body(mesh, fm.shells.ShellProperty(t, STEEL), name="shell", units=SI)
    rng = np.random.default_rng(0)
    u = rng.normal(size=(shell.n_dof, 2))
    fields = [shell_fields(mesh, column, DRILLING_SHARE["quad"]) for column in u.T]
    # bricks of 27 nodes: corners below and above, sides below and above, upright edges, faces -x +x -y +y -z +z, centre
    corner, side, middle = [0, 1, 2, 3], [4, 5, 6, 7], [8]
    order = [
        (-1, corner),
        (1, corner),
        (-1, side),
        (1, side),
        (0, corner),
        (0, [7, 5, 4, 6]),
        (-1, middle),
        (1, middle),
        (0, middle),
    ]
    places = fields[0][0]
    solid_nodes, solid_u = [], [[], []]
    for z, chosen in order:
        solid_nodes.append(places[:, chosen] + np.array([0, 0, z * t / 2]))
        for column, (_, values, across) in zip(solid_u, fields, strict=True):
            column.append(values[:, chosen] + z * t / 2 * across[:, chosen])
    nodes = np.concatenate(solid_nodes, axis=1).reshape(-1, 3)
    solid_mesh = fm.Mesh(nodes, {"hexahedron27": np.arange(len(nodes)).reshape(-1, 27)})
    solid = fm.solid_body(solid_mesh, STEEL, name="solid", units=SI)
    w = np.stack([np.concatenate(column, axis=1).reshape(-1) for column in solid_u], axis=1)
    expected = solid.element_model.mass_gram(w)
    gram = shell.element_model.mass_gram(shell.mesh_displacement(u))
    assert_allclose(gram, expected, rtol=0, atol=100 * ROUNDOFF * np.abs(expected).max())


@pytest.mark.parametrize("kind", KINDS)
def test_mass_and_invariants_come_from_one_field(kind):
    mesh = distorted(fm.shells.flat_plate(1.0, 1.0, 3, 3, kind=kind), warp=0.03)
    body = fm.shell_body(
        mesh, fm.shells.ShellProperty(0.1, STEEL, offset=0.05, added_mass=30.0), name="patch", units=SI
    )
    u = np.random.default_rng(1).normal(size=(body.n_dof, 3))
    gram = body.element_model.mass_gram(body.mesh_displacement(u))
    S = sum(gram[4 + 3 * a : 7 + 3 * a, 4 + 3 * a : 7 + 3 * a] for a in range(3))
    assert_allclose(S, u.T @ body.M @ u, rtol=0, atol=100 * ROUNDOFF * np.abs(S).max())
    Psi = rigid_motion_of_dofs(body.nodes, body.dofs)
    gram = body.element_model.mass_gram(body.mesh_displacement(Psi))
    inertia = np.trace(gram[1:4, 1:4]) * np.eye(3) - gram[1:4, 1:4]
    rigid = Psi.T @ body.M @ Psi
    assert_allclose(rigid[:3, :3], gram[0, 0] * np.eye(3), rtol=0, atol=1e-10 * gram[0, 0])
    assert_allclose(rigid[3:, 3:], inertia, rtol=0, atol=1e-10 * inertia.max())
    assert np.linalg.eigvalsh(body.M.toarray())[0] > 0


def test_an_offset_is_a_mesh_moved_along_the_normal():
    mesh = distorted(fm.shells.flat_plate(1.0, 1.0, 3, 3))
    shifted = replace(mesh, nodes=mesh.nodes + np.array([0.0, 0.0, 0.2]))
    bodies = [
        fm.shell_body(mesh, fm.shells.ShellProperty(0.1, STEEL, offset=0.2), name="offset", units=SI),
        fm.shell_body(shifted, fm.shells.ShellProperty(0.1, STEEL), name="moved", units=SI),
    ]
    arm = np.tile(np.eye(6), (len(mesh.nodes), 1, 1))  # u_moved = u + theta x (0, 0, e)
    arm[:, 0, 4], arm[:, 1, 3] = 0.2, -0.2
    n = len(mesh.nodes)
    T = np.zeros((6 * n, 6 * n))
    for k in range(n):
        T[6 * k : 6 * k + 6, 6 * k : 6 * k + 6] = arm[k]
    for name in ("M", "K"):
        expected = T.T @ getattr(bodies[1], name).toarray() @ T
        assert_allclose(getattr(bodies[0], name).toarray(), expected, rtol=0, atol=1e-12 * np.abs(expected).max())
    moments = [body.element_model.mass_gram(np.zeros((len(body.recovery.dofs), 0))) for body in bodies]
    assert_allclose(moments[0], moments[1], rtol=1e-12)


def test_results_do_not_depend_on_the_first_node_of_a_cell():
    """Up to rounding of the local axes; the shape of the deflection is that of the plate, not of the numbering."""
    for kind in KINDS:
        mesh = distorted(fm.shells.flat_plate(1.0, 1.0, 2, 2, kind=kind), warp=0.02)
        rolled = replace(mesh, cells={kind: np.roll(mesh.cells[kind], 1, axis=1)})
        K, other = (
            fm.shell_body(m, fm.shells.ShellProperty(0.05, STEEL), name="p", units=SI).K.toarray()
            for m in (mesh, rolled)
        )
        assert_allclose(other, K, rtol=0, atol=1e-11 * np.abs(K).max())


def test_a_free_plate_reduces_with_six_rigid_motions():
    body = cms.couple(plate(n=4))
    reduced = cms.reduce(body, cms.modes.normal_modes(body, n_modes=6))
    assert reduced.provenance["mode set rigid-body motions removed"] == "6"
    assert reduced.moments.is_exact
