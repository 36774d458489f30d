"""Stress points of elements: ends of beams at their section points, corners of shells on both faces, nodes of solids.

The stress at a node is an average over the adjoining elements. Parts of it cancel where a frame branches, a bending
moment is applied, or a surface is folded. A strength assessment needs the stress of each element separately:

(1) beams: every section point at both ends, from the section forces of that element, sigma_xx = N/A + My z/Iy - Mz
    y/Iz, tau from shear forces and Saint-Venant torsion; warping stress is neglected
(2) shells: every corner of every cell at top and bottom, from the resultants extrapolated linearly to the corner
(3) solids: every node of every cell, extrapolated within the cell without averaging over neighbours
(4) nodes of solids where materials meet: one point for each material, averaged over its cells only, because stress is
    discontinuous there, and the nodal stress is that of the stiffest material
"""

from collections.abc import Iterable
from dataclasses import dataclass, replace

import numpy as np

from fe_models.body.fe_body import FEBody, StressPointModel
from fe_models.elements.beams.model import BeamModel
from fe_models.elements.recovery.element_forces import ElementGroup, element_groups
from fe_models.elements.shells.elements import ShellCells
from fe_models.elements.shells.model import BOTTOM, TOP
from fe_models.elements.solids.body import SolidModel
from fe_models.elements.solids.stress import nodal_stress
from fe_models.errors import BeamError
from fe_models.foundation.arrays import Array, IntArray, frozen
from fe_models.foundation.errors import BodyError
from fe_models.foundation.words import nearest, quoted
from fe_models.meshes.mesh import Mesh

__all__ = ["ElementPoints", "element_points"]

FACES = {"top": TOP, "bottom": BOTTOM}
ENDS = ("A", "B")
ALL, BORDERS = "all", "borders"
NOTE = "stress points"  #: provenance key for stress points


@dataclass(frozen=True, eq=False)
class BeamEnds:
    """Section points at both ends of lines, section by section."""

    model: BeamModel
    lines: IntArray  #: indices of the lines, (n,)
    names: tuple[str, ...]
    positions: Array
    rows: slice  #: rows of the element model among the mesh dofs

    def stress(self, u: Array) -> Array:
        """Step (1): return the stress, (n_points, 6, k) [Pa]."""
        forces = self.model.section_forces(u[self.rows])
        parts = []
        for own in lines_by_section(self.model, self.lines):
            ends = [self.model.stress_at_end(own, forces[own, end]) for end in range(2)]
            parts.append(np.stack(ends, axis=1).reshape(-1, 6, np.shape(u)[1]))
        return np.concatenate(parts)


@dataclass(frozen=True, eq=False)
class ShellCorners:
    """Corners of cells, for each cell first at the top and then at the bottom."""

    cells: ShellCells
    chosen: IntArray  #: indices of the chosen cells, (n,)
    names: tuple[str, ...]
    positions: Array
    rows: slice  #: rows of the element model among the mesh dofs

    def stress(self, u: Array) -> Array:
        """Step (2): return the stress, (n_points, 6, k) [Pa]."""
        of_mesh, k = np.asarray(u[self.rows]), np.shape(u)[1]
        parts = []
        for rows in self.cells.chunks():
            own = self.chosen[(self.chosen >= rows.start) & (self.chosen < rows.stop)] - rows.start
            if len(own):
                resultants = self.cells.corner_resultants(of_mesh, rows)
                faces = [self.cells.stress(resultants, rows, height)[own] for height in FACES.values()]
                parts.append(np.stack(faces, axis=1).reshape(-1, 6, k))
        return np.concatenate(parts)


@dataclass(frozen=True, eq=False)
class SolidNodes:
    """Nodes of solid cells of one type, cell by cell."""

    model: SolidModel
    kind: str
    chosen: IntArray  #: indices of the chosen cells, (n,)
    names: tuple[str, ...]
    positions: Array
    rows: slice  #: rows of the element model among the mesh dofs

    def stress(self, u: Array) -> Array:
        """Step (3): return the stress, (n_points, 6, k) [Pa]: nodal stress without averaging between cells."""
        mesh, cells = self.model.mesh, self.model.mesh.cells[self.kind][self.chosen]
        of_mesh = u[self.rows].reshape(len(mesh.nodes), 3, -1)[cells.ravel()]
        apart = Mesh(mesh.nodes[cells.ravel()], {self.kind: np.arange(cells.size).reshape(cells.shape)})
        material = self.model.of_cell[self.kind][self.chosen]
        return nodal_stress(
            apart,
            self.model.materials,
            {self.kind: material},
            np.repeat(material, cells.shape[1]),
            of_mesh.reshape(3 * cells.size, -1),
            incompatible=self.model.incompatible,
        )


