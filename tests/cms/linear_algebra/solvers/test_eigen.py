from dataclasses import replace

import numpy as np
import pytest
import scipy.linalg as la
import scipy.sparse as sp
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.testing import assert_allclose, assert_array_equal

import cms.linear_algebra.solvers.mode_search
from cms.errors import EigenError, FactorizationError
from cms.linear_algebra.solvers.eigen import eigenmodes
from cms.linear_algebra.solvers.factorization import factorize, matrix_of
from cms.linear_algebra.solvers.mode_count import ModeCount
from cms.linear_algebra.solvers.mode_search import BlockLanczos, improved_modes
from cms.linear_algebra.solvers.pardiso import mkl_runtime
from cms.linear_algebra.solvers.shift_inverted import ArraySpace, ShiftInverted, measured_residual
from fe_models.body.couplings.couplings import couple
from fe_models.foundation.sparse.sparse_product import SymmetricProduct
from fe_models.foundation.sparse.submatrix import PrincipalBlock
from tests.bodies import STEEL, bar, beam

ROUNDOFF = 1e-12
TOLERANCE = 1e-5  # default of eigenmodes; omega² is exact to its square


def lattice(*sizes, ends_held=True):
    """K of a lattice of unit masses and springs, all ends held or free; omega² = sum of the chains' omega²."""
    K = sp.csc_array((1, 1))
    levels = np.zeros(1)
    for n in sizes:
        diagonal = np.full(n, 2.0)
        if not ends_held:
            diagonal[[0, -1]] = 1.0
        D = sp.diags_array([diagonal, np.full(n - 1, -1.0), np.full(n - 1, -1.0)], offsets=[0, 1, -1])
        K = sp.kron(K, sp.eye_array(n)) + sp.kron(sp.eye_array(K.shape[0]), D)
        k = np.arange(1, n + 1) / (n + 1) if ends_held else np.arange(n) / n
        levels = np.add.outer(levels, 2 - 2 * np.cos(np.pi * k)).ravel()
    return sp.csc_array(K), sp.eye_array(K.shape[0], format="csc"), np.sort(levels)


def hertz(omega2):
    return np.sqrt(omega2) / (2 * np.pi)


def assert_modes(K, M, result, omega2, *, tolerance=TOLERANCE, shift=0.0):
    """Frequencies as given, K x = omega² M x to the tolerance (after a solve: the natural residual), Phiᵀ M Phi = 1."""
    k = len(omega2)
    scale = np.abs(omega2 - shift)
    assert_allclose(result.omega2, omega2, rtol=1e-9, atol=1e-9 * scale.max(initial=1.0) * 1e-3)
    assert_array_equal(result.frequencies, np.sqrt(result.omega2) / (2 * np.pi))
    assert result.residuals.shape == (k,)
    assert (result.residuals <= tolerance).all()
    assert_allclose(result.Phi.T @ (M @ result.Phi), np.eye(k), rtol=0, atol=ROUNDOFF)


def natural_residuals(K, M, result, shift):
    """|x - (omega² - shift) (K - shift M)⁻¹ M x|_M, by a factorisation of its own."""
    factorization = factorize(sp.csc_array(K - shift * M), definite=False, solver="superlu")
    r = result.Phi - factorization.solve(M @ result.Phi) * (result.omega2 - shift)
    return np.sqrt(np.maximum(np.einsum("nk,nk->k", r, M @ r), 0.0))


@pytest.mark.parametrize(("sizes", "n_modes"), [((400,), 7), ((40, 31), 25), ((14, 12, 10), 40), ((30,), 12)])
def test_a_lattice_has_its_closed_form_frequencies(sizes, n_modes):
    K, M, omega2 = lattice(*sizes)
    assert_modes(K, M, eigenmodes(K, M, n_modes=n_modes, factorization=factorize(K)), omega2[:n_modes])


