"""The parameters that all tyres share; the parameters of the law and of the road follow them in the data."""

from collections.abc import Callable, Sequence

import numpy as np

from fe_models.foundation.arrays import Array
from floatframe.components.wheels.contact import COMMON, RADIUS, ROAD
from floatframe.components.wheels.outputs import OUTPUTS
from floatframe.components.wheels.roads.road import Road
from floatframe.components.wheels.roads.surface import FLAT
from floatframe.errors import ModelError
from floatframe.model.elements import ElementLaw, Placed
from floatframe.model.elements.unit_names import in_units, outputs_in

__all__ = ["tyre_law", "tyre_numbers"]

TREAD = 1e-3  #: typical deflection of the tread, divided by the radius
UPRIGHT = 0.2  #: cosine of the inclination below which a wheel counts as lying on its side


def tyre_numbers(
    where: str, placed: Placed, common: Sequence[float], axis: Array, law: Sequence[float], road: Road
) -> Array:
    """Return the data: radius ... relaxation lengths (8), axis, place, index of the road, parameters of the law, road.

    Raises
    ------
    ModelError
        If the assembled wheel lies on its side, is below the road, or is not on it.
    """
    A = placed.A[0].T @ placed.A[1]
    c = placed.A[0].T @ (placed.r[1] - placed.r[0])
    e = A @ axis
    if abs(e[2]) > np.sqrt(1 - UPRIGHT**2):
        raise ModelError(
            f"{where}: its spin axis is {e.round(3).tolist()} in axes of marker_a, along the road's normal z, but the "
            "axle of a wheel must be normal to it: give `axis` (in axes of marker_b; default y), or rotate a marker"
        )
    ground = road.height(c[0], c[1])
    if c[2] <= ground:
        raise ModelError(
            f"{where}: its centre lies at z = {c[2]:g}, below the road at {ground:g} (axes of marker_a); expected it "
            f"one radius, {common[0]:g}, above the road: check that z of marker_a points up and that marker_b is the "
            "wheel's centre"
        )
    head = [*common, *axis, *c, *A.ravel()]
    assert len(head) == ROAD
    return np.concatenate([head, [COMMON + len(law)], law, road.numbers()])


def tyre_law(
    function: Callable[..., None], rest: Callable[..., None], data: Array, placed: Placed, sigma: tuple[float, float]
) -> ElementLaw:
    """Return the law of a tyre: states of the relaxing tread, wrenches on movable bodies, outputs.

    Parameters
    ----------
    function, rest
        The law in motion, and the law for statics.
    data
        Data from `tyre_numbers`.
    placed
        The assembled markers; a road on the ground needs no wrench.
    sigma
        Relaxation lengths along x and y [m]; a direction with 0 has no state.
    """
    states = tuple(name for name, length in zip(("u", "v"), sigma, strict=True) if length > 0)
    return ElementLaw(
        function=function,
        rest=rest,
        data=data,
        tangent="complex",
        acts=("none" if placed.on_ground[0] else "wrench", "wrench"),
        states=states,
        start=(0.0,) * len(states),
        state_units=in_units(placed.units, ["m"] * len(states)),
        state_sizes=(TREAD * float(data[RADIUS]),) * len(states),
        **outputs_in(placed.units, OUTPUTS),
        energy="energy",
        power_lost="power_lost",
        stops={} if data[int(data[ROAD])] == FLAT else {"off_road": "the wheel is beyond the end of its road"},
    )
