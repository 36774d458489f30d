"""The formulas of each kind of row of a joint, by its code: the compiled part of the record `ROW_KINDS`.

A kind that holds something brings `value` and `rates` (held_rows.py), one that says what the wrench is `value` and
`derivatives` (wrench_rows.py). Kernels call them by the code of the row and know nothing else of it.

Described in `floatframe.model.joints.lower_pairs`, `floatframe.model.joints.orientation_joints`,
`floatframe.model.joints.point_joints`.
"""

from collections.abc import Callable, Mapping
from typing import Any, NamedTuple

from floatframe.engine.kernels.compiler.compilation import inner, small
from floatframe.engine.kernels.joints import (
    constant_velocity,
    deformed_line,
    held_rows,
    loaded_rows,
    rolling,
    wrench_rows,
)
from floatframe.engine.kernels.joints.held_rows import product, product_rates
from floatframe.engine.kernels.joints.relative_motion import direction, distance, put_pair
from floatframe.engine.kernels.vector import add, cross, dot, put, scaled, sub, vector
from floatframe.model.joints.rows.kinds import (
    ARM,
    BISECTOR,
    DISTANCE,
    DOT,
    EQUAL_TURN,
    FORCE,
    GAUGE,
    GAUGE_B,
    LINE,
    LINE_FREE,
    LINE_TURN,
    MOMENT,
    MOMENT_B,
    POINT,
    PUSH,
    RIM,
    RIM_HEIGHT,
    ROD,
    ROLL,
    SCREW,
    SLIDE,
    THREAD,
    TURN,
    TURN_B,
    TWIST,
    TWIST_B,
)

__all__ = [
    "HELD",
    "WRENCH",
    "arm_derivatives",
    "arm_value",
    "bisector_derivatives",
    "bisector_value",
    "by_code",
    "equal_turn_rates",
    "equal_turn_value",
    "gauge_b_derivatives",
    "gauge_b_value",
    "gauge_derivatives",
    "gauge_value",
    "held_by_place",
    "held_rates",
    "held_value",
    "rod_derivatives",
    "rod_value",
    "thread_derivatives",
    "thread_value",
    "wrench_derivatives",
    "wrench_value",
]


# one compiled function that calls another by a code: `if code == ...` written from a table ----------------------------


def by_code(name: str, functions: Mapping[int, Callable[..., Any]], arguments: str) -> Callable[..., Any]:
    """Return the inner function name(code, ...) that calls functions[code](...).

    All of them take the arguments named and return the same types; a code that is not in the table is not asked for.
    The name is its own among such functions: the symbols of two of one name and types differ by a number that counts
    what a process has compiled, and an entry from the cache may bring the number of one for the code of another.
    """
    different = list(dict.fromkeys(functions.values()))
    lines = [f"def {name}(code, {arguments}):"]
    for k, function in enumerate(different):
        codes = [code for code, each in functions.items() if each is function]
        if k < len(different) - 1:
            lines.append(f"    if {' or '.join(f'code == {code}' for code in codes)}:")
            lines.append(f"        return f_{k}({arguments})")
        else:
            lines.append(f"    return f_{k}({arguments})")
    names: dict[str, Any] = {f"f_{k}": function for k, function in enumerate(different)}
    exec("\n".join(lines), names)
    return inner(names[name])


# row formulas ---------------------------------------------------------------------------------------------------------


Function = Callable[..., Any]


class Held(NamedTuple):
    """Of a row that holds something."""

    value: Function  #: (model, work, k, a, b) -> g, n, m_a, m_b
    rates: Function  #: (model, work, k, a, b) -> dg/dt, beta
    by_place: Function | None = None  #: of a velocity: (model, work, k, r, a, b, P_a, P_b), its change with places


class Wrench(NamedTuple):
    """Of a row that says what the wrench is."""

    value: Function  #: (model, work, k, a, b, w) -> number
    derivatives: Function  #: (model, work, k, r, a, b, w, c_k, P_a, P_b, V)


