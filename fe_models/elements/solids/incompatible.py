r"""Eight-node brick with incompatible modes, which bends as a beam does.

A trilinear field cannot represent bending, because the displacement u = x y requires v = -x²/2. Without this term, a
cell of length l in a wall of height h has a parasitic shear energy of (G/E)(l/h)² times the bending energy, for any
number of cells across the wall. Three internal vectors a_m provide the missing field [1]_:

    u = Σ N_i u_i + Σ_m (1 - xi_m²) a_m,   xi_m in -1..1

(1) Their gradients are taken with the Jacobian J_0 at the centre, times det J_0/det J [2]_. Then ∫ grad (1 - xi_m²) = 0
    for any shape, so constant stress does no work on them, and distorted cells pass the patch test. On a parallelepiped
    these are the true gradients.
(2) The a_m minimise the energy, ∫ grad (1 - xi_m²) · sigma = 0, and so are linear in the nodal displacements.
(3) The gradient of the complete field is then H = B u with one operator per point. Stiffness, stress, nodal forces and
    geometric stiffness all follow from it. For a rigid rotation a = 0, and by (2) the work of the geometric stiffness
    equals that of the rotated nodal forces.

The internal motion has no mass. The field is not continuous between cells, so frequencies may be too high or too low.

.. [1] Wilson, Taylor, Doherty & Ghaboussi (1973), in: Numerical and Computer Methods in Structural Mechanics, 43-57.
.. [2] Taylor, Beresford & Wilson (1976), Int. J. Numer. Meth. Engng 10, 1211-1219.
"""

from collections.abc import Iterator
from functools import cache

import numpy as np

from fe_models.elements.solids.elements import reference_element, shape_table
from fe_models.foundation.arrays import Array, IntArray, frozen

__all__ = ["KIND", "VOIGT", "brick_chunks", "brick_operators", "brick_stiffness", "gradient_stress"]

KIND = "hexahedron"
CELLS_AT_ONCE = 1000  #: number of cells whose operators (14 kB each) are in memory at a time
VOIGT = np.array([0, 4, 8, 5, 2, 1])  #: rows of xx yy zz yz xz xy in a tensor with rows 3 i + j
TENSOR = np.array([0, 5, 4, 5, 1, 3, 4, 3, 2])  #: index in xx yy zz yz xz xy of each tensor row 3 i + j
TRANSPOSED = np.array([0, 3, 6, 1, 4, 7, 2, 5, 8])  #: tensor row 3 j + i for each tensor row 3 i + j


def brick_operators(x: Array, C: Array) -> tuple[Array, Array]:
    """Return the gradient operators at the quadrature points of the stiffness, and the volumes of the points.

    Parameters
    ----------
    x
        Positions of the nodes, (n, 8, 3) [m].
    C
        Matrix of each cell that maps strain to stress, (n, 6, 6) [Pa], rows xx yy zz yz xz xy.

    Returns
    -------
    tuple
        B, (n, 8, 9, 24), which gives H_ij = ∂u_i/∂x_j in row 3 i + j from the dofs of the nodes; and w det J, (n, 8)
        [m³].
    """
    dN, weights, slopes, dN_0 = _tables()
    n, p = len(x), len(weights)
    J = np.einsum("nai,pak->npik", x, dN)
    det = np.linalg.det(J)
    grad = np.einsum("pak,npki->npai", dN, np.linalg.inv(J))
    J_0 = np.einsum("nai,ak->nik", x, dN_0)
    added = np.einsum("pm,nmi->npmi", slopes, np.linalg.inv(J_0))  # (1)
    added *= (np.linalg.det(J_0)[:, None] / det)[:, :, None, None]
    B, G = _of_components(grad), _of_components(added)
    volumes = det * weights
    work = (gradient_stress(G, C) * volumes[:, :, None, None]).reshape(n, 9 * p, 9).transpose(0, 2, 1)
    a = -np.linalg.solve(work @ G.reshape(n, 9 * p, 9), work @ B.reshape(n, 9 * p, 24))  # (2)
    return B + G @ a[:, None], volumes  # (3)


def brick_stiffness(x: Array, C: Array) -> Array:
    """Return ∫ Bᵀ C B dV, (n, 24, 24) [N/m], symmetric."""
    B, volumes = brick_operators(x, C)
    n, p = volumes.shape
    stress = gradient_stress(B, C) * volumes[:, :, None, None]
    K = B.reshape(n, 9 * p, 24).transpose(0, 2, 1) @ stress.reshape(n, 9 * p, 24)
    return np.asarray((K + K.transpose(0, 2, 1)) / 2)


def gradient_stress(H: Array, C: Array) -> Array:
    """Return the stress, (n, p, 9, k), rows 3 i + j, of gradients H_ij in the same rows; C: each cell, (n, 6, 6)."""
    strain = (H + H[:, :, TRANSPOSED])[:, :, VOIGT]  # twice the strain: shear strains doubled,
    strain[:, :, :3] /= 2  # normal strains are divided by two again
    return np.asarray((C[:, None] @ strain)[:, :, TENSOR])


def brick_chunks(cells: IntArray) -> Iterator[tuple[slice, IntArray]]:
    """Yield blocks of cells whose operators fit in memory, and the dofs of their nodes, (n, 24)."""
    for begin in range(0, len(cells), CELLS_AT_ONCE):
        rows = slice(begin, min(begin + CELLS_AT_ONCE, len(cells)))
        yield rows, (3 * cells[rows, :, None] + np.arange(3)).reshape(-1, 24)


def _of_components(grad: Array) -> Array:
    """Return the operator of H_ij for three components, (n, p, 9, 3 a), from gradients of a functions, (n, p, a, 3)."""
    n, p, a, _ = grad.shape
    H = np.zeros((n, p, 3, 3, a, 3))
    for i in range(3):
        H[:, :, i, :, :, i] = grad.transpose(0, 1, 3, 2)
    return H.reshape(n, p, 9, 3 * a)


@cache
def _tables() -> tuple[Array, Array, Array, Array]:
    """Return gradients and weights of the rule, slopes ∂(1 - xi_m²)/∂xi, and gradients at the cell centre."""
    table = reference_element(KIND).stiffness
    centre = np.full((1, 3), 0.5)  # centre of the reference cell, 0..1
    slopes = -8 * (table.points - centre)
    return table.gradients, table.weights, frozen(slopes), shape_table(KIND, centre, np.ones(1)).gradients[0]
