"""The classical mode sets: Craig-Bampton and its variants, attachment sets, Benfield-Hruda."""

from collections.abc import Mapping, Sequence

import numpy as np
import scipy.linalg as la

from cms.errors import BodyError, ModeSetError
from cms.linear_algebra.solvers.eigen import EigenResult
from cms.linear_algebra.solvers.mode_count import ModeCount, mode_count
from cms.modes.families.families import Families, families_of
from cms.modes.families.flexibility import BoundaryConditions
from cms.modes.families.interface_loads import InterfaceLoad, boundary_load
from cms.modes.families.static_modes import boundary_names
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
from fe_models.body.fe_body import FEBody, Interface
from fe_models.foundation.arrays import MOTION_COMPONENTS, Array
from fe_models.foundation.words import nearest, quoted

__all__ = [
    "attachment",
    "benfield_hruda",
    "craig_bampton",
    "craig_bampton_ir",
    "free_directions",
    "guyan",
    "unrestrained_attachment",
]


# attachment sets: responses to unit interface forces, rigid-body modes and vibration modes ----------------------------


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
        names = boundary_names(body, "attachment")
        labels, groups = (np.array(each, dtype=object)[families.free.e] for each in names)
        blocks = [
            rigid_block(families, families.Psi_R, "rigid-body"),
            Block(families.Psi_A, labels.tolist(), groups.tolist()),
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
    acceleration.
    Errors are those of `attachment`.

    Parameters
    ----------
    body
        A coupled body with at least one interface, or its `Families`, which several sets can share.
    n_modes
        Number of elastic modes of the free body, or a `ModeCount`, as for `attachment`.
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
            rigid_block(families, families.Psi_R, "rigid-body"),
            boundary_block(body, families.Psi_U, "unrestrained attachment"),
            vibration_block("free", modes),
        ]
        return mode_set("unrestrained-attachment", families, blocks, modes=modes, wanted=wanted)


def held_words(families: Families) -> list[str]:
    """Return the names of the determinate dofs."""
    labels = families.held_names("held")[0]
    return [label for dof, label in zip(families.h.tolist(), labels, strict=True) if dof in families.r]


# Benfield-Hruda: constraint modes, and modes of the body with mass and stiffness of its neighbours --------------------


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


# craig bampton --------------------------------------------------------------------------------------------------------


# mixed boundary -------------------------------------------------------------------------------------------------------
# Mixed boundary conditions: some interface dofs are free while the other boundary dofs are held (theory.md §3).


def free_directions(body: FEBody, free: Mapping[str, Sequence[str]]) -> Array:
    """Return the boundary directions that stay free in the fixed-interface problem, orthonormal, (n_b, k).

    Parameters
    ----------
    body
        A coupled body.
    free
        For each interface its free components ux uy uz rx ry rz along the interface axes, such as {"pin": ["rz"]}. At
        an interface of kind "nodes" they apply to every node.

    Raises
    ------
    BodyError
        If an interface or component is unknown, or the interface has no such dof.
    """
    for name in free:
        body.interface(name)
    columns = []
    first = 0
    for interface in body.interfaces:
        dofs = np.asarray(interface.dofs)
        for component in free.get(interface.name, ()):
            directions = _directions(body, interface, component)
            placed = np.zeros((len(body.b), directions.shape[1]))
            placed[first : first + len(dofs)] = directions
            columns.append(placed)
        if len(set(free.get(interface.name, ()))) != len(free.get(interface.name, ())):
            raise BodyError(f"body {body.name!r}: free dofs of interface {interface.name!r}: one is listed twice")
        first += len(dofs)
    return np.hstack(columns) if columns else np.zeros((len(body.b), 0))


def _directions(body: FEBody, interface: Interface, component: str) -> Array:
    """Return one component at each node of an interface as columns over the interface dofs, (n_dofs, n_nodes)."""
    where = f"body {body.name!r}: free dofs of interface {interface.name!r}"
    if component not in MOTION_COMPONENTS:
        raise BodyError(f"{where}: unknown component {quoted(component)}{nearest(component, MOTION_COMPONENTS)}")
    axis = la.block_diag(interface.triad, interface.triad)[:, MOTION_COMPONENTS.index(component)]
    node, local = body.dofs[np.asarray(interface.dofs)].T
    nodes = list(dict.fromkeys(node.tolist()))
    directions = np.zeros((len(node), len(nodes)))
    directions[np.arange(len(node)), [nodes.index(n) for n in node.tolist()]] = axis[local]
    if np.abs(np.linalg.norm(directions, axis=0) - 1).max() > 1e-9:
        raise BodyError(f"{where}: it has no dof {component} along its axes, so this component cannot be released")
    return directions


# craig bampton --------------------------------------------------------------------------------------------------------


