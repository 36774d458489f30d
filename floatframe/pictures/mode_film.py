"""Films of system modes: all bodies oscillate about their equilibrium in the shape of a mode."""

from collections.abc import Mapping
from pathlib import Path

import numpy as np

from cms.assessment.rendering import Drawing, Lines, Scene, Surface, Triad, render_animation, render_picture
from cms.assessment.rendering.drawing import OnFrame
from fe_models.foundation.arrays import Array, IntArray
from floatframe.analyses.linear.system_modes import SystemModes
from floatframe.analyses.snapshot import Equilibrium, states_as_motion
from floatframe.engine.compiling.system import compiled_system
from floatframe.engine.initial_conditions.newton_equations import displaced, in_ground_axes
from floatframe.errors import ModelError
from floatframe.model.bodies.flexible_body import FlexibleBody
from floatframe.model.rotations import rotation_matrix
from floatframe.model.state import State
from floatframe.model.system import System
from floatframe.pictures.body_colors import DISPLACEMENT, BodyColor
from floatframe.pictures.glyphs import glyphs
from floatframe.pictures.stage import box_of, ground_grid, view_axes

__all__ = ["animate_mode", "draw_mode", "mode_scene"]

N_FRAMES = 40  #: number of frames in one period
FPS = 20.0
SWING = 0.12  #: largest displacement, relative to the size of the system
LARGEST_TURN = 0.5  #: largest rotation of a body in the film [rad]
#: scale of the undeformed body relative to the moving one; below 1, so that a part that does not move hides it
INSIDE = 0.99
GHOST_COLOR, RIGID_COLOR = "#c3cbd2", "#9fb0bf"


def animate_mode(
    system: System,
    about: Equilibrium,
    modes: SystemModes,
    number: int,
    path: str | Path,
    *,
    color: BodyColor = DISPLACEMENT,
    on_frame: OnFrame | None = None,
) -> Drawing:
    """Make a film of one period of a system mode, which can be repeated without a jump.

    Parameters
    ----------
    system, about
        The system and the equilibrium (or steady rotation) to which the modes belong.
    modes
        Modes from `system_modes(linearize(system, about))`.
    number
        Number of the mode, from 1.
    path
        File whose name ends in .gif or .mp4.
    color
        `DISPLACEMENT`: displacement of all points, also of rigid bodies; `VON_MISES`: stress of flexible bodies. Both
        are divided by their largest value, because the amplitude of a mode is arbitrary.
    on_frame
        Called with the number of frames drawn so far and the total number.

    Raises
    ------
    ModelError
        If there is no such mode.
    ResultsError
        If `color` needs stress modes that a flexible body does not have.
    """
    phases = 2 * np.pi * np.arange(N_FRAMES) / N_FRAMES
    scene = mode_scene(system, about, modes, number, np.exp(1j * phases), color=color)
    return render_animation(scene, path, fps=FPS, on_frame=on_frame)


def draw_mode(
    system: System,
    about: Equilibrium,
    modes: SystemModes,
    number: int,
    path: str | Path,
    *,
    color: BodyColor = DISPLACEMENT,
) -> Drawing:
    """Draw a system mode at its largest displacement into a picture (.png).

    Parameters
    ----------
    system, about
        The system and the equilibrium (or steady rotation) to which the modes belong.
    modes
        Modes from `system_modes(linearize(system, about))`.
    number
        Number of the mode, from 1.
    path
        File whose name ends in .png.
    color
        Quantity that the colours show, as for `animate_mode`.
    """
    return render_picture(mode_scene(system, about, modes, number, np.ones(1, complex), color=color), path)


def mode_scene(
    system: System,
    about: Equilibrium,
    modes: SystemModes,
    number: int,
    turns: Array,
    *,
    color: BodyColor = DISPLACEMENT,
) -> Scene:
    """Return the scene of a mode at phases exp(i phi), (n_frames,) complex; parameters as `animate_mode`."""
    n = len(modes.eigenvalues)
    if not 1 <= number <= n:
        raise ModelError(f"mode {number}: expected 1 to {n}, the modes of system {system.name!r}")
    model, rest = compiled_system(system).model, about.state
    shape = modes.shapes[:, number - 1]
    still = drawn_bodies(system)
    amplitudes = {name: amplitude(system, i, shape, rest) for i, name in enumerate(still)}
    places = {name: nodes_at(system, i, rest) for i, name in enumerate(still)}
    size = float(np.linalg.norm(np.ptp(np.concatenate(list(places.values())), axis=0))) or 1.0
    largest = max(float(np.linalg.norm(a, axis=1).max()) for a in amplitudes.values()) or 1.0
    turn = max(float(np.abs(shape[u0 + 3 : u0 + 6]).max()) for u0 in model.bodies.u0[:-1])
    factor = min(SWING * size / largest, LARGEST_TURN / turn if turn > 0 else np.inf)
    states = [displaced(model, rest, in_ground_axes(model, rest, factor * np.real(shape * turned))) for turned in turns]
    scalars = colors_of(system, amplitudes, shape, turns, color)
    top = max((float(np.abs(values).max()) for values in scalars.values()), default=0.0) or 1.0
    surfaces, triads = [], []
    for i, (name, triangles) in enumerate(still.items()):
        moved = np.array([nodes_at(system, i, state) for state in states])
        values = scalars.get(name)
        surfaces.append(
            Surface(
                triangles, moved, scalars=None if values is None else np.abs(values) / top, color=RIGID_COLOR, name=name
            )
        )
        center = places[name].mean(axis=0)
        ghost = center + INSIDE * (places[name] - center)
        surfaces.append(Surface(triangles, ghost, color=GHOST_COLOR, opacity=0.25, has_edges=False))
    for i, body in enumerate(system.bodies):
        if isinstance(body, FlexibleBody):
            for interface in body.reduced.interfaces:
                R = rotation_matrix(rest.p[i])
                at = rest.r[i] + R @ interface.position
                triads.append(Triad(at, R @ interface.triad, 0.05 * size, interface.name))
    points = np.concatenate([surface.nodes.reshape(-1, 3)[::7] for surface in surfaces])
    up = -model.gravity if np.any(model.gravity) else upright(points)
    direction, up = view_axes(points, up)
    ground, step = ground_grid(points, up)
    motion = states_as_motion(system, states)
    drawn = glyphs(system, motion, np.arange(len(states)), size, 1.0, up)
    lines: tuple[Lines, ...] = (ground, *drawn)
    units = system.units
    return Scene(
        surfaces=tuple(surfaces),
        lines=lines,
        triads=tuple(triads),
        title=f"{system.name}: mode {number}, {frequency_words(modes, number, units.time)}",
        captions=(moving_words(modes, number) + f"; ground grid {step:g} {units.length_symbol}",),
        scalar_title=("displacement" if color is DISPLACEMENT else color.title) + " / largest value",
        scalar_range=(0.0, 1.0),
        direction=direction,
        up=up,
        size=(960, 720),
    )


