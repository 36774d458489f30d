"""The commands `cms faces` and `cms converge`: meshes and their faces."""

import json
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import typer

from cms.cli.console import print_table, say, stages, vector_words
from cms.cli.outputs import output_file
from cms.errors import JobError

if TYPE_CHECKING:
    from fe_models.files.cad.cad_faces import CadFace
    from fe_models.files.cad.cad_model import CadPart
    from fe_models.foundation.arrays import Array

__all__ = ["FacesRequest", "run_converge", "run_faces"]


# `cms converge`: free frequencies of a CAD job at two mesh sizes, and the estimated mesh error ------------------------


def run_converge(path: Path, *, ratio: float, n_modes: int, as_json: bool, changes: Mapping[str, Any]) -> None:
    """Print the frequencies for both mesh sizes, with the estimated error for the mesh size of the job.

    Raises
    ------
    CmsError, FeModelsError
        If the job is invalid, or its body is not from a CAD file.
    """
    from cms.jobs.job import read_job
    from cms.jobs.studies.mesh_convergence import ORDER, mesh_convergence
    from fe_models.foundation.units import unit_system

    job = read_job(path, changes)
    with stages() as clock:
        result = mesh_convergence(job, ratio=ratio, n_modes=n_modes, stages=clock)
    if as_json:
        record = {
            "job": str(path),
            "sizes": list(result.sizes),
            "n_dof": list(result.n_dof),
            "ratio": result.ratio,
            "order": ORDER,
            "first_order": result.first_order,
            "frequencies": result.frequencies.tolist(),
            "estimated_error": result.error.tolist(),
        }
        typer.echo(json.dumps(record, indent=2))
        return
    symbol = unit_system(job.body.units).length_symbol
    coarse, fine = (f"size {size:g} {symbol} [Hz]>" for size in result.sizes)
    rows = [
        (str(k), f"{f_1:.6g}", f"{f_2:.6g}", f"{100 * change:+.3g}", f"{100 * error:+.2g}")
        for k, (f_1, f_2, change, error) in enumerate(
            zip(*result.frequencies, result.change, result.error, strict=True), start=1
        )
    ]
    print_table("Free frequencies", ("mode>", coarse, fine, "change [%]>", "estimated error [%]>"), rows)
    say(
        f"{result.n_dof[0]} and {result.n_dof[1]} dofs; the error is that of size {result.sizes[1]:g} {symbol}, "
        f"estimated with order {ORDER:g}: at most {100 * float(np.abs(result.error).max()):.2g} %"
    )
    if result.first_order:
        say(f"cells of first order: no error is taken below the {100 * result.first_order:.2g} % of the mesh report")
    if (result.change < 0).any():
        say("some frequencies rise with refinement: the meshes do not yet show the same geometry; refine")


# `cms faces`: the faces of a CAD file as a list and a picture, so that interfaces can name them -----------------------


@dataclass(frozen=True)
class FacesRequest:
    """Arguments of `cms faces`."""

    file: Path
    units: str
    select: tuple[str, ...]
    output: Path | None
    as_json: bool


def run_faces(request: FacesRequest) -> None:
    """List and draw all faces, or the faces that a selector chooses.

    Raises
    ------
    FeModelsError
        If the file cannot be read, or a selector chooses nothing.
    JobError
        If the picture cannot be written.
    """
    from fe_models.files.cad.cad_model import read_cad
    from fe_models.files.cad.cad_surface import surface_of_cad
    from fe_models.files.cad.face_selectors import chosen_faces

    surface = None
    if request.output is None:
        part = read_cad(request.file, units=request.units)
    else:
        inputs = (request.file,)
        output_file(request.output, request.output, (".png",), JobError, overwrite_of=inputs, needs_file=True)
        surface = surface_of_cad(request.file, units=request.units)
        part = surface.part
    chosen = {face.number for text in request.select for face in chosen_faces(text, part.faces)}
    faces = [face for face in part.faces if not request.select or face.number in chosen]
    if request.as_json:
        typer.echo(json.dumps(record(part, faces), indent=2))
    else:
        show(part, faces)
    if surface is not None and request.output is not None:
        from cms.assessment.report.face_view import draw_faces

        drawing = draw_faces(surface, request.output, chosen=chosen)
        if not request.as_json:
            say(f"wrote {drawing.path}" + (f" ({drawing.note})" if drawing.note else ""))


def show(part: "CadPart", faces: "Iterable[CadFace]") -> None:
    """Print the table of faces."""
    from fe_models.files.cad.face_selectors import face_words

    symbol = part.units.length_symbol
    say(f"{part.path}: {part.description}")
    say(f"size {vector_words(part.hi - part.lo)} {symbol}, from {vector_words(part.lo)} to {vector_words(part.hi)}")
    size = float(abs(part.hi - part.lo).max())
    rows = []
    for face in faces:
        words = face_words(face) + (f" between solids {face.solids[0]} and {face.solids[1]}" if face.is_inner else "")
        where = face.normal if face.normal is not None else face.axis
        rows.append((
            str(face.number), words, f"{face.area:.6g}", vector_words(face.centre, size),
            "" if where is None else vector_words(where, 1.0), face.name, face.colour,
        ))  # fmt: skip
    columns = ("face>", "what it is", f"area [{symbol}²]>", f"centre [{symbol}]", "normal or axis", "name", "colour")
    print_table("Faces", columns, rows)


def record(part: "CadPart", faces: "Iterable[CadFace]") -> dict[str, Any]:
    """Return the record that --json prints."""
    from fe_models.files.cad.face_selectors import face_words

    return {
        "file": str(part.path),
        "format": part.format,
        "unit of the file": part.unit or None,
        "units": part.units.name,
        "volume": part.volume,
        "lo": part.lo.tolist(),
        "hi": part.hi.tolist(),
        "solids": list(part.solids),
        "faces": [
            {
                "number": face.number,
                "select": face_words(face),
                "kind": face.kind,
                "area": face.area,
                "centre": face.centre.tolist(),
                "normal": listed(face.normal),
                "radius": face.radius,
                "axis": listed(face.axis),
                "point": listed(face.point),
                "hole": face.is_hole,
                "lo": face.lo.tolist(),
                "hi": face.hi.tolist(),
                "name": face.name or None,
                "colour": face.colour or None,
                "solids": list(face.solids),
            }
            for face in faces
        ],
    }


def listed(values: "Array | None") -> list[float] | None:
    """Return an array as a list; None remains None."""
    return None if values is None else [float(value) for value in values]
