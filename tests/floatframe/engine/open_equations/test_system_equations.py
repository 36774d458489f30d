"""The open equations against differences, against the integrator's own motions and against their own transposes."""

import numpy as np
import pytest
from numpy.testing import assert_allclose

import floatframe as ff
from floatframe.components.mechanisms import double_pendulum, slider_crank, spinning_top
from floatframe.engine.open_equations import Equations, open_equations
from floatframe.model.functions.time_functions import harmonic
from tests.floatframe.engine.kernels.examples import system_with_everything

ROUNDOFF = 1e-12


def driven_crank():
    """Return a slider-crank whose crank follows a sine."""
    return slider_crank(angle=0.6, drive=harmonic(0.4, 2 * np.pi, phase=0.3, offset=0.6))


def geared():
    """Return two wheels in mesh, one with a spring and a damper about its axis, and a slider on a spring."""
    bodies = [ff.RigidBody(name, 2.0, np.diag([0.2, 0.2, 0.3])) for name in ("small", "large")]
    bodies.append(ff.RigidBody("block", 1.0, 0.1 * np.eye(3), position=(1.0, 0.2, 0.0)))
    joints = [
        ff.RevoluteJoint("axle", ff.GROUND, ff.Marker("small")),
        ff.RevoluteJoint("shaft", ff.GROUND, ff.Marker("large")),
        ff.PrismaticJoint("guide", ff.GROUND, ff.Marker("block"), axis=(1.0, 0.0, 0.0)),
    ]
    wheels = [(ff.joints.JointCoordinate("axle", "angle"), 20.0), (ff.joints.JointCoordinate("shaft", "angle"), 31.0)]
    forces = [
        ff.JointForce("twist", "axle", "angle", stiffness=3.0, damping=0.2, preload=0.4),
        ff.JointForce("push", "guide", "distance", stiffness=30.0, damping=0.7, free=0.1),
        ff.SpringDamper("link", ff.Marker("block"), ff.Marker("large", position=(0.3, 0, 0)), 40.0, 2.0, 0.3),
        ff.Gravity((0.0, -9.81, 0.0)),
    ]
    return ff.System(bodies, joints, forces, couplers=[ff.joints.CoordinateCoupler("gear", wheels)])


SYSTEMS = {
    "crank": lambda: slider_crank(angle=0.5, speed=3.0),
    "driven crank": driven_crank,
    "everything": system_with_everything,
    "gears": geared,
    "top": spinning_top,
}


@pytest.fixture(scope="module", params=SYSTEMS)
def eq(request) -> Equations:
    return open_equations(SYSTEMS[request.param]())


def random_point(eq, seed=3):
    """Return t, and x, v, a, lam near the bodies as placed: on no constraint, but for those with couplers.

    Angles of couplers are angles only where the joints under them are closed.
    """
    t, rng = 0.17, np.random.default_rng(seed)
    x, v = eq.vectors_of_engine(eq.compiled.placed)
    x = eq.configurations.retract(x, 0.1 * rng.normal(size=eq.n_v))
    v, a, lam = v + rng.normal(size=eq.n_v), rng.normal(size=eq.n_v), rng.normal(size=eq.n_lam)
    if eq.system.couplers:
        x, v = eq.project(t, x, v)
        free = eq.null_space(t, x)
        a = eq.accelerations(t, x, v)[0] + free @ rng.normal(size=free.shape[1])
    return t, x, v, a, lam


def differences(function, size, step=1e-3):
    """Return the derivative by central differences of fourth order."""
    columns = []
    for k in range(size):
        d = np.zeros(size)
        d[k] = step
        columns.append((8 * (function(d) - function(-d)) - (function(2 * d) - function(-2 * d))) / (12 * step))
    return np.array(columns).T


def test_the_jacobian_is_the_derivative_of_the_constraint(eq):
    t, x, _, _, _ = random_point(eq)
    by_x = differences(lambda d: eq.constraint(t, eq.configurations.retract(x, d)), eq.n_v)
    G = eq.jacobian(t, x)
    assert G[eq.is_holonomic].any() or not eq.n_lam
    assert_allclose(G[eq.is_holonomic], by_x.reshape(-1, eq.n_v)[eq.is_holonomic], rtol=0, atol=1e-9)
    assert_allclose(eq.jacobian(t, x, sparse=True).toarray(), G, rtol=0, atol=0)


