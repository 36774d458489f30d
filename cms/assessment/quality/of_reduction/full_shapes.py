"""The modes of a modal file over all dofs of its full model, found again in the span of a mode set.

A file keeps its modes at some nodes only. Where those determine x in phi_file = [Psi_R Phi] x, the full shapes follow,
in any frame; what is left at the nodes says whether file, model and mode set belong together. Where they do so only
with the rotations of kept points, these are taken too. Else (a beam that keeps its ends) the mode set is finished again
in the frame the file names, and modes of one frequency are turned onto those of the file.
"""

from dataclasses import dataclass, replace
from typing import cast

import numpy as np

from cms.assessment.quality.record import QualityRecord, judge
from cms.assessment.quality.reference.free_basis import FreeBasis
from cms.assessment.quality.reference.free_pencil import frequency_distance
from cms.assessment.quality.reference.ports import Ports
from cms.body.reduced_body import BodyFrame, ReducedBody, ReducedInterface
from cms.errors import BodyError, ModeSetError
from cms.modes.mode_set import ModeSet
from cms.reduction.basis.finishing import FinishedBasis, finish
from cms.reduction.basis.frames import FRAMES, Axes, Frame, HeldFrame, NodalFrame, frame_condition
from cms.reduction.basis.node_motion import kept_points
from fe_models.body.fe_body import FEBody
from fe_models.foundation.arrays import Array, frozen

__all__ = ["FullShapes", "full_shapes", "same_body_record"]

WELL_DETERMINED = 1e-7  #: smallest over largest singular value of the nodal rows, below which x is not determined
ONE_FREQUENCY = 1e-6  #: relative difference of two stiffnesses, below which their modes may be combined


@dataclass(frozen=True, eq=False)
class FullShapes:
    """Modes of a file over all dofs, mesh axes."""

    Phi: Array  #: (n_dof, n_q)
    misfit: float  #: largest distance at the kept nodes and interfaces, over a mode's largest displacement

    def __post_init__(self) -> None:
        object.__setattr__(self, "Phi", frozen(self.Phi))


def full_shapes(body: FEBody, basis: FreeBasis, reduced: ReducedBody) -> FullShapes | None:
    """Find the file's modes over all dofs of a mode set's body; None where they cannot be known."""
    if len(reduced.node_ids) and reduced.node_ids.max() >= len(body.nodes):
        return None
    X = np.hstack([basis.N, basis.Phi])
    wanted = np.vstack([reduced.Phi.reshape(-1, reduced.n_q), *(i.Psi for i in known_interfaces(body, reduced))])
    wanted = motion_scale(body, reduced)[:, None] * wanted
    rows = kept_motion(body, reduced, X)
    found = determined(X, rows, wanted)
    if found is None and reduced.kept is not None:
        turns = body.length * kept_turns(body, reduced, X)
        own = body.length * reduced.kept.rotation.reshape(-1, reduced.n_q)
        found = determined(X, np.vstack([rows, turns]), np.vstack([wanted, own]))
    if found is not None:
        return found
    try:
        again = finished_in(body, basis, named_frame(reduced.frame)).Phi
    except (BodyError, ModeSetError):
        return None
    if again.shape[1] != reduced.n_q:
        return None
    again = again @ turned_onto(kept_motion(body, reduced, again), wanted, np.diag(reduced.K))
    return FullShapes(again, misfit(kept_motion(body, reduced, again), wanted))


def determined(X: Array, rows: Array, wanted: Array) -> FullShapes | None:
    """Return X x of the x nearest to rows x = wanted; None where the rows do not determine it."""
    size = np.linalg.norm(rows, axis=0)
    size = np.where(size > 0, size, 1.0)
    x, _, rank, singular = np.linalg.lstsq(rows / size, wanted, rcond=None)
    if rank < X.shape[1] or not singular[-1] > WELL_DETERMINED * singular[0]:
        return None
    return FullShapes(X @ (x / size[:, None]), misfit(rows / size @ x, wanted))


def kept_turns(body: FEBody, reduced: ReducedBody, X: Array) -> Array:
    """Return the rotations of the kept points with columns X, axes of B, (n, k)."""
    assert reduced.kept is not None
    row_of = np.full(len(body.nodes), -1, np.int64)
    row_of[reduced.node_ids] = np.arange(len(reduced.node_ids))
    points = kept_points(replace(body, kept=reduced.node_ids[reduced.kept.nodes]), X, reduced.frame.axes, row_of)
    assert points is not None
    return np.asarray(points.rotation).reshape(-1, X.shape[1])


