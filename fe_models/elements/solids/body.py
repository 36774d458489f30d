"""Finite element body of a mesh of solid cells."""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from functools import cached_property
from importlib.metadata import version
from typing import Any, ClassVar

import numpy as np
import scipy.sparse as sp

from fe_models.body.fe_body import FEBody, Interface, dofs_of
from fe_models.body.material import AnyMaterial, assign_materials, material_words
from fe_models.body.rigid_motion import MassLoads
from fe_models.body.unit_check import warn_of_materials
from fe_models.elements.solids.assembly import Progress, assemble, expand_scalar_mass
from fe_models.elements.solids.assembly_on_ranks import SpreadMesh, assemble_on_ranks
from fe_models.elements.solids.elements import INTEGRATIONS, MASSES, reference_element
from fe_models.elements.solids.geometric import (
    integrated_cells,
    projected_geometric_stiffness,
    spread_geometric_stiffness,
)
from fe_models.elements.solids.incompatible import KIND, brick_chunks, brick_stiffness
from fe_models.elements.solids.stress import nodal_stress
from fe_models.foundation.arrays import Array, IntArray, frozen, require_rows
from fe_models.foundation.errors import BodyError
from fe_models.foundation.ranks.product import RowsProduct
from fe_models.foundation.ranks.ranks import Ranks
from fe_models.foundation.ranks.row_layout import RowLayout
from fe_models.foundation.ranks.rows import Rows
from fe_models.foundation.ranks.spread_columns import Part, own_part, spread_columns
from fe_models.foundation.ranks.spread_matrix import SpreadMatrix
from fe_models.foundation.sparse.sparse_product import SymmetricProduct
from fe_models.foundation.tall.columns import elsewhere, in_memory
from fe_models.foundation.tall.on_disk import row_slices
from fe_models.foundation.units import Units
from fe_models.foundation.words import nearest, quoted
from fe_models.meshes.boundary import facets_of
from fe_models.meshes.cell_shapes import CELL_SHAPES, cell_jacobians, shape_values
from fe_models.meshes.mesh import Mesh
from fe_models.meshes.mesh_numbering import solid_numbering
from fe_models.meshes.objects.as_mesh import as_mesh

__all__ = ["SolidModel", "nodal_rotation", "scalar_mass_gram", "solid_body"]


# rotation at nodes of a solid mesh, which have only translational dofs: half the curl of the displacement -------------
# (1) in a cell, H_ij = ∂u_i/∂x_j at its node, from its shape functions. This is exact for fields linear in x, hence for
#     rigid rotations and constant strain on any mesh, and for quadratic fields in straight-edged quadratic cells
# (2) theta = ½ (H_32 - H_23, H_13 - H_31, H_21 - H_12): the mean rotation of all fibres through the point. In a sheared
#     beam it lies midway between the slope of the axis and the rotation of the section
# (3) at a node, average over its cells


FLAT = 1e-9  #: det J divided by the cube of the largest entry of J, below which a cell has no gradient at its node


def nodal_rotation(mesh: Mesh, u: Array, nodes: IntArray) -> Array:
    """Return rotation vectors at some nodes, (n, 3, k), for displacement columns u, (3 n_nodes, k), mesh axes.

    Raises
    ------
    BodyError
        If no cell at a node has a gradient there, because the cells are collapsed.
    """
    fields = np.asarray(u).reshape(len(mesh.nodes), 3, -1)
    place = np.full(len(mesh.nodes), -1)
    place[nodes] = np.arange(len(nodes))
    total, count = np.zeros((len(nodes), 3, fields.shape[2])), np.zeros(len(nodes))
    for kind, cells in mesh.cells.items():
        _, dN = shape_values(kind, CELL_SHAPES[kind].nodes)  # (node, shape, axis)
        row, local = np.nonzero(place[cells] >= 0)
        X, at = mesh.nodes[cells[row]], place[cells[row, local]]
        J = np.einsum("nai,nak->nik", X, dN[local])
        size = np.abs(J).max(axis=(1, 2), initial=0.0) ** 3
        good = np.linalg.det(J) > FLAT * size
        row, local, J, at = row[good], local[good], J[good], at[good]
        grad = np.einsum("nak,nki->nai", dN[local], np.linalg.inv(J))  # (1)
        U = fields[cells[row]]  # (n, shape, component, k)
        for a, (i, j) in enumerate(((2, 1), (0, 2), (1, 0))):  # (2)
            curl = np.einsum("nb,nbk->nk", grad[:, :, j], U[:, :, i]) - np.einsum(
                "nb,nbk->nk", grad[:, :, i], U[:, :, j]
            )
            np.add.at(total[:, a], at, curl / 2)
        np.add.at(count, at, 1.0)
    if not count.all():
        raise BodyError(f"rotation at node index {nodes[int(np.argmin(count))]}: no cell there has a gradient")
    return total / count[:, None, None]  # (3)


