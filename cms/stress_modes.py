"""Stress modes: the stress of each mode at kept nodes and at named points, in the axes of the body frame."""

from dataclasses import dataclass

import numpy as np

from cms.arrays import Array, IntArray, frozen, require_finite, require_shape
from cms.fe_body import FEBody

__all__ = ["PointStress", "nodal_stress_modes", "point_stress_modes", "turned_stress", "von_mises"]

COLUMNS_AT_ONCE = 16  #: stress is known at all nodes before it is cut to the kept ones


@dataclass(frozen=True, eq=False)
class PointStress:
    """Stress modes at named points beside the nodes, such as the outer points of beam sections."""

    names: tuple[str, ...]  #: one per point
    positions: Array  #: undeformed, in B, (n_points, 3) [m]
    modes: Array  #: stress xx yy zz yz xz xy for each mode, in axes of B, (n_points, 6, n_q) [Pa per unit of q]

    def __post_init__(self) -> None:
        object.__setattr__(self, "names", tuple(self.names))
        n = len(self.names)
        for name in ("positions", "modes"):
            object.__setattr__(self, name, frozen(getattr(self, name)))
            require_finite(f"stress points: {name}", getattr(self, name))
        require_shape("stress points: positions", self.positions, (n, 3))
        require_shape("stress points: modes", self.modes, (n, 6, np.asarray(self.modes).shape[-1]))


def nodal_stress_modes(body: FEBody, Phi: Array, nodes: IntArray, axes: Array) -> Array | None:
    """Return the stress of the shapes at some nodes in the axes of B, (n, 6, n_q) [Pa per unit]; None if unknown.

    Parameters
    ----------
    body
        Coupled or not.
    Phi
        Shapes over its dofs, (n_dof, n_q).
    nodes
        Indices into `FEBody.nodes`, (n,); reference nodes, which are not of the mesh, have no stress: zero.
    axes
        Columns: axes of B in mesh axes, (3, 3).
    """
    model = body.element_model
    if model is None or not model.has_nodal_stress:
        return None
    modes = np.zeros((len(nodes), 6, Phi.shape[1]))
    for begin in range(0, Phi.shape[1], COLUMNS_AT_ONCE):
        columns = slice(begin, begin + COLUMNS_AT_ONCE)
        everywhere = model.nodal_stress(body.mesh_displacement(Phi[:, columns]), nodes=nodes)
        on_mesh = nodes < len(everywhere)
        modes[on_mesh, :, columns] = everywhere[nodes[on_mesh]]
    return turned_stress(modes, axes)


def point_stress_modes(body: FEBody, Phi: Array, origin: Array, axes: Array) -> PointStress | None:
    """Return the stress of the shapes at the stress points of the body; None if it has none."""
    points = body.stress_points
    if points is None:
        return None
    modes = points.stress(body.mesh_displacement(Phi))
    return PointStress(points.names, (np.asarray(points.positions) - origin) @ axes, turned_stress(modes, axes))


def turned_stress(stress: Array, axes: Array) -> Array:
    """Return stress components in other axes: Rᵀ sigma R, (n, 6, k), R = axes with the new axes as columns."""
    if np.array_equal(axes, np.eye(3)):
        return np.asarray(stress)
    tensor = np.asarray(stress)[:, [[0, 5, 4], [5, 1, 3], [4, 3, 2]]]
    turned = np.einsum("ia,nijk,jb->nabk", axes, tensor, axes, optimize=True)
    return np.stack([turned[:, a, b] for a, b in ((0, 0), (1, 1), (2, 2), (1, 2), (0, 2), (0, 1))], axis=1)


def von_mises(stress: Array) -> Array:
    """Return the von Mises stress sqrt(3/2 s:s), s the deviator, of components xx yy zz yz xz xy on axis 1 [Pa].

    Parameters
    ----------
    stress
        (n, 6) or (n, 6, k).
    """
    xx, yy, zz, yz, xz, xy = np.moveaxis(np.asarray(stress), 1, 0)
    normal = (xx - yy) ** 2 + (yy - zz) ** 2 + (zz - xx) ** 2
    return np.asarray(np.sqrt(normal / 2 + 3 * (yz**2 + xz**2 + xy**2)))
