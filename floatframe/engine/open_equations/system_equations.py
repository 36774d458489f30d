"""The equations of motion of a system, for the user's own integrators and controllers.

    M(x) a = f(t, x, v) + G(t, x)ᵀ lam,     g(t, x) = 0,     x_dot = v (see `Configurations`)

with constraint rates G v = g_1(t, x) and G a = g_2(t, x, v). All values come from the kernels that `integrate` uses
(docs/theory.md §6, §10). In the kernels, the complete wrench w of each connection is unknown and has as many rows:
constraint rows, and rows C w = b that define the wrench. Here the rows C w = b are solved:

    w = w_0(t, x, v) + W(t, x) lam,   C w_0 = b (least norm),   C W = 0,   Jᵀ W = Gᵀ,

This leaves the forces f = f_bodies + Jᵀ w_0, and one multiplier for each constraint row.
"""

from dataclasses import dataclass, replace
from functools import cached_property
from typing import Literal, overload

import numpy as np
import scipy.linalg as la
import scipy.sparse as sp
from numpy.typing import NDArray

from fe_models.foundation.arrays import Array
from fe_models.foundation.presentation import presented
from fe_models.foundation.records import checked_fields
from floatframe.engine.compiling.callbacks import raise_errors_of
from floatframe.engine.compiling.file_frames import state_of_engine, state_of_file
from floatframe.engine.compiling.system import CompiledSystem, compiled_system
from floatframe.engine.initial_conditions.initial import (
    assembled,
    consistent_motion,
    has_normal_friction,
    start_unknowns,
    with_compatible_velocities,
)
from floatframe.engine.initial_conditions.newton_equations import by_velocities, linearized, set_iterate
from floatframe.engine.kernels.model import Model
from floatframe.engine.kernels.work import Work, new_work
from floatframe.engine.open_equations.configuration import Configurations
from floatframe.engine.open_equations.layout import Layout, layout_of
from floatframe.engine.open_equations.rows import RowParts, Structure, row_parts, structure_of
from floatframe.errors import ModelError
from floatframe.model.joints.rows import is_held_velocity
from floatframe.model.rotations import rotation_matrix, tilde
from floatframe.model.state import State
from floatframe.model.system import System

__all__ = ["Equations", "Tangents", "open_equations"]

AGREES = 1e-9  #: relative error below which rows and forces count as affine, or as transposes of each other
STEP = 2e-3  #: difference step for derivatives of wrenches by x at fixed multipliers


@dataclass(frozen=True, eq=False)
class Tangents:
    """Derivatives of the residual M a - f - Gᵀ lam, each (n_v, n_v)."""

    by_x: Array  #: derivative by the displacement dx in x (+) dx; rotations in rad, translations in m
    by_v: Array
    by_a: Array  #: derivative by the accelerations: the mass matrix


