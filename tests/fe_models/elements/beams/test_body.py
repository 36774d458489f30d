import dataclasses

import numpy as np
import pytest
import scipy.linalg as la
from numpy.testing import assert_allclose
from scipy.optimize import brentq
from scipy.spatial.transform import Rotation

import cms
import fe_models as fm
from cms.body.invariants import moments_from_gram
from cms.errors import BodyError
from cms.linear_algebra.solvers.eigen import eigenmodes
from fe_models.body.rigid_motion import rigid_motion_of_dofs
from fe_models.errors import BeamError, SectionError
from tests import bodies
from tests.fe_models.small_frames import RECTANGLE, SI, STEEL, space_frame, straight, supported_frequencies

ROUNDOFF = 1e-12


# rigid motion, mass and invariants


def test_rigid_motion_costs_nothing_and_makes_no_stress():
    body = space_frame()
    Psi_R = rigid_motion_of_dofs(body.nodes, body.dofs)
    assert_allclose(body.K @ Psi_R, 0, rtol=0, atol=ROUNDOFF * np.abs(body.K.data).max())
    assert_allclose(body.D @ Psi_R, 0, rtol=0, atol=ROUNDOFF * np.abs(body.D.data).max())
    assert np.linalg.eigvalsh(body.K.toarray())[6] > 1e-6 * np.abs(body.K.data).max() * 1e-6
    stress = body.element_model.nodal_stress(body.mesh_displacement(Psi_R))
    assert np.abs(stress).max() <= ROUNDOFF * STEEL.E * 10


def test_skin_moves_rigidly_with_the_body():
    body = space_frame()
    moved = body.translations(rigid_motion_of_dofs(body.nodes, body.dofs))
    theta = np.array([0.3, -0.2, 0.5])
    expected = np.cross(theta, body.nodes)
    has_dofs = np.r_[np.arange(6), np.arange(6, len(body.nodes))]
    assert_allclose((moved[:, :, 3:] @ theta)[has_dofs], expected[has_dofs], rtol=0, atol=ROUNDOFF * 10)


def gram_of(body, u):
    return body.element_model.mass_gram(body.mesh_displacement(u))


def test_gram_has_the_kinetic_energy_of_the_mass_matrix():
    """Σ_a ∫ u_a,k u_a,l = u_kᵀ M u_l for any displacement, with and without rotary inertia."""
    body = space_frame()
    k = 5
    u = np.random.default_rng(1).normal(size=(body.n_dof, k))
    gram = gram_of(body, u)
    energy = sum(gram[4 + a * k : 4 + (a + 1) * k, 4 + a * k : 4 + (a + 1) * k] for a in range(3))
    expected = u.T @ (body.M @ u)
    assert_allclose(energy, expected, rtol=0, atol=ROUNDOFF * np.abs(expected).max())
    assert_allclose(gram, gram.T, rtol=0, atol=ROUNDOFF * np.abs(gram).max())


def test_rigid_moments_are_those_of_the_mass_matrix_on_rigid_motion():
    """Second road: m, first and second moments from Psi_Rᵀ M Psi_R."""
    body = space_frame()
    moments = moments_from_gram(gram_of(body, np.zeros((body.n_dof, 1))))
    Psi_R = rigid_motion_of_dofs(body.nodes, body.dofs)
    rigid = Psi_R.T @ (body.M @ Psi_R)
    assert_allclose(rigid[3:, 3:], moments.J0, rtol=0, atol=1e-11 * np.abs(moments.J0).max())
    assert_allclose(rigid[0, 0], moments.m, rtol=1e-12)
    assert_allclose([rigid[1, 5], rigid[2, 3], rigid[0, 4]], moments.S, rtol=0, atol=1e-11 * moments.m)


def test_moments_of_modes_are_those_of_the_mass_matrix():
    """1C and 2C by Psi_Rᵀ M Phi."""
    body = space_frame()
    u = np.random.default_rng(2).normal(size=(body.n_dof, 3))
    moments = moments_from_gram(gram_of(body, u))
    momentum = rigid_motion_of_dofs(body.nodes, body.dofs).T @ (body.M @ u)
    scale = np.abs(momentum).max()
    assert_allclose(moments.C1, momentum[:3], rtol=0, atol=1e-11 * scale)
    assert_allclose(moments.C2, momentum[3:], rtol=0, atol=1e-11 * scale)


