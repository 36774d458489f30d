"""Newton correction of the whole system: bodies are eliminated one by one, then connections in sparse block form.

    H_i y_i - Σ_ends sign J_columnᵀ R_iᵀ mu = -c_k residual_i                                    (each body)
    Σ_ends P R_i J_row y + V mu             = -g                                                 (each connection)

With z = H⁻¹(-c_k residual), X = H⁻¹ J_columnᵀ and Z = J_row X the connections have the matrix V + P R Z Rᵀ sign. H, X
and Z do not rotate with the body, so that they can be used for many steps; P, R and V are those of the iterate.
"""

import math

from floatframe.engine.kernels.body import NewtonWeights, modal_number, newton_block
from floatframe.engine.kernels.compiler.compilation import inner, loops, small, view
from floatframe.engine.kernels.connections.connection import (
    connection_derivatives,
    constraint_rates,
    write_velocity_gaps,
)
from floatframe.engine.kernels.dense import (
    add_products,
    lu_factor,
    lu_solve,
    lu_solve_columns,
    matrix_at,
    product_of,
    rows_of,
    six_columns,
    subtract_product,
)
from floatframe.engine.kernels.evaluation import linearize, linearize_body
from floatframe.engine.kernels.model import ELEMENT, STIFFNESS
from floatframe.engine.kernels.vector import (
    add,
    copy,
    dot,
    norm,
    put,
    put_sum,
    scaled,
    sub,
    turned,
    turned_back,
    vector,
)
from floatframe.model.joints.rows.kinds import NOTHING

__all__ = [
    "add_motion",
    "close_connections",
    "close_velocities",
    "correction",
    "factorize_bodies",
    "factorize_system",
    "move_bodies",
    "renew_connections",
    "renew_turning",
    "settle_accelerations",
    "share_reactions",
    "velocity_gaps",
]

# rotation in a step [rad] with which the factors of a rigid body are renewed in every step: with less the old ones are
# as good, with more the prediction may be so far off that they are better
TURNING = (0.02, 0.5)
SOFTER = 1e3  # s of `share_reactions`: s S is well above the roundoff of A
SWEEPS = 5  # number of iterations: with soft 1e-9 of A, constraints with a condition number of 1e4 share to 1e-10


@inner
def factorize_bodies(model, work, weights):
    """Linearise at the iterate, factorise H of each body, write X, Z; return the body with singular H, or -1."""
    for i in range(model.bodies.kind.shape[0]):
        linearize_body(model, work, i, weights)
    return factorize_tangents(model, work)


@inner
def factorize_tangents(model, work):
    """Factorise H of every body and write X and Z; return the body with singular H, or -1."""
    work.counted.factorisations += 1
    for i in range(model.bodies.kind.shape[0]):
        if not factorize_body(model, work, i):
            return i
    return -1


@inner
def factorize_body(model, work, i):
    """Factorise H of body i and write X of its ends and Z of its pairs of ends; return whether H is regular."""
    n, pivot = 6 + model.bodies.n_q[i], work.solver.pivot[model.bodies.u0[i] : model.bodies.u0[i + 1]]
    H = newton_block(model, work, i)
    if not lu_factor(H, pivot):
        return False
    for e in range(model.bodies.end0[i], model.bodies.end0[i + 1]):
        o = model.markers.x0[model.bodies.ends[e]]
        column = rows_of(work.solver.J_column, 6, o, n)
        X = work.solver.X[o : o + n]
        for r in range(n):
            for k in range(6):
                X[r, k] = column[k, r]
        lu_solve_columns(H, pivot, X)
    for p in range(model.elimination.pair0[i], model.elimination.pair0[i + 1]):
        row_marker, o = model.elimination.pair_row[p], model.markers.x0[model.elimination.pair_column[p]]
        X, n_motion = (
            work.solver.X[o : o + n],
            12 if model.connections.has_rates[model.markers.connection[row_marker]] else 6,
        )
        six_columns(rows_of(work.solver.J_row, 12, model.markers.x0[row_marker], n), X, work.solver.Z[p, :n_motion])
        if model.markers.accelerated[row_marker] >= 0:
            six_columns(rows_of(work.solver.J_a, 6, model.markers.a0[row_marker], n), X, work.solver.Z_a[p])
    return True


