"""The fatigue report as a document: first the life, then the data it is based on."""

from collections.abc import Sequence
from itertools import cycle
from typing import Any

import numpy as np

from cms.assessment.report.png import png_of
from fe_models.foundation.arrays import Array
from fe_models.foundation.documents.charts import INK, Axis, Chart, Line
from fe_models.foundation.documents.document import Answer, Cell, Document, Figure, Picture, Section, TextTable
from floatframe.durability.fatigue.assessment import Assessment
from floatframe.durability.fatigue.criteria import CRITERIA
from floatframe.durability.fatigue.kernels.cycle_kernels import collect, cycle_rule, equivalent_amplitude
from floatframe.durability.fatigue.load_blocks import LoadBlock
from floatframe.durability.fatigue.outputs import fatigue_record, render_fatigue
from floatframe.durability.fatigue.places import Places, frames_of_places, stress_of_places
from floatframe.durability.fatigue.surface_damage import FatigueResult
from floatframe.errors import FatigueError

__all__ = ["cycles_at", "exceedances", "fatigue_document"]


# the cycles at one place: the load spectrum next to the S-N curve -----------------------------------------------------


def cycles_at(result: FatigueResult, blocks: Sequence[LoadBlock], place: int) -> Array:
    """Return the cycles of the programme at one place: equivalent amplitude, mean, count, (n_cycles, 3).

    Parameters
    ----------
    place
        Index into the arrays of the result; the plane is that with the largest damage.

    Raises
    ------
    FatigueError
        For criteria of shear, whose cycles also have a normal stress.
    """
    criterion, body = result.criterion, result.body
    if criterion.is_shear or result.is_spectral:
        raise FatigueError("cycles of a place: known for rainflow counts of signed-von-mises, principal and normal")
    places = Places(result.nodes, result.points, result.material, 0)
    at, material = np.array([place]), result.materials[result.material[place]]
    rows = criterion.rows(stress_of_places(body, places, at, None), frames_of_places(body, places, at, criterion))
    rule, scalar = cycle_rule(material.curve, material.mean_stress), criterion.scalar()
    found = []
    for block in blocks:
        history = rows[0] @ (block.scale * np.asarray(block.q)).T
        if scalar is None:
            values = np.ascontiguousarray(history[result.plane[place]])
        else:
            out = np.empty((1, history.shape[1]))
            scalar(np.ascontiguousarray(history[None]), out)
            values = out[0]
        cycles = collect(values, result.method == "repeat")
        mean = 0.5 * (cycles[:, 0] + cycles[:, 1])
        half = 0.5 * np.abs(cycles[:, 0] - cycles[:, 1])
        S = [equivalent_amplitude(rule, float(a), float(m)) for a, m in zip(half, mean, strict=True)]
        found.append(np.stack([np.array(S), mean, block.repeats * cycles[:, 2]], axis=1).reshape(-1, 3))
    return np.concatenate(found)


def exceedances(cycles: Array, n_points: int = 200) -> tuple[Array, Array]:
    """Return numbers of cycles with at least an amplitude, and decreasing amplitudes, (n <= n_points,) each."""
    order = np.argsort(-cycles[:, 0], kind="stable")
    amplitude, count = cycles[order, 0], np.cumsum(cycles[order, 2])
    keep = amplitude > 0
    amplitude, count = amplitude[keep], count[keep]
    if len(amplitude) > n_points:
        chosen = np.unique(np.searchsorted(count, np.geomspace(count[0], count[-1], n_points)).clip(0, len(count) - 1))
        amplitude, count = amplitude[chosen], count[chosen]
    return count, amplitude


# report ---------------------------------------------------------------------------------------------------------------


LEAST_SHOWN = 0.01  #: smallest amplitude in the plot, relative to the largest
MOST_CYCLES = 1e10  #: largest number of cycles in the plot of S-N curves
COLORS = (INK, "#0072B2", "#009E73", "#CC79A7", "#56B4E9")  #: colours of the S-N curves of materials


