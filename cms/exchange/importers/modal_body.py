"""A body of a floating frame as other multibody programs write it: modes, matrices, integrals, motion of its nodes."""

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np

from cms.body.geometric_stiffness import GeometricStiffness
from cms.body.invariants import Moments
from cms.errors import ForeignBodyError
from fe_models.body.load_cases import ReducedLoadCase
from fe_models.foundation.arrays import Array, IntArray, frozen, frozen_int
from fe_models.foundation.copies import FrozenMapping, frozen_copies

__all__ = ["ForeignInterface", "ModalBody"]


@frozen_copies
@dataclass(frozen=True, eq=False)
class ForeignInterface:
    """A named place of a foreign body: its nodes, and its motion where the file says that itself."""

    name: str
    nodes: IntArray  #: numbers of its nodes, (n,)
    position: Array | None = None  #: in B, (3,)
    triad: Array = field(default_factory=lambda: np.eye(3))  #: columns: its axes in B, (3, 3)
    Psi: Array | None = None  #: translation and rotation for each mode in B, (6, n_q); None: that of its nodes

    def __post_init__(self) -> None:
        object.__setattr__(self, "nodes", frozen_int(self.nodes))


@frozen_copies
@dataclass(frozen=True, eq=False)
class ModalBody:
    """Matrices and integrals over the modes of a foreign body in its own frame B, numbers as its file has them.

    Raises
    ------
    ForeignBodyError
        If shapes do not fit or a number is not finite.
    """

    name: str
    M: Array  #: modal mass, (n_q, n_q)
    K: Array  #: modal stiffness, (n_q, n_q)
    D: Array | None  #: modal damping, (n_q, n_q)
    moments: Moments  #: in B
    node_numbers: IntArray  #: (n_nodes,)
    nodes: Array  #: undeformed places in B, (n_nodes, 3)
    Phi: Array  #: translations of the nodes for each mode, (n_nodes, 3, n_q)
    rotations: Array | None = None  #: of the nodes for each mode, (n_nodes, 3, n_q); None: not said
    stress: Array | None = None  #: xx yy zz yz xz xy at the nodes for each mode, (n_nodes, 6, n_q)
    surface: IntArray = field(default_factory=lambda: np.zeros((0, 3), np.int64))  #: triangles of rows of `nodes`
    interfaces: tuple[ForeignInterface, ...] = ()  #: those that the file names
    load_cases: tuple[ReducedLoadCase, ...] = ()
    geometric: GeometricStiffness | None = None  #: in mean axes; its interfaces are the nodes, in their order
    program: str = ""
    provenance: Mapping[str, str] = field(default_factory=dict)

    def __post_init__(self) -> None:
        where = f"body {self.name!r}"
        put = object.__setattr__
        n, n_nodes = np.asarray(self.K).shape[0], len(self.node_numbers)
        shapes = {
            "M": (n, n), "K": (n, n), "D": (n, n), "nodes": (n_nodes, 3), "Phi": (n_nodes, 3, n),
            "rotations": (n_nodes, 3, n), "stress": (n_nodes, 6, n),
        }  # fmt: skip
        for name, shape in shapes.items():
            value = getattr(self, name)
            if value is None:
                continue
            array = frozen(value)
            if array.shape != shape:
                raise ForeignBodyError(f"{where}: {name}: expected shape {shape}, got {array.shape}")
            if not np.isfinite(array).all():
                raise ForeignBodyError(f"{where}: {name}: expected finite numbers")
            put(self, name, array)
        put(self, "node_numbers", frozen_int(self.node_numbers))
        put(self, "surface", frozen_int(self.surface))
        put(self, "provenance", FrozenMapping(dict(self.provenance)))
        if not n:
            raise ForeignBodyError(f"{where}: expected at least one mode, got none; a rigid body needs no file")
        if len(np.unique(self.node_numbers)) != n_nodes:
            raise ForeignBodyError(f"{where}: node_numbers: a number is there twice")
        if self.moments.n_q != n:
            raise ForeignBodyError(f"{where}: {n} modes in the stiffness, {self.moments.n_q} in the mass integrals")
        if self.geometric is not None and self.geometric.interfaces.shape != (n_nodes, 6, n, n):
            raise ForeignBodyError(
                f"{where}: geometric stiffness: expected 6 matrices ({n}, {n}) of each of {n_nodes} nodes, got "
                f"{self.geometric.interfaces.shape}"
            )
        for name in ("M", "K", "D"):
            matrix = getattr(self, name)
            if matrix is not None:
                defect, size = np.abs(matrix - matrix.T).max(), np.abs(matrix).max()
                if defect > 1e-6 * size:
                    raise ForeignBodyError(
                        f"{where}: {name}: expected a symmetric matrix, |A - Aᵀ| is {defect / size:.1e} of |A|"
                    )
                put(self, name, frozen((matrix + matrix.T) / 2))

    @property
    def n_q(self) -> int:
        """Number of modes."""
        return int(np.asarray(self.K).shape[0])
