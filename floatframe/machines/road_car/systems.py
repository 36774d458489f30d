"""Systems of the road car as files: on its wheels in a manoeuvre, and with its wheels on the posts of a rig."""

from collections.abc import Sequence
from typing import Any

import numpy as np

from cms.jobs.decks.job_text import toml_text
from fe_models.foundation.arrays import Array
from floatframe.machines.road_car.body import body_files
from floatframe.machines.road_car.closed_forms import MODES
from floatframe.machines.road_car.description import CORNERS, Axle, RoadCar
from floatframe.machines.road_car.linkage import spring_preload

__all__ = [
    "SUPPORTS",
    "Tables",
    "axle_tables",
    "car_file",
    "lane_change",
    "post_motion",
    "rig_file",
    "road_car_files",
    "rounded",
    "sine_steer",
    "steady_circle",
    "twisted_road",
]


# the tables of an axle for a system file: subframe, wishbones, uprights, wheels, springs, bars, tyres -----------------
# Every body except the wheels has the axes of the car, so that a point of the suspension has the same coordinates on
# both bodies connected there. A corner has one degree of freedom and no redundant constraint: two hinges (5 rows each),
# two ball joints (3 each) and a rod (1) constrain 17 of the 18 degrees of freedom of both wishbones and the upright.


Tables = dict[str, dict[str, Any]]

STOP_WAY = (0.0, 0.01, 0.02, 0.04)  #: compression of a bump stop [m]
STOP_FORCE = (0.0, 700.0, 2400.0, 9000.0)  #: force of the bump stop [N]


def rounded(values: Sequence[float] | Array) -> list[float]:
    """Return numbers rounded to the digits needed in a file."""
    return [float(f"{float(v):.10g}") + 0.0 for v in np.asarray(values, dtype=float)]


def solid(mass: float, inertia: Sequence[float], place: Array | Sequence[float], speed: float) -> dict[str, Any]:
    """Return a rigid body in axes of the car with its centre of mass at a place."""
    a, b, c = inertia
    return {
        "mass": mass,
        "inertia": [[a, 0, 0], [0, b, 0], [0, 0, c]],
        "center_of_mass": rounded(place),
        "velocity": [speed, 0, 0],
    }


def tube(points: Sequence[Array], radius: float = 0.014, color: str = "dark") -> dict[str, Any]:
    """Return a tube along points."""
    return {"type": "tube", "radius": radius, "points": [rounded(point) for point in points], "color": color}


def axle_tables(car: RoadCar, name: str, *, has_bar: bool, has_wheels: bool = True) -> Tables:
    """Return the tables of the axle "front" or "rear", optionally with wheels and tyres."""
    axle = car.axle(name)
    tables: Tables = {"bodies": {}, "joints": {}, "forces": {}, "elements": {}}
    add_subframe(car, name, tables)
    for corner, (of, side) in CORNERS.items():
        if of != name:
            continue
        add_arms(car, corner, axle, side, tables)
        if has_wheels:
            add_wheel(car, corner, axle, side, tables)
    if has_bar:
        tables["forces"][f"bar_{name}"] = {
            "type": "user-force",
            "coordinates": {
                side: {"joint": f"lower_{name}_{side}", "coordinate": "angle"} for side in ("left", "right")
            },
            "forces": {"left": "-k*(left + right)", "right": "-k*(left + right)"},
            "parameters": {"k": axle.bar},
        }
    return tables


