"""Results of very short steps in joint coordinates: the gaps of loops are known to rounding alone, which h² divides."""

import numpy as np
import pytest
from numpy.testing import assert_allclose

from floatframe import GeneralizedAlpha, Gravity, Marker, RevoluteJoint, RigidBody, System, integrate
from floatframe.model.rotations import euler_parameters_of_rotation_vector, rotation_matrix

WEIGHT = 3 * 2.0 * 9.81


def hanging_parallelogram(place):
    """Two links of 1 m hang down with a bar of 2 m between them, at rest: each hinge on the ground bears half."""
    p = euler_parameters_of_rotation_vector(np.array([0.3, -0.5, 0.7]))
    R = rotation_matrix(p)
    links = {"left": (0.0, -0.5, 0.0), "right": (2.0, -0.5, 0.0), "bar": (1.0, -1.0, 0.0)}
    bodies = [
        RigidBody(name, 2.0, np.diag([0.1, 0.2, 0.25]), position=place + R @ np.array(at), orientation=p)
        for name, at in links.items()
    ]

    def hinge(name, a, b):
        ends = [
            Marker(body, position=place + R @ np.array(at) if body == "ground" else np.array(at)) for body, at in (a, b)
        ]
        return RevoluteJoint(name, *ends, axis=R @ np.array([0.0, 0.0, 1.0]))

    joints = [
        hinge("A", ("ground", (0.0, 0.0, 0.0)), ("left", (0.0, 0.5, 0.0))),
        hinge("B", ("left", (0.0, -0.5, 0.0)), ("bar", (-1.0, 0.0, 0.0))),
        hinge("C", ("bar", (1.0, 0.0, 0.0)), ("right", (0.0, -0.5, 0.0))),
        hinge("D", ("right", (0.0, 0.5, 0.0)), ("ground", (2.0, 0.0, 0.0))),
    ]
    gravity = Gravity(tuple(R @ np.array([0.0, -9.81, 0.0])))
    return System(bodies, joints, [gravity], redundant="minimum-norm")


@pytest.mark.parametrize(("distance", "h"), [(0.0, 1e-6), (0.0, 1e-4), (600.0, 1e-4), (600.0, 1e-6)])
@pytest.mark.parametrize("formulation", ["absolute", "relative"])
def test_a_loop_at_rest_has_no_noise_in_reactions_and_accelerations(formulation, distance, h):
    """Relative coordinates had 3e-2 m/s² at 1 us."""
    place = distance * np.array([0.5, -1 / 3, 5 / 6])
    motion = integrate(
        hanging_parallelogram(place), GeneralizedAlpha(0.8), 20 * h, h, formulation=formulation, watch="off"
    )
    forces = [np.linalg.norm(motion.reaction(name).force, axis=1) for name in ("A", "D")]
    assert_allclose(forces, WEIGHT / 2, rtol=1e-7)
    assert np.abs(motion.body("bar").v_dot).max() < 1e-6 * 9.81
