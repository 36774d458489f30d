"""Formatting of numbers and dates in reports."""

import math

from cms.assessment.quality.numbers import factor, share

__all__ = ["MINUS", "count", "factor", "hertz", "seconds", "share", "signed_percent"]

MINUS = "\u2212"


def hertz(value: float) -> str:
    """Return a frequency with five digits [Hz]."""
    return f"{value:.5g}" if math.isfinite(value) else "\u2013"


def signed_percent(value: float) -> str:
    """Return an error with its sign; '–' if it is missing, '0' if it is within rounding."""
    if not math.isfinite(value):
        return "\u2013"
    if abs(value) < 5e-7:
        return "0 %"
    text = f"{100 * value:+.2g}" if abs(value) < 0.0995 else f"{100 * value:+.0f}"
    if "e" in text:
        text = f"{100 * value:+.5f}".rstrip("0")
    return f"{text.replace('-', MINUS)} %"


def count(value: int) -> str:
    """Return an integer with its digits in groups of three."""
    return f"{value:,}".replace(",", "\u202f")


def seconds(value: float) -> str:
    """Return a duration as text."""
    return f"{value:.2g} s" if value < 9.95 else f"{value:.0f} s"
