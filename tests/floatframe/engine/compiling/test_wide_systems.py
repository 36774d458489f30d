"""What is found without a look at all others is what a look at all others finds."""

import numpy as np
import pytest
from numpy.testing import assert_array_equal

from floatframe import GROUND, Marker, PointForce, RevoluteJoint, RigidBody, System
from floatframe.engine.compiling.elimination_order import plan_elimination
from floatframe.engine.compiling.markers import find_body
from floatframe.engine.compiling.system import compiled_system
from floatframe.errors import ModelError


def least_degrees(n, groups):
    """Return the order of least degree by trying all that are left, the first of equals."""
    neighbours = [set() for _ in range(n)]
    for group in groups:
        for j in group:
            neighbours[j] |= set(group) - {j}
    left, order = set(range(n)), []
    while left:
        j = min(left, key=lambda c: (len(neighbours[c]), c))
        left.remove(j)
        order.append(j)
        for i in neighbours[j]:
            neighbours[i] = (neighbours[i] | neighbours[j]) - {i, j}
    return order


@pytest.mark.parametrize("seed", range(8))
def test_connections_are_eliminated_by_least_degree(seed):
    rng = np.random.default_rng(seed)
    n = 30
    groups = [sorted(rng.choice(n, size=rng.integers(1, 5), replace=False).tolist()) for _ in range(25)]
    ends, connection_of = [], []
    for group in groups:
        ends.append(list(range(len(connection_of), len(connection_of) + len(group))))
        connection_of += group
    plan = plan_elimination([2] * n, ends, np.array(connection_of))
    assert_array_equal(plan.order, least_degrees(n, groups))


def pair(*forces):
    """Return two bodies on hinges with loads."""
    bodies = [RigidBody(name, 1.0, np.eye(3)) for name in ("a", "b")]
    joints = [RevoluteJoint("one", GROUND, Marker("a")), RevoluteJoint("two", "a", Marker("b"))]
    return System(bodies, joints, forces)


def test_every_body_has_the_markers_of_its_own_loads():
    points = [("b", 0.1), ("a", 0.2), ("b", 0.3)]
    loads = [
        PointForce(f"f{k}", Marker(name, position=(x, 0, 0)), force=(1, 0, 0)) for k, (name, x) in enumerate(points)
    ]
    model = compiled_system(pair(*loads)).model
    places = [
        model.markers.position[model.bodies.loaded[model.bodies.load0[i] : model.bodies.load0[i + 1]], 0]
        for i in (0, 1)
    ]
    assert_array_equal(places[0], [0.2])
    assert_array_equal(places[1], [0.1, 0.3])


def test_bodies_are_found_by_name_and_one_that_is_missing_is_told():
    system = pair()
    assert [find_body(system, "here", name) for name in ("ground", "a", "b")] == [-1, 0, 1]
    with pytest.raises(ModelError, match="here: no body 'c'"):
        find_body(system, "here", "c")
