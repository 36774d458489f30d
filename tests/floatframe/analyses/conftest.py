"""Fixtures of this room."""

import pytest

import cms
from tests.cms.reduction.geometric_stiffness.examples import bar_of_beams


@pytest.fixture(scope="module")
def bar():
    coupled = cms.couple(bar_of_beams(6))
    end = coupled.interfaces[1].name
    rows = (cms.Rows("acceleration", at=(end,)), cms.Rows("interface force"), cms.Rows("net force", about=(0, 0, 0)))
    asked = [cms.RecoveryRequest("instruments", rows=rows)]
    return cms.reduce(coupled, cms.craig_bampton(coupled, n_modes=3), recovery=asked)
