"""The compiled entry for the recursive equations, with one plain function for each of its tasks."""

import math
from dataclasses import dataclass, field
from typing import Any, NamedTuple

from fe_models.foundation.arrays import IntArray
from floatframe.engine.kernels.compiler.compilation import entry, inner, loops, small
from floatframe.engine.kernels.compiler.structure import converter
from floatframe.engine.kernels.marker import elastic_motion
from floatframe.engine.kernels.model import Model
from floatframe.engine.kernels.records import integer, tabled, zeros
from floatframe.engine.kernels.rotation import exp_matrix, matrix_of_euler_parameters
from floatframe.engine.kernels.vector import (
    add,
    matrix,
    product,
    put,
    put_matrix,
    scaled,
    sub,
    transposed,
    turned,
    unit_matrix,
    vector,
)
from floatframe.engine.kernels.work import Work
from floatframe.engine.tree.recursion.articulated import articulate, solve_articulated, solve_columns
from floatframe.engine.tree.recursion.columns import motion_in_ground, rate_columns
from floatframe.engine.tree.recursion.composite import evaluate_flexible, mass_matrix
from floatframe.engine.tree.recursion.newton_euler import newton_euler
from floatframe.engine.tree.recursion.nodes import ROTATION, SCREW, TRANSLATION, Dense, Nodes, NodeWork
from floatframe.engine.tree.recursion.tangents import force_tangents

__all__ = [
    "FORWARD",
    "INVERSE",
    "MASS",
    "PLACE",
    "SOLVE",
    "TANGENTS",
    "Prepared",
    "Task",
    "own_marker",
    "place_in_ground",
    "place_in_parent",
    "set_modes",
]


# poses of nodes in their parents and in the ground (docs/recursive.md §1) --------------------------------
# R, p are the outer frame of a joint in the frame of the parent; this is also the frame of a rigid body. If the parent
# is rigid,
#
#     R = A E,  p = r + A d        with A, r of the joint in the parent and E, d of the joint alone
#
# An elastic parent moves A and r with its modes: A = exp(th) A, r = rho. The own marker of an elastic body, with the
# axes R_own = exp(th) F at rho, coincides with the outer frame of its joint. So the axes of the body are R R_ownᵀ, and
# its origin is p - R R_ownᵀ rho.


@inner
def set_modes(nodes, work, state):
    """Copy modal coordinates and their rates from positions and rates."""
    for k in range(nodes.parent.shape[0]):
        for j in range(nodes.n_q[k]):
            state.q[nodes.q0[k] + j] = work.x[nodes.xq[k] + j]
            state.u[nodes.u0[k] + 6 + j] = work.v[nodes.vq[k] + j]
            state.u_dot[nodes.u0[k] + 6 + j] = work.a[nodes.vq[k] + j]


@inner
def own_marker(model, marker_work, m):
    """Write a marker's motion in its flexible body; return its rotation relative to the undeformed marker."""
    work = marker_work.markers
    put(work.rho[m], 0, vector(model.markers.position[m]))
    if model.markers.psi0[m] < 0:
        return unit_matrix()
    elastic_motion(model, marker_work, m, model.markers.body[m])
    return exp_matrix(vector(work.angle[m]))


@small
def joint_rotation(nodes, work, k, A):
    """Return A E, the inner frame rotated by the joint of node k."""
    kind = nodes.kind[k]
    if kind == SCREW:
        turn = nodes.turn[k]
        if turn != 0.0:
            angle = turn * work.x[nodes.x0[k]]
            c, s = math.cos(angle), math.sin(angle)
            return (
                (c * A[0][0] + s * A[0][1], c * A[0][1] - s * A[0][0], A[0][2]),
                (c * A[1][0] + s * A[1][1], c * A[1][1] - s * A[1][0], A[1][2]),
                (c * A[2][0] + s * A[2][1], c * A[2][1] - s * A[2][0], A[2][2]),
            )
    elif kind == ROTATION:
        E = matrix_of_euler_parameters(work.x[nodes.x0[k] :])
        if nodes.is_near[k]:
            E = transposed(E)
        return product(A, E)
    return A


@small
def joint_distance(nodes, work, k):
    """Return the vector d of the joint of node k, inner frame."""
    kind = nodes.kind[k]
    if kind == SCREW:
        return 0.0, 0.0, nodes.slide[k] * work.x[nodes.x0[k]]
    if kind == TRANSLATION:
        return scaled(nodes.slide[k], vector(work.x[nodes.x0[k] :]))
    return 0.0, 0.0, 0.0


