"""Circuits that cannot be: one message each, with the component, the node and what to do."""

import numpy as np
import pytest

from floatframe.components.hydraulics import (
    Accumulator,
    CheckValve,
    Circuit,
    Cylinder,
    DirectionalValve,
    Fluid,
    Node,
    Orifice,
    Pipe,
    Supply,
    Tank,
)
from floatframe.errors import ModelError, SystemFileError
from floatframe.files.system_file.read_system import read_system
from floatframe.model.bodies.markers import Marker
from floatframe.model.functions.time_functions import constant
from tests.floatframe.element_laws import marker_motion, placed
from tests.root import ROOT

OIL = Fluid(870.0, 1.4e9, 101325.0)
BASE, TOP = Marker("ground"), Marker("rod")


def jack(**options):
    numbers = {"head": "head", "stroke": 0.4, "retracted_length": 0.3, "head_dead_volume": 1e-5} | options
    return Cylinder("jack", BASE, TOP, 2e-3, **numbers)


SUPPLY, HOLE = Supply("pump", "line", 1e7), Orifice("hole", "line", "head", 1e-5)


@pytest.mark.parametrize(
    ("parts", "nodes", "message"),
    [
        ([jack(), HOLE], {}, "component 'hole': node 'line' has no volume and no supply or tank: give it one"),
        ([jack(), Orifice("hole", "line", "heat", 1e-5), SUPPLY], {}, "'heat' has no volume .* nearest: 'head'|'heat'"),
        (
            [jack(), HOLE, SUPPLY, Tank("sump", "tank")],
            {},
            "'sump': node 'tank' is isolated: nothing else is connected",
        ),
        ([jack(), HOLE, SUPPLY, Tank("other", "line")], {}, "'other': node 'line' has the pressure of another supply"),
        ([jack(), HOLE, SUPPLY], {"hed": Node(1e-5)}, "nodes: hed: no component names it"),
        (
            [jack()],
            {},
            "nothing sets its pressure: missing supply: give a supply or a tank, or the initial pressure of a node",
        ),
        ([HOLE, SUPPLY], {"head": Node(1e-5)}, "expected a cylinder or a pump, which attach it to bodies, got none"),
        ([jack(), jack()], {"head": Node(pressure=1e6)}, "components: the name 'jack' is used twice"),
        ([jack(), Accumulator("ball", "line", 1e-3, 1e6), SUPPLY], {}, "'ball': the pressure of node 'line' is given"),
        ([jack(), Orifice("hole", "head", "head", 1e-5)], {}, "'hole': expected two nodes, got 'head' twice"),
        (
            [
                jack(),
                SUPPLY,
                Tank("sump", "t"),
                DirectionalValve("v", "line", "t", "head", "t", 1e-5, follow="jak", gain=1.0),
            ],
            {},
            "component 'v': follow: no cylinder 'jak'; choices: jack",
        ),
    ],
)
def test_a_circuit_that_cannot_be_is_refused(parts, nodes, message):
    with pytest.raises(ModelError, match=f"element 'circuit': .*{message}"):
        Circuit("circuit", OIL, parts, nodes)


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: jack(head=None), "component 'jack': expected a node for head or rod or both, got none"),
        (lambda: jack(head_dead_volume=0.0), "head_dead_volume: expected a number above 0, got 0: a chamber without"),
        (lambda: jack(rod="rod"), "rod_area: expected a number above 0 for the chamber 'rod', got 0"),
        (lambda: Orifice("hole", "a", "b", -1e-5), "component 'hole': area: expected a number above 0, got -1e-05"),
        (lambda: Supply("pump", "line", -1e5), "component 'pump': pressure: expected a number above 0, got -100000"),
        (lambda: Supply("pump", "line", constant(-1e5)), "'pump': pressure: expected absolute pressures above 0"),
        (lambda: Node(pressure=-2e5), "node: pressure: expected a number above 0, got -200000"),
        (lambda: Fluid(870.0, 0.0, 1e5), "fluid: bulk_modulus: expected a number above 0, got 0"),
        (
            lambda: Fluid(870.0, 1e9, 1e5, vapour_pressure=2e5),
            "vapour_pressure: .* below the ambient 100000, got 200000",
        ),
        (lambda: Accumulator("ball", "a", 1e-3, 1e6, oil_limit=2e-3), "oil_limit: .* of gas_volume = 0.001, got 0.002"),
        (
            lambda: CheckValve("check", "a", "b", 1e-5, full=1e4, cracking=2e4),
            "full: .* above cracking = 20000, got 10000",
        ),
        (lambda: Pipe("pipe", "a", "b", 1.0, 1e-4, segments=0), "component 'pipe': segments: expected 1 to 200, got 0"),
    ],
)
def test_a_component_that_cannot_be_is_refused(make, message):
    with pytest.raises(ModelError, match=message):
        make()


