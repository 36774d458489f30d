"""From the description of a system to the records of the kernels."""

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from cms.body.reduced_body import ReducedBody
from fe_models.foundation.arrays import Array, IntArray
from floatframe.engine.compiling.bodies import body_types, integers, offsets, type_arrays
from floatframe.engine.compiling.callbacks import Callback
from floatframe.engine.compiling.connections import Connections as ConnectionLists
from floatframe.engine.compiling.connections import End, add_joint, add_spring
from floatframe.engine.compiling.coordinate_elements import add_coordinate_elements
from floatframe.engine.compiling.counted_angles import CountedAngle, angle_records, counted_angles, first_angles
from floatframe.engine.compiling.elimination_order import plan_elimination
from floatframe.engine.compiling.forces import Functions, body_loads, joint_forces
from floatframe.engine.compiling.markers import (
    find_marker,
    joint_markers,
    marker_bending,
    marker_pose,
    marker_shapes,
    n_q_of,
    same_markers,
)
from floatframe.engine.compiling.pair_forces import add_pair_laws
from floatframe.engine.compiling.placing import placed_state
from floatframe.engine.compiling.public_elements import PlacedLaw, add_public_elements
from floatframe.engine.kernels import model
from floatframe.engine.kernels.model import (
    CONTACT,
    COUPLER,
    ELEMENT,
    JOINT,
    Bodies,
    BodyTypes,
    Connections,
    Contacts,
    Gaps,
    JointRows,
    Loads,
    Markers,
    Model,
    Springs,
)
from floatframe.engine.kernels.records import filled, of_items
from floatframe.errors import ModelError
from floatframe.model.bodies.flexible_body import FlexibleBody
from floatframe.model.bodies.marker_shape import MarkerShape
from floatframe.model.bodies.markers import Marker, body_name
from floatframe.model.bodies.mean_axes import MeanAxes
from floatframe.model.bodies.rigid_body import RigidBody
from floatframe.model.forces import Gravity, PointForce, SpringDamper
from floatframe.model.functions.time_functions import TimeFunction
from floatframe.model.joints.rows import COUPLE, MOMENT, NO_MOMENT, RELEASED, is_held_length, kind_of
from floatframe.model.joints.sliding import SlidingJoint, line_triad
from floatframe.model.rotations import rotation_matrix
from floatframe.model.state import State
from floatframe.model.system import System

__all__ = ["CompiledSystem", "Lines", "add_sliding", "compiled_system", "gap_record", "require_inertia"]


# sliding joints in the arrays of the kernels: their lines, stations and sliding markers -------------------------------


@dataclass
class Lines:
    """Deformed lines and their stations in the order in which they are compiled."""

    marker: list[int] = field(default_factory=list)
    row: list[int] = field(default_factory=list)
    axis: list[Array] = field(default_factory=list)
    counts: list[int] = field(default_factory=list)
    s: list[float] = field(default_factory=list)
    station: list[int] = field(default_factory=list)

    def records(self) -> dict[str, Any]:
        """Return the arrays of the model."""
        return {
            "lines": filled(
                model.Lines(),
                marker=self.marker,
                other=[m + 1 for m in self.marker],
                row=self.row,
                axis=self.axis,
                station0=offsets(integers(self.counts)),
            ),
            "stations": filled(model.Stations(), s=self.s, marker=self.station),
        }

    def of_markers(self, n_markers: int) -> IntArray:
        """Return the line along which each marker slides, -1 for markers that do not slide."""
        line = np.full(n_markers, -1, np.int64)
        line[self.marker] = np.arange(len(self.marker))
        return line


