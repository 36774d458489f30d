from dataclasses import replace

import numpy as np
import pytest
import scipy.linalg as la
import scipy.sparse as sp
from numpy.testing import assert_allclose
from scipy.spatial.transform import Rotation

from cms.assessment.quality.errors import QualityError
from cms.assessment.quality.of_reduction.completeness import held_mass, held_mass_record, static_completeness
from cms.assessment.quality.of_reduction.conditioning import column_condition
from cms.assessment.quality.of_reduction.frequencies import compare_frequencies, mac, residual_bounds
from cms.assessment.quality.of_reduction.full_shapes import full_shapes
from cms.assessment.quality.of_reduction.interface_stiffening import interface_stiffening
from cms.assessment.quality.of_reduction.mass_properties import check_grounding, rigid_mass_matrix
from cms.assessment.quality.reduction_check import check_reduction
from cms.assessment.quality.reference.full_reference import FullReference, usable_band
from cms.modes.mode_set import ModeSet
from cms.modes.mode_sets import MODE_SETS, craig_bampton, guyan
from cms.reduction.basis.frames import BuckensFrame, NodalFrame, TisserandFrame
from cms.reduction.basis.free_basis import FreeBasis, free_basis, ritz_basis
from cms.reduction.error_estimates import energy_error
from cms.reduction.reduction import reduce
from fe_models.body.couplings.couplings import couple
from fe_models.body.load_cases import LoadCase
from fe_models.body.rigid_motion import rigid_motion_of_dofs
from fe_models.foundation.units import unit_system
from tests.bodies import bar, beam, chain

BAND = 2500.0


@pytest.fixture(scope="module")
def uncoupled():
    return bar(nx=6, kind="hexahedron")


@pytest.fixture(scope="module")
def body(uncoupled):
    return couple(uncoupled)


@pytest.fixture(scope="module")
def reference(body):
    with FullReference(body, band=BAND) as made:
        yield made


@pytest.fixture(scope="module")
def exact(body):
    """Squared elastic free frequencies and shapes by a dense solver, that shares nothing with the reference."""
    omega2, Phi = la.eigh(body.K.toarray(), body.M.toarray())
    return omega2[6:], Phi[:, 6:]


def basis_of(reference, modes) -> FreeBasis:
    return free_basis(reference.body, modes, reference.families)


def records_of(body, modes, reduced, reference, **more):
    return {r.name: r for r in check_reduction(body, modes, reduced, reference=reference, **more)}


def without(modes, *words):
    """The mode set without the columns whose labels end in one of these words."""
    kept = [k for k, label in enumerate(modes.labels) if not label.endswith(words)]
    return ModeSet(modes.name, modes.columns[:, kept], [modes.labels[k] for k in kept], modes.frequencies[kept])


# Frequencies and shapes ----------------------------------------------------------------------------------------------


def test_the_reference_has_the_frequencies_of_a_row_of_masses():
    row = couple(chain(n=8, stiffness=1000.0, mass=2.0))
    known = 2 * np.sqrt(1000.0 / 2.0) * np.sin(np.arange(1, 8) * np.pi / 16) / (2 * np.pi)
    with FullReference(row, band=10.0) as reference:
        assert_allclose(reference.frequencies, known, rtol=1e-9)
        every = ModeSet("unit", np.eye(8), [f"dof {k}" for k in range(8)], np.full(8, np.nan))
        found = compare_frequencies(reference, basis_of(reference, every))
        assert_allclose(found.error, 0, rtol=0, atol=1e-9)
        assert_allclose(found.mac, np.eye(7), rtol=0, atol=1e-9)
        assert_allclose(found.mac_nodal, np.eye(7), rtol=0, atol=1e-9)
        few = compare_frequencies(reference, basis_of(reference, craig_bampton(row, n_modes=1)))
        assert (few.error[:2] > 1e-4).all()
        assert np.isnan(few.error[2:]).all()


def test_reduced_frequencies_lie_above_the_true_ones_and_fall_with_more_modes(reference, body, exact):
    before = np.full(reference.n_band, np.inf)
    for n_modes in (0, 2, 6, 12):
        found = compare_frequencies(reference, basis_of(reference, craig_bampton(body, n_modes=n_modes)))
        assert (found.error > -1e-9).all()
        assert (found.error <= before + 1e-9).all()
        before = found.error
    assert_allclose(found.full, np.sqrt(exact[0][: reference.n_band]) / (2 * np.pi), rtol=1e-8)


