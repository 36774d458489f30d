"""Geometric stiffness of flat shells (docs/theory.md §7).

A point at distance z from the middle surface moves by u + z psi + ½ z theta × (theta × n), where psi = theta × n and
theta is a rotation vector. The stress does work on the second-order terms of the Green strain. Its resultants are N = ∫
sigma dz, M = ∫ z sigma dz, Q, and P = ∫ z² sigma dz, which is N t²/12 for one material. Over the middle surface, with a
and b along its axes e_a, the work is

    ½ N_ab u,a·u,b + ½ P_ab psi,a·psi,b  +  M_ab [u,a·psi,b + ½ e_b·(theta × (theta × n)),a]
    +  Q_a [u,a·psi + ½ e_a·(theta × (theta × n))]

The loads also do work on the second-order term of the rotation, through the normal and through the levers between nodes
and middle surface (`rigid_motion.rotation_work`), and so do the nodal forces of the cell. The drilling stress of quads
is neglected, because it vanishes as the mesh is refined. Q is the shear force that balances the nodal forces normal to
the cell, not the product of shear stiffness and shear strain: in these elements the change of M along the sides
balances most of the nodal forces.
"""

from functools import cache

import numpy as np

from fe_models.body.rigid_motion import MassLoads, rotation_work
from fe_models.elements.beams.geometric import slice_couples, slice_forces
from fe_models.elements.shells.elements import DRILLING_SHARE, STRAIN_DEGREE, ShellCells, translations
from fe_models.elements.shells.shapes import flat_quadrature, flat_shape
from fe_models.elements.shells.strains import inverse_2x2, jacobians
from fe_models.foundation.arrays import Array, frozen

__all__ = ["cell_geometric_stiffness"]

N_FIELDS = 15  #: number of fields u,1 u,2 theta,1 theta,2 theta, with three components each
#: indices of the components xx yy zz yz xz xy
FIRST, SECOND = np.array([0, 1, 2, 1, 0, 0]), np.array([0, 1, 2, 2, 2, 1])
PRODUCT_BYTES = 1.5e6  #: size of the products that a thread has at a time; they must fit in its cache [bytes]


def cell_geometric_stiffness(cells: ShellCells, rows: slice, u: Array, loads: MassLoads, Phi: Array) -> Array:
    """Return Phiᵀ K_geo Phi of some cells, (k, n, n).

    Parameters
    ----------
    cells, rows
        Cells of one type, and the rows to use.
    u
        Static states over the dofs of the nodes, (6 n_nodes, k).
    loads
        The k loads per unit mass that act in these states.
    Phi
        Columns over the dofs of the nodes, (6 n_nodes, n).
    """
    dofs = cells.dofs[rows]
    columns = Phi[dofs]
    strains, elasticity = cells.strains(rows), cells.elasticity(rows)
    values = strains.B @ u[dofs][:, None]
    resultants = (elasticity[:, None] @ values) * strains.weights[..., None, None]
    second = (stress_second_moments(cells, rows)[:, None] @ values[:, :, :6]) * strains.weights[..., None, None]
    m, p, s, d = strains.B.shape
    forces = strains.B.reshape(m, p * s, d).transpose(0, 2, 1) @ resultants.reshape(m, p * s, -1)
    resultants[:, :, 6:8] += _missing_shear(cells, rows, forces, resultants[:, :, 6:8], strains.weights)
    slices = cells.slices(rows)
    forces -= slice_forces(slices, loads)
    force, couples = slice_couples(slices, loads)
    couples = couples + force[..., :, None] * cells.mass_arms(rows)[:, None, None]
    fields = _fields(cells, rows) @ columns[:, None]  # (m, p, 15, n)
    theta = slices.motion[:, :, 3:] @ columns[:, None]
    K = _contracted(fields, _unit_work(), np.concatenate([resultants[:, :, :8], second], axis=2))
    K += _contracted(theta, _symmetric_units(), _symmetric_parts(-rotation_work(couples)))
    levers = cells.planes.levers[rows]
    if levers.any():
        turns = columns.reshape(len(dofs), -1, 6, Phi.shape[1])[:, :, 3:]
        at_corners = np.moveaxis(forces, 2, 0).reshape(loads.k, len(dofs), -1, 6)[..., :3, None]
        works = rotation_work(at_corners * levers[:, :, None])
        K += _contracted(turns, _symmetric_units(), _symmetric_parts(works))
    return K


def _missing_shear(cells: ShellCells, rows: slice, forces: Array, Q: Array, weights: Array) -> Array:
    """Return the weighted shear force, (m, p, 2, k), that must be added to Q for balance with the nodal forces.

    It is the gradient of Σ c_i N_i, where ∫ (Q + ∇ Σ c_j N_j)·∇N_i = f_z,i at every corner i. The constant part of c is
    arbitrary and set to zero.
    """
    planes = cells.planes[rows]
    n, c, k = len(planes.R), planes.xy.shape[1], forces.shape[2]
    shape = flat_shape(cells.kind, flat_quadrature(cells.kind, STRAIN_DEGREE[cells.kind])[0])
    J, det = jacobians(shape.gradients, planes.xy)
    dN = np.einsum("npak,pck->npca", inverse_2x2(J, det), shape.gradients)
    across = np.einsum("na,ncaj->ncj", planes.R[:, :, 2], forces.reshape(n, c, 6, k)[:, :, :3])
    missing = across - np.einsum("npca,npaj->ncj", dN, Q)
    laplacian = np.einsum("npca,npda,np->ncd", dN, dN, weights)
    # makes the matrix regular; the constant part of c remains zero
    laplacian += laplacian.trace(axis1=1, axis2=2)[:, None, None] / c
    gradient = np.einsum("npca,ncj->npaj", dN, np.linalg.solve(laplacian, missing))
    return np.asarray(weights[:, :, None, None] * gradient)


