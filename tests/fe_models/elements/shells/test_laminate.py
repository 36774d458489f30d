"""Shells of layers: laminate theory by another road, Navier's series, bricks, strips of two metals, patch tests."""

from dataclasses import replace

import numpy as np
import pytest
import scipy.sparse.linalg as spl
from numpy.testing import assert_allclose

import fe_models as fm
from fe_models.body.rigid_motion import MassLoads, rigid_motion_of_dofs
from fe_models.elements.recovery.strain import nodal_strain
from fe_models.elements.shells.geometric import stress_second_moments
from fe_models.elements.shells.laminate import shell_law
from fe_models.errors import BodyError, ShellError
from tests.bodies import box_mesh
from tests.fe_models.elements.shells.examples import balanced_state, turned_loads
from tests.fe_models.small_shells import KINDS, SI, STEEL, distorted, frequencies, of_nodes, solved

E_1, E_2, NU, G, G_23 = 140e9, 10e9, 0.3, 5e9, 3.5e9
PLY = fm.body.OrthotropicMaterial("ply", (E_1, E_2, E_2), (G, G, G_23), (NU, NU, 0.4), 1500.0)
HEAVY = replace(PLY, name="heavy", rho=2500.0)
X = (1.0, 0.0, 0.0)
ODD = (
    fm.shells.Layer(PLY, 0.004, 30.0),
    fm.shells.Layer(HEAVY, 0.002, -70.0),
    fm.shells.Layer(STEEL, 0.001),
    fm.shells.Layer(PLY, 0.003, 10.0),
)


def laminate(*layers, direction=X, **more):
    return fm.shells.LaminateProperty(layers, direction, **more)


def shell(mesh, item):
    return fm.shell_body(mesh, item, name="shell", units=SI)


def curved(kind):
    def surface(u, v):
        return np.stack([np.sin(1.5 * u), 0.4 * v + 0.1 * u * v, np.cos(1.5 * u) + 0.1 * v**2], axis=1)

    return fm.shells.mapped_shell(surface, 6, 2, kind=kind)


def ply_tensor(angle):
    """Plane stress elasticity C_abcd of the ply, (2, 2, 2, 2), and its shear moduli G_ab, turned index by index."""
    nu_21 = NU * E_2 / E_1
    C = np.zeros((2, 2, 2, 2))
    C[0, 0, 0, 0], C[1, 1, 1, 1] = E_1 / (1 - NU * nu_21), E_2 / (1 - NU * nu_21)
    C[0, 0, 1, 1] = C[1, 1, 0, 0] = NU * E_2 / (1 - NU * nu_21)
    C[0, 1, 0, 1] = C[0, 1, 1, 0] = C[1, 0, 0, 1] = C[1, 0, 1, 0] = G
    c, s = np.cos(np.deg2rad(angle)), np.sin(np.deg2rad(angle))
    R = np.array([[c, -s], [s, c]])  # columns: axes of the ply
    return np.einsum("ia,jb,kc,ld,abcd->ijkl", R, R, R, R, C), R @ np.diag([G, G_23]) @ R.T


def plies(angles, t, n=2001):
    """Heights, C_abcd and shear flexibility at points through the thickness, and weights of Simpson's rule."""
    z, C, flexibility, w = [], [], [], []
    for k, angle in enumerate(angles):
        C_k, G_k = ply_tensor(angle)
        z.append(np.linspace(k * t, (k + 1) * t, n) - len(angles) * t / 2)
        C.append(np.broadcast_to(C_k, (n, 2, 2, 2, 2)))
        flexibility.append(np.broadcast_to(np.linalg.inv(G_k), (n, 2, 2)))
        simpson = np.where(np.arange(n) % 2, 4.0, 2.0)
        simpson[[0, -1]] = 1.0
        w.append(simpson * t / (n - 1) / 3)
    return np.concatenate(z), np.concatenate(C), np.concatenate(flexibility), np.concatenate(w)


def voigt(C):
    pairs = ((0, 0), (1, 1), (0, 1))
    return np.array([[C[*p, *q] for q in pairs] for p in pairs])


