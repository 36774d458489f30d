"""Keys of the system file for a place on a body: an interface, a position, or a node, element or set of its mesh."""

from typing import Annotated, Any

from pydantic import BeforeValidator

from cms.body.address import KINDS_OF_ADDRESS, Address
from cms.errors import BodyError
from fe_models.body.kept_nodes import TOLERANCE
from fe_models.foundation.toml_file import is_no_number, numbers
from fe_models.foundation.words import nearest, quoted
from floatframe.model.bodies.markers import Marker

__all__ = ["TOLERANCE_WORDS", "MeasuredPlace", "MeshNumber", "NodeOrPosition", "PlaceOnBody", "address_at", "marker_at"]

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


def address_at(place: Any, tolerance: float) -> Address:
    """Return the address of a position; an address is returned unchanged."""
    return place if isinstance(place, Address) else Address(position=place, tolerance=tolerance)


def marker_at(body: str, place: str | Position | Address | None, tolerance: float = TOLERANCE) -> Marker:
    """Return a marker at an interface, position, node, element or set."""
    if isinstance(place, str):
        return Marker(body, place)
    if isinstance(place, Address):
        named = {kind: getattr(place, kind) for kind in KINDS_OF_ADDRESS}
        return Marker(body, **named, tolerance=place.tolerance)
    return Marker(body, position=place, tolerance=tolerance)
