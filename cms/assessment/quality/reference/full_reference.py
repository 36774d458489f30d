"""Reference of quality checks: the full model, whose results all mode sets of the body share."""

from contextlib import ExitStack
from functools import cached_property
from typing import Any, NamedTuple, Protocol

import numpy as np
import scipy.sparse.linalg as sla

from cms.assessment.quality.errors import QualityError
from cms.assessment.quality.reference.ports import Ports
from cms.assessment.quality.reference.reference_response import ReferenceResponse, reference_response
from cms.body.reduced_body import ReducedBody
from cms.linear_algebra.solvers.eigen import EigenResult
from cms.linear_algebra.solvers.mode_count import ModeCount
from cms.modes.families.families import Families, body_of, families_of
from cms.modes.mode_set import ModeSet
from cms.reduction.basis.free_basis import FreeBasis
from cms.reduction.error_estimates import frequency_errors
from fe_models.body.fe_body import FEBody
from fe_models.body.load_cases import load_columns
from fe_models.body.rigid_motion import rigid_motion_of_dofs
from fe_models.foundation.arrays import Array

__all__ = [
    "FullReference", "MovingMass", "Reference", "Space", "StaticResponse", "centered_directions", "fixed_rows",
    "moving_mass", "static_labels",
    "static_responses", "usable_band",
]  # fmt: skip

CUTOFF_MARGIN = 1.5  #: customary ratio of the highest retained frequency to the highest frequency of interest
MODES_BEYOND = 1.5  #: highest frequency of the full modes divided by the band
NO_LOAD = 1e-10  #: relative difference of a load and the inertia forces that balance it, below which it is rounding
MASS_TOLERANCE = 1e-10  #: relative residual of the solutions with M_II
ACCELERATIONS = ("ax", "ay", "az", "alpha x", "alpha y", "alpha z")


class StaticResponse(NamedTuple):
    """Static responses to loads of one kind."""

    labels: tuple[str, ...]  #: names of the loads
    u: Array  #: displacements, (n, n_loads); zero if a load does not deform the body


class MovingMass(NamedTuple):
    """Mass and inertia in the geometric rigid-body directions about the centre of mass, mesh axes."""

    directions: Array  #: rigid-body motions, (n, 6)
    total: Array  #: part that moves while the interfaces are fixed: sum over all fixed-interface modes, (6,)
    rigid: Array  #: mass and inertia of the whole body, (6,) [kg, kg m²]


class Space(Protocol):
    """Space of displacement columns, (n, k): the dofs of a body, or coordinates over a small basis."""

    @property
    def K(self) -> Any:
        """Stiffness, (n, n)."""

    @property
    def M(self) -> Any:
        """Mass, (n, n)."""

    def translation_rows(self, u: Array, /) -> Array:
        """Return the translations of all nodes, or rows with the same scalar products."""


class Reference(Protocol):
    """Solution by which mode sets are judged: of the full model, or the same in coordinates over a small basis."""

    @property
    def space(self) -> Space:
        """Space of all columns of this reference."""

    @property
    def time(self) -> float:
        """Time unit of the body [s]."""

    @property
    def band(self) -> float:
        """Highest frequency of interest [Hz]."""

    @property
    def frequencies(self) -> Array:
        """Elastic free frequencies, ascending, in the band and above [Hz]."""

    @property
    def Phi(self) -> Array:
        """Elastic free modes in the band, (n, n_band)."""

    @property
    def statics(self) -> tuple[StaticResponse, ...]:
        """Static responses to interface loads, accelerations and load cases."""

    @property
    def mass(self) -> MovingMass:
        """Mass that moves while the interfaces are fixed."""

    def fixed_rows(self, X: Array, /) -> Array:
        """Return the rows of columns that are zero while the interfaces are fixed, rotations times length, (n_h, k)."""

    def bounds(self, basis: FreeBasis, n: int, /) -> tuple[Array, Array]:
        """Return bounds and estimates of (f_reduced / f)² - 1 of the lowest n frequencies, (n,) each."""


class FullReference:
    """The full model of a coupled body up to a frequency band; a context manager that frees its factorisation.

    >>> with FullReference(body, band=2000.0) as reference:                       # doctest: +SKIP
    ...     records = [check_reduction(body, modes, reduced, reference=reference) for modes, reduced in pairs]
    """

    def __init__(self, source: FEBody | Families, *, band: float) -> None:
        """Prepare the reference; nothing is computed yet.

        Parameters
        ----------
        source
            A coupled body, or its `Families`, whose factorisation is then shared.
        band
            Highest frequency of interest [Hz].

        Raises
        ------
        QualityError
            If the band is not a frequency above 0.
        """
        body = body_of(source)
        if not (np.isfinite(band) and band > 0):
            raise QualityError(f"reference of body {body.name!r}: band = {band}; expected a frequency above 0 [Hz]")
        self.body, self.band, self.time = body, float(band), body.units.time
        self.space = body
        self._stack = ExitStack()
        self.families = self._stack.enter_context(families_of(source))

    def __enter__(self) -> "FullReference":
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def close(self) -> None:
        """Free the factorisation if this object created it."""
        self._stack.close()

    @cached_property
    def modes(self) -> EigenResult:
        """Elastic free modes up to 1.5 times the band, at least one."""
        found = self.families.free_modes(ModeCount(cutoff=MODES_BEYOND * self.band * self.time))
        return found if len(found.omega2) else self.families.free_modes(n_modes=1)

    @property
    def frequencies(self) -> Array:
        """Elastic free frequencies, ascending [Hz]."""
        return self.modes.frequencies / self.time

    @property
    def n_band(self) -> int:
        """Number of elastic free modes in the band, at least one."""
        return max(1, int((self.frequencies <= self.band).sum()))

    @property
    def Phi(self) -> Array:
        """Elastic free modes in the band, (n_dof, n_band)."""
        return self.modes.Phi[:, : self.n_band]

    @cached_property
    def statics(self) -> tuple[StaticResponse, ...]:
        """Static responses to interface loads, accelerations and load cases."""
        return static_responses(self.families)

    @cached_property
    def mass(self) -> MovingMass:
        """Mass that moves while the interfaces are fixed."""
        return moving_mass(self.families)

    def fixed_rows(self, X: Array) -> Array:
        """Return the rows of displacements that are zero while the interfaces are fixed, rotations times length."""
        return fixed_rows(self.families, X)

    def bounds(self, basis: FreeBasis, n: int) -> tuple[Array, Array]:
        """Return bounds and estimates of (f_reduced / f)² - 1 of the lowest n frequencies, (n,) each."""
        errors = frequency_errors(self.families, basis, n)
        return errors.bound, np.minimum(errors.bound, (1 + errors.frequency) ** 2 - 1)

    @cached_property
    def ports(self) -> Ports:
        """Reference points of all interfaces."""
        return Ports.of_body(self.body)

    @cached_property
    def response(self) -> ReferenceResponse:
        """Modes of the full model for the interface response up to the band."""
        return reference_response(self.families, self.ports, self.band * self.time)


