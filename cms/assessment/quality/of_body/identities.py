"""Symmetry and definiteness of the matrices of one reduced body, and identities of its moments, matrices and modes.

The identities are those of docs/theory.md §4-5.
"""

import numpy as np
import scipy.linalg as la

from cms.assessment.quality.record import QualityRecord, information, judge
from cms.body.reduced_body import ReducedBody
from cms.reduction.free_pencil import (
    free_elastic_modes,
    frequency_distance,
    has_inertia,
    whole_pencil,
)
from fe_models.foundation.arrays import Array

__all__ = [
    "check_definiteness",
    "check_energy_shares",
    "check_frame_condition",
    "check_free_frequencies",
    "check_inertia_tensor",
    "check_inertia_terms",
    "check_kinetic_energy",
    "check_modal_mass",
    "check_symmetry",
    "mode_size",
]


def check_symmetry(reduced: ReducedBody) -> QualityRecord:
    """Check that M, K, D, R and the moments S_ab,kl = S_ba,lk are symmetric: largest asymmetry over |A|."""
    matrices = {
        "M": reduced.M,
        "K": reduced.K,
        "D": reduced.D,
        "R": reduced.moments.R,
        "S_kl": reduced.moments.S_kl.transpose(0, 2, 1, 3).reshape(3 * reduced.n_q, 3 * reduced.n_q),
    }
    defects = {name: asymmetry(A) for name, A in matrices.items()}
    name = max(defects, key=lambda key: defects[key])
    reason = f"largest defect |A - Aᵀ| / |A| is {defects[name]:.1e}, of {name}"
    return judge("symmetry", defects[name], reason, {"defects": defects})


def check_definiteness(reduced: ReducedBody) -> QualityRecord:
    """Check that M and D have no negative eigenvalue, and K only positive ones; value: smallest / largest, scaled."""
    values = {name: negativity(getattr(reduced, name)) for name in ("M", "K", "D")}
    stiffness = np.diag(reduced.K)
    if reduced.n_q and (stiffness <= 0).any():
        values["K"] = max(values["K"], 1.0)
    name = max(values, key=lambda key: values[key])
    if values[name] > 0:
        reason = f"{name} has an eigenvalue of {-values[name]:.1e} of its largest, or no energy in some mode"
    else:
        reason = "M and D have no negative eigenvalue, K has positive ones only"
    return judge("definiteness", values[name], reason, {"negative": values})


def check_kinetic_energy(reduced: ReducedBody) -> QualityRecord:
    """Check that the mass matrix of rigid and elastic motion has no negative eigenvalue (scaled to a unit diagonal)."""
    M = whole_pencil(reduced).M
    value = negativity(M)
    reason = (
        f"some motion would have negative kinetic energy ({-value:.1e} of the largest eigenvalue)"
        if value > 0
        else "every motion of the free body has positive kinetic energy"
    )
    return judge("kinetic-energy", value, reason, {"eigenvalues": la.eigvalsh(scaled(M))})


def asymmetry(A: Array) -> float:
    """Return the largest entry of |A - Aᵀ| divided by the largest entry of |A|; 0 for a zero matrix."""
    size = np.abs(A).max(initial=0.0)
    return float(np.abs(A - A.T).max(initial=0.0) / size) if size > 0 else 0.0


def negativity(A: Array) -> float:
    """Return the smallest eigenvalue over the largest, if negative, of A scaled to a unit diagonal; else 0.

    Values within rounding count as 0.
    """
    if not A.size or not A.any():
        return 0.0
    values = la.eigvalsh(scaled(A))
    least = float(values[0] / np.abs(values).max())
    return -least if least < -len(values) * np.finfo(float).eps else 0.0


def scaled(A: Array) -> Array:
    """Return the symmetric part of A with rows and columns divided by sqrt(|diagonal|), or by 1 where it is zero."""
    diagonal = np.abs(np.diag(A))
    size = np.sqrt(np.where(diagonal > 0, diagonal, 1.0))
    return (A + A.T) / 2 / np.outer(size, size)


