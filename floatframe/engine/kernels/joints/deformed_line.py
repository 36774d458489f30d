"""A point that slides along the deformed centre line of a flexible body.

The line runs along e (unit vector, body axes) through the markers of stations at s_1 < s_2 < …. Cubic Hermite functions
of xi = (s - s_1)/h interpolate displacement d and rotation th between two stations:

    D(s) = a_1 d_1 + a_2 d_2 + b_1 th_1 × e + b_2 th_2 × e,   r = c(s) + D,   r' = e + D'
    th(s) = e × D' + e (e · (l_1 th_1 + l_2 th_2)),   l linear: sections stay normal to the line

Beyond the ends the line is straight. The sliding marker is at the point of the line nearest to B, (r_B - r)·r' = 0, or
at the coordinate that its drive prescribes. Its displacement and rotation, their rates and their derivatives by q are
the same combinations of those of the stations. Let n_0 = r'/|r'|, n_1 and n_2 normal to it, d = r_B - r, and kappa the
rotation of its axes per unit of s. Then

    LINE i       n_i · d = 0                           i = 1, 2; i = 0 if it is driven
    LINE_TURN    E · D = 0 as DOT, where A also rotates with kappa s_dot
    LINE_FREE    n_0 · F + kappa · M / |r'| = 0        no force along the line: the wrench does no work as s changes

The point of A on which a force acts, and n_i, change with s. The residual includes this change; the tangent omits it,
because it is of the size of the reaction times the curvature.

Described in `floatframe.model.joints.sliding`.
"""

from floatframe.engine.kernels.compiler.compilation import inner
from floatframe.engine.kernels.joints.held_rows import ZERO, dot_rates, of_b, rates_of
from floatframe.engine.kernels.joints.relative_motion import direction, distance, prescribed, relative_velocity
from floatframe.engine.kernels.marker import bent_bias, pose_on_body, shape, shapes_of
from floatframe.engine.kernels.rotation import left_jacobian, left_jacobian_derivative
from floatframe.engine.kernels.vector import (
    add,
    add_column,
    cross,
    dot,
    norm,
    put,
    put_matrix,
    scaled,
    sub,
    turned,
    turned_back,
    unit,
    vector,
)
from floatframe.model.joints.rows.kinds import FORCE, MOMENT

__all__ = [
    "line_free_derivatives",
    "line_free_value",
    "line_rates",
    "line_turn_rates",
    "line_turn_value",
    "line_value",
    "slide_marker",
]

MOST, CLOSE = 30, 1e-14


@inner
def piece(lines, stations, k, s):
    """Return the first of the two stations that enclose s, and the distance between both.

    Beyond the ends of the line, return the nearest piece.
    """
    j, last = lines.station0[k], lines.station0[k + 1] - 2
    while j < last and s > stations.s[j + 1]:
        j += 1
    return j, stations.s[j + 1] - stations.s[j]


@inner
def weights(stations, j, h, s, order):
    """Return the interpolation functions a_1, a_2, b_1, b_2 at s, or their derivatives of the given order."""
    x = (s - stations.s[j]) / h
    if x < 0.0 or x > 1.0:
        end = 1.0 if x > 1.0 else 0.0
        by_slope = s - stations.s[j] - end * h if order == 0 else (1.0 if order == 1 else 0.0)
        own = 1.0 if order == 0 else 0.0
        return own * (1.0 - end), own * end, by_slope * (1.0 - end), by_slope * end
    if order == 0:
        a = x * x * (3 - 2 * x)
        return 1.0 - a, a, h * x * (1 - x) * (1 - x), h * x * x * (x - 1)
    if order == 1:
        a = 6 * x * (1 - x) / h
        return -a, a, 1 + x * (3 * x - 4), x * (3 * x - 2)
    if order == 2:
        a = (6 - 12 * x) / (h * h)
        return -a, a, (6 * x - 4) / h, (6 * x - 2) / h
    a = -12 / (h * h * h)
    return -a, a, 6 / (h * h), 6 / (h * h)


@inner
def linear_weight(stations, j, h, s):
    """Return the linear interpolation weight l_2 and its derivative."""
    x = (s - stations.s[j]) / h
    if x < 0.0:
        return 0.0, 0.0
    if x > 1.0:
        return 1.0, 0.0
    return x, 1.0 / h


