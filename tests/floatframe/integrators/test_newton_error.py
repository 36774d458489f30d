"""What Newton's method leaves open in a step is far below the error of the step itself, whatever the forces.

A step ends where the next correction is expected to be small enough, without making it. Each motion is compared with
itself under a tolerance at roundoff, and this difference with what half the step changes: constraints, modes that the
step does not resolve, a contact that closes between two steps, dry friction that turns about, a stiff spring.
"""

import numpy as np
import pytest

from floatframe import (
    GROUND,
    GeneralizedAlpha,
    Gravity,
    JointForce,
    Marker,
    RevoluteJoint,
    RigidBody,
    SpringDamper,
    System,
    integrate,
)
from floatframe.components.mechanisms import four_bar, slider_crank
from floatframe.forces import SphereContact
from tests.floatframe.integrators.examples import pendulum
from tests.floatframe.model.bodies.examples import spinning
from tests.floatframe.model.elements.laws import Yielding

SMALL = 1e-3  # of the error of the integrator


def bouncing():
    """Return a ball that meets the floor with a spin, is thrown back by it and rolls on."""
    ball = RigidBody("ball", 1.0, 0.004 * np.eye(3), position=(0, 0, 0.11), velocity=(0.5, 0, -1), omega_B=(0, 3, 0))
    floor = SphereContact(
        "floor", Marker(GROUND), Marker("ball"), 0.1, modulus=1e7, restitution=0.7, friction=0.3, friction_speed=0.05
    )
    return System([ball], [], [Gravity((0, 0, -9.81)), floor])


def rubbing():
    """Return a pendulum with dry friction in its hinge, by a torque and by the force in the bearing."""
    rod = RigidBody("rod", 1.0, np.diag([0.01, 0.1, 0.1]), position=(0.5, 0, 0))
    hinge = RevoluteJoint("hinge", GROUND, Marker("rod", position=(-0.5, 0, 0)), axis=(0, 1, 0))
    friction = JointForce("rub", "hinge", "angle", friction=0.5, friction_coefficient=0.05, friction_speed=0.05)
    return System([rod], [hinge], [Gravity((0, 0, -9.81)), friction])


def falling():
    """Return a four-bar that falls from where its crank stands at an angle."""
    still = four_bar(angle=1.0)
    return System(still.bodies, still.joints, [Gravity((0, -9.81, 0))])


def stiffly_sprung():
    """Return a rod on a stiff spring, whose period is six steps."""
    rod = RigidBody("rod", 1.0, np.diag([0.01, 0.1, 0.1]), position=(0.5, 0, 0), omega_B=(1.0, 2.0, 3.0))
    spring = SpringDamper(
        "spring",
        Marker(GROUND, position=(-0.2, 0, 0)),
        Marker("rod", position=(-0.5, 0, 0)),
        stiffness=1e6,
        damping=20.0,
        free_length=0.2,
    )
    return System([rod], [], [Gravity((0, 0, -9.81)), spring])


def yielding():
    """Return a rod in the field of a force that hardens and creeps."""
    rod = RigidBody("rod", 1.0, np.diag([0.01, 0.1, 0.1]), velocity=(0, 0, 1.0), omega_B=(1.0, 2.0, 3.0))
    force = Yielding("force", Marker("rod", position=(-0.2, 0.1, 0)))
    return System([rod], [], [Gravity((0, 0, -9.81))], elements=[force])


#: name: the system, h, the end
PROBLEMS = {
    "elastic pendulum": (pendulum, 0.01, 0.5),
    "free body with fast modes": (spinning, 0.05, 1.0),
    "closed loop": (falling, 0.01, 0.5),
    "slider-crank let go": (lambda: slider_crank(angle=0.4, speed=20.0), 0.002, 0.3),
    "contact with friction": (bouncing, 0.0005, 0.1),
    "dry friction": (rubbing, 0.005, 0.6),
    "stiff spring": (stiffly_sprung, 0.001, 0.1),
    "element with a state": (yielding, 0.002, 0.3),
}


def motions(name):
    """Return the motion, the same by an exact Newton's method, and that by exact half steps."""
    make, h, end = PROBLEMS[name]
    every = max(1, round(end / h / 20))
    return [
        integrate(make(), GeneralizedAlpha(0.8, tolerance), end, step, output_every=round(every * h / step))
        for tolerance, step in ((1e-8, h), (1e-14, h), (1e-14, h / 2))
    ]


def apart(a, b, name):
    """Return the largest difference of one kind of numbers of two motions over the largest of them."""
    x, y = (each.source.read(name) for each in (a, b))
    return np.abs(x - y).max() / np.abs(y).max()


@pytest.mark.parametrize("name", PROBLEMS)
def test_newton_leaves_less_than_a_thousandth_of_the_error_of_the_step(name):
    by_default, exact, halved = motions(name)
    for what in ("position", "q", "u", "w"):
        if exact.source.read(what).size > 0:
            assert apart(by_default, exact, what) < SMALL * apart(exact, halved, what), what
