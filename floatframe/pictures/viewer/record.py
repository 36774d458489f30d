"""The record of a page: shown objects, locations of their numbers, and texts."""

from dataclasses import dataclass
from typing import Any

import numpy as np

from cms.assessment.rendering.shape import colormap
from cms.body.reduced_body import ReducedBody
from fe_models.foundation.arrays import Array, IntArray
from fe_models.foundation.units import Units
from fe_models.foundation.words import nearest, quoted
from floatframe.engine.compiling.markers import find_marker
from floatframe.errors import ModelError
from floatframe.model.bodies.flexible_body import FlexibleBody
from floatframe.model.bodies.rigid_body import RigidBody
from floatframe.model.elements.element import Element, markers_of
from floatframe.model.rotations import rotation_exp, rotation_matrix
from floatframe.model.shapes import Arrow, MarkerShapes, Piece, Plane, Stretched
from floatframe.model.system import System
from floatframe.pictures.animation import diagonal, rotations, up_of
from floatframe.pictures.body_colors import BODY_COLORS
from floatframe.pictures.element_looks import drawn_pieces, shown_of
from floatframe.pictures.film_times import round_below
from floatframe.pictures.stage import view_axes
from floatframe.pictures.viewer.carriers import GROUND_CARRIER, Carriers
from floatframe.pictures.viewer.cast import Between, Cast, Force, Placed, bodies_cast, scene_cast
from floatframe.pictures.viewer.connections import connections_cast, distance
from floatframe.pictures.viewer.flexible import FlexibleSurface
from floatframe.pictures.viewer.packing import Block, Packed
from floatframe.pictures.viewer.surface import broken_at_edges
from floatframe.results.element_motion import ElementMotion, element_motion
from floatframe.results.trajectory import Trajectory

__all__ = ["FORMAT", "VERSION", "Shown", "Stage", "colors_record", "elements_cast", "stage_record"]


# element cast ---------------------------------------------------------------------------------------------------------
# What public elements show of themselves in a page: `Element.drawn()` on their markers, arrows of their outputs.


def elements_cast(cast: Cast) -> None:
    """Add what the elements of a system show of themselves."""
    system = cast.carriers.system
    for element in () if system is None else system.elements:
        element_cast(cast, element)


def element_cast(cast: Cast, element: Element) -> None:
    """Add what an element shows of itself."""
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
    """Add a shape on a carrier; one that stands on the ground once, though several elements show it."""
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
    reduced: dict[str, ReducedBody]  #: of the flexible bodies
    rows: IntArray  #: of the trajectory


@dataclass(frozen=True, eq=False)
class Stage:
    """Size, range of motion and orientation of the machine."""

    low: Array  #: of the box in which it stays, ground axes, (3,) [m]
    high: Array
    size: float  #: size of the machine, the diagonal of its box in the first row [m]
    center: Array  #: of that box, (3,) [m]
    half: Array  #: half of its edges, (3,) [m]
    up: Array  #: (3,)
    direction: Array  #: of the first view, from the eye, (3,)
    follows: int  #: body the camera follows, -1: none


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
        at = motion.r[some][:, None] + corners @ rotations(motion.p[some]).transpose(0, 2, 1)
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
        "trails": trails(cast, len(trajectory.body_names)),
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
    stress = None if each.stress is None else block.quantised(each.stress.reshape(n_a, 6 * n), each=0, centred=True)
    return {
        "body": each.body,
        "nodes": block.quantised(each.nodes, each=-1),
        "shapes": block.quantised(each.shapes.reshape(n_a, 3 * n), each=0, centred=True),
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


def trails(cast: Cast, n_bodies: int) -> list[int]:
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
