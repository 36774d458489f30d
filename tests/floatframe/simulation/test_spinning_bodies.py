"""Bodies that turn by 0.1 to 3 rad in a step: right to 5 %, refused, or told."""

from functools import cache
from itertools import product

import numpy as np
import pytest
from scipy.integrate import solve_ivp

import floatframe as ff
from floatframe.model.rotations import rotation_matrix

J = np.array([0.03, 0.02, 0.012])  #: principal moments of inertia: no two are equal
TILT = np.array([0.05, 0.02, 0.03])  #: angular velocity beside the spin, over the spin
MASS, ARM, G = 1.0, 0.3, 9.81
H, N_STEPS = 0.01, 100
METHODS = [
    (ff.GeneralizedAlpha(0.8), "absolute"), (ff.GeneralizedAlpha(0.8), "relative"),
    (ff.GeneralizedAlpha(1.0), "absolute"), (ff.integrators.EnergyMomentum(), None),
    (ff.integrators.EnergyDecaying(0.5), None),
]  # fmt: skip


@cache
def exact_axes(omega, arm):
    """Return the axes of a body over the steps by Euler's equations about its origin or fixed point, (n_t, 3, 3).

    arm: distance of the centre of mass from the fixed point along the third axis; 0: the body is free.
    """
    about = J + MASS * arm**2 * np.array([1.0, 1.0, 0.0])

    def rates(t, y):
        w, A = y[:3], y[3:].reshape(3, 3)
        torque = np.cross([0.0, 0.0, arm], A.T @ [0.0, 0.0, -MASS * G])
        return np.concatenate([(torque - np.cross(w, about * w)) / about, (A @ skew(w)).ravel()])

    t = H * np.arange(N_STEPS + 1)
    found = solve_ivp(rates, (0, t[-1]), np.concatenate([omega, np.eye(3).ravel()]), "DOP853", t, rtol=1e-9, atol=1e-9)
    return found.y[3:].T.reshape(-1, 3, 3)


def skew(w):
    return np.array([[0.0, -w[2], w[1]], [w[2], 0.0, -w[0]], [-w[1], w[0], 0.0]])


def spins():
    """Yield all combinations; those with an odd sum of indices are long: in the other half all pairs of values meet."""
    ways = [0.1, 0.3, 1.0, 3.0], [0, 1, 2], [0.0, ARM], METHODS
    for i, j, k, n in product(*(range(len(each)) for each in ways)):
        turn, axis, arm, of = (each[index] for each, index in zip(ways, (i, j, k, n), strict=True))
        yield pytest.param(turn, axis, arm, *of, marks=pytest.mark.long if (i + j + k + n) % 2 else ())


@pytest.mark.parametrize(("turn", "axis", "arm", "method", "formulation"), list(spins()))
def test_an_asymmetric_body_that_spins_is_right_or_told(method, formulation, arm, axis, turn):
    """About each of its axes, free and as a heavy top; about the middle one it tumbles."""
    omega = turn / H * np.roll([1.0, TILT[0], TILT[1]], axis)
    body = ff.RigidBody(
        "b", MASS, np.diag(J), position=(0, 0, arm), velocity=np.cross(omega, [0, 0, arm]), omega_B=omega
    )
    ball = ff.SphericalJoint("ball", ff.Marker("ground", position=np.zeros(3)), ff.Marker("b", position=[0, 0, -arm]))
    system = ff.System([body], [ball] if arm else [], [ff.Gravity((0, 0, -G))] if arm else [])
    try:
        motion = ff.integrate(system, method, N_STEPS * H, H, formulation=formulation)
    except ff.errors.ConvergenceError:
        assert turn >= 1.0
        return
    exact = exact_axes(tuple(omega.tolist()), arm)
    apart = np.einsum("tai,taj->tij", exact, rotation_matrix(motion.body("b").p))
    angle = np.arccos(np.clip((np.trace(apart, axis1=1, axis2=2) - 1) / 2, -1, 1)).max()
    is_right = angle < 0.05 * 2 * np.pi
    assert is_right or any(note.kind == "steps" for note in motion.validity)
    assert turn > 0.1 or is_right
