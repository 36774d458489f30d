"""The road car: linkage against circles and spheres, posts against volumes and gas, a turn against four wheels."""

import re
from dataclasses import fields, replace

import numpy as np
import pytest
from numpy.testing import assert_allclose

import cms
import floatframe as ff
from fe_models.foundation.parametric_file import read_parametric
from floatframe.components.wheels import read_tyre_file, shipped_tyre
from floatframe.machines import copy_machine, parameters_of
from floatframe.machines.road_car import CarOnPosts, Linkage, RoadCar, body_mesh
from floatframe.machines.road_car.closed_forms import MODES, roll_control_stiffness, transfer_shares
from floatframe.machines.road_car.description import CORNERS
from floatframe.machines.road_car.figures import car_mass, driven, steady_turn
from floatframe.machines.road_car.linkage import spring_preload
from floatframe.model.elements.expressions import ExpressionElement
from floatframe.model.rotations import rotation_matrix
from tests.floatframe.components.wheels.magic_formula_oracle import version_61

CAR = RoadCar()
STIFF = replace(CAR, mount_stiffness=None)  # subframes fixed to the body
TYRE = read_tyre_file(shipped_tyre("passenger_car_61"))


def tyre(load, alpha, gamma, is_left):
    """F_y, M_x, M_y, M_z of the tyre by the second writing of its formula; that of the right side is the mirror."""
    side = 1.0 if is_left else -1.0
    found, _ = version_61(
        TYRE.coefficients, 220e3, 220e3, load, 0.0, side * alpha, side * gamma, 18.0, 16.7, 0.32, 4000.0
    )
    return side * found[1], side * found[2], -found[3], side * found[4]


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """The machine, its body reduced; files of the rig with fixed subframes: hydraulics, bars, or springs alone."""
    place = tmp_path_factory.mktemp("car")
    copy_machine("road-car", place)
    cms.write(cms.reduce_job(place / "body.toml"), place / "body.h5")
    (place / "stiff_hydraulic.toml").write_text('extends = ["rig.toml", "fixed_subframes.toml"]')
    (place / "stiff_bars.toml").write_text('extends = ["rig_bars.toml", "fixed_subframes.toml"]')
    (place / "stiff_none.toml").write_text('extends = "stiff_bars.toml"\nparameters.bars = {front = 0.0, rear = 0.0}')
    return place


def on_posts(folder, support, heights):
    """Return the car with rigid subframes on posts of given heights over time."""
    changes = {f"couplers.post_{corner}.constant": height for corner, height in zip(CORNERS, heights, strict=True)}
    return ff.read_system(folder / f"stiff_{support}.toml", changes)[0]


def test_the_files_have_the_numbers_of_the_closed_forms(folder):
    given = parameters_of(folder / "lane_change.toml")
    for name in ("front", "rear"):
        axle, points = CAR.axle(name), getattr(given, name)
        ends = dict(zip(("mount_front", "mount_rear"), axle.mounts, strict=True))
        assert points == {each: list(ends[each] if each in ends else getattr(axle, each)) for each in points}
        spring = given.springs[name]
        assert (spring["stiffness"], spring["damping"], spring["preload"]) == (axle.spring, axle.damper, axle.preload)
        assert parameters_of(folder / "lane_change_bars.toml").bars[name] == axle.bar
    names = [field.name for field in fields(CAR) if hasattr(given, field.name) and field.name not in ("front", "rear")]
    assert {"speed", "wheel", "upright", "lower_arm", "subframe", "mount_stiffness"} < set(names)
    assert [getattr(given, name) for name in names] == [getattr(CAR, name) for name in names]
    assert given.oil == {name: getattr(CAR.control, name) for name in given.oil}


def test_with_bars_the_springs_carry_what_the_oil_did(folder):
    given = parameters_of(folder / "lane_change_bars.toml")
    for name in ("front", "rear"):
        assert_allclose(given.springs[name]["preload"], spring_preload(CAR, name, "bars"), rtol=1e-6)


def test_the_shipped_mesh_is_that_of_the_description(folder):
    assert (folder / "body.inp").read_text() == body_mesh(CAR)


def test_wheels_move_as_circles_and_spheres_say(folder):
    """Steer, inclination and place of the four wheels over 80 mm up and down, against the linkage by itself."""
    travel = {"type": "smooth-step", "t_start": 0.0, "t_end": 1.0, "first": -0.08, "last": 0.08}
    system = on_posts(folder, "none", [travel] * 4)
    motion = ff.kinematics(system, np.linspace(0.0, 1.0, 5))
    for corner, (name, side) in CORNERS.items():
        own, linkage = motion.body(f"upright_{corner}"), Linkage(CAR.axle(name), side)
        for r, p in zip(own.r, own.p, strict=True):
            w, x, y, z = p
            axle = np.array([2 * (x * y - w * z), w * w - x * x + y * y - z * z, 2 * (y * z + w * x)])
            R_centre = rotation_matrix(p) @ CAR.axle(name).point("centre", side)
            place = linkage.lifted(r[2] + R_centre[2] - 0.302)
            assert_allclose(r + R_centre, place.centre, rtol=0, atol=1e-9)
            assert_allclose(axle, place.axle, rtol=0, atol=1e-8)


def posts(folder, support, heights):
    """Return the forces of the posts at rest, (4,) [N]."""
    system = on_posts(folder, support, [{"type": "constant", "value": float(z)} for z in heights])
    rest = ff.analyses.snapshot(system, ff.static_equilibrium(system))
    return np.array([ff.results.coupler_motion(system, rest, f"post_{corner}").force[0, 0] for corner in CORNERS])


