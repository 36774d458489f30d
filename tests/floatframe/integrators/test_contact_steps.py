"""Contacts in steps that are longer than they: steps near them become short, and they give back what their laws say.

Expected speeds are closed forms of impacts. What is allowed beside them is what 30 steps in a contact leave, 1 %.
"""

import numpy as np
import pytest
from numba import njit
from numpy.testing import assert_allclose

import floatframe as ff
from floatframe import GeneralizedAlpha, Gravity, Marker, RigidBody, System
from floatframe.components import clearances, hydraulics, wheels
from floatframe.model.elements import Element, ElementLaw, GapSpring
from floatframe.model.rotations import euler_parameters_of_rotation_vector, rotation_exp

GROUND, BODY = Marker("ground", position=np.zeros(3)), Marker("b", position=np.zeros(3))
OF_CONTACT = 0.01  #: relative error of a speed after a contact
FORMULATIONS = ["absolute", "relative"]
SCHEMES = [ff.integrators.EnergyMomentum(), ff.integrators.EnergyDecaying(), ff.integrators.Variational()]


def ball_and_plane(gap, *, speed=3.0, scale=1.0, **numbers):
    """A ball of 1 kg and 0.1 m, in units of length and mass that are smaller by a scale, on its way to a plane."""
    body = RigidBody(
        "b", scale, 0.004 * scale**3 * np.eye(3), position=(0, 0, (0.1 + gap) * scale), velocity=(0, 0, -speed * scale)
    )
    numbers = {"exponent": 1.0, "stiffness": 1e6 * scale, "slow": 1e-3 * scale} | numbers
    contact = ff.forces.SphereContact("c", GROUND, BODY, radius_b=0.1 * scale, **numbers)
    return System([body], [], [contact])


@pytest.mark.parametrize("formulation", FORMULATIONS)
@pytest.mark.parametrize(
    ("restitution", "exponent", "rho"), [(0.5, 1.0, 0.8), (0.8, 1.5, 0.8), (1.0, 1.0, 0.5), (1.0, 1.5, 1.0)]
)
def test_a_ball_leaves_with_its_restitution_wherever_in_a_step_it_meets(formulation, restitution, exponent, rho):
    """A contact of about 3 ms in steps of 10 ms."""
    for gap in np.linspace(0.05, 0.08, 4)[:-1]:
        system = ball_and_plane(gap, restitution=restitution, exponent=exponent)
        motion = ff.integrate(system, GeneralizedAlpha(rho), 0.2, 0.01, formulation=formulation)
        assert_allclose(motion.body("b").v[-1, 2], 3.0 * restitution, rtol=OF_CONTACT)


def test_steps_near_a_contact_are_the_same_in_other_units():
    speeds = []
    for scale in (1.0, 1e3, 1e-3):
        motion = ff.integrate(ball_and_plane(0.06, scale=scale, restitution=0.5), GeneralizedAlpha(0.8), 0.2, 0.01)
        speeds.append(motion.body("b").v[-1, 2] / scale)
        assert motion.head.summary["n_steps"] < 60
    assert_allclose(speeds, speeds[0], rtol=1e-6)


def test_balls_meet_on_a_tilted_carrier_that_moves_far_from_the_origin():
    """Two free bodies with a common velocity of 1 km/s, 5 km off: momentum and the relative speed of an impact."""
    tilt = np.array([0.4, -1.1, 0.7])
    place, drift, n = np.array([3e3, -4e3, 1e3]), np.array([600.0, 0.0, 800.0]), rotation_exp(tilt)[:, 2]
    p = euler_parameters_of_rotation_vector(tilt)
    heavy = RigidBody("heavy", 3.0, 0.1 * np.eye(3), position=place, orientation=p, velocity=drift)
    light = RigidBody("light", 1.0, 0.01 * np.eye(3), position=place + 0.5 * n, velocity=drift - 20.0 * n)
    contact = ff.forces.SphereContact(
        "c", Marker("heavy"), Marker("light"), radius_b=0.1, stiffness=1e7, restitution=0.6
    )
    motion = ff.integrate(System([heavy, light], [], [contact]), GeneralizedAlpha(0.8), 0.05, 5e-3)
    v = motion.body("light").v[-1] - motion.body("heavy").v[-1]
    assert_allclose(v @ n, 12.0, rtol=OF_CONTACT)
    assert_allclose(v - (v @ n) * n, 0.0, atol=1e-6)
    momentum = 3.0 * motion.body("heavy").v[-1] + motion.body("light").v[-1]
    assert_allclose(momentum, 4.0 * drift - 20.0 * n, rtol=1e-9)


