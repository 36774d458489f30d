"""Messages about constraints: conflicting drives, singular positions, joints that remain open."""

import numpy as np

from fe_models.foundation.arrays import Array
from floatframe.engine.compiling.system import CompiledSystem
from floatframe.engine.initial_conditions.freedoms import scaled_constraints
from floatframe.engine.kernels.work import Work
from floatframe.model.joints.rows import is_held, is_held_length
from floatframe.model.state import State

__all__ = ["conflict_of_drives", "drive_name", "open_joints"]

SPANNED = 1e-7  #: norm of a unit row after projection out of the other rows, below which it is a combination of them
INVOLVED = 1e-4  #: coefficient of another row in this combination above which a message names the row


def open_joints(compiled: CompiledSystem, error: Array) -> str:
    """Return a message with the joints that have the largest gaps; `error`: residuals of the rows, (n_w,)."""
    model = compiled.model
    words = []
    for c, name in enumerate(compiled.connection_names):
        rows = slice(int(model.connections.w0[c]), int(model.connections.w0[c + 1]))
        kind = model.rows.kind[rows]
        g = np.where(is_held(kind), error[rows], 0.0)
        is_distance = is_held_length(kind)
        gap, angle = np.linalg.norm(g[is_distance]), np.linalg.norm(g[~is_distance])
        kind_of_it = "joint" if name in compiled.joint_names else "coupler"
        words.append((gap / compiled.length + angle, f"{kind_of_it} {name!r} is open by {gap:.4g} and {angle:.4g} rad"))
    words.sort(reverse=True)
    return ", ".join(text for size, text in words[:3] if size > 1e-9)


def drive_name(compiled: CompiledSystem, row: int) -> str:
    """Return the name of the prescribed motion of a row, for messages."""
    if not compiled.coordinates[row]:
        return f"the motion of coupler {compiled.owners[row]!r}"
    return f"the drive of {compiled.coordinates[row]!r} of joint {compiled.owners[row]!r}"


def conflict_of_drives(compiled: CompiledSystem, work: Work, state: State) -> str:
    """Return a message about prescribed motions in conflict with joints or each other, "" if there is no conflict.

    A drive is in conflict if its row is a combination of the rows of the joints and of the drives before it.
    """
    model = compiled.model
    holds = np.flatnonzero(is_held(model.rows.kind))
    drives = np.flatnonzero(model.rows.motion[holds] >= 0)
    if not len(drives):
        return ""
    try:
        _, rows = scaled_constraints(model, work, state)
    except np.linalg.LinAlgError:
        return ""
    basis = [k for k in range(len(holds)) if k not in set(drives)]
    words = []
    for k in drives:
        if len(basis):
            shares, *_ = np.linalg.lstsq(rows[basis].T, rows[k], rcond=1e-10)
            left = np.linalg.norm(rows[k] - rows[basis].T @ shares)
            if left <= SPANNED:
                involved = [basis[i] for i in np.flatnonzero(np.abs(shares) > INVOLVED)]
                others = [i for i in involved if model.rows.motion[holds[i]] >= 0]
                name = drive_name(compiled, int(holds[k]))
                if others:
                    partners = " and ".join(drive_name(compiled, int(holds[i])) for i in others)
                    words.append(f"{name} and {partners} prescribe the same motion")
                else:
                    words.append(f"{name} prescribes a motion that the joints prevent in this position")
                continue
        basis.append(int(k))
    return "; ".join(words)
