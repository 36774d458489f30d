"""Rigid slices: a body as a set of rigid pieces, each with mass, second moments and six motions.

A beam is a row of rigid cross-sections; a point mass is one slice. A slice at c with mass m, second moments E = ∫ o oᵀ
dm (o: offset from c) and motion u + theta × o contributes to the Gram matrix of a = [1, c, u_x, u_y, u_z]

    m a_0 a_0ᵀ + Σ_f E_f a_f a_fᵀ,   a_0 = [1, c, u],   a_f = [0, e_f, theta × e_f],

where E_f, e_f are principal values and axes of E. Its mass matrix is m |u|² + thetaᵀ J theta with J = tr(E) 1 - E. Both
follow from the same numbers, so Σ_a S_aa,kl = phi_kᵀ M phi_l to roundoff. If only an inertia J is given, E = tr(J)/2 1
- J. Its principal values may be negative, which the formulas allow.
"""

from dataclasses import dataclass

import numpy as np

from fe_models.foundation.arrays import Array, IntArray, frozen

__all__ = ["Slices", "second_moments"]

CHUNK = 2000  #: number of elements processed at a time


@dataclass(frozen=True, eq=False)
class Slices:
    """Rigid slices of n elements, with p slices per element that the d element dofs move."""

    position: Array  #: position of each slice, (n, p, 3) [m]
    mass: Array  #: mass of each slice, (n, p) [kg]
    axes: Array  #: principal axes of E as columns, mesh axes, (n, p, 3, 3)
    moments: Array  #: principal values of E, (n, p, 3) [kg m²]
    motion: Array  #: motion (u, theta) of the slices in mesh axes per unit dof, (n, p, 6, d)
    dofs: IntArray  #: dof numbers in the mesh, (n, d)

    def __post_init__(self) -> None:
        for name in ("position", "mass", "axes", "moments", "motion"):
            object.__setattr__(self, name, frozen(getattr(self, name)))
        object.__setattr__(self, "dofs", frozen(self.dofs, np.int64))

    def mass_matrices(self) -> Array:
        """Return the mass matrices of the elements, (n, d, d) [kg, kg m, kg m²]."""
        J = np.einsum("npaf,npf,npbf->npab", self.axes, self.moments.sum(axis=2)[..., None] - self.moments, self.axes)
        inertia = np.zeros((*self.mass.shape, 6, 6))
        inertia[..., :3, :3] = self.mass[..., None, None] * np.eye(3)
        inertia[..., 3:, 3:] = J
        n, p, _, d = self.motion.shape
        weighted = (inertia @ self.motion).reshape(n, 6 * p, d)
        M = self.motion.reshape(n, 6 * p, d).transpose(0, 2, 1) @ weighted
        return np.asarray((M + M.transpose(0, 2, 1)) / 2)

    def gram(self, u: Array) -> Array:
        """Return ∫ a aᵀ dm for the displacement columns u, (n_mesh_dof, k), as (4 + 3 k, 4 + 3 k)."""
        k = u.shape[1]
        gram = np.zeros((4 + 3 * k, 4 + 3 * k))
        for begin in range(0, len(self.dofs), CHUNK):
            part = slice(begin, begin + CHUNK)
            motion = self.motion[part]
            n, p, _, d = motion.shape
            field = (motion.reshape(n, 6 * p, d) @ u[self.dofs[part]]).reshape(n, p, 6, k)
            n_slices = n * p
            a_0 = np.ones((n_slices, 4 + 3 * k))
            a_0[:, 1:4] = self.position[part].reshape(-1, 3)
            a_0[:, 4:] = field[:, :, :3].reshape(n_slices, -1)
            gram += a_0.T @ (self.mass[part].reshape(-1, 1) * a_0)
            theta = field[:, :, 3:].transpose(0, 1, 3, 2)  # (n, p, k, 3)
            for f in range(3):
                axis = self.axes[part, :, :, f]
                a_f = np.zeros((n_slices, 4 + 3 * k))
                a_f[:, 1:4] = axis.reshape(-1, 3)
                a_f[:, 4:] = np.cross(theta, axis[:, :, None]).transpose(0, 1, 3, 2).reshape(n_slices, -1)
                gram += a_f.T @ (self.moments[part, :, f].reshape(-1, 1) * a_f)
        return gram


def second_moments(J: Array) -> tuple[Array, Array]:
    """Return principal values, (3,), and axes, (3, 3), of E = tr(J)/2 1 - J, given an inertia tensor J [kg m²]."""
    J = np.asarray(J, dtype=float)
    return np.linalg.eigh(np.trace(J) / 2 * np.eye(3) - J)
