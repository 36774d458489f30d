"""The head of a results file: all content besides arrays, as JSON text that is validated when it is read."""

import json
import math
from collections.abc import Mapping
from dataclasses import asdict, dataclass, field, fields
from typing import Any

from fe_models.foundation.presentation import presented
from fe_models.foundation.units import UNIT_SYSTEMS
from fe_models.foundation.words import quoted
from floatframe.engine.compiling.counted_angles import CountedAngle, direction

__all__ = ["BodyEntry", "Head", "head_of_text", "text_of_head"]

OPTIONAL = {"summary", "angles", "places", "loads", "load_cases"}
NUMBERS_OF_RUN = ("t_start", "t_end", "h")


@presented
@dataclass(frozen=True)
class BodyEntry:
    """The columns of a body in the arrays of a results file."""

    name: str
    n_q: int
    q0: int  #: first column in q
    u0: int  #: first column in u
    source: str = ""  #: path of the modal file; "" for rigid bodies and bodies made in memory
    digest: str = ""  #: digest of the modal file
    is_stiffened: bool = False  #: whether its geometric stiffness is used


@presented
@dataclass(frozen=True)
class Head:
    """The content of a results file besides arrays."""

    system: str
    units: str  #: name of the unit system
    bodies: tuple[BodyEntry, ...]
    joints: tuple[str, ...]
    springs: tuple[str, ...]
    #: first column in w of each connection (joints, springs, couplers, user forces), then the number of columns
    w0: tuple[int, ...]
    run: Mapping[str, Any]  #: integrator and its parameters, h, t_end, version
    #: for a completed run: n_steps, n_rejected, n_iterations (Newton), wall_time [s]
    summary: Mapping[str, Any] = field(default_factory=dict)
    angles: tuple[CountedAngle, ...] | None = None  #: angles in the columns of `angle`; None: not counted
    #: for each sensor, descriptions of the nodes that it uses on flexible bodies, with their distance from the given
    #: points
    places: Mapping[str, tuple[str, ...]] = field(default_factory=dict)
    loads: tuple[str, ...] | None = None  #: point forces, in the order of `load`; None: not written
    load_cases: tuple[str, ...] | None = None  #: load cases, in the order of `load_case`; None: not written


def text_of_head(head: Head) -> str:
    """Return the head as JSON text."""
    return json.dumps(asdict(head))


def head_of_text(text: Any) -> Head:
    """Return the head for a JSON text.

    Raises
    ------
    ValueError
        If it is not a head, or is inconsistent; the message names the key.
    """
    try:
        data = json.loads(text)
    except (TypeError, ValueError, RecursionError):
        raise ValueError("head: expected JSON text") from None
    known = [part.name for part in fields(Head)]
    require(isinstance(data, dict) and set(data) <= set(known) and set(known) - set(data) <= OPTIONAL,
            "head", f"an object with {', '.join(known)}", data)  # fmt: skip
    for name in ("system", "units"):
        require(isinstance(data[name], str), name, "text", data[name])
    require(data["units"] in UNIT_SYSTEMS, "units", f"one of {', '.join(UNIT_SYSTEMS)}", data["units"])
    for name in ("joints", "springs"):
        require(is_list(data[name], str), name, "a list of names", data[name])
    require(is_list(data["bodies"], dict) and data["bodies"], "bodies", "a list of objects", data["bodies"])
    bodies = entries_of(data["bodies"])
    n_connections, w0 = len(data["joints"]) + len(data["springs"]), data["w0"]
    # couplers and user forces also have columns, after those of joints and springs, but no names in these lists
    require(is_list(w0, int) and len(w0) > n_connections and w0[0] == 0 and w0 == sorted(w0),
            "w0", f"at least {n_connections + 1} whole numbers that ascend from 0", w0)  # fmt: skip
    summary = data.get("summary", {})
    require(isinstance(summary, dict), "summary", "an object", summary)
    check_run(data["run"])
    check_summary(summary)
    angles = None if data.get("angles") is None else angles_of(data["angles"], len(bodies))
    places = data.get("places", {})
    is_words = isinstance(places, dict) and all(is_list(words, str) for words in places.values())
    require(is_words, "places", "an object of lists of words", places)
    loads: list[tuple[str, ...] | None] = []
    for name in ("loads", "load_cases"):
        names = data.get(name)
        require(names is None or is_list(names, str), name, "a list of names", names)
        loads.append(None if names is None else tuple(names))
    require((loads[0] is None) == (loads[1] is None), "load_cases", "a list of names with that of loads", loads[1])
    return Head(data["system"], data["units"], bodies, tuple(data["joints"]), tuple(data["springs"]), tuple(w0),
                data["run"], summary, angles, {name: tuple(words) for name, words in places.items()},
                *loads)  # fmt: skip


