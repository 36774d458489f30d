"""Elimination of substructures one after the other: modes of each, and its contribution to enclosing separators."""

import ctypes
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cache
from typing import Any

import numpy as np
import scipy.linalg as la
import scipy.sparse as sp

from cms.errors import FactorizationError
from cms.linear_algebra.lu_factors import solve_factored
from cms.linear_algebra.sparse_cholesky.lapack import routine_address
from fe_models.foundation.arrays import Array, IntArray

__all__ = [
    "Part",
    "Reduced",
    "Remainder",
    "Substructure",
    "add_product",
    "add_rank_2k",
    "cholesky",
    "congruent",
    "eliminate_part",
    "largest_eigenpairs",
    "multiply_symmetric",
    "solve_triangular",
]


# dense linear algebra in place, with the routines of SciPy's BLAS and LAPACK called by their C addresses --------------
# SciPy's own Python functions mostly hold the interpreter lock while they run, so threads would wait for each other.
# Called through `ctypes`, the same routines do not. All matrices are in Fortran order; of symmetric matrices, the lower
# triangle is read and written.


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
    """Return the leading dimension of a matrix in Fortran order, which may be a block of a larger matrix."""
    return max(A.strides[1] // 8 if A.shape[1] > 1 else A.shape[0], A.shape[0], 1)


def cholesky(A: Array) -> int:
    """Overwrite the lower triangle of A, (s, s), with L, where A = L Lᵀ; return 0, or the number of the failed row."""
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


# elimination ----------------------------------------------------------------------------------------------------------


DEPENDENT = 1e-10  #: size of a constraint relative to the largest, below which it is redundant


@dataclass(frozen=True, eq=False)
class Substructure:
    """Eliminated substructure with s dofs; b dofs of enclosing separators affect it."""

    start: int  #: first dof in elimination order
    boundary: IntArray  #: dofs of enclosing separators that affect it, ascending, (b,)
    L: Array  #: Cholesky factor of the condensed stiffness, lower triangle, (s, s)
    Psi: Array  #: constraint modes of the substructure, -K_ss⁻¹ K_sb, (s, b)
    Phi: Array  #: modes with all enclosing separators fixed, orthonormal in the condensed mass, (s, m)
    omega2: Array  #: squared angular frequencies of these modes, ascending, (m,) [1/s²]
    coupling: Array  #: mass between the modes of all substructures below, in order, and these modes, (m_below, m)
    children: tuple[int, ...]
    #: pivots of a root with multipliers, whose L then has the factors of SciPy's `lu_factor`; otherwise None
    pivots: IntArray | None = None
    #: root with multipliers: S with S Sᵀ f = u for [K Cᵀ; C 0] [u; .] = [f; 0], (s, s - n_ties); otherwise None
    spread: Array | None = None

    @property
    def stop(self) -> int:
        """Index after the last dof of the substructure."""
        return self.start + len(self.L)

    @property
    def n_numbers(self) -> int:
        """Number of stored numbers."""
        return self.L.size + self.Psi.size + self.Phi.size + self.coupling.size

    def solve_own(self, f: Array) -> None:
        """Overwrite f, (s, k) in C order, with K_ss⁻¹ f."""
        if self.pivots is not None:
            f[:] = solve_factored((self.L, self.pivots), f)
            return
        solve_triangular(self.L, f.T, transposed=True, right=True)
        solve_triangular(self.L, f.T, right=True)

    def spread_own(self, xi: Array) -> None:
        """Overwrite xi, (s, k) in C order, with S xi, where S Sᵀ = K_ss⁻¹."""
        if self.spread is not None:
            xi[:] = self.spread @ xi[: self.spread.shape[1]]
            return
        solve_triangular(self.L, xi.T, right=True)


@dataclass(frozen=True, eq=False)
class Remainder:
    """Contributions of eliminated substructures to the enclosing separators."""

    boundary: IntArray  #: dofs of the enclosing separators, ascending, (b,)
    K: Array  #: condensed stiffness, lower triangle, (b, b)
    M: Array  #: condensed mass, lower triangle, (b, b)
    rows: Array  #: mass coupling between all modes below and the boundary, (m_below, b)


@dataclass(frozen=True, eq=False)
class Part:
    """Task: consecutive substructures that are eliminated together, a complete subtree or a separator at the top.

    K and M hold the columns of its dofs of the lower triangles in elimination order. Rows and dofs are numbered over
    the whole body.
    """

    starts: IntArray  #: first dof of each substructure, and the end, (n + 1,)
    #: children of each substructure, by index in this part; negative: index into `remainders` from the end
    children: tuple[tuple[int, ...], ...]
    K: sp.csc_array
    M: sp.csc_array
    omega2: float  #: squared frequency up to which modes of substructures are retained [1/s²]
    multipliers: IntArray  #: dofs that are Lagrange multipliers; all are in the root
    remainders: tuple[Remainder, ...] = ()


@dataclass(frozen=True, eq=False)
class Reduced:
    """An eliminated part."""

    substructures: tuple[Substructure, ...]
    remainder: Remainder


def eliminate_part(part: Part) -> Reduced:
    """Eliminate all substructures of a part, children first.

    Raises
    ------
    FactorizationError
        If a condensed stiffness is not positive definite.
    """
    done: list[Substructure] = []
    left: dict[int, Remainder] = {k - len(part.remainders): r for k, r in enumerate(part.remainders)}
    for t, children in enumerate(part.children):
        below = [left.pop(child) for child in children]
        substructure, left[t] = eliminate(part, t, below, children)
        done.append(substructure)
    return Reduced(tuple(done), left[len(done) - 1])


def eliminate(
    part: Part, t: int, below: Sequence[Remainder], children: tuple[int, ...]
) -> tuple[Substructure, Remainder]:
    """Eliminate substructure t of a part; s are its dofs, b the dofs of enclosing separators.

    (1) assemble K and M of s and b: entries of the body in the columns of s, plus contributions of the substructures
        below
    (2) K_ss = L Lᵀ,  W = L⁻¹ K_sb,  Psi = -L⁻ᵀ W;  K_bb <- K_bb - Wᵀ W
    (3) modes with b fixed: K_ss phi = omega² M_ss phi up to the bound; none if K_ss - bound M_ss is positive definite
    (4) M_bb <- Psi_ᵀ M Psi_ with Psi_ = [Psi; 1]: M_bb + Psiᵀ X + Xᵀ Psi,  X = M_sb + M_ss Psi / 2
    (5) mass between own modes and b: phiᵀ (M_sb + M_ss Psi);  between modes below and b: D_b + D_s Psi, and own modes:
        D_s phi
    """
    from cms.linear_algebra.substructures.extend_add import extend_add, put_rows

    start, stop = int(part.starts[t]), int(part.starts[t + 1])
    s = stop - start
    first = int(part.starts[0])
    entries = slice(part.K.indptr[start - first], part.K.indptr[stop - first])
    outside = part.K.indices[entries]
    boundary = np.unique(np.concatenate([outside[outside >= stop], *[r.boundary[r.boundary >= stop] for r in below]]))
    b = len(boundary)
    K_ss, K_sb, K_bb = _assembled(part.K, start - first, start, stop, boundary)  # (1)
    M_ss, M_sb, M_bb = _assembled(part.M, start - first, start, stop, boundary)
    m_below = sum(len(r.rows) for r in below)
    D = np.zeros((m_below, s + b))
    row = 0
    for r in below:
        p = int(np.searchsorted(r.boundary, stop))
        own, out = r.boundary[:p] - start, np.searchsorted(boundary, r.boundary[p:])
        place = np.concatenate([own, out])
        extend_add(K_ss, K_sb, K_bb, r.K, place, p)
        extend_add(M_ss, M_sb, M_bb, r.M, place, p)
        put_rows(D, r.rows, row, np.concatenate([own, s + out]))
        row += len(r.rows)
    if len(part.multipliers) and part.multipliers[-1] < stop:
        return _root_with_multipliers(part, start, K_ss, M_ss, D, children)
    L = K_ss.copy(order="F")
    if (failed := cholesky(L)) != 0:  # (2)
        raise FactorizationError(
            f"substructures: a pivot is zero or negative (dof {start + failed} in the order of elimination)"
        )
    Psi = K_sb
    solve_triangular(L, Psi)
    add_product(K_bb, Psi, -1.0)
    solve_triangular(L, Psi, transposed=True)
    np.negative(Psi, out=Psi)
    omega2, Phi = own_modes(K_ss, M_ss, L, part.omega2)  # (3)
    M_Psi = multiply_symmetric(M_ss, Psi)
    X = M_sb + M_Psi / 2
    add_rank_2k(M_bb, Psi, X)  # (4)
    M_Psi += M_sb
    rows = np.empty((m_below + len(omega2), b))  # (5)
    np.matmul(D[:, :s], Psi, out=rows[:m_below])
    rows[:m_below] += D[:, s:]
    np.matmul(Phi.T, M_Psi, out=rows[m_below:])
    done = Substructure(start, boundary, L, Psi, Phi, omega2, D[:, :s] @ Phi, children)
    return done, Remainder(boundary, K_bb, M_bb, rows)


def _root_with_multipliers(
    part: Part, start: int, K_ss: Array, M_ss: Array, D: Array, children: tuple[int, ...]
) -> tuple[Substructure, Remainder]:
    """Eliminate a root that contains multipliers and all dofs that they tie: K_ss = [K Cᵀ; C 0].

    Its modes are those of K and M in the null space of C, with orthonormal basis Z.
    """
    K_ss, M_ss = (np.tril(A) + np.tril(A, -1).T for A in (K_ss, M_ss))
    is_tie = np.zeros(len(K_ss), dtype=bool)
    is_tie[part.multipliers - start] = True
    C = K_ss[np.ix_(is_tie, ~is_tie)]
    Q, R, _ = la.qr(C.T, pivoting=True)
    size = np.abs(np.diag(R))
    if not (len(size) and size[-1] > DEPENDENT * size[0]) or len(size) < len(C):
        raise FactorizationError("substructures: constraints of distributing interfaces are linearly dependent")
    Z = Q[:, len(C) :]
    K, M = (np.asfortranarray(Z.T @ A[np.ix_(~is_tie, ~is_tie)] @ Z) for A in (K_ss, M_ss))
    L = K.copy(order="F")
    if cholesky(L) != 0:
        raise FactorizationError("substructures: a pivot of the root is zero or negative")
    omega2, Phi_z = own_modes(K, M, L, part.omega2)
    Phi = np.zeros((len(K_ss), len(omega2)), order="F")
    Phi[~is_tie] = Z @ Phi_z
    factors, pivots = la.lu_factor(K_ss)
    spread = np.zeros((len(K_ss), Z.shape[1]))
    spread[~is_tie] = la.solve_triangular(L, Z.T, lower=True).T
    none = np.zeros(0, dtype=np.int64)
    empty = np.zeros((0, 0), order="F")
    Psi = np.zeros((len(K_ss), 0), order="F")
    done = Substructure(start, none, factors, Psi, Phi, omega2, D @ Phi, children, pivots, spread)
    return done, Remainder(none, empty, empty, np.zeros((len(D) + len(omega2), 0)))


def own_modes(K: Array, M: Array, L: Array, bound: float) -> tuple[Array, Array]:
    """Step (3): return omega² up to a bound, ascending, and M-orthonormal modes; K and M may be overwritten.

    M may be semidefinite: A = L⁻¹ M L⁻ᵀ has eigenvalues theta = 1 / omega², and 0 for massless directions.
    """
    s = len(K)
    K -= bound * M
    if cholesky(K) == 0:
        return np.zeros(0), np.zeros((s, 0), order="F")
    theta, Q = largest_eigenpairs(congruent(M, L), 1 / bound)
    solve_triangular(L, Q, transposed=True)
    Q /= np.sqrt(theta)
    return 1 / theta, Q


def _assembled(A: sp.csc_array, first: int, start: int, stop: int, boundary: IntArray) -> tuple[Array, Array, Array]:
    """Step (1): return the entries of the body matrix: A_ss (lower triangle), A_sb, and an empty A_bb."""
    s, b = stop - start, len(boundary)
    A_ss, A_sb, A_bb = (np.zeros(shape, order="F") for shape in ((s, s), (s, b), (b, b)))
    entries = slice(A.indptr[first], A.indptr[first + s])
    rows, values = A.indices[entries], A.data[entries]
    columns = np.repeat(np.arange(s), np.diff(A.indptr[first : first + s + 1]))
    own = rows < stop
    A_ss[rows[own] - start, columns[own]] = values[own]
    A_sb[columns[~own], np.searchsorted(boundary, rows[~own])] = values[~own]
    return A_ss, A_sb, A_bb
