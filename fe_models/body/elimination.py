"""Elimination of dofs: some dofs become a linear combination of others (a congruence). FEBody in, FEBody out."""

from dataclasses import replace

import numpy as np
import scipy.sparse as sp

from fe_models.body.fe_body import FEBody, Recovery
from fe_models.foundation.arrays import IntArray
from fe_models.foundation.errors import BodyError

__all__ = ["eliminate_dofs"]

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
