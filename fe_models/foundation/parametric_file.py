"""Parametric TOML files: `[parameters]` with expressions, `extends = "other.toml"`, and `repeat` for rows of objects.

A file is resolved in four steps:

1. It is merged over the files that it extends. Tables are merged key by key; an empty table, `{}`, removes its key.
2. The parameters are replaced by those given from outside (`--set length=0.4`, the points of a sweep).
3. `repeat` copies its table, once for each value of an index, or once for each row of values.
4. Each `{expression}` in a text is replaced by its value. A text that consists of one expression becomes its value, so
   `mass = "{density * volume}"` is a number.

Expressions are evaluated by simpleeval: numbers, texts, lists, comparisons, `a if x < b else c`, and `FUNCTIONS`.
"""

import copy
import json
import logging
import math
import os
import re
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from itertools import product
from pathlib import Path
from typing import Any

from fe_models.foundation.file_kinds import KINDS
from fe_models.foundation.toml_file import (
    FileContent,
    Location,
    Table,
    changed,
    key_path,
    quoted_value,
    read_toml,
    require_usable,
)
from fe_models.foundation.words import nearest, quoted

__all__ = ["extended_files", "json_schema", "read_parametric"]

log = logging.getLogger(__name__)


def mirrored(value: Any, side: float) -> Any:
    """Return a point, [x, y, z], with y times `side` (1: left, -1: right), or a list or table with all its points."""
    if isinstance(value, dict):
        return {key: mirrored(inner, side) for key, inner in value.items()}
    if not isinstance(value, list | tuple):
        raise ValueError("mirrored expects points, [x, y, z], or lists or tables of points")
    if len(value) == 3 and all(isinstance(inner, int | float) for inner in value):
        return [value[0], side * value[1], value[2]]
    return [mirrored(inner, side) for inner in value]


def weighted(points: Sequence[Sequence[float]], weights: Sequence[float]) -> list[float]:
    """Return the sum of points, each times its weight: [1, -1] for a difference, [0.5, 0.5] for the middle."""
    return [
        sum(weight * value for weight, value in zip(weights, values, strict=True))
        for values in zip(*points, strict=True)
    ]


MOST_COPIES = 20_000  #: largest number of tables that `repeat` may create in one file
FUNCTIONS: dict[str, Callable[..., Any]] = {
    **{name: getattr(math, name) for name in ("sin", "cos", "tan", "asin", "acos", "atan", "atan2", "sqrt", "exp",
                                               "log", "radians", "degrees", "hypot", "floor", "ceil")},
    "abs": abs, "min": min, "max": max, "round": round, "int": int, "str": str, "len": len, "sum": sum,
    "mirrored": mirrored, "weighted": weighted,
    "range": lambda *limits: list(range(*(min(limit, MOST_COPIES) for limit in limits))),
}  # fmt: skip
CONSTANTS = {"pi": math.pi}
INDEX = "i"  #: name of the index if `repeat` is a count
EXPRESSION = re.compile(r"\{\{|\}\}|\{([^{}]*)\}")


def read_parametric(path: Path, error: type[Exception], changes: Mapping[str, Any] | None = None) -> FileContent:
    """Return the resolved content of a parametric file.

    Parameters
    ----------
    path
        Path of the file.
    error
        Class of the error to raise.
    changes
        Values from outside: parameters by name, all other keys by key path in the resolved file.

    Raises
    ------
    error
        With file and line, if an expression, a name, a parameter, a base file or a `repeat` is not valid.
    """
    content, origins, files = merged(Path(path), error, ())
    given = content.pop("parameters", {})
    if not isinstance(given, dict):
        raise error(f"{path}: parameters = {quoted_value(given)}: expected a table of names and values")
    changes = dict(changes or {})
    set_outside = {name: changes.pop(name) for name in list(changes) if name in given}
    resolver = Resolver(Path(path), error, {**given, **set_outside}, frozenset(set_outside), origins)
    if given or any(location[-1] == "repeat" for location in locations(content)):
        content, origins = resolver.table(content, (), (), {}), resolver.resolved
        require_usable(content, Path(path), error)
    values = {name: resolver.parameter(name) for name in given}
    result = FileContent(content, Path(path), files=files, origins=origins, parameters=values)
    unused = [name for name in given if name not in resolver.used]
    if unused and not changes and not set_outside:
        log.warning("%s: parameters that nothing uses: %s", path, ", ".join(unused))
    if changes:
        for key in changes:
            if "." not in key and key not in result:
                raise error(f"{path}: there is no parameter {quoted(key)}{nearest(key, given)}")
        return changed(result, changes, str(path), error)
    return result


REPEAT = "a count, a table of names with counts or lists, or rows"  #: meaning of the key `repeat` of every table


