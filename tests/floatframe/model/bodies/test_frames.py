"""The same part reduced in two body frames: the motion is the same to first order in the deformation (theory.md §4)."""

from dataclasses import replace

import numpy as np
import pytest

import cms
from fe_models.meshes.numbering import Numbering
from floatframe import GROUND, FixedJoint, FlexibleBody, GeneralizedAlpha, Marker, PointForce, System, integrate
from floatframe.results.recovery import interface_positions, nodal_positions
from tests.bodies import bar

T_END, H = 0.0299, 2e-5  # one period of the clamped bar: 3.516/(2 pi) sqrt(EI/(rho A)) = 33.4 Hz


@pytest.fixture(scope="module")
def parts():
    """Return a steel bar of 1 m, held at one end, reduced in a nodal, in the mean-axis and in the Buckens frame."""
    coupled = cms.couple(bar(nx=10))
    modes = cms.craig_bampton(coupled, n_modes=4)
    frames = (cms.NodalFrame("left"), cms.TisserandFrame(), cms.reduction.BuckensFrame())
    return [cms.reduce(coupled, modes, frame=frame, geometric=False) for frame in frames]


def tip_path(part, force):
    system = System(
        [FlexibleBody("bar", part)],
        [FixedJoint("clamp", GROUND, Marker("bar", "left"))],
        [PointForce("load", Marker("bar", "right"), (0.0, 0.3 * force, force))],
    )
    motion = integrate(system, GeneralizedAlpha(0.9), T_END, H, output_every=10)
    return interface_positions(motion, "bar", part, "right"), motion


@pytest.mark.parametrize("other", [1, 2], ids=["tisserand", "buckens"])
def test_tip_motion_is_that_of_the_other_frame_but_for_second_order(parts, other):
    """Halving the load quarters the difference."""
    differences, deflections = [], []
    for force in (4000.0, 2000.0):
        first, second = (tip_path(part, force)[0] for part in (parts[0], parts[other]))
        differences.append(np.abs(first - second).max())
        deflections.append(np.abs(first - first[0]).max())
    assert deflections[0] > 0.04  # of a length of 1
    assert differences[0] < 0.1 * deflections[0]
    assert 3.3 < differences[0] / differences[1] < 4.7


def test_clamped_bar_swings_about_the_static_deflection_of_beam_theory(parts):
    """A load that comes at once swings the tip between zero and twice F L³/(3 E I)."""
    force = 40.0
    path, _ = tip_path(parts[0], force)
    inertia = 0.05 * 0.04**3 / 12
    static = force / (3 * 210e9 * inertia)
    assert abs(np.ptp(path[:, 2]) / (2 * static) - 1) < 0.04  # ten elements are stiffer by 2 per cent


def test_drawn_nodes_are_those_of_the_mesh_at_the_start(parts):
    for part in parts:
        _, motion = tip_path(part, 0.0)
        drawn = nodal_positions(motion, "bar", part, 0)
        frame = part.frame
        np.testing.assert_allclose(drawn, frame.origin + part.nodes @ frame.axes.T, rtol=0, atol=1e-12)


def test_a_body_keeps_its_motion_when_its_kept_nodes_are_dropped(parts):
    """The mesh plays no part in the motion: interfaces are 6 × n maps."""
    bare = replace(parts[0], nodes=parts[0].nodes[:0], node_ids=parts[0].node_ids[:0], Phi=parts[0].Phi[:0],
                   surface=parts[0].surface[:0], stress=parts[0].stress[:0], numbering=Numbering(),
                   interfaces=[replace(i, members=[]) for i in parts[0].interfaces])  # fmt: skip
    np.testing.assert_array_equal(tip_path(bare, 40.0)[0], tip_path(parts[0], 40.0)[0])


def test_a_converted_part_moves_as_the_part_reduced_in_that_frame(parts):
    """The file alone carries a part into another frame; what is left of the difference is the Newton tolerance."""
    converted = cms.reduction.convert_frame(parts[0], cms.reduction.BuckensFrame())
    expected, _ = tip_path(parts[2], 2000.0)
    assert np.abs(tip_path(converted, 2000.0)[0] - expected).max() < 1e-6 * np.abs(expected - expected[0]).max()
