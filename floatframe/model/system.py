"""A system: bodies, joints and forces in one coherent set of units."""

from collections.abc import Callable, Container, Iterable, Mapping, Sequence
from dataclasses import dataclass, field, fields, is_dataclass, replace
from functools import cached_property
from typing import Annotated, Any, Protocol, TypeVar, cast

from fe_models.foundation.presentation import Summary, listed, presented
from fe_models.foundation.records import Takes, checked_fields, frozen_copies
from fe_models.foundation.units import Quantity, Units, unit_system
from fe_models.foundation.words import nearest, quoted
from floatframe.errors import ModelError
from floatframe.model.bodies.flexible_body import FlexibleBody
from floatframe.model.bodies.ground import GROUND
from floatframe.model.bodies.markers import Marker
from floatframe.model.bodies.rigid_body import RigidBody
from floatframe.model.controller import Controller
from floatframe.model.elements.element import Element
from floatframe.model.forces import Force, Gravity
from floatframe.model.joints import Joint
from floatframe.model.joints.coordinate_coupler import CoordinateCoupler
from floatframe.model.shapes.shape import Geometry, Shape, shape_tuple

__all__ = ["Body", "Named", "System", "in_units_of"]

T = TypeVar("T")


# default units --------------------------------------------------------------------------------------------------------
# Conversion of the default values of joints, forces and elements to the units of a system; user values are kept.


def in_units_of(units: Units, part: Any) -> Any:
    """Return a part of a system (a dataclass) whose defaults, also in nested parts, are in the units of the system."""
    of_angle = bool(getattr(part, "is_angular", False))
    changed = {}
    for each in fields(part):
        value = getattr(part, each.name)
        found = value.in_units(units, of_angle=of_angle) if isinstance(value, Quantity) else held_in_units(units, value)
        if found is not value:
            changed[each.name] = found
    return replace(part, **changed) if changed else part


def held_in_units(units: Units, value: Any) -> Any:
    """Return a field value whose defaults are in units of the system; a value without defaults is unchanged."""
    if isinstance(value, Marker):
        return value
    if is_dataclass(value) and not isinstance(value, type):
        return in_units_of(units, value)
    if isinstance(value, list | tuple) and any(is_dataclass(each) for each in value):
        items = [held_in_units(units, each) for each in value]
        return type(value)(items) if any(a is not b for a, b in zip(items, value, strict=True)) else value
    if isinstance(value, Mapping) and any(is_dataclass(each) for each in value.values()):
        held = {key: held_in_units(units, each) for key, each in value.items()}
        return held if any(held[key] is not each for key, each in value.items()) else value
    return value


# system ---------------------------------------------------------------------------------------------------------------


Body = RigidBody | FlexibleBody
REDUNDANT = ("refuse", "minimum-norm")


class Named(Protocol):
    """A sensor, channel or event that a system carries for measurement, linearisation or a run."""

    @property
    def name(self) -> str:
        """Unique name of the object."""