@inner
def renew_turning(model, work, weights):
    """Linearise and factorise the rigid bodies whose rotation in the step is within `TURNING`."""
    for i in range(model.bodies.kind.shape[0]):
        theta = norm(vector(work.state.theta[i]))
        if model.bodies.n_q[i] == 0 and TURNING[0] < theta < TURNING[1]:
            linearize_body(model, work, i, weights)
            if not factorize_body(model, work, i):
                return i
    return -1


@inner
def factorize_system(model, work):
    """Factorise H of every body and the matrix of the connections; return whether they are regular."""
    if factorize_tangents(model, work) >= 0:
        return False
    assemble(model, work, 0.0, True)
    return factorize_connections(model.elimination, model.connections, work.solver) < 0


@inner
def add_motion(model, work, out):
    """Add the motion y of the bodies to out, (n_u,), with translations in ground axes; return whether it is finite."""
    y, total = work.solver.y, 0.0
    for i in range(model.bodies.kind.shape[0]):
        u0 = model.bodies.u0[i]
        put_sum(out, u0, turned(work.state.R[i], y[u0:]))
        for k in range(u0 + 3, model.bodies.u0[i + 1]):
            out[k] += y[k]
    for k in range(y.shape[0]):
        total += y[k]
    return math.isfinite(total)


@view
def wrench_of(connections, x, c):
    """Return the part of x, (n_w,), for the wrench of connection c."""
    return x[connections.w0[c] : connections.w0[c + 1]]


@view
def diagonal_block(elimination, connections, solver, c):
    """Return the diagonal block of connection c."""
    return matrix_at(solver.blocks, elimination.diagonal[c], connections.size[c], connections.size[c])


@view
def upper_panel(elimination, connections, solver, j):
    """Return the blocks right of the diagonal block of connection j, without those of earlier eliminations."""
    return matrix_at(solver.blocks, elimination.upper[j], connections.size[j], elimination.width[j])


@view
def lower_panel(elimination, connections, solver, j):
    """Return the blocks below the diagonal block of connection j, without those of earlier eliminations."""
    return matrix_at(solver.blocks, elimination.lower[j], elimination.width[j], connections.size[j])


@view
def pair_rows(model, solver, p):
    """Return the rows of the block of pair p; the block has the first columns."""
    c = model.markers.connection[model.elimination.pair_row[p]]
    return matrix_at(
        solver.blocks, model.elimination.pair_block[p], model.connections.size[c], model.elimination.pair_stride[p]
    )


