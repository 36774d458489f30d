"""Addresses of places on a reduced body: a node, element or set by the user's number or name, or a position."""

from dataclasses import dataclass
from typing import Any

import numpy as np

from cms.errors import BodyError
from cms.reduced_body.reduced_body import ReducedBody
from fe_models.body.kept_nodes import TOLERANCE
from fe_models.foundation.arrays import Array, IntArray, frozen
from fe_models.foundation.words import quoted

__all__ = ["KINDS_OF_ADDRESS", "Address", "FoundNodes"]

KINDS_OF_ADDRESS = ("node", "element", "set", "position")
NEAREST = 3  #: nodes that a message names


@dataclass(frozen=True, eq=False)
class FoundNodes:
    """The kept nodes that an address means."""

    asked: str  #: the address in words
    rows: IntArray  #: rows of `ReducedBody.nodes`, (n,), n >= 1; of a node: itself, or the points of the skin it moves
    distance: float  #: from the position asked for to the node; 0 where a number or name was given
    names: tuple[str, ...]  #: what the user calls them, (n,)
    place: Array  #: mean of their undeformed places in mesh axes, (3,) [m]

    def words(self) -> str:
        """Say which place is taken, and how far it is from the one asked for."""
        x = ", ".join(f"{value:.6g}" for value in self.place)
        if len(self.rows) == 1 and self.asked == f"node {self.names[0]}":
            return f"{self.asked} at [{x}]"
        if len(self.rows) == 1:
            return f"{self.asked}: node {self.names[0]} at [{x}]" + (
                f", {self.distance:.3g} away" if self.asked.startswith("[") else ""
            )
        return f"{self.asked}: {len(self.rows)} nodes about [{x}]"


