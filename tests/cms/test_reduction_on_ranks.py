"""A reduction whose columns lie by rows on ranks that are threads, beside that of one process."""

import gc
from dataclasses import fields, replace

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

import cms
from cms.modes.families.families import Families
from cms.modes.families.flexibility import BoundaryConditions
from cms.modes.mode_sets.classical import craig_bampton, craig_bampton_ir
from cms.modes.mode_sets.free_interface import rubin
from cms.reduction.reduction import reduce
from fe_models.body.couplings.coupling_on_ranks import spread_body
from fe_models.body.couplings.couplings import couple
from fe_models.body.fe_body import Interface
from fe_models.body.load_cases import LoadCase
from fe_models.foundation.errors import BodyError
from fe_models.foundation.ranks.spread_columns import SpreadColumns, spread_beside, spread_columns
from fe_models.foundation.ranks.spread_matrix import SpreadMatrix, spread_sum, whole_matrix
from tests.bodies import bar, beam
from tests.fe_models.small_shells import plate
from tests.thread_ranks import ThreadRanks

ROUNDOFF = 1e-8  #: of sums in another order, by the gap of frequencies, which turns shapes


def pair(size, kind="rigid"):
    """Return a coupled body on one process, and by rows on so many ranks."""
    bodies = (bar(nx=6, ny=2, nz=2, kind="hexahedron", ranks=ranks) for ranks in (None, ThreadRanks(size)))
    return [couple(replace(b, interfaces=tuple(replace(each, kind=kind) for each in b.interfaces))) for b in bodies]


def same(a, b, scale=None):
    scale = np.abs(b).max() if scale is None else scale
    assert_allclose(a, b, rtol=0, atol=ROUNDOFF * scale)


def test_the_check_of_a_reduction_is_that_of_one_process():
    records = []
    for body in pair(2):
        modes = craig_bampton(body, n_modes=4)
        records.append(cms.check_reduction(body, modes, reduce(body, modes, geometric=False)))
    assert len(records[0]) > 20
    assert [(r.name, r.verdict) for r in records[1]] == [(r.name, r.verdict) for r in records[0]]


def test_errors_are_left_out_on_ranks_and_refused_if_they_are_requested():
    _, spread = pair(2)
    with Families(spread) as families:
        modes = craig_bampton(families, n_modes=4)
        assert reduce(families, modes, geometric=False).errors is None
        with pytest.raises(BodyError, match="distributed over ranks, and errors are estimated in one process only"):
            reduce(families, modes, geometric=False, errors=True)


@pytest.mark.parametrize("size", [2, 3])
@pytest.mark.parametrize("kind", ["rigid", "distributing", "nodes"])
@pytest.mark.parametrize("frame", [cms.NodalFrame("left"), cms.TisserandFrame(), cms.reduction.BuckensFrame()])
def test_the_reduced_body_is_that_of_one_process(size, kind, frame):
    one, spread = pair(size, kind)
    sets = [craig_bampton_ir(body, n_modes=8) for body in (one, spread)]
    assert isinstance(sets[1].columns, SpreadColumns)
    a, b = (
        reduce(body, modes, frame=frame, geometric=False) for body, modes in zip((spread, one), sets[::-1], strict=True)
    )
    same(a.K, b.K)
    same(a.Phi, b.Phi)
    same(a.stress, b.stress)
    for field in fields(b.moments):
        value = getattr(b.moments, field.name)
        if isinstance(value, np.ndarray) and value.size:
            same(getattr(a.moments, field.name), value, max(np.abs(value).max(), 1.0))  # shapes have unit modal mass
    for left, right in zip(a.interfaces, b.interfaces, strict=True):
        same(left.Psi, right.Psi, np.abs(b.Phi).max() / 0.05)  # translations, and rotations over the width
    same(a.nodal_sums.U1, b.nodal_sums.U1, np.abs(b.nodal_sums.U1).max() + b.nodal_sums.w * np.abs(b.Phi).max())


@pytest.mark.parametrize("make", [craig_bampton, rubin])
def test_of_a_mode_set_nothing_stays_on_the_ranks(make):
    """Columns of fixed modes that are made there, and those that rank 0 gives away."""
    _, spread = pair(2)
    gc.collect()
    spread.M.diagonal()  # with a question ranks are told what has no name any more
    before = [set(store) for store in spread.K.ranks.stores]
    modes = make(spread, n_modes=4)
    reduced = reduce(spread, modes)
    assert len(spread.K.ranks.stores[1]) > len(before[1])
    del modes, reduced
    gc.collect()
    spread.M.layout.ask(lambda ranks: None)
    assert [set(store) for store in spread.K.ranks.stores] == before


