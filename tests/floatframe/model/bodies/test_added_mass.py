"""Small parts added to reduced bodies: the sums over particles, and rigid bodies fixed to the interface."""

from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose

from floatframe import (
    GROUND,
    FixedJoint,
    FlexibleBody,
    GeneralizedAlpha,
    Gravity,
    Marker,
    RigidBody,
    SphericalJoint,
    System,
    integrate,
)
from floatframe.errors import ModelError
from floatframe.model import AddedMass, with_masses
from tests.floatframe.engine.kernels.examples import turned_triad
from tests.floatframe.point_masses import (
    random_point_masses,
    random_second_order,
    reduced_body,
    stiffened_body,
    stiffness,
)

N_Q = 4
ROUNDOFF = 1e-12
INERTIA = turned_triad(7) @ np.diag([2e-3, 3e-3, 4e-3]) @ turned_triad(7).T


def test_a_mass_in_an_interface_node_is_a_heavier_particle():
    """All moments, the mass matrix and the geometric stiffness of the inertia loads, against sums over particles."""
    points = random_point_masses(N_Q, 3)
    body = reduced_body(points, stiffness(N_Q))
    place = int(body.interfaces[0].members[0])
    places = tuple(int(interface.members[0]) for interface in body.interfaces)
    heavier = replace(points, m=points.m + 0.4 * (np.arange(len(points.m)) == place))
    second = random_second_order(points, 3)
    body = replace(body, geometric=second.geometric(places))
    found = with_masses(body, [AddedMass("end_a", 0.4)])
    expected = replace(
        reduced_body(heavier, stiffness(N_Q)), geometric=replace(second, points=heavier).geometric(places)
    )
    for name in ("m", "S", "R", "C1", "P", "S_kl"):
        value = getattr(expected.moments, name)
        assert_allclose(getattr(found.moments, name), value, rtol=0, atol=ROUNDOFF * np.abs(value).max())
    assert_allclose(found.M, expected.M, rtol=0, atol=ROUNDOFF * np.abs(expected.M).max())
    for name in ("translation", "rotation", "spin"):
        value = getattr(expected.geometric, name)
        assert_allclose(getattr(found.geometric, name), value, rtol=0, atol=ROUNDOFF * np.abs(value).max())


def test_a_mass_is_refused_where_the_loads_were_left_out_of_the_geometric_stiffness():
    points = random_point_masses(N_Q, 3)
    body = reduced_body(points, stiffness(N_Q))
    whole = random_second_order(points, 3).geometric(tuple(int(each.members[0]) for each in body.interfaces))
    loaded = (False,) + (True,) * (len(body.interfaces) - 1)
    body = replace(body, geometric=replace(whole, interfaces=whole.interfaces[1:], turned=None, is_loaded=loaded))
    first, last = body.interfaces[0].name, body.interfaces[-1].name
    with pytest.raises(ModelError, match="whose loads are not in the geometric stiffness"):
        with_masses(body, [AddedMass(first, 0.4)])
    found = with_masses(body, [AddedMass(last, 0.4)]).geometric
    expected = with_masses(replace(body, geometric=replace(whole, turned=None)), [AddedMass(last, 0.4)]).geometric
    assert_allclose(found.spin, expected.spin, rtol=0, atol=0)


def test_particles_have_mass_centre_and_inertia_of_the_part():
    part = AddedMass("a", 0.5, (0.1, -0.2, 0.3), INERTIA)
    m, places = part.particles()
    d = places - part.offset
    assert_allclose(m * len(places), 0.5, rtol=1e-15, atol=0)
    assert_allclose(places.mean(axis=0), part.offset, rtol=0, atol=1e-15)
    tensor = m * sum(x @ x * np.eye(3) - np.outer(x, x) for x in d)
    assert_allclose(tensor, INERTIA, rtol=0, atol=1e-17)


def swing(mass, body, *, fixed):
    """A soft body on a ball joint with a part at its other end: in the body, or as a rigid body fixed to it."""
    joints = [SphericalJoint("ball", GROUND, Marker("body", "end_b"))]
    omega, pivot = np.array([0.4, 1.0, -0.6]), body.interface("end_b").position
    start = {"omega_B": omega, "velocity": -np.cross(omega, pivot)}
    if not fixed:
        bodies = [FlexibleBody("body", with_masses(body, [mass]), **start)]
    else:
        node = body.interface(mass.interface).position
        moves = {"omega_B": omega, "velocity": np.cross(omega, node - pivot)}
        part = RigidBody("part", mass.mass, mass.inertia, center_of_mass=mass.offset, position=node, **moves)
        bodies = [FlexibleBody("body", body, **start), part]
        joints.append(FixedJoint("weld", Marker("body", mass.interface), Marker("part")))
    return System(bodies, joints, [Gravity((0, 0, -9.81))])


@pytest.mark.parametrize("make", [reduced_body, stiffened_body], ids=["linear", "stiffened"])
def test_motion_is_that_with_a_rigid_body_fixed_to_the_interface(make):
    """With offset and inertia the two differ by the square of the elastic rotation: a stiffer body, less by as much."""
    mass = AddedMass("end_a", 0.5, (0.05, -0.1, 0.08), INERTIA)
    differences, sizes = [], []
    for omega in (30.0, 60.0):
        body = make(random_point_masses(3, 3), stiffness(3, omega=omega))
        ends = []
        for fixed in (False, True):
            system = swing(mass, body, fixed=fixed)
            ends.append(integrate(system, GeneralizedAlpha(0.8, 1e-10), 0.3, 5e-4).body("body").q)
        differences.append(np.abs(ends[0] - ends[1]).max())
        sizes.append(np.abs(ends[0]).max())
    assert differences[0] < 1e-2 * sizes[0]
    assert differences[1] < 0.3 * differences[0]


def test_energy_is_kept_with_added_masses():
    body = reduced_body(random_point_masses(3, 3), stiffness(3, omega=30.0))
    system = swing(AddedMass("end_a", 0.5, (0.05, -0.1, 0.08), INERTIA), body, fixed=False)
    motion = integrate(system, GeneralizedAlpha(1.0, 1e-11), 0.5, 5e-4)
    energy = motion.energies.total
    assert np.abs(energy - energy[0]).max() < 1e-4 * motion.energies.kinetic.max()


@pytest.mark.parametrize(
    ("part", "words"),
    [
        (lambda: AddedMass("end_a", 0.0), "mass: expected a number above 0"),
        (lambda: AddedMass("end_a", 1.0, inertia=np.diag([1.0, 1.0, 3.0])), "no mass distribution has the principal"),
        (lambda: AddedMass("end_a", 1.0, inertia=np.triu(np.ones((3, 3)))), "expected a symmetric tensor"),
        (lambda: AddedMass("end_x", 1.0), "no interface 'end_x'"),
    ],
)
def test_impossible_parts_are_refused(part, words):
    body = reduced_body(random_point_masses(3, 3), stiffness(3))
    with pytest.raises(ModelError, match=words):
        with_masses(body, [part()])
