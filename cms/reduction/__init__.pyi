from cms.fleet import reduce_fleet as reduce_fleet

from .assumed_mode_beams.assumed_beam import beam_from_assumed_modes as beam_from_assumed_modes
from .basis.damping import ModalDamping as ModalDamping
from .basis.damping import PerModeDamping as PerModeDamping
from .basis.damping import RampDamping as RampDamping
from .basis.damping import RayleighDamping as RayleighDamping
from .basis.frames import BuckensFrame as BuckensFrame
from .frame_conversion import convert_frame as convert_frame
from .geometric_stiffness.unit_states import unit_states as unit_states
from .recovery.files import CraigBampton as CraigBampton
from .recovery.files import craig_bampton_matrices as craig_bampton_matrices
from .recovery.matrices import recovery_matrices as recovery_matrices
from .recovery.request import RecoveryRequest as RecoveryRequest
from .recovery.request import Rows as Rows
