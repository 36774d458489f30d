"""The block elimination of connections beside a dense solution."""

from functools import partial
from typing import NamedTuple

import numpy as np
import pytest
from numpy.testing import assert_allclose

from floatframe.engine.compiling.elimination_order import plan_elimination
from floatframe.engine.kernels.compiler.compilation import entry
from floatframe.engine.kernels.schur import factorize_connections, solve_connections

compiled = partial(entry, cache=False)  # the cache does not see changes of what is called


class Connections(NamedTuple):
    size: np.ndarray
    w0: np.ndarray


class Solver(NamedTuple):
    blocks: np.ndarray
    block_pivot: np.ndarray
    panel_row: np.ndarray
    mu: np.ndarray


@compiled
def solve(elimination, connections, solver):
    """Overwrite mu by the solution; return the connection with a singular block, or -1."""
    singular = factorize_connections(elimination, connections, solver)
    if singular < 0:
        solve_connections(elimination, connections, solver)
    return singular


def blocks_of(seed):
    """Return plan, connections, flat blocks and dense matrix of random connections between random bodies."""
    rng = np.random.default_rng(seed)
    n = int(rng.integers(2, 14))
    sizes = rng.integers(1, 8, size=n)
    groups = [rng.choice(n, size=rng.integers(1, min(n, 7) + 1)).tolist() for _ in range(int(rng.integers(1, n + 1)))]
    connection_of = np.concatenate([np.array(group) for group in groups])  # a connection may have both ends on a body
    first = np.cumsum([0, *map(len, groups)])
    ends = [list(range(first[k], first[k + 1])) for k in range(len(groups))]
    plan = plan_elimination(sizes.tolist(), ends, connection_of)
    w0 = np.concatenate([[0], np.cumsum(sizes)])
    blocks, dense = np.zeros(int(plan.n_store)), np.zeros((w0[-1], w0[-1]))
    for c in range(n):
        own = rng.normal(size=(sizes[c], sizes[c])) + 20 * n * np.eye(sizes[c])
        blocks[plan.diagonal[c] :][: own.size] = own.ravel()
        dense[w0[c] : w0[c + 1], w0[c] : w0[c + 1]] = own
    for a, b, first_of_block, stride in zip(
        plan.pair_row, plan.pair_column, plan.pair_block, plan.pair_stride, strict=True
    ):
        c, d = connection_of[a], connection_of[b]
        own = rng.normal(size=(sizes[c], sizes[d]))
        rows = blocks[first_of_block:][: sizes[c] * stride].reshape(sizes[c], stride)
        rows[:, : sizes[d]] += own
        dense[w0[c] : w0[c + 1], w0[d] : w0[d + 1]] += own
    return plan, Connections(sizes, w0), blocks, dense


@pytest.mark.parametrize("seed", range(40))
def test_elimination_solves_the_whole_matrix(seed):
    """Chains, cliques and separate parts, blocks of 1 to 7 rows, fill, several ends of a connection on one body."""
    plan, connections, blocks, dense = blocks_of(seed)
    right = np.random.default_rng(seed).normal(size=len(dense))
    solver = Solver(blocks, np.zeros(len(dense), dtype=int), np.zeros(int(max(plan.width))), right.copy())
    assert solve(plan, connections, solver) == -1
    assert_allclose(solver.mu, np.linalg.solve(dense, right), rtol=0, atol=1e-13)


def test_a_singular_block_is_named():
    plan, connections, blocks, dense = blocks_of(3)
    c = int(plan.order[0])
    blocks[plan.diagonal[c] :][: connections.size[c] ** 2] = 0.0
    solver = Solver(blocks, np.zeros(len(dense), dtype=int), np.zeros(int(max(plan.width))), np.ones(len(dense)))
    assert solve(plan, connections, solver) == c
