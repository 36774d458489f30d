"""Compiled steps are those of the readable Python version, step by step."""

from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

from fe_models.body.load_cases import ReducedLoadCase
from floatframe import (
    GROUND,
    FlexibleBody,
    Gravity,
    JointForce,
    Marker,
    PointForce,
    RigidBody,
    SphericalJoint,
    SpringDamper,
    System,
    UserForce,
    integrate,
)
from floatframe.engine.compiling.system import compile_system, compiled_system
from floatframe.engine.kernels.connections.contact import V_0
from floatframe.engine.kernels.model import CONTACT
from floatframe.engine.kernels.work import new_work
from floatframe.engine.structure_preserving.system import discrete_system
from floatframe.errors import ConvergenceError
from floatframe.forces import BodyLoad
from floatframe.integrators import EnergyDecaying, EnergyMomentum, Variational
from floatframe.joints import AxialDistance, PointOnPlane
from floatframe.model.functions.time_functions import cycloidal_spin_up, harmonic
from floatframe.model.functions.time_functions import table as table_function
from floatframe.model.joints.rows import POINT
from tests.floatframe.engine.structure_preserving.in_python.bodies import placed_bodies, state_of
from tests.floatframe.engine.structure_preserving.in_python.constraints import Span
from tests.floatframe.engine.structure_preserving.in_python.schemes import one_step
from tests.floatframe.engine.structure_preserving.in_python.system import step_system
from tests.floatframe.engine.structure_preserving.systems import CONNECTED, CONTACTS, HELD_BY_ELEMENTS, ROLLING
from tests.floatframe.integrators.examples import floating_pair
from tests.floatframe.point_masses import random_point_masses, stiffened_body, stiffness

SCHEMES = {"momentum": EnergyMomentum(), "decaying": EnergyDecaying(0.3), "variational": Variational()}


def loaded(joint, body=None, **options):
    """Return a pair with gravity, a damped spring, forces that follow, forces along the joint and friction."""
    forces = [
        Gravity((0.0, -0.4, -1.0)),
        SpringDamper("damper", Marker("soft", "end_b"), Marker("block", position=(0.1, 0.2, 0.1)), 3.0, 0.4,
                     free_length=0.8, preload=0.3),
        PointForce("push", Marker("soft", "end_a"), (0.2, 0.1, 0.0), (0.1, 0.0, 0.05), is_follower=True),
    ]  # fmt: skip
    name = {"revolute": "angle", "prismatic": "distance"}.get(joint)
    if name and not options:
        table = table_function([-4.0, -2.0, 0.0, 2.0, 4.0], [0.9, 0.3, 0.0, -0.3, -0.7])
        forces.append(JointForce("spring", "joint", name, stiffness=0.8, damping=0.1, friction=0.05, friction_speed=0.2,
                                 characteristic=table))  # fmt: skip
    return floating_pair(joint, forces, body, **options)


def bent():
    """Return the pair with a body whose interfaces bend with its modes."""
    return loaded("universal", stiffened_body(random_point_masses(3, 3), stiffness(3, omega=6.0), size=0.2))


def held():
    """Return the pair on the ground beside a free body, with loads over time, a table, and a spring of no length."""
    plain = stiffened_body(random_point_masses(3, 3), stiffness(3, omega=6.0), size=0.2)
    f = np.array([0.3, -0.2, 0.1])
    case = ReducedLoadCase("push", "force", f, np.array([0.1, 0.2, -0.1]), np.array([0.3, -0.1, 0.2]))
    table = table_function([-4.0, -1.0, 1.0, 4.0], [-2.0, -0.3, 0.2, 1.0])
    pair = floating_pair("revolute", [
        BodyLoad("wind", "soft", "push", harmonic(1.0, 9.0)),
        PointForce("pulse", Marker("soft", "end_b"), (0.1, 0.2, -0.1), (0.05, -0.1, 0.1), amplitude=harmonic(2.0, 7.0)),
        SpringDamper("hard", Marker(GROUND, position=(2, 1, 0)), Marker("block"), characteristic=table),
        SpringDamper("centre", Marker(GROUND), Marker("soft", "end_b"), 2.0, free_length=0.0),
    ], replace(plain, load_cases=(case,)))  # fmt: skip
    pin = SphericalJoint("pin", GROUND, Marker("block", position=(0.3, 0.1, 0.0)))
    free = FlexibleBody("free", stiffened_body(random_point_masses(7, 2), stiffness(7, omega=9.0)), position=(5, 0, 0),
                        omega_B=(0.3, -0.5, 0.2))  # fmt: skip
    return System([free, *pair.bodies], [pin, *pair.joints], pair.forces)  # its modes come before those of the pair


