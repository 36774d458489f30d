"""Inverse of K under any boundary conditions of the interfaces, from one factorisation of K_II, and vibration modes.

Boundary conditions, springs and loads at the interfaces only change the boundary block: the condensed stiffness S =
K_BB - K_BI K_II⁻¹ K_IB, which is small and dense. Rigid-body motions that remain free are projected out. The operator
is then the elastic flexibility Pᵀ G P of the body under these conditions, and vibration modes need no other
factorisation.
"""

from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import scipy.linalg as la
import scipy.sparse as sp

from cms.errors import BodyError, EigenError
from cms.linear_algebra.solvers.eigen import EigenResult, FactorMismatchError, counting_shift, eigenmodes
from cms.linear_algebra.solvers.factorization import Inertia, factorize, shifted_matrix
from cms.linear_algebra.solvers.mode_count import ModeCount
from cms.modes.families.fixed_interface import CondensedBody, FixedInterfaceBody, held_factor
from cms.modes.families.rigid_modes import rounding_of_energy, without_energy
from fe_models.body.couplings.coupling_on_ranks import spread_extension
from fe_models.body.fe_body import FEBody
from fe_models.foundation.arrays import Array, IntArray
from fe_models.foundation.solver import Solver
from fe_models.foundation.sparse.submatrix import PrincipalBlock, principal_block
from fe_models.foundation.tall.columns import combine, inner, of_this_process

__all__ = ["BoundaryConditions", "Flexibility", "elastic_modes"]

RIGID_MOTION = 1e-7  #: violation of the boundary conditions by a unit rigid-body motion, below which the motion is free
COUNTED = 1e-11  #: relative eigenvalue of the scaled boundary block, above which its sign is certain


@dataclass(frozen=True, eq=False)
class BoundaryConditions:
    """Admissible motion of the dofs h, u_h = Z z, with stiffness and mass of the neighbours attached to them."""

    Z: Array  #: free directions, orthonormal columns, (n_h, n_z)
    K_load: Array | None = None  #: stiffness of the neighbours over the held dofs, (n_h, n_h) [N/m]
    M_load: Array | None = None  #: mass of the neighbours over the held dofs, (n_h, n_h) [kg]

    @classmethod
    def free(cls, n_h: int) -> "BoundaryConditions":
        """Return the boundary conditions of a free body."""
        return cls(np.eye(n_h))

    @property
    def key(self) -> bytes:
        """Bytes that identify these boundary conditions."""
        parts = (self.Z, self.K_load, self.M_load)
        return b"|".join(b"" if part is None else np.ascontiguousarray(part).tobytes() for part in parts)