def add_subframe(car: RoadCar, name: str, tables: Tables) -> None:
    """Add the subframe on its four mounts; that of the front axle has the rack."""
    axle, speed = car.axle(name), 0.0
    middle = 0.5 * (axle.point("lower_front", 1) + axle.point("lower_rear", 1)) * (1, 0, 1)
    body = solid(car.subframe, (1.6, 1.2, 2.4), middle, speed)
    ends = [[axle.point(point, s) for s in (1, -1)] for point in ("lower_front", "lower_rear")]
    body["shapes"] = [tube(each, 0.03) for each in ends]
    for side, s in (("left", 1), ("right", -1)):
        body["shapes"].append(tube([axle.point("lower_front", s), axle.point("lower_rear", s)], 0.03))
        for end, (x, y, z) in zip(("front", "rear"), axle.mounts, strict=True):
            mount = {
                "body_a": "chassis",
                "marker_a": f"{name}_mount_{end}_{side}",
                "body_b": f"subframe_{name}",
                "marker_b": rounded((x, s * y, z)),
            }
            k, c = car.mount_stiffness, car.mount_damping
            if k is None:
                tables["joints"][f"mount_{name}"] = {"type": "fixed"} | mount
            else:
                stiffness = {"stiffness": [k, k, k, 0, 0, 0], "damping": [c, c, c, 0, 0, 0]}
                tables["forces"][f"mount_{name}_{end}_{side}"] = {"type": "bushing"} | mount | stiffness
            body["shapes"].append(tube([axle.point(f"lower_{end}", s), np.array((x, s * y, z))], 0.025))
            body["shapes"].append(tube([axle.point(f"lower_{end}", s), axle.point(f"upper_{end}", s)], 0.02))
    tables["bodies"][f"subframe_{name}"] = body
    if name == "front":
        rack = solid(car.rack, (0.12, 0.002, 0.12), axle.point("rod_inner", 1) * (1, 0, 1), speed)
        rack["shapes"] = [tube([axle.point("rod_inner", 1), axle.point("rod_inner", -1)], 0.012, "steel")]
        tables["bodies"]["rack"] = rack
        guide = rounded(axle.point("rod_inner", 1) * (1, 0, 1))
        tables["joints"]["rack"] = {
            "type": "prismatic",
            "body_a": "subframe_front",
            "marker_a": guide,
            "body_b": "rack",
            "marker_b": guide,
            "axis": [0, 1, 0],
        }


def add_arms(car: RoadCar, corner: str, axle: Axle, side: int, tables: Tables) -> None:
    """Add wishbones, upright, rod, spring with damper and stops of a corner."""
    name = CORNERS[corner][0]
    subframe = f"subframe_{name}"
    p = {key: axle.point(key, side) for key in ("centre", "lower_ball", "upper_ball", "rod_outer", "rod_inner", "seat")}
    for level, mass in (("lower", car.lower_arm), ("upper", car.upper_arm)):
        front, rear, ball = (axle.point(f"{level}_{end}", side) for end in ("front", "rear", "ball"))
        arm = solid(mass, (0.01 * mass, 0.01 * mass, 0.02 * mass), (front + rear + 2 * ball) / 4, 0.0)
        arm["shapes"] = [tube([front, ball, rear])]
        if level == "lower":
            arm["shapes"].append(tube([front, axle.point("jack", side), axle.point("seat", side), rear]))
        tables["bodies"][f"{level}_{corner}"] = arm
        hinge = rounded(front)
        tables["joints"][f"{level}_{corner}"] = {
            "type": "revolute",
            "body_a": subframe,
            "marker_a": hinge,
            "body_b": f"{level}_{corner}",
            "marker_b": hinge,
            "axis": rounded(rear - front),
        }
        tables["joints"][f"{level}_ball_{corner}"] = {
            "type": "spherical",
            "body_a": f"{level}_{corner}",
            "marker_a": rounded(ball),
            "body_b": f"upright_{corner}",
            "marker_b": rounded(ball),
        }
    upright = solid(car.upright, (0.25, 0.25, 0.15), p["centre"] - (0.0, side * 0.05, 0.0), 0.0)
    hub = p["centre"] - (0.0, side * 0.06, 0.0)
    upright["shapes"] = [
        tube([p["lower_ball"], hub, p["upper_ball"]], 0.022, "steel"),
        tube([hub, p["rod_outer"]], 0.016, "steel"),
    ]
    tables["bodies"][f"upright_{corner}"] = upright
    tables["joints"][f"rod_{corner}"] = {
        "type": "distance",
        "body_a": "rack" if name == "front" else subframe,
        "marker_a": rounded(p["rod_inner"]),
        "body_b": f"upright_{corner}",
        "marker_b": rounded(p["rod_outer"]),
    }
    bump, rebound = car.bump_gap, car.rebound_gap
    ways = [-bump - way for way in reversed(STOP_WAY)] + [rebound + way for way in STOP_WAY]
    stops = [-force for force in reversed(STOP_FORCE)] + list(STOP_FORCE)
    tables["forces"][f"spring_{corner}"] = {
        "type": "spring-damper",
        "body_a": "chassis",
        "marker_a": f"{name}_tower_{corner.split('_')[1]}",
        "body_b": f"lower_{corner}",
        "marker_b": rounded(p["seat"]),
        "stiffness": axle.spring,
        "damping": axle.damper,
        "preload": -axle.preload,
        "characteristic": {"type": "table", "t": rounded(ways), "values": stops, "interpolation": "monotone"},
    }


