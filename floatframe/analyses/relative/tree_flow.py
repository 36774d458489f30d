"""Steps towards an equilibrium in joint and modal coordinates, for `analyses.equilibrium`.

Step (2) of that module is replaced by the following equations, with the tree of the system and the wrenches w of the
loop-closing connections (docs/relative.md §5):

    (2) (M/tau + K) ds + B dw = -rho,   C ds + V dw = -g

K is the Newton matrix of positions (c_k alone), because the rates of joints do not change. In a steady rotation, the
rates of a joint at the ground may depend on its coordinates, for example for a body on a ball joint or without joints:
ds_dot = S ds, ds_ddot = S' ds, with S and S' from finite differences. K is then replaced by K + C S + M S', where C and
M are the Newton matrices of rates and accelerations.

The reactions of the joints of the tree follow from the equilibrium of the bodies behind them. Along a free coordinate,
the reaction is replaced by the force of springs, motors and friction, so that the difference appears as unbalanced
force of the bodies.
"""

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from fe_models.foundation.arrays import Array, IntArray
from floatframe.engine.compiling.system import compiled_system
from floatframe.engine.initial_conditions.newton_equations import set_iterate
from floatframe.engine.kernels.model import Model
from floatframe.engine.kernels.work import Work
from floatframe.engine.tree.kernels.tree import JointWork, Tree, new_joint_work
from floatframe.engine.tree.topology import tree_of
from floatframe.model.joints.rows import is_held
from floatframe.model.rotations import euler_parameters
from floatframe.model.state import State
from floatframe.model.system import System

__all__ = ["TreeFlow", "tree_flow"]

NEAR_BY = 1e-6  #: difference step for S [rad, or relative to the size of the system]

#: function from a state to the same state with rotation velocities, and its accelerations
Turning = Callable[[State], tuple[State, Array]]


