"""Translation of numba's intermediate code of inner functions to LLVM code, without features that kernels omit.

Kernels own no memory and raise no errors, so that here

(1) references of variables are not counted, and variables are not deleted and not set to zero before their first value;
(2) a variable with one assignment that precedes all its uses is a value instead of a position on the stack;
(3) a call of another kernel does not test its status;
(4) operations on two integers or two reals, and indices of arrays, are written without a search for their meaning;
(5) loops are unrolled and vectorised only in functions with the decorator `loops`.
"""

import operator
from collections import defaultdict

from llvmlite import ir as llvm
from numba import types
from numba.core import ir
from numba.core.analysis import compute_cfg_from_blocks, compute_use_defs, must_use_alloca
from numba.core.cpu import CPUContext
from numba.core.errors import LoweringError
from numba.core.lowering import Lower

from floatframe.engine.kernels.compiler.block import Block, get_item

__all__ = ["KernelContext", "KernelLower", "LawContext", "LawLower"]

NO_WRAP = ("nsw",)  # integers of kernels do not overflow
OPERATIONS = {
    (operator.add, types.float64, types.float64): lambda builder, x, y: builder.fadd(x, y),
    (operator.sub, types.float64, types.float64): lambda builder, x, y: builder.fsub(x, y),
    (operator.mul, types.float64, types.float64): lambda builder, x, y: builder.fmul(x, y),
    (operator.truediv, types.float64, types.float64): lambda builder, x, y: builder.fdiv(x, y),
    (operator.add, types.int64, types.int64): lambda builder, x, y: builder.add(x, y, flags=NO_WRAP),
    (operator.sub, types.int64, types.int64): lambda builder, x, y: builder.sub(x, y, flags=NO_WRAP),
    (operator.mul, types.int64, types.int64): lambda builder, x, y: builder.mul(x, y, flags=NO_WRAP),
}


def single_assignments(blocks):
    """Return the variables with one assignment that precedes every use on all paths (2)."""
    assigned = defaultdict(list)
    for label, block in blocks.items():
        for statement in block.find_insts(ir.Assign):
            assigned[statement.target.name].append(label)
    used = defaultdict(set)
    for label, names in compute_use_defs(blocks).usemap.items():  # variables used in a block before an assignment there
        for name in names:
            used[name].add(label)
    dominators = compute_cfg_from_blocks(blocks).dominators()
    single = set()
    for name, labels in assigned.items():
        first = labels[0]
        if len(labels) == 1 and all(first < label and first in dominators[label] for label in used[name]):
            single.add(name)
    return single - must_use_alloca(blocks)


class KernelLower(Lower):
    """numba's lowering of a function, for kernels."""

    operations = OPERATIONS  #: numeric operations that are written directly (4)

    def _find_singly_assigned_variable(self):
        self._singly_assigned_vars = single_assignments(self.func_ir.blocks)
        self._blk_local_varmap = {}

    def setup_function(self, fndesc):
        """Set up the LLVM function (5)."""
        super().setup_function(fndesc)
        for attribute in self.library.attributes:
            self.function.attributes.add(attribute)

    def incref(self, typ, val):
        """Do nothing, because references are not counted (1)."""

    def decref(self, typ, val):
        """Do nothing, because references are not counted (1)."""

    def delvar(self, name):
        """Do nothing, because variables own no references (1)."""

    def alloca_lltype(self, name, lltype, datamodel=None):
        """Return uninitialised memory on the stack (1)."""
        with self.builder.goto_entry_block():
            return self.builder.alloca(lltype, name=name)

    def storevar(self, value, name, argidx=None):
        """Assign a value to a variable (1, 2)."""
        if name in self._singly_assigned_vars:
            self._blk_local_varmap[name] = value
        else:
            self.builder.store(value, self.getvar(name))

    def lower_assign(self, ty, inst):
        """Return the value of an assignment; a kernel used as a value has none."""
        if isinstance(ty, types.Dispatcher):
            return self.context.get_dummy_value()
        return super().lower_assign(ty, inst)

    def lower_block(self, block):
        """Write a block of statements; an error states the line."""
        self.pre_block(block)
        for statement in block.body:
            self.loc = statement.loc
            try:
                self.lower_inst(statement)
            except Exception as error:
                raise LoweringError(f"{error}, in: {statement}", loc=statement.loc) from error
        self.post_block(block)

    def lower_inst(self, inst):
        """Write a statement (4)."""
        if isinstance(inst, ir.Assign):
            self.storevar(self.lower_assign(self.typeof(inst.target.name), inst), inst.target.name)
        elif isinstance(inst, ir.StaticSetItem) and isinstance(self.typeof(inst.target.name), Block):
            self.lower_setitem(inst.target, inst.index_var, inst.value, self.fndesc.calltypes[inst])
        else:
            super().lower_inst(inst)

    def lower_expr(self, resty, expr):
        """Return the value of an expression (4)."""
        if expr.op in ("binop", "inplace_binop"):
            signature = self.fndesc.calltypes[expr]
            function = expr.fn if expr.op == "binop" else expr.immutable_fn
            write = self.operations.get((function, *signature.args))
            if write is not None:
                x, y = (self.value_as(*each) for each in zip((expr.lhs, expr.rhs), signature.args, strict=True))
                return self.context.cast(self.builder, write(self.builder, x, y), signature.return_type, resty)
        elif expr.op == "static_getitem" and expr.index_var is not None:
            if isinstance(self.typeof(expr.value.name), Block):
                return self.lower_getitem(resty, expr, expr.value, expr.index_var, self.fndesc.calltypes[expr])
        return super().lower_expr(resty, expr)

    def lower_getitem(self, resty, expr, value, index, signature):
        """Return an element or a part of an array (4)."""
        if not isinstance(signature.args[0], Block):
            return super().lower_getitem(resty, expr, value, index, signature)
        arguments = [self.loadvar(value.name), self.value_as(index, signature.args[1])]
        part = get_item(self.context, self.builder, signature, arguments)
        return self.context.cast(self.builder, part, signature.return_type, resty)

    def value_as(self, variable, kind):
        """Return the value of a variable converted to another type."""
        return self.context.cast(self.builder, self.loadvar(variable.name), self.typeof(variable.name), kind)


