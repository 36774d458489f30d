"""A road car with flexible body, double wishbones, interconnected hydraulic roll control, and a lane change."""

from floatframe.machines.road_car.body import body_mesh
from floatframe.machines.road_car.closed_forms import CarOnPosts
from floatframe.machines.road_car.description import Axle, RoadCar, RollControl
from floatframe.machines.road_car.linkage import Linkage

__all__ = ["Axle", "CarOnPosts", "Linkage", "RoadCar", "RollControl", "body_mesh"]
