from .bodies.added_mass import AddedMass as AddedMass
from .bodies.added_mass import with_masses as with_masses
from .bodies.ground import Ground as Ground
from .bodies.mode_choice import with_modes as with_modes
from .elements.element import Element as Element
from .elements.element import ElementLaw as ElementLaw
from .functions.time_functions import TimeFunction as TimeFunction
from .rotations import rotation_matrix as rotation_matrix
