"""Sensors of public elements: their outputs, states and multipliers."""

from dataclasses import dataclass

import numpy as np

from fe_models.foundation.arrays import Array
from fe_models.foundation.records import checked_fields, frozen_copies
from fe_models.foundation.words import nearest, quoted
from floatframe.engine.compiling.counted_angles import CountedAngle, rotation_of
from floatframe.engine.compiling.markers import MarkerData
from floatframe.engine.compiling.pair_forces import bushing_markers
from floatframe.engine.compiling.public_elements import PlacedLaw
from floatframe.engine.compiling.system import compiled_system
from floatframe.errors import ModelError
from floatframe.model.forces import Bushing, UserForce
from floatframe.model.forces.bushing import AXES, DEFORMATIONS
from floatframe.model.joints.rows import kind_of
from floatframe.model.rotations import continued_rotation, dot, rotation_exp, rotation_log
from floatframe.model.system import System
from floatframe.results.coordinate_elements import coupler_motion, user_force_motion
from floatframe.results.element_motion import element_motion
from floatframe.results.joint_coordinates import end_motion
from floatframe.results.place_motion import PlaceMotion
from floatframe.results.sensors.measurement import Measurement, unit_words
from floatframe.results.trajectory import Trajectory

__all__ = ["BushingSensor", "ControlSensor", "CouplerSensor", "ElementSensor"]


# sensors of couplers and user forces: their coordinates, rates, forces and states -------------------------------------


@frozen_copies
@dataclass(frozen=True, eq=False)
@checked_fields(ModelError)
class CouplerSensor:
    """A coupler: value, rate and force of each of its coordinates, numbered from 1.

    Parameters
    ----------
    name
        Name of the sensor, unique in the system.
    of
        Name of the coupler.
    """

    name: str
    of: str

    def measure(self, system: System, trajectory: Trajectory) -> Measurement:
        """Return the columns "value 1", "rate 1", "force 1", "value 2", ..."""
        names = self.coupler_names(system)
        found = coupler_motion(system, trajectory, self.of)
        columns: dict[str, Array] = {}
        units: dict[str, str] = {}
        for k, is_angle in enumerate(angles_of(system, names.index(self.of))):
            own = (f"value {k + 1}", f"rate {k + 1}", f"force {k + 1}")
            columns |= dict(zip(own, (found.value[:, k], found.rate[:, k], found.force[:, k]), strict=True))
            units |= dict(zip(own, coordinate_units(system, is_angle), strict=True))
        return Measurement(self.name, trajectory.t, columns, units)

    def coupler_names(self, system: System) -> list[str]:
        """Return the names of the couplers; `ModelError` with the closest one if the sensor's coupler is missing."""
        names = [coupler.name for coupler in system.couplers]
        if self.of not in names:
            raise ModelError(f"sensor {self.name!r}: no coupler {quoted(self.of)}{nearest(self.of, names)}")
        return names


@frozen_copies
@dataclass(frozen=True, eq=False)
@checked_fields(ModelError)
class ControlSensor:
    """A user force: its coordinates, their rates, the forces along them, and its states, all by name.

    Parameters
    ----------
    name
        Name of the sensor, unique in the system.
    of
        Name of the user force.
    """

    name: str
    of: str

    def measure(self, system: System, trajectory: Trajectory) -> Measurement:
        """Return the columns "phi", "phi_dot", "phi force", ..., and states by name (without unit)."""
        forces, k = self.user_forces(system)
        found = user_force_motion(system, trajectory, self.of)
        columns: dict[str, Array] = {}
        units: dict[str, str] = {}
        for name, is_angle in zip(forces[k].coordinates, angles_of(system, len(system.couplers) + k), strict=True):
            value, rate, force = coordinate_units(system, is_angle)
            columns |= {name: found.value[name], f"{name}_dot": found.rate[name]}
            units |= {name: value, f"{name}_dot": rate}
            if name in found.force:
                columns[f"{name} force"], units[f"{name} force"] = found.force[name], force
        columns |= found.states
        units |= dict.fromkeys(found.states, "-")
        return Measurement(self.name, trajectory.t, columns, units)

    def user_forces(self, system: System) -> tuple[list[UserForce], int]:
        """Return the user forces and the index of the sensor's one; `ModelError` with the closest name if missing."""
        forces = [force for force in system.forces if isinstance(force, UserForce)]
        names = [force.name for force in forces]
        if self.of not in names:
            raise ModelError(f"sensor {self.name!r}: no user force {quoted(self.of)}{nearest(self.of, names)}")
        return forces, names.index(self.of)


