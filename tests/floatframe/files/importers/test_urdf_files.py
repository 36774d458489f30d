"""URDF files: what is there is read, what is written reads the same, and what is wrong is told with its line."""

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

from floatframe import Marker, RigidBody, SphericalJoint, System
from floatframe.analyses import consistent_state
from floatframe.errors import UrdfError
from floatframe.files.importers.frames import Frame, rpy_of
from floatframe.files.importers.mesh_files import mesh_path
from floatframe.files.importers.read_urdf import read_urdf
from floatframe.files.importers.robot import MeshFile, Pose
from floatframe.files.importers.robot_system import range_of, robot_system
from floatframe.files.importers.system_robot import robot_of_system, urdf_text, write_urdf
from floatframe.joints import CoordinateCoupler
from floatframe.model.rotations import rotation_exp, rotation_matrix
from floatframe.model.shapes import Box, Cylinder, Mesh, Sphere
from tests.floatframe.files.importers.examples import GRIPPER
from tests.floatframe.files.importers.random_robots import random_robot


def pictured(picture):
    shape = picture.geometry
    numbers = {Box: ("size",), Cylinder: ("radius", "length"), Sphere: ("radius",), MeshFile: ("file", "scale")}
    own = [np.array(getattr(shape, name)).tolist() for name in numbers[type(shape)]]
    return [type(shape), own, picture.pose.xyz.tolist(), picture.pose.rpy.tolist(), picture.color, picture.name]


def described(robot):
    """All that a description says, as plain lists that can be compared."""
    links = [
        (
            link.name,
            link.inertial
            and [link.mass, link.inertial.pose.xyz.tolist(), link.inertial.pose.rpy.tolist(),
                 link.inertial.tensor.tolist()],
            [pictured(each) for each in link.visuals],
            [pictured(each) for each in link.collisions],
        )
        for link in robot.links
    ]  # fmt: skip
    joints = [
        (
            joint.name, joint.type, joint.parent, joint.child, joint.pose.xyz.tolist(), joint.pose.rpy.tolist(),
            joint.axis.tolist(), joint.limits, joint.damping, joint.friction, joint.mimic,
        )
        for joint in robot.joints
    ]  # fmt: skip
    return robot.name, links, joints


def test_what_is_read_is_what_is_there(gripper):
    robot = read_urdf(gripper)
    assert robot.order == ("world", "rail", "finger", "tip", "thumb")
    assert robot.notes == ("2 × <gazebo> not read", "1 × <transmission> not read")
    rail, slide = robot.link("rail"), robot.joint("slide")
    assert (rail.mass, rail.inertial.tensor[0, 1]) == (2.0, 0.001)
    assert rail.visuals[0].color == (0.2, 0.4, 0.8, 0.5)
    assert rail.visuals[1].name == "plate"
    assert isinstance(rail.collisions[0].geometry, Sphere)
    assert_array_equal(slide.axis, [0, 0, 1])
    assert (slide.limits.lower, slide.limits.velocity, slide.damping, slide.friction) == (-0.1, 0.2, 4.0, 0.5)
    assert (robot.joint("other").mimic.multiplier, robot.joint("other").mimic.offset) == (-2.0, 0.3)
    assert not robot.joint("end").has_value


def test_what_is_written_reads_the_same(gripper, tmp_path):
    robot = read_urdf(gripper)
    write_urdf(robot, tmp_path / "again.urdf")
    again = read_urdf(tmp_path / "again.urdf")
    assert described(again) == described(robot)
    (tmp_path / "random.urdf").write_text(random_robot(5, 12))
    robot = read_urdf(tmp_path / "random.urdf")
    write_urdf(robot, tmp_path / "again.urdf")
    assert described(read_urdf(tmp_path / "again.urdf")) == described(robot)


