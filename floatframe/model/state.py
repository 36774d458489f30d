"""The state of a system, given by positions and velocities of its bodies."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from fe_models.foundation.arrays import Array, frozen
from fe_models.foundation.presentation import presented
from fe_models.foundation.records import FrozenMapping, checked_fields, frozen_copies
from floatframe.errors import ModelError

__all__ = ["State"]


@presented
@frozen_copies
@dataclass(frozen=True, eq=False)
@checked_fields(ModelError)
class State:
    """Positions and velocities of all bodies, in the order of the system.

    For each body i, u contains v_GO in ground axes (3), omega_B in body axes (3), and q_dot (n_q of the body).

    Parameters
    ----------
    r
        Position of the frame origins, ground axes, (n_b, 3) [m].
    p
        Euler parameters (w, x, y, z) of R_GB, (n_b, 4).
    q
        Modal coordinates of all bodies, (n_q,).
    u
        Velocities, (6 n_b + n_q,).
    w
        Unknowns of the connections, (n_w,), such as those of an equilibrium; they include the states of elements and
        user forces; None: initial values.
    angle
        Angles between bodies, counted through full turns, (n_angles,) [rad], such as those of an earlier motion. None,
        or another number of angles: they begin between -pi and pi.
    watched
        Errors of steps and energy up to this state, from the watch of a run. A run that continues from this state in
        time is assessed together with that run as one motion. None: unknown.
    """

    r: Array
    p: Array
    q: Array
    u: Array
    w: Array | None = None
    angle: Array | None = None
    watched: Mapping[str, Any] | None = field(default=None, kw_only=True)

    def __post_init__(self) -> None:
        for name in ("r", "p", "q", "u"):
            object.__setattr__(self, name, frozen(getattr(self, name).copy()))
        for name in ("w", "angle"):
            if getattr(self, name) is not None:
                object.__setattr__(self, name, frozen(np.array(getattr(self, name), dtype=float)))
        if self.watched is not None:
            object.__setattr__(self, "watched", FrozenMapping(self.watched))
