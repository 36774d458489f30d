"""Measures of agreement between measured and computed shapes: MAC, COMAC, orthogonality, scale.

Sources: Allemang (2003) for MAC and COMAC, O'Callahan, Avitabile and Riemer (1989) for the mass at the measured rows.
"""

from dataclasses import dataclass

import numpy as np
from scipy.optimize import linear_sum_assignment

from cms.assessment.correlation.errors import CorrelationError
from cms.assessment.quality.of_reduction.frequencies import mac
from fe_models.foundation.arrays import Array

__all__ = ["ModePair", "comac", "mac", "mass_at_rows", "orthogonality", "pair_modes", "scale_factors"]

LEAST_MAC = 0.5
WINDOW = 0.5  #: relative distance from the measured frequency within which a computed mode may be its partner


@dataclass(frozen=True)
class ModePair:
    """A measured mode and its partner, by index from 0."""

    measured: int
    computed: int
    mac: float
    by_hand: bool = False


def pair_modes(
    measured: Array,
    computed: Array,
    likeness: Array,
    *,
    by_hand: tuple[tuple[int, int], ...] = (),
    least_mac: float = LEAST_MAC,
    window: float = WINDOW,
) -> tuple[ModePair, ...]:
    """Pair modes such that the sum of their MAC is largest, after the manual pairs.

    Parameters
    ----------
    measured, computed
        Frequencies, (n_t,) and (n_m,) [Hz].
    likeness
        MAC, (n_t, n_m).
    by_hand
        Pairs of indices from 0; -1 as second index: the measured mode has no partner.

    Raises
    ------
    CorrelationError
        If a manual pair names a mode that does not exist, or names a mode twice.
    """
    taken_t, taken_m = set[int](), set[int]()
    pairs = []
    for k, j in by_hand:
        if not 0 <= k < len(measured) or not -1 <= j < len(computed):
            raise CorrelationError(
                f"pair of modes {k + 1}, {j + 1}: the test has {len(measured)} modes, the model {len(computed)}"
            )
        if k in taken_t or (j in taken_m and j >= 0):
            raise CorrelationError(f"pair of modes {k + 1}, {j + 1}: one of them stands in another pair")
        taken_t.add(k)
        if j >= 0:
            taken_m.add(j)
            pairs.append(ModePair(k, j, float(likeness[k, j]), True))
    ratio = computed[None, :] / measured[:, None]
    is_open = (np.abs(ratio - 1) <= window) & (likeness >= least_mac)
    is_open[list(taken_t)], is_open[:, list(taken_m)] = False, False
    rows, columns = linear_sum_assignment(np.where(is_open, -likeness, 0.0))
    pairs += [ModePair(int(k), int(j), float(likeness[k, j]))
              for k, j in zip(rows, columns, strict=True) if is_open[k, j]]  # fmt: skip
    return tuple(sorted(pairs, key=lambda pair: pair.measured))


def comac(A: Array, B: Array) -> Array:
    """Return the coordinate MAC of paired shapes (n_rows, n) at each row, (n_rows,): (sum |a b|)² / (sum a² sum b²).

    Shapes are first scaled to unit length, so that every pair has equal weight. Rows without motion have the value 1.
    """
    a, b = A / np.linalg.norm(A, axis=0), B / np.linalg.norm(B, axis=0)
    size = (a * a).sum(axis=1) * (b * b).sum(axis=1)
    product = np.abs(a * b).sum(axis=1) ** 2
    return np.asarray(np.divide(product, size, out=np.ones(len(a)), where=size > 1e-24))


def scale_factors(measured: Array, computed: Array) -> Array:
    """Return the least-squares factor from each measured shape to its computed one, (n_rows, n) each -> (n,)."""
    return np.asarray(np.einsum("rk,rk->k", measured, computed) / np.einsum("rk,rk->k", measured, measured))


def mass_at_rows(shapes: Array) -> Array:
    """Return the model mass at the measured rows, (n_rows, n_rows): (Phi_a⁺)ᵀ Phi_a⁺ of M-orthonormal modes (SEREP).

    Its rank is the number of modes. It only measures the components of a shape along these modes.

    Raises
    ------
    CorrelationError
        If the rows do not distinguish the modes: there are fewer rows than modes, or modes look alike there.
    """
    if shapes.shape[0] < shapes.shape[1] or np.linalg.cond(shapes) > 1e6:
        raise CorrelationError(
            f"{shapes.shape[0]} measured rows do not tell {shapes.shape[1]} modes of the model apart; no orthogonality"
        )
    inverse = np.linalg.pinv(shapes)
    return np.asarray(inverse.T @ inverse)


def orthogonality(measured: Array, M_a: Array, computed: Array | None = None) -> Array:
    """Return products of measured shapes, with each other or with computed ones, in the mass at their rows."""

    def scaled(X: Array) -> Array:
        mass = np.einsum("rk,rs,sk->k", X, M_a, X)
        return np.asarray(X / np.sqrt(np.where(mass > 0, mass, 1.0)))

    A = scaled(measured)
    return np.asarray(A.T @ M_a @ (A if computed is None else scaled(computed)))