def by_quadrature(angles, t):
    """A, B, D, ∫ Q z³ and H of plies, integrated through the thickness point by point."""
    z, C, flexibility, w = plies(angles, t)
    A, B, D, third = (voigt(np.einsum("n,nijkl->ijkl", w * z**k, C)) for k in range(4))
    Q = np.array([voigt(item) for item in C])
    bend = np.linalg.inv(D - B @ np.linalg.solve(A, B))
    sigma = Q @ (z[:, None, None] * np.eye(3) - np.linalg.solve(A, B)) @ bend
    step = np.diff(z, prepend=z[0])[:, None, None]
    mean = (sigma + np.roll(sigma, 1, axis=0)) / 2
    f = -np.cumsum(step * mean, axis=0)
    F = np.array([[f[:, 0, 0], f[:, 2, 1]], [f[:, 2, 0], f[:, 1, 1]]]).transpose(2, 0, 1)
    H = np.linalg.inv(np.einsum("n,nai,nab,nbj->ij", w, F, flexibility, F))
    return A, B, D, third, H


@pytest.mark.parametrize("angles", [(0,), (0, 90), (0, 90, 90, 0), (30, -45, 80)])
def test_stiffness_is_the_integral_over_the_thickness(angles):
    t = 0.002
    law = shell_law(laminate(*(fm.shells.Layer(PLY, t, angle) for angle in angles)))
    A, B, D, third, H = by_quadrature(angles, t)
    h = t * len(angles)
    for ours, other, size in ((law.A, A, h), (law.B, B, h**2), (law.D, D, h**3), (law.third, third, h**4)):
        assert_allclose(ours, other, rtol=0, atol=1e-11 * E_1 * size)
    assert_allclose(law.H, H, rtol=0, atol=1e-6 * G * h)


def test_one_isotropic_layer_has_five_sixths_of_its_shear_stiffness():
    t, nu = 0.03, STEEL.nu
    law = shell_law(laminate(fm.shells.Layer(STEEL, t, 33.0)))
    C = STEEL.E / (1 - nu**2) * np.array([[1, nu, 0], [nu, 1, 0], [0, 0, (1 - nu) / 2]])
    expected = np.zeros((8, 8))
    expected[:3, :3], expected[3:6, 3:6], expected[6:, 6:] = t * C, t**3 / 12 * C, 5 / 6 * STEEL.mu * t * np.eye(2)
    assert_allclose(law.stiffness, expected, rtol=1e-13, atol=1e-13 * STEEL.E * t**3)
    assert_allclose([law.mass, law.centre, law.spread], [STEEL.rho * t, 0, t**2 / 12], rtol=1e-13, atol=0)
    assert_allclose([law.nu, law.shear_modulus], [nu, STEEL.mu * t], rtol=1e-13, atol=0)


def matrices(stiffness=None, shear_stiffness=None, direction=X, *, thickness=0.05, **more):
    """Return the stiffness of a steel plate 0.05 thick, written out, or another one."""
    E, nu, t = STEEL.E, STEEL.nu, 0.05
    plane = E / (1 - nu**2) * np.array([[1, nu, 0], [nu, 1, 0], [0, 0, (1 - nu) / 2]])
    C = np.kron(np.diag([t, t**3 / 12]), plane) if stiffness is None else stiffness
    H = 5 / 6 * E / (2 + 2 * nu) * t * np.eye(2) if shear_stiffness is None else shear_stiffness
    return fm.shells.StiffnessProperty(thickness, C, H, direction, **more)


@pytest.mark.parametrize("kind", KINDS)
def test_given_stiffness_of_a_plate_is_the_shell_of_its_material(kind):
    """But for the rotary inertia, which matrices do not give."""
    one = shell(curved(kind), fm.shells.ShellProperty(0.05, STEEL, offset=0.04, added_mass=7.0))
    item = matrices(direction=(0.3, 0.9, -0.4), offset=0.04, added_mass=7.0 + 0.05 * STEEL.rho)
    given = shell(curved(kind), item)
    K = one.K.toarray()
    assert_allclose(given.K.toarray(), K, rtol=0, atol=1e-12 * np.abs(K).max())
    rng = np.random.default_rng(0)
    u = rng.normal(size=(one.element_model.n_mesh_dof, 2))
    loads = MassLoads(np.zeros((2, 3, 3)), rng.normal(size=(2, 3)))
    for result in (
        lambda model: model.nodal_stress(u),
        lambda model: model.geometric_stiffness(u, loads, u),
        lambda model: model.mass_forces(loads),
    ):
        ours, expected = (result(body.element_model) for body in (given, one))
        assert_allclose(ours, expected, rtol=0, atol=1e-11 * np.abs(expected).max())
    turns = np.zeros((one.n_dof, 3))
    turns[np.arange(one.n_dof), one.dofs[:, 1] % 3] = one.dofs[:, 1] > 2  # all nodes turn in place
    rotary = turns.T @ (one.M - given.M) @ turns
    area = one.element_model.groups[0].areas().sum() if len(one.element_model.groups) == 1 else None
    assert_allclose(np.trace(rotary), 2 * area * (0.05 * STEEL.rho + 7.0) * 0.05**2 / 12, rtol=1e-9, atol=0)
    assert "along direction [0.3, 0.9, -0.4]" in given.provenance["stiffness 1"]
    with pytest.raises(BodyError, match="shells of given stiffness is not known"):
        nodal_strain(given, u, np.arange(2))


