"""Stiffness error of first-order cells: lowest frequencies of a body compared with second-order cells.

(1) from a large mesh take a piece: the cells that are nearest, through facets, to the thinnest wall
(2) compute the lowest elastic modes of the free piece, K phi = lam M phi
(3) take the same piece with second-order cells (27-node bricks, ten-node tetrahedra; wedges, and bricks beside them,
    are divided into such tetrahedra), and make a few steps of LOBPCG from the field of (2), preconditioned with the
    factor of (2) and the nodal blocks
(4) return the largest ratio of frequencies; every step of (3) lowers the second-order frequencies, so the result is a
    lower bound of the error
"""

import warnings
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
import scipy.linalg as la
import scipy.sparse as sp
import scipy.sparse.linalg as spla

from fe_models.body.material import AnyMaterial, Material, assign_materials
from fe_models.body.rigid_motion import rigid_motion_of_points
from fe_models.elements.solids.assembly import assemble, expand_scalar_mass
from fe_models.foundation.arrays import Array, IntArray
from fe_models.meshes.boundary import boundary_nodes, facets_of
from fe_models.meshes.mesh import Mesh, drop_unused_nodes
from fe_models.meshes.quadratic_mesh import quadratic_mesh, tetrahedra_of

__all__ = ["PROVENANCE", "FirstOrderError", "first_order_error"]

LARGEST_PIECE = 1000  #: largest number of nodes of the sample piece; its second-order mesh has eight times as many
LARGEST_CUT = 400  #: the same for cells that are divided into tetrahedra, which gives thirty times as many nodes
SMALL = 900  #: number of second-order dofs up to which dense matrices are faster
N_MODES, N_GUARDS = 3, 2
STEPS = 12  #: number of LOBPCG steps
SMOOTHINGS = 6  #: number of passes that average the share of boundary nodes over neighbours
SHIFT = 1e-4  #: shift over the median of K_kk / M_kk; it is below the elastic modes of the piece
PROVENANCE = "first-order error"  #: key in the provenance of a body; its value is the error, followed by a text
STEEL = Material("any", E=2.1e11, nu=0.3, rho=7850.0)  #: material used if none is given; E and rho have no influence


@dataclass(frozen=True)
class FirstOrderError:
    """Error of the lowest frequencies of a body, or of a piece of it, due to first-order cells."""

    error: float  #: largest f / f_second - 1 of the lowest elastic modes; a lower bound
    n_cells: int  #: number of cells of the piece
    is_whole: bool  #: whether the piece is the whole mesh
    kinds: tuple[str, ...]  #: cell types in the piece

    @property
    def finding(self) -> str:
        """Description of the result."""
        piece = "" if self.is_whole else f" of a piece of {self.n_cells} cells, where the walls are thinnest,"
        return f"lowest frequencies{piece} {100 * self.error:.2g} % or more too high against second order"

    def provenance(self) -> dict[str, str]:
        """Return the entries for the provenance of a body."""
        return {PROVENANCE: f"{self.error:.3g} {self.finding}"}

    def description(self) -> str:
        """Describe the result and the remedy."""
        cures = {
            "tetra": "mesh with ten-node tetrahedra (tetra10)",
            "hexahedron": "give bricks incompatible modes, or mesh with 20 or 27 nodes",
            "wedge": "mesh with tetra10 instead of wedges",
            "pyramid": "mesh with pyramid13 beside tetra10 and hexahedron20",
        }
        what = "; ".join(cures[kind] for kind in self.kinds)
        return (
            f"cells of first order ({', '.join(self.kinds)}): {self.finding}; {what}; or mesh finer: half the size "
            "of the cells leaves a quarter of the error"
        )


def first_order_error(
    mesh: Mesh, materials: AnyMaterial | Mapping[str, AnyMaterial] | None = None, *, incompatible_modes: bool = False
) -> FirstOrderError:
    """Estimate by how much first-order cells raise the lowest frequencies.

    Parameters
    ----------
    mesh
        Cells of first order only, without errors in the mesh report.
    materials
        As for `solid_body`; None: a material with nu = 0.3.
    incompatible_modes
        Whether eight-node bricks have incompatible modes.
    """
    given, of_cell = assign_materials(mesh, STEEL if materials is None else materials)
    piece, chosen = piece_of(mesh)  # (1)
    number = np.concatenate([of_cell[kind] for kind in mesh.cells])[chosen]
    K, M_s = assemble(piece, given, by_type(piece, number), incompatible=incompatible_modes)
    coarse = LowestModes(K, expand_scalar_mass(M_s))  # (2)
    if set(piece.cells) in ({"tetra"}, {"hexahedron"}):  # (3)
        finer, P = quadratic_mesh(piece)
    else:
        cut, P, owner = tetrahedra_of(piece)
        finer, P_2 = quadratic_mesh(cut)
        P, number = sp.csr_array(P_2 @ P), number[owner]
    K, M_s = assemble(finer, given, by_type(finer, number))
    second = coarse.improved(K, expand_scalar_mass(M_s), finer.nodes, P)
    error = np.sqrt(coarse.omega2[:N_MODES] / second[:N_MODES]).max() - 1  # (4)
    return FirstOrderError(float(max(error, 0.0)), len(chosen), len(chosen) == mesh.n_cells, tuple(piece.cells))


