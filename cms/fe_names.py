"""Names of `fe_models` that `cms` re-exports, so that a script that reduces a body needs only one import."""

from fe_models.body.beam_line import BeamLine
from fe_models.body.couplings.couplings import couple
from fe_models.body.fe_body import FEBody, Interface
from fe_models.body.load_cases import LoadCase, ReducedLoadCase
from fe_models.foundation.units import UNIT_SYSTEMS, Units, unit_system

__all__ = [
    "UNIT_SYSTEMS",
    "BeamLine",
    "FEBody",
    "Interface",
    "LoadCase",
    "ReducedLoadCase",
    "Units",
    "couple",
    "unit_system",
]
