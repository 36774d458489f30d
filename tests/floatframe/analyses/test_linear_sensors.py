"""Sensors as outputs of a linearised system, against the equations of motion near by, statics and balances."""

from dataclasses import dataclass, replace

import numpy as np
import pytest
from numba import njit
from numpy.testing import assert_allclose

from floatframe import JointForce, Marker, PointForce, UserForce, linearize, static_equilibrium
from floatframe.analyses import ParameterInput, campbell, steady_rotation
from floatframe.errors import ModelError
from floatframe.joints import JointCoordinate
from floatframe.model.elements import Element, ElementLaw
from floatframe.results.sensors.places import PLACE_QUANTITIES, TURNING
from floatframe.sensors import (
    AngleSensor,
    Channel,
    DisplacementSensor,
    ElementSensor,
    InterfaceForceSensor,
    PlaceSensor,
    ReactionSensor,
    SpringSensor,
    StressSensor,
    VonMisesSensor,
)
from tests.floatframe.analyses.examples import (
    assert_slopes,
    compare,
    flexible,
    machine,
    rotor,
    sensors,
    slope_at_once,
    values_of,
)


@pytest.fixture(scope="module")
def rest():
    system = machine()
    about = static_equilibrium(system, tolerance=1e-12)
    return system, about, linearize(system, about, outputs=sensors())


def test_every_column_is_the_slope_of_what_is_measured_on_motions_near_by(rest):
    system, about, linear = rest
    columns = {name.partition(".")[0] for name in linear.outputs}
    assert columns == {sensor.name for sensor in sensors()}
    assert_allclose(linear.output_values, values_of(system, about.state, about.u_dot, about.w, linear.outputs))
    compare(system, about, linear)


def test_what_is_not_linear_is_said(rest):
    linear = rest[2]
    for name in ("velocity 0.size", "vm.node", "momentum.linear size", "acceleration 1.size"):
        assert name in linear.left_out
    assert "mount ground.force size" in linear.outputs


def rotor_sensors():
    node = flexible(5).nodes[5]
    places = [Marker("blade", position=node), Marker("pin", position=(0.1, 0.2, 0.3)), Marker("blade", "end_a")]
    absolute = [what for what in PLACE_QUANTITIES if what != "rotation-vector"]
    return [
        *(PlaceSensor(f"{what} {k}", place, what) for what in absolute for k, place in enumerate(places)
          if k or what not in TURNING),
        *(PlaceSensor(f"seen {what}", places[1], what, places[2]) for what in PLACE_QUANTITIES),
        *(ReactionSensor(f"{of} {axes}", of, axes) for of in ("main", "knuckle", "tie", "root", "cage")
          for axes in ("ground", "marker")),
        InterfaceForceSensor("on blade", "blade", "end_b", "body"), SpringSensor("spring", "tie"),
        StressSensor("stress", "blade", position=node), VonMisesSensor("vm", "blade"),
        AngleSensor("angle", places[2], places[1]), DisplacementSensor("bend", places[2]),
    ]  # fmt: skip


def test_columns_about_a_steady_rotation_are_those_of_motions_near_by():
    system = rotor()
    about = steady_rotation(system, (0, 0, 2.0), tolerance=1e-12)
    linear = linearize(system, about, outputs=rotor_sensors())
    assert_allclose(linear.output_values[linear.outputs.index("acceleration 1.size")], 4 * 0.8, rtol=0.2)
    compare(system, about, linear, rotor_sensors(), size=4e-6, tolerance=2e-6)
    with pytest.raises(ModelError, match="not linear about it"):
        linearize(system, about, outputs=[PlaceSensor("turn", Marker("hub"), "rotation-vector")])


@njit
def shown_motion(t, x, z, lam, data, wrench, z_dot, g, outputs):
    for k in range(12):
        outputs[k] = x[0, 12 + k]


@dataclass(frozen=True, eq=False)
class ShownMotion(Element):
    """A marker that shows its velocity, angular velocity and both accelerations."""

    name: str
    marker: Marker

    def law(self, placed):
        names = tuple(f"{what}{axis}" for what in ("v", "w", "a", "alpha") for axis in "xyz")
        return ElementLaw(function=shown_motion, data=[], outputs=names, tangent="complex", accelerations=True)


@pytest.mark.parametrize("marker", [Marker("ball", position=(0.1, 0.2, 0.3)), Marker("blade", "end_a")])
def test_an_element_shows_absolute_rates_about_a_steady_rotation(marker):
    """The ball and the blade tilt in their bushings: theta' is their angular velocity, without Omega × theta."""
    system = replace(rotor(), elements=[ShownMotion("shown", marker)])
    about, seen = steady_rotation(system, (0, 0, 2.0), tolerance=1e-12), [ElementSensor("seen", "shown")]
    compare(system, about, linearize(system, about, outputs=seen), seen, size=4e-6, tolerance=2e-6)


INPUTS = {
    "push": (Channel("push", Marker("block", position=(0.1, 0, 0)), (0.6, 0, 0.8)), "force"),
    "twist": (Channel("twist", Marker("arm", "end_a"), (0, 0.6, 0.8), "rotation"), "torque"),
    "motor": (JointCoordinate("root", "angle", "motor", rate=0), "motor"),
    "stiffness": (ParameterInput("stiffness", "control", "k"), "k"),
}


def with_input(name, s):
    """The machine with a constant input of size s."""
    channel, how = INPUTS[name]
    if how == "motor":
        return machine(JointForce("motor", "root", "angle", preload=s))
    if how == "k":
        system = machine()
        control = next(force for force in system.forces if isinstance(force, UserForce))
        changed = replace(control, parameters={**control.parameters, "k": control.parameters["k"] + s})
        return replace(system, forces=[changed if force is control else force for force in system.forces])
    return machine(PointForce("input", channel.marker, **{how: s * channel.direction}))


@pytest.mark.parametrize("name", INPUTS)
def test_inputs_act_as_forces_of_their_size_at_once_and_in_equilibrium(rest, name):
    system, about, _ = rest
    linear = linearize(system, about, inputs=[INPUTS[name][0]], outputs=sensors())
    assert_slopes(linear, lambda size: with_input(name, size), about, 1e-4, rtol=3e-6, atol=1e-8)
    at_once = slope_at_once(linear)
    assert_allclose(linear.feedthrough(), at_once, rtol=0, atol=1e-9 * np.abs(at_once).max())


def test_a_campbell_diagram_keeps_the_steady_values_of_outputs():
    """The bushing of the ball carries m omega² r, r as it gives way."""
    speeds = [2.0, 2.2]
    places = [ReactionSensor("cage", "cage"), PlaceSensor("ball", Marker("ball"))]
    locus = campbell(rotor(), speeds, outputs=places)
    table = dict(zip(locus.outputs, locus.steady.T, strict=True))
    assert_allclose(np.hypot(table["cage.force x"], table["cage.force y"]),
                    0.2 * np.square(speeds) * np.hypot(table["ball.x"], table["ball.y"]), rtol=1e-7)  # fmt: skip
    assert locus.output_units[0] == "N"
