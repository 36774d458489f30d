"""Runs that begin in equilibrium or in the state of another run, and values that --set replaces."""

import numpy as np
import pytest
from numpy.testing import assert_allclose
from typer.testing import CliRunner

import cms
import fe_models
import floatframe as ff
from cms.cli.app import app as cms_app
from fe_models.foundation.units import unit_system
from floatframe.cli.app import app
from floatframe.files.system_file.read_system import read_system
from floatframe.files.system_file.recorded_system import recorded_system
from floatframe.files.system_file.run_section import RunOptions
from floatframe.model.rotations import euler_parameters_of_rotation_vector, rotation_matrix
from floatframe.results.trajectory import read_trajectory
from tests.cms.command import run_cms
from tests.floatframe.command import run_floatframe

CART = """
[parameters]
stiffness = 500.0
mass = 2.0

[system]
units = "m-kg-s"
gravity = [0, 0, -9.81]

[bodies.slider]
mass = 1.0
inertia = [[0.1, 0, 0], [0, 0.2, 0], [0, 0, 0.2]]
velocity = [3.0, 0, 0]

[bodies.cart]
mass = "{mass}"
inertia = [[0.1, 0, 0], [0, 0.2, 0], [0, 0, 0.2]]
velocity = [3.0, 0, 0]

[joints.rail]
type = "prismatic"
body_a = "ground"
body_b = "slider"
marker_a = [0, 0, 0]
axis = [1, 0, 0]

[joints.up]
type = "prismatic"
body_a = "slider"
body_b = "cart"
marker_a = [0, 0, 0]
axis = [0, 0, 1]

[forces.spring]
type = "spring-damper"
body_a = "slider"
body_b = "cart"
marker_a = [0, 0, -0.5]
marker_b = [0, 0, 0.0]
stiffness = "{stiffness}"
free_length = 0.5

[run]
t_end = 0.05
h = 1e-3
"""


@pytest.fixture
def folder(tmp_path):
    (tmp_path / "cart.toml").write_text(CART)
    return tmp_path


def run(*arguments, program=app):
    result = CliRunner().invoke(program, [str(each) for each in arguments])
    assert result.exit_code == 0, result.output
    return result


def heights(path):
    motion = read_trajectory(path)
    return np.array([motion.state(k).r[1, 2] for k in range(len(motion.t))])


@pytest.mark.parametrize("formulation", ["absolute", "relative"])
def test_a_run_begins_in_equilibrium_with_its_velocities(folder, formulation):
    (folder / "cart.toml").write_text(CART + f'start = "equilibrium"\nformulation = "{formulation}"\n')
    run("run", folder / "cart.toml")
    assert_allclose(heights(folder / "cart.h5"), -2.0 * 9.81 / 500.0, rtol=0, atol=1e-10)
    assert_allclose(read_trajectory(folder / "cart.h5").state(-1).r[:, 0], 0.15, rtol=1e-9)


def test_a_run_begins_in_the_last_state_of_another(folder):
    run("run", folder / "cart.toml", "--set", "run.t_end=0.1", "-o", folder / "whole.h5")
    run("run", folder / "cart.toml", "-o", folder / "first.h5")
    (folder / "next.toml").write_text('extends = "cart.toml"\n[run]\nfrom = "first.h5"\n')
    run("run", folder / "next.toml")
    whole, parts = heights(folder / "whole.h5")[50:], heights(folder / "next.h5")
    assert_allclose(parts, whole, rtol=0, atol=1e-5 * np.ptp(whole))


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        ("m-kg-s", "mm-kg-s", "expected units mm-kg-s; the file has m-kg-s"),
        ("cart]", "car]", "expected bodies slider (0 modes), car (0 modes); the file has slider"),
        ("joints.up", "joints.lift", "expected joints and springs rail, lift, spring; the file has rail, up, spring"),
    ],
)
def test_a_run_from_another_system_is_refused(folder, old, new, words):
    run("run", folder / "cart.toml", "-o", folder / "first.h5")
    text = CART.replace(old, new).replace('body_b = "cart"', f'body_b = "{new[:-1] if "]" in new else "cart"}"')
    (folder / "next.toml").write_text(text + 'from = "first.h5"\n')
    result = run_floatframe("run", folder / "next.toml", code=2)
    assert "run.from" in result.stderr
    assert words in result.stderr


