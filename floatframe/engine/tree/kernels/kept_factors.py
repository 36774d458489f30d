"""Newton's correction over the tree with body matrices that are reused in many steps (docs/relative.md §6).

This approximates `kernels.tree_factors` by symmetric matrices with six instead of eighteen columns. In body axes, the
own matrix H of a body, the weighted sum of mass, damping and stiffness, is constant except for the deformation. Its
symmetric part is therefore computed once and reused in many steps. The screws of modes at the joints and the poses of
bodies are renewed with the factors. Terms due to the rates and accelerations of the screws and to the rotation of
forces are omitted: they have the weights h and h², and can cost an iteration, but never accuracy. With X the motion of
a body, Y that of its carrier, u its joint columns, q its modes, S their screws at its far marker, S_c those at its near
marker for child c, all in its axes about its origin,

    (1)  X = Y + J u - S q: the matrix [A B; Bᵀ E] for (X, q) becomes [A B'; B'ᵀ E - SᵀB' - BᵀS], B' = B - A S, for
         (Y + J u, q)
    (2)  X_c = Ad_c (Y + J u + T q), T = S_c - S: each child adds P', P' T, TᵀP' T to its blocks, P' = Ad_cᵀ P_c Ad_c
    (3)  Cholesky's method eliminates q and u from the front of (q, u, Y), [E B'ᵀJ B'ᵀ; . JᵀA J JᵀA; . . A]; the
         remaining block of Y is P

Fronts are stored as upper halves. After factorisation their rows are those of the factor U, with inverse diagonals.
"""

import math

from floatframe.engine.kernels.body import newton_block
from floatframe.engine.kernels.compiler.compilation import inner, loops, matrix_loops, view
from floatframe.engine.kernels.dense import matrix_at
from floatframe.engine.kernels.evaluation import tangent_of_body
from floatframe.engine.kernels.vector import (
    add,
    congruent,
    cross,
    matrix,
    product,
    put,
    put_column,
    put_matrix,
    scaled,
    scaled_matrix,
    sub,
    transposed,
    turned,
    turned_back,
    unit_matrix,
    vector,
)
from floatframe.engine.tree.kernels.kinematics import column_screw
from floatframe.engine.tree.kernels.mode_screws import mode_screw
from floatframe.engine.tree.kernels.projection import subtract_slopes
from floatframe.engine.tree.kernels.spatial import put_blocks, shifted_blocks

__all__ = ["factorize_poses", "keep_bodies", "solve_kept"]


@inner
def keep_bodies(model, work, tree, weights):
    """Write the reused body matrices; call after `evaluate_tree`."""
    for i in range(tree.parent.shape[0]):
        turning = work.bodies.T_right[i]
        put_matrix(turning, scaled_matrix(0.0, unit_matrix()))
        H = newton_block(model, work, i)
        tangent_of_body(model, work, i, weights, H, turning)
        symmetrise(H)


@matrix_loops
def symmetrise(H):
    """Replace a matrix by its symmetric part."""
    for r in range(H.shape[0]):
        for k in range(r):
            mean = 0.5 * (H[r, k] + H[k, r])
            H[r, k] = mean
            H[k, r] = mean


@inner
def factorize_poses(model, work, tree, joints, tangent, c_d, c_k):
    """Factorise the reused body matrices at the poses of the iterate; return whether the matrix is regular."""
    for i in range(tree.parent.shape[0]):
        n, m = model.bodies.n_q[i], tree.far[i]
        H = newton_block(model, work, i)
        if n > 0:
            put_screws(model, work, m, n, tangent.S[i])
        F = front(tree, tangent, i)
        write_front(H, tangent.S[i], tangent.Z, F, n, tree.s0[i + 1] - tree.s0[i])
    for place in range(tree.order.shape[0] - 1, -1, -1):
        i = tree.order[place]
        n_l, n = tree.s0[i + 1] - tree.s0[i], model.bodies.n_q[i]
        F, J = front(tree, tangent, i), tangent.J[tree.s0[i] : tree.m0[i]]
        pose_columns(work, tree, joints, tangent, i)
        add_columns(F, J, n)
        subtract_slopes(model, work, tree, i, F, n - tree.s0[i], c_d, c_k)
        if not factorize_front(F, n_l):
            return False
        parent = tree.parent[i]
        if parent >= 0:
            relative_pose(work, tangent, i, parent)
            move_inwards(F, tangent.turn[i], tangent.shift[i], tangent.P)
            above, T = model.bodies.n_q[parent], tangent.T[i]
            if above > 0:
                put_screws(model, work, tree.near[i], above, T)
                take_away(T, tangent.S[parent], above)
            add_child(tangent.P, T, tangent.Z, front(tree, tangent, parent), above)
    return True


@view
def front(tree, tangent, i):
    """Return the frontal matrix of body i, (n_l + 6, n_l + 6)."""
    size = tree.s0[i + 1] - tree.s0[i] + 6
    return matrix_at(tangent.front, tree.front0[i], size, size)


