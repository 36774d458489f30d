"""A point that slides along a deformed line of a body over a step, see engine/kernels/joints/deformed_line.py.

d_j(q) and th_j(q) are displacement and rotation of the stations; a_j, b_j are Hermite functions of the coordinate s on
the line. In body axes, relative to the centre of mass,

    sigma(s, q) = c + s e + Σ a_j(s) d_j + b_j(s) th_j × e - s_c(q)
    th(s, q) = e × D' + e (e · Σ l_j(s) th_j),   D' = Σ a_j' d_j + b_j' th_j × e

The product rule with mean values gives their change from (s_0, q_0) to (s_1, q_1). The part due to q, Psi_sigma dq and
Psi_r dq, uses the shapes of the stations at the mean q and the means of the functions at s_0 and s_1. The part due to s
uses the means of d_j and th_j and the quotients (a_j(s_1) - a_j(s_0))/ds, computed without division by ds as the means
of a_j' between s_0 and s_1:

    sigma_1 - sigma_0 = Psi_sigma dq + T ds,    th_1 - th_0 = Psi_r dq + T_r ds

exactly. So the point of the line moves by d + theta_G × l + R_m Psi_sigma dq at constant s, and by t ds along the line,
t = R_m T. Its axes rotate in the body by the Cayley vector Gamma Psi_r dq, and by kappa ds, kappa = Gamma T_r. Because
the joint is closed at both ends of the step, x_B1 - x_B0 - (the motion of the point at constant s) = t ds for the point
of B. Therefore these loads of a multiplier f,

    LINE i       a force f N_i on the point of B and the opposite force on the line, with N_1 and N_2 normal to t, so
                 that it does no work as s changes; if s is prescribed also N_0 = t/|t|, with the work f |t| ds of the
                 drive
    LINE_TURN    f along the change of E · D, of which the part due to s is m ds, m = D · R_m (kappa × eps); if s is not
                 prescribed, a force f m t/|t|² on the point of B and the opposite force on the line do this part of the
                 work

do no work except that of the drive, and balance about any point. If forces act at one configuration, t and kappa are
those of this configuration.
"""

import math

from floatframe.engine.kernels.compiler.compilation import inner, loops
from floatframe.engine.kernels.joints.deformed_line import (
    add_shapes,
    displacement,
    piece,
    place_of,
    twist,
    unit_normal,
)
from floatframe.engine.kernels.joints.held_rows import of_a, of_b
from floatframe.engine.kernels.joints.relative_motion import direction, distance
from floatframe.engine.kernels.marker import shape_sum
from floatframe.engine.kernels.rotation import exp_matrix
from floatframe.engine.kernels.vector import (
    add,
    cross,
    dot,
    matrix,
    matrix_sum,
    norm,
    product,
    put,
    put_matrix,
    scaled,
    scaled_matrix,
    sub,
    turned,
    turned_back,
    unit,
    vector,
)
from floatframe.engine.structure_preserving.kernels.markers import (
    add_pair,
    deformation,
    mean_direction,
    mean_jacobian,
    put_end_of_forces,
    put_start,
    step_shapes,
)
from floatframe.engine.structure_preserving.kernels.rows import add_product, held
from floatframe.model.joints.rows.kinds import LINE_TURN

__all__ = ["add_line_reaction", "begin_lines", "line_rate", "line_steps", "line_value"]

NEAR, FAR = 0.5 - 0.5 / math.sqrt(3.0), 0.5 + 0.5 / math.sqrt(3.0)  # points of Gauss' rule, exact to degree three
BEGIN, END, MEAN = range(3)


@inner
def put_stations(model, step, k, end, q, s):
    """Write displacements and rotations of line k's stations at one end of the step; s: centre of mass."""
    for j in range(model.lines.station0[k], model.lines.station0[k + 1]):
        m = model.stations.marker[j]
        sigma, th = deformation(model, step, m, model.markers.body[m], q, s)
        put(step.station_d[end, j], 0, sub(add(sigma, s), vector(model.markers.position[m])))
        put(step.station_th[end, j], 0, th)


@inner
def put_mean_stations(model, step, k):
    """Write mean displacements and rotations of line k's stations."""
    for j in range(model.lines.station0[k], model.lines.station0[k + 1]):
        d, th = step.station_d, step.station_th
        put(d[MEAN, j], 0, scaled(0.5, add(vector(d[BEGIN, j]), vector(d[END, j]))))
        put(th[MEAN, j], 0, scaled(0.5, add(vector(th[BEGIN, j]), vector(th[END, j]))))


