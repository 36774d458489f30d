"""The generalized-alpha method in relative coordinates: joints and modes; only closed loops need constraints.

Evaluated in `floatframe.engine.tree.kernels.steps`.
"""

import weakref
from dataclasses import asdict, dataclass

import numpy as np
from numpy.typing import NDArray

from fe_models.foundation.arrays import Array
from fe_models.foundation.records import checked_fields
from floatframe.engine.compiling.system import CompiledSystem, compiled_system
from floatframe.engine.initial_conditions.initial import work_from
from floatframe.engine.initial_conditions.newton_equations import displaced, set_iterate
from floatframe.engine.initial_conditions.step_filter import Beginning, Spin
from floatframe.engine.kernels.entry import Outcome
from floatframe.engine.kernels.memory import Memory, Rows
from floatframe.engine.kernels.model import Model
from floatframe.engine.kernels.work import Work
from floatframe.engine.tree.formulation import is_relative
from floatframe.engine.tree.kernels.tree import JointWork, TangentWork, Tree, new_joint_work, new_tangent_work
from floatframe.engine.tree.topology import tree_of
from floatframe.engine.tree.tree_motions import joint_iterate
from floatframe.errors import ModelError
from floatframe.integrators.generalized_alpha import LONGER, GeneralizedAlpha, rows_closed_by_positions, words_of_turn
from floatframe.integrators.integrator import Failure, Integrator, started_anew
from floatframe.integrators.relative_ode import RelativeOde
from floatframe.model.rotations import rotation_exp
from floatframe.model.state import State
from floatframe.model.system import System

__all__ = ["RelativeGeneralizedAlpha", "in_formulation"]

NEAR_BY = 1e-3  #: difference step for rates of accelerations, as a fraction of the time step


