"""The functions of elements as C functions that the kernels call by their address.

A numba function is compiled as a C function once for all elements that share it, whatever their numbers of markers and
states. If the lean compiler does not support what the function does, plain numba compiles it, and the log says so. The
machine code is stored beside the package, under a key that changes with all objects to which the function refers
(`law_source`). If one of these has no key, the function is compiled again in each process.
"""

import ctypes
import logging
from collections.abc import Callable
from types import FunctionType
from typing import Any

import numpy as np

from fe_models.foundation.arrays import Array
from floatframe.engine.compiling.callbacks.law_source import digest_of
from floatframe.engine.compiling.callbacks.user_forces import Callback
from floatframe.engine.kernels.compiler.choice import is_lean, level
from floatframe.engine.kernels.compiler.garbage import without_garbage_collection
from floatframe.errors import ModelError
from floatframe.model.elements.element import ElementLaw

__all__ = ["called_law", "law_callbacks"]

log = logging.getLogger(__name__)

WHOLE, REAL = ctypes.POINTER(ctypes.c_int64), ctypes.POINTER(ctypes.c_double)
C_FUNCTION = ctypes.CFUNCTYPE(None, WHOLE, REAL, REAL, REAL)
SIGNATURES = {
    "function": "function(t, x, z, lam, data, wrench, z_dot, g, outputs)",
    "tangent": "tangent(t, x, z, lam, data, slopes)",
}

#: C functions compiled by numba, by the identity of the user's function and by template; the cache keeps both alive
compiled: dict[tuple[int, str], tuple[Any, Any]] = {}


def law_callbacks(where: str, law: ElementLaw, head: tuple[int, ...]) -> tuple[Callback, Callback]:
    """Return two C functions of an element: one for the values of its law, one for the derivatives.

    Raises
    ------
    ModelError
        If a function of numba cannot be compiled for arrays of numbers.
    """
    value = callback(where, law.function, "value", head)
    if callable(law.tangent):
        return value, callback(where, law.tangent, "given", head)
    if is_compiled(law.function):
        return value, callback(where, law.function, law.tangent, head)
    return value, callback(where, law.function, "difference" if law.tangent == "differences" else law.tangent, head)


def is_compiled(function: Callable[..., None]) -> bool:
    """Return whether a function is a compiled function of numba."""
    from numba.core.dispatcher import Dispatcher

    return isinstance(function, Dispatcher)


def callback(where: str, function: Callable[..., None], kind: str, head: tuple[int, ...]) -> Callback:
    """Return a user's function for an element as a C function, made from the template of this kind."""
    from floatframe.engine.compiling.callbacks import law_templates

    templates = {
        "value": law_templates.value_template,
        "given": law_templates.given_template,
        "complex": law_templates.complex_template,
        "differences": law_templates.difference_template,
        "difference": law_templates.difference_template,
    }
    if is_compiled(function):
        return compiled_callback(where, function, kind, templates[kind])
    return python_callback(where, function, kind, templates[kind], head)


def compiled_callback(where: str, function: Any, kind: str, template: Callable[[int], FunctionType]) -> Callback:
    """Return a function compiled by numba as a C function."""
    from numba.core.errors import NumbaError

    key = id(function), template.__name__
    if key not in compiled:
        digest = digest_of(function)
        if digest is not None:
            digest ^= level  # the level of optimisation, which the machine code depends on too
        whole = lean_c_function(where, function, template, digest) if is_lean else None
        try:
            whole = whole or c_function(filled(template, function, digest or 1), digest is not None)
        except (NumbaError, NotImplementedError) as error:
            name = "tangent" if kind == "given" else "function"
            what = "with complex numbers, " if kind == "complex" else ""
            raise ModelError(
                f"{where}: its {name} cannot be compiled {what}as {SIGNATURES[name]} with arrays of numbers: "
                f"{reason_of(error)}"
            ) from error
        compiled[key] = whole, function
    whole, _ = compiled[key]
    return Callback(where, int(whole.address or 0), whole)


def reason_of(error: Exception) -> str:
    """Return the line of a numba error message that states the cause."""
    lines = str(error).strip().splitlines() or [type(error).__name__]
    return next((line for line in lines if line and not line.startswith(("Failed in", "-"))), lines[0])


