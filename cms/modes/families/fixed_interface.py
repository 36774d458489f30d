"""The body with all boundary dofs held: its interior stiffness, factorised once for many columns, and its modes."""

from dataclasses import dataclass, replace

import numpy as np
import scipy.sparse as sp

from cms.errors import BodyError, EigenError, FactorizationError, ModeSetError
from cms.linear_algebra.solvers.eigen import EigenResult, eigenmodes, no_modes
from cms.linear_algebra.solvers.factorization import EmptyFactor, Factorization, factorize, matrix_of
from cms.linear_algebra.solvers.mode_count import ModeCount
from cms.linear_algebra.solvers.registry import solver_of
from cms.modes.families.rigid_modes import WITHIN_ROUNDING, moving_nodes
from fe_models.body.couplings.submatrix import PrincipalBlock, nearby_order, principal_block
from fe_models.body.fe_body import MULTIPLIER, FEBody
from fe_models.foundation.arrays import IntArray
from fe_models.foundation.solver import Solver

__all__ = ["FixedInterfaceBody", "fix_interfaces", "fixed_interface_modes"]


@dataclass(frozen=True, eq=False)
class FixedInterfaceBody:
    """Interior partition of a coupled body, and the factorisation of K_II; the context manager frees it."""

    body: FEBody
    i: IntArray  #: interior dofs, which are all others, ordered so that neighbours are near, (n_i,)
    b: IntArray  #: held dofs: boundary dofs in the order of `body.b`, then extra dofs, (n_b,)
    factorization: Factorization  #: of K_ii

    def __enter__(self) -> "FixedInterfaceBody":
        return self

    def __exit__(self, *_: object) -> None:
        self.factorization.close()

    @property
    def K_ii(self) -> sp.csc_array:
        """Interior stiffness, (n_i, n_i) [N/m]; recomputed, because a large body cannot hold it in addition to K."""
        return principal_block(self.body.K, self.i)

    @property
    def M_ii(self) -> sp.csc_array:
        """Interior mass, (n_i, n_i) [kg]; recomputed."""
        return principal_block(self.body.M, self.i)

    @property
    def n_multipliers(self) -> int:
        """Number of multipliers: massless interior dofs that make K_ii indefinite."""
        return int((self.body.dofs[:, 1] == MULTIPLIER).sum())


def fix_interfaces(
    body: FEBody, extra: IntArray | None = None, *, solver: str | Solver | None = None
) -> FixedInterfaceBody:
    """Hold all boundary dofs of a coupled body and factorise its interior stiffness.

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
    return replace(modes, Phi=blocks[0].expanded(modes.Phi))


def _mechanism_message(body: FEBody, i: IntArray, K_ii: sp.csc_array, M_ii: sp.csc_array, solver: Solver) -> str:
    """Describe which nodes move without energy while the interfaces are held."""
    start = f"body {body.name!r}: with all interfaces held its stiffness is singular"
    try:
        modes = eigenmodes(K_ii, M_ii, n_modes=min(7, len(i) - 1), solver=solver)
    # the mechanism matters more than the reason why its motion could not be computed
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
