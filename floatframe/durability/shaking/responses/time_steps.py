"""Exact time steps of linear oscillators under loads that are linear between samples.

    eta_ddot + 2 zeta omega eta_dot + omega² eta = a(t),  a straight between t_n and t_n+1

(1) x = (eta, eta_dot): x_n+1 = A x_n + B_0 a_n + B_1 a_n+1, from the power series of the motion in a step
(2) with x eliminated: eta_n + c_1 eta_n-1 + c_2 eta_n-2 = Σ b_k a_n-k, where c follows from the trace and determinant
    of A; this is a digital filter, whose initial values satisfy x_0 and a_0
"""

from dataclasses import dataclass

import numpy as np
import scipy.linalg as la
from scipy.signal import lfilter

from fe_models.foundation.arrays import Array, IntArray
from floatframe.durability.shaking.structure.model import ShakenModel

__all__ = ["Motion", "base_motions", "histories", "oscillator", "state_matrix"]

LONGEST_STEP = 4.0  #: omega h up to which the series loses fewer than three digits
MOST_TERMS = 80  #: largest number of terms of the series
SMALL = 1.0  #: magnitude of an exponent below which differences would lose digits


@dataclass(frozen=True, eq=False)
class Motion:
    """Displacement, velocity and acceleration of an oscillator, (n_t,) each."""

    value: Array
    rate: Array
    second: Array


def oscillator(omega: float, zeta: float, load: Array, h: float) -> Motion:
    """Return the motion from rest under a load that is linear between its samples.

    Parameters
    ----------
    omega, zeta
        Angular frequency [rad/s] and damping ratio of any size.
    load
        Load a(t), (n_t,).
    h
        Time between its samples [s].
    """
    a = np.asarray(load, dtype=float)
    if not len(a):
        return Motion(a, a, a)
    (A_00, A_01, A_10, A_11), B_0, B_1 = step_of(omega, zeta, h)
    c = np.array([1.0, -(A_00 + A_11), A_00 * A_11 - A_01 * A_10])
    # transfer function adj(z - A) (B_0 + B_1 z) / (z² - tr z + det): rows of the numerator by decreasing powers of z
    adjugate = ((-A_11, A_01), (A_10, -A_00))
    outputs = []
    for k in range(2):
        left, right = adjugate[k]
        b = np.array([B_1[k], B_0[k] + left * B_1[0] + right * B_1[1], left * B_0[0] + right * B_0[1]])
        x_1 = B_0[k] * a[0] + (B_1[k] * a[1] if len(a) > 1 else 0.0)
        start = [-b[0] * a[0], x_1 - b[1] * a[0] - (b[0] * a[1] if len(a) > 1 else 0.0)]
        outputs.append(lfilter(b, c, a, zi=np.array(start))[0])
    value, rate = outputs
    return Motion(value, rate, a - 2 * zeta * omega * rate - omega**2 * value)


def step_of(omega: float, zeta: float, h: float) -> tuple[tuple[float, ...], tuple[float, ...], tuple[float, ...]]:
    """Return A by rows, B_0 and B_1 of x_n+1 = A x_n + B_0 a_n + B_1 a_n+1, from the power series of the motion.

    For eta = Σ c_k (t/h)^k the equation is (k+2)(k+1) c_k+2 = h² a_k - 2 zeta omega h (k+1) c_k+1 - (omega h)² c_k,
    with the initial states (1, 0) and (0, 1) and the loads 1 - t/h and t/h. The series converges for every step. If
    omega h is so large that its terms cancel, the matrix exponential is used. No damping ratio needs a special case.
    """
    p, z = omega * h, 2 * zeta * omega * h
    if max(p, z) > LONGEST_STEP:
        states = np.zeros((4, 4))  # x, a, h a_dot
        states[:2, :2] = [[0.0, h], [-(omega**2) * h, -z]]
        states[1, 2], states[2, 3] = h, 1.0
        step = la.expm(states)
        B_1 = step[:2, 3]
        return tuple(step[:2, :2].ravel()), tuple(step[:2, 2] - B_1), tuple(B_1)
    ends = [
        end_of_series(p, z, h, *start)
        for start in ((1.0, 0.0, 0.0, 0.0), (0.0, h, 0.0, 0.0), (0.0, 0.0, 1.0, -1.0), (0.0, 0.0, 0.0, 1.0))
    ]
    return (ends[0][0], ends[1][0], ends[0][1], ends[1][1]), ends[2], ends[3]


def end_of_series(
    p: float, z: float, h: float, c: float, following: float, a: float, slope: float
) -> tuple[float, float]:
    """Return value and rate at the end of a step; c and `following` begin the series, the load is a + slope t/h."""
    value, rate, largest = c + following, following, abs(c) + abs(following)
    load = (a * h * h, slope * h * h)
    for k in range(MOST_TERMS):
        own = (load[k] if k < 2 else 0.0) - z * (k + 1) * following - p * p * c
        c, following = following, own / ((k + 2) * (k + 1))
        value, rate = value + following, rate + (k + 2) * following
        largest = max(largest, abs(following))
        if k > 1 and (k + 2) * (abs(c) + abs(following)) <= 1e-18 * largest:
            break
    return value, rate / h


