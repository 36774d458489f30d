"""Variations of body motion by the unknowns, with their rates (docs/relative.md §5).

A variation xi = (displacement of the point at O, rotation) is a spatial vector about a point O at rest, and applies to
a body and its whole subtree. xi of a body is the sum of xi of its parent, of the variations by the columns of its joint
and by the modes of the parent at the near marker, minus those by its own modes at the far marker. With V the spatial
velocity of the frame in which a screw S is fixed, and V' its rate, a variation S theta has

    xi = S theta      xi_dot = S theta_dot + V × S theta
    xi_ddot = S theta_ddot + 2 V × S theta_dot + (V' × S + V × (V × S)) theta

where V × S = (omega × S_v + v × S_w, omega × S_w). In a step theta, theta_dot, theta_ddot are c_k, c_d, c_m times the
correction of the unknown. The unknown of a group of rotations is the vector x with Q = Q_start exp(x). Then
theta = T(x) dx, and the rates z_dot, z_ddot, in axes of B, change by d(z_dot) = theta_dot + z_dot × theta.
"""

from floatframe.engine.kernels.body import NewtonWeights
from floatframe.engine.kernels.compiler.compilation import inner
from floatframe.engine.kernels.vector import add, cross, put, scaled, sub, turned, vector
from floatframe.engine.tree.kernels.kinematics import end_motion, joint_ends
from floatframe.engine.tree.kernels.mode_screws import mode_screws, second_rates, variation_rates
from floatframe.engine.tree.kernels.spatial import (
    pair_sum,
    put_pair_of,
    scaled_pair,
    spatial_cross,
    spatial_motion,
    world_screw,
)
from floatframe.engine.tree.kernels.spins import spin_variations, turning_by_columns
from floatframe.engine.tree.kernels.tree import COLUMN, FAR_MODE, NEAR_MODE

__all__ = ["carrier", "put_mode_jet", "write_jets"]


@inner
def put_jets(out, S_0, S_1, S_2, V, V_dot):
    """Write variation xi and its rates, (18,), where S theta = S_0, S theta_dot = S_1, S theta_ddot = S_2."""
    xi_dot, xi_ddot = variation_rates(S_0, S_1, S_2, V, V_dot)
    put_pair_of(out, 0, S_0)
    put_pair_of(out, 6, xi_dot)
    put_pair_of(out, 12, xi_ddot)


@inner
def put_reach(out, S_0, S_1, V):
    """Write the variation xi and its rate xi_dot, (12,)."""
    put_pair_of(out, 0, S_0)
    put_pair_of(out, 6, pair_sum(S_1, spatial_cross(V, S_0)))


@inner
def write_jets(model, work, tree, joints, tangent, weights, rate):
    """Write screws, jets with weights c_m, c_d, c_k, and reaches with weights 1 and `rate`, of all joints."""
    put(tangent.origin, 0, vector(work.state.r[tree.order[0]]))
    for i in range(tree.parent.shape[0]):
        column_jets(model, work, tree, joints, tangent, i, weights, rate)
        mode_jets(model, work, tree, tangent, i, NEAR_MODE, weights, rate)
        mode_jets(model, work, tree, tangent, i, FAR_MODE, weights, rate)


@inner
def mode_jets(model, work, tree, tangent, i, kind, weights, rate):
    """Write screws, jets and reaches of the modes at the near or far marker of body i's joint."""
    m, sign = (tree.near[i], 1.0) if kind == NEAR_MODE else (tree.far[i], -1.0)
    if m < 0 or model.markers.psi0[m] < 0:
        return
    body = model.markers.body[m]
    held = carrier(model, work, tangent, m, body)
    for j in range(tree.jet0[i], tree.jet0[i + 1]):
        if tree.jet_kind[j] != kind:
            continue
        s, s_1, s_2 = mode_screws(model, work, m, body, tree.jet_item[j], held)
        S, S_1, S_2 = scaled_pair(sign, s), scaled_pair(sign, s_1), scaled_pair(sign, s_2)
        put_pair_of(tangent.screw[j], 0, S)
        put_mode_jet(tangent.jet[j], S, S_1, S_2, held, weights)
        put_reach(tangent.reach[j], S, pair_sum(scaled_pair(rate, S), S_1), held[2])


