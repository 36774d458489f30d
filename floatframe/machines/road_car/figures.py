"""Evaluation of the road car: its motion over time, and its mass."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from scipy.optimize import fsolve

from cms.body.reduced_body import ReducedBody
from fe_models.foundation.arrays import Array
from floatframe.machines.road_car.closed_forms import CarOnPosts
from floatframe.machines.road_car.description import CORNERS, RoadCar
from floatframe.machines.road_car.linkage import CornerPlace, Linkage
from floatframe.model.bodies.flexible_body import FlexibleBody
from floatframe.model.system import System
from floatframe.results.element_motion import element_motion
from floatframe.results.trajectory import Trajectory

__all__ = ["CarMass", "CarMotion", "SteadyTurn", "body_twist_stiffness", "car_mass", "driven", "steady_turn"]


# a steady turn of the car from four wheels, the linkage and the springs, as an independent check ----------------------
# The unknowns are lateral velocity v, yaw rate r, and roll phi, lift w and pitch theta (nose down) of the body, at the
# speed u. For each wheel, at (x, y) from the centre of mass of the car:
#
# (1) the travel relative to the body is z = -(w + y phi - x theta) minus the deflection of the tyre; steer and
#     inclination are those of the linkage at this travel, plus phi for the inclination
# (2) the slip angle is atan2(v + r x, u - r y) - steer; lateral force and aligning moment follow from the tyre
# (3) the load follows from virtual work on a wheel that moves relative to the body, in axes of the body: contact forces
#     along the path of the contact, and weight and inertia of the unsprung mass along the path of the wheel centre,
#     balance the force of the post
#
# and for the car: (4) sum F_y = m u r, (5) no moment about z, (6) sum F_z = m g, (7) no moment about x and y. Wheels
# roll against the moment M_y of their tyres; the rear wheels share the driving force equally, without slip. The wheels
# spin and rotate with the car, which requires a gyroscopic moment about x.


G, RADIUS = 9.81, 0.302  #: gravity [m/s²], loaded radius of a tyre [m]
#: function from load [N], slip angle [rad], inclination [rad] and side (left: True) to F_y [N], M_x, M_y, M_z [N m]
Tyre = Callable[[float, float, float, bool], tuple[float, float, float, float]]


@dataclass(frozen=True)
class CarMass:
    """Mass of the whole car, and its position in axes of the car."""

    mass: float  #: [kg]
    x: float  #: of the centre of mass [m]
    height: float  #: above the ground [m]
    tyre_stiffness: float = 2.1e5  #: vertical, about the static load [N/m]


@dataclass(frozen=True, eq=False)
class SteadyTurn:
    """A steady turn."""

    side_slip: float  #: of the centre of mass [rad]
    yaw_rate: float  #: [rad/s]
    roll: float  #: of the body [rad]
    loads: Array  #: front left, front right, rear left, rear right, (4,) [N]

    def transfer(self, axle: str) -> float:
        """Return the load of the right wheel of an axle minus that of its left wheel [N]."""
        k = 0 if axle == "front" else 2
        return float(self.loads[k + 1] - self.loads[k])


def contact(place: CornerPlace) -> Array:
    """Return the point where the wheel touches the ground below it, in axes of the body, (3,) [m]."""
    down = place.axle * place.axle[2] - np.array([0.0, 0.0, 1.0])
    return np.asarray(place.centre + RADIUS * down / np.linalg.norm(down))


def vector_of(R: Array) -> Array:
    """Return the rotation vector of a small rotation, (3,) [rad]."""
    return 0.5 * np.array([R[2, 1] - R[1, 2], R[0, 2] - R[2, 0], R[1, 0] - R[0, 1]])


def steady_turn(car: RoadCar, mass: CarMass, tyre: Tyre, speed: float, rack: float, support: str) -> SteadyTurn:
    """Return the turn at a speed [m/s], with the rack displaced by `rack` to the right [m].

    Raises
    ------
    ArithmeticError
        If there is no such turn, for example beyond the grip of the tyres.
    """
    posts, m, h = CarOnPosts(car, support), mass.mass, mass.height
    unsprung = car.wheel + car.upright + 0.5 * (car.lower_arm + car.upper_arm)
    rest = posts.forces(np.zeros(4))
    linkages = [Linkage(car.axle(name), side, -rack if name == "front" else 0.0) for name, side in CORNERS.values()]
    centres = np.array([car.axle(name).point("centre", side) for name, side in CORNERS.values()])
    x, y = centres[:, 0] - mass.x, centres[:, 1]
    static = 0.5 * m * G * np.where(x > 0, -x[2], x[0]) / (x[0] - x[2])
    sprung, rest_lever = m - 4 * unsprung, 4 * unsprung * centres[0, 2]

    def wheels(unknown: Array) -> tuple[Array, Array, Array]:
        """Return loads by virtual work, forces on the wheels (4, 3), and the sum of their moments about the origin."""
        v, r, roll, lift, pitch = unknown[:5]
        now, travel = static + unknown[5:], -(lift + y * roll - x * pitch) - unknown[5:] / mass.tyre_stiffness  # (1)
        loads, c, s = static + posts.forces(travel) - rest, np.cos(roll), np.sin(roll)
        places = [[at.lifted(z + step) for step in (-1e-4, 0.0, 1e-4)] for at, z in zip(linkages, travel, strict=True)]
        force, moment, total = np.zeros((4, 3)), np.zeros((4, 3)), np.zeros(3)
        for k, (_, here, _) in enumerate(places):
            alpha = np.arctan2(v + r * x[k], speed - r * y[k]) - here.steer  # (2)
            F_y, *moment[k] = tyre(now[k], alpha, here.inclination + roll, y[k] > 0)
            rolling = moment[k, 1] / RADIUS
            a, b = np.cos(here.steer), np.sin(here.steer)
            force[k] = rolling * a - F_y * b, rolling * b + F_y * a, now[k]
        force[2:, 0] -= 0.5 * (m * v * r + force[:, 0].sum())  # both rear wheels drive equally
        for k, (low, here, high) in enumerate(places):
            foot = contact(here) - here.centre
            way = (high.centre + high.R @ here.R.T @ foot - low.centre - low.R @ here.R.T @ foot) / 2e-4
            turn = vector_of(high.R @ low.R.T) / 2e-4
            y_m = (high.centre - low.centre)[1] / 2e-4
            sideways, weight = unsprung * speed * r, unsprung * G
            loads[k] += weight * (c - 1.0 + s * y_m) + sideways * (c * y_m - s)  # (3)
            gyroscopic = np.array([car.spin_inertia * speed / RADIUS * r, 0.0, 0.0])
            loads[k] -= force[k, 0] * way[0] + force[k, 1] * (c * way[1] - s * way[2])
            loads[k] -= (moment[k] + gyroscopic) @ turn
            loads[k] /= c * way[2] + s * way[1]
            at = contact(here)
            arm = np.array([x[k], c * at[1] - s * at[2], 0.0])
            total += np.cross(arm, force[k]) + moment[k] + gyroscopic
            total[0] -= weight * (c * here.centre[1] - s * (here.centre[2] + lift))
        return loads, force, total

    def defects(unknown: Array) -> Array:
        v, r, roll, lift = unknown[:4]
        loads, force, total = wheels(unknown)
        about_x = total[0] + speed * r * (m * h + sprung * lift) + (m * h - rest_lever) * G * np.sin(roll)
        about_y = total[1] + h * m * r * v
        return np.array(
            [
                force[:, 1].sum() - m * speed * r,  # (4)
                total[2],  # (5)
                force[:, 2].sum() - m * G,  # (6)
                about_x,  # (7)
                about_y,
                *(loads - force[:, 2]),
            ]
        )

    rate = speed * 7.7 * rack / 3.0  # a nearly linear case as initial guess
    moved = -0.5 * m * speed * rate * h / (2 * y)
    start = np.concatenate([[0.0, rate, 0.011 * speed * rate, 0.0, 0.0], moved])
    answer, _, found, words = fsolve(defects, start, full_output=True, xtol=1e-10)
    if found != 1:
        raise ArithmeticError(f"steady_turn: speed {speed:g}, rack {rack:g}: {words}")
    slip = float(np.arctan2(answer[0], speed))
    return SteadyTurn(slip, float(answer[1]), float(answer[2]), static + answer[5:])


# figures --------------------------------------------------------------------------------------------------------------


@dataclass(frozen=True, eq=False)
class CarMotion:
    """Motion of the car over time, measured at its cockpit."""

    t: Array  #: (n_t,) [s]
    place: Array  #: position along and across the road, (n_t, 2) [m]
    speed: Array  #: (n_t,) [m/s]
    yaw_rate: Array  #: (n_t,) [rad/s]
    roll: Array  #: (n_t,) [rad]
    side_slip: Array  #: (n_t,) [rad]
    lateral_acceleration: Array  #: horizontal and across the car, (n_t,) [m/s²]
    loads: Array  #: F_z of front left, front right, rear left, rear right, (n_t, 4) [N]
    pressures: Array  #: of the left and the right line, (n_t, 2) [Pa]; none without hydraulics, (n_t, 0)
    error: Array  #: of the path, (n_t,) [m]; none without a driver, (0,)


def driven(system: System, motion: Trajectory) -> CarMotion:
    """Return the quantities of a motion of the car."""
    seen = element_motion(system, motion, "seen").outputs
    names = [element.name for element in system.elements]
    lines = []
    if "roll_control" in names:
        circuit = element_motion(system, motion, "roll_control").outputs
        lines = [circuit[f"pressure line_{side}"] for side in ("left", "right")]
    vx, vy = (np.gradient(seen[key], motion.t) for key in ("x", "y"))
    a_x, a_y = np.gradient(vx, motion.t), np.gradient(vy, motion.t)
    return CarMotion(
        t=motion.t,
        place=np.stack([seen["x"], seen["y"]], axis=1),
        speed=seen["speed"],
        yaw_rate=seen["yaw_rate"],
        roll=seen["roll"],
        side_slip=seen["side_slip"],
        lateral_acceleration=np.cos(seen["yaw"]) * a_y - np.sin(seen["yaw"]) * a_x,
        loads=np.stack([element_motion(system, motion, f"tyre_{c}").outputs["Fz"] for c in CORNERS], axis=1),
        pressures=np.stack(lines, axis=1) if lines else np.zeros((len(motion.t), 0)),
        error=element_motion(system, motion, "driver").outputs["error"] if "driver" in names else np.zeros(0),
    )


def car_mass(car: RoadCar, system: System) -> CarMass:
    """Return mass and centre of mass of an assembled car."""
    mass, first = 0.0, np.zeros(3)
    for body in system.bodies:
        if isinstance(body, FlexibleBody):
            gram = body.reduced.moments.gram
            own = float(gram[0, 0])
            place = gram[0, 1:4] / own + np.array(car.cockpit) - body.reduced.interface("cockpit").position
        else:
            own, place = body.mass, np.asarray(body.center_of_mass) + body.drawn_position
        mass, first = mass + own, first + own * place
    return CarMass(mass, float(first[0] / mass), float(first[2] / mass))


def body_twist_stiffness(body: ReducedBody) -> float:
    """Return the torque about x between the towers of both axles, divided by their relative rotation [N m/rad]."""
    turns = []
    for axle in ("front", "rear"):
        left, right = (body.interface(f"{axle}_tower_{side}") for side in ("left", "right"))
        turns.append((left.Psi[2] - right.Psi[2]) / float(left.position[1] - right.position[1]))
    twist = turns[0] - turns[1]
    return float(1.0 / (twist @ np.linalg.solve(body.K, twist)))
