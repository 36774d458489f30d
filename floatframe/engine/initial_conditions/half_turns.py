"""Rotations that are closed the wrong way round: rows of products of axes vanish at half a turn as well.

A fixed orientation is held by x_A·y' = y_A·z' = z_A·x' = 0, axes x', y', z' of B that should lie along those of A, an
axis by E·n_1 = E·n_2 = 0, E of A, n_1 × n_2 the axis of B. With R the rotation between the two, the first are
R_12 = R_23 = R_31 = 0: fulfilled where R = 1, at half a turn about x, y or z, and nowhere else (R is orthogonal, so
that the other numbers of R can only be 1 or -1, or all zero but R_13, R_21, R_32, a third of a turn about the
diagonal); the second where the axes are parallel or opposite. Newton's method ends at the nearest of them.
"""

import numpy as np

from floatframe.engine.compiling.system import CompiledSystem
from floatframe.engine.initial_conditions.newton_equations import linearized, set_iterate
from floatframe.engine.kernels.model import JOINT
from floatframe.engine.kernels.work import Work
from floatframe.errors import ModelError
from floatframe.model.joints.rows import DOT
from floatframe.model.state import State

__all__ = ["require_no_half_turns"]


def require_no_half_turns(compiled: CompiledSystem, work: Work, state: State) -> None:
    """Raise `ModelError` naming a joint whose axes are closed against each other where they should lie along.

    Parameters
    ----------
    compiled
        The system.
    work
        Working arrays; overwritten.
    state
        With its joints closed, in the frames of the engine.
    """
    model = compiled.model
    if not (model.rows.kind == DOT).any():
        return
    set_iterate(work, state)
    linearized(model, work, 1.0, 0.0, 0.0)
    for c, name in enumerate(compiled.connection_names):
        if model.connections.law[c] != JOINT:
            continue
        rows = np.arange(model.connections.w0[c], model.connections.w0[c + 1])
        rows = rows[model.rows.kind[rows] == DOT]
        if len(rows) < 2 or np.abs(model.rows.c[rows]).any():
            continue
        A, B = work.markers.A[model.connections.a[c]], work.markers.A[model.connections.b[c]]
        x, y = A @ model.rows.x[rows].T, B @ model.rows.y[rows].T  # columns
        if len(rows) == 2 and np.allclose(x[:, 0], x[:, 1]):
            along = [float(x[:, 0] @ np.cross(y[:, 0], y[:, 1]))]
        elif len(rows) == 3:
            along = [float(x[:, k] @ y[:, k - 1]) for k in range(3)]
        else:
            continue
        if min(along) < 0.5:
            turn = "half a turn" if min(along) < -0.5 else "a third of a turn"
            raise ModelError(
                f"joint {name!r} is closed {turn} away from the orientation that it holds, where its equations vanish "
                "as well; place its bodies nearer to it, or turn the axis (axis_b, rotation) that is given for it"
            )
