"""The nodes of a body in the form that multibody formats need: numbered, including the interface points."""

from dataclasses import dataclass

import numpy as np

from cms.body.reduced_body import ReducedBody
from fe_models.foundation.arrays import Array, IntArray
from fe_models.meshes.numbering import NONE

__all__ = ["NodeList", "all_nodes", "interface_nodes", "reference_row", "user_numbers"]

MOST = 99_999_999  #: largest node number: eight digits, which all formats can hold


@dataclass(frozen=True, eq=False)
class NodeList:
    """Nodes in B, with their motion for a unit value of each mode."""

    numbers: IntArray  #: positive node numbers, (n,)
    positions: Array  #: positions, (n, 3) [m]
    Phi: Array  #: translations, (n, 3, n_q)
    Psi: Array  #: rotations, (n, 3, n_q) [1/m]; zero if unknown
    has_rotation: np.ndarray  #: whether the rotation of each node is known, (n,) bool
    of_interface: dict[str, int]  #: row of the node at the reference point of each interface
    words: tuple[str, ...] = ()  #: notes about the origin of the numbers

    def notes(self) -> tuple[str, ...]:
        """Return 'interface left: node 17' for each interface, and a note about nodes with unknown rotations."""
        at = (f"interface {name}: node {self.numbers[row]}" for name, row in self.of_interface.items())
        found = (*self.words, *at)
        unknown = int((~self.has_rotation).sum())
        if not unknown:
            return found
        return (
            *found,
            "rotations are known at interfaces, at members of rigid interfaces and at nodes kept with rotations; those "
            f"of {unknown} other nodes are written as zero: attach frames to the nodes of the interfaces",
        )


def interface_nodes(body: ReducedBody) -> NodeList:
    """Return the reference points of the interfaces, numbered 1, 2, ... in their order."""
    n, q = len(body.interfaces), body.n_q
    Psi = np.array([interface.Psi for interface in body.interfaces]).reshape(n, 6, q)
    return NodeList(
        np.arange(1, n + 1),
        np.array([interface.position for interface in body.interfaces]).reshape(n, 3),
        Psi[:, :3],
        Psi[:, 3:],
        np.array([interface.has_rotation for interface in body.interfaces], dtype=bool),
        {interface.name: row for row, interface in enumerate(body.interfaces)},
    )


def all_nodes(body: ReducedBody) -> NodeList:
    """Return the kept nodes, numbered as in the user's mesh, followed by reference points that are not kept nodes.

    If these numbers are missing or repeated, nodes are numbered 1, 2, ... (`user_numbers`). Rotations are known for
    members and reference nodes of rigid interfaces, and for nodes that are kept with rotations.
    """
    n, q = len(body.nodes), body.n_q
    added = interface_nodes(body)
    Psi, known = np.zeros((n, 3, q)), np.zeros(n, dtype=bool)
    rows: dict[str, int] = {}
    extra: list[int] = []
    for k, interface in enumerate(body.interfaces):
        at = reference_row(body, k)
        if interface.has_rotation:
            turning = [] if interface.kind != "rigid" else interface.members.tolist()
            turning += [] if at is None else [at]
            Psi[turning], known[turning] = interface.Psi[3:], True
        if at is None:
            rows[interface.name] = n + len(extra)
            extra.append(k)
        else:
            rows[interface.name] = at
    if body.kept is not None:
        turning_too = [k for k, word in enumerate(body.kept.source) if word != "unknown"]
        at_nodes = body.kept.nodes[turning_too]
        fresh = ~known[at_nodes]
        Psi[at_nodes[fresh]] = body.kept.rotation[turning_too][fresh]
        known[at_nodes] = True
    numbers, words = user_numbers(body, len(extra))
    return NodeList(
        numbers,
        np.concatenate([body.nodes, added.positions[extra]]),
        np.concatenate([body.Phi, added.Phi[extra]]),
        np.concatenate([Psi, added.Psi[extra]]),
        np.concatenate([known, added.has_rotation[extra]]),
        rows,
        words,
    )


def user_numbers(body: ReducedBody, n_more: int = 0) -> tuple[IntArray, tuple[str, ...]]:
    """Return numbers for the kept nodes and for n_more further points, and notes about their origin.

    These are the user's numbers if they are unique; nodes without number (reference points) get the next numbers after
    the largest. Otherwise the numbers are 1, 2, ..., and a note says so.
    """
    n = len(body.nodes)
    own = body.numbering.nodes
    plain = np.arange(1, n + n_more + 1)
    if not own.size:
        return plain, ()
    is_named = own != NONE
    named = own[is_named]
    if len(np.unique(named)) < len(named):
        why = "instances" if body.numbering.instances else "nodes and the points of their skin"
        return plain, (f"nodes are numbered 1, 2, ..., because {why} share numbers of the mesh",)
    n_free = int((~is_named).sum()) + n_more
    if not len(named) or named.min() < 1 or named.max() + n_free > MOST:
        return plain, (f"nodes are numbered 1, 2, ..., because mesh numbers are not within 1 to {MOST - n_free}",)
    numbers = np.concatenate([own, np.full(n_more, NONE)])
    numbers[numbers == NONE] = named.max() + 1 + np.arange(n_free)
    return numbers, ("numbers of nodes are those of the mesh",)


def reference_row(body: ReducedBody, k: int) -> int | None:
    """Return the row of a kept node that moves as the reference point of an interface; None if there is none."""
    interface = body.interfaces[k]
    if interface.kind == "nodes" and not (len(interface.members) == 1 and interface.has_rotation):
        return None
    same = (body.nodes == interface.position).all(axis=1) & (body.Phi == interface.Psi[:3]).all(axis=(1, 2))
    found = np.flatnonzero(same)
    return int(found[-1]) if len(found) else None
