"""The surroundings of a motion in a film: ground, direction of view, boxes of rigid bodies."""

import numpy as np

from cms.assessment.rendering import Lines
from fe_models.foundation.arrays import Array, IntArray
from floatframe.model.bodies.rigid_body import RigidBody
from floatframe.pictures.film_times import round_below

__all__ = ["box_of", "film_size", "ground_grid", "view_axes"]

GRID_COLOR = "#cfd6dc"
WIDTH, LEAST_HEIGHT, MOST_HEIGHT = 960, 480, 720  #: width and range of heights of a film [px]
ROOM = 190  #: height for texts and margins [px]


def box_of(
    body: RigidBody | None, half: float, most: float = np.inf, connections: Array | None = None
) -> tuple[Array, IntArray]:
    """Return corners, (8, 3) in the body frame, and triangles of the box with the body's inertia, or of a cube.

    Half edges are at most `most`, so that a box with a large inertia does not fill the picture; but the box always
    reaches the connections, points in the body frame, (n, 3).

    A box with half edges a, b, c has I_1 = m/3 (b² + c²) and so on, so that a² = 3/(2m) (I_2 + I_3 - I_1).
    """
    axes, center, edges = np.eye(3), np.zeros(3), np.full(3, half)
    if body is not None:
        moments, axes = np.linalg.eigh(body.inertia)
        squares = 1.5 / body.mass * (moments.sum() - 2 * moments)
        center = body.center_of_mass
        points = np.zeros((0, 3)) if connections is None else connections
        reach = np.abs((points - center) @ axes).max(axis=0, initial=0.0)
        edges = np.clip(np.sqrt(np.maximum(squares, 0.0)), 0.02 * half, np.maximum(most, reach))
    signs = np.array([[i, j, k] for i in (-1, 1) for j in (-1, 1) for k in (-1, 1)], dtype=float)
    if np.linalg.det(axes) < 0:
        axes = -axes
    quads = np.array([[0, 1, 3, 2], [4, 6, 7, 5], [0, 4, 5, 1], [2, 3, 7, 6], [0, 2, 6, 4], [1, 5, 7, 3]])
    return center + (signs * edges) @ axes.T, np.concatenate([quads[:, [0, 1, 2]], quads[:, [0, 2, 3]]])


def view_axes(points: Array, up: Array) -> tuple[Array, Array]:
    """Return direction of view and up, (3,) each: across the plane of motion, slightly from above and from the side."""
    up = up / np.linalg.norm(up)
    flat = points - points.mean(axis=0)
    flat = flat - np.outer(flat @ up, up)
    _, vectors = np.linalg.eigh(flat.T @ flat + 1e3 * float((flat**2).sum() + 1e-300) * np.outer(up, up))
    across = vectors[:, 0]
    side = np.cross(up, across)  # to the right in the picture
    if side[np.argmax(np.abs(side))] < 0:
        across, side = -across, -side
    return -(across + 0.33 * up + 0.3 * side), up


def film_size(points: Array, direction: Array, up: Array) -> tuple[int, int]:
    """Return width and height of a film [px]; it is low if the points, (n, 3), are side by side in the given view."""
    forward = direction / np.linalg.norm(direction)
    above = up - (up @ forward) * forward
    above /= np.linalg.norm(above)
    high, wide = np.ptp(points @ above), np.ptp(points @ np.cross(forward, above))
    height = ROOM + 0.75 * WIDTH * high / max(wide, 1e-300)
    return WIDTH, 16 * round(float(np.clip(height, LEAST_HEIGHT, MOST_HEIGHT)) / 16)


def ground_grid(points: Array, up: Array) -> tuple[Lines, float]:
    """Return a square grid below all points, and the spacing of its lines, a round number [m]."""
    heights = points @ up
    first = np.eye(3)[np.argmin(np.abs(up))]
    first = first - (first @ up) * up
    first /= np.linalg.norm(first)
    axes = np.stack([first, np.cross(up, first)])
    spread = points @ axes.T
    reach = float(max(np.ptp(spread, axis=0).max(), np.ptp(heights), 1e-12))
    step = round_below(reach / 6)
    level = heights.min() - 0.06 * reach
    low = np.floor((spread.min(axis=0) - 0.04 * reach) / step) * step
    high = np.ceil((spread.max(axis=0) + 0.04 * reach) / step) * step
    ends = []
    for k in (0, 1):
        for value in np.arange(low[k], high[k] + step / 2, step):
            for other in (low[1 - k], high[1 - k]):
                ends.append(axes[k] * value + axes[1 - k] * other + level * up)
    segments = np.arange(len(ends)).reshape(-1, 2)
    return Lines(segments, np.array(ends), color=GRID_COLOR, width=1.0, is_backdrop=True), step