def base_motions(acceleration: Array, h: float) -> Motion:
    """Return displacement and velocity, from rest, for accelerations that are linear between samples, (n_t,) each."""
    a = np.asarray(acceleration, dtype=float)
    v = np.concatenate([[0.0], np.cumsum((a[1:] + a[:-1]) * h / 2)])
    steps = v[:-1] * h + (2 * a[:-1] + a[1:]) * h**2 / 6
    return Motion(np.concatenate([[0.0], np.cumsum(steps)]), v, a)


def histories(model: ShakenModel, inputs: Array, h: float, columns: IntArray) -> Array:
    """Return the outputs over time for inputs that are linear between samples, (n_out, n_t).

    Parameters
    ----------
    inputs
        Histories of the inputs with the indices `columns`, (n_act, n_t) [units of the model].
    h
        Time between samples [units of time of the model].
    """
    n_t = inputs.shape[1]
    s = [motion_of_input(inputs[j], int(model.rates[k]), h) for j, k in enumerate(columns)]
    load = np.zeros((len(model.omega), n_t))
    out = np.zeros((len(model.outputs), n_t))
    for j, k in enumerate(columns):
        for rate, values in enumerate((s[j].value, s[j].rate, s[j].second)):
            if model.B[rate, :, k].any():
                load += np.outer(model.B[rate, :, k], values)
            if model.D[rate, :, k].any():
                out += np.outer(model.D[rate, :, k], values)
    n_d = len(model.omega) - model.n_residual
    for m in range(n_d, len(model.omega)):
        out += np.outer(model.E[0, :, m], load[m] / model.omega[m] ** 2)
    if model.is_modal:
        zeta = model.damping_ratios
        for m in range(n_d):
            add_mode(out, model.E[:, :, m], oscillator(float(model.omega[m]), float(zeta[m]), load[m], h))
        return out
    eta, eta_dot = coupled(model, load[:n_d], h)
    eta_ddot = load[:n_d] - model.C[:n_d, :n_d] @ eta_dot - model.omega[:n_d, None] ** 2 * eta
    for rate, values in enumerate((eta, eta_dot, eta_ddot)):
        out += model.E[rate, :, :n_d] @ values
    return out


def add_mode(out: Array, E: Array, motion: Motion) -> None:
    """Add the contribution of a mode to the outputs."""
    for rate, values in enumerate((motion.value, motion.rate, motion.second)):
        rows = np.flatnonzero(E[rate])
        if len(rows):
            out[rows] += np.outer(E[rate, rows], values)


def motion_of_input(values: Array, rate: int, h: float) -> Motion:
    """Return s and its rates from its r-th rate, r = 0 or 2; unneeded rates of a force are zero."""
    if rate == 2:
        return base_motions(values, h)
    zero = np.zeros_like(values)
    return Motion(np.asarray(values, dtype=float), zero, zero)


def state_matrix(model: ShakenModel, n_d: int) -> Array:
    """Return the matrix A of the states of the first n_d modes, (eta, eta_dot)_dot = A (eta, eta_dot) at rest."""
    A = np.zeros((2 * n_d, 2 * n_d))
    A[:n_d, n_d:] = np.eye(n_d)
    A[n_d:, :n_d], A[n_d:, n_d:] = -np.diag(model.omega[:n_d] ** 2), -model.C[:n_d, :n_d]
    return A


def coupled(model: ShakenModel, load: Array, h: float) -> tuple[Array, Array]:
    """Return eta and eta_dot of modes coupled by damping, (n_d, n_t) each, by filters in eigenvectors of the states."""
    n_d, n_t = load.shape
    mu, X = np.linalg.eig(state_matrix(model, n_d))
    left = np.linalg.solve(X, np.vstack([np.zeros((n_d, n_d)), np.eye(n_d)]))
    eta, eta_dot = np.zeros((n_d, n_t)), np.zeros((n_d, n_t))
    for k in range(2 * n_d):
        if mu[k].imag < 0:
            continue
        twice = 2.0 if mu[k].imag > 0 else 1.0  # includes the conjugate eigenvalue
        e, phi_1, phi_2 = exponentials(mu[k] * h)
        f = left[k] @ load
        b = h * np.array([phi_2, phi_1 - phi_2])  # factors of a_n+1, a_n
        p = lfilter(b, [1.0, -e], f, zi=np.array([-b[0] * f[0]]))[0]
        eta += twice * np.outer(X[:n_d, k], p).real
        eta_dot += twice * np.outer(X[n_d:, k], p).real
    return eta, eta_dot


def exponentials(z: complex) -> tuple[complex, complex, complex]:
    """Return exp(z), (exp(z) - 1)/z and (exp(z) - 1 - z)/z²; for small z, from the series of the last one."""
    if abs(z) > SMALL:
        e = complex(np.exp(z))
        return e, (e - 1) / z, (e - 1 - z) / z**2
    term, phi_2 = 0.5 + 0j, 0.5 + 0j
    for k in range(3, 30):
        term *= z / k
        phi_2 += term
    phi_1 = 1 + z * phi_2
    return 1 + z * phi_1, phi_1, phi_2
