"""Systems, bodies and helpers that several tests share: conserving, pendulum."""

import numpy as np

from floatframe import GROUND, FlexibleBody, Gravity, Marker, RigidBody, SphericalJoint, SpringDamper, System
from floatframe.integrators import EnergyDecaying, EnergyMomentum, Variational
from floatframe.model.joints import JOINTS
from floatframe.model.rotations import euler_parameters_of_rotation_vector, rotation_matrix
from tests.floatframe.point_masses import random_point_masses, reduced_body, stiffened_body, stiffness

SCHEMES = {"momentum": EnergyMomentum(), "decaying": EnergyDecaying(0.5), "variational": Variational()}


def energy_defect(motion):
    """Return the largest defect of the energy balance over the energy that moves about."""
    balance, energies = motion.energies.balance, motion.energies
    return np.abs(balance - balance[0]).max() / max(energies.kinetic.max(), energies.strain.max())


def momentum_defects(motion):
    """Return the largest change of linear and of angular momentum over their size."""
    p, L = motion.linear_momentum, motion.angular_momentum
    return np.abs(p - p[0]).max() / np.abs(p).max(), np.abs(L - L[0]).max() / np.abs(L).max()


AXIS = (0.2, -0.3, 1.0)
OPTIONS = {
    "screw": {"axis": AXIS, "lead": 0.7},
    "universal": {"axis": AXIS, "axis_b": (1.0, 0.1, 0.3)},
    "distance": {},
}
ORIENTED = ("revolute", "prismatic", "cylindrical", "planar", "point-on-line", "point-on-plane")
KNOWN = [kind for kind in (*ORIENTED, "screw", "universal", "distance", "fixed", "spherical", "constant-orientation")
         if kind in JOINTS]  # fmt: skip


def floating_pair(kind, forces=(), body=None, **options):
    """Return a flexible and a rigid body that fly and spin, with a joint between them and nothing else."""
    options = {**({"axis": AXIS} if kind in ORIENTED else OPTIONS.get(kind, {})), **options}
    soft = FlexibleBody("soft", body or reduced_body(random_point_masses(3, 3), stiffness(3, omega=6.0)),
                        velocity=(0.3, 0.1, -0.2), omega_B=(0.4, 1.0, -0.7), q=[0.1, -0.1, 0.05])  # fmt: skip
    place = soft.frame_position + np.array([1.5, 0.3, 0.2])
    block = RigidBody("block", 0.7, np.diag([0.2, 0.3, 0.25]), center_of_mass=(0.1, 0.2, 0.0), position=place,
                      orientation=euler_parameters_of_rotation_vector(np.array([0.2, -0.6, 0.4])),
                      velocity=(0.3, 0.4, 0.0), omega_B=(1.0, 0.2, 0.5))  # fmt: skip
    at = None if kind != "distance" else (0.1, 0.4, 0.2)
    joint = JOINTS[kind]("joint", Marker("soft", "end_a"), "block" if at is None else Marker("block", position=at),
                         **options)  # fmt: skip
    spring = SpringDamper("stay", Marker("soft", "end_b"), Marker("block", position=(0.3, 0, 0.1)), 8.0)
    return System([soft, block], [joint], [spring, *forces])


STIFFENED = stiffened_body(random_point_masses(3, 3), stiffness(3, omega=6.0), size=0.2)
T_END = 1.0
N_Q = 3
G = np.array([1.0, -0.5, -9.81])
OMEGA = np.array([0.5, 1.0, -0.8])
POINTS = random_point_masses(N_Q, 11)
K = stiffness(N_Q, omega=3.5)
D = 0.02 * stiffness(N_Q, 5, omega=3.5)
REDUCED = reduced_body(POINTS, K, D=D, name="pendulum")


def accelerations(p, q, omega, q_dot):
    """Return alpha, q_ddot and the force of the joint on the ground, in minimal coordinates."""
    m = POINTS.m
    pin = int(np.argmin(POINTS.c[:, 0]))  # interface end_b
    y = POINTS.c - POINTS.c[pin] + (POINTS.phi - POINTS.phi[pin]) @ q
    phi = POINTS.phi - POINTS.phi[pin]
    R = rotation_matrix(p)
    # a_p = alpha × y_p + phi_p q_ddot + known
    known = np.cross(omega, np.cross(omega, y)) + 2 * np.cross(omega, phi @ q_dot) - R.T @ G
    columns = np.concatenate([np.cross(np.eye(3)[:, None], y[None]), np.moveaxis(phi, 2, 0)])  # (3 + n, p, 3)
    matrix = np.einsum("p,apx,bpx->ab", m, columns, columns)
    right = -np.einsum("p,apx,px->a", m, columns, known)
    right[3:] -= K @ q + D @ q_dot
    u_dot = np.linalg.solve(matrix, right)
    a = np.einsum("a,apx->px", u_dot, columns) + known
    return u_dot[:3], u_dot[3:], R @ (-(m @ a))


def pendulum():
    pin = POINTS.c[int(np.argmin(POINTS.c[:, 0]))]
    body = FlexibleBody("body", REDUCED, position=-pin, omega_B=OMEGA, velocity=np.cross(pin, OMEGA))
    return System([body], [SphericalJoint("pin", GROUND, Marker("body", "end_b"))], [Gravity(G)])


def errors_of(motion, exact):
    """Return the largest errors of rotation, q, omega, q_dot and the force on the ground over time."""
    body, force = motion.body("body"), motion.reaction("pin").force
    worst = np.zeros(5)
    for k in (*range(10), *range(10, len(motion.t), len(motion.t) // 50)):  # the first steps too: no kick there
        p, q, omega, q_dot, reaction = exact(motion.t[k])
        found = (rotation_matrix(body.p[k]), body.q[k], body.omega_B[k], body.q_dot[k], force[k])
        for j, (a, b) in enumerate(zip(found, (rotation_matrix(p), q, omega, q_dot, reaction), strict=True)):
            worst[j] = max(worst[j], np.abs(a - b).max())
    return worst
