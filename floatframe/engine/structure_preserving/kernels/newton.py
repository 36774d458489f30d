"""Newton's method for one step, with factors that are reused in many steps.

Unknowns are the increments x = (d, theta, dq) of the bodies and mu = h²/2 f, with f the multipliers of the joints; the
equations of motion are multiplied by h/2, so that the matrix stays well-conditioned as h falls. Unknowns and residuals
of a body are in its axes at the beginning of the step, so that the matrix does not rotate with the body.
Derivatives are differences of residuals. One evaluation serves for several unknowns if they affect no common row.
"""

import math

from floatframe.engine.kernels.compiler.compilation import inner, matrix_loops
from floatframe.engine.kernels.generalized_alpha import DIVERGED, DONE, SINGULAR, roundoff_floor, total_mass
from floatframe.engine.kernels.model import BUSHING, CONTACT, ELEMENT, JOINT, SPRING, USER_FORCE
from floatframe.engine.kernels.vector import copy, cross, matrix, norm, put_sum, scaled, sub, turned_back, vector
from floatframe.engine.structure_preserving.kernels.bodies import body_inertia, body_step
from floatframe.engine.structure_preserving.kernels.connections.contacts import contact_load
from floatframe.engine.structure_preserving.kernels.connections.forces import (
    bushing_load,
    user_force_load,
    user_state_residual,
)
from floatframe.engine.structure_preserving.kernels.connections.public_elements import element_load, element_residual
from floatframe.engine.structure_preserving.kernels.deformed_lines import line_steps
from floatframe.engine.structure_preserving.kernels.held_rows import add_reaction, row_change, row_rate, row_value
from floatframe.engine.structure_preserving.kernels.loads import (
    body_load,
    coordinate_load,
    normal_force,
    point_load,
    spring_load,
)
from floatframe.engine.structure_preserving.kernels.markers import marker_loads, marker_step
from floatframe.engine.structure_preserving.kernels.records import SMALL

__all__ = [
    "add_loads",
    "band_factor",
    "band_solve",
    "move",
    "solve",
]


# band -----------------------------------------------------------------------------------------------------------------
# LU factors of a band matrix with row exchanges, stored by rows: A[i, below + j - i] is the entry (i, j).
#
# Each row has space for `below` more entries after the `above` entries of the band, which row exchanges fill.


@matrix_loops
def band_factor(A, pivot, below, above):
    """Overwrite A with its band LU factors; return False if a pivot is zero or not finite."""
    n, reach = A.shape[0], below + above
    for k in range(n):
        last, end = min(n - 1, k + below), min(n, k + reach + 1)
        best, row = -1.0, k
        for i in range(k, last + 1):
            size = abs(A[i, below + k - i])
            if size > best:
                best, row = size, i
        pivot[k] = row
        if not (best > 0.0 and best < 1e300):
            return False
        if row != k:
            for j in range(k, end):
                x = A[k, below + j - k]
                A[k, below + j - k] = A[row, below + j - row]
                A[row, below + j - row] = x
        inverse = 1.0 / A[k, below]
        top = A[k]
        for i in range(k + 1, last + 1):
            own, shift = A[i], k - i
            factor = own[below + shift] * inverse
            own[below + shift] = factor
            if factor != 0.0:
                for j in range(below + 1, below + end - k):
                    own[j + shift] -= factor * top[j]
    return True


@matrix_loops
def band_solve(A, pivot, below, above, b):
    """Overwrite b with A⁻¹ b."""
    n, reach = A.shape[0], below + above
    for k in range(n):
        row = pivot[k]
        if row != k:
            x = b[k]
            b[k] = b[row]
            b[row] = x
        x = b[k]
        if x != 0.0:
            for i in range(k + 1, min(n, k + below + 1)):
                b[i] -= A[i, below + k - i] * x
    for i in range(n - 1, -1, -1):
        total, own = b[i], A[i]
        for j in range(1, min(n - i, reach + 1)):
            total -= own[below + j] * b[i + j]
        b[i] = total / own[below]


# newton ---------------------------------------------------------------------------------------------------------------


SLOW = 0.25  # ratio of successive corrections above which the derivatives are renewed
MANY = 7  # number of iterations of a step after which the next one starts with new factors
# allowed estimate of the next correction, relative to the allowed correction
LEFT = 1e-2


@inner
def move(model, discrete, step):
    """Compute the motion of bodies and markers over the step from the unknowns."""
    for i in range(model.bodies.kind.shape[0]):
        body_step(model, step, i)
    for m in range(model.markers.body.shape[0]):
        marker_step(model, discrete, step, m)
    line_steps(model, discrete, step)
    step.load[:] = 0.0