def angles_of(tables: Any, n_bodies: int) -> tuple[CountedAngle, ...]:
    """Return the angles whose full turns were counted."""
    require(is_list(tables, dict), "angles", "a list of objects", tables)
    keys = [part.name for part in fields(CountedAngle)]
    angles = []
    for k, table in enumerate(tables):
        where = f"angles[{k}]"
        table = {"part": -1} | table  # missing in older files
        require(set(table) == set(keys), where, f"an object with {', '.join(keys)}", table)
        for name in ("holder", "other"):
            is_body = type(table[name]) is int and -1 <= table[name] < n_bodies
            require(is_body, f"{where}.{name}", f"a whole number from -1 to {n_bodies - 1}", table[name])
        for name in ("x", "z", "y"):
            is_direction = isinstance(table[name], list) and len(table[name]) == 3 and all(map(is_number, table[name]))
            require(is_direction, f"{where}.{name}", "three numbers", table[name])
        require(table["sign"] in (-1.0, 1.0), f"{where}.sign", "1 or -1", table["sign"])
        is_part = type(table["part"]) is int and -1 <= table["part"] < 3
        require(is_part, f"{where}.part", "a whole number from -1 to 2", table["part"])
        x, z, y = (direction(table[name]) for name in ("x", "z", "y"))
        angles.append(CountedAngle(table["holder"], table["other"], x, z, y, float(table["sign"]), table["part"]))
    return tuple(angles)


def entries_of(tables: list[dict[str, Any]]) -> tuple[BodyEntry, ...]:
    """Return the bodies, whose columns must be consecutive."""
    kinds = {part.name: part.type for part in fields(BodyEntry)}
    entries: list[BodyEntry] = []
    q0 = u0 = 0
    for k, table in enumerate(tables):
        where = f"bodies[{k}]"
        require(set(table) <= set(kinds) and {"name", "n_q", "q0", "u0"} <= set(table),
                where, f"an object with {', '.join(kinds)}", table)  # fmt: skip
        for name, value in table.items():
            kind = kinds[name]
            assert isinstance(kind, type)
            expected = {str: "text", int: "a whole number"}.get(kind, "true or false")
            require(type(value) is kind, f"{where}.{name}", expected, value)
        for name, first in (("q0", q0), ("u0", u0)):
            require(table[name] == first, f"{where}.{name}", f"{first}, after the body before", table[name])
        require(table["n_q"] >= 0, f"{where}.n_q", "0 or more", table["n_q"])
        is_new = table["name"] not in [entry.name for entry in entries]
        require(is_new, f"{where}.name", "a name of its own", table["name"])
        entries.append(BodyEntry(**table))
        q0, u0 = q0 + table["n_q"], u0 + 6 + table["n_q"]
    return tuple(entries)


def check_run(run: Any) -> None:
    """Raise an error unless the used entries of the run have valid types."""
    require(isinstance(run, dict), "run", "an object", run)
    for name in NUMBERS_OF_RUN:
        if name in run:
            require(is_number(run[name]), f"run.{name}", "a finite number", run[name])
    for name in ("integrator", "system_file", "system_file_digest", "digest", "floatframe"):
        require(isinstance(run.get(name, ""), str), f"run.{name}", "text", run.get(name))
    require(isinstance(run.get("changes", {}), dict), "run.changes", "an object", run.get("changes"))
    every = run.get("output_every", 1)
    require(type(every) is int and every >= 1, "run.output_every", "a whole number above 0", every)
    gravity = run.get("gravity", [0, 0, 0])
    require(is_list(gravity, int | float) and len(gravity) == 3 and all(map(is_number, gravity)),
            "run.gravity", "three numbers", gravity)  # fmt: skip
    tolerance = run.get("error_tolerance")
    require(tolerance is None or is_number(tolerance), "run.error_tolerance", "a number", tolerance)


def check_summary(summary: Mapping[str, Any]) -> None:
    """Raise an error unless the used entries of the summary have valid types."""
    for name in ("n_steps", "n_rejected", "n_iterations"):
        value = summary.get(name, 0)
        require(type(value) is int and value >= 0, f"summary.{name}", "a whole number", value)
    require(is_number(summary.get("wall_time", 0.0)), "summary.wall_time", "a number", summary.get("wall_time"))
    watched = summary.get("watched", {})
    require(isinstance(watched, dict), "summary.watched", "an object", watched)
    for name, value in watched.items():
        is_valid = is_number(value) or (is_list(value, int | float) and all(map(is_number, value)))
        require(is_valid, f"summary.watched.{name}", "a number or a list of numbers", value)
    events = summary.get("events", [])
    require(is_list(events, dict), "summary.events", "a list of objects", events)
    for k, event in enumerate(events):
        where = f"summary.events[{k}]"
        require(isinstance(event.get("name"), str), f"{where}.name", "text", event.get("name"))
        require(is_number(event.get("t")), f"{where}.t", "a number", event.get("t"))
        require(isinstance(event.get("stop"), bool), f"{where}.stop", "true or false", event.get("stop"))
        for name in ("switch_on", "switch_off"):
            require(is_list(event.get(name), str), f"{where}.{name}", "a list of names", event.get(name))


def is_list(value: Any, kind: Any) -> bool:
    """Return whether a value is a list of items of a type."""
    return isinstance(value, list) and all(isinstance(x, kind) and not isinstance(x, bool) for x in value)


def is_number(value: Any) -> bool:
    """Return whether a value is a finite number that fits a float."""
    try:
        return isinstance(value, int | float) and not isinstance(value, bool) and math.isfinite(value)
    except OverflowError:
        return False


def require(holds: Any, where: str, expected: str, got: Any) -> None:
    """Raise `ValueError` with a key of the head unless a condition is true."""
    if not holds:
        raise ValueError(f"head: {where}: expected {expected}, got {quoted(got)}")
