"""The example of docs/sensitivities.md runs as it stands there."""

import re

from tests.root import ROOT


def test_the_example_of_the_page_runs():
    text = (ROOT / "docs" / "sensitivities.md").read_text(encoding="utf-8")
    block = re.search(r"<!-- sensitivities -->\n```python\n(.*?)```", text, re.DOTALL)
    exec(compile(block[1], "sensitivities.md", "exec"), {})
