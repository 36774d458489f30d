"""Tables of the system file that describe objects: their keys are the fields of a class, explained in its docstring.

A new class with a name in a registry, such as `JOINTS`, is all that a new kind of object needs: reading, messages, the
JSON schema and the reference page of the keys follow from the class.
"""

import logging
import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field, is_dataclass
from functools import cache
from pathlib import Path
from types import GenericAlias, NoneType, UnionType
from typing import Annotated, Any, ClassVar, Literal, TypeVar, Union, get_args, get_origin

import numpy as np
import pydantic
from pydantic import (
    BeforeValidator,
    ConfigDict,
    PlainValidator,
    TypeAdapter,
    ValidationError,
    ValidationInfo,
    WithJsonSchema,
    create_model,
)
from pydantic_core import InitErrorDetails, PydanticCustomError, core_schema

from cms.body.address import Address
from fe_models.foundation.toml_file import Matrix3, Table, choice, existing_file, is_no_number
from fe_models.foundation.units import SI, Quantity, unit_text
from floatframe.errors import ModelError, SignalError
from floatframe.files.system_file.class_fields import ClassField, class_fields, summary_of
from floatframe.files.system_file.coordinate_section import CoordinateSection, NamedCoordinate
from floatframe.files.system_file.keys import Name, tuple_of_list
from floatframe.files.system_file.place_key import (
    TOLERANCE_WORDS,
    MeasuredPlace,
    MeshNumber,
    NodeOrPosition,
    PlaceOnBody,
    marker_of,
)
from floatframe.files.system_file.signal_section import SignalFunction, function_named
from floatframe.model.bodies.coordinates import Coordinate, JointCoordinateName
from floatframe.model.bodies.markers import Marker
from floatframe.model.functions.registry import TIME_FUNCTIONS
from floatframe.model.functions.time_functions import TimeFunction
from floatframe.model.joints.joint import Joint

__all__ = [
    "DescribedSection",
    "FieldsTable",
    "OneOf",
    "Signals",
    "definition",
    "fields_table_of",
    "key_of",
    "keys_of_fields",
    "model_of_keys",
    "python_value",
]

log = logging.getLogger(__name__)

Signals = Mapping[str, SignalFunction] | None  #: signals of a system file, by name


class FieldsTable(Table):
    """A table whose keys are the fields of a class."""

    model_config = ConfigDict(protected_namespaces=())
    described: ClassVar[Any]  #: the class
    is_typed: ClassVar[bool] = False  #: whether its key `type` names the class

    def object_with(self, signals: Signals, **given: Any) -> Any:
        """Return the object of the table; fields that are no keys are passed as `given`."""
        return self.described(**given, **self.python_values(signals))

    def python_values(self, signals: Signals) -> dict[str, Any]:
        """Return the values of the given keys but `type`, as the class takes them."""
        given = {key: value for key, value in self if key in self.model_fields_set}
        return {key: python_value(value, signals) for key, value in given.items() if key != "type" or not self.is_typed}


class AcceptedTable(FieldsTable):
    """A table whose object is made when it is checked, so that messages of the class name key and value."""

    def object_named(self, name: str = "", signals: Signals = None) -> Any:
        """Return the object of the table."""
        return self.object_with(signals, **({"name": name} if "name" in class_fields(self.described) else {}))

    def require_accepted(self) -> None:
        """Raise the error of the class if it does not accept the values."""
        self.object_named("")

    @pydantic.model_validator(mode="wrap")
    @classmethod
    def _accepted_by_the_class(cls, table: Any, handler: Any) -> Any:
        section = handler(table)
        try:
            section.require_accepted()
        except SignalError:  # signals are known once the whole file is read
            return section
        except ModelError as error:
            # of a message such as "joint '': axis: expected ..." or "wheel: radius: expected ..."
            owner = rf"^(\w+ ''|shape|{cls.__name__}|{re.escape(str(table.get('type')))}): "
            text = re.sub(owner, "", str(error), flags=re.IGNORECASE)
            key, _, reason = text.partition(": ")
            if key not in cls.model_fields or key not in table:
                raise ValueError(text) from None
            problem = PydanticCustomError("value_error", "{error}", {"error": reason})
            details = InitErrorDetails(type=problem, loc=(key,), input=table.get(key))
            raise ValidationError.from_exception_data(key, [details]) from None
        except (ArithmeticError, AttributeError, LookupError, TypeError) as error:  # of a class of another package
            raise ValueError(f"{cls.described.__name__}: {type(error).__name__}: {error}") from error
        return section


