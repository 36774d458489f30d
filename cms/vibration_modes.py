"""Vibration modes of a body under the boundary conditions of the classical mode sets (THEORY §2)."""

from cms.eigen import EigenResult, eigenmodes
from cms.fixed_interface import FixedInterfaceBody

__all__ = ["fixed_interface_modes"]


def fixed_interface_modes(
    fixed: FixedInterfaceBody,
    *,
    n_modes: int | None = None,
    cutoff: float | None = None,
    verify: bool = False,
) -> EigenResult:
    """Vibration modes with all boundary dofs held: K_II phi = omega² M_II phi, phi over the interior dofs (n_i, k)."""
    return eigenmodes(
        fixed.K_ii, fixed.M_ii, n_modes=n_modes, cutoff=cutoff, factorization=fixed.factorization, verify=verify
    )
