"""Document of an acceptance, and its files."""

import json
import math
from collections.abc import Iterable, Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np

from cms.assessment.quality.body_record import body_record, body_size, in_hertz
from cms.assessment.quality.errors import QualityError
from cms.assessment.quality.of_body.effective_mass import DIRECTIONS, EffectiveMass
from cms.assessment.rendering import Scene, Surface, Triad, render_picture
from cms.assessment.report.formatting import hertz
from cms.assessment.report.parts import records_table
from cms.assessment.report.png import png_of
from cms.assessment.report.view import view_axes
from cms.body.error_estimates import MESH_SIGNS, ErrorEstimates
from cms.body.reduced_body import ReducedBody
from cms.jobs.acceptance.acceptance import VERDICT_WORDS, Acceptance
from cms.jobs.acceptance.origin import origin_groups
from cms.jobs.acceptance.range_of_use import RangeOfUse
from fe_models.foundation.arrays import Array
from fe_models.foundation.documents.charts import Axis, Chart, Line
from fe_models.foundation.documents.document import (
    Answer,
    Block,
    Document,
    Figure,
    Paragraph,
    Picture,
    Section,
    TextTable,
)
from fe_models.foundation.documents.write import document_content
from fe_models.foundation.paths import replace_files

__all__ = ["SUFFIXES", "body_picture", "document_of", "mass_chart", "require_suffix", "write_acceptance"]


MOST_MODES = 40  #: largest number of rows in a table of modes; the JSON file has all modes
SIGNATURES = ("prepared", "checked", "released")


def document_of(acceptance: Acceptance) -> Document:
    """Return the document of an acceptance, including pictures."""
    a, u = acceptance, acceptance.body.units
    worst_of = [record for record in a.records if record.verdict in ("fail", "warn")]
    band = a.range.band
    figures = [
        (f"{a.body.moments.m:.5g} {u.mass_symbol}", "mass"),
        (str(a.body.n_q), "elastic coordinates"),
        (str(len(a.body.interfaces)), "interface" if len(a.body.interfaces) == 1 else "interfaces"),
        (f"{hertz(band.highest)} Hz", "to be used up to" if band.is_compared else "to be used up to, by custom"),
    ]
    if math.isfinite(a.mesh_error.largest):
        figures.append((f"{100 * a.mesh_error.largest:.2g} %", "mesh error of the lowest frequencies, estimated"))
    answer = a.words + "."
    if worst_of:
        answer += f" To be looked at: {', '.join(record.title for record in worst_of)}."
    sections = [
        identity_part(a),
        origin_part(a),
        checks_part(a),
        modes_part(a),
        interfaces_part(a),
        mass_part(a),
        range_part(a),
        deck_part(a),
        mesh_part(a),
    ]
    footer = f"{a.file or a.body.name}{f', digest {a.digest}' if a.digest else ''}; made {a.made} by cms accept."
    made_by = a.body.provenance.get("mode set") or a.body.provenance.get("source", "unknown mode set")
    return Document(
        f"Acceptance of the reduced body {a.body.name}",
        f"units {u.name}; {made_by}",
        Answer(answer, a.verdict, VERDICT_WORDS[a.verdict], tuple(figures)),
        tuple(
            replace(each, title=f"{k}. {each.title}", short=each.short or each.title)
            for k, each in enumerate(sections, 1)
        ),
        a.body.name,
        "acceptance",
        SIGNATURES,
        footer,
    )


