"""Body from matrix files of another program: rows are assigned to nodes, then the body must prove to be free."""

from collections.abc import Iterable
from dataclasses import dataclass, replace

import numpy as np
import scipy.sparse as sp

from fe_models.body.fe_body import FEBody, Interface, dofs_of
from fe_models.body.freedom import RigidForces, rigid_forces
from fe_models.body.load_cases import LoadCase
from fe_models.body.rigid_motion import rigid_motion_of_dofs
from fe_models.checks.report import Finding, Report
from fe_models.errors import MatrixError
from fe_models.files.matrices.foreign_matrices import ROLES, SCALAR, ForeignMatrices
from fe_models.files.matrices.given import body_from_matrices
from fe_models.foundation.arrays import Array, IntArray
from fe_models.foundation.units import Units
from fe_models.meshes.boundary import boundary_triangles
from fe_models.meshes.mesh import Mesh
from fe_models.meshes.mesh_numbering import node_sets, solid_numbering
from fe_models.meshes.node_cloud import NodeCloud
from fe_models.meshes.numbering import Numbering, rows_of_numbers

__all__ = ["MatrixReport", "body_from_foreign", "nodes_of", "with_geometry", "without_supports"]


# removal of supports from a stiffness that still has the rows of the supported dofs -----------------------------------


def without_supports(
    where: str, K: sp.csc_array, M: sp.csc_array, nodes: Array, dofs: IntArray
) -> tuple[sp.csc_array, str]:
    """Return the stiffness without supports, and a description of the removed supports.

    A support between node n and the ground only changes the block K_nn. In a free body, the rigid-body motions Psi
    about n, which are 1 on the dofs of n, cause no force: K_nn + K_n,rest Psi_rest = 0.

    (1) find the supported nodes: those with rows that resist rigid-body motion
    (2) set K_nn = -K_n,rest Psi_rest. Nothing is subtracted from K_nn, because a penalty of 1e36 leaves no digits in it
    (3) check that the result is free in all six motions; (2) does not use rotations at nodes without rotations

    Parameters
    ----------
    where
        Name of the matrices, for messages.
    K, M
        Stiffness and mass, (n_dof, n_dof).
    nodes
        Node positions, (n_nodes, 3) [m].
    dofs
        Node index and component of each row, (n_dof, 2).

    Raises
    ------
    MatrixError
        If there are no supports, or the body is not free without them.
    """
    forces = rigid_forces(K, M, nodes, dofs)
    supported = supported_nodes(forces, dofs)  # (1)
    if not len(supported):
        raise MatrixError(f"{where}: there are no supports to remove: K answers no rigid-body motion")
    rows_of = sp.csr_array(K)
    blocks = []
    for node in supported:  # (2)
        rows = np.flatnonzero(dofs[:, 0] == node)
        Psi = rigid_motion_of_dofs(nodes, dofs, nodes[node])[:, dofs[rows, 1]]
        Psi[rows] = 0.0
        K_nn = -(rows_of[rows] @ Psi)
        blocks.append((rows, (K_nn + K_nn.T) / 2))
    entries = sp.coo_array(K)
    node_1, node_2 = dofs[entries.row, 0], dofs[entries.col, 0]
    kept = (node_1 != node_2) | ~np.isin(node_1, supported)
    values = np.concatenate([entries.data[kept], *(block.ravel() for _, block in blocks)])
    row = np.concatenate([entries.row[kept], *(np.repeat(rows, len(rows)) for rows, _ in blocks)])
    column = np.concatenate([entries.col[kept], *(np.tile(rows, len(rows)) for rows, _ in blocks)])
    released = sp.csc_array((values, (row, column)), shape=K.shape)
    left = rigid_forces(released, M, nodes, dofs)
    if not left.is_free:  # (3)
        raise MatrixError(
            f"{where}: without what holds {len(supported)} nodes to the ground the body is still not free (up to "
            f"{left.largest.max():.1e} of its stiffest entry): rows were taken out, or it is held by more than its "
            "diagonal; write the matrices without supports"
        )
    return released, f"supports of {len(supported)} nodes were removed"


def supported_nodes(forces: RigidForces, dofs: IntArray) -> IntArray:
    """Return the nodes whose rows resist rigid-body motion, ascending."""
    return np.unique(dofs[forces.rows, 0])


# body -----------------------------------------------------------------------------------------------------------------


NODE_MAJOR = (3, 6)  #: possible numbers of rows per node if there is no list of dofs