def check_modal_mass(reduced: ReducedBody) -> QualityRecord:
    """Check that M* = Σ_a S_aa,kl of the moments equals the modal mass M: both are the same integral."""
    if reduced.n_q == 0:
        return information("modal-mass", "the body has no modes")
    defect = np.abs(reduced.moments.M - reduced.M) / np.abs(reduced.M).max()
    row, column = np.unravel_index(np.argmax(defect), defect.shape)
    reason = f"largest difference of M* and M is {defect.max():.1e} of the largest entry, modes {row + 1}, {column + 1}"
    data = {"defect": defect}
    if not reduced.moments.is_exact:
        return information("modal-mass", f"{reason}; the moments are approximate, from bare matrices", data)
    return judge("modal-mass", defect.max(), reason, data)


def check_inertia_terms(reduced: ReducedBody) -> QualityRecord:
    """Count the inertia terms that the reducing program did not provide, and state the validity of a motion."""
    missing = reduced.moments.missing
    what = f"{', '.join(missing)} missing" if missing else "none is missing"
    reason = f"{what}; to be trusted: {reduced.moments.trust}"
    return judge("inertia-terms", float(len(missing)), reason, {"missing": list(missing)})


def check_frame_condition(reduced: ReducedBody) -> QualityRecord:
    """Check that 1C = 2C = 0 about the centre of mass (Tisserand frame) or that the interface does not move (nodal).

    The values |1C_k| / sqrt(m) and |2C_k| / sqrt(tr J) are dimensionless, at most one for a mode of unit modal mass.
    """
    frame = reduced.frame
    if reduced.n_q == 0:
        return information("frame-condition", "the body has no modes")
    if frame.kind == "tisserand":
        linear, angular = momenta(reduced)
        value = max(linear.max(), angular.max())
        k = int(np.argmax(np.maximum(linear, angular)))
        reason = f"largest momentum of a mode is {value:.1e} of the largest possible for its mass (mode {k + 1})"
        return judge("frame-condition", value, reason, {"linear": linear, "angular": angular})
    if frame.kind == "nodal":
        if frame.at and frame.at not in [each.name for each in reduced.interfaces]:
            return judge("frame-condition", np.inf, f"the frame is attached to {frame.at!r}, which is not an interface")
        motion, where = held_motion(reduced)
        if len(motion):
            relative = np.abs(motion).max(axis=0) / mode_size(reduced)
            reason = (
                f"{where}, which define the frame, move by {relative.max():.1e} of the largest displacement of a mode "
                f"(mode {int(np.argmax(relative)) + 1})"
            )
            return judge("frame-condition", relative.max(), reason, {"motion": relative})
    return information("frame-condition", f"the file alone cannot show the condition of a {frame.kind} frame")


def held_motion(reduced: ReducedBody) -> tuple[Array, str]:
    """Return the motions that a nodal frame keeps at zero and that the file contains, (n, n_q) [m], and their names.

    These are six motions of a reference point (rotations times body length) or translations of fixed kept nodes.
    """
    frame = reduced.frame
    if frame.at and reduced.interface(frame.at).kind != "nodes":
        scale = np.repeat([1.0, body_length(reduced)], 3)
        return scale[:, None] * reduced.interface(frame.at).Psi, f"the six motions of interface {frame.at!r}"
    row_of = {int(node): k for k, node in enumerate(reduced.node_ids)}
    rows = [
        frame.axes[component] @ reduced.Phi[row_of[int(node)]]
        for node, component in frame.dofs
        if component < 3 and int(node) in row_of
    ]
    return np.array(rows).reshape(-1, reduced.n_q), f"{len(rows)} held translations"


