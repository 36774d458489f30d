"""Benfield-Hruda: constraint modes, and modes of the body with mass and stiffness of its neighbours."""

from collections.abc import Sequence

import numpy as np
import scipy.linalg as la

from cms.errors import ModeSetError
from cms.linear_algebra.solvers.mode_count import ModeCount, mode_count
from cms.modes.families.families import Families
from cms.modes.families.flexibility import BoundaryConditions
from cms.modes.families.interface_loads import InterfaceLoad, boundary_load
from cms.modes.families.sharing import families_of
from cms.modes.mode_set import ModeSet
from cms.modes.mode_sets.blocks import constraint_block, mode_set, vibration_block
from cms.modes.mode_sets.selection import checked_modes, require_interfaces
from fe_models.body.fe_body import FEBody

__all__ = ["benfield_hruda"]


def benfield_hruda(
    body: FEBody | Families,
    n_modes: int | ModeCount,
    *,
    loads: Sequence[InterfaceLoad] = (),
) -> ModeSet:
    """Benfield-Hruda mode set: [Psi_C, phi - Psi_C phi_B] with loaded-interface modes phi [1]_.

    (1) (K + K_load) phi = omega² (M + M_load) phi, with mass and stiffness of the neighbours on the boundary
    (2) phi - Psi_C phi_B has the same span together with Psi_C, and is well-conditioned

    The modes of (1) are close to those of the assembled system, so few are needed. Rigid-body motions that the loads
    leave free are in the span of Psi_C and are not counted.

    Parameters
    ----------
    body
        A coupled body with at least one interface, or its `Families`, which several sets can share.
    n_modes
        Number of elastic loaded-interface modes. A `ModeCount` gives a cutoff frequency instead, and whether to prove
        that no mode was missed.
    loads
        Mass and stiffness at an interface (`point_load`, `InterfaceLoad`), or of neighbours across several interfaces
        (`condensed_load`).

    Raises
    ------
    ModeSetError
        If there is no load, or no mode below the cutoff.
    BodyError
        If a load names an unknown interface or is not a mass or stiffness.

    References
    ----------
    .. [1] Benfield & Hruda (1971), docs/bibliography.md; derived in docs/theory.md §2-3.
    """
    with families_of(body) as families:
        body, wanted = families.body, mode_count(n_modes)
        require_interfaces("benfield_hruda", body)
        if not loads:
            names = ", ".join(interface.name for interface in body.interfaces)
            raise ModeSetError(
                "benfield_hruda: expected loads, the mass or stiffness of the neighbours on at least one interface "
                f"({names}), got none; take craig_bampton or rubin where they are not known"
            )
        K_b, M_b = boundary_load(body, loads)
        rest = np.zeros((len(families.h) - len(body.b),) * 2)
        conditions = BoundaryConditions(
            np.eye(len(families.h)),
            la.block_diag(K_b, rest) if K_b.any() else None,
            la.block_diag(M_b, rest) if M_b.any() else None,
        )
        modes = checked_modes(
            "benfield_hruda",
            "loaded-interface",
            lambda asked: families.elastic_modes(conditions, asked),
            body,
            wanted,
        )
        blocks = [
            constraint_block(families),
            vibration_block("loaded-interface", modes, families.without_boundary(modes.Phi)),
        ]
        loaded = ", ".join(dict.fromkeys(name for load in loads for name in load.interfaces))
        return mode_set(
            "benfield-hruda", families, blocks, modes=modes, wanted=wanted, options={"loaded interfaces": loaded}
        )
