"""FMUs of generated C: the motion of the engine by FMPy, derivatives of the model, and what cannot be made."""

import gc
import re
import subprocess
from dataclasses import replace
from itertools import pairwise
from pathlib import Path
from zipfile import ZipFile

import fmpy
import numpy as np
import pytest
from fmpy.fmi2 import FMU2Model, FMU2Slave
from fmpy.validation import validate_fmu
from numpy.testing import assert_allclose, assert_array_equal

import floatframe as ff
from floatframe.design.identification.inertial_parameters import parameters_of
from floatframe.errors import CosimulationError, ModelError
from floatframe.files.cosimulation.foreign_slave import ForeignSlave, callbacks
from floatframe.machines import flexible_arm
from floatframe.model.functions.time_functions import harmonic
from floatframe.simulation.foreign_units import ForeignUnit
from tests.floatframe.command import run_floatframe
from tests.floatframe.design.generation.calls import ROUNDOFF, Case, all_charts, puma
from tests.floatframe.design.generation.examples import PENDULUM

HEADERS = Path(fmpy.__file__).parent / "c-code"
T_END = 0.3
KINDS = ("ModelExchange", "CoSimulation")


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    return tmp_path_factory.mktemp("units")


@pytest.fixture(scope="module")
def robot():
    return Case(puma())


@pytest.fixture(scope="module", params=[2, 3])
def unit(request, robot, folder):
    return ff.design.generate_fmu(robot.system, folder / f"robot{request.param}.fmu", fmi=request.param)


@pytest.fixture(scope="module")
def expected(robot):
    """Positions and rates at the end by an adaptive method on the equations of the model, from a torque on joint 2."""
    from scipy.integrate import solve_ivp

    n = robot.model.n_rates
    force = np.zeros(n)
    force[1] = 30.0

    def change(t, x):
        return np.concatenate([x[n:], robot.model.forward_dynamics(x[:n], x[n:], force)])

    begin = np.concatenate(robot.model.positions())
    return solve_ivp(change, (0.0, T_END), begin, rtol=1e-11, atol=1e-11, method="DOP853").y[:, -1]


def states_at_the_end(unit, kind, **options):
    names = [each.name for each in unit.variables if each.is_state]
    found = fmpy.simulate_fmu(str(unit.path), fmi_type=kind, solver="CVode", stop_time=T_END, **options)
    return np.array([found[name][-1] for name in names])


def test_fmpy_finds_nothing_wrong_with_it(unit):
    assert validate_fmu(str(unit.path)) == []


@pytest.mark.parametrize("kind", KINDS)
def test_it_moves_as_the_model_does(unit, expected, kind):
    values = states_at_the_end(unit, kind, start_values={"joint2.angle.force": 30.0}, relative_tolerance=1e-9)
    assert_allclose(values, expected, rtol=0, atol=1e-5 * np.abs(expected).max())  # CVode in FMPy: first order
    if kind == "CoSimulation":  # fourth order of 1 ms
        assert_allclose(values, expected, rtol=0, atol=1e-8 * np.abs(expected).max())


def test_steps_are_of_fourth_order(unit):
    def end(h):
        start = {"joint2.angle.force": 30.0, "step": h}
        return states_at_the_end(unit, "CoSimulation", start_values=start, output_interval=T_END)

    ends = [end(1e-3 / 2**k) for k in range(4)]
    changes = np.log2([np.abs(b - a).max() for a, b in pairwise(ends)])
    assert_allclose(-np.polyfit(range(3), changes, 1)[0], 4, rtol=0, atol=0.15)


def mechanical_energy(case, z, z_dot):
    """Return kinetic energy and that of the weights, from the ten parameters of each body."""
    energy = 0.5 * z_dot @ case.model.mass_matrix(z) @ z_dot
    g = np.array([gravity.acceleration for gravity in case.system.forces])[0]
    for body in case.system.bodies:
        place, axes = case.model.pose(z, ff.Marker(body.name))
        m, *s = parameters_of(body)[:4]
        energy -= g @ (m * place + axes @ s)
    return energy


