"""Geometric stiffness of elements: it meets rigid rotations and the third derivative of the exact strain energy."""

from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy.spatial.transform import Rotation

from fe_models.body.rigid_motion import MassLoads, rotation_work
from fe_models.elements.beams.attachments import PointMass, Spring
from fe_models.elements.beams.beam_property import BeamProperty
from fe_models.elements.beams.body import beam_body
from fe_models.elements.beams.sections import Circle, Rectangle
from fe_models.elements.solids.body import solid_body
from fe_models.elements.solids.elements import INTEGRATIONS, quadrature, reference_element, shape_table
from fe_models.foundation.units import unit_system
from fe_models.meshes.line_mesh import LineMesh
from fe_models.meshes.mesh import SOLID_TYPES
from fe_models.meshes.quadratic_mesh import quadratic_mesh
from tests.bodies import ALUMINIUM, STEEL, box_mesh, distorted

ROUNDOFF = 1e-12
SI = unit_system("m-kg-s")


def solid(kind, amount=0.0, integration="full"):
    mesh = box_mesh(2, 1, 1, 1.0, 0.7, 0.6, kind)
    if amount:
        mesh = distorted(mesh, amount)
    materials = {"left half": STEEL, "right half": ALUMINIUM}
    return solid_body(mesh, materials, name="block", units=SI, integration=integration)


@pytest.mark.parametrize("kind", SOLID_TYPES)
def test_solids_turn_their_internal_forces(kind):
    body = solid(kind)
    rng = np.random.default_rng(1)
    u, theta = rng.standard_normal((body.n_dof, 2)), rng.standard_normal(3)
    turned = np.cross(theta, body.nodes).ravel()
    model = body.element_model
    K = model.geometric_stiffness(u, MassLoads.none(2), np.column_stack([turned, np.eye(body.n_dof)[:, :9]]))
    f = (body.K @ u).reshape(-1, 3, 2)
    expected = np.cross(theta, f, axisb=1, axisc=1).reshape(body.n_dof, 2)
    assert_allclose(K[:, 1:, 0].T, expected[:9], rtol=0, atol=1e-11 * np.abs(expected).max())
    assert_allclose(K[:, 0, 0], turned @ expected, rtol=0, atol=1e-11 * np.abs(turned @ np.abs(expected)).max())


@pytest.mark.parametrize("kind", SOLID_TYPES)
@pytest.mark.parametrize("integration", INTEGRATIONS)
def test_curved_solids_turn_their_internal_forces(kind, integration):
    """All nodes are moved, middle ones too; the forces are K u, which other code assembles."""
    body = solid(kind, 0.15, integration)
    rng = np.random.default_rng(1)
    u, theta = rng.standard_normal((body.n_dof, 1)), rng.standard_normal(3)
    turned = np.cross(theta, body.nodes).reshape(-1, 1)
    model = body.element_model
    nodes = np.array([0, 5])
    K = model.geometric_stiffness(u, MassLoads.none(1), np.column_stack([turned, np.eye(body.n_dof)]))[0]
    f = model.internal_forces(u).reshape(-1, 3)
    expected = np.cross(theta, f).ravel()
    assert_allclose(K[1:, 0], expected, rtol=0, atol=ROUNDOFF * np.abs(K).max())
    part = model.internal_forces(u, nodes=nodes).reshape(-1, 3)
    assert_allclose(part[nodes], f[nodes], rtol=0, atol=ROUNDOFF * np.abs(f).max())
    assert_allclose(f.ravel(), (body.K @ u).ravel(), rtol=0, atol=ROUNDOFF * np.abs(body.K).max() * np.abs(u).max())
    assert not np.delete(part, nodes, axis=0).any()


