"""Degrees of freedom that joints and drives leave free, and the distance of a driven system from singular positions."""

import numpy as np
import scipy.linalg as la

from fe_models.foundation.arrays import Array
from floatframe.analyses.driven.driven_motion import Instant, rigid_columns, rigid_equations
from floatframe.engine.compiling.system import CompiledSystem, compiled_system
from floatframe.engine.initial_conditions.freedoms import dependent_rows, unit_rows
from floatframe.engine.initial_conditions.newton_equations import set_iterate
from floatframe.engine.kernels.work import new_work
from floatframe.errors import ConvergenceError
from floatframe.model.joints.rows import is_held
from floatframe.model.state import State
from floatframe.model.system import System
from floatframe.results.small_motions.joint_rates import coordinate_rows, driven_coordinates

__all__ = ["SingularityGuard", "free_coordinates"]

SINGULAR = 1e-6  #: smallest singular value of the scaled constraint rows (length one each) at a singular position
FREE = 1e-7  #: the same for a motion that no constraint resists
TOLD = 1e-6  #: fraction of a motion from which a coordinate or body is reported as part of it


def free_coordinates(system: System, state: State, *, t: float = 0.0) -> tuple[str, ...]:
    """Return the free motions at a state that satisfies the joints: a minimal set of joint coordinates, or bodies.

    Flexible bodies are treated as rigid.
    """
    compiled = compiled_system(system)
    work = new_work(compiled.model)
    work.state.time[...] = t
    set_iterate(work, state)
    rigid = rigid_columns(compiled)
    G = rigid_equations(compiled, work).G[is_held(compiled.model.rows.kind)]
    G = scaled_rows(compiled, G)
    _, values, right = la.svd(G) if len(G) else (0, np.zeros(0), np.eye(int(rigid.sum())))
    motions = right[int((values > FREE).sum()) :]
    if not len(motions):
        return ()
    rows = coordinate_rows(system, compiled, work, state)
    driven = set(driven_coordinates(system))
    names = [name for name in rows if name not in driven]
    scale = rigid_scale(compiled)
    named: list[str] = []
    left = motions
    if names:
        rates = np.array([rows[name][rigid] * scale for name in names]) @ motions.T
        rates[np.linalg.norm(rates, axis=1) < FREE] = 0.0
        _, R, order = la.qr(unit_rows(rates).T, mode="economic", pivoting=True)
        rank = int((np.abs(np.diag(R)) > TOLD).sum())
        chosen = sorted(order[:rank])
        named = [f"{names[k]!r}" for k in chosen]
        _, values, right = la.svd(rates[chosen])
        left = right[rank:] @ motions
    if len(left):
        share = (left**2).reshape(len(left), -1, 6).sum(axis=(0, 2))
        moving = [name for name, part in zip(compiled.body_names, share, strict=True) if part > TOLD]
        named.append(
            f"{len(left)} motions of {', '.join(repr(name) for name in moving)} of which no joint coordinate tells"
        )
    return tuple(named)


def rigid_scale(compiled: CompiledSystem) -> Array:
    """Return scale lengths of translations, and 1 for rotations, (6 n_b,), which give all unknowns the same unit."""
    return np.tile(np.repeat([compiled.length, 1.0], 3), len(compiled.body_names))


def scaled_rows(compiled: CompiledSystem, G: Array) -> Array:
    """Return constraint rows by motions of the body frames, (n_held, 6 n_b), in one unit, scaled to length one."""
    return unit_rows(G * rigid_scale(compiled))


class SingularityGuard:
    """Monitors the smallest singular value of the constraints, and the sign of their determinant, during a motion."""

    def __init__(self, compiled: CompiledSystem, now: Instant) -> None:
        """Begin at an instant; `ConvergenceError` if it is singular."""
        self.compiled = compiled
        self.kept = np.logical_not(dependent_rows(scaled_rows(compiled, now.G)))  #: linearly independent rows
        self.sign = 0.0
        self.check(now, now.t)

    def check(self, now: Instant, last_t: float) -> None:
        """Raise `ConvergenceError` at a singular position, or if one was passed since the previous time."""
        G = scaled_rows(self.compiled, now.G)[self.kept]
        left, values, _ = la.svd(G)
        is_square = G.shape[0] == G.shape[1]
        sign = float(np.linalg.slogdet(G)[0]) if is_square else 1.0
        is_passed = self.sign not in (0.0, sign)
        if is_square and values[-1] > SINGULAR and not is_passed:
            self.sign = sign
            return
        is_met = not is_square or values[-1] <= SINGULAR
        where = f"at t = {now.t:g}" if is_met else f"between t = {last_t:g} and {now.t:g}"
        holds = np.flatnonzero(is_held(self.compiled.model.rows.kind))[self.kept]
        owner = [self.compiled.owners[k] for k in holds]
        share = left[:, -1] ** 2
        names = dict.fromkeys(owner)
        involved = [name for name in names if sum(s for s, o in zip(share, owner, strict=True) if o == name) > 0.02]
        raise ConvergenceError(
            f"a singular position {where}: the constraints of joints {', '.join(repr(name) for name in involved)} "
            f"depend on each other there (smallest singular value {values[-1]:.2g}), so that the drives do not decide "
            "which way the mechanism goes on; drive another coordinate, or keep away from this position",
            t=now.t,
            h=0.0,
            residual=float(values[-1]),
        )
