"""The campaign of verdicts: bodies that were judged wrongly."""

import pytest
from numpy.testing import assert_allclose

import cms
from cms.assessment.quality.of_body.recovery_rows import check_recovery_forces
from tests.campaign.sound_bodies import sound_body
from tests.campaign.verdicts import verdict_case


@pytest.mark.parametrize("seed", [120157, 120682])
def test_stress_that_is_rounding_alone_is_judged_alike_in_all_units(seed):
    """Rows of the middle surface of a plate, which has no stress where it bends."""
    body = sound_body(seed).reduced
    systems = ("m-kg-s", "mm-t-s", "in-slinch-s")
    found = [check_recovery_forces(cms.convert_units(body, units)).value for units in systems]
    assert max(found) < 1e-6
    assert_allclose(found, found[0], rtol=1e-6)


@pytest.mark.parametrize("seed", [120160, 120251])
def test_moments_that_depend_on_the_frame_are_said_not_to_be_compared(seed, tmp_path):
    assert verdict_case(seed, tmp_path).kind == "accepted"
