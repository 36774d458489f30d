"""Motions of a tree of rigid bodies at many instants as arrays, from which linear forms are computed.

The arrays contain, for sample s, body i and column k of the joints (docs/relative.md §2), the pose, angular velocity
and accelerations of the body, the direction of the column, and the position of the marker that it moves. A unit rate of
column k gives the point P of a body carried by the joint the velocity ±(t_k + a_k × (P - p_k)), and the body the
angular velocity ±a_k.
"""

from dataclasses import dataclass

import numpy as np

from fe_models.foundation.arrays import Array, IntArray
from fe_models.foundation.presentation import presented
from fe_models.foundation.words import quoted
from floatframe.engine.compiling.system import compiled_system
from floatframe.engine.kernels.model import Model
from floatframe.engine.kernels.work import new_work
from floatframe.engine.tree.kernels.entry import moved
from floatframe.engine.tree.kernels.tree import JointWork, Tree
from floatframe.engine.tree.topology import SystemTree, tree_of
from floatframe.engine.tree.tree_motions import joint_iterate
from floatframe.errors import ModelError
from floatframe.model.bodies.flexible_body import FlexibleBody
from floatframe.model.system import System

__all__ = [
    "TreeSamples", "as_placed", "distances", "gravity_of", "joints_as_placed", "motion_of_tree", "rigid_bodies",
    "rigid_tree", "tree_samples",
]  # fmt: skip


@presented
@dataclass(frozen=True, eq=False)
class TreeSamples:
    """A motion of n_b bodies by n_c joint columns at n instants, in ground axes unless stated otherwise."""

    x: Array  #: coordinates, (n, n_c) [m or rad]
    rate: Array  #: rates of the coordinates, (n, n_c)
    acceleration: Array  #: accelerations of the coordinates, (n, n_c)
    r: Array  #: positions of the body origins, (n, n_b, 3) [m]
    R: Array  #: axes of the bodies as columns, (n, n_b, 3, 3)
    omega: Array  #: angular velocity, axes of the body, (n, n_b, 3) [rad/s]
    a: Array  #: acceleration of the origin minus gravity, axes of the body, (n, n_b, 3) [m/s²]
    alpha: Array  #: angular acceleration, axes of the body, (n, n_b, 3) [rad/s²]
    t: Array  #: velocity of the moved marker for unit rate, (n, n_c, 3)
    turn: Array  #: angular velocity for unit rate, (n, n_c, 3)
    point: Array  #: position of the marker that the column moves, (n, n_c, 3) [m]
    #: derivatives of all coordinates by the independent ones, (n, n_c, n_i); None: all are independent
    gamma: Array | None = None

    @property
    def n_independent(self) -> int:
        """Number of independent coordinates, whose torques are measured."""
        return int(self.x.shape[1] if self.gamma is None else self.gamma.shape[2])


def rigid_bodies(system: System, where: str) -> None:
    """Raise `ModelError` if a body is flexible."""
    flexible = [body.name for body in system.bodies if isinstance(body, FlexibleBody)]
    if flexible:
        raise ModelError(
            f"{where}: expected rigid bodies, got the flexible {', '.join(quoted(name) for name in flexible)}; "
            "replace it by a RigidBody, or fit the outputs of sensors (fit_outputs)"
        )


def rigid_tree(system: System, where: str) -> SystemTree:
    """Return the tree of a system of rigid bodies without loops; `ModelError` if it is not one."""
    rigid_bodies(system, where)
    tree = tree_of(system)
    loops = [*tree.cut, *tree.constrained, *(coupler.name for coupler in system.couplers)]
    if loops:
        raise ModelError(
            f"{where}: expected a tree, but {', '.join(quoted(name) for name in loops)} "
            f"{'is a constraint' if len(loops) == 1 else 'are constraints'} beside its joints (a loop, a joint without "
            "coordinates of its own, or friction by normal force); for loops of joints, take "
            "linear_form(independent=...); otherwise remove it, or identify the open tree"
        )
    return tree


def gravity_of(system: System) -> Array:
    """Return the acceleration of gravity, ground axes, (3,) [m/s²]."""
    return np.array(compiled_system(system).model.gravity)


