"""A deployable antenna with petals hinged to a spacecraft, pushed outward by struts from one slider on a mast."""

from floatframe.machines.antenna.closed_forms import AntennaGeometry, mechanism
from floatframe.machines.antenna.petals import Pointing, petal_mesh, pointing

__all__ = ["AntennaGeometry", "Pointing", "mechanism", "petal_mesh", "pointing"]
