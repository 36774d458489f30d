"""Fixed-interface modes of a large body by multilevel substructures (docs/theory.md §2)."""

import logging
from collections.abc import Callable
from dataclasses import dataclass
from functools import partial

import numpy as np
import scipy.sparse as sp

from cms.errors import EigenError, ModeSetError
from cms.solvers.eigen import EigenResult, counting_shift
from cms.solvers.factorization import Factorization, factorize, require_regular
from cms.solvers.mode_count import ModeCount
from cms.solvers.orientation import orientation, turn
from cms.solvers.registry import solver_of
from cms.solvers.shift_inverted import Wanted
from cms.substructures.dissection import Dissection, dissect, node_graph
from cms.substructures.frequency_guess import guessed_omega2
from cms.substructures.improvement import ApproximateModes
from cms.substructures.reduced_mass import ReducedMass
from cms.substructures.reduced_modes import reduced_modes, reduced_omega2
from cms.substructures.tree import SubstructureTree, substructure_tree
from fe_models.foundation.arrays import Array, IntArray, frozen
from fe_models.foundation.ranks.trim import give_back
from fe_models.foundation.solver import Solver
from fe_models.foundation.tasks.task_map import TaskMap
from fe_models.foundation.threads import one_blas_thread

__all__ = ["Interior", "MultilevelResult", "multilevel_modes"]

log = logging.getLogger(__name__)

LEAF = 200  #: dofs of a part: larger ones cost more arithmetic, smaller ones more calls
GUARDS, GUARD_SHARE = 12, 0.08  #: modes beyond the wanted ones that take part: a number, and a share of these
MOST_STEPS = 8  #: of inverse iteration
SHARE = 8  #: interior dofs for each wanted mode, at least
THIN, SOLID = 20.0, 4.0  #: cutoff factors: modes of a surface grow with the frequency, of a solid with its third power
DENSER, MANY = 14.0, 400  #: that of shells where at most so many dofs are there for each wanted mode
TOO_HIGH = 1.5  #: that the estimated highest frequency is too high at least, as a rule
MARGIN = 1.1  #: of a cutoff: reduced frequencies lie above the true ones
RAISE, MOST_RAISES = 2.0, 3  #: of the bound, as a frequency, where it leaves too few modes of substructures


