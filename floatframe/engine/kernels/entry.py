"""The entry into compiled code for absolute coordinates, with one plain function for each of its tasks.

There is one entry, because numba compiles and links all inner functions again for each entry.
"""

import logging
from typing import Any, NamedTuple

from numba import types

from fe_models.foundation.arrays import Array, IntArray
from fe_models.foundation.stages import announced_compilation
from floatframe.engine.kernels.body import NewtonWeights
from floatframe.engine.kernels.compiler.choice import is_interpreted, is_lean, words
from floatframe.engine.kernels.compiler.compilation import entry
from floatframe.engine.kernels.compiler.structure import converter, table_of_numbers
from floatframe.engine.kernels.connections.connection import constraint_rates
from floatframe.engine.kernels.diagnostics import power
from floatframe.engine.kernels.evaluation import evaluate, linearize
from floatframe.engine.kernels.generalized_alpha import (
    DONE,
    SINGULAR_BODY,
    SINGULAR_CONNECTION,
    advance,
    load_state,
    write_row,
)
from floatframe.engine.kernels.memory import GIVEN, TAKEN, Memory, Rows, new_rows
from floatframe.engine.kernels.model import Model
from floatframe.engine.kernels.records import integer, real, zeros
from floatframe.engine.kernels.schur import correction, factorize_bodies
from floatframe.engine.kernels.turns import count_turns
from floatframe.engine.kernels.work import Work

__all__ = [
    "ADVANCE",
    "OBSERVE",
    "CompiledEntry",
    "Order",
    "Outcome",
    "absolute_kernels",
    "count_angles",
    "evaluate_and_linearize",
    "newton_correction",
    "prepare",
    "rates_of_constraints",
]

log = logging.getLogger(__name__)

LINEARIZE, RATES, CORRECT, OBSERVE, ADVANCE, COUNT = range(6)


class Order(NamedTuple):
    """A request to the entry: a task with its parameters."""

    what: IntArray = integer()  #: task: LINEARIZE, RATES, CORRECT, OBSERVE, ADVANCE or COUNT
    c_m: Array = real()  #: weights of mass, damping and stiffness in the Newton matrix
    c_d: Array = real(unit="s")
    c_k: Array = real(unit="s²")
    t0: Array = real(unit="s")  #: time of step 0, or of the observed state
    h: Array = real(unit="s")
    first: IntArray = integer()  #: number of the first step
    n_steps: IntArray = integer()
    every: IntArray = integer()  #: number of steps between written results
    alpha_m: Array = real()  #: coefficients of the generalized-alpha method
    alpha_f: Array = real()
    beta: Array = real()
    gamma: Array = real()
    tolerance: Array = real()  #: tolerance of Newton's method
    max_iterations: IntArray = integer()
    length: Array = real(unit="m")  #: size of the system
    most_error: Array = real()  #: allowed error of a step, 0 for no error control
    h_min: Array = real(unit="s")  #: smallest size of a divided step, 0 if steps may not be divided
    stabilized: IntArray = integer()  #: whether velocity constraints are enforced and spins are integrated separately


class Outcome(NamedTuple):
    """The report of the entry about a request."""

    status: int  #: DONE, DIVERGED, SINGULAR_BODY, SINGULAR_CONNECTION or INACCURATE
    n_steps: int  #: number of steps done
    n_rows: int  #: number of rows written
    singular: int  #: number of the singular body or connection
    excess: float  #: size of the last correction relative to the allowed one


as_model, as_work, as_memory = converter(Model()), converter(Work()), converter(Memory())
as_rows, as_order = converter(Rows()), converter(Order())


@entry
def run(model_table, work_table, memory_table, rows_table, order_table):
    """Carry out a request; the arguments are the tables of the records."""
    model, work = as_model(model_table), as_work(work_table)
    memory, rows, order = as_memory(memory_table), as_rows(rows_table), as_order(order_table)
    what = order.what
    if what == ADVANCE:
        return advance(model, work, memory, rows, (), order)
    if what == COUNT:
        load_state(work.state, memory)
        count_turns(model, work, memory, order.h)
    elif what == OBSERVE:
        work.counted.rows = 0
        write_row(model, work, memory, order.t0, rows)
        memory.power[GIVEN], memory.power[TAKEN] = power(model, work)
    else:
        weights, c_k = NewtonWeights(order.c_m, order.c_d, order.c_k), order.c_k
        work.solver.is_law_due = 1  # tasks of this branch overwrite the derivatives that steps keep
        evaluate(model, work, c_k if c_k > 0.0 else 1.0)
        if what == LINEARIZE:
            linearize(model, work, weights)
        elif what == RATES:
            constraint_rates(model, work)
        else:
            body = factorize_bodies(model, work, weights)
            if body >= 0:
                return SINGULAR_BODY, 0, 0, body, 0.0
            connection = correction(model, work, c_k, what == CORRECT)
            if connection >= 0:
                return SINGULAR_CONNECTION, 0, 0, connection, 0.0
    return DONE, 0, 0, -1, 0.0