#: connections act alike in the decaying scheme, which damps bodies and modes: those are in all of SYSTEMS
OF_CONNECTIONS = ("momentum", "variational")
SYSTEMS = {
    "revolute": lambda: loaded("revolute"),
    "driven": lambda: loaded("revolute", motions={"angle": cycloidal_spin_up(4.0, 0.3)}),
    "prismatic": lambda: loaded("prismatic"),
    "screw": lambda: loaded("screw"),
    "distance": lambda: loaded("distance"),
    "distance, driven": lambda: loaded("distance", motions={"distance": harmonic(0.1, 5.0, offset=0.5)}),
    "universal, stiffened": bent,
    "held": held,
}
RUB = [JointForce("rub", "joint", "distance", friction=0.05, friction_coefficient=0.3, friction_speed=0.2)]


@pytest.mark.parametrize("kind", SYSTEMS)
@pytest.mark.parametrize("name", SCHEMES)
def test_compiled_steps_are_those_of_the_python_version(kind, name):
    assert_steps_are_those_of_python(SYSTEMS[kind](), SCHEMES[name], name)


@pytest.mark.parametrize("kind", [kind for kind in CONNECTED if kind not in ROLLING | HELD_BY_ELEMENTS])
@pytest.mark.parametrize("name", OF_CONNECTIONS)
def test_connections_in_compiled_steps_are_those_of_the_python_version(kind, name):
    n_steps, h = (6, 0.06) if kind in CONTACTS else (2, 0.04)
    assert_steps_are_those_of_python(undivided(CONNECTED[kind]()), SCHEMES[name], name, n_steps, h)


def undivided(system):
    """Return a system whose compiled steps are not divided near contacts, as those of the Python version are not."""
    compiled = compiled_system(system)
    gaps = type(compiled.model.gaps)(*(array[:0] for array in compiled.model.gaps))
    system._derived[compile_system] = replace(compiled, model=compiled.model._replace(gaps=gaps))
    return system


@pytest.mark.parametrize("kind", ROLLING | HELD_BY_ELEMENTS)
def test_what_the_variational_scheme_refuses_moves_as_in_the_python_version(kind):
    assert_steps_are_those_of_python(CONNECTED[kind](), SCHEMES["momentum"], "momentum", 2)


@pytest.mark.parametrize("name", ["momentum", "decaying"])
def test_friction_by_the_normal_force_is_that_of_the_python_version(name):
    assert_steps_are_those_of_python(floating_pair("prismatic", RUB), SCHEMES[name], name)


@pytest.mark.parametrize("every", [1, 2, 4])
def test_steps_before_one_whose_force_is_infinite_at_its_end_are_told_with_as_many_rows(every):
    """A ball flies, in numbers without rounding, to the point where a tiny force is infinite, after four steps."""
    ball = RigidBody("ball", 1.0, np.eye(3), position=(-1.0, 0, 0), velocity=(1.0, 0, 0))
    along = AxialDistance(Marker(GROUND), Marker("ball"), (1, 0, 0))
    system = System([ball], [], [UserForce("pull", {"x": along}, {"x": "1e-300/x"})])
    after = after_three_good_steps(system, every, "force 'pull' is not finite")
    assert_array_equal(after.state.r, [[-0.25, 0, 0]])


