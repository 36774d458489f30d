"""Films of a computed motion: deformed bodies coloured by displacement, rigid bodies as shapes or boxes, a ground."""

from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np

from cms.assessment.rendering import Drawing, Lines, Scene, Surface, Triad, render_animation
from cms.assessment.rendering.drawing import OnFrame
from cms.body.modal_file.file import digest, read
from cms.body.reduced_body import ReducedBody, ReducedInterface
from fe_models.foundation.arrays import Array, IntArray
from floatframe.engine.compiling.system import compiled_system
from floatframe.errors import ResultsError
from floatframe.model.bodies.flexible_body import FlexibleBody
from floatframe.model.bodies.rigid_body import RigidBody
from floatframe.model.rotations import rotation_matrix
from floatframe.model.shapes import Piece
from floatframe.model.system import Body, System
from floatframe.pictures.body_colors import DISPLACEMENT, VON_MISES, BodyColor
from floatframe.pictures.element_looks import dressed_bodies, element_pieces
from floatframe.pictures.film_times import FilmTimes, film_times, round_below, speed_words, time_words
from floatframe.pictures.glyphs import glyphs
from floatframe.pictures.looks import looks_of, places_over
from floatframe.pictures.stage import box_of, film_size, ground_grid, view_axes
from floatframe.results.recovery import nodal_displacements
from floatframe.results.trajectory import BodyMotion, Trajectory

__all__ = ["animate", "bodies_of", "motion_scene", "require_modal_files"]

VISIBLE = 0.02  #: displacement, relative to the diagonal of a body, below which displacements are magnified
DRAWN = 0.06  #: largest magnified displacement, relative to the diagonal of a body
LARGEST = 0.2  #: half edge of the box of a rigid body, divided by the size of the scene
GLASS = 0.35  #: opacity of a transparent box
MOST_TRIADS = 11  #: number of named axes above which no axes are drawn
TRAIL_COLOR, RIGID_COLOR = "#7d5ba6", "#9fb0bf"
TRAIL_POINTS = 1500  #: largest number of points of a trail


def animate(
    trajectory: Trajectory,
    bodies: Mapping[str, ReducedBody | RigidBody],
    path: str | Path,
    *,
    fps: float = 25.0,
    speed: float | None = None,
    magnification: float | None = None,
    up: Sequence[float] | None = None,
    color: BodyColor = DISPLACEMENT,
    system: System | None = None,
    on_frame: OnFrame | None = None,
) -> Drawing:
    """Make a film of a motion.

    Parameters
    ----------
    bodies
        Appearance of the bodies of the trajectory, by name (`bodies_of` reads them from the modal files); a missing
        body is drawn as a small cube.
    path
        File whose name ends in .gif or .mp4.
    fps
        Frames per second; fewer if the trajectory has too few rows.
    speed
        Seconds of motion per second of film; None: 1 if the film then lasts 2 to 12 s, otherwise a round number.
    magnification
        Factor of the elastic displacement as drawn; None: 1, or a round number if it would be invisible.
    up
        Upward direction in ground axes, (3,); None: opposite to gravity if the trajectory contains it, otherwise z, or
        y for a motion in the xy plane.
    color
        Quantity that colours flexible bodies: `DISPLACEMENT` or `VON_MISES` of `floatframe.pictures.body_colors`.
    system
        The system of the motion, whose joints, springs, dampers, bushings and contacts are then drawn (see
        `floatframe.pictures.glyphs`).
    on_frame
        Called with the number of frames drawn so far and the total number.

    Raises
    ------
    ResultsError
        If the trajectory has no rows, or does not match a body.
    """
    times = film_times(trajectory.t * trajectory.units.time, fps=fps, speed=speed, n_nodes=count_nodes(bodies))
    scene = motion_scene(trajectory, bodies, times, magnification=magnification, up=up, color=color, system=system)
    return render_animation(scene, path, fps=times.fps, on_frame=on_frame)