def test_roll_pitch_and_yaw_turn_about_fixed_axes():
    rng = np.random.default_rng(0)
    for rpy in [*rng.uniform(-1.5, 1.5, (5, 3)), [0.0, np.pi / 2, 0.4], [0.0, -np.pi / 2, -2.0]]:
        R = Pose(rpy=rpy).rotation
        x, y, z = (rotation_exp(angle * axis) for angle, axis in zip(rpy, np.eye(3), strict=True))
        assert_allclose(R, z @ y @ x, rtol=0, atol=1e-15)
        assert_allclose(rpy_of(R), rpy, rtol=0, atol=1e-7)  # at a right angle: the square root of rounding
        assert_allclose(Pose(rpy=rpy_of(R)).rotation, R, rtol=0, atol=1e-12)


def test_limits_drag_and_followers_become_stops_forces_and_couplers(gripper):
    """A distance is the value itself, an angle is zero as placed."""
    robot = read_urdf(gripper)
    found = robot_system(robot, configuration={"slide": 0.2, "knuckle": 0.25})
    system = found.system
    assert found.values == {"slide": 0.2, "knuckle": 0.25, "other": -0.2}
    couplers = {coupler.name: coupler for coupler in system.couplers}
    assert set(couplers) == {"slide stop", "knuckle stop", "other mimic"}
    assert (couplers["slide stop"].limits.lower, couplers["slide stop"].limits.upper) == (-0.1, 0.5)
    assert range_of(robot, robot.joint("knuckle")) == pytest.approx((-0.1, 0.4), abs=1e-15)  # of its follower
    stop = couplers["knuckle stop"].limits
    assert_allclose([stop.lower, stop.upper], [-0.35, 0.15], rtol=0, atol=1e-15)
    (drag,) = [force for force in system.forces if hasattr(force, "joint")]
    assert (drag.coordinate, drag.damping, drag.friction) == ("distance", 4.0, 0.5)
    state = consistent_state(system).state
    assert_allclose(state.r, [body.position for body in system.bodies], rtol=0, atol=1e-12)  # closed as placed
    assert found.offset("slide") == 0.0
    assert found.offset("knuckle") == 0.25


def test_a_follower_moves_as_it_must(gripper):
    """With its leader driven from 0.1 to 0.3, the follower ends where the description says."""
    from dataclasses import replace

    from floatframe.analyses.driven.kinematics import kinematics
    from floatframe.model.functions.point_to_point import quintic

    found = robot_system(read_urdf(gripper), configuration={"knuckle": 0.1, "slide": 0.05}, gravity=(0, 0, 0))
    joints = [
        replace(joint, motions={"angle": quintic(0, 1, 0.0, 0.2)}) if joint.name == "knuckle" else joint
        for joint in found.system.joints
    ]
    joints = [replace(joint, motions={"distance": 0.05}) if joint.name == "slide" else joint for joint in joints]
    driven = replace(found.system, joints=joints, couplers=found.system.couplers[-1:], forces=[])
    motion = kinematics(driven, [0.0, 1.0])
    expected = robot_system(read_urdf(gripper), configuration={"knuckle": 0.3, "slide": 0.05}).system.body("thumb")
    thumb = motion.body("thumb")
    assert_allclose(thumb.r[-1], expected.position, rtol=0, atol=1e-12)
    R = rotation_matrix(np.array([thumb.p[-1], expected.orientation]))
    assert_allclose(R[0], R[1], rtol=0, atol=1e-11)


def test_pictures_stand_in_their_bodies_and_meshes_are_found_in_packages(gripper):
    robot = read_urdf(gripper)
    found = robot_system(robot)
    cylinder, box = found.system.body("rail").shapes
    assert (cylinder.color, cylinder.opacity) == ("#3366cc", 0.5)
    assert_array_equal(cylinder.position, [0, 0, 0.1])
    assert_array_equal(box.geometry.size, [0.1, 0.2, 0.3])
    (mesh,) = found.system.body("finger").shapes
    nodes, faces = mesh.geometry.nodes, mesh.geometry.triangles
    assert_allclose(np.sort(nodes[:, 2])[[0, -1]], [-0.03, 0.0], rtol=0, atol=1e-9)
    a, b, c = (nodes[faces[:, k]] for k in range(3))
    assert_allclose(np.einsum("ij,ij->", a, np.cross(b, c)) / 6, 1e-6, rtol=1e-6)  # outward, though mirrored
    (ball,) = robot_system(robot, pictures="collision").system.body("rail").shapes
    assert isinstance(ball.geometry, Sphere)
    assert robot_system(robot, pictures="none").system.body("rail").shapes == ()
    other = gripper.parent / "elsewhere.stl"
    other.write_bytes(b"")
    assert mesh_path("package://hand/elsewhere.stl", str(gripper), {"hand": gripper.parent}) == other


