"""Events: times against closed forms, stop and switch, restart, and mistakes in them."""

from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

import floatframe.simulation.event_steps as event_steps
import floatframe.simulation.integrate as integration
from floatframe import (
    GROUND,
    GeneralizedAlpha,
    JointForce,
    Marker,
    PointForce,
    RevoluteJoint,
    RigidBody,
    SpringDamper,
    System,
    integrate,
)
from floatframe.errors import ModelError
from floatframe.forces import Bushing
from floatframe.integrators import EnergyMomentum, Variational, trapezoidal
from floatframe.integrators.relative_ode import RelativeOde
from floatframe.joints import CoordinateCoupler, JointCoordinate
from floatframe.results.sensors import PlaceSensor
from floatframe.simulation import Event, resume
from floatframe.simulation.event_steps import EventWatch
from tests.floatframe.simulation.examples import (
    G,
    StopHereError,
    assert_same,
    double_pendulum,
    falling,
    steps_on_record,
)


@pytest.mark.parametrize("watch", [{"watch": "guide.distance"}, {"watch": "place", "column": "z"}])
@pytest.mark.parametrize("method", [trapezoidal(), EnergyMomentum()], ids=["trapezoidal", "energy-momentum"])
def test_stop_is_found_where_it_is(method, watch):
    """Under constant acceleration both schemes are exact: h = 0.7 m after sqrt(2 h/g)."""
    motion = integrate(falling(Event("down", level=-0.7, stop=True, **watch)), method, 1.0, 0.1)
    t = np.sqrt(2 * 0.7 / G)
    (event,) = motion.head.summary["events"]
    assert event["name"] == "down"
    assert_allclose(event["t"], t, rtol=0, atol=1e-9)
    assert_allclose(motion.t[-1], event["t"], rtol=0, atol=0)
    assert_allclose(motion.t[:-1], 0.1 * np.arange(4), rtol=0, atol=1e-15)
    assert_allclose(motion.body("block").r[-1], [0, 0, -0.7], rtol=0, atol=1e-8)
    assert motion.is_complete


def test_directions_are_told_apart():
    """Thrown up at 3 m/s: 0.3 m is passed on the way up and on the way down."""
    throw = RigidBody("block", 2.0, np.eye(3), velocity=(0, 0, 3.0))
    t = (3.0 + np.array([-1, 1]) * np.sqrt(9 - 2 * G * 0.3)) / G
    for direction, expected in (("rising", t[:1]), ("falling", t[1:]), ("both", t)):
        plain = falling(Event("mark", "guide.distance", 0.3, direction, switch_on=("none",)),
                        forces=[PointForce("none", Marker("block"), (0, 0, 1e-12))])  # fmt: skip
        system = System([throw], plain.joints, plain.forces, sensors=plain.sensors, events=plain.events)
        found = [event["t"] for event in integrate(system, trapezoidal(), 0.6, 0.05).head.summary["events"]]
        assert_allclose(found, expected, rtol=0, atol=1e-9)


def test_a_force_is_switched_on_and_off_and_output_times_stay():
    """A lift of 3 g from -0.5 m: it stops falling at -0.75 m, rises through -0.5 m, where the lift is taken off."""
    lift = PointForce("lift", Marker("block"), (0, 0, 3 * 2.0 * G))
    events = [
        Event("catch", "guide.distance", -0.5, "falling", switch_on=("lift",)),
        Event("release", "guide.distance", -0.5, "rising", switch_off=("lift",)),
    ]
    motion = integrate(falling(*events, forces=[lift]), trapezoidal(), 1.2, 0.04)
    t_1 = np.sqrt(2 * 0.5 / G)
    speed = G * t_1
    t_2 = t_1 + speed / G  # down and up again at 2 g
    first, second = motion.head.summary["events"][:2]
    assert_allclose((first["t"], second["t"]), (t_1, t_2), rtol=0, atol=1e-8)
    assert_allclose(motion.t, 0.04 * np.arange(31), rtol=0, atol=1e-15)
    late = motion.t - t_2
    during = (late > 0) & (late < 0.4)
    assert_allclose(motion.body("block").r[during, 2], -0.5 + speed * late[during] - G / 2 * late[during] ** 2,
                    rtol=0, atol=1e-8)  # fmt: skip
    balance = motion.energies.balance
    assert_allclose(balance, balance[0], rtol=0, atol=1e-8)