def test_the_mac_of_shapes_is_the_squared_cosine_of_their_angle():
    a, b = np.array([[1.0], [0.0]]), np.array([[np.cos(0.3)], [np.sin(0.3)]])
    assert_allclose(mac(a, 5 * b), np.cos(0.3) ** 2, rtol=1e-12)
    M = np.diag([4.0, 1.0])
    a, b = a / 2, b / np.sqrt(b.T @ M @ b)
    assert_allclose(mac(a, b, M @ b), (a.T @ M @ b) ** 2, rtol=1e-12)


def test_a_rotation_within_a_double_frequency_loses_no_mode():
    square = couple(bar(nx=5, width=0.05, height=0.05, kind="hexahedron"))
    with FullReference(square, band=2500.0) as reference:
        modes = reference.modes
        assert modes.frequencies[1] / modes.frequencies[0] - 1 < 1e-6  # bending in both planes
        turn = np.eye(len(modes.omega2))
        turn[:2, :2] = [[np.cos(0.7), -np.sin(0.7)], [np.sin(0.7), np.cos(0.7)]]
        n = len(modes.omega2)
        basis = FreeBasis(modes.Phi @ turn, modes.omega2, np.ones(n, bool), reference.families.free.N)
        found = compare_frequencies(reference, basis)
    assert found.mac[0, 0] < 0.7
    assert_allclose(found.recovered, 1, rtol=0, atol=1e-8)
    assert_allclose(found.recovered_nodal, 1, rtol=0, atol=1e-8)


def test_a_missing_mode_is_not_recovered(reference):
    modes = reference.modes
    kept = np.delete(np.arange(len(modes.omega2)), 1)
    basis = FreeBasis(modes.Phi[:, kept], modes.omega2[kept], np.ones(len(kept), bool), reference.families.free.N)
    found = compare_frequencies(reference, basis)
    assert found.recovered[1] < 1e-8
    assert_allclose(np.delete(found.recovered, 1), 1, rtol=0, atol=1e-8)


# Static completeness -------------------------------------------------------------------------------------------------


COMPLETE = {"craig-bampton": (True, False), "craig-bampton-ir": (True, True), "rubin": (True, True)}


@pytest.mark.parametrize("name", COMPLETE)
def test_statically_complete_sets_answer_loads_exactly(reference, body, name):
    interface, inertia = COMPLETE[name]
    modes = MODE_SETS[name](reference.families, n_modes=2)
    found = static_completeness(reference, basis_of(reference, modes))
    assert (found.interface.max() < 1e-9) == interface
    assert (found.inertia.max() < 1e-8) == inertia


def test_guyan_answers_no_acceleration_while_its_interfaces_are_held(reference, body):
    """Psi_H is K-orthogonal to the constraint modes, so the best approximation is zero: error exactly one."""
    found = static_completeness(reference, basis_of(reference, guyan(body)))
    assert_allclose(found.inertia, 1, rtol=1e-9)


def test_fixed_modes_answer_accelerations_in_proportion_to_their_energy(body, reference):
    """Psi_H = sum phi_k L_k / lambda_k over the fixed-interface modes, energy L_k² / lambda_k each."""
    n_modes = 3
    i = body.i
    lam, Phi = la.eigh(body.K.toarray()[np.ix_(i, i)], body.M.toarray()[np.ix_(i, i)])
    L = Phi.T @ (body.M @ reference.families.Psi_R)[i]
    energy = L**2 / lam[:, None]
    wanted = np.sqrt(energy[n_modes:].sum(axis=0) / energy.sum(axis=0))
    found = static_completeness(reference, basis_of(reference, craig_bampton(body, n_modes=n_modes)))
    assert_allclose(found.inertia, wanted, rtol=1e-6)


def test_load_cases_are_answered_by_their_residual_vectors_only(body):
    """Pressure in the middle of the bar is no interface load; gravity does not deform a free body."""
    middle = int(np.flatnonzero((body.dofs[:, 1] == 2) & (np.abs(body.nodes[body.dofs[:, 0], 0] - 0.5) < 0.01))[0])
    push = LoadCase("push", "force", np.eye(body.n_dof)[middle])
    gravity = LoadCase("gravity", "gravity", body.M @ rigid_motion_of_dofs(body.nodes, body.dofs)[:, 2])
    loaded = body.with_load_cases(push, gravity)
    with FullReference(loaded, band=BAND) as reference:
        poor = craig_bampton(loaded, n_modes=1)
        found = static_completeness(reference, basis_of(reference, poor))
        vector = reference.families.flexibility(push.f[:, None])
        rich = ModeSet(
            "rich", np.hstack([poor.columns, vector]), (*poor.labels, "residual 1"), np.r_[poor.frequencies, np.nan]
        )
        answered = static_completeness(reference, basis_of(reference, rich))
        records = records_of(loaded, poor, reduce(loaded, poor), reference)
    assert found.load_cases == ("push", "gravity")
    assert found.load_case[0] > 0.05
    assert np.isnan(found.load_case[1])
    assert answered.load_case[0] < 1e-9
    assert records["static-load-cases"].verdict == "warn"


