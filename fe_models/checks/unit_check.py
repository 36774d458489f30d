"""Check whether size, density, modulus, frequency and wave speed are plausible in the declared unit system."""

from collections.abc import Iterable
from typing import Protocol

import numpy as np

from fe_models.foundation.arrays import Array
from fe_models.foundation.units import UNIT_SYSTEMS, Units

__all__ = ["hull_volume", "implausible_matrices", "implausible_motion", "implausible_units"]

SIZE = (1e-4, 1e3)  #: diagonal of the bounding box of a body [m]
#: plausible range, outside of which a warning follows: a mesh in mm read in metres is large and slow [m]
USUAL_SIZE = (1e-4, 50.0)
DENSITY = (10.0, 25_000.0)  #: from rigid foam to osmium [kg/m³]
MODULUS = (1e3, 2e12)  #: from soft gel to above diamond [Pa]
WAVE_SPEED = (10.0, 30_000.0)  #: sqrt(E / rho): from soft rubber to above diamond [m/s]
STEEL = 7850.0  #: [kg/m³]
LIGHTEST = 1e-3  #: mass divided by the volume of the convex hull, which is mostly air in a frame [kg/m³]
MESHED_SPEED = (1.0, 3e5)  #: sqrt(K_kk / M_kk) times the node distance: wave speed times up to ten [m/s]
#: 2 f L of the first elastic frequency: at most the wave speed, much less for slender bodies [m/s]
SWING_SPEED = (1e-3, 6e4)
FLAT = 1e-6  #: thickness of a point cloud relative to its size, below which it has no volume
LENGTHS = {1e-3: "mm", 1e3: "m", 0.0254: "inches"}  #: factors that convert nodes that seem to be in another length unit


class _Elastic(Protocol):
    @property
    def name(self) -> str: ...
    @property
    def E(self) -> float: ...
    @property
    def rho(self) -> float: ...


def implausible_units(units: Units, size: float, materials: Iterable[_Elastic]) -> list[tuple[bool, str]]:
    """Return (is an error, text) for every number that is implausible in the unit system.

    Parameters
    ----------
    units
        The declared unit system.
    size
        Diagonal of the body, in its length unit.
    materials
        Materials with name, E and rho in its units.
    """
    materials = list(materials)
    sizes, numbers = size_findings(units, size), _material_findings(units, materials)
    if not numbers and not any(is_error for is_error, _ in sizes):
        return [(False, f"units {units.name}: {text}") for _, text in sizes]
    fitting = [
        other.name
        for other in UNIT_SYSTEMS.values()
        if other.name != units.name
        and SIZE[0] <= size * other.length <= SIZE[1]
        and not _material_findings(other, materials)
    ]
    advice = f"all numbers would fit {' or '.join(fitting)}" if fitting else "no known unit system fits all numbers"
    advice = f"{advice}; change the units or the numbers"
    texts = [
        (is_error, f"units {units.name}: {text}" + (f". {advice}" if is_error else "")) for is_error, text in sizes
    ]
    return texts + [(is_error, f"units {units.name}: {text} {advice}") for is_error, text in numbers]


def _material_findings(units: Units, materials: Iterable[_Elastic]) -> list[tuple[bool, str]]:
    texts: list[tuple[bool, str]] = []
    for material in materials:
        rho = material.rho * units.to_si(mass=1, length=-3)
        E = material.E * units.to_si(mass=1, length=-1, time=-2)
        if rho and not DENSITY[0] <= rho <= DENSITY[1]:  # zero density is allowed: it stands for springs with a shape
            steel = STEEL / units.to_si(mass=1, length=-3)
            texts.append((
                True,
                f"density of {material.name!r} {material.rho:.4g} {units.mass_symbol}/{units.length_symbol}³ = "
                f"{rho:.4g} kg/m³; expected {DENSITY[0]:g} to {DENSITY[1]:g} kg/m³ (steel in {units.name} is "
                f"{steel:.4g}).",
            ))  # fmt: skip
        if not MODULUS[0] <= E <= MODULUS[1]:
            steel = 2.1e11 / units.to_si(mass=1, length=-1, time=-2)
            texts.append((
                True,
                f"modulus of {material.name!r} {material.E:.4g} {units.stress_symbol} = {E:.4g} Pa; expected "
                f"{MODULUS[0]:g} to {MODULUS[1]:g} Pa (steel in {units.name} is {steel:.4g}).",
            ))  # fmt: skip
        elif DENSITY[0] <= rho <= DENSITY[1]:
            speed = (E / rho) ** 0.5
            if not WAVE_SPEED[0] <= speed <= WAVE_SPEED[1]:
                texts.append((
                    False,
                    f"waves in {material.name!r} run at sqrt(E/rho) = {speed:.4g} m/s; expected {WAVE_SPEED[0]:g} to "
                    f"{WAVE_SPEED[1]:g} m/s (steel: 5170): do modulus and density have the same units?",
                ))  # fmt: skip
    return texts


