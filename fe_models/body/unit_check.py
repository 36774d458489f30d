"""Check whether size, density, modulus, frequency and wave speed of a body are plausible in its unit system."""

import logging
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from typing import Protocol

import numpy as np

from fe_models.foundation.arrays import Array
from fe_models.foundation.units import UNIT_SYSTEMS, Units, unit_system

__all__ = ["BodyNumbers", "hull_volume", "implausible_numbers", "warn_of_materials"]

log = logging.getLogger(__name__)

SIZE = (1e-4, 1e3)  #: diagonal of the bounding box of a body [m]
#: plausible range, outside of which a warning follows: a mesh in mm read in metres is large and slow [m]
USUAL_SIZE = (1e-4, 50.0)
DENSITY = (10.0, 25_000.0)  #: plausible densities, from rigid foam to osmium [kg/m³]
MODULUS = (1e3, 2e12)  #: plausible moduli, from soft gel to above diamond [Pa]
WAVE_SPEED = (10.0, 30_000.0)  #: plausible sqrt(E / rho), from soft rubber to above diamond [m/s]
STEEL = 7850.0  #: density of steel [kg/m³]
LIGHTEST = 1e-3  #: smallest plausible mass over the volume of the convex hull, which is mostly air for a frame [kg/m³]
MESHED_SPEED = (1.0, 3e5)  #: plausible sqrt(K_kk / M_kk) times node distance, up to ten times the wave speed [m/s]
#: 2 f L of the first elastic frequency: at most the wave speed, much less for slender bodies [m/s]
SWING_SPEED = (1e-3, 6e4)
FLAT = 1e-6  #: thickness of a point cloud over its size, below which it has no volume
LENGTHS = {"mm": 1e-3, "m": 1.0, "inches": 0.0254}  #: length units in which nodes may be given by mistake [m]


class _Elastic(Protocol):
    @property
    def name(self) -> str: ...
    @property
    def E(self) -> float: ...
    @property
    def rho(self) -> float: ...


@dataclass(frozen=True, eq=False)
class BodyNumbers:
    """Known properties of a body, as plain numbers in its units; None: unknown."""

    size: float = 0.0  #: diagonal of the bounding box of the nodes; 0: not checked
    hull: float = 0.0  #: volume of the convex hull of the nodes; 0: they lie in a plane, or it is not checked
    mass: float | None = None
    frequency: float | None = None  #: lowest elastic frequency of the free body
    #: median over the rows of sqrt(K_kk / M_kk) times the distance to the closest node
    meshed_speed: float | None = None
    materials: Sequence[_Elastic] = ()


def implausible_numbers(units: Units, numbers: BodyNumbers) -> list[tuple[bool, str]]:
    """Return (is an error, text) for every number that is implausible in the unit system.

    Each text says what was read and in which units. If other units would fit all numbers, it names them.
    """
    found = _findings(units, numbers)
    if not found:
        return []
    fitting = [
        f"all numbers would fit {other.name}"
        for other in UNIT_SYSTEMS.values()
        if other.name != units.name and not _findings(other, numbers)
    ]
    if numbers.meshed_speed is not None:  # computed from matrices, which do not change with node positions
        for word, length in LENGTHS.items():
            factor = length / units.length
            size, speed = factor * numbers.size, factor * numbers.meshed_speed
            if not _findings(units, replace(numbers, size=size, hull=factor**3 * numbers.hull, meshed_speed=speed)):
                fitting.insert(
                    0,
                    f"the nodes seem to be in {word}, but the matrices in {units.name}: multiplied by {factor:g}, all "
                    "numbers would be consistent",
                )
                break
    advice = " or ".join(fitting)
    if not advice and any(is_error for is_error, _ in found):
        advice = "no known unit system fits all numbers"
    advice = f"; {advice}; change the units or the numbers" if advice else ""
    return [(is_error, f"units {units.name}: {text}{advice}") for is_error, text in found]


