"""Buckling of a reduced body: amplitudes of unit loads at which K + amplitude K_geo is singular (theory.md §7)."""

from dataclasses import dataclass

import numpy as np
import scipy.linalg as la

from cms.assessment.quality.record import QualityRecord, information, judge
from cms.body.reduced_body import ReducedBody
from fe_models.foundation.arrays import Array
from fe_models.foundation.presentation import presented
from fe_models.foundation.units import Units

__all__ = ["CriticalLoad", "check_buckling", "critical_loads"]

AXES = ("x", "y", "z")
NEGLIGIBLE = 1e-10  #: eigenvalue relative to the largest of the same load, below which its direction does not buckle


@presented
@dataclass(frozen=True)
class CriticalLoad:
    """Amplitudes at which one load makes the stiffness of the body singular; infinite if it never does."""

    load: str  #: name of the load, such as "force x at big_end", along the axes of B
    along: float  #: smallest positive critical amplitude, in `unit`
    #: absolute value of the largest negative critical amplitude, in `unit`; infinite for angular velocities
    against: float
    unit: str


def critical_loads(reduced: ReducedBody) -> tuple[CriticalLoad, ...]:
    """Return the critical amplitude of each unit load alone, from the reduced eigenproblem K x = -amplitude K_j x.

    The frame determines what balances a load: in a Tisserand frame a force at an interface accelerates the body, in a
    nodal frame the fixed interface reacts. For an angular velocity omega, (K + omega² (K_aa - 5C_aa)) x = 0 gives the
    critical speed of steady rotation, including the softening by the centrifugal force. All amplitudes are upper
    bounds, which are close if the modes approximate the buckling shapes well.

    Parameters
    ----------
    reduced
        A reduced body; without geometric stiffness it has no critical loads.

    Returns
    -------
    tuple of CriticalLoad
        Angular velocities about the axes of B, accelerations and angular accelerations that cause stress, then forces
        and moments at the interfaces whose loads are known; none without geometric stiffness.
    """
    geometric, u = reduced.geometric, reduced.units
    if geometric is None:
        return ()
    found = []
    for a, axis in enumerate(AXES):
        K_spin = np.asarray(geometric.spin[a]) - reduced.moments.C5[:, :, a, a]
        omega2, _ = critical_factors(reduced, (K_spin + K_spin.T) / 2)
        found.append(CriticalLoad(f"angular velocity {axis}", np.sqrt(omega2) / u.time, np.inf, "rad/s"))
    parts = [
        ("acceleration", geometric.translation, f"{u.length_symbol}/{u.time_symbol}²"),
        ("angular acceleration", geometric.rotation, f"rad/{u.time_symbol}²"),
    ]
    for interface, K in zip((reduced.interfaces[k] for k in geometric.loaded), geometric.interfaces, strict=True):
        parts.append((f"force at {interface.name}", K[:3], u.force_symbol))
        parts.append((f"moment at {interface.name}", K[3:], f"{u.force_symbol} {u.length_symbol}"))
    for name, matrices, unit in parts:
        words = name.split(" at ")
        for axis, K in zip(AXES, matrices, strict=True):
            if np.any(K):
                what = " at ".join([f"{words[0]} {axis}", *words[1:]])
                found.append(CriticalLoad(what, *critical_factors(reduced, np.asarray(K)), unit))
    return tuple(found)


def critical_factors(reduced: ReducedBody, K_geo: Array) -> tuple[float, float]:
    """Return the smallest factors f > 0 for which K + f K_geo, and K - f K_geo, are singular."""
    size = 1 / np.sqrt(np.diag(reduced.K))
    values = la.eigvalsh(size[:, None] * K_geo * size)
    scale = np.abs(values).max(initial=0.0) * NEGLIGIBLE
    least, largest = values[0], values[-1]
    return (-1 / least if least < -scale else np.inf), (1 / largest if largest > scale else np.inf)


def check_buckling(reduced: ReducedBody) -> QualityRecord:
    """Return the record of critical amplitudes; its value is the largest ratio of a unit load to its critical load."""
    if not reduced.n_q:
        return information("buckling", "the body has no modes")
    if reduced.geometric is None:
        return information("buckling", "the file has no geometric stiffness; loads do not stiffen or buckle the body")
    if not (np.diag(reduced.K) > 0).all():
        return information("buckling", "not every mode has a stiffness above zero; see the record on definiteness")
    loads = critical_loads(reduced)
    rows = [[load.load, load.along, load.against, load.unit] for load in loads]
    value = max((1 / unit_factor(load, reduced.units) for load in loads), default=0.0)
    return judge("buckling", value, "; ".join(sentences(loads)), {"loads": rows})


def unit_factor(load: CriticalLoad, units: Units) -> float:
    """Return the critical amplitude in multiples of the unit load."""
    if load.unit == "rad/s":
        return (load.along * units.time) ** 2
    return min(load.along, load.against)


def sentences(loads: tuple[CriticalLoad, ...]) -> list[str]:
    """Describe the smallest critical angular velocity, acceleration, force and moment, with the sign of the load."""
    words = []
    for kind in ("angular velocity", "acceleration", "angular acceleration", "force", "moment"):
        of_kind = [load for load in loads if load.load.split(" at ")[0][:-2] == kind]
        of_kind = [load for load in of_kind if np.isfinite(min(load.along, load.against))]
        if not of_kind:
            continue
        first = min(of_kind, key=lambda load: min(load.along, load.against))
        sign = "" if kind == "angular velocity" or first.along < first.against else "-"
        words.append(f"{first.load}: {sign}{min(first.along, first.against):.4g} {first.unit}")
    return words or ["none of these loads buckles the body within its modes"]
