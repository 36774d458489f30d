"""The kart as files: the job of its chassis, and the system with a rigid or a flexible chassis."""

from dataclasses import dataclass

import numpy as np

__all__ = ["Kart", "chassis_files", "kart_files"]


@dataclass(frozen=True)
class Kart:
    """Parameters of the kart [m, kg, s], tabulated in docs/machines.md. x forward from the rear axle, y left, z up."""

    wheelbase: float = 1.05
    front_half_track: float = 0.53
    rear_half_track: float = 0.55
    front_radius: float = 0.128
    rear_radius: float = 0.140
    front_height: float = 0.125  #: of the wheel centres above the ground
    rear_height: float = 0.137
    rail_height: float = 0.06  #: of the tubes
    kingpin_y: float = 0.42
    caster: float = np.deg2rad(14.0)  #: inclination of the kingpin, with its top to the rear
    kingpin_inclination: float = np.deg2rad(10.0)  #: inclination of the kingpin, with its top inwards
    pilot_mass: float = 75.0
    pilot_place: tuple[float, float, float] = (0.40, 0.0, 0.28)
    engine_mass: float = 20.0
    speed: float = 9.0  #: maintained by the rear axle [m/s]
    steer: float = 0.082  #: step of the steering column within 0.1 s [rad]
    steer_at: float = 1.0  #: time at which it begins to turn [s]
    duration: float = 3.5  #: of the run [s]


def chassis_nodes(kart: Kart) -> dict[str, tuple[float, float, float]]:
    """Return the nodes of the frame by name."""
    h, L = kart.rail_height, kart.wheelbase
    nodes: dict[str, tuple[float, float, float]] = {}
    for side, s in (("left", 1.0), ("right", -1.0)):
        rail = [(-0.10, 0.31), (0.0, 0.32), (0.15, 0.33), (0.35, 0.33), (0.55, 0.31), (0.75, 0.28), (0.95, 0.26)]
        rail += [(L, 0.255), (1.25, 0.24)]
        for k, (x, y) in enumerate(rail):
            nodes[f"rail_{side}_{k}"] = (x, s * y, h)
        nodes[f"bracket_{side}"] = (0.0, s * 0.32, 0.115)
        nodes[f"bearing_{side}"] = (0.0, s * 0.32, kart.rear_height)
        nodes[f"rear_{side}"] = (0.0, s * (kart.rear_half_track - 0.06), kart.rear_height)
        nodes[f"kingpin_{side}"] = (L, s * kart.kingpin_y, kart.front_height)
        nodes[f"bar_{side}"] = (0.95, s * 0.12, h)
    nodes |= {"axle": (0.0, 0.0, kart.rear_height), "column_low": (0.95, 0.0, h), "column_top": (0.72, 0.0, 0.36)}
    return nodes


def chassis_lines() -> list[tuple[str, str, str]]:
    """Return the tubes of the frame, each with two nodes and the section."""
    lines = []
    for side in ("left", "right"):
        lines += [(f"rail_{side}_{k}", f"rail_{side}_{k + 1}", "TUBE") for k in range(8)]
        lines += [(f"rail_{side}_1", f"bracket_{side}", "BRACKET"), (f"rail_{side}_7", f"kingpin_{side}", "TUBE")]
        lines += [(f"rail_{side}_6", f"bar_{side}", "TUBE"), (f"bar_{side}", "column_low", "TUBE")]
        lines += [(f"bar_{side}", "column_top", "THIN")]
        lines += [("axle", f"bearing_{side}", "AXLE"), (f"bearing_{side}", f"rear_{side}", "AXLE")]
    lines += [(f"rail_left_{k}", f"rail_right_{k}", "TUBE") for k in (0, 3, 8)]
    return lines


#: interfaces of the chassis: four wheels, steering column, seat
INTERFACES = {
    "kingpin_left": "kingpin_left", "kingpin_right": "kingpin_right", "rear_left": "rear_left",
    "rear_right": "rear_right", "column_low": "column_low", "column_top": "column_top",
    "seat_rear_left": "rail_left_2", "seat_rear_right": "rail_right_2",
    "seat_front_left": "rail_left_4", "seat_front_right": "rail_right_4",
}  # fmt: skip

