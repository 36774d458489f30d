"""Positions of all bodies of a tree as plain functions of its coordinates; velocities by complex steps.

Written from what joints say of their coordinates, apart from the recursions: the second road to them.
"""

import numpy as np

import floatframe as ff
from floatframe.engine.compiling.markers import joint_markers, marker_pose, n_q_of
from floatframe.engine.compiling.system import compiled_system
from floatframe.model.bodies.marker_shape import MarkerShape
from floatframe.model.joints.axis_frame import normals_of
from floatframe.model.rotations import (
    euler_parameter_product,
    euler_parameters,
    euler_parameters_of_rotation_vector,
    rotation_exp,
    tilde,
)
from tests.floatframe.point_masses import random_point_masses, reduced_body, stiffened_body, stiffness

H = 1e-30


def matrix_of(p):
    """Return the matrix of Euler parameters, complex ones too."""
    w, v = p[0], p[1:]
    return (w * w - v @ v) * np.eye(3) + 2 * np.outer(v, v) + 2 * w * tilde(v)


def joint_pose(joint, x, Q0):
    """Return d in axes of A and Q = A_Aᵀ A_B for the positions of a joint."""
    zero = np.zeros(3)
    if joint is None:
        return x[:3], matrix_of(x[3:7])
    match type(joint).__name__:
        case "RevoluteJoint":
            return zero, rotation_exp(x[0] * joint.axis) @ Q0
        case "PrismaticJoint":
            return x[0] * joint.axis, Q0
        case "CylindricalJoint":
            return x[0] * joint.axis, rotation_exp(x[1] * joint.axis) @ Q0
        case "ScrewJoint":
            return joint.lead / (2 * np.pi) * x[0] * joint.axis, rotation_exp(x[0] * joint.axis) @ Q0
        case "UniversalJoint":
            return zero, rotation_exp(x[0] * joint.axis) @ Q0 @ rotation_exp(x[1] * joint.axis_b)
        case "PlanarJoint":
            first, second = normals_of(joint.axis)
            return x[0] * first + x[1] * second, rotation_exp(x[2] * joint.axis) @ Q0
        case "SphericalJoint":
            return zero, matrix_of(x[:4])
    return zero, Q0


class PlainTree:
    """A tree with the same coordinates as a relative model, bodies placed where these are zero."""

    def __init__(self, system, model):
        self.system, self.expansion = system, model.expansion
        compiled, n_q = compiled_system(system), n_q_of(system)
        tree = self.expansion.tree.tree
        self.n_q = n_q
        self.branches = []
        for i in (int(i) for i in tree.order):
            joint = None if tree.joint[i] < 0 else system.joints[tree.joint[i]]
            Q0, near, far = np.eye(3), None, None
            if joint is not None:
                a, b = joint_markers(system, joint, compiled.placed)
                A, B = (marker_pose(m, compiled.placed, n_q)[1] for m in (a, b))
                Q0 = A.T @ B
                near, far = (b, a) if tree.is_reversed[i] else (a, b)
            self.branches.append((i, int(tree.parent[i]), joint, Q0, near, far, bool(tree.is_reversed[i])))

    def parts(self, x, i):
        """Return positions of the joint and modal coordinates of body i."""
        return x[self.expansion.x_of[i]], x[self.expansion.xq_of[i]]

    def poses(self, x):
        """Return (r, R) of all body frames."""
        poses = {-1: (np.zeros(3), np.eye(3))}
        for i, parent, joint, Q0, near, far, is_reversed in self.branches:
            own, q = self.parts(x, i)
            d, Q = joint_pose(joint, own, Q0)
            if is_reversed:
                d, Q = -Q.T @ d, Q.T
            r, R = poses[parent]
            nothing = MarkerShape(np.zeros(3), np.eye(3))
            q_parent = x[self.expansion.xq_of[parent]] if parent >= 0 else np.zeros(0)
            rho, axes = (near.shape if near else nothing).pose(q_parent)
            rho_own, axes_own = (far.shape if far else nothing).pose(q)
            A = R @ axes
            R_i = A @ Q @ axes_own.T
            poses[i] = r + R @ rho + A @ d - R_i @ rho_own, R_i
        return [poses[i] for i in range(len(self.n_q))]

    def moved(self, x, dx):
        """Return x moved along its rates by dx: rotations by the exponential map."""
        result = np.array(x, dtype=np.result_type(x, dx))
        for i in range(len(self.n_q)):
            xs, vs = self.expansion.x_of[i], self.expansion.z_of[i]
            n_p, n_z = xs.stop - xs.start, vs.stop - vs.start
            if n_p > n_z:  # Euler parameters come last
                result[xs.start : xs.stop - 4] += dx[vs.start : vs.stop - 3]
                turn = euler_parameters_of_rotation_vector(dx[vs.stop - 3 : vs.stop])
                result[xs.stop - 4 : xs.stop] = euler_parameter_product(x[xs.stop - 4 : xs.stop], turn)
            else:
                result[xs] += dx[vs]
            result[self.expansion.xq_of[i]] += dx[self.expansion.vq_of[i]]
        return result

    def velocities(self, x, v):
        """Return the velocities of all bodies, (v_GO ground axes, omega_B, q_dot) one after the other; exact."""
        moved = self.poses(self.moved(x, 1j * H * v))
        parts = []
        for i, (r, R) in enumerate(moved):
            W = np.real(R).T @ np.imag(R) / H
            parts += [np.imag(r) / H, [W[2, 1], W[0, 2], W[1, 0]], v[self.expansion.vq_of[i]]]
        return np.concatenate(parts)

    def jacobian(self, x):
        """Return T, absolute velocities by rates."""
        return np.array([self.velocities(x, e) for e in np.eye(self.expansion.n_v)]).T

    def accelerations(self, x, v, a, step=1e-3):
        """Return the rates of the absolute velocities; sixth order differences of exact velocities."""

        def at(t):
            return self.velocities(self.moved(x, t * v + 0.5 * t**2 * a), v + t * a)

        s = step
        return (
            45 * (at(s) - at(-s)) - 9 * (at(2 * s) - at(-2 * s)) + (at(3 * s) - at(-3 * s))
        ) / (60 * s)  # fmt: skip

    def absolute(self, x):
        """Return x of the open equations."""
        parts = []
        for i, (r, R) in enumerate(self.poses(x)):
            parts += [r, euler_parameters(R), x[self.expansion.xq_of[i]]]
        return np.concatenate(parts)


