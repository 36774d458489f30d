"""Validity range of a linear body frame: largest rotations, loads and speeds for which a reduced body is accurate."""

from dataclasses import dataclass
from math import inf

__all__ = ["LEFT_OUT", "LINEAR", "STIFFENED", "Limits"]


@dataclass(frozen=True)
class Limits:
    """Largest values for which the deformation of a body is accurate to about one per cent."""

    rotation: float  #: largest elastic rotation of an interface in the body frame [rad]
    #: relative change of stiffness due to loads; for a stiffened body: loads divided by the first buckling load
    load: float
    speed: float  #: largest ratio of angular speed to the lowest angular frequency with one of the joints fixed
    inertia: float = inf  #: largest such speed ratio for a body whose unknown inertia terms are neglected


#: for a linear frame: the strain error is the square of the rotation, the stiffness error is the change due to loads
LINEAR = Limits(rotation=0.1, load=0.1, speed=0.2)
#: with second-order terms: the error grows with the third power of the rotation; near buckling deformation is large
STIFFENED = Limits(rotation=0.3, load=0.7, speed=3.5)

#: largest speed ratio without 3C; its square is the neglected centrifugal deformation relative to the body size
LEFT_OUT = 0.1
