"""The commands `cms faces` and `cms converge`: meshes and their faces."""

import json
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import typer

from cms.cli.console import print_table, say, stages, vector_words
from cms.cli.info import error_percent
from cms.cli.outputs import output_file
from cms.cli.verdicts.check import print_records
from cms.errors import JobError

if TYPE_CHECKING:
    from cms.jobs.job import Job
    from cms.jobs.studies.mesh_convergence import MeshConvergence
    from cms.jobs.studies.mesh_estimate import MeshEstimate
    from fe_models.files.cad.cad_faces import CadFace
    from fe_models.files.cad.cad_model import CadPart
    from fe_models.foundation.arrays import Array
    from fe_models.foundation.stages import Stages

__all__ = ["ConvergeRequest", "FacesRequest", "run_converge", "run_faces"]


# `cms converge`: estimated mesh error of the free frequencies, from one mesh or from two ------------------------------


@dataclass(frozen=True)
class ConvergeRequest:
    """Arguments of `cms converge`."""

    path: Path
    ratio: float | None
    n_modes: int
    error: float
    output: Path | None
    as_json: bool


def run_converge(request: ConvergeRequest, changes: Mapping[str, Any]) -> None:
    """Print the frequencies with their estimated errors, and the element size for the wanted error.

    Raises
    ------
    CmsError, FeModelsError
        If the job is invalid, or nothing is known about the errors.
    """
    from cms.jobs.job import read_job
    from cms.jobs.studies.mesh_convergence import RATIO, mesh_convergence
    from cms.jobs.studies.mesh_estimate import draw_oversize

    if not 0 < request.error < np.inf:
        raise JobError(f"converge: --error {request.error:g}: expected a number above 0")
    if request.output is not None:
        output_file(request.output, request.output, (".png",), JobError, overwrite_of=(request.path,), needs_file=True)
    job = read_job(request.path, changes)
    with stages() as clock:
        result = None
        if job.mesh_size is None:
            if request.ratio is not None:
                raise JobError(
                    f"converge: --ratio {request.ratio:g}: {request.path} has one mesh; expected a CAD file with "
                    "[mesh_size], which can be meshed again; leave --ratio out"
                )
            estimate = estimate_of_job(job, request.n_modes, clock)
        else:
            ratio = RATIO if request.ratio is None else request.ratio
            result = mesh_convergence(job, ratio=ratio, n_modes=request.n_modes, stages=clock)
            estimate = result.estimates[1]
        if request.output is not None:
            with clock("draw"):
                draw_oversize(estimate, request.error, request.output)
    record = record_of_estimate(estimate, request) | ({} if result is None else record_of_convergence(result, request))
    verdict = estimate.judged(request.error) if result is None else result.judged(request.error)
    record["records"] = [verdict.as_dict()]
    if request.as_json:
        typer.echo(json.dumps(record, indent=2))
        return
    if result is None:
        print_estimate(record)
    else:
        print_convergence(result, record)
    say(f"from this mesh alone: {record['mesh_method']}")
    print_records("Mesh", estimate.body.name, (verdict,))
    if request.output is not None:
        say(f"wrote {request.output}")


def estimate_of_job(job: "Job", n_modes: int, clock: "Stages") -> "MeshEstimate":
    """Return the estimate for the one mesh of a job."""
    from cms.jobs.body_of_job import job_body
    from cms.jobs.studies.mesh_estimate import mesh_estimate

    if n_modes < 1:
        raise JobError(f"converge: modes: expected 1 or more, got {n_modes}")
    body = job_body(job, clock)
    with clock("free modes"):
        estimate = mesh_estimate(body, n_modes)
    if estimate.errors.of_cells is None:
        raise JobError(
            "converge: the error of the mesh is not known: "
            f"{estimate.errors.method.removeprefix('none: ')}; expected a solid, a shell, or a CAD file with "
            "[mesh_size]"
        )
    return estimate


def record_of_estimate(estimate: "MeshEstimate", request: ConvergeRequest) -> dict[str, Any]:
    """Return the estimate from the stress on one mesh, as plain types."""
    from cms.jobs.studies.mesh_estimate import RATE

    return {
        "job": str(request.path),
        "frequencies": estimate.frequencies.tolist(),
        "mesh_error": [None if np.isnan(error) else float(error) for error in estimate.errors.frequency],
        "mesh_sign": estimate.errors.sign,
        "mesh_method": estimate.errors.method,
        "wanted_error": request.error,
        "rate": RATE,
        "size_factor": None if np.isnan(estimate.worst) else estimate.size_factor(request.error),
    }


def record_of_convergence(result: "MeshConvergence", request: ConvergeRequest) -> dict[str, Any]:
    """Return the comparison of two meshes as plain types."""
    from cms.jobs.studies.mesh_convergence import ORDER

    return {
        "sizes": list(result.sizes),
        "n_dof": list(result.n_dof),
        "ratio": result.ratio,
        "order": ORDER,
        "first_order": result.first_order,
        "frequencies": result.frequencies.tolist(),
        "estimated_error": result.error.tolist(),
        "rate": result.rate,
        "size_factor": result.size_for(request.error) / result.sizes[1],
    }


def print_estimate(record: dict[str, Any]) -> None:
    """Print the frequencies of one mesh with their estimated errors."""
    from cms.body.error_estimates import MESH_SIGNS

    sign = MESH_SIGNS[record["mesh_sign"]]
    rows = [
        (str(k), f"{f:.6g}", error_percent(error, sign))
        for k, (f, error) in enumerate(zip(record["frequencies"], record["mesh_error"], strict=True), start=1)
    ]
    print_table("Free frequencies", ("mode>", "Hz>", "mesh>"), rows)


def print_convergence(result: "MeshConvergence", record: dict[str, Any]) -> None:
    """Print the frequencies of two meshes, and the errors of the finer one."""
    from cms.body.error_estimates import MESH_SIGNS

    symbol = result.estimates[1].body.units.length_symbol
    coarse, fine = (f"size {size:g} {symbol} [Hz]>" for size in result.sizes)
    errors = [error_percent(error, MESH_SIGNS[record["mesh_sign"]]) for error in record["mesh_error"]]
    rows = [
        (str(k), f"{f_1:.6g}", f"{f_2:.6g}", f"{100 * change:+.3g}", f"{100 * error:+.2g}", of_stress)
        for k, (f_1, f_2, change, error, of_stress) in enumerate(
            zip(*result.frequencies, result.change, result.error, errors, strict=False), start=1
        )
    ]
    titles = ("mode>", coarse, fine, "change [%]>", "estimated error [%]>", "from the stress>")
    print_table("Free frequencies", titles, rows)
    say(
        f"{result.n_dof[0]} and {result.n_dof[1]} dofs; the error is that of size {result.sizes[1]:g} {symbol}, "
        f"estimated with order {record['order']:g}: at most {100 * float(np.abs(result.error).max()):.2g} %"
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
            "" if where is None else vector_words(where, 1.0), face.colour,
        ))  # fmt: skip
    columns = ("face>", "what it is", f"area [{symbol}²]>", f"centre [{symbol}]", "normal or axis", "colour")
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
                "colour": face.colour or None,
                "solids": list(face.solids),
            }
            for face in faces
        ],
    }


def listed(values: "Array | None") -> list[float] | None:
    """Return an array as a list; None remains None."""
    return None if values is None else [float(value) for value in values]
