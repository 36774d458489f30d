"""Output files of a fatigue result: a record, a table of the worst nodes, a surface for ParaView, a picture."""

import math
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from cms.assessment.rendering import Drawing, Scene, Surface, Triad, render_picture
from cms.exchange.programs.vtk import numbers_of_cells, numbers_of_nodes, unstructured_grid
from fe_models.foundation.arrays import Array, IntArray
from fe_models.foundation.documents.table import Table
from fe_models.meshes.numbering import NONE
from floatframe.durability.fatigue.assessment import Assessment
from floatframe.durability.fatigue.planes import surface_frames
from floatframe.durability.fatigue.sn_curve import SNCurve
from floatframe.durability.fatigue.surface_damage import FatigueResult

__all__ = ["fatigue_record", "fatigue_scene", "render_fatigue", "vtu_of", "worst_table"]

NEAR = 0.01  #: distance, relative to the size of the body, within which a stress point is shown at a node
#: decades of damage shown by colours, below the largest; fewer if nodes with negligible damage were excluded
DECADES = 6
NUMBERED = 3  #: number of places with a label in the picture


def fatigue_record(made: Assessment) -> dict[str, Any]:
    """Return the complete result in plain types: its inputs and the worst places."""
    result, given = made.result, made.given
    body, programme = result.body, given.programme
    sources: Sequence[Any] = made.blocks or given.spectra
    if len(sources) != len(result.block_names):  # a shake file has one run for each direction
        sources = [*sources] * len(result.block_names)
    return {
        "body": body.name,
        "units": body.units.name,
        "stress_unit": body.units.stress_symbol,
        "life_unit": programme.unit,
        "programme": {"amount": programme.amount, "unit": programme.unit, "target": programme.target},
        "criterion": result.criterion.name,
        "tensor": result.criterion.tensor,
        "mean_stress": result.mean_stress.description,
        "method": result.method_words,
        "curve": curve_record(result.curve, next(iter(given.all_materials.values())).stress_unit),
        "materials": [
            {
                "name": material.name,
                "n_places": int((result.material == number).sum()),
                "mean_stress": material.mean_stress.description,
                "curve": curve_record(material.curve, section.stress_unit),
            }
            for number, (material, section) in enumerate(
                zip(result.materials, given.all_materials.values(), strict=True)
            )
        ],
        "blocks": [
            {"name": name, "repeats": each.repeats, "scale": each.scale}
            for name, each in zip(result.block_names, sources, strict=True)
        ],
        "n_nodes": len(result.nodes),
        "n_points": int((result.points != NONE).sum()),
        "n_counted": int(result.is_counted.sum()),
        "negligible": None if result.is_spectral else given.counting.negligible,
        "notes": list(result.notes),
        "damage": finite(result.damage[result.worst()].max(initial=0.0)),
        "life": finite(made.life[result.worst()].min(initial=math.inf)),
        "worst": [place_record(made, int(place)) for place in result.worst(given.outputs.worst)],
    }


def curve_record(curve: SNCurve, given_in: str) -> dict[str, Any]:
    """Return an S-N curve in plain types, in stress units of the body."""
    return {
        "amplitude": list(map(float, curve.amplitude)),
        "cycles": list(map(float, curve.cycles)),
        "slope": list(map(float, curve.slope)),
        "bottom": list(map(float, curve.bottom)),
        "greatest": curve.greatest,
        "stress_ratio": curve.stress_ratio,
        "given_in": given_in,
    }


def place_record(made: Assessment, place: int) -> dict[str, Any]:
    """Return one place in plain types."""
    result = made.result
    x, y, z = (float(value) for value in result.positions(np.array([place]))[0])
    return {
        "node": result.name(place),
        "place": result.description(place),
        "material": result.materials[result.material[place]].name,
        "x": x,
        "y": y,
        "z": z,
        "damage": float(result.damage[place]),
        "life": finite(made.life[place]),
        "largest_amplitude": float(result.largest[place]),
        "cycles": float(result.cycles[place]),
        "beyond": float(result.beyond[place]),
        "plane": result.criterion.plane_words(int(result.plane[place])),
        "of_blocks": {
            name: float(value) for name, value in zip(result.block_names, result.block_damage[:, place], strict=True)
        },
    }


def finite(value: float) -> float | None:
    """Return a number; None for infinity (life without damage)."""
    return float(value) if math.isfinite(value) else None


def worst_table(made: Assessment) -> Table:
    """Return the worst places, the worst first."""
    record, units = fatigue_record(made), made.result.body.units
    numbers = ("x", "y", "z", "damage", "life", "largest_amplitude", "cycles", "beyond")
    blocks = [f"damage of {name}" for name in made.result.block_names]
    heads = [name.replace("_", " ") for name in numbers]
    rows = [
        (rank, each["node"], each["material"], *(math.inf if each[key] is None else each[key] for key in numbers),
         each["plane"], *each["of_blocks"].values())
        for rank, each in enumerate(record["worst"], start=1)
    ]  # fmt: skip
    known = dict.fromkeys("xyz", units.length_symbol)
    known |= {"life": record["life_unit"], "largest amplitude": units.stress_symbol}
    return Table.of_rows(("rank", "node", "material", *heads, "plane", *blocks), rows, known)


