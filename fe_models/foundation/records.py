"""Public objects and functions: what they are given is checked where it enters, and copies of objects are frozen too.

Annotations say what is expected; a class that has a name for each of its objects offers `of_name(text)`, and is taken
by that name too. NumPy makes writable copies of read-only arrays, and a mapping proxy cannot be pickled at all.
"""

import inspect
import sys
from collections.abc import Callable, Hashable, Iterable, Mapping, Sequence
from dataclasses import fields
from functools import cache, wraps
from types import GenericAlias, NoneType, UnionType
from typing import Annotated, Any, Literal, NamedTuple, TypeVar, Union, cast, get_args, get_origin, get_type_hints

import numpy as np
import scipy.sparse as sp
from typing_extensions import get_protocol_members, is_protocol

from fe_models.foundation.errors import ReportedError
from fe_models.foundation.words import nearest, quoted

__all__ = ["FrozenMapping", "MismatchError", "Takes", "at_door", "checked_fields", "conformed", "frozen_copies"]

MOST_KINDS = 3  #: named in a message

Class = TypeVar("Class", bound=type)
Key = TypeVar("Key")
Item = TypeVar("Item")
Result = TypeVar("Result")


# frozen copies --------------------------------------------------------------------------------------------------------


class FrozenMapping(dict[Key, Item]):
    """An immutable mapping whose copies are immutable too."""

    def _refuse(self, *_: Any, **__: Any) -> Any:
        raise TypeError("this mapping cannot be changed; make a dict of it")

    __setitem__ = __delitem__ = __ior__ = clear = pop = popitem = setdefault = update = _refuse

    def __reduce__(self) -> tuple[Any, ...]:
        return restored_mapping, (dict(self),)


def restored_mapping(items: dict[Any, Any]) -> "FrozenMapping[Any, Any]":
    """Return the mapping from its pickled items, with read-only arrays."""
    return FrozenMapping({key: read_only(value) for key, value in items.items()})


def frozen_copies(kind: Class) -> Class:
    """Decorate a frozen data class: copies hold only its fields, without cached values, and arrays are read-only."""

    def state(self: Any) -> dict[str, Any]:
        return {part.name: getattr(self, part.name) for part in fields(self)}

    def restore(self: Any, values: dict[str, Any]) -> None:
        for name, value in values.items():
            object.__setattr__(self, name, read_only(value))

    kind.__getstate__ = state  # type: ignore[method-assign, assignment]
    kind.__setstate__ = restore  # type: ignore[attr-defined]
    return kind


def read_only(value: Any) -> Any:
    """Return the value with read-only arrays, also in tuples and sparse matrices."""
    if isinstance(value, np.ndarray):
        value.flags.writeable = False
    elif isinstance(value, tuple):
        for each in value:
            read_only(each)
    elif sp.issparse(value):
        for name in ("data", "indices", "indptr"):
            read_only(getattr(value, name, None))
    return value


# checked inputs -------------------------------------------------------------------------------------------------------


class Takes(NamedTuple):
    """What a field takes, if that is more than what it holds afterwards: `Annotated[held, Takes(taken)]`."""

    hint: Any


class MismatchError(Exception):
    """A value is not of the annotated kind; the text says what was expected."""


def conformed(hint: Any, value: Any) -> Any:
    """Return a value as its annotation wants it: names become objects, an object alone a sequence of one.

    Shapes and bounds of numbers are left to those who use them.

    Parameters
    ----------
    hint
        The annotation, resolved.
    value
        What the user gave.

    Raises
    ------
    MismatchError
        If the value is of another kind.
    """
    if isinstance(hint, TypeVar):
        if hint.__constraints__:
            return _first_conformed(hint.__constraints__, value)
        hint = hint.__bound__ or Any
    origin = get_origin(hint)
    if origin is Annotated:
        held, *extras = get_args(hint)
        return conformed(next((extra.hint for extra in extras if isinstance(extra, Takes)), held), value)
    if origin in (Union, UnionType):
        return _first_conformed(get_args(hint), value)
    if origin is Literal:
        choices = get_args(hint)
        if value not in choices:
            raise MismatchError(f"one of {', '.join(map(str, choices))}")
        return value
    if origin is type:
        if not isinstance(value, type):
            raise MismatchError("a class")
        return value
    if origin is not None and isinstance(origin, type):
        if issubclass(origin, np.ndarray):
            return _of_class(np.ndarray, value)
        if issubclass(origin, Callable):  # type: ignore[arg-type]
            return _called(value)
        if issubclass(origin, Mapping):
            if not isinstance(value, Mapping):
                raise MismatchError("a dictionary")
            return value
        if issubclass(origin, Iterable):
            is_row = origin is tuple and Ellipsis not in get_args(hint)  # of items of different kinds
            return value if is_row and hasattr(value, "__len__") else _sequence(hint, origin, value)
        hint = origin
    if isinstance(hint, type) and not isinstance(hint, GenericAlias):
        return _of_class(hint, value)
    return value


