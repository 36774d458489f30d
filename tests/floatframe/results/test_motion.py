"""A motion by names: joints, bodies, sensors, tables; beside the functions that compute the same from the arrays."""

import sys
from dataclasses import replace

import pytest
from numpy.testing import assert_array_equal

import floatframe as ff
from fe_models.foundation.extras import MissingExtraError
from floatframe.errors import ResultsError
from floatframe.results.motion import motion_of
from floatframe.results.sensors import coordinate_sensors
from floatframe.results.trajectory import read_trajectory
from tests.floatframe.results.examples import SYSTEM

HINGE = ff.RevoluteJoint("pin", ff.GROUND, ff.Marker("rod", "end_b"), axis=(0.2, 1.0, 0.1))
SPEED = ff.sensors.PlaceSensor("bob speed", ff.Marker("bob"), "velocity")
SENSED = replace(SYSTEM, joints=(HINGE, *SYSTEM.joints[1:]), sensors=(SPEED,))


@pytest.fixture(scope="module")
def motion():
    return ff.integrate(SENSED, ff.GeneralizedAlpha(), 0.03, 1e-3)


def test_joint_coordinates_are_attributes_of_the_joint(motion):
    pin, known = motion.joint("pin"), ff.sensors.measured(SENSED, motion, coordinate_sensors(SENSED))
    for name in pin.coordinates:
        expected = known[f"pin.{name}"]
        assert_array_equal(getattr(pin, name), expected.value)
        assert_array_equal(getattr(pin, f"{name}_rate"), expected.rate)
        assert_array_equal(getattr(pin, f"{name}_force"), expected.force)
        assert {name, f"{name}_rate"} <= set(dir(pin))
    assert pin.coordinates
    assert_array_equal(pin.reaction.force, motion.reaction("pin").force)
    assert_array_equal(pin.drift.distance, motion.drift("pin").distance)


def test_bodies_have_their_motion_and_the_places_on_them(motion):
    rod = motion.body("rod")
    assert_array_equal(rod.v, motion_of(motion, None).source.read("u")[:, motion.entry("rod")[1].u0 :][:, :3])
    name = rod.reduced.interfaces[0].name
    assert_array_equal(
        rod.interface(name).position, ff.results.interface_motion(motion, "rod", rod.reduced, name).position
    )
    assert rod.displacement(-1).shape == (len(rod.reduced.nodes), 3)
    with pytest.raises(ResultsError, match="body 'bob' is rigid"):
        motion.body("bob").interface("end")


@pytest.mark.parametrize("name", ["bob speed x", "bob speed.x"])
def test_columns_of_sensors_are_named_with_a_point_or_a_space(motion, name):
    whole = motion.sensor("bob speed")
    assert_array_equal(whole.x, motion.body("bob").v[:, 0])
    assert_array_equal(whole["x"], whole.x)
    assert_array_equal(motion.sensor(name).columns["x"], whole.x)
    assert "x" in dir(whole)


def test_tables_have_the_names_times_and_units_of_the_measurements(motion):
    frame, data = motion.to_dataframe(), motion.to_xarray("bob*", "pin.angle")
    assert_array_equal(frame.index, motion.t)
    assert_array_equal(frame["bob speed x"], motion.sensor("bob speed").x)
    assert_array_equal(frame["pin.angle value"], motion.joint("pin").angle)
    assert frame.attrs["units"]["bob speed x"] == data["bob speed x"].attrs["units"] == "m/s"
    assert_array_equal(data["t"], motion.t)
    assert data["t"].attrs["units"] == "s"
    import pandas as pd

    assert_array_equal(pd.DataFrame(motion.sensor("bob speed").columns, index=motion.t)["y"], frame["bob speed y"])


@pytest.mark.parametrize(
    ("ask", "error", "words"),
    [
        (lambda m: m.joint("pins"), ResultsError, "no joint 'pins'; did you mean 'pin'"),
        (lambda m: m.joint("pin").angel, AttributeError, "its coordinates are angle"),
        (lambda m: m.joint("pin").coordinate("angel"), ResultsError, "did you mean 'angle'"),
        (lambda m: m.sensor("bob sped"), ff.errors.ModelError, "did you mean 'bob speed'"),
        (lambda m: m.sensor("bob speed").w, AttributeError, "columns: x, y, z, size"),
        (lambda m: m.sensor("bob speed")["w"], ResultsError, "no column 'w'"),
    ],
)
def test_names_that_do_not_exist_are_answered_with_those_that_do(motion, ask, error, words):
    with pytest.raises(error, match=words):
        ask(motion)


def test_a_motion_read_from_a_file_of_python_asks_for_its_system(motion, tmp_path):
    path = tmp_path / "swing.h5"
    ff.integrate(SENSED, ff.GeneralizedAlpha(), 0.03, 1e-3, output=path)
    with pytest.raises(ResultsError, match="system is not known here"):
        _ = ff.read_results(path).joint("pin").angle
    again = ff.read_results(path, SENSED)
    assert_array_equal(again.joint("pin").angle, motion.joint("pin").angle)
    assert type(read_trajectory(path)).__name__ == "Trajectory"


def test_without_pandas_the_message_says_how_to_install_it(motion, monkeypatch):
    monkeypatch.setitem(sys.modules, "pandas", None)
    with pytest.raises(MissingExtraError, match=r"pip install \"floatframe\[tables\]\""):
        motion.to_dataframe()