@pytest.mark.parametrize("every", [1, 2, 4])
def test_steps_before_one_whose_end_has_no_accelerations_are_told_with_as_many_rows(every):
    """A point lies on two planes through it. They turn, in numbers without rounding, and meet after four steps.

    A step of h omega turns by 2 atan(h |omega| / 2): one plane by 90 degrees about z, its normals x, y, -x, -y, x, the
    other by 120 degrees about (1, 1, 1), its normals z, x, y, z, x. The factors of the first step serve all four.
    """
    ball = RigidBody("ball", 1.0, np.eye(3))
    quarter = RigidBody("quarter", 1.0, np.eye(3), omega_B=(0, 0, 8.0))
    third = RigidBody("third", 1.0, np.eye(3), omega_B=(8.0, 8.0, 8.0))
    planes = [PointOnPlane("x", Marker("quarter"), Marker("ball"), (1, 0, 0)),
              PointOnPlane("z", Marker("third"), Marker("ball"), (0, 0, 1))]  # fmt: skip
    pins = [SphericalJoint(f"pin of {body.name}", GROUND, Marker(body.name)) for body in (quarter, third)]
    system = System([ball, quarter, third], [*pins, *planes])
    after = after_three_good_steps(system, every, "at its end, constraints depend on each other")
    turned_by = [[1, 0, 0, 0], [np.sqrt(0.5), 0, 0, -np.sqrt(0.5)], [1, 0, 0, 0]]  # by 270 and by 360 degrees
    assert_allclose(np.abs(np.sum(turned_by * after.state.p, axis=1)), 1.0, rtol=1e-15)


def after_three_good_steps(system, every, words):
    """Return the memory before the fourth step of 0.25, which fails with these words."""
    method = EnergyMomentum()
    memory, work = method.start(system, 0.0), new_work(compiled_system(system).model)
    after, rows, n_good, failure = method.advance(system, memory, work, t0=0.0, h=0.25, first=0, n_steps=8, every=every)
    assert failure is not None
    assert failure.words.startswith(words)
    assert n_good == after.n_steps == 3
    assert_array_equal(rows.t, 0.25 * np.arange(every, 4, every))
    with pytest.raises(ConvergenceError, match=rf"from t = 0\.75 failed: {words}") as caught:
        integrate(system, method, 2.0, 0.25, output_every=every)
    assert_array_equal(caught.value.trajectory.t, 0.25 * np.arange(0, 4, every))
    return after


def assert_steps_are_those_of_python(system, method, name, n_steps=4, h=0.04):
    """Steps, each from where the compiled one before ended: state, multipliers, work, what connections remember.

    The multipliers of a point are forces in ground axes there, in axes of a body here: their sizes are the same.
    """
    ds = step_system(discrete_system(system, name))
    model = compiled_system(system).model
    contacts = model.connections.w0[:-1][model.connections.law == CONTACT] + V_0
    memory, work, f = method.start(system, 0.0), new_work(model), np.zeros(ds.n_held)
    for k in range(n_steps):
        placed = placed_bodies(ds.bodies, ds.model, memory.state)
        expected = one_step(method, ds, placed, Span(k * h, (k + 1) * h, (k + 0.5) * h, memory.w), f)
        before = memory.work
        memory, _, _, failure = method.advance(system, memory, work, t0=0.0, h=h, first=k, n_steps=1, every=100)
        assert failure is None
        state = state_of(ds.bodies, expected.placed)
        for field in ("r", "p", "q", "u"):
            assert_allclose(getattr(memory.state, field), getattr(state, field), rtol=0, atol=1e-11)
        assert_allclose(memory.work - before, expected.work, rtol=0, atol=1e-11)
        for rows in (model.coordinates.row, model.states.row, contacts):
            assert_allclose(memory.w[rows], expected.w[rows], rtol=0, atol=1e-10)
        f = expected.f
        points = model.rows.kind[[k for c in ds.connections for k in c.held]] == POINT
        sizes = [np.linalg.norm(each[points].reshape(-1, 3), axis=1) for each in (memory.a, f)]
        assert_allclose(sizes[0], sizes[1], rtol=1e-7, atol=1e-7)
        assert_allclose(memory.a[~points], f[~points], rtol=1e-7, atol=1e-7)
