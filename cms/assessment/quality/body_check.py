"""All checks of a reduced body without its full model."""

from cms.assessment.quality.of_body.buckling import check_buckling
from cms.assessment.quality.of_body.descriptions import (
    check_damping,
    check_damping_told,
    check_dropped_columns,
    check_labels,
    check_mesh_order,
    check_scope,
    check_step_size,
    check_units,
)
from cms.assessment.quality.of_body.effective_mass import check_driven_mass
from cms.assessment.quality.of_body.identities import (
    check_definiteness,
    check_energy_shares,
    check_frame_condition,
    check_free_frequencies,
    check_inertia_tensor,
    check_inertia_terms,
    check_kinetic_energy,
    check_modal_mass,
    check_symmetry,
)
from cms.assessment.quality.of_body.interface_motions import (
    check_interface_motions,
    check_interface_places,
    check_rigid_interfaces,
)
from cms.assessment.quality.of_body.moments_of_mass import check_gram, check_moments_of_shapes
from cms.assessment.quality.of_body.recovery_rows import (
    check_recovery_forces,
    check_recovery_motions,
    check_recovery_shapes,
)
from cms.assessment.quality.of_body.second_order import check_second_order, check_turned_loads
from cms.assessment.quality.record import QualityRecord
from cms.body.reduced_body import ReducedBody

__all__ = ["BODY_CHECKS", "check_body"]

BODY_CHECKS = (
    check_symmetry,
    check_definiteness,
    check_kinetic_energy,
    check_modal_mass,
    check_frame_condition,
    check_free_frequencies,
    check_inertia_tensor,
    check_inertia_terms,
    check_gram,
    check_moments_of_shapes,
    check_turned_loads,
    check_second_order,
    check_rigid_interfaces,
    check_interface_places,
    check_interface_motions,
    check_energy_shares,
    check_labels,
    check_recovery_motions,
    check_recovery_forces,
    check_recovery_shapes,
    check_driven_mass,
    check_buckling,
    check_mesh_order,
    check_units,
    check_step_size,
    check_damping,
    check_damping_told,
    check_dropped_columns,
    check_scope,
)


def check_body(reduced: ReducedBody) -> tuple[QualityRecord, ...]:
    """Check a reduced body on its own: whether its data are consistent, and what it requires of its user.

    Parameters
    ----------
    reduced
        The reduced body, from a reduction or a file.

    Returns
    -------
    tuple of QualityRecord
        One for each of `BODY_CHECKS`, in their order; a body without positive mass is asked for its inertia only.
    """
    if not reduced.moments.m > 0:
        return (check_inertia_tensor(reduced),)
    return tuple(check(reduced) for check in BODY_CHECKS)
