"""Finite element body of a job: reading, checks, assembly, and coupling of the interfaces."""

from collections.abc import Callable
from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np

from cms.errors import JobError
from cms.jobs.attachments_of_job import attachments_of, frame_interface, frame_mesh, one_node, properties_of
from cms.jobs.job import Job
from cms.jobs.parts_of_job import interfaces_of, load_cases_of, materials_of, part_of_mesh, selection_of
from fe_models.body.couplings.coupling_on_ranks import spread_body
from fe_models.body.fe_body import FEBody, Interface
from fe_models.foundation.ranks.ranks import Ranks
from fe_models.foundation.stages import Stages
from fe_models.foundation.units import UNIT_SYSTEMS

if TYPE_CHECKING:
    from fe_models.checks.first_order import FirstOrderError
    from fe_models.meshes.mesh import Mesh
    from fe_models.meshes.node_cloud import NodeCloud

__all__ = [
    "body_of_frame",
    "body_of_matrices",
    "body_of_mixed",
    "checked_mesh",
    "coupled_body",
    "is_of_mesh",
    "job_body",
    "solid_mesh_of",
    "uncoupled_body",
]


# bodies whose elements are in another program: matrices, their geometry, and interfaces on it -------------------------


def body_of_matrices(job: Job, stages: Stages, on_report: Callable[[Any], None] | None = None) -> FEBody:
    """Read mass and stiffness matrices, and return a body with the interfaces and load cases of the job.

    An .npz file of this project contains nodes and interfaces. All other files need a deck or a mesh, unless they
    contain node positions. `on_report` is called with the `MatrixReport` before the matrices are checked.
    """
    if job.body.brings_interfaces:
        return body_with_its_interfaces(job, stages)
    from fe_models.files.matrices.body import MatrixReport, body_from_foreign, nodes_of, with_geometry
    from fe_models.files.matrices.read_matrices import read_matrices
    from fe_models.files.read_mesh import read_geometry

    if job.body.matrices is None:
        raise JobError("job: expected matrices, got none")
    with stages("read matrices"):
        read = read_matrices(job.body.matrices, names=job.body.names)
    with stages("read geometry"):
        geometry = nodes_of(read) if job.body.geometry is None else read_geometry(job.body.geometry)
        read = with_geometry(read, geometry)
        if on_report is not None:
            on_report(MatrixReport(read))
        interfaces = interfaces_on(job, geometry)
    with stages("check matrices"):
        body = body_from_foreign(
            read, geometry, name=str(job.body.name), units=UNIT_SYSTEMS[job.body.units], interfaces=interfaces,
            held=bool(job.body.held), remove_supports=job.body.remove_supports, repair_mass=bool(job.body.repair_mass),
            accept=[word for word in job.body.accept if word == "units"],
        )  # fmt: skip
    return body.with_load_cases(*load_cases_of(job, body, geometry))


def body_with_its_interfaces(job: Job, stages: Stages) -> FEBody:
    """Read a body of bare matrices from a file that contains the interfaces."""
    from pathlib import Path

    from fe_models.files.matrices.given import body_from_npz

    with stages("read matrices"):
        body = body_from_npz(
            Path(str(job.body.matrices)), name=job.body.name, units=UNIT_SYSTEMS[job.body.units],
            held=bool(job.body.held), repair_mass=bool(job.body.repair_mass),
            accept=[word for word in job.body.accept if word == "units"],
        )  # fmt: skip
        return body.with_load_cases(*load_cases_of(job, body))


def interfaces_on(job: Job, geometry: "Mesh | NodeCloud") -> tuple[Interface, ...]:
    """Return the interfaces of the job, on a solid mesh or on nodes of elements of another program."""
    from fe_models.body.couplings.couplings import check_overlap
    from fe_models.elements.beams.interfaces import node_interface
    from fe_models.meshes.boundary import facet_weights
    from fe_models.meshes.mesh import Mesh
    from fe_models.meshes.selections import selected_facets

    if isinstance(geometry, Mesh):
        return interfaces_of(job, geometry)
    interfaces = []
    for name, section in job.interfaces.items():
        chosen = selection_of(section)
        facets = selected_facets(geometry, chosen)
        weights = facet_weights(geometry.nodes, facets) if facets else np.ones(len(geometry.nodes))
        # axes are rows in the job, but columns here
        triad = None if section.triad is None else np.array(section.triad).T
        interfaces.append(
            node_interface(geometry, name, chosen, section.kind, section.reference, triad, np.maximum(weights, 0.0))
        )
    check_overlap(interfaces, numbers=geometry.node_numbers)
    return tuple(interfaces)


