import numpy as np
import pytest
from numpy.testing import assert_allclose

import fe_models as fm
from fe_models.beams.outline import triangulate_polygon
from fe_models.beams.sections import box_shear_coefficient, i_shear_coefficient
from fe_models.beams.torsion import rectangle_torsion_constant, rectangle_torsion_stress
from fe_models.errors import SectionError

NU = 0.3
SHAPES = [
    fm.Circle(0.03),
    fm.Tube(0.03, 0.004),
    fm.Rectangle(0.03, 0.05),
    fm.BoxSection(0.05, 0.08, 0.004, 0.006),
    fm.ISection(0.1, 0.2, 0.006, 0.01),
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
    is_round = isinstance(shape, fm.Circle | fm.Tube)
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
    for shape, r_i in ((fm.Circle(0.03), 0.0), (fm.Tube(0.03, 0.004), 0.026)):
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
    circle, rectangle = fm.Circle(1.0).properties(NU), fm.Rectangle(1.0, 2.0).properties(NU)
    assert_allclose(circle.A_sy / circle.A, 6 * 1.3 / (7 + 1.8), rtol=1e-12)
    assert_allclose(rectangle.A_sz / rectangle.A, 13 / 15.3, rtol=1e-12)
    nearly_solid = fm.Tube(1.0, 1 - 1e-6).properties(NU)
    assert_allclose(nearly_solid.A_sy / nearly_solid.A, 6 * 1.3 / (7 + 1.8), rtol=1e-9)
    thin = fm.Tube(1.0, 1e-6).properties(NU)
    assert_allclose(thin.A_sy / thin.A, 2 * 1.3 / (4 + 0.9), rtol=1e-5)
    no_flange = i_shear_coefficient(1.0, 0.1, 1e-9, 1e-9, NU)  # only the web is left: a rectangle
    assert_allclose(no_flange, 13 / 15.3, rtol=1e-6)


def test_general_section_draws_the_rectangle_of_its_moments():
    section = fm.GeneralSection(A=0.002, Iy=0.002 * 0.05**2 / 12, Iz=0.002 * 0.04**2 / 12, J=1e-7).properties(NU)
    assert_allclose(np.ptp(section.points, axis=0), [0.04, 0.05], rtol=1e-12)
    assert np.isinf(section.A_sy)


def test_polygons_that_are_not_simple_are_refused():
    bow_tie = np.array([(0, 0), (1, 1), (1, 0), (0, 1.0)])
    with pytest.raises(SectionError, match="simple polygon"):
        triangulate_polygon(bow_tie)
    with pytest.raises(SectionError, match="anticlockwise"):
        fm.GeneralSection(1.0, 1.0, 1.0, 1.0, outline=np.array([(0, 0), (0, 1), (1, 1), (1, 0.0)])).properties(NU)


@pytest.mark.parametrize(
    ("make", "words"),
    [
        (lambda: fm.Circle(0.0), "radius: expected a length above zero"),
        (lambda: fm.Circle(float("nan")), "radius: expected a length above zero"),
        (lambda: fm.Tube(0.02, 0.02), "leaves no hole"),
        (lambda: fm.BoxSection(0.05, 0.05, 0.03, 0.004), "leave no hole"),
        (lambda: fm.ISection(0.05, 0.05, 0.004, 0.03), "fill the outline"),
        (lambda: fm.GeneralSection(1.0, 1.0, 0.0, 1.0).properties(NU), "Iz above zero"),
        (lambda: fm.GeneralSection(1.0, 1.0, 1.0, -1.0).properties(NU), "J: expected a number above zero"),
    ],
)
def test_impossible_sections_are_refused(make, words):
    with pytest.raises(SectionError, match=words):
        make()
