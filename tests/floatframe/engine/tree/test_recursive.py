"""Recursive dynamics against Pinocchio, and against the absolute formulation by plain kinematics."""

import numpy as np
import pytest
from numpy.testing import assert_allclose

import floatframe as ff
from floatframe.engine.open_equations import open_equations
from floatframe.errors import ModelError
from tests.floatframe.engine.tree.plain_kinematics import PlainTree, flexible_tree, random_motion
from tests.floatframe.engine.tree.random_trees import KINDS, PinocchioTree, random_state, random_tree, system_of

ROUNDOFF = 1e-12
BESIDE = 1e-10  #: times the condition number of the mass matrix: asked of the comparison with Pinocchio


def beside_pinocchio(n, seed, kinds=KINDS[:-1], **options):
    rng = np.random.default_rng(seed)
    links = random_tree(n, rng, kinds=kinds, **options)
    return ff.analyses.relative_model(system_of(links)), PinocchioTree(links), *random_state(links, rng), rng


TREES = {
    "hinges": (12, 1, ("revolute",), {}),
    "all charts": (25, 2, KINDS[:-1], {}),
    "all charts, free base": (25, 3, KINDS[:-1], {"free_base": True}),
    "a chain of balls": (10, 4, ("spherical",), {"branching": 0.0}),
    "80 bodies": (80, 5, ("revolute", "prismatic", "universal", "planar"), {"branching": 0.6}),
    "200 bodies": (200, 5, ("revolute", "prismatic", "universal", "planar"), {"branching": 0.6}),
}


@pytest.fixture(scope="module", params=[*list(TREES)[:-1], pytest.param("200 bodies", marks=pytest.mark.long)])
def rigid(request):
    n, seed, kinds, options = TREES[request.param]
    return beside_pinocchio(n, seed, kinds, **options)


def test_forces_are_those_of_pinocchio(rigid):
    model, other, z, z_dot, z_ddot, _ = rigid
    expected = other.inverse_dynamics(z, z_dot, z_ddot)
    got = model.inverse_dynamics(z, z_dot, z_ddot)
    assert_allclose(got, expected, rtol=0, atol=100 * ROUNDOFF * np.abs(expected).max())


def test_the_mass_matrix_is_that_of_pinocchio(rigid):
    model, other, z, *_ = rigid
    expected = other.mass_matrix(z)
    assert_allclose(model.mass_matrix(z), expected, rtol=0, atol=100 * ROUNDOFF * np.abs(expected).max())


def test_accelerations_are_those_of_pinocchio(rigid):
    model, other, z, z_dot, _, rng = rigid
    force = rng.normal(size=model.n_rates)
    expected = other.forward_dynamics(z, z_dot, force)
    condition = np.linalg.cond(other.mass_matrix(z))
    atol = min(BESIDE * condition, 1e-6) * np.abs(expected).max()
    assert_allclose(model.forward_dynamics(z, z_dot, force), expected, rtol=0, atol=atol)


def test_derivatives_of_forces_are_those_of_pinocchio(rigid):
    model, other, z, z_dot, z_ddot, _ = rigid
    got = model.derivatives(z, z_dot, z_ddot)
    for ours, theirs in zip(got, other.derivatives(z, z_dot, z_ddot), strict=False):
        assert_allclose(ours, theirs, rtol=0, atol=100 * ROUNDOFF * np.abs(theirs).max())


def test_derivatives_of_accelerations_are_those_of_pinocchio(rigid):
    model, other, z, z_dot, _, rng = rigid
    force = rng.normal(size=model.n_rates)
    condition = np.linalg.cond(other.mass_matrix(z))
    got = model.forward_derivatives(z, z_dot, force)
    for ours, theirs in zip(got, other.forward_derivatives(z, z_dot, force), strict=True):
        assert_allclose(ours, theirs, rtol=0, atol=min(BESIDE * condition, 1e-6) * np.abs(theirs).max())


FLEXIBLE = {
    "plain": {"is_stiffened": False},
    "stiffened": {},
    "free base": {"is_free": True, "seed": 4},
}


class Flexible:
    """A tree of flexible and rigid bodies, as recursion and as absolute equations."""

    def __init__(self, **options):
        self.system = flexible_tree(**options)
        self.model = ff.analyses.relative_model(self.system)
        self.plain, self.eq = PlainTree(self.system, self.model), open_equations(self.system)
        self.z, self.z_dot, self.z_ddot = random_motion(self.plain, 1)
        self.T = self.plain.jacobian(self.z)
        self.x, self.v = self.plain.absolute(self.z), self.T @ self.z_dot
        self.a = self.plain.accelerations(self.z, self.z_dot, self.z_ddot)


