"""The passes of numba that a kernel goes through: byte code, types, one assignment a variable, code of LLVM.

numba also looks in each function for closures, generators, parallel loops, array expressions and calls to write out in
line, and finds out after each pass how long variables live. Kernels have none of these and own nothing that must be
freed.
"""

from numba.core.compiler_machinery import FunctionPass, PassManager, register_pass
from numba.core.ir_utils import build_definitions
from numba.core.rewrites.static_getitem import RewriteConstGetitems
from numba.core.ssa import reconstruct_ssa
from numba.core.typed_passes import (
    IRLegalization,
    NativeLowering,
    NoPythonBackend,
    NopythonTypeInference,
    PreLowerStripPhis,
)
from numba.core.untyped_passes import FixupArgs, IRProcessing, TranslateByteCode

from floatframe.engine.kernels.compiler.lowering import KernelLower

__all__ = ["ENTRY", "INNER", "pipeline"]


@register_pass(mutates_CFG=False, analysis_only=False)
class ConstantIndices(FunctionPass):
    """Constant indices of tuples are known to the types; of numba's rewrites the one that kernels need."""

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
    """One assignment a variable, without analyses of lifetimes."""

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
    """Assignments at the ends of blocks instead of phi nodes, without analyses of lifetimes."""

    _name = "no_phis"

    def run_pass(self, state):
        """Rewrite in place."""
        state.func_ir = self._strip_phi_nodes(state.func_ir)
        state.func_ir._definitions = build_definitions(state.func_ir.blocks)
        return True


@register_pass(mutates_CFG=True, analysis_only=False)
class KernelLowering(NativeLowering):
    """Lowering of an inner function."""

    _name = "kernel_lowering"

    @property
    def lowering_class(self):
        """The lowering for kernels."""
        return KernelLower


class Passes(PassManager):
    """Passes in their order, without analyses of lifetimes after each of them."""

    def _runPass(self, index, pss, internal_state):
        pss.analysis = self._analysis
        pss.run_initialization(internal_state)
        pss.run_pass(internal_state)
        pss.run_finalizer(internal_state)


FRONT = [IRProcessing, ConstantIndices, OneAssignment, NopythonTypeInference, NoPhis]
INNER = [KernelLowering, NoPythonBackend]  #: the last passes of an inner function
ENTRY = [IRLegalization, NativeLowering, NoPythonBackend]  #: those of an entry


def pipeline(state, back):
    """Return the passes that kernels need."""
    passes = [*FRONT, *back] if state.func_ir else [TranslateByteCode, FixupArgs, *FRONT, *back]
    manager = Passes("kernel")
    for each in passes:
        manager.add_pass(each, each.name())
    manager.finalize()
    return manager
