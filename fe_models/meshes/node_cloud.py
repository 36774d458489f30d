"""Nodes of a model whose elements are only in another program: positions, numbers, and groups for selection."""

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np

from fe_models.foundation.arrays import Array, IntArray
from fe_models.foundation.errors import ArgumentError
from fe_models.foundation.presentation import presented
from fe_models.foundation.records import checked_fields, frozen_copies
from fe_models.meshes.mesh import freeze_mesh

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
        freeze_mesh(self)
