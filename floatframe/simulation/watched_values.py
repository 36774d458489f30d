"""Watched values of events at rows of results: by the sensors, or directly from a column of the rows."""

from collections.abc import Callable

from fe_models.foundation.arrays import Array
from floatframe.engine.compiling.counted_angles import angle_of
from floatframe.engine.compiling.system import compiled_system
from floatframe.engine.kernels.memory import Rows
from floatframe.model.bodies.rigid_body import RigidBody
from floatframe.model.joints.sliding import SlidingJoint
from floatframe.model.system import System
from floatframe.results.joint_coordinates import as_placed
from floatframe.results.sensors import sensor_of
from floatframe.results.sensors.loads import CoordinateSensor
from floatframe.simulation.events import Event

__all__ = ["direct_values"]

Values = Callable[[Rows], Array]


def direct_values(system: System, event: Event) -> Values | None:
    """Return a function from rows of results to the watched value of an event, (n_times,); None if a sensor is needed.

    A time; an angle of a joint between rigid bodies, which every run counts. Both to rounding what the sensor gives.
    """
    if event.at is not None:
        return lambda rows: rows.t
    sensor = sensor_of(system, event.watch)
    if type(sensor) is CoordinateSensor and event.column in ("", "value"):
        return counted_angle_of(system, sensor)
    return None


def counted_angle_of(system: System, sensor: CoordinateSensor) -> Values | None:
    """Return the angle of a joint as counted by the run; None if it is not counted."""
    joint = next(each for each in system.joints if each.name == sensor.joint)
    if isinstance(joint, SlidingJoint):
        return None
    ends, own = as_placed(system, joint, sensor.coordinate)
    if own is None or not own.is_angle:
        return None
    if not all(end.body < 0 or isinstance(system.bodies[end.body], RigidBody) for end in ends):
        return None
    angle = angle_of(own, *ends)
    k = next((k for k, known in enumerate(compiled_system(system).angles) if known.is_same(angle)), None)
    return None if k is None else lambda rows: rows.angle[:, k]
