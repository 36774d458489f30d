"""Figures of a computed motion: positions, energies, elastic displacements, loads, errors."""

from collections.abc import Callable, Mapping, Sequence
from functools import partial
from typing import TYPE_CHECKING

import numpy as np

from cms.body.reduced_body import ReducedBody
from fe_models.foundation.arrays import Array
from floatframe.errors import ResultsError
from floatframe.pictures.plots import (
    MOST_CURVES,
    axes_for,
    labelled,
    note_omitted,
    plot_drift,
    plot_energies,
    plot_energy_balance,
)
from floatframe.results.recovery import elastic_displacements, interface_positions
from floatframe.results.sensor_plots import groups_of, pages_of, plot_measurement
from floatframe.results.sensors.measurement import Measurement
from floatframe.results.trajectory import Trajectory

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

__all__ = ["overview_pages", "plot_deformation", "plot_loads", "plot_places"]


def overview_pages(
    trajectory: Trajectory,
    bodies: Mapping[str, ReducedBody] | None = None,
    measurements: Sequence[Measurement] = (),
) -> list["Figure"]:
    """Return pages with a panel for each kind of result that the motion has.

    Parameters
    ----------
    trajectory
        The motion.
    bodies
        Reduced bodies, by name; their interfaces are shown instead of frame origins and modal coordinates.
    measurements
        Measurements of sensors, with a panel for each sensor and each unit of its columns.

    Raises
    ------
    ResultsError
        If the trajectory has no rows.
    """
    if len(trajectory.t) == 0:
        raise ResultsError("plot: the trajectory has no rows")
    known = dict(bodies or {})
    panels: list[Callable[[Axes], Axes]] = [
        lambda ax: plot_places(trajectory, known, ax),
        lambda ax: plot_energies(trajectory, ax),
    ]
    if any(body.n_q for body in trajectory.head.bodies):
        panels.append(lambda ax: plot_deformation(trajectory, known, ax))
    panels.append(lambda ax: plot_energy_balance(trajectory, ax))
    if trajectory.connection_names:
        panels.append(lambda ax: plot_loads(trajectory, ax))
    if trajectory.head.joints:
        panels.append(lambda ax: plot_drift(trajectory, ax))
    for measurement in measurements:
        for columns in groups_of(measurement):
            symbol = trajectory.units.time_symbol
            panels.append(partial(plot_measurement, measurement, columns=columns, time_symbol=symbol))
    return pages_of(panels, title=trajectory.head.system)


def plot_places(trajectory: Trajectory, bodies: Mapping[str, ReducedBody], ax: "Axes | None" = None) -> "Axes":
    """Plot positions in ground axes: interfaces of the given bodies, origins of the others, without those at rest."""
    ax = axes_for(trajectory, ax)
    paths = {}
    for name in trajectory.body_names:
        body = bodies.get(name)
        if body is None or not body.interfaces:
            paths[name] = trajectory.body(name).r
        else:
            paths |= {
                f"{name} {interface.name}": interface_positions(trajectory, name, body, interface.name)
                for interface in body.interfaces
            }
    reach = max(float(np.ptp(path, axis=0).max(initial=0.0)) for path in paths.values())
    curves = {
        f"{name} {axis}": path[:, a]
        for name, path in paths.items()
        for a, axis in enumerate("xyz")
        if np.ptp(path[:, a]) > 1e-6 * reach
    }
    draw_largest(ax, trajectory, curves)
    return labelled(ax, f"position [{trajectory.units.length_symbol}]")


def plot_deformation(trajectory: Trajectory, bodies: Mapping[str, ReducedBody], ax: "Axes | None" = None) -> "Axes":
    """Plot the magnitude of the interface displacements in the body frame; modal coordinates if no body is given."""
    ax, units = axes_for(trajectory, ax), trajectory.units
    if not bodies:
        coordinates = {
            f"{name} q{k + 1}": values
            for name in trajectory.body_names
            for k, values in enumerate(trajectory.body(name).q.T)
        }
        draw_largest(ax, trajectory, coordinates)
        return labelled(ax, f"modal coordinates [{units.mass_symbol}$^{{1/2}}$ {units.length_symbol}]")
    curves = {
        f"{name} {interface.name}": np.linalg.norm(
            elastic_displacements(trajectory, name, body, interface.name), axis=1
        )
        for name, body in bodies.items()
        for interface in body.interfaces
    }
    draw_largest(ax, trajectory, {name: values for name, values in curves.items() if np.any(values)})
    return labelled(ax, f"elastic displacement [{units.length_symbol}]")


def plot_loads(trajectory: Trajectory, ax: "Axes | None" = None) -> "Axes":
    """Plot the magnitude of the force in each joint and spring-damper."""
    ax, names = axes_for(trajectory, ax), trajectory.connection_names
    curves = {name: np.linalg.norm(trajectory.reaction(name).force, axis=1) for name in names}
    draw_largest(ax, trajectory, curves)
    return labelled(ax, f"force in joints and springs [{trajectory.units.force_symbol}]")


def draw_largest(ax: "Axes", trajectory: Trajectory, curves: Mapping[str, Array]) -> None:
    """Draw the curves with the largest values, in their order."""
    size = {name: float(np.abs(values).max(initial=0.0)) for name, values in curves.items()}
    kept = set(sorted(size, key=lambda name: -size[name])[:MOST_CURVES])
    for name, values in curves.items():
        if name in kept:
            ax.plot(trajectory.t, values, label=name)
    note_omitted(ax, len(kept), len(curves))
