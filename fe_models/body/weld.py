"""Welding of several bodies into one body at their interfaces, for solids and frames.

`fe_models.assembly.join` joins bodies before they are coupled: they share nodes, whose dofs become one (u_parts = S u).
Coupled bodies share no node. They meet at reference nodes some distance apart, which distributing interfaces move by
multipliers: one of them follows the other rigidly, and multipliers that lose their node are removed. Both joins place
the bodies by `side_by_side` and eliminate dofs by `eliminate_dofs`; only the equations between the dofs differ.
"""

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise
from typing import Any

import numpy as np
import scipy.sparse as sp

from fe_models.body.elimination import eliminate_dofs
from fe_models.body.fe_body import MULTIPLIER, ElementModel, FEBody, Interface, Recovery, StressPointModel, Tie
from fe_models.body.load_cases import LoadCase
from fe_models.body.rigid_motion import MassLoads, rigid_motion_of_points
from fe_models.foundation.arrays import Array, IntArray
from fe_models.foundation.errors import BodyError
from fe_models.meshes.numbering import numbering_side_by_side

__all__ = ["WeldedModel", "WeldedPoints", "mesh_rows", "side_by_side", "weld"]

Place = tuple[str, str]  #: name of a body, and name of its interface


@dataclass(frozen=True, eq=False)
class WeldedModel:
    """Element models of the parts side by side, as an `fe_models.body.fe_body.ElementModel`."""

    parts: tuple[ElementModel, ...]
    n_mesh_dof: tuple[int, ...]  #: number of mesh dofs of each part
    n_nodes: tuple[int, ...]  #: number of nodes of each part, including reference nodes

    @property
    def has_nodal_stress(self) -> bool:
        """Whether any part has nodal stress; the other parts report zero."""
        return any(part.has_nodal_stress for part in self.parts)

    def mass_gram(self, u: Array) -> Array:
        """Return the sum of the Gram matrices of the parts, (4 + 3 k, 4 + 3 k)."""
        k = np.shape(u)[1]
        gram = np.zeros((4 + 3 * k, 4 + 3 * k))
        for part, rows in zip(self.parts, self._rows(), strict=True):
            gram += part.mass_gram(u[rows])
        return gram

    def nodal_stress(self, u: Array, *, nodes: IntArray | None = None) -> Array:
        """Return the stress at the nodes of all parts, (n_nodes, 6, k) [Pa]; zero at reference nodes."""
        stresses = []
        first = np.cumsum([0, *self.n_nodes])
        for part, rows, begin, n_nodes in zip(self.parts, self._rows(), first[:-1], self.n_nodes, strict=True):
            stress = np.zeros((n_nodes, 6, np.shape(u)[1]))
            if part.has_nodal_stress:
                inside = None if nodes is None else nodes[(nodes >= begin) & (nodes < begin + n_nodes)] - begin
                own = part.nodal_stress(u[rows], nodes=inside)
                stress[: len(own)] = own
            stresses.append(stress)
        return np.concatenate(stresses)

    def nodal_rotation(self, u: Array, nodes: IntArray) -> Array:
        """Return rotations at the given nodes, (n, 3, k); NaN where a part cannot compute them."""
        rotation = np.full((len(nodes), 3, np.shape(u)[1]), np.nan)
        first = np.cumsum([0, *self.n_nodes])
        for part, rows, begin, n_nodes in zip(self.parts, self._rows(), first[:-1], self.n_nodes, strict=True):
            is_own = (nodes >= begin) & (nodes < begin + n_nodes)
            if is_own.any():
                rotation[is_own] = part.nodal_rotation(u[rows], nodes[is_own] - begin)
        return rotation

    @property
    def has_geometric_stiffness(self) -> bool:
        """Whether all parts have a geometric stiffness; with a missing part the sum would be wrong."""
        return all(part.has_geometric_stiffness for part in self.parts)

    def mass_forces(self, loads: MassLoads) -> Array:
        """Return the consistent nodal forces of loads per unit mass, (n_mesh_dof, k) [N, N m]."""
        return np.concatenate([part.mass_forces(loads) for part in self.parts])

    def internal_forces(self, u: Array, *, nodes: IntArray | None = None) -> Array:
        """Return the nodal forces of the displacement columns u, (n_mesh_dof, k) [N, N m]."""
        first = np.cumsum([0, *self.n_nodes])
        inside = [
            None if nodes is None else nodes[(nodes >= begin) & (nodes < begin + n)] - begin
            for begin, n in zip(first[:-1], self.n_nodes, strict=True)
        ]
        return np.concatenate(
            [
                part.internal_forces(u[rows], nodes=own)
                for part, rows, own in zip(self.parts, self._rows(), inside, strict=True)
            ]
        )

    def geometric_stiffness(self, u: Array, loads: MassLoads, Phi: Array) -> Array:
        """Return the sum of Phiᵀ K_geo(sigma_j) Phi over the parts, (k, n, n)."""
        K = np.zeros((loads.k, Phi.shape[1], Phi.shape[1]))
        for part, rows in zip(self.parts, self._rows(), strict=True):
            K += part.geometric_stiffness(u[rows], loads, Phi[rows])
        return K

    def _rows(self) -> list[slice]:
        return mesh_rows(self.n_mesh_dof)


