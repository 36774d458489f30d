"""The linearised equations at one iterate and their solution, for computations outside the time loop."""

import math
from dataclasses import dataclass
from typing import Any

import numpy as np
import scipy.sparse as sp
from scipy.linalg.lapack import dgetrf, dgetrs
from scipy.sparse.linalg import SuperLU, splu

from fe_models.foundation.arrays import Array, IntArray
from floatframe.engine.kernels.model import MASS, STIFFNESS, Model
from floatframe.engine.kernels.work import Work, vectors_of_end
from floatframe.model.rotations import (
    euler_parameter_product,
    euler_parameters_of_rotation_vector,
    rotation_matrix,
)
from floatframe.model.state import State

__all__ = [
    "Linearized",
    "NewtonFactors",
    "balanced_scales",
    "by_velocities",
    "displaced",
    "highest_frequency",
    "in_body_axes",
    "in_ground_axes",
    "linearized",
    "modal_diagonals",
    "modal_matrix",
    "modal_weight",
    "set_iterate",
    "solve",
    "with_mass_for_all",
    "with_modal_weight",
]

DENSE = 150  #: number of equations up to which a dense factorisation is faster than a sparse one
STIFF = 1e3  #: factor by which the scaled stiffness in W exceeds the mass for the softest mode
STIFF_START = 1e6  #: the same factor for closing a placement, where stiff modes must hardly deform
#: factor of D in the sum of K and D from which D is extracted, so that its terms are far above the roundoff of K
FAST = 2.0**40
MASSLESS = 10.0  #: frequency of the artificial mass of a massless mode, relative to the highest frequency


@dataclass(frozen=True, eq=False)
class Linearized:
    """Matrices of the system at an iterate, unknowns in body axes (dx, dtheta, dq)."""

    H: tuple[Array, ...]  #: tangent matrix of each body, (6 + n, 6 + n)
    J: sp.csr_array  #: transposed map from wrenches to body forces: forces = J.T @ w, (n_w, n_u)
    #: derivatives of rows by body unknowns, including accelerations if a row depends on them, (n_w, n_u)
    G: sp.csr_array
    V: sp.csr_array  #: derivatives of rows by wrenches, (n_w, n_w)


def set_iterate(
    work: Work, state: State, u_dot: Array | None = None, w: Array | None = None, *, R: Array | None = None
) -> None:
    """Write a state into the working arrays; missing accelerations and wrenches are zero; R is used if it is known."""
    work.state.r[:] = state.r
    work.state.R[:] = rotation_matrix(state.p) if R is None else R
    work.state.q[:] = state.q
    work.state.u[:] = state.u
    work.state.u_dot[:] = 0.0 if u_dot is None else u_dot
    work.state.w[:] = 0.0 if w is None else w
    work.state.theta[:] = 0.0
    work.state.spins[:] = 0


