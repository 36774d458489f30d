"""The files of the railway engine with another track or another mesh than the shipped ones."""

import re
import tomllib
from pathlib import Path

import numpy as np

from fe_models.foundation.paths import replace_files
from fe_models.foundation.words import nearest, quoted
from fe_models.parts.engine_body import EngineBody, engine_body_mesh, mesh_deck
from floatframe.errors import ModelError
from floatframe.machines.railway_engine.wheel_paths import Defect, SCurve, WheelPaths, path_table

__all__ = ["CASES", "railway_engine_files", "write_railway_engine"]

CASES: dict[str, type[Defect] | type[SCurve]] = {"defect": Defect, "s_curve": SCurve}
SAMPLE = {"defect": 2e-3, "s_curve": 2e-2}  #: sampling interval of the paths [s]
MARGIN, STEP = 12.0, 2.0  #: of the drawn track: length beyond the vehicle, distance between its points [m]
SIZE = 0.75  #: largest edge of a cell of the shipped mesh [m]


def write_railway_engine(
    folder: str | Path,
    case: str = "defect",
    *,
    track: Defect | SCurve | None = None,
    part: EngineBody | None = None,
    size: float = SIZE,
) -> Path:
    """Write carbody.inp, carbody.toml, CASE.toml and CASE.csv; existing files with these names are replaced.

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
        If there is no such case, or the track is of the other case.
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
    """Return the text of the four files, by name; parameters and errors as for `write_railway_engine`."""
    if case not in CASES:
        raise ModelError(f"railway engine: unknown case {quoted(case)}{nearest(case, CASES)}")
    track = CASES[case]() if track is None else track
    if not isinstance(track, CASES[case]):
        raise ModelError(f"railway engine: case {case!r}: expected a {CASES[case].__name__}, got {track!r}")
    shipped = Path(__file__).parent / "files"
    text = (shipped / f"{case}.toml").read_text("utf-8")
    bodies = tomllib.loads(text)["bodies"]
    wheelsets = [bodies[name]["position"][0] for name in sorted(bodies) if name.startswith("wheelset_")]
    paths = track.paths(np.array(wheelsets), SAMPLE[case])
    text = re.sub(r"^velocity = .*$", f"velocity = [{track.speed:g}, 0, 0]", text, flags=re.MULTILINE)
    text = re.sub(r"^t_end = .*$", f"t_end = {paths.t[-1]:g}", text, flags=re.MULTILINE)
    text = re.sub(r"^points = .*$", f"points = {points_of(track, paths)}", text, flags=re.MULTILINE)
    return {
        "carbody.inp": mesh_deck(engine_body_mesh(part, size=size)),
        "carbody.toml": (shipped / "carbody.toml").read_text("utf-8"),
        f"{case}.toml": text,
        f"{case}.csv": path_table(paths),
    }


def points_of(track: Defect | SCurve, paths: WheelPaths) -> str:
    """Return the middle line of the drawn track, from behind the vehicle's start to beyond its end."""
    along = paths.places[..., 0]
    x = np.arange(np.floor(along.min()) - MARGIN, np.ceil(along.max()) + MARGIN + STEP, STEP)
    y = track.y(x) if isinstance(track, SCurve) else np.zeros(len(x))
    return "[" + ", ".join(f"[{a:g}, {b:.3f}, 0]" for a, b in zip(x, y, strict=True)) + "]"
