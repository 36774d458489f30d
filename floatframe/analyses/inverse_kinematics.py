"""Inverse kinematics: joint coordinates within limits that bring markers to given positions and orientations.

The unknowns are small motions of all bodies (without modes) that the joints allow. With the errors e of the targets,
their rows J, the constraint rows G of joints and couplers, and the rows X of the joint coordinates x, one iteration
consists of

    (1) N, a basis of the motions with G y = 0
    (2) a from least |J N a - e|² + mu |a|² with lower <= x + X N a <= upper (least distance of Lawson and Hanson)
    (3) the bodies are moved by N a, joint constraints are restored, and coordinates beyond a limit are brought back to
        it; mu decreases if the errors have decreased, and increases otherwise

If the targets are out of reach, the search ends where no allowed motion reduces the errors, and reports this.
"""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass

import numpy as np
import scipy.linalg as la
from scipy.optimize import nnls

from fe_models.foundation.arrays import Array, GivenArrayOrNone, given
from fe_models.foundation.presentation import presented
from fe_models.foundation.records import checked_fields
from fe_models.foundation.words import nearest, quoted
from floatframe.analyses.driven.driven_motion import rigid_columns
from floatframe.engine.compiling.file_frames import state_of_file
from floatframe.engine.compiling.markers import MarkerData, find_marker, joint_markers, marker_pose, n_q_of
from floatframe.engine.compiling.system import CompiledSystem, compiled_system
from floatframe.engine.initial_conditions.initial import assembled
from floatframe.engine.initial_conditions.newton_equations import displaced, in_ground_axes, linearized, set_iterate
from floatframe.engine.kernels.work import Work, new_work
from floatframe.errors import ModelError
from floatframe.model.bodies.coordinates import JointCoordinateName
from floatframe.model.bodies.markers import Marker
from floatframe.model.checked_values import array_of_shape, number, rotation_of
from floatframe.model.joints import SlidingJoint
from floatframe.model.joints.rows import RelativePlace, RowCoordinate, is_held
from floatframe.model.rotations import rotation_log
from floatframe.model.state import State
from floatframe.model.system import System
from floatframe.results.small_motions.joint_rates import coordinate_rows
from floatframe.results.small_motions.marker_jacobian import marker_jacobian

__all__ = ["ReachedPose", "Target", "inverse_kinematics"]

FREE = 1e-9  #: singular value of the scaled constraint rows below which a motion is allowed
MOST_TURN = 0.5  #: largest motion in one iteration: rotation [rad], and translation relative to the size of the system
#: distance of a coordinate beyond its limit that is permitted, in rad or relative to the size of the system
WITHIN = 1e-12
PLACED = 1e-9  #: the same distance, for the pose at which the search begins
#: distance from its limit, absolute or relative to its size, at which a coordinate is reported to be at its limit
AT_LIMIT = 1e-7
MOST_RETURNS = 10  #: largest number of Newton iterations that bring a coordinate back to its limit
#: rounding error of a coordinate, relative to the distance of bodies from the origin
ROUNDING = 4 * np.finfo(float).eps
NO_WAY = 1e-11  #: size of an iteration below which the search ends


@dataclass(frozen=True, eq=False)
@checked_fields(ModelError)
class Target:
    """Desired position, orientation or both of a marker, in ground axes.

    Parameters
    ----------
    marker
        Marker that is to be brought to the target.
    position
        (3,) [m]; None: any position.
    rotation
        Axes as columns, (3, 3); None: any orientation.
    weight
        Relative to other targets, above zero.
    """

    marker: Marker
    position: Array | Sequence[float] | None = None
    rotation: GivenArrayOrNone = given(None)
    weight: float = 1.0


@presented
@dataclass(frozen=True, eq=False)
@checked_fields(ModelError)
class ReachedPose:
    """The result of inverse kinematics.

    Parameters
    ----------
    state
        State of the system, at rest.
    coordinates
        Coordinates of all joints, by "joint.coordinate".
    position_error
        Largest distance from a target position [m].
    rotation_error
        Largest rotation from a target orientation [rad].
    is_reached
        Whether all targets are met within the tolerance.
    at_limits
        Coordinates that are at a limit.
    n_iterations
        Number of iterations.
    """

    state: State
    coordinates: Mapping[str, float]
    position_error: float
    rotation_error: float
    is_reached: bool
    at_limits: tuple[str, ...]
    n_iterations: int


