"""A geometrically exact planar beam (Reissner): axial, shear and bending strain at any displacement and rotation.

Strains at a point with rotation theta, t = (cos theta, sin theta), n = (-sin theta, cos theta), r' = dr/ds:

    eps = r'·t - 1,   gamma = r'·n,   kappa = theta' - theta_0',    energy 1/2 ∫ EA eps² + GA gamma² + EI kappa²

Three-node elements, quadratic in x, y, theta, two Gauss points (no locking); mass constant, with rotary inertia.
The undeformed beam may be curved or turned: strains are measured against it.
"""

from dataclasses import dataclass

import numpy as np
import scipy.sparse as sp

GAUSS = np.array([-1.0, 1.0]) / np.sqrt(3)
GAUSS_M, WEIGHTS_M = np.polynomial.legendre.leggauss(3)


def shapes(xi):
    """Quadratic shape functions at nodes -1, 0, 1 and their derivatives, (n_points, 3) each."""
    xi = np.asarray(xi)
    N = np.stack([xi * (xi - 1) / 2, 1 - xi**2, xi * (xi + 1) / 2], axis=-1)
    return N, np.stack([xi - 0.5, -2 * xi, xi + 0.5], axis=-1)


@dataclass
class ExactBeam:
    """A straight beam of n elements from `start` to `end`; dof 3 i + (0, 1, 2) = x, y, theta of node i."""

    start: tuple[float, float]
    end: tuple[float, float]
    n: int
    EA: float
    GA: float
    EI: float
    rho_A: float  # noqa: N815
    rho_I: float  # noqa: N815

    def __post_init__(self):
        a, b = np.asarray(self.start, float), np.asarray(self.end, float)
        self.length = float(np.linalg.norm(b - a))
        n_nodes = 2 * self.n + 1
        s = np.linspace(0, 1, n_nodes)[:, None]
        self.angle = float(np.arctan2(*(b - a)[::-1]))
        self.x0 = np.column_stack([(1 - s) * a + s * b, np.full(n_nodes, self.angle)]).ravel()
        nodes = 2 * np.arange(self.n)[:, None] + np.arange(3)
        self.dofs = (3 * nodes[:, :, None] + np.arange(3)).reshape(self.n, 9)
        self.h = self.length / self.n
        self.n_dof = 3 * n_nodes

    def node(self, k):
        """Dofs of a node; -1 is the last."""
        k = k % (2 * self.n + 1)
        return np.arange(3 * k, 3 * k + 3)

    def force(self, x):
        """Internal force and its derivative."""
        q = x[self.dofs].reshape(self.n, 3, 3)
        f, K = np.zeros((self.n, 9)), np.zeros((self.n, 9, 9))
        N, dN = shapes(GAUSS)
        dN = dN * 2 / self.h
        for g in range(2):
            slope = np.einsum("a,eac->ec", dN[g], q)
            theta = np.einsum("a,ea->e", N[g], q[:, :, 2])
            c, s = np.cos(theta), np.sin(theta)
            x_s, y_s = slope[:, 0], slope[:, 1]
            eps, gamma = x_s * c + y_s * s - 1, -x_s * s + y_s * c
            Fn, Fs, Mb = self.EA * eps, self.GA * gamma, self.EI * slope[:, 2]
            # derivatives by (x', y', theta): gamma = d eps/d theta, -(1 + eps) = d gamma/d theta
            B_eps, B_gamma = np.stack([c, s, gamma], 1), np.stack([-s, c, -(1 + eps)], 1)
            weight = self.h / 2
            # columns of (x', y', theta) and theta' by the nodal values
            L = np.zeros((3, 9))
            L[0, 0::3], L[1, 1::3], L[2, 2::3] = dN[g], dN[g], N[g]
            k = np.zeros(9)
            k[2::3] = dN[g]
            stress = Fn[:, None] * B_eps + Fs[:, None] * B_gamma
            f += weight * (stress @ L + Mb[:, None] * k)
            D = self.EA * np.einsum("ea,eb->eab", B_eps, B_eps) + self.GA * np.einsum("ea,eb->eab", B_gamma, B_gamma)
            # geometric part: second derivatives of eps and gamma
            H_eps, H_gamma = np.zeros((self.n, 3, 3)), np.zeros((self.n, 3, 3))
            H_eps[:, 2], H_gamma[:, 2] = np.stack([-s, c, -(1 + eps)], 1), np.stack([-c, -s, -gamma], 1)
            H_eps[:, :2, 2], H_gamma[:, :2, 2] = np.stack([-s, c], 1), np.stack([-c, -s], 1)
            D += Fn[:, None, None] * H_eps + Fs[:, None, None] * H_gamma
            K += weight * (np.einsum("ia,eij,jb->eab", L, D, L) + self.EI * np.outer(k, k))
        return self._assembled(f, K)

    def mass(self):
        """Consistent mass."""
        N, _ = shapes(GAUSS_M)
        m = np.einsum("g,ga,gb->ab", WEIGHTS_M, N, N) * self.h / 2
        block = np.zeros((9, 9))
        for c, density in enumerate((self.rho_A, self.rho_A, self.rho_I)):
            block[c::3, c::3] = density * m
        return self._assembled(np.zeros((self.n, 9)), np.broadcast_to(block, (self.n, 9, 9)))[1]

    def energy(self, x, v):
        """Strain and kinetic energy."""
        q = x[self.dofs].reshape(self.n, 3, 3)
        N, dN = shapes(GAUSS)
        dN = dN * 2 / self.h
        strain = 0.0
        for g in range(2):
            slope = np.einsum("a,eac->ec", dN[g], q)
            theta = np.einsum("a,ea->e", N[g], q[:, :, 2])
            c, s = np.cos(theta), np.sin(theta)
            eps, gamma = slope[:, 0] * c + slope[:, 1] * s - 1, -slope[:, 0] * s + slope[:, 1] * c
            density = self.EA * eps**2 + self.GA * gamma**2 + self.EI * slope[:, 2] ** 2
            strain += self.h / 4 * density.sum()
        return strain, 0.5 * v @ (self.mass() @ v)

    def _assembled(self, f, K):
        total = np.zeros(self.n_dof)
        np.add.at(total, self.dofs, f)
        rows = np.repeat(self.dofs, 9, axis=1).ravel()
        columns = np.tile(self.dofs, (1, 9)).ravel()
        return total, sp.csc_array(sp.coo_array((K.ravel(), (rows, columns)), shape=(self.n_dof,) * 2))