def json_schema(model: type[Table], *, is_parametric: bool) -> dict[str, Any]:
    """Return the JSON schema of the files of a model, with which editors complete and describe keys.

    In a parametric file, every value may be a text with an expression, every table may be repeated, and
    `[parameters]` and `extends` are keys of the file. No key is required, because a base file may contain it.
    """
    schema = model.model_json_schema()
    if not is_parametric:
        return schema
    tables = {name: with_expressions(table) for name, table in schema.get("$defs", {}).items()}
    schema = with_expressions(schema)
    for table in tables.values():
        if "properties" in table:
            table["properties"]["repeat"] = {"description": REPEAT}
    if tables:
        schema["$defs"] = tables
    schema["properties"]["parameters"] = {"type": "object", "description": "values and expressions by name"}
    schema["properties"]["extends"] = {
        "type": ["string", "array"], "description": "a file over which this one is merged, or several"
    }  # fmt: skip
    return schema


#: first line of a file that names its schema
SCHEMA_LINE = re.compile(rb"#:schema (?:\.\./)*([a-z]+)\.schema\.json\r?\n")


def schema_text(kind: str) -> str:
    """Return the JSON schema of a kind of file, one of `KINDS`."""
    schema = json_schema(KINDS[kind].table_class(), is_parametric=KINDS[kind].is_parametric)
    return json.dumps(schema, indent=1) + "\n"


def schemas_named_in(contents: Iterable[bytes]) -> dict[str, bytes]:
    """Return the schemas that the first lines of some files name, by the name of the file that holds each schema."""
    kinds = {found[1].decode() for content in contents if (found := SCHEMA_LINE.match(content))}
    return {f"{kind}.schema.json": schema_text(kind).encode() for kind in sorted(kinds)}


EXPRESSION_SCHEMA = {"type": "string", "pattern": r"\{.+\}"}
REMOVED_SCHEMA = {"type": "object", "maxProperties": 0}  #: an empty table removes the key that a base file gives


def with_expressions(schema: Mapping[str, Any]) -> dict[str, Any]:
    """Return the schema with expressions allowed for every key and list entry, and empty tables for every key."""

    def either(value: Any, *others: Any) -> Any:
        """Return the schema of a value, of an expression, or of another schema."""
        if not isinstance(value, dict) or "const" in value:
            return value
        words = {"description": value["description"]} if "description" in value else {}
        return words | {"anyOf": [with_expressions(value), EXPRESSION_SCHEMA, *others]}

    found = {key: value for key, value in schema.items() if key != "required"}
    if "items" in found:
        found["items"] = either(found["items"])
    if "prefixItems" in found:
        found["prefixItems"] = [either(value) for value in found["prefixItems"]]
    if "anyOf" in found:
        found["anyOf"] = [with_expressions(value) for value in found["anyOf"]]
    if "additionalProperties" in found:
        # a table of another type than that of the base file removes keys that its own type does not have
        found["additionalProperties"] = either(found["additionalProperties"], REMOVED_SCHEMA) or REMOVED_SCHEMA
    if "properties" in found:
        found["properties"] = {
            name: value if name == "kind" else either(value, REMOVED_SCHEMA)
            for name, value in found["properties"].items()
        }
    return found


def extended_files(path: Path, error: type[Exception]) -> tuple[Path, ...]:
    """Return the files that a file extends, directly or not."""
    return merged(Path(path), error, ())[2][1:]


# Step 1: files that a file extends -----------------------------------------------------------------------------------


def merged(
    path: Path, error: type[Exception], chain: tuple[Path, ...]
) -> tuple[dict[str, Any], dict[Location, tuple[Path, Location]], tuple[Path, ...]]:
    """Return the content of a file merged over the files that it extends, the origin of each key, and all files."""
    if path.resolve() in [each.resolve() for each in chain]:
        names = " extends ".join(each.name for each in (*chain, path))
        raise error(f"{chain[0]}: files extend each other in a circle: {names}")
    own = read_toml(path, error)
    bases = own.pop("extends", [])
    bases = [bases] if isinstance(bases, str) else bases
    if not isinstance(bases, list) or not all(isinstance(base, str) for base in bases):
        raise error(f"{path}: extends = {quoted_value(bases)}: expected a file name, or a list of file names")
    own_origins = {location: (path, location) for location in locations(own)}
    if not bases:
        return own, own_origins, (path,)
    content: dict[str, Any] = {}
    origins: dict[Location, tuple[Path, Location]] = {}
    files = [path]
    for base in bases:
        lower, lower_origins, lower_files = merged(path.parent / base, error, (*chain, path))
        files += lower_files
        if (path.parent / base).parent.resolve() != path.parent.resolve():
            lower = relocated(lower, (path.parent / base).parent)
        merge(content, lower, lower_origins, origins)
    merge(content, own, own_origins, origins)
    return content, origins, tuple(dict.fromkeys(files))