def test_the_energy_error_agrees_with_a_dense_least_squares(body, reference):
    rng = np.random.default_rng(3)
    U = np.linalg.solve(body.K.toarray() + 1e6 * body.M.toarray(), rng.normal(size=(body.n_dof, 4)))
    basis = basis_of(reference, craig_bampton(body, n_modes=2))
    values, vectors = la.eigh(body.K.toarray())
    root = np.sqrt(np.maximum(values, 0))[:, None] * vectors.T
    rest = root @ U - root @ basis.Phi @ np.linalg.lstsq(root @ basis.Phi, root @ U, rcond=None)[0]
    wanted = np.linalg.norm(rest, axis=0) / np.linalg.norm(root @ U, axis=0)
    assert_allclose(energy_error(body, basis, U), wanted, rtol=1e-6)


# A-posteriori bounds -------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("n_modes", [0, 3, 8])
def test_a_true_frequency_lies_within_every_residual_bound(reference, body, exact, n_modes):
    basis = basis_of(reference, craig_bampton(body, n_modes=n_modes))
    found = residual_bounds(reference, basis)
    true = exact[0]
    distance = np.abs(basis.omega2[: len(found.bound), None] / true - 1).min(axis=1)
    assert (distance <= found.bound * (1 + 1e-9) + 1e-12).all()


def test_the_residual_bound_of_two_mixed_modes_is_that_of_the_formula(reference):
    """phi = c phi_1 + s phi_4: b² = sum (lambda_j - theta)² c_j² / lambda_j / theta."""
    lam, Phi, N = reference.modes.omega2[[0, 3]], reference.modes.Phi[:, [0, 3]], reference.families.free.N
    c = np.array([np.cos(0.1), np.sin(0.1)])
    theta = float(lam @ c**2)
    basis = FreeBasis((Phi @ c)[:, None], np.array([theta]), np.array([True]), N)
    wanted = np.sqrt(((lam - theta) ** 2 * c**2 / lam).sum() / theta)
    assert_allclose(residual_bounds(reference, basis).bound, wanted, rtol=1e-6)


def test_true_modes_have_no_residual(reference):
    modes = reference.modes
    basis = FreeBasis(modes.Phi, modes.omega2, np.ones(len(modes.omega2), bool), reference.families.free.N)
    assert residual_bounds(reference, basis).bound.max() < 1e-5


# Mass, grounding, condition ------------------------------------------------------------------------------------------


@pytest.mark.parametrize("frame", [TisserandFrame(), NodalFrame("right")], ids=str)
def test_the_rigid_mass_of_a_file_is_that_of_the_mass_matrix_about_the_mesh_origin(body, frame):
    reduced = reduce(body, guyan(body), frame=frame)
    Psi_R = rigid_motion_of_dofs(body.nodes, body.dofs)
    wanted = Psi_R.T @ (body.M @ Psi_R)
    assert_allclose(rigid_mass_matrix(reduced), wanted, rtol=0, atol=1e-12 * np.abs(wanted).max())


def test_effective_masses_with_the_interfaces_held_are_those_of_the_fixed_modes(body, reference):
    """L_k² of a dense solution with the interfaces held; over all modes they sum to the held mass of the full model."""
    i = body.i
    lam, Phi = la.eigh(body.K.toarray()[np.ix_(i, i)], body.M.toarray()[np.ix_(i, i)])
    d = rigid_motion_of_dofs(body.nodes, body.dofs, body.nodes.mean(axis=0))
    wanted = (Phi.T @ (body.M @ d)[i]) ** 2
    found = held_mass(reference, basis_of(reference, craig_bampton(body, n_modes=7)))
    assert_allclose(found.frequencies, np.sqrt(lam[:7]) / (2 * np.pi), rtol=1e-7)
    assert_allclose(found.mass, wanted[:7], rtol=0, atol=1e-7 * wanted.max())
    assert_allclose(found.total, wanted.sum(axis=0), rtol=1e-8)
    assert_allclose(found.rigid[:3], 15.7, rtol=1e-9)
    judged, known = (held_mass_record(found, is_static_complete=c) for c in (False, True))
    assert (judged.verdict, known.verdict) == ("warn", "info")
    assert known.reason.endswith("the rest answers statically")
    none = held_mass(reference, basis_of(reference, guyan(body)))
    assert none.mass.shape[0] == 0
    assert_allclose(none.remainder, 1, rtol=1e-9)