# body -----------------------------------------------------------------------------------------------------------------


CELLS_AT_ONCE = 8_000  #: number of cells whose Jacobians are in memory at a time
GRAM_BYTES = 64e6  #: size of M_s times a block of columns [bytes]


@dataclass(frozen=True, eq=False)
class SolidModel:
    """Element model of a solid body (`fe_body.ElementModel`): mass integrals, stress, geometric stiffness."""

    mesh: Mesh
    materials: tuple[AnyMaterial, ...]
    of_cell: Mapping[str, IntArray]  #: material index of each cell, (n_cells,), by cell type
    M_s: sp.csr_array | SpreadMatrix  #: scalar consistent mass, (n_nodes, n_nodes) [kg]
    incompatible: bool = False  #: whether eight-node bricks have incompatible modes
    integration: str = "full"  #: integration of the stiffness, one of `fe_models.elements.solids.elements.INTEGRATIONS`
    parts: SpreadMesh | None = None  #: distributed mesh, if several ranks assembled it

    has_nodal_stress: ClassVar[bool] = True  #: solid elements can compute their stress
    has_geometric_stiffness: ClassVar[bool] = True  #: solid elements can compute their geometric stiffness

    @cached_property
    def of_node(self) -> IntArray:
        """Material whose stress is used at each node, (n_nodes,): the first one with the largest modulus at the node.

        Stress is discontinuous where materials meet, and one value per node can only represent one side. The stiffer
        side usually has the larger stress, and a fixed choice keeps the stress linear in the displacement.
        """
        order = np.argsort([-material.E for material in self.materials], kind="stable")
        rank = np.empty(len(order), np.int64)
        rank[order] = np.arange(len(order))
        best = np.full(len(self.mesh.nodes), len(order) - 1, np.int64)
        for kind, cells in self.mesh.cells.items():
            np.minimum.at(best, cells.ravel(), np.repeat(rank[self.of_cell[kind]], cells.shape[1]))
        return frozen(order[best], np.int64)

    def mass_gram(self, u: Any) -> Array:
        """Return ∫ a aᵀ dm with a = [1, c, u_x, u_y, u_z], (4 + 3 k, 4 + 3 k), exact; u is (3 n_nodes, k)."""
        if not sp.issparse(self.M_s):
            return spread_mass_gram(self.M_s, self.mesh.nodes, u)
        n_nodes = len(self.mesh.nodes)
        return scalar_mass_gram(
            SymmetricProduct(self.M_s), self.mesh.nodes, np.asarray(u).reshape(n_nodes, -1), n_nodes
        )

    def nodal_stress(self, u: Array, *, nodes: IntArray | None = None) -> Array:
        """Return the stress at the nodes, (n_nodes, 6, k) [Pa], xx yy zz yz xz xy, for columns u, (3 n_nodes, k).

        If `nodes` are given, only their elements are visited, and the other nodes report zero.
        """
        require_rows("nodal_stress", u, 3 * len(self.mesh.nodes))
        return nodal_stress(
            self.mesh, self.materials, self.of_cell, self.of_node, u, nodes=nodes, incompatible=self.incompatible
        )

    def nodal_rotation(self, u: Array, nodes: IntArray) -> Array:
        """Return half the curl of u at nodes of the mesh, (n, 3, k); NaN at other nodes."""
        require_rows("nodal_rotation", u, 3 * len(self.mesh.nodes))
        rotation = np.full((len(nodes), 3, u.shape[1]), np.nan)
        is_own = nodes < len(self.mesh.nodes)
        rotation[is_own] = nodal_rotation(self.mesh, u, nodes[is_own])
        return rotation

    def mass_forces(self, loads: MassLoads) -> Array:
        """Return consistent nodal forces of loads per unit mass, (3 n_nodes, k); exact for loads linear in c."""
        return np.asarray(self.M_s @ loads.at(self.mesh.nodes).reshape(len(self.mesh.nodes), -1)).reshape(-1, loads.k)

    def internal_forces(self, u: Array, *, nodes: IntArray | None = None) -> Array:
        """Return ∫ sigma grad N dV for columns u, (3 n_nodes, k) [N], with the points of the geometric stiffness.

        If `nodes` are given, the forces at other nodes are zero.
        """
        from fe_models.elements.solids.stress_kernels import add_internal_forces

        mesh = self.mesh
        require_rows("internal_forces", u, 3 * len(mesh.nodes))
        fields = np.ascontiguousarray(u).reshape(len(mesh.nodes), 3, -1)
        forces = np.zeros(fields.shape)
        tensors = np.array([material.stiffness for material in self.materials])
        wanted = np.full(len(mesh.nodes), nodes is None)
        if nodes is not None:
            wanted[nodes[nodes < len(wanted)]] = True
        for kind in mesh.cells:
            if self.incompatible and kind == KIND:
                own = wanted[mesh.cells[kind]].any(axis=1)
                cells, of_cells = mesh.cells[kind][own], tensors[self.of_cell[kind][own]]
                for rows, dofs in brick_chunks(cells):
                    K = brick_stiffness(mesh.nodes[cells[rows]], of_cells[rows])
                    np.add.at(forces.reshape(3 * len(mesh.nodes), -1), dofs, K @ np.asarray(u)[dofs])
                continue
            for cells, material, table in integrated_cells(mesh, kind, self.of_cell, self.integration):
                own = wanted[cells].any(axis=1)
                add_internal_forces(
                    mesh.nodes, cells[own], material[own], tensors, table.gradients, table.weights, fields, forces
                )
        forces[~wanted] = 0.0
        return forces.reshape(3 * len(mesh.nodes), -1)

    def geometric_stiffness(self, u: Array, loads: MassLoads, Phi: Any) -> Array:
        """Return Phiᵀ K_geo(sigma_j) Phi, (k, n, n), for states u, (3 n_nodes, k), which enter only by their stress.

        If Phi is distributed, each rank computes the contribution of its cells.
        """
        require_rows("geometric_stiffness", u, 3 * len(self.mesh.nodes))
        require_rows("geometric_stiffness", Phi, 3 * len(self.mesh.nodes))
        if elsewhere(Phi) is not None and self.parts is not None:
            rules = {"incompatible": self.incompatible, "integration": self.integration}
            return spread_geometric_stiffness(self.parts, self.materials, u, Phi, rules)
        return projected_geometric_stiffness(
            self.mesh,
            self.materials,
            self.of_cell,
            u,
            Phi,
            incompatible=self.incompatible,
            integration=self.integration,
        )


