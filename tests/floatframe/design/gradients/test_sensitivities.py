"""Sensitivities against closed forms, against each other, and against differences of whole runs."""

from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose

import floatframe as ff
from floatframe.components.mechanisms import pendulum, slider_crank
from floatframe.design.gradients.parameters import value_at, with_value
from floatframe.engine.compiling.placing import placed_bodies
from floatframe.model.functions.time_functions import constant, harmonic, piecewise
from tests.floatframe.model.elements.element_states_examples import lifted
from tests.floatframe.point_masses import random_point_masses, reduced_body, stiffened_body, stiffness

AGREE = 1e-10  #: of direct and adjoint, relative to the largest derivative of an output


def oscillator(k=40.0, c=0.6, m=2.0):
    """Return a mass on a spring with a damper along x, pulled 0.1 out of its rest."""
    body = ff.RigidBody("mass", m, np.eye(3), position=(1.1, 0, 0))
    guide = ff.PrismaticJoint("guide", ff.Marker(ff.GROUND), ff.Marker("mass"), axis=(1, 0, 0))
    spring = ff.SpringDamper("spring", ff.Marker(ff.GROUND), ff.Marker("mass"), k, c, 1.0)
    return ff.System([body], [guide], [spring], sensors=[ff.sensors.PlaceSensor("place", ff.Marker("mass"))])


def crank():
    """Return a slider-crank on a spring, under its weight, with sensors of all kinds of results."""
    system = slider_crank(angle=0.5, speed=6.0)
    post = ff.Marker(ff.GROUND, position=(0.8, 0.1, 0.0))
    forces = [ff.Gravity((0, -9.81, 0)), ff.SpringDamper("spring", post, ff.Marker("slider"), 50.0, 3.0, 0.3)]
    slider = ff.Marker("slider")
    sensors = [
        ff.sensors.PlaceSensor("x", slider), ff.sensors.PlaceSensor("v", slider, "velocity"),
        ff.sensors.PlaceSensor("a", slider, "acceleration"), ff.sensors.ReactionSensor("load", "pin"),
        ff.sensors.EnergySensor("energy"),
    ]  # fmt: skip
    return replace(system, forces=forces, sensors=sensors)


def swinging_body(stiffened=False):
    """Return a flexible body of particles on a ball joint and a spring, driven by its weight."""
    points = random_point_masses(3, 4)
    if stiffened:
        reduced = stiffened_body(points, stiffness(3), size=0.02)
    else:
        reduced = reduced_body(points, stiffness(3), D=np.diag([0.3, 0.2, 0.1]), interfaces=2)
    ball = ff.SphericalJoint("ball", ff.GROUND, ff.Marker("body", "end_a"))
    end = np.array([1.0, 0.4, -0.3])
    spring = ff.SpringDamper("spring", ff.Marker(ff.GROUND, position=end), ff.Marker("body", "end_b"), 30.0, 2.0, 0.5)
    sensors = [ff.sensors.PlaceSensor("tip", ff.Marker("body", "end_b")), ff.sensors.ModeSensor("mode", "body", 2)]
    gravity = ff.Gravity((0.3, 0.0, -9.81))
    return ff.System(
        [ff.FlexibleBody("body", reduced)], [ball], [gravity, spring], sensors=sensors, units=reduced.units
    )


def differences_of_runs(system, path, outputs, step, *, t_end, h, rho_inf=0.8):
    """Return the derivatives of the last values by central differences of fourth order of whole runs."""

    def run(value):
        changed = with_value(system, path, value)
        motion = ff.integrate(changed, ff.GeneralizedAlpha(rho_inf, tolerance=1e-13, stabilized=False), t_end, h)
        return np.array([last(changed, motion, of) for of in outputs])

    p = value_at(system, path)
    f = [run(p + k * step) for k in (-2, -1, 1, 2)]
    return (f[0] - 8 * f[1] + 8 * f[2] - f[3]) / (12 * step)


def last(system, motion, of):
    sensor, _, column = of.partition(" ")
    return ff.sensors.measured(system, motion)[sensor].columns[column][-1]


