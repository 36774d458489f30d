"""Unit loads of a body, balanced by the frame reaction, and their static states (theory.md §7).

Loads per unit mass, about the origin and along the axes of the frame B: -e_a for the acceleration of the origin, -e_a ×
c for the angular acceleration, -½ [e_a × (e_b × c) + e_b × (e_a × c)] for products of angular velocities. Then a unit
force and a unit moment at every interface, or at chosen interfaces. Optionally, six loads distributed over the nodes.
All are balanced by the same support, W Psi_R of the frame condition. Their static states are the
part of the geometric stiffness that needs the factorisation.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import scipy.linalg as la

from cms.body.geometric_stiffness import SPIN_PAIRS
from cms.body.reduced_body import BodyFrame
from cms.errors import BodyError
from cms.modes.families.families import Families, body_of, families_of
from cms.modes.families.fixed_interface import held_factor
from cms.reduction.basis.frames import Frame, FrameCondition, HeldFrame, TisserandFrame, frame_condition
from cms.reduction.basis.node_results import node_weights, reference_motion, weighted_rigid_modes
from fe_models.body.fe_body import FEBody, Interface
from fe_models.body.rigid_motion import MassLoads, rigid_motion_of_dofs
from fe_models.foundation.arrays import Array, IntArray
from fe_models.foundation.presentation import presented
from fe_models.foundation.tall.columns import combine, of_this_process

__all__ = [
    "UnitLoads", "UnitStates", "balanced", "has_geometric_stiffness",
    "require_geometric_stiffness", "turned_rigid_work", "unit_loads", "unit_mass_loads",
    "unit_states",
]  # fmt: skip


#: size of a balanced load relative to the original load, below which the support carries all of it
BALANCED = 1e-10


@dataclass(frozen=True, eq=False)
class UnitLoads:
    """Loads per unit mass and loads on dofs; load j has a part of each kind."""

    mass: MassLoads  #: k loads per unit mass
    on_dofs: Array  #: over the dofs of the body, (n_dof, k) [N, N m]
    F: Array  #: total load on the dofs of the body, (n_dof, k)
    is_zero: np.ndarray  #: whether the balanced load is zero, (k,) bool


def unit_loads(
    body: FEBody, frame: BodyFrame, interfaces: Sequence[Interface], spread: Array | None = None
) -> UnitLoads:
    """Return the 12 loads per unit mass, then six for each given interface, then the distributed loads, (n_dof, 6)."""
    turn = np.kron(np.eye(2), frame.axes)
    columns = [reference_motion(body, interface).rows.T @ turn for interface in interfaces]
    on_dofs = np.hstack([np.zeros((body.n_dof, 12)), *columns, *([] if spread is None else [spread])])
    return together(body, unit_mass_loads(frame, on_dofs.shape[1] - 12), on_dofs)


def unit_mass_loads(frame: BodyFrame, n_more: int = 0) -> MassLoads:
    """Return the 12 loads per unit mass of a frame: 3 translations, 3 rotations, 6 products as in `SPIN_PAIRS`.

    `n_more` loads of zero follow, for loads that do not act on the mass.
    """
    e = frame.axes.T  # e[a] is axis a of B
    A, b = np.zeros((12 + n_more, 3, 3)), np.zeros((12 + n_more, 3))
    b[:3] = -e
    for a in range(3):
        A[3 + a] = -np.cross(e[a], np.eye(3)).T
    for j, (p, q) in enumerate(SPIN_PAIRS):
        A[6 + j] = float(p == q) * np.eye(3) - (np.outer(e[p], e[q]) + np.outer(e[q], e[p])) / 2
    b[3:] = -A[3:] @ frame.origin
    return MassLoads(A, b)


def balanced(body: FEBody, loads: UnitLoads, condition: FrameCondition) -> UnitLoads:
    """Return P f = f - W Psi_R (Psi_Rᵀ W Psi_R)⁻¹ Psi_Rᵀ f: each load with the reaction of the support.

    If the support is the mass itself (Tisserand frame), the reaction is the load of a rigid-body acceleration.
    """
    amounts = np.asarray(np.linalg.solve(condition.Psi_R.T @ condition.W, condition.Psi_R.T @ loads.F), np.float64)
    if condition.frame.kind == "tisserand":
        after = together(body, loads.mass.plus_rigid(-amounts, condition.center), loads.on_dofs)
    else:
        after = together(body, loads.mass, loads.on_dofs - condition.W @ amounts)
    is_zero = np.abs(after.F).max(axis=0) <= BALANCED * np.abs(loads.F).max(axis=0)
    # a load per unit mass may load sections even if its nodal forces vanish: take its size at the nodes, and A × length
    remainder, size = (
        np.abs(mass.at(body.nodes)).max(axis=(0, 1)) + np.abs(mass.A).max(axis=(1, 2)) * body.length
        for mass in (after.mass, loads.mass)
    )
    return UnitLoads(after.mass, after.on_dofs, after.F, is_zero & (remainder <= BALANCED * size))


def together(body: FEBody, mass: MassLoads, on_dofs: Array) -> UnitLoads:
    """Combine loads per unit mass and loads on dofs, and compute their sum over the dofs of the body."""
    assert body.element_model is not None
    on_mesh = body.element_model.mass_forces(mass)
    F = on_dofs + (on_mesh if body.recovery is None else body.recovery.matrix.T @ on_mesh)
    return UnitLoads(mass, on_dofs, F, np.asarray(~F.any(axis=0)))


def turned_rigid_work(body: FEBody, forces: Array, frame: BodyFrame) -> Array:
    """Return the work of loads, rotated about the axes of B, on the rotations about its axes and origin, (k, 3, 3).

    At a node, e_x × f does work on the translation, and ½ e_x × m on the rotation.

    Parameters
    ----------
    forces
        Loads over the dofs of the body, (n_dof, k) [N, N m].
    """
    node, component = body.dofs.T
    own = np.flatnonzero(component >= 0)
    by_node = np.zeros((len(body.nodes), 2, 3, forces.shape[1]))
    by_node[node[own], component[own] // 3, component[own] % 3] = forces[own]
    by_node[:, 1] /= 2
    rotations = rigid_motion_of_dofs(body.nodes, body.dofs, frame.origin)[own, 3:] @ frame.axes
    work = np.empty((forces.shape[1], 3, 3))
    for x, axis in enumerate(frame.axes.T):
        turned = np.cross(axis[:, None], by_node, axisa=0, axisb=2, axisc=2)
        work[:, x] = turned[node[own], component[own] // 3, component[own] % 3].T @ rotations
    return work


# static states of the unit loads, the part of the geometric stiffness that needs the factorisation --------------------


@presented
@dataclass(frozen=True, eq=False)
class UnitStates:
    """The balanced unit loads of a body in one frame, and the static responses to them."""

    body: FEBody
    condition: FrameCondition  #: the frame condition, which is also the support of all loads
    mass: MassLoads  #: k loads per unit mass
    on_dofs: Array  #: loads on the dofs of the body, (n_dof, k) [N, N m]
    loaded: IntArray  #: indices of the nonzero loads, (n_loaded,)
    u: Array  #: response to each nonzero load, up to a rigid motion, (n_dof, n_loaded)
    #: the last six loads before balancing, (w_i/w) e_a and (w_i/w) e_a × c_i over the nodes, axes and origin of B,
    #: (n_dof, 6); None: not requested, or there is no Buckens frame
    spread: Array | None
    interfaces: tuple[Interface, ...]  #: interfaces whose unit wrenches are included


def unit_states(
    source: FEBody | Families,
    *,
    frame: Frame | HeldFrame | FrameCondition | None = None,
    spread: bool = True,
    interfaces: Sequence[str] | None = None,
) -> UnitStates:
    """Return the static states of the unit loads of a body in a frame, as input of `reduce(..., geometric=states)`.

    Compute them while the factorisation of the mode set exists; it can then be freed before the reduction needs the
    memory. This matters from several hundred thousand dofs on.

    Parameters
    ----------
    source
        A coupled body with an element model, or its `Families`.
    frame
        Body reference frame of the reduction, or its condition on this body; default: Tisserand (mean axis).
    spread
        Whether to include the six loads distributed over the nodes. Without them the geometric stiffness cannot be
        converted to a Buckens frame.
    interfaces
        Names of the interfaces whose loads are included, for a body with very many interfaces; loads at the others then
        do not stiffen it. None: all interfaces.

    Raises
    ------
    BodyError
        If the body has no element model with geometric stiffness, the frame cannot be attached, or an interface is
        unknown.
    """
    body = body_of(source)
    require_geometric_stiffness(body)
    condition = frame if isinstance(frame, FrameCondition) else frame_condition(body, frame or TisserandFrame())
    named = body.interfaces if interfaces is None else [body.interface(name) for name in interfaces]
    loaded_ones = tuple(interface for interface in body.interfaces if interface in named)
    W_Psi_R = weighted_rigid_modes(body, condition.frame.origin) if spread else None
    forces = None
    if W_Psi_R is not None:
        forces = np.asarray(W_Psi_R @ np.kron(np.eye(2), condition.frame.axes) / node_weights(body).sum())
    with families_of(source) as families:
        loads = balanced(body, unit_loads(body, condition.frame, loaded_ones, forces), condition)
        loaded = np.flatnonzero(~loads.is_zero)
        u = static_states(families, loads.F[:, loaded])
    return UnitStates(body, condition, loads.mass, loads.on_dofs, loaded, u, forces, loaded_ones)


def has_geometric_stiffness(body: FEBody) -> bool:
    """Return whether all elements of the body can compute their geometric stiffness."""
    return not body.is_held and body.element_model is not None and body.element_model.has_geometric_stiffness


def require_geometric_stiffness(body: FEBody) -> None:
    """Raise `BodyError` unless the elements can compute their geometric stiffness."""
    if not has_geometric_stiffness(body):
        raise BodyError(
            f"body {body.name!r}: geometric stiffness needs the elements, but the body has none (bare matrices); "
            "build it from its mesh (fe_models.solid_body, beam_body), or reduce it without (geometric=False, in a job "
            "geometric_stiffness = false)"
        )


def static_states(families: Families, F: Array) -> Array:
    """Return the response to balanced loads with the dofs R fixed, (n_dof, k). Unlike P, this needs no inertia.

    v = K_II⁻¹ f_I;  S_ee z_e = (f_h - K_hI v)_e with z = 0 at R;  u = v + Psi_C z.
    """
    body = families.body
    if not F.shape[1]:
        return np.zeros(F.shape)
    i, h = families.fixed.i, families.h
    v = families.fixed.factorization.solve(F[i])
    z = np.zeros((len(h), F.shape[1]))
    e = np.flatnonzero(~np.isin(h, families.r))
    if len(e):
        u_i = np.zeros(F.shape)
        u_i[i] = v
        g = F[h] - (body.K[:, h].T @ u_i)
        size, factor = held_factor(families.condensed, np.eye(len(h)), families.S, e)
        z[e] = size[:, None] * la.cho_solve(factor, size[:, None] * g[e])
    u = of_this_process(combine(families.Psi_C, z))
    u[i] += v
    return u
