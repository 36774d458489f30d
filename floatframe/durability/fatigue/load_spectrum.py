"""The cycles of one place: the load spectrum that stands beside the S-N curve."""

from collections.abc import Sequence

import numpy as np

from fe_models.foundation.arrays import Array
from floatframe.durability.fatigue.kernels.cycle_kernels import collect, cycle_rule, equivalent_amplitude
from floatframe.durability.fatigue.load_blocks import LoadBlock
from floatframe.durability.fatigue.places import Places, frames_of_places, stress_of_places
from floatframe.durability.fatigue.surface_damage import FatigueResult
from floatframe.errors import FatigueError

__all__ = ["cycles_at", "exceedances"]


def cycles_at(result: FatigueResult, blocks: Sequence[LoadBlock], place: int) -> Array:
    """Return the cycles of the programme at one place: equivalent amplitude, mean, count, (n_cycles, 3).

    Parameters
    ----------
    place
        Index into the arrays of the result; of planes, the one of greatest damage is taken.

    Raises
    ------
    FatigueError
        For criteria of shear, whose cycles carry a normal stress besides.
    """
    criterion, body = result.criterion, result.body
    if criterion.is_shear or result.is_spectral:
        raise FatigueError("cycles of a place: known for rainflow counts of signed-von-mises, principal and normal")
    places = Places(result.nodes, result.points, result.material, 0)
    at, material = np.array([place]), result.materials[result.material[place]]
    rows = criterion.rows(stress_of_places(body, places, at, None), frames_of_places(body, places, at, criterion))
    rule, scalar = cycle_rule(material.curve, material.mean_stress), criterion.scalar()
    found = []
    for block in blocks:
        history = rows[0] @ (block.scale * np.asarray(block.q)).T
        if scalar is None:
            values = np.ascontiguousarray(history[result.plane[place]])
        else:
            out = np.empty((1, history.shape[1]))
            scalar(np.ascontiguousarray(history[None]), out)
            values = out[0]
        cycles = collect(values, result.method == "repeat")
        mean = 0.5 * (cycles[:, 0] + cycles[:, 1])
        half = 0.5 * np.abs(cycles[:, 0] - cycles[:, 1])
        S = [equivalent_amplitude(rule, float(a), float(m)) for a, m in zip(half, mean, strict=True)]
        found.append(np.stack([np.array(S), mean, block.repeats * cycles[:, 2]], axis=1).reshape(-1, 3))
    return np.concatenate(found)


def exceedances(cycles: Array, n_points: int = 200) -> tuple[Array, Array]:
    """Return how many cycles have at least an amplitude: counts and amplitudes that fall, each (n <= n_points,)."""
    order = np.argsort(-cycles[:, 0], kind="stable")
    amplitude, count = cycles[order, 0], np.cumsum(cycles[order, 2])
    keep = amplitude > 0
    amplitude, count = amplitude[keep], count[keep]
    if len(amplitude) > n_points:
        chosen = np.unique(np.searchsorted(count, np.geomspace(count[0], count[-1], n_points)).clip(0, len(count) - 1))
        amplitude, count = amplitude[chosen], count[chosen]
    return count, amplitude
