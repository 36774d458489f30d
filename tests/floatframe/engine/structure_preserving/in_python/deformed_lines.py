"""A point that slides along the deformed line of a body over a step, see kernels/joints/deformed_line.py.

Formulas: `floatframe.engine.structure_preserving.kernels.deformed_lines`.
"""

from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from fe_models.foundation.arrays import Array
from floatframe.engine.kernels.model import Model
from floatframe.model.joints.rows import LINE_TURN
from floatframe.model.rotations import cross, dot, rotated, rotation_exp
from tests.floatframe.engine.structure_preserving.in_python.bodies import BodyStep
from tests.floatframe.engine.structure_preserving.in_python.constraints import Loads, Pair, Span, add_product
from tests.floatframe.engine.structure_preserving.in_python.coordinates import add_pair
from tests.floatframe.engine.structure_preserving.in_python.functions import value_of
from tests.floatframe.engine.structure_preserving.in_python.markers import BodyMarker, MarkerStep, mean_jacobian

MOST, CLOSE = 30, 1e-14
GAUSS = (0.5 - 0.5 / np.sqrt(3.0), 0.5 + 0.5 / np.sqrt(3.0))  #: exact to degree three


@dataclass(frozen=True, eq=False)
class DeformedLine:
    """Constants of a line."""

    stations: tuple[BodyMarker, ...]
    s: Array  #: their places, (n_stations,)
    e: Array  #: direction of the line, body axes
    position: Array  #: of s = 0
    row: int  #: row with the prescribed place, -1 for none


@dataclass(frozen=True, eq=False)
class Slide:
    """The motion of the sliding marker along the line over a step."""

    line: DeformedLine
    t: Array  #: displacement by s, ground axes, (..., 3)
    kappa: Array  #: rotation of the axes by s, body axes, (..., 3)
    tangent: Array  #: r' at the end of the step, ground axes


def deformed_line(model: Model, markers: tuple[BodyMarker, ...], k: int) -> DeformedLine:
    """Return the constants of line k."""
    own = slice(int(model.lines.station0[k]), int(model.lines.station0[k + 1]))
    stations = tuple(markers[int(m)] for m in model.stations.marker[own])
    position = model.markers.position[int(model.lines.marker[k])]
    return DeformedLine(stations, model.stations.s[own], model.lines.axis[k], position, int(model.lines.row[k]))


def functions(line: DeformedLine, s: Array, order: int) -> tuple[Array, Array, Array]:
    """Return a_j, b_j and l_j of all stations at a place, or their derivatives by s, (..., n_stations)."""
    shape = (*np.shape(s), len(line.s))
    a, b, linear = (np.zeros(shape, np.result_type(s, float)) for _ in range(3))
    j = min(max(int(np.searchsorted(line.s, np.real(s).flat[0])) - 1, 0), len(line.s) - 2)
    h = line.s[j + 1] - line.s[j]
    x = (s - line.s[j]) / h
    if np.real(x).flat[0] < 0 or np.real(x).flat[0] > 1:  # beyond its ends the line is straight
        end = j + 1 if np.real(x).flat[0] > 1 else j
        a[..., end] = 1.0 if order == 0 else 0.0
        b[..., end] = (s - line.s[end], 1.0, 0.0)[order]
        linear[..., end] = 1.0 if order == 0 else 0.0
        return a, b, linear
    second = (x * x * (3 - 2 * x), 6 * x * (1 - x) / h, (6 - 12 * x) / h**2)[order]
    a[..., j], a[..., j + 1] = (1.0 if order == 0 else 0.0) - second, second
    b[..., j] = (h * x * (1 - x) ** 2, 1 + x * (3 * x - 4), (6 * x - 4) / h)[order]
    b[..., j + 1] = (h * x * x * (x - 1), x * (3 * x - 2), (6 * x - 2) / h)[order]
    weight = (x, 1 / h, 0.0)[order]
    linear[..., j], linear[..., j + 1] = (1.0 if order == 0 else 0.0) - weight, weight
    return a, b, linear


def means(line: DeformedLine, s_0: Array, s_1: Array, order: int) -> tuple[Array, Array, Array]:
    """Return the means over the path from s_0 to s_1 of the derivatives of a_j, b_j and l_j, of order 1 or 2.

    Gauss' rule with two points between the stations that are passed.
    """
    way, first = s_1 - s_0, np.real(s_0).flat[0]
    last = np.real(s_1).flat[0]
    passed = [s for s in line.s if min(first, last) < s < max(first, last)]
    parts = sorted([(s - s_0) / way for s in passed], key=lambda part: np.real(part).flat[0])
    borders = [0.0 * way, *parts, 1.0 + 0.0 * way]
    total: list[Array | float] = [0.0, 0.0, 0.0]
    for begin, end in pairwise(borders):
        for x in GAUSS:
            values = functions(line, s_0 + (begin + x * (end - begin)) * way, order)
            total = [each + 0.5 * (end - begin)[..., None] * value for each, value in zip(total, values, strict=True)]
    return tuple(np.asarray(each) for each in total)  # type: ignore[return-value]


