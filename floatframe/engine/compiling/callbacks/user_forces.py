"""Functions of user forces as C functions that the kernels call by their address."""

import ctypes
import time
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from fe_models.foundation.arrays import Array
from floatframe.errors import ModelError
from floatframe.model.forces import UserForce

__all__ = ["Callback", "callback_of", "cost_words", "raise_errors_of"]

C_FUNCTION = ctypes.CFUNCTYPE(None, ctypes.POINTER(ctypes.c_double), ctypes.POINTER(ctypes.c_double))


@dataclass
class Callback:
    """A function with its address; it stores its last error, because an error cannot pass through the kernels."""

    name: str  #: name of the force or element, for messages
    address: int
    keeps: Any  #: objects that must live as long as the address is used
    error: BaseException | None = None
    is_python: bool = False  #: whether each call runs Python code
    n_calls: int = 0  #: number of calls of a Python function since the last `cost_words`
    seconds: float = 0.0  #: time that these calls took [s]


def callback_of(force: UserForce, n_coordinates: int) -> Callback:
    """Return the function of a user force as a C function f(inputs, outputs).

    Raises
    ------
    ModelError
        If a function of numba cannot be compiled for arrays of numbers.
    """
    from numba.core.dispatcher import Dispatcher

    sizes = n_coordinates, len(force.forces), len(force.states)
    if isinstance(force.function, Dispatcher):
        return compiled_callback(force, *sizes)
    return python_callback(force, *sizes)


def compiled_callback(force: UserForce, n: int, n_forces: int, n_states: int) -> Callback:
    """Return a function compiled by numba.njit as a C function."""
    from numba import carray, cfunc, types
    from numba.core.errors import NumbaError

    function = force.function
    assert function is not None  # the caller has checked this
    n_in, n_out = 1 + 2 * n + n_states, n_forces + n_states
    pointer = types.CPointer(types.float64)

    def called(inputs, outputs):
        x = carray(inputs, (n_in,))
        y = carray(outputs, (n_out,))
        y[:] = 0.0
        function(x[0], x[1 : 1 + n], x[1 + n : 1 + 2 * n], x[1 + 2 * n :], y[:n_forces], y[n_forces:])

    try:
        compiled = cfunc(types.void(pointer, pointer))(called)
    except NumbaError as error:
        reason = str(error).strip().splitlines()[0]
        raise ModelError(
            f"force {force.name!r}: its function cannot be compiled as function(t, x, v, z, Q, z_dot) with arrays of "
            f"numbers: {reason}"
        ) from error
    name = f"force {force.name!r}"
    for each in function.overloads.values():  # type: ignore[attr-defined]
        if each.signature.return_type != types.none:
            raise returned_value_error(name, str(each.signature.return_type))
    return Callback(name, int(compiled.address or 0), compiled)


class ReturnedValueError(ModelError):
    """The function of a user force returns a value, which would have no effect."""


def returned_value_error(name: str, kind: str) -> ReturnedValueError:
    """Return the error for a force whose function returns a value of the given kind."""
    return ReturnedValueError(
        f"{name}: its function(t, x, v, z, Q, z_dot) returns a value ({kind}), which has no effect; expected that it "
        "writes into Q and z_dot, such as Q[0] = ..., and returns nothing"
    )


def python_callback(force: UserForce, n: int, n_forces: int, n_states: int) -> Callback:
    """Return a Python function as a C function; after an error it returns NaN."""
    function = force.function
    assert function is not None  # the caller has checked this
    n_in, n_out = 1 + 2 * n + n_states, n_forces + n_states
    callback = Callback(f"force {force.name!r}", 0, None, is_python=True)

    def called(inputs: Any, outputs: Any) -> None:
        began = time.perf_counter()
        x = np.ctypeslib.as_array(inputs, (n_in,)).copy()
        y: Array = np.zeros(n_out)
        try:
            if callback.error is not None:
                y[:] = np.nan
            else:
                parts = x[1 : 1 + n], x[1 + n : 1 + 2 * n], x[1 + 2 * n :], y[:n_forces], y[n_forces:]
                if (returned := function(x[0], *parts)) is not None:
                    raise returned_value_error(callback.name, type(returned).__name__)
        except BaseException as error:  # the error is raised again after the kernels have returned
            callback.error = error
            y[:] = np.nan
        np.ctypeslib.as_array(outputs, (n_out,))[:] = y
        callback.n_calls += 1
        callback.seconds += time.perf_counter() - began

    kept = C_FUNCTION(called)
    callback.address = ctypes.cast(kept, ctypes.c_void_p).value or 0
    callback.keeps = kept
    return callback


def cost_words(callback: Callback) -> str:
    """Describe whether a function is compiled or how long its calls took; the counters restart from zero."""
    if not callback.is_python:
        return f"{callback.name}: its function is compiled"
    n, seconds = callback.n_calls, callback.seconds
    callback.n_calls, callback.seconds = 0, 0.0
    each = 1e6 * seconds / max(n, 1)
    return (
        f"{callback.name}: its Python function was called {n} times, {each:.3g} µs each, {seconds:.3g} s in all; "
        "compile it by numba.njit to make this time negligible"
    )


def raise_errors_of(callbacks: Sequence[Callback]) -> None:
    """Raise the error that a user's function has raised inside the kernels."""
    for callback in callbacks:
        error, callback.error = callback.error, None
        if error is None:
            continue
        if isinstance(error, ReturnedValueError) or not isinstance(error, Exception):  # such as KeyboardInterrupt
            raise error
        raise ModelError(f"{callback.name}: its function raised {type(error).__name__}: {error}") from error
