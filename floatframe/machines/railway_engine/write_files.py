"""The files of the railway engine with another track or another mesh than the shipped ones."""

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import tomlkit

from fe_models.foundation.arrays import Array
from fe_models.foundation.parametric_file import read_parametric
from fe_models.foundation.paths import replace_files
from fe_models.foundation.words import nearest, quoted
from fe_models.parts.engine_body import EngineBody, engine_body_mesh, mesh_deck
from floatframe.errors import ModelError
from floatframe.model.checked_values import number

__all__ = [
    "CASES",
    "Defect",
    "SCurve",
    "WheelPaths",
    "envelope",
    "path_table",
    "railway_engine_files",
    "write_railway_engine",
]


# wheel paths ----------------------------------------------------------------------------------------------------------
# Prescribed paths of a wheelset on the rails: a short defect, filtered by the envelope of the wheel, and an S-curve.
#
# A wheel of radius R on a rail z(s) has its centre at the height R + max over x of [z(s + x) - (R - sqrt(R² - x²))]; it
# cannot follow shapes shorter than its chord. Laterally, the flange touches the rail. The flange is inclined by an
# angle gamma, so that a horizontal section through it recedes by x² / (2 R tan gamma), like a disc of radius R tan
# gamma.


CHANNELS = ("x", "y", "yaw", "roll")  #: of each wheelset, in the order of the columns
N_CONTACT = 1001  #: number of points along the wheel at which contact is tried
N_PATCH = 15  #: number of points in half a contact, over which a path is rounded


def envelope(rail: Callable[[Array], Array], s: Array, reach: float, radius: float) -> Array:
    """Return max over |x| <= reach of rail(s + x) - (R - sqrt(R² - x²)), (n_s,) [m].

    Parameters
    ----------
    rail
        Height of the rail as a function of the distance along it.
    s
        Positions of the wheel, (n_s,) [m].
    reach
        Distance ahead of and behind the wheel in which the rail is considered, less than the radius [m].
    radius
        Radius R of the disc [m].
    """
    if not 0 < reach <= radius:
        raise ModelError(f"envelope: expected a reach above 0 and at most the radius {radius:g}, got {reach:g}")
    x = np.linspace(-reach, reach, N_CONTACT)
    fall = radius - np.sqrt(radius**2 - x**2)
    return np.array([(rail(place + x) - fall).max() for place in np.asarray(s, dtype=float)])


@dataclass(frozen=True, eq=False)
class WheelPaths:
    """Prescribed path of each wheelset."""

    t: Array  #: output times, (n_t,) [s]
    places: Array  #: x, y of the track [m], yaw [rad], rotation about the right rail [rad], (n_t, n_wheelsets, 4)


