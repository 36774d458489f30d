"""Laws of elements, compiled by the lean compiler: the functions of users, and the functions that these call.

A law and the functions that it calls are decorated by `njit` or `register_jitable`. Here each of their Python functions
is compiled again as an inner function of the lean compiler (kernels/compiler/lean.py). Because its meaning must not
change, there are two differences from kernels: indices may count from the end (`SafeBlock`), and errors pass through
calls. Division by zero gives infinite numbers or NaN, as in NumPy.

A function that creates arrays is compiled by the passes of numba, with reference counts, but is also linked into the
law and optimised once together with it. Everything else that the lean compiler does not support raises an error, and
the caller compiles the whole law by plain numba.
"""

from types import CellType, FunctionType
from typing import Any

from numba import types
from numba.core.dispatcher import Dispatcher
from numba.core.registry import cpu_target
from numba.extending import intrinsic

from fe_models.foundation.kernels.sources import names_of
from floatframe.engine.kernels.compiler.block import SafeBlock, make_block, parts_of
from floatframe.engine.kernels.compiler.lean import LawEntryCompiler, NotLeanError, of_law

__all__ = ["LawEntryCompiler", "block_at", "lean_law", "new_vector"]

#: options of `njit` and `register_jitable` that do not change results
SAME = {"nopython", "nogil", "boundscheck", "error_model", "cache", "no_cpython_wrapper"}

#: id(function) -> (function, its inner function). The function is stored so that its id is not reused; the inner
#: function is None while it is being compiled
made: dict[int, tuple[Any, Any]] = {}


def lean_law(function: Any) -> Any:
    """Return the inner function that computes the same as a numba function.

    Raises
    ------
    NotLeanError
        If the function calls itself, or has options that change its results.
    """
    if id(function) not in made:
        made[id(function)] = function, None
        try:
            made[id(function)] = function, inner_function(function)
        except NotLeanError:
            del made[id(function)]
            raise
    _, inner = made[id(function)]
    if inner is None:
        raise NotLeanError(f"{function.__name__} calls itself")
    return inner


def inner_function(function: Any) -> Any:
    """Return an inner function with the code of a numba function; the functions that it calls become inner ones too."""
    plain = function
    if isinstance(function, Dispatcher):
        plain = function.py_func
        options = sorted({name for name, value in function.targetoptions.items() if value} - SAME)
        if options:
            raise NotLeanError(f"{plain.__name__} has the options {', '.join(options)}")
    used = names_of(plain.__code__)
    names = {name: replaced(value) if name in used else value for name, value in plain.__globals__.items()}
    closure = tuple(CellType(replaced(cell.cell_contents)) for cell in plain.__closure__ or ())
    same = FunctionType(plain.__code__, names, plain.__name__, plain.__defaults__, closure)
    same.__qualname__, same.__module__, same.__kwdefaults__ = plain.__qualname__, plain.__module__, plain.__kwdefaults__
    return of_law(same)


def replaced(value: Any) -> Any:
    """Return the inner function that replaces a numba function; other values are unchanged."""
    is_function = isinstance(value, Dispatcher) or (isinstance(value, FunctionType) and is_jitable(value))
    return lean_law(value) if is_function else value


def is_jitable(function: FunctionType) -> bool:
    """Whether a function was decorated by `register_jitable` without options that change its results."""
    context = cpu_target.typing_context
    context.refresh()
    for template in getattr(context._lookup_global(function), "templates", ()):
        overload = getattr(template, "_overload_func", None)
        cells = getattr(overload, "__closure__", None) or ()
        if any(cell.cell_contents is function for cell in cells):
            return template._jit_options.keys() <= SAME and template._inline.is_never_inline
    return False


@intrinsic
def block_at(typing_context, pointer, shape):
    """Return the array of a given shape at an address, as `carray` does."""
    block = SafeBlock(pointer.dtype, len(shape) if isinstance(shape, types.BaseTuple) else 1)

    def generate(context, builder, signature, arguments):
        kinds, sizes = parts_of(builder, signature.args[1], arguments[1])
        sizes = [context.cast(builder, n, kind, types.intp) for n, kind in zip(sizes, kinds, strict=True)]
        return make_block(context, builder, block, arguments[0], sizes)

    return block(pointer, shape), generate


@intrinsic
def new_vector(typing_context, kind, n):
    """Return a vector on the stack, which exists until the function returns."""
    block = SafeBlock(kind.dtype, 1)

    def generate(context, builder, signature, arguments):
        size = context.cast(builder, arguments[1], signature.args[1], types.intp)
        return make_block(context, builder, block, builder.alloca(context.get_data_type(block.dtype), size), [size])

    return block(kind, n), generate
