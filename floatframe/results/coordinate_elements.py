"""Coordinates, forces and states of couplers and user forces during a motion."""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass

import numpy as np

from fe_models.foundation.arrays import Array
from fe_models.foundation.presentation import presented
from fe_models.foundation.words import nearest, quoted
from floatframe.engine.compiling.system import compiled_system
from floatframe.engine.kernels.model import Model
from floatframe.errors import ResultsError
from floatframe.model.forces import UserForce
from floatframe.model.system import System
from floatframe.results.trajectory import Trajectory

__all__ = ["CouplerMotion", "UserForceMotion", "coupler_motion", "user_force_motion"]


@presented
@dataclass(frozen=True, eq=False)
class CouplerMotion:
    """Coordinates of a coupler over time, in the order of its terms, and the forces along them."""

    t: Array  #: output times, (n_t,) [s]
    value: Array  #: distances, and angles counted through full turns, (n_t, n_terms) [m, rad]
    rate: Array  #: rates of the coordinates, (n_t, n_terms) [m/s, rad/s]
    #: force along each coordinate, positive if it tends to increase the coordinate, (n_t, n_terms) [N, N m]
    force: Array


@presented
@dataclass(frozen=True, eq=False)
class UserForceMotion:
    """Coordinates, forces and states of a user force over time, by name, each (n_t,)."""

    t: Array  #: output times, (n_t,) [s]
    value: Mapping[str, Array]  #: value of each coordinate; angles are counted through full turns
    rate: Mapping[str, Array]
    force: Mapping[str, Array]  #: force along each coordinate, positive if it tends to increase the coordinate
    states: Mapping[str, Array]


def user_force_motion(system: System, trajectory: Trajectory, name: str) -> UserForceMotion:
    """Return coordinates, forces and states of a user force during a motion of the system.

    Parameters
    ----------
    system
        The system that moved.
    trajectory
        Its motion.
    name
        Name of the user force.

    Raises
    ------
    ResultsError
        If there is no such force, or the motion is of another system.
    """
    forces = [force for force in system.forces if isinstance(force, UserForce)]
    names = [force.name for force in forces]
    if name not in names:
        raise ResultsError(f"user_force_motion: no user force {quoted(name)}{nearest(name, names)}")
    u = names.index(name)
    model, force = require_same_unknowns(system, trajectory), forces[u]
    k = len(system.couplers) + u
    values = model.coordinates.row[model.elements.coordinate0[k] : model.elements.coordinate0[k + 1]]
    states = model.states.row[model.elements.state0[k] : model.elements.state0[k + 1]]
    return UserForceMotion(
        trajectory.t,
        named_unknowns(trajectory, force.coordinates, values),
        named_unknowns(trajectory, force.coordinates, values + 1),
        named_unknowns(trajectory, force.forces, model.elements.core[k] + np.arange(len(force.forces))),
        named_unknowns(trajectory, force.states, states),
    )


def require_same_unknowns(system: System, trajectory: Trajectory) -> Model:
    """Return the compiled model of a system; `ResultsError` if the motion belongs to another system."""
    model = compiled_system(system).model
    if trajectory.head.w0[-1] != int(model.connections.w0[-1]):
        raise ResultsError(f"the motion of {trajectory.head.system!r} is not one of the system {system.name!r}")
    return model


def named_unknowns(trajectory: Trajectory, names: Iterable[str], rows: Iterable[int]) -> dict[str, Array]:
    """Return unknowns of connections over time by name, (n_t,) each."""
    return dict(zip(names, trajectory.unknowns([int(row) for row in rows]).T, strict=True))


def coupler_motion(system: System, trajectory: Trajectory, name: str) -> CouplerMotion:
    """Return the coordinates and forces of a coupler during a motion of the system.

    Parameters
    ----------
    system
        The system that moved.
    trajectory
        Its motion.
    name
        Name of the coupler.

    Raises
    ------
    ResultsError
        If there is no such coupler, or the motion is of another system.
    """
    names = [coupler.name for coupler in system.couplers]
    if name not in names:
        raise ResultsError(f"coupler_motion: no coupler {quoted(name)}{nearest(name, names)}")
    model = require_same_unknowns(system, trajectory)
    k = names.index(name)
    places = slice(int(model.elements.coordinate0[k]), int(model.elements.coordinate0[k + 1]))
    rows = model.coordinates.row[places]
    force = trajectory.unknowns([int(model.elements.core[k])]) * model.coordinates.factor[places]
    return CouplerMotion(
        trajectory.t, trajectory.unknowns(rows.tolist()), trajectory.unknowns((rows + 1).tolist()), force
    )
