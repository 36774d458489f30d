"""Formulas as SVG, drawn at build time: pages need no script, no fonts and no network.

Every formula carries its TeX as a title and alternative text. A formula that cannot be read is a warning, which the
build of the site turns into an error.
"""

import html
import re
from functools import cache
from typing import Any

import ziamath
from docutils import nodes
from sphinx.application import Sphinx
from sphinx.util import logging
from sphinx.util.math import get_node_equation_number
from sphinx.writers.html5 import HTML5Translator

log = logging.getLogger(__name__)
LOST = (r"\mathrel", r"\mathbin", r"\mathop", r"\tilde{\ }")
INLINE_SIZE, DISPLAY_SIZE = 17.0, 18.0  #: of the letters [px]
SYMBOL = re.compile(r'<symbol id="([^"]*)"[^>]*?(?:/>|>.*?</symbol>)', re.DOTALL)
UNIT = 16.0  #: px of one em of the page


def inline(self: HTML5Translator, node: nodes.math) -> None:
    """Write a formula that stands in a line of text."""
    self.body.append(f'<span class="math">{letters_once(self, drawn(node.astext(), node, is_display=False))}</span>')
    raise nodes.SkipNode


def display(self: HTML5Translator, node: nodes.math_block) -> None:
    """Write a displayed formula, with its number if it has one."""
    self.body.append(self.starttag(node, "div", CLASS="math display"))
    if node.get("number"):
        number = get_node_equation_number(self, node)
        self.body.append(f'<span class="eqno">({number})</span>')
    self.body.append(letters_once(self, drawn(node.astext(), node, is_display=True)))
    self.body.append("</div>\n")
    raise nodes.SkipNode


def letters_once(page: HTML5Translator, picture: str) -> str:
    """Remove from a picture the glyphs that an earlier formula of the page has defined."""
    seen: set[str] = page.__dict__.setdefault("drawn_letters", set())

    def first(found: re.Match[str]) -> str:
        is_new = found[1] not in seen
        seen.add(found[1])
        return found[0] if is_new else ""

    return SYMBOL.sub(first, picture)


def drawn(tex: str, node: nodes.Node, *, is_display: bool) -> str:
    """Return the SVG of a formula; if it cannot be drawn, return its TeX and warn."""
    try:
        return svg(" ".join(tex.split()), is_display)
    # the library raises many kinds of errors, all of which mean that it did not understand the formula
    except Exception as error:
        log.warning("formula cannot be drawn (%s: %s): %s", type(error).__name__, error, tex, location=node)
        return f"<code>{html.escape(tex)}</code>"


@cache
def svg(tex: str, is_display: bool) -> str:
    """Return the SVG of a formula, with lengths in em and its baseline on the baseline of the text."""
    source = braced(tex)
    if is_display and "\\begin" not in source and "\\\\" in source:
        source = rf"\begin{{aligned}} {source} \end{{aligned}}"
    size = DISPLAY_SIZE if is_display else INLINE_SIZE
    formula = ziamath.Latex(source, size=size, inline=not is_display, color="currentColor")
    root = formula.svgxml()
    _, top, width, height = (float(x) for x in root.attrib["viewBox"].split())
    place = "" if is_display else f"; vertical-align: {-(top + height) / UNIT:.3f}em"  # the baseline is y = 0
    text = formula.svg()
    text = re.sub(r'(<svg[^>]*?) width="[^"]*" height="[^"]*"', r"\1", text, count=1)
    label = html.escape(tex, quote=True)
    style = f'style="width: {width / UNIT:.3f}em; height: {height / UNIT:.3f}em{place}" role="img" aria-label="{label}"'
    return text.replace("<svg", f"<svg {style}", 1).replace("\n", " ")


def braced(tex: str) -> str:
    """Return TeX in commands that the drawing library knows; refuse commands that it would silently omit."""
    lost = [word for word in LOST if word in tex]
    if lost:
        raise ValueError(f"{lost[0]} is omitted by the drawing library; write the formula without it")
    return tex.replace(r"\lVert", r"\|").replace(r"\rVert", r"\|")


def setup(app: Sphinx) -> dict[str, Any]:
    """Register the renderer."""
    app.add_html_math_renderer("drawn", (inline, None), (display, None))
    app.config.html_math_renderer = "drawn"
    return {"parallel_read_safe": True, "parallel_write_safe": True}
