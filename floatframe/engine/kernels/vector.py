"""Vectors of three numbers and matrices of three rows in the kernels: tuples, which the compiler keeps in registers.

A matrix that is only read may also be an array (3, 3).
"""

import math

from floatframe.engine.kernels.compiler.compilation import inner, small

__all__ = [
    "add",
    "add_block",
    "add_column",
    "congruent",
    "copy",
    "cross",
    "dot",
    "matrix",
    "matrix_sum",
    "norm",
    "product",
    "put",
    "put_block",
    "put_column",
    "put_matrix",
    "put_sum",
    "scaled",
    "scaled_matrix",
    "solved",
    "sub",
    "tilde",
    "transposed",
    "turned",
    "turned_back",
    "unit",
    "unit_matrix",
    "vector",
]


@small
def vector(x):
    """Return the first three numbers of an array as a vector."""
    return x[0], x[1], x[2]


@inner
def copy(source, target):
    """Copy numbers."""
    for k in range(source.shape[0]):
        target[k] = source[k]


@small
def unit(k):
    """Return the unit vector along axis k."""
    return 1.0 if k == 0 else 0.0, 1.0 if k == 1 else 0.0, 1.0 if k == 2 else 0.0


@small
def dot(a, b):
    """Return a · b."""
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


@small
def norm(a):
    """Return |a|."""
    return math.sqrt(dot(a, a))


@small
def cross(a, b):
    """Return a × b."""
    return a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]


@small
def add(a, b):
    """Return a + b."""
    return a[0] + b[0], a[1] + b[1], a[2] + b[2]


@small
def sub(a, b):
    """Return a - b."""
    return a[0] - b[0], a[1] - b[1], a[2] - b[2]


@small
def scaled(f, a):
    """Return f a."""
    return f * a[0], f * a[1], f * a[2]


@small
def matrix(A):
    """Return an array (3, 3) as three rows."""
    return vector(A[0]), vector(A[1]), vector(A[2])


@small
def unit_matrix():
    """Return 1."""
    return (1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0)


@small
def tilde(x):
    """Return the matrix of the cross product with x."""
    return (0.0, -x[2], x[1]), (x[2], 0.0, -x[0]), (-x[1], x[0], 0.0)


@small
def axial(W):
    """Return (W_zy - W_yz, W_xz - W_zx, W_yx - W_xy), twice the axial vector of W."""
    return W[2][1] - W[1][2], W[0][2] - W[2][0], W[1][0] - W[0][1]


@small
def matrix_sum(A, B):
    """Return A + B."""
    return add(A[0], B[0]), add(A[1], B[1]), add(A[2], B[2])


@small
def scaled_matrix(f, A):
    """Return f A."""
    return scaled(f, A[0]), scaled(f, A[1]), scaled(f, A[2])


@small
def transposed(A):
    """Return Aᵀ."""
    return (A[0][0], A[1][0], A[2][0]), (A[0][1], A[1][1], A[2][1]), (A[0][2], A[1][2], A[2][2])


@small
def turned(A, x):
    """Return the product A x."""
    return dot(A[0], x), dot(A[1], x), dot(A[2], x)


@small
def turned_back(A, x):
    """Return the product Aᵀ x."""
    return (
        A[0][0] * x[0] + A[1][0] * x[1] + A[2][0] * x[2],
        A[0][1] * x[0] + A[1][1] * x[1] + A[2][1] * x[2],
        A[0][2] * x[0] + A[1][2] * x[1] + A[2][2] * x[2],
    )


@small
def product(A, B):
    """Return A B."""
    return turned_back(B, A[0]), turned_back(B, A[1]), turned_back(B, A[2])


@small
def congruent(R, J):
    """Return R J Rᵀ."""
    return product(product(R, J), transposed(R))


@small
def solved(A, x):
    """Return the solution of A y = x by Cramer's rule."""
    c_0, c_1, c_2 = cross(A[1], A[2]), cross(A[2], A[0]), cross(A[0], A[1])
    both = add(scaled(x[0], c_0), add(scaled(x[1], c_1), scaled(x[2], c_2)))
    return scaled(1.0 / dot(A[0], c_0), both)


@small
def put(row, first, x):
    """Write a vector into an array."""
    row[first], row[first + 1], row[first + 2] = x[0], x[1], x[2]


@small
def put_sum(row, first, x):
    """Add a vector to numbers of an array."""
    row[first] += x[0]
    row[first + 1] += x[1]
    row[first + 2] += x[2]


@small
def put_matrix(out, A):
    """Write a matrix into an array (3, 3)."""
    put(out[0], 0, A[0])
    put(out[1], 0, A[1])
    put(out[2], 0, A[2])


@small
def put_block(H, row, column, A):
    """Write a matrix into H at (row, column)."""
    put(H[row], column, A[0])
    put(H[row + 1], column, A[1])
    put(H[row + 2], column, A[2])


@small
def add_block(H, row, column, A):
    """Add a matrix to H at (row, column)."""
    put_sum(H[row], column, A[0])
    put_sum(H[row + 1], column, A[1])
    put_sum(H[row + 2], column, A[2])


@small
def put_column(H, row, column, x):
    """Write a vector down a column of H."""
    H[row, column], H[row + 1, column], H[row + 2, column] = x[0], x[1], x[2]


@small
def add_column(H, row, column, x):
    """Add a vector to a column of H."""
    H[row, column] += x[0]
    H[row + 1, column] += x[1]
    H[row + 2, column] += x[2]
