"""Rods in static equilibrium at any displacement, by shooting along their length: Cosserat's equations.

With n and m the force and moment in a section, ground axes, R its axes, c_n and c_m the flexibilities,

    r' = R (e_x + c_n Rᵀ n),   R' = R tilde(c_m Rᵀ m),   m' = n x r',   n' = 0 between loads

No elements, no interpolation: Runge and Kutta's method of order four in 60 steps, Newton's method over what is not
known at the first end, with the derivatives by steps along the imaginary axis.
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from fe_models.body.beam_line import BeamLine

STEPS = 60
Z = np.array([0.0, 0.0, 1.0])
E_X = np.array([1.0, 0.0, 0.0])


@dataclass(frozen=True)
class Section:
    """Place, axes, force and moment of a section."""

    r: np.ndarray
    R: np.ndarray
    n: np.ndarray
    m: np.ndarray


def skew(a: np.ndarray) -> np.ndarray:
    """Return the matrix of a x, (3, 3)."""
    x, y, z = a
    return np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])


def turned(axis: np.ndarray, angle: complex) -> np.ndarray:
    """Rodrigues' formula about a unit vector, (3, 3)."""
    K = skew(axis)
    return np.eye(3) + np.sin(angle) * K + (1 - np.cos(angle)) * K @ K


def along(line: BeamLine, first: Section, *, steps: int = STEPS) -> Section:
    """The last section of a uniform rod from its first one."""
    c_n = 1 / np.array([line.EA, line.GAy, line.GAz])
    c_m = 1 / np.array([line.GJ, line.EIy, line.EIz])
    h, N = line.length / steps, skew(first.n)

    def rates(y: np.ndarray) -> np.ndarray:
        R = y[3:12].reshape(3, 3)
        tangent = R @ (c_n * (R.T @ first.n) + E_X)
        return np.concatenate([tangent, (R @ skew(c_m * (R.T @ y[12:]))).ravel(), N @ tangent])

    y = np.concatenate([first.r, first.R.ravel(), first.m])
    for _ in range(steps):
        a = rates(y)
        b = rates(y + h / 2 * a)
        c = rates(y + h / 2 * b)
        y = y + h / 6 * (a + 2 * b + 2 * c + rates(y + h * c))
    return Section(y[:3], y[3:12].reshape(3, 3), first.n, y[12:])


def solved(residual: Callable[[np.ndarray], np.ndarray], x: np.ndarray, *, tolerance: float = 1e-10) -> np.ndarray:
    """Root of a residual of order one by Newton's method; an assertion fails if it is not found."""
    for _ in range(30):
        value = residual(x)
        if np.abs(value).max() < tolerance:
            return x
        J = np.column_stack([residual(x + 1e-30j * e).imag / 1e-30 for e in np.eye(len(x))])
        x = x - np.linalg.solve(J, value)
    raise AssertionError(f"residual {np.abs(residual(x)).max():.1e}")


def cantilever(line: BeamLine, force: np.ndarray, parts: int = 4) -> Section:
    """End of a rod along x that is clamped at the origin, under a dead force there, raised in so many parts."""
    scale, m = np.linalg.norm(force) * line.length, np.zeros(3)
    for k in range(1, parts + 1):
        here = force * k / parts

        def left(m: np.ndarray, here: np.ndarray = here) -> np.ndarray:
            return along(line, Section(np.zeros(3), np.eye(3), here, m * scale)).m / scale

        m = solved(left, m)
    return along(line, Section(np.zeros(3), np.eye(3), force, m * scale))


@dataclass(frozen=True)
class FourBar:
    """A position of the misaligned four-bar: what was unknown, and the place of C."""

    unknown: np.ndarray  #: force [N] / 1e4 and moment [N m] / 1e2 at A, angles of B and C [rad], (8,)
    C: np.ndarray  #: (3,) [m]

    @property
    def torque(self) -> float:
        """Of the drive about z [N m]."""
        return float(-1e2 * self.unknown[5])


def four_bar(lines, angle: float, guess: np.ndarray, *, defect: float = np.deg2rad(5.0), steps: int = 40) -> FourBar:
    """The misaligned four-bar with its crank turned by an angle about z.

    Known: no moment about B, C, D, the place of D and its axis.
    """
    tilted = np.array([np.sin(defect), 0.0, np.cos(defect)])
    up = np.array([[0.0, -1, 0], [1, 0, 0], [0, 0, 1]])

    def ends(x: np.ndarray) -> tuple[Section, Section, Section]:
        n, m = 1e4 * x[:3], 1e2 * x[3:6]
        one = along(lines[0], Section(np.zeros(3), turned(Z, angle) @ up, n, m), steps=steps)
        # bars 1 and 3 lie across bar 2 as placed
        two = along(lines[1], Section(one.r, one.R @ up.T @ turned(Z, x[6]), n, one.m), steps=steps)
        three = along(lines[2], Section(two.r, two.R @ turned(tilted, x[7]) @ up.T, n, two.m), steps=steps)
        return one, two, three

    def residual(x: np.ndarray) -> np.ndarray:
        one, two, three = ends(x)
        axis = three.R[:, 2]
        moments = one.m @ one.R[:, 2], two.m @ (two.R @ tilted), three.m @ axis
        return np.concatenate([np.array(moments) / 1e2, (three.r - [0.24, 0, 0]) / 0.1, axis[:2]])

    x = solved(residual, guess)
    return FourBar(x, ends(x)[1].r)