@dataclass(frozen=True, eq=False)
class Interior:
    """The interior of a body with its boundary held."""

    K: sp.csc_array  #: (n, n) [N/m]
    M: sp.csc_array  #: (n, n) [kg]
    nodes: IntArray  #: node of every dof, (n,)
    points: Array  #: of all nodes of the body, (n_nodes, 3) [m]
    is_multiplier: Array  #: which dofs are Lagrange multipliers, (n,)

    def dissection(self, leaf: int) -> Dissection:
        """Return the tree of the dofs; multipliers and the nodes that they tie are in its root."""
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
    """Modes, the errors that are left in them, and the tree, which solves for other columns too."""

    modes: EigenResult
    errors: Array  #: estimated relative error of each frequency, from above, (k,)
    n_steps: int  #: of inverse iteration
    n_reduced: int  #: modes of all substructures
    cutoff_factor: float  #: modes of substructures up to so many times the highest wanted frequency
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
    """Lowest vibration modes by automated multilevel substructuring.

    (1) nested dissection: parts of some hundred dofs, and separators
    (2) bound: `cutoff_factor` times the cutoff; of a number of modes, times an estimate of its highest frequency, which
        is `TOO_HIGH` times too high as a rule
    (3) every substructure is reduced to its own modes up to the bound, and eliminated from those above it; once more
        with a higher bound where they are fewer than a number of modes and its guards
    (4) of a number of modes: its highest frequency again, by the reduced pencil up to the estimate; a lower bound, but
        none that leaves fewer modes than these
    (5) the reduced pencil: its lowest modes, expanded down the tree
    (6) where the error that is left is above the tolerance: steps of inverse iteration by the tree

    Frequencies are those of a Rayleigh-Ritz basis: never below the true ones.

    Parameters
    ----------
    interior
        With a definite stiffness but for multipliers.
    wanted
        A number of modes, or all up to a cutoff; proven to be all by the inertia of a factorisation, or not. Without
        the proof a mode that lies nearer below a cutoff than the tolerance may be left out: its frequency is too high.
    tolerance
        Largest relative error of a frequency. What stays above it after some steps is told, not raised.
    cutoff_factor
        Larger: more modes of substructures, fewer steps (6). None: 20 for shells and beams, 14 where there
        are at most 400 interior dofs for each wanted mode, 4 for solids.
    tasks
        Where subtrees are eliminated; None: in threads of this process.
    rows
        Over how many dofs the modes are told, and which of these are the interior; None: over the interior.
    solver
        What factorises for the proof; None: the fastest one that is installed.

    Raises
    ------
    EigenError
        If the substructures have fewer modes than are wanted, or the inertia counts others.
    ModeSetError
        If a large part of all modes is wanted.
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
                f"multilevel: {wanted.words} of {n} interior dofs; expected at most 1 in {SHARE} of them; "
                "take craig-bampton"
            )
        highest = guessed_omega2(dissection, interior.K, interior.M, int(wanted.n or 0))
    factor = _factor(interior, wanted) if cutoff_factor is None else cutoff_factor
    bound = factor**2 * highest if wanted.n is None else max((factor / TOO_HIGH) ** 2, 1.0) * highest
    least = wanted.n + _guards(wanted.n) if wanted.n else 0
    make = partial(substructure_tree, dissection, K, M, multipliers=multipliers, tasks=tasks)
    tree, bound = _tree_of(make, bound, least)  # (3)
    give_back()
    require_regular(interior.K, Factorization(tree, solver_of(solver)))  # pivots of rounding are positive too
    with one_blas_thread():
        own, mass = tree.omega2, tree.mass()
        if wanted.n is not None:
            if wanted.n > len(own):
                raise EigenError(
                    f"multilevel: {wanted.words}, but the substructures have {len(own)} modes up to {factor:g} "
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
            f"multilevel: {wanted.words}: all {p} modes that take part came to lie below it, so that others may be "
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
            turn(Phi, orientation(Phi, omega2))
    method = (
        f"multilevel substructures: {dissection.n} in a tree, {kept.sum()} modes up to {factor:g} times the "
        f"highest wanted frequency, {n_steps} steps of inverse iteration"
    )
    found = EigenResult(
        omega2, np.sqrt(omega2) / (2 * np.pi), Phi, modes.residuals[:k], modes.n_solves, method, is_proven=wanted.verify
    )
    return MultilevelResult(found, errors, n_steps, int(kept.sum()), factor, tree)


def _factor(interior: Interior, wanted: ModeCount) -> float:
    """Return the cutoff factor of shells and beams, whose nodes have rotations, or of solids."""
    n = len(interior.nodes)
    if n <= 4.5 * len(np.unique(interior.nodes)):
        return SOLID
    return DENSER if wanted.n is not None and n <= MANY * wanted.n else THIN


def _tree_of(make: Callable[[float], SubstructureTree], bound: float, least: int) -> tuple[SubstructureTree, float]:
    """(3) Return a tree with at least so many modes up to a bound on omega², if some raises of it bring them."""
    tree = make(bound)
    for _ in range(MOST_RAISES):
        if tree.mode_starts[-1] >= least:
            break
        tree.close()
        bound *= RAISE**2
        tree = make(bound)
    return tree, bound


def _smallest(values: Array, k: int) -> float:
    """Return the k-th smallest of some values, k from 1; of k = 0 zero."""
    return float(np.partition(values, k - 1)[k - 1]) if k else 0.0


def _highest(own: Array, mass: ReducedMass, guess: float, count: int) -> float:
    """(4) Return omega² of the highest of `count` modes, somewhat too high, by modes of substructures below a guess."""
    most = max(guess, _smallest(own, count))
    kept = own <= most
    return float(reduced_omega2(own[kept], mass.of(kept), count)) if count else guess


def _reduced(own: Array, mass: ReducedMass, wanted: ModeCount, highest: float) -> tuple[Array, Array]:
    """(5) Return omega² of the wanted modes of the reduced pencil and of guards beyond them, and the modes."""
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


def _improved(
    modes: ApproximateModes, Z: Array, count: int, tolerance: float, highest: float
) -> tuple[Array, int]:
    """(6) Improve modes until the error that is left in the wanted ones is below the tolerance.

    The wanted ones: at least `count`, and all that came to lie below omega² = `highest`. All are improved together with
    the guards, whose amplitudes are the last columns of Z: a mode by itself would keep what it has of a poor guard next
    to it, which the estimate does not see.
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
    """Count the modes below a gap after the wanted ones by Sylvester's law of inertia."""
    last, sigma = counting_shift(omega2[: k + GUARDS], k, Wanted.of(wanted), 0.0)
    A = sp.csc_array(interior.K - sigma * interior.M)
    with factorize(A, definite=False, solver=solver) as factorization:
        inertia = factorization.inertia
    n_below = inertia.n_negative - int(interior.is_multiplier.sum())
    if inertia.n_zero or n_below != last:
        raise EigenError(
            f"multilevel: found {last} modes below {np.sqrt(sigma) / (2 * np.pi):.6g} Hz, but the inertia counts "
            f"{n_below}; choose a larger cutoff_factor"
        )
