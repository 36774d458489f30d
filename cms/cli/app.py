"""The commands of `cms`; each imports what it needs when it runs, so that `cms --help` responds at once."""

from pathlib import Path
from typing import Annotated

import typer

from cms.cli.arguments import ModalFile, Output, SetValues, Workers, changes_of
from cms.cli.console import commands, guarded, register, say
from cms.cli.demo import demo_command
from cms.cli.family import family_command, interpolate_command
from cms.cli.info import info_command, print_body
from cms.cli.modes import view_command
from cms.cli.reduce import Fleet, reduce_and_write_fleet, reduce_command
from cms.cli.schema import schema_command_of
from cms.cli.show import show_command

__all__ = ["app"]

app = commands(
    "cms",
    "Component mode synthesis: a meshed part becomes a small, exact, portable flexible body.",
    hints={
        "study": "floatframe compare FILE for models of a body in a mechanism, or cms compare JOB for mode sets",
        "validate": "cms check FILE",
        "convert": "cms export FILE",
    },
)


@guarded
def job_command(
    deck: Annotated[Path, typer.Argument(help="Deck: Abaqus, CalculiX (.inp), Nastran (.bdf), ANSYS (.cdb).")],
    units: Annotated[
        str | None, typer.Option(help="Unit system of its numbers, such as mm-t-s; decks do not state it.")
    ] = None,
    program: Annotated[str | None, typer.Option(help="Program of a deck (.inp): calculix (default) or abaqus.")] = None,
    density: Annotated[
        list[str] | None, typer.Option(help="Density of materials without one: NAME=NUMBER, or a number; repeatable.")
    ] = None,
    leave_out: Annotated[
        list[str] | None,
        typer.Option(help="Cards that carry mass or stiffness and are to be left out, by name; repeatable."),
    ] = None,
    mass: Annotated[
        str | None,
        typer.Option(help="Mass of all elements: consistent, lumped, or 'as the deck'; default: that of solids alone."),
    ] = None,
    output: Annotated[Path | None, typer.Option("--output", "-o", help="Job file to write.")] = None,
) -> None:
    """Write the job of a deck of another program.

    It holds materials, sections, masses, springs, couplings, supports and loads.

    The command prints every card that is not converted, with its consequence; a mass or a coupling is never dropped
    unless it is named. Without -o the job is written beside the deck: rod.inp gives rod.toml.

    Example: cms job rod.inp --units mm-t-s -o rod.toml

    Example: cms job rod.inp --units mm-t-s --density steel=7.85e-9 --leave-out "CONTACT PAIR"
    """
    from cms.cli.job import DeckRequest, write_job

    write_job(DeckRequest(deck, output, units, program, tuple(density or ()), tuple(leave_out or ()), mass))


@guarded
def run_command(
    file: Annotated[Path, typer.Argument(help="Job or correlation file (TOML).")],
    output: Output = None,
    set_values: SetValues = [],  # noqa: B006
) -> None:
    """Run a file by its kind: reduce a job, correlate a test.

    Files of kind "job", or without `kind`, are reduced; files of kind "correlation" are compared with their model.

    Example: cms run rod.toml
    """
    from cms.errors import JobError
    from fe_models.foundation.toml_file import read_toml

    if read_toml(file, JobError).get("kind", "job") == "correlation":
        if set_values:
            raise JobError(f'{file}: kind = "correlation": --set belongs to jobs')
        correlate_command(file, [] if output is None else [output])
        return
    reduce_command([file], output, set_values=set_values)


