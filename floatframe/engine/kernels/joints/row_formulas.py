"""The formulas of each kind of joint row, by its code: the compiled part of the record `ROW_KINDS`.

A constraint is a product of two vectors or has the functions `value` and `rates` (held_rows.py), a row that defines the
wrench has `value` and `derivatives` (wrench_rows.py). Kernels call them by the code of the row and need to know nothing
else about it.

Described in `floatframe.model.joints.lower_pairs`, `floatframe.model.joints.orientation_joints`,
`floatframe.model.joints.point_joints`.
"""

from collections.abc import Callable, Mapping
from typing import Any, NamedTuple

from floatframe.engine.kernels.compiler.compilation import small
from floatframe.engine.kernels.joints import (
    constant_velocity,
    deformed_line,
    held_rows,
    loaded_rows,
    rolling,
    wrench_rows,
)
from floatframe.engine.kernels.joints.held_rows import gap_of, gradient_of, motion_rate, product_rates, rate_in_time
from floatframe.engine.kernels.joints.relative_motion import rate_along
from floatframe.model.joints.rows.kinds import (
    ARM,
    BISECTOR,
    DISTANCE,
    DOT,
    EQUAL_TURN,
    GAUGE,
    GAUGE_B,
    LINE,
    LINE_FREE,
    LINE_TURN,
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
    "PRODUCTS",
    "WRENCH",
    "by_code",
    "held_by_place",
    "held_gap",
    "held_rate",
    "held_rates",
    "held_value",
    "own_name",
    "row_product",
    "wrench_derivatives",
    "wrench_value",
]


# a compiled function that selects another by a code: `if code == ...` written from a table ----------------------------


