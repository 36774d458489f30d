"""Mean motion of points with one weight per component, as in the RBE3 element of Nastran."""

import numpy as np

from fe_models.body.rigid_motion import rigid_motion_of_points
from fe_models.foundation.arrays import Array
from fe_models.foundation.errors import BodyError

__all__ = ["characteristic_length", "weighted_motion"]

ALL = (0, 1, 2, 3, 4, 5)
UNDETERMINED = (
    1e-12  #: eigenvalue of the normal matrix, relative to the largest, below which a motion moves no weighted component
)
PART = 1e-6  #: largest share of such a motion in a requested component


def characteristic_length(points: Array, reference: Array) -> float:
    """Return the mean distance of the points from the reference point [m], or 1 if all points coincide with it.

    Nastran multiplies the weights of rotations by the square of this length, so that they compare with those of
    translations. Other programs use other lengths, or ignore the rotations of members.
    """
    length = float(np.linalg.norm(points - reference, axis=1).mean())
    return length if length > 0 else 1.0


def weighted_motion(
    points: Array,
    weights: Array,
    reference: Array,
    *,
    axes: Array | None = None,
    components: tuple[int, ...] = ALL,
    triad: Array | None = None,
) -> Array:
    """Return the rigid motion of a reference point that fits the motion of points best.

    (1) a rigid motion moves point i by u_i = G_i [d; theta], G_i (6, 6), translation and rotation in the axes of i
    (2) minimise Σ w_ic (u_ic - G_i,c [d; theta])², where w_ic is the weight, times L² for rotations
    (3) solve [d; theta] = N⁻¹ Σ G_iᵀ W_i u_i with N = Σ G_iᵀ W_i G_i; L is the mean distance from the reference point

    Parameters
    ----------
    points
        (n, 3) [m].
    weights
        Weights of the translations and rotations of each point, (n, 6) [-]; a component with weight 0 does not take
        part.
    reference
        Reference point, (3,) [m].
    axes
        Axes of the weighted components, as columns, (n, 3, 3); None: mesh axes.
    components
        Requested components of the motion, 0-2 translation, 3-5 rotation.
    triad
        Axes of the requested components, as columns, (3, 3); None: mesh axes.

    Returns
    -------
    Array
        A in (requested components of [d; theta]) = A u, (n_components, 6 n). The columns are the translation and
        rotation of each point in mesh axes.

    Raises
    ------
    BodyError
        If weights are negative, infinite or all zero, or if a requested component moves no weighted component, as for
        points on a line without rotational weights.
    """
    points, weights = np.asarray(points, dtype=float), np.asarray(weights, dtype=float)
    if weights.shape != (len(points), 6):
        raise BodyError(f"weighted motion: expected weights ({len(points)}, 6), got {weights.shape}")
    if not np.isfinite(weights).all() or (weights < 0).any() or not weights.any():
        raise BodyError("weighted motion: expected finite weights of zero or more, and one above zero")
    L = characteristic_length(points, reference)
    G = np.zeros((len(points), 6, 6))  # (1)
    G[:, :3] = rigid_motion_of_points(points, reference)
    G[:, 3:, 3:] = np.eye(3)
    R = np.tile(np.eye(3), (len(points), 1, 1)) if axes is None else np.asarray(axes, dtype=float)
    to_axes = np.zeros((len(points), 6, 6))
    to_axes[:, :3, :3] = to_axes[:, 3:, 3:] = np.swapaxes(R, 1, 2)
    W = weights * np.repeat([1.0, L**2], 3)
    weighted = np.swapaxes(to_axes, 1, 2) @ (W[:, :, None] * to_axes)  # (n, 6, 6), mesh axes
    right = np.einsum("nak,nab->knb", G, weighted).reshape(6, -1)  # (2)
    N = right @ G.reshape(-1, 6)
    scale = np.repeat([1.0, 1 / L], 3)  # rotations are scaled to lengths
    values, vectors = np.linalg.eigh(scale[:, None] * N * scale)
    turned = np.zeros((6, 6))
    turned[:3, :3] = turned[3:, 3:] = np.eye(3) if triad is None else np.asarray(triad, dtype=float).T
    rows = turned[list(components)] @ (scale[:, None] * vectors)
    is_known = values > UNDETERMINED * values[-1]
    if (np.abs(rows[:, ~is_known]) > PART * scale[list(components), None]).any():
        raise BodyError(
            f"weighted motion: {len(points)} points with these weights cannot say the components "
            f"{', '.join(str(c + 1) for c in components)} of the reference point: they lie on a line or at one point; "
            "take more points, weights of their rotations, or fewer components"
        )
    return np.asarray(rows[:, is_known] / values[is_known] @ (vectors[:, is_known].T @ (scale[:, None] * right)))  # (3)
