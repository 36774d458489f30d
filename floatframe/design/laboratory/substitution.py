"""Replacement of a flexible body of a system by another description: a new reduction, or several parts."""

from collections.abc import Callable, Mapping, Sequence
from contextlib import suppress
from dataclasses import fields, is_dataclass, replace
from functools import partial
from typing import Any

import numpy as np

from cms.body.reduced_body import ReducedBody
from cms.errors import CmsError
from fe_models.foundation.arrays import Array
from floatframe.components.flexible_parts.flexible_part import FlexiblePart
from floatframe.engine.compiling.placing import placed_bodies
from floatframe.errors import ModelError
from floatframe.model.bodies.flexible_body import FlexibleBody
from floatframe.model.bodies.markers import Marker, body_name
from floatframe.model.joints import FixedJoint
from floatframe.model.rotations import rotation_matrix
from floatframe.model.system import System
from floatframe.results.sensors.loads import EnergySensor
from floatframe.results.sensors.places import DisplacementSensor

__all__ = ["with_body", "with_part"]

NOT_OF_BODIES = (DisplacementSensor, EnergySensor)  #: sensors whose meaning changes for a body of several parts

CUT = "cut_"  #: prefix of the names of interfaces at cuts


def with_body(system: System, name: str, reduced: Sequence[ReducedBody], *, stiffening: bool) -> System:
    """Return the system with another description of a flexible body.

    Parameters
    ----------
    reduced
        The body, or its parts in order, joined at the interfaces cut_1, cut_2, ...; all parts come from one mesh.
    stiffening
        Whether geometric stiffness is included.

    Raises
    ------
    ModelError
        If there is no such flexible body, it is deformed at the start, or the system refers to a place on it that no
        part has, or to the body as a whole.
    """
    body = system.body(name)
    if not isinstance(body, FlexibleBody):
        raise ModelError(f"system {system.name!r}: body {name!r}: expected a flexible body")
    if np.any(body.q) or np.any(body.q_dot):
        raise ModelError(f"flexible body {name!r}: is deformed at the start, which other modes cannot represent")
    names = [name] if len(reduced) == 1 else [f"{name}_{k + 1}" for k in range(len(reduced))]
    parts = tuple(
        replace(body, name=part, reduced=each, q=np.zeros(0), q_dot=np.zeros(0), source="", stiffening=stiffening)
        for part, each in zip(names, reduced, strict=True)
    )
    bodies = [each for old in system.bodies for each in (parts if old.name == name else (old,))]
    if len(parts) == 1:
        return replace(system, bodies=tuple(bodies), source="")
    cuts = tuple(
        FixedJoint(f"{name}_{CUT}{k + 1}", Marker(names[k], f"{CUT}{k + 1}"), Marker(names[k + 1], f"{CUT}{k + 1}"))
        for k in range(len(parts) - 1)
    )
    to = partial(marker_on_part, parts=parts)
    changed: dict[str, Any] = {
        kind: tuple(moved(each, name, to, len(parts)) for each in getattr(system, kind))
        for kind in ("joints", "forces", "couplers", "sensors", "inputs", "outputs", "events")
    }
    changed["joints"] = (*changed["joints"], *cuts)
    return replace(system, bodies=tuple(bodies), source="", **changed)


