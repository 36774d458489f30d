"""Damage from modal histories: stresses of a few nodes and times are computed and counted without being stored.

sigma(x, t) = sum_k S_k(x) q_k(t) is never stored: the stress shapes of a tile of nodes are multiplied by a chunk of the
history, the criterion makes the product a scalar, and the four-point rule counts its cycles. Nodes are counted in the
order of their bounds, the largest first, until no remaining node can reach the share `negligible` of the largest damage
found.
"""

import os
from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from typing import Any

import numpy as np

from fe_models.foundation.arrays import Array, IntArray
from floatframe.durability.fatigue.criteria import Criterion, largest_size
from floatframe.durability.fatigue.load_blocks import LoadBlock
from floatframe.durability.fatigue.mean_stress import NO_CORRECTION, MeanStress
from floatframe.durability.fatigue.sn_curve import SNCurve
from floatframe.errors import FatigueError

__all__ = [
    "RESIDUES",
    "Counted",
    "Envelope",
    "Progress",
    "count_histories",
    "damage_bounds",
    "envelope",
    "stress_bounds",
]


# bounds ---------------------------------------------------------------------------------------------------------------
# Upper bounds of the damage of a node from its stress shapes and the modal history, to find nodes with negligible
# damage.
#
# With q(t) = L z(t), L L.T = C any positive definite matrix, rho(t) = |z(t)| and the stress sigma = S q in a Euclidean
# norm |A sigma|,
#
#     |A sigma(t)| <= lam rho(t),  lam = largest singular value of A S L.          (1)
#
# Every cycle has two turning points s_i, s_j. For each mean stress law, the equivalent amplitude at R = -1 is at most
# max(|s_i|, |s_j|) if this is below the strength of the law. Every value of the history is a turning point of at most
# one cycle (or of two half cycles in the residue), and the damage d grows with the amplitude, so that
#
#     D <= sum_t d(c lam rho(t)),  |s(t)| <= c |A sigma(t)|,                        (2)
#
# which is a function of lam alone; it is tabulated once for each history and rounded upwards. Findley's parameter takes
# its normal stress from another time than its shear, so that D <= n_t d(c lam max rho). C is chosen so that sum rho^k
# is small for the slope k of the curve: C ~ sum rho^(k-2) q q.T, iterated from the covariance. A second bound of the
# same kind, with the norm of each shape,
#
#     |A sigma(t)| <= sum_k |A S_k| max |q_k|,  D <= n_t d(c of that),              (3)
#
# is used if it is smaller.


ROUNDING = 1.0 + 1e-9  #: factor by which all bounds are rounded upwards
ROUNDS = 6  #: number of iterations for C
BINS, LEVELS = 2000, 1500  #: number of classes of rho and of lam
FLOOR = 1e-9  #: smallest standard deviation of C, relative to the largest
CHUNK_SIZE = 20_000  #: number of nodes processed at a time


@dataclass(frozen=True, eq=False)
class Envelope:
    """An ellipsoid q.T C^-1 q = rho² about the modal history of a block, with the frequency of each rho."""

    L: Array  #: Cholesky factor of C = L L.T, (n_q, n_q)
    rho: Array  #: upper limits of the classes of rho, (n_bins,)
    counts: Array  #: number of times in each class, (n_bins,)
    largest_q: Array  #: largest absolute value of each coordinate, max |q_k|, (n_q,)
    n_times: int


def envelope(block: LoadBlock, slope: float) -> Envelope:
    """Return the envelope of a block for a curve with a slope; it includes the scale of the block."""
    q = block.scale * np.asarray(block.q)
    weights = np.ones(len(q))
    L = rho = np.zeros(0)
    for _ in range(ROUNDS):
        _, sizes, Vt = np.linalg.svd(weights[:, None] * q / np.sqrt((weights**2).sum()), full_matrices=False)
        sizes, V = full_basis(sizes, Vt)
        deviations = np.maximum(sizes, max(FLOOR * sizes[0], np.finfo(float).tiny ** 0.5))
        L = V * deviations
        rho = np.linalg.norm(q @ V / deviations, axis=1)
        weights = np.maximum(rho, 1e-3 * rho.max(initial=0.0)) ** (0.5 * min(max(slope - 2, 0.0), 10.0))
        if not weights.any():
            break
    top = float(rho.max(initial=0.0)) * ROUNDING
    if top == 0:
        return Envelope(L, np.ones(1), np.array([float(len(q))]), np.abs(q).max(axis=0), len(q))
    edges = np.r_[np.geomspace(1e-3 * top, top, BINS)]
    which = np.minimum(np.searchsorted(edges, rho * ROUNDING), BINS - 1)
    counts = np.bincount(which, minlength=BINS).astype(float)
    return Envelope(L, edges, counts, np.abs(q).max(axis=0), len(q))