def test_an_oscillator_has_the_derivatives_of_its_closed_form():
    """x = exp(-d t)(cos w t + d/w sin w t) x0: by k, c, m and x0; the error of the scheme falls with h²."""
    k, c, m, x0, t = 40.0, 0.6, 2.0, 0.1, 0.7

    def x(k, c, m, x0):
        d, w0 = c / (2 * m), np.sqrt(k / m)
        w = np.sqrt(w0**2 - d**2 + 0j)
        return (np.exp(-d * t) * (np.cos(w * t) + d / w * np.sin(w * t)) * x0).imag / 1e-30

    i = 1e-30j
    exact = np.array([x(k + i, c, m, x0), x(k, c + i, m, x0), x(k, c, m + i, x0), x(k, c, m, x0 + i)])
    paths = ["forces.spring.stiffness", "forces.spring.damping", "bodies.mass.mass", "bodies.mass.position.0"]
    errors = []
    for h in (0.035, 0.0175):
        found = ff.design.sensitivities(oscillator(), ["place x"], paths, t_end=t, h=h)
        errors.append(found.gradient[0] - exact)
    assert_allclose(errors[0] / errors[1], 4.0, rtol=0.1)
    assert_allclose(errors[1], 0, rtol=0, atol=3e-3 * np.abs(exact).max())


def test_a_pendulum_has_the_derivative_of_its_elliptic_integral():
    """The angle after a quarter period of the nominal gravity, by gravity: at the bottom, d(angle) = speed dT/T/2 T."""
    from scipy.special import ellipk

    system = replace(pendulum(length=1.0, mass=1.0, angle=0.0))
    J = 1 / 3 + 0.01**2 / 4
    w0 = np.sqrt(9.81 * 0.5 / J)
    quarter = ellipk(0.5) / w0
    found = ff.design.sensitivities(
        system, ["hinge 1.angle value", "hinge 1.angle rate"], ["gravity.1"], t_end=quarter, h=quarter / 60,
        method="adjoint",
    )  # fmt: skip
    # the motion is a function of sqrt(g) t: d angle/dg = rate t/(2 g); the rate is stationary there but for its scale
    rate = found.values[1]
    assert_allclose(abs(rate), np.sqrt(2) * w0, rtol=1e-3)
    assert_allclose(found.of("hinge 1.angle value", "gravity.1"), rate * quarter / (2 * -9.81), rtol=1e-3)
    assert_allclose(found.of("hinge 1.angle rate", "gravity.1"), rate / (2 * -9.81), rtol=1e-3)


OUTPUTS = ["x x", "v x", "a x", "load force size", "energy total"]
PARAMETERS = {
    "mass": "bodies.rod.mass",
    "inertia": "bodies.rod.inertia.2.2",
    "stiffness": "forces.spring.stiffness",
    "damping": "forces.spring.damping",
    "marker": "joints.pin.marker_a.position.0",
    "speed": "bodies.slider.velocity.0",
    "gravity": "gravity.1",
}


def test_direct_and_adjoint_agree_and_are_the_derivatives_of_whole_runs():
    """Differences of runs end at the rounding of the runs: 1e-12 of positions, 1e-9 of accelerations and forces."""
    system = crank()
    run = {"t_end": 0.03, "h": 2.5e-3}
    direct = ff.design.sensitivities(system, OUTPUTS, PARAMETERS, **run)
    adjoint = ff.design.sensitivities(system, OUTPUTS, PARAMETERS, method="adjoint", **run)
    size = np.abs(direct.gradient).max(axis=1, keepdims=True)
    assert (np.abs(direct.gradient).min(axis=1) > 0).all()
    assert_allclose(adjoint.gradient / size, direct.gradient / size, rtol=0, atol=2 * AGREE)
    assert_allclose(adjoint.values, direct.values, rtol=0, atol=0)
    for name in ("mass", "marker", "speed"):
        path = PARAMETERS[name]
        step = 4e-3 * (abs(value_at(system, path)) or 1.0)
        by_runs = differences_of_runs(system, path, OUTPUTS, step, **run)
        own = direct.gradient[:, direct.parameters.index(name)]
        assert_allclose(own[[0, 4]], by_runs[[0, 4]], rtol=1e-8)
        assert_allclose(own[1:4], by_runs[1:4], rtol=2e-6)


