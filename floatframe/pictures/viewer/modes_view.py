"""A page with the vibration modes of a system: for a chosen mode, all bodies oscillate about their equilibrium."""

import os
from dataclasses import replace
from typing import Any

import numpy as np

from fe_models.foundation.arrays import Array
from floatframe.analyses.linear.system_modes import SystemModes
from floatframe.analyses.snapshot import Equilibrium, snapshot
from floatframe.errors import ResultsError
from floatframe.model.bodies.flexible_body import FlexibleBody
from floatframe.model.system import System
from floatframe.pictures.mode_film import LARGEST_TURN, SWING, frequency_words
from floatframe.pictures.viewer.flexible import FlexibleSurface, flexible_surface, nodes_within
from floatframe.pictures.viewer.motion_view import (
    LARGEST,
    Page,
    bytes_for_numbers,
    require_color,
    source_record,
    surface_notes,
    unit_record,
    written,
)
from floatframe.pictures.viewer.packing import Block
from floatframe.pictures.viewer.record import Shown, colors_record, stage_record

__all__ = ["view_modes"]

SPEED = 0.5  #: initial speed in periods per second


def view_modes(
    system: System,
    about: Equilibrium,
    modes: SystemModes,
    path: str | os.PathLike[str],
    *,
    n_modes: int = 20,
    color: str = "displacement",
    largest: float = LARGEST,
) -> Page:
    """Write vibration modes of a system as a single page that works offline.

    Parameters
    ----------
    system, about
        The system and the equilibrium (or steady rotation) to which the modes belong.
    modes
        Modes from `system_modes(linearize(system, about))`.
    path
        File whose name ends in .html.
    n_modes
        Number of modes, in order of frequency.
    color
        Initial colour: "displacement" (amplitude of the points of a flexible body) or "von-mises". Both are divided by
        their largest value, because the amplitude of a mode is arbitrary.
    largest
        Largest size of the page in megabytes.

    Raises
    ------
    ResultsError
        If there is no mode, if stress is requested but not available, or if the page cannot be that small.
    """
    require_color(color)
    shapes = modes.shapes[:, : max(n_modes, 0)]
    if not shapes.shape[1]:
        raise ResultsError(f"view: system {system.name!r} has no modes to show; expected 1 or more")
    rest = snapshot(system, about)
    bodies = {body.name: body for body in system.bodies}
    reduced = {name: body.reduced for name, body in bodies.items() if isinstance(body, FlexibleBody)}
    if color == "von-mises" and not any(body.stress is not None for body in reduced.values()):
        raise ResultsError("view: the von Mises stress is requested, but no body of the system has stress modes")
    shown = Shown(rest, system, dict(bodies), reduced, np.zeros(1, np.int64))
    parts = parts_of(rest, shapes)
    block, surfaces, elastic = Block(), [], {}
    most = nodes_within(bytes_for_numbers(largest), reduced)
    for i, name in enumerate(bodies):
        if name not in most:
            continue
        q = parts[i][:, 6:]
        history = np.concatenate([rest.body(name).q, q.real, q.imag])
        whole = flexible_surface(i, reduced[name], history, most[name], is_stiffened=False)
        elastic[i] = whole.amplitudes[1:]
        surfaces.append(at_rest(whole))
    record, cast = stage_record(shown, surfaces, block)
    factors = [factor_of(record["view"]["size"], parts, k, surfaces, elastic) for k in range(shapes.shape[1])]
    n = len(factors)
    for i, body in enumerate(record["bodies"]):
        move = parts[i][:, :6] * np.array(factors)[:, None]
        a = np.zeros((2 * n, 0)) if i not in elastic else elastic[i] * np.tile(factors, 2)[:, None]
        body["modes"] = {
            "re": block.real(move.real), "im": block.real(move.imag), "a_re": block.real(a[:n]),
            "a_im": block.real(a[n:]),
        }  # fmt: skip
    for carrier, found in zip(record["carriers"], cast.carriers.found, strict=True):
        if found.psi is not None:
            swing = np.array(factors)[:, None] * (parts[found.body][:, 6:] @ found.psi.T)
            carrier["modes"] = {"re": block.real(swing.real), "im": block.real(swing.imag)}
    has_stress = any(each.stress is not None for each in surfaces)
    record |= {
        "kind": "modes",
        "title": f"{system.name}: modes",
        "facts": [
            f"{n} of {len(modes.eigenvalues)} modes",
            "about a steady rotation" if np.any(about.omega) else "about the equilibrium",
            "stable" if modes.is_stable else "unstable",
        ],
        "notes": [
            f"The amplitude of a mode is arbitrary: the farthest point is drawn at {100 * SWING:.0f} % of the machine.",
            *surface_notes(rest.body_names, surfaces),
        ],
        "sources": source_record(rest),
        "units": unit_record(rest),
        "panel_time": block.real(np.zeros(1)),
        "panels": [],
        "speed": SPEED,
        "colors": mode_colors(system, has_stress) if surfaces else [],
        "color": color,
        "magnification": 1.0,
        "modes": [mode_record(system, modes, k) for k in range(n)],
    }
    return written(path, record, block, largest)