@view
def right_side(tree, tangent, i):
    """Return z of body i, (n_l + 6,)."""
    return tangent.z[tree.s0[i] + 6 * i : tree.s0[i + 1] + 6 * i + 6]


@loops
def put_screws(model, work, m, n, S):
    """Write the screws at marker m of all modes of its body, (6, n), body axes."""
    if m < 0 or model.markers.psi0[m] < 0:
        S[:, :] = 0.0
        return
    for k in range(n):
        move, turn = mode_screw(model, work, m, model.markers.body[m], k)
        put_column(S, 0, k, move)
        put_column(S, 3, k, turn)


@loops
def take_away(T, S, n):
    """Subtract matrix S from matrix T in place."""
    for r in range(6):
        for k in range(n):
            T[r, k] -= S[r, k]


@matrix_loops
def write_front(H, S, Z, F, n, n_l):
    """Write the matrix of (1) into the front; the rows of the joint columns follow."""
    for r in range(6):
        for e in range(6):
            F[n_l + r, n_l + e] = H[r, e]
    for r in range(6):
        for k in range(n):
            Z[r, k] = H[r, 6 + k]
        for e in range(6):
            a = H[r, e]
            for k in range(n):
                Z[r, k] -= a * S[e, k]
    for k in range(n):
        for l in range(n):  # noqa: E741
            F[k, l] = H[6 + k, 6 + l]
        for e in range(6):
            s, b = S[e, k], H[e, 6 + k]
            F[k, n_l + e] = Z[e, k]
            for l in range(n):  # noqa: E741
                F[k, l] -= s * Z[e, l] + b * S[e, l]


@inner
def pose_columns(work, tree, joints, tangent, i):
    """Write the screws of body i for its joint columns, body axes about the body origin."""
    R, sense = work.state.R[i], -1.0 if tree.is_reversed[i] != 0 else 1.0
    for k in range(tree.column0[i], tree.column0[i + 1]):
        s = tree.unknown[k]
        if s >= 0:
            t, a = column_screw(work, tree, joints, i, k, vector(work.state.r[i]))
            put(tangent.J[s], 0, scaled(sense, turned_back(R, t)))
            put(tangent.J[s], 3, scaled(sense, turned_back(R, a)))


@matrix_loops
def add_columns(F, J, n):
    """Add the rows and columns of the joint to the front (3)."""
    n_u = J.shape[0]
    o = n + n_u
    for c in range(n_u):
        for r in range(6):
            total = 0.0
            for e in range(6):
                total += J[c, e] * F[o + e, o + r]
            F[n + c, o + r] = total
        for d in range(n_u):
            total = 0.0
            for r in range(6):
                total += F[n + c, o + r] * J[d, r]
            F[n + c, n + d] = total
        for k in range(n):
            total = 0.0
            for r in range(6):
                total += F[k, o + r] * J[c, r]
            F[k, n + c] = total


@matrix_loops
def factorize_front(F, n_l):
    """Eliminate the first n_l unknowns of a front; return whether all pivots are positive."""
    size = F.shape[0]
    for k in range(n_l):
        pivot = F[k, k]
        if not 0.0 < pivot < math.inf:
            return False
        inverse = 1.0 / math.sqrt(pivot)
        F[k, k] = inverse
        for j in range(k + 1, size):
            F[k, j] *= inverse
        for i in range(k + 1, size):
            factor = F[k, i]
            for j in range(i, size):
                F[i, j] -= factor * F[k, j]
    return True


@inner
def relative_pose(work, tangent, i, parent):
    """Write axes and origin of body i relative to its parent."""
    R = matrix(work.state.R[parent])
    put_matrix(tangent.turn[i], product(transposed(R), matrix(work.state.R[i])))
    put(tangent.shift[i], 0, turned_back(R, sub(vector(work.state.r[i]), vector(work.state.r[parent]))))


@loops
def upper_part(F, row, column):
    """Return a block of three rows from the upper half of a symmetric matrix."""
    if row == column:
        x, y, z = F[row, column + 1], F[row, column + 2], F[row + 1, column + 2]
        return (F[row, row], x, y), (x, F[row + 1, row + 1], z), (y, z, F[row + 2, row + 2])
    return vector(F[row, column:]), vector(F[row + 1, column:]), vector(F[row + 2, column:])


@loops
def move_inwards(F, turn, shift, P):
    """Write Adᵀ P Ad, the remainder of a front transformed to axes and origin of the parent."""
    o, R = F.shape[0] - 6, matrix(turn)
    A, B = congruent(R, upper_part(F, o, o)), congruent(R, upper_part(F, o, o + 3))
    A, B, C = shifted_blocks(A, B, congruent(R, upper_part(F, o + 3, o + 3)), vector(shift))
    put_blocks(P, A, B, C)