@pytest.mark.parametrize(("sizes", "n_modes"), [((400,), 7), ((40, 31), 25), ((14, 12, 10), 40), ((10, 10, 10), 22)])
def test_guard_modes_are_the_next_ones_as_far_as_they_are_resolved(sizes, n_modes):
    K, M, omega2 = lattice(*sizes)
    result = eigenmodes(K, M, n_modes=n_modes, factorization=factorize(K))
    guards = result.guards
    n_resolved = int((omega2 < (2 * np.pi * guards.resolved_to) ** 2).sum())
    assert n_modes < n_resolved <= n_modes + len(guards.frequencies) == n_modes + guards.Phi.shape[1]
    following = slice(0, n_resolved - n_modes)
    assert_allclose(guards.frequencies[following], hertz(omega2[n_modes:n_resolved]), rtol=1e-4)
    joined = np.hstack([result.Phi, guards.Phi])
    assert_allclose(joined.T @ (M @ joined), np.eye(joined.shape[1]), rtol=0, atol=ROUNDOFF)
    part = eigenmodes(K, M, n_modes=n_modes + 30, factorization=factorize(K)).first(n_modes)
    assert_allclose(part.guards.frequencies, hertz(omega2[n_modes : n_modes + part.guards.Phi.shape[1]]), rtol=1e-9)
    assert part.guards.resolved_to >= guards.resolved_to * (1 - 1e-3)


@pytest.mark.parametrize("n_modes", [3, 11, 20, 33])
def test_multiple_modes_are_found_completely(n_modes):
    """A cube: triple and sextuple modes; some of these counts cut through one."""
    K, M, omega2 = lattice(10, 10, 10)
    result = eigenmodes(K, M, n_modes=ModeCount(n_modes, verify=True))
    assert_modes(K, M, result, omega2[:n_modes])
    assert result.is_proven


def test_a_mode_of_higher_multiplicity_than_the_block_is_found_completely():
    """450 equal oscillators of three frequencies: the Krylov space of one block ends after three steps."""
    omega2 = np.repeat([1.0, 2.0, 5.0], 150)
    K, M = sp.diags_array(omega2, format="csc"), sp.eye_array(450, format="csc")
    assert_modes(K, M, eigenmodes(K, M, n_modes=ModeCount(20, verify=True)), omega2[:20])
    assert_modes(K, M, eigenmodes(K, M, n_modes=ModeCount(cutoff=hertz(1.5), verify=True)), omega2[:150])


def test_a_free_lattice_has_a_rigid_mode_of_frequency_zero():
    K, M, omega2 = lattice(20, 20, ends_held=False)
    result = eigenmodes(K, M, n_modes=9)
    assert_modes(K, M, result, omega2[:9])
    assert result.frequencies[0] == 0
    assert_allclose(result.Phi[:, 0], 1 / 20, rtol=1e-9, atol=0)


@pytest.mark.parametrize("kind", ["hexahedron20", "tetra10"])
def test_a_free_solid_has_six_rigid_modes_and_the_elastic_ones_of_a_dense_solver(kind):
    body = bar(nx=9, kind=kind)
    assert body.n_dof > 300
    result = eigenmodes(body.K, body.M, n_modes=ModeCount(20, verify=True))
    dense = la.eigh(body.K.toarray(), body.M.toarray(), eigvals_only=True)
    assert_array_equal(result.omega2[:6], 0)
    assert_allclose(result.omega2[6:], dense[6:20], rtol=1e-8, atol=0)
    force = body.K @ result.Phi[:, :6]
    assert_allclose(force, 0, rtol=0, atol=1e-10 * np.abs(body.K.data).max() * np.abs(result.Phi).max())


