"""Bushings and contacts in the arrays of the kernels."""

from dataclasses import dataclass, field

from floatframe.engine.compiling.connections import Connections, End
from floatframe.engine.compiling.forces import Functions
from floatframe.engine.compiling.markers import MarkerData, find_marker, marker_pose, marker_with_pose, n_q_of
from floatframe.engine.kernels.model import BUSHING, CONTACT, Bushings, Contacts
from floatframe.engine.kernels.records import filled, of_items
from floatframe.errors import ModelError
from floatframe.model.bodies.markers import Marker, body_name
from floatframe.model.forces import Bushing, SphereContact
from floatframe.model.forces.bushing import AXES, DEFORMATIONS
from floatframe.model.joints.rows import MOMENT, MOMENT_B, PART, Row
from floatframe.model.state import State
from floatframe.model.system import System

__all__ = ["Pairs", "add_pair_laws", "bushing_markers"]


@dataclass
class Pairs:
    """Bushings and contacts in the order in which they are compiled, with their names."""

    names: tuple[str, ...] = ()
    bushings: Bushings = field(default_factory=Bushings)
    contacts: Contacts = field(default_factory=Contacts)


def add_pair_laws(system: System, made: Connections, functions: Functions) -> Pairs:
    """Add bushings, then contacts."""
    pairs = Pairs()
    tables: list[list[int]] = []
    bushings = [force for force in system.forces if isinstance(force, Bushing)]
    contacts = [force for force in system.forces if isinstance(force, SphereContact)]
    for bushing in bushings:
        a, b = bushing_markers(system, bushing, made.placed)
        made.add(bushing.name, BUSHING, ends_of(a, b), [Row(PART)] * 9, has_rates=True)
        tables.append([functions.index(bushing.characteristics.get(name)) for name in DEFORMATIONS])
    for contact in contacts:
        where = f"force {contact.name!r}"
        a = find_marker(system, f"{where}: marker_a", contact.marker_a)
        b = find_marker(system, f"{where}: marker_b", contact.marker_b)
        require_two_bodies(where, a, b)
        made.add(contact.name, CONTACT, ends_of(a, b), [Row(PART, contact.axis)] * 10, has_rates=True)
    pairs.bushings = filled(
        Bushings(),
        stiffness=[bushing.stiffness for bushing in bushings],
        damping=[bushing.damping for bushing in bushings],
        preload=[bushing.preload for bushing in bushings],
        table=tables,
        share=[AXES[bushing.axes] for bushing in bushings],
        angle=[-1] * len(bushings),
    )
    pairs.contacts = of_items(Contacts(), [contact.coefficients for contact in contacts])
    pairs.names = (*(bushing.name for bushing in bushings), *(contact.name for contact in contacts))
    return pairs


def ends_of(a: MarkerData, b: MarkerData) -> tuple[End, End]:
    """Return the ends of a wrench that has a force, a moment on A and a moment on B."""
    return End(a, 1.0, moment=MOMENT), End(b, -1.0, moment=MOMENT_B)


def require_two_bodies(where: str, a: MarkerData, b: MarkerData) -> None:
    """Raise `ModelError` if both markers are on one body."""
    if a.body == b.body:
        raise ModelError(f"{where}: expected markers on two bodies, got both on one body")


def bushing_markers(system: System, bushing: Bushing, placed: State) -> tuple[MarkerData, MarkerData]:
    """Return both markers of a bushing; a body for which none is given gets one with the pose of the other marker."""
    where = f"force {bushing.name!r}"
    given = (bushing.marker_a, bushing.marker_b)
    found = [
        find_marker(system, f"{where}: marker_{end}", marker) if isinstance(marker, Marker) else None
        for end, marker in zip("ab", given, strict=True)
    ]
    for k in (0, 1):
        if found[k] is None:
            other = found[1 - k]
            if other is None:
                raise ModelError(f"{where}: expected a Marker at one end at least, got two bodies; give its position")
            name = body_name(given[k])  # type: ignore[arg-type]
            pose = marker_pose(other, placed, n_q_of(system))
            found[k] = marker_with_pose(system, f"{where}: marker_{'ab'[k]}", name, pose, placed)
    a, b = found
    assert a is not None  # filled above
    assert b is not None
    require_two_bodies(where, a, b)
    return a, b
