"""Newton correction of the whole system: bodies eliminated one by one, connections in a small block-sparse system.

    H_i y_i - Σ_ends sign J_columnᵀ R_iᵀ mu = -c_k residual_i                                    (each body)
    Σ_ends P R_i J_row y + V mu             = -g                                                 (each connection)

With z = H⁻¹(-c_k residual), X = H⁻¹ J_columnᵀ and Z = J_row X the connections have the matrix V + P R Z Rᵀ sign. H, X
and Z do not turn with the body, so that they can serve for many steps; P, R and V are those of the iterate.
"""

from floatframe.kernels.compiler.compilation import inner
from floatframe.kernels.connections.connection import connection_derivatives
from floatframe.kernels.dense import lu_factor, lu_solve, lu_solve_columns
from floatframe.kernels.evaluation import linearize

__all__ = ["correction", "factorize_bodies"]


@inner
def factorize_bodies(model, work, c_m, c_d, c_k):
    """Linearise at the iterate, factorise H and write X, Z. Return the body whose H is singular, or -1."""
    linearize(model, work, c_m, c_d, c_k)
    work.counts[1] += 1
    for i in range(model.kind.shape[0]):
        n = 6 + model.n_q[i]
        H = work.H[model.h0[i] : model.h0[i + 1]].reshape((n, n))
        if not lu_factor(H, work.pivot[model.u0[i] : model.u0[i + 1]]):
            return i
        for e in range(model.end0[i], model.end0[i + 1]):
            o = model.m_x0[model.ends[e]]
            column = work.J_column[6 * o : 6 * (o + n)].reshape((6, n))
            X = work.X[6 * o : 6 * (o + n)].reshape((n, 6))
            for r in range(n):
                for k in range(6):
                    X[r, k] = column[k, r]
            lu_solve_columns(H, work.pivot[model.u0[i] : model.u0[i + 1]], X)
    for p in range(model.pair_row.shape[0]):
        row_marker, column_marker = model.pair_row[p], model.pair_column[p]
        n = 6 + model.n_q[model.m_body[row_marker]]
        o = model.m_x0[row_marker]
        row = work.J_row[12 * o : 12 * (o + n)].reshape((12, n))
        o = model.m_x0[column_marker]
        X = work.X[6 * o : 6 * (o + n)].reshape((n, 6))
        Z = work.Z[p]
        for r in range(12):
            for k in range(6):
                total = 0.0
                for j in range(n):
                    total += row[r, j] * X[j, k]
                Z[r, k] = total
    return -1


@inner
def assemble(model, work, c_k):
    """Write the block matrix of the connections at the iterate."""
    s = work.s
    for k in range(s.shape[0]):
        s[k] = 0.0
    for c in range(model.c_size.shape[0]):
        connection_derivatives(model, work, c, c_k)
        size, o = model.c_size[c], model.s_diagonal[c]
        for r in range(size):
            for k in range(size):
                s[o + r * size + k] = work.V[c, r, k]
    for p in range(model.pair_row.shape[0]):
        a, b = model.pair_row[p], model.pair_column[p]
        c, d = model.m_connection[a], model.m_connection[b]
        rows, columns, o = model.c_size[c], model.c_size[d], model.pair_block[p]
        R, P, Z, sign = work.R[model.m_body[a]], work.P[a], work.Z[p], model.m_sign[b]
        n_motion = 12 if model.c_rates[c] else 6
        turned = work.scratch[:12]
        for r in range(rows):
            for part in range(0, n_motion, 3):  # row r of P in body axes
                for k in range(3):
                    turned[part + k] = P[r, part] * R[0, k] + P[r, part + 1] * R[1, k] + P[r, part + 2] * R[2, k]
            for part in range(0, 6, 3):
                w_part = model.m_force[b] if part == 0 else model.m_moment[b]
                if w_part < 0:
                    continue
                x0, x1, x2 = 0.0, 0.0, 0.0
                for k in range(n_motion):
                    x0 += turned[k] * Z[k, part]
                    x1 += turned[k] * Z[k, part + 1]
                    x2 += turned[k] * Z[k, part + 2]
                for k in range(3):
                    s[o + r * columns + w_part + k] += sign * (x0 * R[k, 0] + x1 * R[k, 1] + x2 * R[k, 2])