@pytest.mark.parametrize("kind", ["bushing", "spring-damper", "joint-force"])
def test_each_kind_that_pulls_back_lets_go(kind):
    """A body on a stiffness k falls from rest to x = -0.1 with v² = 2 g |x| - k x²/m, then freely."""
    k, m, x = 40.0, 2.0, -0.1
    force = {
        "bushing": Bushing("hold", Marker(GROUND), Marker("block"), stiffness=[0, 0, k, 0, 0, 0]),
        "spring-damper": SpringDamper(
            "hold", Marker(GROUND, position=(0, 0, 5)), Marker("block"), stiffness=k, damping=0.0, free_length=5.0
        ),
        "joint-force": JointForce("hold", "guide", "distance", stiffness=k),
    }[kind]
    events = [Event("let go", "guide.distance", x, "falling", switch_off=("hold",))]
    motion = integrate(falling(*events, forces=[force]), trapezoidal(), 0.4, 1e-3)
    (event,) = motion.head.summary["events"]
    late = motion.t >= event["t"]
    v = -np.sqrt(2 * G * -x - k * x**2 / m)
    s = motion.t[late] - event["t"]
    assert_allclose(motion.body("block").r[late, 2], x + v * s - G / 2 * s**2, rtol=0, atol=1e-6)
    energies = motion.energies
    assert_allclose(energies.springs[late], 0, rtol=0, atol=0)
    assert_allclose(energies.work[late], -k * x**2 / 2, rtol=1e-6)  # what the spring took with it
    assert np.ptp(energies.balance) < 1e-5 * k * x**2 / 2


def test_angles_are_followed_beyond_a_full_turn():
    """A wheel at 5 rad/s stops after two turns and a quarter, not where its angle jumps by 2 pi."""
    wheel = RigidBody("wheel", 1.0, np.eye(3), omega_B=(0, 0, 5.0))
    hinge = RevoluteJoint("hinge", Marker(GROUND), Marker("wheel"), axis=(0, 0, 1))
    system = System([wheel], [hinge], events=[Event("turned", "hinge.angle", 4.5 * np.pi, stop=True)])
    motion = integrate(system, GeneralizedAlpha(0.8), 10.0, 0.1)
    assert_allclose(motion.t[-1], 4.5 * np.pi / 5.0, rtol=0, atol=1e-7)


def driven_back_and_forth():
    """Return an oscillator that a motor pushes whenever it is below the middle."""
    spring = JointForce("spring", "guide", "distance", stiffness=200.0)
    kick = JointForce("kick", "guide", "distance", preload=30.0)
    events = [
        Event("below", "guide.distance", -0.1, "falling", switch_on=("kick",)),
        Event("above", "guide.distance", -0.1, "rising", switch_off=("kick",)),
    ]
    return falling(*events, forces=[spring, kick])


def test_resumed_run_with_events_is_the_uninterrupted_one_bit_for_bit(tmp_path, monkeypatch):
    monkeypatch.setattr(integration, "SEGMENT_SECONDS", 0.0)
    monkeypatch.setattr(integration, "RESTART_STEPS", 200)
    method = GeneralizedAlpha(0.8, error_tolerance=1e-5)
    whole = integrate(driven_back_and_forth(), method, 3.0, 0.01)

    def stop(progress):
        if progress.t > 2.3:
            raise StopHereError

    with pytest.raises(StopHereError):
        integrate(driven_back_and_forth(), method, 3.0, 0.01, output=tmp_path / "run.h5", progress=stop)
    assert steps_on_record(tmp_path / "run.h5") == 200
    again = resume(driven_back_and_forth(), tmp_path / "run.h5")
    assert_same(again, whole)
    assert len(whole.head.summary["events"]) > 3
    assert again.head.summary["events"] == whole.head.summary["events"]


