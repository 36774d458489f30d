"""`cms converge`: free frequencies of a CAD job at two mesh sizes, and the estimated mesh error."""

import json
from pathlib import Path

import numpy as np
import typer

from cms.cli.console import print_table, say, stages

__all__ = ["run_converge"]


def run_converge(path: Path, *, ratio: float, n_modes: int, as_json: bool) -> None:
    """Print frequencies at both sizes, with the estimated error at the job's own size.

    Raises
    ------
    CmsError, FeModelsError
        If the job is invalid, or its body is not from a CAD file.
    """
    from cms.jobs.job import read_job
    from cms.jobs.studies.mesh_convergence import ORDER, mesh_convergence
    from fe_models.foundation.units import unit_system

    job = read_job(path)
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
