"""Compilation of wheels, track and contact laws to the data of the law `wheels_on_rails`."""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import lru_cache
from typing import NamedTuple

import numpy as np

from fe_models.foundation.arrays import Array
from floatframe.components.rails.contact_search import Pair, quasi_elastic
from floatframe.components.rails.contact_table import Steel, TableGrid, contact_table, numbers_of_table
from floatframe.components.rails.splines import coefficients
from floatframe.components.rails.track import Track
from floatframe.errors import ModelError
from floatframe.model.checked_values import number

__all__ = ["CREEP_LAWS", "NORMAL_LAWS", "ContactLaws", "Wheel", "law_numbers", "output_names", "shift_off_the_rail"]


# names of the creep laws, without importing the compiled code ---------------------------------------------------------


#: number of the law in `creep_force`, by name
CREEP_LAWS = {"kalker": 0, "kalker-saturated": 1, "polach": 2, "fastsim": 3}
NORMAL_LAWS = ("hertz", "constraint")


# assembly -------------------------------------------------------------------------------------------------------------


PARTS = ("tread", "flange")
N_OPTIONS = 5  #: number of options of a creep law


@dataclass(frozen=True)
class ContactLaws:
    """The laws of normal and creep forces between wheel and rail.

    Raises
    ------
    ModelError
        If a law is unknown, or a number is out of its range.
    """

    normal: str = "hertz"  #: "hertz": from the penetration; "constraint": the treads are constrained to the rails
    creep: str = "fastsim"  #: creep law: kalker, kalker-saturated, polach or fastsim
    friction: float = 0.3  #: coefficient of friction mu
    shear_modulus: float = 8.2e10  #: shear modulus G of wheel and rail [Pa]
    poisson: float = 0.28
    smoothing: float = 2e-5  #: smoothing length eps of the quasi-elastic contact [m]
    damping: float = 0.0  #: damping factor in N = K d^(3/2) (1 + damping d_dot) [s/m]
    low_speed: float = 0.05  #: speed v_0 in sqrt(v² + v_0²), by which creepages are divided [m/s]
    strips: int = 12  #: number of FASTSIM cells in rolling direction, and of strips across
    #: Polach's factors k_A, k_S, and A and B [s/m] of his friction law
    polach: tuple[float, float, float, float] = (1.0, 1.0, 1.0, 0.0)

    def __post_init__(self) -> None:
        where = "contact of wheel and rail"
        for name, choices in (("normal", NORMAL_LAWS), ("creep", tuple(CREEP_LAWS))):
            if getattr(self, name) not in choices:
                raise ModelError(f"{where}: {name}: expected one of {', '.join(choices)}, got {getattr(self, name)!r}")
        for name in ("friction", "shear_modulus", "smoothing", "low_speed"):
            number(f"{where}: {name}", getattr(self, name), above=0.0)
        number(f"{where}: damping", self.damping, at_least=0.0)
        if not 0 <= number(f"{where}: poisson", self.poisson) <= 0.5:
            raise ModelError(f"{where}: poisson: expected 0 to 0.5, got {self.poisson:g}")
        if self.shear_modulus < 1e9:
            raise ModelError(
                f"{where}: shear_modulus: {self.shear_modulus:g} Pa: expected about 8e10 for steel, in pascal"
            )
        if not (isinstance(self.strips, int) and 4 <= self.strips <= 200):
            raise ModelError(f"{where}: strips: expected an integer between 4 and 200, got {self.strips!r}")
        if len(self.polach) != 4 or not all(np.isfinite(self.polach)):
            raise ModelError(f"{where}: polach: expected four numbers k_A, k_S, A and B, got {self.polach!r}")
        object.__setattr__(self, "polach", tuple(float(each) for each in self.polach))


class Wheel(NamedTuple):
    """A wheel with its side of the track and its position on the axle."""

    side: int  #: side of the track: +1 left rail, -1 right rail
    arm: float  #: distance from the marker to the running circle along the axle, positive to the left [m]
    pair: Pair


