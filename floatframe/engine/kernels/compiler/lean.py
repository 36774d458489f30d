"""The lean compiler: each inner function becomes intermediate code, and an entry optimises all of it once.

By default, numba optimises each function, generates its machine code, and optimises it once more with each caller. It
also looks up the meaning of each operator wherever it occurs, and searches each function for closures, generators,
parallel loops and array expressions. All this is three quarters of the time of a compilation. Inner functions are never
called from Python and own no memory. Therefore

(1) the library of an inner function is neither optimised nor compiled to machine code: its module is parsed once, and
    entries link it unchanged;
(2) the library of an entry links all of them and is optimised once;
(3) while an entry is compiled, the meaning of an operator or built-in function for given types is looked up once, and
    Python's garbage collection is suspended; numba collects no warnings about statements, does not search for `with`
    and dictionaries of arguments, and finds the variables of a statement by the exact types of its parts;
(4) only those passes of numba run that kernels need (no closures, lists, array expressions, `raise`);
(5) variables, operations and calls become lean code of LLVM, see kernels/compiler/lowering.py;
(6) the code of an inner function is stored on disk, see kernels/compiler/stored.py.
"""

import types
from collections.abc import Iterator, Sequence
from contextlib import contextmanager, nullcontext
from typing import Any, ClassVar

from llvmlite.binding import Linkage, parse_assembly, parse_bitcode
from numba import njit
from numba.core import cgutils
from numba.core.bytecode import FunctionIdentity
from numba.core.codegen import JITCodeLibrary
from numba.core.compiler import CompilerBase, DefaultPassBuilder, compile_result
from numba.core.compiler_machinery import FunctionPass, PassManager, register_pass
from numba.core.errors import NumbaError, WarningsFixer  # type: ignore[attr-defined]
from numba.core.funcdesc import FunctionDescriptor
from numba.core.interpreter import Interpreter
from numba.core.ir import Inst, Loc, Var
from numba.core.ir_utils import build_definitions
from numba.core.lowering import Environment
from numba.core.registry import cpu_target
from numba.core.rewrites.static_getitem import RewriteConstGetitems
from numba.core.runtime.nrt import rtsys
from numba.core.ssa import reconstruct_ssa
from numba.core.targetconfig import ConfigStack
from numba.core.typed_passes import (
    IRLegalization,
    NativeLowering,
    NoPythonBackend,
    NopythonTypeInference,
    PreLowerStripPhis,
)
from numba.core.types.functions import BaseFunction
from numba.core.typing import signature
from numba.core.untyped_passes import ExtractByteCode, FixupArgs, IRProcessing, TranslateByteCode

from fe_models.foundation.kernels.jit import stored
from floatframe.engine.kernels.compiler.block import Block, make_block
from floatframe.engine.kernels.compiler.choice import level
from floatframe.engine.kernels.compiler.garbage import without_garbage_collection
from floatframe.engine.kernels.compiler.lowering import KernelContext, KernelLower, LawContext, LawLower
from floatframe.engine.kernels.compiler.stored import StoredCode, code_key, delete_old, read_code, write_code

__all__ = [
    "ENTRY",
    "INNER",
    "LawEntryCompiler",
    "NotLeanError",
    "array_type",
    "array_value",
    "entry",
    "inner",
    "loops",
    "matrix_loops",
    "of_law",
    "pipeline",
    "small",
    "view",
]


# the passes of numba that a kernel goes through: byte code, types, one assignment a variable, code of LLVM ------------
# numba also searches each function for closures, generators, parallel loops, array expressions and calls to inline, and
# analyses the lifetimes of variables after each pass. Kernels have none of these and own nothing that must be freed.


@register_pass(mutates_CFG=False, analysis_only=False)
class ConstantIndices(FunctionPass):
    """Return the types with constant indices of tuples; this is the only numba rewrite that kernels need."""

    _name = "constant_indices"

    def __init__(self):
        super().__init__()

    def run_pass(self, state):
        """Rewrite every block in place."""
        rewrite = RewriteConstGetitems(state)
        for block in state.func_ir.blocks.values():
            if rewrite.match(state.func_ir, block, None, None):
                block.body = rewrite.apply().body
        return True


