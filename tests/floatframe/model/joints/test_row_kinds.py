"""The record of the kinds of rows: one entry for each, and the same coordinates for results, analyses and kernels."""

import numpy as np
import pytest
from numpy.testing import assert_allclose

from floatframe import JointForce, Marker, RigidBody, System
from floatframe.engine.compiling.markers import joint_markers, marker_pose, n_q_of
from floatframe.engine.compiling.system import compiled_system
from floatframe.engine.initial_conditions.newton_equations import displaced, in_ground_axes, set_iterate
from floatframe.engine.kernels.entry import evaluate_and_linearize
from floatframe.engine.kernels.work import new_work
from floatframe.model.joints import JOINTS, CylindricalJoint, DistanceJoint, ScrewJoint, UniversalJoint
from floatframe.model.joints.rows import (
    ROW_KINDS,
    RelativePlace,
    is_held,
    is_held_length,
    is_held_position,
    is_held_velocity,
)
from floatframe.model.rotations import euler_parameters_of_rotation_vector
from floatframe.model.state import State
from floatframe.results.small_motions.joint_rates import coordinate_rows
from tests.floatframe.model.joints.examples import CASES, pair


def test_the_record_of_a_kind_is_found_by_its_code():
    assert [kind.code for kind in ROW_KINDS] == list(range(len(ROW_KINDS)))
    assert len({kind.name for kind in ROW_KINDS}) == len(ROW_KINDS)


def test_a_row_holds_a_position_or_a_velocity_or_says_what_the_wrench_is():
    codes = np.arange(len(ROW_KINDS))
    assert not (is_held_position(codes) & is_held_velocity(codes)).any()
    assert (is_held(codes) == (is_held_position(codes) | is_held_velocity(codes))).all()
    assert not (is_held_length(codes) & ~is_held_position(codes)).any()
    assert not any(is_held(np.array([kind.code]))[0] for kind in ROW_KINDS if kind.is_free or kind.is_loaded)


@pytest.mark.parametrize("make", CASES)
def test_every_coordinate_of_a_joint_belongs_to_one_of_its_rows(make):
    joint = pair(make).joints[0]
    rows = joint.rows(np.eye(3), np.eye(3), np.array([0.3, 0.2, 0.1]))
    assert sorted(row.coordinate_name for row in rows if row.coordinate) == sorted(joint.coordinates)


def test_every_joint_of_the_registry_is_tried():
    tried = {type(pair(case.values[0]).joints[0]) for case in CASES}
    assert {JOINTS[name] for name in JOINTS if name != "sliding"} <= tried


def two_bodies(joint, forces=(), seed=0):
    rng = np.random.default_rng(seed)
    bodies = [
        RigidBody(name, 1.0, np.diag([1.0, 1.5, 2.0]), position=rng.normal(size=3),
                  orientation=euler_parameters_of_rotation_vector(rng.normal(size=3)))
        for name in ("first", "second")
    ]  # fmt: skip
    return System(bodies, [joint(Marker("first", position=(0.1, 0.2, 0.3)), Marker("second", position=(0.3, 0, 0.1)))],
                  list(forces))  # fmt: skip


COORDINATES = {
    "distance along an axis": (lambda *e: CylindricalJoint("j", *e, axis=(0.2, 1, 0.3)), "distance"),
    "distance of points": (lambda *e: DistanceJoint("j", *e), "distance"),
    "distance of a screw": (lambda *e: ScrewJoint("j", *e, axis=(0.2, 1, 0.3), lead=0.7), "distance"),
    "angle about an axis of B": (lambda *e: UniversalJoint("j", *e), "angle_b"),
}


@pytest.mark.parametrize(("make", "name"), COORDINATES.values(), ids=COORDINATES)
def test_rates_of_coordinates_in_analyses_are_derivatives_of_their_values(make, name):
    """Where the two axes of an angle are parallel, or the axis is that of the other marker: for a turn about it."""
    system = two_bodies(make)
    compiled = compiled_system(system)
    model, placed = compiled.model, compiled.placed
    ends, n_q = joint_markers(system, system.joints[0], placed), n_q_of(system)

    def place(state):
        (r_a, A_a), (r_b, A_b) = (marker_pose(end, state, n_q) for end in ends)
        return RelativePlace(A_a, A_b, r_b - r_a)

    rows = system.joints[0].rows(*place(placed))
    own = next(row.coordinate for row in rows if row.coordinate_name == name)
    rng = np.random.default_rng(3)
    state = displaced(model, placed, 0.1 * rng.normal(size=12))
    work = new_work(model)
    set_iterate(work, state)
    row = coordinate_rows(system, compiled, work, state)[f"j.{name}"]
    s, direction = 1e-6, rng.normal(size=12)
    if own.is_angle:  # B turns about the axis; axes of markers are those of their bodies
        direction[:9], direction[9:] = 0.0, place(state).A_b.T @ own.direction(place(state))
    moved = []
    for k in (-s, s):
        step = in_ground_axes(model, state, k * direction)
        moved.append(float(own.value(place(displaced(model, state, step)))))
    assert_allclose(row @ direction, (moved[1] - moved[0]) / (2 * s), rtol=0, atol=1e-8)


@pytest.mark.parametrize(
    ("make", "name"),
    [each for key, each in COORDINATES.items() if key in ("distance along an axis", "angle about an axis of B")],
)
def test_kernels_measure_a_coordinate_as_the_record_says(make, name):
    """A spring along it gives its value, a damper its rate, in the row that carries both."""
    k, c = 3.0, 0.7
    system = two_bodies(make, [JointForce("f", "j", name, stiffness=k, damping=c)])
    compiled = compiled_system(system)
    model, placed = compiled.model, compiled.placed
    ends, n_q = joint_markers(system, system.joints[0], placed), n_q_of(system)
    rng = np.random.default_rng(4)
    at = displaced(model, placed, 0.3 * rng.normal(size=12))
    state = State(at.r, at.p, at.q, rng.normal(size=12))
    (r_a, A_a), (r_b, A_b) = (marker_pose(end, placed, n_q) for end in ends)
    rows = system.joints[0].rows(A_a, A_b, r_b - r_a)
    number = next(i for i, row in enumerate(rows) if row.coordinate_name == name)
    own = rows[number].coordinate
    work = new_work(model)
    set_iterate(work, state)
    evaluate_and_linearize(model, work, 1.0, 0.0, 0.0)
    a, b = int(model.connections.a[0]), int(model.connections.b[0])
    place = RelativePlace(work.markers.A[a], work.markers.A[b], work.markers.r[b] - work.markers.r[a])
    slip = work.markers.v[b] - work.markers.v[a] - np.cross(work.markers.omega[a], place.d)
    rate = own.direction(place) @ own.moves(slip, work.markers.omega[b] - work.markers.omega[a])
    assert_allclose(work.connections.g[number], -k * own.value(place) - c * rate, rtol=0, atol=1e-13)
