import re
from dataclasses import replace

import numpy as np
import pytest
import scipy.linalg as la
import scipy.sparse as sp
from numpy.testing import assert_allclose, assert_array_equal

from cms.errors import BodyError, EigenError, ModeSetError
from cms.linear_algebra.solvers.factorization import factorize
from cms.linear_algebra.solvers.mode_count import ModeCount
from cms.modes.families.families import Families
from cms.modes.families.flexibility import BoundaryConditions
from cms.modes.families.interface_loads import InterfaceLoad, point_load
from cms.modes.mode_sets import MODE_SETS, benfield_hruda
from fe_models.body.couplings.couplings import couple
from fe_models.body.fe_body import Interface
from fe_models.body.rigid_motion import rigid_motion_of_dofs
from tests.bodies import bar, chain, with_interfaces
from tests.cms.modes.families.examples import BODIES, constrained_spectrum, three_interface_solid

ROUNDOFF = 1e-12


@pytest.fixture(scope="module", params=BODIES)
def families(request):
    with Families(BODIES[request.param]()) as families:
        yield families


def angles(families, left, right):
    """Largest principal angle of two spans in W = K + omega_1² M, and their common dimension."""
    body = families.body
    omega2 = families.free_modes(n_modes=1).omega2[0]
    W = (body.K + omega2 * body.M).toarray()
    spans = []
    for columns in (left, right):
        X = np.hstack(columns)
        G = X.T @ W @ X
        size = 1 / np.sqrt(np.diag(G))
        values, vectors = la.eigh(G * np.outer(size, size))
        kept = values > 1e-13 * values[-1]
        spans.append(size[:, None] * vectors[:, kept] / np.sqrt(values[kept]))
        spans[-1] = X @ spans[-1]
    assert spans[0].shape == spans[1].shape
    # sine of the largest angle: what is left of one span beside the other
    rest = spans[0] - spans[1] @ (spans[1].T @ W @ spans[0])
    return np.sqrt(np.maximum(la.eigvalsh(rest.T @ W @ rest)[-1], 0.0)), spans[0].shape[1]


TOLERANCE = 1e-7  #: of a sine whose square is a difference of unit numbers


def test_rigid_and_redundant_constraint_or_attachment_modes_span_the_constraint_modes(families):
    f = families
    for second in (f.Psi_RC, f.Psi_A):
        sine, dimension = angles(f, [f.Psi_R, second], [f.Psi_C])
        assert sine < TOLERANCE
        assert dimension == len(f.body.b)


def test_statically_complete_spans_are_one(families):
    f = families
    n_r = f.Psi_R.shape[1]
    for left in ([f.Psi_R, f.Psi_RC, f.Psi_H], [f.Psi_R, f.Psi_A, f.Psi_H], [f.Psi_C, f.Psi_H]):
        sine, dimension = angles(f, left, [f.Psi_R, f.Psi_U])
        assert sine < TOLERANCE
        assert dimension == len(f.body.b) + n_r


def test_a_span_that_lacks_inertia_relief_is_another_one(families):
    """The measure itself: without Psi_H the dimensions differ, and a shuffled column is seen."""
    f = families
    with pytest.raises(AssertionError):
        angles(f, [f.Psi_C], [f.Psi_R, f.Psi_U])
    n_b = len(f.body.b)
    wrong = f.Psi_U + np.roll(f.Psi_H, 1, axis=0)[:, :1] * np.abs(f.Psi_U).max() / np.abs(f.Psi_H).max()
    sine, _ = angles(f, [f.Psi_C, f.Psi_H], [f.Psi_R, wrong[:, :n_b]])
    assert sine > 1e-3


def test_flexibility_is_the_pseudo_inverse_of_the_free_body(families):
    """Second road: Pᵀ G P by dense algebra, G a pseudo-inverse of K."""
    f, body = families, families.body
    K, M, R = body.K.toarray(), body.M.toarray(), f.Psi_R
    P = np.eye(len(K)) - M @ R @ np.linalg.solve(R.T @ M @ R, R.T)
    F = np.random.default_rng(1).normal(size=(body.n_dof, 4)) * (body.dofs[:, 1:] >= 0)
    expected = P.T @ la.pinv(K, rtol=1e-11) @ P @ F
    assert_allclose(f.flexibility(F), expected, rtol=0, atol=1e-8 * np.abs(expected).max())
    assert_allclose(f.project(F), P @ F, rtol=0, atol=ROUNDOFF * np.abs(F).max() * 10)


