"""Mutants: what counts as a line of physics, which tests judge a change, and what becomes of it."""

import textwrap
from pathlib import Path

import pytest

from tests import mutants
from tests.mutants import WINGS, Bench, Changes, draw
from tests.root import ROOT

SOURCE = '''
RADIUS = 2 * 3.0  # not in a function
SAME = 1e-9

def spring(path, x, k, c, parts, n=3 + 1):
    """Return a force: 2 * 3."""
    if x - n > 0.5 * k:
        raise ValueError("too long: " + str(x + 1))
    tolerance = 1e-9 * abs(k)
    close = abs(x - n) < rounding_of(x - n)
    same = abs(x - n) < SAME * x
    name = path / "spring" + ".txt"
    log.info("work", k * x)
    both = parts + [k]
    index = parts[3]
    force = -k * x[1] + 1.5 * c
    force += x**2
    return force if c - k else A.T @ force

def description(k):
    return round(100 * k)
'''
LINES = {
    "force = -k * x[1] + 1.5 * c": {
        "force = ((-k * x[1]) - (1.5 * c))",
        "force = (-k * x[1])",
        "force = ((-k) / (x[1])) + 1.5 * c",
        "force = (k) * x[1] + 1.5 * c",
        "force = -k * x[0] + 1.5 * c",
        "force = -k * x[1] + ((1.5) / (c))",
        "force = -k * x[1] + 1.6500000000000001 * c",
    },
    "force += x**2": {"force -= x**2", "force += ((x) ** ((2) + 1))", "force += x**3"},
    "return force if c - k else A.T @ force": {
        "return force if ((c) + (k)) else A.T @ force",
        "return force if (c) else A.T @ force",
        "return force if c - k else (-((A.T) @ (force)))",
    },
}


def test_lines_of_physics_are_arithmetic_without_messages_checks_defaults_and_tolerances(tmp_path):
    (path := tmp_path / "spring.py").write_text(SOURCE)
    lines = SOURCE.splitlines()
    found = {
        lines[n - 1].strip(): {change.text().splitlines()[n - 1].strip() for change in changes}
        for n, changes in Changes(path).found.items()
    }
    assert found == LINES


def test_mutants_of_a_seed_are_the_same_and_change_one_line_that_still_parses():
    wings = ("signals", "recovery")
    assert [str(mutant) for _, mutant in draw(8, 5, wings)] == [str(mutant) for _, mutant in draw(8, 5, wings)]
    for wing, mutant in draw(8, 5, wings):
        old, new = mutant.path.read_text().splitlines(), mutant.text().splitlines()
        assert [n for n, (a, b) in enumerate(zip(old, new, strict=True), start=1) if a != b] == [mutant.line]
        compile(mutant.text(), "mutant", "exec")
        assert str(mutant.path.relative_to(ROOT)).startswith(WINGS[wing])


@pytest.mark.parametrize(
    ("test", "kind"),
    [
        ("assert double(3) == 6", "caught"),
        ("assert double(0) == 0", "survived"),
        ("assert double(3) == 7", "unsound"),
        ("time.sleep(60)", "survived"),
    ],
)
def test_a_mutant_is_caught_by_a_test_that_passes_without_it(tmp_path, monkeypatch, test, kind):
    room = Path("floatframe/components")
    (tmp_path / "clean" / room).mkdir(parents=True)
    path = tmp_path / "clean" / room / "law.py"
    path.write_text("def double(x):\n    return 2 * x\n")
    text = f"import time\nfrom law import double\ndef test_it():\n    {test}\n"
    (tmp_path / "clean" / "test_law.py").write_text(textwrap.dedent(text))
    (tmp_path / "clean" / "conftest.py").write_text(f"import sys\nsys.path.insert(0, {str(room)!r})\n")
    (tmp_path / "clean" / "pytest.ini").write_text("[pytest]\n")
    monkeypatch.setattr(mutants, "ROOT", tmp_path / "clean")
    monkeypatch.setattr(mutants, "guarding_files", lambda path, n_files: ["test_law.py"])
    monkeypatch.setattr(mutants, "LIMIT", 3.0 if "sleep" in test else 300.0)
    (mutant,) = (change for change in Changes(path).found[2] if change.new == "3")
    told = Bench(tmp_path / "clean", {}).judge(mutant, 1)
    assert told[0] == kind
    assert str(mutant) == "floatframe/components/law.py:2\n  - return 2 * x\n  + return 3 * x"
