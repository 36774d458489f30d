"""Elements that stand for built-in parts, which are their oracles."""

from dataclasses import dataclass

import numpy as np
from numba import njit

from floatframe import Marker
from floatframe.elements import POSITION, Element, ElementLaw


@njit
def spring_law(t, x, z, lam, data, wrench, z_dot, g, seen):
    """Tension k (L - L0) + d L' + preload along the line of two markers."""
    k, d, free, preload = data
    d0, d1, d2 = x[1, 0] - x[0, 0], x[1, 1] - x[0, 1], x[1, 2] - x[0, 2]
    length = np.sqrt(d0 * d0 + d1 * d1 + d2 * d2)
    rate = ((x[1, 12] - x[0, 12]) * d0 + (x[1, 13] - x[0, 13]) * d1 + (x[1, 14] - x[0, 14]) * d2) / length
    tension = k * (length - free) + d * rate + preload
    f = tension / length
    wrench[0, 0], wrench[0, 1], wrench[0, 2] = f * d0, f * d1, f * d2
    wrench[1, 0], wrench[1, 1], wrench[1, 2] = -f * d0, -f * d1, -f * d2
    seen[0] = tension
    seen[1] = 0.5 * k * (length - free) ** 2 + preload * length
    seen[2] = d * rate * rate


@njit
def spring_slopes(t, x, z, lam, data, slopes):
    """Write the derivatives of the spring by hand: dF = (K dd + D dv), d = r_B - r_A."""
    k, c, free, preload = data
    d, v = x[1, :3] - x[0, :3], x[1, 12:15] - x[0, 12:15]
    length = np.sqrt((d * d).sum())
    e = d / length
    rate = (e * v).sum()
    f = (k * (length - free) + c * rate + preload) / length
    for r in range(3):
        for j in range(3):
            by_d = (f if r == j else 0.0) + (k - f) * e[r] * e[j] + c / length * e[r] * (v[j] - rate * e[j])
            for b, s_b in ((0, 1.0), (1, -1.0)):
                for a, s_a in ((0, -1.0), (1, 1.0)):
                    slopes[6 * b + r, 12 * a + j] = s_b * s_a * by_d
                    slopes[6 * b + r, 12 * a + 6 + j] = s_b * s_a * c * e[r] * e[j]


def spring_in_python(t, x, z, lam, data, wrench, z_dot, g, seen):
    """Do the same with NumPy, uncompiled."""
    k, d, free, preload = data
    line, v = x[1, :3] - x[0, :3], x[1, 12:15] - x[0, 12:15]
    length = np.sqrt(line @ line)
    rate = line @ v / length
    tension = k * (length - free) + d * rate + preload
    wrench[0, :3] = tension / length * line
    wrench[1, :3] = -wrench[0, :3]
    seen[:] = tension, 0.5 * k * (length - free) ** 2 + preload * length, d * rate * rate


FUNCTIONS = {
    "complex": (spring_law, "complex"),
    "differences": (spring_law, "differences"),
    "given": (spring_law, spring_slopes),
    "Python, complex": (spring_in_python, "complex"),
    "Python, differences": (spring_in_python, "differences"),
}


@dataclass(frozen=True, eq=False)
class Spring(Element):
    name: str
    marker_a: Marker
    marker_b: Marker
    stiffness: float
    damping: float = 0.0
    preload: float = 0.0
    how: str = "complex"
    is_opposite: bool = True
    acts: tuple[str, ...] = ("force", "force")

    def law(self, placed):
        function, tangent = FUNCTIONS[self.how]
        free = float(np.linalg.norm(placed.r[1] - placed.r[0]))
        return ElementLaw(
            function=function,
            tangent=tangent,
            data=[self.stiffness, self.damping, free, self.preload],
            outputs=("tension", "energy", "lost"),
            output_units=("N", "J", "W"),
            acts=self.acts,
            is_opposite=self.is_opposite,
            energy="energy",
            power_lost="lost",
        )


@njit
def ball_law(t, x, z, lam, data, wrench, z_dot, g, seen):
    """Hold two points together by three reactions on the first of them."""
    for k in range(3):
        g[k] = x[0, k] - x[1, k]
        wrench[0, k] = lam[k]
        wrench[1, k] = -lam[k]


@dataclass(frozen=True, eq=False)
class Ball(Element):
    name: str
    marker_a: Marker
    marker_b: Marker

    def law(self, placed):
        return ElementLaw(
            function=ball_law,
            tangent="complex",
            multipliers=("Fx", "Fy", "Fz"),
            multiplier_units=("N", "N", "N"),
            holds=(POSITION,) * 3,
            acts=("force", "force"),
            is_opposite=True,
        )
