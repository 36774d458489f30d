"""Full model as the reference of quality checks; all mode sets of the body share its results."""

from contextlib import ExitStack
from functools import cached_property

import numpy as np

from cms.assessment.quality.errors import QualityError
from cms.assessment.quality.reference.ports import Ports
from cms.assessment.quality.reference.reference_response import ReferenceResponse, reference_response
from cms.body.reduced_body import ReducedBody
from cms.linear_algebra.solvers.eigen import EigenResult
from cms.linear_algebra.solvers.mode_count import ModeCount
from cms.modes.families.families import Families, body_of, families_of
from cms.modes.mode_set import ModeSet
from fe_models.body.fe_body import FEBody
from fe_models.foundation.arrays import Array

__all__ = ["FullReference", "usable_band"]

CUTOFF_MARGIN = 1.5  #: customary ratio of the highest retained frequency to the highest frequency of interest
MODES_BEYOND = 1.5  #: highest frequency of the full modes divided by the band


class FullReference:
    """The full model of a coupled body up to a frequency band; a context manager that frees its factorisation.

    >>> with FullReference(body, band=2000.0) as reference:                       # doctest: +SKIP
    ...     records = [check_reduction(body, modes, reduced, reference=reference) for modes, reduced in pairs]
    """

    def __init__(self, source: FEBody | Families, *, band: float) -> None:
        """Prepare the reference; nothing is computed yet.

        Parameters
        ----------
        source
            A coupled body, or its `Families`, whose factorisation is then shared.
        band
            Highest frequency of interest [Hz].

        Raises
        ------
        QualityError
            If the band is not a frequency above 0.
        """
        body = body_of(source)
        if not (np.isfinite(band) and band > 0):
            raise QualityError(f"reference of body {body.name!r}: band = {band}; expected a frequency above 0 [Hz]")
        self.body, self.band = body, float(band)
        self._stack = ExitStack()
        self.families = self._stack.enter_context(families_of(source))

    def __enter__(self) -> "FullReference":
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def close(self) -> None:
        """Free the factorisation if this object created it."""
        self._stack.close()

    @cached_property
    def modes(self) -> EigenResult:
        """Elastic free modes up to 1.5 times the band, at least one."""
        found = self.families.free_modes(ModeCount(cutoff=MODES_BEYOND * self.band * self.body.units.time))
        return found if len(found.omega2) else self.families.free_modes(n_modes=1)

    @property
    def frequencies(self) -> Array:
        """Elastic free frequencies, ascending [Hz]."""
        return self.modes.frequencies / self.body.units.time

    @property
    def n_band(self) -> int:
        """Number of elastic free modes in the band, at least one."""
        return max(1, int((self.frequencies <= self.band).sum()))

    @cached_property
    def ports(self) -> Ports:
        """Reference points of all interfaces."""
        return Ports.of_body(self.body)

    @cached_property
    def response(self) -> ReferenceResponse:
        """Modes of the full model for the interface response up to the band."""
        return reference_response(self.families, self.ports, self.band * self.body.units.time)


def usable_band(modes: ModeSet, reduced: ReducedBody) -> float:
    """Return the highest frequency for which a mode set is customarily used [Hz]: that of its highest mode / 1.5.

    For a set with at most one vibration mode, it is the first free-free frequency.
    """
    time = reduced.units.time
    first = reduced.free_frequencies[0] / time if len(reduced.free_frequencies) else 0.0
    vibration = modes.frequencies[~modes.is_static]
    vibration = vibration[np.isfinite(vibration)]
    highest = vibration.max() / time / CUTOFF_MARGIN if len(vibration) else 0.0
    band = float(max(highest, 1.001 * first))
    if not band > 0:
        raise QualityError(f"body {reduced.name!r}: has no elastic frequency to compare; specify the band")
    return band
