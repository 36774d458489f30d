"""The compiled entry, and a plain function for each of its tasks.

One entry, since numba compiles and links everything below an entry once more for each of them.
"""

import logging
import time
from typing import NamedTuple

from numba import types

from fe_models.foundation.arrays import Array, IntArray
from floatframe.engine.kernels.compiler.choice import is_lean, words
from floatframe.engine.kernels.compiler.compilation import kept_entry
from floatframe.engine.kernels.compiler.sources import source_digest
from floatframe.engine.kernels.compiler.structure import converter, kept_table_of, table_of, table_of_numbers
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
from floatframe.engine.kernels.memory import Memory, Rows, new_rows
from floatframe.engine.kernels.model import Model
from floatframe.engine.kernels.records import integer, real, zeros
from floatframe.engine.kernels.schur import correction, factorize_bodies
from floatframe.engine.kernels.turns import count_turns
from floatframe.engine.kernels.work import Work

__all__ = [
    "Order",
    "Outcome",
    "advance_steps",
    "count_angles",
    "evaluate_and_linearize",
    "newton_correction",
    "no_memory",
    "observe_state",
    "prepare",
    "rates_of_constraints",
]

log = logging.getLogger(__name__)

LINEARIZE, RATES, CORRECT, OBSERVE, ADVANCE, COUNT = range(6)


class Order(NamedTuple):
    """A request to the entry."""

    what: IntArray = integer()  #: LINEARIZE, RATES, CORRECT, OBSERVE, ADVANCE or COUNT
    c_m: Array = real()  #: weights of the parts of mass, damping, stiffness
    c_d: Array = real(unit="s")
    c_k: Array = real(unit="s²")
    t0: Array = real(unit="s")  #: time of step 0, or of the observed state
    h: Array = real(unit="s")
    first: IntArray = integer()  #: number of the first step
    n_steps: IntArray = integer()
    every: IntArray = integer()  #: results are written at this interval of steps
    alpha_m: Array = real()  #: coefficients of the method
    alpha_f: Array = real()
    beta: Array = real()
    gamma: Array = real()
    tolerance: Array = real()  #: of Newton's method
    max_iterations: IntArray = integer()
    length: Array = real(unit="m")  #: size of the system
    most_error: Array = real()  #: allowed error of a step, 0 for no control
    h_min: Array = real(unit="s")  #: smallest part of a divided step, 0 if it may not be divided
    stabilized: IntArray = integer()  #: whether velocities are enforced too, and spins integrated separately


class Outcome(NamedTuple):
    """The report of the entry."""

    status: int  #: DONE, DIVERGED, SINGULAR_BODY, SINGULAR_CONNECTION or INACCURATE
    n_steps: int  #: done
    n_rows: int  #: written
    singular: int  #: number of the singular body or connection
    excess: float  #: size of the last correction relative to the allowed one


as_model, as_work, as_memory = converter(Model()), converter(Work()), converter(Memory())
as_rows, as_order = converter(Rows()), converter(Order())


def make_entry(digest):
    """Return the cached entry; the digest of the sources enters its key, see the package docstring."""

    def run(model_table, work_table, memory_table, rows_table, order_table):
        if digest == 0:
            return DONE, 0, 0, -1, 0.0
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
            memory.power_given, memory.power_taken = power(model, work)
        else:
            c_m, c_d, c_k = order.c_m, order.c_d, order.c_k
            evaluate(model, work, c_k if c_k > 0.0 else 1.0)
            if what == LINEARIZE:
                linearize(model, work, c_m, c_d, c_k)
            elif what == RATES:
                constraint_rates(model, work)
            else:
                body = factorize_bodies(model, work, c_m, c_d, c_k)
                if body >= 0:
                    return SINGULAR_BODY, 0, 0, body, 0.0
                connection = correction(model, work, c_k, what == CORRECT)
                if connection >= 0:
                    return SINGULAR_CONNECTION, 0, 0, connection, 0.0
        return DONE, 0, 0, -1, 0.0

    return kept_entry(run)


