"""TOML files: read and checked against a pydantic model; all problems are reported at once, in the user's terms.

The field descriptions of a model state what is expected ("a number above 0, Young's modulus"). A message consists of
the key path, the value found, and that description.
"""

import copy
import tomllib
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from math import inf, isfinite
from pathlib import Path
from types import MappingProxyType
from typing import Annotated, Any, TypeVar, get_args

from annotated_types import Len
from pydantic import BaseModel, BeforeValidator, ConfigDict, Field, ValidationError, ValidationInfo
from pydantic.fields import FieldInfo
from pydantic_core import ErrorDetails

from fe_models.foundation.file_kinds import KINDS
from fe_models.foundation.paths import is_stream, near_file
from fe_models.foundation.words import nearest, quoted, shortened

__all__ = [
    "FileContent", "Location", "Matrix3", "Names", "PathBeside", "Range", "Table", "Vector3", "changed",
    "choice", "describe", "files_named", "first_key", "kind_field", "names", "read_toml", "validated", "value_of",
]  # fmt: skip


class Table(BaseModel):
    """A table of a TOML file that rejects unknown keys, type conversions, NaN and infinity."""

    model_config = ConfigDict(extra="forbid", strict=True, frozen=True, allow_inf_nan=False)


Model = TypeVar("Model", bound=Table)
Location = tuple[str | int, ...]  #: key path: keys of tables and indices in lists
DEEPEST = 20  #: largest depth of nested tables and lists in a file
#: largest number in a file: products of three such numbers are finite, and no physical quantity is larger
GREATEST = 1e100
MOST_PROBLEMS = 20  #: largest number of problems in one message


class FileContent(dict[str, Any]):
    """Tables of a TOML file, with the line numbers of their values.

    Parameters
    ----------
    tables
        Content by key.
    path
        Path of the file.
    files
        The file and all files that it extends.
    origins
        File and key path there, for each key path that comes from another file.
    outside
        Key paths of values that were set from outside the file.
    parameters
        Values of the parameters of the file, by name.
    """

    def __init__(
        self,
        tables: Mapping[str, Any],
        path: Path,
        *,
        files: Sequence[Path] = (),
        origins: Mapping[Location, tuple[Path, Location]] | None = None,
        outside: Sequence[str] = (),
        parameters: Mapping[str, Any] | None = None,
    ) -> None:
        super().__init__(tables)
        self.path, self.files, self.outside = path, tuple(files) or (path,), tuple(outside)
        self.origins, self.parameters = origins or {}, parameters or {}

    def place(self, location: Location) -> str:
        """Return ' (line 12)' for a key path, ' (base.toml, line 12)' in another file, '' if it is unknown."""
        if any(key_path(location) == key or key_path(location).startswith(f"{key}.") for key in self.outside):
            return " (set from outside the file)"
        near = [location[:n] for n in range(len(location), 0, -1)]
        path, original = next((self.origins[each] for each in near if each in self.origins), (self.path, location))
        try:
            lines = line_numbers(path.read_text("utf-8-sig"))
        except (OSError, UnicodeDecodeError):
            return ""
        line = next((lines[original[:n]] for n in range(len(original), 0, -1) if original[:n] in lines), None)
        file = "" if path == self.path else f"{path.name}, "
        return "" if line is None else f" ({file}line {line})"


def read_toml(path: Path, error: type[Exception]) -> FileContent:
    """Return the content of a TOML file; raise `error` with the position and the reason if it is not valid TOML."""
    if is_stream(path):
        raise error(f"{path}: expected a file, got a device or a pipe")
    try:
        content = tomllib.loads(path.read_bytes().decode("utf-8-sig"))
    except FileNotFoundError:
        raise error(f"{path}: no such file{near_file(path)}") from None
    except OSError as problem:
        raise error(f"{path}: cannot be read: {problem.strerror}") from problem
    except UnicodeDecodeError as problem:
        raise error(
            f"{path}: expected a text file in UTF-8 (TOML), got other bytes at position {problem.start}"
        ) from None
    except RecursionError:
        raise too_deep(path, error) from None
    except ValueError as problem:  # a TOMLDecodeError, or an integer with thousands of digits
        words = f"{problem}" if isinstance(problem, tomllib.TOMLDecodeError) else "a number has too many digits"
        raise error(f"{path}: not valid TOML: {shortened(words, 200)}") from None
    require_usable(content, path, error)
    return FileContent(content, Path(path))


