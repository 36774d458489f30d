"""Geometric stiffness in the engine: bodies whose particles have displacements of second order, of any kind."""

from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

import cms
from floatframe import GROUND, GeneralizedAlpha, Marker, RevoluteJoint, integrate
from floatframe.analyses.snapshot import snapshot
from floatframe.cli.analyses import read_in_formulation
from floatframe.engine.compiling.system import compiled_system
from floatframe.engine.initial_conditions.newton_equations import displaced, linearized, set_iterate
from floatframe.engine.kernels.entry import absolute_kernels, evaluate_and_linearize, rates_of_constraints
from floatframe.engine.kernels.memory import memory_at
from floatframe.engine.kernels.work import new_work
from floatframe.errors import ModelError, SystemFileError
from floatframe.files.system_file.read_system import read_system
from floatframe.model.bodies.flexible_body import FlexibleBody
from floatframe.model.forces import Gravity, PointForce
from floatframe.model.joints import FixedJoint, SphericalJoint
from floatframe.model.rotations import euler_parameters_of_rotation_vector, rotation_exp, rotation_matrix
from floatframe.model.state import State
from floatframe.model.system import System
from floatframe.results.place_motion import interface_motion
from floatframe.results.recovery import interface_positions
from floatframe.results.sensors import Channel
from floatframe.results.small_motions.small_motions import SmallMotions
from tests.floatframe.engine.kernels.examples import Iterate, newton_matrices, turned_triad
from tests.floatframe.orders import slope
from tests.floatframe.point_masses import (
    random_point_masses,
    random_second_order,
    reduced_body,
    stiffened_body,
    stiffness,
)

ROUNDOFF = 1e-12
N_Q = 4
GRAVITY = np.array([1.0, -2.0, -9.81])


class Particles:
    """Particles at c + phi q + 1/2 g q q; energy and momenta to second order in the deformation, by plain sums."""

    def __init__(self, seed):
        self.points = random_point_masses(N_Q, seed)
        self.second = random_second_order(self.points, seed)

    def positions(self, q):
        """Return positions in B, whole, and the part of second order alone."""
        bent = 0.5 * np.einsum("pakl,k,l->pa", self.second.g, q, q)
        return self.points.c + self.points.phi @ q + bent, bent

    def velocities(self, q, u):
        """Return the velocities of zeroth, first and second order in (q, q_dot), body axes."""
        phi, c = self.points.phi, self.points.c
        v, omega, q_dot = u[:3], u[3:6], u[6:]
        _, bent = self.positions(q)
        bent_rate = np.einsum("pakl,k,l->pa", self.second.g, q, q_dot)
        return (
            v + np.cross(omega, c),
            np.cross(omega, phi @ q) + phi @ q_dot,
            np.cross(omega, bent) + bent_rate,
        )

    def kinetic(self, q, u):
        x0, x1, x2 = self.velocities(q, u)
        return 0.5 * self.points.m @ (x0 * x0 + 2 * x0 * x1 + x1 * x1 + 2 * x0 * x2).sum(axis=1)

    def momentum(self, q, u):
        """Return dT/du, (6 + n_q,), by differences that are exact, since T is quadratic in u."""
        e = np.eye(len(u))
        return np.array([0.5 * (self.kinetic(q, u + x) - self.kinetic(q, u - x)) for x in e])

    def forces(self, q, u, u_dot):
        """Return force, torque and modal forces by Lagrange's equations in the velocities of the body, by complex step.

        dp/dt + omega × p, dL/dt + omega × L + v × p, d(dT/dq_dot)/dt - dT/dq.
        """
        step = 1e-30
        p = self.momentum(q, u)
        rate = self.momentum(q + 1j * step * u[6:], u + 1j * step * u_dot).imag / step
        by_q = np.array([self.kinetic(q + 1j * step * x, u).imag / step for x in np.eye(N_Q)])
        v, omega = u[:3], u[3:6]
        return np.concatenate([
            rate[:3] + np.cross(omega, p[:3]),
            rate[3:6] + np.cross(omega, p[3:6]) + np.cross(v, p[:3]),
            rate[6:] - by_q,
        ])  # fmt: skip

    def body(self, **options):
        body = reduced_body(self.points, stiffness(N_Q), **options)
        places = tuple(int(interface.members[0]) for interface in body.interfaces)
        return replace(body, geometric=self.second.geometric(places))


