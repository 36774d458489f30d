"""The sliding joint: a point or a body slides along the deformed centre line of a flexible body.

Evaluated in `floatframe.engine.kernels.joints.deformed_line`.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from fe_models.foundation.arrays import Array, GivenArrayOrNone, given
from fe_models.foundation.records import checked_fields, frozen_copies
from floatframe.errors import ModelError
from floatframe.model.bodies.markers import Marker, Place
from floatframe.model.checked_values import unit_vector
from floatframe.model.joints.axis_frame import GivenMotions, checked_motions, given_motions
from floatframe.model.joints.joint import Joint
from floatframe.model.joints.rows import LINE, LINE_FREE, LINE_TURN, MOMENT, NO_MOMENT, Row, orientation_rows

__all__ = ["SlidingJoint"]

ALONG, ACROSS, UPWARD = range(3)  #: directions of LINE rows


@frozen_copies
@dataclass(frozen=True, eq=False)
@checked_fields(ModelError)
class SlidingJoint(Joint):
    """Keeps the point of marker B on the deformed line through interfaces of a flexible body; two constraints.

    The line leads from marker A through the interfaces `line`, in their order; undeformed it is straight. Between the
    interfaces it is a cubic defined by their displacements and rotations, so a beam that bends within its length needs
    three or more interfaces. Beyond its ends the line continues straight. With `is_aligned`, marker B keeps its
    assembled orientation relative to the line, which rotates as it bends and twists: five constraints, a prismatic
    joint on the deformed line. There is no friction: the reaction does no work as B slides.

    Coordinate `distance`: position of B along the line from marker A, measured on the undeformed line.

    Parameters
    ----------
    name
        Name of the joint, unique in the system.
    marker_a
        Marker at the interface of a flexible body where the line begins.
    marker_b
        Marker B; a body, or its name, is attached where the other marker is.
    line
        Names of the other interfaces of that body along the line.
    is_aligned
        True: the orientation of marker B follows the line.
    normal
        Direction normal to the line in the axes of its body, (3,); None: chosen automatically.
    motions
        Prescribed motions by coordinate; a number fixes the coordinate.
    """

    name: str
    marker_a: Marker
    marker_b: Place
    line: Sequence[str] = ()
    is_aligned: bool = False
    normal: GivenArrayOrNone = given(None)
    motions: GivenMotions = given_motions()

    coordinates = ("distance",)

    def __post_init__(self) -> None:
        where = f"joint {self.name!r}"
        if not isinstance(self.marker_a, Marker) or self.marker_a.interface is None:
            raise ModelError(f"{where}: marker_a: expected a Marker at an interface of a flexible body")
        line = (self.line,) if isinstance(self.line, str) else tuple(self.line)
        names = (self.marker_a.interface, *line)
        if not line or len(set(names)) != len(names):
            raise ModelError(
                f"{where}: line: expected the names of one or more further interfaces of the body, each once, got "
                f"{list(line)} after {self.marker_a.interface!r}"
            )
        object.__setattr__(self, "line", line)
        if self.normal is not None:
            object.__setattr__(self, "normal", unit_vector(f"{where}: normal", self.normal))
        checked_motions(self)

    @property
    def stations(self) -> tuple[str, ...]:
        """Names of the interfaces along the line."""
        assert self.marker_a.interface is not None
        return (self.marker_a.interface, *self.line)

    @property
    def size(self) -> int:
        """Number of components of the unknown wrench: force, and moment if aligned."""
        return 6 if self.is_aligned else 3

    @property
    def moment_b(self) -> int:
        """Index at which the moment on B starts in the wrench."""
        return MOMENT if self.is_aligned else NO_MOMENT

    def rows(self, A_a: Array, A_b: Array, d: Array) -> tuple[Row, ...]:
        """Return the rows from assembled axes, (3, 3), of the line (A_a, x along the line) and of marker B (A_b)."""
        if "distance" in self.motions:
            own = Row(LINE, part=ALONG, motion=self.motions["distance"])
        else:
            own = Row(LINE_FREE, part=ALONG)
        turned = (Row(LINE_TURN, row.x, row.y, part=MOMENT) for row in orientation_rows(A_a.T @ A_b) if self.is_aligned)
        return (Row(LINE, part=ACROSS), Row(LINE, part=UPWARD), own, *turned)


def line_triad(where: str, points: Array, normal: Array | None) -> tuple[Array, Array]:
    """Return positions along a straight line of points, (n,), and line axes as columns, x along the line, (3, 3).

    Raises
    ------
    ModelError
        If the points are not in sequence along a straight line, or the normal is parallel to it.
    """
    chord = points[-1] - points[0]
    length = float(np.linalg.norm(chord))
    if not length > 0:
        raise ModelError(f"{where}: the first and the last interface of the line coincide")
    x = chord / length
    s = (points - points[0]) @ x
    beside = float(np.abs(points - points[0] - np.outer(s, x)).max())
    if beside > 1e-6 * length or not (np.diff(s) > 1e-6 * length).all():
        raise ModelError(
            f"{where}: its interfaces: expected them in order on a straight line, got positions {s.round(9)} at "
            f"distances up to {beside:.3g} from it"
        )
    y = np.eye(3)[int(np.argmin(np.abs(x)))] if normal is None else normal
    y = y - (y @ x) * x
    if np.linalg.norm(y) < 1e-6:
        raise ModelError(f"{where}: normal: expected a direction normal to the line {x.round(6)}, got one along it")
    y = y / np.linalg.norm(y)
    return s, np.column_stack([x, y, np.cross(x, y)])
