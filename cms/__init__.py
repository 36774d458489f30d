"""Component mode synthesis: from a finite element body to a small, exact, portable modal file.

body = couple(fe_body)
modes = craig_bampton(body, n_modes=12)
write(reduce(body, modes, frame=NodalFrame("big_end")), "rod.h5")
"""

from cms.couplings import couple
from cms.errors import CmsError
from cms.fe_body import FEBody, Interface
from cms.frames import NodalFrame, TisserandFrame
from cms.invariants import Moments
from cms.modal_file import read, write
from cms.mode_set import ModeSet
from cms.mode_sets import MODE_SETS, craig_bampton, guyan
from cms.reduced_body import BodyFrame, ReducedBody, ReducedInterface
from cms.reduction import ModalDamping, RayleighDamping, reduce
from cms.units import UNIT_SYSTEMS, Units, unit_system

__all__ = [
    "MODE_SETS",
    "UNIT_SYSTEMS",
    "BodyFrame",
    "CmsError",
    "FEBody",
    "Interface",
    "ModalDamping",
    "ModeSet",
    "Moments",
    "NodalFrame",
    "RayleighDamping",
    "ReducedBody",
    "ReducedInterface",
    "TisserandFrame",
    "Units",
    "couple",
    "craig_bampton",
    "guyan",
    "read",
    "reduce",
    "unit_system",
    "write",
]
