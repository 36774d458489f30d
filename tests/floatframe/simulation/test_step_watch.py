"""The watch of steps and energy: what it says of motions that coarse steps get wrong, and that it keeps still else."""

import json
import logging
from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal
from scipy.integrate import solve_ivp

import cms
import fe_models
import floatframe.simulation.integrate as integration
from fe_models.foundation.units import unit_system
from floatframe import (
    FlexibleBody,
    GeneralizedAlpha,
    Gravity,
    JointForce,
    Marker,
    PointForce,
    PrismaticJoint,
    RevoluteJoint,
    RigidBody,
    SphericalJoint,
    SpringDamper,
    System,
    integrate,
    read_results,
)
from floatframe.engine.compiling.system import compiled_system
from floatframe.engine.kernels.memory import KINETIC, WORK_TAKEN, new_rows
from floatframe.engine.kernels.work import new_work
from floatframe.errors import ConvergenceError, ModelError
from floatframe.forces import Bushing
from floatframe.integrators import EnergyMomentum, trapezoidal
from floatframe.model.functions.time_functions import constant, harmonic, piecewise
from floatframe.model.rotations import (
    euler_parameters,
    euler_parameters_of_rotation_vector,
    rotation_exp,
    rotations_between,
)
from floatframe.results.validity import ValidityNote, notes_from_json, notes_to_json
from floatframe.simulation import Event, resume
from floatframe.simulation.energy_watch import STOP_LIMIT, EnergyWatch
from floatframe.simulation.step_watch import (
    DOUBLES,
    FIRST_CHECK,
    SHORT_LIMIT,
    STEP_LIMIT,
    Companion,
    StepWatch,
)
from tests.floatframe.command import run_floatframe

GROUND = Marker("ground", position=np.zeros(3))


def oscillator(omega=5.0, damping=0.0):
    """Return 1 kg on a spring along a rail, let go 0.1 m from its rest, far from the origin."""
    place = np.array([50.0, 20.0, -10.0])
    body = RigidBody("mass", 1.0, np.eye(3), position=place + np.array([0.1, 0, 0]))
    rail = PrismaticJoint(
        "rail", Marker("ground", position=place), Marker("mass", position=np.zeros(3)), axis=(1, 0, 0)
    )
    spring = JointForce("spring", "rail", "distance", stiffness=omega**2, damping=damping)
    return System([body], [rail], [spring])


def pendulum():
    """Return a pendulum let go from the level."""
    rod = RigidBody("rod", 1.0, 0.01 * np.eye(3), position=(1, 0, 0))
    end = Marker("rod", position=np.array([-1.0, 0, 0]))
    joint = RevoluteJoint("hinge", GROUND, end, axis=(0, 0, 1))
    return System([rod], [joint], [Gravity((0, -9.81, 0))])


def kinds(motion):
    return {note.kind for note in motion.validity}


@pytest.mark.parametrize("method", [GeneralizedAlpha(0.8), trapezoidal(), EnergyMomentum()])
@pytest.mark.parametrize("steps_in_period", [15, 25, 60])
def test_the_estimated_error_is_that_of_an_oscillator(method, steps_in_period):
    """Exact: the cosine. An error in phase grows with time, as the sum of the errors of the steps does."""
    omega, periods = 5.0, 3
    h = 2 * np.pi / omega / steps_in_period
    system = oscillator(omega)
    watch = StepWatch(method, periods * steps_in_period)
    run = running(system, method, h, periods * steps_in_period, watch)
    motion = integrate(system, method, periods * steps_in_period * h, h)
    x = motion.body("mass").r[:, 0] - 50.0
    error = np.abs(x - 0.1 * np.cos(omega * motion.t)).max() / 0.2
    assert error / 2 < run < 2 * error
    assert ("steps" in kinds(motion)) == (run > 0.03)


def running(system, method, h, n_steps, watch):
    """Return the estimated error of a run, over its way."""
    memory, work = method.start(system, 0.0), new_work(compiled_system(system).model)
    memory, _ = method.observe(system, 0.0, memory, work)
    watch.begin(memory.state)
    done = 0
    while done < n_steps:
        n, begin = min(watch.room(done, 400), n_steps - done), memory
        memory, _, _, failure = method.advance(system, memory, work, t0=0.0, h=h, first=done, n_steps=n, every=10**6)
        assert failure is None
        watch.take(system, begin, memory, t0=0.0, h=h, first=done, n_steps=n)
        done += n
    watch.conclude(system, memory, done, 0.0, h)
    return float(np.linalg.norm(watch.total[:, 0] / watch.size[0], axis=1).max())


def test_coarse_steps_of_a_pendulum_are_told_with_time_body_and_remedy(caplog, tmp_path):
    with caplog.at_level(logging.WARNING):
        motion = integrate(pendulum(), GeneralizedAlpha(0.5), 5.0, 0.05, output=tmp_path / "swing.h5")
    (note,) = motion.validity
    assert (note.kind, note.body, note.limit) == ("steps", "rod", 0.03)
    assert 0 < note.t_first <= note.t_largest <= 5.0
    assert f"system 'system': body 'rod', t = {note.t_first:.6g}: the error of the steps is about" in caplog.text
    assert "take a step of about 0.0" in note.words
    assert read_results(tmp_path / "swing.h5").validity == motion.validity
    assert notes_from_json(notes_to_json(motion.validity)) == motion.validity
    fine = integrate(pendulum(), GeneralizedAlpha(0.5), 5.0, 0.002, output_every=25)
    assert np.abs(motion.body("rod").r - fine.body("rod").r).max() > 0.05 * 2  # and it is wrong
    assert not fine.validity


