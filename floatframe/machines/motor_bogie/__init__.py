"""A bogie with two induction motors on its flexible frame: torque ripple of the supply, and loads of motor mounts."""

from floatframe.machines.motor_bogie.description import SIX_STEPS, Motor, MotorBogie
from floatframe.machines.motor_bogie.systems import SUPPLIES, motor_bogie_file, motor_bogie_files

__all__ = ["SIX_STEPS", "SUPPLIES", "Motor", "MotorBogie", "motor_bogie_file", "motor_bogie_files"]
