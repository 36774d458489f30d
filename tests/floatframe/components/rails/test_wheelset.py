"""Wheelsets in systems: Klingel's wave, critical speed, the radial place in a curve, system files, what is refused."""

from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose

from floatframe import (
    GROUND,
    GeneralizedAlpha,
    Marker,
    PointForce,
    PrismaticJoint,
    RevoluteJoint,
    RigidBody,
    System,
    integrate,
)
from floatframe.analyses import check_element
from floatframe.components import rails
from floatframe.components.rails.conicity import wheelset_at
from floatframe.components.rails.contact_search import rigid_contacts
from floatframe.errors import ConvergenceError, ModelError
from floatframe.files.system_file.read_system import read_system
from floatframe.forces import Bushing
from floatframe.model.rotations import euler_parameters
from floatframe.results import element_motion
from floatframe.sensors import ElementSensor
from floatframe.simulation import Event
from tests.floatframe.components.rails.examples import CONE, DOWN, I_X, I_Y, LOAD, MASS, NEW, axle
from tests.floatframe.components.rails.linear_wheelset import Suspended, eigenvalues

METHOD = GeneralizedAlpha(0.9, 1e-9)


def zero_crossings(x, y):
    i = np.flatnonzero(np.diff(np.sign(y)))
    return x[i] - y[i] * (x[i + 1] - x[i]) / (y[i + 1] - y[i])


def test_a_free_wheelset_runs_in_klingels_wave():
    """At walking pace, where inertia does not count, from creep forces alone: half waves of pi sqrt(r a/lam).

    Klingel's wheelset has no spin creep and no gravity stiffness: what they change falls with the load, and is below a
    thousandth under a ten-thousandth of it. lam is that of the shift at the height of the rails, where creepages are.
    """
    laws = rails.ContactLaws(creep="kalker", normal="constraint", low_speed=1e-3)
    wheels = rails.Wheelset("wheels", Marker("axle"), CONE, laws=laws)
    nominal = rigid_contacts(CONE, 0.0)[0]
    left, right, _ = wheelset_at(CONE, np.array([1e-3]))
    lam, a, r = (left[0] - right[0]) / 2e-3, 0.75 + nominal.s, nominal.radius
    V, klingel = 0.5, np.pi * np.sqrt(r * a / lam)
    for share, tolerance in ((1e-4, 1e-3), (1.0, 5e-3)):
        body = axle(V, V / r, (0.0, 1e-3, rails.height_on_rails(wheels)), share=share)
        motion = integrate(System([body], [], [DOWN], elements=[wheels]), METHOD, 45.0, 0.06)
        place = motion.body("axle").r
        half_waves = np.diff(zero_crossings(place[:, 0], place[:, 1]))
        assert len(half_waves) >= 1
        assert_allclose(half_waves[0], klingel, rtol=tolerance)
    p = Suspended(a=a, r=r, k_y=0.0, k_psi=0.0)
    assert_allclose(half_waves[0], np.pi * V / eigenvalues(p, V).imag.max(), rtol=1e-3)


def suspended(p, V, y):
    """A wheelset in an axle box that springs hold in a carriage, which goes straight on at V."""
    wheels = rails.Wheelset("wheels", Marker("axle"), CONE, laws=rails.ContactLaws(creep="kalker", normal="constraint"))
    height = rails.height_on_rails(wheels)
    box = RigidBody("box", mass=1.0, inertia=1e-2 * np.eye(3), position=(0, y, height), velocity=(V, 0, 0))
    carriage = RigidBody("carriage", mass=1e5, inertia=1e5 * np.eye(3), position=(0, 0, height + 1), velocity=(V, 0, 0))
    along = Marker(GROUND, position=(0, 0, height + 1))
    springs = Bushing(
        "springs", Marker("carriage", position=(0, 0, -1)), Marker("box"), [1e6, p.k_y, 0, 0, 1e5, p.k_psi]
    )
    joints = [
        PrismaticJoint("guide", along, Marker("carriage"), axis=(1, 0, 0)),
        RevoluteJoint("bearing", Marker("box"), Marker("axle"), axis=(0, 1, 0)),
    ]
    return System([axle(V, V / p.r, (0, y, height)), box, carriage], joints, [DOWN, springs], elements=[wheels])


