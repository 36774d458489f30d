"""Whether the rotations of bushings and of public elements stay where small angles are meant.

A bushing with stiffness, damping or preload about its axes takes the components of the rotation vector theta of its
marker B against A. Cardan angles, which its coefficients may have been measured in, differ from them by about half the
products of two components: next to nothing about one axis, however far it turns, and ever more about two. Next to a
full turn a small tilt has a large component.

Public elements say themselves how far their angles are beyond small ones (`Element.small_angles`).
"""

from collections.abc import Callable, Iterator
from functools import partial

import numpy as np

from fe_models.foundation.arrays import Array
from floatframe.engine.compiling.counted_angles import first_angles
from floatframe.engine.compiling.markers import MarkerData
from floatframe.engine.compiling.pair_forces import bushing_markers
from floatframe.engine.compiling.system import compiled_system
from floatframe.engine.kernels.memory import Rows
from floatframe.model.forces import Bushing
from floatframe.model.rotations import euler_parameter_product, euler_parameters, rotation_matrix, rotations_between
from floatframe.model.system import System

__all__ = ["ANGLES_LIMIT", "angle_measures"]

ANGLES_LIMIT = 0.05  #: of the angle, by which another reading of it may differ

Measure = Callable[[Rows], Array]


def angle_measures(system: System) -> Iterator[tuple[str, str, Measure]]:
    """Yield where each bushing and bearing with angles stands, "angles" or "tilt", and how far other readings are off.

    Each measure is a function of rows of results, (n_t,).
    """
    compiled = compiled_system(system)
    bushings = [force for force in system.forces if isinstance(force, Bushing)]
    first = first_angles(system, len(compiled.angles))
    for bushing, k in zip(bushings, first, strict=True):
        if bushing.has_angles:
            a, b = bushing_markers(system, bushing, compiled.placed)
            yield f"forces.{bushing.name}", "angles", partial(apart_from_cardan, a, b, k)
    for placed in compiled.laws:
        beyond = placed.element.small_angles()
        if beyond is not None:
            yield f"elements.{placed.element.name}", "tilt", partial(of_element, beyond, tuple(placed.markers))


def apart_from_cardan(a: MarkerData, b: MarkerData, k: int, rows: Rows) -> Array:
    """Return by which part of its angle the rotation vector of marker b against a differs from Cardan angles, (n_t,).

    k: where its components begin in the counted angles, -1 where they are not.
    """
    if k >= 0:
        theta = rows.angle[:, k : k + 3]
    else:
        theta = rotations_between(orientations_of(b, rows), orientations_of(a, rows))
    size = np.abs(theta)
    products = np.max([size[:, 0] * size[:, 1], size[:, 1] * size[:, 2], size[:, 2] * size[:, 0]], axis=0)
    angle = np.linalg.norm(theta, axis=1)
    return np.asarray(0.5 * products / np.where(angle > 0.0, angle, 1.0))


def of_element(beyond: Callable[[Array], Array], markers: tuple[MarkerData, ...], rows: Rows) -> Array:
    """Return what an element says of its angles (`Element.small_angles`), (n_t,)."""
    return beyond(np.stack([rotation_matrix(orientations_of(marker, rows)) for marker in markers], axis=1))


def orientations_of(marker: MarkerData, rows: Rows) -> Array:
    """Return the Euler parameters of the axes of a marker on the undeformed body, (n_t, 4)."""
    p = euler_parameters(np.asarray(marker.shape.triad))
    if marker.body < 0:
        return np.broadcast_to(p, (len(rows.t), 4))
    return euler_parameter_product(rows.p[:, marker.body], p)
