"""The unstable limit cycle of a hunting vehicle: smaller oscillations die out, larger ones grow.

A vehicle in steady running is displaced in its least damped hunting mode with an amplitude a of one axle, x + a
Re(phi), u + a Re(lambda phi), and released. The amplitude of the unstable limit cycle is between an a from which the
oscillation dies out and an a from which it grows; it is found by bisection.
"""

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from fe_models.foundation.arrays import Array
from floatframe.analyses.linear.linearization import linearize
from floatframe.analyses.steady.steady_motion import SteadyMotion
from floatframe.errors import ConvergenceError, ModelError
from floatframe.integrators.generalized_alpha import GeneralizedAlpha
from floatframe.machines.bogie.running import lateral_modes, steady_motion_of
from floatframe.model.bodies.flexible_body import FlexibleBody
from floatframe.model.rotations import euler_parameter_product, euler_parameters_of_rotation_vector, rotation_matrix
from floatframe.model.state import State
from floatframe.model.system import System
from floatframe.simulation.integrate import integrate

__all__ = ["Bracket", "Hunted", "Run", "bracket_of_unstable_cycle", "hunted"]

SMALLER = 0.96  #: factor from an amplitude at which a wheel climbs the rail to the next amplitude that is tried
LASTING = (
    0.7  #: fraction of the amplitude of the stable cycle above which an oscillation is assumed to end on the cycle
)
SETTLING = 1.0  #: time after which an oscillation that starts as a mode has settled [s]


class Run(NamedTuple):
    """Half the range of the lateral displacement of an axle, in two windows of one second."""

    start: float  #: initial amplitude of the mode [m]
    early: float  #: amplitude after the first second [m]
    late: float  #: amplitude in the last second [m]; NaN if a wheel has climbed the rail


class Bracket(NamedTuple):
    """Two runs that enclose an unstable limit cycle, and the stable cycle."""

    decaying: Run | None  #: None: no oscillation dies out
    lasting: Run | None  #: None: every oscillation dies out
    cycle: float  #: amplitude of the stable limit cycle [m]; NaN if there is none


@dataclass(frozen=True, eq=False)
class Hunted:
    """A vehicle in steady running with its least damped hunting mode."""

    motion: SteadyMotion
    axle: str
    eigenvalue: complex  #: eigenvalue of the mode [1/s]
    shape: Array  #: motions of the bodies, scaled to 1 for the lateral motion of the axle, (n_u,) complex

    def state(self, amplitude: float) -> State:
        """Return the state displaced by an amplitude of the mode [m]."""
        steady = self.motion.equilibrium.state
        x, v = amplitude * self.shape.real, amplitude * (self.eigenvalue * self.shape).real
        r, p, q, u = steady.r.copy(), steady.p.copy(), steady.q.copy(), steady.u.copy()
        first, q0 = 0, 0
        for i, body in enumerate(self.motion.system.bodies):
            n_q = body.reduced.n_q if isinstance(body, FlexibleBody) else 0
            R, own = rotation_matrix(p[i]), slice(first, first + 6 + n_q)
            r[i] = r[i] + R @ x[first : first + 3]
            p[i] = euler_parameter_product(p[i], euler_parameters_of_rotation_vector(x[first + 3 : first + 6]))
            q[q0 : q0 + n_q] += x[first + 6 : own.stop]
            u[first : first + 3] += R @ v[first : first + 3]
            u[first + 3 : own.stop] += v[first + 3 : own.stop]
            first, q0 = own.stop, q0 + n_q
        return State(r, p, q, u, steady.w)

    def run(self, amplitude: float, *, seconds: float = 5.0, h: float = 2e-3) -> Run:
        """Return the run that starts with an amplitude of the mode [m]."""
        try:
            motion = integrate(
                self.motion.system, GeneralizedAlpha(0.8, 1e-6), seconds, h, output_every=5, state=self.state(amplitude)
            )
        except ConvergenceError:
            return Run(amplitude, np.nan, np.nan)
        t, y = motion.t, motion.body(self.axle).r[:, 1]
        windows = (t >= SETTLING) & (t <= SETTLING + 1.0), t >= seconds - 1.0
        early, late = (0.5 * float(np.ptp(y[window])) for window in windows)
        return Run(amplitude, early, late)


def hunted(system: System, axle: str) -> Hunted:
    """Return a vehicle on straight track in steady running with its least damped lateral oscillation."""
    names = [body.name for body in system.bodies]
    if axle not in names:
        raise ModelError(f"hunted: no body {axle!r}; choose among {', '.join(names)}")
    motion = steady_motion_of(system)
    roots, modes = lateral_modes(linearize(motion.system, motion.equilibrium, inputs=(), outputs=()))
    if not len(roots):
        raise ModelError("hunted: expected a lateral oscillation between 0.1 and 15 Hz, got none")
    root = roots[np.argmax(roots.real / np.abs(roots))]
    shape = modes.shapes[:, np.argmin(np.abs(modes.eigenvalues - root))]
    sizes = [6 + (body.reduced.n_q if isinstance(body, FlexibleBody) else 0) for body in system.bodies]
    return Hunted(motion, axle, complex(root), shape / shape[sum(sizes[: names.index(axle)]) + 1])


def bracket_of_unstable_cycle(
    vehicle: Hunted, *, low: float = 1e-3, high: float = 6e-3, n_runs: int = 5, seconds: float = 5.0
) -> Bracket:
    """Return the largest amplitude that dies out and the smallest that ends on the stable cycle, by bisection.

    Parameters
    ----------
    vehicle
        The vehicle from `hunted`.
    low, high
        Initial amplitudes [m]. If a wheel climbs the rail from `high`, a smaller one is taken.
    n_runs
        Number of runs of the bisection.
    seconds
        Duration of each run [s].
    """
    if not (0 < low < high and seconds > SETTLING + 2.0):
        raise ModelError(
            f"bracket_of_unstable_cycle: expected 0 < low < high and more than {SETTLING + 2.0:g} s, got low = "
            f"{low:g}, high = {high:g}, seconds = {seconds:g}"
        )
    lasting = run_on_rails(vehicle, high, low, seconds)
    cycle = lasting.late
    if not cycle > LASTING * lasting.start:
        return Bracket(lasting, None, np.nan)
    decaying = vehicle.run(low, seconds=seconds)
    if decaying.late > LASTING * cycle:
        return Bracket(None, decaying, cycle)
    for _ in range(n_runs):
        run = run_on_rails(vehicle, 0.5 * (decaying.start + lasting.start), decaying.start, seconds)
        if run.start <= decaying.start:
            break
        decaying, lasting = (decaying, run) if run.late > LASTING * cycle else (run, lasting)
    return Bracket(decaying, lasting, cycle)


def run_on_rails(vehicle: Hunted, amplitude: float, least: float, seconds: float) -> Run:
    """Return the run from an amplitude, or from the next smaller one, down to the least, in which no wheel climbs."""
    run = vehicle.run(amplitude, seconds=seconds)
    while not np.isfinite(run.late) and run.start > least:
        run = vehicle.run(SMALLER * run.start, seconds=seconds)
    return run