@pytest.mark.parametrize("kind", ["tetra10", "hexahedron20", "wedge"])
def test_solids_have_the_third_derivative_of_the_energy_of_saint_venant_and_kirchhoff(kind):
    """D³U[u, v, w] = K(u)[v, w] + K(v)[w, u] + K(w)[u, v]; U = ∫ ½ lam (tr E)² + mu E:E, E of Green and Lagrange."""
    body = solid(kind, 0.05 if kind == "wedge" else 0.0)
    (cells,) = body.element_model.mesh.cells.values()
    (material,) = body.element_model.of_cell.values()
    cell, degree = {"tetra10": ("tet", 5), "hexahedron20": ("hex", 5), "wedge": ("wedge", (2, 3))}[kind]
    table = shape_table(kind, *quadrature(cell, degree))
    J = np.einsum("eai,paj->epij", body.nodes[cells], table.gradients)
    gradients = np.einsum("paj,epji->epai", table.gradients, np.linalg.inv(J))
    dV = np.linalg.det(J) * table.weights
    lam, mu = (np.array([getattr(m, key) for m in (STEEL, ALUMINIUM)])[material][:, None] for key in ("lam", "mu"))

    def energy(x):
        H = np.einsum("eai,epaj->epij", x.reshape(-1, 3)[cells], gradients)
        E = (H + H.swapaxes(2, 3) + H.swapaxes(2, 3) @ H) / 2
        return (dV * (lam / 2 * np.trace(E, axis1=2, axis2=3) ** 2 + mu * (E**2).sum(axis=(2, 3)))).sum()

    rng = np.random.default_rng(2)
    v, w = 0.01 * rng.standard_normal((2, body.n_dof))
    u = 0.01 * (body.nodes @ rng.standard_normal((3, 3))).ravel()  # so that the four points of tetra10 are exact
    third = polarized_cubic(energy, u, v, w)
    K = body.element_model.geometric_stiffness(
        np.column_stack([u, v, w]), MassLoads.none(3), np.column_stack([u, v, w])
    )
    expected = K[0, 1, 2] + K[1, 2, 0] + K[2, 0, 1]
    assert_allclose(third, expected, rtol=1e-9)


def polarized_cubic(energy, u, v, w):
    """Return D³U[u, v, w] of a polynomial of degree four: its odd part is the cubic one."""
    total = 0.0
    for a in (1, -1):
        for b in (1, -1):
            odd = [(energy(s * (u + a * v + b * w))) * s for s in (1, -1)]
            total += a * b * (odd[0] + odd[1]) / 2
    return total / 4


def frame(section=None, offsets=True, springs=True, masses=True):
    """Three beams round a corner in space with section offsets, eccentric ends, a spring and a point mass."""
    nodes = np.array([[0.0, 0, 0], [0.5, 0.1, 0], [0.9, 0.2, 0.4], [0.8, 0.7, 0.5], [0.2, 0.6, 0.9]])
    lines = np.array([[0, 1], [1, 2], [2, 3]])
    ends = np.zeros((3, 2, 3))
    if offsets:
        ends[1, 0], ends[2, 1] = (0.02, -0.03, 0.01), (-0.01, 0.02, 0.05)
    item = BeamProperty(
        section or Rectangle(0.05, 0.02), STEEL, offset=(0.01, -0.02) if offsets else (0.0, 0.0), added_mass=3.0
    )
    K = np.random.default_rng(3).standard_normal((6, 6))
    spring = Spring(
        (3, 4), 1e6 * K @ K.T, point=(0.1, 0.2, 0.3), triad=Rotation.from_rotvec([0.1, 0.5, -0.4]).as_matrix()
    )
    return beam_body(
        LineMesh(nodes, lines, offsets=ends),
        item,
        name="frame",
        units=SI,
        springs=[spring] if springs else [],
        point_masses=[PointMass(4, 2.0, (0.1, 0.2, 0.25), (0.05, -0.1, 0.2))] if masses else [],
    )


def loads_of(seed=5, k=1):
    rng = np.random.default_rng(seed)
    return MassLoads(1e3 * rng.standard_normal((k, 3, 3)), 1e3 * rng.standard_normal((k, 3)))