def steel_ball(gap, speed):
    """A steel ball of 20 mm on its way to a steel plane, 5 km off, by Hertz: a contact of 0.1 ms at 1 m/s."""
    R, n, place = 0.01, np.array([2.0, -1.0, 2.0]) / 3, np.array([3e3, -4e3, 1e3])
    m, stiffness = 7800 * 4 / 3 * np.pi * R**3, 4 / 3 * 1.15e11 * np.sqrt(R)
    body = RigidBody("b", m, 0.4 * m * R**2 * np.eye(3), position=place + (R + gap) * n, velocity=-speed * n)
    plane = Marker("ground", position=place)
    contact = ff.forces.SphereContact("c", plane, BODY, radius_b=R, stiffness=stiffness, exponent=1.5, axis=n)
    return System([body], [], [contact]), n


@pytest.mark.parametrize("part", [1e-4, 3e-3, 0.05, 0.6])
@pytest.mark.parametrize(
    ("method", "formulation"),
    [*((GeneralizedAlpha(0.8), each) for each in FORMULATIONS), *((each, "absolute") for each in SCHEMES)],
)
def test_a_steel_ball_that_lands_in_the_first_step_leaves_as_fast(method, formulation, part):
    """The start looked a tenth of a step ahead, into the contact: five times the energy and more."""
    speed, h = 10.0, 2e-3
    system, n = steel_ball(part * speed * h, speed)
    motion = ff.integrate(system, method, 4 * h, h, formulation=formulation)
    assert_allclose(motion.body("b").v[-1], speed * n, rtol=0, atol=OF_CONTACT * speed)
    assert not motion.validity


@pytest.mark.parametrize("scheme", SCHEMES)
def test_schemes_from_body_to_body_resolve_contacts(scheme):
    """Restitution of a ball, a fast sphere on a sphere, stops of a slide."""
    for gap in (0.05, 0.06, 0.07):
        motion = ff.integrate(ball_and_plane(gap, restitution=0.5), scheme, 0.2, 0.01, watch="off")
        assert_allclose(motion.body("b").v[-1, 2], 1.5, rtol=OF_CONTACT)
        body = RigidBody("b", 1.0, 0.004 * np.eye(3), position=(0, 0, 15 * gap), velocity=(0, 0, -100))
        contact = ff.forces.SphereContact("c", GROUND, BODY, radius_b=0.05, radius_a=0.05, stiffness=1e7)
        motion = ff.integrate(System([body], [], [contact]), scheme, 0.05, 0.01, watch="off")
        assert_allclose(motion.body("b").v[-1, 2], 100.0, rtol=OF_CONTACT)
    lash = clearances.Backlash("lash", GROUND, BODY, lower=-0.01, upper=0.01, stiffness=1e6, axis=(0, 0, 1))
    body, slide = RigidBody("b", 1.0, np.eye(3), velocity=(0, 0, 1)), ff.PrismaticJoint("p", GROUND, BODY)
    motion = ff.integrate(System([body], [slide], elements=[lash]), scheme, 0.21, 5e-3, watch="off")
    assert motion.energies.total.max() < 0.5 * (1 + OF_CONTACT)
    assert_allclose(motion.energies.total[-1], 0.5, rtol=10 * 6e-3)


