"""The flexible bogie frame: side members, a transom and posts at the springs, as beams."""

from collections.abc import Mapping
from itertools import pairwise

import numpy as np

from floatframe.machines.bogie.vehicle import RailVehicle

__all__ = ["frame_files"]

SIDE = {"width": 0.18, "height": 0.26, "web": 0.012, "flange": 0.014}  #: box of the side members and posts [m]
TRANSOM = {"width": 0.30, "height": 0.26, "web": 0.012, "flange": 0.014}
DENSITY = 7850.0


def area(section: dict[str, float]) -> float:
    """Return the area of a box section [m²]."""
    inner = (section["width"] - 2 * section["web"]) * (section["height"] - 2 * section["flange"])
    return section["width"] * section["height"] - inner


def frame_files(
    data: RailVehicle,
    axle_height: float = 0.46,
    supports: Mapping[str, tuple[float, float, float]] | None = None,
) -> dict[str, str]:
    """Return the job of the frame and its tables, by file name.

    Brackets, brake gear and dampers are represented by a mass per length, with which the frame has its total mass.
    Interfaces: four seats of the axle boxes (leading_left, ...), two of the air springs (air_left, air_right), and the
    pivot. The origin is at the height of the rails, below the pivot. `supports` are further interfaces by name, each on
    a bracket (a box section as in the side members) that starts at the transom.
    """
    b, a, h = data.wheelbase, data.primary_arm, data.frame_height
    nodes: dict[str, tuple[float, float, float]] = {"pivot": (0.0, 0.0, h)}
    lines: list[tuple[str, str, str, int]] = []
    supports = supports or {}
    for side, hand in ((1, "left"), (-1, "right")):
        nodes[f"middle_{hand}"] = (0.0, side * a, h)
        nodes[f"air_{hand}"] = (0.0, side * data.secondary_arm, data.secondary_height)
        lines.append((f"middle_{hand}", f"air_{hand}", "side", 1))
        lines.extend(transom_lines(nodes, {side * y for _, y, _ in supports.values()}, side, hand, a, h))
        for end, word in ((1, "leading"), (-1, "trailing")):
            nodes[f"end_{word}_{hand}"] = (end * b, side * a, h)
            nodes[f"{word}_{hand}"] = (end * b, side * a, axle_height)
            lines.append((f"middle_{hand}", f"end_{word}_{hand}", "side", 5))
            lines.append((f"end_{word}_{hand}", f"{word}_{hand}", "side", 1))
    for name, (x, y, z) in supports.items():
        nodes[name] = (x, y, z)
        lines.append((transom_node(y), name, "side", 2))
    place = {name: np.array(point) for name, point in nodes.items()}
    length = sum(float(np.linalg.norm(place[one] - place[other])) for one, other, _, _ in lines)
    steel = sum(
        float(np.linalg.norm(place[one] - place[other])) * DENSITY * area(SIDE if group == "side" else TRANSOM)
        for one, other, group, _ in lines
    )
    added = (data.frame_mass - steel) / length
    number = {name: k for k, name in enumerate(nodes, start=1)}
    job = [
        "# The frame of a bogie: beams between the seats of its springs, reduced by Craig-Bampton.",
        '[body]\nname = "frame"\nnodes = "frame_nodes.csv"\nlines = "frame_lines.csv"\nunits = "m-kg-s"\n',
        f"[materials.steel]\nyoung = 2.1e11\npoisson = 0.3\ndensity = {DENSITY}\n",
    ]
    for name, section in (("side", SIDE), ("transom", TRANSOM)):
        values = "\n".join(f"{key} = {value}" for key, value in section.items())
        job.append(f'[sections.{name}]\nshape = "box"\nlines = "{name}"\n{values}\nadded_mass = {added:.6f}\n')
    for name in nodes:
        if not name.startswith(("middle", "end", "transom")):
            job.append(f'[interfaces.{name}]\nkind = "rigid"\nnodes = "{name}"\n')
    job.append('[reduction]\nset = "craig-bampton"\nn_modes = 6\n\n[damping]\nratio = 0.01\n')
    table = ["node, x, y, z, sets", *(f"{number[n]}, {x:g}, {y:g}, {z:g}, {n}" for n, (x, y, z) in nodes.items())]
    cut = ["node1, node2, group, elements", *(f"{number[i]}, {number[j]}, {g}, {n}" for i, j, g, n in lines)]
    return {
        "frame.toml": "\n".join(job),
        "frame_nodes.csv": "\n".join(table) + "\n",
        "frame_lines.csv": "\n".join(cut) + "\n",
    }


def transom_node(y: float) -> str:
    """Return the name of the transom node at y."""
    return "pivot" if y == 0 else f"transom_{1e3 * y:+.0f}"


def transom_lines(
    nodes: dict[str, tuple[float, float, float]], where: set[float], side: int, hand: str, arm: float, height: float
) -> list[tuple[str, str, str, int]]:
    """Return the lines of half a transom with a node at each of the distances `where`; these nodes are added."""
    stops = sorted(y for y in where if 0 < y < arm)
    for y in stops:
        nodes[transom_node(side * y)] = (0.0, side * y, height)
    names = ["pivot", *(transom_node(side * y) for y in stops), f"middle_{hand}"]
    n = 4 if not stops else 2
    return [(one, other, "transom", n) for one, other in pairwise(names)]
