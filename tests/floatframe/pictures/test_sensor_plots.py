"""Panels of sensors: which columns they show."""

import numpy as np
import pytest
from numpy.testing import assert_allclose

from floatframe import GeneralizedAlpha, Gravity, Marker, ModelError, RigidBody, SphericalJoint, System, integrate
from floatframe.pictures.sensor_plots import plot_measurement, plot_sensors
from floatframe.results.sensors import PlaceSensor, ReactionSensor, measured, measurement_of

SWING = System(
    [RigidBody("bob", 1.0, np.diag([0.1, 0.1, 0.1]), position=(1, 0, 0))],
    [SphericalJoint("pin", "ground", Marker("bob", position=(-1, 0, 0)))],
    [Gravity((0, 0, -9.81))],
    sensors=[PlaceSensor("bob at", Marker("bob")), ReactionSensor("pin force", "pin")],
)


@pytest.fixture(scope="module")
def motion():
    return integrate(SWING, GeneralizedAlpha(), 0.05, 1e-3)


def test_a_quantity_that_is_zero_is_drawn_as_zero(motion):
    reaction = measured(SWING, motion)["pin force"]
    for ax in plot_sensors([reaction]).axes:
        assert ax.lines, f"nothing is drawn in the panel {ax.get_ylabel()}"
    unit = next(unit for name, unit in reaction.units.items() if "moment" in name)
    assert not np.any(plot_measurement(reaction, unit=unit).lines[0].get_ydata())


def test_one_column_of_a_sensor_can_be_asked_for(motion):
    found = measurement_of(SWING, motion, "bob at.z")
    assert list(found.columns) == ["z"]
    assert_allclose(found.columns["z"], measured(SWING, motion)["bob at"].columns["z"])
    assert list(measurement_of(SWING, motion, "bob at").columns) == ["x", "y", "z", "size"]
    with pytest.raises(ModelError, match="sensor 'bob at': no column 'sise'; did you mean 'size'"):
        measurement_of(SWING, motion, "bob at.sise")
    with pytest.raises(ModelError, match="no sensor or joint coordinate 'bob a'"):
        measurement_of(SWING, motion, "bob a")
