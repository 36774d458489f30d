"""Stops, latches and clutches: impacts against closed forms, what they keep and lose, and mistakes in them."""

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

import floatframe.simulation.integrate as integration
from floatframe import (
    GROUND,
    FlexibleBody,
    GeneralizedAlpha,
    Gravity,
    JointForce,
    Marker,
    PointForce,
    PrismaticJoint,
    RevoluteJoint,
    RigidBody,
    System,
    integrate,
    static_equilibrium,
)
from floatframe.errors import ModelError
from floatframe.joints import CoordinateCoupler, JointCoordinate, Limits
from floatframe.model.functions.time_functions import polynomial_of_time
from floatframe.results.coordinate_elements import coupler_motion
from floatframe.results.energy_balance import balance_defect
from floatframe.simulation import Event, resume
from tests.floatframe.finite_differences import assert_tangent_is_exact
from tests.floatframe.model.joints.examples import coupled_pairs, three_bodies
from tests.floatframe.point_masses import random_point_masses, reduced_body, stiffness
from tests.floatframe.simulation.examples import assert_same

G = 9.81
METHOD = GeneralizedAlpha(0.9, 1e-11)


def dropped(limits, *, height=1.0, forces=()):
    """Return a block of 2 kg on a vertical guide, let go at a height above a floor at 0."""
    block = RigidBody("block", 2.0, np.eye(3), position=(0, 0, height))
    guide = PrismaticJoint("guide", Marker(GROUND), Marker("block"), axis=(0, 0, 1))
    floor = CoordinateCoupler("floor", [(JointCoordinate("guide", "distance"), 1.0)], limits=limits)
    return System([block], [guide, floor], [Gravity((0, 0, -G)), *forces])


def test_a_ball_bounces_at_the_times_and_speeds_of_newtons_law_and_comes_to_rest():
    """Flights of 2 e^k v/g, speeds e^k v; the last flight shorter than a step is left out; then it weighs m g."""
    e, h = 0.5, 1e-3
    system = dropped(Limits(lower=0.0, restitution=e))
    motion = integrate(system, METHOD, 2.0, h)
    events = motion.head.summary["events"]
    v = np.sqrt(2 * G)
    n = len(events)
    assert [event["name"] for event in events] == ["floor lower"] * n
    flights = 2 * v * e ** np.arange(1, n) / G
    assert_allclose(np.diff([event["t"] for event in events]), flights, rtol=0, atol=1e-9)
    assert_allclose([event["speed before"] for event in events], -v * e ** np.arange(n), rtol=0, atol=1e-8)
    assert flights[-1] > h >= e * flights[-1]
    assert events[-1]["speed after"] == 0.0
    rest = motion.t > events[-1]["t"]
    assert_allclose(motion.body("block").r[rest, 2], 0.0, atol=1e-10)
    assert_allclose(coupler_motion(system, motion, "floor").force[rest, 0], 2.0 * G, rtol=1e-6)
    assert_allclose(coupler_motion(system, motion, "floor").force[~rest, 0], 0.0, atol=1e-9)
    assert_allclose(balance_defect(motion), 0.0, atol=1e-6 * 2 * G)


def test_impulse_is_what_changes_momentum_and_restitution_of_one_keeps_energy():
    motion = integrate(dropped(Limits(lower=0.0, restitution=1.0)), METHOD, 1.0, 1e-3)
    (first, *_) = motion.head.summary["events"]
    assert_allclose(first["impulse"]["floor"], 2 * 2.0 * np.sqrt(2 * G), rtol=1e-9)
    assert_allclose(motion.body("block").r[-1, 2], 1 - 0.5 * G * (1.0 - 2 * np.sqrt(2 / G)) ** 2, atol=1e-6)


def test_what_rests_on_a_stop_leaves_it_when_it_would_have_to_pull():
    """A force 10 t lifts 2 kg off the floor at 10 t = 2 g; from there z = 10 (t - t0)³/12."""
    lift = PointForce("lift", Marker("block"), force=(0, 0, 10.0), amplitude=polynomial_of_time([0.0, 1.0]))
    motion = integrate(dropped(Limits(lower=0.0), height=0.0, forces=[lift]), METHOD, 3.0, 1e-3)
    landed, left = motion.head.summary["events"]
    assert (landed["name"], left["name"]) == ("floor lower", "floor release")
    assert_allclose(left["t"], 2 * G / 10, atol=1e-6)
    assert_allclose(motion.body("block").r[-1, 2], 10 / 12 * (3.0 - 2 * G / 10) ** 3, rtol=1e-5)


def shafts(**options):
    """Return two wheels on one axis, 3 and 1 kg m², the first at 4 rad/s, with a clutch between them."""
    wheels = [RigidBody("one", 1.0, 3 * np.eye(3), omega_B=(0, 0, 4.0)), RigidBody("two", 1.0, np.eye(3))]
    hinges = [RevoluteJoint(f"{b.name} hub", Marker(GROUND), Marker(b.name), axis=(0, 0, 1)) for b in wheels]
    terms = [(JointCoordinate("one hub", "angle"), 1.0), (JointCoordinate("two hub", "angle"), -1.0)]
    clutch = CoordinateCoupler("clutch", terms, **({"engaged": False} | options))
    return System(wheels, [*hinges, clutch], events=[Event("engage", at=0.25, switch_on=("clutch",)),
                                                    Event("open", at=0.5, switch_off=("clutch",))])  # fmt: skip


