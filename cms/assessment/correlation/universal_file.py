"""Measured modes from universal files (.unv, .uff): nodes of datasets 15 and 2411, shapes of 55, units of 164."""

from pathlib import Path
from typing import Any

import numpy as np

from cms.assessment.correlation.errors import CorrelationError
from cms.assessment.correlation.measured import MeasuredModes, phase_collinearity, real_shapes
from fe_models.foundation.extras import extra_module

__all__ = ["read_universal"]

#: length unit in metres for each code of dataset 164 (SI, British, metric, ..., mm, cm, inch, mm)
LENGTHS = {1: 1.0, 2: 0.3048, 3: 1.0, 4: 0.3048, 5: 1e-3, 6: 1e-2, 7: 0.0254, 8: 1e-3, 10: 1e-3}
NORMAL, COMPLEX = 2, (3, 7)  #: analysis types of dataset 55 for normal and complex modes
GLOBAL = (0, 1)  #: displacement systems that are the axes of the test
NODES, SHAPES, UNITS = (15, 2411), 55, 164


def read_universal(path: Path, length: float, *, given: float | None = None) -> MeasuredModes:
    """Read the modes of a universal file.

    Parameters
    ----------
    length
        Length unit of the model [m].
    given
        Length unit of the file [m], if the file has no dataset 164.

    Raises
    ------
    CorrelationError
        If the file is damaged or has no modes, points have no position, or the length unit is unknown.
    MissingExtraError
        If pyuff (extra `modal-test`) is not installed.
    """
    pyuff = extra_module("pyuff", extra="modal-test", purpose="read universal files")
    require_whole(path)
    try:
        file = pyuff.UFF(str(path))
        kinds = [int(kind) for kind in file.get_set_types()]
        sets = [(kind, file.read_sets(k)) for k, kind in enumerate(kinds) if kind in (*NODES, SHAPES, UNITS)]
    except Exception as error:  # one message for any error that the reader raises for a damaged file
        words = f"{type(error).__name__}: {error}"[:200]
        raise CorrelationError(f"{path}: could not be read as a universal file: {words}") from error
    metre = unit_of_length(path, [block for kind, block in sets if kind == UNITS], given)
    places = places_of(path, [block for kind, block in sets if kind in NODES], metre / length)
    found = [mode for kind, block in sets if kind == SHAPES and (mode := mode_of(path, block)) is not None]
    if not found:
        raise CorrelationError(
            f"{path}: expected modes (dataset 55, normal or complex), got datasets {sorted(set(kinds))}"
        )
    numbers = found[0]["numbers"]
    for k, mode in enumerate(found):
        if not np.array_equal(mode["numbers"], numbers):
            raise CorrelationError(f"{path}: mode {k + 1} has other points than mode 1; all need the same")
    missing = [int(number) for number in numbers if int(number) not in places]
    if missing:
        raise CorrelationError(f"{path}: {len(missing)} points have a shape but no position, such as {missing[:5]}")
    shapes = np.stack([mode["shape"].reshape(-1) for mode in found], axis=1)
    is_complex = np.iscomplexobj(shapes) and np.abs(shapes.imag).max() > 0
    n = len(numbers)
    return MeasuredModes(
        np.array([mode["frequency"] for mode in found]),
        real_shapes(shapes) if is_complex else shapes.real,
        np.repeat(numbers, 3),
        np.tile(np.eye(3), (n, 1)),
        np.repeat(np.array([places[int(number)] for number in numbers]), 3, axis=0),
        np.array([mode["damping"] for mode in found]) if any(mode["damping"] for mode in found) else np.zeros(0),
        phase_collinearity(shapes) if is_complex else np.zeros(0),
        str(path),
        ("complex shapes, each rotated to its main phase",) if is_complex else (),
    )


def require_whole(path: Path) -> None:
    """Raise `CorrelationError` if the last dataset of a text file has no end; pyuff would ignore this dataset."""
    content = path.read_bytes()
    if b"    58b" in content:  # the binary data of measured time series may contain any byte
        return
    marks = sum(line.rstrip() == b"    -1" for line in content.splitlines())
    if marks % 2:
        raise CorrelationError(f"{path}: the last dataset is cut off: it has no end mark (-1); copy the file again")


def unit_of_length(path: Path, blocks: list[dict[str, Any]], given: float | None) -> float:
    """Return the length unit of the file [m]; file and argument must agree."""
    told = None
    for block in blocks:
        code = int(block.get("units_code", 0))
        factor = float(block.get("length", 0.0) or 0.0)
        told = LENGTHS.get(code) or (1 / factor if factor > 0 else None)
    if told is not None and given is not None and not np.isclose(told, given, rtol=1e-3):
        raise CorrelationError(f"{path}: says that one length unit is {told:g} m; length says {given:g} m")
    if told is None and given is None:
        raise CorrelationError(f'{path}: nothing tells its unit of length (no dataset 164); give length = "mm"')
    return float(told if told is not None else given if given is not None else 1.0)


def places_of(path: Path, blocks: list[dict[str, Any]], factor: float) -> dict[int, np.ndarray]:
    """Return the position of each point by number, in the unit of the model."""
    found: dict[int, np.ndarray] = {}
    for block in blocks:
        systems = {int(each) for each in np.atleast_1d(block.get("disp_cs", 0))}
        if not systems <= set(GLOBAL):
            other = sorted(systems - set(GLOBAL))
            raise CorrelationError(
                f"{path}: points have displacement systems {other[:5]}; expected shapes in the axes of the test "
                "(system 0 or 1): export them in global coordinates"
            )
        numbers = np.atleast_1d(block["node_nums"]).astype(int)
        places = np.column_stack([np.atleast_1d(block[axis]).astype(float) for axis in "xyz"]) * factor
        found |= dict(zip(numbers.tolist(), places, strict=True))
    return found


def mode_of(path: Path, block: dict[str, Any]) -> dict[str, Any] | None:
    """Return frequency, damping, points and shape, (n, 3), of a dataset 55; None if it is not a mode."""
    kind = int(block.get("analysis_type", 0))
    if kind not in (NORMAL, *COMPLEX):
        return None
    numbers = np.atleast_1d(block["node_nums"]).astype(int)
    columns = [np.atleast_1d(block[f"r{k}"]) for k in (1, 2, 3) if f"r{k}" in block]
    if len(columns) != 3 or any(len(column) != len(numbers) for column in columns):
        raise CorrelationError(f"{path}: a mode with {len(columns)} values a point; expected x, y, z")
    if kind == NORMAL:
        frequency, damping = float(block["freq"]), float(block.get("modal_damp_vis", 0.0) or 0.0)
    else:
        eigenvalue = complex(np.atleast_1d(block["eig"])[0])
        frequency = abs(eigenvalue) / (2 * np.pi)
        damping = -eigenvalue.real / abs(eigenvalue) if eigenvalue else 0.0
    return {"frequency": frequency, "damping": damping, "numbers": numbers, "shape": np.column_stack(columns)}
