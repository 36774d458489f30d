"""The elements `rails.wheelset`, two wheels on one axle, and `rails.wheel-on-rail`, one independent wheel."""

import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from fe_models.foundation.records import checked_fields, frozen_copies
from fe_models.foundation.words import quoted
from floatframe.components.rails.assembly import ContactLaws, Wheel, law_numbers, output_names
from floatframe.components.rails.contact_search import Pair, quasi_elastic
from floatframe.components.rails.contact_table import LEAST_BEND
from floatframe.components.rails.hertz import ellipse
from floatframe.components.rails.profile import Profile, profile_of_points
from floatframe.components.rails.standard_profiles import PROFILES, cone
from floatframe.components.rails.track import Track
from floatframe.errors import ModelError
from floatframe.model.bodies.markers import Marker
from floatframe.model.checked_values import number
from floatframe.model.elements import POSITION, Element, ElementLaw, Placed
from floatframe.model.shapes.drawn import MarkerShapes
from floatframe.model.shapes.grounds import Track as DrawnTrack
from floatframe.model.shapes.shape import Shape
from floatframe.model.shapes.wheels import RailWheel

__all__ = ["WheelOnRail", "Wheelset", "height_on_rails", "track_shape"]

SIDES = {"left": 1, "right": -1}
OFF_TRACK = (
    "a wheel has left the track: its flange has climbed the rail, or its tread is 25 mm above it; the outputs ..._off "
    "show which wheel; the results up to this time are kept"
)
PAIR_KEYS = ("radius", "running_circles", "gauge", "inclination")
LAW_KEYS = (
    "normal", "creep", "friction", "shear_modulus", "poisson", "smoothing", "damping", "low_speed", "strips", "polach",
)  # fmt: skip


@frozen_copies
@dataclass(frozen=True, eq=False)
@checked_fields(ModelError)
class Wheelset(Element):
    """Two wheels that rotate with one axle, on the rails of a track fixed to the ground.

    The marker is at the middle of the axle, on the rotating body. Its y axis is the axle and points to the left, so
    that the wheelset rolls forward with a positive angular velocity about it. The tops of the rails are at the height
    of `track.start`.
    """

    name: str
    marker: Marker  #: marker at the middle of the axle, y axis along the axle to the left, on the rotating body
    pair: Pair = field(default_factory=Pair)  #: profiles of wheel and rail, equal on both sides
    track: Track = field(default_factory=Track)
    laws: ContactLaws = field(default_factory=ContactLaws)
    #: if above 0: inertia about the axle of the rotating parts [kg m²]; the body of the marker then does not rotate
    #: with them
    spin_inertia: float = 0.0
    spin: float = 0.0  #: initial angular velocity of these parts, which is then a state [rad/s]

    def __post_init__(self) -> None:
        require_spin(self)

    def law(self, placed: Placed) -> ElementLaw:
        """Return the law of both wheels."""
        half = 0.5 * self.pair.running_circles
        return law_of_wheels(self, placed, (Wheel(1, half, self.pair), Wheel(-1, -half, self.pair)))

    def drawn(self) -> tuple[MarkerShapes, ...]:
        """Return the drawn wheels; the track belongs to the scene, where it is drawn once for all wheels."""
        half = 0.5 * self.pair.running_circles
        return tuple(wheel_shape(self.pair, side, side * half) for side in (1, -1))

    @classmethod
    def from_table(cls, name: str, table: Mapping[str, Any], read: Any) -> "Wheelset":
        """Return the wheelset of a table of a system file."""
        return cls(name, **common_fields(name, table, read, ()))


@frozen_copies
@dataclass(frozen=True, eq=False)
@checked_fields(ModelError)
class WheelOnRail(Element):
    """One wheel on its rail: an independently rotating wheel, or one side of a wheelset with different profiles.

    The marker is at the middle of the running circle, on the rotating body. Its y axis is the axle and points to the
    left of the track, on both sides.
    """

    name: str
    #: marker in the middle of the running circle, y axis along the axle to the left, on the rotating body
    marker: Marker
    side: str = "left"  #: side of the track, "left" or "right"
    pair: Pair = field(default_factory=Pair)
    track: Track = field(default_factory=Track)
    laws: ContactLaws = field(default_factory=ContactLaws)
    #: if above 0: inertia of the wheel about its axle [kg m²]; the body of the marker then does not rotate with it
    spin_inertia: float = 0.0
    spin: float = 0.0  #: initial angular velocity of the wheel, which is then a state [rad/s]

    def __post_init__(self) -> None:
        require_spin(self)
        if self.side not in SIDES:
            raise ModelError(f"element {self.name!r}: side: expected left or right, got {self.side!r}")

    def law(self, placed: Placed) -> ElementLaw:
        """Return the law of the wheel."""
        return law_of_wheels(self, placed, (Wheel(SIDES[self.side], 0.0, self.pair),))

    def drawn(self) -> tuple[MarkerShapes, ...]:
        """Return the drawn wheel."""
        return (wheel_shape(self.pair, SIDES[self.side], 0.0),)

    @classmethod
    def from_table(cls, name: str, table: Mapping[str, Any], read: Any) -> "WheelOnRail":
        """Return the wheel of a table of a system file."""
        side = table.get("side", "left")
        return cls(name, side=side, **common_fields(name, table, read, ("side",)))


