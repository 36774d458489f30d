"""The range of a linear body frame: the largest rotations, loads and speeds a reduced body is to be trusted for."""

from dataclasses import dataclass
from math import inf

__all__ = ["LEFT_OUT", "LINEAR", "STIFFENED", "Limits"]


@dataclass(frozen=True)
class Limits:
    """Largest values for which the motion of a body can be trusted within about one per cent of its deformation."""

    rotation: float  #: elastic rotation of an interface in the body frame [rad]
    load: float  #: relative change of the stiffness by the loads; of a stiffened body: loads by the first buckling load
    speed: float  #: angular speed by the lowest angular frequency of the body, held by one of its joints
    inertia: float = inf  #: the same speed, of a body whose unknown inertia terms are left out


#: a linear frame: its strain is wrong by the square of the rotation, its stiffness by what the loads change of it
LINEAR = Limits(rotation=0.1, load=0.1, speed=0.2)
#: with the terms of second order what is left goes with the third power of the rotation; near buckling a body bends far
STIFFENED = Limits(rotation=0.3, load=0.7, speed=3.5)

#: the square of it is the deformation by centrifugal loads, in sizes of the body, that a body without 3C does not have
LEFT_OUT = 0.1