def shaken(robot):
    """The robot that comes out of its own system, with what belongs to it."""
    found = robot_system(robot, configuration={"slide": 0.2, "knuckle": 0.25}, merge_fixed=False, gravity=(0, 0, 0))
    limits = {joint.name: joint.limits for joint in robot.joints if joint.has_value}
    values = dict(found.values)
    return found, robot_of_system(found.system, values=values, limits=limits)


def test_a_system_becomes_the_robot_that_it_was_made_of(gripper, tmp_path):
    robot = read_urdf(gripper)
    found, made = shaken(robot)
    assert made.notes == ()
    for name in ("slide", "knuckle", "other"):
        given, back = robot.joint(name), made.robot.joint(name)
        assert (back.type, back.child, back.limits) == (given.type, given.child, given.limits)
        assert (back.damping, back.friction) == (given.damping, given.friction)
        assert_allclose(back.axis, given.axis, rtol=0, atol=1e-14)
        assert_allclose(back.pose.xyz, given.pose.xyz, rtol=0, atol=1e-14)
        assert_allclose(back.pose.rpy, given.pose.rpy, rtol=0, atol=1e-14)
    mimic = made.robot.joint("other").mimic
    assert mimic.joint == "knuckle"
    assert_allclose([mimic.multiplier, mimic.offset], [-2.0, 0.3], rtol=1e-14, atol=0)
    for name, data in made.meshes.items():
        (tmp_path / name).parent.mkdir(exist_ok=True)
        (tmp_path / name).write_bytes(data)
    write_urdf(made.robot, tmp_path / "out.urdf")
    again = robot_system(read_urdf(tmp_path / "out.urdf"), configuration={"slide": 0.2, "knuckle": 0.25})
    for body, expected in zip(again.system.bodies, found.system.bodies, strict=True):
        assert (body.name, body.mass) == (expected.name, expected.mass)
        assert_allclose(body.inertia, expected.inertia, rtol=0, atol=1e-16)
        assert_allclose(body.center_of_mass, expected.center_of_mass, rtol=0, atol=1e-16)
        assert_allclose(body.position, expected.position, rtol=0, atol=1e-14)
        assert [shape.color for shape in body.shapes] == [shape.color for shape in expected.shapes]
    tips = [each.system.body("finger").shapes[0].geometry for each in (found, again)]
    assert_allclose(*(np.sort(tip.nodes, axis=0) for tip in tips), rtol=1e-7, atol=0)  # single precision


