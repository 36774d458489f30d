"""Intermediate code of inner functions on disk; after an edit, only that function and its callers are compiled.

The key of a function is a digest of everything on which its code depends: its byte code and constants, the values of
the names that it uses, the same for the functions that it calls, the types of its arguments, the modules of the
compiler, and the versions of numba and Python. If this module does not know the kind of a value, there is no key, and
the function and its callers are compiled in each process.

The file of a key contains the type of the result, the keys of the called functions, and the code. Files that were not
read for a month are deleted.
"""

import builtins
import contextlib
import hashlib
import os
import pickle
import sys
import time
from dataclasses import dataclass
from enum import Enum
from functools import cache
from pathlib import Path
from types import BuiltinFunctionType, CodeType, FunctionType, ModuleType
from weakref import WeakKeyDictionary

import llvmlite
import numba
import numpy as np
from numba import types
from numba.core.dispatcher import Dispatcher
from numba.extending import _Intrinsic

from fe_models.foundation.kernels.sources import PACKAGES

__all__ = ["StoredCode", "code_key", "compiler_key", "delete_old", "read_code", "write_code"]

#: folder beside numba's own cache, in NUMBA_CACHE_DIR if that is set
FOLDER = Path(os.environ.get("NUMBA_CACHE_DIR") or Path(__file__).parents[3] / "__pycache__") / "inner"
MONTH = 30 * 24 * 3600.0  # seconds

keys: WeakKeyDictionary[FunctionType, str | None] = WeakKeyDictionary()  # digests without types of arguments


class UnknownKindError(Exception):
    """A value whose kind has no key."""


@dataclass(frozen=True)
class StoredCode:
    """The stored result of compiling an inner function."""

    result: types.Type
    called: tuple[str, ...]  #: keys of the inner functions that it calls
    bitcode: bytes  #: LLVM bitcode of the function


@cache
def compiler_key() -> str:
    """Return the digest of the compiler's modules and of the versions of Python, NumPy, numba and llvmlite."""
    folder = Path(__file__).parent
    sources = [path.read_bytes() for path in (*sorted(folder.glob("*.py")), folder.parent / "records.py")]
    versions = numba.__version__, llvmlite.__version__, np.__version__, sys.version
    return digest(repr((versions, sources)))


def digest(words: str) -> str:
    """Return a short digest of a text."""
    return hashlib.sha256(words.encode()).hexdigest()[:32]


def code_key(function: FunctionType, arguments: tuple, options: str) -> str | None:
    """Return the key of a function for its argument types and compiler options; None if it has none."""
    try:
        words = function_words(function), [type_words(each) for each in arguments], options
    except UnknownKindError:
        return None
    return digest(repr((compiler_key(), words)))


def function_words(function: FunctionType) -> str:
    """Return the digest of a Python function and of everything that it uses."""
    if function not in keys:
        keys[function] = None  # seen again only if the function calls itself, which gives no key
        with contextlib.suppress(UnknownKindError):
            names = function.__code__.co_freevars
            cells = dict(zip(names, [cell.cell_contents for cell in function.__closure__ or ()], strict=True))
            words = code_words(function.__code__, function.__globals__ | cells)
            keys[function] = digest(repr((function.__module__, function.__qualname__, words, default_words(function))))
    if (key := keys[function]) is None:
        raise UnknownKindError
    return key


def default_words(function: FunctionType) -> list:
    """Return a description of the default values of the parameters of a function."""
    return [value_words(each) for each in (function.__defaults__, tuple((function.__kwdefaults__ or {}).items()))]


def code_words(code: CodeType, known: dict) -> tuple:
    """Return a description of byte code and of the values of all names in it."""
    modules = [value for name in code.co_names if isinstance(value := known.get(name), ModuleType)]
    values: list[tuple] = []
    for name in code.co_names:
        if name in known:
            values.append((name, value_words(known[name])))
        elif hasattr(builtins, name):
            values.append((name, "built in"))
        for module in modules:  # `rotation.cross` has both names
            if is_ours(module.__name__) and hasattr(module, name):
                values.append((module.__name__, name, value_words(getattr(module, name))))
    for name in code.co_freevars:
        if name in known:  # otherwise the name belongs to the enclosing function
            values.append((name, value_words(known[name])))
    constants = [
        code_words(each, known) if isinstance(each, CodeType) else value_words(each) for each in code.co_consts
    ]
    return code.co_code, code.co_exceptiontable, code.co_names, code.co_varnames, code.co_argcount, values, constants


