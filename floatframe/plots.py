"""Plots of a computed motion: each function draws into the axes it is given, or into a figure of its own."""

from collections.abc import Callable, Mapping
from typing import TYPE_CHECKING

import numpy as np

from cms.arrays import Array
from cms.reduced_body import ReducedBody
from floatframe.energy_balance import balance_defect, energy_scale
from floatframe.errors import ResultsError
from floatframe.interface_motion import elastic_displacement, interface_path
from floatframe.trajectory import Trajectory

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

__all__ = [
    "plot_drift",
    "plot_elastic_displacement",
    "plot_energies",
    "plot_energy_defect",
    "plot_modal_coordinates",
    "plot_overview",
    "plot_positions",
    "plot_reactions",
]

MOST_CURVES = 8  #: in one plot; of more, those with the largest values are drawn
FLOOR = 1e-300  #: below which a logarithmic axis shows nothing


def plot_energies(trajectory: Trajectory, ax: "Axes | None" = None) -> "Axes":
    """Kinetic, strain, gravity and spring energy, their sum, and what forces and dampers exchanged."""
    ax, e = axes_for(trajectory, ax), trajectory.energies
    parts = {"kinetic": e.kinetic, "strain": e.strain, "gravity": e.gravity, "springs": e.springs,
             "work of forces": e.work, "dissipated": e.dissipated}  # fmt: skip
    for name, values in parts.items():
        if np.any(values):
            ax.plot(trajectory.t, values, label=name)
    ax.plot(trajectory.t, e.total, "k--", linewidth=1, label="total")
    return finished(ax, "energy", energy_unit(trajectory))


def plot_energy_defect(trajectory: Trajectory, ax: "Axes | None" = None) -> "Axes":
    """Error of the energy balance over the largest energy that moves about."""
    ax = axes_for(trajectory, ax)
    ax.plot(trajectory.t, balance_defect(trajectory) / (energy_scale(trajectory) or 1.0), "k")
    return finished(ax, "error of the energy balance / largest energy", "")


def plot_positions(
    trajectory: Trajectory, bodies: Mapping[str, ReducedBody] | None = None, ax: "Axes | None" = None
) -> "Axes":
    """Positions in ground axes: interfaces of the given bodies, frame origins of the others; what stays is left out."""
    ax = axes_for(trajectory, ax)
    points = {}
    for name in trajectory.body_names:
        motion = trajectory.body(name)
        body = (bodies or {}).get(name)
        if body is None or not body.interfaces:
            points[name] = motion.r
        else:
            points |= {f"{name} {interface.name}": interface_path(motion, interface) for interface in body.interfaces}
    reach = max(float(np.ptp(path, axis=0).max(initial=0.0)) for path in points.values())
    curves = {
        f"{name} {axis}": path[:, a]
        for name, path in points.items()
        for a, axis in enumerate("xyz")
        if np.ptp(path[:, a]) > 1e-6 * reach
    }
    draw_largest(ax, trajectory, curves)
    return finished(ax, "position", trajectory.units.length_symbol)


def plot_modal_coordinates(trajectory: Trajectory, ax: "Axes | None" = None) -> "Axes":
    """Modal coordinates of all bodies."""
    ax = axes_for(trajectory, ax)
    curves = {
        f"{name} q{k + 1}": values
        for name in trajectory.body_names
        for k, values in enumerate(trajectory.body(name).q.T)
    }
    draw_largest(ax, trajectory, curves)
    units = trajectory.units
    return finished(ax, "modal coordinates", f"{units.mass_symbol}$^{{1/2}}$ {units.length_symbol}" if curves else "")


def plot_elastic_displacement(
    trajectory: Trajectory, bodies: Mapping[str, ReducedBody], ax: "Axes | None" = None
) -> "Axes":
    """Elastic displacement of the interfaces in the body frame, its magnitude; `bodies` by name."""
    ax = axes_for(trajectory, ax)
    curves = {
        f"{name} {interface.name}": np.linalg.norm(elastic_displacement(trajectory.body(name), interface), axis=1)
        for name, body in bodies.items()
        for interface in body.interfaces
    }
    draw_largest(ax, trajectory, {name: values for name, values in curves.items() if np.any(values)})
    return finished(ax, "elastic displacement of interfaces", trajectory.units.length_symbol)


