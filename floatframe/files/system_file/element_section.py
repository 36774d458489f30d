"""Tables of the system file for public elements, [elements.NAME], whose keys are the fields of the element class."""

import types
from collections.abc import Mapping, Sequence
from dataclasses import MISSING, dataclass, field, fields, is_dataclass
from pathlib import Path
from typing import Any, Union, get_args, get_origin, get_type_hints

import numpy as np
from pydantic import Field, ValidationError

from fe_models.foundation.paths import near_file
from fe_models.foundation.toml_file import Matrix3, Table
from fe_models.foundation.words import nearest, quoted
from floatframe.errors import ModelError
from floatframe.files.system_file.keys import Name
from floatframe.files.system_file.motion_section import MotionSection
from floatframe.files.system_file.place_key import PlaceOnBody, marker_of
from floatframe.files.system_file.signal_section import SignalFunction
from floatframe.model.bodies.markers import Marker
from floatframe.model.elements.element import Element
from floatframe.model.elements.registry import element_class
from floatframe.model.functions.time_functions import TimeFunction

__all__ = ["TableReader", "element_of"]


class MarkerSection(Table):
    """A table that describes a marker of an element."""

    body: Name = Field(description='the name of a body, or "ground"')
    marker: PlaceOnBody | None = Field(None, description="an interface, or a position [x, y, z] in the body")
    triad: Matrix3 | None = Field(None, description="the axes of the marker, [x axis, y axis, z axis]")


@dataclass(frozen=True, eq=False)
class TableReader:
    """Reads the values in the table of an element; every error message names the key."""

    where: str  #: key path of the table
    folder: Path  #: folder of the system file
    signals: Mapping[str, SignalFunction] | None = None  #: signals of the system file, by name
    files: list[str] = field(default_factory=list)  #: paths of the files that were read; each call appends to it

    def marker(self, value: Any, key: str = "marker") -> Marker:
        """Return the marker of {body = "wheel", marker = "hub", triad = [...]}."""
        section = self.table(MarkerSection, value, key, '{body = "NAME", marker = "INTERFACE" or [x, y, z]}')
        return marker_of(section.body, section.marker, section.triad)

    def function(self, value: Any, key: str = "function") -> TimeFunction:
        """Return the function of a table as for motions, {type = "table", t = [...], values = [...]}."""
        section = self.table(MotionSection, value, key, "the table of a function, such as {type = ..., ...}")
        return section.function(self.signals)

    def path(self, value: Any, key: str = "file") -> Path:
        """Return the path of an existing file, which is given relative to the system file."""
        if not isinstance(value, str) or not value:
            raise ModelError(f"{self.where}.{key}: expected the path of a file, got {quoted(value)}")
        path = self.folder / value
        if not path.exists():
            raise ModelError(f"{self.where}.{key}: no such file: {path}{near_file(path)}")
        self.files.append(str(path))
        return path

    def table(self, model: Any, value: Any, key: str, expected: str) -> Any:
        """Return a table validated with a pydantic model."""
        if not isinstance(value, dict):
            raise ModelError(f"{self.where}.{key}: expected a table {expected}, got {quoted(value)}")
        try:
            return model.model_validate(value, context=self.folder)
        except ValidationError as error:
            told = []
            for detail in error.errors():
                place = ".".join(str(part) for part in detail["loc"])
                told.append(f"{place}: {detail['msg'].removeprefix('Value error, ')}" if place else detail["msg"])
            raise ModelError(f"{self.where}.{key}: {'; '.join(told)}; expected a table {expected}") from None

    def value(self, kind: Any, value: Any, key: str) -> Any:
        """Return a value converted to the type of a field."""
        origin, within = get_origin(kind), get_args(kind)
        if origin in (Union, types.UnionType):
            return self.value_of_union(within, value, key)
        if origin is not None and origin.__name__ == "Literal":
            if value not in within:
                choices = [str(each) for each in within]
                raise ModelError(f"{self.where}.{key}: expected one of {', '.join(choices)}, got {quoted(value)}")
            return value
        if kind is Marker:
            return self.marker(value, key)
        if kind is TimeFunction:
            return self.function(value, key)
        if kind is Path:
            return self.path(value, key)
        if kind in WORDS:
            if not isinstance(value, KINDS[kind]) or (isinstance(value, bool) and kind is not bool):
                raise ModelError(f"{self.where}.{key}: expected {WORDS[kind]}, got {quoted(value)}")
            return float(value) if kind is float else value
        if kind is np.ndarray or origin is np.ndarray:
            return self.numbers(value, key)
        if isinstance(origin, type) and issubclass(origin, Mapping) and within:
            if not isinstance(value, dict):
                raise ModelError(f"{self.where}.{key}: expected a table, got {quoted(value)}")
            return {name: self.value(within[1], each, f"{key}.{name}") for name, each in value.items()}
        if isinstance(origin, type) and issubclass(origin, Sequence) and within:
            return self.list_of(within, value, key)
        if isinstance(kind, type) and is_dataclass(kind):
            if not isinstance(value, dict):
                raise ModelError(f"{self.where}.{key}: expected a table, got {quoted(value)}")
            return TableReader(f"{self.where}.{key}", self.folder, self.signals, self.files).fields_of(kind, value)
        return value

    def value_of_union(self, kinds: Sequence[Any], value: Any, key: str) -> Any:
        """Return a value converted to the first of several types that accepts it."""
        problems = []
        for kind in kinds:
            if kind is type(None):
                continue
            try:
                return self.value(kind, value, key)
            except ModelError as error:
                problems.append(error)
        raise problems[0]

    def list_of(self, kinds: Sequence[Any], value: Any, key: str) -> Any:
        """Return a list as a tuple whose entries have one type, or one type each."""
        if not isinstance(value, list):
            raise ModelError(f"{self.where}.{key}: expected a list, got {quoted(value)}")
        own = [kind for kind in kinds if kind is not Ellipsis]
        is_alike = len(own) < len(kinds) or len(kinds) == 1
        if not is_alike and len(value) != len(own):
            raise ModelError(f"{self.where}.{key}: expected a list of {len(own)}, got {len(value)}")
        each_kind = own * len(value) if is_alike else own
        return tuple(
            self.value(kind, one, f"{key}.{k + 1}") for k, (kind, one) in enumerate(zip(each_kind, value, strict=True))
        )

    def numbers(self, value: Any, key: str) -> Any:
        """Return numbers of any shape, (...), as an array."""
        try:
            array = np.array(value, dtype=float)
        except (TypeError, ValueError):
            raise ModelError(
                f"{self.where}.{key}: expected numbers, in lists of one length, got {quoted(value)}"
            ) from None
        return array

    def fields_of(self, kind: Any, table: Mapping[str, Any], **given: Any) -> Any:
        """Return a dataclass whose fields are the keys of a table; fields without a key are passed as `given`."""
        own = {each.name: each for each in fields(kind) if each.init and each.name not in given}
        hints = get_type_hints(kind)
        for key in table:
            if key not in own:
                raise ModelError(f"{self.where}: {kind.__name__} has no key {quoted(key)}{nearest(key, list(own))}")
        for key, each in own.items():
            if key not in table and each.default is MISSING and each.default_factory is MISSING:
                raise ModelError(f"{self.where}.{key}: missing; expected {words_of(hints[key])}")
        values = {key: self.value(hints[key], value, key) for key, value in table.items()}
        try:
            return kind(**given, **values)
        except ModelError:
            raise
        except (TypeError, ValueError) as error:
            raise ModelError(f"{self.where}: {error}") from error