@lru_cache(maxsize=32)
def shift_off_the_rail(pair: Pair) -> float:
    """Return the outward shift beyond which a wheel counts as derailed [m].

    A wheel with a flange is derailed if the flange has climbed to within 8 mm of its height; a wheel without a flange,
    if its middle leaves the rail head.
    """
    if not pair.has_flange:
        return float(pair.head.y[-1] - pair.offset)
    u = np.linspace(0.0, 0.05, 251)
    q = quasi_elastic(pair, u).q
    climbed = np.flatnonzero(q > float(pair.wheel.z.max()) - 0.008)
    return float(u[climbed[0]]) if len(climbed) else float(u[-1])


def grid_of(pair: Pair) -> TableGrid:
    """Return the grid of a pair's contact table, up to the shift at which the wheel is derailed."""
    most = shift_off_the_rail(pair) + 0.002
    least = -max(0.03, most)
    return TableGrid(v=(least, most, int(np.ceil((most - least) / 2e-4)) + 1))


def law_numbers(wheels: Sequence[Wheel], track: Track, laws: ContactLaws, spin_inertia: float = 0.0) -> Array:
    """Return the data of the law `wheels_on_rails`: head, wheels, cells of the track, irregularities, tables."""
    cells = track.cells
    n_head, n_wheel = 21, 6
    cells_at = n_head + n_wheel * len(wheels)
    irregular_at = cells_at + cells.size
    deviations = track.irregularities
    if deviations is None:
        signals, first, step, n = np.zeros(0), 0.0, 1.0, 0
    else:
        seen = deviations.seen_by_wheels(min(each.pair.radius for each in wheels))
        signals = np.column_stack(
            [coefficients(v) for v in (seen.left_y, seen.left_z, seen.right_y, seen.right_z)]
        ).ravel()
        first, step, n = float(seen.s[0]), float(seen.s[1] - seen.s[0]), len(seen.s)
    tables_at = irregular_at + len(signals)
    tables: list[Array] = []
    places: dict[Pair, int] = {}
    rows = []
    for each in wheels:
        if each.pair not in places:
            places[each.pair] = tables_at + sum(len(one) for one in tables)
            steel = Steel(laws.shear_modulus, laws.poisson)
            tables.append(
                numbers_of_table(
                    contact_table(
                        each.pair,
                        parts=PARTS if each.pair.has_flange else ("all",),
                        smoothing=laws.smoothing,
                        steel=steel,
                        grid=grid_of(each.pair),
                    )
                )
            )
        rows.append([
            each.side, each.arm, 0.5 * each.pair.running_circles, each.pair.radius, places[each.pair],
            shift_off_the_rail(each.pair),
        ])  # fmt: skip
    options = [0.0] * N_OPTIONS
    if laws.creep == "polach":
        options = [*laws.polach, 0.0]
    if laws.creep == "fastsim":
        options[:2] = [float(laws.strips)] * 2
    head = [
        len(wheels), n_parts_of(wheels), CREEP_LAWS[laws.creep], *options,
        laws.shear_modulus, laws.friction, laws.low_speed, laws.damping, laws.normal == "constraint",
        track.start[2], cells_at, len(cells), irregular_at, first, step, n, spin_inertia,
    ]  # fmt: skip
    return np.concatenate([np.array(head, dtype=float), np.ravel(rows), cells.ravel(), signals, *tables])


def n_parts_of(wheels: Sequence[Wheel]) -> int:
    """Return the number of contact parts per wheel, which all wheels share."""
    found = {len(PARTS) if each.pair.has_flange else 1 for each in wheels}
    if len(found) > 1:
        raise ModelError("wheels of an axle: expected both with a flange or both without one")
    return found.pop()


def output_names(
    wheels: Sequence[Wheel], wheel_outputs: Sequence, contact_outputs: Sequence
) -> tuple[list[str], list[str]]:
    """Return names and units of all outputs, in the order in which the law writes them."""
    names, units = [], []
    parts = PARTS[: n_parts_of(wheels)]
    for each in wheels:
        prefix = "" if len(wheels) == 1 else ("left_" if each.side > 0 else "right_")
        for name, unit in wheel_outputs:
            names.append(prefix + name)
            units.append(unit)
        for part in parts:
            for name, unit in contact_outputs:
                names.append(f"{prefix}{part}_{name}")
                units.append(unit)
    return [*names, "off_track", "energy", "power_lost"], [*units, "m", "J", "W"]
