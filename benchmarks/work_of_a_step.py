"""Floating-point operations of a step, and the rate they are done at by the peak of one core.

    OMP_NUM_THREADS=1 python -m benchmarks.work_of_a_step

The systems of `benchmarks.floatframe_step`: one flexible body on a hinge, and a chain of ten, with 8, 20 and 50 modes.
Operations are counted, not estimated: the kernels run as plain Python, in a process of its own, on numbers that count
every sum, difference, product and quotient that is done with them; no power, root or function of an angle is counted.
The peak is the rate of a product of two matrices of order 2000 in one thread, a product and a sum for each term. Time
is processor time of compiled steps, the best of five runs.
"""

import json
import os
import subprocess
import sys
import time
from types import SimpleNamespace

import numpy as np

CASES = ((1, 8), (1, 20), (1, 50), (10, 8), (10, 20), (10, 50))
SHORT = CASES[:2]
STEPS = 10  #: that are counted, after a few that are not
COUNTED = "count"  #: how the counting process is called

n_operations = 0


class Counted(float):
    """A number that counts what is done with it."""

    __slots__ = ()


def counting(name):
    """Return an operation of `float` that counts."""
    plain = getattr(float, name)

    def operation(self, other):
        global n_operations
        result = plain(self, other)
        if result is NotImplemented:
            return result
        n_operations += 1
        return Counted(result)

    return operation


for each in ("add", "sub", "mul", "truediv"):
    for name in (f"__{each}__", f"__r{each}__"):
        setattr(Counted, name, counting(name))
Counted.__neg__ = lambda self: Counted(float.__neg__(self))  # a change of sign is no operation
Counted.__abs__ = lambda self: Counted(float.__abs__(self))


def of_counted(record):
    """Return a record of arrays as one of counting numbers; single numbers as such, so that they can be set."""
    result = SimpleNamespace()
    for name, value in zip(record._fields, record, strict=True):
        if hasattr(value, "_fields"):
            new = of_counted(value)
        elif value.dtype != float:
            new = int(value) if value.ndim == 0 else value.copy()
        elif value.ndim == 0:
            new = Counted(value)
        else:
            new = np.empty(value.shape, object)
            new.reshape(-1)[:] = [Counted(x) for x in value.reshape(-1)]
        setattr(result, name, new)
    return result


def put_back(record, counted):
    """Write the numbers of such a record into the arrays it was made of."""
    for name, value in zip(record._fields, record, strict=True):
        if hasattr(value, "_fields"):
            put_back(value, getattr(counted, name))
        else:
            value[...] = np.asarray(getattr(counted, name)).astype(value.dtype)


def counts(cases):
    """Return operations, iterations and factorisations of a step of each case; in a process without compiled code."""
    from benchmarks.floatframe_step import H, chain, counts_of
    from floatframe import GeneralizedAlpha
    from floatframe.engine.compiling.system import compiled_system
    from floatframe.engine.kernels import entry
    from floatframe.engine.kernels.records import filled, zeros
    from floatframe.engine.kernels.work import new_work

    def call(kernels, model, work, memory=entry.NO_MEMORY, rows=entry.NO_ROWS, **order):
        records = model, work, memory, rows, filled(entry.Order(), **(zeros(entry.Order(), {})._asdict() | order))
        counted = [of_counted(record) for record in records]
        outcome = entry.Outcome(*kernels.compiled(*counted))
        for record, each in zip(records[1:4], counted[1:4], strict=True):
            put_back(record, each)
        return outcome

    entry.CompiledEntry.__call__ = call
    for name in ("as_model", "as_work", "as_memory", "as_rows", "as_order"):
        setattr(entry, name, lambda record: record)
    told = []
    for n_bodies, n_q in cases:
        system, method = chain(n_bodies, n_q), GeneralizedAlpha(0.8)
        memory, work = method.start(system, 0.0), new_work(compiled_system(system).model)
        memory, *_ = method.advance(system, memory, work, t0=0.0, h=H, first=0, n_steps=3, every=100)
        before, counts_before = n_operations, counts_of(memory, work)
        after, *_ = method.advance(system, memory, work, t0=0.0, h=H, first=3, n_steps=STEPS, every=100)
        iterations, factorisations = (counts_of(after, work) - counts_before) / STEPS
        told.append(((n_operations - before) / STEPS, iterations, factorisations))
    return told


def peak():
    """Return the rate of a product of matrices in one thread [1/s]."""
    n, best = 2000, np.inf
    A = np.random.default_rng(0).standard_normal((n, n))
    for _ in range(5):
        start = time.thread_time()
        A @ A
        best = min(best, time.thread_time() - start)
    return 2 * n**3 / best


def measured(cases):
    """Return a record of each case, and the peak."""
    environment = os.environ | {"NUMBA_DISABLE_JIT": "1", "FLOATFRAME_COMPILER": "plain"}
    command = [sys.executable, "-m", "benchmarks.work_of_a_step", COUNTED, json.dumps(cases)]
    output = subprocess.run(command, env=environment, stdout=subprocess.PIPE, text=True, check=True).stdout
    from benchmarks.floatframe_step import chain, measure

    told = []
    for (n_bodies, n_q), (operations, iterations, factorisations) in zip(cases, json.loads(output), strict=True):
        (seconds,), _ = measure([chain(n_bodies, n_q)], 1000 // n_bodies, 5)
        told.append((n_bodies, n_q, operations, iterations, factorisations, seconds))
    return told, peak()


def figures(short):
    """Return what the watch keeps."""
    told, most = measured(SHORT if short else CASES)
    return {
        f"a step over its operations at the peak of a core, bodies: {n_bodies}, modes: {n_q}": seconds
        * most
        / operations
        for n_bodies, n_q, operations, _, _, seconds in told
    }


def main():
    told, most = measured(CASES)
    print(f"peak of one core: {most / 1e9:.1f} GFlop/s")
    print("bodies  modes  operations a step  iterations  factorisations  us/step  GFlop/s  of the peak")
    for n_bodies, n_q, operations, iterations, factorisations, seconds in told:
        rate = operations / seconds
        print(
            f"{n_bodies:6d} {n_q:6d} {operations:18.0f} {iterations:11.2f} {factorisations:15.2f} "
            f"{1e6 * seconds:8.1f} {rate / 1e9:8.2f} {100 * rate / most:11.1f} %"
        )


if __name__ == "__main__":
    if sys.argv[1:2] == [COUNTED]:
        print(json.dumps(counts(json.loads(sys.argv[2]))))
    else:
        main()
