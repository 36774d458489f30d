"""Decks that are moved, reflected or renamed, so that several decks can be combined."""

from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

from fe_models.files.decks.deck import Deck, LineSection, Load, Support, Vector
from fe_models.files.decks.ledger import Ledger
from fe_models.foundation.arrays import Array
from fe_models.meshes.cells.raw_mesh import RawBlock

__all__ = ["Motion", "moved_deck", "renamed_deck"]

HALVES = ((0, 1, 2), (3, 4, 5))
#: kind of cells -> order of the nodes of the mirrored cell, so that its volume or normal is the mirrored one
MIRRORED = {
    "vertex": (0,), "line": (0, 1), "triangle": (0, 2, 1), "quad": (0, 3, 2, 1), "triangle6": (0, 2, 1, 5, 4, 3),
    "quad8": (0, 3, 2, 1, 7, 6, 5, 4), "tetra": (0, 2, 1, 3), "pyramid": (0, 3, 2, 1, 4), "wedge": (0, 2, 1, 3, 5, 4),
    "hexahedron": (0, 3, 2, 1, 4, 7, 6, 5), "tetra10": (0, 2, 1, 3, 6, 5, 4, 7, 9, 8),
}  # fmt: skip


@dataclass(frozen=True, eq=False)
class Motion:
    """Motion x -> Q x + t with orthogonal Q, (3, 3): a rigid motion, combined with a reflection if det Q = -1."""

    Q: Array = field(default_factory=lambda: np.eye(3))
    t: Array = field(default_factory=lambda: np.zeros(3))

    @property
    def is_mirror(self) -> bool:
        """Whether the motion includes a reflection."""
        return bool(np.linalg.det(self.Q) < 0)

    @property
    def is_turned(self) -> bool:
        """Whether the motion changes directions."""
        return bool(np.any(np.eye(3) != self.Q))

    def point(self, x: Array) -> Array:
        """Return the new position of a point, (3,)."""
        return np.asarray(self.Q @ x + self.t)


def moved_deck(deck: Deck, motion: Motion, ledger: Ledger, what: str) -> Deck:
    """Return the deck after a motion. Forces transform as vectors, moments as pseudovectors.

    Parameters
    ----------
    what
        Name of the part, for messages.
    """
    if not motion.is_turned and not np.any(motion.t):
        return deck
    Q = motion.Q
    if motion.is_turned and (
        deck.equations
        or not all(_in_halves(link.components) for link in deck.rigid)
        or not all(_in_halves(c.components) and all(_is_whole(w) for _, w in c.members) for c in deck.couplings)
    ):
        why = f"turns {what}, which has equations or links of single components: write it where it lies"
        ledger.refuse("SELOC, SEMPLN", why)
    kinds = {block.kind for block in deck.mesh.blocks}
    if motion.is_mirror and (kinds - set(MIRRORED) or any("outline" in line.shape for line in deck.lines)):
        ledger.refuse("SEMPLN", f"mirrors {what}, which has cells or sections that cannot be mirrored here")
        return deck
    nodes = deck.mesh.nodes @ Q.T + motion.t
    blocks = tuple(_mirrored(b) for b in deck.mesh.blocks) if motion.is_mirror else deck.mesh.blocks
    side = -1.0 if motion.is_mirror else 1.0
    return replace(
        deck,
        mesh=replace(deck.mesh, nodes=nodes, blocks=blocks),
        shells=tuple(
            replace(
                shell,
                direction=_vector(Q @ np.array(shell.direction)),
                layers=tuple(replace(layer, angle=side * layer.angle) for layer in shell.layers),
            )
            for shell in deck.shells
        ),
        lines=tuple(_moved_line(line, Q, side) for line in deck.lines),
        masses=tuple(
            replace(mass, inertia=_rows(Q @ np.array(mass.inertia) @ Q.T), offset=_vector(Q @ np.array(mass.offset)))
            for mass in deck.masses
        ),
        springs=tuple(
            replace(
                spring,
                triad=_right_handed(_rows_of(spring.triad) @ Q.T),
                point=None if spring.point is None else _vector(motion.point(np.array(spring.point))),
            )
            for spring in deck.springs
        ),
        supports=tuple(_moved_support(support, Q) for support in deck.supports),
        loads=tuple(_moved_load(load, Q, side) for load in deck.loads),
    )