NO_SIZES = dict.fromkeys(("n_t", "n_b", "n_c", "n_q", "n_u", "n_w", "n_remembered", "angles", "loads", "body loads"), 0)
ORDER, NO_MEMORY, NO_ROWS = Order(), zeros(Memory(), NO_SIZES), zeros(Rows(), NO_SIZES)


class CompiledEntry:
    """A compiled function of records and a request, the only way from Python into the time loop.

    Its arguments are the tables of the records of a formulation (model and working arrays first), of the memory, of
    the rows of results, and of the order.
    """

    def __init__(self, compiled: Any, n_records: int) -> None:
        self.compiled = compiled
        self.signature = (types.Array(types.int64, 1, "C"),) * (n_records + 3)
        self.is_ready = is_interpreted

    def prepare(self) -> bool:
        """Load the kernels from the cache, or compile them; return whether they were compiled in this call.

        Without a call of this function, this happens at the first request.
        """
        before = sum(self.compiled.stats.cache_misses.values())
        self.compiled.compile(self.signature)
        self.is_ready = True
        return sum(self.compiled.stats.cache_misses.values()) > before

    def __call__(self, *records: Any, memory: Any = NO_MEMORY, rows: Any = NO_ROWS, **order: float) -> Outcome:
        """Carry out a request; fields that are not given are zero, and all arrays stay alive until it returns."""
        if not self.is_ready:
            with announced_compilation(
                log, f"the code of motions ({words()})", "about 15 s" if is_lean else "some minutes"
            ):
                self.prepare()
        ordered, numbers = table_of_numbers(ORDER, order)
        outcome = self.compiled(*(record.table for record in (*records, memory, rows)), ordered)
        del numbers  # must live until here, because the table has its address
        return Outcome(*outcome)

    def observe(self, *records: Any, memory: Memory, t: float) -> Rows:
        """Return the results at the state in the memory, and store their power in the memory."""
        rows = new_rows(records[0], 1)
        self(*records, memory=memory, rows=rows, what=OBSERVE, t0=t)
        return rows

    def advance(
        self, *records: Any, memory: Memory, h: float, first: int, n_steps: int, every: int, **order: float
    ) -> tuple[Rows, Outcome]:
        """Advance the memory by n_steps of size h; return the results after every `every`-th step and the report.

        order: time of step 0, and numbers of the method; see `kernels.generalized_alpha.time_loop`.
        """
        rows = new_rows(records[0], (first + n_steps) // every - first // every)
        steps = {"h": h, "first": first, "n_steps": n_steps, "every": every}
        outcome = self(*records, memory=memory, rows=rows, what=ADVANCE, **steps, **order)
        if outcome.n_rows < len(rows.t):
            rows = Rows(*(array[: outcome.n_rows] for array in rows))
        return rows, outcome


absolute_kernels = CompiledEntry(run, n_records=2)


def prepare() -> bool:
    """Make the kernels of absolute coordinates ready, see `CompiledEntry.prepare`."""
    return absolute_kernels.prepare()


def evaluate_and_linearize(model: Model, work: Work, c_m: float, c_d: float, c_k: float) -> None:
    """Write residuals and derivatives at the iterate in `work`; c_k above 0 weights the rows of wrenches."""
    absolute_kernels(model, work, what=LINEARIZE, c_m=c_m, c_d=c_d, c_k=c_k)


def rates_of_constraints(model: Model, work: Work) -> tuple[Array, Array]:
    """Return rate and second rate (at zero u_dot) of every row's constrained quantity, both (n_w,)."""
    absolute_kernels(model, work, what=RATES)
    return work.connections.rate.copy(), work.connections.bias.copy()


def newton_correction(model: Model, work: Work, c_m: float, c_d: float, c_k: float) -> Outcome:
    """Write the Newton correction (y, mu) for the iterate in `work`."""
    return absolute_kernels(model, work, what=CORRECT, c_m=c_m, c_d=c_d, c_k=c_k)


def count_angles(model: Model, work: Work, memory: Memory, h: float) -> None:
    """Store the counted angles of the state in the memory, a step of size h after the stored ones."""
    absolute_kernels(model, work, memory=memory, what=COUNT, h=h)
