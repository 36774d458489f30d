"""The element model of a shell body: mass integrals, stress at the faces, geometric stiffness."""

from collections import deque
from collections.abc import Callable, Iterator
from concurrent.futures import Future, ThreadPoolExecutor
from dataclasses import dataclass
from functools import cached_property

import numpy as np
import scipy.sparse as sp

from fe_models.body.fe_body import NoNodalRotations
from fe_models.body.rigid_motion import MassLoads
from fe_models.elements.beams.geometric import slice_forces
from fe_models.elements.shells.elements import ShellCells
from fe_models.elements.shells.geometric import cell_geometric_stiffness
from fe_models.elements.shells.skin import ShellSkin
from fe_models.foundation.arrays import Array, IntArray, require_rows
from fe_models.foundation.threads import n_threads, one_blas_thread

__all__ = ["ShellModel"]

AHEAD = 2  #: number of chunks of cells per thread whose results may be pending
TOP, MIDDLE, BOTTOM = 0.5, 0.0, -0.5  #: heights in the thickness, z/t


@dataclass(frozen=True, eq=False)
class ShellModel(NoNodalRotations):
    """Element model of a shell (`fe_body.ElementModel`); six dofs per node come first, then three per skin point."""

    n_nodes: int
    groups: tuple[ShellCells, ...]
    skin: ShellSkin

    @property
    def has_nodal_stress(self) -> bool:
        """Return True: the stress is known at skin points, and in the middle surface at nodes."""
        return True

    @property
    def n_mesh_dof(self) -> int:
        """Number of mesh dofs: those of the nodes, then those of the skin."""
        return 6 * self.n_nodes + 3 * len(self.skin.points)

    def mass_gram(self, u: Array) -> Array:
        """Return ∫ a aᵀ dm with a = [1, c, u_x, u_y, u_z], exact through the thickness (docs/theory.md §5).

        Parameters
        ----------
        u
            Columns over the dofs of the mesh, (n_mesh_dof, k).
        """
        require_rows("mass_gram", u, self.n_mesh_dof)
        k = np.shape(u)[1]
        gram = np.zeros((4 + 3 * k, 4 + 3 * k))
        for _, part in self._of_chunks(lambda group, rows: group.slices(rows).gram(np.asarray(u))):
            gram += part
        return gram

    def nodal_stress(self, u: Array, *, nodes: IntArray | None = None) -> Array:
        """Return the stress of the middle surface at the mesh nodes, and of the faces at the skin points.

        It is averaged over the adjoining cells, weighted with area. A skin point belongs to one smooth patch of cells.
        All nodes are computed, even if `nodes` are given.

        Returns
        -------
        Array
            Stress, (n_nodes + n_skin, 6, k) [Pa], components xx, yy, zz, yz, xz, xy.
        """
        return self.means_of_corners(u, ShellCells.stress)

    def means_of_corners(self, u: Array, values: Callable[[ShellCells, Array, slice, float], Array]) -> Array:
        """Return six values of the cells, averaged at the nodes as for `nodal_stress`, (n, 6, k).

        Parameters
        ----------
        values
            Function of cells, resultants at their corners, rows and a height in the thickness, such as
            `ShellCells.stress`.
        """
        require_rows("nodal_stress", u, self.n_mesh_dof)
        u = np.asarray(u)
        n_skin, k = len(self.skin.points), u.shape[1]
        total = np.zeros((self.n_nodes + n_skin, 6 * k))
        for group, patch, means in zip(self.groups, self.skin.patch, self._means, strict=True):
            for rows in group.chunks():
                resultants = group.corner_resultants(u, rows)
                of_chunk = slice(rows.start * patch.shape[1], rows.stop * patch.shape[1])
                for height, mean in zip((MIDDLE, TOP, BOTTOM), means, strict=True):
                    corners = values(group, resultants, rows, height).reshape(-1, 6 * k)
                    total += mean[:, of_chunk] @ corners
        return total.reshape(-1, 6, k)

    @property
    def has_geometric_stiffness(self) -> bool:
        """Return True: stress resultants and masses have a geometric stiffness."""
        return True

    def mass_forces(self, loads: MassLoads) -> Array:
        """Return consistent forces and moments of loads per unit mass, with couples along normals, (n_mesh_dof, k)."""
        forces = np.zeros((self.n_mesh_dof, loads.k))
        for dofs, part in self._of_chunks(lambda group, rows: slice_forces(group.slices(rows), loads)):
            np.add.at(forces, dofs, part)
        return forces

    def internal_forces(self, u: Array, *, nodes: IntArray | None = None) -> Array:
        """Return K u of all cells, or only of cells at `nodes` if these are given, (n_mesh_dof, k) [N, N m]."""
        require_rows("internal_forces", u, self.n_mesh_dof)
        forces = np.zeros(np.shape(u))
        for dofs, part in self._of_chunks(lambda group, rows: group.internal_forces(np.asarray(u), rows), nodes):
            np.add.at(forces, dofs, part)
        return forces

    def geometric_stiffness(self, u: Array, loads: MassLoads, Phi: Array) -> Array:
        """Return Phiᵀ K_geo(sigma_j) Phi, (k, n, n), for states u under these loads, by `elements.shells.geometric`."""
        for columns in (u, Phi):
            require_rows("geometric_stiffness", columns, self.n_mesh_dof)
        u, Phi = np.asarray(u), np.asarray(Phi)
        K = np.zeros((loads.k, Phi.shape[1], Phi.shape[1]))
        for _, part in self._of_chunks(lambda group, rows: cell_geometric_stiffness(group, rows, u, loads, Phi)):
            K += part
        return K

    def _of_chunks(
        self, work: Callable[[ShellCells, slice], Array], nodes: IntArray | None = None
    ) -> Iterator[tuple[IntArray, Array]]:
        """Yield dofs and result of `work` for chunks of all cells, or of the cells at some nodes, in threads.

        The chunks come in order, so that sums are bitwise reproducible. Only a few results wait in memory.
        """
        chunks = [(group, rows) for group in self.groups for rows in group.chunks()]
        if nodes is not None:
            chunks = [(group, rows) for group, rows in chunks if np.isin(group.cells[rows], nodes).any()]
        with one_blas_thread(), ThreadPoolExecutor(n_threads()) as pool:
            ahead: deque[tuple[IntArray, Future[Array]]] = deque()
            for group, rows in chunks:
                ahead.append((group.dofs[rows], pool.submit(work, group, rows)))
                if len(ahead) > AHEAD * n_threads():
                    dofs, made = ahead.popleft()
                    yield dofs, made.result()
            for dofs, made in ahead:
                yield dofs, made.result()

    @cached_property
    def _means(self) -> tuple[tuple[sp.csc_array, ...], ...]:
        """Matrices that average corners at nodes (middle), tops and bottoms, (n_nodes + n_skin, n_corners) each."""
        n_rows = self.n_nodes + len(self.skin.points)
        places = [
            (group.cells.ravel(), self.n_nodes + patch.ravel(), self.n_nodes + self.skin.n_patches + patch.ravel())
            for group, patch in zip(self.groups, self.skin.patch, strict=True)
        ]
        weights = [np.repeat(group.areas(), group.cells.shape[1]) for group in self.groups]
        total = np.zeros(n_rows)
        for at, weight in zip(places, weights, strict=True):
            for rows in at:
                total += np.bincount(rows, weight, minlength=n_rows)
        return tuple(
            tuple(
                sp.csc_array((weight / total[rows], (rows, np.arange(len(rows)))), shape=(n_rows, len(rows)))
                for rows in at
            )
            for at, weight in zip(places, weights, strict=True)
        )
