"""Dimensionless numbers as text for sentences, tables and reports: percent, or powers of ten."""

import math

__all__ = ["factor", "number", "share", "superscript"]


def number(value: float | None) -> str:
    """Return a value with three digits; "" if there is none."""
    return "" if value is None or not math.isfinite(value) else f"{value:.3g}"


def share(value: float) -> str:
    """Return a number as percent, or as a power of ten if it is small; a dash if it is missing."""
    if math.isnan(value):
        return "\u2013"
    if math.isinf(value):
        return "missing"
    if value == 0:
        return "0"
    if abs(value) >= 9.995:
        return factor(value) if value > 0 else f"{value:.3g}"
    if abs(value) >= 1e-4:
        return f"{100 * value:.2g} %" if abs(value) < 0.0995 else f"{100 * value:.0f} %"
    mantissa, exponent = f"{value:.0e}".split("e")
    return f"{mantissa}\u00b710{superscript(int(exponent))}"


def factor(value: float) -> str:
    """Return a number above 1 with two digits, or as a power of ten if it is large."""
    if not math.isfinite(value):
        return "\u221e"
    if value < 995:
        return f"{value:.3g}"
    mantissa, exponent = f"{value:.1e}".split("e")
    return f"{mantissa}\u00b710{superscript(int(exponent))}"


def superscript(value: int) -> str:
    """Return a number in superscript digits."""
    return str(value).translate(
        str.maketrans("-0123456789", "\u207b\u2070\u00b9\u00b2\u00b3\u2074\u2075\u2076\u2077\u2078\u2079")
    )