@register_pass(mutates_CFG=True, analysis_only=False)
class OneAssignment(FunctionPass):
    """Conversion to one assignment per variable, without analysis of lifetimes."""

    _name = "one_assignment"

    def __init__(self):
        super().__init__()

    def run_pass(self, state):
        """Rewrite in place."""
        state.func_ir = reconstruct_ssa(state.func_ir)
        state.func_ir._definitions = build_definitions(state.func_ir.blocks)
        return True


@register_pass(mutates_CFG=False, analysis_only=False)
class NoPhis(PreLowerStripPhis):
    """Replacement of phi nodes by assignments at the ends of blocks, without analysis of lifetimes."""

    _name = "no_phis"

    def run_pass(self, state):
        """Rewrite in place."""
        state.func_ir = self._strip_phi_nodes(state.func_ir)
        state.func_ir._definitions = build_definitions(state.func_ir.blocks)
        return True


@register_pass(mutates_CFG=True, analysis_only=False)
class KernelLowering(NativeLowering):
    """Lowering of an inner function to LLVM code."""

    _name = "kernel_lowering"

    @property
    def lowering_class(self):
        """The class that lowers kernels."""
        return KernelLower


@register_pass(mutates_CFG=True, analysis_only=False)
class LawLowering(NativeLowering):
    """Lowering of a function of a law to LLVM code."""

    _name = "law_lowering"

    @property
    def lowering_class(self):
        """The class that lowers laws."""
        return LawLower


class Passes(PassManager):
    """Compiler passes in order, without analysis of lifetimes after each pass."""

    def _runPass(self, index, pss, internal_state):
        pss.analysis = self._analysis
        pss.run_initialization(internal_state)
        pss.run_pass(internal_state)
        pss.run_finalizer(internal_state)


FRONT = [IRProcessing, ConstantIndices, OneAssignment, NopythonTypeInference, NoPhis]
INNER = [KernelLowering, NoPythonBackend]  #: the last passes for an inner function
ENTRY = [IRLegalization, NativeLowering, NoPythonBackend]  #: the last passes for an entry


def pipeline(state, back):
    """Return the compiler passes that kernels need, ending with the passes in `back`."""
    passes = [*FRONT, *back] if state.func_ir else [TranslateByteCode, FixupArgs, *FRONT, *back]
    manager = Passes("kernel")
    for each in passes:
        manager.add_pass(each, each.name())
    manager.finalize()
    return manager


# lean -----------------------------------------------------------------------------------------------------------------


class WithoutEngine:
    """Replacement for the code generator of a library that never runs on its own."""

    @staticmethod
    def set_env(name, environment):
        """Leave the environment of Python objects unset, because inner functions do not use it."""


