import numpy as np
import pytest
import scipy.linalg as la
from numpy.testing import assert_allclose

from cms.errors import ModeSetError
from cms.modes.mode_sets.assumed import assumed_modes
from cms.modes.mode_sets.axis_functions import AXIS_FUNCTIONS, axis_functions
from cms.reduction.reduction import reduce
from fe_models.body.couplings.couplings import couple
from fe_models.body.rigid_motion import rigid_motion_of_dofs
from tests.bodies import STEEL, bar, beam, box_mesh
from tests.fe_models.small_frames import straight

ROUNDOFF = 1e-12
SPAN = np.array([-0.3, 1.1])
FREE_FREE = (4.730040745, 7.853204624, 10.99560784)  # roots of cosh x cos x = 1


@pytest.fixture(scope="module")
def thin():
    return couple(beam(20, length=2.0))


@pytest.fixture(scope="module")
def solid():
    return couple(bar(nx=10, length=1.0, width=0.05, height=0.04))


def frequencies(body):
    return np.sqrt(la.eigh(body.K.toarray(), body.M.toarray(), eigvals_only=True)[6:20]) / (2 * np.pi)


@pytest.mark.parametrize("family", AXIS_FUNCTIONS)
def test_derivatives_of_the_functions_are_their_difference_quotients(family):
    s, h = np.linspace(-0.25, 1.05, 9), 1e-5
    f = axis_functions(family, s, SPAN, 6, 2)
    after, before = (axis_functions(family, s + step, SPAN, 6, 2) for step in (h, -h))
    assert_allclose((after.values - before.values) / (2 * h), f.slopes, rtol=0, atol=1e-7 * np.abs(f.slopes).max())
    change = (after.slopes - before.slopes) / (2 * h)
    assert_allclose(change, f.curvatures, rtol=0, atol=1e-7 * np.abs(f.curvatures).max())


@pytest.mark.parametrize("family", AXIS_FUNCTIONS)
@pytest.mark.parametrize("first", [1, 2])
def test_functions_are_complete_with_the_degrees_below_and_independent_of_them(family, first):
    s = np.linspace(*SPAN, 40)
    basis = np.hstack([s[:, None] ** np.arange(first), axis_functions(family, s, SPAN, 5, first).values])
    assert np.linalg.matrix_rank(basis, tol=1e-6) == first + 5
    for degree in range(4):
        target = s**degree
        rest = target - basis @ np.linalg.lstsq(basis, target, rcond=None)[0]
        assert_allclose(rest, 0, rtol=0, atol=1e-10)


@pytest.mark.parametrize("functions", AXIS_FUNCTIONS)
def test_euler_bernoulli_frequencies_of_a_free_beam(thin, functions):
    E, rho, A, I_y, L = 2.1e11, 7850.0, 1e-4, 1e-9, 2.0
    exact = [beta**2 / L**2 * np.sqrt(E * I_y / (rho * A)) / (2 * np.pi) for beta in FREE_FREE]
    modes = assumed_modes(thin, n_bending=12, n_axial=0, n_torsion=0, functions=functions)
    found = reduce(thin, modes).free_frequencies
    soft = [min(found, key=lambda f, e=e: abs(f - e)) for e in exact]
    assert_allclose(soft, exact, rtol=1e-3)


def test_frequencies_lie_above_the_full_ones_and_fall_with_the_degree(thin):
    full, before = frequencies(thin)[:6], np.full(6, np.inf)
    for n_modes in (5, 7, 9, 11):
        found = reduce(thin, assumed_modes(thin, n_modes=n_modes)).free_frequencies[:6]
        assert (found >= full * (1 - 1e-9)).all()
        assert (found <= before * (1 + 1e-9)).all()
        before = found
    assert_allclose(before, full, rtol=1e-4)


@pytest.mark.parametrize("poisson", [None, 0.3])
def test_a_solid_bar_in_bending_and_tension_is_within_its_shear_and_end_effects(solid, poisson):
    full = frequencies(solid)
    found = reduce(solid, assumed_modes(solid, n_modes=10, poisson=poisson)).free_frequencies
    assert (found[:3] >= full[:3] * (1 - 1e-9)).all()
    assert_allclose(found[:2], full[:2], rtol=6e-3)  # shear and the rigid end faces, which splines of s cannot follow
    E, L = STEEL.E, 1.0
    axial = np.sqrt(E / STEEL.rho) / (2 * L)
    assert min(abs(found - axial)) < 0.01 * axial


def test_without_contraction_bending_is_that_of_a_bar_with_held_sides(solid):
    """(1 - nu) / ((1 + nu)(1 - 2 nu)) = 1.346 for nu = 0.3."""
    tied, held = (
        reduce(solid, assumed_modes(solid, n_bending=10, n_axial=0, n_torsion=0, poisson=nu)).free_frequencies[0]
        for nu in (0.3, 0.0)
    )
    assert_allclose((held / tied) ** 2, 0.7 / (1.3 * 0.4), rtol=0.03)


def test_torsion_turns_sections_as_a_whole(solid):
    """Without warping the stiffness is G I_p and the speed of the wave that of shear."""
    modes = assumed_modes(solid, n_torsion=10, n_axial=0, n_bending=0)
    shear_wave = np.sqrt(STEEL.E / 2.6 / STEEL.rho)
    assert_allclose(reduce(solid, modes).free_frequencies[0], shear_wave / 2, rtol=0.01)


