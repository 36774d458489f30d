"""Elimination of dofs that are a linear combination of others, and planar bodies. FEBody in, FEBody out."""

from dataclasses import replace

import numpy as np
import scipy.sparse as sp

from fe_models.body.fe_body import FEBody, Interface, Recovery
from fe_models.body.rigid_motion import rigid_motion_of_points
from fe_models.foundation.arrays import IntArray
from fe_models.foundation.errors import BodyError

__all__ = ["eliminate_dofs", "planar"]

ROUNDING = 1e-14  #: entry over the sum of the magnitudes of its terms, below which it is rounding


def eliminate_dofs(body: FEBody, slaves: IntArray, T_s: sp.sparray) -> FEBody:
    """Substitute u_slaves = T_s u in M, K, D and the load cases (Tᵀ A T), and return the new body.

    The nodes stay. The recovery of the mesh dofs is updated, and the boundary dofs are renumbered.

    Parameters
    ----------
    body
        Any body.
    slaves
        Dofs that leave, (n_slaves,).
    T_s
        Over all dofs of the body, zero in the columns of the slaves, (n_slaves, n_dof).

    Raises
    ------
    BodyError
        If a slave depends on a slave, or is a boundary dof.
    """
    where = f"body {body.name!r}"
    is_kept = np.ones(body.n_dof, dtype=bool)
    is_kept[slaves] = False
    keep = np.flatnonzero(is_kept)
    T_s = sp.csr_array(T_s)
    if abs(T_s[:, np.flatnonzero(~is_kept)]).sum() != 0:
        raise BodyError(f"{where}: an eliminated dof depends on another one; name the leader of both")
    for interface in body.interfaces:
        if interface.dofs is not None and not is_kept[interface.dofs].all():
            raise BodyError(f"{where}: interface {interface.name!r}: its boundary dofs cannot follow others")
    selection = sp.csr_array((np.ones(len(keep)), (keep, np.arange(len(keep)))), shape=(body.n_dof, len(keep)))
    placement = sp.csr_array((np.ones(len(slaves)), (slaves, np.arange(len(slaves)))), shape=(body.n_dof, len(slaves)))
    T = sp.csr_array(selection + placement @ T_s[:, keep])
    new_index = np.full(body.n_dof, -1, np.int64)
    new_index[keep] = np.arange(len(keep))
    before = body.to_mesh
    return replace(
        body,
        M=T.T @ body.M @ T,
        K=T.T @ body.K @ T,
        D=None if body.D is None else _congruent(body.D, T),
        dofs=body.dofs[keep],
        interfaces=tuple(
            interface if interface.dofs is None else replace(interface, dofs=new_index[interface.dofs])
            for interface in body.interfaces
        ),
        recovery=Recovery(sp.csr_array(before.matrix @ T), before.dofs),
        load_cases=tuple(replace(case, f=T.T @ case.f) for case in body.load_cases),
        ties=tuple(tie.changed(T, new_index) for tie in body.ties),
    )


def _congruent(D: sp.csc_array, T: sp.csr_array) -> sp.csc_array:
    """Return Tᵀ D T without rounding of cancelled terms: a damper between linked dofs has no effect."""
    made = sp.csc_array(T.T @ D @ T)
    terms = sp.csc_array(abs(T).T @ abs(D) @ abs(T))
    made = sp.csc_array(made.multiply(abs(made) > ROUNDING * terms))
    made.eliminate_zeros()
    return made


# planar bodies: elastic in one plane and rigid out of it, with all six rigid-body motions of a body in space ----------


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
