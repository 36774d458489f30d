"""A hydraulic circuit as one element, with components between nodes, and pressures as states."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from math import pi, sqrt
from typing import Any

from fe_models.foundation.copies import frozen_copies
from fe_models.foundation.words import nearest, quoted
from floatframe.components.hydraulics.circuit_data import circuit_law_of
from floatframe.components.hydraulics.components import (
    COMPONENTS,
    Component,
    Cylinder,
    Node,
    Pump,
)
from floatframe.components.hydraulics.fluid import Fluid
from floatframe.components.hydraulics.nodes import check_nodes
from floatframe.errors import ModelError
from floatframe.model.bodies.markers import Marker
from floatframe.model.elements import Element, ElementLaw, Placed
from floatframe.model.shapes.drawn import Stretched

__all__ = ["Circuit"]


@frozen_copies
@dataclass(frozen=True, eq=False)
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
        if not isinstance(self.fluid, Fluid):
            raise ModelError(f"{where}: fluid: expected a Fluid, got {self.fluid!r}")
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
        """Markers of its cylinders and pumps, two for each."""
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
