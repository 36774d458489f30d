"""Quadratic modes: second-order displacement of each kept node in terms of q, such as the shortening of a bent beam.

    r = c + Phi q + ½ Σ q_k q_l g_kl

The geometric stiffness of a unit force at a node is minus its second-order displacement, K_kl = -e·g_kl (theory.md §7).
g therefore follows node by node from the same static solutions and the same pass over the elements. The geometric
stiffness of the other unit loads already contains the inertia of this field, so quadratic modes add no inertia forces.
"""

import numpy as np

from cms.errors import BodyError
from cms.modes.families.families import Families, body_of, families_of
from cms.reduction.basis.frames import FrameCondition
from cms.reduction.basis.node_results import translation_rows
from cms.reduction.geometric_stiffness.geometric_reduction import distributing_part, elastic_part, link_work
from cms.reduction.geometric_stiffness.unit_states import balanced, require_geometric_stiffness, together
from fe_models.body.fe_body import FEBody
from fe_models.body.rigid_motion import MassLoads
from fe_models.foundation.arrays import Array, IntArray

__all__ = ["MOST_NUMBERS", "quadratic_modes"]

NODES_AT_ONCE = 60  #: nodes processed at a time; each needs three static solutions
MOST_NUMBERS = 2.5e7  #: largest number of values of the field, 200 MB


def quadratic_modes(source: FEBody | Families, Phi: Array, condition: FrameCondition, nodes: IntArray) -> Array:
    """Return the quadratic modes g at given nodes in frame B, (n_nodes, 3, n_q, n_q), symmetric [m per q²].

    Parameters
    ----------
    source
        A coupled body with an element model, or its `Families`.
    Phi
        Shapes over the dofs of the body that satisfy the condition of the frame, (n_dof, n_q).
    condition
        The frame condition.
    nodes
        Indices of nodes, (n_nodes,); each costs three static solutions.

    Raises
    ------
    BodyError
        If the elements do not provide their geometric stiffness, or the field would be too large.
    """
    body = body_of(source)
    require_geometric_stiffness(body)
    n = Phi.shape[1]
    if 3 * len(nodes) * n * n > MOST_NUMBERS:
        raise BodyError(
            f"body {body.name!r}: quadratic modes of {len(nodes)} nodes and {n} modes are {3 * len(nodes) * n * n:.2g} "
            f"numbers, expected {MOST_NUMBERS:.2g} at most; they are meant for slender bodies with few nodes and modes"
            ": model it by beams, or leave them out: interfaces have their second order from the geometric stiffness"
        )
    g = np.empty((len(nodes), 3, n, n))
    with families_of(source) as families:
        for begin in range(0, len(nodes), NODES_AT_ONCE):
            part = slice(begin, begin + NODES_AT_ONCE)
            forces = np.eye(3 * len(nodes[part]))
            K = force_stiffness(body, Phi, condition, nodes[part], forces, families)
            g[part] = -K.reshape(len(nodes[part]), 3, n, n)
    return g


def force_stiffness(
    body: FEBody, Phi: Array, condition: FrameCondition, nodes: IntArray, forces: Array, families: Families
) -> Array:
    """Return the geometric stiffness of forces at nodes, (k, n_q, n_q).

    Parameters
    ----------
    forces
        Loads as columns: forces along the axes of B, node by node, (3 n_nodes, k). Each load costs a static solution.
    """
    axes = condition.frame.axes
    # force components in mesh axes, node by node
    along_b = np.einsum("ab,nbk->nak", axes, forces.reshape(len(nodes), 3, -1)).reshape(3 * len(nodes), -1)
    on_dofs = np.asarray(translation_rows(body, nodes).T @ along_b)
    loads = balanced(body, together(body, MassLoads.none(on_dofs.shape[1]), on_dofs), condition)
    K = elastic_part(body, families.flexibility(loads.F), loads.mass, Phi)
    K -= distributing_part(body, loads.on_dofs, Phi)
    if body.recovery is not None:  # a node that follows a rotation also has a second-order motion
        dofs = body.recovery.dofs
        applied = np.zeros((len(dofs), on_dofs.shape[1]))
        place = np.full(len(body.nodes), -1, np.int64)
        place[nodes] = np.arange(len(nodes))
        rows = np.flatnonzero((dofs[:, 1] >= 0) & (dofs[:, 1] < 3) & (place[dofs[:, 0]] >= 0))
        applied[rows] = along_b[3 * place[dofs[rows, 0]] + dofs[rows, 1]]
        K -= link_work(body.recovery.matrix, dofs, body.dofs, applied, Phi)
    return K
