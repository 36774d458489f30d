"""The bushing: its potential, its tangent, and that its two ends can be exchanged."""

import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy.spatial.transform import Rotation

from floatframe import GROUND, GeneralizedAlpha, Gravity, Marker, RigidBody, System, integrate
from floatframe.engine.compiling.system import compiled_system
from floatframe.engine.initial_conditions.newton_equations import set_iterate
from floatframe.engine.kernels.entry import evaluate_and_linearize
from floatframe.engine.kernels.work import new_work
from floatframe.errors import ModelError
from floatframe.forces import Bushing
from floatframe.model.functions.time_functions import table
from floatframe.model.rotations import euler_parameters_of_rotation_vector, rotation_matrix
from floatframe.model.state import State
from tests.floatframe.engine.kernels.examples import turned_triad
from tests.floatframe.finite_differences import assert_tangent_is_exact
from tests.floatframe.model.forces.examples import mounted

TABLE = table(np.linspace(-9, 9, 19), np.linspace(-9, 9, 19) ** 3)


def six_by_six(seed, size=1.0):
    A = np.random.default_rng(seed).normal(size=(6, 6))
    return size * (A @ A.T / 6 + 0.5 * np.eye(6))


@pytest.mark.parametrize("axes", ["a", "b", "half way"])
@pytest.mark.parametrize("seed", range(3))
def test_newton_matrix_is_the_derivative_of_the_residual(seed, axes):
    system = mounted(
        axes=axes,
        stiffness=six_by_six(1, 30.0), damping=six_by_six(2, 4.0), preload=(1.0, 2.0, -1.0, 0.3, -0.2, 0.5),
        characteristics={"x": TABLE, "rz": TABLE},
    )  # fmt: skip
    assert_tangent_is_exact(system, seed=seed)


SHARES = {"a": 0.0, "b": 1.0, "half way": 0.5}


@pytest.mark.parametrize(
    ("axes", "angle"),
    [
        *((axes, angle) for axes in SHARES for angle in (0.0, 1e-3, 0.0999, 0.1001, 1.5, 2.5, 3.1)),
        *((axes, angle) for axes in "ab" for angle in (3.2, 5.0, 7.0, 9.5, 20.0)),
    ],
)
def test_wrench_is_the_derivative_of_the_potential(angle, axes):
    """Against a potential written with SciPy's rotations, around the switch to the series, large and beyond a turn."""
    K, preload = six_by_six(1, 30.0), np.array([1.0, 2.0, -1.0, 0.3, -0.2, 0.5])
    bodies = [RigidBody(name, 1.0, np.eye(3)) for name in "ab"]
    system = System(bodies, [], [Bushing("mount", Marker("a"), Marker("b"), stiffness=K, preload=preload, axes=axes)])
    rng = np.random.default_rng(3)
    axis = rng.normal(size=3)
    A = Rotation.from_rotvec(rng.normal(size=3))
    axis /= np.linalg.norm(axis)
    B = A * Rotation.from_rotvec(angle * axis)
    r = rng.normal(size=(2, 3))

    def potential(x):
        A_x, B_x = Rotation.from_rotvec(x[3:6]) * A, Rotation.from_rotvec(x[9:]) * B
        theta = (A_x.inv() * B_x).as_rotvec()
        if angle:
            size = np.linalg.norm(theta)
            theta *= 1 + 2 * np.pi * np.round((angle * axis @ theta / size - size) / (2 * np.pi)) / size
        middle = A_x * Rotation.from_rotvec(SHARES[axes] * theta)
        xi = np.concatenate([middle.inv().apply(r[1] + x[6:9] - r[0] - x[:3]), theta])
        return 0.5 * xi @ K @ xi + preload @ xi

    step = 1e-6
    gradient = [(potential(step * e) - potential(-step * e)) / (2 * step) for e in np.eye(12)]
    p = np.array([euler_parameters_of_rotation_vector(R.as_rotvec()) for R in (A, B)])
    work = new_work(compiled_system(system).model)
    set_iterate(work, State(r, p, np.zeros(0), np.zeros(12)))
    if len(work.state.angle):
        work.state.angle[:] = angle * axis
    evaluate_and_linearize(compiled_system(system).model, work, 1.0, 0.0, 0.0)
    w = -work.connections.g
    found = np.concatenate([w[:3], w[3:6], -w[:3], -w[6:9]])
    assert_allclose(found, -np.array(gradient), rtol=0, atol=1e-7 * np.abs(gradient).max())


