"""The example of docs/equations.md runs as it stands there."""

import re

from tests.root import ROOT


def test_the_example_of_the_page_runs(capsys):
    text = (ROOT / "docs" / "equations.md").read_text(encoding="utf-8")
    block = re.search(r"<!-- open-equations -->\n```python\n(.*?)```", text, re.DOTALL)
    exec(compile(block[1], "equations.md", "exec"), {})
    assert "rod omega z" in capsys.readouterr().out
