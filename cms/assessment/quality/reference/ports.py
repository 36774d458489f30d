"""Ports: the reference points of the interfaces, where forces act and motions are observed."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import scipy.sparse as sp

from cms.assessment.quality.errors import QualityError
from cms.reduction.basis.node_results import interface_node_motion
from fe_models.body.couplings.couplings import mean_motion
from fe_models.body.fe_body import FEBody, Interface
from fe_models.foundation.arrays import MOTION_COMPONENTS, Array

__all__ = ["Ports"]

COLLINEAR = 1e-6  #: ratio of the spread of nodes across and along their line, below which they define no rotation


@dataclass(frozen=True, eq=False)
class Ports:
    """Six motions per interface in mesh axes, u_port = A u; forces and moments at the ports act as Aᵀ f."""

    names: tuple[str, ...]  #: names of the interfaces
    A: sp.csr_array  #: motions of the ports over the dofs, (6 n_ports, n_dof)

    @classmethod
    def of_body(cls, body: FEBody, names: Sequence[str] | None = None) -> "Ports":
        """Return the ports of the named interfaces of a coupled body, by default of all.

        Raises
        ------
        QualityError
            If the body has no interfaces.
        """
        body.require_coupled()
        interfaces = body.interfaces if names is None else [body.interface(name) for name in names]
        if not interfaces:
            raise QualityError(f"body {body.name!r}: has no interface; forces and motions need a place")
        blocks = [port_matrix(body, interface) for interface in interfaces]
        return cls(tuple(interface.name for interface in interfaces), sp.csr_array(sp.vstack(blocks)))

    @property
    def labels(self) -> tuple[str, ...]:
        """Label of each motion: 'big_end ux' to 'small_end rz'."""
        return tuple(f"{name} {component}" for name in self.names for component in MOTION_COMPONENTS)

    def loads(self) -> Array:
        """Unit forces and moments on the ports as columns over the dofs, (n_dof, 6 n_ports)."""
        return self.A.T.toarray()

    def row(self, name: str) -> slice:
        """Return the rows of the port with this name."""
        k = self.names.index(name)
        return slice(6 * k, 6 * k + 6)


def port_matrix(body: FEBody, interface: Interface) -> sp.csr_array:
    """Return the motion of a reference point, (6, n_dof): of its node, of a node that moves it, or the mean motion.

    Collinear nodes have only a mean translation; the rows of their rotation are zero.
    """
    dofs = np.asarray(interface.dofs)
    if len(dofs) == 6 and len(np.unique(body.dofs[dofs, 0])) == 1:
        return sp.csr_array((np.ones(6), (body.dofs[dofs, 1], dofs)), shape=(6, body.n_dof))
    motion = interface_node_motion(body, interface)
    if motion is not None:
        return motion
    points, weights = body.nodes[interface.nodes], np.asarray(interface.weights)
    spread = np.linalg.svd(points - points.mean(axis=0), compute_uv=False)
    rows = np.zeros((6, 3 * len(points)))
    if len(points) >= 3 and spread[1] > COLLINEAR * spread[0]:
        rows = mean_motion(points, weights, interface.reference)
    else:
        rows[:3] = np.kron(weights, np.eye(3))
    position = {int(node): k for k, node in enumerate(interface.nodes)}
    is_translation = (body.dofs[dofs, 1] >= 0) & (body.dofs[dofs, 1] < 3)
    chosen = dofs[is_translation]
    at = np.array([3 * position[int(node)] + component for node, component in body.dofs[chosen]], dtype=np.int64)
    matrix = sp.lil_array((6, body.n_dof))
    matrix[:, chosen] = rows[:, at]
    return sp.csr_array(matrix)
