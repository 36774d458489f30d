"""Constraints that repeat others are told however long a system is; poor conditioning is not taken for it."""

from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose

from floatframe import (
    GROUND,
    GeneralizedAlpha,
    Gravity,
    Marker,
    RevoluteJoint,
    RigidBody,
    SphericalJoint,
    System,
    integrate,
)
from floatframe.analyses import consistent_state, mobility, relative_model
from floatframe.components.mechanisms import chain, four_bar
from floatframe.engine.compiling.system import compiled_system
from floatframe.engine.initial_conditions import initial
from floatframe.engine.initial_conditions.freedoms import scaled_constraints
from floatframe.engine.initial_conditions.initial import dependent_count, repeated_constraints
from floatframe.engine.kernels.work import new_work
from floatframe.engine.tree.topology import tree_of
from floatframe.errors import ModelError
from floatframe.joints import CylindricalJoint, DistanceJoint
from floatframe.model.rotations import euler_parameters_of_rotation_vector

WEIGHT = Gravity((0.0, -9.81, 0.0))


def count(system):
    compiled = compiled_system(system)
    return repeated_constraints(compiled, new_work(compiled.model), tree_of(system).tree, compiled.placed)


def ring(n, joint=RevoluteJoint, other=RevoluteJoint):
    """A regular polygon of n links with hinges, one corner of another kind at the link opposite, one at the last."""
    angle = 2 * np.pi * np.arange(n) / n
    corners = np.column_stack([np.cos(angle), np.sin(angle), 0 * angle])
    links, side = [], np.linalg.norm(corners[1] - corners[0])
    for k in range(n):
        a, b = corners[k], corners[(k + 1) % n]
        turn = np.arctan2(*(b - a)[1::-1])
        p = euler_parameters_of_rotation_vector(np.array([0.0, 0.0, turn]))
        links.append(RigidBody(f"link {k}", 1.0, 0.1 * np.eye(3), position=0.5 * (a + b), orientation=p))
    first, last = Marker("link 0", position=(-side / 2, 0, 0)), [side / 2, 0, 0]
    joints = [RevoluteJoint("ground", Marker(GROUND, position=corners[0]), first, axis=(0, 0, 1))]
    for k in range(n - 1):
        kind = other if k == n // 2 else RevoluteJoint
        ends = Marker(f"link {k}", position=last), Marker(f"link {k + 1}", position=[-side / 2, 0, 0])
        joints.append(kind(f"corner {k}", *ends, **({} if kind is SphericalJoint else {"axis": (0, 0, 1)})))
    ends = Marker(f"link {n - 1}", position=last), first
    joints.append(joint("closing", *ends, **({} if joint is SphericalJoint else {"axis": (0, 0, 1)})))
    return System(links, joints, [WEIGHT])


def locked_chain(n, more=()):
    """A chain that rods from each link to the one after the next make one body, but for the hinge at its beginning."""
    links = chain(n, angles=tuple(0.2 * np.sin(1.0 + np.arange(n))))
    over = Marker("", position=(0.5, 0.3, 0.0))
    rods = [
        DistanceJoint(f"rod {k}", replace(over, body=f"rod {k}"), replace(over, body=f"rod {k + 1}"))
        for k in range(1, n)
    ]
    return replace(links, joints=[*links.joints, *rods, *more])


@pytest.mark.parametrize("n", [10, 300, pytest.param(1000, marks=pytest.mark.long)])
def test_a_chain_of_hinges_begins_however_long_it_is(n):
    """The least eigenvalue of its constraints, scaled by masses, falls with 1/n⁴; the oracle: articulated bodies."""
    rng = np.random.default_rng(n)
    system = chain(n, angles=tuple(0.5 * rng.normal(size=n)))
    start = consistent_state(system)
    model = relative_model(system)
    exact = np.cumsum(model.forward_dynamics(np.zeros(n), np.zeros(n)))  # of the angles, as placed
    found = start.u_dot.reshape(n, 6)[:, 5]
    assert_allclose(found, exact, rtol=0, atol=1e-7 * np.abs(exact).max())


def test_a_long_chain_moves_alike_in_both_formulations():
    rng = np.random.default_rng(0)
    system = chain(120, angles=tuple(0.3 * rng.normal(size=120)))
    motions = [integrate(system, GeneralizedAlpha(), 4e-3, 1e-3, formulation=each) for each in ("absolute", "relative")]
    one, other = (np.array([motion.body(body.name).r[-1] for body in system.bodies]) for motion in motions)
    assert_allclose(one, other, rtol=0, atol=1e-9)


@pytest.mark.parametrize("n", [4, 5, 60])
def test_a_flat_ring_of_hinges_repeats_three_constraints_and_says_so(n):
    """Mobility by Gruebler n - 3 - 3, in truth n - 3: out of the plane the ring closes by itself."""
    assert count(ring(n)) == 3
    with pytest.raises(ModelError, match=rf"3 of {5 * (n + 1)} constraints repeat others, .*'corner 0'.*'closing'"):
        consistent_state(ring(n))


@pytest.mark.parametrize("n", [4, 60])
def test_a_ring_with_a_ball_and_a_sleeve_repeats_none(n):
    system = ring(n, SphericalJoint, CylindricalJoint)
    assert count(system) == 0
    assert mobility(system).mobility == 6 * n - 5 * (n - 1) - 4 - 3
    consistent_state(system)


def test_loops_that_are_well_conditioned_begin_without_the_kernels_of_the_tree(monkeypatch):
    def none(*words):
        raise AssertionError("motions of the tree were asked for")

    monkeypatch.setattr(initial, "coordinate_motions", none)
    consistent_state(four_bar(angle=0.3))
    with pytest.raises(AssertionError, match="were asked for"):
        count(ring(4))


def test_a_chain_locked_by_rods_is_poorly_conditioned_but_repeats_nothing():
    """As a beam of rods: singular values of its constraints, scaled by the masses, fall far, and none is zero."""
    system = locked_chain(40)
    compiled = compiled_system(system)
    rows, _ = scaled_constraints(compiled.model, new_work(compiled.model), compiled.placed)
    values = np.linalg.svd(rows, compute_uv=False)
    assert values[-1] < 1e-3 * values[0]
    assert count(system) == 0
    over = DistanceJoint("one too many", Marker("rod 7", position=(0.1, 0.5, 0.0)), Marker("rod 12"))
    assert count(locked_chain(40, [over])) == 1


def test_rows_that_agree_but_for_rounding_are_counted_and_steep_spectra_are_not():
    rng = np.random.default_rng(2)
    U, V = (np.linalg.qr(rng.normal(size=(12, 12)))[0] for _ in range(2))
    steep = U @ np.diag(10.0 ** -np.linspace(0, 8, 12)) @ V  # falls without a gap
    assert dependent_count(steep) == 0
    C = np.vstack([U[:5], U[0] + U[3] + 1e-13 * rng.normal(size=12)])
    assert dependent_count(C / np.linalg.norm(C, axis=1, keepdims=True)) == 1
    assert dependent_count(np.zeros((0, 3))) == 0
