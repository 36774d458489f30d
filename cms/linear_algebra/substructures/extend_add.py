"""Compiled loops that add the contribution of a substructure to the enclosing one; imported only where used."""

from fe_models.foundation.kernels.jit import jit

__all__ = ["extend_add", "put_rows"]

TILE = 32  #: rows and columns that are transposed at a time


@jit
def extend_add(A_ss, A_sb, A_bb, A, place, p):
    """Add the lower triangle of A, (n, n), to lower triangles A_ss, (s, s), and A_bb, (b, b), and to A_sb, (s, b).

    The first p rows of A belong to positions `place` in s, the others to positions in b; both are ascending. All
    matrices are in Fortran order.
    """
    n = len(A)
    for j in range(p):
        for i in range(j, p):
            A_ss[place[i], place[j]] += A[i, j]
    for first in range(p, n, TILE):
        for left in range(0, p, TILE):
            for i in range(first, min(first + TILE, n)):
                for j in range(left, min(left + TILE, p)):
                    A_sb[place[j], place[i]] += A[i, j]
    for j in range(p, n):
        for i in range(j, n):
            A_bb[place[i], place[j]] += A[i, j]


@jit
def put_rows(D, rows, first, place):
    """Copy rows, (m, n), to the rows of D from `first` on, columns `place`; both are in C order."""
    for i in range(len(rows)):
        for j in range(len(place)):
            D[first + i, place[j]] = rows[i, j]