def test_a_run_does_not_overwrite_the_state_that_it_begins_from(folder):
    run("run", folder / "cart.toml", "-o", folder / "first.h5")
    (folder / "next.toml").write_text('extends = "cart.toml"\n[run]\nfrom = "first.h5"\n')
    for source in ("first.h5", "cart.toml"):
        result = run_floatframe("run", folder / "next.toml", "-o", folder / source, code=2)
        assert "this is an input" in result.stderr


def test_a_sweep_begins_each_run_in_its_equilibrium(folder):
    (folder / "cart.toml").write_text(CART + 'start = "equilibrium"\n')
    (folder / "sweep.toml").write_text(
        'system = "cart.toml"\n[parameters.stiffness]\npath = "stiffness"\nvalues = [250.0, 500.0]\n'
        '[outputs.low]\nof = "up.distance value"\ntake = "least"\n'
        '[outputs.high]\nof = "up.distance value"\ntake = "greatest"\n'
    )
    run("sweep", folder / "sweep.toml", "-j", "1", "-o", folder / "sweep.csv")
    rows = np.loadtxt(folder / "sweep.csv", delimiter=",", skiprows=1, usecols=(0, 1, 2))
    for column in (1, 2):
        assert_allclose(rows[:, column], -2.0 * 9.81 / rows[:, 0], rtol=0, atol=1e-9)


def test_computations_that_begin_as_placed_refuse_another_start(folder):
    (folder / "cart.toml").write_text(CART + 'start = "equilibrium"\n')
    result = run_floatframe("gradient", folder / "cart.toml", "-p", "mass", "--out", "up.distance", code=2)
    assert "run.start: this computation begins with the bodies as placed; remove the key" in result.stderr


@pytest.mark.parametrize(
    ("line", "words"),
    [("from = 3", "run.from = 3: expected a results file (.h5)"), ("fron = 3", "did you mean 'from'?")],
)
def test_the_key_from_is_called_so_in_messages(folder, line, words):
    (folder / "cart.toml").write_text(CART + line + "\n")
    result = run_floatframe("run", folder / "cart.toml", code=2)
    assert words in result.stderr
    assert "continues" not in result.stderr


def test_set_replaces_parameters_and_keys_and_the_results_record_them(folder):
    run("run", folder / "cart.toml", "--set", "mass=3.0", "--set", "run.h=5e-4", "--set", "bodies.slider.mass=4.0")
    motion = read_trajectory(folder / "cart.h5")
    assert motion.head.run["changes"] == {"mass": 3.0, "run.h": 5e-4, "bodies.slider.mass": 4.0}
    assert len(motion.t) == 101
    system = recorded_system(motion)
    assert [body.mass for body in system.bodies] == [4.0, 3.0]


@pytest.mark.parametrize("command", ["static", "modes", "linearize"])
def test_analyses_take_the_values_of_set(folder, command):
    result = run_floatframe(command, folder / "cart.toml", "--set", "nothing=1", code=2)
    assert "there is no parameter 'nothing'; choices: mass, stiffness" in " ".join(result.stderr.split())


@pytest.mark.parametrize("given", ["mass", "=3"])
def test_set_without_name_or_value_is_refused(folder, given):
    result = run_floatframe("run", folder / "cart.toml", "--set", given, code=2)
    assert "NAME=VALUE" in result.stderr


@pytest.mark.parametrize("program", [app, cms_app])
def test_the_shown_file_describes_the_same_system(folder, program):
    shown = run("show", folder / "cart.toml", "--set", "mass=3", program=program).stdout
    (folder / "shown.toml").write_text(shown)
    assert "parameters" not in shown
    assert [body.mass for body in read_system(folder / "shown.toml")[0].bodies] == [1.0, 3.0]


def test_a_file_of_another_kind_is_refused_with_its_command(folder):
    (folder / "cart.toml").write_text('kind = "system"\n' + CART)
    result = run_cms("reduce", folder / "cart.toml", code=2)
    assert result.stderr.count("\n") == 1
    assert 'expected a file of kind "job"; run this one by floatframe run cart.toml' in result.stderr


