"""Motion of the bodies from that of the joints, and back (docs/relative.md §3).

With n, f the markers of a joint at parent and body, A, B its ends, D = A_A d, s = Σ t_k z_dot_k, w = Σ a_k z_dot_k and
s', w' the same with z_ddot_k,

    r_B = r_A + D,  A_B = A_A Q            v_B = v_A + omega_A × D + s,  omega_B = omega_A + w
    a_B = a_A + alpha_A × D + omega_A × (omega_A × D + 2 s) + s'
    alpha_B = alpha_A + w' + Σ omega_side × a_k z_dot_k

and from a marker to its body as in `kernels.marker`, solved for the motion of the body. All hold as well with the body
at A. Deformations of both bodies, their rates and accelerations are those of `state.q`, `state.u`, `state.u_dot`.
"""

from floatframe.engine.kernels.compiler.compilation import inner, loops
from floatframe.engine.kernels.marker import elastic_motion, marker_acceleration, marker_motion
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
from floatframe.engine.tree.kernels.elastic_turning import elastic_body_in_joint
from floatframe.engine.tree.kernels.spins import turn_spinning_joint

__all__ = ["column_screw", "end_acceleration", "end_motion", "joint_motion", "move_joints", "place_bodies"]


@loops
def end_motion(model, work, m, i):
    """Return r, A, v, omega of marker m, of the frame of body i if m = -1, and of the ground if i = -1 too."""
    zero = (0.0, 0.0, 0.0)
    if m >= 0:
        marker_motion(model, work, m)
        markers = work.markers
        return vector(markers.r[m]), matrix(markers.A[m]), vector(markers.v[m]), vector(markers.omega[m])
    if i < 0:
        return zero, unit_matrix(), zero, zero
    u, R = work.state.u[model.bodies.u0[i] :], matrix(work.state.R[i])
    return vector(work.state.r[i]), R, vector(u), turned(R, u[3:])


@loops
def end_acceleration(model, work, m, i):
    """Return acceleration and angular acceleration with the conventions of `end_motion`."""
    zero = (0.0, 0.0, 0.0)
    if m >= 0:
        out = work.markers.bias[m]
        marker_acceleration(model, work, m, out)
        return vector(out), vector(out[3:])
    if i < 0:
        return zero, zero
    u_dot = work.state.u_dot[model.bodies.u0[i] :]
    return vector(u_dot), turned(work.state.R[i], u_dot[3:])


@loops
def put_columns(tree, joints, i, A_a, A_b):
    """Write directions of the columns of the joint of body i, ground axes."""
    for k in range(tree.column0[i], tree.column0[i + 1]):
        put(joints.t[k], 0, turned(A_a, tree.tau[k]))
        alpha = vector(tree.alpha[k])
        if tree.side[k] == 0:
            put(joints.a[k], 0, turned(A_a, alpha))
        else:
            put(joints.a[k], 0, turned(A_b, alpha))


@loops
def sums(tree, joints, i, x):
    """Return Σ t_k x_k and Σ a_k x_k of the joint of body i."""
    s, w = (0.0, 0.0, 0.0), (0.0, 0.0, 0.0)
    for k in range(tree.column0[i], tree.column0[i + 1]):
        s = add(s, scaled(x[k], vector(joints.t[k])))
        w = add(w, scaled(x[k], vector(joints.a[k])))
    return s, w


@loops
def turning_of_columns(tree, joints, i, omega_a, omega_b):
    """Return Σ omega_side × a_k z_dot_k."""
    total = (0.0, 0.0, 0.0)
    for k in range(tree.column0[i], tree.column0[i + 1]):
        omega = omega_a if tree.side[k] == 0 else omega_b
        total = add(total, scaled(joints.rate[k], cross(omega, vector(joints.a[k]))))
    return total


@inner
def column_screw(work, tree, joints, i, k, origin):
    """Return translation at a point and rotation for column k of the joint of body i, of B against A, ground axes."""
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
    """Write r, R, u, u_dot of all bodies from d, Q, z_dot, z_ddot of their joints and their modal coordinates."""
    for place in range(tree.order.shape[0]):
        place_body(model, work, tree, joints, tree.order[place])


@loops
def place_body(model, work, tree, joints, i):
    """Write the motion of the frame of body i; that of its parent is known."""
    near, parent = tree.near[i], tree.parent[i]
    r, A, v, omega = end_motion(model, work, near, parent)
    a, alpha = end_acceleration(model, work, near, parent)
    put(joints.near[i], 0, a)
    put(joints.near[i], 3, alpha)
    put(joints.near[i], 6, v)
    put(joints.near[i], 9, omega)
    Q, d = matrix(joints.Q[i]), vector(joints.d[i])
    if tree.is_reversed[i] == 0:
        put_columns(tree, joints, i, A, product(A, Q))
        D = turned(A, d)
        s, w = sums(tree, joints, i, joints.rate)
        s_dot, w_dot = sums(tree, joints, i, joints.acceleration)
        own = add(cross(alpha, D), add(cross(omega, add(cross(omega, D), scaled(2.0, s))), s_dot))
        a = add(a, own)
        v = add(v, add(cross(omega, D), s))
        spin = add(omega, w)
        alpha = add(alpha, add(w_dot, turning_of_columns(tree, joints, i, omega, spin)))
        put_body(model, work, tree, i, add(r, D), product(A, Q), v, spin, a, alpha)
    else:
        A_a = product(A, transposed(Q))
        put_columns(tree, joints, i, A_a, A)
        D = turned(A_a, d)
        s, w = sums(tree, joints, i, joints.rate)
        s_dot, w_dot = sums(tree, joints, i, joints.acceleration)
        spin = sub(omega, w)
        alpha = sub(alpha, add(w_dot, turning_of_columns(tree, joints, i, spin, omega)))
        own = add(cross(alpha, D), add(cross(spin, add(cross(spin, D), scaled(2.0, s))), s_dot))
        a = sub(a, own)
        v = sub(v, add(cross(spin, D), s))
        put_body(model, work, tree, i, sub(r, D), A_a, v, spin, a, alpha)


@loops
def put_body(model, work, tree, i, r, A, v, omega, a, alpha):
    """Write the motion of body i from that of its far marker."""
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
    """Write d, Q, z_dot, z_ddot of all joints from the motion of the bodies.

    Coordinates are those nearest to the motion, so that one that the joints do not allow is left out.
    """
    for i in range(tree.parent.shape[0]):
        near, far, parent = tree.near[i], tree.far[i], tree.parent[i]
        r_a, A_a, v_a, omega_a = end_motion(model, work, near, parent)
        a_a, alpha_a = end_acceleration(model, work, near, parent)
        r_b, A_b, v_b, omega_b = end_motion(model, work, far, i)
        a_b, alpha_b = end_acceleration(model, work, far, i)
        if tree.is_reversed[i] != 0:
            r_a, A_a, v_a, omega_a, r_b, A_b, v_b, omega_b = r_b, A_b, v_b, omega_b, r_a, A_a, v_a, omega_a
            a_a, alpha_a, a_b, alpha_b = a_b, alpha_b, a_a, alpha_a
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
    """Write x_k of s = Σ t_k x_k, w = Σ a_k x_k; columns of a joint are orthogonal."""
    for k in range(tree.column0[i], tree.column0[i + 1]):
        t, a = vector(joints.t[k]), vector(joints.a[k])
        out[k] = (dot(t, s) + dot(a, w)) / (dot(t, t) + dot(a, a))


@inner
def move_joints(tree, joints):
    """Write d and Q: those of the beginning of the step, moved by the increments x."""
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
