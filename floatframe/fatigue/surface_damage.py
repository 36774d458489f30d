"""Damage and life on the surface of a body, from histories or from spectra of its modal coordinates."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from cms.reduced_body.reduced_body import ReducedBody
from fe_models.foundation.arrays import Array, IntArray, frozen, frozen_int
from fe_models.foundation.copies import frozen_copies
from floatframe.errors import FatigueError
from floatframe.fatigue.criteria import Criterion
from floatframe.fatigue.history_damage import RESIDUES, Counted, Progress, count_histories
from floatframe.fatigue.load_blocks import LoadBlock
from floatframe.fatigue.mean_stress import NO_CORRECTION, MeanStress
from floatframe.fatigue.planes import surface_frames, surface_nodes
from floatframe.fatigue.sn_curve import SNCurve
from floatframe.fatigue.spectral.spectra import ModalSpectra
from floatframe.fatigue.spectral.spectral_damage import count_spectra

__all__ = ["FatigueResult", "history_damage", "spectral_damage"]

MOST_BEYOND = 0.01  #: share of damage from amplitudes beyond the S-N curve that spectra may have unasked


@frozen_copies
@dataclass(frozen=True, eq=False)
class FatigueResult:
    """Damage of one pass through a programme of loads at the surface nodes of a body. Life is 1 / damage passes."""

    body: ReducedBody
    nodes: IntArray  #: kept nodes, indices into `body.nodes`, (n,)
    block_names: tuple[str, ...]
    block_damage: Array  #: of each block with its repeats, (n_blocks, n); NaN where left out
    bound: Array  #: damage is at most this, (n,)
    is_counted: Array  #: bool, (n,); False: the bound shows that the node cannot matter
    cycles: Array  #: of the programme, (n,)
    beyond: Array  #: cycles beyond the S-N curve, (n,); of spectra: their share of the damage
    largest: Array  #: largest equivalent amplitude, (n,) [Pa]; of spectra: three standard deviations
    plane: IntArray  #: plane of greatest damage, (n,)
    curve: SNCurve
    criterion: Criterion
    mean_stress: MeanStress
    method: str  #: residue of rainflow counting, one of `RESIDUES`, or one of `SPECTRAL_METHODS`
    is_spectral: bool = False
    notes: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        for name in ("block_damage", "bound", "cycles", "beyond", "largest"):
            object.__setattr__(self, name, frozen(getattr(self, name)))
        for name in ("nodes", "plane"):
            object.__setattr__(self, name, frozen_int(getattr(self, name)))

    @property
    def method_words(self) -> str:
        """How cycles were counted, in words."""
        return f"spectral, {self.method}" if self.is_spectral else f"rainflow, residue: {RESIDUES[self.method]}"

    @property
    def damage(self) -> Array:
        """Damage of one pass through the programme, (n,); NaN where left out."""
        return np.asarray(self.block_damage.sum(axis=0))

    @property
    def damage_or_bound(self) -> Array:
        """Damage, and where a node was left out its bound, (n,)."""
        return np.asarray(np.where(self.is_counted, self.damage, self.bound))

    @property
    def life(self) -> Array:
        """Passes through the programme until the damage is 1, (n,); at left-out nodes at least this many."""
        with np.errstate(divide="ignore"):
            return np.asarray(1.0 / self.damage_or_bound)

    def worst(self, number: int = 1) -> IntArray:
        """Return places of the greatest damage in these arrays, worst first, (number,)."""
        damage = np.where(self.is_counted, self.damage, -1.0)
        order = np.argsort(-damage, kind="stable")[:number]
        return np.asarray(order[damage[order] >= 0])


def history_damage(
    body: ReducedBody,
    blocks: Sequence[LoadBlock],
    curve: SNCurve,
    *,
    criterion: Criterion = Criterion(),
    mean_stress: MeanStress = NO_CORRECTION,
    residue: str = "repeat",
    negligible: float = 1e-3,
    extrapolate: bool = False,
    nodes: IntArray | None = None,
    progress: Progress | None = None,
) -> FatigueResult:
    """Return the damage on the surface of a body by rainflow counting of modal stress histories.

    Parameters
    ----------
    curve
        In stress units of the body; amplitudes, not ranges.
    residue
        "repeat": a block follows itself without end; "half": what is left counts as half cycles (ASTM E1049).
    negligible
        Nodes whose damage is proved to be below this share of the greatest are left out; 0: none.
    extrapolate
        Whether cycles beyond the greatest amplitude of the curve are counted (and told); else they are refused.
    nodes
        Kept nodes to look at; None: all on the surface.

    Raises
    ------
    FatigueError
        If the body has no stress, blocks do not fit it, or stresses leave the curve or reach the strength.
    """
    chosen, frames = places(body, nodes, criterion)
    found = count_histories(
        stress_at(body, chosen), blocks, curve, criterion=criterion, mean_stress=mean_stress, residue=residue,
        frames=frames, negligible=negligible, progress=progress,
    )  # fmt: skip
    notes = [*sampling_notes(found, blocks), *curve.notes]
    worst = int(np.argmax(np.where(found.is_counted, found.largest, -1.0)))
    if not np.isfinite(found.largest[worst]):
        raise FatigueError(
            f"fatigue: {node_words(body, chosen[worst])}: the mean stress of a cycle is no less than the strength "
            f"{mean_stress.value:.6g} of {mean_stress.name}: it fails at once; check loads, units and the strength"
        )
    if (found.beyond > 0).any():
        n = int((found.beyond > 0).sum())
        words = (
            f"cycles of up to {found.largest[worst]:.6g} {body.units.stress_symbol} "
            f"({node_words(body, chosen[worst])}) at {n} nodes lie beyond the S-N curve, which is "
            f"known up to {curve.greatest:.6g}"
        )
        if not extrapolate:
            raise FatigueError(
                f"fatigue: {words}; check units and loads, give points of the curve at fewer cycles (or least_cycles), "
                "or say extrapolate = true to go on with its first slope"
            )
        notes.append(f"{words}; its first slope was continued")
    return result_of(body, chosen, [block.name for block in blocks], found, curve, criterion, mean_stress,
                     residue, is_spectral=False, notes=notes)  # fmt: skip


def spectral_damage(
    body: ReducedBody,
    spectra: Sequence[ModalSpectra],
    curve: SNCurve,
    *,
    method: str = "dirlik",
    criterion: Criterion = Criterion(),
    mean_stress: MeanStress = NO_CORRECTION,
    extrapolate: bool = False,
    nodes: IntArray | None = None,
    stress: Array | None = None,
    progress: Progress | None = None,
) -> FatigueResult:
    """Return the damage on the surface of a body by a spectral method; else as `history_damage`.

    Parameters
    ----------
    method
        One of `SPECTRAL_METHODS`.
    extrapolate
        Whether damage beyond the greatest amplitude of the curve may be more than a hundredth of all.
    stress
        Stress at the kept nodes in axes of B over the coordinates of the spectra, (n_kept, 6, n_q) [Pa per unit];
        None: of the modes of the body.
    """
    chosen, frames = places(body, nodes, criterion)
    found = count_spectra(
        stress_at(body, chosen, stress), spectra, curve, method=method, criterion=criterion, mean_stress=mean_stress,
        frames=frames, progress=progress,
    )  # fmt: skip
    notes = list(curve.notes)
    matters = found.total >= 1e-3 * found.total.max(initial=0.0)
    share = np.where(matters, found.beyond, 0.0)
    worst = int(np.argmax(share))
    if share[worst] > MOST_BEYOND:
        words = (
            f"{share[worst]:.1%} of the damage at {node_words(body, chosen[worst])} is of amplitudes beyond the S-N "
            f"curve, which is known up to {curve.greatest:.6g} {body.units.stress_symbol}"
        )
        if not extrapolate:
            raise FatigueError(
                f"fatigue: {words}; check units and spectra, give points of the curve at fewer cycles (or "
                "least_cycles), or say extrapolate = true to go on with its first slope"
            )
        notes.append(f"{words}; its first slope was continued")
    return result_of(body, chosen, [each.name for each in spectra], found, curve, criterion, mean_stress,
                     method, is_spectral=True, notes=notes)  # fmt: skip


def places(body: ReducedBody, nodes: IntArray | None, criterion: Criterion) -> tuple[IntArray, Array | None]:
    """Return the nodes to look at and their tangent planes, where the criterion needs them."""
    known = surface_nodes(body)
    chosen = known if nodes is None else np.asarray(nodes, dtype=np.int64)
    if chosen.ndim != 1 or not len(chosen):
        raise FatigueError("fatigue: nodes: expected one node at least")
    if chosen.min() < 0 or chosen.max() >= len(body.nodes):
        last = len(body.nodes) - 1
        raise FatigueError(f"fatigue: nodes: expected kept nodes 0 to {last}, got {chosen.min()} to {chosen.max()}")
    return chosen, surface_frames(body, chosen) if criterion.needs_surface else None


def stress_at(body: ReducedBody, nodes: IntArray, stress: Array | None = None) -> Array:
    """Return stress shapes of nodes, those of the modes unless others are given; without a copy where they are all."""
    shapes = body.stress if stress is None else stress
    assert shapes is not None
    if len(shapes) != len(body.nodes):
        raise FatigueError(f"fatigue: stress: expected rows for {len(body.nodes)} kept nodes, got {len(shapes)}")
    is_all = len(nodes) == len(body.nodes) and bool((nodes == np.arange(len(nodes))).all())
    return np.asarray(shapes if is_all else shapes[nodes])


def node_words(body: ReducedBody, node: int) -> str:
    """Return a node and its place in words."""
    x, y, z = body.frame.origin + body.frame.axes @ body.nodes[node]
    return f"node {body.node_name(int(node))} at ({x:.6g}, {y:.6g}, {z:.6g})"


def sampling_notes(found: Counted, blocks: Sequence[LoadBlock]) -> list[str]:
    """Return a note if the worst place has few output times a cycle: peaks between them are missed."""
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
    body: ReducedBody, nodes: IntArray, names: Sequence[str], found: Counted, curve: SNCurve, criterion: Criterion,
    mean_stress: MeanStress, method: str, *, is_spectral: bool, notes: Sequence[str],
) -> FatigueResult:  # fmt: skip
    """Return the result for a body."""
    return FatigueResult(
        body, nodes, tuple(names), found.damage, found.bound, found.is_counted, found.cycles, found.beyond,
        found.largest, found.plane, curve, criterion, mean_stress, method, is_spectral, tuple(notes),
    )  # fmt: skip
