"""A motion in pieces, each from the last state of the one before, against closed forms of the whole."""

import numpy as np
import pytest
from numpy.testing import assert_allclose

import floatframe as ff

PLACE = np.array([30.0, -20.0, 10.0])
METHODS = [
    (ff.GeneralizedAlpha(0.8), "absolute"), (ff.GeneralizedAlpha(0.8), "relative"),
    (ff.integrators.EnergyMomentum(), None),
    (ff.integrators.EnergyDecaying(0.5), None), (ff.integrators.Variational(), None),
]  # fmt: skip


def in_pieces(system, method, formulation, t_end, h, n):
    """Return the last piece of runs of n steps each."""
    state, done, total = None, 0, round(t_end / h)
    while done < total:
        last = min(done + n, total)
        motion = ff.integrate(
            system, method, last * h, h, t_start=done * h, state=state, formulation=formulation, watch="off"
        )
        state, done = motion.state(-1), last
    return motion


@pytest.mark.parametrize(("method", "formulation"), METHODS)
def test_states_of_user_forces_go_on(method, formulation):
    """Exact: e = 1 - exp(-t/tau) from its own equation, and v = F/m (t - tau e) by the force F e."""
    tau, F, m, t_end = 0.4, 3.0, 2.0, 1.0
    slider = ff.RigidBody("slider", m, 0.1 * np.eye(3), position=PLACE)
    ends = ff.Marker("ground", position=PLACE), ff.Marker("slider", position=np.zeros(3))
    rail = ff.PrismaticJoint("rail", *ends, axis=(1, 0, 0))
    force = ff.UserForce(
        "lag", {"x": ff.joints.JointCoordinate("rail", "distance")}, {"x": "F*e"}, {"e": "(1 - e)/tau"}, {"e": 0.0},
        {"F": F, "tau": tau},
    )  # fmt: skip
    motion = in_pieces(ff.System([slider], [rail], [force]), method, formulation, t_end, 0.02, 7)
    exact = F / m * (t_end - tau * (1 - np.exp(-t_end / tau)))
    assert_allclose(motion.body("slider").v[-1], [exact, 0, 0], rtol=0, atol=2e-3 * exact)


@pytest.mark.parametrize(("method", "formulation"), METHODS)
@pytest.mark.parametrize("kind", ["bushing", "user force"])
def test_turns_go_on(method, formulation, kind):
    """Exact: a wheel on a torsional spring swings by 9 rad, omega_0/omega sin(omega t), through a full turn."""
    J, omega, omega_0, h = 0.3, 2.0, 18.0, 0.01
    wheel = ff.RigidBody("wheel", 1.0, np.diag([J, J, J]), position=PLACE, omega_B=(0, 0, omega_0))
    ends = ff.Marker("ground", position=PLACE), ff.Marker("wheel", position=np.zeros(3))
    hinge = ff.RevoluteJoint("hinge", *ends, axis=(0, 0, 1))
    k = J * omega**2
    if kind == "bushing":
        spring = ff.forces.Bushing("spring", *ends, np.diag([0, 0, 0, 0, 0, k]))
    else:
        spring = ff.UserForce(
            "spring", {"x": ff.joints.JointCoordinate("hinge", "angle")}, {"x": "-k*x"}, parameters={"k": k}
        )
    t_end = 1.2
    motion = in_pieces(ff.System([wheel], [hinge], [spring]), method, formulation, t_end, h, 30)
    exact = omega_0 * np.cos(omega * t_end)
    assert_allclose(motion.body("wheel").omega_B[-1], [0, 0, exact], rtol=0, atol=0.01 * omega_0)
