"""The user's numbers and names of nodes, elements and sets, as in the deck or mesh of the body.

Internally, a node is a row of an array of nodes, and an element is the set of its surface triangles. This record
contains the user's names. It stays with the body through coupling, joining and reduction, and is written to the modal
file. Messages, sensors, tables and exported files take names only from here.
"""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Annotated, Any, Literal

import numpy as np

from fe_models.foundation.arrays import Array, IntArray, frozen
from fe_models.foundation.errors import ArgumentError, BodyError
from fe_models.foundation.presentation import presented
from fe_models.foundation.records import ArrayShape, checked_fields, frozen_copies
from fe_models.foundation.words import nearest, number_list, quoted

__all__ = ["NONE", "NO_NUMBERS", "NamedSet", "Numbering", "node_place", "numbering_side_by_side", "rows_of_numbers"]

NONE = -1  #: number of a node or element without user number, such as the reference node of an interface
SHOWN = 3  #: number of closest user numbers that a message lists
KINDS = ("nodes", "elements")
NO_NUMBERS = frozen(np.zeros(0), np.int64)  #: empty array for unknown numbers


@presented
@frozen_copies
@dataclass(frozen=True, eq=False)
@checked_fields(ArgumentError)
class NamedSet:
    """Set of the user, with the members that the body keeps.

    Parameters
    ----------
    name
        Name of the set.
    kind
        "nodes" or "elements".
    members
        Indices of the nodes of the body, or of the surface triangles of its elements, (n,).
    size
        Number of nodes or elements in the deck or mesh.
    """

    name: str
    kind: Literal["nodes", "elements"]
    members: Annotated[IntArray, ArrayShape(("n",))]
    size: int