@inner
def mean(l_2, x_1, x_2):
    """Return the linear interpolation (1 - l_2) x_1 + l_2 x_2."""
    return add(scaled(1 - l_2, x_1), scaled(l_2, x_2))


@inner
def combined(e, weight, d_1, th_1, d_2, th_2):
    """Return a_1 d_1 + a_2 d_2 + (b_1 th_1 + b_2 th_2) × e."""
    a_1, a_2, b_1, b_2 = weight
    own = add(scaled(a_1, d_1), scaled(a_2, d_2))
    return add(own, cross(add(scaled(b_1, th_1), scaled(b_2, th_2)), e))


@inner
def displacement(model, d, th, k, s, order):
    """Return displacement D, or D', D'', D''', at s from displacements and rotations of stations, (n, 3), body axes."""
    j, h = piece(model.lines, model.stations, k, s)
    weight = weights(model.stations, j, h, s, order)
    return combined(
        vector(model.lines.axis[k]), weight, vector(d[j]), vector(th[j]), vector(d[j + 1]), vector(th[j + 1])
    )


@inner
def twist(model, th, k, s, order):
    """Return the twist e (e · Σ l_j th_j) at s, or its derivative."""
    e = vector(model.lines.axis[k])
    j, h = piece(model.lines, model.stations, k, s)
    l_2, slope = linear_weight(model.stations, j, h, s)
    if order == 0:
        return scaled(dot(e, mean(l_2, vector(th[j]), vector(th[j + 1]))), e)
    return scaled(slope * dot(e, sub(vector(th[j + 1]), vector(th[j]))), e)


@inner
def place_of(model, d, th, k, x):
    """Return the coordinate s of the point on the line nearest to x, given relative to the point s = 0, body axes."""
    e = vector(model.lines.axis[k])
    s = dot(x, e)
    length = model.stations.s[model.lines.station0[k + 1] - 1]
    for _ in range(MOST):
        tangent = add(e, displacement(model, d, th, k, s, 1))
        gap = sub(sub(x, scaled(s, e)), displacement(model, d, th, k, s, 0))
        change = dot(gap, tangent) / (dot(tangent, tangent) - dot(gap, displacement(model, d, th, k, s, 2)))
        s += change
        if abs(change) <= CLOSE * length:
            break
    return s


