"""The energy error of a computed motion."""

import numpy as np

from fe_models.foundation.arrays import Array
from floatframe.results.trajectory import Trajectory

__all__ = ["balance_defect", "energy_scale"]


def energy_scale(trajectory: Trajectory) -> float:
    """Return the largest energy in motion [J], the reference for energy errors.

    It is the largest of kinetic, strain and spring energy, the range of the potential of gravity (whose zero is
    arbitrary), and the work of forces and dampers.
    """
    e = trajectory.energies
    parts = (e.kinetic, e.strain, e.springs, e.gravity - e.gravity.min(initial=np.inf), e.work, e.dissipated)
    return max(float(np.abs(part).max(initial=0.0)) for part in parts)


def balance_defect(trajectory: Trajectory) -> Array:
    """Return the energy error, (n_t,) [J]: change of (total energy - work + dissipated) since the start."""
    balance = trajectory.energies.balance
    return np.asarray(balance - balance[:1])
