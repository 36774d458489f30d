"""Fixed-interface modes of a large body by multilevel substructuring (docs/theory.md §2)."""

import logging
from collections.abc import Callable
from dataclasses import dataclass
from functools import partial

import numpy as np
import scipy.sparse as sp

from cms.errors import EigenError, ModeSetError
from cms.linear_algebra.solvers.eigen import EigenResult, counting_shift, eigenmodes, orientation, turn_in_place
from cms.linear_algebra.solvers.factorization import Factorization, factorize, require_regular
from cms.linear_algebra.solvers.mode_count import ModeCount
from cms.linear_algebra.solvers.registry import solver_of
from cms.linear_algebra.substructures.dissection import Dissection, dissect, node_graph
from cms.linear_algebra.substructures.reduced_mass import ReducedMass
from cms.linear_algebra.substructures.reduced_modes import ApproximateModes, reduced_modes, reduced_omega2
from cms.linear_algebra.substructures.tree import SubstructureTree, substructure_tree
from fe_models.foundation.arrays import Array, IntArray, frozen
from fe_models.foundation.ranks.trim import give_back
from fe_models.foundation.solver import Solver
from fe_models.foundation.sparse.submatrix import principal_block
from fe_models.foundation.tasks.task_map import TaskMap
from fe_models.foundation.threads import one_blas_thread

__all__ = ["Interior", "MultilevelResult", "guessed_omega2", "multilevel_modes"]


# estimate of the n-th natural frequency, before any mode is computed --------------------------------------------------


SAMPLES = 8  #: number of subtrees whose modes are computed for the estimate
EACH = 6  #: smallest number of computed modes per subtree, if the body has enough modes


def guessed_omega2(dissection: Dissection, K: sp.csc_array, M: sp.csc_array, count: int) -> float:
    """Estimate omega² of the highest of `count` modes, tending to be too high [1/s²].

    (1) choose subtrees that share no dof, each with some of the wanted modes
    (2) compute the modes of a few of them, with all other dofs fixed
    (3) take the count-th of all these modes, each weighted with the number of dofs that it represents

    Fixed dofs raise frequencies. With all subtrees, (3) would be an upper bound; a sample gives an estimate.
    """
    starts, parents = dissection.starts, dissection.parents
    first = dissection.first_of_subtrees()
    sizes = starts[1:] - starts[first]
    limit = len(dissection.order) * max(EACH / max(count, 1), 1 / 64)
    is_large = sizes > limit
    is_large[-1] = True
    roots = np.flatnonzero(~is_large & is_large[parents])
    roots = roots[sizes[roots] > limit / 4] if (sizes[roots] > limit / 4).any() else roots
    if not len(roots):
        roots = np.array([dissection.n - 1])
    chosen = roots[np.unique(np.linspace(0, len(roots) - 1, SAMPLES).astype(int))]  # (1)
    covered = sizes[chosen].sum()
    omega2, weights = [], []
    for root in chosen.tolist():  # (2)
        dofs = np.sort(dissection.order[starts[first[root]] : starts[root + 1]])
        share = count * sizes[root] / covered * (covered / len(dissection.order))
        n_modes = min(int(2 * share) + 4, len(dofs))
        found = _lowest(K, M, dofs, n_modes)
        omega2.append(found)
        weights.append(np.full(len(found), len(dissection.order) / covered))
    values, weight = np.concatenate(omega2), np.concatenate(weights)
    order = np.argsort(values)
    reached = np.cumsum(weight[order]) >= count  # (3)
    return float(values[order][np.argmax(reached)] if reached.any() else values.max())


def _lowest(K: sp.csc_array, M: sp.csc_array, dofs: IntArray, n_modes: int) -> Array:
    return np.array(eigenmodes(principal_block(K, dofs), principal_block(M, dofs), n_modes, tolerance=1e-2).omega2)


# modes ----------------------------------------------------------------------------------------------------------------


log = logging.getLogger(__name__)

