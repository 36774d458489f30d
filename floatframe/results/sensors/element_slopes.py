"""Outputs of an element as functions of small motions, from derivatives of its law."""

import numpy as np

from floatframe.engine.compiling.callbacks import raise_errors_of
from floatframe.engine.compiling.callbacks.law_slopes import difference_slopes
from floatframe.engine.compiling.public_elements import PlacedLaw
from floatframe.results.small_motions.rows import Rows, joined
from floatframe.results.small_motions.small_motions import SmallMotions

__all__ = ["output_rows"]


def output_rows(placed: PlacedLaw, small: SmallMotions) -> Rows:
    """Return the outputs of an element as functions of small motions, one row each."""
    model, work = small.compiled.model, small.work
    c, n = placed.connection, len(placed.markers)
    first = int(model.connections.a[c])
    markers = work.markers
    motion = []
    for m in range(first, first + n):
        motion += [markers.r[m], markers.A[m].ravel(), markers.v[m], markers.omega[m]]
        if placed.law.accelerations:
            motion.append(markers.acceleration[model.markers.accelerated[m]])
    unknown = [*placed.states, *placed.multipliers]
    inputs = np.concatenate([[float(work.state.time)], *motion, work.state.w[unknown]])
    slopes = difference_slopes(placed.value.address, placed.head, placed.law.data, inputs, placed.sizes)
    slopes = slopes[placed.n_out :]
    raise_errors_of([placed.value])
    parts = []
    for marker in placed.markers:
        place = small.place(marker, placed.element.name)
        parts += [place.moved, place.turned, small.velocity(place.moved), small.velocity(place.turned)]
        if placed.law.accelerations:
            parts += [small.acceleration(place.moved), small.acceleration(place.turned)]
    if unknown:
        parts.append(small.by_wrench(unknown))
    return joined(parts).turned(slopes)
