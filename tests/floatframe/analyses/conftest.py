"""Fixtures of this room."""

import pytest

import cms
from tests.cms.reduction.geometric_stiffness.examples import bar_of_beams


@pytest.fixture(scope="module")
def bar():
    coupled = cms.couple(bar_of_beams(6))
    end = coupled.interfaces[1].name
    rows = (
        cms.reduction.Rows("acceleration", at=(end,)),
        cms.reduction.Rows("interface force"),
        cms.reduction.Rows("net force", about=(0, 0, 0)),
    )
    asked = [cms.reduction.RecoveryRequest("instruments", rows=rows)]
    return cms.reduce(coupled, cms.craig_bampton(coupled, n_modes=3), recovery=asked)
