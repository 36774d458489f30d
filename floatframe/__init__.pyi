from .added_mass import AddedMass as AddedMass
from .added_mass import with_masses as with_masses
from .analyses import Channel as Channel
from .analyses import CoordinateChannel as CoordinateChannel
from .analyses import Equilibrium as Equilibrium
from .analyses import FrequencyResponse as FrequencyResponse
from .analyses import InverseDynamics as InverseDynamics
from .analyses import LinearSystem as LinearSystem
from .analyses import Locus as Locus
from .analyses import StressChannel as StressChannel
from .analyses import SystemModes as SystemModes
from .analyses import campbell as campbell
from .analyses import drive_forces as drive_forces
from .analyses import frequency_response as frequency_response
from .analyses import frozen_bodies as frozen_bodies
from .analyses import inverse_dynamics as inverse_dynamics
from .analyses import kinematics as kinematics
from .analyses import linearize as linearize
from .analyses import quasi_static_bodies as quasi_static_bodies
from .analyses import resolved_frequencies as resolved_frequencies
from .analyses import root_locus as root_locus
from .analyses import snapshot as snapshot
from .analyses import static_equilibrium as static_equilibrium
from .analyses import steady_rotation as steady_rotation
from .analyses import sweep as sweep
from .analyses import system_modes as system_modes
from .analyses import with_motors as with_motors
from .analyses.study import run_study as run_study
from .coordinates import AxialAngle as AxialAngle
from .coordinates import AxialDistance as AxialDistance
from .coordinates import JointCoordinate as JointCoordinate
from .coordinates import PointDistance as PointDistance
from .couplers import CoordinateCoupler as CoordinateCoupler
from .descriptions import FlexiblePart as FlexiblePart
from .descriptions import corotational as corotational
from .descriptions import finite_segments as finite_segments
from .errors import (
    ConvergenceError as ConvergenceError,
)
from .errors import (
    FloatframeError as FloatframeError,
)
from .errors import (
    ModelError as ModelError,
)
from .errors import (
    ResultsError as ResultsError,
)
from .errors import (
    SystemFileError as SystemFileError,
)
from .events import Event as Event
from .export import export_csv as export_csv
from .export import export_vtk as export_vtk
from .flexible_body import FlexibleBody as FlexibleBody
from .force_results import coupler_motion as coupler_motion
from .force_results import user_force_motion as user_force_motion
from .forces import BodyLoad as BodyLoad
from .forces import Bushing as Bushing
from .forces import Gravity as Gravity
from .forces import JointForce as JointForce
from .forces import PointForce as PointForce
from .forces import SphereContact as SphereContact
from .forces import SpringDamper as SpringDamper
from .forces import UserForce as UserForce
from .ground import GROUND as GROUND
from .ground import Ground as Ground
from .initial import ConsistentState as ConsistentState
from .initial import consistent_state as consistent_state
from .initial import mobility as mobility
from .integration import Progress as Progress
from .integration import integrate as integrate
from .integration import resume as resume
from .integrators import EnergyDecaying as EnergyDecaying
from .integrators import EnergyMomentum as EnergyMomentum
from .integrators import GeneralizedAlpha as GeneralizedAlpha
from .integrators import Ida as Ida
from .integrators import Variational as Variational
from .integrators import hht as hht
from .integrators import newmark as newmark
from .integrators import trapezoidal as trapezoidal
from .joint_results import joint_coordinate as joint_coordinate
from .joint_results import joint_coordinates as joint_coordinates
from .joints import ConstantOrientation as ConstantOrientation
from .joints import CylindricalJoint as CylindricalJoint
from .joints import DistanceJoint as DistanceJoint
from .joints import FixedJoint as FixedJoint
from .joints import PlanarJoint as PlanarJoint
from .joints import PointOnLine as PointOnLine
from .joints import PointOnPlane as PointOnPlane
from .joints import PrismaticJoint as PrismaticJoint
from .joints import RevoluteJoint as RevoluteJoint
from .joints import RollingDisc as RollingDisc
from .joints import ScrewJoint as ScrewJoint
from .joints import SlidingJoint as SlidingJoint
from .joints import SphericalJoint as SphericalJoint
from .joints import UniversalJoint as UniversalJoint
from .markers import Marker as Marker
from .measuring import AngleSensor as AngleSensor
from .measuring import ControlSensor as ControlSensor
from .measuring import CoordinateSensor as CoordinateSensor
from .measuring import CouplerSensor as CouplerSensor
from .measuring import DisplacementSensor as DisplacementSensor
from .measuring import ElongationSensor as ElongationSensor
from .measuring import EnergySensor as EnergySensor
from .measuring import ModeSensor as ModeSensor
from .measuring import MomentumSensor as MomentumSensor
from .measuring import PlaceSensor as PlaceSensor
from .measuring import ReactionSensor as ReactionSensor
from .measuring import StrainGauge as StrainGauge
from .measuring import StressSensor as StressSensor
from .measuring import VonMisesSensor as VonMisesSensor
from .measuring import measured as measured
from .mode_film import animate_mode as animate_mode
from .mode_film import draw_mode as draw_mode
from .rigid_body import RigidBody as RigidBody
from .sensors import interface_motion as interface_motion
from .sensors import largest_von_mises as largest_von_mises
from .sensors import nodal_stress as nodal_stress
from .sensors import point_motion as point_motion
from .state import State as State
from .study_file import read_study as read_study
from .system import System as System
from .time_functions import TimeFunction as TimeFunction
from .trajectory import Trajectory as Trajectory
from .trajectory import read_results as read_results
from .validity import ValidityNote as ValidityNote