def test_the_pure_bending_field_of_a_bar_costs_the_exact_energy():
    """w = xi² of a bar without couplings: constant curvature, energy E I L w''² / 2, no other stress."""
    from fe_models.elements.solids.body import solid_body
    from fe_models.foundation.units import unit_system

    mesh = box_mesh(6, 2, 2, 1.0, 0.06, 0.04, "hexahedron20")
    body = solid_body(mesh, STEEL, name="bar", units=unit_system("m-kg-s"))
    u = assumed_modes(body, n_bending=1, n_axial=0, n_torsion=0, poisson=0.3, functions="monomials").columns[:, 6:]
    curvature = 2 / 0.5**2
    energy = np.einsum("nk,nk->k", u, body.K @ u) / 2
    bend = STEEL.E * np.array([0.06 * 0.04**3, 0.04 * 0.06**3]) / 12
    assert_allclose(np.sort(energy), bend * curvature**2 / 2, rtol=1e-9)


def test_the_pure_tension_field_of_a_bar_costs_the_exact_energy():
    from fe_models.elements.solids.body import solid_body
    from fe_models.foundation.units import unit_system

    mesh = box_mesh(4, 1, 1, 1.0, 0.06, 0.04)
    body = solid_body(mesh, STEEL, name="bar", units=unit_system("m-kg-s"))
    u = assumed_modes(body, n_axial=1, n_bending=0, n_torsion=0, poisson=0.3).columns[:, 6]
    assert_allclose(u @ (body.K @ u) / 2, STEEL.E * 0.06 * 0.04 * 2.0**2 / 2, rtol=1e-9)


def test_beam_rotations_follow_the_slope(thin):
    modes = assumed_modes(thin, n_bending=3, n_axial=0, n_torsion=0, axis=[1, 0, 0])
    h = 2.0 / 20
    for column in modes.columns[:, 6:].T:
        u = column.reshape(-1, 6)
        for w, slope in ((u[:, 1], u[:, 5]), (u[:, 2], -u[:, 4])):  # u_y' = r_z, u_z' = -r_y
            assert_allclose((w[2:] - w[:-2]) / (2 * h), slope[1:-1], rtol=0, atol=0.02 * np.abs(column).max())


def test_a_beam_needs_no_contraction_columns(thin):
    assert assumed_modes(thin, n_modes=3).columns.shape[1] == 6 + 3 * 4


def test_nodes_beside_the_centroid_need_no_contraction_columns_either():
    """A beam whose nodes lie beside its centroid: bent about the centroid, and moved along at the nodes."""
    body = couple(straight(n=12, interfaces=("start", "end"), offset=(0.0, 0.03)))
    modes = assumed_modes(body, n_modes=8)
    assert modes.columns.shape[1] == 6 + 8 * 4
    assert_allclose(reduce(body, modes).free_frequencies[:4], frequencies(body)[:4], rtol=2e-3)  # but for shear


def test_the_set_turns_with_the_body(solid):
    from dataclasses import replace

    import scipy.sparse as sp
    from scipy.spatial.transform import Rotation

    free = bar(nx=10, length=1.0, width=0.05, height=0.04)
    R = Rotation.from_rotvec([0.3, -0.7, 0.4]).as_matrix()
    turn = sp.kron(sp.eye_array(len(free.nodes)), R, format="csc")
    turned = replace(
        free,
        M=turn @ free.M @ turn.T,
        K=turn @ free.K @ turn.T,
        nodes=free.nodes @ R.T,
        element_model=None,
        interfaces=[replace(x, reference=R @ x.reference) for x in free.interfaces],
    )
    first, second = (reduce(body, assumed_modes(body, n_modes=5)).free_frequencies for body in (solid, couple(turned)))
    assert_allclose(second, first, rtol=1e-7)


def test_rigid_motion_is_in_the_set(solid):
    modes = assumed_modes(solid, n_modes=2)
    assert_allclose(modes.columns[:, :6], rigid_motion_of_dofs(solid.nodes, solid.dofs), rtol=0, atol=0)


@pytest.mark.parametrize(
    ("options", "text"),
    [
        ({}, "expected n_modes or n_axial"),
        ({"n_modes": 3, "n_torsion": -1}, "n_torsion = -1"),
        ({"n_modes": 3, "functions": "legendr"}, "did you mean 'legendre'"),
        ({"n_modes": 1, "functions": "splines"}, "at least 3"),
        ({"n_modes": 3, "axis": [0, 0, 0]}, "expected a direction"),
        ({"n_modes": 3, "poisson": 0.7}, "between -1 and 0.5"),
    ],
)
def test_bad_options_are_refused(thin, options, text):
    with pytest.raises(ModeSetError, match=text):
        assumed_modes(thin, **options)


def test_a_cube_has_no_axis_of_its_own():
    with pytest.raises(ModeSetError, match="determine no axis"):
        assumed_modes(couple(bar(nx=1, ny=1, nz=1, length=1.0, width=1.0, height=1.0)), n_modes=2)


def test_torsion_is_a_rigid_rotation_of_every_section(thin):
    """About an axis beside the beam every node is at the place r of its section, with a rotation of its own."""
    point = np.array([0.0, 0.1, -0.05])
    modes = assumed_modes(thin, n_torsion=2, n_axial=0, n_bending=0, axis=[1, 0, 0], point=point)
    rotation = rigid_motion_of_dofs(thin.nodes, thin.dofs, point)[:, 3].reshape(-1, 6)
    for column in modes.columns[:, 6:].T:
        u = column.reshape(-1, 6)
        assert_allclose(u, u[:, 3:4] * rotation, rtol=0, atol=ROUNDOFF * np.abs(u).max())