@pytest.mark.parametrize("support", ["hydraulic", "bars"])
def test_posts_carry_what_springs_bars_gas_and_oil_press(folder, support):
    heights = np.array([0.031, -0.024, -0.012, 0.027])
    expected = CarOnPosts(STIFF, support).forces(heights)
    assert_allclose(posts(folder, support, heights), expected, rtol=2e-6)


def test_crossed_lines_stiffen_roll_by_the_gas_and_leave_warp_alone(folder):
    """Against the closed form of two gas volumes, in motions so small that it is linear."""
    small, track = 2e-3, 2 * CAR.front.centre[1]
    stiffness = {}
    for mode in ("roll", "warp"):  # both are odd in the height by the symmetry of the car
        forces = posts(folder, "hydraulic", small * MODES[mode])
        stiffness[mode] = float(forces @ MODES[mode] / small) * track**2 / 4
        stiffness[mode] -= 4 * CarOnPosts(STIFF, "none").stiffness(mode) * track**2 / 4
    assert_allclose(stiffness["roll"], roll_control_stiffness(CAR), rtol=2e-3)
    assert abs(stiffness["warp"]) < 0.01 * stiffness["roll"]


def test_a_steady_turn_is_that_of_four_wheels_and_the_linkage(folder):
    """Yaw rate, roll and wheel loads at 3 m/s² of the rigid car against equations of their own."""
    rack = 0.0035
    ramp = {f"joints.rack.motions.distance.{key}": value for key, value in (("t_start", 0.05), ("t_end", 0.6))}
    system, run = ff.read_system(folder / "circle.toml", {"rack": rack, **ramp})
    turn = driven(system, ff.integrate(system, run.integrator, 1.8, 8e-3))
    expected = steady_turn(CAR, car_mass(CAR, system), tyre, float(turn.speed[-1]), rack, "hydraulic")
    assert_allclose(turn.yaw_rate[-1], expected.yaw_rate, rtol=0.01)
    assert_allclose(turn.roll[-1], expected.roll, rtol=0.01)
    assert_allclose(turn.loads[-1], expected.loads, rtol=0.005)
    mass = car_mass(CAR, system)
    front, rear = transfer_shares(
        CAR, "hydraulic", mass=mass.mass, x=mass.x, height=mass.height, tyre_stiffness=mass.tyre_stiffness
    )
    moved = turn.loads[-1, [1, 3]] - turn.loads[-1, [0, 2]]
    assert_allclose(front / (front + rear), moved[0] / moved.sum(), rtol=0.015)


def test_the_flexible_car_follows_its_driver(folder):
    """The first 0.2 s of the lane change: the body bends, the car turns as the rigid one within a tenth."""
    found = {}
    for is_rigid in (True, False):
        system, run = ff.read_system(folder / "lane_change.toml", {"is_rigid": is_rigid})
        motion = ff.integrate(system, run.integrator, 0.2, 5e-3)
        found[is_rigid] = driven(system, motion).yaw_rate[-1]
        if not is_rigid:
            assert 1e-5 < np.abs(motion.body("chassis").q[-1]).max() < 1e-1
    assert_allclose(found[False], found[True], rtol=0.1)
    assert found[True] > 0.01


def test_the_driver_knows_where_the_car_is_on_the_ground(folder):
    """Far down the road and turned about all axes: place and longitudinal axis are those of the body."""
    r, p = np.array([120.0, -3.0, 0.4]), np.array([0.9, 0.15, -0.2, 0.35]) / np.linalg.norm([0.9, 0.15, -0.2, 0.35])
    car = ff.RigidBody("car", mass=1.0, inertia=np.eye(3), position=r, orientation=p)
    terms = read_parametric(folder / "lane_change.toml", ff.errors.ModelError)["elements"]["driver"]["terms"]
    driver = ExpressionElement(
        "driver", {"car": ff.Marker("car"), "road": ff.Marker("ground")}, terms=terms,
        outputs={name: name for name in ("car_x", "car_y", "axis_x", "axis_y")},
    )  # fmt: skip
    system = ff.System(bodies=[car], elements=[driver])
    seen = ff.results.element_motion(
        system, ff.analyses.snapshot(system, ff.analyses.consistent_state(system).state), "driver"
    ).outputs
    assert_allclose([seen[key][0] for key in driver.outputs], [*r[:2], *rotation_matrix(p)[:2, 0]], rtol=0, atol=1e-9)


def test_the_study_of_the_suspension_runs(folder, tmp_path):
    """Two evaluations, over the first 0.16 s and by one of its parameters: the stiffer bar rolls less."""
    copy_machine("road-car", tmp_path)
    (tmp_path / "body.h5").write_bytes((folder / "body.h5").read_bytes())
    with (tmp_path / "lane_change_bars.toml").open("a") as file:
        file.write("run.t_end = 0.16\n")
    text = (tmp_path / "suspension_study.toml").read_text()
    assert text.count("iterations = ") == 1
    begin, end = text.index("[parameters.bar_rear]"), text.index("[objectives.side_slip]")
    text = "workers = 1\n" + text[:begin] + text[end:]
    (tmp_path / "study.toml").write_text(re.sub("iterations = .*", "iterations = 1", text))
    best = ff.design.optimize(ff.design.read_design(tmp_path / "study.toml"))
    start, changed = (row.evaluation for row in best.history[:2])
    assert (start.values, changed.values) == ((800.0,), (836.0,))
    roll, stiffer = start.numbers[2][0], changed.numbers[2][0]
    assert 0.998 * roll < stiffer < 0.9995 * roll  # a stiffer bar rolls less, a little: 36 of 800 N m/rad in 0.16 s
