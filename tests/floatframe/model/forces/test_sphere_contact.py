"""Contact of spheres: Hertz's force, restitution, friction."""

import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy.integrate import quad
from scipy.special import beta

from floatframe import GROUND, GeneralizedAlpha, Gravity, Marker, RigidBody, System, integrate
from floatframe.errors import ModelError
from floatframe.forces import SphereContact
from floatframe.model.forces.sphere_contact import exact_dissipation, hertz_stiffness
from tests.floatframe.engine.kernels.examples import turned_triad
from tests.floatframe.finite_differences import assert_tangent_is_exact
from tests.floatframe.model.forces.examples import mounted

R = 0.1


def touching(radius_a=None, *, depth, friction=0.3):
    """The two bodies of the bushing, a contact of the given depth at the random iterate of the tangent."""
    from floatframe.model.forces import Gravity as Field

    bodies = mounted(stiffness=np.ones(6)).bodies
    a, b = Marker("first", "end_a", triad=turned_triad(4)), Marker("second", position=(0.4, 0.2, -0.3))

    def build(radius_b):
        contact = SphereContact("touch", a, b, radius_b, radius_a, axis=(0.2, 1.0, 0.3), stiffness=30.0,
                                restitution=0.6, friction=friction, friction_speed=0.7)  # fmt: skip
        return System(bodies, [], [Field((0.5, -1.0, -9.81)), contact])

    return build, depth


def gap_at(system, prepare):
    from tests.floatframe.engine.kernels.examples import Iterate

    iterate = Iterate(system, 1)
    prepare(iterate)
    n_u = int(iterate.model.bodies.u0[-1])
    iterate.residual(np.zeros(n_u), np.zeros(iterate.n_w))
    return float(iterate.work.contact.gap)


@pytest.mark.parametrize("radius_a", [None, 0.2], ids=["plane", "sphere"])
@pytest.mark.parametrize("depth", [0.3, -0.2], ids=["in contact", "free"])
def test_newton_matrix_is_the_derivative_of_the_residual(radius_a, depth):
    build, depth = touching(radius_a, depth=depth)

    def prepare(iterate):
        iterate.work.state.w_start[-1] = 5.0

    gap = gap_at(build(10.0), prepare)
    assert_tangent_is_exact(build(10.0 + gap + depth), prepare=prepare)


def dropped(e, *, h=2e-6, dissipation="exact", speed=1.0, mass=1.0):
    ball = RigidBody("ball", mass, 0.4 * mass * R**2 * np.eye(3), position=(0, 0, R + 1e-4), velocity=(0, 0, -speed))
    contact = SphereContact("floor", Marker(GROUND), Marker("ball"), R, modulus=1e8, restitution=e,
                            dissipation=dissipation)  # fmt: skip
    system = System([ball], [], [contact])
    return system, integrate(system, GeneralizedAlpha(0.9, 1e-10), 4e-3, h, output_every=10)


@pytest.mark.parametrize("e", [0.3, 0.6, 0.9, 1.0])
def test_a_ball_leaves_with_the_nominal_restitution(e):
    _, motion = dropped(e)
    v = motion.body("ball").v[:, 2]
    assert v[0] == -1.0
    assert_allclose(v[-1], e, rtol=2e-3, atol=0)
    balance = motion.energies.balance
    assert np.abs(balance - balance[0]).max() < 2e-3 * balance[0]


def test_laws_for_little_loss_agree_with_the_exact_one():
    """Hunt and Crossley: e = 1 - (2/3) h; all laws have its slope at e = 1."""
    from floatframe.model.forces.sphere_contact import DISSIPATIONS

    for name, law in DISSIPATIONS.items():
        slope = 1.6 if name == "flores" else 1.5
        assert_allclose(law(1 - 1e-5), slope * 1e-5, rtol=1e-3, atol=0)


def test_exact_dissipation_solves_the_energy_integral():
    for e in (0.15, 0.3, 0.8, 0.99):
        h = exact_dissipation(e)
        assert abs(quad(lambda v, h=h: v / (1 + h * v), -e, 1, epsabs=1e-12)[0]) < 1e-9


