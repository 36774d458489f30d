from .cosimulation.coupled_motion import co_simulate as co_simulate
from .importers.read_urdf import read_urdf as read_urdf
from .importers.robot import Robot as Robot
from .importers.robot_system import FlexibleLink as FlexibleLink
from .importers.robot_system import RobotSystem as RobotSystem
from .importers.robot_system import robot_system as robot_system
from .importers.system_robot import robot_of_system as robot_of_system
from .importers.system_robot import write_urdf as write_urdf
