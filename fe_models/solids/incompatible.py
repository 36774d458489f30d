r"""The eight-node brick with incompatible modes, which bends as a beam does.

A trilinear field cannot bend: u = x y needs v = -x²/2 beside it, and without that a cell of the length l in a wall of
the height h takes up a shear energy of (G/E)(l/h)² of the bending energy, however many cells lie across the wall. Three
internal vectors a_m give the cell what it lacks [1]_:

    u = Σ N_i u_i + Σ_m (1 - xi_m²) a_m,   xi_m in -1..1

(1) their gradients are taken with the Jacobian J_0 at the centre, times det J_0/det J [2]_: then ∫ grad (1 - xi_m²) = 0
    on any shape, so that constant stress does no work on them and the patch test holds on distorted cells; on a
    parallelepiped they are the gradients themselves
(2) the a_m make the energy least, ∫ grad (1 - xi_m²) · sigma = 0, and so are linear in the nodal displacements
(3) the gradient of the whole field is then H = B u with one operator per point, from which stiffness, stress, nodal
    forces and geometric stiffness follow alike; a rigid rotation has a = 0 and meets the turned nodal forces by (2)

The internal motion carries no mass. The field is not continuous between cells: frequencies may lie on either side.

.. [1] Wilson, Taylor, Doherty & Ghaboussi (1973), in: Numerical and Computer Methods in Structural Mechanics, 43-57.
.. [2] Taylor, Beresford & Wilson (1976), Int. J. Numer. Meth. Engng 10, 1211-1219.
"""

from collections.abc import Iterator
from functools import cache

import numpy as np

from fe_models.foundation.arrays import Array, IntArray, frozen
from fe_models.solids.elements import reference_element, shape_table

__all__ = ["KIND", "VOIGT", "brick_chunks", "brick_operators", "brick_stiffness", "gradient_stress"]

KIND = "hexahedron"
CELLS_AT_ONCE = 1000  #: whose operators are held at once, 14 kB each
VOIGT = np.array([0, 4, 8, 5, 2, 1])  #: rows of xx yy zz yz xz xy in a tensor, 3 i + j
TENSOR = np.array([0, 5, 4, 5, 1, 3, 4, 3, 2])  #: the other way: component of xx yy zz yz xz xy in row 3 i + j
TRANSPOSED = np.array([0, 3, 6, 1, 4, 7, 2, 5, 8])  #: row 3 j + i in row 3 i + j


def brick_operators(x: Array, C: Array) -> tuple[Array, Array]:
    """Return the gradient operators at the points of the stiffness and their volumes.

    Parameters
    ----------
    x
        Positions of the nodes, (n, 8, 3) [m].
    C
        Stress by strain of each cell, (n, 6, 6) [Pa], rows xx yy zz yz xz xy.

    Returns
    -------
    tuple
        B, (n, 8, 9, 24): H_ij = ∂u_i/∂x_j in row 3 i + j over the dofs of the nodes; and w det J, (n, 8) [m³].
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
    """Return ∫ Bᵀ C B, (n, 24, 24) [N/m], symmetric."""
    B, volumes = brick_operators(x, C)
    n, p = volumes.shape
    stress = gradient_stress(B, C) * volumes[:, :, None, None]
    K = B.reshape(n, 9 * p, 24).transpose(0, 2, 1) @ stress.reshape(n, 9 * p, 24)
    return np.asarray((K + K.transpose(0, 2, 1)) / 2)


def gradient_stress(H: Array, C: Array) -> Array:
    """Return the stress, rows 3 i + j, of gradients H_ij, likewise, (n, p, 9, k), by C of each cell, (n, 6, 6)."""
    strain = (H + H[:, :, TRANSPOSED])[:, :, VOIGT]  # twice the strain: shear strains doubled,
    strain[:, :, :3] /= 2  # normal strains as they are
    return np.asarray((C[:, None] @ strain)[:, :, TENSOR])


def brick_chunks(cells: IntArray) -> Iterator[tuple[slice, IntArray]]:
    """Yield rows of cells few enough to hold their operators, and the dofs of their nodes, (n, 24)."""
    for begin in range(0, len(cells), CELLS_AT_ONCE):
        rows = slice(begin, min(begin + CELLS_AT_ONCE, len(cells)))
        yield rows, (3 * cells[rows, :, None] + np.arange(3)).reshape(-1, 24)


def _of_components(grad: Array) -> Array:
    """Return the operator of H_ij for three components, (n, p, 9, 3 a), of gradients of a functions, (n, p, a, 3)."""
    n, p, a, _ = grad.shape
    H = np.zeros((n, p, 3, 3, a, 3))
    for i in range(3):
        H[:, :, i, :, :, i] = grad.transpose(0, 1, 3, 2)
    return H.reshape(n, p, 9, 3 * a)


@cache
def _tables() -> tuple[Array, Array, Array, Array]:
    """Gradients and weights of the rule, slopes of 1 - xi_m² by the reference coordinates, gradients at the centre."""
    table = reference_element(KIND).stiffness
    centre = np.full((1, 3), 0.5)  # of the reference cell, 0..1
    slopes = -8 * (table.points - centre)
    return table.gradients, table.weights, frozen(slopes), shape_table(KIND, centre, np.ones(1)).gradients[0]