def add_sliding(system: System, made: ConnectionLists, lines: Lines, joint: SlidingJoint) -> None:
    """Add a sliding joint with its line and the markers of the stations of the line."""
    where = f"joint {joint.name!r}"
    first, b = joint_markers(system, joint, made.placed)
    name = body_name(joint.marker_a.body)
    if not isinstance(system.body(name), FlexibleBody):
        raise ModelError(f"{where}: body {name!r} is not flexible; take a prismatic joint or a point on a line")
    stations = [find_marker(system, f"{where}: line", Marker(name, station)) for station in joint.stations]
    s, triad = line_triad(where, np.array([m.shape.position for m in stations]), joint.normal)
    _, A_b = marker_pose(b, made.placed, made.n_q)
    A_line = rotation_matrix(made.placed.p[first.body]) @ triad
    assert first.shape.psi is not None
    sliding = replace(first, shape=MarkerShape(stations[0].shape.position, triad, np.array(first.shape.psi)))
    rows = joint.rows(A_line, A_b, np.zeros(3))
    ends = (
        End(sliding, 1.0, moment=MOMENT if joint.is_aligned else NO_MOMENT),
        End(b, -1.0, moment=joint.moment_b),
    )
    marker, row = made.add(joint.name, JOINT, ends, rows, has_rates=False)
    lines.marker.append(marker)
    lines.row.append(row + 2 if joint.motions else -1)
    lines.axis.append(triad[:, 0])
    lines.counts.append(len(stations))
    lines.s += list(s)
    lines.station += [made.add_marker(station) for station in stations]


# whether every body can be accelerated: mass, inertia about every axis, and mass or stiffness of every mode -----------
# Bodies are eliminated one by one, each by its own matrix. So every body needs inertia, even if its joints fix it.


NO_INERTIA = 1e-13  #: ratio of the smallest to the largest principal moment below which the smallest counts as zero


def require_inertia(bodies: Sequence[RigidBody | FlexibleBody]) -> None:
    """Raise `ModelError` with the name of a body that has a motion without inertia.

    Such a motion is the rotation of a rigid body, or of a beam without thickness, about an axis without moment of
    inertia, or a mode that has neither mass nor stiffness.
    """
    checked: list[ReducedBody] = []
    for body in bodies:
        if isinstance(body, RigidBody):
            require_moments(f"rigid body {body.name!r}", body.inertia)
        elif not any(body.reduced is other for other in checked):
            checked.append(body.reduced)
            where = f"flexible body {body.name!r}"
            moments = body.reduced.moments
            c = moments.S / moments.m
            require_moments(where, moments.J0 - moments.m * (c @ c * np.eye(3) - np.outer(c, c)))
            require_modes(where, body.reduced)


def require_moments(where: str, inertia: Array) -> None:
    """Raise `ModelError` with the principal axis about which the inertia at the centre of mass is zero."""
    moments, axes = np.linalg.eigh(0.5 * (inertia + inertia.T))
    if moments[0] > NO_INERTIA * moments[-1]:
        return
    axis = axes[:, 0] * np.sign(axes[np.argmax(np.abs(axes[:, 0])), 0])
    direction = ", ".join(f"{value:.3g}" for value in axis + 0.0)
    raise ModelError(
        f"{where}: it has no inertia about its axis [{direction}], so that nothing resists its rotation: expected a "
        f"moment above zero, got {moments[0]:.3g} (the largest is {moments[-1]:.3g}). Give the moment of its real "
        "thickness (m r²/2 for a round rod of radius r), or replace a massless rod by a distance joint"
    )


def require_modes(where: str, reduced: ReducedBody) -> None:
    """Raise `ModelError` with the first mode that has neither mass nor stiffness."""
    mass, stiffness = np.diag(reduced.M), np.diag(reduced.K)
    nothing = np.flatnonzero((mass <= 0) & (stiffness <= 0))
    if len(nothing):
        k = int(nothing[0])
        raise ModelError(
            f"{where}: mode {k + 1} ({reduced.labels[k]}) has neither mass nor stiffness, so that its motion under a "
            "force is unlimited; reduce the body again, or leave the mode out"
        )


# gaps between bodies that can touch, in the arrays of the kernels -----------------------------------------------------


def gap_record(made: ConnectionLists, contacts: Contacts, laws: Sequence[PlacedLaw]) -> Gaps:
    """Return the gaps of all contacts, followed by those that elements declare."""
    gaps = []
    for c in (c for c, law in enumerate(made.law) if law == CONTACT):
        i = made.item[c]
        numbers = {"stiffness": contacts.stiffness[i], "exponent": contacts.exponent[i]}
        gaps.append({"connection": c, "output": -1} | numbers)
    for placed in laws:
        for name, spring in placed.law.gaps.items():
            numbers = {"stiffness": spring.stiffness, "exponent": spring.exponent}
            gaps.append({"connection": placed.connection, "output": placed.law.outputs.index(name)} | numbers)
    return of_items(Gaps(), gaps)