def require_modal_files(trajectory: Trajectory) -> None:
    """Check that the modal files of a motion are those with which it was computed.

    Raises
    ------
    ResultsError
        If a file has changed.
    CmsError
        If there is no such file any more.
    """
    for entry in trajectory.head.bodies:
        if entry.source and entry.digest and digest(entry.source) != entry.digest:
            raise ResultsError(
                f"body {entry.name!r}: {entry.source} has changed since the motion was computed; run it again"
            )


def bodies_of(trajectory: Trajectory, system: System | None = None) -> dict[str, ReducedBody]:
    """Return the reduced bodies of a trajectory, by name, from its system, or read from its modal files.

    Raises
    ------
    ResultsError
        If a modal file has changed since the motion was computed, or the system file selected modes of a body and the
        system is not known.
    """
    require_modal_files(trajectory)
    known = {} if system is None else {b.name: b.reduced for b in system.bodies if isinstance(b, FlexibleBody)}
    found = {}
    for entry in trajectory.head.bodies:
        if not entry.source:
            continue
        reduced = known.get(entry.name) or read(entry.source, units=trajectory.units)
        if reduced.n_q != entry.n_q:
            raise ResultsError(
                f"body {entry.name!r}: {entry.source} has {reduced.n_q} modes, but its motion has {entry.n_q}; its "
                "system file selects them: put it back where the run found it"
            )
        found[entry.name] = reduced
    return found


