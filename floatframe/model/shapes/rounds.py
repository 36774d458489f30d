"""Axisymmetric shapes: cylinders, cones, pipes, spheres, solids of revolution."""

from dataclasses import dataclass, field
from typing import Any

import numpy as np

from fe_models.foundation.arrays import Array
from floatframe.errors import ModelError
from floatframe.model.checked_values import number, unit_vector
from floatframe.model.shapes.grids import grid_triangles
from floatframe.model.shapes.piece import Piece

__all__ = ["Cylinder", "Revolution", "Sphere", "axes_about", "finite_points", "revolved"]

AROUND = 48  #: number of nodes around a circle


@dataclass(frozen=True, eq=False)
class Cylinder:
    """A cylinder centred at the origin; with `end_radius` it is a cone, with `inner_radius` a pipe."""

    radius: float  #: outer radius [m]
    length: float  #: length along the axis [m]
    axis: Array = field(default_factory=lambda: np.array([0.0, 0.0, 1.0]))  #: axis of the cylinder, (3,)
    end_radius: float | None = None  #: radius at the end to which the axis points [m]; None: equal to `radius`
    inner_radius: float = 0.0  #: inner radius of a pipe [m]

    def __post_init__(self) -> None:
        put = object.__setattr__
        put(self, "radius", number("cylinder: radius", self.radius, above=0.0))
        put(self, "length", number("cylinder: length", self.length, above=0.0))
        put(self, "axis", unit_vector("cylinder: axis", self.axis))
        if self.end_radius is not None:
            put(self, "end_radius", number("cylinder: end_radius", self.end_radius, at_least=0.0))
        put(self, "inner_radius", number("cylinder: inner_radius", self.inner_radius, at_least=0.0))
        least = self.radius if self.end_radius is None else min(self.radius, self.end_radius)
        if self.inner_radius and self.inner_radius >= least:
            raise ModelError(
                f"cylinder: inner_radius: expected less than the radius {least:g}, got {self.inner_radius:g}"
            )

    def pieces(self) -> tuple[Piece, ...]:
        """Return the surface of the cylinder."""
        r_2, h, r_i = self.radius if self.end_radius is None else self.end_radius, self.length / 2, self.inner_radius
        profile = [(r_i, -h), (self.radius, -h), (r_2, h), (r_i, h)]
        return (revolved(np.array(profile), self.axis, is_closed=r_i > 0),)


@dataclass(frozen=True, eq=False)
class Revolution:
    """A solid of revolution, given by a profile of radius and axial position, in drawing order."""

    profile: Array  #: radius and axial position, (n, 2) [m]
    axis: Array = field(default_factory=lambda: np.array([0.0, 0.0, 1.0]))  #: axis of revolution, (3,)
    is_closed: bool = False  #: whether the last point is connected to the first, as for a ring

    def __post_init__(self) -> None:
        put = object.__setattr__
        put(self, "profile", finite_points("revolution: profile", self.profile, 2))
        if self.profile[:, 0].min() < 0:
            raise ModelError(f"revolution: profile: expected radii of 0 or more, got {self.profile[:, 0].min():g}")
        put(self, "axis", unit_vector("revolution: axis", self.axis))

    def pieces(self) -> tuple[Piece, ...]:
        """Return the surface of the solid."""
        return (revolved(self.profile, self.axis, is_closed=self.is_closed),)


@dataclass(frozen=True, eq=False)
class Sphere:
    """A sphere about the origin."""

    radius: float  #: radius of the sphere [m]

    def __post_init__(self) -> None:
        object.__setattr__(self, "radius", number("sphere: radius", self.radius, above=0.0))

    def pieces(self) -> tuple[Piece, ...]:
        """Return the surface of the sphere."""
        angle = np.linspace(-np.pi / 2, np.pi / 2, AROUND // 2 + 1)
        profile = self.radius * np.stack([np.maximum(np.cos(angle), 0.0), np.sin(angle)], axis=1)
        return (revolved(profile, np.array([0.0, 0.0, 1.0])),)


def revolved(profile: Array, axis: Array, *, is_closed: bool = False, around: int = AROUND, color: str = "") -> Piece:
    """Return a profile, (n, 2) of radius and axial position, revolved about an axis; the material is on its left.

    Profiles along the axis with the material on their inner side face outward.
    """
    x, y, z = axes_about(axis)
    angle = 2 * np.pi * np.arange(around) / around
    ring = np.cos(angle)[:, None] * x + np.sin(angle)[:, None] * y
    nodes = profile[:, 0, None, None] * ring[None] + (profile[:, 1, None] * z)[:, None]
    triangles = grid_triangles(len(profile), around, closes_n=is_closed, closes_m=True)[:, ::-1]
    flat = nodes.reshape(-1, 3)
    corners = flat[triangles]
    area = np.linalg.norm(np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), axis=1)
    return Piece(flat, triangles[area > 1e-9 * area.max(initial=0.0)], color=color)


def axes_about(axis: Array) -> tuple[Array, Array, Array]:
    """Return right-handed axes whose third axis has the given direction, (3,) each."""
    z = np.asarray(axis, dtype=float) / np.linalg.norm(axis)
    helper = np.eye(3)[int(np.argmin(np.abs(z)))]
    x = np.cross(helper, z)
    x /= np.linalg.norm(x)
    return x, np.cross(z, x), z


def finite_points(where: str, values: Any, least: int, width: int = 2, words: str = "pairs of numbers") -> Array:
    """Return finite points, (n, width), read-only."""
    try:
        points = np.array(values, dtype=float)
    except (TypeError, ValueError):
        points = np.zeros(0)
    if points.ndim != 2 or points.shape[1] != width or len(points) < least or not np.isfinite(points).all():
        raise ModelError(f"{where}: expected {least} or more finite {words}, got shape {points.shape}")
    points.flags.writeable = False
    return points
