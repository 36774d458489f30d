"""Systems with loops: torques of the independent coordinates against the absolute equations, fewer base parameters."""

from dataclasses import replace

import numpy as np
import pytest
import scipy.linalg as la
from numpy.testing import assert_allclose

from floatframe import Marker, PrismaticJoint, RevoluteJoint, System, inverse_dynamics
from floatframe.design.identification.base_parameters import base_parameters, random_samples
from floatframe.design.identification.estimation import Measured, estimate
from floatframe.design.identification.measured_file import measured_coordinates, read_measured
from floatframe.design.identification.regressors import linear_form
from floatframe.errors import ModelError
from floatframe.joints import CoordinateCoupler, JointCoordinate
from floatframe.model.functions.time_functions import harmonic
from tests.floatframe.design.identification.robots import palletizer, some_body

DRIVEN = ("turn", "shoulder", "crank", "wrist")
ANGLES = tuple(f"{name}/angle" for name in DRIVEN)
MOTIONS = {name: harmonic(0.3 + 0.1 * k, 2.0 + k, 0.4 * k) for k, name in enumerate(DRIVEN)}
TIMES = np.array([0.0, 0.1, 0.2, 0.3])


@pytest.fixture(scope="module")
def form():
    return linear_form(palletizer(), independent=ANGLES)


def driven_samples(form):
    """The samples of the motion that the drives make, and begin at their first angle."""
    x, rate, acceleration = (
        np.array([[MOTIONS[name](t, order) for name in DRIVEN] for t in TIMES]) for order in range(3)
    )
    return form.samples(x, rate, acceleration)


def test_torques_and_reactions_are_those_of_the_absolute_equations(form):
    """Of a parallelogram whose joints hold nothing twice, driven; and of one of hinges alone, whose rows repeat."""
    held = {name: motion for name, motion in MOTIONS.items()}
    found = inverse_dynamics(palletizer(hinges="RRUS", motions=held), TIMES)
    torque = np.column_stack([found.drives[f"{name}.angle"].force for name in DRIVEN])
    reaction = found.motion.reaction("turn")
    for hinges in ("RRRR", "RRUS"):
        own = linear_form(palletizer(hinges=hinges), independent=ANGLES)
        samples = driven_samples(own)
        assert_allclose(own.torques(samples) @ own.values, torque, rtol=0, atol=1e-8 * np.abs(torque).max())
        wrench = own.reactions(samples) @ own.values
        size = np.abs(reaction.force).max()
        assert_allclose(wrench, -np.hstack([reaction.force, reaction.moment]), rtol=0, atol=1e-8 * size)


@pytest.mark.parametrize(("gravity", "count"), [((0, 0, -9.81), 8), ((0, 0, 0), 4)])
def test_a_parallelogram_in_a_plane_has_as_many_as_its_energies_have(gravity, count):
    """Points at a e(q_2) + b e(q_3), complex a, b: ∫|a|², ∫|b|², ∫a b* and, weighed by gravity, ∫a and ∫b."""
    robot = palletizer(gravity, wrist=False)
    on_ground = [
        replace(joint, marker_a=Marker("ground", position=joint.marker_a.position))
        if joint.name in ("shoulder", "crank")
        else joint
        for joint in robot.joints[1:]
    ]
    form = linear_form(System(robot.bodies[1:], on_ground, robot.forces), independent=("shoulder/angle", "crank/angle"))
    base = base_parameters(form, by="samples")
    assert len(base.kept) == count
    assert "J_yy(arm) + 0.4 m(forearm) + J_yy(rod)" in base.names  # 0.1² + ... of the elbow: 0.2² + 0.6²
    samples = random_samples(form, seed=2)
    Y = form.torques(samples)
    assert_allclose(base.rows(Y) @ base.values(form.values), Y @ form.values, rtol=0, atol=1e-9 * np.abs(Y).max())


def test_loops_leave_fewer_combinations_than_the_tree_they_close(form):
    cut = System(palletizer().bodies, [j for j in palletizer().joints if j.name != "high"], palletizer().forces)
    tree, looped = (base_parameters(each, by="samples") for each in (linear_form(cut), form))
    assert len(looped.kept) < len(tree.kept)
    assert (len(looped.kept), len(base_parameters(form, source="reactions", by="samples").kept)) == (25, 30)
    # what no torque of the open tree shows, none of the closed one does
    both = la.orth(np.hstack([looped.silent, tree.silent]), rcond=1e-8)
    assert both.shape[1] == looped.silent.shape[1]


