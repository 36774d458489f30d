"""What generated code costs: `python -m benchmarks.generated` (a C compiler as `cc`; SymPy from the extra `test`).

Trees: a robot of six axes with the geometry of a PUMA 560 and general links; the road car with rigid bodies, its mounts
fixed, its rods left out and its loops cut where the relative formulation cuts them; flexible arms. Operations;
processor time of an evaluation of the C code, compiled by `cc -O2` and by `cc -O2 -march=native`, beside the general
routine, which is compiled for this processor, each in a loop of its own; single calls of inverse dynamics one after the
other by the clock, among all else that the machine does, and by that of the processor, whose reading takes longer.
Operations of the robot beside those of SymPy's common subexpressions, and of a robot with the geometry of a Staubli
RX 90 whose moments stay symbols, without gravity, beside those of the equations that OpenSYMORO printed for it.
"""

import argparse
import ctypes
import subprocess
import tempfile
from collections.abc import Callable
from dataclasses import replace
from functools import partial
from pathlib import Path

import numpy as np

import floatframe as ff
from benchmarks.recursive import compiled, moving, shortest
from cms.jobs.decks.job_text import toml_text
from fe_models.foundation.parametric_file import read_parametric
from floatframe.design.generation.generate import GeneratedCode
from floatframe.engine.tree.recursion.entry import FORWARD, INVERSE, MASS, TANGENTS
from floatframe.engine.tree.topology import tree_of
from floatframe.files.system_file.read_system import read_system
from floatframe.machines import machine_files
from tests.floatframe.design.generation.flexible_systems import (
    bent_motion,
    dense_body,
    flexible_in_the_middle,
    pendulum,
    two_link_arm,
)
from tests.floatframe.design.generation.sympy_count import sympy_operations
from tests.floatframe.design.identification.robots import six_axes

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

