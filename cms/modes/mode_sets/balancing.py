"""Balancing of a second-order system in modal coordinates: Gramians, Hankel and position-velocity singular values."""

from dataclasses import dataclass

import numpy as np
import scipy.linalg as la

from cms.errors import ModeSetError
from fe_models.foundation.arrays import Array, frozen

__all__ = ["BalancedSystem", "balance"]

NOTHING_NEW = 1e-6  #: remainder of a unit direction after removal of earlier ones, below which it adds nothing
NEGATIVE = 1e-9  #: share of the largest eigenvalue of a Gramian by which rounding may make another eigenvalue negative


@dataclass(frozen=True, eq=False)
class BalancedSystem:
    """Result of balancing 1 q_ddot + D q_dot + diag(omega²) q = B u, y = Cᵀ q."""

    hankel: Array  #: Hankel singular values of u -> y, descending, (2 n,)
    signs: Array  #: +1 or -1 for each: if C = B, the system is balanced up to these signs; else +1, (2 n,)
    position_velocity: Array  #: position-velocity singular values, descending, (n,)
    T: Array  #: balanced directions as orthonormal columns over q, (n, n)

    def __post_init__(self) -> None:
        for name in ("hankel", "signs", "position_velocity", "T"):
            object.__setattr__(self, name, frozen(getattr(self, name)))


def balance(omega2: Array, D: Array, B: Array, C: Array | None = None) -> BalancedSystem:
    """Balance the position and velocity of a symmetric second-order system with loads B u and responses y = Cᵀ q.

    (1) A P + P Aᵀ + b bᵀ = 0 in the states x = (omega q, q_dot), where P is the controllability Gramian of the loads B,
        and P_C the same for loads C
    (2) the system is symmetric, E x_dot = ..., E = [[D, 1], [1, 0]], so the observability Gramian is E P_C E, and the
        Hankel singular values sqrt(eig(P E P_C E)) are the singular values of R_Cᵀ E R with P = R Rᵀ
    (3) its velocity part is the position part of P_C; positions are balanced against velocities by the singular values
        sigma of L_Cᵀ L, P_p = L Lᵀ, with controllable directions L v and observable directions L_C u
    (4) T holds both kinds of directions in turn, by descending sigma, orthonormalised; if C = B they coincide, and T
        diagonalises P_p = T diag(sigma) Tᵀ; the leading columns of T project M, D and K by one congruence, which keeps
        them symmetric and definite; with both kinds of directions the error is of second order, as with two projections

    Parameters
    ----------
    omega2
        Squared frequencies of M-orthonormal modes, (n,) [1/s²], all positive.
    D
        Modal damping, (n, n) [1/s]; it must damp every mode.
    B
        Modal loads, (n, n_u).
    C
        Modal responses, (n, n_y); default: B.

    Raises
    ------
    ModeSetError
        If a mode is undamped, so that its Gramian is infinite; or if the Gramian is not accurate to rounding.
    """
    n = len(omega2)
    omega = np.sqrt(omega2)
    A = np.block([[np.zeros((n, n)), np.diag(omega)], [-np.diag(omega), -D]])
    decay = -la.eigvals(A).real
    if decay.min() <= 1e-10 * omega.min():
        raise ModeSetError(
            f"balance: a mode decays at {decay.min():.1e} per time unit beside its frequency of at least "
            f"{omega.min() / (2 * np.pi):.6g}; expected damping of every mode; give damping_ratio above 0"
        )
    E = np.block([[D / np.outer(omega, omega), np.diag(1 / omega)], [np.diag(1 / omega), np.zeros((n, n))]])
    P = gramian(A, B)  # (1)
    R = root(P)
    P_p = P[:n, :n] / np.outer(omega, omega)
    if C is None:
        signed = la.eigvalsh(R.T @ E @ R)  # (2)
        order = np.argsort(-np.abs(signed))
        sigma, T = la.eigh(P_p)  # (3), (4)
        hankel, signs = np.abs(signed[order]), np.sign(signed[order])
        return BalancedSystem(hankel, signs, np.maximum(sigma[::-1], 0.0), T[:, ::-1])
    P_C = gramian(A, C)
    hankel = la.svdvals(root(P_C).T @ E @ R)  # (2)
    L, L_C = root(P_p), root(P_C[:n, :n] / np.outer(omega, omega))
    U, sigma, Vt = la.svd(L_C.T @ L)  # (3)
    return BalancedSystem(hankel, np.ones(2 * n), sigma, in_turn(L @ Vt.T, L_C @ U))


def gramian(A: Array, B: Array) -> Array:
    """Return P of A P + P Aᵀ + b bᵀ = 0, b = (0, B), (2 n, 2 n)."""
    b = np.concatenate([np.zeros_like(B), B])
    try:
        P = la.solve_continuous_lyapunov(A, -b @ b.T)
    except la.LinAlgError as error:
        raise ModeSetError(
            f"balance: the Lyapunov equation of {len(B)} modes cannot be solved ({error}); give a smaller n_rich, or "
            "more damping"
        ) from error
    return np.asarray((P + P.T) / 2)


def root(P: Array) -> Array:
    """Return R with P = R Rᵀ; negative eigenvalues count as zero if they are rounding, otherwise an error is raised."""
    values, vectors = la.eigh(P)
    if values.min() < -NEGATIVE * values.max():
        raise ModeSetError(
            f"balance: the Gramian has an eigenvalue {values.min() / values.max():.1e} of its largest, expected none "
            "below 0 but for rounding; give more damping or fewer modes"
        )
    return np.asarray(vectors * np.sqrt(np.maximum(values, 0.0)))


def in_turn(reached: Array, seen: Array) -> Array:
    """Return an orthonormal basis, (n, n), of both kinds of directions in turn; dependent directions are left out.

    Parameters
    ----------
    reached, seen
        Directions by descending importance, (n, n) each.
    """
    n = len(reached)
    T = np.zeros((n, 0))
    for k in range(n):
        for v in (reached[:, k], seen[:, k]):
            length = float(np.linalg.norm(v))
            rest = v / length if length > 0 else v
            for _ in range(2):  # twice is enough
                rest = rest - T @ (T.T @ rest)
            left = float(np.linalg.norm(rest))
            if left > NOTHING_NEW and T.shape[1] < n:
                T = np.hstack([T, rest[:, None] / left])
    return np.hstack([T, la.null_space(T.T)]) if T.shape[1] < n else T
