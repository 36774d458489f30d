"""Free-interface sets: vibration modes of the free body, and columns that make the sets statically complete."""

from dataclasses import replace

import numpy as np
import scipy.linalg as la

from cms.linear_algebra.solvers.eigen import EigenResult
from cms.linear_algebra.solvers.mode_count import ModeCount, mode_count
from cms.modes.families.families import Families, families_of
from cms.modes.mode_set import (
    Block,
    ModeSet,
    boundary_block,
    checked_modes,
    constraint_block,
    mode_set,
    require_interfaces,
    rigid_block,
    vibration_block,
)
from fe_models.body.fe_body import FEBody
from fe_models.foundation.arrays import Array
from fe_models.foundation.tall.columns import combine

__all__ = ["craig_chang", "dual_craig_bampton", "herting", "macneal", "normal_modes", "rubin"]

DEPENDENT = 1e-12  #: relative eigenvalue of the scaled residual flexibility, below which it is rounding


def normal_modes(
    body: FEBody | Families,
    n_modes: int | ModeCount,
) -> ModeSet:
    """Normal modes only: [Psi_R, free modes]; free-body frequencies are exact, responses to interface loads are poor.

    Parameters
    ----------
    body
        A coupled body, which may have no interface, or its `Families`, which several sets can share.
    n_modes
        Number of elastic free modes. A `ModeCount` gives a cutoff frequency instead, and whether to prove that no mode
        was missed.

    Raises
    ------
    ModeSetError
        If no mode lies below the cutoff.
    BodyError
        If the body is held to the ground, or has no inertia in some rigid-body motion.
    """
    with families_of(body) as families:
        body, wanted = families.body, mode_count(n_modes)
        modes = _free_modes("normal_modes", families, wanted)
        blocks = [rigid_block(families, families.Psi_R, "rigid-body"), vibration_block("free", modes)]
        return mode_set("normal", families, blocks, modes=modes, wanted=wanted)


def rubin(
    body: FEBody | Families,
    n_modes: int | ModeCount,
) -> ModeSet:
    """Rubin mode set: [Psi_R, free modes, residual attachment modes] [1]_.

    (1) K phi = omega² M phi of the free body
    (2) residual attachment: Psi_U - Phi Lambda⁻¹ Phi_Bᵀ, the static contribution of the neglected modes

    The set is statically complete, and at the interfaces exact to order omega² near zero frequency.
    Errors are those of `normal_modes`; in addition the body needs an interface.

    Parameters
    ----------
    body
        A coupled body with at least one interface, or its `Families`, which several sets can share.
    n_modes
        Number of elastic free modes; 0 gives [Psi_R, Psi_U]. A `ModeCount` gives a cutoff frequency instead, and
        whether to prove that no mode was missed.

    References
    ----------
    .. [1] Rubin (1975), docs/bibliography.md; derived in docs/theory.md §2-3.
    """
    with families_of(body) as families:
        body, wanted = families.body, mode_count(n_modes)
        require_interfaces("rubin", body)
        modes = _free_modes("rubin", families, wanted)
        blocks = [
            rigid_block(families, families.Psi_R, "rigid-body"),
            vibration_block("free", modes),
            _residual_block(families, modes),
        ]
        return mode_set("rubin", families, blocks, modes=modes, wanted=wanted)


def macneal(
    body: FEBody | Families,
    n_modes: int | ModeCount,
) -> ModeSet:
    """MacNeal's span, equal to that of `rubin`; his reduction only differs in the pencil (no residual inertia) [1]_.

    A floating frame needs the inertia of every shape, so residual inertia is kept here. `reduced_pencil.macneal_pencil`
    gives MacNeal's pencil for comparison.
    Errors are those of `rubin`.

    Parameters
    ----------
    body
        A coupled body with at least one interface, or its `Families`, which several sets can share.
    n_modes
        Number of elastic free modes, or a `ModeCount`, as for `normal_modes`.

    References
    ----------
    .. [1] MacNeal (1971), docs/bibliography.md; derived in docs/theory.md §3.
    """
    modes = rubin(body, n_modes)
    return replace(modes, name="macneal", options={**modes.options, "span": "of rubin, with residual inertia"})


