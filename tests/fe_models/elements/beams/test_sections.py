from itertools import pairwise

import numpy as np
import pytest
from numpy.testing import assert_allclose

import fe_models as fm
from fe_models.elements.beams.sections import box_shear_coefficient, i_shear_coefficient, triangulate_polygon
from fe_models.elements.beams.torsion import rectangle_torsion_constant, rectangle_torsion_stress
from fe_models.errors import SectionError

NU = 0.3
SHAPES = [
    fm.beams.Circle(0.03),
    fm.beams.Tube(0.03, 0.004),
    fm.beams.Rectangle(0.03, 0.05),
    fm.beams.BoxSection(0.05, 0.08, 0.004, 0.006),
    fm.beams.ISection(0.1, 0.2, 0.006, 0.01),
]
SECTION_IDS = [type(shape).__name__ for shape in SHAPES]


def polygon_moments(section):
    """A, Iy, Iz, Iyz by the formulas of a polygon, holes negative."""
    total = np.zeros(4)
    for number, loop in enumerate(section.loops):
        y, z = section.points[loop].T
        y1, z1 = np.roll(y, -1), np.roll(z, -1)
        cross = y * z1 - y1 * z
        parts = np.array(
            [
                cross.sum() / 2,
                (cross * (z**2 + z * z1 + z1**2)).sum() / 12,
                (cross * (y**2 + y * y1 + y1**2)).sum() / 12,
                (cross * (y * z1 + 2 * y * z + 2 * y1 * z1 + y1 * z)).sum() / 24,
            ]
        )
        total += parts if number == 0 else -parts
    return total


@pytest.mark.parametrize("shape", SHAPES, ids=SECTION_IDS)
def test_outline_has_the_area_and_second_moments_of_the_section(shape):
    section = shape.properties(NU)
    A, Iy, Iz, Iyz = polygon_moments(section)
    is_round = isinstance(shape, fm.beams.Circle | fm.beams.Tube)
    # a polygon of n corners in a circle: A falls by sinc(2 pi/n), I by sinc(2 pi/n) (2 + cos(2 pi/n)) / 3
    sinc, cos = np.sinc(2 / 16), np.cos(2 * np.pi / 16)
    area_share, inertia_share = (sinc, sinc * (2 + cos) / 3) if is_round else (1.0, 1.0)
    assert_allclose(
        [A, Iy, Iz], [section.A * area_share, section.Iy * inertia_share, section.Iz * inertia_share], rtol=1e-12
    )
    assert abs(Iyz) <= 1e-12 * section.Iy


@pytest.mark.parametrize("shape", SHAPES, ids=SECTION_IDS)
def test_cap_covers_the_section_once(shape):
    section = shape.properties(NU)
    a, b, c = (section.points[section.cap[:, k]] for k in range(3))
    areas = ((b - a)[:, 0] * (c - a)[:, 1] - (b - a)[:, 1] * (c - a)[:, 0]) / 2
    assert (areas >= -1e-15).all()
    assert_allclose(areas.sum(), polygon_moments(section)[0], rtol=1e-12)


@pytest.mark.parametrize("shape", SHAPES, ids=SECTION_IDS)
def test_normal_stress_of_the_outline_is_that_of_a_beam(shape):
    """A field of uniform tension and two curvatures at the vertices: sigma = N/A + My z/Iy - Mz y/Iz."""
    section = shape.properties(NU)
    N, My, Mz = 3.0, 5.0, 7.0
    y, z = section.points.T
    sigma = section.stress[:, 0] @ np.array([N, 0, 0, 0, My, Mz])
    assert_allclose(sigma, N / section.A + My * z / section.Iy - Mz * y / section.Iz, rtol=1e-12)


