"""A four-axle passenger vehicle on bogies: stability over speed, limit cycles, independent wheels, curves."""

from floatframe.machines.bogie.curves_and_comfort import circle, in_circle, weighted_rms
from floatframe.machines.bogie.running import (
    Hunting,
    SpeedSweep,
    critical_speed,
    falling_speed,
    hunting,
    steady_motion_of,
    steady_running,
)
from floatframe.machines.bogie.vehicle import RailVehicle, flexible_frames, vehicle

__all__ = [
    "Hunting",
    "RailVehicle",
    "SpeedSweep",
    "circle",
    "critical_speed",
    "falling_speed",
    "flexible_frames",
    "hunting",
    "in_circle",
    "steady_motion_of",
    "steady_running",
    "vehicle",
    "weighted_rms",
]
