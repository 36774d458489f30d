"""User forces over a step, see `floatframe.engine.structure_preserving.user_forces` for the formulas."""

from floatframe.engine.kernels.compiler.compilation import inner
from floatframe.engine.kernels.connections.user_force import element_of, user_outputs
from floatframe.engine.structure_preserving.kernels.coordinates import (
    add_impulsive_force,
    coordinate_change,
    coordinate_ends,
    coordinate_rate,
    counted,
    ends_of_step,
)

__all__ = ["user_force_load", "user_state_residual"]


@inner
def put_states(model, work, step, c, first, part):
    """Write the states of user force c after a part of their change over the step into the inputs."""
    u = model.connections.item[c]
    change0 = step.load.shape[0] + step.f.shape[0] + model.users.state0[u]
    for s in range(model.users.n_states[u]):
        k = model.states.row[model.users.state0[u] + s]
        work.users.inputs[first + s] = step.known[k] + part * step.z[change0 + s]


@inner
def user_force_load(model, work, discrete, step, c):
    """Add the loads of user force c; return the work they give."""
    i = element_of(model, c)
    first, last = model.elements.coordinate0[i], model.elements.coordinate0[i + 1]
    n, inputs = last - first, work.users.inputs
    inputs[0] = step.t_force
    for p in range(first, last):
        k, a, b = model.coordinates.row[p], model.coordinates.a[p], model.coordinates.b[p]
        change = coordinate_change(model, discrete, step, k, a, b)
        begin, end = coordinate_ends(model, step, k, a, b, change)
        inputs[1 + p - first] = counted(model, k, end, step.known[k]) - 0.5 * (end - begin)
        inputs[1 + n + p - first] = coordinate_rate(model, discrete, step, k, a, b)
    put_states(model, work, step, c, 1 + 2 * n, 0.0 if step.is_still else 0.5)
    user_outputs(model, work, c)
    given = 0.0
    for p in range(first, last):
        if model.coordinates.force[p] >= 0:
            Q = work.users.outputs[model.coordinates.core[p] - model.elements.core[i]]
            k, a, b = model.coordinates.row[p], model.coordinates.a[p], model.coordinates.b[p]
            add_impulsive_force(model, discrete, step, k, a, b, Q)
            given += Q * inputs[1 + n + p - first] * step.h
    return given


@inner
def user_state_residual(model, work, discrete, step, c):
    """Write the equations of the states of user force c for their changes: dz - h g in the middle of the step."""
    i, u = element_of(model, c), model.connections.item[c]
    first, last = model.elements.coordinate0[i], model.elements.coordinate0[i + 1]
    n, inputs = last - first, work.users.inputs
    inputs[0] = 0.5 * (step.t_0 + step.t_1)
    for p in range(first, last):
        k, a, b = model.coordinates.row[p], model.coordinates.a[p], model.coordinates.b[p]
        begin, end = ends_of_step(model, step, k, a, b)
        inputs[1 + p - first] = 0.5 * (begin + end)
        rate = (end - begin) / step.h
        if model.rows.is_angle[k] and not step.is_still:
            rate = coordinate_rate(model, discrete, step, k, a, b)
        inputs[1 + n + p - first] = rate
    put_states(model, work, step, c, 1 + 2 * n, 0.5)
    user_outputs(model, work, c)
    change0 = step.load.shape[0] + step.f.shape[0] + model.users.state0[u]
    for s in range(model.users.n_states[u]):
        rate = work.users.outputs[model.users.n_forces[u] + s]
        step.residual[change0 + s] = step.z[change0 + s] - step.h * rate