def implausible_matrices(units: Units, nodes: Array, mass: float, speeds: Array) -> list[tuple[bool, str]]:
    """Return (is an error, text) for implausible numbers of bare matrices and their nodes.

    Parameters
    ----------
    units
        The declared unit system.
    nodes
        Positions, (n_nodes, 3), in the length unit of the system.
    mass
        Mass of the body, in the mass unit of the system.
    speeds
        sqrt(K_kk / M_kk) times the distance to the nearest node, for many rows; empty: unknown.
    """
    texts = _matrix_findings(units, nodes, mass, speeds)
    if not texts:
        return []
    moved = [
        f"the nodes seem to be in {words}, but the matrices in {units.name}: multiplied by {factor:g}, all numbers "
        "would be consistent"
        for factor, words in LENGTHS.items()
        if not _matrix_findings(units, factor * np.asarray(nodes), mass, factor * np.asarray(speeds))
    ]
    fitting = moved[:1] + [
        f"all numbers would fit {other.name}"
        for other in UNIT_SYSTEMS.values()
        if other.name != units.name and not _matrix_findings(other, nodes, mass, speeds)
    ]
    advice = " or ".join(fitting) or "no known unit system fits all numbers"
    advice += "; change the units or the numbers"
    return [(is_error, f"units {units.name}: {text}; {advice}") for is_error, text in texts]


def _matrix_findings(units: Units, nodes: Array, mass: float, speeds: Array) -> list[tuple[bool, str]]:
    size = float(np.linalg.norm(np.ptp(nodes, axis=0)))
    texts = size_findings(units, size)
    hull = hull_volume(nodes)
    volume = hull or size**3
    if volume > 0:
        rho = mass / volume * units.to_si(mass=1, length=-3)
        if rho > DENSITY[1] or (hull and rho < LIGHTEST):
            place = "a convex hull" if hull else "a cube around all nodes"
            texts.append((
                True,
                f"the mass is {mass:.4g} {units.mass_symbol} in {place} of {volume:.4g} {units.length_symbol}³, "
                f"{rho:.4g} kg/m³; expected {LIGHTEST:g} to {DENSITY[1]:g} kg/m³",
            ))  # fmt: skip
    if len(speeds):
        speed = float(np.median(speeds)) * units.to_si(length=1, time=-1)
        if not MESHED_SPEED[0] <= speed <= MESHED_SPEED[1]:
            texts.append((
                speed > MESHED_SPEED[1],
                f"from node to node waves would run at about {speed:.4g} m/s; expected {MESHED_SPEED[0]:g} to "
                f"{MESHED_SPEED[1]:g} m/s",
            ))  # fmt: skip
    return texts


def implausible_motion(units: Units, nodes: Array, mass: float, frequency: float | None) -> list[tuple[bool, str]]:
    """Return (is an error, text) about implausible or unusual size, density or first elastic frequency of a body.

    Parameters
    ----------
    frequency
        Lowest elastic frequency of the free body [Hz]; None: it has no elastic modes.
    """
    texts = _matrix_findings(units, nodes, mass, np.zeros(0)) if len(nodes) else []
    size = float(np.linalg.norm(np.ptp(nodes, axis=0))) * units.length if len(nodes) else 0.0
    if frequency is not None and size > 0:
        speed = 2 * frequency * size
        if not SWING_SPEED[0] <= speed <= SWING_SPEED[1]:
            texts.append((
                True,
                f"it is {size:.4g} m large and vibrates from {frequency:.4g} Hz on, as if waves "
                f"ran at {speed:.4g} m/s; expected {SWING_SPEED[0]:g} to {SWING_SPEED[1]:g} m/s",
            ))  # fmt: skip
        elif texts and not any(is_error for is_error, _ in texts):
            texts.append((False, f"its first elastic frequency is {frequency:.4g} Hz"))
    return texts


def size_findings(units: Units, size: float) -> list[tuple[bool, str]]:
    """Return the finding about a size in the length unit, if it is implausible or unusual."""
    metres = size * units.length
    words = f"the body is {size:.4g} {units.length_symbol} = {metres:.4g} m large"
    if size == 0 or USUAL_SIZE[0] <= metres <= USUAL_SIZE[1]:
        return []
    if SIZE[0] <= metres <= SIZE[1]:
        other = f" (in mm the same numbers make {metres / 1e3:.4g} m)" if units.length == 1.0 else ""
        expected = f"expected {USUAL_SIZE[0]:g} to {USUAL_SIZE[1]:g} m"
        return [(False, f"{words}; {expected}: is the mesh in {units.length_symbol}?{other}")]
    return [(True, f"{words}; expected {SIZE[0]:g} to {SIZE[1]:g} m")]


def hull_volume(points: Array) -> float:
    """Return the volume of the convex hull of points; 0 if they lie in a plane or on a line."""
    from scipy.spatial import ConvexHull

    centered = np.asarray(points) - np.mean(points, axis=0)
    extents = np.linalg.svd(centered, compute_uv=False) if len(centered) > 3 else np.zeros(3)
    if len(extents) < 3 or extents[2] <= FLAT * extents[0]:
        return 0.0
    return float(ConvexHull(centered).volume)
