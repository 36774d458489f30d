"""Evaluation of the road car: its motion over time, and its mass."""

from dataclasses import dataclass

import numpy as np

from cms.body.reduced_body import ReducedBody
from fe_models.foundation.arrays import Array
from floatframe.machines.road_car.description import CORNERS, RoadCar
from floatframe.machines.road_car.steady_turn import CarMass
from floatframe.model.bodies.flexible_body import FlexibleBody
from floatframe.model.system import System
from floatframe.results.element_motion import element_motion
from floatframe.results.trajectory import Trajectory

__all__ = ["Driven", "body_twist_stiffness", "car_mass", "driven"]


@dataclass(frozen=True, eq=False)
class Driven:
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


def driven(system: System, motion: Trajectory) -> Driven:
    """Return the quantities of a motion of the car."""
    seen = element_motion(system, motion, "seen").outputs
    names = [element.name for element in system.elements]
    lines = []
    if "roll_control" in names:
        circuit = element_motion(system, motion, "roll_control").outputs
        lines = [circuit[f"pressure line_{side}"] for side in ("left", "right")]
    vx, vy = (np.gradient(seen[key], motion.t) for key in ("x", "y"))
    a_x, a_y = np.gradient(vx, motion.t), np.gradient(vy, motion.t)
    return Driven(
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
            own, place = body.mass, np.asarray(body.center_of_mass) + np.asarray(body.position)
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
