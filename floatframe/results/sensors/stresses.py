"""Sensors of stress and strain on flexible bodies, from the stress modes of their files, static modes included."""

from dataclasses import dataclass

import numpy as np

from cms.reduced_body.reduced_body import ReducedBody
from cms.reduced_body.stress import stress_of, von_mises
from fe_models.foundation.arrays import Array
from fe_models.foundation.components import STRESS_COMPONENTS
from fe_models.foundation.copies import frozen_copies
from fe_models.foundation.words import nearest, quoted
from floatframe.bodies.flexible_body import FlexibleBody
from floatframe.checked_values import array_of_shape, number, unit_vector
from floatframe.errors import ModelError
from floatframe.results.place_motion import largest_von_mises, stress_modes
from floatframe.results.recovery import require_same_modes
from floatframe.results.sensors.measurement import Measurement
from floatframe.results.sensors.places import nearest_node
from floatframe.results.trajectory import Trajectory
from floatframe.system import System

__all__ = ["ElongationSensor", "StrainGauge", "StressSensor", "VonMisesSensor"]


def flexible_body(system: System, sensor: str, name: str) -> FlexibleBody:
    """Return a flexible body of the system; `ModelError` with the nearest name if there is none."""
    choices = [body.name for body in system.bodies if isinstance(body, FlexibleBody)]
    for body in system.bodies:
        if body.name == name and isinstance(body, FlexibleBody):
            return body
    raise ModelError(f"sensor {sensor!r}: no flexible body {quoted(name)}{nearest(name, choices)}")


def modes_at(body: FlexibleBody, sensor: str, position: Array | None, point: str | None) -> Array:
    """Return the stress modes at the kept node nearest to a position, or at a named stress point, (6, n_q)."""
    reduced = body.reduced
    if point is None:
        assert position is not None  # checked by the sensors
        return np.asarray(stress_modes(body.name, reduced)[nearest_node(body, position)])
    names = () if reduced.point_stress is None else reduced.point_stress.names
    if reduced.point_stress is None or point not in names:
        raise ModelError(
            f"sensor {sensor!r}: body {body.name!r} has no stress point {quoted(point)}{nearest(point, list(names))}"
        )
    return np.asarray(reduced.point_stress.modes[list(names).index(point)])


@frozen_copies
@dataclass(frozen=True, eq=False)
class StressSensor:
    """Stress at a node or stress point: six components in axes of the body frame, and von Mises'."""

    name: str
    body: str
    position: Array | None = None  #: mesh axes; the kept node nearest to it is taken, (3,) [m]
    point: str | None = None  #: or a stress point of the file by its name

    def __post_init__(self) -> None:
        if (self.position is None) == (self.point is None):
            raise ModelError(f"sensor {self.name!r}: expected either a position or a stress point")
        if self.position is not None:
            position = array_of_shape(f"sensor {self.name!r}: position", self.position, (3,))
            object.__setattr__(self, "position", position)

    def measure(self, system: System, trajectory: Trajectory) -> Measurement:
        """Return the components and von Mises' stress over time."""
        body = flexible_body(system, self.name, self.body)
        require_same_modes(trajectory, self.body, body.reduced)
        modes = modes_at(body, self.name, self.position, self.point)[None]
        stress = stress_of(modes, trajectory.body(self.body).q)[0].T
        columns = {component: stress[:, k] for k, component in enumerate(STRESS_COMPONENTS)}
        columns["von Mises"] = von_mises(stress)
        return Measurement(self.name, trajectory.t, columns, dict.fromkeys(columns, system.units.stress_symbol))


@frozen_copies
@dataclass(frozen=True, eq=False)
class VonMisesSensor:
    """The largest von Mises stress of a body over its kept nodes, and at which node it is."""

    name: str
    body: str

    def measure(self, system: System, trajectory: Trajectory) -> Measurement:
        """Return the largest stress over time, and the number of its node in the mesh."""
        body = flexible_body(system, self.name, self.body)
        largest, where = largest_von_mises(trajectory, self.body, body.reduced)
        columns = {"largest": largest, "node": body.reduced.node_ids[where].astype(float)}
        return Measurement(
            self.name, trajectory.t, columns, {"largest": system.units.stress_symbol, "node": "number in the mesh"}
        )


@frozen_copies
@dataclass(frozen=True, eq=False)
class StrainGauge:
    """Strain along a direction at a node, from its stress by Hooke's law of an isotropic material.

    epsilon = ((1 + nu) d·sigma d - nu tr(sigma)) / E
    """

    name: str
    body: str
    direction: Array  #: mesh axes, (3,)
    young: float  #: [Pa]
    poisson: float
    position: Array | None = None  #: mesh axes; the kept node nearest to it is taken, (3,) [m]
    point: str | None = None  #: or a stress point of the file by its name

    def __post_init__(self) -> None:
        where = f"sensor {self.name!r}"
        object.__setattr__(self, "direction", unit_vector(f"{where}: direction", self.direction))
        object.__setattr__(self, "young", number(f"{where}: young", self.young, above=0.0))
        object.__setattr__(self, "poisson", number(f"{where}: poisson", self.poisson, at_least=-1.0))
        if (self.position is None) == (self.point is None):
            raise ModelError(f"{where}: expected either a position or a stress point")
        if self.position is not None:
            object.__setattr__(self, "position", array_of_shape(f"{where}: position", self.position, (3,)))

    def measure(self, system: System, trajectory: Trajectory) -> Measurement:
        """Return the strain over time."""
        body = flexible_body(system, self.name, self.body)
        require_same_modes(trajectory, self.body, body.reduced)
        modes = modes_at(body, self.name, self.position, self.point)
        x, y, z = self.direction @ body.reduced.frame.axes
        along = np.array([x * x, y * y, z * z, 2 * y * z, 2 * x * z, 2 * x * y]) @ modes
        strain = ((1 + self.poisson) * along - self.poisson * modes[:3].sum(axis=0)) / self.young
        q = trajectory.body(self.body).q
        return Measurement(self.name, trajectory.t, {"strain": q @ strain}, {"strain": "-"})


@frozen_copies
@dataclass(frozen=True, eq=False)
class ElongationSensor:
    """Change of the distance between two nodes of a body over that distance: an extensometer; needs no stress modes."""

    name: str
    body: str
    position_a: Array  #: mesh axes; the kept node nearest to it is taken, (3,) [m]
    position_b: Array

    def __post_init__(self) -> None:
        for key in ("position_a", "position_b"):
            where = f"sensor {self.name!r}: {key}"
            object.__setattr__(self, key, array_of_shape(where, getattr(self, key), (3,)))

    def measure(self, system: System, trajectory: Trajectory) -> Measurement:
        """Return the mean strain between the nodes over time."""
        body = flexible_body(system, self.name, self.body)
        reduced: ReducedBody = body.reduced
        require_same_modes(trajectory, self.body, reduced)
        a, b = nearest_node(body, self.position_a), nearest_node(body, self.position_b)
        if a == b:
            raise ModelError(f"sensor {self.name!r}: both positions are nearest to one node; take them further apart")
        d = reduced.nodes[b] - reduced.nodes[a]
        change = trajectory.body(self.body).q @ (reduced.Phi[b] - reduced.Phi[a]).T
        length = np.linalg.norm(d)
        # |d + c| - |d| without the loss of digits of the difference
        grown = (2 * change @ d + (change**2).sum(axis=1)) / (np.linalg.norm(d + change, axis=1) + length)
        return Measurement(self.name, trajectory.t, {"strain": grown / length}, {"strain": "-"})