def test_a_run_with_events_that_do_not_happen_is_the_one_without():
    plain = integrate(falling(), GeneralizedAlpha(0.8), 0.5, 0.01)
    watched = integrate(falling(Event("never", "guide.distance", 5.0, stop=True)), GeneralizedAlpha(0.8), 0.5, 0.01)
    assert watched.head.summary["events"] == []
    assert_array_equal(watched.body("block").r, plain.body("block").r)


@pytest.mark.parametrize(
    ("event", "words"),
    [
        (lambda: Event("e", "guide.distanse", stop=True), "no sensor or joint coordinate 'guide.distanse'"),
        (lambda: Event("e", "guide.distance", switch_off=("gravty",)), "no force, coupler or element 'gravty'"),
        (lambda: Event("e", "guide.distance"), "an event without consequence"),
        (lambda: Event("e", "guide.distance", direction="up", stop=True), "expected one of rising, falling, both"),
        (lambda: Event("e", "place", column="w", stop=True), "column: expected one of x, y, z"),
        (lambda: Event("e", "place", level=np.nan, stop=True), "level"),
    ],
)
def test_mistakes_in_events_are_answered(event, words):
    with pytest.raises(ModelError, match=words):
        integrate(falling(event()), trapezoidal(), 0.2, 0.1)


def test_an_event_at_a_time_switches_there_exactly():
    """A push of 6 N on 2 kg from t = 0.333 on: x = 3/2 (t - 0.333)², which both schemes follow exactly."""
    push = PointForce("push", Marker("block"), (6.0, 0, 0))
    body = RigidBody("block", 2.0, np.eye(3))
    events = [Event("go", at=0.333, switch_on=("push",)), Event("end", at=0.777, stop=True)]
    motion = integrate(System([body], (), [push], events=events), trapezoidal(), 1.0, 0.1)
    assert [(e["name"], e["t"]) for e in motion.head.summary["events"]] == [("go", 0.333), ("end", 0.777)]
    assert motion.t[-1] == 0.777
    expected = 1.5 * np.maximum(motion.t - 0.333, 0.0) ** 2
    assert_allclose(motion.body("block").r[:, 0], expected, rtol=0, atol=1e-12)


def test_an_event_that_records_keeps_the_results_there_and_leaves_the_motion_as_it_is():
    """Height -g t²/2 = -0.3 and t = 0.25, between the outputs; all other results are those without it, bit for bit."""
    events = (Event("height", "guide.distance", level=-0.3, record=True), Event("time", at=0.25, record=True))
    plain = integrate(falling(), GeneralizedAlpha(), 0.5, 0.02, output_every=5)
    motion = integrate(falling(*events), GeneralizedAlpha(), 0.5, 0.02, output_every=5)
    t = np.sqrt(2 * 0.3 / G)
    assert_allclose([e["t"] for e in motion.head.summary["events"]], [t, 0.25], rtol=0, atol=1e-6)
    is_extra = ~np.isin(motion.t, plain.t)
    assert_allclose(motion.t[is_extra], [t, 0.25], rtol=0, atol=1e-6)
    assert motion.t[is_extra][1] == 0.25
    assert_allclose(motion.body("block").r[is_extra, 2], [-0.3, -0.5 * G * 0.25**2], rtol=0, atol=1e-6)
    assert np.all(np.diff(motion.t) > 0)
    for name in ("t", "position", "u", "w"):
        assert_array_equal(motion.source.read(name)[~is_extra], plain.source.read(name))


def test_what_a_latch_holds_does_not_happen_again():
    """Engaged, its value stays at the level of the event, which rounding passes; a true passage still counts."""
    latch = CoordinateCoupler("latch", [(JointCoordinate("hinge", "angle"), 1.0)], engaged=False)
    event = Event("latched", "hinge.angle", 1.2, "rising", switch_on=("latch",), record=True)
    system = replace(double_pendulum(event), couplers=[latch])
    watch = EventWatch(system, integration.head_of(system, GeneralizedAlpha(), 0.0, 1.0, 1e-3, 1))
    assert watch.happens(event, 1.2 - 1e-13, 1.2 + 1e-13)
    watch.switch(frozenset())
    assert not watch.happens(event, 1.2 - 1e-13, 1.2 + 1e-13)
    assert watch.happens(event, 1.1, 1.3)
    motion = integrate(system, GeneralizedAlpha(), 1.5, 5e-3)
    assert len(motion.head.summary["events"]) == 1
    late = motion.t > motion.head.summary["events"][0]["t"] + 0.01
    assert_allclose(JointCoordinate("hinge", "angle").measure(system, motion).value[late], 1.2, rtol=0, atol=1e-9)