def angles_of(system: System, k: int) -> list[bool]:
    """Return whether each coordinate of element k (coupler or user force) is an angle."""
    model = compiled_system(system).model
    rows = model.coordinates.row[model.elements.coordinate0[k] : model.elements.coordinate0[k + 1]]
    return [kind_of(code).is_angle for code in model.rows.kind[rows]]


def coordinate_units(system: System, is_angle: bool) -> tuple[str, str, str]:
    """Return the units of value, rate and force of a coordinate."""
    words = ("angle", "angular speed", "moment") if is_angle else ("length", "speed", "force")
    value, rate, force = (unit_words(system.units, word) for word in words)
    return value, rate, force


# elements -------------------------------------------------------------------------------------------------------------


@frozen_copies
@dataclass(frozen=True, eq=False)
@checked_fields(ModelError)
class ElementSensor:
    """Outputs, states and multipliers of a public element, by name, or one of them.

    If an output and a state have the same name, the state is measured.

    Parameters
    ----------
    name
        Name of the sensor, unique in the system.
    of
        Name of the element.
    output
        Name of an output, state or multiplier; default: all.
    """

    name: str
    of: str
    output: str | None = None

    def measure(self, system: System, trajectory: Trajectory) -> Measurement:
        """Return a column for each output, state and multiplier, or only the selected column."""
        units = self.units_of(self.placed(system))
        found = element_motion(system, trajectory, self.of)
        columns: dict[str, Array] = {**found.outputs, **found.states, **found.multipliers}
        return Measurement(self.name, trajectory.t, {name: columns[name] for name in units}, units)

    def placed(self, system: System) -> PlacedLaw:
        """Return the element; `ModelError` suggests the closest name if it does not exist."""
        laws = compiled_system(system).laws
        names = [each.element.name for each in laws]
        if self.of not in names:
            raise ModelError(f"sensor {self.name!r}: no element {quoted(self.of)}{nearest(self.of, names)}")
        return laws[names.index(self.of)]

    def units_of(self, placed: PlacedLaw) -> dict[str, str]:
        """Return the units of the columns by name; `ModelError` with the closest name if a column is missing."""
        law = placed.law
        units = dict(zip(law.outputs, law.output_units, strict=True))
        units |= dict(zip(law.states, law.state_units, strict=True))
        units |= dict(zip(law.multipliers, law.multiplier_units, strict=True))
        units = {name: unit or "-" for name, unit in units.items()}
        if self.output is None:
            return units
        if self.output not in units:
            raise ModelError(
                f"sensor {self.name!r}: element {self.of!r} has no output {quoted(self.output)}"
                f"{nearest(self.output, list(units))}"
            )
        return {self.output: units[self.output]}


# the sensor of a bushing: its six deformations and their rates, in the axes in which it acts --------------------------
# The formulas are those of the force (`floatframe/engine/kernels/connections/bushing.py`). A, B are the axes of the
# markers, d the vector between their points, theta the rotation vector of A^T B with full turns counted, t = |theta|,
# and C the axes of A rotated by a share of theta:
#
#     e = C^T d,  e' = C^T d' + e × gamma,  theta' = S u,   u = C^T (omega_B - omega_A)
#     gamma = C^T ((1 - share) omega_A + share omega_B) - tau theta × u
#     S = alpha 1 + beta theta theta^T + (share - 1/2) tilde(theta),   beta = (1 - alpha) / t²
#     alpha = (t/2) cot(t/2), tau = 0;   half way: alpha = (t/2) / sin(t/2), tau = tan(t/4) / (2 t)


SERIES_BELOW = 1e-2  #: value of t² below which series give alpha, beta and tau
NAMES = (*DEFORMATIONS, *(f"{name} rate" for name in DEFORMATIONS))


