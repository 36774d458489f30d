"""The tables [interfaces.NAME] and [load_cases.NAME] of a model: where neighbours and loads act (docs/job_file.md)."""

from collections.abc import Mapping
from typing import TYPE_CHECKING, Annotated, Any

import numpy as np
from pydantic import BeforeValidator, Field, model_validator

from fe_models.assembly.tables.beams import Positive, numbers
from fe_models.assembly.tables.materials import Name
from fe_models.body.fe_body import INTERFACE_KINDS, FEBody, Interface
from fe_models.body.load_cases import LOAD_CASE_KINDS, LoadCase
from fe_models.errors import LoadError
from fe_models.foundation.toml_file import Matrix3, Names, Range, Table, Vector3, choice
from fe_models.foundation.words import nearest

if TYPE_CHECKING:
    from fe_models.meshes.selections import AnyMesh

__all__ = [
    "FACES", "SELECTIONS", "InterfaceSection", "LoadCaseSection", "interfaces_of", "load_case_of", "load_cases_of",
]  # fmt: skip

SELECTIONS = ("faces", "nodes", "plane", "cylinder", "box", "nearest")  #: keys that select the nodes of an interface
KEYS_OF_LOADS = {
    "pressure": ("pressure",),
    "gravity": ("acceleration",),
    "force": ("force", "torque", "at", "reference", "each"),
}  #: keys of each kind of load case, in addition to the selections for pressure and force


def node_names(value: Any) -> Any:
    """Return the name of a group of nodes, or a list of node numbers as a tuple."""
    if isinstance(value, list):
        if not value or any(isinstance(n, bool) or not isinstance(n, int) for n in value):
            raise ValueError("expected the name of a group of nodes, or a list of node numbers")
        return tuple(value)
    return value


Nodes = Annotated[Name | tuple[int, ...], BeforeValidator(node_names, json_schema_input_type=Any)]
FACES = "the name of a group of faces, of a CAD file also what they are (cylinder r=12), or a list of these"


class PlaneSection(Table):
    """Nodes on a plane."""

    point: Vector3 = Field(description="a point of the plane, [x, y, z]")
    normal: Vector3 = Field(description="a direction normal to the plane, [x, y, z]")
    tolerance: Positive | None = Field(
        None, description="a number above 0, the largest distance of a node; default: 1e-6 of the size of the body"
    )


class CylinderSection(Table):
    """Nodes on the surface of a cylinder."""

    point: Vector3 = Field(description="a point on the axis, [x, y, z]")
    axis: Vector3 = Field(description="the direction of the axis, [x, y, z]")
    radius: Positive = Field(description="a number above 0, the radius")
    span: Range | None = Field(None, description="two numbers, [from, to] along the axis, measured from point")
    tolerance: Positive | None = Field(
        None, description="a number above 0, the largest distance from the surface; default: 1e-3 of the radius"
    )


class BoxSection(Table):
    """Nodes in a box whose edges are parallel to the mesh axes."""

    lo: Vector3 = Field(description="the corner with the least coordinates, [x, y, z]")
    hi: Vector3 = Field(description="the corner with the greatest coordinates, [x, y, z]")


class NearestSection(Table):
    """The node nearest to a point."""

    point: Vector3 = Field(description="a point, [x, y, z]")


class SelectedPlace(Table):
    """A table with keys that select nodes."""

    kind: Any
    faces: Names | None = Field(None, description=FACES)
    nodes: Nodes | None = Field(None, description="the name of a group of nodes, or a list of node numbers")
    plane: PlaneSection | None = Field(None, description="a table {point, normal, tolerance}")
    cylinder: CylinderSection | None = Field(None, description="a table {point, axis, radius, span, tolerance}")
    box: BoxSection | None = Field(None, description="a table {lo, hi}")
    nearest: NearestSection | None = Field(None, description="a table {point}")

    @property
    def selection(self) -> str | None:
        """Key of the given selection; None if there is none."""
        return next((key for key in SELECTIONS if getattr(self, key) is not None), None)


class InterfaceSection(SelectedPlace):
    """[interfaces.NAME]: a place at which neighbours connect to the body."""

    kind: choice("kind", lambda: INTERFACE_KINDS) = Field(  # type: ignore[valid-type]
        description=f"one of {', '.join(INTERFACE_KINDS)}"
    )
    reference: Vector3 | None = Field(None, description="the reference point, [x, y, z]")
    triad: Matrix3 | None = Field(None, description="the axes of the interface, [x axis, y axis, z axis]")
    on: choice("part", lambda: ("solid", "lines")) | None = Field(  # type: ignore[valid-type]
        None, description="solid or lines: the part on which it is, if a body has both"
    )

    @model_validator(mode="after")
    def _one_selection(self) -> "InterfaceSection":
        given = [key for key in SELECTIONS if getattr(self, key) is not None]
        if len(given) != 1:
            raise ValueError(f"expected exactly one of {', '.join(SELECTIONS)}; got {', '.join(given) or 'none'}")
        return self


