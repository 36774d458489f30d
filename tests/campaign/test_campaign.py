"""The oracles of the campaign: whole inputs pass, and each of them sees the fault it is there for."""

import subprocess
import sys
import tomllib

import numpy as np
import pytest

import floatframe as ff
from fe_models.foundation.units import unit_system
from tests.campaign.campaign import FAMILIES, case_of, main, verdict_of_exit
from tests.campaign.expressions import value_of_tape
from tests.campaign.jobs import JOB, job_case, wrong_body
from tests.campaign.motions import WRONG_BY, difference, growth_of, motion_verdict, reference_of, run
from tests.campaign.plain_mesh import FORMATS, bar, read_plain
from tests.campaign.random_motions import MotionCase, random_motion
from tests.campaign.systems import SYSTEM, system_case, wrong_motion
from tests.campaign.verdict import ACCEPTED, HANG, REFUSED, TRACEBACK
from tests.root import ROOT


@pytest.fixture(scope="module")
def reduced(tmp_path_factory):
    folder = tmp_path_factory.mktemp("job")
    assert job_case(0, folder).kind == ACCEPTED
    return folder


@pytest.mark.parametrize(("old", "new", "words"), [
    ("", "", ""),
    ("7.85e-9", "7.8500001e-9", "mass"),
    ("210000.0", "210000.1", "K is not that of the mesh"),
    ("0.3", "0.30001", "K is not that of the mesh"),
    ('"mm-t-s"', '"m-kg-s"', "units"),
    ("n_modes = 4", "n_modes = 5", "modes, asked for 5"),
    ("ratio = 0.01", "ratio = 0.0100001", "damping"),
    ("[30.0, 5.0, 4.0]", "[30.0, 5.0, 4.00001]", "reference point"),
    ("point = [0.0", "point = [10.0", "do not follow it"),
    ("interfaces.right", "interfaces.rihgt", "interfaces"),
])  # fmt: skip
def test_a_body_of_another_job_is_seen(reduced, old, new, words):
    reason = wrong_body(reduced, JOB.replace(old, new).encode())
    assert reason.startswith(words) or words in reason
    assert bool(reason) == bool(words)


@pytest.fixture(scope="module")
def moved(tmp_path_factory):
    folder = tmp_path_factory.mktemp("system")
    assert system_case(0, folder).words == "compared"
    return folder / "out.h5"


@pytest.mark.parametrize(("old", "new", "words"), [
    ("", "", ""),
    ("mass = 2.0", "mass = 2.0001", "forces on stick"),
    ("[0.0, 0.2, 0.001]", "[0.0, 0.2001, 0.001]", "moments on stick"),
    ("[0.05, 0.0, 0.0]", "[0.0501, 0.0, 0.0]", "on stick"),
    ("-9.81]", "-9.8101]", "forces on"),
    ("stiffness = 50.0", "stiffness = 50.01", "force of stay"),
    ("damping = 1.0", "damping = 1.01", "force of stay"),
    ("[0.5, 0.2, 0.0]", "[0.5, 0.2001, 0.0]", "on ball"),
    ("axis = [0.0, 1.0, 0.0]", "axis = [0.0, 0.9, 0.1]", "axis of joint pin"),
    ("marker_a = [0.5, 0.0, 0.0]", "marker_a = [0.5, 0.0, 0.01]", "joint link is open"),
    ("t_end = 0.1", "t_end = 0.102", "times"),
    ("position = [0.5, 0.0, 0.0]", "position = [0.5, 0.0, 0.01]", "joint pin is open"),
])  # fmt: skip
def test_a_motion_of_another_system_is_seen(moved, old, new, words):
    reason = wrong_motion(tomllib.loads(SYSTEM.replace(old, new, 1)), moved)
    assert bool(reason) == bool(words)
    assert words in reason


@pytest.mark.parametrize("suffix", FORMATS)
def test_the_plain_reading_gives_back_what_was_written(suffix):
    nodes, tets = bar()
    found, cells = read_plain(FORMATS[suffix](nodes, tets), suffix)
    np.testing.assert_array_equal([found[k + 1] for k in range(len(nodes))], nodes)
    np.testing.assert_array_equal(np.array(cells) - 1, tets)


def test_a_tape_of_another_expression_has_another_value():
    from floatframe.model.functions.expressions import compile_expression

    one = compile_expression("f", "x - y/z", ["x", "y", "z"])
    other = compile_expression("f", "x - z/y", ["x", "y", "z"])
    assert value_of_tape(one, (3.0, 2.0, 4.0)) == 2.5
    assert value_of_tape(other, (3.0, 2.0, 4.0)) == 1.0


@pytest.mark.parametrize("seeds", [(3, 4), pytest.param((5, 6), marks=pytest.mark.long)])
@pytest.mark.parametrize("family", [name for name in FAMILIES if name not in ("kills", "motions")])
def test_the_first_cases_of_every_family_pass(tmp_path, family, seeds):
    for seed in seeds:
        (tmp_path / str(seed)).mkdir()
        verdict = case_of(family)(seed, tmp_path / str(seed))
        assert verdict.kind in (REFUSED, ACCEPTED), verdict.words


