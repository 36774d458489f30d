"""Sections and material as the laws of a straight beam without a mesh."""

from collections.abc import Callable
from dataclasses import replace

import numpy as np

from cms.arrays import Array
from cms.beam_line import BeamLine, Law
from fe_models.beams.beam_property import BeamProperty, section_of
from fe_models.beams.section_properties import SectionProperties
from fe_models.beams.sections import Section
from fe_models.errors import SectionError

__all__ = ["beam_line"]


def beam_line(
    length: float,
    item: BeamProperty,
    *,
    taper: Callable[[float], Section] | None = None,
    breaks: tuple[float, ...] = (),
) -> BeamLine:
    """Return mass and stiffness per length of a straight beam along x, its local y and z axes those of the body.

    Parameters
    ----------
    length
        [m]
    item
        Section, material and theory. Its offset and orientation must be left out: x is the line of centroids.
    taper
        Section at a place x, in place of `item.section`; smooth between the breaks.
    breaks
        Places where sections jump.

    Raises
    ------
    SectionError
        If the section has an offset, or a shear centre beside its centroid.
    """
    if any(item.offset) or item.orientation is not None:
        raise SectionError("beam_line: offset and orientation: expected none, since the beam lies along x of its body")
    rho, E, G = item.material.rho, item.material.E, item.material.E / (2 * (1 + item.material.nu))
    is_rotary = float(item.rotary_inertia)

    def values(section: SectionProperties) -> dict[str, float]:
        if any(section.shear_center):
            raise SectionError(
                f"beam_line: shear centre {section.shear_center} beside the centroid: torsion bends such a beam; take "
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
        raise SectionError("beam_line: rotary_inertia = False: expected True; sections of a beam line turn with it")
    if taper is None:
        laws: dict[str, Law] = {**values(section_of(item))}
        return BeamLine(length, breaks=breaks, **laws)

    def law(name: str) -> Callable[[Array], Array]:
        def of_place(x: Array) -> Array:
            sections = (section_of(replace(item, section=taper(float(place)))) for place in np.asarray(x).ravel())
            return np.array([values(section)[name] for section in sections]).reshape(np.shape(x))

        return of_place

    first = values(section_of(replace(item, section=taper(0.0))))
    names = [name for name, value in first.items() if np.isfinite(value)]  # an infinite shear stiffness is the default
    return BeamLine(length, breaks=breaks, **{name: law(name) for name in names})