# from the description of a system to the records of the kernels -------------------------------------------------------


#: compliance of redundant constraints, relative to the displacement of a free mass by the same force in one step
SOFT = 1e-9
#: compliance relative to the mobility of bodies, with a margin for rounding in the elimination
ROUNDING = 1e3 * np.finfo(float).eps
#: largest compliance for rotations, relative to 1/J, of bodies that have almost no moment of inertia about an axis
MOST_SOFT = 1e-5


@dataclass(frozen=True, eq=False)
class CompiledSystem:
    """A system in the arrays of the kernels, with the names of its parts in the same order."""

    model: Model
    body_names: tuple[str, ...]
    joint_names: tuple[str, ...]
    spring_names: tuple[str, ...]  #: names of the spring-dampers, then of bushings and contacts
    element_names: tuple[str, ...]  #: names of the couplers, then of user forces and public elements
    laws: tuple[PlacedLaw, ...]  #: laws of the public elements
    callbacks: tuple[Callback, ...]  #: user functions that the kernels call
    owners: tuple[str, ...]  #: name of the connection to which each row belongs, (n_w,)
    placed: State  #: the given state before constraints are closed, in the frames of the files
    by_joints: NDArray[np.bool_]  #: whether joints have placed the body because no position is given, (n_b,)
    #: mean-axis frame of each body whose frame in the engine differs from that of its file, else None
    mean_axes: tuple[MeanAxes | None, ...]
    coordinates: tuple[str, ...]  #: name of the joint coordinate to which each row belongs, "" for none, (n_w,)
    length: float  #: size of the placed system [m], which relates rotations to translations
    angles: tuple[CountedAngle, ...]  #: angles between bodies that are counted through full turns
    angle_motions: tuple[TimeFunction | None, ...]  #: function that prescribes each counted angle, or None

    @property
    def gap_sizes(self) -> Array:
        """Reference size for the gap of each row, (n_w,).

        It is the length of the system for a length, 1 for an angle, and the sum of the terms' sizes for a coupler.
        """
        rows, coordinates = self.model.rows, self.model.coordinates
        size = np.where(is_held_length(rows.kind), self.length, 1.0)
        terms = np.abs(coordinates.factor) * np.where(rows.is_angle[coordinates.row], 1.0, self.length)
        sums = np.bincount(coordinates.core, terms, minlength=len(size))[: len(size)]
        is_sum = np.isin(rows.kind, (COUPLE, RELEASED)) & (sums > 0.0)
        return np.where(is_sum, sums, size)

    @property
    def motion_lengths(self) -> Array:
        """Length that one unit of each motion represents, (n_u,): system size for rotations, 1/sqrt(mass) for modes."""
        bodies, lengths = self.model.bodies, np.ones(int(self.model.bodies.u0[-1]))
        for i, first in enumerate(map(int, bodies.u0[:-1])):
            lengths[first + 3 : first + 6] = self.length
            lengths[first + 6 : int(bodies.u0[i + 1])] = 1 / np.sqrt(self.model.body_types.mass[bodies.kind[i]])
        return lengths

    @property
    def resting_model(self) -> Model:
        """The model in which elements use their laws for static equilibrium."""
        rest = [each.rest for each in self.laws]
        return self.model._replace(
            laws=self.model.laws._replace(
                address=np.array([value.address for value, _ in rest], dtype=np.int64),
                tangent=np.array([slopes.address for _, slopes in rest], dtype=np.int64),
            )
        )

    @property
    def stop_words(self) -> tuple[str, ...]:
        """Messages of the element outputs that end a run, in the order of the model."""
        return tuple(f"element {each.element.name!r}: {text}" for each in self.laws for text in each.law.stops.values())

    @property
    def connection_names(self) -> tuple[str, ...]:
        """Names of joints, springs, couplers and user forces, in the order of the connections in the model."""
        return self.joint_names + self.spring_names + self.element_names

    def connection_words(self, c: int) -> str:
        """Return the kind and the name of connection c for messages; a coupler counts as a joint, as in `System`."""
        law = int(self.model.connections.law[c])
        kind = {JOINT: "joint", COUPLER: "joint", ELEMENT: "element"}.get(law, "force")
        return f"{kind} {self.connection_names[c]!r}"


