"""Base parameters: rules over the joints and the rank of sampled forms find the same."""

from dataclasses import replace

import numpy as np
import pytest
import scipy.linalg as la
from numpy.testing import assert_allclose

from floatframe import Gravity, Marker, PrismaticJoint, RevoluteJoint, System
from floatframe.design.identification.base_parameters import SOURCES, base_parameters, random_samples
from floatframe.design.identification.regressors import linear_form
from floatframe.errors import ModelError
from floatframe.joints import ScrewJoint
from tests.floatframe.design.identification.robots import KUKA_LIKE, human, random_tree, six_axes, some_body

GRAVITIES = {"along the first axis": (0, 0, -9.81), "none": (0, 0, 0), "across it": (0, -9.81, 0)}


def agreed(form, source="torques"):
    """The base parameters by both roads, whose directions of no effect are the same."""
    by_rules, by_samples = (base_parameters(form, source=source, by=by) for by in ("rules", "samples"))
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


@pytest.mark.parametrize(("terms", "counts"), [((), (36, 41, 41)), (("motor-inertia",), (40, 41, 47))])
def test_a_robot_of_the_proportions_of_a_kuka_tells_as_many_by_both_roads(terms, counts):
    form = linear_form(six_axes(**KUKA_LIKE, seed=4), terms)
    assert tuple(len(agreed(form, source).kept) for source in SOURCES) == counts


@pytest.mark.parametrize("source", SOURCES)
def test_a_human_of_twelve_bodies_shows_all_that_its_joints_do_not_let_through(source):
    """Ten of the free trunk, nine of each of five bodies on a spherical joint, seven of each of six on a hinge."""
    form = linear_form(human())
    assert len(form.system.bodies) == 12
    assert len(agreed(form, source).kept) == 10 + 5 * 9 + 6 * 7


@pytest.mark.parametrize("seed", range(24))
def test_rules_find_what_samples_find_in_any_tree(seed):
    kinds = ("R", "P", "C", "U", "S", "L", "F", "free", "R", "P") if seed % 4 else ("R", "P")
    terms = () if seed % 4 else ("motor-inertia",)
    agreed(linear_form(random_tree(seed, 1 + (seed // 2) % 5, kinds), terms))


@pytest.mark.parametrize("source", ["reactions", "both"])
@pytest.mark.parametrize("seed", range(14))
def test_rules_of_reactions_find_what_samples_find_in_any_tree(seed, source):
    kinds = ("R", "P", "C", "U", "S", "L", "F", "free", "R", "P") if seed % 3 else ("R", "P")
    terms = () if seed % 4 else ("motor-inertia",)
    agreed(linear_form(random_tree(seed, 1 + (seed // 2) % 4, ("R", "P") if terms else kinds), terms), source)


@pytest.mark.parametrize(
    ("gravity", "base", "reactions"),
    [
        ("along the first axis", "ground", 41),
        ("none", "ground", 40),
        ("across it", "ground", 42),
        ("along the first axis", "body", 52),
    ],
)
def test_reactions_of_a_puma_tell_as_many_by_both_roads(gravity, base, reactions):
    """On a free base the reaction is all that acts on it, and tells what torques tell."""
    form = linear_form(six_axes(gravity=GRAVITIES[gravity], base=base))
    assert len(agreed(form, "reactions").kept) == reactions
    assert len(agreed(form, "both").kept) == reactions
    if base == "ground":
        both = agreed(linear_form(form.system, ["motor-inertia"]), "both")
        assert len(both.kept) == reactions + 6


@pytest.mark.parametrize("gravity", [(0, 0, -9.81), (3.0, 0, -9.0), (0, 0, 0)])
@pytest.mark.parametrize("directions", [((1, 0, 0), (1, 0, 0)), ((1, 0, 0), (0, 1, 0)), ((0, 0, 1), (1, 0, 0))])
def test_reactions_tell_first_moments_across_slides(directions, gravity):
    """Slide on slide, and a slide along the axis of a hinge on both; a first moment along a slide passes through it."""
    rng = np.random.default_rng(5)
    bodies = [some_body(f"body{k}", rng) for k in range(4)]
    joints = [
        PrismaticJoint("first", Marker("ground"), Marker("body0"), axis=directions[0]),
        PrismaticJoint("second", Marker("body0"), Marker("body1"), axis=directions[1]),
        RevoluteJoint("hinge", Marker("body1"), Marker("body2"), axis=(0, 0, 1)),
        PrismaticJoint("rod", Marker("body2"), Marker("body3"), axis=(0, 0, 1)),
    ]
    form = linear_form(System(bodies, joints, [Gravity(gravity)] if any(gravity) else []))
    agreed(form, "reactions")
    agreed(form, "both")


def test_bodies_on_hinges_of_the_ground_weigh_together():
    """Masses on the axes of three hinges in a row have no momentum; force and moment of their weight tell two sums."""
    rng = np.random.default_rng(3)
    places = [(0.0, 0, 0), (0.5, 0, 0), (2.0, 0, 0)]
    bodies = [some_body(f"body{k}", rng, position=place) for k, place in enumerate(places)]
    hinges = [
        RevoluteJoint(f"hinge{k}", Marker("ground", position=place), Marker(f"body{k}"), axis=(0, 0, 1))
        for k, place in enumerate(places)
    ]
    base = agreed(linear_form(System(bodies, hinges, [Gravity((0, 0, -9.81))])), "reactions")
    assert len(base.kept) == 3 * 5 + 2  # S_x, S_y, J_xz, J_yz, J_zz of each; sum of masses, and of masses times places
    assert "m(body0) - 3 m(body2)" in base.names
    assert "m(body1) + 4 m(body2)" in base.names


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


@pytest.mark.parametrize("by", ["rules", "samples"])
@pytest.mark.parametrize("size", [1.0, 1e-6])
def test_a_mass_that_acts_by_its_small_lever_alone_has_an_effect(size, by):
    """Without gravity the mass of the second link is part of the inertia of the first one, times length²."""
    rng = np.random.default_rng(0)
    hinges = [
        RevoluteJoint("hinge1", Marker("ground"), Marker("one"), axis=(0, 0, 1)),
        RevoluteJoint("hinge2", Marker("one", position=(0.5 * size, 0, 0)), Marker("two"), axis=(0, 0, 1)),
    ]
    bodies = [
        replace(body, inertia=body.inertia * size**2, center_of_mass=body.center_of_mass * size)
        for body in (some_body("one", rng), some_body("two", rng, position=(0.5 * size, 0, 0)))
    ]
    base = base_parameters(linear_form(System(bodies, hinges)), by=by)
    names = base.form.names
    row = list(base.kept).index(names.index("J_zz(one)"))
    assert_allclose(base.B[row, names.index("m(two)")], (0.5 * size) ** 2, rtol=1e-6)
    assert "m(one)" in base.without_effect
    assert "m(two)" not in base.without_effect


def test_a_screw_has_no_rule_and_says_so():
    rng = np.random.default_rng(0)
    screw = ScrewJoint("nut", Marker("ground"), Marker("body"), axis=(0, 0, 1), lead=0.3)
    form = linear_form(System([some_body("body", rng)], [screw], [Gravity((0, 0, -9.81))]))
    with pytest.raises(ModelError, match="'nut' is a screw"):
        base_parameters(form)
    assert len(base_parameters(form, by="samples").kept) == 2  # J + m p², m g p
    with pytest.raises(ModelError, match="'nut' is a screw"):
        base_parameters(form, source="reactions")
