"""The reduction job, which `cms reduce` reads (docs/job_file.md)."""

import os
from collections.abc import Mapping
from pathlib import Path
from typing import Annotated, Any

from pydantic import AfterValidator, BeforeValidator, Field, ValidationInfo, field_validator, model_validator

from cms.errors import JobError
from cms.jobs.reduction_table import DampingSection, ReductionSection, mode_set_options, named_interfaces
from cms.jobs.tables.recovery_section import RecoverySection
from fe_models.assembly.model import MASSES_OF_ALL, ModelTables, check_properties
from fe_models.assembly.tables.attachments import TieSection
from fe_models.assembly.tables.beams import PLANES, Positive, check_beams
from fe_models.assembly.tables.materials import MaterialSection, Name
from fe_models.assembly.tables.shells import check_shells
from fe_models.files.cad.cad_units import CAD_FORMATS
from fe_models.foundation.parametric_file import read_parametric
from fe_models.foundation.toml_file import (
    Table,
    Vector3,
    choice,
    existing_file,
    is_no_number,
    kind_field,
    names,
    validated,
)
from fe_models.foundation.units import UNIT_SYSTEMS
from fe_models.foundation.words import nearest, quoted

__all__ = ["DampingSection", "Job", "ReductionSection", "mode_set_options", "read_job"]

ACCEPTABLE = (
    "left-out",
    "overlap",
    "parts",
    "transition",
    "units",
    "warped",
)  #: errors of the mesh report that the user may accept

ROLES = ("K", "M", "D", "dofs")  #: roles of matrix files: stiffness, mass, damping, list of rows


def deck_programs() -> tuple[str, ...]:
    """Return the programs whose decks have the same suffix."""
    from fe_models.files.abaqus.elements import SOLID_RULES

    return tuple(SOLID_RULES)


def accepted(value: Any) -> tuple[str, ...]:
    """Return the kinds of findings of the mesh report that the user accepts."""
    words = names(value)
    for word in words:
        if word not in ACCEPTABLE:
            raise ValueError(f"{quoted(word)} is not a finding that can be accepted{nearest(word, ACCEPTABLE)}")
    return words


def nodes_to_keep(value: Any) -> tuple[Any, ...]:
    """Return the list of nodes to keep: node numbers, names of sets, and positions; "all" keeps every node."""
    if value == "all":
        return ("all",)
    if not isinstance(value, list):
        raise ValueError('expected "all", or a list of node numbers, names of sets, and positions [x, y, z]')
    entries: list[Any] = []
    for each in value:
        if isinstance(each, list):
            if len(each) != 3 or any(is_no_number(x) for x in each):
                raise ValueError(f"{quoted(each)}: expected a position [x, y, z]")
            entries.append(tuple(float(x) for x in each))
        elif isinstance(each, bool) or not isinstance(each, int | str) or each == "":
            raise ValueError(f"{quoted(each)}: expected a node number, the name of a set, or a position [x, y, z]")
        else:
            entries.append(each)
    return tuple(entries)


def elements_named(value: Any) -> tuple[Any, ...]:
    """Return element numbers and set names; "all" selects all elements."""
    entries = value if isinstance(value, list) else [value]
    if not entries or any(isinstance(each, bool) or not isinstance(each, int | str) or each == "" for each in entries):
        raise ValueError('expected "all", or a list of numbers of elements and names of sets')
    return tuple(entries)


def factors(value: tuple[float, float, float]) -> tuple[float, float, float]:
    """Return three factors above 0."""
    if min(value) <= 0:
        raise ValueError("expected three factors above 0, [x, y, z]")
    return value


beside_the_job = existing_file()
FileOfTheJob = Annotated[Path, BeforeValidator(beside_the_job)]
Keep = Annotated[tuple[Any, ...], BeforeValidator(nodes_to_keep, json_schema_input_type=Any)]
StressPoints = Annotated[tuple[Any, ...], BeforeValidator(elements_named, json_schema_input_type=Any)]
Scale = Annotated[Vector3, AfterValidator(factors)]
Accepted = Annotated[tuple[str, ...], BeforeValidator(accepted, json_schema_input_type=Any)]


