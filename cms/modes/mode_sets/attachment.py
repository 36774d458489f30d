"""Attachment sets: responses to unit interface forces, rigid-body modes and vibration modes."""

import numpy as np

from cms.linear_algebra.solvers.mode_count import ModeCount, mode_count
from cms.modes.families.families import Families
from cms.modes.families.flexibility import BoundaryConditions
from cms.modes.families.sharing import families_of
from cms.modes.families.static_modes import boundary_groups, boundary_labels
from cms.modes.mode_set import ModeSet
from cms.modes.mode_sets.blocks import boundary_block, mode_set, rigid_block, static_block, vibration_block
from cms.modes.mode_sets.selection import checked_modes, require_interfaces
from fe_models.body.fe_body import FEBody

__all__ = ["attachment", "unrestrained_attachment"]


def attachment(
    body: FEBody | Families,
    n_modes: int | ModeCount,
) -> ModeSet:
    """Attachment mode set: [Psi_R, Psi_A, modes with R held], where R are six statically determinate boundary dofs.

    (1) Psi_A: a unit force on each excess boundary dof E, with the determinate dofs R held
    (2) K phi = omega² M phi with the boundary conditions of Psi_A: R held and E free

    Parameters
    ----------
    body
        A coupled body with at least one interface, or its `Families`, which several sets can share.
    n_modes
        Number of modes with R held; 0 spans the constraint modes. A `ModeCount` gives a cutoff frequency instead, and
        whether to prove that no mode was missed.

    Raises
    ------
    ModeSetError
        If no mode lies below the cutoff.
    BodyError
        If the body is held to the ground, or has no inertia in some rigid-body motion.
    """
    with families_of(body) as families:
        body, wanted = families.body, mode_count(n_modes)
        require_interfaces("attachment", body)
        conditions = BoundaryConditions(np.eye(len(families.h))[:, families.free.e])
        modes = checked_modes(
            "attachment",
            "determinate-interface",
            lambda asked: families.elastic_modes(conditions, asked),
            body,
            wanted,
        )
        labels = np.array(boundary_labels(body, "attachment"), dtype=object)[families.free.e]
        groups = np.array(boundary_groups(body, "attachment"), dtype=object)[families.free.e]
        blocks = [
            rigid_block(families),
            static_block(families.Psi_A, labels.tolist(), groups.tolist()),
            vibration_block("determinate-interface", modes),
        ]
        held = ", ".join(label.removeprefix("held ") for label in held_words(families))
        return mode_set("attachment", families, blocks, modes=modes, wanted=wanted, options={"held": held})


def unrestrained_attachment(
    body: FEBody | Families,
    n_modes: int | ModeCount,
) -> ModeSet:
    """Unrestrained attachment mode set: [Psi_R, Psi_U, free modes]; spans Rubin's set.

    Psi_U is the response to a unit force on each boundary dof of the free body, in equilibrium with its rigid-body
    acceleration. Parameters and errors are those of `attachment`, with the elastic modes of the free body.
    """
    with families_of(body) as families:
        body, wanted = families.body, mode_count(n_modes)
        require_interfaces("unrestrained_attachment", body)
        modes = checked_modes(
            "unrestrained_attachment",
            "elastic free",
            families.free_modes,
            body,
            wanted,
        )
        blocks = [
            rigid_block(families),
            boundary_block(body, families.Psi_U, "unrestrained attachment"),
            vibration_block("free", modes),
        ]
        return mode_set("unrestrained-attachment", families, blocks, modes=modes, wanted=wanted)


def held_words(families: Families) -> list[str]:
    """Return the names of the determinate dofs."""
    labels = families.held_labels("held")
    return [label for dof, label in zip(families.h.tolist(), labels, strict=True) if dof in families.r]
