"""A page with a motion or an equilibrium."""

import json
import logging
import os
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from importlib.resources import files
from pathlib import Path
from typing import Any

import numpy as np

from cms.body.modal_file.file import digest
from cms.body.reduced_body import ReducedBody
from cms.errors import CmsError
from fe_models.foundation.arrays import Array, IntArray
from fe_models.foundation.documents.html import asset as document_asset
from fe_models.foundation.documents.html import text
from fe_models.foundation.paths import replace_file
from fe_models.foundation.presentation import presented
from fe_models.foundation.units import Units
from floatframe.analyses.snapshot import Equilibrium, snapshot
from floatframe.errors import ResultsError
from floatframe.files.system_file.recorded_system import recorded_system
from floatframe.model.bodies.flexible_body import FlexibleBody
from floatframe.model.bodies.rigid_body import RigidBody
from floatframe.model.system import System
from floatframe.pictures.animation import bodies_of, diagonal
from floatframe.pictures.body_colors import BODY_COLORS
from floatframe.pictures.film_times import film_times, round_below
from floatframe.pictures.viewer.flexible import FlexibleSurface, flexible_surface, nodes_within
from floatframe.pictures.viewer.packing import Block
from floatframe.pictures.viewer.record import Shown, colors_record, stage_record
from floatframe.results.recovery import elastic_displacements, require_same_modes
from floatframe.results.sensor_choice import chosen_measurements
from floatframe.results.sensor_plots import panels_of
from floatframe.results.sensors import measured
from floatframe.results.sensors.measurement import Measurement
from floatframe.results.trajectory import Trajectory, read_trajectory

__all__ = [
    "LARGEST",
    "MOST_ROWS",
    "OWN_PARTS",
    "Page",
    "Panel",
    "Timeline",
    "bytes_for_numbers",
    "evenly",
    "fixed_size",
    "motion_panels",
    "page_of",
    "require_color",
    "sensor_panels",
    "source_record",
    "timeline",
    "view",
    "written",
]

log = logging.getLogger(__name__)


# the page around a record: a single HTML file that contains everything ------------------------------------------------


# which rows of a motion a page carries --------------------------------------------------------------------------------


MOST_ROWS = 4000  #: largest number of rows in a page
FASTEST = 2.6  #: rotation of a body between rows [rad] above which it may seem to rotate in the wrong direction


@dataclass(frozen=True, eq=False)
class Timeline:
    """The rows of a motion that a page shows."""

    rows: IntArray  #: rows of the trajectory, (n,)
    largest_turn: float  #: largest rotation of a body between two rows [rad]

    @property
    def turns_too_far(self) -> bool:
        """Whether a body would appear to rotate in the wrong direction."""
        return self.largest_turn > FASTEST


def timeline(trajectory: Trajectory, most: int) -> Timeline:
    """Return at most `most` rows, evenly spaced in time, including the first and the last."""
    rows = evenly(trajectory.t, min(most, MOST_ROWS))
    steps = np.diff(trajectory.t[rows], prepend=trajectory.t[rows[0]])
    fastest = [np.linalg.norm(trajectory.body(name).omega_B[rows], axis=1) for name in trajectory.body_names]
    return Timeline(rows, float(max((float((speed * steps).max()) for speed in fastest), default=0.0)))


def evenly(t: Array, most: int) -> IntArray:
    """Return at most `most` rows of ascending times, evenly spaced, including the first and the last."""
    if len(t) <= most:
        return np.arange(len(t))
    wanted = np.linspace(t[0], t[-1], most)
    after = np.clip(np.searchsorted(t, wanted), 1, len(t) - 1)
    return np.unique(np.where(wanted - t[after - 1] <= t[after] - wanted, after - 1, after))


# the plots of a page: measurements of sensors, and quantities of every motion -----------------------------------------