KINDS: dict[Any, Any] = {float: int | float, int: int, bool: bool, str: str}
WORDS: dict[Any, str] = {float: "a number", int: "a whole number", bool: "true or false", str: "text"}


def words_of(kind: Any) -> str:
    """Return the description of a value of a type, for messages."""
    if kind in WORDS:
        return WORDS[kind]
    if kind is Marker:
        return 'a marker, {body = "NAME", marker = "INTERFACE" or [x, y, z]}'
    if kind is TimeFunction:
        return "the table of a function"
    if kind is Path:
        return "the path of a file"
    return "a value" if kind is Any else getattr(kind, "__name__", str(kind))


def element_of(
    name: str,
    table: Mapping[str, Any],
    folder: Path,
    signals: Mapping[str, SignalFunction] | None = None,
    files: list[str] | None = None,
) -> Element:
    """Return the element of a table [elements.NAME]; the paths of the files that it reads are appended to `files`.

    A class with a method `from_table(name, table, read)` reads its table itself; `read` is a `TableReader`.

    Raises
    ------
    ModelError
        If a value is missing or wrong; the message names the key path.
    """
    where = f"elements.{name}"
    kind = table.get("type")
    if not isinstance(kind, str):
        raise ModelError(f'{where}.type: missing; expected "PACKAGE.ELEMENT", such as "wheels.linear-tyre"')
    try:
        found = element_class(kind, folder)
    except ModelError as error:
        raise ModelError(f"{where}.type: {error}") from error
    content = {key: value for key, value in table.items() if key != "type"}
    read = TableReader(where, folder, signals, [] if files is None else files)
    own = getattr(found, "from_table", None)
    if own is not None:
        made = own(name, content, read)
        if not isinstance(made, Element):
            raise ModelError(f"{where}: {found.__name__}.from_table: expected an element, got {made!r}")
        return made
    if not is_dataclass(found):
        raise ModelError(f"{where}: {found.__name__}: expected a dataclass, whose fields are the keys of its table")
    return read.fields_of(found, content, name=name)