def solid_body(
    mesh: Any,
    materials: AnyMaterial | Mapping[str, AnyMaterial],
    *,
    name: str,
    units: Units,
    interfaces: Iterable[Interface] = (),
    incompatible_modes: bool = False,
    integration: str = "full",
    mass: str = "consistent",
    progress: Progress | None = None,
    ranks: Ranks | None = None,
) -> FEBody:
    """Make the body of a mesh of solid cells: isoparametric elements with consistent mass, dof 3 i + c at node i.

    Parameters
    ----------
    mesh
        Tetrahedra, hexahedra, wedges and pyramids, also mixed; faces and lines are ignored. A `fe_models.Mesh`, or a
        mesh of meshio, pyvista or scikit-fem (`fe_models.meshes.as_mesh`).
    materials
        One material for all cells, or one for each group name (`assign_materials`), in the units of the mesh. Materials
        may be anisotropic.
    name
        Name of the body.
    units
        Unit system of coordinates and materials.
    interfaces
        Named places that `cms.couple` couples later.
    incompatible_modes
        Whether eight-node bricks have internal bending modes (`fe_models.elements.solids.incompatible`). Other cells do
        not change.
    integration
        Integration of the stiffness: "full", or "reduced" with the fewest points that finite element programs use
        (`fe_models.elements.solids.elements.REDUCED`): 8 points for 20-node bricks as in C3D20R, 2 points for six-node
        wedges.
    mass
        "consistent"; "reduced", with the points of the reduced stiffness; "14-point", as ANSYS integrates 20-node
        bricks; or "lumped" to the diagonal. Too few points leave some motions without mass: the mass matrix is then
        singular.
    progress
        Callback that receives the finished fraction of the assembly, 0 to 1.
    ranks
        Processes that assemble parts of the mesh and keep their rows of K and M (`SpreadMatrix`). None, or a single
        rank: K and M are ordinary matrices.

    Returns
    -------
    FEBody
        Body whose element model is a `SolidModel`; its surface consists of the boundary triangles.

    Raises
    ------
    MaterialError
        If a group is unknown, or cells have no material or two materials.
    MeshError
        If there is no solid cell, a node belongs to no solid cell, or an element is inverted.
    """
    for what, value, choices in (("integration", integration, INTEGRATIONS), ("mass", mass, MASSES)):
        if value not in choices:
            raise BodyError(f"solid_body: {what}: unknown {quoted(value)}{nearest(value, choices)}")
    mesh = as_mesh(mesh)
    used, of_cell = assign_materials(mesh, materials)
    warn_of_materials(name, units, used)
    rules: dict[str, Any] = {"incompatible": incompatible_modes, "integration": integration, "mass": mass}
    if ranks is None or ranks.size == 1:
        K, M_s = assemble(mesh, used, of_cell, progress=progress, **rules)
        M, parts = expand_scalar_mass(M_s), None
    else:
        K, M, M_s, parts = assemble_on_ranks(ranks, mesh, used, of_cell, rules)
    n_nodes = len(mesh.nodes)
    return FEBody(
        name=name,
        M=M,
        K=K,
        nodes=mesh.nodes,
        dofs=dofs_of(np.arange(n_nodes), 3),
        interfaces=tuple(interfaces),
        units=units,
        surface=facets_of(mesh).triangles,
        node_volumes=node_volumes(mesh),
        element_model=SolidModel(mesh, used, of_cell, M_s, incompatible_modes, integration, parts),
        numbering=solid_numbering(mesh),
        provenance=provenance(mesh, used, of_cell, rules),
    )