JOB = """\
# The chassis of the kart: steel tubes, engine and rear axle in its bearings, ten interfaces, Craig-Bampton.
[body]
name = "chassis"
nodes = "chassis_nodes.csv"
lines = "chassis_lines.csv"
units = "m-kg-s"

[materials.steel]
young = 210e9
poisson = 0.3
density = 7850.0
"""


def chassis_files(kart: Kart, *, has_engine: bool = True, has_axle: bool = True) -> dict[str, str]:
    """Return the job of the chassis and its tables of nodes and lines, by file name."""
    of_axle = ("axle", "bearing_left", "bearing_right", "rear_left", "rear_right")
    nodes = {name: place for name, place in chassis_nodes(kart).items() if has_axle or name not in of_axle}
    number = {name: k + 1 for k, name in enumerate(nodes)}
    rows = [f"{number[n]},{x:g},{y:g},{z:g},{n}" for n, (x, y, z) in nodes.items()]
    lines = [
        f"{number[a]},{number[b]},{section},{4 if section == 'TUBE' else 2}"
        for a, b, section in chassis_lines()
        if a in nodes and b in nodes
    ]
    text = JOB
    for name, group, radius, wall in (
        ("tube", "TUBE", 0.016, 0.002), ("bracket", "BRACKET", 0.02, 0.004), ("thin", "THIN", 0.009, 0.0015),
        ("axle", "AXLE", 0.020, 0.005),
    ):  # fmt: skip
        if name == "axle" and not has_axle:
            continue
        text += f'\n[sections.{name}]\nlines = "{group}"\nshape = "tube"\nradius = {radius}\nthickness = {wall}\n'
    for side in ("left", "right") if has_axle else ():
        text += f"\n[springs.bearing_{side}]  # self-aligning: the axle may bend in it\n"
        text += f'nodes = ["bracket_{side}", "bearing_{side}"]\n'
        text += f"point = [0.0, {nodes[f'bearing_{side}'][1]:g}, {kart.rear_height:g}]\n"
        along, about = (5e7, 1e4) if side == "left" else (1e3, 0.0)  # one bearing holds the axle along and about y
        text += f"stiffness = [5e7, {along:g}, 5e7, 0.0, {about:g}, 0.0]\n"
    if has_engine:
        text += f'\n[masses.engine]\nnode = "rail_right_2"\nmass = {kart.engine_mass}\ninertia = [0.2, 0.2, 0.2]\n'
        text += "offset = [0.0, -0.1, 0.08]\n"
    for name, node in INTERFACES.items():
        if node not in nodes:
            continue
        text += f'\n[interfaces.{name}]\nkind = "rigid"\nnodes = "{node}"\n'
    text += '\n[reduction]\nset = "craig-bampton"\nn_modes = 12\n\n[damping]\nratio = 0.02\n'
    return {
        "chassis.toml": text,
        "chassis_nodes.csv": "node, x, y, z, sets\n" + "\n".join(rows) + "\n",
        "chassis_lines.csv": "node1, node2, group, elements\n" + "\n".join(lines) + "\n",
    }


