"""Projection of residuals onto the tree: joint reactions, equations of coordinates and modes.

From the leaves inwards, the wrench of a joint on its body balances the residual of the body and its subtree, and acts
on the parent with the opposite sign. Its component along a coordinate, minus the force Q that acts there, is the
equation of the coordinate. The remaining modal residuals are the equations of the modes (docs/relative.md §4).
"""

from floatframe.engine.kernels.compiler.compilation import inner
from floatframe.engine.kernels.joints.coordinate_force import coordinate_force
from floatframe.engine.kernels.joints.relative_motion import distance, loaded_coordinate
from floatframe.engine.kernels.marker import wrench_to_body
from floatframe.engine.kernels.vector import add, cross, dot, put, scaled, sub, turned, vector
from floatframe.model.joints.rows.kinds import PUSH

__all__ = ["project", "put_reactions", "subtract_slopes"]


@inner
def project(model, work, tree, joints):
    """Write the wrenches of all tree joints on their markers B, and the projected residual.

    Before, `work.bodies.residual` contains the residual of the bodies without the tree joints; afterwards only modal
    parts remain.
    """
    n_b = tree.order.shape[0]
    for place in range(n_b - 1, -1, -1):
        i = tree.order[place]
        near, far, parent, u0 = tree.near[i], tree.far[i], tree.parent[i], model.bodies.u0[i]
        residual, R = work.bodies.residual[u0 : u0 + 6 + model.bodies.n_q[i]], work.state.R[i]
        F, N = turned(R, residual), turned(R, residual[3:])
        wrench = work.markers.wrench
        if far < 0:
            put(residual, 0, (0.0, 0.0, 0.0))
            put(residual, 3, (0.0, 0.0, 0.0))
        else:
            N = sub(N, cross(turned(R, vector(work.markers.rho[far])), F))
            put(wrench[far], 0, F)
            put(wrench[far], 3, N)
            wrench_to_body(model, work, far)
            D = distance(work.markers, near, far)
            back = scaled(-1.0, add(N, cross(D, F)))
            put(wrench[near], 0, scaled(-1.0, F))
            put(wrench[near], 3, back)
            if parent >= 0:
                wrench_to_body(model, work, near)
            if tree.is_reversed[i] != 0:
                F, N = scaled(-1.0, F), back
        put(joints.force[i], 0, F)
        put(joints.force[i], 3, N)
        for k in range(tree.column0[i], tree.column0[i + 1]):
            if tree.unknown[k] >= 0:
                total = dot(vector(joints.t[k]), F) + dot(vector(joints.a[k]), N)
                joints.residual[tree.unknown[k]] = total - force_along(model, work, tree, i, k)
        for k in range(model.bodies.n_q[i]):
            joints.residual[tree.m0[i] + k] = residual[6 + k]


@inner
def force_along(model, work, tree, i, k):
    """Return the force of springs, dampers, motors and friction along joint column k of body i."""
    row = tree.row[k]
    if row < 0:
        return 0.0
    Q, _, _ = force_slopes(model, work, tree, i, row)
    return Q


@inner
def force_slopes(model, work, tree, i, row):
    """Return the force along a row's coordinate, and its derivatives by coordinate and rate."""
    c = tree.joint[i]
    a, b = model.connections.a[c], model.connections.b[c]
    x, v = loaded_coordinate(model.rows, work.markers, row, a, b)
    Q, Q_x, Q_v, _ = coordinate_force(model, work, row, model.rows.kind[row] != PUSH, x, v, 0.0)
    return Q, Q_x, Q_v


@inner
def subtract_slopes(model, work, tree, i, K, shift, c_d, c_k):
    """Subtract derivatives of forces along joint coordinates of body i; shift: offset from unknowns to rows."""
    for k in range(tree.column0[i], tree.column0[i + 1]):
        s = tree.unknown[k]
        if s >= 0 and tree.row[k] >= 0:
            _, Q_x, Q_v = force_slopes(model, work, tree, i, tree.row[k])
            K[s + shift, s + shift] -= c_k * Q_x + c_d * Q_v


@inner
def put_reactions(model, work, tree, joints):
    """Write the wrenches of the tree joints into state.w as in their rows: F and M act on A, -N acts on B."""
    for i in range(tree.parent.shape[0]):
        c = tree.joint[i]
        if c < 0:
            continue
        a, b, w = model.connections.a[c], model.connections.b[c], work.state.w[model.connections.w0[c] :]
        F, N = scaled(-1.0, vector(joints.force[i])), scaled(-1.0, vector(joints.force[i, 3:]))
        put(w, 0, F)
        of_a, of_b = model.markers.moment[a], model.markers.moment[b]
        if of_b >= 0:
            put(w, of_b, N)
        if of_a >= 0 and of_a != of_b:
            D = distance(work.markers, a, b)
            put(w, of_a, add(N, cross(D, F)))