def motion_scene(
    trajectory: Trajectory,
    bodies: Mapping[str, ReducedBody | RigidBody],
    times: FilmTimes,
    *,
    magnification: float | None = None,
    up: Sequence[float] | None = None,
    color: BodyColor = DISPLACEMENT,
    system: System | None = None,
) -> Scene:
    """Return the scene of a motion, with surfaces, interfaces, their trails and ground; parameters as `animate`."""
    unknown = set(bodies) - set(trajectory.body_names)
    if unknown:
        raise ResultsError(
            f"film: the trajectory has no body {sorted(unknown)[0]!r}; it has {', '.join(trajectory.body_names)}"
        )
    flexible = {name: body for name, body in bodies.items() if isinstance(body, ReducedBody)}
    motions = {name: trajectory.body(name) for name in trajectory.body_names}
    for name, reduced in flexible.items():
        if motions[name].q.shape[1] != reduced.n_q:
            raise ResultsError(
                f"film: body {name!r} has {reduced.n_q} modes, but its motion has {motions[name].q.shape[1]}"
            )
    rows = times.rows
    displacements = {name: nodal_displacements(trajectory, name, body, rows) for name, body in flexible.items()}
    if magnification is None:
        magnification = chosen_magnification(flexible, displacements)
    surfaces, triads, lines = [], [], []
    dressed = dressed_bodies(system)
    named: dict[str, Body] = {name: body for name, body in bodies.items() if isinstance(body, RigidBody)}
    named |= {} if system is None else {body.name: body for body in system.bodies}
    scalars = {name: color.values(body, motions[name].q[rows]) for name, body in flexible.items()}
    name_unit, unit_factor = color.unit(trajectory.units, largest_of(scalars))
    frames = {name: (motion.r[rows], rotation_matrix(motion.p[rows])) for name, motion in motions.items()}
    size = scene_size(flexible, frames)
    for name, (r, R) in frames.items():
        body = flexible.get(name)
        looks = looks_of(named[name]) if name in named else ()
        for look in looks:
            at = places_over(look, r, R, motions[name].q[rows], magnification)
            drawn_surfaces, drawn_lines = drawn_piece(look.piece, at, name)
            surfaces += drawn_surfaces
            lines += drawn_lines
        if body is not None and len(body.surface):
            nodes = (body.nodes + magnification * displacements[name]) @ R.transpose(0, 2, 1)
            nodes += r[:, None]
            surfaces.append(Surface(body.surface, nodes, scalars=unit_factor * scalars[name], name=name))
            for interface in body.interfaces:
                path = interface_path(motions[name], interface, magnification)
                triads.append(Triad(path[rows], R @ interface.triad, 0.06 * size, interface.name))
                lines.append(trail(path, rows))
        elif looks or name in dressed:
            lines.append(trail(motions[name].r, rows))
        else:
            rigid = bodies.get(name)
            own = rigid if isinstance(rigid, RigidBody) else None
            most = np.inf if system is None else LARGEST * size
            corners, triangles = box_of(own, 0.04 * size, most, connections(system, name))
            moved = r[:, None] + corners @ R.transpose(0, 2, 1)
            opacity = GLASS if hides_flexible(name, corners, frames, flexible) else 1.0
            surfaces.append(Surface(triangles, moved, color=RIGID_COLOR, opacity=opacity, name=name))
            triads.append(Triad(r, R, 0.06 * size, name))
            lines.append(trail(motions[name].r, rows))
    if len(triads) > MOST_TRIADS:  # more names would hide the machine
        triads = []
    around = [] if system is None else element_pieces(system, trajectory, rows)
    for piece, at in around:
        if not piece.is_ground:
            drawn_surfaces, drawn_lines = drawn_piece(piece, at, "")
            surfaces += drawn_surfaces
            lines += drawn_lines
    seen = [surface.nodes.reshape(-1, 3)[::7] for surface in surfaces]
    points = np.concatenate([*seen, *(line.points.reshape(-1, 3)[::7] for line in lines)])
    up_axis = up_of(trajectory, points) if up is None else np.asarray(up, dtype=float)
    direction, up_axis = view_axes(points, up_axis)
    ground, step = ground_grid(points, up_axis)
    ground_pieces = [(piece, at) for piece, at in around if piece.is_ground]
    if system is not None:
        ground_pieces += [(piece, piece.nodes) for shape in system.scene for piece in shape.pieces()]
    for piece, at in ground_pieces:
        drawn_surfaces, drawn_lines = drawn_piece(piece, at, "")
        surfaces += drawn_surfaces
        lines += drawn_lines
    has_ground = any(piece.is_ground for piece, _ in ground_pieces)
    reach = max(size, 0.5 * float(np.linalg.norm(np.ptp(points, axis=0))))
    drawn = () if system is None else glyphs(system, trajectory, rows, reach, magnification, up_axis)
    words = [speed_words(times.speed)]
    if color is VON_MISES and flexible:
        words.append(f"largest stress at {largest_place(flexible, scalars)}")
    if magnification != 1:
        words.append(f"elastic displacement drawn {magnification:,.6g} times larger")
    if not has_ground:
        words.append(f"ground grid {step:g} {trajectory.units.length_symbol}")
    return Scene(
        surfaces=tuple(surfaces),
        lines=(
            *(() if has_ground else (ground,)),
            *drawn,
            *(line for line in lines if np.ptp(line.points.reshape(-1, 3), axis=0).max() > 1e-3 * size),
        ),
        triads=tuple(triads),
        title=trajectory.head.system,
        captions=("; ".join(words),),
        frame_notes=time_words(trajectory.t[rows] * trajectory.units.time),
        scalar_title=color.title if flexible else "",
        scalar_unit=name_unit if flexible else "",
        direction=direction,
        up=up_axis,
        size=film_size(points, direction, up_axis),
    )


def drawn_piece(piece: Piece, nodes: Array, name: str) -> tuple[list[Surface], list[Lines]]:
    """Return a piece with its nodes, (n, 3) or (n_frames, n, 3), as surfaces and lines."""
    color = piece.color or RIGID_COLOR
    surfaces, lines = [], []
    if len(piece.triangles):
        has_edges = not piece.is_ground
        surfaces.append(
            Surface(piece.triangles, nodes, color=color, opacity=piece.opacity, has_edges=has_edges, name=name)
        )
    if len(piece.segments):
        lines.append(Lines(piece.segments, nodes, color=color, width=2.2, opacity=piece.opacity))
    return surfaces, lines


def connections(system: System | None, name: str) -> Array | None:
    """Return the points of a rigid body where joints and forces act, body frame, (n, 3); None for an unknown system."""
    if system is None:
        return None
    markers, index = compiled_system(system).model.markers, [body.name for body in system.bodies].index(name)
    return np.asarray(markers.position[markers.body == index])


