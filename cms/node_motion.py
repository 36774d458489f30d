"""Motion of a node with all six components, wherever its dofs are: in the body, or in the mesh behind it."""

import numpy as np

from cms.arrays import Array
from cms.fe_body import FEBody, Interface
from cms.rigid_modes import rigid_motion_of_points

__all__ = ["interface_node_motion", "node_motion"]


def node_motion(body: FEBody, node: int, u: Array) -> Array | None:
    """Return translation and rotation of a node with displacement columns u, (6, k); None where it has not all six."""
    for dofs, columns in ((body.dofs, u), (None if body.recovery is None else body.recovery.dofs, None)):
        if dofs is None:
            continue
        rows = np.flatnonzero((dofs[:, 0] == node) & (dofs[:, 1] >= 0))
        if len(rows) == 6:
            rows = rows[np.argsort(dofs[rows, 1])]
            if columns is not None:
                return np.asarray(columns[rows])
            assert body.recovery is not None
            return np.asarray(body.recovery.matrix[rows] @ u)
    return None


def interface_node_motion(body: FEBody, interface: Interface, u: Array) -> Array | None:
    """Return the motion of the reference point as a member with six components moves it rigidly, (6, k).

    For a rigid interface, or one of a single node; None where no such node is there.
    """
    if interface.kind != "rigid" and len(interface.nodes) > 1:
        return None
    motion = node_motion(body, int(interface.nodes[0]), u)
    if motion is None:
        return None
    transport = np.eye(6)
    transport[:3] = rigid_motion_of_points(interface.reference[None], body.nodes[interface.nodes[0]])[0]
    return transport @ motion
