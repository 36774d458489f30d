"""The decorator of compiled functions (kernels), and where their machine code comes from.

Code for the types of the arguments of a call is looked for

(1) in numba's cache, where it was compiled on this machine for exactly its processor;
(2) among the files that came with the package (`FOLDER`), compiled for a family of processors, the best family first;
(3) otherwise it is compiled, and stored in the cache.

The keys of (1) and (2) change with the compiler and with the sources of the function's module and of all modules of the
project that it imports, so that old code never runs after an edit. A file of (2) also requires the versions of Python,
numba, llvmlite and NumPy that compiled it, and a processor with all instructions of its family. A checkout has no such
files; `.ci/wheel` makes them. Import this module only where numba may be imported.
"""

import contextlib
import hashlib
import logging
import pickle
import sys
from collections.abc import Callable
from functools import cache
from pathlib import Path
from typing import Any

import llvmlite
import numba
import numpy as np
from numba import njit
from numba.core import config
from numba.core.caching import FunctionCache, NullCache
from numba.core.compiler import CompileResult
from numba.core.dispatcher import Dispatcher
from numba.core.serialize import dumps

from fe_models.foundation.kernels.sources import ROOT, digests

__all__ = ["FAMILIES", "jit", "jit_with", "stored"]

log = logging.getLogger(__name__)

FOLDER = ROOT / "fe_models" / "compiled"  #: folder of the files that came with the package, with one folder per family

V3 = {"avx", "avx2", "bmi", "bmi2", "cx16", "f16c", "fma", "lzcnt", "movbe", "popcnt", "sahf", "sse4.2", "xsave"}
#: families of processors and the instructions that they need, in LLVM's names; the best family first
FAMILIES = {"x86-64-v4": V3 | {"avx512bw", "avx512cd", "avx512dq", "avx512f", "avx512vl"}, "x86-64-v3": V3}

DIGEST = 32  #: bytes of the SHA-256 at the beginning of a file
VERSIONS = (
    sys.implementation.cache_tag, numba.__version__, llvmlite.__version__, np.__version__.split(".")[:2],
)  # fmt: skip
#: numba's settings that change the code of a source
SETTINGS = tuple(getattr(config, name) for name in ("OPT", "BOUNDSCHECK", "DEBUGINFO_DEFAULT"))

came_with_package: list[str] = []  #: names of the functions whose code this process took from the package
write_into: Path | None = None  #: folder into which all compiled code is written as files of (2)

keys_of_module = cache(digests)


def jit_with(**options: Any) -> Callable[[Callable], Any]:
    """Return the decorator of kernels with options of numba; the code is stored, see the docstring of the module."""
    compiled: Any = njit(**{"nogil": True, "error_model": "numpy"} | options)  # type: ignore[call-overload]
    return lambda function: stored(compiled(function))


def stored(compiled: Any) -> Any:
    """Return a function of numba whose code is stored on disk; a function that numba may not compile stays as it is."""
    if isinstance(compiled, Dispatcher):
        compiled._cache = KernelCache(compiled)  # type: ignore[attr-defined]
    return compiled


jit = jit_with()


class OwnCache(FunctionCache):
    """numba's cache (1), whose keys change with the imported sources and with the compiler too."""

    def __init__(self, function: Callable, words: tuple) -> None:
        super().__init__(function)
        self.words = words

    def _index_key(self, sig: Any, codegen: Any) -> tuple:
        return *super()._index_key(sig, codegen), self.words


class KernelCache(NullCache):
    """Stored code of one function: (1), and then (2)."""

    def __init__(self, compiled: Any) -> None:
        function = compiled.py_func
        compiler = compiled._compiler.pipeline_class.__qualname__, SETTINGS
        self.name = f"{function.__module__}.{function.__qualname__}"
        syntax, text = keys_of_module(function.__module__)
        self.own: Any = NullCache()
        with contextlib.suppress(RuntimeError):  # there is no folder for the cache
            self.own = OwnCache(function, (syntax, *compiler))
        self.words = (self.name, text, *compiler, *VERSIONS) if function.__closure__ is None else None

    @property
    def cache_path(self) -> str | None:
        """The folder of numba's cache."""
        return self.own.cache_path

    def load_overload(self, sig: Any, target_context: Any) -> Any:
        """Return the code for a signature, None if it must be compiled."""
        target_context.refresh()
        code = self.own.load_overload(sig, target_context)
        return self.shipped(sig, target_context) if code is None else code

    def shipped(self, sig: Any, target_context: Any) -> Any:
        """Return the code that came with the package for this processor; None if there is none or it is damaged."""
        if self.words is None or write_into is not None:
            return None
        _, _, features = target_context.codegen().magic_tuple()
        known = {each[1:] for each in features.split(",") if each.startswith("+")}
        for family in [name for name, needed in FAMILIES.items() if needed <= known]:
            path = FOLDER / family / self.file_name(sig, target_context.codegen())
            try:
                content = path.read_bytes()
                if hashlib.sha256(content[DIGEST:]).digest() != content[:DIGEST]:
                    raise ValueError("the file is damaged")
                code = CompileResult._rebuild(target_context, *pickle.loads(content[DIGEST:]))
            except FileNotFoundError:
                continue
            except Exception as error:  # of any kind: the code can still be compiled
                log.info("%s: cannot use its code in %s: %s", self.name, path, error)
                continue
            came_with_package.append(self.name)
            return code
        return None

    def file_name(self, sig: Any, codegen: Any) -> str:
        """Return the name of the file for a signature."""
        return hashlib.sha256(repr((self.words, str(sig), codegen.magic_tuple()[0])).encode()).hexdigest()[:DIGEST]

    def save_overload(self, sig: Any, data: Any) -> None:
        """Store compiled code."""
        self.own.save_overload(sig, data)
        if write_into is not None and self.words is not None and not data.library.has_dynamic_globals:
            if config.USING_SVML:  # type: ignore[attr-defined]
                raise RuntimeError("code for other machines may not call Intel's SVML; set NUMBA_DISABLE_INTEL_SVML=1")
            content = dumps(data._reduce())
            _, family, _ = data.codegen.magic_tuple()
            path = write_into / family / self.file_name(sig, data.codegen)
            path.parent.mkdir(parents=True, exist_ok=True)
            path.write_bytes(hashlib.sha256(content).digest() + content)

    def flush(self) -> None:
        """Empty numba's cache of the function."""
        self.own.flush()
