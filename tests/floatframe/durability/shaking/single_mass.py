"""A single mass on a moved base as a shaken model: the closed forms of the books are about it."""

import numpy as np

from fe_models.foundation.units import unit_system
from floatframe.durability.shaking.structure.model import DIRECTIONS, Base, Output, ShakenModel

ACCELERATION, DISPLACEMENT, FORCE = range(3)  #: its outputs


def masses(frequencies, zeta, participation=None, units="m-kg-s"):
    """Masses side by side on one base that moves along z; of the first the acceleration, displacement and the net "
    "force."""
    units = unit_system(units)
    omega = 2 * np.pi * np.asarray(frequencies, dtype=float) * units.time
    n = len(omega)
    P = np.ones(n) if participation is None else np.asarray(participation, dtype=float)
    B, E, D = np.zeros((3, n, 6)), np.zeros((3, 3, n)), np.zeros((3, 3, 6))
    B[2, :, 2] = -P
    E[2, ACCELERATION, 0], D[2, ACCELERATION, 2] = 1 / P[0], 1.0
    E[0, DISPLACEMENT, 0] = 1 / P[0]
    E[2, FORCE], D[2, FORCE, 2] = P, P @ P
    mass = np.zeros((6, 6))
    mass[2, 2] = P @ P
    return ShakenModel(
        name="masses",
        units=units,
        bases=(Base("base", ("foot",), np.zeros(3)),),
        inputs=tuple(f"base:{name}" for name in DIRECTIONS),
        rates=np.full(6, 2),
        omega=omega,
        C=np.diag(2 * np.broadcast_to(zeta, n) * omega),
        B=B,
        E=E,
        D=D,
        outputs=(
            Output("mass acceleration z", "acceleration", "m/s²", "mass acceleration"),
            Output("mass displacement z", "displacement", "m", "mass displacement"),
            Output("base force z", "force", "N", "base force"),
        ),
        mass=mass,
    )
