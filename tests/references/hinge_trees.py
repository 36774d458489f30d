"""Trees of hinged rigid bodies as mass points, with loops closed at the level of accelerations: independent motions.

A rigid body moves as six equal point masses at +- a_i along its principal axes, a_i² = 3 ∫x_i² dm / m (each pair bears
a third of the mass). With J_p the columns u_j x (p - o_j) of the hinges j between a point p and the ground, c_p its
acceleration for q'' = 0, and G, g likewise of what closes loops,

    M = sum m J_pᵀ J_p,   M q'' + Gᵀ lam = sum J_pᵀ (f_p - m c_p),   G q'' = -c_g

is solved by least squares, so that constraints may repeat others, and integrated by DOP853 to 1e-13.
"""

from dataclasses import dataclass, field

import numpy as np
from scipy.integrate import solve_ivp


@dataclass
class Link:
    """A body on a hinge: places and directions in ground axes, all angles zero."""

    parent: int  #: -1: the ground
    hinge: np.ndarray  #: a point of the axis, (3,)
    axis: np.ndarray  #: (3,)
    mass: float
    center: np.ndarray  #: (3,)
    axes: np.ndarray  #: principal axes, columns, (3, 3)
    inertia: np.ndarray  #: principal moments about the centre, (3,)
    points: np.ndarray = field(init=False)  #: of mass / 6 each, (6, 3)

    def __post_init__(self) -> None:
        square = (self.inertia.sum() / 2 - self.inertia) / self.mass  # ∫x_i² dm / m
        arms = self.axes * np.sqrt(np.maximum(3 * square, 0.0))
        self.points = self.center + np.vstack([arms.T, -arms.T])


@dataclass
class Tree:
    """Links, and pairs of places that coincide: ((link, point), (link or -1, point)), as placed."""

    links: list[Link]
    closed: list[tuple[tuple[int, np.ndarray], tuple[int, np.ndarray]]]
    gravity: np.ndarray

    def poses(self, q: np.ndarray) -> list[tuple[np.ndarray, np.ndarray]]:
        """R and r of each link: a place p of it, as placed, lies at R p + r."""
        done: list[tuple[np.ndarray, np.ndarray]] = []
        for link, angle in zip(self.links, q, strict=True):
            R, r = (np.eye(3), np.zeros(3)) if link.parent < 0 else done[link.parent]
            turn = rotation(link.axis, angle)
            done.append((R @ turn, R @ (link.hinge - turn @ link.hinge) + r))
        return done

    def place(self, poses, link: int, point: np.ndarray) -> np.ndarray:
        """Where a place is."""
        return point if link < 0 else poses[link][0] @ point + poses[link][1]

    def motion(self, poses, u: np.ndarray, link: int, p: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Columns J of points at p, (n_p, 3, n), and their accelerations for q'' = 0, (n_p, 3)."""
        J, path = np.zeros((len(p), 3, len(self.links))), []
        while link >= 0:
            path.append(link)
            link = self.links[link].parent
        omega, alpha, a, at = (np.zeros(3) for _ in range(4))
        for j in reversed(path):
            parent = self.links[j].parent
            R = np.eye(3) if parent < 0 else poses[parent][0]
            o, axis = self.place(poses, parent, self.links[j].hinge), R @ self.links[j].axis
            arm = o - at
            a = a + cross(alpha, arm) + cross(omega, cross(omega, arm))
            alpha, omega, at = alpha + cross(omega, axis) * u[j], omega + axis * u[j], o
            J[:, :, j] = cross(axis, p - o)
        arm = p - at
        return J, a + cross(alpha, arm) + cross(omega, cross(omega, arm))

    def accelerations(self, q: np.ndarray, u: np.ndarray) -> np.ndarray:
        """q'', (n,)."""
        n, poses = len(q), self.poses(q)
        M, f = np.zeros((n, n)), np.zeros(n)
        for k, link in enumerate(self.links):
            R, r = poses[k]
            J, c = self.motion(poses, u, k, link.points @ R.T + r)
            M += link.mass / 6 * np.einsum("pia,pib->ab", J, J)
            f += link.mass / 6 * np.einsum("pia,pi->a", J, self.gravity - c)
        rows, right = [], []
        for (a, p), (b, s) in self.closed:
            J_a, c_a = self.motion(poses, u, a, self.place(poses, a, p)[None])
            J_b, c_b = self.motion(poses, u, b, self.place(poses, b, s)[None])
            rows.append(J_a[0] - J_b[0])
            right.append(c_b[0] - c_a[0])
        G, g = np.vstack(rows), np.concatenate(right)
        # q'' = M⁻¹ (f - Gᵀ lam): the least change of M⁻¹ f, in the norm of M, that closes the loops
        L = np.linalg.cholesky(M)
        free = np.linalg.solve(L, f)
        H = np.linalg.solve(L, G.T).T
        return np.linalg.solve(L.T, free + np.linalg.lstsq(H, g - H @ free, rcond=1e-6)[0])

    def integrate(self, t: np.ndarray, q: np.ndarray, u: np.ndarray, *, rtol: float = 1e-13) -> np.ndarray:
        """Angles at the times t, (n_t, n), from q and u on."""
        n = len(q)
        found = solve_ivp(
            lambda _, y: np.concatenate([y[n:], self.accelerations(y[:n], y[n:])]),
            (t[0], t[-1]),
            np.concatenate([q, u]),
            method="DOP853",
            t_eval=t,
            rtol=rtol,
            atol=1e-13,
        )
        assert found.success, found.message
        return found.y[:n].T


def cross(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """a x b for vectors (3,) and one or many b, (..., 3)."""
    x, y, z = a
    b = b.T
    return np.array([y * b[2] - z * b[1], z * b[0] - x * b[2], x * b[1] - y * b[0]]).T


def rotation(axis: np.ndarray, angle: float) -> np.ndarray:
    """Rodrigues' formula, (3, 3)."""
    x, y, z = axis / np.linalg.norm(axis)
    K = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
    return np.eye(3) + np.sin(angle) * K + (1 - np.cos(angle)) * K @ K
