"""Knots of tables and the steps of a run: steps that pass over samples, or over jumps of a driven acceleration."""

import numpy as np

from floatframe.engine.compiling.time_laws import functions_of_time
from floatframe.model.system import System
from floatframe.simulation.jumps import jump_times

__all__ = ["knot_words"]

ON_A_STEP = 1e-6  #: fraction of a step by which a knot may differ from its end


def knot_words(system: System, t_start: float, h: float, n_steps: int) -> tuple[str, ...]:
    """Return messages about table data that the steps of a run miss.

    (1) Several knots in one step: what lies between them is not seen. Where a force jumps a step ends.
    (2) A jump of a driven acceleration inside a step: the step takes it for a ramp. Jumps at the ends of steps are met.
    """
    words = []
    cuts = np.array(jump_times(system, t_start, h, n_steps))
    for where, function, is_motion, _, _ in functions_of_time(system):
        inside = (function.begins > t_start) & (function.begins < t_start + n_steps * h * (1 - 1e-12))
        knots = function.begins[inside]
        steps = np.ceil((knots - t_start) / h - ON_A_STEP)
        parts = steps + np.searchsorted(cuts, knots - ON_A_STEP * h)  # range of the steps, which jumps divide
        passed = len(knots) - len(np.unique(parts))
        if passed:
            shortest = float(np.diff(knots).min())
            words.append(
                f"{where}: steps of {h:.6g} pass over {passed} of the {len(knots)} knots of its table, which are down "
                f"to {shortest:.6g} apart: what lies between is not seen; take a shorter step, or resample the signal"
            )
        if is_motion:
            times, sizes = function.jumps(2)
            at = (times - t_start) / h
            within = (at > 0) & (at < n_steps) & (np.abs(at - np.rint(at)) > ON_A_STEP)
            if within.any():
                k = int(np.flatnonzero(within)[0])
                words.append(
                    f"{where}: its acceleration jumps inside {int(within.sum())} steps, first by {sizes[k]:.6g} at "
                    f"t = {times[k]:.9g}: forces err in these steps; let a step end there (another h, or an event with "
                    "at), or take a smoother table"
                )
    return tuple(words)
