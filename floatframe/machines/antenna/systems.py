"""The antenna as systems with any number of petals, and all its files."""

import json
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from fe_models.foundation.arrays import Array
from floatframe.machines.antenna.closed_forms import mechanism
from floatframe.machines.antenna.description import FINE, Antenna, HingePlay
from floatframe.model.bodies.markers import Marker
from floatframe.model.rotations import rotation_log
from floatframe.model.system import System
from floatframe.results.place_motion import PlaceMotion
from floatframe.results.sensors.places import place_motion
from floatframe.results.trajectory import Trajectory

__all__ = ["Pointing", "antenna_files", "fine_files", "petal_job", "petal_mesh", "pointing", "strut_files", "strut_job"]


# pointing directions of the petals of the antenna relative to the spacecraft ------------------------------------------


@dataclass(frozen=True, eq=False)
class Pointing:
    """Direction from the middle of each hinge to the tip of its petal, in axes of the spacecraft, (n_t, n_petals)."""

    t: Array  #: (n_t,) [s]
    theta: Array  #: from the mast [rad]
    lateral: Array  #: out of the plane of the petal and the mast [rad]


def pointing(system: System, motion: Trajectory, antenna: Antenna) -> Pointing:
    """Return the pointing of the petals of an antenna during a motion."""

    def place(body: str, position: tuple[float, float, float]) -> PlaceMotion:
        return place_motion(system, motion, "pointing", Marker(body, position=np.array(position)))

    bus = place("bus", (0.0, 0.0, 0.0))
    theta, lateral = [], []
    for k in range(1, antenna.n_petals + 1):
        turn = 2 * np.pi * k / antenna.n_petals
        tip = place(f"petal_{k}", (antenna.petal_length, 0.0, 0.0)).position - bus.position
        seen = np.einsum("tij,ti->tj", bus.axes, tip)
        out = np.cos(turn) * seen[:, 0] + np.sin(turn) * seen[:, 1] - antenna.geometry.hinge_radius
        theta.append(np.arctan2(out, seen[:, 2]))
        across = np.cos(turn) * seen[:, 1] - np.sin(turn) * seen[:, 0]
        lateral.append(np.arctan2(across, np.hypot(out, seen[:, 2])))
    return Pointing(motion.t, np.transpose(theta), np.transpose(lateral))


# systems --------------------------------------------------------------------------------------------------------------


STAND = """
[joints.stand]
type = "fixed"
body_a = "ground"
marker_a = [0, 0, 0]
body_b = "bus"
marker_b = [0, 0, 0]
"""


def numbers(*values: float) -> str:
    """Return a list of numbers of TOML."""
    return json.dumps([float(f"{value:.15g}") + 0.0 for value in np.ravel(values)])


def about(axis: str, angle: float) -> np.ndarray:
    """Return the rotation matrix about the axis y or z."""
    c, s = np.cos(angle), np.sin(angle)
    return np.array([[c, 0, s], [0, 1, 0], [-s, 0, c]] if axis == "y" else [[c, -s, 0], [s, c, 0], [0, 0, 1]])


def place_text(position: np.ndarray, R: np.ndarray) -> str:
    """Return the keys for the position and orientation of a body."""
    return f"position = {numbers(*position)}\nrotation_vector = {numbers(*rotation_log(R))}\n"


def leaf(antenna: Antenna, k: int, theta: float) -> str:
    """Return petal k and its strut with their hinges."""
    geometry, turn = antenna.geometry, about("z", 2 * np.pi * k / antenna.n_petals)
    found = mechanism(geometry, theta, n_petals=antenna.n_petals)
    hinge = turn @ [geometry.hinge_radius, 0, 0]
    petal = turn @ about("y", theta - np.pi / 2)  # x along the petal, y about its hinge
    foot = turn @ [geometry.slider_radius, 0, 0] + [0, 0, found.slider[0]]
    strut = turn @ about("y", np.pi / 2 - found.strut_angle[0])
    radial = turn @ [geometry.slider_radius, 0, 0]
    axis = numbers(*(turn @ [0, 1, 0]))
    return f"""
[bodies.petal_{k}]
file = "petal.h5"
{place_text(hinge, petal)}
[bodies.strut_{k}]
file = "strut.h5"
{"" if antenna.stiff_struts else "stiffening = false" + chr(10)}{place_text(foot, strut)}
{hinge_text(antenna, k, hinge, axis, theta)}
[joints.foot_{k}]
type = "universal"
body_a = "slider"
marker_a = {numbers(*radial)}
body_b = "strut_{k}"
marker_b = "foot"
axis = {axis}
axis_b = [0, 0, 1]

[joints.elbow_{k}]
type = "spherical"
body_a = "petal_{k}"
marker_a = "elbow"
body_b = "strut_{k}"
marker_b = "head"
"""


