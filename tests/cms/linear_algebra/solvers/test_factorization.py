import ctypes
import gc
import os
import re
import subprocess
import sys

import numpy as np
import psutil
import pytest
import scipy.linalg as la
import scipy.sparse as sp
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.testing import assert_allclose, assert_array_equal

from cms.errors import FactorizationError
from cms.linear_algebra.solvers.factorization import factorize, lower_triangle, matrix_of
from cms.linear_algebra.solvers.pardiso import CHUNK, mkl_runtime
from cms.linear_algebra.solvers.superlu import SuperLuFactor
from fe_models.body.couplings.couplings import couple
from fe_models.foundation.solver import Solver
from fe_models.foundation.sparse.submatrix import PrincipalBlock
from tests.bodies import bar
from tests.cms.linear_algebra.solvers.examples import clamped_bar
from tests.thread_ranks import ThreadRanks

HAS_PARDISO = mkl_runtime() is not None
if not HAS_PARDISO and os.environ.get("FLOATFRAME_REQUIRE_ALL") and sys.platform == "linux":
    raise RuntimeError("PARDISO is missing where nothing may skip")
BACKENDS = [
    pytest.param("pardiso", marks=pytest.mark.skipif(not HAS_PARDISO, reason="PARDISO needs MKL (x86-64)")),
    "superlu",
]
ROUNDOFF = 1e-12
both = pytest.mark.parametrize("solver", BACKENDS)


def chain(n, *, ends_held):
    """Stiffness of a chain of n masses: tridiagonal (-1, 2, -1); free at both ends unless they are held."""
    diagonal = np.full(n, 2.0)
    if not ends_held:
        diagonal[[0, -1]] = 1.0
    return sp.diags_array([diagonal, np.full(n - 1, -1.0), np.full(n - 1, -1.0)], offsets=[0, 1, -1], format="csc")


def random_symmetric(seed, n, n_negative):
    """A sparse-stored full symmetric matrix with known signs of eigenvalues of size 0.5 to 2."""
    rng = np.random.default_rng(seed)
    Q = la.qr(rng.standard_normal((n, n)))[0]
    values = rng.uniform(0.5, 2.0, n) * np.where(np.arange(n) < n_negative, -1.0, 1.0)
    A = (Q * values) @ Q.T
    return sp.csc_array((A + A.T) / 2)


@both
@pytest.mark.parametrize("definite", [True, False])
def test_a_chain_gives_the_closed_form_solution(solver, definite):
    n = 50
    i = np.arange(1, n + 1)
    inverse = np.minimum.outer(i, i) * (n + 1 - np.maximum.outer(i, i)) / (n + 1)
    with factorize(chain(n, ends_held=True), definite=definite, solver=solver) as factorization:
        assert_allclose(factorization.solve(np.eye(n)), inverse, rtol=0, atol=ROUNDOFF * inverse.max())


@both
@pytest.mark.parametrize("definite", [True, False])
def test_the_solution_of_a_solid_satisfies_its_equations(solver, definite):
    K = clamped_bar()
    b = np.random.default_rng(1).standard_normal((K.shape[0], 3))
    with factorize(K, definite=definite, solver=solver) as factorization:
        assert_allclose(K @ factorization.solve(b), b, rtol=0, atol=1e-9 * np.abs(b).max())


@pytest.mark.skipif(not HAS_PARDISO, reason="PARDISO needs MKL (x86-64)")
@pytest.mark.parametrize("definite", [True, False])
def test_both_solvers_agree(definite):
    K = clamped_bar()
    b = np.random.default_rng(2).standard_normal((K.shape[0], 4))
    x = [factorize(K, definite=definite, solver=solver).solve(b) for solver in ("pardiso", "superlu")]
    assert_allclose(x[0], x[1], rtol=0, atol=1e-8 * np.abs(x[1]).max())