@pytest.mark.parametrize("kind", KINDS)
def test_isotropic_layers_are_the_shell_of_one_material(kind):
    """Three layers of steel, one of them as an orthotropic material of equal moduli, at any angles."""
    same = fm.body.OrthotropicMaterial("same", 3 * (STEEL.E,), 3 * (STEEL.mu,), 3 * (STEEL.nu,), STEEL.rho)
    layers = (fm.shells.Layer(STEEL, 0.02, 20.0), fm.shells.Layer(same, 0.012, 37.0), fm.shells.Layer(STEEL, 0.018))
    more = {"offset": 0.04, "added_mass": 7.0}
    one = shell(curved(kind), fm.shells.ShellProperty(0.05, STEEL, **more))
    three = shell(curved(kind), laminate(*layers, direction=(0.3, 0.9, -0.4), **more))
    for name in ("K", "M"):
        ours, expected = (getattr(body, name).toarray() for body in (three, one))
        assert_allclose(ours, expected, rtol=0, atol=1e-12 * np.abs(expected).max())
    rng = np.random.default_rng(0)
    u = rng.normal(size=(one.element_model.n_mesh_dof, 2))
    loads = MassLoads(rng.normal(size=(2, 3, 3)), rng.normal(size=(2, 3)))
    for result in (
        lambda model: model.nodal_stress(u),
        lambda model: model.geometric_stiffness(u, loads, u),
        lambda model: model.mass_gram(u),
    ):
        ours, expected = (result(body.element_model) for body in (three, one))
        assert_allclose(ours, expected, rtol=0, atol=1e-11 * np.abs(expected).max())


@pytest.mark.parametrize("kind", KINDS)
def test_stress_along_the_fibres_is_along_their_angle_from_the_projected_direction(kind):
    """One layer at 30 degrees: the strain of a stress s along a_1 is s/E_1 along it, -nu_12 s/E_1 across."""
    mesh = distorted(fm.shells.flat_plate(1.0, 0.8, 4, 3, kind=kind))
    angle, s = np.deg2rad(30.0 + 20.0), 1e6
    direction = (np.cos(np.deg2rad(20.0)), np.sin(np.deg2rad(20.0)), 1.5)
    body = shell(mesh, laminate(fm.shells.Layer(PLY, 0.02, 30.0), direction=direction))
    a_1, a_2 = np.array([[np.cos(angle), np.sin(angle), 0], [-np.sin(angle), np.cos(angle), 0]])
    strain = s / E_1 * np.outer(a_1, a_1) - NU * s / E_1 * np.outer(a_2, a_2)
    u = np.zeros((len(mesh.nodes), 6))
    u[:, :3] = mesh.nodes @ strain
    stress = body.element_model.nodal_stress(body.mesh_displacement(u.reshape(-1, 1)))[:, :, 0]
    expected = s * np.outer(a_1, a_1)[[0, 1, 2, 1, 0, 0], [0, 1, 2, 2, 2, 1]]
    assert_allclose(stress, np.tile(expected, (len(stress), 1)), rtol=0, atol=1e-9 * s)
    layer = fm.shells.layer_stress(body, u.reshape(-1, 1), {kind: [0, 3]}, 0)
    assert_allclose(layer[..., 0], np.tile([s, 0, 0, 0, 0], (2, 2, 1)), rtol=0, atol=1e-9 * s)


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize(("layers", "angle"), [(ODD[:1], 25.0), (ODD, 90.0)])
def test_layers_turned_are_the_mesh_turned_the_other_way(kind, layers, angle):
    """Many layers by a right angle: the transverse shear of angle plies depends on the axes of the layup otherwise."""
    mesh = distorted(fm.shells.flat_plate(1.0, 0.8, 3, 3, kind=kind))
    c, s = np.cos(np.deg2rad(angle)), np.sin(np.deg2rad(angle))
    R = np.array([[c, -s, 0], [s, c, 0], [0, 0, 1.0]])
    K = shell(replace(mesh, nodes=mesh.nodes @ R.T), laminate(*layers)).K.toarray()
    turned = shell(mesh, laminate(*(replace(layer, angle=layer.angle - angle) for layer in layers))).K.toarray()
    T = np.kron(np.eye(2 * len(mesh.nodes)), R)
    assert_allclose(K, T @ turned @ T.T, rtol=0, atol=1e-11 * np.abs(K).max())