@presented
@frozen_copies
@dataclass(frozen=True, eq=False)
@checked_fields(ModelError)
class System:
    """Bodies with joints and forces between them.

    Parameters
    ----------
    bodies
        Bodies of the system, without the ground.
    joints
        Joints; couplers among them are moved to `couplers`.
    forces
        Forces, springs and loads.
    units
        Unit system of all numbers of the system.
    name
        Name of the system.
    redundant
        Redundant constraints: "refuse" rejects them with their names, "minimum-norm" distributes their reactions.
    couplers
        Couplers between coordinates of joints.
    elements
        Public elements, see `floatframe.model.elements`.
    sensors
        Quantities measured on motions of the system.
    inputs
        Forces that act as inputs when the system is linearised.
    outputs
        Observed quantities of the linearised system.
    events
        Actions of a run when a value passes a level.
    fmus
        FMUs of other programs, see `co_simulate`.
    controllers
        Sampled controllers (`Controller`), which act in runs; other analyses see the system without them.
    scene
        Surroundings: ground, road, track.
    source
        Path of the system file, for the record; "": the system was made in Python.
    data_files
        Paths of base files, signals, tyres, roads and states that were used.
    changes
        Values that replaced those in the system file, by parameter or key path.

    Raises
    ------
    ModelError
        If there is no body; if a name is missing or used twice; if a flexible body is in other units; or if (when the
        system is first compiled) a joint or force names a body, interface or place that does not exist.
    """

    bodies: Sequence[Body]
    joints: Annotated[Sequence[Joint], Takes(Sequence[Joint | CoordinateCoupler])] = ()
    forces: Sequence[Force] = ()
    units: Units = field(default_factory=lambda: unit_system("m-kg-s"))
    name: str = "system"
    redundant: str = "refuse"
    couplers: Sequence[CoordinateCoupler] = ()
    elements: Sequence[Element] = field(default=(), kw_only=True)
    sensors: Sequence[Named] = field(default=(), kw_only=True)
    inputs: Sequence[Named] = field(default=(), kw_only=True)
    outputs: Sequence[Named] = field(default=(), kw_only=True)
    events: Sequence[Named] = field(default=(), kw_only=True)
    fmus: Sequence[Named] = field(default=(), kw_only=True)
    controllers: Sequence[Controller] = field(default=(), kw_only=True)
    scene: Sequence[Shape | Geometry] = field(default=(), kw_only=True)
    source: str = field(default="", kw_only=True)
    data_files: Sequence[str] = field(default=(), kw_only=True)
    changes: Mapping[str, Any] = field(default_factory=dict, kw_only=True)

    def __post_init__(self) -> None:
        for part in (
            "bodies", "joints", "forces", "couplers", "elements", "sensors", "inputs", "outputs", "events", "fmus",
            "controllers", "data_files",
        ):  # fmt: skip
            object.__setattr__(self, part, tuple(getattr(self, part)))
        names = {body.name for body in self.bodies}
        for part in ("joints", "forces"):
            object.__setattr__(self, part, tuple(with_markers(each, names) for each in getattr(self, part)))
        if self.units.name != "m-kg-s":
            for part in ("joints", "forces", "couplers", "elements"):
                known = (in_units_of(self.units, each) if is_dataclass(each) else each for each in getattr(self, part))
                object.__setattr__(self, part, tuple(known))
        among = tuple(joint for joint in self.joints if isinstance(joint, CoordinateCoupler))
        object.__setattr__(self, "couplers", (*self.couplers, *among))
        object.__setattr__(self, "joints", tuple(joint for joint in self.joints if joint not in among))
        where = f"system {self.name!r}"
        object.__setattr__(self, "scene", shape_tuple(f"{where}: scene", self.scene))
        if self.redundant not in REDUNDANT:
            raise ModelError(f"{where}: redundant: expected one of {', '.join(REDUNDANT)}, got {self.redundant!r}")
        if not self.bodies:
            raise ModelError(f"{where}: expected at least one body, got none")
        require_names(f"{where}: bodies", [body.name for body in self.bodies], taken=(GROUND.name,))
        named = [joint.name for joint in self.joints] + [coupler.name for coupler in self.couplers]
        named += [force.name for force in self.forces if not isinstance(force, Gravity)]
        named += [element.name for element in self.elements]
        require_names(f"{where}: joints, forces and elements", named)
        for kind in ("sensors", "inputs", "outputs", "events", "fmus", "controllers"):
            require_names(f"{where}: {kind}", [each.name for each in getattr(self, kind)])
        for body in self.bodies:
            if isinstance(body, FlexibleBody) and body.reduced.units != self.units:
                raise ModelError(
                    f"{where}: flexible body {body.name!r} is in units {body.reduced.units.name!r}, but "
                    f"the system in {self.units.name!r}; give the system the units of the body, or read the body in "
                    f"the units of the system: cms.read(file, units={self.units.name!r})"
                )

    def summary(self) -> Summary:
        """Return the content shown by `repr` and notebooks: bodies with mass and modes, names of all other parts."""
        rows = [("units", self.units.name)]
        kinds = ("joints", "couplers", "forces", "elements", "sensors", "inputs", "outputs", "events", "fmus")
        for kind in (*kinds, "controllers"):
            if names := [getattr(each, "name", type(each).__name__) for each in getattr(self, kind)]:
                rows.append((kind, listed(names)))
        bodies = []
        for body in self.bodies:
            mass, n_q = (body.mass, 0) if isinstance(body, RigidBody) else (body.reduced.moments.m, body.reduced.n_q)
            bodies.append((body.name, f"{mass:.6g}", str(n_q)))
        title = f"System {self.name!r}: {len(bodies)} {'body' if len(bodies) == 1 else 'bodies'}"
        return Summary(title, rows, ("body", f"mass [{self.units.mass_symbol}]", "modes"), bodies)

    @cached_property
    def _derived(self) -> dict[Any, Any]:
        return {}

    def derived(self, make: "Callable[[System], T]") -> "T":
        """Return the result of a function of this system, computed at the first call and kept with the system."""
        if make not in self._derived:
            self._derived[make] = make(self)
        return cast(T, self._derived[make])

    @property
    def files(self) -> tuple[str, ...]:
        """Files of the system: the system file, modal files of bodies, signals, files of elements."""
        sources = [body.source for body in self.bodies if isinstance(body, FlexibleBody)]
        return tuple(source for source in (self.source, *sources, *self.data_files) if source)

    def body(self, name: str) -> Body:
        """Return the body with this name; raise `ModelError` with the known names if it does not exist."""
        for body in self.bodies:
            if body.name == name:
                return body
        choices = [body.name for body in self.bodies]
        raise ModelError(f"system {self.name!r}: no body {quoted(name)}{nearest(name, choices)}")


def with_markers(part: Any, bodies: Container[str]) -> Any:
    """Return a joint or force in which a text "body.interface" that is not the name of a body has become a marker."""
    given = {key: getattr(part, key, None) for key in ("marker_a", "marker_b")}
    texts = {key: text for key, text in given.items() if isinstance(text, str) and "." in text and text not in bodies}
    return replace(part, **{key: Marker.of_name(text) for key, text in texts.items()}) if texts else part


def require_names(where: str, names: Iterable[str], *, taken: Iterable[str] = ()) -> None:
    """Raise `ModelError` unless every name is unique and valid as a group name in a results file."""
    seen = set(taken)
    for name in names:
        if not isinstance(name, str) or not name.strip() or "/" in name or name in (".", ".."):
            raise ModelError(f"{where}: expected a name without '/', got {name!r}")
        if name in seen:
            raise ModelError(f"{where}: the name {name!r} is used twice or reserved; choose another")
        seen.add(name)
