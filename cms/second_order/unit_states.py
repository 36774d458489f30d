"""Static states of the unit loads of a body: what its geometric stiffness needs of the factorisation (theory.md §7)."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import scipy.linalg as la

from cms.errors import BodyError
from cms.families.families import Families
from cms.families.sharing import body_of, families_of
from cms.reduced_basis.frames import Frame, FrameCondition, TisserandFrame, frame_condition
from cms.second_order.spread_loads import spread_forces
from cms.second_order.unit_loads import balanced, unit_loads
from cms.solvers.tall import combine
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
    """The balanced unit loads of a body in one frame, and the static response to those that load it."""

    body: FEBody
    condition: FrameCondition  #: the frame, which is the support of all loads
    mass: MassLoads  #: loads per mass, k
    on_dofs: Array  #: loads on the dofs of the body, (n_dof, k) [N, N m]
    loaded: IntArray  #: which of the k loads leave something, (n_loaded,)
    u: Array  #: their responses, up to a rigid motion, (n_dof, n_loaded)
    spread: Array | None = None  #: the last six loads before they were balanced, (n_dof, 6); None: left out
    is_loaded: tuple[bool, ...] = ()  #: for each interface whether its loads are among them; empty: all are

    @property
    def names(self) -> list[str]:
        """Interfaces whose loads are among them."""
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

    Made while the factorisation of the mode set is there, they let it be freed before the reduction, which then needs
    the memory for itself: that matters from some hundred thousand dofs on.

    Parameters
    ----------
    body
        A coupled body with an element model, or its `Families`.
    frame
        Body reference frame of the reduction; Tisserand (mean axis) by default.
    spread
        Whether the six loads spread over the nodes are among them, without which the geometric stiffness cannot be
        carried to a Buckens frame.
    interfaces
        Names of those whose loads are among them, for a body with very many: loads at the others then do not stiffen
        it, wherever they come from; None: all.

    Raises
    ------
    BodyError
        If the body has no element model that knows its geometric stiffness, or the frame cannot be attached, or an
        interface is unknown.
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
    """Return the static states for a frame made ready."""
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
    """Return for each interface whether it is among these names, all for None; `BodyError` for an unknown one."""
    known = [interface.name for interface in body.interfaces]
    for name in names or ():
        if name not in known:
            raise BodyError(
                f"body {body.name!r}: geometric stiffness: no interface {quoted(name)}{nearest(name, known)}"
            )
    return tuple(names is None or name in names for name in known)


def has_geometric_stiffness(body: FEBody) -> bool:
    """Return whether the elements behind the body know their geometric stiffness."""
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
    """Return the response to balanced loads with R held, (n_dof, k); it needs no inertia, as P would.

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
        S_ee = families.S[np.ix_(e, e)]
        size = 1 / np.sqrt(np.where(np.diag(S_ee) > 0, np.diag(S_ee), 1.0))
        try:
            factor = la.cho_factor(S_ee * np.outer(size, size))
        except la.LinAlgError as error:
            raise BodyError(
                f"body {body.name!r}: motions besides the rigid ones cost no energy: a mechanism; join the parts or "
                "add what holds them"
            ) from error
        z[e] = size[:, None] * la.cho_solve(factor, size[:, None] * g[e])
    u = of_this_process(combine(families.Psi_C, z))
    u[i] += v
    return u


def embedded(v: Array, rows: IntArray, n: int) -> Array:
    """Return v in some rows of n, zero in the others."""
    whole = np.zeros((n, v.shape[1]))
    whole[rows] = v
    return whole