def test_parameters_of_a_robot_with_loops_are_estimated(form):
    """With friction in driven and passive joints, from noisy torques; errors as large as their deviations."""
    own = linear_form(form.system, ("viscous", "coulomb"), independent=ANGLES)
    phi = own.values
    phi[own.n_inertial :] = 2.0
    rng = np.random.default_rng(4)
    t, coefficients = np.arange(80) * 0.1, rng.normal(size=(4, 6)) * 0.25
    waves = [np.array([f(w * t) * w**order for w in (1.0, 2.0, 3.0) for f in pair]) for order, pair in enumerate(
        ((np.sin, np.cos), (np.cos, lambda x: -np.sin(x)), (lambda x: -np.sin(x), lambda x: -np.cos(x)))
    )]  # fmt: skip
    samples = own.samples(*((coefficients @ wave).T for wave in waves))
    base = base_parameters(own, by="samples")
    tau = own.torques(samples) @ phi
    made = estimate(own, Measured(samples, tau + 0.5 * rng.normal(size=tau.shape)), base=base)
    z = la.solve_triangular(la.cholesky(made.covariance, lower=True), made.values - base.values(phi), lower=True)
    assert abs((z**2).sum() - len(z)) < 4.5 * np.sqrt(2 * len(z))
    assert "viscous(elbow/angle)" in " ".join(base.names)


def test_files_have_the_coordinates_that_move_the_loops(form, tmp_path):
    samples = driven_samples(form)
    x, tau = samples.x[:, form.independent], form.torques(samples) @ form.values
    heads = ["time [s]", *(f"{name} [rad]" for name in ANGLES), *(f"{name} torque [N m]" for name in ANGLES)]
    rows = np.repeat(np.column_stack([x, tau]), 10, axis=0)  # 40 rows of four places
    table = np.column_stack([np.arange(len(rows)) * 0.01, rows])
    file = tmp_path / "measured.csv"
    np.savetxt(file, table, delimiter=",", header=",".join(heads), comments="", fmt="%.12g")
    assert set(measured_coordinates(file, form.system)) == set(ANGLES)
    read = read_measured(file, form).measured
    assert_allclose(read.torques[::10], tau, rtol=1e-9)
    assert_allclose(read.samples.x[::10], samples.x, rtol=0, atol=1e-9)


def test_what_does_not_move_a_loop_is_refused_by_name(form):
    robot = form.system
    with pytest.raises(ModelError, match=r"4 of .* move independently: name those .* such as independent = \('turn"):
        linear_form(robot)
    with pytest.raises(ModelError, match=r"4 of .* move independently .* got turn/angle, wrist/angle"):
        linear_form(robot, independent=ANGLES[::3])
    with pytest.raises(ModelError, match="do not determine the others"):
        linear_form(robot, independent=("turn/angle", "elbow/angle", "low/angle", "wrist/angle"))
    with pytest.raises(ModelError, match="no coordinate 'crnk/angle'; did you mean 'crank/angle'"):
        linear_form(robot, independent=("turn/angle", "shoulder/angle", "crnk/angle", "wrist/angle"))
    with pytest.raises(ModelError, match="'wrist/angle': these motions are prescribed"):
        linear_form(palletizer(motions={"wrist": MOTIONS["wrist"]}), independent=ANGLES)
    gear = CoordinateCoupler(
        "gear", [(JointCoordinate("turn", "angle"), 1.0), (JointCoordinate("wrist", "angle"), -2.0)]
    )
    with pytest.raises(ModelError, match="'gear': expected joints, whose reactions do no work"):
        linear_form(replace(robot, couplers=[gear]), independent=ANGLES)
    with pytest.raises(ModelError, match="rules of base parameters hold for trees"):
        base_parameters(form)


def test_positions_out_of_reach_and_dead_points_are_told_with_their_instant():
    """A crank of 0.3 m that a slider drives at most 1.3 m away, where crank and rod are in line."""
    rng = np.random.default_rng(1)
    bodies = [some_body(name, rng, (x, y, 0)) for name, x, y in (("crank", 0, 0), ("rod", 0, 0.3), ("slider", 0.9, 0))]
    far = np.hypot(0.9, 0.3)
    joints = [
        RevoluteJoint("pin", Marker("ground"), Marker("crank")),
        RevoluteJoint("big", Marker("crank", position=(0, 0.3, 0)), Marker("rod")),
        PrismaticJoint("guide", Marker("ground"), Marker("slider"), axis=(1, 0, 0)),
        RevoluteJoint("small", Marker("rod", position=(0.9, -0.3, 0)), Marker("slider")),
    ]
    form = linear_form(System(bodies, joints), independent=("guide/distance",))
    still = np.zeros((2, 1))
    place = form.samples(np.array([[0.9], [1.0]]), still, still)
    tip = place.r[:, 0] + place.R[:, 0] @ (0, 0.3, 0)  # of the crank
    assert_allclose(np.linalg.norm(tip - place.r[:, 2], axis=1), far, rtol=1e-12)
    with pytest.raises(ModelError, match=r"cannot be closed at instant 1|at instant 1 the loops .* singular"):
        form.samples(np.array([[0.9], [0.3 + far + 0.01]]), still, still)