def _first_conformed(hints: Sequence[Any], value: Any) -> Any:
    """Return the value for the first of some annotations that takes it as it is, else for the first that takes it."""
    found, expected = [], []
    if any("numpy._typing" in f"{getattr(hint, '__module__', '')} {hint}" for hint in hints):  # all that makes an array
        return _of_class(np.ndarray, value) if value is not None or NoneType not in hints else None
    for hint in hints:
        try:
            found.append(conformed(hint, value))
        except MismatchError as mismatch:
            expected.append(str(mismatch))
        else:
            if found[-1] is value:
                return value
    if found:
        return found[0]
    kinds = list(dict.fromkeys(words for words in expected if words != "None")) or ["None"]
    more = f" or one of {len(kinds) - MOST_KINDS} other kinds" if len(kinds) > MOST_KINDS else ""
    raise MismatchError(" or ".join(kinds[:MOST_KINDS]) + more)


def _called(value: Any) -> Any:
    if not callable(value):
        raise MismatchError("a function")
    return value


def _sequence(hint: Any, origin: type, value: Any) -> Any:
    """Return a sequence of conformed items; an item alone becomes a sequence of one."""
    item = next(iter(get_args(hint)), Any)
    if isinstance(value, str) or not isinstance(value, Iterable):
        try:
            return (conformed(item, value),)
        except MismatchError as mismatch:
            raise MismatchError(f"a list, each of it {mismatch}") from None
    if not isinstance(value, list | tuple):
        return value  # what can be gone through only once is left to its reader
    items = []
    for each in value:
        try:
            items.append(conformed(item, each))
        except MismatchError as mismatch:
            raise MismatchError(f"a list, each of it {mismatch}; one is {quoted(each)}") from None
    is_as_given = all(a is b for a, b in zip(items, value, strict=True)) and (
        origin is not tuple or origin is type(value)
    )
    return value if is_as_given else tuple(items)


def _of_class(hint: type, value: Any) -> Any:
    """Return an object of a class, also from its name; numbers and arrays are left as they are."""
    if hint in (object, Any):
        return value
    if hint in (float, int, complex, bool):
        if isinstance(value, str) or not any(hasattr(value, way) for way in ("__float__", "__index__", "__complex__")):
            raise MismatchError("a number" if hint is not bool else "True or False")
        return value
    if hint is np.ndarray or hint.__module__.startswith("scipy.sparse"):
        if isinstance(value, str) or not any(hasattr(value, way) for way in ("__len__", "__float__", "shape")):
            raise MismatchError("numbers" if hint is np.ndarray else "a matrix")
        return value
    if hint is NoneType:
        if value is not None:
            raise MismatchError("None")
        return value
    if is_protocol(hint):
        missing = [name for name in get_protocol_members(hint) if not hasattr(value, name)]
        if missing or isinstance(value, type):
            raise MismatchError(words_of(hint))
        return value
    if isinstance(value, str) and not issubclass(str, hint) and hasattr(hint, "of_name"):
        return hint.of_name(value)
    if not isinstance(value, hint):
        raise MismatchError(words_of(hint))
    return value


def words_of(hint: type) -> str:
    """Return the words for an object of a class: 'a Marker'."""
    return "text" if hint is str else f"{'an' if hint.__name__[0] in 'AEIO' else 'a'} {hint.__name__}"


