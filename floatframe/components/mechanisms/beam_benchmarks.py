"""The four benchmark problems of flexible beams of Bauchau, Betsch, Cardona and others (2016).

Every beam is a `BeamLine` with the properties per length given in the problem. `describe` chooses the model of the
beam: it maps the line to a part maker, such as `lambda line: partial(finite_segments, line=line, n=9, stations=...)`.
Parts have the places "start" and "end"; the shaft and the buckling beam also have "middle". The local y and z axes of a
line begin along those of its orientation.

References: Bauchau and others (2016) and Masarati and others (MBDyn), docs/bibliography.md.
"""

from collections.abc import Callable

import numpy as np

from fe_models.body.beam_line import BeamLine
from fe_models.foundation.arrays import Array
from fe_models.foundation.units import unit_system
from floatframe.components.flexible_parts.flexible_part import FlexiblePart, PartMaker
from floatframe.model.bodies.ground import GROUND
from floatframe.model.bodies.markers import Marker
from floatframe.model.bodies.rigid_body import RigidBody
from floatframe.model.forces import Force, Gravity, PointForce
from floatframe.model.functions.time_functions import TimeFunction, harmonic, one_piece, piecewise
from floatframe.model.joints import CylindricalJoint, FixedJoint, Joint, RevoluteJoint, SphericalJoint
from floatframe.model.rotations import euler_parameters
from floatframe.model.system import Body, System

__all__ = [
    "BUCKLING_LINES",
    "FOUR_BAR_LINES",
    "PRINCETON_LINE",
    "SHAFT_LINE",
    "buckling_beam",
    "crank_turn",
    "loaded_cantilever",
    "misaligned_four_bar",
    "shaft_turn",
    "unbalanced_shaft",
]

Describe = Callable[[BeamLine], PartMaker]
X, Y, Z = np.eye(3)
UNITS = "m-kg-s"

#: the beam of Princeton's experiment, with its stiff axis in the x-y plane; the problem is static, so its mass does not
#: matter and is that of aluminium
PRINCETON_LINE = BeamLine(
    0.508, rho_A=0.1070, EA=2.84191e6, EIy=2.42873, EIz=36.2794, GJ=3.10338, rho_Iy=9.147e-8, rho_Iz=1.3664e-6,
    GAy=9.03881e5, GAz=6.40131e5,
)  # fmt: skip


def square(length: float, *, rho_A: float, EA: float, EI: float, GJ: float, GA: float, rho_I: float) -> BeamLine:
    """Return a line with equal properties in both planes."""
    return BeamLine(
        length, rho_A=rho_A, EA=EA, EIy=EI, EIz=EI, GJ=GJ, rho_Iy=rho_I, rho_Iz=rho_I, GAy=GA, GAz=GA
    )  # fmt: skip


#: bars 1 and 2 are steel bars of 16 mm square section, bar 3 of 8 mm square section
FOUR_BAR_LINES = (
    square(0.12, rho_A=1.997, EA=52.99e6, EI=1131.0, GJ=733.5, GA=16.88e6, rho_I=42.6e-6),
    square(0.24, rho_A=1.997, EA=52.99e6, EI=1131.0, GJ=733.5, GA=16.88e6, rho_I=42.6e-6),
    square(0.12, rho_A=0.4992, EA=13.25e6, EI=70.66, GJ=45.84, GA=4.22e6, rho_I=2.662e-6),
)
#: a steel tube with 100 mm diameter and 5 mm wall
SHAFT_LINE = square(6.0, rho_A=11.64, EA=313.4e6, EI=354.5e3, GJ=272.7e3, GA=60.5e6, rho_I=13.17e-3)
#: the beam is of aluminium, 100 mm high and 10 mm wide; link and crank are steel tubes
BUCKLING_LINES = (
    BeamLine(
        1.0, rho_A=2.68, EA=73e6, EIy=60830.0, EIz=608.3, GJ=877.2, rho_Iy=2233e-6, rho_Iz=22.33e-6, GAy=5.025e6,
        GAz=23.40e6,
    ),
    square(0.25, rho_A=1.212, EA=33.02e6, EI=1189.0, GJ=914.5, GA=10.81e6, rho_I=43.65e-6),
    square(0.05, rho_A=4.85, EA=132.1e6, EI=19020.0, GJ=14630.0, GA=43.22e6, rho_I=698.3e-6),
)  # fmt: skip


