"""A small system with each public element, and with each thing that a law may ask for; see `parts`."""

import numpy as np

from floatframe import GROUND, Gravity, Marker, RevoluteJoint, RigidBody, System
from floatframe.components import rails, wheels
from floatframe.components.bearings import Bearing
from floatframe.components.clearances import Backlash, BallWithPlay
from floatframe.components.drives import Pid, PidDrive
from floatframe.integrators import RelativeOde
from floatframe.joints import ConstantOrientation
from floatframe.model.functions.time_functions import harmonic
from tests.floatframe.components.aerodynamics.examples import glider
from tests.floatframe.components.cables.examples import jumper
from tests.floatframe.components.clearances.examples import pendulum
from tests.floatframe.components.drives.anti_skid_brake_examples import bench
from tests.floatframe.components.drives.controllers_examples import A, B, every_drive, turned
from tests.floatframe.components.friction.examples import pulled
from tests.floatframe.components.hydraulics.jack_examples import jack
from tests.floatframe.components.hydraulics.oleo_strut_examples import drop
from tests.floatframe.components.rails.examples import CONE, NEW, axle
from tests.floatframe.components.rails.examples import DOWN as WEIGHT
from tests.floatframe.components.wheels.examples import DOWN, R0, K, linear, wheel
from tests.floatframe.engine.structure_preserving import systems
from tests.floatframe.engine.structure_preserving.examples import tied
from tests.floatframe.engine.structure_preserving.parts import Part
from tests.floatframe.model.elements.element_accelerations_examples import pair as heavy_pair
from tests.floatframe.model.elements.element_states_examples import disc, lifted
from tests.floatframe.model.elements.expression_element_examples import as_expressions
from tests.floatframe.model.elements.laws import Ball, Circuit, Disc, Loop, Mount, OnPlane, Spring

__all__ = ["ELEMENT_PARTS"]

DRIVES = {type(drive).__name__: drive for drive in every_drive()}
PID = Pid(harmonic(0.5, 9.0, 0.0, 3.0), 2.0, 5.0, 0.1, 0.01, -40.0, 50.0)


def driven(name):
    """Return a rotor with a drive; a controller follows its angle."""
    drive = DRIVES[name] if name != "PidDrive" else PidDrive("motor", A, B, PID, "angle")
    return turned(drive, omega=3.0)


def rolling(tyre):
    """Return a wheel that rolls with slip, set down on its tyre."""
    return System([wheel(R0 - 1e-3, velocity=(5.0, 0.3, 0), omega_B=(0, 14.0, 0.2))], [], [DOWN], elements=[tyre])


def brush():
    """Return a brush tyre."""
    return wheels.BrushTyre("tyre", Marker(GROUND), Marker("wheel"), R0, K, 200.0, 3e3, 0.1, damping=500.0,
                            relaxation_x=0.2, relaxation_y=0.4)  # fmt: skip


def magic_formula():
    """Return a wheel of a passenger car on its tyre."""
    tyre = wheels.read_tyre_file(wheels.shipped_tyre("passenger_car_61"))
    element = wheels.MagicFormulaTyre("tyre", Marker(GROUND), Marker("wheel"), tyre)
    radius = tyre.radius
    body = RigidBody("wheel", 20.0, np.diag([0.5, 1.0, 0.5]), position=(0, 0, radius - 0.02), velocity=(15.0, 0.2, 0),
                     omega_B=(0, 15.2 / radius, 0))  # fmt: skip
    return System([body], [], [Gravity((0, 0, -150.0))], elements=[element])


def wheelset(normal):
    """Return a wheelset that runs free, off the middle of its track."""
    laws = rails.ContactLaws(creep="kalker-saturated", normal=normal, damping=0.0)
    element = rails.Wheelset("wheels", Marker("axle"), CONE, laws=laws)
    height = rails.height_on_rails(element)
    return System([axle(10.0, 10.0 / 0.46, (0, 3e-3, height))], [], [WEIGHT], elements=[element])


def wheel_on_rail():
    """Return a wheel on a rail, in a frame that goes straight on."""
    element = rails.WheelOnRail("wheels", Marker("axle"), "left", NEW)
    height = rails.height_on_rails(element)
    body = RigidBody("axle", 500.0, np.diag([30.0, 40.0, 30.0]), position=(0, 0.75, height), velocity=(10.0, 0, 0),
                     omega_B=(0, 10.0 / 0.46, 0))  # fmt: skip
    box = RigidBody("box", 50.0, np.eye(3), position=(0, 0.75, height), velocity=(10.0, 0, 0))
    level = ConstantOrientation("level", Marker(GROUND), Marker("box"))
    bearing = RevoluteJoint("bearing", Marker("box"), Marker("axle"), axis=(0, 1, 0))
    return System([body, box], [level, bearing], [Gravity((0, 0, -100.0))], elements=[element])


def with_play(kind):
    """Return a pendulum that hangs with play, or a rotor between stops."""
    if kind == "ball":
        body = RigidBody("bob", 2.0, 0.05 * np.eye(3), position=(0.15, -0.1, 0.0))
        ball = BallWithPlay("play", Marker(GROUND), Marker("bob", position=(-0.15, 0.1, 0)), 1e-3, 1e4, damping=0.3,
                            friction=0.2, friction_speed=0.01, radius=0.01)  # fmt: skip
        return System([body], [], [Gravity((0, -9.81, 0))], elements=[ball])
    stops = Backlash("play", A, B, -0.1, 0.1, 200.0, 1.5, damping=0.2, motion="about")
    return turned(stops, omega=3.0)


