"""Centrifugal loads of steady rotation, one for each product of two angular velocities (THEORY §7)."""

import numpy as np

from cms.fe_body import FEBody
from cms.load_cases import LoadCase

__all__ = ["CENTRIFUGAL", "centrifugal_loads"]

CENTRIFUGAL = "centrifugal"  #: kind of these load cases
PRODUCTS = ("xx", "yy", "zz", "yz", "xz", "xy")  #: omega_a omega_b, one load each


def centrifugal_loads(body: FEBody) -> tuple[LoadCase, ...]:
    """Return the loads -∫ ρ [e_a × (e_b × c) + e_b × (e_a × c)] / 2 of the products omega_a omega_b, a load case each.

    The field is linear in the position c, which isoparametric elements interpolate exactly, so f = M u with its nodal
    values is exact for consistent mass. It has no curl, so nodal rotations take none of it; couples of a beam's section
    are left out. The origin does not matter: another one adds a uniform field, which a rigid-body acceleration
    balances. A rotation ω loads the body with Σ over a, b of omega_a omega_b f_ab: the mixed ones count twice.

    Parameters
    ----------
    body
        Before coupling, where it will have rigid interfaces.
    """
    cases = []
    node, component = body.dofs.T
    is_translation = (component >= 0) & (component < 3)
    for product in PRODUCTS:
        a, b = (np.eye(3)["xyz".index(letter)] for letter in product)
        field = -(np.cross(a, np.cross(b, body.nodes)) + np.cross(b, np.cross(a, body.nodes))) / 2
        u = np.zeros(body.n_dof)
        u[is_translation] = field[node[is_translation], component[is_translation]]
        cases.append(LoadCase(f"{CENTRIFUGAL} {product}", CENTRIFUGAL, body.M @ u))
    return tuple(cases)
