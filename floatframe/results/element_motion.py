"""Outputs, states, multipliers and wrenches of public elements during a motion."""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from fe_models.foundation.arrays import Array
from fe_models.foundation.presentation import presented
from fe_models.foundation.records import checked_fields
from fe_models.foundation.words import nearest, quoted
from floatframe.engine.compiling.callbacks import raise_errors_of
from floatframe.engine.compiling.callbacks.law_functions import called_law, law_callbacks
from floatframe.engine.compiling.public_elements import PlacedLaw
from floatframe.engine.compiling.system import compiled_system
from floatframe.errors import ModelError, ResultsError
from floatframe.model.elements.switched_off import law_switched_off, times_off
from floatframe.model.system import System
from floatframe.results.coordinate_elements import named_unknowns, require_same_unknowns
from floatframe.results.joint_coordinates import end_motion
from floatframe.results.place_motion import PlaceMotion
from floatframe.results.trajectory import Trajectory

__all__ = ["ElementMotion", "element_motion", "placed_law"]


@presented
@dataclass(frozen=True, eq=False)
@checked_fields(ModelError)
class ElementMotion:
    """Outputs, states and multipliers of an element over time, by name, (n_t,) each, and its wrenches.

    Parameters
    ----------
    t
        Times, (n_t,) [s].
    outputs
        Outputs by name, (n_t,) each.
    states
        States by name, (n_t,) each.
    multipliers
        Multipliers by name, (n_t,) each.
    wrench
        Force and moment on the body of each marker, ground axes, (n_t, n_markers, 6) [N, N m].
    """

    t: Array
    outputs: Mapping[str, Array]
    states: Mapping[str, Array]
    multipliers: Mapping[str, Array]
    wrench: Array


def placed_law(system: System, name: str, where: str = "element_motion") -> PlacedLaw:
    """Return the compiled law of an element; `ResultsError` with the nearest name if there is none."""
    laws = compiled_system(system).laws
    names = [placed.element.name for placed in laws]
    if name not in names:
        raise ResultsError(f"{where}: no element {quoted(name)}{nearest(name, names)}")
    return laws[names.index(name)]


def element_motion(system: System, trajectory: Trajectory, name: str) -> ElementMotion:
    """Return outputs, states, multipliers and wrenches of a public element during a motion of the system.

    States and multipliers are taken from the motion. The law of the element computes outputs and wrenches from these
    and from the motion of the markers; while events have switched the element off, its `off` law does.

    Parameters
    ----------
    system
        The system that moved.
    trajectory
        Its motion.
    name
        Name of the element.

    Raises
    ------
    ResultsError
        If there is no such element, or the motion is of another system.
    """
    placed = placed_law(system, name)
    require_same_unknowns(system, trajectory)
    places = [end_motion(system, trajectory, marker, name) for marker in placed.markers]
    law = placed.law
    states, multipliers = placed.states, placed.multipliers
    motion = [motion_row(place, law.accelerations) for place in places]
    inputs = np.column_stack([trajectory.t, *motion, trajectory.unknowns([*states, *multipliers])])
    n_all, data = placed.n_out + len(law.outputs), np.asarray(law.data)
    out = called_law(placed.value.address, placed.head, data, inputs, n_all)
    raise_errors_of([placed.value])
    happened = trajectory.head.summary.get("events", ())
    is_off = times_off([*system.events, *placed.element.events()], happened, trajectory.t, name)
    if is_off.any():
        value, _ = law_callbacks(f"element {name!r}", law_switched_off(law), placed.head)
        out[is_off] = called_law(value.address, placed.head, data, inputs[is_off], n_all)
    n = len(placed.markers)
    return ElementMotion(
        trajectory.t,
        {each: out[:, placed.n_out + k] for k, each in enumerate(law.outputs)},
        named_unknowns(trajectory, law.states, states),
        named_unknowns(trajectory, law.multipliers, multipliers),
        out[:, : 6 * n].reshape(-1, n, 6),
    )


def motion_row(place: PlaceMotion, accelerations: bool) -> Array:
    """Return position, axes row by row, velocity and angular velocity, (n_t, 18), or with their rates, (n_t, 24)."""
    parts = [place.position, place.axes.reshape(-1, 9), place.velocity, place.omega]
    if accelerations:
        parts += [place.acceleration, np.zeros_like(place.omega) if place.alpha is None else place.alpha]
    return np.column_stack(parts)
