"""Modes of a modal file over all dofs of its full model, reconstructed in the span of a mode set.

A file keeps its modes at some nodes only. If these nodes determine x in phi_file = [Psi_R Phi] x, the full shapes
follow, in any frame. The remaining difference at the nodes shows whether file, model and mode set belong together. If
translations do not determine x, rotations of kept points are added. If these do not suffice either (a beam that keeps
only its ends), the finishing step is repeated in the frame that the file names, and modes of equal frequency are
rotated to those of the file.
"""

from dataclasses import dataclass, replace
from typing import cast

import numpy as np

from cms.assessment.quality.record import QualityRecord, judge
from cms.assessment.quality.reference.ports import Ports
from cms.body.reduced_body import BodyFrame, ReducedBody, ReducedInterface
from cms.errors import BodyError, ModeSetError
from cms.modes.mode_set import ModeSet
from cms.reduction.basis.finishing import FinishedBasis, finish
from cms.reduction.basis.frames import FRAMES, Axes, Frame, HeldFrame, NodalFrame, frame_condition
from cms.reduction.basis.free_basis import FreeBasis, ShapeRounding
from cms.reduction.basis.node_results import kept_points
from cms.reduction.free_pencil import frequency_distance
from fe_models.body.fe_body import FEBody
from fe_models.foundation.arrays import Array, frozen

__all__ = ["FullShapes", "full_shapes", "same_body_record"]

WELL_DETERMINED = 1e-7  #: smallest over largest singular value of the nodal rows, below which x is undetermined
#: relative difference of two modal stiffnesses below which their modes may be rotated into each other
ONE_FREQUENCY = 1e-6


KNOWN_MASS = 1e-6  #: rounding error of the modal mass above which the record mentions it
ROUNDING_MARGIN = 10.0  #: factor on the rounding of columns of a mode set that a comparison tolerates


@dataclass(frozen=True, eq=False)
class FullShapes:
    """Modes of a file over all dofs, in mesh axes."""

    Phi: Array  #: modes over the dofs, (n_dof, n_q)
    Z: Array  #: coordinates of the modes in the elastic shapes of the mode set, (n, n_q)
    #: largest difference at kept nodes and interfaces beyond rounding, divided by a mode's largest displacement
    misfit: float

    def __post_init__(self) -> None:
        for name in ("Phi", "Z"):
            object.__setattr__(self, name, frozen(getattr(self, name)))


def full_shapes(body: FEBody, basis: FreeBasis, reduced: ReducedBody) -> FullShapes | None:
    """Compute the modes of a file over all dofs of the body of a mode set; None if they are undetermined."""
    if len(reduced.node_ids) and reduced.node_ids.max() >= len(body.nodes):
        return None
    X = np.hstack([basis.N, basis.Phi])
    wanted = np.vstack([reduced.Phi.reshape(-1, reduced.n_q), *(i.Psi for i in known_interfaces(body, reduced))])
    wanted = motion_scale(body, reduced)[:, None] * wanted
    rows = kept_motion(body, reduced, X)
    x = determined(rows, wanted)
    if x is None and reduced.kept is not None:
        rows = np.vstack([rows, body.length * kept_turns(body, reduced, X)])
        wanted = np.vstack([wanted, body.length * reduced.kept.rotation.reshape(-1, reduced.n_q)])
        x = determined(rows, wanted)
    if x is not None:
        Z = x[basis.N.shape[1] :]
        return FullShapes(X @ x, Z, misfit(rows @ x, wanted, rounding_of(basis, Z)))
    try:
        again = finished_in(body, basis, named_frame(reduced.frame))
    except (BodyError, ModeSetError):
        return None
    assert again.A is not None
    if again.Phi.shape[1] != reduced.n_q:
        return None
    own = kept_motion(body, reduced, again.Phi)
    wanted = wanted[: len(own)]
    turn = turned_onto(own, wanted, np.diag(reduced.K))
    Z = again.A @ turn
    return FullShapes(again.Phi @ turn, Z, misfit(own @ turn, wanted, rounding_of(basis, Z)))


