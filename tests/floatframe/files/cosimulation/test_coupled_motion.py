"""Units of other programs beside a system: orders of the coupling, failures in words with the motion kept."""

import zipfile

import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy.linalg import expm

from floatframe import integrate, read_results, read_system
from floatframe.errors import CosimulationError, FloatframeError, ModelError
from floatframe.files import co_simulate
from floatframe.files.cosimulation.archive import write_fmu
from floatframe.simulation import Coupling, ForeignUnit
from tests.floatframe.command import run_floatframe
from tests.floatframe.files.cosimulation.two_masses import T_END, X1, D, K, M, error, exact, write_two_masses

SPAN = 0.2
SIZES = {"explicit": (0.02, 0.01, 0.008, 0.005), "iterated": (0.05, 0.04, 0.025, 0.02)}


@pytest.fixture(scope="module")
def two_masses(tmp_path_factory):
    return write_two_masses(tmp_path_factory.mktemp("two"))


@pytest.mark.parametrize(("scheme", "order"), [("explicit", 1.0), ("iterated", 2.0)])
def test_the_error_of_the_coupling_has_its_order(two_masses, scheme, order):
    errors = [error(two_masses, scheme, size, SPAN) for size in SIZES[scheme]]
    assert abs(np.polyfit(np.log(SIZES[scheme]), np.log(errors), 1)[0] - order) < 0.15


def test_a_unit_of_our_own_in_fmi_3_acts_beside_a_system(tmp_path):
    """Two carts, each pushed by the place of the other: the exact motion, met in first order."""
    write_two_masses(tmp_path)
    text = (tmp_path / "first.toml").read_text()
    alone = text[: text.index("[fmus.second]")] + text[text.index("[run]") :]
    (tmp_path / "other.toml").write_text(alone)
    write_fmu(tmp_path / "other.toml", tmp_path / "other.fmu", fmi=3, outputs=["rail.distance"])
    (tmp_path / "both.toml").write_text(
        alone.replace(
            "[run]",
            '[fmus.other]\nfile = "other.fmu"\nparameters = {"forces.spring.damping" = 2.0}\n'
            'inputs = {"forces.spring.motor" = "rail.distance"}\n'
            'outputs = {"rail.distance.value" = "forces.spring.motor"}\n\n[run]',
        )
    )
    system, run = read_system(tmp_path / "both.toml")
    A = np.zeros((4, 4))
    A[:2, 2:] = np.eye(2)
    A[2:, :2] = np.array([[-K, 1.0], [1.0, -K]]) / M
    A[2:, 2:] = -np.diag([D, 2.0]) / M
    errors = []
    for size in (0.02, 0.01):
        motion = co_simulate(system, run.integrator, 0.2, 1e-3, Coupling(size))
        expected = np.array([(expm(A * t) @ [X1, X1, 0, 0])[0] for t in motion.t])
        errors.append(np.abs(motion.body("first").r[:, 0] - expected).max() / X1)
    assert errors[1] < 2e-3
    assert 1.6 < errors[0] / errors[1] < 2.4


def failing(path, at):
    text = path.read_text().replace("[cosimulation]", f"parameters = {{fails_at = {at}}}\n\n[cosimulation]")
    (path.parent / "failing.toml").write_text(text)
    return path.parent / "failing.toml"


def test_a_unit_that_fails_ends_the_run_in_words_and_the_motion_is_kept(two_masses, tmp_path):
    system, run = read_system(failing(two_masses, 0.1))
    words = r"the macro-step of 0\.01 from t = 0\.1 failed: fmus\.second: its step.*the second mass fell off"
    with pytest.raises(CosimulationError, match=words) as caught:
        co_simulate(system, run.integrator, T_END, run.h, run.coupling)
    motion = caught.value.trajectory
    assert_allclose(motion.t[-1], 0.1, rtol=1e-12)
    assert not motion.is_complete
    assert np.abs(motion.body("first").r[:, 0] - exact(motion.t)).max() < 0.1 * X1
    with pytest.raises(CosimulationError, match="the motion so far is in"):
        co_simulate(system, run.integrator, T_END, run.h, run.coupling, output=tmp_path / "motion.h5")
    assert_allclose(read_results(tmp_path / "motion.h5.segments").t[-1], 0.1, rtol=1e-12)


def test_the_command_runs_it_and_writes_every_so_many_steps(two_masses, tmp_path):
    text = two_masses.read_text().replace(f"t_end = {T_END}", "t_end = 0.1\noutput_every = 4")
    path = two_masses.with_name("often.toml")
    path.write_text(text)
    run_floatframe("run", path, "-o", tmp_path / "motion.h5", code=0)
    motion = read_results(tmp_path / "motion.h5")
    assert motion.is_complete
    assert_allclose(motion.t, np.arange(0, 101, 4) * 1e-3, rtol=0, atol=1e-12)
    system, run = read_system(two_masses)
    again = co_simulate(system, run.integrator, 0.1, run.h, run.coupling)
    assert_allclose(motion.body("first").r, again.body("first").r[::4], rtol=0, atol=1e-14)