def scalar_mass_gram(M_s: SymmetricProduct | RowsProduct, nodes: Array, columns: Array, n_rows: int) -> Array:
    """Return Aᵀ M_s A with A = [1, X, u_x, u_y, u_z] (docs/theory.md §5), (4 + 3 k, 4 + 3 k).

    Parameters
    ----------
    M_s
        Product with the scalar mass, (n_nodes, n_nodes) [kg]; it is applied to a few columns at a time.
    nodes, columns
        Rows of X and of u_x, u_y, u_z for all nodes, (n_nodes, 3 k) [m]. On several ranks: rows of the rank's own
        nodes; the results of all ranks must then be summed.
    n_rows
        Number of rows of M_s, on all ranks.
    """
    n_nodes, k = columns.shape
    width = max(16, int(GRAM_BYTES / (8 * n_rows)))
    linear = np.hstack([np.ones((n_nodes, 1)), nodes])
    gram = np.zeros((4 + k, 4 + k))
    first = linear.T @ (M_s @ linear)
    gram[:4, :4] = (first + first.T) / 2
    for begin in range(0, k, width):
        end = min(begin + width, k)
        product = M_s @ np.ascontiguousarray(in_memory(columns[:, begin:end]))
        own = slice(4 + begin, 4 + end)
        gram[:4, own] = linear.T @ product
        for rows in row_slices(n_nodes, columns):
            gram[4 : 4 + end, own] += columns[rows, :end].T @ product[rows]
        gram[own, : 4 + begin] = gram[: 4 + begin, own].T  # symmetric by definition, so only one half is computed
        gram[own, own] = (gram[own, own] + gram[own, own].T) / 2
    return gram


