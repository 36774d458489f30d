"""What generated code costs: `python -m benchmarks.generated` (a C compiler as `cc`; SymPy from the extra `test`).

Operations of a robot of six axes with the geometry of a PUMA 560 and general links; processor time of an evaluation of
the C code, compiled by `cc -O2`, beside the compiled general routine, each in a loop of its own; and the times of
single calls of inverse dynamics by the clock, one after the other, among all else that the machine does.
"""

import argparse
import ctypes
import subprocess
import tempfile
from pathlib import Path

import numpy as np

import floatframe as ff
from benchmarks.recursive import compiled, moving, shortest
from floatframe.generation.generate import GeneratedCode
from floatframe.relative.recursion.entry import FORWARD, INVERSE, MASS, TANGENTS
from tests.floatframe.identification.robots import six_axes

TASKS = {"inverse": INVERSE, "mass": MASS, "forward": FORWARD, "jacobian": TANGENTS}
LOOP = """
#include <time.h>
#include "%(name)s.h"

/* so many calls; a number goes round, so that none can be left out */
void loop(long times, double *in, double *out)
{
    for (long k = 0; k < times; k++) {
        %(name)s(%(arguments)s);
        in[0] += 1e-12 * out[0];
    }
}

/* the time of each call in nanoseconds */
void clocked(long times, double *in, double *out, double *took)
{
    struct timespec a, b;
    for (long k = 0; k < times; k++) {
        clock_gettime(CLOCK_MONOTONIC, &a);
        %(name)s(%(arguments)s);
        clock_gettime(CLOCK_MONOTONIC, &b);
        took[k] = 1e9 * (double)(b.tv_sec - a.tv_sec) + (double)(b.tv_nsec - a.tv_nsec);
        in[0] += 1e-12 * out[0];
    }
}
"""


def library(code: GeneratedCode, n_in: list[int], n_out: list[int], folder: Path) -> ctypes.CDLL:
    """Return the code compiled with loops around it; inputs and outputs one after the other."""
    starts = [
        [f"{name} + {sum(sizes[:k])}" for k in range(len(sizes))] for name, sizes in (("in", n_in), ("out", n_out))
    ]
    text = LOOP % {"name": code.name, "arguments": ", ".join([*starts[0], *starts[1]])}
    path = code.write(folder)[0]
    (folder / f"{code.name}_loop.c").write_text(text)
    made = folder / f"{code.name}.so"
    sources = [str(path), str(folder / f"{code.name}_loop.c")]
    subprocess.run(["cc", "-O2", "-Wall", "-Werror", "-shared", "-fPIC", *sources, "-o", str(made), "-lm"], check=True)
    return ctypes.CDLL(str(made))


def pointer(array: np.ndarray) -> ctypes.c_void_p:
    """Return an array as C takes it."""
    return ctypes.c_void_p(array.ctypes.data)


def main() -> None:
    """Print all tables."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--calls", type=int, default=1_000_000, help="of which quantiles are taken")
    calls = parser.parse_args().calls
    system = six_axes()
    model = moving(ff.relative_model(system))
    n = model.n_rates
    z, v, a = model.work.x.copy(), model.work.v.copy(), model.work.a.copy()
    inputs = {"inverse": (z, v, a), "mass": (z,), "forward": (z, v, a), "jacobian": (z, v, a)}
    outputs = {"inverse": [n], "mass": [n * n], "forward": [n], "jacobian": [n * n] * 3}
    print("            operations          general recursion    µs of a call         ratio")
    print("            +        *          +        *           generated  compiled")
    with tempfile.TemporaryDirectory() as name:
        for what, task in TASKS.items():
            code = ff.generate(system, what=what, name=f"robot_{what}")
            given, out = np.concatenate(inputs[what]), np.zeros(sum(outputs[what]))
            made = library(code, [len(each) for each in inputs[what]], outputs[what], Path(name))
            ours = shortest(lambda times: made.loop(ctypes.c_long(times), pointer(given), pointer(out)))  # noqa: B023
            general = compiled(model, task)
            count = code.operations
            print(
                f"{what:11s} {count.additions:<8d} {count.multiplications:<10d} {code.general[0]:<8d} "
                f"{code.general[1]:<11d} {ours:<10.3f} {general:<9.3f} {general / ours:.1f}"
            )
            if what == "inverse":
                took = np.zeros(calls)
                made.clocked(ctypes.c_long(calls), pointer(given), pointer(out), pointer(took))
                quantiles = np.median(took), np.quantile(took, 0.999), took.max()
        print(f"inverse, {calls} calls by the clock: median, 99.9 %, worst [ns]:", *(f"{q:.0f}" for q in quantiles))


if __name__ == "__main__":
    main()