@dataclass(frozen=True, eq=False)
class WeldedPoints:
    """Stress points of all parts, as a `fe_models.body.fe_body.StressPointModel`."""

    #: name of the part, its stress points, and its rows among the mesh dofs
    parts: tuple[tuple[str, StressPointModel, slice], ...]

    @property
    def names(self) -> tuple[str, ...]:
        """Name of each point, such as "frame: line 3 end point 5"."""
        return tuple(f"{body}: {name}" for body, points, _ in self.parts for name in points.names)

    @property
    def positions(self) -> Array:
        """Undeformed positions in mesh axes, (n_points, 3) [m]."""
        return np.concatenate([points.positions for _, points, _ in self.parts])

    def stress(self, u: Array) -> Array:
        """Return the stress of displacement columns over the mesh dofs, (n_points, 6, k) [Pa]."""
        return np.concatenate([points.stress(u[rows]) for _, points, rows in self.parts])


def weld(bodies: Sequence[FEBody], joints: Iterable[tuple[Place, Place]], *, name: str) -> FEBody:
    """Join coupled bodies into one body.

    (1) place matrices, nodes, dofs, surfaces and load cases side by side
    (2) at each joint, let the six dofs of the second interface follow the first rigidly: u_2 = u_1 + theta_1 × r; the
        first follows the second if that alone is a distributing one
    (3) where only distributing interfaces meet, nothing but multipliers holds their reference nodes: replace the leader
        by the mean motion of its members, u_1 = A u_members, and remove its multipliers
    (4) remove the joined interfaces from the boundary, and record the distributing ones as `Tie`, for the geometric
        stiffness; the other interfaces stay as they are

    To join a beam to a solid, give the solid an interface on its faces, rigid (RBE2) or distributing (RBE3), and the
    beam an interface at its end node. The two interfaces need not lie at one point: the distance between them is a
    rigid arm.

    Parameters
    ----------
    bodies
        Coupled bodies in the same units and mesh axes, with different names.
    joints
        Pairs of (body name, interface name).
    name
        Name of the welded body. Interfaces keep their names if these are unique; otherwise they become
        "body.interface".

    Returns
    -------
    FEBody
        Coupled. Its element model is a `WeldedModel` if every part has an element model.

    Raises
    ------
    BodyError
        If names are unknown or repeated, units differ, a body is not coupled, an interface does not have six dofs at
        one node, or the joints form a closed loop.
    """
    where = f"weld {name!r}"
    bodies, joints = tuple(bodies), tuple(joints)
    _require_fit(where, bodies)
    index = {body.name: k for k, body in enumerate(bodies)}
    first_dof = np.cumsum([0, *(body.n_dof for body in bodies)])
    first_node = np.cumsum([0, *(len(body.nodes) for body in bodies)])
    joined, pairs = _joined_dofs(where, bodies, index, first_dof, joints)
    side_by_side = _side_by_side(name, bodies, joined, first_dof, first_node)
    slaves, T_s, means = _followers(where, side_by_side, pairs)
    side_by_side = replace(side_by_side, ties=_with_leaders(side_by_side, means))
    return eliminate_dofs(side_by_side, slaves, T_s) if len(slaves) else side_by_side


