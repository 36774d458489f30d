"""A deck of Abaqus or CalculiX while it is read: the content of its blocks so far."""

from collections.abc import Iterable
from dataclasses import dataclass, field

import numpy as np

from fe_models.errors import MeshError
from fe_models.files.abaqus import DeckMesh
from fe_models.files.abaqus_deck import DeckBlock
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
AXES_DIGITS = 7  #: to which the axes of nodes that are held together are the same
MOST_AXES = 50  #: different axes of supports, each an interface of the job


@dataclass
class PointElements:
    """Elements of points: masses, springs, dashpots."""

    kind: str
    rows: dict[int, tuple[int, ...]] = field(default_factory=dict)  #: number -> numbers of its nodes


@dataclass
class Draft:
    """Content of the blocks of a deck that have been read so far."""

    where: str
    program: str
    mesh: DeckMesh
    ledger: Ledger
    material: str = ""  #: whose properties are being read
    materials: dict[str, DeckMaterial] = field(default_factory=dict)
    orientations: dict[str, Array | None] = field(default_factory=dict)  #: by name in upper case, (3, 3); None: unknown
    used_orientations: set[str] = field(default_factory=set)  #: names in upper case
    nodal_thickness: dict[int, float] = field(default_factory=dict)  #: of shells, by node number
    sheets: list[str] = field(default_factory=list)  #: groups of shells that are plane elements (CPS, CPE)
    strained: set[str] = field(default_factory=set)  #: those in plane strain (CPE)
    nodal_shells: set[str] = field(default_factory=set)  #: groups of shells that have their thickness from nodes alone
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
    points: dict[str, PointElements] = field(default_factory=dict)  #: by set in upper case
    surfaces: dict[str, DeckBlock] = field(default_factory=dict)  #: by name in upper case
    rotations: dict[int, int] = field(default_factory=dict)  #: *RIGID BODY: number of ROT NODE -> of REF NODE
    moved: dict[int, Array] = field(default_factory=dict)  #: nodes put elsewhere than the deck has them
    pilots: dict[int, Array] = field(default_factory=dict)  #: nodes whose component 1 is a rotation -> about which axis
    pending: dict[str, str] = field(default_factory=dict)  #: parameters of a *COUPLING whose kind comes below
    transformed: dict[int, Array] = field(default_factory=dict)  #: node number -> its own axes as rows, (3, 3)
    node_groups: dict[str, IntArray] = field(default_factory=dict)  #: groups added here, rows
    cell_groups: dict[str, IntArray] = field(default_factory=dict)  #: groups added here, element numbers
    face_blocks: list[RawBlock] = field(default_factory=list)
    held: dict[int, dict[str, set[int]]] = field(default_factory=dict)  #: node number -> set name -> components
    sectioned: list[IntArray] = field(default_factory=list)  #: numbers of elements that have a section

    # --- names of nodes ------------------------------------------------------------------------------------------

    def nodes_of(self, here: str, word: str) -> IntArray:
        """Return the numbers of the nodes of a node number or of a set (of nodes, or of the nodes of elements)."""
        word = word.strip().strip('"')
        if word.lstrip("+").isdigit():
            return np.array([int(word)], dtype=np.int64)
        key = word.upper()
        if key not in self.mesh.node_sets:
            raise MeshError(f"{here}: unknown node set {quoted(word)}{nearest(word, self.mesh.node_sets)}")
        return self.mesh.node_sets[key]

    def elements_of(self, here: str, word: str) -> IntArray:
        """Return the numbers of the elements of an element number or set."""
        word = word.strip().strip('"')
        if word.lstrip("+").isdigit():
            return np.array([int(word)], dtype=np.int64)
        key = word.upper()
        if key not in self.mesh.element_sets:
            raise MeshError(f"{here}: unknown element set {quoted(word)}{nearest(word, self.mesh.element_sets)}")
        return self.mesh.element_sets[key]

    def points_of(self, word: str) -> PointElements | None:
        """Return the elements of points of a set, and take them out of those that wait for a section; None: none."""
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
        """Return the name of a group of these nodes: a set of the deck that is the same, or one made here."""
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
        """Return (type in the deck, kind) -> numbers of these elements."""
        found: dict[tuple[str, str], IntArray] = {}
        for name, kind, table in self.mesh.elements:
            mine = table[np.isin(table[:, 0], elements), 0]
            if mine.size:
                found[name, kind] = np.concatenate([found.get((name, kind), np.zeros(0, np.int64)), mine])
        return found

    def cell_group(self, name: str, elements: IntArray) -> str:
        """Return the name of a group of these cells: the set of that name if it is the same, or one made here."""
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
        """Return the numbers of nodes that have a motion of their own: those of elements, and leaders of others."""
        sectioned = np.concatenate(self.sectioned) if self.sectioned else np.zeros(0, np.int64)
        parts = [table[np.isin(table[:, 0], sectioned), 1:].ravel() for _, _, table in self.mesh.elements]
        groups = [mass.nodes for mass in self.masses] + [name for spring in self.springs for name in spring.nodes]
        groups += [link.node for link in self.rigid] + [coupling.node for coupling in self.couplings]
        parts += [self.numbers_of_group(name) for name in groups]
        followers = [self.numbers_of_group(link.followers) for link in self.rigid]
        nodes = np.unique(np.concatenate([np.zeros(0, np.int64), *parts]))
        return np.setdiff1d(nodes, np.concatenate([np.zeros(0, np.int64), *followers]))

    def numbers_of_group(self, name: str) -> IntArray:
        """Return the numbers of the nodes of a group, made here or of the deck."""
        if name in self.node_groups:
            return self.mesh.node_numbers[self.node_groups[name]]
        return self.mesh.node_sets[name.upper()]

    # --- at the end ----------------------------------------------------------------------------------------------

    def close(self) -> None:
        """Count elements without a section, materials without numbers, and couplings left open."""
        with_section = np.concatenate(self.sectioned) if self.sectioned else np.zeros(0, np.int64)
        counts: dict[str, int] = {}
        for name, _, table in self.mesh.elements:
            if not table[:, 1:].any():  # of an unknown type, so that its nodes have not been read
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
        """Return the supports: nodes held in the same components under the same names together."""
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
        """Whether these are all translations or none, and all rotations or none: the same along any axes."""
        return all(
            not set(part) - set(components) or not set(part) & set(components) for part in ((0, 1, 2), (3, 4, 5))
        )

    def _axes_of(self, node: int) -> bytes:
        """Return the axes of a node, equal for nodes whose axes are but for roundoff; empty: basic axes."""
        axes = self.transformed.get(node)
        return b"" if axes is None else (np.round(axes, AXES_DIGITS) + 0.0).tobytes()
