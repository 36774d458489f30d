"""A coordinate of a joint: where a coordinate is named, a sensor of it, and the force along it as an input."""

from dataclasses import dataclass

import numpy as np

from fe_models.foundation.arrays import Array
from fe_models.foundation.presentation import presented
from fe_models.foundation.records import checked_fields
from fe_models.foundation.units import Units
from fe_models.foundation.words import nearest, quoted
from floatframe.engine.compiling.counted_angles import angle_of
from floatframe.engine.compiling.markers import MarkerData
from floatframe.errors import ModelError, ResultsError
from floatframe.model.bodies.coordinates import JointCoordinateName
from floatframe.model.joints import Joint
from floatframe.model.joints.rows import MOMENT, RelativePlace
from floatframe.model.joints.sliding import SlidingJoint
from floatframe.model.rotations import cross, dot
from floatframe.model.system import System
from floatframe.results.full_turns import through_turns
from floatframe.results.joint_coordinates import as_placed, end_motion, sliding_place
from floatframe.results.sensors.channels import VALUE, rate_unit, require_rate
from floatframe.results.sensors.measurement import Measurement, unit_words
from floatframe.results.trajectory import Trajectory

__all__ = ["JointCoordinate"]

#: endings of the default name by `rate`
ENDINGS = {None: "", 0: "", 1: ".rate", 2: ".acceleration"}


@presented
@dataclass(frozen=True)
@checked_fields(ModelError)
class JointCoordinate(JointCoordinateName):
    """A coordinate of a joint, a distance or an angle, free or prescribed; the text "hub.angle" stands for it.

    In couplers and user forces it is the coordinate. As a sensor or output, it has the columns value, rate and force,
    or the column value alone. As an input of a linearised system, it is the force or torque along the coordinate.

    Parameters
    ----------
    joint
        Name of the joint.
    coordinate
        Name of its coordinate, such as "angle".
    name
        Name as a sensor, input or output; default: "joint.coordinate".
    rate
        Derivative in the only column, value: 0 the coordinate, 1 its first rate, 2 its second rate. None: the columns
        value, rate and force.
    """

    name: str = ""
    rate: int | None = None

    def __post_init__(self) -> None:
        if self.rate is not None:
            require_rate(f"coordinate {self.joint}.{self.coordinate}", self.rate)
        if not self.name:
            object.__setattr__(self, "name", f"{self.joint}.{self.coordinate}{ENDINGS[self.rate]}")

    def measure(self, system: System, trajectory: Trajectory) -> Measurement:
        """Return value, rate and force over time, (n_t,) each, or the one that `rate` selects.

        An angle is counted through full turns. The force is that of the drive or of joint forces, positive if it tends
        to increase the coordinate.

        Raises
        ------
        ResultsError
            If there is no such joint or coordinate, or the motion is of another system.
        ModelError
            For second rates, which results over time do not contain.
        """
        if self.rate == 2:
            raise ModelError(
                f"channel {self.name!r}: results over time do not contain second rates of joint coordinates; take "
                'measure = "velocity", or the acceleration of a place'
            )
        names = [each.name for each in system.joints]
        if self.joint not in names or names != list(trajectory.head.joints):
            hint = nearest(self.joint, names)
            raise ResultsError(f"coordinate {self.name!r}: no joint {quoted(self.joint)} in the motion{hint}")
        k = names.index(self.joint)
        joint = system.joints[k]
        if self.coordinate not in joint.coordinates:
            raise ResultsError(
                f"coordinate {self.name!r}: joint {self.joint!r} has no coordinate {self.coordinate!r}"
                f"{nearest(self.coordinate, list(joint.coordinates))}"
            )
        w = trajectory.unknowns(range(trajectory.head.w0[k], trajectory.head.w0[k + 1]))
        columns, is_angle = self.columns(system, trajectory, joint, w)
        units = {"value": rate_unit(system.units, is_angle, 0), "rate": rate_unit(system.units, is_angle, 1)}
        units["force"] = unit_words(system.units, "moment" if is_angle else "force")
        if self.rate is not None:
            chosen = ("value", "rate")[self.rate]
            return Measurement(self.name, trajectory.t, {VALUE: columns[chosen]}, {VALUE: units[chosen]})
        return Measurement(self.name, trajectory.t, columns, units)

    def columns(self, system: System, trajectory: Trajectory, joint: Joint, w: Array) -> tuple[dict[str, Array], bool]:
        """Return value, rate and force over time from the wrench w of the joint, and whether it is an angle."""
        ends, own = as_placed(system, joint, self.coordinate)
        if isinstance(joint, SlidingJoint):
            return sliding_columns(system, trajectory, joint, ends[1], w), False
        assert own is not None
        a, b = (end_motion(system, trajectory, end, joint.name) for end in ends)
        place = RelativePlace(a.axes, b.axes, b.position - a.position)
        slip = b.velocity - a.velocity - cross(a.omega, place.d)
        rate = dot(own.direction(place), own.moves(slip, b.omega - a.omega))
        value = own.value(place)
        if own.is_angle:
            where = f"coordinate {self.joint}.{self.coordinate}"
            value = through_turns(trajectory, where, angle_of(own, *ends), value, rate)
        return {"value": value, "rate": rate, "force": own.force(place, w)}, own.is_angle

    @property
    def is_angle(self) -> bool:
        """Whether the coordinate is an angle rather than a distance."""
        return self.coordinate.startswith("angle")

    def units(self, units: Units) -> str:
        """Return the unit of the only column."""
        return rate_unit(units, self.is_angle, self.rate or 0)

    def force_units(self, units: Units) -> str:
        """Return the unit of the force or torque along the coordinate."""
        return unit_words(units, "moment" if self.is_angle else "force")


def sliding_columns(
    system: System, trajectory: Trajectory, joint: SlidingJoint, marker_b: MarkerData, w: Array
) -> dict[str, Array]:
    """Return position and rate along a deformed line; the force is that of the drive, zero for free sliding."""
    b = end_motion(system, trajectory, marker_b, joint.name)
    place = sliding_place(system, trajectory, joint, b)
    w = w[:, : joint.size]
    if not joint.motions:
        return {"value": place.s, "rate": place.rate, "force": np.zeros(len(b.t))}
    force = -dot(w[:, :3], place.tangent)
    if joint.is_aligned:
        force = force - dot(w[:, MOMENT : MOMENT + 3], place.turning)
    return {"value": place.s, "rate": place.rate, "force": force}
