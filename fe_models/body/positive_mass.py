"""Repair of mass matrices with slightly negative eigenvalues, as written by some programs."""

from dataclasses import replace

import numpy as np
import scipy.linalg as la
import scipy.sparse as sp
import scipy.sparse.linalg as sla

from fe_models.body.fe_body import FEBody
from fe_models.body.rigid_motion import rigid_motion_of_dofs
from fe_models.errors import BodyError
from fe_models.foundation.arrays import Array, IntArray

__all__ = ["DENSE", "ROUNDING", "negative_mass", "positive_mass"]

#: magnitude of a negative eigenvalue of the scaled mass, relative to the largest, that counts as rounding
ROUNDING = 1e-10
#: magnitude of a negative eigenvalue, relative to the largest, up to which it is repaired; beyond it M is no mass
#: matrix
REPAIR_LIMIT = 1e-3
DENSE = 1500  #: number of dofs up to which all eigenvalues are computed
MOST_NEGATIVE = 200  #: largest number of negative eigenvalues that are computed for a large matrix
#: entries of an eigenvector below this share of the largest are dropped, so that the matrix stays sparse
ROUNDING_OF_VECTORS = 1e-13


def scales(M: sp.csc_array, dofs: IntArray) -> Array:
    """Return the scale of each dof: the root of the largest mass of its kind (translation, modal, rotation)."""
    diagonal = np.abs(M.diagonal())
    size = np.ones(len(dofs))
    for is_kind in (dofs[:, 1] < 0, (dofs[:, 1] >= 0) & (dofs[:, 1] < 3), dofs[:, 1] >= 3):
        largest = diagonal[is_kind].max(initial=0.0)
        size[is_kind] = np.sqrt(largest) if largest > 0 else 1.0
    return size


def negative_mass(M: sp.csc_array, dofs: IntArray) -> tuple[Array, Array]:
    """Return the negative eigenvalues of M and their vectors, with translations and rotations scaled alike.

    Parameters
    ----------
    M
        (n_dof, n_dof).
    dofs
        (node, component), (n_dof, 2).

    Returns
    -------
    values
        Eigenvalues below -`ROUNDING` times the largest, ascending, (k,) [-].
    vectors
        (n_dof, k) [kg^(1/2), kg^(1/2) m]. M + sum |value| v vᵀ has no negative eigenvalue.
    """
    size = scales(M, dofs)
    scaled = sp.csc_array(sp.diags_array(1 / size) @ M @ sp.diags_array(1 / size))
    n = scaled.shape[0]
    if n <= DENSE:
        values, vectors = la.eigh(scaled.toarray())
    else:
        k = 8
        while True:
            values, vectors = sla.eigsh(scaled, k=min(k, n - 1), which="SA", ncv=min(n, 4 * k + 40), tol=1e-10)
            if values.max() >= 0 or k >= MOST_NEGATIVE:
                break
            k *= 3
    largest = float(np.abs(values).max()) if n <= DENSE else float(abs(scaled).sum(axis=0).max())
    order = np.argsort(values)
    is_negative = values[order] < -ROUNDING * largest
    kept = order[is_negative]
    return values[kept] / largest, size[:, None] * vectors[:, kept] * np.sqrt(largest)


def positive_mass(body: FEBody) -> FEBody:
    """Return the body with the negative eigenvalues of its mass set to zero, which its provenance records.

    (1) find the negative eigenvalues and vectors of M, translations and rotations scaled to similar mass
        (`negative_mass`)
    (2) add sum |value| v vᵀ, which gives the nearest matrix in that scaling; these motions then have no kinetic energy

    Raises
    ------
    BodyError
        If an eigenvalue is below `-REPAIR_LIMIT` times the largest: rounding of a mass matrix does not explain it.
    """
    where = f"body {body.name!r}"
    values, vectors = negative_mass(body.M, body.dofs)  # (1)
    if not len(values):
        return body
    if values[0] < -REPAIR_LIMIT:
        raise BodyError(
            f"{where}: M has an eigenvalue of {values[0]:.1e} of its largest; expected at least -{REPAIR_LIMIT:.0e}, "
            "which could be repaired; check that this is the mass matrix, with its rows in the order of dofs"
        )
    local = np.where(np.abs(vectors) > ROUNDING_OF_VECTORS * np.abs(vectors).max(axis=0), vectors, 0.0)
    V = sp.csc_array(local * np.sqrt(np.abs(values)))
    M = sp.csc_array(body.M + V @ V.T)  # (2)
    Psi_R = rigid_motion_of_dofs(body.nodes, body.dofs, body.nodes.mean(axis=0))
    before, after = (np.einsum("nk,nk->k", Psi_R, matrix @ Psi_R) for matrix in (body.M, M))
    change = float((np.abs(after - before) / np.where(before > 0, before, 1.0)).max())
    record = {
        "mass mended": f"{len(values)} negative eigenvalues, down to {values[0]:.1e} of the largest, set to zero; mass "
        f"and inertia changed by up to {change:.1e}"
    }
    return replace(body, M=M, provenance={**dict(body.provenance), **record})
