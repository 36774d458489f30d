"""The mesh of the body in white: panels on a frame of thin-walled beams, with nodes for the carried parts."""

import itertools
from collections.abc import Iterator, Sequence

import numpy as np

from floatframe.machines.road_car.description import RoadCar

__all__ = ["body_mesh", "interface_nodes"]

Node = tuple[float, float, float]

# coordinates of the panel nodes along, across and up
X_FLOOR = (-0.95, -0.75, -0.55, -0.35, -0.05, 0.20, 0.475, 0.75)
Y_FLOOR = (-0.70, -0.525, -0.35, -0.175, 0.0, 0.175, 0.35, 0.525, 0.70)
Z_FIREWALL = (0.24, 0.42, 0.60, 0.85)
Z_BULKHEAD = (0.24, 0.42, 0.66, 0.90)
X_ROOF = (-0.95, -0.75, -0.55, -0.35, -0.10, 0.15)
Y_ROOF = (-0.58, -0.435, -0.29, -0.145, 0.0, 0.145, 0.29, 0.435, 0.58)
FLOOR, ROOF = 0.24, 1.40

PANELS = ("floor", "firewall", "bulkhead", "roof")  #: groups of shells; all others are beams
#: nodes of the carried parts
CARRIED: dict[str, Node] = {
    "engine_left": (1.25, 0.45, 0.42),
    "engine_right": (1.25, -0.45, 0.42),
    "front_left": (1.95, 0.45, 0.42),
    "front_right": (1.95, -0.45, 0.42),
    "seat_left": (-0.05, 0.35, FLOOR),
    "seat_right": (-0.05, -0.35, FLOOR),
    "bench_left": (-0.75, 0.35, FLOOR),
    "bench_right": (-0.75, -0.35, FLOOR),
    "door_left": (-0.05, 0.70, FLOOR),
    "door_right": (-0.05, -0.70, FLOOR),
    "dash_left": (0.75, 0.35, 0.85),
    "dash_right": (0.75, -0.35, 0.85),
    "tank": (-0.95, 0.0, FLOOR),
    "boot_left": (-1.95, 0.50, 0.42),
    "boot_right": (-1.95, -0.50, 0.42),
}


def interface_nodes(car: RoadCar) -> dict[str, Node]:
    """Return the positions of the interfaces of the body: towers, mounts of the subframes, cockpit."""
    nodes: dict[str, Node] = {"cockpit": car.cockpit}
    for name in ("front", "rear"):
        axle = car.axle(name)
        for side, s in (("left", 1.0), ("right", -1.0)):
            ends = {"tower": axle.tower, "mount_front": axle.mounts[0], "mount_rear": axle.mounts[1]}
            nodes |= {f"{name}_{end}_{side}": (x, s * y, z) for end, (x, y, z) in ends.items()}
    return nodes


def grids() -> dict[str, list[list[Node]]]:
    """Return the nodes of each panel in rows."""
    return {
        "floor": [[(x, y, FLOOR) for y in Y_FLOOR] for x in X_FLOOR],
        "firewall": [[(0.75, y, z) for y in Y_FLOOR] for z in Z_FIREWALL],
        "bulkhead": [[(-0.95, y, z) for y in Y_FLOOR] for z in Z_BULKHEAD],
        "roof": [[(x, y, ROOF) for y in Y_ROOF] for x in X_ROOF],
    }


def cut(points: Sequence[Node], length: float = 0.2) -> list[Node]:
    """Return the nodes of a line through points, in pieces no longer than a length."""
    line = [points[0]]
    for a, b in itertools.pairwise(np.array(points)):
        n = int(np.ceil(np.linalg.norm(b - a) / length - 1e-9))
        line += [tuple(np.round(a + (b - a) * k / n, 6)) for k in range(1, n + 1)]
    return line