def test_a_cylinder_that_is_placed_outside_its_stroke_is_refused():
    circuit = Circuit("circuit", OIL, [jack(), HOLE, SUPPLY], {})
    for length, message in ((0.2, "0.2 apart as placed, stroke -0.1; expected 0 to 0.4"), (0.0, "coincide as placed")):
        x = np.array([marker_motion([0, 0, 0]), marker_motion([0, 0, length])])
        with pytest.raises(ModelError, match=message):
            circuit.law(placed(x))


FILE = """
[system]
units = "m-kg-s"
gravity = [0, 0, -9.81]

[bodies.mass]
mass = 400.0
inertia = [[1, 0, 0], [0, 1, 0], [0, 0, 1]]
position = [0, 0, 0.5]

[joints.guide]
type = "prismatic"
body_a = "ground"
body_b = "mass"
marker_b = [0, 0, 0]
axis = [0, 0, 1]

[elements.lift]
type = "hydraulics.circuit"
fluid = {density = 870.0, bulk_modulus = 1.4e9, ambient = 101325.0}
nodes.head = {pressure = 2.0e6}

[[elements.lift.components]]
type = "cylinder"
name = "jack"
marker_a = {body = "ground"}
marker_b = {body = "mass"}
head_area = 2e-3
head = "head"
stroke = 0.4
retracted_length = 0.3
head_dead_volume = 5e-5

[[elements.lift.components]]
type = "orifice"
name = "hole"
a = "head"
b = "line"
area = 1.5e-5
opening = {type = "smooth-step", t_start = 0.0, t_end = 0.1, first = 0.2, last = 1.0}

[[elements.lift.components]]
type = "supply"
name = "pump"
node = "line"
pressure = 5e6

[run]
t_end = 0.1
h = 1e-3
"""


def read(tmp_path, text):
    path = tmp_path / "lift.toml"
    path.write_text(text)
    return read_system(path)[0]


def test_a_circuit_of_a_file_is_that_of_python(tmp_path):
    (circuit,) = read(tmp_path, FILE).elements
    assert [type(each).__name__ for each in circuit.components] == ["Cylinder", "Orifice", "Supply"]
    assert circuit.components[1].opening(0.1) == 1.0
    assert circuit.components[2].pressure(3.0) == 5e6
    assert circuit.nodes["head"].pressure == 2e6
    assert circuit.markers[1].body == "mass"


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        (
            'type = "orifice"',
            'type = "orifise"',
            "elements.lift.components.2.type: expected a component, got 'orifise'; did you mean 'orifice'",
        ),
        ("head_area", "head_aria", "elements.lift.components.1.head_aria: unknown key; did you mean .head_area."),
        ("area = 1.5e-5\n", "", "elements.lift.components.2.area: missing; expected a number"),
        ("ambient = 101325.0", "ambient = -1.0", "ambient: expected a number above 0, got -1"),
        (
            'b = "line"',
            'b = "lien"',
            "element 'lift': component 'hole': node 'lien' has no volume and no supply or tank",
        ),
    ],
)
def test_a_file_with_a_wrong_circuit_is_refused_with_the_key(tmp_path, old, new, message):
    with pytest.raises(SystemFileError, match=message):
        read(tmp_path, FILE.replace(old, new))


def test_the_tables_of_the_page_are_read(tmp_path):
    page = (ROOT / "docs" / "hydraulics_and_drives.md").read_text()
    tables = "\n".join(line[4:] for line in page.splitlines() if line.startswith("    "))
    mechanism = (
        FILE[: FILE.index("[elements.lift]")]
        + """
[bodies.rotor]
mass = 1.0
inertia = [[1, 0, 0], [0, 1, 0], [0, 0, 1]]

"""
    )
    lift, motor = read(tmp_path, mechanism + tables).elements
    assert [each.name for each in lift.components] == ["jack", "hole", "ball"]
    assert motor.controller.upper == 24.0
    radius = np.sqrt(2e-3 / np.pi)
    assert [piece.radius for piece in lift.drawn()] == pytest.approx([radius, radius / 2])
