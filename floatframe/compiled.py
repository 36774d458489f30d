"""From the description of a system to the flat arrays of the kernels."""

from dataclasses import dataclass

import numpy as np

from cms.arrays import Array, IntArray
from floatframe.body_types import body_types, integers, offsets, stacked, type_arrays
from floatframe.elimination import plan_elimination
from floatframe.errors import ModelError
from floatframe.flexible_body import FlexibleBody
from floatframe.force_data import Functions, body_load_arrays, joint_force_arrays, with_forces
from floatframe.forces import Gravity, JointForce, PointForce, SpringDamper
from floatframe.joints.rows import DOT, MOMENT, NO_MOMENT, POINT, SLIDE, SPRING, Row
from floatframe.kernels.model import Model
from floatframe.marker_data import (
    MarkerData,
    find_marker,
    joint_markers,
    marker_bending,
    marker_pose,
    marker_shapes,
    n_q_of,
)
from floatframe.mass_checks import require_inertia
from floatframe.rotations import euler_parameters
from floatframe.state import State
from floatframe.system import System

__all__ = ["CompiledSystem", "compile_system"]

SOFT = 1e-9  #: by which redundant constraints give way, relative to what the mass moves in a step


@dataclass(frozen=True, eq=False)
class CompiledSystem:
    """A system as the kernels see it, with the names of its parts in their order."""

    model: Model
    body_names: tuple[str, ...]
    joint_names: tuple[str, ...]
    spring_names: tuple[str, ...]
    placed: State  #: the state as given, before it is made consistent
    coordinates: tuple[str, ...]  #: name of the joint coordinate to which each row belongs, "" for none, (n_w,)
    length: float  #: size of the system as placed [m]; scales rotations against translations

    @property
    def connection_names(self) -> tuple[str, ...]:
        """Names of joints, then spring-dampers: the order of connections in the model."""
        return self.joint_names + self.spring_names


def compile_system(system: System) -> CompiledSystem:
    """Return the flat arrays of a system.

    Raises
    ------
    ModelError
        If a joint or force names what does not exist, or has two markers on one body.
    """
    require_inertia(system.bodies)
    placed = place(system)
    types, kind = body_types(system.bodies)
    model_types = type_arrays(types)
    n_q = n_q_of(system)
    gravity = np.zeros(3)
    for force in system.forces:
        if isinstance(force, Gravity):
            gravity = gravity + force.acceleration

    markers: list[MarkerData] = []
    sizes: list[int] = []
    rows: list[Row] = []
    springs: list[list[float]] = []
    a_of, b_of, spring_of, connection_of, sign = [], [], [], [], []
    moment: list[int] = []
    rates: list[int] = []  # of connections: whether their rows depend on velocities
    owner: list[str] = []
    spring_table: list[int] = []
    functions = Functions()
    for joint in system.joints:
        a, b = joint_markers(system, joint, placed)
        r_a, A_a = marker_pose(a, placed, n_q)
        r_b, A_b = marker_pose(b, placed, n_q)
        sizes.append(joint.size)
        forces = [f for f in system.forces if isinstance(f, JointForce) and f.joint == joint.name]
        rows.extend(with_forces(joint, joint.rows(A_a, A_b, r_b - r_a), forces))
        rates.append(int(bool(forces)))
        owner += [joint.name] * joint.size
        moment += [MOMENT if joint.size >= MOMENT + 3 else NO_MOMENT, joint.moment_b]
        spring_of.append(-1)
        a_of.append(len(markers))
        b_of.append(len(markers) + 1)
        markers += [a, b]
        connection_of += [len(sizes) - 1] * 2
        sign += [1.0, -1.0]
    dampers = [force for force in system.forces if isinstance(force, SpringDamper)]
    for spring in dampers:
        where = f"force {spring.name!r}"
        a = find_marker(system, f"{where}: marker_a", spring.marker_a)
        b = find_marker(system, f"{where}: marker_b", spring.marker_b)
        free_length = spring_length(where, spring, a, b, placed, n_q)
        sizes.append(3)
        rows.extend(Row(SPRING, axis) for axis in np.eye(3))
        rates.append(1)
        owner += [spring.name] * 3
        spring_table.append(functions.index(spring.characteristic))
        moment += [NO_MOMENT] * 2
        spring_of.append(len(springs))
        springs.append([spring.stiffness, spring.damping, free_length, spring.preload])
        a_of.append(len(markers))
        b_of.append(len(markers) + 1)
        markers += [a, b]
        connection_of += [len(sizes) - 1] * 2
        sign += [1.0, -1.0]
    loads = [force for force in system.forces if isinstance(force, PointForce)]
    load_marker = []
    for load in loads:
        load_marker.append(len(markers))
        markers.append(find_marker(system, f"force {load.name!r}: marker", load.marker))
        connection_of.append(-1)
        moment.append(NO_MOMENT)
        sign.append(0.0)

    ends_of = [
        [m for m, data in enumerate(markers) if data.body == i and connection_of[m] >= 0] for i in range(len(n_q))
    ]
    ends = [m for group in ends_of for m in group]
    m_x0 = np.zeros(len(markers), np.int64)
    m_x0[ends] = np.cumsum([0] + [6 + int(n_q[markers[m].body]) for m in ends])[:-1]
    psi0, psi = marker_shapes(markers)
    bend0, bend = marker_bending(markers)
    connection_of_marker = integers(connection_of)
    model = Model(
        kind=kind,
        n_q=n_q,
        q0=offsets(n_q),
        u0=offsets(n_q + 6),
        h0=offsets((n_q + 6) ** 2),
        **model_types,
        gravity=gravity,
        m_body=integers([m.body for m in markers]),
        m_position=stacked([m.position for m in markers], (3,)),
        m_triad=stacked([m.triad for m in markers], (3, 3)),
        m_psi0=psi0,
        psi=psi,
        m_bend0=bend0,
        bend=bend,
        m_connection=connection_of_marker,
        m_sign=np.array(sign, dtype=float),
        m_moment=integers(moment),
        m_follower=integers([0] * (len(markers) - len(loads)) + [int(load.is_follower) for load in loads]),
        m_x0=m_x0,
        end0=offsets(np.array([len(group) for group in ends_of])),
        ends=integers(ends),
        c_size=integers(sizes),
        c_w0=offsets(integers(sizes)),
        c_a=integers(a_of),
        c_b=integers(b_of),
        c_spring=integers(spring_of),
        row_kind=integers([row.kind for row in rows]),
        row_x=stacked([row.x for row in rows], (3,)),
        row_y=stacked([row.y for row in rows], (3,)),
        row_z=stacked([row.z for row in rows], (3,)),
        row_c=np.array([row.c for row in rows], dtype=float),
        row_part=integers([row.part for row in rows]),
        row_soft=np.zeros(len(rows)),
        row_motion=integers([functions.index(row.motion) for row in rows]),
        **joint_force_arrays(system, rows, owner, functions),
        c_rates=integers(rates),
        spring_table=integers(spring_table),
        l_factor=integers([functions.index(load.amplitude) for load in loads]),
        **body_load_arrays(system, functions),
        **functions.arrays(),
        springs=stacked(springs, (4,)),
        l_marker=integers(load_marker),
        l_force=stacked([load.force for load in loads], (3,)),
        l_torque=stacked([load.torque for load in loads], (3,)),
        **plan_elimination(sizes, ends_of, connection_of_marker)._asdict(),
    )
    length = system_length(markers, placed, n_q, model)
    model = model._replace(row_soft=row_softness(system, rows, model.mass[kind], length))
    return CompiledSystem(
        model=model,
        body_names=tuple(body.name for body in system.bodies),
        joint_names=tuple(joint.name for joint in system.joints),
        spring_names=tuple(spring.name for spring in dampers),
        placed=placed,
        coordinates=tuple(row.coordinate for row in rows),
        length=length,
    )


