"""Systems, bodies and helpers that several tests share: tangent."""

import numpy as np

from floatframe.engine.compiling.system import compiled_system
from floatframe.engine.initial_conditions.newton_equations import linearized, set_iterate
from floatframe.engine.kernels.work import new_work
from floatframe.model.bodies.flexible_body import FlexibleBody
from floatframe.model.bodies.ground import GROUND
from floatframe.model.bodies.markers import Marker
from floatframe.model.bodies.rigid_body import RigidBody
from floatframe.model.forces import Gravity, PointForce, SpringDamper
from floatframe.model.joints import FixedJoint, RevoluteJoint, SphericalJoint
from floatframe.model.rotations import euler_parameters_of_rotation_vector, rotation_exp, rotation_matrix
from floatframe.model.state import State
from floatframe.model.system import System
from tests.floatframe.point_masses import random_point_masses, reduced_body, stiffness

C_M, C_D, C_K = 0.7, 0.3, 0.2  # weights of the parts; large, so that each part counts


def turned_triad(seed):
    return rotation_exp(np.random.default_rng(seed).normal(size=3))


def system_with_everything():
    n = 3
    D = np.diag([0.3, 0.2, 0.1]) + 0.05
    first = reduced_body(random_point_masses(n, 3), stiffness(n), D=D, interfaces=4)
    second = reduced_body(random_point_masses(2, 4), stiffness(2), interfaces=3)
    rigid = RigidBody("rigid", 2.0, np.diag([1.0, 1.5, 2.0]), center_of_mass=(0.1, -0.2, 0.3))
    loose = RigidBody("loose", 1.0, np.diag([1.0, 1.5, 1.2]))
    return System(
        [FlexibleBody("first", first), FlexibleBody("second", second), rigid, loose],
        [
            RevoluteJoint(
                "hinge",
                GROUND,
                Marker("first", "end_a", triad=turned_triad(1)),
                axis=(0.2, 1.0, 0.3),
                axis_b=(0.5, 0.1, 1.0),
            ),
            FixedJoint("weld", Marker("first", "end_b"), Marker("second", "end_a"), rotation=turned_triad(2)),
            SphericalJoint("ball", Marker("second", "end_b"), Marker("rigid", position=(0.3, 0.1, 0.2))),
            RevoluteJoint(
                "ring",
                Marker("rigid", position=(0, 0.2, 0), triad=turned_triad(3)),
                Marker("first", "end_c"),
                axis=(1, 1, 0),
            ),
        ],
        [
            Gravity((0.5, -1.0, -9.81)),
            SpringDamper("spring", Marker("first", "end_d"), Marker("second", "end_c"), 30.0, 4.0, 0.5, 2.0),
            SpringDamper("rope", Marker("rigid"), Marker(GROUND, position=(1, 2, 3)), 20.0, 1.0, 0.0),
            SpringDamper("inner", Marker("first", "end_d"), Marker("first", "end_c"), 20.0, 1.0, 0.1),
            PointForce("dead", Marker("first", "end_c"), (3.0, -2.0, 1.0), (0.5, 0.4, -0.3)),
            PointForce("follower", Marker("second", "end_b"), (1.0, 2.0, -3.0), (0.7, -0.4, 0.3), is_follower=True),
        ],
    )


class Iterate:
    """A random iterate that can be moved along the unknowns of the Newton step."""

    def __init__(self, system, seed):
        rng = np.random.default_rng(seed)
        self.model = compiled_system(system).model
        self.work = new_work(self.model)
        n_b, n_q, n_u = len(self.model.bodies.kind), int(self.model.bodies.q0[-1]), int(self.model.bodies.u0[-1])
        p = np.array([euler_parameters_of_rotation_vector(rng.normal(size=3)) for _ in range(n_b)])
        self.r, self.q, self.theta = rng.normal(size=(n_b, 3)), rng.normal(size=n_q), rng.normal(size=(n_b, 3))
        self.u, self.u_dot, self.w = rng.normal(size=n_u), rng.normal(size=n_u), rng.normal(size=self.n_w)
        self.R_start = np.array([rotation_matrix(x) for x in p])
        self.p = p

    @property
    def n_w(self):
        return int(self.model.connections.w0[-1])

    def residual(self, y, mu):
        """Return the scaled residual after a step (y, mu) of the unknowns, and leave it in `work`."""
        model, work = self.model, self.work
        set_iterate(work, State(self.r, self.p, self.q, self.u), self.u_dot, self.w + mu / C_K)
        for i in range(len(model.bodies.kind)):
            own = y[model.bodies.u0[i] : model.bodies.u0[i + 1]]
            R = self.R_start[i] @ rotation_exp(self.theta[i])
            step = np.concatenate([R @ own[:3], own[3:]])
            u = slice(model.bodies.u0[i], model.bodies.u0[i + 1])
            work.state.r[i] += step[:3]
            work.state.theta[i] = self.theta[i] + own[3:6]
            work.state.R[i] = self.R_start[i] @ rotation_exp(work.state.theta[i])
            work.state.q[model.bodies.q0[i] : model.bodies.q0[i + 1]] += own[6:]
            work.state.u[u] += C_D / C_K * step
            work.state.u_dot[u] += C_M / C_K * step
        parts = linearized(model, work, C_M, C_D, C_K)
        return np.concatenate([C_K * work.bodies.residual, work.connections.g]), parts


def newton_matrix(model, parts, n_w):
    """Return the dense Newton matrix over (y, mu)."""
    n_u = int(model.bodies.u0[-1])
    matrix = np.zeros((n_u + n_w, n_u + n_w))
    for i, H in enumerate(parts.H):
        u = slice(model.bodies.u0[i], model.bodies.u0[i + 1])
        matrix[u, u] = H
    matrix[:n_u, n_u:] = -parts.J.T.toarray()
    matrix[n_u:, :n_u] = parts.G.toarray()
    matrix[n_u:, n_u:] = parts.V.toarray()
    return matrix


def newton_matrices(iterate, *, step=1e-5):
    """Return the Newton matrix at an iterate, and the central differences of the residual."""
    n_u = int(iterate.model.bodies.u0[-1])
    n = n_u + iterate.n_w
    _, parts = iterate.residual(np.zeros(n_u), np.zeros(n - n_u))
    approximate = np.zeros((n, n))
    for k in range(n):
        x = step * np.eye(n)[k]
        plus, _ = iterate.residual(x[:n_u], x[n_u:])
        minus, _ = iterate.residual(-x[:n_u], -x[n_u:])
        approximate[:, k] = (plus - minus) / (2 * step)
    return newton_matrix(iterate.model, parts, iterate.n_w), approximate
