"""Quantities that colour flexible bodies in films and pictures: elastic displacement, or von Mises stress."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from cms.body.reduced_body import ReducedBody
from cms.body.stress import von_mises_of
from fe_models.foundation.arrays import Array
from fe_models.foundation.units import Units
from floatframe.results.place_motion import stress_modes

__all__ = ["BODY_COLORS", "DISPLACEMENT", "VON_MISES", "BodyColor", "length_unit", "stress_unit"]


@dataclass(frozen=True)
class BodyColor:
    """A scalar at the kept nodes of a body as a function of its modal coordinates."""

    title: str
    values: Callable[[ReducedBody, Array], Array]  #: scalars, (n, n_kept), of a body and q, (n, n_q)
    #: unit symbol suitable for the largest value, and the factor to that unit
    unit: Callable[[Units, float], tuple[str, float]]


def displacements(body: ReducedBody, q: Array) -> Array:
    """Return the magnitude of the elastic displacement, (n, n_kept) [m]."""
    moved = (q @ body.Phi.reshape(3 * len(body.Phi), body.n_q).T).reshape(len(q), len(body.Phi), 3)
    return np.sqrt(np.einsum("tna,tna->tn", moved, moved))


def stresses(body: ReducedBody, q: Array) -> Array:
    """Return the von Mises stress, including all modes, (n, n_kept) [Pa]; `ResultsError` without stress modes."""
    modes = stress_modes(body.name, body)
    return np.concatenate([np.zeros((0, len(modes))), *von_mises_of(modes, q)])


def length_unit(units: Units, largest: float) -> tuple[str, float]:
    """Return a readable unit for a length, and the factor to it; metric units only."""
    if units.length_symbol not in ("m", "mm", "cm"):
        return units.length_symbol, 1.0
    for symbol, metres in (("m", 1.0), ("mm", 1e-3), ("\N{GREEK SMALL LETTER MU}m", 1e-6)):
        if largest * units.length >= 0.5 * metres:
            return symbol, units.length / metres
    return "nm", units.length / 1e-9


def stress_unit(units: Units, largest: float) -> tuple[str, float]:
    """Return a readable unit for a stress, and the factor to it; metric units only."""
    if units.stress_symbol not in ("Pa", "kPa", "MPa", "GPa"):
        return units.stress_symbol, 1.0
    pascal = {"Pa": 1.0, "kPa": 1e3, "MPa": 1e6, "GPa": 1e9}[units.stress_symbol]
    for symbol, size in (("GPa", 1e9), ("MPa", 1e6), ("kPa", 1e3)):
        if largest * pascal >= (0.1 if symbol == "MPa" else 1.0) * size:
            return symbol, pascal / size
    return "Pa", pascal


DISPLACEMENT = BodyColor("elastic displacement", displacements, length_unit)
VON_MISES = BodyColor("von Mises stress", stresses, stress_unit)
BODY_COLORS = {"displacement": DISPLACEMENT, "von-mises": VON_MISES}