@presented
@frozen_copies
@dataclass(frozen=True, eq=False)
@checked_fields(ArgumentError)
class Numbering:
    """The user's numbers of nodes and of elements at the surface, and the user's sets.

    An empty array means that the numbers are unknown. Messages then name nodes by their index, and say so.

    Parameters
    ----------
    nodes
        Number of each node, `NONE` where it has none, (n_nodes,).
    on_skin
        Kind of each row, (n_nodes,): 1 for a point of a skin (of beams or shells) that moves with the node of that
        number, 0 for the node itself; empty: all rows are nodes.
    elements
        Number of the element behind each triangle, (n_tri,).
    instances
        Names that distinguish repeated numbers: instances of parts, or bodies that were joined.
    node_instance
        Instance of each node, `NONE` for none, (n_nodes,).
    element_instance
        Instance of the element of each triangle, `NONE` for none, (n_tri,).
    sets
        The user's sets of nodes and elements.
    """

    nodes: Annotated[IntArray, ArrayShape((None,))] = field(default_factory=lambda: NO_NUMBERS)
    on_skin: Annotated[IntArray, ArrayShape((None,))] = field(default_factory=lambda: NO_NUMBERS)
    elements: Annotated[IntArray, ArrayShape((None,))] = field(default_factory=lambda: NO_NUMBERS)
    instances: tuple[str, ...] = ()
    node_instance: Annotated[IntArray, ArrayShape((None,))] = field(default_factory=lambda: NO_NUMBERS)
    element_instance: Annotated[IntArray, ArrayShape((None,))] = field(default_factory=lambda: NO_NUMBERS)
    sets: tuple[NamedSet, ...] = ()

    def __post_init__(self) -> None:
        put = object.__setattr__
        put(self, "instances", tuple(self.instances))
        put(self, "sets", tuple(self.sets))
        if self.nodes.min(initial=0) < NONE or self.elements.min(initial=0) < NONE:
            raise BodyError("numbering: expected numbers from 0, and -1 where there is none")
        for name, of in (("on_skin", "nodes"), ("node_instance", "nodes"), ("element_instance", "elements")):
            if getattr(self, name).size not in (0, getattr(self, of).size):
                raise BodyError(f"numbering: {name}: expected one for each of the {getattr(self, of).size} {of}")
        for name in ("node_instance", "element_instance"):
            own = getattr(self, name)
            if own.size and (own.min() < NONE or own.max() >= len(self.instances)):
                raise BodyError(f"numbering: {name}: expected -1 to {len(self.instances) - 1}")
        named = [(each.kind, each.name) for each in self.sets]
        if len(set(named)) != len(named):
            twice = next(name for kind, name in named if named.count((kind, name)) > 1)
            raise BodyError(f"numbering: two sets have the name {twice!r}")

    @property
    def is_empty(self) -> bool:
        """Whether no numbers and no sets are known."""
        return not (self.nodes.size or self.elements.size or self.sets)

    def require_fit(self, where: str, n_nodes: int, n_triangles: int) -> None:
        """Raise `BodyError` unless the arrays have these numbers of nodes and triangles."""
        for name, n in (("nodes", n_nodes), ("elements", n_triangles)):
            if getattr(self, name).size not in (0, n):
                raise BodyError(f"{where}: numbering: {name}: expected ({n},) or none, got {getattr(self, name).shape}")
        for each in self.sets:
            n = n_nodes if each.kind == "nodes" else n_triangles
            if each.members.size and (each.members.min() < 0 or each.members.max() >= n):
                raise BodyError(f"{where}: numbering: set {each.name!r}: members outside 0..{n - 1}")

    # Numbers to names -------------------------------------------------------------------------------------------------

    def node_name(self, row: int) -> str:
        """Return the user's name of a node: "12", "PART-1-1.12", or "index 7" (its row) if it has no number."""
        if not self.nodes.size or self.nodes[row] == NONE:
            return f"index {row}"
        return self._name(int(self.nodes[row]), self.node_instance, row)

    def called(self, row: int) -> str:
        """Return the name of a node for messages: its `node_name`, or its row if no node has a number."""
        return self.node_name(int(row)) if self.nodes.size else str(int(row))

    def element_name(self, triangle: int) -> str:
        """Return the user's name of the element of a triangle, or "of triangle 7" if it has no number."""
        if not self.elements.size or self.elements[triangle] == NONE:
            return f"of triangle {triangle}"
        return self._name(int(self.elements[triangle]), self.element_instance, triangle)

    def _name(self, number: int, instance: IntArray, row: int) -> str:
        at = int(instance[row]) if instance.size else NONE
        return str(number) if at == NONE else f"{self.instances[at]}.{number}"

    @property
    def set_names(self) -> tuple[str, ...]:
        """Names of the sets, node sets first, each name once."""
        of_nodes = [each.name for each in self.sets if each.kind == "nodes"]
        return tuple(dict.fromkeys([*of_nodes, *(each.name for each in self.sets)]))

    # Names to rows ----------------------------------------------------------------------------------------------------

    def rows_of_node(self, where: str, node: int | str) -> IntArray:
        """Return the rows of a node: first the node itself, then the skin points that move with it, (n,) with n >= 1.

        Parameters
        ----------
        where
            Start of the error message: where the user named the node.
        node
            Number of the node, or "INSTANCE.number" if several instances have this number.

        Raises
        ------
        BodyError
            If the body has no node numbers, there is no such node, or several instances have it.
        """
        rows = self._found(where, "node", node, self.nodes, self.node_instance)
        if self.on_skin.size:
            rows = rows[np.argsort(self.on_skin[rows], kind="stable")]
        return rows

    def triangles_of_element(self, where: str, element: int | str) -> IntArray:
        """Return the triangles of an element, (n,) with n >= 1; raise `BodyError` if it has none on the surface."""
        return self._found(where, "element", element, self.elements, self.element_instance)

    def named_set(self, where: str, name: str) -> NamedSet:
        """Return the set with this name, node sets first; raise `BodyError` if there is none or it is empty."""
        for kind in KINDS:
            for each in self.sets:
                if (each.kind, each.name) == (kind, name):
                    if not each.size:
                        raise BodyError(f"{where}: set {name!r} is empty in the mesh or deck; name another")
                    if not each.members.size:
                        raise BodyError(
                            f"{where}: set {name!r}: none of its {each.size} {kind} is kept in the body; keep them: "
                            f'keep = ["{name}"] in the [body] of the job, keep= in Python'
                        )
                    return each
        known = f"{nearest(name, self.set_names)}" if self.sets else "; the body knows no sets"
        raise BodyError(f"{where}: no set {quoted(name)}{known}")

    def _found(self, where: str, what: str, asked: int | str, numbers: IntArray, instance: IntArray) -> IntArray:
        if not numbers.size:
            raise BodyError(
                f"{where}: {what} {asked}: the body knows no numbers of {what}s (its file is older, or it was made "
                "without a mesh); give a position, or reduce it again from its mesh"
            )
        prefix, number = split_name(where, what, asked)
        found = np.flatnonzero(numbers == number)
        if prefix is not None:
            if prefix not in self.instances:
                near = nearest(prefix, self.instances)
                raise BodyError(f"{where}: {what} {asked!r}: no instance {quoted(prefix)}{near}")
            found = found[instance[found] == self.instances.index(prefix)] if instance.size else found
        if not found.size:
            raise BodyError(f"{where}: no {what} {asked}{self._near(what, number, numbers, instance)}")
        if instance.size and len(np.unique(instance[found])) > 1:
            names = dict.fromkeys(self._name(number, instance, int(row)) for row in found)
            raise BodyError(
                f"{where}: {what} {asked} is there {len(names)} times; name the instance: "
                f"{what} = {' or '.join(quoted(name) for name in list(names)[:6])}"
            )
        return np.asarray(found)

    def _near(self, what: str, number: int, numbers: IntArray, instance: IntArray) -> str:
        """Describe the range of known numbers, and the closest numbers."""
        rows = np.flatnonzero(numbers != NONE)
        if not rows.size:
            return f": no {what} that is kept has a number"
        order = rows[np.argsort(np.abs(numbers[rows] - number), kind="stable")]
        names = list(dict.fromkeys(self._name(int(numbers[row]), instance, int(row)) for row in order[:64]))[:SHOWN]
        n = len(np.unique(numbers[rows]))
        return (
            f" among the {n} that are kept, from {numbers[rows].min()} to {numbers[rows].max()}; nearest: "
            f"{', '.join(names)}. Others are kept where they are named: keep = [{number}] in the [body] of the job, "
            "keep= in Python"
            if what == "node"
            else f" behind the surface, whose {n} go from {numbers[rows].min()} to {numbers[rows].max()}; nearest: "
            f"{', '.join(names)}"
        )

    # Numberings of derived bodies -------------------------------------------------------------------------------------

    def with_nodes_added(self, n: int) -> "Numbering":
        """Return the numbering with n more nodes at the end without user numbers."""
        given = {"nodes": NONE, "on_skin": 0, "node_instance": NONE}
        known = {name: getattr(self, name) for name in given if getattr(self, name).size}
        extended: dict[str, Any] = {name: np.append(a, np.full(n, given[name])) for name, a in known.items()}
        return replace(self, **extended)

    def of_rows(self, rows: IntArray, n_nodes: int) -> "Numbering":
        """Return the numbering of the given rows of n_nodes, in this order, (n,); triangles do not change.

        Node numbers that equal the indices of the rows are left out.
        """
        place = np.full(n_nodes, NONE)
        place[rows] = np.arange(len(rows))
        sets = []
        for each in self.sets:
            if each.kind == "nodes":
                members = place[each.members]
                each = replace(each, members=members[members >= 0])
            sets.append(each)
        known = {name: getattr(self, name) for name in ("nodes", "on_skin", "node_instance")}
        taken = {name: a[rows] if a.size else a for name, a in known.items()}
        if np.array_equal(taken["nodes"], rows) and not self.instances and not taken["on_skin"].any():
            taken |= {"nodes": NO_NUMBERS, "on_skin": NO_NUMBERS}
        return replace(self, **taken, sets=tuple(sets))

    def with_instances(self, instances: tuple[str, ...], step: int) -> "Numbering":
        """Split numbers that contain the instance: instance k had k step added to its numbers.

        Larger numbers than those of the last instance belong to the assembly itself, and to no instance.
        """
        if not instances or not step:
            return self
        told: dict[str, IntArray] = {}
        for name, of in (("node_instance", "nodes"), ("element_instance", "elements")):
            numbers = getattr(self, of)
            if numbers.size:
                at = np.where(numbers == NONE, NONE, numbers // step)
                told[name] = np.where(at < len(instances), at, NONE)
                told[of] = np.where(numbers == NONE, NONE, numbers % step)
        return replace(self, instances=instances, **told)  # type: ignore[arg-type]


def split_name(where: str, what: str, asked: int | str) -> tuple[str | None, int]:
    """Split 12, "12" or "PART-1-1.12" into the instance (None if not given) and the number."""
    if isinstance(asked, bool) or not isinstance(asked, int | np.integer | str):
        raise BodyError(f'{where}: {what}: expected a whole number, or text "INSTANCE.number", got {asked!r}')
    prefix, dot, number = str(asked).rpartition(".")
    if not number.strip().lstrip("-").isdigit():
        raise BodyError(f'{where}: {what}: expected a whole number, or text "INSTANCE.number", got {asked!r}')
    return (prefix if dot else None), int(number)


def numbering_side_by_side(
    parts: Sequence[tuple[str, Numbering, int, int]], *, share_numbers: bool = False
) -> Numbering:
    """Join the numberings of several bodies into one.

    Parameters
    ----------
    parts
        Name, numbering, number of nodes and number of triangles of each body.
    share_numbers
        True if the bodies come from one deck: an equal number then means the same node, and an equal set name the same
        set. False: names of bodies distinguish equal numbers.
    """
    n_nodes, n_triangles = np.cumsum([0, *(n for _, _, n, _ in parts)]), np.cumsum([0, *(n for *_, n in parts)])
    joined: dict[str, IntArray] = {}
    for name, filling in (("nodes", NONE), ("on_skin", 0), ("elements", NONE)):
        counts = [n if name == "elements" else m for _, _, m, n in parts]
        arrays = [getattr(numbering, name) for _, numbering, *_ in parts]
        if any(a.size for a in arrays):
            filled = [a if a.size else np.full(n, filling) for a, n in zip(arrays, counts, strict=True)]
            joined[name] = np.concatenate(filled)
    if "on_skin" in joined and "nodes" not in joined:
        del joined["on_skin"]
    prefixed = {} if share_numbers else distinguished_instances(parts, joined)
    sets: dict[tuple[str, str], NamedSet] = {}
    names = [(each.kind, each.name) for part in parts for each in part[1].sets]
    for (body, numbering, *_), node, triangle in zip(parts, n_nodes, n_triangles, strict=False):
        for each in numbering.sets:
            moved = each.members + (node if each.kind == "nodes" else triangle)
            is_twice = names.count((each.kind, each.name)) > 1 and not share_numbers
            name = f"{body}.{each.name}" if is_twice else each.name
            key = each.kind, name
            before = sets.get(key)
            members = moved if before is None else np.concatenate([before.members, moved])
            sets[key] = NamedSet(name, each.kind, members, each.size + (0 if before is None else before.size))
    return Numbering(**joined, **prefixed, sets=tuple(sets.values()))  # type: ignore[arg-type]


def distinguished_instances(
    parts: Sequence[tuple[str, Numbering, int, int]], joined: Mapping[str, IntArray]
) -> dict[str, object]:
    """Return the instances of nodes and triangles if several bodies have equal numbers; else an empty dict."""
    had = any(part[1].instances for part in parts)
    if not had and not any(overlap([part[1] for part in parts], name) for name in ("nodes", "elements")):
        return {}
    instances: list[str] = []
    found: dict[str, list[IntArray]] = {"node_instance": [], "element_instance": []}
    for body, numbering, n_nodes, n_triangles in parts:
        own = [f"{body}.{name}" for name in numbering.instances] or [body]
        for name, numbers, n in (
            ("node_instance", numbering.nodes, n_nodes),
            ("element_instance", numbering.elements, n_triangles),
        ):
            at = getattr(numbering, name) if numbering.instances else np.zeros(n, np.int64)
            at = at if at.size else np.full(n, NONE)
            has = (at >= 0) & (numbers != NONE if numbers.size else False)
            found[name].append(np.where(has, at + len(instances), NONE))
        instances += own
    arrays = {
        name: np.concatenate(found[name])
        for name, of in (("node_instance", "nodes"), ("element_instance", "elements"))
        if of in joined
    }
    return {"instances": tuple(instances), **arrays}


def overlap(numberings: Iterable[Numbering], name: str) -> bool:
    """Return whether two of the numberings have a common number."""
    own = [np.unique(a[a != NONE]) for a in (getattr(each, name) for each in numberings)]
    together = np.concatenate([*own, np.zeros(0, np.int64)])
    return len(np.unique(together)) < len(together)


def node_place(numbering: Numbering, nodes: Array, row: int) -> str:
    """Describe a node by its name and position, for messages."""
    return f"node {numbering.node_name(row)} at [{number_list(nodes[row])}]"


def rows_of_numbers(numbers: IntArray, order: IntArray, wanted: IntArray) -> IntArray:
    """Return the rows of node numbers, which `order` sorts; -1 for a missing number."""
    ordered = numbers[order]
    at = np.minimum(np.searchsorted(ordered, wanted), len(ordered) - 1)
    return np.where(ordered[at] == wanted, order[at], -1)
