"""Mass, damping and stiffness of the whole system at one state, as they follow from the Newton matrix.

Small motions about a state in which every body turns with a constant angular velocity omega in its own axes:

    xi    position of the frame origin and rotation in body axes, modal coordinates
    nu    change of the velocities (v_G turned to body axes, omega_B, q_dot):      nu  = xi_dot + Omega xi
    eta   change of the accelerations (v_G_dot turned to body axes, ...):          eta = nu_dot + Omega' nu

with Omega = diag(omega~, omega~, 0) and Omega' = diag(omega~, 0, 0) for every body. The equations of motion become

    M eta + C nu + K xi - Jᵀ dw = 0      bodies
    G_x xi + G_v nu + V dw = 0           rows: V = 0 and G_v = 0 for what joints hold

(derivation: docs/analyses.md, "Small motions about a steady one"). Rows with V, which say what a wrench is (a moment
about a free axis, the tension of a spring), are solved for their wrench and put into K and C here.
"""

from dataclasses import dataclass

import numpy as np
import scipy.linalg as la

from fe_models.foundation.arrays import Array
from floatframe.joints.rows import is_held
from floatframe.kernels.model import Model
from floatframe.kernels.work import Work
from floatframe.rotations import tilde
from floatframe.start.newton_equations import linearized

__all__ = ["Tangents", "held_rows", "tangents", "turning_matrices"]


@dataclass(frozen=True, eq=False)
class Tangents:
    """Matrices of small motions; unknowns in body axes, dense."""

    M: Array  #: (n_u, n_u)
    C: Array  #: (n_u, n_u)
    K: Array  #: (n_u, n_u)
    G: Array  #: what the joints hold, (n_held, n_u)


def held_rows(model: Model) -> np.ndarray:
    """Return which rows hold a distance or an angle, (n_w,) bool; the others say what a wrench is."""
    return is_held(model.rows.kind)


def tangents(model: Model, work: Work) -> Tangents:
    """Return M, C, K, G at the iterate in `work`; its wrenches give the geometric part of K."""
    by_position = linearized(model, work, 0.0, 0.0, 1.0)
    by_both = linearized(model, work, 0.0, 1.0, 1.0)
    M = la.block_diag(*linearized(model, work, 1.0, 0.0, 0.0).H)
    K = la.block_diag(*by_position.H)
    C = la.block_diag(*by_both.H) - K
    G, G_v = by_position.G.toarray(), by_both.G.toarray() - by_position.G.toarray()
    holds = held_rows(model)
    if (~holds).any():
        # dw = -V⁺ (G_x xi + G_v nu): reactions along what joints hold do no work in motions they allow
        V = by_position.V.toarray()[~holds]
        to_bodies = by_position.J.toarray().T @ np.linalg.pinv(V)
        K += to_bodies @ G[~holds]
        C += to_bodies @ G_v[~holds]
    return Tangents(M, C, K, G[holds])


def turning_matrices(model: Model, work: Work) -> tuple[Array, Array]:
    """Return Omega and Omega' for the angular velocities in `work`, each (n_u, n_u)."""
    n_u = int(model.bodies.u0[-1])
    Omega, Omega_t = np.zeros((n_u, n_u)), np.zeros((n_u, n_u))
    for u0 in model.bodies.u0[:-1]:
        omega = tilde(work.state.u[u0 + 3 : u0 + 6])
        Omega[u0 : u0 + 3, u0 : u0 + 3] = omega
        Omega[u0 + 3 : u0 + 6, u0 + 3 : u0 + 6] = omega
        Omega_t[u0 : u0 + 3, u0 : u0 + 3] = omega
    return Omega, Omega_t