@inner
def assemble(model, work, c_k, are_all_new):
    """Assemble the block matrix of the connections at the iterate; if not all are new, with old derivatives of laws."""
    work.solver.blocks[:] = 0.0
    for c in range(model.connections.size.shape[0]):
        is_kept = model.connections.law[c] == ELEMENT and model.laws.is_costly[model.connections.item[c]] == 1
        if are_all_new or not is_kept:
            connection_derivatives(model, work, c, c_k)
        own = diagonal_block(model.elimination, model.connections, work.solver, c)
        for r in range(own.shape[0]):
            for k in range(own.shape[1]):
                own[r, k] = work.connections.V[c, r, k]
    for p in range(model.elimination.pair_row.shape[0]):
        a, b = model.elimination.pair_row[p], model.elimination.pair_column[p]
        c, own = model.markers.connection[a], pair_rows(model, work.solver, p)
        R, P, Z, sign = (
            work.state.R[model.markers.body[a]],
            work.connections.P[a],
            work.solver.Z[p],
            model.markers.sign[b],
        )
        n_motion = 12 if model.connections.has_rates[c] else 6
        for r in range(own.shape[0]):
            by_force, by_moment = (0.0, 0.0, 0.0), (0.0, 0.0, 0.0)
            for part in range(0, n_motion, 3):
                if P[r, part] != 0.0 or P[r, part + 1] != 0.0 or P[r, part + 2] != 0.0:
                    along = turned_back(R, P[r, part:])  # in body axes
                    for k in range(3):
                        by_force = add(by_force, scaled(along[k], Z[part + k]))
                        by_moment = add(by_moment, scaled(along[k], Z[part + k, 3:]))
            if model.markers.force[b] >= 0:
                put_sum(own[r], model.markers.force[b], scaled(sign, turned(R, by_force)))
            if model.markers.moment[b] >= 0:
                put_sum(own[r], model.markers.moment[b], scaled(sign, turned(R, by_moment)))
            if model.markers.accelerated[a] >= 0:
                add_accelerated(model, work, p, r, own[r])


@inner
def add_accelerated(model, work, p, r, own):
    """Add the effect of the pair's other wrench on row r through the acceleration of the first marker to `own`."""
    a, b, row = model.elimination.pair_row[p], model.elimination.pair_column[p], work.solver.row
    R, P_a = work.state.R[model.markers.body[a]], work.connections.P_a[model.markers.accelerated[a]]
    Z_a = work.solver.Z_a[p]
    for part in range(0, 6, 3):
        put(row, part, turned_back(R, P_a[r, part:]))
    for part in range(0, 6, 3):
        w_part = model.markers.force[b] if part == 0 else model.markers.moment[b]
        if w_part >= 0:
            x = (0.0, 0.0, 0.0)
            for k in range(6):
                x = add(x, scaled(row[k], Z_a[k, part:]))
            put_sum(own, w_part, scaled(model.markers.sign[b], turned(R, x)))


@loops
def factorize_connections(elimination, connections, solver):
    """Factorise the connections in the planned order; return the connection with a singular block, or -1."""
    for step in range(elimination.order.shape[0]):
        j = elimination.order[step]
        D, pivot = diagonal_block(elimination, connections, solver, j), wrench_of(connections, solver.block_pivot, j)
        if not lu_factor(D, pivot):
            return j
        upper, lower = (
            upper_panel(elimination, connections, solver, j),
            lower_panel(elimination, connections, solver, j),
        )
        lu_solve_columns(D, pivot, upper)
        product, row = solver.panel_row[: upper.shape[1]], 0
        for e in range(elimination.after0[step], elimination.after0[step + 1]):
            for r in range(connections.size[elimination.after[e]]):
                product[:] = 0.0
                add_products(upper, lower[row], product)
                subtract_runs(elimination, solver.blocks, e, r, product)
                row += 1
    return -1


@loops
def subtract_runs(elimination, blocks, e, r, product):
    """Subtract a row of a product of panels from row r of connection after[e]."""
    column = 0
    for k in range(elimination.run0[e], elimination.run0[e + 1]):
        first, length = elimination.run[k] + r * elimination.run_stride[k], elimination.run_length[k]
        for c in range(length):
            blocks[first + c] -= product[column + c]
        column += length


@loops
def solve_connections(elimination, connections, solver):
    """Overwrite mu, which contains the right side, with the solution."""
    for step in range(elimination.order.shape[0]):
        j = elimination.order[step]
        own, lower = wrench_of(connections, solver.mu, j), lower_panel(elimination, connections, solver, j)
        lu_solve(
            diagonal_block(elimination, connections, solver, j), wrench_of(connections, solver.block_pivot, j), own
        )
        row = 0
        for e in range(elimination.after0[step], elimination.after0[step + 1]):
            other = wrench_of(connections, solver.mu, elimination.after[e])
            subtract_product(lower[row : row + other.shape[0]], own, other)
            row += other.shape[0]
    for step in range(elimination.order.shape[0] - 1, -1, -1):
        j = elimination.order[step]
        later, column = solver.panel_row[: elimination.width[j]], 0
        for e in range(elimination.after0[step], elimination.after0[step + 1]):
            other = wrench_of(connections, solver.mu, elimination.after[e])
            copy(other, later[column:])
            column += other.shape[0]
        subtract_product(upper_panel(elimination, connections, solver, j), later, wrench_of(connections, solver.mu, j))


