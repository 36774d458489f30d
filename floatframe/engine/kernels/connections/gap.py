"""Gaps between bodies that can touch, and the step size near contacts.

A gap is positive while the bodies do not touch; a negative gap is minus the depth x of a contact with the spring k xⁿ.
J is the derivative of the gap by the motion of its markers, and 1/m = J M⁻¹ Jᵀ. A contact with the speed v at the depth
x has the energy E = m v²/2 + k x^(n+1)/(n+1), reaches the depth x_m = ((n+1) E/k)^(1/(n+1)) and lasts about

    T = 3 x_m / sqrt(2 E/m)        (pi sqrt(m/k) of a linear spring, 2.94 x_m/v of Hertz)

(1) Before a step, the motion of the markers is predicted by v t + a t²/2. If a gap closes in the predicted step, the
    step is shortened and ends half a fine step before. The size of a fine step is T/FINE.
(2) After a step, a relative change of a contact's depth by more than CALM is accepted only if the step was a fine step.

So fine steps resolve the beginning, the course and the end of contacts, while contacts at rest allow steps of any size.
The mobility 1/m is that of the bodies without their joints, which can only reduce it. A mode contributes to it to the
extent that the contact is stiffer than the mode.
"""

import math

from floatframe.engine.kernels.body import modal_number, moved_inertia
from floatframe.engine.kernels.compiler.compilation import inner
from floatframe.engine.kernels.connections.contact import contact_gap
from floatframe.engine.kernels.connections.element_law import law_results, law_values
from floatframe.engine.kernels.joints.relative_motion import distance, relative_velocity
from floatframe.engine.kernels.marker import marker_motion, shape, shapes_of
from floatframe.engine.kernels.marker_acceleration import marker_acceleration
from floatframe.engine.kernels.model import ELEMENT, MASS, STIFFNESS
from floatframe.engine.kernels.rotation import exp_matrix
from floatframe.engine.kernels.vector import (
    add,
    cross,
    dot,
    matrix,
    norm,
    product,
    put,
    put_matrix,
    put_sum,
    scaled,
    solved,
    sub,
    turned,
    turned_back,
    unit,
    vector,
)

__all__ = ["gap_of_markers", "next_step", "step_before_contact", "step_of_gap", "take_ends"]

FINE = 30.0  # number of fine steps in a contact
CALM = 0.1  # change of the depth of a contact in a step, relative to its depth, that is always allowed
LONGER = 1.01  # factor by which fine steps may be longer
NONE = 1e-13  # depth of a contact, relative to the distance of its markers from the origin, that counts as roundoff
PARTS = 4  # number of points in a step at which gaps are evaluated
SMALL = 1e-6  # displacement of a marker for derivatives of gaps, relative to the length of the law; angle [rad]
NEAR = 0.05  # fraction of a fine step: accuracy of the time of the first contact
MOST_SEARCHES = 40


@inner
def last_marker(model, c):
    """Return the index after the last marker of connection c."""
    n = model.laws.head[model.connections.item[c], 0] if model.connections.law[c] == ELEMENT else 2
    return model.connections.a[c] + n


@inner
def gap_of_markers(model, work, g):
    """Return gap g for the marker motion in `work`."""
    c = model.gaps.connection[g]
    i = model.connections.item[c]
    if model.connections.law[c] == ELEMENT:
        law_values(model, work, c)
        return law_results(model.laws.head[i], work.laws.outputs).outputs[model.gaps.output[g]]
    return contact_gap(model, work.markers.r, work.markers.A, c)


@inner
def place_markers(model, work, c):
    """Write the motion of the markers of connection c at the iterate."""
    for m in range(model.connections.a[c], last_marker(model, c)):
        marker_motion(model, work, m)


