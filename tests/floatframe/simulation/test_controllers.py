"""Sampled controllers: exact discrete loops, memory, stored outputs, resuming, and what is refused by name."""

import logging
from dataclasses import replace

import numpy as np
import pytest
from numba import njit
from numpy.testing import assert_allclose, assert_array_equal
from scipy.signal import StateSpace

import cms
import fe_models as fm
from floatframe import (
    Controller,
    FlexibleBody,
    GeneralizedAlpha,
    Gravity,
    Marker,
    PointForce,
    RevoluteJoint,
    RigidBody,
    System,
    integrate,
    read_results,
)
from floatframe.errors import ModelError, ResultsError
from floatframe.files.cosimulation.held_inputs import with_held_inputs
from floatframe.integrators import Ida, RelativeOde
from floatframe.joints import JointCoordinate
from floatframe.model.forces import WITH_AMPLITUDE, BodyLoad, JointForce, UserForce
from floatframe.model.functions.time_functions import constant, piecewise
from floatframe.results.sensors import PlaceSensor
from floatframe.simulation import Event, resume
from tests.floatframe.simulation.examples import steps_on_record

AXIS = np.array([0.48, -0.6, 0.64])  #: of the hinge, a unit vector
PLACE = (0.3, 0.1, -0.2)
INERTIA = 0.7
PERIOD = 0.01


def law(t, x, state):
    """A PID controller towards 1 rad, with a state and an output that depends on time."""
    error = 1.0 - x[0]
    return 20.0 * error - 6.0 * x[1] + 3.0 * state[0] + 0.1 * t, state + PERIOD * error


def pid(**changes):
    given = {"period": PERIOD, "inputs": ["pin.angle", "pin.angle.rate"], "outputs": ["motor"], "function": law,
             "state": [0.2]}  # fmt: skip
    return Controller("pid", **(given | changes))


def rotor(*controllers, **parts):
    """A rotor on an oblique hinge with a motor, in the general position."""
    body = RigidBody("hub", 2.0, INERTIA * np.eye(3), position=PLACE)
    pin = RevoluteJoint("pin", Marker("ground", position=PLACE), Marker("hub", position=(0, 0, 0)), axis=AXIS)
    motor = JointForce("motor", "pin", "angle", motor=constant(0.0))
    return System([body], [pin], [motor], controllers=controllers, **parts)


def discrete_loop(n):
    """Exact samples (angle, rate, torque) of the double integrator under the controller, (n, 3)."""
    angle, rate, state, rows = 0.0, 0.0, np.array([0.2]), []
    for k in range(n):
        torque, state = law(k * PERIOD, [angle, rate], state)
        rows.append((angle, rate, torque))
        angle += rate * PERIOD + torque * PERIOD**2 / (2 * INERTIA)
        rate += torque * PERIOD / INERTIA
    return np.array(rows)


@pytest.fixture(scope="module")
def motion():
    return integrate(rotor(pid()), GeneralizedAlpha(), 1.0, 1e-3)


def test_the_loop_of_a_sampled_controller_is_the_exact_discrete_one(motion):
    """Constant torques between samples: the method is exact, so that all errors would be those of sampling."""
    exact = discrete_loop(100)
    assert_allclose(motion.joint("pin").angle[::10][:100], exact[:, 0], rtol=0, atol=1e-12)
    assert_allclose(motion.joint("pin").angle_rate[::10][:100], exact[:, 1], rtol=0, atol=1e-11)
    assert_allclose(motion.controller("pid").motor, exact[:, 2], rtol=0, atol=1e-10)
    assert motion.validity == ()


def test_the_start_under_a_controller_is_told_once(caplog):
    """The first call, which changes the forces, does not close the joints again."""
    system = rotor(pid())
    away = replace(system, bodies=[replace(system.bodies[0], position=np.add(PLACE, 0.1))])
    motion = integrate(away, GeneralizedAlpha(), 0.02, 1e-3)
    assert [record.message[:24] for record in caplog.records] == ["body 'hub' was placed 0."]
    exact = discrete_loop(2)
    assert_allclose(motion.joint("pin").angle[[0, 10]], exact[:, 0], rtol=0, atol=1e-12)