@dataclass(frozen=True, eq=False)
class MaterialBorders:
    """Nodes on borders between materials of solid cells, with one point for each material."""

    model: SolidModel
    members: tuple[IntArray, ...]  #: border nodes of each material
    names: tuple[str, ...]
    positions: Array
    rows: slice  #: rows of the element model among the mesh dofs

    def stress(self, u: Array) -> Array:
        """Step (4): return the stress, (n_points, 6, k) [Pa]."""
        model, parts = self.model, []
        for material, nodes in enumerate(self.members):
            shown = np.full(len(model.mesh.nodes), material)
            whole = nodal_stress(
                model.mesh, model.materials, model.of_cell, shown, u[self.rows],
                nodes=nodes, incompatible=model.incompatible,
            )  # fmt: skip
            parts.append(whole[nodes])
        return np.concatenate(parts)


Points = BeamEnds | ShellCorners | SolidNodes | MaterialBorders


@dataclass(frozen=True, eq=False)
class ElementPoints:
    """Stress points of elements, after existing stress points of the body."""

    parts: tuple[Points, ...]
    before: StressPointModel | None = None

    @property
    def names(self) -> tuple[str, ...]:
        """Name of each point: "beam 17 end A point 3", "shell 21 node 5 top", "solid 3 node 5 inside", (n_points,)."""
        own = () if self.before is None else tuple(self.before.names)
        return (*own, *(name for part in self.parts for name in part.names))

    @property
    def positions(self) -> Array:
        """Undeformed positions in mesh axes, (n_points, 3) [m]."""
        own = [] if self.before is None else [self.before.positions]
        return frozen(np.concatenate([*own, *(part.positions for part in self.parts)]))

    def stress(self, u: Array) -> Array:
        """Return the stress for columns over the mesh dofs, (n_points, 6, k) [Pa], xx yy zz yz xz xy in mesh axes."""
        own = [] if self.before is None else [self.before.stress(u)]
        return np.concatenate([*own, *(part.stress(np.asarray(u)) for part in self.parts)])


def element_points(body: FEBody, at: Iterable[int | str] = (ALL,)) -> FEBody:
    """Return the body with stress points of single elements at beam ends, shell corners and nodes of solid cells.

    Parameters
    ----------
    body
        Body of beams, shells or solids, coupled or not, welded, joined or neither.
    at
        Numbers of elements, or names of sets or parts; "all" selects all beams and shells, or all solid cells of a body
        that has no others; "borders" selects the nodes of solids at which materials meet, with a point per material.

    Raises
    ------
    BodyError
        If the body has no such elements, a name or number is unknown, or a beam section is given by its properties
        without an outline, so that its extreme fibres are unknown.
    """
    known_groups = element_groups(body)
    groups = [group for group in known_groups if group.quantity in ("beam force", "shell resultant", "element stress")]
    where = f"body {body.name!r}: stress points"
    if not groups:
        raise BodyError(f"{where}: it has no elements whose stress is known")
    n_thin = sum(group.quantity != "element stress" for group in groups)
    chosen = [np.zeros(group.count, dtype=bool) for group in groups]
    asked = (at,) if isinstance(at, str) else tuple(at)
    for each in asked:
        found = each == BORDERS
        for group, mask in zip(groups, chosen, strict=True):
            rows = group.members(each, is_only=len(groups) == 1)
            if each == ALL and (group.quantity != "element stress" or not n_thin):
                rows = np.arange(group.count)
            mask[rows] = True
            found |= len(rows) > 0
        if not found:
            known = [ALL, *(n for g in groups for n in (*g.groups, g.part, *g.names) if n)]
            unique = list(dict.fromkeys(known))
            raise BodyError(f"{where}: no element, set or part {quoted(str(each))}{nearest(str(each), unique)}")
    borders = [b for g in groups for b in material_borders(body, g)] if BORDERS in asked else []
    if BORDERS in asked and not borders:
        raise BodyError(f"{where}: {BORDERS}: it has no node at which solid cells of different materials meet")
    if not borders and not any(mask.any() for mask in chosen):
        raise BodyError(f"{where}: expected numbers of elements, names of sets, or {ALL!r}, got none")
    parts: list[Points] = [*borders]
    notes = []
    for group, mask in zip(groups, chosen, strict=True):
        rows = np.flatnonzero(mask)
        if not len(rows):
            continue
        if isinstance(group.source, ShellCells):
            parts.append(shell_corners(body, group, group.source, rows))
            continue
        if isinstance(group.source, SolidModel):
            parts.append(solid_nodes(body, group, group.source, rows))
            continue
        assert isinstance(group.source, BeamModel)
        parts.append(beam_ends(where, group, group.source, rows))
        words = "at beams warping stresses are left out"
        if not all(group.source.sections[k].shows_shear for k in set(group.source.of_line[rows].tolist())):
            words += ", and beams of general sections show no shear stress"
        notes.append(words)
    provenance = dict(body.provenance)
    if notes:
        provenance[NOTE] = max(notes, key=len)
    return replace(body, stress_points=ElementPoints(tuple(parts), body.stress_points), provenance=provenance)