@pytest.mark.parametrize("share", [0.9, 1.1])
def test_growth_beside_the_critical_speed_is_that_of_the_linear_model(share):
    """Motions of the whole system, fitted by decaying waves, against eigenvalues of the textbook's two freedoms."""
    nominal = rigid_contacts(CONE, 0.0)[0]
    p = Suspended(a=0.75 + nominal.s, r=nominal.radius, mass=MASS + 1.0)
    low, high = 40.0, 120.0
    for _ in range(40):
        V = 0.5 * (low + high)
        low, high = (low, V) if eigenvalues(p, V).real.max() > 0 else (V, high)
    V *= share
    root = max(eigenvalues(p, V), key=lambda each: (each.real, each.imag))
    motion = integrate(suspended(p, V, 1e-4), GeneralizedAlpha(0.7, 1e-9), 0.6, 8e-4)
    y, t = motion.body("axle").r[:, 1], motion.t
    late = t > 0.15
    basis = np.exp(root.real * t[late])[:, None] * np.column_stack(
        [np.cos(root.imag * t[late]), np.sin(root.imag * t[late])]
    )
    fitted = basis @ np.linalg.lstsq(basis, y[late], rcond=None)[0]
    assert np.abs(fitted - y[late]).max() < 0.02 * np.abs(y[late]).max()
    assert (root.real > 0) == (share > 1)


