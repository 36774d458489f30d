"""Elements by name in system files: packages of users, keys of their tables, and what is refused."""

import sys

import numpy as np
import pytest
from numpy.testing import assert_array_equal

from floatframe import Marker, integrate
from floatframe.errors import ModelError, SystemFileError
from floatframe.files.system_file.read_system import read_system
from floatframe.model.elements.registry import element_class
from tests.floatframe.model.elements.public_elements_examples import METHOD, as_elements, places

PACKAGE = """
ELEMENTS = {"spring": "MODULE.springs:Spring", "lost": "MODULE.nowhere:Spring", "none": "MODULE.springs:Marker"}
"""
MODULE = "from tests.floatframe.model.elements.laws import Marker, Spring\n"
SYSTEM = """
[system]
units = "m-kg-s"
gravity = [0, 0, -9.81]
[bodies.a]
mass = 2.0
inertia = [[0.1, 0, 0], [0, 0.2, 0], [0, 0, 0.25]]
position = [1, 0, 0]
omega_B = [1, 2, 3]
[bodies.b]
mass = 1.0
inertia = [[0.1, 0, 0], [0, 0.2, 0], [0, 0, 0.25]]
position = [2, 0.3, 0]
omega_B = [1, -2, 3]
[elements.s]
type = "NAME.spring"
marker_a = {body = "a", marker = [0.1, 0.2, 0.3]}
marker_b = {body = "b", marker = [0.3, 0.1, 0.2]}
stiffness = 200.0
damping = 1
preload = 1.0
[elements.g]
type = "NAME.spring"
marker_a = {body = "ground", marker = [0, 0, 1]}
marker_b = {body = "a", marker = [0.3, 0.3, 0.3]}
stiffness = 300.0
damping = 2.0
preload = 1.0
acts = ["force", "force"]
[sensors.pull]
type = "element"
of = "s"
output = "tension"
[run]
t_end = 0.1
h = 1e-3
"""


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """Return a folder with a system file and a package of a user, by a name that no other test imports."""
    folder = tmp_path_factory.mktemp("somewhere")
    package = folder / "a_users_elements"
    package.mkdir()
    (package / "__init__.py").write_text(PACKAGE.replace("MODULE", package.name))
    (package / "springs.py").write_text(MODULE)
    (folder / "system.toml").write_text(SYSTEM.replace("NAME", package.name))
    yield folder
    for name in [name for name in sys.modules if name.startswith(package.name)]:
        del sys.modules[name]


def test_a_system_file_and_python_give_one_motion(folder):
    system, run = read_system(folder / "system.toml")
    assert [sensor.name for sensor in system.sensors] == ["pull"]
    by_file = integrate(system, METHOD, run.t_end, run.h)
    assert_array_equal(places(by_file), places(integrate(as_elements(), METHOD, run.t_end, run.h)))
    assert str(folder) not in sys.path


def test_values_of_elements_are_changed_by_their_key_path(folder):
    system, _ = read_system(folder / "system.toml", {"elements.s.stiffness": 250.0})
    assert [element.stiffness for element in system.elements] == [250.0, 300.0]


BAD = {
    "no type": ({"elements.s.type": 3}, "elements.s.type: missing; expected"),
    "no package": ({"elements.s.type": "weels.tyre"}, "there is no package 'weels'"),
    "no dot": ({"elements.s.type": "tyre"}, 'expected "PACKAGE.ELEMENT"'),
    "no element": ({"elements.s.type": "a_users_elements.sprnig"}, "has no element 'sprnig'; did you mean 'spring'?"),
    "no elements": ({"elements.s.type": "joints.revolute"}, "package floatframe.model.joints names no elements"),
    "no module": ({"elements.s.type": "a_users_elements.lost"}, "cannot be imported: ModuleNotFoundError"),
    "no class": ({"elements.s.type": "a_users_elements.none"}, "expected a class that derives from"),
    "text": ({"elements.s.stiffness": "stiff"}, 'elements.s.stiffness = "stiff": expected a number'),
    "no key": ({"elements.s.stiffnes": 1.0}, "elements.s.stiffnes: unknown key; did you mean 'stiffness'?"),
    "no place": ({"elements.s.marker_a": "a"}, 'elements.s.marker_a = "a": expected a marker, {body'),
    "no body": ({"elements.s.marker_a": {"body": "c"}}, "element 's': marker 1: no body 'c'"),
    "wrong place": (
        {"elements.s.marker_a": {"body": "a", "marker": [1, 2]}},
        "elements.s.marker_a.marker = [1, 2]: expected the name of an interface",
    ),
    "list": ({"elements.g.acts": "force"}, 'elements.g.acts = "force": expected a list'),
    "choice": ({"elements.g.acts": ["force", "forse"]}, "element 'g': acts: expected one of wrench, force"),
    "sensor": ({"sensors.pull.output": "tensoin"}, "element 's' has no output 'tensoin'; did you mean 'tension'?"),
}


def measure(folder, changes):
    system, _ = read_system(folder / "system.toml", changes)
    motion = integrate(system, METHOD, 1e-3, 1e-3)
    system.sensors[0].measure(system, motion)


@pytest.mark.parametrize("case", BAD)
def test_what_is_wrong_is_told_in_one_message(folder, case):
    changes, told = BAD[case]
    with pytest.raises((SystemFileError, ModelError)) as error:
        measure(folder, changes)
    assert told in str(error.value)
    assert "\n" not in str(error.value)


def test_a_missing_key_is_told_with_what_is_expected(folder):
    text = (folder / "system.toml").read_text().replace("stiffness = 200.0\n", "")
    (folder / "less.toml").write_text(text)
    with pytest.raises(SystemFileError, match=r"elements\.s\.stiffness: missing; expected a number"):
        read_system(folder / "less.toml")


def test_a_marker_of_an_element_takes_its_axes_as_rows(folder):
    rows = [[0, 1, 0], [-1, 0, 0], [0, 0, 1]]
    system, _ = read_system(
        folder / "system.toml", {"elements.s.marker_a": {"body": "a", "marker": [0, 0, 0], "triad": rows}}
    )
    marker = system.elements[0].marker_a
    assert isinstance(marker, Marker)
    assert_array_equal(marker.triad, np.array(rows).T)


def test_a_package_that_fails_says_so(tmp_path):
    (tmp_path / "a_broken_package").mkdir()
    (tmp_path / "a_broken_package" / "__init__.py").write_text("1 / 0\n")
    with pytest.raises(ModelError, match="a_broken_package cannot be imported: ZeroDivisionError"):
        element_class("a_broken_package.spring", tmp_path)