def fatigue_document(made: Assessment) -> Document:
    """Return the document."""
    record = fatigue_record(made)
    sections = [picture_section(made), worst_section(record), curve_section(made, record), method_section(record)]
    facts, answer = head(record)
    return Document(
        f"How long does {record['body']} last?",
        facts,
        answer,
        [section for section in sections if section is not None],
        record["body"],
        "fatigue",
        footer="Written by floatframe fatigue. The JSON and CSV files beside this page contain the same numbers.",
    )


def head(record: dict[str, Any]) -> tuple[str, Answer]:
    """Return the summary data, and the result in one sentence."""
    worst = record["worst"][0] if record["worst"] else None
    unit, target = record["life_unit"], record["programme"]["target"]
    n_points = record["n_points"]
    places = [f"{record['n_nodes'] - n_points} nodes on the surface"] if record["n_nodes"] > n_points else []
    places += [f"{n_points} stress points of elements"] if n_points else []
    facts = (
        f"{' and '.join(places)}, {record['n_counted']} of them counted; {record['criterion']}; mean "
        f"stress: {record['mean_stress']}; {record['method']}"
    )
    if worst is None or worst["life"] is None:
        answer, verdict = "No damage: no cycle reaches the S-N curve.", "pass"
    else:
        answer = f"The worst place, {worst['place']}, lasts {worst['life']:.4g} {unit}: "
        answer += f"damage {worst['damage']:.3g} a programme."
        verdict = "info"
        if target is not None:
            verdict = "fail" if worst["life"] < target else "pass"
            answer += f" The aim of {target:.4g} {unit} is {'missed' if verdict == 'fail' else 'reached'}."
    figures: list[tuple[str, str]] = []
    if worst is not None:
        figures = [
            (f"{worst['damage']:.3g}", "damage of a programme"),
            ("no end" if worst["life"] is None else f"{worst['life']:.4g}", f"life [{unit}]"),
            (f"{worst['largest_amplitude']:.4g}", f"largest amplitude [{record['stress_unit']}]"),
        ]
    return facts, Answer(answer, verdict, figures=figures)


def picture_section(made: Assessment) -> Section | None:
    """Return the section with the picture of the damage on the surface."""
    drawn = png_of(lambda path: render_fatigue(made, path), "the page")
    if drawn is None:
        return None
    words = (
        "Damage on the surface, in powers of ten; numbers are ranks in the table below. Nodes that were not counted "
        "are below the scale. A stress point is shown at the nearest node, which has the largest of several values."
    )
    return Section("surface", "Where it fails", (Picture(drawn),), words, "Surface")


def worst_section(record: dict[str, Any]) -> Section:
    """Return the section with the table of the worst nodes."""
    has_planes = any(each["plane"] for each in record["worst"])
    names = list(record["worst"][0]["of_blocks"]) if record["worst"] else []
    has_materials = any(each["material"] for each in record["worst"])
    headings = ["rank>", "node", *(["material"] if has_materials else []), "place", "damage>",
                f"life [{record['life_unit']}]>", f"largest amplitude [{record['stress_unit']}]>",
                *(["plane"] if has_planes else []),
                *(f"{name}>" for name in names if len(names) > 1)]  # fmt: skip
    rows = []
    for rank, each in enumerate(record["worst"], start=1):
        place = f"({each['x']:.5g}, {each['y']:.5g}, {each['z']:.5g})"
        life = "no end" if each["life"] is None else f"{each['life']:.4g}"
        cells = [Cell(str(rank), "n"), Cell(each["node"], "name"),
                 *([Cell(each["material"])] if has_materials else []), Cell(place), Cell(f"{each['damage']:.4g}", "n"),
                 Cell(life, "n"), Cell(f"{each['largest_amplitude']:.4g}", "n")]  # fmt: skip
        cells += [Cell(each["plane"])] if has_planes else []
        shares = [value / each["damage"] if each["damage"] else 0.0 for value in each["of_blocks"].values()]
        cells += [Cell(f"{share:.0%}", "n") for share in shares] if len(names) > 1 else []
        rows.append(cells)
    lead = "With the share of each block in their damage." if len(names) > 1 else ""
    return Section("worst", "Worst nodes", (TextTable(headings, rows),), lead)


