"""Look-up of nodes, interfaces and stress points of a body by the user's names and numbers."""

import numpy as np

from cms.errors import BodyError, RecoveryError
from fe_models.body.fe_body import FEBody, Interface
from fe_models.foundation.arrays import IntArray
from fe_models.foundation.words import nearest, quoted

__all__ = ["Places"]


class Places:
    """Look-up of the places at which rows of one body are requested."""

    def __init__(self, body: FEBody) -> None:
        self.body = body
        self.point_names: tuple[str, ...] = () if body.stress_points is None else tuple(body.stress_points.names)

    def interface(self, at: str | int) -> Interface | None:
        """Return the interface with this name; None if there is none."""
        return next((interface for interface in self.body.interfaces if interface.name == at), None)

    def points(self, at: str | int) -> list[int]:
        """Return the stress points with this name, or those whose names begin with these words."""
        return [k for k, name in enumerate(self.point_names) if name == at or name.startswith(f"{at} ")]

    def nodes(self, at: str | int, *, skin: bool = False) -> IntArray:
        """Return the rows of the nodes that a node number, a set or an interface selects.

        Parameters
        ----------
        at
            The user's number, or the index if the body has no numbers; "INSTANCE.number"; or a name.
        skin
            Whether to include skin points that move with the nodes.

        Raises
        ------
        RecoveryError
            If there is no such place.
        """
        numbering, where = self.body.numbering, f"body {self.body.name!r}: recovery"
        if isinstance(at, int) and not numbering.nodes.size:
            if not 0 <= at < len(self.body.nodes):
                raise RecoveryError(
                    f"{where}: no node {at}; the body has no node numbers, and its indices are 0 to "
                    f"{len(self.body.nodes) - 1}"
                )
            return np.array([at], dtype=np.int64)
        try:
            if isinstance(at, str):
                return self._named(at, where, skin)
            rows = numbering.rows_of_node(where, at)
        except BodyError as error:
            raise RecoveryError(str(error)) from error
        return rows if skin else rows[:1]

    def _named(self, at: str, where: str, skin: bool) -> IntArray:
        """Return the rows of the nodes in a set or an interface, or of the node "INSTANCE.number"."""
        numbering = self.body.numbering
        interface = self.interface(at)
        if interface is not None:
            return interface.nodes
        if at in numbering.set_names:
            named = numbering.named_set(where, at)
            rows = named.members if named.kind == "nodes" else np.unique(self.body.surface[named.members])
            if skin or not numbering.on_skin.size:
                return rows
            own = rows[numbering.on_skin[rows] == 0]
            return own if len(own) else rows
        if at.rpartition(".")[0] in numbering.instances:
            rows = numbering.rows_of_node(where, at)
            return rows if skin else rows[:1]
        choices = [*(each.name for each in self.body.interfaces), *numbering.set_names]
        raise RecoveryError(f"{where}: no node set or interface {quoted(at)}{nearest(at, choices)}")

    def word(self, node: int) -> str:
        """Return the name of a node. A skin point is named by its node and its index among the skin points there."""
        numbering = self.body.numbering
        name = numbering.node_name(node)
        if numbering.on_skin.size and numbering.on_skin[node]:
            same = np.flatnonzero((numbering.nodes == numbering.nodes[node]) & (numbering.on_skin == 1))
            return f"{name} skin {int(np.searchsorted(same, node)) + 1}"
        return name

    def number(self, node: int) -> int:
        """Return the user's number of a node, or its index if the body has no numbers."""
        numbers = self.body.numbering.nodes
        return int(numbers[node]) if numbers.size else node