@inner
def take_accelerated(model, work, m, n, y, mu):
    """Subtract from mu the effect of the body correction y on the rows of marker m through its acceleration."""
    c, o, motion = model.markers.connection[m], model.markers.a0[m], work.solver.motion
    R, P_a = work.state.R[model.markers.body[m]], work.connections.P_a[model.markers.accelerated[m]]
    J_a = rows_of(work.solver.J_a, 6, o, n)
    product_of(J_a, y, motion)
    for part in range(0, 6, 3):
        put(motion, part, turned(R, motion[part:]))
    subtract_product(P_a[: model.connections.size[c]], motion, wrench_of(model.connections, mu, c))


@inner
def renew_connections(model, work, c_k, are_all_new):
    """Assemble and factorise the connections, see `assemble`; return the connection with a singular block, or -1."""
    assemble(model, work, c_k, are_all_new)
    return factorize_connections(model.elimination, model.connections, work.solver)


@inner
def correction(model, work, c_k, is_new):
    """Write the correction (y, mu) for the residuals in `work`; with is_new, assemble the connections again.

    Return the connection with a singular block, or -1.
    """
    move_bodies(model, work, c_k)
    if work.solver.mu.shape[0] == 0:
        return -1
    if is_new:
        singular = renew_connections(model, work, c_k, True)
        if singular >= 0:
            return singular
    close_connections(model, work)
    return -1


@inner
def move_bodies(model, work, c_k):
    """Write the body correction y for the residuals of the bodies alone."""
    bodies, solver = model.bodies, work.solver
    y = solver.y
    for i in range(bodies.kind.shape[0]):
        first, last = bodies.u0[i], bodies.u0[i + 1]
        for k in range(first, last):
            y[k] = -c_k * work.bodies.residual[k]
        lu_solve(newton_block(model, work, i), solver.pivot[first:last], y[first:last])


@inner
def close_connections(model, work):
    """Write mu for the residuals of the connections, and add the body motion due to mu to y."""
    mu = work.solver.mu
    for k in range(mu.shape[0]):
        mu[k] = -work.connections.g[k]
    take_motions(model, work)
    solve_connections(model.elimination, model.connections, work.solver)
    add_wrenches(model, work)


@small
def three_products(a, b, c, y):
    """Return the products of three rows with y, computed in independent sums for speed."""
    first, second, third = 0.0, 0.0, 0.0
    for k in range(y.shape[0]):
        first, second, third = first + a[k] * y[k], second + b[k] * y[k], third + c[k] * y[k]
    return first, second, third


@inner
def take_motions(model, work):
    """Subtract from mu the effect of the body motion y on the rows of connections."""
    bodies, markers, connections, solver = model.bodies, model.markers, model.connections, work.solver
    y, mu, motion = solver.y, solver.mu, solver.motion
    for i in range(bodies.kind.shape[0]):
        n, u0, R = 6 + bodies.n_q[i], bodies.u0[i], work.state.R[i]
        for e in range(bodies.end0[i], bodies.end0[i + 1]):
            m = bodies.ends[e]
            c = markers.connection[m]
            o, w0 = markers.x0[m], connections.w0[c]
            n_motion = 12 if connections.has_rates[c] else 6
            row = rows_of(solver.J_row, 12, o, n)
            for part in range(0, n_motion, 3):
                x = three_products(row[part], row[part + 1], row[part + 2], y[u0 : u0 + n])
                put(motion, part, turned(R, x))
            for r in range(connections.size[c]):
                total = 0.0
                for k in range(n_motion):
                    total += work.connections.P[m, r, k] * motion[k]
                mu[w0 + r] -= total
            if markers.accelerated[m] >= 0:
                take_accelerated(model, work, m, n, y[u0 : u0 + n], mu)


