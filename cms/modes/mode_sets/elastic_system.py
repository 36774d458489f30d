"""Elastic part of a free body in a rich basis of free and residual attachment modes, for sets that choose directions.

The Lyapunov equations of balanced truncation and the H2 error are small and dense in these coordinates.
"""

import logging
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from cms.errors import EigenError, ModeSetError
from cms.linear_algebra.elastic_pencil import elastic_eigenvectors
from cms.linear_algebra.independent import independent_columns
from cms.linear_algebra.solvers.eigen import EigenResult
from cms.modes.families.families import Families
from cms.modes.families.receptance import boundary_scale
from cms.modes.families.static_modes import boundary_names
from fe_models.body.fe_body import FEBody
from fe_models.foundation.arrays import Array, IntArray
from fe_models.foundation.tall.columns import combine, gram
from fe_models.foundation.words import nearest

__all__ = [
    "NOTHING_NEW", "ElasticSystem", "check_options", "chosen_dofs", "damping_description", "elastic_system",
    "first_independent", "require_damped",
]  # fmt: skip

FEWEST_RICH = 60  #: smallest number of free modes of the rich basis
LOWER_PART = 0.6  #: default number of modes in the rich basis of a small body, as a share of all its modes
RICH_FACTOR = 3  #: number of free modes of the rich basis per requested mode
#: length of a residual attachment mode relative to the attachment mode, below which it is rounding
NOTHING_LEFT = 1e-7
STIFF = 1e-12  #: compliance of a boundary dof relative to the largest, below which it is rounding
UNDAMPED = 1e-10  #: decay of a pole relative to the lowest frequency, below which it is undamped
#: remainder of a unit direction outside the span of earlier ones, below which it is dependent
NOTHING_NEW = 1e-6
FEWEST_FOUND = 4  #: smallest number of free modes that the rich basis needs

log = logging.getLogger(__name__)


@dataclass(frozen=True, eq=False)
class ElasticSystem:
    """Elastic part of a free body: 1 q_ddot + D q_dot + diag(omega²) q = B u, with responses Bᵀ q."""

    Phi: Array  #: displacement columns of q, (n_dof, n)
    omega2: Array  #: squared angular frequencies, (n,) [1/s²]
    D: Array  #: damping, (n, n) [1/s]
    #: loads, (n, n_b): one for each boundary dof, with a static elastic response of 1; 0 if it has none
    B: Array


def elastic_system(
    name: str, families: Families, n_modes: int | None, *, n_rich: int | None, damping_ratio: float
) -> ElasticSystem:
    """Return the elastic part of a free body in a rich basis.

    Parameters
    ----------
    name
        Name of the set, for messages.
    families
        Families of the body.
    n_modes
        Number of directions that the set will choose; None: not known yet.
    n_rich
        Number of free modes of the rich basis. Default: 3 n_modes, at least 60 and at most three fifths of all; fewer
        if the eigensolver cannot find that many.
    damping_ratio
        Modal damping ratio, added to the damping of the body.

    Raises
    ------
    ModeSetError
        If the rich basis cannot be computed, or has fewer columns than `n_modes`.
    """
    body = families.body
    Phi, omega2 = rich_basis(name, families, n_rich, max(FEWEST_RICH, RICH_FACTOR * (n_modes or 0)))
    if n_modes is not None and n_modes > len(omega2):
        raise ModeSetError(
            f"{name}: n_modes = {n_modes}, but the rich basis of body {body.name!r} has {len(omega2)} elastic columns "
            "with mass; choose fewer, or a larger n_rich"
        )
    D = np.diag(2 * damping_ratio * np.sqrt(omega2))
    if body.D is not None:
        D = D + gram(Phi, body.D @ Phi)
    at_b = Phi[body.b]
    compliance = np.einsum("bk,bk->b", at_b, at_b / omega2)
    levered = compliance * boundary_scale(body) ** 2
    is_elastic = levered > STIFF * levered.max()
    scale = np.where(is_elastic, 1 / np.sqrt(np.where(is_elastic, compliance, 1.0)), 0.0)
    return ElasticSystem(Phi, omega2, D, (scale[:, None] * at_b).T)


def check_options(
    name: str, n_modes: int | None, tolerance: float | None, damping_ratio: float, n_rich: int | None
) -> None:
    """Raise `ModeSetError` if not exactly one of n_modes and tolerance is given, or numbers are out of range."""
    if (n_modes is None) == (tolerance is None):
        raise ModeSetError(
            f"{name}: expected either n_modes or tolerance, got n_modes = {n_modes}, tolerance = {tolerance}"
        )
    if n_modes is not None and n_modes < 0:
        raise ModeSetError(f"{name}: n_modes = {n_modes}; expected 0 or more")
    if tolerance is not None and not 0 < tolerance < 1:
        raise ModeSetError(f"{name}: tolerance = {tolerance}; expected a number between 0 and 1")
    if not 0 <= damping_ratio <= 1:
        raise ModeSetError(f"{name}: damping_ratio = {damping_ratio}; expected 0 to 1 (0.01 is 1 %)")
    if n_rich is not None and n_rich < 1:
        raise ModeSetError(f"{name}: n_rich = {n_rich}; expected 1 or more")


