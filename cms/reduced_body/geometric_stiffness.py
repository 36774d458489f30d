"""Reduced geometric stiffness of a body for unit loads: what a linear floating frame leaves out (docs/theory.md §7)."""

from dataclasses import dataclass, fields, replace

import numpy as np

from cms.errors import BodyError
from fe_models.foundation.arrays import SYMMETRY_DEFECT, Array, IntArray, frozen, require_finite, require_shape
from fe_models.foundation.copies import frozen_copies
from fe_models.foundation.units import Units

__all__ = ["SPIN_PAIRS", "GeometricStiffness"]

SPIN_PAIRS = ((0, 0), (1, 1), (2, 2), (0, 1), (1, 2), (2, 0))  #: (a, b) of omega_a omega_b in the order of `spin`


@frozen_copies
@dataclass(frozen=True, eq=False)
class GeometricStiffness:
    """K_j,kl = [Phi.T K_geo(sigma_j) Phi]_kl of unit loads f_j, sigma_j the stress of the static response to f_j [1]_.

    All in the frame B of the reduced body, over its modes q, with one support for all loads (theory.md §7); a tensile
    stress makes K_j positive. Half the quadratic form, 1/2 qᵀ K_j q, is minus the work of f_j on the displacement of
    second order.

    References
    ----------
    .. [1] Schwertassek & Wallrapp (1999), docs/bibliography.md; derived in docs/theory.md §7.
    """

    translation: Array  #: K_t,a, unit load -rho e_a: frame acceleration minus gravity, (3, n_q, n_q) [1/m per q²]
    rotation: Array  #: K_r,a, unit load -rho e_a × c: angular acceleration, (3, n_q, n_q) [1 per q²]
    #: K_ab, unit load -rho/2 [e_a × (e_b × c) + e_b × (e_a × c)], (a, b) as `SPIN_PAIRS`, (6, n_q, n_q) [1 per q²]
    spin: Array
    #: unit force (3) and moment (3) at each interface of `ReducedBody.interfaces`, axes of B,
    #: (n_interfaces, 6, n_q, n_q) [1/(kg m) and 1/(kg m²) per q²]
    interfaces: Array

    def __post_init__(self) -> None:
        n = np.asarray(self.translation).shape[-1]
        n_interfaces = len(np.asarray(self.interfaces))
        shapes = {"translation": (3,), "rotation": (3,), "spin": (6,), "interfaces": (n_interfaces, 6)}
        for name, first in shapes.items():
            where = f"geometric stiffness: {name}"
            array = np.ascontiguousarray(getattr(self, name), dtype=np.float64)
            require_shape(where, array, (*first, n, n))
            require_finite(where, array)
            object.__setattr__(self, name, frozen(symmetrized(where, array)))

    @property
    def n_q(self) -> int:
        """Number of modes."""
        return int(np.asarray(self.translation).shape[-1])

    @property
    def n_interfaces(self) -> int:
        """Number of interfaces."""
        return len(self.interfaces)

    def transformed(self, Z: Array) -> "GeometricStiffness":
        """Return the matrices over other modes, Zᵀ K_j Z, for shapes Phi Z, Z: (n_q, n_new)."""
        names = [field.name for field in fields(self)]
        return replace(self, **{name: np.einsum("lk,...lm,mn->...kn", Z, getattr(self, name), Z) for name in names})

    def of_modes(self, modes: IntArray) -> "GeometricStiffness":
        """Return the matrices over some of the modes, in their order."""
        pick = np.asarray(modes, dtype=np.int64)
        names = [field.name for field in fields(self)]
        return replace(self, **{name: getattr(self, name)[..., pick[:, None], pick] for name in names})

    def in_units(self, old: Units, new: Units) -> "GeometricStiffness":
        """Return the same matrices in other units; qᵀ K_j q times the amplitude of its load is an energy."""
        length = old.length / new.length
        mass = old.mass / new.mass
        by_row = 1 / (mass * length) * np.array([1.0, 1, 1, 1 / length, 1 / length, 1 / length])
        return replace(self, translation=self.translation / length, interfaces=self.interfaces * by_row[:, None, None])


def symmetrized(where: str, array: Array) -> Array:
    """Return the symmetric part of each matrix; `BodyError` where the rest is more than rounding."""
    other = np.swapaxes(array, -1, -2)
    defect, scale = np.abs(array - other).max(initial=0.0), np.abs(array).max(initial=0.0)
    if defect > SYMMETRY_DEFECT * scale:
        raise BodyError(
            f"{where}: expected symmetric matrices over the modes, got |K - K.T| = {defect / scale:.2e} |K|; "
            "check that all are projected on both sides by the same modes"
        )
    return np.asarray((array + other) / 2)
