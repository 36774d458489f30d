"""The page around a record: a single HTML file that contains everything."""

import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from importlib.resources import files
from typing import Any

import numpy as np

from cms.assessment.report.html import asset as report_asset
from cms.assessment.report.html import text
from cms.body.reduced_body import ReducedBody
from fe_models.foundation.arrays import Array, IntArray
from floatframe.pictures.sensor_plots import panels_of
from floatframe.pictures.viewer.packing import Block
from floatframe.results.recovery import elastic_displacements
from floatframe.results.sensors.measurement import Measurement
from floatframe.results.trajectory import Trajectory

__all__ = [
    "MOST_ROWS",
    "OWN_PARTS",
    "Panel",
    "Timeline",
    "evenly",
    "fixed_size",
    "motion_panels",
    "page_of",
    "sensor_panels",
    "timeline",
]


# which rows of a motion a page carries --------------------------------------------------------------------------------


MOST_ROWS = 4000  #: of a page
FASTEST = 2.6  #: rad that a body may turn from row to row, so that it is seen to turn the right way


@dataclass(frozen=True, eq=False)
class Timeline:
    """The rows."""

    rows: IntArray  #: of the trajectory, (n,)
    largest_turn: float  #: of a body from row to row [rad]

    @property
    def turns_too_far(self) -> bool:
        """Whether a body would be seen to turn the wrong way."""
        return self.largest_turn > FASTEST


def timeline(trajectory: Trajectory, most: int) -> Timeline:
    """Return at most so many rows, evenly spaced in time, with the first and the last."""
    rows = evenly(trajectory.t, min(most, MOST_ROWS))
    steps = np.diff(trajectory.t[rows], prepend=trajectory.t[rows[0]])
    fastest = [np.linalg.norm(trajectory.body(name).omega_B[rows], axis=1) for name in trajectory.body_names]
    return Timeline(rows, float(max((float((speed * steps).max()) for speed in fastest), default=0.0)))


def evenly(t: Array, most: int) -> IntArray:
    """Return rows of ascending times, at most so many, evenly spaced in time, with the first and the last."""
    if len(t) <= most:
        return np.arange(len(t))
    wanted = np.linspace(t[0], t[-1], most)
    after = np.clip(np.searchsorted(t, wanted), 1, len(t) - 1)
    return np.unique(np.where(wanted - t[after - 1] <= t[after] - wanted, after - 1, after))


# the plots of a page: measurements of sensors, and quantities of every motion -----------------------------------------


MOST_CURVES, MOST_PANELS = 6, 14  #: in a panel; for sensors
SEEN = 1e-4  #: relative to the largest curve of a panel; smaller curves would coincide with zero


@dataclass(frozen=True, eq=False)
class Panel:
    """Curves over time with a common axis."""

    title: str
    unit: str
    curves: Mapping[str, Array]  #: name -> values in the rows of the plots, (n,)
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
    """Return the largest size of finite values."""
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
    styles = report_asset("page.css") + "".join(asset(name) for name in STYLES)
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
    return sum(len(asset(name)) for name in names) + len(report_asset("page.css"))


def asset(name: str) -> str:
    """Return a file shipped with the viewer."""
    return (files("floatframe.pictures.viewer") / "data" / name).read_text(encoding="utf-8")