@pytest.fixture(scope="module")
def charts(folder):
    """All joints there are, with gravity as a parameter, and their unit."""
    case = Case(all_charts())
    return case, ff.design.generate_fmu(case.system, folder / "charts.fmu", parameters=["gravity"])


def test_a_tree_on_a_free_base_keeps_its_energy_and_moves_as_in_the_engine(charts):
    """With all joints there are, Euler parameters among the states."""
    case, made = charts
    begin = case.model.positions()[0]
    rates = [each.name for each in made.variables if each.is_state][case.model.n_z :]
    values = states_at_the_end(made, "CoSimulation", start_values=dict(zip(rates, case.z_dot, strict=True)))
    z, z_dot = values[: case.model.n_z], values[case.model.n_z :]
    energy = mechanical_energy(case, begin, case.z_dot)
    size = 0.5 * case.z_dot @ case.model.mass_matrix(begin) @ case.z_dot
    assert_allclose(mechanical_energy(case, z, z_dot), energy, rtol=0, atol=1e-8 * size)
    state = case.model.state(begin, case.z_dot)
    motion = ff.integrate(case.system, ff.integrators.trapezoidal(), T_END, 1e-3, formulation="relative", state=state)
    assert_allclose(z, case.model.positions(motion.state(-1))[0], rtol=0, atol=1e-4 * np.abs(z).max())
    for k, name in enumerate(case.model.names):
        if name.endswith("parameter w"):
            assert_allclose(np.linalg.norm(z[k : k + 4]), 1, rtol=0, atol=ROUNDOFF)


class Instance:
    """A unit of FMI 2.0 for model exchange, by the functions of the standard."""

    def __init__(self, path, model=FMU2Model):
        self.description = fmpy.read_model_description(str(path))
        self.folder = fmpy.extract(str(path))
        kind = self.description.modelExchange if model is FMU2Model else self.description.coSimulation
        self.unit = model(
            guid=self.description.guid, unzipDirectory=self.folder, modelIdentifier=kind.modelIdentifier,
            instanceName="one",
        )  # fmt: skip
        self.place = {v.name: v.valueReference for v in self.description.modelVariables}
        self.unit.instantiate(callbacks=callbacks())
        self.unit.setupExperiment()
        self.unit.enterInitializationMode()

    def set(self, names, values):
        self.unit.setReal([self.place[name] for name in names], values)

    def get(self, names):
        return np.array(self.unit.getReal([self.place[name] for name in names]))


def test_derivatives_are_those_of_the_model_with_parameters_as_set(charts):
    case, made = charts
    one = Instance(made.path)
    states = [each.name for each in made.variables if each.is_state]
    one.set(states, [*case.z, *case.z_dot])
    one.set([each.name for each in made.variables if each.causality == "input"], case.force)
    one.unit.exitInitializationMode()
    expected = case.model.forward_dynamics(case.z, case.z_dot, case.force)
    got = one.get([f"der({name})" for name in states])
    assert_array_equal(one.get(states), [*case.z, *case.z_dot])
    condition = np.linalg.cond(case.model.mass_matrix(case.z))
    atol = condition * ROUNDOFF * np.abs(expected).max()
    assert_allclose(got[case.model.n_z :], expected, rtol=0, atol=atol)
    h = 1e-6  # positions move along their rates
    moved = (case.model.moved(case.z, h * case.z_dot) - case.model.moved(case.z, -h * case.z_dot)) / (2 * h)
    assert_allclose(got[: case.model.n_z], moved, rtol=0, atol=1e-8)
    one.set(["gravity/x", "gravity/y", "gravity/z"], [0.0, 0.0, 0.0])
    without = one.get([f"der({name})" for name in states])[case.model.n_z :]
    difference = expected - without
    weight = case.model.forward_dynamics(case.z, np.zeros(case.model.n_rates), np.zeros(case.model.n_rates))
    assert_allclose(difference, weight, rtol=0, atol=atol * 10)
    one.unit.terminate()
    one.unit.freeInstance()


