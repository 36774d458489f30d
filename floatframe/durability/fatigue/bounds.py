"""Upper bounds of the damage of a node from its stress shapes and the modal history alone: which nodes cannot matter.

With q(t) = L z(t), L L.T = C any positive definite matrix, rho(t) = |z(t)| and the stress sigma = S q in a Euclidean
norm |A sigma|,

    |A sigma(t)| <= lam rho(t),  lam = largest singular value of A S L.          (1)

Every cycle has two turning points s_i, s_j, and the equivalent amplitude of each law for mean stress at R = -1 is at
most max(|s_i|, |s_j|), as long as that is below the strength of the law. As every value of the history is a turning
point of one cycle at most (two half ones in the residue), and damage d grows with the amplitude,

    D <= sum_t d(c lam rho(t)),  |s(t)| <= c |A sigma(t)|,                        (2)

a function of the one number lam: it is tabulated once for a history, rounded upwards. Findley's parameter takes its
normal stress from another time than its shear; there D <= n_t d(c lam max rho). C is chosen so that sum rho^k is small
for the slope k of the curve: C ~ sum rho^(k-2) q q.T, iterated from the covariance. A second bound of the same kind,
with the sizes of the shapes one by one,

    |A sigma(t)| <= sum_k |A S_k| max |q_k|,  D <= n_t d(c of that),              (3)

is taken where it is smaller.
"""

from dataclasses import dataclass

import numpy as np

from fe_models.foundation.arrays import Array
from floatframe.durability.fatigue.criteria import Criterion, largest_size
from floatframe.durability.fatigue.load_blocks import LoadBlock
from floatframe.durability.fatigue.mean_stress import MeanStress
from floatframe.durability.fatigue.sn_curve import SNCurve

__all__ = ["Envelope", "damage_bounds", "envelope", "stress_bounds"]

ROUNDING = 1.0 + 1e-9  #: of everything upwards
ROUNDS = 6  #: of the iteration for C
BINS, LEVELS = 2000, 1500  #: of rho and of lam
FLOOR = 1e-9  #: least standard deviation over the largest that C is given
AT_ONCE = 20_000  #: nodes


@dataclass(frozen=True, eq=False)
class Envelope:
    """An ellipsoid about the modal history of a block, q.T C^-1 q = rho², and how often each rho comes."""

    L: Array  #: (n_q, n_q), C = L L.T
    rho: Array  #: upper ends of classes, (n_bins,)
    counts: Array  #: times in each, (n_bins,)
    largest_q: Array  #: max |q_k|, (n_q,)
    n_times: int


def envelope(block: LoadBlock, slope: float) -> Envelope:
    """Return the envelope of a block for a curve of that slope; scaled as the block is."""
    q = block.scale * np.asarray(block.q)
    weights = np.ones(len(q))
    L = rho = np.zeros(0)
    for _ in range(ROUNDS):
        _, sizes, Vt = np.linalg.svd(weights[:, None] * q / np.sqrt((weights**2).sum()), full_matrices=False)
        sizes, V = full_basis(sizes, Vt)
        deviations = np.maximum(sizes, max(FLOOR * sizes[0], np.finfo(float).tiny ** 0.5))
        L = V * deviations
        rho = np.linalg.norm(q @ V / deviations, axis=1)
        weights = np.maximum(rho, 1e-3 * rho.max(initial=0.0)) ** (0.5 * min(max(slope - 2, 0.0), 10.0))
        if not weights.any():
            break
    top = float(rho.max(initial=0.0)) * ROUNDING
    if top == 0:
        return Envelope(L, np.ones(1), np.array([float(len(q))]), np.abs(q).max(axis=0), len(q))
    edges = np.r_[np.geomspace(1e-3 * top, top, BINS)]
    which = np.minimum(np.searchsorted(edges, rho * ROUNDING), BINS - 1)
    counts = np.bincount(which, minlength=BINS).astype(float)
    return Envelope(L, edges, counts, np.abs(q).max(axis=0), len(q))


def full_basis(sizes: Array, Vt: Array) -> tuple[Array, Array]:
    """Return as many singular values and vectors (columns) as coordinates, where a history has fewer rows."""
    n = Vt.shape[1]
    if len(Vt) == n:
        return sizes, Vt.T
    V = np.linalg.qr(np.c_[Vt.T, np.eye(n)])[0][:, :n]
    return np.r_[sizes, np.zeros(n - len(sizes))], V


def stress_bounds(stress: Array, found: Envelope, criterion: Criterion) -> tuple[Array, Array]:
    """Return lam of (1) and the sum of (3) for stress shapes (n, 6, n_q), each times c, (n,) [Pa]."""
    A, c = criterion.norm_root(), criterion.bound_factor
    lam, total = np.zeros(len(stress)), np.zeros(len(stress))
    for first in range(0, len(stress), AT_ONCE):
        part = slice(first, first + AT_ONCE)
        rows = A @ np.asarray(stress[part])
        lam[part] = largest_size(rows @ found.L)
        total[part] = np.linalg.norm(rows, axis=1) @ found.largest_q
    # roundoff of the Gram matrix is that of its largest entry
    return c * lam * (1 + 1e-6), c * total * ROUNDING


def damage_bounds(
    lam: Array, total: Array, found: Envelope, criterion: Criterion, curve: SNCurve, mean_stress: MeanStress
) -> Array:
    """Return an upper bound of the damage of one pass of a block, (n,), from the stress bounds of its nodes."""
    from floatframe.durability.fatigue.kernels.cycle_kernels import cycle_rule, sums_of_reversals

    rule, one = cycle_rule(curve, mean_stress), np.ones(1)
    of_sizes = np.zeros(len(total))
    sums_of_reversals(rule, total, one, found.n_times * one, of_sizes)
    high, low = float(lam.max(initial=0.0)), float(lam.min(where=lam > 0, initial=np.inf))
    if high == 0:
        return np.zeros(len(lam))
    levels = np.unique(lam[lam > 0]) if len(lam) <= LEVELS else np.geomspace(low, high, LEVELS) * ROUNDING
    at_levels = np.zeros(len(levels))
    if criterion.name == "findley":
        sums_of_reversals(rule, levels, found.rho[-1:], found.n_times * one, at_levels)
    else:
        filled = np.flatnonzero(found.counts)[::-1]  # the greatest first: whether it reaches the strength
        sums_of_reversals(rule, levels, found.rho[filled], found.counts[filled], at_levels)
    which = np.minimum(np.searchsorted(levels, lam), len(levels) - 1)
    return np.where(lam > 0, np.minimum(at_levels[which], of_sizes), 0.0)