def add_wheel(car: RoadCar, corner: str, axle: Axle, side: int, tables: Tables) -> None:
    """Add wheel, hub and tyre of a corner; the wheel has its origin in its centre."""
    centre = axle.point("centre", side)
    a, b = 0.6 * car.spin_inertia, car.spin_inertia
    tables["bodies"][f"wheel_{corner}"] = {
        "mass": car.wheel,
        "inertia": [[a, 0, 0], [0, b, 0], [0, 0, a]],
        "position": rounded(centre),
        "omega_B": [0, 0, 0],
        "shapes": [{"type": "wheel", "radius": car.radius, "width": 0.205}],
    }
    tables["joints"][f"hub_{corner}"] = {
        "type": "revolute",
        "body_a": f"upright_{corner}",
        "marker_a": rounded(centre),
        "body_b": f"wheel_{corner}",
        "marker_b": [0, 0, 0],
        "axis": [0, 1, 0],
    }
    tables["elements"][f"tyre_{corner}"] = {
        "type": "wheels.magic-formula-tyre",
        "marker_a": {"body": "ground"},
        "marker_b": {"body": f"wheel_{corner}"},
        "shipped": "passenger_car_61",
        "side": "left" if side > 0 else "right",
    }


# systems --------------------------------------------------------------------------------------------------------------


#: system that supports the body against roll beside its springs
SUPPORTS = ("hydraulic", "bars", "none")
ROLLING = 0.3103  #: radius of a loaded wheel: speed divided by spin at the start [m]

Manoeuvre = dict[str, Any]


def lane_change(car: RoadCar, *, offset: float = 3.5, way: float = 36.0, stay: float = 20.0) -> Manoeuvre:
    """Return a double lane change by a driver who looks ahead; lengths in m."""
    places = np.cumsum([0.0, 8.0, way, stay, way])
    there = {"type": "smooth-step", "t_start": 0.0, "t_end": way, "first": 0.0, "last": offset}
    pieces = [
        {"type": "constant", "value": 0.0}, there, {"type": "constant", "value": offset},
        there | {"first": offset, "last": 0.0}, {"type": "constant", "value": 0.0},
    ]  # fmt: skip
    t_end = round(float(places[-1] + 20.0) / car.speed, 1)
    return {"driver": {"type": "piecewise", "t": rounded(places), "pieces": pieces}, "t_end": t_end}


def sine_steer(car: RoadCar, *, rack: float = 0.006, frequency: float = 0.5) -> Manoeuvre:
    """Return one period of a sine of the rack [m, Hz] after half a second: ISO 7401, open loop."""
    period = 1 / frequency
    wave = {"type": "harmonic", "amplitude": rack, "omega": 2 * np.pi * frequency}
    rest = {"type": "constant", "value": 0.0}
    hand = {"type": "piecewise", "t": [0.0, 0.5, 0.5 + period], "pieces": [rest, wave, rest]}
    return {"hand": hand, "t_end": 0.5 + period + 1.5}


def steady_circle(car: RoadCar, *, rack: float, settled: float = 4.0) -> Manoeuvre:
    """Return a steering ramp of one second to a constant rack displacement [m], at constant speed: ISO 4138."""
    turn = {"type": "smooth-step", "t_start": 0.2, "t_end": 1.2, "first": 0.0, "last": -rack}
    return {"rack": turn, "t_end": settled}


