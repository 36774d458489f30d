"""Public elements in the arrays of the kernels: ends and rows of their connections, their functions and data."""

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from fe_models.foundation.arrays import Array
from floatframe.engine.compiling.bodies import integers, offsets
from floatframe.engine.compiling.callbacks import Callback
from floatframe.engine.compiling.callbacks.law_functions import law_callbacks
from floatframe.engine.compiling.callbacks.law_source import digest_of
from floatframe.engine.compiling.connections import Connections, End
from floatframe.engine.compiling.coordinate_elements import LEAST_SIZE
from floatframe.engine.compiling.markers import MarkerData, find_marker, least_size, marker_pose
from floatframe.engine.compiling.time_laws import functions_in, rate_of_functions
from floatframe.engine.kernels.model import ELEMENT, Laws
from floatframe.engine.kernels.records import filled, flat
from floatframe.errors import ModelError
from floatframe.model.elements.element import ACTS, Element, ElementLaw, Placed, markers_of
from floatframe.model.joints.rows import LAW_ANGLE, LAW_LENGTH, LAW_RATE, NO_MOMENT, NOTHING, PART, VELOCITY, Row
from floatframe.model.system import System

__all__ = ["PlacedLaw", "PublicElements", "add_public_elements"]

ANGLES = ("rad", "1", "")  #: units of constrained quantities that are not lengths
WIDTH = 18  #: number of values in the motion of a marker
ACCELERATED = 24  #: number of values in the motion of a marker with accelerations


@dataclass(frozen=True, eq=False)
class PlacedLaw:
    """An element in the assembled system: its law, its markers, and the indices of its unknowns."""

    element: Element
    law: ElementLaw
    connection: int
    states: tuple[int, ...]  #: rows of the values of the states of the element
    multipliers: tuple[int, ...]  #: rows of the multipliers of the element
    markers: tuple[MarkerData, ...]
    head: tuple[int, ...]  #: numbers of markers, states and other inputs, see `compiling.callbacks.law_templates`
    value: Callback  #: C function of the values of the law
    slopes: Callback  #: C function of the derivatives of the law
    rest: tuple[Callback, Callback]  #: the same two functions for the equations in static equilibrium
    length: float = 0.0  #: length over which the law changes
    speed: float = 0.0  #: value of 1 m/s in the units of the system
    time: float = 0.0  #: value of 1 s in the units of the system
    own_time: float = 0.0  #: time scale of the explicit time dependence of the law; infinite: none, 0: unknown

    @property
    def digest(self) -> tuple[int | str | None, ...]:
        """Key of the functions of the law, independent of their addresses."""
        functions = (self.law.function, self.law.tangent, self.law.rest)
        return tuple(digest_of(each) or words_of(each) if callable(each) else each for each in functions)

    @property
    def sizes(self) -> list[float]:
        """Typical sizes of the inputs of the law, see `compiling.callbacks.law_templates`.

        If the law declares no time, the size of velocities is 1 m/s, or the length of the law in a second if less.
        """
        states, multipliers = list(self.law.state_sizes), list(self.law.multiplier_sizes)
        time = self.law.time
        if time is None or math.isinf(time):
            time, speed = self.time, min(self.speed, self.length / self.time)
        else:
            speed = self.length / time
        return [self.length, speed, 1 / time, speed / time, 1 / time**2, *states, *multipliers]

    @property
    def columns_of_marker(self) -> int:
        """Number of derivative columns for each marker: 12, or 18 with accelerations."""
        return self.head[1] - 6

    @property
    def n_out(self) -> int:
        """Number of wrench components, rates of states and constraint equations."""
        return 6 * len(self.markers) + len(self.law.states) + len(self.law.multipliers)


def words_of(function: Callable[..., None]) -> str:
    """Return the name of a function for which no digest exists."""
    return f"{getattr(function, '__module__', '')}.{getattr(function, '__qualname__', '')}"


