"""Errors of mode sets of one body relative to its full model, over the number of modes and over time.

(1) the full model moves in the system (`suspended_motion`), once for each system
(2) each set with each number of modes is reduced in mean axes, put into the systems and run with the same steps
(3) errors of deformation (`BodyReference`), of stress at named places and of the forces of the bushings on the body
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np
import scipy.linalg as la
import scipy.sparse as sp

from cms.errors import CmsError
from cms.modes.families.families import Families
from cms.modes.mode_set import ModeSet
from cms.reduction.basis.damping import RayleighDamping
from cms.reduction.basis.finishing import finish
from cms.reduction.basis.frames import TisserandFrame, frame_condition
from cms.reduction.reduction import reduce
from fe_models.body.fe_body import FEBody
from fe_models.body.rigid_motion import rigid_motion_of_dofs
from fe_models.elements.shells.shell_points import ShellPoints
from fe_models.foundation.arrays import Array
from fe_models.foundation.errors import ReportedError
from fe_models.meshes.numbering import Numbering
from floatframe.design.laboratory.substitution import with_body
from floatframe.design.laboratory.suspended_body import SuspendedMotion, suspended_motion
from floatframe.errors import ModelError
from floatframe.integrators.generalized_alpha import GeneralizedAlpha
from floatframe.model.bodies.flexible_body import FlexibleBody
from floatframe.model.bodies.markers import Marker, body_name
from floatframe.model.forces import Bushing
from floatframe.model.rotations import rotation_matrix
from floatframe.model.system import System
from floatframe.results.trajectory import Trajectory
from floatframe.simulation.integrate import integrate

__all__ = [
    "BodyErrors",
    "BodyReference",
    "Loading",
    "SetError",
    "body_study",
    "full_motions",
    "lean_body",
    "stress_rows",
]


# body errors ----------------------------------------------------------------------------------------------------------
# Difference between the deformation of a reduced body and of the full model, over the whole body and over time.
#
# The rigid part of both is removed, u - N Nᵀ M u (mean axes), so that body frames and small rigid motions have no
# effect. With e(t) the difference,
#
#     epsilon_M(t) = |e|_M / max |u_full|_M     displacement, weighted by mass
#     epsilon_K(t) = |e|_K / max |u_full|_K     strain energy, which measures errors of stress
#
# where |x|_A² = xᵀ A x, and the maximum is over the whole motion of the full model.


@dataclass(frozen=True, eq=False)
class BodyErrors:
    """Errors over time, relative to the largest values of the full model."""

    t: Array  #: (n_t,) [s]
    mass: Array  #: epsilon_M, (n_t,)
    energy: Array  #: epsilon_K, (n_t,)

    @property
    def largest(self) -> tuple[float, float]:
        """The largest epsilon_M and epsilon_K."""
        return float(self.mass.max()), float(self.energy.max())


@dataclass(frozen=True, eq=False)
class BodyReference:
    """Deformation of the full model.

    Raises
    ------
    ModelError
        If the displacements do not fit the body and the times, or are rigid throughout.
    """

    body: FEBody
    t: Array  #: (n_t,) [s]
    u: Array  #: displacement over the dofs, mesh axes, (n_dof, n_t)
    elastic: Array = field(init=False)  #: displacement in mean axes, (n_dof, n_t)
    greatest: tuple[float, float] = field(init=False)  #: max |u|_M [kg^1/2 m], max |u|_K [J^1/2]

    def __post_init__(self) -> None:
        if np.shape(self.u) != (self.body.n_dof, len(self.t)):
            raise ModelError(
                f"body reference: expected displacements ({self.body.n_dof}, {len(self.t)}) of body "
                f"{self.body.name!r}, got {np.shape(self.u)}"
            )
        elastic = without_rigid(self.body, np.asarray(self.u))
        greatest = tuple(float(norms(A, elastic).max()) for A in (self.body.M, self.body.K))
        if not min(greatest) > 0:
            raise ModelError(
                f"body reference: body {self.body.name!r} does not deform, so that errors relative to it do not exist"
            )
        object.__setattr__(self, "elastic", elastic)
        object.__setattr__(self, "greatest", greatest)

    def errors(self, Phi: Array, q: Array) -> BodyErrors:
        """Return the errors of the displacement Phi q, with shapes Phi, (n_dof, n_q), and coordinates q, (n_q, n_t)."""
        if Phi.shape[0] != self.body.n_dof or q.shape != (Phi.shape[1], len(self.t)):
            raise ModelError(
                f"body errors: expected shapes over {self.body.n_dof} dofs and coordinates at {len(self.t)} times, got "
                f"{Phi.shape} and {q.shape}"
            )
        e = without_rigid(self.body, Phi) @ q - self.elastic
        mass, energy = (norms(A, e) / size for A, size in zip((self.body.M, self.body.K), self.greatest, strict=True))
        return BodyErrors(self.t, mass, energy)

    def history_error(self, rows: sp.sparray | Array, Phi: Array, q: Array) -> float:
        """Return max |rows e| / max |rows u| over time, for selected results such as the stress at one point."""
        there = rows @ self.elastic
        error = (rows @ without_rigid(self.body, Phi)) @ q - there
        return float(la.norm(error, axis=0).max() / la.norm(there, axis=0).max())


def largest_difference(histories: Mapping[str, Array], full: Mapping[str, Array]) -> float:
    """Return the largest difference of vector histories, (n_t, n) each, relative to the largest of the full model."""
    difference = max(float(la.norm(histories[name] - of, axis=1).max()) for name, of in full.items())
    return difference / max(float(la.norm(of, axis=1).max()) for of in full.values())


def without_rigid(body: FEBody, u: Array) -> Array:
    """Return columns in mean axes, u - N Nᵀ M u with M-orthonormal rigid motions N, (n_dof, k)."""
    Psi = rigid_motion_of_dofs(body.nodes, body.dofs)
    M_Psi = body.M @ Psi
    return np.asarray(u - Psi @ la.solve(Psi.T @ M_Psi, M_Psi.T @ u, assume_a="pos"))


def norms(A: sp.sparray, u: Array) -> Array:
    """Return sqrt(uᵀ A u) of each column, (k,)."""
    return np.sqrt(np.maximum(np.einsum("nk,nk->k", u, A @ u), 0.0))


# body study -----------------------------------------------------------------------------------------------------------


MakeModes = Callable[[Families, int], ModeSet]


@dataclass(frozen=True)
class Loading:
    """A system and its time integration."""

    system: System
    integrator: GeneralizedAlpha
    t_end: float  #: [s]
    h: float  #: [s]
    every: int = 1  #: number of steps between evaluations of errors


@dataclass(frozen=True, eq=False)
class SetError:
    """The errors of one mode set with one number of modes under one loading."""

    loading: str
    mode_set: str
    n_modes: int
    n_q: int = 0  #: number of modal coordinates
    errors: BodyErrors | None = None  #: errors over time; None if the case failed
    #: largest error of stress by place, relative to the largest stress there
    stress: Mapping[str, float] = field(default_factory=dict)
    force: float = float("nan")  #: error of the bushing forces on the body, relative to their largest value
    failure: str = ""  #: reason why the case failed

    @property
    def largest(self) -> tuple[float, float]:
        """The largest epsilon_M and epsilon_K; NaN if the case failed."""
        return (float("nan"), float("nan")) if self.errors is None else self.errors.largest


def full_motions(
    loadings: Mapping[str, Loading],
    name: str,
    body: FEBody,
    *,
    free: Sequence[str],
    damping: RayleighDamping | None = None,
) -> dict[str, SuspendedMotion]:
    """Return the motion of the full model under each loading; parameters and errors as `suspended_motion`."""
    return {
        key: suspended_motion(
            each.system, name, body, free=free, integrator=each.integrator, t_end=each.t_end, h=each.h,
            every=each.every, damping=damping,
        )
        for key, each in loadings.items()
    }  # fmt: skip


def body_study(
    loadings: Mapping[str, Loading],
    name: str,
    body: FEBody,
    full: Mapping[str, SuspendedMotion],
    cases: Sequence[tuple[str, MakeModes, int]],
    *,
    damping: RayleighDamping | None = None,
    stress: Mapping[str, sp.sparray] | None = None,
    on_case: Callable[[SetError], None] | None = None,
) -> tuple[SetError, ...]:
    """Run every mode set under every loading, and compare it with the full model: steps (2) and (3).

    Parameters
    ----------
    loadings
        Loadings by name; their flexible body is a placeholder.
    name
        Name of the flexible body.
    body
        Its coupled finite element model (`lean_body` saves time).
    full
        Motions of the full model, from `full_motions`.
    cases
        Name of a mode set, the function that makes it, and the number of modes.
    stress
        Rows over the dofs of the body for each place (`stress_rows`).
    on_case
        Called with each result, for progress.

    Raises
    ------
    ModelError
        If a loading has no motion of the full model. A set that fails becomes a result with the reason.
    """
    missing = [key for key in loadings if key not in full]
    if missing:
        raise ModelError(f"body study: no motion of the full model for {', '.join(missing)}")
    references = {key: BodyReference(body, full[key].t, full[key].u) for key in loadings}
    condition = frame_condition(body, TisserandFrame())
    results = []

    def report(result: SetError) -> None:
        results.append(result)
        if on_case is not None:
            on_case(result)

    with Families(body) as families:
        for set_name, make, n_modes in cases:
            try:
                modes = make(families, n_modes)
                Phi = finish(body, modes, condition).Phi
                reduced = reduce(
                    families, modes, frame=TisserandFrame(), damping=damping, stress=False, geometric=False
                )
            except (CmsError, ReportedError) as error:
                for key in loadings:
                    report(SetError(key, set_name, n_modes, failure=str(error)))
                continue
            for key, each in loadings.items():
                system = replace(with_body(each.system, name, [reduced], stiffening=False), sensors=())
                try:
                    motion = integrate(system, each.integrator, each.t_end, each.h)
                except ReportedError as error:
                    report(SetError(key, set_name, n_modes, reduced.n_q, failure=str(error)))
                    continue
                q = motion.body(name).q[:: each.every].T
                forces = {b: bushing_force(system, name, motion, b)[:: each.every] for b in full[key].forces}
                report(
                    SetError(
                        key, set_name, n_modes, reduced.n_q, references[key].errors(Phi, q),
                        {place: references[key].history_error(rows, Phi, q) for place, rows in (stress or {}).items()},
                        largest_difference(forces, {b: f[:, :3] for b, f in full[key].forces.items()}),
                    )
                )  # fmt: skip
    return tuple(results)


def lean_body(body: FEBody) -> FEBody:
    """Return the body without surface and numbering, which no motion needs, so that reductions are faster."""
    return replace(body, surface=np.zeros((0, 3), np.int64), kept=np.zeros(0, np.int64), numbering=Numbering())


def stress_rows(body: FEBody) -> sp.csr_array:
    """Return the stress at the stress points of a shell as rows over the dofs, (6 n_points, n_dof) [Pa/m].

    Parameters
    ----------
    body
        Coupled body with points of `fe_models.shells.shell_points`: only a few, because each of their dofs is
        evaluated.

    Raises
    ------
    ModelError
        If it has no such points.
    """
    points = body.stress_points
    if not isinstance(points, ShellPoints) or body.recovery is None:
        raise ModelError(f"stress rows: body {body.name!r}: expected stress points of fe_models.shells.shell_points")
    on_mesh = np.unique(np.concatenate([group.dofs[rows].ravel() for group, rows in points.parts]))
    dofs = np.unique(sp.csr_array(body.recovery.matrix)[on_mesh].indices)
    pick = sp.csr_array((np.ones(len(dofs)), (np.arange(len(dofs)), dofs)), shape=(len(dofs), body.n_dof))
    values = points.stress(body.mesh_displacement(pick.T.toarray()))
    return sp.csr_array(sp.csr_array(values.reshape(-1, len(dofs))) @ pick)


def bushing_force(system: System, name: str, motion: Trajectory, bushing: str) -> Array:
    """Return the force of a bushing on the body, mesh axes, (n_t, 3) [N]."""
    force = next(each for each in system.forces if isinstance(each, Bushing) and each.name == bushing)
    end = force.marker_b
    sign = -1.0 if body_name(end.body if isinstance(end, Marker) else end) == name else 1.0
    body = system.body(name)
    assert isinstance(body, FlexibleBody)
    R = rotation_matrix(motion.body(name).p) @ body.reduced.frame.axes.T
    return sign * np.einsum("tab,ta->tb", R, motion.reaction(bushing).force)
