"""Balanced truncation of the second-order system: directions ranked by controllability and observability."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
import scipy.linalg as la

from cms.errors import ModeSetError
from cms.modes.families.families import Families, body_of, families_of
from cms.modes.mode_set import Block, ModeSet, mode_set, require_interfaces, rigid_block
from cms.modes.mode_sets.elastic_system import (
    check_options,
    chosen_dofs,
    damping_description,
    elastic_system,
    first_independent,
    require_damped,
)
from fe_models.body.fe_body import FEBody
from fe_models.foundation.arrays import Array, frozen
from fe_models.foundation.tall.columns import combine

__all__ = ["BalancedSystem", "balance", "balanced_truncation"]


# balancing ------------------------------------------------------------------------------------------------------------
# Balancing of a second-order system in modal coordinates: Gramians, Hankel and position-velocity singular values.


NEGATIVE = 1e-9  #: largest negative eigenvalue of a Gramian relative to its largest, that counts as rounding


@dataclass(frozen=True, eq=False)
class BalancedSystem:
    """Result of balancing 1 q_ddot + D q_dot + diag(omega²) q = B u, y = Cᵀ q."""

    hankel: Array  #: Hankel singular values of u -> y, descending, (2 n,)
    #: +1 or -1 for each singular value, (2 n,): a system with C = B is balanced up to these signs; otherwise all are +1
    signs: Array
    position_velocity: Array  #: position-velocity singular values, descending, (n,)
    T: Array  #: balanced directions as orthonormal columns over q, (n, n)

    def __post_init__(self) -> None:
        for name in ("hankel", "signs", "position_velocity", "T"):
            object.__setattr__(self, name, frozen(getattr(self, name)))


def balance(omega2: Array, D: Array, B: Array, C: Array | None = None) -> BalancedSystem:
    """Balance the position and velocity of a symmetric second-order system with loads B u and responses y = Cᵀ q.

    (1) A P + P Aᵀ + b bᵀ = 0 in the states x = (omega q, q_dot), where P is the controllability Gramian of the loads B;
        P_C is the controllability Gramian of loads C
    (2) the system is symmetric, E x_dot = ..., E = [[D, 1], [1, 0]], so the observability Gramian is E P_C E, and the
        Hankel singular values sqrt(eig(P E P_C E)) are the singular values of R_Cᵀ E R with P = R Rᵀ
    (3) its velocity part is the position part of P_C; positions are balanced against velocities by the singular values
        sigma of L_Cᵀ L, P_p = L Lᵀ, with controllable directions L v and observable directions L_C u
    (4) T contains both kinds of directions alternately, by descending sigma, orthonormalised; if C = B they coincide,
        and T diagonalises P_p = T diag(sigma) Tᵀ. The leading columns of T project M, D and K by one congruence, which
        keeps them symmetric and definite. Because T contains both kinds, the error is of second order, as with two
        projections

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
    require_damped("balance", la.eigvals(A), omega2)
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
    """Return P that satisfies A P + P Aᵀ + b bᵀ = 0 with b = (0, B), (2 n, 2 n)."""
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
    """Return R with P = R Rᵀ; negative eigenvalues within rounding count as zero, larger ones raise an error."""
    values, vectors = la.eigh(P)
    if values.min() < -NEGATIVE * values.max():
        raise ModeSetError(
            f"balance: the Gramian has an eigenvalue {values.min() / values.max():.1e} of its largest, expected none "
            "below 0 except for rounding; give more damping or fewer modes"
        )
    return np.asarray(vectors * np.sqrt(np.maximum(values, 0.0)))


def in_turn(reached: Array, seen: Array) -> Array:
    """Return an orthonormal basis, (n, n), of reached and observed directions alternately, without dependent ones.

    Parameters
    ----------
    reached, seen
        Directions by descending importance, (n, n) each.
    """
    n = len(reached)
    T = first_independent(np.stack([reached, seen], axis=2).reshape(n, -1), np.zeros((n, 0)), n)
    return np.hstack([T, la.null_space(T.T)]) if T.shape[1] < n else T


# balanced -------------------------------------------------------------------------------------------------------------


REPORTED = 12  #: number of singular values reported in the options of the set; its data contain all of them