def nodes_of(read: ForeignMatrices) -> NodeCloud:
    """Return the nodes contained in the matrix files.

    Raises
    ------
    MatrixError
        If they contain none.
    """
    if read.nodes is None or read.node_numbers is None:
        raise MatrixError(
            f"{where_of(read)}: the files say nothing of where the nodes are; give the deck or mesh they were made of: "
            'geometry = "model.inp" in [body] of a job, geometry= in Python'
        )
    return NodeCloud(read.nodes, node_numbers=read.node_numbers, source=", ".join(read.files))


def with_geometry(read: ForeignMatrices, geometry: Mesh | NodeCloud) -> ForeignMatrices:
    """Return the record with the nodes of a deck or mesh, and with dofs for its rows if the files name none.

    Without a list of dofs, 3 (or 6) rows are assigned to each node, in ascending order of the node numbers 1, 2, ...; a
    note reports this. The stiffness of a free body shows whether it is correct: in another order it is not free.

    Raises
    ------
    MatrixError
        If rows and nodes do not fit.
    """
    where = where_of(read)
    numbers = numbers_of(geometry)
    read = replace(read, nodes=geometry.nodes, node_numbers=numbers)
    if read.dofs is None:
        n, n_nodes = read.n_dof or 0, len(numbers)
        per_node = next((k for k in NODE_MAJOR if n == k * n_nodes), None)
        if per_node is None:
            raise MatrixError(
                f"{where}: {n} rows and no list of their dofs: expected 3 or 6 for each of the {n_nodes} nodes of "
                f"{geometry.source or 'the geometry'}; give the list of dofs, or write the matrices with node "
                "numbers"
            )
        if not np.array_equal(np.sort(numbers), np.arange(1, n_nodes + 1)):
            raise MatrixError(
                f"{where}: no list of dofs, and the nodes are numbered {numbers.min()} to {numbers.max()} with gaps, "
                "so that nobody knows which row is whose; write the matrices with node numbers (Abaqus: "
                "FORMAT=MATRIX INPUT)"
            )
        dofs = dofs_of(np.arange(1, n_nodes + 1), per_node)
        note = f"rows taken as {per_node} to a node in the order of their numbers, as no list of dofs was given"
        read = replace(read, dofs=dofs, notes=(*read.notes, note))
    return read


def body_from_foreign(
    read: ForeignMatrices,
    geometry: Mesh | NodeCloud | None = None,
    *,
    name: str,
    units: Units,
    interfaces: Iterable[Interface] = (),
    held: bool = False,
    remove_supports: bool = False,
    repair_mass: bool = False,
    accept: Iterable[str] = (),
) -> FEBody:
    """Return the body of imported matrices with the nodes of a deck or mesh.

    (1) find dofs and nodes of the rows (`with_geometry`); the body has the nodes of the geometry, in the same order
    (2) remove constrained rows and rows without stiffness and mass; (4) finds the supports that this causes
    (3) if requested, remove supports whose rows exist (`without_supports`)
    (4) make the body (`body_from_matrices`): free, or fixed as declared; mass moments are exact if M is M_s ⊗ 1₃

    Parameters
    ----------
    read
        Matrices from `read_matrices`.
    geometry
        Mesh or nodes from `read_geometry`; None: the matrix files contain the nodes.
    name, units, interfaces, held, repair_mass, accept
        As for `body_from_matrices`; interfaces refer to node indices of the geometry.
    remove_supports
        Whether springs and penalties between nodes and the ground are removed from K.

    Raises
    ------
    MatrixError
        If stiffness, mass, dofs or nodes are missing or do not fit.
    BodyError
        If `body_from_matrices` raises it.
    """
    where = where_of(read)
    read = with_geometry(read, geometry if geometry is not None else nodes_of(read))  # (1)
    for role, words in {"K": "stiffness", "M": "mass"}.items():
        if getattr(read, role) is None:
            got = ", ".join(name for name in ROLES if getattr(read, name) is not None) or "none"
            raise MatrixError(f"{where}: expected stiffness and mass, got {got}; the {words} {role} is missing")
    nodes, dofs = np.asarray(read.nodes), rows_of_nodes(where, read)
    matrices = {role: sp.csc_array(matrix) for role in ROLES if (matrix := getattr(read, role)) is not None}
    notes = list(read.notes)
    is_kept = (abs(matrices["K"]).sum(axis=0) > 0) | (abs(matrices["M"]).sum(axis=0) > 0)  # (2)
    is_kept[read.constrained] = False
    if not is_kept.all():
        kept = np.flatnonzero(is_kept)
        notes.append(f"{len(is_kept) - len(kept)} rows without stiffness and mass, or held, were left out")
        matrices = {role: matrix[kept][:, kept] for role, matrix in matrices.items()}
        dofs = dofs[kept]
    if len(read.removed):
        notes.append(f"{len(read.removed)} dofs have no rows: the other program holds them")
    if remove_supports:  # (3)
        matrices["K"], note = without_supports(where, matrices["K"], matrices["M"], nodes, dofs)
        notes.append(note)
    files = dict(read.files)
    if geometry is not None and geometry.digest:
        files |= {geometry.source: geometry.digest, **geometry.included}
    record = {"mesh": ", ".join(files)} | {f"file {path}": digest for path, digest in files.items()}
    record |= {"program": read.program} if read.program else {}
    record |= (
        {"triangles": ", ".join(f"{role} {kind}" for role, kind in read.triangle.items())} if read.triangle else {}
    )
    record |= {"notes": "; ".join(notes)} if notes else {}
    body = body_from_matrices(  # (4)
        matrices["M"], matrices["K"], nodes, dofs, name=name, units=units, interfaces=interfaces, D=matrices.get("D"),
        surface=boundary_triangles(geometry) if isinstance(geometry, Mesh) else None,
        provenance=record, held=held, repair_mass=repair_mass, accept=accept,
        numbering=foreign_numbering(read, geometry),
    )  # fmt: skip
    loads = {load: force[is_kept] for load, force in read.loads.items()}
    return body.with_load_cases(*(LoadCase(load, "force", force) for load, force in loads.items()))


