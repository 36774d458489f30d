"""Error estimates of a reduced body from the residuals of its modes and the factorisation that made its mode set.

Let theta and phi be a Ritz pair of the free body in the span V of a mode set, phiᵀ M phi = 1, and G the flexibility of
the free body. The correction of phi by one step of inverse iteration,

    e = theta G M phi - phi,        |e|²_K = theta² phiᵀ M G M phi - theta,

is K-orthogonal to V, because phi is a Galerkin solution.

(1) Bound. Expand phi = sum c_j phi_j in the exact modes: |e|²_K = sum (lambda_j - theta)² c_j² / lambda_j and
    sum lambda_j c_j² = theta, so that min_j |lambda_j - theta| / lambda_j <= |e|_K / sqrt(theta) = b. Some exact
    frequency lies within this distance [1]_.
(2) Estimate. The Rayleigh-Ritz method in span(V, e_1, ..., e_n) gives Ritz values lambda' between the exact ones and
    theta, so theta / lambda' - 1 never exceeds theta / lambda - 1. Of a mode j that V lacks, e has its part of phi
    times theta / lambda_j - 1, so that little of the error is missed below the cutoff.
    The error of a shape is its distance from the span of the new shapes whose frequencies are within 0.1 % of lambda'.
(3) A mode that every phi lacks leaves no trace in e. A few random columns, M-orthogonal to V and smoothed by two steps
    of inverse iteration, are added to the span, so that such a mode appears among the lambda'.

References
----------
.. [1] B. N. Parlett, The Symmetric Eigenvalue Problem, SIAM 1998, chapters 10 and 11.
"""

from collections.abc import Iterator
from dataclasses import dataclass
from datetime import UTC, datetime

import numpy as np
import scipy.linalg as la

from cms.body.error_estimates import ErrorEstimates
from cms.errors import BodyError
from cms.linear_algebra.independent import Products
from cms.modes.families.families import Families
from cms.modes.mode_set import ModeSet
from cms.reduction.basis.free_basis import FreeBasis
from fe_models.body.fe_body import FEBody
from fe_models.foundation.arrays import Array
from fe_models.foundation.tall.columns import combine, dots, gram, inner, subtract

__all__ = ["FrequencyErrors", "energy_error", "error_estimates", "frequency_errors", "require_one_process"]

JUDGED = 30  #: number of judged modes of a set without vibration modes, which has no cutoff
RANDOM, STEPS, SEED = 6, 2, 20  #: number of random columns of (3), their steps of inverse iteration, and their seed
FREQUENCY_ROUNDING = 1e-10  #: estimated error of a frequency, below which it is rounding
EXACT = 1e-7  #: bound b, below which a mode is exact within rounding
INDEPENDENT = 1e-10  #: smallest eigenvalue of the scaled Gram matrix of independent corrections
CLUSTER = 1e-3  #: relative gap of frequencies, below which shapes are judged by their common subspace
CLUSTERED = 8  #: number of shapes beyond the judged ones that may belong to the subspace of the last of them
NO_ENERGY = 1e-24  #: strain energy of a response relative to the largest of its kind, below which it is zero
STATIC_ROUNDING = 1e-5  #: error of a static response, below which it is rounding
MOST_LOADS, SUMS = 120, 12  #: largest number of unit loads that are judged one by one, else number of sums
METHOD = (
    "frequency, shape: lower estimates, Rayleigh-Ritz with one step of inverse iteration; bound: rigorous, from the "
    "residual; static responses: computed, not estimated"
)


@dataclass(frozen=True, eq=False)
class FrequencyErrors:
    """Errors of the lowest free frequencies; see `ErrorEstimates`."""

    frequency: Array  #: estimate of f_reduced / f - 1, (n,)
    bound: Array  #: rigorous bound b, (n,)
    shape: Array  #: estimate of the error of the shape in the norm of strain energy, (n,)


def require_one_process(body: FEBody) -> None:
    """Raise `BodyError` if the body is distributed over ranks, where errors are not estimated."""
    if body.layout is not None:
        raise BodyError(
            f"body {body.name!r}: it is distributed over ranks, and errors are estimated in one process only; leave "
            "the estimates out, or take another solver"
        )


def error_estimates(families: Families, modes: ModeSet, basis: FreeBasis) -> ErrorEstimates:
    """Estimate the errors of a reduced body with the factorisation of its families.

    Parameters
    ----------
    families
        Families of the body, open: their factorisation is used for as many solutions as modes are judged.
    modes
        The mode set.
    basis
        The free modes in its span.
    """
    frequencies = basis.frequencies()
    vibrating = modes.frequencies[~modes.is_static]
    n = int((frequencies <= (1 + EXACT) * vibrating.max()).sum()) if len(vibrating) else min(JUDGED, len(frequencies))
    n = min(max(n, 1), len(frequencies))
    errors = frequency_errors(families, basis, n)
    loads, interface = interface_errors(families, basis)
    return ErrorEstimates(
        four_digits(errors.frequency, FREQUENCY_ROUNDING),
        four_digits(errors.bound),
        four_digits(errors.shape),
        loads,
        four_digits(interface, STATIC_ROUNDING),
        four_digits(energy_error(families.body, basis, families.Psi_H), STATIC_ROUNDING),
        METHOD,
        datetime.now(UTC).date().isoformat(),
    )