def twisted_road(car: RoadCar, *, wave: float, height: float = 0.03, speed: float = 5.0) -> Manoeuvre:
    """Return straight running over a road with sine waves of a length [m], opposite on its left and right.

    A wave as long as twice the wheelbase twists the car, one as long as the wheelbase rolls it.
    """
    x = np.arange(-4.0, 40.0, 0.2)
    rise = np.clip((x - 3.0) / wave, 0.0, 1.0)
    z = height * rise**2 * (3 - 2 * rise) * np.sin(2 * np.pi * (x - 3.0) / wave)
    sides = {side: [float(f"{side * v:.4g}") + 0.0 for v in z] for side in (1, -1)}
    roads = {side: {"type": "profile", "x": rounded(x), "z": sides[side]} for side in sides}
    return {"roads": roads, "rack": {"type": "constant", "value": 0.0}, "t_end": 5.0, "speed": speed}


def roll_control(car: RoadCar) -> dict[str, Any]:
    """Return the circuit: heads of one side and rods of the other share a line, with gas behind an orifice."""
    c = car.control
    rows: list[dict[str, Any]] = []
    for corner, (name, side) in CORNERS.items():
        axle = car.axle(name)
        design = float(np.linalg.norm(np.subtract(axle.tower, axle.jack)))
        rows.append(
            {
                "type": "cylinder",
                "name": corner,
                "marker_a": {"body": "chassis", "marker": f"{name}_tower_{corner.split('_')[1]}"},
                "marker_b": {"body": f"lower_{corner}", "marker": rounded(axle.point("jack", side))},
                "head_area": c.head_area,
                "rod_area": c.rod_area,
                "head": "line_left" if side > 0 else "line_right",
                "rod": "line_right" if side > 0 else "line_left",
                "stroke": c.stroke,
                "retracted_length": float(f"{design - c.at_design:.10g}"),
                "head_dead_volume": c.dead_volume,
                "rod_dead_volume": c.dead_volume,
            }
        )
    nodes: dict[str, dict[str, float]] = {}
    for line in ("left", "right"):
        valve: dict[str, Any] = {"type": "orifice", "name": f"valve_{line}", "a": f"line_{line}", "b": f"gas_{line}"}
        rows.append(valve | {"area": c.orifice, "transition": c.transition})
        rows.append(
            {
                "type": "accumulator",
                "name": f"ball_{line}",
                "node": f"gas_{line}",
                "gas_volume": c.gas_volume,
                "charge": c.charge,
                "exponent": c.exponent,
            }
        )
        nodes[f"line_{line}"] = {"pressure": c.pressure}
        nodes[f"gas_{line}"] = {"pressure": c.pressure, "volume": c.dead_volume}
    return {
        "type": "hydraulics.circuit",
        "fluid": {"density": c.density, "bulk_modulus": c.bulk_modulus, "ambient": c.ambient},
        "nodes": nodes,
        "components": rows,
    }


def base(car: RoadCar, support: str, *, is_rigid: bool, has_wheels: bool) -> Tables:
    """Return body and axles."""
    tables: Tables = {
        "bodies": {"chassis": {"file": "body.h5", "is_rigid": is_rigid}}, "joints": {}, "forces": {}, "couplers": {},
        "elements": {}, "sensors": {},
    }  # fmt: skip
    for name in ("front", "rear"):
        for kind, rows in axle_tables(car, name, has_bar=support == "bars", has_wheels=has_wheels).items():
            tables[kind] |= rows
    for corner, (name, _) in CORNERS.items():
        tables["forces"][f"spring_{corner}"]["preload"] = float(f"{-spring_preload(car, name, support):.6g}")
    if support == "hydraulic":
        tables["elements"]["roll_control"] = roll_control(car)
    return tables


