from .events import Event as Event
from .foreign_units import Coupling as Coupling
from .foreign_units import ForeignUnit as ForeignUnit
from .integrate import Progress as Progress
from .integrate import resume as resume