def too_deep(path: Path, error: type[Exception]) -> Exception:
    """Return the error of a file with too deeply nested tables or lists."""
    return error(f"{path}: tables and lists are nested too deeply; expected up to {DEEPEST} levels")


def require_usable(content: Any, path: Path, error: type[Exception]) -> None:
    """Raise `error` if a number is too large, or tables and lists are nested too deeply."""
    level: list[tuple[tuple[str | int, ...], Any]] = [((), content)]
    for _ in range(DEEPEST):
        inner: list[tuple[tuple[str | int, ...], Any]] = []
        for where, value in level:
            if isinstance(value, dict | list):
                items = value.items() if isinstance(value, dict) else enumerate(value)
                inner += [((*where, key), item) for key, item in items]
            elif isinstance(value, int | float) and GREATEST < abs(value) != inf:
                raise error(
                    f"{path}: {key_path(where)} = {quoted_value(value)}: expected a number up to {GREATEST:g} in size"
                )
        if not inner:
            return
        level = inner
    raise too_deep(path, error)


def validated(
    model: type[Model], data: Mapping[str, Any], path: Path, error: type[Exception], context: Any = None
) -> Model:
    """Return the validated model; raise `error` that lists every problem on a line of its own.

    A file that states another `kind`, or states none and has the tables of another kind, is refused in one line with
    the command for that kind.
    """
    kind, expected = data.get("kind"), model.model_fields.get("kind")
    if kind is not None and expected is not None and kind != expected.default:
        where = f"{path}: kind = {quoted_value(kind)}"
        if kind not in KINDS:
            raise error(f"{where}: there is no such kind of file{nearest(str(kind), KINDS)}")
        raise error(
            f'{where}: expected a file of kind "{expected.default}"; run this one by {KINDS[kind].command} {path.name}'
        )
    try:
        return model.model_validate(data, context=context)
    except ValidationError as problem:
        if kind is None and expected is not None and (other := kind_by_tables(data, model)):
            raise error(
                f'{path}: expected a file of kind "{expected.default}", but its tables are those of kind "{other}"; '
                f"run it by {KINDS[other].command} {path.name}"
            ) from None
        details = problem.errors(include_url=False)
        place = data.place if isinstance(data, FileContent) else lambda location: ""
        problems = [f"{describe(model, detail, data)}{place(detail['loc'])}" for detail in details[:MOST_PROBLEMS]]
    n = len(details)
    if n == 1:
        raise error(f"{path}: {problems[0]}")
    if n > MOST_PROBLEMS:
        problems.append(f"... and {n - MOST_PROBLEMS} more")
    raise error("\n".join([f"{path}: {n} problems:", *(f"  {text}" for text in problems)]))


def kind_by_tables(data: Mapping[str, Any], model: type[BaseModel]) -> str:
    """Return the kind to which all keys of a file without `kind` belong, if it has no required key of the model."""
    if any(field.is_required() and name in data for name, field in model.model_fields.items()):
        return ""
    for name, kind in KINDS.items():
        fields = kind.table_class().model_fields
        if data.keys() <= fields.keys() and all(key in data for key, field in fields.items() if field.is_required()):
            return name
    return ""


def files_named(value: Any) -> tuple[Path, ...]:
    """Return all files that a validated model names, at any depth."""
    if isinstance(value, Path):
        return (value,)
    if isinstance(value, BaseModel):
        value = [getattr(value, name) for name in type(value).model_fields]
    elif isinstance(value, Mapping):
        value = list(value.values())
    return tuple(path for each in value for path in files_named(each)) if isinstance(value, list | tuple) else ()


