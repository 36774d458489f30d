"""Keys of the system file for a place on a body: an interface, a position, or a node, element or set of its mesh."""

from typing import Annotated, Any

import numpy as np
from pydantic import BeforeValidator

from cms.body.address import KINDS_OF_ADDRESS, Address
from cms.errors import BodyError
from fe_models.body.kept_nodes import TOLERANCE
from fe_models.foundation.toml_file import is_no_number, numbers
from fe_models.foundation.words import nearest, quoted
from floatframe.model.bodies.markers import Marker

__all__ = ["TOLERANCE_WORDS", "MeasuredPlace", "MeshNumber", "NodeOrPosition", "PlaceOnBody", "marker_of"]

TOLERANCE_WORDS = (
    f"largest distance of a node from a position, relative to the size of the body; default: {TOLERANCE:g}"
)
EXPECTED = 'the name of an interface ("big_end"), a position [x, y, z] in the body'
Position = tuple[float, float, float]


def mesh_number(value: Any) -> Any:
    """Return a number in the user's mesh, or "INSTANCE.number"."""
    if isinstance(value, bool) or not isinstance(value, int | str) or value == "":
        raise ValueError('expected a whole number of the mesh, or text "INSTANCE.number"')
    return value


def place_on_body(value: Any) -> Any:
    """Return the name of an interface, a position as three numbers, or the address for {node = 12}."""
    if isinstance(value, str) and value:
        return value
    if isinstance(value, dict) and list(value) == ["node"]:
        return address_of_table(value)
    try:
        return numbers(value)
    except ValueError:
        raise ValueError(
            'expected the name of an interface ("big_end") or a position [x, y, z] in the body, or '
            "{node = 12}, a node that is an interface"
        ) from None


def measured_place(value: Any) -> Any:
    """Return the name of an interface, a position as three numbers, or the address for {node = 12}."""
    if isinstance(value, str) and value:
        return value
    return node_or_position(value, f"{EXPECTED}, or a table such as {{node = 12}}")


def node_or_position(value: Any, expected: str = "a position [x, y, z] in the body, or {node = 12}") -> Any:
    """Return a position as three numbers, or the address for {node = 12}, {element = 4711}, {set = "HOTSPOT"}."""
    if isinstance(value, dict):
        return address_of_table(value)
    try:
        return numbers(value)
    except ValueError:
        raise ValueError(f"expected {expected}") from None


def address_of_table(table: dict[str, Any]) -> Address:
    """Return the address for {node = 12}, {element = 4711}, {set = "HOTSPOT"}, {position = [...], tolerance = 0.1}."""
    keys = (*KINDS_OF_ADDRESS, "tolerance")
    for key in table:
        if key not in keys:
            raise ValueError(f"a place has no key {quoted(key)}{nearest(key, keys)}")
    given = dict(table)
    for key in ("node", "element"):
        if key in given:
            given[key] = mesh_number(given[key])
    if "set" in given and not (isinstance(given["set"], str) and given["set"]):
        raise ValueError(f"set: expected the name of a set, got {given['set']!r}")
    if "position" in given:
        given["position"] = numbers(given["position"])
    if "tolerance" in given and is_no_number(given["tolerance"]):
        raise ValueError(f"tolerance: expected a number from 0, got {given['tolerance']!r}")
    try:
        return Address(**given)
    except BodyError as error:
        raise ValueError(str(error)) from None


MeshNumber = Annotated[int | str, BeforeValidator(mesh_number)]
PlaceOnBody = Annotated[Any, BeforeValidator(place_on_body)]  #: of joints and forces: `str`, `Position` or node
MeasuredPlace = Annotated[Any, BeforeValidator(measured_place)]  #: of sensors: `str`, `Position` or `Address`
NodeOrPosition = Annotated[Any, BeforeValidator(node_or_position)]  #: `Position` or `Address`


def marker_of(
    body: str,
    place: str | Position | Address | None = None,
    triad: Any = None,
    *,
    tolerance: float | None = None,
    **mesh: Any,
) -> Marker:
    """Return a marker at an interface, position or address; the rows of the triad are its axes.

    The place may also be a `node`, `element` or `set` of the mesh.
    """
    axes = None if triad is None else np.array(triad).T
    limit = TOLERANCE if tolerance is None else tolerance
    if isinstance(place, str):
        return Marker(body, place, triad=axes, **mesh)
    if isinstance(place, Address):
        mesh |= {kind: getattr(place, kind) for kind in KINDS_OF_ADDRESS}
        return Marker(body, triad=axes, tolerance=place.tolerance, **mesh)
    return Marker(body, position=place, triad=axes, tolerance=limit, **mesh)
