from fe_models.body.load_cases import ReducedLoadCase as ReducedLoadCase

from .address import Address as Address
from .address import FoundNodes as FoundNodes
from .geometric_stiffness import GeometricStiffness as GeometricStiffness
from .geometric_stiffness import RotatedLoads as RotatedLoads
from .geometric_stiffness import SpreadLoads as SpreadLoads
from .invariants import Moments as Moments
from .kept_points import KeptPoints as KeptPoints
from .modal_file.file import convert_units as convert_units
from .recovery_table import RecoveryTable as RecoveryTable
from .recovery_table import spin_products as spin_products
from .reduced_body import BodyFrame as BodyFrame
from .reduced_body import ReducedInterface as ReducedInterface
