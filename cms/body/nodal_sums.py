"""Sums over the nodes of a body, weighted with nodal volume: the norm of a Buckens frame (theory.md §4)."""

from dataclasses import dataclass

import numpy as np

from cms.errors import BodyError
from fe_models.foundation.arrays import Array, frozen, require_finite, require_shape
from fe_models.foundation.copies import frozen_copies

__all__ = ["NodalSums"]


@frozen_copies
@dataclass(frozen=True, eq=False)
class NodalSums:
    """Weighted sums over all nodes about the origin of a frame B; w is the weight of a node; translations only.

    They are the parts of [1, c]ᵀ W [1, c, Phi] that a frame needs to compute the C of least weighted deformation.
    """

    w: float  #: sum of the weights [m³; dimensionless if the nodes count equally]
    S: Array  #: Σ w c, (3,) [w times m]
    R: Array  #: Σ w c_a c_b, (3, 3) [w times m²]
    U1: Array  #: Σ w phi_k, (3, n_q)
    U2: Array  #: Σ w c × phi_k, (3, n_q) [U1 times m]
    is_volume: bool = True  #: False: every node has weight 1

    def __post_init__(self) -> None:
        object.__setattr__(self, "w", float(self.w))
        require_finite("nodal sums: w", np.array(self.w))
        if not self.w > 0:
            raise BodyError(f"nodal sums: w: expected a positive sum of weights, got {self.w:g}")
        n = np.asarray(self.U1).shape[-1]
        for name, shape in {"S": (3,), "R": (3, 3), "U1": (3, n), "U2": (3, n)}.items():
            array = frozen(getattr(self, name))
            require_shape(f"nodal sums: {name}", array, shape)
            require_finite(f"nodal sums: {name}", array)
            object.__setattr__(self, name, array)
