"""The element model of a frame: mass integrals, section forces, stress at the skin, geometric stiffness."""

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from fe_models.body.fe_body import NoNodalRotations
from fe_models.body.rigid_motion import MassLoads
from fe_models.elements.beams.attachments import Spring, spring_matrix
from fe_models.elements.beams.axes import LineGeometry, stress_directions
from fe_models.elements.beams.element import end_forces_at_centroid
from fe_models.elements.beams.elements import gauss_points
from fe_models.elements.beams.geometric import (
    BeamLines,
    line_geometric_stiffness,
    point_geometric_stiffness,
    slice_forces,
    spring_geometric_stiffness,
)
from fe_models.elements.beams.section_properties import SectionProperties
from fe_models.elements.beams.skin import Skin
from fe_models.elements.beams.slices import Slices
from fe_models.foundation.arrays import Array, IntArray, require_rows

__all__ = ["BeamModel"]


@dataclass(frozen=True, eq=False)
class BeamModel(NoNodalRotations):
    """Element model of a frame (`fe_body.ElementModel`); six dofs per node come first, then three per skin node."""

    nodes: Array  #: nodes of the mesh, (n_nodes, 3) [m]
    #: slices of the lines if there are lines, then of the point masses if there are point masses
    pieces: tuple[Slices, ...]
    geometry: LineGeometry
    K_local: Array  #: stiffness of each line over local dofs, (n_lines, 12, 12)
    dofs: IntArray  #: dofs of the nodes of each line, (n_lines, 12)
    of_line: IntArray  #: section index of each line, (n_lines,)
    sections: tuple[SectionProperties, ...]
    skin: Skin
    springs: tuple[Spring, ...] = ()
    moduli: tuple[tuple[float, float], ...] = ()  #: E and G of the material of each section [Pa]

    @property
    def n_nodes(self) -> int:
        """Number of mesh nodes; skin nodes are numbered after them."""
        return len(self.nodes)

    @property
    def has_nodal_stress(self) -> bool:
        """Whether the body has skin nodes with stress."""
        return len(self.skin.points) > 0

    @property
    def n_mesh_dof(self) -> int:
        """Number of mesh dofs: those of the nodes, then those of the skin."""
        return 6 * self.n_nodes + 3 * len(self.skin.points)

    def mass_gram(self, u: Array) -> Array:
        """Return ∫ a aᵀ dm with a = [1, c, u_x, u_y, u_z], exact over the cross-sections (docs/theory.md §5).

        Parameters
        ----------
        u
            Columns over the dofs of the mesh, (n_mesh_dof, k).
        """
        require_rows("mass_gram", u, self.n_mesh_dof)
        k = np.shape(u)[1]
        return sum((piece.gram(np.asarray(u)) for piece in self.pieces), start=np.zeros((4 + 3 * k, 4 + 3 * k)))

    def section_forces(self, u: Array) -> Array:
        """Return N Vy Vz Mx My Mz at both ends of each line, (n_lines, 2, 6, k) [N, N m].

        The forces are in local axes, about the centroid, on the face with normal +x.
        """
        require_rows("section_forces", u, self.n_mesh_dof)
        local = self.geometry.T @ np.asarray(u)[self.dofs]
        return end_forces_at_centroid(self.K_local @ local)

    def nodal_stress(self, u: Array, *, nodes: IntArray | None = None) -> Array:
        """Return the stress at the skin nodes, averaged where two lines share a node; zero at nodes of the axis.

        sigma_xx comes from N, My, Mz, and tau from torsion and shear according to the section; both are in mesh axes.

        Returns
        -------
        Array
            Stress, (n_mesh_nodes, 6, k) [Pa], components xx, yy, zz, yz, xz, xy.
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
                # a ring joins one line end to one line start
                stress[rows] += self.stress_at_end(lines, forces[lines, end])
                count[rows] += 1.0
        stress /= np.maximum(count, 1.0)[:, None, None]
        return np.concatenate([np.zeros((self.n_nodes, 6, k)), stress])

    def stress_at_end(self, lines: IntArray, forces: Array) -> Array:
        """Return the stress at the section points of lines with the same section, (n, n_points, 6, k) [Pa], mesh axes.

        Parameters
        ----------
        lines
            Lines with the same section, (n,).
        forces
            Section forces at one end of these lines, (n, 6, k).
        """
        section = self.sections[self.of_line[lines[0]]]
        y_s, z_s = section.shear_center
        about = np.array(forces)
        about[:, 3] += z_s * about[:, 1] - y_s * about[:, 2]  # torsional moment about the shear centre
        table = np.einsum(
            "ncs,psf->npcf", stress_directions(self.geometry.R[lines], ((0, 0), (0, 1), (0, 2))), section.stress
        )
        n, n_points = table.shape[:2]
        return np.asarray((table.reshape(n, 6 * n_points, 6) @ about).reshape(n, n_points, 6, -1))

    @property
    def has_geometric_stiffness(self) -> bool:
        """Return True: section forces, masses and springs have a geometric stiffness."""
        return True

    def mass_forces(self, loads: MassLoads) -> Array:
        """Return consistent forces and moments of loads per unit mass, including section couples, (n_mesh_dof, k)."""
        forces = np.zeros((self.n_mesh_dof, loads.k))
        for piece in self.pieces:
            np.add.at(forces, piece.dofs, slice_forces(piece, loads))
        return forces

    def internal_forces(self, u: Array, *, nodes: IntArray | None = None) -> Array:
        """Return K u of lines and springs, (n_mesh_dof, k) [N, N m], at all nodes."""
        require_rows("internal_forces", u, self.n_mesh_dof)
        forces = np.zeros(np.shape(u))
        np.add.at(forces, self.dofs, self._node_forces(u))
        for spring in self.springs:
            matrix, dofs = spring_matrix(self.nodes, spring, np.asarray(spring.stiffness))
            np.add.at(forces, dofs, matrix @ np.asarray(u)[dofs])
        return forces

    def geometric_stiffness(self, u: Array, loads: MassLoads, Phi: Array) -> Array:
        """Return Phiᵀ K_geo(sigma_j) Phi, (k, n, n), for states u under these loads, by `elements.beams.geometric`."""
        for columns in (u, Phi):
            require_rows("geometric_stiffness", columns, self.n_mesh_dof)
        K = np.zeros((loads.k, Phi.shape[1], Phi.shape[1]))
        if len(self.dofs):
            by_nodes = self._node_forces(u) - slice_forces(self.pieces[0], loads)
        for j in range(loads.k):
            load = MassLoads(loads.A[j : j + 1], loads.b[j : j + 1])
            parts = []
            if len(self.dofs):
                ends = by_nodes[:, :, j].reshape(-1, 2, 6)
                parts.append((self.dofs, line_geometric_stiffness(self._lines, ends, load)))
            parts += [(p.dofs, point_geometric_stiffness(p, load)) for p in self.pieces[1 if len(self.dofs) else 0 :]]
            for spring in self.springs:
                _, dofs = spring_matrix(self.nodes, spring, np.asarray(spring.stiffness))
                parts.append((dofs[None], spring_geometric_stiffness(self.nodes, spring, np.asarray(u)[dofs, j])[None]))
            for dofs, matrices in parts:
                columns = np.asarray(Phi)[dofs]
                K[j] += np.tensordot(columns, matrices @ columns, axes=([0, 1], [0, 1]))
        return (K + K.transpose(0, 2, 1)) / 2

    def _node_forces(self, u: Array) -> Array:
        """Return forces and moments that the nodes exert on each line, mesh axes, (n_lines, 12, k)."""
        T = self.geometry.T
        return np.asarray(T.transpose(0, 2, 1) @ (self.K_local @ (T @ np.asarray(u)[self.dofs])))

    @cached_property
    def _lines(self) -> BeamLines:
        xi, weights = gauss_points()
        radius2 = np.array([section.J_polar / section.A for section in self.sections])[self.of_line]
        geometry = self.geometry
        return BeamLines(self.pieces[0], xi, weights, geometry.length, geometry.R[:, :, 0], geometry.levers, radius2)
