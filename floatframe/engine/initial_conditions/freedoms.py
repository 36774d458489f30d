"""Mobility: the number of independent motions of a system, and its redundant constraints.

The rows of the constraint Jacobian are multiplied by the inverse Cholesky factors of the masses, so that all have the
same unit, and scaled to norm one. They are then taken joint by joint: a row that is a combination of earlier rows is
redundant (Gram-Schmidt, twice for accuracy).
"""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
import scipy.linalg as la

from fe_models.foundation.arrays import Array
from fe_models.foundation.presentation import presented
from floatframe.engine.compiling.system import CompiledSystem
from floatframe.engine.initial_conditions.newton_equations import linearized, set_iterate, with_mass_for_all
from floatframe.engine.kernels.model import Model
from floatframe.engine.kernels.work import Work
from floatframe.model.joints.rows import is_held
from floatframe.model.state import State

__all__ = ["Mobility", "constraint_mobility", "scaled_constraints"]

DEPENDENT = 1e-7  #: norm of a unit row after projection out of earlier rows, below which it is redundant


@presented
@dataclass(frozen=True)
class Mobility:
    """Numbers of freedoms and constraints of a system at one state."""

    n_bodies: int
    n_modes: int
    n_constraints: int  #: number of constraints of joints
    n_redundant: int  #: number of redundant constraints if bodies deform in their modes
    n_redundant_rigid: int  #: number of redundant constraints if all bodies were rigid
    redundant: Mapping[str, int]  #: number of constraints, by joint, that depend on those of earlier joints
    redundant_rigid: Mapping[str, int]  #: the same if all bodies were rigid

    @property
    def gruebler(self) -> int:
        """Mobility by Gruebler's count: six for each body minus the number of constraints."""
        return 6 * self.n_bodies - self.n_constraints

    @property
    def mobility(self) -> int:
        """Number of independent rigid motions: six for each body minus the rank of the constraints."""
        return self.gruebler + self.n_redundant_rigid

    @property
    def n_freedoms(self) -> int:
        """Number of independent motions including the modes of the bodies."""
        return self.gruebler + self.n_modes + self.n_redundant


def constraint_mobility(compiled: CompiledSystem, work: Work, state: State) -> Mobility:
    """Return the mobility at a state with closed joints."""
    model = compiled.model
    holds = is_held(model.rows.kind)
    owner = np.repeat(np.arange(len(model.connections.size)), model.connections.size)[holds]
    with_modes, rigid = scaled_constraints(model, work, state)
    repeated, repeated_rigid = dependent_rows(with_modes), dependent_rows(rigid)
    names = compiled.connection_names

    def by_joint(rows: Array) -> dict[str, int]:
        return {name: int(rows[owner == c].sum()) for c, name in enumerate(names) if rows[owner == c].any()}

    return Mobility(
        n_bodies=len(model.bodies.kind),
        n_modes=int(model.bodies.q0[-1]),
        n_constraints=int(holds.sum()),
        n_redundant=int(repeated.sum()),
        n_redundant_rigid=int(repeated_rigid.sum()),
        redundant=by_joint(repeated),
        redundant_rigid=by_joint(repeated_rigid),
    )


def scaled_constraints(model: Model, work: Work, state: State) -> tuple[Array, Array]:
    """Return G L⁻ᵀ with M = L Lᵀ and rows of unit length, dense: once with the modes, once for rigid bodies."""
    set_iterate(work, state)
    parts = linearized(model, work, 1.0, 0.0, 0.0)
    G = parts.G.toarray()[is_held(model.rows.kind)]
    scaled, rigid = np.zeros_like(G), np.zeros((len(G), 6 * len(model.bodies.kind)))
    for i, H in enumerate(with_mass_for_all(model, parts.H)):
        u = slice(int(model.bodies.u0[i]), int(model.bodies.u0[i + 1]))
        L = np.linalg.cholesky(0.5 * (H + H.T))
        scaled[:, u] = la.solve_triangular(L, G[:, u].T, lower=True).T
        rigid[:, 6 * i : 6 * i + 6] = la.solve_triangular(L[:6, :6], G[:, u][:, :6].T, lower=True).T
    return unit_rows(scaled), unit_rows(rigid)


def unit_rows(A: Array) -> Array:
    """Return the rows divided by their lengths; zero rows are unchanged."""
    length = np.linalg.norm(A, axis=1, keepdims=True)
    return np.asarray(A / np.where(length > 0, length, 1.0))


def dependent_rows(A: Array) -> Array:
    """Return, for each row, whether it is a combination of earlier rows, (n_rows,) bool."""
    basis = np.zeros((0, A.shape[1]))
    result = np.zeros(len(A), dtype=bool)
    for k, row in enumerate(A):
        left = row - basis.T @ (basis @ row)
        left = left - basis.T @ (basis @ left)
        size = np.linalg.norm(left)
        if size <= DEPENDENT:
            result[k] = True
        else:
            basis = np.vstack([basis, left / size])
    return result
