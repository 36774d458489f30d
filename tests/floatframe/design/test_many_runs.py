"""Many runs of one system are, bit for bit, the single runs; failures are rows; wrong tables are refused by name."""

from dataclasses import dataclass, replace

import numpy as np
import pytest
from numpy.testing import assert_array_equal
from scipy.spatial.transform import Rotation

import cms
import floatframe as ff
from fe_models.foundation.tasks.task_map import ProcessError
from floatframe.design.gradients.parameters import with_value
from floatframe.design.many_runs import integrate_many
from floatframe.errors import ModelError, ResultsError
from floatframe.forces import SphereContact
from floatframe.model.functions.time_functions import constant
from floatframe.simulation import Event
from tests.bodies import beam

R = Rotation.from_rotvec([0.7, -0.4, 1.1])
PLACE = np.array([3.0, -2.0, 1.5])
METHOD = ff.GeneralizedAlpha(rho_inf=0.8)
TIMES = {"t_end": 0.03, "h": 1e-4, "output_every": 15}
TABLE = {
    "bodies.ball.mass": [0.3, 0.5, -1.0, 0.4],
    "forces.touch.stiffness": [3e5, 2e5, 2e5, 1e5],
    "bodies.rod.omega_B.0": [20.0, 40.0, 30.0, 10.0],
}
FAILED = 2  #: row of the table with an impossible mass


def general_system(*sensors):
    """Return a spinning flexible rod on a bearing, whose end a spinning ball hits, turned and off the origin."""
    body = cms.couple(beam(4, length=0.6, A=4e-4, Iy=1e-8, Iz=2e-8, J=3e-8))
    rod = cms.reduce(body, cms.craig_bampton(body, n_modes=2))
    x, y, z, w = R.as_quat()
    placed = {"position": PLACE, "orientation": (w, x, y, z)}
    rod = ff.FlexibleBody("rod", rod, **placed, omega_B=(20.0, 0.0, 0.0))
    at = PLACE + R.apply([0.55, 0.02, -0.111])
    ball = ff.RigidBody("ball", 0.3, 1e-3 * np.eye(3), position=at, velocity=R.apply([0.0, 0.1, 1.0]),
                        omega_B=(3.0, -5.0, 40.0))  # fmt: skip
    bearing = ff.SphericalJoint("bearing", ff.Marker(ff.GROUND, position=PLACE), ff.Marker("rod", "left"))
    touch = SphereContact("touch", ff.Marker("ball"), ff.Marker("rod", "right"), 0.02, 0.1, stiffness=3e5,
                          restitution=0.6, friction=0.2)  # fmt: skip
    hold = ff.SpringDamper("hold", ff.Marker(ff.GROUND, position=(3.7, -1.6, 2.9)), ff.Marker("ball"), 50.0, 0.1)
    tip = ff.sensors.PlaceSensor("tip", ff.Marker("rod", "right"), "velocity")
    heart = ff.sensors.PlaceSensor("heart", ff.Marker("ball"), "position")
    return ff.System([rod, ball], [bearing], [ff.Gravity(R.apply([0.0, 0.0, -9.81])), touch, hold],
                     sensors=[tip, heart, *sensors])  # fmt: skip


def single_run(system, row):
    for path, values in TABLE.items():
        system = with_value(system, path, values[row])
    return ff.integrate(system, METHOD, **TIMES)


@pytest.mark.parametrize("workers", [1, 2])
def test_every_run_is_the_single_run_bit_by_bit_and_a_failure_is_a_row(workers):
    system = general_system()
    many = integrate_many(system, TABLE, METHOD, **TIMES, workers=workers)
    assert [bool(error) for error in many.errors] == [False, False, True, False]
    assert many.n_failed == 1
    assert "'ball': mass: expected a number above 0, got -1" in many.errors[FAILED]
    assert list(many.sensors) == ["tip", "heart"]
    assert all(np.isnan(values[FAILED]).all() for values in many.sensors.values())
    for row in (0, 1, 3):
        motion = single_run(system, row)
        assert_array_equal(many.t, motion.t)
        for name in ("tip", "heart"):
            measured = motion.sensor(name)
            assert many.columns[name] == tuple(measured.columns)
            assert many.units[name] == tuple(measured.units.values())
            assert_array_equal(many.sensors[name][row], np.column_stack(list(measured.columns.values())))
    tips = many.column("tip", "size")
    assert np.ptp(tips[[0, 1, 3], -1]) > 1e-3 * tips[0, -1], "the parameters act"


