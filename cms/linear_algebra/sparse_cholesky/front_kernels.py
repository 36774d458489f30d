"""Compiled loops over fronts that compute the factor; imported only where used.

A front with w columns and u rows below them is stored as F, (w + u, w), and its update matrix as U, (u, u), column by
column in flat arrays. Of symmetric parts only the lower triangle is used. Update matrices in a subtree are stored on a
stack until they are added to the parent.
"""

from typing import Any, NamedTuple

import numpy as np
from llvmlite import binding
from numba import types

from cms.linear_algebra.sparse_cholesky.lapack import routine_address
from cms.linear_algebra.sparse_cholesky.tiles import ROWS
from fe_models.foundation.arrays import Array, IntArray
from fe_models.foundation.kernels.jit import jit

__all__ = [
    "Entries",
    "Tree",
    "Words",
    "begin_front",
    "factorise_fronts",
    "finish_front",
    "room",
    "take_updates",
    "words",
]

TOGETHER = 8  #: number of tiles that are written together
STRIPE = 64  #: number of columns per triangular solve of BLAS; products between stripes do the rest, twice as fast


def external(name: str) -> Any:
    """Return a BLAS or LAPACK routine for kernels; it is found by name, so that compiled kernels can be cached."""
    address, n_arguments = routine_address(name)
    binding.add_symbol(f"sparse_cholesky_{name}", address)
    return types.ExternalFunction(f"sparse_cholesky_{name}", types.void(*[types.intp] * n_arguments))


dgemm, dpotrf, dsyrk, dtrsm = external("dgemm"), external("dpotrf"), external("dsyrk"), external("dtrsm")


class Tree(NamedTuple):
    """Fronts (`Fronts`) in the form that the kernels use."""

    first: IntArray
    begin: IntArray
    rows: IntArray
    above: IntArray
    place: IntArray
    stored: IntArray


class Entries(NamedTuple):
    """Lower triangle of the matrix in the order of the fronts, stored by columns."""

    start: IntArray
    rows: IntArray
    values: Array


class Words(NamedTuple):
    """Arguments of BLAS and LAPACK routines, which need addresses; each thread has its own set."""

    sizes: IntArray
    factors: Array
    letters: np.ndarray


def words() -> Words:
    """Return the arguments: sizes, which the kernels set; 1 and -1; the letters L, N, R and T."""
    return Words(np.zeros(6, np.intc), np.array([1.0, -1.0]), np.frombuffer(b"LNRT", np.uint8).copy())


@jit
def room(tree, lo, hi, size):
    """Return array sizes for consecutive subtrees: largest F, stack, and update matrices that the roots leave.

    size: size of the update matrix of each front, (n_fronts,).
    """
    front = stack = top = 0
    waiting = np.zeros(hi - lo, np.int64)  # update matrices of the children of each front
    for f in range(lo, hi):
        w, u = tree.first[f + 1] - tree.first[f], tree.begin[f + 1] - tree.begin[f]
        front = max(front, w * (w + u))
        stack = max(stack, top + size[f])
        top += size[f] - waiting[f - lo]
        if 0 <= tree.above[f] < hi:
            waiting[tree.above[f] - lo] += size[f]
    return front, stack, top


@jit
def begin_front(tree, entries, f, F, U, local):
    """Write the entries of the matrix into an empty front; `local` is a workspace over all rows."""
    lo, hi = tree.first[f], tree.first[f + 1]
    w, u = hi - lo, tree.begin[f + 1] - tree.begin[f]
    F[: w * (w + u)] = 0.0
    for j in range(u):
        U[j * u + j : (j + 1) * u] = 0.0
    for k in range(u):
        local[tree.rows[tree.begin[f] + k]] = w + k
    for j in range(lo, hi):
        at = (j - lo) * (w + u)
        for e in range(entries.start[j], entries.start[j + 1]):
            i = entries.rows[e]
            F[at + (i - lo if i < hi else local[i])] += entries.values[e]


@jit
def add_update(place, left, w, u, F, U):
    """Add the update matrix of a child, (m, m), to a front, at the positions of its rows."""
    m = place.size
    for j in range(m):
        if place[j] < w:
            at = place[j] * (w + u)
            for i in range(j, m):
                F[at + place[i]] += left[j * m + i]
        else:
            at = (place[j] - w) * u - w
            for i in range(j, m):
                U[at + place[i]] += left[j * m + i]


@jit
def take_updates(tree, lo, hi, stack, f, F, U):
    """Add the update matrices that roots among fronts lo to hi left on their stack to their parent, front f."""
    w, u = tree.first[f + 1] - tree.first[f], tree.begin[f + 1] - tree.begin[f]
    at = 0
    for c in range(lo, hi):
        if tree.above[c] >= hi:
            m = tree.begin[c + 1] - tree.begin[c]
            add_update(tree.place[tree.begin[c] : tree.begin[c + 1]], stack[at : at + m * m], w, u, F, U)
            at += m * m


