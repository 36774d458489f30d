"""The element interface: markers, and a law that computes wrenches, state rates and constraints from their motion.

The function of a law, with n markers, n_z states and n_lam multipliers,

    function(t, x, z, lam, data, wrench, z_dot, g, outputs)

reads the time t; x, (n, 18), with the position (3), axes (9, row by row: A[i, j] = x[3 + 3 i + j], with the axes as
columns), velocity (3) and angular velocity (3) of each marker, all in ground axes; the states z; the multipliers lam;
and the numbers `data` of the element. It writes wrench, (n, 6), the force and the moment about the marker's origin on
the body of each marker, in ground axes; z_dot, (n_z,); g, (n_lam,), which is to be zero; and outputs,
(n_outputs,). All output arrays are zero before the call.

Compiled with `numba.njit`, the function runs at the speed of the kernels; a Python function is slow. It must depend
only on its arguments, because it is called several times per step, also for motions that are discarded.

Evaluated in `floatframe.engine.kernels.connections.element_law`.
"""

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, fields, is_dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from fe_models.foundation.arrays import Array
from fe_models.foundation.presentation import presented
from fe_models.foundation.records import checked_fields, frozen_copies
from fe_models.foundation.units import Units
from floatframe.errors import ModelError
from floatframe.model.bodies.markers import Marker
from floatframe.model.checked_values import array_of_shape, number
from floatframe.model.joints.rows import NOTHING, POSITION, VELOCITY
from floatframe.model.shapes.drawn import Arrow, MarkerShapes, Stretched

__all__ = [
    "ACTS", "NOTHING", "POSITION", "TANGENTS", "VELOCITY", "Element", "ElementLaw", "GapSpring", "Placed", "markers_of",
]  # fmt: skip

TANGENTS = ("differences", "complex")
#: components that a wrench may have
ACTS = {"wrench": (0, 1, 2, 3, 4, 5), "force": (0, 1, 2), "moment": (3, 4, 5), "none": ()}


@dataclass(frozen=True, eq=False)
class Placed:
    """The markers of an element in the assembled position, ground axes."""

    r: Array  #: positions of the markers, (n, 3) [m]
    A: Array  #: axes as columns, (n, 3, 3)
    on_ground: tuple[bool, ...]  #: whether each marker is on the ground
    units: Units  #: units of the system


@dataclass(frozen=True)
class GapSpring:
    """The contact spring k xⁿ for a penetration depth x."""

    stiffness: float  #: stiffness k [N/mⁿ], for an angle [N m/radⁿ]
    exponent: float = 1.0  #: exponent n of the depth

    def __post_init__(self) -> None:
        object.__setattr__(self, "stiffness", number("law: gaps: stiffness", self.stiffness, above=0.0))
        object.__setattr__(self, "exponent", number("law: gaps: exponent", self.exponent, at_least=1.0))


@presented
@frozen_copies
@dataclass(frozen=True, eq=False, kw_only=True)
@checked_fields(ModelError)
class ElementLaw:
    """The terms of an element in the equations of motion; its function is described in the module docstring.

    Parameters
    ----------
    function
        The compiled function of the law.
    data
        All numbers, tables and grids of the element, in one flat array.
    states
        Names of the states.
    start
        Initial values of the states.
    state_units
        Unit of each state.
    state_sizes
        Typical magnitudes, by which convergence is measured; default: from the values.
    multipliers
        Names of the unknowns lam, with the equations g = 0.
    multiplier_units
        Unit of each multiplier.
    multiplier_sizes
        Typical magnitudes of multipliers that constrain nothing, as for `state_sizes`.
    holds
        The quantity that each multiplier constrains: POSITION, VELOCITY or NOTHING.
    held_units
        Units of g; default "m", or "m/s" for a velocity; "rad" and "1" are treated as angles.
    outputs
        Names of quantities that sensors and reports can read.
    output_units
        Unit of each output.
    off
        Function used while events have switched the element off; default: it does nothing.
    tangent
        Derivatives: "differences" (central), "complex" (a step along the imaginary axis: exact, see
        `floatframe.model.elements.smooth`), or tangent(t, x, z, lam, data, slopes), which writes d(wrench, z_dot, g) by
        dr, dphi, dv, domega of each marker (3 each, ground axes), z and lam, into slopes (6 n + n_z + n_lam, 12 n + n_z
        + n_lam).
    rest
        Function used in statics instead of `function`; default: the same.
    acts
        Load on each marker: "wrench" (default), "force", "moment" or "none".
    is_opposite
        Whether, for two markers, the force on the second is the negative of that on the first.
    length
        Length scale on which the law changes [m]; default: the size of its smallest body.
    time
        Time scale on which it changes with time alone and with velocities [s]; `math.inf` if time does not enter;
        default: unknown.
    accelerations
        Whether accelerations are inputs.
    energy
        Name of the output that is the stored energy.
    power_in
        Name of the output that is the power supplied to the system from outside.
    power_lost
        Name of the output that is the power dissipated.
    stops
        Outputs that end a run if they are above zero after a step, each with the message of the run.
    knots
        Times at which the law jumps, and steps of a run end [s].
    switches
        Outputs at whose zeros the law jumps during the motion. For each, the engine appends a sign to `data`: 1 or -1,
        constant within a step; 0 outside of runs, where the law uses the sign of its own value.
    gaps
        Outputs that are gaps (below zero: minus the depth of a contact), with the contact spring; steps become short
        near it.

    Raises
    ------
    ModelError
        If names, units and initial values are inconsistent.
    """

    function: Callable[..., None]
    data: Array | Sequence[float] = ()
    states: Sequence[str] = ()
    start: Sequence[float] = ()
    state_units: Sequence[str] = ()
    state_sizes: Sequence[float] = ()
    multipliers: Sequence[str] = ()
    multiplier_units: Sequence[str] = ()
    multiplier_sizes: Sequence[float] = ()
    holds: Sequence[int] = ()
    held_units: Sequence[str] = ()
    outputs: Sequence[str] = ()
    output_units: Sequence[str] = ()
    off: Callable[..., None] | None = None
    tangent: Callable[..., None] | str = "differences"
    rest: Callable[..., None] | None = None
    acts: Sequence[str] | None = None
    is_opposite: bool = False
    length: float | None = None
    time: float | None = None
    accelerations: bool = False
    energy: str | None = None
    power_in: str | None = None
    power_lost: str | None = None
    stops: Mapping[str, str] = field(default_factory=dict)
    knots: Sequence[float] = ()
    switches: Sequence[str] = ()
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
        """Check the entries of `holds`."""
        holds = tuple(self.holds) or (POSITION,) * len(self.multipliers)
        require_length("holds", holds, "multipliers", self.multipliers)
        if any(each not in (NOTHING, POSITION, VELOCITY) for each in holds):
            raise ModelError(f"law: holds: expected POSITION, VELOCITY or NOTHING of each multiplier, got {holds}")
        object.__setattr__(self, "holds", holds)
        units = tuple(self.held_units) or tuple("m/s" if each == VELOCITY else "m" for each in holds)
        require_length("held_units", units, "multipliers", self.multipliers)
        object.__setattr__(self, "held_units", units)