def tree_samples(system: System, x: Array, rate: Array, acceleration: Array) -> TreeSamples:
    """Return the motion of a rigid tree at given coordinates.

    Parameters
    ----------
    system
        A tree of rigid bodies.
    x, rate, acceleration
        Values for each coordinate of `tree_of(system).columns` at each instant, (n, n_c). As in results, angles are
        zero in the placed configuration, and distances are zero if the points of the markers coincide. The rotation of
        a spherical joint or a free body is the rotation vector from the placed configuration; its rates are angular
        velocities about the axes of the moved marker.
    """
    tree = rigid_tree(system, f"system {system.name!r}: samples").tree
    n, n_c = len(x), len(tree.side)
    if not x.shape == rate.shape == acceleration.shape == (n, n_c):
        raise ModelError(
            f"system {system.name!r}: samples: expected three arrays (n, {n_c}), one column for each of "
            f"{', '.join(each.name for each in tree_of(system).columns)}; got {x.shape}, {rate.shape}, "
            f"{acceleration.shape}"
        )
    return motion_of_tree(system, tree, x, rate, acceleration)


def motion_of_tree(
    system: System, tree: Tree, x: Array, rate: Array, acceleration: Array, gamma: Array | None = None
) -> TreeSamples:
    """Return the motion of a tree (without its cut joints) for all its coordinates."""
    compiled = compiled_system(system)
    model, work, joints = compiled.model, new_work(compiled.model), joints_as_placed(system)
    start = distances(tree, joints)
    n, n_c, n_b = len(x), len(tree.side), len(tree.parent)
    r, R = np.empty((n, n_b, 3)), np.empty((n, n_b, 3, 3))
    u, u_dot = np.empty((n, n_b, 6)), np.empty((n, n_b, 6))
    t, turn, point = np.empty((n, n_c, 3)), np.empty((n, n_c, 3)), np.empty((n, n_c, 3))
    markers = [int(tree.near[i] if tree.is_reversed[i] else tree.far[i]) for i in range(n_b)]
    for s in range(n):
        joints.rate[:], joints.acceleration[:] = rate[s], acceleration[s]
        moved(model, work, tree, joints, x[s] - start)
        r[s], R[s], t[s], turn[s] = work.state.r, work.state.R, joints.t, joints.a
        u[s], u_dot[s] = work.state.u.reshape(n_b, 6), work.state.u_dot.reshape(n_b, 6)
    for k, i in enumerate(owners(tree)):
        m = markers[i]
        point[:, k] = r[:, i] if m < 0 else marker_places(model, m, r, R)
    a = np.einsum("sbij,sbi->sbj", R, u_dot[:, :, :3] - gravity_of(system))
    return TreeSamples(x, rate, acceleration, r, R, u[:, :, 3:], a, u_dot[:, :, 3:], t, turn, point, gamma)


def marker_places(model: Model, m: int, r: Array, R: Array) -> Array:
    """Return the positions of a marker on a rigid body or the ground, (n, 3)."""
    i, position = int(model.markers.body[m]), model.markers.position[m]
    return np.broadcast_to(position, r[:, 0].shape) if i < 0 else r[:, i] + R[:, i] @ position


def joints_as_placed(system: System) -> JointWork:
    """Return working arrays for the tree joints in the placed configuration."""
    compiled = compiled_system(system)
    _, joints = joint_iterate(compiled, tree_of(system).tree, compiled.placed)
    joints.d_start[:], joints.Q_start[:] = joints.d, joints.Q
    return joints


def as_placed(system: System) -> Array:
    """Return the coordinates of a tree in the placed configuration, (n_c,): distances of markers, and zero angles."""
    return distances(tree_of(system).tree, joints_as_placed(system))


def distances(tree: Tree, joints: JointWork) -> Array:
    """Return the distances of joint markers along their columns, zero for rotations, (n_c,)."""
    is_distance = ~tree.alpha.any(axis=1)
    return np.einsum("ka,ka->k", tree.tau, joints.d[owners(tree)]) * is_distance


def owners(tree: Tree) -> IntArray:
    """Return the body that each column moves, (n_c,)."""
    return np.repeat(np.arange(len(tree.parent)), np.diff(tree.column0))