def identity_part(a: Acceptance) -> Section:
    """Return the part that identifies the body."""
    body, u = body_record(a.body), a.body.units
    size, inertia = body_size(a.body), f"{u.mass_symbol} {u.length_symbol}²"
    tensor = np.array(body["inertia_about_center_of_mass"])
    frame = body["frame"]
    rows = [
        (
            "units",
            f"{u.name}: {u.length_symbol}, {u.mass_symbol}, {u.time_symbol}; {u.force_symbol}, {u.stress_symbol}",
        ),
        ("body frame B", frame["kind"] + (f" at {frame['at']}" if frame["at"] else "")),
        (f"origin of B [{u.length_symbol}]", f"{vector(frame['origin'], size)} in mesh coordinates"),
        (f"mass [{u.mass_symbol}]", f"{body['mass']:.7g}"),
        (f"centre of mass [{u.length_symbol}]", f"{vector(body['center_of_mass']['mesh'], size)} in mesh coordinates"),
        (f"inertia about it [{inertia}], axes of B", vector(tensor[0], float(np.abs(tensor).max()))),
        ("", vector(tensor[1], float(np.abs(tensor).max()))),
        ("", vector(tensor[2], float(np.abs(tensor).max()))),
        (f"principal moments [{inertia}]", vector(body["principal_moments"])),
        ("invariants of inertia", moments_words(a)),
        ("geometric stiffness", "yes" if body["geometric_stiffness"] else "none: loads and speed stiffen nothing"),
        ("stress of the modes", "yes" if body["stress"]["nodal"] or body["stress"]["points"] else "none"),
        ("kept nodes", f"{body['kept_nodes']}, {body['surface_triangles']} triangles of surface"),
    ]
    blocks: list[Block] = [TextTable(("", ""), tuple(rows), (0.32, 0.68))]
    picture = body_picture(a.body)
    if picture is not None:
        blocks.insert(0, Picture(picture, "The body with its interfaces, undeformed.", 0.8))
    return Section("identity", "What it is", tuple(blocks))


def moments_words(a: Acceptance) -> str:
    """Return how accurately the inertia terms are known."""
    moments = a.body.moments
    if moments.missing:
        return f"missing: {', '.join(moments.missing)}; to be trusted: {moments.trust}"
    return "1C to 5C, exact integrals" if moments.is_exact else "1C to 5C, approximate (from matrices without elements)"


def origin_part(a: Acceptance) -> Section:
    """Return the part about the origin of the body."""
    rows = [(source.path, source.digest, source.state) for source in a.sources]
    blocks: list[Block] = []
    if a.file:
        blocks.append(Paragraph(f"Modal file {a.file}; digest of its contents {a.digest}."))
    if rows:
        caption = "Files the body was made from, as its file has them on record, and whether they are still the same."
        blocks.append(TextTable(("file", "sha256", "today"), tuple(rows), (0.3, 0.52, 0.18), 2, caption))
    else:
        blocks.append(Paragraph("The file has no digest of a file that it was made from."))
    for title, words in origin_groups(a.body.provenance).items():
        blocks.append(TextTable((title, ""), tuple(words.items()), (0.32, 0.68)))
    return Section("origin", "Where it came from", tuple(blocks), short="Origin")


def checks_part(a: Acceptance) -> Section:
    """Return the part with all checks."""
    against = f"Compared with {a.compared_with}." if a.compared_with else (
        "No full model was given: frequencies, statics and responses are not compared with anything."
    )  # fmt: skip
    return Section("checks", "Checks", (Paragraph(against), records_table(a.records)))


def modes_part(a: Acceptance) -> Section:
    """Return the part with modes of the file, and free frequencies compared with those of the full model."""
    modes = body_record(a.body)["modes"]
    rows = tuple(
        (
            str(mode["number"]),
            "static" if mode["frequency_hz"] is None else f"{mode['frequency_hz']:.6g}",
            "" if not mode["damping_ratio"] else f"{100 * mode['damping_ratio']:.3g}",
            mode["label"],
        )
        for mode in modes[:MOST_MODES]
    )
    caption = "Modes with the body frame held" + more_words(len(modes))
    blocks: list[Block] = [
        TextTable(("mode>", "Hz>", "damping %>", "energy from"), rows, (0.08, 0.16, 0.14, 0.62), None, caption)
    ]
    compared = next((record for record in a.records if record.name == "frequency-error" and record.data), None)
    if compared is not None:
        full, own = np.asarray(compared.data["full_hz"], float), np.asarray(compared.data["reduced_hz"], float)
        error = np.asarray(compared.data["error"], float)
        free = tuple(
            (str(k + 1), f"{full[k]:.6g}", f"{own[k]:.6g}" if k < len(own) else "none",
             f"{100 * error[k]:+.3g}" if np.isfinite(error[k]) else "none")
            for k in range(min(len(full), MOST_MODES))
        )  # fmt: skip
        caption = "Elastic frequencies of the free body, in the band that was compared" + more_words(len(full))
        blocks.append(
            TextTable(("mode>", "full model Hz>", "reduced Hz>", "error %>"), free, (0.1, 0.3, 0.3, 0.3), None, caption)
        )
    if a.body.errors is not None and len(a.body.errors.frequency):
        blocks.append(errors_table(a.body, a.body.errors))
    return Section("modes", "Modes", tuple(blocks))


