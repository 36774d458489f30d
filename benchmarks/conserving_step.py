"""Time of a step of the conserving, decaying and variational schemes: one flexible body, free and on a joint.

    OMP_NUM_THREADS=1 python benchmarks/conserving_step.py

Processor time of the steps and of one output in ten, so that other work on the machine counts little.
"""

import time

from floatframe import EnergyDecaying, EnergyMomentum, GeneralizedAlpha, Variational, integrate
from tests.floatframe.bodies.test_free_body import spinning
from tests.floatframe.integrators.test_pendulum import pendulum

N_STEPS = 100


def main():
    """Print milliseconds a step."""
    print("ms a step                     free body, 4 modes    pendulum, 3 modes, spherical joint")
    for method in (EnergyMomentum(), EnergyDecaying(), Variational(), GeneralizedAlpha()):
        times = []
        for system in (spinning(), pendulum()):
            integrate(system, method, 0.01, 0.005)
            began = time.process_time()
            integrate(system, method, N_STEPS * 0.005, 0.005, output_every=10)
            times.append((time.process_time() - began) / N_STEPS * 1e3)
        print(f"{type(method).__name__:28s}  {times[0]:18.3f}    {times[1]:18.3f}")


if __name__ == "__main__":
    main()
