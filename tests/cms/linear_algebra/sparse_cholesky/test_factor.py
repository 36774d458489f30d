"""Our Cholesky factorisation against SuperLU, LAPACK and closed forms, in memory and on disk."""

import _thread
import os
import signal
import subprocess
import sys
import threading
import time
from itertools import pairwise

import numpy as np
import pytest
import scipy.linalg as la
import scipy.sparse as sp
from numba.core.event import trigger_event
from numpy.testing import assert_allclose, assert_array_equal

import cms
from cms.errors import FactorizationError, FactorRoomError
from cms.linear_algebra.solvers.factorization import factorize, lower_triangle
from cms.linear_algebra.solvers.registry import SMALL, cholesky_or_superlu
from cms.linear_algebra.sparse_cholesky import analysis
from cms.linear_algebra.sparse_cholesky.analysis import analyse, dissection_order
from cms.linear_algebra.sparse_cholesky.blocks import blocks_of, for_each
from cms.linear_algebra.sparse_cholesky.factor import CholeskyFactor
from cms.modes.families.fixed_interface import fix_interfaces
from fe_models.foundation.solver import Solver
from tests.bodies import bar
from tests.cms.linear_algebra.sparse_cholesky.examples import grid

ROUNDOFF = 1e-12


def clamped_bar(nx=8, ny=3, nz=3):
    body = bar(nx=nx, ny=ny, nz=nz)
    free = np.flatnonzero(body.nodes[body.dofs[:, 0], 0] > 0)
    return sp.csc_array(body.K[free][:, free])


def scattered(seed, n):
    """A positive definite matrix of a random graph of several components, with rows that stand alone."""
    rng = np.random.default_rng(seed)
    k = n // 2
    i, j = rng.integers(0, n, k), rng.integers(0, n, k)
    A = sp.coo_array((rng.standard_normal(k), (i, j)), shape=(n, n)).tocsc()
    A = A + A.T
    return sp.csc_array(A + sp.diags_array(np.abs(A).sum(axis=0) + 1.0))


def block_chain(n, width):
    """Blocks of dofs, each with all entries that it can have with the next one."""
    rng = np.random.default_rng(5)
    line = sp.diags_array([np.ones(n), np.ones(n - 1), np.ones(n - 1)], offsets=[0, 1, -1])
    A = sp.kron(line, np.ones((width, width)), format="csc")
    A.data *= rng.random(A.nnz)
    return sp.csc_array(A + A.T + 6 * width * sp.eye_array(n * width))


def with_zeros(A, share):
    """The matrix without a random share of its entries off the diagonal, as those of regular meshes that cancel."""
    upper = sp.triu(A, 1, format="coo")
    is_kept = np.random.default_rng(3).random(upper.nnz) >= share
    upper = sp.coo_array((upper.data[is_kept], (upper.row[is_kept], upper.col[is_kept])), shape=A.shape)
    return sp.csc_array(upper + upper.T + sp.diags_array(A.diagonal()))


MATRICES = {
    "cube": lambda: grid(9),
    "cube of nodes": lambda: grid(6, dofs=3),
    "cube of nodes with zeros": lambda: with_zeros(grid(6, dofs=3), 0.15),
    "solid": clamped_bar,
    "scattered": lambda: scattered(1, 600),
    "256 entries between two vertices": lambda: block_chain(6, 16),
    "diagonal": lambda: sp.csc_array(sp.diags_array(np.arange(1.0, 200.0))),
    "dense": lambda: sp.csc_array(np.eye(40) * 41 - np.ones((40, 40))),
    "one": lambda: sp.csc_array([[4.0]]),
}


@pytest.mark.parametrize("on_disk", [False, True])
@pytest.mark.parametrize("name", MATRICES)
def test_solutions_are_those_of_lapack(name, on_disk):
    A = MATRICES[name]()
    b = np.random.default_rng(0).standard_normal((A.shape[0], 67))
    expected = la.cho_solve(la.cho_factor(A.toarray()), b)
    factor = CholeskyFactor(lower_triangle(A), on_disk=on_disk)
    condition = np.linalg.cond(A.toarray())
    assert_allclose(factor.solve(b), expected, rtol=0, atol=ROUNDOFF * condition * np.abs(expected).max())
    assert_allclose(factor.solve(b[:, 3:4]), expected[:, 3:4], rtol=0, atol=1e-9 * np.abs(expected).max())
    factor.close()


