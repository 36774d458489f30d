"""Geometric stiffness of bodies with many modes: left out unasked where it is very large, refused without room."""

import logging

import numpy as np
import pytest
from numpy.testing import assert_allclose

import cms
from cms.errors import BodyError
from cms.modes.families import cost
from cms.modes.families.cost import stiffness_bytes
from cms.reduction.geometric_stiffness.unit_states import unit_states
from fe_models.elements.interfaces import nodes_interface, rigid_interface
from fe_models.elements.solids.body import solid_body
from fe_models.meshes.selections import NodeSet
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
    monkeypatch.setattr(cost, "UNASKED", stiffness_bytes(body, modes.columns.shape[1]) - 1)
    with caplog.at_level(logging.WARNING):
        found = cms.reduce(body, modes)
    assert found.geometric is None
    assert 'geometric_stiffness = ["left"] has only the loads' in found.provenance["geometric stiffness"]
    assert "left out: 30 unit loads over 35 modes" in caplog.text
    caplog.clear()
    assert cms.reduce(body, modes, geometric=True).geometric is not None
    assert "geometric stiffness" not in cms.reduce(body, modes, geometric=False).provenance
    few = cms.modes.with_characteristic_modes(modes, body, n_modes=3)
    assert cms.reduce(body, few).geometric is not None
    assert not caplog.records


def test_one_without_room_is_refused_before_the_work(body, modes, monkeypatch):
    monkeypatch.setattr(cost, "machine_memory", lambda: 1e6)
    with pytest.raises(BodyError, match=r"has 0.001 GB\. .*geometric_stiffness = \[.left.\] has only the loads"):
        cms.reduce(body, modes, geometric=True)


def test_loads_of_chosen_interfaces_give_the_matrices_that_all_loads_give(body, modes):
    whole = cms.reduce(body, modes).geometric
    chosen = cms.reduce(body, modes, geometric=unit_states(body, interfaces=["right"]))
    some = chosen.geometric
    assert some.is_loaded == (False, True)
    assert some.interfaces.shape == (1, *whole.interfaces.shape[1:])
    for name in ("translation", "rotation", "spin"):
        assert_close(getattr(some, name), getattr(whole, name))
        assert_close(getattr(some.turned, name), getattr(whole.turned, name))
    assert_close(some.interfaces[0], whole.interfaces[1])
    assert_close(some.turned.interfaces[0], whole.turned.interfaces[1])
    assert_close(some.spread.K, whole.spread.K)
    assert_close(some.of_interface(1), whole.interfaces[1])
    assert not some.of_interface(0).any()
    told = chosen.provenance["geometric stiffness"]
    assert told == "loads at interfaces left do not stiffen the body: geometric_stiffness names right"
    assert (cms.reduce(body, modes, geometric=unit_states(body, interfaces=[])).geometric.interfaces.shape) == (
        0, 6, whole.n_q, whole.n_q,
    )  # fmt: skip
    with pytest.raises(BodyError, match="body 'block': no interface 'rigth'"):
        unit_states(body, interfaces=["rigth"])


def test_chosen_loads_go_to_a_file_and_back_and_to_other_frames(body, modes, tmp_path):
    chosen = cms.reduce(body, modes, geometric=unit_states(body, interfaces=["right"]))
    cms.write(chosen, tmp_path / "chosen.h5")
    read = cms.read(tmp_path / "chosen.h5")
    assert read.geometric.is_loaded == (False, True)
    np.testing.assert_array_equal(read.geometric.interfaces, chosen.geometric.interfaces)
    there = cms.reduction.convert_frame(cms.reduce(body, modes), cms.NodalFrame("right")).geometric
    changed = cms.reduction.convert_frame(read, cms.NodalFrame("right")).geometric
    assert changed.is_loaded == (False, True)
    assert_close(changed.spin, there.spin)
    assert_close(changed.spread.K, there.spread.K)
    with pytest.raises(BodyError, match=r"the loads at interface 'right' were left out"):
        cms.reduction.convert_frame(
            cms.reduce(body, modes, geometric=unit_states(body, interfaces=[])), cms.NodalFrame("right")
        )


def assert_close(K, expected):
    assert_allclose(K, expected, rtol=0, atol=1e-10 * np.abs(expected).max())
