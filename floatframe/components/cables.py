"""A massless cable over a sequence of points, which can only pull.

With l the sum of the distances between consecutive points, e = l - l_0, and d_i the direction from point i to the next:

    T = k e + c l_dot if this is above zero and e > 0, else 0;      force on point i:  T (d_i - d_(i-1))

The cable runs over its inner points without friction, so its tension is the same everywhere.
"""

from collections.abc import Sequence
from dataclasses import dataclass

from numba import njit

from fe_models.foundation.records import checked_fields, frozen_copies
from floatframe.errors import ModelError
from floatframe.model.bodies.markers import Marker
from floatframe.model.checked_values import number
from floatframe.model.elements import Element, ElementLaw, Placed
from floatframe.model.elements.pairs import line_between
from floatframe.model.elements.unit_names import outputs_in
from floatframe.model.shapes.drawn import Stretched

__all__ = ["Cable"]

ELEMENTS = {"cable": "floatframe.components.cables:Cable"}


@frozen_copies
@dataclass(frozen=True, eq=False)
@checked_fields(ModelError)
class Cable(Element):
    """A cable between points of bodies, with the stiffness of the whole cable; tensioned or slack when assembled.

    Raises
    ------
    ModelError
        If there are fewer than two points, a number is out of its range, or both length and preload are given.
    """

    name: str
    points: Sequence[Marker]  #: ends and inner points, in order
    stiffness: float  #: stiffness of the whole cable, E A / length [N/m]
    damping: float = 0.0  #: damping while the cable is taut [N s/m]
    preload: float | None = None  #: tension when assembled [N]; None: 0, or the value that follows from `length`
    length: float | None = None  #: unstretched length [m]; None: computed from the preload

    def __post_init__(self) -> None:
        where = f"element {self.name!r}"
        if len(self.points) < 2:
            raise ModelError(f"{where}: points: expected two at least, got {len(self.points)}")
        object.__setattr__(self, "stiffness", number(f"{where}: stiffness", self.stiffness, above=0.0))
        object.__setattr__(self, "damping", number(f"{where}: damping", self.damping, at_least=0.0))
        if self.preload is not None and self.length is not None:
            raise ModelError(
                f"{where}: preload and length: expected one of them, got both; each follows from the other"
            )
        if self.preload is not None:
            object.__setattr__(self, "preload", number(f"{where}: preload", self.preload, at_least=0.0))
        if self.length is not None:
            object.__setattr__(self, "length", number(f"{where}: length", self.length, above=0.0))

    @property
    def markers(self) -> tuple[Marker, ...]:
        """Markers of the cable's points."""
        return tuple(self.points)

    def law(self, placed: Placed) -> ElementLaw:
        """Return the law of the cable; `ModelError` if two consecutive points coincide as assembled."""
        parts = [float(((b - a) @ (b - a)) ** 0.5) for a, b in zip(placed.r[:-1], placed.r[1:], strict=True)]
        if min(parts) == 0:
            k = parts.index(0.0)
            raise ModelError(
                f"element {self.name!r}: points {k + 1} and {k + 2} coincide as placed, so that the cable has no "
                "direction there"
            )
        length = sum(parts) - (self.preload or 0.0) / self.stiffness if self.length is None else self.length
        if length <= 0:
            raise ModelError(
                f"element {self.name!r}: preload: {self.preload:g} stretches the cable by more than its length; give a "
                "greater stiffness or a smaller preload"
            )
        outputs = [("tension", "N"), ("length", "m"), ("slack", "m"), ("energy", "J"), ("power lost", "W")]
        return ElementLaw(
            function=cable_law,
            data=[self.stiffness, self.damping, length],
            **outputs_in(placed.units, outputs),
            tangent="complex",
            acts=("force",) * len(self.points),
            is_opposite=len(self.points) == 2,
            energy="energy",
            power_lost="power lost",
        )

    def drawn(self) -> Sequence[Stretched]:
        """Return the straight segments of the cable."""
        return tuple(Stretched("line", first=k, second=k + 1) for k in range(len(self.points) - 1))


@njit
def cable_law(t, x, z, lam, data, wrench, z_dot, g, outputs):
    """Write the force at every point, and the outputs."""
    stiffness, damping, free = data[0], data[1], data[2]
    total, rate = 0.0 * x[0, 0], 0.0 * x[0, 0]
    for k in range(x.shape[0] - 1):
        length, speed, _ = line_between(x, k, k + 1)
        total += length
        rate += speed
    e = total - free
    outputs[1] = total
    if e.real <= 0.0:
        outputs[2] = -e
        return
    outputs[3] = 0.5 * stiffness * e * e
    tension = stiffness * e + damping * rate
    if tension.real <= 0.0:
        tension = 0.0 * tension
    for k in range(x.shape[0] - 1):
        _, _, d = line_between(x, k, k + 1)
        for i in range(3):
            wrench[k, i] += tension * d[i]
            wrench[k + 1, i] -= tension * d[i]
    outputs[0] = tension
    outputs[4] = (tension - stiffness * e) * rate
