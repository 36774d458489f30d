"""Laws of a straight beam without a mesh (`BeamLine`), from sections and material."""

from collections.abc import Callable
from dataclasses import replace
from functools import cache

import numpy as np

from fe_models.body.beam_line import BeamLine, Law
from fe_models.elements.beams.beam_property import BeamProperty, section_of
from fe_models.elements.beams.section_properties import SectionProperties
from fe_models.elements.beams.sections import Section
from fe_models.errors import SectionError
from fe_models.foundation.arrays import Array

__all__ = ["beam_line"]


def beam_line(
    length: float,
    item: BeamProperty,
    *,
    taper: Callable[[float], Section] | None = None,
    breaks: tuple[float, ...] = (),
) -> BeamLine:
    """Return mass and stiffness per length of a straight beam along x; its local axes are the axes of the body.

    Parameters
    ----------
    length
        Length [m].
    item
        Section, material and theory. Offset and orientation must not be set, because x is the line of centroids.
    taper
        Section at position x, instead of `item.section`; smooth between the breaks.
    breaks
        Positions at which the section is discontinuous [m].

    Raises
    ------
    SectionError
        If the section has an offset, or its shear centre is not at the centroid.
    """
    if any(item.offset) or item.orientation is not None:
        raise SectionError("beam_line: offset and orientation: expected none, since the beam lies along x of its body")
    rho, E, G = item.material.rho, item.material.E, item.material.E / (2 * (1 + item.material.nu))
    is_rotary = float(item.rotary_inertia)

    def values(section: SectionProperties) -> dict[str, float]:
        if any(section.shear_center):
            raise SectionError(
                f"beam_line: shear centre {section.shear_center} is not the centroid: torsion bends such a beam; use "
                "fe_models.beam_body"
            )
        return {
            "rho_A": rho * section.A + item.added_mass,
            "EA": E * section.A,
            "EIy": E * section.Iy,
            "EIz": E * section.Iz,
            "GJ": G * section.J,
            "rho_Iy": rho * section.Iy,
            "rho_Iz": rho * section.Iz,
            "GAy": G * section.A_sy,
            "GAz": G * section.A_sz,
        }

    if not is_rotary:
        raise SectionError("beam_line: rotary_inertia = False: expected True; a beam line always has rotary inertia")
    if taper is None:
        laws: dict[str, Law] = {**values(section_of(item))}
        return BeamLine(length, breaks=breaks, **laws)

    @cache
    def at(place: float) -> dict[str, float]:
        assert taper is not None
        return values(section_of(replace(item, section=taper(place))))

    def law(name: str) -> Callable[[Array], Array]:
        def of_place(x: Array) -> Array:
            return np.array([at(float(place))[name] for place in np.asarray(x).ravel()]).reshape(np.shape(x))

        return of_place

    names = [name for name, value in at(0.0).items() if np.isfinite(value)]  # infinite values keep the default
    return BeamLine(length, breaks=breaks, **{name: law(name) for name in names})
