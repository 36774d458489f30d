"""How many constraints repeat others, told from constraints that are poorly conditioned.

Joints of a tree never repeat each other: each brings a body of its own, and N, the motions of the bodies by the
coordinates of the tree, spans all that they allow. So the rank of all constraints G is

    rank G = rows of the tree + rank (G_c N),      G_c the rows of what closes loops,

where a chain of any length has no G_c at all, though the least singular value of G, scaled by the masses, falls with
the square of the number of its links. Rows of G_c N are scaled to length one, coordinates by the mass that they move.
Its small singular values belong to repeated constraints if there is a gap above them, or if they are rounding; those of
long trusses fall without a gap. Few constraints that are well conditioned as they are, which is the rule, are not
looked at so closely: N would want the kernels of relative coordinates, compiled at their first use.
"""

import numpy as np

from fe_models.foundation.arrays import Array
from floatframe.engine.compiling.system import CompiledSystem
from floatframe.engine.initial_conditions.freedoms import scaled_constraints
from floatframe.engine.initial_conditions.newton_equations import linearized, set_iterate, with_mass_for_all
from floatframe.engine.kernels.work import Work
from floatframe.engine.tree.kernels.tree import Tree
from floatframe.engine.tree.tree_motions import coordinate_motions
from floatframe.model.joints.rows import is_held
from floatframe.model.state import State

__all__ = ["repeated_constraints"]

FEW = 200  #: rows, up to which all are looked at first: that takes milliseconds
WELL = 1e-6  #: least eigenvalue of G M⁻¹ Gᵀ, rows scaled to length one, of constraints none of which repeats others
SMALL = 1e-5  #: singular value by the largest, below which constraints may repeat others
GAP = 1e-3  #: of the next larger one, if they do
ROUNDING = 1e-11  #: singular value by the largest, or row by what it holds of bodies alone, that is none


def repeated_constraints(compiled: CompiledSystem, work: Work, tree: Tree, state: State) -> int:
    """Return how many of the rows that joints and elements hold repeat others at a state; arrays are overwritten."""
    model = compiled.model
    closing = is_held(model.rows.kind) & (tree.kept_row >= 0)
    if not closing.any():
        return 0
    if is_held(model.rows.kind).sum() <= FEW:
        rows, _ = scaled_constraints(model, work, state)
        if np.linalg.eigvalsh(rows @ rows.T)[0] > WELL:
            return 0
    set_iterate(work, state)
    parts = linearized(model, work, 1.0, 0.0, 0.0)
    G, N = parts.G[closing], coordinate_motions(compiled, tree, state)
    mass, alone = np.zeros(N.shape[1]), np.zeros(G.shape[0])
    for i, H in enumerate(with_mass_for_all(model, parts.H)):
        u = slice(int(model.bodies.u0[i]), int(model.bodies.u0[i + 1]))
        mass += np.einsum("us,uv,vs->s", N[u], H, N[u], optimize=True)
        alone += (G[:, u].power(2) @ (1 / np.diag(H))) if G[:, u].nnz else 0.0
    C = (G @ N) / np.sqrt(np.maximum(mass, np.finfo(float).tiny))
    size = np.linalg.norm(C, axis=1)
    is_none = size <= ROUNDING * np.sqrt(alone)
    return int(is_none.sum()) + dependent_count(C[~is_none] / size[~is_none, None])


def dependent_count(C: Array) -> int:
    """Return by how much the rank of rows of length one is below their number."""
    if not len(C):
        return 0
    values = np.linalg.svd(C, compute_uv=False)
    ends = [
        k
        for k in range(1, len(values))
        if values[k] <= ROUNDING * values[0] or (values[k] <= SMALL * values[0] and values[k] <= GAP * values[k - 1])
    ]
    return len(C) - (ends[0] if ends else len(values))
