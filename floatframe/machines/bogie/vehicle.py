"""A four-axle passenger vehicle on two bogies with rigid or flexible frames."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from cms.body.reduced_body import ReducedBody
from floatframe.components.rails import ContactLaws, Pair, Track, WheelOnRail, Wheelset, height_on_rails, quasi_elastic
from floatframe.model.bodies.flexible_body import FlexibleBody
from floatframe.model.bodies.markers import Marker
from floatframe.model.bodies.rigid_body import RigidBody
from floatframe.model.forces import Bushing, Gravity
from floatframe.model.system import System

__all__ = ["NAMES", "RailVehicle", "flexible_frames", "vehicle", "vehicle_parts"]

GRAVITY = 9.81
NAMES = ("front", "rear")
SIDES = ((1, "left"), (-1, "right"))
BOX_SHARE = 0.01  #: fraction of the axle's spin inertia that does not rotate, that of its boxes
PITCH = (5e4, 50.0)  #: stiffness and damping of a box against rotation about the axle [N m/rad, N m s/rad]


@dataclass(frozen=True)
class RailVehicle:
    """Masses, dimensions and springs; x forward, y to the left, z up from the top of the rails.

    Simplified from vehicle 1 of the Manchester benchmarks (Iwnicki 1998). Stiffness and damping are those of one spring
    on one side.
    """

    body_mass: float = 32000.0  #: mass of the car body [kg]
    #: principal moments of inertia of the car body [kg m²]
    body_inertia: tuple[float, float, float] = (56800.0, 1.97e6, 1.97e6)
    body_height: float = 1.8  #: height of the car body's centre of mass [m]
    frame_mass: float = 2615.0
    frame_inertia: tuple[float, float, float] = (1722.0, 1476.0, 3067.0)
    frame_height: float = 0.6
    axle_mass: float = 1813.0
    axle_inertia: tuple[float, float, float] = (1120.0, 112.0, 1120.0)
    pivot: float = 9.5  #: half the distance between the bogies [m]
    wheelbase: float = 1.28  #: half the wheelbase [m]
    primary_arm: float = 1.0  #: half the lateral distance between the primary springs [m]
    #: stiffness of an axle box suspension: longitudinal, lateral, vertical [N/m]
    primary: tuple[float, float, float] = (31.391e6, 3.884e6, 1.22e6)
    primary_damping: float = 4000.0  #: vertical damping of an axle box suspension [N s/m]
    secondary_arm: float = 1.0
    secondary_height: float = 0.83
    #: stiffness of an air spring: longitudinal, lateral, vertical [N/m]
    secondary: tuple[float, float, float] = (160e3, 160e3, 430e3)
    #: damping of the secondary suspension: longitudinal (yaw dampers), lateral, vertical [N s/m]
    secondary_damping: tuple[float, float, float] = (0.0, 16e3, 20e3)
    rod: float = 5e6  #: longitudinal stiffness of the traction rod [N/m]
    rod_damping: float = 25e3  #: longitudinal damping of the traction rod [N s/m]
    roll_bar: float = 940e3  #: torsional stiffness of a bogie's anti-roll bar [N m/rad]
    guide: float = 1.0  #: factor on the longitudinal and lateral primary stiffness

    @property
    def wheel_load(self) -> float:
        """Vertical load of each wheel [N]."""
        return GRAVITY * (self.body_mass + 2 * self.frame_mass + 4 * self.axle_mass) / 8


def vehicle(
    data: RailVehicle,
    speed: float,
    *,
    pair: Pair | None = None,
    track: Track | None = None,
    laws: ContactLaws | None = None,
    is_independent: bool = False,
    frames: Sequence[FlexibleBody] = (),
) -> System:
    """Return the vehicle running at a speed, with springs preloaded to carry it in its assembled position.

    Parameters
    ----------
    data
        The vehicle.
    speed
        Speed [m/s].
    pair, track, laws
        Profiles of wheel and rail, track, and laws of the contact; the track is straight about x = 0, for more than the
        length of the vehicle.
    is_independent
        Whether the two wheels of an axle rotate independently.
    frames
        Flexible frames from `flexible_frames`; none: rigid frames.
    """
    parts = vehicle_parts(data, speed, pair or Pair(), track or Track(), laws, is_independent, bool(frames))
    rigid = [
        RigidBody(
            f"frame_{name}",
            data.frame_mass,
            np.diag(data.frame_inertia),
            position=np.array([(1 - 2 * k) * data.pivot, 0, data.frame_height]),
            velocity=np.array([speed, 0, 0]),
        )
        for k, name in enumerate(NAMES)
    ]
    return System([*parts.bodies, *(frames or rigid)], [], parts.forces, elements=parts.elements, name="rail vehicle")


def flexible_frames(data: RailVehicle, frame: ReducedBody, speed: float) -> list[FlexibleBody]:
    """Return the two frames of a vehicle from one reduced body, reduced from the file `frame.toml` of this machine."""
    return [
        FlexibleBody(
            f"frame_{name}",
            frame,
            position=np.array([(1 - 2 * k) * data.pivot, 0, 0]),
            velocity=np.array([speed, 0, 0]),
        )
        for k, name in enumerate(NAMES)
    ]


class Parts(NamedTuple):
    """A vehicle to which the frames are still to be added."""

    bodies: list[RigidBody]
    forces: list[Bushing | Gravity]
    elements: list[Wheelset | WheelOnRail]


def vehicle_parts(
    data: RailVehicle,
    speed: float,
    pair: Pair,
    track: Track,
    laws: ContactLaws | None,
    is_independent: bool,
    by_interface: bool,
) -> Parts:
    """Return the parts; springs are attached to the frames at interfaces by name, or at positions if rigid."""
    laws = laws or ContactLaws(friction=0.4)
    rolling = float(quasi_elastic(pair, np.zeros(1), smoothing=laws.smoothing, part="tread").radius[0])
    spin, velocity = speed / rolling, np.array([speed, 0.0, 0.0])
    placed = height_on_rails(Wheelset("wheels", Marker("axle"), pair, track, laws), data.wheel_load)
    parts = Parts([], [Gravity(np.array([0, 0, -GRAVITY]))], [])
    parts.bodies.append(
        RigidBody(
            "body",
            data.body_mass,
            np.diag(data.body_inertia),
            position=np.array([0, 0, data.body_height]),
            velocity=velocity,
        )
    )
    load_2 = data.body_mass * GRAVITY / 4
    load_1 = (data.body_mass / 2 + data.frame_mass) * GRAVITY / 4

    def on_frame(name: str, x: float, y: float, z: float, interface: str) -> Marker:
        if by_interface:
            return Marker(f"frame_{name}", interface)
        return Marker(f"frame_{name}", position=np.array([x, y, z - data.frame_height]))

    def in_body(x: float, y: float, z: float) -> Marker:
        return Marker("body", position=np.array([x, y, z - data.body_height]))

    for k, name in enumerate(NAMES):
        x = (1 - 2 * k) * data.pivot
        for side, hand in SIDES:
            y, z = side * data.secondary_arm, data.secondary_height
            parts.forces.append(
                Bushing(
                    f"air_{name}_{hand}",
                    in_body(x, y, z),
                    on_frame(name, 0, y, z, f"air_{hand}"),
                    np.array([*data.secondary, data.roll_bar / 2, 0, 0]),
                    np.array([*data.secondary_damping, 0, 0, 0]),
                    np.array([0, 0, load_2, 0, 0, 0]),
                )
            )
        parts.forces.append(
            Bushing(
                f"rod_{name}",
                in_body(x, 0, data.frame_height),
                on_frame(name, 0, 0, data.frame_height, "pivot"),
                np.array([data.rod, 0, 0, 0, 0, 0]),
                np.array([data.rod_damping, 0, 0, 0, 0, 0]),
            )
        )
        for end, word in ((1, "leading"), (-1, "trailing")):
            axle, arm = f"axle_{name}_{word}", end * data.wheelbase
            I_x, I_y, I_z = data.axle_inertia
            parts.bodies.append(
                RigidBody(
                    axle,
                    data.axle_mass,
                    np.diag([I_x, BOX_SHARE * I_y, I_z]),
                    position=np.array([x + arm, 0, placed]),
                    velocity=velocity,
                )
            )
            k_x, k_y, k_z = data.guide * data.primary[0], data.guide * data.primary[1], data.primary[2]
            for side, hand in SIDES:
                y = side * data.primary_arm
                parts.forces.append(
                    Bushing(
                        f"box_{name}_{word}_{hand}",
                        on_frame(name, arm, y, placed, f"{word}_{hand}"),
                        Marker(axle, position=np.array([0, y, 0])),
                        np.array([k_x, k_y, k_z, 0, PITCH[0], 0]),
                        np.array([0, 0, data.primary_damping, 0, PITCH[1], 0]),
                        np.array([0, 0, load_1, 0, 0, 0]),
                    )
                )
            if not is_independent:
                parts.elements.append(Wheelset(f"{axle}_wheels", Marker(axle), pair, track, laws, I_y, spin))
                continue
            for side, hand in SIDES:
                half = Marker(axle, position=np.array([0, side * 0.5 * pair.running_circles, 0]))
                parts.elements.append(WheelOnRail(f"{axle}_{hand}", half, hand, pair, track, laws, I_y / 2, spin))
    return parts
