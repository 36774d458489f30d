"""A system as steps in Python see it, and the loads of its joints and forces over a step."""

from dataclasses import dataclass

import numpy as np

from fe_models.foundation.arrays import Array
from floatframe.engine.kernels.model import BUSHING, CONTACT, COUPLER, ELEMENT, JOINT, USER_FORCE, Model
from floatframe.engine.kernels.model import SPRING as SPRING_LAW
from floatframe.engine.structure_preserving.system import (
    Connection,
    DiscreteSystem,
    coordinates_of,
    line_of,
)
from floatframe.model.joints.rows import COUPLE, PUSH, RIM_HEIGHT, ROLL, is_held_length, kind_of
from floatframe.model.rotations import dot
from tests.floatframe.engine.structure_preserving.in_python.bodies import Body, BodyStep, step_bodies
from tests.floatframe.engine.structure_preserving.in_python.constraints import (
    Loads,
    Pair,
    Span,
    add_reaction,
    constraint_value,
    rate_in_time,
    reaction_direction,
)
from tests.floatframe.engine.structure_preserving.in_python.contacts import V_0, contact_load, speed_of_approach
from tests.floatframe.engine.structure_preserving.in_python.coordinates import coordinate_ends, counted
from tests.floatframe.engine.structure_preserving.in_python.couplers import add_coupler_reaction, coupler_value
from tests.floatframe.engine.structure_preserving.in_python.deformed_lines import (
    DeformedLine,
    Slide,
    add_line_reaction,
    deformed_line,
    line_rate_in_time,
    line_value,
)
from tests.floatframe.engine.structure_preserving.in_python.forces import (
    Given,
    body_load,
    bushing_load,
    coordinate_load,
    point_load,
    spring_load,
    user_force_load,
    user_state_rates,
)
from tests.floatframe.engine.structure_preserving.in_python.functions import value_of
from tests.floatframe.engine.structure_preserving.in_python.markers import (
    BodyMarker,
    Load,
    MarkerStep,
    body_marker,
    marker_step,
)
from tests.floatframe.engine.structure_preserving.in_python.public_elements import (
    add_height_reaction,
    add_roll_reaction,
    element_load,
    element_rates,
    element_values,
    height_value,
    roll_value,
)


@dataclass(frozen=True, eq=False)
class Ends:
    """The markers of a connection over a step, and the loads on their bodies."""

    markers: list[MarkerStep]
    loads: list[Load | None]
    slide: Slide | None = None  #: of a marker A that slides along a line

    @property
    def pairs(self) -> list[Pair]:
        """The markers A and B of each coordinate."""
        return list(zip(self.markers[::2], self.markers[1::2], strict=True))

    @property
    def pairs_of_loads(self) -> list[Loads]:
        """The loads on the markers A and B of each coordinate."""
        return list(zip(self.loads[::2], self.loads[1::2], strict=True))


@dataclass(frozen=True, eq=False)
class StepConnection(Connection):
    """A connection with its markers and their functions."""

    ends: tuple[BodyMarker, ...]
    loaded: tuple[int, ...]  #: rows with forces along their coordinate
    line: DeformedLine | None  #: along which marker A slides


