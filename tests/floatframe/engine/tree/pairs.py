"""Two flexible bodies with geometric stiffness and a joint between them; a relative iterate that can be moved."""

import numpy as np

from floatframe import FlexibleBody, Gravity, Marker, System
from floatframe.engine.compiling.system import compiled_system
from floatframe.engine.initial_conditions.newton_equations import set_iterate
from floatframe.engine.kernels.work import new_work
from floatframe.engine.tree.kernels.entry import motion_of_joints, projected
from floatframe.engine.tree.kernels.tree import new_joint_work
from floatframe.engine.tree.topology import tree_of
from tests.floatframe.engine.kernels.examples import turned_triad
from tests.floatframe.point_masses import random_point_masses, stiffened_body, stiffness


def pair(make, *, is_apart, swap=False, forces=()):
    """Two bodies with markers apart or in one place; `swap`: marker A on the body that hangs at the other."""
    first = stiffened_body(random_point_masses(3, 3), stiffness(3), interfaces=2)
    second = stiffened_body(random_point_masses(2, 4), stiffness(2), interfaces=2)
    at = first.interface("end_a").position - second.interface("end_b").position
    apart = np.array([0.4, 0.2, -0.3]) if is_apart else np.zeros(3)
    bodies = [
        FlexibleBody("first", first, omega_B=(0.3, -0.2, 0.5), velocity=(0.1, 0.3, -0.2), stiffening=True),
        FlexibleBody("second", second, position=at + apart, omega_B=(-0.4, 0.2, 0.3), stiffening=True),
    ]
    ends = [Marker("first", "end_a", triad=turned_triad(4)), Marker("second", "end_b", triad=turned_triad(5))]
    return System(bodies, [make(*(ends[::-1] if swap else ends))], [Gravity((0.5, -1.0, -9.81)), *forces])


class RelativeIterate:
    """The state of a system in relative coordinates, moved along them."""

    def __init__(self, system, state, u_dot=None, w=None, t=0.0):
        compiled = compiled_system(system)
        self.compiled, self.model, self.tree = compiled, compiled.model, tree_of(system).tree
        self.work, self.joints = new_work(self.model), new_joint_work(self.model, self.tree)
        self.work.state.time[...] = t
        set_iterate(self.work, state, u_dot, w)
        motion_of_joints(self.model, self.work, self.tree, self.joints)
        self.joints.d_start[:], self.joints.Q_start[:] = self.joints.d, self.joints.Q
        self.is_modal = np.ones(int(self.model.bodies.u0[-1]), dtype=bool)
        for u0 in self.model.bodies.u0[:-1]:
            self.is_modal[u0 : u0 + 6] = False

    def absolute(self):
        """r, R, u, u_dot as they are."""
        state = self.work.state
        return [part.copy() for part in (state.r, state.R, state.u, state.u_dot)]

    def forget_frames(self):
        """Spoil the motion of all frames, so that what is found again was made from the joints."""
        self.work.state.r[:], self.work.state.R[:] = np.nan, np.nan
        self.work.state.u[~self.is_modal], self.work.state.u_dot[~self.is_modal] = np.nan, np.nan

    def project(self, c_k=1.0):
        """The projected residual; reactions of the tree go into w."""
        return projected(self.model, self.work, self.tree, self.joints, c_k)