def describe(model: type[BaseModel], detail: ErrorDetails, data: Any = None) -> str:
    """Return one problem in the data of a model as 'key.path = value: what is wrong or expected'."""
    location = detail["loc"]
    key = key_path(location)
    parent = table_at(model, location[:-1], data) if location else None
    fields = fields_of(parent) if parent is not None else {}
    if detail["type"] == "extra_forbidden":
        title = parent.model_config.get("title") if parent is not None else None
        kind = "" if title is None else f' of type "{title}"'
        return f"{key}: unknown key{kind}{nearest(str(location[-1]), fields)}"
    if detail["type"] == "missing":
        return f"{key}: missing; expected {expected_at(model, location, data)}"
    if detail["type"] == "value_error":
        text = str(detail["ctx"]["error"])
        shows_value = location and not isinstance(detail["input"], dict | BaseModel)
        return (
            f"{key} = {quoted_value(detail['input'])}: {text}" if shows_value else f"{key}: {text}".removeprefix(": ")
        )
    return f"{key} = {quoted_value(detail['input'])}: expected {expected_at(model, location, data)}"


def expected_at(model: type[BaseModel], location: Location, data: Any = None) -> str:
    """Return the description of the key at a location, or of the nearest key around an item of a list or table."""
    for n in range(len(location), 0, -1):
        parent = table_at(model, location[: n - 1], data)
        field = None if parent is None else fields_of(parent).get(str(location[n - 1]))
        if field is not None and field.description:
            return field.description
        if table_at(model, location[:n], data) is not None:
            break
    return "a table of keys"


def fields_of(model: type[BaseModel]) -> dict[str, FieldInfo]:
    """Return the fields of a model by the keys of the file."""
    return {field.alias or name: field for name, field in model.model_fields.items()}


def key_path(location: Sequence[str | int]) -> str:
    """Return the location in TOML notation: materials.steel.young."""
    return ".".join(
        shortened(str(part)) if str(part).replace("_", "").replace("-", "").isalnum() else f'"{shortened(str(part))}"'
        for part in location
    )


def table_at(model: type[BaseModel], location: Sequence[str | int], data: Any = None) -> type[BaseModel] | None:
    """Return the model of the table at this location, or None if there is none.

    An annotation with a method `model_of(table)` chooses the model by the table in the data.
    """
    here: Any = model
    for part in location:
        notes: tuple[Any, ...] = ()
        if isinstance(here, type) and issubclass(here, BaseModel):
            field = fields_of(here).get(str(part))
            here, notes = (field.annotation, tuple(field.metadata)) if field is not None else (None, ())
        else:
            here = (get_args(here) or (None,))[-1]  # dict[str, Table], list[Table]
        given = [option for option in get_args(here) if option is not type(None)]
        if type(None) in get_args(here) and len(given) == 1:
            here = given[0]  # Table | None
        inside: Any = dict(enumerate(data)) if isinstance(data, list) else data
        data = inside.get(part) if isinstance(inside, Mapping) else None
        notes = (*notes, *getattr(here, "__metadata__", ()))
        here = next((note.model_of(data) for note in notes if hasattr(note, "model_of")), here)
    return here if isinstance(here, type) and issubclass(here, BaseModel) else None


def quoted_value(value: Any) -> str:
    """Return a value as the user wrote it, shortened."""
    if isinstance(value, bool):
        return "true" if value else "false"
    if isinstance(value, int) and abs(value) > GREATEST:  # Python does not print integers with thousands of digits
        return "a whole number of more than 100 digits"
    return shortened(f'"{value}"' if isinstance(value, str) else str(value), 60)


def kind_field(kind: str) -> Any:
    """Return the field `kind` of the model of a file: optional, and of this value."""
    return Field(kind, description=f'the kind of the file, "{kind}"')


@dataclass(frozen=True)
class Enumeration:
    """The choices of a key, for its JSON schema."""

    choices: Callable[[], Sequence[str]]

    def __get_pydantic_json_schema__(self, core_schema: Any, handler: Any) -> dict[str, Any]:
        """Return the schema of the key."""
        return {"type": "string", "enum": list(self.choices())}


