"""Petal and strut of the antenna as files: mesh, tables and jobs."""

import numpy as np

from floatframe.machines.antenna.description import Antenna

__all__ = ["petal_job", "petal_mesh", "strut_files", "strut_job"]


def petal_mesh(antenna: Antenna) -> str:
    """Return the mesh of a petal (Abaqus): a strip of quads along x, width along y, with a rib on its middle line."""
    n, m = antenna.n_along, antenna.n_across
    x = np.linspace(0.0, antenna.petal_length, n + 1)
    y = np.linspace(-0.5, 0.5, m + 1) * antenna.petal_width

    def number(i: int, j: int) -> int:
        return 1 + i * (m + 1) + j

    lines = ["*NODE"]
    lines += [f"{number(i, j)}, {x[i]:.6g}, {y[j]:.6g}, 0" for i in range(n + 1) for j in range(m + 1)]
    lines.append("*ELEMENT, TYPE=S4, ELSET=SKIN")
    for i in range(n):
        for j in range(m):
            corners = number(i, j), number(i + 1, j), number(i + 1, j + 1), number(i, j + 1)
            lines.append(", ".join(map(str, (1 + i * m + j, *corners))))
    lines.append("*ELEMENT, TYPE=B31, ELSET=RIB")
    lines += [f"{1001 + i}, {number(i, m // 2)}, {number(i + 1, m // 2)}" for i in range(n)]
    elbow = round(antenna.geometry.elbow / antenna.petal_length * n)
    lines += ["*NSET, NSET=ROOT", str(number(0, m // 2)), "*NSET, NSET=ELBOW", str(number(elbow, m // 2)),
              "*NSET, NSET=TIP", str(number(n, m // 2))]  # fmt: skip
    return "\n".join(lines) + "\n"


PETAL_JOB = """\
# A petal of the antenna: a skin of aluminium with a box rib on its middle line, from its hinge along x.
[body]
name = "petal"
mesh = "petal.inp"
units = "m-kg-s"
keep = ["TIP"]

[materials.aluminium]
young = 70e9
poisson = 0.33
density = 2700.0
cells = "all"

[shells.skin]
cells = "SKIN"
thickness = 0.0015

[sections.rib]
lines = "RIB"
shape = "box"
width = 0.03
height = 0.06
web = 0.0015
flange = 0.0015
offset = [0.0, -0.03]
orientation = [0, 1, 0]

[interfaces.root]
kind = "rigid"
nodes = "ROOT"

[interfaces.elbow]
kind = "rigid"
nodes = "ELBOW"

[reduction]
set = "craig-bampton"
n_modes = PETAL_MODES
frame = "nodal"
at = "root"

[damping]
ratio = 0.005
"""

STRUT_JOB = """\
# A strut of the antenna: an aluminium tube from its foot at the slider along x to the elbow of a petal.
[body]
name = "strut"
nodes = "strut_nodes.csv"
lines = "strut_lines.csv"
units = "m-kg-s"

[materials.aluminium]
young = 70e9
poisson = 0.33
density = 2700.0

[sections.tube]
shape = "tube"
radius = 0.015
thickness = 0.0015
orientation = [0, 1, 0]

[interfaces.foot]
kind = "rigid"
nodes = "foot"

[interfaces.head]
kind = "rigid"
nodes = "head"

[reduction]
set = "craig-bampton"
n_modes = STRUT_MODES
frame = "nodal"
at = "foot"

[damping]
ratio = 0.005
"""


def petal_job(antenna: Antenna) -> str:
    """Return the job of a petal."""
    return PETAL_JOB.replace("PETAL_MODES", str(antenna.petal_modes))


def strut_job(antenna: Antenna) -> str:
    """Return the job of a strut."""
    return STRUT_JOB.replace("STRUT_MODES", str(antenna.strut_modes))


def strut_files(antenna: Antenna) -> dict[str, str]:
    """Return the tables of the tube of a strut by file name."""
    nodes = f"node, x, y, z, sets\n1, 0, 0, 0, foot\n2, {antenna.geometry.strut:.6g}, 0, 0, head\n"
    return {"strut_nodes.csv": nodes, "strut_lines.csv": "node1, node2, elements\n1, 2, 8\n"}
