"""Content of a picture or film: surfaces, lines and triads over frames, and text."""

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from cms.assessment.rendering.errors import SceneError
from fe_models.foundation.arrays import Array, IntArray, frozen

__all__ = ["Lines", "Scene", "Surface", "Triad", "frame_of"]


@dataclass(frozen=True, eq=False)
class Surface:
    """Surface of triangles, at rest or with node positions for each frame."""

    triangles: IntArray  #: node indices of each triangle, (n_triangles, 3)
    nodes: Array  #: positions, (n_nodes, 3) or (n_frames, n_nodes, 3) [m]
    #: value that colours each node, (n_nodes,) or (n_frames, n_nodes); None: a single colour
    scalars: Array | None = None
    color: str = "#b8c4d0"  #: colour if there are no scalars
    opacity: float = 1.0  #: opacity, 0 < opacity <= 1
    has_edges: bool = True  #: whether sharp edges are drawn
    name: str = ""

    def __post_init__(self) -> None:
        where = f"surface {self.name!r}" if self.name else "surface"
        put = object.__setattr__
        put(self, "triangles", frozen(self.triangles, np.int64))
        put(self, "nodes", positions(where, self.nodes))
        n_nodes = self.nodes.shape[-2]
        if self.triangles.ndim != 2 or self.triangles.shape[1] != 3:
            raise SceneError(f"{where}: triangles: expected (n_triangles, 3), got {self.triangles.shape}")
        if self.triangles.size and (self.triangles.min() < 0 or self.triangles.max() >= n_nodes):
            raise SceneError(
                f"{where}: triangles: expected nodes 0..{n_nodes - 1}, got "
                f"{self.triangles.min()}..{self.triangles.max()}"
            )
        if not 0 < self.opacity <= 1:
            raise SceneError(f"{where}: opacity: expected 0 < opacity <= 1, got {self.opacity}")
        if self.scalars is not None:
            put(self, "scalars", finite(f"{where}: scalars", self.scalars))
            if self.scalars.shape not in ((n_nodes,), (self.n_frames, n_nodes)):
                raise SceneError(
                    f"{where}: scalars: expected ({n_nodes},) or ({self.n_frames}, {n_nodes}), got {self.scalars.shape}"
                )

    @property
    def n_frames(self) -> int:
        """Number of frames; 1 if static."""
        return 1 if self.nodes.ndim == 2 else len(self.nodes)

    def nodes_at(self, frame: int) -> Array:
        """Return the positions of the nodes in a frame, (n_nodes, 3)."""
        return frame_of(self.nodes, frame, 2)


@dataclass(frozen=True, eq=False)
class Lines:
    """Straight segments between points: a grid, a link, the path of a point."""

    segments: IntArray  #: point indices of each segment, (n_segments, 2)
    points: Array  #: point positions, (n_points, 3) or (n_frames, n_points, 3) [m]
    color: str = "#5b6770"
    width: float = 1.5  #: line width [px]
    opacity: float = 1.0
    is_backdrop: bool = False  #: whether the lines are drawn behind everything else, such as a ground
    #: for a path that grows: the last point that each frame shows, (n_frames,); points are then (n_points, 3)
    last: IntArray | None = None

    def __post_init__(self) -> None:
        object.__setattr__(self, "segments", frozen(self.segments, np.int64))
        object.__setattr__(self, "points", positions("lines", self.points))
        n_points = self.points.shape[-2]
        if self.segments.ndim != 2 or self.segments.shape[1] != 2:
            raise SceneError(f"lines: segments: expected (n_segments, 2), got {self.segments.shape}")
        if self.segments.size and (self.segments.min() < 0 or self.segments.max() >= n_points):
            raise SceneError(f"lines: segments: expected points 0..{n_points - 1}")
        if self.last is not None:
            object.__setattr__(self, "last", frozen(self.last, np.int64))
            if self.points.ndim != 2 or self.last.ndim != 1 or self.last.min() < 0 or self.last.max() >= n_points:
                raise SceneError(f"lines: last: expected one of {n_points} points, which do not move, for each frame")

    @property
    def n_frames(self) -> int:
        """Number of frames; 1 if static."""
        if self.last is not None:
            return len(self.last)
        return 1 if self.points.ndim == 2 else len(self.points)

    def points_at(self, frame: int) -> Array:
        """Return the points in a frame, (n_points, 3); those after the last one that it shows coincide with it."""
        if self.last is not None:
            last = self.last[0 if self.n_frames == 1 else frame]
            return np.asarray(self.points[np.minimum(np.arange(len(self.points)), last)])
        return frame_of(self.points, frame, 2)