@pytest.mark.parametrize("formulation", FORMULATIONS)
@pytest.mark.parametrize("error_tolerance", [None, 1e-6])
def test_fast_spheres_do_not_pass_through_each_other(formulation, error_tolerance):
    """100 m/s, a way of 1 m in a step beside spheres of 50 mm."""
    for gap in (0.85, 0.95):
        body = RigidBody("b", 1.0, 0.004 * np.eye(3), position=(0, 0, gap + 0.1), velocity=(0, 0, -100))
        contact = ff.forces.SphereContact("c", GROUND, BODY, radius_b=0.05, radius_a=0.05, stiffness=1e7)
        method = GeneralizedAlpha(0.8, error_tolerance=error_tolerance)
        motion = ff.integrate(System([body], [], [contact]), method, 0.1, 0.01, formulation=formulation)
        assert_allclose(motion.body("b").v[-1, 2], 100.0, rtol=OF_CONTACT)


def test_a_sphere_that_grazes_another_between_two_steps_is_turned_aside():
    """Elastic spheres without friction: the velocity is mirrored at the plane of the touch."""
    offset, R = 0.06, 0.1  # of the way from the middle; sum of the radii
    body = RigidBody("b", 1.0, 0.004 * np.eye(3), position=(offset, 0, 0.5), velocity=(0, 0, -100))
    contact = ff.forces.SphereContact("c", GROUND, BODY, radius_b=0.05, radius_a=0.05, stiffness=1e13)
    motion = ff.integrate(System([body], [], [contact]), GeneralizedAlpha(0.8), 0.01, 0.01)
    n = np.array([offset, 0, np.sqrt(R**2 - offset**2)]) / R
    v = np.array([0, 0, -100.0])
    assert_allclose(motion.body("b").v[-1], v - 2 * (v @ n) * n, atol=1.0)


@pytest.mark.parametrize("h", [1e-3, 5e-3])
def test_a_ball_in_a_wider_socket_falls_and_bounces_without_gain(h):
    """The fall ends on the socket below, 9.17 mm deep where x = 4 mm of 10; then it slides to and fro in it."""
    body = RigidBody("b", 1.0, 0.01 * np.eye(3), position=(0.004, 0, 0))
    ball = clearances.BallWithPlay("play", GROUND, BODY, play=0.01, stiffness=1e7, damping=0.2)
    motion = ff.integrate(System([body], [], [Gravity((0, 0, -9.81))], elements=[ball]), GeneralizedAlpha(0.8), 0.5, h)
    assert motion.energies.total.max() < 0.01 * 9.81 * 0.01
    assert np.linalg.norm(motion.body("b").v, axis=1).max() < np.sqrt(2 * 9.81 * 0.01)
    assert np.linalg.norm(motion.body("b").r, axis=1).max() < 0.01 + 2e-4  # v sqrt(m/k) beyond the socket


@pytest.mark.parametrize("formulation", FORMULATIONS)
@pytest.mark.parametrize("motion", ["along", "about"])
def test_a_body_between_elastic_stops_keeps_its_speed(formulation, motion):
    """20 mm or 20 mrad of play at 1 m/s or 1 rad/s: 20 impacts."""
    axis = np.array([1.0, 2.0, -2.0]) / 3
    joint = ff.PrismaticJoint if motion == "along" else ff.RevoluteJoint
    k = 1e6 if motion == "along" else 1e5
    lash = clearances.Backlash("lash", GROUND, BODY, lower=-0.01, upper=0.01, stiffness=k, motion=motion, axis=axis)
    start = {"velocity": axis} if motion == "along" else {"omega_B": axis}
    body = RigidBody("b", 1.0, 0.1 * np.eye(3), **start)
    system = System([body], [joint("p", GROUND, BODY, axis=axis)], elements=[lash])
    run = ff.integrate(system, GeneralizedAlpha(0.8), 0.41, 5e-3, formulation=formulation)
    energy = run.energies.total
    assert_allclose(energy[-1], energy[0], rtol=20 * 2e-3)
    assert energy.max() < energy[0] * (1 + OF_CONTACT)


