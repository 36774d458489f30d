"""Coherent unit systems: numbers are stored as the model has them, the system is named beside them."""

from dataclasses import dataclass

from fe_models.foundation.errors import UnitsError
from fe_models.foundation.words import nearest, quoted

__all__ = ["UNIT_SYSTEMS", "Units", "unit_system"]


@dataclass(frozen=True)
class Units:
    """A coherent unit system: force = mass * length / time², nothing is converted inside.

    The factors give the SI value of one unit: a length of 1 in this system is `length` metres.
    """

    name: str  #: key in `UNIT_SYSTEMS`, such as "mm-t-s"
    length: float  #: [m] of one length unit
    mass: float  #: [kg] of one mass unit
    time: float  #: [s] of one time unit
    length_symbol: str
    mass_symbol: str
    time_symbol: str
    force_symbol: str
    stress_symbol: str

    def to_si(self, *, length: int = 0, mass: int = 0, time: int = 0) -> float:
        """SI value of one unit with the given exponents, e.g. density: `to_si(mass=1, length=-3)`."""
        return self.length**length * self.mass**mass * self.time**time


UNIT_SYSTEMS = {
    "m-kg-s": Units("m-kg-s", 1.0, 1.0, 1.0, "m", "kg", "s", "N", "Pa"),
    "mm-t-s": Units("mm-t-s", 1e-3, 1e3, 1.0, "mm", "t", "s", "N", "MPa"),
    "mm-kg-s": Units("mm-kg-s", 1e-3, 1.0, 1.0, "mm", "kg", "s", "mN", "kPa"),
    "mm-kg-ms": Units("mm-kg-ms", 1e-3, 1.0, 1e-3, "mm", "kg", "ms", "kN", "GPa"),
    "mm-g-ms": Units("mm-g-ms", 1e-3, 1e-3, 1e-3, "mm", "g", "ms", "N", "MPa"),
    "cm-g-s": Units("cm-g-s", 1e-2, 1e-3, 1.0, "cm", "g", "s", "dyn", "dyn/cm²"),
    "in-slinch-s": Units("in-slinch-s", 0.0254, 175.12683524647636, 1.0, "in", "slinch", "s", "lbf", "psi"),
    "ft-slug-s": Units("ft-slug-s", 0.3048, 14.593902937206364, 1.0, "ft", "slug", "s", "lbf", "psf"),
}  # slinch = lbf s²/in and slug = lbf s²/ft with lbf = 4.4482216152605 N


def unit_system(name: str) -> Units:
    """Return the unit system of that name.

    Raises
    ------
    UnitsError
        If the name is unknown; the message lists the choices and the nearest name.
    """
    if name not in UNIT_SYSTEMS:
        raise UnitsError(f"units: unknown unit system {quoted(name)}{nearest(name, UNIT_SYSTEMS)}")
    return UNIT_SYSTEMS[name]