@both
def test_columns_are_solved_alike_in_any_order_and_number(solver):
    K = chain(40, ends_held=True)
    b = np.random.default_rng(3).standard_normal((40, 2 * CHUNK + 3))
    kept = b.copy()
    with factorize(K, solver=solver) as factorization:
        by_one = np.stack([factorization.solve(column) for column in b.T], axis=1)
        for form in (b, np.asfortranarray(b), np.repeat(b, 2, axis=1)[:, ::2]):
            assert_allclose(factorization.solve(form), by_one, rtol=0, atol=1e-13 * np.abs(by_one).max())
        assert factorization.solve(b[:, :0]).shape == (40, 0)
        assert factorization.solve(b[:, 0]).shape == (40,)
    assert_array_equal(b, kept)


@both
@settings(derandomize=True, max_examples=15, deadline=None)
@given(seed=st.integers(0, 999), n=st.integers(1, 30), data=st.data())
def test_inertia_counts_the_signs_of_the_eigenvalues(solver, seed, n, data):
    n_negative = data.draw(st.integers(0, n))
    A = random_symmetric(seed, n, n_negative)
    factorization = factorize(A, definite=False, solver=solver)
    try:
        inertia = factorization.inertia
    except FactorizationError as error:
        if solver == "superlu" and "off the diagonal" in str(error):
            return
        raise
    assert (inertia.n_negative, inertia.n_zero, inertia.n_positive) == (n_negative, 0, n - n_negative)


@both
def test_inertia_of_a_shifted_chain_counts_its_frequencies(solver):
    n = 60
    omega2 = 2 - 2 * np.cos(np.pi * np.arange(1, n + 1) / (n + 1))
    for k in (0, 1, 7, 40):
        sigma = (omega2[k - 1] + omega2[k]) / 2 if k else omega2[0] / 2
        A = sp.csc_array(chain(n, ends_held=True) - sigma * sp.eye_array(n, format="csc"))
        assert factorize(A, definite=False, solver=solver).inertia.n_negative == k


@both
def test_a_regular_matrix_with_zero_diagonal_is_solved(solver):
    """Pivots within rounding of zero, which PARDISO cannot all avoid: refined, counted, and accepted."""
    n = 60
    A = sp.csc_array(chain(n, ends_held=True) - 2 * sp.eye_array(n, format="csc"))  # eigenvalues -2 cos(k pi / 61)
    b = np.random.default_rng(6).standard_normal(n)
    x = factorize(A, definite=False, solver=solver).solve(b)
    assert_allclose(A @ x, b, rtol=0, atol=1e-10 * np.abs(b).max())


@both
def test_multipliers_without_stored_diagonal_are_solved(solver):
    """[[K, Cᵀ], [C, 0]]: a free chain held by two constraints; the solution minimises the energy under them."""
    n = 30
    K = chain(n, ends_held=False)
    C = np.zeros((2, n))
    C[0, 0], C[1, [3, -1]] = 1.0, [1.0, -2.0]
    A = sp.csc_array(sp.block_array([[K, sp.csc_array(C.T)], [sp.csc_array(C), None]]))
    f = np.random.default_rng(4).standard_normal(n)
    N = la.null_space(C)
    expected = N @ np.linalg.solve(N.T @ K.toarray() @ N, N.T @ f)
    factorization = factorize(A, definite=False, solver=solver)
    u = factorization.solve(np.concatenate([f, np.zeros(2)]))[:n]
    assert_allclose(u, expected, rtol=0, atol=1e-11 * np.abs(expected).max())


@pytest.mark.skipif(not HAS_PARDISO, reason="PARDISO needs MKL (x86-64)")
def test_inertia_of_multipliers_counts_one_negative_each():
    K, n_c = clamped_bar(), 5
    C = sp.random_array((n_c, K.shape[0]), density=0.1, rng=np.random.default_rng(5), format="csc")
    C = sp.csc_array(C * K.diagonal().mean())
    inertia = factorize(sp.csc_array(sp.block_array([[K, C.T], [C, None]])), definite=False).inertia
    assert (inertia.n_negative, inertia.n_zero, inertia.n_positive) == (n_c, 0, K.shape[0])