def test_a_pin_that_tumbles_in_its_bearing_gains_no_energy():
    """Both planes and the axial stops of a bearing are met by a body that turns and moves along."""
    body = RigidBody("b", 2.0, np.diag([0.02, 0.03, 0.01]), velocity=(0.3, 0.2, 0.4), omega_B=(2.0, -3.0, 5.0))
    hinge = clearances.HingeWithPlay(
        "hinge", GROUND, BODY, radial_play=1e-3, stiffness=1e7, length=0.1, axial_play=2e-3, damping=0.0, axis=(0, 0, 1)
    )
    motion = ff.integrate(System([body], elements=[hinge]), GeneralizedAlpha(0.8), 0.1, 2e-3)
    energy = motion.energies.total
    assert energy.max() < energy[0] * (1 + OF_CONTACT)
    assert energy[-1] > 0.7 * energy[0]


def test_a_ball_that_rests_takes_whole_steps():
    """Held by its weight on a contact of 6 ms, a hundred steps of 10 ms."""
    body = RigidBody("b", 1.0, 0.004 * np.eye(3), position=(0, 0, 0.1 - 9.81 / 1e6))
    contact = ff.forces.SphereContact("c", GROUND, BODY, radius_b=0.1, stiffness=1e6, exponent=1.0, restitution=0.5)
    motion = ff.integrate(System([body], [], [Gravity((0, 0, -9.81)), contact]), GeneralizedAlpha(0.8), 1.0, 0.01)
    assert motion.head.summary["n_steps"] == 100
    assert_allclose(motion.body("b").r[-1, 2], 0.1 - 9.81e-6, atol=1e-9)


def test_steps_near_a_contact_do_not_depend_on_the_calls_that_make_them():
    runs = [
        ff.integrate(ball_and_plane(0.06, restitution=0.5), GeneralizedAlpha(0.8), 0.2, 0.01, batch_steps=n)
        for n in (1, 3, 400)
    ]
    for run in runs[1:]:
        np.testing.assert_array_equal(run.body("b").r, runs[0].body("b").r)
        assert run.head.summary["n_steps"] == runs[0].head.summary["n_steps"]


@pytest.mark.parametrize("formulation", FORMULATIONS)
def test_a_contact_that_the_least_step_does_not_resolve_is_refused_by_name(formulation):
    with pytest.raises(
        ff.errors.ConvergenceError, match=r"from t = 0.0\d* failed: contact 'c' takes steps of .*h_min = 0.001"
    ) as error:
        ff.integrate(ball_and_plane(0.06), GeneralizedAlpha(0.8, h_min=1e-3), 0.2, 0.01, formulation=formulation)
    assert "give a smaller h_min or h, or a softer contact" in str(error.value)


@pytest.mark.parametrize("method", ["BDF", "DOP853"])
def test_solvers_with_steps_of_their_own_pass_over_no_contact(method):
    """Nothing changes before the contact, so that a step grows over it; the sphere is beyond the other at both ends."""
    pass_over_no_contact(ff.integrators.RelativeOde(method))


def test_ida_passes_over_no_contact():
    pytest.importorskip("sksundae", reason="the extra 'ida' is not installed")
    pass_over_no_contact(ff.integrators.Ida(1e-5, 1e-7))


def pass_over_no_contact(method):
    """Meet a sphere at 100 m/s, far from the origin; 0.1 % is what tolerances of a step leave of it."""
    place, n = np.array([300.0, 400.0, -500.0]), np.array([2.0, -1.0, 2.0]) / 3
    body = RigidBody("b", 1.0, 0.004 * np.eye(3), position=place + 0.95 * n, velocity=-100.0 * n)
    other = Marker("ground", position=place)
    contact = ff.forces.SphereContact("c", other, BODY, radius_a=0.05, radius_b=0.05, stiffness=1e7)
    motion = ff.integrate(System([body], [], [contact]), method, 0.1, 0.05)
    assert_allclose(motion.body("b").v[-1], 100.0 * n, rtol=0, atol=0.1)