@inner
def found_place(model, step, k, end, t, R, center, way):
    """Return the coordinate s of line k at one end: prescribed at t, or nearest to B, `way` from the centre of mass."""
    if model.lines.row[k] >= 0:
        value, _ = held(model, model.lines.row[k], t)
        return value
    origin = vector(model.markers.position[model.lines.marker[k]])
    x = sub(add(turned_back(R, way), center), origin)
    return place_of(model, step.station_d[end], step.station_th[end], k, x)


@inner
def on_line(model, step, k, end, s, center):
    """Return the point of line k at coordinate s relative to the centre of mass, its rotation and r', body axes."""
    e, d, th = vector(model.lines.axis[k]), step.station_d[end], step.station_th[end]
    D, slope = displacement(model, d, th, k, s, 0), displacement(model, d, th, k, s, 1)
    sigma = sub(add(add(vector(model.markers.position[model.lines.marker[k]]), scaled(s, e)), D), center)
    return sigma, add(cross(e, slope), twist(model, th, k, s, 0)), add(e, slope)


@inner
def begin_lines(model, step):
    """Write the sliding markers at the beginning of the step, after all other markers."""
    for k in range(model.lines.marker.shape[0]):
        m, b = model.lines.marker[k], model.lines.other[k]
        i = model.markers.body[m]
        q0, R, s_c = model.bodies.q0[i], matrix(step.R_0[i]), vector(step.s_0[i])
        put_stations(model, step, k, BEGIN, step.q_0[q0 : q0 + model.bodies.n_q[i]], s_c)
        t = step.end.state.time if step.is_closing else step.t_0
        s = found_place(model, step, k, BEGIN, t, R, s_c, sub(vector(step.x_0[b]), vector(step.c_0[i])))
        sigma, angle, tangent = on_line(model, step, k, BEGIN, s, s_c)
        step.line_s[k, BEGIN] = s
        arm, E = turned(R, sigma), product(exp_matrix(angle), matrix(model.markers.triad[m]))
        put_start(step, m, i, arm, angle, E)
        put(step.line_end[k], 0, turned(R, tangent))


@inner
def line_steps(model, discrete, step):
    """Write the motion of the sliding markers over the step, after all other markers."""
    for k in range(model.lines.marker.shape[0]):
        line_step(model, discrete, step, k)


@inner
def line_step(model, discrete, step, k):
    """Write the motion of line k's sliding marker over the step, from body motion and sliding along the line."""
    m, b = model.lines.marker[k], model.lines.other[k]
    i = model.markers.body[m]
    n, q0, R_m = model.bodies.n_q[i], model.bodies.q0[i], matrix(step.R_m[i])
    arm_0, th_0, E_0 = vector(step.arm_0[m]), vector(step.th_0[m]), matrix(step.E_0[m])
    arm_1, th_1, E_1, s_0 = arm_0, th_0, E_0, step.line_s[k, BEGIN]
    s_1 = s_0
    if not step.is_closing:
        c_1, R_1 = add(vector(step.c_0[i]), vector(step.d[i])), matrix(step.R_1[i])
        s_c = vector(step.s_1[i])
        put_stations(model, step, k, END, step.q_1[q0 : q0 + n], s_c)
        put_mean_stations(model, step, k)
        s_1 = found_place(model, step, k, END, step.end.state.time, R_1, s_c, sub(vector(step.end.markers.r[b]), c_1))
        sigma, th_1, tangent = on_line(model, step, k, END, s_1, s_c)
        arm_1, E_1 = turned(R_1, sigma), product(exp_matrix(th_1), matrix(model.markers.triad[m]))
        put(step.end.markers.r[m], 0, add(c_1, arm_1))
        put_matrix(step.end.markers.A[m], product(R_1, E_1))
        put(step.line_end[k], 0, turned(R_1, tangent))
    end = MEAN
    if step.is_still:
        arm_1, th_1, E_1, s_1, end = arm_0, th_0, E_0, s_0, BEGIN
    put_end_of_forces(step, m)
    lever = scaled(0.5, add(arm_0, arm_1))
    put(step.lever[m], 0, lever)
    put_matrix(step.E_mean[m], scaled_matrix(0.5, matrix_sum(E_0, E_1)))
    put_shapes(model, discrete, step, k, s_0, s_1)
    by_q, turn_by_q = shape_sum(step_shapes(model, discrete, step, m), step.dq[q0 : q0 + n])
    Gamma = mean_jacobian(th_0, th_1)
    put_matrix(step.Gamma[m], Gamma)
    put(step.dpsi[m], 0, turned(Gamma, turn_by_q))
    put(step.dx[m], 0, add(add(vector(step.d[i]), cross(vector(step.theta_G[i]), lever)), turned(R_m, by_q)))
    T, T_r = ways_by_place(model, step, k, end, s_0, s_1)
    put(step.line_t[k], 0, turned(R_m, T))
    put(step.line_kappa[k], 0, turned(Gamma, T_r))


