"""Shaken models in general position beside equations of motion that are written out here: every term is there."""

from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy.signal import lsim

from fe_models.foundation.units import unit_system
from floatframe.durability.shaking.loads.shock import TimeTest, time_runs
from floatframe.durability.shaking.structure.model import Base, Output, ShakenModel, response

N_M, N_OUT = 5, 4
INPUTS, RATES = ("base:x", "base:rz", "tip:y", "tip:rx", "load case a"), np.array([2, 2, 0, 0, 0])
TO_MODEL = np.array([1e-3, 1e-6, 1e-3, 1.0, 1.0])  # m/s², rad/s², N, N m, none in mm, kg, ms


def any_model(seed, *, coupled, n_residual):
    """Modes from 20 Hz to 300 Hz; all rates of bases and modes act on all outputs, in mm, kg, ms."""
    rng = np.random.default_rng(seed)
    omega = 2 * np.pi * 1e-3 * np.sort(rng.uniform(20, 300, N_M))
    C = np.diag(2 * rng.uniform(0.02, 0.1, N_M) * omega)
    if coupled:
        L = 0.2 * rng.normal(size=(N_M, N_M))
        C += omega[0] * L @ L.T
    size = omega[0] ** (2.0 - np.arange(3))[:, None, None]  # all rates weigh alike
    B, E, D = (rng.normal(size=(3, *shape)) * size for shape in ((N_M, 5), (N_OUT, N_M), (N_OUT, 5)))
    E /= omega[0] ** 2
    for matrix in (B, D):
        matrix[1:, :, RATES == 0] = 0.0
    kinds = ("acceleration", "displacement", "force", "moment")
    return ShakenModel(
        name="any", units=unit_system("mm-kg-ms"), bases=(Base("base", ("foot",), np.zeros(3)),), inputs=INPUTS,
        rates=RATES, omega=omega, C=C, B=B, E=E, D=D, outputs=tuple(Output(kind, kind, "", kind) for kind in kinds),
        mass=np.eye(6), n_residual=n_residual,
    )  # fmt: skip


CASES = [(coupled, n_residual) for coupled in (False, True) for n_residual in (0, 2)]


@pytest.mark.parametrize(("coupled", "n_residual"), CASES)
def test_a_response_solves_the_equations_of_motion(coupled, n_residual):
    """Modes that respond statically have eta = load/omega², and no rates."""
    model = any_model(3, coupled=coupled, n_residual=n_residual)
    frequencies = np.array([3.0, 40.0, 155.0, 700.0])
    dynamic = np.arange(N_M) < N_M - n_residual
    found = response(model, frequencies)
    for f, H in zip(frequencies, found, strict=True):
        iw = 2j * np.pi * f * 1e-3
        powers = np.array([[iw ** (r - rate) for rate in RATES] for r in range(3)])  # s^(r) of inputs of size 1
        load, direct = ((powers[:, None, :] * matrix).sum(axis=0) for matrix in (model.B, model.D))
        inertia = np.where(dynamic, iw**2, 0.0)
        damping = iw * model.C * np.outer(dynamic, dynamic)
        eta = np.linalg.solve(np.diag(inertia + model.omega**2) + damping, load)
        rates = [eta, iw * dynamic[:, None] * eta, iw**2 * dynamic[:, None] * eta]
        expected = sum(E @ x for E, x in zip(model.E, rates, strict=True)) + direct
        assert_allclose(H, expected, rtol=0, atol=1e-12 * np.abs(expected).max())


@pytest.mark.parametrize("by_acceleration", [True, False])
@pytest.mark.parametrize(("coupled", "n_residual"), CASES)
def test_a_transient_solves_the_equations_of_motion(coupled, n_residual, by_acceleration):
    """SciPy's exact steps of the states (modes, then the motions of the base), inputs straight between samples.

    Where displacements and velocities of a base act on modes, they are taken as straight between samples, too.
    """
    model = any_model(4, coupled=coupled, n_residual=n_residual)
    if by_acceleration:
        model = replace(model, B=np.where((np.arange(3)[:, None, None] < 2) & (RATES == 2), 0.0, model.B))
    t = np.linspace(0.0, 0.05, 101)
    rng = np.random.default_rng(5)
    rows = np.cumsum(rng.normal(size=(5, t.size)), axis=1) / TO_MODEL[:, None]
    histories = dict(zip(INPUTS, rows, strict=True))
    (run,) = time_runs(model, TimeTest("t", t, inputs=histories, after=0.0))
    ms = 1e3 * run.t
    u = np.stack([np.interp(run.t, t, row) for row in rows]) * TO_MODEL[:, None]
    assert_allclose(run.input_values, u, rtol=1e-9, atol=0)
    n_d, moved = N_M - n_residual, RATES == 2
    n = 2 * n_d + 4  # eta, eta_dot, s, s_dot of the two directions of the base
    at = {"eta": slice(0, n_d), "eta_dot": slice(n_d, 2 * n_d), "s": slice(2 * n_d, n - 2), "s_dot": slice(n - 2, n)}

    def by_states(matrix):
        """Return what acts through s, s_dot and the inputs, as rows on states and on inputs."""
        states, inputs = np.zeros((matrix.shape[1], n)), np.where(moved, matrix[2], matrix[0])
        states[:, at["s"]], states[:, at["s_dot"]] = matrix[0][:, moved], matrix[1][:, moved]
        return states, inputs

    (by_x, by_u), (direct_x, direct_u) = by_states(model.B), by_states(model.D)
    A, B = np.zeros((n, n)), np.zeros((n, 5))
    A[at["eta"], at["eta_dot"]] = np.eye(n_d)
    A[at["eta_dot"]] = by_x[:n_d]
    A[at["eta_dot"], at["eta"]] = -np.diag(model.omega[:n_d] ** 2)
    A[at["eta_dot"], at["eta_dot"]] = -model.C[:n_d, :n_d]
    B[at["eta_dot"]] = by_u[:n_d]
    A[at["s"], at["s_dot"]] = np.eye(2)
    B[at["s_dot"], :2] = np.eye(2)
    _, _, x = lsim((A, B, np.eye(n), np.zeros((n, 5))), u.T, ms, interp=True)
    second = x @ A[at["eta_dot"]].T + u.T @ B[at["eta_dot"]].T
    rates = [x[:, at["eta"]], x[:, at["eta_dot"]], second]
    expected = sum(rate @ E[:, :n_d].T for E, rate in zip(model.E, rates, strict=True))
    static = (x @ by_x[n_d:].T + u.T @ by_u[n_d:].T) / model.omega[n_d:] ** 2
    expected = expected + static @ model.E[0][:, n_d:].T + x @ direct_x.T + u.T @ direct_u.T
    bound = 1e-9 if by_acceleration else 2e-2
    assert_allclose(run.values.T, expected, rtol=0, atol=bound * np.abs(expected).max(axis=0).min())