def hides_flexible(
    name: str, corners: Array, frames: Mapping[str, tuple[Array, Array]], flexible: Mapping[str, ReducedBody]
) -> bool:
    """Return whether nodes of a flexible body lie within the box of a rigid one in the first frame."""
    (r, R), low, high = frames[name], corners.min(axis=0), corners.max(axis=0)
    for other, body in flexible.items():
        r_o, R_o = frames[other]
        local = (r_o[0] + body.nodes @ R_o[0].T - r[0]) @ R[0]
        if ((local > low) & (local < high)).all(axis=1).any():
            return True
    return False


def count_nodes(bodies: Mapping[str, ReducedBody | RigidBody]) -> int:
    """Return the number of nodes in a frame."""
    return sum(len(body.nodes) if isinstance(body, ReducedBody) else 8 for body in bodies.values())


def diagonal(body: ReducedBody) -> float:
    """Return the diagonal of the bounding box of the kept nodes of a body [m]."""
    return float(np.linalg.norm(np.ptp(body.nodes, axis=0)))


def scene_size(flexible: Mapping[str, ReducedBody], frames: Mapping[str, tuple[Array, Array]]) -> float:
    """Return the length that scales glyphs: the size of the largest body, or the range of the origins [m]."""
    sizes = [diagonal(body) for body in flexible.values()]
    if not sizes:
        sizes = [float(np.linalg.norm(np.ptp(np.concatenate([r for r, _ in frames.values()]), axis=0)))]
    return max(sizes) or 1.0


def chosen_magnification(flexible: Mapping[str, ReducedBody], displacements: Mapping[str, Array]) -> float:
    """Return 1 if the displacement is visible as it is, else the round number that makes it 2.4 to 6 % of a body."""
    share = max(
        (float(np.abs(displacements[name]).max()) / diagonal(body) for name, body in flexible.items()), default=1.0
    )
    return 1.0 if share >= VISIBLE or share == 0 else round_below(DRAWN / share)


def largest_place(bodies: Mapping[str, ReducedBody], scalars: Mapping[str, Array]) -> str:
    """Return the user's number of the node with the largest scalar of all frames."""
    name = max(scalars, key=lambda body: float(scalars[body].max(initial=0.0)))
    row = int(scalars[name].max(axis=0).argmax())
    where = f"node {bodies[name].node_name(row)}"
    return where if len(bodies) == 1 else f"{where} of {name}"


def largest_of(scalars: Mapping[str, Array]) -> float:
    """Return the largest magnitude of the scalars of all bodies."""
    return max((float(np.abs(values).max(initial=0.0)) for values in scalars.values()), default=0.0)


def interface_path(motion: BodyMotion, interface: ReducedInterface, magnification: float) -> Array:
    """Return the positions of an interface in all rows, in ground axes, (n_t, 3)."""
    local = interface.position + magnification * (motion.q @ interface.Psi[:3].T)
    return np.asarray(motion.r + np.einsum("tab,tb->ta", rotation_matrix(motion.p), local))


def trail(path: Array, rows: IntArray) -> Lines:
    """Return the lines that show, in each frame, the path of a point, (n_t, 3), up to the time of the frame."""
    kept = np.unique(np.r_[rows, np.arange(rows[0], rows[-1], max(len(path) // TRAIL_POINTS, 1))])
    segments = np.stack([np.arange(len(kept) - 1), np.arange(1, len(kept))], axis=1)
    last = np.searchsorted(kept, rows)
    return Lines(segments, path[kept], color=TRAIL_COLOR, width=1.4, opacity=0.6, last=last)


def up_of(trajectory: Trajectory, points: Array) -> Array:
    """Return the upward direction, (3,): opposite to gravity if known; else z, or y for a planar motion in xy."""
    gravity = np.asarray(trajectory.head.run.get("gravity", np.zeros(3)), dtype=float)
    if gravity.shape == (3,) and np.linalg.norm(gravity) > 0:
        return -gravity
    extent = np.ptp(points, axis=0)
    return np.array([0.0, 1.0, 0.0]) if extent[2] < 0.3 * min(extent[:2]) else np.array([0.0, 0.0, 1.0])