@dataclass(frozen=True, eq=False)
class Triad:
    """Three short axes at a point with a label, for an interface or a marker, drawn in front of everything else."""

    position: Array  #: position of the origin, (3,) or (n_frames, 3) [m]
    axes: Array  #: axes as columns, (3, 3) or (n_frames, 3, 3)
    size: float  #: length of the axes [m]
    label: str = ""

    def __post_init__(self) -> None:
        where = f"triad {self.label!r}"
        object.__setattr__(self, "position", finite(where, self.position))
        object.__setattr__(self, "axes", finite(where, self.axes))
        frames = self.position.shape[:-1]
        if self.position.shape[-1:] != (3,) or len(frames) > 1 or self.axes.shape != (*frames, 3, 3):
            raise SceneError(
                f"{where}: expected position (3,) and axes (3, 3), or both with n_frames in front, got "
                f"{self.position.shape} and {self.axes.shape}"
            )

    @property
    def n_frames(self) -> int:
        """Number of frames; 1 if static."""
        return 1 if self.position.ndim == 1 else len(self.position)


@dataclass(frozen=True, eq=False)
class Scene:
    """All content of a picture. Parts with a single frame do not move."""

    surfaces: tuple[Surface, ...] = ()
    lines: tuple[Lines, ...] = ()
    triads: tuple[Triad, ...] = ()
    title: str = ""
    captions: tuple[str, ...] = ()  #: lines under the title
    frame_notes: tuple[str, ...] = ()  #: text for each frame, such as the time; empty: none
    scalar_title: str = ""  #: quantity that the colours represent
    scalar_unit: str = ""  #: unit of that quantity; "": no unit
    scalar_range: tuple[float, float] | None = None  #: limits of the colour bar; None: extremes over all frames
    #: direction from the eye into the scene, (3,)
    direction: Array = field(default_factory=lambda: np.array([-1.0, 2.0, -1.0]))
    #: direction that points up in the picture, (3,)
    up: Array = field(default_factory=lambda: np.array([0.0, 0.0, 1.0]))
    background: str = "#fbfcfd"
    size: tuple[int, int] = (1280, 800)  #: width and height [px]
    text_scale: float = 1.0  #: size of texts, relative to the usual one

    def __post_init__(self) -> None:
        put = object.__setattr__
        for name in ("surfaces", "lines", "triads", "captions", "frame_notes"):
            put(self, name, tuple(getattr(self, name)))
        for name in ("direction", "up"):
            put(self, name, finite(f"scene: {name}", getattr(self, name)))
        if not self.surfaces and not self.lines:
            raise SceneError("scene: expected something to see, got neither surfaces nor lines")
        if np.linalg.norm(np.cross(self.direction, self.up)) < 1e-6 * np.linalg.norm(self.direction):
            raise SceneError(f"scene: up: expected a vector across the direction {self.direction}, got {self.up}")
        counts = set(self.frame_counts) - {1}
        if len(counts) > 1:
            raise SceneError(f"scene: expected parts with one number of frames, got {sorted(counts)}")
        if self.frame_notes and len(self.frame_notes) != self.n_frames:
            raise SceneError(f"scene: expected {self.n_frames} frame notes, got {len(self.frame_notes)}")
        if min(self.size) < 200:
            raise SceneError(f"scene: size: expected at least 200 x 200 pixels, got {self.size}")

    @property
    def n_frames(self) -> int:
        """Number of frames; 1 if everything is static."""
        return max(self.frame_counts)

    @property
    def frame_counts(self) -> tuple[int, ...]:
        """Number of frames of each part."""
        parts: tuple[Surface | Lines | Triad, ...] = (*self.surfaces, *self.lines, *self.triads)
        return tuple(part.n_frames for part in parts)

    @property
    def has_scalars(self) -> bool:
        """Whether colours of a surface represent numbers."""
        return any(surface.scalars is not None for surface in self.surfaces)

    @property
    def color_limits(self) -> tuple[float, float]:
        """Limits of the colour bar: as given, or the extremes of the scalars over all frames."""
        if self.scalar_range is not None:
            return self.scalar_range
        values = [surface.scalars for surface in self.surfaces if surface.scalars is not None and surface.scalars.size]
        low, high = min(float(v.min()) for v in values), max(float(v.max()) for v in values)
        return (low, high) if high > low else (low, low + 1.0)


def frame_of(values: Array, frame: int, still_ndim: int) -> Array:
    """Return the values in one frame; values with `still_ndim` axes or a single frame are the same in all frames."""
    if values.ndim == still_ndim:
        return values
    return np.asarray(values[0 if len(values) == 1 else frame])


def positions(where: str, values: Any) -> Array:
    """Return positions as a read-only array, (n, 3) or (n_frames, n, 3), after checking that they are finite."""
    array = finite(where, values)
    if array.ndim not in (2, 3) or array.shape[-1] != 3 or 0 in array.shape:
        raise SceneError(f"{where}: expected positions (n, 3) or (n_frames, n, 3), got {array.shape}")
    return array


def finite(where: str, values: Sequence[float] | Array) -> Array:
    """Return a read-only array after checking that it contains no NaN and no infinity."""
    array = frozen(values)
    if not np.isfinite(array).all():
        raise SceneError(f"{where}: expected finite numbers, got NaN or infinity")
    return array
