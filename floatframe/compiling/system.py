"""From the description of a system to the flat arrays of the kernels."""

from dataclasses import dataclass

import numpy as np

from fe_models.foundation.arrays import Array, IntArray
from floatframe.bodies.flexible_body import FlexibleBody
from floatframe.compiling.bodies import body_types, integers, offsets, stacked, type_arrays
from floatframe.compiling.callbacks import Callback
from floatframe.compiling.connections import Connections, add_joint, add_spring
from floatframe.compiling.coordinate_elements import add_networks
from floatframe.compiling.elimination_order import plan_elimination
from floatframe.compiling.forces import Functions, body_load_arrays, joint_force_arrays
from floatframe.compiling.lines import Lines, add_sliding
from floatframe.compiling.markers import (
    MarkerData,
    find_marker,
    marker_bending,
    marker_pose,
    marker_shapes,
    n_q_of,
)
from floatframe.compiling.mass_checks import require_inertia
from floatframe.compiling.pair_forces import add_pair_laws
from floatframe.forces import Gravity, PointForce, SpringDamper
from floatframe.joints.rows import Row, kind_of
from floatframe.joints.sliding import SlidingJoint
from floatframe.kernels.model import Model
from floatframe.rotations import euler_parameters
from floatframe.state import State
from floatframe.system import System

__all__ = ["CompiledSystem", "compiled_system"]

KEPT = "_compiled"  #: attribute of a system that keeps what was compiled

SOFT = 1e-9  #: by which redundant constraints give way, relative to what the mass moves in a step


@dataclass(frozen=True, eq=False)
class CompiledSystem:
    """A system as the kernels see it, with the names of its parts in their order."""

    model: Model
    body_names: tuple[str, ...]
    joint_names: tuple[str, ...]
    spring_names: tuple[str, ...]  #: of spring-dampers, then bushings and contacts
    network_names: tuple[str, ...]  #: of couplers, then user forces
    callbacks: tuple[Callback, ...]  #: users' functions that the kernels call
    owners: tuple[str, ...]  #: name of the connection of each row, (n_w,)
    placed: State  #: the state as given, before it is made consistent
    coordinates: tuple[str, ...]  #: name of the joint coordinate to which each row belongs, "" for none, (n_w,)
    length: float  #: size of the system as placed [m]; scales rotations against translations

    @property
    def connection_names(self) -> tuple[str, ...]:
        """Names of joints, springs, couplers and user forces: the order of connections in the model."""
        return self.joint_names + self.spring_names + self.network_names