def mesh_rows(n_mesh_dof: tuple[int, ...]) -> list[slice]:
    """Return the rows of each part among the mesh dofs of all parts."""
    return [slice(begin, end) for begin, end in pairwise(np.cumsum([0, *n_mesh_dof]).tolist())]


def _require_fit(where: str, bodies: tuple[FEBody, ...]) -> None:
    names = [body.name for body in bodies]
    if not bodies or len(set(names)) != len(names):
        raise BodyError(f"{where}: expected bodies with different names, got {', '.join(names) or 'none'}")
    for body in bodies:
        body.require_coupled()
        if body.units != bodies[0].units:
            raise BodyError(
                f"{where}: body {body.name!r} is in {body.units.name}, {bodies[0].name!r} in {bodies[0].units.name}; "
                "make all in one unit system"
            )


def _joined_dofs(
    where: str,
    bodies: tuple[FEBody, ...],
    index: dict[str, int],
    first_dof: IntArray,
    joints: tuple[tuple[Place, Place], ...],
) -> tuple[set[Place], list[tuple[IntArray, IntArray]]]:
    """Return the joined interfaces, and the dofs on both sides of each joint."""
    joined: set[Place] = set()
    pairs = []
    for joint in joints:
        dofs = []
        for body_name, interface_name in joint:
            if body_name not in index:
                raise BodyError(f"{where}: no body {body_name!r}; expected one of {', '.join(index)}")
            body = bodies[index[body_name]]
            mine = np.asarray(body.interface(interface_name).dofs)
            if len(mine) != 6 or len(np.unique(body.dofs[mine, 0])) != 1:
                raise BodyError(
                    f"{where}: interface {interface_name!r} of body {body_name!r} has {len(mine)} dofs; a joint needs "
                    "the six of one node: take kind 'rigid' or 'distributing'"
                )
            dofs.append(first_dof[index[body_name]] + mine)
            joined.add((body_name, interface_name))
        pairs.append((dofs[0], dofs[1]))
    return joined, pairs


def _side_by_side(
    name: str, bodies: tuple[FEBody, ...], joined: set[Place], first_dof: IntArray, first_node: IntArray
) -> FEBody:
    n_dof = int(first_dof[-1])
    left = [(body, i) for body in bodies for i in body.interfaces if (body.name, i.name) not in joined]
    names = [interface.name for _, interface in left]
    cases = [(body, case) for body in bodies for case in body.load_cases]
    case_names = [case.name for _, case in cases]
    start = {body.name: (int(d), int(n)) for body, d, n in zip(bodies, first_dof, first_node, strict=False)}
    interfaces = [
        _moved(body, interface, names.count(interface.name) > 1, *start[body.name]) for body, interface in left
    ]
    load_cases = []
    for body, case in cases:
        f = np.zeros(n_dof)
        f[start[body.name][0] :][: body.n_dof] = case.f
        own_name = f"{body.name}.{case.name}" if case_names.count(case.name) > 1 else case.name
        load_cases.append(LoadCase(own_name, case.kind, f))
    volumes = [body.node_volumes for body in bodies]
    n_mesh_dof = [len(body.to_mesh.dofs) for body in bodies]
    return FEBody(
        name=name,
        **side_by_side(bodies),
        interfaces=tuple(interfaces),
        load_cases=tuple(load_cases),
        ties=tuple(_ties(bodies, joined, n_dof, start)),
        mean_nodes=tuple(
            each.placed(int(node), row, sum(n_mesh_dof))
            for body, node, row in zip(bodies, first_node, np.cumsum([0, *n_mesh_dof]).tolist(), strict=False)
            for each in body.mean_nodes
        ),
        numbering=numbering_side_by_side([body.numbered for body in bodies]),
        kept=np.concatenate([body.kept + n for body, n in zip(bodies, first_node, strict=False)]),
        node_volumes=None if any(v is None for v in volumes) else np.concatenate([v for v in volumes if v is not None]),
        provenance={f"{body.name}: {key}": value for body in bodies for key, value in body.provenance.items()},
    )


