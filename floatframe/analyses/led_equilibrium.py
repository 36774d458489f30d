"""Towards an equilibrium by loads that grow: for those whose flow (`equilibrium`) loses its way.

At a state x0 forces f0 are out of balance, and rows g0 open. The equilibria of

    (1) f(x, w) = (1 - p) f0,   g(x, w) = (1 - p) g0

lead from x0 at p = 0 to that of the system at p = 1. Each is found by Newton's method from the one before, roughly on
the way; p takes longer steps while that is quick, and half as long ones where it is not. (Newton homotopy, [1]_.) Where
p hardly grows any more, as where the way turns back, it is given up.

.. [1] Allgower & Georg 1990.
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
import scipy.linalg as la
import scipy.sparse as sp

from fe_models.foundation.arrays import Array
from floatframe.start.newton_equations import Linearized
from floatframe.state import State

__all__ = ["LARGEST", "Balance", "Led", "is_left_by_none", "led_equilibrium"]

FIRST, LEAST = 0.25, 1e-3  #: steps of p
QUICK, MOST = 4, 8  #: iterations of one p: after so few the next step is twice as long; after so many it is given up
SHRUNK = 0.5  #: an iteration by the one before the last, above which one p is given up
AFTER_FAILURE = 2  #: steps of p after a failure that are not followed by a longer one
LONGEST = 0.3  #: rad, and part of the size of the system, in one iteration
SETTLED = 1e-7  #: the same, of an iteration after which the last equilibrium is taken as found
ROUGH, OF_FIRST = 1e-2, 0.1  #: of one on the way, and by the first iteration of its p: what is left goes with the next
PATIENCE, ADVANCE = 40, 0.02  #: solves in which p has to grow by so much
MOST_SOLVES = 300
LARGEST = 4000  #: unknowns up to which this is tried: whether the flow leaves an equilibrium takes dense eigenvalues
LEAVING = 1e-9  #: of the fastest rate of the flow, below which one is rounding


@dataclass(frozen=True, eq=False)
class Balance:
    """What is out of balance at a state and wrenches, and the way Newton's method goes from there."""

    forces: Array  #: f, (n_u,)
    gaps: Array  #: g, (n_w,)
    way: Callable[[Array, Array], tuple[Array, Array]]  #: of forces and gaps to take off: (n_u,) in ground axes, (n_w,)


@dataclass(frozen=True, eq=False)
class Led:
    """Where loads that grow have led."""

    state: State
    w: Array  #: wrenches, (n_w,)
    p: float  #: part of the loads that is balanced there; 1: near an equilibrium of the system
    n_solves: int


def led_equilibrium(
    state: State,
    w: Array,
    balance: Callable[[State, Array], Balance | None],
    displaced: Callable[[State, Array], State],
    length_of: Callable[[Array], float],
) -> Led:
    """Return how far the loads have led, and the state and wrenches there; p = 0 if they did not begin to.

    Parameters
    ----------
    state, w
        Where to begin.
    balance
        What is out of balance at a state; None where that is no number.
    displaced
        The state after a way, (n_u,) in ground axes.
    length_of
        Largest translation of a way by the size of the system, or rotation [rad].
    """
    begun = balance(state, w)
    if begun is None:
        return Led(state, w, 0.0, 0)
    p, step, n_solves, waiting = 0.0, FIRST, 0, 0
    seen = [(0, 0.0)]  #: solves and p, the first one more than `PATIENCE` solves ago or at the begin
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
    return Led(state, w, p, n_solves)


def is_left_by_none(parts: Linearized, K: tuple[Array, ...], W: tuple[Array, ...]) -> bool:
    """Whether the flow W dx/dtau = -f, with all joints closed, leads back to an equilibrium from all places near by.

    Loads that grow go along branches which the flow leaves, such as a beam that stays straight beyond its buckling. The
    rates are the eigenvalues of [[K, -Jᵀ], [G, V]] over [[W, 0], [0, 0]]; one below zero leads away. It is for systems
    of up to `LARGEST` unknowns.
    """
    n_u, n_w = parts.J.shape[1], parts.J.shape[0]
    A = sp.block_array([[sp.block_diag(K), -parts.J.T], [parts.G, parts.V]]).toarray() if n_w else la.block_diag(*K)
    B = np.zeros_like(A)
    B[:n_u, :n_u] = la.block_diag(*W)
    try:  # the largest of 1/rate: 0 where joints hold, and one over a negative rate is negative
        inverse = np.linalg.eigvals(np.linalg.solve(A, B)).real
    except np.linalg.LinAlgError:  # singular, or no numbers
        return False
    return bool(inverse.min() >= -LEAVING * np.abs(inverse).max())
