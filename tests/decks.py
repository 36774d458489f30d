"""Meshes and jobs as files, for tests of the command line."""

from pathlib import Path

from fe_models.meshes.mesh import Mesh

ABAQUS = {
    "tetra": "C3D4", "tetra10": "C3D10", "hexahedron": "C3D8", "hexahedron20": "C3D20", "wedge": "C3D6",
    "wedge15": "C3D15",
}  # fmt: skip

JOB = """
[body]
mesh = "bar.inp"
units = "mm-t-s"

[materials.steel]
young = 210000
poisson = 0.3
density = 7.85e-9

[interfaces.left]
kind = "rigid"
nodes = "left"

[interfaces.right]
kind = "distributing"
plane = {point = [100, 0, 0], normal = [1, 0, 0]}

[reduction]
n_modes = 3
frame = "nodal"
at = "left"

[damping]
ratio = 0.01
"""


def write_deck(path: Path, mesh: Mesh) -> Path:
    """Write nodes, cells, groups of cells and groups of nodes as an Abaqus deck."""
    lines = ["*NODE"]
    lines += [f"{k + 1}, " + ", ".join(repr(float(x)) for x in node) for k, node in enumerate(mesh.nodes)]
    number, numbers = 0, {}
    for kind, cells in mesh.cells.items():
        lines.append(f"*ELEMENT, TYPE={ABAQUS[kind]}")
        for row, cell in enumerate(cells):
            number += 1
            numbers[kind, row] = number
            words = [str(n) for n in [number, *(cell + 1)]]
            lines += [", ".join(words[k : k + 10]) + "," * (k + 10 < len(words)) for k in range(0, len(words), 10)]
    for name, by_type in mesh.cell_sets.items():
        lines += [f'*ELSET, ELSET="{name}"']
        lines += [str(numbers[kind, row]) for kind, rows in by_type.items() for row in rows.tolist()]
    for name, nodes in mesh.node_sets.items():
        lines += [f'*NSET, NSET="{name}"', *(str(node + 1) for node in nodes)]
    path.write_text("\n".join(lines) + "\n", encoding="utf-8")
    return path
