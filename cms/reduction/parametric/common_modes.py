"""Samples of a family over the same modes, also if modes cross the cutoff of the mode set between them.

A mode that crosses the cutoff leaves the mode set, and another enters, so the sets of two samples span different
spaces. Therefore samples have further modes beyond the cutoff (`with_modes_beyond`), and each gets those that the set
of any other sample contains:

(1) of each sample in mean axes, with M-orthonormal modes: B, an orthonormal basis of the span of its mode set, (N, n),
    and E, a basis of the orthogonal complement, which the modes beyond the cutoff span, (N, k)
(2) W, the common space in the modes of the reference r: the span of its set, and the directions of X_r⁺ X B of any
    sample outside of it. X are rows of the shapes (`alignment`), scaled to the mass; X_r⁺ X gives the modes of a sample
    as combinations of those of the reference, by least squares
(3) F = [B, E Q] of each sample: Q are the directions of E nearest to W, from the singular vectors of Eᵀ X⁺ X_r W
(4) congruence transformation of the sample to new modes in the span of F

Every sample contains the whole span of its own mode set. So its frequencies are not above those of the set, and its
static responses remain as exact as those of the set.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
import scipy.linalg as la

from cms.body.reduced_body import ReducedBody
from cms.errors import BodyError
from cms.linear_algebra.elastic_pencil import elastic_eigenvectors
from cms.modes.mode_sets.extra_columns import BEYOND
from cms.reduction.basis.frames import TisserandFrame
from cms.reduction.frame_conversion import converted
from cms.reduction.parametric.alignment import REMEDY, axes_of, damping_of_modes, recombined, rows_of_shapes
from cms.reduction.recovery.matrices import tables_of_fewer_modes
from fe_models.foundation.arrays import Array

__all__ = ["has_modes_beyond", "in_common_modes"]

NO_SHARE = 1e-6  #: largest share of a column in the energy of a mode, below which it is a rigid-body motion
OUTSIDE = 0.3  #: sine of the angle to the common space, above which a direction of a sample is added to it


def has_modes_beyond(sample: ReducedBody) -> bool:
    """Return whether some modes of a sample lie beyond the cutoff of its mode set."""
    return sample.columns is not None and BEYOND in sample.columns.groups


def in_common_modes(samples: Sequence[ReducedBody], names: Sequence[str], reference: int) -> list[ReducedBody]:
    """Return samples with modes beyond the cutoff, each reduced to the modes that all have in common.

    Parameters
    ----------
    samples
        Samples with modes beyond the cutoff of their mode sets, which may have different numbers of modes.
    names
        What messages call them.
    reference
        Index of the sample in whose modes the common space is found.

    Raises
    ------
    BodyError
        If modes cannot be distinguished at the kept nodes, or a sample has too few modes beyond the cutoff.
    """
    split = [split_modes(sample, name) for sample, name in zip(samples, names, strict=True)]
    r = split[reference]
    W = r.B  # (2)
    for each in split:
        C = r.coordinates(each) @ each.B
        directions, sines, _ = np.linalg.svd(C - W @ (W.T @ C), full_matrices=False)
        W = np.hstack([W, directions[:, sines > OUTSIDE]])
    found = []
    for sample, name, each in zip(samples, names, split, strict=True):
        n_new = W.shape[1] - each.B.shape[1]
        if n_new > each.E.shape[1]:
            raise BodyError(
                f"parametric body: {name}: the mode sets of all samples contain {n_new} modes that its own does not, "
                f"but it has {each.E.shape[1]} modes beyond the cutoff. {REMEDY}"
            )
        Q = np.linalg.svd(each.E.T @ each.coordinates(r) @ W)[0][:, :n_new]  # (3)
        found.append(restricted(sample, each, np.hstack([each.B, each.E @ Q])))
    return found


@dataclass(frozen=True, eq=False)
class SplitModes:
    """Modes of a sample in mean axes, with their part beyond the cutoff."""

    X: tuple[Array, Array, Array]  #: singular value decomposition of rows of the shapes, (n_rows, N)
    B: Array  #: orthonormal basis of the span of the mode set, (N, n)
    E: Array  #: orthonormal basis of its complement, (N, k)
    omega2: Array  #: squared frequencies, (N,) [1/s²]
    of_frame: Array  #: these modes as combinations of those of the frame of the sample, without rigid motion, (N, N)

    def coordinates(self, other: "SplitModes") -> Array:
        """Return X⁺ X_other, the modes of another sample as combinations of these, (N, N_other)."""
        (left, sizes, right), (others_left, others_sizes, others_right) = self.X, other.X
        return np.asarray((right.T / sizes) @ (left.T @ others_left) @ (others_sizes[:, None] * others_right))


def split_modes(sample: ReducedBody, name: str) -> SplitModes:
    """Return B and E of step (1) from the source columns of a sample.

    Column c is the combination z_ck = F_ck / omega_k² of the modes, because F_ck is its work with the force K phi_k. An
    independent column has Σ_k A_ck z_ck = 1, and so a share in the energy of some mode; rigid-body motions and
    redundant columns have none but rounding. The rank of the set is known: columns beyond the cutoff are missing. In
    the norm K + omega_1² M, stiff static columns and soft modes have similar size.
    """
    mean, of_frame = sample, np.eye(sample.n_q)
    if not sample.is_held:
        mean, change = converted(sample, TisserandFrame(axes=axes_of(sample.frame)))
        of_frame = change.Z
    assert mean.columns is not None
    omega2 = np.diag(mean.K)
    is_beyond = np.array([group == BEYOND for group in mean.columns.groups])
    is_elastic = mean.columns.shares().max(axis=0) > NO_SHARE
    norm = np.sqrt(omega2 + omega2[0])
    Y = norm[:, None] * (mean.columns.F[~is_beyond & is_elastic] / omega2).T
    Y /= np.linalg.norm(Y, axis=0)
    n = mean.n_q - int(np.count_nonzero(is_beyond & is_elastic))
    span = la.qr(Y, mode="economic", pivoting=True)[0][:, :n]
    basis = la.qr(span / norm[:, None])[0]
    left, sizes, right = rows_of_shapes(name, mean)
    X = left, np.sqrt(mean.moments.m) * sizes, right
    return SplitModes(X, basis[:, :n], basis[:, n:], omega2, of_frame)


def restricted(sample: ReducedBody, split: SplitModes, F: Array) -> ReducedBody:
    """Return the sample over M-orthonormal, K-diagonal modes in the span of F, (N, n_q), in its own frame: step (4)."""
    Z = la.qr(split.of_frame @ F, mode="economic")[0]
    K = Z.T @ sample.K @ Z
    omega2_1 = float(split.omega2[0])
    Z = Z @ elastic_eigenvectors((K + K.T) / 2, np.eye(len(K)), omega2_1)[0]
    assert sample.columns is not None
    labels, groups = sample.columns.labels, sample.columns.groups
    groups = tuple(
        label.rsplit(" ", 1)[0] if group == BEYOND else group for label, group in zip(labels, groups, strict=True)
    )
    columns = replace(sample.columns, groups=groups)
    undamped = replace(
        sample,
        D=sample.D - damping_of_modes(sample),
        columns=columns,
        sources=columns.sources,
        energy_shares=columns.group_shares(),
        errors=None,
    )
    body = recombined(undamped, Z)
    free = F.T @ (split.omega2[:, None] * F)
    omega2 = elastic_omega2((free + free.T) / 2, omega2_1)
    body = replace(
        body,
        recovery=tables_of_fewer_modes(sample, Z),
        M=np.eye(len(K)),
        K=np.diag(np.diag(body.K)),
        free_frequencies=np.sqrt(omega2[: len(sample.free_frequencies)]) / (2 * np.pi),
        provenance={**sample.provenance, "mode set columns": f"{len(K)} directions that all samples have in common"},
    )
    return replace(body, D=body.D + damping_of_modes(body))


def elastic_omega2(K: Array, omega2_1: float) -> Array:
    """Return the eigenvalues of a stiffness over M-orthonormal shapes, ascending [1/s²]."""
    Z = elastic_eigenvectors(K, np.eye(len(K)), omega2_1)[0]
    return np.sort(np.einsum("lk,lm,mk->k", Z, K, Z))
