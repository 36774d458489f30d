"""Check that a moving state is steady, so that small motions about it have constant coefficients.

(1) at the state, all bodies have one velocity field v_0 + Omega × r, and forces balance the accelerations of the steady
    motion
(2) a little later, after all bodies have moved and spinning bodies have turned, forces balance again with new wrenches,
    and the matrices in axes that turn with the system are the same. This check fails if a wheel is not round, a road is
    uneven, or a function of time is not constant.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
import scipy.linalg as la
from numpy.typing import NDArray

from fe_models.foundation.arrays import Array
from floatframe.analyses.equilibrium import forces_at_work, size_of, worst_body
from floatframe.analyses.snapshot import Equilibrium
from floatframe.analyses.steady.carrier import Carrier, moved_on, turned_axes
from floatframe.analyses.system_matrices import Tangents, rows_of_states, tangents, turning_matrices
from floatframe.engine.compiling.file_frames import motion_of_engine
from floatframe.engine.compiling.system import CompiledSystem
from floatframe.engine.initial_conditions.newton_equations import Linearized, linearized, set_iterate, with_modal_weight
from floatframe.engine.kernels.work import Work, new_work
from floatframe.errors import ModelError
from floatframe.model.joints.rows import is_held
from floatframe.model.rotations import rotation_matrix
from floatframe.model.state import State

__all__ = ["require_steady"]

BALANCED = 1e-5  #: largest unbalanced force, relative to the acting forces, in a steady state
#: the same limit at a later time, with interpolated road and rail tables; flanges in a curve give 1e-5
BALANCED_LATER = 1e-4
LEAST = 1e-3  #: smallest acting forces assumed, relative to forces that would reverse all velocities
ALONG = 1e-6  #: largest deviation of a velocity from the common motion, relative to the largest velocity
SAME = 1e-5  #: largest change of a matrix, relative to its largest entry; flanges in a curve give 3e-6
ROUND = 1e-6  #: largest relative change of a mass matrix
TURN = 1.234  #: rotation of the fastest body until the later time [rad]; not a simple fraction of a circle
AHEAD = 0.1  #: distance travelled until the later time if nothing spins, relative to the size of the system
MOST_ITERATIONS = 10
NOT = "linearize: this state is not steady:"
AT_ONCE = "use the state of steady_motion or steady_rotation"  #: advice if forces are unbalanced at the state
#: advice if forces are balanced at the state but not later
LATER = (
    "a force there changes as the system moves on, such as a torsion spring to the ground that winds up, "
    "an uneven road, or a function of time"
)


@dataclass(frozen=True, eq=False)
class Balance:
    """Unbalanced forces at a state."""

    error: float  #: unbalanced forces, relative to the acting forces
    body: str  #: body with the largest unbalanced force
    w: Array  #: wrenches that minimise the unbalanced forces, (n_w,)


def require_steady(
    compiled: CompiledSystem, about: Equilibrium, work: Work, parts: Tangents, N: Array, S: Array
) -> None:
    """Raise `ModelError` with the reason if a moving state is not steady.

    Parameters
    ----------
    compiled
        The system.
    about
        The state; a state at rest is accepted without a check.
    work
        Working arrays, evaluated at the state.
    parts
        Matrices of small motions at the state.
    N
        Basis of the motions that joints allow, (n_u, n_z).
    S
        Basis of the motions, over z, that velocity constraints allow, (n_z, n_y).
    """
    state, _ = motion_of_engine(compiled, about.state, about.u_dot)
    if not state.u.any():
        return
    carrier = carrier_of(compiled, state, about.omega)
    now = balance(compiled, work, about.w)
    require_balance(now, max(BALANCED, 10 * about.residual), "forces are unbalanced", AT_ONCE)
    model, spins = compiled.model, spins_in(compiled, state, about.omega)
    fastest = max((float(np.linalg.norm(spin)) for spin in spins), default=0.0)
    speed, turning = float(np.abs(carrier.velocity).max()), float(np.linalg.norm(about.omega))
    if not fastest and speed <= turning * compiled.length:  # the axis passes through the system
        fastest = turning
    later = TURN / fastest if fastest else AHEAD * compiled.length / speed
    moved, moved_u_dot = moved_on(model, state, carrier, spins, later)
    turned = turned_axes(model, spins, later)
    other = new_work(model)
    other.state.time[...] = about.t + later
    other.states.base[:] = work.states.base
    set_iterate(other, moved, moved_u_dot, about.w)
    require_round(compiled, work, other, turned)
    after = balance(compiled, other, about.w)
    words = f"{later:.3g} time units later, forces are unbalanced"
    require_balance(after, max(BALANCED_LATER, 10 * about.residual), words, LATER)
    set_iterate(other, moved, moved_u_dot, after.w)
    others = tangents(model, other)
    N_later = turned.T @ N
    of_now = parts.full(*turning_matrices(model, work, about.omega))
    of_then = others.full(*turning_matrices(model, other, about.omega))
    motions = np.abs(N_later * compiled.motion_lengths[:, None]).max(axis=0) / compiled.length
    gaps = others.G @ N_later
    if (np.abs(gaps) > SAME * np.outer(compiled.gap_sizes[parts.holds], motions)).any():
        raise ModelError(f"{NOT} {later:.3g} time units later, its joints allow other motions")
    for name, one, two in zip(("stiffness", "damping"), of_now, of_then, strict=False):
        first, second = S.T @ (N.T @ one @ N), S.T @ (N_later.T @ two @ N_later)
        change = np.abs(second - first)
        if change.max(initial=0.0) > SAME * np.abs(first).max(initial=0.0):
            motion = np.abs(N) @ change.max(axis=0)
            raise ModelError(
                f"{NOT} {later:.3g} time units later, its {name} differs by "
                f"{change.max() / np.abs(first).max():.2g}, most at body {body_of(compiled, motion)!r}; "
                "spinning bodies must be round, and roads even along the path"
            )


def carrier_of(compiled: CompiledSystem, state: State, omega: Array) -> Carrier:
    """Return the steadily moving frame that carries all bodies of a state; omega is its angular velocity.

    Raises
    ------
    ModelError
        If a body moves relative to the others, or its modal coordinates change.
    """
    bodies = compiled.model.bodies
    v = np.array([state.u[u0 : u0 + 3] for u0 in bodies.u0[:-1]])
    rest = v - np.cross(omega, state.r - state.r[0])
    size = max(float(np.abs(v).max()), float(np.linalg.norm(omega)) * compiled.length)
    apart = np.abs(rest - np.median(rest, axis=0)).max(axis=1)
    if apart.max() > ALONG * size:
        i = int(np.argmax(apart))
        raise ModelError(
            f"{NOT} body {compiled.body_names[i]!r} moves at {apart[i]:.3g} relative to the others; use the state of "
            "steady_motion or steady_rotation"
        )
    for i, u0 in enumerate(bodies.u0[:-1]):
        rates = state.u[u0 + 6 : bodies.u0[i + 1]]
        own = state.q[bodies.q0[i] : bodies.q0[i + 1]]
        lengths = compiled.motion_lengths[u0 + 6 : bodies.u0[i + 1]]
        shape = np.abs(own * lengths).max(initial=0.0) / compiled.length
        if np.abs(rates * lengths).max(initial=0.0) > ALONG * size * max(shape, 1.0):
            raise ModelError(
                f"{NOT} modal coordinates of body {compiled.body_names[i]!r} change; use the state of steady_motion, "
                "or integrate until they are constant"
            )
    return Carrier(state.r[0], np.median(rest, axis=0), omega)


def spins_in(compiled: CompiledSystem, state: State, omega: Array) -> list[Array]:
    """Return the angular velocity of each body relative to the rotating system, body axes, (3,).

    Raises
    ------
    ModelError
        If a flexible body spins.
    """
    spins = []
    for i, u0 in enumerate(compiled.model.bodies.u0[:-1]):
        own = state.u[u0 + 3 : u0 + 6] - rotation_matrix(state.p[i]).T @ omega
        speed = float(np.linalg.norm(state.u[u0 : u0 + 3])) / compiled.length
        if np.linalg.norm(own) <= ALONG * max(float(np.linalg.norm(omega)), speed):
            own = np.zeros(3)
        elif compiled.model.bodies.n_q[i]:
            raise ModelError(
                f"{NOT} body {compiled.body_names[i]!r} is flexible and spins at {np.linalg.norm(own):.3g} relative to "
                "the rotating system, so that its modes spin too; make it rigid (is_rigid)"
            )
        spins.append(own)
    return spins


def balance(compiled: CompiledSystem, work: Work, w: Array) -> Balance:
    """Return the unbalanced forces for the motion in `work`, and the wrenches that minimise them."""
    model, w = compiled.model, w.copy()
    own = rows_of_states(np.asarray(model.states.row), len(w))
    free = ~is_held(model.rows.kind) & ~own
    mass = linearized(model, work, 1.0, 0.0, 0.0).H
    W, least = with_modal_weight(model, mass), LEAST * speed_changes(compiled, work, mass)
    for _ in range(MOST_ITERATIONS):
        work.state.w[:] = w
        parts = linearized(model, work, 0.0, 0.0, 1.0)
        f = work.bodies.residual.copy()
        error = size_of(W, f) / max(forces_at_work(compiled, work, parts, W), least)
        step = next_wrenches(parts, f, work.connections.g, free, ~own)
        size = np.abs(w[~own]).max(initial=0.0)
        w[~own] += step
        if np.abs(step).max(initial=0.0) <= 1e-9 * size:
            break
    return Balance(error, worst_body(compiled, W, f), w)


def speed_changes(compiled: CompiledSystem, work: Work, mass: Sequence[Array]) -> float:
    """Return the norm of the forces that would reverse all velocities while the system moves by its size."""
    u, total, speed, turning = work.state.u, 0.0, 0.0, 0.0
    for R, block, (first, last) in zip(work.state.R, mass, pairwise(compiled.model.bodies.u0.tolist()), strict=True):
        own = np.concatenate([R.T @ u[first : first + 3], u[first + 3 : last]])
        total += float(own @ block @ own)
        speed = max(speed, float(np.abs(u[first : first + 3]).max()) / compiled.length)
        turning = max(turning, float(np.abs(u[first + 3 : first + 6]).max()))
    return float(np.sqrt(total)) * max(speed, turning)


def next_wrenches(parts: Linearized, f: Array, g: Array, free: NDArray[np.bool_], unknown: NDArray[np.bool_]) -> Array:
    """Return the smallest change of wrenches that minimises residuals of forces and laws."""
    if not unknown.any():
        return np.zeros(0)
    J, V = parts.J.toarray()[unknown], parts.V.toarray()[np.ix_(free, unknown)]
    size = max(float(np.abs(J).max(initial=0.0)), 1e-300)
    A, b = np.vstack([-J.T / size, V]), -np.concatenate([f / size, g[free]])
    return np.asarray(la.lstsq(A, b, cond=1e-12)[0])


def require_balance(found: Balance, most: float, words: str, advice: str) -> None:
    """Raise `ModelError` with an advice if unbalanced forces exceed the fraction `most` of the acting forces."""
    if not found.error <= most:
        raise ModelError(
            f"{NOT} {words} by {found.error:.2g} of the acting forces, most at body {found.body!r}; {advice}"
        )


def require_round(compiled: CompiledSystem, work: Work, later: Work, turned: Array) -> None:
    """Raise `ModelError` with the name of a spinning body whose mass matrix changes as it rotates."""
    masses = (linearized(compiled.model, each, 1.0, 0.0, 0.0).H for each in (work, later))
    for i, (one, two) in enumerate(zip(*masses, strict=True)):
        u = slice(int(compiled.model.bodies.u0[i]), int(compiled.model.bodies.u0[i + 1]))
        change = np.abs(turned[u, u] @ two @ turned[u, u].T - one)[:6, :6]
        m, J = one[0, 0], np.abs(one[3:6, 3:6]).max()
        allowed = ROUND * np.kron([[m, np.sqrt(m * J)], [np.sqrt(m * J), J]], np.ones((3, 3)))
        if (change > allowed).any():
            raise ModelError(
                f"{NOT} body {compiled.body_names[i]!r} spins about an axis about which its mass is not symmetric; "
                "move its centre of mass onto the axis, and give it equal moments of inertia across the axis"
            )


def body_of(compiled: CompiledSystem, motion: Array) -> str:
    """Return the name of the body with the largest part in a motion, (n_u,)."""
    u0 = compiled.model.bodies.u0
    return compiled.body_names[int(np.argmax([np.abs(motion[a:b]).max() for a, b in pairwise(u0)]))]
