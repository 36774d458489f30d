"""A reduced body as a function of one to three design parameters, interpolated between samples.

(1) the samples are reduced bodies at the points of a grid, with the same mode set, frame, mesh and interfaces, over
    modes that all have in common (`common_modes`)
(2) they are converted to mean axes, in which modes have no momentum. In another frame the mass of the free body is a
    small difference of large terms, which would be interpolated one by one
(3) their modes are aligned with those of the sample in the middle, and scaled to the mass (`alignment`)
(4) stiffness: the logarithms of the matrices omega² are interpolated, with the logarithms of the parameters as
    abscissae. The result is positive definite, and power laws are exact: omega² of a beam is proportional to length^-4
(5) all other arrays: entry by entry, with the parameters as abscissae. M = m 1 follows, because the moments contain it.
    The radii of gyration that scale them are interpolated as powers of the parameters
(6) new modes from the eigenvectors of the logarithm, which are those of omega². Their eigenvalues have the relative
    accuracy of the logarithm, also if omega² extends over many decades
(7) conversion to the frame of the samples, and the damping of its modes that the samples state, such as a ratio

Both interpolations use the polynomial through all values of each parameter. Interpolation of the logarithm itself is
that of the log-Euclidean metric [1]_. It needs no reference matrix, and keeps soft modes apart from stiff ones.

References
----------
.. [1] Arsigny et al. (2007); Amsallem & Farhat (2011) for reduced models, docs/bibliography.md.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, fields, replace
from functools import cached_property
from itertools import product
from typing import Any

import numpy as np

from cms.body.invariants import NEGATIVITY
from cms.body.reduced_body import ReducedBody
from cms.errors import BodyError
from cms.linear_algebra.solvers.eigen import orientation
from cms.reduction.parametric.alignment import (
    AlignedSample,
    align,
    divisors,
    in_frame,
    in_mean_axes,
    recombined,
    rescaled,
)
from cms.reduction.parametric.blending import blended
from cms.reduction.parametric.common_modes import has_modes_beyond, in_common_modes
from cms.reduction.parametric.interpolation_errors import (
    InterpolationErrors,
    errors_between,
    largest_errors,
    sum_of_errors,
)
from cms.reduction.reduction import OF_MASSES
from fe_models.foundation.arrays import Array
from fe_models.foundation.errors import ArgumentError
from fe_models.foundation.presentation import Summary, presented
from fe_models.foundation.records import FrozenMapping, checked_fields
from fe_models.foundation.words import nearest, quoted, shortened

__all__ = ["ParametricBody", "fault_of_values", "middle_point", "parametric_body", "point_name"]

MOST_PARAMETERS = 3
MOST_VALUES = 7  #: values of a parameter; polynomials through more equidistant values oscillate
ROUNDING = 1e-9  #: distance from the sampled range, relative to its length, that counts as inside
#: provenance that must agree among the samples, and what it is
SAME_REDUCTION = {
    "damping": "damping",
    "mode set": "mode set",
    "mode set redundant": "columns dropped from the mode set",
    "mode set columns": "number of columns of the mode set",
}
OF_MODES = ("mode set columns",)  #: of these, what differs with the number of modes

#: fields of an interpolated body that are those of the nearest sample, or replaced
OF_NEAREST = (
    "M", "K", "labels", "sources", "energy_shares", "free_frequencies", "provenance", "columns", "errors",
)  # fmt: skip
SAME_MODES = "Give n_modes a number instead of a cutoff or an error, and the same to all samples"
SAME_MESH = "A parameter may move nodes, but not change their number: scale one mesh instead of meshing anew"
#: numbers of things that must agree among the samples
SIZES: dict[str, Callable[[ReducedBody], int]] = {
    "number of kept nodes": lambda body: len(body.nodes),
    "number of nodes with rotations": lambda body: 0 if body.kept is None else len(body.kept.nodes),
}


@presented
@dataclass(frozen=True, eq=False)
@checked_fields(ArgumentError)
class ParametricBody:
    """Reduced bodies at the points of a grid of design parameters; `at` interpolates between them.

    Parameters
    ----------
    values
        Ascending sampled values of each parameter by name.
    samples
        Reduced bodies at all points of the grid; the last parameter varies fastest.
    errors
        Estimated errors of interpolated bodies; None: not estimated.
    """

    values: Mapping[str, tuple[float, ...]]
    samples: tuple[ReducedBody, ...]
    errors: InterpolationErrors | None = None

    def __post_init__(self) -> None:
        checked = {name: tuple(float(x) for x in given) for name, given in self.values.items()}
        object.__setattr__(self, "values", FrozenMapping(checked))
        object.__setattr__(self, "samples", tuple(self.samples))
        checked_grid(checked, self.samples)
        require_same_reduction(self.samples, self.names)
        if self.errors is not None and len(self.errors.frequency) != self.samples[0].n_q:
            raise BodyError(
                f"parametric body: {self.samples[0].n_q} modes, but errors of {len(self.errors.frequency)} frequencies"
            )

    def summary(self) -> Summary:
        """Return what `repr` and notebooks show: parameters with their values, modes, and errors."""
        rows = [(name, ", ".join(f"{x:g}" for x in given)) for name, given in self.values.items()]
        rows += [] if self.errors is None else self.errors.rows()
        return Summary(f"ParametricBody {self.samples[0].name!r}: {self.samples[0].n_q} modes", rows)

    @property
    def points(self) -> list[dict[str, float]]:
        """Values of the parameters of each sample."""
        return checked_grid(self.values, self.samples)

    @property
    def names(self) -> list[str]:
        """Name of each sample in messages, such as "length = 1.2"."""
        return [point_name(point) for point in self.points]

    def at(self, **parameters: float) -> ReducedBody:
        """Return the reduced body at values of all parameters inside the sampled range.

        Raises
        ------
        BodyError
            If a parameter is missing or unknown, or outside of its range.
        """
        point = self._checked(parameters)
        return self._interpolated(self._aligned, self._weights(point), self._closest(point), self._record(point))

    @cached_property
    def _aligned(self) -> tuple[AlignedSample, ...]:
        """Samples in the same modal coordinates."""
        k = self._closest({name: (given[0] + given[-1]) / 2 for name, given in self.values.items()})
        bodies = [in_mean_axes(sample) for sample in self.samples]
        pairs = zip(self.names, bodies, strict=True)
        return tuple(align(body, bodies[k], name, self.names[k]) for name, body in pairs)

    def _interpolated(
        self, aligned: Sequence[AlignedSample], weights: "Weights", near: int, record: Mapping[str, str]
    ) -> ReducedBody:
        """Return the interpolated body in the frame of the samples, steps (4) to (7).

        Parameters
        ----------
        aligned
            Samples, possibly without some of their data.
        near
            Index of the sample whose labels and provenance the body has.
        record
            Added to the provenance.
        """
        body = interpolated(aligned, weights, near, self.names)
        frame = blended([sample.frame for sample in self.samples], weights.entries, "frame", self.names)
        if body.moments.is_exact and body.moments.negativity > OF_MASSES:
            record = {**record, NEGATIVITY: f"{body.moments.negativity:.3g}"}
        shared = [set(sample.provenance.items()) for sample in self.samples]
        common = {
            key: value for key, value in self.samples[0].provenance.items() if all((key, value) in s for s in shared)
        }
        return in_frame(body, frame, {**common, **record})

    def _checked(self, parameters: Mapping[str, float]) -> dict[str, float]:
        """Return the values in the order of the parameters, moved into the range if only rounding is outside."""
        for name in parameters:
            if name not in self.values:
                raise BodyError(f"parametric body: no parameter {quoted(name)}{nearest(name, list(self.values))}")
        point = {}
        for name, given in self.values.items():
            if name not in parameters:
                raise BodyError(
                    f"parametric body: {name}: missing; expected a value from {given[0]:g} to {given[-1]:g}"
                )
            x, margin = parameters[name], ROUNDING * (given[-1] - given[0])
            if isinstance(x, bool) or not isinstance(x, int | float | np.number):
                raise BodyError(
                    f"parametric body: {name} = {quoted(x)}: expected a number from {given[0]:g} to {given[-1]:g}"
                )
            if not given[0] - margin <= x <= given[-1] + margin:
                raise BodyError(
                    f"parametric body: {name} = {x:g}: outside of the sampled range from {given[0]:g} to "
                    f"{given[-1]:g}; a body is interpolated, not extrapolated. Take samples of a larger range"
                )
            point[name] = min(max(float(x), given[0]), given[-1])
        return point

    def _closest(self, point: Mapping[str, float]) -> int:
        """Return the index of the sample nearest to a point, relative to the ranges."""
        ranges = {name: given[-1] - given[0] for name, given in self.values.items()}
        away = [max(abs(each[name] - point[name]) / ranges[name] for name in point) for each in self.points]
        return int(np.argmin(away))

    def _weights(self, point: Mapping[str, float], without: tuple[str, int] | None = None) -> "Weights":
        """Return the weights of the samples at a point; `without` leaves out one value of a parameter."""
        by_entry, by_log = [], []
        for name, given in self.values.items():
            left_out = without[1] if without is not None and without[0] == name else None
            x, abscissae = point[name], np.array(given)
            by_entry.append(lagrange(abscissae, x, left_out))
            is_positive = given[0] > 0
            by_log.append(lagrange(np.log(abscissae), np.log(x), left_out) if is_positive else by_entry[-1])
        return Weights(products(by_entry), products(by_log))

    def _record(self, point: Mapping[str, float]) -> dict[str, str]:
        """Return the provenance of an interpolated body."""
        given = "; ".join(f"{name} = {', '.join(f'{x:g}' for x in given)}" for name, given in self.values.items())
        record = {"interpolated at": point_name(point), "interpolated between": given}
        if self.errors is not None:
            words = ", ".join(f"{name} {error}" for name, error in self.errors.rows())
            record["interpolation errors"] = f"{words}; {self.errors.method}"
        return record


@dataclass(frozen=True, eq=False)
class Weights:
    """Weights of the samples, each with sum 1, (n_samples,)."""

    entries: Array  #: for entries of arrays
    logarithms: Array  #: for logarithms of stiffness


def parametric_body(
    values: Mapping[str, Sequence[float]], samples: Sequence[ReducedBody], *, middle: ReducedBody | None = None
) -> ParametricBody:
    """Return the samples as a parametric body with estimated errors.

    (1) Of each parameter with three values or more, each inner value is left out. The bodies that are interpolated
        there from all other values are compared with their samples, and the largest errors count. They are errors of a
        coarser interpolation, and so too large rather than too small
    (2) Parameters with two values are judged together by the body `middle`
    (3) The errors of (1) and (2) are added

    Parameters
    ----------
    values, samples
        As in `ParametricBody`.
    middle
        Reduced body at `middle_point(values)`; without it errors are not estimated if a parameter has two values.

    Raises
    ------
    BodyError
        If the samples have different modes, interfaces, meshes or dropped columns, or their modes cannot be aligned.
    """
    points, bodies, center = checked_grid(values, samples), [*samples], middle_point(values)
    if middle is not None:
        points, bodies = [*points, center], [*bodies, middle]
    if all(has_modes_beyond(each) for each in bodies):
        names = [point_name(point) for point in points]
        require_same_reduction(bodies, names, has_same_modes=False)
        away = [sum(abs(point[name] - center[name]) for name in center) for point in points]
        bodies = in_common_modes(bodies, names, int(np.argmin(away)))
        middle = None if middle is None else bodies[-1]
    made = ParametricBody({name: tuple(given) for name, given in values.items()}, tuple(bodies[: len(samples)]))
    aligned = tuple(replace(each, body=without_large_arrays(each.body)) for each in made._aligned)
    parts, methods = [], []
    for name, given in made.values.items():
        if len(given) > 2:
            found = []
            for k, (point, sample) in enumerate(zip(made.points, made.samples, strict=True)):
                place = given.index(point[name])
                if 0 < place < len(given) - 1:
                    weights = made._weights(point, (name, place))
                    found.append(errors_between(made._interpolated(aligned, weights, k, {}), sample))
            parts.append(largest_errors(found))
            methods.append(f"inner values of {name} left out")
    two = [name for name, given in made.values.items() if len(given) == 2]
    if two and middle is None:
        return made
    if two and middle is not None:
        point = middle_point(made.values)
        require_same_reduction((made.samples[0], middle), (made.names[0], point_name(point)))
        body = made._interpolated(aligned, made._weights(point), made._closest(point), {})
        parts.append(errors_between(body, middle))
        methods.append(f"a reduction at {point_name(point)}")
    return replace(made, errors=replace(sum_of_errors(parts), method=" and ".join(methods)))


def checked_grid(values: Mapping[str, Sequence[float]], samples: Sequence[ReducedBody]) -> list[dict[str, float]]:
    """Return the points of the grid, the last parameter fastest; raise `BodyError` unless each has a sample."""
    if fault := fault_of_values(values):
        raise BodyError(f"parametric body: {fault}")
    points = [dict(zip(values, point, strict=True)) for point in product(*values.values())]
    if len(samples) != len(points):
        raise BodyError(f"parametric body: expected {len(points)} samples, one at each point, got {len(samples)}")
    return points


def fault_of_values(values: Mapping[str, Sequence[float]]) -> str:
    """Return what is wrong with the sampled values of the parameters; "" if nothing is."""
    if not 1 <= len(values) <= MOST_PARAMETERS:
        return f"expected one to {MOST_PARAMETERS} parameters, got {len(values)}"
    for name, given in values.items():
        if not 2 <= len(given) <= MOST_VALUES or not np.isfinite(given).all() or not (np.diff(given) > 0).all():
            got = shortened(", ".join(f"{x:g}" for x in given))
            return f"{name}: expected two to {MOST_VALUES} ascending values, got {got}"
    return ""


def middle_point(values: Mapping[str, Sequence[float]]) -> dict[str, float]:
    """Return the middle of each parameter with two values, and the sampled value in the middle of each other one."""
    return {
        name: (given[0] + given[1]) / 2 if len(given) == 2 else given[len(given) // 2] for name, given in values.items()
    }


def point_name(point: Mapping[str, float]) -> str:
    """Return the values of the parameters as text, such as "length = 1.2, thickness = 0.01"."""
    return ", ".join(f"{name} = {x:g}" for name, x in point.items())


def with_rigid_members(body: ReducedBody) -> ReducedBody:
    """Return the body whose members of rigid interfaces move rigidly, u + theta × arm.

    Sums of such motions of samples do not, because the arms of the samples differ.
    """
    Phi = np.array(body.Phi)
    for interface in body.interfaces:
        if interface.kind == "rigid" and interface.has_rotation:
            arms = body.nodes[interface.members] - interface.position
            turns = np.cross(interface.Psi[3:].T[None], arms[:, None])
            Phi[interface.members] = interface.Psi[:3] + np.moveaxis(turns, 1, 2)
    return replace(body, Phi=Phi)


def require_same_reduction(
    samples: Sequence[ReducedBody], names: Sequence[str], *, has_same_modes: bool = True
) -> None:
    """Raise `BodyError` unless all samples have the same mode set and interfaces, and the same number of modes."""
    first, of_reduction = (
        samples[0],
        [(k, what) for k, what in SAME_REDUCTION.items() if has_same_modes or k not in OF_MODES],
    )
    for sample, name in zip(samples, names, strict=True):
        if (np.diag(sample.M) <= 0).any():
            raise BodyError(
                f"parametric body: {name}: {np.count_nonzero(np.diag(sample.M) <= 0)} modes have no mass; expected "
                "mass at every interface"
            )
        if sample.quadratic is not None:
            raise BodyError(
                f"parametric body: {name}: quadratic modes cannot be interpolated; leave quadratic_modes out of the job"
            )
        facts: list[tuple[str, Any, Any, str]] = []
        if has_same_modes:
            facts.append(("number of modes", first.n_q, sample.n_q, SAME_MODES))
        facts += [(what, first.provenance.get(k), sample.provenance.get(k), SAME_MODES) for k, what in of_reduction]
        names_of = [", ".join(each.name for each in body.interfaces) or "none" for body in (first, sample)]
        facts.append(("interfaces", names_of[0], names_of[1], "Name the interfaces alike in all samples"))
        facts += [(what, size(first), size(sample), SAME_MESH) for what, size in SIZES.items()]
        for what, expected, got, remedy in facts:
            if expected != got:
                raise BodyError(
                    f"parametric body: {what}: expected {expected} at {name}, as at {names[0]}, got {got}. {remedy}"
                )


def lagrange(abscissae: Array, x: float, left_out: int | None = None) -> Array:
    """Return the values of the Lagrange polynomials at x, (n,); that of an abscissa that is left out is zero."""
    weights = np.zeros(len(abscissae))
    used = [k for k in range(len(abscissae)) if k != left_out]
    for k in used:
        weights[k] = np.prod([(x - abscissae[j]) / (abscissae[k] - abscissae[j]) for j in used if j != k])
    return weights


def products(weights: Sequence[Array]) -> Array:
    """Return the weights of the samples from those of each parameter, (n_samples,)."""
    found: Array = np.ones(1)
    for each in weights:
        found = np.asarray(np.kron(found, each), dtype=float)
    return found


def without_large_arrays(body: ReducedBody) -> ReducedBody:
    """Return the body with the data that `errors_between` reads."""
    return replace(body, stress=None, point_stress=None, geometric=None, kept=None, recovery={})


def interpolated(aligned: Sequence[AlignedSample], weights: Weights, near: int, names: Sequence[str]) -> ReducedBody:
    """Return the interpolated body with new modes in the frame of the aligned samples, steps (4) to (6)."""
    own = aligned[near].body
    mixed = replace(
        own,
        columns=None,
        errors=None,
        **{
            field.name: blended(
                [getattr(each.body, field.name) for each in aligned], weights.entries, f"body.{field.name}", names
            )
            for field in fields(own)
            if field.name not in OF_NEAREST
        },
    )  # (5)
    radii = np.array([each.radii for each in aligned])
    mean = np.where((radii > 0).all(axis=0), np.exp(weights.logarithms @ np.log(divisors(radii))), 0.0)
    mixed = with_rigid_members(rescaled(mixed, 1 / divisors(mean), 1 / float(np.linalg.norm(mean))))
    L = sum(weight * each.log_stiffness for weight, each in zip(weights.logarithms, aligned, strict=True))  # (4)
    logarithms, Z = np.linalg.eigh((L + L.T) / 2)  # (6)
    omega2 = np.exp(logarithms)
    rows = mixed.Phi.reshape(-1, mixed.n_q) if len(mixed.nodes) else np.vstack([each.Psi for each in mixed.interfaces])
    body = recombined(mixed, Z @ orientation(rows @ Z, omega2) / np.sqrt(mixed.moments.m))
    frequencies = np.sqrt(omega2) / (2 * np.pi)
    return replace(
        body, K=np.diag(omega2), M=np.eye(len(omega2)), free_frequencies=frequencies[: len(own.free_frequencies)]
    )