@pytest.mark.parametrize("name", MATRICES)
def test_fronts_hold_the_factor_and_no_less(name):
    """Rows of the factor of LAPACK in the new order: each that is not zero is in its front; sizes are those stored."""
    A = MATRICES[name]()
    fronts = analyse(lower_triangle(A))
    assert_array_equal(np.sort(fronts.order), np.arange(A.shape[0]))
    L = la.cholesky(A.toarray()[np.ix_(fronts.order, fronts.order)], lower=True)
    known = np.zeros(L.shape, bool)
    for f in range(len(fronts.above)):
        columns = np.arange(fronts.first[f], fronts.first[f + 1])
        below = fronts.rows[fronts.begin[f] : fronts.begin[f + 1]]
        known[np.ix_(np.concatenate([columns, below]), columns)] = True
        assert (below >= fronts.first[f + 1]).all()
        assert_array_equal(below, np.unique(below))
    known = np.tril(known)
    assert (known | (np.abs(L) < 1e-14)).all()
    assert fronts.n_entries == known.sum()


@pytest.mark.parametrize("on_disk", [False, True])
def test_solutions_are_the_same_numbers_on_any_number_of_threads(on_disk, monkeypatch):
    A = lower_triangle(grid(16))
    b = np.random.default_rng(2).standard_normal((A.shape[0], 25))
    solutions = []
    for threads in (1, 2, 5):
        monkeypatch.setattr("cms.linear_algebra.sparse_cholesky.factor.n_threads", lambda n=threads: n)
        factor = CholeskyFactor(A, on_disk=on_disk)
        solutions.append(factor.solve(b))
        factor.close()
    for x in solutions[1:]:
        assert_array_equal(x, solutions[0])


def test_blocks_are_subtrees_or_fronts_above_them_and_each_comes_after_those_it_waits_for():
    fronts = analyse(lower_triangle(grid(14)))
    blocks = blocks_of(fronts)
    assert len(blocks) > 8
    assert_array_equal(blocks.first[[0, -1]], [0, len(fronts.above)])
    for k, (lo, hi) in enumerate(pairwise(blocks.first)):
        parents = fronts.above[lo:hi]
        outside = parents[parents >= hi]
        if len(outside):
            assert blocks.first[blocks.above[k]] == outside.min() == outside.max()
        if blocks.below[k]:
            assert hi == lo + 1
    for downwards in (False, True):
        done = []
        for_each(blocks, done.append, 3, blocks.by_distance, downwards=downwards)
        assert_array_equal(np.sort(done), np.arange(len(blocks)))
        for k, above in enumerate(blocks.above):
            assert above < 0 or (done.index(above) < done.index(k)) == downwards


def test_what_fails_in_a_thread_is_raised():
    def fail(k):
        raise RuntimeError(f"block {k}")

    blocks = blocks_of(analyse(lower_triangle(grid(14))))
    with pytest.raises(RuntimeError, match="block"):
        for_each(blocks, fail, 3, blocks.by_depth)


def test_an_interrupt_ends_all_threads():
    """It comes while a task of this thread or another runs; tasks that have begun end, no other begins."""
    blocks, done = blocks_of(analyse(lower_triangle(grid(14)))), []

    def task(k):
        done.append(k)
        if len(done) == 4:
            _thread.interrupt_main()
        time.sleep(0.02)

    before = threading.active_count()
    with pytest.raises(KeyboardInterrupt):
        for_each(blocks, task, 3, blocks.by_depth)
    assert threading.active_count() == before
    assert len(done) < len(blocks)


def test_dofs_of_a_node_are_one_vertex():
    A = lower_triangle(grid(4, dofs=3))
    _, _, weight, group = analysis.quotient(A)
    assert_array_equal(weight, 3)
    assert_array_equal(group, np.repeat(np.arange(64), 3))


def test_dofs_of_a_node_are_one_vertex_although_entries_cancel():
    """Rows differ in a tenth of their entries: exact comparison leaves nearly every row a vertex of its own."""
    A = lower_triangle(with_zeros(grid(8, dofs=3), 0.1))
    _, _, weight, _ = analysis.quotient(A)
    assert (weight == 3).sum() > 0.9 * 512
    assert weight.max() == 3


def test_dissection_fills_a_cube_less_than_its_rows_as_they_come():
    """A cube of n³ vertices fills the envelope of its rows, n⁵; separators, n⁴ times some ten: less than half of it."""
    n = 14
    A = lower_triangle(grid(n))
    assert analyse(A).n_entries < 0.5 * n**5
    assert_array_equal(np.sort(dissection_order(A)), np.arange(n**3))