def test_a_clutch_takes_the_common_speed_and_the_energy_of_the_impact():
    """I1 w = (I1 + I2) w', impulse I2 w', lost I1 I2 w²/(2 (I1 + I2)); opened again both go on."""
    motion = integrate(shafts(), METHOD, 1.0, 1e-2)
    engaged, opened = motion.head.summary["events"]
    assert_allclose(engaged["impulse"]["clutch"], -1.0 * 3.0, rtol=1e-9)  # along + one, - two
    later = motion.t > 0.26
    for name in ("one", "two"):
        assert_allclose(motion.body(name).omega_B[later, 2], 3.0, atol=1e-9)
    assert_allclose(motion.energies.dissipated[-1], 3 * 1 * 16 / (2 * 4), rtol=1e-9)
    assert_allclose(balance_defect(motion), 0.0, atol=1e-9)
    assert opened["name"] == "open"


def test_a_latch_between_free_flexible_bodies_keeps_momentum_and_loses_what_carnot_says():
    """Free hub and flexible boom: P and L go on through the impact; lost energy = kinetic energy of the change."""
    boom = reduced_body(random_point_masses(3, 3), stiffness(3), interfaces=2)
    root = np.array(boom.interface("end_a").position)
    hub = RigidBody("hub", 5.0, np.diag([1.0, 2.0, 1.5]), position=root - [0.5, 0, 0], omega_B=(0.1, -0.3, 0.2))
    body = FlexibleBody("boom", boom, omega_B=(0.3, 0.2, 1.5), velocity=(0.1, 0.2, -0.1))
    hinge = RevoluteJoint("hinge", Marker("hub", position=(0.5, 0, 0)), Marker("boom", "end_a"), axis=(0, 0, 1))
    latch = CoordinateCoupler("latch", [(JointCoordinate("hinge", "angle"), 1.0)], engaged=False)
    caught = Event("caught", "hinge.angle", level=-0.1, direction="falling", switch_on=("latch",), record=True)
    system = System([hub, body], [hinge, latch], events=[caught])
    motion = integrate(system, METHOD, 0.4, 1e-3)
    (event,) = motion.head.summary["events"]
    k = int(np.searchsorted(motion.t, event["t"]))  # recorded just before the impact
    after = motion.t > event["t"]
    assert 0.05 < event["t"] < 0.35
    P, L = motion.linear_momentum, motion.angular_momentum
    assert_allclose(P, np.broadcast_to(P[0], P.shape), rtol=0, atol=1e-8 * np.abs(P).max())
    assert_allclose(L, np.broadcast_to(L[0], L.shape), rtol=0, atol=2e-6 * np.abs(L).max())
    angle = coupler_motion(system, motion, "latch").value[:, 0]
    assert_allclose(angle[after], -0.1, atol=1e-9)
    lost = motion.energies.dissipated[-1] - motion.energies.dissipated[k]
    assert lost > 0.01
    assert abs(event["impulse"]["latch"]) > 0.1
    # Carnot: T before - T after = T(u_before - u_after) = -1/2 (impulse) (rate before): both from the event alone
    rate = coupler_motion(system, motion, "latch").rate[k, 0]
    assert_allclose(lost, -0.5 * event["impulse"]["latch"] * rate, rtol=1e-6)


def test_tangent_of_a_coupler_that_is_not_engaged_is_exact():
    joints, terms = coupled_pairs()["distances"]
    assert_tangent_is_exact(three_bodies(joints, CoordinateCoupler("c", terms, engaged=False)))


def test_a_resumed_run_with_stops_is_the_uninterrupted_one_bit_for_bit(tmp_path, monkeypatch):
    monkeypatch.setattr(integration, "RESTART_STEPS", 50)
    monkeypatch.setattr(integration, "SEGMENT_SECONDS", 0.0)
    system = dropped(Limits(lower=0.0, restitution=0.5))
    whole = integrate(system, METHOD, 1.5, 1e-2)
    path = tmp_path / "run.h5"

    def stop(progress):
        if progress.t >= 1.0 - 1e-9:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        integrate(system, METHOD, 1.5, 1e-2, output=path, batch_steps=10, progress=stop)
    again = resume(system, path)
    assert_same(whole, again)
    assert_array_equal(
        [event["t"] for event in again.head.summary["events"]], [event["t"] for event in whole.head.summary["events"]]
    )


def test_statics_does_not_go_beyond_a_stop_in_silence():
    system = dropped(Limits(lower=0.0), forces=[JointForce("soft", "guide", "distance", stiffness=5.0)])
    with pytest.raises(ModelError, match="beyond its lower limit 0"):
        static_equilibrium(system)


@pytest.mark.parametrize(
    ("options", "words"),
    [
        ({}, "expected lower or upper or both"),
        ({"lower": 1.0, "upper": 0.5}, "expected lower below upper"),
        ({"lower": 0.0, "restitution": 1.5}, "restitution: expected 0 to 1, got 1.5"),
        ({"lower": np.nan}, "limits: lower"),
    ],
)
def test_limits_that_make_no_sense_are_refused(options, words):
    with pytest.raises(ModelError, match=words):
        Limits(**options)


def test_mistakes_with_couplers_in_events_are_answered():
    with pytest.raises(ModelError, match="engaged at the start; set engaged = false"):
        integrate(shafts(engaged=True), METHOD, 1.0, 1e-2)
    with pytest.raises(ModelError, match="has limits and is switched by them alone"):
        integrate(shafts(limits=Limits(upper=1.0)), METHOD, 1.0, 1e-2)
    with pytest.raises(ModelError, match="is to hold 5, but finds 1"):
        integrate(shafts(constant=5.0), METHOD, 1.0, 1e-2)
    with pytest.raises(ModelError, match="begins at -1, beyond its lower limit 0"):
        integrate(dropped(Limits(lower=0.0), height=-1.0), METHOD, 1.0, 1e-2)
    with pytest.raises(ModelError, match="has no constant"):
        shafts(limits=Limits(upper=1.0), constant=0.0)
