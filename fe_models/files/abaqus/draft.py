"""Content of an Abaqus or CalculiX deck while it is read."""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field

import numpy as np

from fe_models.errors import MeshError
from fe_models.files.abaqus.blocks import DeckBlock
from fe_models.files.abaqus.mesh import DeckMesh
from fe_models.files.decks.deck import (
    Coupling,
    DeckMass,
    DeckMaterial,
    DeckSpring,
    Equation,
    LineSection,
    Load,
    RigidGroup,
    RodSection,
    ShellSection,
    SolidSection,
    Support,
)
from fe_models.files.decks.ledger import Ledger
from fe_models.foundation.arrays import Array, IntArray
from fe_models.foundation.words import nearest, quoted
from fe_models.meshes.cells.raw_mesh import RawBlock

__all__ = ["GROUNDED", "Draft", "PointElements"]

GROUNDED = "grounded"  #: name of the interfaces at springs and dashpots to the ground

COMPONENTS = "123456"
AXES_DIGITS = 7  #: digits to which axes of nodes in one support must agree
MOST_AXES = 50  #: largest number of different axes of supports; each becomes an interface of the job


@dataclass
class PointElements:
    """Elements at points: masses, springs, dashpots."""

    kind: str
    rows: dict[int, tuple[int, ...]] = field(default_factory=dict)  #: node numbers of each element, by element number


