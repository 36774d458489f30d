"""Small dense matrices: views of flat arrays, LU factorisation with partial pivoting, solves. Row-major, in place."""

from floatframe.engine.kernels.compiler.compilation import inner, matrix_loops, view
from floatframe.engine.kernels.vector import add, put, scaled, sub, vector

__all__ = [
    "add_products",
    "flat",
    "lu_factor",
    "lu_solve",
    "lu_solve_columns",
    "matrix_at",
    "product_of",
    "rows_of",
    "six_columns",
    "subtract_product",
]

ENOUGH = 0.25  # ratio of a pivot to the largest number of its row at which the search for it ends


@view
def matrix_at(A, start, rows, columns):
    """Return the matrix (rows, columns) that begins at index `start` of a flat array."""
    return A[start : start + rows * columns].reshape((rows, columns))


@view
def rows_of(A, rows, first, n):
    """Return the matrix (rows, n) of n items of a flat array, in which each earlier item takes `rows` numbers."""
    return matrix_at(A, rows * first, rows, n)


@view
def flat(A):
    """Return the numbers of a matrix as a vector, row after row."""
    return A.reshape(A.size)


@matrix_loops
def add_products(A, x, out):
    """Add Σ_k A[k, j] x_k to out[j]; four rows at once."""
    n, width = x.shape[0], out.shape[0]
    for k in range(0, n - 3, 4):
        r0, r1, r2, r3 = A[k], A[k + 1], A[k + 2], A[k + 3]
        x0, x1, x2, x3 = x[k], x[k + 1], x[k + 2], x[k + 3]
        for j in range(width):
            out[j] += (r0[j] * x0 + r1[j] * x1) + (r2[j] * x2 + r3[j] * x3)
    for k in range(n - n % 4, n):
        row, y = A[k], x[k]
        for j in range(width):
            out[j] += row[j] * y


@inner
def product_of(A, x, out):
    """Write the product A x into out."""
    for r in range(A.shape[0]):
        total = 0.0
        for k in range(A.shape[1]):
            total += A[r, k] * x[k]
        out[r] = total


@inner
def subtract_product(A, x, out):
    """Subtract the product A x from out."""
    for r in range(A.shape[0]):
        total = out[r]
        for k in range(A.shape[1]):
            total -= A[r, k] * x[k]
        out[r] = total


@matrix_loops
def lu_factor(A, pivot):
    """Overwrite A, (n, n), with its LU factors; the diagonal of U is stored inverted.

    The pivot is the first number of a column that is at least `ENOUGH` times the largest number of its row, or else the
    number with the largest such ratio. Return False if a pivot is zero or not finite.
    """
    n = A.shape[0]
    for k in range(n):
        best, row = -1.0, k
        for i in range(k, n):
            size = 0.0
            for j in range(k, n):
                size = max(size, abs(A[i, j]))
            if size > 0.0 and abs(A[i, k]) / size > best:
                best = abs(A[i, k]) / size
                row = i
                if best >= ENOUGH:
                    break
        pivot[k] = row
        if row != k:
            for j in range(n):
                A[k, j], A[row, j] = A[row, j], A[k, j]
        diagonal = A[k, k]
        if not abs(diagonal) > 0.0:
            return False
        inverse = 1.0 / diagonal
        A[k, k] = inverse
        for i in range(k + 1, n):
            factor = A[i, k] * inverse
            A[i, k] = factor
            if factor != 0.0:
                for j in range(k + 1, n):
                    A[i, j] -= factor * A[k, j]
    return True


