"""Reasons why matrices do not belong to a free body: an intended support, or a recognisable mistake.

A support resists translations at its nodes. Rows in a wrong order resist everywhere, and fit once they are reordered.
Wrong node positions resist rotations alone. A penalty has a conspicuously large diagonal entry.
"""

from collections.abc import Callable

import numpy as np
import scipy.sparse as sp
import scipy.sparse.linalg as sla

from fe_models.body.freedom import MOTIONS, RigidForces, rigid_forces
from fe_models.foundation.arrays import Array, IntArray
from fe_models.foundation.words import node_list, number_list

__all__ = ["mistake_description", "support_description"]

Called = Callable[[int], str]  #: function that returns the user's name of a node, given its index

#: ratio of a diagonal entry to the median diagonal above which a row that resists with all its stiffness is a penalty
PENALTY = 1e6
ALONE = 0.9  #: share of the stiffness of a row, above which it counts as all
LENGTHS = {1e-3: "mm beside matrices in m", 1e3: "m beside matrices in mm", 0.0254: "inches beside matrices in m",
           1 / 0.0254: "m beside matrices in inches"}  # fmt: skip
#: factor by which the nodes would have to be multiplied, and the unit mistake that it reveals
MOST_SOLVED = 3000  #: largest number of dofs of suspected nodes for which correct positions are computed
APART = 1e-3  #: distance between a node and its correct position over the body size, above which it is a mistake


def mistake_description(
    K: sp.csc_array,
    M: sp.csc_array,
    nodes: Array,
    dofs: IntArray,
    forces: RigidForces,
    *,
    with_rows: bool,
    called: Called = str,
) -> str | None:
    """Describe the mistake in matrices that are not free; None if a support explains them.

    (1) a penalty on the diagonal
    (2) the same matrices are free if their rows are reordered, or if the nodes are in another unit
    (3) rotations are resisted but translations are not, and not by rotational springs, so nodes are misplaced; their
        true positions follow from u = -K_SS⁻¹ K_S,rest Psi_rest, where S are the dofs of the suspected nodes
    (4) rows are missing that other nodes have (only if `with_rows`)

    Parameters
    ----------
    forces
        `rigid_forces` of these matrices.
    with_rows
        Whether missing rows are a mistake. If the body is declared held, they are its support.
    called
        Gives the user's name of a node, by its index, for messages.
    """
    diagonal = np.abs(K.diagonal())
    median = float(np.median(diagonal[diagonal > 0])) if (diagonal > 0).any() else 1.0
    is_penalty = (diagonal > PENALTY * median) & (forces.share.max(axis=1, initial=0.0) > ALONE)
    if is_penalty.any():  # (1)
        k = int(np.argmax(np.where(is_penalty, diagonal, 0.0)))
        return (
            f"K has {diagonal[k]:.3g} on the diagonal of row {k} (node {called(dofs[k, 0])}, component {dofs[k, 1]}), "
            f"the median is {median:.3g}: a support by penalty ({int(is_penalty.sum())} such rows), which destroys "
            "the digits of all other terms; give the matrices without it"
        )
    if order := fitting_order(K, M, nodes, dofs):  # (2)
        return f"the rows are in {order} order and dofs list another; list the dofs in the order of the rows"
    for factor, words in LENGTHS.items():
        if rigid_forces(K, M, factor * nodes, dofs).is_free:
            return f"the nodes are in {words}: times {factor:.6g} everything fits; mend the nodes"
    turns_only = not forces.resists[:3].any() and bool(forces.is_possible[:3].all())
    if turns_only and (dofs[forces.rows, 1] < 3).any():  # (3)
        moved = moved_description(K, nodes, dofs, forces, called)
        return f"K resists rotations but no translation: the positions of nodes do not fit K{moved}"
    missing = missing_rows(dofs, len(nodes))
    if with_rows and len(missing):  # (4)
        node, component = missing[0]
        return (
            f"{len(missing)} rows that other nodes have are missing, such as component {component} of node "
            f"{called(node)}: removed rows hold the body to the ground; give all rows, or declare the body as held"
        )
    return None