def test_values_are_those_of_the_run():
    system = crank()
    found = ff.design.sensitivities(
        system, {"x": "x x", "rms": ("v x", "rms")}, ["bodies.rod.mass"], t_end=0.05, h=2.5e-3
    )
    motion = ff.integrate(system, ff.GeneralizedAlpha(0.8, tolerance=1e-12, stabilized=False), 0.05, 2.5e-3)
    measured = ff.sensors.measured(system, motion)
    assert_allclose(found.values[0], measured["x"].columns["x"][-1], rtol=1e-11)
    assert_allclose(found.values[1], np.sqrt((measured["v"].columns["x"] ** 2).mean()), rtol=1e-9)


@pytest.mark.parametrize("take", ["mean", "rms", "largest", "range", "first"])
def test_what_is_taken_over_time_has_its_derivative(take):
    system = crank()
    run = {"t_end": 0.015, "h": 3e-3}
    path = "joints.pin.marker_a.position.0"
    outputs = {"v": ("v x", take), "x": "x x"}
    direct = ff.design.sensitivities(system, outputs, [path], **run)
    adjoint = ff.design.sensitivities(system, outputs, [path], method="adjoint", **run)
    assert_allclose(adjoint.gradient, direct.gradient, rtol=1e-8, atol=1e-12)
    from floatframe.design.studies.study_file import TAKES

    def output_value(value):
        changed = with_value(system, path, value)
        motion = ff.integrate(changed, ff.GeneralizedAlpha(0.8, tolerance=1e-13, stabilized=False), **run)
        return TAKES[take](ff.sensors.measured(changed, motion)["v"].columns["x"])

    p, step = value_at(system, path), 1e-4
    by_runs = (output_value(p + step) - output_value(p - step)) / (2 * step)
    assert_allclose(direct.of("v", path), by_runs, rtol=1e-5)


@pytest.mark.parametrize("stiffened", [False, True])
def test_a_flexible_body_by_its_modal_matrices(stiffened):
    """K and D of the modes, the weight and the place at the start; a stiffened body moves in mean axes of its own K."""
    system = swinging_body(stiffened)
    paths = ["bodies.body.reduced.K.0.0", "bodies.body.reduced.K.0.1", "bodies.body.reduced.D.1.1", "gravity.2",
             "bodies.body.turn.0"]  # fmt: skip
    outputs, run = ["tip size", "mode q"], {"t_end": 0.048, "h": 4e-3}
    direct = ff.design.sensitivities(system, outputs, paths, **run)
    adjoint = ff.design.sensitivities(system, outputs, paths, method="adjoint", **run)
    size = np.abs(direct.gradient).max(axis=1, keepdims=True)
    # by the turn both are a difference of large terms: neighbouring systems differ by up to 3e-10, either way
    assert_allclose(adjoint.gradient / size, direct.gradient / size, rtol=0, atol=4 * AGREE)
    for name, step in ((paths[1], 1.0), (paths[4], 2e-3)):
        by_runs = differences_of_runs(system, name, outputs, step, **run)
        own = direct.gradient[:, direct.parameters.index(name)]
        assert_allclose(own, by_runs, rtol=0, atol=2e-8 * np.abs(by_runs).max())


def test_a_drive_by_its_amplitude_and_a_gear_by_its_ratio():
    system = slider_crank(angle=0.6, drive=harmonic(0.4, 6.0, phase=0.3, offset=0.6 - 0.4 * np.sin(0.3)))
    system = replace(system, sensors=[ff.sensors.PlaceSensor("x", ff.Marker("slider"))])
    path = "joints.main.motions.angle.pieces.0.7"  # the angular frequency
    found = ff.design.sensitivities(system, ["x x"], [path], t_end=0.06, h=3e-3)
    by_runs = differences_of_runs(system, path, ["x x"], 6e-2, t_end=0.06, h=3e-3)
    assert_allclose(found.gradient[0], by_runs, rtol=1e-7)