def errors_table(body: ReducedBody, errors: ErrorEstimates) -> TextTable:
    """Return the errors of the free frequencies by the reduction and by the mesh that the file has on record."""

    def percent(values: Array, k: int, sign: str) -> str:
        if k >= len(values) or not np.isfinite(values[k]):
            return ""
        return f"{sign if values[k] > 0 else ''}{100 * values[k]:.2g}"

    sign = MESH_SIGNS.get(errors.mesh_sign, "")
    frequencies = in_hertz(body, body.free_frequencies)
    rows = tuple(
        (str(k + 1), f"{frequencies[k]:.6g}", percent(errors.frequency, k, "+") + " ?" * bool(errors.is_uncertain[k]),
         percent(errors.largest, k, ""), percent(errors.mesh, k, sign))
        for k in range(min(len(errors.frequency), MOST_MODES))
    )  # fmt: skip
    caption = (
        "Estimated errors of the free frequencies, from the modal file: by the reduction (?: uncertain), the most that "
        "modes beyond the set can cause, and by the mesh"
    )
    headings = ("mode>", "Hz>", "reduction %>", "at most %>", "mesh %>")
    shown = caption + more_words(len(errors.frequency))
    return TextTable(headings, rows, (0.1, 0.24, 0.22, 0.22, 0.22), None, shown)


def more_words(n: int) -> str:
    """State how many rows are omitted."""
    return "." if n <= MOST_MODES else f"; the first {MOST_MODES} of {n}, the JSON file has all."


def interfaces_part(a: Acceptance) -> Section:
    """Return the part with the interfaces and their nodes."""
    size, length = body_size(a.body), a.body.units.length_symbol
    rows = []
    for interface, record in zip(a.body.interfaces, body_record(a.body)["interfaces"], strict=True):
        nodes = [a.body.numbering.node_name(k) for k in interface.members]
        shown = ", ".join(nodes[:8]) + (", ..." if len(nodes) > 8 else "")
        rows.append((interface.name, interface.kind, vector(record["position_mesh"], size), str(len(nodes)), shown))
    if not rows:
        return Section("interfaces", "Interfaces", (Paragraph("The body has no interface."),))
    headings = ("name", "kind", f"place in mesh coordinates [{length}]", "nodes>", "which")
    return Section("interfaces", "Interfaces", (TextTable(headings, tuple(rows), (0.17, 0.13, 0.3, 0.08, 0.32)),))


def mass_part(a: Acceptance) -> Section:
    """Return the part with effective masses and their sums."""
    if not a.masses:
        words = "No interface can be held and driven, so there is no effective mass."
        return Section("mass", "Effective mass", (Paragraph(words),))
    blocks: list[Block] = [
        Paragraph(
            "Share of mass and inertia that each mode puts into motion while one interface is held and driven, axes of "
            "B, inertia about that interface; below each share the sum up to this mode. What no mode carries sits on "
            "the interface itself, or belongs to modes that are left out."
        )
    ]
    for found in a.masses:
        words = f"Sum of the effective mass, {found.at} held and driven."
        blocks += [Figure(f"mass-{len(blocks)}", mass_chart(found), words), mass_table(found)]
    return Section("mass", "Effective mass", tuple(blocks))


def mass_table(found: EffectiveMass) -> TextTable:
    """Return the shares and sums of one interface."""
    rows = [
        (str(k + 1), f"{found.frequencies[k]:.5g}",
         *(f"{100 * s:.2f}\n{100 * c:.1f}" for s, c in zip(found.share[k], found.cumulative[k], strict=True)))
        for k in range(min(len(found.frequencies), MOST_MODES))
    ]  # fmt: skip
    rows.append(("", "in no mode", *(f"{100 * rest:.1f}" for rest in found.remainder)))
    headings = ("mode>", "Hz>", *(f"{name} %>" for name in DIRECTIONS))
    caption = f"{found.at} held and driven" + more_words(len(found.frequencies))
    return TextTable(headings, tuple(rows), (0.08, 0.16, *[0.76 / 6] * 6), None, caption)


