"""Reduced pencils (M, K) of mode sets, to compare reductions that a floating frame cannot use (docs/theory.md §3)."""

from dataclasses import dataclass
from typing import Annotated

import numpy as np
import scipy.linalg as la

from cms.errors import ModeSetError
from cms.linear_algebra.solvers.mode_count import ModeCount, mode_count
from cms.modes.families.families import Families, families_of
from cms.modes.families.static_modes import boundary_names
from cms.modes.mode_set import ModeSet
from cms.modes.mode_sets.free_interface import rubin
from fe_models.body.fe_body import FEBody
from fe_models.foundation.arrays import Array, symmetric_part
from fe_models.foundation.errors import ArgumentError
from fe_models.foundation.records import ArrayShape, checked_fields
from fe_models.foundation.tall.columns import gram, in_memory

__all__ = [
    "ReducedPencil",
    "dual_craig_bampton_pencil",
    "fixed_frequencies",
    "free_frequencies",
    "macneal_pencil",
    "pencil_of_modes",
    "receptance",
]

INFINITE = 1e-10  #: eigenvalue of M in the norm of K + omega² M, below which the frequency counts as infinite
DEPENDENT = 1e-10  #: squared remainder of a unit column outside the span, below which the column is omitted


@dataclass(frozen=True, eq=False)
@checked_fields(ArgumentError)
class ReducedPencil:
    """Equations of motion (K - omega² M) x = Lᵀ f of a reduced body, with boundary displacement u_B = L x.

    If interface forces are unknowns (`is_dual`), x = (displacement coordinates, f) and the equations are (K - omega² M)
    x = -Lᵀ u_B with L = [0, 1], which selects f.
    """

    name: str
    M: Annotated[Array, ArrayShape(("n", "n"))]
    K: Annotated[Array, ArrayShape(("n", "n"))]
    labels: Annotated[tuple[str, ...], ArrayShape(("n",))]  #: label of each coordinate
    interface: Annotated[Array, ArrayShape(("n_b", "n"))]  #: L, rows in the order of the boundary dofs of the body
    is_dual: bool = False


def pencil_of_modes(body: FEBody, modes: ModeSet) -> ReducedPencil:
    """Return the reduced matrices in the columns V of a mode set: M = Vᵀ M V, K = Vᵀ K V, L = V_B."""
    V = in_memory(modes.columns)
    return ReducedPencil(modes.name, gram(V, body.M @ V), gram(V, body.K @ V), modes.labels, V[body.b])


def macneal_pencil(
    body: FEBody | Families,
    n_modes: int | ModeCount,
) -> ReducedPencil:
    """MacNeal's reduction: Rubin's columns without the inertia of the residual attachment modes.

    (1) x = (rigid-body q_r, free modes q, residual attachment f): u = Psi_R q_r + Phi q + Psi_d f
    (2) K = diag(0, Lambda, G_d),  M = diag(Psi_Rᵀ M Psi_R, 1, 0),  G_d = Psi_d,B
    (3) u_B = L x with L = [Psi_R,B, Phi_B, G_d]: the interfaces follow f statically, which makes M singular

    Parameters
    ----------
    body, n_modes
        As for `rubin`.
    """
    with families_of(body) as families:
        body, wanted = families.body, mode_count(n_modes)
        return _macneal_pencil(families, rubin(families, wanted))


def _macneal_pencil(families: Families, modes: ModeSet) -> ReducedPencil:
    """Return MacNeal's reduced matrices, given Rubin's columns."""
    body = families.body
    n_r, n_b = families.Psi_R.shape[1], len(body.b)
    n = modes.columns.shape[1]
    residual = slice(n - n_b, n)
    L = modes.columns[body.b]
    M, K = np.zeros((n, n)), np.zeros((n, n))
    M[:n_r, :n_r] = gram(families.Psi_R, body.M @ families.Psi_R)
    free = np.arange(n_r, n - n_b)
    M[free, free] = 1.0
    K[free, free] = (2 * np.pi * modes.frequencies[free]) ** 2
    K[residual, residual] = symmetric_part(L[:, residual])
    return ReducedPencil("macneal", M, K, modes.labels, L)


