"""A deployable antenna with petals hinged to a spacecraft, pushed outward by struts from one slider on a mast."""

from floatframe.machines.antenna.closed_forms import AntennaGeometry, mechanism
from floatframe.machines.antenna.description import FINE, Antenna, HingePlay
from floatframe.machines.antenna.systems import antenna_files, fine_files, pointing

__all__ = ["FINE", "Antenna", "AntennaGeometry", "HingePlay", "antenna_files", "fine_files", "mechanism", "pointing"]
