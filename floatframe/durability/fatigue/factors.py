"""Factors on the amplitudes of S-N curves by published formulas: roughness, size, scatter.

Tests are of small polished specimens; a part is rough and large. Each formula is one of a guideline or textbook, with
the range that it was made for; beyond it is refused. They are of the fatigue limit: on a whole curve they are on the
safe side at few cycles.
"""

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass

from fe_models.foundation.words import nearest, quoted
from floatframe.durability.fatigue.sn_curve import normal_quantile
from floatframe.errors import FatigueError

__all__ = [
    "FACTOR_METHODS",
    "FactorMethod",
    "reliability_factor",
    "roughness_factor",
    "size_factor",
    "technological_size_factor",
]

#: a_R and smallest tensile strength [MPa] in the roughness factor, by group of materials (FKM guideline)
ROUGHNESS = {
    "steel": (0.22, 400.0), "cast-steel": (0.20, 400.0), "nodular-iron": (0.16, 400.0),
    "malleable-iron": (0.12, 350.0), "grey-iron": (0.06, 100.0), "wrought-aluminium": (0.22, 133.0),
    "cast-aluminium": (0.20, 133.0),
}  # fmt: skip
#: diameter d_N [mm] of the standardised strength, and a_d, by group of steels (FKM guideline)
TECHNOLOGY = {
    "structural-steel": (40.0, 0.15), "quenched-steel": (16.0, 0.3), "normalised-steel": (16.0, 0.1),
    "case-hardened-steel": (11.0, 0.5), "nitrided-steel": (100.0, 0.2), "cast-steel": (100.0, 0.15),
}  # fmt: skip
SMALLEST_TESTED = 7.5  #: diameter below which the technological factor is that of test specimens [mm]
LARGEST_DIAMETER = 250.0  #: largest diameter of the technological factor [mm]; larger diameters have the same factor
ROUGHEST = 500.0  #: largest plausible Rz [um]; larger values probably have another unit
DEVIATION = 0.08  #: standard deviation of fatigue limits, relative to their mean
Number = float | str | None


def roughness_factor(tensile_strength: float, roughness: float, group: str = "steel") -> float:
    """Return K_R = 1 - a_R lg Rz lg(2 R_m / R_m,N,min), at most 1, for normal stress (FKM guideline, FKM (2012)).

    Parameters
    ----------
    tensile_strength
        R_m [MPa].
    roughness
        R_z [um]: polished up to 1, ground some 10, machined up to 100, rolled and cast 200.
    group
        One of `ROUGHNESS`.

    Raises
    ------
    FatigueError
        If the group is unknown, or a number is out of range.
    """
    a_R, least = of_group("roughness factor", group, ROUGHNESS)
    if not 0 <= roughness <= ROUGHEST:
        raise FatigueError(
            f"roughness factor: Rz: expected 0 to {ROUGHEST:g} micrometres, got {roughness:g}; give it in micrometres"
        )
    if not least / 2 <= tensile_strength <= 3000:
        raise FatigueError(
            f"roughness factor: tensile strength: expected {least / 2:g} to 3000 MPa of {group}, got "
            f"{tensile_strength:g}; look at its unit"
        )
    return 1.0 if roughness <= 1 else 1 - a_R * math.log10(roughness) * math.log10(2 * tensile_strength / least)


def technological_size_factor(diameter: float, group: str) -> float:
    """Return K_d = F(d)/F(d_N) for d > d_N, else 1; F(d) = 1 - 0.7686 a_d lg(d/7.5 mm) (FKM (2012)).

    For strengths that a standard gives for semi-finished products up to the diameter d_N; a strength measured on the
    part needs none.

    Parameters
    ----------
    diameter
        Effective diameter of the semi-finished product [mm]; above 250 mm the factor is that of 250 mm.
    group
        One of `TECHNOLOGY`.

    Raises
    ------
    FatigueError
        If the group is unknown, or the diameter not above 0.
    """
    standard, a_d = of_group("technological size factor", group, TECHNOLOGY)
    if not 0 < diameter < 1e5:
        raise FatigueError(f"technological size factor: diameter: expected a number above 0 [mm], got {diameter:g}")

    def strength(d: float) -> float:
        return 1 - 0.7686 * a_d * math.log10(max(d, SMALLEST_TESTED) / SMALLEST_TESTED)

    return 1.0 if diameter <= standard else strength(min(diameter, LARGEST_DIAMETER)) / strength(standard)


def size_factor(diameter: float) -> float:
    """Return k_b of round bars in bending or torsion: (d/7.62)^-0.107 up to 51 mm, 1.51 d^-0.157 beyond.

    Eq. 6-20 of Budynas & Nisbett (2011). Of bars under tension it is 1. Where
    stress gradients are counted otherwise this counts them again.

    Parameters
    ----------
    diameter
        [mm], 2.79 to 254; of a round that rotates in its bending.

    Raises
    ------
    FatigueError
        If the diameter is out of range.
    """
    if not 2.79 <= diameter <= 254:
        raise FatigueError(f"size factor: diameter: expected 2.79 to 254 mm, got {diameter:g}")
    return (diameter / 7.62) ** -0.107 if diameter <= 51 else 1.51 * diameter**-0.157


def reliability_factor(survival: float) -> float:
    """Return k_e = 1 - 0.08 z, because fatigue limits scatter by 8 % of their mean (Budynas & Nisbett (2011)).

    Parameters
    ----------
    survival
        Probability, 0.5 to below 1, that z is the quantile of.

    Raises
    ------
    FatigueError
        If it is out of range.
    """
    if not 0.5 <= survival <= 1 - 1e-9:
        raise FatigueError(f"reliability factor: survival: expected 0.5 to below 1, got {survival:g}")
    return 1 - DEVIATION * normal_quantile(survival)


def of_group(what: str, group: str, known: Mapping[str, tuple[float, float]]) -> tuple[float, float]:
    """Return the parameters of a group of materials."""
    if group not in known:
        raise FatigueError(f"{what}: unknown group {quoted(group)}{nearest(group, known)}")
    return known[group]


@dataclass(frozen=True)
class FactorMethod:
    """A formula of the fatigue file."""

    description: str
    needs: tuple[str, ...]  #: keys beside the method
    needs_strength: bool
    value: Callable[[Mapping[str, Number], float], float]  #: of the keys and the tensile strength [MPa]


#: formulas by name
FACTOR_METHODS: dict[str, FactorMethod] = {
    "fkm-roughness": FactorMethod(
        "K_R = 1 - a_R lg Rz lg(2 Rm/Rm,min)", ("roughness", "group"), True,
        lambda given, R_m: roughness_factor(R_m, number(given, "roughness"), word(given, "group")),
    ),
    "fkm-size": FactorMethod(
        "K_d = F(d)/F(d_N)", ("diameter", "group"), False,
        lambda given, _: technological_size_factor(number(given, "diameter"), word(given, "group")),
    ),
    "shigley-size": FactorMethod(
        "k_b of rounds in bending and torsion", ("diameter",), False,
        lambda given, _: size_factor(number(given, "diameter")),
    ),
    "shigley-reliability": FactorMethod(
        "k_e = 1 - 0.08 z", ("survival",), False, lambda given, _: reliability_factor(number(given, "survival")),
    ),
}  # fmt: skip


def number(given: Mapping[str, Number], key: str) -> float:
    """Return a number that the method needs."""
    value = given[key]
    assert isinstance(value, float)
    return value


def word(given: Mapping[str, Number], key: str) -> str:
    """Return a word that the method needs."""
    return str(given[key])
