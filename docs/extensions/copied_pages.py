"""Pages whose sources are outside this folder: notebooks as they are stored, and files in the top folder."""

import json
import re
from pathlib import Path
from typing import Any

from sphinx.application import Sphinx

ROOT = Path(__file__).resolve().parents[2]
TOP = {"CONTRIBUTING.md": "contributing.md", "CHANGELOG.md": "changelog.md", "benchmarks/README.md": "benchmarks.md"}
PYTHON = {"language_info": {"name": "python", "pygments_lexer": "ipython3"}}  #: stored notebooks have no such field


def copy_pages(app: Sphinx) -> None:
    """Copy changed pages; a copy whose source no longer exists is removed."""
    folder = Path(app.srcdir) / "notebooks"
    folder.mkdir(exist_ok=True)
    sources = {path.name: path for path in (ROOT / "notebooks").glob("*.ipynb")}
    for old in folder.glob("*.ipynb"):
        if old.name not in sources:
            old.unlink()
    for name, path in sources.items():
        notebook = json.loads(path.read_text(encoding="utf-8"))
        put(json.dumps(notebook | {"metadata": notebook["metadata"] | PYTHON}), folder / name)
    project = Path(app.srcdir) / "project"
    project.mkdir(exist_ok=True)
    for name, copied in TOP.items():
        put((ROOT / name).read_text(encoding="utf-8"), project / copied)


def put(text: str, target: Path) -> None:
    """Write a copy if it differs, so that an unchanged page is not read again."""
    if not target.exists() or target.read_text(encoding="utf-8") != text:
        target.write_text(text, encoding="utf-8")


def links_in_place(app: Sphinx, docname: str, content: list[str]) -> None:
    """Change links of copied pages, which are those of the checkout, to the pages of the site."""
    if docname.startswith(("project/", "notebooks/")):
        content[0] = re.sub(r"\]\((\.\./)?docs/", "](../", content[0])


def setup(app: Sphinx) -> dict[str, Any]:
    """Copy the pages before Sphinx looks for its sources."""
    app.connect("builder-inited", copy_pages, priority=400)
    app.connect("source-read", links_in_place)
    return {"parallel_read_safe": True, "parallel_write_safe": True}
