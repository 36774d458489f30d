"""Analyses of a system other than a run: equilibrium, driven motion, linearisation, system modes, responses."""

from floatframe.analyses.driven.driven_motion import frozen_bodies, quasi_static_bodies
from floatframe.analyses.driven.inverse_dynamics import InverseDynamics, drive_forces, inverse_dynamics, with_motors
from floatframe.analyses.driven.kinematics import kinematics
from floatframe.analyses.element_check import ElementCheck, check_element
from floatframe.analyses.equilibrium import Equilibrium, static_equilibrium, steady_rotation
from floatframe.analyses.linear.channels import Column
from floatframe.analyses.linear.force_inputs import ForceInput
from floatframe.analyses.linear.frequency_response import FrequencyResponse, frequency_response, resolved_frequencies
from floatframe.analyses.linear.inputs import BaseMotion, DriveMotion, ParameterInput
from floatframe.analyses.linear.linearization import LinearSystem, linearize
from floatframe.analyses.linear.parameter_study import Locus, campbell, root_locus
from floatframe.analyses.linear.state_space import NamedStateSpace, named_state_space, write_state_space
from floatframe.analyses.linear.system_modes import SystemModes, system_modes
from floatframe.analyses.snapshot import snapshot
from floatframe.analyses.steady.steady_motion import SteadyMotion, steady_motion
from floatframe.analyses.sweep import sweep

__all__ = [
    "BaseMotion",
    "Column",
    "DriveMotion",
    "ElementCheck",
    "Equilibrium",
    "ForceInput",
    "FrequencyResponse",
    "InverseDynamics",
    "LinearSystem",
    "Locus",
    "NamedStateSpace",
    "ParameterInput",
    "SteadyMotion",
    "SystemModes",
    "campbell",
    "check_element",
    "drive_forces",
    "frequency_response",
    "frozen_bodies",
    "inverse_dynamics",
    "kinematics",
    "linearize",
    "named_state_space",
    "quasi_static_bodies",
    "resolved_frequencies",
    "root_locus",
    "snapshot",
    "static_equilibrium",
    "steady_motion",
    "steady_rotation",
    "sweep",
    "system_modes",
    "with_motors",
    "write_state_space",
]