def test_outputs_and_states_are_stored_at_the_sampling_instants(motion):
    samples = motion.controller("pid")
    assert_allclose(samples.t, PERIOD * np.arange(100), rtol=0, atol=1e-12)
    assert samples.units == {"motor": "N m", "state 1": "1"}
    assert repr(samples).splitlines()[:2] == ["Measurement 'pid'", "  times  100, 0 to 0.99"]
    assert len(repr(samples)) < 300
    errors = 1.0 - motion.joint("pin").angle[::10][:100]
    assert_allclose(samples["state 1"], 0.2 + PERIOD * np.cumsum(errors), rtol=0, atol=1e-12)
    (held,) = motion.measurements("pid")
    assert_array_equal(held.motor, np.repeat(samples.motor, 10)[[*range(1000), -1]])
    assert_allclose(held.motor, motion.joint("pin").angle_force, rtol=0, atol=1e-10)  # what acts in the joint
    with pytest.raises(ResultsError, match="no samples of a controller 'pidd'; did you mean 'pid'"):
        motion.controller("pidd")


@pytest.mark.parametrize("integrator", [GeneralizedAlpha(error_tolerance=1e-6), RelativeOde(), Ida()])
def test_methods_with_steps_of_their_own_end_them_at_the_samples(integrator):
    exact = discrete_loop(20)
    motion = integrate(rotor(pid()), integrator, 0.2, PERIOD)
    assert_allclose(motion.joint("pin").angle[:20], exact[:, 0], rtol=0, atol=1e-6)
    assert_allclose(motion.controller("pid").motor, exact[:, 2], rtol=0, atol=1e-4)


def test_the_motion_does_not_depend_on_batches_and_outputs(motion):
    other = integrate(rotor(pid()), GeneralizedAlpha(), 1.0, 1e-3, batch_steps=7, output_every=20)
    assert_array_equal(other.joint("pin").angle, motion.joint("pin").angle[::20])
    assert_array_equal(other.controller("pid").motor, motion.controller("pid").motor)


def test_an_interrupted_run_is_resumed_bit_for_bit(tmp_path, monkeypatch):
    """Steps and samples of a restart record coincide at 0.8 s; the run is interrupted after it."""
    path, h = tmp_path / "rotor.h5", 1e-3
    whole = integrate(rotor(pid()), GeneralizedAlpha(), 1.5, h)

    def interrupt(progress):
        if progress.n_steps >= 900:
            raise KeyboardInterrupt

    monkeypatch.setattr("floatframe.simulation.integrate.SEGMENT_SECONDS", 0.0)
    with pytest.raises(KeyboardInterrupt):
        integrate(rotor(pid()), GeneralizedAlpha(), 1.5, h, output=path, batch_steps=100, progress=interrupt)
    assert steps_on_record(path) == 800
    resumed = resume(rotor(pid()), path)
    assert_array_equal(resumed.joint("pin").angle, whole.joint("pin").angle)
    for key, values in whole.controller("pid").columns.items():
        assert_array_equal(resumed.controller("pid")[key], values)
    read = read_results(path, rotor(pid()))
    assert_array_equal(read.controller("pid").motor, whole.controller("pid").motor)


def test_a_run_goes_on_from_the_last_state_of_another_with_the_memory_of_its_controller(motion):
    first = integrate(rotor(pid()), GeneralizedAlpha(), 0.5, 1e-3)
    memory = first.controller("pid")["state 1"][-1:]
    second = integrate(rotor(pid(state=memory)), GeneralizedAlpha(), 1.0, 1e-3, t_start=0.5, state=first.state(-1))
    assert_allclose(second.joint("pin").angle, motion.joint("pin").angle[500:], rtol=0, atol=1e-12)
    assert_allclose(second.controller("pid").motor, motion.controller("pid").motor[50:], rtol=0, atol=1e-10)


def test_a_run_of_another_controller_is_not_resumed(tmp_path):
    path = tmp_path / "rotor.h5"

    def interrupt(progress):
        if progress.n_steps >= 500:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        integrate(rotor(pid()), GeneralizedAlpha(), 1.5, 1e-3, output=path, batch_steps=100, progress=interrupt)
    with pytest.raises(ResultsError, match="was of another system"):
        resume(rotor(pid(state=[0.3])), path)


def test_two_controllers_of_different_periods_act_on_their_own_forces():
    """A force along the axis of the hinge does no work; a factor scales it, measured at its own period."""
    place = PlaceSensor("tip", Marker("hub", position=(0.4, 0.0, 0.3)))
    weight = PointForce("push", Marker("hub", position=(0.1, 0.2, 0)), force=(3.0, 1.0, -2.0))
    slow = Controller("slow", period=0.03, inputs=["tip x", "tip.z"], outputs="push", function=lambda t, x: x[0] - x[1])
    system = rotor(pid(), slow, sensors=[place])
    motion = integrate(replace(system, forces=[*system.forces, weight]), GeneralizedAlpha(), 0.3, 1e-3)
    samples, tip = motion.controller("slow"), motion.sensor("tip")
    assert_allclose(samples.t, 0.03 * np.arange(10), rtol=0, atol=1e-12)
    assert_allclose(samples.push, (tip.x - tip.z)[::30][:10], rtol=0, atol=1e-12)
    assert samples.units == {"push": "1"}
    assert len(motion.controller("pid").t) == 30


