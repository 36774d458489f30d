"""A finite element model before assembly: a mesh, and tables that say what its groups of cells and nodes are.

Every source fills the same model: a job file, a deck of another program, or Python. Then
`fe_models.assemble` makes a body of it.
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Protocol, runtime_checkable

from pydantic import Field

from fe_models.assembly.tables.attachments import (
    CouplingSection,
    EquationSection,
    LinkSection,
    MassSection,
    SpringSection,
)
from fe_models.assembly.tables.beams import PLANES, BeamSection, RodSection
from fe_models.assembly.tables.materials import MaterialSection, SolidSection, check_all, check_material
from fe_models.assembly.tables.places import InterfaceSection, LoadCaseSection
from fe_models.assembly.tables.shells import ShellSection, check_layups
from fe_models.body.fe_body import FEBody
from fe_models.foundation.errors import ArgumentError, BodyError
from fe_models.foundation.presentation import presented
from fe_models.foundation.records import checked_fields
from fe_models.foundation.stages import Stages
from fe_models.foundation.toml_file import Table, validated
from fe_models.foundation.units import Units, unit_system
from fe_models.foundation.words import nearest, quoted

__all__ = ["MASSES_OF_ALL", "FEModel", "GivenElements", "ModelTables", "check_properties"]

MASSES_OF_ALL = ("consistent", "lumped", "as the deck")  #: kinds of mass that a model may ask of all its elements
LUMPED = ("lines", "shells", "rods")  #: kinds of elements whose mass may be lumped alone


class ModelTables(Table):
    """Materials, properties of groups of cells, attachments, constraints, interfaces and loads."""

    materials: dict[str, MaterialSection] = Field({}, description="tables [materials.NAME]")
    shells: dict[str, ShellSection] = Field({}, description="tables [shells.NAME]")
    sections: dict[str, BeamSection] = Field({}, description="tables [sections.NAME] of beams")
    masses: dict[str, MassSection] = Field({}, description="tables [masses.NAME]")
    springs: dict[str, SpringSection] = Field({}, description="tables [springs.NAME]")
    links: dict[str, LinkSection] = Field({}, description="tables [links.NAME]")
    solids: dict[str, SolidSection] = Field({}, description="tables [solids.NAME] of a deck")
    rods: dict[str, RodSection] = Field({}, description="tables [rods.NAME] of a deck")
    couplings: dict[str, CouplingSection] = Field({}, description="tables [couplings.NAME] of a deck")
    equations: dict[str, EquationSection] = Field({}, description="tables [equations.NAME] of a deck")
    interfaces: dict[str, InterfaceSection] = Field({}, description="tables [interfaces.NAME]")
    load_cases: dict[str, LoadCaseSection] = Field({}, description="tables [load_cases.NAME]")


@runtime_checkable
class GivenElements(Protocol):
    """Elements that another program has assembled, in place of a mesh."""

    def assembled(self, model: "FEModel", stages: Stages, on_report: Callable[[Any], None] | None) -> FEBody:
        """Return the body, with the interfaces and load cases of the model."""


@presented
@dataclass(frozen=True, eq=False)
@checked_fields(ArgumentError)
class FEModel:
    """Finite element model before assembly.

    Parameters
    ----------
    name
        Name of the body.
    units
        Unit system of all numbers, or its name.
    mesh
        Nodes, cells of any kinds on shared nodes, and their groups (`RawMesh`); or a mesh of only solids (`Mesh`), of
        shells with stiffeners (`ShellMesh`), or of lines (`LineMesh`); or matrices of another program
        (`fe_models.files.GivenMatrices`, `GivenArrays`).
    tables
        What the groups are, by the keys of a job file: materials, solids, shells, sections, rods, masses, springs,
        links, couplings, equations, interfaces, load_cases.
    mass
        Kind of mass of all elements: "consistent", "lumped", or "as the deck", which lumps `lumped`; None: solids by
        their tables, others consistent.
    plane
        Plane of deformation, "xy", "yz" or "zx"; None: space.
    accept
        Findings of the checks that are accepted, such as "left-out".
    lumped
        Kinds of elements whose mass the program of the deck lumps, of "lines", "shells", "rods".
    source
        The deck.
    are_faces_names
        Whether edges and faces on the body only name places.
    """

    name: str
    units: Units
    mesh: Any
    tables: ModelTables
    mass: str | None = None
    plane: str | None = None
    accept: tuple[str, ...] = ()
    lumped: frozenset[str] = frozenset()
    source: Path | None = None
    are_faces_names: bool = False

    @classmethod
    def of(cls, name: str, mesh: Any, *, units: str, **tables: Any) -> "FEModel":
        """Return a model from tables given as in a job file.

        Parameters
        ----------
        name
            Name of the body.
        mesh
            The mesh.
        units
            Name of the unit system.
        **tables
            The tables by name, and other fields of the model.

        Raises
        ------
        BodyError
            If a table or another field is invalid; the message names key, value and choices.

        Examples
        --------
        >>> steel = {"young": 210e9, "poisson": 0.3, "density": 7850.0}
        >>> plate = fe_models.FEModel.of(
        ...     "plate",
        ...     fe_models.shells.flat_plate(1.0, 0.5, 4, 2),
        ...     units="m-kg-s",
        ...     materials={"steel": steel},
        ...     shells={"skin": {"thickness": 0.01}},
        ... )
        >>> fe_models.assemble(plate).n_dof
        90
        """
        where = Path(f"model {name!r}")
        fields: dict[str, Any] = {
            key: tables.pop(key) for key in ("mass", "plane", "accept", "lumped", "source") if key in tables
        }
        for key, choices in (("mass", MASSES_OF_ALL), ("plane", tuple(PLANES))):
            if fields.get(key) is not None and fields[key] not in choices:
                raise BodyError(f"{where}: {key}: unknown {quoted(fields[key])}{nearest(fields[key], choices)}")
        if "lumped" in fields:
            lumped = fields["lumped"]
            fields["lumped"] = frozenset((lumped,) if isinstance(lumped, str) else lumped)
            for kind in sorted(fields["lumped"].difference(LUMPED)):
                raise BodyError(f"{where}: lumped: unknown {quoted(kind)}{nearest(kind, LUMPED)}")
        made = validated(ModelTables, tables, where, BodyError)
        try:
            if not isinstance(mesh, GivenElements):
                check_properties(made)
        except ValueError as problem:
            raise BodyError(f"{where}: {problem}") from None
        return cls(name, unit_system(units), mesh, made, **fields)


def check_properties(tables: ModelTables) -> None:
    """Raise `ValueError` unless a model of several kinds of elements has properties, and materials for them."""
    if not (tables.solids or tables.shells or tables.sections or tables.rods or tables.springs):
        raise ValueError("expected tables [solids.NAME], [shells.NAME], [sections.NAME], [rods.NAME] or [springs.NAME]")
    check_layups(tables.shells, tables.materials)
    properties: dict[str, Mapping[str, Any]] = {
        "solids": tables.solids, "sections": tables.sections, "rods": tables.rods,
    }  # fmt: skip
    for kind, sections in properties.items():
        for name, section in sections.items():
            check_material(f"{kind}.{name}", section.material, tables.materials)
    for kind, key in (("solids", "cells"), ("shells", "cells"), ("sections", "lines"), ("rods", "lines")):
        check_all(kind, getattr(tables, kind), key)
    for name, material in tables.materials.items():
        if "cells" in material.model_fields_set:
            raise ValueError(
                f"materials.{name}.cells: remove it; the tables of solids, shells and sections name cells here"
            )