def linearized(model: Model, work: Work, c_m: float, c_d: float, c_k: float) -> Linearized:
    """Evaluate at the iterate in `work` and return copies of all matrices."""
    from floatframe.engine.kernels.entry import evaluate_and_linearize

    evaluate_and_linearize(model, work, c_m, c_d, c_k)
    bodies, markers, connections = model.bodies, model.markers, model.connections
    # lists of Python numbers: one read of an array entry takes as long as ten of a list
    n_of, h0, u0_of = [6 + n for n in bodies.n_q.tolist()], bodies.h0.tolist(), bodies.u0.tolist()
    sizes, w0_of = connections.size.tolist(), connections.w0.tolist()
    H = [work.solver.H[h0[i] : h0[i + 1]].reshape(n, n).copy() for i, n in enumerate(n_of)]
    n_w, n_u = len(work.state.w), len(work.state.u)
    J_parts: list[tuple[Array, int, int]] = []
    G_parts: list[tuple[Array, int, int]] = []
    ends = bodies.ends
    of_end = (markers.body, markers.connection, markers.x0, markers.force, markers.moment, markers.accelerated)
    for m, i, c, o, force, moment, accelerated in zip(
        ends.tolist(), *(each[ends].tolist() for each in of_end), strict=True
    ):
        n, size = n_of[i], sizes[c]
        R = work.state.R[i]  # rotates each three rows of the following columns
        column = vectors_of_end(work.solver.J_column, 2, o, n)
        row = vectors_of_end(work.solver.J_row, 4, o, n)
        w0, u0 = w0_of[c], u0_of[i]
        carried = markers.sign[m] * (R @ column).reshape(6, n)
        for part, place in ((0, force), (3, moment)):
            if place >= 0:
                J_parts.append((carried[part : part + 3], w0 + place, u0))
        G_parts.append((work.connections.P[m, :size] @ (R @ row).reshape(12, n), w0, u0))
        if accelerated >= 0:
            row_a = vectors_of_end(work.solver.J_a, 2, int(markers.a0[m]), n)
            G_parts.append((work.connections.P_a[accelerated, :size] @ (R @ row_a).reshape(6, n), w0, u0))
    places = enumerate(zip(sizes, w0_of, strict=False))
    V = summed([(work.connections.V[c, :size, :size], w0, w0) for c, (size, w0) in places], (n_w, n_w))
    V.eliminate_zeros()
    return Linearized(tuple(H), summed(J_parts, (n_w, n_u)), summed(G_parts, (n_w, n_u)), V)


def by_velocities(model: Model, work: Work, by_positions: Linearized) -> tuple[tuple[Array, ...], sp.csr_array]:
    """Return the derivatives by velocities of body forces, (6 + n, 6 + n) each, and of rows, (n_w, n_u).

    by_positions: derivatives by positions at the same iterate.
    """
    both = linearized(model, work, 0.0, FAST, 1.0)
    D = tuple((A - B) / FAST for A, B in zip(both.H, by_positions.H, strict=True))
    return D, sp.csr_array((both.G - by_positions.G) / FAST)


def summed(parts: list[tuple[Array, int, int]], shape: tuple[int, int]) -> sp.csr_array:
    """Return the sparse sum of dense blocks, each given with its first row and column."""
    if not parts:
        return sp.csr_array(shape)
    if max(shape) > DENSE:
        values, rows, columns = entries(parts)
        return sp.csr_array(sp.coo_array((values, (rows, columns)), shape=shape))
    total = np.zeros(shape)
    for block, row, column in parts:
        total[row : row + block.shape[0], column : column + block.shape[1]] += block
    rows, columns = np.nonzero(total)
    return sp.csr_array((total[rows, columns], columns, np.searchsorted(rows, np.arange(shape[0] + 1))), shape=shape)


def entries(parts: list[tuple[Array, int, int]]) -> tuple[Array, IntArray, IntArray]:
    """Return values, rows and columns of the entries of dense blocks, each given with its first row and column."""
    rows = [np.repeat(np.arange(first, first + len(block)), block.shape[1]) for block, first, _ in parts]
    columns = [np.tile(np.arange(first, first + block.shape[1]), len(block)) for block, _, first in parts]
    values = [block.ravel() for block, _, _ in parts]
    return np.concatenate(values), np.concatenate(rows), np.concatenate(columns)


