"""Vibration modes of a body under the boundary conditions of the classical mode sets (THEORY §2)."""

from dataclasses import replace

import numpy as np

from cms.arrays import Array
from cms.eigen import EigenResult, eigenmodes
from cms.fixed_interface import FixedInterfaceBody
from cms.flexibility import Flexibility

__all__ = ["elastic_modes", "fixed_interface_modes", "no_modes"]


def fixed_interface_modes(
    fixed: FixedInterfaceBody,
    *,
    n_modes: int | None = None,
    cutoff: float | None = None,
    verify: bool = False,
) -> EigenResult:
    """Vibration modes with all boundary dofs held: K_II phi = omega² M_II phi, phi over all dofs (n_dof, k)."""
    modes = eigenmodes(
        fixed.K_ii, fixed.M_ii, n_modes=n_modes, cutoff=cutoff, factorization=fixed.factorization, verify=verify
    )
    Phi = np.zeros((fixed.body.n_dof, modes.Phi.shape[1]))
    Phi[fixed.i] = modes.Phi
    return replace(modes, Phi=Phi)


def elastic_modes(
    flexibility: Flexibility,
    *,
    n_modes: int | None = None,
    cutoff: float | None = None,
    verify: bool = False,
) -> EigenResult:
    """Elastic vibration modes of a body under any boundary conditions of its interfaces, phi over all dofs (n_dof, k).

    Free modes are those of a free boundary, loaded modes those of K + K_load, M + M_load, mixed ones hold some boundary
    dofs. Rigid-body motions the conditions leave free are known beforehand, so they are not among them.
    """
    modes = eigenmodes(
        flexibility.K, flexibility.M, n_modes=n_modes, cutoff=cutoff, factorization=flexibility, verify=verify
    )
    return replace(modes, Phi=flexibility.expand(modes.Phi))


def no_modes(n_dof: int) -> EigenResult:
    """Return the result of asking for no modes at all."""
    none: Array = np.zeros(0)
    return EigenResult(none, none, np.zeros((n_dof, 0)), none, 0, "none asked for", is_proven=False)