def inverse_kinematics(
    system: System,
    targets: Sequence[Target] | Target,
    *,
    limits: Mapping[str, tuple[float | None, float | None]] | None = None,
    tolerance: float = 1e-10,
    max_iterations: int = 200,
) -> ReachedPose:
    """Return the pose near the assembled one in which markers reach their targets, or come as near as joints allow.

    Bodies keep their initial deformation; prescribed motions are evaluated at t = 0. Another solution, such as the
    other bend of an elbow, is found from another initial position of the bodies.

    Parameters
    ----------
    system
        The system; the search begins at its assembled position, which must be within the limits.
    targets
        One or more.
    limits
        Lower and upper limit by "joint.coordinate", None for no limit [rad or m]. Stops of the system are also limits.
    tolerance
        Tolerance of the errors: rotations [rad], distances relative to the size of the system.
    max_iterations
        Largest number of iterations, after which the target is not reached.

    Raises
    ------
    ModelError
        If there is no target, a coordinate does not exist, or the assembled position is beyond its limits.
    """
    goals = [targets] if isinstance(targets, Target) else list(targets)
    if not goals:
        raise ModelError("inverse_kinematics: expected at least one target, got none")
    search = Search(system, goals, dict(limits or {}))
    return search.run(number("inverse_kinematics: tolerance", tolerance, above=0.0), max_iterations)