def _findings(units: Units, numbers: BodyNumbers) -> list[tuple[bool, str]]:
    """Return (is an error, text) for every number that is implausible, without advice."""
    texts: list[tuple[bool, str]] = []
    metres = numbers.size * units.length
    if metres and not USUAL_SIZE[0] <= metres <= USUAL_SIZE[1]:
        is_error = not SIZE[0] <= metres <= SIZE[1]
        size = f"{numbers.size:.4g} {units.length_symbol}" + (f" = {metres:.4g} m" if units.length != 1 else "")
        slow = "" if numbers.frequency is None else f" and vibrates from {numbers.frequency / units.time:.4g} Hz on"
        highest = SIZE[1] if is_error else USUAL_SIZE[1]
        others = [
            f"in {word} the same numbers make {numbers.size * length:.4g} m"
            for word, length in LENGTHS.items()
            if length != units.length and USUAL_SIZE[0] <= numbers.size * length <= USUAL_SIZE[1]
        ]
        meant = f": is the mesh in {units.length_symbol}? ({', '.join(others)})" if others else ""
        texts.append((is_error, f"the body is {size} large{slow}; expected {SIZE[0]:g} to {highest:g} m{meant}"))
    density, stress = units.mass / units.length**3, units.mass / (units.length * units.time**2)  # one unit in SI
    for material in numbers.materials:
        rho, E = material.rho * density, material.E * stress
        if rho and not DENSITY[0] <= rho <= DENSITY[1]:  # zero density is allowed for springs with a shape
            texts.append((
                True,
                f"density of {material.name!r} {material.rho:.4g} {units.mass_symbol}/{units.length_symbol}³ = "
                f"{rho:.4g} kg/m³; expected {DENSITY[0]:g} to {DENSITY[1]:g} kg/m³ (steel in {units.name} is "
                f"{STEEL / density:.4g})",
            ))  # fmt: skip
        if not MODULUS[0] <= E <= MODULUS[1]:
            texts.append((
                True,
                f"modulus of {material.name!r} {material.E:.4g} {units.stress_symbol} = {E:.4g} Pa; expected "
                f"{MODULUS[0]:g} to {MODULUS[1]:g} Pa (steel in {units.name} is {2.1e11 / stress:.4g})",
            ))  # fmt: skip
        elif DENSITY[0] <= rho <= DENSITY[1] and not WAVE_SPEED[0] <= (E / rho) ** 0.5 <= WAVE_SPEED[1]:
            texts.append((
                False,
                f"waves in {material.name!r} run at sqrt(E/rho) = {(E / rho) ** 0.5:.4g} m/s; expected "
                f"{WAVE_SPEED[0]:g} to {WAVE_SPEED[1]:g} m/s (steel: 5170): do modulus and density have the same "
                "units?",
            ))  # fmt: skip
    volume = numbers.hull or numbers.size**3
    if numbers.mass is not None and volume > 0:
        rho = numbers.mass / volume * density
        if rho > DENSITY[1] or (numbers.hull and rho < LIGHTEST):
            place = "a convex hull" if numbers.hull else "a cube around all nodes"
            texts.append((
                True,
                f"the mass is {numbers.mass:.4g} {units.mass_symbol} in {place} of {volume:.4g} "
                f"{units.length_symbol}³, {rho:.4g} kg/m³; expected {LIGHTEST:g} to {DENSITY[1]:g} kg/m³",
            ))  # fmt: skip
    if numbers.meshed_speed is not None:
        speed = numbers.meshed_speed * units.length / units.time
        if not MESHED_SPEED[0] <= speed <= MESHED_SPEED[1]:
            texts.append((
                speed > MESHED_SPEED[1],
                f"from node to node waves would run at about {speed:.4g} m/s; expected {MESHED_SPEED[0]:g} to "
                f"{MESHED_SPEED[1]:g} m/s",
            ))  # fmt: skip
    if numbers.frequency is not None and metres:
        hertz = numbers.frequency / units.time
        if not SWING_SPEED[0] <= 2 * hertz * metres <= SWING_SPEED[1]:
            texts.append((
                True,
                f"it is {metres:.4g} m large and vibrates from {hertz:.4g} Hz on, as if waves ran at "
                f"{2 * hertz * metres:.4g} m/s; expected {SWING_SPEED[0]:g} to {SWING_SPEED[1]:g} m/s",
            ))  # fmt: skip
    return texts


def warn_of_materials(name: str, units: Units | str, materials: Iterable[_Elastic]) -> None:
    """Log a warning for each density, modulus and wave speed that no solid has in the units of the body."""
    units = unit_system(units) if isinstance(units, str) else units
    each_once = tuple({id(material): material for material in materials}.values())
    for _, text in implausible_numbers(units, BodyNumbers(materials=each_once)):
        log.warning("body %r: %s", name, text)


def hull_volume(points: Array) -> float:
    """Return the volume of the convex hull of points; 0 if they are fewer than four, or lie in a plane or on a line."""
    from scipy.spatial import ConvexHull

    if len(points) < 4:
        return 0.0
    centered = np.asarray(points) - np.mean(points, axis=0)
    extents = np.linalg.svd(centered, compute_uv=False)
    if extents[2] <= FLAT * extents[0]:
        return 0.0
    return float(ConvexHull(centered).volume)