def kart_files(kart: Kart, *, is_rigid: bool = False) -> dict[str, str]:
    """Return the system file of the kart, with its flexible or a rigid chassis, by file name."""
    nodes, L = chassis_nodes(kart), kart.wheelbase
    up = np.array([-0.625, 0.0, 0.78])
    up /= np.linalg.norm(up)
    out = [
        "# A kart: held at its speed by the rear axle, steered by a step of the column",
        "[system]",
        'units = "m-kg-s"',
        "gravity = [0, 0, -9.81]",
        "",
        "[bodies.chassis]",
        'file = "chassis.h5"',
        f"is_rigid = {str(is_rigid).lower()}",
        f"velocity = [{kart.speed:g}, 0, 0]",
    ]

    def body(name: str, mass: float, inertia: tuple[float, ...], place: tuple[float, ...], spin: float = 0.0) -> None:
        a, b, c = inertia
        out.extend(
            [
                "",
                f"[bodies.{name}]",
                f"mass = {mass:g}",
                f"inertia = [[{a:g}, 0, 0], [0, {b:g}, 0], [0, 0, {c:g}]]",
                f"position = {numbers(place)}",
                f"velocity = [{kart.speed:g}, 0, 0]",
            ]
        )
        if spin:
            out.append(f"omega_B = [0, {spin:.9g}, 0]")

    def revolute(name: str, a: str, marker_a: str, b: str, marker_b: str, axis: tuple[float, ...]) -> None:
        out.extend(
            [
                "",
                f"[joints.{name}]",
                'type = "revolute"',
                f'body_a = "{a}"',
                f"marker_a = {marker_a}",
                f'body_b = "{b}"',
                f"marker_b = {marker_b}",
                f"axis = {numbers(axis)}",
            ]
        )

    body("pilot", kart.pilot_mass, (5.0, 6.0, 3.0), kart.pilot_place)
    out += ["", "[[bodies.pilot.shapes]]", 'type = "box"', "size = [0.25, 0.38, 0.5]", 'color = "red"']
    out += [
        "",
        "[[bodies.pilot.shapes]]",
        'type = "sphere"',
        "radius = 0.13",
        "position = [0.02, 0, 0.4]",
        'color = "dark"',
    ]
    column = nodes["column_low"]
    body("column", 2.5, (0.05, 0.05, 0.02), column)
    out += ["", "[[bodies.column.shapes]]", 'type = "tube"', "radius = 0.01"]
    out += [f"points = [[0, 0, 0], {numbers(0.5 * up)}]"]
    out += [
        "",
        "[[bodies.column.shapes]]",
        'type = "cylinder"',
        "radius = 0.15",
        "inner_radius = 0.13",
        "length = 0.02",
    ]
    out += [f"axis = {numbers(up)}", f"position = {numbers(0.5 * up)}", 'color = "dark"']
    revolute("column", "chassis", '"column_low"', "column", "[0, 0, 0]", tuple(up))
    out += ["", "[joints.column.motions.angle]  # a haversine in 0.1 s", 'type = "piecewise"']
    half, at = kart.steer / 2, kart.steer_at
    out += [f"t = [0, {at:g}, {at + 0.1:g}]", "pieces = [", '    { type = "constant", value = 0.0 },']
    out += [
        f'    {{ type = "harmonic", amplitude = {half:g}, omega = {np.pi / 0.1:.12g}, phase = {-np.pi / 2:.15g}, '
        f"offset = {half:g} }},",
        f'    {{ type = "constant", value = {kart.steer:g} }},',
        "]",
    ]
    pitman = np.cross([0.0, 1.0, 0.0], up) * -0.10  # backwards and down
    for side, s in (("left", 1.0), ("right", -1.0)):
        k = np.array(nodes[f"kingpin_{side}"])
        pin = (-np.tan(kart.caster), -s * np.tan(kart.kingpin_inclination), 1.0)
        spins = {"front": front_spin(kart), "rear": rear_spin(kart)}
        body(f"knuckle_{side}", 1.5, (0.004, 0.004, 0.004), tuple(k))
        revolute(f"kingpin_{side}", "chassis", f'"kingpin_{side}"', f"knuckle_{side}", "[0, 0, 0]", pin)
        hub = (0.0, s * (kart.front_half_track - kart.kingpin_y), 0.0)
        body(
            f"front_{side}",
            2.5,
            (0.010, 0.018, 0.010),
            (L, s * kart.front_half_track, kart.front_height),
            spins["front"],
        )
        revolute(f"hub_{side}", f"knuckle_{side}", numbers(hub), f"front_{side}", "[0, 0, 0]", (0, 1, 0))
        arm = (-0.10, -s * 0.015, -0.02)
        out += ["", f"[joints.tie_rod_{side}]", 'type = "distance"', 'body_a = "column"']
        out += [f"marker_a = {numbers((pitman[0], s * 0.03, pitman[2]))}", f'body_b = "knuckle_{side}"']
        out += [f"marker_b = {numbers(arm)}"]
        body(
            f"rear_{side}", 4.0, (0.022, 0.038, 0.022), (0.0, s * kart.rear_half_track, kart.rear_height), spins["rear"]
        )
        revolute(f"axle_{side}", "chassis", f'"rear_{side}"', f"rear_{side}", numbers((0.0, -s * 0.06, 0.0)), (0, 1, 0))
        for axle, load, radius, width, k_z, C in (
            ("front", 280.0, kart.front_radius, 0.13, 9e4, 6000.0),
            ("rear", 380.0, kart.rear_radius, 0.21, 1.2e5, 9000.0),
        ):
            out += [
                "",
                f"[[bodies.{axle}_{side}.shapes]]",
                'type = "wheel"',
                f"radius = {radius:g}",
                f"width = {width:g}",
            ]
            out += ["", f"[elements.tyre_{axle}_{side}]", 'type = "wheels.brush-tyre"', 'marker_a = {body = "ground"}']
            out += [f'marker_b = {{body = "{axle}_{side}"}}', f"radius = {radius:g}", f"stiffness = {k_z:g}"]
            out += ["damping = 500.0", f"nominal_load = {load:g}", f"slip_stiffness = {C:g}", "contact_length = 0.07"]
            out += ["friction = 1.3", "relaxation_x = 0.06", "relaxation_y = 0.10", "rolling_resistance = 0.015"]
        for place in ("rear", "front"):
            seat = np.array(nodes[INTERFACES[f"seat_{place}_{side}"]]) - np.array(kart.pilot_place)
            out += ["", f"[forces.seat_{place}_{side}]", 'type = "bushing"', 'body_a = "chassis"']
            out += [f'marker_a = "seat_{place}_{side}"', 'body_b = "pilot"', f"marker_b = {numbers(seat)}"]
            out += ["stiffness = [2e5, 2e5, 2e5, 100, 100, 100]", "damping = [400, 400, 400, 1, 1, 1]"]
    out += ["", "[forces.column_top]", 'type = "bushing"', 'body_a = "chassis"', 'marker_a = "column_top"']
    top = np.array(nodes["column_top"]) - np.array(column)
    out += ['body_b = "column"', f"marker_b = {numbers(top)}"]
    out += ["stiffness = [1e5, 1e5, 0, 0, 0, 0]", "damping = [50, 50, 0, 0, 0, 0]"]
    out += ["", "[couplers.live_axle]  # both rear wheels turn alike", "terms = ["]
    out += ['    { joint = "axle_left", coordinate = "angle", factor = 1.0 },']
    out += ['    { joint = "axle_right", coordinate = "angle", factor = -1.0 },', "]"]
    out += [
        "",
        "[elements.engine]",
        'type = "drives.speed-control"',
        'marker_a = {body = "chassis", marker = "rear_left"}',
    ]
    out += ['marker_b = {body = "rear_left"}', "axis = [0, 1, 0]", f"speed = {rear_spin(kart):.9g}"]
    out += [f'target = {{type = "constant", value = {rear_spin(kart):.9g}}}', "gain = 40.0"]
    out += ["rate_time = 0.02", "filter_time = 0.002"]
    for wheel in ("front_left", "front_right", "rear_left", "rear_right"):
        out += ["", f'[sensors."load {wheel.replace("_", " ")}"]', 'type = "element"', f'of = "tyre_{wheel}"']
        out += ['output = "Fz"']
    for name, kind in (("yaw rate", "angular-velocity"), ("acceleration of the pilot", "acceleration")):
        out += ["", f'[sensors."{name}"]', f'type = "{kind}"', 'body = "pilot"', "marker = [0, 0, 0]"]
    out += ["", "[run]", f"t_end = {kart.duration:g}", "h = 2e-3", "rho_inf = 0.8", "output_every = 5"]
    out += ["", "[[scene]]", 'type = "plane"', ""]
    return {"kart_rigid.toml" if is_rigid else "kart.toml": "\n".join(out)}


def front_spin(kart: Kart) -> float:
    """Return the spin of a front wheel that rolls freely, R_e = R_0 - d/3 [rad/s]."""
    return kart.speed / (kart.front_radius - (kart.front_radius - kart.front_height) / 3)


def rear_spin(kart: Kart) -> float:
    """Return the same for a rear wheel."""
    return kart.speed / (kart.rear_radius - (kart.rear_radius - kart.rear_height) / 3)


def numbers(values: tuple[float, ...] | np.ndarray) -> str:
    """Return numbers as a list of TOML."""
    return "[" + ", ".join(f"{0.0 if abs(value) < 1e-14 else float(value):.12g}" for value in values) + "]"
