"""Parameters of a bogie with two induction motors, and positions of its parts."""

from collections.abc import Sequence
from dataclasses import dataclass, field
from math import pi

import numpy as np

from floatframe.components.rails import Pair, quasi_elastic
from floatframe.machines.bogie.vehicle import GRAVITY, RailVehicle

__all__ = ["ENDS", "MOUNTS", "SIX_STEPS", "Motor", "MotorBogie"]

ENDS = {"leading": 1, "trailing": -1}  #: axles, and the sign of their x
MOUNTS = ("left", "right", "lower")  #: of a motor on the transom
#: orders of the voltage of a six-step inverter, and amplitudes relative to the fundamental: the space vector that jumps
#: by 60 degrees has c_n = (6/pi) sin(n pi/6)/n at n = 1, -5, 7, -11, ...
SIX_STEPS = ((-5, 1 / 5), (7, -1 / 7), (-11, -1 / 11), (13, 1 / 13))


@dataclass(frozen=True)
class Motor:
    """Two-axis model of a three-phase machine of about 380 kW, referred to the stator."""

    stator_resistance: float = 0.08  #: [ohm]
    rotor_resistance: float = 0.07  #: [ohm]
    stator_leakage: float = 1.2e-3  #: [H]
    rotor_leakage: float = 1.2e-3  #: [H]
    magnetizing: float = 22e-3  #: [H]
    pole_pairs: int = 2
    rated_voltage: float = 1100.0  #: phase peak [V]
    rated_frequency: float = 60.0  #: [Hz]
    boost: float = 25.0  #: phase peak at standstill [V]


@dataclass(frozen=True)
class MotorBogie:
    """One bogie under its half of a vehicle; x forward, y to the left, z up from the tops of the rails."""

    vehicle: RailVehicle = field(default_factory=RailVehicle)  #: frame, springs, axles; half of its body
    motor: Motor = field(default_factory=Motor)
    ratio: float = 5.0  #: gear ratio, rotations of the rotor per rotation of the axle
    centres: float = 0.42  #: distance of rotor and axle [m]
    housing_mass: float = 1100.0  #: motor and gear without rotating parts [kg]
    housing_inertia: tuple[float, float, float] = (75.0, 55.0, 85.0)  #: about its centre, on the rotor's axis [kg m²]
    rotor_mass: float = 300.0
    rotor_inertia: tuple[float, float, float] = (12.0, 5.0, 12.0)  #: [kg m²]
    quill_mass: float = 180.0  #: gear wheel and hollow shaft about the axle
    quill_inertia: tuple[float, float, float] = (15.0, 12.0, 15.0)
    boxes_mass: float = 250.0  #: mass of the axle that does not rotate
    boxes_inertia: tuple[float, float, float] = (250.0, 6.0, 250.0)
    coupling: tuple[float, float, float] = (
        1.2e6,
        340.0,
        2e6,
    )  #: hollow shaft to axle: [N m/rad, N m s/rad], radial [N/m]
    mount: tuple[float, float, float] = (8e6, 4e6, 8e6)  #: of each of the three mounts of a motor [N/m]
    mount_damping: tuple[float, float, float] = (8e3, 4e3, 8e3)  #: [N s/m]
    mount_arm: float = 0.35  #: half the distance of the upper mounts [m]
    mount_reach: float = 0.45  #: longitudinal distance of the mounts from the middle of the transom [m]
    mount_heights: tuple[float, float] = (0.60, 0.30)  #: of the upper mounts and the lower one [m]
    #: stiffness and damping of the other bogie against pitch and yaw [N m/rad, N m s/rad]
    pitch: tuple[float, float] = (1e8, 1e6)
    harmonics: Sequence[Sequence[float]] = SIX_STEPS  #: of the supply voltage
    start: tuple[float, float] = (
        0.4,
        0.5,
    )  #: time at which the frequency begins to rise, and duration until it rises at a constant rate [s]
    rise: float = 2.0  #: rate of the frequency [Hz/s]
    speed: float = 0.0  #: if above 0: constant initial speed; the supply starts with the frequency that fits it [m/s]
    t_end: float = 8.0
    h: float = 5e-4

    @property
    def rolling_radius(self) -> float:
        """Rolling radius of the wheels, centred on the track [m]."""
        return float(quasi_elastic(Pair(), np.zeros(1), smoothing=2e-5, part="tread").radius[0])

    @property
    def running_frequency(self) -> float:
        """Supply frequency at which the motors neither drive nor brake at `speed` [Hz]."""
        return self.motor.pole_pairs * self.ratio * self.speed / self.rolling_radius / (2 * pi)

    @property
    def motor_weight(self) -> float:
        """Weight of all parts that hang on the mounts of a motor [N]."""
        return GRAVITY * (self.housing_mass + self.rotor_mass + self.quill_mass)

    @property
    def centre(self) -> float:
        """Longitudinal distance from the middle of the transom to the centre of mass of the parts on the mounts [m]."""
        rotor, axle = self.vehicle.wheelbase - self.centres, self.vehicle.wheelbase
        turning = (self.housing_mass + self.rotor_mass) * rotor + self.quill_mass * axle
        return turning * GRAVITY / self.motor_weight

    def supports(self) -> dict[str, tuple[float, float, float]]:
        """Return the mounts of both motors on the frame, by interface name."""
        upper, lower = self.mount_heights
        found = {}
        for word, end in ENDS.items():
            x = end * self.mount_reach
            found[f"{word}_motor_left"] = (x, self.mount_arm, upper)
            found[f"{word}_motor_right"] = (x, -self.mount_arm, upper)
            found[f"{word}_motor_lower"] = (x, 0.0, lower)
        return found
