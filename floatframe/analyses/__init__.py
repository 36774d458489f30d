"""Analyses of a system besides its motion: equilibrium, steady rotation, linearisation, system modes, responses."""

from floatframe.analyses.channels import Channel
from floatframe.analyses.equilibrium import Equilibrium, static_equilibrium, steady_rotation
from floatframe.analyses.linear_system import LinearSystem, linearize
from floatframe.analyses.parameter_study import Locus, campbell, root_locus
from floatframe.analyses.sweep import sweep
from floatframe.analyses.system_modes import SystemModes, system_modes

__all__ = [
    "Channel",
    "Equilibrium",
    "LinearSystem",
    "Locus",
    "SystemModes",
    "campbell",
    "linearize",
    "root_locus",
    "static_equilibrium",
    "steady_rotation",
    "sweep",
    "system_modes",
]
