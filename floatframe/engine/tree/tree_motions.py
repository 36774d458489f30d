"""Joint motions at a state, and body motions for unit tree coordinates (docs/relative.md §2, §3)."""

import numpy as np

from fe_models.foundation.arrays import Array
from floatframe.engine.compiling.system import CompiledSystem
from floatframe.engine.kernels.work import Work, new_work
from floatframe.engine.tree.kernels.tree import JointWork, Tree, new_joint_work
from floatframe.model.rotations import rotation_matrix
from floatframe.model.state import State

__all__ = ["coordinate_motions", "joint_iterate"]


def joint_iterate(
    compiled: CompiledSystem, tree: Tree, state: State, u_dot: Array | None = None
) -> tuple[Work, JointWork]:
    """Return working arrays with the joint motion that is nearest to a state of the engine."""
    from floatframe.engine.tree.kernels.entry import motion_of_joints

    work, joints = new_work(compiled.model), new_joint_work(compiled.model, tree)
    work.state.r[:], work.state.R[:], work.state.q[:] = state.r, rotation_matrix(state.p), state.q
    work.state.u[:], work.state.u_dot[:] = state.u, 0.0 if u_dot is None else u_dot
    motion_of_joints(compiled.model, work, tree, joints)
    return work, joints


def coordinate_motions(compiled: CompiledSystem, tree: Tree, state: State) -> Array:
    """Return N_s, (n_u, n_s), the body motions for each unknown coordinate, in body axes of the engine."""
    from floatframe.engine.tree.kernels.entry import motion_of_bodies

    model = compiled.model
    work, joints = joint_iterate(compiled, tree, state)
    joints.rate[:] = 0.0
    N = np.zeros((len(state.u), len(tree.slot)))
    for k, (column, slot) in enumerate(zip(tree.column, tree.slot, strict=True)):
        work.state.u[:] = 0.0
        rates = joints.rate if column >= 0 else work.state.u
        place = column if column >= 0 else slot
        rates[place] = 1.0
        motion_of_bodies(model, work, tree, joints)
        N[:, k] = work.state.u
        rates[place] = 0.0
    for u0, axes in zip(model.bodies.u0[:-1], rotation_matrix(state.p), strict=True):
        N[u0 : u0 + 3] = axes.T @ N[u0 : u0 + 3]
    return N
