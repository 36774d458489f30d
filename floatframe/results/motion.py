"""A motion together with its system: joints, bodies and sensors by name, tables for pandas and xarray.

motion = integrate(system, GeneralizedAlpha(), t_end=1.0, h=1e-3)      # or read_results("crank.h5")
motion.joint("pin").angle                                              # (n_t,), counted through full turns
motion.body("rod").interface("big_end").position                       # (n_t, 3), in ground axes
motion.sensor("tip").x
motion.plot("tip", "pin")                                              # a figure with a panel for each unit
motion.to_dataframe("tip", "pin.angle")
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, fields
from functools import cached_property
from typing import TYPE_CHECKING

from cms.body.reduced_body import ReducedBody
from fe_models.foundation.arrays import Array
from fe_models.foundation.documents.table import Table, Tabular
from fe_models.foundation.presentation import Summary, presented
from fe_models.foundation.records import checked_fields, frozen_copies
from fe_models.foundation.words import nearest, quoted
from floatframe.errors import ModelError, ResultsError
from floatframe.model.bodies.flexible_body import FlexibleBody
from floatframe.model.system import System
from floatframe.results.place_motion import PlaceMotion, interface_motion, nodal_stress
from floatframe.results.recovery import nodal_displacements
from floatframe.results.sensor_choice import chosen_measurements, controller_samples
from floatframe.results.sensor_plots import figure_of, plot_columns, sensor_pages
from floatframe.results.sensors import coordinate_sensors, measured, measurement_of, sensors_of
from floatframe.results.sensors.joint_coordinate import JointCoordinate
from floatframe.results.sensors.left_out import LeftOutEnergy, left_out
from floatframe.results.sensors.measurement import Measurement
from floatframe.results.trajectory import BodyMotion, Drift, Reaction, Trajectory

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

__all__ = ["JointMotion", "Motion", "MovedBody", "motion_of"]


@presented
@frozen_copies
@dataclass(frozen=True, eq=False)
@checked_fields(ModelError)
class Motion(Tabular, Trajectory):
    """A motion together with its system.

    Parameters
    ----------
    head, source, is_complete, path, validity
        As in `Trajectory`.
    known
        The system, or a function that returns it when needed; None: unknown.
    """

    known: System | Callable[[], System | None] | None = None

    @cached_property
    def system(self) -> System:
        """The system that moved; `ResultsError` if it is not known."""
        found = self.known if self.known is None or isinstance(self.known, System) else self.known()
        if found is None:
            raise ResultsError(
                f"motion of {self.head.system!r}: its system is not known here; give it, as in "
                "floatframe.read_results(path, system=system)"
            )
        return found

    def body(self, name: str) -> "MovedBody":
        """Return the motion of a body, with the motion of points on it."""
        motion = super().body(name)
        return MovedBody(*(getattr(motion, part.name) for part in fields(BodyMotion)), motion=self, name=name)

    def joint(self, name: str) -> "JointMotion":
        """Return coordinates, reaction and constraint error of a joint; `ResultsError` if the joint does not exist."""
        if name not in self.head.joints:
            raise ResultsError(f"motion: no joint {quoted(name)}{nearest(name, self.head.joints)}")
        return JointMotion(self, name)

    def sensor(self, name: str) -> Measurement:
        """Return the measurement of a sensor, joint coordinate ("pin.angle") or one of their columns ("tip x").

        Raises
        ------
        ModelError
            If there is no such sensor, coordinate or column.
        """
        return measurement_of(self.system, self, name)

    def controller(self, name: str) -> Measurement:
        """Return outputs and states of a sampled controller at its sampling instants, whose times are its `t`.

        Columns are the outputs by the names of their forces, and "state 1", "state 2", ...: the memory after each call.

        Raises
        ------
        ResultsError
            If there is no such controller.
        """
        return controller_samples(self.system, self, name)

    @cached_property
    def left_out(self) -> Mapping[str, LeftOutEnergy]:
        """Estimates of the strain energy that the modes of flexible bodies left out, by the name of the body.

        Bodies whose modal files have no left-out shapes are not included.
        """
        return left_out(self.system, self)

    def measurements(self, *names: str) -> tuple[Measurement, ...]:
        """Return measurements of sensors and coordinates by name, with wildcards * and ?; all if no name is given.

        The name of a joint stands for its coordinates and its reaction, the name of a body for the position of its
        origin, and the name of a controller for its outputs and states.

        Raises
        ------
        ModelError
            If a name matches nothing.
        """
        system = self.system
        if names:
            return tuple(chosen_measurements(system, self, names))
        return tuple(measured(system, self, [*coordinate_sensors(system), *sensors_of(system)]).values())

    def to_table(self, *names: str) -> Table:
        """Return the time t and measurements (see `measurements`) as a table with columns such as "tip x".

        `motion.to_table("tip").write("tip.csv")` writes them, also as .json, .mat, .npz or .parquet, and
        `motion.to_dataframe("tip")` returns them for pandas.
        """
        chosen = self.measurements(*names)
        columns = {one.channel(name): values for one in chosen for name, values in one.columns.items()}
        units = {one.channel(name): unit for one in chosen for name, unit in one.units.items()}
        return Table({"t": self.t, **columns}, {"t": self.units.time_symbol, **units})

    def plot(self, *names: str, ax: "Axes | None" = None, page: int = 1) -> "Figure":
        """Plot measurements over time (see `measurements`), with units of the system at the axes.

        Parameters
        ----------
        names
            Sensors, "tip" or "tip x", coordinates, "pin.angle", joints, bodies or controllers; without names: all
            sensors and coordinates.
        ax
            Axes of a figure, into which all columns are drawn; they must have one unit. None: a new figure, with a
            panel for each sensor and unit, and a dozen curves at most in each.
        page
            Number of the page of the new figure, from 1; a page has eight panels at most, and its title says how many
            pages there are.

        Returns
        -------
        matplotlib.figure.Figure
            The figure of the axes, or the new one: `motion.plot("tip").savefig("tip.png")`.

        Raises
        ------
        ResultsError
            If there is nothing to plot, there is no such page, or columns for given axes have several units.
        """
        chosen, symbol = self.measurements(*names), self.units.time_symbol
        if ax is None:
            pages = sensor_pages(chosen, title=self.head.system, time_symbol=symbol)
            if not 1 <= page <= len(pages):
                raise ResultsError(f"plot: page = {page}: expected a page from 1 to {len(pages)}")
            return pages[page - 1]
        plot_columns(chosen, ax, time_symbol=symbol)
        return figure_of(ax)


@presented
@frozen_copies
@dataclass(frozen=True, eq=False, kw_only=True)
class MovedBody(BodyMotion):
    """Motion of one body of a system, and of points on the body."""

    motion: Motion
    name: str

    @property
    def reduced(self) -> ReducedBody:
        """The reduced body; `ResultsError` if this body is rigid."""
        body = self.motion.system.body(self.name)
        if not isinstance(body, FlexibleBody):
            raise ResultsError(f"body {self.name!r} is rigid: it has no interfaces, nodes or stress")
        return body.reduced

    def interface(self, name: str) -> PlaceMotion:
        """Return the motion of an interface and its axes, in ground axes."""
        return interface_motion(self.motion, self.name, self.reduced, name)

    def displacement(self, i_time: int) -> Array:
        """Return the elastic displacement of the kept nodes at an output time, axes of B, (n_kept, 3) [m]."""
        return nodal_displacements(self.motion, self.name, self.reduced, i_time)

    def stress(self, i_time: int) -> Array:
        """Return the stress at the kept nodes at an output time, axes of B, (n_kept, 6) [Pa]: xx yy zz yz xz xy."""
        return nodal_stress(self.motion, self.name, self.reduced, i_time)


@presented
@dataclass(frozen=True, eq=False)
class JointMotion:
    """A joint in a motion: `angle`, `angle_rate` and `angle_force` for a coordinate "angle", and so on, each (n_t,)."""

    motion: Motion
    name: str

    def summary(self) -> Summary:
        """Return the content shown by `repr` and notebooks: the range of each coordinate with its unit."""
        table = []
        for name in self.coordinates:
            found = self.coordinate(name)
            table.append((name, found.units["value"], f"{found.value.min():.6g}", f"{found.value.max():.6g}"))
        return Summary(f"JointMotion {self.name!r}", [], ("coordinate", "unit", "least", "greatest"), table)

    @property
    def coordinates(self) -> tuple[str, ...]:
        """Names of the joint's coordinates."""
        joints = {joint.name: tuple(joint.coordinates) for joint in self.motion.system.joints}
        return joints[self.name]

    @property
    def reaction(self) -> Reaction:
        """Force and moment on marker A of the joint, ground axes."""
        return self.motion.reaction(self.name)

    @property
    def drift(self) -> Drift:
        """Constraint error of the joint."""
        return self.motion.drift(self.name)

    def coordinate(self, name: str) -> Measurement:
        """Return the columns value, rate and force of a coordinate; `ResultsError` if it does not exist."""
        if name not in self.coordinates:
            choices = self.coordinates
            raise ResultsError(
                f"joint {self.name!r}: no coordinate {quoted(name)}{nearest(name, choices)}; it has "
                f"{', '.join(choices) or 'none'}"
            )
        return JointCoordinate(self.name, name).measure(self.motion.system, self.motion)

    def __getattr__(self, name: str) -> Array:
        if name.startswith("__"):
            raise AttributeError(name)
        coordinate, part = name, "value"
        for end in ("rate", "force"):
            if name.endswith(f"_{end}") and name not in self.coordinates:
                coordinate, part = name.removesuffix(f"_{end}"), end
        if coordinate not in self.coordinates:
            raise AttributeError(
                f"joint {self.name!r} has no {name!r}; its coordinates are {', '.join(self.coordinates) or 'none'}"
            )
        return self.coordinate(coordinate)[part]

    def __dir__(self) -> list[str]:
        ends = ("", "_rate", "_force")
        return [*super().__dir__(), *(f"{name}{end}" for name in self.coordinates for end in ends)]


def motion_of(trajectory: Trajectory, system: System | Callable[[], System | None] | None) -> Motion:
    """Return a motion with its system, or with a function that loads the system when it is needed."""
    t = trajectory
    return Motion(t.head, t.source, t.is_complete, t.path, t.validity, system)
