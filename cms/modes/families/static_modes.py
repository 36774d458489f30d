"""Static modes of a body, defined by its boundary dofs (docs/theory.md §2)."""

from collections.abc import Iterator

import numpy as np

from cms.linear_algebra.independent import gram_in_blocks
from cms.linear_algebra.solvers.eigen import EigenResult
from cms.modes.families.fixed_interface import FixedInterfaceBody
from cms.modes.families.flexibility import Flexibility
from fe_models.body.fe_body import MULTIPLIER, FEBody
from fe_models.foundation.arrays import MOTION_COMPONENTS, Array
from fe_models.foundation.ranks.spread_columns import spread_parts
from fe_models.foundation.sparse.sparse_product import SymmetricProduct
from fe_models.foundation.tall.columns import combine, of_this_process
from fe_models.foundation.tall.on_disk import on_disk, release

__all__ = [
    "attachment_modes",
    "boundary_names",
    "constraint_modes",
    "inertia_relief_modes",
    "redundant_constraint_modes",
    "residual_attachment_modes",
    "unrestrained_attachment_modes",
]

RESIDUAL = 1e-12  #: energy of a residual attachment mode relative to its attachment mode, below which it is rounding
STIFF = 1e-14  #: relative compliance (rotations times body length squared), below which it is rounding
ROUNDING_ENERGY = 1e-24  #: relative energy of an inertia-load response, below which load and response are rounding
BLOCK = 60  #: number of right-hand sides per solve; wider blocks are not faster and need more memory
BLOCK_OF_RANKS = 16  #: number of right-hand sides per solve of a distributed body, whose columns pass through rank 0


def constraint_modes(fixed: FixedInterfaceBody, *, to_disk: bool = False) -> Array:
    """Return constraint modes Psi_C: unit displacement of one boundary dof, with the other boundary dofs fixed.

    The interior part is -K_II⁻¹ K_IB; columns have the order of the held dofs `fixed.b`. They are solved in blocks of
    `BLOCK`. They are put on disk (`fe_models.foundation.tall.on_disk`) if requested, and distributed (`SpreadColumns`)
    if K is.

    Returns
    -------
    Array
        Constraint modes, (n_dof, n_b), translations per translation [-] or per rotation [m].
    """
    body, n = fixed.body, len(fixed.b)
    if body.layout is not None:
        return spread_parts(body.layout, n, _blocks_of_constraint_modes(fixed, BLOCK_OF_RANKS))  # type: ignore[return-value]
    Psi_C, first = on_disk((body.n_dof, n)) if to_disk else np.zeros((body.n_dof, n)), 0
    for block in _blocks_of_constraint_modes(fixed, BLOCK):
        last = first + block.shape[1]
        Psi_C[:, first:last] = block
        release(Psi_C)
        first = last
    return Psi_C


def _blocks_of_constraint_modes(fixed: FixedInterfaceBody, width: int) -> Iterator[Array]:
    """Yield constraint modes in blocks of at most `width`, (n_dof, width)."""
    K_b, i, b = fixed.body.K[:, fixed.b], fixed.i, fixed.b
    for first in range(0, len(b), width):
        last = min(first + width, len(b))
        block = np.zeros((fixed.body.n_dof, last - first))
        block[b[first:last], np.arange(last - first)] = 1.0
        block[i] = fixed.factorization.solve(-K_b[:, first:last].toarray()[i])
        yield block


def redundant_constraint_modes(free: Flexibility) -> Array:
    """Return redundant constraint modes Psi_RC: unit displacement of one E dof, with the other E dofs and R fixed.

    Parameters
    ----------
    free
        Flexibility of the free body, whose pivots are R.

    Returns
    -------
    Array
        Constraint modes of the E dofs, (n_dof, n_e).
    """
    return of_this_process(free.condensed.Psi_C[:, free.e])


def attachment_modes(free: Flexibility) -> Array:
    """Return attachment modes Psi_A: unit force on one E dof, with R fixed; Psi_A = Psi_C,E S_EE⁻¹.

    Returns
    -------
    Array
        Attachment modes, (n_dof, n_e), translations per force [m/N] or per moment [1/N].
    """
    return of_this_process(combine(free.condensed.Psi_C[:, free.e], free.solve_boundary(np.eye(len(free.e)))))