@pytest.fixture(scope="module")
def particles():
    return Particles(3)


def random_state(seed):
    rng = np.random.default_rng(seed)
    p = euler_parameters_of_rotation_vector(rng.normal(size=3))
    return State(rng.normal(size=(1, 3)), p[None], rng.normal(size=N_Q), rng.normal(size=6 + N_Q)), rng.normal(
        size=6 + N_Q
    )


def in_body_axes(state, vector):
    """Return velocities or accelerations with the part of the origin in body axes."""
    R = rotation_matrix(state.p[0])
    return np.concatenate([R.T @ vector[:3], vector[3:]])


@pytest.mark.parametrize("seed", range(4))
def test_equations_of_motion_are_lagranges_of_the_kinetic_energy_to_second_order(particles, seed):
    system = System([FlexibleBody("body", particles.body())], forces=[Gravity(GRAVITY)])
    state, u_dot = random_state(seed)
    work = new_work(compiled_system(system).model)
    set_iterate(work, state, u_dot)
    evaluate_and_linearize(compiled_system(system).model, work, 1.0, 0.0, 0.0)
    u = in_body_axes(state, state.u)
    rates = in_body_axes(state, u_dot)
    rates[:3] -= np.cross(u[3:6], u[:3])  # the rate of the components of v in body axes
    expected = particles.forces(state.q, u, rates)
    expected[6:] += stiffness(N_Q) @ state.q
    rho, bent = particles.positions(state.q)
    g = rotation_matrix(state.p[0]).T @ GRAVITY
    m = particles.points.m
    weight = m[:, None] * g
    by_shapes = particles.points.phi + np.einsum("pakl,l->pak", particles.second.g, state.q)
    expected -= np.concatenate([
        weight.sum(axis=0), np.cross(rho, weight).sum(axis=0), np.einsum("pa,pak->k", weight, by_shapes),
    ])  # fmt: skip
    assert np.abs(bent).max() > 0.1
    assert_allclose(work.bodies.residual, expected, rtol=0, atol=10 * ROUNDOFF * np.abs(expected).max())


def observed(system, state):
    memory = memory_at(state, np.zeros(len(state.u)), np.zeros(int(compiled_system(system).model.connections.w0[-1])))
    model = compiled_system(system).model
    return absolute_kernels.observe(model, new_work(model), memory=memory, t=0.0).diagnostics[0]


@pytest.mark.parametrize("seed", range(3))
def test_energies_and_momenta_are_those_of_the_particles_to_second_order(particles, seed):
    system = System([FlexibleBody("body", particles.body())], forces=[Gravity(GRAVITY)])
    state, _ = random_state(seed)
    R, m = rotation_matrix(state.p[0]), particles.points.m
    u = in_body_axes(state, state.u)
    p = particles.momentum(state.q, u)
    rho, _ = particles.positions(state.q)
    expected = np.concatenate([
        [particles.kinetic(state.q, u), 0.5 * state.q @ stiffness(N_Q) @ state.q,
         -(m.sum() * state.r[0] + R @ (m @ rho)) @ GRAVITY, 0.0],
        R @ p[:3], R @ p[3:6] + np.cross(state.r[0], R @ p[:3]),
    ])  # fmt: skip
    assert_allclose(observed(system, state)[:10], expected, rtol=0, atol=ROUNDOFF * np.abs(expected).max())


