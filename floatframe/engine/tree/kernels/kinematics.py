"""Body motion from joint motion, and the reverse (docs/relative.md §3).

With n, f the markers of a joint at parent and body, A, B its ends, D = A_A d, s = Σ t_k z_dot_k, w = Σ a_k z_dot_k, and
s', w' the same sums with z_ddot_k,

    r_B = r_A + D,  A_B = A_A Q            v_B = v_A + omega_A × D + s,  omega_B = omega_A + w
    a_B = a_A + alpha_A × D + omega_A × (omega_A × D + 2 s) + s'
    alpha_B = alpha_A + w' + Σ omega_side × a_k z_dot_k

The motion of the body follows from that of its marker by the equations of `kernels.marker`. All equations are valid
also if the body is at A. Deformations of both bodies, their rates and accelerations are in `state.q`, `state.u`,
`state.u_dot`.
"""

from floatframe.engine.kernels.compiler.compilation import inner, loops
from floatframe.engine.kernels.marker import elastic_motion, marker_motion
from floatframe.engine.kernels.marker_acceleration import elastic_body_in_joint, marker_acceleration
from floatframe.engine.kernels.rotation import exp_matrix
from floatframe.engine.kernels.vector import (
    add,
    cross,
    dot,
    matrix,
    product,
    put,
    put_matrix,
    scaled,
    sub,
    transposed,
    turned,
    turned_back,
    unit_matrix,
    vector,
)
from floatframe.engine.tree.kernels.spins import turn_spinning_joint

__all__ = ["column_screw", "end_motion", "joint_ends", "joint_motion", "move_joints", "place_bodies"]


@loops
def end_motion(model, work, m, i):
    """Return r, A, v, omega, a, alpha of marker m; m = -1: of the frame of body i, i = -1: of the ground."""
    zero = (0.0, 0.0, 0.0)
    if m >= 0:
        markers, out = work.markers, work.markers.bias[m]
        marker_motion(model, work, m)
        marker_acceleration(model, work, m, out)
        v, omega = vector(markers.v[m]), vector(markers.omega[m])
        return vector(markers.r[m]), matrix(markers.A[m]), v, omega, vector(out), vector(out[3:])
    if i < 0:
        return zero, unit_matrix(), zero, zero, zero, zero
    u, u_dot, R = work.state.u[model.bodies.u0[i] :], work.state.u_dot[model.bodies.u0[i] :], matrix(work.state.R[i])
    return vector(work.state.r[i]), R, vector(u), turned(R, u[3:]), vector(u_dot), turned(R, u_dot[3:])


@inner
def joint_ends(model, work, tree, i):
    """Return the motions of ends A and B of the joint of body i, as `end_motion` does."""
    near, far = end_motion(model, work, tree.near[i], tree.parent[i]), end_motion(model, work, tree.far[i], i)
    if tree.is_reversed[i] == 0:
        return near, far
    return far, near


@loops
def put_columns(tree, joints, i, A_a, A_b):
    """Write the directions of the joint columns of body i in ground axes."""
    for k in range(tree.column0[i], tree.column0[i + 1]):
        put(joints.t[k], 0, turned(A_a, tree.tau[k]))
        alpha = vector(tree.alpha[k])
        if tree.side[k] == 0:
            put(joints.a[k], 0, turned(A_a, alpha))
        else:
            put(joints.a[k], 0, turned(A_b, alpha))


@loops
def sums(tree, joints, i, x):
    """Return Σ t_k x_k and Σ a_k x_k over the joint columns of body i."""
    s, w = (0.0, 0.0, 0.0), (0.0, 0.0, 0.0)
    for k in range(tree.column0[i], tree.column0[i + 1]):
        s = add(s, scaled(x[k], vector(joints.t[k])))
        w = add(w, scaled(x[k], vector(joints.a[k])))
    return s, w


@loops
def turning_of_columns(tree, joints, i, omega_a, omega_b):
    """Return Σ omega_side × a_k z_dot_k over the joint columns of body i."""
    total = (0.0, 0.0, 0.0)
    for k in range(tree.column0[i], tree.column0[i + 1]):
        omega = omega_a if tree.side[k] == 0 else omega_b
        total = add(total, scaled(joints.rate[k], cross(omega, vector(joints.a[k]))))
    return total


@inner
def column_screw(work, tree, joints, i, k, origin):
    """Return the screw of joint column k of body i, B relative to A: velocity at a point and rotation, ground axes."""
    m, point = tree.far[i], vector(work.state.r[i])
    if tree.side[k] == tree.is_reversed[i]:  # fixed in the marker on the parent
        m, point = tree.near[i], (0.0, 0.0, 0.0)
    if m >= 0:
        point = vector(work.markers.r[m])
    a = vector(joints.a[k])
    t = cross(a, sub(origin, point))
    if tree.side[k] == 0:
        t = add(t, vector(joints.t[k]))
    return t, a


@inner
def place_bodies(model, work, tree, joints):
    """Write r, R, u, u_dot of all bodies from d, Q, z_dot, z_ddot of the joints and from modal coordinates."""
    for place in range(tree.order.shape[0]):
        place_body(model, work, tree, joints, tree.order[place])


