import numpy as np
import pytest
from numpy.testing import assert_allclose

from floatframe import RigidBody, System
from floatframe.analyses import check_element
from floatframe.components.hydraulics import (
    Accumulator,
    CheckValve,
    Circuit,
    Cylinder,
    DirectionalValve,
    FlowSource,
    Fluid,
    Node,
    Orifice,
    Pipe,
    Pump,
    ReliefValve,
    Resistance,
    Supply,
    Tank,
)
from floatframe.model.bodies.markers import Marker
from floatframe.model.functions.time_functions import harmonic
from tests.floatframe.element_laws import STEP, evaluate, marker_motion, moved, placed, power_defect

OIL = Fluid(870.0, 1.4e9, 101325.0, viscosity=0.03, air=0.01)
GROUND, ROD, SHAFT = Marker("ground"), Marker("rod"), Marker("shaft")


def every_component(fluid=OIL):
    return Circuit(
        "all",
        fluid,
        [
            Cylinder(
                "jack", GROUND, ROD, 2e-3, 1.2e-3, "head", "rod", stroke=0.4, retracted_length=0.5,
                head_dead_volume=1e-5, rod_dead_volume=1e-5, leakage=1e-13, friction=80.0, friction_speed=1e-2,
                damping=40.0,
                stop_stiffness=1e7, stop_damping=0.2,
            ),
            Pump("unit", "line", "tank", GROUND, SHAFT, 3e-6, axis=[0, 1, 0], leakage=1e-12, drag=0.02),
            DirectionalValve("valve", "line", "tank", "head", "rod", 2e-5, harmonic(0.5, 3.0, 0.4), 0.02, leakage=0.0),
            Pipe("pipe", "supply", "line", 3.0, 1e-4, segments=3, friction_factor=0.03, wall_modulus=5e9, flow=1e-4),
            Orifice("damper", "rod", "gas", 1e-5, opening=harmonic(0.2, 2.0, 0.1, 0.6)),
            Resistance("plug", "gas", "tank", 1e-11),
            Accumulator("ball", "gas", 1e-3, 3e6, oil_limit=8e-4),
            CheckValve("check", "line", "gas", 1e-5, full=2e5, cracking=5e4, leakage=1e-13),
            ReliefValve("relief", "gas", "tank", 2e-5, full=6e6, cracking=4e6),
            FlowSource("drip", "tank", "gas", harmonic(1e-5, 4.0, 0.3, 2e-5)),
            Supply("pressure", "supply", harmonic(1e6, 5.0, 0.2, 1e7)),
            Tank("outside", "tank"),
        ],
        {"gas": Node(2e-5, 5e6), "line": Node(0.0, 9e6), "head": Node(pressure=3e6), "rod": Node(pressure=4e6)},
    )  # fmt: skip


def motion(stroke=0.2, seed=0):
    rng = np.random.default_rng(seed)
    direction = np.array([2.0, -1.0, 2.0]) / 3
    turn = np.linalg.qr(rng.normal(size=(3, 3)))[0]
    turn *= np.linalg.det(turn)
    v = rng.normal(size=(4, 3))
    return np.array(
        [
            marker_motion([0.1, 0.2, 0.3], v=v[0]),
            marker_motion([0.1, 0.2, 0.3] + (0.5 + stroke) * direction, v=0.3 * v[1]),
            marker_motion([0, 0, 0], A=turn, omega=10 * v[2]),
            marker_motion([0, 0, 0], omega=30 * v[3]),
        ]
    )


@pytest.mark.parametrize(
    "fluid", [OIL, Fluid(870.0, 1.4e9, 101325.0), Fluid(870.0, 1.4e9, 1e5, air=0.02, air_exponent=1.0)]
)
@pytest.mark.parametrize("stroke", [0.2, -0.003, 0.402])
def test_power_of_supplies_is_stored_lost_or_given_to_the_bodies(fluid, stroke):
    law = every_component(fluid).law(placed(motion()))
    rng = np.random.default_rng(3)
    for pressures in (1.0, 0.002, 5.0):  # cavities, and a full accumulator
        z = np.array(law.start) * rng.uniform(0.5, 1.5, len(law.start)) * pressures
        defect, throughput = power_defect(law, 0.4, motion(stroke, seed=5), z)
        assert abs(defect) <= 1e-12 * throughput


def test_contents_change_by_what_supplies_bring_alone():
    law = every_component().law(placed(motion()))
    x, z = motion(), np.array(law.start)
    _, z_dot, seen = evaluate(law, 0.4, x, z)
    rate = evaluate(law, 0.4, moved(x, 1j * STEP), z + 1j * STEP * z_dot)[2]["content"].imag / STEP
    outside = {"pipe 1": 1, "unit": -1, "valve b-tank": -1, "valve a-tank": -1, "plug": -1, "relief": -1, "drip": 1}
    flow = sum(sign * seen[f"flow {name}"] for name, sign in outside.items())
    assert_allclose(rate, flow, rtol=1e-11, atol=0)


