"""Solid bodies against exact solutions: mass moments, frequencies, their rates of convergence, and stress."""

import numpy as np
import pytest
import scipy.sparse as sp
from numpy.testing import assert_allclose, assert_array_equal
from scipy.linalg import expm
from scipy.optimize import brentq
from scipy.sparse.linalg import eigsh, spsolve

from cms.body.invariants import moments_from_gram
from cms.errors import BodyError
from fe_models.body.fe_body import Interface
from fe_models.body.material import Material
from fe_models.elements.solids.body import solid_body
from fe_models.foundation.units import unit_system
from fe_models.meshes.cell_shapes import shape_values
from fe_models.meshes.mesh import SOLID_TYPES, Mesh
from tests.bodies import ALUMINIUM, STEEL, bar, box_mesh, distorted

SI = unit_system("m-kg-s")
ROUNDOFF = 1e-12
QUADRATIC = ("tetra10", "hexahedron20", "hexahedron27")


def solid(mesh, materials=STEEL):
    return solid_body(mesh, materials, name="test", units=SI)


def lowest(body, fixed, count=1):
    """The lowest circular frequencies squared with some dofs fixed."""
    free = np.setdiff1d(np.arange(body.n_dof), fixed)
    K, M = sp.csc_array(body.K[free][:, free]), sp.csc_array(body.M[free][:, free])
    v0 = np.random.default_rng(0).normal(size=free.size)
    return np.sort(eigsh(K, count, M, sigma=0.0, v0=v0, return_eigenvectors=False))


def rate(h, error):
    return np.polyfit(np.log(h), np.log(error), 1)[0]


# ------------------------------------------------------------------------------------------------------ mass moments


@pytest.mark.parametrize("kind", SOLID_TYPES)
def test_box_has_the_mass_centre_and_inertia_of_a_box(kind):
    lx, ly, lz = 1.2, 0.5, 0.3
    mesh = box_mesh(3, 2, 2, lx, ly, lz, kind)
    is_inside = ((mesh.nodes > 1e-9) & (mesh.nodes < np.array([lx, ly, lz]) - 1e-9)).all(axis=1)
    moved = distorted(mesh, 0.2)
    body = solid(Mesh(np.where(is_inside[:, None], moved.nodes, mesh.nodes), mesh.cells))
    moments = moments_from_gram(body.element_model.mass_gram(np.zeros((body.n_dof, 0))))
    m = STEEL.rho * lx * ly * lz
    assert_allclose(moments.m, m, rtol=ROUNDOFF)
    assert_allclose(moments.center_of_mass, [lx / 2, ly / 2, lz / 2], rtol=ROUNDOFF)
    J = m / 3 * np.diag([ly**2 + lz**2, lx**2 + lz**2, lx**2 + ly**2])
    J -= m / 4 * (np.outer([lx, ly, lz], [lx, ly, lz]) * (1 - np.eye(3)))
    assert_allclose(moments.J0, J, rtol=0, atol=ROUNDOFF * J.max())


def test_triangular_prism_has_the_moments_of_a_prism():
    a, b, c = 0.6, 0.4, 1.5  # right triangle with legs a, b at the origin, length c
    nodes = np.array([[0, 0, 0], [a, 0, 0], [0, b, 0], [0, 0, c], [a, 0, c], [0, b, c]])
    body = solid(Mesh(nodes, {"wedge": [[0, 1, 2, 3, 4, 5]]}))
    moments = moments_from_gram(body.element_model.mass_gram(np.zeros((18, 0))))
    m = STEEL.rho * a * b * c / 2
    R = m * np.array(
        [[a**2 / 6, a * b / 12, a * c / 6], [a * b / 12, b**2 / 6, b * c / 6], [a * c / 6, b * c / 6, c**2 / 3]]
    )
    assert_allclose(moments.S, m * np.array([a / 3, b / 3, c / 2]), rtol=ROUNDOFF)
    assert_allclose(moments.R, R, rtol=ROUNDOFF)


def cylinder_sector(n, kind, angle=np.pi / 2):
    """Quarter of a hollow cylinder, radii 1 and 2, length 1, with its curved nodes on the circles."""
    flat = box_mesh(n, n, 1, 1.0, angle, 1.0, kind)
    r, theta = 1 + flat.nodes[:, 0], flat.nodes[:, 1]
    return Mesh(np.stack([r * np.cos(theta), r * np.sin(theta), flat.nodes[:, 2]], axis=1), flat.cells)