# body of job ----------------------------------------------------------------------------------------------------------


# beams of a reduction job: a body of lines, alone or tied to a solid --------------------------------------------------


def body_of_frame(
    job: Job,
    stages: Stages,
    on_report: Callable[[Any], None] | None,
    *,
    interfaces: tuple[Interface, ...] | None = None,
) -> FEBody:
    """Read and check the lines, and return the body with sections and attachments of the job.

    Parameters
    ----------
    interfaces
        Interfaces to use instead of those of the job; load cases are then left to the caller too.
    """
    from cms.jobs.parts_of_job import load_cases_of, part_of_mesh
    from fe_models.checks.frame_report import report_frame
    from fe_models.elements.beams.body import beam_body

    units = UNIT_SYSTEMS[job.body.units]
    with stages("read lines"):
        mesh = frame_mesh(job)
        if job.body.part is not None:
            mesh = part_of_mesh(job.body.part, mesh)
    properties = properties_of(job)
    masses, springs, links = attachments_of(job, mesh)
    with stages("check lines"):
        materials = {item.material: None for item in properties.values()}
        report = report_frame(mesh, materials, units=units, springs=springs, links=links)
        if on_report is not None:
            on_report(report)
        report.raise_for_errors(accept=job.body.accept)
        is_whole = interfaces is None
        if interfaces is None:
            interfaces = tuple(frame_interface(name, section, mesh) for name, section in job.interfaces.items())
    with stages("assemble"):
        body = beam_body(
            mesh,
            next(iter(properties.values())) if set(properties) == {"all"} else properties,
            name=str(job.body.name),
            units=units,
            interfaces=interfaces,
            point_masses=masses,
            springs=springs,
            links=links,
        )
        return body.with_load_cases(*load_cases_of(job, body, mesh)) if is_whole else body


# body of job ----------------------------------------------------------------------------------------------------------


# beams of a job that are welded to its solid --------------------------------------------------------------------------


def body_of_mixed(job: Job, stages: Stages, solid: FEBody, solid_mesh: Any, on_report: Any) -> FEBody:
    """Tie the beams of the job to its solid, and put the interfaces on both.

    Parameters
    ----------
    solid
        The solid without interfaces.
    solid_mesh
        Mesh of the solid, for selections.
    """
    from cms.jobs.parts_of_job import interface_of, selection_of
    from fe_models.body.couplings.couplings import couple
    from fe_models.body.weld import weld
    from fe_models.elements.beams.interfaces import NodeIndices, line_interface
    from fe_models.elements.solids import interfaces as on_solid

    lines = frame_mesh(job)
    makers = {"rigid": on_solid.rigid_interface, "distributing": on_solid.distributing_interface}
    of_solid, of_frame = [], []
    for name, tie in job.ties.items():
        node = one_node(lines, f"ties.{name}.node", tie.node)
        point = lines.nodes[node]
        of_solid.append(makers[tie.kind](solid_mesh, name, selection_of(tie), reference=point))
        of_frame.append(line_interface(lines, name, NodeIndices((node,))))
    frame = body_of_frame(job, stages, on_report, interfaces=tuple(of_frame))
    frame = replace(frame, name=f"{frame.name} beams")
    with stages("weld"):
        whole = weld(
            [couple(replace(solid, interfaces=tuple(of_solid))), couple(frame)],
            [((solid.name, name), (frame.name, name)) for name in job.ties],
            name=str(job.body.name),
        )
    first_line_node = len(solid.nodes) + len(of_solid)
    placed = []
    for name, section in job.interfaces.items():
        if section.on == "lines":
            interface = frame_interface(name, section, lines)
            placed.append(replace(interface, nodes=interface.nodes + first_line_node))
        else:
            placed.append(interface_of(name, section, solid_mesh))
    return whole.with_interfaces(*placed)


# body of job ----------------------------------------------------------------------------------------------------------


def job_body(
    job: Job,
    stages: Stages | None = None,
    *,
    on_report: Callable[[Any], None] | None = None,
    mesh: "Mesh | None" = None,
    ranks: Ranks | None = None,
) -> FEBody:
    """Process a job up to the coupled body: read, check, assemble, and couple the interfaces.

    Parameters
    ----------
    mesh
        Solid mesh of the job, from `checked_mesh` for the same job with other numerical values; it is not read or
        checked again.
    ranks
        Processes that assemble a body of a single solid mesh in parts (`fe_models.solid_body`). K and M of other bodies
        are assembled in this process, and then distributed over the ranks.
    """
    stages = stages or Stages()
    body = uncoupled_body(job, stages, on_report=on_report, mesh=mesh, ranks=ranks)
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
    from cms.jobs.beam_tables import PLANES
    from fe_models.assembly.planar import planar

    return planar(couple(body), normal=PLANES[job.body.plane])