class MarkerSection(Table):
    """A table that describes a marker."""

    body: Name = pydantic.Field(description='the name of a body, or "ground"')
    marker: PlaceOnBody | None = pydantic.Field(None, description="an interface, or a position [x, y, z] in the body")
    triad: Matrix3 | None = pydantic.Field(None, description="the axes of the marker, [x axis, y axis, z axis]")


class DescribedSection(AcceptedTable):
    """A table that describes an object; a marker has keys for its body, its place and its axes."""

    is_measured: ClassVar[bool]  #: whether its places may be nodes, elements and sets of a mesh
    is_typed = True
    type: Any

    def object_named(self, name: str = "", signals: Signals = None) -> Any:
        """Return the object of the table."""
        given: dict[str, Any] = {}
        for each in class_fields(self.described).values():
            if is_marker(each):
                keys = marker_keys(each.name, is_measured=self.is_measured)
                values = {role: getattr(self, key) for role, key in keys.items()}
                if values["body"] is not None:
                    is_body = str in get_args(each.hint) and all(values[role] is None for role in ("place", "triad"))
                    given[each.name] = values["body"] if is_body else marker_of(**values)
                elif stray := [keys[role] for role, value in values.items() if value is not None]:
                    raise ModelError(f"{keys['body']}: missing; expected the name of the body of {stray[0]}")
            elif is_named(each.hint, self.type):
                given[each.name] = self.type
            elif each.name in self.model_fields_set:
                given[each.name] = python_value(getattr(self, each.name), signals)
        return self.described(name=name, **given)


def python_value(value: Any, signals: Signals) -> Any:
    """Return the value of a field from that of a key."""
    if isinstance(value, FunctionTable):
        return value.object_named("", signals)
    if isinstance(value, CoordinateSection):
        return value.found()
    if isinstance(value, MarkerSection):
        return marker_of(value.body, value.marker, value.triad)
    if isinstance(value, FieldsTable):
        return value.object_with(signals)
    if isinstance(value, dict):
        return {key: python_value(each, signals) for key, each in value.items()}
    return tuple(python_value(each, signals) for each in value) if isinstance(value, list | tuple) else value


# keys of a class ------------------------------------------------------------------------------------------------------


def is_marker(each: ClassField) -> bool:
    """Whether a field is a marker, which has keys for its body, its place and its axes."""
    is_place = each.name.startswith("marker") or each.name == "relative_to"
    return is_place and Marker in (each.hint, *get_args(each.hint))


def is_named(hint: Any, kind: str) -> bool:
    """Whether the `type` of the table is the value of a field, one of several literals."""
    return get_origin(hint) is Literal and kind in get_args(hint)


def marker_keys(name: str, *, is_measured: bool) -> dict[str, str]:
    """Return the keys of the marker "marker_a": "body_a", "marker_a" and "triad_a", by what they are."""
    if name == "relative_to":
        return {"body": name, "place": "relative_marker"}
    keys = {"body": name.replace("marker", "body"), "place": name, "triad": name.replace("marker", "triad")}
    return keys | ({key: key for key in OF_MESH} if is_measured and name == "marker" else {})


OF_MESH = {
    "node": (MeshNumber, "the number of a kept node in the mesh of the body"),
    "element": (MeshNumber, "the number of an element on the surface of its mesh"),
    "set": (str, "the name of a set of its mesh"),
    "tolerance": (float, TOLERANCE_WORDS),
}


def fields_of_marker(each: ClassField, *, is_measured: bool) -> dict[str, Any]:
    """Return the keys of a marker with their types and descriptions."""
    keys = marker_keys(each.name, is_measured=is_measured)
    text = ": ".join(filter(None, (f"an interface, or a position [x, y, z] in {keys['body']}", each.meaning)))
    parts = {
        "body": (Name, 'the name of a body, or "ground"'),
        "place": (MeasuredPlace if is_measured else PlaceOnBody, text),
        "triad": (Matrix3, f"the axes of {each.name}, [x axis, y axis, z axis]"),
    } | OF_MESH
    found: dict[str, Any] = {}
    for role, key in keys.items():
        kind, description = parts[role]
        if role == "body" and each.is_required:
            found[key] = (kind, pydantic.Field(description=description))
        else:
            found[key] = (kind | None, pydantic.Field(None, description=description))
    return found


