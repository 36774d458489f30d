"""Compiled functions: cycles of the shear stress on a plane, with the largest normal stress during each cycle.

The four-point rule of `cycle_kernels`, with a second stack for the largest normal stress since the previous turning
point. A cycle x2 x3 that closes between x3 and x4 takes the largest normal stress between x2 and x4. This includes some
time after the cycle has closed, which is conservative.
"""

import numpy as np

from fe_models.foundation.kernels.jit import jit
from floatframe.durability.fatigue.kernels.cycle_kernels import CLOSED, OVER, damage_of

__all__ = ["count_findley", "push_findley"]


@jit
def count_findley(rule, k, weight, x, y, normal, damage, counts, largest, n):
    """Count a cycle with the amplitude S = 2 (tau_a + k max(normal, 0)) / (k + sqrt(1 + k²)) of a bar under tension."""
    S = 2.0 * (0.5 * abs(x - y) + k * max(normal, 0.0)) / (k + np.sqrt(1.0 + k * k))
    if x == y:
        return
    damage[n] += weight * damage_of(rule, S)
    counts[n, CLOSED] += weight
    largest[n] = max(largest[n], S)
    if S > rule.greatest:
        counts[n, OVER] += weight


@jit
def push_findley(rule, k, shear, normal, stack, most, depths, damage, counts, largest):
    """Stream shear and normal stress on planes, (n_planes, n_times), into stacks, and count the cycles that close.

    most: stack, (n_planes, n), of the largest normal stress between the previous turning point and this one.
    """
    for n in range(shear.shape[0]):
        depth, row, high = depths[n], stack[n], most[n]
        for i in range(shear.shape[1]):
            v, p = shear[n, i], normal[n, i]
            if depth == 0 or (depth == 1 and v != row[0]):
                row[depth], high[depth] = v, p if depth == 0 else max(p, high[0])
                depth += 1
                continue
            if depth == 1 or v == row[depth - 1]:
                high[depth - 1] = max(high[depth - 1], p)
                continue
            if (v > row[depth - 1]) == (row[depth - 1] > row[depth - 2]):
                row[depth - 1], high[depth - 1] = v, max(high[depth - 1], p)
            else:
                row[depth], high[depth] = v, p
                depth += 1
            s = 1.0 if row[depth - 1] > row[depth - 2] else -1.0
            while depth >= 4:
                x1, x2, x3, x4 = s * row[depth - 4], s * row[depth - 3], s * row[depth - 2], s * row[depth - 1]
                if x4 < x2 or x3 < x1:
                    break
                during = max(high[depth - 2], high[depth - 1])
                count_findley(rule, k, 1.0, x2, x3, during, damage, counts, largest, n)
                high[depth - 3] = max(high[depth - 3], during)
                row[depth - 3] = row[depth - 1]
                depth -= 2
        depths[n] = depth


@jit
def finish_findley(rule, k, stack, most, depths, damage, counts, largest):
    """Count the ranges of the residues as half cycles."""
    for n in range(depths.size):
        for i in range(1, depths[n]):
            count_findley(rule, k, 0.5, stack[n, i - 1], stack[n, i], most[n, i], damage, counts, largest, n)


@jit
def close_findley(rule, k, stack, most, depths, damage, counts, largest):
    """Append each residue to itself once; the stacks are twice as long as the largest depth."""
    for n in range(depths.size):
        shear, normal = stack[n, : depths[n]].copy(), most[n, : depths[n]].copy()
        push_findley(
            rule, k, shear.reshape(1, -1), normal.reshape(1, -1), stack[n : n + 1], most[n : n + 1], depths[n : n + 1],
            damage[n : n + 1], counts[n : n + 1], largest[n : n + 1],
        )  # fmt: skip
