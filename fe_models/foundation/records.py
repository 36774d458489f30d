"""Checks of the arguments of public objects and functions, and frozen copies of objects.

Annotations state the expected types, and the shapes of arrays (`ArrayShape`). If a class has a method
`of_name(text)`, its objects may also be given by name. Copies need care, because NumPy makes writable copies of
read-only arrays, and a mapping proxy cannot be pickled at all.
"""

import inspect
import sys
from collections import defaultdict
from collections.abc import Callable, Hashable, Iterable, Mapping, Sequence
from dataclasses import fields, is_dataclass
from functools import cache, wraps
from types import NoneType, UnionType
from typing import Annotated, Any, Literal, NamedTuple, TypeVar, Union, cast, get_args, get_origin, get_type_hints

import numpy as np
import scipy.sparse as sp
from numpy.typing import ArrayLike
from typing_extensions import get_protocol_members, is_protocol

from fe_models.foundation.arrays import SYMMETRY_DEFECT, IntArray, frozen, require_finite
from fe_models.foundation.errors import BodyError, ReportedError
from fe_models.foundation.presentation import shown_in_notebooks
from fe_models.foundation.tall.columns import are_finite
from fe_models.foundation.tall.on_disk import row_slices
from fe_models.foundation.words import nearest, quoted

__all__ = [
    "ArrayShape",
    "FrozenMapping",
    "MismatchError",
    "Takes",
    "at_door",
    "checked_fields",
    "conformed",
    "frozen_copies",
]  # fmt: skip

MOST_KINDS = 3  #: largest number of types that a message names
ORTHONORMAL = 1e-6  #: largest defect of orthonormal axes, which rounding of printed digits may cause

Class = TypeVar("Class", bound=type)
Key = TypeVar("Key")
Item = TypeVar("Item")


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
    """Decorate a frozen data class: copies contain only its fields, no cached values, and arrays are read-only."""

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


# arrays of records ----------------------------------------------------------------------------------------------------


class ArrayShape(NamedTuple):
    """Shape of an array, or length of a tuple, in a field: `Annotated[Array, ArrayShape((3, "n_q"))]`.

    Parameters
    ----------
    axes
        Length of each axis. A name stands for the same length in all fields of a record; None: any length.
    is_symmetric
        Whether matrices over the modes, the last two axes, are symmetric; an antisymmetric part within rounding is
        removed.
    is_triad
        Whether the columns of the matrix are orthonormal right-handed axes.
    has_nan
        Whether NaN stands for numbers that do not exist.
    """

    axes: tuple[int | str | None, ...]
    is_symmetric: bool = False
    is_triad: bool = False
    has_nan: bool = False


@cache
def shapes_of(kind: Hashable) -> dict[str, tuple[ArrayShape, Any]]:
    """Return the declared shapes of the fields of a data class, each with the type of the array."""
    annotated = {name: get_args(hint) for name, hint in hints_of(kind).items() if get_origin(hint) is Annotated}
    return {name: (extra, held) for name, (held, extra, *_) in annotated.items() if isinstance(extra, ArrayShape)}