@dataclass(frozen=True)
@checked_fields(ModelError)
class RelativeGeneralizedAlpha(Integrator):
    """Generalized-alpha in coordinates of joints and modes (docs/relative.md §6), otherwise as `GeneralizedAlpha`.

    (1) predict: a_new = a for every unknown s = (z, q)
    (2) Newton's method for  rho(s, s_dot, s_ddot, w) = 0, g = 0  in the increment x of the step, where rho is the
        residual projected along the coordinates, g the equations of loops, couplers and force elements, and
        x = h s_dot + h² ((1/2 - beta) a + beta a_new),  Q exp(x) for rotations
        s_dot_new = s_dot + h ((1 - gamma) a + gamma a_new)
    (3) (1 - alpha_m) a_new + alpha_m a = (1 - alpha_f) s_ddot_new + alpha_f s_ddot

    Trees have no constraints: positions, velocities and accelerations fulfil the joints to roundoff. Loops are closed
    by the index-3 constraints of their cut joints, which begin like those of `GeneralizedAlpha`. The step is controlled
    by the error of the unknowns, measured by the motion of the bodies that it causes, as in `GeneralizedAlpha`.

    Parameters
    ----------
    rho_inf
        Spectral radius at infinite frequency, 0 <= rho_inf <= 1.
    tolerance
        Largest last correction relative to the displacement due to the accelerations of the step.
    max_iterations
        Largest number of Newton iterations in a step.
    error_tolerance
        Largest local error of a body in a step, as in `GeneralizedAlpha`.
    h_min
        Smallest size to which a step may be divided after failure [s]; None as in `GeneralizedAlpha`.
    parameters
        alpha_m, alpha_f, beta, gamma instead of those from rho_inf.
    stabilized
        Enforce velocities of joints that close loops as well as positions.
    """

    rho_inf: float = 0.8
    tolerance: float = 1e-8
    max_iterations: int = 25
    error_tolerance: float | None = None
    h_min: float | None = None
    parameters: tuple[float, float, float, float] | None = None
    stabilized: bool = True

    def __post_init__(self) -> None:
        object.__setattr__(self, "parameters", self.absolute.parameters)

    @property
    def absolute(self) -> GeneralizedAlpha:
        """The same method in absolute coordinates."""
        return GeneralizedAlpha(**asdict(self))

    def after_jump(self, system: System, t: float, memory: Memory, work: Work) -> tuple[Memory, Rows]:
        """Return the memory after forces have jumped at t, and the results there; as `GeneralizedAlpha`."""
        if memory.h == 0.0:
            return started_anew(self, system, t, memory, work)
        compiled, tree = compiled_system(system), tree_of(system).tree
        exact, change = self.absolute.jump(compiled, memory, t, may_spin(tree))
        after, rows = self.observe(system, t, exact, work)
        a, u_dot = memory.a.copy(), memory.u_dot + change
        for sign, each in ((1.0, u_dot), (-1.0, memory.u_dot)):
            _, joints = joint_iterate(compiled, tree, memory.state, each)
            a += sign * in_slots(tree, each, joints.acceleration)
        return after.changed(u_dot=u_dot, a=a), rows

    def observe(self, system: System, t: float, memory: Memory, work: Work) -> tuple[Memory, Rows]:
        """Return the memory with the power at its state, and the results there."""
        from floatframe.engine.tree.kernels.entry import NO_TANGENT, joint_kernels

        model, tree = compiled_system(system).model, tree_of(system).tree
        after, joints = memory.copied(), new_joint_work(model, tree)
        rows = joint_kernels.observe(model, work, tree, joints, NO_TANGENT, memory=after, t=t)
        return memory.changed(power=after.power), rows  # the reactions in `after` serve this row of results alone

    def advance(
        self, system: System, memory: Memory, work: Work, *, t0: float, h: float, first: int, n_steps: int, every: int
    ) -> tuple[Memory, Rows, int, Failure | None]:
        """Advance by n_steps of size h, beginning with step `first` counted from t0; see `integrator.Integrator`."""
        from floatframe.engine.tree.kernels.entry import joint_kernels

        compiled, tree = compiled_system(system), tree_of(system).tree
        model, kept = compiled.model, kept_of(work, compiled.model, tree)
        begun = self.prepared(system, memory, h, t0 + first * h)
        goes_on = kept.after is memory and begun.u_dot is memory.u_dot  # longer steps begin with other accelerations
        if not goes_on or work.solver.c_k == 0.0:  # a run that is resumed from a file begins in the same way
            kept.joints.is_known[...] = 0
            kept.tangent.n_known[...] = 0
        after = begun.copied()
        rows, outcome = joint_kernels.advance(
            model, work, tree, kept.joints, kept.tangent, memory=after,
            t0=t0, h=h, first=first, n_steps=n_steps, every=every, **self.absolute.numbers(compiled, h),
        )  # fmt: skip
        kept.after = after
        return after, rows, outcome.n_steps, self.explain(system, work, outcome, after.u, h)

    def prepared(self, system: System, memory: Memory, h: float, t: float) -> Memory:
        """Return the memory with algorithmic accelerations of the unknowns for steps of size h that begin at t.

        At the start, and where longer steps follow, they are found as in `initial_conditions.step_filter`, in the
        coordinates of the joints.
        """
        compiled, method = compiled_system(system), self.absolute
        is_divided = method.least_step(h, compiled) > 0.0
        if memory.h != 0.0 and (is_divided or h <= LONGER * memory.h):
            return memory.changed(h_next=min(float(memory.h_next) or h, h) if is_divided else h)
        tree = tree_of(system).tree
        spin = method.spin_at(compiled, memory, may_spin(tree))
        if memory.h == 0.0:
            h = method.first_step(compiled, memory, h, t, spin)
        alpha_m, alpha_f, beta, _ = method.coefficients
        begun = method.filtered(compiled, memory, h, t, full=False, spin=spin)
        a, rates = joint_accelerations(compiled, tree, memory, begun, h, spin)
        a, u_dot = a + (alpha_m - alpha_f) * h * rates, begun.u_dot
        rows = rows_closed_by_positions(compiled.model, self.stabilized)[tree.kept_row >= 0]
        if rows.any():
            begun = method.filtered(compiled, memory, h, t, full=True, spin=None)
            now, rates = joint_accelerations(compiled, tree, memory, begun, h, None)
            way = 0.5 * now + ((alpha_m - alpha_f) / 2 + beta) * h * rates
            memory = shifted(system, memory, way, h, method.coefficients, t, rows)
        return memory.changed(u_dot=u_dot, a=a, h=h, h_next=h)

    def explain(self, system: System, work: Work, outcome: Outcome, u: Array, h: float) -> Failure | None:
        """Return the reason why a step of size h failed that began with velocities u, (n_u,); None if none failed."""
        from floatframe.engine.kernels.generalized_alpha import SINGULAR, TURNED

        if outcome[0] == 0:
            return None
        if outcome[0] == TURNED:
            return Failure(f"{words_of_turn(compiled_system(system), work, outcome[3])}, or EnergyMomentum", outcome[4])
        if outcome[0] != SINGULAR or int(work.counted.no_number):
            return self.absolute.explain(system, work, outcome, u, h)
        parts = tree_of(system)
        held = [*parts.cut, *parts.constrained]
        words = "the Newton matrix in relative coordinates is singular here: "
        if held:
            words += (
                f"constraints of joints {', '.join(repr(name) for name in held)} depend on each other (a singular "
                "position, or redundant ones)"
            )
        else:
            words += "a coordinate moves no mass: check masses, inertias and massless modes"
        return Failure(words, outcome[4])


