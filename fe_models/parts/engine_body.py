"""Parametric body of a four-axle locomotive: shells on beams, equipment as masses, seats of the suspension.

x points forward, y to the left, z up from the top of the rails. The body is symmetric about x = 0 and y = 0. Its walls
are swept along stations of x, y and z that contain every edge, so that a finer mesh keeps the shape.
"""

import itertools
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from fe_models.foundation.arrays import Array, IntArray
from fe_models.meshes.shell_mesh import ShellMesh
from fe_models.parts.lengths import require, require_lengths

__all__ = ["EngineBody", "engine_body_mesh", "mesh_deck"]


BoolArray = NDArray[np.bool_]


@dataclass(frozen=True)
class EngineBody:
    """Dimensions of the body [m]; heights are above the top of the rails."""

    length: float = 18.0  #: length between the end walls
    width: float = 2.9
    floor: float = 1.2  #: height of the floor
    waist: float = 2.05  #: height of the lower edge of the windows
    window_top: float = 2.75
    cantrail: float = 3.4  #: height at which side walls meet the roof
    rise: float = 0.5  #: rise of the roof above the cantrails
    pivot: float = 5.2  #: distance of the bogie pivots from the middle, along x
    seat: float = 1.05  #: distance of the secondary springs from the middle, along y
    bulkhead: float = 6.7  #: distance from the middle to the wall between machine room and cab
    window_start: float = 7.3  #: distance from the middle to the start of the side windows of the cabs
    window_end: float = 8.2
    inner: float = 1.4  #: distance from the middle to the transformer mounts and their frames
    outer: float = 3.4  #: distance from the middle to the converter mounts
    pitch: float = 0.75  #: largest distance between frames

    def __post_init__(self) -> None:
        require_lengths(self)
        xs = (self.inner, self.outer, self.pivot, self.bulkhead, self.window_start, self.window_end, self.length / 2)
        zs = (self.floor, self.waist, self.window_top, self.cantrail)
        for what, row in (
            ("inner < outer < pivot < bulkhead < window_start < window_end < length/2", xs),
            ("floor < waist < window_top < cantrail", zs),
            ("seat < width/2", (self.seat, self.width / 2)),
        ):
            require(
                self, bool((np.diff(row) > 0).all()), f"{what}, got {', '.join(f'{v:g}' for v in row)}", "change one"
            )

    def frames(self) -> Array:
        """Return the positions x >= 0 of the frames, ascending; there is a frame at every edge."""
        edges = (self.inner, self.outer, self.pivot, self.bulkhead, self.window_start, self.window_end)
        return divided((0.0, *edges, self.length / 2), self.pitch)

    def stations(self, size: float) -> tuple[Array, Array, Array]:
        """Return x, y and z (of the side walls) of the nodes, ascending, such that no cell is longer than `size`."""
        x = divided(tuple(self.frames()), size)
        y = divided((0.0, self.seat, self.width / 2), size)
        z = divided((self.floor, self.waist, self.window_top, self.cantrail), size)
        return np.concatenate([-x[:0:-1], x]), np.concatenate([-y[:0:-1], y]), z

    def roof(self, y: Array) -> Array:
        """Return the roof height at positions y; the roof is a parabola."""
        return self.cantrail + self.rise * (1 - (2 * y / self.width) ** 2)


def divided(edges: tuple[float, ...], size: float) -> Array:
    """Return the edges with equal divisions between them that are not longer than `size`, ascending."""
    parts = [
        np.linspace(a, b, max(int(np.ceil((b - a) / size - 1e-9)), 1) + 1)[:-1] for a, b in itertools.pairwise(edges)
    ]
    return np.concatenate([*parts, [edges[-1]]])


