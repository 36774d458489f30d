"""Nodes of a model whose elements are only in another program: positions, numbers, and groups for selection."""

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np

from fe_models.foundation.arrays import Array, IntArray, frozen
from fe_models.foundation.errors import ArgumentError
from fe_models.foundation.presentation import presented
from fe_models.foundation.records import FrozenMapping, checked_fields, frozen_copies

__all__ = ["NodeCloud"]


@presented
@frozen_copies
@dataclass(frozen=True, eq=False)
@checked_fields(ArgumentError)
class NodeCloud:
    """Nodes of solids, shells, beams or unknown elements; all nodes can be selected.

    Parameters
    ----------
    nodes
        Positions of the nodes, (n_nodes, 3), in the length unit of the model.
    node_sets
        Nodes of each group, including groups of lines and points.
    face_sets
        Nodes of the faces of each group, by face type.
    source
        File it was read from.
    digest
        sha256 of that file.
    included
        sha256 of each file that the source includes.
    node_numbers
        Numbers of the nodes in the file, (n_nodes,); empty: none.
    notes
        Descriptions of what the reader left out or changed.
    """

    nodes: Array
    node_sets: Mapping[str, IntArray] = field(default_factory=dict)
    face_sets: Mapping[str, Mapping[str, IntArray]] = field(default_factory=dict)
    source: str = ""
    digest: str = ""
    included: Mapping[str, str] = field(default_factory=dict, kw_only=True)
    node_numbers: IntArray = field(default_factory=lambda: np.zeros(0, np.int64))
    notes: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        put = object.__setattr__
        put(self, "nodes", frozen(self.nodes))
        put(self, "included", FrozenMapping(self.included))
        put(self, "node_numbers", frozen(self.node_numbers, np.int64))
        put(self, "notes", tuple(self.notes))
        put(self, "node_sets", FrozenMapping({group: frozen(n, np.int64) for group, n in self.node_sets.items()}))
        sets = {
            group: FrozenMapping({kind: frozen(rows, np.int64) for kind, rows in by_type.items()})
            for group, by_type in self.face_sets.items()
        }
        put(self, "face_sets", FrozenMapping(sets))