@pytest.mark.parametrize("kind", KINDS)
def test_constant_strain_and_curvature_of_a_coupled_layup_are_exact_on_any_mesh(kind):
    mesh = distorted(fm.shells.flat_plate(1.0, 0.8, 5, 4, kind=kind))
    body = shell(mesh, laminate(*ODD))
    rng = np.random.default_rng(2)
    eps, kappa = rng.normal(size=3), 30 * rng.normal(size=3)
    x, y, _ = mesh.nodes.T
    u = np.zeros((len(x), 6))
    u[:, 0], u[:, 1] = eps[0] * x + eps[2] / 2 * y, eps[1] * y + eps[2] / 2 * x
    u[:, 2] = -(kappa[0] * x**2 + kappa[1] * y**2 + kappa[2] * x * y) / 2
    u[:, 3], u[:, 4] = -(kappa[1] * y + kappa[2] * x / 2), kappa[0] * x + kappa[2] * y / 2
    column = u.reshape(-1, 1)
    forces = (body.K @ column).reshape(-1, 6)
    inner = (x > 1e-6) & (x < 1 - 1e-6) & (y > 1e-6) & (y < 0.8 - 1e-6)
    assert inner.sum() > 8
    assert_allclose(forces[inner], 0, rtol=0, atol=1e-10 * np.abs(forces).max())
    h = sum(layer.thickness for layer in ODD)
    stress = body.element_model.nodal_stress(body.mesh_displacement(column))[:, :, 0]
    n, size = len(x), np.abs(stress).max()
    top = voigt(ply_tensor(10.0)[0]) @ (eps + h / 2 * kappa)
    bottom = voigt(ply_tensor(30.0)[0]) @ (eps - h / 2 * kappa)
    half = (len(stress) - n) // 2
    assert_allclose(stress[n : n + half][:, [0, 1, 5]], np.tile(top, (half, 1)), rtol=0, atol=1e-9 * size)
    assert_allclose(stress[n + half :][:, [0, 1, 5]], np.tile(bottom, (half, 1)), rtol=0, atol=1e-9 * size)


def test_a_strip_of_two_metals_bends_and_stretches_as_its_beam():
    """nu = 0, end moment M per width: curvature M over the bending stiffness about the stiffness' own centre."""
    low, high = (fm.Material("low", E=2.1e11, nu=0.0, rho=7800.0), fm.Material("high", E=0.7e11, nu=0.0, rho=2700.0))
    t_1, t_2, length, M = 0.003, 0.005, 0.5, 40.0
    for kind in KINDS:
        mesh = fm.shells.flat_plate(length, 0.1, 5, 1, kind=kind)
        body = shell(mesh, laminate(fm.shells.Layer(low, t_1), fm.shells.Layer(high, t_2)))
        x = mesh.nodes[:, 0]
        f = np.zeros(body.n_dof)
        end = np.flatnonzero(x > length - 1e-9)
        f[6 * end + 4] = M * 0.1 / 2
        u = solved(body, f, np.concatenate([of_nodes(np.flatnonzero(x < 1e-9), 0, 2, 4), [1]])).reshape(-1, 6)
        z_1, z_2 = (t_1 - t_1 - t_2) / 2, t_1 / 2
        c = (low.E * t_1 * z_1 + high.E * t_2 * z_2) / (low.E * t_1 + high.E * t_2)
        stiffness = low.E * (t_1**3 / 12 + t_1 * (z_1 - c) ** 2) + high.E * (t_2**3 / 12 + t_2 * (z_2 - c) ** 2)
        kappa = M / stiffness
        assert_allclose(u[end, 4], kappa * length, rtol=1e-9, atol=0)
        assert_allclose(u[end, 2], -kappa * length**2 / 2, rtol=1e-9, atol=0)
        assert_allclose(u[end, 0], -c * kappa * length, rtol=1e-9, atol=0)
        z = np.array([-(t_1 + t_2) / 2, t_1 - (t_1 + t_2) / 2, (t_1 + t_2) / 2])
        for layer, E in ((0, low.E), (1, high.E)):
            stress = fm.shells.layer_stress(body, u.reshape(-1, 1), {kind: [2]}, layer)[0, :, :, 0]
            assert_allclose(stress[:, 0], E * kappa * (z[layer : layer + 2] - c), rtol=1e-8, atol=0)