class InnerLibrary(JITCodeLibrary):
    """The intermediate code of an inner function (1)."""

    attributes: tuple[str, ...] = ()  #: LLVM attributes of the function
    key: str | None = None  #: key of the code on disk (6), None if it is not stored
    known: ClassVar[dict[str, "InnerLibrary"]] = {}  #: libraries of this process by key

    @classmethod
    def stored(cls, codegen, key, code):
        """Return the library of stored code with the libraries that it calls; None if one of them is missing."""
        called = [cls.found(codegen, each) for each in code.called]
        if None in called:
            return None
        library = cls(codegen, key)
        module = parse_bitcode(code.bitcode)
        module.data_layout = codegen._data_layout
        library._final_module = module
        library._linking_libraries = called
        library.key, cls.known[key] = key, library
        library.finalize()
        return library

    @classmethod
    def found(cls, codegen, key):
        """Return the library with a key, from this process or from disk; None if there is none."""
        if key not in cls.known and (code := read_code(key)) is not None:
            cls.stored(codegen, key, code)
        return cls.known.get(key)

    def add_ir_module(self, ir_module):
        """Parse the code of the function as the only module, instead of linking it into an empty module."""
        self._raise_if_finalized()
        module = parse_assembly(cgutils.normalize_ir_text(str(ir_module)))
        module.name = ir_module.name
        module.data_layout = self._codegen._data_layout
        self._final_module = module

    def store(self, key, result):
        """Write the code to disk if all kernels that it calls are stored too."""
        libraries = [each for each in dict.fromkeys(self._linking_libraries) if each is not rtsys.library]
        called = [each for each in libraries if isinstance(each, InnerLibrary)]
        keys = tuple(each.key for each in called if each.key is not None)
        if self._reload_init or len(keys) < len(called):
            return
        module = self._final_module.clone()
        for library in libraries:
            if library not in called:  # functions of numba, such as `max`, become part of this code, with local names
                add_internal(module, library._get_module_for_linking())
        self.key, self.known[key] = key, self
        write_code(key, StoredCode(result, keys, module.as_bitcode()))

    def _get_module_for_linking(self):
        """Return the code itself instead of a copy, because an entry links it only once."""
        self._ensure_finalized()
        for function in self._final_module.functions:
            if not function.is_declaration and function.linkage == Linkage.external:
                function.linkage = "linkonce_odr"
        return self._final_module

    def finalize(self):
        """Register the called functions without linking, optimisation or machine code."""
        self._raise_if_finalized()
        for library in dict.fromkeys(self._linking_libraries):
            self._reload_init.update(library._reload_init)
        self._finalize_dynamic_globals()
        self._finalized = True

    def get_pointer_to_function(self, name):
        """Return zero, because there is no machine code."""
        self._ensure_finalized()
        return 0

    @property
    def codegen(self):
        """Stand-in for the generator of machine code."""
        return WithoutEngine


def add_internal(module, other):
    """Link a copy of another module into a module, with functions that are not visible outside."""
    names = {function.name for function in other.functions if not function.is_declaration}
    module.link_in(other, preserve=True)  # links only the functions that are called
    for function in module.functions:
        if function.name in names:
            function.linkage = Linkage.internal


class EntryLibrary(JITCodeLibrary):
    """The code of an entry together with all functions that it calls (2)."""

    attributes = ()  #: LLVM attributes of the function

    def finalize(self):
        """Link, optimise, and generate machine code."""
        libraries: dict = {}
        for library in self._linking_libraries:
            with_callees(library, libraries)
        self._linking_libraries = list(libraries)
        require_own_symbols(self._linking_libraries)
        super().finalize()

    def _optimize_final_module(self):
        manager, builder = self._codegen._module_pass_manager()
        if level == 0:  # code that refers to addresses in this process, even unused ones, cannot be stored on disk
            manager.add_sroa_pass()
            manager.add_dead_code_elimination_pass()
            manager.add_global_dead_code_eliminate_pass()
        manager.run(self._final_module, builder)


def with_callees(library, known):
    """Add a library, and recursively all libraries that it calls, to `known`."""
    if library not in known:
        known[library] = None
        for other in library._linking_libraries:
            with_callees(other, known)


def require_own_symbols(libraries):
    """Raise `RuntimeError` if two inner functions have one symbol: the linker would keep one and drop the other."""
    owners: dict = {}
    for library in libraries:
        if isinstance(library, InnerLibrary):
            for function in library._final_module.functions:
                is_seen = not function.is_declaration and function.linkage != Linkage.internal
                if is_seen and owners.setdefault(function.name, library) is not library:
                    raise RuntimeError(f"two inner functions named {library.name} have one symbol: {function.name}")


def variables_in(self, part):
    """Return the variables in a part of a numba statement, as `Inst._rec_list_vars` does."""
    kind = type(part)
    if kind is Var:
        return [part]
    if kind in PLAIN:
        return []
    if isinstance(part, Inst):
        return part.list_vars()
    if kind is list or kind is tuple:
        return [each for one in part for each in variables_in(self, one)]
    if kind is dict:
        return [each for one in part.values() for each in variables_in(self, one)]
    return plain_variables_in(self, part)


PLAIN = frozenset({str, int, float, bool, type(None), Loc, types.BuiltinFunctionType, types.FunctionType})
plain_variables_in = Inst._rec_list_vars


def without_warnings(self, filename=None, lineno=None):
    """Return a context that does nothing, which replaces the collection of warnings for each statement."""
    return nullcontext()


