"""The commands for driven systems: kinematics, inverse."""

import json as json_module
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from cms.cli.arguments import SetValues, changes_of
from cms.cli.console import guarded, output_path, print_table, say, say_written, stages

if TYPE_CHECKING:
    from floatframe.model.system import System
    from floatframe.results.sensors.measurement import Measurement
    from floatframe.results.trajectory import Trajectory

__all__ = ["inverse_command", "kinematics_command"]

SystemArgument = Annotated[Path, typer.Argument(help="System file (TOML) whose drives decide the motion.")]
Json = Annotated[bool, typer.Option("--json", help="Write the same record as JSON, for other programs.")]


@guarded
def kinematics_command(
    system: SystemArgument,
    output: Annotated[Path | None, typer.Option("--output", "-o", help="Results file to write.")] = None,
    elastic: Annotated[
        str, typer.Option(help="Flexible bodies: frozen (keep their shape) or quasi-static (no vibrations).")
    ] = "frozen",
    json: Json = False,
    set_values: SetValues = [],  # noqa: B006
) -> None:
    """Motion of a fully driven system, without integration.

    The prescribed motions of the file must determine all positions; coordinates that they leave free are named. The
    output times are those of a run: t_end, h and output_every of [run]. The results, crank.kinematics.h5 for
    crank.toml, can be used like those of a run for plot, animate and export.

    Example: floatframe kinematics crank.toml
    """
    model, motion, path = driven_motion(system, output, ".kinematics.h5", elastic, set_values)
    record = coordinates_record(model, motion)
    if json:
        typer.echo(json_module.dumps(record | {"results": str(path)}, indent=2))
        return
    print_coordinates(record)
    say(f"{record['n_times']} times from {record['t_first']:g} to {record['t_last']:g} {model.units.time_symbol}")
    say_written(path)


@guarded
def inverse_command(
    system: SystemArgument,
    output: Annotated[Path | None, typer.Option("--output", "-o", help="Results file to write.")] = None,
    elastic: Annotated[
        str, typer.Option(help="Flexible bodies: quasi-static (no vibrations), frozen, or dynamic (integrated).")
    ] = "quasi-static",
    json: Json = False,
    set_values: SetValues = [],  # noqa: B006
) -> None:
    """Inverse dynamics: loads of drives and joint reactions.

    The output times are those of a run: t_end, h and output_every of [run]. With --elastic dynamic, the motion is
    integrated as by floatframe run, including vibrations.

    Example: floatframe inverse crank.toml

    Example: floatframe inverse robot.toml --elastic dynamic --json
    """
    import numpy as np

    model, motion, path = driven_motion(system, output, ".inverse.h5", elastic, set_values)
    record = coordinates_record(model, motion)
    record["reactions"] = {
        name: {
            "largest_force": float(np.linalg.norm(motion.reaction(name).force, axis=1).max()),
            "largest_moment": float(np.linalg.norm(motion.reaction(name).moment, axis=1).max()),
        }
        for name in motion.connection_names
    }
    if json:
        typer.echo(json_module.dumps(record | {"results": str(path)}, indent=2))
        return
    units = model.units
    force, moment = units.force_symbol, f"{units.force_symbol} {units.length_symbol}"
    ranges = ("force_least", "force_greatest", "force_rms")
    print_table(
        "Drives",
        ("coordinate", "unit", "least>", "greatest>", "rms>", f"greatest power [{moment}/{units.time_symbol}]>"),
        [
            (name, drive["force_unit"], *(f"{drive[key]:.6g}" for key in ranges), f"{drive['power_greatest']:.6g}")
            for name, drive in record["coordinates"].items()
            if drive["is_driven"]
        ],
    )  # fmt: skip
    print_table(
        "Joints and springs: largest over time",
        ("", f"force [{force}]>", f"moment [{moment}]>"),
        [(name, f"{r['largest_force']:.6g}", f"{r['largest_moment']:.6g}") for name, r in record["reactions"].items()],
    )
    say(f"{record['n_times']} times from {record['t_first']:g} to {record['t_last']:g} {units.time_symbol}")
    say_written(path)


