"""What a joint is: its rows, and its motion as columns, from which all formulations follow (docs/relative.md §2)."""

from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any, ClassVar

import numpy as np

from fe_models.foundation.arrays import Array
from floatframe.errors import ModelError
from floatframe.model.bodies.markers import Place
from floatframe.model.joints.rows import Row

__all__ = ["MOVES_IN_A", "SIDE_A", "SIDE_B", "TURNS_IN_B", "Column", "Joint"]

SIDE_A, SIDE_B = 0, 1
ZERO = np.zeros(3)


@dataclass(frozen=True, eq=False)
class Column:
    """One coordinate: at unit rate B moves by a screw that is fixed in A (through its point) or in B."""

    name: str  #: name of the coordinate, "" if the joint gives it none
    #: velocity of the point of B relative to A at unit rate, axes of A, (3,)
    tau: Array = field(default_factory=lambda: ZERO)
    #: angular velocity of B relative to A at unit rate, axes of A or B, (3,)
    alpha: Array = field(default_factory=lambda: ZERO)
    side: int = SIDE_A
    unit: str = "rad"  #: unit of the coordinate
    #: factor to a second coordinate of the same freedom (for a screw, angle = 1/slope distance)
    factors: tuple[tuple[str, float], ...] = ()


#: free rotation, fixed in B
TURNS_IN_B = tuple(Column(f"turn {axis}", alpha=e, side=SIDE_B) for axis, e in zip("xyz", np.eye(3), strict=True))
#: free translation along the axes of A
MOVES_IN_A = tuple(Column(axis, tau=e, unit="m") for axis, e in zip("xyz", np.eye(3), strict=True))


class Joint:
    """Base class of joints, from which users derive frozen dataclasses.

    The fields begin with `name`, `marker_a` and `marker_b`. A coordinate may have a prescribed motion in the field
    `motions`, if the joint has one.
    """

    name: str
    coordinates: tuple[str, ...] = ()  #: names of the coordinates

    if TYPE_CHECKING:
        __dataclass_fields__: ClassVar[dict[str, Any]]

        @property
        def marker_a(self) -> Place:
            """Marker A, also as "body.interface"; a body, or its name, is attached where marker B is."""

        @property
        def marker_b(self) -> Place:
            """Marker B, also as "body.interface"; a body, or its name, is attached where marker A is."""

        @property
        def size(self) -> int:
            """Number of components of the unknown wrench, which is the number of rows."""

        @property
        def moment_b(self) -> int:
            """Index at which the moment on B starts in the wrench: MOMENT, MOMENT_B or NO_MOMENT."""

    def rows(self, A_a: Array, A_b: Array, d: Array) -> tuple[Row, ...]:
        """Return the rows for the assembled axes of the markers, (3, 3), and d = r_B - r_A, (3,), in ground axes."""
        raise ModelError(f"{type(self).__name__}: expected a method rows(A_a, A_b, d) that returns the rows of a joint")

    def columns(self, A_a: Array, A_b: Array) -> tuple[Column, ...] | None:
        """Return the motion that the joint allows, for the assembled axes of the markers, (3, 3).

        By default None: the joint stays a constraint in relative coordinates.
        """
        return None