def range_part(a: Acceptance) -> Section:
    """Return the part about the range of use."""
    r, u = a.range, a.body.units
    blocks: list[Block] = [Paragraph(f"Frequencies: up to {hertz(r.band.highest)} Hz ({r.band.words}).")]
    if r.speed is not None:
        words = (
            f"Angular speed: up to {r.speed.linear:.4g} rad/s without geometric stiffness, {r.limits.speed:g} of the "
            f"lowest frequency with one interface held ({hertz(r.speed.lowest_held)} Hz, {r.speed.at})"
        )
        if r.speed.stiffened is not None and r.stiffened_limits is not None:
            words += f"; with it up to {r.speed.stiffened:.4g} rad/s"
        blocks.append(Paragraph(words + "."))
    else:
        blocks.append(Paragraph("Angular speed: not known; no interface can be held, or inertia terms are missing."))
    loads = r.strictest()
    if loads:
        blocks.append(
            Paragraph(
                f"Loads and deflection: a linear body frame holds until an interface turns by {r.limits.rotation:g} "
                f"rad against it, or a load changes the stiffness by {100 * r.limits.load:g} %"
                f"{stiffened_words(r)}. For each interface the force and the moment that reach it first, alone, in "
                "the balance of the body frame; strength is another question."
            )
        )
        headings = ("interface", "load", "linear>", "with geometric stiffness>", f"deflection [{u.length_symbol}]>",
                    "ends by")  # fmt: skip
        rows = tuple(
            (load.interface, f"{load.direction} [{load.unit}]", magnitude(load.linear),
             "" if load.stiffened is None else magnitude(load.stiffened), f"{load.deflection:.3g}", load.governed_by)
            for load in loads
        )  # fmt: skip
        blocks.append(TextTable(headings, rows, (0.18, 0.2, 0.14, 0.18, 0.13, 0.17)))
    return Section("range", "What it is good for", tuple(blocks), short="Range of use")


def stiffened_words(r: RangeOfUse) -> str:
    """Return the limits with geometric stiffness; an empty text if the file has none."""
    limits = r.stiffened_limits
    if limits is None:
        return ""
    return f"; with geometric stiffness to {limits.rotation:g} rad, or {limits.load:g} of the load that buckles"


def magnitude(value: float) -> str:
    """Return a load as text; a load without deformation has no limit."""
    return f"{value:.3g}" if math.isfinite(value) else "any"


def deck_part(a: Acceptance) -> Section:
    """Return the part about data of the deck that the model omits."""
    if a.left_out is None:
        words = "There is no deck beside the body, so nothing can be said of what was left out of it."
        return Section("deck", "Left out of the deck", (Paragraph(words),), short="Left out")
    if not a.left_out:
        words = "Every card of the deck is taken over."
        return Section("deck", "Left out of the deck", (Paragraph(words),), short="Left out")
    rows = tuple(
        ("warn" if each.is_body else "info", each.name, str(each.count), each.consequence)
        for each in sorted(a.left_out, key=lambda each: not each.is_body)
    )
    words = "Cards that the full model does not take over; those marked carry mass or stiffness."
    table = TextTable(("", "card", "count>", "consequence"), rows, (0.08, 0.24, 0.1, 0.58), 0)
    return Section("deck", "Left out of the deck", (Paragraph(words), table), short="Left out")


def mesh_part(a: Acceptance) -> Section:
    """Return the part about the mesh error."""
    error = a.mesh_error
    blocks: list[Block] = [Paragraph(error.words[0].upper() + error.words[1:] + ".")]
    if error.estimate is not None:
        first, second = error.estimate.frequencies
        rows = tuple(
            (str(k + 1), f"{f_1:.6g}", f"{f_2:.6g}", f"{100 * e:+.2g}")
            for k, (f_1, f_2, e) in enumerate(zip(first, second, error.estimate.error, strict=True))
        )
        labels = [f"{n} dofs, Hz>" for n in error.estimate.n_dof]
        blocks.append(TextTable(("mode>", *labels, "estimated error %>"), rows, (0.1, 0.3, 0.3, 0.3)))
    return Section("mesh", "Error of the mesh", tuple(blocks), short="Mesh")