@presented
@dataclass(frozen=True, eq=False, repr=False)
@checked_fields(ModelError)
class Equations:
    """Open equations of a system; positions, velocities and multipliers as in `layout`, in units of the system.

    A stiffened flexible body is computed in mean axes (docs/equations.md). `state` and `vectors` convert vectors to
    states in the frames of the files, as in results and sensors, and back.

    Parameters
    ----------
    system
        The system.
    compiled
        The compiled system.
    model
        Numbers of the model, without the compliance of redundant rows.
    work
        Working arrays of the evaluation.
    structure
        Structure of its rows.
    configurations
        The maps x (+) dx, log, T, and conversions between velocities and rates.
    layout
        Names and units of x, v, lam.
    near
        Unknowns of connections at which counting the angles of couplers and user forces starts, (n_w,), see `followed`.
    """

    system: System
    compiled: CompiledSystem
    model: Model
    work: Work
    structure: Structure
    configurations: Configurations
    layout: Layout
    near: Array

    @property
    def n_x(self) -> int:
        """Number of components of x."""
        return self.configurations.n_x

    @property
    def n_v(self) -> int:
        """Number of components of v, of a and of the residual."""
        return self.configurations.n_v

    @property
    def n_lam(self) -> int:
        """Number of constraints and multipliers."""
        return len(self.structure.held)

    @cached_property
    def is_holonomic(self) -> NDArray[np.bool_]:
        """Whether each constraint is holonomic, (n_lam,) bool; the others (rolling) constrain only a velocity."""
        return ~is_held_velocity(self.model.rows.kind[self.structure.held])

    def require_no_stops(self, method: str) -> None:
        """Raise `ModelError` with the name of an element that can end a run; `method` does not evaluate outputs."""
        if self.compiled.stop_words:
            raise ModelError(
                f"{method}: {self.compiled.stop_words[0]}: an output may end a run, but this method does not "
                "evaluate outputs; use integrate, or an element without stops"
            )

    # states

    def vectors(self, state: State) -> tuple[Array, Array]:
        """Return x, (n_x,), and v, (n_v,), of a state in the frames of the files, for example of a trajectory."""
        return self.vectors_of_engine(state_of_engine(self.compiled, state))

    def state(self, x: Array, v: Array) -> State:
        """Return the state for x and v in the frames of the files, for `integrate`, `snapshot` and comparisons."""
        return state_of_file(self.compiled, self.engine_state(x, v))

    def vectors_of_engine(self, state: State) -> tuple[Array, Array]:
        """Return x and v of a state in the frames of the engine."""
        x, q0 = np.zeros(self.n_x), self.model.bodies.q0
        for i, (j, _, n) in enumerate(self.configurations.parts()):
            x[j : j + 7 + n] = np.concatenate([state.r[i], state.p[i], state.q[q0[i] : q0[i + 1]]])
        return x, np.array(state.u)

    def engine_state(self, x: Array, v: Array | None = None) -> State:
        """Return the state for x and v in the frames of the engine; the default of v is zero."""
        x = vector("x", x, self.n_x)
        return self.configurations.state(x, np.zeros(self.n_v) if v is None else vector("v", v, self.n_v))

    def start(self, state: State | None = None, *, t: float = 0.0) -> tuple[Array, Array, Array, Array]:
        """Return consistent x, v, a, lam at time t near a state (default: the assembled bodies).

        Raises
        ------
        ModelError
            If the joint constraints cannot be satisfied, or some constraints are redundant.
        """
        x, v = self.vectors_of_engine(consistent_motion(self.system, state, t=t).state)
        return x, v, *self.accelerations(t, x, v)

    def project(self, t: float, x: Array, v: Array) -> tuple[Array, Array]:
        """Return x and v projected onto g = 0 and G v = g_1 with the least change, as at the start of `integrate`."""
        self.work.state.time[...] = t
        state = assembled(self.compiled, self.work, self.engine_state(self.configurations.normalized(x), v))
        return self.vectors_of_engine(with_compatible_velocities(self.compiled, self.work, state))

    def followed(self, t: float, x: Array) -> "Equations":
        """Return equations that count the angles of couplers and user forces from their values at x.

        Each angle is the one within half a turn of the last followed value, initially zero. If a coordinate rotates
        further, call this between steps: `eq = eq.followed(t, x)`.
        """
        rows = self.model.coordinates.row
        g = self.rows_at(t, x).g
        near = self.near.copy()
        near[rows] -= g[rows]
        return replace(self, near=near, work=new_work(self.model))

    # the equations

    def residual(self, t: float, x: Array, v: Array, a: Array, lam: Array) -> Array:
        """Return the residual M a - f - Gᵀ lam, (n_v,) [N, N m, N], which is zero in a motion."""
        parts, own = self.at(t, x, v, vector("a", a, self.n_v))
        return np.asarray(own - parts.held_force(vector("lam", lam, self.n_lam)))

    def force(self, t: float, x: Array, v: Array) -> Array:
        """Return f, (n_v,) [N, N m, N]: loads, weight, elastic, damping and inertia forces at zero accelerations."""
        return -self.at(t, x, v)[1]

    @overload
    def mass(self, x: Array) -> Array: ...
    @overload
    def mass(self, x: Array, *, sparse: Literal[False]) -> Array: ...
    @overload
    def mass(self, x: Array, *, sparse: Literal[True]) -> sp.csr_array: ...

    def mass(self, x: Array, *, sparse: bool = False) -> Array | sp.csr_array:
        """Return the symmetric mass matrix M(x), (n_v, n_v) [kg, kg m, kg m²]; as a csr_array if `sparse`."""
        set_iterate(self.work, self.engine_state(x))
        blocks = linearized(self.model, self.work, 1.0, 0.0, 0.0).H
        for R, block in zip(self.work.state.R, blocks, strict=True):
            block[:3] = R @ block[:3]
            block[:, :3] = block[:, :3] @ R.T
        return sp.csr_array(sp.block_diag(blocks)) if sparse else np.asarray(la.block_diag(*blocks))

    def constraint(self, t: float, x: Array) -> Array:
        """Return g, (n_lam,) [m, rad]; zero for rows that constrain only a velocity (see `is_holonomic`)."""
        return np.where(self.is_holonomic, self.rows_at(t, x).g[self.structure.held], 0.0)

    @overload
    def jacobian(self, t: float, x: Array) -> Array: ...
    @overload
    def jacobian(self, t: float, x: Array, *, sparse: Literal[False]) -> Array: ...
    @overload
    def jacobian(self, t: float, x: Array, *, sparse: Literal[True]) -> sp.csr_array: ...

    def jacobian(self, t: float, x: Array, *, sparse: bool = False) -> Array | sp.csr_array:
        """Return the Jacobian G, (n_lam, n_v): dg = G dx, and the rate of g is G v - g_1."""
        G = self.rows_at(t, x).held_jacobian()
        return G if sparse else G.toarray()

    def velocity_right(self, t: float, x: Array) -> Array:
        """Return g_1, the right side of G v = g_1, (n_lam,) [m/s, rad/s]; nonzero only for prescribed motions."""
        return -self.rates(t, x, np.zeros(self.n_v))[0]

    def velocity_defect(self, t: float, x: Array, v: Array) -> Array:
        """Return the rate of g, G v - g_1, (n_lam,) [m/s, rad/s]."""
        return self.rates(t, x, v)[0]

    def acceleration_right(self, t: float, x: Array, v: Array) -> Array:
        """Return g_2, the right side of G a = g_2, (n_lam,) [m/s², rad/s²]."""
        return -self.rates(t, x, v)[1]

    def accelerations(self, t: float, x: Array, v: Array) -> tuple[Array, Array]:
        """Solve M a - Gᵀ lam = f, G a = g_2 for a, (n_v,), and lam, (n_lam,); of minimum norm for redundant rows.

        Raises
        ------
        ModelError
            If the matrix is singular, due to a mode without mass or a singular position.
        """
        M, f = self.mass(x), self.force(t, x, v)
        G, right = self.jacobian(t, x), self.acceleration_right(t, x, v)
        top, n = np.hstack([M, -G.T]), self.n_v
        matrix = np.vstack([top, np.hstack([G, np.zeros((self.n_lam, self.n_lam))])])
        rows = np.concatenate([f, right])
        try:
            if self.system.redundant == "minimum-norm":
                solution = la.lstsq(matrix, rows)[0]
            else:
                solution = np.linalg.solve(matrix, rows)
        except np.linalg.LinAlgError as error:
            raise ModelError(
                f"system {self.system.name!r}: accelerations do not follow from the state: a mode has no mass, or the "
                "constraints depend on each other here"
            ) from error
        return solution[:n], solution[n:]

    def ordinary(self, t: float, y: Array) -> Array:
        """Return y_dot for y = (x, v), (n_x + n_v,), the underlying ordinary differential equation (index 1).

        For `scipy.integrate.solve_ivp`; constraints drift within its tolerances (`project` corrects them).
        """
        x, v = y[: self.n_x], y[self.n_x :]
        a, _ = self.accelerations(t, self.configurations.normalized(x), v)
        return np.concatenate([self.configurations.rate(x, v), a])

    def null_space(self, t: float, x: Array) -> Array:
        """Return an M-orthonormal basis N of the motions that the constraints allow, (n_v, n_free).

        G N = 0, Nᵀ M N = 1: v = N z + (a velocity that satisfies G v = g_1), and z_dot = Nᵀ (f - M N_dot z - ...).
        """
        L = np.linalg.cholesky(self.mass(x))
        scaled = la.solve_triangular(L, self.jacobian(t, x).T, lower=True).T
        size = np.linalg.norm(scaled, axis=1)
        free = la.null_space(scaled[size > 0] / size[size > 0, None]) if self.n_lam else np.eye(self.n_v)
        return np.asarray(la.solve_triangular(L.T, free))

    def energy(self, x: Array, v: Array) -> float:
        """Return the kinetic energy vᵀ M v / 2 [J]."""
        return float(0.5 * v @ self.mass(x) @ v)

    def wrenches(self, t: float, x: Array, v: Array, lam: Array) -> Array:
        """Return the wrenches w = w_0 + W lam, (n_w,), on markers A in ground axes, as in results.

        Raises
        ------
        ModelError
            If the reaction of a joint is not the transpose of its constraint; this occurs for some joints with open
            constraints.
        """
        parts, lam = self.rows_at(t, x, v), vector("lam", lam, self.n_lam)
        w, at = self.law(parts), self.structure
        for c in range(len(self.model.connections.size)):
            own, first, last = self.own_rows(c), int(at.lam0[c]), int(at.lam0[c + 1])
            if first == last:
                continue
            rows = at.holds[own]
            G, J = parts.of_connection(c)
            C = parts.V[c][~rows]
            left = np.vstack([J.T, C])
            right = np.concatenate([G[rows].T @ lam[first:last], np.zeros(len(C))])
            part = la.lstsq(left, right)[0]
            if np.abs(left @ part - right).max() > AGREES * np.abs(right).max():
                raise ModelError(
                    f"open_equations: {self.compiled.connection_names[c]!r}: its wrench does not follow from "
                    "multipliers at this x; wrenches are defined where the constraints are closed (see `project`)"
                )
            w[own] += part
        return w

    def tangents(self, t: float, x: Array, v: Array, a: Array, lam: Array) -> Tangents:
        """Return the derivatives of the residual by x, v and a at fixed multipliers.

        The derivatives by v and a, and by x at fixed wrenches, are those of Newton's method in the kernels. The
        derivatives of the wrenches w_0 and the forces Gᵀ lam by x are central differences of fourth order (relative
        error about 1e-10 of these forces).
        """
        v, a = vector("v", v, self.n_v), vector("a", a, self.n_v)
        _, own = self.at(t, x, v, a)  # leaves w_0 in the working arrays
        by_x = linearized(self.model, self.work, 0.0, 0.0, 1.0)
        by_v, rows_by_v = by_velocities(self.model, self.work, by_x)
        turn, holds = self.turning(x), self.structure.holds
        K, C = la.block_diag(*by_x.H), la.block_diag(*by_v)
        J = by_x.J.toarray()
        if (~holds).any():  # dw_0 = -C⁺ G_v dv
            G_v = rows_by_v.toarray()[~holds]
            C = C + J.T @ np.linalg.pinv(by_x.V.toarray()[~holds]) @ G_v
        K = turn @ K @ turn.T + self.turned_forces(own)
        if len(self.work.state.w):
            by_w, by_lam = self.change_of_wrenches(t, x, v, vector("lam", lam, self.n_lam))
            K = K - turn @ (J.T @ by_w) - by_lam
        return Tangents(K, turn @ C @ turn.T, self.mass(x))

    # parts

    def change_of_wrenches(self, t: float, x: Array, v: Array, lam: Array) -> tuple[Array, Array]:
        """Return the derivatives by x of w_0, (n_w, n_v), and Gᵀ lam, (n_v, n_v), from fourth-order differences."""
        scale = np.ones(self.n_v)
        for _, j, n in self.configurations.parts():
            scale[j : j + 3] = self.compiled.length
            scale[j + 6 : j + 6 + n] = self.modal_scale

        def forces(dx: Array) -> Array:
            parts = self.rows_at(t, self.configurations.retract(x, dx), v)
            return np.concatenate([self.law(parts), parts.held_force(lam)])

        columns = []
        for k in range(self.n_v):
            dx = np.zeros(self.n_v)
            dx[k] = STEP * scale[k]
            near, far = forces(dx) - forces(-dx), forces(2 * dx) - forces(-2 * dx)
            columns.append((8 * near - far) / (12 * dx[k]))
        both = np.array(columns).T
        n_w = len(self.work.state.w)
        return both[:n_w], both[n_w:]

    @cached_property
    def modal_scale(self) -> float:
        """Amplitude of a modal coordinate that moves markers by about 0.1 % of the system size."""
        largest = float(np.abs(self.model.markers.psi).max(initial=0.0))
        return 1e-2 * self.compiled.length / largest if largest > 0 else 1.0

    def turned_forces(self, own: Array) -> Array:
        """Return the derivative, due to the rotation of body axes, of a residual in ground axes, (n_v, n_v)."""
        result = np.zeros((self.n_v, self.n_v))
        for i, (_, j, _) in enumerate(self.configurations.parts()):
            R = self.work.state.R[i]
            result[j : j + 3, j + 3 : j + 6] = -R @ tilde(R.T @ own[j : j + 3])
        return result

    def turning(self, x: Array) -> Array:
        """Return the matrix that rotates translations from body axes to ground axes, (n_v, n_v)."""
        result = np.eye(self.n_v)
        for j, k, _ in self.configurations.parts():
            result[k : k + 3, k : k + 3] = rotation_matrix(x[j + 3 : j + 7])
        return result

    def own_rows(self, c: int) -> slice:
        """Return the rows of connection c."""
        return slice(int(self.model.connections.w0[c]), int(self.model.connections.w0[c + 1]))

    def rows_at(self, t: float, x: Array, v: Array | None = None, a: Array | None = None) -> RowParts:
        """Return the rows at a state with zero wrenches; the body residual stays in the working arrays."""
        from floatframe.engine.kernels.entry import evaluate_and_linearize

        set_iterate(self.work, self.engine_state(x, v), a, self.near.copy())
        self.work.state.time[...] = t
        evaluate_and_linearize(self.model, self.work, 1.0, 0.0, 0.0)
        raise_errors_of(self.compiled.callbacks)
        return row_parts(self.structure, self.model, self.work)

    def at(self, t: float, x: Array, v: Array, a: Array | None = None) -> tuple[RowParts, Array]:
        """Return the rows at a state, and M a - f in ground axes, (n_v,).

        Raises
        ------
        ModelError
            If a force is not an affine function of the wrench of its connection.
        """
        from floatframe.engine.kernels.entry import rates_of_constraints

        parts = self.rows_at(t, x, v, a)
        w = self.law(parts)
        if (w != self.work.state.w).any():
            self.work.state.w[:] = w
            rates_of_constraints(self.model, self.work)  # evaluates the rates
            left = np.where(self.structure.holds, 0.0, self.work.connections.g)
            allowed = AGREES * max(np.abs(w).max(initial=0.0), np.abs(parts.g).max(initial=0.0))
            if np.abs(left).max(initial=0.0) > allowed:
                c = int(np.searchsorted(self.model.connections.w0, int(np.abs(left).argmax()), side="right")) - 1
                raise ModelError(
                    f"open_equations: {self.compiled.connection_names[c]!r}: its force depends on itself, not only on "
                    "the motion; remove it"
                )
        result = self.work.bodies.residual.copy()
        for i, (_, j, _) in enumerate(self.configurations.parts()):
            result[j : j + 3] = self.work.state.R[i] @ result[j : j + 3]
        return parts, result

    def law(self, parts: RowParts) -> Array:
        """Return w_0, (n_w,): the minimum-norm wrenches that satisfy the rows which define them."""
        w = self.near.copy()
        for c, V in enumerate(parts.V):
            own = self.own_rows(c)
            rows = ~self.structure.holds[own]
            if rows.any() and parts.g[own][rows].any():
                w[own] -= la.lstsq(V[rows], parts.g[own][rows])[0]
        return w

    def rates(self, t: float, x: Array, v: Array) -> tuple[Array, Array]:
        """Return the rate and the second rate at a = 0 of the constraint rows, each (n_lam,)."""
        from floatframe.engine.kernels.entry import rates_of_constraints

        set_iterate(self.work, self.engine_state(x, v), w=self.near.copy())
        self.work.state.time[...] = t
        rate, bias = rates_of_constraints(self.model, self.work)
        return rate[self.structure.held], bias[self.structure.held]


