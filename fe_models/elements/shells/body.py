"""The finite element body of a shell: shell cells, stiffeners, point masses, springs and rigid links."""

from collections.abc import Iterable, Mapping
from dataclasses import replace
from typing import Any

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray

from fe_models.body.fe_body import FEBody, Interface, Recovery, dofs_of
from fe_models.body.material import material_words
from fe_models.body.unit_check import warn_of_materials
from fe_models.elements.beams.attachments import PointMass, RigidLink, Spring
from fe_models.elements.beams.beam_property import BeamProperty
from fe_models.elements.beams.body import assembled, beam_body, skin_rows
from fe_models.elements.beams.links import link_rigidly
from fe_models.elements.shells.elements import ShellCells, shell_cells
from fe_models.elements.shells.model import ShellModel
from fe_models.elements.shells.quality import WARP_LIMIT, cell_quality
from fe_models.elements.shells.section_rotations import rotations_of_sections
from fe_models.elements.shells.shell_property import (
    AnyShellProperty,
    LaminateProperty,
    StiffnessProperty,
    assign_shell_properties,
)
from fe_models.elements.shells.skin import ShellSkin, make_shell_skin
from fe_models.elements.shells.stiffeners import element_model_of, with_frame
from fe_models.errors import ShellError
from fe_models.foundation.arrays import Array, IntArray
from fe_models.foundation.units import Units
from fe_models.meshes.line_mesh import LineMesh
from fe_models.meshes.mesh_numbering import shell_numbering
from fe_models.meshes.objects.as_mesh import as_shell_mesh
from fe_models.meshes.shell_mesh import ShellMesh

__all__ = ["shell_body"]


def shell_body(
    mesh: Any,
    properties: AnyShellProperty | Mapping[str, AnyShellProperty],
    *,
    name: str,
    units: Units,
    interfaces: Iterable[Interface] = (),
    stiffeners: BeamProperty | Mapping[str, BeamProperty] | None = None,
    point_masses: Iterable[PointMass] = (),
    springs: Iterable[Spring] = (),
    links: Iterable[RigidLink] = (),
    warp_limit: float = WARP_LIMIT,
) -> FEBody:
    """Make the body of a shell of flat Reissner-Mindlin elements with six dofs per node and consistent mass.

    Parameters
    ----------
    mesh
        Nodes, triangles, quads, lines, and their groups.
    properties
        One property for all cells, or one for each group of cells.
    name
        Name of the body.
    units
        Unit system of all inputs.
    interfaces
        Named places that `cms.couple` couples later; see `shell_interface`.
    stiffeners
        Sections of the lines of the mesh: one for all lines, or one for each group of lines. None: lines are ignored.
    point_masses, springs, links
        Attachments at the nodes.
    warp_limit
        Largest accepted angle between the two halves of a quad [degree].

    Returns
    -------
    FEBody
        Node i has the dofs 6 i + c, unless it follows a rigid link. The nodes are those of the mesh, then those of the
        skin (top and bottom faces, outlines of stiffeners), which follow the mesh nodes and are drawn.

    Raises
    ------
    ShellError
        If a group is unknown; if cells have no thickness or two thicknesses, have no area, or are folded or warped; if
        a node has no attached element; or if cells are nearly normal to the direction of their layup.
    SectionError, BeamError
        As for `beam_body`, for stiffeners and attachments.
    """
    mesh = as_shell_mesh(mesh)
    used, of_cell = assign_shell_properties(mesh, properties)
    warn_of_materials(name, units, [material for item in used for material in item.materials])
    _require_cells(mesh, warp_limit)
    groups = tuple(
        shell_cells(mesh.nodes, kind, cells, used, of_cell[kind]) for kind, cells in mesh.cells.items() if len(cells)
    )
    n_nodes = len(mesh.nodes)
    skin = make_shell_skin(mesh.nodes, groups)
    node_dofs, skin_dofs = dofs_of(np.arange(n_nodes), 6), dofs_of(n_nodes + np.arange(len(skin.points)), 3)
    model = ShellModel(n_nodes, groups, skin)
    body = FEBody(
        name=name,
        M=assembled([(group.dofs, group.mass_matrices()) for group in groups], 6 * n_nodes),
        K=assembled([(group.dofs, group.stiffness()) for group in groups], 6 * n_nodes),
        nodes=np.concatenate([mesh.nodes, skin.points]),
        dofs=node_dofs,
        units=units,
        surface=n_nodes + skin.triangles,
        element_model=model,
        recovery=Recovery(
            sp.vstack([sp.eye_array(6 * n_nodes), skin_rows(mesh.nodes, skin.points, skin.mover)], format="csr"),
            np.concatenate([node_dofs, skin_dofs]),
        ),
        node_volumes=_node_volumes(n_nodes, groups, skin),
        numbering=shell_numbering(mesh, skin.mover, skin.cell_of),
        provenance=_provenance(mesh, used, of_cell),
    )
    interfaces, masses, springs, links = tuple(interfaces), tuple(point_masses), tuple(springs), tuple(links)
    frame = _frame(mesh, stiffeners, masses, springs, name, units)
    is_used = _used_nodes(mesh, frame[1] if frame else np.zeros(0, np.int64), links)
    if not is_used.all():
        loose = np.flatnonzero(~is_used)
        raise ShellError(
            f"shell {name!r}: {loose.size} nodes belong to no cell, first node {_number(mesh, loose[0])}: they would "
            "make the stiffness singular; remove them"
        )
    if frame is not None:
        held = [np.asarray(item.nodes) for item in interfaces]
        held += [np.array([item.node, *item.followers]) for item in links]
        held += [np.array([item.node for item in masses] + [node for spring in springs for node in spring.nodes])]
        turns = rotations_of_sections(model, element_model_of(frame[0].element_model), frame[1], np.concatenate(held))
        body = with_frame(body, model, *frame, turns)
    return link_rigidly(replace(body, interfaces=interfaces), links)


