"""Modes better and better: inverse iteration by the tree with Rayleigh-Ritz, and what error is left."""

import numpy as np
import scipy.linalg as la
import scipy.sparse as sp

from cms.solvers.sparse_product import SymmetricProduct
from cms.solvers.tall import inner
from cms.substructures.tree import SubstructureTree
from fe_models.foundation.arrays import Array, IntArray

__all__ = ["COLUMNS", "GROUP", "SLICE", "ApproximateModes"]

COLUMNS = 128  #: of a block
GROUP = 4  #: modes whose residuals are measured by one column
SLICE = 16384  #: rows that are combined at a time


class ApproximateModes:
    """Approximate modes X of K x = omega² M x, M-orthonormal, in blocks of columns; they change in place.

    All rows are in the order of elimination.
    """

    def __init__(
        self, tree: SubstructureTree, K: sp.csc_array, M: sp.csc_array, omega2: Array, blocks: list[Array]
    ) -> None:
        self.tree, self.K, self.M = tree, SymmetricProduct(K), SymmetricProduct(M)
        self.omega2 = omega2  #: Rayleigh quotients, (p,)
        self.blocks = blocks  #: X, each (n, 128 or less)
        self.residuals = np.full(len(omega2), np.nan)  #: |r|_K / omega of the modes before the last step, (p,)
        self.n_solves = 0

    def improve(self) -> None:
        """Take one step of subspace iteration; r = x - omega² K⁻¹ M x is the residual of what was there before.

        (1) Y = K⁻¹ M X, block by block in the place of X
        (2) H = Yᵀ K Y = Yᵀ M X;  G = Yᵀ M Y
        (3) |r|²_K = omega² (omega² H_jj - 1), for xᵀ K x = omega²
        (4) H z = omega² G z;  X <- Y Z
        """
        p = len(self.omega2)
        H, G = np.zeros((p, p)), np.zeros((p, p))
        starts = self._starts()
        for c in range(len(self.blocks)):
            columns = slice(starts[c], starts[c + 1])
            M_X = self.M @ self.blocks[c]
            Y = self.blocks[c]  # (1)
            Y[:] = M_X
            self.tree.solve_ordered(Y)
            self.n_solves += Y.shape[1]
            for a in range(c + 1):  # (2)
                H[starts[a] : starts[a + 1], columns] = inner(self.blocks[a], M_X)
            del M_X
            M_Y = self.M @ Y
            for a in range(c + 1):
                G[starts[a] : starts[a + 1], columns] = inner(self.blocks[a], M_Y)
        H, G = (np.triu(A) + np.triu(A, 1).T for A in (H, G))
        self.residuals = np.sqrt(np.maximum(self.omega2 * np.diag(H) - 1, 0.0))  # (3)
        scale = np.sqrt(np.diag(H))
        self.omega2, Z = la.eigh(H / np.outer(scale, scale), G / np.outer(scale, scale))  # (4)
        self._combine(Z / scale[:, None])

    def measured(self, count: int) -> Array:
        """Measure |r|_K / omega of the first modes as they are, (count,): of each, or of groups of modes together.

        The sum of r_j / omega_j with random signs over a group has the expected squared length of all of them together,
        which bounds that of each.
        """
        n_groups = -(-count // GROUP) if count > COLUMNS else count
        of_mode = (np.arange(count) * n_groups) // count
        signs = np.random.default_rng(0).choice([-1.0, 1.0], size=count)
        pick = np.zeros((count, n_groups))
        pick[np.arange(count), of_mode] = signs
        omega = np.sqrt(self.omega2[:count])
        r = self.combination(pick / omega[:, None])
        S_x = self.M @ self.combination(pick * omega[:, None])
        self.tree.solve_ordered(S_x)
        r -= S_x
        self.n_solves += n_groups
        squared = np.einsum("nk,nk->k", r, self.K @ r)
        return np.sqrt(np.maximum(squared, 0.0))[of_mode]

    def combination(self, Z: Array) -> Array:
        """Return the columns X Z of the leading modes, (n, l)."""
        total = np.zeros((self.tree.n, Z.shape[1]))
        for block, first in zip(self.blocks, self._starts(), strict=False):
            part = Z[first : first + block.shape[1]]
            if len(part):
                total += block[:, : len(part)] @ part
        return total

    def into(self, Phi: Array, rows: IntArray) -> None:
        """Put the leading modes into these rows of Phi, (n_dof, k)."""
        for block, first in zip(self.blocks, self._starts(), strict=False):
            width = min(block.shape[1], Phi.shape[1] - first)
            for a in range(0, self.tree.n if width > 0 else 0, SLICE):
                Phi[rows[a : a + SLICE], first : first + width] = block[a : a + SLICE, :width]

    def _starts(self) -> IntArray:
        return np.concatenate([[0], np.cumsum([block.shape[1] for block in self.blocks])])

    def _combine(self, Z: Array) -> None:
        starts = self._starts()
        for first in range(0, self.tree.n, SLICE):
            part = slice(first, first + SLICE)
            rows = np.concatenate([block[part] for block in self.blocks], axis=1) @ Z
            for block, a, z in zip(self.blocks, starts[:-1], starts[1:], strict=True):
                block[part] = rows[:, a:z]
