"""Checks of descriptions in a reduced body: labels, damping, units, cells, dropped columns, step sizes, scope."""

import numpy as np
import scipy.linalg as la

from cms.assessment.quality.record import QualityRecord, information, judge
from cms.body.reduced_body import ReducedBody, unit_findings
from cms.reduction.basis.damping import modal_damping, stated_damping
from fe_models.checks.first_order import PROVENANCE
from fe_models.meshes.quadratic_mesh import FIRST_ORDER

__all__ = [
    "STEPS_PER_PERIOD",
    "check_damping",
    "check_damping_told",
    "check_dropped_columns",
    "check_labels",
    "check_mesh_order",
    "check_scope",
    "check_step_size",
    "check_units",
    "step_size",
]

STEPS_PER_PERIOD = 20  #: number of time steps per period for an accurate vibration


def check_labels(reduced: ReducedBody) -> QualityRecord:
    """Check that labels, sources and energy shares agree with the recorded columns."""
    columns = reduced.columns
    if columns is None:
        return information("labels", "the file does not contain the columns of its mode set")
    words, groups = columns.mode_labels(), columns.sources
    wrong = [k + 1 for k, (own, made) in enumerate(zip(reduced.labels, words, strict=True)) if own != made]
    if tuple(reduced.sources) != groups:
        return judge("labels", np.inf, f"sources {', '.join(reduced.sources)}; the columns are of {', '.join(groups)}")
    apart = float(np.abs(reduced.energy_shares - columns.group_shares()).max(initial=0.0))
    reason = f"energy shares differ from those of the columns by {apart:.1e}"
    if wrong:
        reason = f"mode {wrong[0]} is called {reduced.labels[wrong[0] - 1]!r}, by its columns {words[wrong[0] - 1]!r}"
        reason += f"; {len(wrong)} such labels"
    return judge("labels", max(apart, np.inf if wrong else 0.0), reason)


def check_damping_told(reduced: ReducedBody) -> QualityRecord:
    """Check that D is at least the damping in the provenance; dampers of the model may add to it.

    The value is the smallest eigenvalue of the difference between D and this damping, if negative, divided by the
    largest entry of both; first, rows and columns of both are divided by the square roots of the frequencies.
    """
    told = reduced.provenance.get("damping")
    damping = stated_damping(reduced)
    if "frame converted from" in reduced.provenance or damping is None:
        return information("damping-told", "the provenance names no damping of these modes")
    made = modal_damping(damping, reduced.M, reduced.K, second=reduced.units.time)
    omega = np.sqrt(np.maximum(np.diag(reduced.K), 0.0))
    omega = np.where(omega > 0, omega, 1.0)
    scale = np.sqrt(np.outer(omega, omega))
    own, made = reduced.D / scale, made / scale
    size = max(np.abs(own).max(initial=0.0), np.abs(made).max(initial=0.0))
    rest = (own + own.T) / 2 - made
    least = float(la.eigvalsh(rest)[0] / size) if size > 0 else 0.0
    reason = f"D contains the damping that the provenance names, {told}"
    if least < 0:
        reason = f"D is less than the damping that the provenance names, {told}, by {-least:.1e} of the largest"
    return judge("damping-told", max(0.0, -least), reason)


def check_scope(reduced: ReducedBody) -> QualityRecord:
    """List the data of the file that cannot be checked without its model."""
    unknown = {
        "modes and frequencies themselves": True,
        "3C to 5C beyond their sign": not reduced.moments.missing,
        "triads of interfaces": bool(reduced.interfaces),
        "physical damping": bool(np.any(reduced.D)),
        "load cases": bool(reduced.load_cases),
        "stress of the modes": reduced.stress is not None or reduced.point_stress is not None,
        "geometric stiffness over two modes": reduced.geometric is not None,
        "quadratic modes beside the interfaces": reduced.quadratic is not None,
        "rotations of kept nodes beside the interfaces": reduced.kept is not None,
        "static part of recovery rows": bool(reduced.recovery),
        "columns of the mode set": reduced.columns is not None,
        "numbers and sets": not reduced.numbering.is_empty,
    }
    names = [name for name, is_held in unknown.items() if is_held]
    reason = f"not checked without the model: {', '.join(names)}"
    return information("scope", reason, {"unknown": names})


def check_mesh_order(reduced: ReducedBody) -> QualityRecord:
    """Report the error of the lowest frequencies due to first-order cells, from the provenance of the file."""
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


def step_size(frequency: float) -> float:
    """Return the time step for `STEPS_PER_PERIOD` steps per period of a frequency [s]."""
    return 1.0 / (STEPS_PER_PERIOD * frequency)


def check_step_size(reduced: ReducedBody) -> QualityRecord:
    """Report the ratio of highest to lowest frequency, the step for accuracy and the largest stable explicit step."""
    frequencies = reduced.frequencies[np.isfinite(reduced.frequencies)] / reduced.units.time
    if not len(frequencies) or not frequencies.min() > 0:
        return information("step-size", "the body has no mode with a frequency")
    highest, lowest = float(frequencies.max()), float(frequencies.min())
    explicit = 1 / (np.pi * highest)  # stability limit of central differences: h omega <= 2
    reason = (
        f"highest frequency {highest:.4g} Hz, lowest {lowest:.4g} Hz; {STEPS_PER_PERIOD} steps per period are "
        f"{step_size(highest):.2g} s for the highest, {step_size(lowest):.2g} s for the lowest; an explicit "
        f"scheme is stable up to {explicit:.2g} s"
    )
    data = {
        "highest_hz": highest,
        "lowest_hz": lowest,
        "step_highest_s": step_size(highest),
        "step_lowest_s": step_size(lowest),
        "step_explicit_s": explicit,
        "n_massless": int((~np.isfinite(reduced.frequencies)).sum()),
    }
    return judge("step-size", highest / lowest, reason, data)


def check_damping(reduced: ReducedBody) -> QualityRecord:
    """Report the damping ratios of the modes, D_kk / 2 omega_k, and the share of undamped modes."""
    omega = 2 * np.pi * reduced.frequencies
    is_dynamic = np.isfinite(omega) & (omega > 0)
    if not is_dynamic.any():
        return information("damping", "the body has no mode with a frequency")
    ratio = np.diag(reduced.D)[is_dynamic] / np.diag(reduced.M)[is_dynamic] / (2 * omega[is_dynamic])
    undamped = float((ratio == 0).mean())
    reason = (
        "no mode is damped"
        if undamped == 1
        else f"damping ratios from {100 * ratio.min():.3g} % to {100 * ratio.max():.3g} %"
    )
    return judge("damping", undamped, reason, {"ratio": ratio})


def check_dropped_columns(reduced: ReducedBody) -> QualityRecord:
    """Report the redundant columns, by label, that the reduction dropped, from the provenance of the file."""
    told = reduced.provenance.get("mode set redundant")
    if told is None:
        return information("dropped-columns", "the file does not say which columns were dropped")
    labels = [] if told == "none" else told.split("; ")
    reason = "every column of the mode set is independent" if not labels else f"{len(labels)} dropped: {told}"
    return judge("dropped-columns", float(len(labels)), reason, {"labels": labels})


def check_units(reduced: ReducedBody) -> QualityRecord:
    """Count implausible values: size of the kept nodes, mass over the volume of their hull, 2 f L of the first mode."""
    texts = [text for _, text in unit_findings(reduced)]
    reason = "; ".join(texts) or f"size, density and first frequency are plausible in {reduced.units.name}"
    return judge("units", float(len(texts)), reason)