def parts(builder, x):
    """Return the real and the imaginary part of a complex number."""
    return builder.extract_value(x, 0), builder.extract_value(x, 1)


def complex_number(builder, kind, real, imag):
    """Return the complex number with these real and imaginary parts."""
    return builder.insert_value(builder.insert_value(llvm.Constant(kind, llvm.Undefined), real, 0), imag, 1)


def complex_sum(builder, x, y):
    """Return the complex sum x + y."""
    (a, b), (c, d) = parts(builder, x), parts(builder, y)
    return complex_number(builder, x.type, builder.fadd(a, c), builder.fadd(b, d))


def complex_difference(builder, x, y):
    """Return the complex difference x - y."""
    (a, b), (c, d) = parts(builder, x), parts(builder, y)
    return complex_number(builder, x.type, builder.fsub(a, c), builder.fsub(b, d))


def complex_product(builder, x, y):
    """Return the complex product x y."""
    (a, b), (c, d) = parts(builder, x), parts(builder, y)
    real = builder.fsub(builder.fmul(a, c), builder.fmul(b, d))
    return complex_number(builder, x.type, real, builder.fadd(builder.fmul(a, d), builder.fmul(b, c)))


COMPLEX = types.complex128, types.complex128
LAW_OPERATIONS = {
    **OPERATIONS,
    (operator.add, *COMPLEX): complex_sum,
    (operator.sub, *COMPLEX): complex_difference,
    (operator.mul, *COMPLEX): complex_product,
}
MAKES_ARRAYS = ("call", "binop", "unary")  #: kinds of expressions that may create a new array


class LawLower(KernelLower):
    """The lowering of a function of a law."""

    operations = LAW_OPERATIONS

    def lower_expr(self, resty, expr):
        """Return the value of an expression; a new array is rejected, because it would never be freed (1)."""
        if expr.op in MAKES_ARRAYS and self.context.data_model_manager[resty].contains_nrt_meminfo():
            raise NotImplementedError("an array that must be freed")
        return super().lower_expr(resty, expr)


class LawContext(CPUContext):
    """numba's compilation context for functions of laws, in which errors pass through calls."""

    @classmethod
    def of(cls, context):
        """Return the context unchanged."""
        return context


def call_of_kernel(fndesc, libraries):
    """Return the function that writes a call of a kernel with numba's calling convention (3)."""

    def write_call(context, builder, signature, arguments):
        function = context.declare_function(builder.module, fndesc)
        convention = context.call_conv
        with builder.goto_entry_block():
            place = builder.alloca(convention.get_return_type(fndesc.restype).pointee)
        packer = context.get_arg_packer(fndesc.argtypes)
        error = convention._get_excinfo_argument(builder.function)
        builder.call(function, [place, error, *packer.as_arguments(builder, arguments)])
        model = context.data_model_manager[fndesc.restype]
        return model.from_return(builder, builder.load(place))

    write_call.signature = fndesc.argtypes  # type: ignore[attr-defined]
    write_call.libs = tuple(libraries)  # type: ignore[attr-defined]
    return write_call


class KernelContext(CPUContext):
    """numba's compilation context for functions that are kernels."""

    @classmethod
    def of(cls, context):
        """Return a context for kernels that shares all data with the given one."""
        shared = context.subtarget()
        shared.__class__ = cls
        return shared

    def insert_user_function(self, func, fndesc, libs=()):
        """Register how a kernel is called by other kernels."""
        write_call = call_of_kernel(fndesc, libs)
        self._defns[func].append(write_call, write_call.signature)