/* the time of each call in nanoseconds, by the clock or by that of the processor; is_idle: of none */
void clocked(int is_processor, int is_idle, long times, double *in, double *out, double *took)
{
    const clockid_t clock = is_processor ? CLOCK_THREAD_CPUTIME_ID : CLOCK_MONOTONIC;
    struct timespec a, b;
    for (long k = 0; k < times; k++) {
        clock_gettime(clock, &a);
        if (!is_idle) {
            %(name)s(%(arguments)s);
        }
        clock_gettime(clock, &b);
        took[k] = 1e9 * (double)(b.tv_sec - a.tv_sec) + (double)(b.tv_nsec - a.tv_nsec);
        in[0] += 1e-12 * out[0];
    }
}
"""


TURNS = 3  #: in which all are measured one after the other, since others compute meanwhile
SWITCHES = (("-O2",), ("-O2", "-march=native"))
RX_90 = {"angles": (0, 90, 0, -90, 90, -90), "along_x": (0, 0, 0.45, 0, 0, 0), "along_z": (0, 0, 0, 0.45, 0, 0)}


def road_car() -> ff.System:
    """Return the rigid tree of the road car: 20 bodies, 31 rates."""
    shipped = next(path for path in machine_files("road-car") if path.name == "lane_change_bars.toml")
    tables = dict(read_parametric(shipped, ff.errors.ModelError))
    J = np.diag([450.0, 1500.0, 1650.0]).tolist()
    tables["bodies"]["chassis"] = {"mass": 1100.0, "inertia": J, "center_of_mass": [0, 0, 0.5]}
    joints = {name: each for name, each in tables["joints"].items() if each["type"] != "distance"}
    for axle in ("front", "rear"):
        ends = {"body_a": "chassis", "marker_a": [0, 0, 0], "body_b": f"subframe_{axle}", "marker_b": [0, 0, 0]}
        joints[f"mount_{axle}"] = {"type": "fixed"} | ends
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "car.toml"
        path.write_text(toml_text({"system": tables["system"], "bodies": tables["bodies"], "joints": joints}))
        system = read_system(path)[0]
    cut = tree_of(system).cut
    return replace(system, joints=[each for each in system.joints if each.name not in cut])


def library(code: GeneratedCode, n_in: list[int], n_out: list[int], folder: Path, *switches: str) -> ctypes.CDLL:
    """Return the code compiled with loops around it; inputs and outputs one after the other."""
    starts = [
        [f"{name} + {sum(sizes[:k])}" for k in range(len(sizes))] for name, sizes in (("in", n_in), ("out", n_out))
    ]
    text = LOOP % {"name": code.name, "arguments": ", ".join([*starts[0], *starts[1]])}
    path = code.write(folder)[0]
    (folder / f"{code.name}_loop.c").write_text(text)
    made = folder / f"{code.name}{''.join(switches)}.so"
    sources = [str(path), str(folder / f"{code.name}_loop.c")]
    command = ["cc", *switches, "-Wall", "-Werror", "-shared", "-fPIC", *sources, "-o", str(made), "-lm"]
    subprocess.run(command, check=True)
    return ctypes.CDLL(str(made))


def pointer(array: np.ndarray) -> ctypes.c_void_p:
    """Return an array as C takes it."""
    return ctypes.c_void_p(array.ctypes.data)


def looped(made: ctypes.CDLL, given: np.ndarray, out: np.ndarray, times: int) -> None:
    """Call so many times."""
    made.loop(ctypes.c_long(times), pointer(given), pointer(out))


def bent(model: ff.analyses.RelativeModel) -> ff.analyses.RelativeModel:
    """Return a model of flexible bodies with a motion in its working arrays, elastic rotations of half a radian."""
    model.take(*bent_motion(model, 0, angle=0.5))
    return model


def costs(model: ff.analyses.RelativeModel, calls: int, folder: Path) -> None:
    """Print operations and times of one system; a motion is in the working arrays of its model."""
    system, n = model.expansion.system, model.n_rates
    z, v, a = model.work.x.copy(), model.work.v.copy(), model.work.a.copy()
    inputs = {"inverse": (z, v, a), "mass": (z,), "forward": (z, v, a), "jacobian": (z, v, a)}
    outputs = {"inverse": [n], "mass": [n * n], "forward": [n], "jacobian": [n * n] * 3}
    print("            operations          general recursion    µs of a call                     ratio")
    print("            +        *          +        *           -O2      native   compiled       -O2   native")
    for what, task in TASKS.items():
        code = ff.design.generate(system, what=what, name=f"tree_{what}")
        out = np.zeros(sum(outputs[what]))
        sizes = [len(each) for each in inputs[what]], outputs[what]
        runs: list[Callable[[int], object]] = [partial(model.run, task)]
        for switches in SWITCHES:
            made, given = library(code, *sizes, folder, *switches), np.concatenate(inputs[what])
            runs.append(partial(looped, made, given, out))
            if what == "inverse" and switches == ("-O2",):
                single = single_calls(made, calls, given, out)
        turns = [[shortest(run) for run in runs] for _ in range(TURNS)]
        general, *times = (min(each) for each in zip(*turns, strict=True))
        count = code.operations
        print(
            f"{what:11s} {count.additions:<8d} {count.multiplications:<10d} {code.general[0]:<8d} "
            f"{code.general[1]:<11d} {times[0]:<8.3f} {times[1]:<8.3f} {general:<14.3f} {general / times[0]:<5.1f} "
            f"{general / times[1]:.1f}"
        )
    print(f"inverse by -O2, {calls} single calls, median, 99.9 %, worst [ns]; of them the median without a call")
    for clock, took, idle in single:
        quantiles = np.median(took), np.quantile(took, 0.999), took.max(), np.median(idle)
        print(f"{clock:22s}" + "".join(f"{q:10.0f}" for q in quantiles))


def single_calls(made: ctypes.CDLL, calls: int, given: np.ndarray, out: np.ndarray) -> list[tuple]:
    """Return the times of single calls by the clock and by that of the processor, and those of none [ns]."""
    result = []
    for is_processor, words in enumerate(("by the clock", "by the processor's")):
        times = np.zeros((2, calls))
        for is_idle, took in enumerate(times):
            arrays = (pointer(each) for each in (given, out, took))
            made.clocked(is_processor, is_idle, ctypes.c_long(calls), *arrays)
        result.append((words, *times))
    return result


def beside_others() -> None:
    """Print operations of inverse dynamics beside those of other programs."""
    print("\noperations of inverse dynamics     ours: +    *      theirs: +    *")
    ours, theirs = ff.design.generate(six_axes(), language="python", name="f"), sympy_operations(six_axes())
    row = f"{ours.operations.additions:<4d} {ours.operations.multiplications:<12d} {theirs[0]:<4d} {theirs[1]}"
    print(f"PUMA 560, SymPy's cse              {row}")
    rx_90 = ff.design.generate(six_axes(**RX_90, gravity=(0, 0, 0)), parameters=["link*"]).operations
    print(f"RX 90, moments symbols, OpenSYMORO {rx_90.additions:<4d} {rx_90.multiplications:<12d} {276:<4d} {325}")
    rx_90 = ff.design.generate(six_axes(**RX_90, gravity=(0, 0, 0))).operations
    print(f"RX 90, moments numbers             {rx_90.additions:<4d} {rx_90.multiplications}")


def figures(short: bool) -> dict[str, float]:
    """Return what the watch keeps: of the robot of six axes."""
    model = moving(ff.analyses.relative_model(six_axes()))
    z, v, a = model.work.x.copy(), model.work.v.copy(), model.work.a.copy()
    code = ff.design.generate(model.expansion.system, what="inverse", name="robot")
    n, out = model.n_rates, np.zeros(model.n_rates)
    with tempfile.TemporaryDirectory() as folder:
        made = library(code, [len(z), n, n], [n], Path(folder), "-O2")
        given = np.concatenate([z, v, a])
        turns = [(compiled(model, INVERSE), shortest(partial(looped, made, given, out))) for _ in range(TURNS)]
    general, generated = (min(each) for each in zip(*turns, strict=True))
    count = code.operations
    return {
        "generated inverse dynamics of a 6R robot (-O2) against the general routine, speedup": general / generated,
        "operations of it over those without generation": (count.additions + count.multiplications) / sum(code.general),
    }


def main() -> None:
    """Print all tables."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--calls", type=int, default=1_000_000, help="of which quantiles are taken")
    calls = parser.parse_args().calls
    models = {
        "robot of six axes": moving(ff.analyses.relative_model(six_axes())),
        "road car, 20 bodies, 31 rates": moving(ff.analyses.relative_model(road_car())),
        "arm of two clamped beams, 4 modes each": bent(ff.analyses.relative_model(two_link_arm())),
        "beam in mean axes on a hinge, 6 modes, geometric stiffness": bent(ff.analyses.relative_model(pendulum())),
        "rigid link, such a beam with 4 modes, rigid tool": bent(ff.analyses.relative_model(flexible_in_the_middle())),
        "body on a hinge, 8 modes without a zero in its invariants": bent(ff.analyses.relative_model(dense_body())),
    }
    for title, model in models.items():
        print(f"\n{title}")
        with tempfile.TemporaryDirectory() as folder:
            costs(model, calls, Path(folder))
    beside_others()


if __name__ == "__main__":
    main()
