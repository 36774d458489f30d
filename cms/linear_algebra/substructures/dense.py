"""Dense linear algebra in place, with the routines of SciPy's BLAS and LAPACK called by their C addresses.

SciPy's own Python functions mostly hold the interpreter lock while they run, so threads would wait for each other.
Called through `ctypes`, the same routines do not. All matrices are in Fortran order; of symmetric matrices, the lower
triangle is read and written.
"""

import ctypes
from functools import cache
from typing import Any

import numpy as np

from cms.linear_algebra.sparse_cholesky.lapack import routine_address
from fe_models.foundation.arrays import Array

__all__ = [
    "add_product",
    "add_rank_2k",
    "cholesky",
    "congruent",
    "largest_eigenpairs",
    "multiply_symmetric",
    "solve_triangular",
]


@cache
def routine(name: str) -> Any:
    """Return a BLAS or LAPACK routine; all its arguments are pointers."""
    address, n_arguments = routine_address(name)
    return ctypes.CFUNCTYPE(None, *[ctypes.c_void_p] * n_arguments)(address)


def call(name: str, *arguments: Any) -> None:
    """Call a routine with letters, integers, real numbers and arrays."""
    kept: list[Any] = []
    pointers = []
    for argument in arguments:
        if isinstance(argument, np.ndarray):
            pointers.append(argument.ctypes.data)
            continue
        if isinstance(argument, str):
            value: Any = ctypes.c_char(argument.encode())
        elif isinstance(argument, float):
            value = ctypes.c_double(argument)
        elif isinstance(argument, int):
            value = ctypes.c_int(argument)
        else:
            value = argument
        kept.append(value)
        pointers.append(ctypes.addressof(value))
    routine(name)(*pointers)


def leading(A: Array) -> int:
    """Return the distance between two columns of a matrix in Fortran order, which may be a part of a larger matrix."""
    return max(A.strides[1] // 8 if A.shape[1] > 1 else A.shape[0], A.shape[0], 1)


def cholesky(A: Array) -> int:
    """Overwrite the lower triangle of A, (s, s), with L, L Lᵀ = A; return 0, or the number of the row that failed."""
    info = ctypes.c_int(0)
    call("dpotrf", "L", len(A), A, leading(A), info)
    return int(info.value)


def solve_triangular(L: Array, B: Array, *, transposed: bool = False, right: bool = False) -> None:
    """Overwrite B, (s, k) or (k, s), with L⁻¹ B (or L⁻ᵀ B; right: B L⁻¹, B L⁻ᵀ)."""
    if B.size:
        call(
            "dtrsm", "R" if right else "L", "L", "T" if transposed else "N", "N",
            B.shape[0], B.shape[1], 1.0, L, leading(L), B, leading(B),
        )  # fmt: skip


def add_product(C: Array, W: Array, factor: float) -> None:
    """Add factor times Wᵀ W to the lower triangle of C, (b, b); W is (s, b)."""
    if C.size and W.size:
        call("dsyrk", "L", "T", C.shape[0], W.shape[0], factor, W, leading(W), 1.0, C, leading(C))


def add_rank_2k(C: Array, X: Array, Y: Array) -> None:
    """Add Xᵀ Y + Yᵀ X to the lower triangle of C, (b, b); X and Y are (s, b)."""
    if C.size and X.size:
        call(
            "dsyr2k", "L", "T", C.shape[0], X.shape[0], 1.0, X, leading(X), Y, leading(Y), 1.0, C, leading(C)
        )  # fmt: skip


def multiply_symmetric(A: Array, B: Array) -> Array:
    """Return A B, (s, k), for a symmetric A, (s, s), from its lower triangle."""
    C = np.empty(B.shape, order="F")
    if C.size:
        call("dsymm", "L", "L", B.shape[0], B.shape[1], 1.0, A, leading(A), B, leading(B), 0.0, C, leading(C))
    return C


def congruent(M: Array, L: Array) -> Array:
    """Return L⁻¹ M L⁻ᵀ, (s, s), for a symmetric M; lower triangles are used."""
    A, info = M.copy(order="F"), ctypes.c_int(0)
    call("dsygst", 1, "L", len(A), A, leading(A), L, leading(L), info)
    return A


def largest_eigenpairs(A: Array, above: float) -> tuple[Array, Array]:
    """Return the eigenpairs of a symmetric A, (s, s), above a bound, largest first; A is overwritten.

    Raises
    ------
    np.linalg.LinAlgError
        If LAPACK does not converge.
    """
    n = len(A)
    bound = float(max(np.abs(A).sum(axis=0).max(initial=0.0), 2 * abs(above)) * 2 + 1)
    found, info = ctypes.c_int(0), ctypes.c_int(0)
    values, vectors = np.empty(n), np.empty((n, n), order="F")
    support = np.empty(2 * n, dtype=np.intc)
    size, whole = np.empty(1), np.empty(1, dtype=np.intc)
    work, integers = size, whole
    lengths = (-1, -1)
    for _ in range(2):  # the first call queries the workspace size
        call(
            "dsyevr", "V", "V", "L", n, A, leading(A), float(above), bound, 0, 0, 0.0, found, values, vectors, n,
            support, work, lengths[0], integers, lengths[1], info,
        )  # fmt: skip
        if lengths[0] < 0:
            lengths = (int(size[0]), int(whole[0]))
            work, integers = np.empty(lengths[0]), np.empty(lengths[1], dtype=np.intc)
    if info.value:
        raise np.linalg.LinAlgError(f"dsyevr: info = {info.value}")
    m = found.value
    return values[:m][::-1].copy(), np.asfortranarray(vectors[:, :m][:, ::-1])
