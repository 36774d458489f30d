"""Systems that fly free, with each kind of joint, force and coupler that discrete schemes know: momenta are kept."""

from collections.abc import Callable

import numpy as np

from floatframe import JointForce, Marker, RevoluteJoint, RigidBody, SpringDamper, System, UserForce
from floatframe.forces import Bushing, SphereContact
from floatframe.joints import (
    AxialDistance,
    ConstantVelocityJoint,
    CoordinateCoupler,
    JointCoordinate,
    PointDistance,
    RollingDisc,
)
from floatframe.model.functions.time_functions import cycloidal_spin_up, harmonic
from floatframe.model.functions.time_functions import table as table_function
from floatframe.model.rotations import euler_parameters_of_rotation_vector
from tests.floatframe.engine.structure_preserving.lines import SLIDING
from tests.floatframe.integrators.examples import AXIS, STIFFENED, floating_pair
from tests.floatframe.model.elements.laws import Creeping, Loop, Mount, OnPlane, Spring

__all__ = ["CONNECTED", "CONTACTS", "FORCED", "HELD_BY_ELEMENTS", "POTENTIALS", "ROLLING", "geared"]

K = np.array([
    [30, 1, 2, 0.3, 0.1, 0.2], [1, 25, 1, 0.1, 0.4, 0], [2, 1, 40, 0, 0.2, 0.1], [0.3, 0.1, 0, 3, 0.2, 0.1],
    [0.1, 0.4, 0.2, 0.2, 2, 0.1], [0.2, 0, 0.1, 0.1, 0.1, 2.5],
])  # fmt: skip
ENDS = Marker("soft", "end_b"), Marker("block", position=(0.3, 0, 0.1))
ANGLE = JointCoordinate("joint", "angle")


def mounted(joint="revolute", **options):
    """Return the pair with a bushing beside its joint, whose six deformations are coupled."""
    return floating_pair(joint, [Bushing("mount", *ENDS, K, **options)])


def constant_velocity():
    """Return the pair with two shafts that turn equally."""
    pair = floating_pair("spherical")
    joint = ConstantVelocityJoint("joint", Marker("soft", "end_a"), "block", axis=AXIS)
    return System(pair.bodies, [joint], pair.forces)


def geared(terms=None, constant=None):
    """Return the pair with a wheel on the flexible body, coupled with the joint of the pair."""
    pair = floating_pair("revolute")
    wheel = RigidBody("wheel", 0.3, np.diag([0.02, 0.03, 0.04]), omega_B=(0, 0, 30.0),
                      position=pair.bodies[0].frame_position + np.array([0.2, 0.9, 0.4]))  # fmt: skip
    hinge = RevoluteJoint("hinge", ENDS[0], Marker("wheel", position=(0.05, 0.02, 0)), axis=(0, 0.2, 1))
    rope = SpringDamper("rope", Marker("wheel", position=(0.3, 0, 0)), Marker("block"), 1.0)
    terms = terms or [(ANGLE, 3.0), (JointCoordinate("hinge", "angle"), -1.0)]
    return System([*pair.bodies, wheel], [*pair.joints, hinge], [*pair.forces, rope],
                  couplers=[CoordinateCoupler("gear", terms, constant)])  # fmt: skip


RACK = [
    (AxialDistance(Marker("soft", "end_a"), Marker("wheel"), (1, 0, 0)), 1.0),
    (PointDistance(Marker("block"), Marker("wheel")), 0.5),
    (JointCoordinate("hinge", "angle"), -0.1),
]


def controlled():
    """Return the pair with a user force along an angle and a distance, and a state."""
    forces = {"phi": "-3*phi - 0.2*phi_dot - 2*e", "l": "t - 4*(l - 0.7)"}
    force = UserForce(
        "user", {"phi": ANGLE, "l": PointDistance(*ENDS)}, forces, {"e": "10*(phi - e) + 0.2*sin(5*t)"}, {"e": 0.3}
    )  # fmt: skip
    return floating_pair("revolute", [force])


def programmed():
    """Return the pair with a user force that is a function in Python."""

    def function(t, x, v, z, Q, z_dot):
        Q[0], z_dot[0] = -3 * x[0] ** 3 - v[0], v[0] - z[0]

    force = UserForce("user", {"phi": ANGLE}, ("phi",), states={"e": 0.3}, function=function)
    return floating_pair("revolute", [force])


def struck(radius_a=None, **options):
    """Return the pair, fixed together, and a ball that strikes it: a plane on it, or a sphere."""
    pair = floating_pair("fixed")
    place = pair.bodies[0].frame_position + np.array([1.5, 1.2, 0.4])
    ball = RigidBody("ball", 0.3, 0.01 * np.eye(3), position=place, velocity=(0.5, -2.0, 0.3), omega_B=(1, 2, 3.0))
    contact = SphereContact("touch", Marker("block", position=(0, 0.1, 0)), Marker("ball"), 0.3, radius_a,
                            axis=(0.1, 1, 0), stiffness=60.0, friction_speed=0.1, **options)  # fmt: skip
    return System([*pair.bodies, ball], pair.joints, [*pair.forces, contact])


