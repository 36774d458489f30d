"""Newton's correction over the tree with matrices of bodies that are kept over steps (docs/relative.md §5).

An approximation of `kernels.tree_factors`, six wide instead of eighteen: a body turns and moves as a whole, so that its
own matrix H, mass, damping and stiffness weighted, is constant in its axes but for its deformation; it is made once and
kept for many steps. The screws of modes at the joints and the poses of bodies are renewed with the factors. Left out
are the terms that come from the rates and accelerations of the screws and from the turning of forces: they are weighted
with h and h² and cost an iteration where they count, never accuracy. With X the motion of a body, Y that of what holds
it, u its columns, q its modes, S those of its far, S_c those of its near marker for child c, all in its axes about its
origin,

    X = Y + J u - S q             X_c = Ad_c (Y + J u + T_c q)         T_c = S_c - S
    [f, r_q] = [A B; C E] [X, q]  becomes by (Y + J u, q)  [A  B - A S; C - Sᵀ A  E - C S - Sᵀ B + Sᵀ A S]
    + P' [1 T_c], T_cᵀ P' [1 T_c],   P' = Ad_cᵀ P_c Ad_c, of each child, from the leaves inwards
    u, q = G Y + g,   f = P Y + p
"""

from floatframe.kernels.compiler.compilation import inner, loops, matrix_loops
from floatframe.kernels.dense import lu_factor, lu_solve, lu_solve_columns
from floatframe.kernels.evaluation import tangent_of_body
from floatframe.kernels.vector import (
    add,
    cross,
    matrix,
    matrix_sum,
    product,
    put,
    put_matrix,
    put_sum,
    scaled,
    scaled_matrix,
    sub,
    tilde,
    transposed,
    turned,
    turned_back,
    unit_matrix,
    vector,
)
from floatframe.relative.kernels.jets import mode_screw
from floatframe.relative.kernels.projection import force_slopes

__all__ = ["factorize_poses", "keep_bodies", "solve_kept"]


@inner
def keep_bodies(model, work, tree, c_m, c_d, c_k):
    """Write the matrices of bodies that are kept; `evaluate_tree` has been called."""
    for i in range(tree.parent.shape[0]):
        n = model.bodies.n_q[i]
        turning = work.bodies.T_right[i]
        put_matrix(turning, scaled_matrix(0.0, unit_matrix()))
        H = work.solver.H[model.bodies.h0[i] : model.bodies.h0[i + 1]].reshape((6 + n, 6 + n))
        tangent_of_body(model, work, i, c_m, c_d, c_k, H, turning)


@inner
def take_bodies(model, work, tree, tangent):
    """Write the matrices of bodies by the motion of what holds them, and the screws of modes between both ends."""
    for i in range(tree.parent.shape[0]):
        n = model.bodies.n_q[i]
        H = work.solver.H[model.bodies.h0[i] : model.bodies.h0[i + 1]].reshape((6 + n, 6 + n))
        N = tangent.N[model.bodies.h0[i] : model.bodies.h0[i + 1]].reshape((6 + n, 6 + n))
        take_over(H, N)
        m = tree.far[i]
        if n > 0:
            put_screws(model, work, m, i, tangent.S[i])
            if m >= 0 and model.markers.psi0[m] >= 0:
                move_frame(N, tangent.S[i], n)
    for i in range(tree.parent.shape[0]):
        parent = tree.parent[i]
        if parent >= 0 and model.bodies.n_q[parent] > 0:
            T = tangent.T[i]
            put_screws(model, work, tree.near[i], parent, T)
            for k in range(model.bodies.n_q[parent]):
                for r in range(6):
                    T[k, r] -= tangent.S[parent, k, r]


@inner
def put_screws(model, work, m, i, S):
    """Write the screws of all modes of body i at its marker m, body axes about its origin."""
    for k in range(model.bodies.n_q[i]):
        if m >= 0 and model.markers.psi0[m] >= 0:
            d, b = mode_screw(model, work, m, i, k)
            put(S[k], 0, d)
            put(S[k], 3, b)
        else:
            put(S[k], 0, (0.0, 0.0, 0.0))
            put(S[k], 3, (0.0, 0.0, 0.0))


@matrix_loops
def move_frame(H, S, n):
    """Express H by the motion of what holds the far marker: B - A S, C - Sᵀ A, E - C S - Sᵀ (B - A S)."""
    for k in range(n):
        for r in range(6):
            total = 0.0
            for e in range(6):
                total += H[r, e] * S[k, e]
            H[r, 6 + k] -= total
    for l in range(n):  # noqa: E741
        for k in range(n):
            total = 0.0
            for e in range(6):
                total += H[6 + l, e] * S[k, e] + S[l, e] * H[e, 6 + k]
            H[6 + l, 6 + k] -= total
    for k in range(n):
        for e in range(6):
            total = 0.0
            for r in range(6):
                total += S[k, r] * H[r, e]
            H[6 + k, e] -= total


