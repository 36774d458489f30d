"""Many runs of one system beside single runs: runs per second by the processor.

    python -m benchmarks.many_runs                       # some three minutes on two cores
    python -m benchmarks.many_runs --runs 1000

The shipped slider-crank of `cms demo`: crank, flexible rod and slider, 800 steps a run, 161 output times; the mass of
the slider varies and the deflection of the rod is measured. A single run reads system and modal file, compiles, starts,
steps with the checks of step size and energy, and measures, in a warm process; single runs are repeated between the
other kinds, and the least time counts. Runs without checks have watch = "off". Runs of files give the same deflections
bit for bit, and so do runs of the system in memory. Both agree to 1e-12: a file gives the center of mass as a quotient.

Speedups are runs per second over those of single runs, without the start of the processes, which is the same for any
number of runs. By the processor: time of a single run over that of a run, times the number of processes; this is what
free processors give, and needs no quiet machine. By the clock: as it was. Two threads share one interpreter, so that
only the clock shows what they gain.
"""

import argparse
import os
import tempfile
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace
from pathlib import Path
from time import perf_counter
from typing import NamedTuple

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


class Cost(NamedTuple):
    """What a run of one kind costs."""

    processor: float  #: processor time [s]
    clock: float  #: [s]
    n: int = 1  #: number of processes


class Runs:
    """The runs of a study, computed in several ways; each returns the largest deflections, (n,)."""

    def __init__(self, folder: Path, n_runs: int) -> None:
        self.study = read_study(files(folder, n_runs))
        (self.mass,) = self.study.parameters
        self.system, run = read_system(self.study.system)
        assert run is not None
        self.given, self.every = (run.integrator, run.t_end, run.h), run.output_every

    def single(self, n: int, watch: str = "stop") -> list[float]:
        """Return the results of runs of which each reads its files."""
        study = replace(self.study, given={"run.watch": watch})
        return [StudyPoint(study)((value,)).outputs[0] for value in self.mass.values[:n]]

    def sweep(self, n: int, workers: Workers) -> list[float]:
        """Return the results of a sweep."""
        study = replace(self.study, parameters=(replace(self.mass, values=self.mass.values[:n]),))
        return list(run_study(study, workers=workers).column("deflection"))

    def many(self, n: int, workers: Workers, watch: str) -> list[float]:
        """Return the results of `integrate_many`."""
        found = integrate_many(
            self.system, {PATH: self.mass.values[:n]}, *self.given,
            sensors=["middle"], output_every=self.every, watch=watch, workers=workers,
        )  # fmt: skip
        return list(found.column("middle", "size").max(axis=1))

    def alone(self, mass: float, watch: str) -> float:
        """Return the result of a run in this thread, of the system in memory."""
        system = with_value(self.system, PATH, mass)
        motion = integrate(system, *self.given, output_every=self.every, watch=watch)
        return float(measurement_of(system, motion, "middle").columns["size"].max())

    def threads(self, n: int, n_threads: int) -> list[float]:
        """Return the results of runs without checks in threads."""
        with ThreadPoolExecutor(n_threads) as pool:
            return list(pool.map(lambda mass: self.alone(mass, "off"), self.mass.values[:n]))


def measured(n_runs: int, n_single: int) -> tuple[Cost, dict[str, Cost], float]:
    """Return the costs of a single run and of runs of each kind, and the seconds that two processes take to start."""
    prepare()
    with tempfile.TemporaryDirectory() as folder, bounded_threads(1):
        runs = Runs(Path(folder), n_runs)
        of_files = np.array(runs.single(n_single))
        in_memory = np.array([runs.alone(mass, "stop") for mass in runs.mass.values[:n_single]])
        np.testing.assert_allclose(in_memory, of_files, rtol=1e-12)
        single = Cost(np.inf, np.inf)

        def cost_of(compute: Callable[[int], list[float]], n: int) -> tuple[float, float]:
            used, begin = processor_seconds(), perf_counter()
            found = np.array(compute(n))
            if not any(np.array_equal(found[:n_single], known[: len(found)]) for known in (of_files, in_memory)):
                raise RuntimeError("results differ from those of single runs")
            return processor_seconds() - used, perf_counter() - begin

        def here(compute: Callable[[int], list[float]], n: int = n_single) -> Cost:
            """Return the cost of a run in this process, after single runs."""
            nonlocal single
            processor, clock = cost_of(runs.single, n_single)
            single = Cost(min(single.processor, processor / n_single), min(single.clock, clock / n_single))
            processor, clock = cost_of(compute, n)
            return Cost(processor / n, clock / n)

        def by_processes(compute: Callable[[int, Workers], list[float]]) -> tuple[Cost, float]:
            """Return the cost of a run by two processes, from two numbers of runs, and the seconds of their start."""
            few, totals = max(2, n_runs // 4), []
            for n in (few, n_runs):  # processor time of processes is known when they have ended
                used = processor_seconds()
                with tasks_of(2) as tasks:
                    _, start = cost_of(lambda n: compute(n, tasks), 2)
                    _, clock = cost_of(lambda n: compute(n, tasks), n)
                totals.append(processor_seconds() - used)
            return Cost((totals[1] - totals[0]) / (n_runs - few), clock / n_runs, 2), start

        each = {
            "single run without checks": here(lambda n: runs.single(n, "off")),
            "integrate_many, 1 process": here(lambda n: runs.many(n, 1, "stop")),
            "integrate_many without checks, 1 process": here(lambda n: runs.many(n, 1, "off")),
            "runs without checks, 1 thread": here(lambda n: runs.threads(n, 1)),
            "runs without checks, 2 threads": here(lambda n: runs.threads(n, 2)),
        }
        each["sweep, 2 processes"], _ = by_processes(runs.sweep)
        each["integrate_many, 2 processes"], start = by_processes(lambda n, tasks: runs.many(n, tasks, "stop"))
        each["integrate_many without checks, 2 processes"], _ = by_processes(
            lambda n, tasks: runs.many(n, tasks, "off")
        )
    return single, each, start


def figures(short: bool) -> dict[str, float]:
    """Return what the watch keeps."""
    single, each, _ = measured(*((48, 16) if short else (1000, 50)))
    two = [name for name, cost in each.items() if cost.n == 2]
    found = {f"{name}, speedup": 2 * single.processor / each[name].processor for name in two}
    plain, many = each["single run without checks"], each["integrate_many without checks, 2 processes"]
    return found | {"neither with checks, speedup": 2 * plain.processor / many.processor}


def main() -> None:
    """Measure and print."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--runs", type=int, default=100, help="runs by two processes")
    parser.add_argument("--single", type=int, default=20, help="runs of every other kind")
    asked = parser.parse_args()
    load = os.getloadavg()[0]
    single, each, start = measured(asked.runs, min(asked.single, asked.runs))
    print(f"a single run: {1e3 * single.processor:.1f} ms of the processor, {1e3 * single.clock:.1f} ms by the clock")
    print(f"start of two processes: {start:.1f} s; load before: {load:.1f}\n")
    print("| kind | a run, processor | speedup by the processor | speedup by the clock |\n|---|---|---|---|")
    for name, cost in each.items():
        by_processor = "" if "threads" in name else f"{cost.n * single.processor / cost.processor:.2f}"
        print(f"| {name} | {1e3 * cost.processor:.1f} ms | {by_processor} | {single.clock / cost.clock:.2f} |")


if __name__ == "__main__":
    main()