def driven_motion(
    file: Path, output: Path | None, suffix: str, elastic: str, set_values: Sequence[str]
) -> "tuple[System, Trajectory, Path]":
    """Compute the motion determined by the drives of a system file; return system, motion and path of the results."""
    from fe_models.foundation.words import nearest
    from floatframe.analyses.driven.driven_motion import ELASTICITY
    from floatframe.analyses.driven.kinematics import kinematics
    from floatframe.errors import ModelError, ResultsError
    from floatframe.files.system_file.read_system import read_system
    from floatframe.files.system_file.run_section import required_run
    from floatframe.simulation.integrate import integrate

    choices = [*ELASTICITY, *(["dynamic"] if suffix == ".inverse.h5" else [])]
    if elastic not in choices:
        raise ModelError(f"--elastic {elastic}: expected one of {', '.join(choices)}{nearest(elastic, choices)}")
    model, given = read_system(file, changes_of(set_values))
    run = required_run(given, file, begins_there=True)
    path = output_path(output, file.with_suffix(suffix), ResultsError, overwrite_of=(file, *model.files))
    with stages(remaining=True) as clock, clock(f"{model.name}: motion of the drives") as advance:
        if elastic == "dynamic":
            motion = integrate(
                model, run.integrator, run.t_end, run.h, output=path, output_every=run.output_every,
                progress=lambda p: advance(p.n_steps / p.n_total), watch=run.watch, state=run.start_state(model),
            )  # fmt: skip
        else:
            motion = kinematics(
                model, run.output_times(), elasticity=ELASTICITY[elastic], output=path,
                progress=lambda done, all_: advance(done / all_),
            )  # fmt: skip
    return model, motion, path


def coordinates_record(system: "System", motion: "Trajectory") -> dict[str, Any]:
    """Return ranges of all joint coordinates, and forces of the driven ones, in plain types."""
    from floatframe.results.sensors import coordinate_sensors, measured
    from floatframe.results.small_motions.joint_rates import driven_coordinates

    driven = driven_coordinates(system)
    return {
        "system": system.name,
        "units": system.units.name,
        "n_times": len(motion.t),
        "t_first": float(motion.t[0]),
        "t_last": float(motion.t[-1]),
        "coordinates": {
            name: coordinate_record(coordinate, name in driven)
            for name, coordinate in measured(system, motion, coordinate_sensors(system)).items()
        },
    }


def coordinate_record(coordinate: "Measurement", is_driven: bool) -> dict[str, Any]:
    """Return the ranges of a coordinate, of its rate and, if it is driven, of its force."""
    import numpy as np

    value, rate, force = coordinate.value, coordinate.rate, coordinate.force
    record: dict[str, Any] = {
        "is_driven": is_driven,
        "unit": coordinate.units["value"],
        "least": float(value.min()),
        "greatest": float(value.max()),
        "rate_least": float(rate.min()),
        "rate_greatest": float(rate.max()),
    }
    if is_driven:
        record |= {
            "force_unit": coordinate.units["force"],
            "force_least": float(force.min()),
            "force_greatest": float(force.max()),
            "force_rms": float(np.sqrt((force**2).mean())),
            "power_greatest": float((force * rate).max()),
        }
    return record


def print_coordinates(record: dict[str, Any]) -> None:
    """Print the ranges of the joint coordinates."""
    from fe_models.foundation.units import unit_system

    second = unit_system(record["units"]).time_symbol
    print_table(
        "Joint coordinates",
        ("coordinate", "unit", "least>", "greatest>", f"least rate [1/{second}]>", f"greatest rate [1/{second}]>", ""),
        [
            (name, c["unit"], *(f"{c[key]:.6g}" for key in ("least", "greatest", "rate_least", "rate_greatest")),
             "driven" if c["is_driven"] else "")
            for name, c in record["coordinates"].items()
        ],
    )  # fmt: skip
