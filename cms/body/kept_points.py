"""Points that a reduced body keeps with translations and rotations: line nodes, point masses, and requested nodes."""

from dataclasses import dataclass, replace
from typing import Annotated

import numpy as np

from cms.errors import BodyError
from fe_models.foundation.arrays import Array, IntArray
from fe_models.foundation.errors import ArgumentError
from fe_models.foundation.presentation import presented
from fe_models.foundation.records import ArrayShape, checked_fields, frozen_copies
from fe_models.foundation.words import nearest, quoted

__all__ = ["SOURCES", "KeptPoints"]

SOURCES = {
    "dofs": "rotations that are dofs of the model, as for beams and shells",
    "elements": "half the curl of the displacement in the elements at the node, as for solids",
    "unknown": "unknown: bare matrices and rods without rotations",
}  #: origins of the rotations of a point


@presented
@frozen_copies
@dataclass(frozen=True, eq=False)
@checked_fields(ArgumentError)
class KeptPoints:
    """Rotations of kept nodes in the modes; their translations are in `ReducedBody.Phi`, as for all kept nodes.

    Parameters
    ----------
    nodes
        Rows of `ReducedBody.nodes`, ascending, (n,).
    rotation
        Rotation vectors in B, zero if unknown, (n, 3, n_q) [1/m].
    source
        Source of each rotation, one of `SOURCES`, (n,).

    Raises
    ------
    BodyError
        If shapes do not fit, or a source is unknown.
    """

    nodes: Annotated[IntArray, ArrayShape(("n",))]
    rotation: Annotated[Array, ArrayShape(("n", 3, "n_q"))]
    source: Annotated[tuple[str, ...], ArrayShape(("n",))]

    def __post_init__(self) -> None:
        if np.unique(self.nodes).size != self.nodes.size:
            raise BodyError("kept points: nodes: a node is there twice")
        for word in set(self.source) - set(SOURCES):
            raise BodyError(f"kept points: unknown source {quoted(word)}{nearest(word, SOURCES)}")

    def of_node(self, row: int) -> Array | None:
        """Return the rotation of the kept node in a given row, (3, n_q); None if the rotation is unknown."""
        at = np.flatnonzero(self.nodes == row)
        return None if not len(at) or self.source[at[0]] == "unknown" else np.asarray(self.rotation[at[0]])

    def of_modes(self, Z: Array) -> "KeptPoints":
        """Return the points over new modes, whose coordinates in the old modes are the columns of Z, (n_q, n)."""
        return replace(self, rotation=self.rotation @ Z)

    def moved(self, rotation: Array, R: Array, Z: Array) -> "KeptPoints":
        """Return the points with their rotations expressed in another frame.

        Parameters
        ----------
        rotation
            Rotation of the new frame over the old modes, which is removed from the shapes, (3, n_q).
        R
            Axes of the new frame as columns, in the old frame, (3, 3).
        Z
            As in `of_modes`.
        """
        is_known = np.array([word != "unknown" for word in self.source], dtype=float)
        own = self.rotation - is_known[:, None, None] * rotation
        return replace(self, rotation=np.einsum("ba,nbk->nak", R, own) @ Z)