def by_code(name: str, functions: Mapping[int, Callable[..., Any]], arguments: str) -> Callable[..., Any]:
    """Return the inlined function name(code, ...) that calls the function with this code.

    All functions take the named arguments and return the same types; only codes of the table may be passed. Each such
    function needs a name of its own: the symbols of two functions with the same name and types differ only by a number
    that counts the compilations of a process, so that cached code could be taken for that of the other function.
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
    names["__name__"] = __name__  # the module is a part of the symbol by which stored code is found
    exec("\n".join(lines), names)
    return small(names[name])


# row formulas ---------------------------------------------------------------------------------------------------------


Function = Callable[..., Any]


class Held(NamedTuple):
    """Functions that evaluate a constraint row."""

    value: Function  #: returns the value, (model, work, k, a, b) -> g, n, m_a, m_b
    rates: Function  #: returns the rates, (model, work, k, a, b) -> dg/dt, beta
    gap: Function  #: returns g alone, with the same arguments
    rate: Function  #: returns the rate of g alone
    #: for velocity constraints: writes derivatives by positions, (model, work, k, a, b, by)
    by_place: Function | None = None


def own_name(function: Function, name: str) -> Function:
    """Return a function under a name of its own, for the reason that `by_code` states."""
    function.__name__ = function.__qualname__ = name
    return small(function)


def product_row(product: Function) -> Held:
    """Return the functions of a kind that is a product, (model, k, t) -> Product, see held_rows.py."""

    def value(model, work, k, a, b):
        one = product(model, k, work.state.time)
        n, m_a, m_b = gradient_of(one, work.markers, a, b)
        return gap_of(one, work.markers, a, b), n, m_a, m_b

    def rates(model, work, k, a, b):
        return product_rates(product(model, k, work.state.time), work.markers, a, b)

    def gap(model, work, k, a, b):
        return gap_of(product(model, k, work.state.time), work.markers, a, b)

    def rate(model, work, k, a, b):
        one, driven = product(model, k, work.state.time), 0.0
        if model.rows.motion[k] >= 0:
            driven = rate_in_time(one, work.markers, a, b)
        return motion_rate(one, work.markers, a, b) + driven

    made = [own_name(each, f"{product.__name__}_{each.__name__}") for each in (value, rates, gap, rate)]
    return Held(*made)


def other_row(value: Function, rates: Function, by_place: Function | None = None) -> Held:
    """Return the functions of a kind from its value and rates."""

    def gap(model, work, k, a, b):
        g, _, _, _ = value(model, work, k, a, b)
        return g

    def rate(model, work, k, a, b):
        _, n, m_a, m_b = value(model, work, k, a, b)
        in_time, _ = rates(model, work, k, a, b)
        return in_time + rate_along(work.markers, a, b, n, m_a, m_b)

    gap, rate = (own_name(each, f"{value.__name__}_{each.__name__}") for each in (gap, rate))
    return Held(value, rates, gap, rate, by_place)


class Wrench(NamedTuple):
    """Functions that evaluate a row which defines part of the wrench."""

    value: Function  #: returns the value, (model, work, k, a, b, w) -> number
    derivatives: Function  #: writes the derivatives, (model, work, k, a, b, w, c_k, by, V)


GAUGES = Wrench(wrench_rows.gauge_value, wrench_rows.gauge_derivatives)
LOADED = Wrench(loaded_rows.loaded_value, loaded_rows.loaded_derivatives)
PRODUCTS = {
    POINT: held_rows.point,
    DOT: held_rows.dot_product,
    TURN: held_rows.turn,
    TURN_B: held_rows.turn_about_b,
    SLIDE: held_rows.slide,
    DISTANCE: held_rows.length,
}
HELD = {code: product_row(product) for code, product in PRODUCTS.items()} | {
    SCREW: other_row(held_rows.screw_value, held_rows.screw_rates),
    RIM_HEIGHT: other_row(rolling.height_value, rolling.height_rates),
    ROLL: other_row(rolling.roll_value, rolling.roll_rates, rolling.roll_by_place),
    EQUAL_TURN: other_row(constant_velocity.equal_turn_value, constant_velocity.equal_turn_rates),
    LINE: other_row(deformed_line.line_value, deformed_line.line_rates),
    LINE_TURN: other_row(deformed_line.line_turn_value, deformed_line.line_turn_rates),
}
WRENCH = {
    GAUGE: GAUGES,
    GAUGE_B: GAUGES,
    THREAD: GAUGES,
    ARM: Wrench(wrench_rows.arm_value, wrench_rows.arm_derivatives),
    ROD: Wrench(wrench_rows.rod_value, wrench_rows.rod_derivatives),
    RIM: Wrench(rolling.rim_value, rolling.rim_derivatives),
    BISECTOR: Wrench(constant_velocity.bisector_value, constant_velocity.bisector_derivatives),
    LINE_FREE: Wrench(deformed_line.line_free_value, deformed_line.line_free_derivatives),
    PUSH: LOADED,
    TWIST: LOADED,
    TWIST_B: LOADED,
}

row_product = by_code("row_product", PRODUCTS, "model, k, t")
held_gap = by_code("held_gap", {code: kind.gap for code, kind in HELD.items()}, "model, work, k, a, b")
held_rate = by_code("held_rate", {code: kind.rate for code, kind in HELD.items()}, "model, work, k, a, b")
held_value = by_code("held_value", {code: kind.value for code, kind in HELD.items()}, "model, work, k, a, b")
held_rates = by_code("held_rates", {code: kind.rates for code, kind in HELD.items()}, "model, work, k, a, b")
held_by_place = by_code(
    "held_by_place",
    {code: kind.by_place for code, kind in HELD.items() if kind.by_place is not None},
    "model, work, k, a, b, by",
)
wrench_value = by_code("wrench_value", {code: kind.value for code, kind in WRENCH.items()}, "model, work, k, a, b, w")
wrench_derivatives = by_code(
    "wrench_derivatives",
    {code: kind.derivatives for code, kind in WRENCH.items()},
    "model, work, k, a, b, w, c_k, by, V",
)
