"""A mode set: displacement columns that span a reduction basis, each with a description of its origin.

The functions that make mode sets (`cms/modes/mode_sets`) assemble them from blocks of columns of one family.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from itertools import count
from types import MappingProxyType
from typing import Annotated, Any, Protocol

import numpy as np

from cms.errors import ModeSetError
from cms.linear_algebra.solvers.eigen import EigenResult, GuardModes
from cms.linear_algebra.solvers.mode_count import ModeCount
from cms.modes.families.families import Families
from cms.modes.families.static_modes import boundary_names
from fe_models.body.fe_body import FEBody
from fe_models.foundation.arrays import MOTION_COMPONENTS, Array, frozen
from fe_models.foundation.errors import ArgumentError
from fe_models.foundation.presentation import presented
from fe_models.foundation.ranks.spread_columns import spread_beside
from fe_models.foundation.records import ArrayShape, checked_fields
from fe_models.foundation.tall.columns import beside

__all__ = [
    "Block", "ModeSet", "boundary_block", "checked_modes", "constraint_block", "mode_set", "require_interfaces",
    "rigid_block", "vibration_block",
]  # fmt: skip

VERIFIED = "yes: a second factorisation counted the modes, and none is missing"
NOT_VERIFIED = (
    "no: the modes were not counted; verify = true in [reduction] of the job counts them by one more factorisation"
)


@presented
@dataclass(frozen=True, eq=False)
@checked_fields(ArgumentError, misfit=ModeSetError)
class ModeSet:
    """Columns of a mode set over all dofs of a coupled body, before the finishing step of `reduce`.

    Parameters
    ----------
    name
        Key in the registry, such as "craig-bampton".
    columns
        Displacement columns, (n_dof, n_columns); `SpreadColumns` if the body is distributed over ranks.
    labels
        Label of each column, such as "constraint big_end ux", "fixed-interface 3".
    frequencies
        Frequency of each column in its own eigenvalue problem, (n_columns,) [Hz]; NaN for static columns.
    options
        Requested options, and the solver that was used.
    groups
        Group of each column, such as "constraint big_end"; default: the label without its last word.
    data
        Numerical data of the set, such as Hankel singular values.
    guards
        Approximate modes above the vibration modes of the set, for estimates of its error; None: not known.
    """

    name: str
    columns: Annotated[Array, ArrayShape((None, "n_columns"))]
    labels: Annotated[tuple[str, ...], ArrayShape(("n_columns",))]
    frequencies: Annotated[Array, ArrayShape(("n_columns",), has_nan=True)]
    options: Mapping[str, str] = field(default_factory=dict)
    groups: tuple[str, ...] = ()
    data: Mapping[str, Array] = field(default_factory=dict)
    guards: GuardModes | None = None

    def __post_init__(self) -> None:
        groups = tuple(self.groups) or tuple(label.rsplit(" ", 1)[0] for label in self.labels)
        object.__setattr__(self, "groups", groups)
        object.__setattr__(self, "options", MappingProxyType(dict(self.options)))
        object.__setattr__(self, "data", MappingProxyType({name: frozen(x) for name, x in self.data.items()}))
        if len(self.groups) != len(self.labels):
            raise ModeSetError(f"mode set {self.name!r}: {len(self.labels)} labels, but {len(self.groups)} groups")

    @property
    def is_static(self) -> np.ndarray:
        """Whether each column is static, (n_columns,) bool."""
        return np.isnan(self.frequencies)

    def __add__(self, other: "ModeSet") -> "ModeSet":
        """Return the columns of two sets of one body side by side; `reduce` drops those that depend on others."""
        if not isinstance(other, ModeSet):
            return NotImplemented
        if len(self.columns) != len(other.columns):
            raise ModeSetError(
                f"{self.name} + {other.name}: expected mode sets of one body, got columns of {len(self.columns)} and "
                f"of {len(other.columns)} dofs"
            )
        return ModeSet(
            f"{self.name} + {other.name}",
            beside(self.columns, other.columns),
            (*self.labels, *other.labels),
            np.concatenate([self.frequencies, other.frequencies]),
            named_by_set([self, other], [self.options, other.options]),
            (*self.groups, *other.groups),
            named_by_set([self, other], [self.data, other.data]),
        )


def named_by_set(sets: Sequence[ModeSet], entries: Sequence[Mapping[str, Any]]) -> dict[str, Any]:
    """Return the entries of sets in one dictionary, each with the name of its set in front; a second one is numbered.

    Entries of a sum have such names already.
    """
    found: dict[str, Any] = {}
    for each, own in zip(sets, entries, strict=True):
        names = tuple(f"{name} " for name in each.name.split(" + "))
        for key, value in own.items():
            named = key if key.startswith(names) else f"{each.name} {key}"
            numbered = (f"{named} {k}" for k in count(2))
            found[named if named not in found else next(name for name in numbered if name not in found)] = value
    return found


# blocks of columns of one family -------------------------------------------------------------------------------------


@dataclass(frozen=True, eq=False)
class Block:
    """Named columns of one family."""

    columns: Array  #: displacement columns, (n_dof, k)
    labels: Sequence[str]  #: label of each column, (k,)
    groups: Sequence[str]  #: group of each column, (k,)
    frequencies: Array | None = None  #: frequency of each column, (k,); None for static columns


def boundary_block(body: FEBody, columns: Array, family: str) -> Block:
    """Return a block with the static columns of a family, one for each boundary dof."""
    return Block(columns, *boundary_names(body, family))


def constraint_block(families: Families) -> Block:
    """Return the block of constraint modes."""
    return Block(families.Psi_C, *families.held_names("constraint"))


def rigid_block(families: Families, columns: Array, family: str) -> Block:
    """Return a block with the columns of a family, one for each rigid-body mode."""
    labels = [f"{family} {MOTION_COMPONENTS[k]}" for k in families.rigid_components]
    return Block(columns, labels, [family] * len(labels))


def vibration_block(kind: str, modes: EigenResult, columns: Array | None = None) -> Block:
    """Return a block of vibration modes, or of columns derived from them, one for each mode."""
    n = len(modes.frequencies)
    return Block(
        modes.Phi if columns is None else columns,
        [f"{kind} {k + 1}" for k in range(n)],
        [kind] * n,
        modes.frequencies,
    )


def mode_set(
    name: str,
    families: Families,
    blocks: Sequence[Block],
    *,
    modes: EigenResult | None = None,
    wanted: ModeCount | None = None,
    options: Mapping[str, str] | None = None,
    data: Mapping[str, Array] | None = None,
) -> ModeSet:
    """Assemble blocks into a mode set, and record the requested options and the solver used."""
    recorded = {"solver": families.fixed.factorization.description}
    if modes is not None:
        recorded |= {"n_modes": str(len(modes.frequencies))}
        if len(modes.frequencies):
            recorded |= {"verified": VERIFIED if modes.is_proven else NOT_VERIFIED, "eigensolver": modes.method}
    if wanted is not None and wanted.cutoff is not None:
        recorded["cutoff"] = repr(float(wanted.cutoff))
    columns, layout = [block.columns for block in blocks], families.body.layout
    if layout is not None:  # a distributed body needs distributed columns, even if none of the blocks is distributed
        whole: Any = spread_beside(layout, *columns)
    else:
        whole = beside(*columns) if len(columns) > 1 else columns[0]
    return ModeSet(
        name,
        whole,
        tuple(label for block in blocks for label in block.labels),
        np.concatenate([np.full(len(b.labels), np.nan) if b.frequencies is None else b.frequencies for b in blocks]),
        {**recorded, **(options or {})},
        tuple(group for block in blocks for group in block.groups),
        data or {},
        None if modes is None else modes.guards,
    )


# checks common to all mode sets with vibration modes: how many modes are wanted, and whether that is possible ---------


class Finder(Protocol):
    """Method of `Families` that computes vibration modes."""

    def __call__(self, n_modes: ModeCount) -> EigenResult: ...


def require_interfaces(name: str, body: FEBody) -> None:
    """Raise `ModeSetError` if a set of interface modes is requested for a body without interfaces."""
    if len(body.b) == 0:
        raise ModeSetError(f"{name}: body {body.name!r} has no interface; give it at least one, or take free modes")


def checked_modes(
    name: str,
    kind: str,
    find: Finder,
    body: FEBody,
    wanted: ModeCount,
) -> EigenResult:
    """Compute the vibration modes that a set requests, after a check of their number.

    Parameters
    ----------
    name
        Name of the set, for messages.
    kind
        Kind of modes, for messages, such as "fixed-interface".
    find
        Method of `Families` that computes modes by number or cutoff.
    wanted
        Number of modes, or cutoff.

    Raises
    ------
    ModeSetError
        If there are fewer dofs than modes, or no mode lies below the cutoff.
    """
    n_i, cutoff = body.n_dof - len(body.b), wanted.cutoff
    is_fixed = kind == "fixed-interface"
    if wanted.n is not None and wanted.n > (n_i if is_fixed else body.n_dof):
        raise ModeSetError(
            f"{name}: n_modes = {wanted.n}, but body {body.name!r} has {n_i} interior dofs"
            + (f"; choose 0 <= n_modes <= {n_i}" if is_fixed else f" and {body.n_dof} in all; choose fewer")
        )
    modes = find(wanted)
    if cutoff is not None and not len(modes.frequencies) and (n_i or not is_fixed):
        first = find(ModeCount(1)).frequencies[0]
        in_hertz = f"{cutoff / body.units.time:g} Hz, {first / body.units.time:.6g} Hz"
        raise ModeSetError(
            f"{name}: cutoff = {cutoff:g} lies below the first {kind} mode of body {body.name!r}, at {first:.6g} "
            f"({in_hertz}); choose a higher cutoff, or n_modes = 0"
        )
    return modes
