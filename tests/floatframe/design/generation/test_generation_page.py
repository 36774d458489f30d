"""The example of docs/generation.md."""

import re
from pathlib import Path


def test_the_example_of_the_page_runs():
    text = (Path(__file__).parents[4] / "docs" / "generation.md").read_text()
    block = re.search(r"<!-- generated-arm -->\n```python\n(.*?)```", text, re.DOTALL)
    assert block is not None
    exec(compile(block.group(1), "generation.md", "exec"), {})