@dataclass(frozen=True, eq=False)
class TreeFlow:
    """Steps of a system towards an equilibrium in joint coordinates; the caller provides the working arrays."""

    model: Model  #: model in which elements use their equations for static equilibrium
    tree: Tree
    joints: JointWork
    turning: Turning
    length: float  #: size of the system
    at_ground: IntArray  #: coordinates of joints at the ground whose rates may change in a steady rotation

    def wrenches(self, work: Work, state: State, u_dot: Array, w: Array) -> Array:
        """Return w with reactions of the tree joints for a motion, (n_w,); `work` then contains this iterate."""
        from floatframe.engine.kernels.entry import evaluate_and_linearize
        from floatframe.engine.tree.kernels.entry import projected

        set_iterate(work, state, u_dot, w)
        projected(self.model, work, self.tree, self.placed(work))
        w = work.state.w.copy()
        set_iterate(work, state, u_dot, w)
        evaluate_and_linearize(self.model, work, 0.0, 0.0, 1.0)
        says = ~is_held(self.model.rows.kind)
        for c in np.unique(self.tree.joint[self.tree.joint >= 0]):
            first, size = int(self.model.connections.w0[c]), int(self.model.connections.size[c])
            own = np.flatnonzero(says[first : first + size])
            V, g = work.connections.V[c, own, :size], work.connections.g[first + own]
            w[first : first + size] -= np.linalg.lstsq(V, g, rcond=None)[0]
        set_iterate(work, state, u_dot, w)
        return w

    def placed(self, work: Work) -> JointWork:
        """Return the joints at the iterate in `work`, with zero increments."""
        from floatframe.engine.tree.kernels.entry import motion_of_joints

        joints = self.joints
        motion_of_joints(self.model, work, self.tree, joints)
        joints.d_start[:], joints.Q_start[:], joints.x[:] = joints.d, joints.Q, 0.0
        return joints

    def step(self, work: Work, state: State, u_dot: Array, w: Array, tau: float) -> tuple[Array, Array, Array]:
        """Return changes of coordinates, (n_s,), bodies (ground axes), (n_u,), and wrenches, (n_w,), by step (2)."""
        from floatframe.engine.tree.kernels.entry import motion_of_bodies, newton_step

        slopes = self.slopes(work, state)
        set_iterate(work, state, u_dot, w)
        joints = self.placed(work)
        if slopes is not None:
            ds, mu = self.turning_step(work, tau, *slopes)
        elif len(self.model.states.row):  # coordinates on which only states act have no stiffness for elimination
            M, K = self.matrix(work, 1.0, 0.0, 0.0), self.matrix(work, 0.0, 0.0, 1.0)
            ds, mu = self.dense_step(work, tau, M, K)
        else:
            ds, mu = newton_step(self.model, work, self.tree, joints, 1 / tau, 0.0, 1.0)
        dw = np.zeros(len(w))
        dw[self.tree.kept_row >= 0] = mu
        is_mode = self.tree.mode >= 0
        joints.rate[:], joints.acceleration[:], work.state.u[:] = 0.0, 0.0, 0.0
        joints.rate[self.tree.column[~is_mode]] = ds[~is_mode]
        work.state.u[self.tree.slot[is_mode]] = ds[is_mode]
        motion_of_bodies(self.model, work, self.tree, joints)
        return ds, work.state.u.copy(), dw

    def slopes(self, work: Work, state: State) -> tuple[Array, Array] | None:
        """Return S and S' of a steady rotation at a state, (n_s, n_s); None if joint rates do not change."""
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
        """Return changes of coordinates and loop wrenches in a steady rotation, with dense matrices."""
        n_s = len(S)
        K, CK, M = (self.matrix(work, *weights) for weights in ((0.0, 0.0, 1.0), (0.0, 1.0, 1.0), (1.0, 0.0, 0.0)))
        K[:, :n_s] += (CK - K)[:, :n_s] @ S + M[:, :n_s] @ S_dot
        return self.dense_step(work, tau, M, K)

    def matrix(self, work: Work, c_m: float, c_d: float, c_k: float) -> Array:
        """Return the dense matrix of step (2) for weights of accelerations, rates and positions, without M/tau."""
        from floatframe.engine.tree.kernels.entry import newton_matrix

        return newton_matrix(self.model, work, self.tree, self.joints, c_m, c_d, c_k)

    def dense_step(self, work: Work, tau: float, M: Array, K: Array) -> tuple[Array, Array]:
        """Return changes of coordinates and loop wrenches for K + M/tau; nan if the matrix is singular."""
        n_s = len(self.tree.slot)
        right = -np.concatenate([self.joints.residual, work.connections.g[self.tree.kept_row >= 0]])
        K[:n_s, :n_s] += M[:n_s, :n_s] / tau
        try:
            solution = np.linalg.solve(K, right)
        except np.linalg.LinAlgError:
            solution = np.full(len(right), np.nan)
        return solution[:n_s], solution[n_s:]

    def displaced(self, work: Work, state: State, ds: Array) -> State:
        """Return the state after coordinates change by ds, (n_s,)."""
        from floatframe.engine.tree.kernels.entry import moved

        set_iterate(work, state)
        joints, is_mode = self.placed(work), self.tree.mode >= 0
        x = np.zeros(len(joints.x))
        x[self.tree.column[~is_mode]] = ds[~is_mode]
        work.state.q[self.tree.mode[is_mode]] += ds[is_mode]
        moved(self.model, work, self.tree, joints, x)
        p = euler_parameters(work.state.R)
        p = np.where((p * state.p).sum(axis=1, keepdims=True) < 0, -p, p)
        return replace(state, r=work.state.r.copy(), p=p, q=work.state.q.copy())


def tree_flow(system: System, turning: Turning, *, rests: bool) -> TreeFlow:
    """Return the flow of a system towards an equilibrium at rest or in steady rotation."""
    compiled, tree = compiled_system(system), tree_of(system).tree
    model, roots = compiled.resting_model, np.flatnonzero((tree.parent < 0) & (np.diff(tree.column0) > 1))
    # the rate of a single coordinate does not change
    several = [s for i in roots for s in range(tree.s0[i], tree.m0[i])]
    at_ground = np.array([] if rests else several, dtype=np.int64)
    return TreeFlow(model, tree, new_joint_work(model, tree), turning, compiled.length, at_ground)