def test_geometric_stiffness_and_cases_of_loads_are_those_of_one_process():
    made = []
    for body in pair(2):
        f = np.zeros(body.n_dof)
        f[body.i[::7]] = 1.0
        loaded = body.with_load_cases(LoadCase("pull", "force", f))
        made.append(reduce(loaded, craig_bampton(loaded, n_modes=5), quadratic=True, keep=[[0.5, 0.0, 0.0]]))
    b, a = made
    same(a.load_cases[0].h, b.load_cases[0].h)
    for field in fields(b.geometric):
        value = getattr(b.geometric, field.name)
        if isinstance(value, np.ndarray) and value.size:
            same(getattr(a.geometric, field.name), value)
    same(a.kept.rotation, b.kept.rotation)


def test_dependent_columns_are_dropped_as_by_one_process():
    """A set with columns twice goes the long way of `independent_basis`, remainders and all."""
    found = []
    for body in pair(3):
        modes = craig_bampton(body, n_modes=6)
        V = modes.columns
        twice = (
            spread_beside(V.layout, V, V[:, 12:] * 0.5)
            if isinstance(V, SpreadColumns)
            else np.hstack([V, V[:, 12:] * 0.5])
        )
        more = replace(
            modes, columns=twice, labels=(*modes.labels, *"abcdef"), groups=(*modes.groups, *"abcdef"),
            frequencies=np.concatenate([modes.frequencies, modes.frequencies[12:]]),
        )  # fmt: skip
        found.append(reduce(body, more, geometric=False))
    one, many = found
    assert many.provenance["mode set redundant"] == one.provenance["mode set redundant"] != "none"
    same(np.diag(many.K), np.diag(one.K))


@pytest.mark.parametrize("free", [True, False])
def test_matrices_under_boundary_conditions_are_those_of_one_process(free):
    """With loads of neighbours, and with some boundary dofs held."""
    found = []
    for body in pair(3):
        with Families(body) as families:
            n_h = len(families.h)
            load = np.diag(np.arange(1.0, n_h + 1.0))
            conditions = (
                BoundaryConditions(np.eye(n_h), 1e6 * load, load) if free else BoundaryConditions(np.eye(n_h)[:, :7])
            )
            flexibility = families.flexibility_under(conditions)
            i = families.fixed.i
            order = np.argsort(i) if not free else np.arange(body.n_dof)
            order = np.concatenate([order, np.arange(len(order), flexibility.n)])
            found.append([whole_matrix(A).toarray()[np.ix_(order, order)] for A in (flexibility.K, flexibility.M)])
            assert isinstance(flexibility.K, SpreadMatrix) == isinstance(body.K, SpreadMatrix)
    for one, many in zip(*found, strict=True):
        assert_allclose(many, one, rtol=0, atol=1e-14 * np.abs(one).max())


def test_a_shifted_matrix_is_that_of_one_process():
    one, spread = pair(3)
    A = spread_sum(spread.K, spread.M, -1e5)
    assert_array_equal(A.whole().toarray(), (one.K - 1e5 * one.M).toarray())


def test_columns_of_another_order_of_rows_are_refused():
    _, spread = pair(2)
    other = pair(2, "nodes")[1]
    with pytest.raises(BodyError, match="otherwise"):
        other.K @ spread_columns(spread.K.layout, np.ones((spread.n_dof, 1)))


def shell():
    """A plate with two all-node edges."""
    body = plate(n=6)
    edges = [np.flatnonzero(body.nodes[:49, 0] == x) for x in (0.0, 10.0)]
    ends = [Interface(name, "nodes", e, body.nodes[e].mean(axis=0)) for name, e in zip("ab", edges, strict=True)]
    return couple(body.with_interfaces(*ends))


@pytest.mark.parametrize("make", [shell, lambda: couple(beam()), lambda: couple(bar())])
def test_a_body_made_by_rank_0_is_reduced_on_all_ranks(make, monkeypatch):
    monkeypatch.setattr("fe_models.foundation.sparse.submatrix.FEW_DOFS", 0)  # in an order of its own
    one = make()
    spread = spread_body(one, ThreadRanks(3))
    assert (spread.K.whole() != one.K).nnz == 0
    assert (spread.M.whole() != one.M).nnz == 0
    assert spread_body(one, ThreadRanks(1)) is one
    b, a = (reduce(body, craig_bampton_ir(body, n_modes=6)) for body in (one, spread))
    same(a.K, b.K)
    same(a.Phi, b.Phi)
    same(a.moments.S_kl, b.moments.S_kl)
    if b.stress is not None:
        same(a.stress, b.stress)
