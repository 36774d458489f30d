"""Robots on the command line: a description becomes a folder that runs, a system file a description."""

import json
from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose

from cms.body.modal_file.file import write
from floatframe import read_results, read_system, static_equilibrium
from floatframe.analyses import consistent_state
from floatframe.errors import UrdfError
from floatframe.files.importers.read_urdf import read_urdf
from floatframe.files.importers.robot_system import FlexibleLink, robot_system
from floatframe.files.importers.system_robot import robot_of_system
from floatframe.files.importers.system_tables import write_system
from floatframe.model.bodies.mode_choice import frozen_to_rigid
from floatframe.model.rotations import rotation_exp, rotation_matrix
from tests.floatframe.command import run_floatframe
from tests.floatframe.files.importers.flexible_arm import ARM, EI, GRAVITY, LENGTH, RHO_A, TIP_MASS, beam_body


def test_the_written_folder_is_the_same_system_and_runs(gripper, tmp_path):
    folder = tmp_path / "out"
    result = run_floatframe("import", gripper, "-o", folder, "--at", "slide=0.2", "--at", "knuckle=0.1", code=0)
    assert "note: 2 × <gazebo> not read" in result.stderr
    system, options = read_system(folder / "gripper.toml")
    expected = robot_system(read_urdf(gripper), configuration={"slide": 0.2, "knuckle": 0.1}).system
    found, wanted = consistent_state(system), consistent_state(expected)
    assert_allclose(found.u_dot, wanted.u_dot, rtol=0, atol=1e-11)
    assert [each.name for each in system.couplers] == [each.name for each in expected.couplers]
    assert system.couplers[0].limits == expected.couplers[0].limits
    assert_allclose(
        np.sort(system.body("finger").shapes[0].geometry.nodes, axis=0),
        np.sort(expected.body("finger").shapes[0].geometry.nodes, axis=0), rtol=1e-6, atol=1e-9,
    )  # fmt: skip
    assert options.t_end == 1.0
    file = folder / "gripper.toml"
    file.write_text(file.read_text().replace("t_end = 1.0", "t_end = 0.02"))
    result = run_floatframe("run", file, "-o", folder / "out.h5", code=0)
    assert read_results(folder / "out.h5").is_complete


def test_a_system_file_becomes_a_description_with_the_same_dynamics(gripper, tmp_path):
    run_floatframe("import", gripper, "-o", tmp_path / "out", "--keep-fixed")
    result = run_floatframe("export", tmp_path / "out" / "gripper.toml", "-o", tmp_path / "back" / "g.urdf", code=2)
    assert "URDF requires limits of a prismatic joint; effort, velocity not given" in result.stderr
    assert not (tmp_path / "back").exists()
    system, urdf = tmp_path / "out" / "gripper.toml", tmp_path / "back" / "g.urdf"
    result = run_floatframe("export", system, "-o", urdf, "--effort", 9, "--velocity", 2, code=0)
    assert "note: omitted: gravity" in result.stderr
    assert (tmp_path / "back" / "meshes" / "finger_0.stl").is_file()
    given, back = (robot_system(read_urdf(path)).system for path in (gripper, tmp_path / "back" / "g.urdf"))
    assert_allclose(consistent_state(back).u_dot, consistent_state(given).u_dot, rtol=0, atol=1e-10)


def test_info_tells_links_and_joints(gripper):
    record = json.loads(run_floatframe("info", gripper, "--json").stdout)
    assert (record["root"], record["freedoms"], record["mass"]) == ("world", 2, 2.5)
    assert record["links"][1]["pictures"] == ["cylinder", "box"]
    assert record["joints"][2]["follows"] == "knuckle"
    text = run_floatframe("info", gripper).stdout
    for words in ("gripper", "-0.1 to 0.5", "knuckle", "package://hand/meshes/tip.stl", "2 × <gazebo> not read"):
        assert words in text


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (["--at", "slide"], "--at slide: expected NAME=VALUE"),
        (["--at", "slide=far"], "--at slide=far: expected a number"),
        (["--at", "slide=3"], "beyond its limits -0.1 to 0.5"),
        (["--interface", "rail.slide=end"], "--interface: rail: not flexible"),
        (["--flexible", "rail=none.h5"], "none.h5"),
    ],
)
def test_bad_options_write_nothing(gripper, tmp_path, words, message):
    result = run_floatframe("import", gripper, "-o", tmp_path / "out", *words, code=2)
    assert message in result.stderr
    assert not (tmp_path / "out").exists()