def spread_mass_gram(M_s: SpreadMatrix, nodes: Array, u: Any) -> Array:
    """Return `scalar_mass_gram` for columns u, (3 n_nodes, k), and a distributed M_s, as sum over the ranks.

    Distributed columns must be laid out as the dofs of the nodes. Columns of rank 0 are sent to the ranks.
    """
    order = (3 * M_s.order[:, None] + np.arange(3)).ravel()
    layout = RowLayout(M_s.ranks, order, Rows(tuple(3 * start for start in M_s.rows.starts)))
    columns, places = spread_columns(layout, u), spread_columns(M_s.layout, nodes)
    if not columns.layout.is_like(layout):
        raise BodyError(f"mass_gram: u, {columns.shape}: its rows are distributed differently from those of M_s")
    return np.asarray(np.sum(M_s.layout.ask(gram_here, M_s.key, places.part, columns.part, len(nodes)), axis=0))


def gram_here(ranks: Ranks, key: str, nodes: Part, u: Part, n_rows: int) -> Array:
    """Return the contribution of the rows on this rank to Aᵀ M_s A."""
    product: RowsProduct = ranks.store[key]
    own = own_part(ranks, u)
    columns = np.ascontiguousarray(own).reshape(product.n_own, 3 * own.shape[1])
    return scalar_mass_gram(product, own_part(ranks, nodes), columns, n_rows)


def node_volumes(mesh: Mesh) -> Array:
    """Return the volume that each node represents, (n_nodes,) [m³]: element volumes, distributed by ∫N_n².

    The consistent weight ∫N_n would be negative at the corners of quadratic elements. The shares are computed in the
    reference cell. Volumes are integrated with the stress points, which is exact for cells with straight edges.
    """
    volumes = np.zeros(len(mesh.nodes))
    for kind, cells in mesh.cells.items():
        element = reference_element(kind)
        share = element.mass.weights @ element.mass.values**2
        for begin in range(0, len(cells), CELLS_AT_ONCE):
            rows = cells[begin : begin + CELLS_AT_ONCE]
            V = cell_jacobians(kind, mesh.nodes[rows], element.stress.points) @ element.stress.weights
            volumes += np.bincount(rows.ravel(), np.outer(V, share / share.sum()).ravel(), minlength=len(volumes))
    return volumes


def provenance(
    mesh: Mesh, materials: tuple[AnyMaterial, ...], of_cell: Mapping[str, IntArray], rules: Mapping[str, Any]
) -> dict[str, str]:
    """Return the provenance of the body: mesh, digest, elements, materials, scikit-fem version, unusual rules."""
    record = {"mesh": mesh.source, "mesh sha256": mesh.digest, "nodes": str(len(mesh.nodes))}
    record |= {f"file {path}": digest for path, digest in mesh.included.items()}
    record |= dict(mesh.origin)
    record |= {f"cells {kind}": str(len(cells)) for kind, cells in mesh.cells.items() if len(cells)}
    for number, material in enumerate(materials):
        count = sum(int((index == number).sum()) for index in of_cell.values())
        record[f"material {material.name}"] = f"{material_words(material)}, {count} cells"
    if len(materials) > 1:
        record["stress where materials meet"] = 'of the stiffest; of each with stress_points = "borders"'
    record["scikit-fem"] = version("scikit-fem")
    if rules["incompatible"] and len(mesh.cells.get(KIND, ())):
        record[f"cells {KIND} with"] = "incompatible modes"
    record["integration of the stiffness"] = rules["integration"] if rules["integration"] != "full" else ""
    record["mass of the cells"] = rules["mass"] if rules["mass"] != "consistent" else ""
    return {key: value for key, value in record.items() if value}