def lean_c_function(
    where: str, function: Any, template: Callable[[int], FunctionType], digest: int | None
) -> Any | None:  # fmt: skip
    """Return a numba function compiled by the lean compiler as a C function; None if it cannot compile the function."""
    from floatframe.engine.kernels.compiler import law
    from floatframe.engine.kernels.compiler.stored import compiler_key

    try:
        names = {"law": law.lean_law(function), "carray": law.block_at, "new_vector": law.new_vector}
        made = filled(template, function, (digest or 1) ^ int(compiler_key()[:14], 16))
        made.__globals__.update(names)
        return c_function(made, digest is not None, pipeline_class=law.LawEntryCompiler)
    except Exception as error:  # of any kind, as some passes of numba are skipped; plain numba reports the real error
        log.info("%s: %s is compiled by plain numba: %s", where, function.__name__, reason_of(error))
        return None


def c_function(made: FunctionType, is_stored: bool, **options: Any) -> Any:
    """Return a Python function compiled as a C function of pointers; it is stored on disk if `is_stored`."""
    from numba import cfunc, types

    number = types.CPointer(types.float64)
    signature = types.void(types.CPointer(types.int64), number, number, number)
    with without_garbage_collection():
        try:
            return cfunc(signature, cache=is_stored, error_model="numpy", **options)(made)
        except RuntimeError:  # no folder for the cache
            return cfunc(signature, error_model="numpy", **options)(made)


def filled(template: Callable[[int], FunctionType], function: Any, digest: int) -> FunctionType:
    """Return the function of a template in which the user's function replaces `law`.

    Its name contains the digest, so that each law has its own index in the cache. With a common index, two processes
    that add different laws at the same moment would write the same file, and one law would get the code of the other.
    """
    made = template(digest)
    names = made.__globals__ | {"law": function}
    named = FunctionType(made.__code__, names, made.__name__, made.__defaults__, made.__closure__)
    named.__qualname__ = f"{made.__name__}_{digest:x}"
    return named


def array_at(pointer: Any, shape: Any) -> Array:
    """Return the array at an address, as `numba.carray` does."""
    return np.ctypeslib.as_array(pointer, shape if isinstance(shape, tuple) else (int(shape),))


def python_callback(
    where: str, function: Any, kind: str, template: Callable[[int], FunctionType], head: tuple[int, ...]
) -> Callback:
    """Return a Python function as a C function; after an error it returns NaN."""
    n, width, n_z, n_lam, n_seen, _, _, _ = head
    n_out = 6 * n + n_z + n_lam
    size = n_out + n_seen if kind == "value" else n_out * ((width - 6) * n + n_z + n_lam)
    made = filled(template, function, 1)
    made.__globals__["carray"] = array_at
    kept_callback = Callback(where, 0, None)

    def called(head_at: Any, inputs_at: Any, data_at: Any, outputs_at: Any) -> None:
        try:
            if kept_callback.error is None:
                made(head_at, inputs_at, data_at, outputs_at)
        except BaseException as error:  # the error is raised again after the kernels have returned
            kept_callback.error = error
        if kept_callback.error is not None:
            np.ctypeslib.as_array(outputs_at, (size,))[:] = np.nan

    kept = C_FUNCTION(called)
    kept_callback.address = ctypes.cast(kept, ctypes.c_void_p).value or 0
    kept_callback.keeps = kept
    return kept_callback


def called_law(address: int, head: tuple[int, ...], data: Array, inputs: Array, n_out: int) -> Array:
    """Return the outputs of an element's function, (n_t, n_out), for inputs, (n_t, 1 + n 18 + n_z + n_lam)."""
    function = C_FUNCTION(address)
    numbers = np.ascontiguousarray(data, dtype=float)
    sizes = np.array(head, dtype=np.int64)
    rows = np.ascontiguousarray(inputs, dtype=float)
    outputs = np.zeros((len(rows), n_out))
    for row, output in zip(rows, outputs, strict=True):
        pointers = (each.ctypes.data_as(REAL) for each in (row, numbers, output))
        function(sizes.ctypes.data_as(WHOLE), *pointers)
    return outputs