def test_frames_turn_their_forces():
    """K_geo of a rigid rotation is (theta × f, ½ theta × m) of the nodal forces, and the turned load (of the mass)."""
    body = frame()
    model = body.element_model
    rng = np.random.default_rng(1)
    u, theta = np.zeros((model.n_mesh_dof, 1)), rng.standard_normal(3)
    u[: 6 * 5] = rng.standard_normal((30, 1)) * 1e-3
    loads = loads_of()
    turned = np.zeros((model.n_mesh_dof, 1))
    turned[:30] = np.hstack([np.cross(theta, model.nodes), np.tile(theta, (5, 1))]).reshape(-1, 1)
    identity = np.eye(model.n_mesh_dof)[:, :30]
    K = model.geometric_stiffness(u, loads, np.hstack([turned, identity]))[0]
    f = (model.internal_forces(u) - model.mass_forces(loads))[:30].reshape(5, 6)
    expected = np.hstack([np.cross(theta, f[:, :3]), np.cross(theta, f[:, 3:]) / 2])
    # ∫ (theta × f)·u over mass: the load per mass theta × (A c + b)
    tilde = np.cross(theta, np.eye(3)).T
    expected = expected.ravel() + model.mass_forces(MassLoads(tilde @ loads.A, loads.b @ tilde.T))[:30, 0]
    assert_allclose(K[1:, 0], expected, rtol=0, atol=1e-11 * np.abs(K).max())


def test_internal_forces_of_a_frame_are_those_of_its_stiffness():
    body = frame()
    u = np.random.default_rng(1).standard_normal((body.element_model.n_mesh_dof, 2))
    forces = body.element_model.internal_forces(u)[:30]
    assert_allclose(forces, body.K @ u[:30], rtol=0, atol=ROUNDOFF * np.abs(body.K).max() * np.abs(u).max())


@pytest.mark.parametrize("body", ["solid", "frame"])
def test_mass_forces_are_the_mass_times_rigid_accelerations(body):
    body = solid("tetra10", 0.1) if body == "solid" else frame()
    from fe_models.body.rigid_motion import rigid_motion_of_dofs

    origin = np.array([0.1, -0.2, 0.3])
    loads = MassLoads.none(6).plus_rigid(np.eye(6), origin)
    forces = body.element_model.mass_forces(loads)[: body.n_dof]
    expected = body.M @ rigid_motion_of_dofs(body.nodes, body.dofs, origin)
    assert_allclose(forces, expected, rtol=0, atol=ROUNDOFF * np.abs(expected).max())


def test_mass_forces_of_frames_work_as_the_loads_on_the_mass():
    """∫ (A c + b)·u = Σ A_ab P_ba + b·1C with the moments of the elements."""
    body = frame()
    model, loads = body.element_model, loads_of()
    u = np.zeros((model.n_mesh_dof, 1))
    u[:30] = np.random.default_rng(1).standard_normal((30, 1))
    gram = model.mass_gram(u)
    expected = np.einsum("ab,ba->", loads.A[0], gram[1:4, 4:]) + loads.b[0] @ gram[0, 4:]
    assert_allclose((model.mass_forces(loads).T @ u).item(), expected, rtol=1e-12)


