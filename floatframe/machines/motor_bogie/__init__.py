"""A bogie with two induction motors on its flexible frame: torque ripple of the supply, and loads of motor mounts."""

from floatframe.machines.motor_bogie.closed_forms import Motor
from floatframe.machines.motor_bogie.description import SIX_STEPS, MotorBogie

__all__ = ["SIX_STEPS", "Motor", "MotorBogie"]
