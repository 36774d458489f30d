"""Articulated bodies: solution of M x = b for a tree with stored factors, linear in the number of bodies.

In ground axes, each node about its own origin, with S the motion for unit rates, and H = [[I, ..]] the matrix of a
flexible body (composite.py) built from articulated instead of composite bodies:

    (1) from the tips  U = I S, D = Sᵀ U; the parent gets I - U D⁻¹ Uᵀ, shifted; for a flexible body U = top of H T,
                       G = Tᵀ H T, T = [[S], [0, 1]] for the rates of the joint and the modes
    (2) solve          from the tips u = b - Sᵀ w (for modes also minus the wrenches of subtrees at their markers); the
                       parent gets w + U D⁻¹ u; from the base x = D⁻¹ (u - Uᵀ a); the children get a + S x

Forward dynamics uses b = forces - inverse dynamics without accelerations. Sources: Featherstone (2008), chapter 7;
Rodriguez, Jain & Kreutz-Delgado (1992) write the same as a factorisation of M.
"""

from floatframe.engine.kernels.compiler.compilation import loops, small
from floatframe.engine.kernels.dense import lu_factor, lu_solve, lu_solve_columns
from floatframe.engine.kernels.vector import (
    add,
    add_block,
    cross,
    dot,
    matrix,
    matrix_sum,
    product,
    put,
    put_block,
    put_matrix,
    put_sum,
    scaled,
    sub,
    transposed,
    turned,
    vector,
)
from floatframe.engine.tree.kernels.spatial import shifted_blocks
from floatframe.engine.tree.recursion.composite import (
    add_carried,
    along,
    along_rate,
    body_matrix,
    flexible_column,
    moments_in_ground,
    rigid_blocks,
)

__all__ = ["articulate", "solve_articulated", "solve_columns"]


@small
def outer(a, b):
    """Return a bᵀ."""
    return scaled(a[0], b), scaled(a[1], b), scaled(a[2], b)


@small
def less(A, B):
    """Return A - B."""
    return sub(A[0], B[0]), sub(A[1], B[1]), sub(A[2], B[2])


@small
def inverse(A):
    """Return the inverse and the determinant of a matrix."""
    x, y, z = cross(A[1], A[2]), cross(A[2], A[0]), cross(A[0], A[1])
    d = dot(A[0], x)
    f = 1.0 / d
    return transposed((scaled(f, x), scaled(f, y), scaled(f, z))), d


@loops
def one_rate(work, k, v, A, B, C):
    """Eliminate the single rate of a joint; return the remaining blocks and the inertia along the rate."""
    move, w = vector(work.S[v]), vector(work.S[v, 3:])
    f, t = add(turned(A, move), turned(B, w)), add(turned(transposed(B), move), turned(C, w))
    d = dot(move, f) + dot(w, t)
    inverse_d = 1.0 / d
    work.D[k, 0, 0] = inverse_d
    put(work.U[v], 0, f)
    put(work.U[v], 3, t)
    f_d, t_d = scaled(inverse_d, f), scaled(inverse_d, t)
    return less(A, outer(f_d, f)), less(B, outer(f_d, t)), less(C, outer(t_d, t)), d


@loops
def three_rates(work, k, v, A, B, C):
    """Eliminate the three rates of a joint; return the remaining blocks and the determinant of their inertia."""
    L = transposed((vector(work.S[v]), vector(work.S[v + 1]), vector(work.S[v + 2])))
    W = transposed((vector(work.S[v, 3:]), vector(work.S[v + 1, 3:]), vector(work.S[v + 2, 3:])))
    F = matrix_sum(product(A, L), product(B, W))
    T = matrix_sum(product(transposed(B), L), product(C, W))
    D, d = inverse(matrix_sum(product(transposed(L), F), product(transposed(W), T)))
    put_matrix(work.D[k], D)
    F_t, T_t = transposed(F), transposed(T)
    put_block(work.U, v, 0, F_t)
    put_block(work.U, v, 3, T_t)
    F_D, T_D = product(F, D), product(T, D)
    return less(A, product(F_D, F_t)), less(B, product(F_D, T_t)), less(C, product(T_D, T_t)), d


@loops
def flexible(nodes, work, k):
    """Eliminate rates and modes of a flexible body; return the remaining blocks and whether the matrix is regular."""
    v0, size, H = nodes.v0[k], nodes.n_z[k] + nodes.n_q[k], body_matrix(nodes, work, k)
    G = work.G[nodes.g0[k] : nodes.g0[k + 1]].reshape((size, size))
    for j in range(size):
        flexible_column(nodes, work, H, k, j)
        for i in range(size):
            G[i, j] = along_rate(nodes, work, k, i)
    pivot = work.pivot[v0 : v0 + size]  # the rates of the joint are followed by the modes
    fine = lu_factor(G, pivot)
    X = work.V[v0 : v0 + size]
    for i in range(size):
        for a in range(6):
            X[i, a] = work.U[v0 + i, a]
    lu_solve_columns(G, pivot, X)
    for a in range(6):
        for b in range(6):
            total = H[a, b]
            for i in range(size):
                total -= work.U[v0 + i, a] * X[i, b]
            H[a, b] = total
    return fine


@loops
def top_blocks(H):
    """Return the blocks of the first six rows and columns of a matrix H."""
    B = vector(H[0, 3:]), vector(H[1, 3:]), vector(H[2, 3:])
    return matrix(H), B, (vector(H[3, 3:]), vector(H[4, 3:]), vector(H[5, 3:]))


