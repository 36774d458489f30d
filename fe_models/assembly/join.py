"""Joining of bodies with shared nodes into one body, with common translations and rotations at shared nodes.

(1) the matrices of the parts are placed side by side; every node of the joined body has the components that any part
    gives it, and all six if it leads other nodes
(2) u_parts = S u, where S is a selection matrix, gives K = Sᵀ diag(K_parts) S
(3) constraints are eliminated, u = T u_rest (`fe_models.assembly.constraints`)
(4) rotations without stiffness and without mass are dropped from the dofs

The recovery has a row for each dof of the parts. It also has rows for components that only a constraint gives to a node
(all six of a leader that belongs to no part). Such a node moves in pictures and sensors as its interface does.

Parts have neither interfaces nor multipliers. `fe_models.body.weld` joins coupled bodies, which have both: their dofs
stay apart, and those of one interface follow the other.
"""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
import scipy.sparse as sp

from fe_models.assembly.constraints import (
    Constraint,
    MeanMotion,
    RigidNodes,
    eliminated,
    motion_by_nodes,
    translation_weights,
)
from fe_models.body.elimination import eliminate_dofs
from fe_models.body.fe_body import MULTIPLIER, FEBody, MeanNode, NoNodalRotations, Recovery
from fe_models.body.rigid_motion import MassLoads
from fe_models.body.weld import WeldedModel, side_by_side
from fe_models.foundation.arrays import Array, IntArray
from fe_models.foundation.errors import BodyError
from fe_models.meshes.numbering import NO_NUMBERS, NONE, NamedSet, Numbering, numbering_side_by_side

__all__ = ["Joined", "MasslessNodes", "Part", "join"]


# nodes without elements, as a part of a body: reference nodes without mass, stress and force --------------------------


@dataclass(frozen=True)
class MasslessNodes(NoNodalRotations):
    """Element model of nodes in constraints only (`fe_models.body.fe_body.ElementModel`); all results are zero."""

    n_mesh_dof: int
    n_nodes: int

    @property
    def has_nodal_stress(self) -> bool:
        """Return False, because there is no material at these nodes."""
        return False

    @property
    def has_geometric_stiffness(self) -> bool:
        """Return True; the geometric stiffness is zero."""
        return True

    def mass_gram(self, u: Array) -> Array:
        """Return zero, (4 + 3 k, 4 + 3 k)."""
        n = 4 + 3 * np.shape(u)[1]
        return np.zeros((n, n))

    def nodal_stress(self, u: Array, *, nodes: IntArray | None = None) -> Array:
        """Return zero, (n_nodes, 6, k)."""
        return np.zeros((self.n_nodes, 6, np.shape(u)[1]))

    def mass_forces(self, loads: MassLoads) -> Array:
        """Return zero, (n_mesh_dof, loads.k)."""
        return np.zeros((self.n_mesh_dof, loads.k))

    def internal_forces(self, u: Array, *, nodes: IntArray | None = None) -> Array:
        """Return zero, (n_mesh_dof, k)."""
        return np.zeros((self.n_mesh_dof, np.shape(u)[1]))

    def geometric_stiffness(self, u: Array, loads: MassLoads, Phi: Array) -> Array:
        """Return zero, (loads.k, n, n)."""
        return np.zeros((loads.k, Phi.shape[1], Phi.shape[1]))


# join -----------------------------------------------------------------------------------------------------------------


@dataclass(frozen=True, eq=False)
class Part:
    """Body without interfaces; its first nodes are nodes of the joined body."""

    body: FEBody
    #: for each of the first n nodes of the part, its node in the joined body, (n,); further nodes of the part are skin
    #: nodes without dofs
    nodes: IntArray


@dataclass(frozen=True, eq=False)
class Joined:
    """Joined body, and the position of each given node among its nodes."""

    body: FEBody
    place: IntArray  #: node of the body for each given node, (n_nodes,); -1 if the body does not have it