def test_pressures_along_a_pipe_begin_on_the_line_between_those_of_its_ends():
    law = every_component().law(placed(motion()))
    start = dict(zip(law.states, law.start, strict=True))
    supply = 1e7 + 1e6 * np.sin(0.2)
    found = [start["pressure pipe 1"], start["pressure pipe 2"], start["flow pipe 3"]]
    assert_allclose(found, [supply + (9e6 - supply) / 3, supply + (9e6 - supply) * 2 / 3, 1e-4], rtol=1e-14)


@pytest.mark.parametrize("segments", [1, 4])
@pytest.mark.parametrize("wall", [None, 5e9])
def test_oil_of_a_pipe_lies_half_a_segment_at_each_end_of_its_segments(segments, wall):
    """At ambient pressure p' (V/K + V_pipe/E_wall) flows in, with V_pipe = A L / n inside and half of it at ends."""
    p, K, A, L = 101325.0, 1.4e9, 1e-4, 3.0
    parts = [
        Pipe("pipe", "one", "two", L, A, segments=segments, wall_modulus=wall),
        Pump("still", "one", "tank", GROUND, SHAFT, 3e-6), Resistance("last", "two", "tank", 1e-11),
        Tank("outside", "tank"),
    ]  # fmt: skip
    nodes, x = {"one": Node(2e-5, p), "two": Node(5e-5, p)}, np.array(motion()[2:])
    x[:, 12:] = 0.0
    law = Circuit("c", Fluid(870.0, K, p), parts, nodes).law(placed(x))
    flows = 1e-4 * np.array([3.0, -1.0, 2.0, 0.5])[:segments]
    names = ["flow pipe"] if segments == 1 else [f"flow pipe {k + 1}" for k in range(segments)]
    z = np.array([dict(zip(names, flows, strict=True)).get(name, p) for name in law.states])
    _, rates, _ = evaluate(law, 0.0, x, z)
    found = {name: rate for name, rate in zip(law.states, rates, strict=True) if name.startswith("pressure")}
    part = A * L / segments
    own = np.r_[2e-5, np.zeros(segments - 1), 5e-5]
    oil = np.r_[part / 2, np.full(segments - 1, part), part / 2]
    expected = -np.diff(np.r_[0.0, flows, 0.0]) / ((own + oil) / K + (0.0 if wall is None else oil / wall))
    order = ["pressure one", *(f"pressure pipe {k}" for k in range(1, segments)), "pressure two"]
    assert_allclose([found[name] for name in order], expected, rtol=1e-4)


@pytest.mark.parametrize("segments", [1, 2])
def test_a_pipe_of_one_segment_has_the_name_of_the_pipe_and_segments_have_numbers(segments):
    pipe = Pipe("line", "supply", "end", 3.0, 1e-4, segments=segments, flow=2e-4)
    parts = [pipe, Supply("pressure", "supply", 1e6), Tank("outside", "tank")]
    parts.append(Pump("unit", "end", "tank", GROUND, SHAFT, 3e-6, axis=[0, 1, 0]))
    law = Circuit("c", OIL, parts, {"end": Node(1e-4, 1e6)}).law(placed(motion()))
    names = ["flow line"] if segments == 1 else ["flow line 1", "flow line 2"]
    start = dict(zip(law.states, law.start, strict=True))
    assert {name: start[name] for name in start if name.startswith("flow")} == dict.fromkeys(names, 2e-4)


def test_wrenches_of_a_circuit_balance():
    law = every_component().law(placed(motion()))
    x = motion()
    wrench, _, _ = evaluate(law, 0.4, x, np.array(law.start))
    force = wrench[:, :3].sum(axis=0)
    moment = (wrench[:, 3:] + np.cross(x[:, :3], wrench[:, :3])).sum(axis=0)
    assert np.abs(wrench).max() > 100
    assert_allclose(force, 0, atol=1e-12 * np.abs(wrench).max())
    assert_allclose(moment, 0, atol=1e-12 * np.abs(wrench).max())


def test_the_compiled_law_is_that_of_python_and_its_tangent_exact():
    x, bodies = motion(), []
    for name, row in (("rod", x[1]), ("shaft", x[3])):
        bodies.append(RigidBody(name, 1.0, np.eye(3), position=row[:3], velocity=row[12:15], omega_B=row[15:18]))
    found = check_element(System(bodies, [], [], elements=[every_component()]), "all")
    # what is zero exactly is rounding by differences of rates of 1e9
    assert [each for each in found.findings if "'complex' gives 0, differences" not in each] == []
