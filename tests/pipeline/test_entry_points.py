"""A package of its own adds mode sets, elements, joints, sensors and readers by entry points, without an edit here."""

import json
import subprocess
import sys

import pytest

from tests.root import ROOT

CODE = '''
"""A mode set, an element and a reader of another package."""

from dataclasses import dataclass

import numpy as np
from numba import njit

from cms.modes.families.families import families_of
from cms.modes.mode_set import constraint_block, mode_set
from fe_models.meshes.cells.raw_mesh import RawBlock, RawMesh
from floatframe import Marker
from floatframe.joints import ScrewJoint
from floatframe.model import Element, ElementLaw
from floatframe.results.sensors import Measurement, PlaceSensor


def static(body):
    """Constraint modes alone."""
    with families_of(body) as families:
        return mode_set("static", families, [constraint_block(families)])


def read_plain(path, content):
    """Return one tetrahedron with edges of the length that the file holds."""
    nodes = float(content) * np.array([(0.0, 0, 0), (1, 0, 0), (0, 1, 0), (0, 0, 1)])
    return RawMesh(nodes, (RawBlock("tetra", np.array([[0, 1, 2, 3]])),))


@njit
def push(t, x, z, lam, data, wrench, z_dot, g, outputs):
    wrench[0, 2] = data[0]


@dataclass(frozen=True, eq=False)
class Push(Element):
    """A constant force along z."""

    name: str
    marker: Marker
    force: float

    def law(self, placed):
        return ElementLaw(function=push, data=[self.force])


@dataclass(frozen=True, eq=False)
class Bolt(ScrewJoint):
    """A screw with several threads beside each other.

    Parameters
    ----------
    thread
        Name of the thread.
    starts
        Number of threads.
    """

    thread: str = "M250"
    starts: int = 1
    lead: float = 0.0

    def __post_init__(self):
        object.__setattr__(self, "lead", {"M250": 0.25}[self.thread] * self.starts)
        super().__post_init__()


@dataclass(frozen=True, eq=False)
class Height:
    """Height of a marker over a floor."""

    name: str
    marker: Marker
    floor: float = 0.0

    def measure(self, system, trajectory):
        found = PlaceSensor("", self.marker).measure(system, trajectory)
        return Measurement(self.name, found.t, {"height": found.columns["z"] - self.floor}, {"height": "m"})
'''

POINTS = """
[cms.mode_sets]
static = acme_fe:static
rubin = acme_fe:static
broken = acme_fe.nowhere:missing

[floatframe.elements]
acme.push = acme_fe:Push
acme.broken = acme_fe.nowhere:missing
acme.number = acme_fe:np

[floatframe.joints]
acme.bolt = acme_fe:Bolt
revolute = acme_fe:Bolt
acme.broken = acme_fe.nowhere:missing

[floatframe.sensors]
acme.height = acme_fe:Height
acme.number = acme_fe:np

[fe_models.readers]
plain = acme_fe:read_plain
broken = acme_fe.nowhere:missing
"""