@pytest.fixture(scope="module", params=FLEXIBLE)
def flexible(request):
    return Flexible(**FLEXIBLE[request.param])


def test_plain_kinematics_close_all_joints(flexible):
    """The oracle of this file is one: its motion fulfils the absolute constraints and their rates."""
    eq, size = flexible.eq, np.abs(flexible.a).max()
    assert np.abs(eq.constraint(0.0, flexible.x)).max() < ROUNDOFF
    assert np.abs(eq.velocity_defect(0.0, flexible.x, flexible.v)).max() < 1e-12 * size
    defect = eq.jacobian(0.0, flexible.x) @ flexible.a - eq.acceleration_right(0.0, flexible.x, flexible.v)
    assert np.abs(defect).max() < 1e-10 * size


def test_forces_are_the_projected_residual_of_the_absolute_equations(flexible):
    eq = flexible.eq
    residual = eq.residual(0.0, flexible.x, flexible.v, flexible.a, np.zeros(eq.n_lam))
    expected = flexible.T.T @ residual
    got = flexible.model.inverse_dynamics(flexible.z, flexible.z_dot, flexible.z_ddot)
    assert_allclose(got, expected, rtol=0, atol=1e-10 * np.abs(expected).max())  # differences of sixth order in a


def test_the_mass_matrix_is_the_projected_one(flexible):
    M = flexible.T.T @ flexible.eq.mass(flexible.x) @ flexible.T
    assert_allclose(flexible.model.mass_matrix(flexible.z), M, rtol=0, atol=ROUNDOFF * np.abs(M).max())


def test_forward_dynamics_undoes_inverse_dynamics(flexible):
    model, (z, z_dot, z_ddot) = flexible.model, (flexible.z, flexible.z_dot, flexible.z_ddot)
    condition = np.linalg.cond(model.mass_matrix(z))
    got = model.forward_dynamics(z, z_dot, model.inverse_dynamics(z, z_dot, z_ddot))
    assert_allclose(got, z_ddot, rtol=0, atol=100 * ROUNDOFF * condition)


def differences(function, size, step):
    """Return the derivative by central differences of sixth order."""
    columns = []
    for e in np.eye(size) * step:
        near, far, furthest = (function(k * e) - function(-k * e) for k in (1, 2, 3))
        columns.append((45 * near - 9 * far + furthest) / (60 * step))
    return np.array(columns).T


def test_derivatives_of_flexible_trees_are_those_of_differences(flexible):
    model, (z, z_dot, z_ddot) = flexible.model, (flexible.z, flexible.z_dot, flexible.z_ddot)
    by_z = differences(lambda d: model.inverse_dynamics(model.moved(z, d), z_dot, z_ddot), model.n_rates, 1e-3)
    by_z_dot = differences(lambda d: model.inverse_dynamics(z, z_dot + d, z_ddot), model.n_rates, 1e-2)
    got = model.derivatives(z, z_dot, z_ddot)
    assert_allclose(got.by_z, by_z, rtol=0, atol=1e-10 * np.abs(by_z).max())
    assert_allclose(got.by_z_dot, by_z_dot, rtol=0, atol=1e-10 * np.abs(by_z_dot).max())


def test_a_body_with_one_mode_on_a_joint_without_rates_is_no_hinge():
    """Rates of the joint and modes of a body are one number there, which is its mode."""
    system = flexible_tree(n=2)
    model = ff.analyses.relative_model(system)
    z, z_dot, z_ddot = random_motion(PlainTree(system, model), 1)
    M = model.mass_matrix(z)
    got = model.forward_dynamics(z, z_dot, model.inverse_dynamics(z, z_dot, z_ddot))
    assert_allclose(got, z_ddot, rtol=0, atol=100 * ROUNDOFF * np.linalg.cond(M))


def test_the_state_of_the_bodies_is_that_of_plain_kinematics_and_back(flexible):
    model = flexible.model
    state = model.engine_state(flexible.z, flexible.z_dot)
    assert_allclose(state.u, flexible.v, rtol=0, atol=ROUNDOFF * np.abs(flexible.v).max())
    assert_allclose(state.r, flexible.x.take([range(*b) for b in position_parts(flexible)]), rtol=0, atol=ROUNDOFF * 10)
    z, z_dot = model.positions(model.state(flexible.z, flexible.z_dot))
    again = model.engine_state(z)
    assert_allclose(again.r, state.r, rtol=0, atol=1e-11)
    assert_allclose(z_dot, flexible.z_dot, rtol=0, atol=1e-9)