def test_a_system_whose_joints_stand_anywhere_is_the_same_robot(tmp_path):
    """Markers away from the frames of bodies, and a joint whose first marker is on the outer body."""
    from floatframe import GROUND, RevoluteJoint

    rng = np.random.default_rng(4)
    turns = [rotation_exp(v) for v in rng.normal(size=(4, 3))]
    a = RigidBody("a", 2.0, np.diag([0.1, 0.2, 0.25]), (0.1, 0.2, -0.1), position=(0.3, 0, 0))
    b = RigidBody("b", 1.0, np.diag([0.1, 0.1, 0.15]), (0, 0.1, 0), position=(0.5, 0.4, 0.1), shapes=[Box((1, 2, 3))])
    first = RevoluteJoint("first", Marker(GROUND, position=(0, 0.1, 0), triad=turns[0]), "a", axis=(1, 2, 0))
    second = RevoluteJoint(
        "second", Marker("b", position=(0.1, -0.2, 0), triad=turns[1]), Marker("a", triad=turns[2]), axis=(0, 1, 1)
    )
    b = RigidBody("b", 1.0, b.inertia, b.center_of_mass, position=(0.2, 0.2, 0), shapes=b.shapes)
    system = System([a, b], [first, second], units=System([a]).units)
    made = robot_of_system(system)
    write_urdf(made.robot, tmp_path / "made.urdf")
    again = robot_system(read_urdf(tmp_path / "made.urdf"), gravity=(0, 0, 0), rates={"first": 1.0, "second": -2.0})

    def accelerations(given, names):
        start = consistent_state(given)
        return {name: start.u_dot[6 * k : 6 * k + 3] for k, name in enumerate(names)}, start.state

    assert [joint.parent for joint in made.robot.joints] == ["ground", "a"]
    centres = {
        body.name: body.position + rotation_matrix(body.orientation) @ body.center_of_mass
        for body in again.system.bodies
    }
    for body in system.bodies:
        assert_allclose(centres[body.name], body.position + body.center_of_mass, rtol=0, atol=1e-14)
    # the same rates in the system that was exported: about its own axes
    spin = turns[0] @ first.axis
    at = again.system.body("a")
    assert_allclose(rotation_matrix(at.orientation) @ at.omega_B, spin, rtol=0, atol=1e-14)
    at = again.system.body("b")
    relative = -(turns[1] @ second.axis) * -2.0
    assert_allclose(rotation_matrix(at.orientation) @ at.omega_B, spin + relative, rtol=0, atol=1e-14)


def test_a_free_base_falls_and_takes_its_mass_along(tmp_path):
    path = tmp_path / "free.urdf"
    path.write_text(random_robot(7, 3).replace('<link name="base"/>', random_link()))
    found = robot_system(read_urdf(path), is_free=True, position=(1, 2, 3), rotation_vector=(0, 0, 0.5))
    assert [body.name for body in found.system.bodies] == ["base", "link0", "link1", "link2"]
    assert_allclose(found.system.body("base").position, [1, 2, 3], rtol=0, atol=0)
    start = consistent_state(found.system)
    assert_allclose(start.u_dot[:3], [0, 0, -9.81], rtol=0, atol=1e-9)
    made = robot_of_system(found.system)
    assert made.robot.root == "base"
    assert "gravity" in made.notes


def random_link():
    from tests.floatframe.files.importers.random_robots import link_text

    return link_text(np.random.default_rng(3), "base")