def compiled_system(system: System) -> CompiledSystem:
    """Return a system in the arrays of the kernels; the first call computes them and stores them in the system.

    Raises
    ------
    ModelError
        If a joint or force names an object that does not exist, or has two markers on one body.
    """
    return system.derived(compile_system)


def compile_system(system: System) -> CompiledSystem:
    """Return a system in the arrays of the kernels.

    Raises
    ------
    ModelError
        If a joint or force names an object that does not exist, or has two markers on one body.
    """
    require_inertia(system.bodies)
    axes = tuple(body.mean_axes if isinstance(body, FlexibleBody) else None for body in system.bodies)
    placed = placed_state(system)
    types, kind = body_types(system.bodies)
    n_q = n_q_of(system)
    gravity = np.zeros(3)
    for force in system.forces:
        if isinstance(force, Gravity):
            gravity = gravity + force.acceleration

    made = ConnectionLists(placed, n_q)
    functions = Functions()
    lines = Lines()
    for joint in system.joints:
        if isinstance(joint, SlidingJoint):
            add_sliding(system, made, lines, joint)
        else:
            add_joint(system, made, joint)
    dampers = [force for force in system.forces if isinstance(force, SpringDamper)]
    springs = filled(
        Springs(),
        stiffness=[spring.stiffness for spring in dampers],
        damping=[spring.damping for spring in dampers],
        free_length=[add_spring(system, made, spring) for spring in dampers],
        preload=[spring.preload for spring in dampers],
        table=[functions.index(spring.characteristic) for spring in dampers],
    )
    pairs = add_pair_laws(system, made, functions)
    elements = add_coordinate_elements(system, made, functions)
    public = add_public_elements(system, made, len(elements.states))
    elements.states += public.states
    markers, rows = made.markers, made.rows
    loads = [force for force in system.forces if isinstance(force, PointForce)]
    load_marker = []
    for load in loads:
        load_marker.append(made.add_marker(find_marker(system, f"force {load.name!r}: marker", load.marker)))
    ends_of: list[list[int]] = [[] for _ in n_q]
    for m, data in enumerate(markers):
        if data.body >= 0 and made.connection_of[m] >= 0:
            ends_of[data.body].append(m)
    loaded_of: list[list[int]] = [[] for _ in n_q]
    for m in load_marker:
        if markers[m].body >= 0:
            loaded_of[markers[m].body].append(m)
    angles = counted_angles(system, placed)
    row_motion = [functions.index(row.motion) for row in rows]
    forces, force0 = joint_forces(system, rows, made.owner, functions)
    arrays = type_arrays(types)
    radii = np.sqrt(np.maximum(np.trace(arrays.J0, axis1=1, axis2=2), 0.0) / (2 * arrays.mass))[kind]
    places = [marker_pose(marker, placed, n_q)[0] for marker in markers]
    sizes = body_sizes(made, places, placed, radii)
    length = system_length(sizes, places, placed)
    public.give_lengths(radii, length)
    elements.give_lengths(radii, length, system.units)
    model = Model(
        gravity=gravity,
        bodies=filled(
            Bodies(),
            kind=kind,
            n_q=n_q,
            q0=offsets(n_q),
            u0=offsets(n_q + 6),
            h0=offsets((n_q + 6) ** 2),
            size=np.where(sizes > 0, sizes, 1.0),
            end0=offsets(integers([len(group) for group in ends_of])),
            ends=[m for group in ends_of for m in group],
            load0=offsets(integers([len(group) for group in loaded_of])),
            loaded=integers([m for group in loaded_of for m in group]),
        ),
        body_types=arrays,
        markers=marker_record(made, ends_of, lines, load_marker, [load.is_follower for load in loads]),
        connections=filled(
            Connections(),
            size=made.sizes,
            w0=offsets(integers(made.sizes)),
            a=made.a_of,
            b=made.b_of,
            law=made.law,
            item=made.item,
            has_rates=made.rates,
        ),
        rows=filled(
            JointRows(),
            **{name: [getattr(row, name) for row in rows] for name in ("kind", "x", "y", "z", "u", "c", "part")},
            **{
                name: [getattr(kind_of(row.kind), name) for row in rows]
                for name in ("holds", "is_length", "is_angle", "is_loaded")
            },
            motion=row_motion,
            soft=np.zeros(len(rows)),
            force0=force0[:-1],
            force1=force0[1:],
        ),
        joint_forces=forces,
        springs=springs,
        bushings=pairs.bushings._replace(angle=integers(first_angles(system, len(angles)))),
        contacts=pairs.contacts,
        gaps=gap_record(made, pairs.contacts, public.placed),
        **elements.records(),
        laws=public.record(),
        **lines.records(),
        loads=filled(
            Loads(),
            marker=load_marker,
            factor=[functions.index(load.amplitude) for load in loads],
            force=[load.force for load in loads],
            torque=[load.torque for load in loads],
        ),
        body_loads=body_loads(system, functions),
        functions=functions.record(),
        angles=angle_records([angle for angle, _ in angles]),
        elimination=plan_elimination(made.sizes, ends_of, integers(made.connection_of)),
    )
    soft = row_softness(system, made, model.body_types, kind)
    model = model._replace(rows=model.rows._replace(soft=soft))
    return CompiledSystem(
        model=model,
        body_names=tuple(body.name for body in system.bodies),
        joint_names=tuple(joint.name for joint in system.joints),
        spring_names=tuple(spring.name for spring in dampers) + pairs.names,
        element_names=elements.names + public.names,
        laws=tuple(public.placed),
        callbacks=(*elements.callbacks, *public.callbacks),
        owners=tuple(made.owner),
        placed=placed,
        by_joints=np.array([body.position is None for body in system.bodies]),
        mean_axes=axes,
        coordinates=tuple(row.coordinate_name for row in rows),
        length=length,
        angles=tuple(angle for angle, _ in angles),
        angle_motions=tuple(motion for _, motion in angles),
    )


