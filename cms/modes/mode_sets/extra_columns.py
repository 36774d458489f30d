"""Extra columns for any mode set: static responses to load cases and steady rotation, modes beyond the cutoff."""

from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np

from cms.errors import ModeSetError
from cms.modes.centrifugal import CENTRIFUGAL, centrifugal_loads
from cms.modes.families.families import Families, body_of, families_of
from cms.modes.families.rigid_modes import without_energy
from cms.modes.mode_set import ModeSet
from fe_models.body.fe_body import FEBody
from fe_models.body.load_cases import LoadCase, load_columns
from fe_models.foundation.arrays import Array
from fe_models.foundation.sparse.sparse_product import SymmetricProduct
from fe_models.foundation.tall.columns import beside, in_memory
from fe_models.foundation.words import nearest, quoted

__all__ = ["BEYOND", "EXTRA_COLUMNS", "with_centrifugal", "with_load_cases", "with_modes_beyond"]

BEYOND = "beyond cutoff"  #: group of the columns of `with_modes_beyond`

IN_THE_SPAN = 1e-6  #: part of a response outside the span, in the energy norm, below which the response is not added
#: energy of a column relative to the sum of the energies of its single dofs, below which it is rigid-body motion
ROUNDING = 1e-13


def with_load_cases(modes: ModeSet, body: FEBody | Families, *, names: Sequence[str] | None = None) -> ModeSet:
    """Add the static responses to the load cases of a body to a mode set.

    (1) held: K_II⁻¹ f_I with all boundary dofs held; makes the response of a supported body exact
    (2) accelerating: Pᵀ G P f of the free body, in equilibrium with its acceleration; makes the free motion exact
    (3) add only the part u - V (Vᵀ K V)⁺ Vᵀ K u of each response, which is outside the span of the set, and only if it
        exceeds 1e-6 of the response and its energy exceeds rounding (rigid-body motion has no energy)

    A statically complete set needs one column per load case, other sets two. Uniform gravity has no response (2).

    Parameters
    ----------
    modes
        A mode set of this body.
    body
        A coupled body with load cases, or its `Families`.
    names
        Names of the load cases; default: all except centrifugal ones.

    Raises
    ------
    ModeSetError
        If there are no load cases, or no load case has that name.
    """
    source, body = body, body_of(body)
    cases = [case for case in body.load_cases if case.kind != CENTRIFUGAL]
    if not cases:
        raise ModeSetError(
            f"with_load_cases: body {body.name!r} has no load cases; give it some before it is coupled, or leave the "
            "extra columns out"
        )
    if names is not None:
        by_name = {case.name: case for case in cases}
        for name in names:
            if name not in by_name:
                raise ModeSetError(
                    f"with_load_cases: body {body.name!r}: no load case {quoted(name)}{nearest(name, by_name)}"
                )
        cases = [by_name[name] for name in names]
    return _with_responses(modes, source, cases, "load case")


def with_centrifugal(modes: ModeSet, body: FEBody | Families) -> ModeSet:
    """Add the static responses to the six centrifugal fields of steady rotation to a mode set.

    This works like `with_load_cases`, with the loads of `centrifugal_loads`. A rigid interface eliminates its members.
    Their centrifugal field is not a rigid motion, so the load must be computed before coupling:

    >>> body = replace(body, load_cases=(*body.load_cases, *centrifugal_loads(body)))  # doctest: +SKIP
    >>> modes = with_centrifugal(modes, couple(body))                                  # doctest: +SKIP

    Parameters
    ----------
    modes
        A mode set of the body.
    body
        The coupled body, or its `Families`.

    Raises
    ------
    ModeSetError
        If the body has rigid interfaces but no centrifugal loads.
    """
    source, body = body, body_of(body)
    cases: Sequence[LoadCase] = [case for case in body.load_cases if case.kind == CENTRIFUGAL]
    if not cases:
        T = None if body.recovery is None else body.recovery.matrix
        if T is not None and (T.nnz != T.shape[0] or not (T.data == 1.0).all()):
            raise ModeSetError(
                f"with_centrifugal: body {body.name!r} has eliminated dofs (rigid interfaces), whose centrifugal load "
                "does not follow from the coupled mass; add centrifugal_loads(body) to its load cases before coupling"
            )
        cases = centrifugal_loads(body)
    return _with_responses(modes, source, cases, "")


