"""Fixtures of this room."""

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from floatframe.model.rotations import euler_parameter_rates
from tests.floatframe.integrators.examples import N_Q, OMEGA, T_END, accelerations


@pytest.fixture(scope="module")
def exact():
    """Return t -> (p, q, omega, q_dot, force on the ground)."""

    def rates(_, x):
        p, q, omega, q_dot = x[:4] / np.linalg.norm(x[:4]), x[4 : 4 + N_Q], x[4 + N_Q : 7 + N_Q], x[7 + N_Q :]
        alpha, q_ddot, _ = accelerations(p, q, omega, q_dot)
        return np.concatenate([euler_parameter_rates(p, omega), q_dot, alpha, q_ddot])

    start = np.concatenate([[1.0, 0, 0, 0], np.zeros(N_Q), OMEGA, np.zeros(N_Q)])
    solution = solve_ivp(rates, (0, T_END), start, method="DOP853", rtol=1e-12, atol=1e-12, dense_output=True)

    def at(t):
        x = solution.sol(t)
        p = x[:4] / np.linalg.norm(x[:4])
        q, omega, q_dot = x[4 : 4 + N_Q], x[4 + N_Q : 7 + N_Q], x[7 + N_Q :]
        return p, q, omega, q_dot, accelerations(p, q, omega, q_dot)[2]

    return at
