"""The deployable antenna against pins and virtual work; its latching against momentum; its files as shipped."""

from dataclasses import fields, replace

import numpy as np
import pytest
from numpy.testing import assert_allclose

import cms
import floatframe as ff
from floatframe.machines import copy_machine, machine_files, parameters_of
from floatframe.machines.antenna import AntennaGeometry, mechanism, petal_mesh, pointing

G = 9.81
GEOMETRY = AntennaGeometry()
SLOW = {"n_petals": 3, "duration": 1e5}


@pytest.fixture(scope="module")
def parts(tmp_path_factory):
    """Return a folder with the files, and the masses in the reduced petal and strut."""
    folder = tmp_path_factory.mktemp("antenna")
    copy_machine("antenna", folder)
    petal, strut = (cms.reduce_job(folder / f"{name}.toml") for name in ("petal", "strut"))
    for place in (folder, folder / "fine"):
        cms.write(petal, place / "petal.h5")
        cms.write(strut, place / "strut.h5")
    return folder, petal.moments, strut.moments


def test_closed_form_follows_from_its_geometry():
    theta, geometry = np.linspace(0.05, 1.3, 7), GEOMETRY
    found, step = mechanism(geometry, theta, n_petals=3), 1e-6
    foot = np.array([np.full(7, geometry.slider_radius), found.slider])
    elbow = np.array([geometry.hinge_radius + geometry.elbow * np.sin(theta), geometry.elbow * np.cos(theta)])
    assert_allclose(np.linalg.norm(foot - elbow, axis=0), geometry.strut, rtol=1e-14)
    ahead, behind = (mechanism(geometry, theta + d, n_petals=3).slider for d in (step, -step))
    assert_allclose(found.rate, (ahead - behind) / (2 * step), rtol=1e-7)


def test_the_files_and_the_closed_form_have_the_same_lengths():
    shipped = parameters_of(next(path for path in machine_files("antenna") if path.name == "space.toml"))
    assert {each.name: getattr(shipped, each.name) for each in fields(GEOMETRY)} == vars(GEOMETRY)


def test_the_wires_of_the_rig_balance_the_weight_of_a_petal(parts):
    folder, petal, _ = parts
    wire = G * petal.gram[0, 0] * petal.center_of_mass[0] / GEOMETRY.elbow
    assert_allclose(parameters_of(folder / "rig.toml").wire, wire, rtol=1e-12)


@pytest.mark.parametrize("name", ["space", "rig", "bare"])
def test_drive_and_strut_forces_are_those_of_virtual_work(parts, name):
    """Rigid parts moved so slowly that nothing has inertia: weights, harness, friction, wires; 1e-6."""
    folder, petal, strut = parts
    system, _ = ff.read_system(folder / f"{name}.toml", SLOW)
    antenna = parameters_of(folder / f"{name}.toml", SLOW)
    motion = ff.kinematics(system, np.linspace(0.1, 0.9, 5) * antenna.duration)
    coordinates = ("mast", "distance"), ("hinge_1", "angle")
    drive, hinge = (ff.joints.JointCoordinate(*of).measure(system, motion) for of in coordinates)
    theta, x = antenna.stowed + hinge.value, petal.center_of_mass
    mass, half = petal.gram[0, 0], strut.gram[0, 0] / 2
    g, wire = (0.0 if name == "space" else G), (G * mass * x[0] / GEOMETRY.elbow if name == "rig" else 0.0)
    moment = mass * g * (x[0] * np.sin(theta) - x[2] * np.cos(theta))
    moment += (half * g - wire) * GEOMETRY.elbow * np.sin(theta)
    moment -= antenna.harness_stiffness * hinge.value + antenna.harness_damping * hinge.rate
    moment -= antenna.harness_friction * np.tanh(hinge.rate / antenna.friction_speed)
    weight = -(antenna.slider_mass + 3 * half) * g
    found = mechanism(GEOMETRY, theta, n_petals=3, petal_moment=moment, slider_force=weight)
    assert_allclose(found.slider, drive.value, rtol=0, atol=1e-9)
    assert_allclose(drive.force, found.drive, rtol=0, atol=1e-6 * np.abs(found.drive).max())
    # along strut 3, which stands over the x axis: its ends carry half of its weight less and more than its middle
    axis = np.stack([np.sin(found.strut_angle), np.zeros(5), -np.cos(found.strut_angle)], axis=1)
    foot, elbow = (np.einsum("ti,ti->t", motion.reaction(of).force, axis) for of in ("foot_3", "elbow_3"))
    assert_allclose(0.5 * (elbow - foot), found.strut, rtol=0, atol=1e-6 * np.abs(found.strut).max())