def static_responses(families: Families) -> tuple[StaticResponse, ...]:
    """Return the static responses to unit interface loads, unit rigid-body accelerations and load cases of the body.

    Interface loads are balanced by the reactions at R (attachment modes Psi_A; together with R they give any balanced
    combination of interface forces). Accelerations act with all interfaces fixed (inertia-relief modes Psi_H). Load
    cases act on the free body; a load that only accelerates the body, such as gravity, has no response.
    """
    body = families.body
    F = load_columns(body.load_cases, body.n_dof)
    deforms = np.linalg.norm(families.project(F), axis=0) > NO_LOAD * np.linalg.norm(F, axis=0)
    U = np.zeros(F.shape)
    if deforms.any():
        U[:, deforms] = families.flexibility(F[:, deforms])
    return tuple(map(StaticResponse, static_labels(families), (families.Psi_A, families.Psi_H, U)))


def static_labels(families: Families) -> tuple[tuple[str, ...], ...]:
    """Return the names of the loads of `static_responses`; accelerations have numbers if they are fewer than six."""
    n_r, labels = families.Psi_R.shape[1], families.held_names("load")[0]
    accelerations = ACCELERATIONS if n_r == 6 else tuple(f"acceleration {k + 1}" for k in range(n_r))
    return (
        tuple(labels[k] for k in families.free.e),
        accelerations,
        tuple(case.name for case in families.body.load_cases),
    )


def moving_mass(families: Families) -> MovingMass:
    """Return the mass that moves while the interfaces are fixed: b_Iᵀ M_II⁻¹ b_I over interior dofs, b = M d."""
    body, fixed = families.body, families.fixed
    d = centered_directions(body)
    b = body.M @ d
    M_ii, diagonal = fixed.M_ii, fixed.M_ii.diagonal()
    massive = np.flatnonzero(diagonal > 0)
    M_ii, loads = M_ii[massive][:, massive], b[fixed.i[massive]]
    precondition = sla.LinearOperator(M_ii.shape, matvec=lambda x: x / diagonal[massive])
    total = np.zeros(loads.shape[1])
    for k in range(loads.shape[1]):
        if loads[:, k].any():
            x, _ = sla.cg(M_ii, loads[:, k], rtol=MASS_TOLERANCE, M=precondition, maxiter=2000)
            total[k] = x @ loads[:, k]
    return MovingMass(d, total, np.einsum("nk,nk->k", d, b))


def centered_directions(body: FEBody) -> Array:
    """Return the geometric rigid-body modes about the centre of mass, (n_dof, 6), mesh axes."""
    moved = rigid_motion_of_dofs(body.nodes, body.dofs)
    M_moved = body.M @ moved
    mass = moved[:, 0] @ M_moved[:, 0]
    if mass <= 0:
        return moved
    # S = int c from the products of translations and rotations: d_x · theta_y gives S_z, d_y · theta_z S_x, …
    products = moved[:, :3].T @ M_moved[:, 3:]
    center = np.array([products[1, 2], products[2, 0], products[0, 1]]) / mass
    return rigid_motion_of_dofs(body.nodes, body.dofs, center)


def fixed_rows(families: Families, X: Array) -> Array:
    """Return the rows of columns X that are zero while the interfaces are fixed, rotations times length, (n_h, k)."""
    body, h = families.body, families.h
    return X[h] * np.where(body.dofs[h, 1] < 3, 1.0, body.length)[:, None]


def usable_band(modes: ModeSet, reduced: ReducedBody) -> float:
    """Return the highest frequency for which a mode set is customarily used [Hz]: that of its highest mode / 1.5.

    For a set with at most one vibration mode, it is the first free-free frequency.
    """
    time = reduced.units.time
    first = reduced.free_frequencies[0] / time if len(reduced.free_frequencies) else 0.0
    vibration = modes.frequencies[~modes.is_static]
    vibration = vibration[np.isfinite(vibration)]
    highest = vibration.max() / time / CUTOFF_MARGIN if len(vibration) else 0.0
    band = float(max(highest, 1.001 * first))
    if not band > 0:
        raise QualityError(f"body {reduced.name!r}: has no elastic frequency to compare; specify the band")
    return band
