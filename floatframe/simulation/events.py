"""Events: actions of a run at the passage of a sensor or joint coordinate through a level, or at a given time.

Event("caught", "hinge.angle", level=np.pi / 2, direction="rising", stop=True)
Event("release", "drop", column="y", level=0.2, direction="falling", switch_off=("rope",))
Event("brake", at=1.5, switch_on=("brake",))
Event("crossing", "place", column="x", record=True)
"""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any, Literal, cast

import numpy as np

from fe_models.foundation.records import checked_fields
from fe_models.foundation.words import nearest, quoted
from floatframe.engine.compiling.system import compiled_system
from floatframe.errors import ModelError
from floatframe.model.checked_values import number
from floatframe.model.elements.element import Element
from floatframe.model.elements.switched_off import SwitchedOff, off_at_start
from floatframe.model.forces import BodyLoad, Bushing, Force, JointForce, PointForce, SpringDamper
from floatframe.model.functions.time_functions import constant
from floatframe.model.joints.coordinate_coupler import CoordinateCoupler
from floatframe.model.system import System
from floatframe.results.sensors import sensor_and_column

__all__ = [
    "DIRECTIONS",
    "Event",
    "events_of",
    "has_events",
    "off_at_start",
    "require_events",
    "require_times_of_events",
    "switched",
]

DIRECTIONS = {"rising": 1, "falling": -1, "both": 0}

#: zero values that switch a force off but keep it in the system; a force without any functions would be rejected
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
@checked_fields(ModelError)
class Event:
    """Actions that are taken when a measured value passes a level, or at a given time.

    Trial steps of other sizes find the time of passage to `tolerance`. A force or an element is off at the start if the
    first event that names it switches it on. A coupler (a latch, a clutch) is off at the start if it is not `engaged`.
    An event that only records does not change the motion, bit for bit.

    Parameters
    ----------
    name
        Name of the event, unique in the system.
    watch
        A sensor of the system, "tip", a column of it, "tip.x", or "joint.coordinate"; "": the event has a time.
    level
        Level in the unit of the watched quantity.
    direction
        "rising", "falling" or "both".
    column
        Column of the sensor, such as "x" or "rate"; "": its first column.
    stop
        End the run at the event.
    switch_on
        Names of forces, couplers and elements to switch on.
    switch_off
        Names of forces, couplers and elements to switch off.
    tolerance
        Tolerance of the time, relative to the step.
    at
        Instead of `watch`: the time of the event, after the start of the run [s].
    record
        Store the results at the event, in addition to those of the output times.
    """

    name: str
    watch: str = ""
    level: float = 0.0
    direction: Literal["rising", "falling", "both"] = "both"
    column: str = ""
    stop: bool = False
    switch_on: tuple[str, ...] = ()
    switch_off: tuple[str, ...] = ()
    tolerance: float = 1e-9
    at: float | None = None
    record: bool = False

    @property
    def is_active(self) -> bool:
        """Whether the event changes the motion."""
        return self.stop or bool(self.switch_on) or bool(self.switch_off)

    @property
    def level_passed(self) -> float:
        """The level of the watched quantity, or the time of the event."""
        return self.level if self.at is None else self.at

    def __post_init__(self) -> None:
        where = f"event {self.name!r}"
        object.__setattr__(self, "level", number(f"{where}: level", self.level))
        object.__setattr__(self, "tolerance", number(f"{where}: tolerance", self.tolerance, above=0.0))
        for name in ("switch_on", "switch_off"):
            object.__setattr__(self, name, tuple(getattr(self, name)))
        if bool(self.watch) == (self.at is not None):
            given = "both" if self.watch else "neither"
            raise ModelError(
                f"{where}: expected either watch (a sensor or joint coordinate) or at (a time), got {given}"
            )
        if self.at is not None:
            object.__setattr__(self, "at", number(f"{where}: at", self.at))
            if self.column or self.level != 0.0 or self.direction != "both":
                raise ModelError(f"{where}: an event at a time has no column, level or direction; they belong to watch")
        if not (self.is_active or self.record):
            raise ModelError(
                f"{where}: expected stop, switch_on, switch_off or record, got an event without consequence"
            )

    def happens(self, before: float, after: float) -> bool:
        """Whether the value, or the time, passes the level from `before` to `after`."""
        if self.at is not None:
            return before < self.at <= after
        a, b = before - self.level, after - self.level
        rises, falls = a < 0 <= b, a > 0 >= b
        return {1: rises, -1: falls, 0: rises or falls}[DIRECTIONS[self.direction]]


