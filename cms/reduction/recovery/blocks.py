"""A block of recovery rows of one quantity: names of the rows, and their values for displacement columns."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from fe_models.foundation.arrays import Array
from fe_models.foundation.units import Dimensions

__all__ = ["Block", "RowName"]

FORCES_OF_PLACES = ("interface force", "net force")  #: quantities whose labels omit the kind of entity


@dataclass(frozen=True)
class RowName:
    """Name of a recovery row."""

    quantity: str
    entity: str  #: kind of entity: "node", "element", "interface", "point" or "body"
    number: int  #: number of the node or element; -1 if it has only a name
    place: str  #: number or name of the place, such as "17" or "tip"; "" for the body
    component: str
    dimensions: Dimensions

    @property
    def label(self) -> str:
        """Return the label of the row, such as "node 17 acceleration ux" or "interface force tip fx"."""
        if self.quantity in FORCES_OF_PLACES:
            return f"{self.quantity} {self.place} {self.component}"
        return " ".join(word for word in (self.entity, self.place, self.quantity, self.component) if word)


@dataclass(frozen=True, eq=False)
class Block:
    """Rows of one quantity that are linear in the displacement of a body."""

    names: tuple[RowName, ...]
    order: int  #: order of the time derivative of the displacement: 0, 1 or 2
    values: Callable[[Array], Array]  #: function of displacement columns over the dofs of the body, (n_rows, k)
    #: undeformed position and direction of each row of an acceleration, mesh coordinates, (n_rows, 3) each
    places: tuple[Array, Array] | None = None

    def of_rows(self, rows: Sequence[int]) -> "Block":
        """Return the block with only some of its rows."""
        chosen = np.asarray(rows, dtype=np.int64)
        values = self.values
        places = None if self.places is None else (self.places[0][chosen], self.places[1][chosen])
        return Block(tuple(self.names[k] for k in rows), self.order, lambda u: values(u)[chosen], places)
