"""Damage and life of the places of a body, from histories or spectra of its modal coordinates.

Places are the nodes of its surface and its stress points, each with its material. Materials are counted one after the
other; the largest damage found so far determines which places of the next material are negligible.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from cms.body.reduced_body import ReducedBody
from fe_models.foundation.arrays import Array, IntArray, frozen
from fe_models.foundation.presentation import presented
from fe_models.foundation.records import checked_fields, frozen_copies
from fe_models.meshes.numbering import NONE
from floatframe.durability.fatigue.criteria import Criterion
from floatframe.durability.fatigue.history_damage import RESIDUES, Counted, Progress, count_histories
from floatframe.durability.fatigue.load_blocks import LoadBlock
from floatframe.durability.fatigue.mean_stress import NO_CORRECTION, MeanStress
from floatframe.durability.fatigue.places import (
    FatigueMaterial,
    Places,
    assessed_places,
    frames_of_places,
    stress_of_places,
)
from floatframe.durability.fatigue.sn_curve import SNCurve
from floatframe.durability.fatigue.spectral.spectra import ModalSpectra
from floatframe.durability.fatigue.spectral.spectral_damage import count_spectra
from floatframe.errors import FatigueError, ModelError

__all__ = ["FatigueResult", "history_damage", "spectral_damage"]

#: largest fraction of damage beyond the S-N curve that is accepted for spectra without `extrapolate`
MOST_BEYOND = 0.01


@presented
@frozen_copies
@dataclass(frozen=True, eq=False)
@checked_fields(ModelError)
class FatigueResult:
    """Damage at places of a body for one pass through a load programme; the life is 1 / damage passes.

    Parameters
    ----------
    body
        The reduced body.
    nodes
        Kept node of each place, index into `body.nodes`, -1 at a stress point, (n,).
    points
        Row of the stress points of the body, -1 at a node, (n,).
    material
        Index of its material in `materials`, (n,).
    block_names
        Names of the load blocks, (n_blocks,).
    block_damage
        Damage of each block with its repeats, (n_blocks, n); NaN at excluded places.
    bound
        Upper bound of the damage, (n,).
    is_counted
        Whether the place was counted, (n,); if not, its bound is negligible.
    cycles
        Number of cycles in the programme, (n,).
    beyond
        Number of cycles beyond the S-N curve, (n,); for spectra, their fraction of the damage.
    largest
        Largest equivalent amplitude, (n,) [Pa]; for spectra, three standard deviations.
    plane
        Critical plane, (n,).
    materials
        The materials.
    criterion
        The multiaxial criterion.
    method
        Residue of rainflow counting, one of `RESIDUES`, or one of `SPECTRAL_METHODS`.
    is_spectral
        Whether the damage follows from spectra.
    notes
        Notes for the report.
    """

    body: ReducedBody
    nodes: IntArray
    points: IntArray
    material: IntArray
    block_names: tuple[str, ...]
    block_damage: Array
    bound: Array
    is_counted: Array
    cycles: Array
    beyond: Array
    largest: Array
    plane: IntArray
    materials: tuple[FatigueMaterial, ...]
    criterion: Criterion
    method: str
    is_spectral: bool = False
    notes: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        for name in ("block_damage", "bound", "cycles", "beyond", "largest"):
            object.__setattr__(self, name, frozen(getattr(self, name)))
        for name in ("nodes", "points", "material", "plane"):
            object.__setattr__(self, name, frozen(getattr(self, name), np.int64))

    @property
    def curve(self) -> SNCurve:
        """S-N curve of the first material."""
        return self.materials[0].curve

    @property
    def mean_stress(self) -> MeanStress:
        """Mean stress correction of the first material."""
        return self.materials[0].mean_stress

    def name(self, place: int) -> str:
        """Return the name of a place: the number of a node, or the name of a stress point."""
        return name_of(self.body, int(self.nodes[place]), int(self.points[place]))

    def description(self, place: int) -> str:
        """Return the description of a place: "node 17", "beam 3 end A point 0"."""
        return f"node {self.name(place)}" if self.nodes[place] != NONE else self.name(place)

    def positions(self, places: IntArray) -> Array:
        """Return undeformed positions of places in mesh coordinates, (n, 3) [m]."""
        return positions_of(self.body, self.nodes[places], self.points[places])

    @property
    def method_words(self) -> str:
        """Description of the counting method."""
        return f"spectral, {self.method}" if self.is_spectral else f"rainflow, residue: {RESIDUES[self.method]}"

    @property
    def damage(self) -> Array:
        """Damage for one pass through the programme, (n,); NaN at excluded places."""
        return np.asarray(self.block_damage.sum(axis=0))

    @property
    def damage_or_bound(self) -> Array:
        """Damage, or its bound at excluded places, (n,)."""
        return np.asarray(np.where(self.is_counted, self.damage, self.bound))

    @property
    def life(self) -> Array:
        """Passes through the programme until the damage is 1, (n,); a lower bound at excluded places."""
        with np.errstate(divide="ignore"):
            return np.asarray(1.0 / self.damage_or_bound)

    def worst(self, number: int = 1) -> IntArray:
        """Return the indices of the places with the largest damage, worst first, (number,)."""
        damage = np.where(self.is_counted, self.damage, -1.0)
        order = np.argsort(-damage, kind="stable")[:number]
        return np.asarray(order[damage[order] >= 0])


def history_damage(
    body: ReducedBody,
    blocks: Sequence[LoadBlock],
    curve: SNCurve | None,
    *,
    others: Sequence[FatigueMaterial] = (),
    criterion: Criterion = Criterion(),
    mean_stress: MeanStress = NO_CORRECTION,
    residue: str = "repeat",
    negligible: float = 1e-3,
    extrapolate: bool = False,
    nodes: IntArray | None = None,
    points: IntArray | None = None,
    progress: Progress | None = None,
) -> FatigueResult:
    """Return the damage of places of a body by rainflow counting of modal stress histories.

    Parameters
    ----------
    body
        The reduced body, with the stress of its modes.
    blocks
        Modal histories of the body, each with its repeats.
    curve
        S-N curve in stress units of the body; amplitudes, not ranges. None: only places named by `others` are assessed.
    others
        Materials that replace `curve` and `mean_stress` at the places that they name; a material without places
        applies to all other places.
    criterion
        Scalar that is counted at a place, from the stress there.
    mean_stress
        Correction for the mean stress of a cycle.
    residue
        "repeat": each block is repeated endlessly; "half": the residue counts as half cycles (ASTM E1049).
    negligible
        Places whose damage is proved to be below this share of the largest damage are excluded; 0: none.
    extrapolate
        Whether cycles beyond the largest amplitude of the curve are counted, with a note; otherwise they are refused.
    nodes
        Kept nodes to assess; None: all on the surface.
    points
        Stress points to assess; None: all, or none if `nodes` are given.
    progress
        Called with the fraction of the work done, 0 to 1.

    Raises
    ------
    FatigueError
        If the body has no stress, blocks do not fit the body, or stresses are beyond the curve or reach the strength.
    """
    materials = all_materials(curve, mean_stress, others)
    places = assessed_places(body, materials, nodes, points, criterion)

    def of(material: FatigueMaterial, rows: IntArray, floor: float) -> Counted:
        return count_histories(
            stress_of_places(body, places, rows, None), blocks, material.curve, criterion=criterion,
            mean_stress=material.mean_stress, residue=residue, negligible=negligible, greatest=floor,
            frames=frames_of_places(body, places, rows, criterion), progress=progress,
        )  # fmt: skip

    found = by_material(places, materials, len(blocks), of)
    notes = sampling_notes(found, blocks)
    for material, rows in rows_by_material(places, materials):
        notes += [f"{of_material(material)}{note}" for note in material.curve.notes]
        worst = int(rows[np.argmax(np.where(found.is_counted[rows], found.largest[rows], -1.0))])
        if not np.isfinite(found.largest[worst]):
            law = material.mean_stress
            raise FatigueError(
                f"fatigue: {place_words(body, places, worst)}: the mean stress of a cycle is no less than the strength "
                f"{law.value:.6g} of {law.name}: it fails at once; check loads, units and the strength"
            )
        if (found.beyond[rows] > 0).any():
            n = int((found.beyond[rows] > 0).sum())
            words = (
                f"cycles of up to {found.largest[worst]:.6g} {body.units.stress_symbol} "
                f"({place_words(body, places, worst)}) at {n} {what_places(places)} lie beyond the S-N curve"
                f"{' of ' + material.name if material.name else ''}, which is known up to {material.curve.greatest:.6g}"
            )
            if not extrapolate:
                raise FatigueError(
                    f"fatigue: {words}; check units and loads, give points of the curve at fewer cycles (or "
                    "least_cycles), or say extrapolate = true to go on with its first slope"
                )
            notes.append(f"{words}; its first slope was continued")
    names = [block.name for block in blocks]
    return result_of(body, places, names, found, materials, criterion, residue, is_spectral=False, notes=notes)


def spectral_damage(
    body: ReducedBody,
    spectra: Sequence[ModalSpectra],
    curve: SNCurve | None,
    *,
    others: Sequence[FatigueMaterial] = (),
    method: str = "dirlik",
    criterion: Criterion = Criterion(),
    mean_stress: MeanStress = NO_CORRECTION,
    extrapolate: bool = False,
    nodes: IntArray | None = None,
    points: IntArray | None = None,
    stress: Array | None = None,
    progress: Progress | None = None,
) -> FatigueResult:
    """Return the damage of places of a body by a spectral method.

    Parameters
    ----------
    body
        The reduced body, with the stress of its modes.
    spectra
        Cross spectra of its modal coordinates, each with its duration.
    curve
        As for `history_damage`.
    others
        As for `history_damage`.
    method
        One of `SPECTRAL_METHODS`.
    criterion
        Scalar that is counted at a place, from the stress there.
    mean_stress
        Correction for the static mean stress.
    extrapolate
        Whether the damage beyond the largest amplitude of the curve may exceed a hundredth of the total.
    nodes
        Kept nodes to assess; None: all on the surface.
    points
        Stress points to assess; None: all, or none if `nodes` are given.
    stress
        Stress at the kept nodes, then at the assessed stress points, in axes of B for the coordinates of the spectra,
        (n, 6, n_q) [Pa per unit]; None: stress of the modes of the body.
    progress
        Called with the fraction of the work done, 0 to 1.
    """
    materials = all_materials(curve, mean_stress, others)
    places = assessed_places(body, materials, nodes, points, criterion)

    def of(material: FatigueMaterial, rows: IntArray, _: float) -> Counted:
        return count_spectra(
            stress_of_places(body, places, rows, stress), spectra, material.curve, method=method, criterion=criterion,
            mean_stress=material.mean_stress, frames=frames_of_places(body, places, rows, criterion),
            progress=progress,
        )  # fmt: skip

    found = by_material(places, materials, len(spectra), of)
    notes = []
    matters = found.total >= 1e-3 * found.total.max(initial=0.0)
    for material, rows in rows_by_material(places, materials):
        notes += [f"{of_material(material)}{note}" for note in material.curve.notes]
        share = np.where(matters[rows], found.beyond[rows], 0.0)
        worst = int(rows[np.argmax(share)])
        if share.max() > MOST_BEYOND:
            words = (
                f"{share.max():.1%} of the damage at {place_words(body, places, worst)} has amplitudes beyond the "
                f"S-N curve, which is known up to {material.curve.greatest:.6g} {body.units.stress_symbol}"
            )
            if not extrapolate:
                raise FatigueError(
                    f"fatigue: {words}; check units and spectra, give points of the curve at fewer cycles (or "
                    "least_cycles), or say extrapolate = true to go on with its first slope"
                )
            notes.append(f"{words}; its first slope was continued")
    names = [each.name for each in spectra]
    return result_of(body, places, names, found, materials, criterion, method, is_spectral=True, notes=notes)


def all_materials(
    curve: SNCurve | None, mean_stress: MeanStress, others: Sequence[FatigueMaterial]
) -> tuple[FatigueMaterial, ...]:
    """Return all materials, first the one for places that no other material names."""
    if curve is None and not others:
        raise FatigueError("fatigue: expected an S-N curve, or others: materials that name their places")
    return (*(() if curve is None else (FatigueMaterial(curve, mean_stress),)), *others)


def rows_by_material(places: Places, materials: Sequence[FatigueMaterial]) -> list[tuple[FatigueMaterial, IntArray]]:
    """Return each material that has places, with the rows of its places."""
    rows = [np.flatnonzero(places.material == number) for number in range(len(materials))]
    return [(material, own) for material, own in zip(materials, rows, strict=True) if len(own)]


def by_material(
    places: Places, materials: Sequence[FatigueMaterial], n_blocks: int,
    of: Callable[[FatigueMaterial, IntArray, float], Counted],
) -> Counted:  # fmt: skip
    """Count places one material after the other, and return the results of all places."""
    parts = []
    greatest = 0.0
    for material, rows in rows_by_material(places, materials):
        part = of(material, rows, greatest)
        greatest = max(greatest, float(np.max(part.total[part.is_counted], initial=0.0)))
        parts.append(part)
    if len(parts) == 1:
        return parts[0]
    return Counted(
        np.concatenate([part.damage for part in parts], axis=1).reshape(n_blocks, -1),
        *(np.concatenate([getattr(part, name) for part in parts])
          for name in ("bound", "is_counted", "cycles", "beyond", "largest", "plane")),
    )  # fmt: skip


def of_material(material: FatigueMaterial) -> str:
    """Return the prefix of a note: the name of the material, or nothing if there is only one."""
    return f"{material.name}: " if material.name else ""


def name_of(body: ReducedBody, node: int, point: int) -> str:
    """Return the name of a node or a stress point."""
    if node != NONE:
        return body.node_name(node)
    assert body.point_stress is not None
    return body.point_stress.names[point]


def positions_of(body: ReducedBody, nodes: IntArray, points: IntArray) -> Array:
    """Return undeformed positions of nodes and stress points in mesh coordinates, (n, 3) [m]."""
    at = np.where((nodes != NONE)[:, None], body.nodes[nodes], 0.0)
    at_points = points != NONE
    if at_points.any():
        assert body.point_stress is not None
        at[at_points] = body.point_stress.positions[points[at_points]]
    return np.asarray(body.frame.origin + at @ body.frame.axes.T)


def place_words(body: ReducedBody, places: Places, k: int) -> str:
    """Return a place and its position as text."""
    at = slice(k, k + 1)
    x, y, z = positions_of(body, places.nodes[at], places.points[at])[0]
    name = name_of(body, int(places.nodes[k]), int(places.points[k]))
    word = "node " if places.nodes[k] != NONE else ""
    return f"{word}{name} at ({x:.6g}, {y:.6g}, {z:.6g})"


def what_places(places: Places) -> str:
    """Return the kind of the places as text: nodes, points, or both."""
    words = [word for word, has in (("nodes", (places.nodes != NONE).any()), ("points", (places.points != NONE).any()))
             if has]  # fmt: skip
    return " and ".join(words)


def sampling_notes(found: Counted, blocks: Sequence[LoadBlock]) -> list[str]:
    """Return a note if the worst place has few output times per cycle, so that peaks between them are missed."""
    if not found.is_counted.any():
        return []
    worst = int(np.nanargmax(np.where(found.is_counted, found.total, -1.0)))
    times = sum(block.repeats * len(block.q) for block in blocks)
    a_cycle = times / max(found.cycles[worst], 1e-300)
    if a_cycle >= 10:
        return []
    return [
        f"the worst place has {a_cycle:.1f} output times a cycle: peaks between them are missed, by up to "
        f"{1 - np.cos(np.pi / max(a_cycle, 2.0)):.0%} of a sine; write results more often (output_every)"
    ]


def result_of(
    body: ReducedBody, places: Places, names: Sequence[str], found: Counted, materials: tuple[FatigueMaterial, ...],
    criterion: Criterion, method: str, *, is_spectral: bool, notes: Sequence[str],
) -> FatigueResult:  # fmt: skip
    """Return the result for a body."""
    told = list(notes)
    if places.n_left_out:
        told.append(f"{places.n_left_out} {what_places(places)} were not assessed: no material names them")
    if (places.points != NONE).any() and "stress points" in body.provenance:
        told.append(f"stress points: {body.provenance['stress points']}")
    return FatigueResult(
        body, places.nodes, places.points, places.material, tuple(names), found.damage, found.bound, found.is_counted,
        found.cycles, found.beyond, found.largest, found.plane, materials, criterion, method, is_spectral, tuple(told),
    )  # fmt: skip