@dataclass(frozen=True, eq=False)
class StepSystem(DiscreteSystem):
    """A discrete system with bodies, markers and connections that have functions."""

    bodies: tuple[Body, ...]
    connections: tuple[StepConnection, ...]
    loads: tuple[tuple[tuple[int, BodyMarker], ...], ...]  #: point forces on each body: number, marker
    cases: tuple[tuple[int, ...], ...]  #: load cases on each body

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

    def connection_loads(
        self, connection: StepConnection, ends: Ends, span: Span, f: Array, dz: Array, *, is_middle: bool
    ) -> Given:
        """Add reactions with multipliers f, (..., n_held of it), and the forces of a connection.

        dz, (..., n_states of it): changes of its states; is_middle: whether forces act in the middle of the step.
        """
        model, c = self.model, connection.number
        law = int(model.connections.law[c])
        if law == ELEMENT:
            return Given(*element_load(model, c, ends.markers, ends.loads, span, dz, f, is_middle=is_middle))
        pair, loads = ends.pairs[0], ends.pairs_of_loads[0]
        if law == SPRING_LAW:
            return spring_load(model, c, pair, loads, span)
        if law == BUSHING:
            return Given(*bushing_load(model, c, pair, loads, span))
        if law == CONTACT:
            return Given(0.0, contact_load(model, c, pair, loads, span))
        if law == USER_FORCE:
            return Given(user_force_load(model, c, ends.pairs, ends.pairs_of_loads, span, dz, is_middle=is_middle))
        for j, k in enumerate(connection.held):
            self.add_row(connection, k, ends, span, f[..., j])
        given: Array | float = 0.0
        taken: Array | float = 0.0
        for k in connection.loaded:
            normal = normal_force(model, k, connection, pair, f, span)
            part = coordinate_load(model, k, pair, loads, span, normal)
            given, taken = given + part.given, taken + part.taken
        return Given(given, taken)

    def add_row(self, connection: StepConnection, k: int, ends: Ends, span: Span, f: Array) -> None:
        """Add the loads of held row k with multiplier f, (...,); those of elements are among their forces."""
        kind, pair, loads = int(self.model.rows.kind[k]), ends.pairs[0], ends.pairs_of_loads[0]
        if ends.slide is not None:
            add_line_reaction(self.model, k, pair, loads, ends.slide, f)
        elif kind == COUPLE:
            add_coupler_reaction(self.model, connection.number, ends.pairs, ends.pairs_of_loads, f)
        elif kind == RIM_HEIGHT:
            add_height_reaction(self.model, k, pair, loads, f)
        elif kind == ROLL:
            add_roll_reaction(self.model, k, pair, loads, f)
        else:
            add_reaction(self.model, k, pair, loads, span, f)

    def values(self, connection: StepConnection, ends: Ends, span: Span, dz: Array, f: Array) -> list[Array]:
        """Return the held rows of a connection at the end of a step."""
        if self.model.connections.law[connection.number] == ELEMENT:
            return element_values(self.model, connection.number, ends.markers, span, dz, f)
        return [self.value(connection, k, ends, span) for k in connection.held]

    def value(self, connection: StepConnection, k: int, ends: Ends, span: Span) -> Array:
        """Return held row k of a joint or coupler at the end of a step."""
        kind, pair = int(self.model.rows.kind[k]), ends.pairs[0]
        if ends.slide is not None:
            return line_value(self.model, k, pair, ends.slide)
        if kind == COUPLE:
            return coupler_value(self.model, connection.number, ends.pairs, span)
        if kind == RIM_HEIGHT:
            return height_value(self.model, k, pair)
        if kind == ROLL:
            return roll_value(self.model, k, pair)
        return constraint_value(self.model, k, pair, span)

    def rate_in_time(self, k: int, ends: Ends, t: float) -> float:
        """Return the rate of held row k at one configuration while nothing moves."""
        if ends.slide is not None:
            return line_rate_in_time(self.model, k, ends.pairs[0], ends.slide, t)
        if int(self.model.rows.kind[k]) != COUPLE:
            return rate_in_time(self.model, k, ends.pairs[0], t)
        motion = int(self.model.rows.motion[k])
        return 0.0 if motion < 0 else -float(self.model.rows.x[k, 0]) * value_of(self.model, motion, t)[1]

    def state_residual(
        self, connection: StepConnection, ends: Ends, span: Span, dz: Array, f: Array, *, is_along: bool
    ) -> Array:
        """Return the equations of the states of a connection for their changes, (..., n_states of it).

        is_along: whether forces act along the step, with the mean angular velocities.
        """
        if self.model.connections.law[connection.number] == ELEMENT:
            rates = element_rates(self.model, connection.number, ends.markers, span, dz, f)
        else:
            rates = user_state_rates(self.model, connection.number, ends.pairs, span, dz, is_along=is_along)
        return dz - span.h * rates

    def remembered(self, ends: list[Ends], span: Span, dz: Array) -> Array:
        """Return what connections remember at the end of a step, (n_w,), by their ends over it."""
        model, w = self.model, span.w.copy()
        for connection, own in zip(self.connections, ends, strict=True):
            c = connection.number
            law = int(model.connections.law[c])
            if law == CONTACT:
                w[int(model.connections.w0[c]) + V_0] = speed_of_approach(model, c, own.pairs[0], span)
            if law in (COUPLER, USER_FORCE):
                for p, pair in zip(coordinates_of(model, int(model.connections.item[c])), own.pairs, strict=True):
                    k = int(model.coordinates.row[p])
                    w[k] = float(counted(model, k, coordinate_ends(model, k, pair)[1], span.w[k]))
            for s, k in enumerate(connection.states, start=connection.first_state):
                w[k] += dz[s]
        return w


def normal_force(model: Model, k: int, connection: StepConnection, pair: Pair, f: Array, span: Span) -> Array:
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


def step_system(ds: DiscreteSystem) -> StepSystem:
    """Return a discrete system whose bodies, markers and connections have functions."""
    model, bodies = ds.model, step_bodies(ds.model, ds.bodies)
    markers = tuple(body_marker(model, bodies, m) for m in range(len(model.markers.body)))
    connections = []
    for own in ds.connections:
        c = own.number
        rows = range(int(model.connections.w0[c]), int(model.connections.w0[c + 1]))
        is_joint = int(model.connections.law[c]) == JOINT
        loaded = tuple(k for k in rows if kind_of(model.rows.kind[k]).is_loaded and is_joint)
        line = line_of(model, c)
        along = deformed_line(model, markers, line) if line >= 0 else None
        ends = tuple(markers[m] for m in own.markers)
        connections.append(StepConnection(**vars(own), ends=ends, loaded=loaded, line=along))
    point_forces: list[list[tuple[int, BodyMarker]]] = [[] for _ in bodies]
    cases: list[list[int]] = [[] for _ in bodies]
    for k, m in enumerate(model.loads.marker):
        marker = markers[int(m)]
        if marker.body >= 0:
            point_forces[marker.body].append((k, marker))
    for k, i in enumerate(model.body_loads.body):
        cases[int(i)].append(k)
    known = vars(ds) | {"bodies": bodies, "connections": tuple(connections)}
    return StepSystem(**known, loads=tuple(map(tuple, point_forces)), cases=tuple(map(tuple, cases)))
