"""The elements behind a frame: exact integrals over mass, section forces, stress at the points of the skin."""

from dataclasses import dataclass

import numpy as np

from cms.arrays import Array, IntArray
from cms.errors import BodyError
from fe_models.beams.axes import LineGeometry
from fe_models.beams.element import end_forces_at_centroid
from fe_models.beams.section_properties import SectionProperties
from fe_models.beams.skin import Skin
from fe_models.beams.slices import Slices

__all__ = ["BeamModel"]


@dataclass(frozen=True, eq=False)
class BeamModel:
    """Element model of a frame (`cms.fe_body.ElementModel`); its dofs: six per node, then three per skin node."""

    n_nodes: int
    pieces: tuple[Slices, ...]
    geometry: LineGeometry
    K_local: Array  #: (n_lines, 12, 12)
    dofs: IntArray  #: of the nodes of each line, (n_lines, 12)
    of_line: IntArray  #: section of each line, (n_lines,)
    sections: tuple[SectionProperties, ...]
    skin: Skin

    @property
    def has_nodal_stress(self) -> bool:
        """Whether there is a skin that shows stress."""
        return len(self.skin.points) > 0

    @property
    def n_mesh_dof(self) -> int:
        """Dofs of the mesh: of the nodes, then of the skin."""
        return 6 * self.n_nodes + 3 * len(self.skin.points)

    def mass_gram(self, u: Array) -> Array:
        """Return ∫ a aᵀ over mass, a = [1, c, u_x, u_y, u_z], exact over the cross-sections (THEORY §5).

        Parameters
        ----------
        u
            Columns over the dofs of the mesh, (n_mesh_dof, k).
        """
        self._require_rows("mass_gram", u)
        k = np.shape(u)[1]
        return sum((piece.gram(np.asarray(u)) for piece in self.pieces), start=np.zeros((4 + 3 * k, 4 + 3 * k)))

    def section_forces(self, u: Array) -> Array:
        """Return N Vy Vz Mx My Mz at both ends of each line, (n_lines, 2, 6, k) [N, N m].

        Local axes, about the centroid, on the face whose normal is +x.
        """
        self._require_rows("section_forces", u)
        local = self.geometry.T @ np.asarray(u)[self.dofs]
        return end_forces_at_centroid(self.K_local @ local)

    def nodal_stress(self, u: Array, *, nodes: IntArray | None = None) -> Array:
        """Return the stress at the skin nodes, the mean of both lines where they share one; zero at nodes of the axis.

        sigma_xx from N, My, Mz; tau from torsion and shear as the section gives it; turned into mesh axes.

        Returns
        -------
        Array
            (n_mesh_nodes, 6, k) [Pa], components xx, yy, zz, yz, xz, xy.
        """
        forces = self.section_forces(u)
        n_skin, k = len(self.skin.points), np.shape(u)[1]
        stress, count = np.zeros((n_skin, 6, k)), np.zeros(n_skin)
        for number, section in enumerate(self.sections):
            lines = np.flatnonzero(self.of_line == number)
            if not len(lines):
                continue
            for end in range(2):
                rows = self.skin.ring_start[lines, end, None] + np.arange(len(section.points))
                stress[rows] += self.stress_at_end(lines, forces[lines, end])  # a ring joins one end to one start
                count[rows] += 1.0
        stress /= np.maximum(count, 1.0)[:, None, None]
        return np.concatenate([np.zeros((self.n_nodes, 6, k)), stress])

    def stress_at_end(self, lines: IntArray, forces: Array) -> Array:
        """Return the stress at the section points of lines of one section, (n, n_points, 6, k) [Pa], mesh axes.

        Parameters
        ----------
        lines
            Of one section, (n,).
        forces
            Section forces at one end of them, (n, 6, k).
        """
        section = self.sections[self.of_line[lines[0]]]
        y_s, z_s = section.shear_center
        about = np.array(forces)
        about[:, 3] += z_s * about[:, 1] - y_s * about[:, 2]  # torsion about the shear centre
        table = np.einsum("ncs,psf->npcf", _stress_directions(self.geometry.R[lines]), section.stress)
        n, n_points = table.shape[:2]
        return np.asarray((table.reshape(n, 6 * n_points, 6) @ about).reshape(n, n_points, 6, -1))

    def _require_rows(self, where: str, u: Array) -> None:
        if np.ndim(u) != 2 or np.shape(u)[0] != self.n_mesh_dof:
            raise BodyError(f"{where}: u: expected columns over {self.n_mesh_dof} dofs, got {np.shape(u)}")


def _stress_directions(R: Array) -> Array:
    """Components xx yy zz yz xz xy in mesh axes of unit sigma_xx, tau_xy, tau_xz in local axes, (n, 6, 3)."""
    x, y, z = R[:, :, 0], R[:, :, 1], R[:, :, 2]
    columns = []
    for other in (None, y, z):
        tensor = np.einsum("na,nb->nab", x, x if other is None else other)
        if other is not None:
            tensor = tensor + tensor.transpose(0, 2, 1)
        columns.append(np.stack([tensor[:, a, b] for a, b in ((0, 0), (1, 1), (2, 2), (1, 2), (0, 2), (0, 1))], axis=1))
    return np.stack(columns, axis=2)