def drawn_bodies(system: System) -> dict[str, IntArray]:
    """Return the triangles of each body: its surface, or the box of its inertia."""
    found = {}
    for body in system.bodies:
        if isinstance(body, FlexibleBody):
            found[body.name] = body.reduced.surface if len(body.reduced.surface) else box_of(None, 1.0)[1]
        else:
            found[body.name] = box_of(body, 1.0)[1]
    return found


def corners_of(system: System, i: int) -> Array:
    """Return the corners of the box of a body in its frame, (8, 3)."""
    body = system.bodies[i]
    if not isinstance(body, FlexibleBody):
        length = compiled_system(system).length
        markers = compiled_system(system).model.markers
        return box_of(body, 0.02 * length, 0.2 * length, markers.position[markers.body == i])[0]
    low, high = body.reduced.nodes.min(axis=0), body.reduced.nodes.max(axis=0)
    half = np.maximum((high - low) / 2, 0.01 * compiled_system(system).length)
    return np.asarray((low + high) / 2 + box_of(None, 1.0)[0] * half)


def nodes_at(system: System, i: int, state: State) -> Array:
    """Return the drawn nodes of a body in a state, in ground axes, (n_nodes, 3)."""
    model, body = compiled_system(system).model, system.bodies[i]
    if isinstance(body, FlexibleBody) and len(body.reduced.surface):
        q = state.q[model.bodies.q0[i] : model.bodies.q0[i + 1]]
        local = body.reduced.nodes + body.reduced.Phi @ q
    else:
        local = corners_of(system, i)
    return np.asarray(state.r[i] + local @ rotation_matrix(state.p[i]).T)


def amplitude(system: System, i: int, shape: Array, rest: State) -> Array:
    """Return the complex displacement of the drawn nodes of a body in a mode, in body axes, (n_nodes, 3)."""
    model, body = compiled_system(system).model, system.bodies[i]
    u0 = int(model.bodies.u0[i])
    move, turn, q = shape[u0 : u0 + 3], shape[u0 + 3 : u0 + 6], shape[u0 + 6 : int(model.bodies.u0[i + 1])]
    if isinstance(body, FlexibleBody) and len(body.reduced.surface):
        local = body.reduced.nodes + body.reduced.Phi @ rest.q[model.bodies.q0[i] : model.bodies.q0[i + 1]]
        return np.asarray(move + np.cross(turn, local) + body.reduced.Phi @ q)
    return np.asarray(move + np.cross(turn, corners_of(system, i)))


def colors_of(
    system: System, amplitudes: Mapping[str, Array], shape: Array, turns: Array, color: BodyColor
) -> dict[str, Array]:
    """Return the scalars of each body in all frames, (n_frames, n_nodes)."""
    if color is DISPLACEMENT:
        return {
            name: np.array([np.linalg.norm(np.real(a * turned), axis=1) for turned in turns])
            for name, a in amplitudes.items()
        }
    model = compiled_system(system).model
    found = {}
    for i, body in enumerate(system.bodies):
        if isinstance(body, FlexibleBody) and len(body.reduced.surface):
            q = shape[int(model.bodies.u0[i]) + 6 : int(model.bodies.u0[i + 1])]
            found[body.name] = color.values(body.reduced, np.real(np.outer(turns, q)))
    return found


def upright(points: Array) -> Array:
    """Return the upward direction without gravity, (3,): z, or y if the system is flat in z."""
    extent = np.ptp(points, axis=0)
    return np.array([0.0, 1.0, 0.0]) if extent[2] < 0.3 * min(extent[:2]) else np.array([0.0, 0.0, 1.0])


def frequency_words(modes: SystemModes, number: int, time_unit: float) -> str:
    """Return frequency and damping of a mode as text."""
    f, ratio = float(modes.frequencies[number - 1]) / time_unit, float(modes.damping_ratios[number - 1])
    if f == 0:
        return "a motion without resistance" if ratio == 0 else ("decays" if ratio > 0 else "grows")
    damping = f", damping {100 * ratio:.2g} %" if ratio > 1e-9 else (", grows" if ratio < -1e-9 else "")
    return f"{f:.4g} Hz{damping}"


def moving_words(modes: SystemModes, number: int) -> str:
    """Return the bodies that carry the kinetic energy of a mode, as text."""
    shares = sorted(zip(modes.bodies, modes.energy_shares[number - 1], strict=True), key=lambda item: -item[1])
    return "moves: " + ", ".join(f"{name} {100 * share:.0f} %" for name, share in shares[:4] if share >= 0.005)
