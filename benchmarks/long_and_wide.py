"""Wide systems and long runs: what grows faster than the system, memory, and what results cost.

    python -m benchmarks.long_and_wide [--short]

Wide: pendulum chains of rigid rods (to 1000), of flexible rods with 20 modes (to 200), and closed loops of rods on ball
joints between two supports (to 99 constraints). Printed for each size, in processor time: description to arrays,
consistent start, one step of 1 ms with its factorisation shared by the steps of a run; memory of the compiled model, of
the working arrays, and of one row of results. The exponent is that of a power of the size through the first and the
last row, "between" that of the last two.

Long: steps of 10 us with results at 10 kHz into a file, in turn with the same run without results (its last row only):
processor and wall time of both, and the peak memory of the process before and after.
"""

import argparse
import resource
import tempfile
import time
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from benchmarks.relative_coordinates import beam
from floatframe import GeneralizedAlpha, Gravity, Marker, RigidBody, SphericalJoint, System, integrate
from floatframe.components.mechanisms import chain
from floatframe.engine.compiling.system import compiled_system
from floatframe.engine.kernels.memory import new_rows
from floatframe.engine.kernels.work import new_work

H = 1e-3  #: [s] of a step of the wide systems
LONG_H, PERIOD = 1e-5, 1e-4  #: [s] of a step of the long run, and between its results
MODES = 20


@dataclass(frozen=True)
class Cost:
    """What a system of some size costs."""

    size: int  #: bodies, or constraints
    compiling: float  #: description to arrays [s]
    starting: float  #: consistent start [s]
    step: float  #: [s]
    iterations: float  #: of a step
    model: int  #: memory of the compiled model [B]
    work: int  #: of the working arrays [B]
    row: int  #: of a row of results [B]

    @property
    def iteration(self) -> float:
        """Cost of an iteration of Newton's method, with its share of the step [s]."""
        return self.step / self.iterations


def memory_of(record) -> int:
    """Return the bytes of all arrays of a record of records."""
    return record.nbytes if isinstance(record, np.ndarray) else sum(map(memory_of, record))


def cost(size: int, system: System, n_steps: int, n_runs: int = 3) -> Cost:
    """Return what a system costs, the kernels being compiled; a step is the best of some runs."""
    method = GeneralizedAlpha(0.8)
    t0 = time.process_time()
    model = compiled_system(system).model
    t1 = time.process_time()
    carry = method.start(system, 0.0)
    t2 = time.process_time()
    work = new_work(model)
    best, iterations = np.inf, 0.0
    for _ in range(n_runs):
        before, began = carry.n_iterations, time.process_time()
        carry, _, _, failure = method.advance(system, carry, work, t0=0.0, h=H, first=0, n_steps=n_steps, every=n_steps)
        assert failure is None, failure
        best = min(best, (time.process_time() - began) / n_steps)
        iterations = (carry.n_iterations - before) / n_steps
    memory = [memory_of(each) for each in (model, work, new_rows(model, 1))]
    return Cost(size, t1 - t0, t2 - t1, best, iterations, *memory)


def rigid_chain(n: int) -> System:
    """Return a chain of n rigid rods on hinges, level at first."""
    return chain(n, length=0.2)


def flexible_chain(n: int) -> System:
    """Return a chain of n flexible rods with 20 modes on hinges."""
    return chain(n, rod=rod())


def rod():
    """Return the flexible rod, made once."""
    if not ROD:
        body = beam(MODES - 6)  # constraint modes of both ends, without rigid motions, are six more
        assert body.n_q == MODES, body.n_q
        ROD.append(body)
    return ROD[0]


ROD: list = []


def closed_loop(n_constraints: int) -> System:
    """Return a loop of rods on ball joints between two supports, which has so many constraints, three a joint."""
    n = n_constraints // 3 - 1
    angle = np.linspace(0.0, np.pi, n + 1)
    places = np.stack([-np.cos(angle), -np.sin(angle), 0.3 * np.sin(2 * angle)], axis=1)
    bodies, joints, last = [], [], Marker("ground", position=tuple(places[0]))
    for k in range(n):
        half = 0.5 * (places[k + 1] - places[k])
        bodies.append(RigidBody(f"rod {k + 1}", 1.0, 0.02 * np.eye(3), position=0.5 * (places[k] + places[k + 1])))
        joints.append(SphericalJoint(f"ball {k + 1}", last, Marker(f"rod {k + 1}", position=tuple(-half))))
        last = Marker(f"rod {k + 1}", position=tuple(half))
    joints.append(SphericalJoint(f"ball {n + 1}", last, Marker("ground", position=tuple(places[-1]))))
    return System(bodies, joints, [Gravity((0.0, -9.81, 0.0))])