def foreign_numbering(read: ForeignMatrices, geometry: Mesh | NodeCloud | None) -> Numbering:
    """Return the node numbers of the other program, and elements and sets if a mesh contains them."""
    numbers = np.zeros(0, np.int64) if read.node_numbers is None else read.node_numbers
    if isinstance(geometry, Mesh):
        return replace(solid_numbering(geometry), nodes=numbers)
    sets = node_sets(geometry.node_sets) if geometry is not None else []
    return Numbering(nodes=numbers, sets=tuple(sets))


def rows_of_nodes(where: str, read: ForeignMatrices) -> IntArray:
    """Return (node index, component) of each row, (n_dof, 2)."""
    if read.dofs is None or read.node_numbers is None:
        raise MatrixError(f"{where}: the dofs of the rows are not known; give the list of dofs with the matrices")
    scalars = np.flatnonzero(read.dofs[:, 1] == SCALAR)
    if len(scalars):
        raise MatrixError(
            f"{where}: {len(scalars)} rows have no place (scalar points, modal coordinates), first "
            f"{read.dofs[scalars[0], 0]}: these are the matrices of a reduced body, which `cms import` takes"
        )
    order = np.argsort(read.node_numbers)
    rows = rows_of_numbers(read.node_numbers, order, read.dofs[:, 0])
    missing = np.unique(read.dofs[rows < 0, 0])
    if len(missing):
        raise MatrixError(
            f"{where}: {len(missing)} nodes of the rows are not in the geometry, first {missing[0]}; is this the deck "
            "they were made of?"
        )
    return np.stack([rows, read.dofs[:, 1]], axis=1)


def numbers_of(geometry: Mesh | NodeCloud) -> IntArray:
    """Return the node numbers of the file; 1, 2, ... if it has none."""
    return geometry.node_numbers if geometry.node_numbers.size else np.arange(1, len(geometry.nodes) + 1)


def where_of(read: ForeignMatrices) -> str:
    """Return the names of the files, as the beginning of a message."""
    return f"matrices {', '.join(read.files) or 'in memory'}"


# report on imported matrices for the user: files, rows, stored triangle, assumptions ----------------------------------


@dataclass(frozen=True, eq=False)
class MatrixReport(Report):
    """Numbers and notes of imported matrices, shown before the checks."""

    read: ForeignMatrices
    source: str = ""
    findings: tuple[Finding, ...] = ()

    @property
    def title(self) -> str:
        """Title of the table."""
        return "Matrices"

    def numbers(self) -> list[tuple[str, str]]:
        """Return label and value of each number and note, as text."""
        read = self.read
        rows = [("files", ", ".join(path.rpartition("/")[2] for path in read.files))]
        rows += [("program", read.program)] if read.program else []
        nodes = "" if read.dofs is None else f" of {len(np.unique(read.dofs[:, 0]))} nodes"
        rows.append(("rows", f"{read.n_dof}{nodes}"))
        for role in ROLES:
            if (matrix := getattr(read, role)) is not None:
                rows.append((role, f"{matrix.nnz} entries, stored: {read.triangle.get(role, 'both')}"))
        rows += [("load", name) for name in read.loads]
        return rows + [("note", note) for note in read.notes]
