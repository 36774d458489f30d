"""Shell with beams on it as one body: nodes move together, except for independent section rotations."""

from dataclasses import dataclass, replace

import numpy as np
import scipy.sparse as sp

from fe_models.body.fe_body import ElementModel, FEBody, NoNodalRotations, Recovery
from fe_models.body.rigid_motion import MassLoads
from fe_models.elements.beams.model import BeamModel
from fe_models.elements.shells.model import ShellModel
from fe_models.elements.shells.section_rotations import SectionRotations
from fe_models.foundation.arrays import Array, IntArray, require_rows
from fe_models.foundation.errors import BodyError
from fe_models.meshes.numbering import numbering_side_by_side

__all__ = ["StiffenedModel", "element_model_of", "with_frame"]


@dataclass(frozen=True, eq=False)
class StiffenedModel(NoNodalRotations):
    """Element model of a shell with a frame on it (`fe_models.body.fe_body.ElementModel`).

    The mesh dofs are those of the shell (six per node, three per skin point), then those of the frame (likewise). Each
    node of the frame is at a node of the shell. If its section rotates independently, the section rotation is the node
    rotation theta_s, followed by a rotation theta_b about axes that rotate with the node. To second order the rotation
    vector then contains ½ theta_s × theta_b, on which the moment between section and node does work.
    """

    shell: ShellModel
    frame: BeamModel
    nodes: IntArray  #: shell node at each node of the frame, (n_frame_nodes,)

    @property
    def has_nodal_stress(self) -> bool:
        """Return True, because the shell can compute its stress."""
        return True

    @property
    def n_mesh_dof(self) -> int:
        """Number of dofs of the mesh."""
        return self.shell.n_mesh_dof + self.frame.n_mesh_dof

    def mass_gram(self, u: Array) -> Array:
        """Return the sum of the Gram matrices of shell and frame, (4 + 3 k, 4 + 3 k)."""
        of_shell, of_frame = self._parts("mass_gram", u)
        return self.shell.mass_gram(of_shell) + self.frame.mass_gram(of_frame)

    def nodal_stress(self, u: Array, *, nodes: IntArray | None = None) -> Array:
        """Return the stress of the shell at its nodes and skin, then of the frame at its nodes and skin."""
        of_shell, of_frame = self._parts("nodal_stress", u)
        return np.concatenate([self.shell.nodal_stress(of_shell, nodes=nodes), self.frame.nodal_stress(of_frame)])

    @property
    def has_geometric_stiffness(self) -> bool:
        """Return True, because shell and frame can compute their geometric stiffness."""
        return True

    def mass_forces(self, loads: MassLoads) -> Array:
        """Return the consistent forces of loads per unit mass on shell and frame, (n_mesh_dof, k)."""
        return np.concatenate([self.shell.mass_forces(loads), self.frame.mass_forces(loads)])

    def internal_forces(self, u: Array, *, nodes: IntArray | None = None) -> Array:
        """Return K u of shell and frame, (n_mesh_dof, k) [N, N m]; with `nodes`, only of shell cells at these nodes."""
        of_shell, of_frame = self._parts("internal_forces", u)
        on_shell = self.shell.internal_forces(of_shell, nodes=nodes)
        return np.concatenate([on_shell, self.frame.internal_forces(of_frame)])

    def geometric_stiffness(self, u: Array, loads: MassLoads, Phi: Array) -> Array:
        """Return the geometric stiffness of shell, frame and independently rotating sections, (k, n, n)."""
        u_shell, u_frame = self._parts("geometric_stiffness", u)
        on_shell, on_frame = self._parts("geometric_stiffness", Phi)
        forces = self.frame.internal_forces(u_frame) - self.frame.mass_forces(loads)
        moments = forces[: 6 * len(self.nodes)].reshape(len(self.nodes), 6, -1)[:, 3:]
        return (
            self.shell.geometric_stiffness(u_shell, loads, on_shell)
            + self.frame.geometric_stiffness(u_frame, loads, on_frame)
            + self._of_own_rotations(moments, on_shell, on_frame)
        )

    def _of_own_rotations(self, moments: Array, on_shell: Array, on_frame: Array) -> Array:
        """Return second derivatives of ½ m·(theta_s × theta_b) for all sections, (k, n, n), with m (n_frame, 3, k)."""
        n = len(self.nodes)
        theta_b = on_frame[: 6 * n].reshape(n, 6, -1)[:, 3:]
        theta_s = on_shell[: 6 * self.shell.n_nodes].reshape(self.shell.n_nodes, 6, -1)[self.nodes, 3:]
        is_own = np.abs(theta_b - theta_s).max(axis=(1, 2), initial=0.0) > 0
        m, s, b = moments[is_own], theta_s[is_own], theta_b[is_own]
        K = np.zeros((m.shape[2], s.shape[2], s.shape[2]))
        for a in range(3):
            i, j = (a + 1) % 3, (a + 2) % 3
            K += np.einsum("nk,np,nq->kpq", m[:, a], s[:, i], b[:, j], optimize=True)
            K -= np.einsum("nk,np,nq->kpq", m[:, a], s[:, j], b[:, i], optimize=True)
        return np.asarray((K + K.transpose(0, 2, 1)) / 2)

    def _parts(self, where: str, u: Array) -> tuple[Array, Array]:
        """Return the rows of u that belong to the shell, and those of the frame."""
        require_rows(where, u, self.n_mesh_dof)
        u = np.asarray(u)
        return u[: self.shell.n_mesh_dof], u[self.shell.n_mesh_dof :]


