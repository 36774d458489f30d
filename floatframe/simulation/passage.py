"""Passage of watched values through a level: values for result rows, and the time of passage in a step.

Values come from sensors, or directly from a column of the rows. The time comes from a bracketed secant method with a
good initial guess.
"""

from collections.abc import Callable, Sequence
from math import ceil, floor, isfinite

from fe_models.foundation.arrays import Array
from floatframe.engine.compiling.counted_angles import angle_of
from floatframe.engine.compiling.system import compiled_system
from floatframe.engine.kernels.memory import Rows
from floatframe.model.bodies.rigid_body import RigidBody
from floatframe.model.joints.sliding import SlidingJoint
from floatframe.model.system import System
from floatframe.results.joint_coordinates import as_placed
from floatframe.results.sensors import sensor_and_column
from floatframe.results.sensors.joint_coordinate import JointCoordinate
from floatframe.simulation.events import Event

__all__ = ["MOST_NEIGHBOURS", "direct_values", "expected_passage", "passage"]

MOST_NEIGHBOURS = 3  #: number of values on either side of a passage that determine the first guess
MOST_EVALUATIONS = 200
PATIENCE = 3  #: number of evaluations after which a bracket that has not halved is bisected
ALIKE = 0.01  #: relative difference of two successive slopes below which the slope counts as known
SURE = 0.97  #: factor on the tolerance when the slope is known
EQUAL = 1e-12
POLISHED = 1e-13  #: tolerance of the guess, as a fraction of a step

Values = Callable[[Rows], Array]


def direct_values(system: System, event: Event) -> Values | None:
    """Return the function from result rows to the watched values of an event, (n_times,); None if it needs a sensor.

    The value is a time, or an angle of a joint between rigid bodies, which every run counts. It agrees with the value
    of the sensor to roundoff.
    """
    if event.at is not None:
        return lambda rows: rows.t
    sensor, column = sensor_and_column(system, event.watch)
    if isinstance(sensor, JointCoordinate) and sensor.rate is None and (column or event.column) in ("", "value"):
        return counted_angle_of(system, sensor)
    return None


def counted_angle_of(system: System, sensor: JointCoordinate) -> Values | None:
    """Return the angle of a joint as the run counts it; None if it is not counted."""
    joint = next(each for each in system.joints if each.name == sensor.joint)
    if isinstance(joint, SlidingJoint):
        return None
    ends, own = as_placed(system, joint, sensor.coordinate)
    if own is None or not own.is_angle:
        return None
    if not all(end.body < 0 or isinstance(system.bodies[end.body], RigidBody) for end in ends):
        return None
    angle = angle_of(own, *ends)
    k = next((k for k, known in enumerate(compiled_system(system).angles) if known.is_same(angle)), None)
    return None if k is None else lambda rows: rows.angle[:, k]


def expected_passage(places: Sequence[float], values: Sequence[float]) -> tuple[float, float]:
    """Return the zero in (0, 1) of the polynomial through values at given points, and its slope there.

    Both 0 and 1 are among the points, with values of different signs. The polynomial is found by Newton's divided
    differences, its zero by Newton's method in a bracket.
    """
    n, c = len(places), list(values)
    for j in range(1, n):
        for i in range(n - 1, j - 1, -1):
            c[i] = (c[i] - c[i - 1]) / (places[i] - places[i - j])

    def at(x: float) -> tuple[float, float]:
        value, slope = c[-1], 0.0
        for i in range(n - 2, -1, -1):
            slope = slope * (x - places[i]) + value
            value = value * (x - places[i]) + c[i]
        return value, slope

    begin, end = (values[places.index(place)] for place in (0.0, 1.0))
    low, high, x = 0.0, 1.0, begin / (begin - end)
    for _ in range(MOST_EVALUATIONS):
        value, slope = at(x)
        low, high = (x, high) if value * end < 0.0 else (low, x)
        new = x - value / slope if slope else low
        if not low < new < high:
            new = 0.5 * (low + high)
        done, x = abs(new - x) < POLISHED, new
        if done:
            break
    return x, at(x)[1]


def passage(
    beyond: Callable[[float], float], before: float, after: float, tolerance: float, guess: tuple[float, float]
) -> float:
    """Return the first multiple of the tolerance, at most 1, at which a function is no longer negative.

    (1) Evaluate f = beyond(x) at the multiple x of the tolerance at which the zero is expected. x becomes low or high,
        so that f(low) < 0 <= f(high)
    (2) Return high if low is the multiple just before it. Return it also if f(high) is so small that f is negative one
        multiple earlier, by a slope on which two successive evaluations agree
    (3) The next x is the multiple after x - f/slope, within the bracket, with the slope between the last two points. If
        three evaluations have not halved the bracket, take its middle
    So the result does not depend on the guess, which only saves evaluations. The exception is (2), if the slope changes
    within a few tolerances.

    Parameters
    ----------
    beyond
        The function. It is called at points between 0 and 1, and always at the returned point unless that is 1.
    before, after
        Its values at 0, which is negative, and at 1, which is not negative.
    tolerance
        Largest distance of the returned point from the zero.
    guess
        Expected zero, and the slope there.
    """
    if after <= 0.0:
        return 1.0
    most = ceil(1.0 / tolerance * (1.0 - EQUAL))
    low, high, at_high = 0, most, after
    if not (isfinite(guess[0]) and isfinite(guess[1])):  # values after the event may be NaN
        guess = before / (before - after), after - before
    x, slope = ceil(guess[0] / tolerance), guess[1]
    if not slope > 0.0:
        slope = after - before
    last, widths, is_known = None, [most], False
    for _ in range(MOST_EVALUATIONS):
        if high - low <= 1 or (is_known and at_high < SURE * slope * tolerance):
            break
        x = min(max(x, low + 1), high - 1)
        if len(widths) > PATIENCE and widths[-1] > 0.5 * widths[-1 - PATIENCE]:
            x = (low + high) // 2
        f = beyond(x * tolerance)
        if f < 0.0:
            low = x
        else:
            high, at_high = x, f
        secant = 0.0 if last is None else (f - last[1]) / (x - last[0]) / tolerance
        is_known = high < most and abs(secant - slope) <= ALIKE * slope
        slope = secant if secant > 0.0 else slope
        last = x, f
        widths.append(high - low)
        step = f / slope / tolerance
        x = x - floor(step) if abs(step) < most else 0
    return 1.0 if high == most else high * tolerance
