"""Parameters of the road car, tabulated with sources in docs/road_car.md."""

from dataclasses import dataclass, field

import numpy as np

from fe_models.foundation.arrays import Array

__all__ = ["CORNERS", "Axle", "RoadCar", "RollControl"]

#: corners by name, with axle and side (1: left)
CORNERS = {
    "front_left": ("front", 1), "front_right": ("front", -1), "rear_left": ("rear", 1), "rear_right": ("rear", -1),
}  # fmt: skip

Point = tuple[float, float, float]


@dataclass(frozen=True)
class Axle:
    """A double wishbone suspension, with points of the left side in axes of the car [m, kg, s]."""

    centre: Point  #: centre of the wheel
    lower_front: Point  #: front hinge of the lower wishbone
    lower_rear: Point
    lower_ball: Point
    upper_front: Point  #: front hinge of the upper wishbone
    upper_rear: Point
    upper_ball: Point
    rod_inner: Point  #: inner end of the tie rod, or of the toe link at the rear axle
    rod_outer: Point
    seat: Point  #: seat of spring and damper on the lower wishbone
    jack: Point  #: seat of the hydraulic cylinder on the lower wishbone
    tower: Point  #: seat of spring, damper and cylinder on the body
    mounts: tuple[Point, Point]  #: mounts of the subframe on the body
    spring: float  #: stiffness of the spring [N/m]
    preload: float  #: compression force of the spring at design height [N]
    damper: float  #: damping of the damper [N s/m]
    #: stiffness of the anti-roll bar, torque on the wishbones divided by the sum of their rotations [N m/rad]
    bar: float

    def point(self, name: str, side: int) -> Array:
        """Return a point on a side (1: left, -1: right), (3,)."""
        return np.array(getattr(self, name), dtype=float) * (1.0, side, 1.0)


@dataclass(frozen=True)
class RollControl:
    """Cylinders at the corners; the heads of one side and the rods of the other share a line with a gas volume."""

    head_area: float = 9.6e-4  #: 35 mm bore [m²]
    rod_area: float = 7.6e-4  #: ring around a rod of 16 mm [m²]
    stroke: float = 0.24  #: [m]
    at_design: float = 0.12  #: stroke at design height [m]
    dead_volume: float = 2e-5  #: of each chamber [m³]
    pressure: float = 2.5e6  #: of both lines at design height, absolute [Pa]
    charge: float = 2.0e6  #: of the gas without oil, absolute [Pa]
    gas_volume: float = 6.5e-4  #: at the charge [m³]
    exponent: float = 1.4
    orifice: float = 4e-5  #: between line and gas [m²]
    transition: float = 3e4  #: pressure difference across it below which the flow is laminar [Pa]
    density: float = 870.0
    bulk_modulus: float = 1.4e9
    ambient: float = 101325.0


FRONT = Axle(
    centre=(1.25, 0.75, 0.302),
    lower_front=(1.40, 0.38, 0.200), lower_rear=(1.05, 0.40, 0.205), lower_ball=(1.255, 0.690, 0.190),
    upper_front=(1.34, 0.46, 0.503), upper_rear=(1.10, 0.47, 0.498), upper_ball=(1.225, 0.645, 0.530),
    rod_inner=(1.12, 0.36, 0.240), rod_outer=(1.12, 0.685, 0.236),
    seat=(1.235, 0.590, 0.205), jack=(1.285, 0.590, 0.205), tower=(1.25, 0.52, 0.780),
    mounts=((1.60, 0.45, 0.42), (0.95, 0.45, 0.42)),
    spring=30e3, preload=4655.0, damper=1900.0, bar=800.0,
)  # fmt: skip

REAR = Axle(
    centre=(-1.35, 0.75, 0.302),
    lower_front=(-1.13, 0.39, 0.210), lower_rear=(-1.53, 0.38, 0.205), lower_ball=(-1.35, 0.690, 0.190),
    upper_front=(-1.22, 0.46, 0.498), upper_rear=(-1.48, 0.46, 0.498), upper_ball=(-1.355, 0.645, 0.530),
    rod_inner=(-1.56, 0.385, 0.246), rod_outer=(-1.50, 0.690, 0.240),
    seat=(-1.335, 0.590, 0.205), jack=(-1.385, 0.590, 0.205), tower=(-1.35, 0.52, 0.780),
    mounts=((-1.02, 0.50, 0.42), (-1.68, 0.50, 0.42)),
    spring=28e3, preload=3846.0, damper=1700.0, bar=550.0,
)  # fmt: skip


@dataclass(frozen=True)
class RoadCar:
    """A passenger car, with x forward, y left and z up from the ground, in units m-kg-s."""

    front: Axle = FRONT
    rear: Axle = REAR
    control: RollControl = field(default_factory=RollControl)
    speed: float = 65 / 3.6  #: maintained by the rear wheels [m/s]
    radius: float = 0.32  #: of the unloaded tyres [m]
    lower_arm: float = 6.0  #: mass [kg]
    upper_arm: float = 3.0
    upright: float = 16.0  #: with brake
    wheel: float = 19.0
    spin_inertia: float = 1.1  #: of a wheel [kg m²]
    rack: float = 4.0
    subframe: float = 26.0  #: of each axle, including the attached parts
    mount_stiffness: float | None = 1.0e7  #: of a mount of a subframe, in each direction; None: fixed to the body [N/m]
    mount_damping: float = 4.0e3  #: [N s/m]
    bump_gap: float = 0.055  #: travel of the spring to its bump stop [m]
    rebound_gap: float = 0.055
    cockpit: Point = (-0.05, 0.0, 0.24)  #: point where roll, side-slip and acceleration are measured

    def axle(self, name: str) -> Axle:
        """Return the axle "front" or "rear"."""
        return self.front if name == "front" else self.rear

    @property
    def wheelbase(self) -> float:
        """Distance of the wheel centres along x [m]."""
        return self.front.centre[0] - self.rear.centre[0]