def in_formulation(integrator: Integrator, formulation: str | None) -> Integrator:
    """Return the method in the formulation "absolute" or "relative"; None leaves it unchanged.

    Raises
    ------
    ModelError
        If there is no such formulation, or the method works only in absolute coordinates.
    """
    if formulation is None:
        return integrator
    if not is_relative(formulation):
        return integrator.absolute if isinstance(integrator, RelativeGeneralizedAlpha) else integrator
    if isinstance(integrator, RelativeGeneralizedAlpha | RelativeOde):
        return integrator
    if not isinstance(integrator, GeneralizedAlpha):
        raise ModelError(
            f"formulation: {type(integrator).__name__} works in absolute coordinates alone; choose GeneralizedAlpha "
            '(or hht, newmark, trapezoidal), or formulation = "absolute"'
        )
    return RelativeGeneralizedAlpha(**asdict(integrator))


@dataclass(eq=False)
class Kept:
    """Data that belong to working arrays, and the memory at the end of the last steps computed with them."""

    joints: JointWork
    tangent: TangentWork
    after: Memory | None = None


#: data by the id of an array of the working arrays; an entry is removed when that array is freed
KEPT: dict[int, Kept] = {}


def kept_of(work: Work, model: Model, tree: Tree) -> Kept:
    """Return the data that belong to working arrays: factors of the Newton matrix in relative coordinates."""
    key = id(work.solver.pivot)
    if key not in KEPT:
        KEPT[key] = Kept(new_joint_work(model, tree), new_tangent_work(model, tree))
        weakref.finalize(work.solver.pivot, KEPT.pop, key, None)
        work.solver.is_due[...] = 1
    return KEPT[key]


def in_slots(tree: Tree, of_bodies: Array, of_columns: Array) -> Array:
    """Return values of all unknowns at their positions in the memory, (n_u,), with zeros elsewhere."""
    result = np.zeros_like(of_bodies)
    is_mode = tree.mode >= 0
    result[tree.slot[is_mode]] = of_bodies[tree.slot[is_mode]]
    result[tree.slot[~is_mode]] = of_columns[tree.column[~is_mode]]
    return result


def may_spin(tree: Tree) -> NDArray[np.bool_]:
    """Return the bodies whose spin may be integrated separately in joint coordinates, (n_b,)."""
    return np.any(tree.spin_axis != 0.0, axis=1)


