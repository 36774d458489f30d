"""Components of a circuit between named nodes, as data without behaviour. Pressures are absolute."""

from dataclasses import dataclass, field
from typing import Any

from fe_models.foundation.arrays import GivenArray, given
from fe_models.foundation.records import checked_fields, frozen_copies
from fe_models.foundation.units import SPEED, Quantity
from floatframe.errors import ModelError
from floatframe.model.bodies.markers import Marker
from floatframe.model.checked_values import number, unit_vector
from floatframe.model.functions.time_functions import TimeFunction, constant

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
    """Check the numbers of a frozen component, including those that may be None; convert numbers to time functions."""
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


@dataclass(frozen=True)
class Node:
    """Properties of a node in addition to its components."""

    volume: float = 0.0  #: dead volume at the node [m³]
    pressure: float | None = None  #: initial absolute pressure [Pa]; None: ambient

    def __post_init__(self) -> None:
        object.__setattr__(self, "volume", number("node: volume", self.volume, at_least=0.0))
        if self.pressure is not None:
            object.__setattr__(self, "pressure", number("node: pressure", self.pressure, above=0.0))


@frozen_copies
@dataclass(frozen=True, eq=False)
@checked_fields(ModelError)
class Cylinder:
    """A cylinder between two markers; head pressure pushes them apart, rod pressure pulls them together.

    A side without a node is open to the ambient pressure (single acting). The stroke is the distance between the
    markers minus `retracted_length`. If the stroke leaves the range 0 .. `stroke` by x, a stop acts with k x (1 + d
    dx/dt).
    """

    name: str
    marker_a: Marker  #: marker on the housing
    marker_b: Marker  #: marker on the rod
    head_area: float  #: piston area on the side of marker a [m²]
    rod_area: float = 0.0  #: ring area of the piston on the side of the rod [m²]
    head: str | None = None  #: node of the head chamber
    rod: str | None = None  #: node of the rod chamber
    stroke: float = field(kw_only=True)  #: largest stroke [m]
    retracted_length: float = field(kw_only=True)  #: distance between the markers at stroke 0 [m]
    head_dead_volume: float = 0.0  #: dead volume of the head chamber, at stroke 0 [m³]
    rod_dead_volume: float = 0.0  #: dead volume of the rod chamber, at full stroke [m³]
    leakage: float = 0.0  #: leakage past the piston, flow divided by pressure difference [m³/(s Pa)]
    friction: float = 0.0  #: friction of the seals [N]
    friction_speed: float = FRICTION_SPEED  #: speed scale v_s of friction v/√(v² + v_s²) [m/s]
    damping: float = 0.0  #: viscous damping [N s/m]
    stop_stiffness: float = 0.0  #: stiffness k of both stops [N/m]; 0: no stops
    stop_damping: float = 0.0  #: damping d of both stops [s/m]

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
            raise ModelError(f"{where}: rod_area: expected a number above 0 for the chamber {self.rod!r}, got 0")
        for side in ("head", "rod"):
            if getattr(self, side) is not None and getattr(self, f"{side}_dead_volume") == 0:
                raise ModelError(
                    f"{where}: {side}_dead_volume: expected a number above 0, got 0: a chamber without volume at the "
                    "end of its stroke is infinitely stiff; 1 % of the swept volume is usual"
                )


@frozen_copies
@dataclass(frozen=True, eq=False)
@checked_fields(ModelError)
class Orifice:
    """An orifice with the flow opening discharge area √(2 Δp/ρ) from node a to b, linear for Δp below `transition`.

    The root is replaced by dp/(dp² + transition²)^(1/4). Their relative difference is 3 % at three times the transition
    and 2.5e-7 at 1000 times.
    """

    name: str
    a: str
    b: str
    area: float  #: cross section of the orifice [m²]
    discharge: float = 0.7
    #: pressure difference below which the flow is laminar [Pa]; None: 1e-3 of the ambient pressure
    transition: float | None = None
    opening: TimeFunction | float | None = None  #: open fraction of the area as a function of time; None: fully open

    def __post_init__(self) -> None:
        checked(self, above=("area", "discharge", "transition"), functions=("opening",))


@dataclass(frozen=True, eq=False)
@checked_fields(ModelError)
class Resistance:
    """A laminar flow conductance Δp from node a to node b, such as through a gap or a porous plug."""

    name: str
    a: str
    b: str
    conductance: float  #: flow divided by pressure difference [m³/(s Pa)]

    def __post_init__(self) -> None:
        checked(self, above=("conductance",))


@dataclass(frozen=True, eq=False)
@checked_fields(ModelError)
class CheckValve:
    """An orifice for flow from node a to node b that begins to open at Δp = `cracking` and is open at `full`."""

    name: str
    a: str
    b: str
    area: float  #: cross section when fully open [m²]
    full: float  #: pressure difference at which the valve is fully open [Pa]
    cracking: float = 0.0  #: pressure difference at which the valve begins to open [Pa]
    discharge: float = 0.7
    transition: float | None = None  #: pressure difference below which the flow is laminar, as for an orifice [Pa]
    leakage: float = 0.0  #: leakage when closed, flow divided by pressure difference [m³/(s Pa)]

    def __post_init__(self) -> None:
        checked(self, above=("area", "full", "discharge", "transition"), at_least=("cracking", "leakage"))
        if self.full <= self.cracking:
            raise ModelError(
                f"component {self.name!r}: full: expected a pressure difference above cracking = {self.cracking:g}, "
                f"got {self.full:g}"
            )