@dataclass
class PublicElements:
    """Public elements in the order in which they are compiled."""

    placed: list[PlacedLaw] = field(default_factory=list)
    callbacks: list[Callback] = field(default_factory=list)
    addresses: list[tuple[int, int]] = field(default_factory=list)
    heads: list[tuple[int, ...]] = field(default_factory=list)
    sources: list[list[tuple[int, float]]] = field(default_factory=list)
    state0: list[int] = field(default_factory=lambda: [0])
    states: list[dict[str, float]] = field(default_factory=list)

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the elements."""
        return tuple(each.element.name for each in self.placed)

    def give_lengths(self, radii: Array, length: float) -> None:
        """Set the length over which each law changes, if not declared, from radii of gyration of bodies, (n_b,)."""
        for k, each in enumerate(self.placed):
            own = each.law.length or least_size(each.markers, radii) or length
            self.placed[k] = replace(each, length=own)

    def record(self) -> Laws:
        """Return the laws in the arrays of the kernels."""
        laws = [each.law for each in self.placed]
        sources = [each for group in self.sources for each in group]
        equations = [
            (row, size or LEAST_SIZE)
            for each in self.placed
            for row, size, holds in zip(each.multipliers, each.law.multiplier_sizes, each.law.holds, strict=True)
            if holds == NOTHING
        ]

        def number_of(output: str | None, law: ElementLaw) -> int:
            return -1 if output is None else law.outputs.index(output)

        return filled(
            Laws(),
            address=[value for value, _ in self.addresses],
            tangent=[slopes for _, slopes in self.addresses],
            is_costly=[not callable(law.tangent) for law in laws],
            head=self.heads,
            data0=offsets(integers([len(each.law.data) + len(each.sizes) for each in self.placed])),
            data=flat([np.concatenate([each.law.data, each.sizes]) for each in self.placed]),
            row0=offsets(integers([len(group) for group in self.sources])),
            source=[source for source, _ in sources],
            factor=[factor for _, factor in sources],
            state0=self.state0,
            equation=[row for row, _ in equations],
            equation_size=[size for _, size in equations],
            length=[each.length for each in self.placed],
            time=[each.own_time for each in self.placed],
            energy=[number_of(law.energy, law) for law in laws],
            given=[number_of(law.power_in, law) for law in laws],
            lost=[number_of(law.power_lost, law) for law in laws],
            stop0=offsets(integers([len(law.stops) for law in laws])),
            stop=[law.outputs.index(output) for law in laws for output in law.stops],
        )


def add_public_elements(system: System, made: Connections, first_state: int) -> PublicElements:
    """Add the public elements of a system; their states follow those already added."""
    elements = PublicElements(state0=[first_state])
    for element in system.elements:
        add_element(system, made, elements, element)
    return elements


def add_element(system: System, made: Connections, elements: PublicElements, element: Element) -> None:
    """Add an element: rows of its wrenches, then of its states, then of its multipliers."""
    where = f"element {element.name!r}"
    markers = [find_marker(system, f"{where}: marker {k + 1}", m) for k, m in enumerate(markers_of(element))]
    poses = [marker_pose(marker, made.placed, made.n_q) for marker in markers]
    on_ground = tuple(marker.body < 0 for marker in markers)
    r, A = (np.array(each) for each in zip(*poses, strict=True))
    law = law_of(element, Placed(r, A, on_ground, system.units))
    ends, sources = acting_ends(markers, law)
    rows = [Row(PART)] * (len(sources) + 3 * len(law.states)) + [held_row(*each) for each in held(law)]
    first_marker, w0 = made.add(element.name, ELEMENT, ends, rows, has_rates=True)
    if law.accelerations:
        made.accelerated += range(first_marker, first_marker + len(markers))
    states = [w0 + len(sources) + 3 * k for k in range(len(law.states))]
    first = w0 + len(sources) + 3 * len(law.states)
    elements.sources.append(sources)
    for row, start, size in zip(states, law.start, law.state_sizes, strict=True):
        elements.states.append({"row": row, "start": start, "size": size or max(abs(start), LEAST_SIZE)})
    elements.state0.append(elements.state0[-1] + len(states))
    moving = sum(1 << k for k, is_on_ground in enumerate(on_ground) if not is_on_ground)
    sizes = (len(law.states), len(law.multipliers), len(law.outputs), len(law.data))
    elements.heads.append((len(markers), ACCELERATED if law.accelerations else WIDTH, *sizes, moving, 0))
    head = elements.heads[-1]
    value, slopes = law_callbacks(where, law, head)
    rest = (value, slopes)
    if law.rest is not None:
        tangent = "differences" if callable(law.tangent) else law.tangent
        rest = law_callbacks(where, replace(law, function=law.rest, tangent=tangent), head)
        elements.callbacks += rest
    multipliers = tuple(range(first, first + len(law.multipliers)))
    rate = rate_of_functions(functions_in(element, "", False, element, ""))
    own_time = law.time or (1 / rate if rate > 0.0 else 0.0)
    second = 1 / system.units.time
    elements.placed.append(
        PlacedLaw(
            element, law, len(made.sizes) - 1, tuple(states), multipliers, tuple(markers), head, value, slopes, rest,
            speed=1 / (system.units.length * second), time=second, own_time=own_time,
        )
    )  # fmt: skip
    elements.callbacks += [value, slopes]
    elements.addresses.append((value.address, slopes.address))


def law_of(element: Element, placed: Placed) -> ElementLaw:
    """Return the law of an element; any error in its method becomes a `ModelError` with the element's name."""
    where = f"element {element.name!r}"
    try:
        law = element.law(placed)
    except ModelError as error:
        text = str(error)
        raise ModelError(text if text.startswith(where) else f"{where}: {text}") from error
    except Exception as error:
        raise ModelError(f"{where}: its law raised {type(error).__name__}: {error}") from error
    if not isinstance(law, ElementLaw):
        raise ModelError(f"{where}: law: expected an ElementLaw, got {law!r}")
    n = len(placed.on_ground)
    if n > 62:
        raise ModelError(f"{where}: expected at most 62 markers, got {n}")
    if all(placed.on_ground):
        raise ModelError(f"{where}: all its markers are on the ground, where nothing moves; expected one on a body")
    acts = ("wrench",) * n if law.acts is None else tuple(law.acts)
    if len(acts) != n or any(each not in ACTS for each in acts):
        raise ModelError(f"{where}: acts: expected one of {', '.join(ACTS)} for each of {n} markers, got {acts}")
    if law.is_opposite and (n != 2 or (acts[0] in ("force", "wrench")) != (acts[1] in ("force", "wrench"))):
        raise ModelError(f"{where}: is_opposite: expected two markers with a force each, got {n} with {acts}")
    return replace(law, acts=acts, data=np.concatenate([law.data, np.zeros(len(law.switches))]))


