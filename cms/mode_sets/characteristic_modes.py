"""Characteristic constraint modes: a few modes of an all-node interface instead of its many constraint modes."""

from dataclasses import dataclass, replace

import numpy as np
import scipy.linalg as la
import scipy.sparse as sp

from cms.errors import ModeSetError
from cms.families.rigid_modes import geometric_rigid_modes
from cms.mode_set import ModeSet
from cms.reduced_basis.independent import gram_in_blocks
from cms.solvers.mode_count import ModeCount, mode_count
from cms.solvers.sparse_product import SymmetricProduct
from cms.solvers.tall import combine
from fe_models.body.fe_body import FEBody, Interface
from fe_models.foundation.arrays import Array, IntArray
from fe_models.foundation.tall.on_disk import in_memory, of_this_process, release

__all__ = ["with_characteristic_modes"]

COLUMNS_AT_ONCE = 64  #: that a sparse product copies
DEPENDENT = 1e-9  #: part of a rigid-body motion of an interface, below which it is one of the others


def with_characteristic_modes(
    modes: ModeSet,
    body: FEBody,
    n_modes: int | ModeCount,
    *,
    together: bool = False,
) -> ModeSet:
    """Replace the constraint modes of every all-node interface by characteristic constraint modes [1]_.

    (1) pencil of the constraint modes of the interface: K_c = Psi_Cᵀ K Psi_C, M_c = Psi_Cᵀ M Psi_C
    (2) rigid-body motions R of the interface: kept, so that it still follows every motion of its neighbours exactly
    (3) K_c z = omega² M_c z among the motions without rigid part, Rᵀ M_c z = 0; the lowest are kept
    (4) columns Psi_C [R, Z] in the place of Psi_C

    Parameters
    ----------
    modes
        A mode set with constraint modes (groups "constraint NAME"), such as `craig_bampton`.
    body
        The body the set was made from.
    n_modes
        Deforming modes for each interface, or for all of them if `together`; more than there are keeps all.
        A `ModeCount` says up to which frequency instead.
    together
        One pencil for all all-node interfaces instead of one each; the rigid-body motions of each are kept all the
        same.

    Raises
    ------
    ModeSetError
        If the body has no interface of kind "nodes" with more than
        rigid motion, or the set has no constraint modes of it.

    References
    ----------
    .. [1] The reduction is a projection within the span of the constraint modes: docs/theory.md.
    """
    wanted = mode_count(n_modes)
    Psi_R = geometric_rigid_modes(body, origin=body.nodes.mean(axis=0))
    parts = [
        _Part(
            (interface.name,),
            np.asarray(interface.dofs),
            _columns_of(modes, interface),
            _rigid_motions(body, interface, Psi_R),
        )
        for interface in body.interfaces
        if interface.kind == "nodes" and len(interface.nodes) > 1
    ]
    if not parts:
        raise ModeSetError(
            f"with_characteristic_modes: body {body.name!r} has no interface of kind 'nodes' with more than one node; "
            "leave the interface modes out"
        )
    if together:
        parts = [_side_by_side(parts)]
    kept = np.setdiff1d(np.arange(len(modes.labels)), np.concatenate([part.columns for part in parts]))
    V = of_this_process(modes.columns)
    columns, labels, groups = [V[:, kept]], [modes.labels[k] for k in kept], [modes.groups[k] for k in kept]
    options, data = dict(modes.options), dict(modes.data)
    for part in parts:
        Psi_C = _side_of(V, part.columns)
        Z, frequencies = _characteristic(body, Psi_C, part, wanted)
        n_r, n_z, name = part.R.shape[1], Z.shape[1], " + ".join(part.names)
        columns.append(combine(Psi_C, np.hstack([part.R, Z])))
        labels += [f"interface {name} rigid {k + 1}" for k in range(n_r)]
        labels += [f"interface {name} mode {k + 1}" for k in range(n_z)]
        groups += [f"interface {name} rigid"] * n_r + [f"interface {name} modes"] * n_z
        options[f"interface modes {name}"] = f"{n_r} rigid and {n_z} deforming, of {len(part.columns)} constraint modes"
        data[f"interface modes {name}"] = frequencies
    release(V)
    n_new = len(labels) - len(kept)
    # the vibration modes stay last, as in the sets themselves
    frequencies = np.concatenate([modes.frequencies[kept], np.full(n_new, np.nan)])
    order = np.argsort(~np.isnan(frequencies), kind="stable")
    return replace(
        modes,
        columns=np.hstack(columns)[:, order],
        labels=tuple(labels[k] for k in order),
        groups=tuple(groups[k] for k in order),
        frequencies=frequencies[order],
        options=options,
        data=data,
    )


