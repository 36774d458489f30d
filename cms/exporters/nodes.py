"""The nodes of a body as formats of multibody programs want them: numbered, the places of its interfaces among them."""

from dataclasses import dataclass

import numpy as np

from cms.reduced_body.reduced_body import ReducedBody
from fe_models.foundation.arrays import Array, IntArray

__all__ = ["NodeList", "all_nodes", "interface_nodes", "reference_row"]


@dataclass(frozen=True, eq=False)
class NodeList:
    """Nodes in B with the motion of each for a unit of every mode."""

    numbers: IntArray  #: (n,), from 1
    positions: Array  #: (n, 3) [m]
    Phi: Array  #: translation, (n, 3, n_q)
    Psi: Array  #: rotation, (n, 3, n_q) [1/m]; zero where it is not known
    has_rotation: np.ndarray  #: whether it is known, (n,)
    of_interface: dict[str, int]  #: row of the reference point of each interface

    def notes(self) -> tuple[str, ...]:
        """Return 'interface left: node 17', one for each, and what is not known of the others."""
        found = tuple(f"interface {name}: node {self.numbers[row]}" for name, row in self.of_interface.items())
        unknown = int((~self.has_rotation).sum())
        if not unknown:
            return found
        return (
            *found,
            f"rotations are known at interfaces and at members of rigid ones; those of {unknown} other nodes are "
            "written as zero: attach frames to the nodes of the interfaces",
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
    """Return the kept nodes, numbered 1, 2, ... as they are kept, and then reference points that are none of them.

    Members of a rigid interface turn with it; so does its reference node. The rotation of other nodes is not on record.
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
    return NodeList(
        np.arange(1, n + len(extra) + 1),
        np.concatenate([body.nodes, added.positions[extra]]),
        np.concatenate([body.Phi, added.Phi[extra]]),
        np.concatenate([Psi, added.Psi[extra]]),
        np.concatenate([known, added.has_rotation[extra]]),
        rows,
    )


def reference_row(body: ReducedBody, k: int) -> int | None:
    """Return the kept node that is the reference point of an interface: it lies there and moves with it, to the bit."""
    interface = body.interfaces[k]
    if interface.kind == "nodes" and not (len(interface.members) == 1 and interface.has_rotation):
        return None
    same = (body.nodes == interface.position).all(axis=1) & (body.Phi == interface.Psi[:3]).all(axis=(1, 2))
    found = np.flatnonzero(same)
    return int(found[-1]) if len(found) else None
