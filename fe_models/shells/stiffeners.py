"""Beams on a shell: one body of both, which share nodes."""

from dataclasses import dataclass, replace

import numpy as np
import scipy.sparse as sp

from fe_models.beams.model import BeamModel
from fe_models.body.fe_body import ElementModel, FEBody, Recovery
from fe_models.body.mass_loads import MassLoads
from fe_models.foundation.arrays import Array, IntArray, frozen_int
from fe_models.foundation.errors import BodyError
from fe_models.shells.model import ShellModel

__all__ = ["StiffenedModel", "with_frame"]


@dataclass(frozen=True, eq=False)
class StiffenedModel:
    """Shell and frame that share nodes (`fe_models.body.fe_body.ElementModel`).

    Dofs: six per node of the shell, three per skin point of the shell, three per skin point of the frame.
    """

    shell: ShellModel
    frame: BeamModel
    nodes: IntArray  #: of the shell, for each node of the frame, (n_frame_nodes,)

    def __post_init__(self) -> None:
        object.__setattr__(self, "nodes", frozen_int(self.nodes))

    @property
    def has_nodal_stress(self) -> bool:
        """True: the shell knows it."""
        return True

    @property
    def n_mesh_dof(self) -> int:
        """Dofs of the mesh."""
        return self.shell.n_mesh_dof + 3 * len(self.frame.skin.points)

    @property
    def frame_rows(self) -> IntArray:
        """Dofs of the mesh that are those of the frame, (n_frame_mesh_dof,)."""
        of_nodes = (6 * self.nodes[:, None] + np.arange(6)).ravel()
        return np.concatenate([of_nodes, np.arange(self.shell.n_mesh_dof, self.n_mesh_dof)])

    def mass_gram(self, u: Array) -> Array:
        """Return the sum of both, (4 + 3 k, 4 + 3 k)."""
        self._require_rows("mass_gram", u)
        return self.shell.mass_gram(u[: self.shell.n_mesh_dof]) + self.frame.mass_gram(u[self.frame_rows])

    def nodal_stress(self, u: Array, *, nodes: IntArray | None = None) -> Array:
        """Return the stress of the shell at its nodes and skin, then that of the frame at its skin."""
        self._require_rows("nodal_stress", u)
        of_frame = self.frame.nodal_stress(u[self.frame_rows])[len(self.nodes) :]
        return np.concatenate([self.shell.nodal_stress(u[: self.shell.n_mesh_dof], nodes=nodes), of_frame])

    @property
    def has_geometric_stiffness(self) -> bool:
        """True: both know it."""
        return True

    def mass_forces(self, loads: MassLoads) -> Array:
        """Return the consistent forces of loads per mass on both, (n_mesh_dof, k)."""
        return self._joined(self.shell.mass_forces(loads), self.frame.mass_forces(loads))

    def internal_forces(self, u: Array, *, nodes: IntArray | None = None) -> Array:
        """Return K u of both, (n_mesh_dof, k) [N, N m], at all nodes."""
        self._require_rows("internal_forces", u)
        of_shell = self.shell.internal_forces(u[: self.shell.n_mesh_dof])
        return self._joined(of_shell, self.frame.internal_forces(u[self.frame_rows]))

    def geometric_stiffness(self, u: Array, loads: MassLoads, Phi: Array) -> Array:
        """Return the sum of both, (k, n, n)."""
        self._require_rows("geometric_stiffness", u)
        n, rows = self.shell.n_mesh_dof, self.frame_rows
        return self.shell.geometric_stiffness(u[:n], loads, Phi[:n]) + self.frame.geometric_stiffness(
            u[rows], loads, Phi[rows]
        )

    def _joined(self, of_shell: Array, of_frame: Array) -> Array:
        forces = np.zeros((self.n_mesh_dof, of_shell.shape[1]))
        forces[: self.shell.n_mesh_dof] = of_shell
        forces[self.frame_rows] += of_frame
        return forces

    def _require_rows(self, where: str, u: Array) -> None:
        if np.ndim(u) != 2 or np.shape(u)[0] != self.n_mesh_dof:
            raise BodyError(f"{where}: u: expected columns over {self.n_mesh_dof} dofs, got {np.shape(u)}")


def with_frame(shell: FEBody, model: ShellModel, frame: FEBody, frame_model: BeamModel, nodes: IntArray) -> FEBody:
    """Add a frame to a shell.

    Parameters
    ----------
    shell, model
        The shell, its dofs six per node, and its element model.
    frame, frame_model
        The frame, its dofs six per node, and its element model.
    nodes
        Node of the shell for each node of the frame, (n_frame_nodes,).

    Returns
    -------
    FEBody
        Its nodes are those of the shell and its skin, then the skin of the frame.
    """
    if shell.recovery is None or frame.recovery is None:
        raise BodyError("with_frame: expected bodies with a skin")
    n_frame_nodes = len(nodes)
    dofs = (6 * nodes[:, None] + np.arange(6)).ravel()
    place = sp.csr_array((np.ones(len(dofs)), (np.arange(len(dofs)), dofs)), shape=(len(dofs), shell.n_dof))

    def placed(matrix: sp.csc_array) -> sp.csc_array:
        return sp.csc_array(place.T @ matrix @ place)

    number = np.concatenate([nodes, len(shell.nodes) + np.arange(len(frame.nodes) - n_frame_nodes)])
    skin_rows = sp.csr_array(frame.recovery.matrix)[6 * n_frame_nodes :]
    skin_dofs = frame.recovery.dofs[6 * n_frame_nodes :]
    moved = np.stack([number[skin_dofs[:, 0]], skin_dofs[:, 1]], axis=1)
    n_new = len(frame.nodes) - n_frame_nodes
    volumes = np.concatenate([np.asarray(shell.node_volumes), np.zeros(n_new)])
    if frame.node_volumes is not None:
        np.add.at(volumes, number, frame.node_volumes)
    return replace(
        shell,
        M=shell.M + placed(frame.M),
        K=shell.K + placed(frame.K),
        D=None if frame.D is None else placed(frame.D),
        nodes=np.concatenate([shell.nodes, frame.nodes[n_frame_nodes:]]),
        surface=np.concatenate([shell.surface, number[frame.surface]]),
        element_model=StiffenedModel(model, frame_model, nodes),
        recovery=Recovery(
            sp.vstack([shell.recovery.matrix, skin_rows @ place], format="csr"),
            np.concatenate([shell.recovery.dofs, moved]),
        ),
        node_volumes=volumes,
        provenance={**shell.provenance, **{f"stiffeners: {key}": value for key, value in frame.provenance.items()}},
    )


def element_model_of(model: ElementModel | None) -> BeamModel:
    """Return the model of a frame; `BodyError` for any other."""
    if not isinstance(model, BeamModel):
        raise BodyError("with_frame: expected a frame of beams")
    return model