USE = """
import json, logging, pathlib
import numpy as np
import cms, fe_models, floatframe as ff
from fe_models.foundation.parametric_file import schema_text
from floatframe.model.elements.registry import element_class
from tests.bodies import bar

body = cms.couple(bar())
assert "static" in cms.MODE_SETS and "static" in list(cms.MODE_SETS)
np.testing.assert_array_equal(cms.MODE_SETS["static"](body).columns, cms.modes.guyan(body).columns)
assert cms.MODE_SETS["rubin"].__module__.startswith("cms."), "a set of this project is not replaced"

pathlib.Path("one.plain").write_text("2.0")
mesh = fe_models.read_mesh("one.plain")
assert mesh.nodes.max() == 2.0

assert element_class("acme.push").__name__ == "Push"
pathlib.Path("push.toml").write_text('''
kind = "system"
[system]
units = "m-kg-s"
[bodies.block]
mass = 2.0
inertia = [[1, 0, 0], [0, 1, 0], [0, 0, 1]]
[joints.bolt]
type = "acme.bolt"
body_a = "ground"
body_b = "block"
marker_b = [0, 0, 0]
axis = [0, 0, 1]
thread = "M250"
starts = 2
[elements.up]
type = "acme.push"
marker = {body = "block"}
force = 3.0
[sensors.height]
type = "acme.height"
body = "block"
marker = [0, 0, 2]
floor = 0.5
[run]
t_end = 1.0
h = 0.01
''')
system, run = ff.read_system("push.toml")
motion = ff.integrate(system, run.integrator, run.t_end, run.h)
np.testing.assert_allclose(motion.body("block").r[-1, 2], 0.75 / (1 + (2 * np.pi / 0.5) ** 2 / 2), rtol=1e-6)

height = motion.sensor("height")["height"]
np.testing.assert_allclose(height, motion.body("block").r[:, 2] + 1.5, rtol=0, atol=1e-12)

text = pathlib.Path("push.toml").read_text()
def changed(old, new):
    pathlib.Path("wrong.toml").write_text(text.replace(old, new))
    ff.read_system("wrong.toml")

bolt = json.loads(schema_text("system"))["$defs"]["Bolt"]
assert "several threads" in bolt["description"]
assert bolt["properties"]["starts"]["description"] == "a whole number: Number of threads"

for call, error in (
    (lambda: cms.MODE_SETS["broken"], cms.errors.ModeSetError),
    (lambda: element_class("acme.broken"), ff.errors.ModelError),
    (lambda: element_class("acme.number"), ff.errors.ModelError),
    (lambda: changed("starts = 2", "start = 2"), ff.errors.SystemFileError),
    (lambda: changed("M250", "M260"), ff.errors.SystemFileError),
    (lambda: changed("acme.bolt", "acme.blt"), ff.errors.SystemFileError),
    (lambda: changed("acme.bolt", "acme.broken"), ff.errors.SystemFileError),
    (lambda: changed("acme.height", "acme.number"), ff.errors.SystemFileError),
    (lambda: fe_models.read_mesh(pathlib.Path("one.plain").rename("one.broken")), fe_models.errors.MeshError),
):
    try:
        call()
    except error as told:
        print(told)
"""


@pytest.fixture
def folder(tmp_path):
    """Return a folder with a package as pip would install it."""
    (tmp_path / "acme_fe.py").write_text(CODE)
    about = tmp_path / "acme_fe-1.2.dist-info"
    about.mkdir()
    (about / "METADATA").write_text("Metadata-Version: 2.1\nName: acme-fe\nVersion: 1.2\n")
    (about / "entry_points.txt").write_text(POINTS)
    return tmp_path


def test_a_package_adds_a_mode_set_an_element_a_joint_a_sensor_and_a_reader(folder, monkeypatch):
    """Used in Python and in files; what cannot be loaded is told with the name of its package, when it is used."""
    monkeypatch.setenv("PYTHONPATH", f"{folder}:{ROOT}")
    done = subprocess.run([sys.executable, "-c", USE], cwd=folder, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    *own, last = done.stdout.splitlines()
    modes, element, number, key, code, kind, joint, sensor = own
    assert "cms.mode_sets 'broken' of package acme-fe 1.2: " in modes
    assert "ModuleNotFoundError: No module named 'acme_fe.nowhere'" in modes
    assert "floatframe.elements 'acme.broken' of package acme-fe 1.2: " in element
    assert "floatframe.elements 'acme.number' of package acme-fe 1.2: " in number
    assert "expected a class that derives from Element" in number
    assert "joints.bolt.start: unknown key of type \"acme.bolt\"; did you mean 'starts'?" in key
    assert "joints.bolt: Bolt: KeyError: 'M260' (line " in code
    assert "unknown type of joint; did you mean 'acme.bolt'?" in kind
    assert "joints.bolt: floatframe.joints 'acme.broken' of package acme-fe 1.2: " in joint
    assert "sensors.height: floatframe.sensors 'acme.number' of package acme-fe 1.2: " in sensor
    assert "expected a dataclass with the method measure" in sensor
    assert "fe_models.readers '.broken' of package acme-fe 1.2: " in last
    command = [sys.executable, "-m", "cms.cli", "formats", "--json"]
    listed = json.loads(subprocess.run(command, cwd=folder, capture_output=True, text=True, check=True).stdout)
    readers = {each["suffixes"][0]: each["program"] for each in listed if each["holds"] == "mesh"}
    assert readers[".plain"] == readers[".broken"] == "package acme-fe 1.2", "the package is not imported"
    for group, name in (("cms.mode_sets", "rubin"), ("floatframe.joints", "revolute")):
        assert f"{group} '{name}' of package acme-fe 1.2: left out, this project has it" in done.stderr
