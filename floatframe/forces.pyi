from .model.forces.bushing import Bushing as Bushing
from .model.forces.loads import BodyLoad as BodyLoad
from .model.forces.sphere_contact import SphereContact as SphereContact
