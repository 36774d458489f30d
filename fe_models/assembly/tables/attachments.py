"""The tables of masses, springs, links, ties, couplings and equations at nodes of a model (docs/job_file.md)."""

from collections.abc import Mapping
from typing import TYPE_CHECKING, Annotated, Any

import numpy as np
from pydantic import BeforeValidator, Field, model_validator

from fe_models.assembly.tables.beams import numbers
from fe_models.assembly.tables.materials import Name
from fe_models.foundation.arrays import MOTION_COMPONENTS as COMPONENTS
from fe_models.foundation.arrays import IntArray
from fe_models.foundation.errors import BodyError
from fe_models.foundation.toml_file import Matrix3, Names, Table, Vector3, choice, is_no_number, names
from fe_models.foundation.words import nearest, quoted

if TYPE_CHECKING:
    from fe_models.elements.beams.attachments import PointMass, RigidLink, Spring

__all__ = [
    "CouplingSection", "EquationSection", "LinkSection", "MassSection", "SpringSection", "TieSection",
    "nodes_at", "one_node", "point_masses", "rigid_links", "springs_between",
]  # fmt: skip

NodeNumber = Annotated[int, Field(ge=0, strict=True)]
ALL = tuple(range(6))


def component_numbers(value: Any) -> tuple[int, ...]:
    """Return component names as numbers 0-5."""
    words = names(value)
    for word in words:
        if word not in COMPONENTS:
            raise ValueError(f"unknown component {quoted(word)}{nearest(word, COMPONENTS)}")
    return tuple(COMPONENTS.index(word) for word in words)


def inertia_numbers(value: Any) -> Any:
    """Return one number, three numbers, or three rows of three."""
    rows = value if isinstance(value, list | tuple) else [value]
    flat = [x for row in rows for x in (row if isinstance(row, list | tuple) else [row])]
    if len(flat) not in (1, 3, 9) or not all(isinstance(x, int | float) and not isinstance(x, bool) for x in flat):
        raise ValueError("expected one number, three principal values, or three rows of three")
    return value


def equation_terms(value: Any) -> tuple[tuple[str, int, float], ...]:
    """Return the terms of an equation: [group of one node, component, coefficient]."""
    is_list = isinstance(value, list | tuple) and len(value) >= 2
    if not is_list or not all(isinstance(term, list | tuple) and len(term) == 3 for term in value):
        raise ValueError('expected two or more terms such as ["node_7", "ux", 1.0]')
    made = []
    for node, component, coefficient in value:
        if component not in COMPONENTS:
            raise ValueError(f"unknown component {quoted(component)}{nearest(str(component), COMPONENTS)}")
        if not isinstance(node, str) or isinstance(coefficient, bool) or not isinstance(coefficient, int | float):
            raise ValueError('expected terms such as ["node_7", "ux", 1.0]')
        made.append((node, COMPONENTS.index(component), float(coefficient)))
    return tuple(made)


def member_weight(value: Any) -> float | tuple[float, ...]:
    """Return one weight for translations, or six for ux uy uz rx ry rz."""
    given = value if isinstance(value, list | tuple) else (value,) * 6
    if len(given) != 6 or any(is_no_number(each) for each in given):
        raise ValueError("expected a number, or a list of six")
    return tuple(float(each) for each in given) if isinstance(value, list | tuple) else float(value)


SixWeights = tuple[float, float, float, float, float, float]  #: weights for ux uy uz rx ry rz
MemberWeight = Annotated[float | SixWeights, BeforeValidator(member_weight, json_schema_input_type=Any)]
Components = Annotated[tuple[int, ...], BeforeValidator(component_numbers, json_schema_input_type=Any)]


class MassSection(Table):
    """[masses.NAME]: a rigid piece at a node."""

    node: Name | NodeNumber = Field(description="the name of a group that holds one node, or a node number")
    mass: Annotated[float, Field(ge=0)] = Field(description="a number, 0 or more")
    inertia: Annotated[Any, BeforeValidator(inertia_numbers, json_schema_input_type=Any)] = Field(
        0.0, description="about the centre of mass: one number, three principal values, or three rows of three"
    )
    offset: Vector3 | None = Field(None, description="from the node to the centre of mass, [x, y, z]")


class SpringSection(Table):
    """[springs.NAME]: a spring between two nodes."""

    nodes: Annotated[Names, Field(min_length=2, max_length=2)] = Field(
        description="two names of groups that hold one node each"
    )
    stiffness: numbers(6) = Field(  # type: ignore[valid-type]
        description="six numbers: along x y z, about x y z"
    )
    damping: numbers(6) | None = Field(  # type: ignore[valid-type]
        None, description="six numbers: along x y z, about x y z"
    )
    point: Vector3 | None = Field(None, description="where it acts, [x, y, z]; default: midway")
    triad: Matrix3 | None = Field(None, description="its axes, [x axis, y axis, z axis]")


class LinkSection(Table):
    """[links.NAME]: nodes that move rigidly with one node."""

    node: Name = Field(description="the name of a group that holds one node, which leads")
    followers: Names = Field(description="the name of a group of nodes, or a list of names")
    components: Components = Field(ALL, description="with a deck: components that follow, ux to rz; default: all")


