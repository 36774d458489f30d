"""Amplitudes of forces and motors as inputs: slopes of motions and equilibria with a little more of them."""

import gc
from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose

import cms
from fe_models.body.load_cases import ReducedLoadCase
from fe_models.body.loads import gravity_load
from floatframe import (
    GROUND,
    JointForce,
    Marker,
    PointForce,
    RevoluteJoint,
    RigidBody,
    System,
    UserForce,
    linearize,
    static_equilibrium,
)
from floatframe.analyses import ForceInput
from floatframe.analyses.linear import force_inputs
from floatframe.engine.compiling.callbacks.user_forces import C_FUNCTION
from floatframe.errors import ModelError
from floatframe.forces import BodyLoad
from floatframe.model.functions.time_functions import constant, harmonic
from floatframe.sensors import RecoverySensor
from tests.cms.reduction.geometric_stiffness.examples import bar_of_beams
from tests.floatframe.analyses.examples import TURN, assert_slopes, held, machine, sensors, values_of

CASE = ReducedLoadCase("wind", "nodal", np.array([0.3, -0.2, 0.5]), np.array([0.1, 0.2, -0.3]), np.arange(1.0, 4.0) / 5)


def loaded(name="", s=0.0):
    """The machine with forces of all kinds, one of them larger by s."""

    def by(own, amplitude=0.4):
        return constant(amplitude + s) if own == name else constant(amplitude)

    system = machine(
        PointForce(
            "push", Marker("block", position=(0.1, 0, 0)), (1.0, -2.0, 0.5), (0.1, 0, 0.2), amplitude=by("push")
        ),
        PointForce("nose", Marker("arm", "end_a", triad=TURN), (0.4, 0.2, -0.7), (0, 0.3, 0), True, by("nose")),
        PointForce("fixed", Marker("arm", "end_a"), (0.4, 0.2, -0.7), (0.1, 0.3, 0), False, by("fixed")),
        JointForce("drive", "root", "angle", motor=by("drive")),
        BodyLoad("gust", "arm", "wind", by("gust")),
    )
    arm = system.bodies[0]
    n_q = arm.reduced.n_q
    case = replace(CASE, h=np.resize(CASE.h, n_q))
    return replace(system, bodies=[replace(arm, reduced=replace(arm.reduced, load_cases=(case,))), *system.bodies[1:]])


@pytest.fixture(scope="module")
def rest():
    system = loaded()
    return system, static_equilibrium(system, tolerance=1e-12)


@pytest.mark.parametrize("name", ["push", "nose", "fixed", "drive", "gust"])
def test_an_amplitude_acts_at_once_and_in_equilibrium(rest, name):
    system, about = rest
    linear = linearize(system, about, inputs=[ForceInput(name, name)], outputs=sensors())
    assert linear.input_units == ("N m" if name == "drive" else "1",)
    assert_slopes(linear, lambda size: loaded(name, size), about, 5e-4, rtol=5e-6, atol=2e-8)


def test_the_static_part_of_a_load_case_is_fed_through():
    """Recovered stresses and forces under a steady load case: the slope of the rows by its amplitude."""
    body = bar_of_beams(6)
    body = body.with_load_cases(gravity_load(body, "side", (0.0, 3.0, 1.0)))
    coupled = cms.couple(body)
    asked = [
        cms.reduction.RecoveryRequest(
            "table", rows=(cms.reduction.Rows("interface force"), cms.reduction.Rows("beam force"))
        )
    ]
    bar = cms.reduce(coupled, cms.craig_bampton(coupled, n_modes=1), recovery=asked)

    def system(a):
        push = PointForce("push", Marker("bar", bar.interfaces[1].name), force=(0.0, 10.0, 0.0))
        return held(bar, push, BodyLoad("gust", "bar", "side", a))

    sensor = RecoverySensor("rows", "bar", "table")
    about = static_equilibrium(system(1.0), tolerance=1e-12)
    linear = linearize(system(1.0), about, inputs=[ForceInput(x, x) for x in ("push", "gust")], outputs=[sensor])
    columns = [bar.recovery["table"].loads.index("load case side")]
    assert np.abs(bar.recovery["table"].static[:, columns]).max() > 0
    ends = []
    for a in (1.05, 0.95):
        moved = static_equilibrium(system(a), about.state, tolerance=1e-12)
        ends.append(values_of(system(a), moved.state, moved.u_dot, moved.w, linear.outputs, [sensor]))
    slope = (ends[0] - ends[1]) / 0.1
    assert_allclose(linear.response([0.0])[0].real[:, 1], slope, rtol=1e-4, atol=1e-5 * np.abs(slope).max())


def test_what_is_refused(rest):
    system, about = rest
    for force, words in (("pusch", "does not exist.*did you mean 'push'"), ("mount", "has no amplitude or motor")):
        with pytest.raises(ModelError, match=words):
            linearize(system, about, inputs=[ForceInput("x", force)])


def test_a_force_without_an_amplitude_has_one_of_one(rest):
    """Without amplitude, or at the value a function of time has at zero: the same column."""
    system = machine(PointForce("push", Marker("block"), (1.0, 2.0, 3.0)))
    same = machine(PointForce("push", Marker("block"), (1.0, 2.0, 3.0), amplitude=harmonic(5.0, 3.0, offset=1.0)))
    about = static_equilibrium(system)
    columns = [linearize(each, about, inputs=[ForceInput("p", "push")]).B for each in (system, same)]
    assert_allclose(columns[0], columns[1], rtol=1e-12)


def test_a_python_force_beside_an_input_is_kept_while_it_is_called(monkeypatch):
    """Addresses that were freed would be given to the functions made here, which spoil the outputs of the force."""

    def spring(t, x, v, z, Q, z_dot):
        Q[0] = -3.0 * x[0]

    def spoil(inputs, outputs):
        outputs[0] = np.nan

    def spoilt(*given, **named):
        gc.collect()
        others.extend(C_FUNCTION(spoil) for _ in range(64))
        return plain(*given, **named)

    plain, others = force_inputs.set_iterate, []
    rod = RigidBody("rod", 2.0, np.diag([0.1, 0.2, 0.2]))
    pin = RevoluteJoint("pin", Marker(GROUND), Marker("rod"), axis=(0, 1, 0))
    held = UserForce("spring", {"phi": "pin.angle"}, forces=["phi"], function=spring)
    system = System(rod, pin, [held, JointForce("motor", "pin", "angle", motor=0.0)])
    monkeypatch.setattr(force_inputs, "set_iterate", spoilt)
    linear = linearize(system, inputs=["motor.torque"], outputs=["pin.angle"])
    assert_allclose(linear.L @ np.linalg.solve(linear.K, linear.B), [[1 / 3.0]], rtol=1e-6)