def exact_beam_energy(body, x):
    """Strain energy of the geometrically exact beam with the interpolation of the elements; its fibres lengthen."""
    model = body.element_model
    lines = model._lines
    section = model.sections[0]
    E, G = STEEL.E, STEEL.mu
    q = x.reshape(-1, 6)
    total = 0.0
    for e, dofs in enumerate(model.dofs):
        L, R0 = lines.length[e], model.geometry.R[e]
        nodes = dofs[::6] // 6
        ends = []
        for end, node in enumerate(nodes):
            lever, R = lines.levers[e, end], Rotation.from_rotvec(q[node, 3:]).as_matrix()
            ends.append(np.concatenate([q[node, :3] + R @ lever - lever, q[node, 3:]]))
        ends = np.concatenate(ends).reshape(-1, 3) @ R0  # local components of the ends of the axis
        xi, weights = np.polynomial.legendre.leggauss(7)
        Phi_y, Phi_z = 12 * E * section.Iz / (G * section.A_sy * L**2), 12 * E * section.Iy / (G * section.A_sz * L**2)
        from fe_models.elements.beams.element import interpolation

        def field(at, L=L, Phi_y=Phi_y, Phi_z=Phi_z, ends=ends):
            N = interpolation(np.atleast_1d(at), np.array([Phi_y]), np.array([Phi_z]), np.array([L]), np.zeros((1, 2)))
            return N[0, 0] @ ends.ravel()

        for point, weight in zip((xi + 1) / 2, weights / 2, strict=True):
            here, h = field(point), 1e-3
            slope = (8 * (field(point + h) - field(point - h)) - field(point + 2 * h) + field(point - 2 * h)) / (
                12 * h * L
            )
            R = Rotation.from_rotvec(here[3:]).as_matrix()
            axis = np.array([1.0, 0, 0])
            Gamma = R.T @ (axis + slope[:3]) - axis
            theta, rate = here[3:], slope[3:]
            t2 = theta @ theta  # kappa = T(theta) theta', series: theta is small here
            a, b = 0.5 - t2 / 24, 1 / 6 - t2 / 120
            kappa = rate - a * np.cross(theta, rate) + b * np.cross(theta, np.cross(theta, rate))
            stretch = Gamma[0] + section.J_polar / section.A * kappa[0] ** 2 / 2
            total += weight * L / 2 * (
                E * section.A * stretch**2 + G * section.A_sy * Gamma[1] ** 2 + G * section.A_sz * Gamma[2] ** 2
                + G * section.J * kappa[0] ** 2 + E * section.Iy * kappa[1] ** 2 + E * section.Iz * kappa[2] ** 2
            )  # fmt: skip
    for spring in model.springs:
        first, second = (model.nodes[n] for n in spring.nodes)
        R1, R2 = (Rotation.from_rotvec(q[n, 3:]) for n in spring.nodes)
        point = np.asarray(spring.point)
        d = [
            q[n, :3] + R.apply(point - c) - (point - c)
            for n, R, c in zip(spring.nodes, (R1, R2), (first, second), strict=True)
        ]
        relative = (R1.inv() * R2).as_rotvec()
        middle = R1 * Rotation.from_rotvec(relative / 2)
        extension = np.concatenate([middle.inv().apply(d[1] - d[0]), relative])
        extension = np.concatenate([spring.triad.T @ extension[:3], spring.triad.T @ extension[3:]])
        total += extension @ spring.stiffness @ extension / 2
    return total


@pytest.mark.parametrize("section", [Circle(0.04), Rectangle(0.05, 0.02)])
def test_frames_have_the_third_derivative_of_the_energy_of_the_exact_beam(section):
    body = frame(section, masses=False)
    model = body.element_model
    u, v, w = np.random.default_rng(2).standard_normal((3, 30)) * np.tile([1, 1, 1, 3, 3, 3], 5) * 0.1
    third = 0.0
    step = 1e-2
    for order, weight in ((1, 4 / 3), (2, -1 / 3)):  # the fifth derivative is taken out
        h = step * order
        third += weight * polarized_cubic(lambda x: exact_beam_energy(body, x), h * u, h * v, h * w) / h**3
    columns = np.zeros((model.n_mesh_dof, 3))
    columns[:30] = np.column_stack([u, v, w])
    K = model.geometric_stiffness(columns, MassLoads.none(3), columns)
    expected = K[0, 1, 2] + K[1, 2, 0] + K[2, 0, 1]
    assert_allclose(third, expected, rtol=1e-4)


def test_a_load_off_the_axis_works_on_the_second_order_of_the_rotation():
    rng = np.random.default_rng(1)
    f, o, theta = rng.standard_normal((3, 3))
    exact = [f @ (Rotation.from_rotvec(h * theta).apply(o) - o) for h in (1e-3, -1e-3)]
    assert_allclose(sum(exact) / 1e-6, theta @ rotation_work(np.outer(f, o)) @ theta, rtol=1e-6)


