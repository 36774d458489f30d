"""Body with all boundary dofs fixed: factorised interior stiffness, fixed-interface modes, stiffness condensed to B."""

from contextlib import AbstractContextManager
from dataclasses import dataclass

import numpy as np
import scipy.linalg as la
import scipy.sparse as sp

from cms.errors import BodyError, EigenError, FactorizationError, ModeSetError
from cms.linear_algebra.solvers.eigen import EigenResult, eigenmodes, no_modes
from cms.linear_algebra.solvers.factorization import EmptyFactor, Factorization, factorize, matrix_of
from cms.linear_algebra.solvers.mode_count import ModeCount
from cms.linear_algebra.solvers.registry import solver_of
from cms.modes.families.rigid_modes import WITHIN_ROUNDING, free_motions, mechanism_words, moving_nodes
from fe_models.body.fe_body import MULTIPLIER, FEBody
from fe_models.foundation.arrays import Array, IntArray
from fe_models.foundation.solver import Solver
from fe_models.foundation.sparse.submatrix import PrincipalBlock, nearby_order, principal_block

__all__ = ["CondensedBody", "FixedInterfaceBody", "fix_interfaces", "fixed_interface_modes", "held_factor"]


@dataclass(frozen=True, eq=False)
class FixedInterfaceBody(AbstractContextManager["FixedInterfaceBody"]):
    """Interior partition of a coupled body, and the factorisation of K_II; the context manager frees it."""

    body: FEBody
    i: IntArray  #: interior dofs (all dofs not in b), ordered such that neighbours are close, (n_i,)
    b: IntArray  #: held dofs: boundary dofs in the order of `body.b`, then extra dofs, (n_b,)
    factorization: Factorization  #: factorisation of K_ii

    def __exit__(self, *_: object) -> None:
        self.factorization.close()

    @property
    def K_ii(self) -> sp.csc_array:
        """Interior stiffness, (n_i, n_i) [N/m], extracted from K at each call to save memory."""
        return principal_block(self.body.K, self.i)

    @property
    def M_ii(self) -> sp.csc_array:
        """Interior mass, (n_i, n_i) [kg], extracted from M at each call."""
        return principal_block(self.body.M, self.i)

    @property
    def n_multipliers(self) -> int:
        """Number of multipliers: massless interior dofs that make K_ii indefinite."""
        return int((self.body.dofs[:, 1] == MULTIPLIER).sum())


def fix_interfaces(
    body: FEBody, extra: IntArray | None = None, *, solver: str | Solver | None = None
) -> FixedInterfaceBody:
    """Fix all boundary dofs of a coupled body and factorise its interior stiffness.

    Parameters
    ----------
    extra
        Further dofs to hold, if the interfaces alone leave a rigid-body motion free (`determinate_partition`).
    solver
        Solver, or its name (`cms.linear_algebra.solvers.registry`); default: the fastest installed solver.

    Raises
    ------
    ModeSetError
        If no dof is held, because the body has no interface.
    BodyError
        If the body is a mechanism with its interfaces held; the message says where it moves.
    """
    body.require_coupled()
    chosen = solver_of(solver)
    b = body.b if extra is None else np.concatenate([body.b, np.setdiff1d(extra, body.b)])
    i = np.setdiff1d(np.arange(body.n_dof), b)
    if len(b) == 0:
        raise ModeSetError(f"body {body.name!r} has no interface; give it at least one, or take free modes")
    i = nearby_order(body.K, body.dofs, i)
    if not len(i):
        return FixedInterfaceBody(body, i, b, Factorization(EmptyFactor(), chosen))
    K_ii = PrincipalBlock(body.K, i)
    is_definite = not (body.dofs[:, 1] == MULTIPLIER).any()
    try:
        factorization = factorize(K_ii, definite=is_definite, solver=chosen)
    except FactorizationError as error:
        raise BodyError(_mechanism_message(body, i, matrix_of(K_ii), principal_block(body.M, i), chosen)) from error
    return FixedInterfaceBody(body, i, b, factorization)


