"""Estimate of the n-th natural frequency, before any mode is computed."""

import numpy as np
import scipy.sparse as sp

from cms.linear_algebra.solvers.eigen import eigenmodes
from cms.linear_algebra.substructures.dissection import Dissection
from fe_models.body.couplings.submatrix import principal_block
from fe_models.foundation.arrays import Array, IntArray

__all__ = ["guessed_omega2"]

SAMPLES = 8  #: number of subtrees whose modes are computed
EACH = 6  #: smallest number of wanted modes of a subtree, if the body has enough of them


def guessed_omega2(dissection: Dissection, K: sp.csc_array, M: sp.csc_array, count: int) -> float:
    """Estimate omega² of the highest of `count` modes, tending to be too high [1/s²].

    (1) choose subtrees that share no dof, each with some of the wanted modes
    (2) compute the modes of a few of them, with all other dofs held
    (3) take the count-th of all these modes, each weighted with the number of dofs that it represents

    Holding dofs raises frequencies. With all subtrees, (3) would be an upper bound; a sample gives an estimate.
    """
    starts, parents = dissection.starts, dissection.parents
    first = dissection.first_of_subtrees()
    sizes = starts[1:] - starts[first]
    limit = len(dissection.order) * max(EACH / max(count, 1), 1 / 64)
    is_large = sizes > limit
    is_large[-1] = True
    roots = np.flatnonzero(~is_large & is_large[parents])
    roots = roots[sizes[roots] > limit / 4] if (sizes[roots] > limit / 4).any() else roots
    if not len(roots):
        roots = np.array([dissection.n - 1])
    chosen = roots[np.unique(np.linspace(0, len(roots) - 1, SAMPLES).astype(int))]  # (1)
    covered = sizes[chosen].sum()
    omega2, weights = [], []
    for root in chosen.tolist():  # (2)
        dofs = np.sort(dissection.order[starts[first[root]] : starts[root + 1]])
        share = count * sizes[root] / covered * (covered / len(dissection.order))
        n_modes = min(int(2 * share) + 4, len(dofs))
        found = _lowest(K, M, dofs, n_modes)
        omega2.append(found)
        weights.append(np.full(len(found), len(dissection.order) / covered))
    values, weight = np.concatenate(omega2), np.concatenate(weights)
    order = np.argsort(values)
    reached = np.cumsum(weight[order]) >= count  # (3)
    return float(values[order][np.argmax(reached)] if reached.any() else values.max())


def _lowest(K: sp.csc_array, M: sp.csc_array, dofs: IntArray, n_modes: int) -> Array:
    return np.array(eigenmodes(principal_block(K, dofs), principal_block(M, dofs), n_modes, tolerance=1e-2).omega2)