def rolling():
    """Return a wheel that rolls on a plate, which flies."""
    radius, lean = 0.5, euler_parameters_of_rotation_vector(np.array([0.3, 0, 0]))
    plate = RigidBody("plate", 5.0, np.diag([1.0, 1.2, 2.0]), position=(0.1, 0, -0.05), velocity=(1.0, 0, 0),
                      omega_B=(0.1, 0.2, -0.1))  # fmt: skip
    wheel = RigidBody("wheel", 2.0, np.diag([0.06, 0.12, 0.06]), position=(0, 0, radius * np.cos(0.3)),
                      orientation=lean, omega_B=(0.9, 6.0, 1.5))  # fmt: skip
    pull = SpringDamper("pull", Marker("wheel"), Marker("plate", position=(0.3, 0.1, -0.5)), 100.0)
    disc = RollingDisc("roll", Marker("plate", position=(0, 0, 0.05)), Marker("wheel"), radius)
    return System([plate, wheel], [disc], [pull])


def with_element(element, joint="spherical", body=None):
    """Return the pair with a public element."""
    pair = floating_pair(joint, body=body)
    return System(pair.bodies, pair.joints, pair.forces, elements=[element])


def without_joint(element):
    """Return the pair held together by an element."""
    pair = floating_pair("revolute")
    return System(pair.bodies, [], pair.forces, elements=[element])


TABLE = table_function([-4.0, -1.0, 1.0, 4.0], [-0.2, -0.03, 0.02, 0.1])
#: what has a potential or holds something: energy is kept
POTENTIALS: dict[str, Callable[[], System]] = {
    "bushing": lambda: mounted(preload=np.array([0.1, 0.2, 0, 0.05, 0, 0.1])),
    "bushing half way": lambda: mounted(preload=np.array([0.1, 0.2, 0, 0.05, 0, 0.1]), axes="half way"),
    "constant velocity": constant_velocity,
    "gear": geared,
    "rack": lambda: geared(RACK),
    "element between points": lambda: with_element(Spring("law", *ENDS, 30.0)),
    "element that returns to a point": lambda: with_element(Loop("law", *ENDS, ENDS[0], 0.5, 0.6)),
    "element between bodies": lambda: with_element(Mount("law", *ENDS, 2.0, 2.0, 1.0)),
    "element between bodies that bend": lambda: with_element(Mount("law", *ENDS, 2.0, 2.0, 1.0), body=STIFFENED),
}
#: what gives or takes energy beside
FORCED: dict[str, Callable[[], System]] = {
    "damped bushing": lambda: mounted(
        "spherical", damping=2e-3 * K, characteristics={"x": TABLE, "rz": TABLE}, axes="b"
    ),
    "driven gear": lambda: geared(constant=harmonic(0.2, 5.0)),
    "damped element": lambda: with_element(Mount("law", *ENDS, 2.0, 2.0, 1.0, 2.0), "revolute"),
    "element with a state": lambda: with_element(Creeping("law", *ENDS, 30.0, 0.2)),
    "user force": controlled,
    "function": programmed,
    "user force about the axis of B": lambda: floating_pair(
        "universal", [UserForce("u", {"b": JointCoordinate("joint", "angle_b")}, {"b": "-2*b"})]
    ),
    "spring about the axis of B": lambda: floating_pair(
        "universal", [JointForce("u", "joint", "angle_b", stiffness=2.0, damping=0.1)]
    ),
    "drive about the axis of B": lambda: floating_pair("universal", motions={"angle_b": cycloidal_spin_up(4.0, 0.3)}),
}
CONTACTS: dict[str, Callable[[], System]] = {
    "elastic contact with a plane": lambda: struck(restitution=1.0),
    "contact with a plane": lambda: struck(restitution=0.6, friction=0.3, exponent=1.5),
    "contact with a sphere": lambda: struck(0.4, restitution=0.6, friction=0.3, exponent=1.2),
}
ROLLING: dict[str, Callable[[], System]] = {"rolling disc": rolling}
#: elements with reactions of their own, which the variational scheme refuses
HELD_BY_ELEMENTS: dict[str, Callable[[], System]] = {
    "plane of an element": lambda: without_joint(
        OnPlane("law", Marker("soft", "end_a"), Marker("block", position=(0.1, 0.4, 0.2)))
    ),
}
POTENTIALS |= {name: make for name, make in SLIDING.items() if "driven" not in name}
FORCED |= {name: make for name, make in SLIDING.items() if "driven" in name}
CONNECTED = POTENTIALS | FORCED | CONTACTS | ROLLING | HELD_BY_ELEMENTS