@inner
def add_loads(model, work, discrete, step):
    """Add all forces except reactions to markers and bodies, and sum their work over the step."""
    given, taken = 0.0, 0.0
    for i in range(model.bodies.kind.shape[0]):
        weight = scaled(model.body_types.mass[model.bodies.kind[i]], vector(model.gravity))
        put_sum(step.load, model.bodies.u0[i], weight)
    for k in range(model.loads.marker.shape[0]):
        given += point_load(model, step, k)
    for k in range(model.body_loads.body.shape[0]):
        given += body_load(model, discrete, step, k)
    for c in range(model.connections.size.shape[0]):
        entering, resisting = connection_load(model, work, discrete, step, c)
        given += entering
        taken += resisting
    step.given, step.taken = given, taken


@inner
def connection_load(model, work, discrete, step, c):
    """Add the forces of connection c; return supplied and dissipated work."""
    law = model.connections.law[c]
    if law == SPRING:
        return spring_load(model, step, c)
    if law == BUSHING:
        return bushing_load(model, discrete, step, c)
    if law == CONTACT:
        return 0.0, contact_load(model, discrete, step, c)
    if law == USER_FORCE:
        return user_force_load(model, work, discrete, step, c), 0.0
    if law == ELEMENT:
        return element_load(model, work, discrete, step, c)
    given, taken = 0.0, 0.0
    if law != JOINT:
        return given, taken
    for k in range(model.connections.w0[c], model.connections.w0[c + 1]):
        if model.rows.is_loaded[k]:
            normal = 0.0
            if has_normal(model.joint_forces, model.rows.force0[k], model.rows.force1[k]):
                normal = normal_force(model, discrete, step, c, k)
            a, b = model.connections.a[c], model.connections.b[c]
            entering, resisting = coordinate_load(model, discrete, step, k, a, b, normal)
            given += entering
            taken += resisting
    return given, taken


@inner
def has_normal(forces, first, last):
    """Whether some of the forces depend on the normal force in their joint."""
    for i in range(first, last):
        if forces.coefficient[i] > 0.0:
            return True
    return False


@inner
def write_residual(model, work, discrete, step):
    """Write the residual for the present unknowns."""
    n_u, h = step.load.shape[0], step.h
    c = 0.5 * h * h
    for j in range(step.f.shape[0]):
        step.f[j] = step.z[n_u + j] / c
    move(model, discrete, step)
    if not step.is_closing:
        add_loads(model, work, discrete, step)
    for connection in range(model.connections.size.shape[0]):
        if model.connections.law[connection] == ELEMENT:
            element_residual(model, work, discrete, step, connection)
            continue
        for j in range(discrete.first[connection], discrete.first[connection + 1]):
            k, soft = discrete.row[j], model.rows.soft[discrete.row[j]] * step.z[n_u + j]
            add_reaction(model, discrete, step, connection, k, step.f[j])
            if step.is_closing:
                rate = row_rate(model, step, connection, k, step.t_force)
                step.residual[n_u + j] = row_change(model, discrete, step, connection, k) + h * rate + soft
            else:
                step.residual[n_u + j] = row_value(model, discrete, step, connection, k) + soft
        if model.connections.law[connection] == USER_FORCE:
            write_state_residual(model, work, discrete, step, connection)
    for m in range(model.markers.body.shape[0]):
        marker_loads(model, discrete, step, m)
    for i in range(model.bodies.kind.shape[0]):
        n, u0, R = model.bodies.n_q[i], model.bodies.u0[i], matrix(step.R_0[i])
        body_inertia(model, discrete, step, i)
        put_sum(step.residual, u0, scaled(-c, turned_back(R, vector(step.load[u0:]))))
        torque = turned_back(R, vector(step.load[u0 + 3 :]))
        if not step.is_still:
            torque = sub(torque, scaled(0.5, cross(vector(step.z[u0 + 3 :]), torque)))
        put_sum(step.residual, u0 + 3, scaled(-c, torque))
        for k in range(u0 + 6, u0 + 6 + n):
            step.residual[k] -= c * step.load[k]


@inner
def write_state_residual(model, work, discrete, step, c):
    """Write the residuals of the states of connection c; states are constant while velocities are being closed."""
    if not step.is_closing:
        user_state_residual(model, work, discrete, step, c)
        return
    i = model.connections.item[c]
    first = step.load.shape[0] + step.f.shape[0]
    for s in range(first + model.elements.state0[i], first + model.elements.state0[i + 1]):
        step.residual[s] = step.z[s]


@inner
def put_changes(model, discrete, step):
    """Write the difference steps of the unknowns: SMALL times their size, if known.

    A multiplier of an element's equation, or a state, may be of any size. A step much smaller than this size would be
    lost in the roundoff of quantities that depend on it.
    """
    n_u, first_state = step.load.shape[0], step.load.shape[0] + step.f.shape[0]
    for j in range(step.z.shape[0]):
        size = 0.0
        if j >= first_state:
            size = abs(step.z[j]) + abs(step.known[model.states.row[j - first_state]])
        elif j >= n_u:
            size = max(abs(step.z[j]), 0.5 * step.h * step.h * step.f_size[j - n_u])
        step.center[j] = step.z[j]
        step.delta[j] = step.z[j] + max(discrete.delta[j], SMALL * size) - step.z[j]  # the rounded step