def fields_of_value(each: ClassField, stated: tuple[type, ...] = ()) -> dict[str, Any]:
    """Return the key of a field with its type and description; none if a file cannot give its value.

    Fields whose default has one of the types `stated` must be stated in a file.
    """
    key = key_of(each.hint)
    if key is None:
        return {}
    text = ": ".join(filter(None, (key.meaning, each.meaning)))
    if each.is_required or isinstance(each.default, stated):
        return {each.name: (key.type, pydantic.Field(description=text))}
    extra: dict[str, Any] | None = None
    if isinstance(each.default, Quantity):
        text += f"; default: {float(each.default):g} {unit_text(SI, each.default.dimensions)}"
    elif isinstance(each.default, bool | int | float | str):
        extra = {"default": each.default}
    elif isinstance(each.default, tuple) and all(isinstance(part, int | float) for part in each.default):
        extra = {"default": [*each.default]}
    return {each.name: (key.type | None, pydantic.Field(None, description=text, json_schema_extra=extra))}


@cache
def section_of(name: str, kind: Any, place: str, stated: tuple[type, ...], is_measured: bool) -> type[DescribedSection]:
    """Return the model of the tables that describe an object of a class.

    Parameters
    ----------
    name
        The `type` of the table.
    kind
        The class, a dataclass.
    place
        Key path of the tables, such as "joints.NAME".
    stated
        Fields whose default has one of these types must be stated in a file.
    is_measured
        Whether places may be nodes, elements and sets of a mesh.
    """
    keys: dict[str, Any] = {}
    for each in class_fields(kind).values():
        if is_marker(each):
            keys |= fields_of_marker(each, is_measured=is_measured)
        elif each.name != "name" and not is_named(each.hint, name):
            keys |= fields_of_value(each, stated)
    model = model_of_keys(kind, f"[{place}]", name, DescribedSection, keys)
    model.is_measured = is_measured
    return model


Model = TypeVar("Model", bound=FieldsTable)


def model_of_keys(kind: Any, place: str, name: str, base: type[Model], keys: Mapping[str, Any]) -> type[Model]:
    """Return the model of the tables at a place that describe an object of a class and have these keys.

    With a name, they also have the key `type` of this value. No place: tables within others.
    """
    typed: dict[str, Any] = {"type": (Literal[name], pydantic.Field(description=f'"{name}"'))} if name else {}
    where = f'{place} of type "{name}"' if name else place
    text = ": ".join(filter(None, (where, summary_of(kind))))
    if isinstance(kind, type) and issubclass(kind, Joint) and kind.coordinates:
        text += f" Coordinates: {', '.join(kind.coordinates)}."
    title = {"title": name} if name else {}
    model = create_model(kind.__name__, __base__=base, __doc__=text, __cls_kwargs__=title, **typed, **keys)
    model.described = kind if isinstance(kind, type) else staticmethod(kind)
    return model


def keys_of_fields(kind: Any, left_out: tuple[str, ...] = ()) -> dict[str, Any]:
    """Return the keys of the fields of a dataclass or the arguments of a function; a marker is a table."""
    found = [fields_of_value(each) for name, each in class_fields(kind).items() if name not in left_out]
    return {name: key for each in found for name, key in each.items()}


@cache
def fields_table_of(kind: Any, left_out: tuple[str, ...] = ()) -> type[FieldsTable]:
    """Return the model of the tables whose keys are the fields of a dataclass, without those that are left out."""
    return model_of_keys(kind, "", "", FieldsTable, keys_of_fields(kind, left_out))


@dataclass(frozen=True)
class Key:
    """The type of a value in a file, and its description."""

    type: Any
    meaning: str


def key_of(hint: Any) -> Key | None:
    """Return what a file gives for a field of a type; None if a file cannot give it."""
    if hint in KEYS:
        return KEYS[hint]
    origin, within = get_origin(hint), get_args(hint)
    if origin is np.ndarray:
        return KEYS[np.ndarray]
    if origin is Literal:
        return Key(choice("value", lambda: within), f"one of {', '.join(map(str, within))}")
    if origin in (Union, UnionType):
        # the text "hub.angle" is read by the key of a coordinate
        others = {NoneType} | ({str} if JointCoordinateName in within else set())
        keys = list(dict.fromkeys(key for each in within if each not in others and (key := key_of(each)) is not None))
        return keys[0] if len(keys) == 1 else either(keys) if keys else None
    if isinstance(hint, type) and is_dataclass(hint):
        return Key(fields_table_of(hint), f"a table of the fields of {hint.__name__}")
    parts: list[Any] = [key_of(each) for each in within if each is not Ellipsis]
    if not isinstance(origin, type) or None in parts or not parts:
        return None
    kinds, meaning = tuple(part.type for part in parts), parts[-1].meaning
    if issubclass(origin, Mapping):
        return Key(GenericAlias(dict, kinds), f"a table, each value of it {meaning}")
    if origin is tuple and Ellipsis not in within:
        return Key(Annotated[GenericAlias(tuple, kinds), BeforeValidator(tuple_of_list)], f"a list of {len(kinds)}")
    return Key(GenericAlias(list, kinds), f"a list, each of it {meaning}") if issubclass(origin, Sequence) else None


