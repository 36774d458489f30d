"""The files of the railway engine that a user copies: mesh, job of the body, system, and the paths of its wheels."""

import tomllib
from importlib.resources import files
from pathlib import Path

import numpy as np

from fe_models.foundation.paths import replace_file
from fe_models.foundation.words import nearest, quoted
from fe_models.parts.engine_body import EngineBody, engine_body_mesh, write_engine_mesh
from floatframe.errors import ModelError
from floatframe.mechanisms.railway_engine.wheel_paths import Defect, SCurve, write_paths

__all__ = ["write_railway_engine"]

SAMPLE = {"defect": 1e-3, "s_curve": 2e-2}  #: times between samples of the paths [s]
STEP = {"defect": 1e-3, "s_curve": 5e-3}  #: of the integrator [s]


def write_railway_engine(
    folder: str | Path,
    case: str = "defect",
    *,
    track: Defect | SCurve | None = None,
    part: EngineBody | None = None,
    size: float = 0.5,
) -> Path:
    """Write carbody.inp, carbody.toml, CASE.toml and CASE.csv.

    `cms reduce carbody.toml -o carbody.h5` and `floatframe run CASE.toml` do the rest; see docs/railway_engine.md.

    Parameters
    ----------
    folder
        Where; made if it is not there. Files of these names are replaced.
    case
        "defect" or "s_curve".
    track
        What it runs over; None: the defaults of `Defect` or `SCurve`.
    part, size
        Dimensions of the body, and the largest edge of its cells [m].

    Returns
    -------
    Path
        The system file.

    Raises
    ------
    ModelError
        If there is no such case, or the track is one of the other.
    PartError
        If the dimensions do not fit.
    """
    kinds = {"defect": Defect, "s_curve": SCurve}
    if case not in kinds:
        raise ModelError(f"railway engine: unknown case {quoted(case)}{nearest(case, kinds)}")
    track = kinds[case]() if track is None else track
    if not isinstance(track, kinds[case]):
        raise ModelError(f"railway engine: case {case!r}: expected a {kinds[case].__name__}, got {track!r}")
    folder, data = Path(folder), files("floatframe.mechanisms.railway_engine") / "data"
    folder.mkdir(parents=True, exist_ok=True)
    mesh = engine_body_mesh(part, size=size)
    text = (data / "engine.toml").read_text("utf-8")
    for key, value in (("CASE", case), ("SPEED", f"{track.speed:g}"), ("H", f"{STEP[case]:g}"), ("T_END", "1.0")):  # fmt: skip
        text = text.replace(f"@{key}@", value)
    bodies = tomllib.loads(text)["bodies"]
    wheelsets = [bodies[name]["position"][0] for name in sorted(bodies) if name.startswith("wheelset_")]
    paths = track.paths(np.array(wheelsets), SAMPLE[case])
    text = text.replace("t_end = 1.0", f"t_end = {paths.t[-1]:g}")
    write_engine_mesh(mesh, folder / "carbody.inp")
    replace_file(folder / "carbody.toml", (data / "carbody.toml").read_bytes())
    write_paths(paths, folder / f"{case}.csv")
    replace_file(folder / f"{case}.toml", text.encode())
    return folder / f"{case}.toml"
