"""Range of use of a reduced body: limits of frequency, angular speed, load and deflection.

Band      without full model the customary band, the highest vibration mode / 1.5 (`custom_band`); with a full model the
          highest frequency up to which all free frequencies and shapes keep the limits of the quality records
Speed     limit of the frame times the lowest angular frequency with one interface held (docs/multibody.md)
Loads     a force or moment at an interface, balanced by the frame: q = K⁻¹ Psiᵀ f. It is limited by the rotation of an
          interface, by the change of stiffness due to the load, or by buckling
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from cms.assessment.quality.limits import LIMITS
from cms.assessment.quality.of_body.buckling import AXES, critical_factors
from cms.assessment.quality.of_body.effective_mass import can_be_held, effective_mass
from cms.assessment.quality.record import QualityRecord
from cms.assessment.quality.reference.full_reference import CUTOFF_MARGIN
from cms.body.linear_range import LINEAR, STIFFENED, Limits
from cms.body.reduced_body import ReducedBody

__all__ = ["LargestLoad", "LargestSpeed", "RangeOfUse", "UsableBand", "custom_band", "range_of_use"]


@dataclass(frozen=True)
class UsableBand:
    """Frequency range in which a reduced body is accurate."""

    highest: float  #: highest frequency [Hz]; NaN: unknown
    words: str  #: description of how the frequency was determined
    is_compared: bool  #: whether it follows from a comparison with the full model


@dataclass(frozen=True)
class LargestSpeed:
    """Angular speed up to which the frame may rotate."""

    lowest_held: float  #: lowest frequency with one interface fixed [Hz]
    at: str  #: name of this interface
    linear: float  #: largest speed without geometric stiffness [rad/s]
    stiffened: float | None  #: largest speed with geometric stiffness [rad/s]; None: the file has none


@dataclass(frozen=True)
class LargestLoad:
    """Largest load at one interface along one axis of B for which the frame is accurate."""

    interface: str
    direction: str  #: direction in axes of B, from "force x" to "moment z"
    unit: str
    linear: float  #: largest load without geometric stiffness; infinite: no deformation
    stiffened: float | None  #: largest load with geometric stiffness; None: the file has none
    governed_by: str  #: limit that is reached first: "rotation", "change of stiffness" or "nothing"
    deflection: float  #: largest displacement in B at the load `linear` [length unit of the body]; 0: no limit


@dataclass(frozen=True)
class RangeOfUse:
    """Band, speed and loads of a body."""

    band: UsableBand
    #: None: unknown for a held body, without modes or inertia terms, or if no held frequency is above 0
    speed: LargestSpeed | None
    loads: tuple[LargestLoad, ...]  #: three forces and three moments for each interface
    limits: Limits  #: limits of the frame without geometric stiffness
    stiffened_limits: Limits | None  #: limits with geometric stiffness; None: the file has none

    def strictest(self) -> tuple[LargestLoad, ...]:
        """Return, for each interface, the directions with the smallest allowed force and moment."""
        found: dict[tuple[str, str], LargestLoad] = {}
        for load in self.loads:
            key = (load.interface, load.direction.split()[0])
            if key not in found or load.linear < found[key].linear:
                found[key] = load
        return tuple(found.values())


def range_of_use(reduced: ReducedBody, records: Sequence[QualityRecord] = ()) -> RangeOfUse:
    """Return the range of use of a body.

    Parameters
    ----------
    records
        Quality records; those against the full model ("frequency-error", "mac") give the band.
    """
    stiffened = None if reduced.geometric is None else STIFFENED
    return RangeOfUse(
        usable_frequencies(reduced, records), largest_speed(reduced), largest_loads(reduced), LINEAR, stiffened
    )


def usable_frequencies(reduced: ReducedBody, records: Sequence[QualityRecord]) -> UsableBand:
    """Return the band, from the comparison with the full model if there is one, else the customary band."""
    by_name = {record.name: record for record in records}
    compared, shapes = by_name.get("frequency-error"), by_name.get("mac") or by_name.get("mac-nodal")
    if compared is not None and "full_hz" in compared.data:
        full = np.asarray(compared.data["full_hz"], float)
        error = np.asarray(compared.data["error"], float)
        has_shapes = shapes is not None and "recovered" in shapes.data
        recovered = np.asarray(shapes.data["recovered"], float) if shapes and has_shapes else np.ones(len(full))
        most, least = float(LIMITS["frequency-error"].tolerance or 0), 1 - float(LIMITS["mac"].tolerance or 0)
        is_good = (np.abs(error) <= most) & (recovered >= least)
        n = len(full) if is_good.all() else int(np.argmin(is_good))
        words = f"frequencies within {100 * most:g} % of the full model, "
        words += f"shapes within {100 * (1 - least):g} %" if has_shapes else "shapes not compared"
        if n == len(full):
            return UsableBand(float(compared.data["band_hz"]), f"{words}, as far as was compared", True)
        return UsableBand(
            float(full[n - 1]) if n else 0.0, f"{words}; the mode at {full[n]:.5g} Hz is the first that is not", True
        )
    return custom_band(reduced)


def custom_band(reduced: ReducedBody) -> UsableBand:
    """Return the customary band from the file alone, never above that of the mode set.

    With n vibration modes it is the n-th elastic free frequency divided by 1.5. The customary rule uses the n-th
    frequency of the held body, which is higher, because constraints raise every frequency.
    """
    free = np.asarray(reduced.free_frequencies) / reduced.units.time
    if not len(free):
        return UsableBand(float("nan"), "the body has no vibration modes", False)
    words = reduced.provenance.get("mode set n_modes", "")
    n = min(int(words), len(free)) if words.isdecimal() else 0
    highest = float(free[n - 1]) / CUTOFF_MARGIN if n else 0.0
    if highest > free[0]:
        said = f"elastic free frequency {n} over 1.5, for {words} vibration modes, by custom; not compared"
        return UsableBand(highest, f"{said} with a full model", False)
    said = f"its first elastic free frequency; {words if n else 'no'} vibration modes are on record"
    return UsableBand(float(free[0]), f"{said}; not compared with a full model", False)


def largest_speed(reduced: ReducedBody) -> LargestSpeed | None:
    """Return the largest angular speed for which the frame is accurate; None if it is unknown."""
    if reduced.is_held or not reduced.n_q or reduced.moments.missing:
        return None
    found = []
    for interface in reduced.interfaces:
        if can_be_held(reduced, interface.name):
            try:
                frequencies = effective_mass(reduced, interface.name).frequencies
            except np.linalg.LinAlgError:  # other records report impossible moments
                continue
            if len(frequencies) and frequencies[0] > 0:
                found.append((float(frequencies[0]), interface.name))
    if not found:
        return None
    lowest, at = min(found)
    omega = 2 * np.pi * lowest
    stiffened = None if reduced.geometric is None else STIFFENED.speed * omega
    return LargestSpeed(lowest, at, LINEAR.speed * omega, stiffened)


def largest_loads(reduced: ReducedBody) -> tuple[LargestLoad, ...]:
    """Return the largest loads at each interface for which the frame is accurate."""
    stiffness = np.diag(reduced.K)
    if not reduced.n_q or not (stiffness > 0).all():
        return ()
    turns = [np.asarray(interface.Psi)[3:] for interface in reduced.interfaces if interface.has_rotation]
    force, moment = reduced.units.force_symbol, f"{reduced.units.force_symbol} {reduced.units.length_symbol}"
    found = []
    for i, interface in enumerate(reduced.interfaces):
        for j in range(6 if interface.has_rotation else 3):
            q = np.asarray(interface.Psi)[j] / stiffness
            turn = max((float(np.linalg.norm(each @ q)) for each in turns), default=0.0)
            buckling = np.inf
            if reduced.geometric is not None and np.any(K_geo := reduced.geometric.of_interface(i)[j]):
                buckling = min(critical_factors(reduced, K_geo))
            by_turn, by_load = (LINEAR.rotation / turn if turn else np.inf), LINEAR.load * buckling
            linear = min(by_turn, by_load)
            stiffened = None
            if reduced.geometric is not None:
                stiffened = min(STIFFENED.rotation / turn if turn else np.inf, STIFFENED.load * buckling)
            governed = "nothing" if np.isinf(linear) else "rotation" if by_turn <= by_load else "change of stiffness"
            shape = np.linalg.norm(reduced.Phi @ q, axis=1).max(initial=0.0)
            found.append(
                LargestLoad(
                    interface.name,
                    f"{'force' if j < 3 else 'moment'} {AXES[j % 3]}",
                    force if j < 3 else moment,
                    float(linear),
                    None if stiffened is None else float(stiffened),
                    governed,
                    float(shape * linear) if np.isfinite(linear) else 0.0,
                )
            )
    return tuple(found)