def test_unrestrained_attachment_modes_are_the_flexibility_of_unit_boundary_forces(families):
    f, body = families, families.body
    F = np.eye(body.n_dof)[:, body.b]
    expected = f.flexibility(F)
    assert_allclose(f.Psi_U, expected, rtol=0, atol=1e-9 * np.abs(expected).max())
    momentum = f.Psi_R.T @ (body.M @ f.Psi_U)
    scale = np.abs(f.Psi_R.T).max() * np.abs(body.M @ np.abs(f.Psi_U)).sum(axis=0).max()
    assert_allclose(momentum, 0, rtol=0, atol=1e-10 * scale)


def test_attachment_modes_answer_unit_forces_with_r_held(families):
    f, body = families, families.body
    force = body.K @ f.Psi_A
    free = np.setdiff1d(np.arange(body.n_dof), f.r)
    unit = (np.arange(body.n_dof)[:, None] == f.e).astype(float)
    scale = np.abs(body.K).max() * np.abs(f.Psi_A).max()
    assert_allclose(force[free], unit[free], rtol=0, atol=max(1e-9, 100 * ROUNDOFF * scale))
    assert_allclose(f.Psi_A[f.r], 0, rtol=0, atol=0)
    assert_allclose(f.static(unit), f.Psi_A, rtol=0, atol=1e-9 * np.abs(f.Psi_A).max())


def test_inertia_relief_modes_balance_rigid_body_accelerations(families):
    f, body = families, families.body
    assert_allclose(f.Psi_H[f.h], 0, rtol=0, atol=0)
    force, load = body.K @ f.Psi_H, body.M @ f.Psi_R
    i = f.fixed.i
    assert_allclose(force[i], load[i], rtol=0, atol=1e-8 * np.abs(load).max())


def test_residual_attachment_modes_lack_the_kept_modes(families):
    """Second road: the same flexibility as a sum over the modes that are left out."""
    f, body = families, families.body
    n_modes = 3
    kept = f.free_modes(n_modes=n_modes)
    residual = f.residual_attachment(kept)
    overlap = kept.Phi.T @ (body.M @ residual)
    scale = np.abs(kept.Phi.T @ (body.M @ f.Psi_U)).max()
    assert_allclose(overlap, 0, rtol=0, atol=1e-9 * scale)
    if (body.dofs[:, 1] < 0).any():  # the sum over modes knows no multipliers
        return
    omega2, Phi = la.eigh(body.K.toarray(), body.M.toarray())
    out = slice(f.Psi_R.shape[1] + n_modes, None)
    expected = (Phi[:, out] / omega2[out]) @ Phi[body.b, out].T
    assert_allclose(residual, expected, rtol=0, atol=1e-9 * np.abs(f.Psi_U).max())


def test_free_and_fixed_modes_are_those_of_the_dense_pencils(families):
    f, body = families, families.body
    omega2 = constrained_spectrum(body, np.zeros(0, int))
    n_r = f.Psi_R.shape[1]
    assert_allclose(f.free_modes(n_modes=4).omega2, omega2[n_r : n_r + 4], rtol=1e-8)
    assert_allclose(f.fixed_modes(n_modes=4).omega2, constrained_spectrum(body, body.b)[:4], rtol=1e-8)