def nodes_of_places(result: FatigueResult) -> tuple[IntArray, IntArray]:
    """Return places and the kept nodes at which they are shown; a stress point is shown at the nearest node.

    The distance is at most a hundredth of the size of the body; other points are not shown.
    """
    from scipy.spatial import cKDTree

    at_points = np.flatnonzero(result.points != NONE)
    at_nodes = np.flatnonzero(result.nodes != NONE)
    if not len(at_points) or not len(result.body.nodes):
        return at_nodes, np.asarray(result.nodes[at_nodes])
    assert result.body.point_stress is not None
    shown = np.unique(result.body.surface) if len(result.body.surface) else np.arange(len(result.body.nodes))
    away, nearest = cKDTree(result.body.nodes[shown]).query(
        result.body.point_stress.positions[result.points[at_points]]
    )
    near = away <= NEAR * np.linalg.norm(np.ptp(result.body.nodes, axis=0))
    places = np.concatenate([at_nodes, at_points[near]])
    return places, np.concatenate([result.nodes[at_nodes], shown[nearest[near]]])


def on_all_nodes(made: Assessment, values: Array, outside: float, *, largest: bool = True) -> Array:
    """Return values of the places at all kept nodes, (n_kept,): the largest or the smallest of several at one node."""
    places, nodes = nodes_of_places(made.result)
    found = np.full(len(made.result.body.nodes), -np.inf if largest else np.inf)
    (np.maximum if largest else np.minimum).at(found, nodes, values[places])
    return np.where(np.isinf(found), outside, found)


def vtu_of(made: Assessment) -> bytes:
    """Return the surface as a .vtu file in mesh coordinates, with damage (its bound at excluded nodes), life, ..."""
    result, body = made.result, made.result.body
    damage = result.damage_or_bound
    life = np.minimum(made.life, 1e300)  # ParaView cannot display infinity
    fields: dict[str, Any] = {
        "damage": on_all_nodes(made, damage, 0.0),
        "log10 damage": on_all_nodes(made, np.log10(np.maximum(damage, 1e-300)), -300.0),
        "life": on_all_nodes(made, life, 1e300, largest=False),
        "largest amplitude": on_all_nodes(made, result.largest, 0.0),
        "is counted": on_all_nodes(made, result.is_counted.astype(float), 0.0),
        **numbers_of_nodes(body),
    }
    header = (
        f"damage and life of {body.name}; life in {made.given.programme.unit}; where counted = 0, damage is an "
        "upper bound and life a lower one",
    )
    points = body.frame.origin + body.nodes @ body.frame.axes.T
    whole = {"programme": np.array([made.given.programme.amount])}
    return unstructured_grid(points, body.surface, fields, whole, header, numbers_of_cells(body))


def render_fatigue(made: Assessment, path: Path) -> Drawing:
    """Draw damage on the surface into a PNG, viewed from the side of the worst place."""
    return render_picture(fatigue_scene(made), path)


def fatigue_scene(made: Assessment) -> Scene:
    """Return the scene: the surface coloured by log10 of damage, with labels at the worst places."""
    result, body = made.result, made.result.body
    damage = result.damage_or_bound
    top = math.log10(max(float(damage.max(initial=0.0)), 1e-300))
    share = made.given.counting.negligible
    low = top - (DECADES if result.is_counted.all() or not share else min(DECADES, -math.log10(share)))
    scalars = on_all_nodes(made, np.maximum(np.log10(np.maximum(damage, 1e-300)), low), low)
    points = body.frame.origin + body.nodes @ body.frame.axes.T
    size = float(np.linalg.norm(np.ptp(points, axis=0)))
    order = result.worst(made.given.outputs.worst)
    at = result.positions(order)
    worst = separated(at, 0.08 * size)
    labels = tuple(
        Triad(at[k], np.eye(3), size=1e-6 * size, label=f"{k + 1}: {result.description(int(order[k]))}")
        for k in worst[:NUMBERED]
    )
    direction, up = towards(made, order)
    life = made.life[order[0]] if len(order) else math.inf
    first = result.description(int(order[0])) if len(order) else "none"
    return Scene(
        surfaces=(Surface(body.surface, points, scalars),),
        triads=labels,
        title=f"{body.name}: damage of one programme",
        captions=(f"worst: {first}, damage {10**top:.3g}", f"life {life:.4g} {made.given.programme.unit}"),
        scalar_title="log10 damage",
        scalar_range=(low, top),
        direction=direction,
        up=up,
    )


def separated(points: Array, distance: float) -> list[int]:
    """Return indices of points, in order, that have at least a distance from all previous ones."""
    taken: list[int] = []
    for k, point in enumerate(points):
        if all(np.linalg.norm(point - points[j]) > distance for j in taken):
            taken.append(k)
    return taken


def towards(made: Assessment, order: IntArray) -> tuple[Array, Array]:
    """Return the view direction onto the worst place, slightly oblique, and the upward direction."""
    body = made.result.body
    direction = np.array([-1.0, 2.0, -1.0])
    places, nodes = nodes_of_places(made.result)
    shown = nodes[places == order[0]] if len(order) else nodes[:0]
    if len(shown) and len(body.surface):
        normal = surface_frames(body, shown[:1])[0, 2] @ body.frame.axes.T
        direction = -normal + 0.35 * direction / np.linalg.norm(direction)
    direction = direction / np.linalg.norm(direction)
    extent = np.ptp(body.nodes @ body.frame.axes.T, axis=0)
    axes = [axis for axis in np.argsort(extent) if abs(direction[axis]) < 0.85]
    return direction, np.eye(3)[axes[0]]
