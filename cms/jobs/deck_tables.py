"""The tables of a reduction job that only apply to a whole deck: solids, couplings, equations (docs/job_file.md)."""

from typing import Annotated, Any

from pydantic import BeforeValidator, Field, StringConstraints

from cms.jobs.beam_tables import component_numbers
from cms.jobs.shell_tables import check_layups
from fe_models.elements.solids.elements import INTEGRATIONS, MASSES
from fe_models.foundation.arrays import MOTION_COMPONENTS as COMPONENTS
from fe_models.foundation.toml_file import Names, Table, choice, is_no_number
from fe_models.foundation.words import nearest, quoted

__all__ = [
    "DECK_MASSES",
    "DECK_PROGRAMS",
    "CouplingSection",
    "EquationSection",
    "RodSection",
    "SolidSection",
    "check_deck",
]

DECK_PROGRAMS = ("calculix", "abaqus")  #: programs whose decks have the same suffix
DECK_MASSES = ("consistent", "lumped", "as the deck")
Name = Annotated[str, StringConstraints(min_length=1)]


def equation_terms(value: Any) -> tuple[tuple[str, int, float], ...]:
    """Return the terms of an equation: [group of one node, component, coefficient]."""
    is_list = isinstance(value, list | tuple) and len(value) >= 2
    if not is_list or not all(isinstance(term, list | tuple) and len(term) == 3 for term in value):
        raise ValueError('expected two or more terms such as ["node_7", "ux", 1.0]')
    made = []
    for node, component, coefficient in value:
        if component not in COMPONENTS:
            raise ValueError(f"unknown component {quoted(component)}{nearest(str(component), COMPONENTS)}")
        if not isinstance(node, str) or isinstance(coefficient, bool) or not isinstance(coefficient, int | float):
            raise ValueError('expected terms such as ["node_7", "ux", 1.0]')
        made.append((node, COMPONENTS.index(component), float(coefficient)))
    return tuple(made)


Components = Annotated[tuple[int, ...], BeforeValidator(component_numbers, json_schema_input_type=Any)]
ALL = tuple(range(6))


class SolidSection(Table):
    """[solids.NAME]: material and formulation of a group of solid cells."""

    cells: Names = Field(("all",), description='"all", the name of a group of cells, or a list of names')
    material: Name | None = Field(None, description="the name of a material; default: the only one")
    integration: choice("integration", lambda: (*INTEGRATIONS, "incompatible")) = Field(  # type: ignore[valid-type]
        "full", description=f"of the stiffness, one of {', '.join((*INTEGRATIONS, 'incompatible'))}"
    )
    mass: choice("mass", lambda: MASSES) = Field(  # type: ignore[valid-type]
        "consistent", description=f"one of {', '.join(MASSES)}"
    )


def member_weight(value: Any) -> float | tuple[float, ...]:
    """Return one weight for translations, or six for ux uy uz rx ry rz."""
    given = value if isinstance(value, list | tuple) else (value,) * 6
    if len(given) != 6 or any(is_no_number(each) for each in given):
        raise ValueError("expected a number, or a list of six")
    return tuple(float(each) for each in given) if isinstance(value, list | tuple) else float(value)


class RodSection(Table):
    """[rods.NAME]: lines with axial force only (trusses)."""

    lines: Names = Field(description="the name of a group of lines, or a list of names")
    material: Name | None = Field(None, description="the name of a material; default: the only one")
    area: Annotated[float, Field(gt=0)] = Field(description="a number above 0 [length^2]")


SixWeights = tuple[float, float, float, float, float, float]  #: weights for ux uy uz rx ry rz
MemberWeight = Annotated[float | SixWeights, BeforeValidator(member_weight, json_schema_input_type=Any)]


class CouplingSection(Table):
    """[couplings.NAME]: a node that follows the weighted mean motion of others (RBE3)."""

    node: Name = Field(description="the name of a group that holds one node, which follows")
    members: dict[str, MemberWeight] = Field(
        min_length=1,
        description="a table {group = weight of each of its nodes}: one number, for translations, or a list of six",
    )
    components: Components = Field(ALL, description="components of the node that follow, ux to rz; default: all")


class EquationSection(Table):
    """[equations.NAME]: Σ coefficient × component = 0."""

    terms: Annotated[
        tuple[tuple[str, int, float], ...], BeforeValidator(equation_terms, json_schema_input_type=Any)
    ] = Field(description='two or more terms [group of one node, component, coefficient], as ["node_7", "ux", 1.0]')


def check_deck(job: Any) -> None:
    """Raise `ValueError` unless the tables of a deck are complete, and refer to existing materials and cells.

    Parameters
    ----------
    job
        A job with a deck, with its tables read.
    """
    if job.ties or job.body.part or job.body.incompatible_modes:
        raise ValueError("body.deck: ties, part and incompatible_modes belong to a mesh; remove them")
    if not (job.solids or job.shells or job.sections or job.rods or job.springs):
        raise ValueError(
            "body.deck: expected tables [solids.NAME], [shells.NAME], [sections.NAME], [rods.NAME] or [springs.NAME]"
        )
    check_layups(job.shells, job.materials)
    for kind in ("solids", "sections", "rods"):
        for name, table in getattr(job, kind).items():
            if table.material is None and len(job.materials) != 1:
                raise ValueError(f"{kind}.{name}.material: missing; there are {len(job.materials)} materials, name one")
            if table.material is not None and table.material not in job.materials:
                raise ValueError(
                    f'{kind}.{name}.material = "{table.material}": there is no such material'
                    f"{nearest(table.material, job.materials)}"
                )
    for name, material in job.materials.items():
        if "cells" in material.model_fields_set:
            raise ValueError(
                f"materials.{name}.cells: remove it; with a deck, the tables of solids, shells and sections name cells"
            )
