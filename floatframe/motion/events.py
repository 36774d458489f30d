"""Events: what a run does when a sensor or joint coordinate passes a level.

Event("caught", "hinge.angle", level=np.pi / 2, direction="rising", stop=True)
Event("release", "drop", column="y", level=0.2, direction="falling", switch_off=("rope",))
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any, cast

import numpy as np

from fe_models.foundation.words import nearest
from floatframe.checked_values import number
from floatframe.errors import ModelError
from floatframe.forces import BodyLoad, Bushing, Force, JointForce, PointForce, SpringDamper
from floatframe.functions.time_functions import constant
from floatframe.results.sensors import sensor_of
from floatframe.system import System

__all__ = ["DIRECTIONS", "Event", "events_of", "off_at_start", "require_events", "with_forces_off"]

DIRECTIONS = {"rising": 1, "falling": -1, "both": 0}

#: the same force without any load, which keeps its place in the system; one with nothing at all is refused, hence the
#: functions that are zero
SILENT: dict[type, dict[str, Any]] = {
    PointForce: {"force": np.zeros(3), "torque": np.zeros(3)},
    SpringDamper: {"stiffness": 0.0, "damping": 0.0, "preload": 0.0, "characteristic": constant(0.0)},
    JointForce: {
        "stiffness": 0.0,
        "damping": 0.0,
        "preload": 0.0,
        "friction": 0.0,
        "friction_coefficient": 0.0,
        "motor": constant(0.0),
        "characteristic": None,
    },
    BodyLoad: {"amplitude": constant(0.0)},
    Bushing: {
        "stiffness": np.zeros((6, 6)),
        "damping": np.zeros((6, 6)),
        "preload": np.zeros(6),
        "characteristics": {"x": constant(0.0)},
    },
}


@dataclass(frozen=True)
class Event:
    """What happens when a measured value passes a level; the time is found to `tolerance` by steps of other sizes.

    A force is off at the start if the first event that names it switches it on.
    """

    name: str
    watch: str  #: name of a sensor of the system, or "joint.coordinate"
    level: float = 0.0  #: in the unit of what is watched
    direction: str = "both"  #: "rising", "falling" or "both"
    column: str = ""  #: of the sensor, such as "x" or "rate"; "": its first
    stop: bool = False  #: end the run there
    switch_on: tuple[str, ...] = ()  #: names of forces
    switch_off: tuple[str, ...] = ()
    tolerance: float = 1e-9  #: of the time, in parts of the step

    def __post_init__(self) -> None:
        where = f"event {self.name!r}"
        object.__setattr__(self, "level", number(f"{where}: level", self.level))
        object.__setattr__(self, "tolerance", number(f"{where}: tolerance", self.tolerance, above=0.0))
        for name in ("switch_on", "switch_off"):
            object.__setattr__(self, name, tuple(getattr(self, name)))
        if self.direction not in DIRECTIONS:
            hint = nearest(self.direction, list(DIRECTIONS))
            raise ModelError(
                f"{where}: direction: expected one of {', '.join(DIRECTIONS)}, got {self.direction!r}{hint}"
            )
        if not (self.stop or self.switch_on or self.switch_off):
            raise ModelError(f"{where}: expected stop, switch_on or switch_off, got an event without consequence")

    def happens(self, before: float, after: float) -> bool:
        """Whether the value passes the level from one value to the next."""
        a, b = before - self.level, after - self.level
        rises, falls = a < 0 <= b, a > 0 >= b
        return {1: rises, -1: falls, 0: rises or falls}[DIRECTIONS[self.direction]]


def require_events(system: System) -> None:
    """Raise `ModelError` if an event watches or switches what does not exist, or cannot be switched."""
    forces = {getattr(force, "name", ""): force for force in system.forces}
    for event in events_of(system):
        where = f"event {event.name!r}"
        try:
            sensor_of(system, event.watch)
        except ModelError as error:
            raise ModelError(f"{where}: watch: {error}") from error
        for name in (*event.switch_on, *event.switch_off):
            if name not in forces or not name:
                choices = [key for key in forces if key]
                raise ModelError(f"{where}: no force {name!r}{nearest(name, choices)}")
            if type(forces[name]) not in SILENT:
                raise ModelError(f"{where}: a force of the kind {type(forces[name]).__name__} cannot be switched")


def events_of(system: System) -> tuple[Event, ...]:
    """Return the events that a system carries: it knows their names only."""
    return cast(tuple[Event, ...], system.events)


def off_at_start(events: Sequence[Event]) -> frozenset[str]:
    """Return the forces that the first event which names them switches on."""
    first: dict[str, bool] = {}
    for event in events:
        for name in event.switch_on:
            first.setdefault(name, True)
        for name in event.switch_off:
            first.setdefault(name, False)
    return frozenset(name for name, is_off in first.items() if is_off)


def with_forces_off(system: System, off: frozenset[str]) -> System:
    """Return the system with these forces at zero; its results have the same columns."""
    if not off:
        return system
    forces: list[Force] = []
    for force in system.forces:
        is_off = getattr(force, "name", "") in off
        forces.append(replace(force, **SILENT[type(force)]) if is_off else force)
    return replace(system, forces=forces)
