"""The system of a recorded motion, read again from the system file that its results name."""

import logging
import os
from functools import partial
from pathlib import Path

from fe_models.foundation.paths import file_digest
from floatframe.engine.compiling.system import compiled_system
from floatframe.errors import ResultsError
from floatframe.model.system import System
from floatframe.results.motion import Motion, motion_of
from floatframe.results.trajectory import Trajectory, read_trajectory

__all__ = ["read_results", "recorded_system"]

log = logging.getLogger(__name__)


def read_results(path: str | os.PathLike[str], system: System | None = None) -> Motion:
    """Return the motion in a results file, or the part left by a killed run (with `is_complete` False).

    Parameters
    ----------
    path
        Name of the results file.
    system
        The system that moved; None: that of the system file which the results name, read when it is needed.

    Raises
    ------
    ResultsError
        If there is no such file, or it is of another kind, of a newer version, or damaged.
    """
    trajectory = read_trajectory(path)
    return motion_of(trajectory, partial(recorded_system, trajectory) if system is None else system)


def recorded_system(trajectory: Trajectory, path: str | Path | None = None) -> System | None:
    """Return the system of a motion, from the file that its results name or another path; None if there is no file.

    Sensors and names may have been added since the run; bodies, joints and springs must be unchanged.

    Raises
    ------
    ResultsError
        If the file describes other bodies or joints than the results.
    SystemFileError
        If the file is not valid.
    """
    from floatframe.files.system_file.read_system import read_system

    run = trajectory.head.run
    source = str(path) if path is not None else str(run.get("system_file", ""))
    if not source or (path is None and not Path(source).is_file()):
        return None
    notes = logging.getLogger("floatframe.files.system_file.read_system")
    level = notes.level
    try:
        notes.setLevel(logging.ERROR)  # they were reported when the motion was computed
        system, _ = read_system(source, run.get("changes"))
    finally:
        notes.setLevel(level)
    compiled = compiled_system(system)
    for kind, found, expected in (
        ("bodies", [body.name for body in system.bodies], list(trajectory.body_names)),
        ("joints and springs", list(compiled.joint_names + compiled.spring_names), list(trajectory.connection_names)),
    ):
        if found != expected:
            raise ResultsError(
                f"{source}: its {kind} are {', '.join(found) or 'none'}, but those of "
                f"the motion are {', '.join(expected) or 'none'}; give the system file of the run"
            )
    if path is None and run.get("system_file_digest", "") not in ("", file_digest(source)):
        log.warning("%s has changed since the run; its present sensors are used", source)
    return system
