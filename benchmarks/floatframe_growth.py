"""Growth of the time per step with the number of bodies and of modes; time from the start to the first step.

    python benchmarks/floatframe_growth.py

Chains of 10 to 200 flexible bodies with 8 modes on hinges, and one body with 8 to 64 modes (bodies of
`benchmarks/floatframe_step.py`); processor time, the best of five runs. The exponent is that of a power of the number
of modes through neighbouring rows. "First step": processor time of a new process from `import floatframe` to the end of
the first step, the compiled code and the bytecode of the modules taken from their caches.
"""

import os
import subprocess
import sys
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))

from benchmarks.floatframe_step import chain, measure

FIRST_STEP = """
import time
from floatframe import GeneralizedAlpha, Gravity, RigidBody, System, integrate
body = RigidBody("b", 1.0, [[1.0, 0, 0], [0, 2.0, 0], [0, 0, 2.5]])
integrate(System([body], [], [Gravity((0, 0, -9.81))]), GeneralizedAlpha(0.8), 1e-3, 1e-3)
print(time.process_time())
"""


def growth_with_bodies(numbers=(10, 50, 200), n_steps=2000):
    """Return the time per step and body for chains of these numbers of bodies, in seconds."""
    seconds = [measure([chain(n, 8)], max(n_steps // n, 10), 5)[0][0] / n for n in numbers]
    return dict(zip(numbers, seconds, strict=True))


def growth_with_modes(numbers=(8, 16, 32, 64), n_steps=500):
    """Return the time per step of one body with these numbers of modes, in seconds."""
    return {n: measure([chain(1, n)], n_steps, 5)[0][0] for n in numbers}


def first_step():
    """Return the processor time of a new process up to the end of the first step [s]; bytecode is kept."""
    environment = {name: value for name, value in os.environ.items() if name != "PYTHONDONTWRITEBYTECODE"}
    done = subprocess.run(
        [sys.executable, "-c", FIRST_STEP], capture_output=True, text=True, check=True, env=environment
    )
    return float(done.stdout)


def figures(short):
    """Return what the watch keeps."""
    bodies = growth_with_bodies((10, 100), 1000)
    modes = growth_with_modes((8, 32), 300)
    first_step()  # compiled code
    return {
        "step and body of a chain of 100 over one of 10": bodies[100] / bodies[10],
        "step of a body with 32 modes over one with 8": modes[32] / modes[8],
        "import to first step, compiled code kept [s]": min(first_step() for _ in range(3)),
    }


def main():
    bodies = growth_with_bodies()
    for n, seconds in bodies.items():
        print(f"{n:4d} bodies: {seconds * 1e6:6.2f} us per step and body, {seconds / bodies[10]:.2f} of that with 10")
    modes = growth_with_modes()
    before = None
    for n, seconds in modes.items():
        exponent = "" if before is None else f", exponent {np.log2(seconds / before):.2f}"
        print(f"{n:4d} modes: {seconds * 1e6:7.2f} us per step{exponent}")
        before = seconds
    first_step()  # bytecode and compiled code
    print(f"first step after {first_step():.2f} s of processor time")


if __name__ == "__main__":
    main()