def uncoupled_body(
    job: Job,
    stages: Stages,
    *,
    on_report: Callable[[Any], None] | None = None,
    mesh: "Mesh | None" = None,
    ranks: Ranks | None = None,
) -> FEBody:
    """Process a job up to the body with uncoupled interfaces, and with the requested nodes and points.

    Its source is a deck, a shell, a frame, a solid mesh, or matrices.
    """
    if job.body.deck is not None:
        from cms.jobs.deck_body import body_of_deck

        body = body_of_deck(job, job.body.deck, stages, on_report)
    elif job.shells:
        from cms.jobs.shell_body import body_of_shell

        body = body_of_shell(job, stages, on_report)
    elif job.sections and not job.ties:
        body = body_of_frame(job, stages, on_report)
    elif job.body.mesh is not None:
        body = body_of_mesh(job, stages, on_report, mesh, ranks)
    else:
        body = body_of_matrices(job, stages, on_report)
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


def checked_mesh(
    job: Job, stages: Stages, on_report: Callable[[Any], None] | None
) -> "tuple[Mesh, FirstOrderError | None]":
    """Read and check the solid mesh of a job; return it without unused nodes, with its first-order error."""
    from fe_models.checks.mesh_report import report_mesh
    from fe_models.meshes.mesh import drop_unused_nodes

    with stages("read mesh" if job.mesh_size is None else "mesh"):
        mesh = solid_mesh_of(job)
        if job.body.part is not None:
            mesh = part_of_mesh(job.body.part, mesh)
    with stages("check mesh"):
        bricks = job.body.incompatible_modes
        report = report_mesh(mesh, materials_of(job), units=UNIT_SYSTEMS[job.body.units], incompatible_modes=bricks)
        if on_report is not None:
            on_report(report)
        report.raise_for_errors(accept=job.body.accept)
        mesh = drop_unused_nodes(mesh)
        if bricks and not len(mesh.cells.get("hexahedron", ())):
            kinds = ", ".join(mesh.cells)
            raise JobError(
                f"body.incompatible_modes: the mesh has no bricks of eight nodes, but {kinds}; remove the key"
            )
    return mesh, report.first_order


def body_of_mesh(
    job: Job,
    stages: Stages,
    on_report: Callable[[Any], None] | None,
    mesh: "Mesh | None" = None,
    ranks: Ranks | None = None,
) -> FEBody:
    """Read and check the mesh unless it is given, and assemble it with materials and interfaces of the job."""
    from fe_models.elements.solids.body import solid_body

    first_order = None
    if mesh is None:
        mesh, first_order = checked_mesh(job, stages, on_report)
    materials, bricks = materials_of(job), job.body.incompatible_modes
    interfaces = () if job.ties else interfaces_of(job, mesh)
    name = str(job.body.name)
    with stages("assemble") as advance:
        body = solid_body(
            mesh,
            materials,
            name=name,
            units=UNIT_SYSTEMS[job.body.units],
            interfaces=interfaces,
            incompatible_modes=bricks,
            progress=advance,
            ranks=None if job.ties else ranks,  # tied beams modify K and M, which must then be on rank 0
        )
        if first_order is not None:
            body = replace(body, provenance={**body.provenance, **first_order.provenance()})
    if job.ties:
        body = body_of_mixed(job, stages, body, mesh, on_report)
    return body.with_load_cases(*load_cases_of(job, body, mesh)) if job.load_cases else body


# the solid mesh of a job, read from a mesh file or made of a CAD file -------------------------------------------------


def solid_mesh_of(job: Job) -> "Mesh":
    """Return the complete solid mesh; faces selected by interfaces and loads are groups."""
    from fe_models.files.read_mesh import read_mesh

    if job.body.mesh is None:
        raise JobError("job: expected a mesh, got none")
    if job.mesh_size is None:
        return read_mesh(job.body.mesh)
    from fe_models.files.cad.cad_mesh import MeshSize, mesh_cad

    size = MeshSize(**job.mesh_size.model_dump())
    chosen = [table.faces for table in job.interfaces.values()] + [table.faces for table in job.load_cases.values()]
    faces = [text for texts in chosen for text in texts or ()]
    return mesh_cad(job.body.mesh, size, units=job.body.units, faces=faces)