def two_bars(first):
    """Return two bars on hinges, let go with the first at an angle: a motion that magnifies errors."""
    R = rotation_exp(np.array([0.0, 0.0, first]))
    way, end = R[:, 0], np.array([0.5, 0.0, 0.0])
    bars = [
        RigidBody(name, 1.0, 0.1 * np.eye(3), position=PLACE + at * way, orientation=euler_parameters(R))
        for name, at in (("upper", 0.5), ("lower", 1.5))
    ]
    top = RevoluteJoint("top", Marker("ground", position=PLACE), Marker("upper", position=-end), axis=(0, 0, 1))
    knee = RevoluteJoint("knee", Marker("upper", position=end), Marker("lower", position=-end), axis=(0, 0, 1))
    return System(bars, [top, knee], [Gravity((0, -9.81, 0))])


PLACE = np.array([30.0, -20.0, 10.0])


@pytest.mark.parametrize(
    ("first", "h", "formulation"), [(0.3, 0.02, "absolute"), (0.3, 0.02, "relative"), (1.0, 0.02, "absolute")]
)
def test_errors_that_the_motion_magnifies_are_told(first, h, formulation):
    """Sums of the errors of single steps, which know no growth, stay below the limit in some of these."""
    system, method, end = two_bars(first), GeneralizedAlpha(0.8), 4.0
    motion = integrate(system, method, end, h, formulation=formulation)
    fine = integrate(system, method, end, h / 16, output_every=16, formulation="relative", watch="off").body("lower").r
    way = np.linalg.norm(fine - fine[0], axis=1).max()
    assert np.linalg.norm(motion.body("lower").r - fine, axis=1).max() > 0.05 * way
    assert kinds(motion) == {"steps"}


@pytest.fixture(scope="module")
def fine_bars():
    """Return the places of the lower of two bars each 0.02 s, from fine steps."""
    method = GeneralizedAlpha(0.8)
    fine = integrate(two_bars(0.3), method, 4.0, 0.02 / 16, output_every=16, formulation="relative", watch="off")
    return fine.body("lower").r


@pytest.mark.parametrize("formulation", ["absolute", "relative"])
@pytest.mark.parametrize("by", ["events", "jumps"])
def test_errors_before_events_and_jumps_of_forces_are_magnified_after_them(by, formulation, fine_bars):
    """A force that is nearly zero is switched every 0.31 s; sums of the errors between these times stay below 3 %."""
    system, method, end = two_bars(0.3), GeneralizedAlpha(0.8), 4.0
    times = 0.31 * np.arange(1, 13)
    push = PointForce("push", Marker("lower", position=np.zeros(3)), force=(1e-9, 0, 0))
    if by == "events":
        switched = [{"switch_off": ("push",)}, {"switch_on": ("push",)}]
        events = [Event(f"at {t:.2f}", at=t, **switched[k % 2]) for k, t in enumerate(times)]
        system = replace(system, forces=(*system.forces, push), events=events)
    else:
        square = piecewise([0.0, *times], [constant((-1.0) ** k) for k in range(len(times) + 1)])
        system = replace(system, forces=(*system.forces, replace(push, amplitude=square)))
    motion = integrate(system, method, end, 0.02, formulation=formulation)
    way = np.linalg.norm(fine_bars - fine_bars[0], axis=1).max()
    assert np.linalg.norm(motion.body("lower").r - fine_bars, axis=1).max() > 0.05 * way
    assert kinds(motion) == {"steps"}


@pytest.mark.parametrize(("n", "h"), [(1, 0.3), (3, 0.2)])
def test_a_run_of_few_steps_is_judged_at_its_end(n, h):
    """A pendulum falls in half a second."""
    motion = integrate(pendulum(), GeneralizedAlpha(0.5), n * h, h)
    fine = integrate(pendulum(), GeneralizedAlpha(0.5), n * h, h / 100, output_every=100)
    way = np.linalg.norm(fine.body("rod").r[-1] - fine.body("rod").r[0])
    assert np.linalg.norm(motion.body("rod").r[-1] - fine.body("rod").r[-1]) > 0.03 * way
    assert kinds(motion) - {"damping"} == {"steps"}
    assert not fine.validity


def pieces(h, n, n_total, pause=0.0, folder=None):
    """Return runs of n steps of a pendulum, each from the last state of the one before, after a pause."""
    motions, state = [], None
    for k in range(0, n_total, n):
        begin = k * (h + pause)
        output = None if folder is None else folder / f"{k}.h5"
        motions.append(
            integrate(pendulum(), GeneralizedAlpha(0.8), begin + n * h, h, t_start=begin, state=state, output=output)
        )
        state = motions[-1].state(-1)
    return motions


@pytest.fixture(scope="module")
def forty_pieces():
    return pieces(0.05, 3, 120)


def test_pieces_in_files_are_judged_as_those_in_memory(forty_pieces, tmp_path):
    found = pieces(0.05, 3, 60, folder=tmp_path)
    assert [motion.validity for motion in found] == [motion.validity for motion in forty_pieces[:20]]
    assert any(motion.validity for motion in found)


