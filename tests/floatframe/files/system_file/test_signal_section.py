"""Tables [signals.NAME]: channels of files in the units of the system, in drives and forces; doubts are asked back."""

import logging

import numpy as np
import pytest
from numpy.testing import assert_allclose

from floatframe.errors import SystemFileError
from floatframe.files.signals import Signals, write_rpc
from floatframe.files.system_file.read_system import read_system
from floatframe.model.functions.tables import acceleration_table, linear_table, quintic_table

TIMES = np.arange(41) / 1000
SHOCK = 20.0 * np.sin(np.pi * TIMES / 0.02) * (TIMES < 0.02)  # g
ROAD = 5.0 * np.sin(20 * TIMES)  # mm

BENCH = """
[system]
units = "{units}"

[bodies.table]
mass = 1.0
inertia = [[1, 0, 0], [0, 1, 0], [0, 0, 1]]

[bodies.box]
mass = 1.0
inertia = [[1, 0, 0], [0, 1, 0], [0, 0, 1]]

[joints.base]
type = "prismatic"
body_a = "ground"
body_b = "table"
marker_b = [0, 0, 0]
axis = [0, 0, 1]
{motion}

[joints.guide]
type = "prismatic"
body_a = "table"
body_b = "box"
marker_b = [0, 0, 0]
axis = [0, 0, 1]

[forces.push]
type = "joint-force"
joint = "guide"
coordinate = "distance"
damping = 1.0
{motor}

[signals.shock]
file = "bench.csv"
channel = "acc"
integrate = true
{shock}

[signals.road]
file = "bench.csv"
column = "road"
{road}

[signals.force]
file = "bench.csv"
channel = 3
{force}
"""
DRIVEN = '[joints.base.motions.distance]\ntype = "signal"\nsignal = "{}"\n{}'
MOTOR = '[forces.push.motor]\ntype = "signal"\nsignal = "{}"\n{}'


@pytest.fixture
def bench(tmp_path):
    rows = np.column_stack([TIMES * 1e3, SHOCK, ROAD, 0.3 * TIMES])
    head = "time [ms];acc [g];road [mm];force\n"
    lines = [";".join(f"{x:.15g}".replace(".", ",") for x in row) for row in rows]
    (tmp_path / "bench.csv").write_text(head + "\n".join(lines) + "\n")

    def system(*, units="mm-t-s", motion="", motor="", shock="", road="", force='unit = "kN"', raw=""):
        path = tmp_path / "system.toml"
        text = BENCH.format(units=units, motion=motion, motor=motor, shock=shock, road=road, force=force) + raw
        path.write_text(text)
        return read_system(path)[0]

    return system


def motion_of(system):
    return next(joint for joint in system.joints if joint.name == "base").motions["distance"]


@pytest.mark.parametrize(
    ("units", "length", "time"), [("mm-t-s", 1e-3, 1.0), ("m-kg-s", 1.0, 1.0), ("mm-kg-ms", 1e-3, 1e-3)]
)
def test_an_acceleration_in_g_becomes_the_motion_of_a_base_in_the_units_of_the_system(bench, units, length, time):
    found = motion_of(bench(units=units, motion=DRIVEN.format("shock", "factor = -0.5")))
    g = 9.80665 * time**2 / length
    assert_allclose(found.at(TIMES[:-1] / time, 2), -0.5 * g * SHOCK[:-1], rtol=0, atol=1e-9 * g)
    exact = acceleration_table(TIMES, 9.80665 * SHOCK)
    assert_allclose(found.at(TIMES / time) * length, -0.5 * exact.at(TIMES), rtol=0, atol=1e-12)


def test_positions_are_smooth_and_forces_are_straight_lines_unless_stated(bench):
    system = bench(motion=DRIVEN.format("road", ""), motor=MOTOR.format("force", ""))
    between = np.linspace(0.001, 0.039, 77)
    assert_allclose(motion_of(system).at(between, 2), quintic_table(TIMES, ROAD).at(between, 2), rtol=1e-6, atol=1e-6)
    motor = system.forces[0].motor
    assert_allclose(motor.at(between), linear_table(TIMES, 300 * TIMES).at(between), rtol=1e-12, atol=0)
    cubic = motion_of(bench(motion=DRIVEN.format("road", ""), road='interpolation = "monotone"'))
    assert np.abs(cubic.at(between, 2) - motion_of(system).at(between, 2)).max() > 1.0


def test_the_system_names_its_signals_and_carries_them_into_an_fmu(bench):
    system = bench(motion=DRIVEN.format("road", ""))
    assert [name.rpartition("/")[2] for name in system.files] == ["system.toml", "bench.csv"]


def test_a_signal_can_be_a_piece_of_a_function_and_begin_at_a_time(bench):
    motor = """[forces.push.motor]
type = "piecewise"
t = [0.0, 0.1]
pieces = [{type = "constant", value = 0.0}, {type = "signal", signal = "force", factor = 2.0}]
"""
    found = bench(motor=motor, force='unit = "N"\nt_start = 0.005').forces[0].motor
    assert_allclose(found.at(np.array([0.05, 0.1, 0.115])), [0.0, 0.0, 2 * 0.3 * 0.01], rtol=1e-9, atol=1e-15)


