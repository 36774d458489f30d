"""The body in white as a mesh and its job: panels on a frame of thin-walled beams, with carried parts as masses."""

import itertools
from collections.abc import Iterator, Sequence

import numpy as np

from floatframe.machines.road_car.description import RoadCar

__all__ = ["body_files", "interface_nodes"]

Node = tuple[float, float, float]

# coordinates of the panel nodes along, across and up
X_FLOOR = (-0.95, -0.75, -0.55, -0.35, -0.05, 0.20, 0.475, 0.75)
Y_FLOOR = (-0.70, -0.525, -0.35, -0.175, 0.0, 0.175, 0.35, 0.525, 0.70)
Z_FIREWALL = (0.24, 0.42, 0.60, 0.85)
Z_BULKHEAD = (0.24, 0.42, 0.66, 0.90)
X_ROOF = (-0.95, -0.75, -0.55, -0.35, -0.10, 0.15)
Y_ROOF = (-0.58, -0.435, -0.29, -0.145, 0.0, 0.145, 0.29, 0.435, 0.58)
FLOOR, ROOF = 0.24, 1.40

#: closed sections: width, height, wall [m]
SECTIONS = {
    "sill": (0.11, 0.14, 0.0018), "rail": (0.08, 0.12, 0.0022), "pillar": (0.08, 0.08, 0.0016),
    "header": (0.06, 0.05, 0.0012), "brace": (0.06, 0.07, 0.0018), "cross": (0.08, 0.10, 0.0015),
    "tunnel": (0.18, 0.14, 0.0012), "bead": (0.05, 0.04, 0.0010),
}  # fmt: skip
#: panels: thickness [m], and mass per area of the parts fixed to them [kg/m²]
PANELS = {"floor": (0.0010, 18.0), "firewall": (0.0012, 12.0), "bulkhead": (0.0010, 8.0), "roof": (0.0008, 6.0)}
#: carried parts: node, mass [kg], moment of inertia about each axis [kg m²], position relative to the node [m]
CARRIED: dict[str, tuple[Node, float, float, Node]] = {
    "engine_left": ((1.25, 0.45, 0.42), 112.0, 3.0, (0.0, -0.25, 0.05)),
    "engine_right": ((1.25, -0.45, 0.42), 112.0, 3.0, (0.0, 0.25, 0.05)),
    "front_left": ((1.95, 0.45, 0.42), 24.0, 1.5, (0.0, -0.10, 0.10)),
    "front_right": ((1.95, -0.45, 0.42), 24.0, 1.5, (0.0, 0.10, 0.10)),
    "seat_left": ((-0.05, 0.35, FLOOR), 100.0, 4.0, (-0.05, 0.0, 0.35)),
    "seat_right": ((-0.05, -0.35, FLOOR), 100.0, 4.0, (-0.05, 0.0, 0.35)),
    "bench_left": ((-0.75, 0.35, FLOOR), 55.0, 3.0, (-0.05, 0.0, 0.35)),
    "bench_right": ((-0.75, -0.35, FLOOR), 55.0, 3.0, (-0.05, 0.0, 0.35)),
    "door_left": ((-0.05, 0.70, FLOOR), 38.0, 4.0, (0.0, 0.08, 0.45)),
    "door_right": ((-0.05, -0.70, FLOOR), 38.0, 4.0, (0.0, -0.08, 0.45)),
    "dash_left": ((0.75, 0.35, 0.85), 22.0, 0.5, (-0.15, 0.0, -0.10)),
    "dash_right": ((0.75, -0.35, 0.85), 22.0, 0.5, (-0.15, 0.0, -0.10)),
    "tank": ((-0.95, 0.0, FLOOR), 55.0, 1.0, (0.0, 0.0, 0.10)),
    "boot_left": ((-1.95, 0.50, 0.42), 34.0, 2.5, (0.10, -0.15, 0.15)),
    "boot_right": ((-1.95, -0.50, 0.42), 34.0, 2.5, (0.10, 0.15, 0.15)),
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


def body_files(car: RoadCar, *, n_modes: int = 12) -> dict[str, str]:
    """Return mesh and job of the body, by file name, with a number of vibration modes besides the static modes."""
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
    sets |= {f"of_{name}": node(place) for name, (place, *_) in CARRIED.items()}
    lines = ["*HEADING", "body of the road car; x ahead, y left, z up from the ground [m]", "*NODE"]
    lines += [f"{k}, {x:.9g}, {y:.9g}, {z:.9g}" for (x, y, z), k in number.items()]
    count = itertools.count(1)
    for group, of_group in cells.items():
        lines.append(f"*ELEMENT, TYPE={'S4' if group in PANELS else 'B31'}, ELSET={group}")
        lines += [", ".join(map(str, (next(count), *row))) for row in of_group]
    for name, k in sets.items():
        lines += [f"*NSET, NSET={name}", str(k)]
    return {"body.inp": "\n".join(lines) + "\n", "body.toml": job(car, n_modes)}


def job(car: RoadCar, n_modes: int) -> str:
    """Return the job file of the body."""
    text = [
        "# The body of the road car: panels on beams, what it carries as masses, thirteen interfaces.\n"
        '# cms reduce body.toml\n[body]\nname = "body"\nmesh = "body.inp"\nunits = "m-kg-s"\n',
        "[materials.steel]\nyoung = 210e9\npoisson = 0.3\ndensity = 7850.0\n",
    ]
    for name, (thickness, added) in PANELS.items():
        text.append(f'[shells.{name}]\ncells = "{name}"\nthickness = {thickness:g}\nadded_mass = {added:g}\n')
    for name, (width, height, wall) in SECTIONS.items():
        text.append(
            f'[sections.{name}]\nlines = "{name}"\nshape = "box"\nwidth = {width:g}\nheight = {height:g}\n'
            f"web = {wall:g}\nflange = {wall:g}\n"
        )
    for name, (_, mass, inertia, offset) in CARRIED.items():
        x, y, z = offset
        text.append(
            f'[masses.{name}]\nnode = "of_{name}"\nmass = {mass:g}\ninertia = {inertia:g}\n'
            f"offset = [{x:g}, {y:g}, {z:g}]\n"
        )
    for name in interface_nodes(car):
        text.append(f'[interfaces.{name}]\nkind = "rigid"\nnodes = "{name}"\n')
    text.append(
        f'[reduction]\nset = "craig-bampton"\nn_modes = {n_modes}\ngeometric_stiffness = false\nstress = false\n'
    )
    text.append("[damping]\nratio = 0.02\n")
    return "\n".join(text)