def engine_body_mesh(part: EngineBody | None = None, *, size: float = 0.5) -> ShellMesh:
    """Return the mesh of the body, which consists of quads and lines.

    The groups of cells are "floor", "side", "roof", "end" and "bulkhead". The groups of lines are "solebar" and
    "cantrail" (along the edges of floor and roof), "stringer" (along sides and roof), "post" (of end walls and
    bulkheads), "bolster" (across the floor at the pivots), "crossbeam" (across the floor at the other frames) and
    "frame" (up the sides and over the roof). Node sets with one node are "seat_1_left", "seat_1_right", "seat_2_left",
    "seat_2_right" (bogie 1 in front), "pivot_1", "pivot_2", the mounts of the equipment, and points of observation.

    Parameters
    ----------
    part
        Dimensions; None: the defaults.
    size
        Largest edge of a cell [m].

    Raises
    ------
    PartError
        If the size is not positive.
    """
    part = part or EngineBody()
    require(part, 0 < size < np.inf, f"a size above zero, got {size:g}", "choose one of 0.2 to 1 m")
    x, y, z = part.stations(size)
    grid = _Grid(part)
    n_y, n_z = len(y), len(z)
    up = (z - z[0]) / (z[-1] - z[0])

    floor = grid.nodes(np.stack(np.broadcast_arrays(x[:, None], y[None, :], part.floor), axis=-1))
    roof = grid.nodes(np.stack(np.broadcast_arrays(x[:, None], y[None, :], part.roof(y)[None, :]), axis=-1))
    left = grid.nodes(np.stack(np.broadcast_arrays(x[:, None], part.width / 2, z[None, :]), axis=-1))
    right = grid.nodes(np.stack(np.broadcast_arrays(x[:, None], -part.width / 2, z[None, :]), axis=-1))
    middle = 0.5 * (z[:-1] + z[1:])
    is_window_z = (middle > part.waist) & (middle < part.window_top)
    x_cells = np.abs(0.5 * (x[:-1] + x[1:]))
    is_window_x = (x_cells > part.window_start) & (x_cells < part.window_end)
    is_wall = ~(is_window_x[:, None] & is_window_z[None, :])
    grid.quads("floor", floor, outwards=False)
    grid.quads("roof", roof)
    grid.quads("side", left, kept=is_wall, outwards=False)
    grid.quads("side", right, kept=is_wall)
    y_cells = np.abs(0.5 * (y[:-1] + y[1:]))
    is_screen = (y_cells < part.seat)[:, None] & is_window_z[None, :]
    walls = [(0, "end"), (-1, "end"), *((_at(x, sign * part.bulkhead), "bulkhead") for sign in (-1, 1))]
    for at, kind in walls:
        wall = np.empty((n_y, n_z, 3))
        wall[..., 0], wall[..., 1] = x[at], y[:, None]
        wall[..., 2] = part.floor + (part.roof(y) - part.floor)[:, None] * up[None, :]
        index = grid.nodes(wall)
        for place in (-part.seat, 0.0, part.seat):
            grid.line("post", index[_at(y, place)])
        for height in (part.waist, part.window_top):
            grid.line("post", index[:, _at(z, height)])
        grid.quads(kind, index, kept=~is_screen if kind == "end" else None, outwards=x[at] > 0)

    for side in (0, -1):
        grid.line("solebar", floor[:, side])
        grid.line("cantrail", roof[:, side])
    for row in (part.waist, part.window_top):
        grid.line("stringer", left[:, _at(z, row)])
        grid.line("stringer", right[:, _at(z, row)])
    for row in (-part.seat, 0.0, part.seat):
        grid.line("stringer", roof[:, _at(y, row)])
    for k in sorted({_at(x, sign * place) for sign in (-1, 1) for place in part.frames()}):
        is_bolster = np.isclose(abs(x[k]), part.pivot)
        grid.line("bolster" if is_bolster else "crossbeam", floor[k])
        for row in (left[k], right[k], roof[k]):
            grid.line("frame", row)
    sets = _places(part, x, y, floor, roof, left, right)
    return grid.mesh(sets, f"engine body, {part.length:g} m, cells of {size:g} m")


def _places(
    part: EngineBody, x: Array, y: Array, floor: IntArray, roof: IntArray, left: IntArray, right: IntArray
) -> dict[str, int]:
    """Return the nodes of suspension, equipment and observation points, by name."""
    found: dict[str, int] = {}
    seats, edge = (("left", _at(y, part.seat)), ("right", _at(y, -part.seat))), (("left", -1), ("right", 0))
    for number, sign in ((1, 1), (2, -1)):
        end = -1 if sign > 0 else 0
        pivot, bulkhead = _at(x, sign * part.pivot), _at(x, sign * part.bulkhead)
        found[f"pivot_{number}"] = floor[pivot, _at(y, 0.0)]
        found[f"cab_{number}"] = floor[end, _at(y, 0.0)]
        for word, j in seats:
            found[f"seat_{number}_{word}"] = floor[pivot, j]
            found[f"converter_{number}_inner_{word}"] = floor[_at(x, sign * part.inner), j]
            found[f"converter_{number}_outer_{word}"] = floor[_at(x, sign * part.outer), j]
            found[f"cooler_{number}_{word}"] = floor[bulkhead, j]
        for word, j in edge:
            found[f"transformer_{number}_{word}"] = floor[_at(x, sign * part.inner), j]
            found[f"headstock_{number}_{word}"] = floor[end, j]
            found[f"underfloor_{number}_{word}"] = floor[_at(x, sign * part.outer), j]
    middle = _at(x, 0.0)
    found |= {"roof_middle": roof[middle, _at(y, 0.0)], "floor_middle": floor[middle, _at(y, 0.0)]}
    found |= {"cantrail_left": left[middle, -1], "cantrail_right": right[middle, -1]}
    return found


