"""Geometric stiffness of bodies with many modes: left out unasked where it is very large, refused without room."""

import logging

import pytest

import cms
from cms.errors import BodyError
from cms.second_order import room_for_stiffness
from cms.second_order.room_for_stiffness import stiffness_bytes
from fe_models.meshes.selections import NodeSet
from fe_models.solids.body import solid_body
from fe_models.solids.interfaces import nodes_interface, rigid_interface
from tests.bodies import STEEL, box_mesh


@pytest.fixture(scope="module")
def body():
    mesh = box_mesh(3, 2, 2)
    ends = [nodes_interface(mesh, "left", NodeSet("left")), rigid_interface(mesh, "right", NodeSet("right"))]
    return cms.couple(solid_body(mesh, STEEL, name="block", units=cms.unit_system("m-kg-s"), interfaces=ends))


@pytest.fixture(scope="module")
def modes(body):
    return cms.craig_bampton(body, n_modes=2)


def test_an_interface_of_many_nodes_has_six_unit_loads_as_others_have(body, modes):
    geometric = cms.reduce(body, modes).geometric
    n = geometric.n_q
    assert geometric.interfaces.shape == (2, 6, n, n)
    parts = (geometric.translation, geometric.rotation, geometric.spin, geometric.interfaces, geometric.spread.K)
    assert sum(part.nbytes for part in parts) == stiffness_bytes(body, n)


def test_one_that_is_very_large_is_made_where_it_is_asked_for_only(body, modes, monkeypatch, caplog):
    monkeypatch.setattr(room_for_stiffness, "UNASKED", stiffness_bytes(body, modes.columns.shape[1]) - 1)
    with caplog.at_level(logging.WARNING):
        found = cms.reduce(body, modes)
    assert found.geometric is None
    assert "interface_modes in [reduction]" in found.provenance["geometric stiffness"]
    assert "left out: 30 unit loads over 35 modes" in caplog.text
    caplog.clear()
    assert cms.reduce(body, modes, geometric=True).geometric is not None
    assert "geometric stiffness" not in cms.reduce(body, modes, geometric=False).provenance
    few = cms.with_characteristic_modes(modes, body, n_modes=3)
    assert cms.reduce(body, few).geometric is not None
    assert not caplog.records


def test_one_without_room_is_refused_before_the_work(body, modes, monkeypatch):
    monkeypatch.setattr(room_for_stiffness, "machine_memory", lambda: 1e6)
    with pytest.raises(BodyError, match=r"this machine has 0.001 GB. Take fewer modes \(interface_modes = 20"):
        cms.reduce(body, modes, geometric=True)
