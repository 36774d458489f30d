"""Balanced truncation of the second-order system: directions ranked by controllability and observability."""

import logging
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
import scipy.linalg as la

from cms.errors import EigenError, ModeSetError
from cms.linear_algebra.elastic_pencil import elastic_eigenvectors
from cms.linear_algebra.independent import independent_columns
from cms.linear_algebra.solvers.eigen import EigenResult
from cms.modes.families.families import Families, body_of, families_of
from cms.modes.families.receptance import boundary_scale
from cms.modes.families.static_modes import boundary_names
from cms.modes.mode_set import Block, ModeSet, mode_set, require_interfaces, rigid_block
from fe_models.body.fe_body import FEBody
from fe_models.foundation.arrays import Array, IntArray, frozen
from fe_models.foundation.tall.columns import combine, gram
from fe_models.foundation.words import nearest

__all__ = ["BalancedSystem", "balance", "balanced_truncation"]


# balancing ------------------------------------------------------------------------------------------------------------
# Balancing of a second-order system in modal coordinates: Gramians, Hankel and position-velocity singular values.


NOTHING_NEW = 1e-6  #: remainder of a unit direction outside the span of earlier ones, below which it is dependent
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
    decay = -la.eigvals(A).real
    if decay.min() <= 1e-10 * omega.min():
        raise ModeSetError(
            f"balance: a mode decays at {decay.min():.1e} per time unit, with a frequency of at least "
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


# balanced -------------------------------------------------------------------------------------------------------------


log = logging.getLogger(__name__)

FEWEST_RICH = 60  #: smallest number of free modes of the rich basis
LOWER_PART = 0.6  #: default number of modes in the rich basis of a small body, as a share of all its modes
RICH_FACTOR = 3  #: number of free modes of the rich basis per requested mode
#: length of a residual attachment mode relative to the attachment mode, below which it is rounding
NOTHING_LEFT = 1e-7
STIFF = 1e-12  #: compliance of a boundary dof relative to the largest, below which it is rounding
FEWEST_FOUND = 4  #: smallest number of free modes that balancing needs
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
    if (n_modes is None) == (tolerance is None):
        raise ModeSetError(
            f"balanced_truncation: expected either n_modes or tolerance, got n_modes = {n_modes}, tolerance = "
            f"{tolerance}"
        )
    if n_modes is not None and n_modes < 0:
        raise ModeSetError(f"balanced_truncation: n_modes = {n_modes}; expected 0 or more")
    if tolerance is not None and not 0 < tolerance < 1:
        raise ModeSetError(f"balanced_truncation: tolerance = {tolerance}; expected a number between 0 and 1")
    if not 0 <= damping_ratio <= 1:
        raise ModeSetError(f"balanced_truncation: damping_ratio = {damping_ratio}; expected 0 to 1 (0.01 is 1 %)")
    if n_rich is not None and n_rich < 1:
        raise ModeSetError(f"balanced_truncation: n_rich = {n_rich}; expected 1 or more")
    source, body = body, body_of(body)
    body.require_coupled()
    require_interfaces("balanced_truncation", body)
    with families_of(source) as families:
        rich = rich_basis(families, n_rich, max(FEWEST_RICH, RICH_FACTOR * (n_modes or 0)))
        n = len(rich.omega2)
        if n_modes is not None and n_modes > n:
            raise ModeSetError(
                f"balanced_truncation: n_modes = {n_modes}, but the rich basis of body {body.name!r} has {n} elastic "
                "columns with mass; choose fewer, or a larger n_rich"
            )
        D = np.diag(2 * damping_ratio * np.sqrt(rich.omega2))
        if body.D is not None:
            D = D + gram(rich.Phi, body.D @ rich.Phi)
        into = chosen_dofs(body, "inputs", inputs)
        out_of = into if outputs is None else chosen_dofs(body, "outputs", outputs)
        at_b = rich.Phi[body.b]
        compliance = np.einsum("bk,bk->b", at_b, at_b / rich.omega2)
        levered = compliance * boundary_scale(body) ** 2
        is_elastic = levered > STIFF * levered.max()
        scale = np.where(is_elastic, 1 / np.sqrt(np.where(is_elastic, compliance, 1.0)), 0.0)
        loads = (scale[:, None] * at_b).T
        is_symmetric = np.array_equal(into, out_of)
        system = balance(rich.omega2, D, loads[:, into], None if is_symmetric else loads[:, out_of])
        sigma = system.position_velocity
        sides = 1 if is_symmetric else 2  # directions per singular value: one for loads and one for responses
        if n_modes is None:
            left = 1 - np.cumsum(sigma) / sigma.sum()
            n_modes = min(n, sides * (int(np.argmax(left <= (tolerance or 0.0))) + 1))
        columns = Block(
            combine(rich.Phi, system.T[:, :n_modes]),
            [f"balanced {k + 1}" for k in range(n_modes)],
            ["balanced"] * n_modes,
        )
        options = {
            "n_modes": str(n_modes),
            "rich basis": f"{n} elastic columns",
            "inputs": ", ".join(inputs) if inputs is not None else "all interfaces",
            "outputs": ", ".join(outputs) if outputs is not None else "as the inputs",
            "damping": f"ratio {damping_ratio!r}" + (" and that of the body" if body.D is not None else ""),
            "Hankel singular values": _listed(system.hankel),
            "position-velocity singular values": _listed(sigma),
            "part left out": f"{sigma[n_modes // sides :].sum() / sigma.sum():.3g}",
        }
        modes = mode_set(
            "balanced-truncation",
            families,
            [rigid_block(families, families.Psi_R, "rigid-body"), columns],
            options=options,
        )
        data = {"hankel": system.hankel, "hankel signs": system.signs, "position-velocity": sigma}
        return replace(modes, data=data)


def chosen_dofs(body: FEBody, key: str, names: Sequence[str] | None) -> IntArray:
    """Return the named boundary dofs, ascending, (n,); all boundary dofs if no names are given."""
    labels = [label.removeprefix("at ") for label in boundary_names(body, "at")[0]]
    if names is None:
        return np.arange(len(labels), dtype=np.int64)
    if isinstance(names, str) or not len(names):
        raise ModeSetError(f"balanced_truncation: {key}: expected a list of interfaces, or such as 'pin uz'")
    chosen: set[int] = set()
    for name in names:
        found = {k for k, label in enumerate(labels) if label == name or label.startswith(f"{name} ")}
        if not found:
            choices = [interface.name for interface in body.interfaces] + labels
            raise ModeSetError(f"balanced_truncation: {key}: {name!r} is no interface{nearest(name, choices)}")
        chosen |= found
    return np.array(sorted(chosen), dtype=np.int64)


@dataclass(frozen=True, eq=False)
class RichBasis:
    """M-orthonormal, K-diagonal elastic columns of the free body."""

    Phi: Array  #: displacement columns, (n_dof, n)
    omega2: Array  #: squared angular frequencies, (n,) [1/s²]


def rich_basis(families: Families, n_asked: int | None, n_default: int) -> RichBasis:
    """Return free modes with residual attachment modes (the span of Rubin's set), without massless directions.

    A small body has fewer modes than the default. Its highest modes are useless, and reduce the solver's accuracy.
    """
    body = families.body
    n_most = int((body.M.diagonal() > 0).sum()) - families.Psi_R.shape[1]
    n_free = min(n_asked, n_most) if n_asked is not None else min(n_default, int(LOWER_PART * n_most))
    modes = most_free_modes(families, max(1, n_free))
    residual = families.residual_attachment(modes)
    is_left = _stiffness(body, residual) > NOTHING_LEFT**2 * _stiffness(body, families.Psi_U)
    V = np.hstack([modes.Phi, residual[:, is_left]])
    omega2_1 = float(modes.omega2[0])
    Q, _ = independent_columns(V, body, omega2_1)
    G_K = gram(Q.X, Q.KX)
    Z, is_massive = elastic_eigenvectors(G_K, gram(Q.X, Q.MX), omega2_1)
    Z = Z[:, is_massive]
    return RichBasis(combine(Q.X, Z), np.einsum("kq,kl,lq->q", Z, G_K, Z))


def most_free_modes(families: Families, n: int) -> EigenResult:
    """Return n free modes, or as many as the eigensolver can compute to its tolerance; the highest may not converge.

    Raises
    ------
    ModeSetError
        If it finds no modes.
    """
    while True:
        try:
            return families.free_modes(n_modes=n)
        except EigenError as error:
            if n <= FEWEST_FOUND:
                raise ModeSetError(
                    f"balanced_truncation: body {families.body.name!r}: the rich basis needs at least {n} free modes, "
                    f"which were not found: {error}"
                ) from error
            log.info("balanced truncation: %d free modes were not found (%s); fewer are tried", n, error)
            n = max(FEWEST_FOUND, 2 * n // 3)


def _stiffness(body: FEBody, u: Array) -> Array:
    """Return twice the strain energy of each column, (k,)."""
    return np.einsum("nk,nk->k", u, body.K @ u)


def _listed(values: Array) -> str:
    shown = ", ".join(f"{value:.4g}" for value in values[:REPORTED])
    return shown + (f", … ({len(values)} in all)" if len(values) > REPORTED else "")
