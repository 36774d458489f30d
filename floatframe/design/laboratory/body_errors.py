"""How far the deformation of a reduced body is from that of the full model, over the whole body and over time.

Of both the rigid part is taken off, u - N Nᵀ M u (mean axes), so that body frames and small motions of the whole do not
count. With e(t) the difference,

    epsilon_M(t) = |e|_M / max |u_full|_M     displacement, each mass by its own
    epsilon_K(t) = |e|_K / max |u_full|_K     strain energy: what stresses see

a norm |x|_A² = xᵀ A x, the greatest taken over the whole motion of the full model.
"""

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np
import scipy.linalg as la
import scipy.sparse as sp

from cms.modes.families.rigid_modes import geometric_rigid_modes
from fe_models.body.fe_body import FEBody
from fe_models.foundation.arrays import Array
from floatframe.errors import ModelError

__all__ = ["BodyErrors", "BodyReference"]


@dataclass(frozen=True, eq=False)
class BodyErrors:
    """Errors over time; largest ones as shares of the greatest value of the full model."""

    t: Array  #: (n_t,) [s]
    mass: Array  #: epsilon_M, (n_t,)
    energy: Array  #: epsilon_K, (n_t,)

    @property
    def largest(self) -> tuple[float, float]:
        """The greatest epsilon_M and epsilon_K."""
        return float(self.mass.max()), float(self.energy.max())


@dataclass(frozen=True, eq=False)
class BodyReference:
    """Deformation of the full model.

    Raises
    ------
    ModelError
        If the displacements do not fit the body and the times, or are rigid throughout.
    """

    body: FEBody
    t: Array  #: (n_t,) [s]
    u: Array  #: displacement over the dofs, mesh axes, (n_dof, n_t)
    elastic: Array = field(init=False)  #: the same in mean axes, (n_dof, n_t)
    greatest: tuple[float, float] = field(init=False)  #: max |u|_M [kg^1/2 m], max |u|_K [J^1/2]

    def __post_init__(self) -> None:
        if np.shape(self.u) != (self.body.n_dof, len(self.t)):
            raise ModelError(
                f"body reference: expected displacements ({self.body.n_dof}, {len(self.t)}) of body "
                f"{self.body.name!r}, got {np.shape(self.u)}"
            )
        elastic = without_rigid(self.body, np.asarray(self.u))
        greatest = tuple(float(norms(A, elastic).max()) for A in (self.body.M, self.body.K))
        if not min(greatest) > 0:
            raise ModelError(f"body reference: body {self.body.name!r} does not deform; nothing to compare with")
        object.__setattr__(self, "elastic", elastic)
        object.__setattr__(self, "greatest", greatest)

    def errors(self, Phi: Array, q: Array) -> BodyErrors:
        """Return the errors of shapes Phi, (n_dof, n_q), that move by q, (n_q, n_t)."""
        if Phi.shape[0] != self.body.n_dof or q.shape != (Phi.shape[1], len(self.t)):
            raise ModelError(
                f"body errors: expected shapes over {self.body.n_dof} dofs and coordinates at {len(self.t)} times, got "
                f"{Phi.shape} and {q.shape}"
            )
        e = without_rigid(self.body, Phi) @ q - self.elastic
        mass, energy = (norms(A, e) / size for A, size in zip((self.body.M, self.body.K), self.greatest, strict=True))
        return BodyErrors(self.t, mass, energy)

    def history_error(self, rows: sp.sparray | Array, Phi: Array, q: Array) -> float:
        """Return max over time of |rows e| over max |rows u|: of a few results, such as the stress at one place."""
        there = rows @ self.elastic
        error = (rows @ without_rigid(self.body, Phi)) @ q - there
        return float(la.norm(error, axis=0).max() / la.norm(there, axis=0).max())


def largest_difference(histories: Mapping[str, Array], full: Mapping[str, Array]) -> float:
    """Return the greatest difference of vectors over time, (n_t, n) each, over the greatest of the full model."""
    difference = max(float(la.norm(histories[name] - of, axis=1).max()) for name, of in full.items())
    return difference / max(float(la.norm(of, axis=1).max()) for of in full.values())


def without_rigid(body: FEBody, u: Array) -> Array:
    """Return columns in mean axes, u - N Nᵀ M u with M-orthonormal rigid motions N, (n_dof, k)."""
    Psi = geometric_rigid_modes(body)
    M_Psi = body.M @ Psi
    return np.asarray(u - Psi @ la.solve(Psi.T @ M_Psi, M_Psi.T @ u, assume_a="pos"))


def norms(A: sp.sparray, u: Array) -> Array:
    """Return sqrt(uᵀ A u) of each column, (k,)."""
    return np.sqrt(np.maximum(np.einsum("nk,nk->k", u, A @ u), 0.0))
