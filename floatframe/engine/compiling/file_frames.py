"""Conversion of states, results and small motions between body frames of the engine and body frames of the files.

Kernels, start, integrators and analyses work in the frames of the engine, where stiffened bodies move in mean axes
(`floatframe.model.bodies.mean_axes`). States, results and shapes that a user gives and gets refer to the frames of the
files.
"""

from typing import Literal

import numpy as np

from fe_models.foundation.arrays import Array
from floatframe.engine.compiling.system import CompiledSystem
from floatframe.engine.kernels.memory import Rows
from floatframe.model.bodies.mean_axes import FrameMotion, MeanAxes
from floatframe.model.state import State

__all__ = [
    "motion_of_engine", "motion_of_file", "rows_of_file", "small_motions_of_file", "state_of_engine", "state_of_file",
]  # fmt: skip

Way = Literal["to_file", "to_mean"]


def state_of_file(compiled: CompiledSystem, state: State) -> State:
    """Return a state of the engine converted to the body frames of the files."""
    return motion_of_file(compiled, state, np.zeros_like(state.u))[0]


def state_of_engine(compiled: CompiledSystem, state: State) -> State:
    """Return a state given in the body frames of the files, converted to those of the engine."""
    return motion_of_engine(compiled, state, np.zeros_like(state.u))[0]


def motion_of_file(compiled: CompiledSystem, state: State, u_dot: Array) -> tuple[State, Array]:
    """Return a state and accelerations (n_u,) of the engine converted to the body frames of the files."""
    return changed_state(compiled, state, u_dot, "to_file")


def motion_of_engine(compiled: CompiledSystem, state: State, u_dot: Array) -> tuple[State, Array]:
    """Return a state and accelerations (n_u,) in the body frames of the files, converted to those of the engine."""
    return changed_state(compiled, state, u_dot, "to_mean")


def rows_of_file(compiled: CompiledSystem, rows: Rows) -> Rows:
    """Return result rows of the engine converted to the body frames of the files."""
    if not any(compiled.mean_axes):
        return rows
    r, p, q, u, u_dot = changed(compiled, (rows.r, rows.p, rows.q, rows.u, rows.u_dot), "to_file")
    return rows._replace(r=r, p=p, q=q, u=u, u_dot=u_dot)


def small_motions_of_file(compiled: CompiledSystem, q: Array) -> tuple[Array, ...]:
    """Return for each body the matrix from small motions in the engine to those in the file frame, at q, (n_q,)."""
    bodies = compiled.model.bodies
    return tuple(
        np.eye(6 + int(bodies.n_q[i])) if axes is None else axes.small_motions(q[bodies.q0[i] : bodies.q0[i + 1]])
        for i, axes in enumerate(compiled.mean_axes)
    )


def changed_state(compiled: CompiledSystem, state: State, u_dot: Array, way: Way) -> tuple[State, Array]:
    """Return a state and accelerations converted to the other set of body frames."""
    if not any(compiled.mean_axes):
        return state, u_dot
    r, p, q, u, u_dot = changed(compiled, (state.r, state.p, state.q, state.u, u_dot), way)
    return State(r, p, q, u), u_dot


def changed(compiled: CompiledSystem, arrays: tuple[Array, ...], way: Way) -> tuple[Array, ...]:
    """Return r (..., n_b, 3), p (..., n_b, 4), q (..., n_q), u and u_dot (..., n_u) in the other set of body frames."""
    r, p, q, u, u_dot = (np.array(array) for array in arrays)
    alike: dict[MeanAxes, list[int]] = {}  # bodies with the same modal file are converted together
    for i, axes in enumerate(compiled.mean_axes):
        if axes is not None:
            alike.setdefault(axes, []).append(i)
    with np.errstate(over="ignore", invalid="ignore"):  # a motion that diverges contains NaN
        for axes, own in alike.items():
            modes = np.arange(axes.reduced.n_q)
            u0, own_q = compiled.model.bodies.u0[own, None], compiled.model.bodies.q0[own, None] + modes
            v, omega, rates = u0 + np.arange(3), u0 + np.arange(3, 6), u0 + 6 + modes
            motion = FrameMotion(
                r[..., own, :], p[..., own, :], q[..., own_q], u[..., v], u[..., omega], u[..., rates],
                u_dot[..., v], u_dot[..., omega], u_dot[..., rates],
            )  # fmt: skip
            new = axes.to_file(motion) if way == "to_file" else axes.to_mean(motion)
            r[..., own, :], p[..., own, :], q[..., own_q] = new.r, new.p, new.q
            u[..., v], u[..., omega], u[..., rates] = new.v, new.omega, new.q_dot
            u_dot[..., v], u_dot[..., omega], u_dot[..., rates] = new.v_dot, new.omega_dot, new.q_ddot
    return r, p, q, u, u_dot
