"""The command `cms frf`: frequency response between two interfaces of a modal file, optionally with its full model."""

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from cms.assessment.quality.errors import QualityError
from cms.assessment.quality.of_reduction.frf import POINTS, compare_responses, frequency_grid, resonance_grid
from cms.assessment.quality.reference.port_model import (
    FrequencyResponse,
    PortModel,
    file_resonances,
    frf,
    modal_response,
    resonances,
    response_unit,
)
from cms.body.reduced_body import ReducedBody
from cms.cli.console import print_table, say
from cms.cli.outputs import PICTURES, TABLES, output_files, write_outputs
from fe_models.foundation.arrays import MOTION_COMPONENTS, Array
from fe_models.foundation.documents.table import Table
from fe_models.foundation.words import nearest, quoted

if TYPE_CHECKING:
    from matplotlib.figure import Figure

__all__ = ["FrfRequest", "parse_band", "parse_component", "run_frf"]

#: damping ratio in both responses if none is given, because a full model has no comparable damping
OVERLAY_DAMPING = 0.01


@dataclass(frozen=True)
class FrfRequest:
    """Arguments of the command `cms frf`."""

    file: Path
    excited: str
    answering: str
    band: str
    components: tuple[str, ...]
    damping: float | None
    is_inertance: bool
    job: Path | None
    outputs: tuple[Path, ...]
    changes: Mapping[str, Any]  #: values of parameters of the job


def run_frf(request: FrfRequest) -> None:
    """Compute the response with points around all resonances, print its peaks, and write the requested files."""
    from cms.body.modal_file.file import read

    if request.changes and request.job is None:
        raise QualityError("--set: changes parameters of the job; give it with --job")
    frequencies = parse_band(request.band)
    pairs = tuple(parse_component(text) for text in request.components or MOTION_COMPONENTS[:3])
    inputs = [request.file] + ([request.job] if request.job else [])
    paths = output_files(request.outputs, [], (*PICTURES, *TABLES), QualityError, overwrite_of=inputs)
    reduced = read(request.file)
    for name in (request.excited, request.answering):
        reduced.interface(name)  # raises an error for an unknown interface before any work
    damping = OVERLAY_DAMPING if request.damping is None and request.job is not None else request.damping
    frequencies = resonance_grid(frequencies, *file_resonances(reduced, damping=damping))
    full = None
    if request.job is not None:
        model, time = full_model(request, reduced, float(frequencies[-1]))
        frequencies = resonance_grid(frequencies, *resonances(model, damping=damping or 0.0, time=time))
        whole = modal_response(model, frequencies, damping=damping or 0.0, time=time)
        full = whole.between(request.excited, request.answering)
    own = frf(reduced, frequencies, damping=damping).between(request.excited, request.answering)
    print_peaks(request, reduced, own, full, pairs)
    write_outputs(
        paths, table=lambda: response_table(request, reduced, own, full, pairs),
        figure=lambda: response_figure(request, reduced, own, full, pairs), dpi=150,
    )  # fmt: skip


def parse_band(text: str) -> Array:
    """Return the frequencies of lowest:highest or lowest:highest:number, logarithmically spaced [Hz].

    >>> parse_band("10:1000:3").round(6).tolist()
    [10.0, 100.0, 1000.0]

    Raises
    ------
    QualityError
        If the text is not a frequency band.
    """
    parts = text.split(":")
    try:
        lowest, highest = float(parts[0]), float(parts[1])
        points = int(parts[2]) if len(parts) == 3 else POINTS
        if len(parts) > 3:
            raise ValueError
    except (ValueError, IndexError):
        raise QualityError(
            f"--band {quoted(text)}: expected lowest:highest or lowest:highest:number in Hz, as 10:5000 or 10:5000:800"
        ) from None
    return frequency_grid(lowest, highest, points)


def parse_component(text: str) -> tuple[int, int]:
    """Return motion and force of "uz" (force in the same direction) or "uz/ry", as indices of `MOTION_COMPONENTS`."""
    motion, _, force = text.partition("/")
    force = force or motion
    for word in (motion, force):
        if word not in MOTION_COMPONENTS:
            raise QualityError(
                f"--component {text!r}: {quoted(word)} is no component{nearest(word, MOTION_COMPONENTS)}"
            )
    return MOTION_COMPONENTS.index(motion), MOTION_COMPONENTS.index(force)