@dataclass(frozen=True, eq=False)
class _Part:
    """Constraint modes that are treated together."""

    names: tuple[str, ...]  #: of the interfaces
    dofs: IntArray  #: that the constraint modes move, one each, (n,)
    columns: IntArray  #: their constraint modes in the set, (n,)
    R: Array  #: rigid-body motions of each interface, (n, n_r)


def _columns_of(modes: ModeSet, interface: Interface) -> IntArray:
    """Columns of the set that are the constraint modes of an interface, in the order of its dofs."""
    columns = np.flatnonzero([group == f"constraint {interface.name}" for group in modes.groups])
    n = 0 if interface.dofs is None else len(interface.dofs)
    if len(columns) != n:
        raise ModeSetError(
            f"with_characteristic_modes: mode set {modes.name!r} has {len(columns)} constraint modes of interface "
            f"{interface.name!r} with {n} dofs; take a set with constraint modes, such as craig-bampton"
        )
    return columns


def _rigid_motions(body: FEBody, interface: Interface, Psi_R: Array) -> Array:
    """Independent rigid-body motions of the dofs of an interface, orthonormal, (n, n_r)."""
    motions = Psi_R[np.asarray(interface.dofs)]
    motions = motions / np.maximum(np.linalg.norm(motions, axis=0), np.finfo(float).tiny)
    U, size, _ = la.svd(motions, full_matrices=False)
    return U[:, size > DEPENDENT * size[0]]


def _side_of(columns: Array, chosen: IntArray) -> Array:
    """Return some columns, without a copy where they stand side by side."""
    first, last = int(chosen[0]), int(chosen[-1]) + 1
    if np.array_equal(chosen, np.arange(first, last)):
        return columns[:, first:last]
    return columns[:, chosen]


def _side_by_side(parts: list[_Part]) -> _Part:
    return _Part(
        tuple(name for part in parts for name in part.names),
        np.concatenate([part.dofs for part in parts]),
        np.concatenate([part.columns for part in parts]),
        la.block_diag(*[part.R for part in parts]),
    )


def _characteristic(body: FEBody, Psi_C: Array, part: _Part, wanted: ModeCount) -> tuple[Array, Array]:
    """Lowest deforming modes of the constraint modes and their frequencies: (1) to (3)."""
    # K Psi_C is zero inside, and Psi_C the identity on its own dofs and zero on the others
    rows = sp.csr_array(body.K[:, part.dofs].T)
    blocks = range(0, len(part.dofs), COLUMNS_AT_ONCE)
    K_c = np.hstack([rows @ in_memory(Psi_C[:, first : first + COLUMNS_AT_ONCE]) for first in blocks])
    K_c = (K_c + K_c.T) / 2
    M_c = gram_in_blocks(Psi_C, SymmetricProduct(body.M))
    n, n_r = part.R.shape
    Q, _ = la.qr(M_c @ part.R)
    X = Q[:, n_r:]  # Rᵀ M_c X = 0
    n_most = n - n_r
    if n_most == 0 or wanted.n == 0:
        return np.zeros((n, 0)), np.zeros(0)
    subset = None if wanted.n is None or wanted.n >= n_most else (0, wanted.n - 1)
    omega2, Y = la.eigh(X.T @ K_c @ X, X.T @ M_c @ X, subset_by_index=subset)
    frequencies = np.sqrt(np.maximum(omega2, 0.0)) / (2 * np.pi)
    count = len(frequencies) if wanted.cutoff is None else int((frequencies <= wanted.cutoff).sum())
    return X @ Y[:, :count], frequencies[:count]