@pytest.mark.parametrize("method", [GeneralizedAlpha(), EnergyMomentum(), Variational()])
def test_blocks_of_steps_change_neither_the_motion_nor_its_events(method, monkeypatch):
    """A double pendulum that is pushed and let go at each passage, with records between."""
    push = PointForce("push", Marker("lower"), (30.0, 0, 10.0))
    events = [
        Event("push", "hinge.angle", 1.2, "rising", switch_on=("push",)),
        Event("rest", "knee.angle", 0.1, switch_off=("push",)),
        Event("height", "place", column="z", level=-0.9, record=True),
    ]
    system = double_pendulum(*events, forces=[push])
    motions = []
    for size in (1, 32, 400):
        monkeypatch.setattr(event_steps, "BLOCK", size)
        motions.append(integrate(system, method, 1.0, 0.005, output_every=7))
    step_by_step, *in_blocks = motions
    assert len(step_by_step.head.summary["events"]) > 3
    for motion in in_blocks:
        assert step_by_step.head.summary["events"] == motion.head.summary["events"]
        for name in ("t", "position", "u", "w"):
            assert_array_equal(step_by_step.source.read(name), motion.source.read(name))


@pytest.mark.parametrize("watch", [{"at": 0.4}, {"watch": "hinge.angle", "level": 2.0}])
@pytest.mark.parametrize("formulation", ["absolute", "relative"])
def test_what_happens_at_the_end_of_a_step_happens_there(formulation, watch, monkeypatch):
    """A wheel at 5 rad/s, stopped or driven from 0.4 s on, the fortieth of the steps of a block; then 3 rad/s²."""
    wheel = RigidBody("wheel", 1.0, np.eye(3), omega_B=(0, 0, 5.0))
    hinge = RevoluteJoint("hinge", Marker(GROUND), Marker("wheel"), axis=(0, 0, 1))
    drive = JointForce("drive", "hinge", "angle", preload=3.0)

    def run(**options):
        system = System([wheel], [hinge], [drive], events=[Event("end", **watch, switch_on=("drive",), **options)])
        return integrate(system, GeneralizedAlpha(), 1.0, 0.01, output_every=7, formulation=formulation)

    stopped = run(stop=True)
    assert_allclose(stopped.t[-1], 0.4, rtol=0, atol=1e-11)
    assert_allclose(stopped.t[:-1], 0.07 * np.arange(6), rtol=0, atol=1e-15)
    motions = []
    for size in (1, 400):
        monkeypatch.setattr(event_steps, "BLOCK", size)
        motions.append(run())
    assert_array_equal(*(motion.source.read("u") for motion in motions))
    late = np.maximum(motions[0].t - 0.4, 0.0)
    assert_allclose(motions[0].body("wheel").omega_B[:, 2], 5.0 + 3.0 * late, rtol=0, atol=1e-8)


def turned_wheel(*events):
    """Return a wheel of 3 kg m² on a hinge, at rest, turned by two torques of 3 N m."""
    wheel = RigidBody("wheel", 1.0, np.diag([1.0, 2.0, 3.0]))
    hinge = RevoluteJoint("hinge", Marker(GROUND), Marker("wheel"), axis=(0, 0, 1))
    torques = [JointForce(name, "hinge", "angle", preload=3.0) for name in ("f", "g")]
    return System([wheel], [hinge], torques, events=events)