def test_invariants_agree_with_point_masses_over_the_cross_section():
    """Second road: the rod cut into point masses on a grid in x and over the rectangle, moved as rigid sections."""
    b, h, L, n = 0.2, 0.3, 0.7, 2
    body = straight(n, fm.beams.Rectangle(b, h), L)
    rng = np.random.default_rng(3)
    u = rng.normal(size=(body.n_dof, 2))
    xi, w = np.polynomial.legendre.leggauss(8)
    total = np.zeros((10, 10))
    section = fm.beams.Rectangle(b, h).properties(STEEL.nu)
    Phi_y = 12 * STEEL.E * section.Iz / (STEEL.mu * section.A_sy * (L / n) ** 2)
    Phi_z = 12 * STEEL.E * section.Iy / (STEEL.mu * section.A_sz * (L / n) ** 2)
    from fe_models.elements.beams.element import interpolation

    for element in range(n):
        nodal = u[6 * element : 6 * element + 12]
        for s, w_s in zip((xi + 1) / 2, w / 2, strict=True):
            N = interpolation(np.array([s]), *(np.array([p]) for p in (Phi_y, Phi_z, L / n)), np.zeros((1, 2)))[0, 0]
            motion = N @ nodal
            for y, w_y in zip(b / 2 * xi, w / 2, strict=True):
                for z, w_z in zip(h / 2 * xi, w / 2, strict=True):
                    mass = STEEL.rho * b * h * L / n * w_s * w_y * w_z
                    c = np.array([(element + s) * L / n, y, z])
                    phi = motion[:3] + np.cross(motion[3:].T, [0, y, z]).T
                    a = np.concatenate([[1.0], c, phi.ravel()])
                    total += mass * np.outer(a, a)
    assert_allclose(gram_of(body, u), total, rtol=0, atol=1e-12 * np.abs(total).max())


def test_uniform_rod_has_its_closed_form_inertia():
    b, h, L = 0.2, 0.3, 2.0
    body = straight(1, fm.beams.Rectangle(b, h), L)
    moments = moments_from_gram(gram_of(body, np.zeros((body.n_dof, 1))))
    m = STEEL.rho * b * h * L
    assert_allclose(moments.m, m, rtol=1e-12)
    assert_allclose(moments.S, [m * L / 2, 0, 0], rtol=0, atol=1e-12 * m * L)
    J = [m * (b**2 + h**2) / 12, m * (L**2 / 3 + h**2 / 12), m * (L**2 / 3 + b**2 / 12)]
    assert_allclose(moments.J0, np.diag(J), rtol=0, atol=1e-12 * m * L**2)


def test_a_turned_and_moved_frame_is_the_same_body():
    mesh = fm.beams.LineMesh([(0, 0, 0), (1, 0, 0), (1, 0.4, 0.7)], [(0, 1), (1, 2)])
    R, d = Rotation.from_rotvec([0.4, -0.8, 0.5]).as_matrix(), np.array([3.0, -2.0, 1.0])
    v = np.array([(0.1, 1.0, 0.2), (0.3, 0.2, 1.0)])
    item = fm.beams.BeamProperty(fm.beams.ISection(0.1, 0.2, 0.006, 0.01), STEEL, offset=(0.02, 0.05))
    still = fm.beam_body(dataclasses.replace(mesh, orientations=v), item, name="a", units=SI)
    turned_mesh = fm.beams.LineMesh(mesh.nodes @ R.T + d, mesh.lines, orientations=v @ R.T)
    turned = fm.beam_body(turned_mesh, item, name="b", units=SI)
    Q = np.kron(np.eye(6), R)  # nodal dofs of the turned body
    for still_matrix, turned_matrix in ((still.K, turned.K), (still.M, turned.M)):
        expected = Q @ still_matrix.toarray() @ Q.T
        assert_allclose(turned_matrix.toarray(), expected, rtol=0, atol=ROUNDOFF * 10 * np.abs(expected).max())
    assert_allclose(turned.nodes, still.nodes @ R.T + d, rtol=0, atol=ROUNDOFF * 10)


# frequencies