def test_a_flexible_arm_moves_as_in_the_engine_and_steps_follow_its_modes(folder):
    """Its states are hinges and modes; torques act at the hinges."""
    parts = flexible_arm.links()
    system = flexible_arm.arm(parts, modes=flexible_arm.BENDING)
    made = ff.design.generate_fmu(system, folder / "arm.fmu", fmi=3, step=1e-4)
    torques = {"shoulder": 1.0, "elbow": -0.3}
    forces = {f"{name}.angle.force": torque for name, torque in torques.items()}
    values = states_at_the_end(made, "CoSimulation", start_values=forces)
    motors = [ff.JointForce(f"motor {name}", name, "angle", preload=torque) for name, torque in torques.items()]
    motion = ff.integrate(
        replace(system, forces=motors), ff.integrators.trapezoidal(), T_END, 1e-4, formulation="relative"
    )
    z = ff.analyses.relative_model(system).positions(motion.state(-1))[0]
    sizes = np.array([1.0, 1e-3, 1e-4, 1.0, 1e-3, 1e-4])  # of hinges and modes
    assert (np.abs(values[: len(z)] - z) < 2e-3 * sizes).all()
    with pytest.raises(ModelError, match=r"step: 0.001 s is too long for the fastest mode.*expected .* s or less"):
        ff.design.generate_fmu(flexible_arm.arm(parts), folder / "stiff.fmu", step=1e-3)


def test_steps_follow_the_springs_and_dampers_of_joints(robot, folder):
    """A step just short of the limit of the method stays bounded; the one that is refused is not far above it."""
    stick = ff.RigidBody("stick", mass=1.0, inertia=0.5 * np.eye(3))
    pin = ff.RevoluteJoint("pin", ff.GROUND, ff.Marker("stick"), axis=(0, 1, 0))
    spring = ff.JointForce("spring", "pin", "angle", stiffness=0.5e6, free=0.1)  # 1000 rad/s
    system = ff.System([stick], [pin], [spring], name="stick")
    made = ff.design.generate_fmu(system, folder / "stick.fmu", step=2.5e-3)
    angle = states_at_the_end(made, "CoSimulation", output_interval=T_END)[0]
    assert abs(angle) < 0.3
    with pytest.raises(ModelError, match=r"fastest mode, 1000 rad/s; expected 0.0023 s or less"):
        ff.design.generate_fmu(system, folder / "stiff.fmu", step=3e-3)
    damped = replace(system, forces=[replace(spring, stiffness=0.0, damping=500.0)])  # exp(-1000 t)
    with pytest.raises(ModelError, match=r"too long for the fastest mode, 1000 rad/s"):
        ff.design.generate_fmu(damped, folder / "stiff.fmu", step=3e-3)


def test_dependencies_are_those_of_the_equations(folder):
    """Of a cart with a pendulum: accelerations need the angle and its rate, not where the cart is."""
    cart = ff.RigidBody("cart", mass=1.0, inertia=np.eye(3))
    bob = ff.RigidBody("bob", mass=1.0, inertia=0.1 * np.eye(3), position=(0, 0, -1))
    rail = ff.PrismaticJoint("rail", ff.Marker("ground"), ff.Marker("cart"), axis=(1, 0, 0))
    pin = ff.RevoluteJoint("pin", ff.Marker("cart"), ff.Marker("bob", position=(0, 0, 1)), axis=(0, 1, 0))
    system = ff.System([cart, bob], [rail, pin], [ff.Gravity((0, 0, -9.81))], name="cart")
    made = ff.design.generate_fmu(system, folder / "cart.fmu")
    described = fmpy.read_model_description(str(made.path))
    found = {each.variable.name: {v.name for v in each.dependencies} for each in described.derivatives}
    assert found["der(rail.distance.value)"] == {"rail.distance.rate"}
    forces = {"rail.distance.force", "pin.angle.force"}
    assert found["der(pin.angle.rate)"] == {"pin.angle.value", "pin.angle.rate", *forces}
    units = {v.name: v.unit for v in described.modelVariables}
    assert (units["pin.angle.force"], units["rail.distance.force"]) == ("N m", "N")
    assert (units["der(rail.distance.rate)"], units["der(pin.angle.value)"]) == ("m/s²", "rad/s")


