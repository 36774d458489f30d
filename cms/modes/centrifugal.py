"""Centrifugal loads of steady rotation, one for each product of two angular velocities (docs/theory.md §7)."""

import numpy as np

from fe_models.body.fe_body import FEBody
from fe_models.body.load_cases import LoadCase
from fe_models.foundation.arrays import Array, IntArray

__all__ = ["CENTRIFUGAL", "centrifugal_loads"]

CENTRIFUGAL = "centrifugal"  #: kind of these load cases
PRODUCTS = ("xx", "yy", "zz", "yz", "xz", "xy")  #: products omega_a omega_b, one load for each
COLUMNS = 60  #: number of unit displacements whose moments are computed at a time


def centrifugal_loads(body: FEBody) -> tuple[LoadCase, ...]:
    """Return the loads -∫ ρ [e_a × (e_b × c) + e_b × (e_a × c)] / 2, one load case for each product omega_a omega_b.

    (1) solid nodes: the field is linear in the position c, which isoparametric elements interpolate exactly. With a
        consistent mass, f = M u with the nodal values u is therefore exact. The field has no curl, so nodal rotations
        get no load.
    (2) nodes with rotations, if the elements are known: f_ab · u = (a = b) ∫ c · u - ∫ (c_a u_b + c_b u_a) / 2 for
        every unit displacement u, from the moments of the elements. This includes the couples of cross-sections, such
        as the torque on a flat blade.

    A rotation ω loads the body with Σ over a, b of omega_a omega_b f_ab, so mixed products count twice. The elastic
    response does not depend on the origin: another origin adds a uniform field, which a rigid-body acceleration
    balances.

    Parameters
    ----------
    body
        The body; before coupling, if it will have rigid interfaces.
    """
    node, component = body.dofs.T
    is_translation = (component >= 0) & (component < 3)
    F = np.zeros((body.n_dof, len(PRODUCTS)))
    for k, product in enumerate(PRODUCTS):  # (1)
        a, b = (np.eye(3)["xyz".index(letter)] for letter in product)
        field = -(np.cross(a, np.cross(b, body.nodes)) + np.cross(b, np.cross(a, body.nodes))) / 2
        F[is_translation, k] = field[node[is_translation], component[is_translation]]
    F = body.M @ F
    rows = np.flatnonzero(np.isin(node, node[component >= 3]) & (component >= 0))
    if body.element_model is not None and len(rows):  # (2)
        P = _moments(body, rows)
        for k, (a, b) in enumerate(["xyz".index(letter) for letter in product] for product in PRODUCTS):
            F[rows, k] = (a == b) * np.trace(P) - (P[a, b] + P[b, a]) / 2
    return tuple(LoadCase(f"{CENTRIFUGAL} {name}", CENTRIFUGAL, f) for name, f in zip(PRODUCTS, F.T, strict=True))


def _moments(body: FEBody, dofs: IntArray) -> Array:
    """Return the mass moments ∫ c_a u_b dm of unit displacements of these dofs, (3, 3, n_dofs)."""
    assert body.element_model is not None
    parts = []
    for first in range(0, len(dofs), COLUMNS):
        chosen = dofs[first : first + COLUMNS]
        u = np.zeros((body.n_dof, len(chosen)))
        u[chosen, np.arange(len(chosen))] = 1.0
        gram = body.element_model.mass_gram(body.mesh_displacement(u))
        parts.append(gram[1:4, 4:].reshape(3, 3, len(chosen)))
    return np.concatenate(parts, axis=2)
