"""Reading of tyres and roads from tables of a system file."""

from collections.abc import Callable, Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any, Protocol

import numpy as np

from fe_models.foundation.words import nearest, quoted
from floatframe.components.wheels.roads.profiles import bump, cosine_bump, iso_8608_road, ramp, step
from floatframe.components.wheels.roads.road import FlatRoad, GridRoad, Grip, Polyline, Road
from floatframe.components.wheels.tyre_file import TyreProperties, read_tyre_file, shipped_tyre
from floatframe.errors import ModelError

__all__ = ["Read", "properties_of_table", "road_of_table", "tyre_of_table"]


class Read(Protocol):
    """Reads values of a table; its messages name the keys."""

    where: str

    def value(self, kind: Any, value: Any, key: str) -> Any:
        """Return a value converted to a type."""

    def path(self, value: Any, key: str = "file") -> Path:
        """Return the path of an existing file."""

    def fields_of(self, kind: Any, table: Mapping[str, Any], **given: Any) -> Any:
        """Return a dataclass whose fields are the keys of a table."""


#: function that returns the profile of each obstacle, and its arguments in addition to `length`
OBSTACLES: dict[str, tuple[Callable[..., Polyline], tuple[str, ...]]] = {
    "step": (step, ("at", "height")),
    "ramp": (ramp, ("at", "height", "run")),
    "bump": (bump, ("at", "height", "width")),
    "cosine-bump": (cosine_bump, ("at", "height", "width")),
}
#: argument and type for each key of a random road
RANDOM = {
    "class": ("road_class", str), "length": ("length", float), "seed": ("seed", int), "tracks": ("tracks", np.ndarray),
    "spacing": ("spacing", float), "band": ("band", np.ndarray), "waviness": ("waviness", float),
    "run_in": ("run_in", float), "coherence": ("coherence", float), "metre": ("metre", float),
}  # fmt: skip
TYPES = ("flat", "profile", "grid", "iso-8608", *OBSTACLES)


def road_of_table(table: Any, read: Read) -> Road:
    """Return the road of {type = "profile", x = [...], z = [...], envelope = 0.3}.

    Keys by type: flat: none; profile and grid: x, z, y, linear, or `file` (a text table with x in its first column and
    the heights at `y` in the others); iso-8608: those of `iso_8608_road`; step, ramp, bump and cosine-bump: at, height,
    run or width, length, between. `envelope`, the radius of the wheel, and `envelope_width` replace the ground by its
    envelope for a disc. `grip`, a table of x and factor, multiplies the friction along the road.
    """
    where = f"{read.where}.road"
    if not isinstance(table, dict) or not isinstance(table.get("type"), str):
        raise ModelError(f'{where}: expected a table such as {{type = "flat"}}, got {quoted(table)}')
    kind, values = table["type"], {key: value for key, value in table.items() if key not in ("type", "grip")}
    if kind not in TYPES:
        raise ModelError(f"{where}.type: expected one of {', '.join(TYPES)}, got {quoted(kind)}{nearest(kind, TYPES)}")
    road = ground_of_table(where, kind, values, read)
    return replace(road, grip=grip_of_table(where, table["grip"], read)) if "grip" in table else road


def grip_of_table(where: str, table: Any, read: Read) -> Grip:
    """Return the grip of {x = [...], factor = [...]}."""
    if not isinstance(table, dict) or set(table) != {"x", "factor"}:
        raise ModelError(f"{where}.grip: expected a table {{x = [...], factor = [...]}}, got {quoted(table)}")
    return Grip(*(read.value(np.ndarray, table[key], f"road.grip.{key}") for key in ("x", "factor")))