def hinge_text(antenna: Antenna, k: int, hinge: np.ndarray, axis: str, theta: float) -> str:
    """Return the hinge of petal k with its harness, as a joint or as an element with play."""
    if antenna.play is None:
        return f"""[joints.hinge_{k}]
type = "revolute"
body_a = "bus"
marker_a = {numbers(*hinge)}
body_b = "petal_{k}"
marker_b = "root"
axis = {axis}

[forces.harness_{k}]
type = "joint-force"
joint = "hinge_{k}"
coordinate = "angle"
stiffness = {antenna.hinge_stiffness:.6g}
free = {antenna.stowed - theta:.15g}
damping = {antenna.hinge_damping:.6g}
friction = {antenna.hinge_friction:.6g}
friction_speed = {antenna.friction_speed:.6g}
"""
    play = antenna.play
    return f"""[elements.hinge_{k}]
type = "clearances.hinge"
marker_a = {{ body = "bus", marker = {numbers(*hinge)} }}
marker_b = {{ body = "petal_{k}", marker = "root" }}
axis = {axis}
radial_play = {play.radial:.6g}
axial_play = {play.axial:.6g}
length = {play.length:.6g}
radius = {play.pin_radius:.6g}
stiffness = {play.stiffness:.6g}
damping = {play.damping:.6g}
friction = {play.friction:.6g}
friction_speed = {play.friction_speed:.6g}
turn_stiffness = {antenna.hinge_stiffness:.6g}
turn_damping = {antenna.hinge_damping:.6g}
turn_free = {antenna.stowed - theta:.15g}
"""


def bus_and_slider(antenna: Antenna, theta: float, *, fixed: bool) -> str:
    """Return the spacecraft, the slider on its mast, and the drawn surroundings."""
    slider = mechanism(antenna.geometry, theta, n_petals=antenna.n_petals).slider[0]
    (Ix, Iy, Iz), J = antenna.bus_inertia, antenna.slider_inertia
    return f"""
[bodies.bus]
mass = {antenna.bus_mass:.6g}
inertia = [[{Ix:.6g}, 0, 0], [0, {Iy:.6g}, 0], [0, 0, {Iz:.6g}]]
center_of_mass = [0, 0, -0.8]

[[bodies.bus.shapes]]
type = "cylinder"
radius = {0.95 * antenna.geometry.hinge_radius:.6g}
length = 1.6
position = [0, 0, -0.8]
color = "#c9a227"

[[bodies.bus.shapes]]
type = "cylinder"
radius = 0.05
length = {antenna.travel[0] + 0.1:.6g}
position = [0, 0, {antenna.travel[0] / 2:.6g}]
color = "#8a8f98"

[bodies.slider]
mass = {antenna.slider_mass:.6g}
inertia = [[{J:.6g}, 0, 0], [0, {J:.6g}, 0], [0, 0, {J:.6g}]]
position = [0, 0, {slider:.15g}]

[[bodies.slider.shapes]]
type = "cylinder"
radius = {antenna.geometry.slider_radius:.6g}
length = 0.08
color = "#3b6ea5"

[joints.mast]
type = "prismatic"
body_a = "bus"
marker_a = [0, 0, 0]
body_b = "slider"
marker_b = [0, 0, 0]
axis = [0, 0, 1]
{STAND if fixed else ""}"""


def system_text(
    antenna: Antenna, title: str, *, theta: float, fixed: bool, gravity: bool, offload: float, tail: str
) -> str:
    """Return a system file of bus, slider, petals and struts at an angle; `offload` is a force upward at each elbow."""
    text = f'# {title}\n[system]\nunits = "m-kg-s"\n' + ("gravity = [0, 0, -9.81]\n" if gravity else "")
    text += bus_and_slider(antenna, theta, fixed=fixed)
    for k in range(1, antenna.n_petals + 1):
        text += leaf(antenna, k, theta)
        if offload:
            text += f"""
[forces.wire_{k}]
type = "point-force"
body = "petal_{k}"
marker = "elbow"
force = [0, 0, {offload:.15g}]
"""
    return text + tail