@pytest.mark.parametrize("at", [0.01, 0.5])
@pytest.mark.parametrize("method", [GeneralizedAlpha(), EnergyMomentum(), Variational(), RelativeOde()])
def test_an_event_where_a_step_ends_switches_there_by_every_method(method, at):
    """What is left of the motion keeps the speed that the wheel has there without the event."""
    alone = integrate(turned_wheel(), method, at, 0.01).source.read("u")[-1, 5]
    motion = integrate(turned_wheel(Event("off", at=at, switch_off=("f", "g"))), method, 1.0, 0.01)
    assert_allclose(motion.source.read("u")[-1, 5], alone, rtol=1e-8)
    assert_allclose(alone, 2.0 * at, rtol=1e-5)  # the error of the energy-momentum scheme, of second order


@pytest.mark.parametrize(
    ("watch", "speed"), [({"at": 0.505}, 1.01), ({"watch": "hinge.angle", "level": 0.2}, np.sqrt(0.8))]
)
@pytest.mark.parametrize("method", [GeneralizedAlpha(), RelativeOde()])
def test_two_events_that_switch_at_one_time_both_happen(method, watch, speed):
    events = [Event(f"{name} off", **watch, switch_off=(name,)) for name in ("f", "g")]
    motion = integrate(turned_wheel(*events), method, 1.0, 0.01)
    assert [event["name"] for event in motion.head.summary["events"]] == ["f off", "g off"]
    assert_allclose(motion.source.read("u")[-1, 5], speed, rtol=1e-6)


def test_a_record_and_a_stop_at_one_level_happen_once_each():
    watch, level = "guide.distance", -0.7
    events = Event("note", watch, level=level, record=True), Event("halt", watch, level=level, stop=True)
    motion = integrate(falling(*events), trapezoidal(), 1.0, 0.1)
    assert [e["name"] for e in motion.head.summary["events"]] == ["note", "halt"]


def test_an_event_goes_on_after_a_resumption(tmp_path, monkeypatch):
    """Killed between two events at times: the rest of the run is the one that was never interrupted."""
    push = PointForce("push", Marker("block"), (6.0, 0, 0))
    events = [Event("go", at=0.15, switch_on=("push",)), Event("mark", at=0.35, record=True)]
    system = System([RigidBody("block", 2.0, np.eye(3))], (), [push], events=events)
    monkeypatch.setattr(integration, "RESTART_STEPS", 200)
    whole = integrate(system, trapezoidal(), 0.5, 1e-3)
    monkeypatch.setattr(integration, "SEGMENT_SECONDS", 0.0)

    class KilledError(Exception):
        pass

    def kill(progress):
        if progress.n_steps >= 250:
            raise KilledError

    path = tmp_path / "out.h5"
    with pytest.raises(KilledError):
        integrate(system, trapezoidal(), 0.5, 1e-3, output=path, progress=kill, batch_steps=50)
    assert steps_on_record(path) == 200
    again = resume(system, path)
    assert_array_equal(again.t, whole.t)
    assert_array_equal(again.source.read("position"), whole.source.read("position"))


@pytest.mark.parametrize(
    ("options", "words"),
    [
        ({"stop": True}, "expected either watch .* or at .*, got neither"),
        ({"watch": "guide.distance", "at": 1.0, "stop": True}, "got both"),
        ({"at": 1.0}, "expected stop, switch_on, switch_off or record"),
        ({"at": 1.0, "level": 2.0, "stop": True}, "no column, level or direction"),
        ({"at": float("nan"), "stop": True}, "event 'e': at"),
    ],
)
def test_events_that_make_no_sense_are_refused(options, words):
    with pytest.raises(ModelError, match=words):
        Event("e", **options)


def test_an_event_before_the_start_is_refused():
    with pytest.raises(ModelError, match="event 'e': at: expected a time after the start of the run"):
        integrate(falling(Event("e", at=0.5, stop=True)), trapezoidal(), 1.0, 0.1, t_start=0.5)


def test_sensors_are_checked_before_the_run():
    """A wrong one ends nothing after hours of computing: not one step is taken."""
    system = falling()
    wrong = System(system.bodies, system.joints, system.forces, sensors=[PlaceSensor("s", Marker("block", "tip"))])
    done = []
    with pytest.raises(ModelError, match="sensor 's': marker: body 'block' is not flexible"):
        integrate(wrong, trapezoidal(), 1.0, 0.1, progress=done.append)
    assert not done
