"""Tables of the contact over shift, roll and yaw, which are computed once for each pair of profiles.

For each part of the wheel (tread, flange), the table contains quasi-elastic contact, Hertz's ellipse and Kalker's
coefficients as functions of v, phi and sin(psi). v = u + r_0 sin(phi) is the shift of the wheel at the height of the
rail, so that a roll only tilts the profile. Interpolation is by cubic B-splines over v and phi and by a parabola over
sin² psi, twice differentiable in all variables.
"""

from dataclasses import dataclass
from functools import lru_cache
from typing import NamedTuple

import numpy as np

from fe_models.foundation.arrays import Array
from floatframe.components.rails.contact_search import Pair, QuasiElastic, quasi_elastic
from floatframe.components.rails.hertz import ellipse
from floatframe.components.rails.kalker import kalker_coefficients
from floatframe.components.rails.splines import coefficients, even_coefficients
from floatframe.errors import ModelError
from floatframe.model.checked_values import number

__all__ = ["FIELDS", "LEAST_BEND", "ContactTable", "Steel", "TableGrid", "contact_table", "numbers_of_table"]

#: for each part: depth at h = 0, dq/du, lever x divided by sin psi, levers y and z, and rolling radius; then the
#: logarithms of Hertz's stiffness, of a and b for 1 N, and of Kalker's coefficients (splines of the values themselves
#: could become negative at jumps)
FIELDS = ("q", "slope", "x", "y", "z", "radius", "stiffness", "a_1", "b_1", "c11", "c22", "c23", "c33")

LEAST_BEND = 0.05  #: smallest curvature of a contact [1/m]
FAR = 0.003  #: height of a part above the rail above which the table is constant [m]


class Steel(NamedTuple):
    """Material of wheel and rail."""

    shear_modulus: float = 8.2e10  #: shear modulus G [Pa]
    poisson: float = 0.28


@dataclass(frozen=True)
class TableGrid:
    """The grid of the contact table; outside the grid, values at its edge apply."""

    v: tuple[float, float, int] = (-0.03, 0.015, 226)  #: smallest and largest shift [m], number of points
    roll: tuple[float, float, int] = (-0.012, 0.012, 7)  #: smallest and largest roll [rad], number of points
    yaw: tuple[float, int] = (0.04, 6)  #: largest yaw [rad], number of points from zero


@dataclass(frozen=True, eq=False)
class ContactTable:
    """Values at the points of the grid, (n_parts, n_v, n_roll, n_yaw, fields)."""

    grid: TableGrid
    values: Array


def contact_table(
    pair: Pair, *, parts: tuple[str, ...] = ("tread", "flange"), smoothing: float = 2e-5, steel: Steel | None = None,
    grid: TableGrid | None = None,
) -> ContactTable:  # fmt: skip
    """Return the table of a wheel on its rail; equal arguments return the same table.

    Raises
    ------
    ModelError
        If the smoothing is not in the range of micrometres.
    """
    smoothing = number("contact_table: smoothing", smoothing, above=0.0)
    if not 1e-7 <= smoothing <= 1e-3:
        raise ModelError(f"contact_table: smoothing: expected a height between 1e-7 and 1e-3 m, got {smoothing:g} m")
    return made_once(pair, parts, smoothing, steel or Steel(), grid or TableGrid())


@lru_cache(maxsize=32)
def made_once(pair: Pair, parts: tuple[str, ...], smoothing: float, steel: Steel, grid: TableGrid) -> ContactTable:
    """Return the table, computed at the first request."""
    v, roll = np.linspace(*grid.v), np.linspace(*grid.roll)
    sines = np.linspace(0.0, np.sin(grid.yaw[0]), grid.yaw[1])
    values = np.empty((len(parts), len(v), len(roll), grid.yaw[1], len(FIELDS)))
    modulus = steel.shear_modulus / (1 - steel.poisson)
    for k, part in enumerate(parts):
        for i, phi in enumerate(roll):
            for j, sine in enumerate(sines):
                yaw = float(np.arcsin(sine)) if sine else 1e-6  # x divided by sin psi has a limit at zero
                u = v - pair.radius * np.sin(phi)
                found = near_the_rail(quasi_elastic(pair, u, roll=float(phi), yaw=yaw, smoothing=smoothing, part=part))
                cos = 1 / np.sqrt(1 + found.slope**2)
                shape = ellipse(0.5 * cos / found.radius, 0.5 * np.maximum(found.bend, LEAST_BEND), modulus)
                values[k, :, i, j, :9] = np.column_stack([
                    found.q, found.slope, found.x / np.sin(yaw), found.y, found.z, found.radius,
                    np.log(shape.stiffness), np.log(shape.a_1), np.log(shape.b_1),
                ])  # fmt: skip
                values[k, :, i, j, 9:] = np.log(kalker_coefficients(shape.ratio, steel.poisson)).T
    return ContactTable(grid, values)


def near_the_rail(found: QuasiElastic) -> QuasiElastic:
    """Return a contact that is constant if the part is more than `FAR` above the rail, or beside it."""
    near = np.flatnonzero(found.q > -FAR)
    if not len(near):
        raise ModelError(
            "contact_table: a part of the wheel is nowhere near the rail; check that the profile fits the gauge"
        )
    rows = near[np.clip(np.searchsorted(near, np.arange(len(found.q))), 0, len(near) - 1)]
    return QuasiElastic(*(values[rows] for values in found))


@lru_cache(maxsize=8)
def numbers_of_table(table: ContactTable) -> Array:
    """Return the data of the law, read-only: sizes, then coefficients, (n_v + 2, n_roll + 2, n_yaw + 2, all fields)."""
    (v_0, v_1, n_v), (r_0, r_1, n_r) = table.grid.v, table.grid.roll
    c = even_coefficients(coefficients(coefficients(table.values, 1), 2), 3)
    c = np.moveaxis(c, 0, 3)  # move the axis of parts behind those of v, roll and yaw
    c = c.reshape(*c.shape[:3], -1)
    head = [n_v, v_0, (v_1 - v_0) / (n_v - 1), n_r, r_0, (r_1 - r_0) / (n_r - 1), table.grid.yaw[1],
            np.sin(table.grid.yaw[0]) / (table.grid.yaw[1] - 1), c.shape[3]]  # fmt: skip
    numbers = np.concatenate([head, c.ravel()])
    numbers.setflags(write=False)
    return numbers
