"""Rigid links inside a body: the dofs of followers are eliminated."""

from collections.abc import Iterable

import numpy as np
import scipy.sparse as sp

from fe_models.body.elimination import eliminate_dofs
from fe_models.body.fe_body import FEBody
from fe_models.body.rigid_motion import rigid_motion_of_points
from fe_models.elements.beams.attachments import RigidLink
from fe_models.errors import BeamError

__all__ = ["link_rigidly"]


def link_rigidly(body: FEBody, links: Iterable[RigidLink]) -> FEBody:
    """Return the body with the followers of rigid links eliminated: u = u_leader + theta × (c - c_leader).

    A leader may itself follow another link. The chain is then resolved to its first leader.

    Parameters
    ----------
    body
        The body before coupling; each leader and follower is one of its nodes.
    links
        The rigid links, each with a leader and its followers.

    Raises
    ------
    BeamError
        If a node follows two leaders or itself, a leader does not have six dofs, or a follower has no dofs.
    """
    leader: dict[int, int] = {}
    for link in links:
        for node in link.followers.tolist():
            if node in leader:
                raise BeamError(f"rigid links: node {node} follows two nodes, {leader[node]} and {link.node}; drop one")
            leader[node] = link.node
    if not leader:
        return body
    row_of = np.full((len(body.nodes), 6), -1, np.int64)
    real = np.flatnonzero(body.dofs[:, 1] >= 0)
    row_of[body.dofs[real, 0], body.dofs[real, 1]] = real
    slaves: list[int] = []
    rows: list[int] = []
    columns: list[int] = []
    values: list[float] = []
    for node in leader:
        root, steps = node, 0
        while root in leader:
            root, steps = leader[root], steps + 1
            if steps > len(leader):
                raise BeamError(f"rigid links: node {node} follows itself through a loop of links; open the loop")
        if (row_of[root] < 0).any():
            raise BeamError(f"rigid links: node {root} leads others, but has not six dofs")
        mine = np.flatnonzero(row_of[node] >= 0)
        if not len(mine):
            raise BeamError(f"rigid links: node {node} follows node {root}, but has no dofs")
        motion = np.eye(6)
        motion[:3] = rigid_motion_of_points(body.nodes[node][None], body.nodes[root])[0]
        first = len(slaves)
        slaves += row_of[node, mine].tolist()
        at = np.nonzero(motion[mine])
        rows += (first + at[0]).tolist()
        columns += row_of[root, at[1]].tolist()
        values += motion[mine][at].tolist()
    T_s = sp.csr_array((values, (rows, columns)), shape=(len(slaves), body.n_dof))
    return eliminate_dofs(body, np.array(slaves), T_s)