def lines_by_section(model: BeamModel, lines: IntArray) -> list[IntArray]:
    """Return the lines in groups with the same section."""
    of_line = np.asarray(model.of_line)[lines]
    return [lines[of_line == number] for number in np.unique(of_line)]


def beam_ends(where: str, group: ElementGroup, model: BeamModel, lines: IntArray) -> BeamEnds:
    """Return the section points of some lines of a group."""
    names, places = [], []
    for own in lines_by_section(model, lines):
        section = model.sections[model.of_line[own[0]]]
        if not section.is_outline_known:
            raise BeamError(
                f"{where}: beam {group.names[own[0]]} has a section given by numbers without outline, so its outer "
                "fibres are unknown; give outline = [[y, z], ...] in its table, or leave its elements out"
            )
        for line in own.tolist():
            for end, word in enumerate(ENDS):
                places.append(model.geometry.ends[line, end] + section.points @ model.geometry.R[line][:, 1:].T)
                names += [f"beam {group.names[line]} end {word} point {k}" for k in range(len(section.points))]
    return BeamEnds(model, lines, tuple(names), frozen(np.concatenate(places)), group.rows)


def shell_corners(body: FEBody, group: ElementGroup, cells: ShellCells, rows: IntArray) -> ShellCorners:
    """Return the corners of some cells of a group."""
    arm = cells.t[rows, None] * cells.planes.R[rows][:, :, 2]
    corners = cells.planes.corners[rows]
    places = np.stack([corners + height * arm[:, None] for height in FACES.values()], axis=1)
    names = [
        f"shell {group.names[row]} node {body.numbering.called(group.first_node + node)} {face}"
        for row in rows.tolist()
        for face in FACES
        for node in cells.cells[row].tolist()
    ]
    return ShellCorners(cells, rows, tuple(names), frozen(places.reshape(-1, 3)), group.rows)


def solid_nodes(body: FEBody, group: ElementGroup, model: SolidModel, rows: IntArray) -> SolidNodes:
    """Return the nodes of some cells of a group."""
    cells = model.mesh.cells[group.kind][rows]
    names = [
        f"solid {group.names[row]} node {body.numbering.called(group.first_node + node)} inside"
        for row, own in zip(rows.tolist(), cells.tolist(), strict=True)
        for node in own
    ]
    return SolidNodes(model, group.kind, rows, tuple(names), frozen(model.mesh.nodes[cells.ravel()]), group.rows)


def material_borders(body: FEBody, group: ElementGroup) -> list[MaterialBorders]:
    """Return the material borders of the solid model of a group, once for all its cell types; may be empty."""
    model = group.source
    if not isinstance(model, SolidModel) or group.kind != next(iter(model.mesh.cells)):
        return []
    has = np.zeros((len(model.materials), len(model.mesh.nodes)), dtype=bool)
    for kind, cells in model.mesh.cells.items():
        has[np.repeat(model.of_cell[kind], cells.shape[1]), cells.ravel()] = True
    members = tuple(np.flatnonzero(own & (has.sum(axis=0) > 1)) for own in has)
    nodes = np.concatenate(members)
    if not len(nodes):
        return []
    names = tuple(
        f"{material.name} node {body.numbering.called(group.first_node + node)} border"
        for material, own in zip(model.materials, members, strict=True)
        for node in own.tolist()
    )
    return [MaterialBorders(model, members, names, frozen(model.mesh.nodes[nodes]), group.rows)]
