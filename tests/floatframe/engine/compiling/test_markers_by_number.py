"""Joints and forces at nodes by the user's numbers: interfaces by another name, and what is none is refused."""

from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_array_equal

import cms
import fe_models as fm
from cms.body.modal_file.file import write
from floatframe import GROUND, FlexibleBody, Marker, PointForce, RevoluteJoint, System
from floatframe.analyses import consistent_state
from floatframe.errors import ModelError
from floatframe.files.system_file.read_system import read_system
from tests.bodies import STEEL

FILE = """
[system]
units = "m-kg-s"
[bodies.rod]
file = "rod.h5"

[joints.pin]
type = "revolute"
body_a = "ground"
body_b = "rod"
marker_b = {node = 1000}
axis = [0, 1, 0]

[forces.push]
type = "point-force"
body = "rod"
marker = {node = 1030}
force = [0, 0, 5]
"""


@pytest.fixture(scope="module")
def reduced():
    """A rod of three lines between the nodes 1000, 1010, 1020, 1030; interfaces at its ends."""
    mesh = replace(fm.beams.straight_line((0, 0, 0), (1, 0, 0), 3), node_numbers=1000 + 10 * np.arange(4))
    ends = [fm.beams.line_interface(mesh, name, fm.beams.NodeIndices((k,))) for name, k in (("root", 0), ("tip", 3))]
    body = fm.beam_body(
        mesh,
        fm.beams.BeamProperty(fm.beams.Circle(0.02), STEEL),
        name="rod",
        units=cms.unit_system("m-kg-s"),
        interfaces=ends,
    )
    body = cms.couple(body)
    return cms.reduce(body, cms.craig_bampton(body, n_modes=3))


def system(reduced, root, tip):
    pin = RevoluteJoint("pin", GROUND, root, axis=(0, 1, 0))
    return System([FlexibleBody("rod", reduced)], [pin], [PointForce("push", tip, force=(0, 0, 5.0))])


def test_a_node_that_is_an_interface_is_that_interface(reduced, tmp_path):
    by_name = consistent_state(system(reduced, Marker("rod", "root"), Marker("rod", "tip")))
    by_node = consistent_state(system(reduced, Marker("rod", node=1000), Marker("rod", node=1030)))
    assert_array_equal(by_node.u_dot, by_name.u_dot)
    assert_array_equal(by_node.w, by_name.w)
    assert np.abs(by_node.u_dot).max() > 0.1
    write(reduced, tmp_path / "rod.h5")
    (tmp_path / "system.toml").write_text(FILE)
    of_file = consistent_state(read_system(tmp_path / "system.toml")[0])
    assert_array_equal(of_file.w, by_name.w)


@pytest.mark.parametrize(
    ("node", "words"),
    [
        (1010, r"node 1010 of body 'rod' is not an interface.*nodes = \[1010\].*root, tip"),
        (7, "no node 7"),
    ],
)
def test_others_are_refused_with_the_remedy(reduced, node, words):
    with pytest.raises(ModelError, match=words):
        consistent_state(system(reduced, Marker("rod", "root"), Marker("rod", node=node)))
