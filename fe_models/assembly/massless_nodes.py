"""Nodes without elements, as a part of a body: reference nodes without mass, stress and force."""

from dataclasses import dataclass

import numpy as np

from fe_models.body.mass_loads import MassLoads
from fe_models.foundation.arrays import Array, IntArray

__all__ = ["MasslessNodes"]


@dataclass(frozen=True)
class MasslessNodes:
    """Element model of nodes in constraints only (`fe_models.body.fe_body.ElementModel`); all results are zero."""

    n_mesh_dof: int
    n_nodes: int

    @property
    def has_nodal_stress(self) -> bool:
        """False, because there is no material at these nodes."""
        return False

    def nodal_rotation(self, u: Array, nodes: IntArray) -> Array:
        """Return NaN, (n, 3, k), because there is no element at these nodes."""
        return np.full((len(nodes), 3, np.shape(u)[1]), np.nan)

    @property
    def has_geometric_stiffness(self) -> bool:
        """True; the geometric stiffness is zero."""
        return True

    def mass_gram(self, u: Array) -> Array:
        """Return zero, (4 + 3 k, 4 + 3 k)."""
        n = 4 + 3 * np.shape(u)[1]
        return np.zeros((n, n))

    def nodal_stress(self, u: Array, *, nodes: IntArray | None = None) -> Array:
        """Return zero, (n_nodes, 6, k)."""
        return np.zeros((self.n_nodes, 6, np.shape(u)[1]))

    def mass_forces(self, loads: MassLoads) -> Array:
        """Return zero, (n_mesh_dof, loads.k)."""
        return np.zeros((self.n_mesh_dof, loads.k))

    def internal_forces(self, u: Array, *, nodes: IntArray | None = None) -> Array:
        """Return zero, (n_mesh_dof, k)."""
        return np.zeros((self.n_mesh_dof, np.shape(u)[1]))

    def geometric_stiffness(self, u: Array, loads: MassLoads, Phi: Array) -> Array:
        """Return zero, (loads.k, n, n)."""
        return np.zeros((loads.k, Phi.shape[1], Phi.shape[1]))