def joint_accelerations(
    compiled: CompiledSystem, tree: Tree, memory: Memory, begun: Beginning, h: float, spin: Spin | None
) -> tuple[Array, Array]:
    """Return the initial s_ddot and its rate at the positions of the unknowns in the memory, (n_u,).

    spin: bodies whose spin is integrated separately. Their rates are those of s_ddot without the rotation of their
    axes, in axes that do not spin.
    """
    state, u_dot, s = memory.state, begun.u_dot, NEAR_BY * h
    jerk = begun.rates if spin is None else begun.rates - spin.further
    spinning = [] if spin is None else np.flatnonzero(spin.bodies).tolist()
    start, by_spin = {}, {}

    def at(t: float) -> Array:
        place = displaced(compiled.model, state, t * state.u + 0.5 * t**2 * u_dot + t**3 / 6 * jerk)
        moved = State(place.r, place.p, place.q, state.u + t * u_dot + 0.5 * t**2 * jerk)
        _, joints = joint_iterate(compiled, tree, moved, u_dot + t * jerk)
        for i in spinning:
            first, e = tree.column0[i + 1] - 3, tree.spin_axis[i]
            columns = slice(first, first + 3)
            to_body = -joints.Q[i] if tree.is_reversed[i] else np.eye(3)
            omega, alpha = to_body @ joints.rate[columns], to_body @ joints.acceleration[columns]
            if t == 0.0:
                start[i], by_spin[i] = to_body, e @ omega
            else:
                rest = alpha - (e @ omega) * np.cross(omega, e)
                joints.acceleration[columns] = start[i].T @ rotation_exp(by_spin[i] * t * e) @ rest
        return in_slots(tree, u_dot + t * jerk, joints.acceleration)

    now = at(0.0)
    return now, (at(s) - at(-s)) / (2 * s)


def shifted(
    system: System,
    memory: Memory,
    way: Array,
    h: float,
    coefficients: tuple[float, float, float, float],
    t: float,
    rows: NDArray[np.bool_],
) -> Memory:
    """Return the memory with velocities changed by O(h²), so that the first step closes some of the kept rows.

    Solves G ds = -g(after)/h with the matrix of a step, M + gamma h D + beta h² K, as in (3) of
    `initial_conditions.step_filter`.
    """
    from floatframe.engine.tree.kernels.entry import motion_of_bodies, moved, newton_matrix, projected

    compiled, tree = compiled_system(system), tree_of(system).tree
    model = compiled.model
    kept = tree.kept_row >= 0
    state, (_, _, beta, gamma) = memory.state, coefficients
    work, joints = joint_iterate(compiled, tree, state, memory.u_dot)
    work.states.base[:] = work_from(model, memory.w).states.base
    joints.d_start[:], joints.Q_start[:] = joints.d, joints.Q
    rate, is_column = joints.rate.copy(), tree.column >= 0
    s_dot = in_slots(tree, state.u, rate)[tree.slot]
    x = h * s_dot + h**2 * way[tree.slot]
    increments = np.zeros_like(rate)
    increments[tree.column[is_column]] = x[is_column]
    for k in np.flatnonzero(tree.motion >= 0):
        motion = tree_of(system).motions[k]
        assert motion is not None
        increments[k] = tree.factor[k] * (motion(t + h) - motion(t))
    work.state.q[tree.mode[~is_column]] += x[~is_column]
    work.state.time[...] = t + h
    work.state.w[:] = memory.w
    work.state.w[model.coordinates.row] += h * memory.w[model.coordinates.row + 1]
    moved(model, work, tree, joints, increments)
    projected(model, work, tree, joints, beta * h**2)
    gap = np.where(rows, work.connections.g[kept], 0.0)
    set_iterate(work, state, None, memory.w)
    work.state.time[...] = t
    joints.x[:] = 0.0
    joints.d[:], joints.Q[:], joints.acceleration[:] = joints.d_start, joints.Q_start, 0.0
    n_s = len(tree.slot)
    K = newton_matrix(model, work, tree, joints, 1.0, gamma * h, beta * h**2)
    change = np.linalg.lstsq(K, np.concatenate([np.zeros(n_s), -gap / h]), rcond=1e-12)[0][:n_s]
    joints.rate[tree.column[is_column]] += change[is_column]
    work.state.u[tree.slot[~is_column]] += change[~is_column]
    motion_of_bodies(model, work, tree, joints)
    return memory.changed(u=work.state.u)
