"""Points that a reduced body keeps: rotations of beams and solids, in every frame, file and choice of modes."""

from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

import cms
from cms import NodalFrame, craig_bampton, reduce
from cms.body import Address
from cms.errors import BodyError
from cms.reduction import BuckensFrame
from cms.reduction.basis.node_results import kept_points
from cms.reduction.frame_conversion import convert_frame, six_motions
from fe_models.body.couplings.couplings import couple
from fe_models.body.fe_body import Interface
from fe_models.body.rigid_motion import rigid_motion_of_dofs
from fe_models.elements.beams.attachments import PointMass
from fe_models.elements.beams.beam_property import BeamProperty
from fe_models.elements.beams.body import beam_body
from fe_models.elements.beams.sections import Rectangle
from fe_models.elements.interfaces import NodeIndices, line_interface
from fe_models.elements.solids.body import solid_body
from fe_models.foundation.units import unit_system
from fe_models.meshes.line_mesh import straight_line
from tests.bodies import STEEL, box_mesh

UNITS = unit_system("m-kg-s")


def beam(interface_at=(0,), n=8):
    """A straight beam along x, 1 m, whose nodes have the numbers 100, 103, ..."""
    mesh = replace(straight_line((0, 0, 0), (1, 0, 0), n), node_numbers=100 + 3 * np.arange(n + 1))
    interfaces = [line_interface(mesh, f"at {k}", NodeIndices((k,))) for k in interface_at]
    section, mass = BeamProperty(Rectangle(0.03, 0.02), STEEL), PointMass(n, 0.3)
    made = beam_body(mesh, section, name="beam", units=UNITS, interfaces=interfaces, point_masses=[mass])
    return couple(made)


def test_a_node_of_a_line_moves_and_turns_as_an_interface_at_it_does():
    body = beam(interface_at=(0, 5))
    reduced = reduce(body, craig_bampton(body, n_modes=5))
    found = Address(node=115).find(reduced, "test")
    assert found.names == ("115",)
    assert reduced.kept.source == ("dofs",) * 9
    row, Psi = int(found.rows[0]), reduced.interface("at 5").Psi
    assert_allclose(reduced.Phi[row], Psi[:3], rtol=0, atol=1e-12 * np.abs(Psi).max())
    assert_allclose(reduced.kept.of_node(row), Psi[3:], rtol=0, atol=1e-12 * np.abs(Psi).max())


def solid_bar(kind="hexahedron20", nx=12, middle=False):
    mesh = box_mesh(nx, 2, 2, 1.0, 0.04, 0.04, kind)
    random = np.random.default_rng(3)
    mesh = replace(mesh, node_numbers=random.permutation(5 * len(mesh.nodes))[: len(mesh.nodes)] + 10)
    ends = [Interface(name, "rigid", mesh.node_sets[name], np.array([x, 0.02, 0.02]))
            for name, x in (("left", 0.0), ("right", 1.0))]  # fmt: skip
    if middle:
        section = np.flatnonzero(np.abs(mesh.nodes[:, 0] - 0.5) < 1e-9)
        ends.append(Interface("middle", "distributing", section, np.array([0.5, 0.02, 0.02])))
    return mesh, couple(solid_body(mesh, STEEL, name="bar", units=UNITS, interfaces=ends))


def test_a_node_inside_a_solid_turns_as_the_beam_of_the_same_bar():
    """One end turned, the other clamped: the middle turns by -1/4 of it (Euler-Bernoulli), w' = (3 x² - 2 x L) / L².

    The bar is 25 times as long as high, so that it is such a beam to 4 %: its ends are held rigidly, and it shears.
    """
    mesh, body = solid_bar()
    middle = int(np.flatnonzero(np.abs(mesh.nodes - [0.5, 0.02, 0.02]).max(axis=1) < 1e-9)[0])
    number = int(mesh.node_numbers[middle])
    reduced = reduce(body, craig_bampton(body, n_modes=0), keep=[number])
    row = int(Address(node=number).find(reduced, "test").rows[0])
    assert reduced.kept.source == ("elements",)
    ends = np.vstack([reduced.interface(name).Psi for name in ("left", "right")])
    rigid = np.vstack([six_motions(reduced.interface(name).position) for name in ("left", "right")])
    turned = np.eye(12)[10]  # the right end by 1 about y, all else at rest
    x = np.linalg.solve(np.hstack([ends, rigid]), turned)
    theta = reduced.kept.of_node(row) @ x[: reduced.n_q] + x[-3:]
    assert_allclose(theta, [0, -0.25, 0], rtol=0, atol=0.25 * 0.04)