def test_equilibrium_of_a_hanging_mass_has_its_closed_form():
    """x = l0 + m g/k along a guide; reaction of the spring m g."""
    body = ff.RigidBody("mass", 2.0, np.eye(3), position=(1.4, 0, 0))
    guide = ff.PrismaticJoint("guide", ff.Marker(ff.GROUND), ff.Marker("mass"), axis=(1, 0, 0))
    spring = ff.SpringDamper("spring", ff.Marker(ff.GROUND), ff.Marker("mass"), 40.0, 0.0, 1.0)
    sensors = [ff.sensors.PlaceSensor("place", ff.Marker("mass")), ff.sensors.ReactionSensor("pull", "spring")]
    system = ff.System([body], [guide], [spring, ff.Gravity((9.81, 0, 0))], sensors=sensors)
    paths = ["bodies.mass.mass", "forces.spring.stiffness", "forces.spring.free_length", "gravity.0"]
    expected = [[9.81 / 40, -2 * 9.81 / 1600, 1.0, 2 / 40], [9.81, 0.0, 0.0, 2.0]]
    for method in ("direct", "adjoint"):
        found = ff.design.sensitivities(system, ["place x", "pull force x"], paths, analysis="static", method=method)
        assert_allclose(found.values, [1 + 2 * 9.81 / 40, 2 * 9.81], rtol=1e-10)
        assert_allclose(found.gradient, expected, rtol=0, atol=1e-9)
    assert_allclose(found.relative[0, 3], 2 * 9.81 / 40 / found.values[0], rtol=1e-9)


def test_frequencies_of_an_oscillator_have_their_closed_form():
    k, c, m = 40.0, 0.6, 2.0
    paths = ["forces.spring.stiffness", "forces.spring.damping", "bodies.mass.mass"]
    system = oscillator(k, c, m)
    found = ff.design.sensitivities(
        system, ["frequency 1", "damping 1", "real 1", "imaginary 1"], paths, analysis="modes"
    )
    w0 = np.sqrt(k / m)
    zeta = c / (2 * m * w0)
    w = np.sqrt(k / m - (c / (2 * m)) ** 2)
    assert_allclose(found.values, [w / (2 * np.pi), zeta, -c / (2 * m), w], rtol=1e-9)
    of_w = np.array([1 / m, -c / (2 * m**2), -k / m**2 + c**2 / (2 * m**3)]) / (2 * w)
    assert_allclose(found.gradient[3], of_w, rtol=1e-8)
    assert_allclose(found.gradient[0], of_w / (2 * np.pi), rtol=1e-8)
    assert_allclose(found.gradient[1], [-zeta / (2 * k), zeta / c, -zeta / (2 * m)], rtol=1e-8)
    assert_allclose(found.gradient[2], [0, -1 / (2 * m), c / (2 * m**2)], rtol=0, atol=1e-9)


def test_a_frequency_follows_the_equilibrium_it_is_taken_about():
    """A pendulum on a torsional spring hangs lower with more mass, and its frequency changes with that too."""
    system = pendulum(angle=-0.4)
    spring = ff.JointForce("twist", "hinge 1", "angle", stiffness=9.0)
    system = replace(system, forces=(*system.forces, spring))
    paths = ["bodies.rod 1.mass", "forces.twist.stiffness", "bodies.rod 1.center_of_mass.0"]
    found = ff.design.sensitivities(system, ["frequency 1"], paths, analysis="modes")
    for k, path in enumerate(paths):
        p, step = value_at(system, path), 1e-3

        def frequency(value, path=path):
            changed = with_value(system, path, value)
            rest = ff.static_equilibrium(changed, tolerance=1e-12)
            return ff.system_modes(ff.linearize(changed, rest)).frequencies[0]

        f = [frequency(p + s * step) for s in (-2, -1, 1, 2)]
        assert_allclose(found.gradient[0, k], (f[0] - 8 * f[1] + 8 * f[2] - f[3]) / (12 * step), rtol=1e-8)