@dataclass(frozen=True, eq=False)
class Address:
    """One place on a body: exactly one of node, element, set and position.

    Raises
    ------
    BodyError
        If there are none or several.
    """

    node: int | str | None = None  #: the user's number; "INSTANCE.number" where instances have the same numbers
    element: int | str | None = None  #: likewise: the kept nodes on the surface that it made
    set: str | None = None  #: name of a set: those of its nodes, or of its elements', that are kept
    position: Any = None  #: in mesh axes, (3,) [m]: the kept node there
    tolerance: float = TOLERANCE  #: how far that node may be from the position, of the size of the body

    def __post_init__(self) -> None:
        if self.position is not None:
            position = np.asarray(self.position, dtype=float)
            if position.shape != (3,) or not np.isfinite(position).all():
                raise BodyError(f"place on a body: position: expected [x, y, z], got {self.position!r}")
            object.__setattr__(self, "position", frozen(position))
        given = [kind for kind in KINDS_OF_ADDRESS if getattr(self, kind) is not None]
        if len(given) != 1:
            raise BodyError(
                f"place on a body: expected exactly one of {', '.join(KINDS_OF_ADDRESS)}, got "
                f"{' and '.join(given) or 'none'}"
            )
        if not 0 <= self.tolerance < np.inf:
            raise BodyError(f"place on a body: tolerance: expected a number from 0, got {self.tolerance!r}")

    @property
    def kind(self) -> str:
        """Which of them it is."""
        return next(kind for kind in KINDS_OF_ADDRESS if getattr(self, kind) is not None)

    def __str__(self) -> str:
        if self.kind == "position":
            return f"[{', '.join(f'{x:.6g}' for x in self.position)}]"
        value = getattr(self, self.kind)
        return f"{self.kind} {quoted(value) if self.kind == 'set' else value}"

    def find(self, reduced: ReducedBody, where: str, *, of_stress: bool = False, body: str = "") -> FoundNodes:
        """Return the kept nodes that are meant.

        Parameters
        ----------
        reduced
            The body.
        where
            Who asks, for messages: "sensor 'tip'".
        of_stress
            Whether only points with stress count. Nodes of beams and shells have none, but the points of the skin that
            they move: all of these are meant then.
        body
            What the body is called in messages; "": its own name.

        Raises
        ------
        BodyError
            If there is no such node, element or set in the body, or no kept node stands at the position: with the
            nearest ones, and how to keep what is missing.
        """
        where = f"{where}: body {body or reduced.name!r}"
        distance = 0.0
        if self.kind == "node":
            assert self.node is not None
            rows = reduced.numbering.rows_of_node(where, self.node)
            rows = rows if of_stress else own_rows(reduced, rows)
        elif self.kind == "element":
            assert self.element is not None
            triangles = reduced.numbering.triangles_of_element(where, self.element)
            rows = np.unique(reduced.surface[triangles])
        elif self.kind == "set":
            assert self.set is not None
            named = reduced.numbering.named_set(where, self.set)
            rows = named.members if named.kind == "nodes" else np.unique(reduced.surface[named.members])
        else:
            rows, distance = self.nearest_row(reduced, where, has_stress(reduced) if of_stress else None)
        if of_stress and self.kind != "position":
            asked, rows = rows, rows[has_stress(reduced)[rows]]
            if not len(rows):
                names = ", ".join(reduced.node_name(int(row)) for row in asked[:NEAREST])
                raise BodyError(
                    f"{where}: {self} has no stress in its file (node {names}): no solid or skin is there, or the file "
                    "holds no stress modes; name a stress point, or a node on the surface"
                )
        place = reduced.frame.origin + reduced.frame.axes @ reduced.nodes[rows].mean(axis=0)
        return FoundNodes(str(self), rows, distance, tuple(reduced.node_name(int(row)) for row in rows), place)

    def nearest_row(self, reduced: ReducedBody, where: str, among: np.ndarray | None) -> tuple[IntArray, float]:
        """Return the kept node nearest to the position, (1,), among those that count, and its distance."""
        frame, nodes = reduced.frame, reduced.nodes
        if not len(nodes):
            raise BodyError(f"{where}: it has no nodes; its place at {self} is not known")
        away = np.linalg.norm(nodes - (self.position - frame.origin) @ frame.axes, axis=1)
        if among is not None and among.any():
            away = np.where(among, away, np.inf)
        order = np.argsort(away, kind="stable")
        size = float(np.linalg.norm(np.ptp(nodes, axis=0)))
        nearest = float(away[order[0]])
        if nearest > self.tolerance * size:
            near = []
            for row in order[:NEAREST]:
                x = ", ".join(f"{value:.6g}" for value in frame.origin + frame.axes @ nodes[row])
                near.append(f"node {reduced.node_name(int(row))} at [{x}], {away[row]:.3g} away")
            raise BodyError(
                f"{where}: no node that its file keeps is at {self}, within {self.tolerance:g} of its size {size:.4g}; "
                f"nearest: {'; '.join(near)}. Keep the node there (keep = [...] in the [body] of its job, keep= in "
                "Python), name one of these, or allow a greater distance by tolerance"
            )
        same = np.flatnonzero(away == away[order[0]])  # copies of a node: that with rotations before the others
        if reduced.kept is not None and len(same) > 1:
            same = np.concatenate([np.intersect1d(same, reduced.kept.nodes), same])
        return np.array([same[0]]), nearest


def own_rows(reduced: ReducedBody, rows: IntArray) -> IntArray:
    """Return the node itself, with rotations where a copy has them; where only its skin is kept, that."""
    flags = reduced.numbering.on_skin
    own = rows[flags[rows] == 0] if flags.size else rows
    if not len(own):
        return rows
    with_rotation = own if reduced.kept is None else np.intersect1d(own, reduced.kept.nodes)
    return (with_rotation if len(with_rotation) else own)[:1]


def has_stress(reduced: ReducedBody) -> np.ndarray:
    """Return which kept nodes have stress of any mode, (n_kept,) bool; all where there is no mode at all."""
    if reduced.stress is None or not reduced.n_q:
        return np.full(len(reduced.nodes), reduced.stress is not None)
    return np.asarray(np.abs(reduced.stress).max(axis=(1, 2)) > 0)
