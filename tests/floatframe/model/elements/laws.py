"""Elements that stand for built-in parts, which are their oracles."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numba import njit

from floatframe import Marker
from floatframe.model.elements import NOTHING, POSITION, VELOCITY, Element, ElementLaw


@njit
def spring_law(t, x, z, lam, data, wrench, z_dot, g, outputs):
    """Tension k (L - L0) + d L' + preload along the line of two markers."""
    k, d, free, preload = data
    d0, d1, d2 = x[1, 0] - x[0, 0], x[1, 1] - x[0, 1], x[1, 2] - x[0, 2]
    length = np.sqrt(d0 * d0 + d1 * d1 + d2 * d2)
    rate = ((x[1, 12] - x[0, 12]) * d0 + (x[1, 13] - x[0, 13]) * d1 + (x[1, 14] - x[0, 14]) * d2) / length
    tension = k * (length - free) + d * rate + preload
    f = tension / length
    wrench[0, 0], wrench[0, 1], wrench[0, 2] = f * d0, f * d1, f * d2
    wrench[1, 0], wrench[1, 1], wrench[1, 2] = -f * d0, -f * d1, -f * d2
    outputs[0] = tension
    outputs[1] = 0.5 * k * (length - free) ** 2 + preload * length
    outputs[2] = d * rate * rate


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


def spring_in_python(t, x, z, lam, data, wrench, z_dot, g, outputs):
    """Do the same with NumPy, uncompiled."""
    k, d, free, preload = data
    line, v = x[1, :3] - x[0, :3], x[1, 12:15] - x[0, 12:15]
    length = np.sqrt(line @ line)
    rate = line @ v / length
    tension = k * (length - free) + d * rate + preload
    wrench[0, :3] = tension / length * line
    wrench[1, :3] = -wrench[0, :3]
    outputs[:] = tension, 0.5 * k * (length - free) ** 2 + preload * length, d * rate * rate


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
def ball_law(t, x, z, lam, data, wrench, z_dot, g, outputs):
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


@njit
def jack_law(t, x, z, lam, data, wrench, z_dot, g, outputs):
    """Lift with a pressure: p' = B (c (p_s - p) - A v), force A p along z."""
    area, leak, supply, stiffness = data
    wrench[0, 2] = area * z[0]
    z_dot[0] = stiffness * (leak * (supply - z[0]) - area * x[0, 14])
    outputs[0] = area * z[0]
    outputs[1] = supply * leak * (supply - z[0])  # the power of the supply less its throttle's
    outputs[2] = 0.5 * z[0] * z[0] / stiffness
    outputs[3] = leak * (supply - z[0]) * (supply - z[0])


@njit
def closed_law(t, x, z, lam, data, wrench, z_dot, g, outputs):
    """Hold another pressure at rest."""
    z_dot[0] = 2 * data[2] - z[0]
    wrench[0, 2] = data[0] * z[0]


@dataclass(frozen=True, eq=False)
class Jack(Element):
    name: str
    marker: Marker
    area: float = 1e-3
    leak: float = 1e-9
    supply: float = 1e6
    stiffness: float = 1e12
    is_closed: bool = False
    start: float = 3e5

    def law(self, placed):
        return ElementLaw(
            function=jack_law,
            rest=closed_law if self.is_closed else None,
            data=[self.area, self.leak, self.supply, self.stiffness],
            states=("p",),
            start=(self.start,),
            state_units=("Pa",),
            state_sizes=(1e5,),
            outputs=("force", "given", "energy", "lost"),
            output_units=("N", "W", "J", "W"),
            acts=("force",),
            tangent="complex",
            energy="energy",
            power_in="given",
            power_lost="lost",
        )


@njit
def circuit_law(t, x, z, lam, data, wrench, z_dot, g, outputs):
    """Follow b stiffly by the cube root a, with a flow lam that splits: lam + lam³ = b."""
    z_dot[0] = -data[0] * (z[0] * z[0] * z[0] - z[1])
    z_dot[1] = np.cos(t) - z[1]
    g[0] = lam[0] + lam[0] * lam[0] * lam[0] - z[1]


@dataclass(frozen=True, eq=False)
class Circuit(Element):
    name: str
    marker: Marker
    stiffness: float = 1e6
    tangent: str = "complex"

    def law(self, placed):
        return ElementLaw(
            function=circuit_law,
            data=[self.stiffness],
            states=("a", "b"),
            start=(1.0, 1.0),
            multipliers=("flow",),
            holds=(NOTHING,),
            acts=("none",),
            tangent=self.tangent,
        )


