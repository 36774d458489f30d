"""Laws of elements written a second time, from the text of their classes, with vectors of NumPy.

A `Form` is an element in general position (both markers move and turn, off the origin, every optional number other
than zero), some states, and the closed form of its law. `differences` compares the law with it; a constant of the law
that may be wrong without a difference is not tested.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from types import FunctionType

import numpy as np
from numba.core.registry import CPUDispatcher as Dispatcher
from scipy.spatial.transform import Rotation

from floatframe import Marker
from floatframe.model.elements import Element
from floatframe.model.elements.curves import function_numbers
from floatframe.model.functions.time_functions import TimeFunction
from tests.floatframe.element_laws import evaluate, marker_motion, placed

__all__ = [
    "WAVE",
    "A",
    "B",
    "Form",
    "Pair",
    "State",
    "differences",
    "expected",
    "friction",
    "on_pair",
    "pair",
    "silent_numbers",
]

A, B = Marker("a"), Marker("b")
CLOSE = 1e-9  #: relative difference of a law and its closed form
TIME, EARLY = 0.37, 0.07
AXIS = np.array([0.36, -0.48, 0.8])
#: a jump of value, rate and frequency at t = 0.2, offsets and phases; TIME lies in its second piece
WAVE = np.array([[3.0, 0.4, 0.2, -0.1, 0.3, 0.1, 0.5, 7.0, 0.3], [2.0, -0.3, 0.4, 0.2, -0.5, 0.6, 0.9, 11.0, 0.7]])


@dataclass(frozen=True)
class State:
    """Where the markers are, how they move, and the states of the element by name."""

    x: np.ndarray
    z: Mapping[str, float] = field(default_factory=dict)
    t: float = TIME


@dataclass(frozen=True)
class Form:
    """An element as placed, its states, and its closed form: state -> wrench, rates by name, outputs by name."""

    element: Element
    placed: np.ndarray  #: motion of the markers, of which places and axes count
    states: tuple[State, ...]
    closed: Callable[[State], tuple[np.ndarray, Mapping[str, float], Mapping[str, float]]]
    silent: Mapping[int, str] = field(default_factory=dict)  #: numbers of the data that nothing reads here, and why
    functions: tuple[TimeFunction, ...] = ()  #: whose integrals, which stand beside their pieces, nothing reads here
    is_rest: bool = False  #: whether the law of statics is meant
    places: Callable[[np.ndarray], Sequence[int]] = np.flatnonzero  #: which numbers of the data are doubled

    def law(self):
        """Return the law as placed."""
        return self.element.law(placed(self.placed, (False,) * len(self.placed)))

    @property
    def all_states(self):
        """The states, each at another time too: functions of time have two pieces."""
        return (*self.states, *(replace(state, t=EARLY) for state in self.states))

    @property
    def silent_places(self):
        """The numbers of the data that nothing reads."""
        data, found = np.array(self.law().data), set(self.silent)
        for function in self.functions:
            numbers, n = np.array(function_numbers(function)), len(function.begins)
            windows = np.lib.stride_tricks.sliding_window_view(data, len(numbers))
            for at in np.flatnonzero((windows == numbers).all(axis=1)):
                found |= {int(at) + 1 + n + k for k in range(n) if numbers[1 + n + k] != 0}
        return found


def wave(scale, offset=0.0):
    """Return the function of WAVE times a scale, plus an offset."""
    pieces = scale * WAVE
    pieces[:, 7:] = WAVE[:, 7:]
    pieces[:, 0] += offset
    return TimeFunction(np.array([-0.1, 0.2]), pieces)


def wave_at(scale, t, offset=0.0):
    """Return its value."""
    c, y = (WAVE[1], t - 0.2) if t >= 0.2 else (WAVE[0], t + 0.1)
    return offset + scale * (sum(c[k] * y**k for k in range(6)) + c[6] * np.sin(c[7] * y + c[8]))


@dataclass(frozen=True)
class Pair:
    """Two markers: what a law about an axis of marker a sees of them."""

    x: np.ndarray

    @property
    def axes(self):
        """Axes of a and b, as columns."""
        return self.x[0, 3:12].reshape(3, 3), self.x[1, 3:12].reshape(3, 3)

    @property
    def e(self):
        """AXIS of marker a, in ground axes."""
        return self.axes[0] @ AXIS

    @property
    def line(self):
        """From a to b."""
        return self.x[1, :3] - self.x[0, :3]

    @property
    def turning(self):
        """Angular velocity of b against a about the axis."""
        return self.e @ (self.x[1, 15:] - self.x[0, 15:])

    @property
    def way(self):
        """Distance of b from a along the axis."""
        return self.e @ self.line

    @property
    def sliding(self):
        """Its rate: e · (v_b - v_a - omega_a × line)."""
        return self.e @ (self.x[1, 12:15] - self.x[0, 12:15] - np.cross(self.x[0, 15:], self.line))

    def torque(self, T):
        """Wrenches of a torque about the axis on b, and back on a."""
        wrench = np.zeros((2, 6))
        wrench[1, 3:], wrench[0, 3:] = T * self.e, -T * self.e
        return wrench

    def force(self, f):
        """Wrenches of a force along the axis at b, and back on a at the same place."""
        return self.force_at(f * self.e, self.x[1, :3])

    def force_at(self, f, place):
        """Wrenches of a force on b at a place, and back on a."""
        wrench = np.zeros((2, 6))
        for k, sign in ((1, 1.0), (0, -1.0)):
            wrench[k, :3], wrench[k, 3:] = sign * f, sign * np.cross(place - self.x[k, :3], f)
        return wrench


def pair(seed=0, *, angle=0.0, offset=None, relative=None, start=None):
    """Return the motion of two markers off the origin; b turned by `angle` about AXIS from where `start` has it.

    offset: place of b from a, in axes of a; relative: velocity of b against a there, as a rigid body sees it; spin of
    both and the rest at random.
    """
    rng = np.random.default_rng(seed)
    turns = Rotation.random(2, random_state=seed).as_matrix()
    if start is not None:
        A_a0, A_b0 = Pair(start).axes
        turns[1] = turns[0] @ Rotation.from_rotvec(angle * AXIS).as_matrix() @ A_a0.T @ A_b0
    place, v, omega = rng.normal(size=3) * 40.0, rng.normal(size=(2, 3)), rng.normal(size=(2, 3))
    offset = rng.normal(size=3) if offset is None else np.asarray(offset, float)
    line = turns[0] @ offset
    if relative is not None:
        v[1] = v[0] + np.cross(omega[0], line) + turns[0] @ relative
    return np.array([marker_motion(place, turns[0], v[0], omega[0]),
                     marker_motion(place + line, turns[1], v[1], omega[1])])  # fmt: skip


def on_pair(seeds, z=({},), **options):
    """Return states of pairs: seeds in turn with the states of the element, z."""
    return tuple(State(pair(seed, **options), each) for seed in seeds for each in z)


def friction(level, slow, v):
    """Return dry friction level v/sqrt(v² + slow²)."""
    return level * v / np.hypot(v, slow)


def plain(function):
    """Return a law as a function of Python, whose calls of other laws are not compiled either."""
    function = getattr(function, "py_func", function)
    own = {name: each.py_func for name, each in function.__globals__.items() if isinstance(each, Dispatcher)}
    return FunctionType(function.__code__, function.__globals__ | own)


def expected(form):
    """Return what the closed form says in each state."""
    return [(state, *form.closed(state)) for state in form.all_states]


def differences(form, law, wanted):
    """Yield, for each state, the largest difference of a law with its closed form, of each part's size."""
    function = plain(law.rest if form.is_rest else law.function)
    for state, wanted_wrench, wanted_rates, wanted_seen in wanted:
        z = np.array([state.z[name] for name in law.states])
        with np.errstate(all="ignore"):
            wrench, z_dot, seen = evaluate(law, state.t, state.x, z, function)
        pairs = [(wrench[:, :3], np.asarray(wanted_wrench)[:, :3]), (wrench[:, 3:], np.asarray(wanted_wrench)[:, 3:])]
        pairs += [(z_dot[k], wanted_rates[name]) for k, name in enumerate(law.states)]
        pairs += [(seen[name], value) for name, value in wanted_seen.items()]
        off = [np.abs(found - value).max() / (np.abs(value).max() or 1.0) for found, value in pairs]
        yield max(np.inf if np.isnan(each) else each for each in off)


def silent_numbers(form):
    """Return the places of the numbers of a law that may be twice as large without a difference."""
    law, wanted = form.law(), expected(form)
    found = []
    for k in form.places(law.data):
        if law.data[k] == 0:
            continue
        changed = np.array(law.data)
        changed[k] *= 2.0
        try:
            is_noticed = any(off > 10 * CLOSE for off in differences(form, replace(law, data=changed), wanted))
        except (IndexError, OverflowError, ValueError, ZeroDivisionError):  # a count or a place in the data
            continue
        if not is_noticed:
            found.append(int(k))
    return found
