"""Numbers of a bogie with two induction motors, for its closed forms."""

from collections.abc import Sequence
from dataclasses import dataclass, field
from math import pi
from typing import Any

import numpy as np

from floatframe.components.rails import Pair, quasi_elastic
from floatframe.machines.motor_bogie.closed_forms import Motor, steady_fluxes

__all__ = ["ENDS", "SIX_STEPS", "MotorBogie"]

ENDS = {"leading": 1, "trailing": -1}  #: axles, and the sign of their x
#: orders of the voltage of a six-step inverter, and amplitudes relative to the fundamental: the space vector that jumps
#: by 60 degrees has c_n = (6/pi) sin(n pi/6)/n at n = 1, -5, 7, -11, ...
SIX_STEPS = ((-5, 1 / 5), (7, -1 / 7), (-11, -1 / 11), (13, 1 / 13))


@dataclass(frozen=True)
class MotorBogie:
    """The numbers of the bogie that its closed forms use; they are equal to those in `six_steps.toml`."""

    motor: Motor = field(default_factory=Motor)
    harmonics: Sequence[Sequence[float]] = SIX_STEPS  #: harmonics of the supply voltage
    ratio: float = 5.0  #: gear ratio, rotations of the rotor per rotation of the axle
    speed: float = 0.0  #: constant initial speed [m/s]

    @property
    def rolling_radius(self) -> float:
        """Rolling radius of the wheels, centred on the track [m]."""
        return float(quasi_elastic(Pair(), np.zeros(1), smoothing=2e-5, part="tread").radius[0])

    @property
    def running_frequency(self) -> float:
        """Supply frequency at which the motors neither drive nor brake at `speed` [Hz]."""
        return self.motor.pole_pairs * self.ratio * self.speed / self.rolling_radius / (2 * pi)

    def even_running(self) -> dict[str, Any]:
        """Return the changes of `six_steps.toml` with which the bogie runs at `speed`, neither driven nor braked."""
        f = self.running_frequency
        fluxes = list(steady_fluxes(self.motor, f, 2 * pi * f / self.motor.pole_pairs))
        each = {"frequency": f, "fluxes": fluxes}
        drives = {f"elements.{axle}_drive.{key}": value for axle in ENDS for key, value in each.items()}
        return {"speed": self.speed, **drives}
