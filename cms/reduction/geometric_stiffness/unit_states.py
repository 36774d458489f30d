"""Static states of the unit loads of a body: the part of its geometric stiffness that needs the factorisation."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import scipy.linalg as la

from cms.errors import BodyError
from cms.linear_algebra.solvers.tall import combine
from cms.modes.families.families import Families, body_of, families_of
from cms.modes.families.flexibility import held_factor
from cms.reduction.basis.frames import Frame, FrameCondition, TisserandFrame, frame_condition
from cms.reduction.geometric_stiffness.unit_loads import balanced, spread_forces, unit_loads
from fe_models.body.fe_body import FEBody
from fe_models.body.mass_loads import MassLoads
from fe_models.foundation.arrays import Array, IntArray
from fe_models.foundation.tall.on_disk import of_this_process
from fe_models.foundation.words import nearest, quoted

__all__ = [
    "UnitStates", "has_geometric_stiffness", "loaded_interfaces", "require_geometric_stiffness", "states_of",
    "unit_states",
]  # fmt: skip


@dataclass(frozen=True, eq=False)
class UnitStates:
    """The balanced unit loads of a body in one frame, and the static responses to them."""

    body: FEBody
    condition: FrameCondition  #: the frame condition, which is also the support of all loads
    mass: MassLoads  #: k loads per unit mass
    on_dofs: Array  #: loads on the dofs of the body, (n_dof, k) [N, N m]
    loaded: IntArray  #: indices of the loads that are not zero, (n_loaded,)
    u: Array  #: responses to the loaded ones, up to a rigid motion, (n_dof, n_loaded)
    spread: Array | None = None  #: the last six loads before balancing, (n_dof, 6); None: not needed
    is_loaded: tuple[bool, ...] = ()  #: for each interface, whether its loads are included; empty: all are

    @property
    def names(self) -> list[str]:
        """Names of the interfaces whose loads are included."""
        chosen = self.is_loaded or (True,) * len(self.body.interfaces)
        return [each.name for each, is_chosen in zip(self.body.interfaces, chosen, strict=True) if is_chosen]


def unit_states(
    body: FEBody | Families,
    *,
    frame: Frame | None = None,
    spread: bool = True,
    interfaces: Sequence[str] | None = None,
) -> UnitStates:
    """Return the static states of the unit loads of a body in a frame, for `reduce(..., geometric=states)`.

    They are computed while the factorisation of the mode set exists, which can then be freed before the reduction needs
    the memory. This matters from several hundred thousand dofs on.

    Parameters
    ----------
    body
        A coupled body with an element model, or its `Families`.
    frame
        Body reference frame of the reduction; default: Tisserand (mean axis).
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
    require_geometric_stiffness(body_of(body))
    condition = frame_condition(body_of(body), frame or TisserandFrame())
    return states_of(body, condition, spread=spread, interfaces=interfaces)


def states_of(
    source: FEBody | Families,
    condition: FrameCondition,
    *,
    spread: bool = True,
    interfaces: Sequence[str] | None = None,
) -> UnitStates:
    """Return the static states for an evaluated frame condition."""
    body = body_of(source)
    require_geometric_stiffness(body)
    is_loaded = loaded_interfaces(body, interfaces)
    forces = spread_forces(body, condition.frame) if spread else None
    with families_of(source) as families:
        loads = balanced(body, unit_loads(body, condition.frame, forces, is_loaded), condition)
        loaded = np.flatnonzero(~loads.is_zero)
        u = static_states(families, loads.F[:, loaded])
    return UnitStates(body, condition, loads.mass, loads.on_dofs, loaded, u, forces, is_loaded)


def loaded_interfaces(body: FEBody, names: Sequence[str] | None) -> tuple[bool, ...]:
    """Return for each interface whether it is among these names (None: all); raise `BodyError` for an unknown name."""
    known = [interface.name for interface in body.interfaces]
    for name in names or ():
        if name not in known:
            raise BodyError(
                f"body {body.name!r}: geometric stiffness: no interface {quoted(name)}{nearest(name, known)}"
            )
    return tuple(names is None or name in names for name in known)


def has_geometric_stiffness(body: FEBody) -> bool:
    """Return whether the elements of the body know their geometric stiffness."""
    return not body.is_held and body.element_model is not None and body.element_model.has_geometric_stiffness


def require_geometric_stiffness(body: FEBody) -> None:
    """Raise `BodyError` unless the elements know their geometric stiffness."""
    if not has_geometric_stiffness(body):
        raise BodyError(
            f"body {body.name!r}: geometric stiffness needs the elements, and it came without them (bare matrices); "
            "build it from its mesh (fe_models.solid_body, beam_body), or reduce it without (geometric=False, in a job "
            "geometric_stiffness = false)"
        )


def static_states(families: Families, F: Array) -> Array:
    """Return the response to balanced loads with R held, (n_dof, k). Unlike P, this needs no inertia.

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
        g = F[h] - (body.K[:, h].T @ embedded(v, i, body.n_dof))
        size, factor = held_factor(families.condensed, np.eye(len(h)), families.S, e)
        z[e] = size[:, None] * la.cho_solve(factor, size[:, None] * g[e])
    u = of_this_process(combine(families.Psi_C, z))
    u[i] += v
    return u


def embedded(v: Array, rows: IntArray, n: int) -> Array:
    """Return v in some rows of an array with n rows, zero in the others."""
    whole = np.zeros((n, v.shape[1]))
    whole[rows] = v
    return whole