def free_pair(**options):
    bodies = [
        RigidBody("a", 1.0, np.diag([0.5, 0.7, 0.6]), omega_B=(0.4, -0.3, 0.9), velocity=(0.1, 0, 0)),
        RigidBody("b", 2.0, np.diag([1.0, 1.5, 2.0]), position=(0.2, 0.1, 0), omega_B=(-0.7, 0.5, 0.2)),
    ]
    return System(bodies, [], [Bushing("mount", Marker("a"), Marker("b", triad=turned_triad(5)), **options)])


@pytest.mark.parametrize("axes", ["a", "half way"])
def test_energy_and_momentum_are_kept_at_large_rotations(axes):
    defects, turned = [], []
    for h in (4e-3, 2e-3):
        motion = integrate(free_pair(stiffness=six_by_six(1, 3.0), axes=axes), GeneralizedAlpha(1.0, 1e-12), 2.0, h)
        energy = motion.energies.total
        defects.append(np.abs(energy - energy[0]).max() / energy[0])
        linear, angular = motion.linear_momentum, motion.angular_momentum
        assert_allclose(linear, np.tile(linear[0], (len(linear), 1)), rtol=0, atol=1e-11)
        turned.append(np.abs(angular - angular[0]).max() / np.linalg.norm(angular[0]))
    for errors in (defects, turned):
        assert errors[1] < 1e-4
        assert errors[0] / errors[1] > 3.4


def test_damping_takes_what_the_balance_says():
    motion = integrate(
        free_pair(stiffness=six_by_six(1, 3.0), damping=six_by_six(2, 0.3), characteristics={"y": TABLE}),
        GeneralizedAlpha(0.9, 1e-11), 1.0, 1e-3,
    )  # fmt: skip
    balance = motion.energies.balance
    assert motion.energies.dissipated[-1] > 0.1
    assert np.abs(balance - balance[0]).max() < 1e-5 * motion.energies.total[0]


@pytest.mark.parametrize(("axes", "other_axes"), [("a", "b"), ("b", "a"), ("half way", "half way")])
def test_ends_can_be_exchanged(axes, other_axes):
    """The same bushing from B to A: deformations change their sign, and the motion stays."""
    K = six_by_six(1, 3.0)
    system = free_pair(stiffness=K, axes=axes)
    mount = system.forces[0]
    other = System(system.bodies, [], [Bushing("mount", mount.marker_b, mount.marker_a, stiffness=K, axes=other_axes)])
    first, second = (integrate(each, GeneralizedAlpha(0.9, 1e-11), 0.5, 2e-3) for each in (system, other))
    for name in "ab":
        assert_allclose(first.body(name).r, second.body(name).r, rtol=0, atol=1e-10)
        assert_allclose(first.body(name).p, second.body(name).p, rtol=0, atol=1e-10)


def test_a_body_on_a_bushing_sags_by_its_weight():
    """K x = m g, and a body in place of a marker stands as placed with zero deformation."""
    from floatframe import static_equilibrium

    body = RigidBody("engine", 2.0, np.eye(3), position=(1.0, 2.0, 3.0),
                     orientation=euler_parameters_of_rotation_vector(np.array([0.3, -0.4, 0.5])))  # fmt: skip
    mount = Bushing("mount", GROUND, Marker("engine", triad=turned_triad(2)), stiffness=np.full(6, 500.0))
    found = static_equilibrium(System([body], [], [Gravity((0, 0, -9.81)), mount]))
    assert_allclose(found.state.r[0], [1.0, 2.0, 3.0 - 2.0 * 9.81 / 500], rtol=0, atol=1e-9)
    assert_allclose(rotation_matrix(found.state.p[0]), rotation_matrix(body.orientation), rtol=0, atol=1e-9)


@pytest.mark.parametrize(
    ("options", "words"),
    [
        ({}, "expected stiffness, damping or preload other than zero"),
        ({"stiffness": np.triu(np.ones((6, 6)))}, "stiffness: expected a symmetric matrix"),
        ({"damping": -np.ones(6)}, "damping: expected no negative eigenvalue"),
        ({"stiffness": np.ones(6), "axes": "c"}, "axes: expected one of a, b, half way, got 'c'"),
        ({"stiffness": np.ones(5)}, "stiffness: expected six numbers, or six rows of six"),
        ({"characteristics": {"w": TABLE}}, "no deformation 'w'; choices: x, y, z, rx, ry, rz"),
        ({"characteristics": {"x": np.sin}}, "characteristics: x: expected a function of"),
    ],
)
def test_impossible_bushings_are_refused(options, words):
    with pytest.raises(ModelError, match=words):
        mounted(**options)
