"""`cms frame`: a modal file in another body frame, from the file alone."""

from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from cms.cli.console import output_path, say_written, stages
from cms.errors import JobError, ModalFileError
from fe_models.foundation.words import nearest

if TYPE_CHECKING:
    from cms.body.reduced_body import ReducedBody
    from cms.reduction.basis.damping import Damping
    from cms.reduction.basis.frames import Frame

__all__ = ["FrameRequest", "frame_of", "numbers", "run_frame"]


@dataclass(frozen=True)
class FrameRequest:
    """Arguments of `cms frame`."""

    file: Path
    to: str  #: key of `FRAMES` for the new frame
    at: str | None = None
    origin: str | None = None  #: origin of the new frame, "x,y,z"
    axes: str | None = None  #: three axes of the new frame, "x,y,z;x,y,z;x,y,z"
    ratio: float | None = None
    units: str | None = None
    output: Path | None = None
    keep_geometric: bool = True  #: whether the geometric stiffness is converted; if not, it is omitted
    heavy: bool = False  #: whether a damping ratio above 0.2 is intended


def run_frame(request: FrameRequest) -> "ReducedBody":
    """Convert a modal file to another frame, write it, and return the body.

    Raises
    ------
    CmsError
        If the frame is unknown, the file lacks data that it needs, or the output cannot be written.
    """
    from cms.body.modal_file.file import convert_units, read, write
    from cms.reduction.frame_conversion import convert_frame

    frame = frame_of(request)
    default = request.file.with_name(f"{request.file.stem}_{request.to}.h5")
    path = output_path(request.output, default, ModalFileError, overwrite_of=(request.file,))
    with stages() as clock:
        with clock("read"):
            body = read(request.file)
            if request.units is not None:
                body = convert_units(body, request.units)
            if not request.keep_geometric:
                body = replace(body, geometric=None, quadratic=None)
        with clock("convert"):
            converted = convert_frame(body, frame, damping=damping_of(request))
        with clock("write"):
            write(converted, path)
    say_written(path)
    return converted


def frame_of(request: FrameRequest) -> "Frame":
    """Return the requested frame.

    Raises
    ------
    JobError
        If it is unknown, or an option does not belong to it or cannot be read.
    """
    from cms.reduction.basis.frames import FRAMES, NodalFrame

    if request.to not in FRAMES:
        raise JobError(f"--to {request.to}: unknown frame{nearest(request.to, FRAMES)}")
    if request.at is not None and request.to != "nodal":
        raise JobError(f"--at {request.at}: belongs to --to nodal, got --to {request.to}")
    origin = None if request.origin is None else numbers("--origin", request.origin)
    axes = None
    if request.axes is not None:
        rows = [numbers("--axes", row) for row in request.axes.split(";")]
        if len(rows) != 3:
            raise JobError(f"--axes {request.axes}: expected three axes, x,y,z;x,y,z;x,y,z")
        axes = (rows[0], rows[1], rows[2])
    if request.to == "nodal":
        return NodalFrame(request.at, origin, axes)
    return FRAMES[request.to](origin=origin, axes=axes)


def damping_of(request: FrameRequest) -> "Damping | None":
    """Return the damping that replaces the damping of the file; None if none is requested."""
    from cms.reduction.basis.damping import ModalDamping

    return None if request.ratio is None else ModalDamping(request.ratio, heavy=request.heavy)


def numbers(option: str, text: str) -> tuple[float, float, float]:
    """Return three numbers separated by commas."""
    try:
        values = [float(word) for word in text.split(",")]
    except ValueError:
        values = []
    if len(values) != 3 or not np.isfinite(values).all():
        raise JobError(f"{option} {text}: expected three numbers with commas between, x,y,z")
    return values[0], values[1], values[2]