def mode_colors(system: System, has_stress: bool) -> list[dict[str, Any]]:
    """Return the quantities for colours: amplitude of a node including its body's motion, and stress."""
    found = colors_record(system.units, 1.0, 1.0 if has_stress else None)
    return [{**each, "title": "displacement"} if each["key"] == "displacement" else each for each in found]


def parts_of(rest: Any, shapes: Array) -> list[Array]:
    """Return the motion of each body in each mode: translation, rotation (body axes), q, (n_modes, 6 + n_q) complex."""
    entries = rest.head.bodies
    return [np.asarray(shapes[each.u0 : each.u0 + 6 + each.n_q].T) for each in entries]


def at_rest(surface: FlexibleSurface) -> FlexibleSurface:
    """Return the surface with only the amplitudes of the first row."""
    return replace(surface, amplitudes=surface.amplitudes[:1])


def factor_of(
    size: float, parts: list[Array], k: int, surfaces: list[FlexibleSurface], elastic: dict[int, Array]
) -> float:
    """Return the factor of a mode as drawn, which moves its farthest point by a fraction of the machine's size."""
    n = len(parts[0])
    farthest, turn = 0.0, 0.0
    own = {each.body: each for each in surfaces}
    for i, part in enumerate(parts):
        move, rotation = part[k, :3], part[k, 3:6]
        turn = max(turn, float(np.abs(rotation).max()))
        places = own[i].nodes if i in own else 0.1 * size * np.concatenate([np.eye(3), -np.eye(3)])
        d = move + np.cross(np.broadcast_to(rotation, places.shape), places)
        if i in own:
            a = elastic[i][k] + 1j * elastic[i][n + k]
            d = d + np.tensordot(a, own[i].shapes, axes=1)
        farthest = max(farthest, float(np.linalg.norm(d, axis=1).max()))
    return min(SWING * size / farthest if farthest > 0 else 1.0, LARGEST_TURN / turn if turn > 0 else np.inf)


def mode_record(system: System, modes: SystemModes, k: int) -> dict[str, Any]:
    """Return the texts of a mode."""
    ratio = float(modes.damping_ratios[k])
    frequency = float(modes.frequencies[k])
    damping = "grows" if ratio < -1e-9 else f"damping {100 * ratio:.3g} %" if ratio > 1e-9 and frequency > 0 else ""
    title = frequency_words(modes, k + 1, system.units.time).partition(",")[0]
    shares = sorted(zip(modes.bodies, modes.energy_shares[k], strict=True), key=lambda pair: -pair[1])
    moves = ", ".join(f"{name} {100 * share:.0f} %" for name, share in shares[:3] if share >= 0.005)
    return {"title": title, "damping": damping, "moves": moves}
