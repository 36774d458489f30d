"""The compiled entry of the conserving and variational schemes; compiled when one of them is first used."""

from numba import types

from floatframe.engine.kernels.compiler.choice import is_lean
from floatframe.engine.kernels.compiler.compilation import kept_entry
from floatframe.engine.kernels.compiler.sources import source_digest
from floatframe.engine.kernels.compiler.structure import converter, kept_table_of, table_of, table_of_numbers
from floatframe.engine.kernels.entry import Order, Outcome
from floatframe.engine.kernels.memory import Memory, Rows
from floatframe.engine.kernels.model import Model
from floatframe.engine.kernels.work import Work
from floatframe.engine.structure_preserving.kernels.records import Discrete, StepWork
from floatframe.engine.structure_preserving.kernels.steps import advance

__all__ = ["advance_discrete_steps"]

as_model, as_work, as_memory = converter(Model()), converter(Work()), converter(Memory())
as_rows, as_order = converter(Rows()), converter(Order())
as_discrete, as_step = converter(Discrete()), converter(StepWork())


def make_entry(digest):
    """Return the cached entry; the digest of the sources enters its key."""

    def run(model_table, work_table, discrete_table, step_table, memory_table, rows_table, order_table):
        if digest == 0:
            return 0, 0, 0, -1, 0.0
        model, work, discrete = as_model(model_table), as_work(work_table), as_discrete(discrete_table)
        step, memory = as_step(step_table), as_memory(memory_table)
        status, n_steps, n_rows = advance(
            model, work, discrete, step, memory, as_rows(rows_table), as_order(order_table)
        )  # fmt: skip
        return status, n_steps, n_rows, -1, step.excess

    return kept_entry(run)


run = make_entry(source_digest(__name__, "lean" if is_lean else "plain"))
SIGNATURE = (types.Array(types.int64, 1, "C"),) * 7
ORDER = Order()


def advance_discrete_steps(
    model: Model, work: Work, discrete: Discrete, step: StepWork, memory: Memory, rows: Rows, **order: float
) -> Outcome:
    """Advance the memory by steps of the scheme; see `kernels.steps.advance`."""
    if not run.signatures:
        run.compile(SIGNATURE)
    ordered, numbers = table_of_numbers(ORDER, order)
    kept = (kept_table_of(record) for record in (model, work, discrete, step))
    outcome = run(*kept, table_of(memory), table_of(rows), ordered)
    del numbers  # not before
    return Outcome(*outcome)
