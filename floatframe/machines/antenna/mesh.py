"""The mesh of a petal of the antenna."""

import numpy as np

__all__ = ["petal_mesh"]


def petal_mesh(
    *, length: float = 4.0, width: float = 0.3, elbow: float = 1.2, n_along: int = 20, n_across: int = 2
) -> str:
    """Return the mesh of a petal (Abaqus): a strip of quads along x, width along y, with a rib on its middle line.

    Parameters
    ----------
    length, width
        Of the petal [m].
    elbow
        Distance from the hinge to the node of the strut [m].
    n_along, n_across
        Numbers of cells.
    """
    n, m = n_along, n_across
    x = np.linspace(0.0, length, n + 1)
    y = np.linspace(-0.5, 0.5, m + 1) * width

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
    lines += ["*NSET, NSET=ROOT", str(number(0, m // 2)), "*NSET, NSET=ELBOW",
              str(number(round(elbow / length * n), m // 2)), "*NSET, NSET=TIP", str(number(n, m // 2))]  # fmt: skip
    return "\n".join(lines) + "\n"