@loops
def place_body(model, work, tree, joints, i):
    """Write the frame motion of body i; the motion of its parent is known."""
    is_reversed = tree.is_reversed[i] != 0
    r, A, v, omega, a, alpha = end_motion(model, work, tree.near[i], tree.parent[i])
    put(joints.near[i], 0, a)
    put(joints.near[i], 3, alpha)
    put(joints.near[i], 6, v)
    put(joints.near[i], 9, omega)
    Q, sense = matrix(joints.Q[i]), -1.0 if is_reversed else 1.0
    A_far = product(A, transposed(Q)) if is_reversed else product(A, Q)
    A_a, A_b = (A_far, A) if is_reversed else (A, A_far)
    put_columns(tree, joints, i, A_a, A_b)
    D = turned(A_a, vector(joints.d[i]))
    s, w = sums(tree, joints, i, joints.rate)
    s_dot, w_dot = sums(tree, joints, i, joints.acceleration)
    omega_far = add(omega, scaled(sense, w))
    omega_a, omega_b = (omega_far, omega) if is_reversed else (omega, omega_far)
    alpha_far = add(alpha, scaled(sense, add(w_dot, turning_of_columns(tree, joints, i, omega_a, omega_b))))
    moved = add(cross(omega_a, D), s)
    bent = add(cross(alpha_far if is_reversed else alpha, D), add(cross(omega_a, add(moved, s)), s_dot))
    r, v, a = add(r, scaled(sense, D)), add(v, scaled(sense, moved)), add(a, scaled(sense, bent))
    put_body(model, work, tree, i, (r, A_far, v, omega_far, a, alpha_far))


@loops
def put_body(model, work, tree, i, motion):
    """Write the motion of body i from that of its marker at the joint, as `end_motion` returns it."""
    r, A, v, omega, a, alpha = motion
    state, u0, m = work.state, model.bodies.u0[i], tree.far[i]
    u, u_dot = state.u[u0 : u0 + 6], state.u_dot[u0 : u0 + 6]
    if m < 0:
        put(state.r[i], 0, r)
        put_matrix(state.R[i], A)
        put(u, 0, v)
        put(u, 3, turned_back(A, omega))
        put(u_dot, 0, a)
        put(u_dot, 3, turned_back(A, alpha))
        return
    put(work.markers.r[m], 0, r)
    put_matrix(work.markers.A[m], A)
    put(work.markers.v[m], 0, v)
    put(work.markers.omega[m], 0, omega)
    triad = matrix(model.markers.triad[m])
    put(work.markers.rho[m], 0, vector(model.markers.position[m]))
    if model.markers.psi0[m] >= 0:
        elastic_motion(model, work, m, i)
        triad = product(exp_matrix(vector(work.markers.angle[m])), triad)
    R = product(A, transposed(triad))
    rho, rho_dot = vector(work.markers.rho[m]), vector(work.markers.rho_dot[m])
    omega, alpha, a = turned_back(R, omega), turned_back(R, alpha), turned_back(R, a)
    omega, alpha, a = elastic_body_in_joint(model, work, m, omega, alpha, a)
    put(state.r[i], 0, sub(r, turned(R, rho)))
    put_matrix(state.R[i], R)
    put(u, 0, sub(v, turned(R, add(cross(omega, rho), rho_dot))))
    put(u, 3, omega)
    put(u_dot, 0, turned(R, a))
    put(u_dot, 3, alpha)


@inner
def joint_motion(model, work, tree, joints):
    """Write d, Q, z_dot, z_ddot of all joints from the body motion.

    The coordinates fit the motion by least squares; motions that the joints do not allow are ignored.
    """
    for i in range(tree.parent.shape[0]):
        end_a, end_b = joint_ends(model, work, tree, i)
        r_a, A_a, v_a, omega_a, a_a, alpha_a = end_a
        r_b, A_b, v_b, omega_b, a_b, alpha_b = end_b
        D = sub(r_b, r_a)
        put(joints.d[i], 0, turned_back(A_a, D))
        put_matrix(joints.Q[i], product(transposed(A_a), A_b))
        put_columns(tree, joints, i, A_a, A_b)
        slip = sub(sub(v_b, v_a), cross(omega_a, D))
        nearest(tree, joints, i, slip, sub(omega_b, omega_a), joints.rate)
        s, _ = sums(tree, joints, i, joints.rate)
        own = add(cross(alpha_a, D), cross(omega_a, add(cross(omega_a, D), scaled(2.0, s))))
        slip = sub(sub(a_b, a_a), own)
        turning = sub(sub(alpha_b, alpha_a), turning_of_columns(tree, joints, i, omega_a, omega_b))
        nearest(tree, joints, i, slip, turning, joints.acceleration)


@inner
def nearest(tree, joints, i, s, w, out):
    """Solve s = Σ t_k x_k, w = Σ a_k x_k for x_k by least squares; the columns of a joint are orthogonal."""
    for k in range(tree.column0[i], tree.column0[i + 1]):
        t, a = vector(joints.t[k]), vector(joints.a[k])
        out[k] = (dot(t, s) + dot(a, w)) / (dot(t, t) + dot(a, a))


@inner
def move_joints(tree, joints):
    """Write d and Q: their values at the beginning of the step, moved by the increments x."""
    for i in range(tree.parent.shape[0]):
        d, left, right = vector(joints.d_start[i]), (0.0, 0.0, 0.0), (0.0, 0.0, 0.0)
        for k in range(tree.column0[i], tree.column0[i + 1]):
            d = add(d, scaled(joints.x[k], vector(tree.tau[k])))
            turn = scaled(joints.x[k], vector(tree.alpha[k]))
            if tree.side[k] == 0:
                left = add(left, turn)
            else:
                right = add(right, turn)
        put(joints.d[i], 0, d)
        if joints.spins[i] != 0:
            turn_spinning_joint(tree, joints, i)
            continue
        put_matrix(joints.Q[i], product(exp_matrix(left), product(joints.Q_start[i], exp_matrix(right))))
