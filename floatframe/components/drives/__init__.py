"""Electric motors, brakes, controllers and maps on a shaft, with their own states, as public elements.

All drives share the controller in `pid` and the functions in `shaft` and `turns`. Each other module contains one drive
and its law.
"""

from floatframe.components.drives.anti_skid_brake import AntiSkidBrake
from floatframe.components.drives.dc_motor import DcMotor
from floatframe.components.drives.induction_motor import InductionMotor
from floatframe.components.drives.pid import Pid
from floatframe.components.drives.pid_drive import PidDrive
from floatframe.components.drives.speed_control import SpeedControl
from floatframe.components.drives.torque_map import TorqueMap

ELEMENTS = {
    "anti-skid-brake": "floatframe.components.drives.anti_skid_brake:AntiSkidBrake",
    "dc-motor": "floatframe.components.drives.dc_motor:DcMotor",
    "induction-motor": "floatframe.components.drives.induction_motor:InductionMotor",
    "pid": "floatframe.components.drives.pid_drive:PidDrive",
    "speed-control": "floatframe.components.drives.speed_control:SpeedControl",
    "torque-map": "floatframe.components.drives.torque_map:TorqueMap",
}

__all__ = ["AntiSkidBrake", "DcMotor", "InductionMotor", "Pid", "PidDrive", "SpeedControl", "TorqueMap"]
