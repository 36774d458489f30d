"""What the cells of the mesh cost a reduced body: cells of first order are too stiff in bending."""

from cms.assessment.quality.record import QualityRecord, information, judge
from cms.body.reduced_body import ReducedBody
from fe_models.checks.first_order import PROVENANCE
from fe_models.meshes.quadratic_mesh import FIRST_ORDER

__all__ = ["check_mesh_order"]


def check_mesh_order(reduced: ReducedBody) -> QualityRecord:
    """Excess of the lowest frequencies due to first-order cells, from the provenance of the file."""
    counts = {kind: reduced.provenance.get(f"cells {kind}", "") for kind in FIRST_ORDER}
    cells = ", ".join(f"{count} {kind}" for kind, count in counts.items() if count)
    told = reduced.provenance.get(PROVENANCE, "")
    if not told:
        if not cells:
            return information("mesh-order", "the file names no cells of first order")
        return information(
            "mesh-order",
            f"{cells}: cells of first order may be far too stiff in bending, and the file does not say how much; the "
            "mesh report measures it (report_mesh, or reduce by a job)",
        )
    error = float(told.split()[0])
    return judge("mesh-order", error, f"{cells}: {told.partition(' ')[2]}", {"error": error})