def renamed_deck(deck: Deck, prefix: str) -> Deck:
    """Return the deck with a prefix on the names of its groups, materials, links, supports and pressures."""

    def new(name: str) -> str:
        return prefix + name if name else name

    def section(item: Any) -> Any:
        return replace(item, group=new(item.group), material=new(item.material))

    mesh = replace(
        deck.mesh,
        node_sets={new(name): rows for name, rows in deck.mesh.node_sets.items()},
        blocks=tuple(
            replace(block, groups={new(name): rows for name, rows in block.groups.items()})
            for block in deck.mesh.blocks
        ),
    )
    return replace(
        deck,
        mesh=mesh,
        materials={new(name): replace(each, name=new(name)) for name, each in deck.materials.items()},
        solids=tuple(section(each) for each in deck.solids),
        shells=tuple(
            replace(section(each), layers=tuple(replace(layer, material=new(layer.material)) for layer in each.layers))
            for each in deck.shells
        ),
        lines=tuple(section(each) for each in deck.lines),
        rods=tuple(section(each) for each in deck.rods),
        masses=tuple(replace(each, nodes=new(each.nodes)) for each in deck.masses),
        springs=tuple(replace(each, nodes=(new(each.nodes[0]), new(each.nodes[1]))) for each in deck.springs),
        rigid=tuple(
            replace(each, name=new(each.name), node=new(each.node), followers=new(each.followers))
            for each in deck.rigid
        ),
        couplings=tuple(
            replace(
                each,
                name=new(each.name),
                node=new(each.node),
                members=tuple((new(group), weight) for group, weight in each.members),
            )
            for each in deck.couplings
        ),
        equations=tuple(
            replace(each, terms=tuple((new(n), c, a) for n, c, a in each.terms)) for each in deck.equations
        ),
        supports=tuple(replace(each, name=new(each.name), nodes=new(each.nodes)) for each in deck.supports),
        loads=tuple(
            replace(each, forces={new(group): six for group, six in each.forces.items()})
            if each.forces is not None
            else replace(each, name=new(each.name), faces=new(each.faces))
            if each.faces is not None
            else each
            for each in deck.loads
        ),
    )


def _in_halves(components: tuple[int, ...]) -> bool:
    """Return whether the components contain all or no translations, and all or no rotations."""
    return all(set(half) <= set(components) or not set(half) & set(components) for half in HALVES)


def _is_whole(weight: float | tuple[float, ...]) -> bool:
    """Return whether weights are equal along all three axes, and about all three axes."""
    return isinstance(weight, float) or (len(set(weight[:3])) == 1 and len(set(weight[3:])) == 1)


def _mirrored(block: RawBlock) -> RawBlock:
    return replace(block, nodes=block.nodes[:, list(MIRRORED[block.kind])])


def _moved_line(line: LineSection, Q: Array, side: float) -> LineSection:
    """Return a section whose y axis moves with the line; z = x × y changes sides when it is mirrored."""
    shape: dict[str, Any] = dict(line.shape)
    if "shear_center" in shape:
        shape["shear_center"] = [shape["shear_center"][0], side * shape["shear_center"][1]]
    y_axis = None if line.orientation is None else _vector(Q @ np.array(line.orientation))
    return replace(line, orientation=y_axis, shape=shape, offset=(line.offset[0], side * line.offset[1]))


def _moved_support(support: Support, Q: Array) -> Support:
    if support.axes is None and _in_halves(support.components):
        return support
    return replace(support, axes=_right_handed(_rows_of(support.axes) @ Q.T))


def _moved_load(load: Load, Q: Array, side: float) -> Load:
    if load.acceleration is not None:
        return replace(load, acceleration=_vector(Q @ np.array(load.acceleration)))
    if load.forces is None:
        return load
    forces = {}
    for group, six in load.forces.items():
        forces[group] = (*_vector(Q @ np.array(six[:3])), *_vector(side * Q @ np.array(six[3:])))
    return replace(load, forces=forces)


def _rows_of(axes: tuple[Vector, Vector, Vector] | None) -> Array:
    return np.eye(3) if axes is None else np.array(axes)


def _right_handed(rows: Array) -> tuple[Vector, Vector, Vector]:
    """Return right-handed axes as rows, (3, 3): the third row is reversed after a reflection, without any effect."""
    return _rows(rows * np.array([[1.0], [1.0], [np.sign(np.linalg.det(rows))]]))


def _rows(A: Array) -> tuple[Vector, Vector, Vector]:
    return _vector(A[0]), _vector(A[1]), _vector(A[2])


def _vector(v: Array) -> Vector:
    return float(v[0]), float(v[1]), float(v[2])
