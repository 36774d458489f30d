"""Finite element body of a job: its model is assembled, and its interfaces are coupled."""

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from cms.errors import JobError
from cms.jobs.job import Job, read_job
from fe_models.assembly.assemble import assemble
from fe_models.assembly.model import FEModel, ModelTables
from fe_models.assembly.tables.attachments import one_node
from fe_models.assembly.tables.beams import PLANES
from fe_models.assembly.tables.materials import SolidSection
from fe_models.assembly.tables.places import InterfaceSection, interfaces_of, load_cases_of
from fe_models.body.couplings.coupling_on_ranks import spread_body
from fe_models.body.fe_body import FEBody
from fe_models.files.decks.deck import Deck
from fe_models.foundation.ranks.ranks import Ranks
from fe_models.foundation.stages import Stages
from fe_models.foundation.units import UNIT_SYSTEMS
from fe_models.meshes.mesh import Mesh, drop_unused_nodes

if TYPE_CHECKING:
    from fe_models.files.matrices.model import GivenArrays, GivenMatrices
    from fe_models.meshes.line_mesh import LineMesh
    from fe_models.meshes.selections import AnyMesh
    from fe_models.meshes.shell_mesh import ShellMesh

__all__ = [
    "coupled_body", "is_of_mesh", "job_body", "mesh_of_job", "model_of_job", "shell_mesh",
    "uncoupled_body",
]  # fmt: skip


def model_of_job(job: Job, stages: Stages, source: "Mesh | Deck | None" = None) -> FEModel:
    """Return the model of a job: what is read from its mesh, deck or matrices, and its tables.

    Parameters
    ----------
    source
        Solid mesh or deck of the job, if it is known; it is not read again.
    """
    name, units, accept = str(job.body.name), UNIT_SYSTEMS[job.body.units], job.body.accept
    if job.body.deck is not None:
        from fe_models.files.read_deck import parse_deck

        with stages("read deck"):
            deck: Any = source or parse_deck(job.body.deck, program=job.body.program)
        return FEModel(
            name, units, deck.mesh, job, mass=job.body.mass, plane=job.body.plane, accept=accept,
            lumped=deck.lumped, source=job.body.deck, are_faces_names=deck.is_plain_mesh,
        )  # fmt: skip
    if job.body.matrices is not None:
        return FEModel(name, units, matrices_of_job(job, stages), job, accept=accept)
    mesh: Any = source
    if mesh is None:
        with stages("read mesh" if job.mesh_size is None else "mesh"):
            mesh = mesh_of_job(job)
    if not isinstance(mesh, Mesh):
        return FEModel(name, units, mesh, job, accept=accept)
    if job.body.incompatible_modes and not len(mesh.cells.get("hexahedron", ())):
        kinds = ", ".join(mesh.cells)
        raise JobError(f"body.incompatible_modes: the mesh has no bricks of eight nodes, but {kinds}; remove the key")
    integration = "incompatible" if job.body.incompatible_modes else "full"
    solids = {
        name: SolidSection.model_validate({"cells": material.cells, "material": name, "integration": integration})
        for name, material in job.materials_of_cells.items()
    }
    tables = ModelTables.model_construct(
        materials=job.materials, solids=solids, interfaces=job.interfaces, load_cases=job.load_cases
    )
    return FEModel(name, units, mesh, tables, accept=accept)


def matrices_of_job(job: Job, stages: Stages) -> "GivenMatrices | GivenArrays":
    """Read the matrices of a job, and the deck or mesh that they need unless they contain node positions.

    An .npz file of this project contains nodes and interfaces.
    """
    from fe_models.files.matrices.model import GivenArrays, GivenMatrices
    from fe_models.files.read_matrices import read_matrices
    from fe_models.files.read_mesh import read_geometry

    body = job.body
    if body.brings_interfaces:
        return GivenArrays(str(body.matrices), held=bool(body.held), repair_mass=bool(body.repair_mass))
    with stages("read matrices"):
        read = read_matrices(body.matrices or (), names=body.names)
    with stages("read geometry"):
        geometry = None if body.geometry is None else read_geometry(body.geometry)
    return GivenMatrices(read, geometry, bool(body.held), bool(body.remove_supports), bool(body.repair_mass))


