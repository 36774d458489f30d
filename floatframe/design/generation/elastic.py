"""Motions and forces of markers and modes of flexible bodies, as terms (docs/recursive.md §2, theory §6, §7).

A marker is displaced by d and rotated by exp(th) in the node frame of its body:

    [d; th] = Psi q - 1/2 qᵀ K_P q,  Psi(q) = Psi - K_P q
    nu     = T th_dot = w + a x + b y                          w = th_dot, x = th × w, y = th × x
    nu_dot = g + th × (a g + b th × g + p (a' w + b' x)) + b w × x,   g = th_ddot, p = th·w

with a = c_2, b = c_3, a' = (da/dt)/t = 2 c_4 - c_3, b' = 3 c_5 - c_4 of `rotation_series`. With

    P_k = int phi_k cᵀ = X_k + S_kl q_l,   U = alpha~ + omega~ omega~,   s_dot = C1_k(q) q_dot_k

The contribution of modes to the force and moment of a body, and the modal forces are

    f   s_ddot + 2 omega × s_dot
    t   B_k q_ddot_k + q_dot K_r q_dot + 2 (tr Q omega - Q omega),  B_k = axial(P_k),  Q = P_k q_dot_k
    h_k C1_k(q)·a + U:P_k + 2 omega·4C_kl q_dot_l + (M q_ddot + D q_dot + K q)_k

The first and second moment of the body are those of its rigid part, plus C1 q + 1/2 q K_t q and
q_k sym(2 X_k + S_kl q_l).
"""

from dataclasses import dataclass

import numpy as np
from numpy import cross

from floatframe.design.generation.graph import Graph, Terms, terms
from floatframe.design.generation.modes import ElasticMarker, Modes
from floatframe.design.generation.rotation_series import rotation_matrix

__all__ = ["MarkerPlace", "MarkerRates", "ModalForces", "ModalMoments"]


def axial(A: Terms) -> Terms:
    """Return the axial vector of a matrix."""
    return np.array([A[2, 1] - A[1, 2], A[0, 2] - A[2, 0], A[1, 0] - A[0, 1]], dtype=object)


def summed(factors: Terms, parts: Terms) -> Terms:
    """Return Σ factors_k parts_k over the first axis."""
    return np.tensordot(factors, parts, axes=1)


def mean_summed(q: Terms, A: Terms, B: Terms) -> Terms:
    """Return Σ q_k (A_k + B_k)/2 of vectors, (n, 3) each."""
    out = []
    for a, b in zip(A.T, B.T, strict=True):
        is_same = all(x is y for x, y in zip(a, b, strict=True))
        out.append(q @ a if is_same else 0.5 * (q @ (a + b)))
    return np.array(out, dtype=object)


def quadratic(x: Terms, A: Terms) -> Terms:
    """Return Σ A_kl x_k x_l of symmetric A, (n, n, 3); the product of each pair of coordinates is used only once."""
    n = len(x)
    total = A[0, 0] * (x[0] * x[0])
    for k in range(n):
        for m in range(max(k, 1), n):
            total = total + (A[k, m] if k == m else 2.0 * A[k, m]) * (x[k] * x[m])
    return total


class MarkerPlace:
    """Position and rotation of a marker in its flexible body, in the node frame."""

    def __init__(self, graph: Graph, marker: ElasticMarker, x: Terms) -> None:
        n = len(marker.shift)
        self.graph, self.marker = graph, marker
        self.q = x[marker.x0 : marker.x0 + n]
        bent = summed(self.q, marker.shift_bend), summed(self.q, marker.turn_bend)
        self.shift, self.turn = marker.shift - bent[0], marker.turn - bent[1]  #: Psi(q), (n, 3) each
        self.d = mean_summed(self.q, marker.shift, self.shift)
        self.th = mean_summed(self.q, marker.turn, self.turn)
        self.rho = marker.place + self.d
        self.E = rotation_matrix(graph, self.th)
        angle = self.th @ self.th
        self.c = [graph.stumpff(k, angle) for k in range(6)]

    @property
    def rates(self) -> slice:
        """The rates of the modes among all rates."""
        return slice(self.marker.v0, self.marker.v0 + len(self.q))

    def spun(self, v: Terms) -> Terms:
        """Return T v, the angular velocity for the rate v of the rotation vector."""
        return v + cross(self.th, self.c[2] * v + self.c[3] * cross(self.th, v))

    def spun_back(self, t: Terms) -> Terms:
        """Return Tᵀ t, the generalised moment for a moment t."""
        return t - cross(self.th, self.c[2] * t - self.c[3] * cross(self.th, t))

    def modal_forces(self, f: Terms, t: Terms) -> Terms:
        """Return the modal forces of a wrench at the marker, (n,)."""
        return self.shift @ f + self.turn @ self.spun_back(t)

    def columns(self) -> tuple[Terms, Terms]:
        """Return the displacement and rotation of the marker per modal coordinate, (n, 3) each."""
        return self.shift, np.array([self.spun(each) for each in self.turn], dtype=object)