def require_events(system: System) -> None:
    """Raise `ModelError` if an event watches or switches an unknown part, or one that cannot be switched."""
    forces = {getattr(force, "name", ""): force for force in system.forces}
    elements = {element.name for element in system.elements}
    couplers = {coupler.name: coupler for coupler in system.couplers}
    first_on = off_at_start(events_of(system))
    for event in events_of(system):
        where = f"event {event.name!r}"
        if event.watch:
            try:
                _, column = sensor_and_column(system, event.watch)
            except ModelError as error:
                raise ModelError(f"{where}: watch: {error}") from error
            if column and event.column:
                raise ModelError(f"{where}: expected one column, got {event.column!r} beside watch = {event.watch!r}")
        for name in (*event.switch_on, *event.switch_off):
            if name in couplers:
                require_switched(where, couplers[name], is_first_on=name in first_on)
                continue
            if name in elements:
                continue
            if name not in forces or not name:
                choices = [key for key in (*forces, *couplers, *elements) if key]
                raise ModelError(f"{where}: no force, coupler or element {quoted(name)}{nearest(name, choices)}")
            if type(forces[name]) not in SILENT:
                raise ModelError(f"{where}: a force of the kind {type(forces[name]).__name__} cannot be switched")


def require_switched(where: str, coupler: CoordinateCoupler, *, is_first_on: bool) -> None:
    """Raise `ModelError` if events cannot switch a coupler, or if a coupler waits for an event without declaring it."""
    if coupler.limits is not None:
        raise ModelError(
            f"{where}: coupler {coupler.name!r} has limits and is switched by them alone; take another coupler for the "
            "event"
        )
    if is_first_on and coupler.engaged:
        raise ModelError(
            f"{where}: an event switches coupler {coupler.name!r} on, but it is already engaged at the start; "
            "set engaged = false"
        )


def events_of(system: System) -> tuple[Event, ...]:
    """Return the events of a system, then those of its elements."""
    return cast(tuple[Event, ...], (*system.events, *(event for each in system.elements for event in each.events())))


def has_events(system: System) -> bool:
    """Whether anything may be switched in a motion: by events, by stops of couplers, or by switching functions."""
    return (
        bool(events_of(system))
        or any(coupler.limits is not None for coupler in system.couplers)
        or any(getattr(force, "switches", ()) for force in system.forces)
        or any(placed.law.switches for placed in compiled_system(system).laws)
    )


def require_times_of_events(system: System, t_start: float) -> None:
    """Raise `ModelError` if the time of an event is before the start of the run."""
    for event in events_of(system):
        if event.at is not None and event.at <= t_start:
            words = f"expected a time after the start of the run, {t_start:g}, got {event.at:g}"
            raise ModelError(f"event {event.name!r}: at: {words}")


def switched(system: System, off: frozenset[str], held: Mapping[str, float]) -> System:
    """Return the system with these forces zero, couplers released and elements off; the columns of results stay.

    held: constants of the couplers that events have switched on, by name.
    """
    if not off and not held:
        return system
    forces: list[Force] = []
    for force in system.forces:
        is_off = getattr(force, "name", "") in off
        forces.append(replace(force, **SILENT[type(force)]) if is_off else force)
    couplers = []
    for coupler in system.couplers:
        if coupler.name in off:
            coupler = replace(coupler, engaged=False)
        elif coupler.name in held:
            coupler = replace(coupler, engaged=True, limits=None, constant=held[coupler.name])
        couplers.append(coupler)
    elements: list[Element] = [SwitchedOff(each) if each.name in off else each for each in system.elements]
    return replace(system, forces=forces, couplers=couplers, elements=elements)
