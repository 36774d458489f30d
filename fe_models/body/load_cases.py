"""Load cases: named force vectors on a body, which couplings and the reduction transform with it."""

from collections.abc import Iterable
from dataclasses import dataclass
from typing import Annotated

import numpy as np

from fe_models.foundation.arrays import Array, require_shape
from fe_models.foundation.errors import ArgumentError, BodyError
from fe_models.foundation.presentation import presented
from fe_models.foundation.records import ArrayShape, checked_fields, frozen_copies

__all__ = ["LOAD_CASE_KINDS", "LoadCase", "ReducedLoadCase", "check_load_cases", "load_columns"]

LOAD_CASE_KINDS = ("pressure", "gravity", "force")  #: kinds of load cases in the job file; a body accepts any text


@presented
@frozen_copies
@dataclass(frozen=True, eq=False)
@checked_fields(ArgumentError)
class LoadCase:
    """Named load of unit amplitude: generalised forces on the dofs of its body.

    A coupling u_mesh = T u keeps the work and so transforms the forces to f = Tᵀ f_mesh; a reduction to Phiᵀ f.

    Parameters
    ----------
    name
        Name of the load case.
    kind
        Kind in one word, such as one of `LOAD_CASE_KINDS`.
    f
        Generalised forces over the dofs of the body, mesh axes, (n_dof,) [N, N m].
    """

    name: str
    kind: str
    f: Annotated[Array, ArrayShape(("n_dof",))]

    def __post_init__(self) -> None:
        if not self.name:
            raise BodyError("load case: expected a name, got none")


@presented
@frozen_copies
@dataclass(frozen=True, eq=False)
@checked_fields(ArgumentError)
class ReducedLoadCase:
    """Named load of unit amplitude on a reduced body: its resultant and its modal forces.

    Parameters
    ----------
    name
        Name of the load case.
    kind
        Kind of the load case, such as "pressure", "gravity" or "force".
    force
        Resultant force in B, (3,) [N].
    torque
        Resultant about the undeformed origin of B, (3,) [N m].
    h
        Modal forces Phiᵀ f, (n_q,) [N per unit of Phi].
    """

    name: str
    kind: str
    force: Annotated[Array, ArrayShape((3,))]
    torque: Annotated[Array, ArrayShape((3,))]
    h: Annotated[Array, ArrayShape(("n_q",))]


def check_load_cases(where: str, load_cases: tuple[LoadCase, ...], n_dof: int) -> None:
    """Raise `BodyError` if two load cases have the same name, or if the length of one is wrong."""
    names = [case.name for case in load_cases]
    if len(set(names)) != len(names):
        twice = next(name for name in names if names.count(name) > 1)
        raise BodyError(f"{where}: two load cases are named {twice!r}; give each its own name")
    for case in load_cases:
        require_shape(f"{where}: load case {case.name!r}: f", case.f, (n_dof,))


def load_columns(load_cases: Iterable[LoadCase], n_dof: int) -> Array:
    """Return the forces of the load cases as columns, (n_dof, n_load_cases)."""
    columns = [case.f for case in load_cases]
    return np.stack(columns, axis=1) if columns else np.zeros((n_dof, 0))