def test_a_free_wheelset_in_a_curve_rolls_without_slip_where_its_radii_fit():
    """Outward by y with delta_r(y)/r = 2 a/R; the cant balances gravity and the centrifugal force."""
    R, V, g = 1200.0, 15.0, 2 * LOAD / MASS
    lean = np.arctan(V**2 / (R * g))
    track = rails.Track(rails.curve(R, 400.0, transition=50.0, cant=float(1.5 * np.sin(lean)), before=10.0))
    wheels = rails.Wheelset(
        "wheels", Marker("axle"), CONE, track, rails.ContactLaws(creep="kalker", normal="constraint")
    )
    nominal = rigid_contacts(CONE, 0.0)[0]
    left, right, _ = wheelset_at(CONE, np.array([-1e-3]))
    lam, a, r = (right[0] - left[0]) / 2e-3, 0.75 + nominal.s, nominal.radius
    outward = r * a / (lam * R)
    frame = track.frame(70.0)
    place = frame.origin + frame.axes @ [0, -outward, rails.height_on_rails(wheels)]
    body = axle(V, V / r, place, euler_parameters(frame.axes), V * frame.axes[:, 0])
    body = replace(body, omega_B=frame.axes.T @ [0, 0, V / R] + [0, V / r, 0])
    motion = integrate(System([body], [], [DOWN], elements=[wheels]), GeneralizedAlpha(0.7, 1e-9), 3.0, 2e-3)
    found = element_motion(System([body], [], [DOWN], elements=[wheels]), motion, "wheels").outputs
    assert_allclose(found["left_s"][-1] - found["left_s"][0], V * 3.0, rtol=2e-3)
    assert_allclose(found["right_shift"].mean(), outward, rtol=0.02)
    late = slice(len(motion.t) // 2, None)
    for name in ("left_tread_xi", "right_tread_xi"):
        assert np.abs(found[name][late]).max() < 2e-2 * a / R
    assert_allclose(found["left_Q"], found["right_Q"], rtol=2e-2)


FILE = """
[system]
units = "m-kg-s"
gravity = [0, 0, -80.0]

[bodies.axle]
mass = 1500.0
inertia = [[900.0, 0, 0], [0, 110.0, 0], [0, 0, 900.0]]
position = [0, 0.001, 0.4597]
velocity = [10.0, 0, 0]
omega_B = [0, 21.74, 0]

[elements.wheels]
type = "rails.wheelset"
marker = {body = "axle", marker = [0, 0, 0]}
WHEELS
"""
KEYS = """
wheel = "s1002"
rail = "60e1"
inclination = 0.025
creep = "polach"
friction = 0.35
polach = [1.0, 0.4, 0.5, 0.3]
"""


def test_a_system_file_is_what_python_makes(tmp_path):
    path = tmp_path / "wheelset.toml"
    path.write_text(FILE.replace("WHEELS", KEYS + "[elements.wheels.track]\ncurve = {radius = 500.0, length = 100.0}"))
    system = read_system(path)[0]
    read = system.elements[0]
    assert isinstance(read, rails.Wheelset)
    laws = rails.ContactLaws(creep="polach", friction=0.35, polach=(1.0, 0.4, 0.5, 0.3))
    made = rails.Wheelset("wheels", Marker("axle"), NEW, rails.Track(rails.curve(500.0, 100.0)), laws)
    assert read.laws == made.laws
    assert read.pair == made.pair
    one = integrate(system, METHOD, 0.02, 1e-3)
    other = integrate(replace(system, elements=(made,)), METHOD, 0.02, 1e-3)
    assert_allclose(one.body("axle").r, other.body("axle").r, rtol=0, atol=0)


@pytest.mark.parametrize(
    ("keys", "message"),
    [
        ('wheel = "s1003"', "expected a name"),
        ("wheel = {cone = 0.05, flang = true}", "flang"),
        ("gauge = 1435.0", "look like millimetres"),
        ('creep = "kalkar"', "kalker-saturated"),
        ("frictoin = 0.3", "unknown key"),
        ("track = {curve = {radius = 3.0, length = 10.0}}", "20 m or more"),
        ("wheel = {y = [-60.0, -20.0, 0.0, 20.0, 60.0], z = [28.0, 2.0, 0.0, -1.0, -2.0]}", "look like millimetres"),
        ("wheel = {y = [-0.06, -0.02, -0.03, 0.02, 0.06], z = [0.02, 0.0, 0.0, 0.0, 0.0]}", "turn back"),
        ('rail = {file = "none.txt"}', "no such file"),
        ("friction = 0.0", "friction"),
    ],
)
def test_bad_keys_of_a_system_file_are_named(tmp_path, keys, message):
    path = tmp_path / "wheelset.toml"
    path.write_text(FILE.replace("WHEELS", keys))
    with pytest.raises(ModelError.__mro__[1], match=message):
        read_system(path)


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"position": (0, 0.3, 0.46)}, "off the track: .* its centre belongs at"),
        ({"position": (0, 0, 460.0)}, "off the track"),
        ({"orientation": (np.sqrt(0.5), 0, 0, np.sqrt(0.5))}, "the axle, points .* give the marker a triad"),
    ],
)
def test_a_wheelset_that_is_not_on_its_track_is_refused(change, message):
    body = replace(axle(1.0, 2.0, (0, 0, 0.46)), **change)
    with pytest.raises(ModelError, match=message):
        integrate(System([body], elements=[rails.Wheelset("wheels", Marker("axle"), NEW)]), METHOD, 0.01, 1e-3)


def test_markers_and_sides_are_checked():
    with pytest.raises(ModelError, match="left or right"):
        rails.WheelOnRail("wheel", Marker("axle"), "inner", NEW)
    body = axle(1.0, 2.0, (0, 0, 0.46))
    with pytest.raises(ModelError, match="got the ground"):
        integrate(
            System([body], elements=[rails.Wheelset("wheels", Marker(GROUND, position=(0, 0, 0.46)), NEW)]),
            METHOD,
            0.01,
            1e-3,
        )


def test_two_wheels_that_turn_by_themselves_do_what_a_wheelset_does_at_equal_speeds():
    """The same law from two markers on one axle: forces add up to those of the wheelset."""
    body = axle(12.0, 12.0 / 0.46, (0, 2e-3, 0.4597))
    one = System([body], [], [DOWN], elements=[rails.Wheelset("wheels", Marker("axle"), NEW)])
    pieces = [
        rails.WheelOnRail(side, Marker("axle", position=(0, arm, 0)), side, NEW)
        for side, arm in (("left", 0.75), ("right", -0.75))
    ]
    two = System([body], [], [DOWN], elements=pieces)
    assert_allclose(
        integrate(two, METHOD, 0.1, 1e-3).body("axle").r,
        integrate(one, METHOD, 0.1, 1e-3).body("axle").r,
        rtol=0,
        atol=1e-6,
    )


