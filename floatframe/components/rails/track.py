"""A track fixed to the ground: its centre line over the arc length, cant, and irregularities of each rail.

Straights, circles and clothoids (curvature linear in the arc length) are connected in sequence; curvature to the left
is positive. The axes of the track at s are t forward, n to the left and b upward, rotated about t by the cant: in a
curve to the left, the left rail is lower. The centre line stays at a constant height. Before its beginning and beyond
its end, the track is straight.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any, NamedTuple

import numpy as np

from fe_models.foundation.arrays import Array, GivenArray, given
from fe_models.foundation.records import checked_fields, frozen_copies
from floatframe.components.rails.irregularities import Irregularities
from floatframe.errors import ModelError
from floatframe.model.checked_values import array_of_shape, number

__all__ = ["Segment", "Track", "TrackFrame", "curve"]

MOST_TURN = 0.1  #: largest change of direction in a cell of the centre line [rad]
MOST_LENGTH = 25.0  #: largest length of a cell [m]
GAUSS = np.polynomial.legendre.leggauss(5)


@dataclass(frozen=True)
class Segment:
    """A piece of track whose curvature and cant change linearly from beginning to end."""

    length: float  #: length of the segment [m]
    curvature: tuple[float, float] = (0.0, 0.0)  #: curvature 1/R at beginning and end, positive to the left [1/m]
    #: height of the right rail above the left one, over 1.5 m, at beginning and end [m]
    cant: tuple[float, float] = (0.0, 0.0)


def curve(
    radius: float,
    length: float,
    *,
    transition: float = 50.0,
    cant: float = 0.0,
    before: float = 20.0,
    after: float = 50.0,
) -> tuple[Segment, ...]:
    """Return straight, clothoid, circle, clothoid and straight: a curve to the left, or to the right for R < 0.

    Parameters
    ----------
    radius
        R of the circle [m], negative for a curve to the right.
    length
        Length of the circle [m].
    transition
        Length of each clothoid [m].
    cant
        Cant of the circle, with the outer rail higher [m].
    before, after
        Lengths of the straight pieces [m].
    """
    radius = number("curve: radius", radius)
    if abs(radius) < 20:
        raise ModelError(f"curve: radius: expected 20 m or more, got {radius:g} m")
    k, c = 1 / radius, np.sign(radius) * number("curve: cant", cant)
    return (
        Segment(before),
        Segment(transition, (0.0, k), (0.0, c)),
        Segment(length, (k, k), (c, c)),
        Segment(transition, (k, 0.0), (c, 0.0)),
        Segment(after),
    )


class TrackFrame(NamedTuple):
    """The track at one position."""

    origin: Array  #: point on the centre line between the tops of the rails, ground axes [m]
    axes: Array  #: axes t, n, b as columns, (3, 3)
    curvature: float  #: curvature of the centre line [1/m]


@frozen_copies
@dataclass(frozen=True, eq=False)
@checked_fields(ModelError)
class Track:
    """Consecutive segments from a point of the ground in a given direction, with irregularities of the rails."""

    segments: Sequence[Segment] = ()  #: segments in order; none: an infinite straight track
    irregularities: Irregularities | None = None
    start: GivenArray = given(np.zeros(3))  #: of the centre line, height of the tops of the rails [m]
    heading: float = 0.0  #: direction relative to the x axis of the ground, to the left [rad]

    def __post_init__(self) -> None:
        object.__setattr__(self, "start", array_of_shape("track: start", self.start, (3,)))
        object.__setattr__(self, "heading", number("track: heading", self.heading))
        object.__setattr__(self, "segments", tuple(self.segments))
        for i, each in enumerate(self.segments):
            where = f"track: segment {i}"
            number(f"{where}: length", each.length, above=0.0)
            for k in each.curvature:
                if abs(number(f"{where}: curvature", k)) > 0.05:
                    raise ModelError(f"{where}: curvature: expected 1/R with R of 20 m or more, got 1/R = {k:g} 1/m")
            for c in each.cant:
                if abs(number(f"{where}: cant", c)) > 0.3:
                    raise ModelError(f"{where}: cant: expected up to 0.3 m, got {c:g} m: is the unit metre?")
        joints = zip(self.segments[:-1], self.segments[1:], strict=True)
        for i, (one, other) in enumerate(joints):
            if abs(one.cant[1] - other.cant[0]) > 1e-9:
                raise ModelError(
                    f"track: cant jumps from {one.cant[1]:g} m to {other.cant[0]:g} m between segments {i} and "
                    f"{i + 1}; put a transition between them"
                )

    @property
    def length(self) -> float:
        """Total length of the segments [m]."""
        return float(sum(each.length for each in self.segments))

    @cached_property
    def cells(self) -> Array:
        """Pieces with linear curvature and cant, (n, 8): s, x, y, heading, k, k', cant angle, its slope."""
        s, x, y, heading = 0.0, float(self.start[0]), float(self.start[1]), self.heading
        rows = [
            [-MOST_LENGTH, x - MOST_LENGTH * np.cos(heading), y - MOST_LENGTH * np.sin(heading), heading, 0, 0, 0, 0]
        ]
        if self.segments:
            first = np.arcsin(self.segments[0].cant[0] / 1.5)
            rows[0][6] = first
        else:
            rows.append([s, x, y, heading, 0, 0, 0, 0])
        for each in self.segments:
            k_0, k_1 = each.curvature
            turn = max(abs(k_0), abs(k_1)) * each.length
            n = int(max(np.ceil(turn / MOST_TURN), np.ceil(each.length / MOST_LENGTH), 1))
            h, slope = each.length / n, (k_1 - k_0) / each.length
            a_0, a_1 = (float(np.arcsin(c / 1.5)) for c in each.cant)
            for i in range(n):
                k = k_0 + slope * h * i
                rows.append([s, x, y, heading, k, slope, a_0 + (a_1 - a_0) * i / n, (a_1 - a_0) / each.length])
                sigma = 0.5 * h * (GAUSS[0] + 1)
                psi = heading + k * sigma + 0.5 * slope * sigma**2
                x += 0.5 * h * float(GAUSS[1] @ np.cos(psi))
                y += 0.5 * h * float(GAUSS[1] @ np.sin(psi))
                heading += k * h + 0.5 * slope * h * h
                s += h
        if self.segments:
            rows.append([s, x, y, heading, 0, 0, float(np.arcsin(self.segments[-1].cant[1] / 1.5)), 0])
        return np.array(rows, dtype=float)

    def frame(self, s: float) -> TrackFrame:
        """Return origin and axes of the undisturbed track at the arc length s."""
        cells = self.cells
        i = int(np.clip(np.searchsorted(cells[:, 0], s, side="right") - 1, 0, len(cells) - 1))
        s_0, x, y, heading, k, slope, cant, change = cells[i]
        d = s - s_0
        sigma = 0.5 * d * (GAUSS[0] + 1)
        psi = heading + k * sigma + 0.5 * slope * sigma**2
        end = heading + k * d + 0.5 * slope * d * d
        origin = np.array([
            x + 0.5 * d * (GAUSS[1] @ np.cos(psi)), y + 0.5 * d * (GAUSS[1] @ np.sin(psi)), self.start[2],
        ])  # fmt: skip
        c, sn = np.cos(cant + change * d), np.sin(cant + change * d)
        t = np.array([np.cos(end), np.sin(end), 0.0])
        left = np.array([-np.sin(end), np.cos(end), 0.0])
        up = np.array([0.0, 0.0, 1.0])
        axes = np.column_stack([t, c * left - sn * up, c * up + sn * left])
        return TrackFrame(origin, axes, float(k + slope * d))

    @classmethod
    def from_table(cls, table: Any, where: str = "track") -> "Track":
        """Return the track of a table of a system file: start, heading, segments, curve, irregularities."""
        if not isinstance(table, dict):
            raise ModelError(f"{where}: expected a table, got {table!r}")
        unknown = sorted(set(table) - {"start", "heading", "segments", "curve", "irregularities"})
        if unknown:
            raise ModelError(
                f"{where}: unknown key {unknown[0]!r}; choose among start, heading, segments, curve, irregularities"
            )
        if "segments" in table and "curve" in table:
            raise ModelError(f"{where}: give segments or curve, not both")
        try:
            if "curve" in table:
                segments = curve(**table["curve"])
            else:
                segments = tuple(
                    Segment(each["length"], pair(each.get("curvature", 0.0)), pair(each.get("cant", 0.0)))
                    for each in table.get("segments", ())
                )
        except (TypeError, KeyError) as error:
            raise ModelError(
                f"{where}: expected a segment with length, curvature and cant (a number or [begin, end]); a curve "
                f"has radius, length, transition, cant, before, after: {error}"
            ) from None
        irregular = table.get("irregularities")
        return cls(
            segments,
            None if irregular is None else Irregularities.from_table(irregular, f"{where}: irregularities"),
            table.get("start", (0.0, 0.0, 0.0)),
            table.get("heading", 0.0),
        )


def pair(value: Any) -> tuple[float, float]:
    """Return a number twice, or the two numbers of a list."""
    if isinstance(value, list | tuple):
        if len(value) != 2:
            raise ModelError(f"track: expected a number or [begin, end], got {value!r}")
        return float(value[0]), float(value[1])
    return float(value), float(value)
