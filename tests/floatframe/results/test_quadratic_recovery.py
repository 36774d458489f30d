"""Nodes of a stiffened body in motion, to second order in q."""

import numpy as np
import pytest
from numpy.testing import assert_allclose

import cms
from floatframe import FlexibleBody, GeneralizedAlpha, System, integrate
from floatframe.results.recovery import interface_positions, nodal_displacements, nodal_positions
from tests.cms.second_order.test_geometric_reduction import bar_of_beams


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