@loops
def articulate(nodes, work, model, marker_work):
    """Factorise M for nodes placed in the ground; return the node that has no inertia along its rates, or -1."""
    n_n = nodes.parent.shape[0]
    for k in range(n_n):
        moments_in_ground(nodes, work, model, marker_work, k)
        m, s, J = work.mass[k], vector(work.s[k]), matrix(work.J[k])
        A, B, C = rigid_blocks(m, s, J)
        put_matrix(work.I_ff[k], A)
        put_matrix(work.I_ft[k], B)
        put_matrix(work.I_tt[k], C)
    singular = -1
    for k in range(n_n - 1, -1, -1):
        A, B, C = matrix(work.I_ff[k]), matrix(work.I_ft[k]), matrix(work.I_tt[k])
        n, n_z, v0, above = nodes.n_q[k], nodes.n_z[k], nodes.v0[k], nodes.parent[k]
        d = 1.0
        if n > 0:
            if not flexible(nodes, work, k):
                d = 0.0
            A, B, C = top_blocks(body_matrix(nodes, work, k))
        elif n_z == 1:
            A, B, C, d = one_rate(work, k, v0, A, B, C)
        elif n_z == 3:
            A, B, C, d = three_rates(work, k, v0, A, B, C)
        if not abs(d) > 0.0:
            singular = k
        if above >= 0:
            p = sub(vector(work.r_G[k]), vector(work.r_G[above]))
            if nodes.n_q[above] > 0:
                H = body_matrix(nodes, work, above)
                add_carried(H, A, B, C, p, work.above[nodes.c0[k] : nodes.c0[k + 1]])
            else:
                A, B, C = shifted_blocks(A, B, C, p)
                add_block(work.I_ff[above], 0, 0, A)
                add_block(work.I_ft[above], 0, 0, B)
                add_block(work.I_tt[above], 0, 0, C)
    return singular


@loops
def local_solve(nodes, work, k, first, size):
    """Multiply the right side of node k's rates by D⁻¹, or by G⁻¹ for a flexible body."""
    b = work.right[first : first + size]
    if nodes.n_q[k] > 0:
        G = work.G[nodes.g0[k] : nodes.g0[k + 1]].reshape((size, size))
        lu_solve(G, work.pivot[first : first + size], b)
    elif size == 1:
        b[0] *= work.D[k, 0, 0]
    elif size == 3:
        put(b, 0, turned(work.D[k], vector(b)))


@loops
def solve_articulated(nodes, work):
    """Overwrite `right`, (n_v,), with M⁻¹ right."""
    n_n, b = nodes.parent.shape[0], work.right
    for k in range(n_n):
        for j in range(6):
            work.wrench[k, j] = 0.0
    for k in range(n_n - 1, -1, -1):
        first, size, above = nodes.v0[k], nodes.n_z[k] + nodes.n_q[k], nodes.parent[k]
        f, t = vector(work.wrench[k]), vector(work.wrench[k, 3:])
        for v in range(first, first + size):
            b[v] -= along(work.S[v], f, t)
        local_solve(nodes, work, k, first, size)
        if above >= 0:
            for v in range(first, first + size):
                f, t = add(f, scaled(b[v], vector(work.U[v]))), add(t, scaled(b[v], vector(work.U[v, 3:])))
            n, vq, c0 = nodes.n_q[above], nodes.vq[above], nodes.c0[k]
            if n > 0:
                for j in range(n):
                    b[vq + j] -= along(work.above[c0 + j], f, t)
            t = add(t, cross(sub(vector(work.r_G[k]), vector(work.r_G[above])), f))
            put_sum(work.wrench[above], 0, f)
            put_sum(work.wrench[above], 3, t)
    for k in range(n_n):
        first, size, above = nodes.v0[k], nodes.n_z[k] + nodes.n_q[k], nodes.parent[k]
        a, alpha = (0.0, 0.0, 0.0), (0.0, 0.0, 0.0)
        if above >= 0:
            a, alpha = vector(work.motion[above]), vector(work.motion[above, 3:])
            a = add(a, cross(alpha, sub(vector(work.r_G[k]), vector(work.r_G[above]))))
            n, vq, c0 = nodes.n_q[above], nodes.vq[above], nodes.c0[k]
            for j in range(n):
                x = b[vq + j]
                a = add(a, scaled(x, vector(work.above[c0 + j])))
                alpha = add(alpha, scaled(x, vector(work.above[c0 + j, 3:])))
            if nodes.n_q[k] > 0:
                for v in range(first, first + size):
                    b[v] -= along(work.V[v], a, alpha)
            elif size == 1:
                b[first] -= work.D[k, 0, 0] * along(work.U[first], a, alpha)
            elif size == 3:
                y = (
                    along(work.U[first], a, alpha),
                    along(work.U[first + 1], a, alpha),
                    along(work.U[first + 2], a, alpha),
                )
                put_sum(b, first, scaled(-1.0, turned(work.D[k], y)))
        for v in range(first, first + size):
            a = add(a, scaled(b[v], vector(work.S[v])))
            alpha = add(alpha, scaled(b[v], vector(work.S[v, 3:])))
        put(work.motion[k], 0, a)
        put(work.motion[k], 3, alpha)


@loops
def solve_columns(nodes, work, columns):
    """Overwrite each row of columns, (m, n_v), a right side, with its accelerations M⁻¹ right."""
    n = work.right.shape[0]
    for i in range(columns.shape[0]):
        for j in range(n):
            work.right[j] = columns[i, j]
        solve_articulated(nodes, work)
        for j in range(n):
            columns[i, j] = work.right[j]