@pytest.mark.parametrize(
    ("kind", "order"), [("hexahedron", 2), ("wedge", 2), ("hexahedron20", 4), ("tetra10", 4), ("wedge15", 4)]
)
def test_inertia_of_a_cylinder_converges_with_the_order_of_the_geometry(kind, order):
    m = STEEL.rho * np.pi / 4 * (2**2 - 1)
    exact = m * (2**2 + 1) / 2  # about the axis
    sizes = np.array([4, 6, 8, 12])
    error = []
    for n in sizes:
        body = solid(cylinder_sector(n, kind))
        error.append(abs(moments_from_gram(body.element_model.mass_gram(np.zeros((body.n_dof, 0)))).J0[2, 2] - exact))
    assert_allclose(rate(1 / sizes, error), order, rtol=0, atol=0.15)


@pytest.mark.parametrize("kind", SOLID_TYPES)
def test_gram_is_the_integral_of_the_interpolated_fields(kind):
    mesh = distorted(box_mesh(2, 1, 1, kind=kind), 0.2)
    body = solid(mesh)
    u = np.random.default_rng(5).normal(size=(body.n_dof, 2))
    at_nodes = np.hstack([np.ones((len(mesh.nodes), 1)), mesh.nodes, *(u[c::3] for c in range(3))])
    x, w = np.polynomial.legendre.leggauss(6)
    r, s, t = (a.ravel() / 2 + 0.5 for a in np.meshgrid(x, x, x, indexing="ij"))
    weight = np.einsum("i,j,k->ijk", w, w, w).ravel() / 8
    if kind.startswith("tetra"):
        points, weight = np.stack([r, s * (1 - r), t * (1 - r) * (1 - s)], 1), weight * (1 - r) ** 2 * (1 - s)
    elif kind.startswith("wedge"):
        points, weight = np.stack([r, s * (1 - r), t], 1), weight * (1 - r)
    elif kind.startswith("pyramid"):
        points, weight = np.stack([r * (1 - t), s * (1 - t), t], 1), weight * (1 - t) ** 2
    else:
        points = np.stack([r, s, t], 1)
    N, dN = shape_values(kind, points)
    cells = mesh.cells[kind]
    det = np.linalg.det(np.einsum("eai,qaj->eqij", mesh.nodes[cells], dN))
    fields = np.einsum("qa,eak->eqk", N, at_nodes[cells])
    expected = np.einsum("eq,q,eqk,eql->kl", det, STEEL.rho * weight, fields, fields)
    gram = body.element_model.mass_gram(u)
    assert_allclose(gram, expected, rtol=0, atol=ROUNDOFF * np.abs(expected).max())
    assert_array_equal(gram, gram.T)


def test_gram_in_blocks_is_the_gram_at_once(monkeypatch):
    body = bar(4, kind="tetra10")
    u = np.random.default_rng(0).normal(size=(body.n_dof, 5))
    whole = body.element_model.mass_gram(u)
    monkeypatch.setattr("fe_models.elements.solids.body.GRAM_BYTES", 5000)
    blocks = body.element_model.mass_gram(u)
    assert_allclose(blocks, whole, rtol=0, atol=ROUNDOFF * np.abs(whole).max())


# ------------------------------------------------------------------------------------------------------- frequencies


def plate_with_rollers(n, kind):
    """A plate one element thick whose faces all slide without friction: its modes are products of sines and cosines."""
    size = np.array([1.0, 0.9, 1 / n])
    mesh = box_mesh(n, n, 1, *size, kind)
    return solid(mesh), np.flatnonzero((np.isclose(mesh.nodes, 0) | np.isclose(mesh.nodes, size)).ravel())