def test_a_motion_in_pieces_is_judged_as_one(forty_pieces):
    """None of the pieces is off by 1 % of its own motion; all of them are by 6 %.

    The estimate is above the largest error so far by a third at most: half steps are off by less than a quarter here.
    """
    h, n, n_total = 0.05, 3, 120
    found = forty_pieces
    r = np.array([motion.body("rod").r[-1] for motion in found])
    fine = integrate(pendulum(), GeneralizedAlpha(0.8), n_total * h, h / 50, output_every=50 * n).body("rod").r
    error = np.linalg.norm(r - fine[1:], axis=1) / np.linalg.norm(fine - fine[0], axis=1).max()
    assert error.max() > 0.05
    assert not found[0].validity
    for motion, end, largest in zip(found, error, np.maximum.accumulate(error), strict=True):
        assert kinds(motion) == {"steps"} or end < STEP_LIMIT
        for note in motion.validity:
            assert 0.95 * end < note.largest < 1.05 * 4 / 3 * largest
    assert not any(motion.validity for motion in pieces(h, n, n_total, pause=1.0))  # each a motion of its own


def rod_that_comes_to_rest_upright(start):
    """Return a rod that an angle of its top end parts from the top, which it nears for ever, and its rate there."""
    inertia, g = 0.01, 9.81
    decay = np.sqrt(g / (1 + inertia))
    rate = -2 * decay * np.sin(start / 2)
    arm = np.array([np.sin(start), np.cos(start), 0.0])
    rod = RigidBody(
        "rod", 1.0, inertia * np.eye(3), position=arm, velocity=rate * np.array([arm[1], -arm[0], 0]),
        omega_B=(0, 0, -rate),
    )  # fmt: skip
    hinge = RevoluteJoint("hinge", GROUND, Marker("rod", position=-arm), axis=(0, 0, 1))
    return System([rod], [hinge], [Gravity((0, -g, 0))]), decay


@pytest.mark.parametrize(("start", "cuts", "told"), [
    (2.0, [20, 10, 10], [0, 0, 1]), (1.0, [24, 3, 3, 3, 3, 3], [0, 0, 0, 0, 0, 0]),
])  # fmt: skip
def test_a_piece_knows_how_it_magnifies_the_errors_of_earlier_ones(start, cuts, told):
    """Exact: tan(theta/4) falls by exp(-t sqrt(m g l/J)); any error grows by the inverse, by 6.5 in 20 steps here."""
    h, state, done = 0.03, None, 0
    system, decay = rod_that_comes_to_rest_upright(start)
    errors, largest = [], []
    for n in cuts:
        motion = integrate(system, GeneralizedAlpha(0.8), (done + n) * h, h, t_start=done * h, state=state)
        state, done = motion.state(-1), done + n
        angle = 4 * np.arctan(np.exp(-decay * done * h) * np.tan(start / 4))
        exact = np.array([np.sin(angle), np.cos(angle), 0.0])
        way = np.linalg.norm(exact - np.array([np.sin(start), np.cos(start), 0.0]))
        errors.append(np.linalg.norm(motion.body("rod").r[-1] - exact) / way)
        largest.append(max((note.largest for note in motion.validity), default=0.0))
    assert errors[-1] > (0.05 if told[-1] else 1.5 * SHORT_LIMIT)
    assert errors[0] < 0.01
    assert [each > 0.0 for each in largest] == [bool(each) for each in told]
    if told[-1]:
        assert_allclose(largest[-1], errors[-1], rtol=0.1)


def test_half_steps_go_on_in_the_next_pieces_though_double_steps_agree_with_these(monkeypatch):
    """A pendulum in pieces. The second needs half steps; in later ones double steps are as the run by chance."""
    follow = Companion.follow

    def agrees(companion, system, end, last, t0, *others):
        is_good = follow(companion, system, end, last, t0, *others)
        if companion.ratio == DOUBLES and t0 > 0.9:
            companion.memory, companion.error = end, np.zeros_like(companion.error)
            companion.peak = np.zeros_like(companion.peak)
        return is_good

    monkeypatch.setattr(Companion, "follow", agrees)
    h, n, n_total = 0.05, 10, 120
    found = pieces(h, n, n_total)
    fine = integrate(pendulum(), GeneralizedAlpha(0.8), n_total * h, h / 50, output_every=50 * n).body("rod").r
    r = np.array([motion.body("rod").r[-1] for motion in found])
    assert np.linalg.norm(r - fine[1:], axis=1).max() > 0.05 * np.linalg.norm(fine - fine[0], axis=1).max()
    assert not found[0].validity
    assert kinds(found[-1]) == {"steps"}


def test_what_dampers_took_from_earlier_pieces_stops_no_run():
    """Dampers that steps do not resolve take more by the sum of their power than the motion loses."""
    model, watched = compiled_system(oscillator()).model, None
    for taken in ([0.0, 0.4, 0.8, 1.2, 1.6], [1.6, 1.6]):
        watch = EnergyWatch(1, 1e-2)
        if watched is not None:
            watch.continue_from(watched)
        for number, work in enumerate(taken):
            rows = new_rows(model, 1)
            rows.diagnostics[:, KINETIC], rows.diagnostics[:, WORK_TAKEN] = 1.0, work
            watch.observe(oscillator(), rows, is_switched=False, is_last=number == len(taken) - 1)
        assert not watch.is_beyond
        watched = watch.passed_on()
    assert watch.gain > STOP_LIMIT * watch.scale + watch.unsure