def balanced_truncation(
    body: FEBody | Families,
    *,
    n_modes: int | None = None,
    tolerance: float | None = None,
    damping_ratio: float = 0.01,
    n_rich: int | None = None,
    inputs: Sequence[str] | None = None,
    outputs: Sequence[str] | None = None,
) -> ModeSet:
    """Balanced truncation of the elastic part of the free body: [Psi_R, balanced directions] [1]_.

    (1) Rich basis: free modes and residual attachment modes, M-orthonormal and K-diagonal, in which the Lyapunov
        equation is small.
    (2) Damping: the projected damping of the body plus a modal ratio, because an undamped mode has no Gramian.
    (3) Loads and responses at all boundary dofs, or at chosen ones. Each is scaled so that its own static elastic
        response is 1; stiff and compliant directions, forces and moments then have equal weight.
    (4) Position-velocity balancing (`cms.modes.mode_sets.balanced`): one symmetric projection, ranked by singular
        values.

    The number of directions is `n_modes`, or such that the neglected share of the sum of position-velocity singular
    values is at most `tolerance`. The `data` of the set contain all singular values ("hankel", "hankel signs",
    "position-velocity"). Twice the sum of the neglected Hankel singular values bounds the error of first-order balanced
    truncation. A single symmetric projection has no such bound, but its error decreases similarly. The set is not
    statically complete; add residual vectors if static responses must be exact.

    Parameters
    ----------
    body
        A coupled body with at least one interface, or its `Families`, which several sets can share.
    n_modes
        Number of balanced directions.
    tolerance
        Share of the sum that may be neglected, 0 to 1, instead of a number.
    damping_ratio
        Modal damping ratio that is added for balancing only; default 1 % of critical.
    n_rich
        Number of free modes of the rich basis. Default: 3 n_modes, at least 60 and at most three fifths of all; fewer
        if the eigensolver cannot find that many.
    inputs, outputs
        Interfaces at which loads act and responses are measured, or single components, such as "big_end" or "big_end
        uz". Default: all boundary dofs; if only inputs are given, they are the outputs too. Responses to other loads,
        such as joints at other interfaces, may be inaccurate, because the directions are chosen for these dofs only.

    Raises
    ------
    ModeSetError
        If not exactly one of n_modes and tolerance is given, numbers are out of range, a name is no interface or
        component, a mode is undamped, or the rich basis cannot be computed.

    References
    ----------
    .. [1] Koutsovasilis & Beitelschmidt (2008), docs/bibliography.md, compare such sets; derived in docs/theory.md §3.
    """
    check_options("balanced_truncation", n_modes, tolerance, damping_ratio, n_rich)
    source, body = body, body_of(body)
    body.require_coupled()
    require_interfaces("balanced_truncation", body)
    with families_of(source) as families:
        system = elastic_system("balanced_truncation", families, n_modes, n_rich=n_rich, damping_ratio=damping_ratio)
        n = len(system.omega2)
        into = chosen_dofs("balanced_truncation", body, "inputs", inputs)
        out_of = into if outputs is None else chosen_dofs("balanced_truncation", body, "outputs", outputs)
        is_symmetric = np.array_equal(into, out_of)
        responses = None if is_symmetric else system.B[:, out_of]
        balanced = balance(system.omega2, system.D, system.B[:, into], responses)
        sigma = balanced.position_velocity
        sides = 1 if is_symmetric else 2  # directions per singular value: one for loads and one for responses
        if n_modes is None:
            left = 1 - np.cumsum(sigma) / sigma.sum()
            n_modes = min(n, sides * (int(np.argmax(left <= (tolerance or 0.0))) + 1))
        columns = Block(
            combine(system.Phi, balanced.T[:, :n_modes]),
            [f"balanced {k + 1}" for k in range(n_modes)],
            ["balanced"] * n_modes,
        )
        options = {
            "n_modes": str(n_modes),
            "rich basis": f"{n} elastic columns",
            "inputs": ", ".join(inputs) if inputs is not None else "all interfaces",
            "outputs": ", ".join(outputs) if outputs is not None else "as the inputs",
            "damping": damping_description(body, damping_ratio),
            "Hankel singular values": _listed(balanced.hankel),
            "position-velocity singular values": _listed(sigma),
            "part left out": f"{sigma[n_modes // sides :].sum() / sigma.sum():.3g}",
        }
        modes = mode_set(
            "balanced-truncation",
            families,
            [rigid_block(families, families.Psi_R, "rigid-body"), columns],
            options=options,
        )
        data = {"hankel": balanced.hankel, "hankel signs": balanced.signs, "position-velocity": sigma}
        return replace(modes, data=data)


def _listed(values: Array) -> str:
    shown = ", ".join(f"{value:.4g}" for value in values[:REPORTED])
    return shown + (f", … ({len(values)} in all)" if len(values) > REPORTED else "")