def test_a_controller_whose_output_stays_changes_nothing_beside_one_whose_output_jumps(motion):
    still = Controller("still", period=PERIOD, inputs="pin.angle", outputs="push", function=lambda t, x: 0.0)
    system = rotor(pid(), still)
    push = PointForce("push", Marker("hub", position=(0.1, 0.2, 0)), force=(3.0, 1.0, -2.0))
    other = integrate(replace(system, forces=[*system.forces, push]), GeneralizedAlpha(), 1.0, 1e-3)
    assert_allclose(other.joint("pin").angle, motion.joint("pin").angle, rtol=0, atol=1e-12)
    assert_allclose(other.controller("pid").motor, motion.controller("pid").motor, rtol=0, atol=1e-10)


def flexible_rotor(**parts):
    """A soft arm on the hinge under two body loads; its file has the axes of its foot, the engine takes mean axes."""
    line = fm.beams.straight_line((0, 0, 0), (0.6, 0.3, -0.2), 3)
    ends = [fm.beams.line_interface(line, name, fm.selections.NodeSet(name)) for name in ("start", "end")]
    section = fm.beams.BeamProperty(fm.beams.Rectangle(0.02, 0.03), fm.Material("soft", E=2e9, nu=0.3, rho=7850.0))
    full = cms.couple(fm.beam_body(line, section, name="arm", units="m-kg-s", interfaces=ends))
    full = full.with_load_cases(
        fm.loads.gravity_load(full, "down", (0.0, 0.0, -9.81)), fm.loads.gravity_load(full, "side", (2.0, 5.0, 0.0))
    )
    arm = FlexibleBody("hub", cms.reduce(full, cms.craig_bampton(full, 2), frame=cms.NodalFrame("start")))
    pin = RevoluteJoint("pin", Marker("ground"), Marker("hub", "start"), axis=AXIS)
    forces = [
        JointForce("spin", "pin", "angle", motor=constant(0.2)),
        JointForce("motor", "pin", "angle", motor=constant(0.0)),
        PointForce("wind", Marker("hub", "end"), force=(1.0, -4.0, 2.0)),
        PointForce("push", Marker("hub", "end"), force=(15.0, 5.0, -10.0)),
        BodyLoad("first", "hub", "down", amplitude=0.1),
        BodyLoad("second", "hub", "side", amplitude=0.1),
    ]
    return System([arm], [pin], forces, **parts)


def test_outputs_are_the_factors_of_forces_and_loads_with_their_names():
    """Outputs that never change move the arm as constants do."""
    values = {"push": 0.7, "second": 0.8, "motor": -0.6}
    plain = flexible_rotor()
    forces = [
        replace(force, **{WITH_AMPLITUDE[type(force)]: constant(values[force.name])}) if force.name in values else force
        for force in plain.forces
    ]
    given = pid(outputs=list(values), state=None, function=lambda t, x: list(values.values()))
    expected, found = (
        integrate(system, GeneralizedAlpha(), 0.05, 1e-3)
        for system in (replace(plain, forces=forces), flexible_rotor(controllers=[given]))
    )
    assert_allclose(found.joint("pin").angle, expected.joint("pin").angle, rtol=0, atol=1e-12)
    assert np.abs(expected.joint("pin").angle).max() > 1e-3


def test_two_outputs_of_a_controller_follow_places_of_a_flexible_body():
    both = pid(inputs=["tip.z", "pin.angle"], outputs=["push", "motor"], state=None,
               function=lambda t, x: (1.0 + x[0], 0.5 - x[1]))  # fmt: skip
    tip = PlaceSensor("tip", Marker("hub", "end"))
    motion = integrate(flexible_rotor(sensors=[tip], controllers=[both]), GeneralizedAlpha(), 0.1, 1e-3)
    samples, place, joint = motion.controller("pid"), motion.sensor("tip").z, motion.joint("pin")
    assert np.ptp(place) > 1e-2
    assert_allclose(samples.push, 1.0 + place[::10][:10], rtol=0, atol=1e-12)
    assert_allclose(samples.motor, 0.5 - joint.angle[::10][:10], rtol=0, atol=1e-12)
    assert_allclose(joint.angle_force[5::10], 0.2 + samples.motor, rtol=0, atol=1e-10)