def turned_onto(found: Array, wanted: Array, stiffness: Array) -> Array:
    """Return the orthogonal matrix that rotates modes of equal stiffness closest to the wanted ones, (n_q, n_q).

    Modes that the rows do not show stay as they are.
    """
    turn = np.eye(len(stiffness))
    is_apart = np.abs(np.diff(stiffness)) > ONE_FREQUENCY * np.maximum(stiffness[1:], stiffness[:-1])
    for cluster in np.split(np.arange(len(stiffness)), np.flatnonzero(is_apart) + 1):
        if found[:, cluster].any():
            U, _, Vt = np.linalg.svd(found[:, cluster].T @ wanted[:, cluster])
            turn[np.ix_(cluster, cluster)] = U @ Vt
    return turn


def kept_motion(body: FEBody, reduced: ReducedBody, X: Array) -> Array:
    """Motion of the kept nodes and reference points with columns X, axes of B, rotations times the length, (n, k)."""
    axes = reduced.frame.axes
    at_nodes = body.translations(X)[reduced.node_ids]
    rows = [np.einsum("ba,nbk->nak", axes, at_nodes).reshape(-1, X.shape[1])]
    turn = np.kron(np.eye(2), axes.T)
    rows += [turn @ (Ports.of_body(body, [each.name]).A @ X) for each in known_interfaces(body, reduced)]
    return motion_scale(body, reduced)[:, None] * np.vstack(rows)


def known_interfaces(body: FEBody, reduced: ReducedBody) -> list[ReducedInterface]:
    """Return the interfaces of the file that the model has too."""
    names = [interface.name for interface in body.interfaces]
    return [interface for interface in reduced.interfaces if interface.name in names]


def motion_scale(body: FEBody, reduced: ReducedBody) -> Array:
    """1 for translations, the body length for rotations, one per kept motion, (n,)."""
    length = body.length or 1.0
    ports = [np.repeat([1.0, length], 3)] * len(known_interfaces(body, reduced))
    return np.concatenate([np.ones(3 * len(reduced.nodes)), *ports])


def misfit(found: Array, wanted: Array) -> float:
    """Largest distance over the largest motion of each mode."""
    largest = np.abs(wanted).max(axis=0, initial=0.0)
    return float((np.abs(found - wanted).max(axis=0) / np.where(largest > 0, largest, 1.0)).max(initial=0.0))


def finished_in(body: FEBody, basis: FreeBasis, frame: Frame | HeldFrame) -> FinishedBasis:
    """Finish the span of the mode set in a frame."""
    n = basis.Phi.shape[1]
    modes = ModeSet("again", basis.Phi, tuple(f"shape {k + 1}" for k in range(n)), np.full(n, np.nan))
    return finish(body, modes, frame_condition(body, frame))


def named_frame(frame: BodyFrame) -> Frame | HeldFrame:
    """Return the frame that a file names."""
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
    """Record "same-body": free-free frequencies of the file are those of the set, its modes lie in the set's span."""
    own = basis.frequencies()
    stored = reduced.free_frequencies
    try:
        distance = float(frequency_distance(stored, own).max(initial=0.0))
    except ValueError:
        reason = f"the mode set gives {len(own)} elastic free-free modes, the file holds {len(stored)}"
        return judge("same-body", np.inf, reason, {"set": own, "file": stored})
    reason = f"free-free frequencies of file and mode set differ by {distance:.1e}"
    if shapes is None:
        reason += "; its kept nodes do not determine the modes over the whole body"
        return judge("same-body", distance, reason, {"set": own, "file": stored})
    K = shapes.Phi.T @ (body.K @ shapes.Phi)
    stiff = np.sqrt(np.outer(np.diag(reduced.K), np.diag(reduced.K)))
    defect = float((np.abs(K - reduced.K) / np.where(stiff > 0, stiff, 1.0)).max(initial=0.0))
    mass = float(np.abs(shapes.Phi.T @ (body.M @ shapes.Phi) - reduced.M).max(initial=0.0))
    reason += f", modes at its nodes by {shapes.misfit:.1e}, Phiᵀ K Phi by {defect:.1e}, Phiᵀ M Phi by {mass:.1e}"
    return judge(
        "same-body", max(distance, shapes.misfit, defect, mass), reason,
        {"frequencies": distance, "misfit": shapes.misfit, "stiffness": defect, "mass": mass},
    )  # fmt: skip