class Flexibility:
    """x = G f on the dofs that are free under the conditions: the interior dofs and z, u = T x (n_dof, n).

    (1) f <- P f, P = 1 - M N Nᵀ: equilibrium with the acceleration of the free M-orthonormal rigid-body motions N
    (2) v = K_II⁻¹ f_I;  g = Zᵀ (f_h - K_hI v)
    (3) (Zᵀ (S + K_load) Z)_ee z_e = g_e, with z = 0 at as many pivots r as there are rigid-body motions
    (4) u_h = Z z;  u_I = v + Psi_C,I u_h
    (5) u <- Pᵀ u, so that Nᵀ M u = 0

    M and K include the load of the neighbours. The operator is symmetric, and its null space is M N. `eigenmodes` uses
    it as solver.
    """

    def __init__(self, condensed: CondensedBody, conditions: BoundaryConditions, r: IntArray | None = None) -> None:
        """Prepare the operator; r are the pivots among the columns of Z; None: pivoted QR chooses them."""
        self.condensed, self.conditions = condensed, conditions
        body, h, Z = condensed.fixed.body, condensed.fixed.b, conditions.Z
        self._K_hi = sp.csr_array(body.K[:, h].T)[:, condensed.fixed.i]
        S = condensed.S if conditions.K_load is None else condensed.S + conditions.K_load
        S_z = Z.T @ S @ Z
        motions = _free_motions(condensed, conditions)
        on_z = Z.T @ motions[h]
        n_n = motions.shape[1]
        self.r = _pivots(on_z / _lengths(body, h, Z)[:, None]) if r is None else r
        self.e = np.setdiff1d(np.arange(Z.shape[1]), self.r)
        self._factor = held_factor(condensed, Z, S_z, self.e, conditions.K_load)
        self.T = None if Z.shape[0] == Z.shape[1] else _expansion(condensed, Z)
        self.M = self._with_load(body.M, conditions.M_load)
        self.K = self._with_load(body.K, conditions.K_load)
        self.N, self.M_N = self._orthonormal(motions if self.T is None else self.T.T @ motions)
        self.n = self.M.shape[0]
        self.n_rigid = n_n

    @property
    def numbering(self) -> IntArray | None:
        """Row numbers, (n,), independent of the order of interior dofs (see `eigenmodes`); None: the stored order."""
        if self.T is None:
            return None
        i = self.condensed.fixed.i
        return np.concatenate([np.searchsorted(np.sort(i), i), np.arange(len(i), self.n)])

    @property
    def description(self) -> str:
        """Name and settings of the solver, for the provenance."""
        return f"{self.condensed.fixed.factorization.description}, boundary by its condensed stiffness"

    @property
    def solver(self) -> Solver:
        """The solver that factorised the interior stiffness."""
        return self.condensed.fixed.factorization.solver

    @property
    def inertia(self) -> Inertia:
        """Inertia of K - sigma M at a shift sigma between the rigid-body motions and the first elastic mode."""
        n_negative = self.condensed.fixed.n_multipliers + self.n_rigid
        return Inertia(n_negative, 0, self.n - n_negative)

    def solve(self, f: Array) -> Array:
        """Return Pᵀ G P f, (n, k), f (n, k): steps (1) to (5)."""
        if self.n_rigid:
            f = f - combine(self.M_N, inner(self.N, f))
        u = self.held(f)
        if self.n_rigid:
            u -= combine(self.N, inner(self.M_N, u))
        return u

    def held(self, f: Array) -> Array:
        """Return the static response to f with the pivots fixed, (n, k): steps (2) to (4)."""
        fixed, Z = self.condensed.fixed, self.conditions.Z
        i, h = fixed.i, fixed.b
        n_i = len(i)
        f_i, f_z = (f[i], Z.T @ f[h]) if self.T is None else (f[:n_i], f[n_i:])
        v = fixed.factorization.solve(f_i)
        g = f_z - Z.T @ (self._K_hi @ v)
        z = np.zeros((Z.shape[1], f.shape[1]))
        z[self.e] = self.solve_boundary(g[self.e])
        u = of_this_process(combine(self.condensed.Psi_C, Z @ z))
        u[i] += v
        return u if self.T is None else np.concatenate([u[i], z])

    def solve_boundary(self, g: Array) -> Array:
        """Return z_e for loads g_e on the condensed stiffness, (n_e, k)."""
        size, factor = self._factor
        return g * 0.0 if not len(size) else size[:, None] * la.cho_solve(factor, size[:, None] * g)

    def count_below(self, sigma: float) -> int:
        """Count the elastic modes below sigma [1/s²] from the inertia of K - sigma M, block by block.

        The count is the number of negative eigenvalues of K_II - sigma M_II, from one more factorisation, plus those of
        the remainder condensed onto z, which is small and dense, minus those of multipliers and rigid-body motions.

        Raises
        ------
        EigenError
            If pivots are zero within rounding, so that they cannot be counted.
        """
        fixed, conditions = self.condensed.fixed, self.conditions
        i, h, Z = fixed.i, fixed.b, conditions.Z
        body = fixed.body
        A_hz = (body.K[:, h] - sigma * body.M[:, h]) @ Z
        A_zz = Z.T @ A_hz[h]
        for load, factor in ((conditions.K_load, 1.0), (conditions.M_load, -sigma)):
            if load is not None:
                A_zz = A_zz + factor * (Z.T @ load @ Z)
        K_ii, M_ii = PrincipalBlock(body.K, i), PrincipalBlock(body.M, i)
        with factorize(shifted_matrix(K_ii, M_ii, sigma), definite=False, solver=self.solver) as shifted:
            inertia = shifted.inertia
            A_zz = A_zz - A_hz[i].T @ shifted.solve(A_hz[i]) if A_zz.size else A_zz
        size = 1 / np.sqrt(np.where(np.diag(A_zz) != 0, np.abs(np.diag(A_zz)), 1.0))
        values = la.eigvalsh((A_zz + A_zz.T) / 2 * np.outer(size, size)) if A_zz.size else np.zeros(0)
        if inertia.n_zero or (len(values) and np.abs(values).min() < COUNTED * np.abs(values).max()):
            raise EigenError(
                "eigenmodes: pivots are zero within rounding, so that modes cannot be counted there; ask for another "
                "number of modes, or do without the proof"
            )
        return inertia.n_negative + int((values < 0).sum()) - fixed.n_multipliers - self.n_rigid

    def expand(self, x: Array) -> Array:
        """Return displacement columns over all dofs, (n_dof, k), of columns x, (n, k)."""
        return x if self.T is None else self.T @ x

    def _with_load(self, A: sp.csc_array, load: Array | None) -> sp.csc_array:
        """Return Tᵀ (A + load) T; distributed if A is distributed."""
        if load is None and self.T is None:
            return A
        fixed = self.condensed.fixed
        is_spread = fixed.body.layout is not None
        if load is not None:
            h, n = fixed.b, A.shape[0]
            row, column = np.nonzero(load)
            added = sp.csc_array((load[row, column], (h[row], h[column])), shape=(n, n))
            A = spread_extension(A, np.arange(n), added) if is_spread else sp.csc_array(A + added)
        if self.T is None:
            return A
        if is_spread:
            return spread_extension(A, fixed.i, _boundary_entries(A, fixed, self.conditions.Z))
        if self.T.shape[1] == len(self.condensed.fixed.i):
            return principal_block(A, self.condensed.fixed.i)
        A = sp.csc_array(self.T.T @ A @ self.T)
        A.sort_indices()
        return A

    def _orthonormal(self, motions: Array) -> tuple[Array, Array]:
        """Return M-orthonormal combinations N of the rigid-body motions, and M N."""
        if not motions.shape[1]:
            return motions, motions
        M_N = self.M @ motions
        G = motions.T @ M_N
        size = np.sqrt(np.maximum(np.diag(G), 0.0))
        if not size.all() or la.eigvalsh(G / np.outer(size, size))[0] < 1e-12:
            raise BodyError(
                f"body {self.condensed.fixed.body.name!r}: has no inertia in some rigid-body motion; free and "
                "attachment modes need all of them; take constraint modes (guyan, craig-bampton), or add the missing "
                "mass"
            )
        L = la.cholesky(G / np.outer(size, size), lower=True)
        scale = la.solve_triangular(L, np.diag(1 / size), lower=True).T
        return motions @ scale, M_N @ scale


