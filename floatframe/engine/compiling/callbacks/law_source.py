"""A key of a compiled function that changes with all code, constants and functions that it refers to."""

import hashlib
from pathlib import Path
from types import BuiltinFunctionType, CodeType, FunctionType, ModuleType
from typing import Any

import numpy as np

from fe_models.foundation.kernels.sources import names_of

__all__ = ["digest_of"]


class NoKeyError(Exception):
    """No key can be computed for an object."""


def digest_of(function: Any) -> int | None:
    """Return a positive key of a numba function; None if the function refers to an object without a key."""
    digest = hashlib.sha256()
    try:
        add_value(digest, function, {})
    except NoKeyError:
        return None
    return int.from_bytes(digest.digest()[:7], "big") + 1


def add_value(digest: Any, value: Any, seen: dict[int, bool]) -> None:
    """Add to the key the object that a name refers to; `seen` maps each visited function to whether it is complete."""
    if seen.get(id(value)) is False:
        raise NoKeyError  # the function calls itself: numba cannot use such code from disk
    if id(value) in seen:
        return
    if isinstance(getattr(value, "py_func", None), FunctionType):  # of numba
        digest.update(repr(sorted(getattr(value, "targetoptions", {}).items(), key=str)).encode())
        seen[id(value)] = False
        add_function(digest, value.py_func, seen)
        seen[id(value)] = True
    elif isinstance(value, FunctionType):  # its module overloads it for numba, or registers it by name
        seen[id(value)] = False
        add_function(digest, value, seen)
        seen[id(value)] = True
        file = Path(value.__code__.co_filename)
        if file.is_file():
            digest.update(file.read_bytes())
    elif isinstance(value, np.ndarray):
        digest.update(repr((value.dtype, value.shape)).encode() + np.ascontiguousarray(value).tobytes())
    elif isinstance(value, bool | int | float | complex | str | bytes | type(None) | np.generic):
        digest.update(repr((type(value).__name__, value)).encode())
    elif isinstance(value, tuple):
        digest.update(str(len(value)).encode())
        for each in value:
            add_value(digest, each, seen)
    elif isinstance(value, BuiltinFunctionType | type | np.ufunc):
        digest.update(f"{getattr(value, '__module__', '')}.{value.__name__}".encode())
    else:
        raise NoKeyError


def add_function(digest: Any, function: FunctionType, seen: dict[int, bool]) -> None:
    """Add to the key the code of a function, the name of its module and all objects that it names."""
    digest.update(str(function.__module__).encode())
    add_code(digest, function.__code__)
    for cell in function.__closure__ or ():
        add_value(digest, cell.cell_contents, seen)
    digest.update(repr(function.__defaults__).encode())
    for name in names_of(function.__code__):
        value = function.__globals__.get(name)
        if isinstance(value, ModuleType):
            add_members(digest, value, names_of(function.__code__), seen)
        elif name in function.__globals__:
            digest.update(name.encode())
            add_value(digest, value, seen)


def add_members(digest: Any, module: ModuleType, names: list[str], seen: dict[int, bool]) -> None:
    """Add to the key the parts of a module that a function may use."""
    digest.update(f"{module.__name__} {getattr(module, '__version__', '')}".encode())
    if module.__name__.split(".")[0] in ("math", "cmath", "numpy", "numba"):
        return
    for name in names:
        if name in vars(module):
            digest.update(name.encode())
            add_value(digest, vars(module)[name], seen)


def add_code(digest: Any, code: CodeType) -> None:
    """Add to the key the code of a function, without its line numbers."""
    digest.update(code.co_code + repr((code.co_names, code.co_varnames, code.co_argcount)).encode())
    for each in code.co_consts:
        if isinstance(each, CodeType):
            add_code(digest, each)
        else:
            digest.update(repr(each).encode())