class PartSection(Table):
    """[body] part: one of several parts into which the mesh is cut; the cuts are node sets cut_1, cut_2, ..."""

    number: Annotated[int, Field(ge=1)] = Field(description="a whole number from 1, which part")
    of: Annotated[int, Field(ge=2)] | None = Field(
        None, description="a whole number, 2 or more, the number of parts of equal length"
    )
    at: tuple[float, ...] | None = Field(None, description="a list of numbers, the places of the cuts along the axis")
    axis: Vector3 | None = Field(None, description="the direction across which is cut, [x, y, z]; default: the longest")

    @field_validator("at", mode="before")
    @classmethod
    def _list(cls, value: Any) -> Any:
        if not isinstance(value, list) or not value or any(is_no_number(x) for x in value):
            raise ValueError("expected a list of numbers, the places of the cuts along the axis")
        return tuple(float(x) for x in value)

    @model_validator(mode="after")
    def _one_of_them(self) -> "PartSection":
        if (self.of is None) == (self.at is None):
            raise ValueError(f"expected either of or at, got {'both' if self.of else 'neither'}")
        n = self.of or len(self.at or ()) + 1
        if self.number > n:
            raise ValueError(f"number: there are {n} parts, got number {self.number}")
        return self


class BodySection(Table):
    """[body]: the source of the model."""

    name: Name | None = Field(None, description="the name of the body, text; default: the name of the job file")
    mesh: FileOfTheJob | None = Field(None, description="the path of a mesh or CAD file, relative to the job file")
    matrices: Path | tuple[Path, ...] | dict[str, Path] | None = Field(
        None,
        description="the path of a file with mass and stiffness, a list of paths, or a table {K = path, M = path, "
        "D = path, dofs = path}",
    )
    geometry: FileOfTheJob | None = Field(None, description="the path of the deck or mesh that matrices were made of")
    names: dict[str, str] | None = Field(
        None, description="a table {K = name, M = name, D = name}: names of the matrices in files that hold several"
    )
    remove_supports: bool = Field(
        False, description="true or false, for matrices: whether supports whose rows exist are taken out of K"
    )
    deck: FileOfTheJob | None = Field(None, description="the path of a whole deck, as cms job writes it")
    nodes: FileOfTheJob | None = Field(None, description="the path of a table of nodes, for beams")
    lines: FileOfTheJob | None = Field(None, description="the path of a table of lines, for beams")
    plane: choice("plane", lambda: tuple(PLANES)) | None = Field(  # type: ignore[valid-type]
        None, description=f"the plane beams or decks deform in, one of {', '.join(PLANES)}; default: space"
    )
    mass: choice("mass", lambda: MASSES_OF_ALL) | None = Field(  # type: ignore[valid-type]
        None,
        description="for a deck: consistent, lumped, or as the deck, of all elements; default: solids by their tables "
        "(as the deck), others consistent",
    )
    program: choice("program", deck_programs) | None = Field(  # type: ignore[valid-type]
        None,
        description="for a deck (.inp): calculix (default) or abaqus, which determines the elements with lumped mass",
    )
    scale: Scale | None = Field(
        None, description="three numbers above 0: factors of the node coordinates of a mesh or of tables of nodes"
    )
    part: PartSection | None = Field(None, description="a table {number, of or at, axis}: one part of the mesh alone")
    units: choice("unit system", lambda: tuple(UNIT_SYSTEMS)) = Field(  # type: ignore[valid-type]
        description=f"the unit system of the numbers, one of {', '.join(UNIT_SYSTEMS)}"
    )
    held: bool | None = Field(
        None, description="true or false, for matrices: whether the body is intentionally held to the ground"
    )
    repair_mass: bool | None = Field(
        None, description="true or false, for matrices: whether slightly negative masses are set to zero"
    )
    incompatible_modes: bool = Field(False, description="true or false: bricks of eight nodes bend by internal modes")
    keep: Keep = Field(
        (), description='"all", or a list of nodes that are kept: numbers, names of sets, positions [x, y, z]'
    )
    stress_points: StressPoints = Field(
        (),
        description='"all", or a list of elements, beams and shells, whose own stress is kept: numbers, names of sets',
    )
    accept: Accepted = Field((), description=f"a list of findings to accept, of {', '.join(ACCEPTABLE)}")

    @field_validator("matrices", mode="before")
    @classmethod
    def _matrices_beside_the_job(cls, value: Any, info: ValidationInfo) -> Any:
        if isinstance(value, list) and value:
            return tuple(beside_the_job(each, info) for each in value)
        if isinstance(value, dict) and value:
            for role in value:
                if role not in ROLES:
                    raise ValueError(f"unknown role {quoted(role)}{nearest(role, ROLES)}")
            return {role: beside_the_job(each, info) for role, each in value.items()}
        return beside_the_job(value, info)

    @property
    def brings_interfaces(self) -> bool:
        """Whether the matrices are in an .npz file of this project, which also contains nodes and interfaces."""
        return isinstance(self.matrices, Path) and self.matrices.suffix.lower() == ".npz" and self.geometry is None

    @model_validator(mode="after")
    def _one_source(self) -> "BodySection":
        if (self.nodes is None) != (self.lines is None):
            raise ValueError(f"{'lines' if self.nodes else 'nodes'}: missing; tables of nodes and lines come together")
        for key in ("held", "repair_mass"):
            if getattr(self, key) is not None and self.matrices is None:
                raise ValueError(f"{key}: belongs to matrices; a body built from a mesh is free, its mass positive")
        for key in ("geometry", "names", "remove_supports"):
            if getattr(self, key) and self.matrices is None:
                raise ValueError(f"{key}: belongs to matrices")
            if key != "geometry" and getattr(self, key) and self.brings_interfaces:
                raise ValueError(f"{key}: belongs to matrices of other programs, not to .npz with nodes and dofs")
        if self.part is not None and self.matrices is not None:
            raise ValueError("part: matrices cannot be cut; remove it, or give the mesh")
        if self.scale is not None and (self.matrices or self.deck):
            raise ValueError("scale: belongs to a mesh, or to tables of nodes and lines; remove it")
        given = [key for key in ("mesh", "deck", "matrices", "lines") if getattr(self, key) is not None]
        if len(given) != 1:
            got = "both" if given == ["mesh", "matrices"] else " and ".join(given) or "neither"
            raise ValueError(
                f"expected either mesh or matrices, got {got}; beams may have tables of nodes and lines instead"
            )
        return self