@guarded
def frame_command(
    file: ModalFile,
    to: Annotated[str, typer.Option("--to", help="Body frame: tisserand, buckens or nodal.")],
    at: Annotated[str | None, typer.Option("--at", help="Interface that carries a nodal frame.")] = None,
    origin: Annotated[str | None, typer.Option(help="Origin of the frame in mesh coordinates, x,y,z.")] = None,
    axes: Annotated[str | None, typer.Option(help="Axes of the frame in mesh axes, x,y,z;x,y,z;x,y,z.")] = None,
    damping: Annotated[
        float | None, typer.Option(help="Ratio of the new modes; default: the damping of the file, carried over.")
    ] = None,
    heavy: Annotated[bool, typer.Option("--heavy", help="Confirm a damping ratio above 0.2.")] = False,
    units: Annotated[str | None, typer.Option(help="Write numbers in another unit system, such as m-kg-s.")] = None,
    geometric: Annotated[
        bool, typer.Option("--geometric-stiffness/--no-geometric-stiffness", help="Convert it, or leave it out.")
    ] = True,
    output: Output = None,
) -> None:
    """Convert a modal file to another body frame.

    Only the file is needed; its modes are diagonalised again.

    Without -o the new file is written beside the old one: rod.h5 gives rod_tisserand.h5.

    Example: cms frame rod.h5 --to tisserand -o rod_t.h5

    Example: cms frame rod.h5 --to nodal --at big_end
    """
    from cms.cli.frame import FrameRequest, run_frame

    print_body(run_frame(FrameRequest(file, to, at, origin, axes, damping, units, output, geometric, heavy)))


@guarded
def faces_command(
    file: Annotated[Path, typer.Argument(help="CAD file: .step .stp .iges .igs .brep.")],
    units: Annotated[str, typer.Option(help="Unit system the lengths are shown in.")] = "mm-t-s",
    select: Annotated[
        list[str] | None, typer.Option("--select", help="Only faces such as 'cylinder r=12'; repeatable.")
    ] = None,
    output: Annotated[
        Path | None, typer.Option("--output", "-o", help="Picture with the numbers of the faces (.png).")
    ] = None,
    json: Annotated[bool, typer.Option("--json", help="Write the list as JSON, for other programs.")] = False,
) -> None:
    """List the faces of a CAD file.

    Kind, area, centre, normal, radius, name and colour are given. It needs the extra mesh.

    A job can select faces by these properties: faces = ["cylinder r=12"].

    Example: cms faces part.step -o faces.png

    Example: cms faces part.step --select "cylinder r=12 hole" --json
    """
    from cms.cli.geometry import FacesRequest, run_faces

    run_faces(FacesRequest(file, units, tuple(select or ()), output, json))


@guarded
def converge_command(
    job: Annotated[Path, typer.Argument(help="Job file (TOML) of a solid or a shell.")],
    ratio: Annotated[
        float | None, typer.Option(help="Ratio of the coarser mesh size to that of a CAD job; default: 1.5.")
    ] = None,
    modes: Annotated[int, typer.Option(help="Number of elastic free modes to compare.")] = 10,
    error: Annotated[
        float, typer.Option(help="Wanted error of the frequencies, for which an element size is proposed.")
    ] = 0.01,
    output: Annotated[
        Path | None, typer.Option("--output", "-o", help="Picture of where the mesh is too coarse (.png).")
    ] = None,
    json: Annotated[bool, typer.Option("--json", help="Write the numbers as JSON, for other programs.")] = False,
    set_values: SetValues = [],  # noqa: B006
) -> None:
    """Mesh error of a job, and the element size for a wanted error.

    The errors of the free frequencies are estimated from the modes on the mesh. For a CAD job, a coarser mesh is made
    too, and the frequencies of both are compared.

    Example: cms converge part.toml

    Example: cms converge part.toml --error 0.005 -o coarse.png
    """
    from cms.cli.geometry import ConvergeRequest, run_converge

    run_converge(ConvergeRequest(job, ratio, modes, error, output, json), changes_of(set_values))


@guarded
def modes_command(
    job: Annotated[Path, typer.Argument(help="Job file (TOML), see docs/job_file.md.")],
    json: Annotated[bool, typer.Option("--json", help="Write the list as JSON, for other programs.")] = False,
    set_values: SetValues = [],  # noqa: B006
) -> None:
    """Describe the modes of a job; writes no file.

    Its columns and shapes, their order, and the frame are given.

    Example: cms modes rod.toml
    """
    from cms.cli.modes import list_modes

    list_modes(job, as_json=json, changes=changes_of(set_values))


@guarded
def formats_command(
    json: Annotated[bool, typer.Option("--json", help="Write the table as JSON, for other programs.")] = False,
) -> None:
    """Formats of other programs, and what each cannot hold.

    The table names the versions that were tested.

    Example: cms formats
    """
    from cms.cli.exchange import list_formats

    list_formats(as_json=json)


