"""The columns of an iteration on ranks beside arrays, with ranks that are threads and a solver of one process."""

import gc
from types import SimpleNamespace

import numpy as np
import pytest
import scipy.sparse as sp
from numpy.testing import assert_allclose, assert_array_equal

from cms.linear_algebra.solvers.factorization import factorize
from cms.linear_algebra.solvers.mode_search import BlockLanczos
from cms.linear_algebra.solvers.shift_inverted import ArraySpace
from cms.linear_algebra.solvers.slepc_modes import RankSpace
from fe_models.body.couplings.couplings import couple
from fe_models.foundation.ranks.rows import collected, even_rows, own_rows
from fe_models.foundation.sparse.submatrix import PrincipalBlock, spread_block
from fe_models.foundation.tall.columns import combine, inner, put, subtract
from tests.bodies import bar
from tests.thread_ranks import ThreadRanks

N = 97


@pytest.fixture
def pencil():
    K = sp.csc_array(sp.diags_array([np.full(N, 2.0), np.full(N - 1, -1.0), np.full(N - 1, -1.0)], offsets=[0, 1, -1]))
    M = sp.csc_array(K.multiply(0.1) + sp.diags_array(np.linspace(1.0, 2.0, N)))
    return K, M, factorize(K, solver="superlu")


class Stand:
    """What a space asks of the factor on ranks."""

    def __init__(self, size, K):
        self.ranks, self.rows, self.n, self.key = ThreadRanks(size), even_rows(K.indptr, size), N, "factor"


@pytest.fixture(params=[1, 2, 3])
def space(request, pencil, monkeypatch):
    K, _, factorization = pencil
    solve = factorization.factor.solve

    def solved(ranks, key, rows, own):
        b = collected(ranks, rows, own)
        return own_rows(ranks, rows, None if b is None else solve(b))

    monkeypatch.setattr("cms.linear_algebra.solvers.slepc_modes.solved_rows", solved)
    monkeypatch.setattr(factorization, "factor", Stand(request.param, K))
    return RankSpace(factorization.factor)


def test_columns_on_ranks_are_combined_as_arrays(space):
    here, a, b = ArraySpace(N), np.random.default_rng(0), np.random.default_rng(0)
    X, Y = (here.random(a, k) for k in (3, 5))
    X_r, Y_r = (space.random(b, k) for k in (3, 5))
    C = a.standard_normal((3, 5))
    assert_allclose(inner(X_r, Y_r), X.T @ Y, rtol=0, atol=1e-12)
    assert_array_equal(X_r.whole(), X)
    assert_allclose(combine(X_r, C).whole(), X @ C, rtol=0, atol=1e-13)
    X_r *= np.array([2.0, -1.0, 0.5])
    subtract(Y_r, X_r, C)
    assert_allclose(Y_r.whole(), Y - X * [2.0, -1.0, 0.5] @ C, rtol=0, atol=1e-13)


def test_a_lanczos_basis_on_ranks_is_that_of_one_process(space, pencil):
    """Through a restart and growth: the same projections, and the same vectors."""
    _, M, factorization = pencil
    solve = factorize(pencil[0], solver="superlu").solve
    here = BlockLanczos(solve, ArraySpace(N).product(M), ArraySpace(N), block=4, capacity=40)
    there = BlockLanczos(space.solver(factorization), space.product(M), space, block=4, capacity=40)
    for lanczos in (here, there):
        for _ in range(6):
            lanczos.advance()
        lanczos.restart(lanczos.ritz(), 9)
        lanczos.grow(60)
        for _ in range(3):
            lanczos.advance()
    assert here.m == there.m
    assert_allclose(there.ritz().theta, here.ritz().theta, rtol=1e-10, atol=1e-12 * here.ritz().theta[0])
    V = there.V.whole()
    assert_allclose(V.T @ (M @ V), np.eye(there.m), rtol=0, atol=1e-12)
    far = V - here.V @ (here.V.T @ (M @ V))
    assert_allclose(far, 0, rtol=0, atol=1e-8)


def test_columns_that_nobody_names_are_forgotten_on_every_rank(space):
    kept = space.random(np.random.default_rng(0), 2)
    basis = space.empty(5)
    part = basis[:, 1:3]
    put(kept, part)
    del basis
    gc.collect()
    space.close()
    assert_array_equal(part.whole(), kept.whole())  # the part holds the basis
    del part
    gc.collect()
    space.close()
    assert [list(store) for store in space.ranks.stores] == [[kept.part.key]] * space.ranks.size


@pytest.mark.parametrize("size", [1, 2, 3])
def test_a_matrix_by_rows_on_the_ranks_of_a_space_is_multiplied_there(size, monkeypatch):
    body = couple(bar(nx=5, kind="hexahedron", ranks=(ranks := ThreadRanks(size))))
    one = couple(bar(nx=5, kind="hexahedron"))
    i = body.K.ordered(body.i) if size > 1 else body.i
    block = PrincipalBlock(body.M, i)
    rows = spread_block(block).rows if size > 1 else even_rows(one.M.indptr[: len(i) + 1], 1)
    space = RankSpace(SimpleNamespace(ranks=ranks, rows=rows, n=len(i), key="factor"))
    if size > 1:
        monkeypatch.setattr("cms.linear_algebra.solvers.slepc_modes.matrix_of", None)  # nothing is collected
    X = space.random(np.random.default_rng(0), 3)
    expected = PrincipalBlock(one.M, i) @ X.whole()
    assert_allclose((space.product(block) @ X).whole(), expected, rtol=0, atol=1e-13 * np.abs(expected).max())