def test_loaded_and_mixed_modes_are_those_of_the_dense_pencils(families):
    f, body = families, families.body
    n_b = len(body.b)
    rng = np.random.default_rng(2)
    A = rng.normal(size=(n_b, n_b))
    size = np.sqrt(np.diag(f.S))
    M_load = np.diag(rng.uniform(0.1, 1.0, n_b)) * f.body.M.diagonal().sum() / n_b / (size / size.max()) ** -2
    K_load = 1e-3 * (A @ A.T) * np.outer(size, size)
    expected = constrained_spectrum(body, np.zeros(0, int), K_load, M_load)
    loaded = f.elastic_modes(BoundaryConditions(np.eye(n_b), K_load, M_load), n_modes=3)
    assert_allclose(loaded.omega2, expected[:3], rtol=1e-7)
    only_mass = f.elastic_modes(BoundaryConditions(np.eye(n_b), None, M_load), n_modes=3)
    n_r = f.Psi_R.shape[1]
    expected = constrained_spectrum(body, np.zeros(0, int), 0 * K_load, M_load)
    assert_allclose(only_mass.omega2, expected[n_r : n_r + 3], rtol=1e-7)
    held = body.b[1:]
    mixed = f.elastic_modes(BoundaryConditions(np.eye(n_b)[:, :1]), n_modes=3)
    expected = constrained_spectrum(body, held)
    n_free = int((expected < 1e-6 * f.free_modes(n_modes=1).omega2[0]).sum())
    assert_allclose(mixed.omega2, expected[n_free : n_free + 3], rtol=1e-7)
    assert_allclose(mixed.Phi[held], 0, rtol=0, atol=0)


def test_condensed_stiffness_is_the_energy_of_the_constraint_modes(families):
    f, K = families, families.body.K
    expected = f.Psi_C.T @ (K @ f.Psi_C)
    assert_allclose(f.S, expected, rtol=0, atol=1e-10 * np.abs(f.S).max())


def test_fewer_modes_are_taken_from_those_found_before():
    body = couple(bar(nx=4, kind="hexahedron"))
    with Families(body) as f:
        many = f.free_modes(n_modes=6)
        few = f.free_modes(n_modes=2)
        assert_array_equal(few.Phi, many.Phi[:, :2])
        cutoff = many.frequencies[3] * 1.0001
        assert_array_equal(
            f.free_modes(n_modes=ModeCount(cutoff=cutoff)).omega2, many.omega2[many.frequencies <= cutoff]
        )
        assert f.free_modes(n_modes=6) is many
        assert not few.is_proven
        assert f.free_modes(n_modes=ModeCount(2, verify=True)).is_proven
        assert len(f.free_modes(n_modes=8).omega2) == 8
        assert f.free_modes(n_modes=0).Phi.shape == (body.n_dof, 0)


def test_the_inertia_proves_free_modes_complete():
    """A count by another factorisation knows nothing of the projected flexibility."""
    body = three_interface_solid()
    with Families(body) as f:
        assert f.free_modes(n_modes=ModeCount(5, verify=True)).is_proven
        assert f.elastic_modes(BoundaryConditions(np.eye(18)[:, :5]), n_modes=ModeCount(4, verify=True)).is_proven
        heavy = np.diag([100.0 if dof % 6 < 3 else 1.0 for dof in range(18)])  # many frequencies fall by orders
        loaded = BoundaryConditions(np.eye(18), None, heavy)
        assert f.elastic_modes(loaded, n_modes=ModeCount(4, verify=True)).is_proven
        omega2 = f.elastic_modes(loaded, n_modes=6).omega2
        assert f.flexibility_under(loaded).count_below((omega2[3] + omega2[4]) / 2) == 4
        assert f.free.count_below((omega2[3] + omega2[4]) / 2) < 4


def test_six_sets_share_one_factorisation(monkeypatch):
    import cms.modes.families.fixed_interface

    counted = []
    monkeypatch.setattr(
        cms.modes.families.fixed_interface, "factorize", lambda *a, **k: counted.append(1) or factorize(*a, **k)
    )
    monkeypatch.setattr(
        "cms.linear_algebra.solvers.eigen.factorize", lambda *a, **k: counted.append(2) or factorize(*a, **k)
    )
    body = couple(bar(nx=4, kind="hexahedron"))
    with Families(body) as families:
        for name in ("craig-bampton", "craig-bampton-ir", "herting", "rubin", "craig-chang", "attachment"):
            MODE_SETS[name](families, n_modes=3)
    assert counted == [1]


