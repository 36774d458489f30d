"""Evaluation of a system in relative coordinates at one iterate: body motion, residuals, projection."""

from floatframe.engine.kernels.compiler.compilation import inner
from floatframe.engine.kernels.connections.connection import connection_rows
from floatframe.engine.kernels.evaluation import evaluate_bodies, evaluate_markers, slide_markers
from floatframe.engine.kernels.marker import marker_motion
from floatframe.engine.kernels.vector import copy
from floatframe.engine.tree.kernels.projection import project

__all__ = ["evaluate_placed", "evaluate_tree"]


@inner
def evaluate_tree(model, work, tree, joints, c_k):
    """Write residuals of bodies and rows, wrenches of the tree joints, and the projected residual.

    Like `kernels.evaluation.evaluate`, but the rows of the tree joints are zero. `joints.own` contains the residuals of
    the bodies without these joints.
    """
    evaluate_markers(model, work)
    project_residuals(model, work, tree, joints, c_k)


@inner
def evaluate_placed(model, work, tree, joints, c_k):
    """Write the results of `evaluate_tree` after `place_bodies`, which has computed the ends of the tree joints."""
    for m in range(model.markers.body.shape[0]):
        c, i = model.markers.connection[m], model.markers.body[m]
        if c < 0 or tree.is_kept[c] != 0 or i < 0:
            marker_motion(model, work, m)
    slide_markers(model, work)
    project_residuals(model, work, tree, joints, c_k)


@inner
def project_residuals(model, work, tree, joints, c_k):
    """Write the results of `evaluate_tree`, with the motion of all markers already in `work`."""
    for c in range(model.connections.size.shape[0]):
        if tree.is_kept[c] != 0:
            connection_rows(model, work, c, c_k)
        else:
            work.connections.g[model.connections.w0[c] : model.connections.w0[c + 1]] = 0.0
    evaluate_bodies(model, work)
    copy(work.bodies.residual, joints.own)
    project(model, work, tree, joints)
