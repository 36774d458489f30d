"""A mode set: displacement columns that span a reduction basis, each with a description of its origin."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from types import MappingProxyType

import numpy as np

from cms.errors import ModeSetError
from fe_models.foundation.arrays import Array, frozen
from fe_models.foundation.presentation import presented
from fe_models.foundation.tall.columns import are_finite, frozen_columns

__all__ = ["ModeSet"]


@presented
@dataclass(frozen=True, eq=False)
class ModeSet:
    """Columns over all dofs of a coupled body, before the finishing step of `reduce`.

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
    """

    name: str
    columns: Array
    labels: tuple[str, ...]
    frequencies: Array
    options: Mapping[str, str] = field(default_factory=dict)
    groups: tuple[str, ...] = ()
    data: Mapping[str, Array] = field(default_factory=dict)

    def __post_init__(self) -> None:
        object.__setattr__(self, "columns", frozen_columns(self.columns))
        object.__setattr__(self, "labels", tuple(self.labels))
        groups = tuple(self.groups) or tuple(label.rsplit(" ", 1)[0] for label in self.labels)
        object.__setattr__(self, "groups", groups)
        object.__setattr__(self, "frequencies", frozen(self.frequencies))
        object.__setattr__(self, "options", MappingProxyType(dict(self.options)))
        object.__setattr__(self, "data", MappingProxyType({name: frozen(x) for name, x in self.data.items()}))
        n_columns = self.columns.shape[1]
        if not len(self.labels) == len(self.groups) == n_columns or self.frequencies.shape != (n_columns,):
            raise ModeSetError(
                f"mode set {self.name!r}: {n_columns} columns need as many labels and frequencies, got "
                f"{len(self.labels)} and {self.frequencies.shape}"
            )
        if not are_finite(self.columns):
            raise ModeSetError(f"mode set {self.name!r}: expected finite numbers, got NaN or infinite ones")

    @property
    def is_static(self) -> np.ndarray:
        """Whether each column is static, (n_columns,) bool."""
        return np.isnan(self.frequencies)