@guarded
def export_command(
    file: ModalFile,
    to: Annotated[str, typer.Option("--to", help="Format, one of those cms formats lists by name: mbsim, exudyn, ...")],
    units: Annotated[
        str | None, typer.Option(help="Unit system of the numbers, such as m-kg-s; that of the file by default.")
    ] = None,
    nodes: Annotated[str, typer.Option(help="Nodes, if the format allows both: interfaces or all.")] = "default",
    load: Annotated[
        list[str] | None, typer.Option(help="Load case that acts permanently (ext_ptfm): NAME=AMPLITUDE; repeatable.")
    ] = None,
    output: Annotated[Path | None, typer.Option("--output", "-o", help="File to write.")] = None,
) -> None:
    """Write a modal file in the format of another program.

    The command reports data that the format cannot hold.

    Example: cms export rod.h5 --to exudyn --units m-kg-s -o rod_exudyn.npz

    Example: cms export rod.h5 --to sid_fem --units m-kg-s -o rod.SID_FEM
    """
    from cms.cli.exchange import ExportRequest, run_export

    run_export(ExportRequest(file, to, units, nodes, output, tuple(load or ())))


@guarded
def recovery_command(
    file: ModalFile,
    table: Annotated[str | None, typer.Option(help="Name of the table; required if there are several.")] = None,
    rows: Annotated[
        Path | None, typer.Option(help="TOML file with tables of rows that the body knows without its model.")
    ] = None,
    over: Annotated[
        str, typer.Option(help="modes: over rigid motion and q; interfaces: Craig-Bampton, over interfaces and modes.")
    ] = "modes",
    units: Annotated[str | None, typer.Option(help="Unit system of the numbers; default: that of the body.")] = None,
    output: Annotated[
        Path | None,
        typer.Option(
            "--output", "-o", help="File: .npz, .mat, .op4, .csv, .json, .parquet, or .h5 with the tables added."
        ),
    ] = None,
) -> None:
    """List or write the recovery rows of a modal file.

    They give accelerations, stress, element and interface forces.

    Example: cms recovery tower.h5

    Example: cms recovery tower.h5 --table instruments --over interfaces -o instruments.mat

    Example: cms recovery outboard.h5 --rows accelerations.toml -o accelerations.csv
    """
    from cms.cli.exchange import RecoveryCommand, run_recovery

    run_recovery(RecoveryCommand(file, table, rows, over, units, output))


@guarded
def import_command(
    files: Annotated[list[str], typer.Argument(help="Files of one body, or of its matrices as K=FILE M=FILE.")],
    units: Annotated[str | None, typer.Option(help="Unit system of the files, such as mm-t-s; required.")] = None,
    name: Annotated[str | None, typer.Option(help="Name of the body; default: that of the first file.")] = None,
    form: Annotated[
        str | None,
        typer.Option("--format", help="Format, by its name in cms formats; default: found from the content."),
    ] = None,
    nodes: Annotated[Path | None, typer.Option(help="Deck or mesh with the positions that the files lack.")] = None,
    boundary: Annotated[
        str | None, typer.Option(help="Of bare matrices: boundary nodes in the order of the rows, 3,11,19.")
    ] = None,
    interface: Annotated[
        list[str] | None, typer.Option("--interface", help="An interface by its nodes, NAME=3,11; repeatable.")
    ] = None,
    full_mass: Annotated[
        list[str] | None, typer.Option("--full-mass", help="Mass of the full model, for 3C to 5C; repeatable.")
    ] = None,
    nodal_masses: Annotated[Path | None, typer.Option(help="Table of node and mass, instead of the full mass.")] = None,
    mesh: Annotated[Path | None, typer.Option(help="Mesh behind the body, with --density, instead.")] = None,
    density: Annotated[float | None, typer.Option(help="Density of the mesh, in the units of the files.")] = None,
    to: Annotated[str, typer.Option("--frame", help="Body frame: tisserand, buckens or nodal.")] = "tisserand",
    at: Annotated[str | None, typer.Option("--at", help="Interface that carries a nodal frame.")] = None,
    damping: Annotated[
        float | None, typer.Option(help="Ratio of every mode, added to the damping of the files.")
    ] = None,
    heavy: Annotated[bool, typer.Option("--heavy", help="Confirm a damping ratio above 0.2.")] = False,
    repair_mass: Annotated[bool, typer.Option("--repair-mass", help="Set slightly negative masses to zero.")] = False,
    accept: Annotated[list[str] | None, typer.Option(help="Findings to accept: units.")] = None,
    output: Output = None,
) -> None:
    """Read a body that another program has reduced.

    The command reports what that program did not provide.

    Example: cms import outboard.op4 --units mm-kg-s -o outboard.h5

    Example: cms import K=k.mtx M=m.mtx dofs=rows.txt --nodes model.inp --units mm-t-s -o part.h5

    Example: cms import part.op4 --units mm-t-s --nodal-masses masses.csv --interface hub=11
    """
    from cms.cli.exchange import ImportRequest, run_import

    print_body(
        run_import(
            ImportRequest(
                tuple(files),
                units,
                output,
                name,
                form,
                nodes,
                boundary,
                tuple(interface or ()),
                tuple(full_mass or ()),
                nodal_masses,
                mesh,
                density,
                to,
                at,
                damping,
                repair_mass,
                tuple(accept or ()),
                heavy,
            )
        )
    )