def craig_bampton(
    body: FEBody | Families,
    n_modes: int | ModeCount,
    *,
    free: Mapping[str, Sequence[str]] | None = None,
) -> ModeSet:
    """Craig-Bampton mode set: [Psi_C, fixed-interface modes] [1]_.

    (1) Psi_C: constraint modes, with interior part -K_II⁻¹ K_IB
    (2) K_II phi = omega² M_II phi, all boundary dofs held
    (3) with free boundary dofs: modes phi with the other boundary dofs held, as columns phi - Psi_C phi_B

    Parameters
    ----------
    body
        A coupled body with at least one interface, or its `Families`, which several sets can share.
    n_modes
        Number of fixed-interface modes; 0 gives Guyan-Irons. A `ModeCount` gives a cutoff frequency instead, and
        whether to prove that no mode was missed.
    free
        Mixed boundary conditions: for each interface the components along its axes that step (2) leaves free, such as
        {"pin": ["rz"]} for a bearing. These dofs keep their constraint modes.

    Raises
    ------
    ModeSetError
        If there are fewer interior dofs than modes, or no mode lies below the cutoff.
    BodyError
        If the body is a mechanism with its interfaces held.

    References
    ----------
    .. [1] Hurty (1965), Craig & Bampton (1968), docs/bibliography.md; derived in docs/theory.md §2-3.
    """
    with families_of(body) as families:
        body, wanted = families.body, mode_count(n_modes)
        require_interfaces("craig_bampton", body)
        block, modes, options = _held_modes("craig_bampton", families, wanted, free or {})
        blocks = [constraint_block(families), block]
        return mode_set("craig-bampton", families, blocks, modes=modes, wanted=wanted, options=options)


def craig_bampton_ir(
    body: FEBody | Families,
    n_modes: int | ModeCount,
    *,
    free: Mapping[str, Sequence[str]] | None = None,
) -> ModeSet:
    """Craig-Bampton with inertia relief: [Psi_C, Psi_H, fixed-interface modes] [1]_.

    Psi_H holds the static responses to rigid-body accelerations with the boundary dofs B held. They make the set
    statically complete: exact for gravity and for every static interface load of the accelerated body, for any number
    of modes.
    Errors are those of `craig_bampton`.

    Parameters
    ----------
    body
        A coupled body with at least one interface, or its `Families`, which several sets can share.
    n_modes
        Number of fixed-interface modes. A `ModeCount` gives a cutoff frequency instead, and whether to prove that no
        mode was missed.
    free
        Mixed boundary conditions of the vibration modes, as for `craig_bampton`.

    References
    ----------
    .. [1] Hintz (1975), docs/bibliography.md; derived in docs/theory.md §2.
    """
    with families_of(body) as families:
        body, wanted = families.body, mode_count(n_modes)
        require_interfaces("craig_bampton_ir", body)
        block, modes, options = _held_modes("craig_bampton_ir", families, wanted, free or {})
        blocks = [constraint_block(families), rigid_block(families, families.Psi_H, "inertia-relief"), block]
        return mode_set("craig-bampton-ir", families, blocks, modes=modes, wanted=wanted, options=options)


def guyan(body: FEBody | Families) -> ModeSet:
    """Guyan-Irons static condensation: constraint modes only (Craig-Bampton with n_modes = 0) [1]_.

    Parameters
    ----------
    body
        A coupled body with at least one interface, or its `Families`, which several sets can share.

    References
    ----------
    .. [1] Guyan (1965), docs/bibliography.md.
    """
    with families_of(body) as families:
        body = families.body
        require_interfaces("guyan", body)
        return mode_set("guyan", families, [constraint_block(families)])


def _held_modes(
    name: str,
    families: Families,
    wanted: ModeCount,
    free: Mapping[str, Sequence[str]],
) -> tuple[Block, EigenResult, dict[str, str]]:
    """Return fixed-interface modes; if some dofs of B are free, their modes minus the constraint-mode part.

    The result also contains the block of columns and the options to record (the free dofs, if any).
    """
    body = families.body
    directions = free_directions(body, free) if free else np.zeros((len(body.b), 0))
    if not directions.shape[1]:
        modes = checked_modes(name, "fixed-interface", families.fixed_modes, body, wanted)
        columns = modes.Phi if len(families.h) == len(body.b) else families.without_boundary(modes.Phi)
        return vibration_block("fixed-interface", modes, columns), modes, {}
    n_b, n_h = len(body.b), len(families.h)
    Z = np.zeros((n_h, directions.shape[1] + n_h - n_b))
    Z[:n_b, : directions.shape[1]] = directions
    Z[n_b:, directions.shape[1] :] = np.eye(n_h - n_b)
    modes = checked_modes(
        name,
        "mixed-interface",
        lambda asked: families.elastic_modes(BoundaryConditions(Z), asked),
        body,
        wanted,
    )
    words = "; ".join(f"{name} {' '.join(components)}" for name, components in free.items() if components)
    columns = families.without_boundary(modes.Phi)
    return vibration_block("mixed-interface", modes, columns), modes, {"free": words}