@cache
def hints_of(subject: Hashable) -> dict[str, Any]:
    """Return the resolved annotations of a function or data class."""
    return get_type_hints(subject, include_extras=True)


def conformed_inputs(where: str, hints: Mapping[str, Any], given: Mapping[str, Any], error: type[Exception]) -> Any:
    """Return those inputs that change; raise the package's error for the first that is of another kind."""
    changed = {}
    for name, value in given.items():
        if name not in hints:
            continue
        try:
            found = conformed(hints[name], value)
        except MismatchError as mismatch:
            got = f"the class {value.__name__} itself" if isinstance(value, type) else quoted(value)
            given_words = "" if "one is" in str(mismatch) else f", got {got}"
            raise error(f"{where}: {name}: expected {mismatch}{given_words}") from None
        if found is not value:
            changed[name] = found
    return changed


def checked_fields(error: type[Exception]) -> Callable[[Class], Class]:
    """Decorate a data class: its fields are checked against their annotations before its own checks.

    Parameters
    ----------
    error
        Raised if a field is of another kind.
    """

    def decorate(kind: Class) -> Class:
        own = kind.__dict__.get("__post_init__") or getattr(kind, "__post_init__", None)

        def check(self: Any) -> None:
            name = getattr(self, "name", None)
            where = f"{kind.__name__} {name!r}" if isinstance(name, str) else type(self).__name__
            try:
                inputs = conformed_inputs(where, hints_of(cast(Hashable, type(self))), vars(self), error)
            except error:
                refused_by(own, self)
                raise
            for changed, value in inputs.items():
                object.__setattr__(self, changed, value)
            if own is not None:
                own(self)

        kind.__post_init__ = check  # type: ignore[attr-defined]
        return kind

    return decorate


def refused_by(own: Callable[[Any], None] | None, subject: Any) -> None:
    """Let a class refuse an object in its own words, if it does; they say more than the annotation."""
    if own is None:
        return
    try:
        own(subject)
    except Exception as failure:
        if isinstance(failure, ReportedError):
            raise  # any other: it was not made for a value of this kind


def checked_function(function: Callable[..., Result], module: str, error: type[Exception]) -> Callable[..., Result]:
    """Return a function that checks its arguments against their annotations.

    Parameters
    ----------
    function
        The function.
    module
        Module at whose door it stands, under its name.
    error
        Raised if an argument is of another kind, has an unknown name, or is missing.
    """
    signature = inspect.signature(function)
    kinds = {parameter.kind for parameter in signature.parameters.values()}
    variable = {inspect.Parameter.VAR_POSITIONAL, inspect.Parameter.VAR_KEYWORD}
    single = [name for name, parameter in signature.parameters.items() if parameter.kind not in variable]

    @wraps(function)
    def checked(*args: Any, **kwargs: Any) -> Result:
        unknown = [] if inspect.Parameter.VAR_KEYWORD in kinds else [name for name in kwargs if name not in single]
        if unknown:
            raise TypeError(f"{function.__name__}: no argument {unknown[0]!r}{nearest(unknown[0], single)}")
        try:
            bound = signature.bind(*args, **kwargs)
        except TypeError as reason:
            raise TypeError(f"{function.__name__}: {reason}") from None
        given = {name: bound.arguments[name] for name in single if name in bound.arguments}
        changed = conformed_inputs(function.__name__, hints_of(function), given, error)
        if changed:
            bound.arguments.update(changed)
            return function(*bound.args, **bound.kwargs)
        return function(*args, **kwargs)

    checked.__module__ = module
    return checked


def at_door(package: str, name: str, found: Any, error: type[Exception]) -> Any:
    """Return what a package offers under a name: of a function, the one that checks its arguments.

    Parameters
    ----------
    package
        Name of the package.
    name
        The public name.
    found
        What stands under it inside.
    error
        Raised if an argument is of another kind.
    """
    if not inspect.isfunction(found):
        return found
    checked = checked_function(found, package, error)
    setattr(sys.modules[package], name, checked)
    return checked