def ground_of_table(where: str, kind: str, values: dict[str, Any], read: Read) -> Road:
    """Return the road of a type without its grip."""

    def number(key: str, default: float | None = None) -> Any:
        if key not in values and default is not None:
            return default
        if key not in values:
            raise ModelError(f"{where}.{key}: missing; a road of type {kind!r} needs it")
        return read.value(float, values.pop(key), f"road.{key}")

    envelope = read.value(float, values.pop("envelope"), "road.envelope") if "envelope" in values else None
    if kind == "flat":
        road: Road = FlatRoad()
    elif kind in OBSTACLES:
        make, keys = OBSTACLES[kind]
        profile = make(*(number(key) for key in keys), length=number("length"))
        between = read.value(np.ndarray, values.pop("between"), "road.between") if "between" in values else None
        refuse_others(where, kind, values)
        if envelope is not None:
            return profile.enveloped(envelope, between=between)
        if between is not None:
            raise ModelError(f"{where}.between: needs the key envelope, the radius of the wheel")
        return profile.road()
    elif kind == "iso-8608":
        given = {RANDOM[k][0]: read.value(RANDOM[k][1], values.pop(k), f"road.{k}") for k in RANDOM if k in values}
        for key in ("class", "length", "seed"):
            if RANDOM[key][0] not in given:
                raise ModelError(f"{where}.{key}: missing; a random road needs it")
        road = iso_8608_road(**given)
    else:
        road = grid_of_table(where, values, read)
    width = number("envelope_width", 0.0)
    refuse_others(where, kind, values)
    if envelope is None or isinstance(road, FlatRoad):
        return road
    return road.enveloped(envelope, width=width)


def grid_of_table(where: str, values: dict[str, Any], read: Read) -> GridRoad:
    """Return the road whose knots and heights are in the file itself, or in a separate text table."""
    given: dict[str, Any] = {}
    if "file" in values:
        path = read.path(values.pop("file"), "road.file")
        try:
            text = path.read_text(encoding="utf-8").replace(",", " ").replace(";", " ")
            rows = np.array([line.split() for line in text.splitlines() if line.split("#")[0].strip()], dtype=float)
        except (OSError, UnicodeDecodeError, ValueError) as error:
            raise ModelError(
                f"{where}.file: {path}: expected rows of numbers of one length, x and heights, # before comments: "
                f"{error}"
            ) from None
        if rows.ndim != 2 or rows.shape[1] < 2:
            raise ModelError(f"{where}.file: {path}: expected two columns or more, x and heights, got {rows.shape}")
        given = {"x": rows[:, 0], "z": rows[:, 1:]}
    for key, name in (("x", "x"), ("y", "y"), ("z", "z")):
        if key in values:
            if name in given:
                raise ModelError(f"{where}.{key}: is already in the file")
            given[name] = read.value(np.ndarray, values.pop(key), f"road.{key}")
    for key in ("x", "z"):
        if key not in given:
            raise ModelError(f"{where}.{key}: missing; give x and z, or file")
    if "linear" in values:
        given["is_linear"] = read.value(bool, values.pop("linear"), "road.linear")
    return GridRoad(**given)


def refuse_others(where: str, kind: str, values: Mapping[str, Any]) -> None:
    """Raise `ModelError` if there are keys left that this type of road does not have."""
    if values:
        raise ModelError(f"{where}: a road of type {kind!r} has no key {quoted(next(iter(values)))}")


def tyre_of_table(name: str, table: Mapping[str, Any], read: Read, kind: type, **given: Any) -> Any:
    """Return a tyre of a class whose fields, except the road, are the keys of its table."""
    values = dict(table)
    if "road" in values:
        given["road"] = road_of_table(values.pop("road"), read)
    return read.fields_of(kind, values, name=name, **given)


def properties_of_table(values: dict[str, Any], read: Read) -> TyreProperties:
    """Return the tyre of `file` (with `version` if the file lacks it) or `shipped`; these keys are removed."""
    version = read.value(str, values.pop("version"), "version") if "version" in values else None
    if ("file" in values) == ("shipped" in values):
        raise ModelError(
            f"{read.where}: expected file = a tyre property file, or shipped = the name of a tyre in this package"
        )
    if "file" in values:
        return read_tyre_file(read.path(values.pop("file"), "file"), version=version)
    return read_tyre_file(shipped_tyre(read.value(str, values.pop("shipped"), "shipped")))
