"""Units of signals in files ("m/s^2", "g", "kN", "deg", "rpm"), and the factors between them.

"g" is the standard gravity, 9.80665 m/s², if it is alone or combined with times, frequencies and volts (g²/Hz, mV/g).
In other combinations it could be the gram, and is not understood. kg is a separate unit.
"""

import re
from dataclasses import dataclass
from math import log10, pi

from fe_models.foundation.units import Units
from fe_models.foundation.words import quoted
from floatframe.errors import SignalError

__all__ = ["STANDARD_GRAVITY", "SignalUnit", "parsed_unit", "per_hertz", "signal_unit", "system_factor", "unit_factor"]

STANDARD_GRAVITY = 9.80665  #: standard gravity [m/s²]
LONGEST = 40  #: largest number of characters of a unit
DEEPEST = 9  #: largest exponent

Exponents = tuple[int, int, int, int, int]  #: exponents of length, mass, time, angle, voltage


@dataclass(frozen=True)
class SignalUnit:
    """A unit: its value in SI units and the exponents of length, mass, time, angle and voltage."""

    factor: float
    exponents: Exponents

    def __mul__(self, other: "SignalUnit") -> "SignalUnit":
        a, b, c, d, e = (x + y for x, y in zip(self.exponents, other.exponents, strict=True))
        return SignalUnit(self.factor * other.factor, (a, b, c, d, e))

    def __pow__(self, n: int) -> "SignalUnit":
        a, b, c, d, e = (n * x for x in self.exponents)
        return SignalUnit(self.factor**n, (a, b, c, d, e))

    @property
    def quantity(self) -> str:
        """The measured quantity: "length", "acceleration", "angle", "force", ...; "other" if it has no name here."""
        return QUANTITIES.get(self.exponents, "other")


QUANTITIES: dict[Exponents, str] = {
    (0, 0, 0, 0, 0): "number",
    (0, 0, 1, 0, 0): "time",
    (0, 0, -1, 0, 0): "frequency",
    (1, 0, 0, 0, 0): "length",
    (1, 0, -1, 0, 0): "velocity",
    (1, 0, -2, 0, 0): "acceleration",
    (0, 0, 0, 1, 0): "angle",
    (0, 0, -1, 1, 0): "angular velocity",
    (0, 0, -2, 1, 0): "angular acceleration",
    (0, 1, 0, 0, 0): "mass",
    (1, 1, -2, 0, 0): "force",
    (2, 1, -2, 0, 0): "moment",
    (-1, 1, -2, 0, 0): "stress",
    (2, 1, -3, 0, 0): "power",
    (0, 0, 0, 0, 1): "voltage",
}


def base(factor: float, length: int = 0, mass: int = 0, time: int = 0, angle: int = 0, voltage: int = 0) -> SignalUnit:
    """Return a unit from its exponents."""
    return SignalUnit(factor, (length, mass, time, angle, voltage))


POUND_FORCE = 4.4482216152605  #: one pound-force [N]
PLAIN = {  # units that take no prefix
    "": base(1.0), "1": base(1.0), "-": base(1.0), "%": base(0.01),
    "kg": base(1.0, mass=1), "t": base(1e3, mass=1), "lb": base(0.45359237, mass=1), "lbm": base(0.45359237, mass=1),
    "slinch": base(POUND_FORCE / 0.0254, mass=1), "slug": base(POUND_FORCE / 0.3048, mass=1),
    "in": base(0.0254, 1), "inch": base(0.0254, 1), '"': base(0.0254, 1), "ft": base(0.3048, 1),
    "mil": base(2.54e-5, 1), "g": base(STANDARD_GRAVITY, 1, time=-2),
    "G": base(STANDARD_GRAVITY, 1, time=-2), "gn": base(STANDARD_GRAVITY, 1, time=-2),
    "g_n": base(STANDARD_GRAVITY, 1, time=-2),
    "sec": base(1.0, time=1), "min": base(60.0, time=1), "h": base(3600.0, time=1),
    "deg": base(pi / 180, angle=1), "°": base(pi / 180, angle=1), "degrees": base(pi / 180, angle=1),
    "rev": base(2 * pi, angle=1), "turn": base(2 * pi, angle=1),
    "rpm": base(2 * pi / 60, time=-1, angle=1), "RPM": base(2 * pi / 60, time=-1, angle=1),
    "kph": base(1 / 3.6, 1, time=-1), "kmh": base(1 / 3.6, 1, time=-1), "mph": base(0.44704, 1, time=-1),
    "lbf": base(POUND_FORCE, 1, 1, -2), "dyn": base(1e-5, 1, 1, -2), "kgf": base(STANDARD_GRAVITY, 1, 1, -2),
    "psi": base(POUND_FORCE / 0.0254**2, -1, 1, -2), "ksi": base(1e3 * POUND_FORCE / 0.0254**2, -1, 1, -2),
    "psf": base(POUND_FORCE / 0.3048**2, -1, 1, -2),
    "Nmm": base(1e-3, 2, 1, -2), "strain": base(1.0), "microstrain": base(1e-6), "ustrain": base(1e-6),
    "µε": base(1e-6), "ue": base(1e-6), "uE": base(1e-6),
}  # fmt: skip
WITH_PREFIX = {
    "m": base(1.0, 1), "s": base(1.0, time=1), "N": base(1.0, 1, 1, -2), "Pa": base(1.0, -1, 1, -2),
    "J": base(1.0, 2, 1, -2), "W": base(1.0, 2, 1, -3), "Nm": base(1.0, 2, 1, -2), "Hz": base(1.0, time=-1),
    "rad": base(1.0, angle=1), "V": base(1.0, voltage=1), "bar": base(1e5, -1, 1, -2),
}  # fmt: skip
GRAVITY = {"g", "G", "gn", "g_n"}
BESIDE_GRAVITY = {"s", "ms", "sec", "min", "Hz", "kHz", "V", "mV"}
PREFIXES = {"n": 1e-9, "u": 1e-6, "µ": 1e-6, "m": 1e-3, "c": 1e-2, "d": 1e-1, "k": 1e3, "M": 1e6, "G": 1e9}
# a word consists of letters (and _) without digits
TOKEN = re.compile(r"\s*(\^?[+-]?\d+|[()/*·.]|\^|[^\W\d]+|[%°\"-])")
SUPERSCRIPTS = str.maketrans({"²": "^2", "³": "^3", "⁴": "^4", "⁻": "^-", "μ": "µ"})