def join(
    name: str,
    parts: Sequence[Part],
    points: Array,
    constraints: Iterable[Constraint] = (),
    *,
    numbers: IntArray | None = None,
    node_sets: Mapping[str, IntArray] | None = None,
    normal: int | None = None,
) -> Joined:
    """Join parts that share nodes into one body.

    Parameters
    ----------
    name
        Name of the joined body.
    parts
        Parts, in one unit system and with the same axes.
    points
        Positions of all nodes, used or not, (n_nodes, 3) [m].
    constraints
        Constraints between these nodes.
    numbers
        The user's numbers of these nodes, (n_nodes,); None: they have no numbers.
    node_sets
        Sets of these nodes.
    normal
        Axis normal to the plane of a body that becomes planar (`fe_models.body.elimination`). The first node with six
        dofs then keeps its rotations out of the plane, even without mass and stiffness: the body follows them rigidly.

    Raises
    ------
    BodyError
        If there is no part, or a constraint is impossible.
    """
    constraints = list(constraints)
    if not parts:
        raise BodyError(f"body {name!r}: expected parts, got none")
    first_node = np.cumsum([0, *(len(part.body.nodes) for part in parts)])
    place = np.full(len(points), -1)
    for part, begin in zip(reversed(parts), reversed(first_node[:-1].tolist()), strict=True):
        place[part.nodes] = begin + np.arange(len(part.nodes))
    leaders = _leaders(constraints)
    added = leaders[place[leaders] < 0]
    place[added] = first_node[-1] + np.arange(len(added))
    dofs, S, dof_of = _shared_dofs(parts, place, leaders)
    bodies = [part.body for part in parts]
    whole = _side_by_side(name, bodies, S, dofs, np.concatenate([b.nodes for b in bodies] + [points[added]]))
    kept = np.concatenate([_retained_nodes(part, begin, place) for part, begin in zip(parts, first_node, strict=False)])
    whole = replace(whole, numbering=_numbering(parts, added, numbers, node_sets or {}), kept=kept)
    slaves, T_s = eliminated(constraints, points, dof_of, whole.n_dof)
    to_mesh = whole.to_mesh.matrix
    if len(slaves):
        whole = eliminate_dofs(whole, slaves, T_s)
        whole = replace(whole, mean_nodes=_mean_nodes(constraints, points, place, dof_of, to_mesh))
    references = place[[c.node for c in constraints if isinstance(c, MeanMotion)]]
    n_of_parts = sum(len(recovered_dofs(body)) for body in bodies)
    return Joined(_without_idle_dofs(whole, n_of_parts, references, normal), place)


def _mean_nodes(
    constraints: list[Constraint], points: Array, place: IntArray, dof_of: IntArray, to_mesh: sp.csr_array
) -> tuple[MeanNode, ...]:
    """Return the record of each mean motion of translations, for its second order (the closest rigid motion)."""
    found = [(c, w) for c in constraints if isinstance(c, MeanMotion) and (w := translation_weights(c)) is not None]
    if not found:
        return ()
    nodes = np.array([c.node for c, _ in found], dtype=np.int64)
    follows = sp.csc_array(to_mesh @ motion_by_nodes(constraints, nodes, points, dof_of, to_mesh.shape[1]))
    made = []
    for k, (coupling, given) in enumerate(found):
        members, at = np.unique(coupling.members, return_inverse=True)
        weights = np.bincount(at, given)
        columns = sp.csr_array(follows[:, 6 * k : 6 * k + 6])
        made.append(MeanNode(place[members], weights / weights.sum(), points[coupling.node], columns))
    return tuple(made)


def _retained_nodes(part: Part, begin: int, place: IntArray) -> IntArray:
    """Return the kept nodes of a part as nodes of the joined body; shared nodes have one copy."""
    kept = part.body.kept
    is_shared = kept < len(part.nodes)
    return np.concatenate([place[part.nodes[kept[is_shared]]], begin + kept[~is_shared]])


def _numbering(
    parts: Sequence[Part], added: IntArray, numbers: IntArray | None, node_sets: Mapping[str, IntArray]
) -> Numbering:
    """Return the numbering of the joined body; each part has its own copy of a shared node, with the same number.

    Skin points refer to the node that moves them, which their part numbers like the joined body.
    """
    side = []
    for part in parts:
        own = part.body.numbering.nodes  # indices in the joined body, by which the mesh of the part is numbered
        at = np.full(len(part.body.nodes), NONE) if not own.size else np.array(own)
        at[: len(part.nodes)] = part.nodes
        on_skin = (np.arange(len(at)) >= len(part.nodes)).astype(np.int64)
        elements = tuple(each for each in part.body.numbering.sets if each.kind == "elements")
        numbering = replace(part.body.numbering, nodes=at, on_skin=on_skin, sets=elements)
        side.append((part.body.name, numbering, len(at), len(part.body.surface)))
    side.append(("", Numbering(nodes=added) if len(added) else Numbering(), len(added), 0))
    whole = numbering_side_by_side(side, share_numbers=True)
    sets = []
    for name, members in node_sets.items():
        rows = np.flatnonzero(np.isin(whole.nodes, members))
        sets.append(NamedSet(name, "nodes", rows, len(np.unique(members))))
    has = whole.nodes != NONE
    if numbers is None:
        return replace(whole, nodes=NO_NUMBERS, on_skin=NO_NUMBERS, sets=(*sets, *whole.sets))
    return replace(whole, nodes=np.where(has, numbers[whole.nodes], NONE), sets=(*sets, *whole.sets))