def put_arrays(record: object, where: str, error: type[Exception]) -> None:
    """Make the fields of a frozen record that declare an `ArrayShape` read-only arrays, or tuples; refuse other shapes.

    A large array on disk is read in slices of rows. Distributed `Columns` are not moved.

    Parameters
    ----------
    record
        The record, in its `__post_init__`.
    where
        Description of the record, for messages.
    error
        Raised if an array has another shape, contains a NaN or an infinity, or is not symmetric or orthonormal.
    """
    lengths: dict[int | str | None, int] = {}  # of the axes that have names
    for name, (shape, held) in shapes_of(cast(Hashable, type(record))).items():
        if (value := getattr(record, name)) is None:
            continue
        what = f"{where}: {name}"
        array: Any
        if get_origin(held) is tuple:
            array = tuple(value)
        elif hasattr(value, "on_rows"):
            array = value  # `Columns`
        else:
            array = frozen(value, np.int64 if IntArray in (held, *get_args(held)) else np.float64)
        got = (len(array),) if isinstance(array, tuple) else array.shape
        expected = tuple(lengths.get(axis, axis or "any") for axis in shape.axes)
        if len(got) != len(expected) or any(isinstance(n, int) and n != m for n, m in zip(expected, got, strict=True)):
            words = str(expected).replace("'", "")
            raise error(f"{what}: expected shape {words}, got {got}")
        lengths |= {axis: n for axis, n in zip(shape.axes, got, strict=True) if isinstance(axis, str)}
        if isinstance(array, np.ndarray) and not shape.has_nan:
            for rows in row_slices(len(array), array):
                require_finite(what, array[rows], error)
        elif not isinstance(array, tuple | np.ndarray) and not are_finite(array):
            raise error(f"{what}: expected finite numbers, got NaN or infinite ones")
        if shape.is_symmetric:
            other = np.swapaxes(array, -1, -2)
            defect, scale = np.abs(array - other).max(initial=0.0), np.abs(array).max(initial=0.0)
            if defect > SYMMETRY_DEFECT * scale:
                raise error(
                    f"{what}: expected symmetric matrices over the modes, got |K - K.T| = {defect / scale:.2e} |K|; "
                    "check that all are projected on both sides by the same modes"
                )
            array = frozen((array + other) / 2)
        if shape.is_triad:
            defect = np.abs(array.T @ array - np.eye(3)).max()
            if not defect <= ORTHONORMAL:
                raise error(f"{what}: expected orthonormal axes as columns, got |AᵀA - I| = {defect:.1e}")
            if np.linalg.det(array) < 0:
                raise error(f"{what}: expected right-handed axes as columns")
        object.__setattr__(record, name, array)


# checked inputs -------------------------------------------------------------------------------------------------------


class Takes(NamedTuple):
    """Description of the values that a field or argument accepts, if the type alone is not enough."""

    hint: Any


class MismatchError(Exception):
    """A value is not of the annotated kind; arguments: description of the expected kind, and the value or list item."""


def conformed(hint: Any, value: Any) -> Any:
    """Convert a value as its annotation requires: a name becomes an object, one object becomes a sequence of one.

    Shapes and ranges of numbers are not checked here.

    Parameters
    ----------
    hint
        Resolved annotation.
    value
        Value given by the user.

    Raises
    ------
    MismatchError
        If the value is of another kind.
    """
    if isinstance(hint, TypeVar):
        return _first_conformed(hint.__constraints__ or (hint.__bound__ or Any,), value)
    kind = get_origin(hint) or hint
    if kind is Annotated:
        held, *extras = get_args(hint)
        return conformed(next((extra.hint for extra in extras if isinstance(extra, Takes)), held), value)
    if kind in (Union, UnionType):
        hints = get_args(hint)
        if ARRAY_LIKE <= set(hints):  # one alternative for all of `ArrayLike`: anything that NumPy converts to an array
            hints = np.ndarray, *(hint for hint in hints if hint not in ARRAY_LIKE)
        return _first_conformed(hints, value)
    if kind is Literal:
        if not any(isinstance(value, type(choice)) and value == choice for choice in get_args(hint)):
            raise MismatchError(f"one of {', '.join(map(str, get_args(hint)))}", value)
        return value
    if kind is Any or not isinstance(kind, type):  # the annotation cannot be checked at run time
        return value
    if issubclass(kind, Iterable) and not issubclass(kind, str | bytes | Mapping | np.ndarray) and get_args(hint):
        is_row = kind is tuple and Ellipsis not in get_args(hint)  # a tuple with an annotation for each item
        return value if is_row and hasattr(value, "__len__") else _sequence(kind, get_args(hint)[0], value)
    return _of_class(kind, value)


def _first_conformed(hints: Sequence[Any], value: Any) -> Any:
    """Return the value for the first annotation that accepts it unchanged, else for the first that converts it."""
    found, expected = [], []
    for hint in hints:
        try:
            found.append(conformed(hint, value))
        except MismatchError as mismatch:
            expected.append(mismatch.args)
        else:
            if found[-1] is value:
                return value
    if found:
        return found[0]
    kinds = list(dict.fromkeys(words for words, _ in expected if words != KINDS[NoneType]))
    if len(kinds) > MOST_KINDS + 1:
        kinds[MOST_KINDS:] = [f"one of {len(kinds) - MOST_KINDS} other kinds"]
    raise MismatchError(" or ".join(kinds), expected[0][1])


