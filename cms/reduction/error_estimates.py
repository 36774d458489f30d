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
(3) A mode that every phi lacks leaves no trace in e. The guard modes are added to the span, so that such a mode appears
    among the lambda': approximate modes just above those of the set, which the eigensolver found beside them. A set
    without guards gets a few random columns, M-orthogonal to V and smoothed by two steps of inverse iteration.
(4) Responses. Let y solve Vᵀ (K - omega² M) V y = Vᵀ b. One step of inverse iteration with its residual,
    G [b - (K - omega² M) V y], has beside V the part of G b that is K-orthogonal to V, plus
    sum_j omega² / theta_j y_j e_j. The e_j of judged modes are in the span already. Above them y_j is nearly
    phi_jᵀ b / theta_j, because omega² is less than theta_j, and one column for each load has the sum of
    phi_jᵀ b / theta_j² e_j. The responses in the enlarged span and in V are compared.
(5) Corrections by fewer solutions. All corrections are the parts beside V of G F, with one load f_j of F for each, also
    for inertia loads. Sets of constraint modes and eigenmodes have corrections that span no more than n_h columns:
    K_II⁻¹ M Psi_C. So G is applied to n_h random sums of the loads [2]_, and their parts beside V get a K-orthonormal
    basis Q. Correction j has the energy p_j = |Qᵀ f_j|² in its span. Two more sums with random signs and the weights
    1 / sqrt(w_j) have outside Q the mean energy sum_j r_j / w_j, where r_j is the energy that correction j lacks, and
    w_j < p_j its energy in the span of (3). The bound (1) contains this sum times w_j. If the sum is too large, G is
    applied to every load. All columns are solved together.
(6) Modes beside V that are close to the cutoff of the set are in no correction. `largest_errors` says how large the
    errors of (2) may be with them. The guards raise this cutoff, and shapes below it are in the span.