@pytest.mark.parametrize(("words", "told"), [
    (["nosuch"], "expected families among jobs, meshes"),
    (["motions", "--count", "0"], "--count: expected a number of at least 1, got 0"),
    (["motions", "--seed", "x"], "invalid int value: 'x'"),
    (["--cuont", "5"], "got '--cuont'"),
])  # fmt: skip
def test_a_request_that_is_wrong_is_refused_in_words(capsys, words, told):
    assert main(words) == 2
    assert told in capsys.readouterr().out


@pytest.mark.parametrize(("work", "kind"), [
    ("while True: pass", HANG), ("time.sleep(1.0)", None), ("os._exit(3)", TRACEBACK),
])  # fmt: skip
def test_a_hang_is_measured_in_processor_time(work, kind):
    start = "import os, time\nfrom tests.campaign.campaign import limit_processor_time\nlimit_processor_time(0.3)\n"
    ended = subprocess.run([sys.executable, "-c", start + work], cwd=ROOT, check=False).returncode
    assert (None if ended == 0 else verdict_of_exit(ended).kind) == kind


def pendulum(n_links=1, gravity=-9.81, h=0.02, n_steps=100):
    """Return a case of links that hang from each other, let go from the level."""
    bodies, joints, last = [], [], ff.Marker("ground", position=np.zeros(3))
    for k in range(n_links):
        name = f"link{k}"
        bodies.append(ff.RigidBody(name, 1.0, 0.01 * np.eye(3), center_of_mass=(1, 0, 0), position=(k, 0, 0)))
        joints.append(ff.RevoluteJoint(f"j{k}", last, ff.Marker(name, position=np.zeros(3)), axis=(0, 0, 1)))
        last = ff.Marker(name, position=np.array([1.0, 0, 0]))
    system = ff.System(bodies, joints, [ff.Gravity((0, gravity, 0))])
    return MotionCase(system, ff.GeneralizedAlpha(0.8), h, n_steps, 0, "absolute", "pendulum")


def test_a_stiff_spring_that_vibrates_as_fast_as_the_steps_is_noted():
    """Half steps agree with the run by chance; the long test below computes that the motion is wrong by 5.5 %."""
    assert {note.kind for note in run(random_motion(210443), 1)[1]} & {"steps", "energy"}


@pytest.mark.long
def test_the_verdict_on_a_stiff_spring_knows_its_error_from_fine_steps():
    assert motion_verdict(random_motion(210443)).words.startswith("noted: error 5.5 %")


def test_the_oracle_of_motions_tells_a_right_motion_from_another_one():
    case = pendulum()
    reference = reference_of(case)
    assert difference(run(case, 1)[0], reference) < WRONG_BY < difference(run(pendulum(gravity=-12.0), 1)[0], reference)
    assert motion_verdict(case).words.startswith("right")
    in_chunks = run(MotionCase(**{**vars(case), "chunk": 10}), 1)[0]
    assert difference(in_chunks, reference) < WRONG_BY


def test_the_way_of_a_body_that_turns_about_its_origin_is_that_of_its_centre_of_mass():
    samples = run(pendulum(n_steps=110), 1)[0]  # swings from the level to the other side, and almost back
    np.testing.assert_allclose(samples.way, 2.0, rtol=0.02)
    origin, center = samples.r
    np.testing.assert_allclose(origin, 0.0, atol=1e-6)
    assert center[:, 1].min() < -0.9  # it hangs below the hinge
    assert center[:, 1].max() < 0.01


@pytest.mark.parametrize(("units", "length"), [("m-kg-s", 1.0), ("mm-t-s", 1e3)])
def test_a_body_that_moves_by_nanometres_is_at_rest_to_the_oracle(units, length):
    """Exact: on a spring of 1e5 rad/s a mass sags by 1 nm, and swings by 2 nm."""
    at = ff.Marker("ground", position=np.zeros(3))
    rail = ff.PrismaticJoint("rail", at, ff.Marker("mass", position=np.zeros(3)), axis=(0, 0, 1))
    spring = ff.JointForce("spring", "rail", "distance", stiffness=1e10)
    system = ff.System(
        [ff.RigidBody("mass", 1.0, np.eye(3))], [rail], [ff.Gravity((0, 0, -10.0 * length)), spring],
        unit_system(units),
    )  # fmt: skip
    case = MotionCase(system, ff.GeneralizedAlpha(0.8), 1e-5, 100, 0, "absolute", "stiff")
    samples = run(case, 1)[0]
    np.testing.assert_allclose(np.ptp(samples.r[..., 2]), 2e-9 * length, rtol=0.05)
    np.testing.assert_allclose(samples.way, 1e-7 * length, rtol=1e-12)


def test_the_oracle_of_motions_knows_chaos():
    assert growth_of(pendulum()) < 30
    chaotic = pendulum(3, n_steps=600)
    assert growth_of(chaotic) > 30


def test_a_seed_gives_the_same_random_motion_again():
    one, other = random_motion(7), random_motion(7)
    assert one.words == other.words
    assert [body.name for body in one.system.bodies] == [body.name for body in other.system.bodies]
    np.testing.assert_array_equal(one.system.bodies[0].position, other.system.bodies[0].position)
    assert random_motion(8).words != one.words