def loaded_cantilever(
    describe: Describe, *, load: float, angle: float, line: BeamLine = PRINCETON_LINE, ramp: TimeFunction | None = None
) -> System:
    """Return a beam along x, clamped at the origin, with a dead load at its end: the Princeton experiment.

    Parts "beam ...", joint "clamp", and force "load" [N] at an angle from -y towards z [rad]; at zero the beam bends
    about its stiff axis.
    """
    beam = placed(describe(line), "beam", np.zeros(3), X, Y)
    clamp = FixedJoint("clamp", Marker(GROUND), beam.marker("start"))
    force = load * (-np.cos(angle) * Y + np.sin(angle) * Z)
    weight = PointForce("load", beam.marker("end"), force=force, amplitude=ramp)
    return made([beam], [], [clamp], [weight], "Princeton beam")


def misaligned_four_bar(describe: Describe, *, turn: TimeFunction, defect: float = np.deg2rad(5.0)) -> System:
    """Return three bars with four hinges, of which the hinge at C is misaligned by `defect` [rad].

    A = 0, B = (0, 0.12, 0), C = (0.24, 0.12, 0), D = (0.24, 0, 0). With rigid bars it could not move. Parts "bar 1" to
    "bar 3"; joints "A" (its angle about z is prescribed by `turn`), "B", "C", "D".
    """
    A, B, C, D = np.zeros(3), 0.12 * Y, 0.24 * X + 0.12 * Y, 0.24 * X
    lines = FOUR_BAR_LINES
    bars = [
        placed(describe(line), f"bar {k + 1}", start, direction, across)
        for k, (line, start, direction, across) in enumerate(zip(lines, (A, B, C), (Y, X, -Y), (-X, Y, X), strict=True))
    ]
    # axis of hinge C in the axes of its marker; the markers of all bars have the ground's z, but different x and y
    tilted = np.sin(defect) * X + np.cos(defect) * Z
    joints: list[Joint] = [
        RevoluteJoint("A", Marker(GROUND), bars[0].marker("start"), axis=Z, motions={"angle": turn}),
        RevoluteJoint("B", bars[0].marker("end"), bars[1].marker("start"), axis=Z),
        RevoluteJoint("C", bars[1].marker("end"), bars[2].marker("start"), axis=tilted),
        RevoluteJoint("D", Marker(GROUND, position=D), bars[2].marker("end"), axis=Z),
    ]
    return made(bars, [], joints, [], "four-bar with a misaligned joint")


def unbalanced_shaft(describe: Describe, *, turn: TimeFunction, gravity: float = 9.81) -> System:
    """Return a shaft along x on two bearings, with a disk in the middle that is 50 mm eccentric.

    Part "shaft", body "disk"; joints "drive" (its angle is prescribed by `turn`), "bearing" (which slides), "seat".
    Gravity acts along -z; initially the centre of the disk lies above the shaft.
    """
    mass, radius, width = 70.573, 0.24, 0.05
    across = mass * (radius**2 / 4 + width**2 / 12)
    middle = SHAFT_LINE.length / 2 * X
    disk = RigidBody("disk", mass, np.diag([mass * radius**2 / 2, across, across]), position=middle + 0.05 * Z)
    shaft = placed(describe(SHAFT_LINE), "shaft", np.zeros(3), X, Y)
    joints: list[Joint] = [
        RevoluteJoint("drive", Marker(GROUND), shaft.marker("start"), axis=X, motions={"angle": turn}),
        CylindricalJoint("bearing", Marker(GROUND, position=2 * middle), shaft.marker("end"), axis=X),
        FixedJoint("seat", shaft.marker("middle"), Marker("disk", position=-0.05 * Z)),
    ]
    return made([shaft], [disk], joints, [Gravity(-gravity * Z)] if gravity else [], "unbalanced shaft")