def row_softness(system: System, rows: list[Row], mass: Array, length: float) -> Array:
    """Return the compliance of held rows, relative to c_k, for reactions of least norm; zero if none is asked for.

    SOFT/m for distances and SOFT/(m length²) for angles, m the mean mass of the bodies.
    """
    soft = np.zeros(len(rows))
    if system.redundant == "minimum-norm":
        m = float(mass.mean())
        for k, row in enumerate(rows):
            if row.kind in (POINT, SLIDE) and row.motion is None:
                soft[k] = SOFT / m
            elif row.kind == DOT:
                soft[k] = SOFT / (m * length**2)
    return soft


def place(system: System) -> State:
    """Return the state of the bodies as given."""
    r: list[Array] = []
    p: list[Array] = []
    q: list[Array] = []
    u: list[Array] = []
    for body in system.bodies:
        if isinstance(body, FlexibleBody):
            r.append(body.frame_position)
            p.append(euler_parameters(body.frame_orientation))
            q.append(body.q)
            u += [body.frame_velocity, body.frame_omega, body.q_dot]
        else:
            r.append(body.position)
            p.append(body.orientation)
            u += [body.velocity, body.omega_B]
    return State(r=np.array(r), p=np.array(p), q=np.concatenate([*q, np.zeros(0)]), u=np.concatenate(u))


def spring_length(
    where: str, spring: SpringDamper, a: MarkerData, b: MarkerData, placed: State, n_q: IntArray
) -> float:
    """Return the free length of a spring; `ModelError` if it has no direction as placed."""
    distance = float(np.linalg.norm(marker_pose(b, placed, n_q)[0] - marker_pose(a, placed, n_q)[0]))
    free_length = distance if spring.free_length is None else spring.free_length
    if distance == 0 and (free_length > 0 or spring.preload != 0 or spring.damping != 0 or spring.characteristic):
        raise ModelError(
            f"{where}: its markers coincide as placed, so that its tension has no direction; move one, or "
            "give free_length = 0 without damping and preload"
        )
    return free_length


def system_length(markers: list[MarkerData], placed: State, n_q: IntArray, model: Model) -> float:
    """Return the largest arm of a marker or radius of gyration in a body, or the size of the system; 1 if all are 0."""
    arms = [float(np.linalg.norm(marker.position)) for marker in markers if marker.body >= 0]
    radii = np.sqrt(np.maximum(np.trace(model.J0, axis1=1, axis2=2), 0.0) / (2 * model.mass))
    points = [marker_pose(marker, placed, n_q)[0] for marker in markers] + list(placed.r)
    return max([*arms, float(radii.max()), float(np.linalg.norm(np.ptp(np.array(points), axis=0)))]) or 1.0