def is_ours(module: str | None) -> bool:
    """Whether a module belongs to this project, or is unknown."""
    return module is None or module.partition(".")[0] in (*PACKAGES, "tests", "__main__")


def value_words(value) -> object:
    """Return a description that is equal only for equal values; `UnknownKindError` for an unknown kind of value."""
    if value is None or isinstance(value, PLAIN):
        return type(value).__qualname__, repr(value)
    if isinstance(value, Enum):
        return type(value).__qualname__, value.name, value_words(value.value)
    if isinstance(value, tuple | frozenset):
        parts = sorted(value, key=repr) if isinstance(value, frozenset) else value
        return type(value).__qualname__, getattr(value, "_fields", ()), [value_words(each) for each in parts]
    if isinstance(value, Dispatcher):
        pipeline = value._compiler.pipeline_class  # type: ignore[attr-defined]
        return function_words(value.py_func), pipeline.__qualname__, repr(value.targetoptions)
    if isinstance(value, _Intrinsic):
        return "intrinsic", function_words(value._defn)
    if isinstance(value, types.Type):
        return type_words(value)
    if isinstance(value, ModuleType):
        return "module", value.__name__  # names of this project's modules are looked up where they are used
    if isinstance(value, FunctionType) and is_ours(value.__module__):
        return "function", function_words(value)
    if isinstance(value, type) and is_ours(value.__module__):
        return record_words(value)
    module = str(getattr(value, "__module__", "")).partition(".")[0]
    if isinstance(value, type | FunctionType | BuiltinFunctionType | np.ufunc) and module in FOREIGN:
        return "foreign", str(getattr(value, "__module__", "")), getattr(value, "__qualname__", value.__name__)
    raise UnknownKindError


#: modules whose code changes only with the versions of Python, NumPy and numba
FOREIGN = ("builtins", "cmath", "math", "numba", "numpy", "operator", "_operator", "None")
PLAIN = (bool, int, float, complex, str, bytes, type(Ellipsis))


def record_words(kind: type) -> object:
    """Return a description of a class of records."""
    if not issubclass(kind, tuple) or not hasattr(kind, "_fields"):
        raise UnknownKindError
    return "record", kind.__module__, kind.__qualname__, kind._fields


def type_words(kind: types.Type) -> object:
    """Return a description that is equal only for equal types; `UnknownKindError` for an unknown kind of type."""
    if isinstance(fields := getattr(kind, "fields", None), dict):  # a record of arrays
        return str(kind), [(name, type_words(each), place) for name, (each, place) in fields.items()]
    if isinstance(kind, types.BaseTuple):
        of = record_words(kind.instance_class) if hasattr(kind, "instance_class") else ()
        return type(kind).__qualname__, of, [type_words(each) for each in kind.types]  # type: ignore[attr-defined]
    if isinstance(kind, types.Dispatcher):
        return value_words(kind.dispatcher)
    if isinstance(kind, types.Number | types.Boolean | types.NoneType | types.Array | types.SliceType | types.Omitted):
        return type(kind).__qualname__, str(kind)
    raise UnknownKindError


def read_code(key: str) -> StoredCode | None:
    """Return the stored code with a key, or None."""
    path = FOLDER / key
    try:
        code = pickle.loads(path.read_bytes())
        os.utime(path)
    except Exception:  # there is no file, or it is incomplete
        return None
    return code


def write_code(key: str, code: StoredCode) -> None:
    """Write code to disk completely or not at all."""
    part = FOLDER / f"{key}.{os.getpid()}"
    with contextlib.suppress(OSError, pickle.PicklingError):
        FOLDER.mkdir(parents=True, exist_ok=True)
        part.write_bytes(pickle.dumps(code))
        part.replace(FOLDER / key)


def delete_old(age: float = MONTH) -> None:
    """Delete the files that have not been read or written for `age` seconds."""
    oldest = time.time() - age
    with contextlib.suppress(OSError):
        for path in FOLDER.iterdir():
            if path.stat().st_mtime < oldest:
                path.unlink()
