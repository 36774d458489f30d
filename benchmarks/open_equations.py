"""Processor time of a call of the open equations, for a slider-crank: `python benchmarks/open_equations.py`."""

import time

import floatframe as ff
from floatframe.components.mechanisms import slider_crank

CALLS = 300


def main() -> None:
    """Print a line a function."""
    eq = ff.analyses.open_equations(slider_crank(angle=0.5, speed=3.0))
    x, v, a, lam = eq.start()
    calls = {
        "residual": lambda: eq.residual(0.0, x, v, a, lam),
        "force": lambda: eq.force(0.0, x, v),
        "mass": lambda: eq.mass(x),
        "jacobian": lambda: eq.jacobian(0.0, x),
        "accelerations": lambda: eq.accelerations(0.0, x, v),
        "tangents": lambda: eq.tangents(0.0, x, v, a, lam),
    }
    print(f"{len(eq.system.bodies)} bodies, {eq.n_lam} constraints; processor time of a call")
    for name, call in calls.items():
        call()
        n = CALLS if name != "tangents" else CALLS // 30
        began = time.process_time()
        for _ in range(n):
            call()
        print(f"{name:15s} {1e3 * (time.process_time() - began) / n:8.3f} ms")


if __name__ == "__main__":
    main()