def full_basis(sizes: Array, Vt: Array) -> tuple[Array, Array]:
    """Return as many singular values and vectors (columns) as coordinates, also if a history has fewer rows."""
    n = Vt.shape[1]
    if len(Vt) == n:
        return sizes, Vt.T
    V = np.linalg.qr(np.c_[Vt.T, np.eye(n)])[0][:, :n]
    return np.r_[sizes, np.zeros(n - len(sizes))], V


def stress_bounds(stress: Array, found: Envelope, criterion: Criterion) -> tuple[Array, Array]:
    """Return lam of (1) and the sum in (3) for stress shapes (n, 6, n_q), each times c, (n,) [Pa]."""
    A, c = criterion.norm_root(), criterion.bound_factor
    lam, total = np.zeros(len(stress)), np.zeros(len(stress))
    for first in range(0, len(stress), CHUNK_SIZE):
        part = slice(first, first + CHUNK_SIZE)
        rows = A @ np.asarray(stress[part])
        lam[part] = largest_size(rows @ found.L)
        total[part] = np.linalg.norm(rows, axis=1) @ found.largest_q
    # the rounding error of the Gram matrix is proportional to its largest entry
    return c * lam * (1 + 1e-6), c * total * ROUNDING


def damage_bounds(
    lam: Array, total: Array, found: Envelope, criterion: Criterion, curve: SNCurve, mean_stress: MeanStress
) -> Array:
    """Return an upper bound of the damage of one pass of a block, (n,), from the stress bounds of its nodes."""
    from floatframe.durability.fatigue.kernels.cycle_kernels import cycle_rule, sums_of_reversals

    rule, one = cycle_rule(curve, mean_stress), np.ones(1)
    of_sizes = np.zeros(len(total))
    sums_of_reversals(rule, total, one, found.n_times * one, of_sizes)
    high, low = float(lam.max(initial=0.0)), float(lam.min(where=lam > 0, initial=np.inf))
    if high == 0:
        return np.zeros(len(lam))
    levels = np.unique(lam[lam > 0]) if len(lam) <= LEVELS else np.geomspace(low, high, LEVELS) * ROUNDING
    at_levels = np.zeros(len(levels))
    if criterion.name == "findley":
        sums_of_reversals(rule, levels, found.rho[-1:], found.n_times * one, at_levels)
    else:
        filled = np.flatnonzero(found.counts)[::-1]  # the largest first: it decides whether the strength is reached
        sums_of_reversals(rule, levels, found.rho[filled], found.counts[filled], at_levels)
    which = np.minimum(np.searchsorted(levels, lam), len(levels) - 1)
    return np.where(lam > 0, np.minimum(at_levels[which], of_sizes), 0.0)


# history damage -------------------------------------------------------------------------------------------------------


#: treatment of the residue of a block, by name
RESIDUES = {
    "half": "its ranges count as half cycles (ASTM E1049)",
    "repeat": "the block is repeated endlessly: all cycles are whole",
}
TILE = 32  #: number of nodes processed at once; fewer for criteria with more than six rows
CHUNK = 1024  #: number of times processed at once
FIRST_BATCH, LAST_BATCH = 64, 8192  #: number of nodes between two checks of the bounds; it doubles each time

Progress = Callable[[float], None]


@dataclass(frozen=True, eq=False)
class Counted:
    """Damage of places from histories, with one row per place, for one pass through the programme."""

    damage: Array  #: damage of each block with its repeats, (n_blocks, n); NaN at excluded places
    bound: Array  #: upper bound of the total damage, (n,)
    is_counted: Array  #: whether the place was counted, (n,)
    cycles: Array  #: number of cycles in the programme, (n,)
    beyond: Array  #: number of cycles beyond the largest amplitude of the curve, (n,)
    largest: Array  #: largest equivalent amplitude, (n,) [Pa]
    plane: IntArray  #: critical plane, (n,); 0 for other criteria

    @property
    def total(self) -> Array:
        """Damage of the programme, (n,); NaN at excluded places."""
        return np.asarray(self.damage.sum(axis=0))


