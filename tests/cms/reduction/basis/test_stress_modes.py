"""Stress modes: the stress of each shape, in the axes of the body frame."""

from dataclasses import dataclass, replace

import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy.spatial.transform import Rotation

from cms.body.stress import von_mises
from cms.modes.mode_sets import craig_bampton, guyan
from cms.reduction.basis.frames import NodalFrame, TisserandFrame
from cms.reduction.basis.node_results import turned_stress
from cms.reduction.frame_conversion import convert_frame
from cms.reduction.reduction import reduce
from fe_models.body.couplings.couplings import couple
from fe_models.body.fe_body import FEBody
from fe_models.elements.solids.body import solid_body
from fe_models.foundation.units import unit_system
from tests.bodies import ALUMINIUM, STEEL, bar, box_mesh, distorted

TURNED = ((0.0, 1.0, 0.0), (-0.6, 0.0, 0.8), (0.8, 0.0, 0.6))


@pytest.fixture(scope="module")
def body():
    return couple(bar(nx=8, kind="hexahedron20"))


@pytest.mark.parametrize("axes", [None, TURNED])
def test_a_pulled_bar_has_the_stress_of_statics(body, axes):
    """Force over area in the middle of the bar, along x of the mesh whatever the axes of B: n(n·sigma·n)."""
    reduced = reduce(body, guyan(body), frame=NodalFrame("left", axes=axes))
    x = reduced.frame.axes.T @ [1.0, 0, 0]
    q = (reduced.interface("right").Psi[:3].T @ x) * 600.0 / np.diag(reduced.K)
    sigma = reduced.stress @ q
    middle = np.abs((reduced.nodes @ reduced.frame.axes.T + reduced.frame.origin)[:, 0] - 0.5) < 1e-9
    n = 600.0 / (0.05 * 0.04) * np.outer(x, x)
    expected = [n[0, 0], n[1, 1], n[2, 2], n[1, 2], n[0, 2], n[0, 1]]
    assert_allclose(sigma[middle], np.tile(expected, (middle.sum(), 1)), rtol=0, atol=2e-4 * 3e5)
    assert middle.sum() >= 8
    assert_allclose(von_mises(sigma)[middle], 3e5, rtol=2e-4)


def test_stress_modes_are_the_stress_of_the_shapes_at_every_node(body):
    """Recovered from the mesh displacement that the modes stand for."""
    modes = craig_bampton(body, n_modes=3)
    reduced = reduce(body, modes, frame=NodalFrame("left"))
    Phi = np.zeros((len(body.nodes), 3, reduced.n_q))
    Phi[reduced.node_ids] = reduced.Phi
    missing = np.setdiff1d(np.arange(len(body.nodes) - 2), reduced.node_ids)
    assert not len(missing)  # every node of this thin bar is on its surface
    u = Phi[:-2].reshape(-1, reduced.n_q)
    of_mesh = reduced.node_ids < len(body.nodes) - 2
    expected = body.element_model.nodal_stress(u)[reduced.node_ids[of_mesh]]
    assert_allclose(reduced.stress[of_mesh], expected, rtol=0, atol=1e-12 * np.abs(expected).max())
    assert_allclose(reduced.stress[~of_mesh], 0, rtol=0, atol=0)


def test_turned_components_are_those_of_the_turned_tensor():
    rng = np.random.default_rng(0)
    R = Rotation.from_rotvec([0.3, -0.5, 0.9]).as_matrix()
    stress = rng.normal(size=(4, 6, 2))
    turned = turned_stress(stress, R)
    for n in range(4):
        for k in range(2):
            xx, yy, zz, yz, xz, xy = stress[n, :, k]
            T = R.T @ np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]]) @ R
            assert_allclose(turned[n, :, k], [T[0, 0], T[1, 1], T[2, 2], T[1, 2], T[0, 2], T[0, 1]], rtol=0, atol=1e-14)
    assert_allclose(von_mises(turned), von_mises(stress), rtol=1e-12)


def test_von_mises_of_plain_states():
    states = np.array([[7.0, 0, 0, 0, 0, 0], [0, 0, 0, 0, 0, 7], [4, 4, 4, 0, 0, 0], [3, 1, 2, 0.5, 0.2, 0.7]])
    assert_allclose(von_mises(states)[:3], [7, 7 * np.sqrt(3), 0], rtol=0, atol=1e-14)
    T = np.array([[3, 0.7, 0.2], [0.7, 1, 0.5], [0.2, 0.5, 2]])
    s = T - np.trace(T) / 3 * np.eye(3)
    assert_allclose(von_mises(states)[3], np.sqrt(1.5 * (s * s).sum()), rtol=1e-14)


@dataclass(frozen=True)
class MiddleStress:
    """Stress at a point between two nodes, by their mean: stands for a section of a beam."""

    body: FEBody
    pair: tuple[int, int]
    names: tuple[str, ...] = ("between",)

    @property
    def positions(self):
        return self.body.nodes[list(self.pair)].mean(axis=0)[None]

    def stress(self, u):
        return self.body.element_model.nodal_stress(u)[list(self.pair)].mean(axis=0)[None]


def test_stress_points_follow_into_the_frame_and_to_another():
    free = bar(nx=4, kind="hexahedron")
    coupled = couple(replace(free, stress_points=MiddleStress(free, (3, 9))))
    modes = craig_bampton(coupled, n_modes=2)
    first = reduce(coupled, modes, frame=NodalFrame("left"))
    assert first.point_stress.names == ("between",)
    rows = [int(np.flatnonzero(first.node_ids == n)[0]) for n in (3, 9)]
    for reduced in (
        first,
        convert_frame(first, TisserandFrame(axes=TURNED)),
        reduce(coupled, modes, frame=TisserandFrame(axes=TURNED)),
    ):
        points = reduced.point_stress
        assert_allclose(points.positions[0], reduced.nodes[rows].mean(axis=0), rtol=0, atol=1e-12)
        expected = reduced.stress[rows].mean(axis=0)
        assert_allclose(points.modes[0], expected, rtol=0, atol=1e-9 * np.abs(expected).max())


def test_stress_is_left_out_on_demand_and_where_it_is_unknown(body):
    reduced = reduce(body, guyan(body), stress=False)
    assert reduced.stress is None
    assert reduced.point_stress is None
    assert convert_frame(reduced, NodalFrame("left")).stress is None
    assert reduce(replace(body, element_model=None), guyan(body)).stress is None


def test_stress_at_chosen_nodes_is_that_of_all():
    """Two materials, so that what adjoins a node matters; the nodes left out show zero."""
    mesh = distorted(box_mesh(3, 2, 2, kind="tetra10"), amount=0.2)
    body = solid_body(mesh, {"left half": STEEL, "right half": ALUMINIUM}, name="box", units=unit_system("m-kg-s"))
    u = np.random.default_rng(0).normal(size=(body.n_dof, 3))
    everywhere = body.element_model.nodal_stress(u)
    chosen = np.random.default_rng(1).choice(len(mesh.nodes), 12, replace=False)
    here = body.element_model.nodal_stress(u, nodes=np.r_[chosen, len(mesh.nodes) + 1])
    assert_allclose(here[chosen], everywhere[chosen], rtol=1e-12)
    assert_allclose(np.delete(here, chosen, axis=0), 0, rtol=0, atol=0)
