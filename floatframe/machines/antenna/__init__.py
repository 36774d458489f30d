"""A deployable antenna: petals hinged at a spacecraft, pushed outward by struts from one slider on a mast."""

from floatframe.machines.antenna.closed_forms import AntennaGeometry, mechanism
from floatframe.machines.antenna.description import Antenna
from floatframe.machines.antenna.systems import antenna_files

__all__ = ["Antenna", "AntennaGeometry", "antenna_files", "mechanism"]
