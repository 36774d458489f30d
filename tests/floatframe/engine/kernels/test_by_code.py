"""Functions that kernels choose by a code."""

import re

from tests.root import ROOT


def test_every_table_of_functions_has_a_name_of_its_own():
    # two of one name and types share their symbols across processes: a kept kernel then called the other table
    texts = [path.read_text() for path in (ROOT / "floatframe").rglob("*.py")]
    tables = [pair for text in texts for pair in re.findall(r'^(\w+) = by_code\(\s*"(\w+)"', text, re.MULTILINE)]
    assert len(tables) == sum(len(re.findall(r"(?<!def )\bby_code\(", text)) for text in texts)
    assert len(tables) >= 6
    assert all(variable == name for variable, name in tables)
    assert len({name for _, name in tables}) == len(tables)