def side_by_side(bodies: Sequence[FEBody]) -> dict[str, Any]:
    """Return matrices, nodes, dofs, surface, models and recovery of a body made of others, as fields of `FEBody`."""
    first_node = np.cumsum([0, *(len(body.nodes) for body in bodies)])
    recoveries = [body.to_mesh for body in bodies]
    n_mesh_dof = tuple(len(recovery.dofs) for recovery in recoveries)
    models = tuple(body.element_model for body in bodies if body.element_model is not None)
    n_nodes = tuple(len(body.nodes) for body in bodies)
    return {
        "M": sp.block_diag([body.M for body in bodies], format="csc"),
        "K": sp.block_diag([body.K for body in bodies], format="csc"),
        "D": block_damping(bodies),
        "nodes": np.concatenate([body.nodes for body in bodies]),
        "dofs": _numbered([body.dofs for body in bodies], first_node),
        "units": bodies[0].units,
        "surface": np.concatenate([body.surface + n for body, n in zip(bodies, first_node, strict=False)]),
        "element_model": WeldedModel(models, n_mesh_dof, n_nodes) if len(models) == len(bodies) else None,
        "recovery": Recovery(
            sp.csr_array(sp.block_diag([recovery.matrix for recovery in recoveries], format="csr")),
            _numbered([recovery.dofs for recovery in recoveries], first_node),
        ),
        "stress_points": points_side_by_side(bodies, n_mesh_dof),
    }


def _moved(body: FEBody, interface: Interface, is_ambiguous: bool, first_dof: int, first_node: int) -> Interface:
    return replace(
        interface,
        name=f"{body.name}.{interface.name}" if is_ambiguous else interface.name,
        nodes=interface.nodes + first_node,
        dofs=np.asarray(interface.dofs) + first_dof,
    )


def _ties(
    bodies: tuple[FEBody, ...], joined: set[Place], n_dof: int, start: dict[str, tuple[int, int]]
) -> Iterator[Tie]:
    """Yield the ties of the parts and of their joined distributing interfaces, over all dofs."""
    for body in bodies:
        first_dof, first_node = start[body.name]
        T = sp.csr_array(
            (np.ones(body.n_dof), (np.arange(body.n_dof), first_dof + np.arange(body.n_dof))), (body.n_dof, n_dof)
        )
        own = list(body.ties)
        for interface in body.interfaces:
            dofs = np.asarray(interface.dofs)
            if interface.kind == "distributing" and (body.name, interface.name) in joined:
                motion = sp.csr_array((np.ones(6), (np.arange(6), dofs)), shape=(6, body.n_dof))
                multipliers = _multipliers(body, dofs)
                S = sp.csr_array(body.K[multipliers])[:, dofs].toarray()
                own.append(Tie(replace(interface, dofs=None), motion, multipliers, S))
        for tie in own:
            tie = tie.changed(T, first_dof + np.arange(body.n_dof))
            yield replace(
                tie, interface=replace(tie.interface, nodes=tie.interface.nodes + first_node),
                leader=None if tie.leader is None else replace(tie.leader, nodes=tie.leader.nodes + first_node),
            )  # fmt: skip


def _with_leaders(body: FEBody, means: dict[int, int]) -> tuple[Tie, ...]:
    """Return the ties; the reference nodes in `means` follow the members of the tie at another node, their leader."""
    at = {int(body.dofs[tie.motion.indices[0], 0]): tie for tie in body.ties}
    return tuple(
        replace(tie, leader=at[means[node]].interface) if node in means else tie
        for node, tie in at.items()
        if node not in means.values()
    )


def _numbered(dofs: list[IntArray], first_node: IntArray) -> IntArray:
    return np.concatenate([d + np.array([n, 0]) for d, n in zip(dofs, first_node, strict=False)])


def points_side_by_side(bodies: Sequence[FEBody], n_mesh_dof: tuple[int, ...]) -> WeldedPoints | None:
    """Return the stress points of all bodies, with their mesh dofs one after the other; None if there are none."""
    points = tuple(
        (body.name, body.stress_points, rows)
        for body, rows in zip(bodies, mesh_rows(n_mesh_dof), strict=True)
        if body.stress_points is not None
    )
    return WeldedPoints(points) if points else None


