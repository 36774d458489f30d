from .body.load_cases import LoadCase as LoadCase
from .body.loads import gravity_load as gravity_load
from .body.loads import interface_load as interface_load
from .body.loads import nodal_load as nodal_load
from .body.loads import pressure_load as pressure_load
from .body.loads import selection_load as selection_load