def with_modes_beyond(modes: ModeSet, more: ModeSet) -> ModeSet:
    """Add the next vibration modes to a mode set, in a group of their own, which families of bodies recognise.

    Parameters
    ----------
    modes
        A mode set.
    more
        The same set with more vibration modes. Only these are taken: its static columns may differ.
    """
    new = [k for k, label in enumerate(more.labels) if not more.is_static[k] and label not in modes.labels]
    return replace(
        modes,
        columns=beside(modes.columns, more.columns[:, new]),
        labels=(*modes.labels, *(more.labels[k] for k in new)),
        groups=(*modes.groups, *[BEYOND] * len(new)),
        frequencies=np.concatenate([modes.frequencies, more.frequencies[new]]),
        options={**modes.options, "modes beyond the cutoff": str(len(new))},
    )


EXTRA_COLUMNS: dict[str, Callable[..., ModeSet]] = {"load-cases": with_load_cases, "centrifugal": with_centrifugal}


def _with_responses(modes: ModeSet, source: FEBody | Families, cases: Sequence[LoadCase], family: str) -> ModeSet:
    body = body_of(source)
    if modes.columns.shape[0] != body.n_dof:
        raise ModeSetError(
            f"extra columns: mode set {modes.name!r} has columns of {modes.columns.shape[0]} dofs, body {body.name!r} "
            f"has {body.n_dof}; make the set from this body"
        )
    F = load_columns(cases, body.n_dof)
    names = [f"{family} {case.name}".strip() for case in cases]
    columns, labels, groups, known = in_memory(modes.columns), [*modes.labels], [*modes.groups], []
    with families_of(source) as families:
        held = np.zeros_like(F)
        held[families.fixed.i] = families.fixed.factorization.solve(F[families.fixed.i])  # (1)
        for support, responses in (("held", held), ("accelerating", families.flexibility(F))):  # (2)
            new, is_new = _not_in_span(body, columns, responses, F)  # (3)
            columns = np.hstack([columns, new])
            labels += [f"{name} {support}" for name, is_it in zip(names, is_new, strict=True) if is_it]
            groups += [name for name, is_it in zip(names, is_new, strict=True) if is_it]
            known += [f"{name} {support}" for name, is_it in zip(names, is_new, strict=True) if not is_it]
    n_new = len(labels) - len(modes.labels)
    return replace(
        modes,
        columns=columns,
        labels=tuple(labels),
        groups=tuple(groups),
        frequencies=np.concatenate([modes.frequencies, np.full(n_new, np.nan)]),
        options={
            **modes.options,
            f"extra {family or CENTRIFUGAL} columns": str(n_new),
            f"extra {family or CENTRIFUGAL} columns in the span already": "; ".join(known) or "none",
        },
    )


def _not_in_span(body: FEBody, V: Array, U: Array, F: Array) -> tuple[Array, np.ndarray]:
    """Return K-orthonormal parts of the responses U to loads F outside the span of V, and which responses are new."""
    K = SymmetricProduct(body.K)
    KV = K @ V
    G = V.T @ KV
    diagonal = np.abs(body.K.diagonal())
    size = np.sqrt(np.maximum(np.diag(G), 0.0))
    is_elastic = size**2 > ROUNDING * np.einsum("n,nk,nk->k", diagonal, V, V)
    V, KV, size = V[:, is_elastic] / size[is_elastic], KV[:, is_elastic] / size[is_elastic], size[is_elastic]
    G = G[np.ix_(is_elastic, is_elastic)] / np.outer(size, size)
    energy = np.abs(np.einsum("nk,nk->k", U, F))
    local = np.einsum("n,nk,nk->k", np.divide(1.0, diagonal, out=np.zeros_like(diagonal), where=diagonal > 0), F, F)
    rest = U
    for _ in range(2):  # two passes suffice
        rest = rest - V @ np.linalg.lstsq(G, KV.T @ rest, rcond=ROUNDING)[0]
    new, is_new = np.zeros((len(U), 0)), np.zeros(U.shape[1], bool)
    for k in range(U.shape[1]):
        x = rest[:, [k]] - new @ (new.T @ (K @ rest[:, [k]]))  # responses to proportional loads are added only once
        left = abs(float(x[:, 0] @ (K @ x)[:, 0]))
        # if rigid-body acceleration balances the load, the energy is rounding, far below the energy of its single dofs
        is_new[k] = left > IN_THE_SPAN**2 * energy[k] and energy[k] > IN_THE_SPAN**2 * local[k]
        is_new[k] &= not without_energy(body, x)[0]
        if is_new[k]:
            new = np.hstack([new, x / np.sqrt(left)])
    return new, is_new
