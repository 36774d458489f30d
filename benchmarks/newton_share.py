"""The share of Newton's method in the error of a step: what the tolerance leaves, by the error of the step size.

    python -m benchmarks.newton_share            # a minute

Rigid and flexible systems, the slider-crank of `cms demo` and shipped machines, by generalized-alpha at the step of the
system. The error of the step size is 4/3 of the difference of runs with h and h/2, both iterated to 1e-13. The error of
a tolerance is the difference of runs with this tolerance and with 1e-13. Printed are iterations of a step, and the
ratio of both errors for positions and for accelerations of the bodies, each the largest over bodies and times. Driven
linkages without a free motion have no error of the step size and are left out.
"""

import logging
import tempfile
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import numpy as np

from benchmarks.machines import prepared
from benchmarks.step_against import systems
from benchmarks.sweep_throughput import files
from floatframe import GeneralizedAlpha, System, integrate
from floatframe.files.system_file.read_system import read_system

EXACT = 1e-13
TOLERANCES = (1e-8, 1e-7, 1e-6, 1e-5)  #: the first is the default
MACHINES = (
    ("landing-gear", ("piston", "wing"), "drop", 0.1),
    ("kart", ("chassis",), "kart", 0.2),
    ("bogie", ("frame",), "straight", 0.1),
)


def cases(folder: Path) -> Iterator[tuple[str, System, GeneralizedAlpha, float, float]]:
    """Yield name, system, method, step and duration of each case."""
    for name, make, n_bodies in systems():
        if "modes: 50" not in name:
            h = 1e-4 if n_bodies > 1 else 1e-3
            yield name, make(), GeneralizedAlpha(0.8), h, 0.1 if n_bodies > 1 else 0.5
    crank = files(folder, 1).parent / "crank.toml", 0.04
    machines = (
        (prepared(machine, jobs, folder) / f"{system}.toml", t_end) for machine, jobs, system, t_end in MACHINES
    )
    for path, t_end in (crank, *machines):
        read, run = read_system(path)
        assert run is not None
        assert isinstance(run.integrator, GeneralizedAlpha)
        yield path.stem, read, run.integrator, run.h, t_end


def motion(
    system: System, method: GeneralizedAlpha, t_end: float, h: float, tolerance: float, every: int = 1
) -> tuple[float, tuple[np.ndarray, np.ndarray]]:
    """Return iterations of a step, and positions and accelerations of the bodies, (n_t, 3 n_b) each."""
    found = integrate(system, replace(method, tolerance=tolerance), t_end, h, output_every=every, watch="off")
    bodies = [found.body(name) for name in found.body_names]
    arrays = np.hstack([each.r for each in bodies]), np.hstack([each.v_dot for each in bodies])
    return found.head.summary["n_iterations"] / found.head.summary["n_steps"], arrays


def apart(first: tuple[np.ndarray, ...], second: tuple[np.ndarray, ...]) -> np.ndarray:
    """Return the largest differences of positions and of accelerations, (2,)."""
    return np.array([np.abs(a - b).max() for a, b in zip(first, second, strict=True)])


def main() -> None:
    """Measure and print."""
    logging.disable(logging.WARNING)
    print(f"| system | h | iterations, {EXACT:g} |" + "".join(f" {tolerance:g} |" for tolerance in TOLERANCES))
    print("|---" * (3 + len(TOLERANCES)) + "|")
    with tempfile.TemporaryDirectory() as folder:
        for name, system, method, h, t_end in cases(Path(folder)):
            most, exact = motion(system, method, t_end, h, EXACT)
            of_step = 4 / 3 * apart(exact, motion(system, method, t_end, h / 2, EXACT, 2)[1])
            cells = []
            for tolerance in TOLERANCES:
                iterations, arrays = motion(system, method, t_end, h, tolerance)
                r, a = apart(arrays, exact) / of_step
                cells.append(f"{iterations:.2f}; {r:.0e}, {a:.0e}")
            print(f"| {name} | {h:g} s | {most:.2f} | {' | '.join(cells)} |", flush=True)


if __name__ == "__main__":
    main()