def test_a_spring_to_the_ground_is_found_with_the_frequency_of_the_swing(body):
    stiffness = 1e6
    dof = int(np.flatnonzero(body.dofs[:, 1] == 2)[3])
    spring = sp.csc_array(([stiffness], ([dof], [dof])), shape=body.K.shape)
    record = check_grounding(replace(body, K=body.K + spring))
    assert record.verdict == "fail"
    swing = np.sqrt(stiffness / 15.7) / (2 * np.pi)
    assert_allclose(record.data["swing_hz"][2], swing, rtol=1e-9)
    assert f"at node {body.dofs[dof, 0]}" in record.reason
    assert check_grounding(body).verdict == "pass"


def test_the_condition_of_columns_is_that_of_their_weighted_matrix(body):
    rng = np.random.default_rng(1)
    omega2 = 1e6
    W = la.cholesky((body.K + omega2 * body.M).toarray())
    Q = la.solve_triangular(W, np.linalg.qr(rng.normal(size=(body.n_dof, 3)))[0])  # W-orthonormal
    V = Q @ np.array([[1.0, 1.0, 0.0], [0.0, 1e-5, 0.0], [0.0, 0.0, 7.0]])
    modes = ModeSet("mixed", V, ("a 1", "b 1", "c 1"), np.full(3, np.nan))
    condition, dropped = column_condition(body, modes, omega2)
    assert dropped == ()
    assert_allclose(condition, 2e5, rtol=1e-3)  # two unit vectors at an angle of 1e-5
    again = ModeSet("again", V[:, [0, 1, 2, 0]], ("a 1", "b 1", "c 1", "copy 1"), np.full(4, np.nan))
    assert column_condition(body, again, omega2)[1] in (("copy 1",), ("a 1",))


# Interfaces ----------------------------------------------------------------------------------------------------------


def test_rigid_interfaces_raise_frequencies_and_lower_compliances(uncoupled):
    found = interface_stiffening(uncoupled)
    assert (found.frequency_change > -1e-9).all()
    assert (found.compliance_ratio > 1 - 1e-9).all()
    assert found.frequency_change.max() > 1e-5


def test_stiffening_shows_on_a_stubby_body_and_is_nothing_on_a_long_one():
    change = [
        interface_stiffening(
            bar(nx=nx, length=0.05 * nx, width=0.05, height=0.05, ny=2, nz=2, kind="hexahedron"), n_modes=2
        ).frequency_change.max()
        for nx in (2, 10)
    ]
    assert change[0] > 20 * change[1]


def test_stiffening_needs_interfaces_that_can_change(body):
    with pytest.raises(QualityError, match="is coupled already"):
        interface_stiffening(body)
    with pytest.raises(QualityError, match="no rigid or distributing interface"):
        interface_stiffening(beam(n=3))


# All of it -----------------------------------------------------------------------------------------------------------


AXES = tuple(map(tuple, Rotation.from_rotvec([0.3, -0.5, 0.8]).as_matrix().round(15).tolist()))
TURNED = [
    NodalFrame("left", origin=(0.1, 0.2, 0.3), axes=AXES),
    TisserandFrame(axes=AXES),
    BuckensFrame(origin=(0.3, 0.0, 0.0), axes=AXES),
]


@pytest.mark.parametrize("frame", [TisserandFrame(), NodalFrame("left"), *TURNED], ids=str)
def test_a_good_reduction_passes_every_check(body, uncoupled, reference, frame):
    modes = MODE_SETS["craig-bampton-ir"](reference.families, n_modes=20)
    found = records_of(body, modes, reduce(body, modes, frame=frame), reference, uncoupled=uncoupled)
    assert {name for name, r in found.items() if r.verdict not in ("pass", "info")} == set()
    assert {"frequency-error", "static-inertia", "interface-stiffening", "frequency-response"} <= set(found)


def test_a_poor_reduction_fails_where_it_is_poor(body, reference):
    modes = guyan(body)
    found = records_of(body, modes, reduce(body, modes), reference)
    assert found["frequency-error"].verdict == "fail"
    assert found["static-inertia"].verdict == "warn"
    assert found["static-interface"].verdict == "pass"


def test_lost_constraint_modes_fail_the_static_check(body, reference):
    modes = without(craig_bampton(body, n_modes=8), "ux")
    found = records_of(body, modes, reduce(body, modes), reference)
    assert found["static-interface"].verdict == "fail"
    assert found["static-interface"].reason.endswith("ux'")