@pytest.mark.parametrize("n_components", [3, 1])
def test_an_interface_that_leaves_rotations_free_borrows_interior_dofs(n_components):
    """One node with three translations: R takes interior dofs, the spans are complete all the same."""
    body = bar(nx=4, kind="hexahedron")
    node = np.array([0])
    corner = Interface("corner", "nodes", node, body.nodes[0], dofs=np.flatnonzero(body.dofs[:, 0] == 0)[:n_components])
    body = couple(with_interfaces(body, corner))
    with Families(body) as f:
        assert len(f.r) == 6
        assert len(f.e) == 0
        assert np.linalg.matrix_rank(rigid_motion_of_dofs(body.nodes, body.dofs)[f.r]) == 6
        assert_allclose(f.free_modes(n_modes=3).omega2, constrained_spectrum(body, np.zeros(0, int))[6:9], rtol=1e-8)
        held = constrained_spectrum(body, body.b)
        n_free = 6 - n_components
        assert_allclose(held[:n_free] / held[n_free], 0, rtol=0, atol=1e-8)
        assert_allclose(f.fixed_modes(n_modes=3).omega2, held[n_free : n_free + 3], rtol=1e-8)
        sine, _ = angles(f, [f.Psi_C], [f.Psi_R])
        assert sine < TOLERANCE
        u = f.flexibility(np.eye(body.n_dof)[:, body.b])
        assert_allclose(f.Psi_U, u, rtol=0, atol=1e-9 * np.abs(u).max())


def test_a_body_without_interfaces_has_free_modes():
    body = with_interfaces(bar(nx=4, kind="hexahedron"))
    with Families(body) as f:
        omega2 = constrained_spectrum(body, np.zeros(0, int))
        assert_allclose(f.free_modes(n_modes=ModeCount(5, verify=True)).omega2, omega2[6:11], rtol=1e-8)
        assert f.Psi_U.shape == (body.n_dof, 0)


def test_a_large_boundary_of_every_end_node_stays_exact():
    body = bar(nx=6, ny=3, nz=3, kind="hexahedron")
    left, right = body.interfaces
    body = couple(with_interfaces(body, replace(left, kind="nodes"), replace(right, kind="nodes")))
    with Families(body) as f:
        assert len(body.b) == 96
        omega2 = constrained_spectrum(body, np.zeros(0, int))
        assert_allclose(f.free_modes(n_modes=5).omega2, omega2[6:11], rtol=1e-8)
        sine, dimension = angles(f, [f.Psi_C, f.Psi_H], [f.Psi_R, f.Psi_U])
        assert sine < 10 * TOLERANCE
        assert dimension == 102


def test_a_grounded_body_is_refused_where_it_must_be_free():
    body = couple(bar(nx=3, kind="hexahedron"))
    K = body.K.tolil()
    K[0, 0] *= 2
    with Families(replace(body, K=sp.csc_array(K))) as f:
        assert f.Psi_C.shape == (body.n_dof, 12)
        with pytest.raises(BodyError, match="held to the ground, or nodes have wrong positions"):
            _ = f.Psi_U


def test_a_body_without_rotational_inertia_is_refused_where_it_is_needed():
    """All mass on a line: no free modes, constraint modes nevertheless."""
    body = couple(bar(nx=3, kind="hexahedron"))
    on_line = np.zeros(body.n_dof)
    line = np.flatnonzero((np.abs(body.nodes[:, 1]) < 1e-9) & (np.abs(body.nodes[:, 2]) < 1e-9))
    on_line[np.isin(body.dofs[:, 0], line) & (body.dofs[:, 1] < 3)] = 1.0
    with Families(replace(body, M=sp.diags_array(on_line))) as f:
        assert f.Psi_C.shape == (body.n_dof, 12)
        with pytest.raises(BodyError, match="no inertia in some rigid-body motion"):
            f.free_modes(n_modes=2)


def test_closed_families_are_refused():
    with Families(couple(chain(5))) as f:
        pass
    with pytest.raises(ModeSetError, match="closed; make new ones"):
        _ = f.Psi_C