MOST_CURVES, MOST_PANELS = 6, 14  #: largest number of curves in a panel, and of sensor panels
SEEN = 1e-4  #: magnitude, relative to the largest curve of a panel, below which a curve counts as zero


@dataclass(frozen=True, eq=False)
class Panel:
    """Curves over time with a common axis."""

    title: str
    unit: str
    curves: Mapping[str, Array]  #: values of each curve by name in the rows of the plots, (n,)
    n_all: int = 0  #: number of curves before the selection of the largest


def sensor_panels(measurements: Sequence[Measurement], rows: IntArray) -> list[Panel]:
    """Return a panel for each unit of each sensor, without components that stay zero."""
    found = []
    for measurement in measurements:
        for unit, columns in panels_of(measurement):
            curves = {name: np.asarray(measurement.columns[name], dtype=float)[rows] for name in columns}
            size = {name: largest(values) for name, values in curves.items()}
            moving = {name: v for name, v in curves.items() if size[name] > SEEN * max(size.values())}
            names = moving or {columns[-1]: curves[columns[-1]]}
            found.append(Panel(measurement.sensor, unit, limited(names), len(curves)))
    return found[:MOST_PANELS]


def motion_panels(trajectory: Trajectory, bodies: Mapping[str, ReducedBody], rows: IntArray) -> list[Panel]:
    """Return positions, elastic displacement of interfaces, forces in joints and springs, energies."""
    units, found = trajectory.units, []
    paths = {
        f"{name} {axis}": trajectory.body(name).r[rows, k]
        for name in trajectory.body_names
        for k, axis in enumerate("xyz")
    }
    reach = max((float(np.ptp(values)) for values in paths.values()), default=0.0)
    moving = {name: values for name, values in paths.items() if np.ptp(values) > SEEN * reach}
    found.append(Panel("position of body frames", units.length_symbol, limited(moving), len(paths)))
    elastic = {}
    for name, body in bodies.items():
        for interface in body.interfaces:
            d = elastic_displacements(trajectory, name, body, interface.name)[rows]
            elastic[f"{name} {interface.name}"] = np.linalg.norm(d, axis=1)
    bent = {name: values for name, values in elastic.items() if np.any(values)}
    found.append(Panel("elastic displacement", units.length_symbol, limited(bent), len(bent)))
    loads = {
        name: np.linalg.norm(trajectory.reaction(name).force[rows], axis=1) for name in trajectory.connection_names
    }
    found.append(Panel("force in joints and springs", units.force_symbol, limited(loads), len(loads)))
    energies = {
        name: getattr(trajectory.energies, name)[rows]
        for name in ("kinetic", "strain", "gravity", "springs", "work", "dissipated")
    }
    shown = {name: values for name, values in energies.items() if np.any(values)}
    found.append(Panel("energy", f"{units.force_symbol} {units.length_symbol}", shown, len(shown)))
    return [panel for panel in found if panel.curves]


def largest(values: Array) -> float:
    """Return the largest absolute value of the finite values."""
    finite = values[np.isfinite(values)]
    return float(np.abs(finite).max(initial=0.0))


def limited(curves: Mapping[str, Array]) -> dict[str, Array]:
    """Return the curves with the largest values, in their order."""
    kept = set(sorted(curves, key=lambda name: -largest(curves[name]))[:MOST_CURVES])
    return {name: values for name, values in curves.items() if name in kept}


# page -----------------------------------------------------------------------------------------------------------------


LIBRARIES = ("three.min.js", "uplot.min.js")
OWN_PARTS = ("unpack.js", "machine.js", "camera.js", "plots.js", "controls.js")
STYLES = ("uplot.min.css", "view.css")