def driven_tail(antenna: Antenna) -> str:
    """Return the motion of the slider from stowed to deployed, and the sensors."""
    first, last = antenna.travel
    return f"""
[joints.mast.motions.distance]
type = "smooth-step"
t_start = 0.0
t_end = {antenna.duration:.6g}
first = {first:.15g}
last = {last:.15g}
{sensors(antenna)}
[run]
t_end = {antenna.duration:.6g}
h = {antenna.duration / 60:.6g}
"""


def sensors(antenna: Antenna) -> str:
    """Return the sensors that all systems of the antenna share."""
    hinge = 'type = "coordinate"\njoint = "hinge_1"\ncoordinate = "angle"'
    if antenna.play is not None:
        hinge = 'type = "element"\nof = "hinge_1"'
    return f"""
[sensors.drive]
type = "coordinate"
joint = "mast"
coordinate = "distance"

[sensors.hinge]
{hinge}

[sensors.strut]
type = "reaction"
of = "foot_1"

[sensors.tip]
type = "position"
body = "petal_1"
set = "TIP"
"""


def released_tail(antenna: Antenna) -> str:
    """Return the force of the drive spring with its rate limiter, and the latch at the end of the travel."""
    return f"""
[forces.drive]
type = "joint-force"
joint = "mast"
coordinate = "distance"
damping = {antenna.n_petals * antenna.drag:.6g}

[forces.drive.motor]
type = "smooth-step"
t_start = 0.0
t_end = 2.0
first = 0.0
last = {-antenna.n_petals * antenna.push:.6g}

[couplers.latch]
engaged = false
terms = [{{ joint = "mast", coordinate = "distance", factor = 1.0 }}]

[events.latched]
watch = "mast.distance"
level = {antenna.travel[1]:.15g}
direction = "falling"
switch_on = ["latch"]
switch_off = ["drive"]
record = true
{sensors(antenna)}
[sensors.bus]
type = "acceleration"
body = "bus"
marker = [0, 0, 0]

[run]
t_end = {30.0 if antenna.begin is None else 6.0}
h = {"4e-3" if antenna.play is None else "1e-3"}
output_every = {5 if antenna.play is None else 10}
"""


def antenna_files(antenna: Antenna, *, petal_moment: float = 0.0) -> dict[str, str]:
    """Return all files of the machine, by name.

    Parameters
    ----------
    antenna
        Parameters of the antenna.
    petal_moment
        First moment of mass of a petal about its hinge, for the wires of the rig: mass times distance of the centre of
        mass, both reported by `cms info petal.h5` [kg m].
    """
    wire = 9.81 * petal_moment / antenna.geometry.elbow
    options: dict[str, Any] = {"theta": antenna.stowed, "fixed": True}
    tail = driven_tail(antenna)
    return {
        "petal.inp": petal_mesh(antenna),
        "petal.toml": petal_job(antenna),
        "strut.toml": strut_job(antenna),
        **strut_files(antenna),
        "space.toml": system_text(
            antenna, "The antenna held, without gravity, driven open slowly: floatframe kinematics space.toml",
            gravity=False, offload=0.0, tail=tail, **options,
        ),
        "rig.toml": system_text(
            antenna, "The antenna on a rig under gravity, a wire with constant force at every elbow",
            gravity=True, offload=wire, tail=tail, **options,
        ),
        "bare.toml": system_text(
            antenna, "The antenna under gravity without compensation", gravity=True, offload=0.0, tail=tail, **options
        ),
        "latching.toml": latching_text(antenna),
    }  # fmt: skip


def latching_text(antenna: Antenna) -> str:
    """Return the system that opens in flight and is then latched."""
    title = "The antenna on its free spacecraft, opened by a motor against a damper, then latched"
    title += "" if antenna.play is None else "; its petal hinges have play"
    theta = antenna.stowed if antenna.begin is None else antenna.begin
    tail = released_tail(antenna)
    return system_text(antenna, title, theta=theta, fixed=False, gravity=False, offload=0.0, tail=tail)