def test_what_is_left_out_of_the_kinetic_energy_is_of_third_order(particles):
    state, _ = random_state(1)
    sizes = np.array([4e-3, 2e-3, 1e-3, 5e-4])
    errors = []
    for size in sizes:
        u = np.concatenate([state.u[:6], size * state.u[6:]])
        whole = sum(particles.velocities(size * state.q, u))
        T = 0.5 * particles.points.m @ (whole * whole).sum(axis=1)
        errors.append(abs(T - particles.kinetic(size * state.q, u)))
    assert_allclose(slope(sizes, errors), 3, rtol=0, atol=0.15)


def stiffened_system():
    first = stiffened_body(random_point_masses(3, 3), stiffness(3), D=np.diag([0.3, 0.2, 0.1]), interfaces=4)
    second = stiffened_body(random_point_masses(2, 4), stiffness(2), interfaces=3, seed=8)
    return System(
        [FlexibleBody("first", first), FlexibleBody("second", second), FlexibleBody("plain", second, stiffening=False)],
        [
            RevoluteJoint("hinge", GROUND, Marker("first", "end_a", triad=turned_triad(1)), axis=(0.2, 1.0, 0.3)),
            FixedJoint("weld", Marker("first", "end_b"), Marker("second", "end_a"), rotation=turned_triad(2)),
            SphericalJoint("ball", Marker("second", "end_b"), Marker("plain", "end_a")),
        ],
        [
            Gravity((0.5, -1.0, -9.81)),
            PointForce("dead", Marker("first", "end_c"), (3.0, -2.0, 1.0), (0.5, 0.4, -0.3)),
            PointForce("follower", Marker("second", "end_c"), (1.0, 2.0, -3.0), (0.7, -0.4, 0.3), is_follower=True),
        ],
    )


@pytest.mark.parametrize("seed", range(3))
def test_newton_matrix_is_the_derivative_of_the_residual(seed):
    iterate = Iterate(stiffened_system(), seed)
    exact, approximate = newton_matrices(iterate)
    assert_allclose(exact, approximate, rtol=0, atol=2e-9 * np.abs(approximate).max())


def place_of(body, name, state):
    """Return place and axes of an interface: c + Psi q - 1/2 qᵀ K_P q, the plain formula."""
    interface = body.interface(name)
    K = body.geometric.interfaces[[i.name for i in body.interfaces].index(name)]
    d = interface.Psi @ state.q - 0.5 * np.array([state.q @ K_a @ state.q for K_a in K])
    R = rotation_matrix(state.p[0])
    return state.r[0] + R @ (interface.position + d[:3]), R @ rotation_exp(d[3:])


def moved(system, state, u, s):
    """Return the state after a time s at velocities u, to third order in s for the rotation of a central difference."""
    step = s * u
    return displaced(compiled_system(system).model, state, step)


def test_markers_move_with_their_interface_and_carry_forces_to_it_with_the_same_work(particles):
    """The velocity is the derivative of the place; the power of the forces on the body is that on the marker."""
    body = particles.body()
    f, t = np.array([3.0, -2.0, 1.0]), np.array([0.5, 0.4, -0.3])
    state, _ = random_state(2)
    free = System([FlexibleBody("body", body)])
    loaded = System([FlexibleBody("body", body)], forces=[PointForce("load", Marker("body", "end_b"), f, t)])
    forces = []
    for system in (free, loaded):
        work = new_work(compiled_system(system).model)
        set_iterate(work, state)
        evaluate_and_linearize(compiled_system(system).model, work, 1.0, 0.0, 0.0)
        forces.append(work.bodies.residual.copy())
    r_P, A = place_of(body, "end_b", state)
    assert_allclose(work.markers.r[0], r_P, rtol=0, atol=ROUNDOFF)
    assert_allclose(work.markers.A[0], A, rtol=0, atol=ROUNDOFF)
    s = 1e-5
    (r_plus, A_plus), (r_minus, A_minus) = (place_of(body, "end_b", moved(free, state, state.u, x)) for x in (s, -s))
    assert_allclose(work.markers.v[0], (r_plus - r_minus) / (2 * s), rtol=0, atol=1e-8)
    spin = (A_plus - A_minus) / (2 * s) @ A.T
    omega = np.array([spin[2, 1] - spin[1, 2], spin[0, 2] - spin[2, 0], spin[1, 0] - spin[0, 1]]) / 2
    assert_allclose(work.markers.omega[0], omega, rtol=0, atol=1e-8)
    power = (forces[0] - forces[1]) @ in_body_axes(state, state.u)
    assert_allclose(power, f @ work.markers.v[0] + t @ work.markers.omega[0], rtol=ROUNDOFF, atol=0)