@njit
def disc_law(t, x, z, lam, data, wrench, z_dot, g, outputs):
    """Roll a disc, whose axis is y of its marker, on the plane z = 0.

    Its lowest point is rho = R (n (n · z) - z)/|...| from the centre, n the axis; the point touches the plane, and
    moves neither along x nor along y.
    """
    n0, n1, n2 = x[0, 4], x[0, 7], x[0, 10]
    s = np.sqrt(n0 * n0 + n1 * n1)
    r0, r1, r2 = data[0] * n0 * n2 / s, data[0] * n1 * n2 / s, -data[0] * s
    w0, w1, w2 = x[0, 15], x[0, 16], x[0, 17]
    g[0] = x[0, 2] + r2
    g[1] = x[0, 12] + w1 * r2 - w2 * r1
    g[2] = x[0, 13] + w2 * r0 - w0 * r2
    f0, f1, f2 = lam[1], lam[2], lam[0]
    wrench[0, 0], wrench[0, 1], wrench[0, 2] = f0, f1, f2
    wrench[0, 3], wrench[0, 4], wrench[0, 5] = r1 * f2 - r2 * f1, r2 * f0 - r0 * f2, r0 * f1 - r1 * f0


@dataclass(frozen=True, eq=False)
class Disc(Element):
    name: str
    marker: Marker
    radius: float

    def law(self, placed):
        return ElementLaw(
            function=disc_law,
            data=[self.radius],
            multipliers=("N", "Fx", "Fy"),
            multiplier_units=("N", "N", "N"),
            holds=(POSITION, VELOCITY, VELOCITY),
            tangent="complex",
        )


@njit
def mount_law(t, x, z, lam, data, wrench, z_dot, g, outputs):
    """Follow the energy k p²/2 + a p⁴/4 - kappa (tr Q - 3)/2: p the place of b as a sees it, Q the turn of b against a.

    A damper takes what the velocity of b against the body of a gives.
    """
    k, a, kappa, c = data
    d0, d1, d2 = x[1, 0] - x[0, 0], x[1, 1] - x[0, 1], x[1, 2] - x[0, 2]
    w0, w1, w2 = x[0, 15], x[0, 16], x[0, 17]
    v0 = x[1, 12] - x[0, 12] - (w1 * d2 - w2 * d1)
    v1 = x[1, 13] - x[0, 13] - (w2 * d0 - w0 * d2)
    v2 = x[1, 14] - x[0, 14] - (w0 * d1 - w1 * d0)
    square = d0 * d0 + d1 * d1 + d2 * d2
    f = k + a * square
    f0, f1, f2 = -f * d0 - c * v0, -f * d1 - c * v1, -f * d2 - c * v2
    trace, m0, m1, m2 = 0.0 * d0, 0.0 * d0, 0.0 * d0, 0.0 * d0
    for j in range(3):  # Q = A_b A_aᵀ, its axial vector
        a0, a1, a2 = x[0, 3 + j], x[0, 6 + j], x[0, 9 + j]
        b0, b1, b2 = x[1, 3 + j], x[1, 6 + j], x[1, 9 + j]
        trace += a0 * b0 + a1 * b1 + a2 * b2
        m0 -= 0.5 * kappa * (b2 * a1 - b1 * a2)
        m1 -= 0.5 * kappa * (b0 * a2 - b2 * a0)
        m2 -= 0.5 * kappa * (b1 * a0 - b0 * a1)
    wrench[1, 0], wrench[1, 1], wrench[1, 2] = f0, f1, f2
    wrench[1, 3], wrench[1, 4], wrench[1, 5] = m0, m1, m2
    wrench[0, 0], wrench[0, 1], wrench[0, 2] = -f0, -f1, -f2
    wrench[0, 3] = -m0 - (d1 * f2 - d2 * f1)
    wrench[0, 4] = -m1 - (d2 * f0 - d0 * f2)
    wrench[0, 5] = -m2 - (d0 * f1 - d1 * f0)
    outputs[0] = 0.5 * k * square + 0.25 * a * square * square - 0.5 * kappa * (trace - 3.0)
    outputs[1] = c * (v0 * v0 + v1 * v1 + v2 * v2)


@dataclass(frozen=True, eq=False)
class Mount(Element):
    """A mount with a potential that is not quadratic, in six directions."""

    name: str
    marker_a: Marker
    marker_b: Marker
    stiffness: float
    hardening: float
    turning: float
    damping: float = 0.0

    def law(self, placed):
        return ElementLaw(
            function=mount_law,
            data=[self.stiffness, self.hardening, self.turning, self.damping],
            outputs=("energy", "lost"),
            output_units=("J", "W"),
            tangent="complex",
            energy="energy",
            power_lost="lost",
        )


