"""Many runs of one system, by `integrate_many` and by a sweep, beside single runs: runs per second, in one run.

    python -m benchmarks.many_runs                       # some two minutes on two cores
    python -m benchmarks.many_runs --runs 1000

The shipped slider-crank of `cms demo`: crank, flexible rod and slider, 800 steps a run, 161 output times; the mass of
the slider varies and the deflection of the rod is measured. A single run reads system and modal file, compiles, starts,
steps with all checks and measures, in a warm process; the better of two rounds before and after the others counts.
Speedups are runs per second over those of single runs. They leave out the start of the processes, which does not depend
on the number of runs; its seconds stand beside them. Two threads show what the lock of the interpreter leaves of them.
"""

import argparse
import os
import tempfile
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace
from pathlib import Path
from time import perf_counter

import numpy as np

from benchmarks.sweep_throughput import files, processor_seconds
from fe_models.foundation.tasks.workers import Workers, tasks_of
from fe_models.foundation.threads import bounded_threads
from floatframe.design.gradients.parameters import with_value
from floatframe.design.many_runs import integrate_many
from floatframe.design.studies.study import StudyPoint, run_study
from floatframe.design.studies.study_file import read_study
from floatframe.engine.kernels.entry import prepare
from floatframe.files.system_file.read_system import read_system
from floatframe.results.sensors import measurement_of
from floatframe.simulation.integrate import integrate

PATH = "bodies.slider.mass"


class Runs:
    """The runs of the study, computed in several ways; each returns the largest deflections, (n,)."""

    def __init__(self, folder: Path, n_runs: int) -> None:
        self.study = read_study(files(folder, n_runs))
        (mass,) = self.study.parameters
        self.mass, self.values = mass, mass.values
        self.system, run = read_system(self.study.system)
        assert run is not None
        self.given, self.every = (run.integrator, run.t_end, run.h), run.output_every

    def single(self, n: int) -> list[float]:
        """Return the results of runs of which each reads its files."""
        return [StudyPoint(self.study)((value,)).outputs[0] for value in self.values[:n]]

    def sweep(self, n: int, workers: Workers) -> list[float]:
        """Return the results of a sweep."""
        study = replace(self.study, parameters=(replace(self.mass, values=self.values[:n]),))
        return list(run_study(study, workers=workers).column("deflection"))

    def many(self, n: int, workers: Workers, watch: str) -> list[float]:
        """Return the results of `integrate_many`."""
        table, options = {PATH: self.values[:n]}, {"output_every": self.every, "watch": watch, "workers": workers}
        return list(integrate_many(self.system, table, *self.given, **options).column("middle", "size").max(axis=1))

    def threads(self, n: int, n_threads: int) -> list[float]:
        """Return the results of runs in threads, without checks."""

        def deflection(mass: float) -> float:
            system = with_value(self.system, PATH, mass)
            motion = integrate(system, *self.given, output_every=self.every, watch="off")
            return float(measurement_of(system, motion, "middle").columns["size"].max())

        with ThreadPoolExecutor(n_threads) as pool:
            return list(pool.map(deflection, self.values[:n]))


def measured(n_runs: int, n_single: int) -> tuple[float, dict[str, float], float]:
    """Return seconds of a single run, of a run of each kind, and of the start of processes; all results are equal."""
    prepare()
    with tempfile.TemporaryDirectory() as folder, bounded_threads(1):
        runs = Runs(Path(folder), n_runs)
        known = np.array(runs.single(n_single))

        def seconds(compute: Callable[[int], list[float]], n: int) -> float:
            begin = perf_counter()
            found = np.array(compute(n))
            elapsed = perf_counter() - begin
            if not np.array_equal(found[:n_single], known[:n]):
                raise RuntimeError("results differ from those of single runs")
            return elapsed / n

        each, alone = {}, seconds(runs.single, n_single)
        with tasks_of(2) as tasks:
            start = 2 * seconds(lambda n: runs.many(n, tasks, "stop"), 2)
            seconds(lambda n: runs.sweep(n, tasks), 2)
            each["sweep, 2 processes"] = seconds(lambda n: runs.sweep(n, tasks), n_runs)
            each["integrate_many, 2 processes"] = seconds(lambda n: runs.many(n, tasks, "stop"), n_runs)
            each["integrate_many without checks, 2 processes"] = seconds(lambda n: runs.many(n, tasks, "off"), n_runs)
        each["integrate_many, 1 process"] = seconds(lambda n: runs.many(n, 1, "stop"), n_single)
        each["integrate_many without checks, 1 process"] = seconds(lambda n: runs.many(n, 1, "off"), n_single)
        each["runs without checks, 2 threads"] = seconds(lambda n: runs.threads(n, 2), n_single)
        return min(alone, seconds(runs.single, n_single)), each, start


def figures(short: bool) -> dict[str, float]:
    """Return what the watch keeps."""
    single, each, start = measured(*((60, 20) if short else (1000, 50)))
    return {f"{name}, runs per second over single runs, speedup": single / time for name, time in each.items()} | {
        "a single run [s]": single,
        "start of two processes [s]": start,
    }


def main() -> None:
    """Measure and print."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--runs", type=int, default=200, help="runs by two processes")
    parser.add_argument("--single", type=int, default=40, help="runs of every other kind")
    asked = parser.parse_args()
    used, begin = processor_seconds(), perf_counter()
    single, each, start = measured(asked.runs, min(asked.single, asked.runs))
    print(f"a single run {1e3 * single:.1f} ms; start of two processes {start:.1f} s; load {os.getloadavg()[0]:.1f}\n")
    print("| kind | a run | runs per second over single runs |\n|---|---|---|")
    for name, time in each.items():
        print(f"| {name} | {1e3 * time:.1f} ms | {single / time:.2f} |")
    share = (processor_seconds() - used) / (perf_counter() - begin)
    print(f"\nresults are those of single runs, bit for bit; {share:.2f} processors were in use on average")


if __name__ == "__main__":
    main()