def page_of(record: dict[str, Any], block: Block) -> str:
    """Return the page with a record and its numbers."""
    head = json.dumps(record, separators=(",", ":"), allow_nan=False).replace("<", "\\u003c")
    styles = document_asset("page.css") + "".join(asset(name) for name in STYLES)
    scripts = "".join(f"<script>{asset(name)}</script>\n" for name in (*LIBRARIES, *OWN_PARTS))
    return (
        '<!doctype html>\n<html lang="en"><head><meta charset="utf-8">'
        '<meta name="viewport" content="width=device-width, initial-scale=1, viewport-fit=cover">'
        f'<title>{text(record["title"])}</title><link rel="icon" href="data:,">\n'
        f"<!--\n{asset('LICENSES.txt')}-->\n<style>{styles}</style></head>\n"
        f'<body class="view">{asset("view.html")}'
        f'<script type="application/json" id="record">{head}</script>\n'
        f'<script type="text/plain" id="numbers">{block.text()}</script>\n{scripts}</body></html>\n'
    )


def fixed_size() -> int:
    """Return the size in bytes of an empty page."""
    names = (*LIBRARIES, *OWN_PARTS, *STYLES, "LICENSES.txt", "view.html")
    return sum(len(asset(name)) for name in names) + len(document_asset("page.css"))


def asset(name: str) -> str:
    """Return a file shipped with the viewer."""
    return (files("floatframe.pictures.viewer") / "data" / name).read_text(encoding="utf-8")


# A page with a motion or an equilibrium -------------------------------------------------------------------------------


LARGEST = 10.0  #: largest size of a page [MB]
PLOTTED = 1200  #: number of rows of the plots
SHARE_OF_ROWS = 0.4  #: fraction of the numbers of a page for the rows of the motion; the rest is for surfaces
#: as in films: fraction of a body's size from which deformation is visible; fraction to which it is magnified
VISIBLE, DRAWN = 0.02, 0.06


@presented
@dataclass(frozen=True)
class Page:
    """A written page."""

    path: Path
    size: int  #: size of the page in bytes
    notes: tuple[str, ...]  #: omissions, which the page lists


def view(
    motion: Trajectory | Equilibrium | str | os.PathLike[str],
    path: str | os.PathLike[str],
    *,
    system: System | None = None,
    sensors: Sequence[str] = (),
    color: str = "displacement",
    magnification: float | None = None,
    largest: float = LARGEST,
) -> Page:
    """Write a motion or an equilibrium as a single page that works offline, in 3D with plots.

    Parameters
    ----------
    motion
        A motion, the path of a results file, or an equilibrium of the system.
    path
        File whose name ends in .html.
    system
        Its system; None: from the system file that the results name.
    sensors
        Sensors to plot, as for `floatframe plot --sensor`; none: all sensors, positions, loads and energies.
    color
        Initial colour of flexible bodies: "displacement" or "von-mises".
    magnification
        Initial factor of the elastic displacement as drawn; None: 1, or a larger one that makes it visible.
    largest
        Largest size of the page in megabytes; surfaces are thinned and rows omitted until it fits.

    Raises
    ------
    ResultsError
        If a body does not match the motion, stress is requested but not available, or the page cannot be that small.
    """
    require_color(color)
    trajectory = motion_of(motion, system)
    if len(trajectory.t) == 0:
        raise ResultsError("view: the motion has no rows")
    if system is None:
        system = known_system(trajectory)
    bodies = bodies_in(trajectory, system)
    reduced = {name: body.reduced for name, body in bodies.items() if isinstance(body, FlexibleBody)}
    reduced |= {name: body for name, body in loose_bodies(trajectory, system).items()}
    for name, body in reduced.items():
        require_same_modes(trajectory, name, body)
    if color == "von-mises" and not any(body.stress is not None for body in reduced.values()):
        raise ResultsError(
            "view: the von Mises stress is requested, but no body of the motion has stress modes"
            + (f" ({', '.join(reduced)})" if reduced else ": all are rigid")
            + "; reduce them again with stress, or colour by displacement"
        )
    panels, plotted = panels_of_motion(trajectory, system, reduced, sensors)
    n_bytes = bytes_for_numbers(largest) - 4 * sum(len(panel.curves) for panel in panels) * len(plotted)
    kept = timeline(trajectory, max(2, int(SHARE_OF_ROWS * n_bytes / bytes_of_row(trajectory, system))))
    shown = Shown(trajectory, system, bodies, reduced, kept.rows)
    block = Block()
    surfaces = surfaces_of(shown, 0.85 * (n_bytes - len(kept.rows) * bytes_of_row(trajectory, system)))
    record, _ = stage_record(shown, surfaces, block)
    units = trajectory.units
    record |= {
        "kind": "motion",
        "title": trajectory.head.system,
        "facts": facts_of(shown, motion),
        "notes": notes_of(shown, kept, surfaces),
        "sources": source_record(trajectory),
        "units": unit_record(trajectory),
        "panel_time": block.real(trajectory.t[plotted]),
        "panels": panel_record(block, panels),
        "speed": speed_of(trajectory),
        "colors": colors_of(units, surfaces),
        "color": color,
        "magnification": magnification_of(surfaces, reduced) if magnification is None else float(magnification),
    }
    return written(path, record, block, largest)


