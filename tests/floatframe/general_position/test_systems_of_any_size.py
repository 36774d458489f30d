"""Systems of a micrometre and of 1000 km: what is judged by their size is judged as for a metre."""

from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy.spatial.transform import Rotation

from floatframe import (
    GROUND,
    GeneralizedAlpha,
    Gravity,
    JointForce,
    Marker,
    PrismaticJoint,
    RevoluteJoint,
    RigidBody,
    SpringDamper,
    System,
    integrate,
    static_equilibrium,
)
from floatframe.analyses.inverse_kinematics import Target, inverse_kinematics
from floatframe.engine.compiling.system import compiled_system
from floatframe.errors import ModelError
from floatframe.joints import CoordinateCoupler, CylindricalJoint, JointCoordinate
from floatframe.model.joints.coordinate_coupler import Limits
from floatframe.model.rotations import euler_parameters
from floatframe.results.sensors import PlaceSensor
from floatframe.simulation import Event
from floatframe.simulation import integrate as integration
from floatframe.simulation.event_steps import EventWatch

SIZES = [1e-6, 1.0, 1e6]
TURN = Rotation.from_rotvec([0.4, 1.1, -0.6]).as_matrix()


def sliders(size, *, gap=0.0, **parts):
    """Two blocks on one rail along x, `gap` beyond the places at which their coupler is satisfied."""
    m = size**3
    blocks = [RigidBody(name, m, np.eye(3) * m * size**2, position=(x * size, 0, 0))
              for name, x in (("a", 0.3), ("b", 0.9 + gap))]  # fmt: skip
    rails = [PrismaticJoint(f"rail {body.name}", Marker(GROUND, position=body.position), Marker(body.name),
                            axis=(1, 0, 0)) for body in blocks]  # fmt: skip
    springs = [SpringDamper("spring", Marker(GROUND, position=(-0.5 * size, 0, 0)), Marker("a"), 3.0 * m, 0.2 * m,
                            0.8 * size)]  # fmt: skip
    return System(blocks, rails, [Gravity((0, 0, -9.81 * size)), *springs], **parts)


def coupler(**options):
    return CoordinateCoupler("pair", [(JointCoordinate("rail a", "distance"), 1.0),
                                      (JointCoordinate("rail b", "distance"), -1.0)], **options)  # fmt: skip


@pytest.mark.parametrize("size", SIZES)
@pytest.mark.parametrize("n_places", [2, 3, 10, 40])
@pytest.mark.parametrize("width", [0.0, 0.4])
def test_the_length_of_a_system_does_not_depend_on_its_direction(n_places, width, size):
    """Bodies on a line, whose ends lie as far apart as the sum of their distances to the centre, and in space."""
    points = np.random.default_rng(n_places).normal(size=(n_places, 3)) * [1.0, width, width] * size
    lengths = []
    for turn in (np.eye(3), TURN):
        bodies = [RigidBody(f"b{k}", 1.0, np.eye(3) * 1e-6 * size**2, position=turn @ x + 50 * size)
                  for k, x in enumerate(points)]  # fmt: skip
        lengths.append(compiled_system(System(bodies)).length)
    apart = max(np.linalg.norm(points - each, axis=1).max() for each in points)
    assert_allclose(lengths, apart, rtol=1e-12)


@pytest.mark.parametrize("size", SIZES)
def test_a_motion_that_begins_beyond_a_stop_is_refused(size):
    def begun(beyond):
        stop = coupler(limits=Limits(lower=beyond * size))
        return integrate(sliders(size, couplers=[stop]), GeneralizedAlpha(), 1e-3, 1e-3)

    begun(1e-11)
    with pytest.raises(ModelError, match="the motion begins at 0, beyond its lower limit"):
        begun(1e-7)


@pytest.mark.parametrize("size", SIZES)
def test_an_equilibrium_beyond_a_stop_is_refused(size):
    """The spring is released at rest: its block stands at zero, beyond the limit by the given share of the size."""
    for beyond, is_refused in ((1e-11, False), (1e-7, True)):
        stop = CoordinateCoupler("stop", [(JointCoordinate("rail a", "distance"), 1.0)],
                                 limits=Limits(lower=beyond * size))  # fmt: skip
        plain = sliders(size, couplers=[stop])
        system = replace(
            plain,
            forces=[
                *plain.forces,
                SpringDamper(
                    "other", Marker(GROUND, position=(1.4 * size, 0, 0)), Marker("b"), 3.0 * size**3, 0.0, 0.5 * size
                ),
            ],
        )
        if is_refused:
            with pytest.raises(ModelError, match="the equilibrium would be at"):
                static_equilibrium(system)
        else:
            static_equilibrium(system)


@pytest.mark.parametrize("size", SIZES)
def test_a_coupler_that_engages_open_is_refused(size):
    def engaged(apart):
        pair = coupler(constant=apart * size, engaged=False)
        catch = Event("catch", at=2e-3, switch_on=("pair",))
        return integrate(sliders(size, couplers=[pair], events=[catch]), GeneralizedAlpha(), 4e-3, 1e-3)

    engaged(1e-8)
    with pytest.raises(ModelError, match="is to hold"):
        engaged(1e-4)


