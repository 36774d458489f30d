"""Data of a compiled system for structure-preserving schemes: its bodies, and the constraints of each connection."""

from dataclasses import dataclass

import numpy as np

from fe_models.foundation.arrays import IntArray
from floatframe.engine.compiling.system import CompiledSystem, compiled_system
from floatframe.engine.kernels.model import COUPLER, ELEMENT, JOINT, USER_FORCE, Model, marker_shapes
from floatframe.engine.structure_preserving.bodies import CentralBody, central_bodies
from floatframe.errors import ModelError
from floatframe.model.joints.rows import is_held_velocity, kind_of
from floatframe.model.system import System

__all__ = ["Connection", "DiscreteSystem", "discrete_system", "multiplier_rows", "state_rows"]


@dataclass(frozen=True, eq=False)
class Connection:
    """A joint, force or coupler between markers A and B; couplers and user forces have two markers per coordinate."""

    number: int
    markers: tuple[int, ...]
    bodies: tuple[int, ...]  #: numbers of its bodies, without repetition
    held: tuple[int, ...]  #: constraint rows
    first: int  #: index of the first multiplier
    states: tuple[int, ...]  #: rows of the states
    first_state: int  #: index of the first state among all states


@dataclass(frozen=True, eq=False)
class DiscreteSystem:
    """Constants of a system for the structure-preserving schemes."""

    model: Model
    bodies: tuple[CentralBody, ...]
    connections: tuple[Connection, ...]
    n_held: int
    n_states: int
    length: float

    @property
    def held(self) -> IntArray:
        """Constraint rows in the order of the multipliers."""
        return np.array([k for c in self.connections for k in c.held], dtype=np.int64)

    def is_driven(self, connection: Connection, k: int) -> bool:
        """Whether a prescribed motion does work through constraint k of a connection."""
        line = line_of(self.model, connection.number)
        is_driven_line = line >= 0 and self.model.lines.row[line] >= 0
        return bool(is_driven_line or self.model.rows.motion[k] >= 0)

    def turns(self, m: int) -> bool:
        """Whether marker m rotates relative to its body."""
        markers = self.model.markers
        if markers.body[m] < 0 or markers.psi0[m] < 0:
            return False
        return bool(markers.bend0[m] >= 0 or marker_shapes(self.model, markers.psi, m)[3:].any())


def discrete_system(system: System, scheme: str) -> DiscreteSystem:
    """Return the constants of a system.

    Raises
    ------
    ModelError
        If the scheme does not support a kind of joint or force, or a mode has no mass.
    """
    compiled = compiled_system(system)
    model = compiled.model
    require_known(compiled, scheme)
    bodies = central_bodies(model, compiled.body_names, scheme)
    connections, n_held, n_states = [], 0, 0
    for c in range(len(model.connections.size)):
        law = int(model.connections.law[c])
        rows = range(int(model.connections.w0[c]), int(model.connections.w0[c + 1]))
        held = tuple(k for k in rows if kind_of(model.rows.kind[k]).holds)
        if law == ELEMENT:
            held = multiplier_rows(model, c)
        states = state_rows(model, c)
        markers = tuple(markers_of(model, c))
        joined = tuple(sorted({int(model.markers.body[m]) for m in markers} - {-1}))
        connections.append(Connection(c, markers, joined, held, n_held, states, n_states))
        n_held, n_states = n_held + len(held), n_states + len(states)
    return DiscreteSystem(model, bodies, tuple(connections), n_held, n_states, compiled.length)


def line_of(model: Model, c: int) -> int:
    """Return the deformed line along which marker A of connection c slides, -1 for none."""
    is_joint = int(model.connections.law[c]) == JOINT
    return int(model.markers.line[model.connections.a[c]]) if is_joint else -1


def markers_of(model: Model, c: int) -> list[int]:
    """Return the markers of connection c."""
    law, item = int(model.connections.law[c]), int(model.connections.item[c])
    if law == ELEMENT:
        first = int(model.connections.a[c])
        return list(range(first, first + int(model.laws.head[item, 0])))
    if law not in (COUPLER, USER_FORCE):
        return [int(model.connections.a[c]), int(model.connections.b[c])]
    return [int(m) for p in coordinates_of(model, item) for m in (model.coordinates.a[p], model.coordinates.b[p])]


def coordinates_of(model: Model, element: int) -> range:
    """Return the numbers of the coordinates of an element."""
    return range(int(model.elements.coordinate0[element]), int(model.elements.coordinate0[element + 1]))


def state_rows(model: Model, c: int) -> tuple[int, ...]:
    """Return the rows of the states of connection c."""
    rows, w0 = model.states.row, model.connections.w0
    return tuple(int(k) for k in rows[(w0[c] <= rows) & (rows < w0[c + 1])])


def multiplier_rows(model: Model, c: int) -> tuple[int, ...]:
    """Return the multiplier rows of element c, which are its last rows."""
    n_multipliers, last = int(model.laws.head[int(model.connections.item[c]), 3]), int(model.connections.w0[c + 1])
    return tuple(range(last - n_multipliers, last))


def require_known(compiled: CompiledSystem, scheme: str) -> None:
    """Raise `ModelError` with the name of a joint or element that the scheme does not support."""
    model = compiled.model
    for c, name in enumerate(compiled.connection_names):
        kinds = model.rows.kind[model.connections.w0[c] : model.connections.w0[c + 1]]
        if model.connections.law[c] == ELEMENT:
            require_known_element(model, c, name, scheme)
            continue
        if scheme == "Variational" and is_held_velocity(kinds).any():
            raise ModelError(
                f"{scheme}: joint {name!r} has nonholonomic constraints, which follow from no variational principle; "
                "use energy-momentum or generalized-alpha"
            )


def require_known_element(model: Model, c: int, name: str, scheme: str) -> None:
    """Raise `ModelError` if the scheme does not support element c."""
    first = int(model.connections.a[c])
    markers = range(first, first + int(model.laws.head[int(model.connections.item[c]), 0]))
    if (model.markers.accelerated[list(markers)] >= 0).any():
        raise ModelError(
            f"{scheme}: element {name!r} depends on accelerations, but steps of this scheme have only changes of "
            "momenta; use generalized-alpha"
        )
    if scheme == "Variational" and multiplier_rows(model, c):
        raise ModelError(
            f"{scheme}: element {name!r} has multipliers of its own, but in this scheme multipliers have different "
            "values at both ends of a step, and the law may be nonlinear in them; use energy-momentum or "
            "generalized-alpha"
        )
