"""Vibration modes of the whole system: complex eigenvalues, frequencies, damping ratios and shapes."""

from dataclasses import dataclass, field
from typing import TYPE_CHECKING

import numpy as np
import scipy.linalg as la

from fe_models.foundation.arrays import Array
from fe_models.foundation.documents.table import Table, Tabular
from fe_models.foundation.presentation import Summary, presented
from fe_models.foundation.records import checked_fields
from floatframe.analyses.linear.linearization import LinearSystem
from floatframe.analyses.system_matrices import ROUNDING
from floatframe.errors import ModelError
from floatframe.results.sensor_plots import figure_of

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

__all__ = ["SystemModes", "system_modes"]

MODEL = 1e-10  #: relative error assumed for matrix entries, as large as the errors of steady motions and equilibria
UNDAMPED = 1e-12  #: entry of the modal damping matrix, relative to the frequency, below which it is a rounding error
LOW = 1e-10  #: omega², relative to the highest one, below which modes are solved again in their own subspace
FREE = 1e-7  #: rate of a unit motion, relative to the highest frequency, below which the motion has no resistance
#: motion of bodies, relative to the change of states, below which a mode consists only of states
LEAST_BODY_MOTION = 1e-9


@presented
@dataclass(frozen=True, eq=False)
@checked_fields(ModelError)
class SystemModes(Tabular):
    """Modes exp(lambda t) in ascending |lambda|; one mode represents each conjugate pair.

    A motion without resistance is listed as one mode with lambda = 0, although it has two eigenvalues, one for its
    position and one for its velocity.

    Parameters
    ----------
    eigenvalues
        Lambda, imaginary part >= 0, (n_modes,) complex [1/s].
    shapes
        Motions of the bodies (body axes), with 1 as the largest entry, (n_u, n_modes) complex.
    energy_shares
        Share of each body in the kinetic energy of the mode, (n_modes, n_bodies).
    bodies
        Names of the bodies.
    states
        Names of the states of elements and user forces.
    state_shapes
        Changes of states, scaled like the shapes, (n_states, n_modes) complex.
    errors
        Error bounds of lambda, (n_modes,) [1/s].
    """

    eigenvalues: Array
    shapes: Array
    energy_shares: Array
    bodies: tuple[str, ...]
    states: tuple[str, ...] = ()
    state_shapes: Array = field(default_factory=lambda: np.zeros((0, 0)))
    errors: Array = field(default_factory=lambda: np.zeros(0))

    def summary(self) -> Summary:
        """Return the content shown by `repr` and notebooks: frequency, damping and moving bodies of each mode."""
        rows = [
            (str(k + 1), f"{f:.6g}", f"{ratio + 0.0:.3g}", body)
            for k, (f, ratio, body) in enumerate(
                zip(self.frequencies, self.damping_ratios, self.moves_most, strict=True)
            )
        ]
        title = f"SystemModes: {len(rows)} modes, {'stable' if self.is_stable else 'unstable'}"
        return Summary(title, (), ("mode", "Hz", "damping ratio", "moves most"), rows)

    def to_table(self, time_unit: float = 1.0) -> Table:
        """Return damped and natural frequency in Hz, damping ratio, growth and moving body of each mode, a row each.

        time_unit: the unit of time of the system [s].
        """
        columns = {
            "mode": np.arange(len(self.eigenvalues)) + 1,
            "frequency": self.frequencies / time_unit,
            "natural frequency": self.natural_frequencies / time_unit,
            "damping ratio": self.damping_ratios,
            "growth": self.eigenvalues.real / time_unit,
            "moves most": self.moves_most,
            **{f"energy {name}": share for name, share in zip(self.bodies, self.energy_shares.T, strict=True)},
        }
        return Table(columns, {"frequency": "Hz", "natural frequency": "Hz", "growth": "1/s"})

    def plot(self, *, ax: "Axes | None" = None, time_unit: float = 1.0) -> "Figure":
        """Draw the eigenvalues: growth along x, damped frequency along y, with the number of each mode.

        Growing modes, right of the line, are red.

        Parameters
        ----------
        ax
            Axes of a figure; None: a new figure.
        time_unit
            Unit of time of the system [s].
        """
        from matplotlib.figure import Figure

        axes = ax or Figure(figsize=(7, 5), layout="constrained").add_subplot()
        growth, hertz = self.eigenvalues.real / time_unit, self.frequencies / time_unit
        limits = self.errors / time_unit if len(self.errors) else np.zeros(len(growth))
        colors = ["C3" if x > limit else "C0" for x, limit in zip(growth, limits, strict=True)]
        axes.scatter(growth, hertz, c=colors, marker="x", zorder=3)
        places: dict[tuple[float, float], list[int]] = {}
        for k, place in enumerate(zip(growth.tolist(), hertz.tolist(), strict=True)):
            places.setdefault(place, []).append(k + 1)
        for place, numbers in places.items():  # equal eigenvalues share a label
            words = ", ".join(map(str, numbers[:3])) + (", ..." if len(numbers) > 3 else "")
            axes.annotate(words, place, xytext=(5, 3), textcoords="offset points", fontsize="small")
        axes.axvline(0.0, color="k", linewidth=0.8)
        axes.set_xlabel("growth [1/s]")
        axes.set_ylabel("frequency [Hz]")
        axes.grid(alpha=0.3)
        return figure_of(axes)

    @property
    def moves_most(self) -> tuple[str, ...]:
        """Name of the body with the largest share in the kinetic energy of each mode."""
        return tuple(self.bodies[int(np.argmax(shares))] if len(shares) else "" for shares in self.energy_shares)

    @property
    def frequencies(self) -> Array:
        """Damped frequencies Im(lambda)/2 pi, (n_modes,) [Hz]; 0 without oscillation."""
        return np.abs(self.eigenvalues.imag) / (2 * np.pi)

    @property
    def natural_frequencies(self) -> Array:
        """Undamped frequencies |lambda|/2 pi, (n_modes,) [Hz]."""
        return np.abs(self.eigenvalues) / (2 * np.pi)

    @property
    def damping_ratios(self) -> Array:
        """Damping ratios -Re(lambda)/|lambda|, (n_modes,); 1 for decay without oscillation, 0 for lambda = 0."""
        size = np.abs(self.eigenvalues)
        return np.divide(-self.eigenvalues.real, size, out=np.zeros(len(size)), where=size > 0)

    @property
    def is_stable(self) -> bool:
        """Whether no mode grows by more than the error bound of its eigenvalue."""
        errors = self.errors if len(self.errors) else 0.0
        return bool((self.eigenvalues.real <= errors).all())


