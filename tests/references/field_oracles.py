"""Independent solutions of the rigid problems of the benchmark library of the field."""

import numpy as np
from scipy.integrate import solve_ivp

from floatframe.results.trajectory import Trajectory
from tests.references.hinge_trees import Link, Tree

X, Y, Z = np.eye(3)
G = 9.81

#: angles of Andrews' mechanism at 0.03 s, as in `ANDREWS_START`: PSIDE to 1e-14 (Mazzia & Magherini 2008)
ANDREWS_END = np.array(
    [
        0.1581077119629904e2,
        -0.1575637105984298e2,
        0.4082224013073101e-1,
        -0.5347301163226948,
        0.5244099658805304,
        0.5347301163226948,
        0.1048080741042263e1,
    ]
)


def four_bar_angle(n: int, t: np.ndarray, speed: float = 1.0) -> np.ndarray:
    """Angle of the cranks of n windows to the x axis: all rods as one pendulum, (n_t,) [rad]."""
    inertia, moment = (n + 1) / 3 + n, G * ((n + 1) / 2 + n)

    def rates(_: float, y: np.ndarray) -> list[float]:
        return [y[1], -moment / inertia * np.cos(y[0])]

    return solve_ivp(rates, (t[0], t[-1]), [np.pi / 2, -speed], "DOP853", t, rtol=1e-13, atol=1e-13).y[0]


def andrews_angles(motion: Trajectory) -> np.ndarray:
    """The seven angles of a motion of the engine, modulo a turn, (n_t, 7)."""
    total = {}
    for link in ("OF", "FE", "BDE", "GE", "AG", "HE", "AH"):
        p = motion.body(link).p
        total[link] = 2 * np.arctan2(p[:, 3], p[:, 0])
    beta, gamma, delta, epsilon = (total[link] for link in ("OF", "BDE", "AG", "AH"))
    return np.column_stack(
        [beta, total["FE"] - beta, gamma, total["GE"] - delta, delta, total["HE"] - epsilon, epsilon]
    )


def bricard(t: np.ndarray, *, rtol: float = 1e-11) -> np.ndarray:
    """Place of P_3 of Bricard's mechanism, (n_t, 3), by trees of mass points."""
    P = np.array([[0, 0, 0], [1, 0, 0], [1, -1, 0], [1, -1, 1], [0, -1, 1], [0, 0, 1]], dtype=float)
    moments = np.array([0.02, 1.01, 1.01]) / 12
    links = []
    for k, axis in enumerate((Y, Z, X, Y, Z)):
        along = P[k + 1] - P[k]
        z = Z if abs(along @ Z) < 0.5 else X
        axes = np.column_stack([along, np.cross(z, along), z])
        links.append(Link(k - 1, P[k], axis, 1.0, (P[k] + P[k + 1]) / 2, axes, moments))
    tree = Tree(links, [((4, P[5]), (-1, P[5])), ((4, P[5] + X), (-1, P[5] + X))], -G * Y)
    angles = tree.integrate(t, np.zeros(5), np.zeros(5), rtol=rtol)
    return np.array([tree.place(tree.poses(q), 3, P[3]) for q in angles])


def governor(t: np.ndarray) -> np.ndarray:
    """Height of the slider of the stiff governor, (n_t,) [m]: angle of the rods and height, the shaft by its momentum.

    With a the angle of the rods below the horizon, at x = b + l cos a and z = 1 - l sin a along them, the angular
    momentum H = I(a) w about the shaft is kept, and

        2 I_r a'' = H²/(2 I²) dI/da + 2 m g c cos a + Q_a,   m_s s'' = -m_s g + Q_s

    with Q of both springs along their length.
    """
    b, side, ball, k, d = 0.05, 0.01, 5.0, 8e5, 4e4
    m = 3000 * side**2
    total, m_s = m + ball, 3.0
    first = m * 0.5 + ball  # ∫ l dm
    second = m / 3 + ball  # ∫ l² dm
    I_r = m * (1 + side**2) / 12 + m * 0.25 + ball
    thick = m * side**2 / 12
    own = m_s * 0.1**2 / 6 + m * 2 * side**2 / 12

    def shaft_inertia(a: float) -> tuple[float, float]:
        c, s = np.cos(a), np.sin(a)
        # ∫ (b + l cos a + n sin a)² + y², with n, y across the rod
        value = total * b**2 + 2 * b * first * c + second * c**2 + thick * s**2 + thick
        rate = -2 * b * first * s - 2 * second * c * s + 2 * thick * s * c
        return own + 2 * value, 2 * rate

    H = shaft_inertia(np.pi / 6)[0] * 2 * np.pi

    def rates(_: float, y: np.ndarray) -> list[float]:
        a, s, a_dot, s_dot = y
        inertia, slope = shaft_inertia(a)
        dx, dz = 0.5 * np.cos(a), 1 - 0.5 * np.sin(a) - s
        length = np.hypot(dx, dz)
        l_a = (-dx * 0.5 * np.sin(a) - dz * 0.5 * np.cos(a)) / length
        l_s = -dz / length
        tension = k * (length - 0.5) + d * (l_a * a_dot + l_s * s_dot)
        along_a = H**2 / (2 * inertia**2) * slope + 2 * first * G * np.cos(a) - 2 * tension * l_a
        return [a_dot, s_dot, along_a / (2 * I_r), -G - 2 * tension * l_s / m_s]

    start = [np.pi / 6, 0.5, 0.0, 0.0]
    return solve_ivp(rates, (t[0], t[-1]), start, "Radau", t, rtol=1e-10, atol=1e-12).y[1]
