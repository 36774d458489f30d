"""Mass properties from the mass matrix of the full model, compared with the moments in the file."""

import numpy as np

from cms.assessment.quality.limits import LIMITS
from cms.assessment.quality.record import QualityRecord, information, judge
from cms.body.invariants import rigid_mass_of
from cms.body.reduced_body import ReducedBody
from fe_models.body.fe_body import FEBody
from fe_models.body.rigid_motion import rigid_motion_of_dofs
from fe_models.foundation.arrays import Array
from fe_models.foundation.ranks.spread_matrix import largest_entry

__all__ = ["check_grounding", "check_mass_properties", "rigid_mass_matrix"]

#: relative rounding error of moments if the distance from the origin equals the body size
ROUNDING = 30 * np.finfo(float).eps


def rigid_mass_matrix(reduced: ReducedBody) -> Array:
    """Return the rigid-body mass matrix of the file about the mesh origin, mesh axes, (6, 6) [kg, kg m, kg m²]."""
    moments, frame = reduced.moments, reduced.frame
    # second moment about the mesh origin: c_mesh = o + A c
    o, A = frame.origin, frame.axes
    S_B = A @ moments.S
    S = moments.m * o + S_B
    R = A @ moments.R @ A.T + np.outer(o, S_B) + np.outer(S_B, o) + moments.m * np.outer(o, o)
    J = np.trace(R) * np.eye(3) - R
    return rigid_mass_of(moments.m, S, J)


def check_mass_properties(body: FEBody, reduced: ReducedBody) -> QualityRecord:
    """Compare Psi_Rᵀ M Psi_R of the full model with mass, first moment and inertia in the file.

    First moments are divided by m L, inertia by m L², about the mean of the nodes; L is the body length.
    """
    center, length = body.nodes.mean(axis=0), body.length
    Psi_R = rigid_motion_of_dofs(body.nodes, body.dofs, center)
    full = Psi_R.T @ (body.M @ Psi_R)
    shift = geometric_shift(center)
    own = shift.T @ rigid_mass_matrix(reduced) @ shift
    mass = max(abs(full[0, 0]), np.finfo(float).tiny)
    size = np.repeat([1.0, length], 3)
    # moments about a distant origin have already lost these digits
    far = np.linalg.norm(center) / length + np.linalg.norm(center - reduced.frame.origin) / length
    rounding = ROUNDING * (1 + far**2)
    defect = np.maximum(np.abs(own - full) / np.outer(size, size) / mass - rounding, 0.0)
    parts = {
        "mass": float(defect[:3, :3].max()),
        "first moment": float(defect[:3, 3:].max()),
        "inertia": float(defect[3:, 3:].max()),
    }
    name = max(parts, key=lambda key: parts[key])
    reason = (
        f"mass {own[0, 0]:.6g} in the file, {full[0, 0]:.6g} in the mass matrix; largest relative difference "
        f"{parts[name]:.1e}, of the {name}"
    )
    return judge("mass-properties", parts[name], reason, {**parts, "full": full, "reduced": own})


def geometric_shift(center: Array) -> Array:
    """Return the rigid motions about the mesh origin for unit rigid motions about another point, (6, 6)."""
    shift = np.eye(6)
    x, y, z = center
    shift[:3, 3:] = -np.array([[0.0, z, -y], [-z, 0.0, x], [y, -x, 0.0]])
    return shift


def check_grounding(body: FEBody) -> QualityRecord:
    """Check that rigid-body modes cause no force: largest |K Psi_R| / (|K| |Psi_R|), rotations divided by body length.

    A body that is declared as fixed to the ground is not checked.

    A check relative to each row would be stricter, but rows of a rigid interface are sums that cancel up to rounding.
    """
    Psi_R = rigid_motion_of_dofs(body.nodes, body.dofs, body.nodes.mean(axis=0))
    Psi_R[:, 3:] /= body.length
    size = np.abs(Psi_R).max(axis=0)
    stiffest = largest_entry(body.K) or 1.0
    force = np.abs(body.K @ Psi_R)
    ratio = force.max(axis=0) / np.where(size > 0, size, 1.0) / stiffest
    k = int(np.argmax(ratio))
    row = int(np.argmax(force[:, k]))
    mass = np.einsum("nk,nk->k", Psi_R, body.M @ Psi_R)
    energy = np.einsum("nk,nk->k", Psi_R, body.K @ Psi_R)
    swing = np.sqrt(np.maximum(energy / np.where(mass > 0, mass, np.inf), 0.0)) / (2 * np.pi) / body.units.time
    motion = ("x", "y", "z", "a turn about x", "a turn about y", "a turn about z")[k]
    reason = f"largest force is {ratio[k]:.1e} of the stiffest entry, at node {body.dofs[row, 0]} for {motion}"
    if ratio[k] > LIMITS["grounding"].tolerance:
        reason += f"; the body would swing at {swing.max():.3g} Hz"
    data = {"largest": ratio, "swing_hz": swing}
    if body.is_held:
        return information("grounding", f"the body is held to the ground, as declared: {reason}", data)
    return judge("grounding", ratio[k], reason, data)