@dataclass(frozen=True)
class Defect:
    """A bump on the left rail of a straight track, with vertical and lateral cosine shapes; all wheelsets cross it.

    Raises
    ------
    ModelError
        If a value is not a number, or if length, speed or a radius is not above zero.
    """

    length: float = 0.1  #: length of the defect along the rail [m]
    vertical: float = 0.010  #: height of the crest of the defect [m]; negative for a dip
    lateral: float = 0.004  #: inward displacement of the rail at the defect [m]
    speed: float = 5.0  #: running speed [m/s]
    begin: float = 0.5  #: initial distance of the first wheelset from the middle of the defect [m]
    radius: float = 0.625  #: radius of the wheels [m]
    gauge: float = 1.5  #: distance between the middles of the rails [m]
    flange_angle: float = 1.2217  #: gamma, 70 degrees [rad]
    patch: float = 0.015  #: half length of the contact, over which kinks of the path are rounded [m]
    rest: float = 0.8  #: duration after the last wheelset has passed [s]

    def __post_init__(self) -> None:
        for name in ("length", "speed", "radius", "gauge", "flange_angle", "patch"):
            number(f"defect: {name}", getattr(self, name), above=0.0)
        for name in ("vertical", "lateral", "begin", "rest"):
            number(f"defect: {name}", getattr(self, name))

    def shape(self, s: Array) -> Array:
        """Return the shape of the defect: 1 at its middle, 0 beyond its ends, (n,)."""
        return np.where(np.abs(s) < self.length / 2, 0.5 * (1 + np.cos(2 * np.pi * s / self.length)), 0.0)

    def lift(self, s: Array) -> Array:
        """Return the height of the wheel centre above its radius, at s from the middle of the defect, (n,) [m]."""
        reach = min(self.length / 2 + np.sqrt(2 * self.radius * abs(self.vertical)), self.radius)
        return self.rounded(lambda x: envelope(lambda r: self.vertical * self.shape(r), x, reach, self.radius), s)

    def push(self, s: Array) -> Array:
        """Return the displacement of the flange to the right, (n,) [m]."""
        radius = self.radius * np.tan(self.flange_angle)
        reach = min(self.length / 2 + np.sqrt(2 * radius * abs(self.lateral)), radius)
        return self.rounded(lambda x: envelope(lambda r: self.lateral * self.shape(r), x, reach, radius), s)

    def rounded(self, path: Callable[[Array], Array], s: Array) -> Array:
        """Return the mean of a path about s with cosine weights over the contact, (n,) [m]."""
        step = self.patch / N_PATCH
        at = np.arange(s.min() - 2 * self.patch, s.max() + 2 * self.patch, step)
        weight = 1 + np.cos(np.pi * np.arange(-N_PATCH, N_PATCH + 1) / N_PATCH)
        smooth = np.convolve(path(at), weight / weight.sum(), mode="same")
        return np.interp(s, at, smooth)

    def paths(self, wheelsets: Array, h: float) -> WheelPaths:
        """Return the paths of wheelsets with initial positions x, (n_wheelsets,), every h seconds."""
        first, last = max(wheelsets), min(wheelsets)
        duration = (first - last + self.begin) / self.speed + self.rest
        t: Array = h * np.arange(int(np.ceil(duration / h)) + 1, dtype=np.float64)
        places = np.zeros((len(t), len(wheelsets), 4))
        for k, x in enumerate(wheelsets):
            s = x - first - self.begin + self.speed * t
            near = np.abs(s) < self.length / 2 + self.radius
            places[:, k, 0] = x + self.speed * t
            places[near, k, 1] = -self.push(s[near])
            places[near, k, 3] = np.arcsin(self.lift(s[near]) / self.gauge)
        return WheelPaths(t, places)


@dataclass(frozen=True)
class SCurve:
    """A transition from a straight track to a parallel one: y = shift (x/L - sin(2 pi x/L)/(2 pi)), without cant.

    Its curvature rises and falls as a sine without jumps; the largest curvature is nearly 2 pi shift / L².
    """

    shift: float = 4.0  #: lateral distance from the first to the second track [m]
    length: float = 50.0  #: L, along the first track [m]
    speed: float = 7.0  #: speed along the curve [m/s]
    begin: float = 3.0  #: initial distance of the first wheelset from the curve [m]
    rest: float = 3.0  #: duration after the last wheelset has passed [s]

    def __post_init__(self) -> None:
        for name in ("length", "speed"):
            number(f"S-curve: {name}", getattr(self, name), above=0.0)
        for name in ("shift", "begin", "rest"):
            number(f"S-curve: {name}", getattr(self, name))

    def y(self, x: Array) -> Array:
        """Return the lateral position at a longitudinal position, from the beginning of the curve, (n,) [m]."""
        u = np.clip(x / self.length, 0.0, 1.0)
        return self.shift * (u - np.sin(2 * np.pi * u) / (2 * np.pi))

    def slope(self, x: Array) -> Array:
        """Return dy/dx, (n,)."""
        u = np.clip(x / self.length, 0.0, 1.0)
        return self.shift / self.length * (1 - np.cos(2 * np.pi * u))

    def paths(self, wheelsets: Array, h: float) -> WheelPaths:
        """Return the paths of wheelsets with initial positions x, (n_wheelsets,), every h seconds."""
        first, last = max(wheelsets), min(wheelsets)
        x = np.linspace(0.0, self.length, 20001)  # arc length s(x) = ∫ sqrt(1 + y'²) dx, by the trapezoidal rule
        steps = np.sqrt(1 + self.slope(x) ** 2)
        way = np.concatenate([[0.0], np.cumsum(0.5 * (steps[1:] + steps[:-1]) * np.diff(x))])
        duration = (first - last + self.begin + way[-1]) / self.speed + self.rest
        t: Array = h * np.arange(int(np.ceil(duration / h)) + 1, dtype=np.float64)
        places = np.zeros((len(t), len(wheelsets), 4))
        start = first + self.begin
        for k, place in enumerate(wheelsets):
            s = place - start + self.speed * t
            along = np.where(s < 0, s, np.where(s > way[-1], s - way[-1] + self.length, np.interp(s, way, x)))
            places[:, k, 0], places[:, k, 1] = start + along, self.y(along)
            places[:, k, 2] = np.arctan(self.slope(along))
        return WheelPaths(t, places)


