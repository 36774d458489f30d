"""A gradient-deficient planar ANCF beam (Euler-Bernoulli): cubic in position, exact axial strain and curvature.

Element with nodal (r, r_s), Hermite shapes; at a point with r_s = dr/ds, r_ss:

    eps = (r_s·r_s - 1)/2,  kappa = (r_s × r_ss)/|r_s|²,   energy 1/2 ∫ EA eps² + EI kappa²

kappa is the rate of the angle of the tangent per undeformed length (|r_s|² in the denominator). No shear, no rotary
inertia. Derivatives of the energy are formed by hand; the mass is constant.
"""

from dataclasses import dataclass

import numpy as np
import scipy.sparse as sp

POINTS, WEIGHTS = np.polynomial.legendre.leggauss(5)


def hermite(xi, h):
    """Shapes of (r_1, r_1', r_2, r_2') at xi in -1..1, and first and second derivatives by s, (n, 4) each."""
    u = (np.asarray(xi) + 1) / 2
    N = np.stack([1 - 3 * u**2 + 2 * u**3, h * (u - 2 * u**2 + u**3), 3 * u**2 - 2 * u**3, h * (u**3 - u**2)], -1)
    D = np.stack([-6 * u + 6 * u**2, h * (1 - 4 * u + 3 * u**2), 6 * u - 6 * u**2, h * (3 * u**2 - 2 * u)], -1) / h
    E = np.stack([-6 + 12 * u, h * (-4 + 6 * u), 6 - 12 * u, h * (6 * u - 2)], -1) / h**2
    return N, D, E


@dataclass
class AncfBeam:
    """A straight beam of n elements; dof 4 i + (0, 1, 2, 3) = x, y, x_s, y_s of node i."""

    start: tuple[float, float]
    end: tuple[float, float]
    n: int
    EA: float
    EI: float
    rho_A: float  # noqa: N815

    def __post_init__(self):
        a, b = np.asarray(self.start, float), np.asarray(self.end, float)
        self.length = float(np.linalg.norm(b - a))
        t = (b - a) / self.length
        s = np.linspace(0, 1, self.n + 1)[:, None]
        self.x0 = np.column_stack([(1 - s) * a + s * b, np.tile(t, (self.n + 1, 1))]).ravel()
        self.dofs = 4 * np.arange(self.n)[:, None] + np.arange(8)
        self.h = self.length / self.n
        self.n_dof = 4 * (self.n + 1)

    def node(self, k):
        """Dofs of a node; -1 is the last."""
        k = k % (self.n + 1)
        return np.arange(4 * k, 4 * k + 4)

    def force(self, x):
        """Internal force and its derivative."""
        q = x[self.dofs].reshape(self.n, 4, 2)
        f, K = np.zeros((self.n, 8)), np.zeros((self.n, 8, 8))
        _, D, E = hermite(POINTS, self.h)
        J = np.array([[0.0, 1.0], [-1.0, 0.0]])  # a × b = aᵀ J b
        for g, weight in enumerate(WEIGHTS * self.h / 2):
            a = np.einsum("k,ekc->ec", D[g], q)  # r_s
            b = np.einsum("k,ekc->ec", E[g], q)  # r_ss
            A = np.kron(D[g], np.eye(2))  # a = A q, (2, 8)
            B = np.kron(E[g], np.eye(2))
            w = (a**2).sum(1)
            eps = (w - 1) / 2
            cross = np.einsum("ei,ij,ej->e", a, J, b)
            kappa = cross / w
            d_eps = a @ A
            # kappa = cross / w
            d_cross = (b @ J.T) @ A + (a @ J) @ B
            d_w = 2 * d_eps
            d_kappa = d_cross / w[:, None] - (cross / w**2)[:, None] * d_w
            f += weight * (self.EA * eps[:, None] * d_eps + self.EI * kappa[:, None] * d_kappa)
            dd_eps = A.T @ A
            dd_cross = A.T @ J @ B + B.T @ J.T @ A
            w3 = w[:, None, None]
            mixed = np.einsum("ei,ej->eij", d_cross, d_w)
            dd_kappa = (
                dd_cross / w3
                - (mixed + mixed.transpose(0, 2, 1)) / w3**2
                - (cross / w**2)[:, None, None] * 2 * dd_eps
                + 2 * (cross / w**3)[:, None, None] * np.einsum("ei,ej->eij", d_w, d_w)
            )
            K += weight * (
                self.EA * (np.einsum("ei,ej->eij", d_eps, d_eps) + eps[:, None, None] * dd_eps)
                + self.EI * (np.einsum("ei,ej->eij", d_kappa, d_kappa) + kappa[:, None, None] * dd_kappa)
            )
        return self._assembled(f, K)

    def mass(self):
        """Consistent mass."""
        N, _, _ = hermite(POINTS, self.h)
        m = self.rho_A * np.einsum("g,ga,gb->ab", WEIGHTS, N, N) * self.h / 2
        return self._assembled(np.zeros((self.n, 8)), np.broadcast_to(np.kron(m, np.eye(2)), (self.n, 8, 8)))[1]

    def _assembled(self, f, K):
        total = np.zeros(self.n_dof)
        np.add.at(total, self.dofs, f)
        rows = np.repeat(self.dofs, 8, axis=1).ravel()
        columns = np.tile(self.dofs, (1, 8)).ravel()
        return total, sp.csc_array(sp.coo_array((K.ravel(), (rows, columns)), shape=(self.n_dof,) * 2))