@inner
def gap_after(model, work, g, t, e):
    """Return gap g at time t + e; the iterate is at t, with its accelerations in `work.markers.bias`."""
    c = model.gaps.connection[g]
    for m in range(model.connections.a[c], last_marker(model, c)):
        marker_motion(model, work, m)
        if model.markers.body[m] < 0:
            continue
        a, alpha = vector(work.markers.bias[m]), vector(work.markers.bias[m, 3:])
        v, omega = vector(work.markers.v[m]), vector(work.markers.omega[m])
        put_sum(work.markers.r[m], 0, add(scaled(e, v), scaled(0.5 * e * e, a)))
        turn = exp_matrix(add(scaled(e, omega), scaled(0.5 * e * e, alpha)))
        put_matrix(work.markers.A[m], product(turn, matrix(work.markers.A[m])))
        put_sum(work.markers.v[m], 0, scaled(e, a))
        put_sum(work.markers.omega[m], 0, scaled(e, alpha))
    work.state.time = t + e
    return gap_of_markers(model, work, g)


@inner
def take_gap(model, work, g, t):
    """Store gap g at time t, the beginning of a step; the iterate is at t."""
    place_markers(model, work, model.gaps.connection[g])
    work.state.time = t
    work.gaps.start[g] = gap_of_markers(model, work, g)


@inner
def is_far(model, work, c, gap, h):
    """Whether the two spheres of a contact stay apart during a step of size h."""
    if model.connections.law[c] == ELEMENT:
        return False
    a, b, markers = model.connections.a[c], model.connections.b[c], work.markers
    d, v = distance(markers, a, b), relative_velocity(markers, a, b)
    speed = norm(v) + norm(vector(markers.omega[a])) * norm(d)
    change = norm(sub(vector(markers.bias[b]), vector(markers.bias[a]))) + norm(vector(markers.bias[a, 3:])) * norm(d)
    return gap > 1.5 * h * (speed + 0.5 * h * change)


@inner
def nearest_time(model, work, c):
    """Return the time at which two spheres on straight paths are closest; negative if it has passed."""
    if model.connections.law[c] == ELEMENT or not model.contacts.is_sphere[model.connections.item[c]]:
        return -1.0
    a, b, markers = model.connections.a[c], model.connections.b[c], work.markers
    d, v = distance(markers, a, b), relative_velocity(markers, a, b)
    square = dot(v, v)
    return -dot(d, v) / square if square > 0.0 else -1.0


@inner
def step_before_contact(model, work, t, h):
    """(1): store all gaps at time t, the beginning of a step; return the allowed step size, at most h."""
    for g in range(model.gaps.connection.shape[0]):
        take_gap(model, work, g, t)
        if work.gaps.start[g] < 0.0:
            continue
        c = model.gaps.connection[g]
        for m in range(model.connections.a[c], last_marker(model, c)):
            marker_acceleration(model, work, m, work.markers.bias[m])
        if not is_far(model, work, c, work.gaps.start[g], h):
            h = min(h, step_to_gap(model, work, g, t, h))
    return h


@inner
def step_to_gap(model, work, g, t, h):
    """Return the step size, at most h, for a step that ends before gap g closes."""
    nearest = nearest_time(model, work, model.gaps.connection[g])
    before, open_gap, e, gap = 0.0, work.gaps.start[g], 0.0, 0.0
    for k in range(PARTS):
        e = h * (k + 1) / PARTS
        if before < nearest < e:
            gap = gap_after(model, work, g, t, nearest)
            if gap < 0.0:
                e = nearest
                break
            before, open_gap = nearest, gap
        gap = gap_after(model, work, g, t, e)
        if gap < 0.0:
            break
        before, open_gap = e, gap
    if gap >= 0.0:
        return h
    speed = (open_gap - gap) / (e - before)
    fine = step_of_gap(model, work, g, t, 0.0, speed)
    return max(touching_time(model, work, g, t, before, open_gap, e, gap, fine) - 0.5 * fine, fine)


@inner
def touching_time(model, work, g, t, low, open_gap, high, gap, fine):
    """Return the time, between two given times, at which gap g closes, by false position (Illinois variant)."""
    side = 0
    for _ in range(MOST_SEARCHES):
        if high - low <= NEAR * fine:
            break
        e = (low * gap - high * open_gap) / (gap - open_gap)
        if not low < e < high:
            break
        found = gap_after(model, work, g, t, e)
        if abs(found) <= NEAR * fine * abs(open_gap - gap) / (high - low):
            return e
        if found < 0.0:
            high, gap = e, found
            if side < 0:
                open_gap *= 0.5
            side = -1
        else:
            low, open_gap = e, found
            if side > 0:
                gap *= 0.5
            side = 1
    return low


