"""The modes, supplies, loads, prescribed motions and table points that a step size resolves, with numbers."""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from fe_models.foundation.arrays import Array
from floatframe.engine.compiling.system import compiled_system
from floatframe.engine.compiling.time_laws import functions_of_time, parts_of_time
from floatframe.engine.initial_conditions.newton_equations import modal_diagonals
from floatframe.engine.kernels.model import MASS, STIFFNESS
from floatframe.model.system import System
from floatframe.simulation.jumps import jump_times

__all__ = ["StepAdvice", "frequency_words", "knot_words", "step_advice", "step_warnings"]

FOLLOWED = 20.0  #: steps per period at which generalized-alpha reproduces the period of a mode within about 1 %
N_PLACES = 2000  #: number of times in a run at which varying frequencies are evaluated
#: distance of a table point from the end of a step, as a fraction of the step, up to which they coincide
ON_A_STEP = 1e-6
SEEN = 2.0  #: steps per period below which a mode cannot be seen in the results


@dataclass(frozen=True)
class StepAdvice:
    """Modes of bodies compared with a step size; frequencies are those of the single bodies in their frames."""

    h: float  #: step size [s]
    n_modes: int  #: number of modes with mass and stiffness in all bodies
    n_followed: int  #: number of modes with at least 20 steps per period
    n_unseen: int  #: number of modes with less than two steps per period
    slowest: float  #: lowest frequency [Hz]
    fastest: float  #: highest frequency [Hz]
    fastest_body: str
    fastest_mode: int  #: number of the fastest mode in its body, from 1

    @property
    def h_slowest(self) -> float:
        """Step size that resolves the slowest mode [s]."""
        return 1 / (FOLLOWED * self.slowest)

    @property
    def h_fastest(self) -> float:
        """Step size that resolves the fastest mode [s]."""
        return 1 / (FOLLOWED * self.fastest)

    @property
    def words(self) -> str:
        """Return one sentence on the modes that the step size resolves, and on the step sizes that resolve more."""
        return (
            f"h = {self.h:.3g} resolves {self.n_followed} of {self.n_modes} modes ({FOLLOWED:g} steps per period); the "
            f"fastest, mode {self.fastest_mode} of body {self.fastest_body!r}, has {1 / (self.h * self.fastest):.2g} "
            f"steps in its period of {1 / self.fastest:.3g}: the slowest mode needs h = {self.h_slowest:.2g}, "
            f"the fastest {self.h_fastest:.2g}"
        )


def step_advice(system: System, h: float) -> StepAdvice | None:
    """Return the modes that a step size resolves; None for a system without modes."""
    model = compiled_system(system).model
    frequencies, owners = [], []
    for i, name in enumerate(compiled_system(system).body_names):
        M, K = modal_diagonals(model, i, MASS), modal_diagonals(model, i, STIFFNESS)
        for k in np.flatnonzero((M > 0) & (K > 0)):
            frequencies.append(float(np.sqrt(K[k] / M[k])) / (2 * np.pi))
            owners.append((name, int(k) + 1))
    if not frequencies:
        return None
    steps = 1 / (h * np.array(frequencies))
    fastest = int(np.argmin(steps))
    return StepAdvice(
        h=h,
        n_modes=len(steps),
        n_followed=int((steps >= FOLLOWED * (1 - 1e-9)).sum()),
        n_unseen=int((steps < SEEN).sum()),
        slowest=min(frequencies),
        fastest=max(frequencies),
        fastest_body=owners[fastest][0],
        fastest_mode=owners[fastest][1],
    )


def step_warnings(
    system: System, t_start: float, h: float, n_steps: int, *, has_steps_of_one_size: bool = True
) -> tuple[tuple[str, str], ...]:
    """Return all that is doubtful about the step size before a run: (kind, message).

    The kinds are "modes" (steps of one size that resolve no mode of a body), "frequency" and "knots".
    """
    advice = step_advice(system, h)
    found = []
    if has_steps_of_one_size and advice is not None and advice.n_followed == 0:
        found.append(("modes", advice.words))
    found += [("knots", words) for words in knot_words(system, t_start, h, n_steps)]
    found += [
        ("frequency", words)
        for words in frequency_words(system, t_start, h, n_steps, has_steps_of_one_size=has_steps_of_one_size)
    ]
    return tuple(found)