def _frame(
    mesh: ShellMesh,
    stiffeners: BeamProperty | Mapping[str, BeamProperty] | None,
    masses: tuple[PointMass, ...],
    springs: tuple[Spring, ...],
    name: str,
    units: Units,
) -> tuple[FEBody, IntArray] | None:
    """Return stiffeners, masses and springs as one body, and the mesh node at each of its nodes."""
    lines = mesh.lines if stiffeners is not None else np.zeros((0, 2), np.int64)
    ends = [lines.ravel(), np.array([item.node for item in masses], dtype=np.int64)]
    ends += [np.array(spring.nodes, dtype=np.int64) for spring in springs]
    nodes = np.unique(np.concatenate(ends))
    if not len(nodes):
        return None
    unknown = nodes[(nodes < 0) | (nodes >= len(mesh.nodes))]
    if len(unknown):
        raise ShellError(f"shell {name!r}: node {unknown[0]} does not exist; expected 0..{len(mesh.nodes) - 1}")
    place = np.full(len(mesh.nodes), -1)
    place[nodes] = np.arange(len(nodes))
    line_mesh = LineMesh(
        mesh.nodes[nodes],
        place[lines],
        line_sets=mesh.line_sets if stiffeners is not None else {},
        line_numbers=mesh.line_numbers if stiffeners is not None else np.zeros(0, np.int64),
        node_numbers=mesh.node_numbers[nodes] if mesh.node_numbers.size else mesh.node_numbers,
    )
    frame = beam_body(
        line_mesh,
        stiffeners if stiffeners is not None else {},
        name=f"{name} stiffeners",
        units=units,
        point_masses=[replace(item, node=int(place[item.node])) for item in masses],
        springs=[replace(s, nodes=(int(place[s.nodes[0]]), int(place[s.nodes[1]]))) for s in springs],
    )
    return frame, nodes