def cross_ply_law(layers):
    """C, (8, 8), and I_0, I_1, I_2 of plies (thickness, angle 0 or 90, rho), H by quadrature of the flexibility."""
    total = sum(t for t, _, _ in layers)
    edges = np.cumsum([0.0, *(t for t, _, _ in layers)]) - total / 2
    A, B, D = np.zeros((3, 3, 3))
    mass = np.zeros(3)
    for (_, angle, rho), low, high in zip(layers, edges[:-1], edges[1:], strict=True):
        Q = voigt(ply_tensor(angle)[0])
        for power, matrix in enumerate((A, B, D), start=1):
            share = (high**power - low**power) / power
            matrix += share * Q
            mass[power - 1] += share * rho
    t = layers[0][0]
    assert all(item[0] == t for item in layers)
    C = np.zeros((8, 8))
    C[:3, :3], C[:3, 3:6], C[3:6, :3], C[3:6, 3:6] = A, B, B, D
    C[6:, 6:] = by_quadrature([angle for _, angle, _ in layers], t)[4]
    return C, mass


def navier(layers, a, b, m, n):
    """K and M, (5, 5), per quarter of the area over U V W X Y of a simply supported cross-ply plate with shear.

    u = U cos αx sin βy, v = V sin cos, w = W sin sin, beta_x = X cos sin, beta_y = Y sin cos.
    """
    C, (I_0, I_1, I_2) = cross_ply_law(layers)
    al, be = m * np.pi / a, n * np.pi / b
    strains = np.zeros((8, 5))
    strains[0, 0], strains[1, 1], strains[2, :2] = -al, -be, (be, al)
    strains[3, 3], strains[4, 4], strains[5, 3:] = -al, -be, (be, al)
    strains[6, [2, 3]], strains[7, [2, 4]] = (al, 1), (be, 1)
    M = np.diag([I_0, I_0, I_0, I_2, I_2])
    M[0, 3] = M[3, 0] = M[1, 4] = M[4, 1] = I_1
    return strains.T @ C @ strains, M


def navier_frequencies(layers, a, b, k):
    found = []
    for m in range(1, 5):
        for n in range(1, 5):
            K, M = navier(layers, a, b, m, n)
            found.append(np.linalg.eigvals(np.linalg.solve(M, K)).real.min())
    return np.sqrt(np.sort(found)[:k]) / (2 * np.pi)


def simply_supported(mesh, a, b):
    x, y, _ = mesh.nodes.T
    on_x, on_y = ((np.abs(s * (s - size)) < 1e-9) for s, size in ((x, a), (y, b)))
    return np.unique(np.concatenate([of_nodes(np.flatnonzero(on_x), 1, 2, 3), of_nodes(np.flatnonzero(on_y), 0, 2, 4)]))


