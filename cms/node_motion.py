"""Motion of a node with all six components, wherever its dofs are: in the body, or in the mesh behind it."""

import numpy as np
import scipy.sparse as sp

from cms.fe_body import FEBody, Interface
from cms.rigid_modes import rigid_motion_of_points

__all__ = ["interface_node_motion", "node_motion"]


def node_motion(body: FEBody, node: int) -> sp.csr_array | None:
    """Return translation and rotation of a node with u, (6, n_dof); None where it has not all six."""
    rows = np.flatnonzero((body.dofs[:, 0] == node) & (body.dofs[:, 1] >= 0))
    if len(rows) == 6:
        return sp.csr_array((np.ones(6), (body.dofs[rows, 1], rows)), shape=(6, body.n_dof))
    if body.recovery is None:
        return None
    dofs = body.recovery.dofs
    rows = np.flatnonzero((dofs[:, 0] == node) & (dofs[:, 1] >= 0))
    return sp.csr_array(body.recovery.matrix[rows[np.argsort(dofs[rows, 1])]]) if len(rows) == 6 else None


def interface_node_motion(body: FEBody, interface: Interface) -> sp.csr_array | None:
    """Return the motion of the reference point as a member with six components moves it rigidly, (6, n_dof).

    For a rigid interface, or one of a single node; None where no such node is there.
    """
    if interface.kind == "distributing" or (interface.kind == "nodes" and len(interface.nodes) > 1):
        return None
    motion = node_motion(body, int(interface.nodes[0]))
    if motion is None:
        return None
    transport = np.eye(6)
    transport[:3] = rigid_motion_of_points(interface.reference[None], body.nodes[interface.nodes[0]])[0]
    return sp.csr_array(sp.csr_array(transport) @ motion)