def _used_nodes(mesh: ShellMesh, frame_nodes: IntArray, links: tuple[RigidLink, ...]) -> NDArray[np.bool_]:
    used = np.zeros(len(mesh.nodes), dtype=bool)
    for cells in mesh.cells.values():
        used[cells] = True
    used[frame_nodes] = True
    for link in links:
        nodes = np.append(link.followers, link.node)
        if nodes.min() < 0 or nodes.max() >= len(mesh.nodes):
            raise ShellError(f"rigid link at node {link.node}: expected nodes 0..{len(mesh.nodes) - 1}")
        used[nodes] = True
    return used


def _require_cells(mesh: ShellMesh, warp_limit: float) -> None:
    """Raise `ShellError` with a list of all cells that have no area, are folded, or are warped beyond the limit."""
    if not mesh.n_cells:
        raise ShellError("shell: expected triangles or quads, got none")
    problems = []
    for kind, cells in mesh.cells.items():
        if not len(cells):
            continue
        quality = cell_quality(mesh.nodes, cells)
        for what, is_bad, advice in (
            ("have no area", quality.is_degenerate, "merge their nodes and remove them"),
            ("are folded (an inner angle of 180 degrees or more)", quality.is_folded, "order or move their nodes"),
            (
                f"are warped beyond {warp_limit:g} degrees, by up to {quality.warp.max():.3g}",
                ~quality.is_degenerate & ~quality.is_folded & (quality.warp > warp_limit),
                "split them into triangles, or mesh finer",
            ),
        ):
            rows = np.flatnonzero(is_bad)
            if rows.size:
                problems.append(f"{rows.size} {kind} cells {what}, first {mesh.cell_name(kind, rows[0])}; {advice}")
    if problems:
        raise ShellError(f"shell: {'; '.join(problems)}")


def _node_volumes(n_nodes: int, groups: tuple[ShellCells, ...], skin: ShellSkin) -> Array:
    """Distribute the volume of cells to their corners, half to top and half to bottom, (n_nodes + n_skin,)."""
    volumes = np.zeros(n_nodes + len(skin.points))
    for group, patch in zip(groups, skin.patch, strict=True):
        share = np.repeat(group.areas() * group.t / (2 * patch.shape[1]), patch.shape[1])
        for first in (n_nodes, n_nodes + skin.n_patches):
            volumes += np.bincount(first + patch.ravel(), share, minlength=len(volumes))
    return volumes


def _number(mesh: ShellMesh, node: int) -> int:
    return int(mesh.node_numbers[node] if mesh.node_numbers.size else node)


def _provenance(mesh: ShellMesh, used: tuple[AnyShellProperty, ...], of_cell: Mapping[str, IntArray]) -> dict[str, str]:
    record = {"mesh": mesh.source, "mesh sha256": mesh.digest, "nodes": str(len(mesh.nodes))}
    record |= {f"file {path}": digest for path, digest in mesh.included.items()}
    record |= {f"cells {kind}": str(len(cells)) for kind, cells in mesh.cells.items() if len(cells)}
    for number, item in enumerate(used):
        count = sum(int((index == number).sum()) for index in of_cell.values())
        words = "; ".join(f"{m.name}: {material_words(m)}" for m in item.materials)
        record[f"shell {number + 1}"] = (
            f"thickness {item.thickness!r}, offset {item.offset!r}, added mass {item.added_mass!r}; {words}; "
            f"{count} cells"
        )
        if isinstance(item, LaminateProperty):
            layers = ", ".join(f"{x.material.name} {x.thickness!r} at {x.angle!r}" for x in item.layers)
            record[f"layers {number + 1}"] = f"bottom to top, from direction {list(item.direction)}: {layers}"
        if isinstance(item, StiffnessProperty):
            record[f"stiffness {number + 1}"] = (
                f"along direction {list(item.direction)}: {item.stiffness!r}, shear {item.shear_stiffness!r}"
            )
    return {key: value for key, value in record.items() if value}