def test_energy_that_pieces_lose_is_summed():
    """An oscillator of 8 steps a period loses as much in pieces as in one run, a tenth in none of them."""
    h = 2 * np.pi / 5.0 / 8
    whole = integrate(oscillator(), GeneralizedAlpha(0.5), 40 * h, h)
    state = None
    for k in range(0, 40, 4):
        motion = integrate(oscillator(), GeneralizedAlpha(0.5), (k + 4) * h, h, t_start=k * h, state=state)
        told = {note.kind: note.largest for note in motion.validity}
        assert k >= 8 or "damping" not in told
        state = motion.state(-1)
    lost = whole.energies.balance[0] - whole.energies.balance[-1]
    assert lost > 0.2 * whole.energies.balance[0]
    assert_allclose(told["damping"], lost / whole.energies.balance[0], rtol=0.3)


def test_a_swing_that_many_steps_follow_is_not_told():
    motion = integrate(two_bars(0.3), GeneralizedAlpha(0.8), 4.0, 0.002)
    fine = integrate(two_bars(0.3), GeneralizedAlpha(0.8), 4.0, 0.001, output_every=2, watch="off")
    assert np.abs(motion.body("lower").r - fine.body("lower").r).max() < 0.01
    assert not motion.validity


@pytest.mark.parametrize(("tolerance", "is_wrong"), [(1e-4, True), (1e-9, False)])
def test_an_error_tolerance_that_is_too_large_for_a_small_motion_is_told(tolerance, is_wrong):
    """1 kg on a spring moves 0.1 mm, and is a metre large. Exact: the cosine."""
    omega, amplitude = 20.0, 1e-4
    body = RigidBody("mass", 1.0, np.eye(3), position=PLACE + np.array([amplitude, 0, 0]))
    rail = PrismaticJoint("rail", Marker("ground", position=PLACE), Marker("mass", position=(0, 0, 0)), axis=(1, 0, 0))
    system = System([body], [rail], [JointForce("spring", "rail", "distance", stiffness=omega**2)])
    motion = integrate(system, GeneralizedAlpha(0.8, error_tolerance=tolerance), 2.0, 0.05)
    x = motion.body("mass").r[:, 0] - PLACE[0]
    error = np.abs(x - amplitude * np.cos(omega * motion.t)).max() / (2 * amplitude)
    assert (error > 0.05) == is_wrong
    assert kinds(motion) == ({"steps"} if is_wrong else set())
    assert all("take an error_tolerance of about" in note.words for note in motion.validity)


def test_companions_of_a_run_with_an_error_tolerance_have_another_one(monkeypatch):
    """Double steps take eight times the tolerance of the run, half steps an eighth; equal ones would find no error."""
    made = []

    def begun(integrator, *arguments, **options):
        companion = begin(integrator, *arguments, **options)
        made.append((companion.ratio, companion.integrator.error_tolerance))
        return companion

    begin = Companion.begun
    monkeypatch.setattr(Companion, "begun", begun)
    integrate(two_bars(0.3), GeneralizedAlpha(0.8, error_tolerance=1e-3), 2.0, 0.05)
    assert {ratio for ratio, _ in made} == {0.5, 2.0}
    assert all(np.isclose(tolerance, 1e-3 * ratio**3, rtol=1e-12, atol=0) for ratio, tolerance in made)


def test_a_motion_that_gains_energy_stops_with_what_was_reached():
    with pytest.raises(ConvergenceError, match="of the energy in the motion comes from the steps") as caught:
        integrate(growing(), FRESH, 4.0, 0.05)
    reached = caught.value.trajectory
    assert "energy" in kinds(reached)
    assert 0.05 < reached.t[-1] < 4.0
    assert 'watch = "tell"' in str(caught.value)
    went_on = integrate(growing(), FRESH, 2.0, 0.05, watch="tell")
    assert went_on.t[-1] == 2.0
    assert "energy" in kinds(went_on)
    assert not integrate(growing(), FRESH, 2.0, 0.05, watch="off").validity


FRESH = GeneralizedAlpha(parameters=(0.0, 0.0, 0.02, 0.5))  # unstable above omega h = 2.1: beta below 1/4


def growing():
    return oscillator(60.0)


def test_energy_of_forces_and_dampers_is_no_gain_of_the_steps():
    plain = oscillator(5.0, damping=2.0)
    motor = JointForce("motor", "rail", "distance", motor=harmonic(30.0, 4.0))
    driven = replace(plain, forces=(*plain.forces, motor))
    assert not integrate(driven, GeneralizedAlpha(0.8), 10.0, 0.01).validity
    stiff = oscillator(5.0, damping=1e4)  # a damper that the step does not resolve: its work is not known
    assert "energy" not in kinds(integrate(stiff, GeneralizedAlpha(0.8), 0.5, 0.01))


def beside_a_free_body(speed, damping=0.0):
    """Return 1 kg on a spring with ten periods in 10 ms that starts at a speed, and 1 kg that moves freely at 1 m/s."""
    omega = 2 * np.pi * 1000.0
    body = RigidBody("mass", 1.0, np.eye(3), position=PLACE, velocity=(speed, 0, 0))
    free = RigidBody("free", 1.0, np.eye(3), position=PLACE, velocity=(0.0, 1.0, 0.0))
    rail = PrismaticJoint("rail", Marker("ground", position=PLACE), Marker("mass", position=(0, 0, 0)), axis=(1, 0, 0))
    spring = JointForce("spring", "rail", "distance", stiffness=omega**2, damping=2 * damping * omega)
    return System([body, free], [rail], [spring])


