"""Bodies of system files: mass properties as CAD programs give them, choice of modes, small parts."""

import numpy as np
import pytest
from numpy.testing import assert_allclose

import cms
from floatframe import FlexibleBody, RigidBody
from floatframe.errors import FloatframeError
from floatframe.files.system_file.read_system import read_system
from floatframe.model import AddedMass, with_masses
from floatframe.model.bodies.mass_properties import combined, mass_properties, point_mass
from floatframe.model.bodies.mode_choice import frozen_to_rigid, with_modes, without_modes
from tests.changed_file import changed_file
from tests.floatframe.point_masses import random_point_masses, reduced_body, stiffness

FILE = """
[system]
units = "m-kg-s"

[bodies.crank]
mass = 2.0
center_of_mass = [0.1, 0, 0]
inertia = [[2.0, 0.1, 0], [0.1, 2.5, 0], [0, 0, 3.0]]
inertia_about = [0, 0, 0.2]
inertia_axes = [[0, 1, 0], [-1, 0, 0], [0, 0, 1]]
positive_products = true

[[bodies.crank.masses]]
mass = 0.3
position = [0.5, 0, 0]
inertia = [[0.1, 0, 0], [0, 0.1, 0], [0, 0, 0.1]]

[bodies.rod]
file = "rod.h5"
modes = [2, 0]

[[bodies.rod.masses]]
interface = "end_a"
mass = 0.2
offset = [0, 0, 0.1]

[bodies.twin]
file = "rod.h5"
modes = [2, 0]

[[bodies.twin.masses]]
interface = "end_a"
mass = 0.2
offset = [0, 0, 0.1]

[bodies.stiff]
file = "rod.h5"
is_rigid = true

[bodies.less]
file = "rod.h5"
without_modes = [1]

[run]
t_end = 0.05
h = 1e-3
"""


@pytest.fixture
def rod():
    return reduced_body(random_point_masses(3, 3), stiffness(3), name="rod")


@pytest.fixture
def write(tmp_path, rod):
    cms.write(rod, tmp_path / "rod.h5")

    def written(*changes):
        return changed_file(tmp_path / "bodies.toml", FILE, *changes)

    return written


def test_mass_properties_are_those_of_the_forms_of_cad_programs(write):
    found = read_system(write())[0].body("crank")
    axes = np.array([[0, 1, 0], [-1, 0, 0], [0, 0, 1]]).T
    J = np.array([[2.0, 0.1, 0], [0.1, 2.5, 0], [0, 0, 3.0]])
    own = mass_properties(2.0, (0.1, 0, 0), J, axes=axes, reference=(0, 0, 0.2), positive_products=True)
    whole = combined(own, point_mass(0.3, (0.5, 0, 0), 0.1 * np.eye(3)))
    assert isinstance(found, RigidBody)
    assert found.mass == 2.3
    assert_allclose(found.center_of_mass, whole.center_of_mass, rtol=1e-15, atol=0)
    assert_allclose(found.inertia, whole.inertia, rtol=1e-15, atol=1e-16)


def test_modes_and_parts_are_those_asked_for(write, rod):
    system, _ = read_system(write())
    heavy = with_masses(with_modes(rod, [2, 0]), [AddedMass("end_a", 0.2, (0, 0, 0.1))])
    expected = {"rod": heavy, "stiff": frozen_to_rigid(rod), "less": without_modes(rod, [1])}
    for name, body in expected.items():
        found = system.body(name)
        assert isinstance(found, FlexibleBody)
        for part in ("m", "S", "R", "C1", "P", "S_kl"):
            assert_allclose(getattr(found.reduced.moments, part), getattr(body.moments, part), rtol=1e-13, atol=1e-15)
        assert_allclose(found.reduced.K, body.K, rtol=1e-13, atol=0)
    assert system.body("twin").reduced is system.body("rod").reduced


@pytest.mark.parametrize(
    ("change", "words"),
    [
        (("modes = [2, 0]", "modes = [2, 7]"), "body 'rod' has modes 0 to 2, each to be named once"),
        (("modes = [2, 0]", "modes = [2, -1]"), "modes.1 = -1: expected"),
        (("modes = [2, 0]", "modes = [2, 0]\nis_rigid = true"), "expected one of modes, without_modes, is_rigid"),
        (("modes = [2, 0]", "inertia_about = [0, 0, 0]"), "inertia_about: a flexible body has no such key"),
        (("positive_products = true", "is_rigid = true"), "is_rigid: a rigid body has no such key"),
        (('interface = "end_a"', 'interface = "end_z"'), "no interface 'end_z'"),
        (('interface = "end_a"', "position = [0, 0, 0]"), "masses: position is for a rigid body; give interface"),
        (("position = [0.5, 0, 0]", "offset = [0.5, 0, 0]"), "masses: offset is for a flexible body; give position"),
        (("position = [0.5, 0, 0]\n", ""), "masses: position: missing"),
        (("inertia_about = [0, 0, 0.2]", "inertia_about = [0, 0, 20]"), "a negative principal moment"),
    ],
)
def test_mistakes_are_named(write, change, words):
    with pytest.raises(FloatframeError, match=words):
        read_system(write(change))


def test_a_modal_file_is_read_again_only_after_a_change(write, rod):
    path, bodies = write(), {}
    first = read_system(path, read_bodies=bodies)[0].body("stiff").reduced
    ((_, read_once),) = bodies.values()
    read_system(path, {"bodies.crank.mass": 3.0}, read_bodies=bodies)
    ((_, kept),) = bodies.values()
    assert kept is read_once
    cms.write(with_masses(rod, [AddedMass("end_a", 5.0)]), path.parent / "rod.h5")
    heavier = read_system(path, read_bodies=bodies)[0].body("stiff").reduced
    assert_allclose(heavier.moments.m - first.moments.m, 5.0, rtol=1e-12)
