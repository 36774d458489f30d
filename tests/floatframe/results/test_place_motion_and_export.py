"""Sensors against differences of what they measure; exported numbers read back as they were."""

import csv
from dataclasses import replace

import meshio
import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

from floatframe import (
    GROUND,
    FlexibleBody,
    GeneralizedAlpha,
    Gravity,
    Marker,
    RevoluteJoint,
    RigidBody,
    SphericalJoint,
    System,
    integrate,
)
from floatframe.errors import ResultsError
from floatframe.model.rotations import rotation_matrix
from floatframe.results.export import export_vtk, motion_table
from floatframe.results.place_motion import (
    interface_motion,
    largest_von_mises,
    nodal_stress,
    node_motion,
    point_motion,
    rotation_angle,
)
from floatframe.results.recovery import nodal_positions
from tests.floatframe.point_masses import random_point_masses, reduced_body, stiffness

H = 5e-4
RNG = np.random.default_rng(4)
REDUCED = replace(
    reduced_body(random_point_masses(3, 5), stiffness(3), name="rod"),
    stress=RNG.normal(size=(40, 6, 3)),
    surface=RNG.permutation(40)[:39].reshape(13, 3),
)


@pytest.fixture(scope="module")
def swing():
    body = FlexibleBody("rod", REDUCED, omega_B=(0.3, 1, 3))
    joint = SphericalJoint("pin", GROUND, Marker("rod", "end_b"))
    return integrate(System([body], [joint], [Gravity((0, 0, -9.81))]), GeneralizedAlpha(0.8), 0.3, H)


def differences(values):
    return (values[2:] - values[:-2]) / (2 * H)


def test_a_point_of_a_flexible_body_does_not_leave_its_deformation_out_in_silence(swing):
    with pytest.raises(ResultsError, match=r"'rod' is flexible: .* give its modal file, reduced="):
        point_motion(swing, "rod", (0.3, -0.4, 0.5))
    with pytest.raises(ResultsError, match=r"point_motion: body 'rod': no kept node is at .* nearest:"):
        point_motion(swing, "rod", REDUCED.nodes[5] + 0.2, reduced=REDUCED)
    with pytest.raises(ResultsError, match="either its reduced body or undeformed=True, got both"):
        point_motion(swing, "rod", REDUCED.nodes[5], reduced=REDUCED, undeformed=True)


def test_a_point_at_a_kept_node_deforms_as_the_node(swing):
    at_node = node_motion(swing, "rod", REDUCED, 5)
    at_point = point_motion(swing, "rod", REDUCED.nodes[5], reduced=REDUCED)
    for name in ("position", "velocity", "acceleration", "axes", "omega"):
        assert_allclose(getattr(at_point, name), getattr(at_node, name), rtol=0, atol=0)
    rigid = point_motion(swing, "rod", REDUCED.nodes[5], undeformed=True)
    assert np.abs(at_point.position - rigid.position).max() > 1e-3


@pytest.mark.parametrize("place", ["end_a", "end_b", "point"])
def test_velocity_and_acceleration_are_the_rates_of_position_and_velocity(swing, place):
    if place == "point":
        motion = point_motion(swing, "rod", (0.3, -0.4, 0.5), undeformed=True)
    else:
        motion = interface_motion(swing, "rod", REDUCED, place)
    scale = np.abs(motion.velocity).max() + 1
    assert_allclose(differences(motion.position), motion.velocity[1:-1], rtol=0, atol=2e-5 * scale)
    fastest = np.abs(motion.acceleration).max() + 1
    assert_allclose(differences(motion.velocity), motion.acceleration[1:-1], rtol=0, atol=5e-4 * fastest)


def test_angular_velocity_is_that_of_the_axes(swing):
    motion = interface_motion(swing, "rod", REDUCED, "end_a")
    spin = np.einsum("tab,tcb->tac", differences(motion.axes), motion.axes[1:-1])  # A_dot A^T = tilde(omega)
    found = np.stack([spin[:, 2, 1], spin[:, 0, 2], spin[:, 1, 0]], axis=1)
    assert_allclose(found, motion.omega[1:-1], rtol=0, atol=1e-4 * np.abs(motion.omega).max())