def test_hinged_parts_with_both_sides_held_are_a_mechanism():
    """K_II is regular there, so only the condensed stiffness can tell."""
    from tests.cms.examples import hinged_bricks

    with Families(couple(hinged_bricks())) as f, pytest.raises(BodyError, match=r"1 motion besides.*a mechanism"):
        _ = f.Psi_A


HINGE = np.array([1.0, 1.0, 0.0])  # a point on the axis of `hinged_bricks`, which is along z


def springs_of_hinged_bricks(stiffness, direction):
    """Springs in all directions at the left brick, one spring at the reference point of the right one."""
    at_right = np.zeros((6, 6))
    at_right[:3, :3] = stiffness * np.outer(direction, direction) / (direction @ direction)
    return [
        point_load("left", stiffness=stiffness, rotational_stiffness=stiffness),
        InterfaceLoad(("right",), np.zeros((6, 6)), at_right),
    ]


@pytest.mark.parametrize("stiffness", [1e4, 1e9])
def test_a_load_through_the_hinge_leaves_the_mechanism(stiffness):
    from tests.cms.examples import hinged_bricks

    body = couple(hinged_bricks())
    arm = (body.interface("right").reference - HINGE) * [1, 1, 0]
    with pytest.raises(BodyError, match=r"1 motion besides.*a mechanism"):
        benfield_hruda(body, n_modes=3, loads=springs_of_hinged_bricks(stiffness, arm))


@pytest.mark.parametrize("stiffness", [1e4, 1e5])
def test_a_load_across_the_hinge_holds_the_mechanism(stiffness):
    """Such soft springs move the bricks as rigid bodies: seven motions, those of the whole and that of the hinge."""
    from tests.cms.examples import hinged_bricks

    body = couple(hinged_bricks())
    arm = body.interface("right").reference - HINGE
    loads = springs_of_hinged_bricks(stiffness, np.cross([0.0, 0.0, 1.0], arm))
    rigid = rigid_motion_of_dofs(body.nodes, body.dofs)
    about_hinge = rigid_motion_of_dofs(body.nodes, body.dofs, HINGE)[:, 5]
    is_right = body.nodes[body.dofs[:, 0]][:, :2].sum(axis=1) > 2.0 + 1e-9
    Psi = np.column_stack([rigid, np.where(is_right, about_hinge, 0.0)])
    K_load = la.block_diag(*[load.K for load in loads])  # both triads are the mesh axes
    omega2 = la.eigvalsh(Psi[body.b].T @ K_load @ Psi[body.b], Psi.T @ body.M @ Psi)
    modes = benfield_hruda(body, n_modes=7, loads=loads)
    assert_allclose(modes.frequencies[-7:], np.sqrt(omega2) / (2 * np.pi), rtol=10 * stiffness / 2e11 + 1e-6)


@pytest.mark.parametrize("exponent", range(-6, 2))
def test_a_load_that_hardly_holds_the_mechanism_gives_its_modes_or_is_refused_by_name(exponent):
    """Springs of 1 uN/m to 10 N/m on steel: a mechanism, modes that are lost in rounding, or right ones."""
    from tests.cms.examples import hinged_bricks

    body, stiffness = couple(hinged_bricks()), 10.0**exponent
    arm = body.interface("right").reference - HINGE

    def frequencies(stiffness):
        loads = springs_of_hinged_bricks(stiffness, np.cross([0.0, 0.0, 1.0], arm))
        return benfield_hruda(body, n_modes=7, loads=loads).frequencies[-7:]

    try:
        found = frequencies(stiffness)
    except (BodyError, EigenError) as error:
        assert exponent < 0
        assert re.search("costs? no energy: a mechanism|slowest modes are lost in rounding", str(error))  # noqa: PT017
    else:
        assert_allclose(found, np.sqrt(stiffness / 1e5) * frequencies(1e5), rtol=1e-3)


def test_an_uncoupled_body_is_sent_to_couple():
    with pytest.raises(BodyError, match=r"call cms\.couple"):
        Families(bar(nx=2, kind="hexahedron"))
