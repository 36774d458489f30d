"""Whether size, density and first frequency of a reduced body are plausible in its units."""

import numpy as np

from cms.assessment.quality.record import QualityRecord, judge
from cms.body.reduced_body import ReducedBody
from fe_models.checks.unit_check import implausible_motion

__all__ = ["check_units", "unit_texts"]


def unit_texts(reduced: ReducedBody) -> list[str]:
    """Return what is implausible or unusual in size, mass over the hull, and 2 f L of the first elastic frequency."""
    frequencies = np.asarray(reduced.free_frequencies)
    first = float(frequencies[0]) / reduced.units.time if len(frequencies) else None
    return [text for _, text in implausible_motion(reduced.units, reduced.nodes, reduced.moments.m, first)]


def check_units(reduced: ReducedBody) -> QualityRecord:
    """Count implausible values: size of the kept nodes, mass divided by their hull, 2 f L of the first frequency."""
    texts = unit_texts(reduced)
    reason = "; ".join(texts) or f"size, density and first frequency are plausible in {reduced.units.name}"
    return judge("units", float(len(texts)), reason)