def position_parts(flexible):
    starts = np.cumsum([0, *(7 + flexible.plain.n_q)])[:-1]
    return [(int(s), int(s) + 3) for s in starts]


def test_a_wrench_at_an_interface_does_the_work_of_its_marker(flexible):
    """Power of a wrench is that of the generalised forces it stands for, by the velocity of the marker."""
    model, z, z_dot = flexible.model, flexible.z, flexible.z_dot
    marker, wrench = ff.Marker("b6", "end_b"), np.array([3.0, -2.0, 1.0, 0.5, 0.7, -0.4])
    zero = np.zeros(model.n_rates)
    change = model.inverse_dynamics(z, z_dot, zero) - model.inverse_dynamics(z, z_dot, zero, wrenches={marker: wrench})
    h = 1e-5
    places = [model.pose(model.moved(z, s * h * z_dot), marker) for s in (-1, 1)]
    v = (places[1][0] - places[0][0]) / (2 * h)
    W = places[0][1] @ ((places[1][1] - places[0][1]) / (2 * h)).T
    omega = -np.array([W[2, 1], W[0, 2], W[1, 0]])
    assert_allclose(change @ z_dot, wrench @ np.concatenate([v, omega]), rtol=1e-4)
    back = model.forward_dynamics(z, z_dot, change, wrenches={marker: -wrench})
    assert_allclose(back, model.forward_dynamics(z, z_dot), rtol=0, atol=1e-8 * np.abs(back).max())


def test_a_solution_solves_with_the_mass_matrix(flexible):
    M, right = flexible.model.mass_matrix(flexible.z), np.random.default_rng(2).normal(size=(flexible.model.n_rates, 3))
    got = flexible.model.solve(flexible.z, right)
    assert_allclose(M @ got, right, rtol=0, atol=100 * ROUNDOFF * np.linalg.cond(M))


def pendulum():
    rod = ff.RigidBody("rod", 2.0, np.diag([0.1, 0.2, 0.2]), center_of_mass=(0.5, 0, 0))
    hinge = ff.RevoluteJoint("hinge", ff.GROUND, ff.Marker("rod"), axis=(0, 1, 0))
    return ff.System([rod], [hinge], [ff.Gravity((0, 0, -9.81))])


def test_a_pendulum_has_the_torque_and_the_reaction_of_the_textbook():
    model = ff.analyses.relative_model(pendulum())
    z, w, alpha = 0.3, 1.2, -0.7
    J = 0.2 + 2.0 * 0.25
    torque = model.inverse_dynamics([z], [w], [alpha])
    assert_allclose(torque, [J * alpha - 2.0 * 9.81 * 0.5 * np.cos(z)], rtol=1e-13)
    along, across = np.array([np.cos(z), 0, -np.sin(z)]), np.array([-np.sin(z), 0, -np.cos(z)])
    force = 2.0 * (0.5 * alpha * across - 0.5 * w**2 * along - np.array([0, 0, -9.81]))
    assert_allclose(model.reactions([z], [w], [alpha])[0], [*force, 0, torque[0], 0], rtol=0, atol=1e-12)
    assert model.names == model.rate_names == ("hinge/angle",)


@pytest.mark.parametrize("is_reversed", [False, True])
def test_a_block_that_slides_on_a_turning_carrier_has_the_force_of_coriolis(is_reversed):
    """m (a + 2 ω × v + α × (p + r) + ω × (ω × (p + r))), axes of the carrier; the joint may be told from either end."""
    axis, p, m = np.array([0.36, -0.48, 0.8]), np.array([0.3, -0.2, 0.5]), 1.7
    carrier = ff.RigidBody("carrier", 3.0, np.diag([0.4, 0.5, 0.6]))
    block = ff.RigidBody("block", m, np.diag([0.1, 0.2, 0.25]), position=p)
    ends = ff.Marker("carrier", position=p), ff.Marker("block")
    slide = ff.joints.ConstantOrientation("slide", *(ends[::-1] if is_reversed else ends))
    hinge = ff.RevoluteJoint("hinge", ff.GROUND, ff.Marker("carrier"), axis=axis)
    model = ff.analyses.relative_model(ff.System([carrier, block], [hinge, slide]))
    assert [name.partition("/")[0] for name in model.names] == ["hinge", "slide", "slide", "slide"]
    (angle, w, acceleration), sign = (0.4, 2.3, -1.1), -1 if is_reversed else 1
    r, v, a = np.array([0.2, 0.1, -0.3]), np.array([0.5, -0.8, 0.7]), np.array([1.5, 0.3, -0.4])
    forces = model.inverse_dynamics([angle, *sign * r], [w, *sign * v], [acceleration, *sign * a])
    omega, alpha, arm = w * axis, acceleration * axis, p + r
    wanted = a + 2 * np.cross(omega, v) + np.cross(alpha, arm) + np.cross(omega, np.cross(omega, arm))
    assert_allclose(forces[1:], sign * m * wanted, rtol=0, atol=1e-12 * np.abs(wanted).max())