def needed_rewrites(self, rewrites, code):
    """Apply the byte code rewrites that kernels may need, without those for `with` and keyword dictionaries."""
    return plain_rewrites(self, [each for each in rewrites if each.__name__ not in NOT_NEEDED], code)


NOT_NEEDED = ("peep_hole_delete_with_exit", "peep_hole_fuse_dict_add_updates")
plain_rewrites = Interpreter.post_process


@contextmanager
def shorter_ways() -> Iterator[None]:
    """Replace slow functions of numba by faster ones while the compiler's lock is held (3)."""
    replaced = (
        (Inst, "_rec_list_vars", variables_in),
        (WarningsFixer, "catch_warnings", without_warnings),
        (Interpreter, "post_process", needed_rewrites),
    )
    plain = [getattr(owner, name) for owner, name, _ in replaced]
    for owner, name, function in replaced:
        setattr(owner, name, function)
    try:
        yield
    finally:
        for (owner, name, _), function in zip(replaced, plain, strict=True):
            setattr(owner, name, function)


@contextmanager
def remembered_calls() -> Iterator[None]:
    """Cache the types of calls while the compiler's lock is held (3)."""
    plain = BaseFunction.get_call_type
    known: dict = {}

    def get_call_type(self, context, args, kws):
        flags = ConfigStack.top_or_none()
        key = self, context, tuple(args), tuple(kws.items()), flags is not None and flags.nrt
        if key not in known:
            known[key] = plain(self, context, args, kws)
        return known[key]

    BaseFunction.get_call_type = get_call_type  # type: ignore[method-assign]
    try:
        yield
    finally:
        BaseFunction.get_call_type = plain  # type: ignore[method-assign]


def identity(function, key):
    """Return the identity of a function with a number, used in its LLVM name, that is the same in every process."""
    known = FunctionIdentity.from_function(function)
    if key is not None:
        known.unique_id = key
        known.unique_name = f"{known.func_qualname}${key}"
    return known


class InnerCompiler(CompilerBase):
    """The compiler of an inner function."""

    #: LLVM attribute of the function: small code, because its loops are short
    attributes: tuple[str, ...] = ("optsize",)
    context: ClassVar[Any] = KernelContext
    passes: ClassVar[Sequence[type]] = INNER  #: last passes of the pipeline

    def define_pipelines(self):
        """Return the one pipeline."""
        return [pipeline(self.state, self.passes)]

    def compile_extra(self, func):
        """Compile into an `InnerLibrary`, or take its code from disk (6)."""
        state = self.state
        state.targetctx = context = self.context.of(state.targetctx)
        key = code_key(func, state.args, f"{self.attributes} {state.flags}") if state.return_type is None else None
        if key is not None and (code := read_code(key)) is not None:
            library = InnerLibrary.known.get(key) or InnerLibrary.stored(context.codegen(), key, code)
            if library is not None:
                return self.stored_result(func, key, code.result, library)
        state.library = library = InnerLibrary(context.codegen(), func.__qualname__)
        library.attributes = self.attributes
        state.func_id = identity(func, key)
        ExtractByteCode().run_pass(state)
        state.lifted = ()
        result = self._compile_bytecode()
        if key is not None:
            library.store(key, result.signature.return_type)
        return result

    def stored_result(self, func, key, kind, library):
        """Return the result of a compilation for a library from disk."""
        state = self.state
        context, known = state.targetctx, identity(func, key)
        described = FunctionDescriptor(
            True, func.__module__, known.func_qualname, known.unique_name, "", None, kind, None, known.arg_names, (),
            mangler=context.mangler, argtypes=tuple(state.args), inline=state.flags.forceinline,
            noalias=state.flags.noalias, global_dict=func.__globals__, abi_tags=[state.flags.get_mangle_string()],
            uid=known.unique_id,
        )  # fmt: skip
        library.get_function(described.mangled_name)  # raises an error if the stored code lacks the function
        environment = Environment.from_fndesc(described)
        function = context.get_executable(library, described, environment)
        context.insert_user_function(function, described, [library])
        return compile_result(
            typing_context=state.typingctx, target_context=context, entry_point=function, typing_error=None,
            type_annotation=None, library=library, call_helper=None, signature=signature(kind, *state.args),
            objectmode=False, lifted=(), fndesc=described, environment=environment, metadata=state.metadata,
            reload_init=[],
        )  # fmt: skip