@pytest.mark.parametrize(
    ("method", "speed", "is_told"),
    [(GeneralizedAlpha(0.5), 0.7, True), (GeneralizedAlpha(0.8), 0.7, True), (GeneralizedAlpha(0.5), 0.3, False),
     (trapezoidal(), 0.7, False), (EnergyMomentum(), 0.7, False)],
)  # fmt: skip
def test_energy_that_numerical_damping_removes_is_told(method, speed, is_told):
    """The vibration has v²/(1 + v²) of the energy; it is in one step of ten periods, so that companions see nothing."""
    motion = integrate(beside_a_free_body(speed), method, 1.0, 0.01)
    assert kinds(motion) == ({"damping"} if is_told else set())
    for note in motion.validity:
        assert_allclose(note.largest, speed**2 / (1 + speed**2), rtol=1e-3)


@pytest.mark.parametrize("damping", [0.3, 1.0])
@pytest.mark.parametrize("method", [GeneralizedAlpha(0.8), GeneralizedAlpha(0.9), trapezoidal()])
def test_a_damper_that_the_steps_do_not_resolve_ends_no_run(method, damping):
    """The sum of its power at the ends of steps is far above the energy that it takes: what is above is no gain."""
    motion = integrate(beside_a_free_body(2.0, damping), method, 1.0, 0.01)
    assert motion.t[-1] == 1.0
    assert "energy" not in kinds(motion) or method == trapezoidal()  # its velocity goes on to change its sign for good


@pytest.mark.parametrize("scale", [1e-6, 1e6])
@pytest.mark.parametrize(("kinetic", "gain"), [((1.0, 1.0, 1.0), 0.0), ((1.0, 1.2, 1.5), 0.5 / 1.5), ((1.0, 0.4), 0.0)])
def test_a_gain_of_energy_is_measured_by_the_energy_that_moves(scale, kinetic, gain):
    watch, model = EnergyWatch(1, 1e-2), compiled_system(oscillator()).model
    for number, energy in enumerate(kinetic):
        rows = new_rows(model, 1)
        rows.diagnostics[:, KINETIC] = scale * energy
        watch.observe(oscillator(), rows, is_switched=False, is_last=number == len(kinetic) - 1)
    found = watch.notes.get("energy")
    assert_allclose(0.0 if found is None else found.largest, gain, rtol=1e-12)


@pytest.mark.parametrize("far", [0.0, 1e7])
def test_what_rounding_gives_far_from_the_origin_is_no_gain(far):
    """Velocities that close joints jump by the rounding of places over the step, 2 nm / 10 µs there."""
    watch, model = EnergyWatch(1, 1e-5), compiled_system(oscillator()).model
    for speed in (1e-4, 2e-4, 3e-4):
        rows = new_rows(model, 1)
        rows.r[...], rows.u[:, 0] = far, speed
        rows.diagnostics[:, KINETIC] = 0.5 * speed**2
        watch.observe(oscillator(), rows, is_switched=False, is_last=speed > 2e-4)
    assert ("energy" not in watch.notes) == (far > 0.0)


@pytest.mark.parametrize("h", [2e-5, 1e-3, 1e-2])
@pytest.mark.parametrize(("place", "turn"), [((0, 0, 0), (0, 0, 0)), ((3, -40, 7), (0.3, -0.7, 0.5))])
def test_a_system_at_rest_gains_no_energy(place, turn, h):
    """Two bodies on a stiff bushing, joints away from their frames: all motion is rounding, 1e-27 J at the origin."""
    R, at = rotation_exp(np.array(turn)), np.array([0.37, 0.61, -0.83])
    bodies = [
        RigidBody(name, 1.0, np.eye(3), position=place, orientation=euler_parameters(R)) for name in ("upper", "lower")
    ]

    def ends(a, part):
        point = part * at
        near = Marker(
            a, position=place + R @ point if a == "ground" else point, triad=R if a == "ground" else np.eye(3)
        )
        return near, Marker("lower" if a == "upper" or part > 3 else "upper", position=point)

    joints = [RevoluteJoint("hinge", *ends("ground", 1.0), axis=(1, 2, 3)), SphericalJoint("ball", *ends("upper", 2.7))]
    system = System(bodies, joints, [Bushing("mount", *ends("ground", 3.1), 1e7 * np.eye(6))])
    motion = integrate(system, GeneralizedAlpha(0.8), 400 * h, h)
    assert 0.0 < motion.energies.kinetic.max() < 1e-20
    assert not motion.validity


def test_rotations_between_orientations_are_those_that_made_them():
    rng = np.random.default_rng(3)
    start = rng.normal(size=4)
    start /= np.linalg.norm(start)
    for angle in (0.0, 1e-9, 0.3, 2.0, 3.1):
        axis = rng.normal(size=3)
        theta = angle * axis / np.linalg.norm(axis)
        p = multiplied(start, euler_parameters_of_rotation_vector(theta))
        for sign in (1.0, -1.0):
            assert_allclose(rotations_between(sign * p[None], start[None])[0], theta, rtol=1e-9, atol=1e-14)


def multiplied(p, other):
    """Return the product of quaternions (Hamilton)."""
    w, v = p[0] * other[0] - p[1:] @ other[1:], p[0] * other[1:] + other[0] * p[1:] + np.cross(p[1:], other[1:])
    return np.array([w, *v])


