"""Frame motion of nodes for unit rates, in ground axes, each at its own origin (docs/recursive.md §3).

    V_k = shift(V_parent) + above q_dot of a flexible parent + S z_dot of the joint + S q_dot of its own modes

where (v, w) shifted by p is (v + w × p, w). The marker above moves by Psi_t, T Psi_r with each mode. The joint fixes
the own marker of a flexible body, so that the frame of the body moves opposite to the motion of this marker.
"""

from floatframe.engine.kernels.compiler.compilation import loops, small
from floatframe.engine.kernels.vector import add, cross, matrix, product, put, scaled, sub, turned, vector
from floatframe.engine.tree.kernels.mode_screws import mode_screw
from floatframe.engine.tree.kernels.spatial import put_pair_of, scaled_pair, world_screw
from floatframe.engine.tree.recursion.nodes import ROTATION, SCREW, TRANSLATION

__all__ = ["motion_in_ground", "rate_columns"]


@small
def column_of(A, j):
    """Return column j of a matrix of three rows."""
    return A[0][j], A[1][j], A[2][j]


@loops
def joint_columns(nodes, work, k, arm):
    """Write S for the rates of a joint; arm: vector from the origin of its outer frame to the origin of the node."""
    kind, v0 = nodes.kind[k], nodes.v0[k]
    R = matrix(work.R_G[k])
    if nodes.own[k] >= 0:
        R = product(R, work.R_own[k])
    if kind == SCREW:
        e = column_of(R, 2)
        turn = scaled(nodes.turn[k], e)
        put(work.S[v0], 0, add(scaled(nodes.slide[k], e), cross(turn, arm)))
        put(work.S[v0], 3, turn)
    elif kind == ROTATION:
        sign = 1.0
        if nodes.is_near[k]:
            sign, above = -1.0, nodes.parent[k]
            R = matrix(work.A[k]) if above < 0 else product(work.R_G[above], work.A[k])
        for j in range(3):
            turn = scaled(sign, column_of(R, j))
            put(work.S[v0 + j], 0, cross(turn, arm))
            put(work.S[v0 + j], 3, turn)
    elif kind == TRANSLATION:
        for j in range(3):
            put(work.S[v0 + j], 0, scaled(nodes.slide[k], column_of(R, j)))
            put(work.S[v0 + j], 3, (0.0, 0.0, 0.0))


@loops
def put_mode_columns(model, marker_work, m, R, p, sign, out):
    """Write sign times the motion of each mode at marker m to out, (n, 6); R, p: axes and origin of its body."""
    if m < 0 or model.markers.psi0[m] < 0:
        out[:, :] = 0.0
        return
    for j in range(out.shape[0]):
        S = world_screw(R, p, mode_screw(model, marker_work, m, model.markers.body[m], j))
        put_pair_of(out[j], 0, scaled_pair(sign, S))


@loops
def rate_columns(nodes, work, model, marker_work):
    """Write S and above of all nodes, which must be placed in the ground."""
    for k in range(nodes.parent.shape[0]):
        n, m, above, arm = nodes.n_q[k], nodes.own[k], nodes.parent[k], (0.0, 0.0, 0.0)
        if n > 0:
            out = work.S[nodes.vq[k] : nodes.vq[k] + n]
            put_mode_columns(model, marker_work, m, work.R_G[k], arm, -1.0, out)
            if m >= 0:
                arm = scaled(-1.0, turned(work.R_G[k], vector(marker_work.markers.rho[m])))
        joint_columns(nodes, work, k, arm)
        m = nodes.above[k]
        if m >= 0:
            p = sub(vector(work.r_G[above]), vector(work.r_G[k]))
            out = work.above[nodes.c0[k] : nodes.c0[k + 1]]
            put_mode_columns(model, marker_work, m, work.R_G[above], p, 1.0, out)


@loops
def motion_in_ground(nodes, work):
    """Write the velocity of all nodes at their origins from S and above."""
    for k in range(nodes.parent.shape[0]):
        above, c0 = nodes.parent[k], nodes.c0[k]
        v, w = (0.0, 0.0, 0.0), (0.0, 0.0, 0.0)
        if above >= 0:
            v, w = vector(work.motion[above]), vector(work.motion[above, 3:])
            v = add(v, cross(w, sub(vector(work.r_G[k]), vector(work.r_G[above]))))
            for j in range(nodes.c0[k + 1] - c0):
                rate = work.v[nodes.vq[above] + j]
                v = add(v, scaled(rate, vector(work.above[c0 + j])))
                w = add(w, scaled(rate, vector(work.above[c0 + j, 3:])))
        for j in range(nodes.n_z[k] + nodes.n_q[k]):
            i = nodes.v0[k] + j
            v = add(v, scaled(work.v[i], vector(work.S[i])))
            w = add(w, scaled(work.v[i], vector(work.S[i, 3:])))
        put(work.motion[k], 0, v)
        put(work.motion[k], 3, w)