def in_bearing():
    """Return a rotor in a bearing whose cross terms are not those of a spring."""
    body = RigidBody("rotor", 2.0, np.diag([0.02, 0.02, 0.03]), velocity=(0.02, 0, 0.01), omega_B=(0.3, 0, 20.0))
    bearing = Bearing("bearing", Marker(GROUND), Marker("rotor", position=(0, 0, 0.05)), [[5e3, 800.0], [-900.0, 4e3]],
                      [[30.0, 4.0], [3.0, 20.0]], 2e3, 15.0, 40.0, 0.3)  # fmt: skip
    return System([body], elements=[bearing])


def held_ball():
    """Return a rigid pendulum that three reactions of an element hold."""
    spin = np.array([0.3, 0.5, 2.0])
    body = RigidBody("bob", 2.0, np.diag([0.2, 0.3, 0.25]), position=(0.5, 0, 0), omega_B=spin,
                     velocity=np.cross(spin, (0.5, 0, 0)))  # fmt: skip
    ball = Ball("law", Marker(GROUND), Marker("bob", position=(-0.5, 0, 0)))
    return System([body], [], [Gravity((0, 0, -9.81))], elements=[ball])


ENDS = systems.ENDS
ELEMENT_PARTS = {
    "aerodynamics.lifting-surface": Part(glider, 0.02),
    "bearings.bearing": Part(in_bearing, 1e-3),
    "cables.cable": Part(lambda: jumper(length=0.45), 5e-3),
    "clearances.backlash": Part(lambda: with_play("backlash"), 2e-3, 52, 1e-2, is_smooth=False),
    "clearances.ball": Part(lambda: with_play("ball"), 1e-3, 40, 1e-2, is_smooth=False),
    "clearances.hinge": Part(lambda: pendulum(1.5), 2e-4, 100, 1e-2, is_smooth=False),
    "drives.anti-skid-brake": Part(lambda: bench(), 2e-3, 20, 1e-2, is_smooth=False),
    "drives.dc-motor": Part(lambda: driven("DcMotor"), 5e-4),
    "drives.induction-motor": Part(lambda: driven("InductionMotor"), 1e-3),
    "drives.pid": Part(lambda: driven("PidDrive"), 2e-3),
    "drives.speed-control": Part(lambda: driven("SpeedControl"), 1e-3),
    "drives.torque-map": Part(lambda: driven("TorqueMap"), 2e-3, is_smooth=False),
    "elements.expressions": Part(as_expressions, 2e-3),
    "friction.bristles": Part(lambda: pulled(), 2e-3),
    "hydraulics.circuit": Part(jack, 1e-3),
    "hydraulics.oleo-strut": Part(drop, 1e-3, 20, 1e-3, is_smooth=False),
    "rails.wheelset": Part(lambda: wheelset("hertz"), 1e-3, 20, 1e-3, is_smooth=False),
    "rails.wheelset (normal = constraint)": Part(
        lambda: wheelset("constraint"), 1e-3, 20, 1e-3, is_smooth=False, ode=RelativeOde("BDF", 1e-4, 1e-6)
    ),
    "rails.wheel-on-rail": Part(wheel_on_rail, 1e-3, 20, 1e-3, is_smooth=False),
    "wheels.brush-tyre": Part(lambda: rolling(brush()), 1e-3),
    "wheels.linear-tyre": Part(lambda: rolling(linear(damping=500.0)), 1e-3, 20, 1e-3, is_smooth=False),
    "wheels.magic-formula-tyre": Part(magic_formula, 1e-3),
    "law with an energy": Part(lambda: systems.with_element(Spring("law", *ENDS, 30.0))),
    "law of three points": Part(lambda: systems.with_element(Loop("law", *ENDS, ENDS[0], 0.5, 0.6))),
    "law with moments": Part(lambda: systems.with_element(Mount("law", *ENDS, 2.0, 2.0, 1.0, 2.0))),
    "law with a state": Part(lambda: systems.with_element(systems.Creeping("law", *ENDS, 30.0, 0.2))),
    "law with a stiff state": Part(lifted, 1e-3),
    "law that holds a position": Part(held_ball),
    "law that holds positions of flexible bodies": Part(
        lambda: systems.without_joint(
            OnPlane("law", Marker("soft", "end_a"), Marker("block", position=(0.1, 0.4, 0.2)))
        )
    ),
    "law that holds velocities": Part(lambda: disc(elements=[Disc("law", Marker("disc"), 0.8)])),
    "law with an equation of its own": Part(lambda: tied("soft", ()), 5e-3),
    "law with states and an equation that moves nothing": Part(
        lambda: System([RigidBody("b", 1.0, np.eye(3), velocity=(1.0, 0, 0))],
                       elements=[Circuit("law", Marker("b"), 10.0)])
    ),
    "law that feels accelerations": Part(lambda: heavy_pair("rigid")[0]),
}  # fmt: skip