def require_names(where: str, names: Sequence[str]) -> None:
    """Raise `ModelError` unless all names are distinct words."""
    if isinstance(names, str) or any(not isinstance(name, str) or not name.strip() for name in names):
        raise ModelError(f"law: {where}: expected names, got {names!r}")
    if len(set(names)) < len(names):
        raise ModelError(f"law: {where}: expected names that differ, got {', '.join(names)}")


def require_length(where: str, values: Sequence[Any], names: str, named: Sequence[str]) -> None:
    """Raise `ModelError` unless there is one value for each name."""
    if len(values) != len(named):
        raise ModelError(f"law: {where}: expected {len(named)}, one for each of its {names}, got {len(values)}")


class Element:
    """Base class of elements, from which users derive frozen dataclasses.

    The fields are the keys of the system file; `name` comes first. The markers are all fields that contain a marker or
    a sequence of markers, in the order of the fields, unless `markers` is overridden.
    """

    name: str

    if TYPE_CHECKING:

        @property
        def markers(self) -> Sequence[Marker]:
            """The markers that the element connects, on bodies or the ground."""

    def law(self, placed: Placed) -> ElementLaw:
        """Return the law of the element for markers in the assembled position."""
        raise ModelError(f"{type(self).__name__}: expected a method law(placed) that returns an ElementLaw")

    def events(self) -> Sequence[Any]:
        """Return events of the element, as `floatframe.simulation.Event` on "NAME.OUTPUT"; by default none.

        Events are evaluated after blocks of steps, in Python; `ElementLaw.stops` has no such cost.
        """
        return ()

    def small_angles(self) -> Callable[[Array], Array] | None:
        """Return a function of motion that measures how far the angles exceed the range of small angles.

        By default none: any size is allowed.

        The function takes the axes of the markers in ground axes, (n_t, n, 3, 3), and returns the relative difference
        between an angle and its approximation in the law, (n_t,).
        """
        return None

    def drawn(self) -> Sequence[MarkerShapes | Stretched | Arrow]:
        """Return the shapes, fixed to markers, with which films and pages draw the element; by default none."""
        return ()


def markers_of(element: Element) -> tuple[Marker, ...]:
    """Return the markers of an element, in order; `ModelError` if there are none."""
    where = f"element {element.name!r}"
    given = getattr(element, "markers", None)
    if given is None:
        given = [marker for each in fields_of(element) for marker in markers_in(each)]
    if isinstance(given, Marker) or not all(isinstance(each, Marker) for each in given) or not len(given):
        raise ModelError(f"{where}: markers: expected one Marker at least, got {given!r}")
    return tuple(given)


def fields_of(element: Any) -> list[Any]:
    """Return the values of the fields of a dataclass; an empty list for other classes."""
    return [getattr(element, each.name) for each in fields(element)] if is_dataclass(element) else []


def markers_in(value: Any) -> list[Marker]:
    """Return a marker, or a sequence of only markers, as a list; an empty list for other values."""
    if isinstance(value, Marker):
        return [value]
    is_list = isinstance(value, list | tuple) and all(isinstance(one, Marker) for one in value)
    return list(value) if is_list else []