def with_part(system: System, name: str, part: FlexiblePart) -> System:
    """Return the system with a flexible part in place of a body; sensors that the part does not support are removed.

    Raises
    ------
    ModelError
        If a joint or force refers to a place that the part does not have, or to the body as a whole.
    """
    system = replace(system, bodies=placed_bodies(system))
    body = system.body(name)
    assert isinstance(body, FlexibleBody)
    bodies = [each for old in system.bodies for each in (part.bodies if old.name == name else (old,))]
    places = {each.name: each.drawn_position for each in part.bodies}
    R = rotation_matrix(body.orientation)

    def on_part(marker: Marker) -> Marker:
        there = marker_of_part(marker, part, places, body.drawn_position, R)
        triad = there.triad if marker.triad is None else np.asarray(there.triad) @ marker.triad
        return replace(there, triad=triad)

    changed: dict[str, Any] = {
        kind: tuple(moved(each, name, on_part, 2) for each in getattr(system, kind))
        for kind in ("joints", "forces", "couplers", "inputs", "outputs", "events")
    }
    changed["forces"] = (*changed["forces"], *part.forces)
    sensors = []
    for sensor in system.sensors:
        if isinstance(sensor, NOT_OF_BODIES):
            continue
        with suppress(ModelError):
            sensors.append(moved(sensor, name, on_part, 2))
    return replace(system, bodies=tuple(bodies), source="", sensors=tuple(sensors), **changed)


def marker_of_part(
    marker: Marker, part: FlexiblePart, places: Mapping[str, Array], position: Array, R: Array
) -> Marker:
    """Return the marker on a part: an interface, or a node of the mesh by number or position."""
    if marker.interface is not None:
        found = part.marker(marker.interface)
    elif marker.node is not None:
        found = part.marker(f"node {marker.node}")
    elif marker.position is not None:
        wanted = position + R @ marker.position
        away = {body: float(np.linalg.norm(place - wanted)) for body, place in places.items()}
        nearest = min(away, key=lambda body: away[body])
        size = float(np.linalg.norm(np.ptp(list(places.values()), axis=0)))
        if away[nearest] > marker.tolerance * size:
            raise ModelError(f"{part.name!r} has no node at {marker.position.tolist()}; the nearest is {nearest!r}")
        found = Marker(nearest)
    else:
        raise ModelError(f"a marker on {part.name!r}: expected an interface or node, got an element, a set or no place")
    return replace(found, triad=np.eye(3) if found.triad is None else found.triad)


def moved(part: Any, name: str, to: Callable[[Marker], Marker], n_parts: int) -> Any:
    """Return a joint, force or sensor with its markers on the body moved to the parts."""
    if isinstance(part, Marker):
        return to(part) if body_name(part.body) == name else part
    if isinstance(part, tuple | list):
        return type(part)(moved(each, name, to, n_parts) for each in part)
    if not is_dataclass(part) or isinstance(part, type):
        return part
    changes = {}
    for each in fields(part):
        if not each.init:
            continue
        value = getattr(part, each.name)
        if value == name if isinstance(value, str) and each.name != "name" else isinstance(value, FlexibleBody):
            raise ModelError(
                f"{getattr(part, 'name', type(part).__name__)!r}: {each.name}: refers to the body {name!r} as a whole, "
                f"which has {n_parts} or more parts here; name a place on it, or remove the case"
            )
        new = (
            moved(value, name, to, n_parts)
            if isinstance(value, Marker | tuple | list) or is_dataclass(value)
            else value
        )
        if new is not value:
            changes[each.name] = new
    return replace(part, **changes) if changes else part


def marker_on_part(marker: Marker, parts: Sequence[FlexibleBody]) -> Marker:
    """Return a marker on the part that has its interface, or the node nearest to it."""
    if marker.interface is not None:
        for part in parts:
            if marker.interface in [interface.name for interface in part.reduced.interfaces]:
                return replace(marker, body=part.name)
        raise ModelError(f"no part of {parts[0].name.rpartition('_')[0]!r} has the interface {marker.interface!r}")
    address = marker.address
    if address is None:
        raise ModelError("a marker on the body frame has no place on its parts; name an interface or a node")
    found = []
    for part in parts:
        try:
            found.append((address.find(part.reduced, "laboratory").distance, part.name))
        except CmsError:
            continue
    if not found:
        raise ModelError(f"no part of {parts[0].name.rpartition('_')[0]!r} keeps {address}")
    return replace(marker, body=min(found)[1])