def _free_motions(condensed: CondensedBody, conditions: BoundaryConditions) -> Array:
    """Return the rigid-body motions that the boundary conditions allow, (n_dof, n_n)."""
    h, Z = condensed.fixed.b, conditions.Z
    Psi_R = condensed.Psi_R
    if not Psi_R.shape[1]:
        return Psi_R  # a body fixed to the ground has no rigid-body motions
    size = _lengths(condensed.fixed.body, h, np.eye(len(h)))
    scaled = Psi_R[h] / size[:, None]
    column = np.abs(scaled).max(axis=0)
    scaled = scaled / column
    against = scaled - (Z / size[:, None]) @ (Z.T @ (scaled * size[:, None]))
    spring = _root_of_load(condensed, conditions, size) @ (Psi_R[h] / column)
    no_condition = np.zeros((Psi_R.shape[1], Psi_R.shape[1]))  # enough rows that the SVD returns all right vectors
    _, sizes, vectors = la.svd(np.vstack([against, spring, no_condition]), full_matrices=False)
    return (Psi_R / column) @ vectors[sizes < RIGID_MOTION].T


def _root_of_load(condensed: CondensedBody, conditions: BoundaryConditions, size: Array) -> Array:
    """Return R with Rᵀ R = K_load / k, (k, n_h), where k is the largest stiffness of the body at the interfaces.

    Singular values of R resolve motions of the size of rounding; eigenvalues of K_load would be their squares.
    """
    if conditions.K_load is None:
        return np.zeros((0, len(size)))
    stiffness = np.abs(condensed.S * np.outer(size, size)).max()
    values, vectors = la.eigh(conditions.K_load * np.outer(size, size) / stiffness)
    if values[0] < -1e-12 * max(values[-1], 1.0):
        raise BodyError(
            f"body {condensed.fixed.body.name!r}: the stiffness of its neighbours has negative energy in some motion; "
            "expected a symmetric positive semidefinite matrix"
        )
    return np.sqrt(np.maximum(values, 0.0))[:, None] * vectors.T / size


def _lengths(body: FEBody, h: IntArray, Z: Array) -> Array:
    """Return the scale of each direction: 1 for translations, 1 / body length for rotations, (n_z,)."""
    is_rotation = (body.dofs[h, 1] >= 3).astype(float)
    turned = Z.T**2 @ is_rotation > 0.5
    return np.where(turned, 1 / body.length, 1.0)


def _pivots(motions: Array) -> IntArray:
    """Return as many rows as there are motions such that fixing these rows prevents the motions, ascending."""
    n = motions.shape[1]
    if n == 0:
        return np.zeros(0, np.int64)
    _, _, pivots = la.qr(motions.T, mode="economic", pivoting=True)
    return np.sort(pivots[:n]).astype(np.int64)


