"""Steps towards an equilibrium in the coordinates of joints and modes, for `analyses.equilibrium`.

In the place of (2) there, with the tree of the system and the wrenches w of what closes its loops (docs/relative.md §5):

    (2) (M/tau + K) ds + B dw = -rho,   C ds + V dw = -g

where K is the Newton matrix with c_k alone: rates of joints stay as they are, so that it holds in a steady rotation
too. Reactions of joints of the tree follow from what hangs at them; along a coordinate they are changed to what
springs, motors and friction give there, so that what is left over stands as a force out of balance at the bodies.
"""

from dataclasses import dataclass, replace

import numpy as np

from fe_models.foundation.arrays import Array
from floatframe.compiling.system import compiled_system
from floatframe.errors import ModelError
from floatframe.joints.rows import is_held
from floatframe.kernels.model import Model
from floatframe.kernels.work import Work
from floatframe.relative.kernels.tree import JointWork, Tree, new_joint_work
from floatframe.relative.topology import tree_of
from floatframe.rotations import euler_parameters
from floatframe.start.newton_equations import linearized, set_iterate
from floatframe.state import State
from floatframe.system import System

__all__ = ["TreeFlow", "tree_flow"]


@dataclass(frozen=True, eq=False)
class TreeFlow:
    """A system on its way to an equilibrium along its coordinates; working arrays are those of the caller."""

    model: Model  #: with what elements say of equilibrium
    tree: Tree
    joints: JointWork

    def wrenches(self, work: Work, state: State, u_dot: Array, w: Array) -> Array:
        """Return w with the reactions of the joints of the tree at a motion, (n_w,); arrays end at that iterate."""
        from floatframe.relative.kernels.entry import projected

        set_iterate(work, state, u_dot, w)
        projected(self.model, work, self.tree, self.placed(work))
        w = work.state.w.copy()
        set_iterate(work, state, u_dot, w)
        linearized(self.model, work, 0.0, 0.0, 1.0)
        says = ~is_held(self.model.rows.kind)
        for c in np.unique(self.tree.joint[self.tree.joint >= 0]):
            first, size = int(self.model.connections.w0[c]), int(self.model.connections.size[c])
            own = np.flatnonzero(says[first : first + size])
            V, g = work.connections.V[c, own, :size], work.connections.g[first + own]
            w[first : first + size] -= np.linalg.lstsq(V, g, rcond=None)[0]
        set_iterate(work, state, u_dot, w)
        return w

    def placed(self, work: Work) -> JointWork:
        """Return the joints as the iterate in `work` has them, increments counted from there."""
        from floatframe.relative.kernels.entry import motion_of_joints

        joints = self.joints
        motion_of_joints(self.model, work, self.tree, joints)
        joints.d_start[:], joints.Q_start[:], joints.x[:] = joints.d, joints.Q, 0.0
        return joints

    def step(self, work: Work, state: State, u_dot: Array, w: Array, tau: float) -> tuple[Array, Array, Array]:
        """(2): return the changes of coordinates, (n_s,), of bodies, ground axes, (n_u,), and of wrenches, (n_w,)."""
        from floatframe.relative.kernels.entry import motion_of_bodies, newton_step

        set_iterate(work, state, u_dot, w)
        joints = self.placed(work)
        ds, mu = newton_step(self.model, work, self.tree, joints, 1 / tau, 0.0, 1.0)
        dw = np.zeros(len(w))
        dw[self.tree.kept_row >= 0] = mu
        is_mode = self.tree.mode >= 0
        joints.rate[:], joints.acceleration[:], work.state.u[:] = 0.0, 0.0, 0.0
        joints.rate[self.tree.column[~is_mode]] = ds[~is_mode]
        work.state.u[self.tree.slot[is_mode]] = ds[is_mode]
        motion_of_bodies(self.model, work, self.tree, joints)
        return ds, work.state.u.copy(), dw

    def displaced(self, work: Work, state: State, ds: Array) -> State:
        """Return the state moved by ds along the coordinates, (n_s,)."""
        from floatframe.relative.kernels.entry import moved

        set_iterate(work, state)
        joints, is_mode = self.placed(work), self.tree.mode >= 0
        x = np.zeros(len(joints.x))
        x[self.tree.column[~is_mode]] = ds[~is_mode]
        work.state.q[self.tree.mode[is_mode]] += ds[is_mode]
        moved(self.model, work, self.tree, joints, x)
        p = np.array([euler_parameters(R) for R in work.state.R]).reshape(-1, 4)
        p = np.where((p * state.p).sum(axis=1, keepdims=True) < 0, -p, p)
        return replace(state, r=work.state.r.copy(), p=p, q=work.state.q.copy())


def tree_flow(system: System, omega: Array) -> TreeFlow:
    """Return the way to an equilibrium at rest, or in a steady rotation with omega, (3,), of a system.

    Raises
    ------
    ModelError
        If a body that hangs at nothing should rotate steadily: its coordinates do not stay as they are then.
    """
    compiled, tree = compiled_system(system), tree_of(system).tree
    free = np.flatnonzero(tree.joint < 0)
    if omega.any() and len(free):
        raise ModelError(
            f"steady_rotation: body {compiled.body_names[free[0]]!r} hangs at no joint, so that its coordinates do not "
            'stay as they are in a steady rotation; take formulation = "absolute"'
        )
    model = compiled.resting_model
    return TreeFlow(model, tree, new_joint_work(model, tree))