def test_a_resumed_run_has_the_notes_of_one_never_interrupted(tmp_path, monkeypatch):
    monkeypatch.setattr(integration, "SEGMENT_SECONDS", 0.0)
    whole = integrate(pendulum(), GeneralizedAlpha(0.5), 30.0, 0.05)

    def stop(progress):
        if progress.n_steps >= 400:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        integrate(pendulum(), GeneralizedAlpha(0.5), 30.0, 0.05, output=tmp_path / "run.h5", progress=stop)
    resumed = resume(pendulum(), tmp_path / "run.h5")
    assert resumed.validity == whole.validity != ()
    assert_array_equal(resumed.body("rod").r, whole.body("rod").r)
    assert not integrate(pendulum(), GeneralizedAlpha(0.5), 30.0, 0.05, watch="off").validity


def test_an_unknown_watch_is_refused_with_the_choices():
    with pytest.raises(ModelError, match="watch: expected one of stop, tell, off, got 'tel'"):
        integrate(pendulum(), GeneralizedAlpha(0.8), 0.1, 0.01, watch="tel")


SWING = """
[system]
units = "m-kg-s"
gravity = [0.0, -9.81, 0.0]
[bodies.rod]
mass = 1.0
inertia = [[0.01, 0, 0], [0, 0.01, 0], [0, 0, 0.01]]
position = [1.0, 0.0, 0.0]
[joints.hinge]
type = "revolute"
body_a = "ground"
body_b = "rod"
marker_b = [-1.0, 0.0, 0.0]
axis = [0.0, 0.0, 1.0]
[run]
t_end = 5.0
h = 0.05
rho_inf = 0.5
"""


@pytest.mark.parametrize(("more", "words", "says"), [
    ("", (), True), ('watch = "off"', (), False), ("", ("--watch", "off"), False),
    ('watch = "off"', ("--watch", "tell"), True),
])  # fmt: skip
def test_the_command_line_prints_the_line_and_files_choose(tmp_path, more, words, says):
    (tmp_path / "swing.toml").write_text(SWING + more)
    result = run_floatframe("run", tmp_path / "swing.toml", *words, code=0)
    told = json.loads(run_floatframe("info", tmp_path / "swing.h5", "--json").stdout)["validity"]
    assert [note["kind"] for note in told] == ["steps"] * says
    assert ("Notes on the steps of the run" in result.output) == says


def test_notes_of_older_files_are_read():
    note = ValidityNote("rod", "speed", 0.2, 0.3, 0.1, 0.2, False, True)
    fields = json.loads(notes_to_json([note]))
    del fields[0]["advice"]
    assert notes_from_json(json.dumps(fields)) == (note,)


def disc_on_a_cart(angle):
    """Return a disc that swings by an angle on a spring, on a cart that goes far, and its angular frequency."""
    omega, v = 10.0, 20.0
    place = np.array([5.0, -3.0, 2.0])
    cart = RigidBody("cart", 2.0, 0.1 * np.eye(3), position=place, velocity=(v, 0, 0))
    disc = RigidBody("disc", 1.0, 0.2 * np.eye(3), position=place, velocity=(v, 0, 0), omega_B=(0, 0, angle * omega))
    rail = PrismaticJoint(
        "rail", Marker("ground", position=place), Marker("cart", position=np.zeros(3)), axis=(1, 0, 0)
    )
    hinge = RevoluteJoint(
        "hinge", Marker("cart", position=np.zeros(3)), Marker("disc", position=np.zeros(3)), axis=(0, 0, 1)
    )
    spring = JointForce("spring", "hinge", "angle", stiffness=0.2 * omega**2)
    return System([cart, disc], [rail, hinge], [spring]), omega


@pytest.mark.parametrize(("angle", "told"), [(0.3, {"steps"}), (9e-4, {"steps"}), (3e-4, set())])
def test_errors_of_rotation_are_told_beside_a_long_way_unless_they_are_small_beside_it(angle, told):
    """Exact: the sine of a disc on a spring, on a cart that goes far; six steps in a period.

    The second angle is small, but with its error it might be as large as those that count.
    """
    system, omega = disc_on_a_cart(angle)
    h = 2 * np.pi / omega / 6
    motion = integrate(system, GeneralizedAlpha(0.8), 30 * h, h)
    R = rotations_between(motion.body("disc").p, np.array([1.0, 0, 0, 0]))
    assert np.abs(R[:, 2] - angle * np.sin(omega * motion.t)).max() > 0.05 * angle
    cart = motion.body("cart").r[:, 0]
    assert cart[-1] - cart[0] > 30.0
    assert_allclose(cart - cart[0], 20.0 * motion.t, rtol=0, atol=1e-6)
    assert kinds(motion) == told


