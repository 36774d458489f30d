"""A small system with each part that there is, for tests by every scheme.

`PARTS` has a system for each joint, drive, coupler, force and body, `element_parts` for each element: those of
registries by their names there, so that one that is added without a system fails a test. Which scheme refuses which of
them says `part_table`; all else has to run, and to agree with generalized-alpha in small steps.
"""

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from fe_models.body.load_cases import ReducedLoadCase
from floatframe import (
    GROUND,
    FlexibleBody,
    GeneralizedAlpha,
    Gravity,
    JointForce,
    Marker,
    PointForce,
    RigidBody,
    SpringDamper,
    System,
)
from floatframe.components.mechanisms import four_bar
from floatframe.forces import BodyLoad
from floatframe.integrators import (
    EnergyDecaying,
    EnergyMomentum,
    Ida,
    RelativeGeneralizedAlpha,
    RelativeOde,
    Variational,
)
from floatframe.joints import CoordinateCoupler, JointCoordinate
from floatframe.model.functions.time_functions import cycloidal_spin_up, harmonic
from floatframe.model.functions.time_functions import table as table_function
from tests.floatframe.engine.structure_preserving import systems
from tests.floatframe.engine.structure_preserving.lines import sliding
from tests.floatframe.integrators.examples import KNOWN, STIFFENED, floating_pair
from tests.floatframe.point_masses import PointMasses, random_point_masses, reduced_body, stiffened_body, stiffness

__all__ = ["COUPLERS", "FORCES", "METHODS", "PARTS", "Part"]

#: what is compared, by its name in the table
METHODS = {
    "generalized-alpha": GeneralizedAlpha(0.9, 1e-11),
    "the same, `relative`": RelativeGeneralizedAlpha(0.9, 1e-11),
    "`RelativeOde`": RelativeOde("BDF", 1e-8, 1e-10),
    "`EnergyMomentum`": EnergyMomentum(),
    "`EnergyDecaying`": EnergyDecaying(0.5),
    "`Variational`": Variational(),
    "`Ida`": Ida(1e-6, 1e-8),
}


@dataclass(frozen=True)
class Part:
    """A system with a part, and the steps by which it is compared."""

    make: Callable[[], System]
    h: float = 5e-3
    n: int = 20  #: steps, a multiple of four: of those that are slow the first quarter is compared
    #: largest error over the way: at h/2, and where the law has edges, stiff states or unresolved modes
    tolerance: float = 5e-3
    is_smooth: bool = True  #: whether the error falls with the square of h
    #: in place of that of METHODS: a law with edges is not differentiated as finely
    ode: RelativeOde | None = None


def spherical(*forces):
    """Return the pair with a joint that leaves it three rotations."""
    return floating_pair("spherical", forces)


FRICTION = {"friction": 0.05, "friction_speed": 0.5}
TABLE = table_function([-4.0, -1.0, 1.0, 4.0], [-2.0, -0.3, 0.2, 1.0])


def joints():
    """Return a system with each joint, and with each kind of prescribed motion."""
    made = {kind: Part(lambda kind=kind: floating_pair(kind)) for kind in KNOWN}
    made["constant-velocity"] = Part(systems.constant_velocity)
    made["rolling-disc"] = Part(systems.rolling)
    made["sliding"] = Part(sliding)
    made["sliding (aligned)"] = Part(lambda: sliding(is_aligned=True))
    for kind, key, drive in (
        ("revolute", "angle", cycloidal_spin_up(4.0, 0.3)),
        ("prismatic", "distance", harmonic(0.1, 5.0)),
        ("screw", "angle", harmonic(0.3, 5.0)),
        ("universal", "angle_b", cycloidal_spin_up(4.0, 0.3)),
    ):
        made[f"{kind} (driven)"] = Part(lambda a=kind, b=key, c=drive: floating_pair(a, motions={b: c}))
    made["distance (driven)"] = Part(
        lambda: floating_pair("distance", motions={"distance": harmonic(0.1, 5.0, offset=0.5)})
    )
    made["sliding (driven)"] = Part(lambda: sliding(is_aligned=True, is_driven=True))
    joints = {f"joint {name}": part for name, part in made.items()}
    return joints | {"joints that repeat constraints": Part(shared_reactions)}


def shared_reactions():
    """Return a four-bar linkage in space whose joints share their reactions."""
    plain = four_bar()
    return System(plain.bodies, plain.joints, [Gravity((0, -9.81, 0))], redundant="minimum-norm")


def coupled(**options):
    """Return the pair with a coupler of its angle that is not engaged."""
    pair = floating_pair("revolute")
    coupler = CoordinateCoupler("latch", [(JointCoordinate("joint", "angle"), 1.0)], **options)
    return System(pair.bodies, pair.joints, pair.forces, couplers=[coupler])


