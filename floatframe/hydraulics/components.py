"""Components of a circuit: plain descriptions between nodes that go by their names. Pressures are absolute."""

from dataclasses import dataclass, field, fields
from typing import Any

from fe_models.foundation.arrays import Array
from fe_models.foundation.copies import frozen_copies
from fe_models.foundation.units import SPEED, Quantity
from floatframe.bodies.markers import Marker
from floatframe.checked_values import number, unit_vector
from floatframe.errors import ModelError
from floatframe.functions.time_functions import TimeFunction, constant

__all__ = [
    "COMPONENTS",
    "Accumulator",
    "CheckValve",
    "Component",
    "Cylinder",
    "DirectionalValve",
    "FlowSource",
    "Node",
    "Orifice",
    "Pipe",
    "Pump",
    "ReliefValve",
    "Resistance",
    "Supply",
    "Tank",
]

FRICTION_SPEED = Quantity(1e-3, SPEED)


def checked(
    component: Any, *, above: tuple[str, ...] = (), at_least: tuple[str, ...] = (), functions: tuple[str, ...] = ()
) -> None:
    """Check numbers of a frozen component, those that may be None included, and make time functions of numbers."""
    where = f"component {component.name!r}"
    for key in (*above, *at_least):
        value = getattr(component, key)
        if value is not None:
            bound = {"above": 0.0} if key in above else {"at_least": 0.0}
            object.__setattr__(component, key, number(f"{where}: {key}", value, **bound))
    for key in functions:
        value = getattr(component, key)
        if value is not None and not isinstance(value, TimeFunction):
            object.__setattr__(component, key, constant(number(f"{where}: {key}", value)))
    for each in fields(component):
        if each.name.startswith("marker") and not isinstance(getattr(component, each.name), Marker):
            raise ModelError(f"{where}: {each.name}: expected a Marker, got {getattr(component, each.name)!r}")


@dataclass(frozen=True)
class Node:
    """What a node has beside its components."""

    volume: float = 0.0  #: dead volume [m³]
    pressure: float | None = None  #: at the start, absolute [Pa]; None: ambient

    def __post_init__(self) -> None:
        object.__setattr__(self, "volume", number("node: volume", self.volume, at_least=0.0))
        if self.pressure is not None:
            object.__setattr__(self, "pressure", number("node: pressure", self.pressure, above=0.0))


@frozen_copies
@dataclass(frozen=True, eq=False)
class Cylinder:
    """A cylinder between two markers: pressure at its head drives them apart, pressure at the rod side together.

    A side without a node is open to the ambient pressure (single acting). The stroke is the distance of the markers
    less `retracted_length`. Stops press with k x (1 + d dx/dt) where the stroke leaves 0 .. `stroke` by x.
    """

    name: str
    marker_a: Marker  #: of the housing
    marker_b: Marker  #: of the rod
    head_area: float  #: of the piston on the side of marker a [m²]
    rod_area: float = 0.0  #: of the ring on the side of the rod [m²]
    head: str | None = None  #: node of the chamber at the head
    rod: str | None = None  #: node of the chamber around the rod
    stroke: float = field(kw_only=True)  #: [m]
    retracted_length: float = field(kw_only=True)  #: distance of the markers at stroke 0 [m]
    head_dead_volume: float = 0.0  #: of the chamber at stroke 0 [m³]
    rod_dead_volume: float = 0.0  #: of the chamber at full stroke [m³]
    leakage: float = 0.0  #: of the piston, flow over pressure difference [m³/(s Pa)]
    friction: float = 0.0  #: of the seals [N]
    friction_speed: float = FRICTION_SPEED  #: v_s in friction v/√(v² + v_s²) [m/s]
    damping: float = 0.0  #: [N s/m]
    stop_stiffness: float = 0.0  #: k of both stops; 0: none [N/m]
    stop_damping: float = 0.0  #: d of both stops [s/m]

    def __post_init__(self) -> None:
        checked(
            self,
            above=("head_area", "stroke", "friction_speed"),
            at_least=(
                "rod_area", "retracted_length", "head_dead_volume", "rod_dead_volume", "leakage", "friction", "damping",
                "stop_stiffness", "stop_damping",
            ),
        )  # fmt: skip
        where = f"component {self.name!r}"
        if self.head is None and self.rod is None:
            raise ModelError(f"{where}: expected a node for head or rod or both, got none")
        if self.rod is not None and self.rod_area == 0:
            raise ModelError(f"{where}: rod_area: expected a number > 0 for the chamber {self.rod!r}, got 0")
        for side in ("head", "rod"):
            if getattr(self, side) is not None and getattr(self, f"{side}_dead_volume") == 0:
                raise ModelError(
                    f"{where}: {side}_dead_volume: expected a number > 0, got 0: a chamber without any volume at the "
                    "end of its stroke is infinitely stiff; 1 % of the swept volume is usual"
                )