def full_model(request: FrfRequest, reduced: ReducedBody, highest: float) -> tuple[PortModel, float]:
    """Return the full model of a job at two interfaces, valid up to a frequency [Hz], and its time unit [s]."""
    from cms.assessment.quality.reduction_check import require_same_units
    from cms.assessment.quality.reference.ports import Ports
    from cms.assessment.quality.reference.reference_response import reference_response
    from cms.cli.console import stages
    from cms.jobs.body_of_job import coupled_body, uncoupled_body
    from cms.jobs.job import read_job
    from cms.modes.families.families import Families

    assert request.job is not None
    job = read_job(request.job, request.changes)
    with stages() as clock:
        uncoupled = uncoupled_body(job, clock)
        require_same_units(uncoupled, reduced)
        with clock("couple interfaces"):
            body = coupled_body(job, uncoupled)
        names = tuple(dict.fromkeys((request.excited, request.answering)))
        ports = Ports.of_body(body, names)
        with clock("full model"), Families(body, solver=job.reduction.solver) as families:
            known = reference_response(families, ports, highest * body.units.time)
    return known.model, body.units.time


def print_peaks(
    request: FrfRequest,
    reduced: ReducedBody,
    own: FrequencyResponse,
    full: FrequencyResponse | None,
    pairs: tuple[tuple[int, int], ...],
) -> None:
    """Print the largest peaks of each component, and their errors relative to the full model."""
    from cms.assessment.quality.of_reduction.frf import peaks

    rows = []
    for motion, force in pairs:
        magnitude = np.abs(own.values(is_inertance=request.is_inertance)[:, motion, force])
        found = peaks(own.frequencies, magnitude)[:6]
        where = ", ".join(f"{f:.5g}" for f in sorted(f for f, _ in found)) or "none in the band"
        rows.append(
            (pair_words(motion, force), where, f"{magnitude.max():.4g}", unit_of(reduced, motion, force, request))
        )
    print_table(
        f"{reduced.name}: {request.excited} to {request.answering}, {own.damping}",
        ("motion/force", "peaks [Hz]", "largest>", "unit"),
        rows,
    )
    if full is not None:
        error = compare_responses(full, own, float(np.linalg.norm(np.ptp(reduced.nodes, axis=0))) or 1.0)
        k = int(np.argmax(error))
        good = np.flatnonzero(error > 0.05)
        up_to = own.frequencies[-1] if not len(good) else own.frequencies[max(good[0] - 1, 0)]
        say(
            f"Against the full model: below 5 % up to {up_to:.5g} Hz, largest {100 * error[k]:.3g} % at "
            f"{own.frequencies[k]:.5g} Hz"
        )


def pair_words(motion: int, force: int) -> str:
    """Return the names of motion and force, such as 'uz/fz', 'rz/mz', 'ux/my'."""
    names = ("fx", "fy", "fz", "mx", "my", "mz")
    return f"{MOTION_COMPONENTS[motion]}/{names[force]}"


def unit_of(reduced: ReducedBody, motion: int, force: int, request: FrfRequest) -> str:
    """Return the unit of one component."""
    names = MOTION_COMPONENTS[motion], MOTION_COMPONENTS[force]
    return response_unit(reduced.units, *names, is_inertance=request.is_inertance)


def response_table(
    request: FrfRequest,
    reduced: ReducedBody,
    own: FrequencyResponse,
    full: FrequencyResponse | None,
    pairs: tuple[tuple[int, int], ...],
) -> Table:
    """Return a table with the frequency and a complex column for each component."""
    columns, units = {"frequency": own.frequencies}, {"frequency": "Hz"}
    for source, response in (("reduced", own), ("full", full)):
        if response is None:
            continue
        for motion, force in pairs:
            name = f"{source} {pair_words(motion, force)}"
            columns[name] = response.values(is_inertance=request.is_inertance)[:, motion, force]
            units[name] = unit_of(reduced, motion, force, request)
    return Table(columns, units)


def response_figure(
    request: FrfRequest,
    reduced: ReducedBody,
    own: FrequencyResponse,
    full: FrequencyResponse | None,
    pairs: tuple[tuple[int, int], ...],
) -> "Figure":
    """Return a figure with magnitude and phase of each component."""
    from cms.assessment.quality.plots import frf_figure

    curves = {"reduced": own} if full is None else {"full model": full, "reduced": own}
    units = [unit_of(reduced, motion, force, request) for motion, force in pairs]
    return frf_figure(
        curves,
        [(motion, force) for motion, force in pairs],
        [f"{pair_words(*pair)} [{unit}]" for pair, unit in zip(pairs, units, strict=True)],
        is_inertance=request.is_inertance,
        title=f"{reduced.name}: {request.excited} to {request.answering}, {own.damping}",
    )