class Search:
    """State of a search, with its targets and limits."""

    def __init__(self, system: System, goals: list[Target], limits: dict[str, tuple[float | None, float | None]]):
        where = "inverse_kinematics"
        self.system = system
        self.compiled: CompiledSystem = compiled_system(system)
        self.work: Work = new_work(self.compiled.model)
        self.n_q = n_q_of(system)
        self.rigid = rigid_columns(self.compiled)
        self.goals: list[tuple[MarkerData, Array | None, Array | None, float]] = []
        for k, goal in enumerate(goals):
            if not isinstance(goal, Target) or (goal.position is None and goal.rotation is None):
                raise ModelError(
                    f"{where}: target {k + 1}: expected Target(marker, position or rotation), got {goal!r}"
                )
            at = find_marker(system, f"{where}: target {k + 1}", goal.marker)
            if at.body < 0:
                raise ModelError(f"{where}: target {k + 1}: its marker is on the ground, which does not move")
            r = None if goal.position is None else array_of_shape(f"{where}: position", goal.position, (3,))
            R = None if goal.rotation is None else rotation_of(f"{where}: rotation", goal.rotation)
            self.goals.append((at, r, R, number(f"{where}: weight", goal.weight, above=0.0)))
        state = assembled(self.compiled, self.work, self.compiled.placed)
        self.state = State(state.r, state.p, state.q, np.zeros_like(state.u))
        values = self.values(self.state, {})
        for coupler in system.couplers:
            if coupler.limits is not None and len(coupler.terms) == 1:
                coordinate, factor = coupler.terms[0]
                if isinstance(coordinate, JointCoordinateName):
                    name = f"{coordinate.joint}.{coordinate.coordinate}"
                    ends = [
                        None if end is None else end / factor for end in (coupler.limits.lower, coupler.limits.upper)
                    ]
                    limits.setdefault(name, (ends[0], ends[1]) if factor > 0 else (ends[1], ends[0]))
        for name in limits:
            if name not in values:
                raise ModelError(f"{where}: limits: no coordinate {quoted(name)}{nearest(name, values)}")
        self.names = list(limits)
        angles = {f"{joint}.{each.name}" for joint, each, _ in self.coordinates(self.state) if each.is_angle}
        self.sizes = np.array([1.0 if name in angles else self.compiled.length for name in self.names])
        lower = np.array([-np.inf if low is None else low for low, _ in limits.values()], dtype=float)
        upper = np.array([np.inf if high is None else high for _, high in limits.values()], dtype=float)
        self.lower, self.upper = lower / self.sizes, upper / self.sizes
        x = self.limited(values)
        beyond = np.flatnonzero((x < self.lower - PLACED) | (x > self.upper + PLACED))
        if len(beyond):
            k = int(beyond[0])
            raise ModelError(
                f"{where}: {self.names[k]} is placed at {values[self.names[k]]:.6g}, beyond its limits {lower[k]:g} "
                f"to {upper[k]:g}; place the bodies within them"
            )

    def values(self, state: State, before: Mapping[str, float]) -> dict[str, float]:
        """Return all joint coordinates at a state; angles are counted on from the values before."""
        found: dict[str, float] = {}
        for joint, each, place in self.coordinates(state):
            name, value = f"{joint}.{each.name}", float(each.value(place))
            if each.is_angle:
                value += 2 * np.pi * round((before.get(name, value) - value) / (2 * np.pi))
            found[name] = value
        return found

    def coordinates(self, state: State) -> Iterator[tuple[str, RowCoordinate, RelativePlace]]:
        """Yield joint name, coordinate name and coordinate at a state, for all joint coordinates."""
        placed = self.compiled.placed
        for joint in self.system.joints:
            if isinstance(joint, SlidingJoint):
                continue
            ends = joint_markers(self.system, joint, placed)
            (r_a, A_a), (r_b, A_b) = (marker_pose(end, placed, self.n_q) for end in ends)
            own = [row.coordinate for row in joint.rows(A_a, A_b, r_b - r_a) if row.coordinate is not None]
            (r_a, A_a), (r_b, A_b) = (marker_pose(end, state, self.n_q) for end in ends)
            for each in own:
                yield joint.name, each, RelativePlace(A_a, A_b, r_b - r_a)

    def limited(self, values: Mapping[str, float]) -> Array:
        """Return the coordinates that have limits, (n,), in rad or relative to the size of the system."""
        return np.array([values[name] for name in self.names]) / self.sizes

    def errors(self, state: State) -> tuple[Array, float, float]:
        """Return weighted errors (distances relative to the system size), largest distance and largest rotation."""
        parts, far, turned = [], 0.0, 0.0
        for at, r, R, weight in self.goals:
            x, A = marker_pose(at, state, self.n_q)
            if r is not None:
                far = max(far, float(np.linalg.norm(r - x)))
                parts.append(weight * (r - x) / self.compiled.length)
            if R is not None:
                theta = rotation_log(R @ A.T)
                turned = max(turned, float(np.linalg.norm(theta)))
                parts.append(weight * theta)
        return np.concatenate(parts), far, turned

    def rows(self, state: State) -> tuple[Array, Array, Array]:
        """Return N, J N and X N at a state, by step (1)."""
        compiled, work, length = self.compiled, self.work, self.compiled.length
        model = compiled.model
        set_iterate(work, state)
        G = linearized(model, work, 1.0, 0.0, 0.0).G.toarray()[is_held(model.rows.kind)]
        unit = np.zeros(G.shape[1])  # a length for translations, 1 for rotations, 0 for modes
        unit[self.rigid] = np.tile(np.repeat([length, 1.0], 3), len(compiled.body_names))
        scaled = (G * unit)[:, self.rigid]
        size = np.linalg.norm(scaled, axis=1, keepdims=True)
        _, values, right = la.svd(scaled / np.where(size > 0, size, 1.0)) if len(G) else (0, np.zeros(0), np.eye(
            scaled.shape[1]
        ))  # fmt: skip
        allowed = right[int((values > FREE).sum()) :].T
        N = np.zeros((G.shape[1], allowed.shape[1]))
        N[self.rigid] = unit[self.rigid][:, None] * allowed
        J = []
        for at, r, R, weight in self.goals:
            own = marker_jacobian(compiled, work, at) @ N[model.bodies.u0[at.body] : model.bodies.u0[at.body + 1]]
            if r is not None:
                J.append(weight * own[:3] / length)
            if R is not None:
                J.append(weight * own[3:])
        by_name = coordinate_rows(self.system, compiled, work, state)
        X = np.array([by_name[name] @ N for name in self.names]).reshape(len(self.names), N.shape[1])
        X /= self.sizes[:, None]
        return N, np.concatenate(J), X

    def within(self, state: State, before: Mapping[str, float]) -> State:
        """Return the state after coordinates return to their limits and joints are closed, by step (3)."""
        model = self.compiled.model
        noise = ROUNDING * float(np.abs(state.r).max()) / self.compiled.length
        for _ in range(MOST_RETURNS):
            x = self.limited(self.values(state, before))
            beyond = x - np.clip(x, self.lower, self.upper)
            if not len(x) or np.abs(beyond).max() <= WITHIN + noise:
                break
            N, _, X = self.rows(state)
            y = N @ np.linalg.lstsq(X[beyond != 0], -beyond[beyond != 0], rcond=1e-9)[0]
            state = assembled(self.compiled, self.work, displaced(model, state, in_ground_axes(model, state, y)))
        return state

    def run(self, tolerance: float, most: int) -> ReachedPose:
        """Search, and return the pose that was reached."""
        compiled = self.compiled
        state, values, mu = self.state, self.values(self.state, {}), 1e-3
        error, far, turned = self.errors(state)
        rows = self.rows(state)
        n = 0
        while n < most and max(far / compiled.length, turned) > tolerance:
            n += 1
            N, A, X = rows
            x = self.limited(values)
            a = least_within(A, error, mu * float(error @ error), X, self.lower - x, self.upper - x)  # (2)
            y = N @ a
            way = max(np.abs(y[self.rigid]).reshape(-1, 2, 3).max(axis=(0, 2)) / [compiled.length, 1.0])
            if way < NO_WAY:
                break
            y *= min(1.0, MOST_TURN / way)
            tried = displaced(compiled.model, state, in_ground_axes(compiled.model, state, y))
            try:
                tried = self.within(assembled(compiled, self.work, tried), values)  # (3)
            except ModelError:  # the motion is too large for the joint constraints to be satisfied
                mu = max(10 * mu, 1e-6)
                continue
            found, new_far, new_turned = self.errors(tried)
            if found @ found >= error @ error:
                mu = max(10 * mu, 1e-6)
                if mu > 1e12:
                    break
                continue
            mu *= 0.2
            state, error, far, turned = tried, found, new_far, new_turned
            values = self.values(state, values)
            rows = self.rows(state)
        x = self.limited(values)
        near = AT_LIMIT * np.maximum(1.0, np.abs(x))
        at = tuple(
            name for name, low, high in zip(self.names, x - self.lower < near, self.upper - x < near, strict=True)
            if low or high
        )  # fmt: skip
        is_reached = max(far / compiled.length, turned) <= tolerance
        return ReachedPose(state_of_file(compiled, state), values, far, turned, is_reached, at, n)


