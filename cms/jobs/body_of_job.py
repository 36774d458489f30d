"""The finite element body of a job: read, checked, assembled, with coupled interfaces."""

from collections.abc import Callable
from dataclasses import replace
from typing import TYPE_CHECKING, Any

from cms.errors import JobError
from cms.jobs.attachments_of_job import frame_interface, frame_mesh, one_node
from cms.jobs.frame_body import body_of_frame
from cms.jobs.job import Job
from cms.jobs.mesh_of_job import is_cad, solid_mesh_of
from cms.jobs.parts_of_job import interfaces_of, load_cases_of, materials_of, part_of_mesh
from fe_models.body.couplings.coupling_on_ranks import spread_body
from fe_models.body.fe_body import FEBody
from fe_models.foundation.ranks.ranks import Ranks
from fe_models.foundation.stages import Stages
from fe_models.foundation.units import unit_system

if TYPE_CHECKING:
    from fe_models.checks.first_order import FirstOrderError
    from fe_models.meshes.mesh import Mesh

__all__ = ["body_of_mixed", "checked_mesh", "coupled_body", "is_of_mesh", "job_body", "uncoupled_body"]


# beams of a job that are welded to its solid --------------------------------------------------------------------------


def body_of_mixed(job: Job, stages: Stages, solid: FEBody, solid_mesh: Any, on_report: Any) -> FEBody:
    """Weld the beams of the job to its solid by the ties, and put its interfaces on both.

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
        key = "faces" if tie.faces is not None else "nodes"
        point = lines.nodes[node]
        of_solid.append(makers[tie.kind](solid_mesh, name, selection_of(key, getattr(tie, key)), reference=point))
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
    """Run a job up to the coupled body: read, check, assemble, and couple the interfaces.

    Parameters
    ----------
    mesh
        The solid mesh of the job, from `checked_mesh` for the same job with other numbers; it is not read or checked
        again.
    ranks
        Processes that assemble a body of a single solid mesh in parts (`fe_models.solid_body`). K and M of other bodies
        are made here, and then distributed over the ranks.
    """
    stages = stages or Stages()
    body = uncoupled_body(job, stages, on_report=on_report, mesh=mesh, ranks=ranks)
    with stages("couple interfaces"):
        body = coupled_body(job, body)
    return body if ranks is None else spread_body(body, ranks)


def coupled_body(job: Job, body: FEBody) -> FEBody:
    """Couple the interfaces of the body of a job, and make it planar if the job says so."""
    from cms.jobs.beam_tables import PLANES
    from cms.modes.centrifugal import CENTRIFUGAL, centrifugal_loads
    from fe_models.body.couplings.couplings import couple

    if CENTRIFUGAL in (job.reduction.extra or ()):
        # before coupling, because rigid interfaces eliminate the dofs on which these loads act
        body = body.with_load_cases(*centrifugal_loads(body))
    if job.body.plane is None:
        return couple(body)
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
    """Run a job up to the body with uncoupled interfaces, with the requested nodes and points."""
    from fe_models.body.kept_nodes import keep_nodes

    body = keep_nodes(made_body(job, stages, on_report, mesh, ranks), job.body.keep)
    if not job.body.stress_points:
        return body
    from fe_models.elements.recovery.element_points import element_points

    if job.reduction.stress is False:
        raise JobError("body.stress_points: with reduction.stress = false no stress is kept; remove one of them")
    return element_points(body, job.body.stress_points)


def made_body(
    job: Job,
    stages: Stages,
    on_report: Callable[[Any], None] | None,
    mesh: "Mesh | None" = None,
    ranks: Ranks | None = None,
) -> FEBody:
    """Make the body of a job from its source: a deck, a mesh, tables or matrices."""
    if job.body.deck is not None:
        from cms.jobs.deck_body import body_of_deck

        return body_of_deck(job, job.body.deck, stages, on_report)
    if job.shells:
        from cms.jobs.shell_body import body_of_shell

        return body_of_shell(job, stages, on_report)
    if job.sections and not job.ties:
        from cms.jobs.frame_body import body_of_frame

        return body_of_frame(job, stages, on_report)
    if job.body.mesh is not None:
        return body_of_mesh(job, stages, on_report, mesh, ranks)
    if job.body.matrices is not None:
        from cms.jobs.matrices_of_job import body_of_matrices

        return body_of_matrices(job, stages, on_report)
    raise JobError("job: expected either mesh or matrices, got neither")


def is_of_mesh(job: Job) -> bool:
    """Whether the body of a job is made of a solid mesh, possibly with beams tied to it."""
    others = job.body.deck is not None or job.shells or (job.sections and not job.ties)
    return job.body.mesh is not None and not others


def checked_mesh(
    job: Job, stages: Stages, on_report: Callable[[Any], None] | None
) -> "tuple[Mesh, FirstOrderError | None]":
    """Read and check the solid mesh of a job; return it without unused nodes, and its first-order error."""
    from fe_models.checks.mesh_report import report_mesh
    from fe_models.meshes.unused_nodes import drop_unused_nodes

    with stages("mesh" if is_cad(job) else "read mesh"):
        mesh = part_of_mesh(job, solid_mesh_of(job))
    with stages("check mesh"):
        bricks = job.body.incompatible_modes
        report = report_mesh(mesh, materials_of(job), units=unit_system(job.body.units), incompatible_modes=bricks)
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
    """Read and check the mesh, unless it is given, and assemble it with the materials and interfaces of the job."""
    from fe_models.elements.solids.body import solid_body

    units, first_order = unit_system(job.body.units), None
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
            units=units,
            interfaces=interfaces,
            incompatible_modes=bricks,
            progress=advance,
            ranks=None if job.ties else ranks,  # tied beams modify K and M, which must then lie on rank 0
        )
        if first_order is not None:
            body = replace(body, provenance={**body.provenance, **first_order.provenance()})
    if job.ties:
        body = body_of_mixed(job, stages, body, mesh, on_report)
    return body.with_load_cases(*load_cases_of(job, body, mesh))
