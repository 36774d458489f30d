"""The reference beams themselves: derivatives, closed forms, energy, and each against the other."""

import numpy as np
import pytest
import scipy.linalg as la
from numpy.testing import assert_allclose

from tests.references.ancf_beam import AncfBeam
from tests.references.exact_beam import ExactBeam
from tests.references.planar_dynamics import Problem, equilibrium, integrate

L, EA, GA, EI, RHO_A, RHO_I = 2.0, 4e5, 2e5, 300.0, 1.5, 1e-3


def exact(n=8, **changes):
    values = {"EA": EA, "GA": GA, "EI": EI, "rho_A": RHO_A, "rho_I": RHO_I} | changes
    return ExactBeam((0, 0), (L, 0), n, **values)


def ancf(n=8):
    return AncfBeam((0, 0), (L, 0), n, EA, EI, RHO_A)


def still(value):
    return lambda t: (value, 0.0, 0.0)


@pytest.mark.parametrize("beam", [exact(3), ancf(3)], ids=["exact", "ancf"])
def test_stiffness_is_the_derivative_of_the_force_and_the_force_vanishes_in_rigid_motion(beam):
    rng = np.random.default_rng(0)
    x = beam.x0 + 0.1 * rng.normal(size=beam.n_dof)
    _, K = beam.force(x)
    s = 1e-6
    columns = [(beam.force(x + e)[0] - beam.force(x - e)[0]) / (2 * s) for e in s * np.eye(beam.n_dof)]
    assert_allclose(K.toarray(), np.array(columns).T, rtol=0, atol=1e-6 * np.abs(K).max())
    turned = type(beam)((0.3, 0.2), (0.3 + L * np.cos(2.0), 0.2 + L * np.sin(2.0)), 3, *(
        (EA, GA, EI, RHO_A, RHO_I) if isinstance(beam, ExactBeam) else (EA, EI, RHO_A)
    )).x0  # fmt: skip
    assert np.abs(beam.force(turned)[0]).max() < 1e-9 * EA


@pytest.mark.parametrize("beam", [exact(16), ancf(16)], ids=["exact", "ancf"])
def test_cantilever_under_an_end_moment_becomes_an_arc(beam):
    """kappa = M/EI: with M = pi EI/L a half circle of radius L/pi."""
    if isinstance(beam, ExactBeam):
        fixed = {k: still(v) for k, v in zip(beam.node(0), (0, 0, 0), strict=True)}
        load = np.zeros(beam.n_dof)
        load[beam.node(-1)[2]] = np.pi * EI / L
        x = equilibrium(Problem(beam.mass(), beam.force, beam.x0, fixed), load, steps=20)
        assert_allclose(x[beam.node(-1)], [0, 2 * L / np.pi, np.pi], rtol=0, atol=2e-4)
        return
    fixed = {k: still(v) for k, v in zip(beam.node(0), (0, 0, 1, 0), strict=False) if k != beam.node(0)[2]}
    # the moment does work on the angle of the tangent: applied as a follower in the internal force
    moment, end = np.pi * EI / L, beam.node(-1)

    def force(x, part):
        f, K = beam.force(x)
        a = x[end[2:]]
        w = a @ a
        f = f.copy()
        f[end[2:]] -= part * moment * np.array([-a[1], a[0]]) / w
        K = K.tolil()
        d = np.array([[2 * a[0] * a[1], a[1] ** 2 - a[0] ** 2], [a[1] ** 2 - a[0] ** 2, -2 * a[0] * a[1]]]) / w**2
        for i in range(2):
            for j in range(2):
                K[end[2 + i], end[2 + j]] -= part * moment * d[i, j]
        return f, K.tocsc()

    x = beam.x0
    for part in np.linspace(0.05, 1, 20):
        problem = Problem(beam.mass(), lambda y, part=part: force(y, part), x, fixed)
        x = equilibrium(problem, np.zeros(beam.n_dof), steps=1)
    # the strain (w - 1)/2 lets the axis stretch by what the follower does; small for this EA
    assert_allclose(x[end[:2]], [0, 2 * L / np.pi], rtol=0, atol=2e-3)


def test_small_vibrations_have_the_frequencies_of_the_cantilever():
    beta = np.array([1.8751040687, 4.6940911330]) / L
    slender = exact(24, rho_I=1e-5, GA=1e7, EA=1e7)
    for beam, fixed in ((slender, 3), (ancf(12), 4)):
        _, K = beam.force(beam.x0)
        free = np.arange(fixed, beam.n_dof) if fixed == 3 else np.r_[2, 4 : beam.n_dof]
        omega2 = la.eigvalsh(K.toarray()[np.ix_(free, free)], beam.mass().toarray()[np.ix_(free, free)])
        assert_allclose(np.sqrt(omega2[:2]), beta**2 * np.sqrt(EI / RHO_A), rtol=2e-4)


def test_energy_of_a_free_swinging_beam_is_kept():
    beam = exact(4)
    held = {int(k): still(0.0) for k in beam.node(0)[:2]}
    gravity = beam.mass() @ np.tile([0, -9.81, 0], beam.n_dof // 3)
    problem = Problem(beam.mass(), beam.force, beam.x0, held, load=lambda t: gravity)
    drift = []
    for h in (8e-3, 4e-3):
        motion = integrate(problem, 1.0, h, rho_inf=1.0)
        energy = [sum(beam.energy(x, v)) - gravity @ (x - beam.x0) for x, v in zip(motion.x, motion.v, strict=True)]
        drift.append(np.ptp(energy))
        assert np.ptp(motion.x[:, beam.node(-1)[1]]) > 0.5
    assert drift[1] < 0.35 * drift[0]
    assert drift[1] < 1e-2 * 9.81 * RHO_A * L * L / 2


def test_both_references_swing_alike():
    """A soft pendulum whose chord shortens by four percent; shear and rotary inertia are negligible."""
    soft = {"EI": 3.0, "EA": 2e4}
    one = ExactBeam((0, 0), (L, 0), 10, soft["EA"], 1e5, soft["EI"], RHO_A, 1e-7)
    two = AncfBeam((0, 0), (L, 0), 10, soft["EA"], soft["EI"], RHO_A)
    tips = []
    for beam, pattern in ((one, [0, -9.81, 0]), (two, [0, -9.81, 0, 0])):
        # the vector of a uniform field has no slopes: exact for both interpolations
        gravity = beam.mass() @ np.tile(pattern, beam.n_dof // len(pattern))
        held = {int(k): still(0.0) for k in beam.node(0)[:2]}
        problem = Problem(beam.mass(), beam.force, beam.x0, held, load=lambda t, g=gravity: g)
        tips.append(integrate(problem, 1.2, 4e-3, rho_inf=0.9).x[:, beam.node(-1)[:2]])
    chord = np.linalg.norm(tips[0], axis=1)
    assert chord.min() < 0.97 * L
    assert np.abs(tips[0] - tips[1]).max() < 5e-3 * L
