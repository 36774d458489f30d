"""Channels at a position of a flexible body: its nearest kept node, as sensors have it."""

from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose

import cms
from floatframe import GROUND, FixedJoint, FlexibleBody, Gravity, Marker, System
from floatframe.analyses.equilibrium import static_equilibrium
from floatframe.analyses.linear.channels import Channel
from floatframe.analyses.linear.linearization import linearize
from floatframe.errors import ModelError
from tests.cms.reduction.geometric_stiffness.examples import bar_of_beams


@pytest.fixture(scope="module")
def body():
    coupled = cms.couple(bar_of_beams(6))
    return cms.reduce(coupled, cms.craig_bampton(coupled, n_modes=3), quadratic=True)


def held(body, weight):
    held_end = FixedJoint("clamp", Marker(GROUND), Marker("bar", body.interfaces[0].name))
    return System([FlexibleBody("bar", body)], [held_end], [Gravity((0.0, 0.0, -weight))])


@pytest.mark.parametrize("weight", [0.0, 3e4])
@pytest.mark.parametrize("direction", [(1, 0, 0), (0, 0.6, 0.8)])
def test_a_node_at_an_interface_moves_and_is_pushed_as_the_interface(body, weight, direction):
    end = body.interfaces[1]
    position = body.frame.origin + body.frame.axes @ end.position
    system = held(body, weight)
    rest = static_equilibrium(system)
    if weight:
        assert np.abs(end.Psi[:3] @ rest.state.q).max() > 1e-3 * np.ptp(body.nodes[:, 0])  # the second order counts
    at_node, at_interface = (Channel("tip", marker, direction) for marker in (
        Marker("bar", position=position), Marker("bar", end.name)))  # fmt: skip
    node, interface = (linearize(system, rest, inputs=[each], outputs=[each]) for each in (at_node, at_interface))
    size = np.abs(interface.B).max()
    assert_allclose(node.B, interface.B, rtol=0, atol=1e-9 * size)
    assert_allclose(node.C, interface.C, rtol=0, atol=1e-9 * np.abs(interface.C).max())


def test_a_kept_rotation_at_an_interface_is_that_of_the_interface(body):
    end, system = body.interfaces[1], held(body, 0.0)
    position = body.frame.origin + body.frame.axes @ end.position
    turn = [Channel("turn", marker, (0, 1, 0), "rotation") for marker in (
        Marker("bar", position=position), Marker("bar", end.name))]  # fmt: skip
    node, interface = (linearize(system, inputs=[each], outputs=[each]) for each in turn)
    assert_allclose(node.B, interface.B, rtol=0, atol=1e-9 * np.abs(interface.B).max())


def test_nodes_without_rotations_say_so(body):
    bare = replace(body, kept=None)
    with pytest.raises(ModelError, match="of flexible body 'bar' keeps no rotation; keep it"):
        linearize(held(bare, 0.0), outputs=[Channel("turn", Marker("bar", position=(0, 0, 0)), (0, 1, 0), "rotation")])