def least_within(A: Array, e: Array, mu: float, X: Array, lower: Array, upper: Array) -> Array:
    """Return the minimum a of |A a - e|² + mu |a|² for lower <= X a <= upper, (n,), by Lawson and Hanson's method.

    With H = AᵀA + mu 1 = L Lᵀ and z = Lᵀ a - L⁻¹ Aᵀ e, it is the shortest z with C z >= d, found by nonnegative least
    squares. Bounds that a = 0 violates only by rounding are taken as satisfied.
    """
    H = A.T @ A
    H[np.diag_indices_from(H)] += max(mu, 1e-14 * max(float(np.trace(H)), 1e-300))
    L = la.cholesky(H, lower=True)
    free = la.solve_triangular(L, A.T @ e, lower=True)
    rows = np.concatenate([X[np.isfinite(lower)], -X[np.isfinite(upper)]])
    bounds = np.concatenate([lower[np.isfinite(lower)], -upper[np.isfinite(upper)]])
    C = la.solve_triangular(L, rows.T, lower=True).T if len(rows) else rows
    d = np.minimum(bounds, 0.0) - C @ free
    z = np.zeros(len(free))
    if len(rows) and (d > 0).any():
        E = np.vstack([C.T, d])
        f = np.zeros(len(E))
        f[-1] = 1.0
        u, _ = nnls(E, f)
        r = E @ u - f
        z = -r[:-1] / r[-1]
    return np.asarray(la.solve_triangular(L.T, z + free, lower=False))
