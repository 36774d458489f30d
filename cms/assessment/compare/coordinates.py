"""Coordinates in a small basis, in which many subsets of one mode set are assessed without the mesh.

All displacements that a comparison uses (rigid-body and free modes, static responses, columns of a mode set) are
expressed in one basis Q, orthonormal in W = K + omega_1² M. Then K, M and every displacement are small dense arrays,
and the W-norm is the Euclidean norm. Displacements are subtracted, not energies: this is accurate to roundoff.
"""

from dataclasses import dataclass

import numpy as np
import scipy.linalg as la

from cms.assessment.quality.reference.full_reference import fixed_rows
from cms.assessment.quality.reference.ports import Ports
from cms.linear_algebra.independent import DisplacementColumns, Products, independent_columns
from cms.modes.families.families import Families
from fe_models.foundation.arrays import Array
from fe_models.foundation.tall.columns import gram, inner, subtract

__all__ = ["Coordinates", "ReferenceBasis"]

NOISE = 1e-11  #: remainder of a unit column outside the span, in the W-norm, below which it is rounding


@dataclass(frozen=True, eq=False)
class Coordinates:
    """K, M, the nodal norm and the displacements of a comparison in a W-orthonormal basis Q, (n_dof, n_Q)."""

    K: Array  #: reduced stiffness Qᵀ K Q, (n_Q, n_Q)
    M: Array  #: reduced mass Qᵀ M Q, (n_Q, n_Q)
    root: Array  #: L with LᵀL = QᵀQ over the translations of all nodes: |L x| is the nodal norm of Q x, (n_Q, n_Q)
    MGM: Array  #: Qᵀ M G M Q with the elastic flexibility G of the free body, (n_Q, n_Q)
    fixed: Array  #: `fixed_rows` of Q, (n_h, n_Q)
    at_ports: Array  #: motion of the interface reference points in the columns of Q, (6 n_ports, n_Q)
    reference: Array  #: coordinates of the reference columns, (n_Q, n_reference)
    columns: Array  #: coordinates of the columns of the mode set, (n_Q, n_columns)

    def translation_rows(self, u: Array) -> Array:
        """Return the translations of all nodes, in axes that keep their scalar products, (n_Q, k)."""
        return self.root @ u


class ReferenceBasis:
    """The part of Q that all mode sets of a body share: the span of the reference columns."""

    def __init__(self, families: Families, ports: Ports, columns: Array, n_rigid: int, omega2: float) -> None:
        """Compute the basis of the reference columns.

        Parameters
        ----------
        families
            Mode families of a coupled body.
        ports
            Reference points of its interfaces.
        columns
            Reference displacements, by which sets are assessed, (n_dof, n_reference).
        n_rigid
            Number of M-orthonormal rigid-body modes, which are the first columns.
        omega2
            Factor omega_1² in W [1/s²].
        """
        body = families.body
        self.body, self.families, self.ports = body, families, ports
        self.n_rigid, self.omega2 = n_rigid, omega2
        self._products = Products.of_body(body).beside
        given = self._products(columns)
        self._Q, _ = independent_columns(columns, body, omega2)
        self._reference = self._inner(self._Q, given)
        self._GM = families.flexibility(self._Q.MX)
        self._nodal = body.translation_rows(self._Q.X)

    def coordinates(self, columns: Array) -> Coordinates:
        """Return the coordinates of a mode set's columns relative to the reference, (n_dof, n_columns).

        (1) scale columns to unit W-norm, and subtract their part in the span of the reference, twice
        (2) find a W-orthonormal basis Q_V of the remainders
        (3) coordinates (Q_refᵀ W V, Q_Vᵀ W V)
        """
        Q, V = self._Q, self._products(columns)
        T_Q = self._inner(Q, V)
        left = self._remainder(V)
        basis = self._products(left)
        if left.shape[1]:
            # nearly dependent columns lose their orthogonality to the reference when they are brought to unit length
            basis, _ = independent_columns(self._without_reference(basis), self.body, self.omega2)
            basis = self._products(self._without_reference(basis))
        if basis.X.shape[1]:  # in a small body, the reference may span all dofs
            G = self._inner(basis, basis)
            basis = basis @ la.solve_triangular(la.cholesky((G + G.T) / 2), np.eye(len(G)))
        T_V = self._inner(basis, V)
        reference = np.vstack([self._reference, np.zeros((len(T_V), self._reference.shape[1]))])
        M = _joined(Q.X, Q.MX, basis.X, basis.MX)
        N = reference[:, : self.n_rigid]
        elastic = np.eye(len(M)) - N @ (N.T @ M)  # rounding of K times a rigid-body motion is not energy
        moved = self.body.translation_rows(basis.X)
        values, vectors = la.eigh(_joined(self._nodal, self._nodal, moved, moved))
        return Coordinates(
            K=elastic.T @ _joined(Q.X, Q.KX, basis.X, basis.KX) @ elastic,
            M=M,
            root=np.sqrt(np.maximum(values, 0.0))[:, None] * vectors.T,
            MGM=_joined(Q.MX, self._GM, basis.MX, self.families.flexibility(basis.MX)),
            fixed=fixed_rows(self.families, np.hstack([Q.X, basis.X])),
            at_ports=np.hstack([self.ports.A @ Q.X, self.ports.A @ basis.X]),
            reference=reference,
            columns=np.vstack([T_Q, T_V]),
        )

    def _inner(self, Q: DisplacementColumns, V: DisplacementColumns) -> Array:
        return inner(Q.KX, V.X) + self.omega2 * inner(Q.MX, V.X)

    def _remainder(self, V: DisplacementColumns) -> Array:
        """Return unit columns minus their part in the span of the reference; remainders within rounding are omitted."""
        length = np.sqrt(np.maximum(self._length2(V), 0.0))
        rest = V.X / np.where(length > 0, length, 1.0)
        subtract(rest, self._Q.X, self._inner(self._Q, V) / np.where(length > 0, length, 1.0))
        left = np.sqrt(np.maximum(self._length2(self._products(rest)), 0.0))
        is_new = (left > NOISE) & (length > 0)
        return np.ascontiguousarray(rest[:, is_new] / left[is_new])

    def _without_reference(self, V: DisplacementColumns) -> Array:
        rest = V.X.copy()
        subtract(rest, self._Q.X, self._inner(self._Q, V))
        return rest

    def _length2(self, V: DisplacementColumns) -> Array:
        return np.einsum("nk,nk->k", V.X, V.KX) + self.omega2 * np.einsum("nk,nk->k", V.X, V.MX)


def _joined(X: Array, AX: Array, Y: Array, AY: Array) -> Array:
    """Return [X Y]ᵀ A [X Y] for a symmetric matrix A."""
    XAY = inner(AX, Y) if Y.shape[1] else np.zeros((X.shape[1], 0))
    return np.block([[gram(X, AX), XAY], [XAY.T, gram(Y, AY)]])