@matrix_loops
def lu_solve(A, pivot, b):
    """Overwrite b, (n,), with A⁻¹ b, from the factors of `lu_factor`.

    Four rows are processed at once, because the processor can compute their sums in parallel.
    """
    n = A.shape[0]
    for k in range(n):
        row = pivot[k]
        if row != k:
            b[k], b[row] = b[row], b[k]
    for i in range(0, n - 3, 4):
        r0, r1, r2, r3 = A[i], A[i + 1], A[i + 2], A[i + 3]
        b0, b1, b2, b3 = b[i], b[i + 1], b[i + 2], b[i + 3]
        for j in range(i):
            x = b[j]
            b0, b1, b2, b3 = b0 - r0[j] * x, b1 - r1[j] * x, b2 - r2[j] * x, b3 - r3[j] * x
        b1 -= r1[i] * b0
        b2 -= r2[i] * b0 + r2[i + 1] * b1
        b3 -= r3[i] * b0 + r3[i + 1] * b1 + r3[i + 2] * b2
        b[i], b[i + 1], b[i + 2], b[i + 3] = b0, b1, b2, b3
    for i in range(n - n % 4, n):
        total = b[i]
        for j in range(i):
            total -= A[i, j] * b[j]
        b[i] = total
    for i in range(n - 1, n - 1 - n % 4, -1):
        total = b[i]
        for j in range(i + 1, n):
            total -= A[i, j] * b[j]
        b[i] = total * A[i, i]
    for i in range(n - n % 4 - 4, -1, -4):
        r0, r1, r2, r3 = A[i], A[i + 1], A[i + 2], A[i + 3]
        b0, b1, b2, b3 = b[i], b[i + 1], b[i + 2], b[i + 3]
        for j in range(i + 4, n):
            x = b[j]
            b0, b1, b2, b3 = b0 - r0[j] * x, b1 - r1[j] * x, b2 - r2[j] * x, b3 - r3[j] * x
        b3 *= r3[i + 3]
        b2 = (b2 - r2[i + 3] * b3) * r2[i + 2]
        b1 = (b1 - r1[i + 2] * b2 - r1[i + 3] * b3) * r1[i + 1]
        b0 = (b0 - r0[i + 1] * b1 - r0[i + 2] * b2 - r0[i + 3] * b3) * r0[i]
        b[i], b[i + 1], b[i + 2], b[i + 3] = b0, b1, b2, b3


@matrix_loops
def lu_solve_columns(A, pivot, B):
    """Overwrite B, (n, m), with A⁻¹ B from the factors of `lu_factor`; six columns at once stay in registers."""
    n, m = B.shape
    for k in range(n):
        row = pivot[k]
        if row != k:
            for c in range(m):
                B[k, c], B[row, c] = B[row, c], B[k, c]
    for c in range(0, m - 5, 6):
        for i in range(n):
            x, y = vector(B[i, c:]), vector(B[i, c + 3 :])
            for j in range(i):
                x = sub(x, scaled(A[i, j], vector(B[j, c:])))
                y = sub(y, scaled(A[i, j], vector(B[j, c + 3 :])))
            put(B[i], c, x)
            put(B[i], c + 3, y)
        for i in range(n - 1, -1, -1):
            x, y = vector(B[i, c:]), vector(B[i, c + 3 :])
            for j in range(i + 1, n):
                x = sub(x, scaled(A[i, j], vector(B[j, c:])))
                y = sub(y, scaled(A[i, j], vector(B[j, c + 3 :])))
            put(B[i], c, scaled(A[i, i], x))
            put(B[i], c + 3, scaled(A[i, i], y))
    for i in range(1, n):
        for j in range(i):
            factor = A[i, j]
            for c in range(m - m % 6, m):
                B[i, c] -= factor * B[j, c]
    for i in range(n - 1, -1, -1):
        for j in range(i + 1, n):
            factor = A[i, j]
            for c in range(m - m % 6, m):
                B[i, c] -= factor * B[j, c]
        for c in range(m - m % 6, m):
            B[i, c] *= A[i, i]


@matrix_loops
def six_columns(A, X, out):
    """Write A X into out, (n_rows, 6), for the first n_rows rows of A, (., n), and X, (n, 6)."""
    for r in range(out.shape[0]):
        x, y = (0.0, 0.0, 0.0), (0.0, 0.0, 0.0)
        for j in range(X.shape[0]):
            x, y = add(x, scaled(A[r, j], vector(X[j]))), add(y, scaled(A[r, j], vector(X[j, 3:])))
        put(out[r], 0, x)
        put(out[r], 3, y)
