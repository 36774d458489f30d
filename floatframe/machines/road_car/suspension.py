"""The tables of an axle for a system file: subframe, wishbones, uprights, wheels, springs, bars, tyres.

Every body except the wheels has the axes of the car, so that a point of the suspension has the same coordinates on both
bodies connected there. A corner has one degree of freedom and no redundant constraint: two hinges (5 rows each), two
ball joints (3 each) and a rod (1) constrain 17 of the 18 degrees of freedom of both wishbones and the upright.
"""

from collections.abc import Sequence
from typing import Any

import numpy as np

from fe_models.foundation.arrays import Array
from floatframe.machines.road_car.description import CORNERS, Axle, RoadCar

__all__ = ["Tables", "axle_tables", "rounded"]

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
