"""The record of a page: shown objects, locations of their numbers, and texts."""

from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from cms.assessment.rendering.shape import colormap
from cms.body.reduced_body import ReducedBody
from fe_models.foundation.arrays import Array, IntArray
from fe_models.foundation.units import Units
from fe_models.foundation.words import nearest, quoted
from floatframe.engine.compiling.markers import find_marker, joint_markers
from floatframe.engine.compiling.pair_forces import bushing_markers
from floatframe.engine.compiling.system import compiled_system
from floatframe.errors import ModelError
from floatframe.model.bodies.flexible_body import FlexibleBody
from floatframe.model.bodies.rigid_body import RigidBody
from floatframe.model.elements.element import Element, markers_of
from floatframe.model.forces import Bushing, SphereContact, SpringDamper
from floatframe.model.joints.sliding import SlidingJoint
from floatframe.model.rotations import rotation_exp, rotation_matrix
from floatframe.model.shapes import Arrow, Box, Cylinder, MarkerShapes, Piece, Plane, Sphere, Stretched
from floatframe.model.shapes.piece import shifted
from floatframe.model.shapes.rounds import axes_about
from floatframe.model.system import System
from floatframe.pictures.animation import diagonal, up_of
from floatframe.pictures.body_colors import BODY_COLORS
from floatframe.pictures.element_looks import drawn_pieces, shown_of
from floatframe.pictures.film_times import round_below
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
from floatframe.pictures.stage import view_axes
from floatframe.pictures.viewer.carriers import GROUND_CARRIER, Carriers
from floatframe.pictures.viewer.cast import Between, Cast, Force, Placed, bodies_cast, scene_cast
from floatframe.pictures.viewer.flexible import FlexibleSurface
from floatframe.pictures.viewer.packing import Block, Packed
from floatframe.pictures.viewer.surface import broken_at_edges
from floatframe.results.element_motion import ElementMotion, element_motion
from floatframe.results.trajectory import Trajectory

__all__ = [
    "FORMAT",
    "VERSION",
    "Shown",
    "Stage",
    "colors_record",
    "connections_cast",
    "distance",
    "elements_cast",
    "joint_pieces",
    "stage_record",
]


# element cast ---------------------------------------------------------------------------------------------------------
# Appearance of public elements in a page: `Element.drawn()` on their markers, and arrows of their outputs.


def elements_cast(cast: Cast) -> None:
    """Add the drawn parts of the elements of a system."""
    system = cast.carriers.system
    for element in () if system is None else system.elements:
        element_cast(cast, element)


def element_cast(cast: Cast, element: Element) -> None:
    """Add the drawn parts of an element."""
    carriers, where = cast.carriers, f"element {element.name!r}"
    system = carriers.system
    shown = () if system is None else shown_of(system, element)
    if system is None or not shown:
        return
    ends = [carriers.of_marker(marker, find_marker(system, where, marker)) for marker in markers_of(element)]
    motion = None
    for each in shown:
        if isinstance(each, MarkerShapes):
            carrier = GROUND_CARRIER if each.marker is None else ends[each.marker]
            drawn_cast(cast, each, carrier, system.units.length)
        elif isinstance(each, Stretched):
            a, b = ends[each.first], ends[each.second]
            length = distance(cast, a, b)
            if length > 0:
                cast.between.append(Between(each.pieces(length), a, b))
        else:
            motion = element_motion(system, carriers.trajectory, element.name) if motion is None else motion
            cast.forces.append(element_force(cast, element.name, each, ends[each.marker], motion))


def drawn_cast(cast: Cast, drawn: MarkerShapes, carrier: int, metres: float) -> None:
    """Add a shape on a carrier; a shape on the ground that several elements share is added once."""
    found = cast.carriers.found[carrier]
    if found.body < 0 and isinstance(drawn.shape.geometry, Plane):
        cast.add_plane(drawn.shape.geometry, found.position + found.axes @ drawn.shape.position, found.axes)
    for piece in drawn_pieces(drawn, metres):
        if found.body < 0:
            key = (carrier, piece.color, piece.nodes.tobytes())
            if key not in cast.on_ground:
                cast.on_ground.add(key)
                cast.placed.append(Placed(piece, carrier, "scene"))
        else:
            cast.placed.append(Placed(piece, carrier, "body"))