LEAF = 200  #: number of dofs of a part; larger parts need more arithmetic, smaller parts more calls
#: number of guard modes that are computed beyond the wanted modes: a constant, plus a share of the wanted modes
GUARDS, GUARD_SHARE = 12, 0.08
MOST_STEPS = 8  #: largest number of inverse iteration steps
SHARE = 8  #: smallest number of interior dofs per wanted mode
#: cutoff factors: the number of modes is proportional to frequency for a surface, and to its third power for a solid
THIN, SOLID = 20.0, 4.0
DENSER, MANY = 14.0, 400  #: cutoff factor of shells with at most so many dofs per wanted mode
TOO_HIGH = 1.5  #: factor by which the estimate of the highest frequency is usually at least too high
MARGIN = 1.1  #: factor on a cutoff frequency, because reduced frequencies are above the true ones
#: increase of the bound (as a frequency) if too few substructure modes are found, and number of increases
RAISE, MOST_RAISES = 2.0, 3


@dataclass(frozen=True, eq=False)
class Interior:
    """Interior of a body whose boundary is fixed."""

    K: sp.csc_array  #: interior stiffness, (n, n) [N/m]
    M: sp.csc_array  #: interior mass, (n, n) [kg]
    nodes: IntArray  #: node of each dof, (n,)
    points: Array  #: positions of all nodes of the body, (n_nodes, 3) [m]
    is_multiplier: Array  #: whether each dof is a Lagrange multiplier, (n,)

    def dissection(self, leaf: int) -> Dissection:
        """Return the tree of substructures; multipliers and the nodes that they tie are in its root."""
        graph, node = node_graph(self.K, self.M, self.nodes)
        tied = np.zeros(graph.shape[0], dtype=bool)
        tied[node[self.is_multiplier]] = True
        tied |= np.asarray(graph @ tied.astype(np.int64)) > 0
        points = self.points[np.unique(self.nodes)]
        found = dissect(graph, points, np.bincount(node), leaf=leaf, last=np.flatnonzero(tied))
        rank = np.empty(len(points), dtype=np.int64)
        rank[found.order] = np.arange(len(points))
        order = np.argsort(rank[node], kind="stable")
        return Dissection(order, np.searchsorted(rank[node][order], found.starts), found.parents)


@dataclass(frozen=True, eq=False)
class MultilevelResult:
    """Computed modes, their remaining errors, and the tree, which can also solve for other columns."""

    modes: EigenResult
    errors: Array  #: upper estimate of the relative error of each frequency, (k,)
    n_steps: int  #: number of inverse iteration steps
    n_reduced: int  #: total number of modes of all substructures
    cutoff_factor: float  #: highest frequency of retained substructure modes divided by the highest wanted frequency
    tree: SubstructureTree

    def __post_init__(self) -> None:
        object.__setattr__(self, "errors", frozen(self.errors))