class MarkerRates:
    """Velocity and acceleration of a marker relative to its flexible body, in the node frame."""

    def __init__(self, place: MarkerPlace, v: Terms, a: Terms) -> None:
        marker, q_dot, q_ddot = place.marker, v[place.rates], a[place.rates]
        self.d_dot = summed(q_dot, place.shift)
        self.d_ddot = summed(q_ddot, place.shift) - quadratic(q_dot, marker.shift_bend)
        th, w = place.th, summed(q_dot, place.turn)
        g = summed(q_ddot, place.turn) - quadratic(q_dot, marker.turn_bend)
        _, _, c2, c3, c4, c5 = place.c
        x = cross(th, w)
        self.nu = w + cross(th, c2 * w + c3 * x)
        along = th @ w
        inner = c2 * g + c3 * cross(th, g) + along * ((2.0 * c4 - c3) * w + (3.0 * c5 - c4) * x)
        self.nu_dot = g + cross(th, inner) + c3 * cross(w, x)


@dataclass(frozen=True, eq=False)
class ModalMoments:
    """First and second moments of a deformed flexible body."""

    first: Terms  #: C1_k(q), (n, 3)
    P: Terms  #: P_k, (n, 3, 3)
    B: Terms  #: (n, 3)
    s: Terms  #: contribution of modes to the first moment, (3,)
    second: Terms  #: contribution of modes to the second moment, (3, 3)

    @classmethod
    def of(cls, graph: Graph, modes: Modes, x: Terms) -> "ModalMoments":
        """Return the moments of a body at positions of the tree."""
        q = x[modes.x0 : modes.x0 + modes.n]
        bent = summed(q, modes.K_t)
        P = modes.X + np.array([summed(q, each) for each in modes.S], dtype=object)
        B = np.array([axial(each) for each in P], dtype=object)
        twice = summed(q, modes.X + P)
        second = terms(graph, np.zeros((3, 3)))
        for i in range(3):
            for j in range(i, 3):
                second[i, j] = second[j, i] = 0.5 * (twice[i, j] + twice[j, i])
        first = modes.C1 + bent
        return cls(first, P, B, mean_summed(q, modes.C1, first), second)


class ModalForces:
    """Contribution of modes to the force and moment of a body, and the modal forces."""

    def __init__(self, modes: Modes, moments: ModalMoments, x: Terms, v: Terms, a: Terms) -> None:
        rates = slice(modes.v0, modes.v0 + modes.n)
        self.modes, self.moments = modes, moments
        self.q, self.q_dot, self.q_ddot = x[modes.x0 : modes.x0 + modes.n], v[rates], a[rates]

    def wrench(self, omega: Terms) -> tuple[Terms, Terms]:
        """Return the force and moment that do not follow from the moments of the body, in the node frame."""
        modes, moments, q_dot, q_ddot = self.modes, self.moments, self.q_dot, self.q_ddot
        f = summed(q_ddot, moments.first) + quadratic(q_dot, modes.K_t)
        f = f + 2.0 * cross(omega, summed(q_dot, moments.first))
        Q = summed(q_dot, moments.P)
        t = summed(q_ddot, moments.B) + quadratic(q_dot, modes.K_r)
        return f, t + 2.0 * ((Q[0, 0] + Q[1, 1] + Q[2, 2]) * omega - Q @ omega)

    def modal(self, acc: Terms, omega: Terms, U: Terms) -> Terms:
        """Return the forces of the modes, (n,)."""
        modes, moments = self.modes, self.moments
        h = modes.M @ self.q_ddot + modes.D @ self.q_dot + modes.K @ self.q
        h = h + moments.first @ acc + np.array([(U * each).sum() for each in moments.P], dtype=object)
        spun = np.array([summed(self.q_dot, each) @ omega for each in modes.C4], dtype=object)
        return h + 2.0 * spun