def element_force(cast: Cast, name: str, arrow: Arrow, carrier: int, motion: ElementMotion) -> Force:
    """Return an arrow of three outputs of an element."""
    rows, trajectory = cast.carriers.rows, cast.carriers.trajectory
    missing = [each for each in (*(arrow.outputs or ()), *(arrow.at or ())) if each not in motion.outputs]
    if missing:
        hint = nearest(missing[0], list(motion.outputs))
        raise ModelError(f"element {name!r}: drawn: there is no output {quoted(missing[0])}{hint}")
    if arrow.outputs is None:
        values = motion.wrench[rows, arrow.marker, :3]
    else:
        values = np.stack([motion.outputs[each][rows] for each in arrow.outputs], axis=1)
    if arrow.is_in_marker_axes and arrow.outputs is not None:
        found = cast.carriers.found[carrier]
        axes = np.broadcast_to(found.axes, (len(rows), 3, 3))
        if found.motion is not None:
            axes = rotation_exp(found.motion[:, 3:]) @ axes
        if found.body >= 0:
            axes = rotation_matrix(trajectory.body(trajectory.body_names[found.body]).p[rows]) @ axes
        values = np.einsum("tab,tb->ta", axes, values)
    at = None if arrow.at is None else np.stack([motion.outputs[each][rows] for each in arrow.at], axis=1)
    return Force(name, values, carrier, arrow.color, at, is_of_element=True)


# record ---------------------------------------------------------------------------------------------------------------


FORMAT, VERSION = "floatframe-view", 1
MOST_FORCES = 40  #: largest number of arrows of joints and springs
TRAVELS = 2.5  #: number of machine sizes that the machine must travel for the camera to follow it


@dataclass(frozen=True, eq=False)
class Shown:
    """The shown motion and bodies."""

    trajectory: Trajectory
    system: System | None
    bodies: dict[str, RigidBody | FlexibleBody | None]  #: all bodies, by name; None: unknown
    reduced: dict[str, ReducedBody]  #: reduced bodies of the flexible bodies, by name
    rows: IntArray  #: rows of the trajectory that are shown


@dataclass(frozen=True, eq=False)
class Stage:
    """Size, range of motion and orientation of the machine."""

    low: Array  #: lower corner of the box in which the machine stays, ground axes, (3,) [m]
    high: Array
    size: float  #: size of the machine, the diagonal of its box in the first row [m]
    center: Array  #: centre of the machine's box in the first row, (3,) [m]
    half: Array  #: half edges of this box, (3,) [m]
    up: Array  #: upward direction, (3,)
    direction: Array  #: direction of the first view, away from the eye, (3,)
    follows: int  #: body that the camera follows, -1 for none