@loops
def put_shapes(model, discrete, step, k, s_0, s_1):
    """Write the mean derivatives by q of the sliding marker's position and rotation, over both coordinates s."""
    own = step_shapes(model, discrete, step, model.lines.marker[k])
    own[:, :] = 0.0
    for end in range(2):
        s = s_0 if end == 0 else s_1
        j, _ = piece(model.lines, model.stations, k, s)
        first = step_shapes(model, discrete, step, model.stations.marker[j])
        second = step_shapes(model, discrete, step, model.stations.marker[j + 1])
        add_shapes(model, k, s, first, second, 0.5, own)


@inner
def ways_by_place(model, step, k, end, s_0, s_1):
    """Return T and T_r by two-point Gauss quadrature on each interval of stations between s_0 and s_1."""
    e, way, d, th = vector(model.lines.axis[k]), s_1 - s_0, step.station_d[end], step.station_th[end]
    T, slope = e, (0.0, 0.0, 0.0)
    T_r = (0.0, 0.0, 0.0)
    done, first, n = 0.0, model.lines.station0[k], model.lines.station0[k + 1] - model.lines.station0[k]
    for p in range(n + 1):
        part = 1.0
        if p < n:
            border = model.stations.s[first + p if way > 0.0 else first + n - 1 - p] - s_0
            if border * way <= 0.0 or abs(border) >= abs(way):
                continue
            part = border / way
        half = 0.5 * (part - done)
        for g in range(2):
            s = s_0 + (done + (NEAR if g == 0 else FAR) * (part - done)) * way
            T = add(T, scaled(half, displacement(model, d, th, k, s, 1)))
            slope = add(slope, scaled(half, displacement(model, d, th, k, s, 2)))
            T_r = add(T_r, scaled(half, twist(model, th, k, s, 1)))
        done = part
    return T, add(T_r, cross(e, slope))


@inner
def line_value(model, step, k, a, b):
    """Return the value of a LINE or LINE_TURN row k at the end of a step."""
    if model.rows.kind[k] == LINE_TURN:
        E, D = (
            turned(step.end.markers.A[a], vector(model.rows.x[k])),
            turned(step.end.markers.A[b], vector(model.rows.y[k])),
        )
        return dot(E, D)
    along, y = vector(step.line_end[model.markers.line[a]]), direction(step.end.markers, a, unit(1))
    n = unit_normal(model.rows.part[k], scaled(1.0 / norm(along), along), y)
    return dot(n, distance(step.end.markers, a, b))


@inner
def turn_by_place(model, step, k, a, b):
    """Return the change of E · D with s."""
    eps = turned(step.E_mean[a], vector(model.rows.x[k]))
    by_s = turned(step.R_m[model.markers.body[a]], cross(vector(step.line_kappa[model.markers.line[a]]), eps))
    return dot(mean_direction(step, b, vector(model.rows.y[k])), by_s)


@inner
def mean_normal(model, step, k, a):
    """Return the mean normal N of row k over the step."""
    along = vector(step.line_t[model.markers.line[a]])
    return unit_normal(model.rows.part[k], scaled(1.0 / norm(along), along), mean_direction(step, a, unit(1)))


@inner
def add_line_reaction(model, discrete, step, k, a, b, f):
    """Add the loads of a LINE or LINE_TURN row k with multiplier f."""
    if model.rows.kind[k] != LINE_TURN:
        add_pair(step, a, b, scaled(f, mean_normal(model, step, k, a)))
        return
    add_product(model, discrete, step, a, b, of_a(model.rows.x[k]), of_b(model.rows.y[k]), f)
    line = model.markers.line[a]
    if model.lines.row[line] < 0:
        t = vector(step.line_t[line])
        add_pair(step, a, b, scaled(f * turn_by_place(model, step, k, a, b) / dot(t, t), t))


@inner
def line_rate(model, step, k, a, b, t):
    """Return the explicit time derivative of row k, due to a prescribed coordinate."""
    line = model.markers.line[a]
    if model.lines.row[line] < 0:
        return 0.0
    _, rate = held(model, model.lines.row[line], t)
    if model.rows.kind[k] == LINE_TURN:
        return rate * turn_by_place(model, step, k, a, b)
    return -rate * norm(vector(step.line_t[line])) if model.rows.part[k] == 0 else 0.0
