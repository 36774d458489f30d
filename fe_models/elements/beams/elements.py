"""All beam elements of a mesh, as arrays."""

import numpy as np

from fe_models.elements.beams.axes import LineGeometry
from fe_models.elements.beams.beam_property import BeamProperty
from fe_models.elements.beams.element import (
    interpolation,
    local_stiffness,
    shear_parameter,
    stiffness_about_shear_center,
)
from fe_models.elements.beams.section_properties import SectionProperties
from fe_models.elements.beams.slices import Slices
from fe_models.foundation.arrays import Array, IntArray

__all__ = ["Elements", "gauss_points"]

N_GAUSS = 4  #: number of Gauss points; exact up to degree 7, and the square of a cubic has degree 6


def gauss_points() -> tuple[Array, Array]:
    """Return the positions of the slices, from 0 to 1, and their weights with sum 1."""
    xi, weights = np.polynomial.legendre.leggauss(N_GAUSS)
    return (xi + 1) / 2, weights / 2


class Elements:
    """All beam elements of a mesh as arrays: stiffness and slices."""

    def __init__(
        self,
        geometry: LineGeometry,
        used: tuple[BeamProperty, ...],
        sections: tuple[SectionProperties, ...],
        of_line: IntArray,
    ) -> None:
        def per_line(values: list) -> Array:
            return np.array(values, dtype=float)[of_line]

        self.geometry = geometry
        E, G, rho = (per_line([getattr(p.material, key) for p in used]) for key in ("E", "mu", "rho"))
        A, Iy, Iz, J, A_sy, A_sz = (
            per_line([getattr(s, key) for s in sections]) for key in ("A", "Iy", "Iz", "J", "A_sy", "A_sz")
        )
        shear_center = per_line([s.shear_center for s in sections]).reshape(-1, 2)
        L = geometry.length
        Phi_y, Phi_z = shear_parameter(E * Iz, G * A_sy, L), shear_parameter(E * Iy, G * A_sz, L)
        K = local_stiffness(E * A, G * J, E * Iy, E * Iz, Phi_y, Phi_z, L)
        #: stiffness over local dofs of the centroid, (n, 12, 12)
        self.K_local = stiffness_about_shear_center(K, shear_center)
        self.mass_per_length = rho * A + per_line([p.added_mass for p in used])
        zero = np.zeros_like(L)
        has_rotary = np.array([p.rotary_inertia for p in used], dtype=bool)[of_line]
        polar = rho * (Iy + Iz) / 2  # J = diag(2 polar, 0, 0) has E = polar diag(-1, 1, 1)
        self.moments_per_length = np.where(
            has_rotary[:, None], np.stack([zero, rho * Iz, rho * Iy], axis=1), np.stack([-polar, polar, polar], axis=1)
        )
        self.xi, self.weights = gauss_points()
        self.N = interpolation(self.xi, Phi_y, Phi_z, L, shear_center)

    def stiffness(self) -> Array:
        """Return the element stiffness matrices over the dofs of the nodes, (n, 12, 12)."""
        K = self.geometry.T.transpose(0, 2, 1) @ self.K_local @ self.geometry.T
        return np.asarray((K + K.transpose(0, 2, 1)) / 2)

    def slices(self, dofs: IntArray) -> Slices:
        """Return the slices at the Gauss points, with these dof numbers."""
        geometry, n, p = self.geometry, len(self.N), N_GAUSS
        R = geometry.R[:, None]
        motion = self.N @ geometry.T[:, None]
        motion = np.concatenate([R @ motion[:, :, :3], R @ motion[:, :, 3:]], axis=2)
        length = geometry.length[:, None] * self.weights
        first, second = geometry.ends[:, 0, None], geometry.ends[:, 1, None]
        return Slices(
            position=first + self.xi[:, None] * (second - first),
            mass=self.mass_per_length[:, None] * length,
            axes=np.broadcast_to(R, (n, p, 3, 3)),
            moments=self.moments_per_length[:, None] * length[..., None],
            motion=motion,
            dofs=dofs,
        )
