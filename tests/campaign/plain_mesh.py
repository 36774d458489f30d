"""Meshes of tet4 written and read by the campaign itself, independently of the importers."""

import itertools
import re
from collections.abc import Callable, Iterator

import numpy as np

__all__ = ["FORMATS", "MeshReading", "bar", "read_plain"]

Nodes = dict[int, tuple[float, float, float]]
Tets = list[tuple[int, ...]]
MeshReading = tuple[Nodes, Tets]
SIDES = (3, 1, 1)
SIZE = (30.0, 10.0, 8.0)


def bar() -> tuple[np.ndarray, np.ndarray]:
    """Return nodes (16, 3) and tetrahedra (18, 4) of a bar of 30 x 10 x 8, six in each of its three bricks."""
    steps = [np.linspace(0, length, n + 1) for length, n in zip(SIZE, SIDES, strict=True)]
    nodes = np.array(list(itertools.product(*steps)))
    number = np.arange(len(nodes)).reshape([n + 1 for n in SIDES])
    tets = []
    for k in range(SIDES[0]):
        corner = number[k : k + 2, 0:2, 0:2]
        for order in itertools.permutations(range(3)):
            path = [np.zeros(3, int)]
            for axis in order:
                path.append(path[-1] + np.eye(3, dtype=int)[axis])
            tet = [int(corner[tuple(p)]) for p in path]
            a, b, c, d = nodes[tet]
            if np.dot(np.cross(b - a, c - a), d - a) < 0:
                tet[2], tet[3] = tet[3], tet[2]
            tets.append(tet)
    return nodes, np.array(tets)


def msh(nodes: np.ndarray, tets: np.ndarray) -> str:
    """Return the bar as Gmsh writes it in ASCII, version 2.2."""
    lines = [
        "$MeshFormat",
        "2.2 0 8",
        "$EndMeshFormat",
        "$PhysicalNames",
        "1",
        '3 1 "bar"',
        "$EndPhysicalNames",
        "$Nodes",
    ]
    lines += [str(len(nodes)), *(f"{k + 1} {x!r} {y!r} {z!r}" for k, (x, y, z) in enumerate(nodes.tolist()))]
    lines += ["$EndNodes", "$Elements", str(len(tets))]
    lines += [f"{k + 1} 4 2 1 1 " + " ".join(str(n + 1) for n in tet) for k, tet in enumerate(tets.tolist())]
    return "\n".join([*lines, "$EndElements", ""])


def inp(nodes: np.ndarray, tets: np.ndarray) -> str:
    """Return the bar as an Abaqus input file."""
    lines = ["*NODE", *(f"{k + 1}, {x!r}, {y!r}, {z!r}" for k, (x, y, z) in enumerate(nodes.tolist()))]
    lines += ["*ELEMENT, TYPE=C3D4, ELSET=bar"]
    lines += [f"{k + 1}, " + ", ".join(str(n + 1) for n in tet) for k, tet in enumerate(tets.tolist())]
    return "\n".join([*lines, ""])


def bdf(nodes: np.ndarray, tets: np.ndarray) -> str:
    """Return the bar as a Nastran bulk data file in free format."""
    lines = ["BEGIN BULK", *(f"GRID,{k + 1},,{x!r},{y!r},{z!r}" for k, (x, y, z) in enumerate(nodes.tolist()))]
    lines += [f"CTETRA,{k + 1},1," + ",".join(str(n + 1) for n in tet) for k, tet in enumerate(tets.tolist())]
    return "\n".join([*lines, "ENDDATA", ""])


FORMATS: dict[str, Callable[[np.ndarray, np.ndarray], str]] = {"msh": msh, "inp": inp, "bdf": bdf}


def read_plain(text: str, suffix: str) -> MeshReading:
    """Return node number -> place and the tetrahedra; `ValueError` where the text is not of the plain form above."""
    readers = {"msh": read_msh, "inp": read_inp, "bdf": read_bdf}
    nodes, tets = readers[suffix]([line.strip() for line in text.split("\n") if line.strip()])
    if any(n not in nodes for tet in tets for n in tet) or not tets:
        raise ValueError("unknown node")
    return nodes, tets


def read_msh(lines: list[str]) -> MeshReading:
    """Read version 2.2 in ASCII."""
    start = {line: k for k, line in enumerate(lines) if line.startswith("$")}
    first, n = start["$Nodes"] + 2, int(lines[start["$Nodes"] + 1])
    if lines[first + n] != "$EndNodes":
        raise ValueError("count of nodes")
    nodes = added(split.split() for split in lines[first : first + n])
    first, n = start["$Elements"] + 2, int(lines[start["$Elements"] + 1])
    tets = []
    for line in lines[first : first + n]:
        words = [int(word) for word in line.split()]
        if words[1] == 4:
            tets.append(tuple(words[3 + words[2] :]))
    return nodes, checked(tets)


def read_inp(lines: list[str]) -> MeshReading:
    """Read *NODE and *ELEMENT of C3D4."""
    nodes, tets, block = [], [], ""
    for line in lines:
        if line.startswith("**"):
            continue
        if line.startswith("*"):
            block = line.upper().replace(" ", "")
        elif block.startswith("*NODE") and not block.startswith("*NODEP"):
            nodes.append(re.split(r"\s*,\s*", line.rstrip(",")))
        elif block.startswith("*ELEMENT") and "TYPE=C3D4," in block + ",":
            tets.append(tuple(int(word) for word in line.rstrip(",").split(",")[1:]))
    return added(nodes), checked(tets)


def read_bdf(lines: list[str]) -> MeshReading:
    """Read GRID and CTETRA in free format."""
    nodes, tets = [], []
    for line in lines:
        words = [word.strip() for word in line.split(",")]
        if words[0] == "GRID":
            if words[2] not in ("", "0"):
                raise ValueError("coordinate system")
            nodes.append([words[1], *(word or "0" for word in words[3:6])])
        elif words[0] == "CTETRA":
            tets.append(tuple(int(word) for word in words[3:] if word))
    return added(nodes), checked(tets)


def added(rows: object) -> Nodes:
    """Return nodes by number; two of one number are refused."""
    nodes: Nodes = {}
    for row in rows:  # type: ignore[attr-defined]
        number, (x, y, z) = int(row[0]), (float(word) for word in row[1:4])
        if number in nodes and nodes[number] != (x, y, z):
            raise ValueError("node number twice")
        nodes[number] = (x, y, z)
    return nodes


def checked(tets: Tets) -> Tets:
    """Return tetrahedra of four nodes."""
    if any(len(tet) != 4 for tet in tets):
        raise ValueError("nodes of an element")
    return tets


def numbers_of(tets: Tets) -> Iterator[int]:
    """Yield the node numbers in use."""
    yield from {n for tet in tets for n in tet}