def test_a_repeated_frequency_splits_into_its_branches():
    """A mass on equal springs along x and y: the spring along x moves one branch, the other stays."""
    body = ff.RigidBody("mass", 2.0, np.eye(3))
    hold = ff.joints.ConstantOrientation("hold", ff.Marker(ff.GROUND), ff.Marker("mass"))
    bush = ff.forces.Bushing(
        "bush", ff.Marker(ff.GROUND), ff.Marker("mass"), np.diag([50.0, 50.0, 90.0, 1.0, 1.0, 1.0])
    )
    system = ff.System([body], [hold], [bush])
    paths = ["forces.bush.stiffness.0.0", "forces.bush.stiffness.1.1", "bodies.mass.mass"]
    found = ff.design.sensitivities(system, ["frequency 1", "frequency 2", "frequency 3"], paths, analysis="modes")
    f = np.sqrt(50 / 2) / (2 * np.pi)
    assert found.repeated == ("frequency 1", "frequency 2")
    one = f / (2 * 50)
    assert_allclose(found.gradient[:2], [[0, 0, -f / 4], [one, one, -f / 4]], rtol=0, atol=1e-9)
    assert_allclose(found.gradient[2], [0, 0, -np.sqrt(45) / (2 * np.pi) / 4], rtol=0, atol=1e-9)


def test_a_function_of_parameters_is_differentiated_too():
    """Both by the same path, and by a parameter that changes several numbers."""
    paths = ["forces.spring.stiffness"]
    by_path = ff.design.sensitivities(oscillator(), ["place x"], paths, t_end=0.1, h=5e-3)
    by_name = ff.design.sensitivities(
        lambda p: oscillator(k=p["k"], m=p["s"] * 2.0), ["place x"], {"k": 40.0, "s": 1.0}, t_end=0.1, h=5e-3
    )
    assert_allclose(by_name.of("place x", "k"), by_path.gradient[0, 0], rtol=1e-10)
    by_mass = ff.design.sensitivities(oscillator(), ["place x"], ["bodies.mass.mass"], t_end=0.1, h=5e-3)
    assert_allclose(by_name.of("place x", "s"), 2 * by_mass.gradient[0, 0], rtol=1e-9)


def test_bad_input_is_told():
    system, run = crank(), {"t_end": 0.01, "h": 1e-3}

    def refused(match, *, of=("x x",), parameters=("bodies.rod.mass",), made=system, **options):
        with pytest.raises(ff.errors.FloatframeError, match=match):
            ff.design.sensitivities(made, list(of), list(parameters), **{**run, **options})

    refused("did you mean 'rod'", parameters=["bodies.rodd.mass"])
    refused("did you mean 'mass'", parameters=["bodies.rod.masss"])
    refused("did you mean 'bodies'", parameters=["bodys.rod.mass"])
    refused("number that can vary", parameters=["bodies.rod.name"])
    refused("expected an index of 0 to 2", parameters=["bodies.rod.inertia.3.0"])
    refused("2 indices", parameters=["bodies.rod.inertia.0"])
    refused("take turn.0", parameters=["bodies.rod.orientation.0"])
    refused("no sensor or joint coordinate 'xx x'", of=["xx x"])
    refused("no column", of=["x w"])
    refused("integral over the whole motion", of=["energy work"])
    refused("no method 'adjoined'", method="adjoined")
    refused("no analysis 'runs'", analysis="runs")
    refused("needs t_end and h", h=None)
    refused("steps of Variational are not differentiated", integrator=ff.integrators.Variational())
    refused("take fixed steps", integrator=ff.GeneralizedAlpha(error_tolerance=1e-5))
    refused("no parameter 'mass'", steps={"mass": 0.1})
    event = ff.simulation.Event("end", "x", 0.4, stop=True)
    refused("motions over events", made=replace(system, events=[event]))
    jump = ff.PointForce(
        "kick", ff.Marker("slider"), (1.0, 0, 0), amplitude=piecewise([0.0, 0.005], [constant(0.0), constant(1.0)])
    )
    refused("a force jumps at t = 0.005", made=replace(system, forces=(*system.forces, jump)))
    free = replace(crank(), forces=())
    refused("is not unique", of=["frequency 1"], analysis="modes", made=free)


