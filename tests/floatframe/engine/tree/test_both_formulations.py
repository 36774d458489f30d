"""Every mechanism in absolute and in relative coordinates: one motion, one set of reactions."""

import numpy as np
import pytest
from numpy.testing import assert_allclose

from floatframe import GROUND, GeneralizedAlpha, Marker, RevoluteJoint, RigidBody, System, integrate
from floatframe.engine.tree.topology import tree_of
from tests.floatframe.engine.tree.mechanisms import MECHANISMS

METHOD = GeneralizedAlpha(0.8, 1e-10)
T_END, H = 0.12, 2e-3
#: a top spins by itself in absolute coordinates, whose error is then small; that of the others falls as it should here
FINER = {"top": 1e-3}


def seen(system, motion):
    """Places, deformations, reactions and energy of a motion, each with what it may be measured by."""
    found = {}
    for body in system.bodies:
        found[f"r of {body.name}"] = motion.body(body.name).r
        if motion.body(body.name).q.size:
            found[f"q of {body.name}"] = motion.body(body.name).q
    for joint in system.joints:
        found[f"force of {joint.name}"] = motion.reaction(joint.name).force
        found[f"moment of {joint.name}"] = motion.reaction(joint.name).moment
    found["energy"] = motion.energies.total
    return found


@pytest.mark.parametrize("name", MECHANISMS)
def test_both_formulations_agree_to_the_error_of_the_integrator(name):
    """They differ by less than half of what halving the step changes in both; joints of the tree stay closed."""
    system, h = MECHANISMS[name](), FINER.get(name, H)
    motions = {
        (formulation, k): integrate(system, METHOD, T_END, h / k, output_every=k, formulation=formulation)
        for formulation in ("absolute", "relative")
        for k in (1, 2)
    }
    found = {key: seen(system, motion) for key, motion in motions.items()}
    force = max(np.abs(x).max() for what, x in found["absolute", 2].items() if what[0] in "fm")
    least = {"r": 1e-11, "q": 1e-11, "f": 1e-8 * force, "m": 1e-8 * force, "e": 1e-11}  # what Newton's method leaves
    for what, absolute in found["absolute", 2].items():
        relative = found["relative", 2][what]
        error = sum(np.abs(found[each, 1][what] - found[each, 2][what]).max() for each in ("absolute", "relative"))
        assert_allclose(relative, absolute, rtol=0, atol=0.5 * error + least[what[0]], err_msg=what)
    parts = tree_of(system)
    for joint in system.joints:
        if joint.name not in (*parts.cut, *parts.constrained):
            drift = motions["relative", 1].drift(joint.name)
            for of_joint in (drift.distance, drift.angle, drift.distance_rate, drift.angle_rate):
                assert of_joint.max() < 1e-11  # lengths of 1, speeds of 20


def test_a_motion_of_a_free_turning_body_is_exact_in_its_own_coordinates():
    """A hinge at constant speed: relative coordinates follow it exactly with any step."""
    rotor = RigidBody("rotor", 2.0, np.diag([1.0, 2.0, 3.0]), position=(0.5, 0.0, 0.0), omega_B=(0.0, 0.0, 6.0),
                      velocity=(0.0, 3.0, 0.0))  # fmt: skip
    system = System([rotor], [RevoluteJoint("hinge", GROUND, Marker("rotor", position=(-0.5, 0.0, 0.0)))])
    h = 0.1
    motion = integrate(system, METHOD, 1.0, h, formulation="relative")
    angle = 6.0 * motion.t
    exact = 0.5 * np.column_stack([np.cos(angle), np.sin(angle), np.zeros_like(angle)])
    assert_allclose(motion.body("rotor").r, exact, rtol=0, atol=1e-12)
    assert_allclose(motion.reaction("hinge").force, 2.0 * 6.0**2 * exact, rtol=0, atol=1e-10)