def car_file(
    car: RoadCar,
    manoeuvre: Manoeuvre,
    words: str,
    *,
    support: str = "hydraulic",
    is_rigid: bool = False,
    h: float = 4e-3,
) -> str:
    """Return the system file of the car in a manoeuvre, with one of SUPPORTS."""
    tables = base(car, support, is_rigid=is_rigid, has_wheels=True)
    speed = manoeuvre.get("speed", car.speed)
    for body in tables["bodies"].values():
        body["velocity"] = [float(f"{speed:.10g}"), 0, 0]
    spin = float(f"{speed / ROLLING:.10g}")
    for corner in CORNERS:
        tables["bodies"][f"wheel_{corner}"]["omega_B"] = [0, spin, 0]
        if "roads" in manoeuvre:
            tables["elements"][f"tyre_{corner}"]["road"] = manoeuvre["roads"][CORNERS[corner][1]]
    tables["forces"]["engine"] = {
        "type": "user-force",
        "coordinates": {side: {"joint": f"hub_rear_{side}", "coordinate": "angle"} for side in ("left", "right")},
        "forces": dict.fromkeys(("left", "right"), TORQUE),
        "states": {"slow": spin},
        "rates": {"slow": f"({SPIN} - slow)/filter"},
        "parameters": {"w": spin, "gain": 200.0, "rate_time": 0.02, "filter": 0.01},
    }
    if "rack" in manoeuvre:
        tables["joints"]["rack"]["motions"] = {"distance": manoeuvre["rack"]}
    if "driver" in manoeuvre:
        tables["elements"]["driver"] = driver(manoeuvre["driver"], speed)
    if "hand" in manoeuvre:
        tables["elements"]["hand"] = hand(manoeuvre["hand"])
    tables["elements"]["seen"] = {
        "type": "elements.expressions",
        "places": {"ground": {"body": "ground"}, "car": {"body": "chassis", "marker": "cockpit"}},
        "terms": TURNED,
        "outputs": {
            "x": "car_x",
            "y": "car_y",
            "yaw": "heading",
            "yaw_rate": "car_wz",
            "roll": "asin(versine*car_ry*car_rz + sine*car_rx)",
            "side_slip": "atan2(car_vy, car_vx + 1e-9) - heading",
            "speed": "sqrt(car_vx^2 + car_vy^2 + 1e-12)",
        },
        "output_units": {
            "x": "m", "y": "m", "yaw": "rad", "yaw_rate": "rad/s", "roll": "rad", "side_slip": "rad", "speed": "m/s"
        },
    }  # fmt: skip
    for output in ("y", "roll", "side_slip", "yaw_rate"):
        tables["sensors"][output.replace("_", " ")] = {"type": "element", "of": "seen", "output": output}
    tables["sensors"]["acceleration"] = {"type": "acceleration", "body": "chassis", "marker": "cockpit"}
    for corner, (name, side) in CORNERS.items():
        words_of = corner.replace("_", " ")
        tables["sensors"][f"load {words_of}"] = {"type": "element", "of": f"tyre_{corner}", "output": "Fz"}
        tables["sensors"][f"turn {words_of}"] = {
            "type": "rotation-vector", "body": f"upright_{corner}",
            "marker": rounded(car.axle(name).point("centre", side)),
            "relative_to": "chassis", "relative_marker": "cockpit",
        }  # fmt: skip
    if "driver" in manoeuvre:
        for output in ("error", "hand"):
            tables["sensors"][output] = {"type": "element", "of": "driver", "output": output}
    if support == "hydraulic":
        for line in ("left", "right"):
            pressure = {"type": "element", "of": "roll_control", "output": f"pressure line_{line}"}
            tables["sensors"][f"pressure {line}"] = pressure
    run = {"t_end": manoeuvre["t_end"], "h": h, "rho_inf": 0.8, "tolerance": 1e-7, "output_every": 5}
    tail = '[[scene]]\ntype = "plane"\n'
    if "driver" in manoeuvre:
        tail = scene(manoeuvre["driver"])
    return written(words, tables, run) + tail