COUPLERS = {
    "coupler of angles": Part(systems.geared),
    "coupler of angles and distances": Part(lambda: systems.geared(systems.RACK)),
    "driven coupler": Part(lambda: systems.geared(constant=harmonic(0.2, 5.0))),
    "coupler that is not engaged": Part(lambda: coupled(engaged=False)),
}


def loaded_body():
    """Return the pair whose flexible body has a load case."""
    plain = stiffened_body(random_point_masses(3, 3), stiffness(3, omega=6.0), size=0.2)
    f, force, torque = np.array([0.3, -0.2, 0.1]), np.array([0.1, 0.2, -0.1]), np.array([-0.1, 0.3, 0.2])
    case = ReducedLoadCase("push", "force", f, force, torque)
    return floating_pair("revolute", [BodyLoad("wind", "soft", "push", harmonic(1.0, 9.0))],
                         replace(plain, load_cases=(case,)))  # fmt: skip


def rubbed(kind, key, **numbers):
    """Return the pair with a force along or about a coordinate of its joint."""
    return floating_pair(kind, [JointForce("rub", "joint", key, **numbers)])


FORCES = {
    "gravity": Part(lambda: spherical(Gravity((0, -3.0, -9.81)))),
    "spring-damper": Part(lambda: spherical(SpringDamper("k", *systems.ENDS, 3.0, 0.4, free_length=0.8, preload=0.3))),
    "spring-damper with a table": Part(
        lambda: spherical(SpringDamper("k", Marker(GROUND, position=(2, 1, 0)), Marker("block"), characteristic=TABLE))
    ),
    "point force": Part(lambda: spherical(
        PointForce("push", Marker("soft", "end_a"), (1.0, 0.5, -0.4), (0.1, 0.2, 0.0), amplitude=harmonic(2.0, 7.0))
    )),
    "point force that follows": Part(lambda: spherical(
        PointForce("push", Marker("soft", "end_a"), (1.0, 0.5, -0.4), (0.1, 0.2, 0.0), is_follower=True)
    )),
    "load on a flexible body": Part(loaded_body),
    "force in a joint": Part(lambda: rubbed("prismatic", "distance", stiffness=3.0, damping=0.4, preload=0.1)),
    "torque in a joint": Part(lambda: rubbed("revolute", "angle", stiffness=3.0, damping=0.4, characteristic=TABLE)),
    "torque about the axis of B": Part(lambda: rubbed("universal", "angle_b", stiffness=2.0, damping=0.1)),
    "friction in a joint": Part(lambda: rubbed("revolute", "angle", **FRICTION)),
    "friction by the force in a joint": Part(
        lambda: rubbed("prismatic", "distance", friction_coefficient=0.3, **FRICTION), n=8
    ),
    "bushing": Part(lambda: systems.mounted("spherical")),
    "bushing with damping and tables": Part(
        lambda: systems.mounted("spherical", damping=2e-3 * systems.K, characteristics={"x": systems.TABLE})
    ),
    "contact with a plane": Part(lambda: systems.struck(restitution=0.6, friction=0.3, exponent=1.5), 0.01, 40),
    "elastic contact": Part(lambda: systems.struck(restitution=1.0), 0.01, 40),
    "contact with a sphere": Part(  # steps of its own near the contact: no order in h
        lambda: systems.struck(0.4, restitution=0.6, friction=0.3, exponent=1.2), 0.01, 40, is_smooth=False
    ),
    "user force": Part(lambda: floating_pair("revolute", [systems.UserForce(
        "u", {"phi": systems.ANGLE}, {"phi": "-3*phi - 0.2*phi_dot"})])),
    "user force with a state": Part(systems.controlled),
    "user force that is a function": Part(systems.programmed),
}  # fmt: skip


def massless():
    """Return a body with a mode that moves no mass."""
    places = np.array([[1.0, 0, 0], [-1.0, 0, 0], [0, 1.0, 0], [0, -1.0, 0]])
    phi = np.zeros((4, 3, 1))
    reduced = reduced_body(PointMasses(np.ones(4), places, phi), np.array([[20.0]]))
    return System([FlexibleBody("soft", reduced, omega_B=(0.3, 0.2, 1.0))])


BODIES = {
    "rigid body": Part(lambda: System([RigidBody("top", 2.0, np.diag([0.2, 0.3, 0.35]), center_of_mass=(0.1, 0.2, 0),
                                                 velocity=(0.3, 0, 0.1), omega_B=(0.3, 5.0, 0.2))])),
    "flexible body": Part(lambda: floating_pair("spherical")),
    "stiffened flexible body": Part(lambda: floating_pair("spherical", body=STIFFENED)),
    "mode without mass": Part(massless),
}  # fmt: skip

PARTS = joints() | COUPLERS | FORCES | BODIES