@inner
def factorize(model, work, discrete, step, stage):
    """Factorise the derivatives of the residual; return whether they are regular."""
    pattern, A = discrete.pattern, step.band[stage]
    below, above = pattern.below, pattern.above
    copy(step.residual, step.base)
    A[:, :] = 0.0
    put_changes(model, discrete, step)
    for color in range(pattern.color0.shape[0] - 1):
        first, last = pattern.color0[color], pattern.color0[color + 1]
        for e in range(first, last):
            step.z[pattern.column[e]] = step.center[pattern.column[e]] + step.delta[pattern.column[e]]
        write_residual(model, work, discrete, step)
        for e in range(first, last):
            j = pattern.column[e]
            step.z[j] = step.center[j]
            factor = discrete.scale[j] / step.delta[j]
            column, block = pattern.place[j], pattern.block[j]
            for r in range(pattern.row0[block], pattern.row0[block + 1]):
                i = pattern.row[r]
                row = pattern.place[i]
                A[row, below + column - row] = factor * discrete.row_scale[i] * (step.residual[i] - step.base[i])
    copy(step.base, step.residual)
    step.n_factors += 1
    return band_factor(A, step.band_pivot[stage], below, above)


@inner
def correct(model, discrete, step, stage):
    """Add Newton's correction to the unknowns and return its norm; write the largest relative state correction."""
    pattern, total, first_state = discrete.pattern, 0.0, step.load.shape[0] + step.f.shape[0]
    step.state_change = 0.0
    for i in range(step.z.shape[0]):
        step.right[pattern.place[i]] = -discrete.row_scale[i] * step.residual[i]
    band_solve(step.band[stage], step.band_pivot[stage], pattern.below, pattern.above, step.right)
    for i in range(step.z.shape[0]):
        change = discrete.scale[i] * step.right[pattern.place[i]]
        step.z[i] += change
        if i < discrete.weight.shape[0]:
            total += discrete.weight[i] * change * change
        elif i >= first_state:
            s = i - first_state
            size = abs(step.known[model.states.row[s]]) + abs(step.z[i]) + model.states.size[s]
            step.state_change = max(step.state_change, abs(change) / size)
    for e in range(discrete.equation.shape[0]):
        i, c = step.load.shape[0] + discrete.equation[e], 0.5 * step.h * step.h
        size = max(abs(step.z[i]), c * max(model.laws.equation_size[e], step.f_size[discrete.equation[e]]))
        step.state_change = max(step.state_change, abs(discrete.scale[i] * step.right[pattern.place[i]]) / size)
    return math.sqrt(total)


@inner
def size_of(discrete, step):
    """Return the size of the increments in the norm used for corrections."""
    total = 0.0
    for k in range(discrete.weight.shape[0]):
        total += discrete.weight[k] * step.z[k] * step.z[k]
    return math.sqrt(total)


@inner
def smallest(model, step, order):
    """Return the allowed size of a correction: tolerance times the displacement in a step, plus roundoff."""
    fall = 0.5 * step.h * step.h * norm(vector(model.gravity)) * math.sqrt(total_mass(model))
    return order.tolerance * fall + roundoff_floor(model, step.c_0, order.length)


@inner
def solve(model, work, discrete, step, order, stage, is_exact):
    """Solve for the unknowns of a step; return DONE, DIVERGED or SINGULAR.

    is_exact: whether to compute derivatives anew unless an iteration reduces the correction to a thousandth.
    """
    least = smallest(model, step, order)
    last = math.inf
    step.excess = math.inf
    if is_exact:
        step.is_due[stage] = 1
    for iteration in range(order.max_iterations):
        write_residual(model, work, discrete, step)
        if step.is_due[stage]:
            if not factorize(model, work, discrete, step, stage):
                return SINGULAR
            step.is_due[stage] = 0
        change = correct(model, discrete, step, stage)
        step.n_iterations += 1
        if not math.isfinite(change):
            step.is_due[stage] = 1
            step.excess = math.inf
            return DIVERGED
        allowed = order.tolerance * size_of(discrete, step) + least
        change = max(change, step.state_change * allowed / order.tolerance)
        step.excess = change / allowed
        left = change * min(change / last, 1.0)  # estimate of the next correction
        is_rounding = change <= 1e3 * allowed and change > 0.5 * last and iteration > 2
        if (change <= allowed and left <= LEFT * allowed) or is_rounding:
            if iteration >= MANY:
                step.is_due[stage] = 1
            return DONE
        if change > SLOW * last or (is_exact and change > 1e-3 * last):
            step.is_due[stage] = 1
        last = change
    step.is_due[stage] = 1
    return DIVERGED
