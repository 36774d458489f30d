"""The machines and their files, which can be copied into a folder of the user.

A machine is a folder `files` in a room of this package, with jobs of its flexible parts, system files, and a README.md
with the commands in order. `MACHINES` has an entry for each.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from types import SimpleNamespace
from typing import Any

from fe_models.foundation.parametric_file import read_parametric, schemas_named_in
from fe_models.foundation.paths import replace_files
from fe_models.foundation.words import nearest, quoted
from floatframe.errors import ModelError

__all__ = ["MACHINES", "Machine", "copy_machine", "machine_files", "parameters_of"]


@dataclass(frozen=True)
class Machine:
    """A machine ready to copy."""

    title: str
    room: str  #: folder in floatframe/machines
    shows: str  #: content of the machine in one line


#: machines by the name with which `floatframe example` copies them
MACHINES: dict[str, Machine] = {
    "antenna": Machine(
        "a deployable antenna", "antenna", "slow opening on a rig and in space, latching shock in free flight"
    ),
    "bogie": Machine(
        "a railway vehicle on bogies", "bogie", "hunting over speed, limit cycles, independent wheels, a curve"
    ),
    "motor-bogie": Machine(
        "a bogie with induction motors", "motor_bogie", "torque ripple of the supply loads the mounts of its motors"
    ),
    "railway-engine": Machine(
        "a railway engine", "railway_engine", "its full body and mode sets over a rail defect and through an S-curve"
    ),
    "landing-gear": Machine(
        "a landing gear",
        "landing_gear",
        "drop, anti-skid braking, shimmy, hydraulic retraction, an aircraft that lands",
    ),
    "kart": Machine(
        "a kart", "kart", "steering step with a flexible and a rigid chassis: radius, wheel loads, yaw-rate gain"
    ),
    "steering-linkage": Machine(
        "a six-bar steering linkage", "steering_linkage", "optimised for Ackermann's condition over its range"
    ),
    "straight-line": Machine(
        "a four-bar linkage with a straight path", "straight_line", "optimised for the least deviation from a line"
    ),
    "absorber": Machine(
        "an absorber on an oscillator", "absorber", "optimised by its frequency response and by eigenvalues"
    ),
    "flexible-arm": Machine(
        "a flexible arm of two links",
        "flexible_arm",
        "a fast move: computed torque of a rigid model beside a move optimised with its modes (CasADi)",
    ),
    "road-car": Machine(
        "a road car", "road_car", "hydraulic roll control, roll and warp, sine steer, lane change, suspension optimised"
    ),
}


def machine_files(name: str) -> Sequence[Path]:
    """Return the files of a machine, as shipped.

    Raises
    ------
    ModelError
        If there is no such machine; the message has the nearest name.
    """
    if name not in MACHINES:
        raise ModelError(f"no machine {quoted(name)}{nearest(name, list(MACHINES))}")
    folder = Path(__file__).parent / MACHINES[name].room / "files"
    return sorted(path for path in folder.rglob("*") if path.is_file() and "__pycache__" not in path.parts)


def copy_machine(name: str, folder: str | Path) -> Sequence[Path]:
    """Copy the files of a machine into a folder, which is created; return their paths.

    The schemas that the files name in their first lines are copied too; editors complete keys with them.

    Raises
    ------
    ModelError
        If there is no such machine, or one of its files already exists, in which case nothing is written.
    """
    sources, place = machine_files(name), Path(folder)
    origin = Path(__file__).parent / MACHINES[name].room / "files"
    contents = {place / source.relative_to(origin): source.read_bytes() for source in sources}
    contents |= {place / schema: text for schema, text in schemas_named_in(contents.values()).items()}
    targets = list(contents)
    taken = [target for target in targets if target.exists()]
    if taken:
        raise ModelError(f"machine {name!r}: {taken[0]} exists; copy it into another folder, nothing was written")
    for target in targets:
        target.parent.mkdir(parents=True, exist_ok=True)
    replace_files(contents)
    return targets


def parameters_of(path: str | Path, changes: Mapping[str, Any] | None = None) -> SimpleNamespace:
    """Return the values of the parameters of a file as attributes, for formulas that are compared with its motion.

    Parameters
    ----------
    path
        A system or job file.
    changes
        Values that replace those in the file, as in `read_system`.

    Raises
    ------
    ModelError
        If the file is not valid.
    """
    return SimpleNamespace(**read_parametric(Path(path), ModelError, changes).parameters)