@pytest.mark.parametrize("path", ["run.h", "run.t_end", "outputs.tip.position.0", "scene.0.color"])
def test_numbers_that_are_no_part_of_the_system_are_refused(tmp_path, path):
    """The end of a run moved the value, and its derivative came out as rounding about zero."""
    (tmp_path / "a.toml").write_text("[run]\nh = 1e-3\n")
    with pytest.raises(ff.errors.SystemFileError, match="not the system; expected a number of a body"):
        ff.design.sensitivities(tmp_path / "a.toml", ["tip x"], [path])


def test_a_parameter_that_changes_what_a_system_is_made_of_is_refused():
    def made(p):
        forces = [ff.Gravity((0, -9.81, 0))]
        if p["k"] > 1.0:
            forces.append(ff.SpringDamper("s", ff.Marker(ff.GROUND), ff.Marker("rod 1", position=(1.0, 0, 0)), p["k"]))
        return replace(pendulum(), forces=forces)

    with pytest.raises(ff.errors.ModelError, match="'k' changes the topology"):
        ff.design.sensitivities(made, ["hinge 1.angle value"], {"k": 1.0}, t_end=0.01, h=1e-3)


def test_a_damping_of_zero_is_differentiated_from_its_side():
    found = ff.design.sensitivities(oscillator(c=0.0), ["place x"], ["forces.spring.damping"], t_end=0.2, h=1e-2)
    both = ff.design.sensitivities(oscillator(c=0.02), ["place x"], ["forces.spring.damping"], t_end=0.2, h=1e-2)
    assert found.gradient[0, 0] != 0
    assert_allclose(found.gradient, both.gradient, rtol=5e-3)


def governor(k=400.0, m=2.0, free=0.5):
    """Return a mass that slides on a turning arm, held by a spring to the hub."""
    hub = ff.RigidBody("hub", 5.0, np.diag([0.2, 0.2, 0.4]))
    bob = ff.RigidBody("bob", m, 0.01 * np.eye(3), position=(0.55, 0, 0))
    axle = ff.RevoluteJoint("axle", ff.Marker(ff.GROUND), ff.Marker("hub"), axis=(0, 0, 1))
    arm = ff.PrismaticJoint("arm", ff.Marker("hub"), ff.Marker("bob"), axis=(1, 0, 0))
    spring = ff.SpringDamper("spring", ff.Marker("hub"), ff.Marker("bob"), k, 3.0, free)
    sensors = [ff.sensors.PlaceSensor("place", ff.Marker("bob")), ff.sensors.ReactionSensor("pull", "spring")]
    return ff.System([hub, bob], [axle, arm], [spring], sensors=sensors)


@pytest.mark.parametrize("method", ["direct", "adjoint"])
def test_a_steady_rotation_has_its_closed_form(method):
    """r = k l/(k - m w²), pull k (r - l) = m w² r."""
    k, m, free, w = 400.0, 2.0, 0.5, 6.0
    paths = ["forces.spring.stiffness", "bodies.bob.mass", "forces.spring.free_length", "bodies.hub.mass"]
    system = governor(k, m, free)
    found = ff.design.sensitivities(
        system, ["arm.distance value", "pull force size", "place size"], paths, analysis="rotation",
        omega=(0, 0, w), method=method,
    )  # fmt: skip
    d = k - m * w**2
    r = k * free / d
    of_r = np.array([free / d - k * free / d**2, k * free * w**2 / d**2, k / d, 0.0])
    of_pull = m * w**2 * of_r + np.array([0, w**2 * r, 0, 0])
    assert_allclose(found.values, [r, m * w**2 * r, r], rtol=1e-9)
    scale = np.array([[r], [m * w**2 * r], [r]])
    assert_allclose(found.gradient / scale, np.array([of_r, of_pull, of_r]) / scale, rtol=0, atol=1e-8)


def test_a_steady_rotation_of_a_flexible_body_and_differences_of_its_solutions():
    """The body is carried round on a revolute joint; its modes give way to the spin."""
    base = swinging_body()
    joint = ff.RevoluteJoint("hinge", ff.Marker(ff.GROUND), ff.Marker("body", "end_a"), axis=(0, 0, 1))
    system = replace(base, joints=[joint], forces=[])
    path, omega = "bodies.body.reduced.K.1.1", (0, 0, 1.5)
    found = ff.design.sensitivities(system, ["mode q"], [path], analysis="rotation", omega=omega)
    p = value_at(system, path)

    def value(at):
        about = ff.analyses.steady_rotation(with_value(system, path, at), omega, tolerance=1e-13)
        return about.state.q[1]

    step = 1e-2 * p
    f = [value(p + j * step) for j in (-2, -1, 1, 2)]
    expected = (f[0] - 8 * f[1] + 8 * f[2] - f[3]) / (12 * step)
    assert_allclose(found.gradient[0, 0], expected, rtol=1e-6)