References
----------
.. [1] B. N. Parlett, The Symmetric Eigenvalue Problem, SIAM 1998, chapters 10 and 11.
.. [2] Halko, Martinsson & Tropp (2011), SIAM Review 53, 217-288.
"""

from dataclasses import dataclass
from datetime import UTC, datetime
from functools import cached_property
from typing import Any

import numpy as np
import scipy.linalg as la

from cms.body.error_estimates import ErrorEstimates
from cms.body.reduced_body import BodyFrame
from cms.errors import BodyError
from cms.linear_algebra.independent import DisplacementColumns, Products
from cms.modes.families.families import Families
from cms.modes.families.receptance import boundary_scale
from cms.modes.families.static_modes import ROUNDING_ENERGY
from cms.modes.mode_set import ModeSet
from cms.reduction.basis.free_basis import FreeBasis
from cms.reduction.frequency_bracket import largest_errors
from cms.reduction.left_out_modes import MotionLoads, left_out_modes, orthonormal
from cms.reduction.mesh_error import mesh_errors
from fe_models.body.fe_body import FEBody
from fe_models.foundation.arrays import Array
from fe_models.foundation.tall.columns import combine, copied, dots, gram, inner, subtract

__all__ = ["FrequencyErrors", "cutoff_of", "energy_error", "error_estimates", "frequency_errors", "require_one_process"]

JUDGED = 30  #: number of judged modes of a set without vibration modes, which has no cutoff
RANDOM, SEED = 6, 20  #: number of random columns of (3), and their seed
TESTS, MISSING = 2, 0.01  #: number of tests of (5), and the sum of relative energies that corrections may lack
SMALL = 1e-4  #: size of a correction relative to its mode, below which w_j in (5) is that of this size
FREQUENCY_ROUNDING = 1e-10  #: estimated error of a frequency, below which it is rounding
EXACT_BOUND = FREQUENCY_ROUNDING**0.5  #: bound b of a mode whose error of frequency is rounding
EXACT = 1e-7  #: bound b, below which a mode is exact within rounding
CLUSTER = 1e-3  #: relative gap of frequencies, below which shapes are judged by their common subspace
CLUSTERED = 8  #: number of shapes beyond the judged ones that may belong to the subspace of the last of them
NO_ENERGY = 1e-24  #: strain energy of a response relative to the largest of its kind, below which it is zero
STATIC_ROUNDING = 1e-5  #: error of a static response, below which it is rounding
MOST_LOADS, SUMS = 120, 12  #: largest number of unit loads that are judged one by one, else number of sums
RESPONSE_ROUNDING = 1e-7  #: error of a frequency response, below which it is rounding
DAMPING = 0.01  #: damping ratio of every mode in compared frequency responses
LOWEST = 0.05  #: lowest frequency of a response divided by the first elastic one; below it the body moves rigidly
POINTS = 33  #: number of frequencies around each mode at which responses are compared
METHOD = (
    "frequency, shape, response: estimates by the Rayleigh-Ritz method with one step of inverse iteration and guard "
    "modes of the eigensolver; bound: "
    "from the residual, a small part of which random tests measure in large sets; static responses: computed, not "
    "estimated"
)


@dataclass(frozen=True, eq=False)
class FrequencyErrors:
    """Errors of the lowest free frequencies; see `ErrorEstimates`."""

    frequency: Array  #: estimate of f_reduced / f - 1, (n,)
    bound: Array  #: bound b, (n,)
    shape: Array  #: estimate of the error of the shape in the norm of strain energy, (n,)
    largest: Array  #: largest error of the frequency, (n,); NaN: not limited; empty: the set has no cutoff


@dataclass(frozen=True, eq=False)
class EnlargedSpace:
    """The span of a mode set, its corrections and guard modes, with shapes from the Rayleigh-Ritz method."""

    bound: Array  #: b of the judged modes, (n,)
    mu: Array  #: 1 / omega² of the new shapes, descending, (n_W,)
    Y: Array  #: part of each shape of V, scaled to unit strain energy, in each new shape, (n_V, n_W)
    motion: Array  #: motion in the directions of the loads in the new shapes of unit strain energy, (n_loads, n_W)
    masses: tuple[Array, Array, Array]  #: mu of V, its coupling with X, and the mass of X; see `largest_errors`
    X: DisplacementColumns  #: corrections, residual responses and guard modes, K-orthogonal to V, (n_dof, n_X)
    inertia: Array  #: error of the set for each inertia load; see `ErrorEstimates`, (n_r,)


def require_one_process(body: FEBody) -> None:
    """Raise `BodyError` if the body is distributed over ranks, where errors are not estimated."""
    if body.layout is not None:
        raise BodyError(
            f"body {body.name!r}: it is distributed over ranks, and errors are estimated in one process only; leave "
            "the estimates out, or take another solver"
        )


def error_estimates(
    families: Families, modes: ModeSet, basis: FreeBasis, Phi: Array, frame: BodyFrame
) -> ErrorEstimates:
    """Estimate the errors of a reduced body with the factorisation of its families.

    Parameters
    ----------
    families
        Families of the body, open: their factorisation is used for as many solutions as modes and loads are judged.
    modes
        The mode set.
    basis
        The free modes in its span.
    Phi
        Modes of the reduced body, (n_dof, n_q).
    frame
        Its frame.
    """
    frequencies = basis.frequencies()
    cutoff = cutoff_of(modes)
    n = min(JUDGED, len(frequencies))
    if cutoff is not None:
        n = int((2 * np.pi * frequencies <= (1 + EXACT) * cutoff).sum())
    n = min(max(n, 1), len(frequencies))
    mesh = mesh_errors(families.body, basis, n)
    names, interface = interface_errors(families, basis)
    interface = four_digits(interface, STATIC_ROUNDING)
    motion = None if families.body.is_held else MotionLoads.of_model(families.body, frame)
    loads = static_loads(families, motion)
    has_statics = not np.nan_to_num(interface).any()
    space = enlarged_space(families, basis, n, loads, guards_of(modes), has_statics=has_statics)
    errors = errors_of_modes(basis, space, complete_to(modes))
    return ErrorEstimates(
        four_digits(errors.frequency, FREQUENCY_ROUNDING),
        four_digits(errors.bound),
        four_digits(errors.shape),
        four_digits(response_errors(basis, n, loads.directions, space.motion, space.mu), RESPONSE_ROUNDING),
        names,
        interface,
        four_digits(space.inertia, STATIC_ROUNDING),
        METHOD,
        datetime.now(UTC).date().isoformat(),
        mesh=four_digits(mesh.frequency, FREQUENCY_ROUNDING) if mesh.sign else np.zeros(0),
        mesh_sign=mesh.sign,
        mesh_method=mesh.method,
        largest=four_digits(errors.largest, FREQUENCY_ROUNDING),
        left_out=None if motion is None else left_out_modes(basis, space.X, Phi, motion),
    )


def frequency_errors(families: Families, basis: FreeBasis, n: int, modes: ModeSet | None = None) -> FrequencyErrors:
    """Estimate the errors of the lowest n free frequencies and shapes; `modes`: the set, for its cutoff and guards."""
    none = np.zeros((families.body.n_dof, 0))
    guards, cutoff = (None, None) if modes is None else (guards_of(modes), complete_to(modes))
    return errors_of_modes(basis, enlarged_space(families, basis, n, StaticLoads(none, none, none), guards), cutoff)


def cutoff_of(modes: ModeSet) -> float | None:
    """Return the highest angular frequency of the vibration modes of a set; None if it has none."""
    vibrating = modes.frequencies[~modes.is_static]
    return 2 * np.pi * float(vibrating.max()) if len(vibrating) else None


def complete_to(modes: ModeSet) -> float | None:
    """Return the angular frequency below which the vibration modes and guards of a set are complete; None: no modes."""
    cutoff, resolved = cutoff_of(modes), 0.0 if modes.guards is None else 2 * np.pi * modes.guards.resolved_to
    return None if cutoff is None else max(cutoff, resolved)


def guards_of(modes: ModeSet) -> Array | None:
    """Return the guard modes of a set, (n_dof, n_guards); None if it has none."""
    return None if modes.guards is None or not modes.guards.Phi.shape[1] else modes.guards.Phi


@dataclass(frozen=True, eq=False)
class StaticLoads:
    """Loads whose static responses belong to the enlarged space."""

    directions: Array  #: loads of the responses, `response_loads`, (n_dof, n_loads)
    inertia: Array  #: `inertia_loads`, (n_dof, n_r)
    motion: Array  #: other loads of a motion: spin, load cases, (n_dof, k)


def enlarged_space(
    families: Families,
    basis: FreeBasis,
    n: int,
    loads: StaticLoads,
    guards: Array | None,
    *,
    has_statics: bool = False,
) -> EnlargedSpace:
    """Add the corrections of the lowest n modes and of the responses to loads, and guard modes, to the set.

    Parameters
    ----------
    guards
        Approximate modes above those of the set, (n_dof, n_guards); None: random columns take their place.
    has_statics
        Whether the set contains the static responses to loads at the interfaces that reactions balance. Those that
        inertia balances then lie in the span of the set and the responses to inertia loads.
    """
    corrections = correction_loads(families, basis, n, loads, has_statics=has_statics)
    near = beside_guards(families, corrections, guards)  # (3)
    weights, _ = energy_inside(corrections, near, SMALL)
    sums = weights_of_sums(corrections.size, len(families.h))
    n_tests = TESTS if sums.shape[1] < len(weights) else 0
    signs = np.random.default_rng(SEED + 2).choice([-1.0, 1.0], (len(weights), n_tests))
    F = corrections.sums(np.hstack([sums, signs / np.sqrt(weights)[:, None]]))  # (5)
    found = parts_beside(families, corrections, np.hstack([F, loads.motion]))
    X, tests = found[: sums.shape[1]], found[sums.shape[1] : F.shape[1]]
    energy, T = energy_inside(corrections, X, EXACT)
    outside = dots(tests.X, tests.KX).sum() - ((inner(tests.KX, X.X) @ T) ** 2).sum()
    lacking = max(outside, 0.0) / TESTS
    if lacking > MISSING:
        X = parts_beside(families, corrections, corrections.sums(np.eye(len(weights))))
        energy, lacking = energy_inside(corrections, X, EXACT)[0], 0.0
    bound = np.sqrt((energy + lacking * weights)[:n] / basis.omega2[:n])  # (1)
    X = X.beside(found[sums.shape[1] :], near)
    of_inertia = slice(len(weights) - loads.inertia.shape[1], None)
    errors = inertia_errors(energy[of_inertia], (energy + corrections.energy_in_V)[of_inertia])
    return EnlargedSpace(bound, *ritz_shapes(basis, X, loads.directions), X, errors)


@dataclass(frozen=True, eq=False)
class CorrectionLoads:
    """Loads F = [M V, L] C; the parts of their elastic responses beside V are the corrections."""

    basis: FreeBasis  #: V
    products: Products
    L: Array  #: loads of responses and inertia loads, (n_dof, n_L)
    C: Array  #: coefficients, (n_V + n_L, n_F)

    @cached_property
    def energy_in_V(self) -> Array:
        """Energy of the part of each response in V, (n_F,)."""
        mass = np.diag(self.basis.is_massive.astype(float))
        V_F = np.hstack([mass, inner(self.basis.Phi, self.L)]) @ self.C
        return np.asarray((V_F**2 / self.basis.omega2[:, None]).sum(axis=0))

    @property
    def size(self) -> Array:
        """Root of the energy of the part of each response in V, (n_F,); the largest one in place of zero."""
        size = np.sqrt(self.energy_in_V)
        return np.where(size > 0, size, size.max(initial=0.0))

    def sums(self, S: Array) -> Array:
        """Return F S, (n_dof, k)."""
        of_modes, of_loads = np.split(self.C @ S, [len(self.basis.omega2)])
        F = self.products.M @ combine(self.basis.Phi, of_modes)
        subtract(F, self.L, -of_loads)
        return F

    def work(self, X: DisplacementColumns) -> Array:
        """Return Xᵀ F, (k, n_F)."""
        return np.hstack([inner(X.MX, self.basis.Phi), inner(X.X, self.L)]) @ self.C


def correction_loads(
    families: Families, basis: FreeBasis, n: int, loads: StaticLoads, *, has_statics: bool
) -> CorrectionLoads:
    """Return the loads theta M phi of the lowest n modes, those of the responses by (4), and the inertia loads."""
    L, n_V, n_loads = np.hstack([loads.directions, loads.inertia]), len(basis.omega2), loads.directions.shape[1]
    above = np.arange(n, n_V)[basis.is_massive[n:]]
    unit = np.eye(n_V + L.shape[1])
    C = [unit[:, :n] * basis.omega2[:n]]
    if not has_statics:
        C.append(unit[:, n_V : n_V + n_loads])
    if len(above):
        C.append(unit[:, above] @ (inner(basis.Phi[:, above], loads.directions) / basis.omega2[above, None]))
    C.append(unit[:, n_V + n_loads :])
    return CorrectionLoads(basis, Products.of_body(families.body), L, np.hstack(C))


def weights_of_sums(size: Array, n_sums: int) -> Array:
    """Return weights of the loads in random sums, (n_F, n_sums); the identity if loads are hardly more than sums.

    Parameters
    ----------
    size
        Root of the energy of each response in V, (n_F,).
    """
    if len(size) <= n_sums + TESTS:
        return np.eye(len(size))
    return np.asarray(np.random.default_rng(SEED + 1).standard_normal((len(size), n_sums)) / size[:, None])


def parts_beside(families: Families, corrections: CorrectionLoads, F: Array) -> DisplacementColumns:
    """Return the elastic responses to loads without their parts in V, (n_dof, k); zero if they are in V."""
    if not F.shape[1]:
        return corrections.products.beside(F)
    U = families.flexibility(F)
    whole = dots(U, F)
    subtract(U, corrections.basis.Phi, inner(corrections.basis.Phi, F) / corrections.basis.omega2[:, None])
    return without_rounding(corrections, U, whole)


def beside_guards(families: Families, corrections: CorrectionLoads, guards: Array | None) -> DisplacementColumns:
    """Return the parts of guard modes beside V, (n_dof, n_guards), or random columns after two inverse iterations."""
    V, products, free = corrections.basis.Phi, corrections.products, families.free
    if guards is None:
        noise = np.random.default_rng(SEED).standard_normal((len(V), RANDOM))
        rough = parts_beside(families, corrections, products.M @ noise)
        smooth = parts_beside(families, corrections, products.M @ (rough.X - combine(V, inner(V, rough.MX))))
        return rough.beside(smooth)
    U = copied(guards)
    subtract(U, free.N, inner(free.M_N, U))
    K_U = products.K @ U
    whole = dots(U, K_U)
    subtract(U, V, inner(V, K_U) / corrections.basis.omega2[:, None])
    return without_rounding(corrections, U, whole)


def without_rounding(corrections: CorrectionLoads, U: Array, whole: Array) -> DisplacementColumns:
    """Subtract the rounding of columns in V, and set columns to zero that are rounding of their whole energy, (k,)."""
    V, products = corrections.basis, corrections.products
    K_U = products.K @ U
    subtract(U, V.Phi, inner(V.Phi, K_U) / V.omega2[:, None])
    found = DisplacementColumns(U, K_U, products.M @ U, np.zeros((0, U.shape[1])))
    is_rounding = dots(U, K_U) <= EXACT**2 * whole
    for each in (found.X, found.KX, found.MX) if is_rounding.any() else ():
        each[:, is_rounding] = 0.0
    return found


def energy_inside(corrections: CorrectionLoads, X: DisplacementColumns, least: float) -> tuple[Array, Array]:
    """Return the energy of each correction in the span of X, and T of `orthonormal`.

    `least` is the size of a correction relative to its response in V, below which it gets the energy of this size.
    """
    T = orthonormal(X)
    energy = ((T.T @ corrections.work(X)) ** 2).sum(axis=0)
    return np.maximum(energy, (least * corrections.size) ** 2), T


def errors_of_modes(basis: FreeBasis, space: EnlargedSpace, cutoff: float | None) -> FrequencyErrors:
    """Compare the judged modes with the shapes of the enlarged space."""
    n = len(space.bound)
    mu, Y = space.mu[: n + CLUSTERED], space.Y[:, : n + CLUSTERED]
    frequency = np.sqrt(np.maximum(basis.omega2[:n] * mu[:n], 1.0)) - 1
    own = np.sqrt(mu[:n, None])
    inside = np.where(np.abs(np.sqrt(mu) - own) < CLUSTER * own, Y[:n] ** 2, 0.0).sum(axis=1)
    shape = np.sqrt(np.maximum(1 - inside, 0.0))
    if cutoff is None:
        return FrequencyErrors(frequency, space.bound, shape, np.zeros(0))
    largest = largest_errors(np.maximum(frequency, FREQUENCY_ROUNDING), basis.omega2[:n], space.masses, cutoff)  # (6)
    is_exact = np.logical_and.accumulate((space.bound <= EXACT_BOUND) & (frequency < FREQUENCY_ROUNDING))
    return FrequencyErrors(frequency, space.bound, shape, np.where(is_exact, 0.0, largest))


def ritz_shapes(
    basis: FreeBasis, X: DisplacementColumns, directions: Array
) -> tuple[Array, Array, Array, tuple[Array, Array, Array]]:
    """Return mu, Y, motion and masses of `EnlargedSpace` by the Rayleigh-Ritz method; VᵀKX = 0."""
    omega, T = np.sqrt(basis.omega2), orthonormal(X)
    beside = (inner(basis.Phi, X.MX) / omega[:, None]) @ T
    masses = static_factors(basis), beside, T.T @ gram(X.X, X.MX) @ T
    mu, Y = la.eigh(np.block([[np.diag(masses[0]), beside], [beside.T, masses[2]]]))
    mu, Y = np.maximum(mu[::-1], 0.0), Y[:, ::-1]
    motion = np.hstack([inner(directions, basis.Phi) / omega, inner(directions, X.X) @ T]) @ Y
    return mu, Y[: len(omega)], motion, masses


def static_factors(basis: FreeBasis) -> Array:
    """Return mu of the shapes of the set: 1 / omega², 0 of massless ones, (n,)."""
    return np.where(basis.is_massive, 1 / basis.omega2, 0.0)


# frequency responses between interfaces ---------------------------------------------------------------------------


def response_loads(body: FEBody) -> Array:
    """Return unit loads at the interfaces as columns, moments times the length; if they are many, random sums of them.

    Returns
    -------
    ndarray
        (n_dof, n_loads).
    """
    at_b = boundary_scale(body)[:, None] * unit_loads(len(body.b), SUMS)
    loads = np.zeros((body.n_dof, at_b.shape[1]))
    loads[body.b] = at_b
    return loads


def unit_loads(n: int, most: int) -> Array:
    """Return unit loads as columns, (n, n), or if they are more than `most`, sums with random signs, (n, SUMS)."""
    return np.eye(n) if n <= most else np.random.default_rng(SEED).choice([-1.0, 1.0], (n, SUMS))


def response_errors(basis: FreeBasis, n: int, directions: Array, better: Array, mu: Array) -> Array:
    """Return the error of the receptance between the loads around each judged mode, (n,); empty without loads.

    Parameters
    ----------
    better, mu
        Motion in the directions of the loads, (n_loads, n_W), and 1 / omega², (n_W,), of better shapes; see
        `EnlargedSpace`.
    """
    omega = np.sqrt(basis.omega2[: n if directions.shape[1] else 0])
    if not len(omega):
        return np.zeros(0)
    middle = (omega[1:] + omega[:-1]) / 2
    lowest, highest = np.append(LOWEST * omega[0], middle), np.append(middle, omega[-1])
    motion = inner(directions, basis.Phi) / np.sqrt(basis.omega2)
    rigid = inner(directions, basis.N)
    return np.array(
        [
            receptance_error(np.linspace(low, high, POINTS), (motion, static_factors(basis)), (better, mu), rigid)
            for low, high in zip(lowest, highest, strict=True)
        ]
    )


def receptance_error(omega: Array, reduced: tuple[Array, Array], better: tuple[Array, Array], rigid: Array) -> float:
    """Return the root mean square of |H_reduced - H| / |H| over frequencies, Frobenius norms.

    H = -R Rᵀ / omega² + sum_k p_k p_kᵀ / (1 - mu_k omega² + 2 i zeta omega sqrt(mu_k)), p_k of unit strain energy.

    Parameters
    ----------
    omega
        Angular frequencies, (n_f,).
    reduced, better
        Motion p in the directions of the loads, (n_loads, n), and mu, (n,), of two models.
    rigid
        Motion R of the M-orthonormal rigid-body motions, (n_loads, n_r).
    """
    elastic = []
    for p, mu in (reduced, better):
        gain = 1 / (1 - np.outer(omega**2, mu) + 2j * DAMPING * np.outer(omega, np.sqrt(mu)))
        elastic.append((p * gain[:, None, :]) @ p.T)
    size = np.linalg.norm(elastic[1] - (rigid @ rigid.T) / omega[:, None, None] ** 2, axis=(1, 2))
    error = np.linalg.norm(elastic[0] - elastic[1], axis=(1, 2))
    return float(np.sqrt(np.mean((error / np.where(size > 0, size, 1.0)) ** 2)))


def four_digits(errors: Array, rounding: float = 0.0) -> Array:
    """Return errors with four digits, zero below `rounding`; further digits depend on the number of threads."""
    return np.array([0.0 if abs(error) < rounding else float(f"{error:.4g}") for error in errors])


# static responses, which are known exactly ----------------------------------------------------------------------------


def interface_errors(families: Families, basis: FreeBasis) -> tuple[tuple[str, ...], Array]:
    """Return names and errors of the unit loads at the excess boundary dofs E, balanced by reactions at R.

    If there are very many of them, random sums of unit loads take their places.
    """
    free = families.free
    labels, loads = families.held_names("load")[0], unit_loads(len(free.e), MOST_LOADS)
    names = tuple(labels[k] for k in free.e)
    if len(names) > MOST_LOADS:
        names = tuple(f"sum {k + 1} of all unit loads, with random signs" for k in range(SUMS))
    z = np.zeros((len(families.h), len(names)))
    z[free.e] = free.solve_boundary(loads)
    return names, energy_error(families.body, basis, combine(families.Psi_C, z))


def static_loads(families: Families, motion: MotionLoads | None) -> StaticLoads:
    """Return the loads whose static responses belong to the enlarged space."""
    none = np.zeros((families.body.n_dof, 0))
    return StaticLoads(
        response_loads(families.body), inertia_loads(families), none if motion is None else motion.beside_interfaces
    )


def inertia_loads(families: Families) -> Array:
    """Return the loads K Psi_H that hold the interfaces of the accelerating body, rotations over length, (n_dof, n_r).

    The load at the held dofs balances M Psi_R in the interior: -Psi_C,Iᵀ (M Psi_R)_I.
    """
    body = families.body
    F = body.M @ (families.Psi_R / np.where(families.rigid_components >= 3, body.length, 1.0))
    F[families.h] -= inner(families.Psi_C, F)
    return np.asarray(F)


def inertia_errors(beside: Array, whole: Array) -> Array:
    """Return the relative energy error for each inertia load, (n_r,); NaN: no energy."""
    has_energy = whole > ROUNDING_ENERGY * whole.max(initial=0.0)
    return np.sqrt(np.maximum(beside, 0.0) / np.where(has_energy, whole, np.nan))


def energy_error(body: Any, basis: FreeBasis, U: Array) -> Array:
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
