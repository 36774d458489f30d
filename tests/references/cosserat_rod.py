"""Rods in static equilibrium at any displacement, by shooting along their length: Cosserat's equations.

With n and m the force and moment in a section, ground axes, R its axes, c_n and c_m the flexibilities,

    r' = R (e_x + c_n Rᵀ n),   R' = R tilde(c_m Rᵀ m),   m' = n x r',   n' = 0 between loads

No elements, no interpolation: DOP853 to 1e-11.
"""

from dataclasses import dataclass

import numpy as np
from scipy.integrate import solve_ivp
from scipy.optimize import root

from fe_models.body.beam_line import BeamLine


@dataclass(frozen=True)
class Section:
    """Place, axes, force and moment of a section."""

    r: np.ndarray
    R: np.ndarray
    n: np.ndarray
    m: np.ndarray


def along(line: BeamLine, first: Section, *, rtol: float = 1e-11) -> Section:
    """The last section of a uniform rod from its first one."""
    c_n = 1 / np.array([line.EA, line.GAy, line.GAz])
    c_m = 1 / np.array([line.GJ, line.EIy, line.EIz])
    n = first.n

    def rates(_: float, y: np.ndarray) -> np.ndarray:
        R, m = y[3:12].reshape(3, 3), y[12:]
        tangent = R @ (c_n * (R.T @ n) + np.array([1.0, 0, 0]))
        x, y_, z = c_m * (R.T @ m)
        return np.concatenate([tangent, (R @ [[0, -z, y_], [z, 0, -x], [-y_, x, 0]]).ravel(), np.cross(n, tangent)])

    y0 = np.concatenate([first.r, first.R.ravel(), first.m])
    y = solve_ivp(rates, (0.0, line.length), y0, method="DOP853", rtol=rtol, atol=1e-13).y[:, -1]
    return Section(y[:3], y[3:12].reshape(3, 3), n, y[12:])


def cantilever(line: BeamLine, force: np.ndarray, guess: np.ndarray | None = None) -> tuple[Section, np.ndarray]:
    """End of a rod along x that is clamped at the origin, under a dead force there, and the moment at the clamp."""
    scale = np.linalg.norm(force) * line.length

    def left(m: np.ndarray) -> np.ndarray:
        return along(line, Section(np.zeros(3), np.eye(3), force, m * scale)).m / scale

    start = np.cross([line.length, 0, 0], force) / scale if guess is None else guess / scale
    found = root(left, start, tol=1e-11)
    assert np.abs(found.fun).max() < 1e-9, found.message
    return along(line, Section(np.zeros(3), np.eye(3), force, found.x * scale)), found.x * scale


def four_bar(lines, angle: float, defect: float, guess: np.ndarray) -> tuple[Section, np.ndarray, Section]:
    """Joint C of bar 2 of the misaligned four-bar, its crank turned by an angle about z, and the unknowns.

    Unknown: force and moment at A over their sizes, angles of B and C; known: no moment about B, C, D, the place of D
    and its axis.
    """
    z = np.array([0.0, 0.0, 1.0])
    tilted = np.array([np.sin(defect), 0.0, np.cos(defect)])

    def turned(axis: np.ndarray, x: float) -> np.ndarray:
        a, b, c = axis
        K = np.array([[0, -c, b], [c, 0, -a], [-b, a, 0]])
        return np.eye(3) + np.sin(x) * K + (1 - np.cos(x)) * K @ K

    def ends(x: np.ndarray) -> tuple[Section, Section, Section]:
        n, m = 1e3 * x[:3], 1e2 * x[3:6]
        up = np.array([[0.0, -1, 0], [1, 0, 0], [0, 0, 1]])
        one = along(lines[0], Section(np.zeros(3), turned(z, angle) @ up, n, m))
        # bars 1 and 3 lie across bar 2 as placed: axes of bar 2 are those of 1, turned back and by the angle of B
        two = along(lines[1], Section(one.r, one.R @ up.T @ turned(z, x[6]), n, one.m))
        down = np.array([[0.0, 1, 0], [-1, 0, 0], [0, 0, 1]])
        three = along(lines[2], Section(two.r, two.R @ turned(tilted, x[7]) @ down, n, two.m))
        return one, two, three

    def residual(x: np.ndarray) -> np.ndarray:
        one, two, three = ends(x)
        axis = three.R[:, 2]
        return np.concatenate(
            [
                [one.m @ one.R[:, 2] / 1e2, two.m @ (two.R @ tilted) / 1e2, three.m @ axis / 1e2],
                (three.r - [0.24, 0, 0]) / 0.1,
                axis[:2],
            ]
        )

    found = root(residual, guess, tol=1e-11)
    assert np.abs(found.fun).max() < 1e-8, found.message
    one, two, _ = ends(found.x)
    return two, found.x, one