def _sequence(kind: type, item: Any, value: Any) -> Any:
    """Return a sequence of conformed items; one item becomes a sequence of one."""
    is_one = isinstance(value, str) or not isinstance(value, Iterable)
    if not is_one and not isinstance(value, list | tuple):
        return value  # not iterated here, because an iterator can be consumed only once
    given = [value] if is_one else value
    try:
        items = [conformed(item, each) for each in given]
    except MismatchError as mismatch:
        expected, wrong = mismatch.args
        raise MismatchError(f"a list, each of it {expected}", wrong) from None
    is_as_given = all(a is b for a, b in zip(items, given, strict=True)) and not is_one
    return value if is_as_given and (kind is not tuple or isinstance(value, tuple)) else tuple(items)


#: names of kinds in messages, if these differ from the names of their classes
KINDS: dict[Any, str] = {
    str: "text", NoneType: "None", bool: "True or False", type: "a class", Callable: "a function",
    Mapping: "a dictionary", dict: "a dictionary", np.ndarray: "numbers", float: "a number", int: "a number",
    complex: "a number",
}  # fmt: skip
#: attributes that identify possible numbers and arrays; a value needs one of them
OF_NUMBERS, OF_ARRAYS = ("__float__", "__index__", "__complex__"), ("__len__", "__float__", "shape")
ARRAY_LIKE = set(get_args(ArrayLike))


def _of_class(kind: type, value: Any) -> Any:
    """Return an object of a class, also from its name; possible numbers and arrays are returned unchanged."""
    is_text = isinstance(value, str)
    is_array = kind is np.ndarray or kind.__module__.startswith("scipy.sparse")
    if is_text and kind is not str and hasattr(kind, "of_name"):
        return kind.of_name(value)
    if kind in (float, int, complex, bool):
        is_so = not is_text and any(hasattr(value, way) for way in OF_NUMBERS)
    elif is_array:
        is_so = not is_text and any(hasattr(value, way) for way in OF_ARRAYS)
    elif issubclass(kind, Mapping):
        is_so = isinstance(value, Mapping)
    elif is_protocol(kind):
        is_so = not isinstance(value, type) and all(hasattr(value, name) for name in get_protocol_members(kind))
    else:
        is_so = isinstance(value, kind)
    if not is_so:
        article = "an" if kind.__name__[0] in "AEIO" else "a"
        raise MismatchError(KINDS.get(kind, f"{article} {kind.__name__}"), value)
    return value


@cache
def hints_of(subject: Hashable) -> dict[str, Any]:
    """Return the resolved annotations of a function or data class."""
    return get_type_hints(subject, include_extras=True)


#: (input, type) of values that each function or data class accepted unchanged; all values of the type are accepted
ACCEPTED: defaultdict[Hashable, set[tuple[str, type]]] = defaultdict(set)


def conformed_inputs(where: str, subject: Hashable, given: Mapping[str, Any], error: type[Exception]) -> Any:
    """Return the inputs of a function or data class that were converted; raise the error for the first wrong kind."""
    changed = {}
    hints, accepted = hints_of(subject), ACCEPTED[subject]
    for name, value in given.items():
        if name not in hints or (name, type(value)) in accepted:
            continue
        try:
            found = conformed(hints[name], value)
        except MismatchError as mismatch:
            expected, wrong = mismatch.args
            got = f"the class {wrong.__name__} itself" if isinstance(wrong, type) else quoted(wrong)
            raise error(f"{where}: {name}: expected {expected}, got {got}") from None
        looks_inside = isinstance(value, type | Iterable) and not isinstance(value, np.ndarray)
        if found is not value:
            changed[name] = found
        elif not looks_inside and "Literal[" not in str(hints[name]):
            accepted.add((name, type(value)))
    return changed


