"""Drawings of joints, forces and elements in a page: small solids on markers, springs, arrows of loads."""

from dataclasses import replace

import numpy as np

from fe_models.foundation.arrays import Array
from floatframe.engine.compiling.markers import find_marker, joint_markers
from floatframe.engine.compiling.pair_forces import bushing_markers
from floatframe.engine.compiling.system import compiled_system
from floatframe.model.forces import Bushing, SphereContact, SpringDamper
from floatframe.model.joints.sliding import SlidingJoint
from floatframe.model.rotations import rotation_matrix
from floatframe.model.shapes import Box, Cylinder, Piece, Sphere, Stretched
from floatframe.model.shapes.piece import shifted
from floatframe.model.shapes.rounds import axes_about
from floatframe.pictures.glyphs import (
    BALLS,
    BUSHING_COLOR,
    CROSSES,
    JOINT_COLOR,
    RAILS,
    RINGS,
    RODS,
    SPRING_COLOR,
    is_spring,
)
from floatframe.pictures.viewer.cast import Between, Cast, Force, Placed

__all__ = ["connections_cast", "distance", "joint_pieces"]

#: size of a joint, divided by the size of the scene, up to so many bodies; smaller for more bodies
SIZE, FEW = 0.012, 4
GROUND_COLOR = "#7b8790"
Z = np.array([0.0, 0.0, 1.0])


def connections_cast(cast: Cast, size: float, up: Array) -> None:
    """Add joints, springs, dampers, bushings and contacts with their loads.

    Parameters
    ----------
    size
        Size of the scene, which scales them [m].
    up
        Upward direction in ground axes, (3,), for supports on the ground.
    """
    carriers = cast.carriers
    system = carriers.system
    if system is None:
        return
    g, placed = SIZE * size / max(1.0, len(system.bodies) / FEW) ** 0.5, compiled_system(system).placed
    for joint in system.joints:
        at_a, at_b = joint_markers(system, joint, placed)
        a, b = carriers.of_marker(joint.marker_a, at_a), carriers.of_marker(joint.marker_b, at_b)
        if isinstance(joint, SlidingJoint):
            load(cast, joint.name, b)
            continue
        kind = type(joint).__name__
        if kind in RODS:
            link = Stretched("rod", radius=0.35 * g, color=JOINT_COLOR)
            cast.between.append(Between(link.pieces(1.0), a, b, "joint"))
        else:
            pieces = joint_pieces(kind, getattr(joint, "axis", Z), g)
            cast.placed += [Placed(piece, a, "joint") for piece in pieces]
        on_ground = [carriers.found[end] for end in (a, b) if carriers.found[end].body < 0]
        for end in on_ground[:1]:
            cast.placed.append(Placed(shifted(support(up, g), end.position, np.eye(3)), 0, "joint"))
        load(cast, joint.name, a)
    for force in system.forces:
        if isinstance(force, SpringDamper | SphereContact):
            where = f"force {force.name!r}"
            given = (force.marker_a, force.marker_b)
            found = [carriers.of_marker(each, find_marker(system, where, each)) for each in given]
        elif isinstance(force, Bushing):
            pair = bushing_markers(system, force, placed)
            ends = ((force.marker_a, pair[0]), (force.marker_b, pair[1]))
            found = [carriers.of_marker(each, end) for each, end in ends]
        else:
            continue
        if isinstance(force, SpringDamper):
            cast.between += springs(force, found[0], found[1], min(1.2 * g, 0.12 * distance(cast, *found)), cast)
        elif isinstance(force, Bushing):
            rubber = Cylinder(1.3 * g, 1.8 * g, inner_radius=0.6 * g).pieces()[0]
            cast.placed.append(Placed(replace(rubber, color=BUSHING_COLOR), found[0], "force"))
        else:
            ball = Sphere(min(float(force.radius_b), 0.2 * size)).pieces()[0]
            cast.placed.append(Placed(replace(ball, color=SPRING_COLOR, opacity=0.6), found[1], "force"))
        load(cast, force.name, found[0])


def load(cast: Cast, name: str, carrier: int) -> None:
    """Add the arrow of the load of a joint or force on its marker A, if the results contain it."""
    trajectory = cast.carriers.trajectory
    if name not in trajectory.connection_names:
        return
    values = trajectory.reaction(name).force[cast.carriers.rows]
    if np.any(values):
        cast.forces.append(Force(name, values, carrier))


def distance(cast: Cast, first: int, second: int) -> float:
    """Return the distance of two carriers in the first shown row [m]."""
    trajectory, row = cast.carriers.trajectory, cast.carriers.rows[:1]
    places = []
    for k in (first, second):
        carrier = cast.carriers.found[k]
        place = carrier.position if carrier.motion is None else carrier.position + carrier.motion[0, :3]
        if carrier.body >= 0:
            state = trajectory.state(int(row[0]))
            place = state.r[carrier.body] + rotation_matrix(state.p[carrier.body]) @ place
        places.append(place)
    return float(np.linalg.norm(places[1] - places[0]))


def springs(force: SpringDamper, a: int, b: int, radius: float, cast: Cast) -> list[Between]:
    """Return a coil, a strut, or a strut within a coil."""
    length = distance(cast, a, b)
    if length == 0:
        return []
    kinds = ["coil"] * is_spring(force) + ["strut"] * (force.damping > 0)
    return [Between(Stretched(kind, radius=radius).pieces(length), a, b) for kind in kinds]


def joint_pieces(kind: str, axis: Array, g: float) -> list[Piece]:
    """Return the solids of a joint of a class, in the axes of its marker A, scaled by a length g."""
    axis = np.asarray(axis, dtype=float)
    if kind in RINGS:
        found = [Cylinder(0.9 * g, 2.2 * g, axis=axis).pieces()[0], Cylinder(0.4 * g, 3.0 * g, axis=axis).pieces()[0]]
        colors = [JOINT_COLOR, "#c9d1d8"]
    elif kind in BALLS:
        found, colors = list(Sphere(g).pieces()), [JOINT_COLOR]
    elif kind in CROSSES:
        x, y, _ = axes_about(axis)
        found = [Cylinder(0.4 * g, 2.4 * g, axis=e).pieces()[0] for e in (x, y)]
        colors = [JOINT_COLOR, JOINT_COLOR]
    elif kind in RAILS:
        x, y, z = axes_about(axis)
        box = Box(g * np.array([1.3, 1.3, 4.0])).pieces()[0]
        found, colors = [shifted(box, np.zeros(3), np.stack([x, y, z], axis=1))], [JOINT_COLOR]
    else:
        found, colors = list(Box(np.full(3, 1.1 * g)).pieces()), [JOINT_COLOR]
    return [replace(piece, color=color) for piece, color in zip(found, colors, strict=True)]


def support(up: Array, g: float) -> Piece:
    """Return a foot below a point on the ground."""
    axis = up / np.linalg.norm(up)
    cone = Cylinder(1.9 * g, 2.2 * g, axis=axis, end_radius=0.5 * g).pieces()[0]
    return replace(shifted(cone, -1.3 * g * axis, np.eye(3)), color=GROUND_COLOR)
