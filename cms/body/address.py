"""Addresses of places on a reduced body: a node, element or set by the user's number or name, or a position."""

from dataclasses import dataclass
from typing import Any

import numpy as np

from cms.body.reduced_body import ReducedBody
from cms.errors import BodyError
from fe_models.body.kept_nodes import TOLERANCE
from fe_models.foundation.arrays import Array, IntArray, frozen
from fe_models.foundation.errors import ArgumentError
from fe_models.foundation.presentation import presented
from fe_models.foundation.records import checked_fields
from fe_models.foundation.words import number_list, quoted

__all__ = ["KINDS_OF_ADDRESS", "Address", "FoundNodes"]

KINDS_OF_ADDRESS = ("node", "element", "set", "position")
NEAREST = 3  #: number of nearby nodes that a message lists


@presented
@dataclass(frozen=True, eq=False)
@checked_fields(ArgumentError)
class FoundNodes:
    """Kept nodes that an address selects.

    Parameters
    ----------
    asked
        Text of the address.
    rows
        Rows of `ReducedBody.nodes`, (n,), n >= 1; for a node: the node, or the skin points that it moves.
    distance
        Distance from the requested position to the node; 0 for a number or name.
    names
        The user's names of the nodes, (n,).
    place
        Mean of the undeformed positions in mesh axes, (3,) [m].
    """

    asked: str
    rows: IntArray
    distance: float
    names: tuple[str, ...]
    place: Array

    def description(self) -> str:
        """Describe the selected place, and its distance from the requested one."""
        x = number_list(self.place)
        if len(self.rows) == 1 and self.asked == f"node {self.names[0]}":
            return f"{self.asked} at [{x}]"
        if len(self.rows) == 1:
            return f"{self.asked}: node {self.names[0]} at [{x}]" + (
                f", {self.distance:.3g} away" if self.asked.startswith("[") else ""
            )
        return f"{self.asked}: {len(self.rows)} nodes about [{x}]"


@dataclass(frozen=True, eq=False)
@checked_fields(ArgumentError)
class Address:
    """Address of a place on a body, given by exactly one of node, element, set and position.

    Parameters
    ----------
    node
        The user's node number; "INSTANCE.number" if several instances have this number.
    element
        The user's number of an element, as for a node; selects the kept nodes of its surface.
    set
        Name of a set; selects its kept nodes, or the kept nodes of its elements.
    position
        Position in mesh axes, (3,) [m]; selects the nearest kept node.
    tolerance
        Largest distance of that node from the position, relative to the size of the body.

    Raises
    ------
    BodyError
        If none or several of them are given.
    """

    node: int | str | None = None
    element: int | str | None = None
    set: str | None = None
    position: Any = None
    tolerance: float = TOLERANCE

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
        """Name of the given field: node, element, set or position."""
        return next(kind for kind in KINDS_OF_ADDRESS if getattr(self, kind) is not None)

    def __str__(self) -> str:
        if self.kind == "position":
            return f"[{', '.join(f'{x:.6g}' for x in self.position)}]"
        value = getattr(self, self.kind)
        return f"{self.kind} {quoted(value) if self.kind == 'set' else value}"

    def find(self, reduced: ReducedBody, where: str, *, of_stress: bool = False, body: str = "") -> FoundNodes:
        """Return the kept nodes that the address selects.

        Parameters
        ----------
        reduced
            The body.
        where
            Where the address is used, for messages: "sensor 'tip'".
        of_stress
            Whether only points with stress count. Nodes of beams and shells have no stress, but the skin points that
            they move have; all of these are then selected.
        body
            Name of the body in messages; "": its own name.

        Raises
        ------
        BodyError
            If the body has no such node, element or set, or no kept node is at the position. The message lists the
            nearest nodes, and says how to keep missing ones.
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
                    f"{where}: {self} has no stress in its file (node {names}): it is not on a solid or skin, or the "
                    "file contains no stress modes; name a stress point, or a node on the surface"
                )
        place = reduced.frame.origin + reduced.frame.axes @ reduced.nodes[rows].mean(axis=0)
        return FoundNodes(str(self), rows, distance, tuple(reduced.node_name(int(row)) for row in rows), place)

    def nearest_row(self, reduced: ReducedBody, where: str, among: np.ndarray | None) -> tuple[IntArray, float]:
        """Return the kept node closest to the position among the eligible ones, (1,), and its distance."""
        frame, nodes = reduced.frame, reduced.nodes
        if not len(nodes):
            raise BodyError(f"{where}: the body has no nodes, so {self} cannot be found")
        away = np.linalg.norm(nodes - (self.position - frame.origin) @ frame.axes, axis=1)
        if among is not None and among.any():
            away = np.where(among, away, np.inf)
        order = np.argsort(away, kind="stable")
        size = float(np.linalg.norm(np.ptp(nodes, axis=0)))
        nearest = float(away[order[0]])
        if nearest > self.tolerance * size:
            near = []
            for row in order[:NEAREST]:
                x = number_list(frame.origin + frame.axes @ nodes[row])
                near.append(f"node {reduced.node_name(int(row))} at [{x}], {away[row]:.3g} away")
            raise BodyError(
                f"{where}: no kept node is at {self}, within {self.tolerance:g} of the body size {size:.4g}; "
                f"nearest: {'; '.join(near)}. Keep the node there (keep = [...] in the [body] of its job, keep= in "
                "Python), name one of these, or allow a greater distance by tolerance"
            )
        same = np.flatnonzero(away == away[order[0]])  # of several copies of a node, prefer the one with rotations
        if reduced.kept is not None and len(same) > 1:
            same = np.concatenate([np.intersect1d(same, reduced.kept.nodes), same])
        return np.array([same[0]]), nearest


def own_rows(reduced: ReducedBody, rows: IntArray) -> IntArray:
    """Return a node, or its copy with rotations if there is one, or its skin points if only these are kept."""
    flags = reduced.numbering.on_skin
    own = rows[flags[rows] == 0] if flags.size else rows
    if not len(own):
        return rows
    with_rotation = own if reduced.kept is None else np.intersect1d(own, reduced.kept.nodes)
    return (with_rotation if len(with_rotation) else own)[:1]


def has_stress(reduced: ReducedBody) -> np.ndarray:
    """Return whether each kept node has stress in some mode, (n_kept,) bool; all True if there are no modes."""
    if reduced.stress is None or not reduced.n_q:
        return np.full(len(reduced.nodes), reduced.stress is not None)
    return np.asarray(np.abs(reduced.stress).max(axis=(1, 2)) > 0)
