"""Planar bodies: elastic in one plane and rigid out of it, with all six rigid-body motions of a body in space."""

from dataclasses import replace

import numpy as np
import scipy.sparse as sp

from fe_models.body.elimination import eliminate_dofs
from fe_models.body.fe_body import FEBody, Interface
from fe_models.body.rigid_motion import rigid_motion_of_points
from fe_models.foundation.errors import BodyError

__all__ = ["planar"]


def planar(body: FEBody, *, normal: int = 2) -> FEBody:
    """Return the body with all deformation restricted to one plane.

    Each node keeps its in-plane dofs: two translations and the rotation about the normal. Out of the plane every node
    follows one reference node rigidly. The body therefore has only three out-of-plane dofs: the translation of that
    node along the normal and its rotations about the two in-plane axes. Mass, inertia and invariants remain those of
    the body in space, and K has no strain energy for all six rigid-body motions. Frames, mode sets and multibody
    systems work as they do in space, and a body that moves in its plane moves as a planar model does.

    The reference node is the node of the first interface, which keeps its out-of-plane dofs. The other interfaces lose
    their three out-of-plane dofs.

    Parameters
    ----------
    body
        A coupled body without distributing interfaces.
    normal
        Mesh axis normal to the plane: 0, 1 or 2 for x, y or z.

    Raises
    ------
    BodyError
        If the body is not coupled, has multipliers, or no node has all three dofs out of the plane.
    """
    where = f"planar: body {body.name!r}"
    if normal not in (0, 1, 2):
        raise BodyError(f"{where}: normal: expected axis 0, 1 or 2 of the mesh, got {normal!r}")
    body.require_coupled()
    if (body.dofs[:, 1] < 0).any():
        raise BodyError(f"{where}: has distributing interfaces; make them rigid, or choose single nodes")
    node, component = body.dofs.T
    is_out = np.isin(component, [normal, *(3 + axis for axis in range(3) if axis != normal)])
    reference = _reference_node(body, is_out, where)
    out_of_reference = np.flatnonzero(is_out & (node == reference))
    slaves = np.flatnonzero(is_out & (node != reference))
    rows = np.zeros((len(slaves), 6))
    is_translation = component[slaves] < 3
    motion = rigid_motion_of_points(body.nodes[node[slaves]], body.nodes[reference])[:, normal]
    rows[is_translation] = motion[is_translation]
    rows[~is_translation, component[slaves][~is_translation]] = 1.0
    columns = sp.csr_array(rows[:, component[out_of_reference]])
    placement = sp.csr_array((np.ones(3), (np.arange(3), out_of_reference)), shape=(3, body.n_dof))
    kept = np.setdiff1d(np.arange(body.n_dof), slaves)
    body = replace(body, interfaces=tuple(_without(interface, kept) for interface in body.interfaces))
    return eliminate_dofs(body, slaves, columns @ placement)


def _reference_node(body: FEBody, is_out: np.ndarray, where: str) -> int:
    """Return the node of the first boundary dofs, otherwise the first node, with three out-of-plane dofs."""
    candidates = [np.asarray(i.dofs) for i in body.interfaces if i.dofs is not None]
    nodes = np.concatenate([*[body.dofs[dofs, 0] for dofs in candidates], body.dofs[:, 0]])
    count = np.bincount(body.dofs[is_out, 0], minlength=len(body.nodes))
    possible = nodes[count[nodes] == 3]
    if not len(possible):
        raise BodyError(f"{where}: no node has rotations out of the plane; expected beams, or a rigid interface")
    return int(possible[0])


def _without(interface: Interface, kept: np.ndarray) -> Interface:
    dofs = np.asarray(interface.dofs)
    return replace(interface, dofs=dofs[np.isin(dofs, kept)])