def test_slender_beam_has_the_textbook_matrices_of_euler_and_bernoulli():
    """Second road: the cubic beam of the tests' own bodies, assembled densely."""
    E, G, A, Iy, Iz, J, rho = 2.1e11, 8.1e10, 1e-4, 1e-9, 2e-9, 3e-9, 7850.0
    material = fm.Material("steel", E=E, nu=E / (2 * G) - 1, rho=rho)
    body = straight(8, fm.beams.GeneralSection(A, Iy, Iz, J), material=material, shear=False, rotary_inertia=False)
    other = bodies.beam(8, E=E, G=G, A=A, Iy=Iy, Iz=Iz, J=J, rho=rho)
    assert_allclose(body.K.toarray(), other.K.toarray(), rtol=0, atol=ROUNDOFF * np.abs(other.K.data).max())
    assert_allclose(body.M.toarray(), other.M.toarray(), rtol=0, atol=ROUNDOFF * np.abs(other.M.data).max())


FREE_FREE = np.array([4.730040745, 7.853204624, 10.99560784])  # roots of cos x cosh x = 1
CLAMPED_FREE = np.array([1.875104069, 4.694091133, 7.854757438])  # roots of cos x cosh x = -1


def euler_bernoulli(roots, inertia, section, L=1.0):
    return roots**2 / (2 * np.pi * L**2) * np.sqrt(STEEL.E * inertia / (STEEL.rho * section.A))


def test_free_slender_beam_has_the_frequencies_of_euler_and_bernoulli():
    body = straight(16, shear=False, rotary_inertia=False)
    section = RECTANGLE.properties(0.3)
    expected = np.sort(
        np.concatenate(
            [euler_bernoulli(FREE_FREE, section.Iz, section), euler_bernoulli(FREE_FREE, section.Iy, section)]
        )
    )
    found = supported_frequencies(body, [], 12)
    assert_allclose(found[6:11], expected[:5], rtol=2e-4)
    assert found[5] < 1e-2 * found[6]


def order(error, counts):
    return -np.polyfit(np.log(counts), np.log(error), 1)[0]


def test_euler_bernoulli_frequencies_converge_with_the_fourth_power_of_the_length():
    counts = np.array([2, 3, 4, 6])
    section = RECTANGLE.properties(0.3)
    exact = euler_bernoulli(CLAMPED_FREE[0], section.Iz, section)
    found = [supported_frequencies(straight(n, shear=False, rotary_inertia=False), np.arange(6), 1)[0] for n in counts]
    error = np.array(found) / exact - 1
    assert (error > 0).all()
    assert abs(order(error, counts) - 4) < 0.15


def pinned_timoshenko(k, EI, GA_s, rho, A, inertia, L):
    """Lower root of EI b⁴ - w² (rho A + b² (rho I + rho A EI/GA_s)) + w⁴ rho I rho A/GA_s = 0, b = k pi/L [Hz]."""
    b = k * np.pi / L
    p, q = rho * A + b**2 * (rho * inertia + rho * A * EI / GA_s), rho * inertia * rho * A / GA_s
    return np.sqrt(2 * EI * b**4 / (p + np.sqrt(p**2 - 4 * q * EI * b**4))) / (2 * np.pi)


def test_timoshenko_frequencies_converge_from_above_with_the_second_power_of_the_length():
    """The static shapes leave out the shear deflection of the inertia load inside an element: h² in the frequency."""
    shape, L = fm.beams.Rectangle(0.2, 0.2), 1.0
    section = shape.properties(0.3)
    exact = [
        pinned_timoshenko(k, STEEL.E * section.Iz, STEEL.mu * section.A_sy, STEEL.rho, section.A, section.Iz, L)
        for k in (1, 2)
    ]
    counts = np.array([8, 12, 16, 24])
    found = np.array(
        [supported_frequencies(straight(n, shape, L), [0, 1, 2, 3, 6 * n + 1, 6 * n + 2], 5)[[0, 4]] for n in counts]
    )
    assert_allclose(found[-1], exact, rtol=5e-3)
    error = found[:, 0] / exact[0] - 1
    assert (error > 0).all()
    assert abs(order(error, counts) - 2) < 0.15


def clamped_free_timoshenko(EI, GA_s, rho, A, inertia, L, near):
    """Frequency of a cantilever by the determinant of its transfer matrix exp(L S(w)) over (v, theta, M, Q) [Hz]."""

    def determinant(w):
        S = np.array(
            [[0, 1, 0, 1 / GA_s], [0, 0, 1 / EI, 0], [0, -rho * inertia * w**2, 0, -1], [-rho * A * w**2, 0, 0, 0]]
        )
        T = la.expm(L * S)
        return np.linalg.det(T[2:, 2:])  # from (M, Q) at the clamp to M = Q = 0 at the tip

    w = 2 * np.pi * near
    return brentq(determinant, 0.97 * w, 1.03 * w) / (2 * np.pi)


