"""What an element is: markers, and a law that gives wrenches, rates of states and what is held from their motion.

The function of a law, with n markers, n_z states and n_lam multipliers,

    function(t, x, z, lam, data, wrench, z_dot, g, seen)

reads the time, x (n, 18), each marker's position (3), axes (9, row by row: A[i, j] = x[3 + 3 i + j], the columns are
its axes), velocity (3) and angular velocity (3), all in ground axes, the states z, the multipliers lam and the numbers
`data` of the element. It writes wrench (n, 6), force and moment about the marker's origin on the body of each marker,
ground axes; z_dot (n_z,); g (n_lam,), which is to be zero; seen (n_outputs,). All that it writes is zero before.

Made by `numba.njit` it runs at the speed of the kernels, a plain Python function slowly. It must depend on its
arguments alone: it is called several times a step, also for motions that are not reached in the end.
"""

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, fields, is_dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from fe_models.foundation.arrays import Array
from fe_models.foundation.copies import frozen_copies
from fe_models.foundation.units import Units
from floatframe.bodies.markers import Marker
from floatframe.checked_values import array_of_shape, number
from floatframe.errors import ModelError
from floatframe.joints.rows import NOTHING, POSITION, VELOCITY
from floatframe.shapes.drawn import Arrow, Drawn, Stretched

__all__ = [
    "ACTS", "NOTHING", "POSITION", "TANGENTS", "VELOCITY", "Element", "ElementLaw", "GapSpring", "Placed", "markers_of",
]  # fmt: skip

TANGENTS = ("differences", "complex")
ACTS = {"wrench": (0, 1, 2, 3, 4, 5), "force": (0, 1, 2), "moment": (3, 4, 5), "none": ()}  #: parts of a wrench


@dataclass(frozen=True, eq=False)
class Placed:
    """The markers of an element as the bodies are placed, ground axes."""

    r: Array  #: (n, 3) [m]
    A: Array  #: axes as columns, (n, 3, 3)
    on_ground: tuple[bool, ...]  #: of each marker
    units: Units  #: of the system


@dataclass(frozen=True)
class GapSpring:
    """The spring k xⁿ of a contact, x its depth."""

    stiffness: float  #: k [N/mⁿ], of an angle [N m/radⁿ]
    exponent: float = 1.0  #: n

    def __post_init__(self) -> None:
        object.__setattr__(self, "stiffness", number("law: gaps: stiffness", self.stiffness, above=0.0))
        object.__setattr__(self, "exponent", number("law: gaps: exponent", self.exponent, at_least=1.0))