def test_angle_of_a_hinge_is_followed_through_full_turns():
    wheel = RigidBody("wheel", 1.0, np.eye(3), omega_B=(0, 0, 9.0))
    joint = RevoluteJoint("axle", GROUND, Marker("wheel"), axis=(0, 0, 1))
    motion = integrate(System([wheel], [joint]), GeneralizedAlpha(0.8), 2.0, 1e-2)
    place = point_motion(motion, "wheel", (0, 0, 0))
    still = replace(place, axes=np.broadcast_to(np.eye(3), place.axes.shape))
    assert_allclose(rotation_angle(still, place, (0, 0, 2.0)), 9.0 * motion.t, rtol=0, atol=1e-9)
    assert_allclose(rotation_angle(place, still, (0, 0, 1)), -9.0 * motion.t, rtol=0, atol=1e-9)


def test_stress_is_the_sum_over_the_modes_and_its_largest_is_found(swing):
    q = swing.body("rod").q
    k = len(q) - 1
    stress = nodal_stress(swing, "rod", REDUCED, k)
    assert_allclose(stress, np.einsum("ncq,q->nc", REDUCED.stress, q[k]), rtol=1e-12)
    assert_array_equal(swing.body("rod").stress(-1), stress)
    xx, yy, zz, yz, xz, xy = stress.T
    deviator = np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]]) - np.eye(3)[:, :, None] * (xx + yy + zz) / 3
    mises = np.sqrt(1.5 * (deviator**2).sum(axis=(0, 1)))
    largest, where = largest_von_mises(swing, "rod", REDUCED)
    assert_allclose(largest[k], mises.max(), rtol=1e-12)
    assert where[k] == np.argmax(mises)


def test_body_without_stress_modes_is_refused(swing):
    with pytest.raises(ResultsError, match="contains no stress modes"):
        nodal_stress(swing, "rod", replace(REDUCED, stress=None), 0)


def test_table_reads_back_as_it_was(swing, tmp_path):
    table = motion_table(swing, {"rod": REDUCED})
    with open(table.write(tmp_path / "swing.csv"), newline="") as file:
        names, *rows = csv.reader(file)
    assert names == list(table.heads)
    assert_array_equal(np.array(rows, dtype=float), np.column_stack(list(table.columns.values())))
    assert "rod end_a position x [m]" in names
    assert "pin force z [N]" in names


def test_surfaces_for_paraview_lie_where_the_nodes_are(swing, tmp_path):
    written = export_vtk(swing, {"rod": REDUCED}, tmp_path / "swing.pvd", every=100)
    assert len(written) == 1 + len(range(0, len(swing.t), 100))
    text = written[0].read_text()
    for path, i in zip(written[1:], range(0, len(swing.t), 100), strict=True):
        assert f'timestep="{float(swing.t[i])!r}" file="swing/{path.name}"' in text
        grid = meshio.read(path)
        assert_allclose(grid.points, nodal_positions(swing, "rod", REDUCED, i), rtol=0, atol=1e-14)
        assert_array_equal(grid.cells[0].data, REDUCED.surface)
        R = rotation_matrix(swing.body("rod").p[i])
        elastic = (REDUCED.Phi @ swing.body("rod").q[i]) @ R.T
        assert_allclose(grid.point_data["elastic displacement"], elastic, rtol=0, atol=1e-14)
        assert_allclose(grid.point_data["von Mises stress"].max(), largest_von_mises(swing, "rod", REDUCED)[0][i])


def test_motion_without_surfaces_is_refused(swing, tmp_path):
    with pytest.raises(ResultsError, match="no body with a surface"):
        export_vtk(swing, {}, tmp_path / "swing.pvd")
