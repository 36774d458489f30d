"""Balancing of a second-order system in modal coordinates: Gramians, Hankel and position-velocity singular values."""

from dataclasses import dataclass

import numpy as np
import scipy.linalg as la

from cms.errors import ModeSetError
from fe_models.foundation.arrays import Array, frozen

__all__ = ["BalancedSystem", "balance"]

NEGATIVE = 1e-9  #: part of the largest eigenvalue of a Gramian by which rounding may make another one negative


@dataclass(frozen=True, eq=False)
class BalancedSystem:
    """What balancing tells about 1 q_ddot + D q_dot + diag(omega²) q = B u, y = Bᵀ q."""

    hankel: Array  #: Hankel singular values of u -> y, descending, (2 n,)
    signs: Array  #: +1 or -1 for each: the symmetric system is balanced up to these signs, (2 n,)
    position_velocity: Array  #: position-velocity singular values, descending, (n,)
    T: Array  #: balanced directions as columns over q, orthonormal, (n, n)

    def __post_init__(self) -> None:
        for name in ("hankel", "signs", "position_velocity", "T"):
            object.__setattr__(self, name, frozen(getattr(self, name)))


def balance(omega2: Array, D: Array, B: Array) -> BalancedSystem:
    """Balance the position and velocity of a symmetric second-order system with collocated loads and responses.

    (1) A P + P Aᵀ + b bᵀ = 0 in the states x = (omega q, q_dot): P is the Gramian of reachability
    (2) the system is symmetric, E x_dot = ..., E = [[D, 1], [1, 0]], so the Gramian of observability is Q = E P E and
        the Hankel singular values sqrt(eig(P Q)) are |eig(Rᵀ E R)|, P = R Rᵀ
    (3) in particular its velocity part is Q_v = P_p, the position part of P: balancing P_p against Q_v is one
        orthogonal matrix T, P_p = T diag(sigma) Tᵀ, for load and response sides alike, and the leading columns of T
        project M, D and K by one congruence, which keeps them symmetric and definite

    Parameters
    ----------
    omega2
        Squared frequencies of M-orthonormal modes, (n,) [1/s²], all above 0.
    D
        Modal damping, (n, n) [1/s], such that every mode is damped.
    B
        Modal loads, (n, n_u).

    Raises
    ------
    ModeSetError
        If a mode is undamped: its Gramian is infinite.
    """
    n = len(omega2)
    omega = np.sqrt(omega2)
    A = np.block([[np.zeros((n, n)), np.diag(omega)], [-np.diag(omega), -D]])
    b = np.concatenate([np.zeros_like(B), B])
    decay = -la.eigvals(A).real
    if decay.min() <= 1e-10 * omega.min():
        raise ModeSetError(
            f"balance: a mode decays at {decay.min():.1e} per time unit beside its frequency of at least "
            f"{omega.min() / (2 * np.pi):.6g}; expected damping of every mode; give damping_ratio above 0"
        )
    P = la.solve_continuous_lyapunov(A, -b @ b.T)  # (1)
    P = (P + P.T) / 2
    values, vectors = la.eigh(P)
    if values.min() < -NEGATIVE * values.max():
        raise ModeSetError(
            f"balance: the Gramian has an eigenvalue {values.min() / values.max():.1e} of its largest, expected none "
            "below 0 but for rounding; give more damping or fewer modes"
        )
    R = vectors * np.sqrt(np.maximum(values, 0.0))
    E = np.block([[D / np.outer(omega, omega), np.diag(1 / omega)], [np.diag(1 / omega), np.zeros((n, n))]])
    signed = la.eigvalsh(R.T @ E @ R)  # (2)
    order = np.argsort(-np.abs(signed))
    P_p = P[:n, :n] / np.outer(omega, omega)
    sigma, T = la.eigh(P_p)  # (3)
    return BalancedSystem(np.abs(signed[order]), np.sign(signed[order]), np.maximum(sigma[::-1], 0.0), T[:, ::-1])