def test_clamped_deep_beam_has_the_frequencies_of_timoshenko():
    shape, L, n = fm.beams.Rectangle(0.1, 0.15), 1.0, 40
    section = shape.properties(0.3)
    found = supported_frequencies(straight(n, shape, L), np.arange(6), 2)
    for frequency, inertia, area in ((found[0], section.Iz, section.A_sy), (found[1], section.Iy, section.A_sz)):
        exact = clamped_free_timoshenko(STEEL.E * inertia, STEEL.mu * area, STEEL.rho, section.A, inertia, L, frequency)
        assert_allclose(frequency, exact, rtol=2e-4)
        assert frequency > exact


def test_nafems_deep_simply_supported_beam():
    """NAFEMS FV5 (The Standard NAFEMS Benchmarks, 1989): closed forms, and what the exact beam element gives with five.

    Values as listed at caesarsystems.co.uk/NAFEMS_benchmarks/fv5.html: flexural, flexural, torsional, extensional, …
    """
    closed = np.array([42.650, 42.650, 71.20, 125.00, 148.15, 148.15, 213.61, 283.47, 283.47])
    five_elements = np.array([42.710, 42.710, 71.495, 125.51, 150.76, 150.76, 221.57, 301.08, 301.08])
    material = fm.Material("steel", E=200e9, nu=0.3, rho=8000.0)
    for n, expected, rtol in ((5, five_elements, 1e-4), (40, closed, 1.5e-3)):
        body = straight(n, fm.beams.Rectangle(2.0, 2.0), 10.0, material=material)
        found = supported_frequencies(body, [0, 1, 2, 3, 6 * n + 1, 6 * n + 2], 9)
        assert_allclose(found, expected, rtol=rtol)


def test_nafems_cantilever_with_masses_beside_its_axis():
    """NAFEMS FV4: closed form of a slender beam, 10 m long, 0.5 m thick, masses 2 m to both sides of the tip."""
    closed = np.array([1.723, 1.727, 7.413, 9.972, 18.155, 26.957])
    material = fm.Material("steel", E=200e9, nu=0.3, rho=8000.0)
    n = 10
    masses = [fm.beams.PointMass(n, 10000.0, offset=(0, 2, 0)), fm.beams.PointMass(n, 1000.0, offset=(0, -2, 0))]
    body = straight(n, fm.beams.Circle(0.25), 10.0, material=material, point_masses=masses, shear=False)
    assert_allclose(supported_frequencies(body, np.arange(6), 6), closed, rtol=1.5e-3)


def test_beam_and_solid_bar_have_the_same_first_frequencies():
    """A slender solid bar of quadratic bricks lies within 1 % of the beam in bending, torsion apart by warping."""
    length, width, height = 1.0, 0.05, 0.07
    solid = bodies.bar(16, 2, 2, length, width, height, material=STEEL)
    beam = straight(20, fm.beams.Rectangle(width, height), length)
    of_solid = np.sqrt(eigenmodes(solid.K, solid.M, n_modes=14).omega2[6:]) / (2 * np.pi)
    of_beam = supported_frequencies(beam, [], 14)[6:]
    assert_allclose(of_beam[:6], of_solid[:6], rtol=1e-2)


# statics and stress


def static_solution(body, fixed, dof, force):
    free = np.setdiff1d(np.arange(body.n_dof), fixed)
    f = np.zeros(body.n_dof)
    f[dof] = force
    u = np.zeros((body.n_dof, 1))
    u[free, 0] = np.linalg.solve(body.K.toarray()[np.ix_(free, free)], f[free])
    return u


