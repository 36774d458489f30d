"""A design found with gradients and without: `python benchmarks/tuned_crank.py`.

A slider-crank turns freely; spring and damper at its slider and the masses are sought so that the slider follows the
motion of another one, whose numbers are not told. Both searches minimise the same number with L-BFGS-B; runs and
processor time are counted. A run with gradient is one call of `ff.design.sensitivities`.
"""

import time
from dataclasses import replace

import numpy as np
from scipy.optimize import minimize

import floatframe as ff
from floatframe.components.mechanisms import slider_crank
from floatframe.design.gradients.parameters import value_at, with_value

RUN = {"t_end": 0.24, "h": 4e-3}
PATHS = (
    "forces.spring.stiffness", "forces.spring.damping", "forces.spring.free_length", "bodies.slider.mass",
    "bodies.rod.mass", "bodies.crank.mass",
)  # fmt: skip
TARGET = np.array([1.25, 0.7, 1.1, 0.8, 1.2, 0.9])  #: numbers of the motion to be met, by those of the beginning
WEIGHTS = 1e4


def crank() -> ff.System:
    """Return the crank as it is at the beginning."""
    post = ff.Marker(ff.GROUND, position=(0.8, 0.1, 0.0))
    forces = [ff.Gravity((0, -9.81, 0)), ff.SpringDamper("spring", post, ff.Marker("slider"), 50.0, 3.0, 0.3)]
    sensors = [ff.sensors.PlaceSensor("slider", ff.Marker("slider"))]
    return replace(slider_crank(angle=0.5, speed=6.0), forces=forces, sensors=sensors)


def scaled(factors: np.ndarray) -> ff.System:
    """Return the crank with its numbers times factors."""
    start = system = crank()
    for path, factor in zip(PATHS, factors, strict=True):
        system = with_value(system, path, factor * value_at(start, path))
    return system


def slider(system: ff.System) -> np.ndarray:
    """Return the place of the slider over time."""
    motion = ff.integrate(system, ff.GeneralizedAlpha(0.8, tolerance=1e-11), **RUN)
    return np.asarray(ff.sensors.measured(system, motion)["slider"].columns["x"])


class Search:
    """The number that is minimised, counted."""

    def __init__(self) -> None:
        self.goal, self.n_runs = slider(scaled(TARGET)), 0

    def value(self, factors: np.ndarray) -> float:
        """Return the mean square of what is missed."""
        self.n_runs += 1
        return float(WEIGHTS * ((slider(scaled(factors)) - self.goal) ** 2).mean())

    def value_and_gradient(self, factors: np.ndarray) -> tuple[float, np.ndarray]:
        """Return it with its gradient, by one call."""
        self.n_runs += 1
        system = scaled(factors)
        goal = self.goal

        def missed(values: np.ndarray) -> tuple[float, np.ndarray]:
            gap = values - goal
            return float(WEIGHTS * (gap**2).mean()), 2 * WEIGHTS * gap / len(gap)

        found = ff.design.sensitivities(system, {"missed": ("slider x", missed)}, PATHS, **RUN)
        return float(found.values[0]), found.gradient[0] * np.array([value_at(crank(), path) for path in PATHS])


def main() -> None:
    """Search with and without gradients, and print what it took."""
    for words, with_gradient in (("with gradient", True), ("without", False)):
        search = Search()
        began = time.process_time()
        function = search.value_and_gradient if with_gradient else search.value
        found = minimize(
            function, np.ones(len(PATHS)), jac=with_gradient or None, method="L-BFGS-B",
            bounds=[(0.3, 2.0)] * len(PATHS), options={"maxiter": 30, "ftol": 1e-12, "gtol": 1e-7},
        )  # fmt: skip
        spent = time.process_time() - began
        print(f"{words:15s} {search.n_runs:5d} runs, {spent:6.1f} s, missed {found.fun:.3g} ({found.nit} iterations)")


if __name__ == "__main__":
    main()
