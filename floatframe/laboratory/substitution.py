"""A system with another description of one of its flexible bodies: the same body anew, or parts in its place."""

from collections.abc import Sequence
from dataclasses import fields, is_dataclass, replace
from typing import Any

import numpy as np

from cms.errors import CmsError
from cms.reduced_body.reduced_body import ReducedBody
from floatframe.bodies.flexible_body import FlexibleBody
from floatframe.bodies.markers import Marker, body_name
from floatframe.errors import ModelError
from floatframe.joints import FixedJoint
from floatframe.system import System

__all__ = ["with_body"]

CUT = "cut_"  #: beginning of the names of interfaces at cuts


def with_body(system: System, name: str, reduced: Sequence[ReducedBody], *, stiffening: bool) -> System:
    """Return the system with a flexible body in another description.

    Parameters
    ----------
    reduced
        The body, or its parts in their order, joined at their interfaces cut_1, cut_2, ...; all drawn in one mesh.
    stiffening
        Whether their geometric stiffness counts.

    Raises
    ------
    ModelError
        If there is no such flexible body, it is deformed at the start, or something names a place or the body itself
        in a way that no part answers.
    """
    body = system.body(name)
    if not isinstance(body, FlexibleBody):
        raise ModelError(f"system {system.name!r}: body {name!r}: expected a flexible body")
    if np.any(body.q) or np.any(body.q_dot):
        raise ModelError(f"flexible body {name!r}: is deformed at the start; other modes know nothing of it")
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
    changed: dict[str, Any] = {
        kind: tuple(moved(each, name, parts) for each in getattr(system, kind))
        for kind in ("joints", "forces", "couplers", "sensors", "inputs", "outputs", "events")
    }
    changed["joints"] = (*changed["joints"], *cuts)
    return replace(system, bodies=tuple(bodies), source="", **changed)


def moved(part: Any, name: str, parts: Sequence[FlexibleBody]) -> Any:
    """Return a joint, force or sensor with every marker on the body moved to the part that has its place."""
    if isinstance(part, Marker):
        return marker_on_part(part, parts) if body_name(part.body) == name else part
    if isinstance(part, tuple | list):
        return type(part)(moved(each, name, parts) for each in part)
    if not is_dataclass(part) or isinstance(part, type):
        return part
    changes = {}
    for each in fields(part):
        if not each.init:
            continue
        value = getattr(part, each.name)
        if value == name if isinstance(value, str) and each.name != "name" else isinstance(value, FlexibleBody):
            raise ModelError(
                f"{getattr(part, 'name', type(part).__name__)!r}: {each.name}: names the body {name!r} as a whole, "
                f"which has {len(parts)} parts here; name a place on it, or leave the case out"
            )
        new = moved(value, name, parts) if isinstance(value, Marker | tuple | list) or is_dataclass(value) else value
        if new is not value:
            changes[each.name] = new
    return replace(part, **changes) if changes else part


def marker_on_part(marker: Marker, parts: Sequence[FlexibleBody]) -> Marker:
    """Return the same marker on the part that has its interface, or keeps the node nearest to its place."""
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
