"""Characteristic constraint modes: a few modes of an interface of kind "nodes" replace its many constraint modes."""

from dataclasses import dataclass, replace

import numpy as np
import scipy.linalg as la
import scipy.sparse as sp

from cms.errors import ModeSetError
from cms.linear_algebra.independent import gram_in_blocks
from cms.linear_algebra.solvers.mode_count import ModeCount, mode_count
from cms.modes.mode_set import ModeSet
from fe_models.body.fe_body import FEBody, Interface
from fe_models.body.rigid_motion import rigid_motion_of_dofs
from fe_models.foundation.arrays import Array, IntArray
from fe_models.foundation.sparse.sparse_product import SymmetricProduct
from fe_models.foundation.tall.columns import combine, in_memory, of_this_process
from fe_models.foundation.tall.on_disk import release

__all__ = ["with_characteristic_modes"]

COLUMNS_AT_ONCE = 64  #: number of columns that a sparse product copies at a time
#: remainder of a rigid-body motion of an interface, relative to its size, below which it depends on the others
DEPENDENT = 1e-9


def with_characteristic_modes(
    modes: ModeSet,
    body: FEBody,
    n_modes: int | ModeCount,
    *,
    together: bool = False,
) -> ModeSet:
    """Replace the constraint modes of every interface of kind "nodes" by characteristic constraint modes [1]_.

    (1) pencil of the constraint modes of the interface: K_c = Psi_Cᵀ K Psi_C, M_c = Psi_Cᵀ M Psi_C
    (2) rigid-body motions R of the interface are kept, so that it still follows rigid motions of its neighbours exactly
    (3) K_c z = omega² M_c z for motions without a rigid part, Rᵀ M_c z = 0; the lowest modes are kept
    (4) columns Psi_C [R, Z] replace Psi_C

    Parameters
    ----------
    modes
        A mode set with constraint modes (groups "constraint NAME"), such as `craig_bampton`.
    body
        The body from which the set was made.
    n_modes
        Number of deforming modes for each interface, or for all together if `together`. If fewer exist, all are kept.
        A `ModeCount` gives a cutoff frequency instead.
    together
        Whether to use one pencil for all these interfaces instead of one for each. The rigid-body motions of each
        interface are kept in both cases.

    Raises
    ------
    ModeSetError
        If the body has no interface of kind "nodes" that can deform, or the set has no constraint modes of it.

    References
    ----------
    .. [1] The reduction is a projection within the span of the constraint modes: docs/theory.md.
    """
    wanted = mode_count(n_modes)
    Psi_R = rigid_motion_of_dofs(body.nodes, body.dofs, body.nodes.mean(axis=0))
    parts = [
        _Part(
            (interface.name,),
            np.asarray(interface.dofs),
            _columns_of(modes, interface),
            _rigid_motions(interface, Psi_R),
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
    # vibration modes stay last, as in the original sets
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
    """Constraint modes that are processed together."""

    names: tuple[str, ...]  #: names of the interfaces
    dofs: IntArray  #: dofs that the constraint modes move, one for each mode, (n,)
    columns: IntArray  #: indices of these constraint modes among the columns of the set, (n,)
    R: Array  #: rigid-body motions of each interface, (n, n_r)


def _columns_of(modes: ModeSet, interface: Interface) -> IntArray:
    """Return the columns of the set that are constraint modes of an interface, in the order of its dofs."""
    columns = np.flatnonzero([group == f"constraint {interface.name}" for group in modes.groups])
    n = 0 if interface.dofs is None else len(interface.dofs)
    if len(columns) != n:
        raise ModeSetError(
            f"with_characteristic_modes: mode set {modes.name!r} has {len(columns)} constraint modes of interface "
            f"{interface.name!r} with {n} dofs; take a set with constraint modes, such as craig-bampton"
        )
    return columns


def _rigid_motions(interface: Interface, Psi_R: Array) -> Array:
    """Return independent rigid-body motions of the dofs of an interface, orthonormal, (n, n_r)."""
    motions = Psi_R[np.asarray(interface.dofs)]
    motions = motions / np.maximum(np.linalg.norm(motions, axis=0), np.finfo(float).tiny)
    U, size, _ = la.svd(motions, full_matrices=False)
    return U[:, size > DEPENDENT * size[0]]


def _side_of(columns: Array, chosen: IntArray) -> Array:
    """Return some of the columns, without a copy if they are contiguous."""
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
    """Return the lowest characteristic modes and their frequencies: steps (1) to (3)."""
    # K Psi_C is zero in the interior; Psi_C is the identity on its own boundary dofs and zero on the others
    rows = sp.csr_array(body.K[:, part.dofs].T)
    blocks = range(0, len(part.dofs), COLUMNS_AT_ONCE)
    K_c = np.hstack([rows @ in_memory(Psi_C[:, first : first + COLUMNS_AT_ONCE]) for first in blocks])
    K_c = (K_c + K_c.T) / 2
    M_c = gram_in_blocks(Psi_C, SymmetricProduct(body.M))
    n, n_r = part.R.shape
    Q, _ = la.qr(M_c @ part.R)
    X = Q[:, n_r:]  # the columns X satisfy Rᵀ M_c X = 0
    n_most = n - n_r
    if n_most == 0 or wanted.n == 0:
        return np.zeros((n, 0)), np.zeros(0)
    subset = None if wanted.n is None or wanted.n >= n_most else (0, wanted.n - 1)
    omega2, Y = la.eigh(X.T @ K_c @ X, X.T @ M_c @ X, subset_by_index=subset)
    frequencies = np.sqrt(np.maximum(omega2, 0.0)) / (2 * np.pi)
    count = len(frequencies) if wanted.cutoff is None else int((frequencies <= wanted.cutoff).sum())
    return X @ Y[:, :count], frequencies[:count]