class LowestModes:
    """Lowest elastic modes of a free piece, and the factorisation that computed them.

    Attributes
    ----------
    omega2 : (N_MODES + N_GUARDS,) [1/s²]
    Phi : (n, N_MODES + N_GUARDS)
    """

    def __init__(self, K: sp.csc_array, M: sp.csc_array) -> None:
        n, self.shift = K.shape[0], SHIFT * float(np.median(K.diagonal() / M.diagonal()))
        self.factor = spla.splu(
            sp.csc_array(K + self.shift * M),
            permc_spec="MMD_AT_PLUS_A",
            diag_pivot_thresh=0.0,
            options={"SymmetricMode": True},
        )
        n_wanted = min(6 + N_MODES + N_GUARDS, n - 1)
        inverse = spla.LinearOperator((n, n), self.factor.solve, dtype=np.float64)
        v0 = np.random.default_rng(0).normal(size=n)
        omega2, Phi = spla.eigsh(K, n_wanted, M, sigma=-self.shift, OPinv=inverse, v0=v0)
        order = np.argsort(omega2)[6:]
        self.omega2, self.Phi = omega2[order], Phi[:, order]

    def improved(self, K: sp.csc_array, M: sp.csc_array, nodes: Array, P: sp.csr_array) -> Array:
        """Return omega² of the same modes in a higher-order field that contains the first-order field, ascending.

        Parameters
        ----------
        K, M
            Stiffness and mass of that field, (3 n_nodes, 3 n_nodes).
        nodes
            Positions of its nodes, (n_nodes, 3).
        P
            Interpolation from the nodes here to its nodes, (n_nodes, n_nodes here).
        """
        if K.shape[0] <= SMALL:
            return np.asarray(la.eigh(K.toarray(), M.toarray(), eigvals_only=True)[6 : 6 + N_MODES])
        up = sp.kron(P, sp.eye_array(3), format="csr")
        down = sp.csr_array(up.T)
        at_nodes = sp.bsr_array(K + self.shift * M, blocksize=(3, 3))
        row = np.repeat(np.arange(len(nodes)), np.diff(at_nodes.indptr))
        inverse = np.linalg.inv(at_nodes.data[row == at_nodes.indices])

        def precondition(r: Array) -> Array:
            columns = r.reshape(len(r), -1)
            smooth = up @ self.factor.solve(np.ascontiguousarray(down @ columns))
            local = (inverse @ columns.reshape(len(nodes), 3, -1)).reshape(columns.shape)
            return np.asarray(smooth + local).reshape(r.shape)

        rigid = rigid_motion_of_points(nodes, nodes.mean(axis=0)).reshape(-1, 6)
        operator = spla.LinearOperator(K.shape, precondition, matmat=precondition, dtype=np.float64)
        with warnings.catch_warnings():  # early termination is intended
            warnings.simplefilter("ignore")
            omega2, _ = spla.lobpcg(
                K, up @ self.Phi, B=M, M=operator, Y=rigid, largest=False, maxiter=STEPS, tol=1e-4 * self.omega2[0]
            )
        return np.sort(np.asarray(omega2, dtype=float))


def piece_of(mesh: Mesh) -> tuple[Mesh, IntArray]:
    """Step (1): return the piece, and the indices of its cells in the numbering over all types, ascending, (n,)."""
    pairs = facets_of(mesh).pairs
    n = mesh.n_cells
    joined = sp.coo_array(
        (np.ones(2 * len(pairs)), (pairs.ravel("F"), pairs[:, ::-1].ravel("F"))), shape=(n, n)
    ).tocsr()
    on_boundary = np.zeros(len(mesh.nodes))
    on_boundary[boundary_nodes(mesh)] = 1.0
    share = np.concatenate([on_boundary[cells].mean(axis=1) for cells in mesh.cells.values()])
    counts = joined.sum(axis=1) + 1
    for _ in range(SMOOTHINGS):
        share = (joined @ share + share) / counts
    nearest = sp.csgraph.breadth_first_order(joined, int(share.argmax()), return_predecessors=False).astype(np.int64)
    corners = list(mesh.cells.values())
    size = np.concatenate([np.full(len(cells), cells.shape[1]) for cells in corners])
    start = np.cumsum(size) - size
    members = np.concatenate([cells.ravel() for cells in corners])
    in_order = np.concatenate([members[start[cell] : start[cell] + size[cell]] for cell in nearest.tolist()])
    is_new = np.zeros(len(in_order), bool)
    is_new[np.unique(in_order, return_index=True)[1]] = True
    n_nodes = np.cumsum(is_new)[np.cumsum(size[nearest]) - 1]
    most = LARGEST_PIECE if set(mesh.cells) in ({"tetra"}, {"hexahedron"}) else LARGEST_CUT
    chosen = np.sort(nearest[: max(1, int((n_nodes <= most).sum()))])
    is_chosen, first = np.zeros(n, bool), 0
    is_chosen[chosen] = True
    kept: dict[str, IntArray] = {}
    for kind, cells in mesh.cells.items():
        rows = is_chosen[first : first + len(cells)]
        first += len(cells)
        if rows.any():
            kept[kind] = cells[rows]
    return drop_unused_nodes(Mesh(mesh.nodes, kept)), chosen


def by_type(mesh: Mesh, number: IntArray) -> dict[str, IntArray]:
    """Split cell indices in the numbering over all types into indices for each type."""
    ends = np.cumsum([len(cells) for cells in mesh.cells.values()])
    return dict(zip(mesh.cells, np.split(number, ends[:-1]), strict=True))