def test_coordinates_and_columns_are_sensors_too_and_the_state_at_the_start_is_given():
    system = general_system()
    begun = single_run(system, 1).state(4)
    path = "forces.hold.stiffness"
    options = dict(TIMES, t_start=0.006, state=begun, formulation="relative", watch="off")
    many = integrate_many(system, {path: [60.0]}, METHOD, **options, sensors=["tip x", "heart"], workers=1)
    motion = ff.integrate(with_value(system, path, 60.0), METHOD, **options)
    assert_array_equal(many.column("tip x")[0], motion.sensor("tip").x)
    assert_array_equal(many.t, motion.t)


@pytest.mark.parametrize("t_start", [0.1, 3e6, 1e8])
def test_no_output_is_lost_where_times_are_coarse(t_start):
    """At 1e8 s times are rounded to 1.5e-4 of this step."""
    times = {"t_start": t_start, "t_end": t_start + 0.003, "h": 1e-4}
    many = integrate_many(general_system(), {"forces.hold.stiffness": [60.0]}, METHOD, **times, workers=1)
    motion = ff.integrate(with_value(general_system(), "forces.hold.stiffness", 60.0), METHOD, **times)
    assert_array_equal(many.column("tip", "x")[0], motion.sensor("tip").x)


def test_after_an_event_that_ends_a_run_its_row_has_no_numbers():
    hit = Event("hit", "speed.size", 0.65, "falling", stop=True)
    mark = Event("mark", at=0.0021, record=True)  # a row between the output times
    speed = ff.sensors.PlaceSensor("speed", ff.Marker("ball"), "velocity")
    system = replace(general_system(speed), events=[hit, mark])
    table = {"forces.touch.stiffness": [3e5, 1.0]}
    many = integrate_many(system, table, METHOD, **TIMES, workers=1)
    assert many.n_failed == 0
    lengths = [int(np.isfinite(values).sum()) for values in many.column("tip", "x")]
    assert lengths[0] < lengths[1] == len(many.t)
    for row, stiffness in enumerate(table["forces.touch.stiffness"]):
        motion = ff.integrate(with_value(system, "forces.touch.stiffness", stiffness), METHOD, **TIMES)
        at = np.isin(motion.t, many.t)
        assert np.abs(motion.t[~at] - 0.0021).min() < 1e-9
        assert_array_equal(many.column("tip", "x")[row, : lengths[row]], motion.sensor("tip").x[at])


def test_what_a_run_warns_of_is_with_its_row(caplog):
    system = general_system()
    many = integrate_many(system, {"forces.hold.stiffness": [50.0, 1e9]}, METHOD, 0.5, 1e-2, workers=1)
    calm, stiff = (" ".join(notes) for notes in many.notes)
    assert "h = 0.01 resolves 0 of" in calm
    assert "the error of the steps" in stiff
    assert "the error of the steps" not in calm
    assert all(any(words in record.message for record in caplog.records) for words in many.notes[1])


@dataclass(frozen=True, eq=False)
class Latch(ff.RevoluteJoint):
    """A hinge that a number locks."""

    locked: float = 0.0

    def rows(self, A_a, A_b, d):
        hinge = ff.RevoluteJoint("hinge", self.marker_a, self.marker_b, self.axis)
        locked = replace(hinge, motions={"angle": constant(0.0)})
        return (locked if self.locked else hinge).rows(A_a, A_b, d)


