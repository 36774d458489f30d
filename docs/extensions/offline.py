"""The site works without a network, because a built page loads nothing from elsewhere."""

import re
from pathlib import Path
from typing import Any

from sphinx.application import Sphinx
from sphinx.errors import SphinxError

LOADED = re.compile(r"<(?:script|img|iframe|link|source)\b[^>]*?(?:src|href)=\"((?:https?:)?//[^\"]*)\"[^>]*>")
MAY_BE_LINKED = re.compile(r'rel="(?:canonical|search|author|license)"')


def check(app: Sphinx, exception: Exception | None) -> None:
    """Refuse a site that loads anything from the network."""
    if exception is not None or app.builder.format != "html":
        return
    found = []
    for path in sorted(Path(app.outdir).rglob("*.html")):
        for match in LOADED.finditer(path.read_text(encoding="utf-8")):
            if not MAY_BE_LINKED.search(match[0]):
                found.append(f"{path.relative_to(app.outdir)}: {match[1]}")
    if found:
        raise SphinxError("the site loads from the network:\n  " + "\n  ".join(found[:20]))


def setup(app: Sphinx) -> dict[str, Any]:
    """Check the site after all pages are written."""
    app.connect("build-finished", check)
    return {"parallel_read_safe": True, "parallel_write_safe": True}
