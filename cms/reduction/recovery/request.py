"""Requests for recovery rows."""

from dataclasses import dataclass, field

from cms.errors import RecoveryError
from fe_models.foundation.errors import ArgumentError
from fe_models.foundation.presentation import presented
from fe_models.foundation.records import checked_fields
from fe_models.foundation.units import Dimensions
from fe_models.foundation.words import nearest, quoted

__all__ = ["OF_ELEMENTS", "OF_NODES", "QUANTITIES", "RecoveryRequest", "Rows", "motion_dimensions"]

#: quantities of motion, in the order of the time derivatives of z
OF_MOTION = ("displacement", "velocity", "acceleration")
OF_NODES = (*OF_MOTION, "stress", "strain")
OF_ELEMENTS = (
    "beam force", "shell resultant", "spring force", "beam strain", "shell strain", "element stress", "element strain",
)  # fmt: skip
OF_INTERFACES = ("interface force", "net force")
QUANTITIES = (*OF_NODES, *OF_ELEMENTS, *OF_INTERFACES)

Place = str | int


@presented
@dataclass(frozen=True)
@checked_fields(ArgumentError)
class Rows:
    """Rows of one quantity at given places.

    Parameters
    ----------
    quantity
        Quantity of the rows, one of `QUANTITIES`.
    at
        Nodes or elements by number; node sets or groups, interfaces, stress points by name; empty: all places, which is
        not allowed for rows of nodes.
    components
        Components such as "uz" or "xx"; empty: all.
    about
        Reference point of net forces, mesh coordinates [m].

    Raises
    ------
    RecoveryError
        If the quantity is unknown, or does not fit the other fields.
    """

    quantity: str
    at: tuple[Place, ...] = ()
    components: tuple[str, ...] = ()
    about: tuple[float, float, float] | None = None

    def __post_init__(self) -> None:
        object.__setattr__(self, "at", (self.at,) if isinstance(self.at, str | int) else tuple(self.at))
        object.__setattr__(self, "components", tuple(self.components))
        if self.quantity not in QUANTITIES:
            raise RecoveryError(
                f"recovery rows: unknown quantity {quoted(self.quantity)}{nearest(self.quantity, QUANTITIES)}"
            )
        if self.quantity in OF_NODES and not self.at:
            raise RecoveryError(
                f"recovery rows: {self.quantity}: at is missing; expected nodes, node sets or interfaces, such as "
                'at = ["tip", 17]'
            )
        if (self.about is not None) != (self.quantity == "net force"):
            has = "is missing; expected a point [x, y, z]" if self.about is None else "belongs to net force; remove it"
            raise RecoveryError(f"recovery rows: {self.quantity}: about {has}")


@dataclass(frozen=True)
@checked_fields(ArgumentError)
class RecoveryRequest:
    """Ordered rows of one table, and additional loads whose static response it includes.

    Parameters
    ----------
    name
        Name of the recovery table.
    rows
        The requested rows.
    loads_at
        Nodes or node sets at which forces act, in addition to the interfaces.

    Raises
    ------
    RecoveryError
        If there are no rows.
    """

    name: str
    rows: tuple[Rows, ...]
    loads_at: tuple[Place, ...] = field(default=())

    def __post_init__(self) -> None:
        object.__setattr__(self, "rows", tuple(self.rows))
        object.__setattr__(self, "loads_at", tuple(self.loads_at))
        if not self.rows:
            raise RecoveryError(f"recovery {self.name!r}: expected rows, got none")


def motion_dimensions(order: int, component: str) -> Dimensions:
    """Return the dimensions of a displacement, velocity or acceleration; components "rx" to "rz" are rotations."""
    return Dimensions(0.0, 0.0 if component.startswith("r") else 1.0, -float(order))