def open_equations(system: System) -> Equations:
    """Return the open equations of a system as Python functions: M a = f + Gᵀ lam with its constraints.

    Parameters
    ----------
    system
        The system. Each call allocates its own working arrays, so two threads need two `Equations`.

    Raises
    ------
    ModelError
        If a force has its own states, an element uses accelerations, or friction depends on the joint force: these are
        not functions of t, x and v.
    """
    compiled = compiled_system(system)
    model = compiled.model
    if len(model.states.row):
        users = np.searchsorted(model.connections.w0, model.states.row, side="right") - 1
        raise ModelError(
            f"open_equations: {compiled.connection_names[int(users[0])]!r} has states of its own, which are not part "
            "of x and v; give its forces without states, and integrate the states separately"
        )
    felt = [each.element.name for each in compiled.laws if each.law.accelerations]
    if felt:
        raise ModelError(
            f"open_equations: element {felt[0]!r} uses accelerations, which are not part of x and v; give its "
            "masses as bodies"
        )
    if has_normal_friction(model):
        raise ModelError(
            "open_equations: friction by the force in its joint (JointForce: coefficient) makes f depend on the "
            "multipliers; remove it, or give a friction force that does not depend on them"
        )
    model = model._replace(rows=model.rows._replace(soft=np.zeros_like(model.rows.soft)))
    structure = structure_of(model)
    return Equations(
        system, compiled, model, new_work(model), structure, Configurations(np.array(model.bodies.n_q)),
        layout_of(compiled, [int(row) for row in structure.held], system.units), start_unknowns(model),
    )  # fmt: skip


def vector(name: str, value: Array, n: int) -> Array:
    """Return a value as a vector of n finite numbers; `ModelError` if that is impossible."""
    result = np.asarray(value, dtype=float)
    if result.shape != (n,) or not np.isfinite(result).all():
        told = f"shape {result.shape}" if result.shape != (n,) else "numbers that are not finite"
        raise ModelError(f"open_equations: {name}: expected {n} finite numbers, got {told}")
    return result