def test_markers_at_one_interface_share_its_deformation_bit_for_bit(particles):
    """Loads at one interface, in axes of their own, with and without stiffening; another interface lies between."""
    f, t = np.array([3.0, -2.0, 1.0]), np.array([0.5, 0.4, -0.3])
    state, u_dot = random_state(3)
    for stiffening in (True, False):
        body = FlexibleBody("body", particles.body(), stiffening=stiffening)
        axes = rotation_exp(t)
        places = [Marker("body", "end_b"), Marker("body", "end_a"), Marker("body", "end_b", triad=axes)]
        loads = [PointForce(f"load {k}", place, f, t, is_follower=True) for k, place in enumerate(places)]
        model = compiled_system(System([body], forces=loads)).model
        assert_array_equal(model.markers.same, [-1, -1, 0])
        alone = model._replace(markers=model.markers._replace(same=np.full(3, -1)))
        works = [new_work(model), new_work(alone)]
        for each, work in zip((model, alone), works, strict=True):
            set_iterate(work, state, u_dot)
            evaluate_and_linearize(each, work, 1.0, 0.5, 0.25)
            assert work.markers.spin[2].any()
        for shared, own in zip(works[0].markers, works[1].markers, strict=True):
            assert_array_equal(shared, own)
        assert_array_equal(works[0].bodies.residual, works[1].bodies.residual)
        assert_array_equal(works[0].solver.H, works[1].solver.H)


def test_second_rates_of_constraints_are_the_derivative_of_their_rates():
    system = stiffened_system()
    model = compiled_system(system).model
    rng = np.random.default_rng(4)
    placed = compiled_system(system).placed
    state = State(placed.r, placed.p, rng.normal(size=len(placed.q)), rng.normal(size=len(placed.u)))
    work = new_work(model)
    set_iterate(work, state)
    linearized(model, work, 1.0, 0.0, 0.0)
    _, bias = rates_of_constraints(model, work)
    s = 1e-5
    rates = []
    for x in (s, -s):
        other = displaced(model, state, x * state.u)
        set_iterate(work, State(other.r, other.p, other.q, state.u))
        linearized(model, work, 1.0, 0.0, 0.0)
        rates.append(rates_of_constraints(model, work)[0].copy())
    difference = (rates[0] - rates[1]) / (2 * s)
    assert np.abs(bias).max() > 1.0
    # dots and points alike: their second rates at zero accelerations, for any state
    assert_allclose(bias, difference, rtol=0, atol=1e-7 * np.abs(difference).max())


def test_channels_are_the_derivative_of_the_place(particles):
    body = particles.body()
    system = System([FlexibleBody("body", body)])
    state, _ = random_state(5)
    work = new_work(compiled_system(system).model)
    set_iterate(work, state)
    channels = tuple(
        Channel(f"{quantity} {axis}", Marker("body", "end_a"), direction, quantity)
        for quantity in ("translation", "rotation")
        for axis, direction in zip("xyz", np.eye(3), strict=True)
    )
    still = snapshot(system, State(state.r, state.p, state.q, np.zeros_like(state.u)))
    small = SmallMotions(system, compiled_system(system), work, state, np.zeros(3), still)
    rows = np.concatenate([channel.linear(small).columns["value"].x for channel in channels])
    rng = np.random.default_rng(0)
    u = rng.normal(size=6 + N_Q)
    s = 3e-6
    R = rotation_matrix(state.p[0])
    ground = np.concatenate([R @ u[:3], u[3:]])
    (r_plus, A_plus), (r_minus, A_minus) = (place_of(body, "end_a", moved(system, state, ground, x)) for x in (s, -s))
    spin = (A_plus - A_minus) / (2 * s) @ place_of(body, "end_a", state)[1].T
    omega = np.array([spin[2, 1], spin[0, 2], spin[1, 0]])
    expected = np.concatenate([(r_plus - r_minus) / (2 * s), omega])
    assert_allclose(rows @ u, expected, rtol=0, atol=1e-8 * np.abs(expected).max())