def test_the_file_of_another_body_or_set_is_recognised(body, reference):
    modes = craig_bampton(body, n_modes=4)
    heavy = replace(body, M=1.1 * body.M, element_model=None)
    other = reduce(heavy, craig_bampton(heavy, n_modes=4))
    found = records_of(body, modes, other, reference)
    assert found["same-body"].verdict == "fail"
    assert found["mass-properties"].verdict == "fail"
    more = reduce(body, craig_bampton(body, n_modes=5))
    assert "the mode set gives" in records_of(body, modes, more, reference)["same-body"].reason


def test_the_sign_of_an_invariant_shows_in_the_second_route(body, reference):
    modes = craig_bampton(body, n_modes=4)
    reduced = reduce(body, modes, frame=NodalFrame("left"))
    assert records_of(body, modes, reduced, reference)["invariants"].verdict == "pass"
    for name in ("C1", "P"):
        changed = np.array(getattr(reduced.moments, name))
        changed[..., 2] *= -1
        spoilt = replace(reduced, moments=replace(reduced.moments, **{name: changed}))
        assert records_of(body, modes, spoilt, reference)["invariants"].verdict == "fail"


def test_a_grounded_model_is_not_compared_as_a_free_one(body):
    dof = int(np.flatnonzero(body.dofs[:, 1] == 2)[3])
    grounded = replace(body, K=body.K + sp.csc_array(([1e7], ([dof], [dof])), shape=body.K.shape))
    modes = craig_bampton(body, n_modes=2)
    found = check_reduction(grounded, modes, reduce(body, modes))
    assert found[-2].name == "grounding"
    assert found[-2].verdict == "fail"
    assert "frequency-error" not in {r.name for r in found}


@pytest.mark.parametrize("frame", [TisserandFrame(), NodalFrame("left"), NodalFrame(), *TURNED[:2]], ids=str)
def test_modes_at_the_ends_of_a_beam_are_found_over_all_of_it(frame):
    ends = couple(beam(n=6))
    modes = craig_bampton(ends, n_modes=8)
    reduced = reduce(ends, modes, frame=frame)
    with FullReference(ends, band=300.0) as reference:
        basis = basis_of(reference, modes)
        found = full_shapes(ends, basis, reduced)
        assert found is not None
        assert_allclose(found.Phi.T @ (ends.K @ found.Phi), reduced.K, rtol=0, atol=1e-8 * reduced.K.max())
        assert found.misfit < 1e-8
        records = records_of(ends, modes, reduced, reference)
    assert records["invariants"].verdict == records["frame-condition"].verdict.replace("info", "pass") == "pass"


def test_the_default_band_is_the_highest_kept_mode_over_one_and_a_half(body):
    modes = craig_bampton(body, n_modes=6)
    reduced = reduce(body, modes)
    assert_allclose(usable_band(modes, reduced), modes.frequencies[-1] / 1.5, rtol=1e-12)
    by_name = {each.name: each for each in check_reduction(body, modes, reduced)}
    assert "this band is the default" in by_name["frequency-error"].reason
    assert "--band" in by_name["frequency-error"].reason


def test_checks_refuse_what_does_not_belong_together(body, reference):
    modes = craig_bampton(body, n_modes=2)
    reduced = reduce(body, modes)
    with pytest.raises(QualityError, match="has columns of"):
        check_reduction(couple(bar(nx=4, kind="hexahedron")), modes, reduced)
    with pytest.raises(QualityError, match="reference belongs to another body"):
        check_reduction(replace(body), modes, reduced, reference=reference)
    with pytest.raises(QualityError, match="is in units mm-t-s"):
        check_reduction(replace(body, units=unit_system("mm-t-s")), modes, reduced)
    with pytest.raises(QualityError, match="expected a frequency above 0"):
        FullReference(body, band=0.0)


def test_ritz_shapes_of_independent_columns_are_their_own_pencil(body, reference):
    rng = np.random.default_rng(2)
    X = rng.normal(size=(body.n_dof, 5))
    N = reference.families.free.N
    X -= N @ (N.T @ (body.M @ X))
    found = ritz_basis(body, X, N)
    wanted = la.eigh(X.T @ (body.K @ X), X.T @ (body.M @ X), eigvals_only=True)
    assert_allclose(found.omega2, wanted, rtol=1e-9)
    assert_allclose(found.Phi.T @ (body.M @ found.Phi), np.eye(5), rtol=0, atol=1e-10)