def vector(values: Sequence[float] | Iterable[float], scale: float | None = None) -> str:
    """Return numbers as one line of text.

    Rounding errors relative to the scale (default: the largest number) are printed as 0.
    """
    given = [float(value) for value in values]
    least = 1e-12 * (max(map(abs, given), default=0.0) if scale is None else scale)
    return ", ".join(f"{value if abs(value) > least else 0:.6g}" for value in given)


# pictures of an acceptance: the body with its interfaces, and sums of effective mass ----------------------------------


SIZE = (1280, 640)  #: width and height of the picture of a body [px]
COLORS = ("#0072B2", "#D55E00", "#009E73", "#56B4E9", "#E69F00", "#CC79A7")


def body_picture(body: ReducedBody) -> bytes | None:
    """Return a PNG of the undeformed body with the axes of its interfaces; None if it has no surface."""
    if len(body.surface) == 0:
        return None
    on_surface = body.nodes[np.unique(body.surface)]
    diagonal = float(np.linalg.norm(np.ptp(on_surface, axis=0)))
    direction, up = view_axes(on_surface)
    scene = Scene(
        surfaces=(Surface(body.surface, body.nodes, color="#9fb3c8", name=body.name),),
        triads=tuple(
            Triad(interface.position[None], np.asarray(interface.triad)[None], 0.06 * diagonal, interface.name)
            for interface in body.interfaces
        ),
        title="",
        direction=direction,
        up=up,
        size=SIZE,
    )
    return png_of(lambda path: render_picture(scene, path), "the acceptance")


def mass_chart(found: EffectiveMass) -> Chart:
    """Return the chart of cumulative effective mass over frequency, one line for each direction."""
    frequencies, sums = np.asarray(found.frequencies), 100 * found.cumulative
    last = float(frequencies[-1]) * 1.05 if len(frequencies) else 1.0
    x = np.concatenate([[0.0], frequencies, [last]])
    lines = [
        Line(x, np.concatenate([[0.0], sums[:, k], sums[-1:, k]]), name, COLORS[k], "solid" if k < 3 else "dash", 1.5,
             is_step=True)
        for k, name in enumerate(DIRECTIONS) if found.total[k] > 0
    ]  # fmt: skip
    across = Axis("frequency with the interface held [Hz]", range=(0.0, last))
    return Chart(across, (Axis("sum of effective mass [%]", range=(0.0, 105.0)),), tuple(lines), 280)


# its files ------------------------------------------------------------------------------------------------------------


SUFFIXES = (".pdf", ".html", ".json")


def write_acceptance(acceptance: Acceptance, *paths: str | Path) -> None:
    """Write an acceptance in one or several forms; all files are complete, or none is written.

    Raises
    ------
    QualityError
        If a suffix is not .pdf, .html or .json, or a file cannot be written.
    MissingExtraError
        If a PDF is wanted and reportlab (extra `pdf`) is not installed.
    """
    targets = [Path(path) for path in paths]
    for target in targets:
        require_suffix(target)
    document = document_of(acceptance) if any(target.suffix.lower() != ".json" for target in targets) else None
    contents = {}
    for target in targets:
        if target.suffix.lower() == ".json" or document is None:
            contents[target] = (json.dumps(acceptance.as_dict(), indent=2) + "\n").encode()
        else:
            contents[target] = document_content(document, target.suffix)
    try:
        replace_files(contents)
    except OSError as error:
        raise QualityError(
            f"acceptance: cannot be written: {error.strerror or error}; check folder and space"
        ) from error


def require_suffix(path: Path) -> None:
    """Raise `QualityError` unless the suffix is one of `SUFFIXES`."""
    if path.suffix.lower() not in SUFFIXES:
        raise QualityError(
            f"{path}: an acceptance is written as {', '.join(SUFFIXES)}; got {path.suffix or 'no suffix'}"
        )
