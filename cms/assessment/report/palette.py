"""Colours, symbols and dashes of the sets, distinguishable with any colour vision and in grey print."""

from dataclasses import dataclass

__all__ = ["FULL_MODEL", "Style", "style_of"]

#: after Okabe and Ito, without the yellow, which is invisible on white
COLORS = ("#0072B2", "#D55E00", "#009E73", "#CC79A7", "#E69F00", "#56B4E9", "#6B4E9B", "#7F6A3A")
SYMBOLS = ("circle", "square", "diamond", "triangle-up", "cross", "x", "triangle-down", "star")
DASHES = ("solid", "dash", "dot", "dashdot", "longdash", "longdashdot")
FULL_MODEL = "#1b1f24"  #: colour of the full model in every plot


@dataclass(frozen=True)
class Style:
    """Drawing style of a set, the same in every plot."""

    color: str
    symbol: str
    dash: str


def style_of(k: int) -> Style:
    """Return the style of the k-th set; symbol, dash and colour have different periods."""
    return Style(COLORS[k % len(COLORS)], SYMBOLS[k % len(SYMBOLS)], DASHES[k % len(DASHES)])
