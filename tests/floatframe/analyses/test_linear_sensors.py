"""Sensors as outputs of a linearised system, against the equations of motion near by, statics and balances."""

from dataclasses import dataclass, replace

import numpy as np
import pytest
from numba import njit
from numpy.testing import assert_allclose, assert_array_equal

from floatframe import (
    GROUND,
    Gravity,
    JointForce,
    Marker,
    PointForce,
    RigidBody,
    SpringDamper,
    System,
    UserForce,
    linearize,
    static_equilibrium,
)
from floatframe.analyses import ParameterInput, campbell, steady_rotation
from floatframe.errors import ModelError
from floatframe.joints import JointCoordinate
from floatframe.model.elements import Element, ElementLaw
from floatframe.results.sensors.measurement import Measurement
from floatframe.results.sensors.places import PLACE_QUANTITIES, TURNING
from floatframe.results.small_motions.nearby import derivatives
from floatframe.sensors import (
    AngleSensor,
    BushingSensor,
    Channel,
    DisplacementSensor,
    ElementSensor,
    EnergySensor,
    InterfaceForceSensor,
    PlaceSensor,
    ReactionSensor,
    SpringSensor,
    StressSensor,
    VonMisesSensor,
)
from tests.floatframe.analyses.examples import TURN as ANY_AXES
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


@dataclass(frozen=True, eq=False)
class Taut:
    """A sensor of another package: distance of two markers, power of a spring on the first, and more of them."""

    name: str
    marker: Marker
    other: Marker
    spring: str

    def measure(self, system, trajectory):
        def seen(quantity, marker=self.marker):
            found = PlaceSensor("", marker, quantity).measure(system, trajectory)
            return np.column_stack([found.x, found.y, found.z])

        d = seen("position") - seen("position", self.other)
        force = trajectory.reaction(self.spring).force
        columns = {
            "distance": np.linalg.norm(d, axis=1),
            "power": np.sum(force * seen("velocity"), axis=1),
            "twist": np.sin(np.sum(d * seen("angular-velocity"), axis=1)),
            "pull": np.sum(seen("acceleration") * d, axis=1) / np.sum(d**2, axis=1),
            "gap": np.abs(np.sum(d**2, axis=1) - np.sum(d[0] ** 2)),
            "count": np.floor(d[:, 0]),
        }
        return Measurement(self.name, trajectory.t, columns, dict.fromkeys(columns, "-"), numbers=("count",))


BALL = Marker("ball", position=(0.1, 0.2, 0.3), triad=ANY_AXES)
TILTED = [
    *(PlaceSensor(f"{what} ball", BALL, what) for what in PLACE_QUANTITIES if what != "rotation-vector"),
    *(PlaceSensor(f"{what} of pin", Marker("pin", position=(0.3, 0, 0.1)), what, BALL) for what in PLACE_QUANTITIES),
    *(PlaceSensor(f"{what} of ball", BALL, what, Marker("blade", "end_a")) for what in PLACE_QUANTITIES),
    AngleSensor("angle", Marker("blade", "end_a"), BALL, axis=(0.6, 0, 0.8)),
    BushingSensor("cage", "cage"),
    BushingSensor("root", "root"),
    ReactionSensor("cage there", "cage", "marker"),
    Taut("taut", BALL, Marker("blade", "end_a"), "tie"),
]


def test_what_tilts_in_a_steady_rotation_is_seen_by_every_sensor():
    """The ball tilts about axes across Omega, and is bent away from its place: Omega × theta moves what it shows."""
    system = rotor()
    about = steady_rotation(system, (0, 0, 2.0), tolerance=1e-12)
    linear = linearize(system, about, outputs=TILTED)
    assert {"taut.distance", "taut.power", "taut.twist", "taut.pull"} < set(linear.outputs)
    assert set(linear.left_out) >= {"taut.gap", "taut.count"}
    compare(system, about, linear, TILTED, size=4e-6, tolerance=2e-6)


def test_a_sensor_of_another_package_is_linearised_by_what_it_measures(rest):
    system, about, _ = rest
    sensor = [Taut("taut", Marker("block", position=(0.1, 0.2, 0.3)), Marker("arm", "end_a"), "stay")]
    compare(system, about, linearize(system, about, outputs=sensor), sensor)


def test_a_sensor_that_reads_energies_is_not_linear_and_says_why(rest):
    system, about, _ = rest
    linear = linearize(system, about, outputs=[EnergySensor("energy")])
    assert linear.left_out["energy.total"] == "small motions do not determine energies and momenta"


def test_a_spring_far_from_the_origin_has_the_same_derivatives():
    """Its length is the difference of positions of 1e4: the step has to outweigh their rounding."""
    found = []
    for place in (0.0, 1e4):
        mass = RigidBody("mass", 1.0, np.eye(3), position=(place + 0.3, 0.4, 0.1))
        spring = SpringDamper("spring", Marker(GROUND, position=(place, 0, 0)), "mass", 40.0, 0.3)
        system = System([mass], forces=[spring, Gravity((0, 0, -9.81))])
        about = static_equilibrium(system, tolerance=1e-10)
        linear = linearize(system, about, outputs=[SpringSensor("spring", "spring")])
        found.append(np.linalg.norm(linear.L[:2], axis=1))
    assert_allclose(found[1], found[0], rtol=1e-8, atol=1e-8)
    assert found[0][0] > 0.5


@pytest.mark.parametrize("size", [1.0, 1e-3, 1e-6, 1e-9])
def test_derivatives_of_a_short_vector_are_found_and_of_none_refused(size):
    """The magnitude of (size, 0) has the slopes 1 and 0; that of (0, 0) has none, nor has |x|."""

    def columns(k, h):
        x = np.zeros((1 + len(k), 2))
        x[np.arange(1, 1 + len(k)), k] = h
        return np.column_stack([
            np.hypot(size + x[:, 0], x[:, 1]), np.hypot(x[:, 0], x[:, 1]), np.exp(x[:, 0]) + x[:, 1] ** 3,
            abs(x[:, 1]) + x[:, 0], np.where(abs(x[:, 0]) < 1e-4, 3 * x[:, 0], np.nan),
        ])  # fmt: skip

    slopes, is_smooth = derivatives(columns, np.array([1.0, 2.0]), 5)
    assert_array_equal(is_smooth, [True, False, True, False, True])
    assert_allclose(slopes[[0, 2, 4]], [[1, 0], [1, 0], [3, 0]], rtol=1e-9, atol=1e-9)


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