def stage_of(shown: Shown, cast: Cast) -> Stage:
    """Return size and range of motion of the machine."""
    trajectory, rows = shown.trajectory, shown.rows
    lows, highs, first, sample = [], [], [], []
    travel, masses = [], []
    for i, name in enumerate(trajectory.body_names):
        motion = trajectory.body(name)
        own = [(each.piece.nodes, cast.carriers.found[each.carrier]) for each in cast.placed if each.kind == "body"]
        local = [nodes @ carrier.axes.T + carrier.position for nodes, carrier in own if carrier.body == i]
        if name in shown.reduced:
            local.append(np.asarray(shown.reduced[name].nodes))
        nodes = np.concatenate(local) if local else np.zeros((1, 3))
        low, high = nodes.min(axis=0), nodes.max(axis=0)
        corners = np.array([[a, b, c] for a in (low[0], high[0]) for b in (low[1], high[1]) for c in (low[2], high[2])])
        some = rows[:: max(len(rows) // 200, 1)]
        at = motion.r[some][:, None] + corners @ rotation_matrix(motion.p[some]).transpose(0, 2, 1)
        lows.append(at.min(axis=(0, 1)))
        highs.append(at.max(axis=(0, 1)))
        first.append(at[0])
        sample.append(at.reshape(-1, 3))
        travel.append(np.linalg.norm(motion.r[rows[-1]] - motion.r[rows[0]]))
        masses.append(float(np.prod(np.maximum(high - low, 1e-9))))
    start = np.concatenate(first)
    size = float(np.linalg.norm(np.ptp(start, axis=0))) or 1.0
    points = np.concatenate(sample)
    up = up_of(trajectory, points)
    direction, up = view_axes(points, up)
    follows = int(np.argmax(masses)) if max(travel) > TRAVELS * size else -1
    low, high = np.min(lows, axis=0), np.max(highs, axis=0)
    half = np.ptp(start, axis=0) / 2
    return Stage(low, high, size, start.min(axis=0) + half, half, up, direction, follows)


def stage_record(shown: Shown, surfaces: list[FlexibleSurface], block: Block) -> tuple[dict[str, Any], Cast]:
    """Return bodies, carriers, pieces, arrows, ground and views of a page, and the cast from which they were made."""
    trajectory, rows = shown.trajectory, shown.rows
    cast = Cast(Carriers(trajectory, rows, shown.system))
    bodies_cast(cast, shown.bodies, scale_of(shown))
    elements_cast(cast)
    stage = stage_of(shown, cast)
    scene_cast(cast)
    connections_cast(cast, stage.size, stage.up)
    amplitudes = {each.body: each.amplitudes for each in surfaces}
    record: dict[str, Any] = {
        "format": FORMAT,
        "version": VERSION,
        "time": block.real(trajectory.t[rows]),
        "bodies": [
            body_record(block, trajectory, name, rows, amplitudes.get(i))
            for i, name in enumerate(trajectory.body_names)
        ],
        "surfaces": [surface_record(block, each) for each in surfaces],
        "carriers": [
            {
                "body": each.body,
                "position": each.position.tolist(),
                "axes": each.axes.ravel().tolist(),
                "motion": None if each.motion is None else block.quantised(each.motion, each=-1, centred=True),
            }
            for each in cast.carriers.found
        ],
        "pieces": [piece_record(block, each.piece, carrier=each.carrier, kind=each.kind) for each in cast.placed],
        "between": [
            {
                "first": each.first,
                "second": each.second,
                "kind": each.kind,
                "parts": [piece_record(block, part.piece, follows=part.follows) for part in each.parts],
            }
            for each in cast.between
        ],
        "forces": [
            {
                "name": each.name,
                "carrier": each.carrier,
                "color": each.color,
                "values": block.quantised(each.values, centred=True),
                "at": None if each.at is None else block.real(each.at),
                "is_of_element": each.is_of_element,
                "largest": float(np.linalg.norm(each.values, axis=1).max(initial=0.0)),
            }
            for each in strongest(cast)
        ],
        "trails": trails(cast),
        "ground": ground_record(cast, stage),
        "view": {
            "low": stage.low.tolist(),
            "high": stage.high.tolist(),
            "center": stage.center.tolist(),
            "half": stage.half.tolist(),
            "size": stage.size,
            "up": stage.up.tolist(),
            "direction": stage.direction.tolist(),
            "follows": stage.follows,
        },
        "colormap": [f"#{r:02x}{g:02x}{b:02x}" for r, g, b in np.rint(255 * colormap()[::5]).astype(int)],
    }
    return record, cast


def scale_of(shown: Shown) -> float:
    """Return the length that scales objects without a size of their own [m]."""
    sizes = [diagonal(body) for body in shown.reduced.values()]
    places = np.concatenate([shown.trajectory.body(name).r[shown.rows[:1]] for name in shown.trajectory.body_names])
    sizes.append(float(np.linalg.norm(np.ptp(places, axis=0))))
    return max(sizes) or 1.0


def body_record(
    block: Block, trajectory: Trajectory, name: str, rows: IntArray, amplitudes: Array | None
) -> dict[str, Any]:
    """Return the motion of a body frame, and the amplitudes of its shapes."""
    motion = trajectory.body(name)
    return {
        "name": name,
        "r": block.real(motion.r[rows]),
        "p": block.real(motion.p[rows]),
        "a": None if amplitudes is None else block.quantised(amplitudes, each=-1, centred=True),
    }


def surface_record(block: Block, each: FlexibleSurface) -> dict[str, Any]:
    """Return a flexible surface."""
    n_a, n = each.shapes.shape[:2]
    shapes, (step_of_shape, step_of_stress) = each.shapes.reshape(n_a, 3 * n), each.steps
    stress = None
    if each.stress is not None:
        stress = block.quantised(each.stress.reshape(n_a, 6 * n), each=0, centred=True, steps=step_of_stress)
    return {
        "body": each.body,
        "nodes": block.quantised(each.nodes, each=-1),
        "shapes": block.quantised(shapes, each=0, centred=True, steps=step_of_shape),
        "stress": stress,
        "corner": block.whole(each.surface.corner),
        "triangles": block.whole(each.surface.triangles),
        "edges": block.whole(each.surface.edges),
    }


def piece_record(block: Block, piece: Piece, **more: Any) -> dict[str, Any]:
    """Return a piece; its nodes are split at sharp edges."""
    corner, triangles = np.zeros(0, np.int64), np.asarray(piece.triangles)
    if len(triangles):
        corner, triangles = broken_at_edges(piece.nodes, triangles)
    nodes: Packed = block.real(piece.nodes) if piece.is_ground else block.quantised(piece.nodes, each=-1)
    return {
        "nodes": nodes,
        "corner": block.whole(corner),
        "triangles": block.whole(triangles),
        "segments": block.whole(piece.segments),
        "color": piece.color,
        "opacity": piece.opacity,
        "is_ground": piece.is_ground,
        **more,
    }


def strongest(cast: Cast) -> list[Any]:
    """Return the arrows: those of elements, and the strongest ones of joints and springs."""
    own = [force for force in cast.forces if force.is_of_element]
    others = [force for force in cast.forces if not force.is_of_element]
    others.sort(key=lambda force: -float(np.abs(force.values).max(initial=0.0)))
    return own + others[:MOST_FORCES]


def trails(cast: Cast) -> list[int]:
    """Return the carriers whose paths are drawn: markers of joints and interfaces on bodies."""
    used = [k for k, carrier in enumerate(cast.carriers.found) if carrier.body >= 0]
    return used[:24]


def ground_record(cast: Cast, stage: Stage) -> dict[str, Any] | None:
    """Return the flat ground: that of the scene, or one below everything that moves; None: uneven ground."""
    up = stage.up / np.linalg.norm(stage.up)
    step = round_below(stage.size / 2)
    for normal, level, own in cast.planes[:1]:
        return {"normal": normal.tolist(), "level": level, "step": own or step}
    if cast.has_ground:
        return None
    corners = np.array([stage.low, stage.high])
    level = float(min(np.minimum(corners[0] * up, corners[1] * up).sum(), np.inf))
    return {"normal": up.tolist(), "level": level - 0.05 * stage.size, "step": step}


def colors_record(units: Units, displacement: float, stress: float | None) -> list[dict[str, Any]]:
    """Return the quantities for colours: name, unit, factor to it, largest value."""
    found = []
    for key, largest in (("displacement", displacement), ("von-mises", stress)):
        if largest is not None:
            color = BODY_COLORS[key]
            symbol, factor = color.unit(units, largest)
            found.append(
                {"key": key, "title": color.title, "unit": symbol, "factor": factor, "largest": factor * largest}
            )
    return found


# drawings of joints, forces and elements in a page: small solids on markers, springs, arrows of loads -----------------


#: size of a joint, divided by the size of the scene, and number of bodies above which joints are drawn smaller
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