def multilevel_modes(
    interior: Interior,
    wanted: ModeCount,
    *,
    tolerance: float = 1e-3,
    cutoff_factor: float | None = None,
    tasks: TaskMap | None = None,
    rows: tuple[int, IntArray] | None = None,
    solver: Solver | None = None,
) -> MultilevelResult:
    """Compute the lowest vibration modes by automated multilevel substructuring.

    (1) nested dissection into parts of some hundred dofs, and separators
    (2) bound: `cutoff_factor` times the cutoff, or times an estimate of the highest wanted frequency, which is usually
        too high by the factor `TOO_HIGH`
    (3) every substructure is reduced to its own modes up to the bound, and eliminated from the enclosing ones; this is
        repeated with a higher bound if there are fewer modes than wanted plus guards
    (4) for a number of modes: estimate the highest frequency again, from the reduced pencil up to the first estimate;
        lower the bound accordingly
    (5) compute the lowest modes of the reduced pencil, and expand them down the tree
    (6) take steps of inverse iteration with the tree while the remaining error is above the tolerance

    The frequencies are those of a Rayleigh-Ritz basis, so they are never below the true ones.

    Parameters
    ----------
    interior
        Interior of the body; its stiffness is positive definite except for multipliers.
    wanted
        A number of modes, or all up to a cutoff, with or without proof by the inertia of a factorisation. Without the
        proof, a mode closer below the cutoff than the tolerance may be missed, because its frequency is too high.
    tolerance
        Largest relative error of a frequency. If larger errors remain after `MOST_STEPS` steps, a warning reports them.
    cutoff_factor
        A larger factor keeps more substructure modes and needs fewer steps (6). None: 4 for solids; for shells and
        beams 20, or 14 if a number of modes is wanted that is at least 1/400 of the interior dofs.
    tasks
        Workers that eliminate subtrees; None: threads of this process.
    rows
        Number of dofs of the returned modes, and the indices of interior dofs; None: the modes have only interior dofs.
    solver
        Solver for the proof; None: the fastest installed solver.

    Raises
    ------
    EigenError
        If the substructures have fewer modes than wanted, or the inertia counts a different number.
    ModeSetError
        If a large share of all modes is wanted.
    FactorizationError
        If the stiffness is singular.
    """
    n = interior.K.shape[0]
    dissection = interior.dissection(LEAF)  # (1)
    multipliers = np.flatnonzero(interior.is_multiplier[dissection.order])
    K, M = (dissection.in_order(A) for A in (interior.K, interior.M))
    if wanted.cutoff is not None:  # (2)
        highest = (2 * np.pi * wanted.cutoff) ** 2
    else:
        if SHARE * int(wanted.n or 0) > n > LEAF:
            raise ModeSetError(
                f"multilevel: {wanted.description} of {n} interior dofs; expected at most 1 in {SHARE} of them; "
                "take craig-bampton"
            )
        highest = guessed_omega2(dissection, interior.K, interior.M, int(wanted.n or 0))
    factor = _factor(interior, wanted) if cutoff_factor is None else cutoff_factor
    bound = factor**2 * highest if wanted.n is None else max((factor / TOO_HIGH) ** 2, 1.0) * highest
    least = wanted.n + _guards(wanted.n) if wanted.n else 0
    make = partial(substructure_tree, dissection, K, M, multipliers=multipliers, tasks=tasks)
    tree, bound = _tree_of(make, bound, least)  # (3)
    give_back()
    require_regular(interior.K, Factorization(tree, solver_of(solver)))  # pivots from rounding errors are positive too
    with one_blas_thread():
        own, mass = tree.omega2, tree.mass()
        if wanted.n is not None:
            if wanted.n > len(own):
                raise EigenError(
                    f"multilevel: {wanted.description}, but the substructures have {len(own)} modes up to {factor:g} "
                    "times the estimated frequency; choose a larger cutoff_factor, or fewer modes"
                )
            bound = min(bound, factor**2 * _highest(own, mass, highest, wanted.n))  # (4)
            bound = max(bound, _smallest(own, min(least, len(own))))
        kept = own <= bound
        reduced, Z_kept = _reduced(own[kept], mass.of(kept), wanted, highest)  # (5)
        p, count = len(reduced), wanted.n if wanted.n is not None else int((reduced <= MARGIN**2 * highest).sum())
        Z = np.zeros((len(own), p))
        Z[kept] = Z_kept
        del Z_kept, mass
        told = count if wanted.n is not None else p
        modes = ApproximateModes(tree, K, M, reduced, tree.expand(Z[:, :told]))
        below = highest if wanted.cutoff is not None else 0.0
        errors, n_steps = _improved(modes, Z, count, tolerance, below)  # (6)
        del Z
    k = count if wanted.n is not None else int((modes.omega2 <= highest).sum())
    if wanted.n is None and k == p < kept.sum():
        raise EigenError(
            f"multilevel: {wanted.description}: all {p} computed modes are below this frequency, so others may be "
            "missing; choose a larger cutoff_factor"
        )
    errors = errors[:k]
    if (worst := errors > tolerance).any():
        log.warning(
            "multilevel: %d of %d frequencies may be more than %g too high after %d steps, first mode %d (%.1e); raise "
            "cutoff_factor (%g)", worst.sum(), k, tolerance, n_steps, np.argmax(worst) + 1, errors.max(), factor,
        )  # fmt: skip
    if wanted.verify:
        _require_all(interior, modes.omega2, k, wanted, solver)
    omega2 = np.array(modes.omega2[:k])
    n_rows, of_interior = rows or (n, np.arange(n))
    Phi = np.zeros((n_rows, k))
    modes.into(Phi, of_interior[dissection.order])
    modes.X = np.empty((0, 0))
    if k:
        with one_blas_thread():
            turn_in_place(Phi, orientation(Phi, omega2))
    method = (
        f"multilevel substructures: {dissection.n} in a tree, {kept.sum()} modes up to {factor:g} times the "
        f"highest wanted frequency, {n_steps} steps of inverse iteration"
    )
    found = EigenResult(
        omega2, np.sqrt(omega2) / (2 * np.pi), Phi, modes.residuals[:k], modes.n_solves, method, is_proven=wanted.verify
    )
    return MultilevelResult(found, errors, n_steps, int(kept.sum()), factor, tree)