def stress_function(b, h, n):
    """Prandtl's stress function of a rectangle by finite differences: J, and -d psi/dy at the middle of y = b/2."""
    import scipy.sparse as sp
    from scipy.sparse.linalg import spsolve

    def second(length):
        step = length / n
        D = sp.diags_array([1.0, -2.0, 1.0], offsets=[-1, 0, 1], shape=(n - 1, n - 1)) / step**2
        return D, step

    D_y, dy = second(b)
    D_z, dz = second(h)
    eye = sp.eye_array(n - 1)
    psi = spsolve(sp.csc_array(sp.kron(D_y, eye) + sp.kron(eye, D_z)), np.full((n - 1) ** 2, -2.0)).reshape(
        n - 1, n - 1
    )
    last = psi[-3:, n // 2 - 1]
    slope = (3 * 0 - 4 * last[2] + last[1]) / (2 * dy)
    return 2 * psi.sum() * dy * dz, -slope


@pytest.mark.parametrize(("b", "h"), [(1.0, 1.0), (1.0, 2.5), (2.5, 1.0)])
def test_torsion_of_a_rectangle_agrees_with_a_solved_stress_function(b, h):
    n = 80
    J, slope = stress_function(b, h, n)
    assert_allclose(rectangle_torsion_constant(b, h), J, rtol=1e-3)
    assert_allclose(rectangle_torsion_stress(b, h), slope / J, rtol=3e-3)


def test_torsion_of_a_rectangle_has_the_tabulated_values():
    """Textbook table of torsion of rectangular bars: J = k1 (2a)³ (2b), tau_max = T/(k2 (2a)² 2b)."""
    for ratio, k1, k2 in ((1.0, 0.1406, 0.208), (2.0, 0.229, 0.246), (5.0, 0.291, 0.291), (10.0, 0.312, 0.312)):
        assert_allclose(rectangle_torsion_constant(1.0, ratio), k1 * ratio, rtol=4e-3)
        assert_allclose(rectangle_torsion_constant(ratio, 1.0), k1 * ratio, rtol=4e-3)
        assert_allclose(rectangle_torsion_stress(1.0, ratio), 1 / (k2 * ratio), rtol=4e-3)


def test_round_sections_twist_by_their_polar_moment():
    for shape, r_i in ((fm.beams.Circle(0.03), 0.0), (fm.beams.Tube(0.03, 0.004), 0.026)):
        section = shape.properties(NU)
        assert_allclose(section.J, np.pi / 2 * (0.03**4 - r_i**4), rtol=1e-12)
        tau = np.linalg.norm(section.stress[:16, 1:, 3], axis=1)
        assert_allclose(tau, 0.03 / section.J, rtol=1e-12)


def flow_energy_coefficient(web, flanges, inertia, area):
    """kappa = I² / (A Σ ∫ S² / t ds) of straight walls, S by integration from their free (or flow-less) ends."""
    energy = 0.0
    s = np.linspace(0, 1, 4001)
    for S, t, length in (web(s), *[flanges(s)] * 4):
        energy += np.trapezoid(S**2 / t, s) * length
    return inertia**2 / (area * energy)


def test_shear_coefficients_of_thin_walls_are_those_of_the_flow_energy_without_poisson():
    h, t_w, b, t_f = 0.2, 0.004, 0.1, 0.006  # a closed box has half of the flow in each web: the same integral
    area, inertia = h * t_w + 2 * b * t_f, h**3 * t_w / 12 + b * t_f * h**2 / 2

    def web(s):
        z = (s - 0.5) * h
        return b * t_f * h / 2 + t_w / 2 * (h**2 / 4 - z**2), t_w, h

    def half_flange(s):
        return t_f * h / 2 * s * b / 2, t_f, b / 2

    expected = flow_energy_coefficient(web, half_flange, inertia, area)
    assert_allclose(i_shear_coefficient(h, t_w, b, t_f, 0.0), expected, rtol=1e-6)
    assert_allclose(box_shear_coefficient(h, t_w, b, t_f, 0.0), expected, rtol=1e-6)


def test_shear_coefficients_have_their_closed_forms_and_limits():
    circle, rectangle = fm.beams.Circle(1.0).properties(NU), fm.beams.Rectangle(1.0, 2.0).properties(NU)
    assert_allclose(circle.A_sy / circle.A, 6 * 1.3 / (7 + 1.8), rtol=1e-12)
    assert_allclose(rectangle.A_sz / rectangle.A, 13 / 15.3, rtol=1e-12)
    nearly_solid = fm.beams.Tube(1.0, 1 - 1e-6).properties(NU)
    assert_allclose(nearly_solid.A_sy / nearly_solid.A, 6 * 1.3 / (7 + 1.8), rtol=1e-9)
    thin = fm.beams.Tube(1.0, 1e-6).properties(NU)
    assert_allclose(thin.A_sy / thin.A, 2 * 1.3 / (4 + 0.9), rtol=1e-5)
    no_flange = i_shear_coefficient(1.0, 0.1, 1e-9, 1e-9, NU)  # only the web is left: a rectangle
    assert_allclose(no_flange, 13 / 15.3, rtol=1e-6)


def test_general_section_draws_the_rectangle_of_its_moments():
    section = fm.beams.GeneralSection(A=0.002, Iy=0.002 * 0.05**2 / 12, Iz=0.002 * 0.04**2 / 12, J=1e-7).properties(NU)
    assert_allclose(np.ptp(section.points, axis=0), [0.04, 0.05], rtol=1e-12)
    assert np.isinf(section.A_sy)


def test_polygons_that_are_not_simple_are_refused():
    bow_tie = np.array([(0, 0), (1, 1), (1, 0), (0, 1.0)])
    with pytest.raises(SectionError, match="simple polygon"):
        triangulate_polygon(bow_tie)
    with pytest.raises(SectionError, match="anticlockwise"):
        fm.beams.GeneralSection(1.0, 1.0, 1.0, 1.0, outline=np.array([(0, 0), (0, 1), (1, 1), (1, 0.0)])).properties(NU)


@pytest.mark.parametrize(
    ("make", "words"),
    [
        (lambda: fm.beams.Circle(0.0), "radius: expected a length above zero"),
        (lambda: fm.beams.Circle(float("nan")), "radius: expected a length above zero"),
        (lambda: fm.beams.Tube(0.02, 0.02), "leaves no hole"),
        (lambda: fm.beams.BoxSection(0.05, 0.05, 0.03, 0.004), "leave no hole"),
        (lambda: fm.beams.ISection(0.05, 0.05, 0.004, 0.03), "fill the outline"),
        (lambda: fm.beams.GeneralSection(1.0, 1.0, 0.0, 1.0).properties(NU), "Iz above zero"),
        (lambda: fm.beams.GeneralSection(1.0, 1.0, 1.0, -1.0).properties(NU), "J: expected a number above zero"),
    ],
)
def test_impossible_sections_are_refused(make, words):
    with pytest.raises(SectionError, match=words):
        make()


def warping_torsion_constant(shape, n):
    """Second road: J = min over the warping w of ∫ (w_y - z)² + (w_z + y)², quadratic quads; from above."""
    import skfem
    from skfem.helpers import dot, grad

    b, h, web, flange = shape.width, shape.height, shape.web, shape.flange
    is_box = isinstance(shape, fm.beams.BoxSection)

    def cuts(*edges):
        parts = [np.linspace(lo, hi, n + 1) for lo, hi in pairwise(edges)]
        return np.unique(np.round(np.concatenate(parts), 12))

    if is_box:
        y, z = (
            cuts(-b / 2, -b / 2 + web, 0, b / 2 - web, b / 2),
            cuts(-h / 2, -h / 2 + flange, 0, h / 2 - flange, h / 2),
        )
    else:
        y, z = cuts(-b / 2, -web / 2, 0, web / 2, b / 2), cuts(-h / 2, -h / 2 + flange, 0, h / 2 - flange, h / 2)
    mesh = skfem.MeshQuad.init_tensor(y, z)
    middle = mesh.p[:, mesh.t].mean(axis=1)
    in_height = np.abs(middle[1]) < h / 2 - flange
    outside = in_height & ((np.abs(middle[0]) < b / 2 - web) if is_box else (np.abs(middle[0]) > web / 2))
    mesh = mesh.remove_elements(np.flatnonzero(outside))
    basis = skfem.Basis(mesh, skfem.ElementQuad2(), intorder=6)
    K = skfem.BilinearForm(lambda u, v, _: dot(grad(u), grad(v))).assemble(basis)
    f = skfem.LinearForm(lambda v, w: w.x[1] * grad(v)[0] - w.x[0] * grad(v)[1]).assemble(basis)
    warping = skfem.solve(*skfem.condense(K, f, D=np.array([0])))
    polar = skfem.Functional(lambda w: w.x[0] ** 2 + w.x[1] ** 2).assemble(basis)
    return polar - f @ warping


@pytest.mark.parametrize(
    ("shape", "bound"),
    [
        (fm.beams.BoxSection(0.05, 0.08, 0.004, 0.006), 0.035),
        (fm.beams.BoxSection(0.1, 0.1, 0.005, 0.005), 0.025),
        (fm.beams.ISection(0.1, 0.2, 0.0056, 0.0085), 0.07),
        (fm.beams.ISection(0.2, 0.2, 0.009, 0.015), 0.05),
    ],
)
def test_torsion_constants_of_walls_lie_within_a_few_percent_of_the_solved_warping(shape, bound):
    exact = warping_torsion_constant(shape, 6)
    assert abs(shape.properties(NU).J / exact - 1) < bound


@pytest.mark.parametrize("shape", SHAPES, ids=SECTION_IDS)
def test_shear_stress_turns_with_the_torque_and_points_along_the_force(shape):
    section = shape.properties(NU)
    y, z = section.points.T
    tau = section.stress[:, 1:]
    moment = y * tau[:, 1, 3] - z * tau[:, 0, 3]  # of a unit torque about x
    if isinstance(shape, fm.beams.ISection):  # the inner faces of the flanges run back
        moment = moment[np.abs(np.abs(z) - shape.height / 2) < 1e-12]
    assert (moment >= 0).all()
    assert (moment > 0).any()
    assert (tau[:, 0, 1] >= -1e-12 / section.A).all()
    assert (tau[:, 1, 2] >= -1e-12 / section.A).all()
    assert tau[:, 0, 1].max() > 1 / section.A  # more than the mean
    assert tau[:, 1, 2].max() > 1 / section.A


def test_a_box_turned_by_a_right_angle_has_its_stresses_exchanged():
    upright, lying = fm.beams.BoxSection(0.05, 0.08, 0.004, 0.006), fm.beams.BoxSection(0.08, 0.05, 0.006, 0.004)
    a, b = upright.properties(NU), lying.properties(NU)
    assert_allclose([a.A_sy, a.A_sz, a.Iy, a.J], [b.A_sz, b.A_sy, b.Iz, b.J], rtol=1e-12)
    side, top = 1, 3  # middles of the walls y = b/2 and z = h/2
    assert_allclose(a.stress[side, 2, 2], b.stress[top, 1, 1], rtol=1e-12)
    assert_allclose(a.stress[side, 2, 3], -b.stress[top, 1, 3], rtol=1e-12)
    flow = a.stress[side, 2, 3] * 0.004  # Bredt: torque = 2 A_m q
    assert_allclose(2 * 0.046 * 0.074 * flow, 1.0, rtol=1e-12)


def test_cowpers_coefficients_with_poisson_have_not_changed():
    """Alarm beside the check at nu = 0: m = 0.6, n = 0.5 in Cowper's formulas of I and box, by hand."""
    m, n2 = 0.6, 0.25
    web = (12 + 43.2 + 54 + 19.44) + 0.3 * (11 + 39.6 + 48.6 + 19.44)
    i = 13 * 2.8**2 / (web + 30 * n2 * (m + m**2) + 1.5 * n2 * (8 * m + 9 * m**2))
    box = 13 * 2.8**2 / (web + 10 * n2 * (3.3 * m + 3 * m**2))
    assert_allclose(i_shear_coefficient(0.2, 0.004, 0.1, 0.0024, 0.3), i, rtol=1e-12)
    assert_allclose(box_shear_coefficient(0.2, 0.004, 0.1, 0.0024, 0.3), box, rtol=1e-12)