@jit
def finish_front(tree, f, F, U, panel, words):
    """Eliminate the columns of a front and write them as tiles; return 0, or the number of the failed pivot.

    F11 = L11 L11ᵀ;  L21 = F21 L11⁻ᵀ, stripe by stripe of its columns;  U <- U - L21 L21ᵀ
    """
    w, u = tree.first[f + 1] - tree.first[f], tree.begin[f + 1] - tree.begin[f]
    sizes = words.sizes
    sizes[0], sizes[1], sizes[2], sizes[3] = w, w + u, u, 0
    at, step = sizes.ctypes.data, sizes.itemsize
    n_w, n_front, n_u, info = at, at + step, at + 2 * step, at + 3 * step
    n_stripe, n_before = at + 4 * step, at + 5 * step
    one, minus_one = words.factors.ctypes.data, words.factors.ctypes.data + 8
    letters = words.letters.ctypes.data
    lower, plain, right, transposed = letters, letters + 1, letters + 2, letters + 3
    dpotrf(lower, n_w, F.ctypes.data, n_front, info)
    if sizes[3] != 0:
        return sizes[3]
    if u:
        below = F.ctypes.data + 8 * w
        for j in range(0, w, STRIPE):
            sizes[4], sizes[5] = min(STRIPE, w - j), j
            stripe, diagonal = below + 8 * j * (w + u), F.ctypes.data + 8 * (j * (w + u) + j)
            if j:
                row = F.ctypes.data + 8 * j
                dgemm(
                    plain, transposed, n_u, n_stripe, n_before, minus_one, below, n_front, row, n_front, one, stripe,
                    n_front,
                )  # fmt: skip
            dtrsm(right, lower, transposed, plain, n_u, n_stripe, one, diagonal, n_front, stripe, n_front)
        dsyrk(lower, plain, n_u, n_w, minus_one, below, n_front, one, U.ctypes.data, n_u)
    write_tiles(F, w, u, panel)
    return 0


@jit
def write_rows(F, source, length, n_rows, n_columns, panel, at, step):
    """Copy rows of a front, whose columns have a given length, to tiles that begin `step` numbers apart.

    Several tiles are written together, column by column, because columns are far apart in memory.
    """
    for j in range(n_columns):
        for k in range(n_rows // ROWS):
            place, origin = at + k * step + ROWS * j, source + j * length + ROWS * k
            for i in range(ROWS):
                panel[place + i] = F[origin + i]
        n = n_rows % ROWS
        if n:
            place, origin = at + n_rows // ROWS * step + ROWS * j, source + j * length + n_rows - n
            for i in range(n):
                panel[place + i] = F[origin + i]
            for i in range(n, ROWS):
                panel[place + i] = 0.0


@jit
def write_tiles(F, w, u, panel):
    """Write the columns of a front as tiles of eight rows; diagonals are reciprocals, missing rows are zero."""
    at, length = 0, w + u
    for top in range(0, w, ROWS):
        write_rows(F, top, length, min(ROWS, w - top), top, panel, at, 0)
        at += ROWS * top
        for j in range(top, top + ROWS):
            for i in range(top, top + ROWS):
                if i == j:
                    panel[at] = 1.0 / F[j * length + j] if i < w else 1.0
                else:
                    panel[at] = F[j * length + i] if j < i < w else 0.0
                at += 1
    for top in range(0, u, TOGETHER * ROWS):
        rows = min(TOGETHER * ROWS, u - top)
        write_rows(F, w + top, length, rows, w, panel, at, ROWS * w)
        at += -(-rows // ROWS) * ROWS * w


@jit
def factorise_fronts(tree, entries, lo, hi, F, stack, local, panels, words):
    """Factorise consecutive subtrees; return 0, or a failed row in the new order, counted from 1.

    (1) make the front: entries of the matrix, and the update matrices of its children, which are last on the stack
    (2) eliminate and write its columns; its update matrix replaces those of its children
    """
    left_by, n_left, top = np.empty(hi - lo, np.int64), 0, 0
    for f in range(lo, hi):
        w, u = tree.first[f + 1] - tree.first[f], tree.begin[f + 1] - tree.begin[f]
        U = stack[top : top + u * u]
        begin_front(tree, entries, f, F, U, local)  # (1)
        under = top
        while n_left and tree.above[left_by[n_left - 1]] == f:
            n_left -= 1
            c = left_by[n_left]
            m = tree.begin[c + 1] - tree.begin[c]
            under -= m * m
            place = tree.place[tree.begin[c] : tree.begin[c + 1]]
            add_update(place, stack[under : under + m * m], w, u, F, U)
        failed = finish_front(tree, f, F, U, panels[tree.stored[f] - tree.stored[lo] :], words)  # (2)
        if failed:
            return tree.first[f] + failed
        if under < top:
            for k in range(u * u):
                stack[under + k] = U[k]
        top = under + u * u
        left_by[n_left] = f
        n_left += 1
    return 0