def inertia_relief_modes(fixed: FixedInterfaceBody, Psi_R: Array) -> Array:
    """Return inertia-relief modes Psi_H: response to inertia loads M Psi_R of rigid accelerations, with B fixed.

    The interior part is K_II⁻¹ (M Psi_R)_I.

    Parameters
    ----------
    Psi_R
        Rigid-body modes, (n_dof, n_r).

    Returns
    -------
    Array
        Inertia-relief modes, (n_dof, n_r), translations per acceleration [s²] or per angular acceleration [m s²]. They
        are exactly zero if the body does not deform (such as a planar body accelerated out of its plane).
    """
    Psi_H = np.zeros(Psi_R.shape)
    F = (fixed.body.M @ Psi_R)[fixed.i]
    Psi_H[fixed.i] = fixed.factorization.solve(F)
    is_rotation = np.arange(Psi_R.shape[1]) >= 3
    energy = np.einsum("nk,nk->k", F, Psi_H[fixed.i]) / np.where(is_rotation, fixed.body.length**2, 1.0)
    Psi_H[:, energy <= ROUNDING_ENERGY * energy.max(initial=0.0)] = 0.0
    return Psi_H


def unrestrained_attachment_modes(free: Flexibility) -> Array:
    """Return unrestrained attachment modes Psi_U = Pᵀ G_R P F_B: unit force on each boundary dof of the free body.

    The force is in equilibrium with the rigid-body acceleration that it causes, so the choice of R does not matter. G_R
    P F_B = Psi_C,E S_EE⁻¹ F_E - (G_R M N) N_Bᵀ with M-orthonormal rigid-body modes N needs six solves for any n_b.

    Returns
    -------
    Array
        Modes, (n_dof, n_b), with Psi_Rᵀ M Psi_U = 0; translations per force [m/N] or per moment [1/N]. A column is
        exactly zero if the free body responds to its load by acceleration alone.
    """
    n_b, h = len(free.condensed.fixed.body.b), free.condensed.fixed.b
    on_boundary = np.zeros((len(h), n_b))  # u_h under the unit forces, with R fixed
    on_boundary[free.e] = free.solve_boundary(np.eye(len(h), n_b)[free.e])
    u = of_this_process(combine(free.condensed.Psi_C, on_boundary))
    u -= combine(free.held(free.M_N), free.N[h[:n_b]].T)
    u = u - combine(free.N, free.M_N.T @ u)
    body, b = free.condensed.fixed.body, h[:n_b]
    compliance = u[b, np.arange(n_b)] * np.where(body.dofs[b, 1] >= 3, body.length**2, 1.0)
    u[:, compliance <= STIFF * compliance.max(initial=0.0)] = 0.0
    return u


def residual_attachment_modes(body: FEBody, Psi_U: Array, free_modes: EigenResult) -> Array:
    """Return residual attachment modes Psi_U - Phi Lambda⁻¹ Phi_Bᵀ: Psi_U minus the contribution of retained modes.

    Parameters
    ----------
    Psi_U
        Unrestrained attachment modes, (n_dof, n_b).
    free_modes
        Kept elastic modes of the free body.

    Returns
    -------
    Array
        (n_dof, n_b).
    """
    if not len(free_modes.omega2):
        return Psi_U
    residual = Psi_U - combine(free_modes.Phi, (free_modes.Phi[body.b] / free_modes.omega2).T)
    residual[:, ~Psi_U.any(axis=0)] = 0.0  # a load without elastic response leaves no residual
    n_multipliers = int((body.dofs[:, 1] == MULTIPLIER).sum())
    n_elastic = body.n_dof - 2 * n_multipliers - 6  # number of independent motions that satisfy the constraints
    is_full = n_multipliers and len(free_modes.omega2) + residual.shape[1] > n_elastic
    return without_rounding(body, residual, Psi_U) if is_full else residual


def without_rounding(body: FEBody, residual: Array, Psi_U: Array) -> Array:
    """Return residual attachment modes without combinations that are only rounding of the attachment modes.

    In a body with multipliers such a combination breaks the constraints. It would count as a motion without mass.
    """
    K = SymmetricProduct(body.K)
    energy = np.diag(gram_in_blocks(Psi_U, K))
    size = 1 / np.sqrt(np.where(energy > 0, energy, 1.0))
    values, vectors = np.linalg.eigh(gram_in_blocks(residual, K) * np.outer(size, size))
    kept = vectors[:, values > RESIDUAL]
    return np.asarray(combine(residual, (size[:, None] * kept) @ (kept.T / size)))


def boundary_names(body: FEBody, family: str) -> tuple[list[str], list[str]]:
    """Return a label for each boundary dof, such as 'constraint bolts node 12 uz', and a group, 'constraint bolts'."""
    labels, groups = [], []
    for interface in body.interfaces:
        for dof in interface.dofs if interface.dofs is not None else ():
            node, component = body.dofs[dof]
            is_one_of_many = interface.kind == "nodes" and len(interface.nodes) > 1
            at_node = f" node {body.numbering.called(node)}" if is_one_of_many else ""
            labels.append(f"{family} {interface.name}{at_node} {MOTION_COMPONENTS[component]}")
            groups.append(f"{family} {interface.name}")
    return labels, groups