@pytest.mark.parametrize(
    ("kind", "order", "sizes"),
    [
        ("tetra", 2, (8, 12, 16, 20)),
        ("hexahedron", 2, (6, 8, 12, 16)),
        ("wedge", 2, (6, 8, 12, 16)),
        ("tetra10", 4, (6, 8, 10, 12)),
        ("hexahedron20", 4, (3, 4, 6, 8)),
        ("hexahedron27", 4, (3, 4, 6, 8)),
    ],
)
def test_first_frequency_of_a_plate_on_rollers_converges_at_the_order_of_the_element(kind, order, sizes):
    # u = curl of psi e_z, psi = sin(pi x / lx) sin(pi y / ly): a shear wave, omega² = mu / rho |k|²
    exact = STEEL.mu / STEEL.rho * np.pi**2 * (1 + 1 / 0.9**2)
    values = np.array([lowest(*plate_with_rollers(n, kind))[0] for n in sizes])
    error = values / exact - 1
    assert (error > 0).all()  # a conforming mesh is too stiff, and mass is consistent
    assert_allclose(rate(1 / np.array(sizes), error), order, rtol=0, atol=0.15)


def timoshenko(n_modes, *, length, width, height, clamped):
    """Frequencies of a Timoshenko beam bending over its height, by the transfer matrix of (w, psi, M, V) [Hz].

    w' = psi + V / kGA, psi' = M / EI, M' = -V - rho I omega² psi, V' = -rho A omega² w; k of Cowper, a rectangle's.
    """
    A, inertia, G = width * height, width * height**3 / 12, STEEL.mu
    k = 10 * (1 + STEEL.nu) / (12 + 11 * STEEL.nu)

    def determinant(omega):
        rows = np.array(
            [
                [0, 1, 0, 1 / (k * G * A)],
                [0, 0, 1 / (STEEL.E * inertia), 0],
                [0, -STEEL.rho * inertia * omega**2, 0, -1],
                [-STEEL.rho * A * omega**2, 0, 0, 0],
            ]
        )
        scale = np.diag([length, 1, STEEL.E * inertia / length, STEEL.E * inertia / length**2])
        T = expm(np.linalg.inv(scale) @ rows @ scale * length)
        return np.linalg.det(T[2:, 2:] if clamped else T[2:, :2])

    base = np.sqrt(STEEL.E * inertia / (STEEL.rho * A)) / length**2
    omegas = base * np.linspace(1.0, 70.0, 70)
    values = np.array([determinant(omega) for omega in omegas])
    brackets = np.flatnonzero(np.sign(values[:-1]) != np.sign(values[1:]))[:n_modes]
    return np.array([brentq(determinant, omegas[i], omegas[i + 1]) for i in brackets]) / (2 * np.pi)


def test_timoshenko_oracle_tends_to_the_slender_beam():
    for clamped, roots in ((False, (4.730041, 7.853205)), (True, (1.875104, 4.694091))):  # zeros of cosh cos -+ 1
        values = timoshenko(2, length=1.0, width=0.002, height=0.002, clamped=clamped)
        slender = np.array(roots) ** 2 * np.sqrt(STEEL.E / STEEL.rho * 0.002**2 / 12) / (2 * np.pi)
        assert_allclose(values, slender, rtol=2e-4)


@pytest.mark.parametrize("kind", QUADRATIC)
def test_free_bar_has_six_rigid_modes_and_the_frequencies_of_a_timoshenko_beam(kind):
    body = bar(20, 2, 2, kind=kind, length=1.0, width=0.05, height=0.04)
    shift = -((2 * np.pi * 10.0) ** 2)
    v0 = np.random.default_rng(0).normal(size=body.n_dof)
    omega2 = np.sort(eigsh(body.K, 10, body.M, sigma=shift, v0=v0, return_eigenvectors=False))
    assert_allclose(omega2[:6], 0, rtol=0, atol=1e-9 * omega2[6])
    flat = timoshenko(2, length=1.0, width=0.05, height=0.04, clamped=False)
    upright = timoshenko(2, length=1.0, width=0.04, height=0.05, clamped=False)
    expected = np.sort(np.r_[flat, upright])
    assert_allclose(np.sqrt(omega2[6:]) / (2 * np.pi), expected, rtol=2.5e-3)