def parsed_unit(text: str) -> SignalUnit | None:
    """Return the unit of a text; None if it is unknown."""
    text = text.strip().strip("[]").strip()
    if text in PLAIN:
        return PLAIN[text]
    text = text.replace("**", "^").translate(SUPERSCRIPTS).replace("^-^", "^-")
    tokens, at = [], 0
    while at < len(text.rstrip()):
        found = TOKEN.match(text, at)
        if found is None or len(text) > LONGEST:
            return None
        tokens.append(found[1])
        at = found.end()
    words = {token for token in tokens if token[0].isalpha()}
    if words & GRAVITY and not words <= GRAVITY | BESIDE_GRAVITY:
        return None
    try:
        unit, left = product(tokens)
    except (KeyError, IndexError, ValueError):
        return None
    return unit if not left and unit.factor > 0 and abs(log10(unit.factor)) < 30 else None


def product(tokens: list[str]) -> tuple[SignalUnit, list[str]]:
    """Return a product of units up to a closing bracket or the end, and the remaining tokens."""
    unit, is_below = base(1.0), False
    while tokens and tokens[0] != ")":
        if tokens[0] in ("*", "·", "."):
            is_below, tokens = False, tokens[1:]
            continue
        if tokens[0] == "/":
            is_below, tokens = True, tokens[1:]
        if tokens[0] == "(":
            factor, tokens = product(tokens[1:])
            if tokens[0] != ")":
                raise ValueError("a bracket is not closed")
            tokens = tokens[1:]
        else:
            factor, tokens = symbol(tokens[0]), tokens[1:]
        if tokens and tokens[0] == "^":
            tokens = tokens[1:]
            exponent, tokens = int(tokens[0]), tokens[1:]
        elif tokens and re.fullmatch(r"\^?[+-]?\d+", tokens[0]):
            exponent, tokens = int(tokens[0].lstrip("^")), tokens[1:]
        else:
            exponent = 1
        if abs(exponent) > DEEPEST:
            raise ValueError("an exponent is too great")
        unit = unit * factor ** (-exponent if is_below else exponent)
        is_below = False
    return unit, tokens


def symbol(word: str) -> SignalUnit:
    """Return the unit of a word; `KeyError` if there is none."""
    if word in PLAIN:
        return PLAIN[word]
    if word in WITH_PREFIX:
        return WITH_PREFIX[word]
    return base(PREFIXES[word[0]]) * WITH_PREFIX[word[1:]]


def signal_unit(text: str, where: str) -> SignalUnit:
    """Return the unit of a text.

    Raises
    ------
    SignalError
        If it is not understood.
    """
    unit = parsed_unit(text)
    if unit is None:
        raise SignalError(
            f"{where}: unit {quoted(text)} is not understood; expected products of units such as m/s^2, g (standard "
            "gravity), mm, kN, N m, MPa, deg, rpm, V, % or - (a number)"
        )
    return unit


def unit_factor(unit: str, wanted: str, where: str = "unit") -> float:
    """Return the factor from numbers in a unit to numbers in another one: 9.80665 from "g" to "m/s^2".

    Raises
    ------
    SignalError
        If one of them is not understood, or they measure different things.
    """
    a, b = signal_unit(unit, where), signal_unit(wanted, where)
    if a.exponents != b.exponents:
        raise SignalError(
            f"{where}: {unit or 'a plain number'} ({a.quantity}) cannot be converted to {wanted or 'a plain number'} "
            f"({b.quantity})"
        )
    return a.factor / b.factor


def system_factor(unit: str, units: Units, where: str = "unit") -> float:
    """Return the factor from numbers in a unit to a unit system (angles in rad)."""
    found = signal_unit(unit, where)
    length, mass, time, _, _ = found.exponents
    return found.factor / units.to_si(length=length, mass=mass, time=time)


def per_hertz(unit: str) -> str:
    """Return the unit of a spectral density: "(m/s²)²/Hz" for "m/s²"."""
    is_word = re.fullmatch(r"[^\W\d]*", unit) is not None
    return f"{unit}²/Hz" if unit and is_word else "1/Hz" if unit in ("", "-", "1") else f"({unit})²/Hz"
