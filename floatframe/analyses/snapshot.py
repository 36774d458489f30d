"""Equilibria, and single states as motions, for which sensors, tables and pictures of motions also work."""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np

from fe_models.foundation.arrays import Array
from fe_models.foundation.documents.table import Table, Tabular
from fe_models.foundation.presentation import presented
from fe_models.foundation.records import checked_fields
from floatframe.analyses.observed_state import observed_state
from floatframe.engine.compiling.file_frames import motion_of_engine, rows_of_file
from floatframe.engine.compiling.system import compiled_system
from floatframe.engine.kernels.memory import Rows
from floatframe.engine.kernels.work import new_work
from floatframe.errors import ModelError
from floatframe.model.state import State
from floatframe.model.system import System
from floatframe.results.motion import Motion, motion_of
from floatframe.results.results_file import MemorySource
from floatframe.results.sensor_plots import plot_bars
from floatframe.results.sensors import ReactionSensor, measured
from floatframe.results.sensors.measurement import Measurement
from floatframe.results.trajectory import Trajectory
from floatframe.results.validity import ValidityNote
from floatframe.simulation.motion_head import head_of, joint_rows

if TYPE_CHECKING:
    from matplotlib.figure import Figure

__all__ = ["Equilibrium", "snapshot", "states_as_motion"]


@presented
@dataclass(frozen=True, eq=False)
@checked_fields(ModelError)
class Equilibrium(Tabular):
    """A state in which all forces are in equilibrium; `motion` has its positions, reactions and sensors by name.

    Parameters
    ----------
    state
        State with the velocities of the steady rotation, zero at rest.
    u_dot
        Accelerations of the steady rotation, zero at rest, (n_u,).
    w
        Wrenches of joints and spring-dampers on their markers A, in ground axes, (n_w,).
    omega
        Angular velocity of the steady rotation in ground axes, (3,) [rad/s]; zero at rest.
    residual
        Largest unbalanced force, relative to the acting forces.
    n_iterations
        Number of iterations.
    validity
        Notes on bodies beyond the linear range of their frame, as for a motion.
    t
        Time at which all functions of time are evaluated [s].
    system
        The system; None: unknown.
    """

    state: State
    u_dot: Array
    w: Array
    omega: Array
    residual: float
    n_iterations: int
    validity: tuple[ValidityNote, ...] = ()
    t: float = 0.0
    system: System | None = None

    @cached_property
    def motion(self) -> Motion:
        """The equilibrium as a motion with one time: `rest.motion.sensor("tip").x`, `rest.motion.joint("pin").angle`.

        Raises
        ------
        ModelError
            If the system is not known.
        """
        if self.system is None:
            raise ModelError("equilibrium: its system is not known here; take snapshot(system, equilibrium)")
        return snapshot(self.system, self, t=self.t)

    def to_table(self, *names: str) -> Table:
        """Return measurements as a table with one row (see `Motion.measurements`), columns such as "tip x"."""
        return self.motion.to_table(*names)

    def plot(self, *names: str) -> "Figure":
        """Draw values as bars, a panel for each unit.

        Parameters
        ----------
        names
            Sensors, "tip" or "tip x", coordinates, "pin.angle", joints or bodies, as in `Motion.plot`; without names:
            force and moment in each joint and spring.

        Raises
        ------
        ResultsError
            If there is nothing to plot.
        """
        motion = self.motion
        found = motion.measurements(*names) if names else reactions_of(motion)
        return plot_bars(found, title=motion.head.system)


@dataclass(frozen=True)
class Snapshot:
    """Describes single states in the record of a run, in place of an integrator."""


def snapshot(
    system: System,
    state: State | Equilibrium,
    u_dot: Array | None = None,
    w: Array | None = None,
    *,
    t: float = 0.0,
) -> Motion:
    """Return one state as a motion with one time: `snapshot(system, rest).sensor("tip").x`, `.to_dataframe()`.

    Parameters
    ----------
    system
        The system.
    state
        A state, or an equilibrium with its accelerations and wrenches.
    u_dot
        Accelerations, (n_u,), in the order of `State.u`; default: those of the equilibrium, zero for a state.
    w
        Wrenches of the connections on their markers A, ground axes, (n_w,); default: as for `u_dot`.
    t
        The time at which all functions of time are evaluated [s].
    """
    if isinstance(state, Equilibrium):
        u_dot = state.u_dot if u_dot is None else u_dot
        w = state.w if w is None else w
        state = state.state
    compiled = compiled_system(system)
    model = compiled.model
    u_dot = np.zeros(int(model.bodies.u0[-1])) if u_dot is None else u_dot
    w = np.zeros(int(model.connections.w0[-1])) if w is None else w
    rows, _ = observed_state(compiled, new_work(model), *motion_of_engine(compiled, state, u_dot), w, t)
    rows = rows_of_file(compiled, rows)
    return as_motion(system, [rows], t, t)


def states_as_motion(system: System, states: Sequence[State]) -> Motion:
    """Return a sequence of states as a motion at times 0, 1, 2, ... without forces, for pictures."""
    compiled = compiled_system(system)
    model, work = compiled.model, new_work(compiled.model)
    still, w = np.zeros(int(model.bodies.u0[-1])), np.zeros(int(model.connections.w0[-1]))
    found = []
    for k, state in enumerate(states):
        rows, _ = observed_state(compiled, work, *motion_of_engine(compiled, state, still), w, float(k))
        found.append(rows_of_file(compiled, rows))
    return as_motion(system, found, 0.0, float(max(len(states) - 1, 0)))


def as_motion(system: System, rows: list[Rows], t: float, t_end: float) -> Motion:
    """Return result rows as a motion in memory."""
    head = head_of(system, Snapshot(), t, t_end, 1.0, 1)  # type: ignore[arg-type]
    return motion_of(Trajectory(head, MemorySource(joint_rows(system, rows)), is_complete=True), system)


def reactions_of(motion: Motion) -> list[Measurement]:
    """Return the sizes of force and moment in each joint and spring."""
    sensors = [ReactionSensor(name, name) for name in motion.connection_names]
    return [
        found.alone(column, f"{found.sensor} {column.split()[0]}")
        for found in measured(motion.system, motion, sensors).values()
        for column in ("force size", "moment size")
    ]