def test_a_point_mass_has_only_the_work_of_its_loads():
    body = frame(springs=False)
    model, loads = body.element_model, loads_of()
    theta = np.array([0.3, -0.2, 0.4])
    Phi = np.zeros((model.n_mesh_dof, 1))
    Phi[27:30, 0] = theta
    K = model.geometric_stiffness(np.zeros((model.n_mesh_dof, 1)), loads, Phi)[0, 0, 0]
    mass = body.element_model.pieces[-1]
    E, center, c = (
        np.trace(np.diag([0.1, 0.2, 0.25])) / 2 * np.eye(3) - np.diag([0.1, 0.2, 0.25]),
        mass.position[0, 0],
        model.nodes[4],
    )
    V = loads.A[0] @ E + 2.0 * np.outer(loads.A[0] @ center + loads.b[0], center - c)
    assert_allclose(K, -theta @ rotation_work(V) @ theta, rtol=1e-12)


def test_matrices_refuse_what_only_elements_know():
    body = solid("tetra")
    from cms.errors import BodyError
    from fe_models.files.matrices.given import body_from_matrices

    foreign = body_from_matrices(body.M, body.K, body.nodes, body.dofs, name="foreign", units=SI)
    assert not foreign.element_model.has_geometric_stiffness
    with pytest.raises(BodyError, match="build it from its mesh"):
        foreign.element_model.geometric_stiffness(np.zeros((body.n_dof, 1)), MassLoads.none(1), np.eye(body.n_dof))


def test_the_points_of_the_geometric_stiffness_fill_the_cells():
    from fe_models.elements.solids.geometric import integrated_cells

    for kind in SOLID_TYPES:
        mesh = distorted(box_mesh(2, 1, 1, 1.0, 0.7, 0.6, kind), 0.05)
        parts = integrated_cells(mesh, kind, {kind: np.zeros(len(mesh.cells[kind]), np.int64)})
        assert sum(len(part.cells) for part in parts) == len(mesh.cells[kind])
        for part in parts:
            assert_allclose(part.table.weights.sum(), reference_element(kind).mass.weights.sum(), rtol=1e-12)


def test_straight_quadratic_tetrahedra_take_the_points_of_their_stress():
    """Four points give them what fourteen do: corners moved, middle nodes in the middle, far from the origin."""
    from fe_models.elements.solids.geometric import bends_of_cells, integrated_cells

    corners = distorted(box_mesh(2, 1, 1, 1.0, 0.7, 0.6, "tetra"), 0.1, seed=3)
    mesh, _ = quadratic_mesh(replace(corners, nodes=corners.nodes + 1e3))
    assert bends_of_cells(mesh.nodes, mesh.cells["tetra10"]).max() < 1e-9
    (part,) = integrated_cells(mesh, "tetra10", {"tetra10": np.zeros(len(mesh.cells["tetra10"]), np.int64)})
    assert len(part.table.weights) == 4


@pytest.mark.parametrize("kind", SOLID_TYPES)
@pytest.mark.parametrize("incompatible", [False, True])
def test_many_columns_give_the_matrices_of_few(kind, incompatible, monkeypatch):
    """A sparse matrix for each state against products of gradients at every point; cells of two materials."""
    mesh = distorted(box_mesh(2, 1, 1, 1.0, 0.7, 0.6, kind), 0.05)
    materials = {"left half": STEEL, "right half": ALUMINIUM}
    model = solid_body(mesh, materials, name="block", units=SI, incompatible_modes=incompatible).element_model
    rng = np.random.default_rng(2)
    u, Phi = rng.standard_normal((3 * len(mesh.nodes), 3)), rng.standard_normal((3 * len(mesh.nodes), 7))
    few = model.geometric_stiffness(u, MassLoads.none(3), Phi)
    monkeypatch.setattr("fe_models.elements.solids.geometric.MANY_COLUMNS", 7)
    monkeypatch.setattr("fe_models.elements.solids.geometric.PRODUCT_BYTES", 1.0)  # 16 columns at a time
    many = model.geometric_stiffness(u, MassLoads.none(3), np.hstack([Phi, Phi, Phi]))
    assert_allclose(many[:, 7:14, 14:], few, rtol=0, atol=ROUNDOFF * np.abs(few).max())
    assert_allclose(many, many.transpose(0, 2, 1), rtol=0, atol=0)
