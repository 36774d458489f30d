import pytest

from floatframe.cli import prepare
from floatframe.cli.compile_kernels import PARTS

SAYS = """
import json, sys, time
part = sys.argv[1]
began = time.time()
time.sleep(0.3)
if part == "broken": raise SystemExit("no compiler")
print("words of a library")
print(json.dumps({"compiled": part == "motion", "seconds": time.time() - began, "at": began}))
"""


@pytest.fixture(autouse=True)
def workers(monkeypatch):
    monkeypatch.setattr(prepare, "RUN", SAYS)


def test_a_part_that_needs_another_begins_when_that_is_done():
    done = prepare.prepare_parts(("relative", "motion", "reduction"), 3)
    assert list(done) == ["relative", "motion", "reduction"]
    assert done["motion"]["compiled"]
    assert not done["reduction"]["compiled"]
    assert done["relative"]["at"] >= done["motion"]["at"] + done["motion"]["seconds"]
    assert done["reduction"]["at"] < done["motion"]["at"] + done["motion"]["seconds"]  # beside it


def test_a_part_that_fails_says_why_and_leaves_the_others():
    done = prepare.prepare_parts(("broken", "motion"), 1)
    assert done["broken"] == {"failed": "no compiler"}
    assert done["motion"]["compiled"]


def test_later_parts_are_parts():
    assert {*prepare.LATER, *prepare.LATER.values()} <= set(PARTS)