LOADED = Wrench(loaded_rows.loaded_value, loaded_rows.loaded_derivatives)
HELD = {
    POINT: Held(held_rows.point_value, held_rows.point_rates),
    DOT: Held(held_rows.angle_value, held_rows.angle_rates),
    TURN: Held(held_rows.turn_value, held_rows.turn_rates),
    TURN_B: Held(held_rows.turn_b_value, held_rows.turn_b_rates),
    SLIDE: Held(held_rows.slide_value, held_rows.slide_rates),
    DISTANCE: Held(held_rows.distance_value, held_rows.distance_rates),
    SCREW: Held(held_rows.screw_value, held_rows.screw_rates),
    RIM_HEIGHT: Held(rolling.height_value, rolling.height_rates),
    ROLL: Held(rolling.roll_value, rolling.roll_rates, rolling.roll_by_place),
    EQUAL_TURN: Held(constant_velocity.equal_turn_value, constant_velocity.equal_turn_rates),
    LINE: Held(deformed_line.line_value, deformed_line.line_rates),
    LINE_TURN: Held(deformed_line.line_turn_value, deformed_line.line_turn_rates),
}
WRENCH = {
    GAUGE: Wrench(wrench_rows.gauge_value, wrench_rows.gauge_derivatives),
    GAUGE_B: Wrench(wrench_rows.gauge_b_value, wrench_rows.gauge_b_derivatives),
    THREAD: Wrench(wrench_rows.thread_value, wrench_rows.thread_derivatives),
    ARM: Wrench(wrench_rows.arm_value, wrench_rows.arm_derivatives),
    ROD: Wrench(wrench_rows.rod_value, wrench_rows.rod_derivatives),
    RIM: Wrench(rolling.rim_value, rolling.rim_derivatives),
    BISECTOR: Wrench(constant_velocity.bisector_value, constant_velocity.bisector_derivatives),
    LINE_FREE: Wrench(deformed_line.line_free_value, deformed_line.line_free_derivatives),
    PUSH: LOADED,
    TWIST: LOADED,
    TWIST_B: LOADED,
}

held_value = by_code("held_value", {code: kind.value for code, kind in HELD.items()}, "model, work, k, a, b")
held_rates = by_code("held_rates", {code: kind.rates for code, kind in HELD.items()}, "model, work, k, a, b")
held_by_place = by_code(
    "held_by_place",
    {code: kind.by_place for code, kind in HELD.items() if kind.by_place is not None},
    "model, work, k, r, a, b, P_a, P_b",
)
wrench_value = by_code("wrench_value", {code: kind.value for code, kind in WRENCH.items()}, "model, work, k, a, b, w")
wrench_derivatives = by_code(
    "wrench_derivatives",
    {code: kind.derivatives for code, kind in WRENCH.items()},
    "model, work, k, r, a, b, w, c_k, P_a, P_b, V",
)


# two shafts that turn equally: rows of the constant-velocity joint ----------------------------------------------------
# With E, Z normal to the shaft of A and to each other, and D, U those directions of B that lay along them when both
# shafts were in line, B is A turned straight from shaft to shaft, about an axis normal to both, if
#
#     EQUAL_TURN   E · U - Z · D = 0          its gradient is along the bisector of the shafts (docs/theory.md §10)
#     BISECTOR     M · (E × (Z_A + Z_B)) = 0  Z_A = A_A z, Z_B = A_B y the shafts: M is along their bisector, for two E
#
# Described in `floatframe.model.joints.orientation_joints`.


@inner
def equal_turn_value(model, work, k, a, b):
    """EQUAL_TURN: E · U - Z · D."""
    rows, markers = model.rows, work.markers
    g_1, zero, m_1, _ = product(direction(markers, a, rows.x[k]), direction(markers, b, rows.u[k]))
    g_2, _, m_2, _ = product(direction(markers, a, rows.z[k]), direction(markers, b, rows.y[k]))
    m = sub(m_1, m_2)
    return g_1 - g_2, zero, m, scaled(-1.0, m)


@inner
def equal_turn_rates(model, work, k, a, b):
    """EQUAL_TURN."""
    rows, markers, zero = model.rows, work.markers, (0.0, 0.0, 0.0)
    o, p = vector(markers.omega[a]), vector(markers.omega[b])
    E, Z, D, U = (
        direction(markers, a, rows.x[k]),
        direction(markers, a, rows.z[k]),
        direction(markers, b, rows.y[k]),
        direction(markers, b, rows.u[k]),
    )
    _, beta_1 = product_rates(o, p, E, zero, zero, U)
    _, beta_2 = product_rates(o, p, Z, zero, zero, D)
    return 0.0, beta_1 - beta_2


@inner
def shafts(rows, markers, k, a, b):
    """Return E, the shaft of A and that of B."""
    return direction(markers, a, rows.x[k]), direction(markers, a, rows.z[k]), direction(markers, b, rows.y[k])


@inner
def bisector_value(model, work, k, a, b, w):
    """BISECTOR: M · (E × (Z_A + Z_B))."""
    rows = model.rows
    E, Z_a, Z_b = shafts(rows, work.markers, k, a, b)
    return dot(vector(w[rows.part[k] :]), cross(E, add(Z_a, Z_b)))


