"""What safety costs: a stabilised step by a plain one, and a run with the watch by one without.

    python -m benchmarks.safe_steps [pairs]

Systems: those of `benchmarks.step_against` (a rigid arm, a rigid slider-crank, one flexible body on a hinge and a chain
of ten, with 8, 20 and 50 modes), h = 1 ms. Both of a pair run in turn, `pairs` times (by default 20); printed is the
least processor time of each and their ratio: of 1000 compiled steps (a tenth of it for the chain), and of whole runs of
20 000 steps (2000 for the chain; a fifth of the pairs), with every 100th step kept.
"""

import logging
import sys
import time

import numpy as np

from benchmarks.floatframe_step import H
from benchmarks.step_against import systems
from floatframe import GeneralizedAlpha, integrate
from floatframe.engine.compiling.system import compiled_system
from floatframe.engine.kernels.work import new_work


def steps(make, n_steps, pairs):
    """Return the least time of a plain and of a stabilised step [s]."""
    methods = [GeneralizedAlpha(0.8, stabilized=is_stabilized) for is_stabilized in (False, True)]
    made = [make() for _ in methods]
    carries = [method.start(system, 0.0) for method, system in zip(methods, made, strict=True)]
    works = [new_work(compiled_system(system).model) for system in made]
    best = [np.inf, np.inf]
    for _ in range(pairs):
        for k, method in enumerate(methods):
            begun = time.thread_time()
            carries[k], _, done, failure = method.advance(
                made[k], carries[k], works[k], t0=0.0, h=H, first=0, n_steps=n_steps, every=100
            )
            best[k] = min(best[k], (time.thread_time() - begun) / done)
            assert failure is None, failure
    return best


def runs(make, n_steps, pairs):
    """Return the least time of a run without the watch and with it, divided by its steps [s]."""
    best, system = [np.inf, np.inf], make()
    for _ in range(pairs):
        for k, watch in enumerate(("off", "tell")):
            begun = time.process_time()
            integrate(system, GeneralizedAlpha(0.8), n_steps * H, H, output_every=100, watch=watch)
            best[k] = min(best[k], (time.process_time() - begun) / n_steps)
    return best


def main():
    pairs = int(sys.argv[1]) if len(sys.argv) > 1 else 20
    logging.getLogger("floatframe").setLevel(logging.ERROR)  # made-up bodies leave the range of their linear frames
    print("system                  plain  stabilised  ratio | run without watch  with  ratio   [us a step]")
    for name, make, n_bodies in systems():
        plain, stabilised = np.array(steps(make, 1000 // n_bodies, pairs)) * 1e6
        off, tell = np.array(runs(make, 20000 // n_bodies, max(1, pairs // 5))) * 1e6
        print(f"{name:22s} {plain:6.1f} {stabilised:11.1f} {stabilised / plain:6.3f} |"
              f" {off:17.1f} {tell:5.1f} {tell / off:6.3f}", flush=True)  # fmt: skip


if __name__ == "__main__":
    main()
