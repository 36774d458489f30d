"""Modes of several samples of a body in the same modal coordinates, so that their matrices can be interpolated.

Modes of different samples have arbitrary signs, change places where their frequencies cross, and mix where these are
close. In mean axes, and without the damping that ratios of modes state, they are aligned with a reference sample [1]_:

(1) rows of the shapes: translations of the kept nodes, their rotations where known, and motion of the interfaces;
    rotations times the size of the body
(2) orthonormal columns: X = U (XᵀX)^(1/2). The shapes are orthonormal in the mass of the body, which is not
    known at the kept nodes; this restores it
(3) Q = argmin |U Q - U_reference| over orthogonal Q, from the singular value decomposition of Uᵀ U_reference
    (Procrustes). The singular values are the cosines of the angles between the two spaces of shapes
(4) Phi Q, congruence transformation of all matrices. Then the coordinates are scaled to the mass m of the body: shapes
    have no unit, and M = m 1
(5) in moments and rotations of the shapes, lengths along each axis are divided by the radius of gyration
    g_a = sqrt(R_aa / m): of bodies of different length nothing but the radii is then different

References
----------
.. [1] Panzer et al. (2010) and Amsallem & Farhat (2011), docs/bibliography.md.
"""

from dataclasses import dataclass, replace

import numpy as np

from cms.body.reduced_body import BodyFrame, ReducedBody
from cms.errors import BodyError
from cms.reduction.basis.damping import modal_damping, stated_damping
from cms.reduction.basis.frames import FRAMES, Axes, Frame, NodalFrame, TisserandFrame
from cms.reduction.frame_conversion import Change, changed_body, convert_frame
from cms.reduction.free_pencil import free_elastic_modes
from fe_models.foundation.arrays import Array

__all__ = ["AlignedSample", "align", "divisors", "in_frame", "in_mean_axes", "recombined", "rescaled"]

FLAT = 1e-6  #: radius of gyration along an axis, relative to the largest, below which the body has no extension

CONVERTED = "frame converted from"  #: key of the provenance of bodies whose frame was converted
VISIBLE = 1e-7  #: smallest singular value of the rows of all modes, relative to the largest, that alignment needs
REMEDY = "Take samples at smaller distances, or more modes beyond the cutoff (beyond in [reduction])"
LEAST_COSINE = 0.5  #: smallest cosine of the angles between the spaces of two samples, beyond which they do not match


@dataclass(frozen=True, eq=False)
class AlignedSample:
    """A sample in the modal coordinates of the reference, scaled to the mass of the body."""

    body: ReducedBody  #: after steps (4) and (5): M = m 1, K = m times `omega2`
    radii: Array  #: g_a about the origin of the frame, zero for a body in a plane or on a line, (3,) [m]
    omega2: Array  #: Qᵀ diag(omega²) Q, (n_q, n_q) [1/s²]

    @property
    def log_stiffness(self) -> Array:
        """Matrix logarithm of `omega2`, (n_q, n_q)."""
        values, vectors = np.linalg.eigh(self.omega2)
        return np.asarray(vectors * np.log(values) @ vectors.T)


def align(sample: ReducedBody, reference: ReducedBody, name: str, reference_name: str) -> AlignedSample:
    """Return a sample with its modes aligned with those of the reference.

    Parameters
    ----------
    name, reference_name
        What messages call the two, such as "length = 1.2".

    Raises
    ------
    BodyError
        If modes cannot be distinguished at the kept nodes, or the shapes of both samples span different spaces.
    """
    U, V = orthonormal_rows(name, sample), orthonormal_rows(reference_name, reference)
    left, cosines, right = np.linalg.svd(U.T @ V)  # (3)
    if cosines[-1] < LEAST_COSINE:
        k = int(np.argmax(np.abs(left[:, -1])))
        raise BodyError(
            f"parametric body: {name}: {np.count_nonzero(cosines < LEAST_COSINE)} of {sample.n_q} modes have no "
            f"counterpart in {reference_name}, first of all mode {k + 1}, {sample.labels[k]!r} (cosine "
            f"{cosines[-1]:.2f}); expected the same modes in all samples. {REMEDY}"
        )
    Q = left @ right
    scaled = recombined(sample, Q * np.sqrt(sample.moments.m))  # (4)
    radii = np.sqrt(np.maximum(np.diag(sample.moments.R), 0.0) / sample.moments.m)
    radii[radii < FLAT * radii.max()] = 0.0
    return AlignedSample(
        rescaled(scaled, divisors(radii), float(np.linalg.norm(radii))), radii, Q.T @ (np.diag(sample.K)[:, None] * Q)
    )


def orthonormal_rows(name: str, body: ReducedBody) -> Array:
    """Return U of steps (1) and (2), (n_rows, n_q)."""
    left, _, right = rows_of_shapes(name, body)
    return np.asarray(left @ right)


