"""Derivatives of the law of an element by fourth-order differences.

They are used for linearised outputs, and to check the tangent that the element provides.
"""

from collections.abc import Sequence

import numpy as np

from fe_models.foundation.arrays import Array
from floatframe.engine.compiling.callbacks.law_functions import called_law
from floatframe.model.rotations import rotation_exp

__all__ = ["difference_slopes"]

STEP = 1e-4  #: relative step of the differences
LEAST = 1e-3  #: size used for the step of a state or multiplier whose value is near zero
N_MOTIONS = 5  #: number of entries of `sizes` that belong to motions; the sizes of the states follow
#: offsets and weights of the fourth-order central difference
STENCIL = ((-2, 1 / 12), (-1, -8 / 12), (1, 8 / 12), (2, -1 / 12))


def varied(inputs: Array, n: int, width: int, k: int, step: float) -> Array:
    """Return the inputs of a law after a step of variable k, numbered as dr, dphi, dv, domega, states, multipliers."""
    y = inputs.copy()
    per = width - 6
    if k >= per * n:
        y[1 + width * n + k - per * n] += step
        return y
    first, j = 1 + width * (k // per), k % per
    if j < 3:
        y[first + j] += step
    elif j < 6:
        A = y[first + 3 : first + 12].reshape(3, 3)
        y[first + 3 : first + 12] = (rotation_exp(step * np.eye(3)[j - 3]) @ A).ravel()
    else:
        y[first + 6 + j] += step
    return y


def size_of(sizes: Sequence[float], inputs: Array, n: int, width: int, k: int) -> float:
    """Return the size of variable k, which scales its step, from the sizes in `PlacedLaw.sizes`."""
    per = width - 6
    if k >= per * n:
        own = sizes[N_MOTIONS + k - per * n]
        return own or max(abs(float(inputs[1 + width * n + k - per * n])), LEAST)
    part = k % per // 3
    return 1.0 if part == 1 else sizes[max(part - 1, 0)]


def difference_slopes(
    address: int, head: tuple[int, ...], data: Array | Sequence[float], inputs: Array, sizes: Sequence[float]
) -> Array:  # fmt: skip
    """Return the derivatives of all results by all variables, (6 n + n_z + n_lam + n_seen, n_columns).

    sizes: typical sizes of the inputs, which scale the steps, see `PlacedLaw.sizes`.
    """
    n, width, n_z, n_lam, n_seen = head[:5]
    n_out, n_columns = 6 * n + n_z + n_lam + n_seen, (width - 6) * n + n_z + n_lam
    slopes = np.zeros((n_out, n_columns))
    for k in range(n_columns):
        h = STEP * size_of(sizes, inputs, n, width, k)
        rows = np.array([varied(inputs, n, width, k, steps * h) for steps, _ in STENCIL])
        values = called_law(address, head, np.asarray(data), rows, n_out)
        slopes[:, k] = np.array([factor for _, factor in STENCIL]) @ values / h
    return slopes
