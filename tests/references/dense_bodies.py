"""Reduction of small bodies by dense algebra, from K, M and D over the dofs of the mesh, by the formulas of textbooks.

Coordinates x: dofs of the mesh that no rigid interface carries, then six of the reference point of each rigid
interface; u = T x. Boundary motions are b = B x: the reference points of rigid interfaces, the mean motions of
distributing ones, the members' own dofs of those of kind "nodes". With K_x = TᵀKT, M_x = TᵀMT and rigid motions R:

- constraint modes: K_x Psi + Bᵀ L = 0, B Psi = 1
- fixed-interface modes: of the pencil on the null space of B
- free modes: of the pencil, rigid motions left out
- attachment modes with inertia relief: K_x X = P Bᵀ, P = 1 - M_x R (RᵀM_xR)⁻¹ Rᵀ, RᵀM_xX = 0
"""

from dataclasses import dataclass

import numpy as np
import scipy.linalg as la

__all__ = ["DenseBody", "angle", "frequencies", "mean_motion", "rigid_fields"]


def rigid_fields(nodes, dofs, origin, axes):
    """Return the six rigid motions about a point along some axes, over (node, component) dofs, (n_dof, 6)."""
    fields = np.zeros((len(dofs), 6))
    for row, (node, component) in enumerate(dofs):
        for k in range(3):
            if component < 3:
                fields[row, k] = axes[component, k]
                fields[row, 3 + k] = np.cross(axes[:, k], nodes[node] - origin)[component]
            else:
                fields[row, 3 + k] = axes[component - 3, k]
    return fields


def mean_motion(points, reference):
    """Return the rigid motion of a reference point that fits translations of points best, (6, 3 n)."""
    size = np.abs(points - reference).max(initial=0.0) or 1.0
    G = np.vstack([np.hstack([np.eye(3), -cross_matrix(point - reference) / size]) for point in points])
    return np.linalg.pinv(G, rcond=1e-10) / np.r_[1, 1, 1, size, size, size][:, None]


def cross_matrix(a):
    """Return the matrix of a × b."""
    return np.array([[0, -a[2], a[1]], [a[2], 0, -a[0]], [-a[1], a[0], 0]])


def frequencies(K, M, n_rigid=0):
    """Return angular frequencies of a pencil with finite mass, ascending, rigid motions left out; and its modes.

    Of (M, K + s M), which holds where M is singular; s is the first frequency beyond the rigid motions, squared.
    """
    shift = 1e-6 * np.trace(K) / np.trace(M)
    for _ in range(2):
        mu, X, shift = flexibilities(K, M, shift)
        massive = mu > 1e-14 * mu[-1]
        order = np.argsort(-mu[massive], kind="stable")[n_rigid:]
        mu, X = mu[massive][order], X[:, massive][:, order]
        shift, used = abs(1 / mu[0] - shift), shift
    return np.sqrt(np.abs(1 / mu - used)), X


def flexibilities(K, M, shift):
    """Return eigenvalues 1 / (omega² + s) of (M, K + s M), ascending, modes, and s, the shift or more if K needs it."""
    while True:
        scale = 1 / np.sqrt(np.diag(K) + shift * np.diag(M))
        mass, both = (scale[:, None] * (A + A.T) / 2 * scale for A in (M, K + shift * M))
        try:
            mu, X = la.eigh(mass, both)
        except la.LinAlgError:  # positive definite but for rounding
            shift *= 30
        else:
            return mu, scale[:, None] * X, shift


def angle(A, B, weight):
    """Return the sine of the largest angle by which unit columns of A leave the span of B, in the norm of a matrix."""
    rest = A - B @ np.linalg.solve(B.T @ weight @ B, B.T @ weight @ A)
    return float(np.sqrt(np.abs(np.einsum("ik,ij,jk->k", rest, weight, rest)).max(initial=0.0)))


