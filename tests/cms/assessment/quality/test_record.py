import json
import math

import numpy as np
import pytest

from cms.assessment.quality.errors import QualityError
from cms.assessment.quality.limits import LIMITS
from cms.assessment.quality.record import has_failed, information, judge, plain, worst


def test_a_value_at_its_tolerance_passes_and_between_both_limits_warns():
    limit = LIMITS["frequency-error"]
    assert judge("frequency-error", limit.tolerance, "").verdict == "pass"
    assert judge("frequency-error", math.nextafter(limit.tolerance, 1), "").verdict == "warn"
    assert judge("frequency-error", limit.failing, "").verdict == "warn"
    assert judge("frequency-error", math.nextafter(limit.failing, 1), "").verdict == "fail"


@pytest.mark.parametrize("value", [math.nan, math.inf])
def test_a_value_that_is_no_number_fails(value):
    assert judge("frequency-error", value, "").verdict == "fail"


def test_without_a_failing_limit_the_worst_is_a_warning():
    assert judge("effective-mass", 1e9, "").verdict == "warn"


def test_only_records_that_do_not_pass_ask_for_an_action():
    assert judge("symmetry", 0.0, "").action == ""
    assert judge("symmetry", 1.0, "").action == LIMITS["symmetry"].action
    assert judge("symmetry", 1.0, "", action="do this").action == "do this"


@pytest.mark.parametrize("name", LIMITS)
def test_every_limit_that_judges_says_what_to_do(name):
    limit = LIMITS[name]
    assert limit.tolerance is None or limit.action
    assert limit.failing is None or limit.failing >= limit.tolerance


def test_an_unknown_name_is_refused_with_the_nearest():
    with pytest.raises(QualityError, match=r"frequency-eror.*did you mean 'frequency-error'"):
        judge("frequency-eror", 0.0, "")


def test_the_worst_verdict_counts():
    good, warned, failed = judge("mac", 0.0, ""), judge("mac", 0.1, ""), judge("mac", 1.0, "")
    note = information("mac", "not asked")
    assert worst([note, good, warned]) == "warn"
    assert not has_failed([note, good, warned])
    assert has_failed([good, failed, warned])
    assert worst([]) == "info"


def test_records_survive_json():
    data = {"a": np.arange(3.0), "b": [np.nan, np.int64(2)], "c": {"d": np.array([1 + 2j])}, "e": ("x", "y")}
    text = json.dumps(judge("mac", 0.5, "why", data).as_dict(), allow_nan=False)
    back = json.loads(text)
    assert back["data"] == {
        "a": [0.0, 1.0, 2.0], "b": [None, 2], "c": {"d": {"real": [1.0], "imag": [2.0]}}, "e": ["x", "y"]
    }  # fmt: skip
    assert (back["value"], back["verdict"], back["reason"]) == (0.5, "fail", "why")
    assert plain(np.float64(np.inf)) is None