class MeshSizeSection(Table):
    """[mesh_size]: largest element size, and adaptation to the geometry."""

    size: Positive = Field(description="a number above 0, the largest edge of an element")
    smallest: Positive | None = Field(
        None,
        description="a number above 0, the smallest edge for curved surfaces and small features; default: 0.05 size",
    )
    curvature: Annotated[float, Field(ge=0, le=1000)] = Field(
        12.0, description="a number from 3 to 1000, elements around a circle, or 0: the size does not follow curvature"
    )
    order: Annotated[int, Field(ge=1, le=2)] = Field(2, description="1 (tetra) or 2 (tetra10)")
    optimise: bool = Field(True, description="true or false, whether elements are improved after meshing")

    @model_validator(mode="after")
    def _in_order(self) -> "MeshSizeSection":
        if self.smallest is not None and self.smallest > self.size:
            raise ValueError(f"smallest: expected at most the size {self.size:g}, got {self.smallest:g}")
        if 0 < self.curvature < 3:
            raise ValueError(f"curvature: expected 3 to 1000 elements around a circle, or 0, got {self.curvature:g}")
        return self


def check_mesh_size(table: MeshSizeSection | None, mesh: Path | None, *, has_others: bool) -> None:
    """Raise `ValueError` unless a CAD file has this table, or if another source has it.

    Parameters
    ----------
    mesh
        Source file of the body.
    has_others
        Whether the job has shells or beams.
    """
    is_cad = mesh is not None and mesh.suffix.lower() in CAD_FORMATS
    if is_cad and table is None:
        raise ValueError(
            "mesh_size: missing; a CAD file has to be meshed: expected a table [mesh_size] with size, the largest edge "
            "of an element"
        )
    if table is not None and not is_cad:
        raise ValueError("mesh_size: belongs to a CAD file; a mesh has its sizes, remove the table")
    if is_cad and has_others:
        raise ValueError(
            "body.mesh: of a CAD file the solids are meshed, without shells and beams; remove [shells] and [sections], "
            "or give a mesh"
        )