CROSS_PLIES = {
    "0/90 of two densities": [(0.02, 0.0, 1500.0), (0.02, 90.0, 2500.0)],
    "0/90/90/0": [(0.01, 0.0, 1500.0), (0.01, 90.0, 1500.0), (0.01, 90.0, 1500.0), (0.01, 0.0, 1500.0)],
}


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("name", list(CROSS_PLIES))
def test_cross_plies_have_the_frequencies_and_the_deflection_of_naviers_series(kind, name):
    """Sides 1 and 0.8, thickness 0.04: errors fall with h², and what two meshes tend to is the series."""
    layers, a, b = CROSS_PLIES[name], 1.0, 0.8
    material = {1500.0: PLY, 2500.0: HEAVY}
    item = laminate(*(fm.shells.Layer(material[rho], t, angle) for t, angle, rho in layers))
    expected = navier_frequencies(layers, a, b, 4)
    errors, deflections = [], []
    for n in (8, 16):
        mesh = fm.shells.flat_plate(a, b, n, n, kind=kind)
        body = shell(mesh, item)
        held = simply_supported(mesh, a, b)
        errors.append(frequencies(body, held, 4) / expected - 1)
        x, y, _ = mesh.nodes.T
        load = np.zeros(body.n_dof)
        load[2::6] = np.sin(np.pi * x / a) * np.sin(np.pi * y / b) * a * b / n**2
        K, _ = navier(layers, a, b, 1, 1)
        w = np.linalg.solve(K, [0, 0, 1.0, 0, 0])[2]
        middle = np.argmin((x - a / 2) ** 2 + (y - b / 2) ** 2)
        deflections.append(solved(body, load, held)[6 * middle + 2] / w - 1)
    for (coarse, fine), limit in ((errors, {"quad": 0.002, "triangle": 0.005}[kind]), (deflections, 0.001)):
        assert np.abs(fine).max() < 0.011
        assert np.abs((4 * fine - coarse) / 3).max() < limit


@pytest.mark.parametrize("angles", [(0.0, 90.0), (0.0, 90.0, 0.0)])
def test_thick_plates_vibrate_as_their_layers_of_bricks(angles):
    """Simply supported square, ten times as wide as thick: Navier's series with the shear stiffness H is 0.4 % lower.

    With 5/6 of ∫ G dz instead of H the three layers would be 1 % higher, beyond the bricks.
    """
    h, t = 0.1, 0.1 / len(angles)
    mesh = box_mesh(6, 6, {2: 4, 3: 3}[len(angles)], 1.0, 1.0, h, "hexahedron20")
    layer = np.floor(mesh.nodes[mesh.cells["hexahedron20"]].mean(axis=1)[:, 2] / t).astype(int)
    across = replace(PLY, name="90", axes=((0, 1, 0), (-1, 0, 0), (0, 0, 1)))
    groups = {f"{k}": {"hexahedron20": np.flatnonzero(layer == k)} for k in range(len(angles))}
    materials = {f"{k}": across if angle else PLY for k, angle in enumerate(angles)}
    body = fm.solid_body(replace(mesh, cell_sets=groups), materials, name="bricks", units=SI)
    x, y, _ = mesh.nodes.T
    on_x, on_y = (x < 1e-9) | (x > 1 - 1e-9), (y < 1e-9) | (y > 1 - 1e-9)
    free = np.flatnonzero(~np.stack([on_y, on_x, on_x | on_y], axis=1).ravel())
    K, M = body.K[free][:, free], body.M[free][:, free]
    v0 = np.random.default_rng(0).normal(size=len(free))
    found = np.sqrt(spl.eigsh(K, 1, M, sigma=0, v0=v0, return_eigenvectors=False)) / (2 * np.pi)
    assert_allclose(found, navier_frequencies([(t, angle, PLY.rho) for angle in angles], 1.0, 1.0, 1), rtol=0.005)


@pytest.mark.parametrize("kind", KINDS)
def test_mass_is_exact_through_layers_of_several_densities(kind):
    """Of a flat plate, against the boxes of its layers: mass, first and second moments; and rigid motion of M."""
    a, b, offset = 1.0, 0.8, 0.03
    mesh = fm.shells.flat_plate(a, b, 3, 2, kind=kind)
    body = shell(mesh, laminate(*ODD, offset=offset, added_mass=4.0))
    gram = body.element_model.mass_gram(np.zeros((body.element_model.n_mesh_dof, 0)))
    h = sum(layer.thickness for layer in ODD)
    z, boxes = offset - h / 2, [(4.0 * a * b, offset, h)]
    for layer in ODD:
        boxes.append((layer.material.rho * layer.thickness * a * b, z + layer.thickness / 2, layer.thickness))
        z += layer.thickness
    expected = np.zeros((4, 4))
    for m, middle, t in boxes:
        place = np.array([1.0, a / 2, b / 2, middle])
        expected += m * np.outer(place, place) + m * np.diag([0, a**2, b**2, t**2]) / 12
    expected[2, 2], expected[1, 1] = (sum(m for m, _, _ in boxes) * size**2 / 3 for size in (b, a))
    assert_allclose(gram, expected, rtol=1e-10, atol=1e-12)
    Psi = rigid_motion_of_dofs(body.nodes, body.dofs)
    E = expected[1:, 1:]
    assert_allclose((Psi.T @ body.M @ Psi)[3:, 3:], np.trace(E) * np.eye(3) - E, rtol=1e-10, atol=1e-12)


