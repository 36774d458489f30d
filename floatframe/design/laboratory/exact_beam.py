"""Geometrically exact beams as a reference without modes and linear deformation; two meshes give their error."""

from dataclasses import dataclass, replace

import numpy as np

from fe_models.body.fe_body import FEBody
from fe_models.elements.beams.model import BeamModel
from fe_models.foundation.records import checked_fields
from floatframe.components.flexible_parts.exact_beams import exact_beams
from floatframe.design.laboratory.substitution import with_part
from floatframe.engine.compiling.placing import placed_bodies
from floatframe.errors import ModelError
from floatframe.model.bodies.flexible_body import FlexibleBody
from floatframe.model.system import System

__all__ = ["ExactBeam", "with_exact_beams"]


@dataclass(frozen=True)
@checked_fields(ModelError)
class ExactBeam:
    """Reference with geometrically exact beams on the lines of the body, in two meshes.

    The finer mesh has twice as many elements and is the reference. Errors decrease with the square of the element
    length, so that the error of the reference is a third of the difference between both.

    Parameters
    ----------
    elements
        Smallest number of elements of all lines together.
    """

    elements: int = 32

    def __post_init__(self) -> None:
        if self.elements < 1:
            raise ModelError(f"exact beam: elements: expected a whole number from 1, got {self.elements}")

    @property
    def description(self) -> str:
        """Description of the reference as text."""
        return "geometrically exact beams"


def with_exact_beams(system: System, name: str, model: FEBody, elements: int) -> System:
    """Return the system with its flexible body as exact beams, and the sensors that exist for them.

    Raises
    ------
    ModelError
        If the body does not consist of lines, or the system refers to something that such beams do not have.
    """
    system = replace(system, bodies=placed_bodies(system))
    body = system.body(name)
    if not isinstance(body, FlexibleBody):
        raise ModelError(f"system {system.name!r}: body {name!r}: expected a flexible body")
    lines = len(model.element_model.dofs) if isinstance(model.element_model, BeamModel) else 1
    part = exact_beams(
        name,
        model,
        pieces=int(np.ceil(elements / max(lines, 1))),
        position=body.position,
        orientation=body.orientation,
        velocity=body.velocity,
        omega_B=body.omega_B,
    )
    return with_part(system, name, part)