class Job(ModelTables):
    """A reduction job: one body, its materials, its interfaces, and how to reduce it."""

    kind: str = kind_field("job")
    body: BodySection = Field(description="a table [body] with mesh and units")
    mesh_size: MeshSizeSection | None = Field(None, description="a table [mesh_size] with size, for CAD files")
    ties: dict[str, TieSection] = Field({}, description="tables [ties.NAME] of beams to a solid")
    recovery: dict[str, RecoverySection] = Field({}, description="tables [recovery.NAME] with rows")
    reduction: ReductionSection = Field(description="a table [reduction] with set and n_modes or cutoff")
    damping: DampingSection | None = Field(
        None, description="a table [damping] with ratio, ratios, ramp, alpha and beta, or file"
    )

    @property
    def materials_of_cells(self) -> dict[str, MaterialSection]:
        """Materials for solid cells: all except materials that only beam sections use; none for shells."""
        if self.shells or (self.sections and not self.ties):
            return {}
        named = {section.material for section in self.sections.values()}
        return {
            name: material
            for name, material in self.materials.items()
            if name not in named or "cells" in material.model_fields_set or len(self.materials) == 1
        }

    @model_validator(mode="after")
    def _fits_together(self) -> "Job":
        if not self.body.matrices and not self.body.deck and not self.materials:
            raise ValueError("materials: missing; a mesh needs at least one table [materials.NAME]")
        if self.mesh_size is not None or (self.body.mesh and self.body.mesh.suffix.lower() in CAD_FORMATS):
            check_mesh_size(self.mesh_size, self.body.mesh, has_others=bool(self.shells or self.sections))
        if self.body.deck:
            if self.ties or self.body.part or self.body.incompatible_modes:
                raise ValueError("body.deck: ties, part and incompatible_modes belong to a mesh; remove them")
            check_properties(self)
            return self._names_of_interfaces()
        for key in ("mass", "program"):
            if getattr(self.body, key) is not None:
                raise ValueError(f"body.{key}: belongs to a whole deck; give [body] deck, or remove it")
        for key in ("solids", "rods", "couplings", "equations"):
            if getattr(self, key):
                raise ValueError(f"{key}: belong to a whole deck; give [body] deck, or remove the tables")
        attached = {"masses": self.masses, "springs": self.springs, "links": self.links, "ties": self.ties}
        if self.shells:
            check_shells(self.shells, self.sections, self.body, self.materials)
            if self.ties:
                raise ValueError("ties: belong to a mesh of solid and lines; stiffeners share the nodes of the shell")
            attached = {}
        if self.sections or any(attached.values()):
            check_beams(self.sections, attached, self.materials)
        if self.body.lines and not self.sections:
            raise ValueError("sections: missing; lines need at least one table [sections.NAME]")
        if self.body.matrices and (self.sections or self.body.plane):
            raise ValueError("sections: matrices have their elements inside; remove the tables, and plane")
        if self.body.incompatible_modes and (self.materials_of_cells == {} or not self.body.mesh):
            raise ValueError("body.incompatible_modes: belongs to a mesh of solid cells; remove it")
        if self.body.plane and (self.ties or not self.sections):
            raise ValueError("body.plane: belongs to beams alone; remove it")
        if self.body.scale and self.ties:
            raise ValueError("body.scale: beams tied to a solid are in another mesh; remove it")
        if self.body.part and self.ties:
            raise ValueError("body.part: beams tied to a solid cannot be cut; remove it, or cut one without the other")
        if self.body.lines and self.ties:
            raise ValueError("ties: belong to a mesh of solid and lines; remove the tables")
        for name, interface in self.interfaces.items():
            if (interface.on is not None) != bool(self.ties):
                what = "missing; solid or lines?" if self.ties else "only where beams are tied to a solid; remove it"
                raise ValueError(f"interfaces.{name}.on: {what}")
        if self.body.matrices and self.materials:
            raise ValueError("materials: matrices have their material inside; remove the tables [materials.NAME]")
        if self.body.brings_interfaces and self.interfaces:
            raise ValueError(
                "interfaces: matrices bring their interfaces in the .npz file (interface/NAME/nodes); remove the tables"
            )
        of_cells = self.materials_of_cells
        if len(of_cells) > 1:
            everywhere = [name for name, material in of_cells.items() if material.cells == ("all",)]
            if everywhere:
                raise ValueError(
                    f'materials.{everywhere[0]}: cells = "all", but there are {len(of_cells)} materials; '
                    "name the group of cells of each"
                )
        return self._names_of_interfaces()

    def _names_of_interfaces(self) -> "Job":
        """Raise `ValueError` if the job refers to an interface that does not exist."""
        brings_interfaces = self.body.brings_interfaces
        for where, name in named_interfaces(self.reduction).items():
            if not brings_interfaces and name not in self.interfaces:
                raise ValueError(f"reduction.{where}: there is no such interface{nearest(name, self.interfaces)}")
        for name, case in self.load_cases.items():
            if not brings_interfaces and case.at is not None and case.at not in self.interfaces:
                raise ValueError(
                    f'load_cases.{name}.at = "{case.at}": there is no such interface{nearest(case.at, self.interfaces)}'
                )
            if brings_interfaces and case.selection is not None:
                raise ValueError(
                    f"load_cases.{name}.{case.selection}: matrices have no mesh to select on; give at = an interface"
                )
        return self


def read_job(path: str | os.PathLike[str], changes: Mapping[str, Any] | None = None) -> Job:
    """Read and check a job file.

    Parameters
    ----------
    path
        Path of the job file.
    changes
        Values that replace those in the file: parameters by name, other keys by key path.

    Raises
    ------
    JobError
        If the file is not valid; the message lists every problem with key path, value, expectation and choices.
    """
    path = Path(path)
    job = validated(Job, read_parametric(path, JobError, changes), path, JobError, context=path.parent)
    if job.body.name is None:
        job = job.model_copy(update={"body": job.body.model_copy(update={"name": path.stem})})
    return job