BAD = {
    "cut": (GRIPPER[:900], "line 15: not well-formed XML"),
    "another root": ("<sdf/>", "expected <robot> as first element, got <sdf>"),
    "doctype": ('<!DOCTYPE robot [<!ENTITY a "b">]>\n<robot name="r"/>', "line 1: expected no document type"),
    "macro": (GRIPPER.replace('value="2"', 'value="${m}"'), "line 6: a macro of xacro"),
    "no links": ('<robot name="r"/>', "at least one link"),
    "type": (GRIPPER.replace('"prismatic"', '"slider"'), "line 21: <joint>: type: expected one of revolute"),
    "no parent": (GRIPPER.replace('<parent link="world"/>', ""), "line 21: <joint>: expected <parent> in it"),
    "unknown link": (GRIPPER.replace('child link="thumb"', 'child link="thump"'), "did you mean 'thumb'"),
    "two of a name": (GRIPPER.replace('link name="tip"', 'link name="thumb"'), "two links 'thumb'"),
    "two parents": (GRIPPER.replace('child link="tip"', 'child link="thumb"'), "of two joints, 'other' and 'end'"),
    "two roots": (GRIPPER.replace('<link name="tip"/>', '<link name="tip"/><link name="x"/>'), "got 'world', 'x'"),
    "ring": (GRIPPER.replace('parent link="world"', 'parent link="tip"').replace('<link name="world"/>', ""), "ring"),
    "numbers": (GRIPPER.replace('xyz="0 0 1"', 'xyz="0 0"'), "line 22: <origin>: xyz: expected 3 finite numbers"),
    "no number": (GRIPPER.replace('value="2"', 'value="heavy"'), "line 6: <mass>: value: expected a finite number"),
    "nan": (GRIPPER.replace('value="2"', 'value="nan"'), "expected a finite number, got 'nan'"),
    "negative mass": (GRIPPER.replace('value="2"', 'value="-2"'), "expected a mass of 0 or more, got -2"),
    "axis": (GRIPPER.replace('xyz="0 0 2"', 'xyz="0 0 0"'), "line 22: <axis>: xyz: expected a direction"),
    "no limits": (GRIPPER.replace('<limit lower="-0.2" upper="0.9" effort="2" velocity="3"/>', ""), "continuous"),
    "limits": (GRIPPER.replace('upper="0.9"', 'upper="-0.9"'), "expected lower <= upper, got -0.2 and -0.9"),
    "damping": (GRIPPER.replace('damping="4"', 'damping="-4"'), "damping: expected 0 or more"),
    "leader": (GRIPPER.replace('mimic joint="knuckle"', 'mimic joint="knuckel"'), "did you mean 'knuckle'"),
    "itself": (GRIPPER.replace('mimic joint="knuckle"', 'mimic joint="other"'), "follow each other in a ring"),
    "material": (GRIPPER.replace('<material name="blue"/>', '<material name="bleu"/>'), "no material 'bleu'"),
    "color": (GRIPPER.replace("0.2 0.4", "0.2 4"), "rgba: expected numbers from 0 to 1"),
    "geometry": (GRIPPER.replace('<sphere radius="0.2"/>', "<cone/>"), "expected one of <box>.*, got <cone>"),
    "size": (GRIPPER.replace('radius="0.05"', 'radius="0"'), "line 8: <cylinder>: cylinder: radius"),
    "scale": (GRIPPER.replace("0.001 0.001 -0.001", "1 0 1"), "scale: expected numbers other than zero"),
}


@pytest.mark.parametrize("case", BAD)
def test_what_is_wrong_is_told_with_its_line(case, tmp_path):
    path = tmp_path / "bad.urdf"
    text, words = BAD[case]
    path.write_text(text)
    with pytest.raises(UrdfError, match=words) as error:
        read_urdf(path)
    assert str(error.value).startswith(str(path))


def test_files_that_are_none_are_told(tmp_path):
    (tmp_path / "robot.urdf").write_text("<robot/>")
    with pytest.raises(UrdfError, match=r"no such file; did you mean 'robot.urdf'"):
        read_urdf(tmp_path / "robots.urdf")
    with pytest.raises(UrdfError, match="cannot be read: Is a directory"):
        read_urdf(tmp_path)
    (tmp_path / "robot.urdf").write_bytes(b"\x00\x01binary")
    with pytest.raises(UrdfError, match="not well-formed XML"):
        read_urdf(tmp_path / "robot.urdf")
    (tmp_path / "robot.urdf").write_bytes(b"<robot>" + b"<a>" * 100)
    with pytest.raises(UrdfError, match="nested deeper than 50"):
        read_urdf(tmp_path / "robot.urdf")


CHANGES = {
    "no mass": (('<mass value="0.2"/>', '<mass value="0"/>'), {}, "'thumb': has no mass, but moments of inertia"),
    "triangle": (('ixx="0.02"', 'ixx="0.5"'), {}, "link 'rail': inertia: no mass distribution has the principal"),
    "limits": (("", ""), {"configuration": {"slide": 0.7}}, "is at 0.7, beyond its limits -0.1 to 0.5"),
    "fixed value": (("", ""), {"configuration": {"end": 0.7}}, "joint 'end' is fixed; it has no single value"),
    "follower": (("", ""), {"configuration": {"other": 0.7}}, "joint 'other' follows 'knuckle'; give that one"),
    "unknown": (("", ""), {"configuration": {"slid": 0.7}}, "there is no joint 'slid'; did you mean 'slide'"),
    "no way": (('lower="-0.1" upper="0.5"', ""), {}, "its limits 0 to 0 allow no motion"),
    "mesh": (("tip.stl", "top.stl"), {}, "mesh 'package://hand/meshes/top.stl': not found; looked for"),
    "scheme": (("package://hand", "https://hand"), {}, "expected package://NAME"),
    "pictures": (("", ""), {"pictures": "both"}, "expected visual, collision or none"),
}