def plot_reactions(trajectory: Trajectory, ax: "Axes | None" = None) -> "Axes":
    """Magnitude of the force that each joint and spring-damper carries."""
    ax = axes_for(trajectory, ax)
    names = trajectory.connection_names
    curves = {name: np.linalg.norm(trajectory.reaction(name).force, axis=1) for name in names}
    draw_largest(ax, trajectory, curves)
    return finished(ax, "force in joints and springs", trajectory.units.force_symbol)


def plot_drift(trajectory: Trajectory, ax: "Axes | None" = None) -> "Axes":
    """How far each joint is from being closed: distance and angle, logarithmic."""
    ax, length = axes_for(trajectory, ax), trajectory.units.length_symbol
    for name in trajectory.head.joints:
        drift = trajectory.drift(name)
        for kind, values in ((f"distance [{length}]", drift.distance), ("angle [rad]", drift.angle)):
            if np.any(np.abs(values) > FLOOR):
                ax.semilogy(
                    trajectory.t, np.where(np.abs(values) > FLOOR, np.abs(values), np.nan), label=f"{name} {kind}"
                )
    return finished(ax, "drift of joints", "")


def plot_overview(trajectory: Trajectory, bodies: Mapping[str, ReducedBody] | None = None) -> "Figure":
    """Return a figure with all of these; elastic displacement where the bodies are given, else modal coordinates.

    Raises
    ------
    ResultsError
        If the trajectory has no rows.
    """
    from matplotlib.figure import Figure

    if len(trajectory.t) == 0:
        raise ResultsError("plot: the trajectory has no rows")
    panels: list[Callable[[Trajectory, Axes], Axes]] = [lambda t, ax: plot_positions(t, bodies, ax), plot_energies]
    if any(body.n_q for body in trajectory.head.bodies):
        if bodies:
            panels.append(lambda t, ax: plot_elastic_displacement(t, bodies, ax))
        else:
            panels.append(plot_modal_coordinates)
    panels.append(plot_energy_defect)
    if trajectory.connection_names:
        panels.append(plot_reactions)
    if trajectory.head.joints:
        panels.append(plot_drift)
    n_rows = (len(panels) + 1) // 2
    figure = Figure(figsize=(13, 3.4 * n_rows + 0.6), layout="constrained")
    figure.suptitle(trajectory.head.system)
    axes = figure.subplots(n_rows, 2, squeeze=False).ravel()
    for panel, ax in zip(panels, axes, strict=False):
        panel(trajectory, ax)
    for ax in axes[len(panels) :]:
        ax.remove()
    return figure


def axes_for(trajectory: Trajectory, ax: "Axes | None") -> "Axes":
    """Return the axes, or those of a new figure, with time along x."""
    if ax is None:
        from matplotlib.figure import Figure

        ax = Figure(layout="constrained").add_subplot()
    ax.set_xlabel(f"time [{trajectory.units.time_symbol}]")
    ax.grid(alpha=0.3)
    return ax


def draw_largest(ax: "Axes", trajectory: Trajectory, curves: Mapping[str, Array]) -> None:
    """Draw the curves with the largest values, in their order."""
    size = {name: float(np.abs(values).max(initial=0.0)) for name, values in curves.items()}
    kept = set(sorted(size, key=lambda name: -size[name])[:MOST_CURVES])
    for name, values in curves.items():
        if name in kept:
            ax.plot(trajectory.t, values, label=name)
    if len(kept) < len(curves):
        ax.text(0.99, 0.02, f"the largest {len(kept)} of {len(curves)}", ha="right", transform=ax.transAxes, alpha=0.6)


def finished(ax: "Axes", title: str, unit: str) -> "Axes":
    """Set title, unit and legend."""
    ax.set_title(f"{title} [{unit}]" if unit else title, loc="left", fontsize="medium")
    if ax.get_legend_handles_labels()[0]:
        ax.legend(fontsize="small")
    return ax


def energy_unit(trajectory: Trajectory) -> str:
    """Return the unit of energy: force times length."""
    return f"{trajectory.units.force_symbol} {trajectory.units.length_symbol}"