@frozen_copies
@dataclass(frozen=True, eq=False)
class Orifice:
    """Flow opening discharge area √(2 Δp/ρ) from node a to node b, linear below the pressure difference `transition`.

    As dp/(dp² + transition²)^(1/4), which is the root to 3 % at three times the transition and to 2.5e-7 at 1000 times.
    """

    name: str
    a: str
    b: str
    area: float  #: [m²]
    discharge: float = 0.7
    transition: float | None = None  #: pressure difference of laminar flow [Pa]; None: 1e-3 of the ambient pressure
    opening: TimeFunction | float | None = None  #: part of the area over time; None: 1

    def __post_init__(self) -> None:
        checked(self, above=("area", "discharge", "transition"), functions=("opening",))


@dataclass(frozen=True, eq=False)
class Resistance:
    """Laminar flow conductance Δp from node a to node b, such as a gap or a porous plug."""

    name: str
    a: str
    b: str
    conductance: float  #: [m³/(s Pa)]

    def __post_init__(self) -> None:
        checked(self, above=("conductance",))


@dataclass(frozen=True, eq=False)
class CheckValve:
    """An orifice that opens for flow from node a to node b, from Δp = `cracking` on, wholly at `full`."""

    name: str
    a: str
    b: str
    area: float  #: when open [m²]
    full: float  #: pressure difference at which it is open [Pa]
    cracking: float = 0.0  #: pressure difference at which it begins to open [Pa]
    discharge: float = 0.7
    transition: float | None = None  #: as of an orifice [Pa]
    leakage: float = 0.0  #: when shut, flow over pressure difference [m³/(s Pa)]

    def __post_init__(self) -> None:
        checked(self, above=("area", "full", "discharge", "transition"), at_least=("cracking", "leakage"))
        if self.full <= self.cracking:
            raise ModelError(
                f"component {self.name!r}: full: expected a pressure difference above cracking = {self.cracking:g}, "
                f"got {self.full:g}"
            )


@dataclass(frozen=True, eq=False)
class ReliefValve(CheckValve):
    """A check valve whose `cracking` pressure is the set pressure over node b, as to the tank."""


@dataclass(frozen=True, eq=False)
class Accumulator:
    """A gas volume behind a bladder at a node: V_0 at the charge, polytropic, without oil below it.

    The oil takes V_0 (1 - (charge/p)^(1/n)) up to `oil_limit`; both corners are rounded over 1 % of their pressures.
    """

    name: str
    node: str
    gas_volume: float  #: V_0 [m³]
    charge: float  #: absolute pressure of the gas without oil [Pa]
    exponent: float = 1.4  #: n; 1: isothermal
    oil_limit: float | None = None  #: most oil [m³]; None: 0.999 of the gas volume

    def __post_init__(self) -> None:
        checked(self, above=("gas_volume", "charge", "exponent", "oil_limit"))
        where, limit = f"component {self.name!r}", self.oil_limit
        if limit is None:
            object.__setattr__(self, "oil_limit", 0.999 * self.gas_volume)
        elif not 0.05 * self.gas_volume <= limit < self.gas_volume:
            raise ModelError(
                f"{where}: oil_limit: expected 0.05 to 1 of gas_volume = {self.gas_volume:g}, got {limit:g}"
            )


@dataclass(frozen=True, eq=False)
class Pipe:
    """A line in equal segments from node a to node b, each with inertia and friction; half a segment's oil at each end.

    Pressure drop of the laminar flow 8 pi mu l q/A² (Hagen-Poiseuille, from the viscosity of the fluid; none without
    it) plus friction_factor l/d ρ q |q|/(2 A²), d the diameter of the circle of that area.
    """

    name: str
    a: str
    b: str
    length: float  #: [m]
    area: float  #: [m²]
    segments: int = 1
    friction_factor: float = 0.0  #: of turbulent flow (Darcy)
    wall_modulus: float | None = (
        None  #: pressure over the relative growth of the area, E t/d of a thin wall [Pa]; None: rigid
    )
    flow: float = 0.0  #: at the start [m³/s]

    def __post_init__(self) -> None:
        checked(self, above=("length", "area", "wall_modulus"), at_least=("friction_factor",))
        object.__setattr__(self, "flow", number(f"component {self.name!r}: flow", self.flow))
        if not isinstance(self.segments, int) or not 1 <= self.segments <= 200:
            raise ModelError(f"component {self.name!r}: segments: expected 1 to 200, got {self.segments!r}")