@both
@pytest.mark.parametrize("definite", [True, False])
@pytest.mark.parametrize("kind", ["chain", "solid"])
def test_a_free_body_is_refused_as_singular(solver, definite, kind):
    K = chain(200, ends_held=False) if kind == "chain" else bar(nx=4).K
    with pytest.raises(FactorizationError, match="singular"):
        factorize(K, definite=definite, solver=solver)


@both
@pytest.mark.parametrize("definite", [True, False])
def test_an_unconnected_dof_is_refused_as_singular(solver, definite):
    A = sp.csc_array(sp.block_diag([chain(20, ends_held=True), np.zeros((1, 1)), chain(20, ends_held=True)]))
    with pytest.raises(FactorizationError, match="singular"):
        factorize(A, definite=definite, solver=solver)


@both
def test_a_stiff_but_regular_matrix_is_accepted(solver):
    """Condition 2e11: a long chain with a stiffness contrast, as of a thin part with stiff inserts."""
    n = 2000
    stiffness = np.where(np.arange(n + 1) % 7 == 0, 1e5, 1.0)
    D = sp.diags_array([np.ones(n), -np.ones(n)], offsets=[0, -1], shape=(n + 1, n))
    K = sp.csc_array(D.T @ sp.diags_array(stiffness) @ D)
    f = np.ones(n)
    force = np.arange(n + 1) * -1.0  # axial force up to a constant, chosen so that both ends are held
    force -= (force / stiffness).sum() / (1 / stiffness).sum()
    expected = np.cumsum(force[:-1] / stiffness[:-1])
    with factorize(K, solver=solver) as factorization:
        assert_allclose(factorization.solve(f), expected, rtol=0, atol=1e-5 * np.abs(expected).max())


@both
def test_an_indefinite_matrix_is_refused_where_a_definite_one_is_promised(solver):
    K = chain(50, ends_held=True) - 0.5 * sp.eye_array(50, format="csc")
    assert (K.diagonal() > 0).all()
    with pytest.raises(FactorizationError, match="not positive definite"):
        factorize(sp.csc_array(K), definite=True, solver=solver)
    with pytest.raises(FactorizationError, match=r"50 diagonal entries .* first at row 0"):
        factorize(sp.csc_array(-K), definite=True, solver=solver)


@both
def test_wrong_input_is_refused_in_words(solver):
    A = chain(5, ends_held=True)
    with pytest.raises(FactorizationError, match=re.escape("square matrix with at least one row, got (5, 4)")):
        factorize(A[:, :4], solver=solver)
    with pytest.raises(FactorizationError, match="NaN"):
        factorize(A * np.nan, solver=solver)
    factorization = factorize(A, solver=solver)
    with pytest.raises(FactorizationError, match=re.escape("expected right-hand sides (5,) or (5, k), got (6,)")):
        factorization.solve(np.ones(6))
    factorization.close()
    factorization.close()
    with pytest.raises(FactorizationError, match="closed"):
        factorization.solve(np.ones(5))


def test_only_the_lower_triangle_is_read_and_duplicates_are_summed():
    A = sp.csc_array(np.array([[4.0, 9.0, 0.0], [1.0, 0.0, 7.0], [0.0, 2.0, 5.0]]))
    assert_array_equal(lower_triangle(A).toarray(), np.tril(A.toarray()))
    assert lower_triangle(A).nnz == 5  # the missing diagonal entry is stored
    twice = sp.coo_array(([1.0, 2.0, 3.0, 4.0], ([1, 0, 1, 1], [0, 0, 0, 1])), shape=(2, 2))
    split = sp.csc_array((twice.data[[1, 2, 0, 3]], twice.row[[1, 2, 0, 3]], [0, 3, 4]), shape=(2, 2))
    assert_array_equal(lower_triangle(split).toarray(), [[2.0, 0.0], [4.0, 4.0]])
    assert split.nnz == 4  # the argument is left as it was


