"""The state of a system: where its bodies are and how they move."""

from dataclasses import dataclass

import numpy as np

from fe_models.foundation.arrays import Array, frozen
from fe_models.foundation.copies import frozen_copies

__all__ = ["State"]


@frozen_copies
@dataclass(frozen=True, eq=False)
class State:
    """Positions and velocities of all bodies, in the order of the system.

    Velocities of body i in u: v_GO in ground axes (3), omega_B in body axes (3), q_dot (n_q of the body).
    """

    r: Array  #: position of the frame origins, ground axes, (n_b, 3) [m]
    p: Array  #: Euler parameters (w, x, y, z) of R_GB, (n_b, 4)
    q: Array  #: modal coordinates of all bodies, (n_q,)
    u: Array  #: velocities, (6 n_b + n_q,)
    #: unknowns of the connections, such as those of an equilibrium, (n_w,): where states of elements and user forces
    #: begin; None: at their start
    w: Array | None = None

    def __post_init__(self) -> None:
        for name in ("r", "p", "q", "u"):
            object.__setattr__(self, name, frozen(getattr(self, name).copy()))
        if self.w is not None:
            object.__setattr__(self, "w", frozen(np.array(self.w, dtype=float)))
