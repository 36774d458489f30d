"""Conversion of text written for readers of the source into text for the site.

Names of pages in code marks become links to them, in pages and in docstrings. The remark with the name of a file before
a block of code becomes its caption. Docstrings hold plain formulas (`|x|`, `q_`, `a*b`), in which reStructuredText
would see marks of its own: those are escaped.
"""

import re
from pathlib import Path
from typing import Any

from sphinx.application import Sphinx

PAGE = re.compile(r"`(?:docs/)?(\w+)\.md`")
SECTION = re.compile(r"(?:docs/)?(\w+)\.md")
FILE = re.compile(r"^<!-- (?:file: )?([\w/]+\.\w+) -->\n```(\w+)\n(.*?)^```$", re.DOTALL | re.MULTILINE)
MARKS = re.compile(r"(?<!\\)([*|])|(?<=\w)_(?=[^\w]|$)")


def pages_linked(app: Sphinx, docname: str, content: list[str]) -> None:
    """Turn the name of a page in code marks into a link, where there is such a page."""
    folder = Path(app.srcdir)

    def link(found: re.Match[str]) -> str:
        name = found[1]
        there = "../" * docname.count("/")
        return f"[{name}]({there}{name}.md)" if (folder / f"{name}.md").exists() else found[0]

    if not docname.startswith(("api/", "notebooks/")):
        content[0] = PAGE.sub(link, content[0])


def files_named(app: Sphinx, docname: str, content: list[str]) -> None:
    """Show the name of the file above a block of code that a reader saves."""
    content[0] = FILE.sub(r'```{code-block} \2\n:caption: "`\1`"\n\n\3```', content[0])


def docstring_escaped(app: Sphinx, what: str, name: str, thing: object, options: object, lines: list[str]) -> None:
    """Escape marks outside code marks and doctests; turn names of pages into links."""
    folder = Path(app.srcdir)
    for k, line in enumerate(lines):
        if line.lstrip().startswith((">>>", "...", "..", ":", "+--", "===")):
            continue
        pieces = re.split(r"(``.*?``|`[^`]*`_?|\*\*[^*]+\*\*|\[\d+\]_)", line)
        pieces[::2] = [MARKS.sub(lambda m: "\\" + m[0], piece) for piece in pieces[::2]]
        text = "".join(pieces)
        lines[k] = SECTION.sub(lambda m: f":doc:`{m[1]} </{m[1]}>`" if (folder / f"{m[1]}.md").exists() else m[0], text)


def setup(app: Sphinx) -> dict[str, Any]:
    """Register the handlers for reading pages and, after numpydoc, docstrings."""
    app.connect("source-read", pages_linked, priority=600)
    app.connect("source-read", files_named, priority=600)
    app.connect("autodoc-process-docstring", docstring_escaped, priority=600)
    return {"parallel_read_safe": True, "parallel_write_safe": True}
