"""Nodes of a stiffened body in motion, to second order in q."""

import numpy as np
import pytest
from numpy.testing import assert_allclose

import cms
from floatframe import FlexibleBody, GeneralizedAlpha, System, integrate
from floatframe.results.place_motion import interface_motion, node_motion
from floatframe.results.recovery import interface_positions, nodal_displacements, nodal_positions
from tests.cms.reduction.geometric_stiffness.examples import bar_of_beams


@pytest.fixture(scope="module")
def body():
    coupled = cms.couple(bar_of_beams(6))
    return cms.reduce(coupled, cms.craig_bampton(coupled, n_modes=3), quadratic=True)


@pytest.mark.parametrize("stiffening", [True, False])
def test_nodes_move_as_the_interfaces_they_are_at(body, stiffening):
    q = np.zeros(body.n_q)
    q[0] = 0.05 / np.abs(body.Phi[..., 0]).max()
    system = System([FlexibleBody("bar", body, q=q, omega_B=(0, 3.0, 1.0), stiffening=stiffening)])
    motion = integrate(system, GeneralizedAlpha(0.9), 0.02, 1e-4, output_every=20)
    first_order = motion.body("bar").q @ body.Phi.reshape(-1, body.n_q).T
    moved = nodal_displacements(motion, "bar", body, np.arange(len(motion.t)))
    second_order = np.abs(moved.reshape(len(moved), -1) - first_order).max()
    assert second_order > 1e-4 if stiffening else second_order < 1e-15
    for interface in body.interfaces:
        node = int(np.argmin(np.linalg.norm(body.nodes - interface.position, axis=1)))
        found = [nodal_positions(motion, "bar", body, i)[node] for i in range(len(motion.t))]
        assert_allclose(found, interface_positions(motion, "bar", body, interface.name), rtol=0, atol=1e-10)


def test_the_motion_of_a_node_is_that_of_its_positions_and_of_the_interface_there(body):
    q = np.zeros(body.n_q)
    q[0] = 0.05 / np.abs(body.Phi[..., 0]).max()
    system = System([FlexibleBody("bar", body, q=q, omega_B=(0, 3.0, 1.0))])
    motion = integrate(system, GeneralizedAlpha(0.9), 0.02, 1e-4, output_every=20)
    interface = body.interfaces[-1]
    node = int(np.argmin(np.linalg.norm(body.nodes - interface.position, axis=1)))
    found, known = node_motion(motion, "bar", body, node), interface_motion(motion, "bar", body, interface.name)
    positions = [nodal_positions(motion, "bar", body, i)[node] for i in range(len(motion.t))]
    assert_allclose(found.position, positions, rtol=0, atol=1e-14)
    for name in ("velocity", "acceleration"):
        size = np.abs(getattr(known, name)).max()
        assert_allclose(getattr(found, name), getattr(known, name), rtol=0, atol=1e-8 * size, err_msg=name)
