"""Mixed boundary conditions: some interface dofs are free while the other boundary dofs are held (theory.md §3)."""

from collections.abc import Mapping, Sequence

import numpy as np
import scipy.linalg as la

from cms.errors import BodyError
from fe_models.body.fe_body import FEBody, Interface
from fe_models.foundation.arrays import Array
from fe_models.foundation.components import MOTION_COMPONENTS
from fe_models.foundation.words import nearest, quoted

__all__ = ["free_directions"]


def free_directions(body: FEBody, free: Mapping[str, Sequence[str]]) -> Array:
    """Return the directions over boundary dofs that the fixed-interface problem leaves free, orthonormal, (n_b, k).

    Parameters
    ----------
    body
        A coupled body.
    free
        For each interface its free components ux uy uz rx ry rz along the interface axes, such as {"pin": ["rz"]}. At
        an interface of kind "nodes" they apply to every node.

    Raises
    ------
    BodyError
        If an interface or component is unknown, or the interface has no such dof.
    """
    for name in free:
        body.interface(name)
    columns = []
    first = 0
    for interface in body.interfaces:
        dofs = np.asarray(interface.dofs)
        for component in free.get(interface.name, ()):
            directions = _directions(body, interface, component)
            placed = np.zeros((len(body.b), directions.shape[1]))
            placed[first : first + len(dofs)] = directions
            columns.append(placed)
        if len(set(free.get(interface.name, ()))) != len(free.get(interface.name, ())):
            raise BodyError(f"body {body.name!r}: free dofs of interface {interface.name!r}: one is listed twice")
        first += len(dofs)
    return np.hstack(columns) if columns else np.zeros((len(body.b), 0))


def _directions(body: FEBody, interface: Interface, component: str) -> Array:
    """Return this component at every node of the interface, over its dofs, (n_dofs, n_nodes)."""
    where = f"body {body.name!r}: free dofs of interface {interface.name!r}"
    if component not in MOTION_COMPONENTS:
        raise BodyError(f"{where}: unknown component {quoted(component)}{nearest(component, MOTION_COMPONENTS)}")
    axis = la.block_diag(interface.triad, interface.triad)[:, MOTION_COMPONENTS.index(component)]
    node, local = body.dofs[np.asarray(interface.dofs)].T
    nodes = list(dict.fromkeys(node.tolist()))
    directions = np.zeros((len(node), len(nodes)))
    directions[np.arange(len(node)), [nodes.index(n) for n in node.tolist()]] = axis[local]
    if np.abs(np.linalg.norm(directions, axis=0) - 1).max() > 1e-9:
        raise BodyError(f"{where}: it has no dof {component} along its axes; its dofs cannot be released so")
    return directions
