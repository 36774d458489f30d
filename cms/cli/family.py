"""`cms family` and `cms interpolate`: a reduced body for many values of its design parameters."""

from pathlib import Path
from typing import Annotated

import typer

from cms.cli.arguments import Output, SetValues, Solver, changes_of
from cms.cli.console import guarded, output_path, print_table, say, say_written, stages
from cms.cli.info import print_body
from cms.errors import JobError, ModalFileError
from fe_models.foundation.words import quoted

__all__ = ["family_command", "interpolate_command"]


@guarded
def family_command(
    job: Annotated[Path, typer.Argument(help="Job file (TOML) with [parameters].")],
    over: Annotated[
        list[str],
        typer.Option(
            "--over",
            metavar="NAME=FROM:TO:N",
            help="Parameter and its values, from:to:number, or a list with commas; up to three.",
        ),
    ],
    solver: Solver = None,
    output: Annotated[Path | None, typer.Option("--output", "-o", help="Family file to write.")] = None,
) -> None:
    """Reduce a job at several values of its parameters.

    The file gives the reduced body at any values between them: cms interpolate.

    All samples get the same modes, also if modes cross the cutoff of the mode set. The printed error is that of bodies
    interpolated at inner values without the samples there; a parameter with two values costs one more reduction, in the
    middle. Without -o: rod.toml gives rod_family.h5.

    Example: cms family rod.toml --over length=1.0:1.2:3 -o rod_family.h5

    Example: cms family rod.toml --over length=1.0:1.2:3 --over thickness=0.008,0.01,0.012
    """
    from cms.family import job_at, reduce_family
    from cms.fleet import inputs_of
    from cms.reduction.parametric.family_file import write_parametric_body

    values = values_of(over)
    first = {name: given[0] for name, given in values.items()}
    default = job.with_name(f"{job.stem}_family.h5")
    path = output_path(output, default, JobError, overwrite_of=inputs_of(job, job_at(job, first)))
    with stages() as clock:
        family = reduce_family(job, values, solver=solver, stages=clock)
        with clock("write"):
            write_parametric_body(family, path)
    rows = [(name, ", ".join(f"{x:g}" for x in given)) for name, given in family.values.items()]
    rows += [("modes", str(family.samples[0].n_q)), ("samples", str(len(family.samples)))]
    print_table("Family", ("", ""), rows)
    if family.errors is not None:
        print_table("Estimated errors of interpolated bodies", ("", "error>"), family.errors.rows())
        say(f"Found with {family.errors.method}.")
    say_written(path)


def values_of(given: list[str]) -> dict[str, tuple[float, ...]]:
    """Return the values of each parameter from NAME=FROM:TO:N or NAME=A,B,C."""
    import numpy as np

    found: dict[str, tuple[float, ...]] = {}
    for each in given:
        name, _, text = each.partition("=")
        try:
            if ":" in text:
                first, last, n = text.split(":")
                numbers = np.linspace(float(first), float(last), int(n))
            else:
                numbers = np.array([float(word) for word in text.split(",")])
        except ValueError:
            numbers = np.zeros(0)
        if not name.strip() or not len(numbers) or not np.isfinite(numbers).all():
            raise JobError(f"--over {quoted(each)}: expected NAME=FROM:TO:N or NAME=A,B,C, such as length=1.0:1.2:3")
        if name.strip() in found:
            raise JobError(f"--over {quoted(each)}: {name.strip()} is there twice; give all its values together")
        found[name.strip()] = tuple(float(f"{x:.12g}") for x in numbers)
    return found


@guarded
def interpolate_command(
    file: Annotated[Path, typer.Argument(help="Family file, as cms family writes it.")],
    set_values: SetValues,
    output: Output = None,
) -> None:
    """Reduced body of a family at given parameters.

    It is an ordinary modal file. Values outside of the sampled range are refused.

    Without -o the file is written beside the family: rod_family.h5 gives rod_family_at.h5.

    Example: cms interpolate rod_family.h5 --set length=1.1 -o rod_1100.h5
    """
    from cms.body.modal_file.file import write
    from cms.reduction.parametric.family_file import read_parametric_body

    point = changes_of(set_values)
    path = output_path(output, file.with_name(f"{file.stem}_at.h5"), ModalFileError, overwrite_of=[file])
    body = read_parametric_body(file).at(**point)
    write(body, path)
    print_body(body)
    say_written(path)