def test_a_file_without_kind_but_with_tables_of_another_is_refused_with_its_command(folder):
    """No key of the file belongs to a job; one required table is enough for the list of problems."""
    (folder / "cart.toml").write_text(CART)
    result = run_cms("reduce", folder / "cart.toml", code=2)
    assert result.stderr.count("\n") == 1
    assert 'its tables are those of kind "system"; run it by floatframe run cart.toml' in result.stderr
    (folder / "cart.toml").write_text(CART + "\n[reduction]\n")
    assert "problems:" in run_cms("reduce", folder / "cart.toml").stderr


def test_an_unknown_kind_is_refused_with_the_nearest(folder):
    (folder / "cart.toml").write_text('kind = "sytem"\n' + CART)
    result = run_floatframe("run", folder / "cart.toml", code=2)
    assert "did you mean 'system'?" in result.stderr


def test_run_runs_a_sweep_by_its_kind(folder):
    (folder / "sweep.toml").write_text(
        'kind = "sweep"\nsystem = "cart.toml"\nanalysis = "modes"\nworkers = 1\n'
        '[parameters.stiffness]\npath = "stiffness"\n'
        'values = [125.0, 500.0]\n[outputs.f]\nof = "frequency 2"\n'
    )
    result = run("run", folder / "sweep.toml", "-o", folder / "sweep.csv")
    rows = np.loadtxt(folder / "sweep.csv", delimiter=",", skiprows=1, usecols=(0, 1))
    assert_allclose(rows[:, 0], [125.0, 500.0])
    assert_allclose(rows[1, 1] / rows[0, 1], 2.0, rtol=1e-6)
    assert result.exit_code == 0
    (folder / "sweep.journal").unlink()  # of another system
    run("run", folder / "sweep.toml", "-o", folder / "heavy.csv", "--set", "mass=8.0")
    heavy = np.loadtxt(folder / "heavy.csv", delimiter=",", skiprows=1, usecols=(0, 1))
    assert_allclose(heavy[:, 1], rows[:, 1] / 2.0, rtol=1e-6)


@pytest.mark.parametrize("frame", [None, cms.NodalFrame("start")], ids=["mean", "nodal"])
@pytest.mark.parametrize("formulation", ["absolute", "relative"])
def test_a_turned_flexible_body_begins_sagged_and_with_its_velocity(frame, formulation):
    """A rod off the origin on a rail sags across it, does not vibrate, and keeps its speed along the rail."""
    line = fe_models.beams.BeamLine(1.0, 0.785, 2.1e9, 17500.0, 17500.0, 11200.0, 6.3e-6, 6.3e-6)
    reduced = cms.reduction.beam_from_assumed_modes(
        line, name="rod", units=unit_system("m-kg-s"), n_axial=1, n_bending=3, frame=frame
    )
    turn, along = euler_parameters_of_rotation_vector(np.array([0.4, -0.7, 0.9])), np.array([1.0, 2.0, 2.0]) / 3
    place, speed = np.array([0.3, -0.2, 0.5]), 1.7 * along
    interface = reduced.interfaces[0].name
    rod = ff.FlexibleBody("rod", reduced, position=place, orientation=turn, velocity=speed)
    rail = ff.PrismaticJoint("rail", ff.Marker("ground", position=place), ff.Marker("rod", interface), axis=along)
    pull = ff.Gravity(9.81 * np.cross(along, [0.6, 0.0, 0.8]))  # across the rail
    system = ff.System([rod], [rail], [pull])
    run_options = RunOptions(0.2, 1e-3, 1, ff.GeneralizedAlpha(0.8), start="equilibrium")
    motion = ff.integrate(
        system, run_options.integrator, 0.2, 1e-3, state=run_options.start_state(system), formulation=formulation
    )
    q, v = motion.body("rod").q, motion.body("rod").v
    if frame is not None:  # held at its interface: K q = C1ᵀ g
        sag = np.linalg.solve(reduced.K, reduced.moments.C1.T @ rotation_matrix(turn).T @ pull.acceleration)
        assert_allclose(q[0], sag, rtol=0, atol=1e-5 * np.abs(sag).max())
    assert_allclose(q, np.broadcast_to(q[0], q.shape), rtol=0, atol=1e-8 * np.abs(q[0]).max())
    assert_allclose(v, np.broadcast_to(speed, v.shape), rtol=0, atol=1e-8)
