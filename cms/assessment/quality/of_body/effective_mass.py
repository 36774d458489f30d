"""Effective modal mass of a body that is driven at one interface, and the share of mass missing in its modes."""

from dataclasses import dataclass
from typing import Any

import numpy as np
import scipy.linalg as la

from cms.assessment.quality.errors import QualityError
from cms.assessment.quality.record import QualityRecord, information, judge
from cms.body.reduced_body import ReducedBody
from cms.linear_algebra.elastic_pencil import elastic_eigenvectors, stiffness_scale
from cms.reduction.free_pencil import whole_pencil, whole_port_rows
from fe_models.body.rigid_motion import rigid_motion_of_points
from fe_models.foundation.arrays import Array, frozen

__all__ = ["EffectiveMass", "check_driven_mass", "effective_mass", "effective_mass_at", "mass_record"]

DIRECTIONS = ("ux", "uy", "uz", "rx", "ry", "rz")


@dataclass(frozen=True, eq=False)
class EffectiveMass:
    """Modes of the reduced body with one interface fixed, and their effective masses for motion of that interface."""

    at: str  #: name of the fixed interface
    frequencies: Array  #: frequencies with the interface fixed, ascending, (n,) [Hz]
    mass: Array  #: effective mass and inertia about the interface by direction, (n, 6) [kg, kg m²], axes of B
    total: Array  #: mass and inertia of the rigid body about the interface by direction, (6,) [kg, kg m²], axes of B

    def __post_init__(self) -> None:
        for name in ("frequencies", "mass", "total"):
            object.__setattr__(self, name, frozen(getattr(self, name)))

    @property
    def share(self) -> Array:
        """Ratio of effective to total mass, (n, 6)."""
        return self.mass / np.where(self.total > 0, self.total, 1.0)

    @property
    def cumulative(self) -> Array:
        """Cumulative sum of the shares over the modes, (n, 6)."""
        return np.asarray(np.cumsum(self.share, axis=0))

    @property
    def remainder(self) -> Array:
        """Fraction of mass and inertia missing from the sum of effective masses, (6,); 0 for a massless direction."""
        return np.where(self.total > 0, 1.0 - self.share.sum(axis=0), 0.0)


def mass_record(found: EffectiveMass) -> dict[str, Any]:
    """Return effective masses in plain types."""
    return {
        "at": found.at,
        "directions": list(DIRECTIONS),
        "frequencies_hz": found.frequencies.tolist(),
        "mass": found.mass.tolist(),
        "share": found.share.tolist(),
        "cumulative_share": found.cumulative.tolist(),
        "total": found.total.tolist(),
        "remainder": found.remainder.tolist(),
    }


def effective_mass_at(reduced: ReducedBody, at: str) -> EffectiveMass:
    """Return the `effective_mass` of a body with modes and inertia at an interface that can be fixed.

    Raises
    ------
    QualityError
        If the nodes of the interface lie on one line, so that fixing it leaves a rotation free, or the file is
        inconsistent.
    """
    if not reduced.is_held and not can_be_held(reduced, at):
        raise QualityError(
            f"body {reduced.name!r}: interface {at!r}: its nodes lie on one line, so fixing it leaves a rotation free; "
            "take another interface"
        )
    try:
        return effective_mass(reduced, at)
    except np.linalg.LinAlgError as error:
        raise QualityError(f"body {reduced.name!r}: no modes with {at!r} held: {error}; run cms check") from error


def effective_mass(reduced: ReducedBody, at: str) -> EffectiveMass:
    """Return effective modal masses for base motion of an interface, from a modal file in any frame.

    (1) x = T q with the interface fixed: the rigid motion x_r = -G⁻¹ Psi q cancels Psi q, where G is the motion of the
        interface in the rigid modes. A body held to the ground is driven by the ground instead: x_r = 0, and the
        interface only provides the reference point
    (2) modes of Tᵀ M T, K*
    (3) participation L_k = z_kᵀ Tᵀ M X_r of unit rigid motions X_r about the interface; effective mass L_k²

    The sum over all modes of the full model is the rigid mass minus the mass at the interface itself.
    """
    pencil, rows = whole_pencil(reduced), whole_port_rows(reduced, at)
    back = 0 * rows[:, 6:] if reduced.is_held else -np.linalg.solve(rows[:, :6], rows[:, 6:])
    T = np.vstack([back, np.eye(reduced.n_q)])  # (1)
    M = T.T @ pencil.M @ T
    Z, is_massive = elastic_eigenvectors(reduced.K, (M + M.T) / 2, stiffness_scale(reduced.K, reduced.M))  # (2)
    Z = Z[:, is_massive]
    omega2 = np.einsum("kq,kl,lq->q", Z, reduced.K, Z)
    order = np.argsort(omega2)
    X_r = np.zeros((6 + reduced.n_q, 6))
    X_r[:6] = la.inv(rows[:, :6])  # unit motions of the reference point as motions of B
    L = Z[:, order].T @ (T.T @ (pencil.M @ X_r))  # (3)
    total = np.diag(X_r.T @ pencil.M @ X_r)
    frequencies = np.sqrt(np.maximum(omega2[order], 0.0)) / (2 * np.pi) / reduced.units.time
    return EffectiveMass(at, frequencies, L**2, np.where(total > 1e-12 * total_scale(total), total, 0.0))


def total_scale(total: Array) -> Array:
    """Return the scale of masses and of moments of inertia, (6,)."""
    return np.repeat([total[:3].max(), total[3:].max()], 3)


def check_driven_mass(reduced: ReducedBody) -> QualityRecord:
    """Report the largest fraction of translational mass missing from the sum of effective modal masses.

    The largest is taken over all interfaces that can be fixed. The missing fraction consists of the mass at the
    interface itself and the mass of higher modes; only a check with the full model distinguishes the two
    ("effective-mass").
    """
    if reduced.n_q == 0:
        return information("driven-mass", "the body has no modes")
    held = [interface.name for interface in reduced.interfaces if can_be_held(reduced, interface.name)]
    if not held:
        return information("driven-mass", "the body has no interface that could be driven")
    try:
        found = [effective_mass(reduced, name) for name in held]
    except np.linalg.LinAlgError as error:  # other records report impossible moments
        return information("driven-mass", f"the moments of the file give no modes with a fixed interface: {error}")
    largest = max(found, key=lambda one: one.remainder[:3].max())
    remainder = largest.remainder
    axis = int(np.argmax(remainder[:3]))
    reason = f"driven at {largest.at!r}, the modes carry these shares of mass and inertia: " + ", ".join(
        f"{name} {100 * (1 - r):.0f} %" for name, r in zip(DIRECTIONS, remainder, strict=True)
    )
    data = {
        "interfaces": held,
        "remainder": np.array([one.remainder for one in found]),
        "frequencies_hz": [one.frequencies for one in found],
        "share": [one.share for one in found],
    }
    return judge("driven-mass", remainder[axis], reason, data)


def can_be_held(reduced: ReducedBody, at: str) -> bool:
    """Return whether fixing this interface prevents all rigid motion; collinear nodes do not."""
    interface = reduced.interface(at)
    points = reduced.nodes[interface.members]
    if interface.kind != "nodes" or interface.Psi[3:].any():
        return True
    return bool(np.linalg.matrix_rank(rigid_motion_of_points(points, interface.position).reshape(-1, 6), tol=1e-9) == 6)