@matrix_loops
def add_child(P, T, Z, F, n):
    """Add the terms (2) of a child to the front of its parent."""
    o = F.shape[0] - 6
    for r in range(6):
        for e in range(6):
            F[o + r, o + e] += P[r, e]
    for r in range(6):
        for k in range(n):
            Z[r, k] = 0.0
        for e in range(6):
            p = P[r, e]
            for k in range(n):
                Z[r, k] += p * T[e, k]
    for k in range(n):
        for r in range(6):
            t = T[r, k]
            F[k, o + r] += Z[r, k]
            for l in range(n):  # noqa: E741
                F[k, l] += t * Z[r, l]


@loops
def solve_kept(model, tree, joints, tangent, c_k):
    """Write the corrections of the unknowns into tangent.step, and of bodies (body axes) into tangent.X.

    First, from the leaves inwards, compute minus the force of each subtree at rest, `b`, and the right sides
    z = U⁻ᵀ (q, u); then, outwards, Y, q, u and X.
    """
    x, b = tangent.step, tangent.b
    x[:] = 0.0
    b[:, :] = 0.0
    for place in range(tree.order.shape[0] - 1, -1, -1):
        i = tree.order[place]
        n_l, n, parent = tree.s0[i + 1] - tree.s0[i], model.bodies.n_q[i], tree.parent[i]
        z = right_side(tree, tangent, i)
        for k in range(n):  # x already contains the contributions of children
            z[k] = x[tree.m0[i] + k] - c_k * joints.residual[tree.m0[i] + k]
        for s in range(tree.s0[i], tree.m0[i]):
            total = -c_k * joints.residual[s]
            for r in range(6):
                total += tangent.J[s, r] * b[i, r]
            z[n + s - tree.s0[i]] = total
        for r in range(6):
            z[n_l + r] = b[i, r]
        reduce_right_side(front(tree, tangent, i), z, n_l)
        if parent >= 0:
            f = turned(tangent.turn[i], z[n_l:])
            m = add(turned(tangent.turn[i], z[n_l + 3 :]), cross(vector(tangent.shift[i]), f))
            add_force(tangent.T[i], b[parent], x[tree.m0[parent] :], f, m, model.bodies.n_q[parent])
    for place in range(tree.order.shape[0]):
        i = tree.order[place]
        n_l, n, parent = tree.s0[i + 1] - tree.s0[i], model.bodies.n_q[i], tree.parent[i]
        z = right_side(tree, tangent, i)
        Y, held = z[n_l:], tangent.Y[i]
        for r in range(6):
            Y[r] = 0.0
        if parent >= 0:
            hold(tangent.T[i], tangent.Y[parent], x[tree.m0[parent] :], Y, model.bodies.n_q[parent])
            turn = vector(Y[3:])
            put(Y, 0, turned_back(tangent.turn[i], add(vector(Y), cross(turn, vector(tangent.shift[i])))))
            put(Y, 3, turned_back(tangent.turn[i], turn))
        finish_solution(front(tree, tangent, i), z, n_l)
        for r in range(6):
            held[r] = Y[r]
        for s in range(tree.s0[i], tree.m0[i]):
            x[s] = z[n + s - tree.s0[i]]
            for r in range(6):
                held[r] += tangent.J[s, r] * x[s]
        for k in range(n):
            x[tree.m0[i] + k] = z[k]
        for r in range(6):
            total = held[r]
            for k in range(n):
                total -= tangent.S[i, r, k] * z[k]
            tangent.X[i, r] = total


@loops
def add_force(T, b, x, f, m, n):
    """Add the force f and moment m of a child to its parent's force and to the right sides of the parent's modes."""
    for a in range(3):
        b[a] += f[a]
        b[3 + a] += m[a]
    for k in range(n):
        x[k] += (T[0, k] * f[0] + T[1, k] * f[1] + T[2, k] * f[2]) + (T[3, k] * m[0] + T[4, k] * m[1] + T[5, k] * m[2])


@loops
def hold(T, above, q, Y, n):
    """Write the motion Y of a body's carrier: motion of the parent plus its modes."""
    for r in range(6):
        total = above[r]
        for k in range(n):
            total += T[r, k] * q[k]
        Y[r] = total


@matrix_loops
def reduce_right_side(F, z, n_l):
    """Forward substitution: overwrite (q, u) in z by U⁻ᵀ (q, u), and reduce the force on Y."""
    for k in range(n_l):
        y = z[k] * F[k, k]
        z[k] = y
        for j in range(k + 1, z.shape[0]):
            z[j] -= y * F[k, j]


@matrix_loops
def finish_solution(F, z, n_l):
    """Back substitution: overwrite (q, u) in z by the solution, with Y known."""
    for k in range(n_l - 1, -1, -1):
        total = z[k]
        for j in range(k + 1, z.shape[0]):
            total -= F[k, j] * z[j]
        z[k] = total * F[k, k]
