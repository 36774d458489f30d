"""Content of a reduced body as one record: `cms info` prints it, `--json` writes it, reports may read it."""

from dataclasses import asdict
from typing import Any

import numpy as np

from cms.body.error_estimates import ErrorEstimates
from cms.body.invariants import Moments
from cms.body.reduced_body import ReducedBody
from fe_models.foundation.arrays import Array, IntArray
from fe_models.meshes.numbering import NONE, NamedSet

__all__ = ["body_record", "body_size", "central_inertia", "effective_mass_record", "in_hertz"]


def central_inertia(moments: Moments) -> Array:
    """Return the inertia tensor of the undeformed body about its centre of mass, axes of B, (3, 3) [kg m²]."""
    c = moments.center_of_mass
    return moments.J0 - moments.m * (c @ c * np.eye(3) - np.outer(c, c))


def body_size(body: ReducedBody) -> float:
    """Return the diagonal of the bounding box of the kept nodes [m]."""
    return float(np.linalg.norm(np.ptp(body.nodes, axis=0))) if len(body.nodes) else 0.0


def in_hertz(body: ReducedBody, frequencies: Array) -> Array:
    """Return frequencies in Hz, given in cycles per time unit of the body."""
    return np.asarray(frequencies) / body.units.time


def body_record(body: ReducedBody) -> dict[str, Any]:
    """Return name, units, mass properties, frame, modes, interfaces, load cases and provenance, in plain types.

    Numbers are in the units of the body, but frequencies are in Hz; infinite ones (massless shapes) are None. The
    centre of mass is given in B and in mesh coordinates, the inertia tensor about it in axes of B.
    """
    moments, frame = body.moments, body.frame
    center = moments.center_of_mass
    damping = np.diag(body.D)
    omega = 2 * np.pi * body.frequencies
    return {
        "name": body.name,
        "units": asdict(body.units),
        "mass": moments.m,
        "center_of_mass": {"B": center.tolist(), "mesh": (frame.origin + frame.axes @ center).tolist()},
        "inertia_about_center_of_mass": central_inertia(moments).tolist(),
        "principal_moments": np.linalg.eigvalsh(central_inertia(moments)).tolist(),
        "moments_are_exact": moments.is_exact,
        "missing_inertia_terms": list(moments.missing),
        "is_held": body.is_held,
        "frame": {
            "kind": frame.kind,
            "at": frame.at,
            "dofs": frame.dofs.tolist(),
            "origin": frame.origin.tolist(),
            "axes": frame.axes.tolist(),
        },
        "modes": [
            {
                "number": k + 1,
                "frequency_hz": _finite(in_hertz(body, f)),
                "damping_ratio": _finite(damping[k] / (2 * omega[k])) if omega[k] > 0 else None,
                "label": body.labels[k],
            }
            for k, f in enumerate(body.frequencies)
        ],
        "free_frequencies_hz": in_hertz(body, body.free_frequencies).tolist(),
        "interfaces": [
            {
                "name": interface.name,
                "kind": interface.kind,
                "position": interface.position.tolist(),
                "position_mesh": (frame.origin + frame.axes @ interface.position).tolist(),
                "nodes": len(interface.members),
            }
            for interface in body.interfaces
        ],
        "load_cases": [
            {
                "name": case.name,
                "kind": case.kind,
                "force": case.force.tolist(),
                "torque": case.torque.tolist(),
                "modal_forces": case.h.tolist(),
            }
            for case in body.load_cases
        ],
        "stress": {
            "nodal": body.stress is not None,
            "points": 0 if body.point_stress is None else len(body.point_stress.names),
        },
        "geometric_stiffness": body.geometric is not None,
        "quadratic_modes": body.quadratic is not None,
        "errors": None if body.errors is None else errors_record(body.errors),
        "recovery": [
            {
                "name": table.name,
                "rows": table.n_rows,
                "quantities": {name: table.quantities.count(name) for name in dict.fromkeys(table.quantities)},
                "loads": len(table.loads),
                "truncated": table.truncated,
            }
            for table in body.recovery.values()
        ],
        "kept_nodes": len(body.nodes),
        "numbering": numbering_record(body),
        "surface_triangles": len(body.surface),
        "provenance": dict(body.provenance),
    }


def errors_record(errors: ErrorEstimates) -> dict[str, Any]:
    """Return the estimated errors as plain types; what is not finite becomes None."""
    return {
        "frequency": errors.frequency.tolist(),
        "bound": errors.bound.tolist(),
        "distance": [_finite(x) for x in errors.distance],
        "largest": [_finite(x) for x in errors.largest],
        "is_uncertain": errors.is_uncertain.tolist(),
        "shape": errors.shape.tolist(),
        "response": errors.response.tolist(),
        "interface_loads": list(errors.interface_loads),
        "interface": [_finite(error) for error in errors.interface],
        "inertia": [_finite(error) for error in errors.inertia],
        "method": errors.method,
        "date": errors.date,
        "mesh": [_finite(error) for error in errors.mesh],
        "mesh_sign": errors.mesh_sign,
        "mesh_method": errors.mesh_method,
        "n_left_out": None if errors.left_out is None else errors.left_out.n_left,
    }


def numbering_record(body: ReducedBody) -> dict[str, Any]:
    """Return summaries of the user's numbers, of the sets, and of the points with rotations, as plain types."""
    numbering = body.numbering
    sources = () if body.kept is None else body.kept.source
    return {
        "nodes": range_of(numbering.nodes),
        "elements": range_of(numbering.elements),
        "instances": list(numbering.instances),
        "sets": [
            {"name": each.name, "kind": each.kind, "size": each.size, "kept": kept_of_set(body, each)}
            for each in numbering.sets
        ],
        "points_with_rotations": {word: sources.count(word) for word in dict.fromkeys(sources)},
    }


def range_of(numbers: IntArray) -> dict[str, int] | None:
    """Return the number of distinct numbers, the smallest and the largest; None if there are none."""
    known = np.unique(numbers[numbers != NONE])
    return {"count": len(known), "from": int(known[0]), "to": int(known[-1])} if len(known) else None


def kept_of_set(body: ReducedBody, named: NamedSet) -> int:
    """Return how many nodes or elements of a set the file contains."""
    numbers = body.numbering.nodes if named.kind == "nodes" else body.numbering.elements
    return len(np.unique(numbers[named.members])) if numbers.size else len(named.members)


def effective_mass_record(body: ReducedBody, at: str) -> dict[str, Any]:
    """Return the effective masses for a fixed, driven interface as plain types; frequencies in Hz."""
    from cms.assessment.quality.of_body.effective_mass import effective_mass_at, mass_record

    return mass_record(effective_mass_at(body, at))


def _finite(value: Any) -> float | None:
    return float(value) if np.isfinite(value) else None
