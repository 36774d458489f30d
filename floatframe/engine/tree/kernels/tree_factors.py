"""Newton's correction in relative coordinates, with a cost linear in the number of bodies (docs/relative.md §5).

With Y the jet of the near marker of a joint, x the unknowns of its body (columns, modes), b the force from bodies
further out, and A the derivative of the subtree's force by the jet X of the body,

    X = Y + j x,   dF = A X + H x + b          (H: derivative by the modes of the body)
    L x + R Y = r                              (equations of columns and modes, with b in the right side)
    x = G Y + g,   dF = P Y + p,   P = A + W G,  p = b + W g,  W = A j + H

From the leaves inwards, each joint adds P and p to its parent: to the force of the body and, through its screws J, to
the equations of the modes that move the near marker. Then, outwards, Y is X of the parent plus j of its modes at the
marker, and x follows. Kept wrenches are found from V - C K⁻¹ B; each column of K⁻¹ B is one more solution.
"""

from floatframe.engine.kernels.body import newton_block
from floatframe.engine.kernels.compiler.compilation import inner
from floatframe.engine.kernels.dense import lu_factor, lu_solve, lu_solve_columns
from floatframe.engine.tree.kernels.projection import subtract_slopes
from floatframe.engine.tree.kernels.spatial import pair, turned_power
from floatframe.engine.tree.kernels.tangent import inner_product, product_of, sum_forces, unit_of
from floatframe.engine.tree.kernels.tree import COLUMN, NEAR_MODE

__all__ = ["factorize_tree", "solve_bordered", "solve_newton", "solve_wrenches"]


@inner
def factorize_tree(model, work, tree, tangent, c_d, c_k):
    """Factorise the Newton matrix from the results of `write_tangent`; return whether it is regular."""
    sum_forces(model, work, tree, tangent, c_k)
    for place in range(tree.order.shape[0] - 1, -1, -1):
        if not factorize_joint(model, work, tree, tangent, tree.order[place], c_d, c_k):
            return False
    n_rows, n_s = tangent.V.shape[0], tree.slot.shape[0]
    for r in range(n_rows):
        solve_tree(tree, tangent, tangent.B[r])
    for r in range(n_rows):
        for k in range(n_rows):
            total = 0.0
            for s in range(n_s):
                total += tangent.C[r, s] * tangent.B[k, s]
            tangent.V[r, k] -= total
    return n_rows == 0 or lu_factor(tangent.V, tangent.V_pivot)


@inner
def add_turning(row, screw, F):
    """Add (xi × J) · F to a row over jets, where xi is the first part of each jet."""
    for e in range(6):
        row[e] += turned_power((unit_of(e, 0), unit_of(e, 3)), screw, F)


@inner
def add_power(row, screw, A):
    """Add J · A to a row over jets, where A is the derivative of a force by jets."""
    for e in range(18):
        for r in range(6):
            row[e] += screw[r] * A[r, e]


@inner
def factorize_joint(model, work, tree, tangent, i, c_d, c_k):
    """Eliminate the unknowns of body i and add the remainder to its parent; return whether the block is regular."""
    s0, n_l, m0, q0 = tree.s0[i], tree.s0[i + 1] - tree.s0[i], tree.m0[i], model.bodies.q0[i]
    A, F = tangent.D[i], tangent.F[i]
    H = newton_block(model, work, i)
    L = tangent.L[tree.l0[i] : tree.l0[i + 1]].reshape((n_l, n_l))
    R, W = tangent.G[s0 : s0 + n_l], tangent.W[s0 : s0 + n_l]
    for k in range(n_l):
        j, s = tree.own_jet[s0 + k], s0 + k
        for e in range(6):
            W[k, e] = tangent.by_mode[q0 + s - m0, e] if s >= m0 else 0.0
        if j >= 0:
            for r in range(6):
                for e in range(18):
                    W[k, r] += A[r, e] * tangent.jet[j, e]
    for k in range(n_l):
        j, s = tree.own_jet[s0 + k], s0 + k
        row = R[k]
        for e in range(18):
            row[e] = tangent.modal[q0 + s - m0, e] if s >= m0 else 0.0
        for l in range(n_l):  # noqa: E741
            L[k, l] = H[6 + s - m0, 6 + s0 + l - m0] if s >= m0 and s0 + l >= m0 else 0.0
        if j >= 0 and s >= m0:
            add_turning(row, tangent.screw[j], F)  # with the jet of the body
        for l in range(n_l):  # noqa: E741
            o = tree.own_jet[s0 + l]
            if o >= 0:
                for e in range(18):
                    L[k, l] += row[e] * tangent.jet[o, e]
            if j >= 0:
                L[k, l] += inner_product(tangent.screw[j], W[l])
        if j >= 0:
            add_power(row, tangent.screw[j], A)
            if s < m0:
                add_turning(row, tangent.screw[j], F)
                turning_far(tree, tangent, i, j, k, L, F)
    subtract_slopes(model, work, tree, i, L, -s0, c_d, c_k)
    if n_l > 0:
        if not lu_factor(L, tangent.L_pivot[s0 : s0 + n_l]):
            return False
        lu_solve_columns(L, tangent.L_pivot[s0 : s0 + n_l], R)
        for k in range(n_l):  # P = A + W G
            for e in range(18):
                R[k, e] = -R[k, e]
                for r in range(6):
                    A[r, e] += W[k, r] * R[k, e]
    if tree.parent[i] >= 0:
        add_to_parent(model, work, tree, tangent, i)
    return True