def either(keys: Sequence[Key]) -> Key:
    """Return the key of a value that has one of several types."""
    return Key(Annotated[Any, Either(tuple(keys))], " or ".join(key.meaning for key in keys))


@dataclass(frozen=True)
class Either:
    """Annotation of a value that has one of several types."""

    keys: tuple[Key, ...]

    def model_of(self, value: Any) -> Any:
        """Return the type of a table that the value may be; None if it is no table."""
        for key in self.keys if isinstance(value, Mapping) else ():
            for note in getattr(key.type, "__metadata__", ()):
                if hasattr(note, "model_of"):
                    return note.model_of(value)
            if isinstance(key.type, type) and issubclass(key.type, Table):
                return key.type
        return None

    def validated(self, value: Any, info: ValidationInfo) -> Any:
        """Return the value as the first type that takes it; else the problem is that of the type that fits best."""
        problems = []
        for key in self.keys:
            try:
                return TypeAdapter(key.type).validate_python(value, strict=True, context=info.context)
            except ValidationError as problem:
                problems.append(problem)
        raise max(problems, key=lambda problem: len(problem.errors()[0]["loc"]))

    def __get_pydantic_core_schema__(self, source: Any, handler: Any) -> Any:
        """Return how a value is validated."""
        types: Any = Union.__getitem__(tuple(key.type for key in self.keys))
        return core_schema.with_info_plain_validator_function(
            self.validated, json_schema_input_schema=handler.generate_schema(types)
        )


def numbers_of_any_shape(value: Any) -> Any:
    """Return numbers, or lists of numbers, as an array."""
    try:
        if isinstance(value, str) or (not isinstance(value, list | tuple) and is_no_number(value)):
            raise ValueError
        return np.array(value, dtype=float)
    except (TypeError, ValueError):
        raise ValueError("expected numbers, in lists of one length") from None


class AnyTable(Table):
    """A table with any keys."""

    model_config = ConfigDict(extra="ignore")


# one of several classes -----------------------------------------------------------------------------------------------


@dataclass(frozen=True, eq=False)
class ObjectOf:
    """Annotation of a table that describes an object of a class.

    Parameters
    ----------
    kind
        The class, a dataclass.
    place
        Key path of the tables.
    """

    kind: Any
    place: str

    def model_of(self, value: Any) -> type[Table]:
        """Return the model of a table."""
        return plain_section_of(self.kind, self.place)

    def validated(self, value: Any, info: ValidationInfo) -> Table:
        """Return the validated table."""
        return self.model_of(value).model_validate(value, context=info.context)

    def __get_pydantic_core_schema__(self, source: Any, handler: Any) -> Any:
        """Return how a table is validated."""
        return core_schema.with_info_plain_validator_function(self.validated)

    def __get_pydantic_json_schema__(self, core: Any, handler: Any) -> dict[str, Any]:
        """Return the schema of a table."""
        return definition(self.place, self.model_of({}), handler)


@cache
def plain_section_of(kind: Any, place: str) -> type[AcceptedTable]:
    """Return the model of the tables at a place that describe an object of a class and have no `type`."""
    return model_of_keys(kind, f"[{place}]", "", AcceptedTable, keys_of_fields(kind, ("name",)))


@dataclass(frozen=True, eq=False)
class OneOf(ObjectOf):
    """Annotation of a table that describes an object of one of several classes, which its key `type` names.

    Parameters
    ----------
    kind
        Classes by the values of `type`.
    place
        Key path of the tables.
    what
        What the objects are, such as "joint".
    elsewhere
        Values of `type` by their names in other programs.
    stated
        Fields whose default has one of these types must be stated in a file.
    is_measured
        Whether places may be nodes, elements and sets of a mesh.
    """

    what: str = ""
    elsewhere: Mapping[str, str] = field(default_factory=dict)
    stated: tuple[type, ...] = ()
    is_measured: bool = False

    def model_of(self, value: Any) -> type[Table]:
        """Return the model of a table; if its type is missing or unknown, a model that says so."""
        kind = value.get("type") if isinstance(value, dict) else None
        if isinstance(kind, str) and kind in self.kind:
            return self.section(kind)
        typed = choice(f"type of {self.what}", lambda: tuple(self.kind), self.elsewhere)
        field = pydantic.Field(description=f"one of {', '.join(self.kind)}")
        return create_model(self.what, __base__=AnyTable, type=(typed, field))

    def section(self, kind: str) -> type[AcceptedTable]:
        """Return the model of the tables of a type."""
        return section_of(kind, self.kind[kind], self.place, self.stated, self.is_measured)

    def __get_pydantic_json_schema__(self, core: Any, handler: Any) -> dict[str, Any]:
        """Return the schema of a table of any type; each type has a definition of its own."""
        schemas = []
        for name in self.kind:
            try:
                schemas.append(definition(f"{self.what}.{name}", self.section(name), handler))
            except ModelError as error:  # of another package, which cannot be loaded
                log.warning("%s", error)
        return {"anyOf": schemas}