@inner
def spatial_end(end, origin):
    """Return position from `origin`, axes, V and V' of a frame whose motion comes from `end_motion`."""
    r, A, v, omega, a, alpha = end
    p = sub(r, origin)
    V, V_dot = spatial_motion(p, v, omega, a, alpha)
    return p, A, V, V_dot


@inner
def carrier(model, work, tangent, m, i):
    """Return R, p, V, V' of the frame of body i that carries marker m, and the marker's `second_rates`."""
    p, R, V, V_dot = spatial_end(end_motion(model, work, -1, i), vector(tangent.origin))
    rho_2, angle_2 = second_rates(model, work, m, i)
    return R, p, V, V_dot, rho_2, angle_2


@inner
def put_mode_jet(out, S, S_1, S_2, held, weights):
    """Write the jet of a mode from the screws that `mode_screws` returns."""
    c_m, c_d, c_k = weights
    by_rate = pair_sum(scaled_pair(c_d, S), scaled_pair(c_k, S_1))
    by_second = pair_sum(scaled_pair(c_m, S), pair_sum(scaled_pair(2 * c_d, S_1), scaled_pair(c_k, S_2)))
    put_jets(out, scaled_pair(c_k, S), by_rate, by_second, held[2], held[3])


@inner
def column_jets(model, work, tree, joints, tangent, i, weights, rate):
    """Write screws, jets and reaches of the joint columns of body i."""
    c_m, c_d, c_k = weights
    if tree.column0[i] == tree.column0[i + 1]:
        return
    origin, zero = vector(tangent.origin), (0.0, 0.0, 0.0)
    end_a, end_b = joint_ends(model, work, tree, i)
    p_a, A_a, V_a, V_a_dot = spatial_end(end_a, origin)
    p_b, A_b, V_b, V_b_dot = spatial_end(end_b, origin)
    spin, spin_dot = zero, zero  # for rotations fixed in B, axes of B
    for k in range(tree.column0[i], tree.column0[i + 1]):
        if tree.side[k] != 0:
            alpha = vector(tree.alpha[k])
            spin = add(spin, scaled(joints.rate[k], alpha))
            spin_dot = add(spin_dot, scaled(joints.acceleration[k], alpha))
    T = turning_by_columns(tree, joints, i)
    sense = -1.0 if tree.is_reversed[i] != 0 else 1.0
    for j in range(tree.jet0[i], tree.jet0[i + 1]):
        if tree.jet_kind[j] != COLUMN:
            continue
        k = tree.jet_item[j]
        alpha = scaled(sense, vector(tree.alpha[k]))
        screw, jet, reach = tangent.screw[j], tangent.jet[j], tangent.reach[j]
        if tree.side[k] == 0:
            S = world_screw(A_a, p_a, (scaled(sense, vector(tree.tau[k])), alpha))
            put_pair_of(screw, 0, S)
            put_jets(jet, scaled_pair(c_k, S), scaled_pair(c_d, S), scaled_pair(c_m, S), V_a, V_a_dot)
            put_reach(reach, S, scaled_pair(rate, S), V_a)
        else:
            theta = turned(T, alpha)
            put_pair_of(screw, 0, world_screw(A_b, p_b, (zero, alpha)))
            th_1 = sub(scaled(c_d, alpha), scaled(c_k, cross(spin, theta)))
            th_2 = sub(sub(scaled(c_m, alpha), scaled(c_k, cross(spin_dot, theta))), cross(spin, th_1))
            if joints.spins[i] != 0:
                th_1, th_2 = spin_variations(tree, joints, i, alpha, theta, weights)
            S_0 = world_screw(A_b, p_b, (zero, scaled(c_k, theta)))
            S_1, S_2 = world_screw(A_b, p_b, (zero, th_1)), world_screw(A_b, p_b, (zero, th_2))
            put_jets(jet, S_0, S_1, S_2, V_b, V_b_dot)
            th_1 = sub(scaled(rate, alpha), cross(spin, theta))
            if joints.spins[i] != 0:
                th_1, _ = spin_variations(tree, joints, i, alpha, theta, NewtonWeights(0.0, rate, 1.0))
            put_reach(reach, world_screw(A_b, p_b, (zero, theta)), world_screw(A_b, p_b, (zero, th_1)), V_b)
