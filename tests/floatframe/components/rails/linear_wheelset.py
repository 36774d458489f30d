"""A suspended conical wheelset on circular rails, linear, from textbook kinematics: lateral shift y and yaw psi.

Wickens's kinematics of a cone gamma on rails of radius R, contacts 2 a apart, nominal radius r: roll = sigma y with
sigma = gamma/(a - r gamma), rolling radii r ± lam y with lam = gamma (a + R gamma)/(a - r gamma), contact angles gamma
± sigma y, contacts move by -(1 + R sigma) y across and by ± r gamma psi along. The normal forces follow from vertical
and roll balance.
"""

from typing import NamedTuple

import numpy as np

from floatframe.components.rails.hertz import ellipse
from floatframe.components.rails.kalker import kalker_coefficients


class Suspended(NamedTuple):
    mass: float = 1500.0
    I_x: float = 900.0  #: and about the vertical
    I_y: float = 110.0
    load: float = 60e3  #: on each wheel, vertical
    k_y: float = 4e5  #: lateral suspension of the axle
    k_psi: float = 1.2e6  #: its yaw suspension
    k_roll: float = 0.0
    gamma: float = 0.05
    a: float = 0.75
    r: float = 0.46
    R: float = 0.3
    G: float = 8.2e10
    nu: float = 0.28


def coefficients_of(p: Suspended, N, r):
    """f11, f22, f23, f33 under a normal force."""
    found = ellipse(np.array(0.5 * np.cos(np.arctan(p.gamma)) / r), np.array(0.5 / p.R), p.G / (1 - p.nu))
    c11, c22, c23, c33 = kalker_coefficients(found.ratio, p.nu)
    ab = found.a_1 * found.b_1 * N ** (2 / 3)
    return ab * p.G * c11, ab * p.G * c22, ab**1.5 * p.G * c23, ab**2 * p.G * c33


def defects(p: Suspended, V, motion, unknowns):
    """What the balances of forces (y, z) and moments (x, z) lack; unknowns y'', psi'', N_left, N_right."""
    y, psi, y_dot, psi_dot = motion
    y_ddot, psi_ddot, *normal = unknowns
    delta_0 = np.arctan(p.gamma)
    # the contact of the centred wheelset lies on the rail where its slope is gamma, nearer to the field of the wheel
    sigma = p.gamma / (p.a - p.r * p.gamma)
    lam = p.gamma * (p.a + p.R * p.gamma) / (p.a - p.r * p.gamma)
    roll, roll_dot, roll_ddot = sigma * y, sigma * y_dot, sigma * y_ddot
    omega = V / p.r
    F, M = np.zeros(3), np.zeros(3)
    for side, N in zip((1, -1), normal, strict=True):
        delta = delta_0 + side * roll
        n = np.array([0.0, -side * np.sin(delta), np.cos(delta)])
        across = np.array([0.0, np.cos(delta), side * np.sin(delta)])
        radius = p.r + side * lam * y
        P = np.array([side * p.r * p.gamma * psi, side * p.a - (1 + p.R * sigma) * y, -radius])
        f11, f22, f23, f33 = coefficients_of(p, N, p.r)
        xi = -side * lam * y / p.r - side * p.a * psi_dot / V
        eta = ((y_dot + p.r * roll_dot) / V - psi) / np.cos(delta_0)
        spin = (-side * omega * np.sin(delta) + omega * roll * np.cos(delta) + psi_dot) / V
        force = N * n - f11 * xi * np.array([1.0, 0, 0]) - (f22 * eta + f23 * spin) * across
        F += force
        M += np.cross(P, force) + (f23 * eta - f33 * spin) * n
    return np.array([
        F[1] - p.k_y * y - p.mass * y_ddot,
        F[2] - 2 * p.load,
        M[0] - p.k_roll * roll - p.I_x * roll_ddot + p.I_y * omega * psi_dot,
        M[2] - p.k_psi * psi - p.I_x * psi_ddot - p.I_y * omega * roll_dot,
    ])  # fmt: skip


def eigenvalues(p: Suspended, V):
    """Of the lateral and yaw motion, sorted by imaginary part."""
    N_0 = p.load / np.cos(np.arctan(p.gamma))
    for _ in range(20):  # the normal forces that carry the load: spin forces have a vertical part
        N_0 += defects(p, V, np.zeros(4), (0, 0, N_0, N_0))[1] * -0.5
    at = np.array([0, 0, N_0, N_0], dtype=float)

    def slopes(f, x, steps):
        return np.column_stack([(f(x + h * e) - f(x - h * e)) / (2 * h) for h, e in zip(steps, np.eye(4), strict=True)])

    by_motion = slopes(lambda m: defects(p, V, m, at), np.zeros(4), [1e-6, 1e-6, 1e-5, 1e-5])
    by_unknowns = slopes(lambda u: defects(p, V, np.zeros(4), u), at, [1e-3, 1e-3, 1.0, 1.0])
    accelerations = -np.linalg.solve(by_unknowns, by_motion)[:2]
    A = np.vstack([np.hstack([np.zeros((2, 2)), np.eye(2)]), accelerations])
    return np.linalg.eigvals(A)