@dataclass
class Draft:
    """Content of the blocks of a deck that have been read so far."""

    where: str
    program: str
    mesh: DeckMesh
    ledger: Ledger
    material: str = ""  #: name of the material whose properties are being read
    materials: dict[str, DeckMaterial] = field(default_factory=dict)
    #: axes as rows, (3, 3), by upper-case name; None: unknown
    orientations: dict[str, Array | None] = field(default_factory=dict)
    used_orientations: set[str] = field(default_factory=set)  #: upper-case names of orientations in use
    nodal_thickness: dict[int, float] = field(default_factory=dict)  #: thickness of shells at each node, by node number
    sheets: list[str] = field(default_factory=list)  #: groups of shells that represent plane elements (CPS, CPE)
    strained: set[str] = field(default_factory=set)  #: groups of plane strain elements (CPE)
    nodal_shells: set[str] = field(default_factory=set)  #: groups of shells whose thickness is only given at nodes
    solids: list[SolidSection] = field(default_factory=list)
    shells: list[ShellSection] = field(default_factory=list)
    lines: list[LineSection] = field(default_factory=list)
    rods: list[RodSection] = field(default_factory=list)
    masses: list[DeckMass] = field(default_factory=list)
    springs: list[DeckSpring] = field(default_factory=list)
    rigid: list[RigidGroup] = field(default_factory=list)
    couplings: list[Coupling] = field(default_factory=list)
    #: terms in the axes of their nodes, and the axes of nodes without own ones as rows (None: basic axes)
    raw_equations: list[tuple[list[tuple[int, int, float]], Array | None]] = field(default_factory=list)
    equations: list[Equation] = field(default_factory=list)
    loads: list[Load] = field(default_factory=list)
    points: dict[str, PointElements] = field(default_factory=dict)  #: elements at points, by upper-case name of the set
    surfaces: dict[str, DeckBlock] = field(default_factory=dict)  #: surfaces, by upper-case name
    rotations: dict[int, int] = field(default_factory=dict)  #: REF NODE of each ROT NODE of *RIGID BODY
    moved: dict[int, Array] = field(default_factory=dict)  #: new positions of nodes that were moved
    #: rotation axis of each node whose component 1 is a rotation
    pilots: dict[int, Array] = field(default_factory=dict)
    pending: dict[str, str] = field(default_factory=dict)  #: parameters of a *COUPLING whose kind follows
    transformed: dict[int, Array] = field(default_factory=dict)  #: axes of a node as rows, (3, 3), by node number
    node_groups: dict[str, IntArray] = field(default_factory=dict)  #: node groups created by the reader, as rows
    #: cell groups created by the reader, as element numbers
    cell_groups: dict[str, IntArray] = field(default_factory=dict)
    face_blocks: list[RawBlock] = field(default_factory=list)
    #: fixed components for each set name, by node number
    held: dict[int, dict[str, set[int]]] = field(default_factory=dict)
    sectioned: list[IntArray] = field(default_factory=list)  #: numbers of elements that have a section

    # --- names of nodes ------------------------------------------------------------------------------------------

    def nodes_of(self, here: str, word: str) -> IntArray:
        """Return the node numbers of a node number, a node set or an element set."""
        return _numbers_of(here, word, "node", self.mesh.node_sets)

    def elements_of(self, here: str, word: str) -> IntArray:
        """Return the element numbers of an element number or an element set."""
        return _numbers_of(here, word, "element", self.mesh.element_sets)

    def points_of(self, word: str) -> PointElements | None:
        """Return the point elements of a set, and stop requiring a section for them; None if there are none."""
        key = word.strip().strip('"').upper()
        found = self.points.pop(key, None)
        members = set(self.mesh.element_sets.get(key, np.zeros(0, np.int64)).tolist())
        for other in list(self.points.values()):
            mine = [number for number in other.rows if number in members]
            if mine and found is None:
                found = PointElements(other.kind)
            if found is not None and found.kind == other.kind:
                found.rows |= {number: other.rows.pop(number) for number in mine}
        return found

    def node_group(self, here: str, numbers: Iterable[int], name: str = "") -> str:
        """Return the name of a group with these nodes: an equal set of the deck, or a new group."""
        wanted = np.unique(np.asarray(list(numbers), dtype=np.int64))
        if name and name.upper() in self.mesh.node_sets and np.array_equal(self.mesh.node_sets[name.upper()], wanted):
            return self.mesh.spelling[f"NSET {name.upper()}"]
        rows = self.mesh.rows_of(wanted)
        if (rows < 0).any():
            raise MeshError(f"{here}: names node {wanted[rows < 0][0]}, which is not in the deck")
        made = f"node_{wanted[0]}" if len(wanted) == 1 else name or f"nodes_{wanted[0]}_and_{len(wanted) - 1}_more"
        taken = {spelt for key, spelt in self.mesh.spelling.items() if key.startswith("NSET ")}
        while made in taken or (made in self.node_groups and not np.array_equal(self.node_groups[made], rows)):
            made += "_"
        self.node_groups[made] = rows
        return made

    def types_of(self, elements: IntArray) -> dict[tuple[str, str], IntArray]:
        """Return the numbers of these elements by (type in the deck, kind)."""
        found: dict[tuple[str, str], IntArray] = {}
        for name, kind, table in self.mesh.elements:
            mine = table[np.isin(table[:, 0], elements), 0]
            if mine.size:
                found[name, kind] = np.concatenate([found.get((name, kind), np.zeros(0, np.int64)), mine])
        return found

    def cell_group(self, name: str, elements: IntArray) -> str:
        """Return the name of a group with these cells: the set with that name if it is equal, or a new group."""
        key = name.upper()
        if key in self.mesh.element_sets and np.array_equal(self.mesh.element_sets[key], np.unique(elements)):
            return self.mesh.spelling[f"ELSET {key}"]
        made = name
        taken = {spelt for key, spelt in self.mesh.spelling.items() if key.startswith("ELSET ")}
        while made in taken or made in self.cell_groups:
            made += "_"
        self.cell_groups[made] = elements
        return made

    def used_nodes(self) -> IntArray:
        """Return the numbers of nodes with independent motion: nodes of elements, and leaders of other nodes."""
        sectioned = np.concatenate(self.sectioned) if self.sectioned else np.zeros(0, np.int64)
        parts = [table[np.isin(table[:, 0], sectioned), 1:].ravel() for _, _, table in self.mesh.elements]
        groups = [mass.nodes for mass in self.masses] + [name for spring in self.springs for name in spring.nodes]
        groups += [link.node for link in self.rigid] + [coupling.node for coupling in self.couplings]
        parts += [self.numbers_of_group(name) for name in groups]
        followers = [self.numbers_of_group(link.followers) for link in self.rigid]
        nodes = np.unique(np.concatenate([np.zeros(0, np.int64), *parts]))
        return np.setdiff1d(nodes, np.concatenate([np.zeros(0, np.int64), *followers]))

    def numbers_of_group(self, name: str) -> IntArray:
        """Return the node numbers in a group, created by the reader or in the deck."""
        if name in self.node_groups:
            return self.mesh.node_numbers[self.node_groups[name]]
        return self.mesh.node_sets[name.upper()]

    # --- at the end ----------------------------------------------------------------------------------------------

    def close(self) -> None:
        """Add elements without section, materials without values and open couplings to the ledger."""
        with_section = np.concatenate(self.sectioned) if self.sectioned else np.zeros(0, np.int64)
        counts: dict[str, int] = {}
        for name, _, table in self.mesh.elements:
            if not table[:, 1:].any():  # elements of an unknown type: their nodes have not been read
                self.ledger.refuse(name, "this element is not known here", count=len(table))
                continue
            n = int((~np.isin(table[:, 0], with_section)).sum())
            if n:
                counts[name] = counts.get(name, 0) + n
        for name, n in counts.items():
            self.ledger.refuse(name, "elements without a section: neither material nor thickness is known", count=n)
        for waiting in self.points.values():
            if waiting.rows:
                why = "elements without a section: neither mass nor stiffness is known"
                self.ledger.refuse(waiting.kind, why, count=len(waiting.rows))
        if self.pending:
            self.ledger.refuse("*COUPLING", "neither *KINEMATIC nor *DISTRIBUTING stands below it")

    def supports_of_groups(self) -> list[Support]:
        """Return the supports: nodes with the same fixed components and names are combined."""
        found: dict[tuple[tuple[str, ...], tuple[int, ...], bytes], list[int]] = {}
        for turned, leader in self.rotations.items():
            for name, about in self.held.pop(turned, {}).items():
                turns = {c + 3 for c in about if c < 3}
                self.held.setdefault(leader, {}).setdefault(name, set()).update(turns)
        for pilot in self.pilots:
            if self.held.pop(pilot, None):
                members = f"mean_rotation_{pilot}_nodes"
                why = f"the angle of node {pilot} is free here; to drive it, put a distributing interface on {members}"
                self.ledger.note("*BOUNDARY", why)
        used = set(self.used_nodes().tolist())
        loose = [node for node in self.held if node not in used]
        if loose:
            why = "supports of nodes that belong to no element, or follow others"
            self.ledger.note("*BOUNDARY", why, count=len(loose))
        for node, by_name in self.held.items():
            if node not in used:
                continue
            components = tuple(sorted(set().union(*by_name.values())))
            axes = b"" if self._are_whole(components) else self._axes_of(node)
            found.setdefault((tuple(sorted(by_name)), components, axes), []).append(node)
        oblique = {axes for *_, axes in found if axes}
        if len(oblique) > MOST_AXES:
            count = sum(len(nodes) for (*_, axes), nodes in found.items() if axes)
            why = f"supports along more than {MOST_AXES} different axes (*TRANSFORM): left out of the interfaces"
            self.ledger.note("*BOUNDARY", why, count=count)
            found = {key: nodes for key, nodes in found.items() if not key[2]}
        supports: list[Support] = []
        for (names, components, axes), nodes in found.items():
            letters = "".join(COMPONENTS[c] for c in components)
            name = names[0] if names != ("",) and names[0] else f"support_{letters}"
            group = self.node_group(self.where, nodes, name)
            label = group if group not in {s.name for s in supports} else f"{group}_{letters}"
            rows = [(x, y, z) for x, y, z in self.transformed[nodes[0]].tolist()] if axes else []
            triad = (rows[0], rows[1], rows[2]) if rows else None
            supports.append(Support(label, group, components, names == (GROUNDED,), triad))
        return supports

    @staticmethod
    def _are_whole(components: tuple[int, ...]) -> bool:
        """Return whether the components contain all translations or none, and all rotations or none."""
        return all(
            not set(part) - set(components) or not set(part) & set(components) for part in ((0, 1, 2), (3, 4, 5))
        )

    def _axes_of(self, node: int) -> bytes:
        """Return the axes of a node, identical for nodes whose axes agree to rounding; empty: basic axes."""
        axes = self.transformed.get(node)
        return b"" if axes is None else (np.round(axes, AXES_DIGITS) + 0.0).tobytes()


def _numbers_of(here: str, word: str, what: str, sets: Mapping[str, IntArray]) -> IntArray:
    word = word.strip().strip('"')
    if word.lstrip("+").isdigit():
        return np.array([int(word)], dtype=np.int64)
    if word.upper() not in sets:
        raise MeshError(f"{here}: unknown {what} set {quoted(word)}{nearest(word, sets)}")
    return sets[word.upper()]