def _boundary_entries(A: Any, fixed: FixedInterfaceBody, Z: Array) -> sp.csc_array:
    """Return Tᵀ A T without its interior block, (n_i + n_z, n_i + n_z)."""
    n_i, n_z = len(fixed.i), Z.shape[1]
    A_z = sp.csc_array(A[:, fixed.b] @ sp.csc_array(Z))
    A_zi, A_zz = sp.coo_array(A_z[fixed.i].T), sp.coo_array(sp.csc_array(Z).T @ A_z[fixed.b] / 2)
    rows = n_i + np.concatenate([A_zi.row, A_zz.row])
    columns = np.concatenate([A_zi.col, n_i + A_zz.col])
    half = sp.coo_array((np.concatenate([A_zi.data, A_zz.data]), (rows, columns)), shape=(n_i + n_z,) * 2).tocsc()
    return sp.csc_array(half + half.T)


def _expansion(condensed: CondensedBody, Z: Array) -> sp.csc_array:
    """Return T in u = T x, x = (interior, z), (n_dof, n_i + n_z)."""
    fixed = condensed.fixed
    n_i = len(fixed.i)
    row, column = np.nonzero(Z)
    rows = np.concatenate([fixed.i, fixed.b[row]])
    columns = np.concatenate([np.arange(n_i), n_i + column])
    values = np.concatenate([np.ones(n_i), Z[row, column]])
    return sp.csc_array((values, (rows, columns)), shape=(condensed.fixed.body.n_dof, n_i + Z.shape[1]))


# vibration modes of a body whose interfaces are free, loaded, or partly held (docs/theory.md §2) ----------------------


#: for a mode held by the neighbours alone: rounding of the body's energy relative to omega², above which omega² is lost
LOST = 2e-3


def elastic_modes(flexibility: Flexibility, wanted: ModeCount) -> EigenResult:
    """Return elastic vibration modes under any boundary conditions of the interfaces, over all dofs (n_dof, k).

    Free modes belong to a free boundary, loaded modes to K + K_load, M + M_load, and mixed modes hold some boundary
    dofs. The rigid-body motions that the conditions leave free are known in advance, and are not among the modes.
    """
    K, M, numbering = flexibility.K, flexibility.M, flexibility.numbering
    try:
        modes = eigenmodes(K, M, replace(wanted, verify=False), factorization=flexibility, numbering=numbering)
    except FactorMismatchError as error:
        raise _lost_in_rounding(flexibility) from error
    if wanted.verify:
        modes = _proven(flexibility, modes, wanted)
    modes = modes.over(flexibility.expand)
    if flexibility.conditions.K_load is not None:
        body, omega2 = flexibility.condensed.fixed.body, modes.omega2
        rounding = rounding_of_energy(body, modes.Phi)
        if (without_energy(body, modes.Phi) & (rounding > LOST * omega2)).any():
            raise _lost_in_rounding(flexibility)
    return modes


def _lost_in_rounding(flexibility: Flexibility) -> EigenError:
    """Return the error about motions whose stiffness is near the rounding of the largest stiffness."""
    load = flexibility.conditions.K_load
    largest = float(np.abs(flexibility.K.diagonal()).max())
    softest = "" if load is None else f", those of its neighbours {np.abs(np.diag(load)).max():.1e} at most"
    name = flexibility.condensed.fixed.body.name
    return EigenError(
        f"body {name!r}: its slowest modes are lost in rounding: some motion besides the rigid ones has almost no "
        f"stiffness compared with the largest stiffness, {largest:.1e}{softest}; rounding is about "
        f"{np.finfo(float).eps * largest:.1e}: increase the stiffness of this motion, or remove it"
    )


def _proven(flexibility: Flexibility, modes: EigenResult, asked: ModeCount) -> EigenResult:
    """Return the modes after a check that the inertia confirms their number, counted for boundary and interior.

    The proof of `eigenmodes` would factorise K - sigma M as a whole. This fails for the reference node of a
    distributing interface, which has zero pivots, because it has multipliers but neither mass nor stiffness.
    """
    k = len(modes.omega2)
    wanted = ModeCount(k) if asked.cutoff is None else asked
    last, sigma = counting_shift(modes.omega2, k, wanted, 0.0)
    for n_extra in (4, 12, 36):  # a gap for counting lies beyond the requested modes
        try:
            more = eigenmodes(
                flexibility.K, flexibility.M, k + n_extra, factorization=flexibility, numbering=flexibility.numbering
            )
        except EigenError:  # no more modes exist
            break
        last, sigma = counting_shift(more.omega2, k, wanted, 0.0)
        if last < k + n_extra:
            break
    n_below = flexibility.count_below(sigma)
    if n_below != last:
        raise EigenError(
            f"eigenmodes: found {last} modes below {np.sqrt(sigma) / (2 * np.pi):.6g} Hz, but the inertia counts "
            f"{n_below}; ask for more modes"
        )
    return replace(modes, is_proven=True)