def mesh_of_job(job: Job) -> "AnyMesh":
    """Return the mesh of a job with solid cells, shells or lines, or the part of it that the job requests.

    Faces of a CAD file that interfaces and loads select are groups.
    """
    from fe_models.files.read_mesh import read_mesh

    if job.shells:
        mesh: Any = shell_mesh(job)
    elif job.sections and not job.ties:
        mesh = frame_mesh(job)
    elif job.body.mesh is None:
        raise JobError("job: expected a mesh, got none")
    elif job.mesh_size is None:
        mesh = read_mesh(job.body.mesh)
    else:
        from fe_models.files.cad.cad_mesh import MeshSize, mesh_cad

        size = MeshSize(**job.mesh_size.model_dump())
        chosen = [table.faces for table in job.interfaces.values()]
        chosen += [table.faces for table in job.load_cases.values()]
        faces = [text for texts in chosen for text in texts or ()]
        mesh = mesh_cad(job.body.mesh, size, units=job.body.units, faces=faces)
    if job.body.scale is not None:
        mesh = replace(mesh, nodes=mesh.nodes * np.array(job.body.scale))
    if job.body.part is None:
        return mesh
    from fe_models.meshes.split import split_mesh

    part = job.body.part
    return split_mesh(mesh, part.of, at=part.at, axis=part.axis).parts[part.number - 1]


def shell_mesh(job: Job) -> "ShellMesh":
    """Read all triangles and quads of the mesh, and the lines of its stiffeners; `shell_body` checks their thickness.

    If the job accepts that others are left out, only the cells of the groups that it names are read.
    """
    from fe_models.files.read_mesh import read_shell_mesh

    groups = [group for shell in job.shells.values() for group in shell.cells]
    lines = [group for section in job.sections.values() for group in section.lines]
    is_part = groups != ["all"] and "left-out" in job.body.accept
    return read_shell_mesh(str(job.body.mesh), groups=groups if is_part else None, stiffeners=lines)


def frame_mesh(job: Job) -> "LineMesh":
    """Read the lines of the job, from two tables or from the mesh groups that have sections."""
    from fe_models.files.read_mesh import read_line_mesh
    from fe_models.files.tables import read_tables

    if job.body.nodes is not None and job.body.lines is not None:
        return read_tables(job.body.nodes, job.body.lines)
    if job.body.mesh is None:
        raise JobError("job: expected a mesh, or tables of nodes and lines, got neither")
    groups = [group for section in job.sections.values() for group in section.lines]
    return read_line_mesh(job.body.mesh, groups=None if groups == ["all"] else groups)


# beams tied to a solid ------------------------------------------------------------------------------------------------


def tied_body(
    job: Job, stages: Stages, on_report: Callable[[Any], None] | None, source: "Mesh | Deck | None"
) -> FEBody:
    """Assemble solid and beams of a job, tie the beams to the solid, and put the interfaces on both."""
    from fe_models.body.couplings.couplings import couple
    from fe_models.body.weld import weld

    model, lines = model_of_job(job, stages, source), frame_mesh(job)
    of_solid, of_lines = {}, {}
    for name, tie in job.ties.items():
        point = tuple(lines.nodes[one_node(lines, f"ties.{name}.node", tie.node)].tolist())
        of_solid[name] = InterfaceSection.model_validate({**tie.model_dump(exclude={"node"}), "reference": point})
        of_lines[name] = InterfaceSection.model_validate({"kind": "rigid", "nodes": tie.node})
    on_solid, on_lines = (
        tables.model_copy(update={"interfaces": places, "load_cases": {}})
        for tables, places in ((model.tables, of_solid), (job, of_lines))
    )
    beams = FEModel(f"{model.name} beams", model.units, lines, on_lines, accept=model.accept)
    solid = assemble(replace(model, tables=on_solid), stages=stages, on_report=on_report, is_checked=source is not None)
    frame = assemble(beams, stages=stages, on_report=on_report)
    with stages("weld"):
        pairs = [((solid.name, name), (frame.name, name)) for name in job.ties]
        whole = weld([couple(solid), couple(frame)], pairs, name=model.name)
    solid_mesh, first_line_node = drop_unused_nodes(model.mesh), len(solid.nodes) + len(of_solid)
    placed = []
    for name, section in job.interfaces.items():
        on, shift = (lines, first_line_node) if section.on == "lines" else (solid_mesh, 0)
        (interface,) = interfaces_of({name: section}, on)
        placed.append(replace(interface, nodes=interface.nodes + shift))
    whole = whole.with_interfaces(*placed)
    return whole.with_load_cases(*load_cases_of(job.load_cases, whole, solid_mesh))