@inner
def factorize_connections(model, work):
    """Block LU of the connections in the planned order. Return the connection with a singular block, or -1."""
    s = work.s
    for step in range(model.order.shape[0]):
        j = model.order[step]
        n, o = model.c_size[j], model.s_diagonal[j]
        D = s[o : o + n * n].reshape((n, n))
        pivot = work.s_pivot[model.c_w0[j] : model.c_w0[j + 1]]
        if not lu_factor(D, pivot):
            return j
        first, last = model.after0[step], model.after0[step + 1]
        for e in range(first, last):
            m = model.c_size[model.after[e]]
            o = model.after_upper[e]
            lu_solve_columns(D, pivot, s[o : o + n * m].reshape((n, m)))
        target = model.update0[step]
        for e in range(first, last):
            rows = model.c_size[model.after[e]]
            L = s[model.after_lower[e] : model.after_lower[e] + rows * n].reshape((rows, n))
            for f in range(first, last):
                columns = model.c_size[model.after[f]]
                U = s[model.after_upper[f] : model.after_upper[f] + n * columns].reshape((n, columns))
                o = model.update[target]
                target += 1
                for r in range(rows):
                    for k in range(columns):
                        total = 0.0
                        for j_ in range(n):
                            total += L[r, j_] * U[j_, k]
                        s[o + r * columns + k] -= total
    return -1


@inner
def solve_connections(model, work):
    """Overwrite mu by the solution for the right side in mu."""
    s, mu = work.s, work.mu
    for step in range(model.order.shape[0]):
        j = model.order[step]
        n, o = model.c_size[j], model.s_diagonal[j]
        own = mu[model.c_w0[j] : model.c_w0[j + 1]]
        lu_solve(s[o : o + n * n].reshape((n, n)), work.s_pivot[model.c_w0[j] : model.c_w0[j + 1]], own)
        for e in range(model.after0[step], model.after0[step + 1]):
            i = model.after[e]
            o = model.after_lower[e]
            for r in range(model.c_size[i]):
                for k in range(n):
                    mu[model.c_w0[i] + r] -= s[o + r * n + k] * own[k]
    for step in range(model.order.shape[0] - 1, -1, -1):
        j = model.order[step]
        for e in range(model.after0[step], model.after0[step + 1]):
            i = model.after[e]
            o, columns = model.after_upper[e], model.c_size[i]
            for r in range(model.c_size[j]):
                for k in range(columns):
                    mu[model.c_w0[j] + r] -= s[o + r * columns + k] * mu[model.c_w0[i] + k]


@inner
def correction(model, work, c_k, is_new):
    """Write the correction (y, mu) for the residuals in `work`; reassemble the connections if is_new.

    Return the connection with a singular block, or -1.
    """
    y, mu = work.y, work.mu
    for i in range(model.kind.shape[0]):
        n, u0 = 6 + model.n_q[i], model.u0[i]
        for k in range(u0, u0 + n):
            y[k] = -c_k * work.residual[k]
        lu_solve(work.H[model.h0[i] : model.h0[i + 1]].reshape((n, n)), work.pivot[u0 : u0 + n], y[u0 : u0 + n])
    if mu.shape[0] == 0:
        return -1
    if is_new:
        assemble(model, work, c_k)
        singular = factorize_connections(model, work)
        if singular >= 0:
            return singular
    for k in range(mu.shape[0]):
        mu[k] = -work.g[k]
    motion = work.scratch[:12]
    for i in range(model.kind.shape[0]):
        n, u0, R = 6 + model.n_q[i], model.u0[i], work.R[i]
        for e in range(model.end0[i], model.end0[i + 1]):
            m = model.ends[e]
            c = model.m_connection[m]
            o, w0 = model.m_x0[m], model.c_w0[c]
            n_motion = 12 if model.c_rates[c] else 6
            for r in range(n_motion):
                total = 0.0
                for k in range(n):
                    total += work.J_row[12 * o + r * n + k] * y[u0 + k]
                motion[r] = total
            for part in range(0, n_motion, 3):
                x0, x1, x2 = motion[part], motion[part + 1], motion[part + 2]
                for k in range(3):
                    motion[part + k] = R[k, 0] * x0 + R[k, 1] * x1 + R[k, 2] * x2
            for r in range(model.c_size[c]):
                total = 0.0
                for k in range(n_motion):
                    total += work.P[m, r, k] * motion[k]
                mu[w0 + r] -= total
    solve_connections(model, work)
    for i in range(model.kind.shape[0]):
        n, u0, R = 6 + model.n_q[i], model.u0[i], work.R[i]
        for e in range(model.end0[i], model.end0[i + 1]):
            m = model.ends[e]
            c = model.m_connection[m]
            o, w0, sign = model.m_x0[m], model.c_w0[c], model.m_sign[m]
            size = 3 if model.m_moment[m] < 0 else 6
            for part in range(0, size, 3):
                w_part = model.m_force[m] if part == 0 else model.m_moment[m]
                if w_part < 0:
                    motion[0], motion[1], motion[2] = 0.0, 0.0, 0.0
                    continue
                w_part += w0
                x0, x1, x2 = mu[w_part], mu[w_part + 1], mu[w_part + 2]
                for k in range(3):
                    motion[part + k] = sign * (R[0, k] * x0 + R[1, k] * x1 + R[2, k] * x2)
            for r in range(n):
                total = 0.0
                for k in range(size):
                    total += work.X[6 * o + r * 6 + k] * motion[k]
                y[u0 + r] += total
    return -1