def _factor(interior: Interior, wanted: ModeCount) -> float:
    """Return the cutoff factor for solids; for shells and beams, whose nodes have rotations; and for many modes."""
    n = len(interior.nodes)
    if n <= 4.5 * len(np.unique(interior.nodes)):
        return SOLID
    return DENSER if wanted.n is not None and n <= MANY * wanted.n else THIN


def _tree_of(make: Callable[[float], SubstructureTree], bound: float, least: int) -> tuple[SubstructureTree, float]:
    """Step (3): return a tree with at least `least` modes up to a bound on omega², which is raised if necessary."""
    tree = make(bound)
    for _ in range(MOST_RAISES):
        if tree.mode_starts[-1] >= least:
            break
        tree.close()
        bound *= RAISE**2
        tree = make(bound)
    return tree, bound


def _smallest(values: Array, k: int) -> float:
    """Return the k-th smallest value, k from 1; zero for k = 0."""
    return float(np.partition(values, k - 1)[k - 1]) if k else 0.0


def _highest(own: Array, mass: ReducedMass, guess: float, count: int) -> float:
    """Step (4): estimate omega² of the highest of `count` modes, slightly too high, from modes below a guess."""
    most = max(guess, _smallest(own, count))
    kept = own <= most
    return float(reduced_omega2(own[kept], mass.of(kept), count)) if count else guess


def _reduced(own: Array, mass: ReducedMass, wanted: ModeCount, highest: float) -> tuple[Array, Array]:
    """Step (5): return omega² and modes of the reduced pencil: the wanted modes, then guard modes."""
    n = len(own)
    if wanted.n is not None:
        return reduced_modes(own, mass, min(wanted.n + _guards(wanted.n), n))
    first = min(n, int(2 * (own <= MARGIN**2 * highest).sum()) + GUARDS + 20)
    omega2, Z = reduced_modes(own, mass, first)
    count = int((omega2 <= MARGIN**2 * highest).sum())
    p = min(count + _guards(count), n)
    if p > first:
        omega2, Z = reduced_modes(own, mass, p)
    return omega2[:p], Z[:, :p]


def _guards(count: int) -> int:
    return GUARDS + int(GUARD_SHARE * count)


def _improved(modes: ApproximateModes, Z: Array, count: int, tolerance: float, highest: float) -> tuple[Array, int]:
    """Step (6): improve modes until the remaining errors of the wanted ones are below the tolerance.

    The wanted modes are at least `count`, and all below omega² = `highest`. All modes are improved together with the
    guards, whose amplitudes are the last columns of Z. A mode improved alone would keep its component along an
    inaccurate neighbouring guard, which the estimate does not measure.
    """
    count = max(count, int((modes.omega2 <= highest).sum()))
    errors, n_steps = modes.errors(count, tolerance) if count else np.zeros(0), 0
    while n_steps < MOST_STEPS and not (errors <= tolerance).all():
        n_steps += 1
        if modes.X.shape[1] < Z.shape[1]:
            modes.X = np.hstack([modes.X, modes.tree.expand(Z[:, modes.X.shape[1] :])])
        modes.improve()
        count = max(count, int((modes.omega2 <= highest).sum()))
        errors = modes.errors(count, tolerance)
    return errors, n_steps


def _require_all(interior: Interior, omega2: Array, k: int, wanted: ModeCount, solver: Solver | None) -> None:
    """Check the number of modes below a gap after the wanted ones by Sylvester's law of inertia."""
    last, sigma = counting_shift(omega2[: k + GUARDS], k, wanted, 0.0)
    A = sp.csc_array(interior.K - sigma * interior.M)
    with factorize(A, definite=False, solver=solver) as factorization:
        inertia = factorization.inertia
    n_below = inertia.n_negative - int(interior.is_multiplier.sum())
    if inertia.n_zero or n_below != last:
        raise EigenError(
            f"multilevel: found {last} modes below {np.sqrt(sigma) / (2 * np.pi):.6g} Hz, but the inertia counts "
            f"{n_below}; choose a larger cutoff_factor"
        )