def system_modes(linear: LinearSystem) -> SystemModes:
    """Return all modes of a linearised system.

    Without damping, gyroscopic and circulatory terms, the symmetric pencil (K, M) is solved, which gives real
    frequencies. Otherwise, the first-order pencil of (z, z_dot) is solved.

    Parameters
    ----------
    linear
        A linearised system from `linearize`.
    """
    system, _ = linear.with_mass()
    n = system.n_z
    M, C, K = (np.asarray(a)[:n, :n] for a in (system.M, system.C, system.K))
    omega2, Z = undamped_modes((K + K.T) / 2, (M + M.T) / 2)
    highest = float(np.sqrt(np.abs(omega2).max(initial=0.0))) or 1.0  # 1 if only states act as springs
    beside = ROUNDING * motions_beside(system, Z)
    # errors of the entries of Z.T @ K @ Z and Z.T @ C @ Z, from the frequencies of the two modes of each entry
    higher = np.maximum.outer(np.abs(omega2), np.abs(omega2))
    error_K = MODEL * higher + ROUNDING * np.abs(Z).T @ np.abs(K) @ np.abs(Z) + beside.T @ np.abs(K) @ beside
    error_C = UNDAMPED * np.sqrt(higher) + ROUNDING * np.abs(Z).T @ np.abs(C) @ np.abs(Z)
    is_conservative = not system.states and (
        (np.abs(Z.T @ C @ Z) <= error_C).all() and (np.abs(Z.T @ (K - K.T) @ Z) <= 2 * error_K).all()
    )
    if is_conservative:
        noise = np.diag(error_K)
        omega2 = np.where(np.abs(omega2) <= noise, 0.0, omega2)
        root = np.sqrt(omega2.astype(complex))
        eigenvalues, shapes = np.where(omega2 >= 0, 1j * root.real, root.imag), Z.astype(complex)
        errors = np.divide(noise, 2 * np.abs(root), out=np.zeros(len(noise)), where=omega2 != 0)
        for k in np.flatnonzero(omega2 < 0):  # an unstable mode and a decaying one belong together
            eigenvalues, errors = np.append(eigenvalues, -eigenvalues[k]), np.append(errors, errors[k])
            shapes = np.column_stack([shapes, shapes[:, k]])
    else:
        A, of_terms = state_matrix(system, Z, highest)
        dA, rates = ROUNDING * of_terms + MODEL * np.abs(A), slice(n, 2 * n)
        dA[rates, :n] += beside.T @ np.abs(K) @ beside / highest
        dA[rates, rates] += beside.T @ np.abs(C) @ beside
        eigenvalues, vectors, errors = eigenvalues_with_errors(A, dA)
        eigenvalues, vectors, errors = with_motions_that_cost_nothing(A, eigenvalues, vectors, errors)
        of_z = np.r_[:n, 2 * n : len(A)]
        shapes = la.block_diag(Z, np.eye(len(system.states))) @ vectors[of_z]
    order = np.lexsort((eigenvalues.imag, np.abs(eigenvalues)))
    of_states = np.pad(shapes, ((0, len(system.M) - len(shapes)), (0, 0)))[n:, order]
    shapes = (system.N[:, : len(shapes)] @ shapes)[:, order]
    largest = shapes[np.abs(shapes).argmax(axis=0), np.arange(shapes.shape[1])]
    if system.states:  # a state that moves no body has a mode of its own
        own = of_states[np.abs(of_states).argmax(axis=0), np.arange(shapes.shape[1])]
        largest = np.where(np.abs(largest) > LEAST_BODY_MOTION * np.abs(own), largest, own)
    energies = np.array([np.einsum("uk,uv,vk->k", shapes[u].conj(), m, shapes[u]).real for u, m in linear.bodies()])
    total = energies.sum(axis=0)
    shares = np.divide(energies, total, out=np.zeros_like(energies), where=total > 0).T
    return SystemModes(
        eigenvalues[order],
        shapes / largest,
        shares,
        linear.body_names,
        system.states,
        of_states / largest,
        errors[order],
    )