@dataclass
class DenseBody:
    """Dense matrices over the dofs of a mesh, and its interfaces, not coupled."""

    K: np.ndarray
    M: np.ndarray
    nodes: np.ndarray
    dofs: np.ndarray
    interfaces: tuple

    def __post_init__(self):
        at = {(int(node), int(component)): row for row, (node, component) in enumerate(self.dofs)}
        n, rigid = len(self.dofs), [each for each in self.interfaces if each.kind == "rigid"]
        carried = {row for each in rigid for node in each.nodes for row in rows_of(at, node)}
        own = [row for row in range(n) if row not in carried]
        self.T = np.zeros((n, len(own) + 6 * len(rigid)))
        self.T[own, np.arange(len(own))] = 1.0
        first = {each.name: len(own) + 6 * k for k, each in enumerate(rigid)}
        for each in rigid:
            members = [row for node in each.nodes for row in rows_of(at, node)]
            fields = rigid_fields(self.nodes, self.dofs[members], each.reference, np.eye(3))
            self.T[members, first[each.name] : first[each.name] + 6] = fields
        self.boundary, self.mean = {}, {}
        for each in self.interfaces:
            moved = [at[int(node), c] for node in each.nodes for c in range(3)]
            if each.kind == "rigid":
                rows = np.zeros((6, self.T.shape[1]))
                rows[:, first[each.name] : first[each.name] + 6] = np.eye(6)
            elif each.kind == "distributing":
                rows = mean_motion(self.nodes[each.nodes], each.reference) @ self.T[moved]
            else:
                rows = self.T[[row for node in each.nodes for row in rows_of(at, node)]]
            self.boundary[each.name] = rows
            if (len(each.nodes) == 1 or each.kind == "rigid") and (int(each.nodes[0]), 3) in at:
                own_rows = [at[int(each.nodes[0]), c] for c in range(6)]
                arm = np.eye(6)
                arm[:3, 3:] = -cross_matrix(each.reference - self.nodes[each.nodes[0]])
                self.mean[each.name] = arm @ np.eye(n)[own_rows]
            elif len(each.nodes) > 2:
                self.mean[each.name] = mean_motion(self.nodes[each.nodes], each.reference) @ np.eye(n)[moved]
        self.B = np.vstack(list(self.boundary.values()))
        self.K_x, self.M_x = self.T.T @ self.K @ self.T, self.T.T @ self.M @ self.T
        self.R = np.linalg.lstsq(self.T, rigid_fields(self.nodes, self.dofs, self.center(), np.eye(3)), rcond=None)[0]

    def center(self):
        """Return the middle of the nodes, where numbers are small."""
        return self.nodes[np.unique(self.dofs[:, 0])].mean(axis=0)

    def constraint_modes(self):
        """Return constraint modes, (n_x, n_b)."""
        n_b, size = len(self.B), np.abs(self.K_x).max()
        matrix = np.block([[self.K_x / size, self.B.T], [self.B, np.zeros((n_b, n_b))]])
        scale = 1 / np.sqrt(np.abs(matrix).max(axis=0))
        rest = np.vstack([np.zeros((len(self.K_x), n_b)), np.eye(n_b)])
        x = scale[:, None] * np.linalg.solve(scale[:, None] * matrix * scale, scale[:, None] * rest)
        return x[: len(self.K_x)]

    def fixed_modes(self):
        """Return angular frequencies and modes with the boundary held, rigid motions that it leaves free left out."""
        N = la.null_space(self.B / np.linalg.norm(self.B, axis=1)[:, None])
        moved = self.B @ (self.R / np.linalg.norm(self.R, axis=0))  # by a pin a body can still turn
        n_rigid = 6 - np.linalg.matrix_rank(moved, tol=1e-9 * np.abs(moved).max())
        omega, X = frequencies(N.T @ self.K_x @ N, N.T @ self.M_x @ N, n_rigid)
        return omega, N @ X

    def free_modes(self):
        """Return angular frequencies and modes of the free body, rigid motions left out."""
        return frequencies(self.K_x, self.M_x, 6)

    def attachment_modes(self):
        """Return attachment modes of the boundary with inertia relief, (n_x, n_b)."""
        MR = self.M_x @ self.R
        F = self.B.T - MR @ np.linalg.solve(self.R.T @ MR, self.R.T @ self.B.T)
        scale = np.abs(self.K_x).max() / np.abs(MR).max()
        matrix = np.block([[self.K_x, scale * MR], [scale * MR.T, np.zeros((6, 6))]])
        weight = 1 / np.sqrt(np.abs(matrix).max(axis=0))
        rest = np.vstack([F, np.zeros((6, F.shape[1]))])
        x = weight[:, None] * np.linalg.solve(weight[:, None] * matrix * weight, weight[:, None] * rest)
        return x[: len(F)]

    def span(self, name, n):
        """Return fields over the mesh that, with the rigid motions, span a mode set; None if it has no formula here."""
        if name == "guyan":
            return self.T @ self.constraint_modes()
        if name == "craig-bampton":
            return self.T @ np.hstack([self.constraint_modes(), self.fixed_modes()[1][:, :n]])
        if name == "normal":
            return self.T @ self.free_modes()[1][:, :n]
        if name in ("rubin", "craig-chang", "dual-craig-bampton", "macneal"):
            return self.T @ np.hstack([self.attachment_modes(), self.free_modes()[1][:, :n]])
        return None


def rows_of(at, node):
    """Return the dofs of a node."""
    return [at[int(node), c] for c in range(6) if (int(node), c) in at]