def frequency_errors(families: Families, basis: FreeBasis, n: int) -> FrequencyErrors:
    """Estimate the errors of the lowest n free frequencies and shapes: n + 12 solutions with the factorisation."""
    products, V, omega2 = Products.of_body(families.body), basis.Phi, basis.omega2
    theta = omega2[:n]
    E = theta * families.flexibility(products.M @ V[:, :n]) - V[:, :n]
    K_E = products.K @ E
    bound = np.sqrt(np.maximum(dots(E, K_E), 0.0) / theta)  # (1)
    subtract(E, V, inner(V, K_E) / omega2[:, None])  # rounding
    X = np.hstack([E[:, bound > EXACT], *random_columns(families, basis, products)])
    mu, Y = enlarged_shapes(basis, X, products, n + CLUSTERED)  # (2)
    frequency = np.sqrt(np.maximum(theta * mu[:n], 1.0)) - 1
    own = np.sqrt(mu[:n, None])
    inside = np.where(np.abs(np.sqrt(mu) - own) < CLUSTER * own, Y[:n] ** 2, 0.0).sum(axis=1)
    return FrequencyErrors(frequency, bound, np.sqrt(np.maximum(1 - inside, 0.0)))


def random_columns(families: Families, basis: FreeBasis, products: Products) -> Iterator[Array]:
    """Yield the columns of (3) after each step of inverse iteration, K-orthogonal to the span of the set.

    Each step begins M-orthogonal to the span. Columns that lie in the span are left out.
    """
    V, massive = basis.Phi, basis.vibrating
    F = products.M @ np.random.default_rng(SEED).standard_normal((families.body.n_dof, RANDOM))
    for _ in range(STEPS):
        X = families.flexibility(F)
        F = products.M @ (X - combine(massive, inner(massive, products.M @ X)))
        before = dots(X, products.K @ X)
        for _ in range(2):
            K_X = products.K @ X
            subtract(X, V, inner(V, K_X) / basis.omega2[:, None])
        yield X[:, dots(X, K_X) > EXACT**2 * before]


def enlarged_shapes(basis: FreeBasis, X: Array, products: Products, n: int) -> tuple[Array, Array]:
    """Return 1 / omega² of the lowest n shapes in the span of V and X, where VᵀKX = 0, by the Rayleigh-Ritz method.

    Returns
    -------
    mu
        1 / omega², descending, (n,); fewer if the span is smaller.
    Y
        Part of each shape of V, scaled to unit strain energy, in each of these shapes, (n_V, n).
    """
    omega2 = basis.omega2
    K_X = products.K @ X
    size = 1 / np.sqrt(np.maximum(dots(X, K_X), np.finfo(float).tiny))
    energies, T = la.eigh(gram(X, K_X) * np.outer(size, size))
    is_independent = energies > INDEPENDENT
    T = size[:, None] * T[:, is_independent] / np.sqrt(energies[is_independent])
    M_X = products.M @ X
    inverse = np.where(basis.is_massive, 1 / omega2, 0.0)
    beside = (inner(basis.Phi, M_X) / np.sqrt(omega2)[:, None]) @ T
    mass = np.block([[np.diag(inverse), beside], [beside.T, T.T @ gram(X, M_X) @ T]])
    mu, Y = la.eigh(mass, subset_by_index=[max(0, len(mass) - n), len(mass) - 1])
    return np.maximum(mu[::-1], 0.0), Y[: len(omega2), ::-1]


def four_digits(errors: Array, rounding: float = 0.0) -> Array:
    """Return errors with four digits, zero below `rounding`; further digits depend on the number of threads."""
    return np.array([0.0 if error < rounding else float(f"{error:.4g}") for error in errors])


# static responses, which are known exactly ----------------------------------------------------------------------------


def interface_errors(families: Families, basis: FreeBasis) -> tuple[tuple[str, ...], Array]:
    """Return names and errors of the unit loads at the excess boundary dofs E, balanced by reactions at R.

    If there are very many of them, random sums of unit loads take their places.
    """
    free = families.free
    labels, loads = families.held_names("load")[0], np.eye(len(free.e))
    names = tuple(labels[k] for k in free.e)
    if len(names) > MOST_LOADS:
        loads = np.random.default_rng(SEED).choice([-1.0, 1.0], (len(names), SUMS))
        names = tuple(f"sum {k + 1} of all unit loads, with random signs" for k in range(SUMS))
    z = np.zeros((len(families.h), len(names)))
    z[free.e] = free.solve_boundary(loads)
    return names, energy_error(families.body, basis, combine(families.Psi_C, z))


def energy_error(body: FEBody, basis: FreeBasis, U: Array) -> Array:
    """Return the relative energy error of approximating columns U by rigid motion and modes, (k,); NaN: no energy.

    With c = Phiᵀ K u / omega² the energy of the error e = u - Phi c is computed, not the difference of two energies.
    Rigid motion is subtracted first: it has no energy, but its rounding errors have.
    """
    products = Products.of_body(body)
    U = U - combine(basis.N, inner(basis.N, products.M @ U))
    K_U = products.K @ U
    energy = dots(U, K_U)
    subtract(U, basis.Phi, inner(basis.Phi, K_U) / basis.omega2[:, None])
    has_energy = energy > NO_ENERGY * energy.max(initial=0.0)
    return np.sqrt(np.maximum(dots(U, products.K @ U), 0.0) / np.where(has_energy, energy, np.nan))