def fixed_interface_modes(fixed: FixedInterfaceBody, wanted: ModeCount) -> EigenResult:
    """Return vibration modes with all boundary dofs held, K_II phi = omega² M_II phi, over all dofs (n_dof, k)."""
    if not len(fixed.i):  # every dof belongs to an interface
        return no_modes(fixed.body.n_dof)
    blocks = PrincipalBlock(fixed.body.K, fixed.i), PrincipalBlock(fixed.body.M, fixed.i)
    numbering = np.searchsorted(np.sort(fixed.i), fixed.i)
    modes = eigenmodes(*blocks, wanted, factorization=fixed.factorization, numbering=numbering)
    return modes.over(blocks[0].expanded)


def _mechanism_message(body: FEBody, i: IntArray, K_ii: sp.csc_array, M_ii: sp.csc_array, solver: Solver) -> str:
    """Describe which nodes move without energy while the interfaces are fixed."""
    start = f"body {body.name!r}: with all interfaces held its stiffness is singular"
    try:
        modes = eigenmodes(K_ii, M_ii, n_modes=min(7, len(i) - 1), solver=solver)
    # report the mechanism, even if its motion could not be computed
    except (EigenError, FactorizationError):
        return f"{start}; it has a mechanism, or a part that no interface holds"
    energy = np.einsum("nk,nk->k", modes.Phi, K_ii @ modes.Phi)
    terms = np.einsum("n,nk,nk->k", np.abs(K_ii.diagonal()), modes.Phi, modes.Phi)
    is_free = energy < WITHIN_ROUNDING * np.finfo(float).eps * terms
    if not is_free.any():
        return f"{start}; its smallest energy is {(energy / terms).min():.1e} of the sum of its terms"
    return (
        f"{start}: {int(is_free.sum())}{'+' if is_free.all() else ''} motions without energy, largest "
        f"at {moving_nodes(body, i, modes.Phi[:, is_free])}; hold these nodes by an interface, join the parts, or "
        "repair the mesh"
    )


# the stiffness condensed to the held dofs -----------------------------------------------------------------------------


@dataclass(frozen=True, eq=False)
class CondensedBody:
    """Body condensed to its fixed dofs h: the boundary B, and further dofs that prevent its rigid-body motion."""

    fixed: FixedInterfaceBody  #: interior factorisation; `fixed.b` are the held dofs h
    Psi_C: Array  #: constraint modes, (n_dof, n_h); `SpreadColumns` if the body is distributed
    S: Array  #: Psi_Cᵀ K Psi_C = K_hh + K_hI Psi_C,I, (n_h, n_h) [N/m]
    Psi_R: Array  #: independent rigid-body modes, (n_dof, n_r)


def held_factor(
    condensed: CondensedBody, Z: Array, S_z: Array, e: IntArray, K_load: Array | None = None
) -> tuple[Array, tuple[Array, bool]]:
    """Factorise S_ee, a block of S_z = Zᵀ (S + K_load) Z; return its scale (n_e,), from its diagonal, and its factor.

    Raises
    ------
    BodyError
        If a motion z_e has no energy in the body and its load: a mechanism.
    """
    S_ee = S_z[np.ix_(e, e)]
    if not len(e):
        return np.zeros(0), (S_ee, True)
    body = condensed.fixed.body
    terms = np.abs(body.K.diagonal()[condensed.fixed.b])
    free = free_motions(body, condensed.Psi_C, Z[:, e], S_ee, terms, K_load)
    if free.shape[1]:
        raise BodyError(mechanism_words(body, free))
    size = 1 / np.sqrt(np.where(np.diag(S_ee) > 0, np.diag(S_ee), 1.0))
    try:
        return size, la.cho_factor(S_ee * np.outer(size, size), lower=True)
    except la.LinAlgError as error:
        raise BodyError(
            f"body {body.name!r}: its stiffness at the interfaces is lost in the rounding of much larger terms; "
            "choose stiffnesses of stiff springs and short stiff members closer to those of their neighbours"
        ) from error