@pytest.mark.parametrize("kind", KINDS)
def test_a_rigid_rotation_turns_the_forces_of_a_shell_of_layers(kind):
    body = shell(curved(kind), laminate(*(replace(layer, thickness=8 * layer.thickness) for layer in ODD), offset=0.04))
    loads, nodal, u = balanced_state(body)
    Psi = rigid_motion_of_dofs(body.nodes, body.dofs)
    columns = (body.mesh_displacement(item) for item in (u[:, None], Psi))
    K = body.element_model.geometric_stiffness(next(columns), loads, next(columns))[0]
    f = nodal.reshape(-1, 6)
    expected = np.zeros((6, 6))
    for axis in range(3):
        theta = np.eye(3)[axis]
        turned = np.hstack([np.cross(theta, f[:, :3]), np.cross(theta, f[:, 3:]) / 2]).ravel()
        turned += (body.recovery.matrix.T @ body.element_model.mass_forces(turned_loads(loads, theta)))[:, 0]
        expected[:, 3 + axis] = Psi.T @ turned
    scale = np.abs(f).max()
    assert_allclose(K[:3], 0, rtol=0, atol=1e-9 * scale)
    assert_allclose(K[3:, 3:], (expected[3:, 3:] + expected[3:, 3:].T) / 2, rtol=0, atol=1e-8 * scale)
    assert np.abs(expected[3:, 3:]).max() > 1e-3 * scale


def test_a_cross_ply_buckles_at_the_load_of_naviers_series():
    layers, a, b, n = CROSS_PLIES["0/90/90/0"], 1.0, 0.8, 16
    mesh = fm.shells.flat_plate(a, b, n, n)
    body = shell(mesh, laminate(*(fm.shells.Layer(PLY, t, angle) for t, angle, _ in layers)))
    C, _ = cross_ply_law(layers)
    eps = np.linalg.solve(C[:3, :3], [-1.0, 0.0, 0.0])  # N_x = -1 everywhere
    x, y, _ = mesh.nodes.T
    u = np.zeros((len(x), 6))
    u[:, 0], u[:, 1] = eps[0] * x, eps[1] * y
    free = np.setdiff1d(np.arange(body.n_dof), simply_supported(mesh, a, b))
    shapes = np.zeros((body.n_dof, 6))
    start = np.random.default_rng(0).normal(size=len(free))
    K, M = (matrix[free][:, free] for matrix in (body.K, body.M))
    shapes[free] = spl.eigsh(K, 6, M, sigma=0, v0=start)[1]
    K_geo = body.element_model.geometric_stiffness(
        body.mesh_displacement(u.reshape(-1, 1)), MassLoads.none(1), body.mesh_displacement(shapes)
    )[0]
    found = 1 / np.linalg.eigvals(np.linalg.solve(shapes.T @ body.K @ shapes, -K_geo)).real.max()
    loads = []
    for m in range(1, 4):
        K_mn, _ = navier(layers, a, b, m, 1)
        flexibility = np.linalg.inv(K_mn)[2, 2]
        loads.append(1 / (flexibility * (m * np.pi / a) ** 2))
    assert_allclose(found, min(loads), rtol=0.015, atol=0)


