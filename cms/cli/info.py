"""`cms info`: the content of a modal file, as tables or as JSON."""

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from cms.cli.arguments import ModalFile
from cms.cli.console import guarded, hertz, print_table, say, vector_words

if TYPE_CHECKING:
    from cms.body.reduced_body import ReducedBody

__all__ = ["info_command", "info_record", "print_body"]

ROUNDING = 1e-9  #: relative error, below which the output says "exact"
MOST_SETS = 20  #: largest number of sets in the output


def info_record(file: Path, units: str | None = None, mass_at: str | None = None) -> str:
    """Return the content of a modal file as JSON, with effective masses if an interface is named."""
    import json

    from cms.assessment.quality.body_record import body_record, effective_mass_record
    from cms.body.modal_file.file import digest, read

    body = read(file, units=units)
    more = {} if mass_at is None else {"effective_mass": effective_mass_record(body, mass_at)}
    return json.dumps({**body_record(body), **more, "digest": digest(file)}, indent=2)


def print_body(body: "ReducedBody", *, everything: bool = False, has_warned: bool = False) -> None:
    """Print mass properties, modes and interfaces of a body.

    Parameters
    ----------
    everything
        Whether to print its provenance too.
    has_warned
        Whether the command has warned of implausible units of this body before; the table then leaves them out.
    """
    from cms.assessment.quality.body_record import body_record, body_size
    from cms.body.reduced_body import unit_findings
    from cms.reduction.basis.damping import provenance_for_readers

    record = body_record(body)
    length, mass, inertia = (
        body.units.length_symbol, body.units.mass_symbol, f"{body.units.mass_symbol} {body.units.length_symbol}²"
    )  # fmt: skip
    frame = record["frame"]
    tensor, largest = record["inertia_about_center_of_mass"], record["principal_moments"][-1]
    size = body_size(body)
    rows = [
        ("name", record["name"]),
        ("units", f"{body.units.name} (force {body.units.force_symbol}, stress {body.units.stress_symbol})"),
        *[("warning", text) for _, text in ([] if has_warned else unit_findings(body))],
        ("frame B", frame["kind"] + (f" at {frame['at']}" if frame["at"] else "")),
        *([("held", "to the ground, as declared: no floating frame can take it")] if record["is_held"] else []),
        ("origin of B", f"{vector_words(frame['origin'], size)} {length} (mesh coordinates)"),
        *[(f"{a} axis of B", f"{vector_words(axis, 1.0)} (mesh axes)") for a, axis in turned_axes(frame["axes"])],
        ("mass", f"{record['mass']:.6g} {mass}"),
        ("centre of mass", f"{vector_words(record['center_of_mass']['B'], size)} {length} (in B)"),
        ("", f"{vector_words(record['center_of_mass']['mesh'], size)} {length} (mesh coordinates)"),
        ("inertia about it", f"{vector_words(tensor[0], largest)} {inertia} (axes of B)"),
        ("", vector_words(tensor[1], largest)),
        ("", vector_words(tensor[2], largest)),
        ("principal moments", f"{vector_words(record['principal_moments'])} {inertia}"),
        ("mass moments", moments_words(record)),
        *(
            [("inertia missing", ", ".join(body.moments.missing)), ("to be trusted", body.moments.trust)]
            if body.moments.missing
            else []
        ),
        ("kept nodes", f"{record['kept_nodes']}, {record['surface_triangles']} triangles of surface"),
        *numbering_rows(record["numbering"]),
        ("stress of modes", stress_words(record["stress"])),
        ("geometric stiffness", stiffening_words(record)),
        *([("quadratic modes", "second order at the kept nodes")] if record["quadratic_modes"] else []),
    ]
    print_table("Body", ("", ""), rows)
    print_table(
        "Modes (the frame B held)",
        ("mode>", "Hz>", "damping>", "energy from"),
        [
            (mode["number"], hertz(mode["frequency_hz"]), percent(mode["damping_ratio"]), mode["label"])
            for mode in record["modes"]
        ],
    )
    print_free_frequencies(record)
    if selected := record["provenance"].get("mode set selected"):
        say(f"Selected: {selected}\n")
    if left_out := record["provenance"].get("geometric stiffness"):
        say(f"{left_out[0].upper()}{left_out[1:]}\n")
    print_table(
        "Interfaces",
        ("name", "kind", "nodes>", f"position in B [{length}]"),
        [(i["name"], i["kind"], i["nodes"], vector_words(i["position"], size)) for i in record["interfaces"]],
    )
    if sets := record["numbering"]["sets"]:
        print_table(
            "Sets of the mesh",
            ("name", "of", "in the mesh>", "kept>"),
            [(each["name"], each["kind"], each["size"], each["kept"]) for each in sets[:MOST_SETS]],
        )
        if len(sets) > MOST_SETS:
            say(f"and {len(sets) - MOST_SETS} further sets: cms info --json lists all\n")
    if record["recovery"]:
        print_table(
            "Recovery tables (cms recovery lists their rows)",
            ("name", "rows>", "of", "loads of the static part>"),
            [
                (t["name"], t["rows"], ", ".join(f"{n} {what}" for what, n in t["quantities"].items()), t["loads"])
                for t in record["recovery"]
            ],
        )
    force = body.units.force_symbol
    if record["load_cases"]:
        print_table(
            "Load cases (of amplitude 1, in B)",
            ("name", "kind", f"force [{force}]", f"torque about the origin [{force} {length}]"),
            [
                (c["name"], c["kind"], vector_words(c["force"], scale), vector_words(c["torque"], scale * size))
                for c, scale in ((case, load_scale(case, record["mass"])) for case in record["load_cases"])
            ],
        )
    if everything:
        told = provenance_for_readers(record["provenance"])
        width = max(map(len, told), default=0)
        say("\n".join(("Provenance", *(f"{key:<{width}}  {words}" for key, words in told.items()))))