def merge(
    content: dict[str, Any],
    upper: Mapping[str, Any],
    upper_origins: Mapping[Location, tuple[Path, Location]],
    origins: dict[Location, tuple[Path, Location]],
    here: Location = (),
) -> None:
    """Merge the tables of another file into the content; an empty table removes its key."""
    for key, value in upper.items():
        location = (*here, key)
        if value == {}:
            content.pop(key, None)
            continue
        if isinstance(value, dict):
            if not isinstance(content.get(key), dict):
                content[key], origins[location] = {}, upper_origins[location]
            merge(content[key], value, upper_origins, origins, location)
            continue
        content[key] = copy.deepcopy(value)
        for inner in ((), *locations(value)):
            origins[*location, *inner] = upper_origins[*location, *inner]


def locations(value: Any) -> Iterator[Location]:
    """Yield the key paths of all values inside tables and lists."""
    items = value.items() if isinstance(value, dict) else enumerate(value) if isinstance(value, list) else ()
    for key, inner in items:
        yield (key,)
        yield from ((key, *rest) for rest in locations(inner))


def relocated(value: Any, folder: Path) -> Any:
    """Return the content of a file in another folder, with absolute paths of the files in that folder."""
    if isinstance(value, dict):
        return {key: relocated(inner, folder) for key, inner in value.items()}
    if isinstance(value, list):
        return [relocated(inner, folder) for inner in value]
    is_file = isinstance(value, str) and "." in value and len(value) < 1000 and (folder / value).is_file()
    return os.path.abspath(folder / value) if is_file else value


# Steps 2 to 4: parameters, repeat, expressions -----------------------------------------------------------------------