@pytest.mark.parametrize("beside", [False, True])
@pytest.mark.parametrize(
    ("weight", "speed", "damping", "periods"),
    [(0.0, 0.5, 0.3, 12.0), (9.81, 0.0, 0.3, 1.3)],
    ids=["returns", "sags"],
)
def test_a_first_step_that_is_wrong_counts_where_the_motion_settles_after_it(weight, speed, damping, periods, beside):
    """Exact: a damped mass on a spring that settles within the first steps, in which rho_inf = 0 brings it to rest.

    Its error is small beside the way of another body.
    """
    h, n = 0.05, 25
    omega = 2 * np.pi * periods / h
    arm = np.array([0.3, 0, 0])
    bodies = [RigidBody("mass", 1.0, np.eye(3), position=arm, velocity=(speed, 0, 0))]
    if beside:
        bodies.append(RigidBody("other", 1.0, np.eye(3), velocity=(1.0, 0, 0)))
    rail = PrismaticJoint("rail", GROUND, Marker("mass", position=-arm), axis=(1, 0, 0))
    spring = JointForce("spring", "rail", "distance", stiffness=omega**2, damping=2 * damping * omega)
    motion = integrate(System(bodies, [rail], [spring, Gravity((weight, 0, 0))]), GeneralizedAlpha(0.0), n * h, h)
    sag, swing = weight / omega**2, omega * np.sqrt(1 - damping**2)
    first = np.array([-sag, (speed - damping * omega * sag) / swing])

    def exact(t):
        return sag + np.exp(-damping * omega * t) * (first[0] * np.cos(swing * t) + first[1] * np.sin(swing * t))

    error = np.abs(motion.body("mass").r[:, 0] - 0.3 - exact(motion.t)) / np.abs(exact(np.linspace(0, h, 1000))).max()
    assert error[1] > 0.05
    assert error[FIRST_CHECK:].max() < 0.01
    assert ("steps" in kinds(motion)) == (not beside)


def test_a_step_in_which_a_force_jumps_counts_where_the_motion_settles_after_it():
    """Exact: a damped mass on a stiff spring, pushed by a force that begins between two comparisons of the watch."""
    h, n, damping, force, at = 0.05, 25, 0.3, 9.81, 11.0
    omega = 2 * np.pi * 1.3 / h
    sag, swing = force / omega**2, omega * np.sqrt(1 - damping**2)
    body = RigidBody("mass", 1.0, np.eye(3), position=(0.3, 0, 0))
    rail = PrismaticJoint("rail", GROUND, Marker("mass", position=(-0.3, 0, 0)), axis=(1, 0, 0))
    spring = JointForce("spring", "rail", "distance", stiffness=omega**2, damping=2 * damping * omega)
    step = piecewise([0.0, at * h], [constant(0.0), constant(1.0)])
    push = PointForce("push", Marker("mass", position=np.zeros(3)), force=(force, 0, 0), amplitude=step)
    motion = integrate(System([body], [rail], [spring, push]), GeneralizedAlpha(0.0), n * h, h)

    def exact(t):
        t = np.maximum(t - at * h, 0.0)
        return sag * (
            1 - np.exp(-damping * omega * t) * (np.cos(swing * t) + damping * omega / swing * np.sin(swing * t))
        )

    way = exact(np.linspace(0, n * h, 20000)).max()
    error = np.abs(motion.body("mass").r[:, 0] - 0.3 - exact(motion.t)) / way
    assert error.max() > 0.05
    assert error[16:].max() < 0.02
    assert "steps" in kinds(motion)


@pytest.mark.parametrize(("stiffness", "is_repeated"), [(1.0, False), (1e8, True)])
def test_a_first_step_is_repeated_only_where_accelerations_change_in_it(stiffness, is_repeated, monkeypatch):
    """A falling mass on a soft spring, or on one that a step does not resolve: 10 rad in a step."""
    body = RigidBody("mass", 1.0, np.eye(3), position=PLACE)
    rail = PrismaticJoint("rail", Marker("ground", position=PLACE), Marker("mass", position=(0, 0, 0)), axis=(1, 0, 0))
    spring = JointForce("spring", "rail", "distance", stiffness=stiffness, damping=stiffness / 1e4)
    seen, follow = [], Companion.follow

    def counted(companion, system, end, last, *others):
        seen.append((companion.ratio, last))
        return follow(companion, system, end, last, *others)

    monkeypatch.setattr(Companion, "follow", counted)
    integrate(System([body], [rail], [spring, Gravity((9.81, 0, 0))]), GeneralizedAlpha(0.8), 0.1, 1e-3)
    assert ((0.5, 1) in seen) == is_repeated


@pytest.mark.parametrize("damping", [0.01, 0.05])
def test_vibrations_that_steps_and_their_companion_damp_count_in_the_error(damping):
    """SciPy: a mass that turns about a point on a stiff spring, three periods of the spring in a step.

    rho_inf = 0 stops the vibration in the first step. The turning depends on it: angular momentum is kept.
    """
    stretch, rate, h, n = 0.04, 1.0, 0.05, 40
    omega, first = 2 * np.pi * 3 / h, 1.0 + stretch
    body = RigidBody(
        "mass", 1.0, np.eye(3), position=PLACE + np.array([first, 0, 0]), velocity=(0.0, first * rate, 0.0)
    )
    spring = SpringDamper(
        "spring", Marker("ground", position=PLACE), Marker("mass", position=np.zeros(3)), stiffness=omega**2,
        damping=2 * damping * omega, free_length=1.0,
    )  # fmt: skip
    motion = integrate(System([body], [], [spring]), GeneralizedAlpha(0.0), n * h, h)

    def rates(t, y):
        momentum = first**2 * rate
        return [
            y[1],
            momentum**2 / y[0] ** 3 - omega**2 * (y[0] - 1) - 2 * damping * omega * y[1],
            momentum / y[0] ** 2,
        ]

    r, _, angle = solve_ivp(rates, (0, n * h), [first, 0.0, 0.0], t_eval=motion.t, rtol=1e-8, atol=1e-9).y
    exact = PLACE[:2] + np.stack([r * np.cos(angle), r * np.sin(angle)], axis=1)
    places = motion.body("mass").r[:, :2]
    error = np.linalg.norm(places - exact, axis=1).max() / np.linalg.norm(exact - exact[0], axis=1).max()
    assert error > 0.3
    (note,) = (note for note in motion.validity if note.kind == "steps")
    assert note.largest > error / 2


