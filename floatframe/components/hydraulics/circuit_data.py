"""The data of a circuit, which its law reads: nodes, components, their connections, functions."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from math import pi, sqrt
from typing import Any

import numpy as np

from fe_models.foundation.records import checked_fields, frozen_copies
from fe_models.foundation.words import nearest, quoted
from floatframe.components.hydraulics.circuit_law import (
    ACCUMULATOR,
    ALWAYS,
    BY_FUNCTION,
    BY_SPOOL,
    BY_SPOOL_BACK,
    COMPONENT_WIDTH,
    CYLINDER,
    FIRST_NUMBER,
    FLOW,
    GAS,
    HEAD,
    HEAD_CHAMBER,
    INERTIA,
    INTO,
    ISLANDS,
    N_ISLANDS,
    NODE_WIDTH,
    ORIFICE,
    OUT_OF,
    PUMP,
    RESISTANCE,
    ROD_CHAMBER,
    SPOOL,
    TOTALS,
    VALVE,
    circuit_law,
    circuit_rest,
    node_volume,
)
from floatframe.components.hydraulics.components import (
    COMPONENTS,
    Accumulator,
    CheckValve,
    Component,
    Cylinder,
    DirectionalValve,
    FlowSource,
    Node,
    Orifice,
    Pipe,
    Pump,
    Resistance,
)
from floatframe.components.hydraulics.fluid import Fluid
from floatframe.components.hydraulics.gas import gas_numbers
from floatframe.components.hydraulics.nodes import check_nodes, nodes_of, prescribed
from floatframe.errors import ModelError
from floatframe.model.bodies.markers import Marker
from floatframe.model.elements import Element, ElementLaw, GapSpring, Placed
from floatframe.model.elements.curves import function_numbers
from floatframe.model.elements.unit_names import in_units, outputs_in
from floatframe.model.functions.time_functions import TimeFunction
from floatframe.model.shapes.drawn import Stretched

__all__ = ["Circuit", "circuit_law_of"]


#: pressure difference below which the flow of orifices is laminar, relative to the ambient pressure; default
TRANSITION = 1e-3
STOP_STIFFNESS = 10  #: index among the numbers of a cylinder

OUTPUTS = {
    ORIFICE: (("flow", "m^3/s"),),
    VALVE: (("flow", "m^3/s"),),
    RESISTANCE: (("flow", "m^3/s"),),
    FLOW: (("flow", "m^3/s"),),
    INERTIA: (("flow", "m^3/s"),),
    CYLINDER: (("stroke", "m"), ("rate", "m/s"), ("force", "N"), ("leakage", "m^3/s"), ("stroke left", "m")),
    ACCUMULATOR: (("oil", "m^3"),),
    PUMP: (("flow", "m^3/s"), ("torque", "N m"), ("speed", "rad/s")),
    SPOOL: (("spool", "1"),),
}  #: outputs of each kind of component that sensors can read


@dataclass
class PlacedNode:
    """A node while the data are compiled."""

    name: str
    volume: float = 0.0
    compliance: float = 0.0
    start: float = 0.0
    pressure: TimeFunction | None = None
    #: kind of connection, component, and output of the component
    attached: list[tuple[int, int, int]] = field(default_factory=list)


@dataclass
class Record:
    """A component while the data are compiled."""

    name: str
    kind: int
    a: int
    b: int
    numbers: list[float]
    markers: tuple[int, int] = (-1, -1)
    start: float | None = None  #: initial value of its state
    functions: dict[int, TimeFunction] = field(default_factory=dict)  #: functions by their index among the parameters
    is_servo: bool = False  #: whether the spool is a state that follows its command
    spool: tuple[int, int] | None = None  #: index among its parameters, and component whose first output is read


class Builder:
    """Collects the nodes and records of a circuit."""

    def __init__(self, fluid: Fluid, components: Sequence[Component], nodes: Mapping[str, Node]) -> None:
        self.fluid = fluid
        self.transition = TRANSITION * fluid.ambient
        given = prescribed(fluid, components)
        names = list(dict.fromkeys(name for each in components for name in nodes_of(each)))
        self.nodes = [PlacedNode(name) for name in names if name not in given]
        self.numbers = {name: k for k, name in enumerate([*(node.name for node in self.nodes), *given])}
        for node in self.nodes:
            more = nodes.get(node.name)
            node.start = self.fluid.ambient
            if more is not None:
                node.volume = more.volume
                node.start = more.pressure or node.start
        self.given = [PlacedNode(name, pressure=pressure) for name, pressure in given.items()]
        self.records: list[Record] = []

    def number(self, name: str | None) -> int:
        """Return the number of a free node, -1 - k for prescribed node k, or `NONE` if there is no node."""
        if name is None:
            return NONE
        k = self.numbers[name]
        n = len(self.numbers) - len(self.given)
        return k if k < n else -1 - (k - n)

    def node(self, number: int) -> PlacedNode:
        """Return the node with a given number."""
        return self.nodes[number] if number >= 0 else self.given[-1 - number]

    def add(self, record: Record, attached: dict[int, list[tuple[int, int]]]) -> int:
        """Add a record; `attached` gives, for each node, the kind of connection and the output."""
        self.records.append(record)
        for number, ways in attached.items():
            self.node(number).attached += [(how, len(self.records) - 1, output) for how, output in ways]
        return len(self.records) - 1

    def between(self, record: Record) -> int:
        """Add a component whose first output is the flow from its node a to its node b."""
        return self.add(record, {record.a: [(OUT_OF, 0)], record.b: [(INTO, 0)]})

    def conductance(self, area: float, discharge: float) -> float:
        """Return the flow through an orifice divided by the square root of the pressure difference."""
        return discharge * area * sqrt(2 / self.fluid.density)


NONE = -(10**6)


def circuit_law_of(
    fluid: Fluid, components: Sequence[Component], nodes: Mapping[str, Node], placed: Placed
) -> ElementLaw:
    """Return the law of a circuit, given its assembled cylinders."""
    made = Builder(fluid, components, nodes)
    marker = 0
    cylinders: dict[str, int] = {}
    acts: list[str] = []
    for each in components:  # cylinders come first, because valves may follow their strokes
        if isinstance(each, Cylinder):
            cylinders[each.name] = add_cylinder(made, each, marker, placed)
        elif isinstance(each, Pump):
            add_pump(made, each, marker)
        else:
            continue
        acts += ["force" if isinstance(each, Cylinder) else "moment"] * 2
        marker += 2
    for each in components:
        if isinstance(each, DirectionalValve):
            add_directional_valve(made, each, cylinders)
        elif isinstance(each, Pipe):
            add_pipe(made, each)
        elif isinstance(each, Orifice):
            numbers = [made.conductance(each.area, each.discharge), each.transition or made.transition, ALWAYS, 0, 0, 0]
            record = Record(each.name, ORIFICE, made.number(each.a), made.number(each.b), numbers)
            if isinstance(each.opening, TimeFunction):
                record.numbers[2], record.functions[3] = BY_FUNCTION, each.opening
            made.between(record)
        elif isinstance(each, CheckValve):
            numbers = [made.conductance(each.area, each.discharge), each.transition or made.transition]
            numbers += [each.cracking, each.full, each.leakage]
            made.between(Record(each.name, VALVE, made.number(each.a), made.number(each.b), numbers))
        elif isinstance(each, Resistance):
            made.between(Record(each.name, RESISTANCE, made.number(each.a), made.number(each.b), [each.conductance]))
        elif isinstance(each, FlowSource):
            record = Record(each.name, FLOW, made.number(each.a), made.number(each.b), [0])
            assert isinstance(each.flow, TimeFunction)  # ensured by the component
            record.functions[0] = each.flow
            made.between(record)
        elif isinstance(each, Accumulator):
            assert each.oil_limit is not None  # ensured by the component
            numbers = list(gas_numbers(each.gas_volume, each.charge, each.exponent, each.oil_limit))
            node = made.number(each.node)
            made.add(Record(each.name, ACCUMULATOR, node, node, numbers), {node: [(GAS, 0)]})
    return written(made, placed, acts)


def add_cylinder(made: Builder, each: Cylinder, marker: int, placed: Placed) -> int:
    """Add a cylinder; `ModelError` if it is assembled outside its stroke."""
    length = float(np.linalg.norm(placed.r[marker + 1] - placed.r[marker]))
    stroke = length - each.retracted_length
    if length == 0.0:
        raise ModelError(f"component {each.name!r}: its markers coincide as placed, so that it has no direction")
    if not -1e-9 * each.stroke <= stroke <= (1 + 1e-9) * each.stroke and each.stop_stiffness == 0:
        raise ModelError(
            f"component {each.name!r}: its markers are {length:.6g} apart as placed, stroke {stroke:.6g}; expected "
            f"0 to {each.stroke:g}: check retracted_length = {each.retracted_length:g}, or give stop_stiffness"
        )
    numbers = [
        each.head_area, each.rod_area, each.stroke, each.retracted_length, each.head_dead_volume, each.rod_dead_volume,
        each.leakage if each.head is not None and each.rod is not None else 0.0, each.friction, each.friction_speed,
        each.damping, each.stop_stiffness, each.stop_damping,
    ]  # fmt: skip
    head, rod = made.number(each.head), made.number(each.rod)
    attached = {}
    if each.head is not None:
        attached[head] = [(HEAD_CHAMBER, -1), (OUT_OF, 3)]
    if each.rod is not None:
        attached.setdefault(rod, []).extend([(ROD_CHAMBER, -1), (INTO, 3)])
    return made.add(Record(each.name, CYLINDER, head, rod, numbers, (marker, marker + 1)), attached)


def add_pump(made: Builder, each: Pump, marker: int) -> None:
    """Add a pump."""
    numbers = [each.displacement, each.leakage, each.drag, *each.axis]
    made.between(Record(each.name, PUMP, made.number(each.a), made.number(each.b), numbers, (marker, marker + 1)))


def add_pipe(made: Builder, each: Pipe) -> None:
    """Add a pipe, as flows and the nodes between them."""
    fluid, n, A = made.fluid, each.segments, each.area
    part = each.length / n
    viscous = 0.0 if fluid.viscosity is None else 8 * pi * fluid.viscosity * part / A**2
    turbulent = each.friction_factor * part / sqrt(4 * A / pi) * fluid.density / (2 * A**2)
    numbers = [fluid.density * part / A, viscous, turbulent]
    ends = [made.number(each.a)]
    first, last = made.node(ends[0]), made.node(made.number(each.b))
    begin, end = (node.start if node.pressure is None else node.pressure(0.0) for node in (first, last))
    for k in range(1, n):
        made.nodes.append(PlacedNode(f"{each.name} {k}", start=begin + (end - begin) * k / n))
        ends.append(len(made.nodes) - 1)
    ends.append(made.number(each.b))
    for k in range(n):
        name = each.name if n == 1 else f"{each.name} {k + 1}"
        made.between(Record(name, INERTIA, ends[k], ends[k + 1], list(numbers), start=each.flow))
        for number in ends[k : k + 2]:
            node = made.node(number)
            node.volume += A * part / 2
            if each.wall_modulus is not None:
                node.compliance += A * part / 2 / each.wall_modulus


def add_directional_valve(made: Builder, each: DirectionalValve, cylinders: dict[str, int]) -> None:
    """Add a directional valve as a spool and four flow paths."""
    record = Record(each.name, SPOOL, NONE, NONE, [each.time_constant, 0, each.gain or 0.0, 0])
    assert isinstance(each.opening, TimeFunction)  # ensured by the component
    record.functions[1] = each.opening
    if each.follow is not None:
        record.spool = 3, cylinders[each.follow]
    if each.time_constant > 0:
        record.start = 0.0 if each.follow is not None else float(np.clip(each.opening(0.0), -1.0, 1.0))
    spool = made.add(record, {})
    k = made.conductance(each.area, each.discharge)
    paths = [
        ("pressure", "a", BY_SPOOL),
        ("b", "tank", BY_SPOOL),
        ("pressure", "b", BY_SPOOL_BACK),
        ("a", "tank", BY_SPOOL_BACK),
    ]
    for begin, end, how in paths:
        numbers = [k, each.transition or made.transition, how, 0, each.overlap, each.leakage]
        a, b = made.number(getattr(each, begin)), made.number(getattr(each, end))
        made.between(
            Record(
                f"{each.name} {begin}-{end}", ORIFICE, a, b, numbers, is_servo=each.follow is not None, spool=(3, spool)
            )
        )


def written(made: Builder, placed: Placed, acts: list[str]) -> ElementLaw:
    """Return the law, with names, initial values and data in the layout of `components.hydraulics.circuit_law`."""
    nodes = [*made.nodes, *made.given]
    n_free, n_nodes = len(made.nodes), len(nodes)

    def place(number: int) -> int:
        if number <= NONE:
            return -1
        return number if number >= 0 else n_free - 1 - number

    outputs = [(f"pressure {node.name}", "Pa") for node in nodes]
    states = [(f"pressure {node.name}", "Pa", node.start) for node in made.nodes]
    seen: list[int] = []
    for record in made.records:
        seen.append(len(outputs))
        outputs += [(f"{word} {record.name}", unit) for word, unit in OUTPUTS[record.kind]]
    units = ("W", "W", "J", "W", "m^3")
    outputs += list(zip(TOTALS, units, strict=True))

    at_nodes = HEAD
    at_components = at_nodes + NODE_WIDTH * n_nodes
    at_attached = at_components + COMPONENT_WIDTH * len(made.records)
    at_tail = at_attached + 2 * sum(len(node.attached) for node in nodes)
    tail: list[float] = []

    def function_number(function: TimeFunction) -> int:
        at = at_tail + len(tail)
        tail.extend(function_numbers(function))
        return at

    head = [n_nodes, n_free, len(made.records), at_nodes, at_components, at_attached, 0, 0]
    data: list[float] = [*head, *made.fluid.numbers]
    first = 0
    for node in nodes:
        at = 0 if node.pressure is None else function_number(node.pressure)
        data += [node.volume, node.compliance, at, first, len(node.attached), laminar_flow(made, node)]
        first += len(node.attached)
    for k, record in enumerate(made.records):
        state = -1
        if record.start is not None:
            state = len(states)
            unit = "1" if record.kind == SPOOL else "m^3/s"
            states.append((f"{OUTPUTS[record.kind][0][0]} {record.name}", unit, record.start))
        for n, function in record.functions.items():
            record.numbers[n] = function_number(function)
        if record.spool is not None:
            record.numbers[record.spool[0]] = seen[record.spool[1]]
        row = [record.kind, place(record.a), place(record.b), seen[k], state, *record.markers, *record.numbers]
        data += [*row, *[0.0] * (COMPONENT_WIDTH - len(row))]
    for node in nodes:
        for how, component, output in node.attached:
            begin = at_components + COMPONENT_WIDTH * component
            index = {HEAD_CHAMBER: begin, ROD_CHAMBER: begin, GAS: begin + FIRST_NUMBER}
            data += [how, index.get(how, seen[component] + output)]
    array = np.array([*data, *tail], dtype=float)
    start = np.array([value for _, _, value in states])
    seen_then = evaluated(array, start, placed, len(outputs))
    islands = islands_of(made, [(place(record.a), place(record.b)) for record in made.records], seen_then)
    rows: list[float] = []
    for island in islands:
        contents = (node_volume(array, i, start[i], seen_then)[0] / made.fluid.compression(start[i])[0] for i in island)
        rows += [len(island), sum(contents), made.fluid.bulk_modulus, *island]
    array[N_ISLANDS], array[ISLANDS] = len(islands), len(array)
    array = np.concatenate([array, rows])
    stops = {each.name: each.numbers[STOP_STIFFNESS] for each in made.records if each.kind == CYLINDER}
    gaps = {f"{end} {name}": GapSpring(k) for name, k in stops.items() if k > 0 for end in ("stroke", "stroke left")}
    return ElementLaw(
        function=circuit_law,
        data=array,
        states=[name for name, _, _ in states],
        start=list(start),
        state_units=in_units(placed.units, [unit for _, unit, _ in states]),
        **outputs_in(placed.units, outputs),
        tangent="complex",
        rest=circuit_rest,
        acts=acts,
        energy="energy",
        power_in="power in",
        power_lost="power lost",
        gaps=gaps,
    )


def laminar_flow(made: Builder, node: PlacedNode) -> float:
    """Return the flow below which the orifices and valves of a node are laminar; 0 if it has none."""
    at_node = [made.records[component] for how, component, _ in node.attached if how in (INTO, OUT_OF)]
    return sum(each.numbers[0] * sqrt(each.numbers[1]) for each in at_node if each.kind in (ORIFICE, VALVE))


def evaluated(data: np.ndarray, start: np.ndarray, placed: Placed, n_outputs: int) -> np.ndarray:
    """Return the outputs at the start, with the assembled markers at rest."""
    n = len(placed.r)
    x = np.zeros((n, 18))
    x[:, :3], x[:, 3:12] = placed.r, np.asarray(placed.A).reshape(n, 9)
    seen = np.zeros(n_outputs)
    circuit_law.py_func(0.0, x, start, np.zeros(0), data, np.zeros((n, 6)), np.zeros(len(start)), np.zeros(0), seen)
    return seen


def islands_of(made: Builder, ends: list[tuple[int, int]], values: np.ndarray) -> list[list[int]]:
    """Return the free nodes of each part of the circuit into which nothing flows at the start."""
    n_free = len(made.nodes)
    island = list(range(n_free))
    is_open = [False] * n_free

    def root(i: int) -> int:
        while island[i] != i:
            i = island[i]
        return i

    for record, (i, j) in zip(made.records, ends, strict=True):
        if not passes(record, i, j, values):
            continue
        inside = [root(k) for k in (i, j) if 0 <= k < n_free]
        if len(inside) == 2:
            is_open[inside[0]] |= is_open[inside[1]]
            island[inside[1]] = inside[0]
        elif inside:
            is_open[inside[0]] = True
    parts: dict[int, list[int]] = {}
    for i in range(n_free):
        parts.setdefault(root(i), []).append(i)
    return [part for key, part in parts.items() if not is_open[key]]


def passes(record: Record, i: int, j: int, values: np.ndarray) -> bool:
    """Return whether fluid can pass through a component at the start."""
    n = record.numbers
    if record.kind == ORIFICE:
        part = 1.0
        if n[2] == BY_FUNCTION:
            part = record.functions[3](0.0)
        elif n[2] != ALWAYS:
            part = values[int(n[3])] * (1 if n[2] == BY_SPOOL else -1) - n[4]
        return part > 0 or n[5] > 0 or record.is_servo
    if record.kind == VALVE:
        return values[i] - values[j] > n[2] or n[4] > 0
    if record.kind == CYLINDER:
        return n[6] > 0
    if record.kind == PUMP:
        return n[1] > 0
    return record.kind in (RESISTANCE, INERTIA)


# A hydraulic circuit as one element, with components between nodes, and pressures as states ---------------------------


@frozen_copies
@dataclass(frozen=True, eq=False)
@checked_fields(ModelError)
class Circuit(Element):
    """A hydraulic circuit: components between named nodes; cylinders and pumps connect it to markers.

    A node exists if a component names it. The absolute pressure of a node is a state, unless a supply or tank
    prescribes it; such a node needs a volume, either that of its chambers and pipes, or its own, `nodes={"gallery":
    Node(volume=2e-5)}`.

    Raises
    ------
    ModelError
        If a node is unknown, has fewer than two components, or has no volume; if two components prescribe one pressure;
        if nothing sets the pressure in the circuit; or if a cylinder is assembled outside its stroke.
    """

    name: str
    fluid: Fluid
    components: Sequence[Component]
    nodes: Mapping[str, Node] = field(default_factory=dict)  #: further properties of nodes, by name

    def __post_init__(self) -> None:
        where = f"element {self.name!r}"
        object.__setattr__(self, "components", tuple(self.components))
        for k, component in enumerate(self.components):
            if not isinstance(component, tuple(COMPONENTS.values())):
                raise ModelError(
                    f"{where}: components: expected components of floatframe.components.hydraulics, got {component!r}"
                )
            if component.name in [each.name for each in self.components[:k]]:
                raise ModelError(f"{where}: components: the name {component.name!r} is used twice")
        for key, node in self.nodes.items():
            if not isinstance(node, Node):
                raise ModelError(f"{where}: nodes: {key}: expected a Node, got {node!r}")
        try:
            check_nodes(self.fluid, self.components, self.nodes)
            if not self.markers:
                raise ModelError("expected a cylinder or a pump, which attach it to bodies, got none")
        except ModelError as error:
            raise ModelError(f"{where}: {error}") from None

    @classmethod
    def from_table(cls, name: str, table: Mapping[str, Any], read: Any) -> "Circuit":
        """Return the circuit of a table [elements.NAME]; `read` is a `TableReader`.

        Raises
        ------
        ModelError
            If a component has an unknown type or wrong keys; the message names the key path.
        """
        made = dict(table)
        rows = made.get("components", [])
        if not isinstance(rows, list) or not all(isinstance(row, Mapping) for row in rows):
            raise ModelError(f"{read.where}.components: expected a list of tables [[elements.{name}.components]]")
        components = []
        for k, row in enumerate(rows, start=1):
            where = f"{read.where}.components.{k}"
            kind, own = row.get("type"), {key: value for key, value in row.items() if key != "type"}
            if kind not in COMPONENTS:
                raise ModelError(
                    f"{where}.type: expected a component, got {quoted(kind)}{nearest(str(kind), tuple(COMPONENTS))}"
                )
            components.append(replace(read, where=where).fields_of(COMPONENTS[kind], own))
        made.pop("components", None)
        circuit = read.fields_of(cls, made, name=name, components=tuple(components))
        assert isinstance(circuit, cls)
        return circuit

    @property
    def markers(self) -> tuple[Marker, ...]:
        """Markers of the cylinders and pumps, two for each."""
        return tuple(
            marker
            for each in self.components
            if isinstance(each, Cylinder | Pump)
            for marker in (each.marker_a, each.marker_b)
        )

    def drawn(self) -> tuple[Stretched, ...]:
        """Return a drawn cylinder and rod for each cylinder, with the diameter of its head and half of that."""
        attached = [each for each in self.components if isinstance(each, Cylinder | Pump)]
        found = []
        for k, each in enumerate(attached):
            if isinstance(each, Cylinder):
                radius = sqrt(each.head_area / pi)
                found += [Stretched("strut", 2 * k, 2 * k + 1, radius), Stretched("rod", 2 * k, 2 * k + 1, radius / 2)]
        return tuple(found)

    def law(self, placed: Placed) -> ElementLaw:
        """Return the law of the circuit for the assembled cylinders and the initial pressures."""
        return circuit_law_of(self.fluid, self.components, self.nodes, placed)
