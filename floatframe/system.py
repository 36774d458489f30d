"""A system: bodies, joints and forces in one coherent set of units."""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from typing import TYPE_CHECKING

from cms.units import Units, unit_system
from cms.words import nearest
from floatframe.couplers import CoordinateCoupler
from floatframe.errors import ModelError
from floatframe.flexible_body import FlexibleBody
from floatframe.forces import Force, Gravity
from floatframe.ground import GROUND
from floatframe.joints import Joint
from floatframe.rigid_body import RigidBody

if TYPE_CHECKING:
    from floatframe.analyses.channels import AnyChannel
    from floatframe.compiled import CompiledSystem
    from floatframe.events import Event
    from floatframe.measuring import Sensor

__all__ = ["Body", "System"]

Body = RigidBody | FlexibleBody
REDUNDANT = ("refuse", "minimum-norm")


@dataclass(frozen=True, eq=False)
class System:
    """Bodies, the joints between them and the forces on them.

    Raises
    ------
    ModelError
        If there is no body, a name is missing or used twice, a flexible body was made in other units, or (when the
        system is first compiled) a joint or force names a body, interface or place that does not exist.
    """

    bodies: Sequence[Body]
    joints: Sequence[Joint] = ()  #: couplers given among them are moved to `couplers`
    forces: Sequence[Force] = ()
    units: Units = field(default_factory=lambda: unit_system("m-kg-s"))
    name: str = "system"
    #: constraints that repeat others: "refuse" them by name, or share their reactions ("minimum-norm")
    redundant: str = "refuse"
    couplers: Sequence[CoordinateCoupler] = ()  #: between coordinates of joints
    sensors: Sequence["Sensor"] = field(default=(), kw_only=True)  #: what is measured on its motions
    inputs: Sequence["AnyChannel"] = field(default=(), kw_only=True)  #: forces that act on it when it is linearised
    outputs: Sequence["AnyChannel"] = field(default=(), kw_only=True)  #: what is then observed
    events: Sequence["Event"] = field(default=(), kw_only=True)  #: what a run does when a value passes a level
    source: str = field(default="", kw_only=True)  #: path of the system file, for the record; "": made in Python

    def __post_init__(self) -> None:
        for part in ("bodies", "joints", "forces", "couplers", "sensors", "inputs", "outputs", "events"):
            object.__setattr__(self, part, tuple(getattr(self, part)))
        among = tuple(joint for joint in self.joints if isinstance(joint, CoordinateCoupler))
        object.__setattr__(self, "couplers", (*self.couplers, *among))
        object.__setattr__(self, "joints", tuple(joint for joint in self.joints if joint not in among))
        where = f"system {self.name!r}"
        if self.redundant not in REDUNDANT:
            raise ModelError(f"{where}: redundant: expected one of {', '.join(REDUNDANT)}, got {self.redundant!r}")
        if not self.bodies:
            raise ModelError(f"{where}: expected at least one body, got none")
        require_names(f"{where}: bodies", [body.name for body in self.bodies], taken=(GROUND.name,))
        named = [force.name for force in self.forces if not isinstance(force, Gravity)]
        require_names(f"{where}: joints and forces", [joint.name for joint in (*self.joints, *self.couplers)] + named)
        for kind in ("sensors", "inputs", "outputs", "events"):
            require_names(f"{where}: {kind}", [each.name for each in getattr(self, kind)])
        for body in self.bodies:
            if isinstance(body, FlexibleBody) and body.reduced.units != self.units:
                raise ModelError(
                    f"{where}: flexible body {body.name!r} is in units {body.reduced.units.name!r}, but "
                    f"the system in {self.units.name!r}; give the system the units of the body, or read the body in "
                    f"those of the system: cms.read(file, units={self.units.name!r})"
                )

    @cached_property
    def compiled(self) -> "CompiledSystem":
        """The system as flat arrays; made once."""
        from floatframe.compiled import compile_system

        return compile_system(self)

    def body(self, name: str) -> Body:
        """Return the body of that name; `ModelError` with the choices if there is none."""
        for body in self.bodies:
            if body.name == name:
                return body
        choices = [body.name for body in self.bodies]
        raise ModelError(f"system {self.name!r}: no body {name!r}{nearest(name, choices)}")


def require_names(where: str, names: Iterable[str], *, taken: Iterable[str] = ()) -> None:
    """Raise `ModelError` unless every name is a word, used once, and can name a group in a results file."""
    seen = set(taken)
    for name in names:
        if not isinstance(name, str) or not name.strip() or "/" in name or name in (".", ".."):
            raise ModelError(f"{where}: expected a name without '/', got {name!r}")
        if name in seen:
            raise ModelError(f"{where}: the name {name!r} is used twice, or reserved; give each its own")
        seen.add(name)