# motions -------------------------------------------------------------------------------------------------------------

STEPS = np.array([8e-3, 4e-3, 2e-3, 1e-3])


def spinning(stiffening):
    reduced = stiffened_body(random_point_masses(N_Q, 3), stiffness(N_Q, omega=6.0), size=0.1)
    q = np.array([0.3, -0.2, 0.1, 0.25])
    body = FlexibleBody(
        "body", reduced, velocity=(0.4, -0.3, 1.0), omega_B=(1.5, -2.0, 1.0), q=q, stiffening=stiffening
    )  # fmt: skip
    return System([body])


def test_a_free_spinning_body_keeps_energy_and_momenta_as_one_without_stiffening():
    errors = {}
    for stiffening in (True, False):
        motions = [integrate(spinning(stiffening), GeneralizedAlpha(0.9, 1e-10), 2.0, h, output_every=5) for h in STEPS]
        assert motions[-1].entry("body")[1].is_stiffened is stiffening
        for name, of in {
            "energy": lambda m: m.energies.total[:, None],
            "momentum": lambda m: m.linear_momentum,
            "angular momentum": lambda m: m.angular_momentum,
        }.items():
            values = [np.abs(of(m) - of(m)[0]).max() / np.abs(of(m)).max() for m in motions]
            assert_allclose(slope(STEPS, values), 2, rtol=0, atol=0.15)
            errors[name, stiffening] = values[-1]
    for name in ("energy", "momentum", "angular momentum"):
        assert errors[name, True] < 3 * errors[name, False]


def test_a_pendulum_on_a_hinge_and_a_ball_keeps_its_energy_to_second_order():
    part = stiffened_body(random_point_masses(N_Q, 3), stiffness(N_Q, omega=20.0), size=0.1, rotation_scale=0.1)
    a, b = part.interface("end_a").position, part.interface("end_b").position
    system = System(
        [FlexibleBody("first", part, position=-b), FlexibleBody("second", part, position=a - 2 * b)],
        [
            RevoluteJoint("hinge", GROUND, Marker("first", "end_b"), axis=(0, 1, 0)),
            SphericalJoint("ball", Marker("first", "end_a"), Marker("second", "end_b")),
        ],
        [Gravity((0, 0, -9.81))],
    )
    errors = []
    for h in STEPS:
        total = integrate(system, GeneralizedAlpha(0.9, 1e-10), 0.6, h, output_every=5).energies.total
        errors.append(np.abs(total - total[0]).max())
    assert_allclose(slope(STEPS, errors), 2, rtol=0, atol=0.15)


def test_places_of_interfaces_in_results_are_those_of_the_engine():
    system = spinning("auto")
    body = system.bodies[0]
    motion = integrate(system, GeneralizedAlpha(0.9, 1e-10), 0.1, 2e-4)
    at = body.name, body.reduced, "end_b"
    sensed = interface_motion(motion, *at)
    last = motion.body(body.name)
    state = State(last.r[-1:], last.p[-1:], last.q[-1], np.zeros(6 + N_Q))
    r_P, A = place_of(body.reduced, "end_b", state)
    assert_allclose(sensed.position[-1], r_P, rtol=0, atol=ROUNDOFF)
    assert_allclose(interface_positions(motion, *at)[-1], r_P, rtol=0, atol=ROUNDOFF)
    assert_allclose(sensed.axes[-1], A @ body.reduced.interface("end_b").triad, rtol=0, atol=ROUNDOFF)
    rate = (sensed.position[2:] - sensed.position[:-2]) / 4e-4
    assert_allclose(rate, sensed.velocity[1:-1], rtol=0, atol=1e-5 * np.abs(sensed.velocity).max())
    rate = (sensed.velocity[2:] - sensed.velocity[:-2]) / 4e-4
    assert_allclose(rate, sensed.acceleration[1:-1], rtol=0, atol=1e-4 * np.abs(sensed.acceleration).max())