def fine_files() -> dict[str, str]:
    """Return the files of the fine antenna by name: parts, and its latching without and with play in the hinges."""
    return {
        "petal.inp": petal_mesh(FINE),
        "petal.toml": petal_job(FINE),
        "strut.toml": strut_job(FINE),
        **strut_files(FINE),
        "latching.toml": latching_text(FINE),
        "play.toml": latching_text(replace(FINE, play=HingePlay())),
    }


# petal and strut of the antenna as files: mesh, tables and jobs -------------------------------------------------------


def petal_mesh(antenna: Antenna) -> str:
    """Return the mesh of a petal (Abaqus): a strip of quads along x, width along y, with a rib on its middle line."""
    n, m = antenna.n_along, antenna.n_across
    x = np.linspace(0.0, antenna.petal_length, n + 1)
    y = np.linspace(-0.5, 0.5, m + 1) * antenna.petal_width

    def number(i: int, j: int) -> int:
        return 1 + i * (m + 1) + j

    lines = ["*NODE"]
    lines += [f"{number(i, j)}, {x[i]:.6g}, {y[j]:.6g}, 0" for i in range(n + 1) for j in range(m + 1)]
    lines.append("*ELEMENT, TYPE=S4, ELSET=SKIN")
    for i in range(n):
        for j in range(m):
            corners = number(i, j), number(i + 1, j), number(i + 1, j + 1), number(i, j + 1)
            lines.append(", ".join(map(str, (1 + i * m + j, *corners))))
    lines.append("*ELEMENT, TYPE=B31, ELSET=RIB")
    lines += [f"{1001 + i}, {number(i, m // 2)}, {number(i + 1, m // 2)}" for i in range(n)]
    elbow = round(antenna.geometry.elbow / antenna.petal_length * n)
    lines += ["*NSET, NSET=ROOT", str(number(0, m // 2)), "*NSET, NSET=ELBOW", str(number(elbow, m // 2)),
              "*NSET, NSET=TIP", str(number(n, m // 2))]  # fmt: skip
    return "\n".join(lines) + "\n"


PETAL_JOB = """\
# A petal of the antenna: a skin of aluminium with a box rib on its middle line, from its hinge along x.
[body]
name = "petal"
mesh = "petal.inp"
units = "m-kg-s"
keep = ["TIP"]

[materials.aluminium]
young = 70e9
poisson = 0.33
density = 2700.0
cells = "all"

[shells.skin]
cells = "SKIN"
thickness = 0.0015

[sections.rib]
lines = "RIB"
shape = "box"
width = 0.03
height = 0.06
web = 0.0015
flange = 0.0015
offset = [0.0, -0.03]
orientation = [0, 1, 0]

[interfaces.root]
kind = "rigid"
nodes = "ROOT"

[interfaces.elbow]
kind = "rigid"
nodes = "ELBOW"

[reduction]
set = "craig-bampton"
n_modes = PETAL_MODES
frame = "nodal"
at = "root"

[damping]
ratio = 0.005
"""

STRUT_JOB = """\
# A strut of the antenna: an aluminium tube from its foot at the slider along x to the elbow of a petal.
[body]
name = "strut"
nodes = "strut_nodes.csv"
lines = "strut_lines.csv"
units = "m-kg-s"

[materials.aluminium]
young = 70e9
poisson = 0.33
density = 2700.0

[sections.tube]
shape = "tube"
radius = 0.015
thickness = 0.0015
orientation = [0, 1, 0]

[interfaces.foot]
kind = "rigid"
nodes = "foot"

[interfaces.head]
kind = "rigid"
nodes = "head"

[reduction]
set = "craig-bampton"
n_modes = STRUT_MODES
frame = "nodal"
at = "foot"

[damping]
ratio = 0.005
"""


def petal_job(antenna: Antenna) -> str:
    """Return the job of a petal."""
    return PETAL_JOB.replace("PETAL_MODES", str(antenna.petal_modes))


def strut_job(antenna: Antenna) -> str:
    """Return the job of a strut."""
    return STRUT_JOB.replace("STRUT_MODES", str(antenna.strut_modes))


def strut_files(antenna: Antenna) -> dict[str, str]:
    """Return the tables of the tube of a strut by file name."""
    nodes = f"node, x, y, z, sets\n1, 0, 0, 0, foot\n2, {antenna.geometry.strut:.6g}, 0, 0, head\n"
    return {"strut_nodes.csv": nodes, "strut_lines.csv": "node1, node2, elements\n1, 2, 8\n"}