def require_color(color: str) -> None:
    """Raise `ResultsError` unless bodies can be coloured by this quantity."""
    if color not in BODY_COLORS:
        raise ResultsError(f"view: color: expected one of {', '.join(BODY_COLORS)}, got {color!r}")


def motion_of(motion: Trajectory | Equilibrium | str | os.PathLike[str], system: System | None) -> Trajectory:
    """Return the shown motion; an equilibrium becomes a motion with one time."""
    if isinstance(motion, Trajectory):
        return motion
    if isinstance(motion, Equilibrium):
        if system is None:
            raise ResultsError("view: an equilibrium is shown with its system; give system=")
        return snapshot(system, motion)
    return read_trajectory(motion)


def known_system(trajectory: Trajectory) -> System | None:
    """Return the system of a motion from the file its results name, if that is unchanged."""
    try:
        return recorded_system(trajectory)
    except ResultsError as error:
        log.warning("joints, shapes and sensors are omitted: %s", error)
        return None


def bodies_in(trajectory: Trajectory, system: System | None) -> dict[str, RigidBody | FlexibleBody | None]:
    """Return the bodies of a motion, by name, from the system; modal files must be those of the run."""
    if system is None:
        return dict.fromkeys(trajectory.body_names)
    names = tuple(body.name for body in system.bodies)
    if names != trajectory.body_names:
        raise ResultsError(
            f"view: the bodies of the system are {', '.join(names)}, but those of the motion "
            f"{', '.join(trajectory.body_names)}; give the system of the motion"
        )
    for entry in trajectory.head.bodies:
        if entry.source and entry.digest and Path(entry.source).is_file() and digest(entry.source) != entry.digest:
            raise ResultsError(
                f"body {entry.name!r}: {entry.source} has changed since the motion was computed; run it again"
            )
    return {body.name: body for body in system.bodies}


def loose_bodies(trajectory: Trajectory, system: System | None) -> Mapping[str, ReducedBody]:
    """Return the reduced bodies of a motion without a known system, read from their modal files."""
    if system is not None:
        return {}
    try:
        return bodies_of(trajectory)
    except CmsError as error:
        raise ResultsError(
            f"view: a flexible body cannot be shown: {error}; put the modal file back where the run found it"
        ) from error


def bytes_for_numbers(largest: float) -> float:
    """Return the bytes of numbers that fit into a page of a size in megabytes, as text without compression.

    Raises
    ------
    ResultsError
        If the page would be too small for its programs.
    """
    left = 1e6 * largest - fixed_size()
    if not np.isfinite(largest) or left < 3e5:
        raise ResultsError(
            f"view: a page of {largest:g} MB is too small: its programs alone take {fixed_size() / 1e6:.2f} MB; "
            f"expected {np.ceil(10 * (fixed_size() + 3e5) / 1e6) / 10:g} MB or more"
        )
    return 0.72 * left


