"""Camera: a position from which every frame fits into the picture, and the projection of points."""

from dataclasses import dataclass

import numpy as np

from cms.assessment.rendering.scene import Scene
from fe_models.foundation.arrays import Array

__all__ = ["Camera", "fitted_camera"]

VIEW_ANGLE = 16.0  #: vertical angle of view [deg]; it is narrow, so that parallel edges stay nearly parallel
FILL = 0.92  #: share of the picture that the scene may fill


@dataclass(frozen=True, eq=False)
class Camera:
    """Pinhole camera."""

    eye: Array  #: position of the eye, (3,) [m]
    axes: Array  #: unit vectors right, up and forward as rows, (3, 3)
    distance: float  #: distance from the eye to the centre of the scene [m]
    size: tuple[int, int]  #: width and height [px]

    @property
    def focal_point(self) -> Array:
        """Centre of the scene, at which the camera points, (3,) [m]."""
        return np.asarray(self.eye + self.distance * self.axes[2])

    @property
    def towards_eye(self) -> Array:
        """Unit vectors right, up and towards the eye as rows, (3, 3)."""
        return self.axes * np.array([[1.0], [1.0], [-1.0]])

    @property
    def pixels(self) -> float:
        """Focal length in pixels [px]."""
        return float(self.size[1] / 2 / np.tan(np.deg2rad(VIEW_ANGLE) / 2))

    def project(self, points: Array) -> Array:
        """Return x (to the right), y (down) [px] and depth [m] of points; shape (..., 3) for both."""
        seen = (points - self.eye) @ self.axes.T
        scale = self.pixels / seen[..., 2]
        x = self.size[0] / 2 + scale * seen[..., 0]
        y = self.size[1] / 2 - scale * seen[..., 1]
        return np.stack([x, y, seen[..., 2]], axis=-1)


def fitted_camera(scene: Scene, size: tuple[int, int]) -> Camera:
    """Return a camera along the view direction of the scene that shows every point of every frame but of a backdrop.

    A point at (x, y, z) from the centre, in camera axes, is visible if |x| <= a_x (d + z) and |y| <= a_y (d + z), where
    d is the distance of the centre. The required d is a maximum over the points. The centre is then moved to the middle
    of the picture, twice, which suffices for a long lens.
    """
    forward = scene.direction / np.linalg.norm(scene.direction)
    right = np.cross(forward, scene.up)
    right /= np.linalg.norm(right)
    axes = np.stack([right, np.cross(right, forward), forward])
    x, y, z = axes @ seen_points(scene).T
    tan_y = FILL * np.tan(np.deg2rad(VIEW_ANGLE) / 2)
    tan_x = tan_y * size[0] / size[1]
    middle = np.array([(values.min() + values.max()) / 2 for values in (x, y, z)])
    for turn in range(4):
        distance = max(
            fitting_distance(x - middle[0], z - middle[2], tan_x), fitting_distance(y - middle[1], z - middle[2], tan_y)
        )
        distance = distance if distance > 0 else 1.0  # every distance is valid for a single point
        if turn < 3:
            depth = z + (distance - middle[2])
            for k, values in enumerate((x, y)):
                seen = (values - middle[k]) / depth
                middle[k] += (seen.min() + seen.max()) / 2 * distance
    return Camera(eye=axes.T @ middle - distance * forward, axes=axes, distance=distance, size=size)


def fitting_distance(across: Array, depth: Array, tangent: float) -> float:
    """Return the smallest distance at which points fit between the tangents ±`tangent` in one direction."""
    return float((np.abs(across) / tangent - depth).max())


def seen_points(scene: Scene) -> Array:
    """Return the points that must be in the picture, (n, 3): all nodes, since bounding boxes would waste space.

    A backdrop, such as a ground, may reach beyond the picture.
    """
    lines = [lines for lines in scene.lines if not lines.is_backdrop or not scene.surfaces]
    found = [surface.nodes[..., np.unique(surface.triangles), :].reshape(-1, 3) for surface in scene.surfaces]
    found += [each.points[..., np.unique(each.segments), :].reshape(-1, 3) for each in lines]
    return np.concatenate([part for part in found if len(part)])
