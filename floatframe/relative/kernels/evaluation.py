"""Evaluation of a system in relative coordinates at one iterate: motion of bodies, their residuals, projection."""

from floatframe.kernels.body import body_forces
from floatframe.kernels.compiler.compilation import inner
from floatframe.kernels.connections.connection import connection_rows
from floatframe.kernels.evaluation import body_load, load_wrench
from floatframe.kernels.joints.deformed_line import slide_marker
from floatframe.kernels.marker import marker_motion, wrench_to_body
from floatframe.relative.kernels.projection import project

__all__ = ["evaluate_bodies", "evaluate_tree"]


@inner
def evaluate_bodies(model, work, tree, joints, c_k):
    """Write the residuals of bodies and of the rows that stay, for the iterate in `work`, without joints of the tree.

    As `kernels.evaluation.evaluate`; rows of joints of the tree are zero.
    """
    for m in range(model.markers.body.shape[0]):
        marker_motion(model, work, m)
        for k in range(6):
            work.markers.wrench[m, k] = 0.0
    for k in range(model.lines.marker.shape[0]):
        slide_marker(model, work, k)
    for c in range(model.connections.size.shape[0]):
        if tree.is_kept[c] != 0:
            connection_rows(model, work, c, c_k)
        else:
            for k in range(model.connections.w0[c], model.connections.w0[c + 1]):
                work.connections.g[k] = 0.0
    for k in range(model.loads.marker.shape[0]):
        load_wrench(model, work, k)
    for i in range(model.bodies.kind.shape[0]):
        body_forces(model, work, i)
    for m in range(model.markers.body.shape[0]):
        wrench_to_body(model, work, m)
    for d in range(model.body_loads.body.shape[0]):
        body_load(model, work, d)
    for k in range(joints.own.shape[0]):
        joints.own[k] = work.bodies.residual[k]
    work.counted.evaluations += 1


@inner
def evaluate_tree(model, work, tree, joints, c_k):
    """Write residuals of bodies and rows, wrenches of the joints of the tree, and the projected residual."""
    evaluate_bodies(model, work, tree, joints, c_k)
    project(model, work, tree, joints)