def test_it_goes_back_to_states_that_were_kept_and_refuses_what_cannot_be(robot, folder):
    one = Instance(ff.design.generate_fmu(robot.system, folder / "kept.fmu").path, FMU2Slave)
    one.unit.exitInitializationMode()
    names = ["joint1.angle.value", "joint2.angle.value", "time"]
    one.set(["joint1.angle.force"], [5.0])
    one.unit.doStep(0.0, 0.01)
    kept, begin = one.unit.getFMUState(), one.get(names)
    content = one.unit.serializeFMUState(kept)
    one.unit.doStep(0.01, 0.01)
    first = one.get(names)
    assert first[2] == pytest.approx(0.02)
    for state in (kept, one.unit.deserializeFMUState(content)):
        one.unit.setFMUState(state)
        assert_array_equal(one.get(names), begin)
        one.unit.doStep(0.01, 0.01)
        assert_array_equal(one.get(names), first)
    for name, value in (("time", 1.0), ("der(joint1.angle.rate)", 1.0), ("step", 0.0), ("joint1.angle.force", np.nan)):
        with pytest.raises(Exception, match="fmi2SetReal failed"):
            one.set([name], [value])
    one.set(["joint1.angle.force"], [1e300])
    with pytest.raises(Exception, match="discard"):
        one.unit.doStep(0.02, 1.0)
    assert_allclose(one.get(names)[:2], first[:2], rtol=0, atol=0)
    one.unit.reset()
    assert one.get(["joint1.angle.force"])[0] == 0.0
    one.unit.terminate()
    one.unit.freeInstance()


def test_its_sources_agree_with_the_headers_of_the_standard_without_a_warning(unit, tmp_path):
    with ZipFile(unit.path) as archive:
        archive.extractall(tmp_path)
    fmi = unit.path.stem[-1]
    header = HEADERS / f"fmi{fmi}Functions.h"
    files = sorted((tmp_path / "sources").glob("*.c"))
    assert len(files) == 3
    words = ["cc", "-std=c99", "-O2", "-Wall", "-Wextra", "-Wpedantic", "-Werror", "-c"]
    for options in ([], ["-I", str(HEADERS), "-include", str(header)]):
        done = subprocess.run([*words, *options, *map(str, files)], cwd=tmp_path, capture_output=True, text=True)
        assert done.returncode == 0, done.stderr
    declared = set(re.findall(rf"_Export (fmi{fmi}\w+)TYPE", header.read_text()))
    assert len(declared) > 40
    symbols = subprocess.run(["nm", f"fmi{fmi}.o"], cwd=tmp_path, capture_output=True, text=True, check=True).stdout
    defined = {line.split()[2] for line in symbols.splitlines() if " T " in line}
    assert declared <= defined