class NewtonFactors:
    """Factors of the coupled equations H y - Jᵀ w = forces, G y + V w = rows.

    The equations are scaled by `balanced_scales`; otherwise the choice of pivots would depend on units and system size.
    """

    def __init__(self, H: tuple[Array, ...], parts: Linearized) -> None:
        """Factorise the matrix, as a dense one if it is small; RuntimeError if it is exactly singular.

        A zero pivot of the dense matrix may be due to roundoff of terms of very different size. The order of sparse
        elimination keeps such terms apart.
        """
        first = np.cumsum([0, *(len(block) for block in H)]).tolist()
        J, G, V = parts.J, parts.G, parts.V
        self.n_u, n_w = first[-1], G.shape[0]
        n = self.n_u + n_w
        values, row, column = entries([(block, k, k) for block, k in zip(H, first, strict=False)])
        is_there = values != 0
        J_row, G_row, V_row = (np.repeat(np.arange(n_w), np.diff(A.indptr)) for A in (J, G, V))
        values = np.concatenate([values[is_there], -J.data, G.data, V.data])
        row = np.concatenate([row[is_there], J.indices, self.n_u + G_row, self.n_u + V_row])
        column = np.concatenate([column[is_there], self.n_u + J_row, G.indices, self.n_u + V.indices])
        diagonal = np.concatenate([np.diag(block) for block in H]) if H else np.zeros(0)
        self.sparse: SuperLU | None = None
        if n <= DENSE:
            matrix = np.zeros((n, n))
            matrix[row, column] = values
            size, y, w = np.abs(matrix), slice(self.n_u), slice(self.n_u, n)
            self.of_columns, self.of_rows = balanced_scales(diagonal, size[y, w].T, size[w, y], size[w, w])
            *self.dense, info = dgetrf(self.of_rows[:, None] * matrix * self.of_columns, overwrite_a=True)
            if info == 0:
                return
        else:
            self.of_columns, self.of_rows = balanced_scales(diagonal, abs(J), abs(G), abs(V))
        values = self.of_rows[row] * values * self.of_columns[column]
        self.sparse = splu(sp.csc_array((values, (row, column)), shape=(n, n)))

    def solve(self, forces: Array, rows: Array) -> tuple[Array, Array]:
        """Return the solution y, (n_u,), and w, (n_w,), for right sides `forces` and `rows`."""
        right = self.of_rows * np.concatenate([forces, rows])
        found = dgetrs(*self.dense, right)[0] if self.sparse is None else self.sparse.solve(right)
        solution = self.of_columns * found
        return solution[: self.n_u], solution[self.n_u :]


def solve(H: tuple[Array, ...], parts: Linearized, forces: Array, rows: Array) -> tuple[Array, Array]:
    """Solve H y - Jᵀ w = forces, G y + V w = rows; return y, (n_u,), and w, (n_w,)."""
    return NewtonFactors(H, parts).solve(forces, rows)


def balanced_scales(diagonal: Array, J: Any, G: Any, V: Any) -> tuple[Array, Array]:
    """Return scale factors of unknowns (y, w) and equations that bring stiffnesses and rows to size one.

    The stiffness of an unknown y is the absolute value of its diagonal entry in H plus the stiffness of the springs,
    J G/V by their rows V w = -G y, unless that is roundoff. Without the springs, bodies that are supported only by
    springs would be scaled by the roundoff in H.

    Parameters
    ----------
    diagonal
        Diagonal of H, (n_u,).
    J, G, V
        Magnitudes of the other matrices, dense or sparse, (n_w, n_u) and (n_w, n_w).
    """
    by_law = V.diagonal()
    springs = (1 / np.where(by_law > 0, by_law, np.inf)) @ (J * G)
    noise = np.finfo(float).eps * max(springs.max(initial=0.0), np.abs(diagonal).max(initial=0.0))
    stiffness = np.abs(diagonal) + np.where(springs > noise, springs, 0.0)
    of_y = 1 / np.sqrt(np.where(stiffness > 0, stiffness, 1.0))
    of_w = J @ of_y
    of_w = 1 / np.where(of_w > 0, of_w, 1.0)
    of_rows = G @ of_y + V @ of_w
    return np.concatenate([of_y, of_w]), np.concatenate([of_y, 1 / np.where(of_rows > 0, of_rows, 1.0)])


def modal_diagonals(model: Model, i: int, which: int) -> Array:
    """Return the diagonal of M*, K* or D* of a body, (n_q,)."""
    return np.diagonal(modal_matrix(model, i, which))


def modal_matrix(model: Model, i: int, which: int) -> Array:
    """Return the modal matrix M*, K* or D* of a body, (n_q, n_q)."""
    n = int(model.bodies.n_q[i])
    if model.body_types.is_diagonal[model.bodies.kind[i], which - MASS]:
        return np.diag(stored_array(model, i, which, n))
    return stored_array(model, i, which, n, n)