def test_a_number_that_changes_the_topology_is_refused_by_its_name():
    body = ff.RigidBody("arm", 1.0, np.eye(3), (0.3, 0.1, 0.0))
    latch = Latch("latch", ff.Marker(ff.GROUND), ff.Marker("arm"), axis=(0.6, 0.8, 0.0))
    system = ff.System([body], [latch], [ff.Gravity((0, 0, -9.81))])
    table = {"bodies.arm.mass": [1.0, 2.0], "joints.latch.locked": [0.0, 1.0]}
    with pytest.raises(ModelError, match=r"'joints\.latch\.locked' changes the topology .*run_study"):
        integrate_many(system, table, METHOD, 0.1, 1e-2, sensors=["latch.angle"], workers=1)


@pytest.mark.parametrize(
    ("table", "words"),
    [
        ({}, "expected at least one"),
        ({"bodies.bal.mass": [1.0]}, "there is no 'bal'; did you mean 'ball'"),
        ({"bodies.ball.mass": 1.0}, "expected a finite number for each run"),
        ({"bodies.ball.mass": [1.0, np.nan]}, r"number for each run, \(n_runs,\), got \[1\.0, nan\]"),
        ({"bodies.ball.mass": ["heavy"]}, "expected a finite number for each run"),
        ({"bodies.ball.mass": [1.0], "gravity.1": [1.0, 2.0]}, r"got bodies\.ball\.mass 1, gravity\.1 2"),
    ],
)
def test_wrong_tables_are_refused_before_the_first_run(table, words):
    with pytest.raises(ModelError, match=words):
        integrate_many(general_system(), table, METHOD, **TIMES, workers=1)


def test_a_function_that_no_other_process_can_find_is_told_and_runs_here():
    def push(t, x, v, z, Q, z_dot):
        Q[0] = 1.0

    body = ff.RigidBody("arm", 1.0, np.eye(3), (0.3, 0.1, 0.0))
    pin = ff.RevoluteJoint("pin", ff.Marker(ff.GROUND), ff.Marker("arm"), axis=(0.6, 0.8, 0.0))
    force = ff.UserForce("push", {"turn": "pin.angle"}, ["turn"], function=push)
    system = ff.System([body], [pin], [force], name="swing")
    given = {"bodies.arm.mass": [1.0, 2.0]}, METHOD, 0.01, 1e-3
    with pytest.raises(ProcessError, match="system 'swing' cannot be sent to other processes"):
        integrate_many(system, *given, sensors=["pin.angle"], workers=2)
    assert integrate_many(system, *given, sensors=["pin.angle"], workers=1).n_failed == 0


@pytest.mark.parametrize(
    ("options", "words"),
    [
        ({"watch": "of"}, "watch: expected one of stop, tell, off, got 'of'; did you mean 'off'"),
        ({"formulation": "realtive"}, "formulation: expected one of absolute, relative, got 'realtive'"),
        ({"output_every": 0}, "output_every: expected at least 1, got 0"),
    ],
)
def test_wrong_options_are_refused_before_the_first_run(options, words):
    with pytest.raises(ModelError, match=words):
        integrate_many(general_system(), {"bodies.ball.mass": [1.0]}, METHOD, **{**TIMES, **options}, workers=1)


def test_wrong_sensors_and_times_are_refused_before_the_first_run():
    system, table = general_system(), {"bodies.ball.mass": [1.0]}
    with pytest.raises(ModelError, match="no sensor or joint coordinate 'tipp'; did you mean 'tip'"):
        integrate_many(system, table, METHOD, **TIMES, sensors=["tipp"], workers=1)
    with pytest.raises(ModelError, match="expected t_end above"):
        integrate_many(system, table, METHOD, -1.0, 1e-3, workers=1)
    with pytest.raises(ModelError, match="sensors: expected at least one, system 'system' has none"):
        integrate_many(replace(system, sensors=()), table, METHOD, **TIMES, workers=1)
    many = integrate_many(system, table, METHOD, **dict(TIMES, output_every=1000), workers=1)
    assert (many.errors, many.t.tolist()) == (("",), [0.0])
    with pytest.raises(ResultsError, match="no column 'w'; choices: size, x, y, z"):
        many.column("tip", "w")
    with pytest.raises(ResultsError, match="no sensor 'tap'; did you mean 'tip'"):
        many.column("tap")
