"""Systems, bodies and helpers that several tests share: large unknowns."""

from dataclasses import dataclass

import numpy as np
from numba import njit

from floatframe import Marker, RigidBody, SpringDamper, System
from floatframe.model.elements import NOTHING, Element, ElementLaw

MASS = 1000.0


@njit
def tie_law(t, x, z, lam, data, wrench, z_dot, g, outputs):
    """Pull by lam between two points, 0 = lam - k (L - L0)."""
    k, free = data
    d0, d1, d2 = x[1, 0] - x[0, 0], x[1, 1] - x[0, 1], x[1, 2] - x[0, 2]
    length = np.sqrt(d0 * d0 + d1 * d1 + d2 * d2)
    g[0] = lam[0] - k * (length - free)
    f = lam[0] / length
    wrench[0, 0], wrench[0, 1], wrench[0, 2] = f * d0, f * d1, f * d2
    wrench[1, 0], wrench[1, 1], wrench[1, 2] = -f * d0, -f * d1, -f * d2
    outputs[0] = 0.5 * k * (length - free) ** 2


@dataclass(frozen=True, eq=False)
class Tie(Element):
    """A spring whose tension is an unknown of its own equation."""

    name: str
    marker_a: Marker
    marker_b: Marker
    stiffness: float
    free: float
    sizes: tuple[float, ...] = ()

    def law(self, placed):
        return ElementLaw(
            function=tie_law,
            data=[self.stiffness, self.free],
            multipliers=("N",),
            multiplier_units=("N",),
            multiplier_sizes=self.sizes,
            holds=(NOTHING,),
            outputs=("energy",),
            output_units=("J",),
            acts=("force", "force"),
            is_opposite=True,
            tangent="complex",
            length=1e-3 * self.free,  # the potential is made up for in short ways too
            energy="energy",
        )


A, B = Marker("a", position=(0, 0.1, 0)), Marker("b", position=(0, 0, 0.1))


def pair(length, omega):
    """Return two bodies that turn about each other and fly."""
    spin = np.array([0, 0, omega])
    return [
        RigidBody(name, MASS, MASS * np.diag([0.3, 0.4, 0.5]), position=(side * length, 0, 0),
                  velocity=np.cross(spin, (side * length, 0, 0)) + np.array([0.3, 0.1, 0.4 * side]), omega_B=spin)
        for name, side in (("a", -0.5), ("b", 0.5))
    ]  # fmt: skip


def distance(length):
    """Return the distance of the points at the beginning."""
    return float(np.linalg.norm([length, -0.1, 0.1]))


#: stiffness, distance of the bodies, what the free length lacks to that of the points, turning of the pair, step
CASES = {
    "stiff": (1e8, 1.0, 1e-2, 10.0, 1e-3),
    "stiff, far too long steps": (1e8, 1.0, 1e-2, 10.0, 2e-2),
    "stiff, short steps": (1e8, 1.0, 1e-2, 10.0, 1e-5),
    "stiff, free at the beginning": (1e8, 1.0, 0.0, 40.0, 2e-3),
    "soft": (1e5, 20.0, 10.0, 5.0, 5e-3),
    "soft, long steps": (1e5, 20.0, 10.0, 5.0, 0.05),
    "soft, free at the beginning": (1e5, 20.0, 0.0, 10.0, 5e-3),
}


def tied(case, sizes=None):
    """Return the pair with a tie, or with a spring where no sizes are given."""
    k, length, less, omega, _ = CASES[case]
    free = distance(length) - less
    if sizes is None:
        return System(pair(length, omega), [], [SpringDamper("tie", A, B, k, free_length=free)])
    return System(pair(length, omega), elements=[Tie("tie", A, B, k, free, sizes)])