class TieSection(Table):
    """[ties.NAME]: a node of the beams held by nodes of the solid."""

    node: Name = Field(description="the name of a group that holds one node of the beams")
    kind: choice("kind", lambda: ("rigid", "distributing")) = Field(  # type: ignore[valid-type]
        description="one of rigid, distributing"
    )
    faces: Name | None = Field(None, description="the name of a group of faces of the solid")
    nodes: Name | None = Field(None, description="the name of a group of nodes of the solid")

    @model_validator(mode="after")
    def _one_selection(self) -> "TieSection":
        if (self.faces is None) == (self.nodes is None):
            raise ValueError(f"expected either faces or nodes of the solid, got {'both' if self.faces else 'neither'}")
        return self


class CouplingSection(Table):
    """[couplings.NAME]: a node that follows the weighted mean motion of others (RBE3)."""

    node: Name = Field(description="the name of a group that holds one node, which follows")
    members: dict[str, MemberWeight] = Field(
        min_length=1,
        description="a table {group = weight of each of its nodes}: one number, for translations, or a list of six",
    )
    components: Components = Field(ALL, description="components of the node that follow, ux to rz; default: all")


class EquationSection(Table):
    """[equations.NAME]: Σ coefficient × component = 0."""

    terms: Annotated[
        tuple[tuple[str, int, float], ...], BeforeValidator(equation_terms, json_schema_input_type=Any)
    ] = Field(description='two or more terms [group of one node, component, coefficient], as ["node_7", "ux", 1.0]')


# attachments on a mesh ------------------------------------------------------------------------------------------------


def nodes_at(mesh: Any, where: str, group: str | int) -> IntArray:
    """Return the nodes of a group, or the node with a number.

    Parameters
    ----------
    mesh
        A mesh with `node_sets` and `node_numbers`.
    where
        Key path, for the message.

    Raises
    ------
    BodyError
        If there is no such group, or not one node with this number.
    """
    if isinstance(group, int):
        numbers = np.zeros(0, np.int64) if mesh.node_numbers is None else np.asarray(mesh.node_numbers)
        found: IntArray = np.flatnonzero(numbers == group).astype(np.int64)
        if len(found) != 1:
            what = f"{len(found)} nodes have this number" if numbers.size else "the nodes have no numbers"
            raise BodyError(f"{where} = {group}: in the mesh {what}; expected one node, or the name of a group of one")
        return found
    if group not in mesh.node_sets:
        raise BodyError(f'{where} = "{group}": the mesh has no such group of nodes{nearest(group, mesh.node_sets)}')
    return np.asarray(mesh.node_sets[group])


def one_node(mesh: Any, where: str, group: str | int) -> int:
    """Return the node with a number, or the only node of a group."""
    nodes = nodes_at(mesh, where, group)
    if len(nodes) != 1:
        raise BodyError(f'{where} = "{group}": expected a group of one node, got {len(nodes)} nodes')
    return int(nodes[0])


def point_masses(mesh: Any, tables: Mapping[str, MassSection], *, at_each: bool = False) -> "list[PointMass]":
    """Return the point masses on a mesh; `at_each`: one at each node of the group, which may then have several."""
    from fe_models.elements.beams.attachments import PointMass

    made = []
    for name, table in tables.items():
        where = f"masses.{name}.node"
        nodes = nodes_at(mesh, where, table.node).tolist() if at_each else [one_node(mesh, where, table.node)]
        made += [PointMass(node, table.mass, table.inertia, table.offset or (0.0, 0.0, 0.0)) for node in nodes]
    return made


def springs_between(mesh: Any, tables: Mapping[str, SpringSection]) -> "list[Spring]":
    """Return the springs between nodes of a mesh."""
    from fe_models.elements.beams.attachments import Spring

    return [
        Spring(
            (
                one_node(mesh, f"springs.{name}.nodes", table.nodes[0]),
                one_node(mesh, f"springs.{name}.nodes", table.nodes[1]),
            ),
            table.stiffness,
            damping=table.damping,
            point=table.point,
            # axes are rows in a table, but columns here
            triad=np.eye(3) if table.triad is None else np.array(table.triad).T,
        )
        for name, table in tables.items()
    ]


def rigid_links(mesh: Any, tables: Mapping[str, LinkSection]) -> "list[RigidLink]":
    """Return the rigid links on a mesh, in the order of the tables; raise `BodyError` if one leaves components free."""
    from fe_models.elements.beams.attachments import RigidLink

    for name, table in tables.items():
        if set(table.components) != set(ALL):
            raise BodyError(f"links.{name}.components: belong to a whole deck; remove them, all components follow")
    return [
        RigidLink(one_node(mesh, f"links.{name}.node", table.node), followers_of(mesh, name, table))
        for name, table in tables.items()
    ]


def followers_of(mesh: Any, name: str, table: LinkSection) -> IntArray:
    """Return the nodes that follow in a rigid link, ascending."""
    return np.unique(np.concatenate([nodes_at(mesh, f"links.{name}.followers", group) for group in table.followers]))