run = make_entry(source_digest(__name__, "lean" if is_lean else "plain"))

SIGNATURE = (types.Array(types.int64, 1, "C"),) * 5

NO_SIZES = dict.fromkeys(("n_t", "n_b", "n_c", "n_q", "n_u", "n_w", "angles", "loads", "body loads"), 0)
ORDER, NOTHING = Order(), zeros(Order(), {})
NO_ROWS = zeros(Rows(), NO_SIZES)


def prepare() -> bool:
    """Load the kernels from the cache, or compile them; return whether they were compiled in this call.

    Otherwise this happens with the first call. Calls after it find everything ready.
    """
    before = sum(run.stats.cache_misses.values())
    run.compile(SIGNATURE)
    return sum(run.stats.cache_misses.values()) > before


def call(model: Model, work: Work, memory: Memory, rows: Rows, **order: float) -> Outcome:
    """Run the entry with a request; unnamed fields are zero, and all arrays live until it returns."""
    if not run.signatures:
        began = time.perf_counter()
        if prepare():
            level = logging.INFO if is_lean else logging.WARNING  # plain numba is unusual, so the user should see it
            log.log(level, "compiled the code of the motion in %.0f s, once: %s", time.perf_counter() - began, words())
    ordered, numbers = table_of_numbers(ORDER, order)
    outcome = run(kept_table_of(model), kept_table_of(work), table_of(memory), table_of(rows), ordered)
    del numbers  # not before
    return Outcome(*outcome)


def no_memory() -> Memory:
    """Return an empty memory, for tasks that need none."""
    return zeros(Memory(), NO_SIZES)


def evaluate_and_linearize(model: Model, work: Work, c_m: float, c_d: float, c_k: float) -> None:
    """Write residuals and derivatives for the iterate in `work`; rows of wrenches weighted by c_k if above 0."""
    call(model, work, no_memory(), NO_ROWS, what=LINEARIZE, c_m=c_m, c_d=c_d, c_k=c_k)


def rates_of_constraints(model: Model, work: Work) -> tuple[Array, Array]:
    """Return for every row the rate of the held quantity, and its second rate at zero u_dot, both (n_w,)."""
    call(model, work, no_memory(), NO_ROWS, what=RATES)
    return work.connections.rate.copy(), work.connections.bias.copy()


def newton_correction(model: Model, work: Work, c_m: float, c_d: float, c_k: float) -> Outcome:
    """Write the Newton correction (y, mu) for the iterate in `work`."""
    return call(model, work, no_memory(), NO_ROWS, what=CORRECT, c_m=c_m, c_d=c_d, c_k=c_k)


def observe_state(model: Model, work: Work, memory: Memory, t: float) -> Rows:
    """Return the results at the state in the memory, and store the power at this state in the memory."""
    rows = new_rows(model, 1)
    call(model, work, memory, rows, what=OBSERVE, t0=t)
    return rows


def count_angles(model: Model, work: Work, memory: Memory, h: float) -> None:
    """Store the angles of the state in the memory, a step of size h after the stored ones."""
    call(model, work, memory, NO_ROWS, what=COUNT, h=h)


def advance_steps(
    model: Model,
    work: Work,
    memory: Memory,
    rows: Rows,
    *,
    t0: float,
    h: float,
    first: int,
    n_steps: int,
    every: int,
    coefficients: tuple[float, float, float, float],
    tolerance: float,
    max_iterations: int,
    length: float,
    most_error: float,
    h_min: float,
    stabilized: bool,
) -> Outcome:
    """Advance the memory by n_steps of the generalized-alpha method; see `kernels.generalized_alpha.advance`."""
    alpha_m, alpha_f, beta, gamma = coefficients
    return call(
        model, work, memory, rows, what=ADVANCE, t0=t0, h=h, first=first, n_steps=n_steps, every=every,
        alpha_m=alpha_m, alpha_f=alpha_f, beta=beta, gamma=gamma, tolerance=tolerance, max_iterations=max_iterations,
        length=length, most_error=most_error, h_min=h_min, stabilized=int(stabilized),
    )  # fmt: skip