@inner
def slide_marker(model, work, k):
    """Move the sliding marker of line k to its position and write its motion; all other markers are known."""
    m, b, row = model.lines.marker[k], model.lines.other[k], model.lines.row[k]
    i, e, markers = model.markers.body[m], vector(model.lines.axis[k]), work.markers
    stations, origin, d, th = model.stations, vector(model.markers.position[m]), work.lines.d, work.lines.th
    for j in range(model.lines.station0[k], model.lines.station0[k + 1]):
        station = stations.marker[j]
        put(d[j], 0, sub(vector(markers.rho[station]), vector(model.markers.position[station])))
        put(th[j], 0, vector(markers.angle[station]))
    is_driven = row >= 0
    if is_driven:
        s, rate, _ = prescribed(model, work, row)
    else:
        x = turned_back(work.state.R[i], sub(vector(markers.r[b]), vector(work.state.r[i])))
        s, rate = place_of(model, d, th, k, sub(x, origin)), 0.0
    j, h = piece(model.lines, stations, k, s)
    m_1, m_2 = stations.marker[j], stations.marker[j + 1]
    l_2, by_s = linear_weight(stations, j, h, s)
    D_1, D_2 = displacement(model, d, th, k, s, 1), displacement(model, d, th, k, s, 2)
    put(markers.rho[m], 0, add(add(origin, scaled(s, e)), displacement(model, d, th, k, s, 0)))
    angle = add(cross(e, D_1), twist(model, th, k, s, 0))
    by_place = add(cross(e, D_2), twist(model, th, k, s, 1))  # th'
    value, slopes = weights(stations, j, h, s, 0), weights(stations, j, h, s, 1)
    v_1, v_2 = vector(markers.rho_dot[m_1]), vector(markers.rho_dot[m_2])
    o_1, o_2 = vector(markers.angle_dot[m_1]), vector(markers.angle_dot[m_2])
    put(markers.rho_dot[m], 0, combined(e, value, v_1, o_1, v_2, o_2))
    D_1_dot = combined(e, slopes, v_1, o_1, v_2, o_2)
    angle_dot = add(cross(e, D_1_dot), scaled(dot(e, mean(l_2, o_1, o_2)), e))
    T, line = left_jacobian(angle), work.lines
    b_1, c_1 = bent_bias(model, work, m_1, i)
    b_2, c_2 = bent_bias(model, work, m_2, i)
    put(line.bent[k], 0, combined(e, value, b_1, c_1, b_2, c_2))
    bent_slope = cross(e, combined(e, slopes, b_1, c_1, b_2, c_2))
    put(line.bent[k], 3, add(bent_slope, scaled(dot(e, mean(l_2, c_1, c_2)), e)))
    put(markers.angle[m], 0, angle)
    put(markers.angle_dot[m], 0, angle_dot)
    put_matrix(markers.T_left[m], T)
    put(markers.spin[m], 0, turned(T, angle_dot))
    own = shapes_of(model, markers.psi, m)
    own[:, :] = 0.0
    add_shapes(model, k, s, shapes_of(model, markers.psi, m_1), shapes_of(model, markers.psi, m_2), 1.0, own)
    pose_on_body(model, work, m)
    # the line in ground axes
    R = work.state.R[i]
    tangent = add(e, D_1)
    slope = norm(tangent)
    n_0 = turned(R, scaled(1.0 / slope, tangent))
    if not is_driven:
        rate = dot(n_0, relative_velocity(markers, m, b)) / slope
    line.s[k], line.s_dot[k], line.slope[k], line.by_place[k] = s, rate, slope, 0.0 if is_driven else 1.0 / slope
    put(line.n_0[k], 0, n_0)
    put(line.kappa[k], 0, turned(R, turned(T, by_place)))
    put(line.curve[k], 0, turned(R, D_2))
    omega = vector(work.state.u[model.bodies.u0[i] + 3 :])
    put(line.slope_dot[k], 0, turned(R, add(cross(omega, tangent), D_1_dot)))
    by_place_dot = add(cross(e, combined(e, weights(stations, j, h, s, 2), v_1, o_1, v_2, o_2)),
                       scaled(by_s * dot(e, sub(o_2, o_1)), e))  # fmt: skip
    bending = cross(e, displacement(model, d, th, k, s, 3))  # th''
    change = turning_change(T, angle, rate, angle_dot, by_place, by_place_dot, bending)
    put(line.turning[k], 0, turned(R, scaled(rate, add(cross(omega, turned(T, by_place)), change))))


@inner
def turning_change(T, th, s_dot, th_t, th_s, th_st, th_ss):
    """Return d(T th_s)/dt + d(T th_t)/ds at the moving point, body at rest; th_t: rate at fixed s, th_s: by s.

    Multiplied by s_dot, it is a part of the angular acceleration of axes that rotate with T (th_t + th_s s_dot).
    """
    of_slope, of_rate = left_jacobian_derivative(th, th_s, 1.0), left_jacobian_derivative(th, th_t, 1.0)
    own = add(turned(of_slope, add(th_t, scaled(s_dot, th_s))), turned(of_rate, th_s))
    return add(own, turned(T, add(scaled(2.0, th_st), scaled(s_dot, th_ss))))


@inner
def add_shapes(model, k, s, first, second, factor, out):
    """Add the derivatives by q, (6, n), of displacement and rotation at s, interpolated from the nearest stations."""
    e, stations = vector(model.lines.axis[k]), model.stations
    j, h = piece(model.lines, stations, k, s)
    value, slopes = weights(stations, j, h, s, 0), weights(stations, j, h, s, 1)
    l_2, _ = linear_weight(stations, j, h, s)
    for q in range(out.shape[1]):
        d_1, th_1 = shape(first, q)
        d_2, th_2 = shape(second, q)
        d = combined(e, value, d_1, th_1, d_2, th_2)
        th = add(cross(e, combined(e, slopes, d_1, th_1, d_2, th_2)), scaled(dot(e, mean(l_2, th_1, th_2)), e))
        add_column(out, 0, q, scaled(factor, d))
        add_column(out, 3, q, scaled(factor, th))


@inner
def unit_normal(part, n_0, y):
    """Return normal i of a line with unit tangent n_0; part 0: n_0 itself, 1: nearest to y, 2: normal to both."""
    if part == 0:
        return n_0
    y = sub(y, scaled(dot(y, n_0), n_0))
    y = scaled(1.0 / norm(y), y)
    return y if part == 1 else cross(n_0, y)


