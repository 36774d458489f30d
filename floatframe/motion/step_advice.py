"""What a step size can follow of the modes of a system, in numbers."""

from dataclasses import dataclass

import numpy as np

from floatframe.compiling.system import compiled_system
from floatframe.kernels.model import MASS, STIFFNESS
from floatframe.start.newton_equations import modal_diagonals
from floatframe.system import System

__all__ = ["StepAdvice", "step_advice"]

FOLLOWED = 20.0  #: steps in a period with which generalized-alpha follows a mode within about 1 % of its period
SEEN = 2.0  #: steps in a period below which a mode cannot be seen in the results at all


@dataclass(frozen=True)
class StepAdvice:
    """Modes of bodies against a step size; frequencies are those of the body alone, in its frame."""

    h: float  #: step size [s]
    n_modes: int  #: modes with mass and stiffness, of all bodies
    n_followed: int  #: with 20 steps in a period or more
    n_unseen: int  #: with less than two
    slowest: float  #: frequency [Hz]
    fastest: float  #: frequency [Hz]
    fastest_body: str
    fastest_mode: int  #: of that body, from 1

    @property
    def h_slowest(self) -> float:
        """Step size that follows the slowest mode [s]."""
        return 1 / (FOLLOWED * self.slowest)

    @property
    def h_fastest(self) -> float:
        """Step size that follows the fastest mode [s]."""
        return 1 / (FOLLOWED * self.fastest)

    @property
    def words(self) -> str:
        """Say in one sentence what the step size follows, and what would follow more."""
        return (
            f"h = {self.h:.3g} follows {self.n_followed} of {self.n_modes} modes ({FOLLOWED:g} steps in a period); the "
            f"fastest, mode {self.fastest_mode} of body {self.fastest_body!r}, has {1 / (self.h * self.fastest):.2g} "
            f"steps in its period of {1 / self.fastest:.3g}: h = {self.h_slowest:.2g} follows the slowest mode, "
            f"h = {self.h_fastest:.2g} all of them"
        )


def step_advice(system: System, h: float) -> StepAdvice | None:
    """Return what a step size follows of the modes; None for a system without modes."""
    model = compiled_system(system).model
    frequencies, owners = [], []
    for i, name in enumerate(compiled_system(system).body_names):
        M, K = modal_diagonals(model, i, MASS), modal_diagonals(model, i, STIFFNESS)
        for k in np.flatnonzero((M > 0) & (K > 0)):
            frequencies.append(float(np.sqrt(K[k] / M[k])) / (2 * np.pi))
            owners.append((name, int(k) + 1))
    if not frequencies:
        return None
    steps = 1 / (h * np.array(frequencies))
    fastest = int(np.argmin(steps))
    return StepAdvice(
        h=h,
        n_modes=len(steps),
        n_followed=int((steps >= FOLLOWED * (1 - 1e-9)).sum()),
        n_unseen=int((steps < SEEN).sum()),
        slowest=min(frequencies),
        fastest=max(frequencies),
        fastest_body=owners[fastest][0],
        fastest_mode=owners[fastest][1],
    )