def law_of_wheels(element: Wheelset | WheelOnRail, placed: Placed, wheels: tuple[Wheel, ...]) -> ElementLaw:
    """Return the law of one axle with its wheels.

    Raises
    ------
    ModelError
        If the marker is on the ground, its axle is not transverse to the track, a wheel is assembled off its rail, or
        the system is not in metres, kilograms and seconds.
    """
    from floatframe.components.rails.law import (  # numba is slow to import
        CONTACT_OUTPUTS,
        WHEEL_OUTPUTS,
        wheels_on_rails,
    )
    from floatframe.components.rails.tangent import tangent_of_wheels

    where = f"element {element.name!r}"
    if placed.units.name != "m-kg-s":
        raise ModelError(f"{where}: wheels on rails are in m-kg-s, but the system in {placed.units.name!r}")
    if placed.on_ground[0]:
        raise ModelError(
            f"{where}: marker: expected one on the rotating body, got the ground, to which the rails belong"
        )
    require_on_track(where, element, placed, wheels)
    names, units = output_names(wheels, WHEEL_OUTPUTS, CONTACT_OUTPUTS)
    held, turns = element.laws.normal == "constraint", element.spin_inertia > 0
    sides = [("left" if each.side > 0 else "right") + "_V" for each in wheels] if held else []
    return ElementLaw(
        function=wheels_on_rails,
        data=law_numbers(wheels, element.track, element.laws, element.spin_inertia),
        states=["spin"] if turns else [],
        start=[element.spin] if turns else [],
        state_units=["rad/s"] if turns else [],
        state_sizes=[10.0] if turns else [],
        multipliers=sides,
        multiplier_units=["N"] * len(sides),
        holds=[POSITION] * len(sides),
        outputs=names,
        output_units=units,
        tangent=tangent_of_wheels,
        length=1e-3,  # shifts of a millimetre change the contact
        time=math.inf,
        energy="energy",
        power_lost="power_lost",
        stops={"off_track": OFF_TRACK},
    )


def require_spin(element: Wheelset | WheelOnRail) -> None:
    """Raise `ModelError` unless inertia and speed of the spin are numbers."""
    number(f"element {element.name!r}: spin_inertia", element.spin_inertia, at_least=0.0)
    number(f"element {element.name!r}: spin", element.spin)


def require_on_track(
    where: str, element: Wheelset | WheelOnRail, placed: Placed, wheels: tuple[Wheel, ...]
) -> None:  # fmt: skip
    """Raise `ModelError` unless every assembled wheel is above its rail, with its axle transverse to the track."""
    axle = placed.A[0][:, 1]
    for each in wheels:
        W = placed.r[0] + each.arm * axle
        frame = nearest_frame(element.track, W)
        _, n, b = frame.axes.T
        if axle @ n < 0.9:
            raise ModelError(
                f"{where}: marker: its y axis, the axle, points {np.round(axle, 3).tolist()}; expected across the "
                f"track to its left, {np.round(n, 3).tolist()}: give the marker a triad"
            )
        d = W - frame.origin
        shift = each.side * float(d @ n) - 0.5 * each.pair.running_circles
        height = float(d @ b) - each.pair.radius
        side = "left" if each.side > 0 else "right"
        if abs(shift) > 0.05 or abs(height) > 0.05:
            raise ModelError(
                f"{where}: its {side} wheel is placed off the track: {shift * 1e3:.4g} mm outward of the middle of "
                f"its rail and {height * 1e3:.4g} mm above it; expected both within 50 mm: its centre belongs at "
                f"{np.round(W - each.side * shift * n - height * b, 4).tolist()} m"
            )


def nearest_frame(track: Track, point: Any) -> Any:
    """Return the frame of the track next to a point, by Newton's method from the nearest cell."""
    cells = track.cells
    s = float(cells[np.argmin((cells[:, 1] - point[0]) ** 2 + (cells[:, 2] - point[1]) ** 2), 0])
    for _ in range(30):
        frame = track.frame(s)
        d = point - frame.origin
        step = float(d @ frame.axes[:, 0]) / max(0.2, 1 - frame.curvature * float(d @ frame.axes[:, 1]))
        s += step
        if abs(step) < 1e-10:
            break
    return track.frame(s)


def wheel_shape(pair: Pair, side: int, arm: float) -> MarkerShapes:
    """Return the drawn shape of a wheel in the axes of the marker; the flange is on its inner side."""
    shape = RailWheel(pair.radius, flange_side=-side if pair.has_flange else 0)
    return MarkerShapes(Shape(shape, position=np.array([0.0, arm, 0.0])), 0)