@pytest.mark.parametrize("size", SIZES)
def test_a_value_that_moves_passes_its_level_and_one_that_stands_does_not(size):
    event = Event("past", "place", 0.3 * size, column="x", switch_on=("pair",), record=True)
    system = sliders(size, couplers=[coupler(engaged=False)], events=[event],
                     sensors=[PlaceSensor("place", Marker("a"))])  # fmt: skip
    watch = EventWatch(system, integration.head_of(system, GeneralizedAlpha(), 0.0, 1.0, 1e-3, 1))
    watch.switch(frozenset())
    level = 0.3 * size
    assert not watch.happens(event, level * (1 - 1e-12), level * (1 + 1e-12))
    assert watch.happens(event, level * (1 - 1e-6), level * (1 + 1e-6))


@pytest.mark.parametrize("size", SIZES)
def test_the_gap_of_a_coupler_of_distances_closes_as_those_of_joints(size):
    """A sum of distances has the size of its terms, although its row could be one of angles."""
    system = sliders(size, gap=0.02, couplers=[coupler(constant=-0.02 * size)])
    found = static_equilibrium(system).state
    assert_allclose(found.r[1, 0] - found.r[0, 0], 0.64 * size, rtol=1e-11)


def arm(size):
    """A hinge with a slide on it."""
    m = size**3
    arm = RigidBody("arm", m, np.eye(3) * m * size**2, position=(0, 0, 0))
    tool = RigidBody("tool", m, np.eye(3) * m * size**2, position=(0.8 * size, 0, 0))
    return System([arm, tool], [RevoluteJoint("hinge", Marker(GROUND), Marker("arm"), axis=(0, 0, 1)),
                                CylindricalJoint("slide", Marker("arm", position=(0.8 * size, 0, 0)), Marker("tool"),
                                                 axis=(1, 0, 0))])  # fmt: skip


@pytest.mark.parametrize("size", SIZES)
def test_a_pose_ends_at_the_limits_of_its_coordinates(size):
    """The target lies 0.3 sizes beyond the slide: the coordinate ends at its limit, to rounding."""
    goal = Target(Marker("tool"), np.array([0.9, 0.8, 0.0]) * size)
    pose = inverse_kinematics(arm(size), goal, limits={"slide.distance": (-0.1 * size, 0.1 * size)})
    assert pose.at_limits == ("slide.distance",)
    assert_allclose(pose.coordinates["slide.distance"], 0.1 * size, rtol=1e-10)
    assert_allclose(pose.coordinates["hinge.angle"], np.arctan2(0.8, 0.9), rtol=1e-6)
    assert_allclose(pose.position_error, (np.hypot(0.9, 0.8) - 0.9) * size, rtol=1e-7)


@pytest.mark.parametrize("size", SIZES)
def test_a_coordinate_near_its_limit_is_not_at_it(size):
    for beside, names in ((1e-4, ()), (1e-9, ("slide.distance",))):
        goal = Target(Marker("tool"), np.array([0.87, 0.0, 0.0]) * size)
        pose = inverse_kinematics(arm(size), goal, limits={"slide.distance": (-size, (0.07 + beside) * size)})
        assert pose.is_reached
        assert pose.at_limits == names


@pytest.mark.parametrize("size", SIZES)
def test_a_pose_placed_beyond_its_limits_is_refused(size):
    goal = Target(Marker("tool"), np.array([0.8, 0.0, 0.0]) * size)
    inverse_kinematics(arm(size), goal, limits={"slide.distance": (1e-11 * size, size)})
    with pytest.raises(ModelError, match=r"slide.distance is placed at 0, beyond its limits"):
        inverse_kinematics(arm(size), goal, limits={"slide.distance": (1e-7 * size, size)})


def turned_arm(size):
    """An arm on a hinge, a block on a sprung slide, turned; all falls through the size in the same time."""
    m = size**3
    places = np.array([[0.5, -0.2, 0.4], [1.1, -0.1, 0.5]]) * size
    bodies = [
        RigidBody("arm", 2.0 * m, np.diag([0.1, 0.12, 0.14]) * m * size**2, (0.3 * size, 0.05 * size, 0.02 * size),
                  position=TURN @ places[0], orientation=euler_parameters(TURN)),
        RigidBody("block", 0.7 * m, np.diag([0.02, 0.03, 0.04]) * m * size**2, (0.01 * size, 0.02 * size, 0.03 * size),
                  position=TURN @ places[1], orientation=euler_parameters(TURN)),
    ]  # fmt: skip
    joints = [
        RevoluteJoint(
            "hinge", Marker(GROUND, position=TURN @ places[0], triad=TURN), Marker("arm"), axis=(0.6, 0.8, 0)
        ),
        PrismaticJoint("slide", Marker("arm", position=places[1] - places[0]), Marker("block"), axis=(0.8, 0, 0.6)),
    ]
    spring = JointForce("spring", "slide", "distance", stiffness=200.0 * m, damping=3.0 * m)
    return System(bodies, joints, [Gravity(TURN @ [0.5, -1.0, -9.81] * size), spring])


@pytest.mark.parametrize("formulation", ["absolute", "relative"])
@pytest.mark.parametrize("size", [1e-9, *SIZES, 1e9])
def test_an_arm_of_any_size_swings_alike(size, formulation):
    """The first step too, whose filter is a matrix of masses, moments and lengths."""
    angles = []
    for each in (1.0, size):
        system = turned_arm(each)
        motion = integrate(system, GeneralizedAlpha(), 0.05, 2.5e-3, formulation=formulation)
        angles.append(JointCoordinate("hinge", "angle").measure(system, motion).value)
    assert_allclose(angles[1], angles[0], rtol=0, atol=1e-8 * np.abs(angles[0]).max())
