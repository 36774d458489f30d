"""All mode families of one body from one factorisation of its interior stiffness (docs/theory.md §2)."""

import logging
from collections.abc import Callable, Iterator
from contextlib import AbstractContextManager, contextmanager
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np

from cms.errors import ArgumentError, BodyError, ModeSetError
from cms.linear_algebra.solvers.eigen import EigenResult, no_modes
from cms.linear_algebra.solvers.mode_count import ModeCount, mode_count
from cms.linear_algebra.solvers.registry import solver_of
from cms.modes.families.cost import large_interfaces
from cms.modes.families.fixed_interface import CondensedBody, FixedInterfaceBody, fix_interfaces, fixed_interface_modes
from cms.modes.families.flexibility import BoundaryConditions, Flexibility, elastic_modes
from cms.modes.families.rigid_modes import determinate_partition, independent_rigid_modes
from cms.modes.families.static_modes import (
    attachment_modes,
    boundary_names,
    constraint_modes,
    inertia_relief_modes,
    redundant_constraint_modes,
    residual_attachment_modes,
    unrestrained_attachment_modes,
)
from fe_models.body.fe_body import FEBody
from fe_models.foundation.arrays import MOTION_COMPONENTS, Array, IntArray
from fe_models.foundation.ranks.spread_matrix import largest_entry
from fe_models.foundation.solver import Solver
from fe_models.foundation.tall.columns import combine, elsewhere, of_this_process, rows_times
from fe_models.foundation.tall.on_disk import release
from fe_models.foundation.words import quoted

__all__ = ["Families", "body_of", "families_of"]


GROUNDED = 1e-6  #: |K Psi_R| / (|K| |Psi_R|) above which a body is attached to the ground


log = logging.getLogger(__name__)