def track_shape(
    track: Track, length: float, *, start: float = 0.0, gauge: float = 1.5, spacing: float = 1.0
) -> DrawnTrack:
    """Return the drawn shape of a track from `start` over `length` [m], for the scene of a system."""
    s = np.linspace(start, start + length, max(2, int(np.ceil(length / spacing)) + 1))
    frames = [track.frame(float(each)) for each in s]
    points = np.array([frame.origin for frame in frames])
    cant = np.array([frame.axes[2, 1] * gauge for frame in frames])
    return DrawnTrack(points, gauge, cant=cant)


def common_fields(name: str, table: Mapping[str, Any], read: Any, own: tuple[str, ...]) -> dict[str, Any]:
    """Return marker, pair, track and laws of a table; `ModelError` that names a wrong key."""
    known = (*own, "marker", "spin_inertia", "spin", "wheel", "rail", "track", *PAIR_KEYS, *LAW_KEYS)
    for key in table:
        if key not in known:
            raise ModelError(f"elements.{name}: unknown key {quoted(key)}; choose among {', '.join(known)}")
    if "marker" not in table:
        raise ModelError(f"elements.{name}.marker: missing; expected the middle of the axle on the rotating body")
    pair = Pair(
        profile_of_table(f"elements.{name}.wheel", "wheel", table.get("wheel", "s1002"), read),
        profile_of_table(f"elements.{name}.rail", "rail", table.get("rail", "60e1"), read),
        **{key: table[key] for key in PAIR_KEYS if key in table},
    )
    laws = {key: table[key] for key in LAW_KEYS if key in table}
    if "polach" in laws:
        laws["polach"] = tuple(laws["polach"])
    return {
        "marker": read.marker(table["marker"], "marker"),
        "pair": pair,
        "track": Track.from_table(table.get("track", {}), f"elements.{name}.track"),
        "laws": ContactLaws(**laws),
        **{key: table[key] for key in ("spin_inertia", "spin") if key in table},
    }


def profile_of_table(where: str, kind: str, value: Any, read: Any) -> Profile:
    """Return a profile: a name, {cone = 0.05}, {y = [...], z = [...]} or {file = "points.txt"}, smoothed by `noise`."""
    if isinstance(value, str):
        if value not in PROFILES or PROFILES[value]().kind != kind:
            raise ModelError(
                f"{where}: expected a name ({'s1002' if kind == 'wheel' else '60e1'}), cone = ..., y and z, or file, "
                f"got {value!r}"
            )
        return PROFILES[value]()
    if not isinstance(value, dict):
        raise ModelError(f"{where}: expected the name of a profile or a table, got {value!r}")
    if "cone" in value and kind == "wheel":
        refuse_others(where, value, ("cone", "flange"))
        return cone(value["cone"], flange=bool(value.get("flange", True)))
    if "file" in value:
        refuse_others(where, value, ("file", "noise", "scale"))
        path = read.path(value["file"], "file")
        try:
            points = np.loadtxt(path, ndmin=2, comments=("#", "!"))
        except ValueError as error:
            raise ModelError(f"{where}: {path}: expected lines of y and z: {error}") from None
        if points.shape[1] < 2:
            raise ModelError(f"{where}: {path}: expected lines of y and z, got {points.shape[1]} column")
        points = points[:, :2] * float(value.get("scale", 1.0))
        return profile_of_points(kind, points[:, 0], points[:, 1], name=path.name, noise=value.get("noise", 0.0))
    if "y" in value and "z" in value:
        refuse_others(where, value, ("y", "z", "noise"))
        return profile_of_points(kind, value["y"], value["z"], name=where, noise=value.get("noise", 0.0))
    raise ModelError(f"{where}: expected cone, y and z, or file, got {sorted(value)}")


def refuse_others(where: str, table: Mapping[str, Any], known: tuple[str, ...]) -> None:
    """Raise `ModelError` if a table has unknown keys."""
    for key in table:
        if key not in known:
            raise ModelError(f"{where}: unknown key {quoted(key)}; choose among {', '.join(known)}")


def height_on_rails(element: Wheelset | WheelOnRail, load: float = 0.0) -> float:
    """Return the height of the axle of a centred wheel above the ground's origin, under a vertical load on each wheel.

    Parameters
    ----------
    element
        The element, with its profiles and laws.
    load
        Vertical load on each wheel [N]; with zero, or with treads constrained to the rails, the wheels just touch.
    """
    laws = element.laws
    part = "tread" if element.pair.has_flange else "all"
    found = quasi_elastic(element.pair, np.zeros(1), smoothing=laws.smoothing, part=part)
    cos = 1 / float(np.hypot(1.0, found.slope[0]))
    modulus = laws.shear_modulus / (1 - laws.poisson)
    shape = ellipse(0.5 * cos / found.radius, 0.5 * np.maximum(found.bend, LEAST_BEND), modulus)
    depth = 0.0
    if load and laws.normal == "hertz":
        depth = float((number("height_on_rails: load", load, at_least=0.0) / cos / shape.stiffness[0]) ** (2 / 3)) / cos
    return float(element.track.start[2] + element.pair.radius + found.q[0] - depth)
