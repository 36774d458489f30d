"""Loads per unit mass that are linear in position: weight and d'Alembert loads of rigid motion (theory.md §7)."""

from dataclasses import dataclass

import numpy as np

from fe_models.foundation.arrays import Array, frozen, require_finite, require_shape

__all__ = ["MassLoads", "rotation_work"]


@dataclass(frozen=True, eq=False)
class MassLoads:
    """k loads, each with forces per unit mass f = A c + b at the undeformed position c, mesh axes."""

    A: Array  #: (k, 3, 3) [1/s² per unit of the load]
    b: Array  #: (k, 3) [m/s² per unit of the load]

    def __post_init__(self) -> None:
        k = len(np.asarray(self.A))
        for name, shape in {"A": (k, 3, 3), "b": (k, 3)}.items():
            array = frozen(getattr(self, name))
            require_shape(f"mass loads: {name}", array, shape)
            require_finite(f"mass loads: {name}", array)
            object.__setattr__(self, name, array)

    @classmethod
    def none(cls, k: int) -> "MassLoads":
        """Return k loads of zero."""
        return cls(np.zeros((k, 3, 3)), np.zeros((k, 3)))

    @property
    def k(self) -> int:
        """Number of loads."""
        return len(self.b)

    def at(self, points: Array) -> Array:
        """Return the forces per unit mass at points (..., 3), as (..., 3, k)."""
        return np.einsum("jab,...b->...aj", self.A, points) + self.b.T

    def plus_rigid(self, motion: Array, origin: Array) -> "MassLoads":
        """Return the loads plus d + theta × (c - origin), where motion = [d; theta], (6, k)."""
        d, theta = motion[:3].T, motion[3:].T
        A = np.array(self.A)
        for a, (b, c) in enumerate(((1, 2), (2, 0), (0, 1))):  # theta~ has -theta_a in row b, column c
            A[:, b, c] -= theta[:, a]
            A[:, c, b] += theta[:, a]
        return MassLoads(A, self.b + d - np.cross(theta, origin))


def rotation_work(V: Array) -> Array:
    """Return W, (..., 3, 3), in thetaᵀ W theta', the work of forces on the second-order term of a rigid rotation.

    A point at lever o moves by theta × o + ½ theta × (theta × o) if theta is a rotation vector. Forces f do work on the
    bilinear form ½ [theta × (theta' × o) + theta' × (theta × o)]. Hence W = sym(V) - tr(V) 1 with V = Σ f oᵀ.
    """
    V = np.asarray(V)
    trace = np.trace(V, axis1=-2, axis2=-1)[..., None, None]
    return np.asarray((V + np.swapaxes(V, -1, -2)) / 2 - trace * np.eye(3))