def test_rates_of_the_constraint_are_its_derivatives_along_a_motion(eq):
    """x moves with v, v with a: dg/dt = G v - g_1, d²g/dt² = G a - g_2."""
    t, x, v, a, _ = random_point(eq)

    def moved(s):
        """Return g a time s later, of a motion with these v and a: rotations by Magnus' series, exact to s⁴."""
        d = s * v + 0.5 * s**2 * a
        for _, j, _ in eq.configurations.parts():
            omega, alpha = v[j + 3 : j + 6], a[j + 3 : j + 6]
            d[j + 3 : j + 6] += s**3 / 12 * np.cross(omega, alpha)
        return eq.constraint(t + s, eq.configurations.retract(x, d))

    h = 2e-3
    g = {k: moved(k * h) for k in range(-2, 3)}
    first = (8 * (g[1] - g[-1]) - (g[2] - g[-2])) / (12 * h)
    second = (16 * (g[1] + g[-1]) - (g[2] + g[-2]) - 30 * g[0]) / (12 * h**2)
    rate = eq.jacobian(t, x) @ v - eq.velocity_right(t, x)
    assert_allclose(eq.velocity_defect(t, x, v), rate, rtol=0, atol=ROUNDOFF * max(np.abs(rate).max(initial=0.0), 1.0))
    size = max(np.abs(second).max(initial=0.0), 1.0)
    assert_allclose(rate, first, rtol=0, atol=1e-8 * size)
    assert_allclose(eq.jacobian(t, x) @ a - eq.acceleration_right(t, x, v), second, rtol=0, atol=1e-6 * size)


def test_tangents_are_the_derivatives_of_the_residual(eq):
    t, x, v, a, lam = random_point(eq)
    found = eq.tangents(t, x, v, a, lam)
    by_x = differences(lambda d: eq.residual(t, eq.configurations.retract(x, d), v, a, lam), eq.n_v)
    by_v = differences(lambda d: eq.residual(t, x, v + d, a, lam), eq.n_v)
    by_a = differences(lambda d: eq.residual(t, x, v, a + d, lam), eq.n_v)
    for own, by_steps in ((found.by_x, by_x), (found.by_v, by_v), (found.by_a, by_a)):
        assert_allclose(own, by_steps, rtol=0, atol=1e-8 * np.abs(by_steps).max())


def test_residual_is_mass_force_and_constraint_force(eq):
    t, x, v, a, lam = random_point(eq)
    whole = eq.mass(x) @ a - eq.force(t, x, v) - eq.jacobian(t, x).T @ lam
    own = eq.residual(t, x, v, a, lam)
    assert_allclose(own, whole, rtol=0, atol=ROUNDOFF * np.abs(whole).max())
    M = eq.mass(x)
    assert_allclose(M, M.T, rtol=0, atol=ROUNDOFF * np.abs(M).max())
    assert np.linalg.eigvalsh(M).min() > 0
    assert_allclose(eq.mass(x, sparse=True).toarray(), M, rtol=0, atol=0)


def test_wrenches_of_multipliers_load_the_bodies_as_these_do(eq):
    """Jᵀ (W lam) = Gᵀ lam: the difference of residuals with and without multipliers, kernels beside constraints."""
    t, x, v, _, lam = random_point(eq)
    with_lam, without = eq.wrenches(t, x, v, lam), eq.wrenches(t, x, v, np.zeros(eq.n_lam))
    parts = eq.rows_at(t, x, v)
    force = parts.held_force(lam)
    assert_allclose(parts.wrench_force(with_lam - without), force, rtol=0, atol=1e-10 * max(np.abs(force).max(), 1.0))


@pytest.mark.parametrize("name", ["crank", "driven crank", "gears", "top"])
def test_the_start_is_that_of_the_integrator(name):
    system = SYSTEMS[name]()
    eq = open_equations(system)
    x, v, a, lam = eq.start(t=0.05)
    made = ff.analyses.consistent_state(system, t=0.05)
    assert_allclose(a, made.u_dot, rtol=0, atol=1e-10 * max(np.abs(a).max(), 1.0))
    own = eq.wrenches(0.05, x, v, lam)
    rows = eq.rows_at(0.05, x, v)
    scale = max(np.abs(rows.wrench_force(made.w)).max(), 1.0)
    assert_allclose(rows.wrench_force(own), rows.wrench_force(made.w), rtol=0, atol=1e-10 * scale)
    assert np.abs(eq.constraint(0.05, x)).max(initial=0.0) <= 1e-11
    assert np.abs(eq.velocity_defect(0.05, x, v)).max(initial=0.0) <= 1e-11


