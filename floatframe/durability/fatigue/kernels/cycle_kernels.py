"""Compiled functions: cycles of streamed histories by the four-point rule, and the damage of each cycle.

The four-point rule: of four successive turning points x1 x2 x3 x4, the inner two are a closed cycle if their range is
not larger than either of the adjacent ranges. They are removed, and the rule continues with the other points. The
residue at the end first widens and then narrows. Its ranges count as half cycles, which gives the counts of ASTM
E1049-85 (rainflow); or the residue is appended to itself once, which gives the counts of an endlessly repeated history.

The residue of a node is kept from chunk to chunk in a stack whose top is the last turning point. The top moves while
the history continues in the same direction, so that cycles close as soon as the history passes them.
"""

from typing import NamedTuple

import numpy as np

from fe_models.foundation.arrays import Array
from fe_models.foundation.kernels.jit import jit
from floatframe.durability.fatigue.mean_stress import FKM, GERBER, LINE, NONE, SWT, WALKER, MeanStress
from floatframe.durability.fatigue.sn_curve import SNCurve

__all__ = [
    "CLOSED",
    "OVER",
    "CycleRule",
    "close_block",
    "collect",
    "cycle_rule",
    "equivalent_amplitude",
    "finish_block",
    "push_block",
    "sums_of_reversals",
]


CLOSED, OVER = 0, 1  #: columns of counts: all cycles (half cycles as 1/2), and cycles beyond the curve


class CycleRule(NamedTuple):
    """The damage of a cycle with given amplitude and mean, as numbers from `SNCurve` and `MeanStress`."""

    amplitude: Array  #: (n_lines,) [Pa]
    cycles: Array  #: (n_lines,)
    slope: Array  #: (n_lines,)
    bottom: Array  #: (n_lines,) [Pa]
    greatest: float  #: largest amplitude of the curve [Pa]
    law: int  #: code of the mean stress law
    value: float  #: parameter of the law
    credit: bool  #: whether a compressive mean is beneficial
    ratio: float  #: mean stress divided by amplitude in the tests of the curve, c


def cycle_rule(curve: SNCurve, mean_stress: MeanStress) -> CycleRule:
    """Return the curve and the mean stress correction as numbers."""
    return CycleRule(
        np.array(curve.amplitude), np.array(curve.cycles), np.array(curve.slope), np.array(curve.bottom),
        float(curve.greatest), mean_stress.law, float(mean_stress.value), mean_stress.credit_compression,
        float(curve.mean_over_amplitude),
    )  # fmt: skip


@jit
def reversed_amplitude(rule, S_a, S_m):
    """Return S_ar, the fully reversed amplitude of a cycle; inf if its mean reaches the strength (`mean_stress`)."""
    if rule.law == LINE:
        if S_m <= 0.0 and not rule.credit:
            return S_a
        rest = 1.0 - S_m / rule.value
        return S_a / rest if rest > 0.0 else np.inf
    if rule.law == GERBER:
        if S_m <= 0.0:
            return S_a
        rest = 1.0 - (S_m / rule.value) ** 2
        return S_a / rest if S_m < rule.value else np.inf
    if rule.law == SWT:
        return np.sqrt(max(S_a + S_m, 0.0) * S_a)
    if rule.law == WALKER:
        S_max = S_a + S_m
        return S_max ** (1.0 - rule.value) * S_a**rule.value if S_max > 0.0 else 0.0
    if rule.law == FKM:
        M = rule.value
        if S_m < -S_a:
            return S_a * (1.0 - M)
        if S_m <= S_a:
            return S_a + M * S_m
        if S_m < 3.0 * S_a:
            return (1.0 + M) * (S_a + M / 3.0 * S_m) / (1.0 + M / 3.0)
        return 3.0 * (1.0 + M) ** 2 / (3.0 + M) * S_a
    return S_a


@jit
def equivalent_amplitude(rule, S_a, S_m):
    """Return S, the amplitude at the stress ratio of the curve with the same S_ar; its cycles have the mean c S."""
    if rule.law == NONE:
        return S_a
    S_ar = reversed_amplitude(rule, S_a, S_m)
    c = rule.ratio
    if c == 0.0 or S_ar == 0.0:
        return S_ar
    if not np.isfinite(S_ar):
        return np.inf
    if rule.law == LINE:
        return S_ar / (1.0 + c * S_ar / rule.value)
    if rule.law == GERBER:
        a = c * S_ar / rule.value
        return 2.0 * S_ar / (1.0 + np.sqrt(1.0 + 4.0 * a * a))
    return S_ar / reversed_amplitude(rule, 1.0, c)  # the other laws are homogeneous


@jit
def damage_of(rule, S):
    """Return 1/N for an amplitude S of the curve."""
    if not S > 0.0:
        return 0.0
    for j in range(rule.bottom.size):
        if S >= rule.bottom[j]:
            return (S / rule.amplitude[j]) ** rule.slope[j] / rule.cycles[j]
    return 0.0


