"""Systems, bodies and helpers that several tests share: coordinate coupler, every joint."""

import numpy as np
import pytest

from floatframe import (
    GROUND,
    FixedJoint,
    FlexibleBody,
    Gravity,
    JointForce,
    Marker,
    PrismaticJoint,
    RevoluteJoint,
    RigidBody,
    SphericalJoint,
    System,
)
from floatframe.engine.compiling.system import compiled_system
from floatframe.engine.initial_conditions.newton_equations import set_iterate
from floatframe.engine.kernels.entry import evaluate_and_linearize, rates_of_constraints
from floatframe.engine.kernels.work import new_work
from floatframe.joints import (
    AxialAngle,
    AxialDistance,
    ConstantOrientation,
    ConstantVelocityJoint,
    CoordinateCoupler,
    CylindricalJoint,
    DistanceJoint,
    JointCoordinate,
    PlanarJoint,
    PointDistance,
    PointOnLine,
    PointOnPlane,
    RollingDisc,
    ScrewJoint,
    UniversalJoint,
)
from floatframe.model.joints.rows import is_held, is_held_velocity
from tests.floatframe.engine.kernels.examples import turned_triad
from tests.floatframe.point_masses import random_point_masses, reduced_body, stiffness

AXIS = (0.2, 1.0, 0.3)
JOINTS = {  # make(name, a, b), constraints
    "fixed": (lambda *ends: FixedJoint("j", *ends), 6),
    "revolute": (lambda *ends: RevoluteJoint("j", *ends, axis=AXIS), 5),
    "spherical": (lambda *ends: SphericalJoint("j", *ends), 3),
    "prismatic": (lambda *ends: PrismaticJoint("j", *ends, axis=AXIS), 5),
    "cylindrical": (lambda *ends: CylindricalJoint("j", *ends, axis=AXIS), 4),
    "screw": (lambda *ends: ScrewJoint("j", *ends, axis=AXIS, lead=0.7), 5),
    "planar": (lambda *ends: PlanarJoint("j", *ends, axis=AXIS), 3),
    "point-on-line": (lambda *ends: PointOnLine("j", *ends, axis=AXIS), 2),
    "point-on-plane": (lambda *ends: PointOnPlane("j", *ends, axis=AXIS), 1),
    "universal": (lambda *ends: UniversalJoint("j", *ends, axis=(1, 0.1, 0), axis_b=(0, 1, 0)), 4),
    "distance": (lambda *ends: DistanceJoint("j", *ends), 1),
    "constant-velocity": (lambda *ends: ConstantVelocityJoint("j", *ends, axis=AXIS, axis_b=(0, 1, 0.1)), 4),
    "constant-orientation": (lambda *ends: ConstantOrientation("j", *ends), 3),
    "rolling-disc": (lambda *ends: RollingDisc("j", *ends, radius=0.8, axis=AXIS, axis_b=(1, 0.1, 0)), 3),
}
CASES = [pytest.param(make, id=name) for name, (make, _) in JOINTS.items()]


def pair(make, *, is_apart=True):
    """A flexible and a rigid body with a joint between them, their markers as placed apart (or in one place)."""
    flexible = reduced_body(random_point_masses(3, 3), stiffness(3), interfaces=2)
    place = flexible.interface("end_a").position
    bodies = [
        FlexibleBody("first", flexible, omega_B=(0.3, -0.2, 0.5), velocity=(0.1, 0.3, -0.2)),
        RigidBody("second", 2.0, np.diag([1.0, 1.5, 2.0]), (0.1, -0.2, 0.3), position=place,
                  omega_B=(-0.4, 0.2, 0.3)),
    ]  # fmt: skip
    at = np.array([0.4, 0.2, -0.3]) if is_apart else np.zeros(3)
    joint = make(Marker("first", "end_a", triad=turned_triad(4)), Marker("second", position=at, triad=turned_triad(5)))
    return System(bodies, [joint], [Gravity((0.5, -1.0, -9.81))])


def held(system, state, t):
    """Return what the joint holds, its rate and its second rate at zero acceleration (of velocities: zero)."""
    model = compiled_system(system).model
    work = new_work(model)
    work.state.time[...] = t
    set_iterate(work, state)
    evaluate_and_linearize(model, work, 1.0, 0.0, 0.0)
    rows = is_held(model.rows.kind)
    rate, bias = (part[rows] for part in rates_of_constraints(model, work))
    is_velocity = is_held_velocity(model.rows.kind[rows])
    return work.connections.g[rows].copy(), np.where(is_velocity, bias, rate), np.where(is_velocity, np.nan, bias)


def three_bodies(joints, coupler):
    flexible = reduced_body(random_point_masses(3, 3), stiffness(3), interfaces=2)
    bodies = [
        FlexibleBody("first", flexible, omega_B=(0.3, -0.2, 0.5), velocity=(0.1, 0.3, -0.2)),
        RigidBody("second", 2.0, np.diag([1.0, 1.5, 2.0]), (0.1, -0.2, 0.3), omega_B=(-0.4, 0.2, 0.3)),
        RigidBody("third", 1.0, np.diag([1.0, 1.5, 1.2]), position=(0.3, 1.0, 0.4)),
    ]
    return System(bodies, [*joints, coupler], [Gravity((0.5, -1.0, -9.81))])


def ends():
    return (
        Marker("first", "end_a", triad=turned_triad(4)),
        Marker("second", position=(0.4, 0.2, -0.3), triad=turned_triad(5)),
        Marker("third", position=(0.1, 0.2, 0.3), triad=turned_triad(6)),
    )


def coupled_pairs():
    a, b, c = ends()
    first = CylindricalJoint("first", a, b, axis=AXIS)
    second = UniversalJoint("second", b, c, axis=(1, 0.1, 0), axis_b=(0, 1, 0))
    rail = PrismaticJoint("rail", GROUND, c, axis=AXIS)
    return {
        "angle to angle": ([first], [(JointCoordinate("first", "angle"), 2.0), (AxialAngle(b, c, AXIS), -0.7)]),
        "angle to distance": ([first], [(JointCoordinate("first", "angle"), 2.0),
                                        (JointCoordinate("first", "distance"), 3.0)]),
        "cross": ([second], [(JointCoordinate("second", "angle"), 1.0), (JointCoordinate("second", "angle_b"), 1.3)]),
        "distances": ([rail], [(JointCoordinate("rail", "distance"), 1.0), (PointDistance(a, c), -2.0),
                               (AxialDistance(a, b, AXIS), 0.4)]),
    }  # fmt: skip


def wheels(ratio, terms=None, torque=0.7, inertias=(0.7, 0.3)):
    bodies = [RigidBody(name, 1.0, np.diag([0.5, 0.5, J])) for name, J in zip("ab", inertias, strict=True)]
    hubs = [RevoluteJoint(f"hub {name}", GROUND, Marker(name)) for name in "ab"]
    terms = terms or [(JointCoordinate("hub a", "angle"), 1.0), (JointCoordinate("hub b", "angle"), ratio)]
    gear = CoordinateCoupler("gear", terms)
    motor = JointForce("motor", "hub a", "angle", preload=torque)
    return System(bodies, [*hubs, gear], [motor])