def _at(stations: Array, value: float) -> int:
    return int(np.abs(stations - value).argmin())


class _Grid:
    """Nodes shared by walls, and cells and lines, during construction of the mesh."""

    def __init__(self, part: EngineBody) -> None:
        self.part = part
        self.number: dict[tuple[float, ...], int] = {}
        self.cells: list[IntArray] = []
        self.cell_groups: dict[str, list[int]] = {}
        self.lines: list[tuple[int, int]] = []
        self.line_groups: dict[str, list[int]] = {}

    def nodes(self, points: Array) -> IntArray:
        """Return the node numbers of points (..., 3); a point that already exists keeps its number."""
        keys = [tuple(row) for row in np.round(points.reshape(-1, 3), 6).tolist()]
        found = [self.number.setdefault(key, len(self.number)) for key in keys]
        return np.array(found, dtype=np.int64).reshape(points.shape[:-1])

    def quads(self, group: str, index: IntArray, *, kept: BoolArray | None = None, outwards: bool = True) -> None:
        """Add the cells of a grid of nodes; with `outwards` the normal is right-handed about its two directions."""
        cells = np.stack([index[:-1, :-1], index[1:, :-1], index[1:, 1:], index[:-1, 1:]], axis=-1)
        cells = cells[kept] if kept is not None else cells.reshape(-1, 4)
        first = sum(len(rows) for rows in self.cells)
        self.cells.append(cells if outwards else cells[:, ::-1])
        self.cell_groups.setdefault(group, []).extend(range(first, first + len(cells)))

    def line(self, group: str, nodes: IntArray) -> None:
        """Add lines between successive nodes."""
        ends = [(int(a), int(b)) for a, b in itertools.pairwise(nodes)]
        self.line_groups.setdefault(group, []).extend(range(len(self.lines), len(self.lines) + len(ends)))
        self.lines += ends

    def mesh(self, sets: dict[str, int], source: str) -> ShellMesh:
        """Return the mesh."""
        cells, lines = np.concatenate(self.cells), np.array(self.lines, dtype=np.int64)
        used = np.unique(np.concatenate([cells.ravel(), lines.ravel()]))  # unused nodes lie inside windows
        place = np.full(len(self.number), -1)
        place[used] = np.arange(len(used))
        return ShellMesh(
            nodes=np.array(list(self.number), dtype=float)[used],
            cells={"quad": place[cells]},
            cell_sets={name: {"quad": np.array(rows)} for name, rows in self.cell_groups.items()},
            lines=place[lines],
            line_sets={name: np.array(rows) for name, rows in self.line_groups.items()},
            node_sets={name: place[[node]] for name, node in sets.items()},
            source=source,
        )


def mesh_deck(mesh: ShellMesh) -> str:
    """Return quads, lines and groups as an Abaqus deck without other data; lines are numbered after quads."""
    return "\n".join(_deck(mesh)) + "\n"


def _deck(mesh: ShellMesh) -> Iterator[str]:
    yield "*HEADING"
    yield f"{mesh.source}; x forwards, y left, z up from the rails [m]"
    yield "*NODE"
    for k, (a, b, c) in enumerate(mesh.nodes.tolist(), start=1):
        yield f"{k}, {a:.9g}, {b:.9g}, {c:.9g}"
    number = 0
    for group, by_type in mesh.cell_sets.items():
        yield f"*ELEMENT, TYPE=S4, ELSET={group}"
        for cell in (mesh.cells["quad"][by_type["quad"]] + 1).tolist():
            number += 1
            yield ", ".join(map(str, [number, *cell]))
    for group, rows in mesh.line_sets.items():
        yield f"*ELEMENT, TYPE=B31, ELSET={group}"
        for ends in (mesh.lines[rows] + 1).tolist():
            number += 1
            yield ", ".join(map(str, [number, *ends]))
    for group, nodes in mesh.node_sets.items():
        yield f"*NSET, NSET={group}"
        yield ", ".join(map(str, (nodes + 1).tolist()))