@pytest.mark.parametrize(
    ("make", "words"),
    [
        (lambda: laminate(), "layers: expected one Layer or more"),
        (
            lambda: laminate(fm.shells.Layer(PLY, 0.01), direction=(0, 0, 0)),
            "direction: expected a vector that is not zero",
        ),
        (lambda: laminate(fm.shells.Layer(PLY, 0.01), direction=(0, 1)), "direction: expected three finite numbers"),
        (lambda: fm.shells.Layer(PLY, 0.0), "layer: thickness: expected a length above zero"),
        (lambda: fm.shells.Layer(PLY, 0.01, np.nan), "layer: angle: expected a finite number"),
        (lambda: fm.shells.Layer(replace(PLY, axes=((0, 1, 0), (-1, 0, 0), (0, 0, 1))), 0.01), "has axes of its own"),
        (lambda: laminate(fm.shells.Layer(PLY, 0.01), added_mass=-1.0), "added_mass: expected zero or more"),
        (lambda: matrices(np.eye(5)), "stiffness: expected 6 rows of 6 finite numbers"),
        (lambda: matrices(np.eye(6) + np.eye(6, k=1) / 2), "stiffness: expected a symmetric matrix"),
        (lambda: matrices(np.ones((6, 6))), "expected a positive definite matrix, got the scaled eigenvalue"),
        (lambda: matrices(-np.eye(6)), "stiffness: expected a positive definite matrix, got the diagonal"),
        (lambda: matrices(shear_stiffness=np.eye(3)), "shear_stiffness: expected 2 rows of 2 finite numbers"),
        (lambda: matrices(direction=(0, 0, 0)), "direction: expected a vector that is not zero"),
        (lambda: matrices(thickness=0.0), "thickness: expected a length above zero"),
        (lambda: matrices(added_mass=-1.0), "added_mass: expected zero or more"),
    ],
)
def test_impossible_layups_are_refused(make, words):
    with pytest.raises(ShellError, match=words):
        make()


def test_cells_across_the_direction_and_layers_that_do_not_exist_are_refused():
    mesh = fm.shells.flat_plate(1.0, 1.0, 2, 2)
    with pytest.raises(ShellError, match=r"4 quad cells are normal to direction \(0.0, 0.01, 1.0\), first cell 0"):
        shell(mesh, laminate(*ODD, direction=(0, 0.01, 1)))
    body = shell(mesh, laminate(*ODD))
    with pytest.raises(ShellError, match=r"quad 1 has 4 layers; expected 0..3, got 4"):
        fm.shells.layer_stress(body, np.zeros((body.n_dof, 1)), {"quad": [1]}, 4)
    with pytest.raises(ShellError, match="expected columns over 54 dofs"):
        fm.shells.layer_stress(body, np.zeros(body.n_dof), {"quad": [1]}, 0)


def test_transverse_shear_carries_its_force_vanishes_at_the_faces_and_does_not_jump():
    law = shell_law(laminate(*ODD))
    points, weights = np.polynomial.legendre.leggauss(3)
    force = np.zeros((2, 2))
    for k, (low, high) in enumerate(zip(law.z[:-1], law.z[1:], strict=True)):
        for x, w in zip(points, weights, strict=True):
            force += w * (high - low) / 2 * law.stress((low + high) / 2 + x * (high - low) / 2, k)[3:, 6:]
    assert_allclose(force, np.eye(2), rtol=0, atol=1e-11)
    tau = np.array([[law.stress(z, k)[3:, 6:] for z in law.z[k : k + 2]] for k in range(len(ODD))]) * law.thickness
    assert_allclose(tau[0, 0], 0, rtol=0, atol=1e-11)
    assert_allclose(tau[-1, 1], 0, rtol=0, atol=1e-11)
    assert_allclose(tau[:-1, 1], tau[1:, 0], rtol=0, atol=1e-11)
    assert np.abs(tau[1:, 0]).min(axis=0).max() > 0.1


def test_geometric_stiffness_takes_the_second_moment_of_the_stress_of_layers():
    body = shell(
        fm.shells.flat_plate(1.0, 1.0, 1, 1),
        laminate(fm.shells.Layer(PLY, 0.01, 30.0), fm.shells.Layer(PLY, 0.01, 80.0)),
    )
    _, _, D, third, _ = by_quadrature((30, 80), 0.01)
    P = stress_second_moments(body.element_model.groups[0], slice(0, 1))[0]
    assert_allclose(P, np.hstack([D, third]), rtol=0, atol=1e-11 * E_1 * 0.02**3)
    assert_allclose(P[:, 3:], third, rtol=0, atol=1e-11 * E_1 * 0.02**4)