def choice(what: str, choices: Callable[[], Sequence[str]], elsewhere: Mapping[str, str] = MappingProxyType({})) -> Any:
    """Return the type of a string that must be one of the choices; the message suggests the nearest choice.

    Parameters
    ----------
    what
        Kind of the choice, for the message.
    choices
        Function that returns the choices.
    elsewhere
        Choices by their names in other programs.
    """

    def check(value: Any) -> Any:
        names = choices()
        if value in elsewhere:
            raise ValueError(f'unknown {what}; it is called "{elsewhere[value]}" here')
        if value not in names:
            raise ValueError(f"unknown {what}{nearest(str(value), names)}")
        return value

    return Annotated[str, BeforeValidator(check), Enumeration(choices)]


def names(value: Any) -> Any:
    """Return one name, or a list of names, as a tuple."""
    words = [value] if isinstance(value, str) else value
    if not isinstance(words, list | tuple) or not words or not all(isinstance(w, str) and w for w in words):
        raise ValueError('expected the name of a group, or a list of names: "a" or ["a", "b"]')
    return tuple(words)


Names = Annotated[tuple[str, ...], BeforeValidator(names, json_schema_input_type=str | tuple[str, ...])]


def numbers(value: Any, count: int = 3) -> tuple[float, ...]:
    """Return `count` finite numbers as floats."""
    if not isinstance(value, list | tuple) or len(value) != count or any(is_no_number(x) for x in value):
        raise ValueError({2: "expected two numbers, [from, to]", 3: "expected three numbers, [x, y, z]"}[count])
    return tuple(float(x) for x in value)


def interval(value: Any) -> tuple[float, ...]:
    """Return two finite numbers in ascending order."""
    low, high = numbers(value, 2)
    if low >= high:
        raise ValueError("expected two numbers, [from, to], the second greater")
    return low, high


def is_no_number(value: Any) -> bool:
    """Whether a TOML value is not a number, or not finite as a float."""
    try:
        return isinstance(value, bool) or not isinstance(value, int | float) or not isfinite(value)
    except OverflowError:  # an integer with hundreds of digits
        return True


def rows(value: Any) -> tuple[tuple[float, ...], ...]:
    """Return three rows of three numbers."""
    try:
        if not isinstance(value, list | tuple) or len(value) != 3:
            raise ValueError
        return tuple(numbers(row) for row in value)
    except ValueError:
        raise ValueError("expected three rows of three numbers, [[..., ..., ...], ...]") from None


def beside(value: Any, info: ValidationInfo) -> Any:
    """Return the path that a text names, relative to the folder of the file."""
    return Path(info.context or ".") / value if isinstance(value, str) else value


def existing_file(what: str = "file") -> Callable[[Any, ValidationInfo], Path]:
    """Return the validator of the path of an existing file, relative to the folder of the file that names it.

    Parameters
    ----------
    what
        Kind of the file, for the message, such as "modal file".
    """

    def check(value: Any, info: ValidationInfo) -> Path:
        if not isinstance(value, str) or not value:
            raise ValueError(f"expected the path of a {what}, text")
        path = Path(info.context or ".") / value
        if not path.is_file():
            raise ValueError(f"no such file: {path}{near_file(path)}")
        return path

    return check


PathBeside = Annotated[Path, BeforeValidator(beside, json_schema_input_type=str)]
ThreeOf = Len(3, 3)
Vector3 = Annotated[
    tuple[float, float, float], BeforeValidator(numbers, json_schema_input_type=Annotated[list[float], ThreeOf])
]
Range = Annotated[tuple[float, float], BeforeValidator(interval)]
Matrix3 = Annotated[
    tuple[Vector3, Vector3, Vector3],
    BeforeValidator(rows, json_schema_input_type=Annotated[list[Annotated[list[float], ThreeOf]], ThreeOf]),
]


