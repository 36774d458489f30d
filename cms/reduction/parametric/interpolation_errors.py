"""Error of a reduced body that was interpolated between samples, by comparison with a reduction at the same values."""

from collections.abc import Callable, Iterable
from dataclasses import dataclass
from typing import Annotated, Any

import numpy as np

from cms.body.reduced_body import ReducedBody
from fe_models.foundation.arrays import Array
from fe_models.foundation.errors import ArgumentError
from fe_models.foundation.records import ArrayShape, checked_fields, frozen_copies

__all__ = ["InterpolationErrors", "errors_between", "largest_errors", "sum_of_errors"]

ROUNDING = 1e-9  #: relative error, below which the output says "exact"


@frozen_copies
@dataclass(frozen=True, eq=False)
@checked_fields(ArgumentError)
class InterpolationErrors:
    """Relative errors of an interpolated reduced body.

    Parameters
    ----------
    frequency
        Error of each frequency with the frame fixed, as in `ReducedBody.frequencies`, (n_q,).
    free_frequency
        Error of each of `ReducedBody.free_frequencies`, (n_free,).
    static
        Error of the static response of the interfaces to loads at the interfaces with the frame fixed: Frobenius norm,
        with rotations times the size of the body.
    mass, inertia
        Errors of the mass, and of the inertia tensor about the origin of the frame (Frobenius norm).
    method
        Description of the samples at which the error was found.
    """

    frequency: Annotated[Array, ArrayShape(("n_q",))]
    free_frequency: Annotated[Array, ArrayShape(("n_free",))]
    static: float
    mass: float
    inertia: float
    method: str = ""

    def rows(self) -> list[tuple[str, str]]:
        """Return the errors with their names, for tables."""
        n_free = len(self.free_frequency)
        return [
            ("first frequency, frame fixed", percent(self.frequency[0])),
            (f"lowest {(len(self.frequency) + 1) // 2} of these", percent(lower_half(self.frequency))),
            *([("first free frequency", percent(self.free_frequency[0]))] if n_free else []),
            *([(f"lowest {(n_free + 1) // 2} of these", percent(lower_half(self.free_frequency)))] if n_free else []),
            ("static response of interfaces", percent(self.static)),
            ("mass", percent(self.mass)),
            ("inertia", percent(self.inertia)),
        ]


def lower_half(errors: Array) -> float:
    """Return the largest error in the lower half of the modes."""
    return float(errors[: (len(errors) + 1) // 2].max())


def percent(error: float) -> str:
    """Return a relative error in percent; "exact" if it is rounding."""
    return "exact" if error < ROUNDING else f"{100 * error:.2g} %"


def errors_between(body: ReducedBody, truth: ReducedBody) -> InterpolationErrors:
    """Return the errors of an interpolated body relative to a reduction at the same values of the parameters."""
    J, J_truth = body.moments.J0, truth.moments.J0
    return InterpolationErrors(
        frequency=np.abs(body.frequencies / truth.frequencies - 1),
        free_frequency=np.abs(body.free_frequencies / truth.free_frequencies - 1),
        static=relative(flexibility(body), flexibility(truth)),
        mass=abs(body.moments.m / truth.moments.m - 1),
        inertia=relative(J, J_truth),
    )


def flexibility(body: ReducedBody) -> Array:
    """Return Psi K⁻¹ Psiᵀ of all interfaces, rotations times the size of the body, (6 n_interfaces, 6 n_interfaces)."""
    if not body.interfaces:
        return np.zeros((0, 0))
    size = float(np.linalg.norm(np.ptp(body.nodes, axis=0))) if len(body.nodes) else 1.0
    scale = np.array([1.0, 1, 1, size, size, size])[:, None]
    Psi = np.vstack([scale * interface.Psi for interface in body.interfaces])
    return np.asarray(Psi / np.diag(body.K) @ Psi.T)


def relative(value: Array, truth: Array) -> float:
    """Return the norm of the difference relative to the truth; 0 if both are zero."""
    size, difference = float(np.linalg.norm(truth)), float(np.linalg.norm(value - truth))
    return difference / size if size else difference


def largest_errors(errors: Iterable[InterpolationErrors]) -> InterpolationErrors:
    """Return the largest of the errors at several places."""
    return combined(errors, np.max)


def sum_of_errors(errors: Iterable[InterpolationErrors]) -> InterpolationErrors:
    """Return the sum of the errors of several parameters."""
    return combined(errors, np.sum)


def combined(errors: Iterable[InterpolationErrors], combine: Callable[..., Any]) -> InterpolationErrors:
    """Return each error combined over the places."""
    each = list(errors)
    return InterpolationErrors(
        frequency=combine([error.frequency for error in each], axis=0),
        free_frequency=combine([error.free_frequency for error in each], axis=0),
        static=float(combine([error.static for error in each])),
        mass=float(combine([error.mass for error in each])),
        inertia=float(combine([error.inertia for error in each])),
    )
