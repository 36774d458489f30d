"""Tables of the system file for public elements, [elements.NAME], whose keys are the fields of the element class."""

from collections.abc import Mapping
from dataclasses import dataclass, field, is_dataclass
from pathlib import Path
from typing import Annotated, Any

from pydantic import Field, ValidationError, create_model

from fe_models.foundation.toml_file import Table, describe, files_named
from floatframe.errors import ModelError
from floatframe.files.system_file.described import (
    FieldsTable,
    Signals,
    definition,
    fields_table_of,
    key_of,
    keys_of_fields,
    model_of_keys,
    python_value,
)
from floatframe.model.bodies.markers import Marker
from floatframe.model.elements.element import Element
from floatframe.model.elements.registry import element_class, known_elements
from floatframe.model.functions.time_functions import TimeFunction

__all__ = ["ElementSection", "TableReader", "element_of"]


@dataclass(frozen=True, eq=False)
class TableReader:
    """Reads the values in the table of an element; every error message names the key."""

    where: str  #: key path of the table
    folder: Path  #: folder of the system file
    signals: Signals = None  #: signals of the system file, by name
    files: list[str] = field(default_factory=list)  #: paths of the files that were read; each call appends to it

    def marker(self, value: Any, key: str = "marker") -> Marker:
        """Return the marker of {body = "wheel", marker = "hub", triad = [...]}."""
        found: Marker = self.value(Marker, value, key)
        return found

    def function(self, value: Any, key: str = "function") -> TimeFunction:
        """Return the function of a table as for motions, {type = "table", t = [...], values = [...]}."""
        found: TimeFunction = self.value(TimeFunction, value, key)
        return found

    def path(self, value: Any, key: str = "file") -> Path:
        """Return the path of an existing file, which is given relative to the system file."""
        found: Path = self.value(Path, value, key)
        return found

    def value(self, kind: Any, value: Any, key: str) -> Any:
        """Return a value converted to the type of a field."""
        found = key_of(kind)
        if found is None:
            return value
        keys: dict[str, Any] = {key: (found.type, Field(description=found.meaning))}
        model = create_model("Value", __base__=Table, **keys)
        return python_value(getattr(self.validated(model, {key: value}), key), self.signals)

    def fields_of(self, kind: Any, table: Mapping[str, Any], **given: Any) -> Any:
        """Return a dataclass whose fields are the keys of a table; fields without a key are passed as `given`."""
        section = self.validated(fields_table_of(kind, tuple(given)), table)
        try:
            return section.object_with(self.signals, **given)
        except ModelError:
            raise
        except (TypeError, ValueError) as error:
            raise ModelError(f"{self.where}: {error}") from error

    def validated(self, model: Any, table: Mapping[str, Any]) -> Any:
        """Return a table validated with a pydantic model."""
        try:
            section = model.model_validate(table, context=self.folder)
        except ValidationError as error:
            problems = [describe(model, detail, table) for detail in error.errors(include_url=False)]
            raise ModelError("; ".join(f"{self.where}.{problem}" for problem in problems)) from None
        self.files.extend(map(str, files_named(section)))
        return section


class AnyElement:
    """Annotation of the table of an element; its JSON schema lists the keys of the elements that do not read it."""

    def __get_pydantic_json_schema__(self, core: Any, handler: Any) -> dict[str, Any]:
        """Return the schema of a table of any type."""
        known = {
            name: model_of_keys(kind, "[elements.NAME]", name, FieldsTable, keys_of_fields(kind, ("name",)))
            for name, kind in known_elements().items()
            if is_dataclass(kind) and not hasattr(kind, "from_table")
        }
        other = {"type": "object", "properties": {"type": {"type": "string", "not": {"enum": list(known)}}}}
        return {"anyOf": [*(definition(f"element.{name}", model, handler) for name, model in known.items()), other]}


ElementSection = Annotated[dict[str, Any], AnyElement()]


def element_of(
    name: str,
    table: Mapping[str, Any],
    folder: Path,
    signals: Signals = None,
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
