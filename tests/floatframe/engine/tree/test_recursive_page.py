"""The example of docs/recursive.md."""

import re
from pathlib import Path


def test_the_example_of_the_page_runs():
    text = (Path(__file__).parents[4] / "docs" / "recursive.md").read_text()
    block = re.search(r"<!-- relative-model -->\n```python\n(.*?)```", text, re.DOTALL)
    assert block is not None
    exec(compile(block.group(1), "recursive.md", "exec"), {})