def checked_fields(error: type[Exception], *, misfit: type[Exception] = BodyError) -> Callable[[Class], Class]:
    """Decorate a data class: its fields are checked against their annotations and shapes before its own checks.

    Notebooks show the fields as a table, unless the class is `presented`.

    Parameters
    ----------
    error
        Raised if a field has a wrong kind.
    misfit
        Raised if an array does not have its `ArrayShape`.
    """

    def decorate(kind: Class) -> Class:
        own = getattr(kind, "__post_init__", None)

        def check(self: Any) -> None:
            name = getattr(self, "name", None)
            where = f"{kind.__name__} {name!r}" if isinstance(name, str) else type(self).__name__
            try:
                inputs = conformed_inputs(where, cast(Hashable, type(self)), vars(self), error)
            except error:
                refused_by(own, self)
                raise
            for changed, value in inputs.items():
                object.__setattr__(self, changed, value)
            put_arrays(self, where, misfit)
            if own is not None:
                own(self)

        kind.__post_init__ = check  # type: ignore[attr-defined]
        return kind if hasattr(kind, "_repr_html_") else shown_in_notebooks(kind)

    return decorate


def refused_by(own: Callable[[Any], None] | None, subject: Any) -> None:
    """Run a class's own check, whose message is more specific than that of the annotation."""
    if own is None:
        return
    try:
        own(subject)
    except Exception as failure:
        if isinstance(failure, ReportedError):
            raise  # other errors are ignored: the check was not written for a value of this kind


def name_unknown_fields(kind: type) -> None:
    """Let the constructor of a data class raise `TypeError` with the nearest field for an unknown keyword."""
    own = vars(kind).get("__init__")
    if own is None or hasattr(own, "__wrapped__"):
        return
    names = [each.name for each in fields(kind) if each.init]

    @wraps(own)
    def init(self: Any, *args: Any, **kwargs: Any) -> None:
        try:
            own(self, *args, **kwargs)
        except TypeError:
            unknown = [name for name in kwargs if name not in names]
            if not unknown:
                raise
            raise TypeError(f"{kind.__name__}: no argument {unknown[0]!r}{nearest(unknown[0], names)}") from None

    kind.__init__ = init  # type: ignore[misc]


def at_door(package: str, name: str, found: Any, error: type[Exception]) -> Any:
    """Return a public object of a package; functions are wrapped so that they check arguments by their annotations.

    Data classes answer an unknown keyword as functions do.

    Parameters
    ----------
    package
        Name of the package; the checking function is stored in it.
    name
        Public name.
    found
        Object that the module defines.
    error
        Raised if an argument has a wrong kind; Python's `TypeError` if one is missing or has an unknown name.
    """
    if isinstance(found, type) and is_dataclass(found):
        name_unknown_fields(found)
    if not inspect.isfunction(found):
        return found
    function: Callable[..., Any] = found
    signature = inspect.signature(function)
    kinds = {name: parameter.kind for name, parameter in signature.parameters.items()}
    takes_any_name = inspect.Parameter.VAR_KEYWORD in kinds.values()
    variable = {inspect.Parameter.VAR_POSITIONAL, inspect.Parameter.VAR_KEYWORD}
    single = [name for name, kind in kinds.items() if kind not in variable]

    @wraps(function)
    def checked(*args: Any, **kwargs: Any) -> Any:
        unknown = [name for name in kwargs if name not in single]
        if unknown and not takes_any_name:
            raise TypeError(f"{function.__name__}: no argument {unknown[0]!r}{nearest(unknown[0], single)}")
        try:
            bound = signature.bind(*args, **kwargs)
        except TypeError as reason:
            raise TypeError(f"{function.__name__}: {reason}") from None
        given = {name: bound.arguments[name] for name in single if name in bound.arguments}
        changed = conformed_inputs(function.__name__, function, given, error)
        if changed:
            bound.arguments.update(changed)
            return function(*bound.args, **bound.kwargs)
        return function(*args, **kwargs)

    checked.__module__ = package
    setattr(sys.modules[package], name, checked)
    return checked