@jit
def sums_of_reversals(rule, levels, sizes, weights, out):
    """Write out_l = sum_i weights_i d(levels_l sizes_i), (n_levels,), with the damage d of a reversed cycle.

    It is infinite if an amplitude reaches the strength of the mean stress law.
    """
    has_strength = rule.law in (LINE, GERBER)
    for level in range(levels.size):
        total = 0.0
        for i in range(sizes.size):
            S = levels[level] * sizes[i]
            if has_strength and S >= rule.value:
                total = np.inf
                break
            total += weights[i] * damage_of(rule, equivalent_amplitude(rule, S, 0.0))
        out[level] = total


@jit
def count(rule, x, y, weight, damage, counts, largest, n):
    """Count the cycle between turning points x and y."""
    S = equivalent_amplitude(rule, 0.5 * abs(x - y), 0.5 * (x + y))
    damage[n] += weight * damage_of(rule, S)
    counts[n, CLOSED] += weight
    if S > largest[n]:
        largest[n] = S
    if S > rule.greatest:
        counts[n, OVER] += weight


@jit
def close(stack, depth, s, closed):
    """Remove closed cycles from a stack whose last range rises (s = 1) or falls (-1); return depth, number, next level.

    For s = 1 the four-point rule is x4 >= x2 and x3 >= x1: the intervals are nested. Cycles cannot close before the
    last value has passed the level.
    """
    n = 0
    while depth >= 4 and s * stack[depth - 2] >= s * stack[depth - 4]:
        if s * stack[depth - 1] < s * stack[depth - 3]:
            return depth, n, s * stack[depth - 3]
        closed[n, 0], closed[n, 1] = stack[depth - 3], stack[depth - 2]
        stack[depth - 3] = stack[depth - 1]
        depth -= 2
        n += 1
    return depth, n, np.inf


@jit
def push(values, first, stack, depth, closed):
    """Stream values from index `first` into a stack until cycles close; return next index, depth, number of cycles.

    The turning points of these cycles are in the rows of `closed`, (n, 2).
    """
    i = first
    while depth < 2 and i < values.size:
        if depth == 0 or values[i] != stack[0]:
            stack[depth] = values[i]
            depth += 1
        i += 1
    if depth < 2:
        return i, depth, 0
    s = 1.0 if stack[depth - 1] > stack[depth - 2] else -1.0
    top = s * stack[depth - 1]
    depth, n, level = close(stack, depth, s, closed)
    while n == 0 and i < values.size:
        v = s * values[i]
        i += 1
        if v >= top:  # the history continues in the same direction, so that the last turning point moves
            top = v
            if v < level:
                continue
            stack[depth - 1] = s * top
        else:  # the history changes direction
            stack[depth - 1], stack[depth] = s * top, s * v
            depth += 1
            s, top = -s, -v
        depth, n, level = close(stack, depth, s, closed)
    stack[depth - 1] = s * top
    return i, depth, n


@jit
def push_block(rule, values, stack, depths, closed, damage, counts, largest):
    """Stream a chunk of histories into the stacks, and count the cycles that close.

    Parameters
    ----------
    values
        (n_nodes, n_times).
    stack
        Working array, (n_nodes, n), where n is larger than n_times plus the largest depth.
    closed
        Working array, (n, 2).
    damage, counts, largest
        Sums for each node, (n_nodes,) and (n_nodes, 2), and the largest equivalent amplitude, (n_nodes,).
    """
    for n in range(values.shape[0]):
        depth, row, history, i = depths[n], stack[n], values[n], 0
        while i < history.size:
            i, depth, n_closed = push(history, i, row, depth, closed)
            for c in range(n_closed):
                count(rule, closed[c, 0], closed[c, 1], 1.0, damage, counts, largest, n)
        depths[n] = depth


@jit
def finish_block(rule, stack, depths, damage, counts, largest):
    """Count the ranges of the residues as half cycles."""
    for n in range(depths.size):
        for i in range(1, depths[n]):
            count(rule, stack[n, i - 1], stack[n, i], 0.5, damage, counts, largest, n)


@jit
def close_block(rule, stack, depths, closed, damage, counts, largest):
    """Append each residue to itself once, which gives the cycles of an endlessly repeated history.

    The stacks are twice as long as the greatest depth.
    """
    for n in range(depths.size):
        residue = stack[n, : depths[n]].copy()
        push_block(rule, residue.reshape(1, -1), stack[n : n + 1], depths[n : n + 1], closed, damage[n : n + 1],
                   counts[n : n + 1], largest[n : n + 1])  # fmt: skip


@jit
def collect(values, is_repeated):
    """Return the cycles of one history: first and second turning point, and count, (n_cycles, 3)."""
    stack, closed = np.empty(2 * values.size + 2), np.empty((values.size + 2, 2))
    found = np.empty((values.size + 2, 3))
    n_found, depth = 0, 0
    history = values
    for _ in range(2 if is_repeated else 1):
        i = 0
        while i < history.size:
            i, depth, n_closed = push(history, i, stack, depth, closed)
            for c in range(n_closed):
                found[n_found, 0], found[n_found, 1], found[n_found, 2] = closed[c, 0], closed[c, 1], 1.0
                n_found += 1
        history = stack[:depth].copy()
    if not is_repeated:
        for i in range(1, depth):
            found[n_found, 0], found[n_found, 1], found[n_found, 2] = stack[i - 1], stack[i], 0.5
            n_found += 1
    return found[:n_found].copy()