def undamped_modes(K: Array, M: Array) -> tuple[Array, Array]:
    """Return ascending omega² and the modes of a symmetric matrix pair, low modes as accurate as high ones.

    Errors of the solver are proportional to the highest omega². Therefore much lower modes are computed again in their
    own subspace.
    """
    omega2, Z = la.eigh(K, M)
    n = len(omega2)
    while True:
        n_low = int((np.abs(omega2[:n]) < LOW * np.abs(omega2[:n]).max(initial=0.0)).sum())
        if n_low == 0:
            break
        low = np.argsort(np.abs(omega2[:n]))[:n_low]
        rest = np.setdiff1d(np.arange(n), low)
        Z[:, :n] = Z[:, np.concatenate([low, rest])]
        omega2[:n] = omega2[np.concatenate([low, rest])]
        Q, n = Z[:, :n_low], n_low
        omega2[:n], y = la.eigh(Q.T @ K @ Q, Q.T @ M @ Q)
        Z[:, :n] = Q @ y
    order = np.argsort(omega2)
    return omega2[order], Z[:, order]


def state_matrix(system: LinearSystem, Z: Array, highest: float) -> tuple[Array, Array]:
    """Return A of the first-order equations in undamped modal coordinates, and the sizes of its terms.

    Velocities are divided by the highest frequency, so that the matrix is well scaled.
    """
    n, m = system.n_z, len(system.states)
    rates, states = slice(n, 2 * n), slice(2 * n, 2 * n + m)
    terms = (system.M, system.C, system.K, Z)
    made = []
    for (M, C, K, Y), sign in ((terms, -1.0), ([np.abs(a) for a in terms], 1.0)):
        A = np.zeros((states.stop, states.stop))
        A[:n, rates] = highest * np.eye(n) if sign < 0 else 0.0
        A[rates, :n] = sign * Y.T @ K[:n, :n] @ Y / highest
        A[rates, rates] = sign * Y.T @ C[:n, :n] @ Y
        A[rates, states] = sign * Y.T @ K[:n, n:] / highest
        A[states, :n] = sign * K[n:, :n] @ Y
        A[states, rates] = sign * C[n:, :n] @ Y * highest
        A[states, states] = sign * K[n:, n:]
        A[states] += sign * M[n:, :n] @ Y @ A[rates] * highest
        made.append(A)
    return made[0], made[1]