def marker_record(
    made: ConnectionLists, ends_of: list[list[int]], lines: Lines, load_marker: list[int], is_follower: list[bool]
) -> Markers:
    """Return the markers in the arrays of the kernels; those of loads come last."""
    markers = made.markers
    shapes = [marker.shape for marker in markers]
    ends = [m for group in ends_of for m in group]
    x0 = np.zeros(len(markers), np.int64)
    x0[ends] = np.cumsum([0] + [6 + int(made.n_q[markers[m].body]) for m in ends])[:-1]
    turns = np.zeros(len(markers), np.int64)
    turns[load_marker] = is_follower
    accelerated, a0 = np.full(len(markers), -1, np.int64), np.zeros(len(markers), np.int64)
    accelerated[made.accelerated] = np.arange(len(made.accelerated))
    moving = [m for m in made.accelerated if markers[m].body >= 0]
    a0[moving] = np.cumsum([0] + [6 + int(made.n_q[markers[m].body]) for m in moving])[:-1]
    psi0, psi = marker_shapes(shapes)
    bend0, bend = marker_bending(shapes)
    line = lines.of_markers(len(markers))
    return filled(
        Markers(),
        body=[marker.body for marker in markers],
        position=[shape.position for shape in shapes],
        triad=[shape.triad for shape in shapes],
        psi0=psi0,
        psi=psi,
        bend0=bend0,
        bend=bend,
        same=same_markers(markers, bend0, line),
        connection=made.connection_of,
        sign=made.sign,
        force=made.force,
        moment=made.moment,
        is_follower=turns,
        x0=x0,
        line=line,
        accelerated=accelerated,
        a0=a0,
    )