def changed(content: FileContent, changes: Mapping[str, Any], where: str, error: type[Exception]) -> FileContent:
    """Return the content of a file with changed values at some key paths.

    The table of a key must be in the file; the key itself may be new. Keys that contain dots are found too: the longest
    matching key is used.

    Raises
    ------
    error
        If a table or an index of the path does not exist.
    """
    result = copy.deepcopy(dict(content))
    for path, value in changes.items():
        holder, key = holder_of(result, path, where, error)
        holder[key] = value
    return FileContent(
        result, content.path, files=content.files, origins=content.origins, parameters=content.parameters,
        outside=(*content.outside, *changes),
    )  # fmt: skip


def value_of(content: Mapping[str, Any], path: str, where: str, error: type[Exception]) -> Any:
    """Return the value of a parameter or at a key path; raise `error` with the nearest name if it does not exist."""
    if isinstance(content, FileContent) and path in content.parameters:
        return content.parameters[path]
    holder, key = holder_of(dict(content), path, where, error)
    if isinstance(holder, dict) and key not in holder:
        raise error(f"{where}: the key path {path!r}: there is no {quoted(key)}{nearest(key, list(holder))}")
    return holder[key]


def holder_of(content: dict[str, Any], path: str, where: str, error: type[Exception]) -> tuple[Any, Any]:
    """Return the table or list that holds the value at a key path, and its key (which may be new) or index."""
    here: Any = content
    left = path
    while True:
        key, rest = first_key(here, left)
        if rest is None:
            break
        if key is None:
            choices = list(here) if isinstance(here, dict) else [str(k) for k in range(len(here))]
            name = left.split(".")[0]
            raise error(f"{where}: the key path {path!r}: there is no {quoted(name)}{nearest(name, choices)}")
        here, left = here[key], rest
        if not isinstance(here, dict | list):
            raise error(f"{where}: the key path {path!r} goes on after a value: {here!r}")
    if isinstance(here, list):
        if not left.isdigit() or int(left) >= len(here):
            raise error(f"{where}: the key path {path!r}: expected an index of 0 to {len(here) - 1}, got {left!r}")
        return here, int(left)
    return here, left


def first_key(here: dict[str, Any] | list[Any], path: str) -> tuple[Any, str | None]:
    """Return the first key of a path and the rest: (None, path) if no key fits, (None, None) at the end of the path."""
    if isinstance(here, list):
        key, _, rest = path.partition(".")
        if not rest:
            return None, None
        return (int(key), rest) if key.isdigit() and int(key) < len(here) else (None, path)
    fitting = [key for key in here if path == key or path.startswith(key + ".")]
    if any(path == key for key in fitting) or (not fitting and "." not in path):
        return None, None
    if not fitting:
        return None, path
    key = max(fitting, key=len)
    return key, path[len(key) + 1 :]


# Lines ---------------------------------------------------------------------------------------------------------------


def line_numbers(text: str) -> dict[Location, int]:
    """Return the line, from 1, of each table and key of a valid TOML text; the first line of a multi-line value."""
    found: dict[Location, int] = {}
    table: Location = ()
    n_rows: dict[Location, int] = {}
    statement, first = "", 0
    for k, line in enumerate(text.splitlines(), 1):
        first = first if statement else k
        statement += line + "\n"
        try:
            parsed = tomllib.loads(statement)
        except tomllib.TOMLDecodeError:
            continue  # the value continues on the next line
        is_header, is_row = statement.lstrip().startswith("["), statement.lstrip().startswith("[[")
        statement = ""
        path: Location = ()
        here: Any = parsed
        while isinstance(here, dict) and len(here) == 1:
            key = next(iter(here))
            path, here = (*path, key), here[key]
        if not path:
            continue
        if is_header:
            if is_row:
                outer = (*row_of(path[:-1], n_rows), path[-1])
                n_rows[outer] = n_rows.get(outer, -1) + 1
            table = row_of(path, n_rows)
            found.setdefault(table, first)
        else:
            for n in range(1, len(path) + 1):
                found.setdefault((*table, *path[:n]), first)
    return found


def row_of(path: Location, n_rows: Mapping[Location, int]) -> Location:
    """Return a key path of table headers with the index of the present row of each list of tables."""
    result: Location = ()
    for key in path:
        result = (*result, key)
        if result in n_rows:
            result = (*result, n_rows[result])
    return result