@pytest.mark.parametrize("period", [0.02, 0.03])
def test_companions_of_a_run_cross_the_jumps_of_outputs(period):
    """Torques that turn round every two or three steps: the run is exact, and its companions find no error."""
    swap = pid(period=period, inputs="pin.angle", state=None, function=lambda t, x: 8.0 * (-1.0) ** round(t / period))
    assert integrate(rotor(swap), GeneralizedAlpha(), 2.0, 0.01, watch="tell").validity == ()


@pytest.mark.parametrize("at", [0.03, 0.035, 0.04])
def test_companions_cross_a_jump_of_another_force_in_a_step_before_a_sample(at):
    """The run is exact, so that a companion finds an error only where it misses one of the two jumps."""
    swap = pid(period=0.02, inputs="pin.angle", state=None, function=lambda t, x: 8.0 * (-1.0) ** round(t / 0.02))
    kick = JointForce("kick", "pin", "angle", motor=piecewise([0.0, at], [constant(0.0), constant(50.0)]))
    system = rotor(swap)
    motion = integrate(replace(system, forces=[*system.forces, kick]), GeneralizedAlpha(), 0.4, 0.01, watch="tell")
    assert motion.validity == ()


def test_a_coarse_run_under_a_controller_is_still_watched():
    """A swinging pendulum in steps of a fifth of its period, under a controller that changes its motor little."""
    body = RigidBody("hub", 2.0, np.diag([0.01, 0.01, 0.01]), center_of_mass=(0.2, 0, 0), position=PLACE)
    quiet = pid(period=0.2, function=lambda t, x: 1e-3 * x[0], state=None, inputs="pin.angle")
    system = replace(rotor(quiet), bodies=[body])
    system = replace(system, forces=[*system.forces, Gravity((0, 0, -9.81))])
    coarse = integrate(system, GeneralizedAlpha(), 8.0, 0.2, watch="tell")
    assert any("step" in note.words for note in coarse.validity)
    fine = integrate(system, GeneralizedAlpha(), 1.0, 1e-3)
    assert fine.validity == ()


# State spaces ---------------------------------------------------------------------------------------------------------


A, B = np.array([[0.9, 0.02], [-0.1, 0.8]]), np.array([[0.5, 0.1], [0.2, -0.3]])
C, D = np.array([[-3.0, 4.0]]), np.array([[-8.0, -2.0]])


@pytest.mark.parametrize("make", ["python-control", "scipy"])
def test_a_discrete_state_space_is_the_same_controller_as_its_function(make):
    if make == "scipy":
        model = StateSpace(A, B, C, D, dt=PERIOD)
    else:
        control = pytest.importorskip("control")
        model = control.ss(A, B, C, D, PERIOD)
    inputs, start = ["pin.angle", "pin.angle.rate"], [0.3, -0.2]
    own = pid(function=lambda t, x, z: (C @ z + D @ x, A @ z + B @ x), state=start)
    made = Controller.of_state_space("pid", model, inputs=inputs, outputs="motor", state=start)
    motions = [integrate(rotor(each), GeneralizedAlpha(), 0.1, 1e-3) for each in (own, made)]
    assert_array_equal(motions[0].joint("pin").angle, motions[1].joint("pin").angle)
    assert np.abs(motions[0].joint("pin").angle).max() > 1e-3


@pytest.mark.parametrize(("change", "words"), [
    ({"dt": None}, "expected a discrete state space with a period, got dt = None; sample it"),
    ({"dt": 0}, "got dt = 0; sample it"),
    ({"dt": True}, "got dt = True; sample it"),
    ({"B": B[:, :1], "D": D[:, :1]}, "inputs: the model has 1, got 2"),
])  # fmt: skip
def test_an_unfit_state_space_is_refused(change, words):
    class Model:
        pass

    for key, value in ({"A": A, "B": B, "C": C, "D": D, "dt": PERIOD} | change).items():
        setattr(Model, key, value)
    with pytest.raises(ModelError, match=f"controller 'pid'.*{words}"):
        Controller.of_state_space("pid", Model, inputs=["pin.angle", "pin.angle.rate"], outputs=["motor"])
    with pytest.raises(ModelError, match="expected a discrete state space with A, B, C, D and dt, got int"):
        Controller.of_state_space("pid", 3, inputs="pin.angle", outputs="motor")


@pytest.mark.parametrize("period", [PERIOD, None])
def test_a_state_space_in_place_of_the_function_is_refused_with_the_way(period):
    """A state space of python-control can be called too, with a frequency."""
    model = pytest.importorskip("control").ss(A, B, C, D, period)
    with pytest.raises(ModelError, match=r"controller 'pid': function: got a state space; take Controller.of_state_sp"):
        pid(function=model)