def combined(e: Array, a: Array, b: Array, d: Array, th: Array) -> Array:
    """Return Σ a_j d_j + b_j th_j × e of values of the stations, (..., n_stations, 3)."""
    return (a[..., None] * d).sum(axis=-2) + cross((b[..., None] * th).sum(axis=-2), e)


def place_of(line: DeformedLine, s: Array, x: Array, d: Array, th: Array) -> Array:
    """Return the place nearest to a point x relative to s = 0, body axes, starting from a nearby place s."""
    length = line.s[-1]
    is_close = False
    for _ in range(MOST):
        D, D_1, D_2 = (combined(line.e, *functions(line, s, order)[:2], d, th) for order in range(3))
        tangent, gap = line.e + D_1, x - s[..., None] * line.e - D
        change = dot(gap, tangent) / (dot(tangent, tangent) - dot(gap, D_2))
        s = s + change
        if is_close:  # one more iteration, for derivatives along imaginary parts
            break
        is_close = bool((np.abs(np.real(change)) <= CLOSE * length).all())
    return s


def slid(
    model: Model, line: DeformedLine, marker: BodyMarker, step: BodyStep, b: MarkerStep, span: Span
) -> tuple[MarkerStep, Slide]:
    """Return the sliding marker over a step of its body, at its place, and its motion along the line."""
    body = marker.constants
    assert body is not None
    is_still = step.R_0 is step.R_1
    deformed = [[station.shape.deformation(q) for station in line.stations] for q in (step.q_0, step.q_1)]
    (d_0, th_0), (d_1, th_1) = (
        (np.stack([each[..., :3] for each in ends], axis=-2), np.stack([each[..., 3:] for each in ends], axis=-2))
        for ends in deformed
    )
    centers = body.center(step.q_0), body.center(step.q_1)
    places: list[Array] = []
    ends = (step.c_0, step.R_0, b.x_0, d_0, th_0), (step.c_1, step.R_1, b.x_1, d_1, th_1)
    for k, (c, R, x_b, d, th) in enumerate(ends):
        if line.row >= 0:
            t = span.t_force if is_still else (span.t_0, span.t_1)[k]
            places.append(np.array(value_of(model, int(model.rows.motion[line.row]), t)[0]))
            continue
        x = rotated(np.swapaxes(R, -1, -2), x_b - c) + centers[k] - line.position
        places.append(place_of(line, dot(x, line.e), x, d, th))
    s_0, s_1 = places

    def at(s: Array, d: Array, th: Array, center: Array) -> tuple[Array, Array, Array]:
        (a, b_, linear), (a_1, b_1, _) = functions(line, s, 0), functions(line, s, 1)
        sigma = line.position + s[..., None] * line.e + combined(line.e, a, b_, d, th) - center
        slope = combined(line.e, a_1, b_1, d, th)
        twist = dot((linear[..., None] * th).sum(axis=-2), line.e)[..., None] * line.e
        return sigma, cross(line.e, slope) + twist, line.e + slope

    sigma_0, angle_0, _ = at(s_0, d_0, th_0, centers[0])
    sigma_1, angle_1, tangent = at(s_1, d_1, th_1, centers[1])
    q = 0.5 * (step.q_0 + step.q_1)
    Psi_sigma, Psi_r = shapes(line, s_0, s_1, q)
    Psi_sigma = Psi_sigma - body.shapes(q)
    d, th = 0.5 * (d_0 + d_1), 0.5 * (th_0 + th_1)
    a_1, b_1, linear = means(line, s_0, s_1, 1)
    a_2, b_2, _ = means(line, s_0, s_1, 2)
    T = line.e + combined(line.e, a_1, b_1, d, th)
    twist = dot((linear[..., None] * th).sum(axis=-2), line.e)[..., None] * line.e
    T_r = cross(line.e, combined(line.e, a_2, b_2, d, th)) + twist
    arm_0, arm_1 = rotated(step.R_0, sigma_0), rotated(step.R_1, sigma_1)
    lever, Gamma = 0.5 * (arm_0 + arm_1), mean_jacobian(angle_0, angle_1)
    made = MarkerStep(
        marker, step, step.c_0 + arm_0, step.c_1 + arm_1, lever,
        step.d + cross(step.theta_G, lever) + rotated(step.R_m, rotated(Psi_sigma, step.dq)),
        rotation_exp(angle_0), rotation_exp(angle_1), Gamma, rotated(Gamma, rotated(Psi_r, step.dq)), Psi_sigma, Psi_r,
    )  # fmt: skip
    return made, Slide(line, rotated(step.R_m, T), rotated(Gamma, T_r), rotated(step.R_1, tangent))


