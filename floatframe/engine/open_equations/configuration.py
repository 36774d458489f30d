"""The configuration group R³ × SO(3) × Rⁿ of each body, and its maps (docs/theory.md §0, §9).

A configuration x = (r, p, q) of a body consists of the position of the frame origin in ground axes (3), Euler
parameters (4) and modal coordinates. A displacement dx = (dr in ground axes, rotation vector in body axes, dq) and a
velocity v = (v_GO in ground axes, omega_B in body axes, q_dot) have one component less. All functions use NumPy and
accept complex dx.
"""

from dataclasses import dataclass

import numpy as np

from fe_models.foundation.arrays import Array, IntArray
from floatframe.model.rotations import (
    dot,
    euler_parameter_product,
    euler_parameter_rates,
    euler_parameters_of_rotation_vector,
    left_jacobian,
    quotients,
    right_jacobian,
    rotations_between,
    tilde,
)
from floatframe.model.state import State

__all__ = ["Configurations", "inverse_right_jacobian"]


@dataclass(frozen=True, eq=False)
class Configurations:
    """The configuration group of a system, with the maps that geometric integrators need."""

    n_q: IntArray  #: number of modes of each body, (n_b,)

    @property
    def n_x(self) -> int:
        """Number of components of a configuration: 7 n_b + n_q."""
        return 7 * len(self.n_q) + int(self.n_q.sum())

    @property
    def n_v(self) -> int:
        """Number of components of a displacement or velocity: 6 n_b + n_q."""
        return 6 * len(self.n_q) + int(self.n_q.sum())

    def parts(self) -> list[tuple[int, int, int]]:
        """Return, for each body, the first index of its part in x and in v, and its number of modes."""
        starts, x0, v0 = [], 0, 0
        for n in (int(n) for n in self.n_q):
            starts.append((x0, v0, n))
            x0, v0 = x0 + 7 + n, v0 + 6 + n
        return starts

    def state(self, x: Array, u: Array) -> State:
        """Return the state for x, (n_x,), and velocities u, (n_v,)."""
        r, p, q = [], [], [np.zeros(0)]
        for j, _, n in self.parts():
            r.append(x[j : j + 3])
            p.append(x[j + 3 : j + 7])
            q.append(x[j + 7 : j + 7 + n])
        return State(np.array(r), np.array(p), np.concatenate(q), u)

    def retract(self, x: Array, dx: Array) -> Array:
        """Return x (+) dx, (n_x,): r + dr, R exp(dtheta), q + dq, for dx (n_v,)."""
        result = np.array(x, dtype=np.result_type(x, dx, float))
        for i, j, n in self.parts():
            result[i : i + 3] += dx[j : j + 3]
            turn = euler_parameters_of_rotation_vector(np.asarray(dx)[j + 3 : j + 6])
            result[i + 3 : i + 7] = euler_parameter_product(result[i + 3 : i + 7], turn)
            result[i + 7 : i + 7 + n] += dx[j + 6 : j + 6 + n]
        return result

    def normalized(self, x: Array) -> Array:
        """Return x with Euler parameters of unit length; products of many rotations change their length by roundoff."""
        result = np.array(x, dtype=float)
        for i, _, _ in self.parts():
            result[i + 3 : i + 7] /= np.linalg.norm(result[i + 3 : i + 7])
        return result

    def difference(self, x: Array, other: Array) -> Array:
        """Return dx, (n_v,), that satisfies x (+) dx = other, for rotations up to half a turn."""
        result = np.zeros(self.n_v)
        for i, j, n in self.parts():
            result[j : j + 3] = other[i : i + 3] - x[i : i + 3]
            result[j + 3 : j + 6] = rotations_between(other[i + 3 : i + 7], x[i + 3 : i + 7])
            result[j + 6 : j + 6 + n] = other[i + 7 : i + 7 + n] - x[i + 7 : i + 7 + n]
        return result

    def rate(self, x: Array, v: Array) -> Array:
        """Return x_dot, (n_x,), for velocities v, (n_v,): p_dot = p * omega/2, all other rates equal the velocities."""
        result = np.zeros(self.n_x)
        for i, j, n in self.parts():
            result[i : i + 3] = v[j : j + 3]
            result[i + 3 : i + 7] = euler_parameter_rates(x[i + 3 : i + 7], v[j + 3 : j + 6])
            result[i + 7 : i + 7 + n] = v[j + 6 : j + 6 + n]
        return result

    def velocity(self, x: Array, x_dot: Array) -> Array:
        """Return the velocities v, (n_v,), for rates x_dot, (n_x,): omega_B = 2 p⁻¹ * p_dot."""
        result = np.zeros(self.n_v)
        for i, j, n in self.parts():
            back = np.array(x[i + 3 : i + 7]) * (1, -1, -1, -1)
            result[j : j + 3] = x_dot[i : i + 3]
            result[j + 3 : j + 6] = 2 * euler_parameter_product(back, x_dot[i + 3 : i + 7])[1:]
            result[j + 6 : j + 6 + n] = x_dot[i + 7 : i + 7 + n]
        return result

    def tangent(self, dx: Array) -> Array:
        """Return T(dx), (n_v, n_v), where v = T(dx) d(dx)/dt is the velocity of x (+) dx at constant x."""
        return self.by_bodies(dx, right_jacobian)

    def inverse_tangent(self, dx: Array) -> Array:
        """Return T(dx)⁻¹, (n_v, n_v), where d(dx)/dt = T⁻¹ v; only for rotations of less than a full turn."""
        return self.by_bodies(dx, inverse_right_jacobian)

    def by_bodies(self, dx: Array, of_rotation) -> Array:
        """Return the identity in which each body's rotation block is a matrix function of its rotation vector."""
        result = np.eye(self.n_v)
        for _, j, _ in self.parts():
            result[j + 3 : j + 6, j + 3 : j + 6] = of_rotation(np.asarray(dx)[j + 3 : j + 6])
        return result


def inverse_right_jacobian(theta: Array) -> Array:
    """Return T(theta)⁻¹ = 1 + S/2 + c S², (3, 3), S = tilde(theta), c = (1 - s/(2 a))/t² (s, a of `rotations`).

    From (1 - a S + b S²)(1 + S/2 + c S²) = 1 and S³ = -t² S; for t < 1/2, T, which is close to one, is inverted
    instead.
    """
    theta = np.asarray(theta)
    x = dot(theta, theta)
    if x < 0.25:
        return np.asarray(np.linalg.inv(left_jacobian(-theta)))
    s, a, _ = quotients(x)
    S = tilde(theta)
    return np.asarray(np.eye(3) + 0.5 * S + (1 - 0.5 * s / a) / x * (S @ S))