@dataclass(frozen=True, eq=False)
@checked_fields(ModelError)
class ReliefValve(CheckValve):
    """A check valve to the tank, node b, whose `cracking` pressure is the set pressure above that of node b."""


@dataclass(frozen=True, eq=False)
@checked_fields(ModelError)
class Accumulator:
    """A gas volume behind a bladder at a node, polytropic, with volume V_0 at the charge pressure and no oil below it.

    It takes the oil volume V_0 (1 - (charge/p)^(1/n)), up to `oil_limit`. Both corners are rounded over 1 % of their
    pressures.
    """

    name: str
    node: str
    gas_volume: float  #: gas volume V_0 without oil [m³]
    charge: float  #: absolute gas pressure without oil [Pa]
    exponent: float = 1.4  #: polytropic exponent n; 1: isothermal
    oil_limit: float | None = None  #: largest volume of oil [m³]; None: 0.999 of the gas volume

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
@checked_fields(ModelError)
class Pipe:
    """A pipe from node a to node b in equal segments with inertia and friction; each end has half a segment of oil.

    The pressure drop is 8 pi mu l q/A² for laminar flow (Hagen-Poiseuille, if the fluid has a viscosity) plus
    friction_factor l/d ρ q |q|/(2 A²), where d is the diameter of a circle with the area A.
    """

    name: str
    a: str
    b: str
    length: float  #: length of the pipe [m]
    area: float  #: cross section of the pipe [m²]
    segments: int = 1
    friction_factor: float = 0.0  #: Darcy friction factor of turbulent flow
    wall_modulus: float | None = (
        None  #: pressure divided by the relative growth of the area, E t/d for a thin wall [Pa]; None: rigid
    )
    flow: float = 0.0  #: initial flow through the pipe [m³/s]

    def __post_init__(self) -> None:
        checked(self, above=("length", "area", "wall_modulus"), at_least=("friction_factor",))
        object.__setattr__(self, "flow", number(f"component {self.name!r}: flow", self.flow))
        if not isinstance(self.segments, int) or not 1 <= self.segments <= 200:
            raise ModelError(f"component {self.name!r}: segments: expected 1 to 200, got {self.segments!r}")


@frozen_copies
@dataclass(frozen=True, eq=False)
@checked_fields(ModelError)
class Supply:
    """A node with a prescribed pressure, a function of time or a number."""

    name: str
    node: str
    pressure: TimeFunction | float  #: absolute pressure at the node [Pa]

    def __post_init__(self) -> None:
        if not isinstance(self.pressure, TimeFunction):
            number(f"component {self.name!r}: pressure", self.pressure, above=0.0)
        elif (self.pressure.pieces[:, 1:].any(axis=1) == 0).all() and (self.pressure.pieces[:, 0] <= 0).any():
            raise ModelError(
                f"component {self.name!r}: pressure: expected absolute pressures above 0, got zero or less"
            )
        checked(self, functions=("pressure",))


@dataclass(frozen=True, eq=False)
@checked_fields(ModelError)
class Tank:
    """A node at the ambient pressure."""

    name: str
    node: str


@frozen_copies
@dataclass(frozen=True, eq=False)
@checked_fields(ModelError)
class FlowSource:
    """A prescribed flow from node a to node b, a function of time or a number, like that of an ideal pump."""

    name: str
    a: str
    b: str
    flow: TimeFunction | float  #: flow at ambient pressure [m³/s]

    def __post_init__(self) -> None:
        checked(self, functions=("flow",))


@frozen_copies
@dataclass(frozen=True, eq=False)
@checked_fields(ModelError)
class Pump:
    """A pump or motor of displacement D, with flow D omega from node a to b and torque D (p_a - p_b) on marker b.

    omega is the angular velocity of marker b relative to marker a (the housing) about the axis.
    """

    name: str
    a: str
    b: str
    marker_a: Marker  #: marker on the housing
    marker_b: Marker  #: marker on the shaft
    displacement: float  #: displaced volume per radian [m³]
    axis: GivenArray = given((0.0, 0.0, 1.0))  #: in axes of marker a, (3,)
    leakage: float = 0.0  #: leakage from a to b, flow divided by pressure difference [m³/(s Pa)]
    drag: float = 0.0  #: drag torque divided by speed [N m s]

    def __post_init__(self) -> None:
        checked(self, above=("displacement",), at_least=("leakage", "drag"))
        object.__setattr__(self, "axis", unit_vector(f"component {self.name!r}: axis", self.axis))


@frozen_copies
@dataclass(frozen=True, eq=False)
@checked_fields(ModelError)
class DirectionalValve:
    """A 4/3 valve with spool position u in -1 .. 1: u > 0 connects pressure to a and b to tank; u < 0 pressure to b.

    Each path is an orifice whose area is multiplied by (|u| - overlap)/(1 - overlap). The spool follows `opening` or,
    with `follow`, u = gain (opening - stroke of that cylinder), at once or with a time constant.
    """

    name: str
    pressure: str
    tank: str
    a: str
    b: str
    area: float  #: area of each flow path at u = 1 [m²]
    opening: TimeFunction | float = 0.0  #: spool position u as a function of time, or the desired stroke [m]
    time_constant: float = 0.0  #: time constant of the spool [s]; 0: no lag
    follow: str | None = None  #: name of a cylinder whose stroke the valve controls
    gain: float | None = None  #: u divided by the error of the stroke [1/m]
    overlap: float = 0.0  #: fraction of the spool travel without flow
    discharge: float = 0.7
    transition: float | None = None  #: pressure difference below which the flow is laminar, as for an orifice [Pa]
    leakage: float = 0.0  #: leakage of each path, flow divided by pressure difference [m³/(s Pa)]

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