def check_free_frequencies(reduced: ReducedBody) -> QualityRecord:
    """Compare the stored free-free frequencies with those computed from the moments and stiffness of the file.

    The frequencies depend on 1C, 2C, S, R, m, K and M together, so a wrong sign in one of these changes them.
    """
    stored = np.asarray(reduced.free_frequencies)
    if not reduced.is_held and not has_inertia(reduced):
        return information("free-frequencies", "the body has no inertia about some axis, so no free-free frequencies")
    try:
        omega2, _, is_massive = free_elastic_modes(reduced)
    except np.linalg.LinAlgError as none:
        return judge("free-frequencies", np.inf, f"moments and stiffness have no free-free modes: {none}")
    own = np.sqrt(np.maximum(omega2[is_massive], 0.0)) / (2 * np.pi)
    if not len(stored):
        return information("free-frequencies", "the file holds no free-free frequencies to compare with")
    try:
        error = frequency_distance(own, stored)
    except ValueError:
        reason = f"the file lists {len(stored)} free-free frequencies, its moments and stiffness give {len(own)}"
        return judge("free-frequencies", np.inf, reason, {"stored": stored, "recomputed": own})
    k = int(np.argmax(error))
    reason = f"largest relative difference is {error[k]:.1e}, of free-free mode {k + 1}"
    return judge("free-frequencies", error[k], reason, {"stored": stored, "recomputed": own})


def check_inertia_tensor(reduced: ReducedBody) -> QualityRecord:
    """Check for positive mass, and for a second moment about the centre of mass without negative eigenvalues.

    This is the triangle inequality of the principal moments: none exceeds the sum of the other two.
    """
    moments = reduced.moments
    if not moments.m > 0:
        return judge("inertia-tensor", np.inf, f"the mass is {moments.m:g}; expected a positive one")
    c = moments.center_of_mass
    R = moments.R - moments.m * np.outer(c, c)
    values = np.linalg.eigvalsh((R + R.T) / 2)
    scale = np.trace(moments.R)
    value = max(0.0, -float(values[0]) / scale) if scale > 0 else np.inf
    principal = np.linalg.eigvalsh(np.trace(R) * np.eye(3) - (R + R.T) / 2)
    reason = "principal moments " + ", ".join(f"{p:.4g}" for p in principal)
    reason += " can be those of a body" if value <= 1e-9 else " break the triangle inequality"
    return judge("inertia-tensor", value, reason, {"principal_moments": principal})


def check_energy_shares(reduced: ReducedBody) -> QualityRecord:
    """Check that the energy shares of the sources of each mode sum to one."""
    if not reduced.energy_shares.size:
        return information("energy-shares", "the file holds no energy shares")
    defect = np.abs(reduced.energy_shares.sum(axis=1) - 1)
    reason = f"largest distance of the sum from one is {defect.max():.1e}"
    return judge("energy-shares", defect.max(), reason, {"shares": reduced.energy_shares})


def momenta(reduced: ReducedBody) -> tuple[Array, Array]:
    """Return linear and angular momentum of each mode over the largest possible for its modal mass, (n_q,) each."""
    moments = reduced.moments
    mass = np.sqrt(np.where(np.diag(reduced.M) > 0, np.diag(reduced.M), 1.0))
    center = moments.center_of_mass
    angular = moments.C2 - np.cross(center, moments.C1, axis=0)
    inertia = np.trace(moments.J0) - 2 * moments.m * float(center @ center)
    linear = np.linalg.norm(moments.C1, axis=0) / np.sqrt(moments.m)
    return linear / mass, np.linalg.norm(angular, axis=0) / np.sqrt(max(inertia, np.finfo(float).tiny)) / mass


def mode_size(reduced: ReducedBody) -> Array:
    """Return the largest stored displacement of each mode, but at least that of a rigid body of the same mass, (n_q,).

    The mean displacement of a mode of unit modal mass is 1 / sqrt(m), even if all kept nodes are at rest in it.
    """
    size = np.linalg.norm(reduced.Phi, axis=1).max(axis=0, initial=0.0)
    at_ports = [np.linalg.norm(interface.Psi[:3], axis=0) for interface in reduced.interfaces]
    return np.asarray(np.max([size, np.full(reduced.n_q, 1 / np.sqrt(reduced.moments.m)), *at_ports], axis=0))


def body_length(reduced: ReducedBody) -> float:
    """Return the box diagonal of kept nodes and interfaces, or the radius of gyration if the diagonal is zero [m]."""
    points = [reduced.nodes, *(interface.position[None] for interface in reduced.interfaces)]
    length = float(np.linalg.norm(np.ptp(np.concatenate(points), axis=0))) if sum(map(len, points)) else 0.0
    return length or float(np.sqrt(np.trace(reduced.moments.J0) / reduced.moments.m)) or 1.0
