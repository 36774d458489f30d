"""Electric motors, brakes, controllers and maps on a shaft, with their own states, as public elements.

All drives share the controller in `pid` and the functions in `shaft` and `turns`. Each other module contains one drive
and its law.
"""

from floatframe.drives.anti_skid_brake import AntiSkidBrake
from floatframe.drives.dc_motor import DcMotor
from floatframe.drives.induction_motor import InductionMotor
from floatframe.drives.pid import Pid
from floatframe.drives.pid_drive import PidDrive
from floatframe.drives.speed_control import SpeedControl
from floatframe.drives.torque_map import TorqueMap

ELEMENTS = {
    "anti-skid-brake": "floatframe.drives.anti_skid_brake:AntiSkidBrake",
    "dc-motor": "floatframe.drives.dc_motor:DcMotor",
    "induction-motor": "floatframe.drives.induction_motor:InductionMotor",
    "pid": "floatframe.drives.pid_drive:PidDrive",
    "speed-control": "floatframe.drives.speed_control:SpeedControl",
    "torque-map": "floatframe.drives.torque_map:TorqueMap",
}

__all__ = ["ELEMENTS", "AntiSkidBrake", "DcMotor", "InductionMotor", "Pid", "PidDrive", "SpeedControl", "TorqueMap"]