@pytest.mark.parametrize(
    ("turn_in_a_step", "doubles"), [(9.4, "follow"), (9.4, "fail"), (9.4, "agree"), (18.8, "follow")]
)
def test_vibrations_that_no_step_resolves_count_where_half_steps_change_little(turn_in_a_step, doubles, monkeypatch):
    """A pendulum on a pivot that vibrates up and down, 1.5 or 3 periods a step, as after a blow to its stiff spring.

    Exact, by the mean over the fast vibration of speed V (Kapitza): l² Theta'' = -g l sin Theta - V²/4 sin 2 Theta.
    Steps of 9 rad see a third of the second term, half of them half of it: the difference is a part of the error.
    At 19 rad only quarter steps see enough of it. Double steps may also fail, or agree with the run by chance.
    """
    g, start, V, h, n_steps, z = 9.81, 0.5, 1.5, 0.02, 60, np.zeros(3)
    arm = np.array([np.sin(start), -np.cos(start), 0.0])  # 1 m long
    turn = np.array([0.0, 0.0, -V * np.sin(start)])  # of the vibration alone: Theta is at rest
    start_velocity = np.cross(turn, arm) + np.array([0.0, V, 0.0])
    pivot = RigidBody("pivot", 1e3, np.eye(3), velocity=(0, V, 0))
    bob = RigidBody("bob", 1.0, 1e-4 * np.eye(3), position=arm, velocity=start_velocity, omega_B=turn)
    slide = PrismaticJoint("slide", GROUND, Marker("pivot", position=z), axis=(0, 1, 0))
    hinge = RevoluteJoint("hinge", Marker("pivot", position=z), Marker("bob", position=-arm), axis=(0, 0, 1))
    spring = JointForce("spring", "slide", "distance", stiffness=1e3 * (turn_in_a_step / h) ** 2)
    system = System([pivot, bob], [slide, hinge], [Gravity((0, -g, 0)), spring])
    slow = solve_ivp(
        lambda t, y: [y[1], -g * np.sin(y[0]) - V**2 / 4 * np.sin(2 * y[0])], (0, n_steps * h), [start, 0.0], rtol=1e-9
    ).y[0, -1]  # fmt: skip
    exact = np.array([np.sin(slow), -np.cos(slow), 0.0])
    follow = Companion.follow

    def follows(each, *end):
        if each.ratio == DOUBLES and doubles == "fail":
            return False
        is_good = follow(each, *end)
        if each.ratio == DOUBLES and doubles == "agree":
            each.error, each.peak = np.zeros_like(each.error), np.zeros_like(each.peak)
        return is_good

    monkeypatch.setattr(Companion, "follow", follows)
    motion = integrate(system, EnergyMomentum(), n_steps * h, h)
    fine = integrate(system, EnergyMomentum(), n_steps * h, h / 64, output_every=64, watch="off")
    way = np.linalg.norm(fine.body("bob").r - arm, axis=1).max()
    error, of_fine = (
        np.linalg.norm(each.body("bob").r[-1] - each.body("pivot").r[-1] - exact) / way for each in (motion, fine)
    )
    assert of_fine < 0.005
    assert error > 0.05
    assert kinds(motion) == {"steps"}


def test_double_steps_do_not_judge_a_flexible_body_that_turns_by_more_than_a_radian_in_a_step():
    """A free beam that turns by 2.2 rad in a step, as in the motion 81953 of the campaign, against fine steps."""
    line = fe_models.beams.BeamLine(1.0, 1.0, 6.28e4, 62.8, 94.2, 62.8, 1e-3, 1e-3)
    beam = cms.reduction.beam_from_assumed_modes(
        line, name="beam", units=unit_system("m-kg-s"), n_axial=1, n_bending=2, n_torsion=1,
        damping=cms.reduction.ModalDamping(0.02),
    )  # fmt: skip
    h = 0.03276788
    body = FlexibleBody(
        "beam", beam, position=PLACE, stiffening=False, omega_B=np.array([-1.125019, 1.853261, 0.18154]) / h
    )
    motion, fine = (
        integrate(System([body]), GeneralizedAlpha(0.9), 32 * h, h / n, output_every=n, watch=watch)
        for n, watch in ((1, "stop"), (16, "off"))
    )
    assert (
        np.linalg.norm(rotations_between(motion.body("beam").p, fine.body("beam").p), axis=1).max() > 0.05 * 2 * np.pi
    )
    assert "steps" in kinds(motion)


def test_what_halves_have_found_counts_where_they_fail(monkeypatch):
    """The pendulum is off by more than 5 % after 16 steps; its halves fail at the last one."""
    follow = Companion.follow

    def fails(companion, system, end, last, *others):
        return last <= 16 and follow(companion, system, end, last, *others)

    fine = integrate(pendulum(), GeneralizedAlpha(0.5), 1.7, 0.001, output_every=100)
    monkeypatch.setattr(Companion, "follow", fails)
    motion = integrate(pendulum(), GeneralizedAlpha(0.0), 1.7, 0.1)
    assert np.abs(motion.body("rod").r - fine.body("rod").r)[:17].max() > 0.05 * 2
    assert "steps" in kinds(motion)
