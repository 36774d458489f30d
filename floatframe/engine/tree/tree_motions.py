"""Body motions for unit tree coordinates, which keep tree joints closed (docs/relative.md §2, §3)."""

import numpy as np

from fe_models.foundation.arrays import Array
from floatframe.engine.compiling.system import CompiledSystem
from floatframe.engine.kernels.work import new_work
from floatframe.engine.tree.kernels.tree import Tree, new_joint_work
from floatframe.model.rotations import rotation_matrix
from floatframe.model.state import State

__all__ = ["coordinate_motions"]


def coordinate_motions(compiled: CompiledSystem, tree: Tree, state: State) -> Array:
    """Return N_s, (n_u, n_s), the body motions for each unknown coordinate, in body axes of the engine."""
    from floatframe.engine.tree.kernels.entry import motion_of_bodies, motion_of_joints

    model = compiled.model
    work, joints = new_work(model), new_joint_work(model, tree)
    R = rotation_matrix(state.p)
    work.state.r[:], work.state.R[:], work.state.q[:] = state.r, R, state.q
    motion_of_joints(model, work, tree, joints)
    N = np.zeros((len(state.u), len(tree.slot)))
    for k, (column, slot) in enumerate(zip(tree.column, tree.slot, strict=True)):
        work.state.u[:] = 0.0
        rates = joints.rate if column >= 0 else work.state.u
        place = column if column >= 0 else slot
        rates[place] = 1.0
        motion_of_bodies(model, work, tree, joints)
        N[:, k] = work.state.u
        rates[place] = 0.0
    for u0, axes in zip(model.bodies.u0[:-1], R, strict=True):
        N[u0 : u0 + 3] = axes.T @ N[u0 : u0 + 3]
    return N