def _contracted(fields: Array, units: Array, weights: Array) -> Array:
    """Return Σ weights_r,j fieldsᵀ U_r fields over all points and unit works r, (k, n, n), for k states j.

    The products of the fields do not depend on the state. They are computed once, for some points at a time, and one
    matrix product with the weights of all states sums over the points.

    Parameters
    ----------
    fields
        Values of the fields, (n_cells, n_points, c, n).
    units
        Symmetric matrices U_r, (n_units, c, c).
    weights
        Weight of each point, unit work and state, (n_cells, n_points, n_units, k).
    """
    from fe_models.body.work_kernels import work_products

    n_units, c, _ = units.shape
    n, k = fields.shape[-1], weights.shape[-1]
    fields, weights = np.ascontiguousarray(fields).reshape(-1, c, n), weights.reshape(-1, n_units, k)
    unit, row, column = np.nonzero(np.triu(units))
    value = units[unit, row, column]
    at_once = max(1, int(PRODUCT_BYTES / (8 * n_units * n * (n + 1) / 2 + 1)))
    products = np.empty((min(at_once, len(fields)), n_units, n * (n + 1) // 2))
    pairs = np.zeros((k, n * (n + 1) // 2))
    for begin in range(0, len(fields), at_once):
        some = slice(begin, min(begin + at_once, len(fields)))
        out = products[: some.stop - begin]
        work_products(fields[some], unit, row, column, value, out)
        pairs += weights[some].reshape(-1, k).T @ out.reshape(-1, pairs.shape[1])
    K = np.empty((k, n, n))
    first, second = np.triu_indices(n)
    K[:, first, second] = pairs
    K[:, second, first] = pairs
    return K


def _symmetric_parts(W: Array) -> Array:
    """Return the components of symmetric matrices W, (k, n_cells, n_points, 3, 3), as weights of `_symmetric_units`."""
    return np.moveaxis(W[..., FIRST, SECOND], 0, -1)


@cache
def _symmetric_units() -> Array:
    """Return the six symmetric matrices with one unit component each, (6, 3, 3)."""
    units = np.zeros((6, 3, 3))
    units[np.arange(6), FIRST, SECOND] = units[np.arange(6), SECOND, FIRST] = 1.0
    return frozen(units)


def _fields(cells: ShellCells, rows: slice) -> Array:
    """Return gradients of u and theta, and theta, in local axes per unit nodal dof, (m, p, 15, 6 c)."""
    planes = cells.planes[rows]
    points, _ = flat_quadrature(cells.kind, STRAIN_DEGREE[cells.kind])
    shape = flat_shape(cells.kind, points)
    J, det = jacobians(shape.gradients, planes.xy)
    inverse = inverse_2x2(J, det)
    by_x = np.einsum("npak,pck->npac", inverse, shape.gradients)
    sides_by_x = np.einsum("npak,pck->npac", inverse, shape.side_gradients)
    n, p, c = len(planes.R), len(points), planes.xy.shape[1]
    out = np.zeros((n, p, 5, 3, c, 6))
    for a in range(2):
        out[:, :, a] = translations(planes, by_x[:, :, a], sides_by_x[:, :, a], shape, DRILLING_SHARE[cells.kind])
        for axis in range(3):
            out[:, :, 2 + a, axis, :, 3 + axis] = by_x[:, :, a]
    for axis in range(3):
        out[:, :, 4, axis, :, 3 + axis] = shape.values
    local = planes.R.transpose(0, 2, 1)[:, None, None] @ out.reshape(n, p, 5, 3, 6 * c)
    return np.asarray(local.reshape(n, p, N_FIELDS, 6 * c))


def stress_second_moments(cells: ShellCells, rows: slice) -> Array:
    """Return the matrix from eps and kappa to P = ∫ z² sigma dz, (m, 3, 6)."""
    return cells.by_law(lambda law: np.hstack([law.D, law.third]), rows)


@cache
def _unit_work() -> Array:
    """Return second derivatives of the work of unit N_x N_y N_xy, M_x M_y M_xy, Q_x Q_y, P (three), (11, 15, 15)."""
    W = np.zeros((11, 5, 3, 5, 3))
    across = np.array([[0.0, 1.0, 0.0], [-1.0, 0.0, 0.0], [0.0, 0.0, 0.0]])  # psi = across @ theta = theta × e_z
    for number, pairs in enumerate((((0, 0),), ((1, 1),), ((0, 1), (1, 0)))):
        N, M, of_fibres = W[number], W[3 + number], W[8 + number]
        for a, b in pairs:
            N[a, :, b, :] += np.eye(3) / 2
            of_fibres[2 + a, :, 2 + b, :] += across.T @ across / 2
            M[a, :, 2 + b, :] += across
            M[2 + a, b, 4, 2] += 1 / 2  # ½ (theta_b theta_z),a
            M[2 + a, 2, 4, b] += 1 / 2
    for a in range(2):
        W[6 + a, a, :, 4, :] += across
        W[6 + a, 4, a, 4, 2] += 1 / 2
    half = W.reshape(11, N_FIELDS, N_FIELDS)
    return frozen(half + half.transpose(0, 2, 1))
