"""Equilibrium by increasing loads, for systems in which the flow of `equilibrium` fails; p is the load fraction.

At a state x0, the forces f0 are unbalanced, and the rows have errors g0. The equilibria of

    (1) f(x, w) = (1 - p) f0,   g(x, w) = (1 - p) g0

form a path from x0 at p = 0 to the equilibrium of the system at p = 1. Each is found by Newton's method from the
previous one, with a rough tolerance on the way. The steps of p are doubled if this is quick, and halved if it is not
(Newton homotopy, [1]_). If p hardly increases any more, for example because the path turns back, the search is
abandoned.

.. [1] Allgower & Georg 1990.
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
import scipy.linalg as la
import scipy.sparse as sp

from fe_models.foundation.arrays import Array
from floatframe.engine.initial_conditions.newton_equations import Linearized
from floatframe.model.state import State

__all__ = ["LARGEST", "Balance", "LoadPathEnd", "is_left_by_none", "led_equilibrium"]

FIRST, LEAST = 0.25, 1e-3  #: first and smallest step of p
#: numbers of iterations for one p: up to QUICK, the next step is doubled; above MOST, the step is rejected
QUICK, MOST = 4, 8
SHRUNK = 0.5  #: ratio of the last two iterations above which a step of p is rejected
AFTER_FAILURE = 2  #: number of steps after a rejected step in which the step size does not grow
LONGEST = 0.3  #: largest motion in one iteration: rotation [rad], and translation relative to the size of the system
SETTLED = 1e-7  #: size of the last iteration at which the final equilibrium is accepted
#: size of an iteration, absolute and relative to the first one, that is accepted for equilibria on the path
ROUGH, OF_FIRST = 1e-2, 0.1
PATIENCE, ADVANCE = 40, 0.02  #: number of solves in which p must increase by ADVANCE
MOST_SOLVES = 300
LARGEST = 4000  #: largest number of unknowns for this method, whose check of the flow needs dense eigenvalues
LEAVING = 1e-9  #: growth rate, relative to the fastest rate of the flow, below which it is a rounding error


@dataclass(frozen=True, eq=False)
class Balance:
    """Unbalanced forces and constraint errors at a state, with the Newton step."""

    forces: Array  #: unbalanced forces f, (n_u,)
    gaps: Array  #: constraint errors g, (n_w,)
    #: function that returns the Newton step for given forces and errors: (n_u,) in ground axes, (n_w,)
    way: Callable[[Array, Array], tuple[Array, Array]]


@dataclass(frozen=True, eq=False)
class LoadPathEnd:
    """End of the path of increasing loads."""

    state: State
    w: Array  #: wrenches of the connections, (n_w,)
    p: float  #: load fraction in equilibrium at this state; 1: near an equilibrium of the system
    n_solves: int


def led_equilibrium(
    state: State,
    w: Array,
    balance: Callable[[State, Array], Balance | None],
    displaced: Callable[[State, Array], State],
    length_of: Callable[[Array], float],
) -> LoadPathEnd:
    """Return the largest load fraction reached, with state and wrenches; p = 0 if no load was reached.

    Parameters
    ----------
    state, w
        Initial state and wrenches.
    balance
        Unbalanced forces at a state; None if they are not finite.
    displaced
        Function that returns the state after a step, (n_u,) in ground axes.
    length_of
        Function that returns the largest translation of a step, relative to the size of the system, or rotation [rad].
    """
    begun = balance(state, w)
    if begun is None:
        return LoadPathEnd(state, w, 0.0, 0)
    p, step, n_solves, waiting = 0.0, FIRST, 0, 0
    seen = [(0, 0.0)]  #: number of solves and p; the first entry is more than `PATIENCE` solves ago, or the beginning
    while p < 1.0:
        target = min(1.0, p + step)
        x, y, at = state, w, begun if p == 0.0 else balance(state, w)
        ways: list[float] = []
        while at is not None:
            n_solves += 1
            moved, dw = at.way(at.forces - (1 - target) * begun.forces, at.gaps - (1 - target) * begun.gaps)
            ways.append(length_of(moved) if np.isfinite(moved).all() else np.inf)
            if ways[-1] > LONGEST or len(ways) > MOST or (len(ways) > 2 and ways[-1] > SHRUNK * ways[-3]):
                at = None
                break
            x, y = displaced(x, moved), y + dw
            if ways[-1] <= (SETTLED if target == 1.0 else min(ROUGH, OF_FIRST * ways[0])):
                break
            at = balance(x, y)
        if at is None:
            step, waiting = (target - p) / 2, AFTER_FAILURE
        else:
            state, w, p = x, y, target
            seen.append((n_solves, p))
            step *= 2.0 if len(ways) <= QUICK and not waiting else 1.0
            waiting = max(waiting - 1, 0)
        while len(seen) > 1 and seen[1][0] <= n_solves - PATIENCE:
            seen.pop(0)
        is_slow = n_solves - seen[0][0] >= PATIENCE and p - seen[0][1] < ADVANCE
        if step < LEAST or is_slow or n_solves >= MOST_SOLVES:
            break
    return LoadPathEnd(state, w, p, n_solves)


def is_left_by_none(parts: Linearized, K: tuple[Array, ...], W: tuple[Array, ...]) -> bool:
    """Return whether the flow W dx/dtau = -f, with closed joints, returns to an equilibrium from all nearby states.

    Increasing loads may lead to unstable branches, such as a beam that stays straight beyond its buckling load.
    The rates are the eigenvalues of [[K, -Jᵀ], [G, V]] relative to [[W, 0], [0, 0]]; a rate below zero leads away. Only
    for systems with at most `LARGEST` unknowns.
    """
    n_u, n_w = parts.J.shape[1], parts.J.shape[0]
    A = sp.block_array([[sp.block_diag(K), -parts.J.T], [parts.G, parts.V]]).toarray() if n_w else la.block_diag(*K)
    B = np.zeros_like(A)
    B[:n_u, :n_u] = la.block_diag(*W)
    try:  # eigenvalues 1/rate: 0 for constraints; a negative rate has a negative inverse
        inverse = np.linalg.eigvals(np.linalg.solve(A, B)).real
    except np.linalg.LinAlgError:  # singular, or not finite
        return False
    return bool(inverse.min() >= -LEAVING * np.abs(inverse).max())