@guarded
def check_command(
    file: ModalFile,
    job: Annotated[Path | None, typer.Option("--job", help="Job file of the full model to compare with.")] = None,
    band: Annotated[
        float | None, typer.Option(help="Highest frequency of interest [Hz]; default: highest kept mode / 1.5.")
    ] = None,
    json: Annotated[bool, typer.Option("--json", help="Write the records as JSON, for other programs.")] = False,
    set_values: SetValues = [],  # noqa: B006
) -> None:
    """Check a modal file: one verdict per check.

    Each verdict has its reason and what to do; the exit code is 1 if a check fails.

    Without a job, the file is checked for consistency. With its job, it is compared with the full model.

    Example: cms check rod.h5

    Example: cms check rod.h5 --job rod.toml --json
    """
    from cms.cli.verdicts.check import check_file

    raise typer.Exit(check_file(file, job, band=band, as_json=json, changes=changes_of(set_values)))


@guarded
def accept_command(
    file: ModalFile,
    full: Annotated[
        Path | None, typer.Option("--job", "--full", help="Job file of the full model to compare with.")
    ] = None,
    deck: Annotated[
        Path | None, typer.Option(help="Or its deck: Abaqus, CalculiX (.inp), Nastran (.bdf), ANSYS (.cdb).")
    ] = None,
    program: Annotated[str | None, typer.Option(help="Program of a deck (.inp): calculix (default) or abaqus.")] = None,
    density: Annotated[
        list[str] | None, typer.Option(help="Density of materials of the deck without one: NAME=NUMBER; repeatable.")
    ] = None,
    band: Annotated[
        float | None, typer.Option(help="Highest frequency of interest [Hz]; default: highest kept mode / 1.5.")
    ] = None,
    most_dofs: Annotated[
        int, typer.Option(min=0, help="Largest refined model for the estimate of the mesh error; 0: no estimate.")
    ] = 600_000,
    strict: Annotated[bool, typer.Option("--strict", help="Exit with 1 for reservations too.")] = False,
    output: Annotated[
        list[Path] | None, typer.Option("--output", "-o", help="Document: .pdf, .html or .json; repeatable.")
    ] = None,
    set_values: SetValues = [],  # noqa: B006
) -> None:
    """Acceptance document of a body, to sign.

    It holds its origin, every check, effective masses and the range of validity.

    It works for own and received bodies. With a full model it also contains the comparison, and the cards of its deck
    that were left out. Exit code 0: accepted, 1: not accepted. Without -o: rod.h5 gives rod_acceptance.pdf; a PDF needs
    the extra pdf.

    Example: cms accept rod.h5 --job rod.toml -o acceptance.pdf -o acceptance.json

    Example: cms accept received.h5 --deck model.bdf --density steel=7.85e-9 -o acceptance.html
    """
    from cms.cli.verdicts.check import AcceptRequest, run_accept

    raise typer.Exit(
        run_accept(
            AcceptRequest(
                file, full, deck, program, tuple(density or ()), band, most_dofs, strict, tuple(output or ()),
                changes_of(set_values),
            )
        )
    )  # fmt: skip


