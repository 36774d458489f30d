"""The one compiled entry, and a plain function for each thing it does.

One entry, since numba compiles and links everything below an entry once more for each of them.
"""

import logging
import time
from typing import NamedTuple

import numpy as np
from numba import types

from fe_models.foundation.arrays import Array, IntArray
from floatframe.kernels.compiler.choice import is_lean, words
from floatframe.kernels.compiler.compilation import entry
from floatframe.kernels.compiler.sources import source_digest
from floatframe.kernels.compiler.structure import as_memory, as_model, as_rows, as_work, table_of
from floatframe.kernels.connections.connection import constraint_rates
from floatframe.kernels.diagnostics import power
from floatframe.kernels.evaluation import evaluate, linearize
from floatframe.kernels.generalized_alpha import DONE, SINGULAR_BODY, SINGULAR_CONNECTION, advance, write_row
from floatframe.kernels.model import Memory, Model, Rows, Work, new_rows
from floatframe.kernels.schur import correction, factorize_bodies

__all__ = [
    "Outcome",
    "advance_steps",
    "evaluate_and_linearize",
    "newton_correction",
    "observe_state",
    "prepare",
    "rates_of_constraints",
]

log = logging.getLogger(__name__)

LINEARIZE, RATES, CORRECT, OBSERVE, ADVANCE = range(5)


class Outcome(NamedTuple):
    """What an entry reports."""

    status: int  #: DONE, DIVERGED, SINGULAR_BODY, SINGULAR_CONNECTION or INACCURATE
    n_steps: int  #: done
    n_rows: int  #: written
    singular: int  #: number of the body or connection that is
    excess: float  #: size of the last correction by the allowed one


def make_entry(digest):
    """Return the cached entry; the digest of the sources enters its key, see the package docstring."""

    def run(what, model_table, work_table, memory_table, rows_table, numbers, integers, out):
        if digest == 0:
            return DONE, 0, 0, -1, 0.0
        model, work = as_model(model_table), as_work(work_table)
        memory, rows = as_memory(memory_table), as_rows(rows_table)
        if what == ADVANCE:
            return advance(
                model,
                work,
                memory,
                numbers[0],
                numbers[1],
                integers[0],
                integers[1],
                integers[2],
                numbers[6:10],
                numbers[2],
                integers[3],
                numbers[3],
                numbers[4],
                numbers[5],
                rows,
            )
        if what == OBSERVE:
            work.counts[4] = 0
            write_row(model, work, memory, numbers[0], rows)
            memory.power[0], memory.power[1] = power(model, work)
        else:
            c_m, c_d, c_k = numbers[0], numbers[1], numbers[2]
            evaluate(model, work, c_k if c_k > 0.0 else 1.0)
            if what == LINEARIZE:
                linearize(model, work, c_m, c_d, c_k)
            elif what == RATES:
                constraint_rates(model, work, out[0], out[1])
            else:
                body = factorize_bodies(model, work, c_m, c_d, c_k)
                if body >= 0:
                    return SINGULAR_BODY, 0, 0, body, 0.0
                connection = correction(model, work, c_k, what == CORRECT)
                if connection >= 0:
                    return SINGULAR_CONNECTION, 0, 0, connection, 0.0
        return DONE, 0, 0, -1, 0.0

    try:
        return entry(run)
    except RuntimeError:  # nowhere to keep the cache: compiled anew in each process
        return entry(run, cache=False)


run = make_entry(source_digest(__name__, "lean" if is_lean else "plain"))

TABLE = types.Array(types.int64, 1, "C")
SIGNATURE = (
    types.int64,
    *[TABLE] * 4,
    types.Array(types.float64, 1, "C"),
    types.Array(types.int64, 1, "C"),
    types.Array(types.float64, 2, "C"),
)

NOTHING = np.zeros(0)
NO_INTEGERS = np.zeros(0, np.int64)
NO_OUT = np.zeros((0, 0))


def prepare() -> bool:
    """Load the kernels from the cache, or compile them; return whether they were compiled now.

    Otherwise this happens with the first call. Calls after it find everything ready.
    """
    before = sum(run.stats.cache_misses.values())
    run.compile(SIGNATURE)
    return sum(run.stats.cache_misses.values()) > before


def call(
    what: int, model: Model, work: Work, memory: Memory, rows: Rows, numbers: Array, integers: IntArray, out: Array
) -> Outcome:
    """Run the entry; all arrays live until it returns."""
    if not run.signatures:
        began = time.perf_counter()
        if prepare():
            level = logging.INFO if is_lean else logging.WARNING  # what is not as usual is said
            log.log(level, "compiled the code of the motion in %.0f s, once: %s", time.perf_counter() - began, words())
    tables = [table_of(data) for data in (model, work, memory, rows)]
    return Outcome(*run(what, *tables, numbers, integers, out))


def no_memory() -> Memory:
    """Return an empty memory, for what needs none."""
    return Memory(np.zeros((0, 3)), np.zeros((0, 4)), *(np.zeros(0) for _ in range(8)))


def evaluate_and_linearize(model: Model, work: Work, c_m: float, c_d: float, c_k: float) -> None:
    """Write residuals and derivatives for the iterate in `work`; rows of wrenches weighted by c_k if above 0."""
    numbers = np.array([c_m, c_d, c_k])
    call(LINEARIZE, model, work, no_memory(), new_rows(model, 0), numbers, NO_INTEGERS, NO_OUT)


def rates_of_constraints(model: Model, work: Work) -> tuple[Array, Array]:
    """Return for every row the rate of the held quantity, and its second rate at zero u_dot, both (n_w,)."""
    out = np.zeros((2, len(work.w)))
    call(RATES, model, work, no_memory(), new_rows(model, 0), np.zeros(3), NO_INTEGERS, out)
    return out[0], out[1]


def newton_correction(model: Model, work: Work, c_m: float, c_d: float, c_k: float) -> Outcome:
    """Write the Newton correction (y, mu) for the iterate in `work`."""
    numbers = np.array([c_m, c_d, c_k])
    return call(CORRECT, model, work, no_memory(), new_rows(model, 0), numbers, NO_INTEGERS, NO_OUT)


def observe_state(model: Model, work: Work, memory: Memory, t: float) -> Rows:
    """Return the results at the state in the memory; the power at it goes into the memory."""
    rows = new_rows(model, 1)
    call(OBSERVE, model, work, memory, rows, np.array([t]), NO_INTEGERS, NO_OUT)
    return rows


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
) -> Outcome:
    """Advance the memory by n_steps of the generalized-alpha method; see `kernels.generalized_alpha.advance`."""
    numbers = np.array([t0, h, tolerance, length, most_error, h_min, *coefficients])
    integers = np.array([first, n_steps, every, max_iterations], np.int64)
    return call(ADVANCE, model, work, memory, rows, numbers, integers, NO_OUT)