@frozen_copies
@dataclass(frozen=True, eq=False)
class Supply:
    """A node whose pressure is given, over time or as a number."""

    name: str
    node: str
    pressure: TimeFunction | float  #: absolute [Pa]

    def __post_init__(self) -> None:
        if not isinstance(self.pressure, TimeFunction):
            number(f"component {self.name!r}: pressure", self.pressure, above=0.0)
        elif (self.pressure.pieces[:, 1:].any(axis=1) == 0).all() and (self.pressure.pieces[:, 0] <= 0).any():
            raise ModelError(f"component {self.name!r}: pressure: expected absolute pressures > 0, got one that is not")
        checked(self, functions=("pressure",))


@dataclass(frozen=True, eq=False)
class Tank:
    """A node at the ambient pressure."""

    name: str
    node: str


@frozen_copies
@dataclass(frozen=True, eq=False)
class FlowSource:
    """A flow from node a to node b that is given, over time or as a number: a pump that nothing holds."""

    name: str
    a: str
    b: str
    flow: TimeFunction | float  #: at ambient pressure [m³/s]

    def __post_init__(self) -> None:
        checked(self, functions=("flow",))


@frozen_copies
@dataclass(frozen=True, eq=False)
class Pump:
    """A pump or motor of displacement D: flow D omega from node a to node b, torque D (p_a - p_b) on marker b.

    omega is the angular velocity of marker b against marker a (the housing) about the axis.
    """

    name: str
    a: str
    b: str
    marker_a: Marker  #: of the housing
    marker_b: Marker  #: of the shaft
    displacement: float  #: volume per radian [m³]
    axis: Array = (0.0, 0.0, 1.0)  # type: ignore[assignment]  #: in marker a, (3,)
    leakage: float = 0.0  #: from a to b, flow over pressure difference [m³/(s Pa)]
    drag: float = 0.0  #: torque over speed [N m s]

    def __post_init__(self) -> None:
        checked(self, above=("displacement",), at_least=("leakage", "drag"))
        object.__setattr__(self, "axis", unit_vector(f"component {self.name!r}: axis", self.axis))


@frozen_copies
@dataclass(frozen=True, eq=False)
class DirectionalValve:
    """A 4/3 valve with spool position u in -1 .. 1: pressure to a and b to tank where u > 0, pressure to b where u < 0.

    Each path is an orifice of the area times (|u| - overlap)/(1 - overlap). The spool follows `opening`, or, with
    `follow`, u = gain (opening - stroke of that cylinder), at once or with a time constant.
    """

    name: str
    pressure: str
    tank: str
    a: str
    b: str
    area: float  #: of a path at u = 1 [m²]
    opening: TimeFunction | float = 0.0  #: u over time, or the stroke that is wanted [m]
    time_constant: float = 0.0  #: of the spool; 0: at once [s]
    follow: str | None = None  #: name of a cylinder
    gain: float | None = None  #: u over the error of the stroke [1/m]
    overlap: float = 0.0  #: part of the spool's way without flow
    discharge: float = 0.7
    transition: float | None = None  #: as of an orifice [Pa]
    leakage: float = 0.0  #: of each path [m³/(s Pa)]

    def __post_init__(self) -> None:
        checked(
            self, above=("area", "discharge", "transition"), at_least=("time_constant", "overlap", "leakage"),
            functions=("opening",),
        )  # fmt: skip
        where = f"component {self.name!r}"
        if self.overlap >= 1:
            raise ModelError(f"{where}: overlap: expected a number below 1, got {self.overlap:g}")
        if (self.follow is None) != (self.gain is None):
            raise ModelError(f"{where}: expected follow and gain together, or neither")
        if self.gain is not None:
            object.__setattr__(self, "gain", number(f"{where}: gain", self.gain))


Component = (
    Accumulator
    | CheckValve
    | Cylinder
    | DirectionalValve
    | FlowSource
    | Orifice
    | Pipe
    | Pump
    | Resistance
    | Supply
    | Tank
)

COMPONENTS: dict[str, type[Component]] = {
    "accumulator": Accumulator,
    "check-valve": CheckValve,
    "cylinder": Cylinder,
    "directional-valve": DirectionalValve,
    "flow-source": FlowSource,
    "orifice": Orifice,
    "pipe": Pipe,
    "pump": Pump,
    "relief-valve": ReliefValve,
    "resistance": Resistance,
    "supply": Supply,
    "tank": Tank,
}
