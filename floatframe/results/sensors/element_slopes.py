"""What small motions do to the outputs of an element: derivatives of its law."""

import numpy as np

from fe_models.foundation.arrays import Array
from floatframe.compiling.callbacks import raise_errors_of
from floatframe.compiling.callbacks.law_functions import called_law
from floatframe.compiling.public_elements import PlacedLaw
from floatframe.rotations import rotation_exp
from floatframe.small_motions.rows import Rows, joined
from floatframe.small_motions.small_motions import SmallMotions

__all__ = ["output_rows", "output_slopes"]

STEP = 1e-4  #: of differences, relative
LEAST = 1e-3  #: size of a state or multiplier near zero
STENCIL = ((-2, 1 / 12), (-1, -8 / 12), (1, 8 / 12), (2, -1 / 12))  #: of fourth order


def varied(inputs: Array, n: int, k: int, step: float) -> Array:
    """Return the inputs of an element with variation k (dr, dphi, dv, domega of each marker, states, multipliers)."""
    y = inputs.copy()
    if k >= 12 * n:
        y[1 + 18 * n + k - 12 * n] += step
        return y
    first, j = 1 + 18 * (k // 12), k % 12
    if j < 3:
        y[first + j] += step
    elif j < 6:
        A = y[first + 3 : first + 12].reshape(3, 3)
        y[first + 3 : first + 12] = (rotation_exp(step * np.eye(3)[j - 3]) @ A).ravel()
    else:
        y[first + 6 + j] += step
    return y


def output_slopes(placed: PlacedLaw, inputs: Array) -> Array:
    """Return the derivatives of the outputs by all variations at inputs, (n_outputs, 12 n + n_z + n_lam)."""
    n, law = len(placed.markers), placed.law
    n_columns = 12 * n + len(law.states) + len(law.multipliers)
    slopes = np.zeros((len(law.outputs), n_columns))
    for k in range(n_columns):
        size = 1.0
        if k >= 12 * n:
            size = max(abs(inputs[1 + 18 * n + k - 12 * n]), LEAST)
        elif not 3 <= k % 12 < 6:
            size = max(1.0, abs(inputs[1 + 18 * (k // 12) + k % 12 + (6 if k % 12 >= 6 else 0)]))
        h = STEP * size
        rows = np.array([varied(inputs, n, k, step * h) for step, _ in STENCIL])
        values = called_law(
            placed.value.address, placed.head, np.asarray(law.data), rows, placed.n_out + len(law.outputs)
        )[:, placed.n_out :]
        slopes[:, k] = np.array([factor for _, factor in STENCIL]) @ values / h
    raise_errors_of([placed.value])
    return slopes


def output_rows(placed: PlacedLaw, small: SmallMotions) -> Rows:
    """Return the outputs of an element by small motions, a row each."""
    model, work = small.compiled.model, small.work
    c, n = placed.connection, len(placed.markers)
    first = int(model.connections.a[c])
    markers = work.markers
    motion = [
        np.concatenate([markers.r[m], markers.A[m].ravel(), markers.v[m], markers.omega[m]])
        for m in range(first, first + n)
    ]
    unknown = [*placed.states, *placed.multipliers]
    inputs = np.concatenate([[float(work.state.time)], *motion, work.state.w[unknown]])
    slopes = output_slopes(placed, inputs)
    parts = []
    for marker in placed.markers:
        place = small.place(marker, placed.element.name)
        parts += [place.moved, place.turned, small.velocity(place.moved), small.velocity(place.turned)]
    if unknown:
        parts.append(small.by_wrench(unknown))
    return joined(parts).turned(slopes)