def acting_ends(markers: list[MarkerData], law: ElementLaw) -> tuple[list[End], list[tuple[int, float]]]:
    """Return the loaded ends, and the source index and sign of each of their wrench rows."""
    ends: list[End] = []
    sources: list[tuple[int, float]] = []
    is_shared = law.is_opposite and all(marker.body >= 0 for marker in markers)
    assert law.acts is not None  # by `law_of`
    for k, (marker, acts) in enumerate(zip(markers, law.acts, strict=True)):
        sign = -1.0 if is_shared and k == 1 else 1.0
        places = {"force": -1, "moment": NO_MOMENT}
        for part, first in (("force", 0), ("moment", 3)):
            if marker.body < 0 or first not in ACTS[acts]:
                continue
            if is_shared and k == 1 and part == "force":
                places[part] = ends[0].force
                continue
            places[part] = len(sources)
            sources += [(6 * k + first + j, sign) for j in range(3)]
        ends.append(End(marker, sign, places["force"], places["moment"]))
    return ends, sources


def held(law: ElementLaw) -> Sequence[tuple[int, str]]:
    """Return the constrained quantity of each multiplier, with its unit."""
    return list(zip(law.holds, law.held_units, strict=True))


def held_row(holds: int, unit: str) -> Row:
    """Return the row of a multiplier that constrains a quantity with this unit."""
    if holds == NOTHING:
        return Row(PART)
    if holds == VELOCITY:
        return Row(LAW_RATE)
    return Row(LAW_ANGLE if unit in ANGLES else LAW_LENGTH)