def test_a_clamped_beam_has_the_textbook_frequencies():
    """cos b cosh b = -1 (Euler-Bernoulli); the element is exact to fourth order in its length."""
    E, rho, A, I_y, I_z = 2.1e11, 7850.0, 1e-4, 1e-9, 2e-9
    body = beam(n=60)
    free = np.arange(6, body.n_dof)
    K, M = body.K[free][:, free], body.M[free][:, free]
    b = np.array([1.8751040687119611, 4.694091132974174, 7.854757438237613])
    expected = np.sort(np.concatenate([b**2 * np.sqrt(E * I_b / (rho * A)) for I_b in (I_y, I_z)])) / (2 * np.pi)
    result = eigenmodes(K, M, n_modes=ModeCount(cutoff=1.01 * expected[-1]))
    is_bending = np.abs(result.Phi[1::6]).max(axis=0) + np.abs(result.Phi[2::6]).max(axis=0) > 1e-6
    assert_allclose(result.frequencies[is_bending], expected, rtol=2e-6, atol=0)


def test_a_square_bar_has_its_bending_modes_in_pairs():
    body = bar(nx=20, width=0.05, height=0.05, length=1.0)
    held = np.flatnonzero(body.nodes[body.dofs[:, 0], 0] > 0)
    result = eigenmodes(body.K[held][:, held], body.M[held][:, held], n_modes=ModeCount(4, verify=True))
    f = result.frequencies
    assert_allclose(f[[1, 3]], f[[0, 2]], rtol=1e-9, atol=0)
    exact = 1.8751040687119611**2 * np.sqrt(STEEL.E * 0.05**2 / (12 * STEEL.rho)) / (2 * np.pi)
    assert_allclose(f[0], exact, rtol=0.01, atol=0)