@inner
def velocity_gaps(model, work, by_rate):
    """Write into mu the difference between position constraints and their rates in the correction.

    The gaps have the scale of the unknowns: by_rate y is the change of velocities. A later `correction` closes the
    positions, which changes their rates by -by_rate g. Position rows whose rate is expensive, and all other rows, get
    no gap.
    """
    for c in range(model.connections.size.shape[0]):
        write_velocity_gaps(model, work, c, 1.0 / by_rate, work.solver.mu)


@inner
def close_velocities(model, work):
    """Write the correction (y, mu) that closes the velocity gaps in mu.

    An unknown of rotation dtheta rotates the body by `T_right` dtheta, while a velocity acts directly. So y becomes the
    rotation. `surplus` is the difference between the rotation and the unknown; the inertia resists the whole rotation,
    but mu balances only the part of the unknown.
    """
    y = work.solver.y
    y[:] = 0.0
    solve_connections(model.elimination, model.connections, work.solver)
    add_wrenches(model, work)
    for i in range(model.bodies.kind.shape[0]):
        u0 = model.bodies.u0[i] + 3
        unknown = vector(y[u0:])
        turning = turned(work.bodies.T_right[i], unknown)
        put(y, u0, turning)
        put(work.solver.surplus[i], 0, sub(turning, unknown))


@inner
def add_wrenches(model, work):
    """Add the body motion X mu due to the wrenches mu to y."""
    bodies, markers, connections, solver = model.bodies, model.markers, model.connections, work.solver
    y, mu = solver.y, solver.mu
    for i in range(bodies.kind.shape[0]):
        n, u0, R = 6 + bodies.n_q[i], bodies.u0[i], work.state.R[i]
        for e in range(bodies.end0[i], bodies.end0[i + 1]):
            m = bodies.ends[e]
            c = markers.connection[m]
            o, w0, sign = markers.x0[m], connections.w0[c], markers.sign[m]
            force, moment = (0.0, 0.0, 0.0), (0.0, 0.0, 0.0)  # wrench of the correction on the marker, body axes
            if markers.force[m] >= 0:
                force = scaled(sign, turned_back(R, mu[w0 + markers.force[m] :]))
            if markers.moment[m] >= 0:
                moment = scaled(sign, turned_back(R, mu[w0 + markers.moment[m] :]))
            X = solver.X[o : o + n]
            for r in range(n):
                y[u0 + r] += dot(vector(X[r]), force) + dot(vector(X[r, 3:]), moment)


@inner
def assemble_masses(model, work, c_k):
    """Factorise the body masses and assemble the connections for accelerations; return whether both are regular.

    Modes without mass get c_k times their stiffness as mass.
    """
    bodies, types = model.bodies, model.body_types
    linearize(model, work, NewtonWeights(1.0, 0.0, 0.0))
    for i in range(bodies.kind.shape[0]):
        n, t = 6 + bodies.n_q[i], bodies.kind[i]
        H = newton_block(model, work, i)
        for k in range(n - 6):
            if not H[6 + k, 6 + k] > 0.0:
                H[6 + k, 6 + k] += c_k * modal_number(types, t, n - 6, STIFFNESS, k)
    if factorize_tangents(model, work) >= 0:
        return False
    assemble(model, work, 0.0, True)
    return True


