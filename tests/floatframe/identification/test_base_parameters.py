"""Base parameters: rules over the joints and the rank of sampled forms find the same."""

import numpy as np
import pytest
import scipy.linalg as la
from numpy.testing import assert_allclose

from floatframe import Gravity, Marker, ModelError, RevoluteJoint, ScrewJoint, System
from floatframe.identification.base_parameters import base_parameters, random_samples
from floatframe.identification.regressors import linear_form
from tests.floatframe.identification.robots import random_tree, six_axes, some_body

GRAVITIES = {"along the first axis": (0, 0, -9.81), "none": (0, 0, 0), "across it": (0, -9.81, 0)}


def agreed(form):
    """The base parameters by both roads, whose directions of no effect are the same."""
    by_rules, by_samples = base_parameters(form), base_parameters(form, by="samples")
    assert len(by_rules.kept) == len(by_samples.kept)
    if by_rules.silent.shape[1]:
        assert la.subspace_angles(by_rules.silent, by_samples.silent).max() < 1e-7
    return by_rules


@pytest.mark.parametrize(
    ("gravity", "terms", "count"),
    [
        ("along the first axis", (), 36),
        ("along the first axis", ("motor-inertia",), 40),
        ("none", (), 34),
        ("none", ("motor-inertia",), 38),
        ("across it", (), 38),
        ("across it", ("motor-inertia",), 42),
    ],
)
def test_a_puma_has_as_many_as_the_literature_says(gravity, terms, count):
    """36 without drives and gravity along the first axis; two of six rotors count as part of their link."""
    assert len(agreed(linear_form(six_axes(gravity=GRAVITIES[gravity]), terms)).kept) == count


def test_a_robot_on_a_free_base_shows_all_that_its_hinges_do_not_let_through():
    """Ten of the base, seven of each link."""
    assert len(agreed(linear_form(six_axes(base="body"))).kept) == 10 + 6 * 7


@pytest.mark.parametrize("seed", range(24))
def test_rules_find_what_samples_find_in_any_tree(seed):
    kinds = ("R", "P", "C", "U", "S", "L", "F", "free", "R", "P") if seed % 4 else ("R", "P")
    terms = () if seed % 4 else ("motor-inertia",)
    agreed(linear_form(random_tree(seed, 1 + (seed // 2) % 5, kinds), terms))


def test_combinations_give_the_torques_of_all_parameters():
    form = linear_form(six_axes(), ("viscous", "coulomb"))
    base, samples = base_parameters(form), random_samples(form, seed=3)
    Y = form.torques(samples)
    phi = form.values + 0.1 * np.random.default_rng(1).normal(size=len(form.names))
    tau = Y @ phi
    assert_allclose(base.rows(Y) @ base.values(phi), tau, rtol=0, atol=1e-11 * np.abs(tau).max())


def test_names_say_the_combination_of_a_double_pendulum():
    """Two hinges about parallel axes, gravity across: J of the first link takes the mass of the second by length²."""
    rng = np.random.default_rng(0)
    hinges = [
        RevoluteJoint("hinge1", Marker("ground"), Marker("one"), axis=(0, 0, 1)),
        RevoluteJoint("hinge2", Marker("one", position=(0.5, 0, 0)), Marker("two"), axis=(0, 0, 1)),
    ]
    bodies = [some_body("one", rng), some_body("two", rng, position=(0.5, 0, 0))]
    base = agreed(linear_form(System(bodies, hinges, [Gravity((0, -9.81, 0))])))
    assert base.names == (
        "S_x(one) + 0.5 m(two)", "S_y(one)", "J_zz(one) + 0.25 m(two)", "S_x(two)", "S_y(two)", "J_zz(two)",
    )  # fmt: skip
    assert "m(one)" in base.without_effect
    assert "m(two)" not in base.without_effect


def test_reactions_show_more_than_torques():
    """The force on the ground weighs the robot: mass and first moments that no torque shows."""
    form = linear_form(six_axes())
    n = [len(base_parameters(form, source=source, by="samples").kept) for source in ("torques", "reactions", "both")]
    assert n[2] >= n[1] > n[0]


def test_a_screw_has_no_rule_and_says_so():
    rng = np.random.default_rng(0)
    screw = ScrewJoint("nut", Marker("ground"), Marker("body"), axis=(0, 0, 1), lead=0.3)
    form = linear_form(System([some_body("body", rng)], [screw], [Gravity((0, 0, -9.81))]))
    with pytest.raises(ModelError, match="'nut' is a screw"):
        base_parameters(form)
    assert len(base_parameters(form, by="samples").kept) == 2  # J + m p², m g p
    with pytest.raises(ModelError, match="take by='samples'"):
        base_parameters(form, source="both")
