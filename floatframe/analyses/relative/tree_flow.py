"""Steps towards an equilibrium in the coordinates of joints and modes, for `analyses.equilibrium`.

In the place of (2) there, with the tree of the system and the wrenches w of what closes loops (docs/relative.md §5):

    (2) (M/tau + K) ds + B dw = -rho,   C ds + V dw = -g

where K is the Newton matrix with c_k alone: rates of joints stay as they are. In a steady rotation those of joints at
the ground may change with their coordinates (a body on a ball, or at nothing): ds_dot = S ds, ds_ddot = S' ds, by
differences, and K + C S + M S' stands for K, where C and M are the Newton matrices of rates and accelerations.

Reactions of joints of the tree follow from what hangs at them; along a coordinate they are changed to what springs,
motors and friction give there, so that what is left over stands as a force out of balance at the bodies.
"""

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from fe_models.foundation.arrays import Array, IntArray
from floatframe.engine.compiling.system import compiled_system
from floatframe.engine.initial_conditions.newton_equations import linearized, set_iterate
from floatframe.engine.kernels.model import Model
from floatframe.engine.kernels.work import Work
from floatframe.engine.tree.kernels.tree import JointWork, Tree, new_joint_work
from floatframe.engine.tree.topology import tree_of
from floatframe.model.joints.rows import is_held
from floatframe.model.rotations import euler_parameters
from floatframe.model.state import State
from floatframe.model.system import System

__all__ = ["TreeFlow", "tree_flow"]

NEAR_BY = 1e-6  #: rad, or part of the size of the system, of the differences for S

Turning = Callable[[State], tuple[State, Array]]  #: a state to that with the velocities of the rotation, and its u_dot


@dataclass(frozen=True, eq=False)
class TreeFlow:
    """A system on its way to an equilibrium along its coordinates; working arrays are those of the caller."""

    model: Model  #: with what elements say of equilibrium
    tree: Tree
    joints: JointWork
    turning: Turning
    length: float  #: size of the system
    at_ground: IntArray  #: coordinates of joints at the ground whose rates may change in a steady rotation

    def wrenches(self, work: Work, state: State, u_dot: Array, w: Array) -> Array:
        """Return w with the reactions of the joints of the tree at a motion, (n_w,); arrays end at that iterate."""
        from floatframe.engine.tree.kernels.entry import projected

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
        from floatframe.engine.tree.kernels.entry import motion_of_joints

        joints = self.joints
        motion_of_joints(self.model, work, self.tree, joints)
        joints.d_start[:], joints.Q_start[:], joints.x[:] = joints.d, joints.Q, 0.0
        return joints

    def step(self, work: Work, state: State, u_dot: Array, w: Array, tau: float) -> tuple[Array, Array, Array]:
        """(2): return the changes of coordinates, (n_s,), of bodies, ground axes, (n_u,), and of wrenches, (n_w,)."""
        from floatframe.engine.tree.kernels.entry import motion_of_bodies, newton_step

        slopes = self.slopes(work, state)
        set_iterate(work, state, u_dot, w)
        joints = self.placed(work)
        if slopes is None:
            ds, mu = newton_step(self.model, work, self.tree, joints, 1 / tau, 0.0, 1.0)
        else:
            ds, mu = self.turning_step(work, tau, *slopes)
        dw = np.zeros(len(w))
        dw[self.tree.kept_row >= 0] = mu
        is_mode = self.tree.mode >= 0
        joints.rate[:], joints.acceleration[:], work.state.u[:] = 0.0, 0.0, 0.0
        joints.rate[self.tree.column[~is_mode]] = ds[~is_mode]
        work.state.u[self.tree.slot[is_mode]] = ds[is_mode]
        motion_of_bodies(self.model, work, self.tree, joints)
        return ds, work.state.u.copy(), dw

    def slopes(self, work: Work, state: State) -> tuple[Array, Array] | None:
        """Return S and S', (n_s, n_s), of a steady rotation at a state; None where rates of joints stay."""
        if not len(self.at_ground):
            return None
        n_s, columns = len(self.tree.slot), self.tree.column
        size = np.where(np.abs(self.tree.tau).any(axis=1), NEAR_BY * self.length, NEAR_BY)
        S = np.zeros((2, n_s, n_s))
        free = columns >= 0
        for s in self.at_ground:
            h = size[columns[s]]
            ends = []
            for sign in (1.0, -1.0):
                turned, u_dot = self.turning(self.displaced(work, state, sign * h * np.eye(n_s)[s]))
                set_iterate(work, turned, u_dot)
                joints = self.placed(work)
                ends.append(np.array([joints.rate[columns[free]], joints.acceleration[columns[free]]]))
            S[:, free, s] = (ends[0] - ends[1]) / (2 * h)
        return S[0], S[1]

    def turning_step(self, work: Work, tau: float, S: Array, S_dot: Array) -> tuple[Array, Array]:
        """Return the changes of coordinates and kept wrenches in a steady rotation, by dense matrices."""
        from floatframe.engine.tree.kernels.entry import newton_matrix

        n_s = len(S)
        K, CK, M = (
            newton_matrix(self.model, work, self.tree, self.joints, *weights)
            for weights in ((0.0, 0.0, 1.0), (0.0, 1.0, 1.0), (1.0, 0.0, 0.0))
        )
        right = -np.concatenate([self.joints.residual, work.connections.g[self.tree.kept_row >= 0]])
        K[:, :n_s] += (CK - K)[:, :n_s] @ S + M[:, :n_s] @ S_dot
        K[:n_s, :n_s] += M[:n_s, :n_s] / tau
        try:
            solution = np.linalg.solve(K, right)
        except np.linalg.LinAlgError:
            solution = np.full(len(right), np.nan)
        return solution[:n_s], solution[n_s:]

    def displaced(self, work: Work, state: State, ds: Array) -> State:
        """Return the state moved by ds along the coordinates, (n_s,)."""
        from floatframe.engine.tree.kernels.entry import moved

        set_iterate(work, state)
        joints, is_mode = self.placed(work), self.tree.mode >= 0
        x = np.zeros(len(joints.x))
        x[self.tree.column[~is_mode]] = ds[~is_mode]
        work.state.q[self.tree.mode[is_mode]] += ds[is_mode]
        moved(self.model, work, self.tree, joints, x)
        p = np.array([euler_parameters(R) for R in work.state.R]).reshape(-1, 4)
        p = np.where((p * state.p).sum(axis=1, keepdims=True) < 0, -p, p)
        return replace(state, r=work.state.r.copy(), p=p, q=work.state.q.copy())


def tree_flow(system: System, turning: Turning, *, rests: bool) -> TreeFlow:
    """Return the way to an equilibrium at rest, or in a steady rotation, of a system."""
    compiled, tree = compiled_system(system), tree_of(system).tree
    model, roots = compiled.resting_model, np.flatnonzero((tree.parent < 0) & (np.diff(tree.column0) > 1))
    several = [s for i in roots for s in range(tree.s0[i], tree.m0[i])]  # one column turns or slides at its own rate
    at_ground = np.array([] if rests else several, dtype=np.int64)
    return TreeFlow(model, tree, new_joint_work(model, tree), turning, compiled.length, at_ground)
