"""Frequency response at the interfaces by superposition of modes and what the others answer statically."""

from dataclasses import dataclass

import numpy as np

from cms.arrays import Array, IntArray
from cms.compare.full_model import FullModel
from cms.fe_body import FEBody

__all__ = ["Response", "full_response", "interface_response"]

POINTS = 400  #: frequencies over the band
FROM = 0.01  #: lowest frequency, of the highest
MOST_DOFS = 24  #: boundary dofs of the response; evenly spread where there are more
COMPONENTS = ("x", "y", "z", "rx", "ry", "rz")


@dataclass(frozen=True, eq=False)
class Response:
    """Receptance of the free body between boundary dofs, H = u / f, with the same damping for full and reduced."""

    omega: Array  #: (n_f,) [rad/s]
    dofs: IntArray  #: chosen boundary dofs, indices into `body.b`, (n,)
    scale: Array  #: length that makes rotations comparable to translations, 1 for translations, (n,) [m]
    damping: float  #: ratio of every mode
    H: Array  #: complex, (n_f, n, n) [m/N, 1/N, 1/(N m)]
    pair: tuple[int, int]  #: the entry that is drawn: driven dof, then the dof that answers
    words: str  #: which that is

    def distance(self, H: Array) -> Array:
        """Return |H - H_full| / |H_full| at every frequency, Frobenius norm, rotations scaled, (n_f,)."""
        weight = np.outer(self.scale, self.scale)
        left = np.linalg.norm((H - self.H) * weight, axis=(1, 2))
        return np.asarray(left / np.linalg.norm(self.H * weight, axis=(1, 2)))

    def drawn(self, H: Array) -> Array:
        """Return the magnitude of the entry that is drawn, (n_f,) [m/N]."""
        driven, answers = self.pair
        return np.abs(H[:, answers, driven])


def full_response(body: FEBody, full: FullModel, *, damping: float) -> Response:
    """Return the response of the full model: rigid and free modes, and the flexibility of the modes not found."""
    b, n_b = body.b, len(body.b)
    dofs = np.unique(np.linspace(0, n_b - 1, min(MOST_DOFS, n_b)).astype(np.int64))
    omega_max = 2 * np.pi * full.band
    omega = np.linspace(FROM * omega_max, omega_max, POINTS)
    at = b[dofs]
    rigid, Phi = full.rigid[at], full.Phi[at]
    residual = full.G_bb[np.ix_(dofs, dofs)] - (Phi / full.omega2) @ Phi.T
    H = interface_response(omega, rigid, Phi, full.omega2, (residual + residual.T) / 2, damping)
    pair, words = drawn_pair(body, at)
    scale = np.where(body.dofs[at, 1] < 3, 1.0, 1.0 / body.length)
    return Response(omega, dofs, scale, damping, H, pair, words)


def interface_response(omega: Array, rigid: Array, Phi: Array, omega2: Array, residual: Array, damping: float) -> Array:
    """Return H = -N Nᵀ / omega² + sum_k phi_k phi_kᵀ / (omega_k² - omega² + 2 i zeta omega omega_k) + residual.

    Parameters
    ----------
    omega
        (n_f,) [rad/s].
    rigid, Phi
        M-orthonormal rigid-body and elastic modes at the chosen dofs, (n, n_r) and (n, n_modes).
    omega2
        Of the elastic modes, (n_modes,) [1/s²].
    residual
        Flexibility without mass, (n, n) [m/N].
    damping
        Ratio of every mode.

    Returns
    -------
    Array
        Complex, (n_f, n, n).
    """
    lam = np.maximum(omega2, 0.0)
    factor = 1 / (lam - omega[:, None] ** 2 + 2j * damping * omega[:, None] * np.sqrt(lam))
    H = np.einsum("nk,fk,mk->fnm", Phi, factor, Phi, optimize=True)
    H -= (rigid @ rigid.T)[None] / omega[:, None, None] ** 2
    return np.asarray(H + residual[None])


def drawn_pair(body: FEBody, at: IntArray) -> tuple[tuple[int, int], str]:
    """Choose the entry to draw: a translation of the first interface, the same component at the last one."""
    owner = {int(dof): i for i, interface in enumerate(body.interfaces) for dof in interface.dofs}  # type: ignore[union-attr]
    first = [k for k, dof in enumerate(at) if owner[int(dof)] == 0 and body.dofs[dof, 1] < 3]
    driven = first[len(first) // 2] if first else 0
    component = body.dofs[at[driven], 1]
    last = owner[int(at[-1])]
    answers = next(
        (k for k, dof in enumerate(at) if owner[int(dof)] == last and body.dofs[dof, 1] == component), driven
    )
    names = [body.interfaces[owner[int(at[k])]].name for k in (driven, answers)]
    return (driven, answers), f"force at {names[0]} along {COMPONENTS[component]}, displacement at {names[1]} along "\
        f"{COMPONENTS[body.dofs[at[answers], 1]]}"  # fmt: skip