def determined(rows: Array, wanted: Array) -> Array | None:
    """Return the least-squares solution x of rows x = wanted; None if the rows do not determine it."""
    size = np.linalg.norm(rows, axis=0)
    size = np.where(size > 0, size, 1.0)
    x, _, rank, singular = np.linalg.lstsq(rows / size, wanted, rcond=None)
    if rank < rows.shape[1] or not singular[-1] > WELL_DETERMINED * singular[0]:
        return None
    return np.asarray(x / size[:, None])


def rounding_of(basis: FreeBasis, Z: Array) -> ShapeRounding:
    """Return the rounding error that a comparison tolerates for shapes with coordinates Z in a mode set."""
    if basis.rounding is None:
        none = np.zeros(Z.shape[1])
        return ShapeRounding(none, none, none)
    return basis.rounding.of_combinations(ROUNDING_MARGIN * Z)


def kept_turns(body: FEBody, reduced: ReducedBody, X: Array) -> Array:
    """Return the rotations of the kept points in the columns X, axes of B, (n, k)."""
    assert reduced.kept is not None
    row_of = np.full(len(body.nodes), -1, np.int64)
    row_of[reduced.node_ids] = np.arange(len(reduced.node_ids))
    points = kept_points(replace(body, kept=reduced.node_ids[reduced.kept.nodes]), X, reduced.frame.axes, row_of)
    return np.asarray(points.rotation).reshape(-1, X.shape[1])


def turned_onto(found: Array, wanted: Array, stiffness: Array) -> Array:
    """Return the orthogonal matrix that best rotates modes of equal stiffness to the wanted ones, (n_q, n_q).

    Modes that are zero in the rows are not changed.
    """
    turn = np.eye(len(stiffness))
    is_apart = np.abs(np.diff(stiffness)) > ONE_FREQUENCY * np.maximum(stiffness[1:], stiffness[:-1])
    for cluster in np.split(np.arange(len(stiffness)), np.flatnonzero(is_apart) + 1):
        if found[:, cluster].any():
            U, _, Vt = np.linalg.svd(found[:, cluster].T @ wanted[:, cluster])
            turn[np.ix_(cluster, cluster)] = U @ Vt
    return turn


def kept_motion(body: FEBody, reduced: ReducedBody, X: Array) -> Array:
    """Return motions of kept nodes and reference points in columns X, axes of B, (n, k); rotations times length."""
    axes = reduced.frame.axes
    at_nodes = body.translations(X)[reduced.node_ids]
    rows = [np.einsum("ba,nbk->nak", axes, at_nodes).reshape(-1, X.shape[1])]
    turn = np.kron(np.eye(2), axes.T)
    rows += [turn @ (Ports.of_body(body, [each.name]).A @ X) for each in known_interfaces(body, reduced)]
    return motion_scale(body, reduced)[:, None] * np.vstack(rows)


def known_interfaces(body: FEBody, reduced: ReducedBody) -> list[ReducedInterface]:
    """Return the interfaces of the file that also exist in the model."""
    names = [interface.name for interface in body.interfaces]
    return [interface for interface in reduced.interfaces if interface.name in names]


def motion_scale(body: FEBody, reduced: ReducedBody) -> Array:
    """Return the scale of each kept motion, (n,): 1 for translations, the body length for rotations."""
    length = body.length
    ports = [np.repeat([1.0, length], 3)] * len(known_interfaces(body, reduced))
    return np.concatenate([np.ones(3 * len(reduced.nodes)), *ports])


def misfit(found: Array, wanted: Array, rounding: ShapeRounding) -> float:
    """Return the largest difference beyond rounding, divided by the largest motion of each mode."""
    largest = np.abs(wanted).max(axis=0, initial=0.0)
    distance = beyond(np.abs(found - wanted).max(axis=0, initial=0.0), rounding.motion)
    return float((distance / np.where(largest > 0, largest, 1.0)).max(initial=0.0))


def beyond(difference: Array, rounding: Array) -> Array:
    """Return the part of differences that exceeds rounding."""
    return np.maximum(np.abs(difference) - rounding, 0.0)