def with_frame(shell: FEBody, model: ShellModel, frame: FEBody, nodes: IntArray, turns: SectionRotations) -> FEBody:
    """Add a frame to a shell.

    Parameters
    ----------
    shell, model
        The shell, with six dofs per node, and its element model.
    frame
        The frame, with six dofs per node.
    nodes
        Shell node of each node of the frame, (n_frame_nodes,).
    turns
        Map from shell nodes to the nodes of the frame, and the independent rotations.

    Returns
    -------
    FEBody
        The nodes are those of the shell and its skin, then those of the frame, each at the position of a shell node,
        and its skin. The dofs are those of the shell, then the independent rotations of sections, at nodes of the
        frame.
    """
    if shell.recovery is None or frame.recovery is None:
        raise BodyError("with_frame: expected bodies with a skin")
    n_own, n_shell = len(turns.own), len(shell.nodes)

    def both(of_shell: sp.csc_array, of_frame: sp.csc_array) -> sp.csc_array:
        padded = sp.block_diag([of_shell, sp.csc_array((n_own, n_own))], format="csc")
        return sp.csc_array(padded + turns.place.T @ of_frame @ turns.place)

    no_damping = sp.csc_array((shell.n_dof, shell.n_dof))
    shift = np.array([n_shell, 0])
    volumes = np.zeros(len(frame.nodes)) if frame.node_volumes is None else np.asarray(frame.node_volumes)
    widened = sp.hstack([shell.recovery.matrix, sp.csr_array((shell.recovery.matrix.shape[0], n_own))])
    return replace(
        shell,
        M=both(shell.M, frame.M),
        K=both(shell.K, frame.K),
        D=None if frame.D is None else both(no_damping, frame.D),
        nodes=np.concatenate([shell.nodes, frame.nodes]),
        dofs=np.concatenate([shell.dofs, turns.own + shift]),
        surface=np.concatenate([shell.surface, n_shell + frame.surface]),
        element_model=StiffenedModel(model, element_model_of(frame.element_model), nodes),
        recovery=Recovery(
            sp.vstack([widened, frame.recovery.matrix @ turns.place], format="csr"),
            np.concatenate([shell.recovery.dofs, frame.recovery.dofs + shift]),
        ),
        node_volumes=np.concatenate([np.asarray(shell.node_volumes), volumes]),
        numbering=numbering_side_by_side([shell.numbered, frame.numbered], share_numbers=True),
        kept=np.concatenate([shell.kept, n_shell + frame.kept]),
        provenance={**shell.provenance, **{f"stiffeners: {key}": value for key, value in frame.provenance.items()}},
    )


def element_model_of(model: ElementModel | None) -> BeamModel:
    """Return the element model of a frame; raise `BodyError` if the body is not a frame."""
    if not isinstance(model, BeamModel):
        raise BodyError("with_frame: expected a frame of beams")
    return model