def test_the_order_is_the_same_every_time():
    A = lower_triangle(grid(8, dofs=2))
    assert_array_equal(analyse(A).order, analyse(A).order)


@pytest.mark.parametrize("on_disk", [False, True])
def test_a_matrix_that_is_not_definite_is_refused_by_its_row(on_disk):
    A = grid(5).tolil()
    A[7, 7] = -1.0
    with pytest.raises(FactorizationError, match=r"a pivot is zero or negative \(row \d+ of 125\)"):
        CholeskyFactor(lower_triangle(sp.csc_array(A)), on_disk=on_disk)


def test_factorize_refuses_a_singular_matrix():
    free = bar(nx=8, ny=2, nz=2).K
    with pytest.raises(FactorizationError, match="singular"):
        factorize(free, solver=Solver("cholesky", CholeskyFactor))


def test_large_definite_matrices_are_ours_others_those_of_superlu():
    large = lower_triangle(grid(15))
    assert large.shape[0] > SMALL
    ours, other = cholesky_or_superlu(large, definite=True), cholesky_or_superlu(large, definite=False)
    assert ours.description.startswith("Cholesky by")
    assert other.description.startswith("SuperLU")
    assert "nested dissection" in other.description
    assert (other.n_negative, other.n_positive) == (ours.n_negative, ours.n_positive) == (0, large.shape[0])
    b = np.random.default_rng(4).standard_normal((large.shape[0], 2))
    x = other.solve(b)
    assert_allclose(ours.solve(b), x, rtol=0, atol=1e-10 * np.abs(x).max())
    assert cholesky_or_superlu(lower_triangle(grid(3)), definite=True).description.startswith("SuperLU")


def test_a_folder_that_is_not_there_is_refused(tmp_path):
    with pytest.raises(FactorRoomError, match=r"no file for the factor in .*nowhere"):
        CholeskyFactor(lower_triangle(grid(4)), on_disk=True, folder=tmp_path / "nowhere")


def test_a_disk_without_room_is_not_taken_for_a_mechanism_of_the_body(monkeypatch):
    monkeypatch.setattr("cms.linear_algebra.sparse_cholesky.factor.tempfile.gettempdir", lambda: "/nowhere")
    on_disk = Solver("cholesky", lambda lower, *, definite: CholeskyFactor(lower, definite=definite, on_disk=True))
    with pytest.raises(FactorRoomError, match=r"^no file for the factor in .*nowhere"):
        fix_interfaces(cms.couple(bar(nx=3)), solver=on_disk)


KILLED = """
import sys, time
from pathlib import Path
from cms.linear_algebra.solvers.factorization import lower_triangle
from cms.linear_algebra.sparse_cholesky.factor import CholeskyFactor
from tests.cms.linear_algebra.sparse_cholesky.test_factor import grid
factor = CholeskyFactor(lower_triangle(grid(8)), on_disk=True, folder=Path(sys.argv[1]))
print("ready", flush=True)
time.sleep(60)
"""


@pytest.mark.skipif(sys.platform == "win32", reason="kill -9 is of POSIX")
def test_nothing_is_left_on_disk_by_a_process_that_was_killed(tmp_path):
    child = subprocess.Popen([sys.executable, "-c", KILLED, str(tmp_path)], stdout=subprocess.PIPE, text=True)
    assert child.stdout.readline() == "ready\n"
    os.kill(child.pid, signal.SIGKILL)
    child.wait()
    child.stdout.close()
    assert list(tmp_path.iterdir()) == []


def test_no_memory_is_told_as_by_other_solvers(monkeypatch):
    def without(*_):
        raise MemoryError

    monkeypatch.setattr(CholeskyFactor, "_factorise", without)
    with pytest.raises(FactorRoomError, match=r"cholesky: not enough memory; n = 64, \d+ entries"):
        CholeskyFactor(lower_triangle(grid(4)))


def test_the_compilation_of_the_kernels_is_announced_once(monkeypatch, caplog):
    def compiled_before(lower):
        for _ in range(2):
            with trigger_event("numba:compile"):
                pass
        return analyse(lower)

    A = lower_triangle(grid(6))
    CholeskyFactor(A).close()  # whose kernels may really be compiled here
    caplog.clear()
    CholeskyFactor(A).close()
    assert caplog.messages == []
    monkeypatch.setattr("cms.linear_algebra.sparse_cholesky.factor.analyse", compiled_before)
    CholeskyFactor(A).close()
    assert [message[:48] for message in caplog.messages] == ["compiling the code of the Cholesky factorisation"]
