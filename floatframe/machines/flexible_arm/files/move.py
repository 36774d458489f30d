"""The move of the arm in this folder, optimised with and without modes and applied to the arm with all modes.

Writes move.png, move.txt and move.csv beside itself; needs the extra casadi.
"""

from pathlib import Path

import numpy as np

from fe_models.foundation.documents.table import Table
from floatframe.machines.flexible_arm import compared, links, moves, plot_motions

if __name__ == "__main__":
    here = Path(__file__).parent
    parts = links(here)
    found = moves(parts)
    told = []
    for name, move in found.items():
        largest = ", ".join(f"{x:.2f}" for x in np.abs(move.torque).max(axis=0))
        told.append(f"{name}: {move.iterations} iterations, cost {move.cost:.4f}, largest torques {largest} N m")
    motions = compared(parts, found)
    for name, each in motions.items():
        told.append(f"{name}: error of the tip up to {1e3 * each.residual:.2f} mm after the move")
    (here / "move.txt").write_text("\n".join(told) + "\n")
    plot_motions(motions).savefig(here / "move.png", dpi=110)
    move = found["flexible"]
    columns = {"t": move.t, "shoulder": move.torque[:, 0], "elbow": move.torque[:, 1]}
    Table(columns, {"t": "s", "shoulder": "N m", "elbow": "N m"}).write(here / "move.csv")
