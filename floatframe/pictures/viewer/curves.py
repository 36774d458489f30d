"""The plots of a page: measurements of sensors, and quantities of every motion."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from cms.body.reduced_body import ReducedBody
from fe_models.foundation.arrays import Array, IntArray
from floatframe.pictures.sensor_plots import panels_of
from floatframe.results.recovery import elastic_displacements
from floatframe.results.sensors.measurement import Measurement
from floatframe.results.trajectory import Trajectory

__all__ = ["Panel", "motion_panels", "sensor_panels"]

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