def pushed_over():
    """A side force of 1.5 of the weight, which tips the axle over its flange."""
    body = axle(10.0, 10.0 / 0.46, (0, 0, 0.4597))
    force = PointForce("push", Marker("axle"), force=(0, 3 * LOAD, 0))
    return System([body], [], [DOWN, force], elements=[rails.Wheelset("wheels", Marker("axle"), NEW)])


def test_a_wheel_off_the_track_ends_the_run_with_a_message_and_its_results():
    with pytest.raises(
        ConvergenceError, match=r"'wheels'.*a wheel has left the track.*results up to this time are kept"
    ) as caught:
        integrate(pushed_over(), METHOD, 2.0, 5e-4)
    motion = caught.value.trajectory
    found = element_motion(pushed_over(), motion, "wheels").outputs
    assert 0.03 < motion.t[-1] < 0.12
    assert np.all(found["off_track"][:-1] <= 0)
    assert found["right_off"][-1] > found["left_off"][-1]  # the wheel behind is the one in the air
    assert found["left_flange_N"].max() > LOAD


def test_an_event_may_end_the_run_before():
    sensor, event = ElementSensor("rails", "wheels"), Event("near", "rails", level=-5e-3, column="off_track", stop=True)
    system = replace(pushed_over(), sensors=[sensor], events=[event])
    motion = integrate(system, METHOD, 2.0, 5e-4)
    assert_allclose(element_motion(system, motion, "wheels").outputs["off_track"][-1], -5e-3, atol=1e-5)


@pytest.mark.parametrize("normal", ["hertz", "constraint"])
def test_the_check_of_elements_finds_no_fault(normal):
    laws = rails.ContactLaws(normal=normal)
    body = axle(20.0, 20.0 / 0.46, (0, 2e-3, 0.4595))
    check_element(
        System([body], [], [DOWN], elements=[rails.Wheelset("wheels", Marker("axle"), NEW, laws=laws)]), "wheels"
    )


def test_wheels_and_track_are_drawn():
    wheels = rails.Wheelset("wheels", Marker("axle"), NEW)
    assert [each.shape.geometry.flange_side for each in wheels.drawn()] == [-1, 1]  # the flange is inside
    track = rails.track_shape(rails.Track(rails.curve(300.0, 60.0, cant=0.1)), 150.0)
    assert track.cant.min() < -0.09


def test_wheels_that_spin_on_a_body_that_does_not_turn_are_the_same_machine():
    """Spin as a state, its gyroscopic moment on the body, against a body that turns: hunting at 25 m/s."""
    turning = axle(25.0, 25.0 / 0.46, (0, 4e-3, 0.4597))
    one = System([turning], [], [DOWN], elements=[rails.Wheelset("wheels", Marker("axle"), NEW)])
    still = replace(turning, inertia=np.diag([I_X, 1e-3, I_X]), omega_B=(0, 0, 0))
    # what little inertia is left about the axle is held by a spring to the ground that knows no other direction
    held = Bushing("held", Marker(GROUND, position=(0, 0, 0.4597)), Marker("axle"), [0, 0, 0, 0, 1e3, 0])
    wheels = rails.Wheelset("wheels", Marker("axle"), NEW, spin_inertia=I_Y, spin=25.0 / 0.46)
    two = System([still], [], [DOWN, held], elements=[wheels])
    first, second = (integrate(each, METHOD, 0.8, 5e-4) for each in (one, two))
    y, other = first.body("axle").r[:, 1], second.body("axle").r[:, 1]
    assert np.ptp(y) > 5e-3
    assert_allclose(other, y, rtol=0, atol=2e-2 * np.ptp(y))
    spin = element_motion(two, second, "wheels").states["spin"]
    assert_allclose(spin, first.body("axle").omega_B[:, 1], rtol=2e-3)
