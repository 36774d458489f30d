"""The modes of a modal file over all dofs of its full model, found again in the span of a mode set.

A file keeps its modes at some nodes only. Where those determine x in phi_file = [Psi_R Phi] x, the full shapes follow,
in any frame; what is left at the nodes says whether file, model and mode set belong together.
"""

from dataclasses import dataclass

import numpy as np

from cms.arrays import Array, frozen
from cms.fe_body import FEBody
from cms.quality.free_basis import FreeBasis
from cms.quality.ports import Ports
from cms.quality.record import QualityRecord, information, judge
from cms.reduced_body import ReducedBody

__all__ = ["FullShapes", "full_shapes", "same_body_record"]

WELL_DETERMINED = 1e-7  #: smallest over largest singular value of the nodal rows, below which x is not determined


@dataclass(frozen=True, eq=False)
class FullShapes:
    """Modes of a file over all dofs, mesh axes."""

    Phi: Array  #: (n_dof, n_q)
    misfit: float  #: largest distance at the kept nodes and interfaces, over a mode's largest displacement

    def __post_init__(self) -> None:
        object.__setattr__(self, "Phi", frozen(self.Phi))


def full_shapes(body: FEBody, basis: FreeBasis, reduced: ReducedBody) -> FullShapes | None:
    """Find the file's modes in the span of rigid motion and a mode set; None where its nodes do not determine them."""
    names = tuple(interface.name for interface in reduced.interfaces)
    if len(reduced.node_ids) and reduced.node_ids.max() >= len(body.nodes):
        return None
    X = np.hstack([basis.N, basis.Phi])
    axes, length = reduced.frame.axes, body.length or 1.0
    at_nodes = body.translations(X)[reduced.node_ids]
    rows = [np.einsum("ba,nbk->nak", axes, at_nodes).reshape(-1, X.shape[1])]
    wanted = [reduced.Phi.reshape(-1, reduced.n_q)]
    if names:
        turn = np.kron(np.eye(2), axes.T)
        for name in names:
            motion = turn @ (Ports.of_body(body, [name]).A @ X)
            motion[3:] *= length
            target = reduced.interface(name).Psi.copy()
            target[3:] *= length
            rows.append(motion)
            wanted.append(target)
    A, B = np.vstack(rows), np.vstack(wanted)
    size = np.linalg.norm(A, axis=0)
    size = np.where(size > 0, size, 1.0)
    x, _, rank, singular = np.linalg.lstsq(A / size, B, rcond=None)
    if rank < A.shape[1] or singular[-1] < WELL_DETERMINED * singular[0]:
        return None
    largest = np.abs(B).max(axis=0, initial=0.0)
    misfit = np.abs(A / size @ x - B).max(axis=0) / np.where(largest > 0, largest, 1.0)
    return FullShapes(X @ (x / size[:, None]), float(misfit.max(initial=0.0)))


def same_body_record(body: FEBody, basis: FreeBasis, reduced: ReducedBody, shapes: FullShapes | None) -> QualityRecord:
    """Record "same-body": free-free frequencies of the file are those of the set, its modes lie in the set's span."""
    own = basis.frequencies()
    stored = reduced.free_frequencies
    if len(own) != len(stored):
        reason = f"the mode set gives {len(own)} elastic free-free modes, the file holds {len(stored)}"
        return judge("same-body", np.inf, reason, {"set": own, "file": stored})
    distance = float(np.abs(stored / own - 1).max(initial=0.0))
    reason = f"free-free frequencies of file and mode set differ by {distance:.1e}"
    if shapes is None:
        reason += "; its kept nodes do not determine the modes over the whole body"
        return judge("same-body", distance, reason, {"set": own, "file": stored})
    K = shapes.Phi.T @ (body.K @ shapes.Phi)
    stiff = np.sqrt(np.outer(np.diag(reduced.K), np.diag(reduced.K)))
    defect = float((np.abs(K - reduced.K) / np.where(stiff > 0, stiff, 1.0)).max(initial=0.0))
    reason += f", modes at its nodes by {shapes.misfit:.1e}, Phiᵀ K Phi by {defect:.1e}"
    return judge(
        "same-body", max(distance, shapes.misfit, defect), reason,
        {"frequencies": distance, "misfit": shapes.misfit, "stiffness": defect},
    )  # fmt: skip


def undetermined(name: str) -> QualityRecord:
    """Return the record of a question that needs the full shapes where they cannot be found."""
    return information(name, "the kept nodes of the file do not determine its modes over the whole body")