@frozen_copies
@dataclass(frozen=True, eq=False, kw_only=True)
class ElementLaw:
    """What an element brings to the equations of motion; see the module docstring for its function.

    Raises
    ------
    ModelError
        If names, units and starts do not fit together.
    """

    function: Callable[..., None]
    data: Array | Sequence[float] = ()  #: all numbers, tables and grids of the element, flat
    states: Sequence[str] = ()
    start: Sequence[float] = ()  #: values of the states
    state_units: Sequence[str] = ()
    state_sizes: Sequence[float] = ()  #: typical sizes, by which convergence is measured; default: from the values
    multipliers: Sequence[str] = ()  #: unknowns lam with the equations 0 = g
    multiplier_units: Sequence[str] = ()
    multiplier_sizes: Sequence[float] = ()  #: typical sizes of those that hold nothing, as `state_sizes`
    holds: Sequence[int] = ()  #: of each: POSITION, VELOCITY or NOTHING
    held_units: Sequence[str] = ()  #: of g; default "m", or "m/s" of a velocity; "rad" and "1" are measured as angles
    outputs: Sequence[str] = ()  #: what sensors and reports may ask for
    output_units: Sequence[str] = ()
    off: Callable[..., None] | None = None  #: what it does while events have it off; default: nothing
    #: derivatives: "differences" (central), "complex" (a step along the imaginary axis: exact, see
    #: `floatframe.elements.smooth`), or tangent(t, x, z, lam, data, slopes), which writes d(wrench, z_dot, g) by dr,
    #: dphi, dv, domega of each marker (3 each, ground axes), z and lam, into slopes (6 n + n_z + n_lam,
    #: 12 n + n_z + n_lam)
    tangent: Callable[..., None] | str = "differences"
    rest: Callable[..., None] | None = None  #: what statics take instead of `function`; default: the same
    acts: Sequence[str] | None = None  #: on each marker: "wrench" (default), "force", "moment" or "none"
    is_opposite: bool = False  #: of two markers: the force on the second is minus that on the first
    length: float | None = None  #: over which the law changes [m]; default: the size of its smallest body
    #: over which it changes by the time alone and with velocities [s], `math.inf` if the time does not enter; default:
    #: not known
    time: float | None = None
    accelerations: bool = False  #: whether accelerations are inputs
    energy: str | None = None  #: output that is the energy it stores
    power_in: str | None = None  #: output that is the power it gives to the system from outside
    power_lost: str | None = None  #: output that is the power it takes from the system
    #: outputs that end a run where they are above zero after a step, with what is then said
    stops: Mapping[str, str] = field(default_factory=dict)
    knots: Sequence[float] = ()  #: times at which the law jumps, where steps of a run end [s]
    #: outputs at whose zeros the law jumps with its motion. For each of them the engine adds its sign at the end of
    #: `data`: 1 or -1, which stands still in a step; 0 outside of runs, where the law takes the sign of its own value
    switches: Sequence[str] = ()
    #: outputs that are gaps, below zero minus the depth of a contact, with the spring of it: steps become short near it
    gaps: Mapping[str, GapSpring] = field(default_factory=dict)

    def __post_init__(self) -> None:
        if not callable(self.function):
            raise ModelError(f"law: function: expected a callable, got {self.function!r}")
        try:
            data = np.array(self.data, dtype=np.float64).ravel()
        except (TypeError, ValueError):
            raise ModelError(f"law: data: expected numbers, got {self.data!r}") from None
        object.__setattr__(self, "data", array_of_shape("law: data", data, data.shape))
        for names, values in (
            ("states", ("state_units",)),
            ("multipliers", ("multiplier_units",)),
            ("outputs", ("output_units",)),
        ):
            require_names(names, getattr(self, names))
            object.__setattr__(self, names, tuple(getattr(self, names)))
            for key in values:
                given = tuple(getattr(self, key)) or ("",) * len(getattr(self, names))
                require_length(key, given, names, getattr(self, names))
                object.__setattr__(self, key, given)
        start = tuple(self.start) or (0.0,) * len(self.states)
        require_length("start", start, "states", self.states)
        object.__setattr__(self, "start", tuple(number("law: start", each) for each in start))
        for key, names in (("state_sizes", "states"), ("multiplier_sizes", "multipliers")):
            sizes = tuple(getattr(self, key)) or (0.0,) * len(getattr(self, names))
            require_length(key, sizes, names, getattr(self, names))
            object.__setattr__(self, key, tuple(number(f"law: {key}", each, at_least=0.0) for each in sizes))
        self._held()
        if isinstance(self.tangent, str) and self.tangent not in TANGENTS:
            raise ModelError(f"law: tangent: expected a function or one of {', '.join(TANGENTS)}, got {self.tangent!r}")
        if not isinstance(self.tangent, str) and not callable(self.tangent):
            raise ModelError(f"law: tangent: expected a function or one of {', '.join(TANGENTS)}, got {self.tangent!r}")
        for key in ("energy", "power_in", "power_lost"):
            if getattr(self, key) is not None and getattr(self, key) not in self.outputs:
                raise ModelError(f"law: {key}: expected one of its outputs, got {getattr(self, key)!r}")
        for key, spring in self.gaps.items():
            if key not in self.outputs or not isinstance(spring, GapSpring):
                raise ModelError(
                    f"law: gaps: expected names of its outputs with a GapSpring each, got {key!r}: {spring!r}"
                )
        object.__setattr__(self, "switches", tuple(self.switches))
        for key in self.switches:
            if key not in self.outputs:
                raise ModelError(f"law: switches: expected names of its outputs, got {key!r}")
        for key in self.stops:
            if key not in self.outputs:
                raise ModelError(f"law: stops: expected names of its outputs, got {key!r}")
        object.__setattr__(self, "knots", tuple(number("law: knots", each) for each in self.knots))
        if self.length is not None:
            object.__setattr__(self, "length", number("law: length", self.length, above=0.0))
        if self.time is not None and self.time != math.inf:
            object.__setattr__(self, "time", number("law: time", self.time, above=0.0))

    def _held(self) -> None:
        """Check what the multipliers hold."""
        holds = tuple(self.holds) or (POSITION,) * len(self.multipliers)
        require_length("holds", holds, "multipliers", self.multipliers)
        if any(each not in (NOTHING, POSITION, VELOCITY) for each in holds):
            raise ModelError(f"law: holds: expected POSITION, VELOCITY or NOTHING of each multiplier, got {holds}")
        object.__setattr__(self, "holds", holds)
        units = tuple(self.held_units) or tuple("m/s" if each == VELOCITY else "m" for each in holds)
        require_length("held_units", units, "multipliers", self.multipliers)
        object.__setattr__(self, "held_units", units)