def count_histories(
    stress: Array,
    blocks: Sequence[LoadBlock],
    curve: SNCurve,
    *,
    criterion: Criterion = Criterion(),
    mean_stress: MeanStress = NO_CORRECTION,
    residue: str = "repeat",
    frames: Array | None = None,
    negligible: float = 1e-3,
    greatest: float = 0.0,
    workers: int | None = None,
    progress: Progress | None = None,
) -> Counted:
    """Return the damage of places with stress shapes (n, 6, n_q) [Pa per unit of q].

    Parameters
    ----------
    blocks
        Histories with repeats; nothing is counted between one block and the next.
    residue
        One of `RESIDUES`.
    frames
        Tangents and normal of each place, (n, 3, 3), if the criterion needs them (`surface_frames`).
    negligible
        Places whose damage is proved to be below this share of the largest damage are excluded; 0: none.
    greatest
        Largest damage found at other places before.
    workers
        Number of threads; None: one per processor.

    Raises
    ------
    FatigueError
        If blocks and shapes do not fit, or the criterion does not support the correction.
    """
    check(stress, blocks, criterion, mean_stress, residue, negligible)
    n = len(stress)
    bound = np.zeros(n)
    for block in blocks:
        found = envelope(block, float(curve.slope.max()))
        lam, total = stress_bounds(stress, found, criterion)
        bound += block.repeats * damage_bounds(lam, total, found, criterion, curve, mean_stress)
    order = np.argsort(-bound, kind="stable")
    result = Counted(
        np.full((len(blocks), n), np.nan), bound, np.zeros(n, bool), np.zeros(n), np.zeros(n), np.zeros(n),
        np.zeros(n, np.int64),
    )  # fmt: skip
    histories = [np.ascontiguousarray(block.scale * np.asarray(block.q).T) for block in blocks]
    rule = Rule(curve, mean_stress, criterion, residue, tuple(block.repeats for block in blocks))
    size = max(1, TILE * 6 // criterion.n_rows())

    def run(tile: IntArray) -> None:
        count_tile(np.ascontiguousarray(stress[tile]), None if frames is None else frames[tile], histories, rule,
                   result, tile)  # fmt: skip

    with single_threaded_products(), ThreadPoolExecutor(workers or os.cpu_count() or 1) as pool:
        first, step = 0, FIRST_BATCH
        while first < n:
            batch = order[first : first + step]
            first, step = first + step, min(2 * step, LAST_BATCH)
            batch = batch[(bound[batch] > 0) & (bound[batch] >= negligible * greatest)]
            if not len(batch):
                break
            batch = np.sort(batch)
            list(pool.map(run, [batch[k : k + size] for k in range(0, len(batch), size)]))
            greatest = max(greatest, float(result.total[batch].max()))
            if progress is not None:
                progress(min(1.0, first / n))
    is_zero = bound == 0  # proved to be zero
    result.damage[:, is_zero] = 0.0
    return result


def check(
    stress: Array, blocks: Sequence[LoadBlock], criterion: Criterion, mean_stress: MeanStress, residue: str,
    negligible: float,
) -> None:  # fmt: skip
    """Raise `FatigueError` unless the inputs agree with each other."""
    if not blocks:
        raise FatigueError("fatigue: expected one load block at least")
    if stress.ndim != 3 or stress.shape[1] != 6:
        raise FatigueError(f"fatigue: stress shapes: expected (n, 6, n_q), got {stress.shape}")
    if residue not in RESIDUES:
        from fe_models.foundation.words import nearest, quoted

        raise FatigueError(f"fatigue: residue: unknown {quoted(residue)}{nearest(residue, RESIDUES)}")
    if not 0 <= negligible < 1:
        raise FatigueError(f"fatigue: negligible: expected a share from 0 to below 1, got {negligible:g}")
    if criterion.is_shear and mean_stress.name != "none":
        raise FatigueError(
            f'fatigue: criterion "{criterion.name}" with mean stress "{mean_stress.name}": shear does not distinguish '
            'tension from compression, and findley contains the normal stress; take mean stress "none"'
        )
    for block in blocks:
        if block.q.shape[1] != stress.shape[2]:
            raise FatigueError(
                f"load block {block.name!r}: {block.q.shape[1]} modal coordinates, but stress shapes of "
                f"{stress.shape[2]}; give the body of the run"
            )


@dataclass(frozen=True)
class Rule:
    """All settings that determine the damage of a history."""

    curve: SNCurve
    mean_stress: MeanStress
    criterion: Criterion
    residue: str
    repeats: tuple[float, ...]


def count_tile(
    stress: Array, frames: Array | None, histories: Sequence[Array], rule: Rule, result: Counted, tile: IntArray
) -> None:
    """Count all blocks for a few places, and store the critical plane in the result."""
    criterion = rule.criterion
    rows = np.ascontiguousarray(criterion.rows(stress, frames))
    sums = [count_block(rows, q, rule) for q in histories]
    damage = np.stack([repeats * each[0] for repeats, each in zip(rule.repeats, sums, strict=True)])  # block, n, plane
    worst = np.argmax(damage.sum(axis=0), axis=1)
    at = np.arange(len(tile)), worst
    result.damage[:, tile] = damage[:, *at]
    counts = sum(repeats * each[1][at] for repeats, each in zip(rule.repeats, sums, strict=True))
    result.cycles[tile], result.beyond[tile] = counts[:, 0], counts[:, 1]
    result.largest[tile] = np.max([each[2][at] for each in sums], axis=0)
    result.plane[tile] = worst
    result.is_counted[tile] = True


def count_block(rows: Array, q: Array, rule: Rule) -> tuple[Array, Array, Array]:
    """Return damage (n, n_planes), counts (n, n_planes, 2) and largest amplitudes for one pass of a history."""
    from floatframe.durability.fatigue.kernels.cycle_kernels import close_block, cycle_rule, finish_block, push_block

    if rule.criterion.is_shear:
        return count_shear(rows, q, rule)
    scalar, kernel_rule = rule.criterion.scalar(), cycle_rule(rule.curve, rule.mean_stress)
    n, n_rows, n_q = rows.shape
    n_planes = 1 if scalar is not None else n_rows
    m = n * n_planes
    damage, counts, largest = np.zeros(m), np.zeros((m, 2)), np.zeros(m)
    depths = np.zeros(m, np.int64)
    stack = np.empty((m, CHUNK + 64))
    values, flat = np.empty((n, CHUNK)), rows.reshape(-1, n_q)
    room = np.empty(len(flat) * CHUNK)  # reused buffer: allocating memory of this size costs more than the product
    for first in range(0, q.shape[1], CHUNK):
        chunk = q[:, first : first + CHUNK]
        width = chunk.shape[1]
        components = np.matmul(flat, chunk, out=room[: len(flat) * width].reshape(len(flat), width))
        if scalar is not None:
            scalar(components.reshape(n, n_rows, width), values)
            components = values[:, :width]
        stack = wide_enough(stack, int(depths.max(initial=0)) + width + 2)
        closed = np.empty((stack.shape[1], 2))
        push_block(kernel_rule, components, stack, depths, closed, damage, counts, largest)
    if rule.residue == "half":
        finish_block(kernel_rule, stack, depths, damage, counts, largest)
    else:
        stack = wide_enough(stack, 2 * int(depths.max(initial=0)) + 2)
        close_block(kernel_rule, stack, depths, np.empty((stack.shape[1], 2)), damage, counts, largest)
    shape = (n, n_planes)
    return damage.reshape(shape), counts.reshape(*shape, 2), largest.reshape(shape)


def count_shear(rows: Array, q: Array, rule: Rule) -> tuple[Array, Array, Array]:
    """Return the results of `count_block` for cycles of shear stress with their normal stress."""
    from floatframe.durability.fatigue.kernels.cycle_kernels import cycle_rule
    from floatframe.durability.fatigue.kernels.findley_kernels import close_findley, finish_findley, push_findley

    kernel_rule, k = cycle_rule(rule.curve, rule.mean_stress), float(rule.criterion.k)
    n, n_rows, _ = rows.shape
    half = n_rows // 2
    m = n * half
    shear, normal = (np.ascontiguousarray(part).reshape(m, -1) for part in (rows[:, :half], rows[:, half:]))
    damage, counts, largest = np.zeros(m), np.zeros((m, 2)), np.zeros(m)
    depths = np.zeros(m, np.int64)
    stack, most = np.empty((m, CHUNK + 64)), np.empty((m, CHUNK + 64))
    for first in range(0, q.shape[1], CHUNK):
        chunk = q[:, first : first + CHUNK]
        needed = int(depths.max(initial=0)) + chunk.shape[1] + 2
        stack, most = wide_enough(stack, needed), wide_enough(most, needed)
        push_findley(kernel_rule, k, shear @ chunk, normal @ chunk, stack, most, depths, damage, counts, largest)
    if rule.residue == "half":
        finish_findley(kernel_rule, k, stack, most, depths, damage, counts, largest)
    else:
        needed = 2 * int(depths.max(initial=0)) + 2
        stack, most = wide_enough(stack, needed), wide_enough(most, needed)
        close_findley(kernel_rule, k, stack, most, depths, damage, counts, largest)
    shape = (n, half)
    return damage.reshape(shape), counts.reshape(*shape, 2), largest.reshape(shape)


def wide_enough(stack: Array, width: int) -> Array:
    """Return a stack with at least the given width."""
    if stack.shape[1] >= width:
        return stack
    wider = np.empty((len(stack), 2 * width))
    wider[:, : stack.shape[1]] = stack
    return wider


def single_threaded_products() -> Any:
    """Return the context in which each thread computes matrix products by itself."""
    from threadpoolctl import threadpool_limits

    return threadpool_limits(1)