#: the rotation matrix of the cockpit from its rotation vector r, R = cos 1 + sin/angle [r]x + (1 - cos)/angle² r rT
TURNED = {
    "angle": "sqrt(car_rx^2 + car_ry^2 + car_rz^2 + 1e-12)",
    "sine": "sin(angle)/angle",
    "versine": "(1 - cos(angle))/angle^2",
    "heading": "atan2(versine*car_rx*car_ry + sine*car_rz, cos(angle) + versine*car_rx^2)",
}
SPIN = "0.5*(left_dot + right_dot)"
#: each rear wheel takes half of C = K ((w_target - w) - lambda dw/dt), with w their mean, as by a differential
TORQUE = f"0.5*gain*(w - {SPIN} - rate_time*({SPIN} - slow)/filter)"


def driver(path: dict[str, Any], speed: float) -> dict[str, Any]:
    """Return a driver model, which steers by the distance of a preview point from the path, with a lag."""
    return {
        "type": "elements.expressions",
        "places": {
            "car": {"body": "subframe_front"}, "rack": {"body": "rack"}, "road": {"body": "ground"},
        },
        "terms": ON_GROUND,
        "states": {"hand": 0.0},
        "rates": {"hand": "(gain*(path(car_x + ahead*axis_x) - car_y - ahead*axis_y) - hand)/lag"},
        "forces": {"rack_Fy": "-k*(rack_y + hand) - c*rack_vy"},
        "outputs": {"error": "path(car_x) - car_y", "hand": "hand", "force": "-k*(rack_y + hand) - c*rack_vy"},
        "output_units": {"error": "m", "hand": "m", "force": "N"},
        "parameters": {"ahead": float(f"{0.6 * speed:.6g}"), "gain": 0.0085, "lag": 0.10} | COLUMN,
        "functions": {"path": path},
    }  # fmt: skip


def hand(turn: dict[str, Any]) -> dict[str, Any]:
    """Return a steering column that pulls the rack towards a displacement given as a function of time."""
    return {
        "type": "elements.expressions",
        "places": {"car": {"body": "subframe_front"}, "rack": {"body": "rack"}},
        "forces": {"rack_Fy": "-k*(rack_y + hand(t)) - c*rack_vy"},
        "outputs": {"hand": "hand(t)", "force": "-k*(rack_y + hand(t)) - c*rack_vy"},
        "output_units": {"hand": "m", "force": "N"},
        "parameters": COLUMN,
        "functions": {"hand": turn},
    }


COLUMN = {"k": 3e6, "c": 1e4}  #: stiffness and damping of the steering column at the rack [N/m, N s/m]
#: position of the car on the ground and its longitudinal axis, from the position d and the rotation vector r of the
#: ground relative to the car: -(cos d - sin/angle r x d + (1 - cos)/angle² (r d) r), and the same for (1, 0, 0)
ON_GROUND = {
    "angle": "sqrt(road_rx^2 + road_ry^2 + road_rz^2 + 1e-12)",
    "sine": "sin(angle)/angle",
    "versine": "(1 - cos(angle))/angle^2",
    "along": "road_rx*road_x + road_ry*road_y + road_rz*road_z",
    "car_x": "sine*(road_ry*road_z - road_rz*road_y) - cos(angle)*road_x - versine*along*road_rx",
    "car_y": "sine*(road_rz*road_x - road_rx*road_z) - cos(angle)*road_y - versine*along*road_ry",
    "axis_x": "cos(angle) + versine*road_rx^2",
    "axis_y": "versine*road_rx*road_ry - sine*road_rz",
}


def scene(path: dict[str, Any]) -> str:
    """Return the road, and cones beside the path."""
    out = ['[[scene]]\ntype = "road"\npoints = [[-10, 1.75, 0], [180, 1.75, 0]]\nwidth = 8\n']
    _, a, b, c, d = path["t"]
    offset = path["pieces"][2]["value"]
    for x, y in [(0.0, 0.0), (a, 0.0), (b, offset), (c, offset), (d, 0.0), (d + 15.0, 0.0)]:
        for s in (-1.2, 1.2):
            out.append(
                f'[[scene]]\ntype = "cylinder"\nradius = 0.14\nend_radius = 0.03\nlength = 0.5\n'
                f'position = [{x:g}, {y + s:g}, 0.25]\ncolor = "orange"\n'
            )
    return "\n".join(out)


