"""Mass properties of rigid bodies in the forms that CAD programs export, and their sums.

rod = mass_properties(1.2, (0.1, 0, 0), inertia, axes=principal_axes)
RigidBody("rod", **combined(rod, point_mass(0.3, (0.2, 0, 0))).arguments)
"""

from dataclasses import dataclass
from typing import Any

import numpy as np

from fe_models.foundation.arrays import Array
from fe_models.foundation.records import frozen_copies
from floatframe.errors import ModelError
from floatframe.model.checked_values import array_of_shape, number, rotation_of

__all__ = ["MassProperties", "combined", "mass_properties", "point_mass"]


@frozen_copies
@dataclass(frozen=True, eq=False)
class MassProperties:
    """Mass, centre of mass, and inertia tensor about the centre of mass, in the axes of the body frame."""

    mass: float  #: mass of the body [kg]
    center_of_mass: Array  #: centre of mass, (3,) [m]
    inertia: Array  #: inertia tensor about the centre of mass, off-diagonal I_xy = -∫ x y, (3, 3) [kg m²]

    @property
    def arguments(self) -> dict[str, Any]:
        """The mass properties as keyword arguments of `RigidBody`."""
        return {"mass": self.mass, "center_of_mass": self.center_of_mass, "inertia": self.inertia}


def mass_properties(
    mass: float,
    center_of_mass: Array | tuple[float, float, float],
    inertia: Array,
    *,
    axes: Array | None = None,
    reference: Array | tuple[float, float, float] | None = None,
    positive_products: bool = False,
) -> MassProperties:
    """Return mass properties in the form of this package.

    Parameters
    ----------
    mass
        Mass [kg].
    center_of_mass
        Centre of mass in the body frame, (3,) [m].
    inertia
        Inertia tensor about the reference point, (3, 3) [kg m²].
    axes
        Axes in which the tensor is given, as columns, in the body frame, (3, 3), such as principal axes. Default: those
        of the body frame.
    reference
        Point about which the tensor is given, in the body frame, (3,) [m]; default: the centre of mass.
    positive_products
        Whether products of inertia are given as ∫ x y, without the minus sign of the tensor (some CAD programs).

    Raises
    ------
    ModelError
        If a shape is wrong, the axes are not orthonormal, or the tensor about the centre of mass is impossible.
    """
    m = number("mass_properties: mass", mass, above=0.0)
    c = array_of_shape("mass_properties: center_of_mass", center_of_mass, (3,))
    J = array_of_shape("mass_properties: inertia", inertia, (3, 3))
    if positive_products:
        J = 2 * np.diag(np.diag(J)) - J
    if axes is not None:
        A = rotation_of("mass_properties: axes", axes)
        J = A @ J @ A.T
    if reference is not None:
        d = c - array_of_shape("mass_properties: reference", reference, (3,))
        J = J - m * steiner(d)
    low = float(np.linalg.eigvalsh(0.5 * (J + J.T))[0])
    if low < -1e-9 * np.abs(J).max():
        raise ModelError(
            f"mass_properties: the tensor about the centre of mass has a negative principal moment, {low:.6g}; check "
            "mass, centre of mass, the reference point and the sign of the products"
        )
    return MassProperties(m, c, J)


def point_mass(
    mass: float, position: Array | tuple[float, float, float], inertia: Array | None = None
) -> MassProperties:
    """Return the properties of a small mass at a position, optionally with its own inertia."""
    own = np.zeros((3, 3)) if inertia is None else array_of_shape("point_mass: inertia", inertia, (3, 3))
    m = number("point_mass: mass", mass, above=0.0)
    return MassProperties(m, array_of_shape("point_mass: position", position, (3,)), own)


def combined(*parts: MassProperties) -> MassProperties:
    """Return the total properties of parts that are rigidly connected."""
    if not parts:
        raise ModelError("combined: expected at least one part, got none")
    m = sum(part.mass for part in parts)
    c = sum((part.mass * part.center_of_mass for part in parts), np.zeros(3)) / m
    J = sum((part.inertia + part.mass * steiner(part.center_of_mass - c) for part in parts), np.zeros((3, 3)))
    return MassProperties(m, c, J)


def steiner(d: Array) -> Array:
    """Return the matrix d·d 1 - d dᵀ, (3, 3)."""
    return np.asarray(d @ d * np.eye(3) - np.outer(d, d))
