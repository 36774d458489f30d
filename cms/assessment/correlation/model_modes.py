"""Computed modes for comparison with a test: of a full model, free or fixed to the ground, or of a modal file."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from cms.assessment.correlation.errors import CorrelationError
from cms.body.reduced_body import ReducedBody
from cms.linear_algebra.solvers.eigen import eigenmodes
from cms.linear_algebra.solvers.mode_count import ModeCount
from cms.modes.families.families import Families
from cms.reduction.free_pencil import free_elastic_modes
from fe_models.body.fe_body import FEBody
from fe_models.body.rigid_motion import rigid_motion_of_points
from fe_models.foundation.arrays import Array, IntArray
from fe_models.foundation.words import nearest, quoted
from fe_models.meshes.numbering import Numbering

__all__ = ["ModelModes", "modes_of_body", "modes_of_file"]


@dataclass(frozen=True, eq=False)
class ModelModes:
    """Elastic modes of a model, in mesh axes."""

    name: str
    frequencies: Array  #: natural frequencies, ascending, (n,) [Hz]
    shapes: Array  #: translations of the nodes, (n_nodes, 3, n)
    nodes: Array  #: node positions in the mesh, (n_nodes, 3)
    numbering: Numbering
    columns: Array | None = None  #: modes of a full model over its dofs, M-orthonormal, (n_dof, n)
    is_free: bool = True

    @property
    def size(self) -> float:
        """Diagonal of the bounding box of the nodes."""
        return float(np.linalg.norm(np.ptp(self.nodes, axis=0)))


def modes_of_body(body: FEBody, cutoff: float, *, held: Sequence[str] = ()) -> ModelModes:
    """Return the elastic modes of a coupled body up to a frequency [Hz].

    Parameters
    ----------
    held
        Interfaces that are fixed in the test; empty: the body is free.

    Raises
    ------
    CorrelationError
        If there is no such interface, or no mode up to the frequency.
    """
    if held:
        names = [interface.name for interface in body.interfaces]
        for name in held:
            if name not in names:
                raise CorrelationError(f"held: body {body.name!r}: no interface {quoted(name)}{nearest(name, names)}")
        fixed = np.concatenate([np.asarray(i.dofs) for i in body.interfaces if i.name in held])
        left = np.setdiff1d(np.arange(body.n_dof), fixed)
        found = eigenmodes(body.K[left][:, left], body.M[left][:, left], ModeCount(cutoff=cutoff * body.units.time))
        columns: Array = np.zeros((body.n_dof, len(found.frequencies)))
        columns[left] = found.Phi
        frequencies = found.frequencies
    else:
        with Families(body) as families:
            modes = families.free_modes(ModeCount(cutoff=cutoff * body.units.time))
            columns, frequencies = np.asarray(modes.Phi), modes.frequencies
    if not len(frequencies):
        raise CorrelationError(f"body {body.name!r}: no elastic mode up to {cutoff:g} Hz; check the units of both")
    return ModelModes(
        body.name, np.asarray(frequencies) / body.units.time, body.translations(columns), np.asarray(body.nodes),
        body.numbering, columns, not held,
    )  # fmt: skip


def modes_of_file(reduced: ReducedBody) -> ModelModes:
    """Return the free elastic modes of a reduced body at its kept nodes, in mesh axes."""
    if reduced.is_held or not reduced.n_q:
        raise CorrelationError(f"body {reduced.name!r}: expected a free body with modes")
    omega2, X, is_massive = free_elastic_modes(reduced)
    X = X[:, is_massive]
    A, origin = reduced.frame.axes, reduced.frame.origin
    moved = rigid_motion_of_points(np.asarray(reduced.nodes), np.zeros(3)) @ X[:6] + reduced.Phi @ X[6:]
    frequencies = np.sqrt(np.maximum(omega2[is_massive], 0.0)) / (2 * np.pi) / reduced.units.time
    return ModelModes(
        reduced.name, frequencies, np.einsum("ab,nbk->nak", A, moved), origin + np.asarray(reduced.nodes) @ A.T,
        reduced.numbering,
    )  # fmt: skip


def at_rows(model: ModelModes, rows: IntArray, directions: Array) -> Array:
    """Return the shapes at nodes, along given directions, (n_rows, n)."""
    return np.asarray(np.einsum("ra,rak->rk", directions, model.shapes[rows]))
