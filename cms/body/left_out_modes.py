"""Shapes that the modes of a reduced body leave out, and the forces on them in a motion."""

from dataclasses import dataclass, replace
from typing import Annotated

import numpy as np

from cms.body.recovery_table import spin_change
from fe_models.foundation.arrays import Array
from fe_models.foundation.errors import ArgumentError
from fe_models.foundation.records import ArrayShape, checked_fields, frozen_copies

__all__ = ["LeftOutModes"]


@frozen_copies
@dataclass(frozen=True, eq=False)
@checked_fields(ArgumentError)
class LeftOutModes:
    """Left-out shapes W beside the modes of a reduced body: Wᵀ K W = 1 and Wᵀ K Phi = 0.

    The forces y = Wᵀ f on them have the unit of sqrt(energy). In statics their amplitudes are eta = y, and |eta|² / 2
    is strain energy that the modes do not have. In a motion, modes and W vibrate together, in vibration shapes of unit
    strain energy: z'' / omega² + z = Yᵀ y for each, and eta = Y z (docs/theory.md §8).

    Parameters
    ----------
    mass
        1 / omega² of each vibration shape of the free body, descending, (n_shapes,) [s²]; 0: massless.
    shares
        Y: part of each left-out shape in each vibration shape, (n_left, n_shapes).
    inertia
        -Phiᵀ M W: y for each modal acceleration, (n_q, n_left).
    interfaces
        y for a unit force (rows 0-2) and a unit moment (3-5) on each interface at its reference point, axes of B,
        (6, n_interfaces, n_left).
    spin
        y for the products of angular velocities xx, yy, zz, xy, yz, zx (`spin_products`), (6, n_left); zero if the
        integrals over the elements are not known.
    load_cases
        y for each load case with amplitude 1, (n_cases, n_left).
    """

    mass: Annotated[Array, ArrayShape(("n_shapes",))]
    shares: Annotated[Array, ArrayShape(("n_left", "n_shapes"))]
    inertia: Annotated[Array, ArrayShape(("n_q", "n_left"))]
    interfaces: Annotated[Array, ArrayShape((6, "n_interfaces", "n_left"))]
    spin: Annotated[Array, ArrayShape((6, "n_left"))]
    load_cases: Annotated[Array, ArrayShape(("n_cases", "n_left"))]

    @property
    def n_left(self) -> int:
        """Number of left-out shapes."""
        return len(self.shares)

    def forces(self, q_ddot: Array, omega: Array, wrenches: Array, amplitudes: Array) -> Array:
        """Return y over time, (n_t, n_left).

        Parameters
        ----------
        q_ddot
            Modal accelerations, (n_t, n_q).
        omega
            Products of the angular velocities of B in its axes (`spin_products`), (n_t, 6) [1/time²].
        wrenches
            Force and moment on each interface at its reference point, axes of B, (n_interfaces, n_t, 6).
        amplitudes
            Amplitudes of the load cases, (n_t, n_cases).
        """
        on_interfaces = np.einsum("ita,aik->tk", wrenches, self.interfaces, optimize=True)
        return np.asarray(q_ddot @ self.inertia + omega @ self.spin + on_interfaces + amplitudes @ self.load_cases)

    def changed(self, Z: Array, R: Array) -> "LeftOutModes":
        """Return the same shapes over the coordinates of another frame.

        Rigid motions have no mass in common with the shapes, so that the position of the frame does not matter.

        Parameters
        ----------
        Z
            New modes in the old ones, q = Z q_new, (n_q, n_q_new).
        R
            New axes as columns, in old axes, (3, 3).
        """
        turned = np.concatenate([np.einsum("ab,aik->bik", R, part) for part in np.split(self.interfaces, 2)])
        return replace(self, inertia=Z.T @ self.inertia, interfaces=turned, spin=spin_change(R).T @ self.spin)
