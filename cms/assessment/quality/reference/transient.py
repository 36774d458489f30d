"""Reference motions of the full model under given load histories: deformations over time to assess mode sets.

(1) modes of the body, free or with fixed interfaces, up to a cut-off; static response G f of the loads and G M G f
(2) Rayleigh-Ritz in their span
(3) exact integration of each mode, q'' + 2 zeta omega q' + omega² q = p(t), with p linear between the given times:

    [q, q', p, p'] is a linear system without input over one step; its matrix exponential is the step.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Annotated

import numpy as np
import scipy.linalg as la

from cms.assessment.quality.errors import QualityError
from cms.assessment.quality.reference.ports import Ports
from cms.linear_algebra.solvers.mode_count import ModeCount
from cms.modes.families.families import Families
from cms.modes.families.flexibility import BoundaryConditions, Flexibility
from cms.reduction.basis.free_basis import FreeBasis, ritz_basis
from fe_models.body.fe_body import FEBody
from fe_models.body.rigid_motion import rigid_motion_of_dofs
from fe_models.foundation.arrays import Array
from fe_models.foundation.errors import ArgumentError
from fe_models.foundation.records import ArrayShape, checked_fields

__all__ = ["LoadHistory", "Snapshots", "interface_forces", "support_acceleration", "transient", "transient_in"]


NO_LOAD = 1e-10  #: relative difference of a load and the inertia forces that balance it, below which it is rounding


@dataclass(frozen=True, eq=False)
@checked_fields(ArgumentError, misfit=QualityError)
class LoadHistory:
    """Loads f(t) = F p(t); p is piecewise linear between the times."""

    F: Annotated[Array, ArrayShape(("n_dof", "n_loads"))]  #: load columns over the dofs [N]
    t: Annotated[Array, ArrayShape(("n_t",))]  #: ascending, evenly spaced times [time unit of the body]
    p: Annotated[Array, ArrayShape(("n_loads", "n_t"))]  #: load amplitudes

    def __post_init__(self) -> None:
        step = np.diff(self.t)
        if len(self.t) < 2 or not (step > 0).all() or np.ptp(step) > 1e-6 * step.max():
            raise QualityError("load history: expected two or more times, ascending and evenly spaced")

    def __add__(self, other: "LoadHistory") -> "LoadHistory":
        """Return the sum of both load histories; their times must agree."""
        if not np.array_equal(self.t, other.t):
            raise QualityError("load history: the loads that are added have different times")
        return LoadHistory(np.hstack([self.F, other.F]), self.t, np.vstack([self.p, other.p]))


@dataclass(frozen=True, eq=False)
@checked_fields(ArgumentError, misfit=QualityError)
class Snapshots:
    """Displacements u(t) = columns @ amplitudes over the dofs of the full model."""

    columns: Annotated[Array, ArrayShape(("n_dof", "k"))]  #: displacement columns
    amplitudes: Annotated[Array, ArrayShape(("k", "n_t"))]  #: amplitudes of the columns
    t: Annotated[Array, ArrayShape(("n_t",))]  #: times [time unit of the body]

    @classmethod
    def of_displacements(cls, u: Array, t: Array) -> "Snapshots":
        """Return snapshots of displacements that are given as one column for each time, (n_dof, n_t)."""
        return cls(u, np.eye(u.shape[1]), t)

    @property
    def u(self) -> Array:
        """Displacements at all times, (n_dof, n_t)."""
        return self.columns @ self.amplitudes


def interface_forces(body: FEBody, histories: Mapping[str, Array], t: Array) -> LoadHistory:
    """Return the load history of forces and moments on interfaces, mesh axes: name -> (6, n_t) [N, N m]."""
    ports = Ports.of_body(body, tuple(histories))
    return LoadHistory(ports.loads(), t, np.vstack([np.asarray(history) for history in histories.values()]))


def support_acceleration(body: FEBody, acceleration: Array, t: Array, *, origin: Array | None = None) -> LoadHistory:
    """Return the inertia load -M Psi_R a(t) for the small motion relative to an accelerating frame.

    Parameters
    ----------
    acceleration
        Acceleration of the point `origin` and angular acceleration, mesh axes, (6, n_t) [m/s², 1/s²].
    origin
        Reference point of the acceleration, (3,) [m]; by default the mesh origin.
    """
    Psi_R = rigid_motion_of_dofs(body.nodes, body.dofs, np.zeros(3) if origin is None else origin)
    return LoadHistory(-(body.M @ Psi_R), t, np.asarray(acceleration))


def transient(
    families: Families,
    load: LoadHistory,
    *,
    cutoff: float,
    held: Sequence[str] = (),
    damping: float = 0.0,
    is_preloaded: bool = False,
) -> Snapshots:
    """Integrate the full model under a load history, from rest: steps (1) to (3) of this module.

    The result is the deformation of a free body in mean axes, without its rigid motion, or the deformation of a body
    with fixed interfaces.

    Parameters
    ----------
    cutoff
        Modes up to this frequency respond dynamically, higher modes statically with a first inertia correction [Hz].
        Choose several times the highest frequency of the load.
    held
        Names of fixed interfaces.
    damping
        Damping ratio of every mode.
    is_preloaded
        Whether the motion starts in equilibrium with the first load instead of undeformed.

    Raises
    ------
    QualityError
        If the load does not deform the body, or the times are too far apart for the cut-off.
    """
    body = families.body
    if load.F.shape[0] != body.n_dof:
        raise QualityError(f"transient: loads over {load.F.shape[0]} dofs, body {body.name!r} has {body.n_dof}")
    if not cutoff > 0:
        raise QualityError(f"transient: cutoff = {cutoff}; expected a frequency above 0 [Hz]")
    basis = transient_basis(families, load.F, cutoff * body.units.time, held)
    return transient_in(basis, load, damping=damping, is_preloaded=is_preloaded)


def transient_in(basis: FreeBasis, load: LoadHistory, *, damping: float = 0.0, is_preloaded: bool = False) -> Snapshots:
    """Integrate a free body in the span of a mode set by step (3) alone: a reference with more modes, or a Guyan model.

    Parameters
    ----------
    basis
        Result of `free_basis` for the mode set.
    damping, is_preloaded
        As for `transient`.
    """
    if load.F.shape[0] != len(basis.Phi):
        raise QualityError(f"transient: loads over {load.F.shape[0]} dofs, the mode set has {len(basis.Phi)}")
    if not 0 <= damping < 1:
        raise QualityError(f"transient: damping = {damping}; expected 0 to below 1")
    p = (basis.Phi.T @ load.F) @ load.p
    q = modal_motion(basis, p, float(load.t[1] - load.t[0]), damping, is_preloaded=is_preloaded)
    return Snapshots(basis.Phi, q, load.t)


def transient_basis(families: Families, F: Array, cutoff: float, held: Sequence[str]) -> FreeBasis:
    """Return modes and static corrections under the given support: steps (1) and (2); cut-off in body units."""
    body = families.body
    flexibility: Flexibility
    if held:
        stays = np.concatenate([np.asarray(body.interface(name).dofs) for name in held])
        is_free = ~np.isin(families.h, stays)
        conditions = BoundaryConditions(np.eye(len(families.h))[:, is_free])
        flexibility = families.flexibility_under(conditions)
        modes = families.elastic_modes(conditions, n_modes=ModeCount(cutoff=cutoff))
    else:
        flexibility = families.free
        modes = families.free_modes(ModeCount(cutoff=cutoff))
    T = flexibility.T

    def solve(f: Array) -> Array:
        return flexibility.expand(flexibility.solve(f if T is None else T.T @ f))

    on_free = F if T is None else T.T @ F
    balanced = on_free - flexibility.M_N @ (flexibility.N.T @ on_free)
    if not np.linalg.norm(balanced) > NO_LOAD * np.linalg.norm(on_free):
        raise QualityError(f"transient: the load does not deform body {body.name!r}; hold an interface, or load one")
    static = solve(F)
    X = np.hstack([modes.Phi, static, solve(body.M @ static)])
    X = X[:, np.linalg.norm(X, axis=0) > 0]
    return ritz_basis(body, X, flexibility.expand(flexibility.N))


def modal_motion(basis: FreeBasis, p: Array, h: float, damping: float, *, is_preloaded: bool = False) -> Array:
    """Step (3): integrate modal coordinates under modal forces p that are linear over steps h, (n, n_t).

    Massless shapes respond statically.
    """
    q = p / basis.omega2[:, None]
    moving = np.flatnonzero(basis.is_massive)
    steps = (
        np.stack([oscillator_step(float(np.sqrt(basis.omega2[k])), damping, h) for k in moving])
        if len(moving)
        else None
    )
    if steps is None:
        return q
    P = q[moving].copy()  # static response p / omega²
    dP = np.diff(P, axis=1)
    now, rate = (P[:, 0].copy() if is_preloaded else np.zeros(len(moving))), np.zeros(len(moving))
    q[moving, 0] = now
    for n in range(P.shape[1] - 1):
        state = np.stack([now, rate, P[:, n], dP[:, n]], axis=1)
        now, rate = np.einsum("kab,kb->ak", steps, state)
        q[moving, n + 1] = now
    return q


def oscillator_step(omega: float, damping: float, h: float) -> Array:
    """Return the (2, 4) map from (q, q'/omega, P, dP) to (q, q'/omega) after a step; P = p / omega² grows by dP."""
    A = np.zeros((4, 4))
    A[0, 1] = omega
    A[1, :3] = -omega, -2 * damping * omega, omega
    A[2, 3] = 1 / h
    return np.asarray(la.expm(A * h)[:2])