class LoadCaseSection(SelectedPlace):
    """[load_cases.NAME]: a named load, whose modal forces and stresses go into the modal file."""

    kind: choice("kind", lambda: LOAD_CASE_KINDS) = Field(  # type: ignore[valid-type]
        description=f"one of {', '.join(LOAD_CASE_KINDS)}"
    )
    pressure: float | None = Field(None, description="a number, positive pushes on the surface [stress unit]")
    acceleration: Vector3 | None = Field(None, description="the acceleration of free fall, [x, y, z]")
    force: Vector3 | None = Field(None, description="the total force, [x, y, z]")
    torque: Vector3 | None = Field(None, description="the total torque about the reference point, [x, y, z]")
    at: Name | None = Field(None, description="the name of an interface, at whose reference point it acts")
    each: dict[str, numbers(6)] | None = Field(  # type: ignore[valid-type]
        None, description="with a deck: a table {group = [force and moment at each of its nodes]}"
    )
    reference: Vector3 | None = Field(None, description="the point the force acts at, [x, y, z]")

    @model_validator(mode="after")
    def _keys_of_the_kind(self) -> "LoadCaseSection":
        allowed = KEYS_OF_LOADS[self.kind] + (() if self.kind == "gravity" else SELECTIONS)
        given = [key for key in type(self).model_fields if key != "kind" and getattr(self, key) is not None]
        for key in given:
            if key not in allowed:
                raise ValueError(f"a load case of kind {self.kind!r} has no key {key}{nearest(key, allowed)}")
        if self.each is not None:
            if given != ["each"]:
                raise ValueError("each: says place and amount; remove the other keys")
            return self
        places = [key for key in given if key in (*SELECTIONS, "at")]
        if self.kind != "gravity" and len(places) != 1:
            choices = ", ".join(("at", *SELECTIONS) if self.kind == "force" else SELECTIONS)
            raise ValueError(f"expected exactly one of {choices}; got {', '.join(places) or 'none'}")
        amounts = ("force", "torque") if self.kind == "force" else KEYS_OF_LOADS[self.kind]
        if not any(key in given for key in amounts):
            raise ValueError(f"{' or '.join(amounts)}: missing; how large is the load?")
        if self.at is not None and self.reference is not None:
            raise ValueError("reference: an interface has its own; remove the key, or select the nodes instead of at")
        return self


# interfaces and load cases on a mesh ----------------------------------------------------------------------------------


def interfaces_of(tables: Mapping[str, InterfaceSection], mesh: "AnyMesh") -> tuple[Interface, ...]:
    """Return the interfaces on a mesh of solids, shells or lines, or on nodes of elements of another program.

    Raises
    ------
    InterfaceError
        If an interface selects no nodes, or two of them share a node.
    """
    from fe_models.body.couplings.couplings import check_overlap
    from fe_models.elements import interfaces as makers
    from fe_models.meshes.boundary import facet_weights
    from fe_models.meshes.line_mesh import LineMesh
    from fe_models.meshes.mesh import Mesh
    from fe_models.meshes.selections import selected_facets
    from fe_models.meshes.shell_mesh import ShellMesh

    on_solid = {
        "rigid": makers.rigid_interface,
        "distributing": makers.distributing_interface,
        "nodes": makers.nodes_interface,
    }
    made = []
    for name, table in tables.items():
        chosen, kind, reference = selection_of(table), table.kind, table.reference
        # axes are rows in a table, but columns here
        triad = None if table.triad is None else np.array(table.triad).T
        if isinstance(mesh, Mesh):
            made.append(on_solid[kind](mesh, name, chosen, reference=reference, triad=triad))
        elif isinstance(mesh, ShellMesh):
            made.append(makers.shell_interface(mesh, name, chosen, kind=kind, reference=reference, triad=triad))
        elif isinstance(mesh, LineMesh):
            made.append(makers.line_interface(mesh, name, chosen, kind=kind, reference=reference, triad=triad))
        else:
            facets = selected_facets(mesh, chosen)
            weights = facet_weights(mesh.nodes, facets) if facets else np.ones(len(mesh.nodes))
            made.append(makers.node_interface(mesh, name, chosen, kind, reference, triad, np.maximum(weights, 0.0)))
    check_overlap(made, numbers=mesh.node_numbers)
    return tuple(made)


def selection_of(section: SelectedPlace) -> Any:
    """Return the node selection of a table, given by one of the keys `SELECTIONS`."""
    from fe_models.meshes import selections

    types = {
        "faces": selections.FaceGroup,
        "nodes": selections.NodeSet,
        "plane": selections.Plane,
        "cylinder": selections.Cylinder,
        "box": selections.Box,
        "nearest": selections.NearestNode,
    }
    key = next(key for key in SELECTIONS if getattr(section, key) is not None)
    given = getattr(section, key)
    if key == "faces":
        first, *more = given
        return selections.FaceGroup(first, tuple(more))
    if isinstance(given, tuple):
        return selections.NodeNumbers(given)
    selection: Any = types[key]
    return selection(given) if isinstance(given, str) else selection(**given.model_dump())


def load_cases_of(
    tables: Mapping[str, LoadCaseSection], body: FEBody, mesh: "AnyMesh | None" = None
) -> tuple[LoadCase, ...]:
    """Return the load cases on this body, not yet coupled."""
    return tuple(load_case_of(name, table, body, mesh) for name, table in tables.items())


def load_case_of(name: str, section: LoadCaseSection, body: FEBody, mesh: "AnyMesh | None") -> LoadCase:
    """Return one load case; the table has already checked that its keys belong to its kind."""
    from fe_models.body import loads

    if section.acceleration is not None:
        return loads.gravity_load(body, name, section.acceleration)
    force, torque = section.force or (0.0, 0.0, 0.0), section.torque or (0.0, 0.0, 0.0)
    if section.at is not None:
        return loads.interface_load(body, name, section.at, force=force, torque=torque)
    if mesh is None or section.selection is None:
        raise LoadError(f"load_cases.{name}: there is no mesh to select on; give at = an interface")
    chosen = selection_of(section)
    if section.pressure is not None:
        return loads.pressure_load(body, mesh, name, chosen, section.pressure)
    return loads.selection_load(body, mesh, name, chosen, force=force, torque=torque, reference=section.reference)
