"""A received body against a full model of the same part: mass, free frequencies, and shapes at nodes in common.

For bodies whose mode set is not at hand (another program has reduced them); one of our own is compared with the mode
set of its job, which tells more (`check_reduction`). Nodes are paired by their place in mesh coordinates.
"""

import numpy as np
from scipy.spatial import cKDTree

from cms.assessment.quality.limits import LIMITS
from cms.assessment.quality.of_reduction.frequencies import compare_shapes, frequency_records, mac
from cms.assessment.quality.of_reduction.mass_properties import check_mass_properties
from cms.assessment.quality.record import QualityRecord, information, judge
from cms.assessment.quality.reduction_check import require_same_units
from cms.assessment.quality.reference.free_pencil import free_elastic_modes
from cms.body.reduced_body import ReducedBody
from cms.linear_algebra.solvers.mode_count import ModeCount
from cms.modes.families.families import Families
from fe_models.body.fe_body import FEBody
from fe_models.body.rigid_motion import rigid_motion_of_points
from fe_models.foundation.arrays import Array, IntArray

__all__ = ["MODES_BEYOND", "compare_with_model"]

SAME_PLACE = 1e-5  #: of the size of the body, within which two nodes are the same
LEAST_NODES = 6  #: in common, to compare shapes
MODES_BEYOND = 1.2  #: full modes are found up to this multiple of the band


def compare_with_model(body: FEBody, reduced: ReducedBody, *, band: float) -> tuple[QualityRecord, ...]:
    """Compare a received body with a full model.

    Parameters
    ----------
    body
        The full model, in the units and mesh coordinates of the body.
    band
        Highest frequency of interest [Hz].

    Returns
    -------
    tuple of QualityRecord
        "model-mass"; and unless it fails, "frequency-error", "mac-nodal" at the nodes in common.

    Raises
    ------
    QualityError
        If both are in different units.
    """
    require_same_units(body, reduced)
    mass = check_mass_properties(body, reduced)
    records = [judge("model-mass", mass.value, mass.reason, mass.data)]
    if body.is_held or reduced.is_held or records[0].verdict == "fail":
        return tuple(records)
    try:
        omega2, X, is_massive = free_elastic_modes(reduced)
    except np.linalg.LinAlgError as error:
        return (*records, information("frequency-error", f"no free modes of the reduced body: {error}"))
    own = np.sqrt(np.maximum(omega2[is_massive], 0.0)) / (2 * np.pi) / reduced.units.time
    with Families(body) as families:
        modes = families.free_modes(ModeCount(cutoff=MODES_BEYOND * band * body.units.time))
        full, Phi = modes.frequencies / body.units.time, modes.Phi
        n_band = int((full <= band).sum())
        if not n_band:
            lowest = full[0] if len(full) else families.free_modes(1).frequencies[0] / body.units.time
            words = f"the full model has no elastic free mode up to {band:.5g} Hz; its first is at {lowest:.5g} Hz"
            return (*records, information("frequency-error", words))
    here, there = nodes_in_common(body, reduced)
    if len(here) < LEAST_NODES:
        shapes_full, shapes_own = np.zeros((0, n_band)), np.zeros((0, int(is_massive.sum())))
        massed = np.eye(n_band, len(own))
    else:
        shapes_full = body.translations(Phi[:, :n_band])[here].reshape(-1, n_band)
        shapes_own = shapes_in_mesh(reduced, X[:, is_massive])[there].reshape(-1, int(is_massive.sum()))
        massed = mac(shapes_full, shapes_own)
    found = frequency_records(compare_shapes(full[:n_band], own, massed, shapes_full, shapes_own), band)
    for record in found:
        if record.name == "frequency-error":
            records.append(record)
        elif record.name == "mac-nodal" and len(here) >= LEAST_NODES:
            words = f"{record.reason}, at {len(here)} nodes in common"
            records.append(judge("mac-nodal", record.value, words, record.data))
    if len(here) < LEAST_NODES:
        words = f"{len(here)} nodes in common with the full model, at least {LEAST_NODES} are needed to compare shapes"
        records.append(information("mac-nodal", words, action=LIMITS["mac-nodal"].action))
    return tuple(records)


def nodes_in_common(body: FEBody, reduced: ReducedBody) -> tuple[IntArray, IntArray]:
    """Return nodes of the full model and kept nodes of the reduced body at the same places."""
    if not len(reduced.nodes):
        return np.zeros(0, np.int64), np.zeros(0, np.int64)
    places = reduced.frame.origin + np.asarray(reduced.nodes) @ reduced.frame.axes.T
    distance, nearest = cKDTree(body.nodes).query(places)
    there = np.flatnonzero(distance <= SAME_PLACE * (body.length or 1.0))
    return np.asarray(nearest[there], np.int64), there.astype(np.int64)


def shapes_in_mesh(reduced: ReducedBody, X: Array) -> Array:
    """Return translations of the kept nodes, rigid motion included, in mesh axes, (n_kept, 3, k)."""
    moved = rigid_motion_of_points(np.asarray(reduced.nodes), np.zeros(3)) @ X[:6] + reduced.Phi @ X[6:]
    return np.asarray(np.einsum("ab,nbk->nak", reduced.frame.axes, moved))