@frozen_copies
@dataclass(frozen=True, eq=False)
@checked_fields(ModelError)
class BushingSensor:
    """Deformations x, y, z, rx, ry, rz of a bushing and their rates, on which its stiffness and damping act.

    Parameters
    ----------
    name
        Name of the sensor, unique in the system.
    of
        Name of the bushing.
    """

    name: str
    of: str

    def measure(self, system: System, trajectory: Trajectory) -> Measurement:
        """Return deformations and rates over time."""
        ends, share = self.ends(system), AXES[self.bushing(system).axes]
        a, b = (end_motion(system, trajectory, end, self.of) for end in ends)
        theta = rotation_log(np.swapaxes(a.axes, -1, -2) @ b.axes)
        if self.bushing(system).counts_turns:
            theta = counted(trajectory, rotation_of(*ends), theta)
        C, e = deformed_axes(a, b, theta, share)
        rates = deformation_rates(C, e, theta, share, b.velocity - a.velocity, a.omega, b.omega)
        columns = np.hstack([e, theta, rates]).T
        return Measurement(self.name, trajectory.t, dict(zip(NAMES, columns, strict=True)), self.units(system))

    def ends(self, system: System) -> tuple[MarkerData, MarkerData]:
        """Return both markers."""
        a, b = bushing_markers(system, self.bushing(system), compiled_system(system).placed)
        return a, b

    def bushing(self, system: System) -> Bushing:
        """Return the bushing; `ModelError` suggests the closest name if it does not exist."""
        bushings = {force.name: force for force in system.forces if isinstance(force, Bushing)}
        if self.of not in bushings:
            raise ModelError(f"sensor {self.name!r}: no bushing {quoted(self.of)}{nearest(self.of, list(bushings))}")
        return bushings[self.of]

    def units(self, system: System) -> dict[str, str]:
        """Return the units of the columns."""
        kinds = ("length", "angle", "speed", "angular speed")
        return {name: unit_words(system.units, kinds[k // 3]) for k, name in enumerate(NAMES)}


def deformed_axes(a: PlaceMotion, b: PlaceMotion, theta: Array, share: float) -> tuple[Array, Array]:
    """Return C, (..., 3, 3), and e, (..., 3)."""
    C = a.axes @ rotation_exp(share * theta)
    return C, np.einsum("...ba,...b->...a", C, b.position - a.position)


def deformation_rates(
    C: Array, e: Array, theta: Array, share: float, slip: Array, omega_a: Array, omega_b: Array
) -> Array:  # fmt: skip
    """Return e' and theta', (..., 6), for d' = slip and angular velocities, (..., 3) each; they are linear in these."""
    u, v, mean = (
        np.einsum("...ba,...b->...a", C, x) for x in (omega_b - omega_a, slip, (1 - share) * omega_a + share * omega_b)
    )
    alpha, beta, tau = (x[..., None] for x in scalars(dot(theta, theta), share))
    across = np.cross(theta, u)
    turning = alpha * u + beta * dot(theta, u)[..., None] * theta + (share - 0.5) * across
    return np.concatenate([v + np.cross(e, mean - tau * across), turning], axis=-1)


def counted(trajectory: Trajectory, angles: list[CountedAngle], theta: Array) -> Array:
    """Return rotation vectors with the full turns that the run counted, (n_t, 3); unchanged if it did not count."""
    known = list(trajectory.head.angles or ())
    first = next((k for k, each in enumerate(known) if each.is_same(angles[0])), None)
    if first is None:
        return theta
    return continued_rotation(theta, trajectory.source.read("angle")[:, first : first + 3])


def scalars(t2: Array, share: float) -> tuple[Array, Array, Array]:
    """Return alpha, beta, tau as functions of t², (n,) each; for small t² from series up to t⁶."""
    near = t2 < SERIES_BELOW
    t = np.sqrt(np.where(near, 1.0, t2))
    if share != 0.5:
        alpha = (t / 2) / np.tan(t / 2)
        low = 1 / 12 + t2 * (1 / 720 + t2 * (1 / 30240 + t2 / 1209600))
        return np.where(near, 1 - t2 * low, alpha), np.where(near, low, (1 - alpha) / t**2), np.zeros_like(t2)
    alpha = (t / 2) / np.sin(t / 2)
    beta, tau = (1 - alpha) / t**2, np.tan(t / 4) / (2 * t)
    low = -(1 / 24 + t2 * (7 / 5760 + t2 * (31 / 967680 + t2 * 127 / 154828800)))
    y = t2 / 16
    low_tau = (1 + y * (1 / 3 + y * (2 / 15 + y * 17 / 315))) / 8
    return np.where(near, 1 - t2 * low, alpha), np.where(near, low, beta), np.where(near, low_tau, tau)