def print_free_frequencies(record: Any) -> None:
    """Print the frequencies of the free body, with their estimated errors if these are known."""
    from cms.body.error_estimates import MESH_SIGNS

    title = "Frequencies as held" if record["is_held"] else "Free-free frequencies"
    frequencies, errors = [hertz(f) for f in record["free_frequencies_hz"]], record["errors"]
    if errors is None:
        say(f"{title} [Hz]: {', '.join(frequencies) or 'none'}\n")
        return
    n, mesh = len(errors["frequency"]), errors["mesh"]
    of_mesh = [error_percent(error, MESH_SIGNS[errors["mesh_sign"]]) for error in mesh]
    print_table(
        f"{title}, and their estimated errors by the reduction{' and by the mesh' if of_mesh else ''}",
        (
            "mode>",
            "Hz>",
            "reduction>",
            *(["at most>"] if errors["largest"] else []),
            "shape>",
            *(["response>"] if errors["response"] else []),
            *(["mesh>"] if of_mesh else []),
        ),
        [
            (
                str(k + 1),
                frequencies[k],
                error_percent(errors["frequency"][k], "+") + " ?" * errors["is_uncertain"][k],
                *map(error_percent, errors["largest"][k : k + 1]),
                error_percent(errors["shape"][k]),
                *map(error_percent, errors["response"][k : k + 1]),
                *of_mesh[k : k + 1],
            )
            for k in range(n)
        ],
    )
    say(
        "reduction: an estimate, and the true error is not smaller; at most: the largest error that modes beyond the "
        "cutoff of the set can cause, empty without a limit; shape: in the norm of strain energy; response: estimate "
        "for the receptance between the interfaces around this frequency, with 1 % damping"
    )
    if any(errors["is_uncertain"]):
        say("?: uncertain, a mode that the set lacks may be near: the error may be more than five times the estimate")
    if errors["mesh_method"]:
        say(f"mesh: {errors['mesh_method']}")
    if len(frequencies) > n:
        say(f"not judged [Hz]: {', '.join(frequencies[n:])}")
    for words, labels, values in (
        ("unit loads at the interfaces", errors["interface_loads"], errors["interface"]),
        ("rigid-body accelerations with fixed interfaces", None, errors["inertia"]),
    ):
        known = [(value, k) for k, value in enumerate(values) if value is not None]
        if known:
            worst, k = max(known)
            at = "" if labels is None or not worst else f", of {labels[k]!r}"
            say(f"static responses to {words}: {'exact' if not worst else 'error up to ' + error_percent(worst) + at}")
    say("")


def error_percent(value: float | None, sign: str = "") -> str:
    """Return a relative error in percent with two digits; "exact" if it is rounding, "" if it is not known.

    A negative error has its own sign.
    """
    if value is None:
        return ""
    return "exact" if abs(value) < ROUNDING else f"{sign if value > 0 else ''}{100 * value:.2g} %"


def stiffening_words(record: Any) -> str:
    """Describe which loads stiffen the body, or why no load does."""
    is_told = "geometric stiffness" in record["provenance"]
    if record["geometric_stiffness"]:
        return f"spin, accelerations, {'loads at some interfaces, see below' if is_told else 'interface loads'}"
    return "none: left out for its size, see below" if is_told else "none"