# Refused by name ------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(("returned", "words"), [
    (None, "its function returned nothing; expected 1 output and the next state"),
    (3.0, "its function returned float 3.0; expected 1 output and the next state"),
    ((None, [0.0]), "the output of its function: expected 1 output and the next state, got nothing"),
    (([1.0, 2.0], [0.0]), r"the output of its function: expected 1 output and the next state, got list \[1.0, 2.0\]"),
    ((np.nan, [0.0]), r"the output of its function: expected finite numbers, got"),
    ((1.0, [np.inf]), r"the state that its function returned: expected finite numbers, got \[inf\]"),
    ((1.0, [0.0, 1.0]), r"the state that its function returned: expected an array of shape \(1,\), got list"),
    (("much", [0.0]), "the output of its function: expected 1 output and the next state, got str 'much'"),
])  # fmt: skip
def test_what_a_function_returns_is_checked_by_name(returned, words):
    """At the second sample, so that the time is told too."""
    bad = pid(function=lambda t, x, z: returned if t > 0 else (0.0, z))
    with pytest.raises(ModelError, match=rf"controller 'pid' at t = 0.01.*{words}"):
        integrate(rotor(bad), GeneralizedAlpha(), 0.1, 1e-3)


def test_an_error_in_a_function_is_told_by_name():
    def failing(t, x):
        return {}["gain"]

    with pytest.raises(ModelError, match="controller 'pid' at t = 0: its function raised KeyError: 'gain'"):
        integrate(rotor(pid(function=failing, state=None)), GeneralizedAlpha(), 0.1, 1e-3)


@pytest.mark.parametrize(("controllers", "words"), [
    ([pid(period=0.0015)], "period = 0.0015: expected a whole multiple of the step, .*take h = 0.00075 and an end"),
    ([pid(period=0.0005)], "expected a whole multiple of the step"),
    ([pid(outputs="moter")], "outputs: no joint force, point force or body load 'moter'; did you mean 'motor'"),
    ([pid(), replace(pid(), name="other")], "controller 'other': outputs: 'motor' is an output of another controller"),
    ([pid(inputs=["pin.angel"])], "controller 'pid': inputs: .*did you mean 'pin.angle'"),
    ([pid(inputs=["tip"])], "controller 'pid': inputs: sensor 'tip' has the columns x, y, z, size; name one, such as"),
])  # fmt: skip
def test_impossible_controllers_are_refused_before_the_run(controllers, words):
    system = rotor(*controllers, sensors=[PlaceSensor("tip", Marker("hub"))])
    with pytest.raises(ModelError, match=words):
        integrate(system, GeneralizedAlpha(), 0.1, 1e-3)


def test_controllers_beside_events_are_refused():
    events = [Event("half", "pin.angle", level=0.5, stop=True)]
    with pytest.raises(ModelError, match=r"expected no events.* beside controllers \(pid\)"):
        integrate(rotor(pid(), events=events), GeneralizedAlpha(), 0.1, 1e-3)


def test_a_system_with_controllers_is_no_unit_of_co_simulation():
    with pytest.raises(ModelError, match=r"controllers \(pid\) act in plain runs only"):
        with_held_inputs(rotor(pid()))


@pytest.mark.parametrize(("change", "words"), [
    ({"period": -1.0}, "controller 'pid': period"),
    ({"inputs": []}, "controller 'pid': inputs: expected names, each once"),
    ({"outputs": ["motor", "motor"]}, "controller 'pid': outputs: expected names, each once"),
    ({"state": [np.nan]}, "controller 'pid': state: expected finite numbers"),
])  # fmt: skip
def test_a_controller_that_makes_no_sense_is_refused(change, words):
    with pytest.raises(ModelError, match=words):
        pid(**change)


# What functions cost --------------------------------------------------------------------------------------------------


def test_the_log_says_what_functions_cost_and_whether_they_are_compiled(caplog):
    def push(t, x, v, z, Q, z_dot):
        Q[0] = -0.1 * v[0]

    coordinate = {"phi": JointCoordinate("pin", "angle")}
    system = rotor(pid())
    for function, words in ((push, "its Python function was called"), (njit(push), "its function is compiled")):
        caplog.clear()
        drag = UserForce("drag", coordinate, forces=["phi"], function=function)
        with caplog.at_level(logging.INFO):
            integrate(replace(system, forces=[*system.forces, drag]), GeneralizedAlpha(), 0.05, 1e-3)
        assert f"force 'drag': {words}" in caplog.text
        assert "controller 'pid': its Python function was called 5 times" in caplog.text