def test_an_iteration_that_does_not_converge_says_so(two_masses):
    system, run = read_system(two_masses, {"fmus.second.parameters": {"kc": 1e7}})
    with pytest.raises(CosimulationError, match=r"did not converge in 5 rounds .* choose a smaller one"):
        co_simulate(system, run.integrator, T_END, run.h, Coupling(0.02, "iterated", max_iterations=5))


def test_an_acceleration_may_be_coupled_in_an_iteration(two_masses):
    """What the explicit scheme refuses as an algebraic loop: F = -kc a + ... is solved by the iteration."""
    changes = {"fmus.second.inputs.v1": "acceleration.x", "fmus.second.parameters": {"kc": 1.0}}
    system, run = read_system(two_masses, changes)
    with pytest.raises(ModelError, match=r"an algebraic loop: its output F follows its input v1 at once, which is acc"):
        co_simulate(system, run.integrator, 0.1, run.h, Coupling(0.01))
    motion = co_simulate(system, run.integrator, 0.03, run.h, Coupling(0.01, "iterated"))
    assert motion.is_complete


def test_a_run_alone_refuses_units_of_other_programs(two_masses, tmp_path):
    system, run = read_system(two_masses)
    with pytest.raises(ModelError, match=r"is coupled to units of other programs \(fmus: second\): use floatframe run"):
        integrate(system, run.integrator, 0.1, run.h)
    with pytest.raises(FloatframeError, match="which cannot be part of a unit"):
        write_fmu(two_masses, tmp_path / "first.fmu")
    assert not (tmp_path / "first.fmu").exists()


def test_a_unit_that_cannot_go_back_is_not_iterated(tmp_path):
    system, run = read_system(write_two_masses(tmp_path, can_go_back=False))
    with pytest.raises(ModelError, match="it cannot keep and restore its state"):
        co_simulate(system, run.integrator, 0.1, run.h, Coupling(0.01, "iterated"))


def changed_fmu(two_masses, change):
    """Return an FMU with another model description."""
    path = two_masses.with_name("changed.fmu")
    with zipfile.ZipFile(two_masses.with_name("second.fmu")) as old, zipfile.ZipFile(path, "w") as new:
        for name in old.namelist():
            data = old.read(name)
            if name.startswith("binaries/") and change == "binaries":
                continue
            if name == "modelDescription.xml" and change != "binaries":
                data = data.replace(*change)
            new.writestr(name, data)
    return path.name


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"fmus.second.file": "none.fmu"}, "fmus.second: file: no such file"),
        ({"fmus.second.file": "first.toml"}, "expected an FMU of version 2.0 or 3.0"),
        ({"fmus.second.file": (b'fmiVersion="2.0"', b'fmiVersion="1.0"')}, "expected an FMU|FMI 1.0"),
        ({"fmus.second.file": "binaries"}, "no binary for linux64; it has those for none"),
        ({"fmus.second.inputs": {"x3": "rail.distance"}}, "the FMU has no input 'x3'; choices: v1, x1"),
        ({"fmus.second.inputs": {"kc": "rail.distance"}}, "kc is of causality parameter, expected input"),
        ({"fmus.second.parameters": {"k": 1.0}}, "the FMU has no parameter 'k'; did you mean 'kc'"),
        ({"fmus.second.inputs.x1": "rail.distanc"}, "no sensor or joint coordinate 'rail.distanc'; did you mean"),
        ({"fmus.second.inputs.x1": "rail.distance.speed"}, "no column 'rail.distance.speed'"),
        ({"fmus.second.outputs.F": "forces.sprig.motor"}, "no input 'forces.sprig.motor'; did you mean"),
        ({"fmus.second.outputs.F": "joints.rail.distance"}, "no input 'joints.rail.distance'"),
        ({"cosimulation.step": 1.5e-3}, "step: expected a multiple of h = 0.001, got 0.0015"),
    ],
)  # fmt: skip
def test_impossible_connections_are_refused_before_anything_is_written(two_masses, tmp_path, changes, words):
    changes = {
        key: value
        if key != "fmus.second.file" or str(value).endswith((".fmu", ".toml"))
        else changed_fmu(two_masses, value)
        for key, value in changes.items()
    }
    system, run = read_system(two_masses, changes)
    with pytest.raises(ModelError, match=words):
        co_simulate(system, run.integrator, 0.1, run.h, run.coupling, output=tmp_path / "motion.h5")
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize(
    ("make", "words"),
    [
        (lambda: Coupling(scheme="implicit"), "scheme: expected one of explicit, iterated, got 'implicit'"),
        (lambda: Coupling(max_iterations=1), "max_iterations: expected at least 2"),
        (lambda: Coupling(step=-1.0), "Coupling: step"),
        (lambda: ForeignUnit("idle", "idle.fmu"), "it would have no effect"),
    ],
)
def test_bad_couplings_are_refused(make, words):
    with pytest.raises(ModelError, match=words):
        make()