@pytest.mark.parametrize("end", ["stroke", "stroke left"])
@pytest.mark.parametrize("kind", ["strut", "cylinder"])
def test_stops_of_struts_and_cylinders_give_back_the_speed_in_steps_longer_than_they(kind, end):
    """A contact of 4.4 ms in steps of 10 ms; what gas and oil do to 20 kg at 3 m/s is below 1e-3 of its energy."""
    place, axis = np.array([5e3, -2e3, 1e3]), np.array([2.0, -1.0, 2.0]) / 3
    away = 1.0 if (end == "stroke") == (kind == "strut") else -1.0  # a strut is compressed, a cylinder pushed out
    body = RigidBody("b", 20.0, np.eye(3), position=place + 0.8 * axis, velocity=3.0 * away * axis)
    base, fluid = Marker("ground", position=place), hydraulics.Fluid(870.0, 1.4e9, 101325.0)
    if kind == "strut":
        element = hydraulics.OleoStrut(
            "s", base, BODY, fluid, gas_volume=1.0, charge=1.013e5, gas_area=1e-6,
            oil_area=1e-6, area=1e-3, stroke=0.4, extended_length=1.0, stop_stiffness=1e7, axis=axis,
        )  # fmt: skip
    else:
        jack = hydraulics.Cylinder(
            "s",
            base,
            BODY,
            head="oil",
            head_area=1e-6,
            head_dead_volume=1e-8,
            stroke=0.4,
            retracted_length=0.6,
            stop_stiffness=1e7,
        )
        element = hydraulics.Circuit("c", fluid, [jack, hydraulics.Tank("tank", "oil")])
    slide = ff.PrismaticJoint("p", base, BODY, axis=axis)
    motion = ff.integrate(System([body], [slide], elements=[element]), GeneralizedAlpha(0.8), 0.1, 0.01)
    assert_allclose(motion.body("b").v[-1], -3.0 * away * axis, rtol=0, atol=3.0 * OF_CONTACT)


@pytest.mark.parametrize("stiffness", [2e5, 2e7])
def test_a_tyre_that_lands_in_too_long_steps_is_told(stiffness):
    """20 kg at 3 m/s on a tyre without damping leave at 3 m/s; what does not is told or refused."""
    n_off = 0
    for h in (0.01, 0.02, 0.05):
        for height in (0.03, 0.04, 0.05):
            body = RigidBody("b", 20.0, np.eye(3), position=(0, 0, 0.3 + height), velocity=(0, 0, -3))
            tyre = wheels.LinearTyre(
                "t", GROUND, BODY, radius=0.3, stiffness=stiffness, slip_stiffness=1e4, cornering_stiffness=1e4
            )
            try:
                motion = ff.integrate(System([body], elements=[tyre]), GeneralizedAlpha(0.8), 0.2, h)
            except ff.errors.ConvergenceError:
                continue
            is_off = abs(motion.body("b").v[-1, 2] - 3.0) > 0.05 * 3.0
            n_off += is_off
            assert motion.validity or not is_off
    assert n_off  # so that this test may fail


@njit
def wall_law(t, x, z, lam, data, wrench, z_dot, g, outputs):
    """A spring beyond a wall at data[1]."""
    depth = x[0, 0] - data[1]
    outputs[0] = -depth
    if depth > 0.0:
        wrench[0, 0] = -data[0] * depth
        outputs[1] = 0.5 * data[0] * depth * depth


class Wall(Element):
    """A wall of a user across x."""

    def __init__(self, gaps):
        self.name, self.markers, self.gaps = "wall", [BODY], gaps

    def law(self, placed):
        return ElementLaw(
            function=wall_law, data=[1e6, 0.5], outputs=("gap", "energy"), energy="energy", gaps=self.gaps
        )


def test_an_element_that_names_its_gap_is_met_in_short_steps():
    def speed_after(gaps):
        system = System([RigidBody("b", 1.0, np.eye(3), velocity=(3.0, 0, 0))], elements=[Wall(gaps)])
        return ff.integrate(system, GeneralizedAlpha(0.8), 0.4, 0.01).body("b").v[-1, 0]

    assert_allclose(speed_after({"gap": GapSpring(1e6)}), -3.0, rtol=OF_CONTACT)
    assert abs(speed_after({}) + 3.0) > 0.1  # so that this test may fail
    with pytest.raises(ff.errors.ModelError, match="gaps: expected names of its outputs with a GapSpring each"):
        speed_after({"way": GapSpring(1e6)})
