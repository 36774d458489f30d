"""Whether size, density and first frequency of a reduced body are plausible in its units."""

from cms.assessment.quality.record import QualityRecord, judge
from cms.body.reduced_body import ReducedBody, unit_findings

__all__ = ["check_units"]


def check_units(reduced: ReducedBody) -> QualityRecord:
    """Count implausible values: size of the kept nodes, mass divided by their hull, 2 f L of the first frequency."""
    texts = [text for _, text in unit_findings(reduced)]
    reason = "; ".join(texts) or f"size, density and first frequency are plausible in {reduced.units.name}"
    return judge("units", float(len(texts)), reason)
