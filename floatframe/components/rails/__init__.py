"""Wheel-rail contact: profiles, contact geometry, normal and creep forces, tracks and their irregularities.

Profiles from standards, cones and points; Hertz's ellipse; creep forces by Kalker, Polach and FASTSIM; equivalent
conicity; the elements `rails.wheelset` and `rails.wheel-on-rail` (docs/rails.md).
"""

from floatframe.components.rails.assembly import ContactLaws
from floatframe.components.rails.conicity import (
    equivalent_conicity,
    harmonic_conicity,
    klingel_wavelength,
    rolling_radius_difference,
    wheelset_at,
)
from floatframe.components.rails.contact_search import Pair, quasi_elastic, rigid_contacts
from floatframe.components.rails.irregularities import (
    SPECTRA,
    Irregularities,
    TrackSpectrum,
    random_irregularities,
    wheel_envelope,
)
from floatframe.components.rails.kalker import kalker_coefficients
from floatframe.components.rails.profile import Profile, profile_of_points
from floatframe.components.rails.standard_profiles import cone, rail_60e1, wheel_s1002
from floatframe.components.rails.track import Segment, Track, curve
from floatframe.components.rails.wheelset import WheelOnRail, Wheelset, height_on_rails, track_shape

__all__ = [
    "SPECTRA",
    "ContactLaws",
    "Irregularities",
    "Pair",
    "Profile",
    "Segment",
    "Track",
    "TrackSpectrum",
    "WheelOnRail",
    "Wheelset",
    "cone",
    "curve",
    "equivalent_conicity",
    "harmonic_conicity",
    "height_on_rails",
    "kalker_coefficients",
    "klingel_wavelength",
    "profile_of_points",
    "quasi_elastic",
    "rail_60e1",
    "random_irregularities",
    "rigid_contacts",
    "rolling_radius_difference",
    "track_shape",
    "wheel_envelope",
    "wheel_s1002",
    "wheelset_at",
]

#: elements, by their names in system files
ELEMENTS = {
    "wheelset": "floatframe.components.rails.wheelset:Wheelset",
    "wheel-on-rail": "floatframe.components.rails.wheelset:WheelOnRail",
}
