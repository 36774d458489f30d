"""Panels of sensors: which columns they show."""

from dataclasses import replace

import numpy as np
import pytest
from matplotlib.figure import Figure
from numpy.testing import assert_allclose

from fe_models.foundation.units import unit_system
from floatframe import GeneralizedAlpha, Gravity, Marker, RevoluteJoint, RigidBody, SphericalJoint, System, integrate
from floatframe.errors import ModelError, ResultsError
from floatframe.results.motion import motion_of
from floatframe.results.sensor_plots import groups_of, plot_measurement, sensor_pages
from floatframe.results.sensors import PlaceSensor, ReactionSensor, measured, measurement_of
from floatframe.results.sensors.measurement import Measurement

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
    for ax in sensor_pages([reaction])[0].axes:
        assert ax.lines, f"nothing is drawn in the panel {ax.get_ylabel()}"
    columns = next(group for group in groups_of(reaction) if "moment" in group[0])
    assert not np.any(plot_measurement(reaction, columns=columns).lines[0].get_ydata())


def test_one_column_of_a_sensor_can_be_asked_for(motion):
    found = measurement_of(SWING, motion, "bob at.z")
    assert list(found.columns) == ["z"]
    assert_allclose(found.columns["z"], measured(SWING, motion)["bob at"].columns["z"])
    assert list(measurement_of(SWING, motion, "bob at").columns) == ["x", "y", "z", "size"]
    with pytest.raises(ModelError, match="sensor 'bob at': no column 'sise'; did you mean 'size'"):
        measurement_of(SWING, motion, "bob at.sise")
    with pytest.raises(ModelError, match="no sensor or joint coordinate 'bob a'"):
        measurement_of(SWING, motion, "bob a")


def labels(figure):
    """Labels of the axes and of the curves of each panel."""
    return [(ax.get_xlabel(), ax.get_ylabel(), [line.get_label() for line in ax.lines]) for ax in figure.axes]


def test_a_motion_plots_sensors_joints_and_bodies_with_units(motion):
    """The bob stays in the plane y = 0, so that y is left out beside the others."""
    assert labels(motion.plot("bob at")) == [("time [s]", "bob at [m]", ["x", "z", "size"])]
    assert labels(motion.plot("bob")) == [("time [s]", "bob position [m]", ["x", "z", "size"])]
    force, moment = labels(motion.plot("pin"))
    assert force[1] == "pin reaction [N]"
    assert moment[1] == "pin reaction [N m]"
    assert_allclose(motion.plot("bob").axes[0].lines[1].get_ydata(), motion.body("bob").r[:, 2], rtol=0, atol=0)
    hinge = RevoluteJoint("pin", "ground", Marker("bob", position=(-1, 0, 0)), axis=(0, 1, 0))
    turning = integrate(replace(SWING, joints=[hinge]), GeneralizedAlpha(), 0.01, 1e-3)
    panels = [(ax.get_title(), ax.get_ylabel()) for ax in turning.plot("pin").axes]
    own = [("pin.angle", label) for label in ("value [rad]", "rate [rad/s]", "force [N m]")]
    assert panels == [*own, ("pin reaction", "pin reaction [N]"), ("pin reaction", "pin reaction [N m]")]


def test_gaps_of_the_size_show_the_component_below_it(motion):
    (ax,) = motion.plot("bob at").axes
    dashed = {line.get_label(): line.is_dashed() for line in ax.lines}
    assert dashed == {"x": False, "z": False, "size": True}


def test_axes_have_the_units_of_the_system():
    motion = integrate(replace(SWING, units=unit_system("mm-kg-ms")), GeneralizedAlpha(), 0.05, 1e-3)
    assert labels(motion.plot("bob at"))[0][:2] == ("time [ms]", "bob at [mm]")
    assert labels(motion.plot("pin force"))[0][:2] == ("time [ms]", "pin force [kN]")
    ax = Figure().add_subplot()
    motion.plot("bob at.z", ax=ax)
    assert ax.get_xlabel() == "time [ms]"


def test_a_motion_plots_into_given_axes_what_has_one_unit(motion):
    ax = Figure().add_subplot()
    assert motion.plot("bob at.z", "bob", ax=ax) is ax.figure
    assert ax.get_ylabel() == "[m]"
    assert [line.get_label() for line in ax.lines] == [
        "bob at.z", "bob position x", "bob position z", "bob position size"
    ]  # fmt: skip
    alone = Figure().add_subplot()
    motion.plot("bob at.z", ax=alone)
    assert alone.get_ylabel() == "bob at.z [m]"
    with pytest.raises(ResultsError, match=r"of one unit for the given axes, got .*force.* \[N\]; .*moment.* \[N m\]"):
        motion.plot("pin force", ax=Figure().add_subplot())


def test_a_chosen_column_keeps_the_name_by_which_it_was_chosen(motion):
    table = motion.to_table("bob at z", "bob at.x", "bob at")
    assert list(table.columns) == ["t", "bob at z", "bob at.x", "bob at x", "bob at y", "bob at size"]


def test_more_than_a_dozen_columns_are_drawn_in_groups():
    t = np.linspace(0.0, 1.0, 5)
    many = {f"q{k}": np.sin((k + 1) * t) for k in range(29)} | {"still": np.zeros(5)}
    whole = Measurement("modes", t, many, dict.fromkeys(many, "m"))
    groups = groups_of(whole)
    assert [len(group) for group in groups] == [10, 10, 9]
    assert [name for group in groups for name in group] == list(many)[:29]
    (figure,) = sensor_pages([whole])
    assert [[line.get_label() for line in ax.lines] for ax in figure.axes] == [list(group) for group in groups]


def test_many_sensors_are_drawn_on_pages_of_eight_panels(motion):
    """Of 20 panels, page 3 has the last four; the title of a page says where it is."""
    many = replace(SWING, sensors=[PlaceSensor(f"at {k}", Marker("bob")) for k in range(20)])
    moved = motion_of(motion, many)
    pages = [moved.plot("at *", page=number) for number in (1, 2, 3)]
    assert [len(page.axes) for page in pages] == [8, 8, 4]
    assert pages[2].get_suptitle() == "system, page 3 of 3"
    assert [ax.get_title() for page in pages for ax in page.axes] == [sensor.name for sensor in many.sensors]
    assert max(page.get_size_inches()[1] for page in pages) < 15
    with pytest.raises(ResultsError, match="page = 4: expected a page from 1 to 3"):
        moved.plot("at *", page=4)