@loops
def place_in_parent(nodes, work, model, marker_work):
    """Write R, p of all nodes relative to their parents, and the markers of flexible bodies."""
    for k in range(nodes.parent.shape[0]):
        m = nodes.above[k]
        if m >= 0:
            put_matrix(work.A[k], product(own_marker(model, marker_work, m), nodes.A[k]))
            put(work.rho[k], 0, vector(marker_work.markers.rho[m]))
        A = matrix(work.A[k])
        R, p = joint_rotation(nodes, work, k, A), vector(work.rho[k])
        if nodes.kind[k] == TRANSLATION or nodes.slide[k] != 0.0:
            p = add(p, turned(A, joint_distance(nodes, work, k)))
        if nodes.n_q[k] > 0 and nodes.own[k] >= 0:
            m = nodes.own[k]
            own = product(own_marker(model, marker_work, m), nodes.F[k])
            put_matrix(work.R_own[k], own)
        put_matrix(work.R[k], R)
        put(work.p[k], 0, p)


@loops
def place_in_ground(nodes, work, marker_work):
    """Write R_G, r_G of all nodes, which are already placed relative to their parents."""
    for k in range(nodes.parent.shape[0]):
        above, m = nodes.parent[k], nodes.own[k]
        R, r = matrix(work.R[k]), vector(work.p[k])
        if above >= 0:
            R_P = matrix(work.R_G[above])
            R, r = product(R_P, R), add(vector(work.r_G[above]), turned(R_P, r))
        if m >= 0:
            R = product(R, transposed(work.R_own[k]))
            r = sub(r, turned(R, vector(marker_work.markers.rho[m])))
        put_matrix(work.R_G[k], R)
        put(work.r_G[k], 0, r)


# entry ----------------------------------------------------------------------------------------------------------------


PLACE, INVERSE, MASS, FORWARD, SOLVE, TANGENTS = range(6)  #: values of `Task.what`


@tabled
class Task(NamedTuple):
    """A request to the entry."""

    what: IntArray = integer()
    times: IntArray = integer()  #: number of repetitions, used in measurements


as_nodes, as_node_work, as_model = converter(Nodes()), converter(NodeWork()), converter(Model())
as_work, as_task, as_dense = converter(Work()), converter(Task()), converter(Dense())


@entry
def run(nodes_table, work_table, dense_table, model_table, marker_table, task_table):
    """Carry out a request; the arguments are the tables of the records."""
    nodes, work, dense = as_nodes(nodes_table), as_node_work(work_table), as_dense(dense_table)
    model, marker_work, task = as_model(model_table), as_work(marker_table), as_task(task_table)
    for _ in range(task.times):
        what = task.what
        if what == FORWARD:
            work.a[:] = 0.0
        set_modes(nodes, work, marker_work.state)
        place_in_parent(nodes, work, model, marker_work)
        if what == INVERSE:
            newton_euler(nodes, work, model, marker_work)
        else:
            if what == FORWARD or what == TANGENTS:
                newton_euler(nodes, work, model, marker_work)
                for j in range(work.right.shape[0]):
                    work.right[j] = work.force_given[j] - work.force[j]
            elif what == MASS or what == SOLVE:
                evaluate_flexible(nodes, model, marker_work)
            place_in_ground(nodes, work, marker_work)
            rate_columns(nodes, work, model, marker_work)
            if what == PLACE:
                motion_in_ground(nodes, work)
            elif what == TANGENTS:
                motion_in_ground(nodes, work)
                mass_matrix(nodes, work, dense.M, model, marker_work)
                force_tangents(nodes, work, dense, model, marker_work)
            elif what == MASS:
                mass_matrix(nodes, work, dense.M, model, marker_work)
            else:
                singular = articulate(nodes, work, model, marker_work)
                if singular >= 0:
                    return singular
                if what == FORWARD:
                    solve_articulated(nodes, work)
                else:
                    solve_columns(nodes, work, dense.columns)
    return -1


@dataclass(frozen=True, eq=False)
class Prepared:
    """The model and working records of a tree."""

    nodes: Nodes
    work: NodeWork
    model: Model
    marker_work: Work
    task: Task = field(default_factory=lambda: zeros(Task(), {}))

    def run(self, what: int, dense: Dense, times: int = 1) -> int:
        """Carry out a task with the numbers in the records; return -1, or the node with a singular matrix."""
        self.task.what[...] = what
        self.task.times[...] = times
        records: Any = (self.nodes, self.work, dense, self.model, self.marker_work, self.task)
        return int(run(*(record.table for record in records)))