def fitting_order(K: sp.csc_array, M: sp.csc_array, nodes: Array, dofs: IntArray) -> str:
    """Return the usual row order for which these matrices are free; "" if there is none."""
    node, component = dofs.T
    orders = {"component-major": np.lexsort((node, component)), "node-major": np.lexsort((component, node))}
    for name, order in orders.items():
        if not np.array_equal(order, np.arange(len(dofs))) and rigid_forces(K, M, nodes, dofs[order]).is_free:
            return name
    return ""


def moved_description(K: sp.csc_array, nodes: Array, dofs: IntArray, forces: RigidForces, called: Called) -> str:
    """Describe which nodes are misplaced, as far as the matrices show it."""
    suspected = np.unique(dofs[forces.rows, 0])
    S = np.flatnonzero(np.isin(dofs[:, 0], suspected))
    rest = np.flatnonzero(~np.isin(dofs[:, 0], suspected))
    if len(S) > MOST_SOLVED or len(rest) < 6:
        return "; mend the nodes, or the order of the dofs"
    center = nodes.mean(axis=0)
    from fe_models.body.rigid_motion import rigid_motion_of_dofs

    Psi = rigid_motion_of_dofs(nodes, dofs, center)[:, 3:]
    try:
        u = sla.splu(sp.csc_array(K[S][:, S])).solve(-np.asarray(K[S][:, rest] @ Psi[rest]))
    except RuntimeError:  # the suspected nodes alone form a mechanism
        return "; mend the nodes, or the order of the dofs"
    place = np.full((len(nodes), 3), np.nan)
    node, component = dofs[S].T
    for target, (along, turn, sign) in enumerate(((1, 2, 1.0), (2, 0, 1.0), (0, 1, 1.0))):
        rows = np.flatnonzero(component == along)  # a rotation about z moves points along y in proportion to x
        place[node[rows], target] = sign * u[rows, turn] + center[target]
    distance = np.linalg.norm(place[suspected] - nodes[suspected], axis=1)
    is_apart = distance > APART * np.linalg.norm(np.ptp(nodes, axis=0))
    wrong = suspected[is_apart]
    if not len(wrong):
        return "; mend the nodes, or the order of the dofs"
    if len(wrong) == 2:
        a, b = wrong
        if max(np.linalg.norm(place[a] - nodes[b]), np.linalg.norm(place[b] - nodes[a])) < APART * distance.max():
            return f": nodes {called(a)} and {called(b)} are exchanged; mend their order in nodes or in dofs"
    return (
        f": {len(wrong)} of them, {node_list(wrong[:3].tolist(), nodes, called)}; by K node {called(wrong[0])} belongs "
        f"to ({number_list(place[wrong[0]])})"
    )


def missing_rows(dofs: IntArray, n_nodes: int) -> list[tuple[int, int]]:
    """Return (node, component) of the missing dofs, for components that most nodes with dofs have."""
    has = np.zeros((n_nodes, 6), dtype=bool)
    has[dofs[:, 0], dofs[:, 1]] = True
    wanted = has[np.unique(dofs[:, 0])].mean(axis=0) > 0.5
    return [(int(node), int(component)) for node, component in np.argwhere(~has & wanted)]


def support_description(forces: RigidForces, dofs: IntArray, time: float, *, called: Called = str) -> str:
    """Describe where a body is supported and how stiffly; `time` is its time unit [s]."""
    row, motion = forces.place
    n_nodes = len(np.unique(dofs[forces.rows, 0]))
    return (
        f"{len(forces.rows)} rows of {n_nodes} nodes answer rigid-body motion by up to "
        f"{forces.largest.max():.1e} of the stiffest entry, most at node {called(dofs[row, 0])} for {MOTIONS[motion]}; "
        f"the body would swing at {forces.rigid_body_frequency.max() / time:.3g} Hz"
    )
