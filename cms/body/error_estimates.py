"""How wrong a reduced body may be: estimates that were made with it, and are stored beside its modes."""

from dataclasses import dataclass, field
from typing import Annotated

import numpy as np

from cms.body.left_out_modes import LeftOutModes
from fe_models.foundation.arrays import Array
from fe_models.foundation.errors import ArgumentError
from fe_models.foundation.records import ArrayShape, checked_fields, frozen_copies

__all__ = ["MESH_SIGNS", "ErrorEstimates", "are_uncertain"]

MESH_SIGNS = {"+": "+", "+-": "±", "signed": "+"}  #: sign of a positive error by the mesh, by `mesh_sign`

UNCERTAIN = 5.0  #: ratio of the largest error to the estimate, above which the estimate is uncertain
ROUNDING = 1e-9  #: largest error that is rounding


@frozen_copies
@dataclass(frozen=True, eq=False)
@checked_fields(ArgumentError)
class ErrorEstimates:
    """Errors of a reduced body with four digits: by the reduction, and by the mesh (docs/theory.md §8).

    Parameters
    ----------
    frequency
        Estimate of f_reduced / f - 1 for each of the lowest free frequencies, (n_judged,), where f is the exact
        frequency of the same number. The exact error is not smaller.
    bound
        Bound b, (n_judged,): some exact frequency f satisfies |(f_reduced / f)² - 1| <= b, if the random tests of
        large sets measure enough of the residual.
    shape
        Estimate of the error of each shape in the norm of strain energy, relative to the shape, (n_judged,).
    response
        Estimate of the error of the receptance between the interfaces around each frequency, relative to the
        receptance, (n_judged,): root mean square over the frequencies halfway to those beside it, Frobenius norm with
        rotations times the length of the body, 1 % damping in every mode. Empty: the body has no interface.
    interface_loads
        Names of the unit loads at interfaces, or of random sums of them if they are very many, (n_loads,).
    interface
        Error of the static response to each of these loads, in the norm of strain energy, (n_loads,); NaN: the load
        does not deform the body.
    inertia
        Error of the static response to each rigid-body acceleration while the interfaces are fixed, in the norm of
        strain energy, (n_r,); NaN: the acceleration does not deform the body.
    method
        How the estimates were made, in words.
    date
        Day on which they were made, such as "2027-01-31".
    mesh
        Estimate of the relative error of each frequency of the finite element model by its mesh, (n_judged,); NaN: not
        known, 10: 10 or more. Empty: not estimated.
    mesh_sign
        "+": these frequencies are too high; "+-": too high or too low; "signed": too high where `mesh` is positive.
    mesh_method
        How `mesh` was estimated, or why it is not known.
    largest
        Largest f_reduced / f - 1 of each frequency, whatever modes are beyond the cutoff of the set,
        (n_judged,); NaN: not limited. Empty: the set has no vibration modes, or the file is older.
    left_out
        Shapes that the mode set lacks, over the loads of a motion; None: not recorded.
    """

    frequency: Annotated[Array, ArrayShape(("n_judged",))]
    bound: Annotated[Array, ArrayShape(("n_judged",))]
    shape: Annotated[Array, ArrayShape(("n_judged",))]
    response: Annotated[Array, ArrayShape(("n_responses",))] = field(default_factory=lambda: np.zeros(0))
    interface_loads: Annotated[tuple[str, ...], ArrayShape(("n_loads",))] = ()
    interface: Annotated[Array, ArrayShape(("n_loads",), has_nan=True)] = field(default_factory=lambda: np.zeros(0))
    inertia: Annotated[Array, ArrayShape((None,), has_nan=True)] = field(default_factory=lambda: np.zeros(0))
    method: str = ""
    date: str = ""
    mesh: Annotated[Array, ArrayShape((None,), has_nan=True)] = field(default_factory=lambda: np.zeros(0))
    mesh_sign: str = ""
    mesh_method: str = ""
    largest: Annotated[Array, ArrayShape((None,), has_nan=True)] = field(default_factory=lambda: np.zeros(0))
    left_out: LeftOutModes | None = None

    @property
    def distance(self) -> Array:
        """Bound of |f_reduced / f - 1| for some exact frequency f, (n_judged,); inf: no bound."""
        return np.where(self.bound < 1, 1 - np.sqrt(np.maximum(1 - self.bound, 0.0)), np.inf)

    @property
    def is_uncertain(self) -> Array:
        """Whether a frequency may be wrong by more than five times its estimate, (n_judged,) bool."""
        return are_uncertain(self.frequency, self.largest)


def are_uncertain(frequency: Array, largest: Array) -> Array:
    """Return whether largest errors are more than five times the estimates, (n,) bool; False if they are not known."""
    if not len(largest):
        return np.zeros(len(frequency), dtype=bool)
    return np.asarray(~(largest <= np.maximum(UNCERTAIN * frequency, ROUNDING)))
