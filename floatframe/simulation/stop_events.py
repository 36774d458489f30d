"""Events of stops: a coupler hits a limit, is held there while it is pressed against it, and is released."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from fe_models.foundation.arrays import Array, IntArray
from floatframe.engine.compiling.system import CompiledSystem, compiled_system
from floatframe.engine.kernels.memory import Rows
from floatframe.errors import ModelError
from floatframe.model.system import System
from floatframe.simulation.events import Event

__all__ = [
    "INWARD",
    "StopEvent",
    "coupled_sum",
    "just_inside",
    "require_off_stops",
    "require_within_limits",
    "stop_events",
    "stop_values",
    "sum_rows",
    "sum_size",
]

INWARD = {"lower": 1.0, "upper": -1.0}  #: sign of the stop force along the coordinate for each limit
#: allowed distance beyond a stop at the start of a motion, relative to the size of the coordinate sum or of the limit
BEYOND = 1e-9


@dataclass(frozen=True)
class StopEvent(Event):
    """A coupler reaches one of its limits, or is no longer pressed against the limit."""

    coupler: str = ""
    side: str = ""  #: "lower", "upper" or "release"

    @property
    def is_active(self) -> bool:
        """Whether the event changes the motion, which a stop always does."""
        return True


def stop_events(system: System) -> tuple[StopEvent, ...]:
    """Return the events of all couplers with limits."""
    events = []
    for coupler in system.couplers:
        if coupler.limits is None:
            continue
        for side in ("lower", "upper"):
            level = getattr(coupler.limits, side)
            if level is not None:
                name = f"{coupler.name} {side}"
                event = StopEvent(
                    name,
                    coupler.name,
                    level,
                    "falling" if side == "lower" else "rising",
                    coupler=coupler.name,
                    side=side,
                )
                events.append(event)
        name = f"{coupler.name} release"
        events.append(StopEvent(name, coupler.name, 0.0, direction="falling", coupler=coupler.name, side="release"))
    return tuple(events)


def sum_rows(compiled: CompiledSystem, name: str) -> tuple[IntArray, Array, int]:
    """Return the coordinate rows of a coupler with their coefficients, and the row of its multiplier."""
    model = compiled.model
    k = compiled.element_names.index(name)
    places = slice(int(model.elements.coordinate0[k]), int(model.elements.coordinate0[k + 1]))
    return model.coordinates.row[places], model.coordinates.factor[places], int(model.elements.core[k])


def coupled_sum(compiled: CompiledSystem, name: str, w: Array) -> float:
    """Return the coordinate sum of a coupler from the connection unknowns w, (n_w,)."""
    rows, factors, _ = sum_rows(compiled, name)
    return float(factors @ w[rows])


def sum_size(compiled: CompiledSystem, name: str) -> float:
    """Return the size of a coupler's coordinate sum, with the system length or one radian for each coordinate."""
    return float(compiled.gap_sizes[sum_rows(compiled, name)[2]])


def stop_values(compiled: CompiledSystem, event: StopEvent, resting: Mapping[str, str], rows: Sequence[Rows]) -> Array:
    """Return the watched value of a stop event for result rows, (n_times,).

    A limit at which the sum rests cannot be reached again, and a limit at which it does not rest cannot release it.
    """
    side, w = resting.get(event.coupler), np.concatenate([row.w for row in rows])
    if event.side == "release":
        if side is None:
            return np.ones(len(w))
        _, _, core = sum_rows(compiled, event.coupler)
        return INWARD[side] * w[:, core]
    if side is not None:
        return np.full(len(w), event.level + INWARD[event.side])
    held, factors, _ = sum_rows(compiled, event.coupler)
    return np.sum(factors[:, None] * w[:, held].T, axis=0)  # term by term, so that one row gives the same as many


def require_within_limits(compiled: CompiledSystem, events: Sequence[Event], values: Array) -> None:
    """Raise `ModelError` if a coupler is beyond a stop at the start of a motion."""
    for event, value in zip(events, values, strict=True):
        if isinstance(event, StopEvent) and event.side in INWARD:
            beyond = -INWARD[event.side] * (value - event.level)
            if beyond > BEYOND * max(sum_size(compiled, event.coupler), abs(event.level)):
                raise ModelError(
                    f"coupler {event.coupler!r}: the motion begins at {value:.6g}, beyond its {event.side} limit "
                    f"{event.level:.6g}; begin within the limits"
                )


def require_off_stops(system: System, w: Array) -> None:
    """Raise `ModelError` if an equilibrium found without stops is beyond one; w: unknowns of connections, (n_w,)."""
    compiled = compiled_system(system)
    for event in stop_events(system):
        if event.side in INWARD:
            value = coupled_sum(compiled, event.coupler, w)
            size = max(sum_size(compiled, event.coupler), abs(event.level))
            if INWARD[event.side] * (value - event.level) < -BEYOND * size:
                raise ModelError(
                    f"coupler {event.coupler!r}: the equilibrium would be at {value:.6g}, beyond its {event.side} "
                    f"limit {event.level:.6g}, so the coupler rests on the stop: for statics, give it "
                    f"constant = {event.level:g} in place of its limits"
                )


def just_inside(event: StopEvent, value: float) -> float:
    """Return a value that can reach the limit: a value at or beyond it becomes the nearest number inside."""
    inward = INWARD[event.side]
    if inward * (value - event.level) > 0.0:
        return value
    return float(np.nextafter(event.level, inward * np.inf))