def beams(car: RoadCar) -> Iterator[tuple[str, list[Node]]]:
    """Yield section and nodes of every beam."""
    front, rear = car.front, car.rear
    for s in (1.0, -1.0):

        def at(x: float, y: float, z: float, s: float = s) -> Node:
            return (x, s * y, z)

        yield "sill", [at(x, 0.70, FLOOR) for x in X_FLOOR]
        yield "tunnel", [at(x, 0.175, FLOOR) for x in X_FLOOR]
        y, z = front.mounts[0][1], front.mounts[0][2]
        mounts = [at(x, y, z) for x in (front.mounts[0][0], front.tower[0], front.mounts[1][0])]
        yield "rail", cut([at(1.95, y, z), *mounts, at(0.75, 0.525, z), at(0.75, 0.525, FLOOR)])
        yield "brace", cut([at(0.75, 0.70, 0.85), at(*front.tower), at(front.tower[0], y, z)])
        yield "brace", cut([at(*front.tower), at(1.95, y, z)])
        y, z = rear.mounts[0][1], rear.mounts[0][2]
        mounts = [at(x, y, z) for x in (rear.mounts[0][0], rear.tower[0], rear.mounts[1][0])]
        yield "rail", cut([at(-0.95, 0.70, FLOOR), at(-0.95, 0.525, z), *mounts, at(-1.95, y, z)])
        yield "brace", cut([at(-0.95, 0.70, 0.90), at(*rear.tower), at(rear.tower[0], y, z)])
        yield "brace", cut([at(*rear.tower), at(-1.95, y, z)])
        yield "pillar", [at(0.75, 0.70, z) for z in Z_FIREWALL]
        yield "pillar", cut([at(0.75, 0.70, 0.85), at(0.15, 0.58, ROOF)])
        yield "pillar", cut([at(-0.35, 0.70, FLOOR), at(-0.35, 0.70, 0.85), at(-0.35, 0.58, ROOF)])
        yield "pillar", [at(-0.95, 0.70, z) for z in Z_BULKHEAD]
        yield "pillar", cut([at(-0.95, 0.70, 0.90), at(-0.95, 0.58, ROOF)])
        yield "header", [at(x, 0.58, ROOF) for x in X_ROOF]
        for y in (0.35, 0.525):
            yield "bead", [at(x, y, FLOOR) for x in X_FLOOR]
        for y in (0.175, 0.35):
            yield "bead", [at(0.75, y, z) for z in Z_FIREWALL]
            yield "bead", [at(-0.95, y, z) for z in Z_BULKHEAD]
    for x in X_ROOF:
        yield "header" if x in (0.15, -0.35, -0.95) else "bead", [(x, y, ROOF) for y in Y_ROOF]
    yield "bead", [(0.75, 0.0, z) for z in Z_FIREWALL]
    yield "bead", [(-0.95, 0.0, z) for z in Z_BULKHEAD]
    for x in (0.20, 0.475):
        yield "bead", [(x, y, FLOOR) for y in Y_FLOOR]
    for x in (-0.05, -0.35, -0.75, -0.95):
        yield "cross", [(x, y, FLOOR) for y in Y_FLOOR]
    yield "cross", [(0.75, y, 0.85) for y in Y_FLOOR]
    yield "cross", [(-0.95, y, 0.90) for y in Y_FLOOR]
    for x, y, z in ((1.95, front.mounts[0][1], front.mounts[0][2]), (-1.95, rear.mounts[0][1], rear.mounts[0][2])):
        yield "cross", cut([(x, -y, z), (x, y, z)], 0.25)
    for x, y, z in (front.tower, rear.tower):
        yield "cross", cut([(x, -y, z), (x, y, z)], 0.25)


def body_mesh(car: RoadCar) -> str:
    """Return the mesh of the body (Abaqus), for the job `body.toml`."""
    number: dict[Node, int] = {}

    def node(place: Sequence[float]) -> int:
        key: Node = tuple(round(float(v), 6) + 0.0 for v in place)  # type: ignore[assignment]
        return number.setdefault(key, len(number) + 1)

    cells: dict[str, list[tuple[int, ...]]] = {}
    for panel, rows in grids().items():
        for a, b in itertools.pairwise(rows):
            for k in range(len(a) - 1):
                cells.setdefault(panel, []).append(tuple(map(node, (a[k], a[k + 1], b[k + 1], b[k]))))
    for section, line in beams(car):
        cells.setdefault(section, []).extend((node(a), node(b)) for a, b in itertools.pairwise(line))
    sets = {name: node(place) for name, place in interface_nodes(car).items()}
    sets |= {f"of_{name}": node(place) for name, place in CARRIED.items()}
    lines = ["*HEADING", "body of the road car; x ahead, y left, z up from the ground [m]", "*NODE"]
    lines += [f"{k}, {x:.9g}, {y:.9g}, {z:.9g}" for (x, y, z), k in number.items()]
    count = itertools.count(1)
    for group, of_group in cells.items():
        lines.append(f"*ELEMENT, TYPE={'S4' if group in PANELS else 'B31'}, ELSET={group}")
        lines += [", ".join(map(str, (next(count), *row))) for row in of_group]
    for name, k in sets.items():
        lines += [f"*NSET, NSET={name}", str(k)]
    return "\n".join(lines) + "\n"