def bytes_of_row(trajectory: Trajectory, system: System | None) -> float:
    """Return the approximate number of bytes of a row of a motion."""
    n_modes = sum(entry.n_q for entry in trajectory.head.bodies)
    n_markers = 0 if system is None else 2 * (len(system.joints) + len(system.forces))
    return 4 + 28 * len(trajectory.head.bodies) + 2 * n_modes + (12 * n_markers if n_modes else 6 * n_markers)


def surfaces_of(shown: Shown, n_bytes: float) -> list[FlexibleSurface]:
    """Return the surfaces of all flexible bodies within a number of bytes."""
    trajectory = shown.trajectory
    most = nodes_within(max(n_bytes, 0.0), shown.reduced)
    return [
        flexible_surface(
            i, shown.reduced[name], trajectory.body(name).q[shown.rows], most[name],
            is_stiffened=trajectory.entry(name)[1].is_stiffened,
        )
        for i, name in enumerate(trajectory.body_names)
        if name in most
    ]  # fmt: skip


def panels_of_motion(
    trajectory: Trajectory, system: System | None, reduced: Mapping[str, ReducedBody], sensors: Sequence[str]
) -> tuple[list[Panel], np.ndarray]:
    """Return the plots and their rows."""
    rows = evenly(trajectory.t, PLOTTED)
    if len(trajectory.t) < 2:
        return [], rows
    if sensors:
        if system is None:
            raise ResultsError(
                "view: sensors: the system file of the run does not exist any more, or the run was made in Python"
            )
        return sensor_panels(chosen_measurements(system, trajectory, sensors), rows), rows
    own = [] if system is None else sensor_panels([*measured(system, trajectory).values()], rows)
    return own + motion_panels(trajectory, reduced, rows), rows


def panel_record(block: Block, panels: Sequence[Panel]) -> list[dict[str, Any]]:
    """Return the plots."""
    return [
        {
            "title": panel.title,
            "unit": panel.unit,
            "n_all": panel.n_all,
            "curves": [{"name": name, "values": block.real(values)} for name, values in panel.curves.items()],
        }
        for panel in panels
    ]


def colors_of(units: Units, surfaces: Sequence[FlexibleSurface]) -> list[dict[str, Any]]:
    """Return the quantities by which surfaces can be coloured."""
    if not surfaces:
        return []
    stresses = [each.largest_stress for each in surfaces if each.stress is not None]
    return colors_record(units, max(each.largest_displacement for each in surfaces), max(stresses, default=None))


def magnification_of(surfaces: Sequence[FlexibleSurface], reduced: Mapping[str, ReducedBody]) -> float:
    """Return 1 if the deformation is visible as it is, else the round number that makes it 2.4 to 6 % of a body."""
    sizes = [diagonal(body) for body in reduced.values() if len(body.surface)]
    share = max((s.largest_displacement / size for s, size in zip(surfaces, sizes, strict=True)), default=1.0)
    return 1.0 if share >= VISIBLE or share == 0 else round_below(DRAWN / share)


def speed_of(trajectory: Trajectory) -> float:
    """Return the initial playback speed: seconds of motion per second of viewing, chosen as for films."""
    return film_times(trajectory.t * trajectory.units.time, fps=25.0, speed=None).speed


def facts_of(shown: Shown, motion: object) -> list[str]:
    """Return a description of the shown motion."""
    trajectory = shown.trajectory
    flexible = [entry for entry in trajectory.head.bodies if entry.n_q]
    count = len(trajectory.body_names)
    bodies = f"{count} {'body' if count == 1 else 'bodies'}"
    if flexible:
        bodies += f", {len(flexible)} flexible with {sum(entry.n_q for entry in flexible)} modes"
    if isinstance(motion, Equilibrium):
        return ["equilibrium", bodies]
    t = trajectory.t
    words = [f"{t[-1] - t[0]:.6g} {trajectory.units.time_symbol} of motion" if len(t) > 1 else "one instant", bodies]
    if not trajectory.is_complete:
        words.append("the run did not reach its end")
    return words