@inner
def normal(model, work, row, a):
    """Return the normal n_i of row k, ground axes, where y is the second axis of the marker."""
    n_0 = vector(work.lines.n_0[model.markers.line[a]])
    return unit_normal(model.rows.part[row], n_0, direction(work.markers, a, unit(1)))


@inner
def line_value(model, work, k, a, b):
    """Return the value of LINE, n_i · d; the axes of A do not contribute, because A follows the point of B."""
    n = normal(model, work, k, a)
    return dot(n, distance(work.markers, a, b)), n, ZERO, ZERO


@inner
def place_rates(model, work, a):
    """Return the prescribed rate of s, else 0; its second rate, prescribed or due to s_dot; and s_dot's part of d_ddot.

    The point of the line accelerates by a + 2 s_dot r'_dot + s_dot² r'' + s_ddot r', where a belongs to fixed s.
    """
    j, line = model.markers.line[a], work.lines
    s_dot = line.s_dot[j]
    own = add(scaled(-2 * s_dot, vector(line.slope_dot[j])), scaled(-s_dot * s_dot, vector(line.curve[j])))
    if model.lines.row[j] >= 0:
        _, _, second = prescribed(model, work, model.lines.row[j])
        return s_dot, second, own
    return 0.0, line.by_place[j] * dot(vector(line.n_0[j]), own), own


@inner
def line_rates(model, work, k, a, b):
    """Return the rates of LINE."""
    rate, second, own = place_rates(model, work, a)
    held = dot(normal(model, work, k, a), own)
    if model.rows.part[k] == 0:
        slope = work.lines.slope[model.markers.line[a]]
        return -rate * slope, held - second * slope
    return 0.0, held


@inner
def line_turn_value(model, work, k, a, b):
    """Return the value of LINE_TURN, E · D; A also rotates with kappa s_dot if s follows the points."""
    rows = model.rows
    line, j = work.lines, model.markers.line[a]
    E, D = direction(work.markers, a, rows.x[k]), direction(work.markers, b, rows.y[k])
    m = cross(E, D)
    n = scaled(line.by_place[j] * dot(m, vector(line.kappa[j])), vector(line.n_0[j]))
    return dot(E, D), n, m, scaled(-1.0, m)


@inner
def line_turn_rates(model, work, k, a, b):
    """Return the rates of LINE_TURN."""
    rows = model.rows
    line, j = work.lines, model.markers.line[a]
    E, D = direction(work.markers, a, rows.x[k]), direction(work.markers, b, rows.y[k])
    m, kappa, s_dot = cross(E, D), vector(line.kappa[j]), line.s_dot[j]
    rate, second, _ = place_rates(model, work, a)
    o = add(vector(work.markers.omega[a]), scaled(s_dot, kappa))
    E_dot = cross(o, E)
    turning = second * dot(m, kappa) + dot(m, vector(line.turning[j]))
    _, _, beta = dot_rates((E, E_dot, cross(o, E_dot)), rates_of(of_b(rows.y[k]), work.markers, a, b))
    return rate * dot(m, kappa), turning + beta


@inner
def free_moment(model, work, a):
    """Return the tangent n_0, and kappa/|r'| if the joint transmits a moment, else zero."""
    j, line = model.markers.line[a], work.lines
    f = 1.0 / line.slope[j] if model.markers.moment[a] >= 0 else 0.0
    return vector(line.n_0[j]), scaled(f, vector(line.kappa[j]))


@inner
def line_free_value(model, work, k, a, b, w):
    """Return the value of LINE_FREE: n_0 · F + kappa · M / |r'|."""
    n_0, m = free_moment(model, work, a)
    total = dot(n_0, vector(w))
    if model.markers.moment[a] >= 0:
        total += dot(m, vector(w[MOMENT:]))
    return total


@inner
def line_free_derivatives(model, work, k, a, b, w, c_k, by, V):
    """Write the derivatives of LINE_FREE."""
    n_0, m = free_moment(model, work, a)
    put(V, FORCE, n_0)
    turn = cross(n_0, vector(w))
    if model.markers.moment[a] >= 0:
        put(V, MOMENT, m)
        turn = add(turn, cross(m, vector(w[MOMENT:])))
    put(by.a, 3, scaled(c_k, turn))
