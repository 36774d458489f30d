"""Assessed places: nodes of the surface and stress points of elements, each with its material."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from cms.body.reduced_body import ReducedBody
from fe_models.foundation.arrays import Array, IntArray
from fe_models.foundation.presentation import presented
from fe_models.foundation.records import checked_fields
from fe_models.meshes.numbering import NONE
from floatframe.durability.fatigue.criteria import Criterion
from floatframe.durability.fatigue.mean_stress import NO_CORRECTION, MeanStress
from floatframe.durability.fatigue.planes import surface_frames, surface_nodes
from floatframe.durability.fatigue.sn_curve import SNCurve
from floatframe.errors import FatigueError, ModelError

__all__ = ["FatigueMaterial", "Places", "assessed_places", "point_number"]


@presented
@dataclass(frozen=True, eq=False)
@checked_fields(ModelError)
class FatigueMaterial:
    """A material of places: its S-N curve with factors, and its mean stress correction.

    Parameters
    ----------
    curve
        S-N curve in stress units of the body.
    mean_stress
        Correction for the mean stress.
    name
        Name of the material.
    nodes
        Kept nodes of the material; with `points` also None, the material applies to all places without another one.
    points
        Rows of the stress points of the material.
    """

    curve: SNCurve
    mean_stress: MeanStress = NO_CORRECTION
    name: str = ""
    nodes: IntArray | None = None
    points: IntArray | None = None


@dataclass(frozen=True, eq=False)
class Places:
    """Places in the order of their materials; a node or point with two materials is two places."""

    nodes: IntArray  #: index of the kept node, -1 at a stress point, (n,)
    points: IntArray  #: row of the stress points of the body, -1 at a node, (n,)
    material: IntArray  #: index of the material at each place, (n,)
    n_left_out: int  #: number of nodes and points without a material


def point_number(body: ReducedBody) -> int:
    """Return the number of stress points of a body."""
    return 0 if body.point_stress is None else len(body.point_stress.names)


def assessed_places(
    body: ReducedBody, materials: Sequence[FatigueMaterial], nodes: IntArray | None, points: IntArray | None,
    criterion: Criterion,
) -> Places:  # fmt: skip
    """Return the places to assess.

    Parameters
    ----------
    nodes
        Kept nodes; None: all nodes on the surface that have stress.
    points
        Rows of the stress points; None: all, or none if nodes are given.

    Raises
    ------
    FatigueError
        If there are no places, one does not exist, or the criterion needs a tangent plane, which points do not have.
    """
    n_points = point_number(body)
    if nodes is None and n_points and body.stress is None:
        nodes = np.zeros(0, np.int64)
    if points is None:
        points = np.arange(n_points) if nodes is None else np.zeros(0, np.int64)
    nodes = surface_nodes(body) if nodes is None else np.asarray(nodes, dtype=np.int64)
    points = np.asarray(points, dtype=np.int64)
    for what, chosen, count in (("kept nodes", nodes, len(body.nodes)), ("stress points", points, n_points)):
        if chosen.ndim != 1 or (len(chosen) and (chosen.min() < 0 or chosen.max() >= count)):
            got = f"{chosen.min()} to {chosen.max()}" if chosen.size else f"{chosen.shape}"
            raise FatigueError(f"fatigue: nodes: expected {what} 0 to {count - 1}, got {got}")
    if not len(nodes) + len(points):
        raise FatigueError("fatigue: nodes: expected one node or stress point at least")
    if len(points) and criterion.needs_surface:
        raise FatigueError(
            f'fatigue: criterion "{criterion.name}" with tensor = "{criterion.tensor}" needs the tangent plane of the '
            "surface, and stress points of elements have none; take signed-von-mises or principal with tensor = "
            '"full", or assess only nodes (outputs.places = "nodes")'
        )
    named = [material for material in materials if material.nodes is not None or material.points is not None]
    rest = [material for material in materials if material.nodes is None and material.points is None]
    if len(rest) > 1:
        raise FatigueError("fatigue: two materials name no places; expected at most one, for all other places")
    has = [np.zeros(len(nodes), bool), np.zeros(len(points), bool)]
    members = {}
    for material in named:
        own = (material.nodes, material.points)
        mine = [np.isin(at, [] if of is None else of) for at, of in zip((nodes, points), own, strict=True)]
        if not (mine[0].any() or mine[1].any()):
            raise FatigueError(f"fatigue: material {material.name!r}: none of its places is assessed")
        has = [a | b for a, b in zip(has, mine, strict=True)]
        members[id(material)] = mine
    for material in rest:
        members[id(material)] = [~each for each in has]
    if rest:
        has = [np.ones(len(each), bool) for each in has]
    at_nodes, at_points, of = [], [], []
    for number, material in enumerate(materials):
        on_nodes, on_points = (each[mine] for each, mine in zip((nodes, points), members[id(material)], strict=True))
        at_nodes += [on_nodes, np.full(len(on_points), NONE)]
        at_points += [np.full(len(on_nodes), NONE), on_points]
        of.append(np.full(len(on_nodes) + len(on_points), number))
    left_out = int(sum((~each).sum() for each in has))
    return Places(np.concatenate(at_nodes), np.concatenate(at_points), np.concatenate(of), left_out)


def stress_of_places(body: ReducedBody, places: Places, rows: IntArray, field: Array | None) -> Array:
    """Return stress shapes of some places, (n, 6, n_q), without a copy if the places are all nodes.

    Parameters
    ----------
    field
        Stress of the kept nodes and then of the stress points over other coordinates than the modes; None: the modes.
    """
    nodes, points = places.nodes[rows], places.points[rows]
    if field is not None and len(field) not in (len(body.nodes), len(body.nodes) + point_number(body)):
        raise FatigueError(
            f"fatigue: stress: expected rows for {len(body.nodes)} kept nodes and the stress points after them, got "
            f"{len(field)}"
        )
    at_points = points != NONE
    if not at_points.any():
        shapes = body.stress if field is None else field[: len(body.nodes)]
        assert shapes is not None
        is_all = len(nodes) == len(shapes) and bool((nodes == np.arange(len(nodes))).all())
        return np.asarray(shapes if is_all else shapes[nodes])
    assert body.point_stress is not None
    of_points = body.point_stress.modes if field is None else field[len(body.nodes) :]
    if len(of_points) != point_number(body):
        raise FatigueError("fatigue: stress: rows for the stress points are missing")
    found = np.empty((len(nodes), 6, of_points.shape[2]))
    found[at_points] = of_points[points[at_points]]
    if not at_points.all():
        shapes = body.stress if field is None else field[: len(body.nodes)]
        assert shapes is not None
        found[~at_points] = shapes[nodes[~at_points]]
    return found


def frames_of_places(body: ReducedBody, places: Places, rows: IntArray, criterion: Criterion) -> Array | None:
    """Return the tangent planes of some places; None if the criterion does not need them."""
    return surface_frames(body, places.nodes[rows]) if criterion.needs_surface else None
