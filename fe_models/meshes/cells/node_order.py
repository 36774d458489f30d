"""Whether the nodes of the cells stand where their type has them, and the order of mirrored cells."""

import numpy as np

from fe_models.errors import MeshError
from fe_models.foundation.arrays import Array, IntArray
from fe_models.meshes.cell_shapes import CELL_SHAPES, cell_jacobians

__all__ = ["mirrored_cells", "mirrored_order", "require_node_order", "turned_upright"]

_REFLECTED_CORNERS = {
    "tetra": (0, 2, 1, 3),
    "tetra10": (0, 2, 1, 3),
    "hexahedron": (0, 3, 2, 1, 4, 7, 6, 5),
    "hexahedron20": (0, 3, 2, 1, 4, 7, 6, 5),
    "hexahedron27": (0, 3, 2, 1, 4, 7, 6, 5),
    "wedge": (0, 2, 1, 3, 5, 4),
    "wedge15": (0, 2, 1, 3, 5, 4),
    "pyramid": (0, 3, 2, 1, 4),
    "pyramid13": (0, 3, 2, 1, 4),
}
_CHUNK = 20_000  #: cells judged at a time, so that a million dofs need 100 MB


def require_node_order(where: str, kind: str, nodes: Array, cells: IntArray) -> None:
    """Raise `MeshError` if the middle nodes of most cells stand nearest to the middle of another edge or face.

    A wrong order is systematic: the same place is wrong in (nearly) all cells. Single cells whose middle node was
    dragged across a thin edge are left to the mesh report.
    """
    middles = CELL_SHAPES[kind].middles
    if not middles:
        return
    n_corners = len(CELL_SHAPES[kind].corners)
    wrong = np.zeros(len(middles), dtype=np.int64)
    found = np.zeros((len(middles), len(middles)), dtype=np.int64)
    for start in range(0, len(cells), _CHUNK):
        X = nodes[cells[start : start + _CHUNK]]
        expected = np.stack([X[:, list(parents)].mean(axis=1) for parents in middles], axis=1)
        own = np.linalg.norm(X[:, n_corners:] - expected, axis=2)
        size = np.linalg.norm(np.ptp(X[:, :n_corners], axis=1), axis=1)
        doubtful = np.flatnonzero((own > 0.05 * size[:, None]).any(axis=1))
        if doubtful.size == 0:
            continue
        far = np.linalg.norm(X[doubtful, n_corners:, None] - expected[doubtful, None], axis=3)
        nearest = far.argmin(axis=2)
        clear = far.min(axis=2) < 0.5 * own[doubtful]
        wrong += clear.sum(axis=0)
        for place in range(len(middles)):
            found[place] += np.bincount(nearest[clear[:, place], place], minlength=len(middles))
    if wrong.max() > len(cells) / 2:
        place = int(wrong.argmax())
        other = middles[int(found[place].argmax())]
        raise MeshError(
            f"{where}: the middle nodes of {kind} cells are in another order than this file format has: "
            f"node {n_corners + place + 1} of the cells should lie between their nodes "
            f"{_numbers(middles[place])}, in {wrong[place]} of {len(cells)} cells it lies between nodes "
            f"{_numbers(other)}; export the mesh again with the node order of the format"
        )


def _numbers(local: tuple[int, ...]) -> str:
    return " and ".join(str(k + 1) for k in local)


def mirrored_order(kind: str) -> IntArray:
    """Return the local node order that turns a cell inside out and keeps middles between their corners, (n_nodes,)."""
    corners = _REFLECTED_CORNERS[kind]
    n_corners = len(corners)
    place = {frozenset(parents): n_corners + k for k, parents in enumerate(CELL_SHAPES[kind].middles)}
    middles = [place[frozenset(corners[p] for p in parents)] for parents in CELL_SHAPES[kind].middles]
    return np.array([*corners, *middles], dtype=np.int64)


def mirrored_cells(kind: str, nodes: Array, cells: IntArray) -> bool:
    """Whether every cell is numbered inside out: a negative Jacobian at the middle of all of them."""
    return bool(_is_mirrored(kind, nodes, cells).all())


def turned_upright(kind: str, nodes: Array, cells: IntArray) -> IntArray:
    """Return the cells, each that is numbered inside out turned: for programs to which both senses are one."""
    upright = cells.copy()
    for start in range(0, len(cells), _CHUNK):
        rows = start + np.flatnonzero(_is_mirrored(kind, nodes, cells[start : start + _CHUNK]))
        upright[rows] = cells[rows][:, mirrored_order(kind)]
    return upright


def _is_mirrored(kind: str, nodes: Array, cells: IntArray) -> np.ndarray:
    """Whether the Jacobian at the middle of each cell is negative, (n_cells,) bool."""
    middle = CELL_SHAPES[kind].nodes[: len(CELL_SHAPES[kind].corners)].mean(axis=0)[None]
    return np.asarray(cell_jacobians(kind, nodes[cells], middle)[:, 0] < 0)