def compiled_system(system: System) -> CompiledSystem:
    """Return the flat arrays of a system: made at the first call, and kept with the system.

    Raises
    ------
    ModelError
        If a joint or force names what does not exist, or has two markers on one body.
    """
    kept = vars(system)
    if KEPT not in kept:
        kept[KEPT] = compile_system(system)
    return kept[KEPT]


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

    made = Connections(placed, n_q)
    functions = Functions()
    lines = Lines()
    for joint in system.joints:
        if isinstance(joint, SlidingJoint):
            add_sliding(system, made, lines, joint)
        else:
            add_joint(system, made, joint)
    springs, spring_table = [], []
    dampers = [force for force in system.forces if isinstance(force, SpringDamper)]
    for spring in dampers:
        springs.append(add_spring(system, made, spring))
        spring_table.append(functions.index(spring.characteristic))
    pairs = add_pair_laws(system, made, functions)
    networks = add_networks(system, made, functions)
    markers, rows = made.markers, made.rows
    loads = [force for force in system.forces if isinstance(force, PointForce)]
    load_marker = []
    for load in loads:
        load_marker.append(made.add_marker(find_marker(system, f"force {load.name!r}: marker", load.marker)))

    ends_of = [
        [m for m, data in enumerate(markers) if data.body == i and made.connection_of[m] >= 0] for i in range(len(n_q))
    ]
    ends = [m for group in ends_of for m in group]
    m_x0 = np.zeros(len(markers), np.int64)
    m_x0[ends] = np.cumsum([0] + [6 + int(n_q[markers[m].body]) for m in ends])[:-1]
    shapes = [marker.shape for marker in markers]
    psi0, psi = marker_shapes(shapes)
    bend0, bend = marker_bending(shapes)
    connection_of_marker = integers(made.connection_of)
    model = Model(
        kind=kind,
        n_q=n_q,
        q0=offsets(n_q),
        u0=offsets(n_q + 6),
        h0=offsets((n_q + 6) ** 2),
        **model_types,
        gravity=gravity,
        m_body=integers([m.body for m in markers]),
        m_position=stacked([shape.position for shape in shapes], (3,)),
        m_triad=stacked([shape.triad for shape in shapes], (3, 3)),
        m_psi0=psi0,
        psi=psi,
        m_bend0=bend0,
        bend=bend,
        m_connection=connection_of_marker,
        m_sign=np.array(made.sign, dtype=float),
        m_force=integers(made.force),
        m_moment=integers(made.moment),
        m_follower=integers([0] * (len(markers) - len(loads)) + [int(load.is_follower) for load in loads]),
        m_x0=m_x0,
        end0=offsets(np.array([len(group) for group in ends_of])),
        ends=integers(ends),
        c_size=integers(made.sizes),
        c_w0=offsets(integers(made.sizes)),
        c_a=integers(made.a_of),
        c_b=integers(made.b_of),
        c_law=integers(made.law),
        c_item=integers(made.item),
        row_kind=integers([row.kind for row in rows]),
        row_x=stacked([row.x for row in rows], (3,)),
        row_y=stacked([row.y for row in rows], (3,)),
        row_z=stacked([row.z for row in rows], (3,)),
        row_c=np.array([row.c for row in rows], dtype=float),
        row_part=integers([row.part for row in rows]),
        row_soft=np.zeros(len(rows)),
        row_motion=integers([functions.index(row.motion) for row in rows]),
        **joint_force_arrays(system, rows, made.owner, functions),
        c_rates=integers(made.rates),
        **pairs.arrays(),
        **networks.arrays(),
        **lines.arrays(len(markers)),
        spring_table=integers(spring_table),
        l_factor=integers([functions.index(load.amplitude) for load in loads]),
        **body_load_arrays(system, functions),
        **functions.arrays(),
        springs=stacked(springs, (4,)),
        l_marker=integers(load_marker),
        l_force=stacked([load.force for load in loads], (3,)),
        l_torque=stacked([load.torque for load in loads], (3,)),
        **plan_elimination(made.sizes, ends_of, connection_of_marker)._asdict(),
    )
    length = system_length(markers, placed, n_q, model)
    model = model._replace(row_soft=row_softness(system, rows, model.mass[kind], length))
    return CompiledSystem(
        model=model,
        body_names=tuple(body.name for body in system.bodies),
        joint_names=tuple(joint.name for joint in system.joints),
        spring_names=tuple(spring.name for spring in dampers) + pairs.names,
        network_names=networks.names,
        callbacks=tuple(networks.callbacks),
        owners=tuple(made.owner),
        placed=placed,
        coordinates=tuple(row.coordinate_name for row in rows),
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
            kind = kind_of(row.kind)
            if kind.can_yield and row.motion is None:
                soft[k] = SOFT / m if kind.is_length else SOFT / (m * length**2)
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


def system_length(markers: list[MarkerData], placed: State, n_q: IntArray, model: Model) -> float:
    """Return the largest arm of a marker or radius of gyration in a body, or the size of the system; 1 if all are 0."""
    arms = [float(np.linalg.norm(marker.shape.position)) for marker in markers if marker.body >= 0]
    radii = np.sqrt(np.maximum(np.trace(model.J0, axis1=1, axis2=2), 0.0) / (2 * model.mass))
    points = [marker_pose(marker, placed, n_q)[0] for marker in markers] + list(placed.r)
    return max([*arms, float(radii.max()), float(np.linalg.norm(np.ptp(np.array(points), axis=0)))]) or 1.0
