"""A compiled system as the discrete schemes see it, and the loads of its joints and forces over a step."""

from dataclasses import dataclass

import numpy as np

from fe_models.foundation.arrays import Array
from floatframe.compiling.system import compiled_system
from floatframe.discrete.bodies import BodyStep, CentralBody, central_bodies
from floatframe.discrete.constraints import Loads, Pair, Span, add_reaction, constraint_value, reaction_direction
from floatframe.discrete.forces import Given, body_load, coordinate_load, point_load, spring_load
from floatframe.discrete.markers import BodyMarker, Load, body_marker, marker_step
from floatframe.errors import ModelError
from floatframe.forces import BodyLoad, Gravity, JointForce, PointForce, SpringDamper
from floatframe.joints.rows import PUSH, is_held_length, kind_of
from floatframe.kernels.model import JOINT, Model
from floatframe.kernels.model import SPRING as SPRING_LAW
from floatframe.rotations import dot
from floatframe.system import System

__all__ = ["Connection", "DiscreteSystem", "discrete_system"]

KNOWN_FORCES = (BodyLoad, Gravity, JointForce, PointForce, SpringDamper)


@dataclass(frozen=True, eq=False)
class Connection:
    """A joint or spring-damper between two markers."""

    number: int
    a: BodyMarker
    b: BodyMarker
    held: tuple[int, ...]  #: rows that hold something
    loaded: tuple[int, ...]  #: rows with forces along their coordinate
    first: int  #: first multiplier


@dataclass(frozen=True, eq=False)
class DiscreteSystem:
    """Constants of a system."""

    model: Model
    bodies: tuple[CentralBody, ...]
    connections: tuple[Connection, ...]
    loads: tuple[tuple[tuple[int, BodyMarker], ...], ...]  #: point forces on each body: number, marker
    cases: tuple[tuple[int, ...], ...]  #: load cases on each body
    n_held: int
    length: float
    markers: tuple[BodyMarker, ...]  #: all

    def own_loads(self, i: int, step: BodyStep, load: Load, span: Span) -> Given:
        """Add gravity, point forces and load cases on body i; gravity has a potential and gives no work."""
        body = self.bodies[i]
        load.force += body.m * self.model.gravity
        given: Array | float = 0.0
        for k, marker in self.loads[i]:
            given = given + point_load(self.model, k, marker_step(marker, step), load, span).given
        for k in self.cases[i]:
            given = given + body_load(self.model, k, body, step, load, span).given
        return Given(given)

    def connection_loads(self, connection: Connection, pair: Pair, loads: Loads, span: Span, f: Array) -> Given:
        """Add reactions with multipliers f, (..., n_held of it), and the forces of a connection."""
        model = self.model
        if model.connections.law[connection.number] == SPRING_LAW:
            return spring_load(model, connection.number, pair, loads, span)
        for j, k in enumerate(connection.held):
            add_reaction(model, k, pair, loads, span, f[..., j])
        given: Array | float = 0.0
        taken: Array | float = 0.0
        for k in connection.loaded:
            normal = normal_force(model, k, connection, pair, f, span)
            part = coordinate_load(model, k, pair, loads, span, normal)
            given, taken = given + part.given, taken + part.taken
        return Given(given, taken)

    def values(self, connection: Connection, pair: Pair, span: Span) -> list[Array]:
        """Return the held rows of a connection at the end of a step."""
        return [constraint_value(self.model, k, pair, span) for k in connection.held]


def normal_force(model: Model, k: int, connection: Connection, pair: Pair, f: Array, span: Span) -> Array:
    """Return the size of the force in a joint across the axis of its row k."""
    a, _ = pair
    F = np.zeros((*f.shape[:-1], 3), f.dtype)
    for j, row in enumerate(connection.held):
        if is_held_length(model.rows.kind[row]):
            F = F + f[..., j, None] * reaction_direction(model, row, pair, span)
    axis = model.rows.x[k] if int(model.rows.kind[k]) == PUSH else np.cross(model.rows.x[k], model.rows.z[k])
    E_0, E_1 = a.ends(axis)
    E = 0.5 * (E_0 + E_1)
    square = dot(F, F) - dot(F, E) ** 2
    is_zero = np.real(square) <= 0
    return np.where(is_zero, 0.0, np.sqrt(np.where(is_zero, 1.0, square)))


def discrete_system(system: System, scheme: str) -> DiscreteSystem:
    """Return the constants of a system.

    Raises
    ------
    ModelError
        If a joint or force is of a kind that the scheme does not know, or a mode has no mass.
    """
    compiled = compiled_system(system)
    model = compiled.model
    for force in system.forces:
        if not isinstance(force, KNOWN_FORCES):
            raise ModelError(f"{scheme}: forces of the kind {type(force).__name__} are not known to it; "
                             "use generalized-alpha")  # fmt: skip
    for c, name in enumerate(compiled.connection_names):
        if model.connections.law[c] not in (JOINT, SPRING_LAW):
            raise ModelError(f"{scheme}: {name!r} is of a kind that is not known to it; use generalized-alpha")
        if max(model.markers.line[model.connections.a[c]], model.markers.line[model.connections.b[c]]) >= 0:
            words = "slides along a deformed line, which is not known to it"
            raise ModelError(f"{scheme}: {name!r} {words}; use generalized-alpha")
        if not all(kind_of(k).in_steps for k in model.rows.kind[model.connections.w0[c] : model.connections.w0[c + 1]]):
            raise ModelError(f"{scheme}: joint {name!r} is of a kind that is not known to it; use generalized-alpha")
    bodies = central_bodies(model, compiled.body_names, scheme)
    markers = tuple(body_marker(model, bodies, m) for m in range(len(model.markers.body)))
    connections, n_held = [], 0
    for c in range(len(model.connections.size)):
        rows = range(int(model.connections.w0[c]), int(model.connections.w0[c + 1]))
        held = tuple(k for k in rows if kind_of(model.rows.kind[k]).holds)
        loaded = tuple(k for k in rows if kind_of(model.rows.kind[k]).is_loaded)
        a, b = int(model.connections.a[c]), int(model.connections.b[c])
        connections.append(Connection(c, markers[a], markers[b], held, loaded, n_held))
        n_held += len(held)
    point_forces: list[list[tuple[int, BodyMarker]]] = [[] for _ in bodies]
    cases: list[list[int]] = [[] for _ in bodies]
    for k, m in enumerate(model.loads.marker):
        marker = markers[int(m)]
        if marker.body >= 0:
            point_forces[marker.body].append((k, marker))
    for k, i in enumerate(model.body_loads.body):
        cases[int(i)].append(k)
    return DiscreteSystem(
        model, bodies, tuple(connections), tuple(map(tuple, point_forces)), tuple(map(tuple, cases)), n_held,
        compiled.length, markers,
    )  # fmt: skip
