"""The two-mass oscillator: mass 1 in a system file, mass 2 and the spring between them in an FMU; its exact motion.

    m x1'' = -k x1 - d x1' + F,  F = kc (x2 - x1) + dc (x2' - x1'),  m x2'' = -k x2 - d x2' - F

`python -m tests.floatframe.files.cosimulation.two_masses` prints the errors over the macro-step.
"""

import sys
import tempfile
from pathlib import Path

import numpy as np
from scipy.linalg import expm

from floatframe import read_system
from floatframe.files import co_simulate
from floatframe.simulation import Coupling
from tests.changed_file import changed_file

M, K, D, KC, DC, T_END = 1.0, 100.0, 0.4, 60.0, 0.6, 1.0
X1 = 0.1  #: of mass 1 at the start
SIZES = (0.04, 0.02, 0.01, 0.005)

SLAVE = f'''
from pythonfmu import Fmi2Causality, Fmi2Slave, Fmi2Variability, Real


class SecondMass(Fmi2Slave):
    """Mass 2 and the spring to mass 1, whose place and speed are held over a step; Runge-Kutta in 20 parts."""

    def __init__(self, **kwargs):
        super().__init__(**kwargs)
        self.x1 = self.v1 = self.x2 = self.v2 = 0.0
        self.kc = {KC}
        self.fails_at = 1e9
        for name in ("x1", "v1"):
            self.register_variable(Real(name, causality=Fmi2Causality.input))
        for name in ("kc", "fails_at"):
            self.register_variable(
                Real(name, causality=Fmi2Causality.parameter, variability=Fmi2Variability.fixed)
            )
        for name in ("x2", "v2"):
            self.register_variable(Real(name, causality=Fmi2Causality.local))
        self.register_variable(Real("F", causality=Fmi2Causality.output, getter=self.force))

    def force(self):
        return self.kc * (self.x2 - self.x1) + {DC} * (self.v2 - self.v1)

    def rates(self, x, v):
        return v, (-{K} * x - {D} * v - self.kc * (x - self.x1) - {DC} * (v - self.v1)) / {M}

    def do_step(self, t, size):
        if t + 0.5 * size > self.fails_at:
            raise RuntimeError("the second mass fell off")
        h = size / 20
        for _ in range(20):
            x, v = self.x2, self.v2
            a = self.rates(x, v)
            b = self.rates(x + h / 2 * a[0], v + h / 2 * a[1])
            c = self.rates(x + h / 2 * b[0], v + h / 2 * b[1])
            d = self.rates(x + h * c[0], v + h * c[1])
            self.x2 = x + h / 6 * (a[0] + 2 * b[0] + 2 * c[0] + d[0])
            self.v2 = v + h / 6 * (a[1] + 2 * b[1] + 2 * c[1] + d[1])
        return True
'''

FILE = f"""
[system]
units = "m-kg-s"

[bodies.first]
mass = {M}
inertia = [[1, 0, 0], [0, 1, 0], [0, 0, 1]]
position = [{X1}, 0, 0]

[joints.rail]
type = "prismatic"
body_a = "ground"
body_b = "first"
marker_a = [0, 0, 0]
marker_b = [0, 0, 0]
axis = [1, 0, 0]

[forces.spring]
type = "joint-force"
joint = "rail"
coordinate = "distance"
stiffness = {K}
damping = {D}
motor = {{type = "constant", value = 0.0}}

[sensors.acceleration]
type = "acceleration"
body = "first"

[fmus.second]
file = "second.fmu"
inputs = {{x1 = "rail.distance", v1 = "rail.distance.rate"}}
outputs = {{F = "forces.spring.motor"}}

[cosimulation]
step = 0.01
scheme = "explicit"

[run]
t_end = {T_END}
h = 1e-3
"""


def write_two_masses(folder: Path, *changes: tuple[str, str], can_go_back: bool = True) -> Path:
    """Write the system file, with parts of its text changed, and the FMU beside it."""
    from pythonfmu import FmuBuilder

    folder.mkdir(parents=True, exist_ok=True)
    script = folder / "second_mass.py"
    script.write_text(SLAVE)
    FmuBuilder.build_FMU(script, dest=folder / "second.fmu", canGetAndSetFMUstate=can_go_back)
    sys.modules.pop("second_mass", None)
    sys.path[:] = [each for each in sys.path if Path(each) != folder]
    return changed_file(folder / "first.toml", FILE, *changes)


def exact(t):
    """Return x1 at times, (n_t,)."""
    A = np.zeros((4, 4))
    A[:2, 2:] = np.eye(2)
    A[2:, :2] = np.array([[-K - KC, KC], [KC, -K - KC]]) / M
    A[2:, 2:] = np.array([[-D - DC, DC], [DC, -D - DC]]) / M
    return np.array([(expm(A * each) @ [X1, 0, 0, 0])[0] for each in t])


def error(path: Path, scheme: str, size: float, t_end: float = T_END) -> float:
    """Return the largest error of x1 at the macro-steps, over its start."""
    system, run = read_system(path)
    h = size / 5  # its own error, of second order, is small beside that of the coupling
    motion = co_simulate(system, run.integrator, t_end, h, Coupling(size, scheme))
    every = round(size / h)
    t, x = motion.t[::every], motion.body("first").r[::every, 0]
    return float(np.abs(x - exact(t)).max() / X1)


def main() -> None:
    """Print the errors and the order of each scheme."""
    with tempfile.TemporaryDirectory() as folder:
        path = write_two_masses(Path(folder))
        print("scheme      " + "".join(f"{f'H = {size:g} s':>14}" for size in SIZES) + "  order")
        for scheme in ("explicit", "iterated"):
            errors = [error(path, scheme, size) for size in SIZES]
            order = np.polyfit(np.log(SIZES), np.log(errors), 1)[0]
            print(f"{scheme:<12}" + "".join(f"{each:14.2e}" for each in errors) + f"  {order:.2f}")


if __name__ == "__main__":
    main()