@pytest.mark.parametrize("case", CHANGES)
def test_a_robot_that_cannot_move_so_is_refused(case, gripper):
    (old, new), options, words = CHANGES[case]
    gripper.write_text(GRIPPER.replace(old, new) if old else GRIPPER)
    with pytest.raises(UrdfError, match=words):
        robot_system(read_urdf(gripper), **options)


def test_a_link_without_mass_moves_only_with_one_that_has_some(gripper):
    gripper.write_text(GRIPPER.replace('name="end" type="fixed"', 'name="end" type="continuous"'))
    with pytest.raises(UrdfError, match=r"line 20: link 'tip': moves, but has no mass; give it <inertial>"):
        robot_system(read_urdf(gripper))


def test_what_urdf_does_not_have_is_refused_or_listed(gripper):
    found = robot_system(read_urdf(gripper)).system
    from dataclasses import replace

    ball = SphericalJoint("ball", "ground", Marker("rail"))
    with pytest.raises(UrdfError, match=r"joint 'ball': URDF has no SphericalJoint"):
        robot_of_system(replace(found, joints=[ball], couplers=[], forces=[]))
    with pytest.raises(UrdfError, match=r"joint 'again' closes a loop"):
        robot_of_system(replace(found, joints=[*found.joints, replace(found.joints[0], name="again")]))
    with pytest.raises(UrdfError, match=r"there is no joint 'x'; choices"):
        robot_of_system(found, values={"x": 1.0})
    made = robot_of_system(replace(found, couplers=[]))
    with pytest.raises(UrdfError, match=r"URDF requires limits of a prismatic joint; lower, upper, effort, velocity"):
        urdf_text(made.robot)
    pair = CoordinateCoupler("pair", [(found.couplers[0].terms[0][0], 1.0)], 0.0)
    assert "coupler 'pair'" in robot_of_system(replace(found, couplers=[pair])).notes
    wheel = RigidBody("w", 1.0, np.eye(3), shapes=[Mesh(np.eye(3), [[0, 1, 2]])])
    assert list(robot_of_system(System([wheel])).meshes) == ["meshes/w_0.stl"]
    assert Frame().inverse.R.tolist() == np.eye(3).tolist()


def test_drives_count_in_values_of_the_robot(gripper):
    """The joint of which the system has an angle, and the one of which it has the value itself."""
    from floatframe.analyses.driven.kinematics import kinematics
    from floatframe.model.functions.path_motions import path_motion

    robot = read_urdf(gripper)
    path = path_motion({"slide": [0.1, 0.4, 0.2], "knuckle": [0.3, -0.1, 0.1]}, speed=1.0, acceleration=5.0)
    found = robot_system(robot, motions=path.motions)
    assert found.values == pytest.approx({"slide": 0.1, "knuckle": 0.3, "other": -0.3}, abs=1e-12)
    assert [coupler.name for coupler in found.system.couplers] == ["other mimic"]
    motion = kinematics(found.system, path.t)
    for k, (slide, knuckle) in enumerate(((0.1, 0.3), (0.4, -0.1), (0.2, 0.1))):
        at = robot_system(robot, configuration={"slide": slide, "knuckle": knuckle}).system
        for name in ("rail", "finger", "thumb"):
            assert_allclose(motion.body(name).r[k], at.body(name).position, rtol=0, atol=1e-11)
    with pytest.raises(UrdfError, match="joint 'other' follows 'knuckle'; give that one"):
        robot_system(robot, motions={"other": path.motions["slide"]})