@pytest.mark.parametrize("path", ["bodies.block.position.1", "bodies.block.turn.2", "joints.rail.marker_a.position.0"])
def test_a_body_without_a_position_varies_about_where_its_joints_place_it(path):
    """The joint turns the block, so that a block with the identity would begin in another configuration."""
    post, own = ff.Marker(ff.GROUND, position=(0.7, -0.4, 0.9)), ff.Marker("block", position=(0.1, 0.2, 0.0))
    rail = ff.joints.CylindricalJoint("rail", post, own, axis=(0.48, -0.6, 0.64), axis_b=(0, 0, 1))
    spring = ff.SpringDamper("spring", ff.Marker(ff.GROUND, position=(1, 2, 3)), ff.Marker("block"), 30.0)
    place = ff.sensors.PlaceSensor("place", ff.Marker("block", position=(0.3, 0.0, 0.1)))
    block = ff.RigidBody("block", 2.0, np.diag([0.1, 0.2, 0.25]), center_of_mass=(0.1, 0, 0))
    free = ff.System([block], [rail], [ff.Gravity((0, 0, -9.81)), spring], sensors=[place])
    given = replace(free, bodies=placed_bodies(free))
    found, expected = (ff.design.sensitivities(each, ["place x"], [path], t_end=0.1, h=1e-3) for each in (free, given))
    assert_allclose(value_at(free, path), value_at(given, path), rtol=0, atol=1e-15)
    if path.startswith("bodies"):
        assert_allclose(found.gradient, expected.gradient, rtol=1e-6, atol=0)
    by_runs = differences_of_runs(free, path, ["place x"], 1e-3, t_end=0.1, h=1e-3)
    assert abs(by_runs[0]) > 0.05
    assert_allclose(found.gradient[0], by_runs, rtol=1e-5, atol=0)


def test_what_a_turn_changes_has_no_derivative():
    system = governor()
    given = {"parameters": ["bodies.bob.mass"], "analysis": "rotation", "omega": (0, 0, 6.0)}
    with pytest.raises(ff.errors.ModelError, match="'place y' changes as the system rotates"):
        ff.design.sensitivities(system, ["place y"], **given)
    with pytest.raises(ff.errors.ModelError, match="a steady rotation needs omega"):
        ff.design.sensitivities(system, ["place x"], ["bodies.bob.mass"], analysis="rotation")
    with pytest.raises(ff.errors.ModelError, match="other than 0"):
        ff.design.sensitivities(system, ["place x"], **{**given, "omega": (0, 0, 0)})
    with pytest.raises(ff.errors.ModelError, match="belongs to analysis"):
        ff.design.sensitivities(system, ["place x"], ["bodies.bob.mass"], analysis="static", omega=(0, 0, 1))


def test_elements_with_states_of_their_own_are_refused():
    with pytest.raises(ff.errors.ModelError, match="'jack' has states, which are not differentiated"):
        ff.design.sensitivities(lifted(), ["rail.distance value"], ["bodies.b.mass"], t_end=0.02, h=1e-3)


def test_contacts_whose_steps_are_divided_are_refused():
    ground, body = ff.Marker("ground"), ff.Marker("b")
    foot = ff.forces.SphereContact("foot", ground, body, radius_b=0.1, stiffness=1e5)
    rail = ff.PrismaticJoint("rail", ground, body, axis=(0, 0, 1))
    system = ff.System([ff.RigidBody("b", 1.0, np.eye(3))], [rail], [foot])
    with pytest.raises(ff.errors.ModelError, match="contact 'foot' divides the step in which it closes, which is not"):
        ff.design.sensitivities(system, ["rail.distance value"], ["bodies.b.mass"], t_end=0.02, h=1e-3)