@inner
def settle_accelerations(model, work, c_k):
    """Correct accelerations and wrenches for the positions and velocities of the iterate; return whether they exist.

    Solve M u_dot - Jᵀ w = f, G u_dot = -d(G)/dt u by one iteration of Newton's method from the accelerations of the
    step, which fulfil the second equation only up to the error of differences. `evaluate` must have been called with
    c_k = 1.
    """
    solver, g = work.solver, work.connections.g
    constraint_rates(model, work)
    if not assemble_masses(model, work, c_k):
        return False
    if factorize_connections(model.elimination, model.connections, solver) >= 0:
        return False
    for i in range(model.bodies.kind.shape[0]):
        u0 = model.bodies.u0[i]
        for k in range(u0, u0 + 6 + model.bodies.n_q[i]):
            solver.y[k] = work.state.u_dot[k]
        put(solver.y, u0, turned_back(work.state.R[i], work.state.u_dot[u0:]))
    solver.mu[:] = 0.0
    take_motions(model, work)
    total = 0.0
    for k in range(g.shape[0]):
        if model.rows.holds[k] != NOTHING:
            g[k] = work.connections.bias[k] - solver.mu[k]
    correction(model, work, 1.0, False)
    for k in range(g.shape[0]):
        work.state.w[k] += solver.mu[k]
        total += solver.mu[k]
    return add_motion(model, work, work.state.u_dot) and math.isfinite(total)


@inner
def share_reactions(model, work, c_k):
    """Distribute the reactions of the iterate among redundant constraints; return whether a solution exists.

    Of all wrenches w' with the same effect on the bodies, Jᵀ w' = Jᵀ w, it finds those with the least sum of
    soft lambda², where lambda is the reaction along a row with the compliance `soft`. With A = G M⁻¹ Jᵀ, and the matrix
    S that maps w to soft lambda (V = -S), they are the limit of the proximal point algorithm

        (A + s S) w'_j = A w + s S w'_(j-1),      w'_0 = 0          (rows without a constraint: V w'_j = V w).

    All w'_j are reactions to motions of the bodies and contain no self-balanced reactions. Each sweep reduces the
    difference between A w' and A w by the ratio of s S to the least eigenvalue of A. w may contain any self-balanced
    sum, such as the roundoff of positions divided by c_k. Work arrays are overwritten, including factors and y.
    """
    rows, connections, solver = model.rows, model.connections, work.solver
    if not assemble_masses(model, work, c_k):
        return False
    for c in range(connections.size.shape[0]):
        own = diagonal_block(model.elimination, connections, solver, c)
        for r in range(own.shape[0]):
            if rows.soft[connections.w0[c] + r] > 0.0:
                for k in range(own.shape[1]):
                    own[r, k] += (SOFTER - 1.0) * work.connections.V[c, r, k]
                    work.connections.V[c, r, k] *= SOFTER
    if factorize_connections(model.elimination, connections, solver) >= 0:
        return False
    solver.y[:] = 0.0
    copy(work.state.w, solver.mu)
    add_wrenches(model, work)  # y = M⁻¹ Jᵀ w
    solver.mu[:] = 0.0
    for sweep in range(SWEEPS):
        if sweep > 0:
            for k in range(solver.mu.shape[0]):
                work.connections.bias[k], solver.mu[k] = solver.mu[k], 0.0
        take_motions(model, work)
        for c in range(connections.size.shape[0]):
            w0 = connections.w0[c]
            for r in range(connections.size[c]):
                total = -solver.mu[w0 + r]
                for k in range(connections.size[c]):
                    if rows.holds[w0 + r] == NOTHING:
                        total += work.connections.V[c, r, k] * work.state.w[w0 + k]
                    elif sweep > 0:
                        total += work.connections.V[c, r, k] * work.connections.bias[w0 + k]
                solver.mu[w0 + r] = total
        solve_connections(model.elimination, connections, solver)
    total = 0.0
    for k in range(solver.mu.shape[0]):
        total += solver.mu[k]
    if not math.isfinite(total):
        return False
    copy(solver.mu, work.state.w)
    return True