# body of job ----------------------------------------------------------------------------------------------------------


def job_body(
    job: Job | Path | str,
    stages: Stages | None = None,
    *,
    on_report: Callable[[Any], None] | None = None,
    source: Mesh | Deck | None = None,
    ranks: Ranks | None = None,
) -> FEBody:
    """Process a job up to the coupled body: read, check, assemble, and couple the interfaces.

    Parameters
    ----------
    job
        A job file, or a job that has been read.
    stages
        Receives durations and progress of the stages; None: neither is reported.
    on_report
        Receives the mesh report before it is checked.
    source
        Solid mesh of the job without unused nodes, if it is known, which is not read or checked again; or its deck.
    ranks
        Processes that assemble a body of a single solid mesh in parts (`fe_models.solid_body`). K and M of other bodies
        are assembled in this process, and then distributed over the ranks.
    """
    stages = stages or Stages()
    job = job if isinstance(job, Job) else read_job(job)
    body = uncoupled_body(job, stages, on_report=on_report, source=source, ranks=ranks)
    with stages("couple interfaces"):
        body = coupled_body(job, body)
    return body if ranks is None else spread_body(body, ranks)


def coupled_body(job: Job, body: FEBody) -> FEBody:
    """Couple the interfaces of the body of a job, and restrict it to a plane if requested."""
    from cms.modes.centrifugal import CENTRIFUGAL, centrifugal_loads
    from fe_models.body.couplings.couplings import couple

    if CENTRIFUGAL in (job.reduction.extra or ()):
        # before coupling, because rigid interfaces eliminate the dofs on which these loads act
        body = body.with_load_cases(*centrifugal_loads(body))
    if job.body.plane is None:
        return couple(body)
    from fe_models.body.elimination import planar

    return planar(couple(body), normal=PLANES[job.body.plane])


def uncoupled_body(
    job: Job,
    stages: Stages,
    *,
    on_report: Callable[[Any], None] | None = None,
    source: "Mesh | Deck | None" = None,
    ranks: Ranks | None = None,
) -> FEBody:
    """Process a job up to the body with uncoupled interfaces, and with the requested nodes and points."""
    if job.ties:
        body = tied_body(job, stages, on_report, source)
    else:
        model = model_of_job(job, stages, source)
        body = assemble(model, stages=stages, on_report=on_report, is_checked=source is not None, ranks=ranks)
    if job.body.keep:
        from fe_models.body.kept_nodes import keep_nodes

        body = keep_nodes(body, job.body.keep)
    if not job.body.stress_points:
        return body
    from fe_models.elements.recovery.element_points import element_points

    if job.reduction.stress is False:
        raise JobError("body.stress_points: with reduction.stress = false no stress is kept; remove one of them")
    return element_points(body, job.body.stress_points)


def is_of_mesh(job: Job) -> bool:
    """Return whether the body of a job has a solid mesh, possibly with beams tied to it."""
    others = job.body.deck is not None or job.shells or (job.sections and not job.ties)
    return job.body.mesh is not None and not others