@pytest.mark.parametrize("kind", QUADRATIC)
def test_clamped_bar_has_the_frequencies_of_a_timoshenko_cantilever(kind):
    body = bar(20, 2, 2, kind=kind, length=1.0, width=0.05, height=0.04)
    at_root = np.flatnonzero(np.isclose(body.nodes[:, 0], 0))
    omega2 = lowest(body, (3 * at_root[:, None] + np.arange(3)).ravel(), 2)
    expected = [timoshenko(1, length=1.0, width=w, height=h, clamped=True)[0] for w, h in ((0.05, 0.04), (0.04, 0.05))]
    assert_allclose(np.sqrt(omega2) / (2 * np.pi), expected, rtol=7e-3)  # the clamp also holds the section's breadth


def test_rod_of_two_materials_has_the_frequency_of_the_transcendental_equation():
    one, two = Material("one", 2.1e11, 0.0, 7850.0), Material("two", 7.0e10, 0.0, 2700.0)
    sizes, error = np.array([4, 6, 8, 12]), []
    c = [np.sqrt(m.E / m.rho) for m in (one, two)]
    Z = [np.sqrt(m.E * m.rho) for m in (one, two)]
    # clamped at x = 0, free at x = 1, halves of length 1/2: Z1 cos cos = Z2 sin sin
    omega = brentq(
        lambda w: (
            Z[0] * np.cos(w / c[0] / 2) * np.cos(w / c[1] / 2) - Z[1] * np.sin(w / c[0] / 2) * np.sin(w / c[1] / 2)
        ),
        100.0,
        2.5 * min(c),
    )
    for n in sizes:
        body = solid(box_mesh(n, 1, 1, 1.0, 0.1, 0.1, "hexahedron20"), {"left half": one, "right half": two})
        lateral = np.flatnonzero(body.dofs[:, 1] > 0)
        root = 3 * np.flatnonzero(body.nodes[:, 0] == 0)
        error.append(lowest(body, np.r_[lateral, root])[0] / omega**2 - 1)
    assert (np.array(error) > 0).all()
    assert_allclose(rate(1 / sizes, error), 4, rtol=0, atol=0.15)


# ------------------------------------------------------------------------------------------------------------ stress


def voigt(stress):
    return stress[[0, 1, 2, 1, 0, 0], [0, 1, 2, 2, 2, 1]]


@pytest.mark.parametrize("kind", SOLID_TYPES)
def test_constant_stress_is_recovered_at_every_node_of_a_distorted_mesh(kind):
    body = solid(distorted(box_mesh(2, 2, 2, kind=kind), 0.2))
    gradient = np.random.default_rng(1).normal(size=(3, 3))
    strain = (gradient + gradient.T) / 2
    u = (body.nodes @ gradient.T).reshape(-1, 1)
    stress = body.element_model.nodal_stress(np.hstack([u, -2 * u]))
    expected = voigt(STEEL.lam * np.trace(strain) * np.eye(3) + 2 * STEEL.mu * strain)
    assert stress.shape == (len(body.nodes), 6, 2)
    assert_allclose(
        stress[:, :, 0], np.tile(expected, (len(body.nodes), 1)), rtol=0, atol=100 * ROUNDOFF * np.abs(expected).max()
    )
    assert_allclose(stress[:, :, 1], -2 * stress[:, :, 0], rtol=ROUNDOFF)


@pytest.mark.parametrize("kind", SOLID_TYPES)
def test_pulled_bar_carries_uniaxial_stress(kind):
    mesh = box_mesh(3, 2, 2, 1.0, 0.3, 0.2, kind)
    inside = ((mesh.nodes > 1e-9) & (mesh.nodes < np.array([1.0, 0.3, 0.2]) - 1e-9)).all(axis=1)
    body = solid(Mesh(np.where(inside[:, None], distorted(mesh, 0.2).nodes, mesh.nodes), mesh.cells))
    x, y, z = body.nodes.T
    held = np.r_[3 * np.flatnonzero(x == 0), 3 * np.flatnonzero(y == 0) + 1, 3 * np.flatnonzero(z == 0) + 2]
    pulled = 3 * np.flatnonzero(np.isclose(x, 1.0))
    u = np.zeros(body.n_dof)
    u[pulled] = 1e-3
    free = np.setdiff1d(np.arange(body.n_dof), np.r_[held, pulled])
    u[free] = spsolve(body.K[free][:, free], -(body.K @ u)[free])
    stress = body.element_model.nodal_stress(u[:, None])[:, :, 0]
    sigma = STEEL.E * 1e-3
    assert_allclose(stress, np.tile([sigma, 0, 0, 0, 0, 0], (len(x), 1)), rtol=0, atol=1e-9 * sigma)
    assert_allclose((body.K @ u)[pulled].sum(), sigma * 0.3 * 0.2, rtol=1e-9)