def frequency_words(
    system: System, t_start: float, h: float, n_steps: int, *, has_steps_of_one_size: bool = True
) -> tuple[str, ...]:
    """Return a message about supplies, loads and prescribed motions with frequencies that the steps do not resolve.

    For a method that controls its steps, it names only frequencies with less than two steps per period.
    """
    words = []
    most = FOLLOWED if has_steps_of_one_size else SEEN
    for where, frequency in highest_frequencies(system, np.linspace(t_start, t_start + n_steps * h, N_PLACES)):
        if frequency > 0.0 and 1 / (h * frequency) < most * (1 - 1e-9):
            words.append(
                f"{where}: steps of {h:.6g} do not follow its frequency: {1 / (h * frequency):.3g} steps in its period "
                f"of {1 / frequency:.4g}; h = {1 / (FOLLOWED * frequency):.2g} has {FOLLOWED:g}"
            )
    return tuple(words)


def highest_frequencies(system: System, t: Array) -> Iterator[tuple[str, float]]:
    """Yield, for each source, its path in the system and its highest frequency [1/s] over the times t, (n_t,).

    Sources are sines in functions of time, expressions of time alone, and the method `frequencies` of elements.
    """
    for each in functions_of_time(system):
        function = each.function
        acts = (function.begins < t[-1]) & (np.append(function.begins[1:], np.inf) > t[0])
        acts[0] |= function.begins[0] >= t[0]  # the first piece also applies before its beginning
        has_sine = acts & (function.pieces[:, 6] != 0.0)
        yield each.where, float(np.abs(function.pieces[has_sine, 7]).max(initial=0.0)) / (2 * np.pi)
    for where, part in parts_of_time(system):
        rates = [np.abs(np.diff(phase(t)) / np.diff(t)).max() for phase in part.parts_of_time().phases]
        yield where, float(max(rates, default=0.0)) / (2 * np.pi)
    for element in system.elements:
        if hasattr(element, "frequencies"):
            yield f"elements.{element.name}", float(np.abs(element.frequencies(t)).max())


def knot_words(system: System, t_start: float, h: float, n_steps: int) -> tuple[str, ...]:
    """Return messages about table points between which the steps of a run are too long.

    (1) Several knots lie in one step, which misses the values between them. (Steps end at jumps of forces.)
    (2) A driven acceleration jumps inside a step, which treats the jump as a ramp. Jumps at ends of steps are exact.
    """
    words = []
    cuts = np.array(jump_times(system, t_start, h, n_steps))
    for where, function, is_motion, _, _ in functions_of_time(system):
        inside = (function.begins > t_start) & (function.begins < t_start + n_steps * h * (1 - 1e-12))
        knots = function.begins[inside]
        steps = np.ceil((knots - t_start) / h - ON_A_STEP)
        parts = steps + np.searchsorted(cuts, knots - ON_A_STEP * h)  # number of the step or part; jumps divide steps
        passed = len(knots) - len(np.unique(parts))
        if passed:
            shortest = float(np.diff(knots).min())
            words.append(
                f"{where}: steps of {h:.6g} pass over {passed} of the {len(knots)} knots of its table, whose smallest "
                f"interval is {shortest:.6g}, and miss these values; take a shorter step, or resample the signal"
            )
        if is_motion:
            times, sizes = function.jumps(2)
            at = (times - t_start) / h
            within = (at > 0) & (at < n_steps) & (np.abs(at - np.rint(at)) > ON_A_STEP)
            if within.any():
                k = int(np.flatnonzero(within)[0])
                words.append(
                    f"{where}: its acceleration jumps inside {int(within.sum())} steps, first by {sizes[k]:.6g} at "
                    f"t = {times[k]:.9g}: forces are wrong in these steps; let a step end there (by another h, or an "
                    "event with at), or take a smoother table"
                )
    return tuple(words)
