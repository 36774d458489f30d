"""What all tyres have in their data: the numbers before those of their law, and the road behind them."""

from collections.abc import Sequence

import numpy as np

from fe_models.foundation.arrays import Array
from floatframe.elements import Placed
from floatframe.errors import ModelError
from floatframe.wheels.contact import COMMON, ROAD
from floatframe.wheels.outputs import OUTPUT_UNITS, OUTPUTS
from floatframe.wheels.roads.road import Road

__all__ = ["acts_of", "states_of", "tyre_numbers"]

UPRIGHT = 0.2  #: cosine of the inclination below which a wheel is not one that rolls on this road


def tyre_numbers(
    where: str, placed: Placed, common: Sequence[float], axis: Array, law: Sequence[float], road: Road
) -> Array:
    """Return radius ... relaxation lengths (8), axis, place, where the road begins, numbers of the law, road.

    Raises
    ------
    ModelError
        If the wheel as placed lies on its side, is below the road, or not on it.
    """
    A = placed.A[0].T @ placed.A[1]
    c = placed.A[0].T @ (placed.r[1] - placed.r[0])
    e = A @ axis
    if abs(e[2]) > np.sqrt(1 - UPRIGHT**2):
        raise ModelError(
            f"{where}: its spin axis is {e.round(3).tolist()} in axes of marker_a, along the road's normal z; a wheel stands: "
            "give `axis` (in axes of marker_b; default y), or turn a marker"
        )
    ground = road.height(c[0], c[1])
    if c[2] <= ground:
        raise ModelError(
            f"{where}: its centre lies at z = {c[2]:g}, below the road at {ground:g} (axes of marker_a); expected it a radius, "
            f"{common[0]:g}, above: is the z axis of marker_a up, and is marker_b the wheel's centre?"
        )
    head = [*common, *axis, *c, *A.ravel()]
    assert len(head) == ROAD
    return np.concatenate([head, [COMMON + len(law)], law, road.numbers()])


def states_of(sigma_x: float, sigma_y: float, low: float) -> dict[str, tuple]:
    """Return the states of the tread that relax: names, starts, units, sizes."""
    names = tuple(name for name, sigma in (("u", sigma_x), ("v", sigma_y)) if sigma > 0)
    n = len(names)
    return {"states": names, "start": (0.0,) * n, "state_units": ("m",) * n, "state_sizes": (low,) * n}


def acts_of(placed: Placed) -> tuple[str, str]:
    """Return on which markers the wrench acts: a road that is the ground needs none."""
    return ("none" if placed.on_ground[0] else "wrench", "wrench")


#: what every tyre shows
SHOWN = {"outputs": tuple(OUTPUTS), "output_units": OUTPUT_UNITS, "energy": "energy", "power_lost": "power_lost"}