@inner
def factorize_poses(model, work, tree, joints, tangent, c_d, c_k):
    """Factorise with the kept matrices at the poses of the iterate; whether all unknowns have their equation."""
    take_bodies(model, work, tree, tangent)
    for place in range(tree.order.shape[0] - 1, -1, -1):
        i = tree.order[place]
        pose_columns(model, work, tree, joints, tangent, i)
        if not eliminate(model, work, tree, tangent, i, c_d, c_k):
            return False
        parent = tree.parent[i]
        if parent >= 0:
            relative_pose(work, tangent, i, parent)
            move_inwards(tangent, i)
            n = model.bodies.n_q[parent]
            N = tangent.N[model.bodies.h0[parent] : model.bodies.h0[parent + 1]].reshape((6 + n, 6 + n))
            add_child(tangent.P[i], tangent.T[i], tangent.Z, N, n)
    return True


@matrix_loops
def take_over(H, N):
    """Copy a matrix."""
    for r in range(H.shape[0]):
        for k in range(H.shape[0]):
            N[r, k] = H[r, k]


@inner
def pose_columns(model, work, tree, joints, tangent, i):
    """Write by which screws the columns of the joint of body i move it, body axes about its origin."""
    near, far = tree.near[i], tree.far[i]
    R, origin = work.state.R[i], vector(work.state.r[i])
    at_near, at_far = (0.0, 0.0, 0.0), origin
    if near >= 0:
        at_near = vector(work.markers.r[near])
    if far >= 0:
        at_far = vector(work.markers.r[far])
    sense = -1.0 if tree.is_reversed[i] != 0 else 1.0
    for k in range(tree.column0[i], tree.column0[i + 1]):
        s = tree.unknown[k]
        if s < 0:
            continue
        is_far = tree.side[k] != tree.is_reversed[i]
        point = at_far if is_far else at_near
        a = scaled(sense, vector(joints.a[k]))
        t = cross(a, sub(origin, point))
        if tree.side[k] == 0:
            t = add(t, scaled(sense, vector(joints.t[k])))
        put(tangent.J[s], 0, turned_back(R, t))
        put(tangent.J[s], 3, turned_back(R, a))


@inner
def eliminate(model, work, tree, tangent, i, c_d, c_k):
    """Eliminate the unknowns of body i: factors in L, G, W, what is left in P. Whether L could be factorised."""
    s0, n_l, n = tree.s0[i], tree.s0[i + 1] - tree.s0[i], model.bodies.n_q[i]
    n_u = n_l - n
    N = tangent.N[model.bodies.h0[i] : model.bodies.h0[i + 1]].reshape((6 + n, 6 + n))
    L = tangent.L[tree.l0[i] : tree.l0[i + 1]].reshape((n_l, n_l))
    G, W = tangent.U[s0 : s0 + n_l], tangent.W[s0 : s0 + n_l]
    local_matrix(N, tangent.J[s0 : s0 + n_l], L, G, W, tangent.P[i], n_u, n)
    for k in range(tree.column0[i], tree.column0[i + 1]):
        s = tree.unknown[k]
        if s >= 0 and tree.row[k] >= 0:
            _, Q_x, Q_v = force_slopes(model, work, tree, i, tree.row[k])
            L[s - s0, s - s0] -= c_k * Q_x + c_d * Q_v
    if n_l > 0:
        if not lu_factor(L, tangent.L_pivot[s0 : s0 + n_l]):
            return False
        lu_solve_columns(L, tangent.L_pivot[s0 : s0 + n_l], G)
        add_eliminated(W, G, tangent.P[i], n_l)
    return True


@matrix_loops
def local_matrix(N, J, L, G, W, P, n_u, n):
    """Write the equations of columns and modes by themselves, L, by minus Y, G, forces by them, W, and by Y, P."""
    for r in range(6):
        for e in range(6):
            P[r, e] = N[r, e]
    for k in range(n_u):
        for r in range(6):
            total, other = 0.0, 0.0
            for e in range(6):
                total += N[r, e] * J[k, e]
                other += J[k, e] * N[e, r]
            W[k, r] = total
            G[k, r] = -other
    for k in range(n):
        for r in range(6):
            W[n_u + k, r] = N[r, 6 + k]
            G[n_u + k, r] = -N[6 + k, r]
        for l in range(n):  # noqa: E741
            L[n_u + k, n_u + l] = N[6 + k, 6 + l]
    for k in range(n_u):
        for l in range(n_u + n):  # noqa: E741
            total = 0.0
            for r in range(6):
                total += J[k, r] * W[l, r]
            L[k, l] = total
        for l in range(n):  # noqa: E741
            total = 0.0
            for r in range(6):
                total -= G[n_u + l, r] * J[k, r]
            L[n_u + l, k] = total


@matrix_loops
def add_eliminated(W, G, P, n_l):
    """P += W G."""
    for k in range(n_l):
        for r in range(6):
            w = W[k, r]
            for e in range(6):
                P[r, e] += w * G[k, e]