def rows_of_shapes(name: str, body: ReducedBody) -> tuple[Array, Array, Array]:
    """Return the singular value decomposition of X of step (1): (n_rows, n_q), (n_q,), (n_q, n_q)."""
    points = np.concatenate([body.nodes, *(interface.position[None] for interface in body.interfaces)])
    size = float(np.linalg.norm(np.ptp(points, axis=0))) if len(points) else 0.0
    scale = np.array([1.0, 1, 1, size, size, size])[:, None]
    rotations = [] if body.kept is None else [size * body.kept.rotation.reshape(-1, body.n_q)]
    of_interfaces = [scale * interface.Psi for interface in body.interfaces]
    X = np.vstack([body.Phi.reshape(-1, body.n_q), *rotations, *of_interfaces])
    left, sizes, right = np.linalg.svd(X, full_matrices=False)
    if len(sizes) < body.n_q or sizes[-1] <= VISIBLE * sizes[0]:
        n = int(np.count_nonzero(sizes > VISIBLE * sizes.max(initial=0.0)))
        raise BodyError(
            f"parametric body: {name}: its kept nodes and interfaces distinguish only {n} of {body.n_q} modes; keep "
            "more nodes (keep in the table [body] of the job), or take fewer modes"
        )
    return left, sizes, right


def recombined(body: ReducedBody, Z: Array) -> ReducedBody:
    """Return the body over the shapes Phi Z, (n_q, n_new), which need not diagonalise K."""
    change = Change(np.zeros((6, body.n_q)), Z, np.zeros(3), np.eye(3))
    changed = changed_body(replace(body, geometric=None), body.frame, change, np.ones(Z.shape[1]), None)
    return replace(
        changed,
        M=Z.T @ body.M @ Z,
        K=Z.T @ body.K @ Z,
        geometric=None if body.geometric is None else body.geometric.transformed(Z),
        provenance=body.provenance,
    )


def divisors(radii: Array) -> Array:
    """Return the lengths of step (5) along the axes, (3,): radii of gyration, 1 without extension."""
    return np.where(radii > 0, radii, 1.0)


def rescaled(body: ReducedBody, lengths: Array, length: float) -> ReducedBody:
    """Return the body with positions in its moments divided by lengths, (3,), and rotations times a length."""
    moments, kept = body.moments, body.kept
    turns = np.array([1.0, 1, 1, length, length, length])[:, None]
    return replace(
        body,
        moments=replace(
            moments,
            S=moments.S / lengths,
            R=moments.R / np.outer(lengths, lengths),
            P=moments.P / lengths[:, None, None],
        ),
        interfaces=tuple(replace(each, Psi=turns * each.Psi) for each in body.interfaces),
        kept=None if kept is None else replace(kept, rotation=length * kept.rotation),
    )


# mean axes, and the way back --------------------------------------------------------------------------------------


def in_mean_axes(sample: ReducedBody) -> ReducedBody:
    """Return a sample in the mean-axis frame with the axes of its frame; a held body stays in the frame of the ground.

    The damping of its modes that the provenance states is left out.
    """
    sample = replace(sample, D=sample.D - damping_of_modes(sample))
    return sample if sample.is_held else convert_frame(sample, TisserandFrame(axes=axes_of(sample.frame)))


def in_frame(body: ReducedBody, frame: BodyFrame, provenance: dict[str, str]) -> ReducedBody:
    """Return a body of mean axes in another frame, with this provenance and the damping that it states.

    Interpolation leaves a momentum of its modes, which the conversion removes. Rotated and distributed loads of the
    geometric stiffness are left out: they follow from the moments, which interpolated ones do not exactly.
    """
    axes, origin, made = axes_of(frame), vector(frame.origin), body
    if not body.is_held:
        free = np.sqrt(free_elastic_modes(body)[0][: len(body.free_frequencies)]) / (2 * np.pi)
        to: Frame = (
            NodalFrame(
                frame.at or None, origin, axes, None if frame.at else tuple((int(k), int(c)) for k, c in frame.dofs)
            )
            if frame.kind == "nodal"
            else FRAMES[frame.kind](origin=origin, axes=axes)
        )
        made = replace(convert_frame(body, to), free_frequencies=free)
    geometric = None if made.geometric is None else replace(made.geometric, turned=None, spread=None)
    made = replace(made, provenance=provenance, geometric=geometric)
    return replace(made, D=made.D + damping_of_modes(made))


def damping_of_modes(body: ReducedBody) -> Array:
    """Return the damping of the modes that the provenance states, (n_q, n_q) [1/s]; zero if it states none."""
    damping = stated_damping(body)
    if damping is None or CONVERTED in body.provenance:
        return np.zeros_like(body.K)
    return modal_damping(damping, body.M, body.K, second=body.units.time)


def axes_of(frame: BodyFrame) -> Axes:
    """Return x, y and z axis of a frame in mesh axes."""
    x, y, z = (vector(axis) for axis in frame.axes.T)
    return x, y, z


def vector(values: Array) -> tuple[float, float, float]:
    """Return three numbers as a tuple."""
    x, y, z = (float(value) for value in values)
    return x, y, z