def path_table(paths: WheelPaths) -> str:
    """Return a table as text: time, then x, y, yaw and roll of each wheelset (numbered from 1), in m and rad."""
    n = paths.places.shape[1]
    names = [f"{name} {k + 1} [{'m' if name in 'xy' else 'rad'}]" for k in range(n) for name in CHANNELS]
    rows = np.column_stack([paths.t, paths.places.reshape(len(paths.t), -1)])
    text = [", ".join(["time [s]", *names]), *(", ".join(f"{v:.10g}" for v in row) for row in rows.tolist())]
    return "\n".join(text) + "\n"


# write files ----------------------------------------------------------------------------------------------------------


CASES: dict[str, type[Defect] | type[SCurve]] = {"defect": Defect, "s_curve": SCurve}
SAMPLE = {"defect": 2e-3, "s_curve": 2e-2}  #: sampling interval of the paths [s]
SIZE = 0.75  #: largest edge of a cell of the shipped mesh [m]


def write_railway_engine(
    folder: str | Path,
    case: str = "defect",
    *,
    track: Defect | SCurve | None = None,
    part: EngineBody | None = None,
    size: float = SIZE,
) -> Path:
    """Write carbody.inp, carbody.toml, engine.toml, CASE.toml and CASE.csv; existing files are replaced.

    Continue with `cms reduce carbody.toml -o carbody.h5` and `floatframe run CASE.toml` (docs/railway_engine.md).

    Parameters
    ----------
    folder
        Folder, which is created if it does not exist.
    case
        "defect" or "s_curve".
    track
        The track; None: the defaults of `Defect` or `SCurve`.
    part, size
        Dimensions of the body, and the largest edge of its cells [m].

    Returns
    -------
    Path
        Path of the system file.

    Raises
    ------
    ModelError
        If there is no such case, or the track belongs to the other case.
    PartError
        If the dimensions are inconsistent.
    """
    contents = railway_engine_files(case, track=track, part=part, size=size)
    folder = Path(folder)
    folder.mkdir(parents=True, exist_ok=True)
    replace_files({folder / name: text.encode() for name, text in contents.items()})
    return folder / f"{case}.toml"


def railway_engine_files(
    case: str, *, track: Defect | SCurve | None = None, part: EngineBody | None = None, size: float = SIZE
) -> dict[str, str]:
    """Return the text of the five files, by name; parameters and errors as for `write_railway_engine`."""
    if case not in CASES:
        raise ModelError(f"railway engine: unknown case {quoted(case)}{nearest(case, CASES)}")
    track = CASES[case]() if track is None else track
    if not isinstance(track, CASES[case]):
        raise ModelError(f"railway engine: case {case!r}: expected a {CASES[case].__name__}, got {track!r}")
    shipped = Path(__file__).parent / "files"
    bodies = read_parametric(shipped / f"{case}.toml", ModelError)["bodies"]
    wheelsets = [bodies[name]["position"][0] for name in sorted(bodies) if name.startswith("wheelset_")]
    paths = track.paths(np.array(wheelsets), SAMPLE[case])
    document = tomlkit.parse((shipped / f"{case}.toml").read_text("utf-8"))
    values: dict[str, Any] = {"speed": track.speed, "duration": round(float(paths.t[-1]), 6)}
    if isinstance(track, SCurve):
        values["curve"] = {"begin": max(wheelsets) + track.begin, "length": track.length, "shift": track.shift}
    parameters: Any = document["parameters"]
    for name, value in values.items():
        if parameters[name] != value:
            parameters[name] = value
    return {
        "carbody.inp": mesh_deck(engine_body_mesh(part, size=size)),
        **{name: (shipped / name).read_text("utf-8") for name in ("carbody.toml", "engine.toml")},
        f"{case}.toml": tomlkit.dumps(document),
        f"{case}.csv": path_table(paths),
    }