@njit
def loop_law(t, x, z, lam, data, wrench, z_dot, g, outputs):
    """Follow the energy k/4 (|d|² - L²)² of each side d of a loop through three points, also of none."""
    for side in range(3):
        a, b = side, (side + 1) % 3
        d0, d1, d2 = x[b, 0] - x[a, 0], x[b, 1] - x[a, 1], x[b, 2] - x[a, 2]
        more = d0 * d0 + d1 * d1 + d2 * d2 - data[1] * data[1]
        outputs[0] += 0.25 * data[0] * more * more
        for k, d in enumerate((d0, d1, d2)):
            wrench[a, k] += data[0] * more * d
            wrench[b, k] -= data[0] * more * d


@dataclass(frozen=True, eq=False)
class Loop(Element):
    """Points that draw each other, of which two may be in one place: a rope that returns to its hook."""

    name: str
    marker_a: Marker
    marker_b: Marker
    marker_c: Marker
    stiffness: float
    side: float

    def law(self, placed):
        return ElementLaw(
            function=loop_law,
            data=[self.stiffness, self.side],
            outputs=("energy",),
            output_units=("J",),
            tangent="complex",
            acts=("force",) * 3,
            energy="energy",
        )


@njit
def creep_law(t, x, z, lam, data, wrench, z_dot, g, outputs):
    """Pull with k (L - z) between two points, z' = (L - z)/T."""
    k, T = data
    d0, d1, d2 = x[1, 0] - x[0, 0], x[1, 1] - x[0, 1], x[1, 2] - x[0, 2]
    length = np.sqrt(d0 * d0 + d1 * d1 + d2 * d2)
    f = k * (length - z[0]) / length
    z_dot[0] = (length - z[0]) / T
    wrench[0, 0], wrench[0, 1], wrench[0, 2] = f * d0, f * d1, f * d2
    wrench[1, 0], wrench[1, 1], wrench[1, 2] = -f * d0, -f * d1, -f * d2


@dataclass(frozen=True, eq=False)
class Creeping(Element):
    """A spring whose free length follows its length; its power counts as work."""

    name: str
    marker_a: Marker
    marker_b: Marker
    stiffness: float
    time: float

    def law(self, placed):
        free = float(np.linalg.norm(placed.r[1] - placed.r[0]))
        return ElementLaw(
            function=creep_law,
            data=[self.stiffness, self.time],
            states=("free",),
            start=(0.8 * free,),
            state_units=("m",),
            tangent="complex",
            acts=("force", "force"),
            is_opposite=True,
        )


@njit
def plane_law(t, x, z, lam, data, wrench, z_dot, g, outputs):
    """Keep point b in the plane through point a normal to the axis z of a, by the reaction lam along it."""
    e0, e1, e2 = x[0, 5], x[0, 8], x[0, 11]
    d0, d1, d2 = x[1, 0] - x[0, 0], x[1, 1] - x[0, 1], x[1, 2] - x[0, 2]
    g[0] = e0 * d0 + e1 * d1 + e2 * d2 - data[0]
    f0, f1, f2 = lam[0] * e0, lam[0] * e1, lam[0] * e2
    wrench[1, 0], wrench[1, 1], wrench[1, 2] = f0, f1, f2
    wrench[0, 0], wrench[0, 1], wrench[0, 2] = -f0, -f1, -f2
    wrench[0, 3], wrench[0, 4], wrench[0, 5] = -(d1 * f2 - d2 * f1), -(d2 * f0 - d0 * f2), -(d0 * f1 - d1 * f0)


@dataclass(frozen=True, eq=False)
class OnPlane(Element):
    """Keeps point b at its height above the plane of marker a: one reaction."""

    name: str
    marker_a: Marker
    marker_b: Marker

    def law(self, placed):
        height = float(placed.A[0][:, 2] @ (placed.r[1] - placed.r[0]))
        return ElementLaw(
            function=plane_law,
            data=[height],
            multipliers=("force",),
            multiplier_units=("N",),
            holds=(POSITION,),
            tangent="complex",
        )


def yielding_law(t, x, z, lam, data, wrench, z_dot, g, outputs):
    """Pull back to a point that creeps after the marker, along z, harder than in proportion."""
    stiffness, hardening, time = data
    e = x[0, 2] - z[0]
    wrench[0, 2] = -stiffness * e * (1 + hardening * e * e)
    z_dot[0] = e / time


compiled_yielding_law = njit(yielding_law)


@dataclass(frozen=True, eq=False)
class Yielding(Element):
    name: str
    marker: Marker
    function: Callable[..., None] = compiled_yielding_law  #: `yielding_law`, or a function that calls it
    tangent: str = "complex"

    def law(self, placed):
        return ElementLaw(
            function=self.function,
            data=[4e3, 50.0, 0.05],
            states=("z",),
            start=(0.0,),
            state_units=("m",),
            state_sizes=(0.1,),
            acts=("force",),
            tangent=self.tangent,
        )
