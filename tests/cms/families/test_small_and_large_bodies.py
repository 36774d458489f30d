"""Bodies without interior dofs, all the modes there are, and interfaces with very many dofs."""

import logging

import numpy as np
import pytest
import scipy.linalg as la
from numpy.testing import assert_allclose

import cms
import fe_models as fm
from cms.errors import ModeSetError
from cms.families import families, interface_cost
from cms.families.interface_cost import few_columns, large_interfaces, reduction_cost
from tests.bodies import box_mesh
from tests.fe_models.small_shells import SI, STEEL

SETS = {
    "craig_bampton": cms.craig_bampton,
    "rubin": cms.rubin,
    "craig_chang": cms.craig_chang,
    "herting": cms.herting,
}


def beam(n):
    """A bar of n elements with an interface at both ends."""
    line = fm.straight_line((0, 0, 0), (1, 0, 0), n)
    ends = [fm.line_interface(line, name, fm.NodeSet(name)) for name in ("start", "end")]
    return cms.couple(
        fm.beam_body(line, fm.BeamProperty(fm.Rectangle(0.03, 0.02), STEEL), name="b", units=SI, interfaces=ends)
    )


def free_frequencies(body):
    omega2 = la.eigh(body.K.toarray(), body.M.toarray(), eigvals_only=True)[6:]
    return np.sqrt(omega2) / (2 * np.pi)


@pytest.mark.parametrize("name", SETS)
@pytest.mark.parametrize("n", [1, 2, 3])
def test_with_all_its_modes_a_reduced_beam_is_the_beam(n, name):
    """Of one element there is nothing inside; as many modes as interior dofs leave out nothing."""
    body = beam(n)
    reduced = cms.reduce(body, SETS[name](body, n_modes=len(body.i)))
    assert len(reduced.K) == body.n_dof - 6
    assert_allclose(np.sort(reduced.free_frequencies), free_frequencies(body), rtol=1e-8)


def test_more_modes_than_there_are_are_refused_with_the_number():
    body = beam(2)
    with pytest.raises(ModeSetError, match=r"has 6 interior dofs; choose 0 <= n_modes <= 6"):
        cms.craig_bampton(body, n_modes=7)
    with pytest.raises(ModeSetError, match=r"has 0 interior dofs; choose 0 <= n_modes <= 0"):
        cms.craig_bampton(beam(1), n_modes=1)


def test_a_cutoff_of_a_body_without_interior_dofs_finds_no_modes():
    body = beam(1)
    assert len(cms.reduce(body, cms.craig_bampton(body, cms.ModeCount(cutoff=100.0))).K) == 6


def test_an_interface_of_very_many_dofs_announces_its_cost_before_the_work(monkeypatch, caplog):
    mesh = box_mesh(4, 4, 2)
    left = fm.nodes_interface(mesh, "left", fm.NodeSet("left"))
    body = cms.couple(fm.solid_body(mesh, STEEL, name="block", units=SI, interfaces=[left]))
    assert large_interfaces(body) == []
    monkeypatch.setattr(interface_cost, "MANY", 45)
    (words,) = large_interfaces(body)
    assert "interface 'left' of 15 nodes has 45 boundary dofs" in words
    assert "interface_modes = 20" in words
    assert "45 columns, about" in words
    assert "26 columns, about" in words
    order = []
    monkeypatch.setattr(families, "fix_interfaces", lambda *_, **__: order.append(len(caplog.records)) or 1 / 0)
    with caplog.at_level(logging.WARNING), pytest.raises(ZeroDivisionError):
        cms.craig_bampton(body, n_modes=2)
    assert order == [1]  # told before the factorisation


def test_the_cost_of_a_reduction_grows_as_its_arrays_do():
    mesh = box_mesh(4, 4, 2)
    sides = [
        fm.nodes_interface(mesh, "left", fm.NodeSet("left")),
        fm.rigid_interface(mesh, "right", fm.NodeSet("right")),
    ]
    body = cms.couple(fm.solid_body(mesh, STEEL, name="block", units=SI, interfaces=sides))
    assert (few_columns(body, 20), few_columns(body, 100)) == (32, 51)
    bare, whole = (reduction_cost(body, 51, stress=stress) for stress in (False, True))
    n_kept = len(np.unique(np.concatenate([body.surface.ravel(), *(each.nodes for each in body.interfaces)])))
    assert whole.file - bare.file == 8 * 6 * n_kept * 51
    assert 8 * 9 * 51**2 < bare.file < 8 * (27 * 51**2 + 3 * n_kept * 51)
    assert bare.memory > bare.file + 8 * 2 * body.n_dof * 51
    assert "51 columns" in bare.words
    few = reduction_cost(body, 9, n_constraint_modes=1000)
    assert few.memory == 8 * 2 * body.n_dof * 1000  # they are all made before few are left


def test_the_file_of_a_reduction_is_as_large_as_was_said(tmp_path):
    """Numbers that deflate leaves as they are: M, K and D, which are diagonal, are small here."""
    mesh = box_mesh(8, 6, 6)
    body = cms.couple(
        fm.solid_body(mesh, STEEL, name="b", units=SI, interfaces=[fm.nodes_interface(mesh, "l", fm.NodeSet("left"))])
    )
    modes = cms.craig_bampton(body, n_modes=3)
    cms.write(cms.reduce(body, modes, geometric=False), tmp_path / "b.h5")
    said = reduction_cost(body, modes.columns.shape[1]).file
    assert 0.8 < (tmp_path / "b.h5").stat().st_size / said < 1.1
