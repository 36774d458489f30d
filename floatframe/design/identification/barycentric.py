"""Barycentric parameters of a tree: bodies augmented by the masses of their subtrees.

The mass of a subtree acts on the body that carries it like a point mass in the joint. With the mass m' of a subtree and
d_c from the origin of a body to the joint of its child c [1]_,

    m' = m + Σ_c m'_c,      S' = S + Σ_c m'_c d_c,      K = J + Σ_c m'_c (d_c² 1 - d_c d_cᵀ).

In a tree of rotations, the inverse dynamics depends on the bodies only through S' and K, both about the joint that
carries the body. A body on a translation and a free body do not pass their mass on.

References
----------
.. [1] Wittenburg (2008), Dynamics of Multibody Systems: augmented bodies.
"""

from dataclasses import dataclass

import numpy as np
import scipy.linalg as la

from fe_models.foundation.arrays import Array
from fe_models.foundation.presentation import presented
from floatframe.design.identification.inertial_parameters import INERTIAL, parameters_in, point_mass
from floatframe.design.identification.regressors import LinearForm
from floatframe.design.identification.tree_samples import as_placed, rigid_tree, tree_samples

__all__ = ["BarycentricParameters", "barycentric_parameters"]


@presented
@dataclass(frozen=True, eq=False)
class BarycentricParameters:
    """Parameters of augmented bodies, which are linear in the parameters of the bodies."""

    names: tuple[str, ...]  #: "S_x'(link1)", ...
    B: Array  #: values = B phi, (n, p)
    kept: Array  #: columns of the linear form that belong to the parameters, (n,)

    def values(self, phi: Array) -> Array:
        """Return the values, (n,), from parameters, (p,)."""
        return self.B @ np.asarray(phi)


def barycentric_parameters(form: LinearForm) -> BarycentricParameters:
    """Return the barycentric parameters of a tree of rigid bodies, in the axes of the bodies.

    Bodies on joints that rotate about one point have nine parameters, S' and K about it; others have ten, with the
    mass.

    Parameters
    ----------
    form
        The linear form of a tree of rigid bodies.
    """
    tree = rigid_tree(form.system, f"system {form.system.name!r}: barycentric parameters").tree
    n_b, n_c = len(tree.parent), len(tree.side)
    zero = np.zeros((1, n_c))
    placed = tree_samples(form.system, as_placed(form.system)[None], zero, zero)
    own = [parameters_in(placed.r[0, i], placed.R[0, i]) for i in range(n_b)]
    p = 10 * n_b
    passed = np.eye(p)  # parameters of augmented bodies per parameter of the bodies
    has_mass = np.ones(n_b, dtype=bool)
    for place in range(n_b - 1, -1, -1):
        i = int(tree.order[place])
        parent, columns = int(tree.parent[i]), slice(int(tree.column0[i]), int(tree.column0[i + 1]))
        is_rotation = columns.start < columns.stop and not placed.t[0, columns].any()
        if not is_rotation:
            continue
        has_mass[i] = False
        lump = point_mass(placed.point[0, columns.start])
        mass = passed[10 * i].copy()
        passed[10 * i : 10 * i + 10] -= np.outer(la.solve(own[i], lump), mass)
        if parent >= 0:
            passed[10 * parent : 10 * parent + 10] += np.outer(la.solve(own[parent], lump), mass)
    kept = np.array([10 * i + k for i in range(n_b) for k in range(10) if k or has_mass[i]])
    names = [f"{name}'({body.name})" for body in form.system.bodies for name in INERTIAL]
    rest = len(form.names) - p
    B = np.zeros((len(kept) + rest, len(form.names)))
    B[: len(kept), :p] = passed[kept]
    B[len(kept) :, p:] = np.eye(rest)
    every = np.concatenate([kept, np.arange(p, p + rest)])
    return BarycentricParameters((*(names[k] for k in kept), *form.names[p:]), B, every)