def _leaders(constraints: list[Constraint]) -> IntArray:
    """Return the nodes that need six dofs: leaders of rigid groups, and nodes that follow mean motions."""
    return np.unique([c.node for c in constraints if isinstance(c, RigidNodes | MeanMotion)]).astype(np.int64)


def _shared_dofs(parts: Sequence[Part], place: IntArray, leaders: IntArray) -> tuple[IntArray, sp.csr_array, IntArray]:
    """Steps (1) and (2): return the joined dofs, S, and the dof of each component of each node, (n_nodes, 6)."""
    asked = (6 * place[leaders][:, None] + np.arange(6)).ravel()
    side = np.concatenate([6 * place[part.nodes[part.body.dofs[:, 0]]] + part.body.dofs[:, 1] for part in parts])
    found = np.unique(np.concatenate([side, asked]))
    S = sp.csr_array(
        (np.ones(len(side)), (np.arange(len(side)), np.searchsorted(found, side))), shape=(len(side), len(found))
    )
    dofs = np.stack([found // 6, found % 6], axis=1)
    dof_of = np.full((len(place), 6), -1)
    wanted = 6 * place[:, None] + np.arange(6)
    at = np.minimum(np.searchsorted(found, wanted), len(found) - 1)
    has = (found[at] == wanted) & (place >= 0)[:, None]
    dof_of[has] = at[has]
    return dofs, S, dof_of


def _side_by_side(name: str, bodies: list[FEBody], S: sp.csr_array, dofs: IntArray, nodes: Array) -> FEBody:
    parts = side_by_side(bodies)
    loose = np.flatnonzero(np.diff(S.tocsc().indptr) == 0)  # dofs of leaders that are in no part
    own = sp.csr_array((np.ones(len(loose)), (np.arange(len(loose)), loose)), shape=(len(loose), len(dofs)))
    n_added = len(nodes) - len(parts["nodes"])
    model, recovery = parts["element_model"], parts["recovery"]
    if model is not None:
        model = WeldedModel(
            (*model.parts, MasslessNodes(len(loose), n_added)),
            (*model.n_mesh_dof, len(loose)),
            (*model.n_nodes, n_added),
        )
    volumes = [np.zeros(len(b.nodes)) if b.node_volumes is None else b.node_volumes for b in bodies]
    whole = {
        "M": S.T @ parts.pop("M") @ S,
        "K": S.T @ parts.pop("K") @ S,
        "D": None if parts["D"] is None else S.T @ parts["D"] @ S,
        "nodes": nodes,
        "dofs": dofs,
        "element_model": model,
        "recovery": Recovery(
            sp.vstack([recovery.matrix @ S, own], "csr"), np.concatenate([recovery.dofs, dofs[loose]])
        ),
        "node_volumes": np.concatenate([*volumes, np.zeros(n_added)]) if any(v.any() for v in volumes) else None,
        "provenance": {
            f"{body.name}: {key}" if len(bodies) > 1 else key: value
            for body in bodies
            for key, value in body.provenance.items()
        },
    }
    return FEBody(name=name, **parts | whole)


def recovered_dofs(body: FEBody) -> IntArray:
    """Return (node, component) of the mesh dofs of a body, (n_mesh_dof, 2)."""
    return body.dofs if body.recovery is None else body.recovery.dofs


def _without_idle_dofs(body: FEBody, n_of_parts: int, references: IntArray, normal: int | None) -> FEBody:
    """Step (4). A rotation with mass but without stiffness remains, and appears as a motion of zero frequency.

    The reference of a mean motion that follows in some components only has no other motion, so its other translations
    are idle too. If a recovery row beyond those of the parts belongs to an idle dof, it does not give the motion of its
    node. It loses its component, because the motion is not zero but unknown.
    """
    is_idle = (body.dofs[:, 1] >= 3) | np.isin(body.dofs[:, 0], references)
    for A in (body.K, body.M):
        is_idle &= np.asarray(abs(A).sum(axis=0)).ravel() == 0
    count = np.bincount(body.dofs[:, 0], minlength=len(body.nodes))
    if normal is not None and count.max() == 6:
        is_idle &= (body.dofs[:, 0] != int(np.argmax(count == 6))) | (body.dofs[:, 1] == 3 + normal)
    idle = np.flatnonzero(is_idle)
    if not len(idle):
        return body
    without = eliminate_dofs(body, idle, sp.csr_array((len(idle), body.n_dof)))
    assert without.recovery is not None
    T, dofs = without.recovery.matrix, without.recovery.dofs.copy()
    is_lost = (np.arange(len(dofs)) >= n_of_parts) & ~abs(T).sum(axis=1).astype(bool)
    dofs[is_lost, 1] = MULTIPLIER
    return replace(without, recovery=Recovery(T, dofs))
