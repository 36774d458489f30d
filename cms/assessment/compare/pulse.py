"""Default reference motion of a comparison: the response to a short force pulse at an interface."""

from dataclasses import dataclass

import numpy as np

from cms.assessment.quality.reference.transient import LoadHistory, interface_forces
from cms.errors import CompareError
from fe_models.body.fe_body import FEBody
from fe_models.foundation.arrays import Array

__all__ = ["Pulse", "default_pulse"]

STEPS_A_PERIOD = 40  #: time steps per period of the highest frequency in the band
PERIODS = 4.0  #: periods of the first elastic mode after the pulse
MOST_STEPS = 4000
FEWEST_STEPS = 200


@dataclass(frozen=True, eq=False)
class Pulse:
    """A force along (1, 1, 1) / sqrt(3) in mesh axes on an interface, sin²(pi t / T) for 0 < t < T = 2 / band.

    The main lobe of its spectrum ends at the band, so it mainly excites the modes that are compared.
    """

    at: str  #: name of the interface on which the force acts

    def load(self, body: FEBody, *, band: float, first: float) -> LoadHistory:
        """Return the force over time, until `PERIODS` periods of the first mode after the pulse.

        Parameters
        ----------
        band, first
            Highest frequency of the comparison, frequency of the first elastic mode [cycles per time unit of the body].
        """
        duration = self.duration(band)
        t_end = duration + PERIODS / first
        n_steps = int(np.clip(STEPS_A_PERIOD * band * t_end, FEWEST_STEPS, MOST_STEPS))
        t = np.linspace(0.0, t_end, n_steps + 1)
        history = np.zeros((6, len(t)))
        history[:3] = self.force(t, band) / np.sqrt(3)
        return interface_forces(body, {self.at: history}, t)

    def force(self, t: Array, band: float) -> Array:
        """Return the force divided by its peak, (n_t,)."""
        duration = self.duration(band)
        return np.where(t < duration, np.sin(np.pi * t / duration) ** 2, 0.0)

    def duration(self, band: float) -> float:
        """Return the pulse duration T [time unit of the body]."""
        return 2.0 / band

    @property
    def words(self) -> str:
        """Return a description of the pulse."""
        return f"a unit force pulse at {self.at}, equal along x, y and z"


def default_pulse(body: FEBody, interface: str | None = None) -> Pulse:
    """Return the pulse on an interface, by default the first.

    Raises
    ------
    CompareError
        If the body has no interface.
    """
    if not body.interfaces:
        raise CompareError(
            f"body {body.name!r} has no interface; a comparison assesses responses at interfaces: name at least one"
        )
    return Pulse((body.interfaces[0] if interface is None else body.interface(interface)).name)