@inner
def bisector_derivatives(model, work, k, r, a, b, w, c_k, P_a, P_b, V):
    """BISECTOR: M · (dphi × E) × S = dphi · (E × (S × M)), M · E × (dphi × Z) = dphi · (Z × (M × E))."""
    rows = model.rows
    part = rows.part[k]
    E, Z_a, Z_b = shafts(rows, work.markers, k, a, b)
    M, S = vector(w[part:]), add(Z_a, Z_b)
    put(V[r], part, cross(E, S))
    across = cross(M, E)
    put(P_a[r], 3, scaled(c_k, add(cross(E, cross(S, M)), cross(Z_a, across))))
    put(P_b[r], 3, scaled(c_k, cross(Z_b, across)))


# rows that say what the wrench of a joint is: none along what is free, its parts on A and B balance -------------------
# A kind is two functions: `value`(model, work, k, a, b, w) with w the wrench of the connection, and
# `derivatives`(model, work, k, r, a, b, w, c_k, P_a, P_b, V), which writes row r of P (times c_k) and V; both are zero
# before. A direction that turns with a marker changes by dphi × E, so that d(E · W) = dphi · (E × W) + E · dW.


@small
def gauge_value(model, work, k, a, b, w):
    """GAUGE: E · part."""
    rows = model.rows
    return dot(direction(work.markers, a, rows.x[k]), vector(w[rows.part[k] :]))


@small
def gauge_derivatives(model, work, k, r, a, b, w, c_k, P_a, P_b, V):
    """GAUGE."""
    rows = model.rows
    part, E = rows.part[k], direction(work.markers, a, rows.x[k])
    put(P_a[r], 3, scaled(c_k, cross(E, vector(w[part:]))))
    put(V[r], part, E)


@inner
def gauge_b_value(model, work, k, a, b, w):
    """GAUGE_B: D · part."""
    rows = model.rows
    return dot(direction(work.markers, b, rows.y[k]), vector(w[rows.part[k] :]))


@inner
def gauge_b_derivatives(model, work, k, r, a, b, w, c_k, P_a, P_b, V):
    """GAUGE_B."""
    rows = model.rows
    part, D = rows.part[k], direction(work.markers, b, rows.y[k])
    put(P_b[r], 3, scaled(c_k, cross(D, vector(w[part:]))))
    put(V[r], part, D)


@inner
def thread_value(model, work, k, a, b, w):
    """THREAD: E · (N + c F)."""
    rows = model.rows
    W = add(vector(w[MOMENT_B:]), scaled(rows.c[k], vector(w)))
    return dot(direction(work.markers, a, rows.x[k]), W)


@inner
def thread_derivatives(model, work, k, r, a, b, w, c_k, P_a, P_b, V):
    """THREAD."""
    rows = model.rows
    c, E = rows.c[k], direction(work.markers, a, rows.x[k])
    W = add(vector(w[MOMENT_B:]), scaled(c, vector(w)))
    put(P_a[r], 3, scaled(c_k, cross(E, W)))
    put(V[r], MOMENT_B, E)
    put(V[r], FORCE, scaled(c, E))


@small
def arm_value(model, work, k, a, b, w):
    """ARM: x · (M - N - d × F), x in ground axes; N is missing where nothing acts on B but the force."""
    M = sub(vector(w[MOMENT:]), cross(distance(work.markers, a, b), vector(w)))
    if len(w) > MOMENT_B:
        M = sub(M, vector(w[MOMENT_B:]))
    return dot(vector(model.rows.x[k]), M)


@small
def arm_derivatives(model, work, k, r, a, b, w, c_k, P_a, P_b, V):
    """ARM: (x × d) · F = d · (F × x)."""
    x, d = vector(model.rows.x[k]), distance(work.markers, a, b)
    put(V[r], FORCE, cross(d, x))
    put(V[r], MOMENT, x)
    if len(w) > MOMENT_B:
        put(V[r], MOMENT_B, scaled(-1.0, x))
    put_pair(P_a, P_b, r, 0, scaled(c_k, cross(vector(w), x)))


@inner
def rod_value(model, work, k, a, b, w):
    """ROD: x · (F - mu d), x in ground axes."""
    return dot(vector(model.rows.x[k]), sub(vector(w), scaled(w[3], distance(work.markers, a, b))))


@inner
def rod_derivatives(model, work, k, r, a, b, w, c_k, P_a, P_b, V):
    """ROD."""
    x = vector(model.rows.x[k])
    put(V[r], FORCE, x)
    V[r, 3] = -dot(x, distance(work.markers, a, b))
    put_pair(P_a, P_b, r, 0, scaled(c_k * w[3], x))