def dual_craig_bampton_pencil(
    body: FEBody | Families,
    n_modes: int | ModeCount,
) -> ReducedPencil:
    """Dual Craig-Bampton reduction with interface forces f as unknowns; bodies are assembled by equal forces.

    (1) insert u = Psi_R q_r + Phi q + Psi_d f in the symmetric equations of (u, -f), K u - f_B = 0, with given u_B
    (2) K = [0 0 -R_Bᵀ; 0 Lambda -Phi_Bᵀ; -R_B -Phi_B -G_d],  M = diag(Psi_Rᵀ M Psi_R, 1, M_d),  M_d = Psi_dᵀ M Psi_d
    (3) the last row is u_B = R_B q_r + Phi_B q + (G_d + omega² M_d) f, with the residual flexibility to order omega²

    K is indefinite. Without M_d the last row equals MacNeal's.

    Parameters
    ----------
    body, n_modes
        As for `rubin`.
    """
    with families_of(body) as families:
        body, wanted = families.body, mode_count(n_modes)
        modes = rubin(families, wanted)
        macneal = _macneal_pencil(families, modes)
        n_b, n = len(body.b), len(macneal.labels)
        force = slice(n - n_b, n)
        Psi_d = in_memory(modes.columns[:, force])
        M, K = np.array(macneal.M), np.array(macneal.K)
        M[force, force] = gram(Psi_d, body.M @ Psi_d)
        K[:, force] = -macneal.interface.T
        K[force, :] = -macneal.interface
        K[force, force] = -symmetric_part(macneal.interface[:, force])
        labels = (*macneal.labels[: n - n_b], *boundary_names(body, "force")[0])
        return ReducedPencil("dual-craig-bampton", M, K, labels, np.eye(n)[force], is_dual=True)


def receptance(pencil: ReducedPencil, omega: float) -> Array:
    """Return the receptance H in u_B = H f at the angular frequency omega [rad/s], (n_b, n_b) [m/N].

    Raises
    ------
    ModeSetError
        If omega is a frequency of the pencil.
    """
    dynamic = pencil.K - omega**2 * pencil.M
    size = np.sqrt(np.abs(np.diag(pencil.K)) + omega**2 * np.diag(pencil.M))  # coordinates have different units
    if not size.all() or not np.isfinite(omega):
        raise ModeSetError(f"reduced pencil {pencil.name!r}: omega = {omega:g}; a free body responds at omega > 0 only")
    L = pencil.interface / size
    try:
        response = L @ la.solve(dynamic / np.outer(size, size), L.T, assume_a="sym")
        if not pencil.is_dual:
            return symmetric_part(response)
        lever = np.sqrt(np.abs(np.diag(response)))
        return -symmetric_part(la.inv(response / np.outer(lever, lever)) / np.outer(lever, lever))
    except la.LinAlgError as error:
        raise ModeSetError(f"reduced pencil {pencil.name!r}: omega = {omega:g} is one of its frequencies") from error


def free_frequencies(pencil: ReducedPencil) -> Array:
    """Return the finite frequencies with free interfaces, ascending [Hz]; rigid-body motions have frequency 0."""
    if pencil.is_dual:  # interface forces are zero
        free = np.flatnonzero(~pencil.interface.any(axis=0))
        return _frequencies(pencil.K[np.ix_(free, free)], pencil.M[np.ix_(free, free)])
    return _frequencies(pencil.K, pencil.M)


def fixed_frequencies(pencil: ReducedPencil) -> Array:
    """Return the finite frequencies with all boundary dofs fixed, ascending [Hz].

    The dual equations enforce this by the forces f. Their nonpositive eigenvalues are dropped; the others are
    not bounds.
    """
    if not pencil.is_dual:
        Z = la.null_space(pencil.interface / np.abs(pencil.interface).max(axis=1, keepdims=True))
        return _frequencies(Z.T @ pencil.K @ Z, Z.T @ pencil.M @ Z)
    values = la.eigvals(pencil.K, pencil.M)
    real = values.real[np.isfinite(values) & (np.abs(values.imag) < 1e-9 * np.abs(values))]
    return np.sqrt(np.sort(real[real > 0])) / (2 * np.pi)


def _frequencies(K: Array, M: Array) -> Array:
    """Return the finite frequencies of a semidefinite pencil.

    An eigenvalue mu of omega_0² M in the norm of K + omega_0² M is omega_0² / (omega² + omega_0²).
    """
    d_k, d_m = np.diag(K), np.diag(M)
    has_both = (d_k > 0) & (d_m > 0)
    omega2 = float(np.median(d_k[has_both] / d_m[has_both])) if has_both.any() else 1.0
    W = K + omega2 * M
    size = np.sqrt(np.where(np.diag(W) > 0, np.diag(W), 1.0))
    energy, directions = la.eigh(W / np.outer(size, size))
    kept = energy > DEPENDENT * energy[-1]
    basis = directions[:, kept] / np.sqrt(energy[kept]) / size[:, None]
    mu = la.eigvalsh(basis.T @ M @ basis) * omega2
    mu = mu[mu > INFINITE]
    return np.sort(np.sqrt(np.maximum(omega2 * (1 - mu) / mu, 0.0))) / (2 * np.pi)
