"""The frame that moves with a system in steady motion.

The carrier has a constant angular velocity Omega, and the velocity v_0 at a point r_0 fixed in the ground. Every body
moves with the carrier, except for a spin s e about its own axis e:

    v = v_0 + Omega × (r - r_0),   omega_B = R_GBᵀ Omega + s e
    v' = Omega × v,                omega_B' = R_GBᵀ Omega × s e
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from fe_models.foundation.arrays import Array
from floatframe.engine.kernels.model import Model
from floatframe.engine.kernels.work import Work
from floatframe.model.rotations import euler_parameters, rotation_exp, rotation_matrix
from floatframe.model.state import State

__all__ = ["Carrier", "Spin", "by_carrier", "by_spin", "carried", "moved_on", "turned_axes"]


@dataclass(frozen=True, eq=False)
class Carrier:
    """A frame that moves steadily."""

    point: Array  #: position r_0 of a point, ground axes, (3,) [m]
    velocity: Array  #: velocity v_0 of the point, ground axes, (3,) [m/s]
    omega: Array  #: angular velocity Omega, ground axes, (3,) [rad/s]

    def velocity_at(self, r: Array) -> Array:
        """Return the velocity of the carrier at points r, ground axes, (..., 3)."""
        return np.asarray(self.velocity + np.cross(self.omega, r - self.point))


@dataclass(frozen=True, eq=False)
class Spin:
    """A body that spins relative to the carrier."""

    body: int
    axis: Array  #: spin axis e, unit vector in body axes, (3,)


def carried(model: Model, state: State, carrier: Carrier, spins: tuple[Spin, ...], s: Array) -> tuple[State, Array]:
    """Return an engine state with the velocities of the steady motion, and its accelerations, (n_u,).

    Parameters
    ----------
    s
        Speeds of the spins, (n_spins,) [rad/s].
    """
    u, u_dot = np.zeros_like(state.u), np.zeros_like(state.u)
    own = {spin.body: speed * spin.axis for spin, speed in zip(spins, s, strict=True)}
    for i, u0 in enumerate(model.bodies.u0[:-1]):
        v = carrier.velocity_at(state.r[i])
        turning = rotation_matrix(state.p[i]).T @ carrier.omega
        spin = own.get(i, np.zeros(3))
        u[u0 : u0 + 3], u[u0 + 3 : u0 + 6] = v, turning + spin
        u_dot[u0 : u0 + 3], u_dot[u0 + 3 : u0 + 6] = np.cross(carrier.omega, v), np.cross(turning, spin)
    return State(state.r, state.p, state.q, u, state.w), u_dot


def by_spin(model: Model, work: Work, omega: Array, spin: Spin) -> tuple[Array, Array]:
    """Return derivatives nu and eta of velocities and accelerations by the speed of a spin, (n_u,) each."""
    nu, eta = np.zeros((2, int(model.bodies.u0[-1])))
    turn = slice(int(model.bodies.u0[spin.body]) + 3, int(model.bodies.u0[spin.body]) + 6)
    nu[turn], eta[turn] = spin.axis, np.cross(work.state.R[spin.body].T @ omega, spin.axis)
    return nu, eta


def by_carrier(model: Model, work: Work, carrier: Carrier, change: Array) -> tuple[Array, Array]:
    """Return nu and eta for a change of the carrier's angular velocity, ground axes, (n_u,) each."""
    nu, eta = np.zeros((2, int(model.bodies.u0[-1])))
    for i, u0 in enumerate(model.bodies.u0[:-1]):
        R, r = work.state.R[i], work.state.r[i]
        v, turn = slice(u0, u0 + 3), slice(u0 + 3, u0 + 6)
        dv = np.cross(change, r - carrier.point)
        spin = work.state.u[turn] - R.T @ carrier.omega
        nu[v], nu[turn] = R.T @ dv, R.T @ change
        eta[v] = R.T @ (np.cross(change, carrier.velocity_at(r)) + np.cross(carrier.omega, dv))
        eta[turn] = np.cross(R.T @ change, spin)
    return nu, eta


def moved_on(model: Model, state: State, carrier: Carrier, spins: Sequence[Array], later: float) -> tuple[State, Array]:
    """Return the engine state and its accelerations after the steady motion has continued for a time.

    Parameters
    ----------
    spins
        Angular velocity of each body relative to the carrier, body axes, (3,) [rad/s].
    later
        The time after the given state [s].
    """
    R_t, Omega2 = rotation_exp(later * carrier.omega), float(carrier.omega @ carrier.omega)
    along, center = carrier.velocity, carrier.point
    if Omega2 > 0:  # a helical motion about an axis through `center`
        along = (carrier.velocity @ carrier.omega) / Omega2 * carrier.omega
        center = carrier.point + np.cross(carrier.omega, carrier.velocity) / Omega2
    r, p, u, u_dot = state.r.copy(), state.p.copy(), state.u.copy(), np.zeros_like(state.u)
    for i, u0 in enumerate(model.bodies.u0[:-1]):
        r[i] = center + R_t @ (state.r[i] - center) + later * along
        R = R_t @ rotation_matrix(state.p[i]) @ rotation_exp(later * spins[i])
        p[i], turning = euler_parameters(R), R.T @ carrier.omega
        u[u0 : u0 + 3], u[u0 + 3 : u0 + 6] = R_t @ state.u[u0 : u0 + 3], turning + spins[i]
        u_dot[u0 : u0 + 3], u_dot[u0 + 3 : u0 + 6] = (
            np.cross(carrier.omega, u[u0 : u0 + 3]),
            np.cross(turning, spins[i]),
        )
    return State(r, p, state.q, u), u_dot


def turned_axes(model: Model, spins: Sequence[Array], later: float) -> Array:
    """Return rotations from body axes at a later time to axes that rotated only with the carrier, (n_u, n_u)."""
    turned = np.eye(int(model.bodies.u0[-1]))
    for u0, spin in zip(model.bodies.u0[:-1], spins, strict=True):
        Q = rotation_exp(later * spin)
        turned[u0 : u0 + 3, u0 : u0 + 3] = turned[u0 + 3 : u0 + 6, u0 + 3 : u0 + 6] = Q
    return turned