def definition(name: str, model: type[Table], handler: Any) -> dict[str, Any]:
    """Return a reference to the JSON schema of a model, which becomes a definition of its own."""
    schema = model.__pydantic_core_schema__
    if schema["type"] != "definitions":
        ref = f"{name.replace('.', '-')}.{model.__name__}:{name}"
        named: Any = {**schema, "ref": ref}
        schema = core_schema.definitions_schema(core_schema.definition_reference_schema(ref), [named])
    found: dict[str, Any] = handler(schema)
    return found


# functions of time ----------------------------------------------------------------------------------------------------


class FunctionTable(AcceptedTable):
    """A function of time of a given type; the other keys are the arguments of that function."""

    is_typed = True
    type: Any

    def object_named(self, name: str = "", signals: Signals = None) -> TimeFunction:
        """Return the function of the table; `signals` are those of the system file, by name."""
        given = self.python_values(signals)
        if "signal" in given:
            given["signal"] = function_named(given["signal"], signals or {}).function
        found: TimeFunction = self.described(**given)
        return found

    def signals(self) -> Iterator[str]:
        """Yield the names of the signals that the function contains, including those in its pieces."""
        values = dict(self)
        if values.get("signal") is not None:
            yield values["signal"]
        for piece in values.get("pieces") or ():
            yield from piece.signals()


class OneFunction(OneOf):
    """Annotation of the table of a function, whose key `type` names it."""

    def section(self, kind: str) -> type[FunctionTable]:
        """Return the model of the tables of a type."""
        return function_table_of(kind)


#: a function of time, such as [joints.NAME.motions.COORDINATE]
MotionSection = Annotated[FunctionTable, OneFunction(TIME_FUNCTIONS, "joints.NAME.motions.COORDINATE", "motion")]


@cache
def function_table_of(kind: str) -> type[FunctionTable]:
    """Return the model of the tables of a function; a signal is named, and pieces are tables of functions."""
    keys = keys_of_fields(TIME_FUNCTIONS[kind])
    if "signal" in keys:
        keys["signal"] = (Name, pydantic.Field(description="the name of a table [signals.NAME]"))
    if "pieces" in keys:
        tables = Annotated[list[MotionSection], WithJsonSchema({"type": "array", "items": {"type": "object"}})]
        meaning = class_fields(TIME_FUNCTIONS[kind])["pieces"].meaning
        keys["pieces"] = (tables, pydantic.Field(description=f"a list of tables: {meaning}"))
    return model_of_keys(TIME_FUNCTIONS[kind], "[joints.NAME.motions.COORDINATE]", kind, FunctionTable, keys)


# values ---------------------------------------------------------------------------------------------------------------


ExistingFile = Annotated[Path, BeforeValidator(existing_file())]
Numbers = list[float] | list[list[float]]
#: what a file gives for the fields of a type
KEYS: dict[Any, Key] = {
    float: Key(float, "a number"),
    int: Key(int, "a whole number"),
    bool: Key(bool, "true or false"),
    str: Key(str, "text"),
    Any: Key(Any, "a value"),
    Path: Key(ExistingFile, "the path of a file"),
    Marker: Key(MarkerSection, 'a marker, {body = "NAME", marker = "INTERFACE" or [x, y, z]}'),
    TimeFunction: Key(MotionSection, "the table of a function"),
    **dict.fromkeys(get_args(Coordinate), Key(NamedCoordinate, '"JOINT.COORDINATE" or a table of a coordinate')),
    Address: Key(NodeOrPosition, "a position [x, y, z] in the body, or {node = 12}"),
    np.ndarray: Key(
        Annotated[Any, PlainValidator(numbers_of_any_shape, json_schema_input_type=Numbers)], "a list of numbers"
    ),
}
