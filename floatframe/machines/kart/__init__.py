"""A kart: frame of steel tubes with engine and rear axle as one flexible body, pilot on bushings, four tyres."""

from floatframe.machines.kart.description import Kart, chassis_tables

__all__ = ["Kart", "chassis_tables"]