def test_quasi_static_shapes_change_forces_by_little_and_the_wires_take_the_weight(parts):
    folder, force = parts[0], {}
    for name in ("space", "rig", "bare"):
        system, _ = ff.read_system(folder / f"{name}.toml", {"n_petals": 3, "duration": 1e4})
        motion = ff.kinematics(system, [0.5e4, 0.7e4], elasticity=ff.analyses.quasi_static_bodies)
        force[name] = ff.joints.JointCoordinate("mast", "distance").measure(system, motion).force
    gravity = {name: np.abs(force[name] - force["space"]) for name in ("rig", "bare")}
    assert (gravity["rig"] < 0.35 * gravity["bare"]).all()


def test_latching_keeps_momentum_and_moves_the_spacecraft_as_the_centre_of_mass_says(parts):
    folder, petal, strut = parts
    changes = {"n_petals": 3, "stowed": np.deg2rad(75) - 0.02}
    system, _ = ff.read_system(folder / "latching.toml", changes)
    antenna = parameters_of(folder / "latching.toml", changes)
    motion = ff.integrate(system, ff.GeneralizedAlpha(), 6.0, 4e-3, output_every=5)
    (event,) = motion.head.summary["events"]
    after = motion.t > event["t"]
    distance = ff.joints.JointCoordinate("mast", "distance").measure(system, motion).value
    assert_allclose(distance[after], antenna.height[2], atol=1e-8)
    assert abs(event["impulse"]["latch"]) > 1e-3
    scale = np.abs(event["impulse"]["latch"])
    assert_allclose(motion.linear_momentum, 0.0, atol=1e-6 * scale)
    assert_allclose(motion.angular_momentum, 0.0, atol=1e-5 * scale)
    heights, n = [], 3
    for theta in (antenna.stowed, antenna.deployed):
        slider, x = mechanism(GEOMETRY, theta, n_petals=n).slider[0], petal.center_of_mass
        z = n * petal.gram[0, 0] * (x[0] * np.cos(theta) + x[2] * np.sin(theta)) + antenna.slider_mass * slider
        heights.append(z + n * strut.gram[0, 0] / 2 * (slider + GEOMETRY.elbow * np.cos(theta)))
    total = antenna.bus_mass + antenna.slider_mass + n * (petal.gram[0, 0] + strut.gram[0, 0])
    moved = -(heights[1] - heights[0]) / total
    bus = motion.body("bus").r[:, 2]
    assert_allclose(bus[after].mean(), moved, rtol=0.05)  # petals go on swinging about it


@pytest.mark.long
def test_play_lets_petals_point_elsewhere_within_what_their_pins_leave(parts):
    """Pins 0.1 mm loose over 80 mm on a bus that turns under them: lateral angles up to 2 c/L, and what they bend."""
    folder, spread = parts[0] / "fine", {}
    changes = {"n_petals": 3, "start": np.deg2rad(75) - 0.005}
    for name, more in (("latching", {}), ("play", {"pin_friction": 0.0})):
        system, _ = ff.read_system(folder / f"{name}.toml", changes | more)
        start = pointing(system, ff.integrate(system, ff.GeneralizedAlpha(), 1e-3, 1e-3))
        assert_allclose(start.theta[0], changes["start"], rtol=0, atol=1e-12)
        assert_allclose(start.lateral[0], 0.0, rtol=0, atol=1e-12)
        bodies = [replace(system.bodies[0], omega_B=(0.0, 0.0, 0.002)), *system.bodies[1:]]
        turning = replace(system, bodies=bodies, events=())
        motion = ff.integrate(turning, ff.GeneralizedAlpha(), 0.6, 1e-3, output_every=10)
        spread[name] = np.abs(pointing(system, motion).lateral).max()
    play = parameters_of(folder / "play.toml")
    assert spread["play"] > 5 * spread["latching"]
    assert spread["play"] < 2 * play.radial_play / play.bearing_length + 2 * spread["latching"]


def test_the_shipped_meshes_are_those_of_their_function():
    meshes = {path.parent.name: path.read_text() for path in machine_files("antenna") if path.name == "petal.inp"}
    assert meshes == {"files": petal_mesh(), "fine": petal_mesh(width=0.15, n_along=40)}
