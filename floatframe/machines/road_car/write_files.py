"""The files of the road car, as they are shipped or for other numbers."""

from typing import Any

import numpy as np

from floatframe.machines.road_car.body import body_files
from floatframe.machines.road_car.closed_forms import MODES
from floatframe.machines.road_car.description import CORNERS, RoadCar
from floatframe.machines.road_car.systems import (
    car_file,
    lane_change,
    rig_file,
    sine_steer,
    steady_circle,
    twisted_road,
)

__all__ = ["post_motion", "road_car_files"]


def post_motion(height: float = 0.03) -> dict[str, dict[str, Any]]:
    """Return heights of the posts over time: in the first second roll, in the second warp, one wave each [m]."""
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
