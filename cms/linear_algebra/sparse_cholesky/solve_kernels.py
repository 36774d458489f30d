"""Compiled substitution with the tiles of fronts; imported only where used.

Right-hand sides are stored by rows of `width` = 8 len(parts) numbers (`cms.linear_algebra.sparse_cholesky.tiles`). A
front has such rows for its own columns. In the forward substitution it also has the contributions of itself and its
descendants to the rows below its columns, which are added to the rows of its parent. The number of rows is rounded up
to whole tiles, so the last rows may be unused.
"""

import numpy as np

from cms.linear_algebra.sparse_cholesky.tiles import (
    LANES,
    ROWS,
    solve_tile,
    solve_transposed_tile,
    subtract_tile,
    subtract_transposed_tile,
)
from fe_models.foundation.kernels.jit import jit

__all__ = ["begin_rows", "eliminate_fronts", "finish_rows", "substitute_back", "take_rows_of"]


@jit
def begin_rows(tree, f, parts, order, b, own, below):
    """Copy right-hand sides from b, (n, k) in C order, to the columns of a front; zero the contributions below."""
    width = LANES * len(parts)
    lo, w, u = tree.first[f], tree.first[f + 1] - tree.first[f], tree.begin[f + 1] - tree.begin[f]
    own[: -(-w // ROWS) * ROWS * width] = 0.0
    for i in range(w):
        row = order[lo + i]
        for c in range(b.shape[1]):
            own[i * width + c] = b[row, c]
    below[: -(-u // ROWS) * ROWS * width] = 0.0


@jit
def take_rows(place, left, w, width, own, below):
    """Add a child's contribution to its parent: row k of `left` goes to row place[k] of the parent front.

    The rows of a front are its own columns first, then the rows below them.
    """
    for k in range(place.size):
        if place[k] < w:
            at = place[k] * width
            for c in range(width):
                own[at + c] += left[k * width + c]
        else:
            at = (place[k] - w) * width
            for c in range(width):
                below[at + c] += left[k * width + c]


@jit
def finish_rows(tree, f, parts, panel, own, below, Y):
    """Solve L11 y = b, store y in Y, (n, width), and update below <- below - L21 y."""
    width = LANES * len(parts)
    lo, w, u = tree.first[f], tree.first[f + 1] - tree.first[f], tree.begin[f + 1] - tree.begin[f]
    tile, size = panel.ctypes.data, 8 * ROWS
    for top in range(0, w, ROWS):
        z = own.ctypes.data + 8 * top * width
        subtract_tile(parts, z, tile, own.ctypes.data, top)
        solve_tile(parts, z, tile + top * size)
        tile += (top + ROWS) * size
    for top in range(0, u, ROWS):
        subtract_tile(parts, below.ctypes.data + 8 * top * width, tile, own.ctypes.data, w)
        tile += w * size
    for i in range(w):
        for c in range(width):
            Y[lo + i, c] = own[i * width + c]


@jit
def take_rows_of(tree, lo, hi, left, f, parts, own, below):
    """Add the contributions of roots among fronts lo to hi to their parent, front f."""
    width = LANES * len(parts)
    w, at = tree.first[f + 1] - tree.first[f], 0
    for c in range(lo, hi):
        if tree.above[c] >= hi:
            m = tree.begin[c + 1] - tree.begin[c]
            take_rows(tree.place[tree.begin[c] : tree.begin[c + 1]], left[at:], w, width, own, below)
            at += -(-m // ROWS) * ROWS * width


@jit
def eliminate_fronts(tree, lo, hi, parts, order, b, panels, own, stack, Y):
    """Solve L y = b for consecutive subtrees, y in Y, (n, width); contributions of their roots stay on the stack."""
    width = LANES * len(parts)
    left_by, n_left, top = np.empty(hi - lo, np.int64), 0, 0
    for f in range(lo, hi):
        w, u = tree.first[f + 1] - tree.first[f], tree.begin[f + 1] - tree.begin[f]
        size = -(-u // ROWS) * ROWS * width
        below = stack[top : top + size]
        begin_rows(tree, f, parts, order, b, own, below)
        under = top
        while n_left and tree.above[left_by[n_left - 1]] == f:
            n_left -= 1
            c = left_by[n_left]
            m = tree.begin[c + 1] - tree.begin[c]
            under -= -(-m // ROWS) * ROWS * width
            take_rows(tree.place[tree.begin[c] : tree.begin[c + 1]], stack[under:], w, width, own, below)
        finish_rows(tree, f, parts, panels[tree.stored[f] - tree.stored[lo] :], own, below, Y)
        if under < top:
            for k in range(size):
                stack[under + k] = below[k]
        top = under + size
        left_by[n_left] = f
        n_left += 1


@jit
def substitute_back(tree, lo, hi, parts, order, panels, own, eight, Y, x):
    """Solve Lᵀ x = y for fronts lo to hi, last front first; y is in Y, (n, width), x overwrites it.

    x: (n, k) in C order, in the order of the matrix;
    own, eight: workspaces, with the rows of the largest front and eight rows.
    """
    width = LANES * len(parts)
    for f in range(hi - 1, lo - 1, -1):
        first, w, u = tree.first[f], tree.first[f + 1] - tree.first[f], tree.begin[f + 1] - tree.begin[f]
        panel = panels[tree.stored[f] - tree.stored[lo] :].ctypes.data
        own[: -(-w // ROWS) * ROWS * width] = 0.0
        for i in range(w):
            for c in range(width):
                own[i * width + c] = Y[first + i, c]
        size = 8 * ROWS
        n_tiles = -(-w // ROWS)
        tile = panel + size * ROWS * n_tiles * (n_tiles + 1) // 2
        for top in range(0, u, ROWS):
            eight[:] = 0.0
            for i in range(min(ROWS, u - top)):
                row = tree.rows[tree.begin[f] + top + i]
                for c in range(width):
                    eight[i * width + c] = Y[row, c]
            subtract_transposed_tile(parts, own.ctypes.data, tile, eight.ctypes.data, w)
            tile += w * size
        for k in range(n_tiles - 1, -1, -1):
            top = ROWS * k
            z = own.ctypes.data + 8 * top * width
            tile = panel + size * ROWS * k * (k + 1) // 2
            solve_transposed_tile(parts, z, tile + top * size)
            subtract_transposed_tile(parts, own.ctypes.data, tile, z, top)
        for i in range(w):
            for c in range(width):
                Y[first + i, c] = own[i * width + c]
        for i in range(w):
            row = order[first + i]
            for c in range(x.shape[1]):
                x[row, c] = own[i * width + c]