def stored_array(model: Model, i: int, which: int, *shape: int) -> Array:
    """Return one of the constant arrays of a body, which has this shape."""
    start = int(model.body_types.block0[model.bodies.kind[i], which])
    return model.body_types.blocks[start : start + math.prod(shape)].reshape(shape)


def highest_frequency(model: Model) -> float:
    """Return the largest sqrt(K_kk/M_kk) of all modes with mass [rad/s]; 0 if there are no modes."""
    highest = 0.0
    for i in range(len(model.bodies.kind)):
        M, K = modal_diagonals(model, i, MASS), modal_diagonals(model, i, STIFFNESS)
        with_mass = M > 0
        if with_mass.any():
            highest = max(highest, float(np.sqrt(np.max(np.maximum(K[with_mass], 0) / M[with_mass]))))
    return highest


def modal_weight(model: Model, i: int, stiff: float = STIFF) -> float:
    """Return the factor by which modal stiffness is `stiff` times the modal mass for the softest mode of a body."""
    M, K = modal_diagonals(model, i, MASS), modal_diagonals(model, i, STIFFNESS)
    elastic = (M > 0) & (K > 0)
    softest = np.min(K[elastic] / M[elastic]) if elastic.any() else (K.max() if K.size and K.max() > 0 else 1.0)
    return float(stiff / softest)


def with_modal_weight(model: Model, H: tuple[Array, ...], stiff: float = STIFF) -> tuple[Array, ...]:
    """Return mass matrices plus scaled modal stiffness, the weight matrix W of `initial`."""
    weighted = []
    for i, block in enumerate(H):
        block = block.copy()
        block[6:, 6:] += modal_weight(model, i, stiff) * modal_matrix(model, i, STIFFNESS)
        weighted.append(block)
    return tuple(weighted)


def with_mass_for_all(model: Model, H: tuple[Array, ...]) -> tuple[Array, ...]:
    """Return mass matrices in which massless modes get a small mass, so that accelerations exist."""
    massless = [modal_diagonals(model, i, MASS) <= 0 for i in range(len(H))]
    if not any(modes.any() for modes in massless):
        return H
    omega, complete = MASSLESS * highest_frequency(model), []
    for i, (block, modes) in enumerate(zip(H, massless, strict=True)):
        if modes.any():
            K = modal_diagonals(model, i, STIFFNESS)
            scale = omega**2 if omega > 0 else max(float(K.max()), 1.0)
            block = block + np.diag(np.concatenate([np.zeros(6), np.where(modes, np.maximum(K, 0) / scale, 0.0)]))
        complete.append(block)
    return tuple(complete)


def displaced(model: Model, state: State, x: Array) -> State:
    """Return the state displaced by x = (dr in ground axes, rotation vector in body axes, dq) of each body, (n_u,)."""
    r, p, q = state.r.copy(), state.p.copy(), state.q.copy()
    for i in range(len(model.bodies.kind)):
        u0, u1 = model.bodies.u0[i], model.bodies.u0[i + 1]
        r[i] += x[u0 : u0 + 3]
        turned = euler_parameter_product(p[i], euler_parameters_of_rotation_vector(x[u0 + 3 : u0 + 6]))
        p[i] = turned / np.linalg.norm(turned)
        q[model.bodies.q0[i] : model.bodies.q0[i + 1]] += x[u0 + 6 : u1]
    return State(r, p, q, state.u)


def in_ground_axes(model: Model, state: State, y: Array) -> Array:
    """Return body unknowns with the translations rotated from body axes to ground axes, (n_u,)."""
    x = y.copy()
    for i, p in enumerate(state.p):
        u0 = model.bodies.u0[i]
        x[u0 : u0 + 3] = rotation_matrix(p) @ y[u0 : u0 + 3]
    return x


def in_body_axes(model: Model, state: State, x: Array) -> Array:
    """Return body unknowns with the translations rotated from ground axes to body axes, (n_u,)."""
    y = x.copy()
    for i, p in enumerate(state.p):
        u0 = model.bodies.u0[i]
        y[u0 : u0 + 3] = x[u0 : u0 + 3] @ rotation_matrix(p)
    return y
