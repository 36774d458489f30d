"""The sum of two mode sets: their columns side by side."""

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

import cms
from tests.bodies import bar


@pytest.fixture(scope="module")
def body():
    return cms.couple(bar(nx=3, ny=2, nz=2))


def test_the_sum_has_the_columns_of_both_sets(body):
    first, second = cms.craig_bampton(body, 3), cms.modes.normal_modes(body, 2)
    both = first + second
    assert both.name == "craig-bampton + normal"
    assert_array_equal(both.columns, np.hstack([first.columns, second.columns]))
    assert both.labels == (*first.labels, *second.labels)
    assert both.groups == (*first.groups, *second.groups)
    assert_array_equal(both.frequencies, [*first.frequencies, *second.frequencies])
    assert both.options["craig-bampton n_modes"] == "3"
    assert both.options["normal n_modes"] == "2"


def test_a_sum_has_the_options_of_every_set(body):
    """Also of two sets of one name, and of a third set; none of them is an option of the sum."""
    first, second = cms.craig_bampton(body, 3), cms.craig_bampton(body, 5)
    options = (first + second + cms.modes.normal_modes(body, 2)).options
    assert options["craig-bampton n_modes"] == "3"
    assert options["craig-bampton n_modes 2"] == "5"
    assert options["normal n_modes"] == "2"
    assert "n_modes" not in options
    assert len(options) == len(first.options) + len(second.options) + len(cms.modes.normal_modes(body, 2).options)


def test_constraint_and_free_modes_give_exact_free_frequencies(body):
    """The columns of Guyan's set alone lie above them; those of the sum span the free modes."""
    free = cms.modes.normal_modes(body, 3)
    exact = free.frequencies[~free.is_static]
    found = cms.reduce(body, cms.modes.guyan(body) + free).free_frequencies
    assert_allclose(found[:3], exact, rtol=1e-8)
    assert (cms.reduce(body, cms.modes.guyan(body)).free_frequencies[:3] > exact * (1 + 1e-6)).all()


def test_columns_that_are_there_twice_add_nothing(body):
    modes = cms.rubin(body, 2)
    twice = cms.reduce(body, modes + modes)
    once = cms.reduce(body, modes)
    assert twice.n_q == once.n_q
    assert_allclose(twice.free_frequencies, once.free_frequencies, rtol=1e-9)


def test_sets_of_different_bodies_are_refused(body):
    with pytest.raises(cms.errors.ModeSetError, match=r"guyan \+ guyan: expected mode sets of one body"):
        _ = cms.modes.guyan(body) + cms.modes.guyan(cms.couple(bar(nx=4)))


def test_every_node_can_be_kept(body):
    assert len(cms.reduce(body, cms.modes.guyan(body), keep="all").nodes) == len(body.nodes)
    assert len(cms.reduce(body, cms.modes.guyan(body)).nodes) < len(body.nodes)