def dual_craig_bampton(
    body: FEBody | Families,
    n_modes: int | ModeCount,
) -> ModeSet:
    """Dual Craig-Bampton span, equal to that of `rubin`; the dual method differs in its unknown interface forces [1]_.

    A floating frame needs displacements. `reduced_pencil.dual_craig_bampton_pencil` gives the dual pencil for
    comparison.
    Errors are those of `rubin`.

    Parameters
    ----------
    body
        A coupled body with at least one interface, or its `Families`, which several sets can share.
    n_modes
        Number of elastic free modes, or a `ModeCount`, as for `normal_modes`.

    References
    ----------
    .. [1] Rixen (2004), docs/bibliography.md; derived in docs/theory.md §3.
    """
    modes = rubin(body, n_modes)
    return replace(modes, name="dual-craig-bampton", options={**modes.options, "span": "of rubin, in displacements"})


def craig_chang(
    body: FEBody | Families,
    n_modes: int | ModeCount,
) -> ModeSet:
    """Craig-Chang mode set: Rubin's span in physical interface coordinates [1]_.

    u = Phi q + Psi_d f with rigid-body and free modes Phi and residual attachment modes Psi_d. On the boundary, u_B =
    Phi_B q + G_d f, hence f = G_d⁻¹ (u_B - Phi_B q). The columns are

    (1) interface columns Psi_d G_d⁻¹: unit displacement of one boundary dof
    (2) free columns Phi - Psi_d G_d⁻¹ Phi_B, which vanish on the boundary

    If so many modes are kept that G_d is singular, its pseudo-inverse is used. Nothing is lost, because a force without
    residual displacement at the interfaces has none anywhere.
    Errors are those of `rubin`.

    Parameters
    ----------
    body
        A coupled body with at least one interface, or its `Families`, which several sets can share.
    n_modes
        Number of elastic free modes, or a `ModeCount`, as for `normal_modes`.

    References
    ----------
    .. [1] Craig & Chang (1976), Craig & Chang (1977), docs/bibliography.md; derived in docs/theory.md §3.
    """
    with families_of(body) as families:
        body, wanted = families.body, mode_count(n_modes)
        require_interfaces("craig_chang", body)
        modes = _free_modes("craig_chang", families, wanted)
        residual, b = families.residual_attachment(modes), body.b
        interface = combine(residual, _pseudo_inverse(residual[b]))
        rigid, free = rigid_block(families, families.Psi_R, "rigid-body"), vibration_block("free", modes)
        blocks = [
            boundary_block(body, interface, "residual interface"),
            replace(rigid, columns=rigid.columns - combine(interface, rigid.columns[b])),
            replace(free, columns=free.columns - combine(interface, free.columns[b])),
        ]
        return mode_set("craig-chang", families, blocks, modes=modes, wanted=wanted)


def herting(
    body: FEBody | Families,
    n_modes: int | ModeCount,
) -> ModeSet:
    """Herting mode set: [Psi_C, Psi_H, phi - Psi_C phi_B] with free modes phi [1]_.

    The set is statically complete like Craig-Bampton with inertia relief, and also contains the exact modes of the free
    body.
    Errors are those of `rubin`.

    Parameters
    ----------
    body
        A coupled body with at least one interface, or its `Families`, which several sets can share.
    n_modes
        Number of elastic free modes, or a `ModeCount`, as for `normal_modes`.

    References
    ----------
    .. [1] Herting (1985), docs/bibliography.md; derived in docs/theory.md §3.
    """
    with families_of(body) as families:
        body, wanted = families.body, mode_count(n_modes)
        require_interfaces("herting", body)
        modes = _free_modes("herting", families, wanted)
        blocks = [
            constraint_block(families),
            rigid_block(families, families.Psi_H, "inertia-relief"),
            vibration_block("free", modes, families.without_boundary(modes.Phi)),
        ]
        return mode_set("herting", families, blocks, modes=modes, wanted=wanted)


def _free_modes(name: str, families: Families, wanted: ModeCount) -> EigenResult:
    return checked_modes(name, "elastic free", families.free_modes, families.body, wanted)


def _residual_block(families: Families, modes: EigenResult) -> Block:
    return boundary_block(families.body, families.residual_attachment(modes), "residual attachment")


def _pseudo_inverse(G: Array) -> Array:
    """Return the pseudo-inverse of a symmetric positive semidefinite matrix, scaled by its diagonal."""
    diagonal = np.diag(G)
    size = 1 / np.sqrt(np.where(diagonal > 0, diagonal, 1.0))
    scaled = G * np.outer(size, size)
    values, vectors = la.eigh((scaled + scaled.T) / 2)
    kept = values > DEPENDENT * values[-1]
    half = size[:, None] * vectors[:, kept] / np.sqrt(values[kept])
    # a zero diagonal entry has a zero row, also in the inverse, so that rounding does not become a shape
    half[diagonal <= 0] = 0.0
    return half @ half.T