@inner
def step_of_gap(model, work, g, t, depth, speed):
    """Return the fine step size of gap g for a depth and a speed at t; infinite if there is no motion."""
    k, n = model.gaps.stiffness[g], model.gaps.exponent[g]
    mobility = rigid_mobility(model, work, g, t)
    if mobility <= 0.0 or (speed == 0.0 and depth == 0.0):
        return math.inf
    deepest = depth_of(k, n, mobility, depth, speed)
    mobility += modal_mobility(model, work, g, k * n * deepest ** (n - 1.0))
    deepest = depth_of(k, n, mobility, depth, speed)
    fastest = math.sqrt(speed * speed + 2.0 * mobility * k * depth ** (n + 1.0) / (n + 1.0))
    return 3.0 * deepest / (fastest * FINE)


@inner
def depth_of(k, n, mobility, depth, speed):
    """Return the largest depth that a contact reaches after it has a given depth and speed."""
    return (depth ** (n + 1.0) + 0.5 * (n + 1.0) * speed * speed / (mobility * k)) ** (1.0 / (n + 1.0))


@inner
def put_unit_wrench(model, work, g, t):
    """Write the marker wrenches that are conjugate to the change of gap g, ground axes."""
    c = model.gaps.connection[g]
    a, markers, wrench = model.connections.a[c], work.markers, work.gaps.wrench
    place_markers(model, work, c)
    if model.connections.law[c] != ELEMENT:
        b, i = model.connections.b[c], model.connections.item[c]
        d = distance(markers, a, b)
        N, M = scaled(1.0 / norm(d), d), (0.0, 0.0, 0.0)
        if not model.contacts.is_sphere[i]:
            N = turned(markers.A[a], vector(model.rows.x[model.connections.w0[c]]))
            M = cross(N, d)
        put(wrench[b], 0, N)
        put(wrench[b], 3, (0.0, 0.0, 0.0))
        put(wrench[a], 0, scaled(-1.0, N))
        put(wrench[a], 3, M)
        return
    work.state.time = t
    length = SMALL * model.laws.length[model.connections.item[c]]
    for m in range(a, last_marker(model, c)):
        r, A = vector(markers.r[m]), matrix(markers.A[m])
        for k in range(3):
            put(markers.r[m], 0, add(r, scaled(length, unit(k))))
            forward = gap_of_markers(model, work, g)
            put(markers.r[m], 0, sub(r, scaled(length, unit(k))))
            wrench[m, k] = (forward - gap_of_markers(model, work, g)) / (2.0 * length)
            put(markers.r[m], 0, r)
            put_matrix(markers.A[m], product(exp_matrix(scaled(SMALL, unit(k))), A))
            forward = gap_of_markers(model, work, g)
            put_matrix(markers.A[m], product(exp_matrix(scaled(-SMALL, unit(k))), A))
            wrench[m, 3 + k] = (forward - gap_of_markers(model, work, g)) / (2.0 * SMALL)
            put_matrix(markers.A[m], A)


@inner
def is_first_on_body(model, first, m):
    """Whether marker m is on a body, and no marker from `first` to m - 1 is on the same body."""
    i = model.markers.body[m]
    if i < 0:
        return False
    for k in range(first, m):
        if model.markers.body[k] == i:
            return False
    return True


@inner
def rigid_mobility(model, work, g, t):
    """Return the mobility J M⁻¹ Jᵀ of gap g for rigid bodies without joints."""
    c = model.gaps.connection[g]
    first, last = model.connections.a[c], last_marker(model, c)
    put_unit_wrench(model, work, g, t)
    total = 0.0
    for m in range(first, last):
        if is_first_on_body(model, first, m):
            i = model.markers.body[m]
            f, tau = (0.0, 0.0, 0.0), (0.0, 0.0, 0.0)
            for k in range(m, last):
                if model.markers.body[k] == i:
                    own, moment = wrench_in_body(work, i, k)
                    f, tau = add(f, own), add(tau, add(moment, cross(vector(work.markers.rho[k]), own)))
            total += body_mobility(model, model.bodies.kind[i], f, tau)
    return total