# A flexible link -----------------------------------------------------------------------------------------------------


@pytest.fixture(scope="module")
def beam():
    return beam_body()


def arm(body, tmp_path, text=ARM, **changes):
    path = tmp_path / "arm.urdf"
    path.write_text(text)
    link = FlexibleLink(body, {"shoulder": "root", "elbow": "tip"}, rotation_vector=(0, -np.pi / 2, 0))
    return read_urdf(path), {"upper": replace(link, **changes)}


def test_a_flexible_link_without_modes_moves_as_the_rigid_one_of_the_same_mass(beam, tmp_path):
    robot, links = arm(frozen_to_rigid(beam), tmp_path)
    options = {"configuration": {"shoulder": 0.4, "elbow": -0.8}, "rates": {"shoulder": 1.0, "elbow": -3.0}}
    start = consistent_state(robot_system(robot, **options, flexible=links).system)
    expected = consistent_state(robot_system(robot, **options).system)
    assert_allclose(start.state.r[-1], expected.state.r[-1], rtol=0, atol=1e-12)
    assert_allclose(start.state.u[-6:], expected.state.u[-6:], rtol=0, atol=1e-12)
    assert_allclose(start.u_dot[-6:], expected.u_dot[-6:], rtol=0, atol=1e-9)


def test_a_flexible_link_sags_by_the_closed_form(beam, tmp_path):
    """A beam held level with a mass at its end: rho g L⁴/8EI + m g L³/3EI; the hand keeps the axes of its joint."""
    robot, links = arm(beam, tmp_path, ARM.replace('"continuous"', '"fixed"'))
    found = robot_system(robot, flexible=links, gravity=(0, 0, -GRAVITY))
    assert [joint.name for joint in found.system.joints] == ["shoulder", "elbow"]
    state = static_equilibrium(found.system).state
    sag = GRAVITY * LENGTH**3 / EI * (RHO_A * LENGTH / 8 + TIP_MASS / 3)
    assert_allclose(state.r[1, 2], 0.1 - sag, rtol=0, atol=2e-3 * sag)
    assert_allclose(state.r[1, 0], LENGTH, rtol=0, atol=sag**2)
    bent = rotation_matrix(state.p[1]) @ rotation_exp(np.array([-0.3, 0, 0]))
    slope = GRAVITY * LENGTH**2 / EI * (RHO_A * LENGTH / 6 + TIP_MASS / 2)
    assert_allclose(bent, rotation_exp(np.array([0, np.pi / 2 + slope, 0])), rtol=0, atol=5e-3 * slope)


def test_a_folder_with_a_flexible_link_is_the_same_system(beam, tmp_path):
    path = tmp_path / "beam.h5"
    write(beam, path)
    robot, links = arm(path, tmp_path)
    found = robot_system(robot, configuration={"shoulder": 0.4}, flexible=links)
    (file, *_) = write_system(found, tmp_path / "out")
    system, _ = read_system(file)
    assert_allclose(consistent_state(system).u_dot, consistent_state(found.system).u_dot, rtol=0, atol=1e-9)
    with pytest.raises(UrdfError, match="a system file needs its modal file"):
        write_system(robot_system(robot, flexible=arm(beam, tmp_path)[1]), tmp_path / "no")
    with pytest.raises(UrdfError, match=r"link 'upper' is flexible, so that its frame is not a place.*: root, tip"):
        found.place("upper")
    with pytest.raises(UrdfError, match="URDF has no flexible bodies; replace by rigid bodies: upper"):
        robot_of_system(found.system)


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"rotation_vector": (0, 0, 0)}, r"'tip' is 1\.131 m from joint 'elbow', at \[0\.8, .*check position"),
        ({"interfaces": {"shoulder": "root"}}, "the interface of joint 'elbow' is unknown"),
        ({"interfaces": {"shoulder": "root", "elbow": "top"}}, "no interface 'top'; did you mean 'tip'"),
    ],
)
def test_a_flexible_link_that_does_not_fit_is_refused(beam, tmp_path, changes, words):
    robot, links = arm(beam, tmp_path, **changes)
    with pytest.raises(UrdfError, match=words):
        robot_system(robot, flexible=links)
    with pytest.raises(UrdfError, match="there is no link 'uper'; did you mean 'upper'"):
        robot_system(robot, flexible={"uper": links["upper"]})