def block_damping(bodies: Sequence[FEBody]) -> sp.csc_array | None:
    """Return the block diagonal damping of all bodies; None if no body has damping."""
    if all(body.D is None for body in bodies):
        return None
    return sp.block_diag([sp.csc_array(body.K.shape) if body.D is None else body.D for body in bodies], format="csc")


def _followers(
    where: str, body: FEBody, pairs: list[tuple[IntArray, IntArray]]
) -> tuple[IntArray, sp.csr_array, dict[int, int]]:
    """Return the dependent dofs and their rows over all dofs; chains are resolved to their first leader.

    The third result is the leader of each node whose leader was replaced by the mean motion of its members.
    """
    leader: dict[int, int] = {}  # leader of each node
    dofs_of: dict[int, IntArray] = {}
    for pair in pairs:
        nodes = [int(body.dofs[dofs[0], 0]) for dofs in pair]
        dofs_of |= dict(zip(nodes, pair, strict=True))
        roots = [_root(leader, node) for node in nodes]
        if roots[0] == roots[1]:
            raise BodyError(f"{where}: a joint connects interfaces that are joined already; remove one of the joints")
        # If only multipliers act on one of two nodes, this node leads, and the elements of the other node act on its
        # dofs. PARDISO finds the matrix singular if multipliers act on the dofs of a node at an arm.
        is_held = [_has_only_multipliers(body, dofs_of[root]) for root in roots]
        lead, follow = roots[::-1] if is_held[1] and not is_held[0] else roots
        leader[follow] = lead
    slaves: list[IntArray] = []
    means: dict[int, int] = {}
    blocks: list[sp.csr_array] = []
    for root in dict.fromkeys(_root(leader, node) for node in leader):
        followers = [node for node in leader if _root(leader, node) == root]
        motion = sp.csr_array((np.ones(6), (np.arange(6), dofs_of[root])), shape=(6, body.n_dof))
        if all(_has_only_multipliers(body, dofs_of[node]) for node in (root, *followers)):
            multipliers, motion = _mean_motion(body, dofs_of[root])
            slaves += [dofs_of[root], multipliers]
            blocks += [motion, sp.csr_array((len(multipliers), body.n_dof))]
            means |= dict.fromkeys(followers, root)
        for node in followers:
            arm = np.eye(6)
            arm[:3] = rigid_motion_of_points(body.nodes[node][None], body.nodes[root])[0]
            slaves.append(dofs_of[node])
            blocks.append(sp.csr_array(arm @ motion))
    if not slaves:
        return np.zeros(0, np.int64), sp.csr_array((0, body.n_dof)), means
    return np.concatenate(slaves), sp.csr_array(sp.vstack(blocks, "csr")), means


def _has_only_multipliers(body: FEBody, dofs: IntArray) -> bool:
    """Return whether only multipliers act on the node of these dofs, as in a distributing interface."""
    rows, _ = body.K[:, dofs].nonzero()
    return bool((body.dofs[rows, 1] == MULTIPLIER).all())


def _multipliers(body: FEBody, dofs: IntArray) -> IntArray:
    """Return the multipliers that act on the reference node of these dofs."""
    rows = np.unique(body.K[:, dofs].nonzero()[0])
    return np.asarray(rows[body.dofs[rows, 1] == MULTIPLIER], np.int64)


def _mean_motion(body: FEBody, dofs: IntArray) -> tuple[IntArray, sp.csr_array]:
    """Return the multipliers of a reference node, and A in u_reference = A u_members over all dofs, (6, n_dof)."""
    multipliers = _multipliers(body, dofs)
    C = sp.csr_array(body.K[multipliers])
    at_reference = C[:, dofs].toarray()
    is_member = np.ones(body.n_dof)
    is_member[dofs] = 0.0
    return multipliers, sp.csr_array(-np.linalg.inv(at_reference) @ (C @ sp.diags_array(is_member)))


def _root(leader: dict[int, int], node: int) -> int:
    while node in leader:
        node = leader[node]
    return node