@pytest.mark.parametrize("kind", QUADRATIC)
def test_pure_bending_stress_is_linear_to_the_nodes_of_quadratic_elements(kind):
    body = solid(box_mesh(3, 2, 2, 1.0, 0.3, 0.2, kind))
    x, y, z = (body.nodes - [0, 0.15, 0.1]).T
    nu, kappa = STEEL.nu, 1e-3
    u = kappa * np.stack([-x * y, (x**2 + nu * (y**2 - z**2)) / 2, nu * y * z], axis=1)  # sigma_xx = -E kappa y
    stress = body.element_model.nodal_stress(u.reshape(-1, 1))[:, :, 0]
    expected = np.zeros((len(x), 6))
    expected[:, 0] = -STEEL.E * kappa * y
    assert_allclose(stress, expected, rtol=0, atol=1e-9 * np.abs(expected).max())


def test_node_between_two_materials_shows_the_stiffer_one():
    soft, stiff = Material("soft", 1e9, 0.0, 1000.0), Material("stiff", 4e9, 0.0, 1000.0)
    body = solid(box_mesh(4, 1, 1), {"left half": soft, "right half": stiff})
    u = np.zeros((len(body.nodes), 3))
    u[:, 1] = 1e-3 * body.nodes[:, 1]
    stress = body.element_model.nodal_stress(u.reshape(-1, 1))[:, 1, 0]
    in_soft = body.nodes[:, 0] < 0.5
    assert_allclose(stress[in_soft], 1e6, rtol=1e-10)
    assert_allclose(stress[~in_soft], 4e6, rtol=1e-10)


def test_bars_of_two_materials_in_a_row_add_their_compliances():
    soft, stiff = Material("soft", 1e9, 0.0, 1000.0), Material("stiff", 4e9, 0.0, 1000.0)
    body = solid(box_mesh(4, 1, 1, 2.0, 0.5, 0.5, "tetra10"), {"left half": soft, "right half": stiff})
    x = body.nodes[:, 0]
    u = np.zeros((len(x), 3))
    u[:, 0] = np.where(x < 1, x / soft.E, 1 / soft.E + (x - 1) / stiff.E)  # stress 1
    force = (body.K @ u.ravel()).reshape(-1, 3)
    inner = (x > 0) & (x < 2)
    assert_allclose(force[inner], 0, rtol=0, atol=1e-11)
    assert_allclose(force[x == 2].sum(axis=0), [0.25, 0, 0], rtol=0, atol=1e-11)


# -------------------------------------------------------------------------------------------------------------- body


def test_body_says_where_it_came_from():
    mesh = box_mesh(4, 1, 1, kind="tetra10")
    end = Interface("left", "rigid", mesh.node_sets["left"], np.zeros(3))
    body = solid_body(mesh, {"left half": STEEL, "right half": ALUMINIUM}, name="rod", units=SI, interfaces=[end])
    assert body.name == "rod"
    assert body.interfaces == (end,)
    assert body.provenance["cells tetra10"] == "24"
    assert body.provenance["material steel"] == "E = 210000000000.0, nu = 0.3, rho = 7850.0, 12 cells"
    assert body.provenance["mesh"] == "box 4 x 1 x 1 tetra10"
    assert_array_equal(body.dofs[:5], [[0, 0], [0, 1], [0, 2], [1, 0], [1, 1]])


def test_surface_of_the_body_encloses_its_volume():
    body = bar(3, kind="tetra10", length=1.0, width=0.05, height=0.04)
    a, b, c = (body.nodes[body.surface[:, k]] for k in range(3))
    assert_allclose(np.sum(a * np.cross(b, c)) / 6, 1.0 * 0.05 * 0.04, rtol=1e-12)


def test_stress_of_a_field_of_another_size_is_refused():
    with pytest.raises(BodyError, match="expected columns over 36 dofs, got \\(5, 1\\)"):
        bar(2, kind="hexahedron").element_model.nodal_stress(np.zeros((5, 1)))