@pytest.mark.parametrize(
    ("shape", "y", "z"),
    [
        (fm.beams.Rectangle(0.02, 0.03), 0.01, 0.015),
        (fm.beams.Tube(0.02, 0.003), 0.02, 0.02),
        (fm.beams.ISection(0.05, 0.08, 0.003, 0.004), 0.025, 0.04),
    ],
)
def test_cantilever_shows_the_stress_of_its_section_forces_at_the_skin(shape, y, z):
    body = straight(3, shape)
    section = shape.properties(0.3)
    at_clamp = np.abs(body.nodes[:, 0]) < 1e-12
    for dof, expected in ((19, y / section.Iz), (20, z / section.Iy), (18, 1 / section.A)):
        u = static_solution(body, np.arange(6), dof, 1.0)
        stress = body.element_model.nodal_stress(body.mesh_displacement(u))[:, :, 0]
        assert_allclose(stress[at_clamp, 0].max(), expected, rtol=1e-9)
    u = static_solution(body, np.arange(6), 20, 1.0)  # force along +z: the upper fibre is in compression at the clamp
    stress = body.element_model.nodal_stress(body.mesh_displacement(u))[:, :, 0]
    top = at_clamp & (np.abs(body.nodes[:, 2] - z) < 1e-9)
    assert (stress[top, 0] < 0).all()


def test_torsion_of_a_tube_is_pure_shear_along_its_wall():
    radius = 0.02
    shape = fm.beams.Tube(radius, 0.003)
    body = straight(2, shape)
    u = static_solution(body, np.arange(6), 15, 1.0)
    stress = body.element_model.nodal_stress(body.mesh_displacement(u))[:, :, 0]
    outer = np.abs(np.hypot(body.nodes[:, 1], body.nodes[:, 2]) - radius) < 1e-9
    y, z = body.nodes[outer, 1], body.nodes[outer, 2]
    J = shape.properties(0.3).J
    assert_allclose(stress[outer, 5], -z / J, rtol=0, atol=1e-9 * radius / J)  # xy
    assert_allclose(stress[outer, 4], y / J, rtol=0, atol=1e-9 * radius / J)  # xz
    assert_allclose(stress[outer, :4], 0, rtol=0, atol=1e-9 * radius / J)


def test_section_points_show_each_end_of_a_line_by_itself():
    """A force in the middle: the shear stress jumps there, and the mean of both is what the skin shows."""
    body = fm.beams.section_points(straight(2), [0, 1])
    u = static_solution(body, np.r_[0:6, 12:18], 7, 1.0)
    stress = body.stress_points.stress(body.mesh_displacement(u))[:, :, 0].reshape(2, 2, 8, 6)
    V = 0.5 / RECTANGLE.properties(0.3).A * 1.5
    assert_allclose(stress[0, 1, 3, 5], V, rtol=1e-9)  # point 3 is the middle of the upper side
    assert_allclose(stress[1, 0, 3, 5], -V, rtol=1e-9)
    assert body.stress_points.names[8 + 3] == "line 0 end point 3"
    assert_allclose(body.stress_points.positions[8 + 3], [0.5, 0, 0.015], rtol=0, atol=1e-15)
    with pytest.raises(BeamError, match=r"expected lines 0\.\.1"):
        fm.beams.section_points(body, [2])
    with pytest.raises(BeamError, match="is not a frame"):
        fm.beams.section_points(bodies.bar(1, 1, 1), [0])