FAMILIES = {
    "rigid rods": (rigid_chain, (125, 250, 500, 1000), (125, 500, 1000)),
    "flexible rods, 20 modes": (flexible_chain, (25, 50, 100, 200), (25, 100, 200)),
    "constraints of a closed loop": (closed_loop, (12, 24, 48, 99), (12, 48, 99)),
}


def wide(name: str, short: bool) -> list[Cost]:
    """Return the costs of a family of systems."""
    make, sizes, fewer = FAMILIES[name]
    sizes = fewer if short else sizes
    cost(sizes[0], make(sizes[0]), 2, 1)  # what is done once in a process
    return [cost(n, make(n), max(4000 // n, 10)) for n in sizes]


def exponent(costs: list[Cost], what: str, first: int = 0) -> float:
    """Return the exponent of the power of the size that a cost grows by, from one of the rows to the last."""
    a, b = costs[first], costs[-1]
    return float(np.log(getattr(b, what) / getattr(a, what)) / np.log(b.size / a.size))


def run_of(system: System, n_steps: int, output: Path | None, every: int) -> tuple[float, float]:
    """Return processor and wall time of a run [s]."""
    cpu, wall = time.process_time(), time.perf_counter()
    integrate(system, GeneralizedAlpha(0.8), n_steps * LONG_H, LONG_H, output=output, output_every=every)
    return time.process_time() - cpu, time.perf_counter() - wall


def long_run(n_steps: int, n_bodies: int = 1, with_rod: bool = True) -> dict[str, float]:
    """Return times without and with results, the file and the peak of memory before and after."""
    system = flexible_chain(n_bodies) if with_rod else rigid_chain(n_bodies)
    every = round(PERIOD / LONG_H)
    with tempfile.TemporaryDirectory(prefix="long-") as folder:
        run_of(system, 1000, Path(folder) / "warm.h5", every)
        before = peak()
        without = run_of(system, n_steps, None, n_steps)
        path = Path(folder) / "motion.h5"
        with_results = run_of(system, n_steps, path, every)
        return {
            "without": without[0], "with": with_results[0], "without, wall": without[1], "with, wall": with_results[1],
            "file": path.stat().st_size, "peak before": before, "peak after": peak(),
        }  # fmt: skip


def peak() -> float:
    """Return the peak of memory of this process [B]."""
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss * 1024.0


def figures(short: bool) -> dict[str, float]:
    """Return exponents of the step, the start and the compilation, and the speed with results by that without."""
    found = {}
    for name in FAMILIES:
        costs = wide(name, short)
        found[f"iteration of {name}, exponent"] = exponent(costs, "iteration")
        found[f"start of {name}, exponent"] = exponent(costs, "starting")
    times = long_run(20_000 if short else 1_000_000)
    found["run with results by one without"] = times["with"] / times["without"]
    return found


def main() -> None:
    """Print the tables."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--short", action="store_true", help="fewer sizes, 20 000 steps in place of a million")
    parser.add_argument("--wide", action="store_true", help="wide systems only")
    parser.add_argument("--long", action="store_true", help="the long run only")
    options = parser.parse_args()
    for name in () if options.long else FAMILIES:
        costs = wide(name, options.short)
        print(f"{name}: size, compile [ms], start [ms], step [us], iterations, model [MB], work [MB], row [kB]")
        for each in costs:
            print(
                f"  {each.size:5d} {1e3 * each.compiling:8.1f} {1e3 * each.starting:8.1f} {1e6 * each.step:9.1f} "
                f"{each.iterations:5.2f} {each.model / 1e6:8.2f} {each.work / 1e6:8.2f} {each.row / 1e3:8.2f}"
            )
        words = [f"{what} {exponent(costs, what):.2f} (between {exponent(costs, what, -2):.2f})"
                 for what in ("compiling", "starting", "step", "iteration")]  # fmt: skip
        print(f"  exponents: {', '.join(words)}")
    if options.wide:
        return
    n_steps = 20_000 if options.short else 1_000_000
    for title, with_rod in (("one rigid rod", False), ("one flexible rod, 20 modes", True)):
        times = long_run(n_steps, with_rod=with_rod)
        print(
            f"{title}, {n_steps} steps: {times['without']:.2f} s without results, {times['with']:.2f} s with those of "
            f"10 kHz: {100 * times['without'] / times['with']:.0f} % of the speed (wall {times['without, wall']:.2f} "
            f"and {times['with, wall']:.2f} s)\n  file {times['file'] / 1e6:.1f} MB, peak memory "
            f"{times['peak before'] / 1e6:.0f} MB before, {times['peak after'] / 1e6:.0f} MB after"
        )


if __name__ == "__main__":
    main()
