"""Levels as specifications write them: bands with a level or with a slope in dB per octave.

    20 to 80 Hz       +3 dB/oct
    80 to 350 Hz      0.04 g2/Hz
    350 to 2000 Hz    -3 dB/oct

Decibels are 10 log10 of a ratio of densities, or 20 log10 of a ratio of amplitudes. A slope begins at the adjacent
level.
"""

import math
import re
from collections.abc import Sequence

import numpy as np

from fe_models.foundation.words import quoted
from floatframe.durability.shaking.loads.levels import DENSITIES, Level, known_unit
from floatframe.errors import ModelError

__all__ = ["MEETS", "level_of_bands"]

MEETS = 0.5  #: largest mismatch of a slope between two levels [dB], because specifications round values
STEEPEST = 100.0  #: largest slope [dB per octave]
SLOPE = re.compile(r"([+-]?\d+(?:\.\d*)?|[+-]?\.\d+)\s*d[bB]\s*/\s*oct(?:ave)?")
Band = Sequence[float | str]


def level_of_bands(bands: Sequence[Band], unit: str, where: str) -> Level:
    """Return the level of bands (from Hz, to Hz, level or slope), one after the other.

    (1) bands with a level have two corners
    (2) slopes continue from a level towards the ends of the list: S_2 = S_1 10^(s/10 log2(f_2/f_1)) for a density, with
        s/20 for an amplitude
    (3) a slope between two levels must meet both within 0.5 dB; it is replaced by the straight line through both

    Parameters
    ----------
    bands
        First and last frequency [Hz], and a level in `unit` or a slope in dB per octave, in ascending order.
    unit
        Unit of the levels, which is that of densities or amplitudes.
    where
        Location of the bands in the file, for messages.

    Raises
    ------
    ModelError
        If there is a gap between bands, none has a level, levels make a step, or a slope is not valid; the message
        names the band.
    """
    known = known_unit(unit, where)
    decibel = 10.0 if known in DENSITIES else 20.0
    if not bands:
        raise ModelError(f"{where}: expected bands (Hz, Hz, level or slope), got none")
    first, last, levels, slopes = parsed(bands, known, where)
    corners: list[float | None] = [None] * (len(bands) + 1)  # level at the first frequency of each band, and at the end
    for k, level in enumerate(levels):  # (1)
        if level is None:
            continue
        if corners[k] is not None and not math.isclose(float(corners[k] or 0), level, rel_tol=1e-9):
            raise ModelError(
                f"{where}: band {k + 1}: a step from {corners[k]:g} to {level:g} {known} at {first[k]:g} Hz; put a "
                "band with a slope between them"
            )
        corners[k] = corners[k + 1] = level
    if all(each is None for each in corners):
        raise ModelError(f"{where}: no band has a level; give one as a number in {known}")

    def along(k: int, level: float, *, up: bool) -> float:
        octaves = math.log2(last[k] / first[k])
        return float(level * 10 ** ((1 if up else -1) * float(slopes[k] or 0.0) * octaves / decibel))

    for k in range(len(bands)):  # (2) from the left
        start, end = corners[k], corners[k + 1]
        if slopes[k] is None or start is None:
            continue
        reached = along(k, start, up=True)
        if end is None:
            corners[k + 1] = reached
        elif abs(away := decibel * math.log10(reached / end)) > MEETS:  # (3)
            raise ModelError(
                f"{where}: band {k + 1}: {slopes[k]:+g} dB/oct from {start:g} {known} at {first[k]:g} Hz is "
                f"{reached:.4g} at {last[k]:g} Hz, {away:+.2f} dB from the {end:g} of the next band; expected them to "
                f"meet within {MEETS:g} dB"
            )
    for k in reversed(range(len(bands))):  # (2) to the left
        end = corners[k + 1]
        if corners[k] is None and end is not None:
            corners[k] = along(k, end, up=False)
    frequencies = np.array([*first, last[-1]])
    values = np.array([float(each or 0.0) for each in corners])
    return Level(frequencies, values, known, where, [f"corner at {f:g} Hz" for f in frequencies])


def parsed(
    bands: Sequence[Band], unit: str, where: str
) -> tuple[list[float], list[float], list[float | None], list[float | None]]:
    """Return first and last frequencies, levels, and slopes [dB per octave] of bands."""
    first: list[float] = []
    last: list[float] = []
    levels: list[float | None] = []
    slopes: list[float | None] = []
    for number, band in enumerate(bands, start=1):
        place = f"{where}: band {number}"
        if len(band) != 3 or not all(isinstance(f, int | float) and math.isfinite(f) for f in band[:2]):
            raise ModelError(f'{place}: expected [from Hz, to Hz, level or "slope dB/oct"], got {band!r}')
        f_1, f_2, what = float(band[0]), float(band[1]), band[2]
        if not 0 < f_1 < f_2:
            raise ModelError(f"{place}: {f_1:g} to {f_2:g} Hz: expected rising frequencies above 0")
        if last and not math.isclose(f_1, last[-1], rel_tol=1e-9):
            raise ModelError(
                f"{place}: begins at {f_1:g} Hz, but the previous band ends at {last[-1]:g} Hz; expected no gap "
                "between them"
            )
        first.append(last[-1] if last else f_1)
        last.append(f_2)
        if isinstance(what, str):
            found = SLOPE.fullmatch(what.strip())
            slope = float(found[1]) if found else math.inf
            if not abs(slope) <= STEEPEST:
                raise ModelError(
                    f'{place}: {quoted(what)}: expected a slope such as "+3 dB/oct", up to {STEEPEST:g}, or a level in '
                    f"{unit} as a number"
                )
            slopes.append(slope)
            levels.append(None)
        else:
            level = float(what)
            if not (math.isfinite(level) and level > 0):
                raise ModelError(
                    f"{place}: {level:g} {unit}: expected a level above 0; end the table where the level ends"
                )
            levels.append(level)
            slopes.append(None)
    return first, last, levels, slopes