@st.composite
def pencils(draw):
    """Dense random pencils in a sparse shell: sizes on both roads, multiple and zero frequencies, massless dofs."""
    rng = np.random.default_rng(draw(st.integers(0, 10**6)))
    n = draw(st.sampled_from([12, 60, 310, 330]))
    n_massless = draw(st.sampled_from([0, 0, n // 5]))
    n_rigid = draw(st.sampled_from([0, 0, 6]))
    r = n - n_massless
    omega2 = np.sort(rng.uniform(1.0, 3.0, r) ** 6)
    multiplicity = draw(st.sampled_from([1, 1, 2, 5]))
    omega2 = omega2[np.arange(r) // multiplicity * multiplicity]
    omega2[:n_rigid] = 0.0
    # K = Pᵀ diag(omega², stiff) P, M = Pᵀ diag(1, 0) P
    P = la.qr(rng.standard_normal((n, n)))[0] * rng.uniform(0.5, 2.0, n)
    K = (P.T * np.concatenate([omega2, np.full(n_massless, 50.0)])) @ P
    M = (P.T * np.concatenate([np.ones(r), np.zeros(n_massless)])) @ P
    return sp.csc_array((K + K.T) / 2), sp.csc_array((M + M.T) / 2), omega2, n_rigid


@settings(derandomize=True, max_examples=20, deadline=None)
@given(pencil=pencils(), data=st.data())
def test_random_pencils_have_the_frequencies_they_were_made_of(pencil, data):
    K, M, omega2, n_rigid = pencil
    n_modes = data.draw(st.integers(1, min(len(omega2), 60)))
    result = eigenmodes(K, M, n_modes=n_modes)
    assert_allclose(result.omega2, omega2[:n_modes], rtol=1e-8, atol=1e-9 * omega2[n_rigid])
    assert_array_equal(result.omega2[:n_rigid], 0)
    assert_allclose(result.Phi.T @ (M @ result.Phi), np.eye(n_modes), rtol=0, atol=1e-10)
    defect = K @ result.Phi - M @ result.Phi * result.omega2
    assert_allclose(defect, 0, rtol=0, atol=1e-5 * np.abs(K @ result.Phi).max() + 1e-9 * np.abs(K.data).max())


def test_all_modes_of_a_small_pencil_are_found():
    K, M, omega2 = lattice(25)
    assert_modes(K, M, eigenmodes(K, M, n_modes=25), omega2)


@pytest.mark.parametrize("sizes", [(7, 6), (17, 11, 9)])
def test_a_cutoff_takes_all_modes_below_it_and_no_other(sizes):
    K, M, omega2 = lattice(*sizes)
    for count in (1, 4, 9, 23):
        for cutoff in (hertz(omega2[count - 1]) * (1 + 1e-9), hertz((omega2[count - 1] + omega2[count]) / 2)):
            expected = omega2[hertz(omega2) <= cutoff]
            result = eigenmodes(K, M, n_modes=ModeCount(cutoff=cutoff, verify=True))
            assert len(result.omega2) == len(expected)
            assert_modes(K, M, result, expected)
            assert result.is_proven


@pytest.mark.parametrize("sizes", [(7, 6), (17, 11, 9)])
def test_a_cutoff_below_the_first_mode_gives_none(sizes):
    K, M, omega2 = lattice(*sizes)
    result = eigenmodes(K, M, n_modes=ModeCount(cutoff=0.9 * hertz(omega2[0]), verify=True))
    assert result.Phi.shape == (K.shape[0], 0)
    assert result.is_proven


def test_a_cutoff_far_up_grows_the_basis():
    K, M, omega2 = lattice(60, 50)
    count = 150
    result = eigenmodes(K, M, n_modes=ModeCount(cutoff=hertz((omega2[count - 1] + omega2[count]) / 2)))
    assert_modes(K, M, result, omega2[:count])


def test_restarts_keep_the_modes(monkeypatch):
    K, M, omega2 = lattice(40, 40)
    unrestarted = eigenmodes(K, M, n_modes=20)
    monkeypatch.setattr("cms.linear_algebra.solvers.mode_search.basis_size", lambda k, block: k + 24)
    result = eigenmodes(K, M, n_modes=ModeCount(20, verify=True))
    assert result.n_solves > unrestarted.n_solves
    assert_modes(K, M, result, omega2[:20])


def test_a_restart_changes_no_leading_ritz_pair():
    K, M, _ = lattice(40, 40)
    lanczos = BlockLanczos(factorize(K).solve, SymmetricProduct(M), ArraySpace(K.shape[0]), block=4, capacity=60)
    for _ in range(12):
        lanczos.advance()
    before = lanczos.ritz()
    lanczos.restart(before, 20)
    after = lanczos.ritz()
    assert_allclose(after.theta, before.theta[:20], rtol=ROUNDOFF, atol=0)
    assert_allclose(after.residuals, before.residuals[:20], rtol=1e-8, atol=ROUNDOFF)
    assert_allclose(lanczos.V.T @ (M @ lanczos.V), np.eye(20), rtol=0, atol=ROUNDOFF)
    S_V = factorize(K).solve(M @ lanczos.V)
    true = np.linalg.norm(S_V - lanczos.V * after.theta, axis=0) / after.theta
    assert_allclose(after.residuals, true, rtol=1e-6, atol=1e-11)


def test_a_part_of_a_body_has_the_modes_of_the_matrix_cut_out():
    K, M, _ = lattice(20, 20)
    index = np.random.default_rng(0).permutation(400)[:350]
    K_part, M_part = PrincipalBlock(K, index), PrincipalBlock(M, index)
    cut, part = (
        eigenmodes(A, B, 9, factorization=factorize(A))
        for A, B in ((matrix_of(K_part), matrix_of(M_part)), (K_part, M_part))
    )
    assert_array_equal(part.Phi, cut.Phi)
    assert_array_equal(part.omega2, cut.omega2)


def test_multipliers_constrain_the_modes():
    """A free chain held by multipliers at both ends is the held chain of two masses less."""
    n = 400
    K, M, _ = lattice(n, ends_held=False)
    C = sp.csc_array((np.ones(2), ([0, 1], [0, n - 1])), shape=(2, n))
    A = sp.csc_array(sp.block_array([[K, C.T], [C, None]]))
    B = sp.csc_array(sp.block_diag([M, sp.csc_array((2, 2))]))
    _, _, omega2 = lattice(n - 2)
    factorization = factorize(A, definite=False)
    for result in (
        eigenmodes(A, B, n_modes=ModeCount(9, verify=mkl_runtime() is not None), factorization=factorization),
        eigenmodes(A, B, n_modes=9),
    ):
        assert_modes(A, B, result, omega2[:9])
        assert_allclose(result.Phi[[0, n - 1]], 0, rtol=0, atol=1e-9)
        # the multipliers are the reactions: K x + Cᵀ lambda = omega² M x
        defect = A @ result.Phi - B @ result.Phi * result.omega2
        assert_allclose(defect, 0, rtol=0, atol=1e-6)


def test_a_distributing_interface_gives_the_modes_of_the_dense_pencil_on_its_constraints():
    body = bar(nx=4, kind="hexahedron20")
    body = couple(replace(body, interfaces=tuple(replace(i, kind="distributing") for i in body.interfaces)))
    i = body.i
    K, M = body.K[i][:, i], body.M[i][:, i]
    is_multiplier = body.dofs[i, 1] < 0
    N = la.null_space(K[is_multiplier][:, ~is_multiplier].toarray())
    K_N, M_N = (N.T @ A[~is_multiplier][:, ~is_multiplier].toarray() @ N for A in (K, M))
    expected = la.eigh((K_N + K_N.T) / 2, (M_N + M_N.T) / 2, eigvals_only=True)[:10]
    result = eigenmodes(K, M, n_modes=10, factorization=factorize(K, definite=False))
    assert_allclose(result.omega2, expected, rtol=1e-7, atol=0)


def test_massless_dofs_follow_statically():
    """Every second mass of a chain removed: as many modes as masses, the pencil of the condensed chain."""
    n = 801
    K, _, _ = lattice(n)
    M = sp.diags_array((np.arange(n) % 2 == 1).astype(float), format="csc")
    # between neighbours two springs in series: stiffness 1/2
    _, _, omega2 = lattice(n // 2)
    result = eigenmodes(K, M, n_modes=ModeCount(12, verify=True))
    assert_modes(K, M, result, omega2[:12] / 2)


@pytest.mark.parametrize("n", [40, 500])
def test_more_modes_than_masses_are_refused_with_their_number(n):
    K, _, _ = lattice(n)
    M = sp.diags_array((np.arange(n) < 5).astype(float), format="csc")
    assert len(eigenmodes(K, M, n_modes=5).omega2) == 5
    with pytest.raises(EigenError, match="only 5 modes have mass; choose n_modes <= 5"):
        eigenmodes(K, M, n_modes=6)


def test_wrong_requests_are_refused_in_words():
    K, M, _ = lattice(30)
    with pytest.raises(EigenError, match="n_modes = 31, but there are 30 dofs; choose n_modes <= 30"):
        eigenmodes(K, M, n_modes=31)
    with pytest.raises(EigenError, match="n_modes = 0; expected at least 1"):
        eigenmodes(K, M, n_modes=0)
    with pytest.raises(EigenError, match=r"one square shape, got \(30, 30\) and \(29, 29\)"):
        eigenmodes(K, M[:29, :29], n_modes=3)
    with pytest.raises(EigenError, match="expected order 30, got 5"):
        eigenmodes(K, M, n_modes=3, factorization=factorize(lattice(5)[0]))


@pytest.mark.parametrize("n", [50, 600])
def test_a_foreign_factorisation_is_noticed(n):
    K, M, _ = lattice(n)
    foreign = factorize(sp.csc_array(K + sp.diags_array(0.1 * (np.arange(n) % 3 == 0))))
    with pytest.raises(EigenError, match="factorisation of K - shift M"):
        eigenmodes(K, M, n_modes=5, factorization=foreign)


@pytest.mark.parametrize("n", [50, 600])
def test_negative_energy_is_refused(n):
    K, M, omega2 = lattice(n)
    K = sp.csc_array(K - (omega2[0] + omega2[1]) / 2 * M)
    with pytest.raises(EigenError, match="below the shift"):
        eigenmodes(K, M, n_modes=5, factorization=factorize(K, definite=False))
    with pytest.raises((EigenError, FactorizationError), match=r"negative|definite"):
        eigenmodes(K, M, n_modes=5)


def test_a_missed_mode_is_noticed(monkeypatch):
    """An iteration blind to one symmetry class never finds its modes; the inertia does."""
    K, M, _ = lattice(900)
    solve = ShiftInverted.solve

    def symmetric_part(operator, b):
        x = solve(operator, b)
        return (x + x[::-1]) / 2

    monkeypatch.setattr(ShiftInverted, "solve", symmetric_part)
    with pytest.raises(EigenError, match="inertia counts"):
        eigenmodes(K, M, n_modes=ModeCount(6, verify=True))


def test_an_unreachable_tolerance_is_refused(monkeypatch):
    K, M, _ = lattice(30, 30)
    with pytest.raises(EigenError, match=r"tolerance = 1e-18; expected 1e-13 to 0.1"):
        eigenmodes(K, M, n_modes=5, tolerance=1e-18)
    monkeypatch.setattr("cms.linear_algebra.solvers.mode_search.MOST_COLUMNS", 0.3)
    with pytest.raises(EigenError, match=r"no convergence after \d+ columns; allow a larger tolerance"):
        eigenmodes(K, M, n_modes=5, tolerance=1e-12)


def noisy(monkeypatch, name, noise):
    """Let cms.linear_algebra.solvers.mode_search.<name> see another operator than the iteration before it."""
    function = getattr(cms.linear_algebra.solvers.mode_search, name)
    solve = ShiftInverted.solve
    rng = np.random.default_rng(0)

    def with_a_noisy_solver(operator, *args):
        with monkeypatch.context() as patch:
            patch.setattr(
                ShiftInverted, "solve", lambda operator, b: solve(operator, b) * (1 + noise * rng.normal(size=b.shape))
            )
            return function(operator, *args)

    monkeypatch.setattr(cms.linear_algebra.solvers.mode_search, name, with_a_noisy_solver)


@pytest.mark.parametrize("last_step", ["measured_residual", "refined_modes"])
def test_residuals_that_solves_leave_above_the_tolerance_are_refused(monkeypatch, last_step):
    """The recurrence converges on the operator it is given; the last step sees another one."""
    K, M, _ = lattice(30, 30)
    if last_step == "refined_modes":
        M = sp.csc_array(M - sp.diags_array((np.arange(900) == 7).astype(float)))
    noisy(monkeypatch, last_step, 1e-4)
    with pytest.raises(EigenError, match=r"residuals stay at .*e-0[345], expected 1.0e-05; .* too ill-conditioned"):
        eigenmodes(K, M, n_modes=5)


@pytest.fixture
def advanced():
    """A pencil, its operator, and a Krylov basis in which four modes have converged to 1e-4 or so."""
    K, M, _ = lattice(23, 21, 4)
    M = sp.csc_array(M * 2.0 + sp.diags_array(np.linspace(0, 1, M.shape[0])))
    operator = ShiftInverted(M, 0.0, factorize(K), TOLERANCE)
    lanczos = BlockLanczos(operator.solve, operator.M_product, operator.space, block=4, capacity=60)
    for _ in range(7):
        lanczos.advance()
    return K, M, operator, lanczos


def test_the_recurrence_gives_the_inverse_iteration_without_a_solve(advanced):
    K, M, operator, lanczos = advanced
    ritz = lanczos.ritz()
    X = lanczos.V @ ritz.S
    Y = lanczos.V_and_next @ np.concatenate([ritz.S, ritz.coupling / ritz.theta])
    assert_allclose(Y, operator.solve(M @ X) / ritz.theta, rtol=0, atol=1e-11 * np.abs(Y).max())
    modes = improved_modes(lanczos, ritz, 4, 0.0)
    Phi = modes.Y @ modes.Z
    p = len(modes.omega2)
    assert p > 4
    assert_allclose(Phi.T @ (M @ Phi), np.eye(p), rtol=0, atol=ROUNDOFF)
    assert_allclose(Phi.T @ (K @ Phi), np.diag(modes.omega2), rtol=0, atol=ROUNDOFF * modes.omega2[-1])
    exact = la.eigh(K.toarray(), M.toarray(), eigvals_only=True)[:4]
    before, after = 1 / ritz.theta[:4] - exact, modes.omega2[:4] - exact
    assert (before > 1e-12).all()  # both are upper bounds, the second is nearer
    assert (after > -ROUNDOFF).all()
    assert (after < 0.7 * before).all()


def test_few_columns_measure_all_residuals_together(advanced):
    _, M, operator, lanczos = advanced
    modes = improved_modes(lanczos, lanczos.ritz(), 12, 0.0)
    n_before = operator.n_solves
    residual, defect = measured_residual(operator, modes)
    assert operator.n_solves == n_before + 4
    Phi = (modes.Y @ modes.Z)[:, :12]
    r = Phi - operator.solve(M @ Phi) * modes.omega2[:12]
    true = np.sqrt(np.einsum("nk,nk->", r, M @ r))
    assert 0.6 * true < residual < 1.6 * true
    assert 0.1 * defect < residual < 10 * defect


def test_rounding_without_mass_is_taken_out_by_a_solve(monkeypatch):
    """M is semidefinite without an empty row: each pair of dofs shares one mass, its difference has none."""
    n = 400
    K, _, _ = lattice(2 * n)
    M = sp.csc_array(sp.kron(sp.eye_array(n), np.full((2, 2), 0.25)))
    T = sp.kron(sp.eye_array(n), [[1.0], [1.0]])  # the difference follows statically; condense it
    N = sp.kron(sp.eye_array(n), [[1.0], [-1.0]])
    K_nt = (N.T @ K @ T).toarray()
    condensed = (T.T @ K @ T).toarray() - K_nt.T @ np.linalg.solve((N.T @ K @ N).toarray(), K_nt)
    exact = la.eigh(condensed, np.eye(n), eigvals_only=True)[:10]
    n_solves = []
    for defect in (0.0, 1e-3):
        monkeypatch.setattr(
            "cms.linear_algebra.solvers.mode_search.measured_residual", lambda *_, defect=defect: (0.0, defect)
        )
        result = eigenmodes(K, M, n_modes=10, factorization=factorize(K))
        assert_modes(K, M, result, exact)
        difference = N.T @ K @ result.Phi
        assert_allclose(difference, 0, rtol=0, atol=1e-10 * np.abs(result.Phi).max())
        n_solves.append(result.n_solves)
    assert n_solves[1] >= n_solves[0] + 10  # one more solve for every mode


@pytest.mark.parametrize("tolerance", [1e-3, 1e-6, 1e-9])
def test_the_tolerance_is_met_by_the_residuals_of_the_result(tolerance):
    K, M, omega2 = lattice(23, 21, 4)
    result = eigenmodes(K, M, n_modes=15, tolerance=tolerance, factorization=factorize(K))
    assert (natural_residuals(K, M, result, 0.0) <= tolerance).all()
    assert_allclose(result.omega2, omega2[:15], rtol=max(10 * tolerance**2, 1e-11), atol=0)


def test_a_tighter_tolerance_costs_more_solves():
    K, M, _ = lattice(40, 31)
    n_solves = [eigenmodes(K, M, n_modes=15, tolerance=tolerance).n_solves for tolerance in (1e-2, 1e-5, 1e-10)]
    assert n_solves == sorted(n_solves)
    assert n_solves[0] < n_solves[-1]


def test_two_runs_agree():
    K, M, _ = lattice(12, 12, 12)
    first, second = (eigenmodes(K, M, n_modes=20) for _ in range(2))
    assert_allclose(second.omega2, first.omega2, rtol=1e-10, atol=0)
    assert_allclose(second.Phi, first.Phi, rtol=0, atol=1e-10 * np.abs(first.Phi).max())


@pytest.mark.skipif(mkl_runtime() is None, reason="PARDISO needs MKL (x86-64)")
def test_both_solvers_give_the_same_modes_with_the_same_signs():
    body = bar(nx=6, kind="tetra10")
    held = np.flatnonzero(body.nodes[body.dofs[:, 0], 0] > 0)
    K, M = body.K[held][:, held], body.M[held][:, held]
    first = eigenmodes(K, M, n_modes=12, factorization=factorize(K))
    second = eigenmodes(K, M, n_modes=12, factorization=factorize(K, solver="superlu"))
    assert_allclose(second.omega2, first.omega2, rtol=1e-8, atol=0)
    assert_allclose(second.Phi, first.Phi, rtol=0, atol=1e-6 * np.abs(first.Phi).max())
    assert "SuperLU" in second.method
    assert "PARDISO" in first.method


def test_progress_rises_to_the_wanted_number():
    K, M, _ = lattice(40, 31)
    calls = []
    eigenmodes(K, M, n_modes=15, progress=lambda *found_and_wanted: calls.append(found_and_wanted))
    assert {wanted for _, wanted in calls} == {15}
    assert calls[-1][0] >= 15


def test_a_given_shift_changes_nothing_but_the_road():
    K, M, omega2 = lattice(30, 20)
    for shift in (0.0, -0.5, 0.9 * omega2[0]):
        result = eigenmodes(K, M, n_modes=ModeCount(8, verify=True), shift=shift)
        assert_modes(K, M, result, omega2[:8], shift=shift)


def test_a_search_starts_alike_whatever_the_order_of_the_rows():
    """Modes of one body in two orders of its dofs then differ by rounding, not by the tolerance of the search."""
    body = couple(bar(nx=16, ny=2, nz=2, kind="hexahedron"))
    i = body.i
    turned = np.random.default_rng(0).permutation(len(i))
    one, other, otherwise = (
        eigenmodes(
            PrincipalBlock(body.K, index), PrincipalBlock(body.M, index), 6, factorization=factor, numbering=numbering
        ).Phi
        for index, numbering in ((i, None), (i[turned], turned), (i[turned], None))
        for factor in (factorize(PrincipalBlock(body.K, index)),)
    )

    def difference(Phi):
        Phi = Phi[np.argsort(turned)]
        return np.abs(Phi * np.sign((Phi * one).sum(axis=0)) - one).max() / np.abs(one).max()

    assert difference(other) < 1e-9 < 1e-8 < difference(otherwise)


@pytest.mark.parametrize("n_masses", [9, 17])
def test_a_last_block_that_brings_nothing_ends_the_search(n_masses):
    """Point masses on massless structure: the operator reaches as many directions as there are masses."""
    n = 4000
    K = sp.diags_array([-np.ones(n - 1), np.full(n, 2.0), -np.ones(n - 1)], offsets=[-1, 0, 1]).tocsc()
    m = np.zeros(n)
    m[np.linspace(100, 3900, n_masses).astype(int)] = 1.0
    held = np.flatnonzero(m)
    flexibility = sp.linalg.splu(K).solve(np.eye(n)[:, held])[held]
    found = eigenmodes(K, sp.diags_array(m).tocsc(), 3, shift=-1e-6)
    assert_allclose(found.omega2, 1 / la.eigvalsh(flexibility)[::-1][:3], rtol=1e-8)