def flexible_tree(seed=0, *, is_free=False, is_stiffened=True, n=3):
    """Return flexible and rigid bodies joined by every chart, forwards and backwards, at deforming markers."""
    rng = np.random.default_rng(seed)
    make = stiffened_body if is_stiffened else reduced_body
    parts = [
        make(random_point_masses(m, seed + m, softness=0.1), stiffness(m), interfaces=4, D=0.3 * np.eye(m))
        for m in (n, n - 1)
    ]
    kinds = ["revolute", "universal", "planar", "spherical", "cylindrical", "screw", "prismatic", "fixed"]
    bodies, joints, poses, ends = [], [], [], []
    axis, other = np.array([0.6, 0.0, 0.8]), np.array([0.0, 1.0, 0.0])
    made = {
        "revolute": lambda *m: ff.RevoluteJoint(*m, axis=axis),
        "universal": lambda *m: ff.joints.UniversalJoint(*m, axis=axis, axis_b=other),
        "planar": lambda *m: ff.joints.PlanarJoint(*m, axis=axis),
        "spherical": lambda *m: ff.SphericalJoint(*m),
        "cylindrical": lambda *m: ff.joints.CylindricalJoint(*m, axis=axis),
        "screw": lambda *m: ff.joints.ScrewJoint(*m, axis=axis, lead=0.7),
        "prismatic": lambda *m: ff.PrismaticJoint(*m, axis=axis),
        "fixed": lambda *m: ff.FixedJoint(*m),
    }
    parents = [-1, 0, 1, 1, 0, 4, 5, 6]
    for i, kind in enumerate(kinds):
        parent = parents[i]
        is_rigid = i in (4, 7)
        reduced = parts[i % 2]
        triad = rotation_exp(rng.normal(size=3))
        if parent < 0:
            near, R_p, r_p = ff.Marker("ground", position=rng.normal(size=3), triad=triad), np.eye(3), np.zeros(3)
            place, axes = near.position, triad
        else:
            R_p, r_p = poses[parent]
            if ends[parent] is None:
                place, axes = rng.normal(size=3), triad
                near = ff.Marker(f"b{parent}", position=place, triad=triad)
            else:
                name = ends[parent].pop()
                place, axes = parts[parent % 2].interface(name).position, triad
                near = ff.Marker(f"b{parent}", name, triad=triad)
        own = rotation_exp(rng.normal(size=3))
        if is_rigid:
            at = rng.normal(size=3)
            far = ff.Marker(f"b{i}", position=at, triad=own)
            ends.append(None)
        else:
            at = reduced.interface("end_a").position
            far = ff.Marker(f"b{i}", "end_a", triad=own)
            ends.append(["end_d", "end_c", "end_b"])
        R = R_p @ axes @ own.T
        r = r_p + R_p @ place - R @ at
        poses.append((R, r))
        if is_rigid:
            J = np.diag([1.0, 1.5, 2.0])
            bodies.append(ff.RigidBody(f"b{i}", 2.0, J, (0.1, -0.2, 0.3), position=r, orientation=euler_parameters(R)))
        else:
            bodies.append(ff.FlexibleBody(f"b{i}", reduced, position=r, orientation=euler_parameters(R)))
        if is_free and i == 0:
            continue
        is_reversed = kind in (("universal", "planar", "spherical") if is_stiffened else ("screw", "cylindrical"))
        markers = (far, near) if is_reversed else (near, far)
        joints.append(made[kind](f"j{i}", *markers))
    return ff.System(bodies, joints, [ff.Gravity((0.5, -1.0, -9.81))])


def random_motion(plain, seed=0, size=1.0):
    """Return random positions, rates and accelerations of a tree."""
    rng = np.random.default_rng(seed)
    e = plain.expansion
    x = 0.5 * rng.normal(size=e.n_x)
    for i in range(len(plain.n_q)):
        xs, vs = e.x_of[i], e.z_of[i]
        if xs.stop - xs.start > vs.stop - vs.start:
            x[xs.stop - 4 : xs.stop] = euler_parameters_of_rotation_vector(rng.normal(size=3))
        x[e.xq_of[i]] *= 0.3
    return x, size * rng.normal(size=e.n_v), size * rng.normal(size=e.n_v)