def shapes(line: DeformedLine, s_0: Array, s_1: Array, q: Array) -> tuple[Array, Array]:
    """Return the derivatives of displacement and rotation by q, (..., 3, n), as means over both places."""
    Psi = np.stack([station.shape.shapes(q) for station in line.stations], axis=-3)  # (..., n_stations, 6, n)
    Psi = np.swapaxes(Psi, -1, -3)  # (..., n, 6, n_stations)
    d, th = np.swapaxes(Psi[..., :3, :], -1, -2), np.swapaxes(Psi[..., 3:, :], -1, -2)  # (..., n, n_stations, 3)
    by_q, turning = [], []
    for s in (s_0, s_1):
        (a, b, linear), (a_1, b_1, _) = functions(line, s, 0), functions(line, s, 1)
        a, b, linear, a_1, b_1 = (each[..., None, :] for each in (a, b, linear, a_1, b_1))
        by_q.append(combined(line.e, a, b, d, th))
        twist = dot((linear[..., None] * th).sum(axis=-2), line.e)[..., None] * line.e
        turning.append(cross(line.e, combined(line.e, a_1, b_1, d, th)) + twist)
    # type: ignore[return-value]
    return tuple(np.swapaxes(0.5 * (one + other), -1, -2) for one, other in (by_q, turning))


def normals(along: Array, y: Array) -> tuple[Array, Array, Array]:
    """Return the unit vectors along a direction, normal to it nearest to y, and normal to both."""
    n_0 = along / np.sqrt(dot(along, along))[..., None]
    y = y - dot(y, n_0)[..., None] * n_0
    n_1 = y / np.sqrt(dot(y, y))[..., None]
    return n_0, n_1, cross(n_0, n_1)


Y = np.array([0.0, 1.0, 0.0])


def line_value(model: Model, k: int, pair: Pair, slide: Slide) -> Array:
    """Return the value of row k, LINE or LINE_TURN, at the end of a step."""
    a, b = pair
    if int(model.rows.kind[k]) == LINE_TURN:
        return dot(a.ends(model.rows.x[k])[1], b.ends(model.rows.y[k])[1])
    n = normals(slide.tangent, a.ends(Y)[1])[int(model.rows.part[k])]
    return dot(n, b.x_1 - a.x_1)


def turn_by_place(model: Model, k: int, pair: Pair, slide: Slide) -> Array:
    """Return m, the change of E · D by s."""
    a, b = pair
    assert a.step is not None
    D_0, D_1 = b.ends(model.rows.y[k])
    by_s = rotated(a.step.R_m, cross(slide.kappa, a.eps_mean(model.rows.x[k])))
    return dot(0.5 * (D_0 + D_1), by_s)


def add_line_reaction(model: Model, k: int, pair: Pair, loads: Loads, slide: Slide, f: Array) -> None:
    """Add the loads of row k, LINE or LINE_TURN, with multiplier f, (...,)."""
    if int(model.rows.kind[k]) == LINE_TURN:
        add_product(pair, loads, model.rows.x[k], model.rows.y[k], f)
        if slide.line.row < 0:
            m = turn_by_place(model, k, pair, slide)
            add_pair(pair, loads, (f * m / dot(slide.t, slide.t))[..., None] * slide.t)
        return
    E_0, E_1 = pair[0].ends(Y)
    N = normals(slide.t, 0.5 * (E_0 + E_1))[int(model.rows.part[k])]
    add_pair(pair, loads, f[..., None] * N)


def line_rate_in_time(model: Model, k: int, pair: Pair, slide: Slide, t: float) -> float:
    """Return the rate of row k at one configuration without motion: that of the prescribed place."""
    if slide.line.row < 0:
        return 0.0
    rate = value_of(model, int(model.rows.motion[slide.line.row]), t)[1]
    if int(model.rows.kind[k]) == LINE_TURN:
        return float(rate * turn_by_place(model, k, pair, slide))
    along = float(np.sqrt(dot(slide.t, slide.t)))
    return -rate * along if int(model.rows.part[k]) == 0 else 0.0