def test_a_node_inside_a_solid_turns_as_a_distributing_interface_round_it():
    """The section turns as its mean motion says; half the curl is midway to the slope: they part by the shear angle."""
    mesh, body = solid_bar(middle=True)
    middle = int(np.flatnonzero(np.abs(mesh.nodes - [0.5, 0.02, 0.02]).max(axis=1) < 1e-9)[0])
    reduced = reduce(body, craig_bampton(body, n_modes=4), keep=[int(mesh.node_numbers[middle])])
    row = int(Address(position=mesh.nodes[middle]).find(reduced, "test").rows[0])
    theta, Psi = reduced.kept.of_node(row), reduced.interface("middle").Psi[3:]
    bends = np.argsort(reduced.frequencies)[:4]  # the slowest: long waves, which shear little
    assert_allclose(theta[:, bends], Psi[:, bends], rtol=0, atol=0.02 * np.abs(Psi[:, bends]).max())


def test_a_rigid_motion_turns_every_kept_node_of_a_coupled_solid_by_itself():
    mesh, body = solid_bar(kind="tetra10", nx=4)
    rigid = rigid_motion_of_dofs(body.nodes, body.dofs)
    points = kept_points(replace(body, kept=np.arange(len(mesh.nodes))), rigid, np.eye(3), np.arange(len(body.nodes)))
    expected = np.hstack([np.zeros((3, 3)), np.eye(3)])
    assert_allclose(points.rotation, np.tile(expected, (len(mesh.nodes), 1, 1)), rtol=0, atol=1e-9)


@pytest.mark.parametrize("frame", [NodalFrame("at 0"), BuckensFrame()])
def test_another_frame_turns_kept_points_as_it_turns_interfaces(frame):
    body = beam(interface_at=(0, 5))
    reduced = convert_frame(reduce(body, craig_bampton(body, n_modes=4)), frame)
    row, Psi = int(Address(node=115).find(reduced, "test").rows[0]), reduced.interface("at 5").Psi
    assert_allclose(reduced.kept.of_node(row), Psi[3:], rtol=0, atol=1e-11 * np.abs(Psi).max())


def test_numbers_sets_and_points_come_back_from_a_file_of_version_5(tmp_path):
    _, body = solid_bar(nx=3)
    reduced = reduce(body, craig_bampton(body, n_modes=2), keep=["top"])
    cms.write(reduced, tmp_path / "bar.h5")
    again = cms.read(tmp_path / "bar.h5")
    assert_array_equal(again.kept.rotation, reduced.kept.rotation)
    assert again.kept.source == reduced.kept.source
    for name in ("nodes", "on_skin", "elements", "node_instance"):
        assert_array_equal(getattr(again.numbering, name), getattr(reduced.numbering, name))
    assert [(s.name, s.kind, s.size) for s in again.numbering.sets] == [
        (s.name, s.kind, s.size) for s in reduced.numbering.sets
    ]
    in_mm = cms.body.convert_units(again, "mm-t-s")  # q in t^(1/2) mm: the same rotation of 1 kg^(1/2) m
    assert_allclose(in_mm.kept.rotation * (1e-3**0.5 * 1e3), reduced.kept.rotation, rtol=1e-12)


def test_an_address_finds_the_same_node_by_number_and_by_place():
    mesh, body = solid_bar(nx=3)
    reduced = reduce(body, craig_bampton(body, n_modes=2))
    for row in (0, 5, len(mesh.nodes) - 1):
        by_number = Address(node=int(mesh.node_numbers[row])).find(reduced, "test")
        by_place = Address(position=mesh.nodes[row]).find(reduced, "test")
        assert by_number.rows.tolist() == by_place.rows.tolist()
        assert by_place.distance < 1e-12
        assert_allclose(by_number.place, mesh.nodes[row], rtol=0, atol=1e-12)
    assert set(Address(set="top").find(reduced, "test").names) == {
        str(number) for number in mesh.node_numbers[mesh.node_sets["top"]]
    }


def test_a_place_without_a_kept_node_is_refused_with_the_nearest_ones():
    _mesh, body = solid_bar(nx=3)
    reduced = reduce(body, craig_bampton(body, n_modes=2))
    with pytest.raises(BodyError, match=r"sensor 'x': body 'bar': no kept node is at \[0.4, 0, 0\].*"
                                        r"Keep the node there \(keep = \[...\]"):  # fmt: skip
        Address(position=(0.4, 0.0, 0.0)).find(reduced, "sensor 'x'")
    assert Address(position=(0.4, 0.0, 0.0), tolerance=0.1).find(reduced, "x").distance > 0.05
    with pytest.raises(BodyError, match="exactly one of node, element, set, position, got node and set"):
        Address(node=3, set="top")