@guarded
def frf_command(
    file: ModalFile,
    excited: Annotated[str, typer.Option("--from", help="Interface at which the force acts.")],
    answering: Annotated[str, typer.Option("--to", help="Interface whose motion is shown.")],
    band: Annotated[str, typer.Option(help="Frequencies [Hz], lowest:highest[:number], and more around resonances.")],
    component: Annotated[
        list[str] | None,
        typer.Option("--component", "-c", help="Motion, or motion/force, as uz or uz/ry; repeat for more [ux uy uz]."),
    ] = None,
    damping: Annotated[
        float | None, typer.Option(help="Ratio of every free-free mode; default: the file's own, 0.01 with --job.")
    ] = None,
    inertance: Annotated[bool, typer.Option("--inertance", help="Acceleration instead of displacement.")] = False,
    job: Annotated[
        Path | None, typer.Option("--job", help="Job file of the full model, to draw its response too.")
    ] = None,
    output: Annotated[
        list[Path] | None,
        typer.Option("--output", "-o", help="Picture (.png .svg .pdf) or table (.csv, ...); repeatable."),
    ] = None,
    set_values: SetValues = [],  # noqa: B006
) -> None:
    """Frequency response between interfaces of the free body.

    It leads from a force at one interface to the motion of another.

    Example: cms frf rod.h5 --from big_end --to small_end --band 10:5000 -c uz -o frf.png

    Example: cms frf rod.h5 --from big_end --to small_end --band 10:5000 --job rod.toml -o frf.png -o frf.csv
    """
    from cms.cli.frf import FrfRequest, run_frf

    run_frf(
        FrfRequest(
            file, excited, answering, band, tuple(component or ()), damping, inertance, job, tuple(output or ()),
            changes_of(set_values),
        )
    )  # fmt: skip


@guarded
def compare_command(
    job: Annotated[Path, typer.Argument(help="Job file (TOML) of the body, see docs/job_file.md.")],
    sets: Annotated[
        str, typer.Option(help="Mode sets with commas between.")
    ] = "guyan,craig-bampton,craig-bampton-ir,rubin",
    modes: Annotated[
        str, typer.Option(help="Numbers of vibration modes: from:to, from:to:step, or a list with commas.")
    ] = "0:20",
    output: Annotated[
        Path | None, typer.Option("--output", "-o", help="Folder of the report; default: beside the job.")
    ] = None,
    band: Annotated[float | None, typer.Option(help="Highest frequency of the comparison [Hz].")] = None,
    reference_modes: Annotated[int, typer.Option(help="Without --band: number of elastic free modes to compare.")] = 10,
    load: Annotated[
        list[str] | None,
        typer.Option(help="Neighbour at an interface, for loaded sets: NAME:mass=1.2,stiffness=1e4; repeatable."),
    ] = None,
    pulse_at: Annotated[str | None, typer.Option(help="Interface at which the force pulse of the motion acts.")] = None,
    motion: Annotated[
        Path | None, typer.Option(help="Reference motion instead of the pulse: .npz with u (n_dof, n_t) and t in s.")
    ] = None,
    stills: Annotated[int, typer.Option(min=0, help="Still pictures of mode shapes in the report.")] = 4,
    workers: Annotated[
        str | None,
        typer.Option(
            "--workers",
            "-j",
            help="Where sets and numbers of modes are judged: a number of processes, dask (dask:4), "
            "dask://host:port, see docs/cluster.md; default: one after the other with one factorisation.",
        ),
    ] = None,
    set_values: SetValues = [],  # noqa: B006
) -> None:
    """Compare mode sets with the full model.

    The report says which set is accurate enough, with how few modes, and why.

    The full model is solved once and stored in the folder of the report, so that a repetition is fast. To compare sets
    in the motion of a mechanism, with frames, stiffening and parts: floatframe compare (docs/laboratory.md).

    Example: cms compare rod.toml --sets craig-bampton,craig-bampton-ir,rubin --modes 0:30 -o compare

    Example: cms compare rod.toml --sets rubin,krylov,macneal --workers 3

    Example: cms compare rod.toml --sets rubin,benfield-hruda --load small_end:mass=1e-3 --band 5000
    """
    from cms.cli.verdicts.compare import CompareRequest, run_compare

    run_compare(
        CompareRequest(
            job, sets, modes, output, band, reference_modes, tuple(load or ()), pulse_at, motion, stills, workers,
            changes_of(set_values),
        )
    )  # fmt: skip


