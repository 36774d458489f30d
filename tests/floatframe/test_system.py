"""Descriptions that cannot be meant are refused in words."""

import subprocess
import sys

import numpy as np
import pytest

from fe_models.foundation.units import unit_system
from floatframe import (
    GROUND,
    FixedJoint,
    FlexibleBody,
    Gravity,
    Marker,
    PointForce,
    RevoluteJoint,
    RigidBody,
    SphericalJoint,
    SpringDamper,
    System,
)
from floatframe.engine.compiling.system import compiled_system
from floatframe.errors import ModelError
from tests.floatframe.point_masses import random_point_masses, reduced_body, stiffness

REDUCED = reduced_body(random_point_masses(2, 3), stiffness(2))
ROD = FlexibleBody("rod", REDUCED)
BOB = RigidBody("bob", 1.0, np.eye(3))


def compiled(joints=(), forces=(), bodies=(ROD, BOB)):
    return compiled_system(System(bodies, joints, forces))


def test_importing_the_package_does_not_load_numba_or_the_command_line():
    code = (
        "import sys, floatframe; from floatframe import System; print([m for m in ('numba', 'typer', 'matplotlib')"
        " if m in sys.modules])"
    )
    assert subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True).stdout == "[]\n"


def test_instances_of_one_reduced_body_share_its_data():
    one = compiled(bodies=[ROD]).model
    two = compiled(bodies=[ROD, FlexibleBody("other", REDUCED), BOB]).model
    assert two.body_types.blocks.size == one.body_types.blocks.size
    assert list(two.bodies.kind) == [0, 0, 1]


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        ({"mass": -1.0}, "mass: expected a number above 0, got -1"),
        ({"mass": float("nan")}, "mass: expected a finite number"),
        ({"inertia": np.diag([1.0, 1.0, 3.0])}, "no mass distribution has the principal moments 1, 1, 3"),
        ({"inertia": np.zeros((3, 3))}, "give a point mass a small extent"),
        ({"inertia": [[1, 0.5, 0], [0, 1, 0], [0, 0, 1]]}, "symmetric"),
        ({"position": (0, 0)}, r"position: expected shape \(3,\)"),
        ({"position": (0, np.nan, 0)}, "position: expected finite numbers"),
        ({"orientation": (1, 1, 0, 0)}, r"Euler parameters \(w, x, y, z\) of length 1"),
    ],
)
def test_impossible_rigid_bodies_are_refused(arguments, words):
    with pytest.raises(ModelError, match=words):
        RigidBody(**{"name": "bob", "mass": 1.0, "inertia": np.eye(3), **arguments})


@pytest.mark.parametrize(
    ("joints", "words"),
    [
        (
            [SphericalJoint("pin", GROUND, Marker("rot", "end_a"))],
            "joint 'pin': marker_b: no body 'rot'; did you mean 'rod'",
        ),
        ([SphericalJoint("pin", GROUND, Marker("rod", "end_x"))], "has no interface 'end_x'; did you mean 'end_"),
        ([SphericalJoint("pin", GROUND, Marker("rod"))], "needs an interface and no position .*choices: end_a, end_b"),
        ([SphericalJoint("pin", GROUND, Marker("bob", "end_a"))], "'bob' is not flexible"),
        ([SphericalJoint("pin", GROUND, "rod")], "expected a Marker at one end at least"),
        (
            [SphericalJoint("pin", Marker("bob"), "rod")],
            "act on a flexible body only at its interfaces; give a Marker on 'rod' at one of: end_a",
        ),
        ([SphericalJoint("pin", Marker("bob"), Marker("bob"))], "markers on two bodies, got both on 'bob'"),
        ([SphericalJoint("pin", Marker(GROUND), "ground")], "got both on 'ground'"),
    ],
)
def test_joints_at_places_that_are_not_there_are_refused(joints, words):
    with pytest.raises(ModelError, match=words):
        compiled(joints)


@pytest.mark.parametrize(
    ("force", "words"),
    [
        (lambda: SpringDamper("s", Marker("bob"), Marker(GROUND)), "expected stiffness, damping or preload above zero"),
        (lambda: SpringDamper("s", Marker("bob"), Marker(GROUND), -1.0), "stiffness: expected a number of 0 or more"),
        (lambda: PointForce("f", Marker("bob"), (0, np.inf, 0)), "force: expected finite numbers"),
        (lambda: Gravity((0, 0)), r"gravity: expected shape \(3,\)"),
        (
            lambda: RevoluteJoint("j", GROUND, Marker("bob"), axis=(0, 0, 0)),
            "expected a direction, got the zero vector",
        ),
        (lambda: FixedJoint("j", GROUND, Marker("bob"), rotation=2 * np.eye(3)), "orthonormal right-handed axes"),
        (lambda: Marker("bob", triad=-np.eye(3)), "orthonormal right-handed axes"),
    ],
)
def test_impossible_joints_and_forces_are_refused(force, words):
    with pytest.raises(ModelError, match=words):
        force()


def test_a_spring_without_direction_is_refused():
    with pytest.raises(ModelError, match="its markers coincide as placed"):
        compiled(forces=[SpringDamper("s", Marker("bob"), Marker(GROUND), 1.0, free_length=0.5)])


def test_units_of_body_and_system_must_agree():
    with pytest.raises(ModelError, match="body 'rod' is in units 'm-kg-s', but the system in 'mm-t-s'"):
        System([ROD], units=unit_system("mm-t-s"))


@pytest.mark.parametrize(
    ("bodies", "words"),
    [([], "at least one body"), ([BOB, BOB], "'bob' is used twice"), ([RigidBody("ground", 1.0, np.eye(3))], "used"),
     ([RigidBody("a/b", 1.0, np.eye(3))], "a name without '/'")],
)  # fmt: skip
def test_names_must_tell_bodies_apart(bodies, words):
    with pytest.raises(ModelError, match=words):
        System(bodies)


def test_placing_a_flexible_body_moves_its_mesh_whatever_its_frame():
    """The same part in a turned, shifted body frame starts at the same place with the same motion."""
    from dataclasses import replace

    from cms.body.reduced_body import BodyFrame
    from floatframe.model.rotations import euler_parameters_of_rotation_vector, rotation_exp, rotation_matrix

    A, o = rotation_exp(np.array([0.3, 0.2, -0.5])), np.array([0.4, -0.1, 0.2])
    turned = replace(REDUCED, frame=BodyFrame("nodal", o, A))
    placed = {"position": (1.0, 2.0, 3.0), "orientation": euler_parameters_of_rotation_vector([0.1, 0.7, 0.2]),
              "velocity": (0.1, 0.2, 0.3), "omega_B": (1.0, -2.0, 0.5)}  # fmt: skip
    plain, other = (compiled_system(System([FlexibleBody("rod", body, **placed)])).placed for body in (REDUCED, turned))
    R = rotation_matrix(plain.p[0])
    np.testing.assert_allclose(rotation_matrix(other.p[0]), R @ A, atol=1e-14)
    np.testing.assert_allclose(other.r[0], plain.r[0] + R @ o, atol=1e-14)
    omega_G = R @ plain.u[3:6]
    np.testing.assert_allclose(rotation_matrix(other.p[0]) @ other.u[3:6], omega_G, atol=1e-14)
    np.testing.assert_allclose(other.u[:3], plain.u[:3] + np.cross(omega_G, R @ o), atol=1e-14)
