"""Validation of the nodes of a circuit: their components, and whether every pressure is defined."""

from collections.abc import Mapping, Sequence

from fe_models.foundation.words import nearest
from floatframe.components.hydraulics.components import (
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
    Supply,
    Tank,
)
from floatframe.components.hydraulics.fluid import Fluid
from floatframe.errors import ModelError
from floatframe.model.functions.time_functions import TimeFunction, constant

__all__ = ["check_nodes", "nodes_of", "prescribed"]

PORTS = ("a", "b", "head", "rod", "node", "pressure", "tank")  #: fields of components that may contain node names


def nodes_of(component: Component) -> list[str]:
    """Return the names of the nodes of a component."""
    names = [getattr(component, port, None) for port in PORTS]
    return [name for name in names if isinstance(name, str)]


def prescribed(fluid: Fluid, components: Sequence[Component]) -> dict[str, TimeFunction]:
    """Return the pressures prescribed by supplies and tanks, by node."""
    found: dict[str, TimeFunction] = {}
    for each in components:
        if isinstance(each, Supply | Tank):
            if each.node in found:
                raise ModelError(
                    f"component {each.name!r}: node {each.node!r} has the pressure of another supply or tank"
                )
            pressure = each.pressure if isinstance(each, Supply) else constant(fluid.ambient)
            assert isinstance(pressure, TimeFunction)  # ensured by the supply
            found[each.node] = pressure
    return found


def check_nodes(fluid: Fluid, components: Sequence[Component], nodes: Mapping[str, Node]) -> None:
    """Raise `ModelError` unless all nodes are connected and have volume or a pressure, and something sets its level."""
    counts: dict[str, int] = {}
    has_volume = {name for name, node in nodes.items() if node.volume > 0}
    for each in components:
        for name in nodes_of(each):
            counts[name] = counts.get(name, 0) + 1
        if isinstance(each, Cylinder | Pipe):
            has_volume.update(nodes_of(each))
        if isinstance(each, Orifice | Resistance | CheckValve | Pipe | FlowSource | Pump) and each.a == each.b:
            raise ModelError(f"component {each.name!r}: expected two nodes, got {each.a!r} twice")
    for name in nodes:
        if name not in counts:
            raise ModelError(f"nodes: {name}: no component names it{nearest(name, tuple(counts))}")
    given = prescribed(fluid, components)
    for each in components:
        names = nodes_of(each)
        for name in names:
            if name not in given and name not in has_volume:
                raise ModelError(
                    f"component {each.name!r}: node {name!r} has no volume and no supply or tank: give it one, as in "
                    f"nodes = {{ {name} = {{ volume = ... }} }}"
                    f"{nearest(name, sorted(set(counts) - {name}))}"
                )
            if counts[name] == 1 and not isinstance(each, Cylinder) and name not in nodes:
                raise ModelError(
                    f"component {each.name!r}: node {name!r} is isolated: nothing else is connected to it"
                    f"{nearest(name, sorted(set(counts) - {name}))}"
                )
            if isinstance(each, Accumulator) and name in given:
                raise ModelError(
                    f"component {each.name!r}: the pressure of node {name!r} is given; an accumulator there has "
                    "no effect"
                )
        if isinstance(each, DirectionalValve) and each.follow is not None:
            cylinders = [other.name for other in components if isinstance(other, Cylinder)]
            if each.follow not in cylinders:
                raise ModelError(
                    f"component {each.name!r}: follow: no cylinder {each.follow!r}; choices: {', '.join(cylinders)}"
                )
    if not given and all(node.pressure is None for node in nodes.values()):
        raise ModelError(
            "nothing sets its pressure: missing supply: give a supply or a tank, or the initial pressure of a node, "
            "as in nodes = { head = { pressure = 5e6 } }"
        )