def row_softness(system: System, made: ConnectionLists, types: BodyTypes, kind_of_body: IntArray) -> Array:
    """Return the compliance, divided by c_k, of rows that share reactions, (n_w,); zero if sharing is not requested.

    The compliance of a joint follows from its two bodies: SOFT times the sum of their 1/m for distances, and of their
    1/J for angles, where J is the mean of the principal moments of inertia about the centre of mass. If a body has a
    small moment J_min about an axis, the compliance of angles must exceed the roundoff of 1/J_min: it is at least
    ROUNDING/J_min, but at most MOST_SOFT/J.
    """
    soft = np.zeros(len(made.rows))
    if system.redundant != "minimum-norm":
        return soft
    tiny = np.finfo(float).tiny
    moments = np.maximum(principal_moments(types), tiny)
    by_force, by_moment = 1 / types.mass, 1 / moments.mean(axis=1)
    of_angles = np.clip(ROUNDING / moments.min(axis=1), SOFT * by_moment, MOST_SOFT * by_moment)
    connection = np.repeat(np.arange(len(made.sizes)), made.sizes)
    for k, row in enumerate(made.rows):
        kind = kind_of(row.kind)
        if kind.can_yield and row.motion is None:
            ends = (made.markers[m[connection[k]]].body for m in (made.a_of, made.b_of))
            t = kind_of_body[[body for body in ends if body >= 0]]
            soft[k] = SOFT * by_force[t].sum() if kind.is_length else of_angles[t].sum()
    return soft


def principal_moments(types: BodyTypes) -> Array:
    """Return the principal moments of inertia about the centre of mass for all types of bodies, (n_types, 3)."""
    moments = []
    for m, S, J0 in zip(types.mass, types.S, types.J0, strict=True):
        moments.append(np.linalg.eigvalsh(J0 - (S @ S * np.eye(3) - np.outer(S, S)) / m))
    return np.array(moments)


def body_sizes(made: ConnectionLists, places: list[Array], placed: State, radii: Array) -> Array:
    """Return, for each body, the size of the group of bodies connected to it without the ground, (n_b,).

    It is the largest of: the arms of their markers, their radii of gyration (radii, (n_b,)), and the extent of their
    origins and markers, including the markers on the ground to which they are connected.
    """
    n_b = len(radii)
    together = np.arange(n_b)

    def head(i: int) -> int:
        while together[i] != i:
            together[i] = together[together[i]]
            i = int(together[i])
        return i

    bodies = [marker.body for marker in made.markers]
    first: dict[int, int] = {}  # the first body of each connection
    for c, i in zip(made.connection_of, bodies, strict=True):
        if c >= 0 and i >= 0:
            together[head(i)] = head(first.setdefault(c, i))
    size = np.zeros(n_b)
    points: list[list[Array]] = [[] for _ in range(n_b)]  # points of the bodies connected to each head
    for i in range(n_b):
        k = head(i)
        size[k] = max(size[k], radii[i])
        points[k].append(placed.r[i])
    for marker, c, place in zip(made.markers, made.connection_of, places, strict=True):
        i = marker.body if marker.body >= 0 else first.get(c, -1)
        if i < 0:
            continue
        k = head(i)
        if marker.body >= 0:
            size[k] = max(size[k], float(np.linalg.norm(marker.shape.position)))
        points[k].append(place)
    heads = [head(i) for i in range(n_b)]
    return np.array([max(size[k], extent(np.array(points[k]))) for k in range(n_b)])[heads]


def extent(points: Array) -> float:
    """Return the largest distance between two of the points, (n, 3), independent of the direction of the axes."""
    if len(points) < 2:
        return 0.0
    radii = np.linalg.norm(points - points.mean(axis=0), axis=1)
    least = float(np.linalg.norm(points - points[np.argmax(radii)], axis=1).max())
    outer = points[radii >= least - radii.max()]  # points nearer to the centre are within `least` of all other points
    return max(least, *(float(np.linalg.norm(outer - each, axis=1).max()) for each in outer))


def system_length(sizes: Array, places: list[Array], placed: State) -> float:
    """Return the size of the largest group of connected bodies, or of the whole system if larger; 1 if both are 0."""
    points = np.array([*places, *placed.r])
    return max(float(sizes.max()), extent(points)) or 1.0