class EntryCompiler(CompilerBase):
    """The compiler of an entry."""

    def define_pipelines(self):
        """Return the one pipeline."""
        return [pipeline(self.state, ENTRY)]

    def compile_extra(self, func):
        """Compile into an `EntryLibrary`."""
        self.state.library = EntryLibrary(self.state.targetctx.codegen(), func.__qualname__)
        self.state.library.enable_object_caching()
        with remembered_calls(), shorter_ways(), without_garbage_collection():
            result = super().compile_extra(func)
        delete_old()
        return result


class LawEntryCompiler(EntryCompiler):
    """The compiler of the C function of a law."""

    def define_pipelines(self):
        """Return the one pipeline."""
        return [pipeline(self.state, INNER)]


class LoopCompiler(InnerCompiler):
    """The compiler of an inner function with loops over modes or matrices, which are unrolled and vectorised."""

    attributes = ()


class SmallCompiler(InnerCompiler):
    """The compiler of an inner function with few operations or one caller, which is inlined."""

    attributes = ("alwaysinline",)


class MatrixLoopCompiler(InnerCompiler):
    """The compiler of a long function with loops and many callers, which is not inlined."""

    attributes = ("noinline",)


class LawCompiler(InnerCompiler):
    """The compiler of a function of a law, see kernels/compiler/law.py."""

    attributes = ()
    context = LawContext
    passes = (LawLowering, NoPythonBackend)

    def compile_extra(self, func):
        """Compile as an inner function or, if it creates arrays, with `OwnerCompiler`."""
        state = self.state
        try:
            return super().compile_extra(func)
        except NumbaError:
            state.typingctx.callstack._fail_cache.clear()  # types that failed may work with reference counts
            flags = state.flags.copy()
            flags.nrt = True
            again = OwnerCompiler(
                state.typingctx, cpu_target.target_context, None, state.args, state.return_type, flags, state.locals
            )
            return again.compile_extra(func)


class OwnerCompiler(LawCompiler):
    """The compiler of a function that creates arrays, with numba's passes and reference counts."""

    def define_pipelines(self):
        """Return numba's pipeline."""
        return [DefaultPassBuilder.define_nopython_pipeline(self.state)]

    def compile_extra(self, func):
        """Compile as other inner functions."""
        return InnerCompiler.compile_extra(self, func)


class NotLeanError(Exception):
    """The lean compiler does not support something in a function."""


def decorator(pipeline_class, **options):
    """Return the decorator for functions that only compiled code calls.

    They have no wrappers for Python, no test before each division, and no reference counts (all arrays belong to
    Python), unless the options request them.
    """
    return njit(
        **{"_nrt": False} | options,
        no_cpython_wrapper=True,
        no_cfunc_wrapper=True,
        error_model="numpy",
        pipeline_class=pipeline_class,
    )


inner = decorator(InnerCompiler)  #: decorator for functions that only compiled code calls
small = decorator(SmallCompiler)  #: the same for functions with few operations
loops = decorator(LoopCompiler)  #: the same for functions with loops over modes or matrices (5)
matrix_loops = decorator(MatrixLoopCompiler)  #: the same for long functions with many callers
view = decorator(SmallCompiler, _nrt=True)  #: the same for functions that return parts of arrays
of_law = decorator(LawCompiler)  #: decorator of functions of laws


def entry(function, *, cache=True):
    """Return the compiled function that Python calls."""
    compiled = njit(function, error_model="numpy", pipeline_class=EntryCompiler)
    return stored(compiled) if cache else compiled


def array_type(dtype, ndim):
    """Return the type of a contiguous array in the kernels."""
    return Block(dtype, ndim)


def array_value(context, builder, kind, data, shape):
    """Return the value of an array at an address whose memory Python owns."""
    return make_block(context, builder, kind, data, shape)
