"""Planes of critical-plane criteria on a free surface, over angles in the tangent plane."""

import numpy as np

from cms.body.reduced_body import ReducedBody
from fe_models.foundation.arrays import Array, IntArray
from floatframe.errors import FatigueError

__all__ = ["normal_rows", "shear_pairs", "surface_frames", "surface_nodes", "tensor_row", "tensor_rows"]


def surface_nodes(body: ReducedBody) -> IntArray:
    """Return the kept nodes on the surface of a body, ascending, (n,); all nodes with stress if it has no surface.

    Raises
    ------
    FatigueError
        If the body has no stress.
    """
    if body.stress is None:
        raise FatigueError(
            f"body {body.name!r}: its modal file contains no stress of the modes at the nodes; reduce it again with "
            "stress = true in [reduction] of the job"
        )
    if len(body.surface):
        return np.unique(body.surface)
    return np.flatnonzero(np.abs(body.stress).max(axis=(1, 2), initial=0.0) > 0)


def surface_frames(body: ReducedBody, nodes: IntArray) -> Array:
    """Return tangents e1, e2 and outward normal m at surface nodes as rows, in axes of B, (n, 3, 3).

    m is the mean of the normals of the triangles about a node, weighted by their areas. e1 is the projection of the
    axis of B with the smallest angle to the tangent plane, and e2 = m x e1. On a sharp edge, m is between the normals
    of its faces.

    Raises
    ------
    FatigueError
        If a node has no surface about it.
    """
    corners = body.nodes[body.surface]
    areas = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    sums = np.zeros((len(body.nodes), 3))
    for corner in range(3):
        np.add.at(sums, body.surface[:, corner], areas)
    m = sums[nodes]
    sizes = np.linalg.norm(m, axis=1)
    if not len(body.surface) or not (sizes > 0).all():
        which = "some nodes" if len(body.surface) else "its nodes"
        raise FatigueError(
            f"body {body.name!r}: no surface at {which}, so that there is no tangent plane; "
            'take criterion "signed-von-mises" or "principal" with tensor = "full"'
        )
    m = m / sizes[:, None]
    axis = np.argmin(np.abs(m), axis=1)
    e1 = np.eye(3)[axis] - m[np.arange(len(m)), axis, None] * m
    e1 /= np.linalg.norm(e1, axis=1, keepdims=True)
    return np.stack([e1, np.cross(m, e1), m], axis=1)


def tensor_row(a: Array, b: Array) -> Array:
    """Return the row r with r · (xx yy zz yz xz xy) = a · sigma b for directions on the last axis, (..., 6)."""
    return np.stack(
        [
            a[..., 0] * b[..., 0], a[..., 1] * b[..., 1], a[..., 2] * b[..., 2],
            a[..., 1] * b[..., 2] + a[..., 2] * b[..., 1], a[..., 0] * b[..., 2] + a[..., 2] * b[..., 0],
            a[..., 0] * b[..., 1] + a[..., 1] * b[..., 0],
        ], axis=-1,
    )  # fmt: skip


def tensor_rows(frames: Array) -> Array:
    """Return the rows of the stress in the tangent plane: e1 e1, e2 e2, e1 e2, (n, 3, 6)."""
    e1, e2 = frames[:, 0], frames[:, 1]
    return np.stack([tensor_row(e1, e1), tensor_row(e2, e2), tensor_row(e1, e2)], axis=1)


def normal_rows(frames: Array, n_planes: int) -> Array:
    """Return the rows of normal stress on planes normal to the surface, n = cos a e1 + sin a e2, (n, n_planes, 6).

    The angles are a = 0, pi/n_planes, ..., below pi.
    """
    n = in_tangent(frames, np.pi * np.arange(n_planes) / n_planes)
    return tensor_row(n, n)


def shear_pairs(frames: Array, n_planes: int) -> tuple[Array, Array]:
    """Return rows of the resolved shear and of the normal stress on planes, each (n, 5 n_planes, 6).

    n_planes planes are normal to the surface, n = cos a e1 + sin a e2, with the shear along the surface, s = m x n.
    2 n_planes planes are at 45 degrees to it, n = (cos b e1 + sin b e2 + m) / sqrt(2) with b over the full circle; each
    has rows for the shear in the plane of n and m, and for the shear along the surface.
    """
    angles = np.pi * np.arange(2 * n_planes) / n_planes
    m = frames[:, None, 2]
    c = in_tangent(frames, angles)
    across = c[:, :n_planes]
    along = np.cross(m, c)
    tilted, down = (c + m) / np.sqrt(2), (c - m) / np.sqrt(2)
    shear = [tensor_row(across, along[:, :n_planes]), tensor_row(tilted, down), tensor_row(tilted, along)]
    normal = [tensor_row(across, across), tensor_row(tilted, tilted), tensor_row(tilted, tilted)]
    return np.concatenate(shear, axis=1), np.concatenate(normal, axis=1)


def in_tangent(frames: Array, angles: Array) -> Array:
    """Return directions at angles in the tangent plane, (n, n_angles, 3)."""
    cos, sin = np.cos(angles)[None, :, None], np.sin(angles)[None, :, None]
    return np.asarray(cos * frames[:, None, 0] + sin * frames[:, None, 1])