def notes_of(shown: Shown, kept: Timeline, surfaces: Sequence[FlexibleSurface]) -> list[str]:
    """Return the omissions of the page as text."""
    trajectory, notes = shown.trajectory, []
    n, n_all = len(kept.rows), len(trajectory.t)
    if n < n_all:
        notes.append(f"{n:,} of {n_all:,} rows of the results are in this page, evenly spaced in time.")
    if n > 1:
        notes.append("Between rows positions and modal coordinates are interpolated linearly, rotations along the arc.")
    if kept.turns_too_far:
        notes.append(
            f"A body rotates by {kept.largest_turn:.3g} rad between rows, so that it may seem to rotate backwards; "
            "write results more often."
        )
    notes += surface_notes(trajectory.body_names, surfaces)
    for note in trajectory.validity:
        notes.append(
            f"{note.body} left the range of its linear frame: {note.action}."
            if note.is_of_a_frame
            else f"{note.words}."
        )
    return notes


def surface_notes(names: Sequence[str], surfaces: Sequence[FlexibleSurface]) -> list[str]:
    """Return a description of the shown flexible surfaces."""
    notes = []
    for each in surfaces:
        shown, whole = len(each.surface.rows), each.surface.n_nodes
        words = f"{names[each.body]}: surface of {shown:,} nodes"
        words += (
            f", thinned from {whole:,}; the remaining nodes are unchanged, so that modes are exact there"
            if shown < whole
            else ""
        )
        if len(each.shapes) < each.n_modes:
            words += f"; {each.n_modes - len(each.shapes)} of {each.n_modes} modes are too small to be visible"
        notes.append(f"{words}.")
    if any(len(each.surface.rows) < each.surface.n_nodes for each in surfaces):
        notes.append("The colour scale ends at the largest value of the displayed nodes.")
    return notes


def source_record(trajectory: Trajectory) -> list[tuple[str, str]]:
    """Return the origin of the motion."""
    run = trajectory.head.run
    found = [("program", f"floatframe {run.get('floatframe', '')}")]
    if run.get("integrator") and run.get("h") and run["integrator"] != "Snapshot":
        found.append(("integrator", f"{run['integrator']}, step {run['h']:.6g} {trajectory.units.time_symbol}"))
    found.append(("units", trajectory.units.name))
    if trajectory.path is not None:
        found.append(("results", trajectory.path.name))
    if run.get("system_file"):
        found.append(("system file", Path(str(run["system_file"])).name))
    found += [
        (f"modal file of {entry.name}", f"{Path(entry.source).name}, sha256 {entry.digest[:12]}")
        for entry in trajectory.head.bodies
        if entry.source
    ]
    return found


def unit_record(trajectory: Trajectory) -> dict[str, Any]:
    """Return symbols of the units."""
    units = trajectory.units
    symbols = {"time": units.time_symbol, "length": units.length_symbol, "force": units.force_symbol}
    return {**symbols, "seconds": units.time}


def written(path: str | os.PathLike[str], record: dict[str, Any], block: Block, largest: float) -> Page:
    """Write the page; `ResultsError` if it is too large."""
    target = Path(path)
    content = page_of(record, block).encode()
    if len(content) > 1e6 * largest:
        raise ResultsError(
            f"view: the page would have {len(content) / 1e6:.1f} MB, more than {largest:g} MB, although surfaces are "
            "thinned; name fewer sensors, remove shapes with large surfaces, or allow more megabytes"
        )
    replace_file(target, content)
    return Page(target, len(content), tuple(record["notes"]))