def test_reactions_balance_the_wrenches_of_a_chain_at_rest():
    """Held still, the joint at the base carries the weight of all bodies and a load at the tip."""
    links = random_tree(5, np.random.default_rng(7), kinds=("revolute", "universal"), branching=0.0)
    model = ff.analyses.relative_model(system_of(links, gravity=(0.0, 0.0, -10.0)))
    z, zero = np.full(model.n_z, 0.4), np.zeros(model.n_rates)
    tip, load = ff.Marker("b4", position=(0.1, 0.2, 0.3)), np.array([1.0, 2.0, 3.0, 0.0, 0.0, 0.0])
    reaction = model.reactions(z, zero, zero, wrenches={tip: load})[0]
    weight = 10.0 * sum(link.mass for link in links)
    assert_allclose(reaction[:3], np.array([0, 0, weight]) - load[:3], rtol=0, atol=1e-11)
    free = model.reactions(z, zero, zero)[0]
    base = model.pose(z, ff.Marker("b0", position=links[0].in_body[1]))[0]
    arm = model.pose(z, tip)[0] - base
    assert_allclose(reaction[3:], free[3:] - np.cross(arm, load[:3]), rtol=0, atol=1e-11)


def looped():
    bodies = [ff.RigidBody(name, 1.0, np.eye(3)) for name in "ab"]
    joints = [
        ff.RevoluteJoint("one", ff.GROUND, ff.Marker("a")),
        ff.RevoluteJoint("two", ff.Marker("a"), ff.Marker("b")),
        ff.RevoluteJoint("three", ff.GROUND, ff.Marker("b")),
    ]
    return ff.System(bodies, joints)


def sprung():
    system = pendulum()
    spring = ff.SpringDamper(
        "spring", ff.Marker("rod", position=(1, 0, 0)), ff.Marker("ground", position=(1, 1, 0)), 9.0
    )
    return ff.System(system.bodies, system.joints, [spring])


@pytest.mark.parametrize(
    ("system", "words"), [(looped(), "joint 'two' closes a loop"), (sprung(), "got force 'spring'")]
)
def test_systems_that_are_no_trees_under_gravity_are_refused(system, words):
    with pytest.raises(ModelError, match=words):
        ff.analyses.relative_model(system)


def test_a_tree_that_cannot_move_has_no_positions_and_no_mass():
    fixed = ff.System([ff.RigidBody("block", 2.0, np.eye(3))], [ff.FixedJoint("weld", ff.GROUND, ff.Marker("block"))])
    model = ff.analyses.relative_model(fixed)
    z, z_dot = model.positions()
    assert (z.shape, z_dot.shape, model.mass_matrix(z).shape) == ((0,), (0,), (0, 0))


def test_numbers_that_do_not_fit_are_refused():
    model = ff.analyses.relative_model(pendulum())
    with pytest.raises(ModelError, match="z: expected 1 finite numbers, got shape"):
        model.mass_matrix([0.1, 0.2])
    with pytest.raises(ModelError, match="z_dot: expected 1 finite numbers, got numbers that are not finite"):
        model.inverse_dynamics([0.1], [np.nan], [0.0])
    free = ff.analyses.relative_model(ff.System(pendulum().bodies))
    with pytest.raises(ModelError, match="Euler parameters of length 1 at 3 to 6"):
        free.mass_matrix(np.zeros(7))


def test_accelerations_under_a_drive_are_refused():
    rod = pendulum().bodies[0]
    hinge = ff.RevoluteJoint("hinge", ff.GROUND, ff.Marker("rod"), axis=(0, 1, 0), motions={"angle": 0.3})
    model = ff.analyses.relative_model(ff.System([rod], [hinge]))
    assert model.inverse_dynamics([0.0], [0.0], [1.0]).shape == (1,)
    with pytest.raises(ModelError, match="'hinge/angle' is prescribed"):
        model.forward_dynamics([0.0], [0.0])