@guarded
def correlate_command(
    file: Annotated[Path, typer.Argument(help="Correlation file (TOML), see docs/test_and_model.md.")],
    outputs: Annotated[
        list[Path],
        typer.Option("--output", "-o", help="A .html, .pdf or .json file, or a table (.csv, ...); repeatable."),
    ] = [],  # noqa: B006
    updated_job: Annotated[
        Path | None, typer.Option(help="Job with the updated values to write, beside the job.")
    ] = None,
    json: Annotated[bool, typer.Option("--json", help="Write the numbers as JSON, for other programs.")] = False,
) -> None:
    """Compare measured modes with a model, and update it.

    Points, pairs, MAC, COMAC and orthogonality are compared.

    The job is updated if the file has a table [update]. Without -o the page is written beside the file: rod_test.html.

    Example: cms correlate rod_test.toml

    Example: cms correlate rod_test.toml -o report.html --updated-job rod_updated.toml
    """
    from cms.cli.verdicts.correlate import CorrelateRequest, run_correlate

    run_correlate(CorrelateRequest(file, tuple(outputs), updated_job, json))


@guarded
def split_command(
    job: Annotated[Path, typer.Argument(help="Job file (TOML) of the whole body.")],
    n: Annotated[int | None, typer.Option("--parts", help="Number of parts of equal length.")] = None,
    at: Annotated[
        str | None, typer.Option(help="Instead of --parts: cut positions along the axis, such as 40,80.")
    ] = None,
    axis: Annotated[
        str | None, typer.Option(help="Normal direction of the cuts: x, y, z or x,y,z; default: the longest axis.")
    ] = None,
    cut: Annotated[str, typer.Option(help="Interfaces at the cuts: rigid or distributing.")] = "rigid",
    output: Annotated[Path | None, typer.Option("--output", "-o", help="Folder to write to.")] = None,
    reduce: Annotated[bool, typer.Option("--reduce", help="Also reduce the parts.")] = False,
    workers: Workers = None,
) -> None:
    """Split a slender body into parts, for large deflections.

    There is an interface at each cut; each part has a frame of its own.

    It writes a job for every part, and a system file that joins them. Without -o: rod.toml gives the folder rod_parts.

    Example: cms split blade.toml --parts 4 --reduce

    Example: cms split rod.toml --at 40,80 --axis x

    Example: cms split wing.toml --parts 8 --reduce --workers dask
    """
    from cms.cli.split import SplitRequest, direction_of, places_of, split_job

    files = split_job(SplitRequest(job, n, places_of(at), direction_of(axis), cut, output))
    for path in files:
        say(f"wrote {path}")
    if reduce:
        reduce_and_write_fleet(Fleet(files[:-1], None, workers, None))


register(
    app,
    {
        "Model": {
            "demo": demo_command,
            "job": job_command,
            "faces": faces_command,
            "converge": converge_command,
            "split": split_command,
            "schema": schema_command_of("cms"),
        },
        "Reduce": {
            "run": run_command,
            "reduce": reduce_command,
            "modes": modes_command,
            "frame": frame_command,
            "family": family_command,
            "interpolate": interpolate_command,
        },
        "Judge": {
            "check": check_command,
            "accept": accept_command,
            "compare": compare_command,
            "correlate": correlate_command,
            "frf": frf_command,
        },
        "Exchange": {
            "import": import_command,
            "export": export_command,
            "recovery": recovery_command,
            "formats": formats_command,
        },
        "Look": {"info": info_command, "view": view_command, "show": show_command},
    },
)