def curve_section(made: Assessment, record: dict[str, Any]) -> Section:
    """Return the section with the S-N curves and the load spectrum of the worst place."""
    unit = record["stress_unit"]
    lines = []
    for material, color in zip(made.result.materials, cycle(COLORS), strict=False):
        curve = material.curve
        low = curve.fatigue_limit or 0.2 * float(curve.bottom[curve.bottom > 0].min(initial=curve.amplitude.min()))
        S = np.geomspace(curve.greatest, low, 240)
        S = S[curve.life(S) <= MOST_CYCLES]
        lines.append(Line(curve.life(S), S, f"S-N curve {material.name}".strip(), color))
    words = "S-N curves with their factors, in units of the body."
    if made.blocks and not made.result.criterion.is_shear and record["worst"]:
        cycles = cycles_at(made.result, made.blocks, int(made.result.worst()[0]))
        name = f"{record['worst'][0]['place']}: cycles of at least this amplitude"
        count, amplitude = exceedances(cycles)
        is_shown = amplitude > LEAST_SHOWN * amplitude.max(initial=0.0)
        lines.append(Line(count[is_shown], amplitude[is_shown], name, "#D55E00"))
        words += (
            " Also shown: equivalent amplitudes at the worst place in one programme, including mean stress, down to "
            f"{LEAST_SHOWN:.0%} of the largest."
        )
    upwards = Axis(f"stress amplitude [{unit}]", is_log=True)
    chart = Chart(Axis("cycles", is_log=True), (upwards,), tuple(lines), 380)
    return Section("curve", "S-N curve and load spectrum", (Figure("sn", chart, words),), "", "S-N curve")


def method_section(record: dict[str, Any]) -> Section:
    """Return the section with the assumptions."""
    rows = [
        ("criterion", f"{record['criterion']}: {CRITERIA[record['criterion']]}"),
        ("stress tensor", record["tensor"]),
        ("mean stress", record["mean_stress"]),
        ("counting", record["method"]),
        ("damage", "Miner's sum of n / N; nothing is counted between one block and the next"),
        *((f"S-N curve {each['name']}".strip(), curve_words(each, record["stress_unit"]))
          for each in record["materials"]),
        *((f"block {each['name']}", f"{each['repeats']:.6g} times, loads times {each['scale']:g}")
          for each in record["blocks"]),
        ("left out", f"{record['n_nodes'] - record['n_counted']} places whose damage is proved to be below "
                     f"{record['negligible'] or 0:g} of the greatest"),
        *(("note", note) for note in record["notes"]),
    ]  # fmt: skip
    cells = [[Cell(name, "name"), Cell(words)] for name, words in rows]
    return Section("method", "Assumptions", (TextTable(["", ""], cells),), "", "Method")


def curve_words(material: dict[str, Any], unit: str) -> str:
    """Return an S-N curve in words."""
    curve = material["curve"]
    slopes = ", ".join(f"{slope:.4g}" for slope in curve["slope"])
    limit = curve["bottom"][-1]
    words = (
        f"slopes {slopes} from {curve['amplitude'][0]:.5g} {unit} at {curve['cycles'][0]:.4g} cycles; "
        f"R = {curve['stress_ratio']:g}; given in {curve['given_in']}; "
    )
    words += f"no damage below {limit:.5g}" if limit else "no fatigue limit"
    return words if not material["name"] else f"{words}; {material['n_places']} places"