def test_without_stiffening_the_motion_is_that_of_the_body_without_matrices():
    reduced = stiffened_body(random_point_masses(N_Q, 3), stiffness(N_Q, omega=6.0))
    motions = []
    for body in (
        FlexibleBody("body", reduced, omega_B=(1.0, 2.0, 0.0), stiffening=False),
        FlexibleBody("body", replace(reduced, geometric=None), omega_B=(1.0, 2.0, 0.0)),
    ):
        motions.append(integrate(System([body]), GeneralizedAlpha(0.9, 1e-10), 0.05, 1e-2))
    assert_array_equal(motions[0].body("body").q, motions[1].body("body").q)


def test_stiffening_of_a_body_without_matrices_is_refused():
    body = reduced_body(random_point_masses(2, 3), stiffness(2))
    with pytest.raises(ModelError, match="contains no geometric stiffness; reduce it again"):
        FlexibleBody("body", body, stiffening=True)
    with pytest.raises(ModelError, match="expected true, false or 'auto', got 'yes'"):
        FlexibleBody("body", body, stiffening="yes")
    assert not FlexibleBody("body", body).is_stiffened


def test_stiffening_in_a_system_file(tmp_path):
    """By default it counts where the file holds it; true asks for it, false leaves it out."""
    reduced = stiffened_body(random_point_masses(2, 3), stiffness(2))
    cms.write(reduced, tmp_path / "with.h5")
    cms.write(replace(reduced, geometric=None), tmp_path / "without.h5")

    def read(body, key=""):
        text = f'[system]\nunits = "m-kg-s"\n[bodies.part]\n{body}\n{key}\n[run]\nt_end = 1.0\nh = 1e-2\n'
        (tmp_path / "system.toml").write_text(text)
        return read_system(tmp_path / "system.toml")[0].bodies[0]

    assert read('file = "with.h5"').is_stiffened
    assert not read('file = "without.h5"').is_stiffened
    assert not read('file = "with.h5"', "stiffening = false").is_stiffened
    assert_array_equal(read('file = "with.h5"').reduced.geometric.interfaces, reduced.geometric.interfaces)
    with pytest.raises(SystemFileError, match="contains no geometric stiffness"):
        read('file = "without.h5"', "stiffening = true")
    rigid = "mass = 1.0\ninertia = [[1, 0, 0], [0, 1, 0], [0, 0, 1]]"
    with pytest.raises(SystemFileError, match="stiffening: a rigid body has none"):
        read(rigid, "stiffening = true")


def test_a_body_without_stiffness_for_its_size_is_told_where_it_is_used(tmp_path, capsys):
    """As `cms reduce` has said it; not where nobody wants the stiffness."""
    reduced = replace(stiffened_body(random_point_masses(2, 3), stiffness(2)), geometric=None)
    why = "geometric stiffness left out: 9 GB"
    cms.write(replace(reduced, provenance={**reduced.provenance, "geometric stiffness": why}), tmp_path / "part.h5")

    def told(key=""):
        text = f'[system]\nunits = "m-kg-s"\n[bodies.arm]\nfile = "part.h5"\n{key}\n'
        (tmp_path / "system.toml").write_text(text)
        read_in_formulation(tmp_path / "system.toml", None)
        return capsys.readouterr().err

    assert told() == f"note: body 'arm': {why}\n"
    assert told("stiffening = false") == ""