@inner
def turning_far(tree, tangent, i, j, k, L, F):
    """Add (xi × J) · F for joint columns if J is fixed in the marker on the body."""
    if tree.side[tree.jet_item[j]] == tree.is_reversed[i]:
        return
    for o in range(tree.jet0[i], tree.jet0[i + 1]):
        if tree.jet_kind[o] == COLUMN:
            L[k, tree.jet_s[o] - tree.s0[i]] += turned_power(pair(tangent.jet[o]), tangent.screw[j], F)


@inner
def add_to_parent(model, work, tree, tangent, i):
    """Add the remainder P of body i's joint to the force and the modal equations of its parent."""
    parent, P, F = tree.parent[i], tangent.D[i], tangent.F[i]
    q0 = model.bodies.q0[parent]
    H = newton_block(model, work, parent)
    f = tangent.f
    for j in range(tree.jet0[i], tree.jet0[i + 1]):
        if tree.jet_kind[j] != NEAR_MODE:
            continue
        k, screw = tree.jet_item[j], tangent.screw[j]
        row = tangent.modal[q0 + k]
        add_power(row, screw, P)
        add_turning(row, screw, F)
        product_of(P, tangent.jet[j], f)
        for r in range(6):
            tangent.by_mode[q0 + k, r] += f[r]
        for o in range(tree.jet0[i], tree.jet0[i + 1]):
            if tree.jet_kind[o] == NEAR_MODE:
                H[6 + tree.jet_item[o], 6 + k] += inner_product(tangent.screw[o], f)
    for r in range(6):
        for e in range(18):
            tangent.D[parent, r, e] += P[r, e]


@inner
def solve_tree(tree, tangent, x):
    """Overwrite x, (n_s,), which contains the right side, with the solution."""
    b, X = tangent.b, tangent.X
    b[:, :] = 0.0
    for place in range(tree.order.shape[0] - 1, -1, -1):
        i = tree.order[place]
        s0, n_l, parent = tree.s0[i], tree.s0[i + 1] - tree.s0[i], tree.parent[i]
        for s in range(s0, s0 + n_l):
            if tree.own_jet[s] >= 0:
                x[s] -= inner_product(tangent.screw[tree.own_jet[s]], b[i])
        if n_l > 0:
            L = tangent.L[tree.l0[i] : tree.l0[i + 1]].reshape((n_l, n_l))
            lu_solve(L, tangent.L_pivot[s0 : s0 + n_l], x[s0 : s0 + n_l])
        for s in range(s0, s0 + n_l):
            for r in range(6):
                b[i, r] += tangent.W[s, r] * x[s]
        if parent >= 0:
            for r in range(6):
                b[parent, r] += b[i, r]
            for j in range(tree.jet0[i], tree.jet0[i + 1]):
                if tree.jet_kind[j] == NEAR_MODE:
                    x[tree.jet_s[j]] -= inner_product(tangent.screw[j], b[i])
    for place in range(tree.order.shape[0]):
        i = tree.order[place]
        parent, Y = tree.parent[i], tangent.Y[i]
        for e in range(18):
            Y[e] = X[parent, e] if parent >= 0 else 0.0
        for j in range(tree.jet0[i], tree.jet0[i + 1]):
            if tree.jet_kind[j] == NEAR_MODE:
                for e in range(18):
                    Y[e] += tangent.jet[j, e] * x[tree.jet_s[j]]
        for s in range(tree.s0[i], tree.s0[i + 1]):
            for e in range(18):
                x[s] += tangent.G[s, e] * Y[e]
        for s in range(tree.s0[i], tree.s0[i + 1]):
            if tree.own_jet[s] >= 0:
                for e in range(18):
                    Y[e] += tangent.jet[tree.own_jet[s], e] * x[s]
        for e in range(18):
            X[i, e] = Y[e]


@inner
def solve_newton(work, tree, joints, tangent, c_k):
    """Write corrections of unknowns into tangent.step, and of c_k times kept wrenches into tangent.mu."""
    for s in range(tree.slot.shape[0]):
        tangent.step[s] = -c_k * joints.residual[s]
    for k in range(tree.kept_row.shape[0]):
        if tree.kept_row[k] >= 0:
            tangent.mu[tree.kept_row[k]] = -work.connections.g[k]
    solve_bordered(tree, tangent)


@inner
def solve_bordered(tree, tangent):
    """Overwrite the right sides tangent.step (unknowns) and tangent.mu (kept rows) with the solution."""
    step, mu = tangent.step, tangent.mu
    solve_tree(tree, tangent, step)
    for r in range(mu.shape[0]):
        for s in range(step.shape[0]):
            mu[r] -= tangent.C[r, s] * step[s]
    solve_wrenches(tangent)


@inner
def solve_wrenches(tangent):
    """Overwrite the right side tangent.mu with the kept wrenches; add the motion due to them to tangent.step."""
    step, mu = tangent.step, tangent.mu
    if mu.shape[0] == 0:
        return
    lu_solve(tangent.V, tangent.V_pivot, mu)
    for r in range(mu.shape[0]):
        for s in range(step.shape[0]):
            step[s] -= tangent.B[r, s] * mu[r]
