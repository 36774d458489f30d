"""Static modes of a body by its boundary dofs (THEORY §2)."""

import numpy as np

from cms.arrays import Array
from cms.fe_body import FEBody
from cms.fixed_interface import FixedInterfaceBody

__all__ = ["boundary_groups", "boundary_labels", "constraint_modes"]

COMPONENTS = ("ux", "uy", "uz", "rx", "ry", "rz")
BLOCK = 60  #: right-hand sides solved at once; wider blocks gain nothing measurable and cost memory


def constraint_modes(fixed: FixedInterfaceBody) -> Array:
    """Constraint modes Psi_C: unit displacement of one boundary dof, the other boundary dofs held.

    Interior part -K_II⁻¹ K_IB; columns in the order of `body.b`.

    Returns
    -------
    Array
        (n_dof, n_b), translations per translation [-] or per rotation [m].
    """
    body, i, b = fixed.body, fixed.i, fixed.b
    Psi_C = np.zeros((body.n_dof, len(b)))
    Psi_C[b, np.arange(len(b))] = 1.0
    K_b = body.K[:, b]
    for first in range(0, len(b), BLOCK):
        columns = slice(first, min(first + BLOCK, len(b)))
        Psi_C[i, columns] = fixed.factorization.solve(-K_b[:, columns].toarray()[i])
    return Psi_C


def boundary_labels(body: FEBody, family: str) -> tuple[str, ...]:
    """Return one label per boundary dof, such as 'constraint big_end ux' or 'constraint bolts node 12 uz'."""
    labels = []
    for interface in body.interfaces:
        for dof in interface.dofs if interface.dofs is not None else ():
            node, component = body.dofs[dof]
            at_node = f" node {node}" if interface.kind == "nodes" and len(interface.nodes) > 1 else ""
            labels.append(f"{family} {interface.name}{at_node} {COMPONENTS[component]}")
    return tuple(labels)


def boundary_groups(body: FEBody, family: str) -> tuple[str, ...]:
    """Return one group per boundary dof, such as 'constraint big_end'."""
    return tuple(
        f"{family} {interface.name}"
        for interface in body.interfaces
        for _ in (interface.dofs if interface.dofs is not None else ())
    )
