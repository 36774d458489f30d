"""Estimated errors of free frequencies by the mesh, from the modes on this mesh alone.

With eta² = lambda_h - lambda of `fe_models.elements.recovery.mesh_error`, f_h / f = 1 / sqrt(1 - eta² / lambda_h).
"""

from dataclasses import dataclass

import numpy as np
import scipy.sparse as sp

from cms.reduction.basis.free_basis import FreeBasis
from fe_models.body.fe_body import FEBody
from fe_models.elements.recovery.mesh_error import EnergyErrors, energy_errors, skin_nodes, without_estimate
from fe_models.foundation.arrays import Array, IntArray

__all__ = ["MeshErrors", "mesh_errors"]

COVERED = 0.98  #: share of the strain energy of a mode in elements with an estimate, below which the mode has none
LARGEST = 10.0  #: largest estimate; the mesh does not resolve such a mode
HIGHER, UNKNOWN, SIGNED = "+", "+-", "signed"


def frequency_errors(found: EnergyErrors, lam: Array) -> Array:
    """Return the relative errors of frequencies with M-normalised modes and eigenvalues lam, (n,); NaN: not known."""
    eta2 = np.abs(found.total) if found.nonconforming else found.total
    frequency = 1 / np.sqrt(np.maximum(1 - eta2 / lam, (1 + LARGEST) ** -2)) - 1
    return np.where(found.energy.sum(axis=0) > COVERED * lam, frequency, np.nan)


@dataclass(frozen=True, eq=False)
class MeshErrors:
    """Errors of the lowest free frequencies by the mesh; see `ErrorEstimates`."""

    frequency: Array  #: estimated relative error, (n,); NaN: not known, 10: 10 or more
    sign: (
        str  #: "+": the frequencies are too high; "+-": too high or too low; "signed": as `frequency`; "": no estimate
    )
    method: str  #: how the estimate was made, or why there is none
    of_cells: Array | None = None  #: share of each element in 1 - lambda / lambda_h of each mode, (n_cells, n)


def mesh_errors(body: FEBody, basis: FreeBasis, n: int) -> MeshErrors:
    """Estimate the errors of the lowest n free frequencies by the mesh."""
    reason = without_estimate(body.element_model) if n else "no free frequency is below the cutoff of the set"
    if reason:
        return MeshErrors(np.full(n, np.nan), "", f"none: {reason}")
    assert body.element_model is not None
    lam = basis.omega2[:n]
    found = energy_errors(body.element_model, body.mesh_displacement(basis.Phi[:, :n]), lam, loaded_nodes(body))
    frequency = frequency_errors(found, lam)
    is_covered = ~np.isnan(frequency)
    sign, method = HIGHER, "recovered stress of elements; the frequencies are too high"
    if found.is_signed:
        sign, method = SIGNED, "recovered displacement of shells; positive: the frequency is too high"
    if found.nonconforming:
        sign, method = UNKNOWN, f"recovered stress of elements; sign not known: {found.nonconforming}"
    if not is_covered.any():
        return MeshErrors(frequency, "", "none: the strain energy is in beams, springs or matrices")
    return MeshErrors(frequency, sign, method, found.error / lam)


def loaded_nodes(body: FEBody) -> IntArray:
    """Return the nodes on which couplings or other parts may act: of interfaces and ties, and with shared dofs."""
    parts = [each.nodes for each in body.interfaces] + [tie.interface.nodes for tie in body.ties]
    if body.recovery is not None:
        is_node = ~np.isin(body.recovery.dofs[:, 0], skin_nodes(body.element_model))
        T, nodes = sp.csr_array(body.recovery.matrix)[is_node], body.recovery.dofs[is_node, 0]
        users = np.bincount(T.indices, minlength=T.shape[1])
        entries = np.diff(T.indptr)
        is_shared = entries != 1
        is_shared[entries == 1] = users[T.indices[T.indptr[:-1][entries == 1]]] > 1
        parts.append(nodes[is_shared])
    return np.unique(np.concatenate([np.zeros(0, np.int64), *parts]))