def test_rpc_files_need_no_more(bench, tmp_path):
    write_rpc(Signals(TIMES, ROAD[:, None], ("FL",), ("mm",)), tmp_path / "road.rsp")
    system = bench(motion=DRIVEN.format("rpc", ""), raw='[signals.rpc]\nfile = "road.rsp"\n')
    assert_allclose(motion_of(system).at(TIMES[:-1]), ROAD[:-1], rtol=0, atol=1e-6)


def test_what_was_done_is_said(bench, caplog):
    with caplog.at_level(logging.WARNING):
        bench(shock='drift = "baseline"', road="resample = 250.0\nlow_pass = 100.0", force='unit = "g"\noffset = 9.81')
    told = {name: next(r.getMessage() for r in caplog.records if f"signal {name}:" in r.getMessage())
            for name in ("shock", "road", "force")}  # fmt: skip
    assert "drift baseline: up to" in told["shock"]
    assert "integrated twice: at its end, t = 0.04 s, position" in told["shock"]
    assert "low-pass at 100 Hz" in told["road"]
    assert "resampled from 1000 to 250 Hz: peak acceleration" in told["road"]
    assert "its mean is 9.816 g, which is the gravity if the numbers are in m/s^2: are they?" in told["force"]


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        (
            {"shock": 'unit = "m/s^2"'},
            r"signals.shock: .*channel 'acc': the file states g \(acceleration, 9.80665 in SI",
        ),
        ({"road": 'unit = "mm/s^2"'}, r"signals.road: .*the file states mm \(length"),
        ({"force": ""}, r"signals.force: .*'force': the file states no unit; expected unit"),
        ({"force": 'unit = "kn"'}, r"unit 'kn' is not understood"),
        (
            {"road": "integrate = true"},
            r"signals.road: .*expected an acceleration to integrate twice, got the unit 'mm'",
        ),
        ({"road": 'drift = "mean"'}, "drift: belongs to integrate = true"),
        ({"shock": 'interpolation = "cubic"'}, "linear between samples; remove it"),
        ({"shock": 'drift = "hihg-pass"'}, "did you mean 'high-pass'"),
        ({"road": "resample = 0"}, "signals.road.resample = 0: expected a number above 0, the new rate in Hz"),
        ({"road": "low_pass = 900.0"}, r"signals.road: .*low_pass = 900.0 Hz: .*below half the rate, 500 Hz"),
        ({"raw": '[signals.x]\nfile = "bensh.csv"\n'}, r"no such file: .*did you mean 'bench.csv'"),
        ({"raw": '[signals.x]\nfile = "bench.csv"\n'}, "has 3 channels; name one"),
        ({"raw": '[signals.x]\nfile = "bench.csv"\nchannel = "rod"\n'}, "did you mean 'road'"),
        ({"motion": DRIVEN.format("raod", "")}, r"there is no table \[signals.raod\]; did you mean 'road'"),
        ({"motion": DRIVEN.format("force", "")}, "expected length, but signal 'force' is: force"),
        (
            {"motor": MOTOR.format("road", "")},
            "forces.push.motor: expected force or moment or number, but signal 'road'",
        ),
        ({"motor": '[forces.push.characteristic]\ntype = "signal"\nsignal = "force"'}, "expected no signal over time"),
        ({"motion": DRIVEN.format("road", "omega = 1.0")}, 'motions.distance.omega: unknown key of type "signal"'),
    ],
)
def test_doubtful_signals_are_asked_back(bench, changes, words):
    with pytest.raises(SystemFileError, match=words):
        bench(**changes)


def test_an_acceleration_that_is_not_integrated_is_no_motion(bench, tmp_path):
    with pytest.raises(SystemFileError, match="signal 'a' is: acceleration; integrate = true makes a motion"):
        bench(motion=DRIVEN.format("a", ""), raw='[signals.a]\nfile = "bench.csv"\nchannel = "acc"\n')


def test_tables_of_accelerations_and_interpolations_stand_in_the_file_too(bench):
    motion = """[joints.base.motions.distance]
type = "acceleration-table"
t = [0.0, 1.0, 2.0]
values = [0.0, 6.0, 0.0]
position = 1.0
velocity = 2.0
"""
    found = motion_of(bench(motion=motion))
    assert_allclose([found(1.0), found(2.0), found(1.0, 2)], [1 + 2 + 1, 4 + 5 + 2, 6.0], rtol=1e-12, atol=0)
    motor = '[forces.push.motor]\ntype = "table"\nt = [0.0, 1.0]\nvalues = [0.0, 2.0]\ninterpolation = "linear"\n'
    assert_allclose(bench(motor=motor).forces[0].motor(0.25), 0.5, rtol=1e-12, atol=0)