def numbering_rows(record: Any) -> list[tuple[str, str]]:
    """Return the ranges of the user's numbers, and the points with rotations, as table rows."""
    rows = []
    for what in ("node", "element"):
        found = record[f"{what}s"]
        words = "not on record: told by index" if found is None else (
            f"{found['count']}, from {found['from']} to {found['to']}"
        )  # fmt: skip
        if what == "node" or found is not None:
            rows.append((f"{what} numbers", words))
    if record["instances"]:
        rows.append(("instances", ", ".join(record["instances"])))
    if points := record["points_with_rotations"]:
        rows.append(("nodes that turn", ", ".join(f"{count} by {word}" for word, count in points.items())))
    return rows


def turned_axes(axes: Any) -> list[tuple[str, Any]]:
    """Return the axes of B by name; an empty list if they equal the mesh axes."""
    columns = [[row[k] for row in axes] for k in range(3)]
    unit = [[float(i == k) for i in range(3)] for k in range(3)]
    return [] if columns == unit else list(zip("xyz", columns, strict=True))


def load_scale(case: Any, mass: float) -> float:
    """Return the size of the forces of a load case from its resultant and modal forces, even if it is balanced."""
    return max(map(abs, [*case["force"], *(h * mass**0.5 for h in case["modal_forces"])]), default=0.0)


def moments_words(record: Any) -> str:
    """Describe the accuracy of the mass moments."""
    if not record["moments_are_exact"]:
        return "approximate (from bare matrices)"
    return "exact, as far as they are known" if record["missing_inertia_terms"] else "exact"


def stress_words(stress: Any) -> str:
    """Describe at which points the modes have stress."""
    places = ["at the kept nodes"] if stress["nodal"] else []
    places += [f"at {stress['points']} points"] if stress["points"] else []
    return " and ".join(places) or "not kept"


def percent(value: float | None) -> str:
    """Return a damping ratio in percent."""
    return "" if not value else f"{100 * value:.3g} %"


@guarded
def info_command(
    file: ModalFile,
    json: Annotated[bool, typer.Option("--json", help="Write the same record as JSON, for other programs.")] = False,
    units: Annotated[str | None, typer.Option(help="Show numbers in another unit system, such as m-kg-s.")] = None,
    mass_at: Annotated[
        str | None,
        typer.Option("--effective-mass", help="Effective mass of every mode while this interface is held and driven."),
    ] = None,
) -> None:
    """Content of a modal file: mass, frame, modes, provenance.

    Example: cms info rod.h5 --json

    Example: cms info rod.h5 --units m-kg-s

    Example: cms info rod.h5 --effective-mass big_end
    """
    if json:
        typer.echo(info_record(file, units, mass_at))
        return
    from cms.body.modal_file.file import digest, read

    body = read(file, units=units)
    if mass_at is not None:
        print_effective_mass(body, mass_at)
        return
    print_body(body, everything=True)
    say(f"digest {digest(file)}")


def print_effective_mass(body: "ReducedBody", at: str) -> None:
    """Print the share of every mode in mass and inertia, and cumulative sums, while an interface is driven."""
    from cms.assessment.quality.of_body.effective_mass import DIRECTIONS, effective_mass_at

    found = effective_mass_at(body, at)
    shares, sums = 100 * found.share, 100 * found.cumulative
    where = f"the ground driven, about {at!r}" if body.is_held else f"{at!r} held and driven"
    mass, length = body.units.mass_symbol, body.units.length_symbol
    headings = ("mode>", "Hz>", *(f"{name} %>" for name in DIRECTIONS), *(f"sum {name}>" for name in DIRECTIONS))
    rows = [
        (k + 1, hertz(found.frequencies[k]), *(f"{x:.2f}" for x in shares[k]), *(f"{x:.1f}" for x in sums[k]))
        for k in range(len(found.frequencies))
    ]
    print_table(f"Effective mass of {body.name}, {where}, axes of B", headings, rows)
    totals = [f"{name} {total:.6g}" for name, total in zip(DIRECTIONS, found.total, strict=True)]
    say(f"100 %: {', '.join(totals)} ({mass}, {mass} {length}²)")
    rest = ", ".join(f"{name} {100 * x:.1f} %" for name, x in zip(DIRECTIONS, found.remainder, strict=True))
    say(f"In no mode (on the interface itself, or of higher modes): {rest}")
