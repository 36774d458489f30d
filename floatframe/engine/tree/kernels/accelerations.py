"""Accelerations and reactions of a system in relative coordinates from its positions and rates (docs/relative.md §7).

    M s_ddot + B w = -rho(s_ddot = 0, w = 0)        C s_ddot = -(second rates of the constraints, at s_ddot = 0)

with the matrices of `kernels.tangent` for the weights (1, 0, 0). Rows that define a wrench have V w = -g.

Described in `floatframe.integrators.relative_ode`.
"""

from floatframe.engine.kernels.body import NewtonWeights
from floatframe.engine.kernels.compiler.compilation import inner
from floatframe.engine.kernels.connections.connection import connection_rates
from floatframe.engine.kernels.marker_acceleration import marker_acceleration
from floatframe.engine.tree.kernels.evaluation import evaluate_tree
from floatframe.engine.tree.kernels.kinematics import move_joints, place_bodies
from floatframe.engine.tree.kernels.tangent import write_tangent
from floatframe.engine.tree.kernels.tree_factors import factorize_tree, solve_bordered
from floatframe.model.joints.rows.kinds import NOTHING

__all__ = ["accelerate", "constrain"]


@inner
def constrain(model, work, tree, joints, tangent, is_group):
    """Write constraints, their rates and the Jacobian C for increments x if is_group, otherwise for rates."""
    move_joints(tree, joints)
    place_bodies(model, work, tree, joints)
    evaluate_tree(model, work, tree, joints, 1.0)
    if not is_group:
        joints.x[:] = 0.0
    write_tangent(model, work, tree, joints, tangent, NewtonWeights(1.0, 0.0, 0.0))
    kept_rates(model, work, tree)


@inner
def kept_rates(model, work, tree):
    """Write rates and second rates of the constraints outside the tree, for the accelerations of the iterate."""
    for m in range(model.markers.body.shape[0]):
        marker_acceleration(model, work, m, work.markers.bias[m])
    for e in range(tree.kept.shape[0]):
        connection_rates(model, work, tree.kept[e])


@inner
def accelerate(model, work, tree, joints, tangent):
    """Compute accelerations and all wrenches from positions and rates; return whether they exist."""
    for s in range(tree.slot.shape[0]):
        if tree.column[s] >= 0:
            joints.acceleration[tree.column[s]] = 0.0
        else:
            work.state.u_dot[tree.slot[s]] = 0.0
    constrain(model, work, tree, joints, tangent, False)
    if not factorize_tree(model, work, tree, tangent, 0.0, 0.0):
        return False
    for s in range(tree.slot.shape[0]):
        tangent.step[s] = -joints.residual[s]
    for k in range(tree.kept_row.shape[0]):
        if tree.kept_row[k] >= 0:
            value = work.connections.g[k] if model.rows.holds[k] == NOTHING else work.connections.bias[k]
            tangent.mu[tree.kept_row[k]] = -value
    solve_bordered(tree, tangent)
    for s in range(tree.slot.shape[0]):
        if tree.column[s] >= 0:
            joints.acceleration[tree.column[s]] = tangent.step[s]
        else:
            work.state.u_dot[tree.slot[s]] = tangent.step[s]
    for k in range(tree.kept_row.shape[0]):
        if tree.kept_row[k] >= 0:
            work.state.w[k] += tangent.mu[tree.kept_row[k]]
    place_bodies(model, work, tree, joints)
    return True