def test_duration_and_depth_are_those_of_hertz():
    """x_max = (5 m v²/(4 k))^(2/5), T = 2 x_max/v ∫ du/sqrt(1 - u^(5/2)) = 2.943 x_max/v."""
    _, motion = dropped(1.0)
    k = hertz_stiffness(1e8, R)
    deepest = (5 / (4 * k)) ** 0.4
    z = R - motion.body("ball").r[:, 2]
    assert_allclose(z.max(), deepest, rtol=1e-4, atol=0)
    inside = motion.t[z > 0]
    assert_allclose(inside[-1] - inside[0], 0.8 * beta(0.4, 0.5) * deepest, rtol=0, atol=3e-5)


def test_two_spheres_exchange_their_velocities():
    bodies = [
        RigidBody("a", 1.0, np.eye(3), velocity=(1.0, 0, 0)),
        RigidBody("b", 1.0, np.eye(3), position=(0.301, 0, 0)),
    ]
    contact = SphereContact("hit", Marker("a"), Marker("b"), 0.2, 0.1, modulus=1e8)
    motion = integrate(System(bodies, [], [contact]), GeneralizedAlpha(0.9, 1e-10), 5e-3, 5e-6, output_every=20)
    assert_allclose(motion.body("a").v[-1], [0, 0, 0], rtol=0, atol=1e-3)
    assert_allclose(motion.body("b").v[-1], [1, 0, 0], rtol=0, atol=1e-3)
    momentum = motion.linear_momentum
    assert_allclose(momentum, np.tile(momentum[0], (len(momentum), 1)), rtol=0, atol=1e-8)


def test_a_sliding_ball_begins_to_roll():
    """v falls by mu g until rolling, v = 5/7 v_0 of a solid ball; friction takes the difference of the energies."""
    m, g, mu, v0 = 1.0, 9.81, 0.2, 1.0
    k = hertz_stiffness(1e7, R)
    sag = (m * g / k) ** (2 / 3)
    ball = RigidBody("ball", m, 0.4 * m * R**2 * np.eye(3), position=(0, 0, R - sag), velocity=(v0, 0, 0))
    floor = SphereContact("floor", Marker(GROUND), Marker("ball"), R, modulus=1e7, friction=mu, restitution=0.7)
    system = System([ball], [], [Gravity((0, 0, -g)), floor])
    motion = integrate(system, GeneralizedAlpha(0.8, 1e-9), 0.3, 1e-4, output_every=20)
    v = motion.body("ball").v[:, 0]
    slides = motion.t < 0.12
    assert_allclose(v[slides], v0 - mu * g * motion.t[slides], rtol=0, atol=3e-3)
    assert_allclose(v[-1], 5 / 7 * v0, rtol=3e-3, atol=0)
    assert_allclose(motion.energies.dissipated[-1], 0.5 * m * v0**2 * 2 / 7, rtol=1e-2, atol=0)


def test_a_bouncing_ball_keeps_its_restitution_at_every_impact():
    """The speed of approach is found anew: heights of bounces fall by e²."""
    e, g = 0.7, 9.81
    ball = RigidBody("ball", 1.0, 0.004 * np.eye(3), position=(0, 0, R + 0.05))
    floor = SphereContact("floor", Marker(GROUND), Marker("ball"), R, modulus=3e9, restitution=e)
    system = System([ball], [], [Gravity((0, 0, -g)), floor])
    motion = integrate(system, GeneralizedAlpha(0.9, 1e-9), 0.4, 1e-5, output_every=20)
    z = motion.body("ball").r[:, 2] - R
    tops = [z[k] for k in range(1, len(z) - 1) if z[k] > z[k - 1] and z[k] >= z[k + 1]]
    assert len(tops) >= 2
    assert_allclose(tops[:2], [0.05 * e**2, 0.05 * e**4], rtol=2e-2, atol=0)


@pytest.mark.parametrize(
    ("options", "words"),
    [
        ({}, "expected either modulus .* or stiffness, got neither"),
        ({"modulus": 1.0, "stiffness": 1.0}, "got both"),
        ({"stiffness": 1.0, "restitution": 0.0}, "restitution: expected a number above 0"),
        ({"stiffness": 1.0, "restitution": 1.2}, "restitution: expected 0 < e <= 1"),
        ({"stiffness": 1.0, "dissipation": "newton"}, "dissipation: expected one of exact"),
        ({"modulus": 1.0, "exponent": 2.0}, "exponent: expected 3/2"),
        ({"stiffness": 1.0, "friction": -1.0}, "friction: expected a number of 0 or more"),
    ],
)
def test_impossible_contacts_are_refused(options, words):
    with pytest.raises(ModelError, match=words):
        SphereContact("c", Marker(GROUND), Marker("ball"), R, **options)
