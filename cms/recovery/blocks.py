"""A block of recovery rows of one quantity: names, and what they give for columns of displacements."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from fe_models.foundation.arrays import Array
from fe_models.foundation.units import Dimensions

__all__ = ["Block", "RowName"]

FORCES_OF_PLACES = ("interface force", "net force")  #: that name what they belong to themselves


@dataclass(frozen=True)
class RowName:
    """What a row is."""

    quantity: str
    entity: str  #: "node", "element", "interface", "point" or "body"
    number: int  #: of the node or element; -1 where it has a name only
    place: str  #: number or name in words, such as "17" or "tip"; "" of the body
    component: str
    dimensions: Dimensions

    @property
    def label(self) -> str:
        """Return the row in words, such as "node 17 acceleration ux" or "interface force tip fx"."""
        if self.quantity in FORCES_OF_PLACES:
            return f"{self.quantity} {self.place} {self.component}"
        return " ".join(word for word in (self.entity, self.place, self.quantity, self.component) if word)


@dataclass(frozen=True, eq=False)
class Block:
    """Rows of one quantity that are linear in the displacement of a body."""

    names: tuple[RowName, ...]
    order: int  #: derivative of the displacement that they are made of: 0, 1 or 2
    values: Callable[[Array], Array]  #: of displacement columns over the dofs of the body, (n_rows, k)
    #: undeformed place of each row of an acceleration, mesh coordinates, and its direction, (n_rows, 3) each
    places: tuple[Array, Array] | None = None

    def of_rows(self, rows: Sequence[int]) -> "Block":
        """Return the block with some of its rows."""
        chosen = np.asarray(rows, dtype=np.int64)
        values = self.values
        places = None if self.places is None else (self.places[0][chosen], self.places[1][chosen])
        return Block(tuple(self.names[k] for k in rows), self.order, lambda u: values(u)[chosen], places)