class Families(AbstractContextManager["Families"]):
    """The mode families of a body; each is computed once, when first used. The context manager frees the factor.

    >>> with Families(body) as families:                                   # doctest: +SKIP
    ...     sets = [rubin(families, n_modes=k) for k in range(20)]

    The held dofs h are the boundary dofs, plus interior dofs if the boundary dofs leave a rigid-body motion free
    (theory.md §1). The interior stiffness K_II with h held is factorised once. Static and vibration modes for every
    boundary condition then follow by means of the condensed stiffness S of h.
    """

    def __init__(
        self, body: FEBody, *, announce: bool = True, solver: str | Solver | None = None, to_disk: bool = False
    ) -> None:
        """Find the rigid-body modes and held dofs of a coupled body; families are computed when they are first used.

        Parameters
        ----------
        body
            A coupled body.
        announce
            Whether to warn in advance of the cost of interfaces with very many dofs, and of cheaper options.
        solver
            Name of the solver, one of `cms.linear_algebra.solvers.registry.SOLVERS`; default: the fastest installed
            solver.
        to_disk
            Whether the constraint modes, and large arrays made from them, are put on disk.

        Raises
        ------
        BodyError
            If the interfaces of the body have no boundary dofs yet, or no dof is a displacement.
        FactorizationError
            If the solver is unknown or not installed.
        """
        if not isinstance(body, FEBody):
            raise ArgumentError(f"Families: body: expected an FEBody, got {quoted(body)}")
        body.require_coupled()
        self.body = body
        self.solver = solver_of(solver)
        self._announces, self._to_disk = announce, to_disk
        self._is_open = True
        self._fixed: FixedInterfaceBody | None = None
        self._modes: dict[bytes, list[_Found]] = {}
        self._flexibilities: dict[bytes, Flexibility] = {}
        #: independent rigid-body modes about the mean of the nodes, (n_dof, n_r), and their components, (n_r,)
        self.Psi_R, self.rigid_components = independent_rigid_modes(body)
        #: determinate dofs R, ascending, (n_r,), and those of them in the interior if B leaves a rigid-body motion free
        self.r, self.interior_r = determinate_partition(body, self.Psi_R)
        self.h = np.concatenate([body.b, self.interior_r])  #: held dofs: B, then the interior dofs of R, (n_h,)

    def __exit__(self, *_: object) -> None:
        """Free the factorisation; computed families stay."""
        if self._is_open and self._fixed is not None:
            self._fixed.factorization.close()
        self._is_open = False

    def forget_vibration_modes(self) -> None:
        """Discard the vibration modes, because their roundoff depends on the number of modes requested before."""
        self._modes.clear()

    # -- Partition -------------------------------------------------------------------------------------------------

    @cached_property
    def e(self) -> IntArray:
        """Excess boundary dofs E: the boundary dofs B without R, in the order of `body.b`, (n_e,)."""
        return self.body.b[~np.isin(self.body.b, self.r)]

    @property
    def fixed(self) -> FixedInterfaceBody:
        """Interior partition and its factorisation, made at the first call."""
        if self._fixed is not None:
            return self._fixed
        if not self._is_open:
            raise ModeSetError(f"families of body {self.body.name!r}: closed; make new ones")
        for words in large_interfaces(self.body) if self._announces else ():
            log.warning(words)
        self._fixed = fix_interfaces(self.body, self.interior_r, solver=self.solver)
        return self._fixed

    @property
    def has_factor(self) -> bool:
        """Whether the interior stiffness of a body in this process has been factorised, and the factor is not freed."""
        return self._is_open and self._fixed is not None and self.body.layout is None

    def adopt(self, fixed: FixedInterfaceBody) -> None:
        """Use an existing interior factorisation, unless there is one here; it is freed with these families."""
        if self._fixed is None:
            self._fixed = fixed

    # -- Static families -------------------------------------------------------------------------------------------

    @cached_property
    def Psi_C(self) -> Array:
        """Constraint modes of the held dofs, (n_dof, n_h); `SpreadColumns` if the body is distributed."""
        return constraint_modes(self.fixed, to_disk=self._to_disk)

    @cached_property
    def S(self) -> Array:
        """Stiffness condensed to the held dofs, Psi_Cᵀ K Psi_C, (n_h, n_h) [N/m]."""
        S = rows_times(self.body.K[:, self.h].T, self.Psi_C)
        release(self.Psi_C)
        return (S + S.T) / 2

    @cached_property
    def condensed(self) -> CondensedBody:
        """Parts that all flexibilities have in common."""
        return CondensedBody(self.fixed, self.Psi_C, self.S, self.Psi_R)

    @cached_property
    def free(self) -> Flexibility:
        """Elastic flexibility Pᵀ G_R P of the free body.

        Raises
        ------
        BodyError
            If the body is held to the ground, so that K times its rigid-body modes is not zero.
        """
        self._require_free()
        r = np.flatnonzero(np.isin(self.h, self.r))
        return Flexibility(self.condensed, BoundaryConditions.free(len(self.h)), r)

    @cached_property
    def Psi_RC(self) -> Array:
        """Redundant constraint modes, (n_dof, n_e)."""
        return redundant_constraint_modes(self.free)

    @cached_property
    def Psi_A(self) -> Array:
        """Attachment modes, (n_dof, n_e)."""
        return attachment_modes(self.free)

    @cached_property
    def Psi_H(self) -> Array:
        """Inertia-relief modes, (n_dof, n_r)."""
        return inertia_relief_modes(self.fixed, self.Psi_R)

    @cached_property
    def Psi_U(self) -> Array:
        """Unrestrained attachment modes, (n_dof, n_b)."""
        return unrestrained_attachment_modes(self.free)

    def residual_attachment(self, free_modes: EigenResult) -> Array:
        """Return residual attachment modes: Psi_U minus the contribution of the retained free modes, (n_dof, n_b)."""
        return residual_attachment_modes(self.body, self.Psi_U, free_modes)

    def static(self, F: Array) -> Array:
        """Return G_R F, the static response to load columns with R fixed, (n_dof, k)."""
        return self.free.held(F)

    def project(self, F: Array) -> Array:
        """Return P F, load columns balanced by the inertia of the rigid-body acceleration they cause, (n_dof, k)."""
        return F - self.free.M_N @ (self.free.N.T @ F)

    def flexibility(self, F: Array) -> Array:
        """Return Pᵀ G_R P F, the elastic response of the free body to load columns, (n_dof, k)."""
        return self.free.solve(F)

    # -- Vibration families ----------------------------------------------------------------------------------------

    def fixed_modes(self, n_modes: int | ModeCount) -> EigenResult:
        """Return vibration modes with B held, over all dofs, without rigid-body motions that B may leave free."""
        if len(self.h) > len(self.body.b):
            directions = np.eye(len(self.h))[:, len(self.body.b) :]
            return self.elastic_modes(BoundaryConditions(directions), n_modes)
        return self._cached(b"fixed", mode_count(n_modes), lambda wanted: fixed_interface_modes(self.fixed, wanted))

    def free_modes(self, n_modes: int | ModeCount) -> EigenResult:
        """Return elastic vibration modes of the free body, over all dofs."""
        return self._cached(b"free", mode_count(n_modes), lambda wanted: elastic_modes(self.free, wanted))

    def elastic_modes(self, conditions: BoundaryConditions, n_modes: int | ModeCount) -> EigenResult:
        """Return elastic vibration modes under these conditions of the held dofs, over all dofs."""
        return self._cached(
            conditions.key,
            mode_count(n_modes),
            lambda wanted: elastic_modes(self.flexibility_under(conditions), wanted),
        )

    def flexibility_under(self, conditions: BoundaryConditions) -> Flexibility:
        """Return the flexibility of the body under these conditions of the held dofs."""
        if conditions.key not in self._flexibilities:
            self._require_free()
            self._flexibilities[conditions.key] = Flexibility(self.condensed, conditions)
        return self._flexibilities[conditions.key]

    def without_boundary(self, Phi: Any) -> Any:
        """Return Phi - Psi_C Phi_h, (n_dof, k): zero on the held dofs, and with the same span together with Psi_C."""
        at_rest = combine(self.Psi_C, Phi[self.h])
        return Phi - (at_rest if elsewhere(Phi) is not None else of_this_process(at_rest))

    # -- Labels ----------------------------------------------------------------------------------------------------

    def held_names(self, family: str) -> tuple[list[str], list[str]]:
        """Return a label and a group for each fixed dof."""
        labels, groups = boundary_names(self.body, family)
        for node, component in self.body.dofs[self.interior_r]:
            labels.append(f"{family} node {self.body.numbering.called(node)} {MOTION_COMPONENTS[component]}")
            groups.append(f"{family} determinate")
        return labels, groups

    # -- Internals -------------------------------------------------------------------------------------------------

    def _require_free(self) -> None:
        if self.body.is_held:
            return  # a body fixed to the ground has no rigid-body motion
        force = np.abs(self.body.K @ self.Psi_R).max(axis=0)
        scale = largest_entry(self.body.K) * np.abs(self.Psi_R).max(axis=0)
        if (force > GROUNDED * scale).any():
            raise BodyError(
                f"body {self.body.name!r}: K times its rigid-body modes is {(force / scale).max():.1e} of |K|, "
                "expected 0: held to the ground, or nodes have wrong positions; release it, or correct the nodes"
            )

    def _cached(
        self,
        key: bytes,
        wanted: ModeCount,
        compute: Callable[[ModeCount], EigenResult],
    ) -> EigenResult:
        if wanted.n == 0:
            return no_modes(self.body.n_dof)
        for found in self._modes.get(key, []):
            if (part := found.part(wanted)) is not None:
                return part
        modes = compute(wanted)
        self._modes[key] = [_Found(modes, wanted.cutoff)]
        return modes


@dataclass(frozen=True, eq=False)
class _Found:
    """Modes computed earlier. A later request may be for fewer of them."""

    modes: EigenResult
    cutoff: float | None

    def part(self, wanted: ModeCount) -> EigenResult | None:
        frequencies, cutoff = self.modes.frequencies, wanted.cutoff
        if wanted.verify and not self.modes.is_proven:
            return None
        if wanted.n is not None:
            return self.modes.first(wanted.n) if wanted.n <= len(frequencies) else None
        known = max(self.cutoff or 0.0, frequencies[-1] * (1 - 1e-9) if len(frequencies) else 0.0)
        if cutoff is None or cutoff > known:
            return None
        return self.modes.first(int((frequencies <= cutoff).sum()))


# A body, or in its place its `Families`, which several mode sets share to use one factorisation -----------------------


@contextmanager
def families_of(body: FEBody | Families) -> Iterator[Families]:
    """Yield the shared families, or new families of the body that are closed at the end of the block."""
    if isinstance(body, Families):
        yield body
        return
    with Families(body) as own:
        yield own


def body_of(body: FEBody | Families) -> FEBody:
    """Return the body, given the body itself or its families."""
    return body.body if isinstance(body, Families) else body