def require_damped(name: str, poles: Array, omega2: Array) -> None:
    """Raise `ModeSetError` if a pole hardly decays, so that its Gramian or H2 norm is infinite."""
    decay, lowest = -float(poles.real.max()), float(np.sqrt(omega2.min()))
    if decay <= UNDAMPED * lowest:
        raise ModeSetError(
            f"{name}: a mode decays at {decay:.1e} per time unit, with a frequency of at least "
            f"{lowest / (2 * np.pi):.6g}; expected damping of every mode; give damping_ratio above 0"
        )


def first_independent(V: Array, fixed: Array, n: int) -> Array:
    """Return the first n columns of V outside the span of fixed orthonormal ones, orthonormalised in their order."""
    found = fixed
    for v in V.T:
        if found.shape[1] - fixed.shape[1] == n:
            break
        length = float(np.linalg.norm(v))
        rest = v / length if length > 0 else v
        for _ in range(2):  # two passes suffice
            rest = rest - found @ (found.T @ rest)
        left = float(np.linalg.norm(rest))
        if left > NOTHING_NEW:
            found = np.hstack([found, rest[:, None] / left])
    return found[:, fixed.shape[1] :]


def damping_description(body: FEBody, damping_ratio: float) -> str:
    """Return the damping of the system in words."""
    return f"ratio {damping_ratio!r}" + (" and that of the body" if body.D is not None else "")


def chosen_dofs(name: str, body: FEBody, key: str, names: Sequence[str] | None) -> IntArray:
    """Return the named boundary dofs, ascending, (n,); all boundary dofs if no names are given.

    Parameters
    ----------
    name
        Name of the set, for messages.
    body
        A coupled body.
    key
        Name of the option, for messages.
    names
        Interfaces, or single components, such as "big_end uz".
    """
    labels = [label.removeprefix("at ") for label in boundary_names(body, "at")[0]]
    if names is None:
        return np.arange(len(labels), dtype=np.int64)
    if isinstance(names, str) or not len(names):
        raise ModeSetError(f"{name}: {key}: expected a list of interfaces, or such as 'pin uz'")
    chosen: set[int] = set()
    for place in names:
        found = {k for k, label in enumerate(labels) if label == place or label.startswith(f"{place} ")}
        if not found:
            choices = [interface.name for interface in body.interfaces] + labels
            raise ModeSetError(f"{name}: {key}: {place!r} is no interface{nearest(place, choices)}")
        chosen |= found
    return np.array(sorted(chosen), dtype=np.int64)


def rich_basis(name: str, families: Families, n_asked: int | None, n_default: int) -> tuple[Array, Array]:
    """Return M-orthonormal, K-diagonal elastic columns, (n_dof, n), and their omega², (n,).

    They span the free modes and residual attachment modes (Rubin's set), without massless directions. A small body has
    fewer modes than the default. Its highest modes are useless, and reduce the solver's accuracy.
    """
    body = families.body
    n_most = int((body.M.diagonal() > 0).sum()) - families.Psi_R.shape[1]
    n_free = min(n_asked, n_most) if n_asked is not None else min(n_default, int(LOWER_PART * n_most))
    modes = most_free_modes(name, families, max(1, n_free))
    residual = families.residual_attachment(modes)
    is_left = _stiffness(body, residual) > NOTHING_LEFT**2 * _stiffness(body, families.Psi_U)
    V = np.hstack([modes.Phi, residual[:, is_left]])
    omega2_1 = float(modes.omega2[0])
    Q, _ = independent_columns(V, body, omega2_1)
    G_K = gram(Q.X, Q.KX)
    Z, is_massive = elastic_eigenvectors(G_K, gram(Q.X, Q.MX), omega2_1)
    Z = Z[:, is_massive]
    return combine(Q.X, Z), np.einsum("kq,kl,lq->q", Z, G_K, Z)


def most_free_modes(name: str, families: Families, n: int) -> EigenResult:
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
                    f"{name}: body {families.body.name!r}: the rich basis needs at least {n} free modes, "
                    f"which were not found: {error}"
                ) from error
            log.info("%s: %d free modes were not found (%s); fewer are tried", name, n, error)
            n = max(FEWEST_FOUND, 2 * n // 3)


def _stiffness(body: FEBody, u: Array) -> Array:
    """Return twice the strain energy of each column, (k,)."""
    return np.einsum("nk,nk->k", u, body.K @ u)
