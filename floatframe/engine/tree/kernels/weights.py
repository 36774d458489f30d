"""Norms in relative coordinates: of corrections by body motion, of unknowns by the mass that moves.

Corrections are measured by the motion of bodies and modes, as in absolute coordinates, so that a tolerance means the
same: a large rotation of a joint near the root counts as small if the next joints compensate it.
"""

from floatframe.engine.kernels.body import moved_inertia
from floatframe.engine.kernels.compiler.compilation import inner
from floatframe.engine.kernels.vector import (
    add,
    add_block,
    cross,
    dot,
    matrix,
    put,
    put_block,
    put_sum,
    sub,
    turned,
    turned_back,
    vector,
)
from floatframe.engine.tree.kernels.body_jets import moments_of_body
from floatframe.engine.tree.kernels.kinematics import column_screw

__all__ = ["sizes_of_step", "squared_size", "weigh"]


@inner
def weigh(model, work, tree, joints, tangent):
    """Write the norm weights of the unknowns: mass moved by a unit of a coordinate, M + c_k K of a mode.

    Mass m, first moment S and inertia J of subtrees about tangent.origin, ground axes: rows 0, 1 and 3 to 5 of mass.
    """
    mass, origin = tangent.mass, vector(work.state.r[tree.order[0]])
    for i in range(tree.parent.shape[0]):
        m, s, J = moments_of_body(model, work, i, work.state.R[i])
        s, J = moved_inertia(m, s, J, sub(work.state.r[i], origin))
        mass[i, 0, 0] = m
        put(mass[i, 1], 0, s)
        put_block(mass[i], 3, 0, J)
    for place in range(tree.order.shape[0] - 1, -1, -1):
        i = tree.order[place]
        parent = tree.parent[i]
        m, S, J = mass[i, 0, 0], vector(mass[i, 1]), mass[i, 3:]
        for k in range(tree.column0[i], tree.column0[i + 1]):
            if tree.unknown[k] < 0:
                continue
            v, a = column_screw(work, tree, joints, i, k, origin)
            total = m * dot(v, v) + 2.0 * dot(v, cross(a, S)) + dot(a, turned(J, a))
            tangent.weight[tree.unknown[k]] = abs(total)
        if parent >= 0:
            mass[parent, 0, 0] += m
            put_sum(mass[parent, 1], 0, S)
            add_block(mass[parent], 3, 0, matrix(J))
    for i in range(tree.parent.shape[0]):
        for k in range(model.bodies.n_q[i]):
            tangent.weight[tree.m0[i] + k] = work.solver.weight[model.bodies.u0[i] + 6 + k]


@inner
def squared_size(model, work, tree, tangent):
    """Return the squared norm of the correction in tangent.step from body motion; weights of `work.solver`."""
    if tangent.is_exact != 0:
        move_by_screws(work, tree, tangent)
    total, weight, step = 0.0, work.solver.weight, tangent.step
    for i in range(tree.parent.shape[0]):
        u0, X = model.bodies.u0[i], tangent.X[i]
        for k in range(6):
            total += weight[u0 + k] * X[k] * X[k]
        for k in range(model.bodies.n_q[i]):
            x = step[tree.m0[i] + k]
            total += weight[u0 + 6 + k] * x * x
    return total


@inner
def move_by_screws(work, tree, tangent):
    """Write the motion of each body for the correction into tangent.X, in body axes about the body origin.

    tangent.Y is the same motion about the origin that all bodies share.
    """
    for place in range(tree.order.shape[0]):
        i = tree.order[place]
        parent, Y = tree.parent[i], tangent.Y[i]
        for r in range(6):
            Y[r] = tangent.Y[parent, r] if parent >= 0 else 0.0
        for j in range(tree.jet0[i], tree.jet0[i + 1]):
            for r in range(6):
                Y[r] += tangent.screw[j, r] * tangent.step[tree.jet_s[j]]
        R, arm = work.state.R[i], sub(vector(work.state.r[i]), vector(tangent.origin))
        put(tangent.X[i], 0, turned_back(R, add(vector(Y), cross(vector(Y[3:]), arm))))
        put(tangent.X[i], 3, turned_back(R, Y[3:]))


@inner
def sizes_of_step(work, memory, h):
    """Return squared sizes of the iterate's accelerations and of the displacement in a step."""
    size, size_x = 0.0, 0.0
    for k in range(memory.u.shape[0]):
        size += work.solver.weight[k] * work.state.u_dot[k] ** 2
        size_x += work.solver.weight[k] * (h * memory.u[k]) ** 2
    return size, size_x