@dataclass(eq=False)
class Resolver:
    """Evaluates the parameters and expressions of one file, and copies the tables that are repeated."""

    path: Path
    error: type[Exception]
    given: Mapping[str, Any]
    set_outside: frozenset[str]
    origins: Mapping[Location, tuple[Path, Location]]
    resolved: dict[Location, tuple[Path, Location]] = field(default_factory=dict)
    used: set[str] = field(default_factory=set)
    values: dict[str, Any] = field(default_factory=dict)
    pending: list[str] = field(default_factory=list)
    n_copies: int = 0

    def problem(self, location: Location, text: str) -> Exception:
        """Return the error about the value at a key path of the file."""
        place = FileContent({}, self.path, origins=self.origins).place(location)
        return self.error(f"{self.path}: {key_path(location)}: {text}{place}")

    def parameter(self, name: str) -> Any:
        """Return the value of a parameter; parameters that it uses are evaluated first."""
        if name in self.values:
            return self.values[name]
        if name in self.pending:
            circle = " -> ".join([*self.pending[self.pending.index(name) :], name])
            raise self.problem(("parameters", name), f"parameters use each other in a circle: {circle}")
        self.pending.append(name)
        value = self.given[name]
        if name not in self.set_outside:
            value = self.parameter_value(value, ("parameters", name))
        self.pending.pop()
        self.values[name] = value
        return value

    def parameter_value(self, value: Any, location: Location) -> Any:
        """Return the value of a parameter from its entry in the file, where each text is an expression."""
        if isinstance(value, str):
            return self.expression(value, location, {})
        if isinstance(value, list):
            return [self.parameter_value(inner, (*location, k)) for k, inner in enumerate(value)]
        if isinstance(value, dict):
            return {key: self.parameter_value(inner, (*location, key)) for key, inner in value.items()}
        return value

    def expression(self, text: str, location: Location, local: Mapping[str, Any]) -> Any:
        """Return the value of an expression."""
        from simpleeval import AttributeDoesNotExist, EvalWithCompoundTypes, FunctionNotDefined, InvalidExpression

        def value_of_name(node: Any) -> Any:
            name = node.id
            if name in local:
                return local[name]
            if name in self.given:
                self.used.add(name)
                return self.parameter(name)
            if name in CONSTANTS:
                return CONSTANTS[name]
            raise self.problem(
                location, f"unknown name {quoted(name)} in {quoted(text)}{nearest(name, [*local, *self.given])}"
            )

        try:
            value = EvalWithCompoundTypes(functions=FUNCTIONS, names=value_of_name).eval(text.strip())
        except self.error:
            raise
        except FunctionNotDefined as problem:
            name = problem.func_name
            raise self.problem(
                location, f"unknown function {quoted(name)} in {quoted(text)}{nearest(name, FUNCTIONS)}"
            ) from None
        except AttributeDoesNotExist as problem:
            raise self.problem(location, f"there is no {quoted(problem.attr)} in {quoted(text)}") from None
        except ZeroDivisionError:
            raise self.problem(location, f"{quoted(text)} divides by zero") from None
        except (InvalidExpression, SyntaxError, TypeError, ValueError, KeyError, IndexError, ArithmeticError,
                RecursionError, MemoryError) as problem:  # fmt: skip
            words = "not an expression" if isinstance(problem, SyntaxError) else str(problem).splitlines()[0]
            raise self.problem(location, f"{quoted(text)} cannot be evaluated: {words}") from None
        if isinstance(value, float) and not math.isfinite(value):
            raise self.problem(location, f"{quoted(text)} is {value}; expected a finite number")
        return list(value) if isinstance(value, tuple) else value

    def text(self, text: str, location: Location, local: Mapping[str, Any]) -> Any:
        """Return a text with its expressions replaced; if it consists of one expression, return its value."""
        whole = EXPRESSION.fullmatch(text)
        if whole and whole[1] is not None:
            return self.expression(whole[1], location, local)

        def replaced(match: re.Match[str]) -> str:
            if match[1] is None:
                return match[0][0]
            value = self.expression(match[1], location, local)
            return f"{value:.12g}" if isinstance(value, float) else str(value)

        return EXPRESSION.sub(replaced, text)

    def value(self, value: Any, source: Location, target: Location, local: Mapping[str, Any]) -> Any:
        """Return a value of the file with its expressions evaluated."""
        if source in self.origins:
            self.resolved[target] = self.origins[source]
        if isinstance(value, str):
            return self.text(value, source, local)
        if isinstance(value, dict):
            return self.table(value, source, target, local)
        return self.rows(value, source, target, local) if isinstance(value, list) else value

    def table(
        self, table: Mapping[str, Any], source: Location, target: Location, local: Mapping[str, Any]
    ) -> dict[str, Any]:
        """Return a table with its expressions evaluated and its repeated tables copied."""
        result: dict[str, Any] = {}
        for key, value in table.items():
            at = (*source, key)
            if not (isinstance(value, dict) and "repeat" in value):
                name = str(self.text(key, at, local)) if local else key
                result[name] = self.value(value, at, (*target, name), local)
                continue
            for inner in self.copies(value["repeat"], at, local):
                pattern = key if "{" in key or INDEX not in inner else f"{key}{{{INDEX}}}"
                name = str(self.text(pattern, at, inner))
                if name in result:
                    raise self.problem(
                        at, f"two copies are called {quoted(name)}; write the values that differ into the name, "
                        "such as [bodies.\"link{i}\"]",
                    )  # fmt: skip
                rest = {inner_key: each for inner_key, each in value.items() if inner_key != "repeat"}
                result[name] = self.value(rest, at, (*target, name), inner)
        return result

    def rows(self, rows: list[Any], source: Location, target: Location, local: Mapping[str, Any]) -> list[Any]:
        """Return a list with its expressions evaluated and its repeated tables copied."""
        result: list[Any] = []
        for k, value in enumerate(rows):
            at = (*source, k)
            if not (isinstance(value, dict) and "repeat" in value):
                result.append(self.value(value, at, (*target, len(result)), local))
                continue
            rest = {key: each for key, each in value.items() if key != "repeat"}
            for inner in self.copies(value["repeat"], at, local):
                result.append(self.value(rest, at, (*target, len(result)), inner))
        return result

    def copies(self, repeat: Any, location: Location, local: Mapping[str, Any]) -> Iterator[dict[str, Any]]:
        """Yield the names and values that each copy of a repeated table can use."""
        location = (*location, "repeat")
        repeat = self.value(repeat, location, location, local)
        rows: list[dict[str, Any]]
        if is_count(repeat):
            rows = [{INDEX: k + 1} for k in range(min(repeat, MOST_COPIES + 1))]
        elif isinstance(repeat, list) and repeat and all(isinstance(row, dict) for row in repeat):
            rows = repeat
        elif isinstance(repeat, dict) and repeat:
            ranges = {name: list(range(1, each + 1)) if is_count(each) else each for name, each in repeat.items()}
            if not all(isinstance(each, list) for each in ranges.values()):
                raise self.problem(location, f"expected a count or a list for each name, got {quoted_value(repeat)}")
            rows = [dict(zip(ranges, point, strict=True)) for point in product(*ranges.values())]
        else:
            raise self.problem(
                location,
                f"expected a count, a table such as {{i = 12}} or {{side = [-1, 1]}}, or a list of tables, got "
                f"{quoted_value(repeat)}",
            )
        self.n_copies += len(rows)
        if self.n_copies > MOST_COPIES:
            raise self.problem(location, f"expected up to {MOST_COPIES} repeated tables in a file")
        for row in rows:
            yield {**local, **row}


def is_count(value: Any) -> bool:
    """Whether a value is a whole number of 0 or more."""
    return isinstance(value, int) and not isinstance(value, bool) and value >= 0
