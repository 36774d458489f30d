"""Deformation error of a mode set along a reference motion (docs/theory.md §8).

    eps(t) = min_x |u_ref(t) - [Psi_R Phi] x|_W / max_t min_y |u_ref(t) - Psi_R y|_W

in the norms of M, K (energy) and the nodal translations. Both minima include rigid-body motion, so the result does not
depend on the frames of u_ref and of the mode set.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from types import MappingProxyType

import numpy as np

from cms.assessment.quality.errors import QualityError
from cms.assessment.quality.record import QualityRecord, judge
from cms.assessment.quality.reference.full_reference import Space
from cms.assessment.quality.reference.transient import Snapshots
from cms.body.reduced_body import ReducedBody
from cms.reduction.basis.free_basis import FreeBasis
from fe_models.body.rigid_motion import rigid_motion_of_points
from fe_models.foundation.arrays import Array, frozen

__all__ = [
    "NORMS",
    "DeformationError",
    "deformation_error",
    "deformation_record",
    "nodal_deformation_error",
    "recovered_displacements",
]

NORMS = ("M", "K", "nodal")
NO_DEFORMATION = 1e-10  #: M-norm of the deformation relative to the whole motion, below which it is rounding


@dataclass(frozen=True, eq=False)
class DeformationError:
    """Part of a reference deformation outside the span of a mode set, over time, in several norms."""

    t: Array  #: times, (n_t,) [time unit of the body]
    error: Mapping[str, Array]  #: eps(t) in each norm, (n_t,), from 0 to 1
    size: Mapping[str, Array]  #: deformation |u_ref(t)| in each norm divided by its maximum, (n_t,)

    def __post_init__(self) -> None:
        object.__setattr__(self, "t", frozen(self.t))
        object.__setattr__(self, "error", MappingProxyType({k: frozen(v) for k, v in self.error.items()}))
        object.__setattr__(self, "size", MappingProxyType({k: frozen(v) for k, v in self.size.items()}))

    def largest(self, norm: str) -> float:
        """Return max_t eps(t) in this norm."""
        return float(self.error[norm].max())


def deformation_error(body: Space, basis: FreeBasis, snapshots: Snapshots) -> DeformationError:
    """Compute eps(t) of a mode set in all norms of `NORMS`.

    Snapshots may contain any small rigid-body motion. Their columns are projected once, independent of the number of
    times.

    Raises
    ------
    QualityError
        If the snapshots are of another body, or nothing deforms.
    """
    U, a = snapshots.columns, snapshots.amplitudes
    if len(U) != len(basis.Phi):
        raise QualityError(f"deformation error: snapshots over {len(U)} dofs, the body has {len(basis.Phi)}")
    M_U = body.M @ U
    without_rigid = U - basis.N @ (basis.N.T @ M_U)
    X = basis.vibrating
    in_M = without_rigid - X @ (X.T @ (body.M @ without_rigid))
    in_K = without_rigid - basis.Phi @ ((basis.Phi.T @ (body.K @ without_rigid)) / basis.omega2[:, None])
    error = {
        "M": lengths(in_M, body.M @ in_M, a),
        "K": lengths(in_K, body.K @ in_K, a),
    }
    size = {
        "M": lengths(without_rigid, body.M @ without_rigid, a),
        "K": lengths(without_rigid, body.K @ without_rigid, a),
    }
    if not size["M"].max() > NO_DEFORMATION * lengths(U, M_U, a).max():
        raise QualityError("deformation error: the reference motion does not deform the body")
    rows, rigid, shapes = (body.translation_rows(part) for part in (without_rigid, basis.N, basis.Phi))
    error["nodal"], size["nodal"] = nodal_lengths(rows, rigid, shapes, a)
    return relative(snapshots.t, error, size)


def nodal_deformation_error(reduced: ReducedBody, u: Array, t: Array) -> DeformationError:
    """Compute eps(t) in the nodal norm, from a modal file and displacements of its kept nodes.

    Parameters
    ----------
    u
        Displacements of the nodes of the file, in B, from a body with more modes or a floatframe result,
        (n_kept, 3, n_t) [m].
    t
        Times, (n_t,).
    """
    if u.shape != (len(reduced.nodes), 3, len(t)):
        raise QualityError(
            f"deformation error: body {reduced.name!r} keeps {len(reduced.nodes)} nodes; expected displacements "
            f"{(len(reduced.nodes), 3, len(t))}, got {u.shape}"
        )
    center = reduced.nodes.mean(axis=0)
    rigid = rigid_motion_of_points(reduced.nodes, center).reshape(-1, 6)
    shapes = reduced.Phi.reshape(-1, reduced.n_q)
    error, size = nodal_lengths(u.reshape(-1, len(t)), rigid, shapes, np.eye(len(t)))
    return relative(t, {"nodal": error}, {"nodal": size})


def recovered_displacements(source: ReducedBody, q: Array, into: ReducedBody) -> Array:
    """Return displacements of the kept nodes in a motion of one reduced body, in axes of another one of the same part.

    Parameters
    ----------
    source
        Body that moved; it has more modes.
    q
        Modal coordinates of this body over time, as in a floatframe trajectory, (n_t, n_q).
    into
        Body to be assessed; its kept nodes must be among those of the source.

    Returns
    -------
    Array
        Displacements for `nodal_deformation_error` of `into`, (n_kept, 3, n_t) [m].

    Raises
    ------
    QualityError
        If the modes do not fit, or a node is missing.
    """
    if q.ndim != 2 or q.shape[1] != source.n_q:
        raise QualityError(
            f"body {source.name!r}: has {source.n_q} modes, expected q (n_t, {source.n_q}), got {q.shape}"
        )
    row_of = {int(node): k for k, node in enumerate(source.node_ids)}
    missing = [int(node) for node in into.node_ids if int(node) not in row_of]
    if missing:
        raise QualityError(
            f"body {source.name!r}: lacks {len(missing)} nodes of {into.name!r}, first node {missing[0]}; both must be "
            "reduced from one model"
        )
    rows = [row_of[int(node)] for node in into.node_ids]
    turn = into.frame.axes.T @ source.frame.axes
    return np.asarray(np.einsum("ab,nbk,tk->nat", turn, source.Phi[rows], q, optimize=True))


def nodal_lengths(rows: Array, rigid: Array, shapes: Array, a: Array) -> tuple[Array, Array]:
    """Return norms of displacements outside rigid motion and shapes, and outside rigid motion only, (n_t,) each."""
    outside_rigid = outside(rows, rigid)
    outside_all = outside(outside_rigid, np.hstack([rigid, shapes]))
    return lengths(outside_all, outside_all, a), lengths(outside_rigid, outside_rigid, a)


def outside(rows: Array, X: Array) -> Array:
    """Return the part of columns orthogonal to the span of X, which may be rank-deficient."""
    size = np.linalg.norm(X, axis=0)
    U, singular, _ = np.linalg.svd(X / np.where(size > 0, size, 1.0), full_matrices=False)
    Q = U[:, singular > 1e-10 * singular.max(initial=0.0)]
    for _ in range(2):  # two passes suffice
        rows = rows - Q @ (Q.T @ rows)
    return rows


def lengths(U: Array, W_U: Array, a: Array) -> Array:
    """Return the W-norm of U a(t) for all times, (n_t,)."""
    G = U.T @ W_U
    squared = np.einsum("kt,kt->t", a, ((G + G.T) / 2) @ a)
    return np.asarray(np.sqrt(np.maximum(squared, 0.0)))


def relative(t: Array, error: Mapping[str, Array], size: Mapping[str, Array]) -> DeformationError:
    """Divide errors and sizes by the largest size in each norm."""
    largest = {norm: float(values.max()) for norm, values in size.items()}
    for norm, value in largest.items():
        if not value > 0:
            raise QualityError(f"deformation error: the reference motion is zero in the norm {norm}")
    return DeformationError(
        t,
        {norm: values / largest[norm] for norm, values in error.items()},
        {norm: values / largest[norm] for norm, values in size.items()},
    )


def deformation_record(deformation: DeformationError) -> QualityRecord:
    """Return the record "deformation-error": the largest eps(t) in the energy norm, or in the available norm."""
    norm = "K" if "K" in deformation.error else next(iter(deformation.error))
    k = int(np.argmax(deformation.error[norm]))
    parts = ", ".join(f"{name} {100 * deformation.largest(name):.3g} %" for name in deformation.error)
    reason = f"largest over time: {parts}; in the {norm} norm at t = {deformation.t[k]:.4g}"
    data = {"t": deformation.t, "error": dict(deformation.error), "size": dict(deformation.size)}
    return judge("deformation-error", deformation.largest(norm), reason, data)
