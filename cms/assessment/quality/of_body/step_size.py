"""Requirements of a reduced body on an integrator: its highest frequency, its damping, and its dropped columns."""

import numpy as np

from cms.assessment.quality.record import QualityRecord, information, judge
from cms.body.reduced_body import ReducedBody

__all__ = ["STEPS_PER_PERIOD", "check_damping", "check_dropped_columns", "check_step_size", "step_size"]

STEPS_PER_PERIOD = 20  #: that follow a vibration well


def step_size(frequency: float, steps: int = STEPS_PER_PERIOD) -> float:
    """Step that takes so many steps per period of a frequency [s]."""
    return 1.0 / (steps * frequency)


def check_step_size(reduced: ReducedBody) -> QualityRecord:
    """Highest kept frequency over the lowest, the step that follows it and the largest an explicit scheme bears."""
    frequencies = reduced.frequencies[np.isfinite(reduced.frequencies)] / reduced.units.time
    if not len(frequencies) or not frequencies.min() > 0:
        return information("step-size", "the body has no mode with a frequency")
    highest, lowest = float(frequencies.max()), float(frequencies.min())
    explicit = 1 / (np.pi * highest)  # central differences: h omega <= 2
    reason = (
        f"highest frequency {highest:.4g} Hz, lowest {lowest:.4g} Hz; {STEPS_PER_PERIOD} steps per period ask for "
        f"{step_size(highest):.2g} s to follow the highest, {step_size(lowest):.2g} s for the lowest; an explicit "
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
    """Damping ratios of the modes, D_kk / 2 omega_k, and the share of modes without any."""
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
    """Redundant columns dropped in the last step of the reduction, by label, from the provenance of the file."""
    told = reduced.provenance.get("mode set redundant")
    if told is None:
        return information("dropped-columns", "the file does not say which columns were dropped")
    labels = [] if told == "none" else told.split("; ")
    reason = "every column of the mode set is independent" if not labels else f"{len(labels)} dropped: {told}"
    return judge("dropped-columns", float(len(labels)), reason, {"labels": labels})