@inner
def relative_pose(work, tangent, i, parent):
    """Write axes and origin of body i in those of its parent."""
    R = matrix(work.state.R[parent])
    put_matrix(tangent.turn[i], product(transposed(R), matrix(work.state.R[i])))
    put(tangent.shift[i], 0, turned_back(R, sub(vector(work.state.r[i]), vector(work.state.r[parent]))))


@inner
def part(P, row, column):
    """Return a block of a matrix."""
    return vector(P[row, column:]), vector(P[row + 1, column:]), vector(P[row + 2, column:])


@inner
def put_part(P, row, column, A):
    """Write a block of a matrix."""
    put(P[row], column, A[0])
    put(P[row + 1], column, A[1])
    put(P[row + 2], column, A[2])


@inner
def move_inwards(tangent, i):
    """Overwrite P of body i by Adᵀ P Ad, in axes and about the origin of its parent."""
    P, R = tangent.P[i], matrix(tangent.turn[i])
    back, arm = transposed(R), tilde(vector(tangent.shift[i]))
    minus = scaled_matrix(-1.0, arm)
    vv, vw = product(product(R, part(P, 0, 0)), back), product(product(R, part(P, 0, 3)), back)
    wv, ww = product(product(R, part(P, 3, 0)), back), product(product(R, part(P, 3, 3)), back)
    ww = matrix_sum(ww, matrix_sum(product(arm, vw), product(matrix_sum(wv, product(arm, vv)), minus)))
    put_part(P, 0, 0, vv)
    put_part(P, 0, 3, matrix_sum(vw, product(vv, minus)))
    put_part(P, 3, 0, matrix_sum(wv, product(arm, vv)))
    put_part(P, 3, 3, ww)


@matrix_loops
def add_child(P, T, Z, N, n):
    """Add P [1 T], Tᵀ P [1 T] of a child to the matrix of its parent; T as rows, (n, 6)."""
    for r in range(6):
        for e in range(6):
            N[r, e] += P[r, e]
    for k in range(n):
        for r in range(6):
            total, other = 0.0, 0.0
            for e in range(6):
                total += P[r, e] * T[k, e]
                other += P[e, r] * T[k, e]
            Z[r, k] = total
            N[r, 6 + k] += total
            N[6 + k, r] += other
    for k in range(n):
        for r in range(6):
            t = T[k, r]
            for l in range(n):  # noqa: E741
                N[6 + k, 6 + l] += t * Z[r, l]


@loops
def solve_kept(model, tree, joints, tangent, c_k):
    """Write the corrections of the unknowns into tangent.step."""
    x, b, Y = tangent.step, tangent.b, tangent.Y
    for s in range(x.shape[0]):
        x[s] = -c_k * joints.residual[s]
    for i in range(b.shape[0]):
        for r in range(6):
            b[i, r] = 0.0
    for place in range(tree.order.shape[0] - 1, -1, -1):
        i = tree.order[place]
        s0, n_l, m0, parent = tree.s0[i], tree.s0[i + 1] - tree.s0[i], tree.m0[i], tree.parent[i]
        for s in range(s0, m0):
            for r in range(6):
                x[s] -= tangent.J[s, r] * b[i, r]
        if n_l > 0:
            L = tangent.L[tree.l0[i] : tree.l0[i + 1]].reshape((n_l, n_l))
            lu_solve(L, tangent.L_pivot[s0 : s0 + n_l], x[s0 : s0 + n_l])
        for s in range(s0, s0 + n_l):
            for r in range(6):
                b[i, r] += tangent.W[s, r] * x[s]
        if parent >= 0:
            f = turned(tangent.turn[i], b[i])
            m = add(turned(tangent.turn[i], b[i, 3:]), cross(vector(tangent.shift[i]), f))
            put_sum(b[parent], 0, f)
            put_sum(b[parent], 3, m)
            T, first = tangent.T[i], tree.m0[parent]
            for k in range(model.bodies.n_q[parent]):
                x[first + k] -= T[k, 0] * f[0] + T[k, 1] * f[1] + T[k, 2] * f[2]
                x[first + k] -= T[k, 3] * m[0] + T[k, 4] * m[1] + T[k, 5] * m[2]
    for place in range(tree.order.shape[0]):
        i = tree.order[place]
        parent = tree.parent[i]
        for r in range(6):
            Y[r] = tangent.X[parent, r] if parent >= 0 else 0.0
        if parent >= 0:
            T, first = tangent.T[i], tree.m0[parent]
            for k in range(model.bodies.n_q[parent]):
                for r in range(6):
                    Y[r] += T[k, r] * x[first + k]
            turn = vector(Y[3:])
            put(Y, 0, turned_back(tangent.turn[i], add(vector(Y), cross(turn, vector(tangent.shift[i])))))
            put(Y, 3, turned_back(tangent.turn[i], turn))
        for s in range(tree.s0[i], tree.s0[i + 1]):
            for r in range(6):
                x[s] += tangent.U[s, r] * Y[r]
        for s in range(tree.s0[i], tree.m0[i]):
            for r in range(6):
                Y[r] += tangent.J[s, r] * x[s]
        for r in range(6):
            tangent.X[i, r] = Y[r]