def test_the_same_system_makes_the_same_bytes(robot, folder):
    one, two = (ff.design.generate_fmu(robot.system, folder / name) for name in ("one.fmu", "two.fmu"))
    assert one.path.read_bytes() == two.path.read_bytes()


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"fmi": 1}, "fmi: expected one of 2, 3"),
        ({"step": 0.0}, "step: expected a time above 0"),
        ({"stop_time": np.inf}, "stop_time: expected a time above 0"),
        ({"parameters": ["link9"]}, "'link9' matches no parameter"),
        ({"path": "robot.zip"}, "expected a file name that ends in .fmu"),
        ({"path": "nowhere/robot.fmu"}, "in a folder that exists"),
    ],
)
def test_what_cannot_be_is_told(robot, tmp_path, options, message):
    path = tmp_path / options.pop("path", "robot.fmu")
    with pytest.raises(ModelError, match=message):
        ff.design.generate_fmu(robot.system, path, **options)
    assert not list(tmp_path.iterdir())


def test_prescribed_coordinates_are_refused(robot, tmp_path):
    joints = [replace(robot.system.joints[0], motions={"angle": harmonic(1.0, 1.0)}), *robot.system.joints[1:]]
    with pytest.raises(ModelError, match=r"coordinate 'joint1/angle' is prescribed by a function of time"):
        ff.design.generate_fmu(replace(robot.system, joints=joints), tmp_path / "robot.fmu")
    assert not list(tmp_path.iterdir())


def test_events_are_refused(robot, tmp_path):
    event = ff.simulation.Event("end", "joint1.angle", 1.0, stop=True)
    with pytest.raises(ModelError, match=r"got event 'end', which the unit cannot represent; remove it"):
        ff.design.generate_fmu(replace(robot.system, events=[event]), tmp_path / "robot.fmu")
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize(
    ("compiler", "message"),
    [("no-such-compiler", "C compiler 'no-such-compiler' not found; install one"), ("false", "failed: no message")],
)
def test_a_compiler_that_is_not_there_or_fails_is_told(robot, tmp_path, monkeypatch, compiler, message):
    monkeypatch.setenv("CC", compiler)
    with pytest.raises(ModelError, match=message):
        ff.design.generate_fmu(robot.system, tmp_path / "robot.fmu")
    assert not list(tmp_path.iterdir())


def test_the_command_writes_one(tmp_path):
    (tmp_path / "pendulum.toml").write_text(PENDULUM)
    words = [
        "export",
        str(tmp_path / "pendulum.toml"),
        "--to",
        "fmu-c",
        "-o",
        str(tmp_path / "pendulum.fmu"),
        "--fmi",
        "3",
    ]
    made = run_floatframe(*words, "--parameter", "stick/m", code=0)
    for word in ("pin.angle.value", "pin.angle.force", "stick/m", "FMI 3.0 for"):
        assert word in made.output
    found = fmpy.simulate_fmu(
        str(tmp_path / "pendulum.fmu"), fmi_type="CoSimulation", stop_time=0.01, output_interval=0.01,
        start_values={"stick/m": 4.0},
    )  # fmt: skip
    expected = 4.0 * 0.5 * 9.81 / (0.2 + 4.0 * 0.5**2)  # m l g / (J + m l²), level
    assert_allclose(found["pin.angle.rate"][-1], 0.01 * expected, rtol=1e-5)
    made = run_floatframe(*words, "--what", "mass", code=2)
    assert "--what: belongs to --to c, python, casadi, matlab; --to fmu-c has --fmi, --step" in made.stderr


def test_each_of_two_units_beside_a_system_tells_its_own_words_also_when_the_other_has_gone(robot, folder):
    path = ff.design.generate_fmu(robot.system, folder / "told.fmu").path
    torque = "joint1.angle.force"
    first, second = (ForeignSlave(ForeignUnit(name, str(path), {torque: "sensor"}), 1.0) for name in ("one", "two"))
    for each in (first, second):
        each.begin(0.0, {torque: 0.0})
    with pytest.raises(CosimulationError, match=r"fmus\.one: setting its inputs failed: .*values that are not finite"):
        first.set({torque: np.nan})
    second.close()
    del second, each
    gc.collect()
    with pytest.raises(CosimulationError, match=r"fmus\.one: setting its inputs failed: .*values that are not finite"):
        first.set({torque: np.inf})
    first.close()
