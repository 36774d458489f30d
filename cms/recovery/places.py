"""Nodes, interfaces and stress points of a body by the names and numbers of its user."""

import numpy as np

from cms.errors import RecoveryError
from fe_models.body.fe_body import FEBody, Interface
from fe_models.foundation.arrays import IntArray
from fe_models.foundation.words import nearest, quoted

__all__ = ["Places"]


class Places:
    """Where rows are asked for, on one body."""

    def __init__(self, body: FEBody) -> None:
        self.body = body
        self.point_names: tuple[str, ...] = () if body.stress_points is None else tuple(body.stress_points.names)

    def interface(self, at: str | int) -> Interface | None:
        """Return the interface of that name; None if there is none."""
        return next((interface for interface in self.body.interfaces if interface.name == at), None)

    def points(self, at: str | int) -> list[int]:
        """Return the stress points of that name, or whose names begin with it as whole words."""
        return [k for k, name in enumerate(self.point_names) if name == at or name.startswith(f"{at} ")]

    def nodes(self, at: str | int) -> IntArray:
        """Return the rows of a node, of the members of an interface.

        Raises
        ------
        RecoveryError
            If there is none.
        """
        if isinstance(at, str):
            interface = self.interface(at)
            if interface is None:
                choices = [each.name for each in self.body.interfaces]
                raise RecoveryError(
                    f"body {self.body.name!r}: recovery: no node set or interface {quoted(at)}{nearest(at, choices)}"
                )
            return interface.nodes
        if not 0 <= at < len(self.body.nodes):
            raise RecoveryError(
                f"body {self.body.name!r}: recovery: no node {at}; they are counted from 0 to "
                f"{len(self.body.nodes) - 1}"
            )
        return np.array([at], dtype=np.int64)

    def word(self, node: int) -> str:
        """Return what a node is called."""
        return str(node)

    def number(self, node: int) -> int:
        """Return the number of a node."""
        return node