@both
def test_the_description_names_solver_and_version(solver):
    text = factorize(chain(5, ends_held=True), solver=solver).description
    assert re.match(r"(PARDISO \(MKL|SuperLU \(SciPy) \d", text)


def held():
    """Return the memory this process holds; what is freed but kept by the allocator for later use goes back first."""
    gc.collect()
    if trim := getattr(ctypes.CDLL(None), "malloc_trim", None):  # of glibc
        trim(0)
    return psutil.Process().memory_info().rss


@both
@pytest.mark.parametrize("way", ["close", "drop"])
def test_freed_factors_leave_no_memory_behind(solver, way):
    n = 17
    D = sp.csc_array(chain(n, ends_held=True))
    E = sp.eye_array(n, format="csc")
    A = sp.csc_array(sp.kron(sp.kron(D, E), E) + sp.kron(sp.kron(E, D), E) + sp.kron(sp.kron(E, E), D))

    def once():
        factorization = factorize(A, solver=solver)
        if way == "close":
            factorization.close()
        return factorization.n_factor_entries if solver == "pardiso" else 0

    factor_bytes = 8 * once()
    for _ in range(3):
        once()
    before = held()
    for _ in range(8):
        once()
    grown = held() - before
    assert grown < 2 * max(factor_bytes, 10e6)  # eight leaked factors would be four times that


@pytest.mark.skipif(not HAS_PARDISO, reason="PARDISO needs MKL (x86-64)")
def test_bitwise_mode_repeats_every_bit_in_a_new_process():
    script = """
import hashlib, numpy as np
from tests.cms.linear_algebra.solvers.test_factorization import clamped_bar
from cms.linear_algebra.solvers.factorization import factorize
K = clamped_bar()
f = factorize(K)
assert "bitwise" in f.description, f.description
print(hashlib.sha256(f.solve(np.random.default_rng(0).standard_normal((K.shape[0], 9))).tobytes()).hexdigest())
"""
    environment = {**os.environ, "MKL_CBWR": "COMPATIBLE"}
    runs = [
        subprocess.run([sys.executable, "-c", script], env=environment, capture_output=True, text=True, check=True)
        for _ in range(2)
    ]
    assert runs[0].stdout == runs[1].stdout
    assert len(runs[0].stdout.strip()) == 64


def test_rows_on_many_ranks_stay_there_for_a_solver_that_takes_them():
    """Upper triangles of what the ranks keep are put together and factorised by another solver."""
    body = couple(bar(nx=4, kind="hexahedron", ranks=ThreadRanks(2)))
    A = PrincipalBlock(body.K, body.K.ordered(body.i))
    seen = []

    def of_rows(block, *, definite):
        block.keep("rows", upper=True)
        kept = [store.pop("rows") for store in body.K.ranks.stores]
        seen.extend(len(own.indptr) - 1 for own in kept)
        parts = [sp.csr_array((o.data, o.indices, o.indptr), shape=(len(o.indptr) - 1, block.rows.n)) for o in kept]
        return SuperLuFactor(sp.csc_array(sp.vstack(parts).T), definite=definite)

    def of_the_whole(lower, *, definite):
        raise AssertionError("the matrix was cut out on rank 0")

    with factorize(A, solver=Solver("of rows", of_the_whole, spread=of_rows)) as factorization:
        x = factorization.solve(np.ones(len(A.index)))
    assert sum(seen) == len(A.index)
    assert min(seen) > 0
    assert_allclose(matrix_of(A) @ x, 1.0, rtol=0, atol=1e-8)


def test_a_spread_matrix_that_is_not_definite_is_refused():
    spread = couple(bar(nx=4, kind="hexahedron", ranks=ThreadRanks(2))).K
    spread._diagonal = -spread.diagonal()
    A = PrincipalBlock(spread, spread.order)
    with pytest.raises(FactorizationError, match=r"^factorize: \d+ diagonal entries are zero or negative"):
        factorize(A, solver=Solver("of rows", SuperLuFactor, spread=SuperLuFactor))
