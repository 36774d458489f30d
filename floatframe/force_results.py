"""Forces over a motion: couplers, as named numbers; bushings and contacts."""

from dataclasses import dataclass

import numpy as np

from cms.arrays import Array
from cms.words import nearest
from floatframe.errors import ResultsError
from floatframe.system import System
from floatframe.trajectory import Trajectory

__all__ = ["PortMotion", "coupler_motion"]


@dataclass(frozen=True, eq=False)
class PortMotion:
    """Coordinates of a coupler over time, in the order of its terms, and the forces along them."""

    t: Array  #: (n_t,) [s]
    value: Array  #: distances, angles beyond full turns, (n_t, n_terms) [m, rad]
    rate: Array  #: (n_t, n_terms) [m/s, rad/s]
    force: Array  #: that acts to increase the coordinate, (n_t, n_terms) [N, N m]


def coupler_motion(system: System, trajectory: Trajectory, name: str) -> PortMotion:
    """Return the coordinates and forces of a coupler over a motion of the system.

    Raises
    ------
    ResultsError
        If there is no such coupler, or the motion is one of another system.
    """
    names = [coupler.name for coupler in system.couplers]
    if name not in names:
        raise ResultsError(f"coupler_motion: no coupler {name!r}{nearest(name, names)}")
    model, w = system.compiled.model, trajectory.source.read("w")
    if w.shape[1] != int(model.c_w0[-1]):
        raise ResultsError(f"coupler_motion: the motion is one of another system than {system.name!r}")
    k = names.index(name)
    ports = slice(int(model.port0[k]), int(model.port0[k + 1]))
    rows = model.p_row[ports]
    force = np.outer(w[:, model.core[k]], model.p_factor[ports])
    return PortMotion(trajectory.t, w[:, rows], w[:, rows + 1], force)