@pytest.mark.parametrize("name", ["crank", "driven crank", "gears"])
def test_residual_is_zero_along_our_own_trajectory(name):
    """At every output, with the accelerations of the results and multipliers by least squares of their wrenches."""
    system = SYSTEMS[name]()
    eq = open_equations(system)
    motion = ff.integrate(system, ff.GeneralizedAlpha(0.8, tolerance=1e-12), 0.1, 1e-3, output_every=20)
    for k, t in enumerate(motion.t):
        bodies = [motion.body(body) for body in motion.body_names]
        state = ff.State(
            np.array([b.r[k] for b in bodies]), np.array([b.p[k] for b in bodies]),
            np.concatenate([b.q[k] for b in bodies]),
            np.concatenate([np.concatenate([b.v[k], b.omega_B[k], b.q_dot[k]]) for b in bodies]),
        )  # fmt: skip
        a = np.concatenate([np.concatenate([b.v_dot[k], b.omega_B_dot[k], b.q_ddot[k]]) for b in bodies])
        x, v = eq.vectors(state)
        without = eq.residual(t, x, v, a, np.zeros(eq.n_lam))
        lam = np.linalg.lstsq(eq.jacobian(t, x).T, without, rcond=None)[0]
        scale = np.abs(eq.force(t, x, v)).max()
        assert scale > 1e-3
        assert_allclose(eq.residual(t, x, v, a, lam), 0, rtol=0, atol=1e-9 * scale)
        assert_allclose(eq.constraint(t, x), 0, rtol=0, atol=1e-9)


def test_a_gear_is_followed_over_full_turns():
    eq = open_equations(geared())
    x, _, _, _ = eq.start()
    step = np.zeros(eq.n_v)
    step[eq.layout.index("v", "small", "omega z")] = 31 / 20
    step[eq.layout.index("v", "large", "omega z")] = -1.0
    for _ in range(8):
        x = eq.configurations.retract(x, step)
        eq = eq.followed(0.0, x)
        own = [k for k, component in enumerate(eq.layout.lam) if component.owner == "gear"]
        assert np.abs(eq.constraint(0.0, x)[own]).max() < 1e-12
    assert np.abs(open_equations(geared()).constraint(0.0, x)[own]).max() > 1.0


def test_null_space_holds_the_motions_that_constraints_allow():
    system = double_pendulum(angles=(0.3, 0.9))
    eq = open_equations(system)
    x, _, a, _ = eq.start()
    N = eq.null_space(0.0, x)
    assert N.shape == (12, 2)
    assert_allclose(eq.jacobian(0.0, x) @ N, 0, rtol=0, atol=1e-11)
    assert_allclose(N.T @ eq.mass(x) @ N, np.eye(2), rtol=0, atol=1e-11)
    z_ddot = N.T @ eq.force(0.0, x, np.zeros(12))  # at rest: M a = f + Gᵀ lam, a = N z_ddot
    assert_allclose(N @ z_ddot, a, rtol=0, atol=1e-9)


def test_projection_closes_constraints():
    eq = open_equations(double_pendulum(angles=(0.3, 0.9)))
    x, v, _, _ = eq.start()
    rng = np.random.default_rng(2)
    away = eq.configurations.retract(x, 1e-3 * rng.normal(size=eq.n_v)), v + 0.1 * rng.normal(size=eq.n_v)
    assert np.abs(eq.constraint(0.0, away[0])).max() > 1e-4
    x, v = eq.project(0.0, *away)
    assert np.abs(eq.constraint(0.0, x)).max() < 1e-11
    assert np.abs(eq.velocity_defect(0.0, x, v)).max() < 1e-11


def test_bad_input_is_told():
    eq = open_equations(slider_crank())
    x, v, a, lam = eq.start()
    with pytest.raises(ff.errors.ModelError, match="x: expected 21 finite numbers"):
        eq.residual(0.0, x[:-1], v, a, lam)
    with pytest.raises(ff.errors.ModelError, match="not finite"):
        eq.force(0.0, x, np.full(18, np.nan))
    with pytest.raises(ff.errors.ModelError, match=r"rod omega z"):
        eq.layout.index("v", "rod", "omega zz")
    body = ff.RigidBody("cart", 1.0, np.eye(3))
    guide = ff.PrismaticJoint("guide", ff.GROUND, ff.Marker("cart"), axis=(1, 0, 0))
    rubbing = ff.JointForce("rub", "guide", "distance", friction_coefficient=0.3)
    with pytest.raises(ff.errors.ModelError, match="friction by the force"):
        open_equations(ff.System([body], [guide], [rubbing]))
    control = ff.UserForce(
        "pid",
        {"s": ff.joints.JointCoordinate("guide", "distance")},
        forces={"s": "-e"},
        rates={"e": "s"},
        states={"e": 0.0},
    )
    with pytest.raises(ff.errors.ModelError, match="'pid' has states of its own"):
        open_equations(ff.System([body], [guide], [control]))