@inner
def wrench_in_body(work, i, m):
    """Return force and moment of the unit wrench on marker m in the axes of its body."""
    wrench = work.gaps.wrench[m]
    return turned_back(work.state.R[i], vector(wrench)), turned_back(work.state.R[i], vector(wrench[3:]))


@inner
def body_mobility(model, t, f, tau):
    """Return the mobility of a rigid body of type t for force f and torque tau about its frame origin, body axes."""
    m, J = model.body_types.mass[t], matrix(model.body_types.J0[t])
    s = scaled(1.0 / m, vector(model.body_types.S[t]))
    tau = sub(tau, cross(s, f))
    _, J = moved_inertia(m, scaled(m, s), J, scaled(-1.0, s))  # about the centre of mass
    turning = dot(tau, solved(J, tau)) if dot(J[0], cross(J[1], J[2])) > 0.0 else 0.0
    return dot(f, f) / m + turning


@inner
def modal_mobility(model, work, g, stiffness):
    """Return the contribution of modes to the mobility of gap g, for the wrenches that `rigid_mobility` wrote."""
    c = model.gaps.connection[g]
    first, last, total = model.connections.a[c], last_marker(model, c), 0.0
    for m in range(first, last):
        if not is_first_on_body(model, first, m):
            continue
        i = model.markers.body[m]
        t, n = model.bodies.kind[i], model.bodies.n_q[i]
        for k in range(n):
            Q = 0.0
            for j in range(m, last):
                if model.markers.body[j] == i and model.markers.psi0[j] >= 0:
                    f, moment = wrench_in_body(work, i, j)
                    d, th = shape(shapes_of(model, work.markers.psi, j), k)
                    Q += dot(d, f) + dot(th, turned_back(work.markers.T_left[j], moment))
            types = model.body_types
            M, K = modal_number(types, t, n, MASS, k), modal_number(types, t, n, STIFFNESS, k)
            if Q != 0.0 and M > 0.0:
                total += Q * Q / M * stiffness * Q * Q / (stiffness * Q * Q + K)
    return total


@inner
def step_after_gap(model, work, g, end, t, h):
    """(2): return the step size that gap g allows after a step of size h to the value `end`; below h: repeat it."""
    start = work.gaps.start[g]
    x_0, x_1 = max(-start, 0.0), max(-end, 0.0)
    deepest, change = max(x_0, x_1), abs(x_1 - x_0)
    if 2.0 * change <= CALM * deepest:
        return math.inf
    c = model.gaps.connection[g]
    for m in range(model.connections.a[c], last_marker(model, c)):
        if deepest <= NONE * norm(vector(work.markers.r[m])):
            return math.inf
    fine = step_of_gap(model, work, g, t, deepest, abs(end - start) / h)
    if change <= CALM * deepest or h <= LONGER * fine:
        return max(h, fine)
    return fine if change > 0.5 * deepest and start < 0.0 else max(0.5 * h, fine)


@inner
def take_ends(model, work):
    """Store all gaps at the end of a step, for the marker motion in `work`."""
    for g in range(model.gaps.connection.shape[0]):
        work.gaps.end[g] = gap_of_markers(model, work, g)


@inner
def next_step(model, work, t, h):
    """Return the longest step that all gaps allow after a step of size h that ended at t.

    If the result is below h, this step was too long.
    """
    longest = math.inf
    work.gaps.shortest, work.gaps.n_closed = -1, 0
    for g in range(model.gaps.connection.shape[0]):
        if work.gaps.end[g] < 0.0:
            work.gaps.n_closed += 1
        wanted = step_after_gap(model, work, g, work.gaps.end[g], t, h)
        if wanted < longest:
            longest = wanted
            work.gaps.shortest = g
    work.gaps.step = longest
    return longest