def test_stress_turns_with_the_frame():
    R = Rotation.from_rotvec([0.3, 0.9, -0.4]).as_matrix()
    item = fm.beams.BeamProperty(RECTANGLE, STEEL, orientation=tuple(R[:, 1]))
    along = fm.beams.straight_line((0, 0, 0), R[:, 0], 2)
    turned = fm.beam_body(along, item, name="b", units=SI)
    still = straight(2)
    u = static_solution(still, np.arange(6), 13, 1.0)
    Q = np.kron(np.eye(6 // 2), np.kron(np.eye(2), R))
    of_still = still.element_model.nodal_stress(still.mesh_displacement(u))[:, :, 0]
    of_turned = turned.element_model.nodal_stress(turned.mesh_displacement(Q @ u))[:, :, 0]
    tensor = [[0, 5, 4], [5, 1, 3], [4, 3, 2]]
    expected = np.einsum("ab,nbc,dc->nad", R, of_still[:, tensor], R)
    assert_allclose(of_turned[:, tensor], expected, rtol=0, atol=1e-9 * np.abs(of_still).max())


def test_portal_frame_sways_as_the_slope_deflection_method_says():
    """Clamped portal, force P at the top corner, k = (I_beam / L) (h / I_column), axial and shear deformation left out.

    Sway P h³ (3 k + 2) / (12 E I_c (6 k + 1)); moment at the foot P h (3 k + 1) / (2 (6 k + 1)).
    """
    h, width, P = 3.0, 4.0, 1.0
    I_c, I_b, big = 2e-5, 5e-5, 1e4
    nodes = [(0, 0, 0), (0, 0, h), (width, 0, h), (width, 0, 0)]
    mesh = fm.beams.LineMesh(nodes, [(0, 1), (1, 2), (2, 3)], line_sets={"column": [0, 2], "beam": [1]})
    made = {
        name: fm.beams.BeamProperty(fm.beams.GeneralSection(big, inertia, inertia, inertia), STEEL)
        for name, inertia in (("column", I_c), ("beam", I_b))
    }
    body = fm.beam_body(mesh, made, name="portal", units=SI)
    fixed = np.r_[0:6, 18:24]
    u = static_solution(body, fixed, 6, P)
    k = (I_b / width) * (h / I_c)
    assert_allclose(u[6, 0], P * h**3 * (3 * k + 2) / (12 * STEEL.E * I_c * (6 * k + 1)), rtol=1e-6)
    reaction = body.K @ u
    foot = P * h * (3 * k + 1) / (2 * (6 * k + 1))
    assert_allclose(np.abs(reaction[[4, 22], 0]), foot, rtol=1e-6)


# axes, offsets, attachments


def test_height_stands_upright_by_default():
    """Without orientation z points up, so a slender upright rectangle is stiff against its weight."""
    body = straight(1, fm.beams.Rectangle(0.01, 0.1))
    u_y, u_z = (static_solution(body, np.arange(6), dof, 1.0)[dof, 0] for dof in (7, 8))
    assert u_y > 50 * u_z


def test_offset_line_is_the_line_at_its_place_with_rigid_arms():
    """A line on nodes beside it equals the line on its own nodes, which follow the others."""
    arm = np.array([0.0, 0.1, -0.2])
    mesh = fm.beams.straight_line((0, 0, 0), (1, 0, 0), 3)
    item = fm.beams.BeamProperty(RECTANGLE, STEEL)
    offset = fm.beams.LineMesh(mesh.nodes, mesh.lines, offsets=np.tile(arm, (3, 2, 1)))
    one = fm.beam_body(offset, item, name="one", units=SI)
    both = fm.beams.LineMesh(np.vstack([mesh.nodes, mesh.nodes + arm]), mesh.lines + 4)
    links = [fm.beams.RigidLink(k, (k + 4,)) for k in range(4)]
    other = fm.beam_body(both, item, name="other", units=SI, links=links)
    section_offset = fm.beams.BeamProperty(RECTANGLE, STEEL, offset=(0.1, -0.2))
    third = fm.beam_body(mesh, section_offset, name="third", units=SI)
    for body in (other, third):
        assert_allclose(body.K.toarray(), one.K.toarray(), rtol=0, atol=ROUNDOFF * np.abs(one.K.data).max())
        assert_allclose(body.M.toarray(), one.M.toarray(), rtol=0, atol=ROUNDOFF * np.abs(one.M.data).max())


def test_a_point_mass_has_the_inertia_it_was_given():
    """Parallel axes: about the node J + m (d² 1 - d dᵀ)."""
    J = np.array([[3.0, 0.2, 0.1], [0.2, 2.0, -0.3], [0.1, -0.3, 4.0]])
    d = np.array([0.3, -0.2, 0.5])
    mesh = fm.beams.LineMesh([(0, 0, 0), (1, 0, 0)], np.zeros((0, 2), int))
    spring = fm.beams.Spring((0, 1), np.ones(6))
    masses = [fm.beams.PointMass(0, 2.0, J, d), fm.beams.PointMass(1, 1.0, 1.0)]
    M = fm.beam_body(mesh, {}, name="mass", units=SI, point_masses=masses, springs=[spring]).M.toarray()[:6, :6]
    skew = np.array([[0, -d[2], d[1]], [d[2], 0, -d[0]], [-d[1], d[0], 0]])
    expected = np.block([[2 * np.eye(3), -2 * skew], [2 * skew, J - 2 * skew @ skew]])
    assert_allclose(M, expected, rtol=0, atol=1e-13)


def test_both_shear_areas_act_in_their_own_plane():
    shape = fm.beams.ISection(0.1, 0.2, 0.006, 0.01)
    section = shape.properties(0.3)
    body = straight(1, shape, 0.5)
    for dof, inertia, area in ((7, section.Iz, section.A_sy), (8, section.Iy, section.A_sz)):
        u = static_solution(body, np.arange(6), dof, 1.0)[dof, 0]
        assert_allclose(u, 0.5**3 / (3 * STEEL.E * inertia) + 0.5 / (STEEL.mu * area), rtol=1e-9)


@dataclasses.dataclass(frozen=True, eq=False)
class Eccentric:
    """A tube whose shear centre is said to lie elsewhere."""

    def properties(self, nu):
        return dataclasses.replace(fm.beams.Tube(0.02, 0.003).properties(nu), shear_center=(0.03, -0.01))


def test_torsion_stress_is_that_about_the_shear_center():
    body = straight(2, Eccentric())
    f = np.zeros((body.n_dof, 1))
    f[13], f[15] = 1.0, 0.01  # a unit force along y at (y, z) = (0.03, -0.01) does not twist: M = -z F
    free = np.arange(6, body.n_dof)
    u = np.zeros((body.n_dof, 1))
    u[free] = np.linalg.solve(body.K.toarray()[np.ix_(free, free)], f[free])
    stress = body.element_model.nodal_stress(body.mesh_displacement(u))[:, :, 0]
    y, z = body.nodes[:, 1], body.nodes[:, 2]
    twist = (y * stress[:, 4] - z * stress[:, 5])[np.hypot(y, z) > 0.019]  # shear of V alone is odd over the ring
    assert abs(twist.sum()) < 1e-9 * np.abs(twist).max()


def test_links_of_links_follow_the_first_leader():
    nodes = [(0, 0, 0), (1, 0, 0), (1, 1, 0), (1, 1, 1)]
    mesh = fm.beams.LineMesh(nodes, [(0, 1)])
    masses = [fm.beams.PointMass(3, 2.0, 0.3)]
    item = fm.beams.BeamProperty(RECTANGLE, STEEL)
    chain = [fm.beams.RigidLink(1, (2,)), fm.beams.RigidLink(2, (3,))]
    body = fm.beam_body(mesh, item, name="chain", units=SI, point_masses=masses, links=chain)
    direct = [fm.beams.PointMass(1, 2.0, 0.3, offset=(0, 1, 1))]
    short = fm.beam_body(fm.beams.LineMesh(nodes[:2], [(0, 1)]), item, name="short", units=SI, point_masses=direct)
    assert_allclose(body.M.toarray(), short.M.toarray(), rtol=0, atol=ROUNDOFF * np.abs(short.M.data).max())
    moved = body.translations(np.eye(body.n_dof)[:, 6:])[3]
    assert_allclose(moved[:, 3], [0, -1, 1], rtol=0, atol=0)  # e_x × (0, 1, 1)


def test_two_masses_on_a_spring_swing_at_their_frequency():
    """omega² = k (1/m1 + 1/m2); a body without any line."""
    mesh = fm.beams.LineMesh([(0, 0, 0), (1, 0, 0)], np.zeros((0, 2), int))
    masses = [fm.beams.PointMass(0, 2.0, 0.1), fm.beams.PointMass(1, 3.0, 0.1)]
    spring = fm.beams.Spring((0, 1), [1000.0, 0, 0, 0, 0, 0])
    body = fm.beam_body(mesh, {}, name="two masses", units=SI, point_masses=masses, springs=[spring])
    found = supported_frequencies(body, [], 12)[-1]
    assert_allclose(found, np.sqrt(1000 * (1 / 2 + 1 / 3)) / (2 * np.pi), rtol=1e-12)


def test_a_straight_beam_has_a_buckens_frame():
    """Its skin carries the volume, so the nodes with weight are not on one line."""
    body = cms.couple(straight(6, interfaces=("start", "end")))
    assert_allclose(body.node_volumes.sum(), RECTANGLE.properties(0.3).A, rtol=1e-12)
    assert_allclose(body.node_volumes @ body.nodes / body.node_volumes.sum(), [0.5, 0, 0], rtol=0, atol=1e-12)
    reduced = cms.reduce(body, cms.craig_bampton(body, n_modes=4), frame=cms.reduction.BuckensFrame())
    tisserand = cms.reduce(body, cms.craig_bampton(body, n_modes=4))
    assert_allclose(reduced.free_frequencies, tisserand.free_frequencies, rtol=1e-8)


def test_skin_is_closed_and_points_outward():
    """Every edge belongs to two triangles, and the enclosed volume is A L."""
    for shape in (
        fm.beams.Rectangle(0.02, 0.03),
        fm.beams.BoxSection(0.05, 0.08, 0.004, 0.006),
        fm.beams.ISection(0.1, 0.2, 0.006, 0.01),
    ):
        body = straight(3, shape)
        edges = np.concatenate([body.surface[:, [0, 1]], body.surface[:, [1, 2]], body.surface[:, [2, 0]]])
        forward = {tuple(edge) for edge in edges.tolist()}
        assert len(forward) == len(edges)
        assert forward == {(b, a) for a, b in forward}
        corners = body.nodes[body.surface]
        volume = np.einsum("ta,ta->", corners[:, 0], np.cross(corners[:, 1], corners[:, 2])) / 6
        assert_allclose(volume, shape.properties(0.3).A, rtol=1e-9)


# bad input


def corner(**options):
    return fm.beams.LineMesh([(0, 0, 0), (1, 0, 0), (1, 1, 0)], [(0, 1), (1, 2)], **options)


BAD = [
    (lambda: fm.beams.LineMesh([(0, 0, 0)], [(0, 1)]), BeamError, "lines: expected 0..0, got 0..1"),
    (lambda: fm.beams.LineMesh([(0, 0, np.nan)], []), BeamError, "finite coordinates"),
    (lambda: made(fm.beams.LineMesh([(0, 0, 0), (0, 0, 0)], [(0, 1)])), BeamError, "1 lines have no length"),
    (lambda: made(corner(orientations=[(1, 0, 0), (0, 0, 1)])), BeamError, "along the line"),
    (
        lambda: made(fm.beams.LineMesh([(0, 0, 0), (1, 0, 0), (2, 0, 0)], [(0, 1)])),
        BeamError,
        "1 nodes belong to no line",
    ),
    (
        lambda: made(corner(), links=[fm.beams.RigidLink(0, (2,)), fm.beams.RigidLink(1, (2,))]),
        BeamError,
        "follows two nodes",
    ),
    (
        lambda: made(corner(), links=[fm.beams.RigidLink(0, (2,)), fm.beams.RigidLink(2, (0,))]),
        BeamError,
        "follows itself",
    ),
    (lambda: fm.beams.RigidLink(1, (1,)), BeamError, "other nodes that follow"),
    (lambda: made(corner(), point_masses=[fm.beams.PointMass(7, 1.0)]), BeamError, "node 7 does not exist"),
    (lambda: fm.beams.PointMass(0, -1.0), BeamError, "a mass of zero or more"),
    (lambda: fm.beams.PointMass(0, 1.0, -np.eye(3)), BeamError, "without negative principal values"),
    (lambda: fm.beams.Spring((1, 1), np.ones(6)), BeamError, "expected two nodes"),
    (lambda: fm.beams.Spring((0, 1), -np.ones(6)), BeamError, "without negative eigenvalues"),
    (lambda: fm.beams.Spring((0, 1), np.ones(5)), BeamError, "six numbers"),
    (
        lambda: fm.beam_body(corner(line_sets={"leg": [0]}), {"leg": item()}, name="b", units=SI),
        SectionError,
        "1 lines have none",
    ),
    (
        lambda: fm.beam_body(corner(line_sets={"leg": [0]}), {"lag": item()}, name="b", units=SI),
        SectionError,
        "did you mean 'leg'",
    ),
    (
        lambda: fm.beam_body(corner(line_sets={"a": [0, 1], "b": [1]}), {"a": item(), "b": item()}, name="b", units=SI),
        SectionError,
        "1 lines of group 'b' have two",
    ),
    (
        lambda: fm.beams.BeamProperty(RECTANGLE, STEEL, offset=(1.0, np.nan)),
        SectionError,
        "offset: expected 2 finite numbers",
    ),
]


def item():
    return fm.beams.BeamProperty(RECTANGLE, STEEL)


def made(mesh, **attached):
    return fm.beam_body(mesh, item(), name="b", units=SI, **attached)


@pytest.mark.parametrize(("make", "error", "words"), BAD, ids=[words for _, _, words in BAD])
def test_bad_input_is_refused_with_one_message(make, error, words):
    with pytest.raises(error, match=words):
        make()


def test_an_interface_cannot_take_a_node_that_follows():
    mesh = corner()
    end = fm.beams.line_interface(mesh, "end", fm.beams.NodeIndices((2,)))
    body = made(mesh, interfaces=[end], links=[fm.beams.RigidLink(1, (2,))])
    with pytest.raises(BodyError, match="follow a rigid link"):
        cms.couple(body)
