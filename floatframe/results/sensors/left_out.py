"""Strain energy that the modes of a flexible body left out of a motion, estimated from its left-out shapes.

The modal file has left-out shapes W (`cms.body.left_out_modes`) and the forces y on them: those of interface loads,
load cases, spin and modal accelerations. In statics their amplitudes are eta = y, and |eta|² / 2 is the energy left
out. In a motion W vibrates in shapes whose parts in W are Y. The amplitude z of each follows from

    z'' / omega² + 2 zeta / omega z' + z = Yᵀ y,        eta = Y z.

These shapes are (a) those of the free body, of modes and W together, or (b) those of W alone, whose Y diagonalises
Wᵀ M W, beside modes that move as computed. Joints change the frequencies of (a), and the modes those of (b), so that
either may resonate where the body in its joints does not. The estimate is the one whose largest energy is smaller.

(1) y at the outputs, in the frame of the modal file
(2) a shape whose period has fewer than `OUTPUTS` outputs responds statically, z = Yᵀ y
(3) the others are integrated exactly for forces that are linear between outputs: with lambda = -zeta omega + i omega_d,
    x' = lambda x + Yᵀ y gives z = omega² / omega_d Im x. They begin at rest like the modes: undeformed if q = 0 (also
    those of (2)), otherwise in equilibrium
(4) zeta is that of the mode nearest in frequency
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from math import factorial
from typing import Annotated

import numpy as np

from cms.body.left_out_modes import LeftOutModes
from cms.body.recovery_table import spin_products
from cms.body.reduced_body import ReducedBody
from fe_models.foundation.arrays import Array
from fe_models.foundation.presentation import Summary, presented
from fe_models.foundation.records import ArrayShape, checked_fields, frozen_copies
from floatframe.errors import ModelError, ResultsError
from floatframe.model.bodies.flexible_body import FlexibleBody
from floatframe.model.system import System
from floatframe.results.recovery import require_same_modes
from floatframe.results.sensors.body_loads import case_amplitudes, interface_loads
from floatframe.results.sensors.measurement import Measurement, unit_words
from floatframe.results.sensors.stresses import flexible_body
from floatframe.results.trajectory import Trajectory

__all__ = ["LeftOutEnergy", "LeftOutEstimate", "LeftOutSensor", "left_out", "left_out_estimates", "share_words"]

OUTPUTS = 10  #: smallest number of outputs in a period of a shape that is integrated over time
MOST_DAMPED = 0.999  #: largest damping ratio of (3)
SERIES = 0.1  #: |lambda h| below which the integrals of (3) are power series
TERMS = 9  #: number of their terms


@presented
@frozen_copies
@dataclass(frozen=True, eq=False)
@checked_fields(ResultsError)
class LeftOutEnergy:
    """Strain energy of a flexible body during a motion: that of its modes, and an estimate of what they left out.

    Parameters
    ----------
    body
        Name of the body.
    t
        Output times, (n_t,) [s].
    energy
        Estimate of the strain energy that the modes left out, (n_t,) [J].
    strain
        Strain energy of the modes, (n_t,) [J].
    n_shapes
        Number of vibration shapes of the estimate.
    n_static
        Number of them that respond statically, because too few outputs are in a period.
    """

    body: str
    t: Annotated[Array, ArrayShape(("n_t",))]
    energy: Annotated[Array, ArrayShape(("n_t",))]
    strain: Annotated[Array, ArrayShape(("n_t",))]
    n_shapes: int
    n_static: int

    def summary(self) -> Summary:
        """Return what `repr` and notebooks show."""
        rows = [
            ("left out", self.description),
            ("vibration shapes", f"{self.n_shapes}, of which {self.n_static} respond statically"),
        ]
        return Summary(f"LeftOutEnergy {self.body!r}", rows, (), [])

    @property
    def shares(self) -> Array:
        """Energy left out at each time, relative to the largest strain energy of the body, (n_t,)."""
        largest = (self.strain + self.energy).max(initial=0.0)
        return self.energy / largest if largest > 0 else np.zeros(len(self.t))

    @property
    def share(self) -> float:
        """The largest of `shares`."""
        return float(self.shares.max(initial=0.0))

    @property
    def t_largest(self) -> float:
        """Time of the largest energy left out [s]."""
        return float(self.t[np.argmax(self.energy)])

    @property
    def description(self) -> str:
        """Return the largest share as text."""
        return share_words(self.share, self.t_largest)


def share_words(share: float, t: float) -> str:
    """Return the estimated largest share of the strain energy, and its time without unit."""
    return f"up to about {100 * share:.2g} % of its strain energy, at t = {t:.6g}"


@dataclass(frozen=True, eq=False)
class Oscillators:
    """State of oscillators at a time: the complex amplitude x of step (3), and the force."""

    t: float
    force: Array  #: (n,)
    x: Array  #: (n,)


class VibrationShapes:
    """Shapes in which left-out shapes vibrate, and their state at the last output."""

    def __init__(self, mass: Array, shares: Array, reduced: ReducedBody, interval: float) -> None:
        """Begin before the first output.

        Parameters
        ----------
        mass
            1 / omega² of each shape, (n_shapes,) [s²]; 0: massless.
        shares
            Y: part of each left-out shape in each of them, (n_left, n_shapes).
        reduced
            The body, for its damping.
        interval
            Time between outputs [s].
        """
        period = 2 * np.pi * np.sqrt(mass)
        moves = (period > 0) & (period >= OUTPUTS * interval)  # (2)
        self.n_shapes, self.parts = len(mass), shares[:, moves]
        self.omega = 1 / np.sqrt(mass[moves])
        self.zeta = damping_ratios(reduced, self.omega)
        self.state: Oscillators | None = None

    def amplitudes(self, t: Array, y: Array, *, is_undeformed: bool) -> Array:
        """Return eta at further outputs under forces y, (n_t, n_left) both; `is_undeformed`: zero at the first."""
        eta = y.copy()
        if len(self.omega):
            force = y @ self.parts
            if self.state is None:
                before = np.zeros(len(self.omega)) if is_undeformed else force[0]
                self.state = at_rest(self.omega, self.zeta, float(t[0]), before)
            z, self.state = oscillation(self.omega, self.zeta, t, force, self.state)
            eta += (z - force) @ self.parts.T
        if is_undeformed:
            eta[0] = 0.0
        return eta


class LeftOutEstimate:
    """Estimate for one body. `take` takes the outputs of a motion in order, in one or several parts."""

    def __init__(self, system: System, body: FlexibleBody, modes: LeftOutModes, interval: float) -> None:
        """Begin a motion with this interval between its outputs [s]."""
        self.system, self.body, self.modes = system, body, modes
        alone, Y = np.linalg.eigh((modes.shares * modes.mass) @ modes.shares.T)  # of Wᵀ M W
        self.vibrations = (
            VibrationShapes(modes.mass, modes.shares, body.reduced, interval),  # (a)
            VibrationShapes(np.maximum(alone, 0.0), Y, body.reduced, interval),  # (b)
        )
        self.outputs: list[tuple[Array, Array, Array, Array]] = []  #: times, strain energies, energies of (a) and (b)

    def take(self, trajectory: Trajectory) -> None:
        """Take further outputs of the motion."""
        motion = trajectory.body(self.body.name)
        if not len(motion.t):
            return
        y = self.modes.forces(  # (1)
            motion.q_ddot,
            spin_products(motion.omega_B),
            interface_loads(self.system, trajectory, self.body),
            case_amplitudes(self.system, trajectory, self.body),
        )
        is_undeformed = not self.outputs and not motion.q[0].any()
        a, b = (each.amplitudes(motion.t, y, is_undeformed=is_undeformed) for each in self.vibrations)
        strain = motion.q**2 @ np.diag(self.body.reduced.K) / 2
        self.outputs.append((motion.t, strain, (a**2).sum(axis=1) / 2, (b**2).sum(axis=1) / 2))

    def result(self) -> LeftOutEnergy:
        """Return the energies up to the last output."""
        t, strain, *energies = (np.concatenate([np.zeros(0), *parts]) for parts in zip(*self.outputs, strict=True))
        k = int(np.argmin([energy.max(initial=0.0) for energy in energies]))
        n = self.vibrations[k].n_shapes
        return LeftOutEnergy(self.body.name, t, energies[k], strain, n, n - len(self.vibrations[k].omega))


def left_out_estimates(system: System, interval: float, names: Sequence[str] | None = None) -> list[LeftOutEstimate]:
    """Return an estimate for each flexible body whose modal file has left-out shapes, or for those of these names."""
    found = []
    for body in system.bodies:
        if isinstance(body, FlexibleBody) and (names is None or body.name in names):
            modes = None if body.reduced.errors is None else body.reduced.errors.left_out
            if modes is not None:
                found.append(LeftOutEstimate(system, body, modes, interval))
    return found


def left_out(system: System, trajectory: Trajectory, names: Sequence[str] | None = None) -> Mapping[str, LeftOutEnergy]:
    """Return what the modes of flexible bodies left out of a motion, by the name of the body.

    Parameters
    ----------
    system
        The system that moved.
    trajectory
        Its motion.
    names
        Names of the bodies; None: all whose modal files have left-out shapes.
    """
    run = trajectory.head.run
    interval = run["h"] * run["output_every"] if "h" in run and "output_every" in run else np.inf
    found = {}
    for estimate in left_out_estimates(system, interval, names):
        require_same_modes(trajectory, estimate.body.name, estimate.body.reduced)
        estimate.take(trajectory)
        found[estimate.body.name] = estimate.result()
    return found


@frozen_copies
@dataclass(frozen=True, eq=False)
@checked_fields(ModelError)
class LeftOutSensor:
    """Strain energy that the modes of a flexible body left out (energy), that of its modes (strain), and their share.

    Parameters
    ----------
    name
        Name of the sensor, unique in the system.
    body
        Name of the flexible body.
    """

    name: str
    body: str

    def measure(self, system: System, trajectory: Trajectory) -> Measurement:
        """Return the energy left out, the energy of the modes, and the share of the former in the largest of both."""
        body = flexible_body(system, self.name, self.body)
        found = left_out(system, trajectory, [body.name])
        if body.name not in found:
            raise ModelError(
                f"sensor {self.name!r}: the modal file of body {body.name!r} has no left-out shapes; reduce it again "
                "with error estimates (error_estimates = true in [reduction], cms reduce)"
            )
        own = found[body.name]
        columns = {"energy": own.energy, "strain": own.strain, "share": own.shares}
        return Measurement(self.name, trajectory.t, columns, self.units(system))

    def units(self, system: System) -> dict[str, str]:
        """Return the units of the columns."""
        energy = unit_words(system.units, "energy")
        return {"energy": energy, "strain": energy, "share": "-"}


# oscillators ----------------------------------------------------------------------------------------------------------


def damping_ratios(reduced: ReducedBody, omega: Array) -> Array:
    """Return the damping ratio of the mode nearest to each angular frequency, (n,): step (4)."""
    has_mass = np.diag(reduced.M) > 0
    own = np.sqrt(np.diag(reduced.K)[has_mass])
    if not len(own):
        return np.zeros(len(omega))
    zeta = np.diag(reduced.D)[has_mass] / (2 * own)
    return np.minimum(zeta[np.abs(own[None, :] - omega[:, None]).argmin(axis=1)], MOST_DAMPED)


def rates(omega: Array, zeta: Array) -> Array:
    """Return lambda of step (3), (n,)."""
    return np.asarray(omega * (-zeta + 1j * np.sqrt(1 - zeta**2)))


def at_rest(omega: Array, zeta: Array, t: float, force: Array) -> Oscillators:
    """Return oscillators at rest in equilibrium with a force, (n,)."""
    return Oscillators(t, force, -force / rates(omega, zeta))


def oscillation(omega: Array, zeta: Array, t: Array, force: Array, last: Oscillators) -> tuple[Array, Oscillators]:
    """Return the amplitudes of oscillators under forces that are linear between times, (n_t, n), and their last state.

    Parameters
    ----------
    omega, zeta
        Angular frequencies [rad/s] and damping ratios below 1, (n,).
    t
        Times, ascending, (n_t,).
    force
        Forces, (n_t, n).
    last
        State at a time before, or at the first time with the force that acted until then.
    """
    lam = rates(omega, zeta)
    steps, step_of = np.unique(np.diff(t, prepend=last.t), return_inverse=True)  # few: equal but for rounding
    h = steps[:, None]
    E, first, second = integrals(lam * h)
    x = (h * (first - second))[step_of] * np.vstack([last.force, force[:-1]]) + (h * second)[step_of] * force
    x_last, decays = last.x, list(E)
    for x_k, k in zip(x, step_of.tolist(), strict=True):
        x_k += decays[k] * x_last
        x_last = x_k
    return omega / np.sqrt(1 - zeta**2) * x.imag, Oscillators(float(t[-1]), force[-1], x_last)


def integrals(z: Array) -> tuple[Array, Array, Array]:
    """Return exp(z), (exp(z) - 1)/z and (exp(z) - 1 - z)/z², the latter two by power series for small |z|."""
    E, is_small = np.exp(z), np.abs(z) < SERIES
    divisor = np.where(is_small, 1.0, z)
    first, second = (E - 1) / divisor, (E - 1 - z) / divisor**2
    return E, np.where(is_small, series(z, 1), first), np.where(is_small, series(z, 2), second)


def series(z: Array, order: int) -> Array:
    """Return the sum of z^k / (k + order)! over k from 0."""
    total = np.zeros_like(z)
    for k in range(TERMS, -1, -1):
        total = total * z + 1 / factorial(k + order)
    return total