def motions_beside(system: LinearSystem, Z: Array) -> Array:
    """Return the sizes of motions coupled with each mode, at equal kinetic energy, (n_z, n).

    Directions of axes and of a steady rotation have the relative error `ROUNDING`, so that every motion contains
    that fraction of coupled motions. K of a free motion is then not zero, but of the order of the square of this
    fraction, with either sign.
    """
    n = system.n_z
    M, C, K = (np.abs(a[:n, :n]) for a in (system.M, system.C, system.K))
    is_coupled = M + C + K + (M + C + K).T > 0
    size = np.sqrt(np.diag(M))
    return (is_coupled @ (size[:, None] * np.abs(Z))) / size[:, None]


def eigenvalues_with_errors(A: Array, dA: Array) -> tuple[Array, Array, Array]:
    """Return all eigenvalues with unit eigenvectors and error bounds.

    The two-sided Rayleigh quotient removes the error of the solver, which is proportional to the norm of the whole
    matrix. An error dA of the matrix changes lambda by up to |w|ᵀ |dA| |v| / |wᴴ v|, with left eigenvector w and right
    eigenvector v. This is small for modes that involve only small entries, and large if eigenvectors are nearly
    parallel.
    """
    _, W, V = la.eig(A, left=True, right=True)
    overlap = np.einsum("xk,xk->k", W.conj(), V)
    is_regular = np.abs(overlap) > np.finfo(float).eps
    safe = np.where(is_regular, overlap, 1.0)
    values = np.einsum("xk,xk->k", W.conj(), A @ V) / safe
    errors = np.einsum("xk,xk->k", np.abs(W), dA @ np.abs(V)) / np.abs(safe)
    plain = np.einsum("xk,xk->k", V.conj(), A @ V)  # for a defective eigenvalue, which is not improved
    return np.where(is_regular, values, plain), V, np.where(is_regular, errors, np.inf)


def with_motions_that_cost_nothing(A: Array, eigenvalues: Array, V: Array, errors: Array) -> tuple[Array, Array, Array]:
    """Return one mode of each conjugate pair, and a mode with lambda = 0 for each motion without resistance.

    Q spans the eigenvectors of zero. Motions without resistance are the null space of A within Q, without velocities.
    The two eigenvectors of such a motion differ only by roundoff, so that Q has fewer columns than there are zeros.
    """
    is_zero = np.abs(eigenvalues) <= errors
    kept = ~is_zero & (eigenvalues.imag >= 0)
    both = np.concatenate([V[:, is_zero].real, V[:, is_zero].imag], axis=1)
    Q, values, _ = np.linalg.svd(both, full_matrices=False)
    Q = Q[:, values > np.finfo(float).eps / FREE * values.max(initial=0.0)][:, : int(is_zero.sum())]
    _, values, right = np.linalg.svd(Q.T @ A @ Q)
    free = Q @ right[values <= FREE * np.abs(A).max(initial=0.0)].T
    zeros = np.zeros(free.shape[1])
    return (
        np.concatenate([zeros, eigenvalues[kept]]),
        np.concatenate([free, V[:, kept]], axis=1),
        np.concatenate([zeros, errors[kept]]),
    )
