"""Tables of shapes in system files, and their messages."""

import numpy as np
import pytest
from numpy.testing import assert_allclose

from floatframe.errors import FloatframeError
from floatframe.files.system_file.read_system import read_system
from floatframe.model.shapes import Mesh, Track, Wheel

FILE = """
[system]
units = "m-kg-s"

[bodies.hub]
mass = 2.0
inertia = [[2.0, 0, 0], [0, 2.5, 0], [0, 0, 3.0]]

[[bodies.hub.shapes]]
type = "wheel"
radius = 0.3
width = 0.2
color = "red"
position = [0, 0.1, 0]

[[bodies.hub.shapes]]
type = "mesh"
file = "part.stl"
scale = 0.001

[[scene]]
type = "track"
points = [[0, 0, 0], [10, 0, 0]]
gauge = 1.5
cant = [0.0, 0.1]
"""
STL = """solid part
facet normal 0 0 1
outer loop
vertex 0 0 0
vertex 1000 0 0
vertex 0 500 0
endloop
endfacet
endsolid part
"""


def read(tmp_path, text=FILE):
    (tmp_path / "part.stl").write_text(STL)
    path = tmp_path / "system.toml"
    path.write_text(text)
    return read_system(path)[0]


def test_tables_become_shapes(tmp_path):
    system = read(tmp_path)
    wheel, part = system.body("hub").shapes
    assert isinstance(wheel.geometry, Wheel)
    assert (wheel.geometry.radius, wheel.geometry.width, wheel.color) == (0.3, 0.2, "#c4473a")
    assert_allclose(wheel.position, (0, 0.1, 0))
    assert isinstance(part.geometry, Mesh)
    assert_allclose(np.ptp(part.geometry.nodes, axis=0), (1.0, 0.5, 0.0), rtol=1e-6)
    assert isinstance(system.scene[0].geometry, Track)
    assert_allclose(system.scene[0].geometry.cant, (0.0, 0.1))


@pytest.mark.parametrize(
    ("change", "words"),
    [
        (("radius = 0.3", "diameter = 0.3"), "unknown key"),
        (
            ("width = 0.2", "size = [1, 1, 1]"),
            "shapes.0.size: unknown key of type .wheel.; choices: axis, color",
        ),
        (("width = 0.2\n", ""), r"width: missing; expected a number: .*width of the .* \(line 9\)"),
        (('type = "wheel"', 'type = "whel"'), "did you mean 'wheel'"),
        (('color = "red"', 'color = "rde"'), "#rrggbb.*got 'rde'; did you mean 'red'"),
        (('color = "red"', 'interface = "rim"'), "there is no interface 'rim'; it has none"),
        (("part.stl", "none.stl"), "no such file"),
        (("scale = 0.001", "scale = -0.001"), r"shapes.1.scale = -0.001: expected a factor above 0 .* \(line 19\)"),
        (("part.stl", "system.toml"), "cannot be read as a surface"),
        (("cant = [0.0, 0.1]", "cant = [0.0, 0.1, 0.1]"), r"expected shape \(2,\)"),
    ],
)
def test_messages_name_place_and_remedy(tmp_path, change, words):
    with pytest.raises(FloatframeError, match=words):
        read(tmp_path, FILE.replace(*change))
