"""Shapes of tyres for pictures: the wheel on the spinning body, the road and the contact force."""

import numpy as np

from fe_models.foundation.arrays import Array
from floatframe.components.wheels.roads.road import GridRoad, Road
from floatframe.model.shapes import Arrow, MarkerShapes, Plane, Shape, Terrain, Wheel

__all__ = ["tyre_looks"]

WIDTH = 0.62  #: width of a tyre whose width is unknown, divided by its radius
LANE = 0.04  #: half width of a road that is drawn from a single profile, divided by its length
MOST_KNOTS = 3000  #: largest number of knots of a drawn road


def tyre_looks(
    radius: float, axis: Array, road: Road, *, width: float | None = None, is_in_metres: bool = False
) -> tuple[MarkerShapes | Arrow, ...]:
    """Return the shapes of the wheel (unless its body has shapes of its own), the road and the force.

    Parameters
    ----------
    radius, width
        Radius and width of the tyre [m]; None if the width is unknown.
    axis
        Spin axis in the axes of marker B, (3,).
    road
        The road, in the axes of marker A.
    is_in_metres
        Whether radius and width are in metres for any units of the system.
    """
    wheel = Shape(Wheel(radius, width or WIDTH * radius, axis=axis))
    return (
        MarkerShapes(wheel, marker=1, is_default=True, is_in_metres=is_in_metres),
        MarkerShapes(Shape(ground(road)), marker=0),
        Arrow(None, marker=1, at=("px", "py", "pz")),
    )


def ground(road: Road) -> Plane | Terrain:
    """Return the shape of a road: a plane, or its heights; a single profile is drawn as a strip."""
    if not isinstance(road, GridRoad):
        return Plane()
    every = max(1, len(road.x) // MOST_KNOTS)
    x, z, y = road.x[::every], road.z[::every], road.y
    if len(y) == 1:
        y, z = y[0] + LANE * np.ptp(x) * np.array([-1.0, 1.0]), z.repeat(2, axis=1)
    return Terrain(x, y, z)