def shaft_turn(omega: float = 60.0) -> TimeFunction:
    """Return the angle of the shaft; its rate rises to 0.8 omega in 0.5 s, to 1.2 omega from 1 s to 1.25 s [rad]."""
    first, last = 0.8 * omega, 1.2 * omega

    def rise(begin: float, rate: float, by: float, T: float) -> TimeFunction:
        """Continue from an angle; the rate changes by a step times (1 - cos(pi t/T))/2."""
        return one_piece([begin, rate + by / 2], (-by / 2 * T / np.pi, np.pi / T, 0.0))

    at = (0.0, first * 0.25, first * 0.75, first * 0.75 + (first + last) / 2 * 0.25)
    pieces = [
        rise(at[0], 0.0, first, 0.5),
        one_piece([at[1], first]),
        rise(at[2], first, last - first, 0.25),
        one_piece([at[3], last]),
    ]
    return piecewise([0.0, 0.5, 1.0, 1.25], pieces)


def buckling_beam(describe: Describe, *, turn: TimeFunction, gap: float = 1e-4) -> System:
    """Return a thin cantilever whose end a crank pushes upwards through a link until it buckles laterally.

    Parts "beam", "link", "crank"; joints "root", "ball" (the link is attached `gap` [m] beside the axis of the beam),
    "pin" and "crank", whose angle is prescribed by `turn`; half a turn lifts the end by 0.1 m.
    """
    beam_line, link_line, crank_line = BUCKLING_LINES
    tip = X + gap * Y
    low = tip - link_line.length * Z
    beam = placed(describe(beam_line), "beam", np.zeros(3), X, Y)
    link = placed(describe(link_line), "link", low, Z, Y)
    crank = placed(describe(crank_line), "crank", low - crank_line.length * X, X, Y)
    at_end = beam.marker("end")
    carrier, fixed = carried(at_end, gap * Y, X)
    joints: list[Joint] = [
        FixedJoint("root", Marker(GROUND), beam.marker("start")),
        *fixed,
        SphericalJoint("ball", carrier, link.marker("end")),
        RevoluteJoint("pin", crank.marker("end"), link.marker("start"), axis=Y),
        RevoluteJoint(
            "crank",
            Marker(GROUND, position=low - crank_line.length * X),
            crank.marker("start"),
            axis=Y,
            motions={"angle": turn},
        ),
    ]
    lug = [RigidBody("lug", 1e-3, 1e-7 * np.eye(3), position=tip)] if fixed else []
    return made([beam, link, crank], lug, joints, [], "lateral buckling")


def crank_turn(duration: float = 0.4) -> TimeFunction:
    """Return the angle of the crank: half a turn, -pi/2 (1 - cos(pi t/duration)), then rest [rad]."""
    rising = harmonic(np.pi / 2, np.pi / duration, np.pi / 2, -np.pi / 2)
    return piecewise([0.0, duration], [rising, one_piece([-np.pi])])


def carried(marker: Marker, offset: Array, place: Array) -> tuple[Marker, list[Joint]]:
    """Return a marker at an offset from another one, on its rigid body or on a small body fixed to its interface."""
    if marker.interface is None:
        at = np.zeros(3) if marker.position is None else marker.position
        return Marker(marker.body, position=at + offset), []
    return Marker("lug", position=np.zeros(3)), [FixedJoint("seat", marker, Marker("lug", position=-offset))]


def placed(maker: PartMaker, name: str, start: Array, direction: Array, across: Array) -> FlexiblePart:
    """Return a part that starts at a point in a given direction, with its y axis in another direction."""
    R = np.column_stack([direction, across, np.cross(direction, across)])
    return maker(name, position=start, orientation=euler_parameters(R))


def made(
    parts: list[FlexiblePart], bodies: list[RigidBody], joints: list[Joint], forces: list[Force], name: str
) -> System:
    """Return a system of the parts with the bodies, joints and forces between them."""
    all_bodies: list[Body] = [body for part in parts for body in part.bodies] + list(bodies)
    all_joints = [joint for part in parts for joint in part.joints] + joints
    all_forces = [force for part in parts for force in part.forces] + forces
    return System(all_bodies, all_joints, all_forces, unit_system(UNITS), name)
