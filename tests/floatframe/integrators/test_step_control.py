"""Step control of generalized-alpha: errors, rejected steps, output times, restart; named cases of the method."""

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

import floatframe.simulation.integrate as integration
from floatframe import (
    FlexibleBody,
    GeneralizedAlpha,
    Gravity,
    JointForce,
    Marker,
    PrismaticJoint,
    RevoluteJoint,
    RigidBody,
    System,
    integrate,
)
from floatframe.components.mechanisms import slider_crank
from floatframe.errors import ConvergenceError, ModelError
from floatframe.integrators import hht, newmark, trapezoidal
from floatframe.model.functions.time_functions import cycloidal_spin_up
from floatframe.model.rotations import rotation_matrix
from floatframe.simulation import resume
from tests.floatframe.integrators.examples import pendulum
from tests.floatframe.model.bodies.examples import spinning
from tests.floatframe.orders import slope
from tests.floatframe.point_masses import PointMasses, reduced_body
from tests.floatframe.simulation.examples import StopHereError, assert_same, swing

T_END = 1.0


def worst(motion, exact):
    """Return the largest error of rotation and q at the output times."""
    body, errors = motion.body("body"), []
    for k in range(0, len(motion.t), max(1, len(motion.t) // 40)):
        p, q = exact(motion.t[k])[:2]
        errors += [np.abs(rotation_matrix(body.p[k]) - rotation_matrix(p)).max(), np.abs(body.q[k] - q).max()]
    return max(errors)


@pytest.fixture(scope="module")
def controlled():
    tolerances = 10.0 ** -np.array([5, 6, 7, 8])
    return tolerances, [integrate(pendulum(), GeneralizedAlpha(0.8, 1e-11, error_tolerance=x), T_END, 0.05)
                        for x in tolerances]  # fmt: skip


def test_error_of_a_motion_falls_with_the_tolerance(controlled, exact):
    """Local errors of third order: the global error goes with the tolerance to the power 2/3."""
    tolerances, motions = controlled
    errors = [worst(motion, exact) for motion in motions]
    assert errors[-1] < 1e-4
    assert_allclose(slope(tolerances, errors), 2 / 3, rtol=0, atol=0.15)


def test_estimated_error_of_one_step_is_the_true_one():
    """A body that spins freely, one step from a consistent state: the increment against that of steps a 64th."""
    system = spinning()
    for h in (0.02, 0.01):
        method = GeneralizedAlpha(0.8, 1e-13)
        memory = method.start(system, 0.0)
        for _ in range(3):  # the algorithmic acceleration settles
            memory = method.step(system, 0.0, h, memory)
        after = method.step(system, 0.0, h, memory)
        fine = GeneralizedAlpha(1.0, 1e-13)
        begin = fine.start(system, 0.0, memory.state)
        for _ in range(64):
            begin = fine.step(system, 0.0, h / 64, begin)
        error_q = np.abs(after.state.q - begin.state.q).max()
        _, _, beta, gamma = method.coefficients
        estimate = abs(gamma / 2 - beta - 1 / 12) * h**2 * np.abs((after.a - memory.a)[6:]).max()
        assert 0.5 < estimate / error_q < 2


def test_steps_follow_the_motion_and_output_times_are_met(controlled):
    for motion in controlled[1]:
        assert_allclose(motion.t, np.linspace(0, T_END, 21), rtol=0, atol=1e-15)
        assert motion.head.summary["n_steps"] > 20
    counts = [motion.head.summary["n_steps"] for motion in controlled[1]]
    assert counts == sorted(counts)
    assert_allclose(slope(controlled[0], counts), -1 / 3, rtol=0, atol=0.1)


def test_a_step_that_fails_is_divided_and_steps_grow_again():
    """Two iterations are too few for a step of 0.1 while the body spins, enough for shorter ones."""
    system = pendulum()
    with pytest.raises(ConvergenceError):
        integrate(system, GeneralizedAlpha(0.8, 1e-8, max_iterations=3), T_END, 0.1)
    motion = integrate(system, GeneralizedAlpha(0.8, 1e-8, max_iterations=3, h_min=1e-5), T_END, 0.1)
    summary = motion.head.summary
    assert motion.is_complete
    assert summary["n_rejected"] > 0
    assert summary["n_steps"] > 10
    assert_allclose(motion.t, np.linspace(0, T_END, 11), rtol=0, atol=1e-15)


def test_least_step_is_named_where_the_error_stays_above_the_tolerance():
    with pytest.raises(ConvergenceError, match=r"error_tolerance = 1e-10 down to the smallest step, h_min = 0.01"):
        integrate(pendulum(), GeneralizedAlpha(0.8, error_tolerance=1e-10, h_min=0.01), T_END, 0.05)


@pytest.mark.parametrize("options", [{"error_tolerance": 0.0}, {"h_min": -1.0}, {"parameters": (1.0, 0, 0.25, 0.5)}])
def test_impossible_options_are_refused(options):
    with pytest.raises(ModelError, match=next(iter(options))):
        GeneralizedAlpha(**options)


def test_resumed_run_with_controlled_steps_is_the_uninterrupted_one_bit_for_bit(tmp_path, monkeypatch):
    monkeypatch.setattr(integration, "SEGMENT_SECONDS", 0.0)
    method = GeneralizedAlpha(0.8, error_tolerance=1e-6)
    whole = integrate(swing(), method, 3.0, 5e-3)

    def stop(progress):
        if progress.t > 1.4:
            raise StopHereError

    with pytest.raises(StopHereError):
        integrate(swing(), method, 3.0, 5e-3, output=tmp_path / "run.h5", progress=stop)
    again = resume(swing(), tmp_path / "run.h5")
    assert_same(again, whole)
    for name in ("n_steps", "n_rejected", "n_iterations"):
        assert again.head.summary[name] == whole.head.summary[name]


def test_driven_mechanism_with_friction_is_that_of_fixed_short_steps():
    """Drives depend on time, friction on the reactions: the same end as with many fixed steps, in fewer."""
    plain = slider_crank(drive=cycloidal_spin_up(30.0, 0.3), angle=0.2)
    friction = JointForce("rub", "guide", "distance", friction_coefficient=0.2, friction_speed=0.05)
    system = System(plain.bodies, plain.joints, [Gravity((0, -9.81, 0)), friction])
    fixed = integrate(system, GeneralizedAlpha(0.8, 1e-10), 0.4, 1e-4, output_every=400)
    motion = integrate(system, GeneralizedAlpha(0.8, 1e-10, error_tolerance=1e-7), 0.4, 0.04)
    assert motion.head.summary["n_steps"] < 0.5 * fixed.head.summary["n_steps"]
    scale = np.abs(fixed.energies.work).max()
    assert fixed.energies.dissipated[-1] > 0.01 * scale
    assert_allclose(motion.energies.dissipated, fixed.energies.dissipated, rtol=0, atol=2e-3 * scale)
    for name in plain.bodies:
        assert_allclose(motion.body(name.name).r, fixed.body(name.name).r, rtol=0, atol=1e-5)


CASES = {"newmark": newmark(tolerance=1e-11), "hht": hht(-0.2, tolerance=1e-11)}


@pytest.mark.parametrize("name", CASES)
def test_named_cases_converge_with_second_order(name, exact):
    steps = np.array([4e-3, 2e-3, 1e-3, 5e-4])
    errors = [worst(integrate(pendulum(), CASES[name], 0.5, h), exact) for h in steps]
    assert_allclose(slope(steps, errors), 2, rtol=0, atol=0.15)


def test_named_cases_are_those_of_generalized_alpha():
    """rho_inf = 1 is alpha_m = alpha_f = 1/2, the trapezoidal rule has both zero; alpha = -1/3 is the most of HHT."""
    assert trapezoidal().coefficients == newmark(0.25, 0.5).coefficients == hht(0.0).coefficients == (0, 0, 0.25, 0.5)
    alpha_m, alpha_f, beta, gamma = hht(-1 / 3).coefficients
    assert_allclose((alpha_m, alpha_f, beta, gamma), (0, 1 / 3, 4 / 9, 5 / 6), rtol=1e-15)
    for wrong in (lambda: hht(-0.5), lambda: newmark(0.2, 0.5), lambda: newmark(0.25, 0.4)):
        with pytest.raises(ModelError, match="expected"):
            wrong()


def test_trapezoidal_rule_keeps_the_energy_of_a_linear_oscillator():
    """A body that only vibrates, in modes that do not move its frame: linear, so that energy is kept to rounding."""
    masses = np.array([1.0, 1.0, 2.0, 2.0])
    places = np.array([[1.0, 0, 0], [-1.0, 0, 0], [0, 1.0, 0], [0, -1.0, 0]])
    phi = np.zeros((4, 3, 1))
    phi[0, 0], phi[1, 0] = 1.0, -1.0  # two masses breathe along x
    reduced = reduced_body(PointMasses(masses, places, phi), np.array([[50.0]]))
    system = System([FlexibleBody("body", reduced, q=[0.1])])
    for method, keeps in ((trapezoidal(tolerance=1e-13), True), (hht(-0.2, tolerance=1e-13), False)):
        total = integrate(system, method, 2.0, 0.02).energies.total
        assert (np.ptp(total) < 1e-11 * total[0]) == keeps


def test_step_sizes_need_not_be_equal():
    """Outputs at odd places of the motion do not change it beyond the tolerance."""
    one, other = (integrate(pendulum(), GeneralizedAlpha(0.8, 1e-11, error_tolerance=1e-7), 0.6, h).body("body").q[-1]
                  for h in (0.6, 0.013))  # fmt: skip
    assert_allclose(one, other, rtol=0, atol=2e-4)
    assert not np.array_equal(one, other)


def test_restart_record_of_the_summary(tmp_path):
    motion = integrate(pendulum(), GeneralizedAlpha(), 0.01, 1e-3, output=tmp_path / "run.h5")
    assert motion.head.summary["n_steps"] == 10
    assert_array_equal(motion.head.summary["n_rejected"], 0)


def hinged(body, x=0.0):
    return Marker(body, position=(x, 0.0, 0.0))


def links_beside(*beside, cart=0.0):
    """A double pendulum of links of 1 kg and 1 m, and bodies beside it; on the ground, or on a cart of this mass."""
    links = [RigidBody(n, 1.0, 0.01 * np.eye(3), (1, 0, 0), (x, 0, 0)) for n, x in (("a", 0.0), ("b", 1.0))]
    joints = [RevoluteJoint("2", hinged("a", 1.0), hinged("b"), axis=(0, 0, 1))]
    if cart:
        links.append(RigidBody("cart", cart, 0.5 * cart * np.eye(3)))
        joints.append(PrismaticJoint("rail", hinged("ground"), hinged("cart"), axis=(1, 0, 0)))
    joints.append(RevoluteJoint("1", hinged("cart" if cart else "ground"), hinged("a"), axis=(0, 0, 1)))
    return System([*links, *beside], joints, [Gravity((0.0, -9.81, 0.0))])


@pytest.mark.parametrize("formulation", ["absolute", "relative"])
def test_no_heavy_or_far_body_hides_the_error_of_a_light_one(formulation):
    """Four tonnes beside made 764 steps 65, and the error a hundred times as large; on a cart of a tonne likewise."""

    def run(system):
        motion = integrate(system, GeneralizedAlpha(0.8, error_tolerance=1e-5), 1.0, 0.05, formulation=formulation)
        return motion.head.summary["n_steps"], motion.body("b").r

    n_alone, alone = run(links_beside())
    assert n_alone > 60
    for mass, place in ((4e3, (0, 50, 0)), (1e-3, (1e5, 0, 0))):
        n_steps, r = run(links_beside(RigidBody("beside", mass, mass * np.eye(3), position=place)))
        assert abs(n_steps - n_alone) <= 1
        assert_allclose(r, alone, rtol=0, atol=1e-6)
    n_steps, r = run(links_beside(cart=1e6))
    assert n_steps >= 0.9 * n_alone
    assert_allclose(r, alone, rtol=0, atol=1e-4)
