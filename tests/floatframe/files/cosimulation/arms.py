"""The arm of the tests of co-simulation: two bodies, one of them elastic, a motor that jumps, a drive, a lag."""

from pathlib import Path

import cms
from tests.changed_file import changed_file
from tests.floatframe.point_masses import random_point_masses, reduced_body, stiffness

JUMPS = (0.0, 0.05, 0.1)
MOTORS = (10.0, 25.0, 5.0)
H, MACRO, T_END = 1e-3, 5e-3, 0.15
TOLERANCE = 1e-12  # of Newton's method: ways to run the arm are compared to 1e-8, accelerations too
PIECES = ", ".join(f'{{type = "constant", value = {value}}}' for value in MOTORS)
ARM = f"""
[system]
units = "m-kg-s"
gravity = [0, -9.81, 0]

[bodies.arm]
mass = 2.0
inertia = [[0.01, 0, 0], [0, 0.2, 0], [0, 0, 0.2]]
position = [0.5, 0, 0]

[bodies.load]
file = "load.h5"
position = [1.0, -0.4, 0]

[joints.hinge]
type = "revolute"
body_a = "ground"
body_b = "arm"
marker_a = [0, 0, 0]
marker_b = [-0.5, 0, 0]
axis = [0, 0, 1]

[joints.wrist]
type = "revolute"
body_a = "arm"
body_b = "load"
marker_a = [0.5, 0, 0]
marker_b = "end_a"
axis = [0, 0, 1]

[forces.motor]
type = "joint-force"
joint = "hinge"
coordinate = "angle"
stiffness = 30.0
damping = 0.4
motor = {{type = "piecewise", t = {list(JUMPS)}, pieces = [{PIECES}]}}

[forces.push]
type = "point-force"
body = "arm"
force = [0, 2.0, 0]

[forces.lag]
type = "user-force"
forces = {{phi = "-0.5*z"}}
rates = {{z = "10*(phi - z)"}}
states = {{z = 0.0}}
[forces.lag.coordinates.phi]
joint = "wrist"
coordinate = "angle"

[sensors.tip]
type = "acceleration"
body = "arm"
marker = [0.5, 0, 0]

[sensors.pin]
type = "reaction"
of = "hinge"

[sensors.turn]
type = "angle"
body_a = "ground"
body_b = "load"
marker_b = "end_b"

[sensors.mode]
type = "mode"
body = "load"
mode = 1

[inputs.torque]
joint = "wrist"
coordinate = "angle"

[run]
t_end = {T_END}
h = {H}
tolerance = {TOLERANCE}
"""


def write_arm(folder: Path, *changes: tuple[str, str]) -> Path:
    """Write the system file, with parts of its text changed, and the modal file beside it."""
    cms.write(reduced_body(random_point_masses(3, 3), stiffness(3), name="load"), folder / "load.h5")
    return changed_file(folder / "arm.toml", ARM, *changes)


def motor_at(t: float) -> float:
    """Return the value of the motor from a time on."""
    return MOTORS[sum(t >= jump - 1e-9 for jump in JUMPS) - 1]