def require_names(where: str, names: Sequence[str]) -> None:
    """Raise `ModelError` unless all names are words that differ."""
    if isinstance(names, str) or any(not isinstance(name, str) or not name.strip() for name in names):
        raise ModelError(f"law: {where}: expected names, got {names!r}")
    if len(set(names)) < len(names):
        raise ModelError(f"law: {where}: expected names that differ, got {', '.join(names)}")


def require_length(where: str, values: Sequence[Any], names: str, named: Sequence[str]) -> None:
    """Raise `ModelError` unless there is one value for each name."""
    if len(values) != len(named):
        raise ModelError(f"law: {where}: expected {len(named)}, one for each of its {names}, got {len(values)}")


class Element:
    """The description of an element: frozen dataclasses of users derive from it.

    The fields are the keys of the system file; `name` comes first. Markers are all fields that hold one, or a sequence
    of them, in the order of the fields, unless `markers` says otherwise.
    """

    name: str

    if TYPE_CHECKING:

        @property
        def markers(self) -> Sequence[Marker]:
            """The markers it connects, on bodies or the ground."""

    def law(self, placed: Placed) -> ElementLaw:
        """Return the law of the element between its markers as they are placed."""
        raise ModelError(f"{type(self).__name__}: expected a method law(placed) that returns an ElementLaw")

    def events(self) -> Sequence[Any]:
        """Return the events that the element brings with it, `floatframe.Event` on "NAME.OUTPUT"; none by default.

        What they watch is measured after blocks of steps, in Python; `ElementLaw.stops` costs nothing.
        """
        return ()

    def drawn(self) -> Sequence[Drawn | Stretched | Arrow]:
        """Return what is seen of it in films and pages, fixed to its markers; nothing, unless it says so."""
        return ()


def markers_of(element: Element) -> tuple[Marker, ...]:
    """Return the markers of an element in their order; `ModelError` if there are none."""
    where = f"element {element.name!r}"
    given = getattr(element, "markers", None)
    if given is None:
        given = [marker for each in fields_of(element) for marker in markers_in(each)]
    if isinstance(given, Marker) or not all(isinstance(each, Marker) for each in given) or not len(given):
        raise ModelError(f"{where}: markers: expected one Marker at least, got {given!r}")
    return tuple(given)


def fields_of(element: Any) -> list[Any]:
    """Return the values of the fields of a dataclass, nothing of another class."""
    return [getattr(element, each.name) for each in fields(element)] if is_dataclass(element) else []


def markers_in(value: Any) -> list[Marker]:
    """Return a marker, or those of a sequence that holds nothing else."""
    if isinstance(value, Marker):
        return [value]
    is_list = isinstance(value, list | tuple) and all(isinstance(one, Marker) for one in value)
    return list(value) if is_list else []