def finished_in(body: FEBody, basis: FreeBasis, frame: Frame | HeldFrame) -> FinishedBasis:
    """Apply the finishing step to the span of a mode set in a frame."""
    n = basis.Phi.shape[1]
    modes = ModeSet("again", basis.Phi, tuple(f"shape {k + 1}" for k in range(n)), np.full(n, np.nan))
    return finish(body, modes, frame_condition(body, frame))


def named_frame(frame: BodyFrame) -> Frame | HeldFrame:
    """Return the frame whose name is in the file."""
    x, y, z = frame.origin.tolist()
    axes = cast(Axes, tuple(tuple(float(v) for v in axis) for axis in frame.axes.T))
    if frame.kind == "nodal":
        dofs = None if frame.at or not len(frame.dofs) else tuple((int(n), int(c)) for n, c in frame.dofs)
        return NodalFrame(frame.at or None, (x, y, z), axes, dofs)
    if frame.kind == "held":
        return HeldFrame((x, y, z), axes)
    if frame.kind not in FRAMES:
        raise BodyError(f"frame kind {frame.kind!r} is unknown; expected one of {', '.join(FRAMES)}")
    return FRAMES[frame.kind](origin=(x, y, z), axes=axes)


def same_body_record(body: FEBody, basis: FreeBasis, reduced: ReducedBody, shapes: FullShapes | None) -> QualityRecord:
    """Return the record "same-body": the file has the free-free frequencies of the set, and modes in its span.

    Only the part of a difference that exceeds rounding of the columns of the set counts. A change e of a shape changes
    Phiᵀ M Phi by Phiᵀ M e + eᵀ M Phi + eᵀ M e, and Phiᵀ K Phi likewise. Rounding matters for modes of light nodes: they
    are combinations of nearly dependent columns in which motions of heavy nodes cancel.
    """
    own = basis.frequencies()
    stored = reduced.free_frequencies
    try:
        distance = frequency_distance(stored, own)
    except ValueError:
        reason = f"the mode set gives {len(own)} elastic free-free modes, the file holds {len(stored)}"
        return judge("same-body", np.inf, reason, {"set": own, "file": stored})
    allowed = rounding_of(basis, np.eye(len(basis.omega2))[:, basis.is_massive][:, : len(distance)])
    omega = np.sqrt(basis.omega2[basis.is_massive][: len(distance)])
    frequencies = float(beyond(distance, allowed.mass + allowed.stiffness / omega).max(initial=0.0))
    reason = f"beyond rounding, free-free frequencies of file and mode set differ by {frequencies:.1e}"
    if shapes is None:
        reason += "; its kept nodes do not determine the modes over the whole body"
        return judge("same-body", frequencies, reason, {"set": own, "file": stored})
    allowed = rounding_of(basis, shapes.Z)
    stiff = np.sqrt(np.diag(reduced.K))
    stiff = np.where(stiff > 0, stiff, 1.0)
    K = (shapes.Phi.T @ (body.K @ shapes.Phi) - reduced.K) / np.outer(stiff, stiff)
    M = shapes.Phi.T @ (body.M @ shapes.Phi) - reduced.M
    stiffness, mass = (
        float(beyond(difference, each[:, None] + each + np.outer(each, each)).max(initial=0.0))
        for difference, each in ((K, allowed.stiffness / stiff), (M, allowed.mass))
    )
    reason += f", modes at its nodes by {shapes.misfit:.1e}, Phiᵀ K Phi by {stiffness:.1e}, Phiᵀ M Phi by {mass:.1e}"
    lost = allowed.mass.max(initial=0.0)
    if lost > KNOWN_MASS:
        reason += f"; rounding of the columns hides differences of Phiᵀ M Phi up to {2 * lost:.1e}"
    return judge(
        "same-body", max(frequencies, shapes.misfit, stiffness, mass), reason,
        {"frequencies": frequencies, "misfit": shapes.misfit, "stiffness": stiffness, "mass": mass},
    )  # fmt: skip
