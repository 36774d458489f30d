"""Vibration modes of a whole system: complex eigenvalues with frequency and damping, and what moves in each."""

from dataclasses import dataclass, field

import numpy as np
import scipy.linalg as la

from fe_models.foundation.arrays import Array
from floatframe.analyses.linear.linearization import LinearSystem

__all__ = ["SystemModes", "system_modes"]

ZERO = 1e-7  #: |lambda| by the highest one below which a mode is a motion that costs nothing
STILL = 1e-9  #: motion of bodies by that of states below which a mode is one of states alone
UNSTABLE = 1e-6  #: growth rate by the highest |lambda| that rounding explains: a double eigenvalue moves by its root


@dataclass(frozen=True, eq=False)
class SystemModes:
    """Modes exp(lambda t): one of each conjugate pair, by ascending |lambda|."""

    eigenvalues: Array  #: lambda, imaginary part >= 0, (n_modes,) complex [1/s]
    shapes: Array  #: motions of the bodies (body axes), the largest entry 1, (n_u, n_modes) complex
    energy_shares: Array  #: share of each body in the kinetic energy of the mode, (n_modes, n_bodies)
    bodies: tuple[str, ...]  #: their names
    states: tuple[str, ...] = ()  #: of elements and user forces
    state_shapes: Array = field(default_factory=lambda: np.zeros((0, 0)))  #: by the same factor, (n_states, n_modes)

    @property
    def frequencies(self) -> Array:
        """Damped frequencies Im(lambda)/2 pi, (n_modes,) [Hz]; 0 for a motion that does not oscillate."""
        return np.abs(self.eigenvalues.imag) / (2 * np.pi)

    @property
    def natural_frequencies(self) -> Array:
        """Undamped frequencies |lambda|/2 pi, (n_modes,) [Hz]."""
        return np.abs(self.eigenvalues) / (2 * np.pi)

    @property
    def damping_ratios(self) -> Array:
        """-Re(lambda)/|lambda|, (n_modes,); 1 for a motion that decays without oscillation, 0 for one at rest."""
        size = np.abs(self.eigenvalues)
        return np.divide(-self.eigenvalues.real, size, out=np.zeros(len(size)), where=size > 0)

    @property
    def is_stable(self) -> bool:
        """Whether no mode grows."""
        return bool((self.eigenvalues.real <= UNSTABLE * np.abs(self.eigenvalues).max(initial=0.0)).all())


def system_modes(linear: LinearSystem) -> SystemModes:
    """Return all modes of a linearised system.

    Without damping, gyroscopic and circulatory terms the symmetric pencil (K, M) is solved, so that frequencies are
    real; otherwise the first-order pencil of (z, z_dot).
    """
    system, _ = linear.with_mass()
    n = system.n_z
    M, C, K = (np.asarray(a)[:n, :n] for a in (system.M, system.C, system.K))
    omega2, Z = la.eigh((K + K.T) / 2, (M + M.T) / 2)
    highest = float(np.sqrt(np.abs(omega2).max())) or 1.0  # 1: nothing is sprung but by states
    modal_C = Z.T @ C @ Z
    is_conservative = not system.states and (
        np.abs(modal_C).max() <= 1e-12 * highest and np.abs(Z.T @ (K - K.T) @ Z).max() <= 1e-10 * highest**2
    )
    if is_conservative:
        root = np.sqrt(omega2.astype(complex))
        eigenvalues = np.where(omega2 >= 0, 1j * root.real, root.imag)
        shapes = Z.astype(complex)
        for k in np.flatnonzero(omega2 < -((ZERO * highest) ** 2)):  # an unstable one has a decaying twin
            eigenvalues = np.append(eigenvalues, -eigenvalues[k])
            shapes = np.column_stack([shapes, shapes[:, k]])
    else:
        # in the coordinates of the undamped modes, scaled by their frequencies: a well-scaled state matrix
        rates, states = slice(n, 2 * n), slice(2 * n, 2 * n + len(system.states))
        A = np.zeros((states.stop, states.stop))
        A[:n, rates] = highest * np.eye(n)
        A[rates, :n] = -Z.T @ K @ Z / highest
        A[rates, rates] = -modal_C
        A[rates, states] = -Z.T @ system.K[:n, n:] / highest
        A[states, :n] = -system.K[n:, :n] @ Z
        A[states, rates] = -system.C[n:, :n] @ Z * highest
        A[states, states] = -system.K[n:, n:]
        A[states] -= system.M[n:, :n] @ Z @ A[rates] * highest
        of_z = np.r_[:n, states]
        eigenvalues, vectors = la.eig(A)
        keep = eigenvalues.imag >= 0
        eigenvalues, shapes = eigenvalues[keep], la.block_diag(Z, np.eye(len(system.states))) @ vectors[of_z][:, keep]
    eigenvalues = np.where(np.abs(eigenvalues) <= ZERO * highest, 0.0, eigenvalues)
    order = np.lexsort((eigenvalues.imag, np.abs(eigenvalues)))
    of_states = np.pad(shapes, ((0, len(system.M) - len(shapes)), (0, 0)))[n:, order]
    shapes = (system.N[:, : len(shapes)] @ shapes)[:, order]
    largest = shapes[np.abs(shapes).argmax(axis=0), np.arange(shapes.shape[1])]
    if system.states:  # a state that moves no body has a mode of its own
        own = of_states[np.abs(of_states).argmax(axis=0), np.arange(shapes.shape[1])]
        largest = np.where(np.abs(largest) > STILL * np.abs(own), largest, own)
    energies = np.array([np.einsum("uk,uv,vk->k", shapes[u].conj(), m, shapes[u]).real for u, m in linear.bodies()])
    total = energies.sum(axis=0)
    shares = np.divide(energies, total, out=np.zeros_like(energies), where=total > 0).T
    return SystemModes(
        eigenvalues[order], shapes / largest, shares, linear.body_names, system.states, of_states / largest
    )