def rig_file(
    car: RoadCar, words: str, *, support: str = "hydraulic", heights: dict[str, dict[str, Any]] | None = None
) -> str:
    """Return the car with its body fixed, on four posts; the height [m] of each wheel is a function of time."""
    tables = base(car, support, is_rigid=True, has_wheels=False)
    tables["joints"]["stand"] = {
        "type": "fixed", "body_a": "ground", "marker_a": rounded(car.cockpit),
        "body_b": "chassis", "marker_b": "cockpit",
    }  # fmt: skip
    for corner, (name, side) in CORNERS.items():
        centre = car.axle(name).point("centre", side)
        tables["couplers"][f"post_{corner}"] = {
            "constant": (heights or {}).get(corner, {"type": "constant", "value": 0.0}),
            "terms": [
                {
                    "type": "axial-distance", "body_a": "ground", "marker_a": rounded(centre), "axis": [0, 0, 1],
                    "body_b": f"upright_{corner}", "marker_b": rounded(centre), "factor": 1.0,
                }
            ],
        }  # fmt: skip
        tables["sensors"][f"post {corner.replace('_', ' ')}"] = {"type": "coupler", "of": f"post_{corner}"}
    tables["joints"]["rack"]["motions"] = {"distance": {"type": "constant", "value": 0.0}}
    run = {"t_end": 2.0, "h": 4e-3, "output_every": 5}
    return written(words, tables, run, gravity=0.0)


def written(words: str, tables: Tables, run: dict[str, Any], gravity: float = -9.81) -> str:
    """Return a system file."""
    head = {"system": {"units": "m-kg-s", "gravity": [0, 0, gravity]}}
    filled = {key: rows for key, rows in tables.items() if rows}
    return f"# {words}\n" + toml_text(head | filled | {"run": run})


# the files of the road car, as they are shipped or for other numbers --------------------------------------------------


def post_motion(height: float = 0.03) -> dict[str, dict[str, Any]]:
    """Return heights of the posts over time: one wave of roll in the first second, one wave of warp in the next [m]."""
    wave = {"type": "harmonic", "omega": 2 * np.pi, "phase": -np.pi / 2}
    heights = {}
    for corner, roll, warp in zip(CORNERS, MODES["roll"], MODES["warp"], strict=True):
        pieces = [wave | {"amplitude": 0.5 * height * way, "offset": 0.5 * height * way} for way in (roll, warp)]
        heights[corner] = {"type": "piecewise", "t": [0.0, 1.0], "pieces": pieces}
    return heights


def road_car_files(car: RoadCar | None = None) -> dict[str, str]:
    """Return all files but README.md and the study of the suspension by name."""
    car = car or RoadCar()
    change, twist = lane_change(car), twisted_road(car, wave=2 * car.wheelbase)
    oil, bars = "A road car with interconnected hydraulic roll control", "The road car with anti-roll bars"
    lanes = "in a double lane change at 65 km/h"
    runs = {
        "lane_change": car_file(car, change, f"{oil} and a flexible body {lanes}"),
        "lane_change_rigid": car_file(car, change, f"{oil} {lanes}, its body rigid", is_rigid=True),
        "lane_change_bars": car_file(car, change, f"{bars} {lanes}, its body rigid", support="bars", is_rigid=True),
        "sine_steer": car_file(car, sine_steer(car), f"{oil}: one period of a sine of the rack, open loop"),
        "circle": car_file(car, steady_circle(car, rack=0.004), f"{oil} turns into a steady circle", is_rigid=True),
        "twist": car_file(car, twist, f"{oil} on a road that twists it"),
        "twist_bars": car_file(car, twist, f"{bars} on a road that twists it", support="bars"),
        "rig": rig_file(car, f"{oil} on four posts: a wave of roll, then a wave of warp", heights=post_motion()),
    }
    return body_files(car) | {f"{name}.toml": text for name, text in runs.items()}
