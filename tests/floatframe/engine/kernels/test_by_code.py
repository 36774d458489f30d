"""Functions that kernels choose by a code."""

import re

from floatframe.engine.kernels.joints import row_formulas
from tests.root import ROOT


def test_every_table_of_functions_has_a_name_of_its_own():
    # two of one name and types share their symbols across processes: a kept kernel then called the other table
    names = [
        name
        for path in (ROOT / "floatframe").rglob("*.py")
        for name in re.findall(r'= by_code\(\s*"(\w+)"', path.read_text())
    ]
    assert len(names) >= 5
    assert len(names) == len(set(names))
    for name in names:
        assert getattr(row_formulas, name).__name__ == name
