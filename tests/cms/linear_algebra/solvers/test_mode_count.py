import numpy as np
import pytest

from cms.errors import ModeSetError
from cms.linear_algebra.solvers.mode_count import ModeCount, mode_count


def test_a_number_is_a_count_of_modes():
    assert mode_count(np.int64(3)) == ModeCount(3)
    assert mode_count(ModeCount(cutoff=2.0)) == ModeCount(cutoff=2.0)


@pytest.mark.parametrize(
    ("given", "message"),
    [
        ({}, "expected either a number or a cutoff, got n = None, cutoff = None"),
        ({"n": 3, "cutoff": 1.0}, "expected either a number or a cutoff, got n = 3, cutoff = 1.0"),
        ({"n": -1}, "n_modes = -1: expected 0 or more"),
        ({"n": 2.5}, r"n_modes = 2.5: expected a whole number, or ModeCount\(cutoff=...\) for a frequency"),
        ({"cutoff": 0.0}, "cutoff = 0.0: expected a finite frequency above 0"),
        ({"cutoff": np.nan}, "cutoff = nan: expected a finite frequency above 0"),
        ({"cutoff": np.inf}, "cutoff = inf: expected a finite frequency above 0"),
    ],
)
def test_what_is_no_count_is_refused(given, message):
    with pytest.raises(ModeSetError, match=message):
        ModeCount(**given)
